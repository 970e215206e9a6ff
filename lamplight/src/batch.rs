//! `lamplight batch`: many trials of a scenario, so that a figure is a distribution and not an anecdote.
//!
//! ```text
//! plan (what) -> workers (by whom) -> folder (kept in order) -> summary (statistics)
//! ```

mod columns;
mod folder;
mod options;
mod plan;
mod summary;
mod workers;

use std::time::{Duration, Instant};

use anyhow::anyhow;
use logging::Format;
use observe::progress::Meter;
use processes::signals::exit_status;

use self::{
    folder::{Done, Folder},
    plan::Plan,
    workers::{Workers, named},
};
use crate::{failure::Failure, log, status::Status, stdout::say};

pub(crate) use self::options::BatchArgs;

pub(crate) fn batch(args: &BatchArgs) -> Result<Status, Failure> {
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
            lost.push(named(&plan, &trial));
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
            Ok(Status(exit_status(signal)))
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
                0 => Ok(Status::SUCCESS),
                count => Err(Failure::Run(anyhow!(
                    "{count} of {total} trials lost agents each time they were played, and are left out of the \
                     statistics: {}; what did it is told above; if it was an accident, the same command plays them again",
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
