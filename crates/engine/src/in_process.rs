//! The in-process squad: every controller in one plain loop, without a process or a byte of
//! shared memory between them. Bit for bit what lock-step processes compute.

use std::{collections::BTreeSet, mem};

use protocol::{
    command::Answer,
    controller::{Controller, Hosted},
    giving_up::{contained, give_up},
    notes::Notes,
    percept::{Percept, Tick},
    property::{Properties, Property},
    robot_id::RobotId,
};
use scenario::{OnHang, ProcessAction, ProcessFault, RobotSet, Scenario};
use squad::{
    Answers, Incident, Participation, RobotStatus, STILLBORN_MAX, Squad, SquadError, WaitingSink,
    stop::StopFlag,
};

/// Controllers of robots, in this process: any `C`, which `N` makes for each life of a robot.
#[derive(Debug)]
pub struct InProcess<C, N> {
    robots: Vec<Life<C>>,
    new: N,
    /// Longest payload that is accepted, bytes.
    payload_bytes_max: usize,
    /// The policy for a robot whose next life cannot begin.
    on_hang: OnHang,
    /// Robots by their controllers.
    controllers: Vec<RobotSet>,
    /// The tick of the percepts that were sent last.
    tick: Option<Tick>,
    incidents: Vec<Incident>,
    /// Words with which controllers have ended and that were shown.
    told: BTreeSet<String>,
    /// Properties of lives that are over.
    stated: Vec<(RobotId, Vec<Property>)>,
}

/// One life of a robot.
#[derive(Debug)]
struct Life<C> {
    id: RobotId,
    /// `None` once it has been killed or left out.
    controller: Option<Hosted<C>>,
    /// It is left out for good: a new life could not begin.
    is_out: bool,
    /// It does nothing and keeps its memory.
    paused: bool,
    /// Its answer to the percept that was sent last.
    answer: Option<Answer>,
    /// The words with which its controller has just ended.
    ended: Option<String>,
    /// Commands that were refused, in all its lives.
    refused: u64,
    /// Its notes for those who watch.
    notes: Notes,
    /// Properties that it states of itself.
    properties: Properties,
}

impl<C: Controller, N: Fn(RobotId) -> Result<C, SquadError>> InProcess<C, N> {
    /// Makes robots of these numbers of `scenario`, each with a controller of its own by `new`. Where that fails, it is a life
    /// that does not begin.
    pub fn new(scenario: &Scenario, robots: impl IntoIterator<Item = u32>, new: N) -> Self {
        let controllers: Vec<RobotSet> =
            scenario.controllers.iter().map(|controller| controller.robots.clone()).collect();
        let life = |index| Life::begin(RobotId::first(index), &new, 0);
        let robots = robots.into_iter().map(life).collect();
        Self {
            robots,
            new,
            payload_bytes_max: scenario.channel.payload_bytes_max.get().into(),
            on_hang: scenario.processes.on_hang,
            controllers,
            tick: None,
            incidents: Vec::new(),
            told: BTreeSet::new(),
            stated: Vec::new(),
        }
    }

    /// Does about the robot at `place`, whose controller has ended as `what` says, what the scenario says.
    fn apply_hang_policy(
        &mut self,
        place: usize,
        tick: Tick,
        what: String,
        why: String,
    ) -> Result<(), SquadError> {
        let (id, refused) = (self.robots[place].id, self.robots[place].refused);
        let consequence = match self.on_hang {
            OnHang::Fail => return Err(SquadError(what)),
            OnHang::Exclude => self.exclusion(tick),
            OnHang::Restart => "it is restarted".into(),
        };
        let what = format!("{what}; {consequence}");
        if self.told.insert(why) {
            tracing::warn!("{what} (others that end so are counted, not shown)");
        }
        self.incidents.push(Incident { robot: id.index, tick, what });
        match self.on_hang {
            OnHang::Restart => self.begin_anew(place, tick),
            OnHang::Exclude | OnHang::Fail => {
                self.replace(place, Life { is_out: true, ..Life::new(id, None, refused) });
                Ok(())
            }
        }
    }

    fn take_answers(&mut self, answers: &mut Answers) {
        for life in &mut self.robots {
            answers[life.index()] = life.answer.take();
        }
    }

    /// Deals with those whose controllers have ended since the last call, in the order of robots.
    fn deal_with_ended(
        &mut self,
        answers: &mut Answers,
        what: impl Fn(RobotId, &str) -> String,
    ) -> Result<(), SquadError> {
        let tick = self.tick.unwrap_or(0);
        for place in 0..self.robots.len() {
            let life = &mut self.robots[place];
            let Some(why) = life.ended.take() else { continue };
            let what = what(life.id, &why);
            self.apply_hang_policy(place, tick, what, why)?;
            let life = &mut self.robots[place];
            answers[life.index()] = life.answer.take();
        }
        self.require_somebody()
    }

    /// From when on a robot is left out that has ended at `tick`: as if the plan had killed it then.
    fn exclusion(&self, tick: Tick) -> String {
        match self.tick {
            None => "it is left out from here on".into(),
            Some(_) => format!("it is left out from tick {} on", tick + 1),
        }
    }

    fn require_somebody(&self) -> Result<(), SquadError> {
        match self.robots.iter().all(|life| life.is_out) && !self.robots.is_empty() {
            true => Err(SquadError("no robot is left".into())),
            false => Ok(()),
        }
    }

    /// Begins a new life of the robot at `place`. If its controller refuses, that is what a process is that does not
    /// join: the scenario says what is done.
    fn begin_anew(&mut self, place: usize, tick: Tick) -> Result<(), SquadError> {
        let attempts = if self.on_hang == OnHang::Restart { STILLBORN_MAX } else { 1 };
        for left in (0..attempts).rev() {
            let (id, refused) = (self.robots[place].id.reborn(), self.robots[place].refused);
            let mut life = Life::begin(id, &self.new, refused);
            life.boot(self.payload_bytes_max);
            let ended = life.ended.take();
            life.is_out = ended.is_some() && left == 0;
            self.replace(place, life);
            let what = match ended {
                None => return Ok(()),
                Some(why) => format!("{id} cannot begin: {why}"),
            };
            if self.on_hang == OnHang::Fail {
                return Err(SquadError(what));
            }
            let consequence = if left == 0 { "left out from here on" } else { "restarted" };
            let what = format!("{what}; it is {consequence}");
            tracing::warn!("{what}");
            self.incidents.push(Incident { robot: id.index, tick, what });
        }
        Ok(())
    }

    /// Puts a life in the place of one that is over, of which what it has stated is kept.
    fn replace(&mut self, place: usize, life: Life<C>) {
        self.stated.extend(self.robots[place].take_stated());
        self.robots[place] = life;
    }
}

impl<C: Controller> Life<C> {
    /// A life whose controller is made by `new`; it has ended if that fails.
    fn begin(id: RobotId, new: impl Fn(RobotId) -> Result<C, SquadError>, refused: u64) -> Self {
        let mut properties = Properties::default();
        match properties.during(None, || new(id)) {
            Ok(controller) => Self { properties, ..Self::new(id, Some(controller), refused) },
            Err(SquadError(why)) => Self { properties, ended: Some(why), ..Self::new(id, None, refused) },
        }
    }

    fn new(id: RobotId, controller: Option<C>, refused: u64) -> Self {
        let controller = controller.map(|controller| Hosted::new(id, controller));
        Self {
            id,
            controller,
            is_out: false,
            paused: false,
            answer: None,
            ended: None,
            refused,
            notes: Notes::default(),
            properties: Properties::default(),
        }
    }

    /// Takes what it has stated, if anything.
    fn take_stated(&mut self) -> Option<(RobotId, Vec<Property>)> {
        let stated = mem::take(&mut self.properties).into_list();
        (!stated.is_empty()).then_some((self.id, stated))
    }

    /// Has it think about the percept of `tick`, or about none, and answer. One that panics or gives up has ended, and nobody
    /// else has.
    fn act(
        &mut self,
        tick: Option<Tick>,
        limit: usize,
        act: impl FnOnce(&mut Hosted<C>, &mut Notes) -> Answer,
    ) {
        let Self { controller, notes, properties, answer, .. } = self;
        *answer = None;
        if let Some(hosted) = controller.as_mut().filter(|_| !self.paused)
            && let Err(why) = contained(|| properties.during(tick, || *answer = Some(act(hosted, notes))))
        {
            (self.controller, self.answer, self.ended) = (None, None, Some(why));
        }
        let refusal = self.answer.as_ref().and_then(|answer| answer.command.check(limit).err());
        if let Some(why) = refusal {
            self.answer = None;
            self.refused += 1;
            if self.refused == 1 {
                tracing::warn!("a command of {} is refused: {why} (more are counted, not shown)", self.id);
            }
        }
    }

    fn boot(&mut self, limit: usize) {
        self.act(None, limit, |hosted, notes| {
            let answer = hosted.boot();
            *notes = Notes::of(&hosted.controller).unwrap_or_else(|error| give_up(error.to_string()));
            answer
        });
    }

    fn step(&mut self, percept: &Percept, limit: usize) {
        self.act(Some(percept.tick), limit, |hosted, notes| {
            let answer = hosted.step(percept, &mut ());
            notes.update(&hosted.controller);
            answer
        });
    }

    fn index(&self) -> usize {
        self.id.index as usize
    }
}

impl<C: Controller, N: Fn(RobotId) -> Result<C, SquadError>> Squad for InProcess<C, N> {
    fn join_all(
        &mut self,
        answers: &mut Answers,
        _: &StopFlag,
        _: &mut WaitingSink<'_>,
    ) -> Result<(), SquadError> {
        self.robots.iter_mut().for_each(|life| life.boot(self.payload_bytes_max));
        self.take_answers(answers);
        self.deal_with_ended(answers, |id, why| {
            format!("the controller of {id} ended before it joined: {why}")
        })?;
        let has_nobody = |robots: &&RobotSet| {
            let mut lives = self.robots.iter().filter(|life| robots.contains(life.id.index)).peekable();
            lives.peek().is_some() && lives.all(|life| life.is_out)
        };
        match self.controllers.iter().find(has_nobody) {
            None => Ok(()),
            Some(robots) => Err(SquadError(format!("of robots {robots} none has joined"))),
        }
    }

    fn apply_process_faults(
        &mut self,
        tick: Tick,
        process_faults: &[ProcessFault],
        answers: &mut Answers,
        _: &mut WaitingSink<'_>,
    ) -> Result<(), SquadError> {
        for &ProcessFault { robot, action } in process_faults {
            let is_struck = |life: &Life<C>| life.id.index == robot && !life.is_out;
            let Some(place) = self.robots.iter().position(is_struck) else { continue };
            let (life, answer) = (&mut self.robots[place], &mut answers[robot as usize]);
            match action {
                ProcessAction::Kill => (life.controller, *answer) = (None, None),
                ProcessAction::Pause => (life.paused, *answer) = (true, None),
                ProcessAction::Resume => life.paused = false,
                ProcessAction::Restart => {
                    self.begin_anew(place, tick)?;
                    *answer = self.robots[place].answer.take();
                }
            }
        }
        self.require_somebody()
    }

    fn left_out(&self) -> Vec<u32> {
        self.robots.iter().filter(|life| life.is_out).map(|life| life.id.index).collect()
    }

    fn take_incidents(&mut self, incidents: &mut Vec<Incident>) {
        incidents.append(&mut self.incidents);
    }

    fn send(&mut self, percepts: &[Percept]) -> Result<(), SquadError> {
        self.tick = percepts.first().map(|percept| percept.tick);
        for life in &mut self.robots {
            life.step(&percepts[life.index()], self.payload_bytes_max);
        }
        Ok(())
    }

    fn collect(&mut self, answers: &mut Answers, _: &mut WaitingSink<'_>) -> Result<(), SquadError> {
        self.take_answers(answers);
        let tick = self.tick.unwrap_or(0);
        self.deal_with_ended(answers, |id, why| format!("{id} died before it answered tick {tick} ({why})"))
    }

    fn notes(&self, robot: u32) -> Option<&Notes> {
        self.robots.iter().find(|life| life.id.index == robot).map(|life| &life.notes)
    }

    fn take_properties(&mut self) -> Vec<(RobotId, Vec<Property>)> {
        let mut stated = mem::take(&mut self.stated);
        stated.extend(self.robots.iter_mut().filter_map(Life::take_stated));
        stated.sort_by_key(|(id, _)| *id);
        stated
    }

    fn robot_statuses(&self) -> Vec<RobotStatus> {
        let status = |life: &Life<C>| RobotStatus {
            id: life.id,
            pid: None,
            participation: match life {
                Life { is_out: true, .. } => Participation::Out,
                Life { controller: None, .. } => Participation::Down,
                Life { paused: true, .. } => Participation::Paused,
                Life { .. } => Participation::Present,
            },
            refused: life.refused,
            missed_deadlines: None,
        };
        self.robots.iter().map(status).collect()
    }

    fn dismiss(&mut self) {}
}

#[cfg(test)]
mod tests {
    use coverage::CoverageController;
    use protocol::{command::Command, controller::StageObserver, payload::Payload};
    use scenario::Scenario;

    use super::*;

    const ROBOTS: u32 = 3;

    type AnswersOfAll = Vec<Option<Answer>>;

    fn joined(mut squad: impl Squad) -> (impl Squad, AnswersOfAll) {
        let mut answers = vec![None; ROBOTS as usize];
        squad.join_all(&mut answers, &StopFlag::default(), &mut |_| ()).unwrap();
        (squad, answers)
    }

    fn of(robots: impl IntoIterator<Item = u32>) -> impl Squad {
        let scenario = scenario(&[]);
        let setup = scenario.coverage_setup(0).unwrap();
        InProcess::new(&scenario, robots, move |id| Ok(CoverageController::new(id, setup)))
    }

    fn scenario(sets: &[&str]) -> Scenario {
        let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR"));
        let sets: Vec<_> = sets.iter().map(|set| set.parse().unwrap()).collect();
        Scenario::load(&folder.join("../../scenarios/swarmbots.toml"), &sets).unwrap()
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

    fn sequence(answers: &[Option<Answer>], robot: usize) -> Option<u32> {
        answers[robot].as_ref().map(|answer| answer.sequence)
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
        assert_eq!(answers[1].as_ref().unwrap().sender, born);
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

    #[test]
    fn a_controller_that_refuses_a_new_life_is_what_a_process_is_that_does_not_join() {
        for (on_hang, lives, is_there) in
            [("fail", None, false), ("exclude", Some(1), false), ("restart", Some(3), true)]
        {
            let scenario = scenario(&[&format!("processes.on_hang={on_hang}")]);
            let new = |id: RobotId| match id.incarnation {
                1 | 2 => Err(SquadError("not now".into())),
                _ => Ok(Talkative(0)),
            };
            let (mut squad, mut answers) = joined(InProcess::new(&scenario, 0..ROBOTS, new));
            let restart = [ProcessFault { robot: 1, action: ProcessAction::Restart }];
            let done = squad.apply_process_faults(7, &restart, &mut answers, &mut |_| ());
            let Some(lives) = lives else {
                assert_eq!(done, Err(SquadError("robot 1 (life 2) cannot begin: not now".into())));
                continue;
            };
            done.unwrap();
            let robot = squad.robot_statuses()[1];
            assert_eq!(
                (robot.id.incarnation, robot.is_alive(), answers[1].is_some()),
                (lives, is_there, is_there)
            );
            assert_eq!(squad.left_out(), if is_there { vec![] } else { vec![1] });
            let mut incidents = Vec::new();
            squad.take_incidents(&mut incidents);
            let consequences = incidents.iter().map(|incident| incident.what.rsplit("; ").next().unwrap());
            let expected =
                if is_there { vec!["it is restarted"; 2] } else { vec!["it is left out from here on"] };
            assert_eq!(consequences.collect::<Vec<_>>(), expected);
            assert_eq!((incidents[0].robot, incidents[0].tick), (1, 7));
        }
    }

    #[test]
    fn a_squad_that_has_nobody_left_ends_the_run() {
        let new = |id: RobotId| match id.incarnation {
            0 => Ok(Talkative(0)),
            _ => Err(SquadError("no".into())),
        };
        let (mut squad, mut answers) = joined(InProcess::new(&scenario(&[]), 0..ROBOTS, new));
        let restart = |robot| ProcessFault { robot, action: ProcessAction::Restart };
        let mut apply = |robots: std::ops::Range<u32>| {
            squad.apply_process_faults(0, &robots.map(restart).collect::<Vec<_>>(), &mut answers, &mut |_| ())
        };
        assert_eq!(apply(1..ROBOTS), Ok(()));
        assert_eq!(apply(0..1), Err(SquadError("no robot is left".into())));
    }

    /// Says more from percept to percept.
    struct Talkative(usize);

    impl Controller for Talkative {
        fn boot(&mut self) -> Command {
            Command::REST
        }

        fn step(&mut self, _: &Percept, _: &mut dyn StageObserver) -> Command {
            self.0 += 1;
            Command { payload: Payload::try_from(&[7; 128][..self.0]).unwrap(), ..Command::REST }
        }

        fn notes(&self, note: &mut dyn FnMut(&str, f64)) {
            note("bytes said", self.0 as f64);
        }
    }

    #[test]
    fn a_command_that_says_more_than_is_allowed_is_refused_and_counted() {
        // The paper's controllers would need more.
        let text = "duration_s = 1\nstep_s = 0.1\narena.size_m = [1, 1]\nrobots.count = 1\n\
                    channel = { range_m = 1, payload_bytes_max = 3 }\ncontroller.program = [\"talkative\"]";
        let scenario = Scenario::parse("test", text, &[]).unwrap();
        let mut squad = InProcess::new(&scenario, 0..1, |_| Ok(Talkative(0)));
        let mut answers = vec![None];
        squad.join_all(&mut answers, &StopFlag::default(), &mut |_| ()).unwrap();
        for tick in 0..5 {
            squad.send(&[Percept::empty(tick)]).unwrap();
            squad.collect(&mut answers, &mut |_| ()).unwrap();
            let said = answers[0].as_ref().map(|answer| answer.command.payload.len());
            assert_eq!(said, Some(tick as usize + 1).filter(|&len| len <= 3));
            let notes = squad.notes(0).unwrap();
            assert_eq!((&notes.names()[0][..], notes.values()), ("bytes said", &[tick as f64 + 1.0][..]));
        }
        assert_eq!(squad.robot_statuses()[0].refused, 2);
    }

    /// Panics at its third percept in its first life if it is robot 1, and gives up in its second.
    struct Fragile(RobotId, u32);

    impl Controller for Fragile {
        fn boot(&mut self) -> Command {
            Command::REST
        }

        fn step(&mut self, _: &Percept, _: &mut dyn StageObserver) -> Command {
            self.1 += 1;
            match (self.0.index, self.0.incarnation, self.1) {
                (1, 0, 3) => panic!("it is dark"),
                (1, 1, 3) => give_up("no light for long"),
                _ => Command::REST,
            }
        }
    }

    #[test]
    fn a_controller_that_ends_costs_its_own_robot_by_the_policy_of_the_scenario() {
        for (on_hang, expected) in [
            ("fail", &[][..]),
            ("exclude", &["(its controller panicked: it is dark); it is left out from tick 3 on"]),
            (
                "restart",
                &[
                    "(its controller panicked: it is dark); it is restarted",
                    "answered tick 5 (no light for long); it is restarted",
                ],
            ),
        ] {
            let scenario = scenario(&[&format!("processes.on_hang={on_hang}")]);
            let new = |id: RobotId| Ok(Fragile(id, 0));
            let (mut squad, mut answers) = joined(InProcess::new(&scenario, 0..ROBOTS, new));
            let mut failure = None;
            for tick in 0..8 {
                squad.send(&vec![Percept::empty(tick); ROBOTS as usize]).unwrap();
                if let Err(error) = squad.collect(&mut answers, &mut |_| ()) {
                    failure = Some((tick, error.to_string()));
                    break;
                }
                assert!(answers[0].is_some() && answers[2].is_some(), "tick {tick}");
                // A new life has given its first command.
                let is_there = tick < 2 || on_hang == "restart";
                assert_eq!(answers[1].is_some(), is_there, "{on_hang} tick {tick}");
            }
            let mut incidents = Vec::new();
            squad.take_incidents(&mut incidents);
            let told: Vec<_> = incidents.iter().map(|incident| &incident.what[..]).collect();
            assert_eq!(told.len(), expected.len(), "{told:?}");
            assert!(told.iter().zip(expected).all(|(what, end)| what.ends_with(end)), "{told:?}");
            let words = "robot 1 died before it answered tick 2 (its controller panicked: it is dark)";
            assert_eq!(failure, (on_hang == "fail").then(|| (2, words.into())));
        }
    }
}
