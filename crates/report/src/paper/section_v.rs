//! Fig. 7, 8 and 9: SwarmBots around two lamps.

use super::{
    chapter::Chapter,
    evidence::{Evidence, swept},
};
use crate::{
    batch::{Batch, density_points},
    chart::{Axis, Chart, Point},
    density::{Ring, Rings},
    error::ReportError,
    look::Look,
    number,
    page::{Block, Cell, Figure, Mark, Table},
    plan::{self, bodies_alone, plan},
    stats::Stats,
};

const OFFSETS: &str = "Fig. 7: a smaller offset Φ packs the robots closer to the lamps";
const PROCESSES: &str = "the same with a process per robot (Fig. 7)";
const INITIAL: &str = "Fig. 8: dispersed robots gather within two minutes";
const DENSITY: &str = "Fig. 9: the measured density matches numerical simulation";

/// Mean distance to the lamps after 120 s by an independent implementation, 40 seeds.
const REFERENCE_M: [(&str, f64); 7] = [
    ("1600", 1.386),
    ("800", 1.280),
    ("400", 1.058),
    ("200", 0.864),
    ("100", 0.753),
    ("50", 0.696),
    ("10", 0.652),
];
/// Ours may differ from it by this share.
const REFERENCE_SHARE: f64 = 0.02;
/// Trials of the paper's Fig. 9.
const PAPER_TRIALS: u64 = 3;
/// Rings of Fig. 9.
const RINGS: usize = 12;

pub(super) fn chapter(evidence: &Evidence) -> Result<Chapter, ReportError> {
    let mut chapter = Chapter::new(
        "section-v",
        "Fig. 7, 8 and 9: SwarmBots around two lamps",
        "45 to 50 robots in an 8 foot square gather around two lamps at the middle of a wall, the closer the smaller \
         the offset Φ; the density over the distance matches numerical simulation.",
    );
    match evidence.batch("section-v")? {
        Some(batch) => {
            offsets(&mut chapter, &batch)?;
            evidence.same_as_processes(&mut chapter, PROCESSES, &batch, "section-v-processes")?;
        }
        None => chapter.missing(OFFSETS, "section-v"),
    }
    initial_and_final(&mut chapter, evidence)?;
    match evidence.batch("fig9")? {
        Some(batch) => density(&mut chapter, &batch, evidence.batch("fig9-simulation")?.as_ref())?,
        None => chapter.missing(DENSITY, "fig9"),
    }
    evidence
        .commands(&mut chapter, &["section-v", "section-v-processes", "fig8", "fig9", "fig9-simulation"])?;
    Ok(chapter)
}

fn offsets(chapter: &mut Chapter, batch: &Batch) -> Result<(), ReportError> {
    let positions = batch.positions()?.unwrap_or_default();
    let (mut panels, mut rows, mut means, mut close) = (Vec::new(), Vec::new(), Vec::new(), true);
    for setting in &batch.settings {
        let offset = swept(batch, setting, "offset").unwrap_or("?");
        if let Some(bodies) = positions.get(&(setting.number, 0)) {
            panels.push(bodies_alone(&batch.scenario, &format!("Φ = {offset}"), bodies));
        }
        let Some(stats) = Stats::of(&batch.measure(setting, "mean_lamp_distance_m")?) else { continue };
        let reference = REFERENCE_M.iter().find(|(known, _)| *known == offset).map(|(_, distance)| *distance);
        close &= reference.is_none_or(|known| (stats.mean / known - 1.0).abs() < REFERENCE_SHARE);
        means.push((offset.parse().unwrap_or(f64::NAN), stats.mean));
        rows.push(vec![
            Cell::number(offset),
            Cell::number(stats.count.to_string()),
            Cell::Number(number::mean_and_spread(stats.mean, stats.sd)),
            Cell::Number(number::or_dash(reference)),
        ]);
    }
    chapter.add(Block::Figure(Figure {
        name: "fig-7".into(),
        caption: "Fig. 7: where the robots of the first trial stand after 120 s, by offset Φ (counts)."
            .into(),
        panels,
    }));
    chapter.add(Block::Table(Table {
        caption: "Mean distance of the robots to the middle of the lamps after 120 s, mean ± standard deviation over \
                  the trials; the paper gives pictures only"
            .into(),
        columns: ["offset Φ (counts)", "trials", "here (m)", "independent reference (m)"]
            .map(str::to_owned)
            .to_vec(),
        rows,
    }));
    means.sort_by(|a: &Point, b| a.0.total_cmp(&b.0));
    let ordered = means.windows(2).all(|pair| pair[0].1 < pair[1].1);
    let (nearest, farthest) = (means.first().map(|p| p.1), means.last().map(|p| p.1));
    let agreement = if close { "as the reference has it" } else { "not as the reference has it" };
    chapter.verdict(
        OFFSETS,
        if ordered && close { Mark::Yes } else { Mark::No },
        format!("{} to {} m, {agreement}", number::or_dash(farthest), number::or_dash(nearest)),
    );
    Ok(())
}

fn initial_and_final(chapter: &mut Chapter, evidence: &Evidence) -> Result<(), ReportError> {
    let Some(run) = evidence.run("fig8")? else {
        chapter.missing(INITIAL, "fig8");
        return Ok(());
    };
    let mut panels = vec![plan(&run.scenario, "initial configuration", &run.start)];
    panels.push(plan::paths(&run.scenario, "trajectories", &run.end, &run.trajectories()));
    panels.push(plan(&run.scenario, "final configuration", &run.end));
    let said = |key: &str| {
        let summary = run.summary.as_ref();
        summary.and_then(|summary| summary.get(key)?.as_str().map(str::to_owned)).unwrap_or_default()
    };
    chapter.add(Block::Figure(Figure {
        name: "fig-8".into(),
        caption: format!(
            "Fig. 8: 50 robots at the start, on their way, and after 120 s. Engine: {}, digest {}.",
            said("engine"),
            said("digest")
        ),
        panels,
    }));
    let distances = run.metrics.numbers_if_there("mean_lamp_distance_m")?;
    let ends = [distances.first().copied().flatten(), distances.last().copied().flatten()];
    let mark = match ends {
        [Some(start), Some(end)] if end < 0.8 * start => Mark::Yes,
        _ => Mark::No,
    };
    let [start, end] = ends.map(number::or_dash);
    chapter.verdict(INITIAL, mark, format!("from {start} to {end} m from the lamps on average"));
    Ok(())
}

fn density(chapter: &mut Chapter, batch: &Batch, simulation: Option<&Batch>) -> Result<(), ReportError> {
    let Some(center) = plan::center(&batch.scenario) else { return Ok(()) };
    let rings = Rings::new(&batch.scenario, center, RINGS);
    let of = |batch: &Batch, trials: u64| -> Result<Vec<Ring>, ReportError> {
        let mut positions = batch.positions()?.unwrap_or_default();
        positions.retain(|(_, trial), _| *trial < trials);
        Ok(batch.settings.first().map(|first| density_points(&rings, &positions, first)).unwrap_or_default())
    };
    let simulated = simulation.map(|batch| of(batch, u64::MAX)).transpose()?.unwrap_or_default();
    let (few, all) = (of(batch, PAPER_TRIALS)?, of(batch, u64::MAX)?);
    let mut panels = Vec::new();
    for (title, ours) in [("three trials, as in the paper", &few), ("all trials", &all)] {
        let mut chart = Chart::panel(
            Axis::new("distance from the lamps (m)").from_zero(),
            Axis::new("robots per m²").from_zero(),
            title,
        );
        let points: Vec<_> =
            ours.iter().map(|ring| (ring.distance_m, ring.density.mean, ring.density.sd)).collect();
        chart.spread("SwarmBots, range 1 m, no walls sensed", &points, Look::nth(0));
        let line: Vec<Point> = simulated.iter().map(|ring| (ring.distance_m, ring.density.mean)).collect();
        if !line.is_empty() {
            chart.line("simulation: points, global cells, walls", &line, Look::nth(1));
        }
        panels
            .push(chart.draw(&format!("robots per square meter over the distance from the lamps, {title}")));
    }
    chapter.add(Block::Figure(Figure {
        name: "fig-9".into(),
        caption: format!(
            "Fig. 9: robots per m² over the distance from the middle of the lamps after 120 s (Φ = {}), mean and \
             standard deviation over three and over {} trials, beside the numerical simulation: points that know \
             their global Voronoi cells and the walls, under the same lamps and law.",
            number::short(batch.scenario.field.offset.get()),
            batch.trials.len(),
        ),
        panels,
    }));
    if simulated.is_empty() {
        chapter.missing(DENSITY, "fig9-simulation");
        return Ok(());
    }
    // Robots that stand in the wrong ring, as a share of all.
    let total = |rings: &[Ring]| rings.iter().map(|ring| ring.density.mean * ring.distance_m).sum::<f64>();
    let moved: f64 = all
        .iter()
        .zip(&simulated)
        .map(|(ours, theirs)| (ours.density.mean - theirs.density.mean).abs() * ours.distance_m)
        .sum();
    let share = moved / 2.0 / total(&all);
    chapter.say(
        "Here:",
        format!(
            "{:.0} % of the robots would have to stand in another ring for the densities to be equal. Bodies of \
             radius 0.065 m cannot stand as close as points, which is most of it.",
            100.0 * share
        ),
    );
    let mark = if share < 0.15 { Mark::Yes } else { Mark::No };
    chapter.verdict(DENSITY, mark, format!("{:.0} % of the robots in another ring", 100.0 * share));
    Ok(())
}
