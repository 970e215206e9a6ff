//! `metrics.csv` as lines over time.

use crate::{
    chart::{Axis, Chart, Event, GAP, Point},
    error::ReportError,
    look::Look,
    number,
    page::{Block, Cell, Figure, Table},
    run::{Run, faults},
    svg::Svg,
};

/// Errors, cost, distance, cells and lives over time.
pub(super) fn time_series(run: &Run) -> Result<Vec<Block>, ReportError> {
    let events = faults::events(run)?;
    let hint = if events.is_empty() {
        String::new()
    } else {
        " Dotted lines: a fault begins, by its number in the ledger below.".to_owned()
    };
    let mut blocks = vec![
        figure(
            "error",
            format!("Mean and largest error over time, as robots estimate it and as it is.{hint}"),
            errors(run, &events)?,
        ),
        figure(
            "cost",
            format!("Coverage cost H of the robots that take part (eq. 1).{hint}"),
            cost(run, &events)?,
        ),
    ];
    let distance = points(run, "mean_lamp_distance_m")?;
    if distance.iter().any(|point| point.1.is_finite()) {
        let mut chart = Chart::new(time(), Axis::new("mean distance to the lamps (m)"));
        chart.line("", &distance, Look::nth(0));
        chart.events(events.clone());
        blocks.push(figure(
            "lamp-distance",
            format!("Mean distance of the robots that take part to the middle of the lamps.{hint}"),
            chart.draw("mean distance of robots to the lamps over time"),
        ));
    }
    blocks.push(figure(
        "agreement",
        format!("Share of robots whose local cell is the global one, and share of robots alive.{hint}"),
        shares(run, &events)?,
    ));
    Ok(blocks)
}

/// Fates of packets, over time and in all.
pub(super) fn packets(run: &Run) -> Result<Vec<Block>, ReportError> {
    let times = run.metrics.full("time_s")?;
    let mut chart = Chart::new(time(), Axis::new("receptions per second").from_zero());
    let mut table = Table {
        caption: "Packet and listener pairs in range, by fate, since the start".into(),
        columns: vec!["fate".into(), "receptions".into(), "share of those in range".into()],
        rows: Vec::new(),
    };
    let last = |column: &[Option<f64>]| column.last().copied().flatten().unwrap_or(0.0);
    let possible = last(&run.metrics.numbers("packets_in_range")?)
        + last(&run.metrics.numbers_if_there("packets_duplicated")?);
    for (column, name) in FATES {
        let counts = run.metrics.numbers_if_there(column)?;
        let total = last(&counts);
        // Most fates never happen in most runs.
        if total == 0.0 {
            continue;
        }
        chart.line(name, &rates(&times, &counts), Look::nth(table.rows.len()));
        let share =
            if possible > 0.0 { number::digits(100.0 * total / possible, 3) + " %" } else { "–".into() };
        table.rows.push(vec![Cell::words(name), Cell::Number(format!("{total:.0}")), Cell::Number(share)]);
    }
    let events = faults::events(run)?;
    chart.events(events);
    Ok(vec![
        figure(
            "packets",
            "What became of packets within range, per second between two rows of metrics.csv.".into(),
            chart.draw("receptions per second by fate, over time"),
        ),
        Block::Table(table),
    ])
}

/// Columns of `metrics.csv` with what may become of a packet in range.
const FATES: [(&str, &str); 9] = [
    ("packets_heard", "heard"),
    ("packets_collided", "collided"),
    ("packets_half_duplex", "listener transmitting"),
    ("packets_lost_loss", "lost by chance"),
    ("packets_lost_fault", "lost to a fault"),
    ("packets_lost_edge", "faded at the edge of the range"),
    ("packets_occluded", "blocked by a body"),
    ("packets_over_bound", "beyond what a percept holds"),
    ("packets_delayed", "still delayed"),
];

fn errors(run: &Run, events: &[Event]) -> Result<Svg, ReportError> {
    let mut chart = Chart::new(time(), Axis::new("error (m)").log());
    chart.line("mean estimated ‖ê‖", &points(run, "mean_error_m")?, Look::nth(0));
    chart.line("largest estimated ‖ê‖", &points(run, "max_error_m")?, Look::nth(1));
    chart.line("mean true ‖C − p‖", &points(run, "mean_true_error_m")?, Look::nth(2));
    chart.events(events.to_vec());
    Ok(chart.draw("errors over time, logarithmic"))
}

fn cost(run: &Run, events: &[Event]) -> Result<Svg, ReportError> {
    let mut chart = Chart::new(time(), Axis::new("coverage cost H (φ·m⁴)"));
    chart.line("", &points(run, "cost_h")?, Look::nth(0));
    chart.events(events.to_vec());
    Ok(chart.draw("coverage cost over time"))
}

fn shares(run: &Run, events: &[Event]) -> Result<Svg, ReportError> {
    let robots = f64::from(run.scenario.robot_count());
    let alive: Vec<Point> =
        points(run, "robots_alive")?.into_iter().map(|(time, alive)| (time, alive / robots)).collect();
    let mut chart = Chart::new(time(), Axis::new("share").range(0.0, 1.02).ticks_every(0.2));
    chart.line("cells that agree", &points(run, "cell_agreement")?, Look::nth(0));
    chart.line("robots alive", &alive, Look::nth(1));
    chart.events(events.to_vec());
    Ok(chart.draw("share of cells that agree and of robots alive over time"))
}

fn time() -> Axis {
    Axis::new("time (s)")
}

/// A column over time, with gaps where it has no value.
fn points(run: &Run, column: &str) -> Result<Vec<Point>, ReportError> {
    let values = run.metrics.numbers_if_there(column)?;
    let times = run.metrics.full("time_s")?;
    Ok(times.into_iter().zip(values).map(|(time, value)| value.map_or(GAP, |value| (time, value))).collect())
}

/// Differences of a count over time, each at the end of its span.
fn rates(times: &[f64], counts: &[Option<f64>]) -> Vec<Point> {
    let rows: Vec<(f64, f64)> =
        times.iter().zip(counts).filter_map(|(&time, count)| Some((time, (*count)?))).collect();
    rows.windows(2)
        .filter(|pair| pair[1].0 > pair[0].0)
        .map(|pair| (pair[1].0, (pair[1].1 - pair[0].1) / (pair[1].0 - pair[0].0)))
        .collect()
}

fn figure(name: &str, caption: String, panel: Svg) -> Block {
    Block::Figure(Figure { name: name.into(), caption, panels: vec![panel] })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_rate_is_the_difference_of_two_rows_over_their_time() {
        let counts = [Some(0.0), Some(10.0), None, Some(40.0)];
        assert_eq!(rates(&[0.0, 2.0, 3.0, 4.0], &counts), [(2.0, 5.0), (4.0, 15.0)]);
    }
}
