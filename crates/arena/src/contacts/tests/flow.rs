//! A solver of another kind, to compare with: it finds velocities and not displacements, follows them by Runge-Kutta,
//! and halves its steps until halves agree with wholes.

use std::collections::BTreeMap;

use super::*;

/// Longest step.
const LONGEST_S: f64 = 8e-3;
/// A step is short enough if its halves end as near to where it ends.
const AGREED_M: f64 = 1e-9;
/// Shortest step that is halved.
const SHORTEST_S: f64 = 1e-6;
/// Bodies nearer than this touch.
const TOUCHING_M: f64 = 1e-9;
/// Sweeps end when no velocity changes by more.
const CONVERGED_M_PER_S: f64 = 1e-10;
const SWEEPS: u32 = 100_000;

/// Discs that go as they want, less what those that touch take from it: of all velocities that bring none nearer that
/// touch, the nearest to the wanted ones.
#[derive(Clone, Debug)]
pub(super) struct Flow {
    pub(super) discs: Discs,
    /// Pairs that touch, and bodies with the walls they touch, with their multipliers.
    touching: BTreeMap<(usize, usize), f64>,
}

impl Flow {
    pub(super) fn of(discs: &Discs) -> Self {
        Self { discs: discs.clone(), touching: BTreeMap::new() }
    }

    pub(super) fn play(&mut self, duration_s: f64) {
        let (mut now_s, mut step_s) = (0.0, LONGEST_S);
        while now_s < duration_s {
            self.find_touching();
            step_s = self.step(f64::min(step_s, duration_s - now_s), &mut now_s);
        }
    }

    /// Goes on by at most `step_s`, and returns how long the next step may be.
    fn step(&mut self, mut step_s: f64, now_s: &mut f64) -> f64 {
        let start = self.discs.positions.clone();
        let mut next_s = None;
        loop {
            let whole = self.moved(&start, step_s);
            let half = self.moved(&start, step_s / 2.0);
            let halves = self.moved(&half, step_s / 2.0);
            let off_m = farthest_m(&whole, &halves);
            if off_m > AGREED_M && step_s > SHORTEST_S {
                step_s /= 2.0;
                continue;
            }
            // Bodies that do not touch yet must not overlap: the step ends where they touch.
            if let Some(share) = self.share_until_touch(&start, &halves) {
                next_s = next_s.or(Some(step_s));
                step_s *= share;
                continue;
            }
            self.discs.positions = halves;
            *now_s += step_s;
            let grown = if off_m < AGREED_M / 32.0 { 2.0 } else { 1.0 };
            return next_s.unwrap_or(step_s * grown).clamp(SHORTEST_S, LONGEST_S);
        }
    }

    /// Where discs are after a Runge-Kutta step.
    fn moved(&mut self, start: &[ArenaPoint], step_s: f64) -> Vec<ArenaPoint> {
        let along = |rates: &[Vector2<f64>], share: f64| -> Vec<_> {
            start.iter().zip(rates).map(|(at, rate)| at + rate * (share * step_s)).collect()
        };
        let first = self.velocities(start);
        let second = self.velocities(&along(&first, 0.5));
        let third = self.velocities(&along(&second, 0.5));
        let fourth = self.velocities(&along(&third, 1.0));
        let rates: Vec<_> =
            (0..start.len()).map(|i| (first[i] + (second[i] + third[i]) * 2.0 + fourth[i]) / 6.0).collect();
        along(&rates, 1.0)
    }

    /// Velocities by Hildreth's method: contacts that touch are kept in turn until nothing changes.
    fn velocities(&mut self, positions: &[ArenaPoint]) -> Vec<Vector2<f64>> {
        let Self { discs, touching } = self;
        let mut velocities = discs.velocities.clone();
        let count = velocities.len();
        // Walls do not move.
        velocities.push(Vector2::zeros());
        let weight = |body: usize| f64::from(u8::from(body < count && discs.yields[body]));
        let mut contacts: Vec<_> = touching
            .iter_mut()
            .map(|(&(a, b), lambda)| {
                let normal = discs.toward(positions, (a, b)).normalize();
                let b = b.min(count);
                (a, b, weight(a), weight(b), normal, lambda)
            })
            .collect();
        for (a, b, weight_a, weight_b, normal, lambda) in &contacts {
            velocities[*a] -= normal * (**lambda * weight_a);
            velocities[*b] += normal * (**lambda * weight_b);
        }
        for _ in 0..SWEEPS {
            let mut largest = 0.0_f64;
            for (a, b, weight_a, weight_b, normal, lambda) in &mut contacts {
                let nearing = -normal.dot(&(velocities[*b] - velocities[*a]));
                let change = (nearing / (*weight_a + *weight_b)).max(-**lambda);
                **lambda += change;
                velocities[*a] -= *normal * (change * *weight_a);
                velocities[*b] += *normal * (change * *weight_b);
                largest = largest.max(change.abs());
            }
            if largest < CONVERGED_M_PER_S {
                break;
            }
        }
        velocities.truncate(count);
        velocities
    }

    fn find_touching(&mut self) {
        let Self { discs, touching } = self;
        let gap_m = |pair| discs.gap_m(&discs.positions, pair);
        let touches: BTreeMap<_, _> = discs
            .pairs()
            .filter(|&pair| gap_m(pair) <= TOUCHING_M)
            .map(|pair| (pair, touching.get(&pair).copied().unwrap_or(0.0)))
            .collect();
        *touching = touches;
    }

    /// The share of a step after which those first touch that do not yet, if they do.
    fn share_until_touch(&self, start: &[ArenaPoint], end: &[ArenaPoint]) -> Option<f64> {
        let share = |pair| {
            let (before_m, after_m) = (self.discs.gap_m(start, pair), self.discs.gap_m(end, pair));
            // To the middle of what counts as touching.
            (after_m < 0.0).then(|| (before_m - TOUCHING_M / 2.0) / (before_m - after_m))
        };
        let pairs = self.discs.pairs().filter(|pair| !self.touching.contains_key(pair));
        pairs.filter_map(share).reduce(f64::min)
    }
}

fn farthest_m(some: &[ArenaPoint], others: &[ArenaPoint]) -> f64 {
    some.iter().zip(others).map(|(one, other)| (one - other).norm()).fold(0.0, f64::max)
}
