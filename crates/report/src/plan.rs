//! A swarm seen from above: robots, their global cells, the peaks or lamps, trajectories.

use arena::{frame::ArenaPoint, metrics::Partition};
use kuva::plot::scatter::MarkerShape;
use scenario::Scenario;

use crate::{
    chart::{Axis, Chart, Point},
    look::{Dash, Look},
    svg::Svg,
    theme::Ink,
};

/// A robot as it is drawn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Body {
    /// Where it is, meters.
    pub at: Point,
    /// Whether it takes part: neither down nor paused.
    pub present: bool,
}

/// The middle of a field's peaks or lamps, or of the first peak alone: what distances are measured from.
///
/// Lamps hang side by side, so their middle stands for them, as in the paper; of several Gaussians no
/// middle stands for all, so there is none.
pub fn center(scenario: &Scenario) -> Option<Point> {
    let lamps: Vec<[f64; 2]> = scenario.field.lamp.iter().map(|lamp| lamp.position_m.get()).collect();
    let peaks: Vec<[f64; 2]> = scenario.field.gaussian.iter().map(|peak| peak.center_m.get()).collect();
    let middle = |points: &[[f64; 2]]| {
        let mean = |axis: usize| points.iter().map(|point| point[axis]).sum::<f64>() / points.len() as f64;
        (mean(0), mean(1))
    };
    match (lamps.is_empty(), peaks.len()) {
        (false, 0) => Some(middle(&lamps)),
        (true, 1) => Some(middle(&peaks)),
        _ => None,
    }
}

/// Draws `bodies` with their cells.
pub fn plan(scenario: &Scenario, title: &str, bodies: &[Body]) -> Svg {
    draw(scenario, title, bodies, &[], true)
}

/// Draws `bodies` without their cells.
pub fn bodies_alone(scenario: &Scenario, title: &str, bodies: &[Body]) -> Svg {
    draw(scenario, title, bodies, &[], false)
}

/// Draws the `trajectories` of `bodies`, which stand at their ends.
pub fn paths(scenario: &Scenario, title: &str, bodies: &[Body], trajectories: &[Vec<Point>]) -> Svg {
    draw(scenario, title, bodies, trajectories, false)
}

fn draw(scenario: &Scenario, title: &str, bodies: &[Body], trajectories: &[Vec<Point>], cells: bool) -> Svg {
    let size_m = scenario.arena.size_m.get();
    let [width, height] = size_m;
    let step = tick_step(width.max(height));
    let axis = |name: &str, length: f64| {
        let margin = 0.03 * width.max(height);
        Axis::new(name).range(-margin, length + margin).ticks_every(step)
    };
    let mut chart = Chart::plan(axis("x (m)", width), axis("y (m)", height), title);
    let (present, down): (Vec<Body>, Vec<Body>) = bodies.iter().partition(|body| body.present);
    if cells {
        for cell in global_cells(&present, size_m) {
            chart.outline(&cell, Ink::Soft, 0.9);
        }
        chart.entry("global cell", thin(Dash::Solid));
    }
    chart.outline(&[(0.0, 0.0), (width, 0.0), (width, height), (0.0, height)], Ink::Text, 1.2);
    if !trajectories.is_empty() {
        let lines = trajectories.iter().map(Vec::as_slice);
        chart.thin_lines("trajectory", lines, Ink::Blue, Dash::Short);
    }
    let at = |bodies: &[Body]| bodies.iter().map(|body| body.at).collect::<Vec<Point>>();
    let blue = Look { ink: Ink::Blue, dash: Dash::Solid, marker: MarkerShape::Circle };
    if !present.is_empty() {
        chart.dots("robot", &at(&present), blue, 3.6);
    }
    if !down.is_empty() {
        let gray = Look { ink: Ink::Mark, marker: MarkerShape::Square, ..blue };
        chart.dots("robot that is down", &at(&down), gray, 3.2);
    }
    let spots = |points: Vec<[f64; 2]>| points.into_iter().map(|[x, y]| (x, y)).collect::<Vec<Point>>();
    let peaks = spots(scenario.field.gaussian.iter().map(|peak| peak.center_m.get()).collect());
    if !peaks.is_empty() {
        let cross = Look { ink: Ink::Vermillion, marker: MarkerShape::Cross, ..blue };
        chart.dots("center of a Gaussian", &peaks, cross, 5.0);
    }
    let lamps = spots(scenario.field.lamp.iter().map(|lamp| lamp.position_m.get()).collect());
    if !lamps.is_empty() {
        let star = Look { ink: Ink::Vermillion, marker: MarkerShape::Diamond, ..blue };
        chart.dots("lamp", &lamps, star, 5.0);
    }
    chart.draw(&format!("{title}: {} robots in an arena of {width} by {height} m", bodies.len()))
}

fn thin(dash: Dash) -> crate::legend::Sample {
    crate::legend::Sample::Thin(Look { ink: Ink::Soft, dash, marker: MarkerShape::Circle })
}

/// The global cells of the robots, in the arena.
fn global_cells(present: &[Body], size_m: [f64; 2]) -> Vec<Vec<Point>> {
    let sites: Vec<ArenaPoint> = present.iter().map(|body| ArenaPoint::new(body.at.0, body.at.1)).collect();
    let partition = Partition::new(sites.clone(), size_m);
    let corners = partition
        .cells()
        .iter()
        .zip(&sites)
        .map(|(cell, site)| cell.iter().map(|corner| (corner.x + site.x, corner.y + site.y)).collect());
    corners.collect()
}

/// About five ticks along `length`, at multiples of 1, 2 or 5.
fn tick_step(length: f64) -> f64 {
    let rough = length / 5.0;
    let decade = 10_f64.powf(rough.log10().floor());
    let step = [1.0, 2.0, 5.0, 10.0].into_iter().find(|&step| step * decade >= 0.99 * rough);
    step.unwrap_or(10.0) * decade
}

#[cfg(test)]
mod tests {
    use super::*;

    fn scenario(field: &str) -> Scenario {
        let text = format!(
            "duration_s = 1\nstep_s = 0.1\narena.size_m = [2.0, 1.0]\nrobots.count = 3\n\
             controller.gain_per_s = 1\nchannel.range_m = 1\n{field}"
        );
        Scenario::parse("test", &text, &[]).unwrap()
    }

    #[test]
    fn distances_are_measured_from_the_middle_of_the_lamps_or_from_the_only_peak() {
        let lamp = "{ position_m = [1.0, 0], peak = 500, half_distance_m = 0.5 }";
        let other = "{ position_m = [2.0, 0], peak = 500, half_distance_m = 0.5 }";
        assert_eq!(center(&scenario(&format!("field.lamp = [{lamp}, {other}]"))), Some((1.5, 0.0)));
        let peak = "{ center_m = [0.2, 0.2], sigma_m = 0.5 }";
        assert_eq!(center(&scenario(&format!("field.gaussian = [{peak}]"))), Some((0.2, 0.2)));
        assert_eq!(center(&scenario(&format!("field.gaussian = [{peak}, {peak}]"))), None);
        assert_eq!(center(&scenario("field.offset = 1")), None);
    }

    #[test]
    fn the_cells_of_a_plan_tile_the_arena() {
        let bodies = [(0.2, 0.3), (1.7, 0.4), (1.0, 0.9)].map(|at| Body { at, present: true });
        let area = |cell: &Vec<Point>| {
            let next = cell.iter().cycle().skip(1);
            cell.iter().zip(next).map(|(a, b)| a.0 * b.1 - a.1 * b.0).sum::<f64>() / 2.0
        };
        let areas: f64 = global_cells(&bodies, [2.0, 1.0]).iter().map(area).sum();
        assert!((areas - 2.0).abs() < 1e-12, "{areas}");
    }

    #[test]
    fn ticks_stand_at_round_numbers() {
        let steps = [(1.0, 0.2), (2.4384, 0.5), (10.0, 2.0), (0.03, 0.01)];
        assert!(steps.iter().all(|&(length, step)| (tick_step(length) - step).abs() < 1e-12));
    }
}
