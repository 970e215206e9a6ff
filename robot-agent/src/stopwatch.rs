//! How long each stage of the agent's cycle takes, stamped by the machine's clock.
//!
//! Stages follow each other without a gap: what lies between two stamps belongs to the stage that the second one ends.

use std::time::Duration;

use protocol::controller::{Stage, StageObserver};
use transport::{
    clock::{Clock, Stamp},
    raw::RawTimes,
};

/// Runs from wake-up to wake-up.
#[derive(Debug)]
pub(crate) struct Stopwatch {
    clock: Clock,
    /// When the last stage ended.
    last: Stamp,
    /// The present cycle, and what the one before took to publish.
    times: RawTimes,
    missed: u32,
}

impl Stopwatch {
    pub(crate) fn new() -> Self {
        let clock = Clock::of_this_machine();
        Self { clock, last: clock.now(), times: RawTimes::default(), missed: 0 }
    }

    /// The agent wakes up.
    pub(crate) fn woke(&mut self) {
        self.last = self.clock.now();
        self.times.woke = self.last.0;
    }

    /// It wakes up by its own timer, which fired so late.
    pub(crate) fn woke_late(&mut self, late: Duration) {
        self.woke();
        self.times.late_ns = saturated(late.as_nanos());
    }

    /// Counts deadlines that have not been met.
    pub(crate) fn miss(&mut self, deadlines: u32) {
        self.missed = self.missed.saturating_add(deadlines);
    }

    /// Deadlines that have not been met so far.
    pub(crate) fn missed(&self) -> u32 {
        self.missed
    }

    /// It has read a percept between two cycles.
    pub(crate) fn heard(&mut self) {
        self.times.heard = self.clock.now().0;
    }

    /// It has read its percept.
    pub(crate) fn received(&mut self) {
        let receive = self.lap();
        self.times = RawTimes { receive, neighbors: 0, cell: 0, truncation: 0, centroid: 0, ..self.times };
    }

    /// Its controller has done its step.
    pub(crate) fn stepped(&mut self) {
        self.times.step = self.lap();
    }

    /// Times that are known before the command is sent.
    pub(crate) fn times(&self) -> RawTimes {
        self.times
    }

    /// The command has been sent, if there was one to be timed: the next one tells how long that took.
    pub(crate) fn published(&mut self) {
        self.times.publish_before = self.lap();
    }

    /// A first command has been sent, which ends no cycle.
    pub(crate) fn booted(&mut self) {
        self.times.publish_before = 0;
    }

    fn lap(&mut self) -> u32 {
        let now = self.clock.now();
        let lap = now.since(self.last).unwrap_or(0);
        self.last = now;
        saturated(lap.into())
    }
}

impl StageObserver for Stopwatch {
    fn passed(&mut self, stage: Stage) {
        let lap = self.lap();
        let stage = match stage {
            Stage::Neighbors => &mut self.times.neighbors,
            Stage::Cell => &mut self.times.cell,
            Stage::Truncation => &mut self.times.truncation,
            Stage::Centroid => &mut self.times.centroid,
        };
        // One that is told again goes on.
        *stage = stage.saturating_add(lap);
    }
}

fn saturated(count: u128) -> u32 {
    u32::try_from(count).unwrap_or(u32::MAX)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stages_follow_each_other_without_a_gap() {
        let mut watch = Stopwatch::new();
        let before = watch.clock.now();
        watch.woke_late(Duration::from_secs(3600));
        watch.miss(2);
        watch.received();
        Stage::ALL.into_iter().rev().chain(Stage::ALL).for_each(|stage| watch.passed(stage));
        watch.stepped();
        let times = watch.times();
        assert!(before.0 <= times.woke);
        assert_eq!(times.decided(), watch.last, "the stages add up to the whole");
        assert_eq!((times.late_ns, watch.missed(), times.publish_before), (u32::MAX, 2, 0));
        watch.published();
        let published = watch.last;
        watch.woke_late(Duration::ZERO);
        watch.miss(1);
        let next = watch.times();
        assert_eq!(times.decided().0 + u64::from(next.publish_before), published.0);
        assert_eq!((next.late_ns, watch.missed()), (0, 3));
        watch.booted();
        assert_eq!(watch.times().publish_before, 0);
    }
}
