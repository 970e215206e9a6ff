//! `lamplight shrink`: the few faults and robots that a failure needs.
//!
//! In:  a scenario that shows a failure, and the failure as an [`Expression`] over `summary.json`.
//! Out: a scenario file that shows it as well, with fewer faults and robots.
//!
//! Candidates run one after the other, so the same command finds the same: in process, or as processes where programs think.

mod ddmin;
mod expression;
mod journal;
mod swarm;

use std::path::{Path, PathBuf};

use anyhow::{Context, anyhow};
use arena::{placement, plan_warnings::warnings};
use clap::Args;
use engine::StopFlag;
use logging::Format;
use observe::progress::Meter;
use options::ScenarioOptions;
use processes::signals::{exit_status, raise_on_stop};
use protocol::setup::Mode;
use scenario::{Fault, Scenario};
use serde_json::Value;

pub(crate) use self::expression::path;
use self::{
    ddmin::ddmin,
    expression::Expression,
    journal::Journal,
    swarm::{fewest, with_robots},
};
use crate::{
    failure::Failure, in_process, limits, log, name, status::Status, stdout::say, workshop::Workshop,
};

#[derive(Args, Debug)]
pub(crate) struct ShrinkArgs {
    #[command(flatten)]
    options: ScenarioOptions,

    /// The failure, as comparisons of values of summary.json; it must show in the whole scenario
    #[arg(long, value_name = "EXPR", long_help = UNTIL)]
    until: String,

    /// Write the smaller scenario to this new file [default: that of the scenario, with -shrunk behind its name, in this
    /// folder]
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,

    /// No progress and no notes on standard error, only warnings and errors
    #[arg(long, short)]
    quiet: bool,
}

const UNTIL: &str = "\
The failure, as comparisons of values of summary.json; it must show in the whole scenario

    mean_error_m > 0.05
    packets.heard < 100 && robots_alive == 50
    converged_at_s == null
    ended == \"failed\" or (mean_lamp_distance_m > 1 and not cost_h < 80)
    faults.0.fired_tick >= 600

Comparisons are < <= > >= == != between values of the summary, numbers, \"texts\", true, false and null; \
they are joined by && (and), || (or), ! (not) and parentheses. What is not known is null: it equals null alone, \
and neither < nor its opposite holds of it. Lengths are in meters (_m), times in \
seconds of virtual time (_s). Faults are numbered in the plan as it is then: as faults are left out, \
others move up. A failure of so many robots says of how many, or fewer robots show it at once: \
robots == 50 && robots_alive < 49.";

pub(crate) fn shrink(args: &ShrinkArgs) -> Result<Status, Failure> {
    log::begin(args.quiet, Format::Text);
    let expression: Expression =
        args.until.parse().with_context(|| format!("--until '{}'", args.until)).map_err(Failure::Usage)?;
    let mut whole = args.options.load().map_err(Failure::usage)?;
    let workshop = if in_process::can_play(&whole) {
        in_process::prepare(&mut whole, in_process::INSTEAD).map_err(Failure::usage)?;
        None
    } else {
        whole.find_controllers().map_err(Failure::usage)?;
        limits::prepare(whole.robot_count(), whole.plane(Mode::Lockstep)).map_err(Failure::Usage)?;
        Some(Workshop::open("shrink").map_err(Failure::Run)?)
    };
    let poses = placement::start(&whole).map_err(Failure::usage)?;
    log::warn_of(&warnings(&whole, &poses));
    let stem = args.options.file.file_stem().unwrap_or_default().to_string_lossy();
    let out = args.out.clone().unwrap_or_else(|| format!("{}-shrunk.toml", name::plain(&stem)).into());
    refuse_to_overwrite(&out)?;
    let stop = StopFlag::default();
    raise_on_stop(&stop).context("cannot listen for signals").map_err(Failure::Run)?;
    let (robots, faults) = (whole.robot_count(), whole.fault.len());

    let mut search = Search {
        journal: Journal::open(journal_path(&out)).map_err(Failure::usage)?,
        meter: Meter::begin(None, args.quiet),
        expression,
        workshop,
        stop,
        tries: 0,
        left: (faults, robots),
    };
    if search.journal.len() > 0 {
        tracing::info!(
            "going on from {} verdicts in {}",
            search.journal.len(),
            search.journal.path().display()
        );
    }
    let outcome = search.first_look(&whole).and_then(|()| search.smallest(whole));
    let Search { journal, meter, expression, tries, .. } = search;
    drop(meter);
    match outcome {
        Ok(small) => {
            let text = result(&small, &args.options.file, &expression, (faults, robots));
            let found = account(&small, &expression, (faults, robots), tries);
            match files::create(&out, &text) {
                Ok(()) => {
                    journal.remove().map_err(Failure::run)?;
                    say(&format!("{found}saved as {}\n", out.display()))?;
                    Ok(Status::SUCCESS)
                }
                Err(error) if error.is_already_there() => Err(Failure::Usage(already_there(&out))),
                Err(error) => {
                    // What took so long to find is not lost with the disk.
                    say(&format!("{found}\n{text}"))?;
                    Err(error.into())
                }
            }
        }
        Err(Halt::Interrupted(signal)) => {
            if journal.len() == 0 {
                journal.remove().map_err(Failure::run)?;
                eprintln!("interrupted before anything was found out");
                return Ok(Status(exit_status(signal)));
            }
            eprintln!(
                "interrupted after {tries} tries; the same command goes on from there (verdicts are kept in {})",
                journal.path().display()
            );
            Ok(Status(exit_status(signal)))
        }
        Err(Halt::Failure(failure)) => {
            // Nothing was found out that the whole scenario does not say at once.
            if journal.len() == 0 {
                journal.remove().map_err(Failure::run)?;
            }
            Err(failure)
        }
    }
}

/// Why a search ends without a result.
enum Halt {
    Interrupted(i32),
    Failure(Failure),
}

struct Search {
    expression: Expression,
    journal: Journal,
    /// Where candidates run as processes, if they have to.
    workshop: Option<Workshop>,
    stop: StopFlag,
    meter: Meter,
    /// Candidates run.
    tries: u64,
    /// Faults and robots of the smallest scenario that shows the failure so far.
    left: (usize, u32),
}

impl Search {
    /// Does the whole scenario show the failure?
    fn first_look(&mut self, whole: &Scenario) -> Result<(), Halt> {
        let summary = self.summary(whole)?.map_err(|error| Halt::Failure(Failure::Run(error)))?;
        let expression = &self.expression;
        expression
            .check(&summary)
            .with_context(|| format!("--until '{expression}'"))
            .map_err(|error| Halt::Failure(Failure::Usage(error)))?;
        if expression.holds(&summary) {
            return Ok(());
        }
        let found = expression.findings(&summary);
        let found = if found.is_empty() { format!("{expression} is false") } else { found };
        Err(Halt::Failure(Failure::Run(anyhow!("the failure does not show: {found}"))))
    }

    /// Fewer faults, then fewer robots, and again until nothing changes.
    fn smallest(&mut self, whole: Scenario) -> Result<Scenario, Halt> {
        let mut small = whole;
        loop {
            let faults = ddmin(&small.fault.clone(), |faults| {
                self.shows(&Scenario { fault: faults.to_vec(), ..small.clone() })
            })?;
            let settled = faults.len() == small.fault.len();
            small.fault = faults;
            let robots = fewest(small.robot_count(), |robots| match with_robots(&small, robots) {
                Some(candidate) => self.shows(&candidate),
                None => Ok(false),
            })?;
            if robots == small.robot_count() && settled {
                return Ok(small);
            }
            small = with_robots(&small, robots).unwrap_or(small);
        }
    }

    /// Whether a candidate is a scenario and shows the failure.
    fn shows(&mut self, candidate: &Scenario) -> Result<bool, Halt> {
        let text = candidate.to_toml();
        let Ok(candidate) = Scenario::parse("candidate", &text, &[]) else { return Ok(false) };
        let key = journal::key(&self.expression.to_string(), &text);
        let shows = match self.journal.verdict(&key) {
            Some(shows) => shows,
            None => {
                let shows = self.summary(&candidate)?.is_ok_and(|summary| self.expression.holds(&summary));
                self.journal.record(key, shows);
                shows
            }
        };
        if shows {
            self.left = (candidate.fault.len(), candidate.robot_count());
        }
        Ok(shows)
    }

    /// Runs a candidate; the inner error says why it cannot be run.
    fn summary(&mut self, candidate: &Scenario) -> Result<anyhow::Result<Value>, Halt> {
        let summary = match &self.workshop {
            None => in_process::run_quietly(candidate, &self.stop, Vec::new()),
            Some(workshop) => {
                let ran = workshop.run(&candidate.to_toml(), candidate.seed, &self.stop);
                ran.map_err(|error| Halt::Failure(error.into()))?.map_err(anyhow::Error::msg)
            }
        };
        if let Some(signal) = self.stop.signal() {
            return Err(Halt::Interrupted(signal));
        }
        self.tries += 1;
        let (tries, (faults, robots)) = (self.tries, self.left);
        self.meter.show(tries, || format!("{tries} tries: {faults} faults and {robots} robots left"));
        Ok(summary.and_then(|summary| Ok(serde_json::to_value(summary)?)))
    }
}

fn journal_path(out: &Path) -> PathBuf {
    let mut path = out.as_os_str().to_owned();
    path.push(".journal");
    path.into()
}

fn refuse_to_overwrite(out: &Path) -> Result<(), Failure> {
    match out.symlink_metadata() {
        Ok(_) => Err(Failure::Usage(already_there(out))),
        Err(_) => Ok(()),
    }
}

fn already_there(out: &Path) -> anyhow::Error {
    anyhow!("{} is there already; give --out the name of a new file, or remove this one", out.display())
}

/// The result, with a line about where it comes from.
fn result(
    small: &Scenario,
    origin: &Path,
    expression: &Expression,
    (faults, robots): (usize, u32),
) -> String {
    let one_line = |text: String| text.replace(|c: char| c.is_control(), " ");
    let origin = one_line(origin.display().to_string());
    let expression = one_line(expression.to_string());
    format!(
        "# Shrunk from {origin} ({faults} faults, {robots} robots) by `lamplight shrink`; shows\n\
         #   {expression}\n\n{}",
        small.to_toml()
    )
}

/// Account of what was found, for a person.
fn account(small: &Scenario, expression: &Expression, (faults, robots): (usize, u32), tries: u64) -> String {
    let mut text = format!(
        "{} of {faults} faults and {} of {robots} robots still show it ({expression}), found in {tries} tries\n",
        small.fault.len(),
        small.robot_count()
    );
    for fault in &small.fault {
        text += &format!("  {}\n", in_one_line(fault));
    }
    text
}

/// `kill: at_s = 3.0, robots = "7"`.
fn in_one_line(fault: &Fault) -> String {
    let value = serde_json::to_value(fault).expect("a fault is plain data");
    let given = value.as_object().into_iter().flatten();
    let keys: Vec<String> = given
        .filter(|(key, value)| *key != "kind" && !value.is_null())
        .map(|(key, value)| format!("{key} = {value}"))
        .collect();
    match keys.is_empty() {
        true => fault.name().into(),
        false => format!("{}: {}", fault.name(), keys.join(", ")),
    }
}
