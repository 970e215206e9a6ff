//! Options of a scenario and of a run of it.

use std::path::PathBuf;

use clap::{
    Args, ValueEnum,
    builder::{PossibleValuesParser, TypedValueParser},
};
use engine::pace::Overload;
use logging::Format;
use observe::{
    live::ListenAddr,
    recorder::RecordExtent,
    trace::{TraceError, TraceOptions},
};
use protocol::setup::Mode;
use scenario::{Override, OverrideError, Scenario, ScenarioError, Seed};
use serde::{Deserialize, Serialize};

/// Longest wall time of a step, seconds: a year. Beyond what clocks count, nothing would be held back at all.
const STEP_WALL_MAX_S: f64 = 365.0 * 86_400.0;

/// How time passes, as the command line spells it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, ValueEnum)]
#[value(rename_all = "lower")]
pub enum ModeName {
    /// Virtual time: every tick waits for every live robot
    #[default]
    Lockstep,
    /// Wall time: every robot runs on its own timer
    Realtime,
}

/// Policy for real time when the machine cannot keep up, as the command line spells it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, ValueEnum)]
pub enum OverloadName {
    /// The run fails as soon as the arena is a whole tick late
    Fail,
    /// The arena makes up for up to half a second; what is more is lost, and the run says how much
    #[default]
    Report,
    /// The arena makes up for nothing: ticks come later, none comes sooner than a step after the one before
    SlowClock,
}

/// Which scenario, and what the command line changes in it.
#[derive(Args, Clone, Debug)]
pub struct ScenarioOptions {
    /// Scenario file (TOML)
    #[arg(value_name = "SCENARIO")]
    pub file: PathBuf,

    /// Number of robots, in place of the scenario's
    #[arg(long, value_name = "N", allow_negative_numbers = true)]
    pub robots: Option<i64>,

    /// Seed of every random draw, in place of the scenario's: from 0 to 9007199254740991, 2^53 − 1
    #[arg(long, value_name = "S", allow_negative_numbers = true)]
    pub seed: Option<Seed>,

    /// Virtual time to run, in place of the scenario's
    #[arg(long, value_name = "SECONDS", allow_negative_numbers = true)]
    pub duration: Option<f64>,

    /// Class in Python that thinks for all robots, or for those of these numbers, such as my.py:ToTheLight or
    /// my.py:ToTheLight=40-49; may be repeated
    #[arg(long = "controller", value_name = "FILE.py[:CLASS][=ROBOTS]")]
    pub controllers: Vec<String>,

    /// Set any key of the scenario, such as channel.range_m=0.8; may be repeated
    #[arg(long = "set", value_name = "KEY.PATH=VALUE")]
    pub sets: Vec<String>,
}

/// Options of a run.
#[derive(Args, Clone, Debug)]
pub struct RunOptions {
    /// Which scenario
    #[command(flatten)]
    pub scenario: ScenarioOptions,

    /// How it is played
    #[command(flatten)]
    pub play: PlayOptions,
}

/// How a scenario is played, and what is kept and shown of it.
#[derive(Args, Clone, Debug, Serialize, Deserialize)]
pub struct PlayOptions {
    /// How time passes
    #[arg(long, value_enum, default_value_t)]
    pub mode: ModeName,

    /// In lock-step, run no faster than this multiple of real time [default: as fast as it can]
    #[arg(long, value_name = "MAX_FACTOR", value_parser = positive, allow_negative_numbers = true)]
    pub speed: Option<f64>,

    /// In real time, what if this machine cannot keep up
    #[arg(long, value_enum, default_value_t)]
    pub overload: OverloadName,

    /// Write summary.json, metrics.csv, robots.csv, ledger.csv, latency.hlog, scenario.toml and the log to
    /// this new folder
    #[serde(with = "files::os_path")]
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,

    /// Serve metrics for Prometheus at http://ADDR/metrics, such as 127.0.0.1:9464; :9464 is this machine alone
    #[arg(long, value_name = "ADDR")]
    pub metrics: Option<ListenAddr>,

    /// Do not measure what the agents take (saves a little time)
    #[arg(long)]
    pub no_profile: bool,

    /// Record the run in DIR/run.mcap, for viewers such as Foxglove and rerun, and for `lamplight replay`; `full`: with what
    /// each robot was told and answered, to the bit
    #[arg(long, requires = "out", value_name = "EXTENT", num_args = 0..=1, require_equals = true,
          default_missing_value = "plain")]
    pub record: Option<RecordExtent>,

    /// Whether there is to be a trace
    #[command(flatten)]
    pub trace: TraceOptions,

    /// How log lines are written, on standard error [default: what LAMPLIGHT_LOG says, or text]
    #[serde(skip)]
    #[arg(long, value_name = "FORMAT", value_parser = log_format())]
    pub log: Option<Format>,

    /// No progress and no notes on standard error, only warnings and errors
    #[arg(long, short)]
    pub quiet: bool,
}

/// Why the options and the scenario they name make no run.
#[derive(Debug, thiserror::Error)]
pub enum LoadError {
    /// An option is no override.
    #[error(transparent)]
    Override(#[from] OverrideError),
    /// The scenario is wrong.
    #[error(transparent)]
    Scenario(#[from] ScenarioError),
    /// Robots on their own timers cannot be hurried.
    #[error(
        "--speed {0}: in --mode realtime virtual time is real time; leave --speed out, or run in lock-step"
    )]
    SpeedInRealtime(f64),
    /// The next step would never come.
    #[error(
        "--speed {speed:?}: a step of {step_s} s would take {:e} s, more than {STEP_WALL_MAX_S:e}, a year; use a higher \
         speed",
        step_s / speed
    )]
    TooSlow {
        /// Multiple of real time that was asked for.
        speed: f64,
        /// Length of a tick in virtual time.
        step_s: f64,
    },
    /// There can be no such trace.
    #[error(transparent)]
    Trace(#[from] TraceError),
}

impl ScenarioOptions {
    /// Reads the scenario, with what the command line sets. The options with names of their own
    /// win over `--set`.
    pub fn load(&self) -> Result<Scenario, LoadError> {
        Ok(Scenario::load(&self.file, &self.overrides()?)?)
    }

    fn overrides(&self) -> Result<Vec<Override>, OverrideError> {
        let named = [
            ("robots", "robots.count", self.robots.map(|robots| robots.to_string())),
            ("seed", "seed", self.seed.map(|seed| seed.to_string())),
            ("duration", "duration_s", self.duration.map(toml_number)),
        ];
        // First, so that their params may be set.
        let controllers = self.controllers.iter().map(|controller| Override::controller(controller));
        let sets = controllers.chain(self.sets.iter().map(|set| set.parse()));
        let named = named.into_iter().filter_map(|(option, key, value)| {
            let value = value?;
            Some(format!("{key}={value}").parse().map(|o: Override| o.spelled(format!("--{option} {value}"))))
        });
        sets.chain(named).collect()
    }
}

impl RunOptions {
    /// Reads the scenario, with what the command line sets.
    pub fn load(&self) -> Result<Scenario, LoadError> {
        let PlayOptions { mode, speed, trace, no_profile, .. } = &self.play;
        if let (ModeName::Realtime, Some(speed)) = (mode, *speed) {
            return Err(LoadError::SpeedInRealtime(speed));
        }
        let scenario = self.scenario.load()?;
        let step_s = scenario.step_s.get();
        if let Some(speed) = speed.filter(|speed| step_s / speed > STEP_WALL_MAX_S) {
            return Err(LoadError::TooSlow { speed, step_s });
        }
        trace.check(&scenario, !no_profile)?;
        Ok(scenario)
    }
}

impl PlayOptions {
    /// How time passes.
    pub fn mode(&self) -> Mode {
        match self.mode {
            ModeName::Lockstep => Mode::Lockstep,
            ModeName::Realtime => Mode::Realtime,
        }
    }

    /// Returns the policy for when the machine cannot keep up.
    pub fn overload(&self) -> Overload {
        match self.overload {
            OverloadName::Fail => Overload::Fail,
            OverloadName::Report => Overload::Report,
            OverloadName::SlowClock => Overload::SlowClock,
        }
    }

    /// How log lines are written. A word of the environment that is no format is warned of when logging begins.
    pub fn log_format(&self) -> Format {
        self.log.unwrap_or_else(|| Format::from_env().unwrap_or_default())
    }
}

/// A number as TOML spells it: `nan` and `inf` in small letters, and an exponent where digits are many.
pub fn toml_number(number: f64) -> String {
    let text = format!("{number:?}").to_lowercase();
    if text.contains('e') { text } else { text.trim_end_matches(".0").into() }
}

fn log_format() -> impl TypedValueParser<Value = Format> {
    PossibleValuesParser::new(Format::NAMES).try_map(|name| name.parse::<Format>())
}

fn positive(text: &str) -> Result<f64, String> {
    match text.parse() {
        Ok(value) if value > 0.0 && f64::is_finite(value) => Ok(value),
        _ => Err("it must be a positive number".into()),
    }
}
