//! Every peer plays its ticks, and leaves neither process nor file, whether it comes to its end or is
//! interrupted.
//!
//! Processes are found by a mark in their environment, which every process inherits from the bench. Files
//! would lie in shared memory under a name with the bench's process number, or in the folder for temporary
//! files, which is the test's own. Peers that `lamplight` plays need it beside the bench (`scripts/build`).

#![allow(clippy::unwrap_used, reason = "these are tests, helpers included")]
#![forbid(unsafe_code)]

use std::{
    fs,
    path::Path,
    process::{Child, Command, Stdio},
    thread,
    time::{Duration, Instant},
};

use rustix::process::{Pid, Signal, kill_process};
use tempfile::TempDir;
use transport::run_dir::RunDir;

/// Starting three processes takes far less.
const SOON: Duration = Duration::from_secs(20);
const MARK: &str = "TICK_COST_TEST";

/// A bench of three robots, and where its traces would be.
struct Bench {
    child: Child,
    temporary: TempDir,
}

impl Bench {
    fn start(peers: &str, ticks: u32) -> Self {
        let temporary = TempDir::new().unwrap();
        let child = Command::new(env!("CARGO_BIN_EXE_tick-cost"))
            .args(["--robots", "3", "--rounds", "1", "--peers", peers, "--ticks", &ticks.to_string()])
            .args(["--scenario", concat!(env!("CARGO_MANIFEST_DIR"), "/../scenarios/swarmbots.toml")])
            .env(MARK, temporary.path())
            .env("TMPDIR", temporary.path())
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .spawn()
            .unwrap();
        Self { child, temporary }
    }

    /// Processes with our mark that run, the bench among them.
    fn processes(&self) -> usize {
        let mark = format!("{MARK}={}", self.temporary.path().display());
        let is_ours = |entry: &fs::DirEntry| {
            // Empty for what is no process, belongs to somebody else, or has ended.
            let environment = fs::read(entry.path().join("environ")).unwrap_or_default();
            environment.split(|&byte| byte == 0).any(|variable| variable == mark.as_bytes())
        };
        fs::read_dir("/proc").unwrap().flatten().filter(is_ours).count()
    }

    fn wait_for_processes(&self, count: usize) {
        let deadline = Instant::now() + SOON;
        while self.processes() != count {
            assert!(Instant::now() < deadline, "there are {} processes, not {count}", self.processes());
            thread::sleep(Duration::from_millis(5));
        }
    }

    /// Whether a file in shared memory is of this bench.
    fn is_ours(&self, name: &str) -> bool {
        let after = name.split_once(&self.name()).map(|(_, after)| after);
        after.is_some_and(|after| !after.starts_with(|next: char| next.is_ascii_digit()))
    }

    /// Name of everything of it, or its beginning.
    fn name(&self) -> String {
        format!("tick-cost-{}", self.child.id())
    }

    /// Its status and what it has printed, once it has ended without a trace.
    fn ended(mut self) -> (Option<i32>, String) {
        let mut stdout = self.child.stdout.take().unwrap();
        let printed = std::io::read_to_string(&mut stdout).unwrap();
        let status = self.child.wait().unwrap();
        assert_eq!(self.processes(), 0);
        let mut left = files(self.temporary.path());
        left.extend(files(Path::new("/dev/shm")).into_iter().filter(|name| self.is_ours(name)));
        assert!(left.is_empty(), "{left:?}");
        (status.code(), printed)
    }
}

fn files(folder: &Path) -> Vec<String> {
    let entries = fs::read_dir(folder).unwrap().flatten();
    entries.map(|entry| entry.file_name().into_string().unwrap()).collect()
}

/// Plays 20 ticks; `column` is how the table calls the peer.
fn plays(peer: &str, column: &str) {
    let (status, printed) = Bench::start(peer, 20).ended();
    assert_eq!(status, Some(0));
    assert!(printed.contains(&format!("| N | heard per robot | {column} |\n")), "{printed}");
    let row = printed.lines().find(|line| line.starts_with("| 3 |")).unwrap();
    assert!(row.ends_with(") |"), "the last cell is a measurement: {row}");
}

/// Would play for hours, and is told to end once bench and agents run.
fn ends_when_told(peer: &str) {
    let bench = Bench::start(peer, 100_000_000);
    bench.wait_for_processes(4);
    kill_process(Pid::from_child(&bench.child), Signal::INT).unwrap();
    let (status, printed) = bench.ended();
    assert_eq!(status, Some(130));
    assert!(printed.contains("| 3 | – | – |"), "{printed}");
}

#[test]
fn the_futex_floor_plays_and_leaves_nothing() {
    plays("futex", "futex");
    ends_when_told("futex");
}

#[test]
fn pipes_play_and_leave_nothing() {
    plays("pipes", "pipes");
    ends_when_told("pipes");
}

#[test]
fn sockets_play_and_leave_nothing() {
    plays("sockets", "sockets");
    ends_when_told("sockets");
}

#[cfg(feature = "zeromq")]
#[test]
fn zeromq_plays_and_leaves_nothing() {
    plays("zeromq", "zeromq");
    ends_when_told("zeromq");
}

#[test]
fn an_idle_lock_step_plays_and_leaves_nothing() {
    plays("idle", "idle");
    ends_when_told("idle");
}

#[test]
fn a_lock_step_run_plays_and_leaves_nothing() {
    plays("lockstep", "lock-step");
}

#[test]
fn an_in_process_run_plays_and_leaves_nothing() {
    plays("in-process", "in-process");
}

/// A bench whose agents run, killed, once they have left.
fn killed(peer: &str) -> Bench {
    let mut bench = Bench::start(peer, 100_000_000);
    bench.wait_for_processes(4);
    bench.child.kill().unwrap();
    bench.wait_for_processes(0);
    bench
}

#[test]
fn agents_leave_a_killed_bench_and_so_does_every_file() {
    let zeromq = if cfg!(feature = "zeromq") { "zeromq" } else { "futex" };
    for peer in ["futex", "pipes", "sockets", zeromq] {
        assert_eq!(killed(peer).ended().0, None, "{peer}");
    }
}

#[test]
fn an_idle_run_whose_bench_was_killed_is_dead_and_can_be_removed() {
    let bench = killed("idle");
    assert!(files(Path::new("/dev/shm")).iter().any(|name| bench.is_ours(name)), "that is what we look for");
    let run = RunDir::of(bench.name().parse().unwrap());
    assert!(run.remove_if_dead().unwrap().is_some_and(|cleared| cleared.removed > 0));
    bench.ended();
}
