//! The floor proper: the least a tick of N processes can cost on this machine.
//!
//! The arena writes an inbox for every agent and rings; each agent wakes, reads its inbox, writes its
//! answer; the last one wakes the arena, which reads them all. One page, one futex, no message that
//! is checked.
//!
//! Contract: nothing is left in shared memory, whatever ends us: the two files lose their names before
//! the first agent starts. Agents reach them through our descriptors, in `/proc`.

use std::{
    fs::File,
    os::{fd::AsRawFd, unix::process::parent_id},
    path::{Path, PathBuf},
    process::{self, Command, Stdio},
    sync::atomic::{AtomicU64, Ordering::Relaxed},
};

use anyhow::{Context, bail, ensure};
use clap::Args;
use transport::{
    doorbell::{Doorbell, Ring},
    mapping::Mapping,
};

use super::{ALIVE_POLL, ANSWER_TIMEOUT, ANSWER_WORDS, Floor, GRANT_WORDS, ROBOTS_MAX, agents::Agents};
use crate::machine::our_name;

/// The hidden subcommand.
pub(crate) const AGENT: &str = "futex-agent";

/// Inbox and answer, padded so that no two lanes share a cache line: 14 lines of 64 bytes.
const LANE_WORDS: usize = GRANT_WORDS + ANSWER_WORDS + 4;
const _: () = assert!(LANE_WORDS.is_multiple_of(8));

/// Memory that arena and one agent share.
type Lane = [AtomicU64; LANE_WORDS];
type Lanes = [Lane; ROBOTS_MAX as usize];

/// The arena's side: N running agents.
#[derive(Debug)]
pub(crate) struct Futex {
    bell: Doorbell,
    lanes: Mapping<Lanes>,
    agents: Agents,
}

/// Arguments of an agent.
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

impl Futex {
    /// Starts `robots` agents and waits until they are all there.
    pub(crate) fn raise(robots: u32) -> anyhow::Result<Self> {
        let folder = tempfile::Builder::new()
            .prefix(&format!("{}-", our_name()))
            .tempdir_in("/dev/shm")
            .context("cannot make a folder in shared memory")?;
        let (bell_path, lanes_path) = (folder.path().join("doorbell"), folder.path().join("lanes"));
        let bell = Doorbell::create(&bell_path).context("cannot make the doorbell")?;
        let lanes = Mapping::<Lanes>::create(&lanes_path).context("cannot make the lanes")?;
        let (bell_file, lanes_file) = (File::open(&bell_path)?, File::open(&lanes_path)?);
        folder.close().context("cannot remove the folder in shared memory")?;

        let mut agents = Agents::default();
        bell.expect(robots);
        for lane in 0..robots {
            agents.start(AGENT, |command: &mut Command| {
                command
                    .args([our_descriptor(&bell_file), our_descriptor(&lanes_file)])
                    .args([lane.to_string(), process::id().to_string()])
                    .stdin(Stdio::null())
                    .stdout(Stdio::null());
            })?;
        }
        ensure!(bell.wait_for_answers(ANSWER_TIMEOUT), "the agents did not start in time");
        Ok(Self { bell, lanes, agents })
    }
}

impl Floor for Futex {
    fn tick(&mut self, number: u64) -> anyhow::Result<()> {
        let lanes = &self.lanes[..self.agents.count() as usize];
        for word in lanes.iter().flat_map(inbox) {
            word.store(number, Relaxed);
        }
        self.bell.expect(self.agents.count());
        self.bell.ring();
        ensure!(self.bell.wait_for_answers(ANSWER_TIMEOUT), "an agent does not answer tick {number}");
        let expected = number * GRANT_WORDS as u64;
        let right = lanes.iter().flat_map(answer).all(|word| word.load(Relaxed) == expected);
        ensure!(right, "a wrong answer to tick {number}");
        Ok(())
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
            Ring::Silence => bail!("the arena has died; agent {} leaves", args.lane),
        }
    }
}

fn inbox(lane: &Lane) -> &[AtomicU64] {
    &lane[..GRANT_WORDS]
}

fn answer(lane: &Lane) -> &[AtomicU64] {
    &lane[GRANT_WORDS..][..ANSWER_WORDS]
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
