//! The command people type.

#![forbid(unsafe_code)]

mod check;
mod clean;
mod failure;
mod in_process;
mod limits;
mod run;
mod say;
mod summary_text;
mod supervisor;

use std::process::ExitCode;

use clap::{Parser, Subcommand};

use crate::failure::Failure;

/// Run a robot swarm the way it would really run: a process per robot
#[derive(Debug, Parser)]
#[command(version, arg_required_else_help = true)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Run a scenario: start its robots, let them move, and write what happened
    Run(run::RunArgs),
    /// Check a scenario file; errors name the line
    Check(check::CheckArgs),
    /// Remove what crashed runs have left in shared memory; live runs are not touched
    Clean,
    /// Print the JSON Schema of scenario files, for editors
    Schema,
}

fn main() -> ExitCode {
    let outcome = match Cli::parse().command {
        Command::Run(args) => run::run(&args),
        Command::Check(args) => check::check(&args),
        Command::Clean => clean::clean(),
        Command::Schema => say::say(&arena::scenario::schema_json()).map(|()| ExitCode::SUCCESS),
    };
    outcome.unwrap_or_else(|failure: Failure| {
        eprintln!("error: {failure}");
        failure.exit_code()
    })
}
