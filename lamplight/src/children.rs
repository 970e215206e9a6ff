//! The processes that a supervisor has started, and how they stand still with it.

use std::{
    collections::{HashMap, HashSet},
    io,
    os::unix::process::CommandExt,
    process::{Child, Command},
    sync::{Arc, Mutex, MutexGuard, PoisonError},
    thread,
    time::{Duration, Instant},
};

use processes::{Process, State, signals};
use protocol::robot_id::RobotId;
use rustix::process::{Pid, Signal, kill_process, kill_process_group};

/// How long the head gets to stop itself; then it is stopped.
const HEAD_TIMEOUT: Duration = Duration::from_secs(3);
/// How often it is looked at meanwhile.
const HEAD_POLL: Duration = Duration::from_millis(1);

/// The children of this process. Who starts, signals or reaps one holds the lock, so that none is missed by Ctrl-Z,
/// and no number is signaled that is no longer its child's.
#[derive(Clone, Debug, Default)]
pub(crate) struct Children(Arc<Mutex<Group>>);

/// Processes that run and stand still together.
#[derive(Debug, Default)]
pub(crate) struct Group {
    /// The process that calls upon the others, an arena or a whole run; it stops itself when it is asked to.
    pub(crate) head: Option<Pid>,
    /// Agents.
    pub(crate) agents: HashMap<Pid, RobotId>,
    /// Lives that the fault plan has paused.
    pub(crate) paused: HashSet<RobotId>,
}

impl Children {
    pub(crate) fn lock(&self) -> MutexGuard<'_, Group> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// From here on Ctrl-Z stops the children and then this process, and `fg` lets all go on. Then `tell` is told how
    /// long that was; it must not write to a terminal, which may want to stop us again for that.
    pub(crate) fn stand_still_with_us(
        &self,
        mut tell: impl FnMut(Duration) + Send + 'static,
    ) -> io::Result<()> {
        let children = self.clone();
        signals::stand_still_on_terminal_stop(move |stop_this_process| {
            let began = Instant::now();
            children.lock().stand_still(stop_this_process);
            tell(began.elapsed());
        })
    }
}

impl Group {
    /// Signals the process of one life, if it is our child. Nobody else's word counts for which process that is.
    pub(crate) fn tell_agent(&self, id: RobotId, signal: Signal) {
        let theirs = self.agents.iter().filter(|(_, agent)| **agent == id);
        theirs.for_each(|(pid, _)| tell_group(*pid, signal));
    }

    /// Stops first whoever waits for others, and lets go on first whoever is waited for. Who has been stopped by
    /// somebody else stays so.
    fn stand_still(&self, stop_this_process: fn()) {
        let head = self.head.filter(|&pid| is_at_work(pid));
        head.into_iter().for_each(stop_head);
        let goes_on = |&(&pid, id): &(&Pid, &RobotId)| !self.paused.contains(id) && is_at_work(pid);
        let agents: Vec<Pid> = self.agents.iter().filter(goes_on).map(|(pid, _)| *pid).collect();
        agents.iter().for_each(|pid| tell_group(*pid, Signal::STOP));
        stop_this_process();
        agents.iter().for_each(|pid| tell_group(*pid, Signal::CONT));
        head.into_iter().for_each(|pid| tell(pid, Signal::CONT));
    }
}

fn stop_head(pid: Pid) {
    let asked = Instant::now();
    tell(pid, Signal::TSTP);
    while is_at_work(pid) {
        if asked.elapsed() > HEAD_TIMEOUT {
            tell(pid, Signal::STOP);
            return;
        }
        thread::sleep(HEAD_POLL);
    }
}

fn is_at_work(pid: Pid) -> bool {
    let process = u32::try_from(pid.as_raw_pid()).ok().and_then(Process::find);
    process.is_some_and(|process| !matches!(process.state(), State::Stopped | State::Dead))
}

/// Starts `command` in a process group of its own, so that Ctrl-C and Ctrl-Z reach it through this process alone.
pub(crate) fn start(command: &mut Command) -> io::Result<Child> {
    signals::unstoppable(|| command.process_group(0).spawn())
}

/// Sends a signal to an agent and all that it has started: a program may be a script around another. Each agent leads a
/// process group of its own, whose number is nobody else's as long as somebody is in it.
pub(crate) fn tell_group(pid: Pid, signal: Signal) {
    let _ = kill_process_group(pid, signal);
}

/// Sends a signal to a child that has not been reaped, so its number is still its own.
pub(crate) fn tell(pid: Pid, signal: Signal) {
    let _ = kill_process(pid, signal);
}
