//! A robot's process whose controller is another program, which speaks lines of JSON.
//!
//! `json-lines-agent node my.js --run lab --robot 7`: what comes before `--run` is the program. It is in the process group
//! of this one, and ends with it.

#![forbid(unsafe_code)]

mod interpreter;

use std::{
    env,
    ffi::OsString,
    iter,
    os::unix::process::CommandExt,
    process::{Command, ExitCode},
};

use neighborhood::Setup;
use protocol::{params::Params, robot_id::RobotId};
use rustix::process::{Signal, set_parent_process_death_signal};

use crate::interpreter::{AS_CHILD, Interpreter};

fn main() -> ExitCode {
    let mut words: Vec<OsString> = env::args_os().skip(1).collect();
    if words.first().is_some_and(|word| word == AS_CHILD) {
        return become_program(&words[1..]);
    }
    let begin = words.iter().position(|word| word == "--run").unwrap_or(words.len());
    let options = words.split_off(begin);
    if words.is_empty() {
        eprintln!("usage: json-lines-agent PROGRAM... --run NAME --robot N");
        return ExitCode::from(2);
    }
    let program = words.iter().map(|word| word.to_string_lossy()).collect::<Vec<_>>().join(" ");
    robot_agent::run(
        iter::once("agent".into()).chain(options),
        &program,
        |robot: RobotId, params: &Params| {
            let setup: Setup = params.json().map_err(|error| error.to_string())?;
            Interpreter::start(&words, &program, robot, setup)
        },
    )
}

/// Becomes a program that ends with the process that has started this one.
fn become_program(words: &[OsString]) -> ExitCode {
    let Some((program, rest)) = words.split_first() else { return ExitCode::from(2) };
    let _ = set_parent_process_death_signal(Some(Signal::KILL));
    let error = Command::new(program).args(rest).exec();
    eprintln!("{}: {error}", program.display());
    ExitCode::FAILURE
}
