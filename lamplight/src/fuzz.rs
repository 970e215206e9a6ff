//! `lamplight fuzz`: random fault plans, and what must hold whatever they do.

mod invariants;
mod plan;

use std::{
    collections::BTreeMap,
    fs,
    path::{Path, PathBuf},
    time::Instant,
};

use anyhow::{Context, anyhow};
use arena::plan_warnings::warnings;
use clap::{Args, ValueEnum};
use engine::{StopFlag, summary::Summary};
use files::WriteError;
use logging::Format;
use observe::progress::Meter;
use options::ScenarioOptions;
use processes::signals::{exit_status, raise_on_stop};
use scenario::{Positive, SEED_MAX, Scenario, Seed};
use serde::Serialize;

use self::invariants::Invariants;
use protocol::setup::Mode;

use crate::{
    failure::Failure, in_process, limits, log, name, shrink, status::Status, stdout::say, workshop::Workshop,
};

/// Shortest time to wait for a robot, in seconds of wall time: a busy machine is no failure.
const PATIENCE_S: f64 = 60.0;

/// Way out for scenarios in which programs think for robots.
const INSTEAD: &str =
    "this plays robots in one process, without programs; `lamplight fuzz` with --engine both plays them";

/// Engines that run each scenario.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
enum Engines {
    /// In this process and as a process per robot, or twice as processes if programs think for robots: both must agree
    #[default]
    Both,
    /// In this process alone: many more runs in the same time
    InProcess,
}

#[derive(Args, Debug)]
pub(crate) struct FuzzArgs {
    #[command(flatten)]
    options: ScenarioOptions,

    /// Number of runs
    #[arg(long, value_name = "K", default_value_t = 100, value_parser = clap::value_parser!(u64).range(1..))]
    runs: u64,

    /// Engines that run each scenario
    #[arg(long, value_enum, default_value_t)]
    engine: Engines,

    /// Save the scenarios of failed runs in this folder, for `lamplight run` and `lamplight shrink`
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,

    /// No progress and no notes on standard error, only warnings and errors
    #[arg(long, short)]
    quiet: bool,
}

pub(crate) fn fuzz(args: &FuzzArgs) -> Result<Status, Failure> {
    log::begin(args.quiet, Format::Text);
    let (base, plays_in_process) = base(args)?;
    // It has no faults, whose robots would have to be somewhere.
    log::warn_of(&warnings(&base, &[]));
    if args.engine == Engines::Both {
        limits::prepare(base.robot_count(), base.plane(Mode::Lockstep)).map_err(Failure::Usage)?;
    }
    if let Some(folder) = &args.out {
        fs::create_dir_all(folder)
            .with_context(|| format!("cannot make the folder {}; give --out another one", folder.display()))
            .map_err(Failure::Usage)?;
    }
    let stop = StopFlag::default();
    raise_on_stop(&stop).context("cannot listen for signals").map_err(Failure::Run)?;
    let workshop = match args.engine {
        Engines::Both => Some(Workshop::open("fuzz").map_err(Failure::Run)?),
        Engines::InProcess => None,
    };
    let mut judge = Judge { plays_in_process, workshop, stop: stop.clone(), repeated: 0 };

    let began = Instant::now();
    let mut meter = Meter::begin(Some(args.runs), args.quiet);
    let (mut done, mut failed) = (0, 0);
    let mut reached = BTreeMap::new();
    for run in 0..args.runs {
        let seed = base.seed.after(run).expect("the last run's seed was checked");
        let scenario = plan::drawn(&base, seed);
        let outcome = judge.check(&scenario);
        if stop.is_raised() {
            break;
        }
        done += 1;
        let Judged { summary, failure } = outcome?;
        for (name, sometimes) in summary.iter().flat_map(|summary| &summary.properties.sometimes) {
            *reached.entry(name.clone()).or_insert(false) |= sometimes.reached_by > 0;
        }
        if let Some(what) = failure {
            failed += 1;
            let text = report(args, &scenario, summary.as_ref(), &what);
            meter.aside(|| say(&text))?;
        }
        meter.show(done, || {
            let left_s = began.elapsed().as_secs_f64() / done as f64 * (args.runs - done) as f64;
            format!("{done} of {} runs, {failed} failed, about {left_s:.0} s left", args.runs)
        });
    }
    drop(meter);
    for (name, _) in reached.iter().filter(|(_, is_reached)| !**is_reached) {
        say(&format!("never reached: sometimes \"{name}\"\n"))?;
    }
    let repeated = told(judge.repeated);
    match stop.signal() {
        Some(signal) => {
            let all = args.runs;
            say(&format!("{done} of {all} runs, {failed} failed{repeated}; interrupted\n"))?;
            Ok(Status(exit_status(signal)))
        }
        None => {
            say(&format!("{done} runs, {failed} failed{repeated}\n"))?;
            Ok(if failed > 0 { Status::FAILURE } else { Status::SUCCESS })
        }
    }
}

/// The scenario that all runs vary: short, patient, without faults of its own; and whether it can be played in this process.
fn base(args: &FuzzArgs) -> Result<(Scenario, bool), Failure> {
    let mut base = args.options.load().map_err(Failure::usage)?;
    let plays_in_process = in_process::can_play(&base);
    match plays_in_process || args.engine == Engines::InProcess {
        true => in_process::prepare(&mut base, INSTEAD),
        false => base.find_controllers(),
    }
    .map_err(Failure::usage)?;
    if base.seed.after(args.runs - 1).is_none() {
        return Err(Failure::Usage(anyhow!(
            "--runs {} from seed {} on go beyond the highest seed, {SEED_MAX}; use fewer runs or a lower --seed",
            args.runs,
            base.seed
        )));
    }
    if args.options.duration.is_none() {
        base.duration_s = base.fuzz.run_s(base.duration_s);
    }
    let patient = |timeout_s: f64| Positive::new(timeout_s.max(PATIENCE_S));
    let processes = &mut base.processes;
    processes.hang_timeout_s = patient(processes.hang_timeout_s.get()).unwrap_or(processes.hang_timeout_s);
    processes.join_timeout_s = patient(processes.join_timeout_s.map_or(PATIENCE_S, Positive::get));
    base.fault.clear();
    // A shorter run may be too short for the channel's cycle, or no whole number of steps.
    let settled = Scenario::parse(&args.options.file.display().to_string(), &base.to_toml(), &[]);
    let settled = settled.map_err(|error| {
        Failure::Usage(anyhow!("with duration_s = {}: {}", base.duration_s.get(), error.message))
    })?;
    Ok((settled, plays_in_process))
}

/// How many runs were repeated, if any.
fn told(repeated: u64) -> String {
    match repeated {
        0 => String::new(),
        count => format!(", {count} repeated because they lost processes"),
    }
}

/// Runs scenarios and says what does not hold of them.
struct Judge {
    plays_in_process: bool,
    /// Where they run as processes, if they do.
    workshop: Option<Workshop>,
    stop: StopFlag,
    /// How many runs were repeated because they lost processes.
    repeated: u64,
}

/// Outcome of a scenario.
struct Judged {
    /// Of its first run, if that came to an end.
    summary: Option<Summary>,
    /// All that does not hold, if something does not.
    failure: Option<String>,
}

impl Judge {
    /// Runs one scenario by one engine or both, or twice by one.
    ///
    /// # Errors
    /// If it cannot be run, through no fault of its own.
    fn check(&mut self, scenario: &Scenario) -> Result<Judged, Failure> {
        let text = scenario.to_toml();
        let first = match self.plays_in_process {
            true => in_this_process(&text, &self.stop),
            false => self.as_processes(&text, scenario.seed)?,
        };
        let summary = match first {
            Ok(summary) => summary,
            Err(what) => return Ok(Judged { summary: None, failure: Some(what) }),
        };
        let mut verdict = invariants::at_end(&summary);
        if verdict.is_ok() && self.workshop.is_some() {
            let again = self.as_processes(&text, scenario.seed)?;
            verdict = again.and_then(|again| agree(&summary, &again));
        }
        Ok(Judged { summary: Some(summary), failure: verdict.err() })
    }

    /// Runs a scenario as processes, once more if it loses some; the inner error says why there is no summary.
    fn as_processes(&mut self, text: &str, seed: Seed) -> Result<Result<Summary, String>, Failure> {
        let workshop = self.workshop.as_ref().expect("programs are played by both engines only");
        let run = || workshop.run(text, seed, &self.stop);
        let outcome = run()?;
        let why = outcome.as_ref().map_or_else(|error| Some(error.clone()), lost);
        match why.filter(|_| !self.stop.is_raised()) {
            None => Ok(outcome),
            Some(why) => {
                // Killed by hand, or by the system where memory is short. What is no accident shows again.
                tracing::warn!("seed {seed} is repeated: {why}");
                self.repeated += 1;
                Ok(run()?)
            }
        }
    }
}

/// Runs a scenario in this process, looking at each tick; the error says what does not hold.
fn in_this_process(text: &str, stop: &StopFlag) -> Result<Summary, String> {
    let scenario = Scenario::parse("drawn", text, &[])
        .map_err(|error| format!("the scenario that was drawn is refused: {error}"))?;
    in_process::run_quietly(&scenario, stop, vec![&mut Invariants::of(&scenario)])
        .map_err(|error| format!("{error:#}"))
}

/// The first agent that was lost without having been meant to be.
fn lost(summary: &Summary) -> Option<String> {
    summary.incidents.first().map(|incident| incident.what.clone())
}

/// Do both runs say the same, and the processes nothing that was not planned?
fn agree(first: &Summary, processes: &Summary) -> Result<(), String> {
    invariants::at_end(processes).map_err(|what| format!("as processes: {what}"))?;
    same("digest", &processes.digest, &first.digest)?;
    same("packets", &processes.end.packets, &first.end.packets)?;
    same("robots_alive", &processes.end.robots_alive, &first.end.robots_alive)?;
    same("faults", &processes.faults, &first.faults)?;
    same("properties", &processes.properties, &first.properties)?;
    same("contacts_unsolved", &processes.contacts_unsolved, &0)
}

fn same<T: PartialEq + Serialize>(key: &str, found: &T, expected: &T) -> Result<(), String> {
    let shown = |value| serde_json::to_string(value).expect("parts of a summary are plain data");
    match found == expected {
        true => Ok(()),
        false => Err(format!("as processes, {key} is {}, not {}", shown(found), shown(expected))),
    }
}

/// Report of a failed run: what broke, how to repeat it, where its scenario is, and how to shrink it.
fn report(args: &FuzzArgs, scenario: &Scenario, summary: Option<&Summary>, what: &str) -> String {
    let mut text =
        format!("seed {} failed: {what}\n  repeat: {}\n", scenario.seed, replay(args, scenario.seed));
    if let Some(folder) = &args.out {
        match save(folder, scenario) {
            Ok(path) => {
                text += &format!("  saved as {}\n", path.display());
                for until in summary.iter().flat_map(|summary| questions(summary)) {
                    let words = ["lamplight", "shrink", &path_argument(&path), "--until", &until];
                    text += &format!("  shrink: {}\n", words.map(quoted).join(" "));
                }
            }
            // The command above repeats it all the same.
            Err(error) => text += &format!("  not saved: {error}\n"),
        }
    }
    text
}

/// Questions that `lamplight shrink` may be asked of a failed run: that a robot dies, and that what must hold does not.
fn questions(summary: &Summary) -> impl Iterator<Item = String> {
    let died = (!summary.incidents.is_empty()).then(|| "incidents.0.tick >= 0".into());
    let broken = summary.properties.broken();
    died.into_iter()
        .chain(broken.map(|(name, _)| format!("{} > 0", shrink::path(&["always", name, "broken_by"]))))
}

/// The one command that repeats the run of this seed.
fn replay(args: &FuzzArgs, seed: Seed) -> String {
    let options = &args.options;
    let mut words = vec!["lamplight".into(), "fuzz".into(), path_argument(&options.file)];
    let mut add = |option: &str, value: String| words.extend([option.into(), value]);
    add("--runs", "1".into());
    add("--seed", seed.to_string());
    let engine = args.engine.to_possible_value().expect("no engine is hidden");
    add("--engine", engine.get_name().into());
    options.controllers.iter().for_each(|controller| add("--controller", controller.clone()));
    options.sets.iter().for_each(|set| add("--set", set.clone()));
    options.robots.iter().for_each(|robots| add("--robots", robots.to_string()));
    options.duration.iter().for_each(|duration| add("--duration", duration.to_string()));
    words.iter().map(|word| quoted(word)).collect::<Vec<_>>().join(" ")
}

/// A file, as a command line names it even if its name begins with a dash.
fn path_argument(file: &Path) -> String {
    let name = file.display().to_string();
    if name.starts_with('-') { format!("./{name}") } else { name }
}

/// As a shell reads it.
fn quoted(word: &str) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || "_-./=,:@%+".contains(c);
    match !word.is_empty() && word.chars().all(plain) {
        true => word.into(),
        false => format!("'{}'", word.replace('\'', r"'\''")),
    }
}

/// Writes the scenario of a failed run to a file of its own.
fn save(folder: &Path, scenario: &Scenario) -> Result<PathBuf, WriteError> {
    let stem = format!("{}-seed-{}", name::plain(&scenario.name), scenario.seed);
    let names =
        std::iter::once(format!("{stem}.toml")).chain((2..).map(|copy| format!("{stem}-{copy}.toml")));
    for path in names.map(|name| folder.join(name)) {
        match files::create(&path, scenario.to_toml()) {
            Ok(()) => return Ok(path),
            Err(error) if error.is_already_there() => {}
            Err(error) => return Err(error),
        }
    }
    unreachable!("there is always one more number")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_are_quoted_where_a_shell_would_read_them_otherwise() {
        assert_eq!(quoted("channel.range_m=0.8"), "channel.range_m=0.8");
        assert_eq!(quoted("a b"), "'a b'");
        assert_eq!(quoted("it's"), r"'it'\''s'");
        assert_eq!(quoted("fuzz.kinds=[\"kill\"]"), "'fuzz.kinds=[\"kill\"]'");
        assert_eq!(quoted(""), "''");
    }

    #[test]
    fn a_file_is_no_option_whatever_its_name() {
        assert_eq!(path_argument(Path::new("-draft.toml")), "./-draft.toml");
        assert_eq!(path_argument(Path::new("a/-b")), "a/-b");
    }
}
