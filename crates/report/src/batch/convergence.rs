//! When trials converged: distributions by tolerance, and a table.

use crate::{
    batch::{
        Batch, Setting,
        panels::{PANELS_MAX, panels_note},
    },
    chart::{Axis, Chart},
    error::ReportError,
    number,
    page::{Block, Cell, Figure, Table},
    stats::{Stats, quantile},
    svg::Svg,
    theme::Ink,
};

/// Tolerances of `trials.csv`, as its columns spell them.
pub const TOLERANCES: [&str; 5] = ["1e-3", "1e-4", "1e-5", "1e-6", "1e-7"];

/// How the errors of all robots become one number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Norm {
    /// Their mean, as in the paper.
    Mean,
    /// The largest.
    Max,
}

/// Both.
pub const NORMS: [Norm; 2] = [Norm::Mean, Norm::Max];

impl Norm {
    /// Column of `trials.csv` with the time at which this norm fell below `tolerance`.
    pub fn column(self, tolerance: &str) -> String {
        match self {
            Self::Mean => format!("mean_below_{tolerance}_s"),
            Self::Max => format!("max_below_{tolerance}_s"),
        }
    }

    fn words(self) -> &'static str {
        match self {
            Self::Mean => "mean ‖ê‖",
            Self::Max => "largest ‖ê‖",
        }
    }
}

pub(super) fn blocks(batch: &Batch) -> Result<Vec<Block>, ReportError> {
    let mut blocks: Vec<Block> = panels_note(batch).into_iter().collect();
    let mut panels = Vec::new();
    for setting in batch.settings.iter().take(PANELS_MAX) {
        panels.extend(panel(batch, setting)?);
    }
    if panels.is_empty() {
        blocks.push(Block::Text("No trial came below any of the tolerances.".into()));
        return Ok(blocks);
    }
    blocks.push(Block::Figure(Figure {
        name: "convergence".into(),
        caption: "When the mean estimated error fell below a tolerance, over the trials of a setting. A box \
                  holds the middle half, its line is the median, whiskers reach to the last trial within 1.5 \
                  box lengths. Dots are the trials, where there are no more than 200."
            .into(),
        panels,
    }));
    blocks.push(Block::Table(table(batch)?));
    Ok(blocks)
}

fn panel(batch: &Batch, setting: &Setting) -> Result<Option<Svg>, ReportError> {
    let name = setting.name(&batch.meta, &batch.settings);
    let mut groups = Vec::new();
    for tolerance in TOLERANCES {
        let times = batch.measure(setting, &Norm::Mean.column(tolerance))?;
        if !times.is_empty() {
            groups.push((tolerance.to_owned(), times));
        }
    }
    if groups.is_empty() {
        return Ok(None);
    }
    let (x, y) = (Axis::new("tolerance (m)"), Axis::new("time (s)").from_zero());
    let mut chart = Chart::panel(x, y, name.clone());
    chart.distributions(&groups, Ink::Sky);
    Ok(Some(chart.draw(&format!("times to convergence by tolerance, {name}"))))
}

fn table(batch: &Batch) -> Result<Table, ReportError> {
    let columns =
        ["setting", "norm", "tolerance (m)", "trials below", "mean ± sd (s)", "median (s)", "range (s)"];
    let mut rows = Vec::new();
    for setting in &batch.settings {
        let name = setting.name(&batch.meta, &batch.settings);
        for norm in NORMS {
            for tolerance in TOLERANCES {
                let times = batch.measure(setting, &norm.column(tolerance))?;
                let Some(stats) = Stats::of(&times) else { continue };
                let at = |share| number::or_dash(quantile(&times, share));
                rows.push(vec![
                    Cell::words(name.clone()),
                    Cell::words(norm.words()),
                    Cell::number(tolerance),
                    Cell::Number(format!("{} of {}", stats.count, setting.rows.len())),
                    Cell::Number(number::mean_and_spread(stats.mean, stats.sd)),
                    Cell::Number(at(0.5)),
                    Cell::Number(format!("{} to {}", at(0.0), at(1.0))),
                ]);
            }
        }
    }
    Ok(Table {
        caption: "Times until an error fell below a tolerance, over the trials in which it did".into(),
        columns: columns.map(str::to_owned).to_vec(),
        rows,
    })
}
