//! `summary.json`: a run in one object. Tools rely on its keys.

use arena::metrics::Metrics;
use hdrhistogram::Histogram;
use protocol::setup::Mode;
use serde::Serialize;

use crate::squad::Incident;

/// How a run ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Ending {
    /// It ran for its duration.
    Finished,
    /// It was to stop at convergence, and did.
    Converged,
    /// Somebody stopped it.
    Interrupted,
    /// It could not go on.
    Failed,
}

/// Wall time of a tick, microseconds.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct TickTimes {
    /// Median.
    pub p50: f64,
    /// 90th percentile.
    pub p90: f64,
    /// 99th percentile.
    pub p99: f64,
    /// Longest.
    pub max: f64,
}

impl TickTimes {
    /// From a histogram of nanoseconds.
    pub fn of(nanoseconds: &Histogram<u64>) -> Self {
        let us = |ns: u64| ns as f64 / 1e3;
        let at = |quantile| us(nanoseconds.value_at_quantile(quantile));
        Self { p50: at(0.5), p90: at(0.9), p99: at(0.99), max: us(nanoseconds.max()) }
    }
}

/// A planned fault and what became of it.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Fault {
    /// Kind of the fault.
    pub kind: String,
    /// When it was to strike.
    pub planned_tick: u64,
    /// When it did.
    pub fired_tick: Option<u64>,
}

/// A run in one object.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Summary {
    /// Name of the scenario.
    pub scenario: String,
    /// Its seed.
    pub seed: u64,
    /// Number of robots at the start.
    pub robots: u32,
    /// `processes` or `in-process`.
    pub engine: String,
    /// How time passed.
    pub mode: Mode,
    /// How the run ended.
    pub ended: Ending,
    /// Why it failed, if it did.
    pub failure: Option<String>,
    /// Steps of virtual time.
    pub ticks: u64,
    /// The same in seconds.
    pub virtual_time_s: f64,
    /// Seconds from the first tick to the last.
    pub wall_time_s: f64,
    /// Seconds until all robots were there.
    pub start_up_s: f64,
    /// Virtual over wall time.
    pub real_time_factor: f64,
    /// Hash over all ticks: equal digests, equal runs.
    pub digest: String,
    /// First time the mean ‖ê‖ was below the scenario's tolerance.
    pub converged_at_s: Option<f64>,
    /// Commands refused over all robots.
    pub commands_refused: u64,
    /// The swarm at the end, and its packets over the whole run.
    #[serde(flatten)]
    pub end: Metrics,
    /// Planned faults.
    pub faults: Vec<Fault>,
    /// Unplanned events.
    pub incidents: Vec<Incident>,
    /// Wall time of a tick.
    pub tick_us: TickTimes,
}

impl Summary {
    /// As `summary.json` holds it.
    pub fn json(&self) -> String {
        let mut text = serde_json::to_string_pretty(self).expect("a summary is plain data");
        text.push('\n');
        text
    }
}
