//! Plan of a batch: trials × robots × sweeps, in their order.
//!
//! In:  the options. Out: a [`Plan`] whose every scenario has been checked, so that nothing stops it half-way.

use std::{collections::BTreeMap, path::Path, slice};

use anyhow::{Context, anyhow, bail, ensure};
use arena::{placement, plan_warnings::warnings};
use clap::ValueEnum;
use options::toml_number;
use scenario::{Override, SEED_MAX, Scenario, ScenarioError};
use serde::{Deserialize, Serialize};

use super::{
    columns::COLUMNS,
    options::{BatchArgs, Keep},
};
use crate::{in_process, run::Engine};

/// Version of the files of a batch.
const FORMAT: u32 = 1;
/// Keys that an [`Identity`] is compared by, the most telling first. A batch may grow by trials.
const KEYS: [&str; 8] = ["format", "scenario", "engine", "seed", "robots", "sweeps", "exact", "keep"];
/// Most combinations of robot counts and swept values.
const SETTINGS_MAX: usize = 10_000;
/// Most trials of all settings together: years of work.
const TRIALS_MAX: u64 = 1_000_000_000;

/// A batch, worked out.
#[derive(Debug)]
pub(crate) struct Plan {
    pub(crate) identity: Identity,
    /// The scenario without sweeps.
    pub(crate) base: Scenario,
    pub(crate) settings: Vec<Setting>,
}

/// Identity of a batch, beside the scenario: `batch.json`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Identity {
    format: u32,
    pub(crate) scenario: String,
    pub(crate) engine: String,
    /// Trials of each setting.
    pub(crate) trials: u64,
    /// Seed of the first trial; the next ones count up.
    seed: u64,
    robots: Vec<u32>,
    pub(crate) sweeps: Vec<Sweep>,
    /// Whether the exact controller runs from the same starts.
    pub(crate) exact: bool,
    pub(crate) keep: Vec<Keep>,
}

/// A key of the scenario and the values it goes through, as they were written.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct Sweep {
    pub(crate) key: String,
    pub(crate) values: Vec<String>,
}

/// One combination of robot count and swept values.
#[derive(Clone, Debug)]
pub(crate) struct Setting {
    /// The swept values, in the order of the sweeps.
    pub(crate) values: Vec<String>,
    /// With the seed of the first trial.
    pub(crate) scenario: Scenario,
    /// Warnings about it.
    warnings: Vec<String>,
}

/// One trial of a plan.
#[derive(Clone, Debug)]
pub(crate) struct Trial<'a> {
    pub(crate) setting: usize,
    pub(crate) trial: u64,
    pub(crate) of: &'a Setting,
    pub(crate) scenario: Scenario,
}

/// Makes sure that the engine can play `scenario`.
fn prepare(args: &BatchArgs, scenario: &mut Scenario) -> Result<(), ScenarioError> {
    let instead = match (args.engine, args.exact) {
        (Engine::Processes, false) => return scenario.find_controllers(),
        (Engine::Processes, true) => "leave out --exact, which plays each trial in process as well",
        (Engine::InProcess, _) => {
            "use `lamplight batch --engine processes`, or link the crate `engine` and hand it a constructor"
        }
    };
    in_process::prepare(scenario, instead)
}

impl Plan {
    /// Works out what `args` ask for.
    pub(crate) fn new(args: &BatchArgs) -> anyhow::Result<Self> {
        let sweeps: Vec<Sweep> =
            args.sweeps.iter().map(|text| Sweep::parse(text)).collect::<anyhow::Result<_>>()?;
        if let Some(twice) =
            sweeps.iter().enumerate().find(|(i, s)| sweeps[..*i].iter().any(|t| t.key == s.key))
        {
            bail!("--sweep {0} is given twice; list all its values in one: --sweep {0}=a,b,c", twice.1.key);
        }
        if let Some(twice) = given_twice(&args.robots) {
            bail!("--robots: {twice} is given twice; list each number of robots once");
        }
        let text = Scenario::text_of(&args.file)?;
        let source = args.file.display().to_string();
        let overrides = args.overrides()?;
        let mut base = Scenario::parse(&source, &text, &overrides)?;
        prepare(args, &mut base)?;
        let counts: Vec<Option<i64>> = match args.robots.is_empty() {
            true => vec![None],
            false => args.robots.iter().copied().map(Some).collect(),
        };
        let combinations =
            sweeps.iter().fold(counts.len(), |all, sweep| all.saturating_mul(sweep.values.len()));
        ensure!(
            combinations <= SETTINGS_MAX,
            "{combinations} combinations of robots and sweeps are more than {SETTINGS_MAX}; sweep less at once"
        );
        ensure!(
            (combinations as u64).saturating_mul(args.trials) <= TRIALS_MAX,
            "--trials {} in each setting, {combinations} in all, are more than {TRIALS_MAX} trials; use fewer",
            args.trials
        );
        let settings: Vec<Setting> = counts
            .iter()
            .flat_map(|&count| combinations_of(&sweeps).into_iter().map(move |values| (count, values)))
            .map(|(count, values)| {
                let swept = sweeps.iter().zip(&values).map(|(sweep, value)| sweep.set(value));
                let robots =
                    count.map(|count| spelled(&format!("robots.count={count}"), format!("--robots {count}")));
                let all: Vec<Override> = overrides
                    .iter()
                    .cloned()
                    .map(Ok)
                    .chain(robots)
                    .chain(swept)
                    .collect::<anyhow::Result<_>>()?;
                let mut scenario = Scenario::parse(&source, &text, &all)?;
                prepare(args, &mut scenario)?;
                Setting::new(scenario, values, args.trials)
            })
            .collect::<anyhow::Result<_>>()?;
        refuse_equal(&settings)?;
        let mut robots: Vec<u32> = settings.iter().map(|setting| setting.scenario.robot_count()).collect();
        robots.dedup();
        let identity = Identity {
            format: FORMAT,
            scenario: base.name.clone(),
            engine: args.engine.name().into(),
            trials: args.trials,
            seed: base.seed.get(),
            robots,
            sweeps,
            exact: args.exact,
            keep: args.kept()?,
        };
        Ok(Self { identity, base, settings })
    }

    /// The warnings about all settings, each once, and about differences between them.
    pub(crate) fn warnings(&self) -> Vec<String> {
        // Its default is another one as soon as a sweep makes packets get lost.
        const TIMEOUT: &str = "controller.neighbor_timeout_cycles";
        let mut warnings: Vec<String> = Vec::new();
        for warning in self.settings.iter().flat_map(|setting| &setting.warnings) {
            if !warnings.contains(warning) {
                warnings.push(warning.clone());
            }
        }
        let cycles =
            self.settings.iter().flat_map(|it| it.scenario.laws().map(|law| law.neighbor_timeout_cycles));
        let (least, most) = (cycles.clone().min(), cycles.max());
        let is_swept = self.identity.sweeps.iter().any(|sweep| sweep.key == TIMEOUT);
        if let (Some(least), Some(most), true, false) = (least, most, least != most, is_swept) {
            warnings.push(format!(
                "{TIMEOUT} is {least} in some settings and {most} in others, as only some can lose packets; \
                 --set {TIMEOUT}={most} makes them alike"
            ));
        }
        warnings
    }

    /// Number of trials in all.
    pub(crate) fn len(&self) -> usize {
        self.settings.len() * self.identity.trials as usize
    }

    /// Trial `index` of all, setting by setting.
    pub(crate) fn trial(&self, index: usize) -> Trial<'_> {
        let trials = self.identity.trials as usize;
        let (setting, trial) = (index / trials, (index % trials) as u64);
        let of = &self.settings[setting];
        let mut scenario = of.scenario.clone();
        scenario.seed = of.scenario.seed.after(trial).expect("the plan has checked the last trial's seed");
        Trial { setting, trial, of, scenario }
    }

    /// Number of `trial` of `setting`, if there is one.
    pub(crate) fn number(&self, setting: usize, trial: u64) -> Option<usize> {
        let is_ours = setting < self.settings.len() && trial < self.identity.trials;
        is_ours.then(|| setting * self.identity.trials as usize + trial as usize)
    }

    /// How much work a trial may be, in robot-ticks.
    pub(crate) fn weight(&self, index: usize) -> f64 {
        let scenario = &self.settings[index / self.identity.trials as usize].scenario;
        f64::from(scenario.robot_count()) * scenario.ticks() as f64
    }
}

impl Identity {
    /// The first thing in which another batch differs, but for the number of its trials.
    pub(crate) fn difference(&self, other: &Self) -> Option<String> {
        let [there, here] = [self, other].map(|identity| serde_json::to_value(identity).expect("plain data"));
        let key = KEYS.into_iter().find(|&key| there[key] != here[key])?;
        Some(format!("`{key}` is {} there and {} here", there[key], here[key]))
    }
}

impl Sweep {
    fn parse(text: &str) -> anyhow::Result<Self> {
        let (key, values) =
            text.split_once('=').ok_or_else(|| anyhow!("--sweep {text}: expected key.path=a,b,c"))?;
        let key = key.trim().to_owned();
        let values: Vec<String> = split_values(values).into_iter().map(str::to_owned).collect();
        ensure!(values.iter().all(|value| !value.is_empty()), "--sweep {text}: a value is missing");
        match key.as_str() {
            "seed" => bail!("--sweep seed: trials count the seeds up already; use --seed and --trials"),
            "robots.count" => bail!("--sweep robots.count: use --robots 10,100"),
            key if COLUMNS.contains(&key) => bail!("--sweep {key}: trials.csv has a column of this name"),
            _ => {}
        }
        if let Some(twice) = given_twice(&values) {
            bail!("--sweep {key}: {twice} is given twice; list each value once");
        }
        let sweep = Self { key, values };
        sweep.values.iter().try_for_each(|value| sweep.set(value).map(drop))?;
        Ok(sweep)
    }

    fn set(&self, value: &str) -> anyhow::Result<Override> {
        let set = format!("{}={value}", self.key);
        spelled(&set, format!("--sweep {set}"))
    }
}

impl Setting {
    fn new(scenario: Scenario, values: Vec<String>, trials: u64) -> anyhow::Result<Self> {
        ensure!(
            scenario.seed.after(trials - 1).is_some(),
            "--trials {trials} from seed {} on go beyond the highest seed, {SEED_MAX}; use fewer trials or a lower \
             --seed",
            scenario.seed
        );
        let poses = placement::start(&scenario)?;
        let warnings = warnings(&scenario, &poses);
        Ok(Self { values, scenario, warnings })
    }
}

/// The options that every scenario of a batch gets.
impl BatchArgs {
    fn overrides(&self) -> anyhow::Result<Vec<Override>> {
        // First, so that their params may be set.
        let controllers = self.controllers.iter().map(|controller| Override::controller(controller));
        let mut overrides: Vec<Override> =
            controllers.chain(self.sets.iter().map(|set| set.parse())).collect::<Result<_, _>>()?;
        for (option, key, value) in [
            ("seed", "seed", self.seed.map(|seed| seed.to_string())),
            ("duration", "duration_s", self.duration.map(toml_number)),
        ] {
            if let Some(value) = value {
                overrides.push(spelled(&format!("{key}={value}"), format!("--{option} {value}"))?);
            }
        }
        Ok(overrides)
    }

    fn kept(&self) -> anyhow::Result<Vec<Keep>> {
        if let Some(twice) = given_twice(&self.keep) {
            let twice = twice.to_possible_value().expect("nothing that is kept is hidden");
            bail!("--keep: {} is given twice; list each once", twice.get_name());
        }
        let mut kept = self.keep.clone();
        kept.sort_unstable();
        Ok(kept)
    }
}

/// The first value that a list names a second time, if there is one.
fn given_twice<T: PartialEq>(list: &[T]) -> Option<&T> {
    list.iter().enumerate().find(|(at, it)| list[..*at].contains(it)).map(|(_, it)| it)
}

/// Refuses settings that come to the same scenario: one value spelled in two ways, as 1 and 1.0.
fn refuse_equal(settings: &[Setting]) -> anyhow::Result<()> {
    let mut seen = BTreeMap::new();
    for Setting { values, scenario, .. } in settings {
        if let Some(before) = seen.insert(scenario.to_toml(), values) {
            bail!(
                "--sweep: the values {} and {} come to the same scenario, which is given twice; list each once",
                before.join(", "),
                values.join(", ")
            );
        }
    }
    Ok(())
}

fn spelled(set: &str, spelling: String) -> anyhow::Result<Override> {
    Ok(set.parse::<Override>().with_context(|| spelling.clone())?.spelled(spelling))
}

/// Every combination of one value of each sweep, the last sweep going fastest.
fn combinations_of(sweeps: &[Sweep]) -> Vec<Vec<String>> {
    sweeps.iter().fold(vec![Vec::new()], |before, sweep| {
        let longer = |values: &Vec<String>| -> Vec<Vec<String>> {
            sweep.values.iter().map(|value| [values.as_slice(), slice::from_ref(value)].concat()).collect()
        };
        before.iter().flat_map(longer).collect()
    })
}

/// Splits at the commas that stand in no brackets, braces or quotes, as TOML has them.
fn split_values(text: &str) -> Vec<&str> {
    let (mut depth, mut quote, mut start) = (0_i32, None, 0);
    let mut values = Vec::new();
    for (at, c) in text.char_indices() {
        match (quote, c) {
            (Some(open), _) if c == open => quote = None,
            (Some(_), _) => {}
            (None, '"' | '\'') => quote = Some(c),
            (None, '[' | '{') => depth += 1,
            (None, ']' | '}') => depth -= 1,
            (None, ',') if depth == 0 => {
                values.push(text[start..at].trim());
                start = at + 1;
            }
            (None, _) => {}
        }
    }
    values.push(text[start..].trim());
    values
}

/// Whether two scenarios are one; if not, the first line in which they differ.
pub(crate) fn scenario_difference(path: &Path, there: &str, here: &str) -> Option<String> {
    // One that was written by an earlier version may leave out keys that are filled in by now.
    let there = match Scenario::parse(&path.display().to_string(), there, &[]) {
        Ok(scenario) => scenario.to_toml(),
        Err(_) => there.to_owned(),
    };
    if there == here {
        return None;
    }
    let (mut there, mut here) = (there.lines(), here.lines());
    loop {
        match (there.next(), here.next()) {
            (Some(there), Some(here)) if there == here => {}
            (there, here) => {
                let shown = |line: Option<&str>| line.map_or("nothing".into(), |line| format!("`{line}`"));
                return Some(format!(
                    "{} has {} there and {} here",
                    path.display(),
                    shown(there),
                    shown(here)
                ));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_are_split_at_the_commas_between_them() {
        assert_eq!(split_values("1600, 800,400"), ["1600", "800", "400"]);
        assert_eq!(
            split_values("[],[{ kind = \"kill\", at_s = 3 }]"),
            ["[]", "[{ kind = \"kill\", at_s = 3 }]"]
        );
        assert_eq!(split_values("\"a,b\",c"), ["\"a,b\"", "c"]);
    }

    #[test]
    fn the_last_sweep_goes_fastest() {
        let sweep = |text: &str| Sweep::parse(text).unwrap();
        let all = combinations_of(&[sweep("a=1,2"), sweep("b=x,y")]);
        assert_eq!(all, [["1", "x"], ["1", "y"], ["2", "x"], ["2", "y"]]);
        assert_eq!(combinations_of(&[]), [Vec::<String>::new()]);
    }

    #[test]
    fn a_bad_sweep_is_refused_with_its_reason() {
        let error = |text: &str| Sweep::parse(text).unwrap_err().to_string();
        assert_eq!(error("field.offset"), "--sweep field.offset: expected key.path=a,b,c");
        assert_eq!(error("field.offset=1,,2"), "--sweep field.offset=1,,2: a value is missing");
        assert_eq!(error("field.offset=1,1"), "--sweep field.offset: 1 is given twice; list each value once");
        assert!(error("seed=1,2").contains("use --seed and --trials"));
    }
}
