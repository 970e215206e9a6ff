//! A tick of N processes with nothing in it, by several means.
//!
//! The shape is always that of a lock-step tick: the arena hands a grant of 8 × 96 bytes to every
//! agent; each wakes, reads it all, answers with 96 bytes and sleeps; the arena reads every answer.
//! No channel and no controller. What differs is what carries the bytes and what wakes whom.
//!
//! Contract of every floor:
//! - Dropped, it ends every agent and removes everything, also after an error.
//! - No agent outlives us for more than [`ALIVE_POLL`], whatever ends us.

mod agents;
pub(crate) mod futex;
pub(crate) mod idle;
pub(crate) mod pipes;
pub(crate) mod sockets;
pub(crate) mod streams;
#[cfg(feature = "zeromq")]
pub(crate) mod zeromq;

use std::time::{Duration, Instant};

use anyhow::{bail, ensure};
use squad::stop::StopFlag;

/// Most agents there may be: the futex floor has a lane for each, 3.5 MiB in all.
pub(crate) const ROBOTS_MAX: u32 = 4096;

/// 8 neighbors × 96 bytes, in words of 8 bytes.
const GRANT_WORDS: usize = 8 * 96 / 8;
/// 96 bytes.
const ANSWER_WORDS: usize = 96 / 8;
const GRANT_BYTES: usize = 8 * GRANT_WORDS;
const ANSWER_BYTES: usize = 8 * ANSWER_WORDS;

/// Ticks before the measurement: agents start, caches and page tables fill.
const WARM_UP_TICKS: u32 = 30;
/// A tick, and the start of all agents, takes far less.
const ANSWER_TIMEOUT: Duration = Duration::from_secs(60);
/// How long an agent sleeps before it asks whether the arena still lives.
const ALIVE_POLL: Duration = Duration::from_millis(500);

/// N processes that wait for a tick.
pub(crate) trait Floor {
    /// Plays tick `number`, counted from 1, and checks every answer.
    fn tick(&mut self, number: u64) -> anyhow::Result<()>;
}

/// Median of `ticks` ticks of a floor that has just been raised. An error once `stop` is raised.
pub(crate) fn median_tick(floor: &mut dyn Floor, ticks: u32, stop: &StopFlag) -> anyhow::Result<Duration> {
    let mut times = Vec::with_capacity(ticks as usize);
    for number in 1..=WARM_UP_TICKS + ticks {
        if stop.is_raised() {
            bail!("interrupted");
        }
        let began = Instant::now();
        floor.tick(number.into())?;
        if number > WARM_UP_TICKS {
            times.push(began.elapsed());
        }
    }
    times.sort();
    Ok(times[times.len() / 2])
}

/// Bytes that an agent gets at tick `number`.
fn grant(number: u64) -> [u8; GRANT_BYTES] {
    let mut grant = [0; GRANT_BYTES];
    grant.chunks_exact_mut(8).for_each(|word| word.copy_from_slice(&number.to_le_bytes()));
    grant
}

/// An agent's work: the sum of all words it got, in every word of its answer.
fn answer(grant: &[u8; GRANT_BYTES]) -> [u8; ANSWER_BYTES] {
    let mut sum = 0_u64;
    for word in grant.chunks_exact(8) {
        sum = sum.wrapping_add(u64::from_le_bytes(word.try_into().expect("a chunk of 8 bytes")));
    }
    let mut answer = [0; ANSWER_BYTES];
    answer.chunks_exact_mut(8).for_each(|word| word.copy_from_slice(&sum.to_le_bytes()));
    answer
}

/// Reads the whole of an answer to tick `number`.
fn check(answer: &[u8; ANSWER_BYTES], number: u64) -> anyhow::Result<()> {
    let expected = (number * GRANT_WORDS as u64).to_le_bytes();
    ensure!(answer.chunks_exact(8).all(|word| word == expected), "a wrong answer to tick {number}");
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Counts what it is told to play, and fails at one tick.
    struct Fake {
        played: Vec<u64>,
        fails_at: u64,
    }

    impl Floor for Fake {
        fn tick(&mut self, number: u64) -> anyhow::Result<()> {
            self.played.push(number);
            ensure!(number != self.fails_at, "tick {number} fails");
            Ok(())
        }
    }

    #[test]
    fn an_answer_belongs_to_its_grant() {
        assert!(check(&answer(&grant(7)), 7).is_ok());
        assert!(check(&answer(&grant(7)), 8).is_err());
        let mut spoilt = answer(&grant(7));
        spoilt[ANSWER_BYTES - 1] ^= 1;
        assert!(check(&spoilt, 7).is_err(), "the last byte is read as well");
    }

    #[test]
    fn ticks_are_warmed_up_counted_and_stopped() {
        let (mut fake, stop) = (Fake { played: Vec::new(), fails_at: 0 }, StopFlag::default());
        median_tick(&mut fake, 5, &stop).unwrap();
        assert!(fake.played.iter().copied().eq(1..=u64::from(WARM_UP_TICKS) + 5));
        fake.fails_at = 32;
        assert_eq!(median_tick(&mut fake, 5, &stop).unwrap_err().to_string(), "tick 32 fails");
        fake.played.clear();
        stop.raise(15);
        assert!(median_tick(&mut fake, 5, &stop).is_err() && fake.played.is_empty());
    }
}
