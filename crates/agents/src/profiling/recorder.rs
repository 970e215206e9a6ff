//! Takes what agents say about their cycles, checks it, and counts it for histograms.
//!
//! A tick is not to be slowed down, and a thousand robots' tallies are in no cache. So what comes is written to a
//! [`Journal`] from front to back, and each robot's part of it is worked into its tallies for many cycles at once,
//! robots taking turns, beside the arena's own work or while the agents are at the next cycle ([`Recorder::digest`]).
//! Nothing is allocated once tallies and journal have grown to what there is to measure.

use std::{
    collections::VecDeque,
    fmt, mem,
    time::{Duration, SystemTime},
};

use profile::{
    ClockUsed, CycleTimes, PacketNumber, Profile, RobotProfile, Source, Span, Stage, WatchedCycles,
};
use protocol::{
    packet::Packet,
    percept::{Percept, Tick},
    setup::Mode,
};
use transport::{
    clock::{self, Calibration, Clock, Rate, Stamp},
    raw::{BOOT_TICK, RawTimes},
};

use super::{
    counters::Counters,
    flight::Origins,
    journal::{Answer, Excerpt, Journal, Round},
    measure::Measure,
    tally::Tallies,
    usage,
};
use processes::Process;

/// Cycles of a robot that go into its tallies at once, at least, if there are so many robots: the more they are, the
/// less its tallies cost to fetch, and the more the journal does.
const ROUNDS_MIN: usize = 32;
/// Cycles of all robots that are kept, as long as each robot keeps its least.
const CYCLES_KEPT: usize = 16_000;
/// In real time an agent may answer a percept that is not the newest. One that is older than these has no part in
/// what is measured; in lock-step there is only one.
const PERCEPTS_IN_REALTIME: Round = 4;
/// Packets of a robot that are remembered until the cycles that they end are whole.
const PACKETS_KEPT: usize = 16;

/// Measures the agents of a run.
pub(crate) struct Recorder {
    mode: Mode,
    clock: Clock,
    calibration: Calibration,
    /// Once all have joined.
    began: Option<Began>,
    counters: Option<Counters>,
    rung: Stamp,
    journal: Journal,
    origins: Origins,
    robots: Vec<Robot>,
    // What is worked in of one robot; kept for their memory alone.
    excerpt: Excerpt,
    rows: Vec<CycleTimes>,
    /// Rounds that had begun when robots' turn came last, and the robot whose turn comes next.
    digested: Round,
    next: usize,
    left_out: u64,
    packets_unknown: u64,
    /// Where the last moments are kept while somebody watches.
    watched: WatchedCycles,
    /// Robots whose whole cycles are wanted one by one, and those that are known.
    wanted: Vec<usize>,
    cycles: Vec<CycleTimes>,
}

#[derive(Clone, Copy, Debug)]
struct Began {
    at: Stamp,
    at_time: SystemTime,
    rate: Rate,
}

/// Records of one robot, whatever life it is in.
#[derive(Debug, Default)]
struct Robot {
    /// The first round that is not in the tallies.
    next: Round,
    /// The cycle before that, which lacks its last stage: the next answer tells.
    open: Option<Open>,
    tallies: Tallies,
    counts: u64,
    cycles: u64,
    missed: u32,
    missed_before: u64,
    /// If its cycles are wanted one by one, the packets that ended the last ones.
    packets: Option<VecDeque<(Tick, PacketNumber)>>,
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
    pub(crate) fn new(robots: usize, mode: Mode, measure: &Measure) -> Self {
        let is_wanted =
            |&index: &usize| measure.cycles_of.as_ref().is_some_and(|set| set.contains(index as u32));
        let wanted: Vec<usize> = (0..robots).filter(is_wanted).collect();
        let clock = Clock::of_this_machine();
        let rounds = robots.div_ceil(robots_at_once(robots));
        Self {
            mode,
            clock,
            calibration: Calibration::begin(clock),
            began: None,
            counters: None,
            rung: Stamp(0),
            // Those that a robot's turn comes for, those that may still be answered, and the present one.
            journal: Journal::new(robots, rounds + PERCEPTS_IN_REALTIME as usize + 1),
            origins: Origins::new(robots),
            robots: (0..robots)
                .map(|index| Robot { packets: is_wanted(&index).then(VecDeque::new), ..Robot::default() })
                .collect(),
            excerpt: Excerpt::default(),
            rows: Vec::new(),
            digested: 0,
            next: 0,
            left_out: 0,
            packets_unknown: 0,
            watched: measure.watched.clone(),
            wanted,
            cycles: Vec::new(),
        }
    }

    /// Time since all had joined, nanoseconds; `None` before that.
    pub(crate) fn now_ns(&self) -> Option<u64> {
        let Began { at, rate, .. } = self.began?;
        Some(rate.ns(self.clock.now().since(at).unwrap_or(0)))
    }

    /// Moves whole cycles of those robots whose are wanted to the end of `cycles`.
    pub(crate) fn take_cycles(&mut self, cycles: &mut Vec<CycleTimes>) {
        cycles.append(&mut self.cycles);
    }

    /// Takes note of the timer periods that have gone by without a cycle of robot `index` in its life.
    pub(crate) fn missed(&mut self, index: usize, deadlines: u32) {
        // In lock-step there are none, and nothing of the robot need be fetched.
        if deadlines > 0 {
            self.robots[index].missed = self.robots[index].missed.max(deadlines);
        }
    }

    /// In real time, timer periods that went by without a cycle of robot `index`.
    pub(crate) fn missed_deadlines(&self, index: usize) -> u64 {
        let robot = &self.robots[index];
        robot.missed_before + u64::from(robot.missed)
    }

    /// Everyone has joined, by `processes` in the order of robots: the run's time begins.
    pub(crate) fn begin(&mut self, processes: &[Option<Process>]) {
        self.counters = Some(Counters::open(processes));
        let rate = self.calibration.finish();
        let at = self.clock.now();
        self.began = Some(Began { at, at_time: SystemTime::now(), rate });
    }

    /// The percepts of `tick` are ready, and about to be handed out.
    pub(crate) fn begin_round(&mut self, tick: Tick) {
        self.journal.begin(tick, self.clock.now());
    }

    /// `robots` are handed their ones of `percepts`.
    pub(crate) fn hand_out(&mut self, robots: &[usize], percepts: &[Percept]) {
        let handed_out = robots.iter().map(|&index| (index, &percepts[index]));
        for (index, percept) in handed_out.filter(|(_, percept)| percept.tick != BOOT_TICK) {
            self.packets_unknown += self.journal.hand_out(index, percept, &self.origins) as u64;
        }
    }

    /// The doorbell is about to be rung.
    pub(crate) fn ring(&mut self) {
        self.rung = self.clock.now();
    }

    /// The arena takes in `packet` of robot `index` in answer to `tick`, with what its agent says about it.
    pub(crate) fn note(&mut self, index: usize, tick: Tick, packet: &Packet, times: &RawTimes) {
        let Some(Began { rate, .. }) = self.began else { return };
        let now = self.clock.now();
        // A first word ends no cycle; some agents measure nothing.
        if tick == BOOT_TICK || times.woke == 0 {
            return;
        }
        let Some((round, handed_out)) = self.journal.handed_out(tick, self.percepts()) else {
            self.left_out += 1;
            return;
        };
        let wake_ns = match self.mode {
            Mode::Lockstep => Stamp(times.woke).since(self.rung).map(|counts| narrow(rate.ns(counts))),
            Mode::Realtime => Some(times.late_ns),
        };
        let (second, first) = (times.received().since(handed_out), now.since(times.decided()));
        let (Some(second), Some(first), Some(wake_ns)) = (second, first, wake_ns) else {
            // What makes no sense. What the next answer tells of publishing is about this cycle, which its
            // robot does not get: so neither does it get that.
            self.left_out += 1;
            self.journal.note(index, round, Answer::broken(tick));
            return;
        };
        self.origins.note(packet, narrow(rate.ns(first)));
        if let Some(packets) = &mut self.robots[index].packets {
            if packets.len() == PACKETS_KEPT {
                packets.pop_front();
            }
            packets.push_back((tick, PacketNumber::of(packet)));
        }
        let second_ns = narrow(rate.ns(second));
        self.watched.with(|recent| {
            let ns = |counts: u32| narrow(rate.ns(counts.into()));
            let RawTimes { receive, neighbors, cell, truncation, centroid, step, publish_before, .. } =
                *times;
            let [receive, neighbors, cell, truncation, centroid, step, publish] =
                [receive, neighbors, cell, truncation, centroid, step, publish_before].map(ns);
            recent.note(index, [wake_ns, receive, neighbors, cell, truncation, centroid, step, publish]);
        });
        self.journal.note(index, round, Answer { tick, wake_ns, second_ns, times: *times });
    }

    /// Works in what has come of those robots whose turn it is, once per round.
    pub(crate) fn digest(&mut self) {
        let (robots, rounds) = (self.robots.len(), self.journal.rounds());
        let whole = rounds.saturating_sub(self.percepts());
        let some = match (self.digested < rounds, self.watched.are_watched()) {
            (false, _) => 0,
            (true, false) => robots_at_once(robots),
            (true, true) => robots.div_ceil(ROUNDS_MIN),
        };
        for index in self.next..self.next + some {
            self.work_in(index % robots, whole);
        }
        self.next = (self.next + some) % robots;
        self.digested = rounds;
        for at in 0..self.wanted.len() {
            self.work_in(self.wanted[at], whole);
        }
    }

    /// Robot `index` begins a new life.
    pub(crate) fn reborn(&mut self, index: usize) {
        self.work_in(index, self.journal.rounds());
        let robot = &mut self.robots[index];
        robot.open = None;
        self.watched.with(|recent| recent.reborn(index));
        robot.missed_before += u64::from(mem::take(&mut robot.missed));
    }

    /// Returns what has been measured, once, if all had joined. `processes` are those of the agents that are still there,
    /// by robot.
    pub(crate) fn finish(&mut self, processes: impl IntoIterator<Item = Option<Process>>) -> Option<Profile> {
        let began = self.began?;
        for index in 0..self.robots.len() {
            self.work_in(index, self.journal.rounds());
        }
        let mut counters = self.counters.take()?;
        let robots = self.robots.iter().zip(processes).enumerate();
        let robots = robots.map(|(index, (robot, process))| RobotProfile {
            missed_deadlines: robot.missed_before + u64::from(robot.missed),
            counts: robot.counts,
            cycles: robot.cycles,
            histograms: robot.tallies.histograms(),
            usage: process.and_then(usage::of),
            counted: process.and_then(|process| counters.read(index, process)),
        });
        let robots = robots.collect();
        let source = match self.clock.source() {
            clock::Source::Tsc => Source::Tsc,
            clock::Source::Monotonic => Source::Monotonic,
        };
        Some(Profile {
            clock: ClockUsed { source, mhz: began.rate.per_us() },
            hardware_counters: counters.told().into(),
            mode: self.mode,
            began: began.at_time,
            length: Duration::from_nanos(self.now_ns().unwrap_or(0)),
            robots,
            cycles_left_out: self.left_out,
            packets_unknown: self.packets_unknown,
        })
    }

    /// Percepts that may be unanswered at the same time.
    fn percepts(&self) -> Round {
        match self.mode {
            Mode::Lockstep => 1,
            Mode::Realtime => PERCEPTS_IN_REALTIME,
        }
    }

    /// Works what robot `index` has answered before round `until` into its tallies.
    fn work_in(&mut self, index: usize, until: Round) {
        let Some(began) = self.began else { return };
        let robot = &mut self.robots[index];
        let rounds = robot.next..until.max(robot.next);
        robot.next = rounds.end;
        self.journal.read(index, rounds, &mut self.excerpt);
        let Excerpt { answers, packets_ns, .. } = &self.excerpt;
        let packets = robot.tallies.of(Span::Packet);
        packets_ns.iter().for_each(|&ns| packets.add(ns));
        self.watched.with(|recent| packets_ns.iter().for_each(|&ns| recent.packet(ns)));
        for answer in answers {
            match robot.answered(index, answer, began) {
                Ok(None) => {}
                Ok(Some(row)) => {
                    if self.mode == Mode::Realtime {
                        let jitter_ns = answer.wake_ns.abs_diff(row.stage_ns(Stage::Wake));
                        robot.tallies.of(Span::Jitter).add(jitter_ns.into());
                    }
                    self.rows.push(row);
                }
                Err(NoSense) => self.left_out += 1,
            }
        }
        robot.tallies.fold(&self.rows);
        if let Some(packets) = &robot.packets {
            let named = self.rows.iter().map(|row| {
                let packet = packets.iter().find(|(tick, _)| *tick == row.tick).map(|&(_, packet)| packet);
                CycleTimes { packet, ..*row }
            });
            self.cycles.extend(named);
        }
        self.rows.clear();
    }
}

/// Robots whose turn comes in one round; one if there are few.
fn robots_at_once(robots: usize) -> usize {
    robots.div_ceil((CYCLES_KEPT / robots).max(ROUNDS_MIN))
}

/// Stamps that contradict each other.
struct NoSense;

impl Robot {
    /// Takes in one answer, which ends the cycle before its own: returns that, if there was one.
    fn answered(
        &mut self,
        index: usize,
        answer: &Answer,
        Began { at, rate, .. }: Began,
    ) -> Result<Option<CycleTimes>, NoSense> {
        let Answer { tick, wake_ns, times, .. } = *answer;
        if answer.is_broken() {
            self.open = None;
            return Ok(None);
        }
        let ns = |counts: u32| narrow(rate.ns(counts.into()));
        let [receive, neighbors, cell, truncation, centroid, step] =
            [times.receive, times.neighbors, times.cell, times.truncation, times.centroid, times.step]
                .map(ns);
        let row = CycleTimes {
            robot: index as u32,
            tick,
            woke_ns: rate.ns(Stamp(times.woke).since(at).unwrap_or(0)),
            stages_ns: [wake_ns, receive, neighbors, cell, truncation, centroid, step, 0],
            packet: None,
        };
        let open = Open { row, woke: Stamp(times.woke), decided: times.decided() };
        let Some(Open { row: mut whole, woke, decided }) = self.open.replace(open) else { return Ok(None) };
        let published = Stamp(decided.0.saturating_add(times.publish_before.into()));
        let counts = published.since(woke).filter(|_| published.0 <= times.woke).ok_or(NoSense)?;
        whole.stages_ns[Stage::Publish as usize] = ns(times.publish_before);
        self.counts += counts;
        self.cycles += 1;
        Ok(Some(whole))
    }
}

/// As a `u32`; the largest one for more than 4.29 s.
fn narrow(ns: u64) -> u32 {
    u32::try_from(ns).unwrap_or(u32::MAX)
}

#[cfg(test)]
mod tests;
