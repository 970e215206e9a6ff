//! The doorbell of lock-step: one page of shared memory with the tick number and a countdown.
//!
//! The arena sets the countdown to the number of live agents, raises the tick and wakes all of
//! them by one broadcast futex; the last agent to answer wakes the arena. Every wait has a
//! timeout, so a dead partner costs time but never blocks. Ringing is only a hint to look: what
//! counts are the messages, so an agent that rings falsely gains nothing. (An agent that writes
//! `closed` sends the others home. It could as well kill them: they run as the same user.)

#![allow(unsafe_code)] // One `unsafe impl`; the mapping itself is in `mapping`.

use std::{
    io,
    path::Path,
    sync::atomic::{AtomicU32, AtomicU64, Ordering},
    time::Duration,
    time::Instant,
};

use rustix::{
    io::Errno,
    thread::futex::{self, Flags, Timespec},
};

use crate::{
    mapping::{Mapping, Shareable},
    version::VERSION,
};

/// Begins each page of ours, and says of which version it is.
const MAGIC: u32 = u32::from_le_bytes([b'L', b'M', b'B', VERSION]);

/// Words of 64 bits, one bit per robot that can sign its answers; those with a higher index answer without a name.
const SIGNATURE_WORDS: usize = 128;

/// State that agents read whenever they wake up, in a cache line of its own.
#[repr(C, align(64))]
#[derive(Debug)]
struct Round {
    /// Raised once per tick; agents sleep on it.
    number: AtomicU32,
    /// Not zero once the run is over.
    closed: AtomicU32,
}

/// A word in a cache line of its own.
#[repr(C, align(64))]
#[derive(Debug)]
struct Line(AtomicU32);

#[repr(C)]
#[derive(Debug)]
struct Page {
    magic: AtomicU32,
    round: Round,
    /// Answers the arena still waits for; the arena sleeps on it.
    missing: Line,
    /// One bit per robot that has signed an answer since the arena last looked.
    signatures: [AtomicU64; SIGNATURE_WORDS],
}
const _: () = assert!(size_of::<Page>() == 192 + SIGNATURE_WORDS * 8);

// SAFETY: `Page` consists of atomics; what padding the alignment makes is never read.
unsafe impl Shareable for Page {}

/// Event that an agent wakes up to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ring {
    /// A new round has begun; this is its number.
    Round(u32),
    /// The run is over.
    Closed,
    /// Nothing happened for as long as one was ready to wait.
    Silence,
}

/// The page, as either side sees it.
#[derive(Debug)]
pub struct Doorbell {
    page: Mapping<Page>,
}

impl Doorbell {
    /// The arena's: a new page at `path`. It appears there complete, so an agent that sees it can
    /// use it.
    pub fn create(path: &Path) -> io::Result<Self> {
        let unfinished = path.with_extension("new");
        let page = Mapping::<Page>::create(&unfinished)?;
        page.magic.store(MAGIC, Ordering::Release);
        std::fs::rename(&unfinished, path)?;
        Ok(Self { page })
    }

    /// An agent's: the page of a running arena.
    ///
    /// # Errors
    /// If it cannot be opened, or is of another version of ours.
    pub fn open(path: &Path) -> io::Result<Self> {
        let page = Mapping::<Page>::open(path)?;
        match page.magic.load(Ordering::Acquire) {
            MAGIC => Ok(Self { page }),
            other => {
                let [theirs, ours] =
                    [other, MAGIC].map(|magic| magic.to_le_bytes().escape_ascii().to_string());
                Err(io::Error::new(
                    io::ErrorKind::InvalidData,
                    format!(
                        "the run speaks version {theirs} and this program {ours}: they were built of two versions of \
                         Lamplight; build both of one"
                    ),
                ))
            }
        }
    }

    /// The arena expects `answers` answers to what it rings for next.
    pub fn expect(&self, answers: u32) {
        self.page.missing.0.store(answers, Ordering::Release);
    }

    /// The arena begins the next round and wakes every agent.
    pub fn ring(&self) {
        self.page.round.number.fetch_add(1, Ordering::Release);
        wake_all(&self.page.round.number);
    }

    /// The arena ends the run and wakes every agent to see it.
    pub fn close(&self) {
        self.page.round.closed.store(1, Ordering::Release);
        self.ring();
    }

    /// The arena waits until the countdown is through, `timeout` at most. Returns whether it is;
    /// true is only a hint that all answers may be there.
    pub fn wait_for_answers(&self, timeout: Duration) -> bool {
        let deadline = Instant::now() + timeout;
        loop {
            // Counted below zero by a false ring: nothing left to wait for here.
            let missing = self.page.missing.0.load(Ordering::Acquire);
            if missing as i32 <= 0 {
                return true;
            }
            let left = deadline.saturating_duration_since(Instant::now());
            if left.is_zero() {
                return false;
            }
            sleep_while(&self.page.missing.0, missing, left);
        }
    }

    /// The number of the current round.
    pub fn round(&self) -> u32 {
        self.page.round.number.load(Ordering::Acquire)
    }

    /// Returns what an agent would wake up to now, without waiting.
    pub fn look(&self, seen: u32) -> Ring {
        match self.round() {
            _ if self.is_closed() => Ring::Closed,
            round if round != seen => Ring::Round(round),
            _ => Ring::Silence,
        }
    }

    /// An agent waits for a round after `seen`, about `timeout` at most; it reads no clock.
    pub fn wait_for_ring(&self, seen: u32, timeout: Duration) -> Ring {
        loop {
            match self.look(seen) {
                Ring::Silence => {}
                ring => return ring,
            }
            if sleep_while(&self.page.round.number, seen, timeout) == Slept::Enough {
                return Ring::Silence;
            }
        }
    }

    /// True once the run is over.
    pub fn is_closed(&self) -> bool {
        self.page.round.closed.load(Ordering::Acquire) != 0
    }

    /// An agent has answered; the last one wakes the arena.
    #[inline]
    pub fn answer(&self) {
        if self.page.missing.0.fetch_sub(1, Ordering::AcqRel) == 1 {
            wake_all(&self.page.missing.0);
        }
    }

    /// The same, and says whose answer it is, so that an arena that waits for nobody in particular need not look
    /// at everybody.
    pub fn answer_as(&self, robot: u32) {
        if let Some(word) = self.page.signatures.get(robot as usize / 64) {
            word.fetch_or(1 << (robot % 64), Ordering::Release);
        }
        self.answer();
    }

    /// Robots whose signatures have come since the arena looked last, ascending. As any agent may sign for any
    /// robot, this too is only a hint, and may name robots that do not exist.
    pub fn signed(&self) -> impl Iterator<Item = u32> {
        (0..).zip(&self.page.signatures).flat_map(|(at, word)| {
            // Looking costs the agents less than taking.
            let bits = if word.load(Ordering::Relaxed) == 0 { 0 } else { word.swap(0, Ordering::Acquire) };
            (0..64).filter(move |bit| bits & (1 << bit) != 0).map(move |bit| at * 64 + bit)
        })
    }
}

fn wake_all(word: &AtomicU32) {
    futex::wake(word, Flags::empty(), i32::MAX as u32).expect("a mapped word can be woken");
}

/// Why a sleep ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Slept {
    /// The time is over.
    Enough,
    /// Woken, interrupted, or the word has changed: look again.
    Disturbed,
}

/// Sleeps until somebody wakes `word` or it no longer holds `value`, `timeout` at most.
fn sleep_while(word: &AtomicU32, value: u32, timeout: Duration) -> Slept {
    let timeout = Timespec { tv_sec: timeout.as_secs() as i64, tv_nsec: timeout.subsec_nanos().into() };
    match futex::wait(word, Flags::empty(), value, Some(&timeout)) {
        Err(Errno::TIMEDOUT) => Slept::Enough,
        _ => Slept::Disturbed,
    }
}

#[cfg(test)]
mod tests {
    use std::thread;

    use super::*;

    const SOON: Duration = Duration::from_secs(20);

    fn page() -> (tempfile::TempDir, Doorbell, std::path::PathBuf) {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("doorbell");
        let arena = Doorbell::create(&path).unwrap();
        (folder, arena, path)
    }

    #[test]
    fn rounds_reach_every_agent_and_answers_reach_the_arena() {
        let (_folder, arena, path) = page();
        let agents: Vec<_> = (0..4)
            .map(|_| {
                let bell = Doorbell::open(&path).unwrap();
                thread::spawn(move || {
                    let mut seen = 0;
                    while let Ring::Round(round) = bell.wait_for_ring(seen, SOON) {
                        assert_eq!(round, seen + 1, "no round is missed in lock-step");
                        seen = round;
                        bell.answer();
                    }
                    seen
                })
            })
            .collect();
        for _ in 0..100 {
            arena.expect(4);
            arena.ring();
            assert!(arena.wait_for_answers(SOON));
        }
        arena.close();
        for agent in agents {
            assert_eq!(agent.join().unwrap(), 100);
        }
    }

    #[test]
    fn a_silent_agent_costs_the_timeout_and_no_more() {
        let (_folder, arena, _) = page();
        arena.expect(1);
        arena.ring();
        assert!(!arena.wait_for_answers(Duration::from_millis(5)));
    }

    #[test]
    fn false_rings_do_not_lock_the_arena_up() {
        let (_folder, arena, _) = page();
        arena.expect(1);
        for _ in 0..5 {
            arena.answer();
        }
        assert!(arena.wait_for_answers(Duration::from_millis(5)));
    }

    #[test]
    fn an_agent_without_an_arena_hears_silence() {
        let (_folder, _arena, path) = page();
        let agent = Doorbell::open(&path).unwrap();
        assert_eq!(agent.wait_for_ring(0, Duration::from_millis(5)), Ring::Silence);
    }

    #[test]
    fn a_page_of_another_version_is_refused_in_plain_words() {
        let (_folder, arena, path) = page();
        arena.page.magic.store(u32::from_le_bytes(*b"LMB1"), Ordering::Release);
        let refusal = Doorbell::open(&path).unwrap_err().to_string();
        let ours = char::from(VERSION);
        assert!(
            refusal.starts_with(&format!("the run speaks version LMB1 and this program LMB{ours}: ")),
            "{refusal}"
        );
    }

    #[test]
    fn who_signs_is_seen_once() {
        let (_folder, arena, path) = page();
        let agent = Doorbell::open(&path).unwrap();
        assert_eq!(arena.signed().count(), 0);
        arena.expect(4);
        for robot in [64, 3, 8191, u32::MAX] {
            agent.answer_as(robot);
        }
        assert!(arena.wait_for_answers(SOON), "whoever cannot sign has answered too");
        assert_eq!(arena.signed().collect::<Vec<_>>(), [3, 64, 8191]);
        assert_eq!(arena.signed().count(), 0);
        assert_eq!(64 * SIGNATURE_WORDS, 8192);
    }

    #[test]
    fn a_file_that_is_no_doorbell_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("doorbell");
        std::fs::write(&path, [1; 192]).unwrap();
        assert!(Doorbell::open(&path).is_err());
    }
}
