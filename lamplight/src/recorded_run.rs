//! A recording of a run, read from its beginning: what it is of comes first.

use std::{
    fs::File,
    io::BufReader,
    path::{Path, PathBuf},
};

use anyhow::{Context, bail};
use recording::{
    Entry, FORMAT, ReadError, Reader, Topic,
    lamplight::{Act, End, Run, Tick},
};
use scenario::{Scenario, ScenarioError};

use crate::failure::Failure;

/// Messages of a recording, whose first says what it is of.
pub(crate) struct Recording {
    path: PathBuf,
    pub(crate) run: Run,
    entries: Reader<BufReader<File>>,
}

impl Recording {
    /// Opens the recording at `path`.
    pub(crate) fn open(path: &Path) -> anyhow::Result<Self> {
        let file = File::open(path).with_context(|| format!("cannot read {}", path.display()))?;
        let mut recording =
            Self { path: path.into(), run: Run::default(), entries: Reader::new(BufReader::new(file)) };
        let first = recording.next()?.filter(|entry| entry.topic == Topic::Run);
        let Some(first) = first else {
            bail!("{} is no recording of a run, or was cut before its first second", path.display());
        };
        recording.run = recording.named(first.message())?;
        match recording.run.format {
            FORMAT => Ok(recording),
            other => bail!(
                "{} has format {other}, and this program (lamplight {}) reads {FORMAT}; it was recorded by lamplight {}",
                path.display(),
                env!("CARGO_PKG_VERSION"),
                recording.run.lamplight
            ),
        }
    }

    /// The next message, or `None` if there is no other that is whole.
    pub(crate) fn next(&mut self) -> anyhow::Result<Option<Entry>> {
        let next = self.entries.next_entry();
        self.named(next)
    }

    /// The next tick, or how the run ended; `None` if the recording was cut.
    pub(crate) fn next_tick(&mut self) -> anyhow::Result<Option<Step>> {
        while let Some(entry) = self.next()? {
            match entry.topic {
                Topic::Ticks => return self.named(entry.message()).map(|tick| Some(Step::Tick(tick))),
                Topic::End => return self.named(entry.message()).map(|end| Some(Step::End(end))),
                _ => {}
            }
        }
        Ok(None)
    }

    /// Whether it ended before its end, once it has.
    pub(crate) fn is_cut(&self) -> bool {
        self.entries.cut().is_some()
    }

    /// An error of one of its messages, with its name.
    pub(crate) fn fault(&self, error: ReadError) -> anyhow::Error {
        anyhow::Error::from(error).context(self.path.display().to_string())
    }

    pub(crate) fn named<T>(&self, outcome: Result<T, ReadError>) -> anyhow::Result<T> {
        outcome.with_context(|| self.path.display().to_string())
    }

    /// The scenario, as this program understands it.
    pub(crate) fn scenario(&self) -> Result<Scenario, ScenarioError> {
        Scenario::recorded(&self.path.display().to_string(), &self.run.scenario)
    }

    /// The scenario with what was done to the run as part of its fault plan.
    pub(crate) fn scenario_with_acts(&self) -> Result<Scenario, Failure> {
        let mut acted = None;
        let mut again = Self::open(&self.path).map_err(Failure::Usage)?;
        while let Some(entry) = again.next().map_err(Failure::Usage)? {
            if entry.topic == Topic::Acts {
                let act: Act = again.named(entry.message()).map_err(Failure::Usage)?;
                acted = act.scenario.or(acted);
            }
        }
        let text = acted.unwrap_or_else(|| self.run.scenario.clone());
        Scenario::recorded(&self.path.display().to_string(), &text).map_err(Failure::usage)
    }
}

/// A step of a recording.
pub(crate) enum Step {
    Tick(Tick),
    End(End),
}
