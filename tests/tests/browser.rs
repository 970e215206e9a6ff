//! The live page in a browser, where Chromium is installed.

#![allow(clippy::unwrap_used, reason = "these are tests, helpers included")]

use std::{
    env,
    io::{BufRead, BufReader},
    path::{Path, PathBuf},
    process::{Child, Command, Stdio},
    sync::{Mutex, MutexGuard, PoisonError},
};

use rustix::process::{Pid, Signal, kill_process};
use tests::{
    live::LiveRun,
    programs::{lamplight, said, scenario},
};

/// A browser takes all of a small machine: one at a time.
fn alone() -> MutexGuard<'static, ()> {
    static ALONE: Mutex<()> = Mutex::new(());
    ALONE.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Playwright, which `scripts/test` has installed, and a browser; `None`, said aloud, where one is not there.
fn browser() -> Option<(PathBuf, PathBuf)> {
    let test = env::current_exe().unwrap();
    let playwright = test.ancestors().nth(3).unwrap().join("browser/node_modules/playwright-core");
    let paths = env::var_os("PATH").unwrap_or_default();
    let chromium = env::split_paths(&paths)
        .flat_map(|folder| ["chromium", "chromium-browser", "google-chrome"].map(|name| folder.join(name)))
        .find(|path| path.is_file());
    match chromium {
        Some(chromium) if playwright.is_dir() => Some((playwright, chromium)),
        _ => {
            eprintln!(
                "SKIPPED: there is no Chromium with playwright-core; scripts/install-browser installs them"
            );
            None
        }
    }
}

/// Checks the page at `url`; returns what was seen.
fn check(url: &str, what: &str) -> Option<String> {
    let (playwright, chromium) = browser()?;
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/check_page.mjs");
    // A picture, for those who want to look.
    let picture =
        env::var_os("LAMPLIGHT_PICTURES").map(|folder| PathBuf::from(folder).join(format!("{what}.png")));
    let output = Command::new("node")
        .arg(script)
        .args([&playwright, &chromium])
        .args([url, what])
        .args(picture)
        .output()
        .unwrap();
    assert!(output.status.success(), "{}", said(&output));
    let seen = String::from_utf8(output.stdout).unwrap();
    eprintln!("{seen}");
    Some(seen)
}

fn url_of(line: &str) -> String {
    line.split("page: ").nth(1).unwrap().trim().into()
}

fn ended(run: LiveRun) {
    kill_process(run.supervisor(), Signal::INT).unwrap();
    run.finish();
}

#[test]
fn a_browser_shows_the_swarm_and_acts_upon_it() {
    let _alone = alone();
    let args = ["--duration", "1000", "--speed", "2", "--robots", "30", "--view"];
    let mut run = LiveRun::start("swarmbots", &args);
    let url = url_of(&run.hear("page: "));
    if let Some(seen) = check(&url, "acts") {
        assert!(seen.contains("ok robots 30"), "{seen}");
    }
    ended(run);
}

#[test]
fn a_browser_shows_a_thousand_robots() {
    let _alone = alone();
    if browser().is_none() {
        return;
    }
    let mut run = LiveRun::start("thousand", &["--duration", "1000", "--speed", "1", "--view"]);
    let url = url_of(&run.hear("page: "));
    let seen = check(&url, "many").unwrap();
    assert!(seen.contains("ok robots 1000"), "{seen}");
    ended(run);
}

struct Served(Child);

impl Drop for Served {
    fn drop(&mut self) {
        let _ = kill_process(Pid::from_child(&self.0), Signal::INT);
        let _ = self.0.wait();
    }
}

#[test]
fn a_browser_shows_a_recording_of_two_thousand_robots() {
    let _alone = alone();
    if browser().is_none() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    let recorded =
        lamplight(["run", "--quiet", "--engine", "in-process", "--record=full", "--duration", "20"])
            .args(["--robots", "2000", "--set", "arena.size_m=[16, 16]", "--out"])
            .arg(&out)
            .arg(scenario("thousand"))
            .output()
            .unwrap();
    assert!(recorded.status.success(), "{}", said(&recorded));
    let replay = lamplight(["replay", "--view"]).arg(out.join("run.mcap")).stderr(Stdio::piped()).spawn();
    let mut served = Served(replay.unwrap());
    let mut line = String::new();
    BufReader::new(served.0.stderr.as_mut().unwrap()).read_line(&mut line).unwrap();
    let seen = check(&url_of(&line), "recording").unwrap();
    assert!(seen.contains("ok robots 2000"), "{seen}");
}
