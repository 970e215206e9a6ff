//! `summary.json`: a run in one object. Tools rely on its keys.

use std::fmt;

use arena::{
    channel::{Crowding, closed_form::delivered_share},
    fault::ledger::Line,
    metrics::Metrics,
};
use hdrhistogram::Histogram;
use profile::Totals;
use protocol::{percept::Tick, setup::Mode};
use scenario::{Scenario, Sensor};
use serde::{Deserialize, Serialize};
use squad::Incident;

use crate::{pace::Lag, properties::Properties};

/// How a run ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
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

impl fmt::Display for Ending {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.serialize(f)
    }
}

/// Wall time of a tick, microseconds.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
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
    /// From a histogram of nanoseconds; `None` from an empty one.
    pub fn of(nanoseconds: &Histogram<u64>) -> Option<Self> {
        let us = |ns: u64| ns as f64 / 1e3;
        let at = |quantile| us(nanoseconds.value_at_quantile(quantile));
        let times = || Self { p50: at(0.5), p90: at(0.9), p99: at(0.99), max: us(nanoseconds.max()) };
        (!nanoseconds.is_empty()).then(times)
    }
}

/// An act upon the run.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct ActLine {
    /// The tick that it took effect at.
    pub tick: Tick,
    /// The act, in words.
    pub what: String,
}

/// A planned fault, what it did, and how the swarm took it.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Fault {
    /// Its line of the ledger.
    #[serde(flatten)]
    pub line: Line,
    /// How long it was felt.
    pub recovered: Recovered,
}

/// When a fault was no longer felt.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Recovered {
    /// Ticks from the fault until the mean estimated error was back; `None` if it was not, or nobody looked.
    pub mean_error_ticks: Option<Tick>,
    /// Ticks from the fault until the coverage cost H was back; `None` if it was not, or nobody looked.
    pub cost_h_ticks: Option<Tick>,
}

/// How packets fared in the crowd: what is heard of those that nothing but other packets stops.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Delivered {
    /// Share that got through.
    pub share: f64,
    /// Share by the closed form of the access scheme for the same crowd, where one is known.
    pub predicted: Option<f64>,
    /// The same by number of disturbers, if the scenario asks for it.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub by_disturbers: Vec<DeliveredRow>,
}

/// Packets that the same number of robots could disturb.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct DeliveredRow {
    /// How many robots could (in half duplex the listener itself is one).
    pub disturbers: u32,
    /// Packets at listeners.
    pub packets: u64,
    /// Share that got through.
    pub share: f64,
    /// Share by the closed form.
    pub predicted: Option<f64>,
}

impl Delivered {
    /// Returns what a channel has counted; `None` if nothing.
    pub fn of(crowding: &Crowding, scenario: &Scenario) -> Option<Self> {
        let row = |(disturbers, packets, through)| DeliveredRow {
            disturbers,
            packets,
            share: through as f64 / packets as f64,
            predicted: delivered_share(&scenario.channel, disturbers),
        };
        let rows: Vec<DeliveredRow> = crowding.iter().map(row).collect();
        let packets: u64 = rows.iter().map(|row| row.packets).sum();
        let mean = |value: &dyn Fn(&DeliveredRow) -> Option<f64>| {
            rows.iter()
                .map(|row| Some(value(row)? * row.packets as f64 / packets as f64))
                .sum::<Option<f64>>()
        };
        let share = mean(&|row| Some(row.share)).filter(|_| packets > 0)?;
        let predicted = mean(&|row| row.predicted);
        let by_disturbers = if scenario.output.crowding { rows } else { Vec::new() };
        Some(Self { share, predicted, by_disturbers })
    }
}

/// A run in one object.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Summary {
    /// Name of the scenario.
    pub scenario: String,
    /// Its seed.
    pub seed: u64,
    /// Number of robots at the start.
    pub robots: u32,
    /// Sensors that robots are granted, beside packets.
    pub granted: Vec<Sensor>,
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
    /// Virtual over wall time; `null` if no time has passed.
    pub real_time_factor: Option<f64>,
    /// Hash over all ticks: equal digests, equal runs.
    pub digest: String,
    /// First time the mean ‖ê‖ was below the scenario's tolerance, every robot that took part having one.
    pub converged_at_s: Option<f64>,
    /// How often bodies stayed where they were because nobody could say how their contacts are kept; 0 in a sound run.
    pub contacts_unsolved: u64,
    /// How often, tick by tick, a group of bodies in contact moved in steps longer than they should be: bodies do not
    /// overlap, but where they end is less certain. 0 if `step_s` is short enough for their speeds and nobody is jammed.
    pub contacts_coarse: u64,
    /// Commands refused over all robots.
    pub commands_refused: u64,
    /// The swarm at the end, and its packets over the whole run.
    #[serde(flatten)]
    pub end: Metrics,
    /// How packets fared in the crowd; `null` on a channel where they never meet.
    pub delivered: Option<Delivered>,
    /// The fault ledger: planned faults and what became of them.
    pub faults: Vec<Fault>,
    /// Unplanned events.
    pub incidents: Vec<Incident>,
    /// Acts upon the run; left out if there were none.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub acts: Vec<ActLine>,
    /// Properties that controllers state, and what became of them.
    #[serde(flatten)]
    pub properties: Properties,
    /// Wall time of a tick; `null` if none has passed.
    pub tick_us: Option<TickTimes>,
    /// In real time, how it went with the wall clock; else `null`.
    pub lag: Option<Lag>,
    /// Measurements of the agents; `null` if nobody measured, as in process.
    pub agents: Option<Totals>,
    /// Results that could not be written whole, and why. Those that fail after `summary.json` are in it only if there
    /// was room to write it again.
    pub unwritten: Vec<String>,
}

impl Summary {
    /// Why the command that has run it fails: the run did, or not all it leaves could be written.
    pub fn trouble(&self) -> Option<String> {
        let all: Vec<&str> = self.failure.iter().chain(&self.unwritten).map(String::as_str).collect();
        (!all.is_empty()).then(|| all.join("; "))
    }

    /// As `summary.json` holds it.
    pub fn json(&self) -> String {
        let mut text = serde_json::to_string_pretty(self).expect("a summary is plain data");
        text.push('\n');
        text
    }
}
