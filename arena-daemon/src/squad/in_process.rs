//! The in-process squad: every controller in one plain loop, without a process or a byte of
//! shared memory between them. Bit for bit what lock-step processes compute.

use std::sync::Arc;

use arena::fault::{Act, Strike};
use coverage::Controller;
use protocol::{
    command::Command,
    percept::{Percept, Tick},
    robot_id::RobotId,
    setup::ControllerSetup,
};

use super::{Answers, Squad, SquadError, Standing};
use crate::{
    live::{self, Live, Survey},
    stop::StopFlag,
};

/// All minds of a run.
#[derive(Debug)]
pub struct InProcess {
    minds: Vec<Mind>,
    setup: ControllerSetup,
    live: Option<Arc<Live>>,
}

/// One life of a robot.
#[derive(Debug)]
struct Mind {
    id: RobotId,
    /// `None` once it has been killed.
    controller: Option<Controller>,
    /// It does nothing and keeps its memory.
    paused: bool,
}

impl InProcess {
    /// The minds of so many robots, all with the same parameters.
    pub fn new(robots: u32, setup: ControllerSetup) -> Self {
        let minds = (0..robots).map(|index| Mind::new(RobotId::first(index), setup)).collect();
        Self { minds, setup, live: None }
    }

    /// The same, watched by whom `live` is handed out to.
    #[must_use]
    pub fn watched(self, live: Option<Arc<Live>>) -> Self {
        Self { live, ..self }
    }
}

impl Mind {
    fn new(id: RobotId, setup: ControllerSetup) -> Self {
        Self { id, controller: Some(Controller::new(id, setup)), paused: false }
    }

    fn boot(&mut self) -> Option<Command> {
        self.awake().map(Controller::boot)
    }

    fn step(&mut self, percept: &Percept) -> Option<Command> {
        self.awake().map(|controller| controller.step(percept))
    }

    fn awake(&mut self) -> Option<&mut Controller> {
        self.controller.as_mut().filter(|_| !self.paused)
    }
}

impl Squad for InProcess {
    fn muster(&mut self, _stop: &StopFlag) -> Result<Answers, SquadError> {
        Ok(self.minds.iter_mut().map(Mind::boot).collect())
    }

    fn strike(&mut self, _: Tick, strikes: &[Strike], answers: &mut Answers) -> Result<(), SquadError> {
        for &Strike { robot, act } in strikes {
            let (mind, answer) = (&mut self.minds[robot as usize], &mut answers[robot as usize]);
            match act {
                Act::Kill => (mind.controller, *answer) = (None, None),
                Act::Pause => (mind.paused, *answer) = (true, None),
                Act::Resume => mind.paused = false,
                Act::Restart => {
                    *mind = Mind::new(mind.id.reborn(), self.setup);
                    *answer = mind.boot();
                }
            }
        }
        Ok(())
    }

    fn exchange(&mut self, percepts: &[Percept], answers: &mut Answers) -> Result<(), SquadError> {
        for ((mind, percept), answer) in self.minds.iter_mut().zip(percepts).zip(answers) {
            *answer = mind.step(percept);
        }
        Ok(())
    }

    fn live(&self) -> Option<Arc<Live>> {
        self.live.clone()
    }

    /// Nobody measures them.
    fn survey(&mut self, _watched: bool) -> Survey {
        let robot = |mind: &Mind| live::Robot {
            id: mind.id,
            pid: None,
            standing: match mind {
                Mind { controller: None, .. } => live::Standing::Down,
                Mind { paused: true, .. } => live::Standing::Paused,
                Mind { .. } => live::Standing::Present,
            },
            cycles: None,
            missed_deadlines: 0,
            refused: 0,
        };
        Survey { robots: self.minds.iter().map(robot).collect(), ..Survey::default() }
    }

    fn dismiss(&mut self) {}

    fn standings(&self) -> Vec<Standing> {
        let standing = |mind: &Mind| Standing {
            id: mind.id,
            pid: None,
            alive: mind.controller.is_some(),
            paused: mind.controller.is_some() && mind.paused,
            refused: 0,
        };
        self.minds.iter().map(standing).collect()
    }
}

#[cfg(test)]
mod tests {
    use scenario::Scenario;

    use super::*;

    const ROBOTS: u32 = 3;

    fn squad() -> (InProcess, Answers) {
        let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR"));
        let scenario = Scenario::load(&folder.join("../scenarios/swarmbots.toml"), &[]).unwrap();
        let setup = scenario.agent_setup(protocol::setup::Mode::Lockstep).controller;
        let mut squad = InProcess::new(ROBOTS, setup);
        let answers = squad.muster(&StopFlag::default()).unwrap();
        (squad, answers)
    }

    fn strike(squad: &mut InProcess, answers: &mut Answers, robot: u32, act: Act) {
        squad.strike(0, &[Strike { robot, act }], answers).unwrap();
    }

    fn exchange(squad: &mut InProcess, answers: &mut Answers, tick: Tick) {
        let percepts = vec![Percept::empty(tick); ROBOTS as usize];
        squad.exchange(&percepts, answers).unwrap();
    }

    fn sequence(answers: &Answers, robot: usize) -> Option<u32> {
        answers[robot].map(|command| command.packet.sequence)
    }

    #[test]
    fn a_killed_robot_is_silent_until_a_new_life_begins() {
        let (mut squad, mut answers) = squad();
        strike(&mut squad, &mut answers, 1, Act::Kill);
        assert_eq!(answers[1], None);
        exchange(&mut squad, &mut answers, 0);
        assert!(answers[0].is_some() && answers[1].is_none());
        for ignored in [Act::Pause, Act::Resume] {
            strike(&mut squad, &mut answers, 1, ignored);
            assert_eq!(squad.standings()[1].id, RobotId::first(1));
            assert!(!squad.standings()[1].alive);
        }
        strike(&mut squad, &mut answers, 1, Act::Restart);
        let born = RobotId { index: 1, incarnation: 1 };
        assert_eq!(answers[1].unwrap().packet.sender, born);
        assert_eq!((squad.standings()[1].id, squad.standings()[1].alive), (born, true));
    }

    #[test]
    fn a_paused_robot_is_silent_and_goes_on_with_what_it_knew() {
        let (mut squad, mut answers) = squad();
        exchange(&mut squad, &mut answers, 0);
        let before = sequence(&answers, 2);
        strike(&mut squad, &mut answers, 2, Act::Pause);
        exchange(&mut squad, &mut answers, 1);
        assert_eq!(answers[2], None);
        assert!(squad.standings()[2].alive && squad.standings()[2].paused);
        strike(&mut squad, &mut answers, 2, Act::Resume);
        assert_eq!(answers[2], None, "it has not been asked yet");
        exchange(&mut squad, &mut answers, 2);
        assert_eq!(sequence(&answers, 2), before.map(|sequence| sequence + 1));
        assert_eq!((squad.standings()[2].id, squad.standings()[2].paused), (RobotId::first(2), false));
    }

    #[test]
    fn a_robot_killed_in_its_pause_does_not_go_on() {
        let (mut squad, mut answers) = squad();
        strike(&mut squad, &mut answers, 0, Act::Pause);
        strike(&mut squad, &mut answers, 0, Act::Kill);
        strike(&mut squad, &mut answers, 0, Act::Resume);
        exchange(&mut squad, &mut answers, 0);
        assert_eq!(answers[0], None);
    }
}
