//! One scenario of many as a run with a process per robot: our own program as a child.

use std::{
    env,
    ffi::OsStr,
    fs::{self, File},
    io,
    path::{Path, PathBuf},
    process::{self, Child, Command, ExitStatus, Stdio},
    thread,
    time::Duration,
};

use anyhow::{Context, anyhow, bail};
use engine::{StopFlag, summary::Summary};
use files::WriteError;
use observe::recorder;
use rustix::process::{Pid, Signal};
use scenario::Seed;
use squad::moment::Moment;
use transport::run_dir::RunDir;

use crate::{
    children::{self, Children, tell},
    name, python,
};

/// How often a child is looked after.
const POLL: Duration = Duration::from_millis(5);
/// How long a run may take on a busy machine.
const PATIENCE: Duration = Duration::from_secs(600);
/// How long a child gets to end the run it was told to end: longer than it gives its own children.
const LEAVE_TIMEOUT: Duration = Duration::from_secs(20);

/// A folder of our own for what goes to a child and comes back; it goes with its value. The child stands still with us.
#[derive(Debug)]
pub(crate) struct Workshop {
    /// Its purpose, in names of runs and folders.
    purpose: &'static str,
    folder: PathBuf,
    children: Children,
}

impl Workshop {
    pub(crate) fn open(purpose: &'static str) -> anyhow::Result<Self> {
        let children = Children::default();
        children.stand_still_with_us(drop).context("cannot listen for signals")?;
        let base = env::temp_dir();
        for attempt in 0..100 {
            let path = base.join(format!("lamplight-{purpose}-{}-{attempt}", process::id()));
            match fs::create_dir(&path) {
                Ok(()) => return Ok(Self { purpose, folder: path, children }),
                Err(error) if error.kind() == io::ErrorKind::AlreadyExists => {}
                Err(error) => {
                    return Err(error).with_context(|| format!("cannot make the folder {}", path.display()));
                }
            }
        }
        bail!("{} is full of folders named lamplight-{purpose}-*; remove them", base.display())
    }

    /// Runs `scenario` to its end as processes and returns its summary, also if it has failed; the inner error says why there
    /// is none. Ended early by `stop`, it is such an error as well.
    ///
    /// # Errors
    /// If there is no room here for what goes to the child.
    pub(crate) fn run(
        &self,
        scenario: &str,
        seed: Seed,
        stop: &StopFlag,
    ) -> Result<Result<Summary, String>, WriteError> {
        files::replace(&self.file("scenario.toml"), scenario)?;
        Ok(self.child(seed, &[], stop).map_err(|error| format!("{error:#}")))
    }

    /// Does the same once, and returns where the recording of that run is, for as long as this value is there.
    ///
    /// # Errors
    /// If there is no room here, or no summary.
    pub(crate) fn record(&self, scenario: &str, seed: Seed, stop: &StopFlag) -> anyhow::Result<PathBuf> {
        files::replace(&self.file("scenario.toml"), scenario)?;
        let out = self.file("run");
        self.child(seed, &["--record".as_ref(), "--out".as_ref(), out.as_os_str()], stop)?;
        Ok(out.join(recorder::FILE))
    }

    fn file(&self, name: &str) -> PathBuf {
        self.folder.join(name)
    }

    fn child(&self, seed: Seed, options: &[&OsStr], stop: &StopFlag) -> anyhow::Result<Summary> {
        let name = name::unique(&format!("{}-{seed}", self.purpose));
        let file = |name: &str| self.file(name);
        let mut group = self.children.lock();
        let mut command = Command::new(python::own_program()?);
        command
            .args(["run", "--engine", "processes", "--json", "--quiet", "--name", &name.to_string()])
            .args(options)
            .arg("--")
            .arg(file("scenario.toml"))
            .stdin(Stdio::null())
            .stdout(File::create(file("stdout"))?)
            .stderr(File::create(file("stderr"))?);
        let child = children::start(&mut command).context("cannot start ourselves as processes")?;
        group.head = Some(Pid::from_child(&child));
        drop(group);
        let status = self.ended(child, stop)?;
        if RunDir::list()?.iter().any(|run| *run.name() == name) {
            bail!("as processes: something named lamplight-{name} is left in shared memory");
        }
        match fs::read(file("stdout"))? {
            summary if summary.is_empty() => {
                bail!("as processes: {status}: {}", last_lines(&file("stderr"), 3))
            }
            summary => {
                serde_json::from_slice(&summary).context("as processes: the summary is not understood")
            }
        }
    }

    /// Waits for a child; one that takes too long, or that is no longer wanted, is ended.
    fn ended(&self, mut child: Child, stop: &StopFlag) -> anyhow::Result<ExitStatus> {
        let began = Moment::now();
        let why = loop {
            if let Some(status) = self.reaped(&mut child)? {
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
        tell(Pid::from_child(&child), Signal::TERM);
        let told = Moment::now();
        while self.reaped(&mut child)?.is_none() {
            if told.elapsed() > LEAVE_TIMEOUT {
                child.kill()?;
            }
            thread::sleep(POLL);
        }
        Err(why)
    }

    /// How the child has ended, if it has.
    fn reaped(&self, child: &mut Child) -> anyhow::Result<Option<ExitStatus>> {
        let mut group = self.children.lock();
        let status = child.try_wait()?;
        if status.is_some() {
            group.head = None;
        }
        Ok(status)
    }
}

impl Drop for Workshop {
    fn drop(&mut self) {
        // What cannot be removed is left to the operating system.
        let _ = fs::remove_dir_all(&self.folder);
    }
}

fn last_lines(path: &Path, count: usize) -> String {
    let bytes = fs::read(path).unwrap_or_default();
    let text = String::from_utf8_lossy(&bytes);
    let lines: Vec<&str> = text.lines().collect();
    lines[lines.len().saturating_sub(count)..].join("; ")
}
