//! The agents of a run as the arena knows them: which have joined, are silent, or were killed or paused by the plan, and
//! what is done about it. Both process squads stand on this.

use std::{
    collections::{BTreeMap, BTreeSet},
    fs, io,
    ops::RangeInclusive,
    thread,
    time::{Duration, Instant},
};

use processes::{Process, State};
use protocol::{
    codec,
    notes::Notes,
    percept::{Percept, Tick},
    property::Property,
    robot_id::RobotId,
    setup::{AgentSetup, Mode, Plane},
};
use scenario::{Controller, OnHang, ProcessAction, ProcessFault, ProcessesSpec, RobotSet, Scenario};
use squad::{
    Answers, Awaited, Incident, RobotStatus, STILLBORN_MAX, SquadError, WaitingSink, moment::Moment,
    stop::StopFlag,
};
use transport::{
    control::Event,
    doorbell::Doorbell,
    ends::ArenaEnd,
    frame_cache::Frames,
    pid_namespace,
    raw::{BOOT_TICK, CommandError},
    run_dir::{ByHand, RunDir, ToldProperties},
    services::{ArenaPorts, Session, remove_dead_files},
    shared_memory::explained,
};

use crate::{
    by_hand::HandCalls,
    member::{AgentState, Heard, Member},
    profiling::{Measure, Recorder},
    remains::Remains,
    second_core::SecondCore,
    supervisor_link::{Link, Lost},
};

/// Commands read from one agent per look: what its queue holds, and a few that come meanwhile. A
/// flood is read no further than this, and every excess command read is counted as refused.
const READS_MAX: usize = 8;
/// How long the supervisor gets to say how a process has ended that the operating system calls dead: mostly it has said so
/// before. It may be stopped, or the process of another one that stays.
const EXIT_NEWS: Duration = Duration::from_secs(1);
/// How often the arena looks for agents that join.
const JOIN_POLL: Duration = Duration::from_millis(5);
/// How often the arena looks whether an agent has died as it joined.
const LOOK_EVERY: Duration = Duration::from_secs(1);
/// Time between notes about who is missing.
const NOTE_EVERY: Duration = Duration::from_secs(5);

/// Configuration with which the arena hosts agents.
#[derive(Debug)]
pub struct HostConfig {
    /// The run's folder.
    pub run: RunDir,
    /// The line to the supervisor.
    pub link: Link,
    /// Robots that nobody starts for us.
    pub by_hand: Option<RobotSet>,
    /// How the agents are measured, if they are.
    pub measure: Option<Measure>,
}

/// All agents of a run.
#[derive(Debug)]
pub(crate) struct Roster {
    pub(crate) doorbell: Doorbell,
    pub(crate) hang_timeout: Duration,
    pub(crate) recorder: Option<Recorder>,
    /// A core for the recorder's work while percepts are sent.
    second_core: Option<SecondCore>,
    session: Session,
    plane: Plane,
    payload_bytes_max: usize,
    /// Frames of packets that agents are to hear.
    frames: Frames,
    pub(crate) host: HostConfig,
    /// When it was last told who is waited for, if somebody is.
    pub(crate) waiting_told: Option<Instant>,
    processes: ProcessesSpec,
    pub(crate) members: Vec<Member>,
    /// Minds of the robots.
    controllers: Vec<Controller>,
    by_hand: HandCalls,
    /// When it was last looked whether somebody has died as they joined.
    looked: Instant,
    /// Things that go wrong with many robots alike, by their controllers: each is told once.
    told: BTreeSet<(usize, String)>,
    /// Ends of processes that the supervisor has told of, of lives that are not over yet.
    exits: BTreeMap<RobotId, Lost>,
    remains: Remains,
    incidents: Vec<Incident>,
}

impl Roster {
    /// Lays out the run's folder and the services of every robot.
    pub(crate) fn open(scenario: &Scenario, mode: Mode, host: HostConfig) -> Result<Self, SquadError> {
        let failed =
            |what: &str, error: io::Error| SquadError(format!("cannot make {what}: {}", explained(error)));
        let run = &host.run;
        fs::create_dir_all(run.services_path()).map_err(|error| failed("the services' folder", error))?;
        tell_setup(run, scenario, mode)?;
        let session = Session::enter(run).map_err(SquadError::new)?;
        let (robots, plane) = (scenario.robot_count(), scenario.plane(mode));
        let payload_bytes_max = scenario.channel.payload_bytes_max.get().into();
        let members = (0..robots)
            .map(|index| Member::hosted(&session, plane, payload_bytes_max, RobotId::first(index)))
            .collect::<Result<Vec<_>, _>>()?;
        let by_hand = HandCalls::begin(run, driven_by_hand(&members, &host, &scenario.controllers))
            .map_err(|error| failed("the list of robots driven by hand", error))?;
        // The doorbell comes last: an agent that finds it finds everything.
        let doorbell =
            Doorbell::create(&run.doorbell_path()).map_err(|error| failed("the doorbell", error))?;
        Ok(Self {
            doorbell,
            recorder: host.measure.as_ref().map(|measure| Recorder::new(robots as usize, mode, measure)),
            second_core: host.measure.as_ref().and_then(|_| SecondCore::for_robots(robots)),
            hang_timeout: scenario.processes.hang_timeout(),
            session,
            plane,
            payload_bytes_max,
            frames: Frames::of(robots as usize),
            host,
            waiting_told: None,
            processes: scenario.processes.clone(),
            members,
            controllers: scenario.controllers.clone(),
            by_hand,
            looked: Instant::now(),
            told: BTreeSet::new(),
            exits: BTreeMap::new(),
            remains: Remains::default(),
            incidents: Vec::new(),
        })
    }

    /// Lets agents come and waits until all have joined, or `stop` is raised.
    pub(crate) fn join_all(
        &mut self,
        answers: &mut Answers,
        stop: &StopFlag,
        waiting: &mut WaitingSink<'_>,
    ) -> Result<(), SquadError> {
        self.doorbell.expect(self.members.len() as u32);
        self.host.link.tell(&Event::Ready);
        self.await_joining(BOOT_TICK, stop, answers, waiting)?;
        self.require_every_controller()?;
        if let Some(recorder) = &mut self.recorder {
            let processes: Vec<_> = self.members.iter().map(|member| member.process).collect();
            recorder.begin(&processes);
        }
        Ok(())
    }

    /// Fails if no robot of some controller has ever joined, and none is waited for: the scenario's swarm is another one.
    fn require_every_controller(&self) -> Result<(), SquadError> {
        let never_came = |robot: u32| {
            let member = &self.members[robot as usize];
            member.state == AgentState::Out && !member.has_joined
        };
        match self.controllers.iter().find(|controller| controller.robots.iter().all(never_came)) {
            None => Ok(()),
            Some(Controller { robots, origin, .. }) => {
                let place = origin.0.as_ref().map_or(String::new(), |place| format!("{place}: "));
                let program = program_of(&self.controllers, RobotId::first(robots.highest()));
                let what = format!("{place}of robots {robots} none has joined; their program is {program}");
                Err(SquadError(what))
            }
        }
    }

    /// Has everybody begin anew with `scenario`, for as many robots as before: agents forget all they know, and
    /// give their first command again. Everybody must be there in their first life.
    pub(crate) fn begin_anew(&mut self, scenario: &Scenario, mode: Mode) -> Result<(), SquadError> {
        tell_setup(&self.host.run, scenario, mode)?;
        let percepts = vec![Percept::empty(BOOT_TICK); self.members.len()];
        self.send(&percepts, &mut Vec::new())?;
        self.members.iter_mut().for_each(|member| member.state = AgentState::expected());
        self.doorbell.expect(self.members.len() as u32);
        self.doorbell.ring();
        Ok(())
    }

    /// Robots that are expected to join.
    pub(crate) fn expected(&self) -> Vec<usize> {
        (0..self.members.len()).filter(|&index| self.members[index].is_expected()).collect()
    }

    /// Waits until nobody is expected any more, or `stop` is raised.
    pub(crate) fn await_joining(
        &mut self,
        tick: Tick,
        stop: &StopFlag,
        answers: &mut Answers,
        waiting: &mut WaitingSink<'_>,
    ) -> Result<(), SquadError> {
        let (began, all) = (Moment::now(), self.expected().len());
        let mut noted = began;
        loop {
            if !self.welcome(tick, answers)? || stop.is_raised() {
                self.nobody_is_waited_for(waiting);
                return Ok(());
            }
            let missing = self.expected();
            self.wait_for(Awaited::Join, &missing, tick, began, waiting);
            if noted.elapsed() >= NOTE_EVERY {
                noted = Moment::now();
                tracing::info!("waiting for {} of {all} robots to join", missing.len());
            }
            if self.doorbell.wait_for_answers(JOIN_POLL) {
                // The countdown is through, but somebody is missing: look again a little later.
                thread::sleep(JOIN_POLL);
            }
        }
    }

    /// Does to an agent's process what the plan says. Returns whether that changes anything: nothing
    /// can be done to a robot that is left out, or to a dead one but to restart it.
    pub(crate) fn apply_process_faults(
        &mut self,
        process_fault: ProcessFault,
        answers: &mut Answers,
    ) -> Result<bool, SquadError> {
        let index = process_fault.robot as usize;
        let Member { id, state, .. } = self.members[index];
        let becomes = match (process_fault.action, state) {
            (_, AgentState::Out)
            | (ProcessAction::Kill | ProcessAction::Pause | ProcessAction::Resume, AgentState::Down)
            | (ProcessAction::Pause, AgentState::Paused { .. })
            | (ProcessAction::Resume, AgentState::Expected { .. } | AgentState::Present) => return Ok(false),
            (ProcessAction::Kill, _) => {
                self.end(index);
                AgentState::Down
            }
            (ProcessAction::Restart, _) => {
                self.end(index);
                self.begin(index, id.reborn())?
            }
            (ProcessAction::Pause, state) => {
                self.host.link.tell(&Event::Stop(id));
                AgentState::Paused { joined: state == AgentState::Present }
            }
            (ProcessAction::Resume, AgentState::Paused { joined }) => {
                self.host.link.tell(&Event::Continue(id));
                if joined { AgentState::Present } else { AgentState::expected() }
            }
        };
        self.members[index].state = becomes;
        answers[index] = None;
        Ok(true)
    }

    /// Takes in agents that have joined since the last call; their first commands become answers.
    /// Does away with those who will not come. Returns whether somebody may still come.
    pub(crate) fn welcome(&mut self, tick: Tick, answers: &mut Answers) -> Result<bool, SquadError> {
        self.note_exits();
        let looks = self.looked.elapsed() >= LOOK_EVERY;
        if looks {
            self.looked = Instant::now();
        }
        // One look at each: at the end of a tick no cache has them.
        let (mut is_anybody_left, mut is_somebody_expected) = (false, false);
        for (index, answer) in answers.iter_mut().enumerate() {
            let AgentState::Expected { since } = self.members[index].state else {
                is_anybody_left |= self.members[index].state != AgentState::Out;
                continue;
            };
            match self.hear(index, BOOT_TICK..=BOOT_TICK)? {
                Heard::Command(_, command) => {
                    self.joined(index);
                    *answer = Some(command);
                }
                // It is there, and stands still and silent like everybody whose command is refused.
                Heard::Refused => self.joined(index),
                // Asked last: whoever has joined and ended has joined.
                Heard::Nothing => match self.death_in_joining(index, tick, looks) {
                    Some(what) => self.apply_hang_policy(index, tick, what)?,
                    None => self.await_longer(index, since, tick)?,
                },
            }
            is_anybody_left |= self.members[index].state != AgentState::Out;
            is_somebody_expected |= self.members[index].is_expected();
        }
        self.call_by_hand();
        if is_anybody_left {
            return Ok(is_somebody_expected);
        }
        self.require_every_controller()?;
        Err(SquadError("no robot is left".into()))
    }

    fn joined(&mut self, index: usize) {
        let member = &mut self.members[index];
        (member.state, member.has_joined, member.stillborn) = (AgentState::Present, true, 0);
    }

    /// Gives up on an agent that was expected for too long.
    fn await_longer(&mut self, index: usize, since: Moment, tick: Tick) -> Result<(), SquadError> {
        let Some(patience) = self.join_timeout(index).filter(|&patience| since.elapsed() > patience) else {
            return Ok(());
        };
        let id = self.members[index].id;
        let program = program_of(&self.controllers, id);
        let what = format!("{id} has not joined within {patience:?}; its program is {program}");
        self.apply_hang_policy(index, tick, what)
    }

    /// Takes note of processes that have ended. It is for the squad to say when that counts: in lock-step not before
    /// an answer is missing, so that it does not matter when the news comes.
    pub(crate) fn note_exits(&mut self) {
        let lost: Vec<Lost> = self.host.link.lost().collect();
        self.remains.remove_dead(&self.host.run, &lost);
        let Self { members, exits, .. } = self;
        let is_of_now = |lost: &Lost| members.get(lost.id.index as usize).is_some_and(|it| it.id == lost.id);
        exits.extend(lost.into_iter().filter(is_of_now).map(|lost| (lost.id, lost)));
    }

    /// The end of agent `index`'s process, as far as the supervisor has told of it.
    fn exit(&self, index: usize) -> Option<&Lost> {
        let Member { id, process, .. } = &self.members[index];
        let is_over = |lost: &Lost| match process {
            None => true,
            // Another process may have wanted to drive this robot, and been refused; or one around this one has ended,
            // and this one with it.
            Some(process) => Some(process.pid()) == lost.pid || process.state() == State::Dead,
        };
        self.exits.get(id).filter(|lost| is_over(lost))
    }

    /// Whether the process of agent `index` has ended, and how it did is known, or will not be.
    pub(crate) fn is_gone(&mut self, index: usize) -> bool {
        if self.exit(index).is_some() {
            return true;
        }
        let by_hand = self.is_by_hand(index);
        let Member { process, found_dead, .. } = &mut self.members[index];
        let is_dead = process.is_some_and(|process| process.state() == State::Dead);
        is_dead && (by_hand || found_dead.get_or_insert_with(Moment::now).elapsed() > EXIT_NEWS)
    }

    /// Says of agent `index`, whose process has ended without being told to, how it did.
    pub(crate) fn death(&self, index: usize, tick: Tick) -> String {
        let member = &self.members[index];
        let program = program_of(&self.controllers, member.id);
        match (member.state, self.exit(index)) {
            (AgentState::Expected { .. }, Some(Lost { pid: None, how, .. })) => {
                format!("the agent of {}, {program}, cannot be started: {how}", member.id)
            }
            (AgentState::Expected { .. }, exit) => {
                let how = exit.map_or(String::new(), |lost| format!(" ({})", lost.how));
                format!("the agent of {}, {program}, ended before it joined{how}", member.id)
            }
            (_, exit) => {
                let is_ours = self.controllers[self.controller_of(index)].law().is_some();
                let program = (!is_ours).then(|| format!("its program is {program}"));
                let how: Vec<_> = exit.map(|lost| lost.how.clone()).into_iter().chain(program).collect();
                let how = if how.is_empty() { String::new() } else { format!(" ({})", how.join("; ")) };
                format!("{} died before it answered tick {tick}{how}", member.named())
            }
        }
    }

    /// Says how agent `index` has ended that is expected, if it has. Where the supervisor does not tell of it, that takes
    /// a look, which is not taken each time: of those that were started by hand, and those behind another process.
    fn death_in_joining(&mut self, index: usize, tick: Tick, looks: bool) -> Option<String> {
        let Member { id, ports, .. } = &self.members[index];
        // Of its process the arena does not know yet.
        let is_unknown = |ports: &ArenaPorts| self.is_by_hand(index) && ports.has_dead_agent();
        if looks && ports.as_ref().is_some_and(is_unknown) {
            return Some(format!("the agent of {id} died as it joined"));
        }
        let is_gone = self.exit(index).is_some() || looks && self.is_gone(index);
        is_gone.then(|| self.death(index, tick))
    }

    /// Sends a percept to every agent that takes part, and writes their indices over `present`.
    pub(crate) fn send(&mut self, percepts: &[Percept], present: &mut Vec<usize>) -> Result<(), SquadError> {
        present.clear();
        present.extend((0..self.members.len()).filter(|&index| self.is_present(index)));
        let Self { members, frames, recorder, second_core, .. } = self;
        let mut send = || {
            present.iter().try_for_each(|&index| match &mut members[index].ports {
                Some(ports) => ports.send(&percepts[index], frames).map_err(SquadError::new),
                None => Ok(()),
            })
        };
        // The percepts are in the caches now; once the agents are at work, they are not any more.
        let record = |recorder: &mut Recorder| recorder.hand_out(present, percepts);
        match (recorder, second_core) {
            (None, _) => send()?,
            (Some(recorder), None) => {
                record(recorder);
                send()?;
            }
            (Some(recorder), Some(core)) => core.both(
                || {
                    record(recorder);
                    recorder.digest();
                },
                send,
            )?,
        }
        Ok(())
    }

    /// Wakes the agents. While they are at work, what is known of them is worked in, if that has not been done.
    pub(crate) fn ring(&mut self) {
        self.recorder.iter_mut().for_each(Recorder::ring);
        self.doorbell.ring();
        self.recorder.iter_mut().for_each(Recorder::digest);
    }

    /// Reads what agent `index` has sent: the latest command that answers one of the `awaited`
    /// ticks. Whatever else is there is refused and counted.
    pub(crate) fn hear(&mut self, index: usize, awaited: RangeInclusive<Tick>) -> Result<Heard, SquadError> {
        let member = &mut self.members[index];
        let Some(ports) = &mut member.ports else { return Ok(Heard::Nothing) };
        let (mut heard, mut refusals) = (Heard::Nothing, Vec::new());
        for _ in 0..READS_MAX {
            let Some(received) = ports.receive().map_err(SquadError::new)? else { break };
            let raw = received.command;
            let in_time = awaited.contains(&raw.tick);
            let expected = if in_time { raw.tick } else { *awaited.end() };
            let checked = received.check(member.id, expected, &mut self.frames);
            let is_its_own = !matches!(checked, Err(CommandError::Tick { .. } | CommandError::Sender { .. }));
            if is_its_own {
                member.process = member.process.or_else(|| Process::find(raw.pid));
                if raw.tick == BOOT_TICK && raw.notes_len > 0 {
                    member.notes = note_names(&self.host.run, member.id);
                }
            }
            match (checked, &heard) {
                (Ok(_), Heard::Command(newest, _)) if raw.tick <= *newest => {
                    refusals.push(format!("it has answered tick {newest} already"));
                }
                (Ok(answer), _) => {
                    if !received.notes.is_empty() {
                        member.notes.set(received.notes);
                    }
                    if let Some(recorder) = &mut self.recorder {
                        recorder.note(index, raw.tick, &answer.header(), &raw.times);
                        recorder.missed(index, raw.missed);
                    }
                    heard = Heard::Command(raw.tick, answer);
                }
                (Err(error), before) => {
                    refusals.push(error.to_string());
                    if is_its_own && *before == Heard::Nothing {
                        heard = Heard::Refused;
                    }
                }
            }
        }
        for why in refusals {
            self.refuse(index, why);
        }
        Ok(heard)
    }

    /// Counts a refused command of agent `index`; shows the first of a robot, and one of many that are alike.
    fn refuse(&mut self, index: usize, why: String) {
        let controller = self.controller_of(index);
        let member = &mut self.members[index];
        member.refused += 1;
        if member.refused == 1 && self.told.insert((controller, why.clone())) {
            let named = member.named();
            tracing::warn!(
                "a command of {named} is refused: {why} (more of its program are counted, not shown)"
            );
        }
    }

    /// Says of agent `index`, which has not answered for too long, what it is doing.
    pub(crate) fn hanging(&self, index: usize, tick: Tick) -> String {
        let member = &self.members[index];
        let state = member.process.map_or("unknown".into(), |process| process.state().to_string());
        let (named, patience) = (member.named(), self.hang_timeout);
        format!("{named} has not answered tick {tick} for {patience:?}; state: {state}")
    }

    /// Ends the run for every agent. They are measured as long as they are there.
    pub(crate) fn dismiss(&mut self) {
        let processes = self.members.iter().map(|member| member.process);
        let profile = self.recorder.as_mut().and_then(|recorder| recorder.finish(processes));
        if let (Some(profile), Some(measure)) = (profile, &self.host.measure) {
            // A squad is dismissed once.
            let _ = measure.profile.set(profile);
        }
        self.doorbell.close();
        for member in &mut self.members {
            member.ports = None;
            if let AgentState::Paused { .. } = member.state {
                // Who is stopped does not see the end.
                self.host.link.tell(&Event::Continue(member.id));
            }
        }
        self.remains.clear();
    }

    /// Whether robot `index` exists and takes part.
    pub(crate) fn is_present(&self, index: usize) -> bool {
        self.members.get(index).is_some_and(|member| member.state == AgentState::Present)
    }

    /// The life of robot `index` that has joined, if one has and is not over.
    pub(crate) fn life(&self, index: usize) -> Option<RobotId> {
        let member = &self.members[index];
        let joined = matches!(member.state, AgentState::Present | AgentState::Paused { joined: true });
        joined.then_some(member.id)
    }

    pub(crate) fn left_out(&self) -> Vec<u32> {
        let out = (0..).zip(&self.members).filter(|(_, member)| member.state == AgentState::Out);
        out.map(|(index, _)| index).collect()
    }

    pub(crate) fn robot_statuses(&self) -> Vec<RobotStatus> {
        let recorder = self.recorder.as_ref();
        let status = |(index, member): (usize, &Member)| RobotStatus {
            id: member.id,
            pid: member.process.map(|process| process.pid()),
            participation: member.state.into(),
            refused: member.refused,
            missed_deadlines: recorder.map(|recorder| recorder.missed_deadlines(index)),
        };
        self.members.iter().enumerate().map(status).collect()
    }

    pub(crate) fn notes(&self, robot: u32) -> Option<&Notes> {
        self.members.get(robot as usize).map(|member| &member.notes)
    }

    /// Properties that all lives have told so far; those that are not understood are said and left out.
    pub(crate) fn take_properties(&mut self) -> Vec<(RobotId, Vec<Property>)> {
        let told = self.host.run.take_properties().unwrap_or_else(|error| {
            tracing::warn!("what controllers have stated cannot be read: {error}");
            Vec::new()
        });
        let understood = |(id, properties): (RobotId, ToldProperties)| match properties {
            Ok(properties) => Some((id, properties)),
            Err(why) => {
                tracing::warn!("what the controller of {id} has stated is not understood: {why}");
                None
            }
        };
        told.into_iter().filter_map(understood).collect()
    }

    /// Sorted by tick and robot: which is seen first is chance.
    pub(crate) fn take_incidents(&mut self, incidents: &mut Vec<Incident>) {
        self.incidents.sort_by_key(|incident| (incident.tick, incident.robot));
        incidents.append(&mut self.incidents);
    }

    /// Does about agent `index`, which has come to grief, what the scenario says.
    pub(crate) fn apply_hang_policy(
        &mut self,
        index: usize,
        tick: Tick,
        what: String,
    ) -> Result<(), SquadError> {
        let id = self.members[index].id;
        let (by_hand, next) = (self.is_by_hand(index), id.reborn());
        let member = &mut self.members[index];
        if matches!(member.state, AgentState::Expected { .. } | AgentState::Paused { joined: false }) {
            member.stillborn += 1;
        }
        let policy = match (self.processes.on_hang, member.stillborn) {
            (OnHang::Restart, STILLBORN_MAX..) if !by_hand => OnHang::Exclude,
            (policy, _) => policy,
        };
        let consequence = match policy {
            OnHang::Fail => "the run fails".into(),
            OnHang::Exclude if policy != self.processes.on_hang => {
                format!("it is left out from here on: none of {STILLBORN_MAX} lives in a row has joined")
            }
            // As if the plan had killed it then.
            OnHang::Exclude if member.state == AgentState::Present => {
                format!("it is left out from tick {} on", tick + 1)
            }
            OnHang::Exclude => "it is left out from here on".into(),
            OnHang::Restart if by_hand => {
                format!(
                    "its next life is started by hand: {}",
                    self.host.agent_command(&self.controllers, next)
                )
            }
            OnHang::Restart => "it is restarted".into(),
        };
        let (reason, what) = (what.clone(), format!("{what}; {consequence}"));
        match self.members[index].stillborn {
            // The run's error will say it.
            _ if policy == OnHang::Fail => {}
            0 => tracing::warn!("{what}"),
            // A program that does not join mostly does so for all its robots: one line says it.
            _ if self.told.insert((self.controller_of(index), consequence)) => {
                tracing::warn!("{what} (more of its program are counted, not shown)");
            }
            _ => tracing::debug!("{what}"),
        }
        // What happens before the first tick belongs to tick 0.
        let tick = if tick == BOOT_TICK { 0 } else { tick };
        self.incidents.push(Incident { robot: id.index, tick, what });
        self.end(index);
        self.members[index].state = match policy {
            OnHang::Restart => self.begin(index, next)?,
            OnHang::Exclude | OnHang::Fail => AgentState::Out,
        };
        if policy == OnHang::Fail { Err(SquadError(reason)) } else { Ok(()) }
    }

    /// Ends the present life of robot `index`, if it has not ended yet.
    fn end(&mut self, index: usize) {
        let (by_hand, is_dead) = (self.is_by_hand(index), self.exit(index).is_some());
        let member = &mut self.members[index];
        let (id, process) = (member.id, member.process.take());
        self.exits.remove(&id);
        let Some(ports) = member.ports.take() else { return };
        self.host.link.tell(&Event::End(id));
        match by_hand {
            // Nobody ends its process for us: it leaves when it sees that its life is over, or is dead already.
            true => {
                if let Err(error) = self.host.run.end_life(id) {
                    tracing::warn!("{id} cannot be told that it is left out: {error}");
                }
                remove_dead_files(&self.host.run, vec![ports]);
            }
            false if is_dead => remove_dead_files(&self.host.run, vec![ports]),
            false => self.remains.keep(id, process, ports),
        }
    }

    /// Makes place for life `id` of robot `index`, and has it started if somebody does that for us.
    fn begin(&mut self, index: usize, id: RobotId) -> Result<AgentState, SquadError> {
        self.recorder.iter_mut().for_each(|recorder| recorder.reborn(index));
        let Member { refused, has_joined, stillborn, .. } = self.members[index];
        self.members[index] = Member {
            refused,
            has_joined,
            stillborn,
            ..Member::hosted(&self.session, self.plane, self.payload_bytes_max, id)?
        };
        if !self.is_by_hand(index) {
            self.host.link.tell(&Event::Start(id));
        }
        Ok(self.members[index].state)
    }

    /// How long robot `index` is waited for; `None` for without limit.
    fn join_timeout(&self, index: usize) -> Option<Duration> {
        match self.is_by_hand(index) {
            true => hand_patience(&self.processes),
            false => self.processes.join_timeout(false),
        }
    }

    /// Which of the controllers a robot has.
    fn controller_of(&self, index: usize) -> usize {
        let mut controllers = self.controllers.iter();
        controllers.position(|it| it.robots.contains(index as u32)).expect("every robot has a controller")
    }

    fn is_by_hand(&self, index: usize) -> bool {
        self.host.is_by_hand(index as u32)
    }

    /// Calls for robots that wait to be started by hand, anew as soon as it is others.
    fn call_by_hand(&mut self) {
        let Self { members, host, controllers, processes, by_hand, .. } = self;
        if by_hand.robots().is_empty() {
            return;
        }
        let is_as_known = |robot: &ByHand| {
            let member = &members[robot.id.index as usize];
            (member.id, member.is_expected()) == (robot.id, robot.is_awaited)
        };
        if !by_hand.robots().iter().all(is_as_known) {
            by_hand.change(&host.run, driven_by_hand(members, host, controllers));
        }
        by_hand.call(&host.run, hand_patience(processes));
    }
}

impl HostConfig {
    /// Whether robot `index` is started by hand: without a supervisor everybody is.
    fn is_by_hand(&self, index: u32) -> bool {
        !self.link.is_supervised() || self.by_hand.as_ref().is_some_and(|robots| robots.contains(index))
    }

    /// The command that starts this life of a robot by hand.
    fn agent_command(&self, controllers: &[Controller], id: RobotId) -> String {
        self.run.name().agent_command(&program_of(controllers, id), id)
    }
}

/// The program that thinks for a robot, with its first arguments, as a shell takes them.
fn program_of(controllers: &[Controller], id: RobotId) -> String {
    let mut theirs = controllers.iter().filter(|controller| controller.robots.contains(id.index));
    let words = theirs.next().map_or(Vec::new(), Controller::agent_words);
    shlex::try_join(words.iter().map(String::as_str)).unwrap_or_else(|_| words.join(" "))
}

/// The robots that are driven by hand, and whether they wait to be.
fn driven_by_hand(members: &[Member], host: &HostConfig, controllers: &[Controller]) -> Vec<ByHand> {
    let theirs = members.iter().filter(|member| host.is_by_hand(member.id.index));
    let by_hand = |member: &Member| ByHand {
        id: member.id,
        is_awaited: member.is_expected(),
        program: program_of(controllers, member.id),
    };
    theirs.map(by_hand).collect()
}

/// How long robots are waited for that are started by hand; `None` for without limit.
fn hand_patience(processes: &ProcessesSpec) -> Option<Duration> {
    match processes.on_hang {
        // To be started anew is what they wait for.
        OnHang::Restart => None,
        OnHang::Exclude | OnHang::Fail => processes.join_timeout(true),
    }
}

/// Names of the notes of a life that has just told them; without any, its notes are not shown.
fn note_names(run: &RunDir, id: RobotId) -> Notes {
    let told = run.note_names(id).map_err(|error| error.to_string());
    told.and_then(|names| Notes::named(names).map_err(|error| error.to_string())).unwrap_or_else(|error| {
        tracing::warn!("the notes of {id} cannot be shown: {error}");
        Notes::default()
    })
}

/// Writes what every agent of the run is told.
fn tell_setup(run: &RunDir, scenario: &Scenario, mode: Mode) -> Result<(), SquadError> {
    let setup = |controller: &Controller| {
        let setup = scenario.agent_setup(mode, controller);
        codec::encode(&AgentSetup { pid_namespace: pid_namespace::ours(), ..setup })
    };
    let (first, others) = scenario.controllers.split_first().expect("every robot has a controller");
    let others: Vec<_> = others.iter().map(|it| (it.robots.iter().collect(), setup(it))).collect();
    run.tell_setups(&setup(first), &others)
        .map_err(|error| SquadError(format!("cannot make the agents' setup: {}", explained(error))))
}
