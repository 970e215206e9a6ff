//! Neighbors that a robot has heard lately, with what they say and how long ago: what controllers in other languages are
//! shown, who would all need such a table.
//!
//! It is the neighbor table of the paper's controller, with payloads and ages.

#![forbid(unsafe_code)]

use std::collections::{BTreeMap, BTreeSet};

use coverage::neighbors::NeighborTable;
use protocol::{
    packet::Body,
    percept::{Delivery, Percept, Tick},
    robot_id::RobotId,
};
use serde::{Deserialize, Serialize};

/// All that a controller in another language is told before its first tick.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Setup {
    /// Parameters from the scenario.
    pub params: serde_json::Map<String, serde_json::Value>,
    /// A neighbor counts while it was heard less than so many ticks ago.
    pub neighbor_timeout_ticks: u32,
}

/// A robot heard lately.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Neighbor<'a> {
    /// Its last delivery, in the body frame of now as far as odometry tells.
    pub delivery: &'a Delivery,
    /// Cycles since it was heard; 0 if that was in this one.
    pub age_cycles: u32,
    /// Payload of that packet.
    pub payload: &'a [u8],
}

/// The neighbors of one robot.
#[derive(Debug)]
pub struct Neighborhood {
    table: NeighborTable<Place>,
    /// Ticks at which cycles have begun, back to when the neighbor was heard that was heard longest ago.
    cycles: Vec<Tick>,
    /// Payloads that are too long to lie in their packets.
    long: BTreeMap<Place, Box<[u8]>>,
    next: Place,
}

/// The key of a long payload.
type Place = u32;

impl Neighborhood {
    /// A neighborhood without anybody. A neighbor counts while it was heard less than `timeout_ticks` ago.
    pub fn new(own: RobotId, timeout_ticks: u32) -> Self {
        Self {
            table: NeighborTable::new(own, timeout_ticks),
            cycles: Vec::new(),
            long: BTreeMap::new(),
            next: 0,
        }
    }

    /// Takes in what was heard in a percept.
    pub fn hear(&mut self, percept: &Percept) {
        let Self { table, long, next, .. } = self;
        table.follow(percept.odometry);
        let kept = |delivery: &Delivery| {
            if let Body::Beside { .. } = delivery.packet.body() {
                *next = next.wrapping_add(1);
                long.insert(*next, percept.payload(delivery).into());
            }
            (*delivery, *next)
        };
        table.record_with(percept.tick, percept.deliveries.iter().map(kept));
        if !long.is_empty() {
            let used: BTreeSet<Place> = table.iter().map(|neighbor| neighbor.extra).collect();
            long.retain(|place, _| used.contains(place));
        }
    }

    /// Takes in what was heard in a percept with which a cycle begins.
    pub fn begin_cycle(&mut self, percept: &Percept) {
        self.hear(percept);
        let oldest = self.table.iter().map(|neighbor| neighbor.heard).min().unwrap_or(percept.tick);
        self.cycles.retain(|&tick| tick > oldest);
        self.cycles.push(percept.tick);
    }

    /// Everybody heard lately, in the order of sender indices.
    pub fn iter(&self) -> impl Iterator<Item = Neighbor<'_>> {
        self.table.iter().map(|neighbor| Neighbor {
            delivery: &neighbor.delivery,
            age_cycles: self.cycles.iter().rev().take_while(|&&tick| tick > neighbor.heard).count() as u32,
            payload: match neighbor.delivery.packet.body() {
                Body::Inline(payload) => payload,
                Body::Beside { .. } => self.long.get(&neighbor.extra).map_or(&[], |payload| payload),
            },
        })
    }
}

#[cfg(test)]
mod tests {
    use protocol::{
        packet::PacketView,
        units::{Meters, Radians},
    };

    use super::*;

    fn percept(tick: Tick, said: &[(u32, &[u8])]) -> Percept {
        let mut percept = Percept::empty(tick);
        for (sender, payload) in said {
            let view = PacketView { sender: RobotId::first(*sender), sequence: tick as u32, payload };
            let packet = percept.packet(&view);
            percept.deliveries.push(Delivery {
                packet,
                range: Meters::new(1.0).unwrap(),
                bearing: Radians::new(0.0).unwrap(),
                orientation: Radians::new(0.0).unwrap(),
            });
        }
        percept
    }

    fn seen(neighborhood: &Neighborhood) -> Vec<(u32, u32, Vec<u8>)> {
        let seen = |it: Neighbor<'_>| (it.delivery.packet.sender().index, it.age_cycles, it.payload.to_vec());
        neighborhood.iter().map(seen).collect()
    }

    #[test]
    fn neighbors_are_shown_with_their_ages_and_what_they_said_last() {
        let mut neighborhood = Neighborhood::new(RobotId::first(9), 30);
        let long = [7; 100];
        neighborhood.begin_cycle(&percept(0, &[(1, b"ab"), (2, &long)]));
        neighborhood.begin_cycle(&percept(10, &[(1, b"cd")]));
        assert_eq!(seen(&neighborhood), [(1, 0, b"cd".to_vec()), (2, 1, long.to_vec())]);
        neighborhood.begin_cycle(&percept(20, &[(1, &long[1..])]));
        assert_eq!(seen(&neighborhood), [(1, 0, long[1..].to_vec()), (2, 2, long.to_vec())]);
        neighborhood.begin_cycle(&percept(30, &[]));
        assert_eq!(seen(&neighborhood), [(1, 1, long[1..].to_vec())], "the other one is forgotten");
        assert_eq!(neighborhood.long.len(), 1, "and so is what it said");
    }

    #[test]
    fn what_is_heard_between_two_cycles_is_of_the_next() {
        let mut neighborhood = Neighborhood::new(RobotId::first(9), 30);
        neighborhood.begin_cycle(&percept(0, &[]));
        neighborhood.hear(&percept(5, &[(1, b"x")]));
        neighborhood.begin_cycle(&percept(10, &[]));
        assert_eq!(seen(&neighborhood), [(1, 1, b"x".to_vec())]);
    }
}
