//! Is the fault plan one that can be carried out?
//!
//! In:  a plan of faults that are each well-formed, and its setting. Out: the first [`Problem`], with its keys.

use super::entry::Entry;
use super::kind::Fault;
use super::setting::Setting;
use super::target::Pick;
use crate::problem::{Problem, ensure, problem};
use crate::robot_set::Link;

/// Everything about the fault plan, from the first fault to the last. `is_given` tells of a path whether the file or an
/// override gives it.
pub(crate) fn check(
    plan: &[Fault],
    setting: &Setting<'_>,
    is_given: &dyn Fn(&str) -> bool,
) -> Result<(), Problem> {
    for (index, fault) in plan.iter().enumerate() {
        let entry = Entry { index, kind: fault.name(), target: &fault.target, setting, is_given };
        window(fault, &entry)?;
        target(fault, &entry)?;
        fault.kind.check(&entry)?;
    }
    windows_apart(plan, setting.robots)
}

/// Does it end after it begins?
fn window(fault: &Fault, entry: &Entry<'_>) -> Result<(), Problem> {
    let (from, until) = fault.nature().window();
    let (Some(until), Some(ends_s)) = (until, fault.ends_s()) else { return Ok(()) };
    let (begins_s, ticks) = (fault.begins_s(), |time_s| entry.setting.tick_at(time_s));
    ensure(ticks(ends_s) > ticks(begins_s), || match fault.nature().is_at_once() {
        _ if ends_s > begins_s => entry.problem(
            &[until, "step_s"],
            format!(
                "the window is empty: {begins_s} s and {ends_s} s fall on the same tick of {} s",
                entry.setting.step_s
            ),
        ),
        true => entry.problem(
            &[until, from],
            format!(
                "{until} = {ends_s} does not come after {from} = {begins_s}: nobody can be restarted before \
                     being killed"
            ),
        ),
        false => entry.problem(
            &[until, from],
            format!("the window is empty: {until} = {ends_s} does not come after {from} = {begins_s}"),
        ),
    })
}

/// Can it be struck?
fn target(fault: &Fault, entry: &Entry<'_>) -> Result<(), Problem> {
    for (at, Link { from, to, .. }) in fault.target.links().iter().enumerate() {
        entry.knows(&format!("links.{at}"), *from.max(to))?;
    }
    let Some(choice) = fault.target.choice() else { return Ok(()) };
    choice.robots.iter().try_for_each(|robots| entry.knows("robots", robots.highest()))?;
    choice.region.into_iter().try_for_each(|disc| entry.reaches(disc))?;
    let by_lamps = choice.share.is_some_and(|of| of.pick == Pick::NearestLamps);
    ensure(!by_lamps || entry.setting.has_lamps(), || {
        entry.problem(&["pick"], "pick = \"nearest-lamps\" needs lamps, and the field has none")
    })
}

/// Checks that no robot is killed, stopped or slowed twice at once.
fn windows_apart(plan: &[Fault], count: u32) -> Result<(), Problem> {
    for (second, fault) in plan.iter().enumerate().filter(|(_, fault)| fault.nature().exclusive) {
        for (first, other) in plan[..second].iter().enumerate() {
            if let Some(robot) = fault.excludes(other, count) {
                let message = format!(
                    "two faults of kind \"{}\" strike robot {robot} at once: this one ({}) and number {first} ({})",
                    fault.name(),
                    span(fault),
                    span(other)
                );
                return Err(problem(&[&format!("fault.{second}.kind")], message));
            }
        }
    }
    Ok(())
}

fn span(fault: &Fault) -> String {
    let end = fault.ends_s().map_or("the end".into(), |ends_s| format!("{ends_s} s"));
    format!("{} s to {end}", fault.begins_s())
}
