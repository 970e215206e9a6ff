//! Starts the processes of a run, watches them, and leaves nothing behind.
//!
//! The supervisor holds no iceoryx2 service, so what it spawns inherits no descriptor of one. It
//! hears three things on one channel: what the arena reports, which signals arrive, and (by
//! SIGCHLD) that children have ended. Children have process groups of their own, so that Ctrl-C and Ctrl-Z
//! reach them only through here ([`Children`]). So do the signals of the fault plan: the arena says which life is
//! meant, and only a child of ours is signalled. What children log comes through one pipe ([`Gatherer`]).

use std::{
    collections::VecDeque,
    io::{self, BufRead, BufReader, Write},
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
use scenario::{ProgramSpec, RobotSet, Scenario};
use signal_hook::{consts::SIGCHLD, iterator::Signals};
use squad::moment::Moment;
use transport::{
    control::{Event, Order},
    run_dir::RunDir,
};

use crate::{
    children::{self, Children, tell, tell_group},
    log::Gatherer,
    outcome::Outcome,
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
        forward_events(arena.stdout.take().expect("standard output is piped"), sender);
        Ok(Self {
            run,
            log,
            children,
            next_trial,
            agent_program,
            scenario,
            to_start: VecDeque::new(),
            robots: (0..scenario.robot_count())
                .filter(|&robot| by_hand.is_none_or(|by_hand| !by_hand.contains(robot)))
                .map(RobotId::first)
                .collect(),
            arena: Pid::from_child(&arena),
            orders: writer_of_orders(arena.stdin.take().expect("standard input is piped")),
            arena_ended: None,
            stopping: None,
            has_result: false,
            summary: None,
            meter: None,
        })
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
            if !self.to_start.is_empty() {
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
                while self.to_start.contains(&id) {
                    self.spawn_next()?;
                }
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

    fn spawn_next(&mut self) -> anyhow::Result<()> {
        let Some(id) = self.to_start.pop_front() else { return Ok(()) };
        let log = match self.scenario.controller_of(id.index).program() {
            Some(_) => self.log.standard_error_of_program(id),
            None => self.log.standard_error(),
        };
        let log = log.context("cannot hand the log's pipe to an agent")?;
        let mut group = self.children.lock();
        let mut command = self.agent_of(id);
        command
            .env(FORMAT_VARIABLE, logging::format().to_string())
            .args(["--run", &self.run.name().to_string()])
            .args(["--robot", &id.index.to_string()])
            .args(["--incarnation", &id.incarnation.to_string(), "--quiet"])
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .stderr(log);
        match children::start(&mut command) {
            Ok(child) => drop(group.agents.insert(Pid::from_child(&child), id)),
            // It could be before: the run has begun, and the arena knows what is to be done about a life lost.
            Err(error) if id.incarnation > 0 => {
                self.order(Order::Lost { id, pid: None, how: error.to_string() });
            }
            Err(error) => return Err(self.cannot_start(id, &command, error)),
        }
        Ok(())
    }

    /// The program of a robot, with the arguments that are its own.
    fn agent_of(&self, id: RobotId) -> Command {
        match self.scenario.controller_of(id.index).program() {
            Some(ProgramSpec { command, .. }) => {
                let mut words = command.iter();
                let mut command = Command::new(words.next().expect("reading has refused an empty command"));
                command.args(words);
                command
            }
            None => Command::new(&self.agent_program),
        }
    }

    fn cannot_start(&self, id: RobotId, command: &Command, error: io::Error) -> anyhow::Error {
        let (controller, program) =
            (self.scenario.controller_of(id.index), command.get_program().display().to_string());
        match controller.program() {
            None => anyhow!(error).context(format!("cannot start the agent of {id}, {program}")),
            Some(_) => {
                let robots = &controller.robots;
                let message = format!("the program {program} of robots {robots} cannot be started: {error}");
                anyhow!(controller.error(
                    message,
                    "name one that this machine can run; a script needs a first line such as `#!/usr/bin/env python3`"
                ))
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
        while !self.children.lock().agents.is_empty() || self.arena_ended.is_none() {
            let left = |deadline: Moment| deadline.since(Moment::now());
            let impatient = match events.recv_timeout(deadline.map_or(REAP_POLL, left)) {
                Ok(SupervisorEvent::Signal(signal)) => signal != SIGCHLD,
                Ok(
                    SupervisorEvent::Arena(_) | SupervisorEvent::ArenaSilent | SupervisorEvent::StoodStill(_),
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
            }
            self.reap();
        }
    }
}

/// Our own programs lie in one folder.
fn beside_us(program: &str) -> anyhow::Result<PathBuf> {
    let us = std::env::current_exe().context("cannot find our own program")?;
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
