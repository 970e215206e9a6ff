//! A run that a test watches and disturbs while it goes on.

use std::{
    collections::BTreeMap,
    fs,
    io::Read,
    path::{Path, PathBuf},
    process::{Child, Command, Output, Stdio, id},
    sync::atomic::{AtomicU32, Ordering},
    thread::{self, JoinHandle},
    time::{Duration, Instant},
};

use rustix::process::{Pid, Signal, kill_process};
use tempfile::TempDir;

use crate::programs::{Run, lamplight, program, scenario};

/// Far more than anything here takes on a busy machine: a test that waits this long has failed.
const PATIENCE: Duration = Duration::from_secs(120);

/// Waits until `what` comes true.
///
/// # Panics
/// If it never does.
pub fn wait_until(what: &str, mut is_so: impl FnMut() -> bool) {
    let began = Instant::now();
    while !is_so() {
        assert!(began.elapsed() < PATIENCE, "gave up waiting until {what}");
        thread::sleep(Duration::from_millis(2));
    }
}

/// A `lamplight run` with a name of its own, ended with the test whatever happens.
#[derive(Debug)]
pub struct LiveRun {
    /// The run's name.
    pub name: String,
    folder: Option<TempDir>,
    child: Option<Child>,
}

impl LiveRun {
    /// Starts `scenario_name` with `args`.
    ///
    /// # Panics
    /// If it does not start.
    pub fn start(scenario_name: &str, args: &[&str]) -> Self {
        Self::start_logging(scenario_name, args, None)
    }

    /// Starts `scenario_name` with `args`, and with `filter` as RUST_LOG.
    ///
    /// # Panics
    /// If it does not start.
    pub fn start_logging(scenario_name: &str, args: &[&str], filter: Option<&str>) -> Self {
        static COUNT: AtomicU32 = AtomicU32::new(0);
        let name = format!("test-{}-{}", id(), COUNT.fetch_add(1, Ordering::Relaxed));
        let folder = tempfile::tempdir().expect("a temporary folder can be made");
        let child = lamplight(["run", "--name", &name, "--json"])
            .arg(scenario(scenario_name))
            .arg("--out")
            .arg(folder.path().join("out"))
            .args(args)
            .envs(filter.map(|filter| ("RUST_LOG", filter)))
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .expect("lamplight starts");
        Self { name, folder: Some(folder), child: Some(child) }
    }

    /// Reads what it says on standard error up to a line that holds `what`, and returns that line. What has been read
    /// so is not in the output at the end.
    ///
    /// # Panics
    /// If it ends without having said it.
    pub fn hear(&mut self, what: &str) -> String {
        let child = self.child.as_mut().expect("the run has not been finished");
        heard(child.stderr.as_mut().expect("it is piped, and drained at the end"), what)
    }

    /// Starts one of this run's agents by hand.
    ///
    /// # Panics
    /// If it does not start.
    pub fn agent(&self, robot: u32) -> Child {
        self.agent_of_life(robot, 0)
    }

    /// Starts an agent for a later life of a robot by hand, again and again until the run takes it.
    ///
    /// # Panics
    /// If it never does.
    pub fn agent_reborn(&self, robot: u32, incarnation: u16) -> Child {
        let mut taken = None;
        wait_until("the run waits for the next life", || {
            let mut agent = self.agent_of_life(robot, incarnation);
            // One that is not wanted leaves at once.
            thread::sleep(Duration::from_millis(100));
            let left = agent.try_wait().expect("a child can be asked");
            let joined = left.is_none_or(|status| status.success());
            taken = joined.then_some(agent);
            joined
        });
        taken.expect("it has joined")
    }

    fn agent_of_life(&self, robot: u32, incarnation: u16) -> Child {
        self.start_agent(&mut Command::new(program("robot-agent")), robot, incarnation)
    }

    /// Starts one of this run's agents by hand, by a `tool` whose last argument so far is the agent's program.
    ///
    /// # Panics
    /// If it does not start.
    pub fn agent_under(&self, tool: &mut Command, robot: u32) -> Child {
        self.start_agent(tool, robot, 0)
    }

    fn start_agent(&self, command: &mut Command, robot: u32, incarnation: u16) -> Child {
        command
            .args(["--run", &self.name, "--robot", &robot.to_string()])
            .args(["--incarnation", &incarnation.to_string()])
            .stdin(Stdio::null())
            .stderr(Stdio::piped())
            .spawn()
            .expect("robot-agent starts")
    }

    /// Process of each agent that is alive, by robot.
    pub fn agents(&self) -> BTreeMap<u32, Pid> {
        agents_of(&self.name)
    }

    /// Process of the arena.
    pub fn arena(&self) -> Option<Pid> {
        arena_of(&self.name)
    }

    /// Process of `lamplight` itself.
    ///
    /// # Panics
    /// If the run has been finished.
    pub fn supervisor(&self) -> Pid {
        Pid::from_child(self.child.as_ref().expect("the run has not been finished"))
    }

    /// Waits until robots move: the first row of `metrics.csv` is there.
    pub fn wait_until_moving(&self) {
        let metrics = self.out().join("metrics.csv");
        wait_until("robots move", || fs::read_to_string(&metrics).is_ok_and(|text| text.lines().count() > 1));
    }

    /// Waits until the arena waits for agents.
    pub fn wait_until_open(&self) {
        let doorbell = PathBuf::from(format!("/dev/shm/lamplight-{}/doorbell", self.name));
        wait_until("the arena waits for agents", || doorbell.exists());
    }

    /// Waits for the end; what it printed, and what it left if it left a summary.
    ///
    /// # Panics
    /// If it leaves a process or a file in shared memory behind.
    pub fn finish(mut self) -> (Output, Option<Run>) {
        let child = self.child.as_mut().expect("a run is finished once");
        // A pipe that nobody empties holds up whoever fills it.
        let (stdout, stderr) = (drained(child.stdout.take()), drained(child.stderr.take()));
        wait_until("the run ends", || child.try_wait().expect("a child can be asked").is_some());
        let mut child = self.child.take().expect("it was there a moment ago");
        let status = child.wait().expect("a child can be waited for");
        let read = |reader: JoinHandle<Vec<u8>>| reader.join().expect("reading does not panic");
        let output = Output { status, stdout: read(stdout), stderr: read(stderr) };
        wait_until("every agent has left", || self.agents().is_empty());
        assert_eq!(self.leftovers(), Vec::<String>::new(), "left in shared memory");
        let folder = self.folder.take().expect("a run is finished once");
        let run = folder.path().join("out/summary.json").exists().then(|| Run::in_folder(folder));
        (output, run)
    }

    /// Files that the run has in shared memory.
    pub fn leftovers(&self) -> Vec<String> {
        let (exact, prefix) = (format!("lamplight-{}", self.name), format!("lamplight-{}.", self.name));
        let entries = fs::read_dir("/dev/shm").expect("shared memory is there");
        let names = entries.filter_map(|entry| entry.ok()?.file_name().into_string().ok());
        names.filter(|name| *name == exact || name.starts_with(&prefix)).collect()
    }

    /// How many files and folders the run has in shared memory.
    ///
    /// # Panics
    /// If shared memory cannot be read.
    pub fn files(&self) -> usize {
        self.leftovers().iter().map(|name| 1 + entries_below(&PathBuf::from("/dev/shm").join(name))).sum()
    }

    /// The folder that it writes its results to.
    ///
    /// # Panics
    /// If the run has been finished.
    pub fn out(&self) -> PathBuf {
        self.folder.as_ref().expect("the run has not been finished").path().join("out")
    }
}

impl Drop for LiveRun {
    /// A failed test leaves nothing behind either.
    fn drop(&mut self) {
        let Some(mut child) = self.child.take() else { return };
        let _ = child.kill();
        let _ = child.wait();
        for pid in self.agents().into_values().chain(self.arena()) {
            signal(pid, Signal::KILL);
        }
        let _ = lamplight(["clean"]).output();
    }
}

/// Reads up to a line that holds `what`, and no further, and returns it.
///
/// # Panics
/// If there is none.
pub fn heard(pipe: &mut impl Read, what: &str) -> String {
    let (mut line, mut byte) = (Vec::new(), [0]);
    while pipe.read(&mut byte).expect("a pipe can be read") == 1 {
        match byte {
            [b'\n'] if String::from_utf8_lossy(&line).contains(what) => break,
            [b'\n'] => line.clear(),
            [byte] => line.push(byte),
        }
    }
    let line = String::from_utf8_lossy(&line).into_owned();
    assert!(line.contains(what), "nothing is said of `{what}`");
    line
}

/// Reads all that comes, in a thread of its own.
fn drained(pipe: Option<impl Read + Send + 'static>) -> JoinHandle<Vec<u8>> {
    thread::spawn(move || {
        let mut bytes = Vec::new();
        pipe.expect("it is piped, and drained once").read_to_end(&mut bytes).expect("a pipe can be read");
        bytes
    })
}

/// Sends a signal to a process of ours; one that is gone is passed over.
pub fn signal(pid: Pid, signal: Signal) {
    let _ = kill_process(pid, signal);
}

/// How many descriptors a process holds; 0 if it has ended.
pub fn descriptors(pid: Pid) -> usize {
    fs::read_dir(format!("/proc/{}/fd", pid.as_raw_pid())).map_or(0, Iterator::count)
}

/// State of a process, as `/proc` spells it: `T` if it is stopped. `None` if it has ended.
pub fn state(pid: Pid) -> Option<char> {
    let stat = fs::read_to_string(format!("/proc/{}/stat", pid.as_raw_pid())).ok()?;
    stat.rsplit_once(") ")?.1.chars().next()
}

/// All processes that `pid` has started, and those that these have.
///
/// # Panics
/// If there is no `/proc`.
pub fn descendants(pid: Pid) -> Vec<Pid> {
    let entries = fs::read_dir("/proc").expect("/proc is there");
    let parents: Vec<(Pid, Pid)> = entries
        .filter_map(|entry| {
            let child = entry.ok()?.file_name().to_str()?.parse().ok()?;
            let stat = fs::read_to_string(format!("/proc/{child}/stat")).ok()?;
            let parent = stat.rsplit_once(") ")?.1.split(' ').nth(1)?.parse().ok()?;
            Some((Pid::from_raw(child)?, Pid::from_raw(parent)?))
        })
        .collect();
    let mut found = vec![pid];
    let mut next = 0;
    while let Some(&parent) = found.get(next) {
        found.extend(parents.iter().filter(|(_, theirs)| *theirs == parent).map(|(child, _)| *child));
        next += 1;
    }
    found.split_off(1)
}

/// Entries below `folder`; none if it is no folder, or no longer one.
fn entries_below(folder: &Path) -> usize {
    let entries = fs::read_dir(folder).into_iter().flatten().flatten();
    entries.map(|entry| 1 + entries_below(&entry.path())).sum()
}

/// Process of each agent of the run `name` that is alive, by robot.
pub fn agents_of(name: &str) -> BTreeMap<u32, Pid> {
    let ours = ["--run", name, "--robot"];
    processes("robot-agent")
        .chain(processes("json-lines-agent"))
        .filter_map(|(pid, arguments)| {
            let at = arguments.windows(3).position(|window| window == ours)?;
            Some((arguments.get(at + 3)?.parse().ok()?, pid))
        })
        .collect()
}

/// Name of the run and process of the arena that `ancestor` has started, itself or by a child, if it has one.
pub fn arena_under(ancestor: &Child) -> Option<(String, Pid)> {
    let ours = descendants(Pid::from_child(ancestor));
    processes("arena-daemon").filter(|(pid, _)| ours.contains(pid)).find_map(|(pid, arguments)| {
        let name = arguments.iter().find_map(|argument| argument.strip_prefix("--name="))?;
        Some((name.to_owned(), pid))
    })
}

/// Process of the arena of the run `name`.
fn arena_of(name: &str) -> Option<Pid> {
    let ours = format!("--name={name}");
    processes("arena-daemon").find(|(_, arguments)| arguments.contains(&ours)).map(|(pid, _)| pid)
}

/// Number and arguments of every live process that runs `name`.
fn processes(name: &str) -> impl Iterator<Item = (Pid, Vec<String>)> {
    let entries = fs::read_dir("/proc").expect("/proc is there");
    entries.filter_map(move |entry| {
        let pid = entry.ok()?.file_name().to_str()?.parse().ok()?;
        let arguments = fs::read(format!("/proc/{pid}/cmdline")).ok()?;
        let arguments: Vec<String> = arguments
            .split(|&byte| byte == 0)
            .map(|text| String::from_utf8_lossy(text).into_owned())
            .collect();
        (arguments.first()?.rsplit('/').next()? == name).then_some((Pid::from_raw(pid)?, arguments))
    })
}
