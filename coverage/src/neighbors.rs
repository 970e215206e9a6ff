//! The neighbor table: the last delivery of each robot heard lately.

use arrayvec::ArrayVec;
use protocol::{
    percept::{DELIVERIES_MAX, Delivery, Tick},
    robot_id::RobotId,
};

/// Most neighbors a robot remembers; past that the nearest stay.
pub const NEIGHBORS_MAX: usize = DELIVERIES_MAX;

/// A robot heard at some tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Neighbor {
    /// When it was heard last.
    pub heard: Tick,
    /// What was heard.
    pub delivery: Delivery,
}

impl Neighbor {
    fn id(&self) -> RobotId {
        self.delivery.packet.sender
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
}

/// Last delivery per sender, in the order of sender indices.
#[derive(Clone, Debug)]
pub struct NeighborTable {
    own: RobotId,
    timeout_ticks: u32,
    neighbors: ArrayVec<Neighbor, NEIGHBORS_MAX>,
    /// What was turned away so far.
    pub refused: Refused,
}

impl NeighborTable {
    /// An empty table of robot `own`. A neighbor counts while it was heard less than
    /// `timeout_ticks` ago (at least 1: heard in this very tick).
    pub fn new(own: RobotId, timeout_ticks: u32) -> Self {
        Self { own, timeout_ticks, neighbors: ArrayVec::new(), refused: Refused::default() }
    }

    /// Forgets who has been silent too long, then takes in what was heard at `tick`.
    pub fn record(&mut self, tick: Tick, deliveries: &[Delivery]) {
        let timeout = Tick::from(self.timeout_ticks);
        self.neighbors.retain(|neighbor| tick.saturating_sub(neighbor.heard) < timeout);
        for delivery in deliveries {
            self.hear(Neighbor { heard: tick, delivery: *delivery });
        }
    }

    /// Everyone heard lately, in the order of sender indices.
    pub fn iter(&self) -> impl Iterator<Item = &Neighbor> + Clone {
        self.neighbors.iter()
    }

    fn hear(&mut self, news: Neighbor) {
        let id = news.id();
        if id.index == self.own.index {
            self.refused.own += 1;
            return;
        }
        // Deliveries come sorted by sender, so in a fresh table all news goes to the end.
        let is_last = self.neighbors.last().is_none_or(|last| last.id().index < id.index);
        if is_last && !self.neighbors.is_full() {
            return self.neighbors.push(news);
        }
        match self.neighbors.binary_search_by_key(&id.index, |known| known.id().index) {
            Ok(at) if supersedes(&news, &self.neighbors[at]) => self.neighbors[at] = news,
            Ok(_) => self.refused.outdated += 1,
            Err(at) => self.insert(at, news),
        }
    }

    fn insert(&mut self, mut at: usize, news: Neighbor) {
        if self.neighbors.is_full() {
            self.refused.full += 1;
            let range = |at: &usize| self.neighbors[*at].delivery.range.get();
            let farthest = (0..self.neighbors.len())
                .max_by(|a, b| range(a).total_cmp(&range(b)))
                .expect("a full table is not empty");
            if news.delivery.range.get() >= range(&farthest) {
                return;
            }
            self.neighbors.remove(farthest);
            at -= usize::from(farthest < at);
        }
        self.neighbors.insert(at, news);
    }
}

/// A later life beats an earlier one; within a life a packet never beats a later one. Both
/// counters wrap, so "later" means less than half their range ahead.
fn supersedes(news: &Neighbor, known: &Neighbor) -> bool {
    let lives_ahead = news.id().incarnation.wrapping_sub(known.id().incarnation) as i16;
    let packets_ahead = news.delivery.packet.sequence.wrapping_sub(known.delivery.packet.sequence) as i32;
    lives_ahead > 0 || (lives_ahead == 0 && packets_ahead >= 0)
}

#[cfg(test)]
mod tests {
    use std::vec::Vec;

    use protocol::{
        packet::Packet,
        units::{Meters, Radians},
    };

    use super::*;

    fn heard(index: u32, incarnation: u16, sequence: u32, range: f64) -> Delivery {
        Delivery {
            packet: Packet { sender: RobotId { index, incarnation }, sequence, light: 0.0 },
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
