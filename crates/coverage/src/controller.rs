//! Algorithm 1 of the paper: one robot's control loop, one call per tick.

use protocol::{
    command::Command,
    controller::{Controller, Stage, StageObserver},
    frame::BodyVector,
    percept::Percept,
    robot_id::RobotId,
};

use crate::{
    cell::{COINCIDENT_M, HalfPlanes, cut_cell},
    control_law::Situation,
    estimate::LinearField,
    half_plane::HalfPlane,
    law,
    neighbors::NeighborTable,
    polygon::Polygon,
    reading,
    setup::CoverageSetup,
};

/// The paper's controller of one robot, with what it remembers between cycles.
#[derive(Clone, Debug)]
pub struct CoverageController {
    setup: CoverageSetup,
    neighbors: NeighborTable,
}

/// A robot's picture of the world around it, body frame.
#[derive(Clone, Debug, PartialEq)]
pub struct Picture {
    /// Its cell; empty if it has none.
    pub cell: Polygon,
    /// V+, the part of the cell where φ̂ is positive; `None` if its law does not cut it.
    pub positive: Option<Polygon>,
    /// Ĉ, where it wants to be; `None` if it stays.
    pub goal: Option<BodyVector>,
}

impl CoverageController {
    /// A controller with an empty neighbor table.
    // Inlined, it is made where it stays: moved, it would touch all the memory that it has room for.
    #[inline]
    pub fn new(id: RobotId, setup: CoverageSetup) -> Self {
        let neighbors = NeighborTable::new(id, setup.neighbor_timeout_ticks);
        Self { setup, neighbors }
    }

    /// Returns the neighbor table.
    pub fn neighbors(&self) -> &NeighborTable {
        &self.neighbors
    }

    fn cut_cell(&self, cell: &mut Polygon, percept: &Percept) {
        let bisectors = self
            .neighbors
            .iter()
            .map(|neighbor| &neighbor.delivery)
            .filter(|heard| heard.range.get() > COINCIDENT_M)
            .map(|heard| HalfPlane::bisector(heard.range.get(), heard.bearing));
        let mut lines = HalfPlanes::new();
        lines.extend(bisectors);
        lines.extend(percept.walls.iter().map(HalfPlane::wall));
        cut_cell(cell, &mut lines, &self.setup.closure);
    }

    /// Returns what the controller makes of a percept that it has heard: for those who watch, not for the robot.
    #[cold]
    pub fn picture(&self, percept: &Percept) -> Picture {
        let Self { setup, neighbors } = self;
        let (mut cell, mut part) = (Polygon::new(), Polygon::new());
        self.cut_cell(&mut cell, percept);
        let positive = setup.law.truncates().then(|| {
            let estimate = LinearField::sensed(&percept.light, setup.gradient);
            estimate.positive_part(&cell, &mut part).iter().copied().collect()
        });
        let situation = Situation { cell: &cell, percept, neighbors, gradient: setup.gradient };
        let goal = law::goal(setup.law, &situation, &mut ());
        Picture { cell, positive, goal }
    }

    /// u = k(Ĉ − p), no faster than the cap.
    fn velocity(&self, goal: BodyVector) -> BodyVector {
        let velocity = BodyVector(goal.0 * self.setup.gain_per_s);
        match self.setup.speed_cap {
            Some(cap) => velocity.capped(cap.get()),
            None => velocity,
        }
    }
}

impl Controller for CoverageController {
    /// Stands still and is heard.
    fn boot(&mut self) -> Command {
        Command { payload: reading::payload(0.0), ..Command::REST }
    }

    fn hear(&mut self, percept: &Percept) {
        self.neighbors.follow(percept.odometry);
        self.neighbors.record(percept.tick, &percept.deliveries);
    }

    /// One cycle: hear, build the local cell, find its estimated centroid, head for it (eq. 8).
    ///
    /// The robot stays where it is, and estimates no error, if it has no cell, or if its cell has no positive mass.
    fn step(&mut self, percept: &Percept, stages: &mut dyn StageObserver) -> Command {
        self.hear(percept);
        stages.passed(Stage::Neighbors);
        let mut cell = Polygon::new();
        self.cut_cell(&mut cell, percept);
        stages.passed(Stage::Cell);
        let Self { setup, neighbors } = &*self;
        let situation = Situation { cell: &cell, percept, neighbors, gradient: setup.gradient };
        let goal = law::goal(setup.law, &situation, stages);
        stages.passed(Stage::Centroid);
        let velocity = goal.map_or(BodyVector::HERE, |goal| self.velocity(goal));
        Command { estimated_error: goal, velocity, payload: reading::payload(percept.light.value) }
    }
}

#[cfg(test)]
mod tests {
    use crate::{
        law::Law,
        setup::{Closure, GradientMode},
    };
    use core::f64::consts::{FRAC_PI_2, PI, TAU};
    use std::vec::Vec;

    use nalgebra::{Matrix2, Vector2};
    use proptest::prelude::*;
    use protocol::{
        packet::Packet,
        percept::{Delivery, Light, Stimulus, Wall},
        units::{Meters, MetersPerSecond, Radians},
    };

    use super::*;
    use crate::{
        polygon::{edges, reach},
        quadratic_field::QuadraticField,
        quadrature::integrate,
    };

    fn meters(value: f64) -> Meters {
        Meters::new(value).unwrap()
    }

    fn radians(value: f64) -> Radians {
        Radians::new(value).unwrap()
    }

    fn setup() -> CoverageSetup {
        CoverageSetup {
            law: Law::Linear,
            gain_per_s: 1.0,
            speed_cap: MetersPerSecond::new(0.3),
            gradient: GradientMode::Measured,
            closure: Closure {
                triangle_base: meters(0.6),
                triangle_height: meters(0.6),
                close_distance: meters(0.25),
                cap: None,
            },
            neighbor_timeout_ticks: 1,
        }
    }

    fn shares(index: u32, light: f32) -> Packet {
        Packet::short(RobotId::first(index), 0, Some(light.to_le_bytes()))
    }

    fn percept(light: f64, neighbors: &[(f64, f64)]) -> Percept {
        let mut percept = Percept::empty(0);
        percept.light = Light { value: light, stimulus: Stimulus::Gradient(BodyVector::HERE) };
        percept.deliveries = (1..)
            .zip(neighbors)
            .map(|(index, &(range, bearing))| Delivery {
                packet: shares(index, 0.0),
                range: meters(range),
                bearing: radians(bearing),
                orientation: radians(0.0),
            })
            .collect();
        percept
    }

    fn step(setup: CoverageSetup, percept: &Percept) -> Command {
        CoverageController::new(RobotId::first(0), setup).step(percept, &mut ())
    }

    /// Where a robot heads that has a goal.
    fn goal_of(setup: CoverageSetup, percept: &Percept) -> BodyVector {
        step(setup, percept).estimated_error.expect("it has a cell with mass")
    }

    /// Stands still, and does not claim to be where it should be.
    fn assert_lost(command: Command) {
        assert_eq!((command.estimated_error, command.velocity), (None, BodyVector::HERE));
    }

    #[test]
    fn a_robot_that_hears_nobody_stays_and_estimates_no_error() {
        assert_lost(step(setup(), &percept(1.0, &[])));
        assert_lost(CoverageController::new(RobotId::first(0), setup()).boot());
    }

    #[test]
    fn a_robot_in_the_dark_stays_and_estimates_no_error() {
        assert_lost(step(setup(), &percept(0.0, &[(0.4, 0.0)])));
    }

    #[test]
    fn a_robot_whose_estimate_is_negative_everywhere_stays_and_estimates_no_error() {
        assert_lost(step(setup(), &percept(-1.0, &[(0.4, 0.0)])));
    }

    #[test]
    fn a_neighbor_on_the_very_spot_is_ignored() {
        let alone = goal_of(setup(), &percept(1.0, &[(0.4, 0.0)]));
        assert_eq!(goal_of(setup(), &percept(1.0, &[(0.4, 0.0), (1e-10, 2.0)])), alone);
    }

    #[test]
    fn a_single_neighbor_ahead_pushes_the_robot_back() {
        let goal = goal_of(setup(), &percept(1.0, &[(0.1, 0.0)]));
        // The triangle's center lies a third of its height behind the bisector.
        assert!((goal.0.x - (0.05 - 0.2)).abs() < 1e-15);
        assert!(goal.0.y.abs() < 1e-15);
    }

    #[test]
    fn the_speed_cap_shortens_the_velocity_but_not_the_goal() {
        let fast = CoverageSetup { gain_per_s: 10.0, ..setup() };
        let command = step(fast, &percept(1.0, &[(0.1, 0.0)]));
        assert!((command.velocity.length() - 0.3).abs() < 1e-15);
        assert!((command.estimated_error.unwrap().length() - 0.15).abs() < 1e-15);
    }

    #[test]
    fn walls_alone_make_a_cell() {
        let mut percept = percept(1.0, &[]);
        let wall = |distance, bearing| Wall { distance: meters(distance), bearing: radians(bearing) };
        percept.walls.extend([wall(0.75, 0.0), wall(0.5, FRAC_PI_2)]);
        percept.walls.extend([wall(0.25, PI), wall(0.5, -FRAC_PI_2)]);
        let goal = goal_of(setup(), &percept);
        assert!((goal.0.x - 0.25).abs() < 1e-15 && goal.0.y.abs() < 1e-15);
    }

    #[test]
    fn the_uniform_law_ignores_the_light() {
        let uniform = CoverageSetup { law: Law::Uniform, ..setup() };
        let neighbors = [(0.4, 0.0), (0.5, 2.0), (0.6, 4.0)];
        assert_eq!(goal_of(uniform, &percept(0.0, &neighbors)), goal_of(uniform, &percept(9.0, &neighbors)));
    }

    #[test]
    fn the_exact_law_agrees_with_the_linear_one_where_the_field_is_flat() {
        let exact = CoverageSetup { law: Law::Exact, ..setup() };
        let mut percept = percept(2.0, &[(0.4, 0.0), (0.5, 2.0), (0.6, 4.0)]);
        percept.field.push(protocol::percept::FieldComponent::Constant(2.0));
        let difference = goal_of(exact, &percept).0 - goal_of(setup(), &percept).0;
        assert!(difference.norm() < 1e-14);
    }

    fn cell_of(controller: &CoverageController, percept: &Percept) -> Polygon {
        let mut cell = Polygon::new();
        controller.cut_cell(&mut cell, percept);
        cell
    }

    fn quadratic() -> CoverageSetup {
        CoverageSetup { law: Law::Quadratic, neighbor_timeout_ticks: 4, ..setup() }
    }

    /// Neighbors around a robot that all read a field, and the robot that reads it and its gradient.
    fn percept_in(field: &QuadraticField, neighbors: &[(f64, f64)]) -> Percept {
        let mut percept = percept(field.linear.value, neighbors);
        percept.light.stimulus = Stimulus::Gradient(BodyVector(field.linear.gradient));
        for (index, heard) in (1..).zip(&mut percept.deliveries) {
            heard.packet = shares(index, field.at(&BodyVector::polar(heard.range, heard.bearing).0) as f32);
        }
        percept
    }

    #[test]
    fn the_quadratic_law_finds_the_true_centroid_where_the_field_is_quadratic() {
        let field = QuadraticField {
            linear: LinearField { value: 2.0, gradient: Vector2::new(0.7, -0.4) },
            curvature: Matrix2::new(5.0, 1.6, 1.6, -2.8),
        };
        let percept = percept_in(&field, &[(0.4, 0.0), (0.5, 1.1), (0.6, 2.2), (0.5, 3.3), (0.4, 4.4)]);
        let mut controller = CoverageController::new(RobotId::first(0), quadratic());
        let goal = controller.step(&percept, &mut ()).estimated_error.unwrap().0;
        let cell = cell_of(&controller, &percept);
        let [mass, x, y] = integrate(&cell, |_, _| true, |q| [1.0, q.x, q.y].map(|k| k * field.at(&q)));
        let centroid = Vector2::new(x, y) / mass;
        assert!((goal - centroid).norm() < 1e-6, "off by {:e}", (goal - centroid).norm());
        assert!(
            (goal_of(setup(), &percept).0 - centroid).norm() > 1e-3,
            "the linear law does not see the curvature"
        );
    }

    #[test]
    fn a_neighbor_that_shares_no_reading_bounds_the_cell_and_is_left_out_of_the_fit() {
        let field = QuadraticField {
            linear: LinearField { value: 2.0, gradient: Vector2::new(0.7, -0.4) },
            curvature: Matrix2::new(5.0, 1.6, 1.6, -2.8),
        };
        let around: Vec<_> = (0..8).map(|at| (0.3, TAU / 8.0 * f64::from(at))).collect();
        let mut percept = percept_in(&field, &around);
        let all_share = goal_of(quadratic(), &percept).0;
        for payload in [None, Some(f32::NAN.to_le_bytes())] {
            percept.deliveries[3].packet = Packet::short(RobotId::first(4), 0, payload);
            let off = goal_of(quadratic(), &percept).0 - all_share;
            assert!(off.norm() < 1e-6, "the other seven tell a quadratic field as well: {off}");
        }
    }

    #[test]
    fn the_quadratic_law_of_a_robot_that_hears_nobody_is_the_linear_one() {
        let mut percept = percept(1.0, &[]);
        percept.light.stimulus = Stimulus::Gradient(BodyVector::new(3.0, -1.0));
        let wall = |distance, bearing| Wall { distance: meters(distance), bearing: radians(bearing) };
        percept.walls.extend([wall(0.75, 0.0), wall(0.5, FRAC_PI_2)]);
        percept.walls.extend([wall(0.25, PI), wall(0.5, -FRAC_PI_2)]);
        for gradient in [GradientMode::Measured, GradientMode::Fixed(2.0)] {
            let linear = CoverageSetup { gradient, ..setup() };
            let off =
                goal_of(CoverageSetup { gradient, ..quadratic() }, &percept).0 - goal_of(linear, &percept).0;
            assert!(off.norm() < 1e-14, "{off}");
        }
    }

    #[test]
    fn readings_that_agree_with_the_linear_estimate_leave_its_goal() {
        let linear = LinearField { value: 1.0, gradient: Vector2::new(6.0, -3.0) };
        let flat = QuadraticField { linear, curvature: Matrix2::zeros() };
        let percept = percept_in(&flat, &[(0.4, 0.0), (0.5, 2.0), (0.6, 4.0)]);
        let off = goal_of(quadratic(), &percept).0 - goal_of(setup(), &percept).0;
        assert!(off.norm() < 1e-6, "{off}");
    }

    #[test]
    fn readings_beyond_reason_leave_the_linear_goal() {
        let mut percept = percept(1.0, &[(0.4, 0.0), (0.5, 2.0), (0.6, 4.0)]);
        percept.light = Light { value: f64::MAX, stimulus: Stimulus::Gradient(BodyVector::HERE) };
        assert_eq!(goal_of(quadratic(), &percept), goal_of(setup(), &percept));
    }

    proptest! {
        #[test]
        fn the_quadratic_goal_lies_in_the_cell_whatever_is_heard(
            own in -10.0_f64..10.0,
            slope in (-30.0_f64..30.0, -30.0_f64..30.0),
            heard in proptest::collection::vec(
                (0.01_f64..1.0, 0.0_f64..TAU, prop_oneof![-10.0_f32..10.0, -3e38_f32..3e38]), 1..30),
            fixed: bool,
        ) {
            let places: Vec<_> = heard.iter().map(|&(range, bearing, _)| (range, bearing)).collect();
            let mut percept = percept(own, &places);
            percept.light.stimulus = Stimulus::Gradient(BodyVector::new(slope.0, slope.1));
            for ((index, delivery), &(_, _, light)) in (1..).zip(&mut percept.deliveries).zip(&heard) {
                delivery.packet = shares(index, light);
            }
            let gradient = if fixed { GradientMode::Fixed(5.0) } else { GradientMode::Measured };
            let mut controller = CoverageController::new(RobotId::first(0), CoverageSetup { gradient, ..quadratic() });
            // Without a goal it stays, which is in the cell.
            let goal = controller.step(&percept, &mut ()).estimated_error.unwrap_or(BodyVector::HERE).0;
            prop_assert!(goal.x.is_finite() && goal.y.is_finite());
            let cell = cell_of(&controller, &percept);
            let slack = 1e-9 * reach(&cell).max(1.0);
            for (start, end) in edges(&cell) {
                let edge = end - start;
                prop_assert!(edge.perp(&(goal - start)) >= -slack * edge.norm(), "{goal} is outside");
            }
        }
    }

    /// Notes what it is told.
    struct Notes(Vec<Stage>);

    impl StageObserver for Notes {
        fn passed(&mut self, stage: Stage) {
            self.0.push(stage);
        }
    }

    #[test]
    fn every_stage_is_passed_once_and_in_order_whatever_the_law_and_the_cell() {
        let heard: [&[(f64, f64)]; 3] = [&[], &[(0.4, 0.0)], &[(0.4, 0.0), (0.5, 2.0), (0.6, 4.0)]];
        for &law in Law::ALL {
            for (neighbors, light) in heard.into_iter().zip([1.0, f64::MAX, -1.0]) {
                let (setup, percept) = (CoverageSetup { law, ..setup() }, percept(light, neighbors));
                let mut notes = Notes(Vec::new());
                let watched = CoverageController::new(RobotId::first(0), setup).step(&percept, &mut notes);
                assert_eq!(notes.0, Stage::ALL, "{law:?} {neighbors:?}");
                assert_eq!(watched, step(setup, &percept), "being watched changes nothing");
            }
        }
    }

    #[test]
    fn packets_carry_the_reading() {
        let mut controller = CoverageController::new(RobotId::first(3), setup());
        assert_eq!(*controller.boot().payload, 0.0_f32.to_le_bytes());
        assert_eq!(*controller.step(&percept(4.0, &[]), &mut ()).payload, 4.0_f32.to_le_bytes());
    }
}
