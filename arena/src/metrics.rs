//! What an observer measures: errors, coverage cost, local against global cells.

use std::{iter::Sum, ops::Div};

use coverage::{
    moments::Moments,
    polygon::Polygon,
    quadrature::integrate,
    sensory_field::{length_scale, value},
};
use nalgebra::Vector2;
use protocol::command::Command;
use serde::{Deserialize, Serialize};

use crate::{
    field::Field,
    frame::{ArenaPoint, Pose},
    hearing::Hearing,
    packets::Packets,
    recovery::Disturbance,
    voronoi::{cell_in_arena, delaunay_neighbors},
};

/// A local and a global cell are the same if their areas agree to this share.
const SAME_CELL: f64 = 1e-9;

/// The state of a swarm as an observer sees it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Metrics {
    /// Mean ‖ê‖ over the robots alive, meters, as they estimate it.
    pub mean_error_m: f64,
    /// Largest ‖ê‖.
    pub max_error_m: f64,
    /// Mean ‖C − p‖ with the true centroid of the global cell.
    pub mean_true_error_m: f64,
    /// Coverage cost H (eq. 1 with f(x) = x²/2) of the robots alive.
    pub cost_h: f64,
    /// Share of robots alive that know those who shape their cell: cut to the arena, the cell made by
    /// the robots in their neighbor tables, where these truly are, is the global one.
    pub cell_agreement: f64,
    /// Connected components of the hearing graph: two robots alive are joined if either has the other
    /// in its neighbor table.
    pub hearing_components: usize,
    /// Mean age of an entry of the robots' neighbor tables, seconds.
    pub staleness_s: f64,
    /// Neighbors that did not fit into a table, which keeps the nearest.
    pub neighbors_over_bound: u64,
    /// Mean distance of robots alive to the middle of the lamps, if there are lamps.
    pub mean_lamp_distance_m: Option<f64>,
    /// Mean distance of robots alive to the nearest peak of a Gaussian, if there are Gaussians.
    pub mean_peak_distance_m: Option<f64>,
    /// Robots whose agent answered this tick.
    pub robots_alive: u32,
    /// Packets since the start.
    pub packets: Packets,
}

/// Mean and largest ‖ê‖ among the robots that answered; zero if none did.
pub fn estimated_errors(commands: &[Option<Command>]) -> (f64, f64) {
    let errors = commands.iter().flatten().map(|command| command.goal.length());
    let (count, sum, max) = errors
        .fold((0_u32, 0.0, 0.0_f64), |(count, sum, max), error| (count + 1, sum + error, max.max(error)));
    (if count > 0 { sum / f64::from(count) } else { 0.0 }, max)
}

/// What an observer has to know to measure a swarm.
#[derive(Clone, Copy, Debug)]
pub struct Observer<'a> {
    /// φ.
    pub field: &'a Field,
    /// Who knows of whom.
    pub hearing: &'a Hearing,
    /// Size of the arena.
    pub size_m: [f64; 2],
}

impl Observer<'_> {
    /// What a fault can be felt in: mean ‖ê‖ and, roughly, H. With nobody alive there is neither, and
    /// both are NaN, which no recovery takes for a value.
    pub fn disturbance(&self, poses: &[Pose], answers: &[Option<Command>]) -> Disturbance {
        if answers.iter().all(Option::is_none) {
            return [f64::NAN; 2];
        }
        let alive = poses.iter().zip(answers).filter(|(_, answer)| answer.is_some());
        let partition = Partition::new(alive.map(|(pose, _)| pose.position).collect(), self.size_m);
        [estimated_errors(answers).0, partition.rough_cost(self.field)]
    }

    /// The state of the robots that `answers` has commands of, `step_s` being the length of a tick.
    pub fn measure(
        &self,
        poses: &[Pose],
        answers: &[Option<Command>],
        packets: Packets,
        step_s: f64,
    ) -> Metrics {
        let alive: Vec<usize> = (0..answers.len()).filter(|&robot| answers[robot].is_some()).collect();
        let positions: Vec<ArenaPoint> = alive.iter().map(|&robot| poses[robot].position).collect();
        let lamps: Vec<ArenaPoint> = self.field.lamps().collect();
        let peaks: Vec<ArenaPoint> = self.field.peaks().collect();
        let partition = Partition::new(positions.clone(), self.size_m);
        let (cost_h, mean_true_error_m) = partition.cost_and_true_error(self.field);
        // A liar may have named a robot that is not there.
        let at = |robot: usize| poses.get(robot).map(|pose| pose.position);
        let known = alive.iter().map(|&robot| self.hearing.known_to(robot).filter_map(at));
        let (mean_error_m, max_error_m) = estimated_errors(answers);
        Metrics {
            mean_error_m,
            max_error_m,
            mean_true_error_m,
            cost_h,
            cell_agreement: partition.agreement(known, self.size_m),
            hearing_components: self.hearing.components(&alive),
            staleness_s: self.hearing.staleness_ticks(&alive) * step_s,
            neighbors_over_bound: self.hearing.over_bound(),
            mean_lamp_distance_m: mean_lamp_distance(&positions, &lamps),
            mean_peak_distance_m: mean_peak_distance(&positions, &peaks),
            robots_alive: alive.len() as u32,
            packets,
        }
    }
}

/// The global cells of some robots, relative to each in the arena's axes.
#[derive(Clone, Debug)]
pub struct Partition {
    sites: Vec<ArenaPoint>,
    cells: Vec<Polygon>,
}

impl Partition {
    /// The Voronoi partition of the arena by `sites`.
    pub fn new(sites: Vec<ArenaPoint>, size_m: [f64; 2]) -> Self {
        let neighbors = delaunay_neighbors(&sites);
        let cells = sites
            .iter()
            .zip(neighbors.iter())
            .map(|(&site, near)| cell_in_arena(site, near.iter().map(|&other| sites[other]), size_m))
            .collect();
        Self { sites, cells }
    }

    /// The cells, in the order of the sites.
    pub fn cells(&self) -> &[Polygon] {
        &self.cells
    }

    /// Coverage cost H = Σ ∫ ½‖q − p‖² φ(q) dq (eq. 1) and mean ‖C − p‖ with true centroids.
    /// Relative accuracy 1e-10, see [`coverage::quadrature`]. A cell without mass is at its goal.
    pub fn cost_and_true_error(&self, field: &Field) -> (f64, f64) {
        let (mut cost, mut error) = (0.0, 0.0);
        for [mass, x, y, inertia] in self.integrals(field, 0.5) {
            cost += inertia;
            error += if mass > 0.0 { Vector2::new(x, y).norm() / mass } else { 0.0 };
        }
        (cost, error / self.sites.len().max(1) as f64)
    }

    /// Coverage cost H to a percent, at a fraction of the price: enough to see it change.
    pub fn rough_cost(&self, field: &Field) -> f64 {
        self.integrals(field, 4.0).map(|[.., inertia]| inertia).sum()
    }

    /// Mass, first moments and half the second moment of φ over each cell, relative to its site;
    /// the quadrature's pieces are so many length scales of φ long.
    fn integrals(&self, field: &Field, resolution: f64) -> impl Iterator<Item = [f64; 4]> {
        self.sites.iter().zip(&self.cells).map(move |(&site, cell)| {
            let seen = field.seen_from(&Pose::unturned(site));
            integrate(cell, length_scale(&seen) * resolution, |q| {
                let phi = value(&seen, q);
                [phi, phi * q.x, phi * q.y, phi * q.norm_squared() / 2.0]
            })
        })
    }

    /// Share of sites whose cell among those they `know` equals the global one.
    pub fn agreement<K: Iterator<Item = ArenaPoint>>(
        &self,
        known: impl Iterator<Item = K>,
        size_m: [f64; 2],
    ) -> f64 {
        let agree = known
            .zip(&self.sites)
            .zip(&self.cells)
            .map(|((known, &site), global)| (cell_in_arena(site, known, size_m), area(global)))
            .filter(|(local, global)| (area(local) - global).abs() <= SAME_CELL * global)
            .count();
        agree as f64 / self.sites.len().max(1) as f64
    }
}

/// Mean distance of `positions` to the middle of `lamps`; `None` without lamps or robots.
pub fn mean_lamp_distance(positions: &[ArenaPoint], lamps: &[ArenaPoint]) -> Option<f64> {
    let middle = mean(lamps.iter().copied())?;
    mean(positions.iter().map(|position| (position - middle).norm()))
}

/// Mean distance of `positions` to the nearest of `peaks` each; `None` without peaks or robots.
pub fn mean_peak_distance(positions: &[ArenaPoint], peaks: &[ArenaPoint]) -> Option<f64> {
    let nearest = |position: &ArenaPoint| peaks.iter().map(|peak| (position - peak).norm()).reduce(f64::min);
    mean(positions.iter().map(nearest).collect::<Option<Vec<_>>>()?.into_iter())
}

/// Mean of some values; `None` of none.
fn mean<T: Sum + Div<f64, Output = T>>(values: impl ExactSizeIterator<Item = T>) -> Option<T> {
    let count = values.len();
    (count > 0).then(|| values.sum::<T>() / count as f64)
}

fn area(cell: &Polygon) -> f64 {
    cell.first().map_or(0.0, |&about| Moments::of(cell, about).area)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{placement, scenario::Scenario};

    #[test]
    fn a_rough_cost_is_good_to_a_percent_from_a_few_robots_on() {
        for robots in [10, 50, 200] {
            let text = format!(
                "duration_s = 1\nstep_s = 0.1\narena.size_m = [2.4, 2.4]\nrobots.count = {robots}\n\
                 controller.gain_per_s = 1\nchannel.range_m = 1\n\
                 field.lamp = [{{ position_m = [1.2, 0], peak = 500, half_distance_m = 0.5 }}]"
            );
            let scenario = Scenario::parse("test", &text, &[]).unwrap();
            let sites = placement::start(&scenario).unwrap().into_iter().map(|pose| pose.position);
            let (partition, field) =
                (Partition::new(sites.collect(), scenario.arena.size_m.get()), Field::new(&scenario));
            let (rough, exact) = (partition.rough_cost(&field), partition.cost_and_true_error(&field).0);
            assert!((rough / exact - 1.0).abs() < 0.01, "{robots} robots: {rough}, not {exact}");
        }
    }
}
