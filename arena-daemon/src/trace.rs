//! Trace of a run (`--trace FILE`): what happens when, for viewers such as `ui.perfetto.dev` or `chrome://tracing`.
//!
//! In:  the cycles that a [`Recorder`](crate::profile::Recorder) has checked, what is handed out and answered, what the
//!      arena does, the fault plan and its ledger, incidents.
//! Out: a file in the Trace Event Format: a track for the arena and one per robot, cycles and their stages as slices,
//!      packets as arrows, faults and incidents as instants. It has a bound.
//!
//! Nothing of it reaches arena or agents. Without a trace it costs a look per call.

mod bound;
mod events;
mod file;
mod options;
mod packets;
mod recording;
mod squad;

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use anyhow::Context;
use arena::Arena;
use files::WriteError;
use protocol::setup::Mode;
use scenario::Scenario;
use serde_json::{Map, json};

pub use options::{TraceError, TraceOptions};
pub use squad::Traced;

use bound::{Bound, about_left_out};
use file::TraceFile;
use recording::Recording;

/// Shared handle to the recording of a trace; empty without a trace.
#[derive(Clone, Debug, Default)]
pub struct Tracer(Option<Arc<Mutex<Recording>>>);

impl Tracer {
    /// Begins the trace that `options` ask for, if they do.
    ///
    /// # Errors
    /// If there can be none, see [`TraceOptions::check`], or its file cannot be made.
    pub fn begin(options: &TraceOptions, scenario: &Scenario, mode: Mode) -> anyhow::Result<Self> {
        let Some(path) = &options.file else { return Ok(Self::default()) };
        options.check(scenario, true)?;
        let robots = scenario.robot_count();
        let traced = options.robots.as_ref().map_or(format!("0-{}", robots - 1), |set| set.to_string());
        let about = json!({
            "program": concat!("lamplight ", env!("CARGO_PKG_VERSION")),
            "scenario": scenario.name,
            "seed": scenario.seed,
            "mode": mode,
            "robots": robots,
            "robots_traced": traced,
        });
        let about = about.as_object().cloned().unwrap_or_default().into_iter().chain(about_left_out());
        let (first, bytes_max) = (Recording::first_events(), options.max_mb * 1_000_000);
        let file = TraceFile::begin(path, bytes_max, &first, Map::from_iter(about))
            .with_context(|| format!("--trace {}", path.display()))?;
        let is_traced = |index| options.robots.as_ref().is_none_or(|set| set.contains(index));
        let recording = Recording::new(Bound::new(file), mode, robots, is_traced);
        Ok(Self(Some(Arc::new(Mutex::new(recording)))))
    }

    /// Whether anybody is told.
    pub fn is_on(&self) -> bool {
        self.0.is_some()
    }

    /// The arena is through with a tick.
    pub fn tick_ends(&self, arena: &Arena) {
        self.with(|recording| recording.tick_ends(arena.ledger()));
    }

    /// The run is over: the rest is written.
    ///
    /// # Errors
    /// If the trace ends early, because it could not be written.
    pub fn finish(&self) -> Result<(), WriteError> {
        self.0.as_ref().map_or(Ok(()), |recording| lock(recording).finish())
    }

    /// Whether the cycles of robot `index` are of interest.
    pub(crate) fn traces(&self, index: usize) -> bool {
        self.0.as_ref().is_some_and(|recording| lock(recording).traces(index))
    }

    /// Tells something, if anybody is told.
    #[inline]
    pub(crate) fn with(&self, tell: impl FnOnce(&mut Recording)) {
        if let Some(recording) = &self.0 {
            tell(&mut lock(recording));
        }
    }
}

fn lock(recording: &Mutex<Recording>) -> MutexGuard<'_, Recording> {
    recording.lock().unwrap_or_else(PoisonError::into_inner)
}
