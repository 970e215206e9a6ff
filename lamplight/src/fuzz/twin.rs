//! The same scenario once more, with a process per robot: a run of our own program as a child.

use std::{
    env,
    fs::{self, File},
    io,
    os::unix::process::CommandExt,
    path::{Path, PathBuf},
    process::{self, Child, Command, ExitStatus, Stdio},
    thread,
    time::{Duration, Instant},
};

use anyhow::{Context, anyhow, bail};
use arena_daemon::stop::StopFlag;
use protocol::run_dir::RunDir;
use rustix::process::{Pid, Signal, kill_process};
use serde_json::Value;

use crate::name;

/// How often a child is looked after.
const POLL: Duration = Duration::from_millis(5);
/// How long a run may take on a busy machine.
const PATIENCE: Duration = Duration::from_secs(600);
/// How long a child gets to end the run it was told to end: longer than it gives its own children.
const LEAVE_TIMEOUT: Duration = Duration::from_secs(20);

/// A folder of our own for what goes to a child and comes back; it goes with its value.
#[derive(Debug)]
pub(crate) struct Workshop(PathBuf);

impl Workshop {
    pub(crate) fn open() -> anyhow::Result<Self> {
        let base = env::temp_dir();
        for attempt in 0..100 {
            let path = base.join(format!("lamplight-fuzz-{}-{attempt}", process::id()));
            match fs::create_dir(&path) {
                Ok(()) => return Ok(Self(path)),
                Err(error) if error.kind() == io::ErrorKind::AlreadyExists => {}
                Err(error) => {
                    return Err(error).with_context(|| format!("cannot make the folder {}", path.display()));
                }
            }
        }
        bail!("{} is full of folders named lamplight-fuzz-*; remove them", base.display())
    }

    /// Runs `scenario` to its end as processes under the name `fuzz-SEED-...` and returns its summary; the error
    /// says what was wrong with it. Ended early by `stop`, it is an error as well.
    pub(crate) fn run(&self, scenario: &str, seed: u64, stop: &StopFlag) -> anyhow::Result<Value> {
        let name = name::unique(&format!("fuzz-{seed}"));
        let file = |name: &str| self.0.join(name);
        fs::write(file("scenario.toml"), scenario)?;
        let child = Command::new(env::current_exe().context("cannot find our own program")?)
            .args(["run", "--engine", "processes", "--json", "--quiet", "--name", &name.to_string(), "--"])
            .arg(file("scenario.toml"))
            .stdin(Stdio::null())
            .stdout(File::create(file("stdout"))?)
            .stderr(File::create(file("stderr"))?)
            // Ctrl-C reaches it through us alone.
            .process_group(0)
            .spawn()
            .context("cannot start ourselves as processes")?;
        let status = ended(child, stop)?;
        if !status.success() {
            bail!("as processes: {status}: {}", last_lines(&file("stderr"), 3));
        }
        if RunDir::list()?.iter().any(|run| *run.name() == name) {
            bail!("as processes: something named lamplight-{name} is left in shared memory");
        }
        let summary = fs::read(file("stdout"))?;
        serde_json::from_slice(&summary).context("as processes: the summary is no JSON")
    }
}

impl Drop for Workshop {
    fn drop(&mut self) {
        // What cannot be removed is left to the operating system.
        let _ = fs::remove_dir_all(&self.0);
    }
}

/// Waits for a child; one that takes too long, or that is no longer wanted, is ended.
fn ended(mut child: Child, stop: &StopFlag) -> anyhow::Result<ExitStatus> {
    let began = Instant::now();
    let why = loop {
        if let Some(status) = child.try_wait()? {
            return Ok(status);
        }
        if stop.is_raised() {
            break anyhow!("interrupted");
        }
        if began.elapsed() > PATIENCE {
            break anyhow!("as processes: the run had not ended after {PATIENCE:?}");
        }
        thread::sleep(POLL);
    };
    // Not reaped yet, so the number is its own.
    let _ = kill_process(Pid::from_child(&child), Signal::TERM);
    let told = Instant::now();
    while child.try_wait()?.is_none() {
        if told.elapsed() > LEAVE_TIMEOUT {
            child.kill()?;
            child.wait()?;
            break;
        }
        thread::sleep(POLL);
    }
    Err(why)
}

fn last_lines(path: &Path, count: usize) -> String {
    let bytes = fs::read(path).unwrap_or_default();
    let text = String::from_utf8_lossy(&bytes);
    let lines: Vec<&str> = text.lines().collect();
    lines[lines.len().saturating_sub(count)..].join("; ")
}
