//! Trace of a run (`--trace FILE`): what happens when, for viewers such as `ui.perfetto.dev` or `chrome://tracing`.
//!
//! In:  whole cycles of agents, each tick with its moments, its percepts and the ledger, the fault plan, incidents.
//! Out: a file in the Trace Event Format: a track for the arena and one per robot, cycles and their stages as slices,
//!      packets as arrows, faults and incidents as instants. It has a bound.

mod bound;
mod events;
mod file;
mod options;
mod packets;
mod recording;

use anyhow::Context;
use engine::{Incident, Observer, ObserverError, TickView, summary::Summary};
use profile::CycleTimes;
use protocol::{percept::Tick, setup::Mode};
use scenario::{ProcessFault, Scenario};
use serde_json::{Map, json};

pub use options::{TraceError, TraceOptions};

use bound::{Bound, about_left_out};
use file::TraceFile;
use recording::Recording;

/// Draws the trace of a run.
#[derive(Debug)]
pub struct Trace {
    recording: Recording,
}

impl Trace {
    /// Begins the trace that `options` ask for, if they do.
    ///
    /// # Errors
    /// If there can be none, see [`TraceOptions::check`], or its file cannot be made.
    pub fn begin(options: &TraceOptions, scenario: &Scenario, mode: Mode) -> anyhow::Result<Option<Self>> {
        let Some(path) = &options.file else { return Ok(None) };
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
        Ok(Some(Self { recording: Recording::new(Bound::new(file), mode, robots, is_traced) }))
    }
}

impl Observer for Trace {
    fn tick_begins(&mut self, tick: Tick, process_faults: &[ProcessFault]) {
        self.recording.tick_begins(tick, process_faults);
    }

    fn ticked(&mut self, tick: &TickView<'_>) -> Result<(), ObserverError> {
        if let Some(percepts) = tick.percepts() {
            self.recording.hand_out(tick.tick(), percepts);
        }
        if let Some(stamps) = tick.stamps() {
            self.recording.tick_ends(stamps, tick.ledger());
        }
        Ok(())
    }

    fn cycles(&mut self, cycles: &[CycleTimes]) {
        self.recording.cycles(cycles);
    }

    fn incident(&mut self, incident: &Incident) {
        self.recording.incident(incident);
    }

    fn summarize(&mut self, end: &TickView<'_>, _: &mut Summary) -> Result<(), ObserverError> {
        // A run that fails does so within a tick, of which nobody has been told that it has passed.
        if let Some(stamps) = end.stamps() {
            self.recording.tick_ends(stamps, end.ledger());
        }
        self.recording.finish().map_err(|error| ObserverError::Broken(error.to_string()))
    }
}
