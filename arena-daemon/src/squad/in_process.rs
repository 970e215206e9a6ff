//! The in-process squad: every controller in one plain loop, without a process or a byte of
//! shared memory between them. Bit for bit what lock-step processes compute.

use std::sync::Arc;

use arena::fault::{ProcessAction, ProcessFault};
use protocol::{
    command::Command,
    controller::Controller,
    percept::{Percept, Tick},
    robot_id::RobotId,
};

use super::{Answers, RobotStatus, Squad, SquadError};
use crate::{
    live::{self, Live, SquadStatus},
    stop::StopFlag,
};

/// The controllers of all robots, in this process: any `C`, which `N` makes for each life of a robot.
#[derive(Debug)]
pub struct InProcess<C, N> {
    robots: Vec<Life<C>>,
    new: N,
    live: Option<Arc<Live>>,
}

/// One life of a robot.
#[derive(Debug)]
struct Life<C> {
    id: RobotId,
    /// `None` once it has been killed.
    controller: Option<C>,
    /// It does nothing and keeps its memory.
    paused: bool,
}

impl<C: Controller, N: Fn(RobotId) -> C> InProcess<C, N> {
    /// Makes this many robots, each with a controller of its own by `new`.
    pub fn new(robots: u32, new: N) -> Self {
        let robots = (0..robots).map(RobotId::first).map(|id| Life::new(id, new(id))).collect();
        Self { robots, new, live: None }
    }

    /// The same, with `live` for those who watch.
    #[must_use]
    pub fn watched(self, live: Option<Arc<Live>>) -> Self {
        Self { live, ..self }
    }
}

impl<C: Controller> Life<C> {
    fn new(id: RobotId, controller: C) -> Self {
        Self { id, controller: Some(controller), paused: false }
    }

    fn boot(&mut self) -> Option<Command> {
        self.awake().map(Controller::boot)
    }

    fn step(&mut self, percept: &Percept) -> Option<Command> {
        self.awake().map(|controller| controller.step(percept, &mut ()))
    }

    fn awake(&mut self) -> Option<&mut C> {
        self.controller.as_mut().filter(|_| !self.paused)
    }
}

impl<C: Controller, N: Fn(RobotId) -> C> Squad for InProcess<C, N> {
    fn join_all(&mut self, _stop: &StopFlag) -> Result<Answers, SquadError> {
        Ok(self.robots.iter_mut().map(Life::boot).collect())
    }

    fn apply_process_faults(
        &mut self,
        _: Tick,
        process_faults: &[ProcessFault],
        answers: &mut Answers,
    ) -> Result<(), SquadError> {
        for &ProcessFault { robot, action } in process_faults {
            let (life, answer) = (&mut self.robots[robot as usize], &mut answers[robot as usize]);
            match action {
                ProcessAction::Kill => (life.controller, *answer) = (None, None),
                ProcessAction::Pause => (life.paused, *answer) = (true, None),
                ProcessAction::Resume => life.paused = false,
                ProcessAction::Restart => {
                    let id = life.id.reborn();
                    *life = Life::new(id, (self.new)(id));
                    *answer = life.boot();
                }
            }
        }
        Ok(())
    }

    fn exchange(&mut self, percepts: &[Percept], answers: &mut Answers) -> Result<(), SquadError> {
        for ((life, percept), answer) in self.robots.iter_mut().zip(percepts).zip(answers) {
            *answer = life.step(percept);
        }
        Ok(())
    }

    fn live(&self) -> Option<Arc<Live>> {
        self.live.clone()
    }

    /// Returns the status of all robots; nobody measures them.
    fn status_of_robots(&mut self, _watched: bool) -> SquadStatus {
        let robot = |life: &Life<C>| live::Robot {
            id: life.id,
            pid: None,
            participation: match life {
                Life { controller: None, .. } => live::Participation::Down,
                Life { paused: true, .. } => live::Participation::Paused,
                Life { .. } => live::Participation::Present,
            },
            cycles: None,
            missed_deadlines: 0,
            refused: 0,
        };
        SquadStatus { robots: self.robots.iter().map(robot).collect(), ..SquadStatus::default() }
    }

    fn dismiss(&mut self) {}

    fn robot_statuses(&self) -> Vec<RobotStatus> {
        let standing = |life: &Life<C>| RobotStatus {
            id: life.id,
            pid: None,
            alive: life.controller.is_some(),
            paused: life.controller.is_some() && life.paused,
            refused: 0,
        };
        self.robots.iter().map(standing).collect()
    }
}

#[cfg(test)]
mod tests {
    use coverage::CoverageController;
    use scenario::Scenario;

    use super::*;

    const ROBOTS: u32 = 3;

    fn squad() -> (impl Squad, Answers) {
        let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR"));
        let scenario = Scenario::load(&folder.join("../scenarios/swarmbots.toml"), &[]).unwrap();
        let setup = scenario.coverage_setup(0).unwrap();
        let mut squad = InProcess::new(ROBOTS, move |id| CoverageController::new(id, setup));
        let answers = squad.join_all(&StopFlag::default()).unwrap();
        (squad, answers)
    }

    fn apply_process_faults(
        squad: &mut impl Squad,
        answers: &mut Answers,
        robot: u32,
        action: ProcessAction,
    ) {
        squad.apply_process_faults(0, &[ProcessFault { robot, action }], answers).unwrap();
    }

    fn exchange(squad: &mut impl Squad, answers: &mut Answers, tick: Tick) {
        let percepts = vec![Percept::empty(tick); ROBOTS as usize];
        squad.exchange(&percepts, answers).unwrap();
    }

    fn sequence(answers: &Answers, robot: usize) -> Option<u32> {
        answers[robot].map(|command| command.packet.sequence)
    }

    #[test]
    fn a_killed_robot_is_silent_until_a_new_life_begins() {
        let (mut squad, mut answers) = squad();
        apply_process_faults(&mut squad, &mut answers, 1, ProcessAction::Kill);
        assert_eq!(answers[1], None);
        exchange(&mut squad, &mut answers, 0);
        assert!(answers[0].is_some() && answers[1].is_none());
        for ignored in [ProcessAction::Pause, ProcessAction::Resume] {
            apply_process_faults(&mut squad, &mut answers, 1, ignored);
            assert_eq!(squad.robot_statuses()[1].id, RobotId::first(1));
            assert!(!squad.robot_statuses()[1].alive);
        }
        apply_process_faults(&mut squad, &mut answers, 1, ProcessAction::Restart);
        let born = RobotId { index: 1, incarnation: 1 };
        assert_eq!(answers[1].unwrap().packet.sender, born);
        assert_eq!((squad.robot_statuses()[1].id, squad.robot_statuses()[1].alive), (born, true));
    }

    #[test]
    fn a_paused_robot_is_silent_and_goes_on_with_what_it_knew() {
        let (mut squad, mut answers) = squad();
        exchange(&mut squad, &mut answers, 0);
        let before = sequence(&answers, 2);
        apply_process_faults(&mut squad, &mut answers, 2, ProcessAction::Pause);
        exchange(&mut squad, &mut answers, 1);
        assert_eq!(answers[2], None);
        assert!(squad.robot_statuses()[2].alive && squad.robot_statuses()[2].paused);
        apply_process_faults(&mut squad, &mut answers, 2, ProcessAction::Resume);
        assert_eq!(answers[2], None, "it has not been asked yet");
        exchange(&mut squad, &mut answers, 2);
        assert_eq!(sequence(&answers, 2), before.map(|sequence| sequence + 1));
        assert_eq!(
            (squad.robot_statuses()[2].id, squad.robot_statuses()[2].paused),
            (RobotId::first(2), false)
        );
    }

    #[test]
    fn a_robot_killed_in_its_pause_does_not_go_on() {
        let (mut squad, mut answers) = squad();
        apply_process_faults(&mut squad, &mut answers, 0, ProcessAction::Pause);
        apply_process_faults(&mut squad, &mut answers, 0, ProcessAction::Kill);
        apply_process_faults(&mut squad, &mut answers, 0, ProcessAction::Resume);
        exchange(&mut squad, &mut answers, 0);
        assert_eq!(answers[0], None);
    }
}
