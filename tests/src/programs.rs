//! The real programs, started as a user would start them.

use std::{
    env,
    ffi::OsStr,
    fs,
    path::{Path, PathBuf},
    process::{Command, Output, Stdio},
};

use serde::Deserialize;
use serde_json::Value;
use tempfile::TempDir;

/// The program `name` that was built beside this test.
///
/// # Panics
/// If it was not: `cargo test` alone builds no other package's programs.
pub fn program(name: &str) -> PathBuf {
    let test = env::current_exe().expect("a test knows its own program");
    let folder = test.ancestors().nth(2).expect("a test lies in target/PROFILE/deps");
    let path = folder.join(name);
    assert!(
        path.is_file(),
        "{} is missing: run scripts/test, or cargo build --workspace first",
        path.display()
    );
    path
}

/// A scenario of the project.
pub fn scenario(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenarios").join(name).with_extension("toml")
}

/// `lamplight` with `args`, not yet started.
pub fn lamplight<S: AsRef<OsStr>>(args: impl IntoIterator<Item = S>) -> Command {
    let mut command = Command::new(program("lamplight"));
    command.args(args).stdin(Stdio::null()).env("LAMPLIGHT_PYTHON", interpreter_path());
    command
}

/// Python with the package that `scripts/test` has made; `None`, said aloud, where there is no Python.
///
/// # Panics
/// If there is one, and not the package.
pub fn interpreter() -> Option<PathBuf> {
    let is_new_enough = "import sys; sys.exit(sys.version_info < (3, 10))";
    let python = Command::new("python3").args(["-c", is_new_enough]).status();
    if !python.is_ok_and(|status| status.success()) {
        eprintln!("SKIPPED: there is no Python of version 3.10 or later");
        return None;
    }
    let path = interpreter_path();
    let has_package = Command::new(&path).args(["-c", "import lamplight"]).status();
    assert!(
        has_package.is_ok_and(|status| status.success()),
        "{} has no package lamplight: run scripts/test, which makes it",
        path.display()
    );
    Some(path)
}

fn interpreter_path() -> PathBuf {
    let test = env::current_exe().expect("a test knows its own program");
    test.ancestors().nth(3).expect("a test lies in target/PROFILE/deps").join("python/bin/python3")
}

/// Results of a finished run.
#[derive(Debug)]
pub struct Run {
    /// `summary.json`.
    pub summary: Value,
    folder: TempDir,
}

/// One row of `robots.csv`, as far as tests look at it.
#[derive(Clone, Debug, Deserialize)]
pub struct RobotRow {
    /// Index of the robot.
    pub robot: u32,
    /// Its life.
    pub incarnation: u16,
    /// Whether it was neither killed nor left out.
    pub alive: bool,
    /// Whether the plan had paused it at the end.
    pub paused: bool,
    /// Final position.
    pub x_m: f64,
    /// Final position.
    pub y_m: f64,
    /// Commands refused.
    pub commands_refused: u64,
    /// Deadlines missed in real time; nothing if nobody measured.
    pub missed_deadlines: Option<u64>,
}

impl Run {
    /// Runs `name` with `args` to its end.
    ///
    /// # Panics
    /// If it does not end with status 0.
    pub fn of(name: &str, args: &[&str]) -> Self {
        let folder = tempfile::tempdir().expect("a temporary folder can be made");
        let out = folder.path().join("out");
        let output = lamplight([OsStr::new("run"), scenario(name).as_os_str(), OsStr::new("--quiet")])
            .args(args)
            .arg("--out")
            .arg(&out)
            .output()
            .expect("lamplight starts");
        assert!(output.status.success(), "{name} {args:?}: {}", said(&output));
        Self::in_folder(folder)
    }

    /// Reads the results of a run in `out` below `folder`.
    ///
    /// # Panics
    /// If it left no summary.
    pub fn in_folder(folder: TempDir) -> Self {
        let summary = fs::read_to_string(folder.path().join("out/summary.json")).expect("a summary is left");
        Self { summary: serde_json::from_str(&summary).expect("a summary is JSON"), folder }
    }

    /// The digest.
    pub fn digest(&self) -> &str {
        self.summary["digest"].as_str().expect("a summary has a digest")
    }

    /// A number of the summary.
    pub fn number(&self, key: &str) -> f64 {
        self.summary[key].as_f64().unwrap_or_else(|| panic!("{key} is {}", self.summary[key]))
    }

    /// `robots.csv`.
    pub fn robots(&self) -> Vec<RobotRow> {
        self.rows("robots.csv")
    }

    /// Any table of the run.
    pub fn rows<T: for<'de> Deserialize<'de>>(&self, name: &str) -> Vec<T> {
        let path = self.folder.path().join("out").join(name);
        let mut reader = csv::Reader::from_path(&path).expect("the table is there");
        reader.deserialize().collect::<Result<_, _>>().expect("the table has the expected columns")
    }

    /// Any file of the run.
    pub fn file(&self, name: &str) -> PathBuf {
        self.folder.path().join("out").join(name)
    }
}

/// Records a run of `scenario` with `args` in a folder of its own in `folder`. Returns its summary and the recording.
///
/// # Panics
/// If it does not end with status 0.
pub fn recorded(folder: &TempDir, scenario: &Path, args: &[&str]) -> (Value, PathBuf) {
    let out = folder
        .path()
        .join(format!("out-{}", fs::read_dir(folder.path()).expect("the folder is there").count()));
    let output = lamplight(["run", "--quiet", "--json", "--record", "--out"])
        .arg(&out)
        .arg(scenario)
        .args(args)
        .output()
        .expect("lamplight starts");
    assert!(output.status.success(), "{}", said(&output));
    (serde_json::from_slice(&output.stdout).expect("a summary is JSON"), out.join("run.mcap"))
}

/// `command` with its arguments, before the program that it shall run; `None`, and a line that says so, where it does
/// not run even `true`: it is not installed, or not allowed to.
pub fn under(command: &[&str]) -> Option<Command> {
    let begun = || {
        let mut begun = Command::new(command[0]);
        begun.args(&command[1..]);
        begun
    };
    let tried = begun().arg("true").output();
    if !tried.as_ref().is_ok_and(|output| output.status.success()) {
        let why = tried.map_or_else(|error| error.to_string(), |output| said(&output));
        eprintln!("SKIPPED: {} cannot be used here: {why}", command.join(" "));
        return None;
    }
    Some(begun())
}

/// All that a program said, for a message.
pub fn said(output: &Output) -> String {
    format!(
        "{}\nstdout: {}\nstderr: {}",
        output.status,
        String::from_utf8_lossy(&output.stdout),
        String::from_utf8_lossy(&output.stderr)
    )
}
