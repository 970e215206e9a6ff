//! The fault ledger: what each planned fault did, in numbers, or that it never fired.

use std::{
    borrow::Cow,
    collections::{BTreeMap, BTreeSet},
    ops::Range,
};

use protocol::percept::Tick;
use serde::{Deserialize, Serialize};

use scenario::FaultKind;

/// Results of one planned fault.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Line {
    /// Its kind.
    pub kind: FaultKind,
    /// When it was to begin.
    pub planned_tick: Tick,
    /// When it was to end; `None` with the run, or if its kind has no end.
    pub until_tick: Option<Tick>,
    /// When it first did something; `None` if it never did.
    pub fired_tick: Option<Tick>,
    /// When it last did something.
    pub last_tick: Option<Tick>,
    /// How many robots it has done something to (for packets: those that should have heard them).
    pub robots: usize,
    /// Its effects, and how often each.
    pub effects: BTreeMap<Cow<'static, str>, u64>,
}

impl Line {
    /// Returns its effects as text: `312 packets dropped, 3 robots killed`.
    pub fn told(&self) -> String {
        let effects = self.effects.iter().map(|(what, count)| format!("{count} {what}"));
        effects.collect::<Vec<_>>().join(", ")
    }
}

/// The line of a fault while it is written, and the robots that the fault has done something to.
#[derive(Debug)]
pub(super) struct Entry {
    pub(super) line: Line,
    struck: BTreeSet<u32>,
}

impl Entry {
    /// The entry of a fault that has not begun.
    pub(super) fn new(kind: FaultKind, window: Range<Tick>) -> Self {
        let line = Line {
            kind,
            planned_tick: window.start,
            until_tick: None,
            fired_tick: None,
            last_tick: None,
            robots: 0,
            effects: BTreeMap::new(),
        };
        let mut entry = Self { line, struck: BTreeSet::new() };
        entry.until(window.end);
        entry
    }

    /// It ends with tick `end`; `Tick::MAX` with the run.
    pub(super) fn until(&mut self, end: Tick) {
        self.line.until_tick = Some(end).filter(|&end| end != Tick::MAX);
    }

    /// It did something to `robot`.
    pub(super) fn did(&mut self, tick: Tick, what: &'static str, robot: u32) {
        self.struck.insert(robot);
        self.line.robots = self.struck.len();
        self.happened(tick, what);
    }

    /// It did something that strikes no robot by itself.
    pub(super) fn happened(&mut self, tick: Tick, what: &'static str) {
        self.line.fired_tick.get_or_insert(tick);
        self.line.last_tick = Some(tick);
        self.count(what);
    }

    /// One more of `what`.
    pub(super) fn count(&mut self, what: &'static str) {
        *self.line.effects.entry(what.into()).or_default() += 1;
    }
}
