//! A controller of one's own: drives towards the light and keeps away from others.
//!
//! It hears neighbors and senses light; that is all there is to know. See README.md beside it.

use protocol::{
    command::Command,
    controller::{Controller, StageObserver},
    frame::BodyVector,
    params::Params,
    percept::{Percept, Stimulus},
    property::{always, sometimes},
    robot_id::RobotId,
};
use serde::Deserialize;

/// Robots nearer than this push away from each other.
const NEAR_M: f64 = 0.25;

/// The controller, which is what the scenario says of it: `params = { speed_m_per_s = 0.2 }`.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Phototaxis {
    speed_m_per_s: f64,
}

/// Makes the controller of one life of a robot.
pub fn new(_: RobotId, params: &Params) -> serde_json::Result<Phototaxis> {
    params.json()
}

impl Controller for Phototaxis {
    fn boot(&mut self) -> Command {
        Command::REST
    }

    fn step(&mut self, percept: &Percept, _: &mut dyn StageObserver) -> Command {
        let speed = self.speed_m_per_s;
        let mut velocity = match percept.light.stimulus {
            Stimulus::Gradient(gradient) => gradient.capped(speed).0,
            Stimulus::Bearing(bearing) => BodyVector::new(speed, 0.0).turned(bearing.get()).0,
            Stimulus::None => BodyVector::HERE.0,
        };
        let near = percept.deliveries.iter().filter(|heard| heard.range.get() < NEAR_M);
        sometimes(near.clone().count() > 2, "a crowd");
        for heard in near {
            let push = speed * (1.0 - heard.range.get() / NEAR_M);
            velocity -= BodyVector::new(2.0 * push, 0.0).turned(heard.bearing.get()).0;
        }
        // It has no estimated error: it does not know how far it is from where it wants to be. Nor does it tell
        // others anything but that it is there: its packets have no payload.
        let velocity = BodyVector(velocity).capped(speed);
        always(velocity.length() <= speed * (1.0 + 1e-9), "no faster than allowed");
        Command { velocity, ..Command::REST }
    }
}
