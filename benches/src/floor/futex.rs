//! The floor: the least a tick of N processes can cost on this machine.
//!
//! The shape is that of a lock-step tick with nothing in it. The arena writes an inbox of
//! 8 × 96 bytes for every agent and rings; each agent wakes, reads its inbox, writes an answer of
//! 96 bytes; the last one wakes the arena, which reads them all. No channel, no controller, no
//! message that is checked.
//!
//! Contract:
//! - Nothing is left in shared memory, whatever ends us: the two files lose their names before
//!   the first agent starts. Agents reach them through our descriptors, in `/proc`.
//! - No agent outlives us for more than [`ALIVE_POLL`]: who hears nothing looks for its parent.

use std::{
    fs::File,
    os::{fd::AsRawFd, unix::process::parent_id},
    path::{Path, PathBuf},
    process::{self, Child, Command, Stdio},
    sync::atomic::{AtomicU64, Ordering::Relaxed},
    time::{Duration, Instant},
};

use anyhow::{Context, bail, ensure};
use clap::Args;
use protocol::{
    doorbell::{Doorbell, Ring},
    mapping::Mapping,
};

/// Most agents the shared page has room for: 3.5 MiB of lanes.
pub(crate) const ROBOTS_MAX: u32 = 4096;

/// 8 neighbors × 96 bytes, in words of 8 bytes.
const INBOX_WORDS: usize = 8 * 96 / 8;
/// 96 bytes.
const ANSWER_WORDS: usize = 96 / 8;
/// Inbox and answer, padded so that no two lanes share a cache line: 14 lines of 64 bytes.
const LANE_WORDS: usize = INBOX_WORDS + ANSWER_WORDS + 4;
const _: () = assert!(LANE_WORDS.is_multiple_of(8));

/// What arena and one agent share.
type Lane = [AtomicU64; LANE_WORDS];
type Lanes = [Lane; ROBOTS_MAX as usize];

/// Ticks before the measurement: caches and page tables fill.
const WARM_UP_TICKS: u32 = 30;
/// A tick, and the start of all agents, takes far less.
const ANSWER_TIMEOUT: Duration = Duration::from_secs(60);
/// How long an agent sleeps before it asks whether the arena still lives.
const ALIVE_POLL: Duration = Duration::from_millis(500);
/// How long agents get to leave; then they are killed.
const LEAVE_TIMEOUT: Duration = Duration::from_secs(3);

/// The arena's side: N running agents.
#[derive(Debug)]
pub(crate) struct Floor {
    bell: Doorbell,
    lanes: Mapping<Lanes>,
    agents: Vec<Child>,
    tick: u64,
}

/// What an agent is told.
#[derive(Args, Debug)]
pub(crate) struct AgentArgs {
    /// File of the doorbell
    bell: PathBuf,
    /// File of the lanes
    lanes: PathBuf,
    /// Which lane is ours
    lane: usize,
    /// Our parent's process number
    arena: u32,
}

impl Floor {
    /// Starts `robots` agents and waits until they are all there.
    pub(crate) fn raise(robots: u32) -> anyhow::Result<Self> {
        let folder = tempfile::Builder::new()
            .prefix("tick-cost-")
            .tempdir_in("/dev/shm")
            .context("cannot make a folder in shared memory")?;
        let (bell_path, lanes_path) = (folder.path().join("doorbell"), folder.path().join("lanes"));
        let bell = Doorbell::create(&bell_path).context("cannot make the doorbell")?;
        let lanes = Mapping::<Lanes>::create(&lanes_path).context("cannot make the lanes")?;
        let (bell_file, lanes_file) = (File::open(&bell_path)?, File::open(&lanes_path)?);
        folder.close().context("cannot remove the folder in shared memory")?;

        let mut floor = Self { bell, lanes, agents: Vec::new(), tick: 0 };
        floor.bell.expect(robots);
        let program = std::env::current_exe().context("cannot find our own program")?;
        for lane in 0..robots {
            let agent = Command::new(&program)
                .arg("floor-agent")
                .args([our_descriptor(&bell_file), our_descriptor(&lanes_file)])
                .args([lane.to_string(), process::id().to_string()])
                .stdin(Stdio::null())
                .stdout(Stdio::null())
                .spawn()
                .with_context(|| format!("cannot start agent {lane} of the floor"))?;
            floor.agents.push(agent);
        }
        ensure!(floor.bell.wait_for_answers(ANSWER_TIMEOUT), "the agents of the floor did not start in time");
        Ok(floor)
    }

    /// Median of `ticks` ticks.
    pub(crate) fn median_tick(&mut self, ticks: u32) -> anyhow::Result<Duration> {
        for _ in 0..WARM_UP_TICKS {
            self.tick()?;
        }
        let mut times = (0..ticks).map(|_| self.tick()).collect::<anyhow::Result<Vec<_>>>()?;
        times.sort();
        Ok(times[times.len() / 2])
    }

    fn tick(&mut self) -> anyhow::Result<Duration> {
        self.tick += 1;
        let began = Instant::now();
        let lanes = &self.lanes[..self.agents.len()];
        for word in lanes.iter().flat_map(inbox) {
            word.store(self.tick, Relaxed);
        }
        self.bell.expect(lanes.len() as u32);
        self.bell.ring();
        ensure!(self.bell.wait_for_answers(ANSWER_TIMEOUT), "an agent of the floor does not answer");
        let expected = self.tick * INBOX_WORDS as u64;
        let right = lanes.iter().flat_map(answer).all(|word| word.load(Relaxed) == expected);
        let took = began.elapsed();
        ensure!(right, "an agent of the floor gave a wrong answer to tick {}", self.tick);
        Ok(took)
    }
}

impl Drop for Floor {
    fn drop(&mut self) {
        self.bell.close();
        let deadline = Instant::now() + LEAVE_TIMEOUT;
        for agent in &mut self.agents {
            while matches!(agent.try_wait(), Ok(None)) {
                if Instant::now() > deadline {
                    let _ = agent.kill();
                }
                std::thread::sleep(Duration::from_millis(1));
            }
        }
    }
}

/// An agent's life: wake, read, answer, sleep.
pub(crate) fn agent(args: &AgentArgs) -> anyhow::Result<()> {
    let opened = |path: &Path| format!("cannot open {}", path.display());
    let bell = Doorbell::open(&args.bell).with_context(|| opened(&args.bell))?;
    let lanes = Mapping::<Lanes>::open(&args.lanes).with_context(|| opened(&args.lanes))?;
    let lane = lanes.get(args.lane).with_context(|| format!("there is no lane {}", args.lane))?;
    let mut seen = bell.round();
    bell.answer();
    loop {
        match bell.wait_for_ring(seen, ALIVE_POLL) {
            Ring::Closed => return Ok(()),
            Ring::Round(round) => {
                seen = round;
                let heard: u64 = inbox(lane).iter().map(|word| word.load(Relaxed)).sum();
                answer(lane).iter().for_each(|word| word.store(heard, Relaxed));
                bell.answer();
            }
            Ring::Silence if parent_id() == args.arena => {}
            Ring::Silence => bail!("the arena of the floor has died; agent {} leaves", args.lane),
        }
    }
}

fn inbox(lane: &Lane) -> &[AtomicU64] {
    &lane[..INBOX_WORDS]
}

fn answer(lane: &Lane) -> &[AtomicU64] {
    &lane[INBOX_WORDS..][..ANSWER_WORDS]
}

/// How our children reach a file of ours that has no name.
fn our_descriptor(file: &File) -> String {
    format!("/proc/{}/fd/{}", process::id(), file.as_raw_fd())
}

#[cfg(test)]
mod tests {
    use std::thread;

    use super::*;

    #[test]
    fn an_agent_answers_with_the_sum_of_its_inbox_and_leaves_when_the_bell_is_closed() {
        let folder = tempfile::tempdir().unwrap();
        let args = AgentArgs {
            bell: folder.path().join("doorbell"),
            lanes: folder.path().join("lanes"),
            lane: 3,
            arena: parent_id(),
        };
        let bell = Doorbell::create(&args.bell).unwrap();
        let lanes = Mapping::<Lanes>::create(&args.lanes).unwrap();
        bell.expect(1);
        let agent = thread::spawn(move || agent(&args));
        assert!(bell.wait_for_answers(ANSWER_TIMEOUT));
        inbox(&lanes[3]).iter().for_each(|word| word.store(2, Relaxed));
        bell.expect(1);
        bell.ring();
        assert!(bell.wait_for_answers(ANSWER_TIMEOUT));
        assert!(answer(&lanes[3]).iter().all(|word| word.load(Relaxed) == 2 * 96));
        bell.close();
        agent.join().unwrap().unwrap();
    }

    #[test]
    fn an_agent_whose_arena_is_not_its_parent_leaves() {
        let folder = tempfile::tempdir().unwrap();
        let args = AgentArgs {
            bell: folder.path().join("doorbell"),
            lanes: folder.path().join("lanes"),
            lane: 0,
            arena: 0,
        };
        let _bell = Doorbell::create(&args.bell).unwrap();
        let _lanes = Mapping::<Lanes>::create(&args.lanes).unwrap();
        assert!(agent(&args).unwrap_err().to_string().contains("has died"));
    }
}
