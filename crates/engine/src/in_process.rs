//! The in-process squad: every controller in one plain loop, without a process or a byte of
//! shared memory between them. Bit for bit what lock-step processes compute.

use protocol::{
    command::Command,
    controller::Controller,
    percept::{Percept, Tick},
    robot_id::RobotId,
};
use scenario::{ProcessAction, ProcessFault};
use squad::{Answers, Participation, RobotStatus, Squad, SquadError, WaitingSink, stop::StopFlag};

/// Controllers of robots, in this process: any `C`, which `N` makes for each life of a robot.
#[derive(Debug)]
pub struct InProcess<C, N> {
    robots: Vec<Life<C>>,
    new: N,
}

/// One life of a robot.
#[derive(Debug)]
struct Life<C> {
    id: RobotId,
    /// `None` once it has been killed.
    controller: Option<C>,
    /// It does nothing and keeps its memory.
    paused: bool,
    /// Its answer to the percept that was sent last.
    answer: Option<Command>,
}

impl<C: Controller, N: Fn(RobotId) -> C> InProcess<C, N> {
    /// Makes robots of these numbers, each with a controller of its own by `new`.
    pub fn new(robots: impl IntoIterator<Item = u32>, new: N) -> Self {
        let robots = robots.into_iter().map(RobotId::first).map(|id| Life::new(id, new(id))).collect();
        Self { robots, new }
    }
}

impl<C: Controller> Life<C> {
    fn new(id: RobotId, controller: C) -> Self {
        Self { id, controller: Some(controller), paused: false, answer: None }
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

    fn index(&self) -> usize {
        self.id.index as usize
    }
}

impl<C: Controller, N: Fn(RobotId) -> C> Squad for InProcess<C, N> {
    fn join_all(
        &mut self,
        answers: &mut Answers,
        _: &StopFlag,
        _: &mut WaitingSink<'_>,
    ) -> Result<(), SquadError> {
        for life in &mut self.robots {
            answers[life.index()] = life.boot();
        }
        Ok(())
    }

    fn apply_process_faults(
        &mut self,
        _: Tick,
        process_faults: &[ProcessFault],
        answers: &mut Answers,
        _: &mut WaitingSink<'_>,
    ) -> Result<(), SquadError> {
        for &ProcessFault { robot, action } in process_faults {
            let Some(life) = self.robots.iter_mut().find(|life| life.id.index == robot) else { continue };
            let answer = &mut answers[robot as usize];
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

    fn send(&mut self, percepts: &[Percept]) -> Result<(), SquadError> {
        for life in &mut self.robots {
            life.answer = life.step(&percepts[life.index()]);
        }
        Ok(())
    }

    fn collect(&mut self, answers: &mut Answers, _: &mut WaitingSink<'_>) -> Result<(), SquadError> {
        for life in &self.robots {
            answers[life.index()] = life.answer;
        }
        Ok(())
    }

    fn robot_statuses(&self) -> Vec<RobotStatus> {
        let status = |life: &Life<C>| RobotStatus {
            id: life.id,
            pid: None,
            participation: match life {
                Life { controller: None, .. } => Participation::Down,
                Life { paused: true, .. } => Participation::Paused,
                Life { .. } => Participation::Present,
            },
            refused: 0,
            missed_deadlines: None,
        };
        self.robots.iter().map(status).collect()
    }

    fn dismiss(&mut self) {}
}

#[cfg(test)]
mod tests {
    use coverage::CoverageController;
    use scenario::Scenario;

    use super::*;

    const ROBOTS: u32 = 3;

    type AnswersOfAll = Vec<Option<Command>>;

    fn joined(mut squad: impl Squad) -> (impl Squad, AnswersOfAll) {
        let mut answers = vec![None; ROBOTS as usize];
        squad.join_all(&mut answers, &StopFlag::default(), &mut |_| ()).unwrap();
        (squad, answers)
    }

    fn of(robots: impl IntoIterator<Item = u32>) -> impl Squad {
        let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR"));
        let scenario = Scenario::load(&folder.join("../../scenarios/swarmbots.toml"), &[]).unwrap();
        let setup = scenario.agent_setup(protocol::setup::Mode::Lockstep).controller;
        InProcess::new(robots, move |id| CoverageController::new(id, setup))
    }

    fn squad() -> (impl Squad, AnswersOfAll) {
        joined(of(0..ROBOTS))
    }

    fn apply_process_faults(
        squad: &mut impl Squad,
        answers: &mut AnswersOfAll,
        robot: u32,
        action: ProcessAction,
    ) {
        squad.apply_process_faults(0, &[ProcessFault { robot, action }], answers, &mut |_| ()).unwrap();
    }

    fn exchange(squad: &mut impl Squad, answers: &mut AnswersOfAll, tick: Tick) {
        let percepts = vec![Percept::empty(tick); ROBOTS as usize];
        squad.send(&percepts).unwrap();
        squad.collect(answers, &mut |_| ()).unwrap();
    }

    fn sequence(answers: &[Option<Command>], robot: usize) -> Option<u32> {
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
            assert!(!squad.robot_statuses()[1].is_alive());
        }
        apply_process_faults(&mut squad, &mut answers, 1, ProcessAction::Restart);
        let born = RobotId { index: 1, incarnation: 1 };
        assert_eq!(answers[1].unwrap().packet.sender, born);
        assert_eq!((squad.robot_statuses()[1].id, squad.robot_statuses()[1].is_alive()), (born, true));
    }

    #[test]
    fn a_paused_robot_is_silent_and_goes_on_with_what_it_knew() {
        let (mut squad, mut answers) = squad();
        exchange(&mut squad, &mut answers, 0);
        let before = sequence(&answers, 2);
        apply_process_faults(&mut squad, &mut answers, 2, ProcessAction::Pause);
        exchange(&mut squad, &mut answers, 1);
        assert_eq!(answers[2], None);
        assert!(squad.robot_statuses()[2].is_paused());
        apply_process_faults(&mut squad, &mut answers, 2, ProcessAction::Resume);
        assert_eq!(answers[2], None, "it has not been asked yet");
        exchange(&mut squad, &mut answers, 2);
        assert_eq!(sequence(&answers, 2), before.map(|sequence| sequence + 1));
        assert_eq!(
            (squad.robot_statuses()[2].id, squad.robot_statuses()[2].is_paused()),
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

    #[test]
    fn squads_that_make_up_one_answer_as_one_does() {
        let (mut one, mut wanted) = squad();
        let parts: Vec<Box<dyn Squad>> = vec![Box::new(of([0, 2])), Box::new(of([1]))];
        let (mut both, mut answers) = joined(squad::Composite::new(parts));
        assert_eq!(answers, wanted);
        for action in
            [ProcessAction::Kill, ProcessAction::Restart, ProcessAction::Pause, ProcessAction::Resume]
        {
            for (squad, answers) in [(&mut one as &mut dyn Squad, &mut wanted), (&mut both, &mut answers)] {
                squad
                    .apply_process_faults(0, &[ProcessFault { robot: 1, action }], answers, &mut |_| ())
                    .unwrap();
                squad.send(&vec![Percept::empty(0); ROBOTS as usize]).unwrap();
                squad.collect(answers, &mut |_| ()).unwrap();
            }
            assert_eq!(answers, wanted, "{action:?}");
            assert_eq!(both.robot_statuses(), one.robot_statuses(), "{action:?}");
        }
    }
}
