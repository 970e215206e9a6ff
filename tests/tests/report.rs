//! `lamplight report`, as a user would use it.

#![allow(clippy::unwrap_used, reason = "these are tests, helpers included")]

use std::{
    ffi::OsStr,
    fs,
    path::{Path, PathBuf},
    process::Output,
};

use tempfile::TempDir;
use tests::programs::{lamplight, said, scenario};

fn report(folder: &Path) -> Output {
    lamplight([OsStr::new("report"), folder.as_os_str()]).output().unwrap()
}

fn reported(folder: &Path) -> String {
    let output = report(folder);
    assert!(output.status.success(), "{}", said(&output));
    let path = String::from_utf8(output.stdout).unwrap();
    fs::read_to_string(path.trim_end()).unwrap()
}

fn refused(folder: &Path) -> String {
    let output = report(folder);
    assert_eq!(output.status.code(), Some(2), "{}", said(&output));
    String::from_utf8(output.stderr).unwrap()
}

fn made(command: &str, name: &str, out: &Path, args: &[&str]) {
    let file = scenario(name);
    let start = [OsStr::new(command), file.as_os_str(), OsStr::new("--out"), out.as_os_str()];
    let output = lamplight(start).args(["--engine", "in-process", "--quiet"]).args(args).output().unwrap();
    assert!(output.status.success(), "{}", said(&output));
}

struct Place(TempDir);

impl Place {
    fn new() -> Self {
        Self(tempfile::tempdir().unwrap())
    }

    fn at(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    fn run(&self) -> PathBuf {
        let out = self.at("run");
        let fault = "fault=[{ kind = \"kill\", at_s = 4, robots = \"3\" }]";
        made(
            "run",
            "swarmbots",
            &out,
            &["--duration", "8", "--set", "output.poses_every_s=0.5", "--set", fault],
        );
        out
    }

    fn batch(&self) -> PathBuf {
        let out = self.at("batch");
        made(
            "batch",
            "one-gaussian",
            &out,
            &[
                "--trials",
                "3",
                "--robots",
                "5,9",
                "--duration",
                "6",
                "--sweep",
                "controller.gain_per_s=2,5",
                "--keep",
                "errors,positions",
            ],
        );
        out
    }
}

/// Every drawing of a page is XML with words on both axes and something to read for who cannot see it.
fn assert_drawings(html: &str, at_least: usize) {
    let drawings: Vec<&str> =
        html.split("<svg").skip(1).map(|rest| rest.split_inclusive("</svg>").next().unwrap()).collect();
    assert!(drawings.len() >= at_least, "{} drawings", drawings.len());
    for drawing in drawings {
        let text = format!("<svg{drawing}");
        let document = roxmltree::Document::parse(&text).unwrap();
        assert!(!document.root_element().attribute("aria-label").unwrap().is_empty());
        let words: Vec<&str> = document
            .descendants()
            .filter(|node| node.has_tag_name("text"))
            .filter_map(|node| node.text())
            .filter(|text| text.chars().any(char::is_alphabetic))
            .collect();
        assert!(words.len() >= 2, "axes without words: {words:?}");
    }
}

/// A page that opens offline asks for nothing.
fn assert_self_contained(html: &str) {
    for asking in ["src=", "href=\"http", "@import", "url(http", "<script", "<link"] {
        assert!(!html.contains(asking), "{asking} in the page");
    }
    assert!(html.contains("prefers-color-scheme:dark") && html.contains("@media print"));
}

#[test]
fn the_report_of_a_run_shows_it_from_start_to_end() {
    let place = Place::new();
    let run = place.run();
    let html = reported(&run);
    assert_drawings(&html, 7);
    assert_self_contained(&html);
    for expected in ["trajectories", "coverage cost H", "kill", "digest"] {
        assert!(html.contains(expected), "no {expected}");
    }
    assert!(run.join("figures/configuration-1.svg").is_file());
}

#[test]
fn the_report_of_a_batch_shows_distributions_sweeps_and_densities() {
    let place = Place::new();
    let html = reported(&place.batch());
    assert_drawings(&html, 12);
    assert_self_contained(&html);
    for expected in ["n = 5, gain_per_s = 2", "controller.gain_per_s (1/s)", "robots per m²"] {
        assert!(html.contains(expected), "no {expected}");
    }
}

#[test]
fn the_same_folder_gives_the_same_bytes() {
    let place = Place::new();
    for folder in [place.run(), place.batch()] {
        let first = reported(&folder);
        assert_eq!(first, reported(&folder));
    }
}

#[test]
fn every_figure_has_a_file_of_its_own_that_is_xml() {
    let place = Place::new();
    let batch = place.batch();
    reported(&batch);
    let files: Vec<_> =
        fs::read_dir(batch.join("figures")).unwrap().map(|entry| entry.unwrap().path()).collect();
    assert!(files.len() >= 8);
    for file in files {
        roxmltree::Document::parse(&fs::read_to_string(&file).unwrap()).unwrap();
    }
}

#[test]
fn the_papers_page_says_what_is_missing_and_judges_what_is_there() {
    let place = Place::new();
    let paper = place.at("paper");
    fs::create_dir(&paper).unwrap();
    fs::write(paper.join("paper.json"), "{\"version\":\"quick\"}\n").unwrap();
    let empty = reported(&paper);
    assert_eq!(empty.matches("– missing").count(), 11, "every section says so");
    let to_end = ["--set", "step_s=0.05", "--set", "convergence.stop=true", "--duration", "300"];
    let trials = ["--trials", "12", "--robots", "10", "--keep", "errors,positions"];
    made("batch", "one-gaussian", &paper.join("table1-10"), &[trials.as_slice(), &to_end].concat());
    let html = reported(&paper);
    assert!(html.contains("9.56 ± 3.18") && html.contains("29.9 ± 5.9"));
    assert!(html.contains("✗ not reproduced") && html.contains("agrees with an independent implementation"));
    assert_drawings(&html, 4);
    assert_self_contained(&html);
}

#[test]
fn a_folder_that_is_nothing_of_ours_is_refused_and_left_alone() {
    let place = Place::new();
    assert!(refused(&place.at("nowhere")).contains("is no folder"));
    let folder = place.at("else");
    fs::create_dir(&folder).unwrap();
    fs::write(folder.join("notes.txt"), "mine").unwrap();
    let error = refused(&folder);
    assert!(error.contains("holds no run, no batch and no paper"), "{error}");
    assert_eq!(fs::read_dir(&folder).unwrap().count(), 1);
}

#[test]
fn what_others_have_written_is_not_overwritten() {
    let place = Place::new();
    let batch = place.batch();
    fs::write(batch.join("report.html"), "mine").unwrap();
    let error = refused(&batch);
    assert!(error.contains("was not written by `lamplight report`"), "{error}");
    assert_eq!(fs::read_to_string(batch.join("report.html")).unwrap(), "mine");
    assert!(!batch.join("figures").exists());
}

#[test]
fn a_row_that_was_cut_short_is_left_out_and_told_of() {
    let place = Place::new();
    let batch = place.batch();
    let path = batch.join("trials.csv");
    let text = fs::read_to_string(&path).unwrap();
    fs::write(&path, &text[..text.len() - 20]).unwrap();
    fs::remove_file(batch.join("summary.json")).unwrap();
    let html = reported(&batch);
    assert!(html.contains("The last row of trials.csv (line 13) is broken"));
    assert!(html.contains("The batch is not finished"));
    fs::write(&path, text.replacen("\n0,0,1,5,", "\n0,0,1,five,", 1)).unwrap();
    let error = refused(&batch);
    assert!(error.contains("trials.csv:2: ") && error.contains("not a whole number"), "{error}");
}
