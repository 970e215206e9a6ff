use std::{
    num::NonZeroUsize,
    sync::{
        Mutex,
        atomic::{AtomicU64, Ordering::Relaxed},
    },
};

use rand_chacha::{
    ChaCha8Rng,
    rand_core::{Rng, SeedableRng},
};

use super::*;

mod flow;

use flow::Flow;

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

    /// Moves them, and holds every tick to what it promises. Returns how often a body stood still that wanted to move.
    fn play(&mut self, step_s: f64, ticks: u32) -> u64 {
        let mut contacts = Contacts::new(self.radius_m, self.size_m);
        let displacements: Vec<_> = self.velocities.iter().map(|velocity| velocity * step_s).collect();
        let mut touched = vec![false; self.positions.len()];
        let mut still = 0;
        for tick in 0..ticks {
            let before = self.positions.clone();
            let wanted = Wanted { displacements: &displacements, yields: &self.yields };
            contacts.advance(&mut self.positions, wanted, &mut touched);
            assert!(self.overlap_m() <= 2.0 * self.radius_m * TOUCH, "tick {tick}: {:e}", self.overlap_m());
            for body in (0..before.len()).filter(|&body| self.yields[body]) {
                let (moved_m, wanted_m) =
                    ((self.positions[body] - before[body]).norm(), displacements[body].norm());
                if wanted_m > 0.0 && moved_m < 1e-3 * wanted_m {
                    still += 1;
                    let free_m = self.free_way(&before, body, displacements[body]).norm();
                    assert!(
                        free_m < 1e-2 * wanted_m,
                        "tick {tick}: body {body} stands still, but has a way to go"
                    );
                }
            }
        }
        assert_eq!(contacts.unsolved(), 0);
        still
    }

    /// How far a body could go of the way it wants, if those that touch it before or after a tick stood still: the
    /// nearest way to the wanted one that brings it nearer to none of them.
    fn free_way(&self, before: &[ArenaPoint], body: usize, wanted: Vector2<f64>) -> Vector2<f64> {
        const TOUCHES_M: f64 = 1e-6;
        let touching = self.pairs().filter(|&(a, b)| {
            let gap_m = self.gap_m(before, (a, b)).min(self.gap_m(&self.positions, (a, b)));
            (a == body || b == body) && gap_m < TOUCHES_M
        });
        let normals: Vec<_> = touching
            .map(|(a, b)| self.toward(&self.positions, (a, b)) * if a == body { 1.0 } else { -1.0 })
            .map(|toward| toward.normalize())
            .collect();
        let is_free = |way: &Vector2<f64>| normals.iter().all(|normal| normal.dot(way) <= 1e-9 * way.norm());
        let along = normals.iter().map(|normal| wanted - normal * normal.dot(&wanted));
        let ways = std::iter::once(wanted).chain(along).filter(is_free);
        ways.max_by(|one, other| one.norm().total_cmp(&other.norm())).unwrap_or_default()
    }

    /// Pairs that may push each other, and after the last body the four walls.
    fn pairs(&self) -> impl Iterator<Item = (usize, usize)> {
        let count = self.positions.len();
        let others = move |a: usize| (a + 1..count + 4).map(move |b| (a, b));
        (0..count).flat_map(others).filter(move |&(a, b)| self.yields[a] || (b < count && self.yields[b]))
    }

    /// From a body to another, or the direction to a wall.
    fn toward(&self, positions: &[ArenaPoint], (a, b): (usize, usize)) -> Vector2<f64> {
        match b.checked_sub(positions.len()) {
            None => positions[b] - positions[a],
            Some(wall) => [-Vector2::x(), Vector2::x(), -Vector2::y(), Vector2::y()][wall],
        }
    }

    /// How far apart a pair is.
    fn gap_m(&self, positions: &[ArenaPoint], (a, b): (usize, usize)) -> f64 {
        let ([width, height], at) = (self.size_m, positions[a]);
        match b.checked_sub(positions.len()) {
            None => (positions[b] - at).norm() - 2.0 * self.radius_m,
            Some(wall) => [at.x, width - at.x, at.y, height - at.y][wall] - self.radius_m,
        }
    }

    /// The deepest overlap of two bodies, or of a body and a wall.
    fn overlap_m(&self) -> f64 {
        let bodies = self.positions.iter().enumerate().flat_map(|(b, to)| {
            self.positions[..b].iter().map(move |from| 2.0 * self.radius_m - (to - from).norm())
        });
        let walls = self.positions.iter().map(|&at| (inside(at, self.size_m, self.radius_m) - at).norm());
        bodies.chain(walls).fold(0.0, f64::max)
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

#[test]
fn two_hundred_random_scenes_end_where_another_solver_has_them_and_nobody_stands_still_without_need() {
    const SCENES: u64 = 200;
    let next = AtomicU64::new(0);
    let outcomes = Mutex::new(Vec::new());
    std::thread::scope(|scope| {
        for _ in 0..std::thread::available_parallelism().map_or(1, NonZeroUsize::get) {
            scope.spawn(|| {
                while let Some(seed) = Some(next.fetch_add(1, Relaxed)).filter(|&seed| seed < SCENES) {
                    let mut ours = Discs::random(seed, 40);
                    let mut reference = Flow::of(&ours);
                    let still = ours.play(0.1, 100);
                    reference.play(10.0);
                    let ends = ours.positions.iter().zip(&reference.discs.positions);
                    let off_m = ends.map(|(ours, reference)| (ours - reference).norm()).fold(0.0, f64::max);
                    outcomes.lock().unwrap().push((off_m, seed, still));
                }
            });
        }
    });
    let mut outcomes = outcomes.into_inner().unwrap();
    outcomes.sort_by(|one, other| one.0.total_cmp(&other.0));
    let still: u64 = outcomes.iter().map(|outcome| outcome.2).sum();
    let (worst_m, seed, _) = outcomes[outcomes.len() - 1];
    println!(
        "median {:e} m off, at most {worst_m:e} m (seed {seed}); {still} bodies at a standstill in a tick",
        outcomes[outcomes.len() / 2].0
    );
    assert!(worst_m < 1e-3, "seed {seed}: {worst_m:e} m");
    assert!(still > 1000, "{still}");
}

#[test]
fn a_jam_takes_a_bounded_time_and_still_moves() {
    // Twenty rows as dense as discs can be, all of whom want to go elsewhere.
    let (mut positions, mut velocities) = (Vec::new(), Vec::new());
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let mut any = || f64::from(rng.next_u32()) / f64::from(u32::MAX) - 0.5;
    for body in 0..400 {
        let (row, place) = (f64::from(body / 20), f64::from(body % 20));
        let aside = if body / 20 % 2 == 0 { 0.0 } else { 0.5 };
        positions.push([0.1 + 0.20002 * (place + aside), 0.1 + 0.20002 * libm::sqrt(0.75) * row]);
        velocities.push([any(), any()]);
    }
    let mut discs = Discs { size_m: [4.11, 3.51], ..Discs::new(&positions, &velocities) };
    let mut contacts = Contacts::new(discs.radius_m, discs.size_m);
    let displacements: Vec<_> = discs.velocities.iter().map(|velocity| velocity * 0.1).collect();
    let mut touched = vec![false; 400];
    let before = discs.positions.clone();
    let wanted = Wanted { displacements: &displacements, yields: &discs.yields };
    contacts.advance(&mut discs.positions, wanted, &mut touched);
    let corrections = contacts.solver.corrections;
    assert!(corrections > CORRECTIONS_MAX, "{corrections} corrections are no jam");
    assert!(corrections < 4 * CORRECTIONS_MAX, "{corrections} corrections");
    assert!(discs.overlap_m() <= 0.2 * TOUCH, "{:e}", discs.overlap_m());
    assert_eq!((contacts.coarse(), contacts.unsolved()), (1, 0));
    let moved = discs.positions.iter().zip(&before).filter(|(now, before)| now != before).count();
    assert!(moved > 300, "{moved} of 400 have moved");
}

#[test]
fn a_tick_is_cut_into_steps_of_a_400th_of_a_body_but_into_no_more_than_256() {
    assert_eq!([0.0, 0.0005, 0.00051, 0.1].map(|longest_m| steps(longest_m, 0.2)), [1, 1, 2, 200]);
    // Two bodies that touch; a longer way is cut no finer, and counted.
    for (way_m, coarse) in [(0.127, 0), (0.129, 1)] {
        let mut contacts = Contacts::new(0.1, [2.0, 2.0]);
        let mut positions = [ArenaPoint::new(0.5, 1.0), ArenaPoint::new(0.7, 1.0)];
        let wanted =
            Wanted { displacements: &[Vector2::new(way_m, 0.0), Vector2::zeros()], yields: &[true; 2] };
        contacts.advance(&mut positions, wanted, &mut [false; 2]);
        assert_eq!(contacts.coarse(), coarse, "{way_m} m");
    }
    assert_eq!(STEPS_MAX, 256);
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
