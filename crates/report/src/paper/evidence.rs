//! The runs and batches behind the page, and series drawn from them.

use std::{
    collections::BTreeSet,
    fs,
    path::{Path, PathBuf},
};

use crate::{
    batch::{Batch, Setting},
    chart::Series,
    error::ReportError,
    page::{Block, Mark},
    run::Run,
    stats::Stats,
};

use super::chapter::Chapter;

/// A folder of results.
pub(super) struct Evidence {
    folder: PathBuf,
}

impl Evidence {
    pub(super) fn in_folder(folder: &Path) -> Self {
        Self { folder: folder.to_owned() }
    }

    /// The batch of this name; `None` if it is not there.
    pub(super) fn batch(&self, name: &str) -> Result<Option<Batch>, ReportError> {
        let folder = self.folder.join(name);
        folder.join("trials.csv").is_file().then(|| Batch::read(&folder)).transpose()
    }

    /// The run of this name; `None` if it is not there.
    pub(super) fn run(&self, name: &str) -> Result<Option<Run>, ReportError> {
        let folder = self.folder.join(name);
        folder.join("metrics.csv").is_file().then(|| Run::read(&folder)).transpose()
    }

    /// Ends a chapter: the commands that made `names`, and what their readers should know.
    pub(super) fn commands(&self, chapter: &mut Chapter, names: &[&str]) -> Result<(), ReportError> {
        let command = |name: &&str| fs::read_to_string(self.folder.join(name).join("command.txt")).ok();
        let commands: Vec<String> =
            names.iter().filter_map(command).map(|text| text.trim_end().to_owned()).collect();
        for name in names {
            let notes = self.batch(name)?.map(|batch| batch.notes).unwrap_or_default();
            notes.into_iter().for_each(|note| chapter.add(Block::Note(format!("{name}: {note}"))));
        }
        if !commands.is_empty() {
            chapter.add(Block::Command(commands.join("\n")));
        }
        Ok(())
    }

    /// Compares the trials of two batches by their digests, and says so: how many of `processes` are the
    /// same, bit for bit, as in `inside`.
    pub(super) fn same_as_processes(
        &self,
        chapter: &mut Chapter,
        claim: &'static str,
        inside: &Batch,
        processes: &str,
    ) -> Result<(), ReportError> {
        let Some(batch) = self.batch(processes)? else {
            chapter.missing(claim, processes);
            return Ok(());
        };
        let (ours, theirs) = (inside.digests()?, batch.digests()?);
        let same = theirs.iter().filter(|(key, digest)| ours.get(key) == Some(digest)).count();
        let (all, first) = (theirs.len(), theirs.values().next().cloned().unwrap_or_default());
        chapter.say(
            "With a process per robot:",
            format!(
                "{same} of {all} trials of {processes}/ have the digest that the in-process engine has for the same \
                 seed (the first is {first}). A digest is a hash over every pose and every packet heard, so the two \
                 did the same to the last bit."
            ),
        );
        let mark = if same == all && all > 0 { Mark::Yes } else { Mark::No };
        chapter.verdict(claim, mark, format!("{same} of {all} digests equal"));
        Ok(())
    }
}

/// H over H under the exact controller, trial by trial.
pub(super) fn ratios(batch: &Batch, setting: &Setting) -> Result<Vec<f64>, ReportError> {
    let (cost, exact) = (batch.trials.numbers("cost_h")?, batch.trials.numbers("exact_cost_h")?);
    Ok(setting.rows.iter().filter_map(|&row| Some(cost[row]? / exact[row]?)).collect())
}

/// Value of a swept key in a setting, by the last word of the key.
pub(super) fn swept<'a>(batch: &Batch, setting: &'a Setting, word: &str) -> Option<&'a str> {
    let at = batch.meta.sweeps.iter().position(|sweep| sweep.key.rsplit('.').next() == Some(word))?;
    setting.values.get(at).map(String::as_str)
}

/// The same as a number.
pub(super) fn swept_number(batch: &Batch, setting: &Setting, word: &str) -> Option<f64> {
    swept(batch, setting, word)?.parse().ok()
}

/// One series per name: a point per setting, the mean and standard deviation of what `values` has of it.
pub(super) fn series(
    batch: &Batch,
    x: impl Fn(&Setting) -> Option<f64>,
    name: impl Fn(&Setting) -> String,
    values: impl Fn(&Setting) -> Result<Vec<f64>, ReportError>,
) -> Result<Vec<Series>, ReportError> {
    let mut all: Vec<Series> = Vec::new();
    for setting in &batch.settings {
        let (Some(x), Some(stats)) = (x(setting), Stats::of(&values(setting)?)) else { continue };
        let (name, point) = (name(setting), (x, stats.mean, stats.sd));
        match all.iter_mut().find(|(other, _)| *other == name) {
            Some((_, points)) => points.push(point),
            None => all.push((name, vec![point])),
        }
    }
    all.iter_mut().for_each(|(_, points)| points.sort_by(|a, b| a.0.total_cmp(&b.0)));
    Ok(all)
}

/// How many different settings a batch has along robots.
pub(super) fn robot_counts(batch: &Batch) -> BTreeSet<u32> {
    batch.settings.iter().map(|setting| setting.robots).collect()
}
