//! The last cycles of all robots, written from front to back, so that a tick is not slowed down by it.
//!
//! What each robot needs of it is read much later and for many cycles at once. By then nothing of it is in the
//! caches, but all of it can be fetched together.

use std::ops::Range;

use protocol::percept::{Percept, Tick};
use transport::{
    clock::Stamp,
    raw::{BOOT_TICK, RawTimes},
};

use super::flight::Origins;

/// Cycles as the arena counts them: how often it has handed percepts out before.
pub(super) type Round = u64;

/// First part of a packet whose origin is not known. One that is as long as that is not known either.
const UNKNOWN: u32 = u32::MAX;

/// A ring of rounds.
#[derive(Debug)]
pub(super) struct Journal {
    pages: Vec<Page>,
    /// Rounds that have begun.
    rounds: Round,
}

/// One round.
#[derive(Clone, Debug)]
struct Page {
    tick: Tick,
    handed_out: Stamp,
    /// First parts of the packets that are handed out, robot by robot; [`UNKNOWN`] of some.
    first_ns: Vec<u32>,
    /// Which of them a robot gets; of this round only if the tick is.
    heard: Vec<Heard>,
    /// Its answers; of this round only if the tick is.
    answers: Vec<Answer>,
}

#[derive(Clone, Copy, Debug)]
struct Heard {
    tick: Tick,
    begin: u32,
    end: u32,
}

/// Excerpt of one robot's rounds, read at once. Kept for its memory alone.
#[derive(Debug, Default)]
pub(super) struct Excerpt {
    /// Its answers, in order of rounds.
    pub(super) answers: Vec<Answer>,
    /// Transport times of packets that it had heard in those rounds, as far as they are known.
    pub(super) packets_ns: Vec<u64>,
    heard: Vec<(usize, Heard, u32)>,
}

/// One agent's times of its cycle: one line of cache.
#[derive(Clone, Copy, Debug)]
#[repr(align(64))]
pub(super) struct Answer {
    /// The tick of the percept it answers.
    pub(super) tick: Tick,
    /// From ring or deadline until it ran.
    pub(super) wake_ns: u32,
    /// From the hand-out until it had read its percept.
    pub(super) second_ns: u32,
    /// The rest.
    pub(super) times: RawTimes,
}

const _: () = assert!(size_of::<Answer>() == 64);

impl Answer {
    /// To `tick`, one that says nothing that makes sense.
    pub(super) fn broken(tick: Tick) -> Self {
        Self { tick, wake_ns: 0, second_ns: 0, times: RawTimes::default() }
    }

    /// Whether it makes no sense.
    pub(super) fn is_broken(&self) -> bool {
        self.times.woke == 0
    }
}

impl Journal {
    /// Keeps so many rounds.
    pub(super) fn new(robots: usize, rounds: usize) -> Self {
        let heard = vec![Heard { tick: BOOT_TICK, begin: 0, end: 0 }; robots];
        let page = Page {
            tick: BOOT_TICK,
            handed_out: Stamp(0),
            first_ns: Vec::new(),
            heard,
            answers: vec![Answer::broken(BOOT_TICK); robots],
        };
        Self { pages: vec![page; rounds], rounds: 0 }
    }

    /// Rounds that have begun.
    pub(super) fn rounds(&self) -> Round {
        self.rounds
    }

    /// Another round begins, that of `tick`.
    pub(super) fn begin(&mut self, tick: Tick, handed_out: Stamp) {
        let at = self.place(self.rounds);
        self.rounds += 1;
        let page = &mut self.pages[at];
        (page.tick, page.handed_out) = (tick, handed_out);
        page.first_ns.clear();
    }

    /// Robot `index` gets `percept` in the present round. Returns how many of its packets have no known origin.
    pub(super) fn hand_out(&mut self, index: usize, percept: &Percept, origins: &Origins) -> usize {
        let at = self.place(self.rounds.saturating_sub(1));
        let page = &mut self.pages[at];
        let begin = page.first_ns.len();
        let first_ns = percept.deliveries.iter().map(|heard| origins.of(&heard.packet).unwrap_or(UNKNOWN));
        page.first_ns.extend(first_ns);
        page.heard[index] = Heard { tick: page.tick, begin: begin as u32, end: page.first_ns.len() as u32 };
        page.first_ns[begin..].iter().filter(|&&first_ns| first_ns == UNKNOWN).count()
    }

    /// When the percepts of `tick` were handed out, if that is one of the last `within` rounds.
    pub(super) fn handed_out(&self, tick: Tick, within: Round) -> Option<(Round, Stamp)> {
        let rounds = self.rounds.saturating_sub(within)..self.rounds;
        let page = |round| (round, &self.pages[self.place(round)]);
        rounds
            .rev()
            .map(page)
            .find(|(_, page)| page.tick == tick)
            .map(|(round, page)| (round, page.handed_out))
    }

    /// Robot `index` answers in `round`.
    pub(super) fn note(&mut self, index: usize, round: Round, answer: Answer) {
        let at = self.place(round);
        self.pages[at].answers[index] = answer;
    }

    /// Writes over `excerpt` what there is of robot `index` in `rounds`.
    ///
    /// Nothing of it is in a cache, and a loop that does not wait for what it fetches has many fetches on their way.
    /// So one pass fetches what lies at known places, another one what that points to, and only then is it looked at.
    pub(super) fn read(&self, index: usize, rounds: Range<Round>, excerpt: &mut Excerpt) {
        let Excerpt { answers, packets_ns, heard } = excerpt;
        answers.clear();
        packets_ns.clear();
        heard.clear();
        for round in rounds {
            let at = self.place(round);
            let page = &self.pages[at];
            let answer = page.answers[index];
            if answer.tick == page.tick {
                answers.push(answer);
                heard.push((at, page.heard[index], answer.second_ns));
            }
        }
        for (&(at, heard, second_ns), answer) in heard.iter().zip(&*answers) {
            let page = &self.pages[at];
            if heard.tick == page.tick && !answer.is_broken() {
                let first_ns = &page.first_ns[heard.begin as usize..heard.end as usize];
                packets_ns.extend(first_ns.iter().map(|&first_ns| match first_ns {
                    UNKNOWN => u64::MAX,
                    _ => u64::from(first_ns) + u64::from(second_ns),
                }));
            }
        }
        packets_ns.retain(|&ns| ns != u64::MAX);
    }

    fn place(&self, round: Round) -> usize {
        (round % self.pages.len() as u64) as usize
    }
}

#[cfg(test)]
mod tests {
    use protocol::{
        packet::Packet,
        percept::Delivery,
        robot_id::RobotId,
        units::{Meters, Radians},
    };

    use super::*;

    fn percept(tick: Tick, sequences: &[u32]) -> Percept {
        let mut percept = Percept::empty(tick);
        percept.deliveries = sequences
            .iter()
            .map(|&sequence| Delivery {
                packet: Packet::short(RobotId::first(0), sequence, None),
                range: Meters::new(1.0).unwrap(),
                bearing: Radians::new(0.0).unwrap(),
                orientation: Radians::new(0.0).unwrap(),
            })
            .collect();
        percept
    }

    fn answer(tick: Tick) -> Answer {
        Answer { tick, wake_ns: 1, second_ns: 2, times: RawTimes { woke: 1, ..RawTimes::default() } }
    }

    #[test]
    fn what_was_heard_and_answered_in_a_round_is_found_until_the_ring_is_through() {
        let mut origins = Origins::new(1);
        origins.note(&percept(0, &[5]).deliveries[0].packet, 50);
        let mut journal = Journal::new(2, 3);
        journal.begin(10, Stamp(100));
        assert_eq!(journal.hand_out(0, &percept(10, &[5, 6, 5]), &origins), 1, "one is unknown");
        assert_eq!(journal.hand_out(1, &percept(10, &[5]), &origins), 0);
        journal.begin(12, Stamp(200));
        assert_eq!(journal.hand_out(0, &percept(12, &[]), &origins), 0);
        assert_eq!(journal.handed_out(10, 2), Some((0, Stamp(100))));
        assert_eq!(journal.handed_out(10, 1), None, "that long ago does not count");
        assert_eq!(journal.handed_out(11, 2), None);
        journal.note(0, 0, answer(10));
        journal.note(1, 1, answer(12));
        let read = |journal: &Journal, index, rounds: Range<Round>| {
            let mut excerpt = Excerpt::default();
            journal.read(index, rounds, &mut excerpt);
            (excerpt.answers.iter().map(|answer| answer.tick).collect::<Vec<_>>(), excerpt.packets_ns)
        };
        assert_eq!(read(&journal, 0, 0..2), (vec![10], vec![52, 52]), "each took both ways");
        assert_eq!(read(&journal, 1, 0..1), (vec![], vec![]), "it has not answered");
        assert_eq!(
            read(&journal, 1, 0..2),
            (vec![12], vec![]),
            "it answered a percept that it was not given"
        );
        (13..15).for_each(|tick| journal.begin(tick, Stamp(300)));
        assert_eq!(read(&journal, 0, 3..4), (vec![], vec![]), "in the place of round 0");
        assert_eq!(journal.rounds(), 4);
    }
}
