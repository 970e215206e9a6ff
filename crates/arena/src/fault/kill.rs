//! `kill`: agents die, and perhaps begin a new life without their memory.

use protocol::percept::Tick;

use super::{
    fate::{AgentState, Fate},
    ledger::Entry,
    rng::FaultRng,
    rule::Rule,
    target::{Target, whole},
};
use scenario::{ProcessAction, ProcessFault, Scenario, fault};

/// `which` of the draw by which those who live again are chosen.
const REBORN: u32 = 1;

#[derive(Debug)]
pub(super) struct Kill {
    /// The share that lives again; `None` for all.
    restart_share: Option<f64>,
    /// Robots that it has killed.
    killed: Vec<u32>,
}

impl Kill {
    pub(super) fn new(spec: &fault::Kill, _: &Scenario) -> Self {
        Self { restart_share: spec.restart_share.map(|share| share.get()), killed: Vec::new() }
    }
}

impl Rule for Kill {
    fn begin(
        &mut self,
        tick: Tick,
        target: &Target,
        fates: &mut [Fate],
        process_faults: &mut Vec<ProcessFault>,
        entry: &mut Entry,
    ) {
        for robot in target.robots() {
            let Fate { state, .. } = &mut fates[robot as usize];
            if *state != AgentState::Down {
                *state = AgentState::Down;
                self.killed.push(robot);
                process_faults.push(ProcessFault { robot, action: ProcessAction::Kill });
                entry.did(tick, "robots killed", robot);
            }
        }
    }

    fn end(
        &mut self,
        rng: FaultRng,
        fates: &mut [Fate],
        process_faults: &mut Vec<ProcessFault>,
        entry: &mut Entry,
    ) {
        let count = self.restart_share.map_or(self.killed.len(), |share| whole(share, self.killed.len()));
        let mut drawn: Vec<(f64, u32)> =
            self.killed.iter().map(|&robot| (rng.of_choice(robot, REBORN).unit(), robot)).collect();
        drawn.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        let mut reborn: Vec<u32> = drawn.into_iter().take(count).map(|(_, robot)| robot).collect();
        reborn.sort_unstable();
        for robot in reborn {
            let fate = &mut fates[robot as usize];
            *fate = Fate { life: fate.life + 1, state: AgentState::Up };
            process_faults.push(ProcessFault { robot, action: ProcessAction::Restart });
            entry.count("robots restarted");
        }
    }
}
