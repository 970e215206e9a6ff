//! Medians over N, one line for each peer, as SVG.
//!
//! Labels stand where the lines would arrive at the right; they say how many times the floor a tick takes at
//! the largest N that was measured. Thin bars go from the least to the greatest round.

use report::{
    chart::{Axis, Chart, Point},
    look::{Dash, Look},
    theme::Ink,
};

use crate::{
    peer::Peer,
    results::Size,
    spread::{Spread, figures},
};

/// Room for the labels at the right, in widths of what is drawn: some 24 letters.
const LABEL_ROOM: f64 = 0.38;
/// How far a label stands from where its line would arrive, in widths of what is drawn.
const LABEL_GAP: f64 = 0.02;
/// Distance that keeps two labels apart, in heights of the plot: a line of text in some 270 units.
const LINE: f64 = 0.05;

/// One peer's line.
struct Curve {
    peer: Peer,
    /// N and the rounds of it, by N.
    points: Vec<(f64, Spread)>,
    label: String,
}

/// The figure, as a file holds it.
pub(crate) fn svg(sizes: &[Size], peers: &[Peer]) -> String {
    let curves: Vec<Curve> = peers.iter().filter_map(|&peer| curve(sizes, peer)).collect();
    let (n, us) = (extent(&curves, |&(n, _)| (n, n)), extent(&curves, |(_, us)| (us.least(), us.greatest())));
    let n = (n.0.log10() - 0.1, n.1.log10());
    let width = (n.1 - n.0).max(0.5);
    // Whole decades of time, or as much as the labels need.
    let low = us.0.log10().floor();
    let high = us.1.log10().ceil().max(low + 1.0);
    let arrivals: Vec<f64> = curves.iter().map(|curve| arrival(&curve.points, n.1)).collect();
    let line = LINE * (high - low);
    let heights = apart(&arrivals, line);
    let low = heights.iter().fold(low, |low, height| low.min(height - line));
    let high = heights.iter().fold(high, |high, height| high.max(height + line));
    let power = |exponent: f64| 10_f64.powf(exponent);
    let mut chart = Chart::new(
        Axis::new("robots").log().range(power(n.0), power(n.1 + LABEL_ROOM * width)),
        Axis::new("median tick, µs").log().range(power(low), power(high)),
    );
    for curve in &curves {
        let look = look(curve.peer);
        let bars: Vec<[Point; 2]> =
            curve.points.iter().map(|&(n, us)| [(n, us.least()), (n, us.greatest())]).collect();
        let medians: Vec<Point> = curve.points.iter().map(|&(n, us)| (n, us.median())).collect();
        chart.thin_lines("", bars.iter().map(|bar| &bar[..]), look.ink, Dash::Solid);
        chart.line("", &medians, look);
        chart.dots("", &medians, look, 3.0);
    }
    let right = power(n.1 + LABEL_GAP * width);
    for (curve, height) in curves.iter().zip(heights) {
        chart.label(&curve.label, (right, power(height)), look(curve.peer).ink);
    }
    chart.draw(&about(&curves)).file("tick-cost")
}

fn curve(sizes: &[Size], peer: Peer) -> Option<Curve> {
    let mut measured: Vec<(&Size, Spread)> =
        sizes.iter().filter_map(|size| Some((size, size.spread(|round| round.tick_us(peer))?))).collect();
    measured.sort_by_key(|(size, _)| size.robots);
    let (largest, _) = measured.last()?;
    let whole = sizes.iter().all(|size| size.robots <= largest.robots);
    let times = largest.spread(|round| round.ratio(peer, Peer::Futex)).map(|ratio| ratio.median());
    let label = match times {
        _ if peer == Peer::Futex => "futex: the floor".to_owned(),
        None => peer.name().to_owned(),
        Some(times) if whole => format!("{} {}×", peer.name(), figures(times, 2)),
        Some(times) => format!("{} {}× at {}", peer.name(), figures(times, 2), largest.robots),
    };
    let points = measured.into_iter().map(|(size, us)| (f64::from(size.robots), us)).collect();
    Some(Curve { peer, points, label })
}

/// The floor is no competitor: it is gray.
fn look(peer: Peer) -> Look {
    match peer {
        Peer::Futex => Look { dash: Dash::Short, ..Look::nth(0).with_ink(Ink::Mark) },
        Peer::Lockstep => Look::nth(0),
        Peer::Idle => Look::nth(5),
        Peer::InProcess => Look::nth(2),
        Peer::Pipes => Look::nth(3),
        Peer::Sockets => Look::nth(4),
        Peer::Zeromq => Look::nth(1),
    }
}

/// Least and greatest; 1 and 10 where there is nothing.
fn extent(curves: &[Curve], of: impl Fn(&(f64, Spread)) -> (f64, f64)) -> (f64, f64) {
    let all = curves.iter().flat_map(|curve| &curve.points).map(of);
    all.reduce(|a, b| (a.0.min(b.0), a.1.max(b.1))).unwrap_or((1.0, 10.0))
}

/// The decade of time at which a line arrives at decade `n`: its last stretch, made longer.
fn arrival(points: &[(f64, Spread)], n: f64) -> f64 {
    let logs: Vec<Point> = points.iter().map(|(n, us)| (n.log10(), us.median().log10())).collect();
    match logs[..] {
        [.., before, last] if last.0 > before.0 => {
            last.1 + (n - last.0) * (last.1 - before.1) / (last.0 - before.0)
        }
        [.., last] => last.1,
        [] => 0.0,
    }
}

/// Heights near `wanted`, in its order, no two closer than `gap`.
fn apart(wanted: &[f64], gap: f64) -> Vec<f64> {
    let mut order: Vec<usize> = (0..wanted.len()).collect();
    order.sort_by(|&a, &b| wanted[a].total_cmp(&wanted[b]));
    let mut placed = wanted.to_vec();
    for pair in order.windows(2) {
        placed[pair[1]] = placed[pair[1]].max(placed[pair[0]] + gap);
    }
    // Pushed upwards only so far: half of the push goes down.
    let pushed: f64 = placed.iter().zip(wanted).map(|(placed, wanted)| placed - wanted).sum();
    let mean = pushed / wanted.len().max(1) as f64;
    placed.iter().map(|height| height - mean).collect()
}

fn about(curves: &[Curve]) -> String {
    let labels: Vec<&str> = curves.iter().map(|curve| curve.label.as_str()).collect();
    format!(
        "Median tick over the number of robots, both logarithmic, with multiples of the floor at the right: {}.",
        labels.join(", ")
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::results::Round;

    fn size(robots: u32, tick_us: &[(Peer, f64)]) -> Size {
        let round = Round { tick_us: tick_us.iter().copied().collect(), heard: None };
        Size { rounds: vec![round], ..Size::of(robots) }
    }

    #[test]
    fn labels_say_the_multiple_and_where_a_line_ends_early() {
        let sizes = [
            size(10, &[(Peer::Futex, 50.0), (Peer::Pipes, 100.0), (Peer::Idle, 60.0)]),
            size(100, &[(Peer::Futex, 500.0), (Peer::Pipes, 1700.0)]),
        ];
        let label = |peer| curve(&sizes, peer).unwrap().label;
        assert_eq!(label(Peer::Futex), "futex: the floor");
        assert_eq!(label(Peer::Pipes), "pipes 3.4×");
        assert_eq!(label(Peer::Idle), "idle 1.2× at 10");
        assert!(curve(&sizes, Peer::Zeromq).is_none());
        let svg = svg(&sizes, &[Peer::Futex, Peer::Pipes, Peer::Zeromq, Peer::Idle]);
        let pipes = look(Peer::Pipes).ink.light();
        assert!(svg.lines().any(|line| line.contains(">pipes 3.4×<") && line.contains(pipes)), "in its ink");
        for text in ["pipes 3.4×", "idle 1.2× at 10", "futex: the floor", "median tick, µs"] {
            assert!(svg.contains(&format!(">{text}<")), "{text}");
        }
        assert!(!svg.contains("zeromq"));
    }

    #[test]
    fn a_line_goes_on_as_it_went() {
        let points = [(10.0, Spread::of([100.0])), (100.0, Spread::of([1000.0]))];
        assert!((arrival(&points, 3.0) - 4.0).abs() < 1e-12);
        assert_eq!(arrival(&points[..1], 3.0), 2.0);
    }

    #[test]
    fn labels_keep_their_order_and_their_distance() {
        let placed = apart(&[2.0, 1.0, 1.01, 5.0], 0.5);
        assert!(placed[1] + 0.5 <= placed[2] + 1e-12 && placed[2] + 0.5 <= placed[0] + 1e-12);
        assert!((placed.iter().sum::<f64>() - 9.01).abs() < 1e-12, "pushed as far down as up");
        assert_eq!(apart(&[1.0, 3.0], 0.5), [1.0, 3.0], "who has room stays");
    }

    #[test]
    fn nothing_measured_is_an_empty_figure() {
        assert!(svg(&[Size::of(10)], &[Peer::Futex]).contains("</svg>"));
    }
}
