//! Command-line options of a trace.

use std::path::PathBuf;

use clap::Args;
use scenario::{RobotSet, Scenario};
use serde::{Deserialize, Serialize};

/// Megabytes of a trace, unless somebody says otherwise. A viewer in a browser opens that in a few seconds.
const MAX_MB: u64 = 256;

/// Whether there is to be a trace, and of what.
#[derive(Args, Clone, Debug, Serialize, Deserialize)]
pub struct TraceOptions {
    /// Write what happens when into this new file, a trace to be opened in a viewer such as ui.perfetto.dev
    #[serde(with = "files::os_path")]
    #[arg(id = "trace", long = "trace", value_name = "FILE")]
    pub file: Option<PathBuf>,

    /// Most megabytes of the trace; whole ticks are left out from where it would be longer
    #[arg(
        id = "trace_max_mb",
        long = "trace-max-mb",
        value_name = "MB",
        default_value_t = MAX_MB,
        value_parser = clap::value_parser!(u64).range(1..=1_000_000),
        requires = "trace"
    )]
    pub max_mb: u64,

    /// Trace these robots only, such as 0-9,17
    #[arg(id = "trace_robots", long = "trace-robots", value_name = "ROBOTS", requires = "trace")]
    pub robots: Option<RobotSet>,
}

/// Why there can be no such trace.
#[derive(Debug, thiserror::Error)]
pub enum TraceError {
    /// Nothing is measured that a trace could show.
    #[error(
        "--trace shows what is measured of the agents, and --no-profile measures nothing; leave one of them out"
    )]
    Unmeasured,
    /// There is no robot of this number.
    #[error("--trace-robots {0}: the scenario has robots 0 to {1}")]
    Robots(RobotSet, u32),
    /// It would be written over.
    #[error("{} is there already; give --trace the name of a new file, or remove this one", .0.display())]
    Exists(PathBuf),
    /// There is no place for it.
    #[error("there is no folder {} for --trace to write to; make it, or give --trace another one", .0.display())]
    NoFolder(PathBuf),
}

impl TraceOptions {
    /// Whether they fit a run of `scenario`, of which agents are measured or not.
    ///
    /// # Errors
    /// If they do not.
    pub fn check(&self, scenario: &Scenario, measured: bool) -> Result<(), TraceError> {
        let Some(file) = &self.file else { return Ok(()) };
        if !measured {
            return Err(TraceError::Unmeasured);
        }
        let robots = scenario.robot_count();
        if let Some(set) = self.robots.as_ref().filter(|set| set.highest() >= robots) {
            return Err(TraceError::Robots(set.clone(), robots - 1));
        }
        if file.exists() {
            return Err(TraceError::Exists(file.clone()));
        }
        match file.parent().filter(|folder| !folder.as_os_str().is_empty() && !folder.is_dir()) {
            Some(folder) => Err(TraceError::NoFolder(folder.into())),
            None => Ok(()),
        }
    }

    /// Robots whose cycles are to be traced; `None` without a trace.
    pub fn traced(&self, scenario: &Scenario) -> Option<RobotSet> {
        self.file.as_ref()?;
        self.robots.clone().or_else(|| RobotSet::of(0..scenario.robot_count()))
    }
}
