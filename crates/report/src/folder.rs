//! Kinds of result folders, and where a report goes.

use std::{
    fs,
    path::{Path, PathBuf},
};

use crate::{
    error::ReportError,
    page::{self, Page},
    svg,
};

/// Content of a folder.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Results of `lamplight run --out`.
    Run,
    /// Results of `lamplight batch --out`.
    Batch,
    /// Runs and batches for the paper's page.
    Paper,
}

/// The kind of the folder `folder`.
pub fn kind(folder: &Path) -> Result<Kind, ReportError> {
    if !folder.is_dir() {
        return Err(ReportError::NoFolder { folder: folder.display().to_string() });
    }
    let marks = [("paper.json", Kind::Paper), ("batch.json", Kind::Batch), ("metrics.csv", Kind::Run)];
    marks
        .into_iter()
        .find_map(|(mark, kind)| folder.join(mark).is_file().then_some(kind))
        .ok_or_else(|| ReportError::NotOurs { folder: folder.display().to_string() })
}

/// Writes `page` to `path`, and its figures into `figures/` beside it, each whole or not at all. Of files in the way
/// only our own are written over, and nothing is written if one is not.
pub fn write(page: &Page, path: &Path) -> Result<(), ReportError> {
    let beside = path.parent().unwrap_or(Path::new("")).join("figures");
    let mut all: Vec<(PathBuf, String, &str)> = Vec::new();
    for (name, figure) in page.figures().flat_map(page::Figure::files) {
        all.push((beside.join(format!("{name}.svg")), figure.file(&name), svg::MARK));
    }
    // The page comes last: where it is, everything is.
    all.push((path.to_path_buf(), page.html(), page::MARK));
    for (file, _, mark) in &all {
        refuse_to_overwrite(file, mark)?;
    }
    let made = if all.len() > 1 { beside } else { path.parent().unwrap_or(Path::new("")).to_path_buf() };
    fs::create_dir_all(&made).map_err(|error| ReportError::io(&made, error))?;
    for (file, text, _) in &all {
        files::replace(file, text)?;
    }
    Ok(())
}

fn refuse_to_overwrite(file: &Path, mark: &str) -> Result<(), ReportError> {
    if !file.exists() {
        return Ok(());
    }
    let ours = fs::read_to_string(file).is_ok_and(|text| text.contains(mark));
    if ours { Ok(()) } else { Err(ReportError::InTheWay { file: file.display().to_string() }) }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn folder_with(files: &[&str]) -> tempfile::TempDir {
        let folder = tempfile::tempdir().unwrap();
        files.iter().for_each(|file| fs::write(folder.path().join(file), "").unwrap());
        folder
    }

    #[test]
    fn a_folder_is_known_by_its_mark() {
        let marks = [
            (vec!["summary.json", "metrics.csv", "scenario.toml"], Kind::Run),
            (vec!["batch.json", "trials.csv"], Kind::Batch),
            (vec!["paper.json"], Kind::Paper),
        ];
        for (files, expected) in marks {
            assert_eq!(kind(folder_with(&files).path()).unwrap(), expected);
        }
    }

    #[test]
    fn a_folder_that_is_no_run_is_told_what_was_looked_for() {
        let error = kind(folder_with(&["notes.txt"]).path()).unwrap_err().to_string();
        assert!(error.contains("looked for metrics.csv, batch.json, paper.json"), "{error}");
        let error = kind(Path::new("/no/such/folder")).unwrap_err().to_string();
        assert!(error.contains("/no/such/folder is no folder"), "{error}");
    }

    #[test]
    fn only_what_is_ours_is_written_over() {
        let folder = folder_with(&[]);
        let path = folder.path().join("report.html");
        let page = Page { title: "one".into(), lead: Vec::new(), sections: Vec::new() };
        write(&page, &path).unwrap();
        write(&Page { title: "two".into(), ..page.clone() }, &path).unwrap();
        assert!(fs::read_to_string(&path).unwrap().contains("two"));
        fs::write(&path, "my own notes").unwrap();
        let error = write(&page, &path).unwrap_err().to_string();
        assert!(error.contains("was not written by `lamplight report`"), "{error}");
        assert_eq!(fs::read_to_string(&path).unwrap(), "my own notes");
    }
}
