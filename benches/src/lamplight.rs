//! Our own ticks: a `lamplight run` of a scenario, and what its summary says.

use std::{
    fs::File,
    io::{self, Read, Seek},
    path::{Path, PathBuf},
    process::{Command, Stdio},
    thread,
    time::Duration,
};

use anyhow::{Context, anyhow, ensure};
use rustix::process::{Pid, Signal, kill_process};
use serde::Deserialize;
use squad::stop::StopFlag;

use crate::machine::our_name;

/// Side of the scenario's arena, meters: 8 feet.
const SIDE_M: f64 = 2.4384;
/// Robots in it.
const ROBOTS: u32 = 50;
/// Ticks per second of virtual time in the scenario.
const TICKS_PER_S: f64 = 10.0;
/// How often we look whether a run has ended.
const RUN_POLL: Duration = Duration::from_millis(20);

/// Engine that runs the robots.
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

/// The parts of a `summary.json` that we read.
#[derive(Clone, Debug, Deserialize)]
pub(crate) struct Summary {
    robots: u32,
    ticks: u32,
    ended: String,
    packets: Packets,
    /// Seconds until everybody had joined.
    #[serde(default)]
    start_up_s: Option<f64>,
    /// Of processes alone.
    #[serde(default)]
    agents: Option<Agents>,
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

/// Costs of the agents' processes.
#[derive(Clone, Copy, Debug, Default, Deserialize)]
#[serde(default)]
struct Agents {
    cycle_us: Option<TickTimes>,
    processes: Option<Usage>,
}

#[derive(Clone, Copy, Debug, Deserialize)]
struct Usage {
    count: u32,
    #[serde(default)]
    pss_kb: Option<u64>,
}

impl Summary {
    /// Median time of an agent's cycle, from its percept to its command; `None` in process, or unprofiled.
    pub(crate) fn control_cycle_us(&self) -> Option<f64> {
        Some(self.agents?.cycle_us?.p50)
    }

    /// Memory of an agent, what it shares with others counted by its share.
    pub(crate) fn pss_kb_per_agent(&self) -> Option<f64> {
        let usage = self.agents?.processes.filter(|usage| usage.count > 0)?;
        Some(usage.pss_kb? as f64 / f64::from(usage.count))
    }

    /// Time until everybody had joined; `None` in process.
    pub(crate) fn start_up_of_processes_s(&self) -> Option<f64> {
        self.start_up_s.filter(|_| self.agents.is_some())
    }

    /// Packets one robot heard in one tick, on average.
    pub(crate) fn heard_per_robot_and_tick(&self) -> f64 {
        // A run of n ticks ends with tick number n, having begun with tick 0.
        self.packets.heard as f64 / f64::from(self.robots) / f64::from(self.ticks + 1)
    }
}

/// A `lamplight` of some build; it finds its other programs beside itself.
#[derive(Debug)]
pub(crate) struct Program(PathBuf);

/// The program, and what it is to run.
#[derive(Debug)]
pub(crate) struct Lamplight {
    program: Program,
    scenario: PathBuf,
    sets: Vec<String>,
}

impl Lamplight {
    /// The one that lies in our own folder, so that it is of our own build.
    pub(crate) fn beside_us(scenario: &Path, sets: &[String]) -> anyhow::Result<Self> {
        ensure!(scenario.is_file(), "{} is missing; name one by --scenario", scenario.display());
        let program = Program::beside_us()?;
        Ok(Self { program, scenario: scenario.to_path_buf(), sets: sets.to_vec() })
    }

    /// Runs the scenario with `robots` robots at its own density, for `ticks` ticks. Once `stop` is raised, the run is
    /// told to end, and that is an error.
    pub(crate) fn run(
        &self,
        engine: Engine,
        robots: u32,
        ticks: u32,
        stop: &StopFlag,
    ) -> anyhow::Result<Summary> {
        let side_m = side_m(robots);
        let mut arguments = vec![self.scenario.display().to_string(), format!("--robots={robots}")];
        arguments.push(format!("--duration={}", f64::from(ticks) / TICKS_PER_S));
        arguments.push(format!("--set=arena.size_m=[{side_m}, {side_m}]"));
        arguments.extend(self.sets.iter().map(|set| format!("--set={set}")));
        self.program.run(engine, &arguments, stop)
    }
}

impl Program {
    /// The one that lies in our own folder.
    pub(crate) fn beside_us() -> anyhow::Result<Self> {
        let us = std::env::current_exe().context("cannot find our own program")?;
        Self::at(&us.with_file_name("lamplight"))
    }

    /// The one at `path`.
    pub(crate) fn at(path: &Path) -> anyhow::Result<Self> {
        ensure!(path.is_file(), "{} is missing; build all with `scripts/build`", path.display());
        Ok(Self(path.to_path_buf()))
    }

    /// Runs what `arguments` name: a scenario, and options. Once `stop` is raised, the run is told to end, and that is
    /// an error.
    pub(crate) fn run(
        &self,
        engine: Engine,
        arguments: &[String],
        stop: &StopFlag,
    ) -> anyhow::Result<Summary> {
        // Files, not pipes: nobody has to read them while the run lasts.
        let (mut output, mut log) = (tempfile::tempfile()?, tempfile::tempfile()?);
        // Only processes have a run with a name.
        let name = (engine == Engine::Lockstep).then(|| format!("--name={}", our_name()));
        let mut run = Command::new(&self.0)
            .arg("run")
            .args(arguments)
            .args(["--engine", engine.name(), "--json", "--quiet"])
            .args(name)
            .stdin(Stdio::null())
            .stdout(output.try_clone()?)
            .stderr(log.try_clone()?)
            .spawn()
            .with_context(|| format!("cannot start {}", self.0.display()))?;
        let mut told = false;
        let status = loop {
            if let Some(status) = run.try_wait()? {
                break status;
            }
            if stop.is_raised() && !told {
                kill_process(Pid::from_child(&run), Signal::TERM)?;
                told = true;
            }
            thread::sleep(RUN_POLL);
        };
        let log = read_back(&mut log)?;
        if !status.success() {
            return Err(reason(&log).unwrap_or_else(|| anyhow!("`lamplight run` ended with {status}")));
        }
        eprint!("{log}");
        let summary: Summary =
            serde_json::from_str(&read_back(&mut output)?).context("its summary is not ours")?;
        ensure!(summary.ended == "finished", "the run did not finish, it was {}", summary.ended);
        Ok(summary)
    }
}

fn read_back(file: &mut File) -> io::Result<String> {
    let mut text = String::new();
    file.rewind()?;
    file.read_to_string(&mut text)?;
    Ok(text)
}

/// The first error in what a failed run has said, with the lines that explain it.
fn reason(log: &str) -> Option<anyhow::Error> {
    let (_, error) = log.split_once("error: ")?;
    let lines: Vec<&str> =
        error.lines().take_while(|line| !line.starts_with("hint: ")).map(str::trim).collect();
    Some(anyhow!(lines.join("; ")))
}

/// Side of a square that gives `robots` robots the room they have in the scenario.
pub(crate) fn side_m(robots: u32) -> f64 {
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
    fn a_failed_run_says_why() {
        let log = "warning: slow\nerror: 9 robots are too many\n  open files: 20\nhint: take fewer\n";
        assert_eq!(reason(log).unwrap().to_string(), "9 robots are too many; open files: 20");
        assert!(reason("warning: slow\n").is_none());
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
