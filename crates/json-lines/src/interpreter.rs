//! A program that speaks lines of JSON, as a controller.

use std::{
    env,
    ffi::OsString,
    io::{BufRead, BufReader, Read, Write},
    process::{Child, ChildStdin, ChildStdout, Command, Stdio},
};

use json_lines::{BootLine, CommandLine, LINE_BYTES_MAX, PerceptLine};
use neighborhood::{Neighborhood, Setup};
use protocol::{
    command,
    controller::{Controller, StageObserver},
    giving_up::give_up,
    percept::{Percept, Tick},
    robot_id::RobotId,
};
use serde::Serialize;

/// The first word of this program's command line when it is to become the interpreter.
pub(crate) const AS_CHILD: &str = "--as-child";

/// A running program.
pub(crate) struct Interpreter {
    /// Its name in messages.
    name: String,
    child: Child,
    input: ChildStdin,
    output: BufReader<ChildStdout>,
    /// The line that is being written or read.
    line: Vec<u8>,
    boot: BootLine,
    neighborhood: Neighborhood,
}

impl Interpreter {
    /// Starts the program for one life of a robot.
    pub(crate) fn start(words: &[OsString], name: &str, id: RobotId, setup: Setup) -> Result<Self, String> {
        let us = env::current_exe().map_err(|error| error.to_string())?;
        let mut command = Command::new(us);
        command.arg(AS_CHILD).args(words).stdin(Stdio::piped()).stdout(Stdio::piped());
        let mut child = command.spawn().map_err(|error| format!("{name} cannot be started: {error}"))?;
        Ok(Self {
            name: name.into(),
            input: child.stdin.take().expect("standard input is piped"),
            output: BufReader::new(child.stdout.take().expect("standard output is piped")),
            child,
            line: Vec::new(),
            boot: BootLine::new(id, setup.params),
            neighborhood: Neighborhood::new(id, setup.neighbor_timeout_ticks),
        })
    }

    /// Says a line and returns the command that answers it. Whatever else happens ends this controller.
    fn ask(&mut self, question: &impl Serialize, tick: Option<Tick>) -> command::Command {
        let Self { name, input, output, line, .. } = self;
        line.clear();
        serde_json::to_writer(&mut *line, question).expect("a line is plain data");
        line.push(b'\n');
        // If it has ended, it does not answer either.
        let _ = input.write_all(line);
        line.clear();
        let read = output.take(LINE_BYTES_MAX as u64).read_until(b'\n', line);
        let (is_whole, is_over) = (line.last() == Some(&b'\n'), !matches!(read, Ok(1..)));
        if is_over {
            let how = self.child.wait().map_or_else(|error| error.to_string(), |status| status.to_string());
            give_up(format!("{} has ended without an answer ({how})", self.name));
        }
        if !is_whole && line.len() == LINE_BYTES_MAX {
            give_up(format!("{name} has answered a line of more than {LINE_BYTES_MAX} bytes"));
        }
        CommandLine::read(line, tick).unwrap_or_else(|error| {
            let shown: String = String::from_utf8_lossy(line).trim_end().chars().take(200).collect();
            let shown = shown.replace(char::is_control, " ");
            give_up(format!("{name} has answered `{shown}`: {error}"))
        })
    }
}

impl Controller for Interpreter {
    fn boot(&mut self) -> command::Command {
        let boot = self.boot.clone();
        self.ask(&boot, None)
    }

    fn hear(&mut self, percept: &Percept) {
        self.neighborhood.hear(percept);
    }

    fn step(&mut self, percept: &Percept, _: &mut dyn StageObserver) -> command::Command {
        self.neighborhood.begin_cycle(percept);
        let question = PerceptLine::new(percept, &self.neighborhood);
        self.ask(&question, Some(percept.tick))
    }
}

/// Its program ends with it.
impl Drop for Interpreter {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}
