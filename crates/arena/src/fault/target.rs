//! Robots and links that a fault strikes: chosen once, when it begins.

use super::rng::FaultRng;
use crate::{
    field::Field,
    frame::{ArenaPoint, Pose},
};
use scenario::{
    Link,
    fault::{self, Choice, Direction, Disc, Pick, ShareOf},
};

/// `which` of the draw by which robots are picked.
const PICKED: u32 = 0;

/// The world as a fault finds it when it begins.
#[derive(Clone, Copy, Debug)]
pub(super) struct Scene<'a> {
    /// Where every body is.
    pub(super) poses: &'a [Pose],
    /// The field: where lamps hang by now.
    pub(super) field: &'a Field,
}

/// The robots and links that a fault strikes.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Target {
    robots: Vec<bool>,
    links: Option<Vec<Link>>,
    direction: Direction,
}

impl Target {
    /// A target without robots.
    pub(super) fn none() -> Self {
        Self { robots: Vec::new(), links: None, direction: Direction::Both }
    }

    /// Chooses the robots that `spec` means in `scene`.
    pub(super) fn made(spec: &fault::Target, scene: &Scene<'_>, rng: FaultRng) -> Self {
        let mut target = Self::none();
        if let fault::Target::Packets(_, direction) = spec {
            target.direction = *direction;
        }
        if let fault::Target::Links(links) = spec {
            target.links = Some(links.clone());
        }
        if let Some(choice) = spec.choice() {
            target.robots = vec![false; scene.poses.len()];
            for robot in chosen(choice, scene, rng) {
                target.robots[robot as usize] = true;
            }
        }
        target
    }

    /// Whether it strikes this robot.
    pub(super) fn robot(&self, robot: u32) -> bool {
        self.robots.get(robot as usize) == Some(&true)
    }

    /// All robots that it strikes, ascending.
    pub(super) fn robots(&self) -> impl Iterator<Item = u32> {
        (0..).zip(&self.robots).filter_map(|(robot, &chosen)| chosen.then_some(robot))
    }

    /// Whether it strikes packets from `sender` to `receiver`.
    pub(super) fn links(&self, sender: u32, receiver: u32) -> bool {
        if let Some(links) = &self.links {
            return links.iter().any(|link| link.carries(sender, receiver));
        }
        match self.direction {
            Direction::Both => self.robot(sender) || self.robot(receiver),
            Direction::Out => self.robot(sender),
            Direction::In => self.robot(receiver),
        }
    }
}

/// Whether a point lies in a disc.
pub(super) fn covers(disc: &Disc, at: &ArenaPoint) -> bool {
    (at - ArenaPoint::from(disc.center_m.get())).norm() <= disc.radius_m.get()
}

/// The robots of a choice: of its candidates the share that is meant, rounded to whole robots but at least one.
fn chosen(Choice { robots, region, share }: &Choice, scene: &Scene<'_>, rng: FaultRng) -> Vec<u32> {
    let named = |robot: u32| robots.as_ref().is_none_or(|robots| robots.contains(robot));
    let inside = |at: &ArenaPoint| region.is_none_or(|disc| covers(&disc, at));
    let places = (0..).zip(scene.poses).map(|(robot, pose)| (robot, pose.position));
    let candidates: Vec<(u32, ArenaPoint)> =
        places.filter(|(robot, at)| named(*robot) && inside(at)).collect();
    let Some(ShareOf { share, pick }) = share else {
        return candidates.into_iter().map(|(robot, _)| robot).collect();
    };
    let count = whole(share.get(), candidates.len());
    let lamps = || scene.field.lamps();
    let middle = lamps().sum::<ArenaPoint>() / lamps().count().max(1) as f64;
    let mut ranked: Vec<(f64, u32)> = candidates
        .into_iter()
        .map(|(robot, at)| match pick {
            Pick::Random => (rng.of_choice(robot, PICKED).unit(), robot),
            Pick::NearestLamps => ((at - middle).norm(), robot),
        })
        .collect();
    ranked.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    ranked.truncate(count);
    ranked.into_iter().map(|(_, robot)| robot).collect()
}

/// A share of some robots in whole robots: rounded, but at least one of them if there are any.
pub(super) fn whole(share: f64, robots: usize) -> usize {
    ((share * robots as f64).round() as usize).clamp(robots.min(1), robots)
}
