//! The folder of a batch: what has been done is kept at once, and never twice.
//!
//! `batch.json` says what the batch is, `trials.csv` has a row per trial, and `errors.csv` and `positions.csv` more of
//! each, where they are kept. A trial counts as done once its row in `trials.csv` is whole, and that is written last.
//! Rows that a killed batch has left unfinished are dropped, and so are those of trials that lost agents, which are
//! played again.
//!
//! Trials are added in the order in which they are played. Where that is not the order of the plan, because the batch
//! has grown or some are played again, the tables are put in order once all trials are there. Every step leaves a
//! folder that the same command goes on with.

mod keys;
mod table;

use std::{
    collections::{BTreeMap, BTreeSet},
    fmt::Write as _,
    fs::{self, File, TryLockError},
    io::ErrorKind,
    path::{Path, PathBuf},
};

use anyhow::{Context, bail, ensure};
use files::WriteError;
use observe::trial::{Record, TOLERANCES_M};

use self::{
    keys::{keys, keys_of_row},
    table::{Block, Row, Sheet, Table},
};
use super::{
    columns::{COLUMNS, KEYS, LOST_AGENTS},
    options::Keep,
    plan::{Identity, Plan, Trial, scenario_difference},
};
use crate::failure::Failure;

const BATCH: &str = "batch.json";
const SCENARIO: &str = "scenario.toml";
const TRIALS: &str = "trials.csv";
const SUMMARY: &str = "summary.json";

const ERRORS: [&str; 5] = ["setting", "trial", "time_s", "mean_error_m", "max_error_m"];
const POSITIONS: [&str; 8] = ["setting", "trial", "robot", "start_x_m", "start_y_m", "x_m", "y_m", "alive"];

/// Outcome of one trial.
#[derive(Debug)]
pub(crate) enum Done {
    Played(Box<Played>),
    /// It has no numbers that could be compared.
    LostAgents,
}

/// Results kept of a trial.
#[derive(Debug)]
pub(crate) struct Played {
    pub(crate) record: Record,
    /// H under the exact controller from the same start, if asked for.
    pub(crate) exact_cost_h: Option<f64>,
}

/// A batch's folder, ours alone while this lives.
#[derive(Debug)]
pub(crate) struct Folder {
    path: PathBuf,
    /// Trials in the folder.
    done: usize,
    trials: Table,
    /// Other tables that are kept of each trial.
    kept: Vec<(Keep, Table)>,
    /// Holds the lock.
    _lock: File,
}

impl Folder {
    /// Makes the folder of `plan`, or goes on with it where it was left, perhaps with more trials than it was begun
    /// with. Also returns the trials that are to be played, by their numbers in the plan.
    ///
    /// # Errors
    /// If the folder holds something else, another batch, or this one while it is at work; or if its files
    /// are not those of this batch; or if they cannot be written.
    pub(crate) fn open(path: &Path, plan: &Plan) -> Result<(Self, Vec<usize>), Failure> {
        let lock = locked(path).map_err(Failure::Usage)?;
        Found::read(path, plan).map_err(Failure::Usage)?.go_on(path, plan, lock).map_err(Failure::from)
    }

    /// Number of trials that are done.
    pub(crate) fn done(&self) -> usize {
        self.done
    }

    /// Keeps one more trial.
    pub(crate) fn add(&mut self, trial: &Trial<'_>, done: &Done) -> anyhow::Result<()> {
        if let Done::Played(played) = done {
            for (keep, table) in &mut self.kept {
                match keep {
                    Keep::Errors => table.add(played.record.errors.iter().map(|sample| {
                        let numbers = [Some(sample.time_s), sample.mean_m, sample.max_m];
                        keys(trial).into_iter().chain(numbers.map(perhaps)).collect()
                    }))?,
                    Keep::Positions => {
                        table.add(played.record.places.iter().enumerate().map(|(robot, place)| {
                            let [[x, y], [end_x, end_y]] = [place.start_m, place.end_m];
                            let numbers = [x, y, end_x, end_y].map(number);
                            let [robot, alive] = [robot.to_string(), place.alive.to_string()];
                            keys(trial).into_iter().chain([robot]).chain(numbers).chain([alive]).collect()
                        }))?
                    }
                }
            }
        }
        self.trials.add([row(trial, done)])?;
        self.done += 1;
        Ok(())
    }

    /// Puts the trials in the order of the plan, now that all are there.
    pub(crate) fn put_in_order(&mut self, plan: &Plan) -> anyhow::Result<()> {
        let kept = self.kept.iter_mut().map(|(keep, table)| (keep.header(), table));
        for (columns, table) in kept.chain([(header(plan), &mut self.trials)]) {
            let sheet = Sheet::read(table.path(), columns)?;
            let mut blocks = sheet.blocks_of(plan);
            if !blocks.is_sorted_by_key(|block| block.trial) {
                blocks.sort_by_key(|block| block.trial);
                *table = sheet.with_only(&blocks)?;
            }
        }
        Ok(())
    }

    /// Every row of `trials.csv`, as text.
    pub(crate) fn rows(&self) -> anyhow::Result<Vec<csv::StringRecord>> {
        let mut reader = csv::Reader::from_path(self.trials.path())?;
        Ok(reader.records().collect::<Result<_, _>>()?)
    }

    /// The columns of `trials.csv`.
    pub(crate) fn columns(&self, plan: &Plan) -> Vec<String> {
        header(plan)
    }

    /// Writes `summary.json`, which is `text`.
    pub(crate) fn finish(&self, text: &str) -> Result<(), WriteError> {
        files::replace(&self.path.join(SUMMARY), text)
    }
}

/// State of a batch in its folder, before anything is changed in it.
struct Found {
    /// How many trials of each setting `batch.json` speaks of, if it is there.
    trials_of_each: Option<u64>,
    has_scenario: bool,
    trials: Sheet,
    rows: Vec<Row>,
    kept: Vec<(Keep, Sheet)>,
}

impl Found {
    /// Reads it; it must be of `plan`, or nothing.
    fn read(path: &Path, plan: &Plan) -> anyhow::Result<Self> {
        refuse_foreign(path)?;
        let trials_of_each = trials_in(path, &plan.identity)?;
        let has_scenario = has_scenario(path, &plan.base.to_toml())?;
        let trials = Sheet::read(&path.join(TRIALS), header(plan))?;
        let rows = trials.trials_of(plan)?;
        let kept = plan.identity.keep.iter();
        let kept = kept.map(|&keep| Ok((keep, Sheet::read(&path.join(keep.file()), keep.header())?)));
        let kept = kept.collect::<anyhow::Result<_>>()?;
        Ok(Self { trials_of_each, has_scenario, trials, rows, kept })
    }

    /// Completes what every batch has, and drops what is not whole.
    fn go_on(self, path: &Path, plan: &Plan, lock: File) -> Result<(Folder, Vec<usize>), WriteError> {
        let Self { trials_of_each, has_scenario, trials, rows, kept } = self;
        let ticks: BTreeMap<usize, u64> =
            rows.iter().filter_map(|row| Some((row.trial, row.ticks?))).collect();
        let mut done: BTreeSet<usize> = ticks.keys().copied().collect();
        let blocks_of = |(keep, sheet): (Keep, Sheet)| {
            let mut blocks = sheet.blocks_of(plan);
            blocks.retain(|Block { trial, rows, .. }| {
                ticks.get(trial).is_some_and(|&ticks| keep.rows(&plan.trial(*trial), ticks) == *rows)
            });
            let whole: BTreeSet<usize> = blocks.iter().map(|block| block.trial).collect();
            done.retain(|trial| whole.contains(trial));
            (keep, sheet, blocks)
        };
        let kept: Vec<_> = kept.into_iter().map(blocks_of).collect();
        let missing: Vec<usize> = (0..plan.len()).filter(|trial| !done.contains(trial)).collect();

        for name in [BATCH, SCENARIO, TRIALS, SUMMARY, Keep::Errors.file(), Keep::Positions.file()] {
            // What a killed batch was about to put in a file's place.
            remove(&files::draft_of(&path.join(name)))?;
        }
        if trials_of_each != Some(plan.identity.trials) {
            let mut text = serde_json::to_string_pretty(&plan.identity).expect("an identity is plain data");
            text.push('\n');
            files::replace(&path.join(BATCH), text)?;
        }
        if !has_scenario {
            files::replace(&path.join(SCENARIO), plan.base.to_toml())?;
        }
        if !missing.is_empty() {
            // It does not speak of the trials to come.
            remove(&path.join(SUMMARY))?;
        }
        if rows.len() > done.len() {
            tracing::info!("{} trials that are not whole are played again", rows.len() - done.len());
        }
        let only_done = |mut blocks: Vec<Block>| {
            blocks.retain(|block| done.contains(&block.trial));
            blocks
        };
        let rows = only_done(trials.blocks_of(plan));
        let trials = trials.with_only(&rows)?;
        let kept = kept.into_iter();
        let kept = kept.map(|(keep, sheet, blocks)| Ok((keep, sheet.with_only(&only_done(blocks))?)));
        let kept = kept.collect::<Result<_, WriteError>>()?;
        Ok((Folder { path: path.to_path_buf(), done: done.len(), trials, kept, _lock: lock }, missing))
    }
}

/// The folder `path`, made if it is not there, and held by a lock on itself.
fn locked(path: &Path) -> anyhow::Result<File> {
    let shown = path.display();
    ensure!(!path.exists() || path.is_dir(), "{shown} is a file; give --out the name of a folder");
    fs::create_dir_all(path)
        .with_context(|| format!("cannot make the folder {shown}; give --out another one"))?;
    let folder = File::open(path).with_context(|| format!("cannot open {shown}"))?;
    match folder.try_lock() {
        Ok(()) => Ok(folder),
        Err(TryLockError::WouldBlock) => bail!("another `lamplight batch` is at work in {shown}"),
        Err(TryLockError::Error(error)) => Err(error).with_context(|| format!("cannot lock {shown}")),
    }
}

/// Refuses a folder that holds something which is no batch.
fn refuse_foreign(path: &Path) -> anyhow::Result<()> {
    let shown = path.display();
    if path.join(BATCH).exists() {
        return Ok(());
    }
    let ours = [SCENARIO, TRIALS, SUMMARY, Keep::Errors.file(), Keep::Positions.file()];
    match ours.iter().find(|name| path.join(name).exists()) {
        Some(name) => {
            bail!("{shown} holds {name} and no {BATCH}: that is no batch; give --out another folder")
        }
        None => Ok(()),
    }
}

/// How many trials of each setting the batch in `folder` was begun with, if there is one; it may differ from
/// `identity` in nothing else, and may not have more.
fn trials_in(folder: &Path, identity: &Identity) -> anyhow::Result<Option<u64>> {
    let (path, shown) = (folder.join(BATCH), folder.display());
    let text = match fs::read_to_string(&path) {
        Ok(text) => text,
        Err(error) if error.kind() == ErrorKind::NotFound => return Ok(None),
        Err(error) => return Err(error).with_context(|| format!("cannot read {}", path.display())),
    };
    let there: Identity = serde_json::from_str(&text)
        .with_context(|| format!("{} is not a batch's; give --out another folder", path.display()))?;
    if let Some(difference) = there.difference(identity) {
        bail!(
            "{shown} holds another batch: {difference}; give --out another folder, or the same command (it may only \
             have more --trials)"
        );
    }
    ensure!(
        there.trials <= identity.trials,
        "{shown} holds a batch of {0} trials, and --trials {1} is fewer; give --trials {0} or more, or --out another \
         folder",
        there.trials,
        identity.trials
    );
    Ok(Some(there.trials))
}

/// Whether there is a scenario in `folder`; it must be the one that is `here`.
fn has_scenario(folder: &Path, here: &str) -> anyhow::Result<bool> {
    let path = folder.join(SCENARIO);
    match fs::read_to_string(&path) {
        Ok(there) => match scenario_difference(&path, &there, here) {
            Some(difference) => bail!(
                "{} holds a batch of another scenario: {difference}; give --out another folder",
                folder.display()
            ),
            None => Ok(true),
        },
        Err(error) if error.kind() == ErrorKind::NotFound => Ok(false),
        Err(error) => Err(error).with_context(|| format!("cannot read {}", path.display())),
    }
}

/// Removes a file, if it is there.
fn remove(path: &Path) -> Result<(), WriteError> {
    match fs::remove_file(path) {
        Err(error) if error.kind() != ErrorKind::NotFound => Err(WriteError::new(path, error)),
        _ => Ok(()),
    }
}

impl Keep {
    /// The file it is kept in.
    fn file(self) -> &'static str {
        match self {
            Keep::Errors => "errors.csv",
            Keep::Positions => "positions.csv",
        }
    }

    fn header(self) -> Vec<String> {
        let columns: &[&str] = match self {
            Keep::Errors => &ERRORS,
            Keep::Positions => &POSITIONS,
        };
        columns.iter().map(|&column| column.into()).collect()
    }

    /// Number of rows of a trial that has played so many ticks.
    fn rows(self, trial: &Trial<'_>, ticks: u64) -> u64 {
        match self {
            Keep::Errors => ticks.div_ceil(trial.scenario.sample_every_ticks()) + 1,
            Keep::Positions => trial.scenario.robot_count().into(),
        }
    }
}

fn header(plan: &Plan) -> Vec<String> {
    let sweeps = plan.identity.sweeps.iter().map(|sweep| sweep.key.clone());
    let rest = COLUMNS[KEYS.len()..].iter().map(|&column| column.into());
    KEYS.iter().map(|&key| key.into()).chain(sweeps).chain(rest).collect()
}

fn row(trial: &Trial<'_>, done: &Done) -> Vec<String> {
    let Done::Played(played) = done else {
        // No numbers, so that nobody counts them by mistake.
        let mut row = keys_of_row(trial);
        row.push(LOST_AGENTS.into());
        row.resize(COLUMNS.len() + trial.of.values.len(), String::new());
        return row;
    };
    let Played { record, exact_cost_h } = &**played;
    let end = &record.end;
    let mut row = keys_of_row(trial);
    row.extend([record.ended.to_string(), record.ticks.to_string()]);
    row.push(number(record.virtual_time_s));
    row.extend(record.mean_below_s.map(perhaps));
    row.extend(record.max_below_s.map(perhaps));
    row.extend([end.mean_error_m, end.max_error_m, end.mean_true_error_m, end.cost_h].map(perhaps));
    row.extend([*exact_cost_h, end.cell_agreement].map(perhaps));
    row.extend([end.mean_peak_distance_m, end.mean_lamp_distance_m].map(perhaps));
    row.extend([end.robots_alive, end.robots_paused, end.robots_silent].map(|count| count.to_string()));
    row.extend([end.robots_without_error, end.robots_with_open_cell].map(|count| count.to_string()));
    row.push(end.robots_without_mass.to_string());
    row.extend([end.packets.in_range, end.packets.heard].map(|count| count.to_string()));
    let properties = &record.properties;
    row.extend([properties.broken().count(), properties.unreached().count()].map(|count| count.to_string()));
    row.push(record.digest.clone());
    row
}

/// The shortest text that reads back as the same number.
fn number(value: f64) -> String {
    let mut text = String::new();
    write!(text, "{value:?}").expect("a string takes all that is written to it");
    text
}

/// The same of a value that may not be there.
fn perhaps(value: Option<f64>) -> String {
    value.map(number).unwrap_or_default()
}

const _: () = assert!(TOLERANCES_M.len() == 5, "COLUMNS names each tolerance twice");
