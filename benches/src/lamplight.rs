//! Our own ticks: a `lamplight run` of a scenario, and what its summary says.

use std::{
    path::{Path, PathBuf},
    process::{Command, Stdio},
};

use anyhow::{Context, bail, ensure};
use serde::Deserialize;

/// Side of the scenario's arena, meters: 8 feet.
const SIDE_M: f64 = 2.4384;
/// Robots in it.
const ROBOTS: u32 = 50;
/// Ticks per second of virtual time in the scenario.
const TICKS_PER_S: f64 = 10.0;

/// Who thinks for the robots.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Engine {
    /// A process per robot, in lock-step.
    Lockstep,
    /// One loop in one process.
    InProcess,
}

impl Engine {
    /// As `--engine` spells it.
    fn name(self) -> &'static str {
        match self {
            Engine::Lockstep => "processes",
            Engine::InProcess => "in-process",
        }
    }
}

/// What we read of a `summary.json`.
#[derive(Clone, Debug, Deserialize)]
pub(crate) struct Summary {
    robots: u32,
    ticks: u32,
    ended: String,
    packets: Packets,
    /// Hash over all ticks.
    pub(crate) digest: String,
    /// Wall time of a tick.
    pub(crate) tick_us: TickTimes,
}

#[derive(Clone, Copy, Debug, Deserialize)]
struct Packets {
    heard: u64,
}

/// Wall time of a tick, microseconds.
#[derive(Clone, Copy, Debug, Deserialize)]
pub(crate) struct TickTimes {
    /// Median.
    pub(crate) p50: f64,
}

impl Summary {
    /// Packets one robot heard in one tick, on average.
    pub(crate) fn heard_per_robot_and_tick(&self) -> f64 {
        // A run of n ticks ends with tick number n, having begun with tick 0.
        self.packets.heard as f64 / f64::from(self.robots) / f64::from(self.ticks + 1)
    }
}

/// The program, and what it is to run.
#[derive(Debug)]
pub(crate) struct Lamplight {
    program: PathBuf,
    scenario: PathBuf,
    sets: Vec<String>,
}

impl Lamplight {
    /// The one that lies in our own folder, so that it is of our own build.
    pub(crate) fn beside_us(scenario: &Path, sets: &[String]) -> anyhow::Result<Self> {
        let us = std::env::current_exe().context("cannot find our own program")?;
        let program = us.with_file_name("lamplight");
        if !program.is_file() {
            bail!("{} is missing; build all with `scripts/build`", program.display());
        }
        ensure!(scenario.is_file(), "{} is missing; name one by --scenario", scenario.display());
        Ok(Self { program, scenario: scenario.to_path_buf(), sets: sets.to_vec() })
    }

    /// Runs the scenario with `robots` robots at its own density, for `ticks` ticks.
    pub(crate) fn run(&self, engine: Engine, robots: u32, ticks: u32) -> anyhow::Result<Summary> {
        let side_m = side_m(robots);
        let output = Command::new(&self.program)
            .arg("run")
            .arg(&self.scenario)
            .args(["--engine", engine.name(), "--json", "--quiet"])
            .args(["--robots", &robots.to_string()])
            .args(["--duration", &(f64::from(ticks) / TICKS_PER_S).to_string()])
            .args(["--set", &format!("arena.size_m=[{side_m}, {side_m}]")])
            .args(self.sets.iter().map(|set| format!("--set={set}")))
            .stdin(Stdio::null())
            .stderr(Stdio::inherit())
            .output()
            .with_context(|| format!("cannot start {}", self.program.display()))?;
        ensure!(output.status.success(), "`lamplight run` ended with {}", output.status);
        let summary: Summary = serde_json::from_slice(&output.stdout).context("its summary is not ours")?;
        ensure!(summary.ended == "finished", "the run did not finish, it was {}", summary.ended);
        Ok(summary)
    }
}

/// Side of a square that gives `robots` robots the room they have in the scenario.
fn side_m(robots: u32) -> f64 {
    SIDE_M * (f64::from(robots) / f64::from(ROBOTS)).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn four_times_the_robots_get_twice_the_side() {
        assert_eq!(side_m(50), 2.4384);
        assert_eq!(side_m(200), 2.0 * 2.4384);
    }

    #[test]
    fn packets_are_counted_per_robot_and_tick() {
        let summary: Summary = serde_json::from_str(
            r#"{"robots": 10, "ticks": 9, "ended": "finished", "packets": {"heard": 850, "sent": 100},
                "digest": "00", "tick_us": {"p50": 20.5, "max": 99.0}}"#,
        )
        .unwrap();
        assert_eq!(summary.heard_per_robot_and_tick(), 8.5);
    }
}
