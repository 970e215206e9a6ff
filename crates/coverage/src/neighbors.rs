//! The neighbor table: the last delivery of each robot heard lately, and beyond that, of whom which packet was last.

use arrayvec::ArrayVec;
use protocol::{
    odometry::Odometry,
    percept::{DELIVERIES_MAX, Delivery, Tick},
    robot_id::RobotId,
};

/// Most neighbors a robot remembers; past that the nearest stay.
pub const NEIGHBORS_MAX: usize = DELIVERIES_MAX;

/// Most silent senders whose last packet is remembered while the table is full of neighbors; past that the longest
/// silent is forgotten first.
pub const SILENT_MAX: usize = 128;

/// How long a silent sender's last packet is remembered, ticks, or the time-out if that is longer. Within that time
/// packets that were overtaken are told by it. It is bounded because a corrupted packet whose checksum fits may carry
/// a number far ahead, and would else silence its sender for good.
pub const MEMORY_TICKS: u32 = 1024;

/// A robot heard at some tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Neighbor<E = ()> {
    /// When it was heard last.
    pub heard: Tick,
    /// Its last delivery.
    pub delivery: Delivery,
    /// Knowledge of the table's owner beside the delivery.
    pub extra: E,
}

impl<E> Neighbor<E> {
    fn id(&self) -> RobotId {
        self.delivery.packet.sender()
    }
}

/// Deliveries that did not make it into the table, by cause.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Refused {
    /// From a life the sender has left behind, or older than the last one heard.
    pub outdated: u64,
    /// Claiming to come from this very robot.
    pub own: u64,
    /// The table was full of nearer neighbors.
    pub full: u64,
    /// Not a delivery, but the memory of one: silent senders that were forgotten early, because there was no room.
    pub forgotten: u64,
}

/// Last delivery per sender, in the order of sender indices.
///
/// An observer may keep something beside each: `E`.
#[derive(Clone, Debug)]
pub struct NeighborTable<E = ()> {
    own: RobotId,
    timeout_ticks: u32,
    /// The first tick that counts: a robot heard before it is no neighbor any more.
    live_from: Tick,
    /// The owner's odometry that the entries' ranges and bearings go by, if it has any.
    odometry: Option<Odometry>,
    /// Neighbors, and among them silent senders, of whom only the packet's sender and number still count.
    entries: ArrayVec<Neighbor<E>, { NEIGHBORS_MAX + SILENT_MAX }>,
    /// Counts of deliveries turned away so far, by cause.
    pub refused: Refused,
}

impl NeighborTable {
    /// Takes in what was heard at `tick`; who has been silent too long is a neighbor no more.
    pub fn record(&mut self, tick: Tick, deliveries: &[Delivery]) {
        self.record_with(tick, deliveries.iter().map(|delivery| (*delivery, ())));
    }
}

impl<E: Copy> NeighborTable<E> {
    /// An empty table of robot `own`. A neighbor counts while it was heard less than
    /// `timeout_ticks` ago (at least 1: heard in this very tick).
    #[inline]
    pub fn new(own: RobotId, timeout_ticks: u32) -> Self {
        Self {
            own,
            timeout_ticks,
            live_from: 0,
            odometry: None,
            entries: ArrayVec::new(),
            refused: Refused::default(),
        }
    }

    /// Carries all neighbors along with the motion of the table's owner: what was heard before it has turned and moved
    /// lies elsewhere in its body frame of now. Without odometry, nothing is known of that, and entries stay.
    pub fn follow(&mut self, odometry: Option<Odometry>) {
        let Some(now) = odometry else { return };
        let Some(before) = self.odometry.replace(now) else { return };
        let motion = now.since(&before);
        let live_from = self.live_from;
        for neighbor in &mut self.entries {
            if neighbor.heard >= live_from {
                motion.carry_along(&mut neighbor.delivery);
            }
        }
    }

    /// Takes in what was heard at `tick`, with what is known beside.
    pub fn record_with(&mut self, tick: Tick, heard: impl IntoIterator<Item = (Delivery, E)>) {
        let first_of = |ticks: u32| tick.saturating_add(1).saturating_sub(ticks.into());
        let (live_from, known_from) =
            (first_of(self.timeout_ticks), first_of(self.timeout_ticks.max(MEMORY_TICKS)));
        self.live_from = live_from;
        let mut live = 0;
        let mut is_any_to_forget = false;
        for entry in &self.entries {
            live += usize::from(entry.heard >= live_from);
            is_any_to_forget |= entry.heard < known_from;
        }
        if is_any_to_forget {
            self.entries.retain(|entry| entry.heard >= known_from);
        }
        // Deliveries come sorted by sender, as entries are, and mostly of the same senders.
        let mut at = 0;
        for (delivery, extra) in heard {
            let news = Neighbor { heard: tick, delivery, extra };
            match self.entries.get_mut(at) {
                Some(known) if live < NEIGHBORS_MAX && is_next(&news, known) => {
                    live += usize::from(known.heard < live_from);
                    *known = news;
                }
                _ => {
                    at = self.place(at.min(self.entries.len()), news.id().index);
                    self.hear(&mut live, &mut at, news);
                }
            }
            at += 1;
        }
    }

    /// Everyone heard lately, in the order of sender indices.
    pub fn iter(&self) -> impl Iterator<Item = &Neighbor<E>> + Clone {
        self.entries.iter().filter(|entry| self.is_live(entry))
    }

    fn is_live(&self, entry: &Neighbor<E>) -> bool {
        entry.heard >= self.live_from
    }

    /// Where the first entry is whose sender is `index` or comes after it; looked for from `at` on, unless it lies
    /// before.
    fn place(&self, mut at: usize, index: u32) -> usize {
        if at > 0 && self.entries[at - 1].id().index >= index {
            return self.entries.partition_point(|entry| entry.id().index < index);
        }
        while self.entries.get(at).is_some_and(|entry| entry.id().index < index) {
            at += 1;
        }
        at
    }

    /// Takes in news that belong to place `at`, which moves if something before it goes.
    fn hear(&mut self, live: &mut usize, at: &mut usize, news: Neighbor<E>) {
        let id = news.id();
        if id.index == self.own.index {
            self.refused.own += 1;
            return;
        }
        let known = self.entries.get(*at).filter(|known| known.id().index == id.index);
        let (is_known, was_live) = (known.is_some(), known.is_some_and(|known| self.is_live(known)));
        if known.is_some_and(|known| !supersedes(&news, known)) {
            self.refused.outdated += 1;
            return;
        }
        if !was_live {
            if *live >= NEIGHBORS_MAX && !self.displace(at, &news) {
                return;
            }
            *live = (*live + 1).min(NEIGHBORS_MAX);
        }
        if is_known {
            self.entries[*at] = news;
            return;
        }
        if self.entries.is_full() {
            self.forget_longest_silent(at);
        }
        self.entries.insert(*at, news);
    }

    /// Makes room for news in a table full of neighbors, by the farthest; returns whether the news is nearer.
    fn displace(&mut self, at: &mut usize, news: &Neighbor<E>) -> bool {
        self.refused.full += 1;
        let range = |at: usize| self.entries[at].delivery.range.get();
        let farthest = (0..self.entries.len())
            .filter(|&at| self.is_live(&self.entries[at]))
            .max_by(|&a, &b| range(a).total_cmp(&range(b)));
        match farthest.filter(|&farthest| news.delivery.range.get() < range(farthest)) {
            Some(farthest) => {
                self.remove(farthest, at);
                true
            }
            None => false,
        }
    }

    fn forget_longest_silent(&mut self, at: &mut usize) {
        let silent = (0..self.entries.len()).filter(|&at| !self.is_live(&self.entries[at]));
        if let Some(longest) = silent.min_by_key(|&at| self.entries[at].heard) {
            self.refused.forgotten += 1;
            self.remove(longest, at);
        }
    }

    fn remove(&mut self, gone: usize, at: &mut usize) {
        self.entries.remove(gone);
        *at -= usize::from(gone < *at);
    }
}

/// From the same life of the same sender, and no earlier.
fn is_next<E>(news: &Neighbor<E>, known: &Neighbor<E>) -> bool {
    let packets_ahead = news.delivery.packet.sequence().wrapping_sub(known.delivery.packet.sequence()) as i32;
    news.id() == known.id() && packets_ahead >= 0
}

/// A later life beats an earlier one; within a life a packet never beats a later one. Both
/// counters wrap, so "later" means less than half their range ahead.
fn supersedes<E>(news: &Neighbor<E>, known: &Neighbor<E>) -> bool {
    let lives_ahead = news.id().incarnation.wrapping_sub(known.id().incarnation) as i16;
    let packets_ahead = news.delivery.packet.sequence().wrapping_sub(known.delivery.packet.sequence()) as i32;
    lives_ahead > 0 || (lives_ahead == 0 && packets_ahead >= 0)
}

#[cfg(test)]
mod tests {
    use std::vec::Vec;

    use proptest::prelude::*;
    use protocol::{
        packet::Packet,
        units::{Meters, Radians},
    };

    use super::*;

    fn heard(index: u32, incarnation: u16, sequence: u32, range: f64) -> Delivery {
        Delivery {
            packet: Packet::short(RobotId { index, incarnation }, sequence, None),
            range: Meters::new(range).unwrap(),
            bearing: Radians::new(0.0).unwrap(),
            orientation: Radians::new(0.0).unwrap(),
        }
    }

    fn table(timeout_ticks: u32) -> NeighborTable {
        NeighborTable::new(RobotId::first(99), timeout_ticks)
    }

    fn indices(table: &NeighborTable) -> Vec<u32> {
        table.iter().map(|neighbor| neighbor.id().index).collect()
    }

    #[test]
    fn neighbors_are_kept_in_the_order_of_their_indices() {
        let mut table = table(1);
        table.record(0, &[heard(3, 0, 0, 0.5), heard(1, 0, 0, 0.5), heard(2, 0, 0, 0.5)]);
        assert_eq!(indices(&table), [1, 2, 3]);
    }

    #[test]
    fn a_silent_neighbor_is_dropped_after_the_timeout() {
        let mut table = table(4);
        table.record(0, &[heard(1, 0, 0, 0.5)]);
        table.record(3, &[]);
        assert_eq!(indices(&table), [1], "three ticks of silence are within a time-out of four");
        table.record(4, &[]);
        assert!(indices(&table).is_empty());
    }

    #[test]
    fn a_packet_of_a_dead_life_does_not_displace_its_successor() {
        let mut table = table(4);
        table.record(0, &[heard(1, 1, 0, 0.3), heard(1, 0, 500, 0.9)]);
        assert_eq!(table.iter().next().unwrap().delivery.range.get(), 0.3);
        assert_eq!(table.refused.outdated, 1);
    }

    #[test]
    fn an_overtaken_packet_does_not_displace_a_later_one() {
        let mut table = table(4);
        table.record(0, &[heard(1, 0, u32::MAX, 0.3), heard(1, 0, 0, 0.4), heard(1, 0, u32::MAX, 0.5)]);
        assert_eq!(table.iter().next().unwrap().delivery.range.get(), 0.4, "sequence numbers wrap");
    }

    #[test]
    fn an_overtaken_packet_is_not_believed_after_the_timeout() {
        let mut table = table(1);
        table.record(0, &[heard(1, 0, u32::MAX, 0.3), heard(2, 1, 4, 0.3)]);
        table.record(5, &[heard(1, 0, u32::MAX - 3, 0.4), heard(2, 0, 9, 0.4)]);
        assert!(indices(&table).is_empty(), "one was overtaken, one comes from a dead life");
        assert_eq!(table.refused.outdated, 2);
        table.record(6, &[heard(1, 0, 2, 0.5), heard(2, 1, 4, 0.5)]);
        assert_eq!(indices(&table), [1, 2], "sequence numbers wrap, and the last packet may be heard again");
        table.record(7, &[heard(2, 2, 0, 0.5)]);
        assert_eq!(indices(&table), [2], "a new life counts anew");
    }

    #[test]
    fn a_number_far_ahead_silences_its_sender_for_a_bounded_time() {
        for (timeout, memory) in [(1, MEMORY_TICKS), (3000, 3000)] {
            let mut table = table(timeout);
            table.record(7, &[heard(1, 0, u32::MAX / 2, 0.3)]);
            table.record(6 + Tick::from(memory), &[heard(1, 0, 1, 0.4)]);
            assert_eq!(table.refused.outdated, 1);
            table.record(7 + Tick::from(memory), &[heard(1, 0, 2, 0.4)]);
            assert_eq!(table.iter().next().map(|known| known.delivery.packet.sequence()), Some(2));
        }
    }

    #[test]
    fn the_longest_silent_is_forgotten_first_and_never_a_neighbor() {
        let mut table = NeighborTable::new(RobotId::first(9999), 1);
        let crowd = |from: usize, len: usize| -> Vec<_> {
            (from..from + len).map(|i| heard(i as u32, 0, 5, 1.0 + i as f64)).collect()
        };
        table.record(0, &crowd(0, SILENT_MAX));
        table.record(1, &crowd(1000, 1));
        table.record(2, &crowd(2000, NEIGHBORS_MAX));
        assert_eq!(table.iter().count(), NEIGHBORS_MAX);
        assert_eq!(table.refused, Refused { forgotten: 1, ..Refused::default() });
        table.record(3, &[heard(1, 0, 4, 1.0), heard(1000, 0, 4, 1.0)]);
        assert_eq!(table.refused.outdated, 2);
        table.record(4, &[heard(0, 0, 4, 1.0)]);
        assert_eq!(indices(&table), [0], "it alone was known no more");
    }

    #[test]
    fn a_silent_sender_that_speaks_again_has_no_place_among_nearer_neighbors() {
        let mut table = NeighborTable::new(RobotId::first(9999), 2);
        table.record(0, &[heard(9000, 0, 0, 1e3), heard(9001, 0, 0, 0.5)]);
        let crowd: Vec<_> = (0..NEIGHBORS_MAX as u32).map(|i| heard(i, 0, 0, 1.0 + f64::from(i))).collect();
        table.record(5, &crowd);
        table.record(6, &[heard(9000, 0, 1, 1e3), heard(9001, 0, 1, 0.5)]);
        let kept = indices(&table);
        assert_eq!((kept.len(), kept.contains(&9000), kept.contains(&9001)), (NEIGHBORS_MAX, false, true));
        assert_eq!(table.refused.full, 2);
    }

    /// A table without bounds of room, written anew: who is believed, and when it was heard.
    type Known = std::collections::BTreeMap<u32, (Tick, u16, u32)>;

    proptest! {
        #[test]
        fn in_whatever_order_packets_come_the_latest_of_each_sender_is_known(
            timeout in 1_u32..4,
            percepts in proptest::collection::vec(
                (0_u64..500, proptest::collection::vec((0_u32..6, 0_u16..3, 0_u32..6), 0..12)), 1..40),
        ) {
            let mut table = NeighborTable::new(RobotId::first(3), timeout);
            let (mut known, mut tick, mut outdated) = (Known::new(), 0, 0);
            for (wait, packets) in percepts {
                // Mostly the next tick, now and then after most of the memory.
                tick += if wait < 400 { wait % 3 } else { 2 * wait };
                known.retain(|_, &mut (heard, ..)| tick - heard < MEMORY_TICKS.into());
                let base = (u16::MAX - 1, u32::MAX - 2);
                let said = |&(index, life, number): &(u32, u16, u32)| {
                    heard(index, base.0.wrapping_add(life), base.1.wrapping_add(number), 1.0)
                };
                table.record(tick, &packets.iter().map(said).collect::<Vec<_>>());
                for (index, life, number) in packets.into_iter().filter(|packet| packet.0 != 3) {
                    match known.get(&index) {
                        Some(&(_, last, latest)) if (last, latest) > (life, number) => outdated += 1,
                        _ => drop(known.insert(index, (tick, life, number))),
                    }
                }
                let live = known.iter().filter(|(_, (heard, ..))| tick - heard < timeout.into());
                let expected: Vec<_> = live
                    .map(|(&index, &(tick, life, number))| {
                        (tick, said(&(index, life, number)).packet)
                    })
                    .collect();
                let believed: Vec<_> = table.iter().map(|known| (known.heard, known.delivery.packet)).collect();
                prop_assert_eq!(believed, expected);
                prop_assert_eq!(table.refused.outdated, outdated);
            }
        }
    }

    #[test]
    fn nobody_is_its_own_neighbor() {
        let mut table = table(1);
        table.record(0, &[heard(99, 3, 0, 0.1)]);
        assert!(indices(&table).is_empty());
        assert_eq!(table.refused.own, 1);
    }

    #[test]
    fn a_full_table_keeps_the_nearest_and_counts_the_rest() {
        let mut table = NeighborTable::new(RobotId::first(9999), 2);
        let crowd: Vec<_> = (0..NEIGHBORS_MAX as u32).map(|i| heard(i, 0, 0, 1.0 + f64::from(i))).collect();
        table.record(0, &crowd);
        table.record(1, &[heard(5000, 0, 0, 0.5), heard(5001, 0, 0, 1e6)]);
        let kept = indices(&table);
        assert_eq!(kept.len(), NEIGHBORS_MAX);
        assert!(kept.contains(&5000) && !kept.contains(&5001) && !kept.contains(&(NEIGHBORS_MAX as u32 - 1)));
        assert_eq!(table.refused.full, 2);
    }
}
