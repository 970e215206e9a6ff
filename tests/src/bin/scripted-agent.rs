//! An agent that does what its params say: a stand-in for programs of users', good and bad.

use std::{
    env, fs,
    process::{self, ExitCode},
    thread,
    time::Duration,
};

use protocol::{
    command::Command,
    controller::{Controller, StageObserver},
    frame::BodyVector,
    payload::Payload,
    percept::Percept,
};
use serde::Deserialize;

/// The params, and how many steps this life has done.
#[derive(Deserialize)]
#[serde(default, deny_unknown_fields)]
struct Scripted {
    /// Milliseconds that a life after the first takes to begin.
    begins_after_ms: u64,
    /// Length of the payload of each packet.
    payload_bytes: usize,
    /// Lines that each step prints to standard error.
    lines_per_step: usize,
    /// The process ends in this step of every life, counted from 1.
    ends_in_step: Option<u32>,
    /// How.
    ends_by: Ending,
    /// Whether it removes its program before that.
    removes_program: bool,
    #[serde(skip)]
    steps: u32,
}

#[derive(Deserialize)]
#[serde(rename_all = "kebab-case")]
enum Ending {
    Exit,
    Panic,
    Abort,
}

impl Default for Scripted {
    fn default() -> Self {
        Self {
            begins_after_ms: 0,
            payload_bytes: 0,
            lines_per_step: 0,
            ends_in_step: None,
            ends_by: Ending::Exit,
            removes_program: false,
            steps: 0,
        }
    }
}

impl Scripted {
    fn end(&self) {
        if self.removes_program {
            let program = env::current_exe().expect("a program knows itself");
            fs::remove_file(program).expect("it can be removed");
        }
        match self.ends_by {
            Ending::Exit => process::exit(3),
            Ending::Panic => panic!("as its params say"),
            Ending::Abort => process::abort(),
        }
    }
}

impl Controller for Scripted {
    fn boot(&mut self) -> Command {
        Command { payload: payload(self.payload_bytes), ..Command::REST }
    }

    /// Flees from what it hears, so that the digest knows of every packet.
    fn step(&mut self, percept: &Percept, _: &mut dyn StageObserver) -> Command {
        self.steps += 1;
        for line in 0..self.lines_per_step {
            eprintln!("step {}, line {line}: {}", self.steps, "-".repeat(80));
        }
        if self.ends_in_step == Some(self.steps) {
            self.end();
        }
        let flee = |heard| BodyVector::new(-0.01, 0.0).turned(heard);
        let velocity = percept.deliveries.iter().map(|heard| flee(heard.bearing.get()).0).sum();
        let velocity = BodyVector(velocity).capped(0.2);
        Command { velocity, payload: payload(self.payload_bytes), ..Command::REST }
    }
}

fn payload(bytes: usize) -> Payload {
    vec![7; bytes].as_slice().try_into().expect("tests ask for no longer one than there can be")
}

fn main() -> ExitCode {
    robot_agent::main(|robot, params| {
        let scripted = params.json::<Scripted>()?;
        if robot.incarnation > 0 {
            thread::sleep(Duration::from_millis(scripted.begins_after_ms));
        }
        serde_json::Result::Ok(scripted)
    })
}
