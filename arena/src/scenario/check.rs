//! What no single value of a scenario can answer: do the values agree with each other?
//!
//! In:  a scenario whose values are each well-formed.
//! Out: the first [`Problem`], with the paths of the values that disagree.

use std::iter;

use protocol::percept::COMPONENTS_MAX;
use protocol::setup::Law;

use super::Scenario;
use super::document::Problem;
use super::number::RobotCount;
use super::tables::{ChannelModel, ChannelSpec, ControllerSpec, FieldSpec, GradientSource, RobotsSpec};

/// Largest gain k times tick length: the Euler step overshoots the centroid by more than half beyond it.
pub const MAX_GAIN_STEP: f64 = 1.5;

/// Bodies may touch: how much rounding may make two that do overlap, or pierce a wall, in meters.
const CONTACT_SLACK_M: f64 = 1e-9;

/// Sides of an arena, in meters: from a Petri dish to a county.
const SIDE_MIN_M: f64 = 1e-3;
const SIDE_MAX_M: f64 = 1e5;

/// Narrowest Gaussian or lamp, in meters: squared, it is still a normal number.
const WIDTH_MIN_M: f64 = 1e-6;

/// Highest offset or peak: sums and gradients of them stay finite.
const COUNTS_MAX: f64 = 1e12;

/// The number of robots that `count` and `positions_m` agree on.
pub(super) fn robot_count(robots: &RobotsSpec) -> Result<RobotCount, Problem> {
    let positions = robots.positions_m.as_ref().map(Vec::len);
    match (robots.count, positions) {
        (None, None) => Err(problem(&["robots"], "`count` is missing in [robots]")),
        (None, Some(positions)) => RobotCount::try_from(positions as i64)
            .map_err(|refused| problem(&["robots.positions_m"], format!("robots.positions_m: {refused}"))),
        (Some(count), Some(positions)) if count.get() as usize != positions => Err(problem(
            &["robots.count", "robots.positions_m"],
            format!("robots.count is {}, but robots.positions_m places {positions}", count.get()),
        )
        .hint("without positions_m (on the command line: --set robots.positions_m=) placement is random")),
        (Some(count), _) => Ok(count),
    }
}

/// Everything else, from the first table to the last.
pub(super) fn check(scenario: &Scenario) -> Result<(), Problem> {
    time(scenario)?;
    headings(scenario)?;
    size(scenario)?;
    room(scenario)?;
    positions_in_arena(scenario)?;
    positions_apart(scenario)?;
    field(&scenario.field)?;
    gain(scenario)?;
    gradient(&scenario.controller)?;
    bounded_cells(scenario)?;
    range(&scenario.channel)
}

fn time(scenario: &Scenario) -> Result<(), Problem> {
    let (step_s, duration_s) = (scenario.step_s.get(), scenario.duration_s.get());
    ensure(step_s <= duration_s, || {
        let message = format!("step_s = {step_s} is longer than the whole run, duration_s = {duration_s}");
        problem(&["step_s", "duration_s"], message)
    })
}

fn headings(scenario: &Scenario) -> Result<(), Problem> {
    let Some(headings) = &scenario.robots.headings_rad else { return Ok(()) };
    let count = scenario.robot_count();
    ensure(headings.len() == count as usize, || {
        problem(
            &["robots.headings_rad", "robots.count"],
            format!("robots.headings_rad lists {}, but there are {count} robots", headings.len()),
        )
        .hint("without headings_rad (on the command line: --set robots.headings_rad=) they are random")
    })
}

fn size(scenario: &Scenario) -> Result<(), Problem> {
    let [width, height] = scenario.arena.size_m.get();
    let sensible = SIDE_MIN_M..=SIDE_MAX_M;
    ensure(sensible.contains(&width) && sensible.contains(&height), || {
        let message =
            format!("an arena of {width} m x {height} m is beyond {SIDE_MIN_M} m to {SIDE_MAX_M} m a side");
        problem(&["arena.size_m"], message)
    })
}

/// Equal discs in a convex region cover at most π/sqrt(12) of it (Fejes Tóth): 2·sqrt(3)·r² each.
fn room(scenario: &Scenario) -> Result<(), Problem> {
    let paths = ["robots.radius_m", "robots.count", "arena.size_m"];
    let [width, height] = scenario.arena.size_m.get();
    let radius = scenario.robots.radius_m.get();
    ensure(2.0 * radius <= width.min(height), || {
        problem(&paths, format!("a robot of radius {radius} m does not fit into {width} m x {height} m"))
    })?;

    let count = scenario.robot_count();
    let (needed, available) = (f64::from(count) * 2.0 * 3f64.sqrt() * radius * radius, width * height);
    ensure(needed <= available, || {
        let message = format!(
            "{count} robots of radius {radius} m cannot fit: packed as densely as discs can be they need \
             {} m², the arena has {} m²",
            short(needed),
            short(available)
        );
        problem(&paths, message)
    })
}

fn positions_in_arena(scenario: &Scenario) -> Result<(), Problem> {
    let radius = scenario.robots.radius_m.get();
    let inside =
        |along: f64, side: f64| radius - CONTACT_SLACK_M <= along && along <= side - radius + CONTACT_SLACK_M;
    let [width, height] = scenario.arena.size_m.get();
    for (index, position) in scenario.robots.positions_m.iter().flatten().enumerate() {
        let [x, y] = position.get();
        ensure(inside(x, width) && inside(y, height), || {
            let message = format!(
                "robot {index} at [{x}, {y}] is not inside the arena of {width} m x {height} m: \
                 its radius is {radius} m"
            );
            problem(&[&format!("robots.positions_m.{index}"), "robots.radius_m", "arena.size_m"], message)
        })?;
    }
    Ok(())
}

/// Sweeps from left to right, so each robot meets only those less than a diameter to its right.
fn positions_apart(scenario: &Scenario) -> Result<(), Problem> {
    let diameter = 2.0 * scenario.robots.radius_m.get();
    let mut placed: Vec<_> =
        scenario.robots.positions_m.iter().flatten().map(|position| position.get()).enumerate().collect();
    placed.sort_by(|(_, a), (_, b)| a[0].total_cmp(&b[0]));
    for (place, &(i, [x, y])) in placed.iter().enumerate() {
        for &(j, [other_x, other_y]) in placed[place + 1..].iter().take_while(|(_, o)| o[0] - x < diameter) {
            let distance = libm::hypot(other_x - x, other_y - y);
            ensure(distance >= diameter - CONTACT_SLACK_M, || {
                let (first, second) = (i.min(j), i.max(j));
                let message = format!(
                    "robots {first} and {second} overlap: their centers are {} m apart, two bodies need {} m",
                    short(distance),
                    short(diameter)
                );
                problem(&[&format!("robots.positions_m.{second}"), "robots.radius_m"], message)
            })?;
        }
    }
    Ok(())
}

/// A percept has room for so many terms of φ, the offset among them.
fn field(field: &FieldSpec) -> Result<(), Problem> {
    let (peaks, room) = (field.gaussian.len() + field.lamp.len(), COMPONENTS_MAX - 1);
    ensure(peaks <= room, || {
        let message = format!("{peaks} Gaussians and lamps are more than the {room} a field can have");
        problem(&["field.lamp", "field.gaussian", "field"], message)
    })?;
    let gaussians = field.gaussian.iter().enumerate().flat_map(|(index, peak)| {
        let key = move |key| format!("field.gaussian.{index}.{key}");
        [(key("sigma_m"), WIDTH_MIN_M, peak.sigma_m.get()), (key("gamma"), -COUNTS_MAX, peak.gamma.get())]
    });
    let lamps = field.lamp.iter().enumerate().flat_map(|(index, lamp)| {
        let key = move |key| format!("field.lamp.{index}.{key}");
        [
            (key("half_distance_m"), WIDTH_MIN_M, lamp.half_distance_m.get()),
            (key("peak"), -COUNTS_MAX, lamp.peak.get()),
        ]
    });
    let offset = ("field.offset".to_owned(), -COUNTS_MAX, field.offset.get());
    for (path, least, value) in iter::once(offset).chain(gaussians).chain(lamps) {
        ensure((least..=COUNTS_MAX).contains(&value), || {
            problem(&[&path], format!("{path} = {value:e} is beyond {least:e} to {COUNTS_MAX:e}"))
        })?;
    }
    Ok(())
}

/// The `exact` law integrates over the whole cell, so the cell must end somewhere near.
fn bounded_cells(scenario: &Scenario) -> Result<(), Problem> {
    let bounded = scenario.arena.boundary_sensing || scenario.controller.cell_cap_m.is_some();
    ensure(scenario.controller.law != Law::Exact || bounded, || {
        let message = "controller.law = \"exact\" needs bounded cells: robots that sense no walls may have \
                       cells hundreds of meters long";
        problem(&["controller.law"], message)
            .hint("set arena.boundary_sensing = true, or controller.cell_cap_m (such as 2.0)")
    })
}

fn gain(scenario: &Scenario) -> Result<(), Problem> {
    let gain_per_s = scenario.controller.gain_per_s.get();
    let product = gain_per_s * scenario.step_s.get();
    ensure(product <= MAX_GAIN_STEP, || {
        let message = format!(
            "gain_per_s × step_s = {} exceeds {MAX_GAIN_STEP}, beyond which the Euler step overshoots; \
             lower one of them, e.g. step_s <= {}",
            short(product),
            floor_to_three_digits(MAX_GAIN_STEP / gain_per_s)
        );
        problem(&["controller.gain_per_s", "step_s"], message)
    })
}

fn gradient(controller: &ControllerSpec) -> Result<(), Problem> {
    let path = "controller.gradient_magnitude_per_m";
    match (controller.gradient, controller.gradient_magnitude_per_m) {
        (GradientSource::Fixed, None) => Err(problem(
            &["controller.gradient"],
            "controller.gradient = \"fixed\" needs `gradient_magnitude_per_m` in [controller]",
        )),
        (GradientSource::Measured, Some(_)) => Err(without_meaning(path, "controller.gradient", "measured")),
        (GradientSource::Fixed, Some(_)) | (GradientSource::Measured, None) => Ok(()),
    }
}

fn range(channel: &ChannelSpec) -> Result<(), Problem> {
    match (channel.model, channel.range_m) {
        (ChannelModel::Range, None) => {
            Err(problem(&["channel.model"], "channel.model = \"range\" needs `range_m` in [channel]"))
        }
        (ChannelModel::Voronoi, Some(_)) => {
            Err(without_meaning("channel.range_m", "channel.model", "voronoi"))
        }
        (ChannelModel::Range, Some(_)) | (ChannelModel::Voronoi, None) => Ok(()),
    }
}

fn without_meaning(path: &str, choice: &str, chosen: &str) -> Problem {
    problem(&[path, choice], format!("{path} has no meaning with {choice} = \"{chosen}\""))
        .hint(format!("remove it (on the command line: --set {path}=)"))
}

fn problem(paths: &[&str], message: impl Into<String>) -> Problem {
    Problem {
        paths: paths.iter().map(|path| path.to_string()).collect(),
        message: message.into(),
        hint: None,
    }
}

fn ensure(holds: bool, problem: impl FnOnce() -> Problem) -> Result<(), Problem> {
    if holds { Ok(()) } else { Err(problem()) }
}

/// For messages: at most six decimals.
fn short(value: f64) -> f64 {
    let rounded = (value * 1e6).round() / 1e6;
    if rounded.is_finite() { rounded } else { value }
}

/// For advice: never above the value.
fn floor_to_three_digits(value: f64) -> f64 {
    let scale = libm::pow(10.0, 2.0 - libm::floor(libm::log10(value)));
    (value * scale).floor() / scale
}
