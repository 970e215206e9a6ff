//! Agents in Python: an interpreter for each controller, warmed once, which forks them.
//!
//! A fork server is a child of ours. Asked for an agent, it forks a process that forks the agent and ends; what is left
//! without a parent then becomes ours (we are a subreaper), so that an agent in Python is a child like any other: signaled,
//! stopped and waited for by its number. A server for each controller, so that two files with modules of one name do not
//! meet in one interpreter.

use std::{
    collections::HashMap,
    env,
    ffi::OsString,
    io::{self, BufRead, BufReader, IoSlice},
    mem::MaybeUninit,
    net::Shutdown,
    os::{
        fd::{AsFd, OwnedFd},
        unix::{net::UnixStream, process::CommandExt},
    },
    path::PathBuf,
    process::{Command, Stdio},
    sync::mpsc::{self, Receiver, RecvTimeoutError},
    thread,
    time::Duration,
};

use anyhow::{Context, anyhow, bail};
use rustix::{
    net::{SendAncillaryBuffer, SendAncillaryMessage, SendFlags, sendmsg},
    process::{Pid, getpid, set_child_subreaper},
};
use scenario::PythonSpec;
use serde::Deserialize;

use crate::children;

/// Names the interpreter; without it, one beside this program, or else `python3` in PATH.
const INTERPRETER_VARIABLE: &str = "LAMPLIGHT_PYTHON";
/// Where a process that has become an interpreter finds what it was.
const PROGRAM_VARIABLE: &str = "LAMPLIGHT_PROGRAM";
/// How long a fork may take.
const FORK_TIMEOUT: Duration = Duration::from_secs(20);
/// Variables that have numerical libraries start threads of their own, which a fork would not have, and the values that
/// have them start none.
const ONE_THREAD: [&str; 3] = ["OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"];
/// Seed of the order of sets: left to chance, runs could not be repeated.
const ORDER_VARIABLE: &str = "PYTHONHASHSEED";

/// Word of a fork server.
#[derive(Clone, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub(crate) enum Word {
    /// It has the class. With the version of its package.
    Ready(String),
    /// It has not, and why.
    Failed(String),
    /// The number of an agent that it has forked.
    Pid(i32),
    /// It says no more.
    #[serde(skip)]
    Ended,
}

/// An interpreter that forks agents.
#[derive(Debug)]
pub(crate) struct ForkServer {
    /// File and class.
    controller: String,
    interpreter: OsString,
    pid: Pid,
    requests: UnixStream,
    pids: Receiver<i32>,
    is_ready: bool,
    /// Whether its process has ended and been waited for: its number may be another's.
    has_ended: bool,
}

/// Has processes whose parents have ended become our children.
pub(crate) fn adopt_orphans() -> anyhow::Result<()> {
    set_child_subreaper(Some(getpid())).context("cannot take charge of agents in Python")
}

impl ForkServer {
    /// Starts one for a controller. It prints to `log`; `tell` gets its word when it is ready, has failed or has ended.
    pub(crate) fn start(
        python: &PythonSpec,
        log: impl Into<Stdio>,
        tell: impl Fn(Word) + Send + 'static,
    ) -> anyhow::Result<Self> {
        let (controller, interpreter) = (python.name(), interpreter());
        let (requests, theirs) = UnixStream::pair().context("cannot make a socket for a fork server")?;
        let words = requests.try_clone().context("cannot make a socket for a fork server")?;
        let mut command = Command::new(&interpreter);
        command
            .args(["-m", "lamplight.fork_server", &controller])
            .envs(settings())
            .stdin(Stdio::from(OwnedFd::from(theirs)))
            .stdout(Stdio::null())
            .stderr(log);
        let child = children::start(&mut command).map_err(|error| {
            anyhow!(
                "{} cannot be started: {error}; name a Python interpreter by {INTERPRETER_VARIABLE}",
                interpreter.display()
            )
        })?;
        let (sender, pids) = mpsc::channel();
        thread::spawn(move || {
            for line in BufReader::new(words).lines().map_while(Result::ok) {
                match serde_json::from_str(&line) {
                    Ok(Word::Pid(pid)) => drop(sender.send(pid)),
                    Ok(word) => tell(word),
                    Err(error) => {
                        tell(Word::Failed(format!("it says `{line}`, which is not understood: {error}")))
                    }
                }
            }
            tell(Word::Ended);
        });
        Ok(Self {
            controller,
            interpreter,
            pid: Pid::from_child(&child),
            requests,
            pids,
            is_ready: false,
            has_ended: false,
        })
    }

    /// Its process, as long as it has not ended.
    pub(crate) fn pid(&self) -> Option<Pid> {
        Some(self.pid).filter(|_| !self.has_ended)
    }

    /// Takes note of a process that has ended, which may be its own. What it has said before is still to be heard.
    pub(crate) fn note_end(&mut self, pid: Pid) {
        self.has_ended |= self.pid == pid;
    }

    /// Whether it can fork agents.
    pub(crate) fn is_ready(&self) -> bool {
        self.is_ready
    }

    /// Takes word of it. The error says why there are to be no agents, and a way out.
    pub(crate) fn hear(&mut self, word: Word) -> Result<(), (String, String)> {
        let Self { controller, interpreter, is_ready, .. } = self;
        let interpreter = interpreter.display();
        match word {
            Word::Ready(version) if version == env!("CARGO_PKG_VERSION") => *is_ready = true,
            Word::Ready(version) => {
                let message = format!(
                    "the package lamplight of {interpreter} is of version {version}, and this program of {}",
                    env!("CARGO_PKG_VERSION")
                );
                return Err((message, "install the package that was built with this program".into()));
            }
            Word::Failed(why) => {
                return Err((why, format!("{controller} is run by {interpreter}")));
            }
            Word::Ended if !*is_ready => {
                let message = format!("{interpreter} ended before it had read {controller}");
                return Err((message, format!("{INSTALL}; what it has printed is above")));
            }
            Word::Ended | Word::Pid(_) => {}
        }
        Ok(())
    }

    /// Lets it end.
    pub(crate) fn dismiss(&self) {
        let _ = self.requests.shutdown(Shutdown::Both);
    }

    /// Forks an agent with the `words` of its command line, which prints to `log`, and leads a process group of its own.
    pub(crate) fn fork(&self, words: &[String], log: impl AsFd) -> anyhow::Result<Pid> {
        let request = serde_json::to_vec(words).expect("words are plain data");
        let descriptors = [log.as_fd()];
        let mut space = [MaybeUninit::uninit(); rustix::cmsg_space!(ScmRights(1))];
        let mut with = SendAncillaryBuffer::new(&mut space);
        with.push(SendAncillaryMessage::ScmRights(&descriptors));
        let sent = sendmsg(&self.requests, &[IoSlice::new(&request)], &mut with, SendFlags::NOSIGNAL);
        let pid = sent.map_err(io::Error::from).ok().map(|_| self.pids.recv_timeout(FORK_TIMEOUT));
        match pid {
            Some(Ok(pid)) => Pid::from_raw(pid).ok_or_else(|| anyhow!("its fork server names no process")),
            Some(Err(RecvTimeoutError::Timeout)) => {
                bail!("its fork server has not answered for {FORK_TIMEOUT:?}")
            }
            Some(Err(RecvTimeoutError::Disconnected)) | None => bail!("its fork server has ended"),
        }
    }
}

/// The interpreter to be used.
fn interpreter() -> OsString {
    let named = env::var_os(INTERPRETER_VARIABLE).filter(|name| !name.is_empty());
    let beside = || own_program().ok().map(|us| us.with_file_name("python3")).filter(|path| path.is_file());
    named.or_else(|| beside().map(Into::into)).unwrap_or_else(|| "python3".into())
}

/// Program of an interpreter that is to play controllers in one process; `{hint}` is the way out where it has no package.
const IN_PROCESS: &str = "\
import sys
try:
    from lamplight._in_process import main
except ImportError as error:
    print(f'error: {sys.executable} cannot play controllers: {error}\\nhint: {hint}', file=sys.stderr)
    sys.exit(2)
main()";
/// The way out where an interpreter has no package.
const INSTALL: &str = "install the package lamplight in it, which needs Python 3.10 or later (`scripts/package wheel` makes it), or \
                       name another interpreter by LAMPLIGHT_PYTHON";

/// Has this process be a Python interpreter that does the same command once more. Returns only why it cannot.
pub(crate) fn become_interpreter() -> String {
    let interpreter = interpreter();
    let mut command = Command::new(&interpreter);
    command
        .args(["-c", &IN_PROCESS.replace("{hint}", INSTALL)])
        .args(env::args_os().skip(1))
        .envs(settings());
    if let Ok(us) = env::current_exe() {
        command.env(PROGRAM_VARIABLE, us);
    }
    format!("{}: {}", interpreter.display(), command.exec())
}

/// The program `lamplight`: this process, or the one that it was before it became an interpreter.
pub(crate) fn own_program() -> anyhow::Result<PathBuf> {
    match env::var_os(PROGRAM_VARIABLE) {
        Some(path) => Ok(path.into()),
        None => env::current_exe().context("cannot find our own program"),
    }
}

/// Variables of the environment that the user has not set.
fn settings() -> HashMap<&'static str, &'static str> {
    let threads = ONE_THREAD.map(|name| (name, "1"));
    threads
        .into_iter()
        .chain([(ORDER_VARIABLE, "0")])
        .filter(|(name, _)| env::var_os(name).is_none())
        .collect()
}
