//! Parts of a scenario that may not mean what its author thinks: known before the run, worth a warning, no reason to
//! refuse.

use std::num::NonZeroU32;

use crate::{
    frame::Pose,
    scenario::{ChannelModel, FaultKind, FaultSpec, Scenario},
};

/// One line for each time of `scenario` that was rounded, for each fault that may never fire, robots starting at `poses`,
/// and for each that outlasts the memory of neighbors; with the place in the file where it was written, if it is known.
pub fn cautions(scenario: &Scenario, poses: &[Pose]) -> Vec<String> {
    let mut cautions: Vec<String> = scenario.roundings.0.iter().map(ToString::to_string).collect();
    for (index, fault) in scenario.fault.iter().enumerate() {
        let of_fault = late(fault, scenario)
            .into_iter()
            .chain(far_links(fault, scenario, poses))
            .chain(overdue(fault, scenario));
        cautions.extend(of_fault.map(|what| format!("{}: {what}", named(index, fault))));
    }
    cautions
}

/// A fault as a person finds it: `plan.toml:41: fault 3 (jam)`.
pub fn named(index: usize, fault: &FaultSpec) -> String {
    let place = fault.origin.0.as_ref().map_or(String::new(), |place| format!("{place}: "));
    format!("{place}fault {index} ({})", fault.kind.name())
}

fn late(fault: &FaultSpec, scenario: &Scenario) -> Option<String> {
    let (begins_s, duration_s) = (fault.begins_s(), scenario.duration_s.get());
    let last = scenario.ticks();
    let (begins, ends) = (scenario.tick_at(begins_s), fault.ends_s().map(|ends_s| scenario.tick_at(ends_s)));
    if begins > last {
        return Some(format!("begins at {begins_s} s, after the end of the run ({duration_s} s)"));
    }
    let restarts_late = fault.restart_at_s.is_some() && ends.is_some_and(|ends| ends > last);
    restarts_late.then(|| format!("nobody is restarted before the end of the run ({duration_s} s)"))
}

fn far_links<'a>(
    fault: &'a FaultSpec,
    scenario: &'a Scenario,
    poses: &'a [Pose],
) -> impl Iterator<Item = String> + 'a {
    let range_m =
        (scenario.channel.model == ChannelModel::Range).then_some(scenario.channel.range_m).flatten();
    fault.links.iter().flatten().filter_map(move |link| {
        let apart_m = (poses[link.from as usize].position - poses[link.to as usize].position).norm();
        let range_m = range_m.filter(|range_m| apart_m > range_m.get())?.get();
        Some(format!(
            "link {link} is beyond range at the start: {apart_m:.2} m, channel.range_m is {range_m}"
        ))
    })
}

/// Does it make packets or answers come after a neighbor is forgotten?
fn overdue(fault: &FaultSpec, scenario: &Scenario) -> Option<String> {
    let late_s = fault.delay_s?.get() + fault.jitter_s.map_or(0.0, |jitter| jitter.get());
    let (late, timeout) = (scenario.tick_at(late_s), scenario.neighbor_timeout_ticks().into());
    let what = match fault.kind {
        _ if late < timeout => return None,
        FaultKind::Delay => "packets come up to",
        FaultKind::Slow => "answers come",
        _ => return None,
    };
    Some(format!(
        "{what} {} s late, and a neighbor is forgotten after {} s, controller.neighbor_timeout_cycles = {}; with {} it \
         is remembered until then",
        scenario.time_of(late),
        scenario.time_of(timeout),
        scenario.controller.neighbor_timeout_cycles.map_or(1, NonZeroU32::get),
        scenario.cycle_of(late) + 1
    ))
}
