//! A CSV file of a batch: rows of trial after trial, those of a trial together.
//!
//! [`Sheet`] is what was there when it was opened, [`Table`] what grows from then on.

use std::{
    collections::BTreeSet,
    fs,
    io::ErrorKind,
    ops::Range,
    path::{Path, PathBuf},
};

use anyhow::{Context, anyhow, bail, ensure};
use files::{Lines, WriteError};

use super::{
    super::{columns::LOST_AGENTS, plan::Plan},
    keys::keys_of_row,
};

/// The text of a table.
#[derive(Debug)]
pub(super) struct Sheet {
    path: PathBuf,
    columns: Vec<String>,
    header: String,
    text: String,
}

/// A table that grows by whole rows.
#[derive(Debug)]
pub(super) struct Table {
    lines: Lines,
}

/// The rows of one trial in the text of a table.
#[derive(Clone, Debug)]
pub(super) struct Block {
    /// Number of the trial in the plan.
    pub(super) trial: usize,
    pub(super) rows: u64,
    range: Range<usize>,
}

/// A trial's row in the text of `trials.csv`.
#[derive(Clone, Debug)]
pub(super) struct Row {
    /// Number of the trial in the plan.
    pub(super) trial: usize,
    /// How many it has played; `None` if it has lost agents.
    pub(super) ticks: Option<u64>,
}

impl Sheet {
    /// Reads the table at `path`, which has these columns, or will have them.
    ///
    /// # Errors
    /// If it has others, or cannot be read.
    pub(super) fn read(path: &Path, columns: Vec<String>) -> anyhow::Result<Self> {
        let header = lines([columns.clone()])?;
        let text = match fs::read_to_string(path) {
            Ok(text) => text,
            Err(error) if error.kind() == ErrorKind::NotFound => String::new(),
            Err(error) => return Err(error).with_context(|| format!("cannot read {}", path.display())),
        };
        // A header that was cut short is no more than the beginning of a file.
        let text = if header.starts_with(&text) { header.clone() } else { text };
        ensure!(
            text.starts_with(&header),
            "{} has other columns than this batch; give --out another folder",
            path.display()
        );
        Ok(Self { path: path.into(), columns, header, text })
    }

    /// The whole rows below the header: where each is, and its fields.
    fn whole_rows(&self) -> impl Iterator<Item = (Range<usize>, csv::StringRecord)> {
        let mut end = self.header.len();
        let lines = self.text[end..].split_inclusive('\n').filter(|line| line.ends_with('\n'));
        lines.map(move |line| {
            let start = end;
            end += line.len();
            let mut reader = csv::ReaderBuilder::new().has_headers(false).from_reader(line.as_bytes());
            (start..end, reader.records().next().and_then(Result::ok).unwrap_or_default())
        })
    }

    /// For `trials.csv`: its rows.
    ///
    /// # Errors
    /// If there is one that is no trial of `plan`, or two of one.
    pub(super) fn trials_of(&self, plan: &Plan) -> anyhow::Result<Vec<Row>> {
        let at =
            |name: &str| self.columns.iter().position(|column| column == name).expect("it is one of ours");
        let (ended_at, ticks_at) = (at("ended"), at("ticks"));
        let mut seen = BTreeSet::new();
        let mut rows = Vec::new();
        for (line, (_, fields)) in self.whole_rows().enumerate() {
            let refused = |what: String| {
                let (path, line) = (self.path.display(), line + 2);
                anyhow!(
                    "{path}, line {line}: {what}; something else has changed the file; give --out another folder"
                )
            };
            let trial =
                trial_of(&fields, plan).ok_or_else(|| refused("this is no trial of this batch".into()))?;
            let expected = keys_of_row(&plan.trial(trial));
            let is_ours =
                fields.len() == self.columns.len() && fields.iter().zip(&expected).all(|(a, b)| a == b);
            let ticks = match &fields {
                _ if !is_ours => None,
                fields if &fields[ended_at] == LOST_AGENTS => Some(None),
                fields => fields[ticks_at].parse().ok().map(Some),
            };
            match ticks {
                Some(ticks) if seen.insert(trial) => rows.push(Row { trial, ticks }),
                Some(_) => bail!(refused("this trial is there twice".into())),
                None => {
                    let [setting, trial] = [&expected[0], &expected[1]];
                    bail!(refused(format!("this is not trial {trial} of setting {setting} of this batch")))
                }
            }
        }
        Ok(rows)
    }

    /// Rows that follow each other and are of one trial of `plan`, as they come.
    pub(super) fn blocks_of(&self, plan: &Plan) -> Vec<Block> {
        let mut blocks: Vec<Block> = Vec::new();
        for (range, fields) in self.whole_rows() {
            let Some(trial) = trial_of(&fields, plan) else { continue };
            match blocks.last_mut().filter(|last| last.trial == trial && last.range.end == range.start) {
                Some(last) => (last.range.end, last.rows) = (range.end, last.rows + 1),
                None => blocks.push(Block { trial, rows: 1, range }),
            }
        }
        blocks
    }

    /// The table with these of its blocks alone, in this order. If they are where they belong already, what follows
    /// them is cut off; else the file is written anew, whole or not at all.
    pub(super) fn with_only(self, blocks: &[Block]) -> Result<Table, WriteError> {
        let Self { path, header, text, .. } = self;
        let in_place = blocks
            .iter()
            .try_fold(header.len(), |end, block| (block.range.start == end).then_some(block.range.end));
        let length = match in_place {
            // The header may not be there.
            Some(_) if blocks.is_empty() && text == header => None,
            length => length,
        };
        let length = match length {
            Some(length) => length,
            None => {
                let rows: String = blocks.iter().map(|block| &text[block.range.clone()]).collect();
                let all = header + &rows;
                files::replace(&path, &all)?;
                all.len()
            }
        };
        Ok(Table { lines: Lines::go_on(&path, length as u64)? })
    }
}

impl Table {
    /// Where it is.
    pub(super) fn path(&self) -> &Path {
        self.lines.path()
    }

    pub(super) fn add(&mut self, rows: impl IntoIterator<Item = Vec<String>>) -> anyhow::Result<()> {
        Ok(self.lines.add(lines(rows)?.as_bytes())?)
    }
}

/// Number of the trial in the plan that a row is of, by its first two fields.
fn trial_of(fields: &csv::StringRecord, plan: &Plan) -> Option<usize> {
    let (setting, trial) = (fields.get(0)?, fields.get(1)?);
    plan.number(setting.parse().ok()?, trial.parse().ok()?)
}

/// Rows as CSV has them.
fn lines(rows: impl IntoIterator<Item = Vec<String>>) -> anyhow::Result<String> {
    let mut writer = csv::Writer::from_writer(Vec::new());
    rows.into_iter().try_for_each(|row| writer.write_record(row))?;
    let bytes = writer.into_inner().map_err(|error| anyhow!("{error}"))?;
    Ok(String::from_utf8(bytes)?)
}
