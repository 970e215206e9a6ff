//! `lamplight batch`: many trials of a scenario, so that a figure is a distribution and not an anecdote.
//!
//! ```text
//! plan (what) -> workers (by whom) -> folder (kept in order) -> summary (statistics)
//! ```

mod folder;
mod plan;
mod summary;
mod workers;

use std::{
    path::PathBuf,
    process::ExitCode,
    time::{Duration, Instant},
};

use anyhow::anyhow;
use clap::{Args, ValueEnum};
use logging::Format;
use observe::progress::Meter;
use processes::signals::exit_status;
use scenario::Seed;
use serde::{Deserialize, Serialize};

use self::{
    folder::{Done, Folder},
    plan::Plan,
    workers::{Workers, named},
};
use crate::{failure::Failure, log, run::Engine, stdout::say};

/// Tables that can be kept of every trial beside its row.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, ValueEnum, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum Keep {
    /// errors.csv: mean and largest estimated error over time, every output.metrics_every_s
    Errors,
    /// positions.csv: where each robot began and ended
    Positions,
}

#[derive(Args, Debug)]
pub(crate) struct BatchArgs {
    /// Scenario file (TOML)
    #[arg(value_name = "SCENARIO")]
    file: PathBuf,

    /// Trials of each setting: seeds S, S + 1, ...; more than the batch in DIR has make it grow
    #[arg(long, value_name = "K", value_parser = clap::value_parser!(u64).range(1..))]
    trials: u64,

    /// Numbers of robots, in place of the scenario's, such as 10,100,1000
    #[arg(long, value_name = "N,...", value_delimiter = ',', allow_negative_numbers = true)]
    robots: Vec<i64>,

    /// Let a key go through these values, such as field.offset=1600,800; may be repeated, for all combinations
    #[arg(long = "sweep", value_name = "KEY.PATH=A,B,...")]
    sweeps: Vec<String>,

    /// Seed of the first trial, in place of the scenario's; the last one's is at most 9007199254740991, 2^53 − 1
    #[arg(long, value_name = "S", allow_negative_numbers = true)]
    seed: Option<Seed>,

    /// Longest virtual time of a trial, in place of the scenario's
    #[arg(long, value_name = "SECONDS", allow_negative_numbers = true)]
    duration: Option<f64>,

    /// Set any key of the scenario, such as channel.range_m=0.8; may be repeated
    #[arg(long = "set", value_name = "KEY.PATH=VALUE")]
    sets: Vec<String>,

    /// Engine that runs the robots: with processes, the same ones play trial after trial
    #[arg(long, value_enum, default_value_t = Engine::InProcess)]
    engine: Engine,

    /// Also play every trial with the exact controller from the same start, for the cost H it reaches
    #[arg(long)]
    exact: bool,

    /// Keep more of every trial
    #[arg(long, value_enum, value_name = "WHAT", value_delimiter = ',')]
    keep: Vec<Keep>,

    /// Trials at once, in process [default: one per core]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    jobs: Option<u16>,

    /// Write trials.csv, summary.json and scenario.toml to this folder, or go on with the batch in it
    #[arg(long, value_name = "DIR")]
    out: PathBuf,

    /// Print summary.json on standard output
    #[arg(long)]
    json: bool,

    /// No progress and no notes on standard error, only warnings and errors
    #[arg(long, short)]
    quiet: bool,
}

pub(crate) fn batch(args: &BatchArgs) -> Result<ExitCode, Failure> {
    log::begin(args.quiet, Format::Text);
    let plan = Plan::new(args).map_err(Failure::Usage)?;
    log::warn_of(&plan.warnings());
    let workers = Workers::new(args, &plan)?;
    let (mut folder, missing) = Folder::open(&args.out, &plan)?;
    let total = plan.len();
    if folder.done() > 0 {
        tracing::info!("{} of {total} trials are done already", folder.done());
    }
    let mut outlook = Outlook::new(&plan, &missing);
    let mut meter = Meter::begin(Some(total as u64), args.quiet);
    let mut lost = Vec::new();
    let signal = workers.play(&plan, &missing, &mut |index, done| {
        let trial = plan.trial(index);
        folder.add(&trial, &done)?;
        if let Done::LostAgents = done {
            lost.push(named(&trial));
        }
        outlook.done += plan.weight(index);
        let done = folder.done();
        meter.show(done as u64, || format!("{done} of {total} trials, {}", outlook.time_left()));
        Ok(())
    });
    drop(meter);
    match signal.map_err(Failure::Run)? {
        Some(signal) => {
            eprintln!(
                "interrupted after {} of {total} trials; the same command goes on from there",
                folder.done()
            );
            Ok(ExitCode::from(exit_status(signal)))
        }
        None if folder.done() < total => {
            Err(Failure::Run(anyhow!("{} trials are missing", total - folder.done())))
        }
        None => {
            folder.put_in_order(&plan).map_err(Failure::Run)?;
            let summary = summary::of(&plan, &folder.columns(&plan), &folder.rows().map_err(Failure::Run)?);
            let json = summary.json();
            let written = folder.finish(&json);
            say(&if args.json { json } else { summary.lines() })?;
            written?;
            match lost.len() {
                0 => Ok(ExitCode::SUCCESS),
                count => Err(Failure::Run(anyhow!(
                    "{count} of {total} trials lost agents each time they were played, and are left out of the \
                     statistics: {}; the same command plays them again",
                    lost.join(", ")
                ))),
            }
        }
    }
}

/// How long a batch may still take.
struct Outlook {
    began: Instant,
    /// Work done since then, and work to be done, in robot-ticks.
    done: f64,
    all: f64,
}

impl Outlook {
    fn new(plan: &Plan, missing: &[usize]) -> Self {
        let all = missing.iter().map(|&index| plan.weight(index)).sum();
        Self { began: Instant::now(), done: 0.0, all }
    }

    fn time_left(&self) -> String {
        let left_s = self.began.elapsed().as_secs_f64() * (self.all / self.done - 1.0);
        let left = Duration::try_from_secs_f64(left_s).unwrap_or(Duration::MAX).as_secs();
        match left {
            0..120 => format!("about {left} s left"),
            120..7200 => format!("about {} min left", left / 60),
            _ => format!("about {} h left", left / 3600),
        }
    }
}
