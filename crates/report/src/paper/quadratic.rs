//! The paper's outlook: a quadratic fit of φ from shared readings.

use super::{
    chapter::Chapter,
    evidence::{Evidence, ratios, series, swept, swept_number},
};
use crate::{
    batch::Batch,
    chart::{Axis, Chart},
    error::ReportError,
    look::Look,
    page::{Block, Figure, Mark},
    stats::Stats,
    svg::Svg,
};

const CLAIM: &str = "outlook: sharing readings of φ makes \"exciting possibilities conceivable\"";

pub(super) fn chapter(evidence: &Evidence) -> Result<Chapter, ReportError> {
    let mut chapter = Chapter::new(
        "quadratic",
        "Sharing readings: the quadratic law",
        "\"Each robot might estimate the sensory function from a quadratic fit of its own and each of its Voronoi \
         neighbors' measured values of φ(q).\"",
    );
    let Some(batch) = evidence.batch("quadratic")? else {
        chapter.missing(CLAIM, "quadratic");
        return Ok(chapter);
    };
    let mut panels =
        vec![panel(&batch, "sigma_m", Axis::new("σ (m)").log(), "over the width of the Gaussian")?];
    if let Some(lossy) = evidence.batch("quadratic-loss")? {
        panels.push(panel(
            &lossy,
            "loss",
            Axis::new("share of packets lost"),
            "over packet loss, σ = 0.2 m",
        )?);
    }
    chapter.add(Block::Figure(Figure {
        name: "quadratic".into(),
        caption:
            "Coverage cost H over that of the exact controller from the same start, 20 robots under one \
                  Gaussian: mean and standard deviation over the trials."
                .into(),
        panels,
    }));
    let loss = |law: &str| -> Result<Option<f64>, ReportError> {
        let at = |setting: &&crate::batch::Setting| {
            swept(&batch, setting, "law") == Some(law) && swept(&batch, setting, "sigma_m") == Some("0.2")
        };
        let found = batch.settings.iter().find(at).map(|setting| ratios(&batch, setting)).transpose()?;
        Ok(found.and_then(|ratios| Stats::of(&ratios)).map(|stats| 100.0 * (stats.mean - 1.0)))
    };
    if let (Some(linear), Some(quadratic)) = (loss("linear")?, loss("quadratic")?) {
        chapter.say(
            "Here:",
            format!(
                "at σ = 0.2 m the linear law costs {linear:.1} % more than the exact one, the quadratic law \
                 {quadratic:.1} %. A reading is 4 of the 18 bytes of a packet; packets carry it anyway."
            ),
        );
        let mark = if quadratic < linear { Mark::Yes } else { Mark::No };
        chapter.verdict(
            CLAIM,
            mark,
            format!("loss at σ = 0.2 m: linear {linear:.1} %, quadratic {quadratic:.1} %"),
        );
    }
    evidence.commands(&mut chapter, &["quadratic", "quadratic-loss"])?;
    Ok(chapter)
}

fn panel(batch: &Batch, key: &str, x: Axis, title: &str) -> Result<Svg, ReportError> {
    let mut chart = Chart::panel(x, Axis::new("H / H exact"), title);
    let all = series(
        batch,
        |setting| swept_number(batch, setting, key),
        |setting| swept(batch, setting, "law").unwrap_or("law").to_owned(),
        |setting| ratios(batch, setting),
    )?;
    for (index, (law, points)) in all.iter().enumerate() {
        chart.spread(law, points, Look::nth(index));
    }
    Ok(chart.draw(&format!("ratio of costs of the linear and the quadratic law, {title}")))
}
