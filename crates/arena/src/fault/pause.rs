//! `pause`: agents are stopped, and go on later as if nothing had been.

use protocol::percept::Tick;

use super::{
    fate::{AgentState, Fate},
    ledger::Entry,
    rng::FaultRng,
    rule::Rule,
    target::Target,
};
use scenario::{ProcessAction, ProcessFault, Scenario, fault};

#[derive(Debug, Default)]
pub(super) struct Pause {
    /// Robots that it holds, each with its life.
    held: Vec<(u32, u32)>,
}

impl Pause {
    pub(super) fn new(_: &fault::Pause, _: &Scenario) -> Self {
        Self::default()
    }
}

impl Rule for Pause {
    fn begin(
        &mut self,
        tick: Tick,
        target: &Target,
        fates: &mut [Fate],
        process_faults: &mut Vec<ProcessFault>,
        entry: &mut Entry,
    ) {
        for robot in target.robots() {
            let Fate { life, state } = &mut fates[robot as usize];
            match state {
                AgentState::Down => continue,
                AgentState::Paused { holders } => *holders += 1,
                AgentState::Up => {
                    *state = AgentState::Paused { holders: 1 };
                    process_faults.push(ProcessFault { robot, action: ProcessAction::Pause });
                }
            }
            self.held.push((robot, *life));
            entry.did(tick, "robots paused", robot);
        }
    }

    /// Resumes robots that no other fault holds; one that was killed meanwhile is no longer held.
    fn end(
        &mut self,
        _: FaultRng,
        fates: &mut [Fate],
        process_faults: &mut Vec<ProcessFault>,
        entry: &mut Entry,
    ) {
        for &(robot, held_life) in &self.held {
            let Fate { life, state } = &mut fates[robot as usize];
            match state {
                AgentState::Paused { holders } if *life == held_life => {
                    *holders -= 1;
                    if *holders == 0 {
                        *state = AgentState::Up;
                        process_faults.push(ProcessFault { robot, action: ProcessAction::Resume });
                        entry.count("robots resumed");
                    }
                }
                _ => {}
            }
        }
    }
}
