//! One fault of a plan, for checks: what they ask of it and of its setting.

use super::setting::Setting;
use super::target::{Disc, Target};
use crate::light::COUNTS_MAX;
use crate::problem::{Problem, ensure, problem};
use crate::robot_set::RobotSet;

/// One fault, where it stands, and what kinds ask of it.
pub(super) struct Entry<'a> {
    pub(super) index: usize,
    /// Name of its kind.
    pub(super) kind: &'static str,
    pub(super) target: &'a Target,
    pub(super) setting: &'a Setting<'a>,
    pub(super) is_given: &'a dyn Fn(&str) -> bool,
}

impl Entry<'_> {
    pub(super) fn path(&self, key: &str) -> String {
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
            let (kind, list) = (self.kind, keys.join("`, `"));
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
        self.between(key, value, -most, most)
    }

    /// Checks that a value is not less than one bound and not more than the other, if it is there.
    pub(super) fn between(
        &self,
        key: &str,
        value: Option<f64>,
        least: f64,
        most: f64,
    ) -> Result<(), Problem> {
        let Some(value) = value else { return Ok(()) };
        ensure((least..=most).contains(&value), || {
            self.problem(&[key], format!("{key} = {value:e} is beyond {least:e} to {most:e}"))
        })
    }

    /// Checks that so many counts are sensible.
    pub(super) fn counts(&self, key: &str, counts: Option<f64>) -> Result<(), Problem> {
        self.within(key, counts, COUNTS_MAX)
    }

    /// Checks that a delay is at least half a tick.
    pub(super) fn delays(&self, delay_s: f64) -> Result<(), Problem> {
        ensure(self.setting.tick_at(delay_s) > 0, || {
            let step_s = self.setting.step_s;
            let message =
                format!("delay_s = {delay_s} is less than half a tick of {step_s} s: nothing would be late");
            problem(&[&self.path("delay_s"), "step_s"], message)
        })
    }

    /// Checks that a robot is one of the scenario's.
    pub(super) fn knows(&self, key: &str, robot: u32) -> Result<(), Problem> {
        let count = self.setting.robots;
        ensure(robot < count, || {
            let message = format!("there is no robot {robot}: the scenario has robots 0 to {}", count - 1);
            problem(&[&self.path(key), "robots.count"], message)
        })
    }

    /// Checks that a disc lies in the arena.
    pub(super) fn reaches(&self, Disc { center_m, radius_m }: Disc) -> Result<(), Problem> {
        let ([x, y], [width, height]) = (center_m.get(), self.setting.size_m);
        let away = libm::hypot(x - x.clamp(0.0, width), y - y.clamp(0.0, height));
        ensure(away < radius_m.get(), || {
            let message = format!(
                "the disc of {} m around [{x}, {y}] lies outside the arena of {width} m x {height} m",
                radius_m.get()
            );
            problem(&[&self.path("region"), "arena.size_m"], message)
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
