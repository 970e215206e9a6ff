//! The command people type, as a library: its program is [`main`], and so is the Python package, which plays controllers in
//! Python in one process.

#![forbid(unsafe_code)]

mod batch;
mod check;
mod children;
mod clean;
mod ctl;
mod export;
mod failure;
mod fuzz;
mod in_process;
mod limits;
mod log;
mod name;
mod new;
mod outcome;
mod python;
mod recorded_run;
mod replay;
mod report;
mod run;
mod schema;
mod shrink;
mod status;
mod stdout;
mod summary_text;
mod supervisor;
mod top;
mod view;
mod workshop;

use std::ffi::OsString;

use clap::{Parser, Subcommand};

use crate::failure::Failure;
pub use crate::{
    in_process::{PythonConstructor, PythonHost},
    status::Status,
};

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
    /// Run many trials of a scenario: seeds × robot counts × swept values
    ///
    /// Trial i (from 0) of each setting has the seed S + i, where S is the scenario's seed or --seed. A trial ends
    /// after the scenario's duration_s, or at its convergence if convergence.stop is set. DIR gets trials.csv (a
    /// row per trial), summary.json (statistics per setting) and scenario.toml. Interrupted or killed, the same
    /// command goes on where it was, and the result is the same to the last byte; with more --trials the batch grows.
    /// A trial that loses agents which nobody planned to lose is played again, and marked and left out if it loses
    /// some again. Exit status: 0 if every trial was played, 1 if one failed or lost agents again, or something
    /// cannot be written, 2 for bad arguments or a bad scenario, 130 after Ctrl-C.
    Batch(batch::BatchArgs),
    /// Shrink a scenario: find the few faults and robots that a failure needs
    ///
    /// Runs the scenario with ever fewer faults and robots, as long as the failure shows, and saves the smallest one
    /// that does: in this process, or as processes if programs think for robots. Interrupted, the same command goes on where it was: what it has found
    /// out is kept in FILE.journal until it is done. Exit status: 0 if a result was saved, 1 if the failure does
    /// not show in the whole scenario or the result cannot be saved, 2 for bad arguments or a bad scenario, 130 after
    /// Ctrl-C.
    Shrink(shrink::ShrinkArgs),
    /// Fuzz a scenario: run it with random fault plans and check what must always hold
    ///
    /// Run i (from 0) has the seed S + i, where S is the scenario's seed or --seed. From it are drawn the start,
    /// a fault plan within the bounds of [fuzz] in the scenario file, in place of the scenario's own, and in half
    /// of the runs another channel. A run that loses processes which nobody planned to lose is repeated. Each run lasts
    /// --duration, or else fuzz.duration_s, or else the scenario's duration_s, at most 20 seconds of virtual time. A
    /// failed run prints the command that repeats it. What controllers state with `always` must hold; what `sometimes`
    /// asks for and no run has reached is listed in the end. Exit status: 0 if no run failed, 1 if one did, 2 for bad
    /// arguments or a bad scenario, 130 after Ctrl-C.
    Fuzz(fuzz::FuzzArgs),
    /// Say what a recording holds, or verify it: run its scenario again and compare each tick
    ///
    /// A recording is DIR/run.mcap of `lamplight run --record --out DIR`; one that was cut holds what came before.
    /// Exit status: 0, also if the recording was cut and what it holds is what happens; 1 if it is not, or cannot be
    /// found out; 2 for a file that is no recording, or cannot be verified; 130 after Ctrl-C.
    Replay(replay::ReplayArgs),
    /// Export a recording for the tools of ROS 2: `ros2 bag`, RViz, PlotJuggler
    ///
    /// A recording is DIR/run.mcap of `lamplight run --record --out DIR`; one that was cut is exported up to there, which is said.
    /// Written are time (/clock), a frame per robot (/tf: world to robot_0, robot_1 and so on), poses (/robots), bodies and cells
    /// (/scene) and metrics (/metrics/...), in meters and at virtual time. A folder that is not empty is left alone, and
    /// nothing half made is left behind. Exit status: 0, also if the recording was cut; 1 if the export cannot be written; 2 for a file
    /// that is no recording, or a folder that is not empty; 130 after Ctrl-C.
    Export(export::ExportArgs),
    /// Report on a run or a batch: figures and one page that opens offline, DIR/report.html
    ///
    /// Writes DIR/report.html and DIR/figures/*.svg, and says where the page is. The same folder gives the same
    /// bytes. Only what an earlier report wrote is written over. Exit status: 0, 1 if the page or a figure cannot be
    /// written, 2 for a folder that is no run and no batch, or whose files cannot be read.
    Report(report::ReportArgs),
    /// Watch a live run in the terminal: how fast it goes, who is slow, who is waited for
    ///
    /// Only runs of processes can be watched. Keys: q quits, s sorts robots by something else, arrows scroll. Exit
    /// status: 0, also when the run ends; 1 if it cannot be watched; 2 if there is no such run.
    Top(top::TopArgs),
    /// Watch a live run on a page in the browser: cells, packets, faults, who is waited for
    ///
    /// Prints the page's address, whose token only you have, and serves it until Ctrl-C. Exit status: 130 after Ctrl-C;
    /// 1 if the run cannot be watched; 2 if there is no such run, or the address is taken.
    View(view::ViewArgs),
    /// Act upon a live run: hold it, step it, kill and stop robots, drop packets, move lamps
    ///
    /// An act takes effect at the next tick, which is printed; the ledger and a recording name it. Exit status: 0; 1 if the
    /// run cannot be asked; 2 if there is no such run, or it refuses the act.
    Ctl(ctl::CtlArgs),
    /// Check a scenario file; errors name the line
    Check(check::CheckArgs),
    /// Remove what crashed runs have left in shared memory; live runs are not touched
    Clean,
    /// Make a folder to begin with: a controller of your own, with a scenario, a test and a README
    ///
    /// Exit status: 0, 1 if it cannot be made, 2 for a name that is taken or none.
    New(new::NewArgs),
    /// Print the JSON Schema of scenario files, for editors
    Schema(schema::SchemaArgs),
}

/// Does what the `words` of a command line say, of which the first is the name of the program, and returns the exit status.
/// `python` is who makes controllers in Python, where this process is an interpreter.
pub fn main(words: impl IntoIterator<Item = OsString>, python: Option<Box<dyn PythonHost>>) -> Status {
    let cli = match Cli::try_parse_from(words) {
        Ok(cli) => cli,
        Err(error) => {
            // If nobody takes it, there is nobody to tell.
            let _ = error.print();
            return if error.use_stderr() { Status::USAGE } else { Status::SUCCESS };
        }
    };
    in_process::host(python);
    let outcome = match files::survive_size_limit() {
        Ok(()) => obey(cli.command),
        Err(error) => Err(Failure::run(error)),
    };
    let status = outcome.unwrap_or_else(|failure: Failure| {
        logging::fatal(env!("CARGO_CRATE_NAME"), &failure.to_string());
        failure.status()
    });
    match log::end() {
        // Nothing else has failed.
        false if status == Status::SUCCESS => Status::FAILURE,
        _ => status,
    }
}

fn obey(command: Command) -> Result<Status, Failure> {
    match command {
        Command::Run(args) => run::run(&args),
        Command::Batch(args) => batch::batch(&args),
        Command::Shrink(args) => shrink::shrink(&args),
        Command::Fuzz(args) => fuzz::fuzz(&args),
        Command::Replay(args) => replay::replay(&args),
        Command::Export(args) => export::export(&args),
        Command::Report(args) => report::report(&args),
        Command::Top(args) => top::top(&args),
        Command::View(args) => view::view(&args),
        Command::Ctl(args) => ctl::ctl(&args),
        Command::Check(args) => check::check(&args),
        Command::Clean => clean::clean(),
        Command::New(args) => new::new(&args),
        Command::Schema(args) => schema::schema(&args),
    }
}
