//! Events of a run, as its trace shows them.

use std::mem;

use arena::fault::ledger::Line;
use engine::{Incident, TickStamps};
use files::WriteError;
use profile::{CycleTimes, Stage};
use protocol::{
    percept::{Percept, Tick},
    setup::Mode,
};
use scenario::{ProcessAction, ProcessFault};
use serde_json::json;

use super::{
    bound::{Bound, Cycles},
    events::{Events, Scope, Track},
    packets::{Arrow, Correspondence, arrows},
};

/// Some robots' tracks and the arena's, on their way to a file.
#[derive(Debug)]
pub(super) struct Recording {
    bound: Bound,
    mode: Mode,
    /// By index; `None` for those who are not traced.
    robots: Vec<Option<Correspondence>>,
    /// When the last cycle of each robot ended; `None` before its track has a name.
    last_end_ns: Vec<Option<u64>>,
    /// The arena's tick that is going on, and what the plan does to agents in it.
    present: Option<(Tick, Vec<ProcessFault>)>,
    /// Incidents that are still to be shown.
    incidents: Vec<Incident>,
    /// Events of the arena's tick.
    arena: Events,
    /// Cycles that have come since the last tick.
    cycles: Cycles,
    /// Percepts read in them: by whom, of which tick, and when.
    read: Vec<(u32, Tick, u64)>,
    /// Arrows that have been drawn.
    packets: u64,
    /// Faults of the plan that have fired, and those that are over, by their place in it.
    fired: Vec<[bool; 2]>,
    /// The last tick that has ended, and when.
    last_tick: (Tick, u64),
}

impl Recording {
    /// Within `bound`, for those of so many robots that `is_traced` tells.
    pub(super) fn new(bound: Bound, mode: Mode, robots: u32, is_traced: impl Fn(u32) -> bool) -> Self {
        let robot = |index| is_traced(index).then(Correspondence::default);
        Self {
            bound,
            mode,
            robots: (0..robots).map(robot).collect(),
            last_end_ns: vec![None; robots as usize],
            present: None,
            incidents: Vec::new(),
            arena: Events::default(),
            cycles: Cycles::default(),
            read: Vec::new(),
            packets: 0,
            fired: Vec::new(),
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

    /// Whether robot `index` is traced.
    pub(super) fn traces(&self, index: usize) -> bool {
        self.robots.get(index).is_some_and(Option::is_some)
    }

    /// The arena begins `tick`, in which the plan does this to agents.
    pub(super) fn tick_begins(&mut self, tick: Tick, process_faults: &[ProcessFault]) {
        self.present = Some((tick, process_faults.to_vec()));
    }

    /// Robots are handed the `percepts` of `tick`.
    pub(super) fn hand_out(&mut self, tick: Tick, percepts: &[Percept]) {
        if self.bound.leaves_out(tick) {
            return;
        }
        for (robot, percept) in self.robots.iter_mut().zip(percepts) {
            let packets = percept.deliveries.iter().map(|delivery| &delivery.packet);
            robot.iter_mut().for_each(|robot| robot.hears(tick, packets.clone()));
        }
    }

    /// Whole cycles, those of a robot in their order.
    pub(super) fn cycles(&mut self, cycles: &[CycleTimes]) {
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
                    if let (Some(robot), Some(packet)) = (&mut self.robots[index], cycle.packet) {
                        robot.published(packet, at_ns, end_ns);
                    }
                }
                _ => {}
            }
            at_ns += stage_ns;
        }
        self.cycles.events.join_cycle(cuts, tick);
    }

    /// Something has gone wrong without being planned.
    pub(super) fn incident(&mut self, incident: &Incident) {
        self.incidents.push(incident.clone());
    }

    fn show_process_faults(&mut self, tick: Tick, process_faults: &[ProcessFault], at_ns: u64) {
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
            self.arena.instant(Scope::Track, Track::robot(robot), at_ns, "fault", name, &args);
        }
    }

    fn show_incidents(&mut self, at_ns: u64) {
        for Incident { robot, tick, what } in mem::take(&mut self.incidents) {
            let track = match self.traces(robot as usize) {
                true => {
                    self.name(robot);
                    Track::robot(robot)
                }
                false => Track::ARENA,
            };
            let args = json!({ "robot": robot, "tick": tick, "what": what });
            self.arena.instant(Scope::Track, track, at_ns, "incident", "incident", &args);
        }
    }

    /// The arena is through with its tick, whose parts ended then, and this is what the faults of the plan have done so
    /// far.
    pub(super) fn tick_ends<'a>(&mut self, stamps: TickStamps, ledger: impl Iterator<Item = &'a Line>) {
        let Some((tick, process_faults)) = self.present.take() else { return };
        let TickStamps { began_ns, ready_ns, sent_ns, answered_ns, ended_ns } = stamps;
        self.show_process_faults(tick, &process_faults, began_ns);
        self.show_incidents(ended_ns);
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
        self.arena.slice_of_tick(Track::ARENA, "tick", tick, began_ns, ended_ns);
        let answered_ns = answered_ns.unwrap_or(ended_ns);
        let sent_ns = sent_ns.unwrap_or(answered_ns);
        self.arena.slice(Track::ARENA, "world", began_ns, ready_ns.unwrap_or(ended_ns));
        if let Some(ready_ns) = ready_ns {
            self.arena.slice(Track::ARENA, "hand out", ready_ns, sent_ns);
            let takes_in = match self.mode {
                Mode::Lockstep => "wait for agents",
                Mode::Realtime => "take answers in",
            };
            self.arena.slice(Track::ARENA, takes_in, sent_ns, answered_ns);
        }
        self.draw_arrows();
        self.bound.keep(tick, ended_ns, &mut self.arena, &mut self.cycles);
        self.last_tick = (tick, ended_ns);
    }

    /// The run is over, and all cycles have come.
    ///
    /// # Errors
    /// If the trace ends early, because it could not be written.
    pub(super) fn finish(&mut self) -> Result<(), WriteError> {
        self.draw_arrows();
        let (tick, ended_ns) = self.last_tick;
        self.bound.keep_cycles(tick, ended_ns, &mut self.cycles);
        self.bound.finish()
    }

    fn draw_arrows(&mut self) {
        for (receiver, tick, read_ns) in mem::take(&mut self.read) {
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
}

#[cfg(test)]
mod tests;
