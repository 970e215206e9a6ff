//! `errors.csv`: how the error of every trial falls.

use std::collections::BTreeMap;

use crate::{
    batch::{
        Batch, ByTrial, Setting,
        panels::{PANELS_MAX, panels_note},
    },
    chart::{Axis, Chart, GAP, Point},
    error::ReportError,
    look::{Dash, Look},
    page::{Block, Figure},
    stats::quantile,
    svg::Svg,
    theme::Ink,
};

/// A line is drawn with so few points that it is nowhere further off than this, in decades: half a pixel.
const FLATNESS_DECADES: f64 = 0.015;

pub(super) fn blocks(batch: &Batch) -> Result<Vec<Block>, ReportError> {
    let Some(errors) = batch.errors()? else { return Ok(Vec::new()) };
    let mut blocks: Vec<Block> = panels_note(batch).into_iter().collect();
    let panels: Vec<Svg> = batch
        .settings
        .iter()
        .take(PANELS_MAX)
        .map(|setting| decay_panel(&errors, setting, &setting.name(&batch.meta, &batch.settings)))
        .collect();
    if !panels.is_empty() {
        blocks.push(Block::Figure(Figure {
            name: "decay".into(),
            caption: "Mean estimated error over time, logarithmic: every trial thin, their median thick."
                .into(),
            panels,
        }));
    }
    Ok(blocks)
}

/// The errors of the trials of one setting, and their median.
pub fn decay_panel(errors: &ByTrial<Vec<Point>>, setting: &Setting, title: &str) -> Svg {
    let trials: Vec<&Vec<Point>> =
        errors.range((setting.number, 0)..=(setting.number, u64::MAX)).map(|(_, trial)| trial).collect();
    let mut chart = Chart::panel(Axis::new("time (s)"), Axis::new("mean ‖ê‖ (m)").log(), title);
    let thin: Vec<Vec<Point>> = trials.iter().map(|trial| flattened(trial)).collect();
    chart.thin_lines("a trial", thin.iter().map(Vec::as_slice), Ink::Soft, Dash::Solid);
    chart.line("median", &median(&trials), Look::nth(1));
    chart.draw(&format!("mean estimated error over time in {} trials, {title}", trials.len()))
}

/// The median over those trials that were still running, at each time that most were; NaN where most have no value.
fn median(trials: &[&Vec<Point>]) -> Vec<Point> {
    let mut by_time: BTreeMap<u64, Vec<f64>> = BTreeMap::new();
    for &(time_s, error) in trials.iter().copied().flatten() {
        // Times are never negative, so their bits sort as they do.
        by_time.entry(time_s.max(0.0).to_bits()).or_default().push(error);
    }
    by_time
        .into_iter()
        .filter(|(_, errors)| 2 * errors.len() > trials.len())
        .map(|(bits, errors)| {
            let known = errors.iter().filter(|error| !error.is_nan()).count();
            let median = quantile(&errors, 0.5).filter(|_| 2 * known > trials.len());
            (f64::from_bits(bits), median.unwrap_or(f64::NAN))
        })
        .collect()
}

/// The same line with fewer points, broken where it is not positive.
fn flattened(line: &[Point]) -> Vec<Point> {
    let pieces = line.split(|point| point.1 <= 0.0 || point.1.is_nan()).filter(|piece| !piece.is_empty());
    pieces.map(simplified).collect::<Vec<_>>().join(&GAP)
}

/// Ramer, Douglas and Peucker's selection of points, by vertical distances of logarithms.
fn simplified(line: &[Point]) -> Vec<Point> {
    let height = |place: usize| line[place].1.log10();
    let Some(last) = line.len().checked_sub(1) else { return Vec::new() };
    let mut kept = vec![0, last];
    let mut spans = vec![(0, last)];
    while let Some((from, to)) = spans.pop() {
        let slope = (height(to) - height(from)) / (line[to].0 - line[from].0);
        let off =
            |place: usize| (height(from) + slope * (line[place].0 - line[from].0) - height(place)).abs();
        let farthest = (from + 1..to).max_by(|&a, &b| off(a).total_cmp(&off(b)));
        if let Some(place) = farthest.filter(|&place| off(place) > FLATNESS_DECADES) {
            kept.push(place);
            spans.extend([(from, place), (place, to)]);
        }
    }
    kept.sort_unstable();
    kept.dedup();
    kept.into_iter().map(|place| line[place]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_straight_decay_is_drawn_with_two_points_and_a_bend_with_three() {
        let decay = |rate: f64, from: f64| move |i: u32| from * 10_f64.powf(-rate * f64::from(i));
        let straight: Vec<Point> = (0..100).map(|i| (f64::from(i), decay(0.05, 1.0)(i))).collect();
        assert_eq!(flattened(&straight).len(), 2);
        let bent: Vec<Point> =
            (0..100).map(|i| (f64::from(i), if i < 50 { decay(0.1, 1.0)(i) } else { 1e-5 })).collect();
        assert_eq!(flattened(&bent).iter().map(|point| point.0).collect::<Vec<_>>(), [0.0, 50.0, 99.0]);
    }

    #[test]
    fn a_line_is_broken_where_it_has_no_value() {
        let flat = flattened(&[(0.0, 1.0), (1.0, 1.0), (2.0, 1.0), (3.0, f64::NAN), (4.0, 1.0)]);
        assert_eq!(flat[..2], [(0.0, 1.0), (2.0, 1.0)]);
        assert!(flat[2].0.is_nan() && flat[2].1.is_nan());
        assert_eq!(flat[3..], [(4.0, 1.0)]);
        let trial = vec![(0.0, 1.0), (1.0, f64::NAN)];
        let median = median(&[&trial, &trial, &vec![(0.0, 1.0), (1.0, 0.5)]]);
        assert!(median[0] == (0.0, 1.0) && median[1].1.is_nan(), "most have none: {median:?}");
    }

    #[test]
    fn the_median_ends_where_half_of_the_trials_have_ended() {
        let long = vec![(0.0, 1.0), (1.0, 0.5), (2.0, 0.1)];
        let short = vec![(0.0, 3.0), (1.0, 0.7)];
        assert_eq!(median(&[&long, &short]), [(0.0, 2.0), (1.0, 0.6)]);
    }
}
