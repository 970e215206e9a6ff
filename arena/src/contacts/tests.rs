use rand_chacha::{
    ChaCha8Rng,
    rand_core::{Rng, SeedableRng},
};

use super::*;

/// Discs with constant velocities in an arena.
#[derive(Clone, Debug)]
struct Discs {
    radius_m: f64,
    size_m: [f64; 2],
    positions: Vec<ArenaPoint>,
    velocities: Vec<Vector2<f64>>,
    yields: Vec<bool>,
}

impl Discs {
    fn new(positions: &[[f64; 2]], velocities: &[[f64; 2]]) -> Self {
        Self {
            radius_m: 0.1,
            size_m: [2.0, 2.0],
            positions: positions.iter().map(|&[x, y]| ArenaPoint::new(x, y)).collect(),
            velocities: velocities.iter().map(|&[x, y]| Vector2::new(x, y)).collect(),
            yields: vec![true; positions.len()],
        }
    }

    /// Moves them, and holds every tick to what it promises.
    fn play(&mut self, step_s: f64, ticks: u32) -> Contacts {
        let mut contacts = Contacts::new(self.radius_m, self.size_m);
        let displacements: Vec<_> = self.velocities.iter().map(|velocity| velocity * step_s).collect();
        let mut touched = vec![false; self.positions.len()];
        for tick in 0..ticks {
            let wanted = Wanted { displacements: &displacements, yields: &self.yields };
            contacts.advance(&mut self.positions, wanted, &mut touched);
            assert!(self.overlap_m() <= 2.0 * self.radius_m * TOUCH, "tick {tick}: {:e}", self.overlap_m());
        }
        assert_eq!(contacts.unsolved(), 0);
        contacts
    }

    /// The deepest overlap of two bodies, or of a body and a wall.
    fn overlap_m(&self) -> f64 {
        let bodies = self.positions.iter().enumerate().flat_map(|(b, to)| {
            self.positions[..b].iter().map(move |from| 2.0 * self.radius_m - (to - from).norm())
        });
        let walls = self.positions.iter().map(|&at| (inside(at, self.size_m, self.radius_m) - at).norm());
        bodies.chain(walls).fold(0.0, f64::max)
    }

    /// A solver of another kind: steps of half a millisecond, in each of which pairs are parted one by one along
    /// the line between them, as Hildreth's method has it, until nobody moves.
    fn play_in_small_steps(&mut self, duration_s: f64) {
        const STEP_S: f64 = 0.5e-3;
        let count = self.positions.len();
        let mut known = std::collections::BTreeMap::new();
        for _ in 0..(duration_s / STEP_S).round() as u32 {
            let start = self.positions.clone();
            let mut contacts = Vec::new();
            for b in 0..count {
                for a in 0..b {
                    let apart = start[b] - start[a];
                    if apart.norm() < 2.0 * self.radius_m + 0.01 && (self.yields[a] || self.yields[b]) {
                        contacts.push((a, b, apart.normalize(), 2.0 * self.radius_m - apart.norm()));
                    }
                }
            }
            let mut deltas: Vec<_> = self.velocities.iter().map(|velocity| velocity * STEP_S).collect();
            let weight = |body: usize| if self.yields[body] { 1.0 } else { 0.0 };
            let mut lambdas: Vec<f64> =
                contacts.iter().map(|&(a, b, ..)| known.get(&(a, b)).copied().unwrap_or(0.0)).collect();
            for (&(a, b, normal, _), lambda) in contacts.iter().zip(&lambdas) {
                deltas[a] -= normal * (lambda * weight(a));
                deltas[b] += normal * (lambda * weight(b));
            }
            let [width, height] = self.size_m;
            // [low, high] for x and y of each body.
            let mut walls = vec![[[0.0_f64; 2]; 2]; count];
            for _ in 0..100_000 {
                let mut largest = 0.0_f64;
                for (&(a, b, normal, bound), lambda) in contacts.iter().zip(&mut lambdas) {
                    let missing = bound - normal.dot(&(deltas[b] - deltas[a]));
                    let change = (missing / (weight(a) + weight(b))).max(-*lambda);
                    *lambda += change;
                    deltas[a] -= normal * (change * weight(a));
                    deltas[b] += normal * (change * weight(b));
                    largest = largest.max(change.abs());
                }
                for body in (0..count).filter(|&body| self.yields[body]) {
                    for (axis, side_m) in [width, height].into_iter().enumerate() {
                        for (side, sign) in [1.0, -1.0].into_iter().enumerate() {
                            let at = start[body][axis] + deltas[body][axis];
                            let bound = if side == 0 { self.radius_m } else { side_m - self.radius_m };
                            let change = ((bound - at) * sign).max(-walls[body][axis][side]);
                            walls[body][axis][side] += change;
                            deltas[body][axis] += sign * change;
                            largest = largest.max(change.abs());
                        }
                    }
                }
                if largest < 1e-9 {
                    break;
                }
            }
            known = contacts.iter().zip(&lambdas).map(|(&(a, b, ..), &lambda)| ((a, b), lambda)).collect();
            for (position, delta) in self.positions.iter_mut().zip(deltas) {
                *position += delta;
            }
        }
    }

    /// A random scene: 2 to `most` discs, one in ten of them does not yield, and none is faster than 0.3 m/s.
    fn random(seed: u64, most: usize) -> Self {
        let mut draws = ChaCha8Rng::seed_from_u64(seed);
        let mut unit = || (draws.next_u64() >> 11) as f64 * (1.0 / (1_u64 << 53) as f64);
        let count = 2 + (unit() * (most - 1) as f64) as usize;
        let mut discs = Self::new(&[], &[]);
        while discs.positions.len() < count {
            let at = ArenaPoint::new(0.1 + 1.8 * unit(), 0.1 + 1.8 * unit());
            if discs.positions.iter().all(|other| (other - at).norm() > 0.2) {
                let (speed, angle) = (0.3 * unit(), std::f64::consts::TAU * unit());
                let yields = unit() > 0.1;
                let (sin, cos) = libm::sincos(angle);
                let velocity = Vector2::new(cos, sin) * speed;
                discs.positions.push(at);
                discs.velocities.push(if yields { velocity } else { Vector2::zeros() });
                discs.yields.push(yields);
            }
        }
        discs
    }
}

/// Farthest that a body ends from where the other solver has it.
fn off_m(seed: u64, most: usize) -> f64 {
    let mut ours = Discs::random(seed, most);
    let mut reference = ours.clone();
    ours.play(0.1, 100);
    reference.play_in_small_steps(10.0);
    let ends = ours.positions.iter().zip(&reference.positions);
    ends.map(|(ours, reference)| (ours - reference).norm()).fold(0.0, f64::max)
}

/// Larger crowds have places where a body goes left or right by a hair's breadth: they are for the median.
#[test]
fn random_scenes_end_where_small_steps_of_another_solver_end() {
    let worst_m = (0..40).map(|seed| off_m(seed, 8)).fold(0.0, f64::max);
    let mut crowds_m: Vec<f64> = (100..121).map(|seed| off_m(seed, 40)).collect();
    crowds_m.sort_by(f64::total_cmp);
    println!(
        "up to 8 discs: at most {worst_m:e} m off; up to 40 discs: median {:e} m, all {crowds_m:?}",
        crowds_m[10]
    );
    assert!(worst_m < 2e-4, "{worst_m}");
    assert!(crowds_m[10] < 1e-3, "{}", crowds_m[10]);
}

#[test]
fn a_tick_is_cut_into_steps_of_a_fiftieth_of_a_body_but_into_no_more_than_64() {
    assert_eq!([0.0, 0.003, 0.004, 0.0041].map(|longest_m| steps(longest_m, 0.2)), [1, 1, 1, 2]);
    assert_eq!([0.1, 0.256, 0.2561, 1e6].map(|longest_m| steps(longest_m, 0.2)), [25, 64, 64, 64]);
}

#[test]
fn a_body_at_a_wall_is_pushed_aside() {
    for step_s in [0.01, 0.1, 0.5] {
        let mut discs = Discs::new(&[[1.9, 1.0], [1.2, 1.05]], &[[0.0, 0.0], [0.2, 0.0]]);
        discs.play(step_s, (20.0 / step_s) as u32);
        let ends = [ArenaPoint::new(1.9, 0.925), ArenaPoint::new(1.9, 1.125)];
        for (at, end) in discs.positions.iter().zip(ends) {
            assert!((at - end).norm() < 1e-3, "{at}, not {end}");
        }
    }
}

#[test]
fn a_row_that_is_pushed_moves_as_one() {
    for pushed in [1_u32, 2, 3, 5] {
        let row: Vec<_> = (0..=pushed).map(|place| [0.2 + 0.2 * f64::from(place), 1.0]).collect();
        let mut velocities = vec![[0.0, 0.0]; row.len()];
        velocities[0] = [0.2, 0.0];
        let mut discs = Discs::new(&row, &velocities);
        discs.play(0.1, 10);
        let speed = discs.positions[0].x - 0.2;
        assert!((speed - 0.2 / f64::from(pushed + 1)).abs() < 1e-9, "{pushed} bodies: {speed} m/s");
    }
}

#[test]
fn bodies_that_do_not_yield_stay_and_the_living_slide_past() {
    let mut discs = Discs::new(&[[1.0, 1.0], [0.5, 1.02]], &[[0.0, 0.0], [0.2, 0.0]]);
    discs.yields[0] = false;
    discs.play(0.1, 100);
    assert_eq!(discs.positions[0], ArenaPoint::new(1.0, 1.0));
    assert!(discs.positions[1].x > 1.3, "{}", discs.positions[1]);
}

#[test]
fn bodies_do_not_change_places_in_one_tick() {
    let mut discs = Discs::new(&[[0.6, 1.0], [1.4, 1.0]], &[[0.45, 0.0], [-0.45, 0.0]]);
    discs.radius_m = 0.05;
    discs.play(2.0, 1);
    assert!((discs.positions[0].x - 0.95).abs() < 1e-9 && (discs.positions[1].x - 1.05).abs() < 1e-9);
    let mut fast = Discs::new(&[[0.2, 1.0], [1.0, 1.0]], &[[1e6, 0.0], [0.0, 0.0]]);
    fast.radius_m = 1e-3;
    fast.play(1.0, 1);
    assert!(fast.positions[0].x < fast.positions[1].x);
}

#[test]
fn a_row_that_fills_the_arena_is_driven_against_the_wall_without_gaps() {
    let row: Vec<_> = (0..8).map(|place| [0.15 + 0.22 * f64::from(place), 1.0]).collect();
    let mut discs = Discs::new(&row, &[[0.1, 0.0]; 8]);
    discs.play(0.1, 200);
    for (place, at) in discs.positions.iter().enumerate() {
        assert!((at.x - (0.5 + 0.2 * place as f64)).abs() < 1e-8, "{at}");
    }
}
