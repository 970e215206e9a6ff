//! "Near-optimal": what the linear estimate costs against the exact controller.

use super::{
    chapter::Chapter,
    evidence::{Evidence, ratios, robot_counts, series, swept_number},
};
use crate::{
    batch::Batch,
    chart::{Axis, Chart},
    error::ReportError,
    look::Look,
    number,
    page::{Block, Cell, Figure, Mark, Table},
    stats::{Stats, quantile},
};

const CLAIM: &str = "the near-optimal controller loses a negligible amount against the optimal one";
/// σ of the paper.
const PAPER_SIGMA_M: f64 = std::f64::consts::FRAC_1_SQRT_2;
/// A median loss below this share is negligible.
const NEGLIGIBLE: f64 = 1e-3;

pub(super) fn chapter(evidence: &Evidence) -> Result<Chapter, ReportError> {
    let mut chapter = Chapter::new(
        "near-optimal",
        "Near-optimal against optimal",
        "\"The control law results in near-optimal, as opposed to optimal, performance, though the difference is \
         shown to be negligible in practice.\"",
    );
    let names = [("near-optimal", "one Gaussian (eq. 20)"), ("near-optimal-two", "two Gaussians (eq. 19)")];
    let (mut panels, mut rows, mut at_paper, mut narrow) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
    for (name, field) in names {
        let Some(batch) = evidence.batch(name)? else { continue };
        panels.push(panel(&batch, field)?);
        for setting in &batch.settings {
            let (Some(sigma), ratios) = (swept_number(&batch, setting, "sigma_m"), ratios(&batch, setting)?)
            else {
                continue;
            };
            let Some(stats) = Stats::of(&ratios) else { continue };
            let median = quantile(&ratios, 0.5).unwrap_or(f64::NAN);
            if (sigma - PAPER_SIGMA_M).abs() < 1e-9 {
                at_paper.push(median);
            } else if sigma <= 0.2 {
                narrow.push(stats.mean);
            }
            rows.push(vec![
                Cell::words(field),
                Cell::number(number::digits(sigma, 3)),
                Cell::number(setting.robots.to_string()),
                Cell::number(stats.count.to_string()),
                Cell::Number(format!("{:.6} ± {:.6}", stats.mean, stats.sd)),
                Cell::Number(format!("{median:.6}")),
            ]);
        }
    }
    if panels.is_empty() {
        chapter.missing(CLAIM, "near-optimal");
        return Ok(chapter);
    }
    chapter.add(Block::Figure(Figure {
        name: "near-optimal".into(),
        caption: "Coverage cost H of the linear law over that of the exact controller from the same start, over the \
                  width σ of the Gaussians: mean and standard deviation over the trials. A ratio below 1 is a trial \
                  in which the exact controller ended in a worse local minimum."
            .into(),
        panels,
    }));
    chapter.add(Block::Table(Table {
        caption: "H under the linear law over H under the exact controller".into(),
        columns: ["field", "σ (m)", "robots", "trials", "ratio, mean ± sd", "median"]
            .map(str::to_owned)
            .to_vec(),
        rows,
    }));
    chapter.say(
        "Here:",
        "at the paper's σ = 1/√2 m the claim holds: there a Gaussian is nearly flat over a cell. Where it is narrow \
         against the cells, the linear estimate is far from φ, and the cost is 5 to 25 % higher.",
    );
    let worst = at_paper.iter().map(|ratio| (ratio - 1.0).abs()).fold(0.0, f64::max);
    let mark = if worst < NEGLIGIBLE { Mark::Corrected } else { Mark::No };
    let (low, high) = narrow
        .iter()
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), &ratio| (low.min(ratio), high.max(ratio)));
    chapter.verdict(
        CLAIM,
        mark,
        format!(
            "at the paper's σ within {:.1e}; for σ of 0.2 m and less {:+.0} to {:+.0} %",
            worst,
            100.0 * (low - 1.0),
            100.0 * (high - 1.0)
        ),
    );
    evidence.commands(&mut chapter, &["near-optimal", "near-optimal-two"])?;
    Ok(chapter)
}

fn panel(batch: &Batch, title: &str) -> Result<crate::svg::Svg, ReportError> {
    let mut chart = Chart::panel(Axis::new("σ (m)").log(), Axis::new("H linear / H exact"), title);
    for (index, robots) in robot_counts(batch).into_iter().enumerate() {
        let of = |setting: &crate::batch::Setting| {
            swept_number(batch, setting, "sigma_m").filter(|_| setting.robots == robots)
        };
        for (_, points) in series(batch, of, |_| String::new(), |setting| ratios(batch, setting))? {
            chart.spread(&format!("{robots} robots"), &points, Look::nth(index));
        }
    }
    Ok(chart.draw(&format!("ratio of costs over sigma, {title}")))
}
