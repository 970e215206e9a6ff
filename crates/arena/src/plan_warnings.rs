//! Parts of a scenario that may not mean what its author thinks: known before the run, worth a warning, no reason to
//! refuse.

use coverage::refinement::WIDTH_SHARE_MIN;
use nalgebra::Vector2;

use crate::{field::Field, frame::Pose};
use scenario::{ChannelModel, Fault, FieldSpec, Medium, Scenario, fault::Kind};

/// One line for each time of `scenario` that was rounded, for errors of odometry that nobody goes by, for a field with
/// nothing to cover, for each of its peaks that is too narrow to be integrated well, for each fault that may never
/// fire, robots starting at `poses`, for each that outlasts the memory of neighbors, and for each that leaves such a
/// field; with the place in the file where it was written, if it is known.
pub fn warnings(scenario: &Scenario, poses: &[Pose]) -> Vec<String> {
    let rounded = scenario.roundings.0.iter().map(ToString::to_string);
    let mut warnings: Vec<String> =
        rounded.chain(idle(scenario)).chain(dark(scenario)).chain(narrow(scenario)).collect();
    for (index, fault) in scenario.fault.iter().enumerate() {
        let of_fault = late(fault, scenario)
            .into_iter()
            .chain(far_links(fault, scenario, poses))
            .chain(overdue(fault, scenario))
            .chain(darkened(fault, scenario))
            .chain(narrowed(fault, scenario));
        warnings.extend(of_fault.map(|what| format!("{}: {what}", named(index, fault))));
    }
    warnings
}

/// A fault as a person finds it: `plan.toml:41: fault 3 (jam)`.
pub fn named(index: usize, fault: &Fault) -> String {
    let place = fault.origin.0.as_ref().map_or(String::new(), |place| format!("{place}: "));
    format!("{place}fault {index} ({})", fault.name())
}

/// Errors of odometry where nothing is carried along by it: everybody is measured anew at each percept, and nobody is
/// remembered beyond it.
fn idle(scenario: &Scenario) -> Option<String> {
    let forgets = scenario
        .controllers
        .iter()
        .all(|it| it.law().is_some_and(|law| law.neighbor_timeout_cycles.get() == 1));
    let is_wrong = scenario.sensors.odometry.is_some_and(|odometry| odometry.error.get() > 0.0);
    (is_wrong && forgets && scenario.channel.medium == Medium::Instant).then(|| {
        "sensors.odometry_error has no effect: robots hear everybody anew in each neighbor cycle and remember nobody beyond \
         it; they do with channel.profile = \"isis\", or with controller.neighbor_timeout_cycles above 1"
            .into()
    })
}

/// A field without anything to cover. The law `uniform` does not ask for it.
fn dark(scenario: &Scenario) -> Option<String> {
    let highest = darkness(scenario, scenario.field.clone())?;
    Some(format!(
        "the field is nowhere positive (its highest value in the arena is {highest}), so no cell has mass: robots \
         stand still, and nothing converges; raise field.offset, or add a [[field.lamp]] or a [[field.gaussian]]"
    ))
}

/// The highest value of a field if it is nowhere positive, and somebody goes by it.
fn darkness(scenario: &Scenario, field: FieldSpec) -> Option<f64> {
    let goes_by_light = scenario.laws().any(|law| law.law.goes_by_light());
    let highest = Field::of(field).highest(scenario.arena.size_m.get());
    (highest <= 0.0 && goes_by_light).then_some(highest)
}

/// A change of the field at whose tick it becomes one without anything to cover.
fn darkened(fault: &Fault, scenario: &Scenario) -> Option<String> {
    let Kind::Field(_) = fault.kind else { return None };
    let tick = scenario.tick_at(fault.begins_s());
    let before = tick.checked_sub(1).map_or(scenario.field.clone(), |before| scenario.field_at(before));
    let highest = darkness(scenario, scenario.field_at(tick))?;
    darkness(scenario, before).is_none().then(|| {
        format!(
            "the field is nowhere positive from then on (its highest value in the arena is {highest}), so no cell has \
             mass, and robots stand still; raise field.offset"
        )
    })
}

/// Peaks too narrow for the largest cell that anybody may integrate over.
fn narrow(scenario: &Scenario) -> Vec<String> {
    let (gaussians, lamps) = (scenario.field.gaussian.iter(), scenario.field.lamp.iter());
    let gaussians = gaussians
        .enumerate()
        .map(|(index, peak)| (format!("field.gaussian.{index}.sigma_m"), peak.sigma_m.get()));
    let lamps = lamps
        .enumerate()
        .map(|(index, lamp)| (format!("field.lamp.{index}.half_distance_m"), lamp.half_distance_m.get()));
    let cell_m = largest_cell_m(scenario);
    gaussians.chain(lamps).filter_map(|(path, width_m)| too_narrow(&path, width_m, cell_m)).collect()
}

/// A change of the field that makes a peak as narrow.
fn narrowed(fault: &Fault, scenario: &Scenario) -> Option<String> {
    let Kind::Field(change) = &fault.kind else { return None };
    let widths = [("half_distance_m", change.half_distance_m), ("sigma_m", change.sigma_m)];
    let cell_m = largest_cell_m(scenario);
    widths.into_iter().find_map(|(key, width_m)| too_narrow(key, width_m?.get(), cell_m))
}

fn too_narrow(path: &str, width_m: f64, cell_m: f64) -> Option<String> {
    (width_m < WIDTH_SHARE_MIN * cell_m).then(|| {
        format!(
            "{path} = {width_m:e} is less than {WIDTH_SHARE_MIN:e} of the largest cell there may be ({cell_m:.3} m \
             across): coverage cost and true centroids may be off by more than 1e-8 of their value; widen it to {:e} \
             m, or make the arena smaller",
            WIDTH_SHARE_MIN * cell_m
        )
    })
}

/// How wide the largest cell may be that anybody integrates over, meters.
fn largest_cell_m(scenario: &Scenario) -> f64 {
    let arena_m = Vector2::from(scenario.arena.size_m.get()).norm();
    // Where walls are not sensed, the law `exact` has cells that end at the cap.
    let needy = scenario.laws().filter(|law| law.law.needs_field() && !scenario.arena.boundary_sensing);
    let across_caps_m = needy.filter_map(|law| law.cell_cap_m).map(|cap_m| 2.0 * cap_m.get());
    across_caps_m.fold(arena_m, f64::max)
}

fn late(fault: &Fault, scenario: &Scenario) -> Option<String> {
    let (begins_s, duration_s) = (fault.begins_s(), scenario.duration_s.get());
    let last = scenario.ticks();
    let (begins, ends) = (scenario.tick_at(begins_s), fault.ends_s().map(|ends_s| scenario.tick_at(ends_s)));
    if begins > last {
        return Some(format!("begins at {begins_s} s, after the end of the run ({duration_s} s)"));
    }
    let restarts_late = fault.nature().is_at_once() && ends.is_some_and(|ends| ends > last);
    restarts_late.then(|| format!("nobody is restarted before the end of the run ({duration_s} s)"))
}

fn far_links<'a>(
    fault: &'a Fault,
    scenario: &'a Scenario,
    poses: &'a [Pose],
) -> impl Iterator<Item = String> + 'a {
    let range_m = match scenario.channel.model {
        ChannelModel::Range { range_m, .. } => range_m.get(),
        ChannelModel::Voronoi => f64::INFINITY,
    };
    fault.target.links().iter().filter_map(move |link| {
        let apart_m = (poses[link.from as usize].position - poses[link.to as usize].position).norm();
        (apart_m > range_m).then(|| {
            format!("link {link} is beyond range at the start: {apart_m:.2} m, channel.range_m is {range_m}")
        })
    })
}

/// Does it make packets or answers come after a neighbor is forgotten?
fn overdue(fault: &Fault, scenario: &Scenario) -> Option<String> {
    let (what, late_s) = fault.kind.lateness()?;
    // Who forgets soonest; a program's memory is its own.
    let of_laws = scenario.controllers.iter().filter(|it| it.law().is_some());
    let hasty = of_laws.min_by_key(|it| it.neighbor_timeout_cycles())?;
    let (late, timeout) = (scenario.tick_at(late_s), scenario.neighbor_timeout_ticks(hasty).into());
    (late >= timeout).then(|| {
        format!(
            "{what} {} s late, and a neighbor is forgotten after {} s, controller.neighbor_timeout_cycles = {}; with {} \
             it is remembered until then",
            scenario.time_of(late),
            scenario.time_of(timeout),
            hasty.neighbor_timeout_cycles(),
            scenario.cycle_of(late) + 1
        )
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn warned(field: &str, law: &str) -> Vec<String> {
        let text = format!(
            "duration_s = 1\nstep_s = 0.1\narena.size_m = [1, 1]\nrobots.count = 3\n\
             controller = {{ law = \"{law}\", gain_per_s = 1 }}\nchannel.range_m = 1\n{field}"
        );
        warnings(&Scenario::parse("test", &text, &[]).unwrap_or_else(|error| panic!("{error}")), &[])
    }

    #[test]
    fn a_peak_too_narrow_for_the_largest_cell_is_warned_of() {
        let lit = "field.offset = 1\n";
        let lamp = |half_m: f64| {
            format!(
                "{lit}field.lamp = [{{ position_m = [0.5, 0.5], peak = 1, half_distance_m = {half_m} }}]\n"
            )
        };
        let gaussian = |sigma_m: f64| {
            format!("{lit}field.gaussian = [{{ center_m = [0.5, 0.5], gamma = 1, sigma_m = {sigma_m} }}]\n")
        };
        for (narrow, key) in
            [(lamp(1.4e-6), "lamp.0.half_distance_m"), (gaussian(1.4e-6), "gaussian.0.sigma_m")]
        {
            let [warning] = &warned(&narrow, "linear")[..] else { panic!("{narrow:?} is not warned of") };
            assert!(warning.starts_with(&format!("field.{key} = 1.4e-6 is less than 1e-6 of")), "{warning}");
        }
        for wide in [lamp(1.5e-6), gaussian(1.5e-6)] {
            assert_eq!(warned(&wide, "linear"), [""; 0]);
        }
        let capped = |cap_m: f64| format!("exact\", cell_cap_m = {cap_m}, gradient = \"measured");
        assert_eq!(warned(&lamp(1.5e-6), &capped(0.7)), [""; 0], "a cap within the arena");
        assert_eq!(warned(&lamp(1.5e-6), &capped(2.0)).len(), 1, "a cap beyond it");
    }

    #[test]
    fn a_change_after_which_the_field_is_nowhere_positive_or_a_peak_too_narrow_is_warned_of() {
        let lit = "field.lamp = [{ position_m = [0.5, 0.5], peak = 1, half_distance_m = 0.5 }]\n\
                   [[fault]]\nkind = \"field\"\nat_s = 0.5\n";
        let [warning] = &warned(&format!("{lit}lamp = 0\npeak = 0"), "linear")[..] else { panic!("not one") };
        let begins = "test:9: fault 0 (field): the field is nowhere positive from then on";
        assert!(warning.starts_with(begins), "{warning}");
        let [warning] = &warned(&format!("{lit}lamp = 0\nhalf_distance_m = 1.4e-6"), "linear")[..] else {
            panic!("not one")
        };
        assert!(
            warning.starts_with("test:9: fault 0 (field): half_distance_m = 1.4e-6 is less"),
            "{warning}"
        );
        let relit = "[[fault]]\nkind = \"field\"\nat_s = 0.5\noffset = 1";
        for fine in ["lamp = 0\npeak = 0.1", &format!("lamp = 0\npeak = 0\n{relit}")] {
            assert_eq!(warned(&format!("{lit}{fine}"), "linear"), [""; 0], "{fine}");
        }
        assert_eq!(
            warned(&format!("{lit}lamp = 0\npeak = 0"), "uniform"),
            [""; 0],
            "Lloyd's law asks for no field"
        );
    }

    #[test]
    fn errors_of_odometry_that_nobody_goes_by_are_warned_of() {
        let lit = "field.offset = 1\nsensors = { odometry = true, odometry_error = 0.1 }\n";
        let [warning] = &warned(lit, "linear")[..] else { panic!("it is not warned of") };
        assert!(warning.starts_with("sensors.odometry_error has no effect"), "{warning}");
        for remembered in [
            format!("{lit}channel.loss = 0.1"),
            format!("{lit}channel.profile = \"isis\""),
            lit.replace("odometry_error = 0.1", "odometry_error = 0.0"),
        ] {
            assert_eq!(warned(&remembered, "linear"), [""; 0], "{remembered}");
        }
    }

    #[test]
    fn a_field_that_is_nowhere_positive_is_warned_of() {
        let lamp = "field.lamp = [{ position_m = [0.5, 0.5], peak = 500, half_distance_m = 1e-5 }]\n";
        for dark in ["", "field.offset = -0.0", &format!("{lamp}field.offset = -1000")] {
            let [warning] = &warned(dark, "linear")[..] else { panic!("{dark:?} is not warned of") };
            assert!(warning.starts_with("the field is nowhere positive"), "{warning}");
            assert!(warning.ends_with("raise field.offset, or add a [[field.lamp]] or a [[field.gaussian]]"));
        }
        let lit = [lamp, "field.offset = 1e-9", &format!("{lamp}field.offset = -499")];
        assert!(lit.iter().all(|field| warned(field, "linear").is_empty()), "a narrow lamp is light enough");
        assert!(warned("", "uniform").is_empty(), "Lloyd's law asks for no field");
    }
}
