//! Local cells against global ones: what a range of one meter costs.

use super::{
    chapter::Chapter,
    evidence::{Evidence, series, swept},
};
use crate::{
    chart::{Axis, Chart, Point},
    error::ReportError,
    look::Look,
    page::{Block, Figure, Mark},
};

const CLAIM: &str = "edges longer than the range are uncommon and have little impact";
/// Share of robots whose local cell is the global one, range 1 m, by an independent implementation.
const REFERENCE: [Point; 5] = [(10.0, 0.390), (20.0, 0.693), (40.0, 0.961), (50.0, 0.986), (100.0, 1.000)];
/// Robots of the paper's experiments.
const PAPER_ROBOTS: f64 = 50.0;

pub(super) fn chapter(evidence: &Evidence) -> Result<Chapter, ReportError> {
    let mut chapter = Chapter::new(
        "local-cells",
        "Local against global cells",
        "\"We assumed that edges of greater than length one meter are uncommon in the triangulated graphs we consider \
         and the effects of removing them have little impact on the final result.\"",
    );
    let Some(batch) = evidence.batch("local-cells")? else {
        chapter.missing(CLAIM, "local-cells");
        return Ok(chapter);
    };
    let all = series(
        &batch,
        |setting| Some(f64::from(setting.robots)),
        |setting| swept(&batch, setting, "range_m").unwrap_or("?").to_owned(),
        |setting| batch.measure(setting, "cell_agreement"),
    )?;
    let mut chart = Chart::new(
        Axis::new("robots").log(),
        Axis::new("share of robots whose cell is global").range(0.0, 1.05),
    );
    for (index, (range, points)) in all.iter().enumerate() {
        let line: Vec<Point> = points.iter().map(|&(x, mean, _)| (x, mean)).collect();
        chart.line(&format!("range {range} m"), &line, Look::nth(index));
    }
    chart.dots("independent reference, 1 m", &REFERENCE, Look::nth(3), 4.5);
    chapter.add(Block::Figure(Figure {
        name: "local-cells".into(),
        caption: "Share of robots that know everybody who shapes their global cell, at random starts in the 2.44 m \
                  square of Section V, mean over the trials."
            .into(),
        panels: vec![chart.draw("share of robots whose local cell is the global one over the number of robots")],
    }));
    let one_meter = all.iter().find(|(range, _)| range == "1");
    let at_paper = one_meter.and_then(|(_, points)| points.iter().find(|point| point.0 == PAPER_ROBOTS));
    if let Some(&(_, share, _)) = at_paper {
        let mark = if share > 0.95 { Mark::Yes } else { Mark::No };
        chapter.say(
            "Here:",
            format!(
                "with 50 robots and a range of 1 m, {:.1} % of the robots have their global cell. With 10 robots \
                 most have not.",
                100.0 * share
            ),
        );
        chapter.verdict(CLAIM, mark, format!("{:.1} % of 50 robots have their global cell", 100.0 * share));
    }
    evidence.commands(&mut chapter, &["local-cells"])?;
    Ok(chapter)
}
