//! To whom a packet gets at all: range, its soft edge, and bodies in the line of sight.

use std::cell::Cell;

use crate::{
    frame::{ArenaPoint, Pose},
    grid::Grid,
    random::{Draws, Purpose},
    scenario::{ChannelModel, Scenario},
    voronoi::delaunay_neighbors,
};

/// What decides who is in reach.
#[derive(Clone, Debug)]
pub(super) struct Rules {
    model: ChannelModel,
    range_m: f64,
    soft_edge_m: f64,
    /// Radius of the bodies that block packets; 0 for none.
    blocking_radius_m: f64,
    size_m: [f64; 2],
    seed: u64,
    examined: Cell<u64>,
}

/// Whom one packet gets to.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) struct Reached {
    /// The robots that it reaches, ascending.
    pub(super) robots: Vec<u32>,
    /// How many more it would have reached but for the soft edge.
    pub(super) faded: u32,
    /// How many more but for a body in between.
    pub(super) occluded: u32,
}

impl Reached {
    /// Robots in range, whether the packet got there or not.
    pub(super) fn in_range(&self) -> u64 {
        self.robots.len() as u64 + u64::from(self.faded) + u64::from(self.occluded)
    }
}

/// Who is in reach of whom at one moment.
pub(super) struct Reach<'a> {
    rules: &'a Rules,
    positions: Vec<ArenaPoint>,
    listening: Vec<bool>,
    listeners: u64,
    grid: Grid,
    /// Delaunay neighbors of each robot, if they are what counts.
    voronoi: Option<Vec<Vec<usize>>>,
}

impl Rules {
    pub(super) fn new(scenario: &Scenario) -> Self {
        let channel = &scenario.channel;
        let occlusion = channel.occlusion == Some(true);
        Self {
            model: channel.model,
            range_m: channel.range_m.map_or(f64::INFINITY, |range| range.get()),
            soft_edge_m: channel.soft_edge_m.map_or(0.0, |edge| edge.get()),
            blocking_radius_m: if occlusion { scenario.robots.radius_m.get() } else { 0.0 },
            size_m: scenario.arena.size_m.get(),
            seed: scenario.seed,
            examined: Cell::new(0),
        }
    }

    pub(super) fn examined(&self) -> u64 {
        self.examined.get()
    }

    /// Chance that a packet gets `distance_m` far.
    fn chance_at(&self, distance_m: f64) -> f64 {
        match self.range_m - distance_m {
            inside if inside < 0.0 => 0.0,
            inside if inside < self.soft_edge_m => inside / self.soft_edge_m,
            _ => 1.0,
        }
    }
}

impl<'a> Reach<'a> {
    pub(super) fn now(rules: &'a Rules, poses: &[Pose], listens: impl Fn(usize) -> bool) -> Self {
        let positions: Vec<ArenaPoint> = poses.iter().map(|pose| pose.position).collect();
        let listening: Vec<bool> = (0..poses.len()).map(listens).collect();
        let voronoi = (rules.model == ChannelModel::Voronoi).then(|| {
            let awake: Vec<usize> = (0..poses.len()).filter(|&robot| listening[robot]).collect();
            let spots: Vec<ArenaPoint> = awake.iter().map(|&robot| positions[robot]).collect();
            let mut neighbors = vec![Vec::new(); poses.len()];
            for (&robot, near) in awake.iter().zip(delaunay_neighbors(&spots)) {
                neighbors[robot] = near.into_iter().map(|other| awake[other]).collect();
            }
            neighbors
        });
        let [width, height] = rules.size_m;
        let look_m = rules.range_m.min(libm::hypot(width, height)) + rules.blocking_radius_m;
        Self {
            rules,
            grid: Grid::new(&positions, rules.size_m, look_m),
            listeners: listening.iter().filter(|&&listens| listens).count() as u64,
            positions,
            listening,
            voronoi,
        }
    }

    /// How many robots listen.
    pub(super) fn listeners(&self) -> u64 {
        self.listeners
    }

    /// Whom packet `number` of `sender` gets to.
    pub(super) fn of(&self, sender: u32, number: u64) -> Reached {
        let (here, index) = (self.positions[sender as usize], sender as usize);
        let mut reached = Reached::default();
        let mut meet = |receiver: usize| {
            if receiver == index || !self.listening[receiver] {
                return;
            }
            let away = self.positions[receiver] - here;
            let distance_m = libm::hypot(away.x, away.y);
            let chance = if self.voronoi.is_some() { 1.0 } else { self.rules.chance_at(distance_m) };
            if chance <= 0.0 {
                return;
            }
            let receiver = receiver as u32;
            let fades = || {
                let mut draws = Draws::of(self.rules.seed, Purpose::SoftEdge, number, sender, receiver);
                !draws.chance(chance)
            };
            if self.is_blocked(index, receiver as usize) {
                reached.occluded += 1;
            } else if chance < 1.0 && fades() {
                reached.faded += 1;
            } else {
                reached.robots.push(receiver);
            }
        };
        let mut examined = 0;
        match &self.voronoi {
            Some(neighbors) => neighbors[index].iter().for_each(|&receiver| meet(receiver)),
            None => self.grid.around(&here).for_each(|receiver| {
                examined += 1;
                meet(receiver);
            }),
        }
        self.rules.examined.set(self.rules.examined.get() + examined);
        reached.robots.sort_unstable();
        reached
    }

    /// Whether a third body stands between two robots.
    fn is_blocked(&self, from: usize, to: usize) -> bool {
        let radius_m = self.rules.blocking_radius_m;
        if radius_m == 0.0 {
            return false;
        }
        let (start, way) = (self.positions[from], self.positions[to] - self.positions[from]);
        let length_squared = way.norm_squared();
        let blocks = |body: usize| {
            if body == from || body == to {
                return false;
            }
            let offset = self.positions[body] - start;
            let along = offset.dot(&way) / length_squared;
            (0.0..=1.0).contains(&along) && (offset - way * along).norm() < radius_m
        };
        match self.voronoi {
            // Voronoi neighbors may be anywhere.
            Some(_) => (0..self.positions.len()).any(blocks),
            None => self.grid.around(&start).any(blocks),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rules(soft_edge_m: f64, blocking_radius_m: f64) -> Rules {
        Rules {
            model: ChannelModel::Range,
            range_m: 1.0,
            soft_edge_m,
            blocking_radius_m,
            size_m: [3.0, 3.0],
            seed: 1,
            examined: Cell::new(0),
        }
    }

    fn reached(rules: &Rules, spots: &[(f64, f64)], number: u64) -> Reached {
        let pose = |&(x, y)| Pose::unturned(ArenaPoint::new(x, y));
        let poses: Vec<_> = spots.iter().map(pose).collect();
        Reach::now(rules, &poses, |_| true).of(0, number)
    }

    #[test]
    fn range_is_a_cutoff() {
        let reached = reached(&rules(0.0, 0.0), &[(0.5, 0.5), (1.5, 0.5), (1.6, 0.5), (0.5, 0.5)], 0);
        assert_eq!(reached.robots, [1, 3]);
    }

    #[test]
    fn on_the_soft_edge_the_chance_falls_evenly() {
        // 0.9 m is in the middle of an edge of 0.2 m: a chance of one half.
        let hits = (0..10_000)
            .filter(|&number| !reached(&rules(0.2, 0.0), &[(0.5, 0.5), (1.4, 0.5)], number).robots.is_empty())
            .count();
        assert!((hits as f64 - 5000.0).abs() < 4.0 * 50.0, "{hits}");
        assert_eq!(reached(&rules(0.2, 0.0), &[(0.5, 0.5), (1.29, 0.5)], 0).robots, [1]);
    }

    #[test]
    fn a_body_in_the_line_of_sight_blocks() {
        let blocked = reached(&rules(0.0, 0.1), &[(0.5, 0.5), (1.3, 0.5), (0.9, 0.59)], 0);
        assert_eq!((blocked.robots, blocked.occluded), (vec![2], 1));
        let beside = reached(&rules(0.0, 0.1), &[(0.5, 0.5), (1.3, 0.5), (0.9, 0.61)], 0);
        assert_eq!(beside.robots, [1, 2]);
        let behind = reached(&rules(0.0, 0.1), &[(0.5, 0.5), (1.0, 0.5), (1.3, 0.5)], 0);
        assert_eq!(behind.robots, [1], "who stands behind is hidden, not who stands in front");
    }
}
