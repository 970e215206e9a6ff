//! The options of `lamplight batch`.

use std::path::PathBuf;

use clap::{Args, ValueEnum};
use scenario::Seed;
use serde::{Deserialize, Serialize};

use crate::run::Engine;

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
    pub(super) file: PathBuf,

    /// Trials of each setting: seeds S, S + 1, ...; more than the batch in DIR has make it grow
    #[arg(long, value_name = "K", value_parser = clap::value_parser!(u64).range(1..))]
    pub(super) trials: u64,

    /// Numbers of robots, in place of the scenario's, such as 10,100,1000
    #[arg(long, value_name = "N,...", value_delimiter = ',', allow_negative_numbers = true)]
    pub(super) robots: Vec<i64>,

    /// Let a key go through these values, such as field.offset=1600,800; may be repeated, for all combinations
    #[arg(long = "sweep", value_name = "KEY.PATH=A,B,...")]
    pub(super) sweeps: Vec<String>,

    /// Seed of the first trial, in place of the scenario's; the last one's is at most 9007199254740991, 2^53 − 1
    #[arg(long, value_name = "S", allow_negative_numbers = true)]
    pub(super) seed: Option<Seed>,

    /// Longest virtual time of a trial, in place of the scenario's
    #[arg(long, value_name = "SECONDS", allow_negative_numbers = true)]
    pub(super) duration: Option<f64>,

    /// Class in Python that thinks for all robots, or for those of these numbers, such as my.py:ToTheLight or
    /// my.py:ToTheLight=40-49; may be repeated
    #[arg(long = "controller", value_name = "FILE.py[:CLASS][=ROBOTS]")]
    pub(super) controllers: Vec<String>,

    /// Set any key of the scenario, such as channel.range_m=0.8; may be repeated
    #[arg(long = "set", value_name = "KEY.PATH=VALUE")]
    pub(super) sets: Vec<String>,

    /// Engine that runs the robots: with processes, the same ones play trial after trial
    #[arg(long, value_enum, default_value_t = Engine::InProcess)]
    pub(super) engine: Engine,

    /// Also play every trial with the exact controller from the same start, for the cost H it reaches
    #[arg(long)]
    pub(super) exact: bool,

    /// Keep more of every trial
    #[arg(long, value_enum, value_name = "WHAT", value_delimiter = ',')]
    pub(super) keep: Vec<Keep>,

    /// Trials at once, in process [default: one per core]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    pub(super) jobs: Option<u16>,

    /// Write trials.csv, summary.json and scenario.toml to this folder, or go on with the batch in it
    #[arg(long, value_name = "DIR")]
    pub(super) out: PathBuf,

    /// Print summary.json on standard output
    #[arg(long)]
    pub(super) json: bool,

    /// No progress and no notes on standard error, only warnings and errors
    #[arg(long, short)]
    pub(super) quiet: bool,
}
