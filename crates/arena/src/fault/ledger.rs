//! The fault ledger: what each planned fault did, in numbers, or that it never fired.

use std::{
    collections::{BTreeMap, BTreeSet},
    ops::Range,
};

use protocol::percept::Tick;
use serde::Serialize;

use scenario::FaultKind;

/// Results of one planned fault.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Line {
    /// Its kind.
    pub kind: FaultKind,
    /// When it was to begin.
    pub planned_tick: Tick,
    /// When it was to end; `None` with the run.
    pub until_tick: Option<Tick>,
    /// When it first did something; `None` if it never did.
    pub fired_tick: Option<Tick>,
    /// When it last did something.
    pub last_tick: Option<Tick>,
    /// How many robots it has done something to (for packets: those that should have heard them).
    pub robots: usize,
    /// Its effects, and how often each.
    pub effects: BTreeMap<&'static str, u64>,
    #[serde(skip)]
    struck: BTreeSet<u32>,
}

impl Line {
    /// The line of a fault that has not begun.
    pub(super) fn new(kind: FaultKind, window: Range<Tick>) -> Self {
        Self {
            kind,
            planned_tick: window.start,
            until_tick: Some(window.end).filter(|&end| end != Tick::MAX),
            fired_tick: None,
            last_tick: None,
            robots: 0,
            effects: BTreeMap::new(),
            struck: BTreeSet::new(),
        }
    }

    /// It did something to `robot`.
    pub(super) fn did(&mut self, tick: Tick, what: &'static str, robot: u32) {
        self.fired_tick.get_or_insert(tick);
        self.last_tick = Some(tick);
        if self.struck.insert(robot) {
            self.robots = self.struck.len();
        }
        self.count(what);
    }

    /// One more of `what`.
    pub(super) fn count(&mut self, what: &'static str) {
        *self.effects.entry(what).or_default() += 1;
    }

    /// Returns its effects as text: `312 packets dropped, 3 robots killed`.
    pub fn told(&self) -> String {
        let effects = self.effects.iter().map(|(what, count)| format!("{count} {what}"));
        effects.collect::<Vec<_>>().join(", ")
    }
}
