//! Is the fault plan one that can be carried out?
//!
//! In:  a scenario whose values are each well-formed. Out: the first [`Problem`], with its keys.

use std::collections::BTreeSet;

use super::Scenario;
use super::check::COUNTS_MAX;
use super::faults::{Disc, FaultKind, FaultSpec, Pick};
use super::problem::{Problem, ensure, problem};
use super::robot_set::{Link, RobotSet};

/// Fastest drift, meters per second along each axis: poses stay finite.
const DRIFT_MAX_M_PER_S: f64 = 1e6;

/// The keys of one kind of fault.
struct Keys {
    /// All of these must be given.
    needed: &'static [&'static str],
    /// Of these at least one must be given, if there are any.
    one_of: &'static [&'static str],
    /// These may be given.
    known: &'static [&'static str],
}

/// Keys by which packets are chosen.
const OF_PACKETS: [&str; 8] =
    ["from_s", "until_s", "robots", "region", "share", "pick", "direction", "links"];
/// Keys by which robots are chosen.
const OF_ROBOTS: [&str; 6] = ["from_s", "until_s", "robots", "region", "share", "pick"];

fn keys(kind: FaultKind) -> (Keys, &'static [&'static str]) {
    let keys = |needed, one_of, known| Keys { needed, one_of, known };
    match kind {
        FaultKind::Loss => (keys(&["probability"], &[], &[]), &OF_PACKETS),
        FaultKind::Burst => (keys(&["p", "r"], &[], &["loss_bad", "loss_good"]), &OF_PACKETS),
        FaultKind::Delay => (keys(&["delay_s"], &[], &["jitter_s"]), &OF_PACKETS),
        FaultKind::Duplicate => (keys(&["probability"], &[], &["delay_s"]), &OF_PACKETS),
        FaultKind::Corrupt => (keys(&["probability"], &[], &["flips"]), &OF_PACKETS),
        FaultKind::Partition => (keys(&[], &["groups", "region"], &["from_s", "until_s", "one_way"]), &[]),
        FaultKind::Jam => (keys(&["region"], &[], &["from_s", "until_s"]), &[]),
        FaultKind::Kill => {
            (keys(&["at_s"], &["robots", "region", "share"], &["restart_at_s", "restart_share", "pick"]), &[])
        }
        FaultKind::Pause => (keys(&[], &[], &[]), &OF_ROBOTS),
        FaultKind::Slow => (keys(&["delay_s"], &[], &[]), &OF_ROBOTS),
        FaultKind::Sensor => (keys(&[], &["bias_counts", "noise_counts", "stuck"], &[]), &OF_ROBOTS),
        FaultKind::Motion => (keys(&[], &["stuck", "drift_m_per_s"], &[]), &OF_ROBOTS),
        FaultKind::Liar => {
            (keys(&[], &["light_counts", "identity", "payload_hex"], &["payload_offset"]), &OF_ROBOTS)
        }
    }
}

/// Everything about the fault plan, from the first fault to the last.
pub(super) fn plan(scenario: &Scenario) -> Result<(), Problem> {
    for (index, fault) in scenario.fault.iter().enumerate() {
        let at = Entry { index, fault, scenario };
        at.keys()?;
        at.window()?;
        at.choice()?;
        at.names()?;
        at.places()?;
        at.parameters()?;
    }
    windows_apart(scenario)?;
    ensure(!scenario.fuzz.kinds.is_empty(), || {
        problem(&["fuzz.kinds"], "fuzz.kinds is empty: no fault can be drawn")
    })
}

/// One fault and where it stands.
struct Entry<'a> {
    index: usize,
    fault: &'a FaultSpec,
    scenario: &'a Scenario,
}

impl Entry<'_> {
    fn path(&self, key: &str) -> String {
        format!("fault.{}.{key}", self.index)
    }

    fn problem(&self, keys: &[&str], message: String) -> Problem {
        let paths: Vec<String> = keys.iter().map(|key| self.path(key)).collect();
        problem(&paths.iter().map(String::as_str).collect::<Vec<_>>(), message)
    }

    /// Are the keys those of its kind?
    fn keys(&self) -> Result<(), Problem> {
        let name = self.fault.kind.name();
        let (Keys { needed, one_of, known }, of_choice) = keys(self.fault.kind);
        let given = given_keys(self.fault);
        for key in needed {
            ensure(given.contains(*key), || {
                self.problem(&["kind"], format!("a fault of kind \"{name}\" needs `{key}`"))
            })?;
        }
        ensure(one_of.is_empty() || one_of.iter().any(|key| given.contains(*key)), || {
            let list = one_of.join("`, `");
            self.problem(&["kind"], format!("a fault of kind \"{name}\" needs one of `{list}`"))
        })?;
        let valid: BTreeSet<&str> = [needed, one_of, known, of_choice].concat().into_iter().collect();
        match given.iter().find(|key| *key != "kind" && !valid.contains(key.as_str())) {
            None => Ok(()),
            Some(key) => {
                let list = valid.into_iter().collect::<Vec<_>>().join("`, `");
                Err(self
                    .problem(&[key], format!("`{key}` has no meaning in a fault of kind \"{name}\""))
                    .hint(format!("it knows `{list}`")))
            }
        }
    }

    /// Does it end after it begins?
    fn window(&self) -> Result<(), Problem> {
        let Some(ends_s) = self.fault.ends_s() else { return Ok(()) };
        let (begins_s, ticks) = (self.fault.begins_s(), |time_s| self.scenario.tick_at(time_s));
        ensure(ticks(ends_s) > ticks(begins_s), || match self.fault.kind {
            _ if ends_s > begins_s => self.problem(
                &["until_s", "restart_at_s", "step_s"],
                format!(
                    "the window is empty: {begins_s} s and {ends_s} s fall on the same tick of {} s",
                    self.scenario.step_s.get()
                ),
            ),
            FaultKind::Kill => self.problem(
                &["restart_at_s", "at_s"],
                format!(
                    "restart_at_s = {ends_s} does not come after at_s = {begins_s}: \
                     nobody can be restarted before being killed"
                ),
            ),
            _ => self.problem(
                &["until_s", "from_s"],
                format!("the window is empty: until_s = {ends_s} does not come after from_s = {begins_s}"),
            ),
        })
    }

    /// Do the keys of choice agree?
    fn choice(&self) -> Result<(), Problem> {
        let fault = self.fault;
        if let Some(links) = &fault.links {
            ensure(!links.is_empty(), || {
                self.problem(&["links"], "`links` is empty: no packet is struck".into())
            })?;
            let given = given_keys(fault);
            let besides =
                ["robots", "region", "share", "direction"].into_iter().find(|key| given.contains(*key));
            ensure(besides.is_none(), || {
                let key = besides.unwrap_or_default();
                self.problem(&[key], format!("give either `links` or `{key}`, not both"))
            })?;
        }
        ensure(fault.pick.is_none() || fault.share.is_some(), || {
            self.problem(&["pick"], "`pick` says how a `share` is chosen, and there is none".into())
        })?;
        ensure(fault.pick != Some(Pick::NearestLamps) || !self.scenario.field.lamp.is_empty(), || {
            self.problem(&["pick"], "pick = \"nearest-lamps\" needs lamps, and the field has none".into())
        })?;
        ensure(fault.restart_share.is_none() || fault.restart_at_s.is_some(), || {
            self.problem(&["restart_share"], "`restart_share` needs `restart_at_s`".into())
        })?;
        ensure(fault.groups.is_none() || fault.region.is_none(), || {
            self.problem(&["groups", "region"], "give either `groups` or `region`, not both".into())
        })?;
        let Some(groups) = &fault.groups else { return Ok(()) };
        ensure(groups.len() >= 2, || {
            self.problem(&["groups"], format!("a partition needs two groups or more, got {}", groups.len()))
        })?;
        for (second, group) in groups.iter().enumerate() {
            for (first, other) in groups[..second].iter().enumerate() {
                if let Some(robot) = group.lowest_common(other) {
                    let message = format!("robot {robot} is in groups {first} and {second}");
                    return Err(self.problem(&[&format!("groups.{second}"), "groups"], message));
                }
            }
        }
        Ok(())
    }

    /// Are all robots known?
    fn names(&self) -> Result<(), Problem> {
        let count = self.scenario.robot_count();
        let known = |key: &str, robot: u32| {
            ensure(robot < count, || {
                let message =
                    format!("there is no robot {robot}: the scenario has robots 0 to {}", count - 1);
                problem(&[&self.path(key), "robots.count"], message)
            })
        };
        if let Some(robots) = &self.fault.robots {
            known("robots", robots.highest())?;
        }
        for (at, group) in self.fault.groups.iter().flatten().enumerate() {
            known(&format!("groups.{at}"), group.highest())?;
        }
        for (at, Link { from, to, .. }) in self.fault.links.iter().flatten().enumerate() {
            known(&format!("links.{at}"), *from.max(to))?;
        }
        self.fault.identity.map_or(Ok(()), |robot| known("identity", robot))
    }

    /// Does its disc lie in the arena?
    fn places(&self) -> Result<(), Problem> {
        let Some(Disc { center_m, radius_m }) = self.fault.region else { return Ok(()) };
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

    /// Do its own parameters do something?
    fn parameters(&self) -> Result<(), Problem> {
        let fault = self.fault;
        if let Some(delay_s) = fault.delay_s {
            ensure(self.scenario.tick_at(delay_s.get()) > 0, || {
                let step_s = self.scenario.step_s.get();
                let message = format!(
                    "delay_s = {} is less than half a tick of {step_s} s: nothing would be late",
                    delay_s.get()
                );
                problem(&[&self.path("delay_s"), "step_s"], message)
            })?;
        }
        if let (Some(p), Some(r)) = (fault.p, fault.r) {
            ensure(p.get() + r.get() > 0.0, || {
                self.problem(&["p", "r"], "p and r are both 0: links would never change".into())
            })?;
        }
        let drift = |axis: fn([f64; 2]) -> f64| fault.drift_m_per_s.map(|drift| axis(drift.get()));
        let bounded = [
            ("bias_counts", fault.bias_counts.map(|bias| bias.get()), COUNTS_MAX),
            ("noise_counts", fault.noise_counts.map(|noise| noise.get()), COUNTS_MAX),
            ("light_counts", fault.light_counts.map(|light| light.get()), COUNTS_MAX),
            ("drift_m_per_s", drift(|[ahead, _]| ahead), DRIFT_MAX_M_PER_S),
            ("drift_m_per_s", drift(|[_, left]| left), DRIFT_MAX_M_PER_S),
        ];
        for (key, value, most) in bounded {
            let value = value.unwrap_or(0.0);
            ensure(value.abs() <= most, || {
                self.problem(&[key], format!("{key} = {value:e} is beyond -{most:e} to {most:e}"))
            })?;
        }
        ensure(fault.payload_offset.is_none() || fault.payload_hex.is_some(), || {
            self.problem(&["payload_offset"], "`payload_offset` has no meaning without `payload_hex`".into())
        })?;
        if let Some(bytes) = fault.payload_hex.as_ref().map(|hex| hex.bytes().len()) {
            let end = fault.payload_offset.map_or(0, |offset| usize::from(offset.get())) + bytes;
            let limit = self.scenario.channel.payload_bytes_max.get();
            ensure(end <= limit.into(), || {
                let message = format!(
                    "payload_hex ends at byte {end} of the payload, and no payload has more than \
                     channel.payload_bytes_max = {limit} bytes"
                );
                self.problem(&["payload_hex"], message)
            })?;
        }
        ensure(fault.stuck != Some(false), || {
            self.problem(&["stuck"], "stuck = false does nothing; leave it out".into())
        })
    }
}

/// Checks that no robot is killed, stopped or slowed twice at once. Only robots named outright are compared: who
/// else is struck is known when the fault begins, and the ledger then tells whom it found.
fn windows_apart(scenario: &Scenario) -> Result<(), Problem> {
    let exclusive = |fault: &FaultSpec| {
        let kind = matches!(fault.kind, FaultKind::Kill | FaultKind::Pause | FaultKind::Slow);
        kind && fault.share.is_none() && fault.region.is_none()
    };
    let everyone = RobotSet::of(0..scenario.robot_count());
    let whom = |fault: &FaultSpec| fault.robots.clone().or(everyone.clone());
    let window = |fault: &FaultSpec| (fault.begins_s(), fault.ends_s().unwrap_or(f64::INFINITY));
    for (second, fault) in scenario.fault.iter().enumerate().filter(|(_, fault)| exclusive(fault)) {
        for (first, other) in
            scenario.fault[..second].iter().enumerate().filter(|(_, other)| exclusive(other))
        {
            let ((from, until), (other_from, other_until)) = (window(fault), window(other));
            if fault.kind != other.kind || from >= other_until || other_from >= until {
                continue;
            }
            let (Some(these), Some(those)) = (whom(fault), whom(other)) else { continue };
            if let Some(robot) = these.lowest_common(&those) {
                let message = format!(
                    "two faults of kind \"{}\" strike robot {robot} at once: this one ({from} s to {}) and \
                     number {first} ({other_from} s to {})",
                    fault.kind.name(),
                    end(until),
                    end(other_until)
                );
                return Err(problem(&[&format!("fault.{second}.kind")], message));
            }
        }
    }
    Ok(())
}

fn end(until_s: f64) -> String {
    if until_s.is_finite() { format!("{until_s} s") } else { "the end".into() }
}

fn given_keys(fault: &FaultSpec) -> BTreeSet<String> {
    let table = toml::Table::try_from(fault).expect("a fault is plain data");
    table.into_iter().map(|(key, _)| key).collect()
}
