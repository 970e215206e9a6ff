//! To whom a packet gets at all, to be read or only to disturb: range, its soft edge, and bodies in the line of sight.

use nalgebra::Vector2;

use crate::{
    delaunay::Delaunay,
    frame::{ArenaPoint, Pose},
    grid::Grid,
    random::{Draws, Purpose},
};
use scenario::{ChannelModel, Scenario};

/// Parameters that decide who is in reach.
#[derive(Clone, Debug)]
pub(super) struct Rules {
    is_voronoi: bool,
    range_m: f64,
    soft_edge_m: f64,
    /// Distance up to which a packet disturbs others, at least `range_m`.
    interference_m: f64,
    /// Whether packets that are blocked disturb others.
    blocked_disturb: bool,
    /// Radius of the bodies that block packets; 0 for none.
    blocking_radius_m: f64,
    size_m: [f64; 2],
    seed: u64,
}

/// Robots that one packet gets to.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) struct Reached {
    /// The robots that it reaches, ascending.
    pub(super) robots: Vec<u32>,
    /// The robots that it only disturbs, ascending: too weak to be read, or blocked.
    pub(super) disturbed: Vec<u32>,
    /// How many more it would have reached but for the soft edge.
    pub(super) faded: u32,
    /// How many more but for a body in between.
    pub(super) occluded: u32,
    /// How many robots were looked at to find them.
    pub(super) examined: u32,
}

impl Reached {
    pub(super) fn clear(&mut self) {
        self.robots.clear();
        self.disturbed.clear();
        (self.faded, self.occluded, self.examined) = (0, 0, 0);
    }

    /// Robots in range, whether the packet got there or not.
    pub(super) fn in_range(&self) -> u64 {
        self.robots.len() as u64 + u64::from(self.faded) + u64::from(self.occluded)
    }
}

/// Reach of every robot at the moment it has been shown last.
#[derive(Clone, Debug)]
pub(super) struct Reach {
    rules: Rules,
    positions: Vec<ArenaPoint>,
    listening: Vec<bool>,
    listeners: u64,
    near: Near,
}

/// Candidates for being in reach.
#[derive(Clone, Debug)]
enum Near {
    /// Robots of the cells around.
    Grid(Grid),
    /// Delaunay neighbors, wherever they are.
    Voronoi(Delaunay),
}

impl Rules {
    pub(super) fn new(scenario: &Scenario) -> Self {
        let channel = &scenario.channel;
        let (range_m, soft_edge_m, interference_m) = match channel.model {
            ChannelModel::Voronoi => (f64::INFINITY, 0.0, f64::INFINITY),
            ChannelModel::Range { range_m, soft_edge_m, interference_range_m } => {
                (range_m.get(), soft_edge_m.get(), interference_range_m.get())
            }
        };
        Self {
            is_voronoi: channel.model == ChannelModel::Voronoi,
            range_m,
            interference_m,
            blocked_disturb: channel.air().is_some_and(|air| air.occluded_interference),
            soft_edge_m,
            blocking_radius_m: if channel.occlusion { scenario.robots.radius_m.get() } else { 0.0 },
            size_m: scenario.arena.size_m.get(),
            seed: scenario.seed.get(),
        }
    }

    /// Chance that a packet gets as far as `away`. Most pairs are so clearly out of range, or in it, that no
    /// rounding matters and the distance need not be known.
    fn chance_over(&self, away: Vector2<f64>) -> f64 {
        const CLEARLY: f64 = 1e-9;
        let (square, sure_m) = (away.norm_squared(), self.range_m - self.soft_edge_m);
        if square > self.range_m * self.range_m * (1.0 + CLEARLY) {
            0.0
        } else if sure_m > 0.0 && square < sure_m * sure_m * (1.0 - CLEARLY) {
            1.0
        } else {
            self.chance_at(libm::hypot(away.x, away.y))
        }
    }

    /// Whether some packets may disturb others without being read.
    fn disturb_unread(&self) -> bool {
        self.blocked_disturb || self.disturbs_beyond_range()
    }

    /// Whether packets too weak to be read disturb others.
    fn disturbs_beyond_range(&self) -> bool {
        self.interference_m > self.range_m
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

impl Reach {
    pub(super) fn new(scenario: &Scenario) -> Self {
        Self::by(Rules::new(scenario))
    }

    fn by(rules: Rules) -> Self {
        let near = match rules.is_voronoi {
            true => Near::Voronoi(Delaunay::default()),
            false => Near::Grid(Grid::default()),
        };
        Self { rules, positions: Vec::new(), listening: Vec::new(), listeners: 0, near }
    }

    /// Shows it a moment: where everybody is, and who listens.
    pub(super) fn look(&mut self, poses: &[Pose], listens: impl Fn(usize) -> bool) {
        self.positions.clear();
        self.positions.extend(poses.iter().map(|pose| pose.position));
        self.listening.clear();
        self.listening.extend((0..poses.len()).map(listens));
        self.listeners = self.listening.iter().filter(|&&listens| listens).count() as u64;
        match &mut self.near {
            Near::Voronoi(delaunay) => delaunay.follow(&self.positions, &self.listening),
            Near::Grid(grid) => {
                let [width, height] = self.rules.size_m;
                let look_m =
                    self.rules.interference_m.min(libm::hypot(width, height)) + self.rules.blocking_radius_m;
                grid.sort(&self.positions, self.rules.size_m, look_m);
            }
        }
    }

    /// Whether some packets may disturb others without being read: else [`Reached::disturbed`] is always empty.
    pub(super) fn disturbs_unread(&self) -> bool {
        self.rules.disturb_unread()
    }

    /// How many robots listen.
    pub(super) fn listeners(&self) -> u64 {
        self.listeners
    }

    /// Finds the robots that packet `number` of `sender` gets to, written over `reached`.
    pub(super) fn of(&self, sender: u32, number: u64, reached: &mut Reached) {
        let index = sender as usize;
        reached.clear();
        match &self.near {
            Near::Voronoi(delaunay) => {
                for &receiver in &delaunay.neighbors()[index] {
                    self.meet(sender, receiver, number, 1.0, reached);
                }
            }
            Near::Grid(grid) => {
                let here = self.positions[index];
                for receiver in grid.around(&here) {
                    reached.examined += 1;
                    if receiver != index && self.listening[receiver] {
                        let away = self.positions[receiver] - here;
                        let chance = self.rules.chance_over(away);
                        self.meet(sender, receiver, number, chance, reached);
                        if chance <= 0.0 && self.rules.disturbs_beyond_range() {
                            self.disturb_from_afar(sender, receiver, away, reached);
                        }
                    }
                }
                reached.robots.sort_unstable();
                reached.disturbed.sort_unstable();
            }
        }
    }

    /// Whether a packet with this chance to get as far as `receiver` gets there.
    fn meet(&self, sender: u32, receiver: usize, number: u64, chance: f64, reached: &mut Reached) {
        if chance <= 0.0 {
            return;
        }
        let fades = || {
            let mut draws = Draws::of(self.rules.seed, Purpose::SoftEdge, number, sender, receiver as u32);
            !draws.chance(chance)
        };
        let weak_disturb = self.rules.disturbs_beyond_range();
        if self.is_blocked(sender as usize, receiver) {
            reached.occluded += 1;
            // As it would if the body were not there.
            if self.rules.blocked_disturb && (weak_disturb || chance >= 1.0 || !fades()) {
                reached.disturbed.push(receiver as u32);
            }
        } else if chance < 1.0 && fades() {
            reached.faded += 1;
            if weak_disturb {
                reached.disturbed.push(receiver as u32);
            }
        } else {
            reached.robots.push(receiver as u32);
        }
    }

    /// A packet that is too weak to be read at `receiver`: does it still disturb there?
    fn disturb_from_afar(&self, sender: u32, receiver: usize, away: Vector2<f64>, reached: &mut Reached) {
        let is_near = libm::hypot(away.x, away.y) <= self.rules.interference_m;
        if is_near && (self.rules.blocked_disturb || !self.is_blocked(sender as usize, receiver)) {
            reached.disturbed.push(receiver as u32);
        }
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
        match &self.near {
            Near::Voronoi(_) => (0..self.positions.len()).any(blocks),
            Near::Grid(grid) => grid.around(&start).any(blocks),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rules(soft_edge_m: f64, blocking_radius_m: f64) -> Rules {
        Rules {
            is_voronoi: false,
            range_m: 1.0,
            soft_edge_m,
            interference_m: 1.0,
            blocked_disturb: false,
            blocking_radius_m,
            size_m: [3.0, 3.0],
            seed: 1,
        }
    }

    fn reached(rules: &Rules, spots: &[(f64, f64)], number: u64) -> Reached {
        let pose = |&(x, y)| Pose::unturned(ArenaPoint::new(x, y));
        let poses: Vec<_> = spots.iter().map(pose).collect();
        let mut reached = Reached::default();
        let mut reach = Reach::by(rules.clone());
        reach.look(&poses, |_| true);
        reach.of(0, number, &mut reached);
        reached
    }

    #[test]
    fn range_is_a_cutoff() {
        let reached = reached(&rules(0.0, 0.0), &[(0.5, 0.5), (1.5, 0.5), (1.6, 0.5), (0.5, 0.5)], 0);
        assert_eq!(reached.robots, [1, 3]);
    }

    #[test]
    fn looking_at_squares_first_changes_no_chance() {
        let spots =
            [0.0, 0.3, 0.79999999999, 0.8, 0.80000000001, 0.9, 1.0, 1.0 + 1e-16, 1.0000000001, 1.2, 1e200];
        for edge_m in [0.0, 0.2, 1.0] {
            let rules = rules(edge_m, 0.0);
            for (x, y) in spots.iter().flat_map(|&x| spots.map(|y| (x, y))) {
                let chance = rules.chance_over(Vector2::new(x, y));
                assert_eq!(chance, rules.chance_at(libm::hypot(x, y)), "({x}, {y}), edge {edge_m}");
            }
        }
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

    #[test]
    fn a_packet_too_weak_to_be_read_disturbs_up_to_the_interference_range() {
        let far = Rules { interference_m: 1.5, ..rules(0.0, 0.0) };
        let spots = [(0.5, 0.5), (1.5, 0.5), (1.6, 0.5), (2.0, 0.5), (2.1, 0.5), (2.9, 2.9)];
        let reached_far = reached(&far, &spots, 0);
        assert_eq!((reached_far.robots, reached_far.disturbed), (vec![1], vec![2, 3]));
        assert!(reached(&rules(0.0, 0.0), &spots, 0).disturbed.is_empty(), "not unless asked");
        // The last stretch of the range, where every packet either fades or is read.
        let edge = Rules { interference_m: 1.5, ..rules(1.0, 0.0) };
        let either: Vec<_> =
            (0..100).map(|number| reached(&edge, &[(0.5, 0.5), (1.2, 0.5)], number)).collect();
        assert!(either.iter().all(|reached| reached.robots.len() + reached.disturbed.len() == 1));
        assert!(either.iter().all(|reached| reached.disturbed.len() == reached.faded as usize));
        assert!(either.iter().any(|reached| reached.faded > 0), "some fade");
    }

    #[test]
    fn a_blocked_packet_disturbs_if_asked_as_if_the_body_were_not_there() {
        let spots = [(0.5, 0.5), (1.3, 0.5), (0.9, 0.59), (1.7, 0.5)];
        let silent = reached(&rules(0.0, 0.1), &spots, 0);
        assert_eq!((silent.robots, silent.disturbed), (vec![2], vec![]));
        let disturbs = |rules: Rules| reached(&Rules { blocked_disturb: true, ..rules }, &spots, 0).disturbed;
        assert_eq!(disturbs(rules(0.0, 0.1)), [1], "beyond the range it does not");
        assert_eq!(disturbs(Rules { interference_m: 1.5, ..rules(0.0, 0.1) }), [1, 3]);
        let hidden = Rules { interference_m: 1.5, ..rules(0.0, 0.1) };
        assert!(reached(&hidden, &spots, 0).disturbed.is_empty(), "a body stands in between");
    }
}
