//! How the end depends on what was swept.

use crate::{
    batch::{Batch, Setting, folder::short_key, folder::short_value},
    chart::{Axis, Chart, Series},
    error::ReportError,
    look::Look,
    page::{Block, Cell, Figure, Table},
    stats::Stats,
    svg::Svg,
};

/// Columns of `trials.csv` and what an axis says of them; a logarithmic axis where it is true.
const MEASURES: [(&str, &str, bool); 5] = [
    ("cost_h", "coverage cost H (φ·m⁴)", false),
    ("mean_error_m", "mean ‖ê‖ (m)", true),
    ("cell_agreement", "share of cells that agree", false),
    ("mean_lamp_distance_m", "distance to the lamps (m)", false),
    ("mean_peak_distance_m", "distance to the peak (m)", false),
];

/// From this ratio of the largest to the smallest value on, an axis of values is logarithmic.
const LOG_FROM: f64 = 20.0;

pub(super) fn blocks(batch: &Batch) -> Result<Vec<Block>, ReportError> {
    let mut blocks = Vec::new();
    let sweeps = &batch.meta.sweeps;
    let mut along: Vec<Along> =
        (0..sweeps.len()).filter(|&at| sweeps[at].values.len() > 1).map(Along::Key).collect();
    if batch.meta.robots.len() > 1 {
        along.push(Along::Robots);
    }
    for along in along {
        let name = match along {
            Along::Key(at) => sweeps[at].key.clone(),
            Along::Robots => "number of robots".into(),
        };
        let mut panels = Vec::new();
        for (column, label, log) in MEASURES {
            panels.extend(panel(batch, along, column, label, log)?);
        }
        if panels.is_empty() {
            continue;
        }
        let file = match along {
            Along::Key(at) => format!("sweep-{}", at + 1),
            Along::Robots => "sweep-robots".into(),
        };
        blocks.push(Block::Figure(Figure {
            name: file,
            caption: format!(
                "At the end of the trials over {name}: mean and standard deviation of the trials that have a value."
            ),
            panels,
        }));
        if let (Along::Key(at), Positions::Names(names)) = (along, Positions::of(batch, along)) {
            blocks.push(Block::Table(Table {
                caption: format!("Values of {name} by their numbers in the figures"),
                columns: vec!["number".into(), "value".into()],
                rows: (names.iter().zip(&sweeps[at].values))
                    .map(|(name, value)| vec![Cell::words(name.clone()), Cell::Code(value.clone())])
                    .collect(),
            }));
        }
    }
    Ok(blocks)
}

/// Quantity along a figure's x axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Along {
    /// A swept key, by its place.
    Key(usize),
    /// The number of robots.
    Robots,
}

/// Where values stand along x.
enum Positions {
    /// Values that are numbers stand at them.
    Numbers(Vec<f64>),
    /// Others stand at 1, 2, 3, under names.
    Names(Vec<String>),
}

impl Positions {
    fn of(batch: &Batch, along: Along) -> Self {
        match along {
            Along::Robots => Self::Numbers(batch.meta.robots.iter().copied().map(f64::from).collect()),
            Along::Key(at) => {
                let values = &batch.meta.sweeps[at].values;
                let numbers: Option<Vec<f64>> = values.iter().map(|value| value.parse().ok()).collect();
                match numbers {
                    Some(numbers) => Self::Numbers(numbers),
                    None if values.iter().all(|value| value.len() <= 12) => Self::Names(values.clone()),
                    None => Self::Names((1..=values.len()).map(|number| number.to_string()).collect()),
                }
            }
        }
    }

    fn at(&self, batch: &Batch, along: Along, setting: &Setting) -> Option<f64> {
        match (self, along) {
            (_, Along::Robots) => Some(f64::from(setting.robots)),
            (Self::Numbers(_), Along::Key(at)) => setting.values[at].parse().ok(),
            (Self::Names(_), Along::Key(at)) => {
                let place =
                    batch.meta.sweeps[at].values.iter().position(|value| *value == setting.values[at])?;
                Some(place as f64 + 1.0)
            }
        }
    }
}

fn panel(
    batch: &Batch,
    along: Along,
    column: &str,
    label: &str,
    log: bool,
) -> Result<Option<Svg>, ReportError> {
    let positions = Positions::of(batch, along);
    let mut series: Vec<Series> = Vec::new();
    for setting in &batch.settings {
        let Some(x) = positions.at(batch, along, setting) else { continue };
        let Some(stats) = Stats::of(&batch.measure(setting, column)?) else { continue };
        let name = others(batch, along, setting);
        let point = (x, stats.mean, stats.sd);
        match series.iter_mut().find(|(other, _)| *other == name) {
            Some((_, points)) => points.push(point),
            None => series.push((name, vec![point])),
        }
    }
    if series.is_empty() {
        return Ok(None);
    }
    let name = match along {
        Along::Key(at) => with_unit(&batch.meta.sweeps[at].key),
        Along::Robots => "robots".into(),
    };
    let x = match &positions {
        Positions::Numbers(values) => {
            let (low, high) =
                values.iter().fold((f64::INFINITY, 0.0_f64), |(low, high), &v| (low.min(v), high.max(v)));
            Axis::new(name).log_if(low > 0.0 && high / low >= LOG_FROM)
        }
        Positions::Names(names) => Axis::new(name).range(0.5, names.len() as f64 + 0.5).names(names.clone()),
    };
    let mut chart = Chart::panel(x, Axis::new(label).log_if(log), "");
    for (index, (name, points)) in series.iter_mut().enumerate() {
        points.sort_by(|a, b| a.0.total_cmp(&b.0));
        chart.spread(name, points, Look::nth(index));
    }
    Ok(Some(chart.draw(&format!("{label} over what was swept"))))
}

/// Name of a series: its values of what varies besides x; empty if nothing else does.
fn others(batch: &Batch, along: Along, setting: &Setting) -> String {
    let mut parts = Vec::new();
    if along != Along::Robots && batch.meta.robots.len() > 1 {
        parts.push(format!("n = {}", setting.robots));
    }
    for (at, (sweep, value)) in batch.meta.sweeps.iter().zip(&setting.values).enumerate() {
        if along != Along::Key(at) && sweep.values.len() > 1 {
            parts.push(format!("{} = {}", short_key(&sweep.key), short_value(value)));
        }
    }
    parts.join(", ")
}

/// A key with the unit that its name ends in.
fn with_unit(key: &str) -> String {
    let units = [("_m_per_s", "m/s"), ("_per_s", "1/s"), ("_deg", "°"), ("_m", "m"), ("_s", "s")];
    match units.into_iter().find(|(ending, _)| key.ends_with(ending)) {
        Some((_, unit)) => format!("{key} ({unit})"),
        None => key.to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_axis_has_the_unit_that_its_key_ends_in() {
        assert_eq!(with_unit("channel.range_m"), "channel.range_m (m)");
        assert_eq!(with_unit("controller.gain_per_s"), "controller.gain_per_s (1/s)");
        assert_eq!(with_unit("field.offset"), "field.offset");
    }
}
