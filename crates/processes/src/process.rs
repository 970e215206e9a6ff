//! State of a process as the operating system tells it, from `/proc/PID/stat`.

use std::{fmt, fs};

/// One process, told apart from a later one with the same number by its start time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Process {
    pid: u32,
    start_time: u64,
}

/// State of a process.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum State {
    /// On a processor, or ready for one.
    Running,
    /// Waiting for something.
    Sleeping,
    /// Waiting for a device; cannot be interrupted.
    Blocked,
    /// By SIGSTOP or a debugger.
    Stopped,
    /// No longer there.
    Dead,
}

impl fmt::Display for State {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            State::Running => "running",
            State::Sleeping => "sleeping",
            State::Blocked => "blocked on a device",
            State::Stopped => "stopped",
            State::Dead => "dead",
        })
    }
}

impl Process {
    /// The process that now has the number `pid`, if there is one.
    pub fn find(pid: u32) -> Option<Self> {
        stat(pid).map(|(_, start_time)| Self { pid, start_time })
    }

    /// Its number.
    pub fn pid(&self) -> u32 {
        self.pid
    }

    /// Returns its state now.
    pub fn state(&self) -> State {
        match stat(self.pid) {
            Some((state, start_time)) if start_time == self.start_time => state,
            _ => State::Dead,
        }
    }
}

/// State and start time (clock ticks since boot) of a process.
fn stat(pid: u32) -> Option<(State, u64)> {
    let text = fs::read_to_string(format!("/proc/{pid}/stat")).ok()?;
    // The second field is the command in parentheses, which may hold spaces and parentheses.
    let mut fields = text.rsplit_once(") ")?.1.split(' ');
    let state = match fields.next()? {
        "R" => State::Running,
        "D" => State::Blocked,
        "T" | "t" => State::Stopped,
        "Z" | "X" => State::Dead,
        _ => State::Sleeping,
    };
    // Field 22 of the line; the state is field 3.
    let start_time = fields.nth(22 - 4)?.parse().ok()?;
    Some((state, start_time))
}

#[cfg(test)]
mod tests {
    use std::process::{Command, id};

    use rustix::process::{Pid, Signal, kill_process};

    use super::*;

    #[test]
    fn we_live_and_nobody_has_number_zero() {
        assert_ne!(Process::find(id()).unwrap().state(), State::Dead);
        assert_eq!(Process::find(0), None);
    }

    #[test]
    fn a_child_is_seen_stopped_and_then_dead() {
        let mut child = Command::new("sleep").arg("60").spawn().unwrap();
        let process = Process::find(child.id()).unwrap();
        kill_process(Pid::from_child(&child), Signal::STOP).unwrap();
        while process.state() != State::Stopped {
            std::thread::yield_now();
        }
        child.kill().unwrap();
        while process.state() != State::Dead {
            std::thread::yield_now();
        }
        child.wait().unwrap();
        assert_eq!(process.state(), State::Dead);
    }
}
