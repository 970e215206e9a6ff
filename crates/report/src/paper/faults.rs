//! Section V under collisions, loss and killed robots: what the paper could not do.

use super::{
    chapter::Chapter,
    evidence::{Evidence, series, swept, swept_number},
};
use crate::{
    batch::{Batch, Setting, density_points},
    chart::{Axis, Chart, Point},
    density::Rings,
    error::ReportError,
    look::Look,
    number,
    page::{Block, Figure, Mark},
    plan,
    stats::Stats,
};

const SHORT_RANGE: &str = "Section V.A: a short range means fewer packet collisions";
/// Rings of the densities.
const RINGS: usize = 10;

/// One kind of disturbance.
struct Kind {
    name: &'static str,
    claim: &'static str,
    axis: &'static str,
    unit: &'static str,
    caption: &'static str,
    strength: fn(&Batch, &Setting) -> Option<f64>,
}

const KINDS: [Kind; 3] = [
    Kind {
        name: "collisions",
        claim: SHORT_RANGE,
        axis: "range (m)",
        unit: "m",
        caption: "Section V on the SwarmBots' own infrared (packets collide, half duplex, noise) over its range",
        strength: |batch, setting| swept_number(batch, setting, "range_m"),
    },
    Kind {
        name: "loss",
        claim: "Section V while packets are lost",
        axis: "share of packets lost",
        unit: "",
        caption: "Section V while packets are lost by chance",
        strength: |batch, setting| swept_number(batch, setting, "loss"),
    },
    Kind {
        name: "kills",
        claim: "Section V while robots are killed",
        axis: "share of robots killed at 30 s",
        unit: "",
        caption: "Section V with a share of the robots killed at 30 s; killed bodies stay where they are",
        strength: |batch, setting| share(swept(batch, setting, "fault")?),
    },
];

pub(super) fn chapter(evidence: &Evidence) -> Result<Chapter, ReportError> {
    let mut chapter = Chapter::new(
        "faults",
        "What the paper could not do: collisions, loss, killed robots",
        "\"We limited the range of the localization system to about one meter to increase the depth of the network \
         and minimize the number of inter-robot packet collisions.\" What collisions, loss and dead robots do was \
         not measured.",
    );
    for kind in KINDS {
        match evidence.batch(kind.name)? {
            Some(batch) => disturbed(&mut chapter, &kind, &batch)?,
            None => chapter.missing(kind.claim, kind.name),
        }
    }
    evidence.commands(&mut chapter, &KINDS.map(|kind| kind.name))?;
    Ok(chapter)
}

fn disturbed(chapter: &mut Chapter, kind: &Kind, batch: &Batch) -> Result<(), ReportError> {
    let measures = [
        ("cost_h", Axis::new("coverage cost H (counts·m⁴)")),
        ("mean_error_m", Axis::new("mean ‖ê‖ (m)").from_zero()),
        ("mean_lamp_distance_m", Axis::new("distance to the lamps (m)")),
    ];
    let strength = |setting: &Setting| (kind.strength)(batch, setting);
    let mut panels = Vec::new();
    for (column, axis) in measures {
        let mut chart = Chart::panel(Axis::new(kind.axis), axis, "");
        for (_, points) in
            series(batch, strength, |_| String::new(), |setting| batch.measure(setting, column))?
        {
            chart.spread("", &points, Look::nth(0));
        }
        panels.push(chart.draw(&format!("{column} over {}", kind.axis)));
    }
    let mut chart =
        Chart::panel(Axis::new(kind.axis), Axis::new("share of packets heard").range(0.0, 1.05), "");
    for (_, points) in series(batch, strength, |_| String::new(), |setting| heard(batch, setting))? {
        chart.spread("", &points, Look::nth(0));
    }
    panels.push(chart.draw(&format!("share of packets in range that are heard over {}", kind.axis)));
    panels.extend(density(kind, batch)?);
    chapter.add(Block::Figure(Figure {
        name: kind.name.into(),
        caption: format!("{}: mean and standard deviation over the trials, after 120 s.", kind.caption),
        panels,
    }));
    let mut all: Vec<(f64, &Setting)> =
        batch.settings.iter().filter_map(|setting| Some((strength(setting)?, setting))).collect();
    all.sort_by(|a, b| a.0.total_cmp(&b.0));
    let [Some((from, weak)), Some((to, strong))] = [all.first(), all.last()] else { return Ok(()) };
    let unit = if kind.unit.is_empty() { String::new() } else { format!(" {}", kind.unit) };
    let mean = |setting: &Setting, column: &str| -> Result<String, ReportError> {
        let stats = Stats::of(&batch.measure(setting, column)?);
        Ok(number::or_dash(stats.map(|stats| stats.mean)))
    };
    let gathered = format!(
        "{from}{unit} to {to}{unit}: {} to {} m from the lamps",
        mean(weak, "mean_lamp_distance_m")?,
        mean(strong, "mean_lamp_distance_m")?
    );
    if kind.claim != SHORT_RANGE {
        chapter.verdict(kind.claim, Mark::Beyond, gathered);
        return Ok(());
    }
    let shares = all.iter().map(|(_, setting)| heard(batch, setting)).collect::<Result<Vec<_>, _>>()?;
    let shares: Vec<f64> = shares.iter().filter_map(|shares| Some(Stats::of(shares)?.mean)).collect();
    let falls = shares.windows(2).all(|pair| pair[1] < pair[0]);
    let [first, last] = [shares.first(), shares.last()].map(|share| number::or_dash(share.copied()));
    let text = format!("share of packets heard {first} to {last}; {gathered}");
    chapter.verdict(kind.claim, if falls { Mark::Yes } else { Mark::No }, text);
    Ok(())
}

/// Share of the packets in range that were heard, trial by trial.
fn heard(batch: &Batch, setting: &Setting) -> Result<Vec<f64>, ReportError> {
    let (heard, in_range) =
        (batch.trials.numbers("packets_heard")?, batch.trials.numbers("packets_in_range")?);
    Ok(setting.rows.iter().filter_map(|&row| Some(heard[row]? / in_range[row]?)).collect())
}

fn density(kind: &Kind, batch: &Batch) -> Result<Option<crate::svg::Svg>, ReportError> {
    let (Some(center), Some(positions)) = (plan::center(&batch.scenario), batch.positions()?) else {
        return Ok(None);
    };
    let rings = Rings::new(&batch.scenario, center, RINGS);
    let mut chart = Chart::panel(
        Axis::new("distance from the lamps (m)").from_zero(),
        Axis::new("robots per m²").from_zero(),
        "",
    );
    for (index, setting) in batch.settings.iter().enumerate() {
        let Some(strength) = (kind.strength)(batch, setting) else { continue };
        let points: Vec<Point> = density_points(&rings, &positions, setting)
            .iter()
            .map(|ring| (ring.distance_m, ring.density.mean))
            .collect();
        chart.line(&format!("{strength} {}", kind.unit), &points, Look::nth(index));
    }
    Ok(Some(chart.draw(&format!("robots alive per square meter over distance, by {}", kind.axis))))
}

/// The share in the text of a fault plan, such as `[{kind="kill",at_s=30,share=0.2}]`; none in an empty plan.
fn share(plan: &str) -> Option<f64> {
    match plan.split_once("share=") {
        None => (plan == "[]").then_some(0.0),
        Some((_, rest)) => rest.split([',', '}', ' ']).next()?.parse().ok(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_share_of_a_kill_is_read_from_its_plan() {
        assert_eq!(share("[]"), Some(0.0));
        assert_eq!(share("[{kind=\"kill\",at_s=30,share=0.2}]"), Some(0.2));
        assert_eq!(share("[{kind=\"kill\",share=0.4, at_s=30}]"), Some(0.4));
        assert_eq!(share("[{kind=\"kill\"}]"), None);
    }
}
