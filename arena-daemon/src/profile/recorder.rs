//! Takes what agents say about their cycles, checks it, and keeps it in histograms.
//!
//! A tick is not to be slowed down, so what comes is put aside ([`Recorder::note`]) and worked into the histograms
//! while the agents are at the next cycle ([`Recorder::digest`]). Stages are gathered for [`ROWS`] cycles per robot
//! before they are, robots taking turns, so that each histogram is fetched from memory once for all of them.
//! Nothing is allocated once histograms have grown to what there is to measure.

use std::{fmt, time::SystemTime};

use protocol::{
    command::Command,
    cycles::{Calibration, Clock, Rate, Stamp},
    percept::{Percept, Tick},
    raw::{BOOT_TICK, RawTimes},
    setup::Mode,
};

use super::{
    ClockUsed, Profile, RobotProfile,
    cycle_times::{CycleTimes, Stage},
    flight::{Origins, Underway},
    histograms::{Histograms, Span},
    usage::Usage,
};
use crate::process::Process;

/// Cycles of a robot that are gathered before they go into its histograms.
const ROWS: usize = 64;
/// In real time an agent may answer a percept some cycles late: so many are remembered.
const PERCEPTS_IN_REALTIME: usize = 4;

/// Somebody who wants every cycle. Gets some of one robot at a time, in their order.
pub type Observer = Box<dyn FnMut(&[CycleTimes])>;

/// Measures the agents of a run.
pub struct Recorder {
    mode: Mode,
    clock: Clock,
    calibration: Calibration,
    /// Once all have joined.
    began: Option<Began>,
    /// When the percepts of the last cycles were ready to be handed out.
    handed_out: Vec<(Tick, Stamp)>,
    next_hand_out: usize,
    rung: Stamp,
    robots: Vec<Robot>,
    origins: Origins,
    refused: u64,
    packets_unknown: u64,
    observer: Option<Observer>,
}

#[derive(Clone, Copy, Debug)]
struct Began {
    at: Stamp,
    at_time: SystemTime,
    rate: Rate,
}

/// What is kept of one robot, whatever life it is in.
#[derive(Debug)]
struct Robot {
    /// What has come since the last digest.
    arrived: Option<Arrival>,
    /// The cycle before, which lacks its last stage: the next command tells.
    open: Option<Open>,
    rows: Vec<CycleTimes>,
    underway: Underway,
    histograms: Histograms,
    counts: u64,
    cycles: u64,
    missed: u32,
    missed_before: u64,
    last_late_ns: Option<u32>,
}

/// A command's times that make sense.
#[derive(Clone, Copy, Debug)]
struct Arrival {
    tick: Tick,
    times: RawTimes,
    wake_ns: u32,
    /// From the hand-out until the percept was read; unknown if that is too long ago.
    second_ns: Option<u64>,
}

#[derive(Clone, Copy, Debug)]
struct Open {
    row: CycleTimes,
    woke: Stamp,
    /// When its goal was known.
    decided: Stamp,
}

impl fmt::Debug for Recorder {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Recorder")
            .field("mode", &self.mode)
            .field("began", &self.began)
            .finish_non_exhaustive()
    }
}

impl Recorder {
    /// For so many robots.
    pub fn new(robots: usize, mode: Mode) -> Self {
        let clock = Clock::of_this_machine();
        let percepts = match mode {
            Mode::Lockstep => 1,
            Mode::Realtime => PERCEPTS_IN_REALTIME,
        };
        Self {
            mode,
            clock,
            calibration: Calibration::begin(clock),
            began: None,
            handed_out: vec![(BOOT_TICK, Stamp(0)); percepts],
            next_hand_out: 0,
            rung: Stamp(0),
            robots: (0..robots).map(|_| Robot::new(percepts)).collect(),
            origins: Origins::new(robots),
            refused: 0,
            packets_unknown: 0,
            observer: None,
        }
    }

    /// Has every cycle shown to `observer` too. What comes late in the run is shown when it is
    /// [finished](Recorder::finish).
    pub fn observe(&mut self, observer: Observer) {
        self.observer = Some(observer);
    }

    /// Everyone has joined: the run's time begins.
    pub fn begin(&mut self) {
        let rate = self.calibration.finish();
        self.began = Some(Began { at: self.clock.now(), at_time: SystemTime::now(), rate });
    }

    /// The percepts of `tick` are ready, and about to be handed out.
    pub fn hand_out(&mut self, tick: Tick) {
        self.handed_out[self.next_hand_out] = (tick, self.clock.now());
        self.next_hand_out = (self.next_hand_out + 1) % self.handed_out.len();
    }

    /// The doorbell is about to be rung.
    pub fn ring(&mut self) {
        self.rung = self.clock.now();
    }

    /// The arena takes in `command` of robot `index` in answer to `tick`, with what its agent says about it.
    pub fn note(&mut self, index: usize, tick: Tick, command: &Command, times: &RawTimes) {
        let Some(began) = self.began else { return };
        let (now, rate) = (self.clock.now(), began.rate);
        // A first word ends no cycle; some agents measure nothing.
        if tick == BOOT_TICK || times.woke == 0 {
            return;
        }
        let (received, decided) = (times.received(), times.decided());
        let handed_out = self.handed_out.iter().find(|out| out.0 == tick).map(|out| out.1);
        let wake_ns = match self.mode {
            Mode::Lockstep => Stamp(times.woke).since(self.rung).map(|counts| narrow(rate.ns(counts))),
            Mode::Realtime => Some(times.late_ns),
        };
        let not_before = handed_out.unwrap_or(began.at);
        let (Some(waited), Some(wake_ns), Some(under_way)) =
            (received.since(not_before), wake_ns, now.since(decided))
        else {
            // What the next command tells of publishing is about this cycle, and not about the last good one.
            self.settle(index, began);
            self.robots[index].open = None;
            self.refused += 1;
            return;
        };
        self.origins.note(&command.packet, narrow(rate.ns(under_way)));
        if self.robots[index].arrived.is_some() {
            // Two in one cycle, which only real time has.
            self.settle(index, began);
        }
        let second_ns = handed_out.map(|_| rate.ns(waited));
        self.robots[index].arrived = Some(Arrival { tick, times: *times, wake_ns, second_ns });
    }

    /// Works in what has come, and remembers what the robots of `present` hear by `percepts`. Best done while
    /// the agents are at work.
    pub fn digest(&mut self, percepts: &[Percept], present: &[usize]) {
        let Some(began) = self.began else { return };
        for &index in present {
            self.settle(index, began);
            let percept = &percepts[index];
            let packets = percept.deliveries.iter().map(|delivery| &delivery.packet);
            let unknown = self.robots[index].underway.note(percept.tick, packets, &self.origins);
            self.packets_unknown += unknown as u64;
        }
    }

    /// Robot `index` begins a new life.
    pub fn reborn(&mut self, index: usize) {
        if let Some(began) = self.began {
            self.settle(index, began);
        }
        let robot = &mut self.robots[index];
        robot.open = None;
        robot.last_late_ns = None;
        robot.missed_before += u64::from(std::mem::take(&mut robot.missed));
    }

    /// What has been measured. `processes` are those of the agents that are still there, by robot.
    pub fn finish(mut self, processes: impl IntoIterator<Item = Option<Process>>) -> Option<Profile> {
        let began = self.began?;
        for index in 0..self.robots.len() {
            self.settle(index, began);
            self.fold(index);
        }
        let length = began.rate.ns(self.clock.now().since(began.at)?);
        let robots = self.robots.into_iter().zip(processes).map(|(robot, process)| RobotProfile {
            missed_deadlines: robot.missed_before + u64::from(robot.missed),
            counts: robot.counts,
            cycles: robot.cycles,
            histograms: robot.histograms,
            usage: process.and_then(Usage::of),
        });
        Some(Profile {
            clock: ClockUsed { source: self.clock.source(), mhz: began.rate.per_us() },
            hardware_counters: "none".into(),
            mode: self.mode,
            began: began.at_time,
            length: std::time::Duration::from_nanos(length),
            robots: robots.collect(),
            stamps_refused: self.refused,
            packets_unknown: self.packets_unknown,
        })
    }

    /// Works in what has come of robot `index`.
    fn settle(&mut self, index: usize, began: Began) {
        let (robot, rate) = (&mut self.robots[index], began.rate);
        let Some(Arrival { tick, times, wake_ns, second_ns }) = robot.arrived.take() else { return };
        if let Some(second_ns) = second_ns {
            for first_ns in robot.underway.take(tick) {
                robot.histograms.record(Span::Packet, u64::from(first_ns) + second_ns);
            }
        }
        robot.missed = robot.missed.max(times.missed);
        if let Some(last_ns) = robot.last_late_ns.filter(|_| self.mode == Mode::Realtime) {
            robot.histograms.record(Span::Jitter, wake_ns.abs_diff(last_ns).into());
        }
        robot.last_late_ns = Some(wake_ns);
        let ns = |counts: u32| narrow(rate.ns(counts.into()));
        let before = robot.open.take();
        let woke_ns = rate.ns(Stamp(times.woke).since(began.at).unwrap_or(0));
        let stages = [times.receive, times.neighbors, times.cell, times.truncation, times.centroid];
        let mut row = CycleTimes { robot: index as u32, tick, woke_ns, stages_ns: [0; Stage::ALL.len()] };
        row.stages_ns[Stage::Wake as usize] = wake_ns;
        for (slot, counts) in row.stages_ns[Stage::Receive as usize..].iter_mut().zip(stages) {
            *slot = ns(counts);
        }
        robot.open = Some(Open { row, woke: Stamp(times.woke), decided: times.decided() });
        let Some(Open { row: mut whole, woke, decided }) = before else { return };
        let published = Stamp(decided.0.saturating_add(times.publish_before.into()));
        let Some(counts) = published.since(woke).filter(|_| published.0 <= times.woke) else {
            self.refused += 1;
            return;
        };
        whole.stages_ns[Stage::Publish as usize] = ns(times.publish_before);
        robot.rows.push(whole);
        robot.counts += counts;
        robot.cycles += 1;
        // Robots take turns.
        if (robot.cycles as usize + index).is_multiple_of(ROWS) {
            self.fold(index);
        }
    }

    /// Moves the cycles that have been gathered of robot `index` into its histograms.
    fn fold(&mut self, index: usize) {
        let Robot { rows, histograms, .. } = &mut self.robots[index];
        histograms.fold(rows);
        if let Some(observer) = &mut self.observer {
            observer(rows);
        }
        rows.clear();
    }
}

impl Robot {
    fn new(percepts: usize) -> Self {
        Self {
            arrived: None,
            open: None,
            rows: Vec::with_capacity(ROWS),
            underway: Underway::new(percepts),
            histograms: Histograms::default(),
            counts: 0,
            cycles: 0,
            missed: 0,
            missed_before: 0,
            last_late_ns: None,
        }
    }
}

/// As a `u32`; the largest one for more than 4.29 s.
fn narrow(ns: u64) -> u32 {
    u32::try_from(ns).unwrap_or(u32::MAX)
}

#[cfg(test)]
mod tests;
