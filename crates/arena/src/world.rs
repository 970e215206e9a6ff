//! Bodies in motion: first-order dynamics (7), walls, and discs that do not overlap.

use nalgebra::Vector2;
use protocol::{frame::BodyVector, odometry::Motion, units::wrapped};

use crate::{
    contacts::{Contacts, Wanted},
    frame::{ArenaPoint, Pose},
};
use scenario::{Drive, Scenario};

/// All bodies and the rules they move by.
#[derive(Clone, Debug)]
pub struct World {
    poses: Vec<Pose>,
    /// Where each body is headed, if it is under command.
    courses: Vec<Option<Course>>,
    bumped: Vec<bool>,
    speed_limit_m_per_s: f64,
    drive: Drive,
    turn_limit_rad_per_s: f64,
    size_m: [f64; 2],
    contacts: Contacts,
    /// Where bodies are, how far they would move alone, and whether they can be pushed.
    positions: Vec<ArenaPoint>,
    displacements: Vec<Vector2<f64>>,
    yields: Vec<bool>,
    /// Motion that each body's wheels rolled last, if anybody asks.
    rolled: Option<Vec<Motion>>,
}

/// A velocity that was told to a body, and its heading then: while the body turns, the course stays.
#[derive(Clone, Copy, Debug)]
struct Course {
    velocity: BodyVector,
    heading: f64,
}

impl Course {
    /// The velocity in the frame of a body that now has another heading.
    fn seen_at(&self, heading: f64) -> BodyVector {
        if heading == self.heading {
            return self.velocity;
        }
        let (sin, cos) = libm::sincos(self.heading - heading);
        let BodyVector(told) = self.velocity;
        BodyVector::new(cos * told.x - sin * told.y, sin * told.x + cos * told.y)
    }
}

impl World {
    /// The bodies of a scenario at their start.
    pub fn new(scenario: &Scenario, poses: Vec<Pose>) -> Self {
        let (robots, size_m) = (&scenario.robots, scenario.arena.size_m.get());
        Self {
            courses: vec![None; poses.len()],
            bumped: vec![false; poses.len()],
            speed_limit_m_per_s: robots.speed_limit_m_per_s.map_or(f64::INFINITY, |limit| limit.get()),
            drive: robots.drive,
            turn_limit_rad_per_s: robots.turn_limit_rad_per_s.get(),
            size_m,
            contacts: Contacts::new(robots.radius_m.get(), size_m),
            positions: Vec::with_capacity(poses.len()),
            displacements: Vec::with_capacity(poses.len()),
            yields: Vec::with_capacity(poses.len()),
            rolled: scenario.sensors.odometry.map(|_| Vec::new()),
            poses,
        }
    }

    /// Pose of every body.
    pub fn poses(&self) -> &[Pose] {
        &self.poses
    }

    /// Whether each body touched a wall or another body in the last motion.
    pub fn bumped(&self) -> &[bool] {
        &self.bumped
    }

    /// Tells a body where to go, in its present body frame (m/s). It keeps the course while it turns,
    /// as its position controller does by odometry.
    pub fn set_course(&mut self, robot: usize, velocity: BodyVector) {
        self.courses[robot] = Some(Course { velocity, heading: self.poses[robot].heading });
    }

    /// Leaves a body without command: it stands still, and does not yield to others.
    pub fn halt(&mut self, robot: usize) {
        self.courses[robot] = None;
    }

    /// Returns the motion that each body's wheels rolled last, in the body frame before it; empty where nobody has
    /// odometry.
    pub fn rolled(&self) -> &[Motion] {
        self.rolled.as_deref().unwrap_or_default()
    }

    /// How often bodies stayed where they were because their contacts had no solution that could be found.
    pub fn contacts_unsolved(&self) -> u64 {
        self.contacts.unsolved()
    }

    /// How often a group of bodies in contact moved in steps longer than they should be, because a tick had too many.
    pub fn contacts_coarse(&self) -> u64 {
        self.contacts.coarse()
    }

    /// Moves every body for `step_s`. `drive` says with which velocity, given the one of its course
    /// (both in its body frame); where it says `None` the body stands still, and does not yield to others.
    /// A body without command is not asked for.
    pub fn advance(&mut self, step_s: f64, mut drive: impl FnMut(usize, BodyVector) -> Option<BodyVector>) {
        let Self { positions, displacements, yields, rolled, .. } = self;
        positions.clear();
        displacements.clear();
        yields.clear();
        rolled.iter_mut().for_each(Vec::clear);
        let (kind, speed_limit, turn_limit) =
            (self.drive, self.speed_limit_m_per_s, self.turn_limit_rad_per_s);
        let alone = |pose: &Pose, velocity: BodyVector| {
            let velocity = velocity.capped(speed_limit);
            match kind {
                Drive::Holonomic => slid(pose, velocity, step_s),
                Drive::Differential => driven(pose, velocity, step_s, turn_limit),
            }
        };
        let [width, height] = self.size_m;
        for (robot, (pose, course)) in self.poses.iter_mut().zip(&self.courses).enumerate() {
            let told = course.as_ref().map(|course| course.seen_at(pose.heading));
            let velocity = told.and_then(|told| drive(robot, told));
            let moved = velocity.map_or(*pose, |velocity| alone(pose, velocity));
            if let Some(rolled) = rolled {
                let wheels =
                    if told == velocity { moved } else { told.map_or(*pose, |told| alone(pose, told)) };
                rolled.push(wheels.seen_from(pose));
            }
            let way = moved.position - pose.position;
            positions.push(pose.position);
            // No way is longer than the arena.
            displacements.push(Vector2::new(way.x.clamp(-width, width), way.y.clamp(-height, height)));
            yields.push(velocity.is_some());
            *pose = moved;
        }
        let wanted = Wanted { displacements, yields };
        self.contacts.advance(positions, wanted, &mut self.bumped);
        for (rolled, (pose, &position)) in rolled.iter_mut().flatten().zip(self.poses.iter().zip(&*positions))
        {
            let mut push = pose.sees(position);
            if kind == Drive::Differential {
                push.0.y = 0.0;
            }
            rolled.displacement.0 += push.turned(rolled.turn).0;
        }
        for (pose, &position) in self.poses.iter_mut().zip(&*positions) {
            pose.position = position;
        }
    }
}

/// ṗ = u (7): the body slides, its heading stays.
fn slid(pose: &Pose, velocity: BodyVector, step_s: f64) -> Pose {
    Pose { position: pose.position + pose.outward(velocity) * step_s, ..*pose }
}

/// Two wheels under a position controller: it turns towards the target as fast as its limit lets
/// it and drives at the commanded speed, the less the more the target lies abeam, not at all while
/// it lies behind. The body follows the arc that turning and driving make.
fn driven(pose: &Pose, velocity: BodyVector, step_s: f64, turn_limit_rad_per_s: f64) -> Pose {
    let speed = velocity.length();
    if speed == 0.0 {
        return *pose;
    }
    let bearing = velocity.bearing();
    let turn_rate = (bearing / step_s).clamp(-turn_limit_rad_per_s, turn_limit_rad_per_s);
    let ahead = speed * libm::cos(bearing).max(0.0);
    let half_turn = turn_rate * step_s / 2.0;
    // The chord of an arc is shorter than the arc by sin(x)/x, x half the turn.
    let shortening = if half_turn == 0.0 { 1.0 } else { libm::sin(half_turn) / half_turn };
    let chord = Pose { heading: pose.heading + half_turn, ..*pose };
    let position = pose.position + chord.outward(BodyVector::new(ahead * step_s * shortening, 0.0));
    Pose { position, heading: wrapped(pose.heading + 2.0 * half_turn) }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::*;
    use proptest::prelude::*;

    fn world(drive: Drive, radius_m: f64, positions: &[(f64, f64)]) -> World {
        let pose = |&(x, y)| Pose { position: ArenaPoint::new(x, y), heading: 0.0 };
        World {
            poses: positions.iter().map(pose).collect(),
            courses: vec![None; positions.len()],
            bumped: vec![false; positions.len()],
            speed_limit_m_per_s: 1.0,
            drive,
            turn_limit_rad_per_s: PI / 2.0,
            size_m: [2.0, 2.0],
            contacts: Contacts::new(radius_m, [2.0, 2.0]),
            positions: Vec::new(),
            displacements: Vec::new(),
            yields: Vec::new(),
            rolled: Some(Vec::new()),
        }
    }

    fn go(x: f64, y: f64) -> Option<BodyVector> {
        Some(BodyVector::new(x, y))
    }

    /// Every body is told to go, and moves.
    fn advance(world: &mut World, step_s: f64, velocities: &[Option<BodyVector>]) {
        for (robot, velocity) in velocities.iter().enumerate() {
            match velocity {
                Some(velocity) => world.set_course(robot, *velocity),
                None => world.halt(robot),
            }
        }
        world.advance(step_s, |_, course| Some(course));
    }

    #[test]
    fn a_holonomic_body_slides_where_it_is_told() {
        let mut world = world(Drive::Holonomic, 0.1, &[(1.0, 1.0)]);
        world.poses[0].heading = PI / 2.0;
        advance(&mut world, 0.5, &[go(0.4, 0.0)]);
        assert!((world.poses[0].position - ArenaPoint::new(1.0, 1.2)).norm() < 1e-15);
        assert_eq!(world.poses[0].heading, PI / 2.0);
    }

    #[test]
    fn no_body_is_faster_than_its_limit() {
        let mut world = world(Drive::Holonomic, 0.0, &[(0.5, 0.5)]);
        advance(&mut world, 1.0, &[go(30.0, 40.0)]);
        assert!((world.poses[0].position - ArenaPoint::new(1.1, 1.3)).norm() < 1e-15);
    }

    #[test]
    fn a_body_without_a_command_stands_still() {
        let mut world = world(Drive::Holonomic, 0.1, &[(1.0, 1.0)]);
        advance(&mut world, 0.5, &[None]);
        assert_eq!(world.poses[0].position, ArenaPoint::new(1.0, 1.0));
    }

    /// Asserts how far wheels rolled, ahead and to the left, and how much they turned.
    fn assert_rolled(world: &World, ahead: f64, left: f64, turn: f64) {
        let Motion { displacement, turn: turned } = world.rolled()[0];
        let off = displacement.0 - BodyVector::new(ahead, left).0;
        assert!(off.norm() < 1e-12 && (turned - turn).abs() < 1e-12, "{displacement:?}, {turned}");
    }

    #[test]
    fn wheels_count_what_holds_them_back_and_not_what_pushes_them_sideways() {
        // Towards a wall .3 m ahead, with a neighbor that pushes from the right.
        for (drive, left) in [(Drive::Differential, 0.0), (Drive::Holonomic, 0.05)] {
            let mut world = world(drive, 0.1, &[(1.6, 1.0), (1.6, 0.8)]);
            world.poses[1].heading = PI / 2.0;
            advance(&mut world, 0.1, &[go(0.0, 0.0), go(1.0, 0.0)]);
            assert!((world.poses[0].position - ArenaPoint::new(1.6, 1.05)).norm() < 1e-9);
            assert_rolled(&world, 0.0, left, 0.0);
            advance(&mut world, 1.0, &[go(0.9, 0.0), None]);
            assert!((world.poses[0].position - ArenaPoint::new(1.9, 1.05)).norm() < 1e-9);
            assert_rolled(&world, 0.3, 0.0, 0.0);
        }
    }

    #[test]
    fn wheels_count_what_they_were_told_and_not_what_a_fault_makes_of_it() {
        let mut world = world(Drive::Differential, 0.1, &[(1.0, 1.0)]);
        let told = BodyVector::new(0.0, 0.2);
        world.set_course(0, told);
        world.advance(0.5, |_, _| None);
        assert_rolled(&world, 0.0, 0.0, PI / 4.0);
        assert_eq!(world.poses[0], Pose::unturned(ArenaPoint::new(1.0, 1.0)), "it is stuck");
        world.advance(0.5, |_, _| Some(BodyVector::new(0.3, 0.0)));
        assert_rolled(&world, 0.0, 0.0, PI / 4.0);
        assert!((world.poses[0].position.x - 1.15).abs() < 1e-12);
        world.halt(0);
        world.advance(0.5, |_, _| unreachable!("nobody commands it"));
        assert_rolled(&world, 0.0, 0.0, 0.0);
    }

    #[test]
    fn walls_stop_a_body_at_its_radius() {
        let mut world = world(Drive::Holonomic, 0.1, &[(0.2, 1.0)]);
        advance(&mut world, 1.0, &[go(-1.0, 0.0)]);
        assert_eq!(world.poses[0].position, ArenaPoint::new(0.1, 1.0));
        assert!(world.bumped[0]);
    }

    #[test]
    fn two_bodies_that_meet_share_the_way_apart() {
        let mut world = world(Drive::Holonomic, 0.1, &[(0.85, 1.0), (1.15, 1.0)]);
        advance(&mut world, 1.0, &[go(0.1, 0.0), go(-0.1, 0.0)]);
        assert!((world.poses[0].position.x - 0.9).abs() < 1e-9);
        assert!((world.poses[1].position.x - 1.1).abs() < 1e-9);
        assert_eq!(world.bumped, [true, true]);
    }

    #[test]
    fn wheels_turn_before_they_drive_to_what_lies_behind() {
        let mut world = world(Drive::Differential, 0.0, &[(1.0, 1.0)]);
        advance(&mut world, 1.0, &[go(-0.5, 0.0)]);
        assert_eq!(world.poses[0].position, ArenaPoint::new(1.0, 1.0));
        assert!((world.poses[0].heading - PI / 2.0).abs() < 1e-15, "a quarter turn per second");
    }

    #[test]
    fn wheels_that_turn_keep_their_course() {
        let mut world = world(Drive::Differential, 0.0, &[(1.0, 1.0)]);
        world.set_course(0, BodyVector::new(0.0, 0.5));
        for _ in 0..4 {
            world.advance(1.0, |_, course| Some(course));
        }
        assert!((world.poses[0].heading - PI / 2.0).abs() < 1e-12, "it was sent to its left, and goes there");
        assert!((world.poses[0].position.x - 1.0).abs() < 0.2);
    }

    #[test]
    fn wheels_follow_a_quarter_circle() {
        let mut world = world(Drive::Differential, 0.0, &[(1.0, 1.0)]);
        // Target at 45 degrees, reached in a tick of half a second at the turn limit.
        advance(&mut world, 0.5, &[go(0.5, 0.5)]);
        let radius = 0.5 / (PI / 2.0);
        let expected =
            ArenaPoint::new(1.0 + radius * libm::sin(PI / 4.0), 1.0 + radius * (1.0 - libm::cos(PI / 4.0)));
        assert!((world.poses[0].position - expected).norm() < 1e-12);
    }

    proptest! {
        #[test]
        fn bodies_never_overlap_nor_leave(
            steps in proptest::collection::vec(
                proptest::collection::vec((-1.0_f64..1.0, -1.0_f64..1.0), 36), 1..8
            )
        ) {
            // A dense block: 36 bodies of 0.1 m radius on a 0.21 m grid.
            let start: Vec<_> =
                (0..36).map(|i| (0.3 + 0.21 * f64::from(i % 6), 0.3 + 0.21 * f64::from(i / 6))).collect();
            let mut world = world(Drive::Holonomic, 0.1, &start);
            for velocities in steps {
                let commands: Vec<_> = velocities.into_iter().map(|(x, y)| go(x, y)).collect();
                advance(&mut world, 0.3, &commands);
                let apart = |a: usize, b: usize| (world.poses[b].position - world.poses[a].position).norm();
                prop_assert!((0..36).all(|b| (0..b).all(|a| apart(a, b) >= 0.2 * (1.0 - 1e-9))));
                prop_assert_eq!(world.contacts_unsolved(), 0);
                for pose in &world.poses {
                    prop_assert!((0.1..=1.9).contains(&pose.position.x));
                    prop_assert!((0.1..=1.9).contains(&pose.position.y));
                }
            }
        }
    }
}
