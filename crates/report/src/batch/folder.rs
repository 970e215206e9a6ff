//! Files of a batch: `batch.json`, `scenario.toml`, `trials.csv`, and where it came to its end or was asked
//! to, `summary.json`, `errors.csv`, `positions.csv`.

use std::{
    collections::BTreeMap,
    path::{Path, PathBuf},
};

use scenario::Scenario;
use serde::Deserialize;
use serde_json::Value;

use crate::{chart::Point, error::ReportError, plan::Body, rows::Rows, scene};

/// How a trial ended that has no numbers, because it lost agents.
const LOST_AGENTS: &str = "lost-agents";

/// Something of each trial, by setting and trial.
pub type ByTrial<T> = BTreeMap<(u64, u64), T>;

/// A batch as read from its folder.
#[derive(Debug)]
pub struct Batch {
    /// `batch.json`.
    pub meta: Meta,
    /// The scenario as resolved, before what is swept.
    pub scenario: Scenario,
    /// `trials.csv`.
    pub trials: Rows,
    /// The settings, in the order of their numbers.
    pub settings: Vec<Setting>,
    /// Digest of all trials, from `summary.json`; `None` while the batch is not finished.
    pub digest: Option<String>,
    /// Notes to read before trusting the rest.
    pub notes: Vec<String>,
    folder: PathBuf,
}

/// `batch.json`: what was asked for.
#[derive(Clone, Debug, Deserialize)]
pub struct Meta {
    /// Name of the scenario.
    pub scenario: String,
    /// Engine that ran the trials.
    pub engine: String,
    /// Trials per setting.
    pub trials: u64,
    /// Seed of the first trial.
    pub seed: u64,
    /// Numbers of robots.
    #[serde(default)]
    pub robots: Vec<u32>,
    /// Keys that were swept.
    #[serde(default)]
    pub sweeps: Vec<Sweep>,
    /// Whether each trial ran under the exact controller as well.
    #[serde(default)]
    pub exact: bool,
    /// Tables kept besides `trials.csv`.
    #[serde(default)]
    pub keep: Vec<String>,
}

/// A key of the scenario and the values it took.
#[derive(Clone, Debug, Deserialize)]
pub struct Sweep {
    /// The key, as `field.offset`.
    pub key: String,
    /// Its values, as they were given.
    pub values: Vec<String>,
}

/// Trials that differ in nothing but their seed.
#[derive(Clone, Debug, PartialEq)]
pub struct Setting {
    /// Its number in all files.
    pub number: u64,
    /// Robots.
    pub robots: u32,
    /// Value of each swept key, in the order of `batch.json`.
    pub values: Vec<String>,
    /// Rows of `trials.csv`.
    pub rows: Vec<usize>,
}

impl Meta {
    /// The command that makes such a batch.
    pub fn command(&self) -> String {
        let mut command =
            format!("lamplight batch scenario.toml --trials {} --seed {}", self.trials, self.seed);
        if !self.robots.is_empty() {
            let robots: Vec<String> = self.robots.iter().map(u32::to_string).collect();
            command += &format!(" --robots {}", robots.join(","));
        }
        for sweep in &self.sweeps {
            command += &format!(" \\\n  --sweep '{}={}'", sweep.key, sweep.values.join(","));
        }
        command += &format!(" --engine {}", self.engine);
        if self.exact {
            command += " --exact";
        }
        if !self.keep.is_empty() {
            command += &format!(" --keep {}", self.keep.join(","));
        }
        command + " --out DIR"
    }
}

impl Setting {
    /// Its name in a figure: `n = 10, offset = 50`. What all `settings` share is left out.
    pub fn name(&self, meta: &Meta, settings: &[Self]) -> String {
        let differs = |same: &dyn Fn(&Self) -> bool| !settings.iter().all(same);
        let mut parts = Vec::new();
        if differs(&|other| other.robots == self.robots) || meta.sweeps.is_empty() {
            parts.push(format!("n = {}", self.robots));
        }
        for (place, (sweep, value)) in meta.sweeps.iter().zip(&self.values).enumerate() {
            if differs(&|other| other.values.get(place) == Some(value)) {
                parts.push(format!("{} = {}", short_key(&sweep.key), short_value(value)));
            }
        }
        if parts.is_empty() { format!("n = {}", self.robots) } else { parts.join(", ") }
    }
}

/// The last word of a key that says something: `field.gaussian.*.sigma_m` is `sigma_m`.
pub(super) fn short_key(key: &str) -> &str {
    key.rsplit('.').next().unwrap_or(key)
}

/// A value as it fits beside a figure.
pub(super) fn short_value(value: &str) -> String {
    if value.chars().count() <= 18 {
        return value.to_owned();
    }
    value.chars().take(16).collect::<String>() + "…"
}

impl Batch {
    /// Reads the batch in `folder`.
    pub fn read(folder: &Path) -> Result<Self, ReportError> {
        let path = folder.join("batch.json");
        let missing = || ReportError::Missing {
            file: path.display().to_string(),
            hint: "a batch writes it first; give the folder that --out of `lamplight batch` named",
        };
        let meta: Meta = scene::json(&path)?.ok_or_else(missing)?;
        let scenario = scene::scenario(folder)?;
        let hint = "a batch writes it as it goes; let at least one trial end";
        let trials = Rows::read(&folder.join("trials.csv"), hint)?;
        let settings = settings(&meta, &trials)?;
        let summary: Option<Value> = scene::json(&folder.join("summary.json"))?;
        let digest = summary.as_ref().and_then(|summary| Some(summary.get("digest")?.as_str()?.to_owned()));
        let mut notes: Vec<String> = trials.note().into_iter().collect();
        if summary.is_none() {
            notes.push(format!(
                "The batch is not finished: there is no summary.json. What follows is from the {} trials in \
                 trials.csv.",
                trials.len()
            ));
        }
        let lost = trials.words("ended")?.into_iter().filter(|&ended| ended == LOST_AGENTS).count();
        if lost > 0 {
            notes.push(format!(
                "{lost} of {} trials lost agents each time they were played, and are left out; the same command \
                 plays them again.",
                trials.len()
            ));
        }
        Ok(Self { meta, scenario, trials, settings, digest, notes, folder: folder.to_owned() })
    }

    /// A column of the trials of `setting`, without empty cells.
    pub fn measure(&self, setting: &Setting, column: &str) -> Result<Vec<f64>, ReportError> {
        let numbers = self.trials.numbers_if_there(column)?;
        Ok(setting.rows.iter().filter_map(|&row| numbers[row]).collect())
    }

    /// The digest of each trial that has one, by setting and trial.
    pub fn digests(&self) -> Result<ByTrial<String>, ReportError> {
        let keys = self.trials.counts("setting")?.into_iter().zip(self.trials.counts("trial")?);
        let digests = keys.zip(self.trials.words("digest")?).filter(|(_, digest)| !digest.is_empty());
        Ok(digests.map(|(key, digest)| (key, digest.to_owned())).collect())
    }

    /// `errors.csv`: mean ‖ê‖ over time of each trial, by setting and trial, NaN where it had no value; `None` if it
    /// was not kept.
    pub fn errors(&self) -> Result<Option<ByTrial<Vec<Point>>>, ReportError> {
        let Some(rows) = Rows::read_if_there(&self.folder.join("errors.csv"))? else { return Ok(None) };
        let keys = rows.counts("setting")?.into_iter().zip(rows.counts("trial")?);
        let points = rows.full("time_s")?.into_iter().zip(rows.numbers("mean_error_m")?);
        let mut trials: ByTrial<Vec<Point>> = BTreeMap::new();
        for (key, (time_s, error)) in keys.zip(points) {
            trials.entry(key).or_default().push((time_s, error.unwrap_or(f64::NAN)));
        }
        Ok(Some(trials))
    }

    /// `positions.csv`: where robots were at the end, by setting and trial; `None` if it was not kept.
    pub fn positions(&self) -> Result<Option<ByTrial<Vec<Body>>>, ReportError> {
        let Some(rows) = Rows::read_if_there(&self.folder.join("positions.csv"))? else { return Ok(None) };
        let keys = rows.counts("setting")?.into_iter().zip(rows.counts("trial")?);
        let places = rows.full("x_m")?.into_iter().zip(rows.full("y_m")?);
        let mut trials: ByTrial<Vec<Body>> = BTreeMap::new();
        for ((key, at), alive) in keys.zip(places).zip(rows.words("alive")?) {
            let present = matches!(alive, "true" | "1");
            trials.entry(key).or_default().push(Body { at, present });
        }
        Ok(Some(trials))
    }
}

/// The settings that have trials.
fn settings(meta: &Meta, trials: &Rows) -> Result<Vec<Setting>, ReportError> {
    let robots = trials.counts("robots")?;
    let swept = meta.sweeps.iter().map(|sweep| trials.words(&sweep.key));
    let swept = swept.collect::<Result<Vec<_>, _>>()?;
    let mut settings: BTreeMap<u64, Setting> = BTreeMap::new();
    for (row, number) in trials.counts("setting")?.into_iter().enumerate() {
        let new = || Setting {
            number,
            robots: u32::try_from(robots[row]).unwrap_or(u32::MAX),
            values: swept.iter().map(|column| column[row].to_owned()).collect(),
            rows: Vec::new(),
        };
        settings.entry(number).or_insert_with(new).rows.push(row);
    }
    Ok(settings.into_values().collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn meta() -> Meta {
        let text = r#"{"format":1,"scenario":"swarmbots","engine":"in-process","trials":3,"seed":1,
            "robots":[10,100],"sweeps":[{"key":"field.offset","values":["1600","800"]}],
            "exact":true,"keep":["errors"]}"#;
        serde_json::from_str(text).unwrap()
    }

    #[test]
    fn the_command_of_a_batch_gives_all_that_batch_json_says() {
        assert_eq!(
            meta().command(),
            "lamplight batch scenario.toml --trials 3 --seed 1 --robots 10,100 \\\n  \
             --sweep 'field.offset=1600,800' --engine in-process --exact --keep errors --out DIR"
        );
    }

    #[test]
    fn a_setting_is_named_by_what_tells_it_from_the_others() {
        let setting = |number, robots, value: &str| Setting {
            number,
            robots,
            values: vec![value.into()],
            rows: vec![],
        };
        let both = [setting(0, 10, "1600"), setting(1, 100, "800")];
        assert_eq!(both[0].name(&meta(), &both), "n = 10, offset = 1600");
        let offsets = [setting(0, 10, "1600"), setting(1, 10, "800")];
        assert_eq!(offsets[1].name(&meta(), &offsets), "offset = 800");
        let one = [setting(0, 10, "1600")];
        assert_eq!(one[0].name(&meta(), &one), "n = 10");
    }
}
