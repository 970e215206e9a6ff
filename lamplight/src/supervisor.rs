//! Starts the processes of a run, watches them, and leaves nothing behind.
//!
//! The supervisor holds no iceoryx2 service, so what it spawns inherits no descriptor of one. It
//! hears three things on one channel: what the arena reports, which signals arrive, and (by
//! SIGCHLD) that children have ended. Children have process groups of their own, so that Ctrl-C and Ctrl-Z
//! reach them only through here ([`Children`]). So do the signals of the fault plan: the arena says which life is
//! meant, and only a child of ours is signalled. What children log comes through one pipe ([`Gatherer`]).

use std::{
    collections::{BTreeMap, VecDeque},
    io::{BufRead, BufReader, Write},
    path::{Path, PathBuf},
    process::{ChildStdin, ChildStdout, Command, Stdio},
    sync::mpsc::{self, Receiver, RecvTimeoutError, Sender},
    thread,
    time::Duration,
};

use anyhow::{Context, anyhow, bail};
use engine::summary::Summary;
use logging::FORMAT_VARIABLE;
use observe::{progress::Meter, trial::Record};
use options::{Assignment, Work};
use processes::{
    Process,
    signals::{ONE_WISH, STOP_SIGNALS},
};
use protocol::robot_id::RobotId;
use rustix::process::{Pid, Signal, WaitOptions, WaitStatus, wait};
use scenario::{Controller, Mind, ProgramSpec, RobotSet, Scenario, Speaks};
use signal_hook::{consts::SIGCHLD, iterator::Signals};
use squad::moment::Moment;
use transport::{
    control::{Event, Order},
    run_dir::RunDir,
};

use crate::{
    children::{self, Children, tell, tell_group},
    log::{Gatherer, Whose},
    outcome::Outcome,
    python::{self, ForkServer, Word},
};

/// How long agents get to leave once the run is over; then they are killed.
const LEAVE_TIMEOUT: Duration = Duration::from_secs(3);

/// How long the arena gets to end the run it was told to end, and write its results.
const STOP_TIMEOUT: Duration = Duration::from_secs(10);

/// How often killed children are looked for.
const REAP_POLL: Duration = Duration::from_millis(10);

/// Event that wakes the supervisor.
enum SupervisorEvent {
    Signal(i32),
    /// The whole run has stood still for so long.
    StoodStill(Duration),
    Arena(Event),
    /// The arena has closed its output: it reports nothing more.
    ArenaSilent,
    /// Word of the fork server of a controller, by its place in the scenario.
    ForkServer(usize, Word),
}

/// Where all that happens to a run comes together. Made before the run, so that no signal finds
/// the run made and nobody to take it down.
pub(crate) struct Watch {
    sender: Sender<SupervisorEvent>,
    events: Receiver<SupervisorEvent>,
    children: Children,
}

impl Watch {
    /// From here on signals are ours.
    pub(crate) fn begin() -> anyhow::Result<Self> {
        let (sender, events) = mpsc::channel();
        forward_signals(sender.clone())?;
        let (children, notifier) = (Children::default(), sender.clone());
        children
            .stand_still_with_us(move |time| drop(notifier.send(SupervisorEvent::StoodStill(time))))
            .context("cannot listen for signals")?;
        Ok(Self { sender, events, children })
    }
}

/// Gets the record of a trial that the arena has played, and gives the next scenario for the same agents, or
/// `None` if there is none.
pub(crate) type NextTrial<'a> = Box<dyn FnMut(Record) -> anyhow::Result<Option<String>> + 'a>;

/// Runs the processes of `run`, which is the caller's, to their end: one run, or as many trials as
/// `next_trial` gives.
pub(crate) fn run(
    work: Work,
    run: &RunDir,
    scenario: &Scenario,
    watch: &Watch,
    next_trial: Option<NextTrial<'_>>,
) -> anyhow::Result<Outcome> {
    files::replace(&run.scenario_path(), scenario.to_toml())?;
    let assignment = Assignment::new(work, scenario);
    assignment.write(run)?;
    let Watch { sender, events, children } = watch;
    // Dropped last: then every child has ended, and with them the log.
    let log = Gatherer::begin()?;
    let start = Start { run, scenario, by_hand: assignment.work.by_hand(), log: &log, children };
    let mut supervisor = Supervisor::start(start, sender.clone(), next_trial)?;
    let outcome = supervisor.watch(events);
    supervisor.clear_away(events);
    outcome
}

/// Parts that a supervisor starts from.
#[derive(Clone, Copy)]
struct Start<'a> {
    run: &'a RunDir,
    scenario: &'a Scenario,
    by_hand: Option<&'a RobotSet>,
    log: &'a Gatherer,
    children: &'a Children,
}

struct Supervisor<'a> {
    run: &'a RunDir,
    log: &'a Gatherer,
    children: &'a Children,
    next_trial: Option<NextTrial<'a>>,
    /// The paper's robot.
    agent_program: PathBuf,
    scenario: &'a Scenario,
    /// Interpreters that fork agents in Python, by the place of their controller in the scenario.
    fork_servers: BTreeMap<usize, ForkServer>,
    /// Agents to be started as soon as nothing else is to be done.
    to_start: VecDeque<RobotId>,
    /// Robots that are ours to start at the beginning.
    robots: Vec<RobotId>,
    arena: Pid,
    orders: Sender<Order>,
    /// How the arena ended, once it has.
    arena_ended: Option<String>,
    stopping: Option<Stopping>,
    /// Whether the arena has told what came of a run or a trial.
    has_result: bool,
    summary: Option<Summary>,
    /// Shows what the arena reports of its progress, once it has.
    meter: Option<Meter>,
}

/// The run has been told to end.
#[derive(Clone, Copy)]
struct Stopping {
    signal: i32,
    since: Moment,
    /// Not to be waited for any longer.
    at_once: bool,
}

impl<'a> Supervisor<'a> {
    fn start(
        Start { run, scenario, by_hand, log, children }: Start<'a>,
        sender: Sender<SupervisorEvent>,
        next_trial: Option<NextTrial<'a>>,
    ) -> anyhow::Result<Self> {
        let agent_program = preferred(beside_us("robot-agent")?);
        let mut command = Command::new(beside_us("arena-daemon")?);
        let mut group = children.lock();
        command
            .args(["--supervised".into(), format!("--name={}", run.name())])
            .env(FORMAT_VARIABLE, logging::format().to_string())
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(log.standard_error().context("cannot hand the log's pipe to arena-daemon")?);
        let mut arena = children::start(&mut command).context("cannot start arena-daemon")?;
        group.head = Some(Pid::from_child(&arena));
        drop(group);
        forward_events(arena.stdout.take().expect("standard output is piped"), sender.clone());
        let robots: Vec<RobotId> = (0..scenario.robot_count())
            .filter(|&robot| by_hand.is_none_or(|by_hand| !by_hand.contains(robot)))
            .map(RobotId::first)
            .collect();
        let mut supervisor = Self {
            run,
            log,
            children,
            next_trial,
            agent_program,
            scenario,
            fork_servers: BTreeMap::new(),
            to_start: VecDeque::new(),
            robots,
            arena: Pid::from_child(&arena),
            orders: writer_of_orders(arena.stdin.take().expect("standard input is piped")),
            arena_ended: None,
            stopping: None,
            has_result: false,
            summary: None,
            meter: None,
        };
        supervisor.start_fork_servers(&sender)?;
        Ok(supervisor)
    }

    /// Starts what agents in Python are forked from: while the arena is laid out, it warms up.
    fn start_fork_servers(&mut self, sender: &Sender<SupervisorEvent>) -> anyhow::Result<()> {
        for (place, controller) in self.scenario.controllers.iter().enumerate() {
            let Some(python) = controller.python() else { continue };
            if !self.robots.iter().any(|id| controller.robots.contains(id.index)) {
                continue;
            }
            python::adopt_orphans()?;
            let log = self.log.standard_error_of_program(Whose::Controller(python.name()));
            let log = log.context("cannot hand the log's pipe to a fork server")?;
            let sender = sender.clone();
            let tell = move |word| drop(sender.send(SupervisorEvent::ForkServer(place, word)));
            let server = ForkServer::start(python, log, tell)?;
            self.fork_servers.insert(place, server);
        }
        Ok(())
    }

    /// Handles events until the arena has ended and sent its last message.
    fn watch(&mut self, events: &Receiver<SupervisorEvent>) -> anyhow::Result<Outcome> {
        let mut silent = false;
        while !(silent && self.arena_ended.is_some()) {
            match self.next(events)? {
                SupervisorEvent::Signal(SIGCHLD) => self.reap(),
                SupervisorEvent::Signal(signal) => self.stop(signal),
                SupervisorEvent::StoodStill(time) => {
                    tracing::info!("stood still for {:.1} s; the run goes on", time.as_secs_f64());
                }
                SupervisorEvent::Arena(event) => self.obey(event)?,
                SupervisorEvent::ArenaSilent => silent = true,
                SupervisorEvent::ForkServer(place, word) => self.hear_fork_server(place, word)?,
            }
        }
        let signal = self.stopping.map(|stopping| stopping.signal);
        match &self.arena_ended {
            Some(how) if !self.has_result && !self.stopping.is_some_and(|stopping| stopping.at_once) => {
                bail!("the arena ended without a result ({how})")
            }
            _ => Ok(Outcome { summary: self.summary.take(), signal }),
        }
    }

    /// The next thing to attend to. While there is none, agents are started one by one, so that
    /// signals are heard in between; and an arena that was told to end is not waited for in vain.
    fn next(&mut self, events: &Receiver<SupervisorEvent>) -> anyhow::Result<SupervisorEvent> {
        loop {
            if self.next_to_start().is_some() {
                if let Ok(event) = events.try_recv() {
                    return Ok(event);
                }
                self.spawn_next()?;
            } else if let Some(stopping) = self.stopping {
                let left = STOP_TIMEOUT.saturating_sub(stopping.since.elapsed());
                if left.is_zero() {
                    self.give_up_on_arena();
                } else if let Ok(event) = events.recv_timeout(left) {
                    return Ok(event);
                }
            } else {
                return events.recv().context("the threads that watch the run have ended");
            }
        }
    }

    fn obey(&mut self, event: Event) -> anyhow::Result<()> {
        match event {
            Event::Ready => self.to_start.extend(self.robots.drain(..)),
            // Nobody is started into a run that ends.
            Event::Start(_) if self.stopping.is_some() => {}
            Event::Start(id) => self.to_start.push_back(id),
            Event::End(id) => {
                self.to_start.retain(|queued| *queued != id);
                let mut group = self.children.lock();
                group.paused.remove(&id);
                group.tell_agent(id, Signal::KILL);
            }
            Event::Stop(id) => {
                // Who is to be stopped must be there first.
                while self.to_start.contains(&id) && self.spawn_next()? {}
                let mut group = self.children.lock();
                group.paused.insert(id);
                group.tell_agent(id, Signal::STOP);
            }
            Event::Continue(id) => {
                let mut group = self.children.lock();
                group.paused.remove(&id);
                group.tell_agent(id, Signal::CONT);
            }
            Event::Progress { position, total, text } => {
                self.meter.get_or_insert_with(|| Meter::begin(Some(total), false)).put(position, text);
            }
            Event::Summary(summary) => {
                self.meter = None;
                self.has_result = true;
                let summary = serde_json::from_str(&summary);
                self.summary = Some(summary.context("the arena's summary is not understood")?);
            }
            Event::Record(record) => {
                self.has_result = true;
                let record = serde_json::from_str(&record).context("the arena's record is not understood")?;
                let next = self.next_trial.as_mut().map(|next_trial| next_trial(record)).transpose()?;
                self.order(next.flatten().map_or(Order::Stop, Order::Trial));
            }
            Event::Failed(why) => bail!("{why}"),
        }
        Ok(())
    }

    fn hear_fork_server(&mut self, place: usize, word: Word) -> anyhow::Result<()> {
        let Some(server) = self.fork_servers.get_mut(&place) else { return Ok(()) };
        server.hear(word).map_err(|(message, hint)| {
            let controller = &self.scenario.controllers[place];
            anyhow!(controller.error(format!("of robots {}: {message}", controller.robots), &hint))
        })
    }

    /// The place in the queue of the first agent that can be started now: some wait for their fork server.
    fn next_to_start(&self) -> Option<usize> {
        let can_start = |id: &RobotId| {
            self.fork_server_of(*id).is_none_or(|server| server.is_ready() || self.stopping.is_some())
        };
        self.to_start.iter().position(can_start)
    }

    fn fork_server_of(&self, id: RobotId) -> Option<&ForkServer> {
        let mut controllers = self.scenario.controllers.iter();
        let place = controllers.position(|controller| controller.robots.contains(id.index))?;
        self.fork_servers.get(&place)
    }

    /// Starts the next agent. Returns whether there was one that could be.
    fn spawn_next(&mut self) -> anyhow::Result<bool> {
        let Some(id) = self.next_to_start().and_then(|place| self.to_start.remove(place)) else {
            return Ok(false);
        };
        let words: Vec<String> = [
            "--run".into(),
            self.run.name().to_string(),
            "--robot".into(),
            id.index.to_string(),
            "--incarnation".into(),
            id.incarnation.to_string(),
            "--quiet".into(),
        ]
        .into();
        let mut group = self.children.lock();
        let started = match self.scenario.controller_of(id.index).python() {
            Some(_) => self.fork_agent(id, &words),
            None => self.start_program(id, &words),
        };
        match started {
            Ok(pid) => drop(group.agents.insert(pid, id)),
            // It could be before: the run has begun, and the arena knows what is to be done about a life lost.
            Err(error) if id.incarnation > 0 => {
                self.order(Order::Lost { id, pid: None, how: format!("{error:#}") });
            }
            Err(error) => return Err(self.cannot_start(id, error)),
        }
        Ok(true)
    }

    /// Has an agent in Python forked.
    fn fork_agent(&self, id: RobotId, words: &[String]) -> anyhow::Result<Pid> {
        let server = self.fork_server_of(id).context("its fork server has ended")?;
        let log = self.log.standard_error_of_program(Whose::Robot(id));
        server.fork(words, log.context("cannot hand the log's pipe to an agent")?)
    }

    /// Starts the program of a robot.
    fn start_program(&self, id: RobotId, words: &[String]) -> anyhow::Result<Pid> {
        let mind = &self.scenario.controller_of(id.index).mind;
        let log: Stdio = match mind {
            Mind::Law(_) => self.log.standard_error(),
            Mind::Program(_) | Mind::Python(_) => {
                self.log.standard_error_of_program(Whose::Robot(id)).map(Stdio::from)
            }
        }
        .context("cannot hand the log's pipe to an agent")?;
        let mut command = match mind {
            Mind::Program(ProgramSpec { command: words, speaks, folder, .. }) => {
                let (first, rest) = words.split_first().expect("reading has refused an empty one");
                let mut command = match speaks {
                    Speaks::SharedMemory => Command::new(first),
                    Speaks::JsonLines => Command::new(beside_us("json-lines-agent")?),
                };
                command.args(if *speaks == Speaks::JsonLines { words } else { rest });
                if let Some(folder) = folder {
                    command.current_dir(folder);
                }
                command
            }
            Mind::Law(_) | Mind::Python(_) => Command::new(&self.agent_program),
        };
        command
            .env(FORMAT_VARIABLE, logging::format().to_string())
            .args(words)
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .stderr(log);
        Ok(Pid::from_child(&children::start(&mut command)?))
    }

    fn cannot_start(&self, id: RobotId, error: anyhow::Error) -> anyhow::Error {
        let controller = self.scenario.controller_of(id.index);
        let Controller { robots, mind, .. } = controller;
        match mind {
            Mind::Law(_) => {
                let program = self.agent_program.display();
                error.context(format!("cannot start the agent of {id}, {program}"))
            }
            Mind::Program(program) => {
                let message = format!(
                    "the program {} of robots {robots} cannot be started: {error:#}",
                    program.command[0]
                );
                anyhow!(controller.error(
                    message,
                    "name one that this machine can run; a script needs a first line such as `#!/usr/bin/env python3`"
                ))
            }
            Mind::Python(python) => {
                let message = format!("the agent of {id}, {}, cannot be started: {error:#}", python.name());
                anyhow!(controller.error(message, "what it has printed is above"))
            }
        }
    }

    /// The first signal asks the arena to end the run; a second one, not at the heels of the first,
    /// ends everything at once.
    fn stop(&mut self, signal: i32) {
        match &mut self.stopping {
            None => {
                tracing::info!("ending the run; once more to end it at once");
                self.stopping = Some(Stopping { signal, since: Moment::now(), at_once: false });
                self.to_start.clear();
                self.robots.clear();
                self.order(Order::Stop);
            }
            Some(stopping) if stopping.since.elapsed() < ONE_WISH => {}
            Some(stopping) => {
                stopping.at_once = true;
                self.kill_arena();
            }
        }
    }

    /// The arena was told to end the run and has not: says what it is doing, and kills it.
    fn give_up_on_arena(&mut self) {
        if let Some(stopping) = &mut self.stopping {
            stopping.since = Moment::now();
            stopping.at_once = true;
            let pid = self.arena.as_raw_pid();
            let state = u32::try_from(pid).ok().and_then(Process::find);
            let state = state.map_or("unknown".into(), |arena| arena.state().to_string());
            tracing::warn!(
                "the arena (pid {pid}) has not ended for {STOP_TIMEOUT:?}; state: {state}; it is killed"
            );
            self.kill_arena();
        }
    }

    fn kill_arena(&self) {
        if self.arena_ended.is_none() {
            tell(self.arena, Signal::KILL);
        }
    }

    /// Collects every child that has ended.
    fn reap(&mut self) {
        let mut group = self.children.lock();
        while let Ok(Some((pid, status))) = wait(WaitOptions::NOHANG) {
            let how = described(status);
            if pid == self.arena {
                group.head = None;
                self.arena_ended = Some(how);
            } else if let Some(id) = group.agents.remove(&pid) {
                // What it has started and left behind would live on, with a hand on the log.
                tell_group(pid, Signal::KILL);
                group.paused.remove(&id);
                self.order(Order::Lost { id, pid: Some(pid.as_raw_pid().unsigned_abs()), how });
            } else {
                // A fork server, or somebody's child that has lost its parent.
                self.fork_servers.values_mut().for_each(|server| server.note_end(pid));
            }
        }
    }

    /// Tells the arena; one that is gone needs no orders.
    fn order(&self, order: Order) {
        let _ = self.orders.send(order);
    }

    /// Waits for every child to end, and kills those that stay.
    fn clear_away(&mut self, events: &Receiver<SupervisorEvent>) {
        self.kill_arena();
        self.reap();
        let mut deadline = Some(Moment::now() + LEAVE_TIMEOUT);
        while !self.children.lock().agents.is_empty()
            || self.arena_ended.is_none()
            || self.fork_servers.values().any(|server| server.pid().is_some())
        {
            if self.children.lock().agents.is_empty() {
                // Nobody is to be forked any more.
                self.fork_servers.values().for_each(ForkServer::dismiss);
            }
            let left = |deadline: Moment| deadline.since(Moment::now());
            let impatient = match events.recv_timeout(deadline.map_or(REAP_POLL, left)) {
                Ok(SupervisorEvent::Signal(signal)) => signal != SIGCHLD,
                Ok(
                    SupervisorEvent::Arena(_)
                    | SupervisorEvent::ArenaSilent
                    | SupervisorEvent::StoodStill(_)
                    | SupervisorEvent::ForkServer(..),
                ) => false,
                Err(RecvTimeoutError::Timeout) => deadline.is_none_or(|deadline| left(deadline).is_zero()),
                // The threads that watch have ended; children still do.
                Err(RecvTimeoutError::Disconnected) => {
                    thread::sleep(REAP_POLL);
                    true
                }
            };
            if impatient && deadline.take().is_some() {
                self.children.lock().agents.keys().for_each(|pid| tell_group(*pid, Signal::KILL));
                let servers = self.fork_servers.values().filter_map(ForkServer::pid);
                servers.for_each(|pid| tell_group(pid, Signal::KILL));
            }
            self.reap();
        }
    }
}

/// Our own programs lie in one folder.
fn beside_us(program: &str) -> anyhow::Result<PathBuf> {
    let us = python::own_program()?;
    let path = us.with_file_name(program);
    match path.is_file() {
        true => Ok(path),
        false => Err(anyhow!("{} is missing; build all programs with `scripts/build`", path.display())),
    }
}

/// Of the two agents that `scripts/build` builds, the static one, unless the `plain` one has been built anew since:
/// builds of different sources would not understand each other.
fn preferred(plain: PathBuf) -> PathBuf {
    let lean = plain.with_file_name("static").join("robot-agent");
    let built = |program: &Path| program.metadata().and_then(|file| file.modified());
    match (built(&lean), built(&plain)) {
        (Ok(lean_built), Ok(plain_built)) if lean_built >= plain_built => lean,
        (Ok(_), _) => {
            tracing::info!("{} is out of date and not used; `scripts/build` renews it", lean.display());
            plain
        }
        (Err(_), _) => plain,
    }
}

fn forward_signals(sender: Sender<SupervisorEvent>) -> anyhow::Result<()> {
    let all = STOP_SIGNALS.iter().copied().chain([SIGCHLD]);
    let mut signals = Signals::new(all).context("cannot listen for signals")?;
    thread::spawn(move || {
        signals.forever().try_for_each(|signal| sender.send(SupervisorEvent::Signal(signal)))
    });
    Ok(())
}

fn forward_events(output: ChildStdout, sender: Sender<SupervisorEvent>) {
    thread::spawn(move || {
        for line in BufReader::new(output).lines().map_while(Result::ok) {
            match serde_json::from_str(&line) {
                Ok(event) => drop(sender.send(SupervisorEvent::Arena(event))),
                Err(error) => tracing::warn!("the arena's report `{line}` is not understood: {error}"),
            }
        }
        let _ = sender.send(SupervisorEvent::ArenaSilent);
    });
}

/// Writes orders to the arena. A thread of its own, because a stopped arena does not read.
fn writer_of_orders(mut input: ChildStdin) -> Sender<Order> {
    let (sender, orders) = mpsc::channel::<Order>();
    thread::spawn(move || {
        orders.iter().try_for_each(|order| {
            let line = serde_json::to_string(&order).expect("orders are plain data");
            writeln!(input, "{line}")
        })
    });
    sender
}

fn described(status: WaitStatus) -> String {
    match (status.exit_status(), status.terminating_signal()) {
        (Some(code), _) => format!("exit status {code}"),
        (None, Some(signal)) => format!("signal {signal}"),
        (None, None) => "for a reason unknown".into(),
    }
}

#[cfg(test)]
mod tests {
    use std::{fs, time::SystemTime};

    use super::*;

    #[test]
    fn the_static_agent_is_preferred_until_the_plain_one_is_newer() {
        let folder = tempfile::tempdir().unwrap();
        let plain = folder.path().join("robot-agent");
        let lean = folder.path().join("static/robot-agent");
        let plain_file = fs::File::create(&plain).unwrap();
        assert_eq!(preferred(plain.clone()), plain, "there is no other");
        fs::create_dir(folder.path().join("static")).unwrap();
        let lean_file = fs::File::create(&lean).unwrap();
        let now = SystemTime::now();
        let later = now + Duration::from_secs(1);
        plain_file.set_modified(now).unwrap();
        lean_file.set_modified(later).unwrap();
        assert_eq!(preferred(plain.clone()), lean);
        plain_file.set_modified(later + Duration::from_secs(1)).unwrap();
        assert_eq!(preferred(plain.clone()), plain);
    }
}
