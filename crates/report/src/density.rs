//! How many robots stand on a square meter, by their distance from a center.
//!
//! In:  positions of many trials, meters.
//! Out: robots per m² in rings, each ring's area cut to the arena (Fig. 4 and 9 of the paper).

use arena::{
    field::Field,
    frame::{ArenaPoint, Pose},
};
use scenario::Scenario;

use crate::{chart::Point, stats::Stats};

/// Points per side of the grid that an arena is sampled with: areas of rings are good to 0.2 %.
const SAMPLES: usize = 600;

/// Rings of which less than this share lies in the arena say nothing, m².
const AREA_MIN_M2: f64 = 1e-3;

/// Rings around a center.
#[derive(Clone, Debug)]
pub struct Rings {
    center: Point,
    width_m: f64,
    /// Area in the arena and mean √φ there, ring by ring.
    rings: Vec<(f64, f64)>,
}

/// Density of robots in one ring.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ring {
    /// Distance of its middle from the center, meters.
    pub distance_m: f64,
    /// Robots per m²: over the trials.
    pub density: Stats,
}

impl Rings {
    /// `count` rings of equal width, from the center to the arena's farthest corner.
    pub fn new(scenario: &Scenario, center: Point, count: usize) -> Self {
        let [width, height] = scenario.arena.size_m.get();
        let reach = |x: f64, y: f64| libm::hypot(x - center.0, y - center.1);
        let farthest =
            reach(0.0, 0.0).max(reach(width, 0.0)).max(reach(0.0, height)).max(reach(width, height));
        let width_m = farthest / count as f64;
        let field = Field::new(scenario);
        let mut rings = vec![(0.0, 0.0); count];
        let patch = width * height / (SAMPLES * SAMPLES) as f64;
        let middle = |index: usize, length: f64| (index as f64 + 0.5) / SAMPLES as f64 * length;
        for row in 0..SAMPLES {
            for column in 0..SAMPLES {
                let (x, y) = (middle(column, width), middle(row, height));
                let ring = &mut rings[((reach(x, y) / width_m) as usize).min(count - 1)];
                let seen = field.seen_from(&Pose::unturned(ArenaPoint::new(x, y)));
                ring.0 += patch;
                ring.1 += patch * Field::light(&seen, true).value.max(0.0).sqrt();
            }
        }
        for ring in &mut rings {
            ring.1 /= ring.0.max(f64::MIN_POSITIVE);
        }
        Self { center, width_m, rings }
    }

    /// Robots per m² in each ring; one slice of positions per trial.
    pub fn density(&self, trials: &[Vec<Point>]) -> Vec<Ring> {
        let counts: Vec<Vec<f64>> = trials.iter().map(|positions| self.counts(positions)).collect();
        self.worth_showing()
            .filter_map(|(ring, distance_m, area)| {
                let densities: Vec<f64> = counts.iter().map(|counts| counts[ring] / area).collect();
                Some(Ring { distance_m, density: Stats::of(&densities)? })
            })
            .collect()
    }

    /// √φ over the distance, scaled to `robots` robots in the arena: where the cost is lowest for very many
    /// robots, they stand like this.
    pub fn ideal(&self, robots: f64) -> Vec<Point> {
        let whole: f64 = self.rings.iter().map(|(area, root)| area * root).sum();
        self.worth_showing()
            .map(|(ring, distance_m, _)| (distance_m, robots * self.rings[ring].1 / whole))
            .collect()
    }

    /// The same as a line of steps, from ring to ring.
    pub fn as_steps(&self, points: &[Point]) -> Vec<Point> {
        let half = self.width_m / 2.0;
        let last = points.last().map(|&(x, y)| (x + half, y));
        points.iter().map(|&(x, y)| (x - half, y)).chain(last).collect()
    }

    fn counts(&self, positions: &[Point]) -> Vec<f64> {
        let mut counts = vec![0.0; self.rings.len()];
        for &(x, y) in positions {
            let distance = libm::hypot(x - self.center.0, y - self.center.1);
            counts[((distance / self.width_m) as usize).min(self.rings.len() - 1)] += 1.0;
        }
        counts
    }

    fn worth_showing(&self) -> impl Iterator<Item = (usize, f64, f64)> + '_ {
        let rings = self.rings.iter().enumerate();
        rings
            .filter(|(_, (area, _))| *area > AREA_MIN_M2)
            .map(|(ring, (area, _))| (ring, (ring as f64 + 0.5) * self.width_m, *area))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn scenario(field: &str) -> Scenario {
        let text = format!(
            "duration_s = 1\nstep_s = 0.1\narena.size_m = [1.0, 1.0]\nrobots.count = 3\n\
             controller.gain_per_s = 1\nchannel.range_m = 1\n{field}"
        );
        Scenario::parse("test", &text, &[]).unwrap()
    }

    #[test]
    fn a_ring_inside_the_arena_has_the_area_of_a_ring_and_one_at_a_wall_the_half_of_it() {
        let (scenario, ring) = (scenario("field.offset = 1"), |inner: f64, outer: f64| {
            std::f64::consts::PI * (outer * outer - inner * inner)
        });
        let middle = Rings::new(&scenario, (0.5, 0.5), 10);
        let width = middle.width_m;
        let exact = ring(2.0 * width, 3.0 * width);
        assert!((middle.rings[2].0 / exact - 1.0).abs() < 2e-3);
        let wall = Rings::new(&scenario, (0.5, 0.0), 10);
        let width = wall.width_m;
        let exact = ring(2.0 * width, 3.0 * width) / 2.0;
        assert!((wall.rings[2].0 / exact - 1.0).abs() < 2e-3);
    }

    #[test]
    fn robots_on_an_even_grid_are_as_dense_everywhere() {
        let rings = Rings::new(&scenario("field.offset = 1"), (0.2, 0.2), 8);
        let grid: Vec<Point> = (0..10_000)
            .map(|i| (f64::from(i % 100) / 100.0 + 0.005, f64::from(i / 100) / 100.0 + 0.005))
            .collect();
        for ring in rings.density(&[grid.clone(), grid]) {
            assert!((ring.density.mean / 1e4 - 1.0).abs() < 0.06, "{ring:?}");
            assert_eq!(ring.density.sd, 0.0);
        }
    }

    #[test]
    fn the_ideal_density_holds_all_robots_and_follows_the_root_of_the_field() {
        let peak = "field.gaussian = [{ center_m = [0.2, 0.2], sigma_m = 0.5 }]";
        let rings = Rings::new(&scenario(peak), (0.2, 0.2), 20);
        let ideal = rings.ideal(100.0);
        let total: f64 =
            ideal.iter().zip(rings.worth_showing()).map(|((_, rho), (.., area))| rho * area).sum();
        assert!((total - 100.0).abs() < 0.1, "{total}");
        // √φ of a Gaussian falls with exp(−r²/4σ²).
        let falls = libm::exp(-(ideal[8].0.powi(2) - ideal[2].0.powi(2)) / 1.0);
        assert!((ideal[8].1 / ideal[2].1 / falls - 1.0).abs() < 0.01);
    }
}
