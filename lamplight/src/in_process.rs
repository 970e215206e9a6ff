//! The in-process engine: every controller in one plain loop, without a process or a byte of
//! shared memory between them. Bit for bit what lock-step processes compute.

use arena_daemon::{
    squad::{Answers, Squad, SquadError, Standing},
    stop::StopFlag,
};
use coverage::Controller;
use protocol::{percept::Percept, robot_id::RobotId, setup::ControllerSetup};

/// All minds of a run.
#[derive(Debug)]
pub(crate) struct InProcess {
    controllers: Vec<Controller>,
}

impl InProcess {
    pub(crate) fn new(robots: u32, setup: ControllerSetup) -> Self {
        let mind = |index| Controller::new(RobotId::first(index), setup);
        Self { controllers: (0..robots).map(mind).collect() }
    }
}

impl Squad for InProcess {
    fn muster(&mut self, _stop: &StopFlag) -> Result<Answers, SquadError> {
        Ok(self.controllers.iter_mut().map(|mind| Some(mind.boot())).collect())
    }

    fn exchange(&mut self, percepts: &[Percept], answers: &mut Answers) -> Result<(), SquadError> {
        for ((mind, percept), answer) in self.controllers.iter_mut().zip(percepts).zip(answers) {
            *answer = Some(mind.step(percept));
        }
        Ok(())
    }

    fn dismiss(&mut self) {}

    fn standings(&self) -> Vec<Standing> {
        let standing = |index| Standing { id: RobotId::first(index), pid: None, alive: true, refused: 0 };
        (0..self.controllers.len() as u32).map(standing).collect()
    }
}
