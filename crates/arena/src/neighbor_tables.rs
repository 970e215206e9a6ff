//! An observer's copy of every robot's neighbor table: who knows of whom.
//!
//! The tables are filled by the same code from the same deliveries, so they are what the agents have; beside each entry
//! they hold when its packet was sent, which no agent is told. From them come the hearing graph, how stale the tables
//! are, and whether a robot knows those who shape its cell.

use coverage::neighbors::NeighborTable;
use protocol::{percept::Percept, robot_id::RobotId};

/// The neighbor tables of all robots.
#[derive(Clone, Debug)]
pub struct NeighborTables {
    /// With the time at which each packet was sent, seconds.
    tables: Vec<NeighborTable<f64>>,
    lives: Vec<RobotId>,
    /// By robot.
    timeout_ticks: Vec<u32>,
}

impl NeighborTables {
    /// Empty tables, one for each of `timeout_ticks`, after which its neighbors are forgotten.
    pub fn new(timeout_ticks: Vec<u32>) -> Self {
        let lives: Vec<RobotId> = (0..).zip(&timeout_ticks).map(|(index, _)| RobotId::first(index)).collect();
        let table = |(&id, &timeout)| NeighborTable::new(id, timeout);
        Self { tables: lives.iter().zip(&timeout_ticks).map(table).collect(), lives, timeout_ticks }
    }

    /// Robot `id` gets its percept, the packets in which were sent at `sent_s`. A new life has forgotten what the
    /// last one knew.
    pub fn record(&mut self, id: RobotId, percept: &Percept, sent_s: &[f64]) {
        let at = id.index as usize;
        if self.lives[at] != id {
            self.lives[at] = id;
            self.tables[at] = NeighborTable::new(id, self.timeout_ticks[at]);
        }
        let heard = percept.deliveries.iter().copied().zip(sent_s.iter().copied());
        self.tables[at].follow(percept.odometry);
        self.tables[at].record_with(percept.tick, heard);
    }

    /// The robots that robot `robot` knows of, ascending.
    pub fn known_to(&self, robot: usize) -> impl Iterator<Item = usize> {
        self.tables[robot].iter().map(|neighbor| neighbor.delivery.packet.sender().index as usize)
    }

    /// Mean age at `time_s`, since its packet was sent, of what `robots` know of others; `None` if they know nobody.
    pub fn staleness_s(&self, robots: &[usize], time_s: f64) -> Option<f64> {
        let entries = robots.iter().flat_map(|&robot| self.tables[robot].iter());
        let (count, ages_s) = entries
            .fold((0_u64, 0.0), |(count, ages_s), neighbor| (count + 1, ages_s + (time_s - neighbor.extra)));
        (count > 0).then(|| ages_s / count as f64)
    }

    /// How often a table was full of nearer neighbors, in the present lives of all robots.
    pub fn over_bound(&self) -> u64 {
        self.tables.iter().map(|table| table.refused.full).sum()
    }

    /// Connected components of the hearing graph of `robots` (ascending): two are joined if either
    /// knows of the other.
    pub fn components(&self, robots: &[usize]) -> usize {
        let mut parent: Vec<usize> = (0..self.tables.len()).collect();
        let alive = |robot: usize| robots.binary_search(&robot).is_ok();
        let mut components = robots.len();
        for &robot in robots {
            for other in self.known_to(robot).filter(|&other| alive(other)) {
                let (a, b) = (root(&mut parent, robot), root(&mut parent, other));
                if a != b {
                    parent[a.max(b)] = a.min(b);
                    components -= 1;
                }
            }
        }
        components
    }
}

/// The representative of a robot's component, with the way to it shortened.
fn root(parent: &mut [usize], robot: usize) -> usize {
    let mut at = robot;
    while parent[at] != at {
        parent[at] = parent[parent[at]];
        at = parent[at];
    }
    at
}

#[cfg(test)]
mod tests {
    use protocol::{
        packet::Packet,
        percept::{Delivery, Tick},
        units::{Meters, Radians},
    };

    use super::*;

    fn percept(tick: Tick, senders: &[u32]) -> Percept {
        let mut percept = Percept::empty(tick);
        percept.deliveries.extend(senders.iter().map(|&index| Delivery {
            packet: Packet::short(RobotId::first(index), tick as u32, None),
            range: Meters::new(1.0).unwrap(),
            bearing: Radians::new(0.0).unwrap(),
            orientation: Radians::new(0.0).unwrap(),
        }));
        percept
    }

    #[test]
    fn who_is_heard_one_way_is_joined() {
        let mut hearing = NeighborTables::new(vec![4; 5]);
        hearing.record(RobotId::first(0), &percept(0, &[1]), &[0.0]);
        hearing.record(RobotId::first(2), &percept(0, &[3]), &[0.0]);
        assert_eq!(hearing.components(&[0, 1, 2, 3, 4]), 3);
        assert_eq!(hearing.components(&[0, 2, 4]), 3, "the dead join nobody");
    }

    #[test]
    fn what_was_heard_ages_and_a_new_life_knows_nothing() {
        let mut hearing = NeighborTables::new(vec![4; 2]);
        hearing.record(RobotId::first(0), &percept(0, &[1]), &[-0.25]);
        hearing.record(RobotId::first(0), &percept(2, &[]), &[]);
        assert_eq!(hearing.staleness_s(&[0, 1], 2.5), Some(2.75));
        hearing.record(RobotId::first(0).reborn(), &percept(3, &[]), &[]);
        assert_eq!(hearing.known_to(0).count(), 0);
        assert_eq!(hearing.staleness_s(&[0, 1], 3.0), None, "what nobody knows has no age");
    }
}
