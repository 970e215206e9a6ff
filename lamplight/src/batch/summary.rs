//! `summary.json` of a batch: statistics of every measure, setting by setting.
//!
//! In:  the rows of `trials.csv`, as they were written. Out: the same bytes for the same rows.

use std::{collections::BTreeMap, fmt::Write};

use report::stats::{Stats, quantile};
use serde::Serialize;
use twox_hash::XxHash3_128;

use super::plan::Plan;

/// Columns that are no measure.
const NO_MEASURES: [&str; 6] = ["setting", "trial", "seed", "robots", "ended", "digest"];
/// Measures that people ask for first, and how `lines` names them.
const SHOWN: [(&str, &str); 6] = [
    ("mean_below_1e-4_s", "s to mean error 1e-4"),
    ("mean_below_1e-7_s", "s to mean error 1e-7"),
    ("mean_error_m", "m mean error"),
    ("cost_h", "cost H"),
    ("exact_cost_h", "cost H, exact controller"),
    ("mean_lamp_distance_m", "m to the lamps"),
];

/// Shown where there is one: goals far outside the arena make means of errors large.
const OPEN: (&str, &str) = (
    "robots_with_open_cell",
    "robots with an open cell (controller.cell_cap_m or arena.boundary_sensing = true closes it)",
);

/// A batch in one object.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(super) struct Summary {
    scenario: String,
    engine: String,
    trials: u64,
    /// Hash over the digests of all trials in their order.
    digest: String,
    settings: Vec<SettingSummary>,
}

/// One combination of robot count and swept values.
#[derive(Clone, Debug, PartialEq, Serialize)]
struct SettingSummary {
    setting: usize,
    robots: u32,
    sweep: BTreeMap<String, String>,
    /// How many trials ended in which way.
    ended: BTreeMap<String, usize>,
    measures: BTreeMap<String, Statistics>,
}

/// Statistics of the trials that have a value: those that lost agents have none.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
struct Statistics {
    /// Trials that have one.
    count: usize,
    /// Trials that have none.
    none: usize,
    #[serde(flatten)]
    of: Option<Distribution>,
}

/// How the values are spread.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
struct Distribution {
    mean: f64,
    /// Standard deviation, n − 1 in its denominator; 0 of one value.
    sd: f64,
    /// Standard error of the mean.
    se: f64,
    min: f64,
    p25: f64,
    p50: f64,
    p75: f64,
    max: f64,
}

/// The summary of `rows`, which have `columns` and are all trials of `plan`.
pub(super) fn of(plan: &Plan, columns: &[String], rows: &[csv::StringRecord]) -> Summary {
    let at = |name: &str| columns.iter().position(|column| column == name).expect("it is one of ours");
    let (ended_at, digest_at) = (at("ended"), at("digest"));
    let identity = &plan.identity;
    let is_measure = |column: &String| {
        !NO_MEASURES.contains(&column.as_str()) && identity.sweeps.iter().all(|sweep| sweep.key != *column)
    };
    let measures: Vec<(usize, &String)> =
        columns.iter().enumerate().filter(|(_, column)| is_measure(column)).collect();
    let setting = |(setting, rows): (usize, &[csv::StringRecord])| {
        let of = &plan.settings[setting];
        let mut ended = BTreeMap::new();
        rows.iter().for_each(|row| *ended.entry(row[ended_at].to_owned()).or_default() += 1);
        let statistics = measures.iter().map(|(at, column)| {
            let values: Vec<Option<f64>> = rows.iter().map(|row| row[*at].parse().ok()).collect();
            ((*column).clone(), Statistics::of(&values))
        });
        let keys = identity.sweeps.iter().map(|sweep| sweep.key.clone());
        SettingSummary {
            setting,
            robots: of.scenario.robot_count(),
            sweep: keys.zip(of.values.iter().cloned()).collect(),
            ended,
            measures: statistics.collect(),
        }
    };
    let digests: String = rows.iter().map(|row| &row[digest_at]).collect();
    Summary {
        scenario: identity.scenario.clone(),
        engine: identity.engine.clone(),
        trials: identity.trials,
        digest: format!("{:032x}", XxHash3_128::oneshot(digests.as_bytes())),
        settings: rows.chunks(identity.trials as usize).enumerate().map(setting).collect(),
    }
}

impl Summary {
    /// As `summary.json` holds it.
    pub(super) fn json(&self) -> String {
        let mut text = serde_json::to_string_pretty(self).expect("a summary is plain data");
        text.push('\n');
        text
    }

    /// The same to a person: a few lines per setting.
    pub(super) fn lines(&self) -> String {
        let mut text = String::new();
        self.write_lines(&mut text).expect("a string takes all that is written to it");
        text
    }

    fn write_lines(&self, text: &mut String) -> std::fmt::Result {
        for setting in &self.settings {
            write!(text, "{}: {} robots", self.scenario, setting.robots)?;
            setting.sweep.iter().try_for_each(|(key, value)| write!(text, ", {key} = {value}"))?;
            let ended: Vec<String> =
                setting.ended.iter().map(|(how, count)| format!("{count} {how}")).collect();
            writeln!(text, ", {} trials ({})", self.trials, ended.join(", "))?;
            let has_open_cells =
                setting.measures.get(OPEN.0).and_then(|open| open.of).is_some_and(|of| of.max > 0.0);
            for (column, what) in SHOWN.into_iter().chain(has_open_cells.then_some(OPEN)) {
                let Some(Statistics { count, none, of: Some(of) }) = setting.measures.get(column) else {
                    continue;
                };
                write!(text, "  {:>14.6e} ± {:<12.3e} {what}", of.mean, of.sd)?;
                match none {
                    0 => writeln!(text)?,
                    none => writeln!(text, " ({count} of {} trials)", count + none)?,
                }
            }
        }
        writeln!(text, "digest {}", self.digest)
    }
}

impl Statistics {
    fn of(values: &[Option<f64>]) -> Self {
        let known: Vec<f64> = values.iter().flatten().copied().collect();
        Self { count: known.len(), none: values.len() - known.len(), of: Distribution::of(&known) }
    }
}

impl Distribution {
    fn of(values: &[f64]) -> Option<Self> {
        let stats = Stats::of(values)?;
        let [min, p25, p50, p75, max] = [0.0, 0.25, 0.5, 0.75, 1.0].map(|share| quantile(values, share));
        let (mean, sd, se) = (stats.mean, stats.sd, stats.se());
        Some(Self { mean, sd, se, min: min?, p25: p25?, p50: p50?, p75: p75?, max: max? })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn statistics_of_a_known_sample() {
        let Statistics { count, none, of } =
            Statistics::of(&[9.0, 2.0, 4.0, 4.0, 7.0, 4.0, 5.0, 5.0].map(Some));
        let of = of.unwrap();
        assert_eq!((count, none, of.mean, of.min, of.max), (8, 0, 5.0, 2.0, 9.0));
        assert_eq!((of.p25, of.p50, of.p75), (4.0, 4.5, 5.5));
        assert!((of.sd - (32.0_f64 / 7.0).sqrt()).abs() < 1e-15);
    }

    #[test]
    fn trials_without_a_value_are_left_out_and_counted() {
        let some = Statistics::of(&[Some(1.0), None, Some(3.0)]);
        assert_eq!((some.count, some.none, some.of.unwrap().mean), (2, 1, 2.0));
        assert_eq!(Statistics::of(&[None, None]), Statistics { count: 0, none: 2, of: None });
        assert_eq!(serde_json::to_string(&Statistics::of(&[None])).unwrap(), r#"{"count":0,"none":1}"#);
    }
}
