//! Fig. 3, Table I and Fig. 4: how fast and where 10, 100 and 1000 robots converge under eq. 20.

use super::{chapter::Chapter, evidence::Evidence};
use crate::{
    batch::{Batch, Norm, decay_panel, density_points},
    chart::{Axis, Chart, Point},
    density::Rings,
    error::ReportError,
    look::Look,
    number,
    page::{Block, Cell, Figure, Mark, Table},
    plan,
    stats::{Stats, quantile},
    theme::Ink,
};

const TABLE: &str = "Table I: times to a mean error of 1e-7 m";
const SHAPE: &str = "the time is longest for a middle size of the network";
const DECAY: &str = "Fig. 3: errors decay nearly exponentially";
const DENSITY: &str = "Fig. 4: robots are denser where φ is larger";
const PROCESSES: &str = "the same with a process per robot (10 robots)";

/// Rings of the densities.
const RINGS: usize = 16;
/// Where the fast beginning of a trial is over, meters.
const TAIL_FROM_M: f64 = 1e-3;
/// From this share of variance explained on, a decay is nearly exponential.
const STRAIGHT: f64 = 0.8;

/// One row of Table I.
struct Row {
    name: &'static str,
    robots: u32,
    trials: u32,
    /// The paper's mean and standard deviation, seconds, at 1e-7.
    paper: (f64, f64),
    /// An independent implementation's at 1e-7, and its mean at 1e-4.
    reference: (f64, f64),
    reference_coarse: f64,
}

const ROWS: [Row; 3] = [
    Row {
        name: "table1-10",
        robots: 10,
        trials: 1000,
        paper: (9.56, 3.18),
        reference: (29.89, 5.86),
        reference_coarse: 11.3,
    },
    Row {
        name: "table1-100",
        robots: 100,
        trials: 100,
        paper: (25.10, 1.23),
        reference: (211.7, 72.8),
        reference_coarse: 31.5,
    },
    Row {
        name: "table1-1000",
        robots: 1000,
        trials: 10,
        paper: (19.33, 2.14),
        reference: (1001.0, 276.0),
        reference_coarse: 15.3,
    },
];

pub(super) fn chapter(evidence: &Evidence) -> Result<Chapter, ReportError> {
    let mut chapter = Chapter::new(
        "table-1",
        "Fig. 3, Table I and Fig. 4: convergence",
        "from random starts under one Gaussian (eq. 20) the mean error falls nearly exponentially below 1e-7 m, \
         after 9.56, 25.10 and 19.33 s for 10, 100 and 1000 robots; robots end denser where φ is larger.",
    );
    let batches: Vec<(&Row, Batch)> = ROWS
        .iter()
        .filter_map(|row| Some(evidence.batch(row.name).transpose()?.map(|batch| (row, batch))))
        .collect::<Result<_, _>>()?;
    if batches.is_empty() {
        chapter.missing(TABLE, "table1-10");
        return Ok(chapter);
    }
    decay(&mut chapter, &batches)?;
    table(&mut chapter, &batches)?;
    distributions(&mut chapter, &batches)?;
    density(&mut chapter, &batches)?;
    if let Some((_, batch)) = batches.iter().find(|(row, _)| row.robots == 10) {
        evidence.same_as_processes(&mut chapter, PROCESSES, batch, "table1-10-processes")?;
    }
    let names: Vec<&str> = ROWS.iter().map(|row| row.name).chain(["table1-10-processes"]).collect();
    evidence.commands(&mut chapter, &names)?;
    Ok(chapter)
}

fn decay(chapter: &mut Chapter, batches: &[(&Row, Batch)]) -> Result<(), ReportError> {
    let (mut panels, mut straight) = (Vec::new(), Vec::new());
    for (row, batch) in batches {
        if let Some(errors) = batch.errors()? {
            let trials: Vec<f64> = errors.values().filter_map(|trial| straightness(trial)).collect();
            straight.extend(quantile(&trials, 0.5));
            let title = format!("{} robots, {} trials", row.robots, batch.trials.len());
            panels.extend(batch.settings.iter().map(|setting| decay_panel(&errors, setting, &title)));
        }
    }
    if panels.is_empty() {
        return Ok(());
    }
    chapter.add(Block::Figure(Figure {
        name: "fig-3".into(),
        caption: "Fig. 3: mean estimated error over time, every trial thin, their median thick. An exponential is a \
                  straight line here. Its slope is that of the slowest mode of the swarm, which is slower the more \
                  robots there are; large swarms now and then leave one arrangement for another, and the error \
                  rises again."
            .into(),
        panels,
    }));
    let told: Vec<String> = straight.iter().map(|share| format!("{share:.2}")).collect();
    let mark = match straight.iter().filter(|&&share| share > STRAIGHT).count() {
        0 => Mark::No,
        some if some < straight.len() => Mark::Corrected,
        _ => Mark::Yes,
    };
    chapter.verdict(
        DECAY,
        mark,
        format!("a line explains {} of the variance of log ‖ê‖ (median trial, by size)", told.join(", ")),
    );
    Ok(())
}

/// How straight the logarithm of an error is over time below [`TAIL_FROM_M`]: the share of its variance that a
/// line explains.
fn straightness(trial: &[Point]) -> Option<f64> {
    let tail: Vec<Point> = trial
        .iter()
        .filter(|(_, error)| *error > 0.0 && *error < TAIL_FROM_M)
        .map(|(time, error)| (*time, error.log10()))
        .collect();
    let count = tail.len() as f64;
    let mean = |pick: &dyn Fn(&Point) -> f64| tail.iter().map(pick).sum::<f64>() / count;
    let (x, y) = (mean(&|p| p.0), mean(&|p| p.1));
    let (xx, yy) = (mean(&|p| (p.0 - x).powi(2)), mean(&|p| (p.1 - y).powi(2)));
    let xy = mean(&|p| (p.0 - x) * (p.1 - y));
    (tail.len() > 2 && xx > 0.0 && yy > 0.0).then(|| xy * xy / (xx * yy))
}

fn times(batch: &Batch, tolerance: &str) -> Result<Vec<f64>, ReportError> {
    let columns = batch.settings.iter().map(|setting| batch.measure(setting, &Norm::Mean.column(tolerance)));
    Ok(columns.collect::<Result<Vec<_>, _>>()?.concat())
}

fn table(chapter: &mut Chapter, batches: &[(&Row, Batch)]) -> Result<(), ReportError> {
    let (mut rows, mut coarse_means, mut as_printed, mut as_reference) = (Vec::new(), Vec::new(), true, true);
    for (row, batch) in batches {
        for (tolerance, paper, reference) in [
            ("1e-7", Some(row.paper), (row.reference.0, Some(row.reference.1))),
            ("1e-4", None, (row.reference_coarse, None)),
        ] {
            let times = times(batch, tolerance)?;
            let Some(stats) = Stats::of(&times) else { continue };
            let off = (stats.mean - reference.0) / stats.se();
            match paper {
                Some((mean, _)) => {
                    as_printed &= (stats.mean - mean).abs() < 3.0 * stats.se();
                    as_reference &= match row.robots {
                        // Few trials, each of many minutes: the spread is that of the reference.
                        1000 => (stats.mean - reference.0).abs() < 2.0 * row.reference.1,
                        _ => off.abs() < 3.0,
                    };
                }
                None => coarse_means.push(stats.mean),
            }
            let spread = |(mean, sd): (f64, f64)| number::mean_and_spread(mean, sd);
            rows.push(vec![
                Cell::number(row.robots.to_string()),
                Cell::Number(format!("{} of {}", stats.count, row.trials)),
                Cell::number(tolerance),
                Cell::Number(paper.map_or("–".into(), |paper| format!("{:.2} ± {:.2}", paper.0, paper.1))),
                Cell::Number(spread((stats.mean, stats.sd))),
                Cell::Number(match reference.1 {
                    Some(sd) => spread((reference.0, sd)),
                    None => number::digits(reference.0, 3),
                }),
                Cell::Number(format!("{off:+.1}")),
                Cell::Number(number::or_dash(quantile(&times, 0.5))),
            ]);
        }
    }
    chapter.add(Block::Table(Table {
        caption: "Table I: seconds until the mean estimated error falls below a tolerance, mean ± standard deviation. The \
                  reference is an independent implementation; the difference is in standard errors of our mean."
            .into(),
        columns: [
            "robots",
            "of the paper's trials",
            "tolerance (m)",
            "the paper (s)",
            "here (s)",
            "reference (s)",
            "difference (standard errors)",
            "median here (s)",
        ]
        .map(str::to_owned)
        .to_vec(),
        rows,
    }));
    chapter.say(
        "Here:",
        "the printed times are not those of a mean error below 1e-7 m. At 1e-4 m they have the paper's size and \
         its shape: longest for 100 robots. At 1e-7 m the time keeps growing with the number of robots, because \
         the last decades are the slowest mode's. Two implementations that share no code agree on that.",
    );
    let mark = match (as_printed, as_reference) {
        (true, _) => Mark::Yes,
        (false, _) => Mark::No,
    };
    let agreement = if as_reference { "agrees with" } else { "differs from" };
    chapter.verdict(TABLE, mark, format!("other times; {agreement} an independent implementation"));
    if let [ten, hundred, thousand] = coarse_means[..] {
        let has_shape = hundred > ten && hundred > thousand;
        let mark = if has_shape { Mark::Corrected } else { Mark::No };
        let short = |value| number::digits(value, 3);
        chapter.verdict(
            SHAPE,
            mark,
            format!("at 1e-4 m: {}, {}, {} s; not at 1e-7 m", short(ten), short(hundred), short(thousand)),
        );
    }
    Ok(())
}

fn distributions(chapter: &mut Chapter, batches: &[(&Row, Batch)]) -> Result<(), ReportError> {
    let mut panels = Vec::new();
    for tolerance in ["1e-7", "1e-4"] {
        let mut groups = Vec::new();
        for (row, batch) in batches {
            groups.push((row.robots.to_string(), times(batch, tolerance)?));
        }
        let mut chart = Chart::panel(
            Axis::new("robots"),
            Axis::new("time (s)").log(),
            format!("mean ‖ê‖ below {tolerance} m"),
        );
        chart.distributions(&groups, Ink::Sky);
        panels.push(chart.draw(&format!("distributions of the time to a mean error of {tolerance} m")));
    }
    chapter.add(Block::Figure(Figure {
        name: "table-1".into(),
        caption:
            "The distributions behind Table I. Boxes hold the middle half, whiskers reach to the last trial \
                  within 1.5 box lengths; dots are trials, where there are no more than 200."
                .into(),
        panels,
    }));
    Ok(())
}

fn density(chapter: &mut Chapter, batches: &[(&Row, Batch)]) -> Result<(), ReportError> {
    let (mut panels, mut falls) = (Vec::new(), true);
    for (row, batch) in batches {
        let (Some(center), Some(positions)) = (plan::center(&batch.scenario), batch.positions()?) else {
            continue;
        };
        let rings = Rings::new(&batch.scenario, center, RINGS);
        for setting in &batch.settings {
            let ours = density_points(&rings, &positions, setting);
            let means: Vec<Point> = ours.iter().map(|ring| (ring.distance_m, ring.density.mean)).collect();
            let (near, far): (Vec<Point>, Vec<Point>) =
                means.iter().partition(|(distance, _)| *distance < 0.4);
            falls &= mean(&near) > mean(&far);
            let mut chart = Chart::panel(
                Axis::new("distance from the peak (m)").from_zero(),
                Axis::new("robots per m²").from_zero(),
                format!("{} robots", row.robots),
            );
            chart.steps("here", &rings.as_steps(&means), Look::nth(0));
            chart.line("√φ, as many robots", &rings.ideal(f64::from(row.robots)), Look::nth(1));
            panels.push(
                chart.draw(&format!("density of {} robots over the distance from the peak", row.robots)),
            );
        }
    }
    if panels.is_empty() {
        return Ok(());
    }
    chapter.add(Block::Figure(Figure {
        name: "fig-4".into(),
        caption:
            "Fig. 4: robots per m² at the end, in rings around the peak cut to the square, mean over the \
                  trials; beside √φ, which the density of many robots tends to. Few robots stand on few \
                  configurations, hence the jags."
                .into(),
        panels,
    }));
    let mark = if falls { Mark::Yes } else { Mark::No };
    chapter.verdict(DENSITY, mark, "denser within 0.4 m of the peak than beyond, for every size");
    Ok(())
}

fn mean(points: &[Point]) -> f64 {
    points.iter().map(|point| point.1).sum::<f64>() / points.len().max(1) as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_exponential_decay_is_straight_and_a_wave_is_not() {
        let decay: Vec<Point> = (0..50).map(|i| (f64::from(i), 1e-4 * (-0.3 * f64::from(i)).exp())).collect();
        assert!((straightness(&decay).unwrap() - 1.0).abs() < 1e-12);
        let wave: Vec<Point> = (0..50).map(|i| (f64::from(i), 1e-4 * (2.0 + (f64::from(i)).sin()))).collect();
        assert!(straightness(&wave).unwrap() < 0.2);
        assert_eq!(straightness(&decay[..2]), None);
    }
}
