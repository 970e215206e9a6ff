//! Percepts and commands as lines of JSON, for controllers in any language: a line in, a line out.
//!
//! ```text
//! {"robot":7,"life":1,"params":{}}                                   -> {"velocity":[0,0]}
//! {"tick":0,"bump":false,"light":{...},"neighbors":[...],...}        -> {"tick":0,"velocity":[0.1,0]}
//! {"tick":1,...}                                                     -> {"tick":1,"velocity":[0.1,0],"payload":"aGk="}
//! ```
//!
//! Numbers keep every bit; payloads are base64. `lamplight schema --percept` and `--command` print the schemas.

#![forbid(unsafe_code)]

use std::collections::BTreeMap;

use base64::{Engine, prelude::BASE64_STANDARD};
use neighborhood::Neighborhood;
use protocol::{
    command,
    frame::BodyVector,
    payload::{PAYLOAD_BYTES_MAX, Payload, PayloadTooLong},
    percept::{Percept, Stimulus, Tick},
    property::{self, PropertyError, PropertyKind},
    robot_id::RobotId,
};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Longest line that a controller may answer, bytes.
pub const LINE_BYTES_MAX: usize = 1 << 16;

/// The first line of a life: who the robot is, and its parameters. It is answered by a command without a tick.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct BootLine {
    /// Number of the robot in its swarm, from 0.
    pub robot: u32,
    /// Its life, from 1.
    pub life: u32,
    /// Parameters from the scenario.
    pub params: serde_json::Map<String, serde_json::Value>,
}

/// A percept, in the robot's body frame: x ahead, y to the left. It is answered by a command with its tick.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct PerceptLine {
    /// Number of the tick, from 0.
    pub tick: Tick,
    /// Whether the bump skirt was pressed during the last motion.
    pub bump: bool,
    /// The light where the robot stands.
    pub light: LightLine,
    /// Neighbors that were heard lately, by sender.
    pub neighbors: Vec<NeighborLine>,
    /// Walls that are sensed, where the scenario grants it.
    pub walls: Vec<WallLine>,
    /// The robot's own motion since its beginning as its wheels believe; null without odometry.
    pub odometry: Option<PoseLine>,
    /// Heading in the arena, radians; null without a compass.
    pub compass_heading_rad: Option<f64>,
    /// Place in the arena, meters; null where the scenario tells none.
    pub position_m: Option<[f64; 2]>,
}

/// The light at a robot.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct LightLine {
    /// φ at the robot.
    pub value: f64,
    /// Bearing to where it grows, radians; null where there is no such direction.
    pub bearing_rad: Option<f64>,
    /// Gradient of φ, per meter; null where only its direction is measured.
    pub gradient: Option<[f64; 2]>,
}

/// A robot heard lately.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct NeighborLine {
    /// Its number.
    pub sender: u32,
    /// Distance, meters.
    pub range_m: f64,
    /// Direction to it, radians.
    pub bearing_rad: f64,
    /// Its heading relative to the robot's, radians.
    pub orientation_rad: f64,
    /// Cycles since it was heard; 0 if that was in this one.
    pub age_cycles: u32,
    /// Payload of its last packet, in base64.
    pub payload: String,
}

/// A wall: r · (cos bearing, sin bearing) <= distance.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct WallLine {
    /// Distance along the normal, meters.
    pub distance_m: f64,
    /// Bearing of the outward normal, radians.
    pub bearing_rad: f64,
}

/// A place and a heading.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct PoseLine {
    /// Place, meters.
    pub position_m: [f64; 2],
    /// Heading, radians.
    pub heading_rad: f64,
}

/// A command.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CommandLine {
    /// The tick of the percept that it answers; none in the answer to the first line.
    pub tick: Option<Tick>,
    /// Velocity, meters per second, body frame; by default the robot stands still.
    #[serde(default)]
    pub velocity: [f64; 2],
    /// Payload of the next packet, in base64.
    #[serde(default)]
    pub payload: String,
    /// How far the robot believes to be from its goal, meters, body frame; null if it does not know.
    pub estimated_error: Option<[f64; 2]>,
    /// Whether what must always hold does now, by name.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub always: BTreeMap<String, bool>,
    /// Whether what must be reached at least once is reached now, by name: to be said each time.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub sometimes: BTreeMap<String, bool>,
}

/// Why a line is no command.
#[derive(Debug, thiserror::Error)]
pub enum LineError {
    /// It is no JSON, or not of this form.
    #[error("it is no command: {0} (standard output is for commands alone; standard error comes in the log)")]
    Json(#[from] serde_json::Error),
    /// It answers another percept.
    #[error("it answers {}, and {} was asked", named(*.actual), named(*.expected))]
    Tick {
        /// The tick that was asked.
        expected: Option<Tick>,
        /// The tick in the line.
        actual: Option<Tick>,
    },
    /// Its payload is no base64.
    #[error("its payload is no base64: {0}")]
    Base64(#[from] base64::DecodeError),
    /// Its payload is longer than any packet's.
    #[error(transparent)]
    Payload(#[from] PayloadTooLong),
    /// A property whose name is none, or one too many.
    #[error(transparent)]
    Property(#[from] PropertyError),
    /// A number that is beyond all reason.
    #[error(transparent)]
    Vector(#[from] command::Unreasonable),
}

fn named(tick: Option<Tick>) -> String {
    tick.map_or("no tick".into(), |tick| format!("tick {tick}"))
}

impl BootLine {
    /// The first line of a life of a robot.
    pub fn new(id: RobotId, params: serde_json::Map<String, serde_json::Value>) -> Self {
        Self { robot: id.index, life: u32::from(id.incarnation) + 1, params }
    }
}

impl PerceptLine {
    /// The line of a percept, with the neighbors that are known.
    pub fn new(percept: &Percept, neighborhood: &Neighborhood) -> Self {
        let pair = |vector: BodyVector| [vector.0.x, vector.0.y];
        let (bearing_rad, gradient) = match percept.light.stimulus {
            Stimulus::None => (None, None),
            Stimulus::Bearing(bearing) => (Some(bearing.get()), None),
            Stimulus::Gradient(gradient) => {
                ((gradient.length() > 0.0).then(|| gradient.bearing()), Some(pair(gradient)))
            }
        };
        Self {
            tick: percept.tick,
            bump: percept.bump,
            light: LightLine { value: percept.light.value, bearing_rad, gradient },
            neighbors: neighborhood
                .iter()
                .map(|neighbor| NeighborLine {
                    sender: neighbor.delivery.packet.sender().index,
                    range_m: neighbor.delivery.range.get(),
                    bearing_rad: neighbor.delivery.bearing.get(),
                    orientation_rad: neighbor.delivery.orientation.get(),
                    age_cycles: neighbor.age_cycles,
                    payload: BASE64_STANDARD.encode(neighbor.payload),
                })
                .collect(),
            walls: percept
                .walls
                .iter()
                .map(|wall| WallLine { distance_m: wall.distance.get(), bearing_rad: wall.bearing.get() })
                .collect(),
            odometry: percept.odometry.map(|odometry| PoseLine {
                position_m: pair(odometry.position),
                heading_rad: odometry.heading.get(),
            }),
            compass_heading_rad: percept.compass.map(|compass| compass.heading.get()),
            position_m: percept.position.map(|position| [position.x.get(), position.y.get()]),
        }
    }
}

impl CommandLine {
    /// Reads the answer to `tick`, or to the first line, and states the properties in it.
    ///
    /// # Errors
    /// If it is none, or cannot be carried out.
    pub fn read(line: &[u8], tick: Option<Tick>) -> Result<command::Command, LineError> {
        let given: Self = serde_json::from_slice(line)?;
        if given.tick != tick {
            return Err(LineError::Tick { expected: tick, actual: given.tick });
        }
        let vector = |what, [x, y]: [f64; 2]| command::within_reason(what, BodyVector::new(x, y));
        for (kind, stated) in
            [(PropertyKind::Always, &given.always), (PropertyKind::Sometimes, &given.sometimes)]
        {
            stated.iter().try_for_each(|(name, &condition)| property::state(kind, condition, name))?;
        }
        let payload = BASE64_STANDARD.decode(&given.payload)?;
        Ok(command::Command {
            velocity: vector("velocity", given.velocity)?,
            estimated_error: given
                .estimated_error
                .map(|error| vector("estimated error", error))
                .transpose()?,
            payload: Payload::try_from(&payload[..])?,
        })
    }
}

const _: () = assert!(PAYLOAD_BYTES_MAX * 2 < LINE_BYTES_MAX, "a line has room for any payload");

#[cfg(test)]
mod tests {
    use super::*;

    fn read(line: &str, tick: Option<Tick>) -> Result<command::Command, String> {
        CommandLine::read(line.as_bytes(), tick).map_err(|error| error.to_string())
    }

    #[test]
    fn a_command_is_read_with_every_bit() {
        let line =
            r#"{"tick":3,"velocity":[0.1,-2e-3],"payload":"aGk=","estimated_error":[1,0.30000000000000004]}"#;
        let command = read(line, Some(3)).unwrap();
        assert_eq!(command.velocity, BodyVector::new(0.1, -2e-3));
        assert_eq!(command.estimated_error, Some(BodyVector::new(1.0, 0.1 + 0.2)));
        assert_eq!(&*command.payload, b"hi");
        assert_eq!(read("{}", None).unwrap(), command::Command::REST);
    }

    #[test]
    fn what_is_no_answer_is_refused_in_words() {
        let refusal = |line: &str| read(line, Some(3)).unwrap_err();
        assert!(refusal("hello").starts_with("it is no command: expected value"));
        assert!(refusal(r#"{"tick":3,"velocty":[0,0]}"#).contains("unknown field `velocty`"));
        assert_eq!(refusal(r#"{"tick":2}"#), "it answers tick 2, and tick 3 was asked");
        assert_eq!(refusal("{}"), "it answers no tick, and tick 3 was asked");
        assert!(refusal(r#"{"tick":3,"payload":"!"}"#).starts_with("its payload is no base64"));
        let long = BASE64_STANDARD.encode([0; 129]);
        assert!(refusal(&format!(r#"{{"tick":3,"payload":"{long}"}}"#)).contains("129 bytes"));
        assert_eq!(
            refusal(r#"{"tick":3,"velocity":[1e13,0]}"#),
            "its velocity is (10000000000000, 0), not within ±1e12"
        );
    }

    #[test]
    fn a_percept_keeps_every_bit() {
        let mut percept = Percept::empty(7);
        percept.light.stimulus = Stimulus::Gradient(BodyVector::new(0.1 + 0.2, -0.0));
        let line = PerceptLine::new(&percept, &Neighborhood::new(RobotId::first(0), 1));
        let text = serde_json::to_string(&line).unwrap();
        assert_eq!(serde_json::from_str::<PerceptLine>(&text).unwrap(), line);
        assert!(text.contains("0.30000000000000004,-0.0"), "{text}");
    }
}
