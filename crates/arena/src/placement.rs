//! Where robots stand at the start: as the scenario says, or at random without overlap.

use std::f64::consts::PI;

use protocol::units::wrapped;

use crate::{
    frame::{ArenaPoint, Pose},
    random::{Draws, Purpose},
};
use scenario::Scenario;

/// Random spots tried for one robot before the arena counts as full.
pub const ATTEMPTS_MAX: u64 = 10_000;

/// The start cannot place the bodies.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error(
    "cannot place robot {robot} of {count}: {ATTEMPTS_MAX} random spots all overlap a body; \
     use fewer robots, a smaller robots.radius_m (now {radius_m}) or a larger arena.size_m"
)]
pub struct PlacementError {
    /// The robot that found no room.
    pub robot: u32,
    /// Robots to be placed.
    pub count: u32,
    /// Radius of a body.
    pub radius_m: f64,
}

/// One pose per robot.
pub fn start(scenario: &Scenario) -> Result<Vec<Pose>, PlacementError> {
    let positions = match &scenario.robots.positions_m {
        Some(positions) => positions.iter().map(|position| ArenaPoint::from(position.get())).collect(),
        None => scattered(scenario)?,
    };
    let heading = |robot: usize| match &scenario.robots.headings_rad {
        Some(headings) => wrapped(headings[robot].get()),
        None => Draws::of(scenario.seed.get(), Purpose::StartHeading, 0, robot as u32, 0).between(-PI, PI),
    };
    let posed = positions.into_iter().enumerate();
    Ok(posed.map(|(robot, position)| Pose { position, heading: heading(robot) }).collect())
}

/// Uniform over the arena, one robot after the other, each where no body is yet.
fn scattered(scenario: &Scenario) -> Result<Vec<ArenaPoint>, PlacementError> {
    let (count, radius) = (scenario.robot_count(), scenario.robots.radius_m.get());
    let [width, height] = scenario.arena.size_m.get();
    let mut placed: Vec<ArenaPoint> = Vec::new();
    // Bodies already placed, by square cells one diameter wide.
    let mut cells: std::collections::BTreeMap<(i64, i64), Vec<usize>> = Default::default();
    let cell = |point: &ArenaPoint| match radius > 0.0 {
        true => ((point.x / (2.0 * radius)) as i64, (point.y / (2.0 * radius)) as i64),
        false => (0, 0),
    };
    for robot in 0..count {
        let spot = (0..ATTEMPTS_MAX)
            .map(|attempt| {
                let mut draws = Draws::of(scenario.seed.get(), Purpose::StartPosition, attempt, robot, 0);
                ArenaPoint::new(draws.between(radius, width - radius), draws.between(radius, height - radius))
            })
            .find(|spot| {
                let (column, row) = cell(spot);
                let mut around = (-1..=1).flat_map(|c| (-1..=1).map(move |r| (column + c, row + r)));
                radius == 0.0
                    || !around.any(|cell| {
                        cells.get(&cell).is_some_and(|near| {
                            near.iter().any(|&other| (placed[other] - spot).norm() < 2.0 * radius)
                        })
                    })
            })
            .ok_or(PlacementError { robot, count, radius_m: radius })?;
        if radius > 0.0 {
            cells.entry(cell(&spot)).or_default().push(placed.len());
        }
        placed.push(spot);
    }
    Ok(placed)
}
