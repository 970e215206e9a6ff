//! Is the fault plan one that can be carried out?
//!
//! In:  a scenario whose values are each well-formed. Out: the first [`Problem`], with its keys.

use super::{Disc, Fault, Pick};
use crate::Scenario;
use crate::light::COUNTS_MAX;
use crate::problem::{Problem, ensure, problem};
use crate::robot_set::{Link, RobotSet};

/// Everything about the fault plan, from the first fault to the last. `is_given` tells of a path whether the file or an
/// override gives it.
pub(crate) fn check(scenario: &Scenario, is_given: &dyn Fn(&str) -> bool) -> Result<(), Problem> {
    for (index, fault) in scenario.fault.iter().enumerate() {
        let entry = Entry { index, fault, scenario, is_given };
        entry.window()?;
        entry.target()?;
        fault.kind.check(&entry)?;
    }
    windows_apart(scenario)?;
    ensure(!scenario.fuzz.kinds.is_empty(), || {
        problem(&["fuzz.kinds"], "fuzz.kinds is empty: no fault can be drawn")
    })
}

/// One fault, where it stands, and what kinds ask of it.
pub(super) struct Entry<'a> {
    index: usize,
    pub(super) fault: &'a Fault,
    pub(super) scenario: &'a Scenario,
    is_given: &'a dyn Fn(&str) -> bool,
}

impl Entry<'_> {
    fn path(&self, key: &str) -> String {
        format!("fault.{}.{key}", self.index)
    }

    /// A problem with some of its keys.
    pub(super) fn problem(&self, keys: &[&str], message: impl Into<String>) -> Problem {
        let paths: Vec<String> = keys.iter().map(|key| self.path(key)).collect();
        problem(&paths.iter().map(String::as_str).collect::<Vec<_>>(), message)
    }

    /// Whether a key is given.
    pub(super) fn gives(&self, key: &str) -> bool {
        (self.is_given)(&self.path(key))
    }

    /// Checks that one of some keys is there.
    pub(super) fn one_of(&self, keys: &[&str], is_there: bool) -> Result<(), Problem> {
        ensure(is_there, || {
            let (kind, list) = (self.fault.name(), keys.join("`, `"));
            self.problem(&["kind"], format!("a fault of kind \"{kind}\" needs one of `{list}`"))
        })
    }

    /// Checks that a flag, which is false by default, says something.
    pub(super) fn flag(&self, key: &str, value: bool) -> Result<(), Problem> {
        ensure(value || !self.gives(key), || {
            self.problem(&[key], format!("{key} = false does nothing; leave it out"))
        })
    }

    /// Checks that a value is sensible, if it is there.
    pub(super) fn within(&self, key: &str, value: Option<f64>, most: f64) -> Result<(), Problem> {
        let value = value.unwrap_or(0.0);
        ensure(value.abs() <= most, || {
            self.problem(&[key], format!("{key} = {value:e} is beyond -{most:e} to {most:e}"))
        })
    }

    /// Checks that so many counts are sensible.
    pub(super) fn counts(&self, key: &str, counts: Option<f64>) -> Result<(), Problem> {
        self.within(key, counts, COUNTS_MAX)
    }

    /// Checks that a delay is at least half a tick.
    pub(super) fn delays(&self, delay_s: f64) -> Result<(), Problem> {
        ensure(self.scenario.tick_at(delay_s) > 0, || {
            let step_s = self.scenario.step_s.get();
            let message =
                format!("delay_s = {delay_s} is less than half a tick of {step_s} s: nothing would be late");
            problem(&[&self.path("delay_s"), "step_s"], message)
        })
    }

    /// Checks that a robot is one of the scenario's.
    pub(super) fn knows(&self, key: &str, robot: u32) -> Result<(), Problem> {
        let count = self.scenario.robot_count();
        ensure(robot < count, || {
            let message = format!("there is no robot {robot}: the scenario has robots 0 to {}", count - 1);
            problem(&[&self.path(key), "robots.count"], message)
        })
    }

    /// Checks that a disc lies in the arena.
    pub(super) fn reaches(&self, Disc { center_m, radius_m }: Disc) -> Result<(), Problem> {
        let ([x, y], [width, height]) = (center_m.get(), self.scenario.arena.size_m.get());
        let away = libm::hypot(x - x.clamp(0.0, width), y - y.clamp(0.0, height));
        ensure(away < radius_m.get(), || {
            let message = format!(
                "the disc of {} m around [{x}, {y}] lies outside the arena of {width} m x {height} m",
                radius_m.get()
            );
            problem(&[&self.path("region"), "arena.size_m"], message)
        })
    }

    /// Does it end after it begins?
    fn window(&self) -> Result<(), Problem> {
        let Some(ends_s) = self.fault.ends_s() else { return Ok(()) };
        let (begins_s, ticks) = (self.fault.begins_s(), |time_s| self.scenario.tick_at(time_s));
        let [from, until] = self.fault.nature().window();
        ensure(ticks(ends_s) > ticks(begins_s), || {
            match self.fault.nature().at_once {
            _ if ends_s > begins_s => self.problem(
                &[until, "step_s"],
                format!(
                    "the window is empty: {begins_s} s and {ends_s} s fall on the same tick of {} s",
                    self.scenario.step_s.get()
                ),
            ),
            true => self.problem(
                &[until, from],
                format!(
                    "{until} = {ends_s} does not come after {from} = {begins_s}: nobody can be restarted before \
                     being killed"
                ),
            ),
            false => self.problem(
                &[until, from],
                format!("the window is empty: {until} = {ends_s} does not come after {from} = {begins_s}"),
            ),
        }
        })
    }

    /// Can it be struck?
    fn target(&self) -> Result<(), Problem> {
        for (at, Link { from, to, .. }) in self.fault.target.links().iter().enumerate() {
            self.knows(&format!("links.{at}"), *from.max(to))?;
        }
        let Some(choice) = self.fault.target.choice() else { return Ok(()) };
        choice.robots.iter().try_for_each(|robots| self.knows("robots", robots.highest()))?;
        choice.region.into_iter().try_for_each(|disc| self.reaches(disc))?;
        let by_lamps = choice.share.is_some_and(|of| of.pick == Pick::NearestLamps);
        ensure(!by_lamps || !self.scenario.field.lamp.is_empty(), || {
            self.problem(&["pick"], "pick = \"nearest-lamps\" needs lamps, and the field has none")
        })
    }

    /// Checks that all robots of some groups are the scenario's, and none is in two.
    pub(super) fn groups_apart(&self, groups: &[RobotSet]) -> Result<(), Problem> {
        for (second, group) in groups.iter().enumerate() {
            for (first, other) in groups[..second].iter().enumerate() {
                if let Some(robot) = group.lowest_common(other) {
                    let message = format!("robot {robot} is in groups {first} and {second}");
                    return Err(self.problem(&[&format!("groups.{second}"), "groups"], message));
                }
            }
            self.knows(&format!("groups.{second}"), group.highest())?;
        }
        Ok(())
    }
}

/// Checks that no robot is killed, stopped or slowed twice at once.
fn windows_apart(scenario: &Scenario) -> Result<(), Problem> {
    let count = scenario.robot_count();
    for (second, fault) in scenario.fault.iter().enumerate().filter(|(_, fault)| fault.nature().exclusive) {
        for (first, other) in scenario.fault[..second].iter().enumerate() {
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
