//! Checks whether the values of a scenario agree with each other, which no single value can answer.
//!
//! In:  a scenario whose values are each well-formed.
//! Out: the first [`Problem`], with the paths of the values that disagree.

use std::iter;

use coverage::reading::READING_BYTES;
use protocol::percept::COMPONENTS_MAX;

use super::channel::{Access, ChannelModel, ChannelSpec};
use super::controller::{Gradient, LawSpec};
use super::fault;
use super::file::field::FieldSpec;
use super::light::{COUNTS_MAX, LightSpec, WIDTH_MIN_M};
use super::number::Positive;
use super::problem::{Problem, ensure, problem};
use super::scenario::Scenario;
use super::steps::ROUNDING;

/// Largest gain k times tick length: the Euler step overshoots the centroid by more than half beyond it.
pub const MAX_GAIN_STEP: f64 = 1.5;

/// Bodies may touch: how much rounding may make two that do overlap, or pierce a wall, in meters.
const CONTACT_SLACK_M: f64 = 1e-9;

/// Sides of an arena, in meters: from a Petri dish to a county.
const SIDE_MIN_M: f64 = 1e-3;
const SIDE_MAX_M: f64 = 1e5;

/// Largest cap of cells, in meters: as far as an arena is wide. So no cell needs more halvings of its triangles than
/// `coverage::quadrature::HALVINGS_MAX`.
const CELL_CAP_MAX_M: f64 = SIDE_MAX_M;

/// Finest step of a converter, counts: far below any noise, and no quotient overflows.
const COUNTS_MIN: f64 = 1e-9;

/// Largest drift of a clock, parts per million: far beyond any oscillator.
const DRIFT_MAX_PPM: f64 = 1e5;

/// Everything that no table can answer alone, from the first table to the last. `is_given` tells of a path whether the
/// file or an override gives it.
pub(super) fn check(scenario: &Scenario, is_given: &dyn Fn(&str) -> bool) -> Result<(), Problem> {
    time(scenario)?;
    headings(scenario)?;
    size(scenario)?;
    room(scenario)?;
    positions_in_arena(scenario)?;
    positions_apart(scenario)?;
    field(&scenario.field)?;
    for (index, law) in scenario.controllers.iter().enumerate().filter_map(|(at, it)| Some((at, it.law()?))) {
        let entry = format!("controller.{index}");
        let path = if is_given(&entry) { &entry } else { "controller" };
        gain(path, law, scenario)?;
        cell_cap(path, law)?;
        bounded_cells(path, law, scenario)?;
        room_for_readings(path, scenario)?;
        light(path, law, scenario)?;
    }
    light_of_lamps(scenario)?;
    reach(&scenario.channel)?;
    cycle(scenario)?;
    clocks(scenario)?;
    air(&scenario.channel)?;
    fast_clocks(scenario)?;
    measurement(scenario)?;
    fault::check::check(&scenario.fault, &scenario.setting(), is_given)?;
    ensure(!scenario.fuzz.kinds.is_empty(), || {
        problem(&["fuzz.kinds"], "fuzz.kinds is empty: no fault can be drawn")
    })
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

fn cell_cap(path: &str, law: &LawSpec) -> Result<(), Problem> {
    let cap_m = law.cell_cap_m.map_or(0.0, Positive::get);
    ensure(cap_m <= CELL_CAP_MAX_M, || {
        let path = format!("{path}.cell_cap_m");
        let message =
            format!("{path} = {cap_m:e} is beyond {CELL_CAP_MAX_M:e}, the side of the largest arena");
        problem(&[&path], message).hint("without the key cells are not capped")
    })
}

/// The `exact` law integrates over the whole cell, so the cell must end somewhere near.
fn bounded_cells(path: &str, law: &LawSpec, scenario: &Scenario) -> Result<(), Problem> {
    let bounded = scenario.arena.boundary_sensing || law.cell_cap_m.is_some();
    ensure(!law.law.needs_field() || bounded, || {
        let message = format!(
            "{path}.law = \"exact\" needs bounded cells: robots that sense no walls may have cells hundreds of meters \
             long"
        );
        problem(&[&format!("{path}.law")], message)
            .hint("set arena.boundary_sensing = true, or controller.cell_cap_m (such as 2.0)")
    })
}

/// The paper's robots share their light readings.
fn room_for_readings(path: &str, scenario: &Scenario) -> Result<(), Problem> {
    let limit = scenario.channel.payload_bytes_max.get();
    ensure(usize::from(limit) >= READING_BYTES, || {
        let message = format!(
            "channel.payload_bytes_max = {limit} is less than the {READING_BYTES} bytes that robots of {path} send"
        );
        problem(&["channel.payload_bytes_max"], message)
    })
}

/// A command stands for a whole neighbor cycle.
fn gain(path: &str, law: &LawSpec, scenario: &Scenario) -> Result<(), Problem> {
    let (gain_per_s, cycle_s) = (law.gain_per_s.get(), scenario.cycle_s());
    let product = gain_per_s * cycle_s;
    let span = if cycle_s == scenario.step_s.get() { "step_s" } else { "channel.cycle_s" };
    ensure(product <= MAX_GAIN_STEP, || {
        let message = format!(
            "gain_per_s × {} = {} exceeds {MAX_GAIN_STEP}, beyond which the Euler step overshoots; \
             lower one of them, e.g. {span} <= {}",
            span.rsplit('.').next().unwrap_or(span),
            short(product),
            floor_to_three_digits(MAX_GAIN_STEP / gain_per_s)
        );
        problem(&[&format!("{path}.gain_per_s"), span], message)
    })
}

/// Light by which a law can go.
fn light(path: &str, law: &LawSpec, scenario: &Scenario) -> Result<(), Problem> {
    let is_fixed = matches!(law.gradient, Gradient::Fixed { .. });
    ensure(is_fixed || scenario.light == LightSpec::Ideal || scenario.field.lamp.is_empty(), || {
        let path = format!("{path}.gradient");
        let message =
            format!("a ring of diodes tells a direction, but no gradient: it needs {path} = \"fixed\"");
        problem(&["light.sensor", &path], message)
    })
}

fn light_of_lamps(scenario: &Scenario) -> Result<(), Problem> {
    let LightSpec::Ring(ring) = &scenario.light else { return Ok(()) };
    ensure(!scenario.field.lamp.is_empty(), || {
        problem(&["light.sensor"], "light.sensor = \"ring\" needs lamps, and the field has none")
    })?;
    for (index, lamp) in scenario.field.lamp.iter().enumerate() {
        let (path, peak) = (format!("field.lamp.{index}.peak"), lamp.peak.get());
        ensure(peak >= 0.0, || {
            problem(&[&path], format!("{path} = {peak}: a diode sees no darkness; peaks are zero or more"))
        })?;
    }
    let bounded = [
        ("height_m", ring.height_m.get(), WIDTH_MIN_M, SIDE_MAX_M),
        ("gain_mismatch", ring.gain_mismatch.get(), 0.0, 1.0),
        ("noise_counts", ring.noise_counts.get(), 0.0, COUNTS_MAX),
        ("adc_max_counts", ring.adc_max_counts.get(), COUNTS_MIN, COUNTS_MAX),
        ("adc_step_counts", ring.adc_step_counts.get(), COUNTS_MIN, COUNTS_MAX),
    ];
    for (key, value, least, most) in bounded {
        ensure((least..=most).contains(&value), || {
            let message = format!("light.{key} = {value:e} is beyond {least:e} to {most:e}");
            problem(&[&format!("light.{key}")], message)
        })?;
    }
    Ok(())
}

fn reach(channel: &ChannelSpec) -> Result<(), Problem> {
    let ChannelModel::Range { range_m, soft_edge_m, interference_range_m } = channel.model else {
        return Ok(());
    };
    let (range_m, edge_m, interference_m) = (range_m.get(), soft_edge_m.get(), interference_range_m.get());
    ensure(edge_m <= range_m, || {
        let message = format!("the soft edge of {edge_m} m is wider than the range of {range_m} m");
        problem(&["channel.soft_edge_m", "channel.range_m"], message)
    })?;
    ensure(interference_m >= range_m, || {
        let message = format!(
            "channel.interference_range_m = {interference_m} is less than range_m = {range_m}: a packet that can be \
             read disturbs as well"
        );
        problem(&["channel.interference_range_m", "channel.range_m"], message)
            .hint("without it (on the command line: --set channel.interference_range_m=) it is range_m")
    })
}

fn cycle(scenario: &Scenario) -> Result<(), Problem> {
    let (cycle_s, step_s) = (scenario.cycle_s(), scenario.step_s.get());
    let duration_s = scenario.time_of(scenario.ticks()).min(scenario.duration_s.get());
    ensure(cycle_s >= step_s * (1.0 - ROUNDING), || {
        let message =
            format!("channel.cycle_s = {cycle_s} is shorter than a tick, step_s = {step_s}; lower step_s");
        problem(&["channel.cycle_s", "step_s"], message)
    })?;
    ensure(cycle_s <= duration_s, || {
        let message =
            format!("channel.cycle_s = {cycle_s} is longer than the whole run, duration_s = {duration_s}");
        problem(&["channel.cycle_s", "channel.profile", "duration_s"], message)
    })
}

/// A robot's timer fires once per cycle, whatever its clock is like.
fn clocks(scenario: &Scenario) -> Result<(), Problem> {
    let (drift_ppm, jitter_s) =
        (scenario.processes.clock_drift_ppm.get(), scenario.processes.timer_jitter_s.get());
    ensure(drift_ppm <= DRIFT_MAX_PPM, || {
        let message = format!(
            "processes.clock_drift_ppm = {drift_ppm} is more than {DRIFT_MAX_PPM}, a tenth of all time; quartz \
             drifts by some 50"
        );
        problem(&["processes.clock_drift_ppm"], message)
    })?;
    let cycle_s = scenario.cycle_s();
    ensure(jitter_s < cycle_s, || {
        let message = format!(
            "processes.timer_jitter_s = {jitter_s} is not less than a neighbor cycle, {cycle_s} s: timers would \
             overtake themselves"
        );
        problem(&["processes.timer_jitter_s", "channel.cycle_s", "step_s"], message)
    })
}

/// Packets of one robot never overlap, and each fits where it is to be.
fn air(channel: &ChannelSpec) -> Result<(), Problem> {
    let Some(air) = channel.air() else { return Ok(()) };
    let (cycle_s, airtime_s) = (channel.cycle_s.get(), air.airtime_s.get());
    ensure(airtime_s <= cycle_s, || {
        let message = format!(
            "a packet of channel.airtime_s = {airtime_s} is longer than the cycle, channel.cycle_s = {cycle_s}"
        );
        problem(&["channel.airtime_s", "channel.cycle_s", "channel.profile"], message)
    })?;
    let fits = |needed_s: f64| needed_s <= cycle_s * (1.0 + ROUNDING);
    match air.access {
        Access::Random { guard_s } | Access::Aligned { guard_s } => {
            let guard_s = guard_s.get();
            ensure((airtime_s..=cycle_s).contains(&guard_s), || {
                let message = format!(
                    "channel.guard_s = {guard_s} is not between airtime_s = {airtime_s} (a packet ends in its \
                     own cycle) and cycle_s = {cycle_s}"
                );
                problem(&["channel.guard_s", "channel.airtime_s"], message)
            })
        }
        Access::Slotted { slots } => ensure(fits(f64::from(slots.get()) * airtime_s), || {
            let message = format!(
                "{slots} slots of channel.airtime_s = {airtime_s} do not fit into cycle_s = {cycle_s}"
            );
            problem(&["channel.slots", "channel.airtime_s"], message)
        }),
        Access::FixedPhase { jitter_s } => {
            let jitter_s = jitter_s.get();
            ensure(fits(jitter_s + airtime_s), || {
                let message = format!(
                    "channel.jitter_s = {jitter_s} and airtime_s = {airtime_s} do not fit into cycle_s = {cycle_s}"
                );
                problem(&["channel.jitter_s", "channel.airtime_s"], message)
            })
        }
    }
}

/// Checks that a cycle holds what it has to on the fastest clock as well.
fn fast_clocks(scenario: &Scenario) -> Result<(), Problem> {
    let Some(air) = scenario.channel.air() else { return Ok(()) };
    let (key, needed_s) = match air.access {
        Access::Random { guard_s } => ("channel.guard_s", guard_s.get()),
        Access::FixedPhase { jitter_s } => ("channel.airtime_s", jitter_s.get() + air.airtime_s.get()),
        Access::Aligned { .. } | Access::Slotted { .. } => return Ok(()),
    };
    let drift_ppm = scenario.processes.clock_drift_ppm.get();
    let shortest_s = scenario.cycle_s() * (1.0 - drift_ppm * 1e-6);
    ensure(drift_ppm == 0.0 || needed_s <= shortest_s * (1.0 + ROUNDING), || {
        let what = if key == "channel.guard_s" { "the guard" } else { "jitter and airtime" };
        let message = format!(
            "{what} of {} s cannot be in a cycle of the fastest clock: with processes.clock_drift_ppm = \
             {drift_ppm} it lasts {} s",
            short(needed_s),
            short(shortest_s)
        );
        problem(&["processes.clock_drift_ppm", key, "channel.cycle_s"], message)
    })
}

fn measurement(scenario: &Scenario) -> Result<(), Problem> {
    let channel = &scenario.channel;
    let bounded = [
        ("channel.sigma_range", channel.sigma_range, 1.0),
        ("channel.sigma_bearing_deg", channel.sigma_bearing_deg, 180.0),
        ("channel.sigma_orientation_deg", channel.sigma_orientation_deg, 180.0),
        ("channel.bearing_step_deg", channel.bearing_step_deg, 360.0),
        ("channel.orientation_step_deg", channel.orientation_step_deg, 360.0),
    ];
    let odometry = scenario.sensors.odometry.map(|odometry| ("sensors.odometry_error", odometry.error, 1.0));
    for (key, value, most) in bounded.into_iter().chain(odometry) {
        let value = value.get();
        ensure(value <= most, || problem(&[key], format!("{key} = {value} is more than {most}")))?;
    }
    let steps = [
        ("bearing_step_deg", channel.bearing_step_deg),
        ("orientation_step_deg", channel.orientation_step_deg),
    ];
    steps.into_iter().try_for_each(|(key, step)| whole_turn(key, step.get()))
}

/// A turn is a whole number of steps; else the last one would be shorter than the others, straight behind a robot.
fn whole_turn(key: &str, step_deg: f64) -> Result<(), Problem> {
    let steps = 360.0 / step_deg;
    let is_whole = step_deg == 0.0 || (steps - steps.round()).abs() <= ROUNDING * steps;
    ensure(is_whole, || {
        let [finer_deg, coarser_deg] = [steps.ceil(), steps.floor()].map(|steps| 360.0 / steps);
        let message = format!("channel.{key} = {step_deg} does not divide 360 degrees");
        problem(&[&format!("channel.{key}")], message)
            .hint(format!("the nearest steps that do are {finer_deg} and {coarser_deg} (0 is exact)"))
    })
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
