//! Starts the processes of a run, watches them, and leaves nothing behind.
//!
//! The supervisor holds no iceoryx2 service, so what it spawns inherits no descriptor of one. It
//! hears three things on one channel: what the arena reports, which signals arrive, and (by
//! SIGCHLD) that children have ended. Children have process groups of their own, so that Ctrl-C
//! reaches them only through here.

use std::{
    collections::HashMap,
    ffi::OsString,
    io::{BufRead, BufReader, Write},
    os::unix::process::CommandExt,
    path::PathBuf,
    process::{ChildStdin, ChildStdout, Command, Stdio},
    sync::mpsc::{self, Receiver, RecvTimeoutError, Sender},
    thread,
    time::{Duration, Instant},
};

use anyhow::{Context, anyhow, bail};
use arena_daemon::{options::RunOptions, stop::STOP_SIGNALS};
use protocol::{
    control::{Event, Order},
    robot_id::RobotId,
    run_dir::{RunDir, RunName},
};
use rustix::process::{Pid, Signal, WaitOptions, WaitStatus, kill_process, wait};
use signal_hook::{consts::SIGCHLD, iterator::Signals};

use crate::run::Outcome;

/// How long agents get to leave once the run is over; then they are killed.
const LEAVE_TIMEOUT: Duration = Duration::from_secs(3);

/// What the supervisor wakes up to.
enum Happening {
    Signal(i32),
    Arena(Event),
    /// The arena has closed its output: it reports nothing more.
    ArenaSilent,
}

/// Runs the processes of one run to their end.
pub(crate) fn run(
    options: &RunOptions,
    name: &RunName,
    robots: u32,
    by_hand: &[u32],
) -> anyhow::Result<Outcome> {
    let (sender, happenings) = mpsc::channel();
    forward_signals(sender.clone())?;
    let mut supervisor = Supervisor::start(options, name, robots, by_hand, sender)?;
    let outcome = supervisor.watch(&happenings);
    supervisor.clear_away(&happenings);
    outcome
}

struct Supervisor {
    run: RunDir,
    agent_program: PathBuf,
    robots: Vec<u32>,
    arena: Pid,
    orders: ChildStdin,
    /// How the arena ended, once it has.
    arena_ended: Option<String>,
    agents: HashMap<Pid, RobotId>,
    signal: Option<i32>,
    summary: Option<String>,
}

impl Supervisor {
    fn start(
        options: &RunOptions,
        name: &RunName,
        robots: u32,
        by_hand: &[u32],
        sender: Sender<Happening>,
    ) -> anyhow::Result<Self> {
        let agent_program = beside_us("robot-agent")?;
        let mut command = Command::new(beside_us("arena-daemon")?);
        command.args(["--supervised".into(), OsString::from(format!("--name={name}"))]);
        if !by_hand.is_empty() {
            let list: Vec<String> = by_hand.iter().map(u32::to_string).collect();
            command.arg(format!("--by-hand={}", list.join(",")));
        }
        command.args(options.arguments());
        let mut arena = command
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .process_group(0)
            .spawn()
            .context("cannot start arena-daemon")?;
        let orders = arena.stdin.take().expect("standard input is piped");
        forward_events(arena.stdout.take().expect("standard output is piped"), sender);
        Ok(Self {
            run: RunDir::of(name.clone()),
            agent_program,
            robots: (0..robots).filter(|robot| !by_hand.contains(robot)).collect(),
            arena: Pid::from_child(&arena),
            orders,
            arena_ended: None,
            agents: HashMap::new(),
            signal: None,
            summary: None,
        })
    }

    /// Until the arena has ended and said its last word.
    fn watch(&mut self, happenings: &Receiver<Happening>) -> anyhow::Result<Outcome> {
        let mut silent = false;
        while !(silent && self.arena_ended.is_some()) {
            match happenings.recv().context("the threads that watch the run have ended")? {
                Happening::Signal(SIGCHLD) => self.reap(),
                Happening::Signal(signal) => self.stop(signal),
                Happening::Arena(event) => self.obey(event)?,
                Happening::ArenaSilent => silent = true,
            }
        }
        match (self.summary.take(), &self.arena_ended) {
            (Some(summary), _) => Ok(Outcome { summary, signal: self.signal }),
            (None, Some(how)) => bail!("the arena ended without a result ({how})"),
            (None, None) => unreachable!("the loop ends after the arena"),
        }
    }

    fn obey(&mut self, event: Event) -> anyhow::Result<()> {
        match event {
            Event::Ready => {
                for index in std::mem::take(&mut self.robots) {
                    self.spawn(RobotId::first(index))?;
                }
            }
            Event::Start(id) => self.spawn(id)?,
            Event::End(id) => {
                let theirs = self.agents.iter().filter(|(_, agent)| **agent == id);
                theirs.for_each(|(pid, _)| kill(*pid));
            }
            Event::Summary(summary) => self.summary = Some(summary),
            Event::Failed(why) => bail!("{why}"),
        }
        Ok(())
    }

    fn spawn(&mut self, id: RobotId) -> anyhow::Result<()> {
        let child = Command::new(&self.agent_program)
            .args(["--run", &self.run.name().to_string()])
            .args(["--robot", &id.index.to_string()])
            .args(["--incarnation", &id.incarnation.to_string(), "--quiet"])
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .process_group(0)
            .spawn()
            .with_context(|| format!("cannot start the agent of {id}"))?;
        self.agents.insert(Pid::from_child(&child), id);
        Ok(())
    }

    /// The first signal asks the arena to end the run; the second ends everything at once.
    fn stop(&mut self, signal: i32) {
        if self.signal.replace(signal).is_none() {
            tracing::info!("ending the run; once more to end it at once");
            self.order(&Order::Stop);
        } else if self.arena_ended.is_none() {
            kill(self.arena);
        }
    }

    /// Collects every child that has ended.
    fn reap(&mut self) {
        while let Ok(Some((pid, status))) = wait(WaitOptions::NOHANG) {
            let how = described(status);
            if pid == self.arena {
                self.arena_ended = Some(how);
            } else if let Some(id) = self.agents.remove(&pid) {
                self.order(&Order::Lost { id, how });
            }
        }
    }

    /// Tells the arena; one that is gone needs no orders.
    fn order(&mut self, order: &Order) {
        let line = serde_json::to_string(order).expect("orders are plain data");
        let _ = writeln!(self.orders, "{line}");
    }

    /// Waits for every child to end, kills those that stay, and removes the run's files.
    fn clear_away(&mut self, happenings: &Receiver<Happening>) {
        if self.arena_ended.is_none() {
            kill(self.arena);
        }
        let deadline = Instant::now() + LEAVE_TIMEOUT;
        let mut killed = false;
        self.reap();
        while !self.agents.is_empty() || self.arena_ended.is_none() {
            let left = deadline.saturating_duration_since(Instant::now());
            match happenings.recv_timeout(left) {
                Ok(Happening::Signal(SIGCHLD)) => self.reap(),
                // Somebody is impatient, or nobody came: no more waiting.
                Ok(Happening::Signal(_)) | Err(RecvTimeoutError::Timeout) if !killed => {
                    killed = true;
                    self.agents.keys().copied().for_each(kill);
                }
                // Killed children end; only their SIGCHLD may have been missed.
                Err(_) => {
                    thread::sleep(Duration::from_millis(1));
                    self.reap();
                }
                Ok(_) => {}
            }
        }
        if let Err(error) = self.run.remove() {
            tracing::warn!("cannot clean up after the run: {error}; `lamplight clean` may");
        }
    }
}

/// Our own programs lie in one folder.
fn beside_us(program: &str) -> anyhow::Result<PathBuf> {
    let us = std::env::current_exe().context("cannot find our own program")?;
    let path = us.with_file_name(program);
    match path.is_file() {
        true => Ok(path),
        false => Err(anyhow!(
            "{} is missing; build all programs with `cargo build --release --workspace`",
            path.display()
        )),
    }
}

fn forward_signals(sender: Sender<Happening>) -> anyhow::Result<()> {
    let all = STOP_SIGNALS.iter().copied().chain([SIGCHLD]);
    let mut signals = Signals::new(all).context("cannot listen for signals")?;
    thread::spawn(move || signals.forever().try_for_each(|signal| sender.send(Happening::Signal(signal))));
    Ok(())
}

fn forward_events(output: ChildStdout, sender: Sender<Happening>) {
    thread::spawn(move || {
        for line in BufReader::new(output).lines().map_while(Result::ok) {
            match serde_json::from_str(&line) {
                Ok(event) => drop(sender.send(Happening::Arena(event))),
                Err(error) => tracing::warn!("the arena's report `{line}` is not understood: {error}"),
            }
        }
        let _ = sender.send(Happening::ArenaSilent);
    });
}

/// Kills a child that has not been reaped, so its number is still its own.
fn kill(pid: Pid) {
    let _ = kill_process(pid, Signal::KILL);
}

fn described(status: WaitStatus) -> String {
    match (status.exit_status(), status.terminating_signal()) {
        (Some(code), _) => format!("exit status {code}"),
        (None, Some(signal)) => format!("signal {signal}"),
        (None, None) => "for a reason unknown".into(),
    }
}
