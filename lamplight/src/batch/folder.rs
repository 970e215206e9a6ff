//! The folder of a batch: what has been done is kept at once, in the order of the trials, and never twice.
//!
//! `batch.json` marks the folder and says what the batch is, `trials.csv` has a row per trial, and
//! `errors.csv` and `positions.csv` more of each, where they are kept. A trial counts as done once its row in
//! `trials.csv` is whole, and that is written last. Rows that a killed batch has left unfinished are dropped.

use std::{
    fmt::Write as _,
    fs::{self, File, OpenOptions, TryLockError},
    io::{self, ErrorKind, Seek, SeekFrom, Write},
    path::{Path, PathBuf},
};

use anyhow::{Context, anyhow, bail, ensure};
use arena_daemon::trial::{Record, TOLERANCES_M};
use serde::Serialize;

use super::{
    Keep,
    plan::{Identity, Plan, Trial, scenario_difference},
};

const BATCH: &str = "batch.json";
const SCENARIO: &str = "scenario.toml";
const TRIALS: &str = "trials.csv";
const SUMMARY: &str = "summary.json";

/// Columns of `trials.csv` before those of the sweeps.
const KEYS: [&str; 4] = ["setting", "trial", "seed", "robots"];
/// Columns of `trials.csv` that name no sweep.
pub(crate) const COLUMNS: [&str; 32] = [
    "setting",
    "trial",
    "seed",
    "robots",
    "ended",
    "ticks",
    "virtual_time_s",
    "mean_below_1e-3_s",
    "mean_below_1e-4_s",
    "mean_below_1e-5_s",
    "mean_below_1e-6_s",
    "mean_below_1e-7_s",
    "max_below_1e-3_s",
    "max_below_1e-4_s",
    "max_below_1e-5_s",
    "max_below_1e-6_s",
    "max_below_1e-7_s",
    "mean_error_m",
    "max_error_m",
    "mean_true_error_m",
    "cost_h",
    "exact_cost_h",
    "cell_agreement",
    "mean_peak_distance_m",
    "mean_lamp_distance_m",
    "robots_alive",
    "robots_paused",
    "robots_without_error",
    "robots_without_mass",
    "packets_in_range",
    "packets_heard",
    "digest",
];
const ERRORS: [&str; 5] = ["setting", "trial", "time_s", "mean_error_m", "max_error_m"];
const POSITIONS: [&str; 8] = ["setting", "trial", "robot", "start_x_m", "start_y_m", "x_m", "y_m", "alive"];

/// What is kept of one trial.
#[derive(Debug)]
pub(crate) struct Done {
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
    /// What else is kept of each trial.
    kept: Vec<(Keep, Table)>,
    /// Holds the lock.
    _batch: File,
}

impl Folder {
    /// Makes the folder of `plan`, or goes on with it where it was left.
    ///
    /// # Errors
    /// If the folder holds something else, another batch, or this one while it is at work; or if its files
    /// are not those of this batch.
    pub(crate) fn open(path: &Path, plan: &Plan) -> anyhow::Result<Self> {
        let shown = path.display();
        refuse_foreign(path)?;
        fs::create_dir_all(path)
            .with_context(|| format!("cannot make the folder {shown}; give --out another one"))?;
        let batch = ours(path, &plan.identity)?;
        let scenario = path.join(SCENARIO);
        let here = plan.base.to_toml();
        match fs::read_to_string(&scenario) {
            Ok(there) => {
                if let Some(difference) = scenario_difference(&scenario, &there, &here) {
                    bail!(
                        "{shown} holds a batch of another scenario: {difference}; give --out another folder"
                    );
                }
            }
            Err(error) if error.kind() == ErrorKind::NotFound => {
                fs::write(&scenario, here).with_context(|| format!("cannot write {}", scenario.display()))?
            }
            Err(error) => {
                return Err(error).with_context(|| format!("cannot read {}", scenario.display()));
            }
        }
        let mut trials = Table::open(path.join(TRIALS), &header(plan))?;
        let (mut ends, ticks) = trials.rows_of(plan)?;
        let mut kept = Vec::new();
        for &keep in &plan.identity.keep {
            let table = Table::open(path.join(keep.file()), &keep.header())?;
            let rows = |index: usize| keep.rows(&plan.trial(index), ticks[index]);
            let blocks = table.blocks_of(plan, ticks.len(), rows)?;
            ends.truncate(blocks.len());
            kept.push((keep, table, blocks));
        }
        let done = ends.len() - 1;
        trials.cut(ends[done])?;
        let kept = kept
            .into_iter()
            .map(|(keep, mut table, blocks)| table.cut(blocks[done]).map(|()| (keep, table)))
            .collect::<anyhow::Result<_>>()?;
        Ok(Self { path: path.to_path_buf(), done, trials, kept, _batch: batch })
    }

    /// Number of trials that are done.
    pub(crate) fn done(&self) -> usize {
        self.done
    }

    /// Keeps the next trial.
    pub(crate) fn add(&mut self, trial: &Trial<'_>, done: &Done) -> anyhow::Result<()> {
        for (keep, table) in &mut self.kept {
            match keep {
                Keep::Errors => table.add(done.record.errors.iter().map(|sample| {
                    let numbers = [Some(sample.time_s), sample.mean_m, sample.max_m];
                    keys(trial).into_iter().chain(numbers.map(perhaps)).collect()
                }))?,
                Keep::Positions => {
                    table.add(done.record.places.iter().enumerate().map(|(robot, place)| {
                        let [[x, y], [end_x, end_y]] = [place.start_m, place.end_m];
                        let numbers = [x, y, end_x, end_y].map(number);
                        let [robot, alive] = [robot.to_string(), place.alive.to_string()];
                        keys(trial).into_iter().chain([robot]).chain(numbers).chain([alive]).collect()
                    }))?
                }
            }
        }
        self.trials.add([row(trial, done)])?;
        self.done += 1;
        Ok(())
    }

    /// Every row of `trials.csv`, as text.
    pub(crate) fn rows(&self) -> anyhow::Result<Vec<csv::StringRecord>> {
        let mut reader = csv::Reader::from_path(&self.trials.path)?;
        Ok(reader.records().collect::<Result<_, _>>()?)
    }

    /// The columns of `trials.csv`.
    pub(crate) fn columns(&self, plan: &Plan) -> Vec<String> {
        header(plan)
    }

    /// Writes `summary.json`.
    pub(crate) fn finish(&self, summary: &impl Serialize) -> anyhow::Result<String> {
        let mut text = serde_json::to_string_pretty(summary).context("a summary is plain data")?;
        text.push('\n');
        let path = self.path.join(SUMMARY);
        fs::write(&path, &text).with_context(|| format!("cannot write {}", path.display()))?;
        Ok(text)
    }
}

/// Refuses a folder that holds something which is no batch.
fn refuse_foreign(path: &Path) -> anyhow::Result<()> {
    let shown = path.display();
    ensure!(!path.exists() || path.is_dir(), "{shown} is a file; give --out the name of a folder");
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

/// The mark of the folder, locked; it must be that of `identity`.
fn ours(folder: &Path, identity: &Identity) -> anyhow::Result<File> {
    let (path, shown) = (folder.join(BATCH), folder.display());
    if !path.exists() {
        // Whole or not at all, also if we are killed here.
        let draft = folder.join(format!("{BATCH}.{}", std::process::id()));
        let mut text = serde_json::to_string_pretty(identity).context("an identity is plain data")?;
        text.push('\n');
        fs::write(&draft, text)
            .and_then(|()| fs::rename(&draft, &path))
            .with_context(|| format!("cannot write {}", path.display()))?;
    }
    let file = File::open(&path).with_context(|| format!("cannot open {}", path.display()))?;
    match file.try_lock() {
        Ok(()) => {}
        Err(TryLockError::WouldBlock) => bail!("another `lamplight batch` is at work in {shown}"),
        Err(TryLockError::Error(error)) => {
            return Err(error).with_context(|| format!("cannot lock {}", path.display()));
        }
    }
    let there: Identity = serde_json::from_reader(&file)
        .with_context(|| format!("{} is not a batch's; give --out another folder", path.display()))?;
    match there.difference(identity) {
        Some(difference) => {
            bail!("{shown} holds another batch: {difference}; give --out another folder, or the same command")
        }
        None => Ok(file),
    }
}

/// A CSV file that grows by whole rows.
#[derive(Debug)]
struct Table {
    path: PathBuf,
    file: File,
    /// What the file held when it was opened.
    text: String,
}

impl Table {
    /// Opens a file and sees that it has these columns; begins it if it is new.
    fn open(path: PathBuf, columns: &[String]) -> anyhow::Result<Self> {
        let shown = path.display();
        let header = lines([columns.to_vec()])?;
        let mut file = OpenOptions::new()
            .read(true)
            .write(true)
            .create(true)
            .truncate(false)
            .open(&path)
            .with_context(|| format!("cannot open {shown}"))?;
        let mut text = io::read_to_string(&file).with_context(|| format!("cannot read {shown}"))?;
        if !text.starts_with(&header) {
            // A header that was cut short is no more than the beginning of a file.
            ensure!(
                header.starts_with(&text),
                "{shown} has other columns than this batch; give --out another folder"
            );
            text = header;
            file.set_len(0)?;
            file.rewind()?;
            file.write_all(text.as_bytes()).with_context(|| format!("cannot write {shown}"))?;
        }
        Ok(Self { path, file, text })
    }

    /// The whole rows below the header: where each ends, and its fields.
    fn whole_rows(&self) -> impl Iterator<Item = (usize, csv::StringRecord)> {
        let mut end = 0;
        let lines = self.text.split_inclusive('\n').filter(|line| line.ends_with('\n'));
        let rows = lines.map(move |line| {
            end += line.len();
            let mut reader = csv::ReaderBuilder::new().has_headers(false).from_reader(line.as_bytes());
            (end, reader.records().next().and_then(Result::ok).unwrap_or_default())
        });
        rows.skip(1)
    }

    fn header_bytes(&self) -> usize {
        self.text.find('\n').map_or(0, |end| end + 1)
    }

    /// For `trials.csv`: where each trial ends (and before them all, where the header does), and its ticks.
    fn rows_of(&self, plan: &Plan) -> anyhow::Result<(Vec<usize>, Vec<u64>)> {
        let columns = header(plan);
        let ticks_at = columns.iter().position(|column| column == "ticks").expect("it is one of ours");
        let (mut ends, mut ticks) = (vec![self.header_bytes()], Vec::new());
        for (index, (end, fields)) in self.whole_rows().enumerate() {
            let named = || format!("{}, line {}", self.path.display(), index + 2);
            ensure!(index < plan.len(), "{}: the batch has no more than {} trials", named(), plan.len());
            let expected = keys_of_row(&plan.trial(index));
            let ours = fields.len() == columns.len() && fields.iter().zip(&expected).all(|(a, b)| a == b);
            let count = fields.get(ticks_at).and_then(|ticks| ticks.parse().ok());
            match count.filter(|_| ours) {
                Some(count) => {
                    ends.push(end);
                    ticks.push(count);
                }
                None => bail!(
                    "{}: this is not trial {} of setting {} of this batch; something else has changed the file; \
                     give --out another folder",
                    named(),
                    expected[1],
                    expected[0]
                ),
            }
        }
        Ok((ends, ticks))
    }

    /// For a file with several rows per trial: where each of the first `done` trials ends (and before them
    /// all, where the header does), as far as their rows are all there.
    fn blocks_of(&self, plan: &Plan, done: usize, rows: impl Fn(usize) -> u64) -> anyhow::Result<Vec<usize>> {
        let mut ends = vec![self.header_bytes()];
        let mut table = self.whole_rows().peekable();
        for index in 0..done {
            let expected = keys(&plan.trial(index));
            let mut end = None;
            for _ in 0..rows(index) {
                let ours = |(_, fields): &(usize, csv::StringRecord)| {
                    fields.iter().zip(&expected).all(|(a, b)| a == b)
                };
                match table.next_if(ours) {
                    Some((at, _)) => end = Some(at),
                    None => return Ok(ends),
                }
            }
            ends.extend(end);
        }
        Ok(ends)
    }

    /// Drops everything from byte `end` on; what comes goes there.
    fn cut(&mut self, end: usize) -> anyhow::Result<()> {
        let end = end as u64;
        let mut mend = || {
            if self.text.len() as u64 > end {
                tracing::info!("{}: the rows of an unfinished trial are dropped", self.path.display());
                self.file.set_len(end)?;
            }
            self.file.seek(SeekFrom::Start(end))
        };
        mend().with_context(|| format!("cannot mend {}", self.path.display()))?;
        self.text = String::new();
        Ok(())
    }

    fn add(&mut self, rows: impl IntoIterator<Item = Vec<String>>) -> anyhow::Result<()> {
        let text = lines(rows)?;
        self.file.write_all(text.as_bytes()).with_context(|| format!("cannot write {}", self.path.display()))
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

/// What tells a trial apart in every file.
fn keys(trial: &Trial<'_>) -> Vec<String> {
    vec![trial.setting.to_string(), trial.trial.to_string()]
}

/// The first fields of a trial's row: [`KEYS`] and the swept values.
fn keys_of_row(trial: &Trial<'_>) -> Vec<String> {
    let mut keys = keys(trial);
    keys.extend([trial.scenario.seed.to_string(), trial.scenario.robot_count().to_string()]);
    keys.extend(trial.of.values.iter().cloned());
    keys
}

fn row(trial: &Trial<'_>, Done { record, exact_cost_h }: &Done) -> Vec<String> {
    let end = &record.end;
    let ended = serde_json::to_value(record.ended).expect("an ending is a word");
    let mut row = keys_of_row(trial);
    row.extend([ended.as_str().unwrap_or_default().into(), record.ticks.to_string()]);
    row.push(number(record.virtual_time_s));
    row.extend(record.mean_below_s.map(perhaps));
    row.extend(record.max_below_s.map(perhaps));
    row.extend([end.mean_error_m, end.max_error_m, end.mean_true_error_m, end.cost_h].map(perhaps));
    row.extend([*exact_cost_h, end.cell_agreement].map(perhaps));
    row.extend([end.mean_peak_distance_m, end.mean_lamp_distance_m].map(perhaps));
    let robots = [end.robots_alive, end.robots_paused, end.robots_without_error, end.robots_without_mass];
    row.extend(robots.map(|count| count.to_string()));
    row.extend([end.packets.in_range, end.packets.heard].map(|count| count.to_string()));
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

/// Rows as CSV has them.
fn lines(rows: impl IntoIterator<Item = Vec<String>>) -> anyhow::Result<String> {
    let mut writer = csv::Writer::from_writer(Vec::new());
    rows.into_iter().try_for_each(|row| writer.write_record(row))?;
    let bytes = writer.into_inner().map_err(|error| anyhow!("{error}"))?;
    Ok(String::from_utf8(bytes)?)
}

const _: () = assert!(TOLERANCES_M.len() == 5, "COLUMNS names each tolerance twice");
