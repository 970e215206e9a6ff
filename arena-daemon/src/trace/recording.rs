//! Events of a run, as its trace shows them.

use arena::fault::{ProcessAction, ProcessFault, ledger::Line};
use files::WriteError;
use protocol::{
    packet::Packet,
    percept::{Percept, Tick},
    setup::Mode,
};
use serde_json::json;
use transport::clock::{Clock, Rate, Stamp};

use super::{
    bound::{Bound, Cycles},
    events::{Events, Scope, Track},
    packets::{Arrow, Correspondence, arrows},
};
use crate::{
    profile::{CycleTimes, Stage},
    squad::Incident,
};

/// Some robots' tracks and the arena's, on their way to a file.
#[derive(Debug)]
pub(crate) struct Recording {
    bound: Bound,
    mode: Mode,
    began: Option<Began>,
    /// By index; `None` for those who are not traced.
    robots: Vec<Option<Correspondence>>,
    /// When the last cycle of each robot ended; `None` before its track has a name.
    last_end_ns: Vec<Option<u64>>,
    /// The arena's tick that is going on.
    present: Option<Present>,
    /// Its events.
    arena: Events,
    /// Cycles that have come since the last tick.
    cycles: Cycles,
    /// Percepts read in them: by whom, of which tick, and when.
    read: Vec<(u32, Tick, u64)>,
    /// Arrows that have been drawn.
    packets: u64,
    /// Faults of the plan that have fired, and those that are over, by their place in it.
    fired: Vec<[bool; 2]>,
    /// Incidents that have been shown.
    incidents: usize,
    /// The last tick that has ended, and when.
    last_tick: (Tick, u64),
}

#[derive(Clone, Copy, Debug)]
struct Began {
    clock: Clock,
    at: Stamp,
    rate: Rate,
}

/// A tick of the arena's: when its parts began.
#[derive(Clone, Copy, Debug)]
struct Present {
    tick: Tick,
    began_ns: u64,
    percepts_ready_ns: Option<u64>,
    rung_ns: Option<u64>,
    answered_ns: Option<u64>,
}

impl Recording {
    /// Within `bound`, for those of so many robots that `is_traced` tells.
    pub(super) fn new(bound: Bound, mode: Mode, robots: u32, is_traced: impl Fn(u32) -> bool) -> Self {
        let robot = |index| is_traced(index).then(Correspondence::default);
        Self {
            bound,
            mode,
            began: None,
            robots: (0..robots).map(robot).collect(),
            last_end_ns: vec![None; robots as usize],
            present: None,
            arena: Events::default(),
            cycles: Cycles::default(),
            read: Vec::new(),
            packets: 0,
            fired: Vec::new(),
            incidents: 0,
            last_tick: (0, 0),
        }
    }

    /// Text before the first event of a run, without a comma.
    pub(super) fn first_events() -> String {
        let mut events = Events::default();
        events.name_process(Track::ARENA, "arena");
        events.name_track(Track::ARENA, "arena");
        events.name_process(Track::robot(0), "robots");
        String::from_utf8_lossy(events.bytes()).trim_start_matches([',', '\n']).to_owned()
    }

    /// All have joined: time begins.
    pub(crate) fn begin(&mut self, clock: Clock, at: Stamp, rate: Rate) {
        self.began = Some(Began { clock, at, rate });
    }

    /// Whether robot `index` is traced.
    pub(crate) fn traces(&self, index: usize) -> bool {
        self.robots.get(index).is_some_and(Option::is_some)
    }

    /// The arena begins `tick`, in which the plan does this to agents.
    pub(super) fn tick_begins(&mut self, tick: Tick, process_faults: &[ProcessFault]) {
        let Some(began_ns) = self.now_ns() else { return };
        self.present =
            Some(Present { tick, began_ns, percepts_ready_ns: None, rung_ns: None, answered_ns: None });
        for &ProcessFault { robot, action } in process_faults {
            if !self.traces(robot as usize) {
                continue;
            }
            self.name(robot);
            let (name, kind) = match action {
                ProcessAction::Kill => ("kill", "kill"),
                ProcessAction::Restart => ("restart", "kill"),
                ProcessAction::Pause => ("pause", "pause"),
                ProcessAction::Resume => ("resume", "pause"),
            };
            let args = json!({ "kind": kind, "tick": tick });
            self.arena.instant(Scope::Track, Track::robot(robot), began_ns, "fault", name, &args);
        }
    }

    /// Percepts are ready, and about to be handed out.
    pub(super) fn exchange_begins(&mut self) {
        let now_ns = self.now_ns();
        self.at_present(|present| present.percepts_ready_ns = now_ns);
    }

    /// Robot `index` is handed `percept`.
    pub(crate) fn hand_out(&mut self, index: usize, percept: &Percept) {
        let is_kept = !self.bound.leaves_out(percept.tick);
        if let Some(robot) = self.robots[index].as_mut().filter(|_| is_kept) {
            robot.hears(percept.tick, percept.deliveries.iter().map(|delivery| &delivery.packet));
        }
    }

    /// The doorbell is rung.
    pub(crate) fn ring(&mut self, at: Stamp) {
        let rung_ns = self.ns(at);
        self.at_present(|present| present.rung_ns = rung_ns);
    }

    /// Robot `index` has answered `tick`, with `packet`.
    pub(crate) fn answered(&mut self, index: usize, tick: Tick, packet: &Packet) {
        let is_kept = !self.bound.leaves_out(tick);
        if let Some(robot) = self.robots[index].as_mut().filter(|_| is_kept) {
            robot.sends(tick, packet);
        }
    }

    /// Answers have been taken in.
    pub(super) fn exchange_ends(&mut self) {
        let now_ns = self.now_ns();
        self.at_present(|present| present.answered_ns = now_ns);
    }

    /// Whole cycles, those of a robot in their order.
    pub(crate) fn cycles(&mut self, cycles: &[CycleTimes]) {
        for cycle in cycles {
            let index = cycle.robot as usize;
            if !self.traces(index) {
                continue;
            }
            // One that begins before the last one has ended cannot be shown on one track.
            let overlaps = self.last_end_ns[index].is_some_and(|end_ns| cycle.woke_ns < end_ns);
            match overlaps || self.bound.leaves_out(cycle.tick) {
                true => self.bound.leave_out_a_cycle(),
                false => self.cycle(cycle),
            }
        }
    }

    fn cycle(&mut self, cycle: &CycleTimes) {
        let &CycleTimes { robot, tick, woke_ns, .. } = cycle;
        self.name(robot);
        self.cycles.count += 1;
        let cuts = self.cycles.events.cuts().len();
        let (index, track, end_ns) = (robot as usize, Track::robot(robot), woke_ns + cycle.cycle_ns());
        let last_end_ns = self.last_end_ns[index].replace(end_ns).unwrap_or(0);
        // A timer may be due while the last cycle is still going on.
        let due_ns = woke_ns.saturating_sub(cycle.stage_ns(Stage::Wake).into()).max(last_end_ns);
        let [wake, stages @ ..] = Stage::ALL;
        self.cycles.events.slice(track, wake.name(), due_ns, woke_ns);
        self.cycles.events.slice_of_tick(track, "cycle", tick, woke_ns, end_ns);
        let mut at_ns = woke_ns;
        for stage in stages {
            let stage_ns = u64::from(cycle.stage_ns(stage));
            self.cycles.events.slice(track, stage.name(), at_ns, at_ns + stage_ns);
            match stage {
                // Within the stage, so that a viewer finds it there.
                Stage::Receive => self.read.push((robot, tick, at_ns + stage_ns.saturating_sub(1))),
                Stage::Publish => {
                    let robot = self.robots[index].as_mut();
                    robot.into_iter().for_each(|robot| robot.published(tick, at_ns, end_ns));
                }
                _ => {}
            }
            at_ns += stage_ns;
        }
        self.cycles.events.join_cycle(cuts, tick);
    }

    /// Adds what went wrong without being planned, from the beginning of the run.
    pub(super) fn incidents(&mut self, incidents: &[Incident]) {
        let Some(now_ns) = self.now_ns() else { return };
        for Incident { robot, tick, what } in incidents.iter().skip(self.incidents) {
            let track = match self.traces(*robot as usize) {
                true => {
                    self.name(*robot);
                    Track::robot(*robot)
                }
                false => Track::ARENA,
            };
            let args = json!({ "robot": robot, "tick": tick, "what": what });
            self.arena.instant(Scope::Track, track, now_ns, "incident", "incident", &args);
        }
        self.incidents = incidents.len();
    }

    /// The arena is through with its tick, and this is what the faults of the plan have done so far.
    pub(super) fn tick_ends<'a>(&mut self, ledger: impl Iterator<Item = &'a Line>) {
        let (Some(end_ns), Some(present)) = (self.now_ns(), self.present.take()) else { return };
        let Present { tick, began_ns, percepts_ready_ns, rung_ns, answered_ns } = present;
        for (fault, line) in ledger.enumerate() {
            if self.fired.len() == fault {
                self.fired.push([false; 2]);
            }
            let kind = line.kind.name();
            let now = [
                line.fired_tick.is_some(),
                line.fired_tick.is_some() && line.until_tick.is_some_and(|until| tick >= until),
            ];
            for (what, at) in ["begins", "ends"].into_iter().zip(0..) {
                if now[at] && !self.fired[fault][at] {
                    let args = json!({ "kind": kind, "fault": fault, "tick": tick });
                    let name = format!("{kind} {what}");
                    self.arena.instant(Scope::All, Track::ARENA, began_ns, "fault", &name, &args);
                }
            }
            self.fired[fault] = now;
        }
        self.arena.slice_of_tick(Track::ARENA, "tick", tick, began_ns, end_ns);
        let answered_ns = answered_ns.unwrap_or(end_ns);
        let rung_ns = rung_ns.unwrap_or(answered_ns);
        self.arena.slice(Track::ARENA, "world", began_ns, percepts_ready_ns.unwrap_or(end_ns));
        if let Some(percepts_ready_ns) = percepts_ready_ns {
            self.arena.slice(Track::ARENA, "hand out", percepts_ready_ns, rung_ns);
            let takes_in = match self.mode {
                Mode::Lockstep => "wait for agents",
                Mode::Realtime => "take answers in",
            };
            self.arena.slice(Track::ARENA, takes_in, rung_ns, answered_ns);
        }
        self.draw_arrows();
        self.bound.keep(tick, end_ns, &mut self.arena, &mut self.cycles);
        self.last_tick = (tick, end_ns);
    }

    /// The run is over, and all cycles have come.
    ///
    /// # Errors
    /// If the trace ends early, because it could not be written.
    pub(super) fn finish(&mut self) -> Result<(), WriteError> {
        // A run that fails does so within a tick.
        self.tick_ends(std::iter::empty());
        self.draw_arrows();
        let (tick, ended_ns) = self.last_tick;
        self.bound.keep_cycles(tick, ended_ns, &mut self.cycles);
        self.bound.finish()
    }

    fn draw_arrows(&mut self) {
        for (receiver, tick, read_ns) in std::mem::take(&mut self.read) {
            for Arrow { sent, received } in arrows(&mut self.robots, receiver, tick, read_ns) {
                self.packets += 1;
                let [sent, received] = [sent, received].map(|(robot, ns)| (Track::robot(robot), ns));
                self.cycles.events.packet(self.packets, sent, received);
            }
        }
    }

    /// Gives robot `index` a track, if it has none yet.
    fn name(&mut self, index: u32) {
        let end_ns = &mut self.last_end_ns[index as usize];
        if end_ns.is_none() {
            *end_ns = Some(0);
            self.cycles.events.name_track(Track::robot(index), format_args!("robot {index}"));
        }
    }

    fn at_present(&mut self, note: impl FnOnce(&mut Present)) {
        if let Some(present) = &mut self.present {
            note(present);
        }
    }

    fn now_ns(&self) -> Option<u64> {
        self.ns(self.began?.clock.now())
    }

    fn ns(&self, at: Stamp) -> Option<u64> {
        let began = self.began?;
        Some(began.rate.ns(at.since(began.at).unwrap_or(0)))
    }
}

#[cfg(test)]
mod tests;
