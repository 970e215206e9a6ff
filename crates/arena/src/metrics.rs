//! Metrics of a swarm: errors, coverage cost, local against global cells.

use std::{iter::Sum, ops::Div};

use coverage::{
    moments::Moments,
    polygon::Polygon,
    quadrature,
    refinement::{FINE, ROUGH},
};
use nalgebra::Vector2;
use protocol::command::Answer;
use serde::{Deserialize, Serialize};

use crate::{
    field::Field,
    frame::{ArenaPoint, Pose},
    neighbor_tables::NeighborTables,
    packets::Packets,
    voronoi::{cell_in_arena, delaunay_neighbors},
};

/// A local and a global cell are the same if their areas agree to this share.
const SAME_CELL: f64 = 1e-9;

/// Mean ‖ê‖ and H, which a fault can be felt in; `None` where nobody is left who has one.
pub type Disturbance = [Option<f64>; 2];

/// The state of a swarm as an observer sees it.
///
/// The robots that take part are those whose agent answered this tick: neither killed, nor paused, nor silent. What
/// is not known has no value: a mean over nobody is `None`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Metrics {
    /// Mean ‖ê‖ over the robots that estimate one, meters.
    pub mean_error_m: Option<f64>,
    /// Largest ‖ê‖ among them.
    pub max_error_m: Option<f64>,
    /// Robots that take part and estimate no error: they have no cell, or none with mass.
    pub robots_without_error: u32,
    /// Robots whose estimated error is longer than the arena's diagonal: their cells are open, or so nearly that
    /// their goals lie far outside.
    pub robots_with_open_cell: u32,
    /// Mean ‖C − p‖ with the true centroid of the global cell, over the robots whose cell has mass.
    pub mean_true_error_m: Option<f64>,
    /// Robots that take part and whose global cell has no mass, so that it has no centroid.
    pub robots_without_mass: u32,
    /// Coverage cost H (eq. 1 with f(x) = x²/2) of the robots that take part.
    pub cost_h: Option<f64>,
    /// Share of robots that know those who shape their cell: cut to the arena, the cell made by the robots in their
    /// neighbor tables, where these truly are, is the global one.
    pub cell_agreement: Option<f64>,
    /// Connected components of the hearing graph: two robots are joined if either has the other in its neighbor
    /// table.
    pub hearing_components: usize,
    /// Mean age of an entry of the robots' neighbor tables since its packet was sent, virtual time in seconds.
    pub staleness_s: Option<f64>,
    /// Neighbors that did not fit into a table, which keeps the nearest.
    pub neighbors_over_bound: u64,
    /// Mean distance of robots to the middle of the lamps, if there are lamps.
    pub mean_lamp_distance_m: Option<f64>,
    /// Mean distance of robots to the nearest peak of a Gaussian, if there are Gaussians.
    pub mean_peak_distance_m: Option<f64>,
    /// Robots whose agent is there: it has joined, and is neither killed nor left out.
    pub robots_alive: u32,
    /// Robots among them that the plan has paused.
    pub robots_paused: u32,
    /// Robots among them that do not take part, though the plan lets them: their last command was refused or, in real
    /// time, none has come for a while.
    pub robots_silent: u32,
    /// Packets since the start.
    pub packets: Packets,
}

/// How many agents are there, answers or none: that is not for the arena to know.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Attendance {
    /// Robots whose agent is there.
    pub alive: u32,
    /// Robots among them that the plan has paused.
    pub paused: u32,
}

/// The estimated errors ‖ê‖ of the robots that answered, in meters.
///
/// A robot that estimates none is left out: where it should be is not known, so it is not there.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct EstimatedErrors {
    /// Their mean; `None` if there are none.
    pub mean_m: Option<f64>,
    /// The largest.
    pub max_m: Option<f64>,
    /// Robots that answered without one.
    pub without: u32,
}

impl EstimatedErrors {
    /// The estimated errors in `answers`.
    pub fn of(answers: &[Option<Answer>]) -> Self {
        let (mut count, mut sum, mut max, mut without) = (0_u32, 0.0, 0.0_f64, 0);
        for answer in answers.iter().flatten() {
            match answer.command.estimated_error {
                Some(error) => (count, sum, max) = (count + 1, sum + error.length(), max.max(error.length())),
                None => without += 1,
            }
        }
        let known = count > 0;
        Self { mean_m: known.then(|| sum / f64::from(count)), max_m: known.then_some(max), without }
    }

    /// Whether every robot that answered has one, and somebody has: only then they say something of the whole swarm.
    pub fn are_of_everyone(&self) -> bool {
        self.mean_m.is_some() && self.without == 0
    }
}

/// Measures a swarm, with knowledge that only an observer has.
#[derive(Clone, Copy, Debug)]
pub struct Observer<'a> {
    /// φ.
    pub field: &'a Field,
    /// Neighbor tables of all robots.
    pub hearing: &'a NeighborTables,
    /// Size of the arena.
    pub size_m: [f64; 2],
}

impl Observer<'_> {
    /// Mean ‖ê‖ and, roughly, H: what a fault can be felt in.
    pub fn disturbance(&self, poses: &[Pose], answers: &[Option<Answer>]) -> Disturbance {
        let present = poses.iter().zip(answers).filter(|(_, answer)| answer.is_some());
        let partition = Partition::new(present.map(|(pose, _)| pose.position).collect(), self.size_m);
        [EstimatedErrors::of(answers).mean_m, partition.rough_cost(self.field)]
    }

    /// The state of the robots that `answers` has commands of, at `time_s` of virtual time.
    pub fn measure(
        &self,
        poses: &[Pose],
        answers: &[Option<Answer>],
        Attendance { alive, paused }: Attendance,
        packets: Packets,
        time_s: f64,
    ) -> Metrics {
        let present: Vec<usize> = (0..answers.len()).filter(|&robot| answers[robot].is_some()).collect();
        let positions: Vec<ArenaPoint> = present.iter().map(|&robot| poses[robot].position).collect();
        let lamps: Vec<ArenaPoint> = self.field.lamps().collect();
        let peaks: Vec<ArenaPoint> = self.field.peaks().collect();
        let partition = Partition::new(positions.clone(), self.size_m);
        let Cost { cost_h, mean_true_error_m, without_mass } = partition.cost(self.field);
        // A liar may have named a robot that is not there.
        let at = |robot: usize| poses.get(robot).map(|pose| pose.position);
        let known = present.iter().map(|&robot| self.hearing.known_to(robot).filter_map(at));
        let errors = EstimatedErrors::of(answers);
        let diagonal_m = Vector2::from(self.size_m).norm();
        let is_open = |answer: &&Answer| {
            answer.command.estimated_error.is_some_and(|error| error.length() > diagonal_m)
        };
        Metrics {
            mean_error_m: errors.mean_m,
            max_error_m: errors.max_m,
            robots_without_error: errors.without,
            robots_with_open_cell: answers.iter().flatten().filter(is_open).count() as u32,
            mean_true_error_m,
            robots_without_mass: without_mass,
            cost_h,
            cell_agreement: partition.agreement(known, self.size_m),
            hearing_components: self.hearing.components(&present),
            staleness_s: self.hearing.staleness_s(&present, time_s),
            neighbors_over_bound: self.hearing.over_bound(),
            mean_lamp_distance_m: mean_lamp_distance(&positions, &lamps),
            mean_peak_distance_m: mean_peak_distance(&positions, &peaks),
            robots_alive: alive,
            robots_paused: paused,
            robots_silent: alive.saturating_sub(paused + present.len() as u32),
            packets,
        }
    }
}

/// Cost of a partition, and how far its sites are from where it would cost least.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cost {
    /// Coverage cost H = Σ ∫ ½‖q − p‖² φ(q) dq (eq. 1); `None` without any site.
    pub cost_h: Option<f64>,
    /// Mean ‖C − p‖ with true centroids, meters, over the sites whose cell has mass; `None` if no cell has.
    pub mean_true_error_m: Option<f64>,
    /// Cells without mass, which have no centroid.
    pub without_mass: u32,
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

    /// The cost of the partition under `field`. Relative accuracy 1e-8, see [`coverage::quadrature`].
    pub fn cost(&self, field: &Field) -> Cost {
        let (mut cost, mut error, mut with_mass) = (0.0, 0.0, 0);
        for [mass, x, y, inertia] in self.integrals(field, FINE) {
            cost += inertia;
            if mass > 0.0 {
                error += Vector2::new(x, y).norm() / mass;
                with_mass += 1;
            }
        }
        Cost {
            cost_h: self.if_any(cost),
            mean_true_error_m: (with_mass > 0).then(|| error / f64::from(with_mass)),
            without_mass: self.sites.len() as u32 - with_mass,
        }
    }

    /// Coverage cost H to a percent, at a fraction of the price: enough to see it change. `None` without any site.
    pub fn rough_cost(&self, field: &Field) -> Option<f64> {
        self.if_any(self.integrals(field, ROUGH).map(|[.., inertia]| inertia).sum())
    }

    /// `value`, unless nobody is left whose it could be.
    fn if_any(&self, value: f64) -> Option<f64> {
        (!self.sites.is_empty()).then_some(value)
    }

    /// Mass, first moments and half the second moment of φ over each cell, relative to its site; the quadrature's
    /// pieces are `coarseness` times as long as where they are [`FINE`].
    fn integrals(&self, field: &Field, coarseness: f64) -> impl Iterator<Item = [f64; 4]> {
        self.sites.iter().zip(&self.cells).map(move |(&site, cell)| {
            quadrature::moments(&field.seen_from(&Pose::unturned(site)), cell, coarseness)
        })
    }

    /// Share of sites whose cell among those they `know` equals the global one; `None` without any site.
    pub fn agreement<K: Iterator<Item = ArenaPoint>>(
        &self,
        known: impl Iterator<Item = K>,
        size_m: [f64; 2],
    ) -> Option<f64> {
        let agree = known
            .zip(&self.sites)
            .zip(&self.cells)
            .map(|((known, &site), global)| (cell_in_arena(site, known, size_m), area(global)))
            .filter(|(local, global)| (area(local) - global).abs() <= SAME_CELL * global)
            .count();
        self.if_any(agree as f64 / self.sites.len() as f64)
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
    use protocol::{
        command::{Command, Transmitter},
        frame::BodyVector,
        robot_id::RobotId,
    };

    use super::*;
    use crate::placement;
    use scenario::Scenario;

    fn answer(error_m: Option<f64>) -> Option<Answer> {
        let estimated_error = error_m.map(|error_m| BodyVector::new(error_m, 0.0));
        Some(Transmitter::new(RobotId::first(0)).answer(Command { estimated_error, ..Command::REST }))
    }

    #[test]
    fn robots_that_estimate_no_error_are_left_out_of_mean_and_maximum_and_counted() {
        let errors = EstimatedErrors::of(&[answer(Some(0.1)), None, answer(None), answer(Some(0.3))]);
        assert_eq!(errors, EstimatedErrors { mean_m: Some(0.2), max_m: Some(0.3), without: 1 });
        assert!(!errors.are_of_everyone());
    }

    #[test]
    fn nobody_has_no_error() {
        for nobody in [vec![], vec![None; 3]] {
            let errors = EstimatedErrors::of(&nobody);
            assert_eq!(errors, EstimatedErrors::default());
            assert!(!errors.are_of_everyone());
        }
        assert!(EstimatedErrors::of(&[answer(Some(0.0)), None]).are_of_everyone());
    }

    #[test]
    fn a_partition_of_nobody_costs_nothing_that_is_known() {
        let partition = Partition::new(Vec::new(), [1.0, 1.0]);
        let text = "duration_s = 1\nstep_s = 0.1\narena.size_m = [1, 1]\nrobots.count = 1\n\
                    controller.gain_per_s = 1\nchannel.range_m = 1\nfield.offset = 1";
        let field = Field::new(&Scenario::parse("test", text, &[]).unwrap());
        let nothing = Cost { cost_h: None, mean_true_error_m: None, without_mass: 0 };
        assert_eq!((partition.cost(&field), partition.rough_cost(&field)), (nothing, None));
        assert_eq!(partition.agreement(std::iter::empty::<std::iter::Empty<_>>(), [1.0, 1.0]), None);
    }

    #[test]
    fn narrow_peaks_cost_what_they_weigh() {
        for (side_m, sigma_m) in [(4.0, 0.005), (100.0, 0.1), (4.0, 4e-5), (100.0, 1e-3)] {
            let text = format!(
                "duration_s = 1\nstep_s = 0.1\narena.size_m = [{side_m}, {side_m}]\nrobots.count = 1\n\
                 controller.gain_per_s = 1\nchannel.range_m = 1\n\
                 field.gaussian = [{{ center_m = [{}, {}], sigma_m = {sigma_m}, gamma = 1 }}]",
                0.31 * side_m,
                0.83 * side_m
            );
            let field = Field::new(&Scenario::parse("test", &text, &[]).unwrap());
            let partition = Partition::new(vec![ArenaPoint::new(0.5 * side_m, 0.4 * side_m)], [side_m; 2]);
            let mass = sigma_m * (2.0 * std::f64::consts::PI).sqrt();
            let apart_squared = (0.19 * 0.19 + 0.43 * 0.43) * side_m * side_m;
            let cost_h = mass * (apart_squared + 2.0 * sigma_m * sigma_m) / 2.0;
            let Cost { cost_h: Some(measured), mean_true_error_m: Some(error_m), without_mass: 0 } =
                partition.cost(&field)
            else {
                panic!("the cell has mass")
            };
            assert!(
                (measured / cost_h - 1.0).abs() < 1e-8,
                "{side_m} m, {sigma_m} m: {measured}, not {cost_h}"
            );
            assert!(
                (error_m / apart_squared.sqrt() - 1.0).abs() < 1e-8,
                "{side_m} m, {sigma_m} m: {error_m}"
            );
            let rough = partition.rough_cost(&field).unwrap();
            assert!((rough / cost_h - 1.0).abs() < 0.01, "{side_m} m, {sigma_m} m: roughly {rough}");
        }
    }

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
            let rough = partition.rough_cost(&field).unwrap();
            let exact = partition.cost(&field).cost_h.unwrap();
            assert!((rough / exact - 1.0).abs() < 0.01, "{robots} robots: {rough}, not {exact}");
        }
    }
}
