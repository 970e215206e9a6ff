//! `[sensors]`: sensors beside those for light, walls and other robots.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::number::NonNegative;
use crate::problem::{Problem, problem};
use crate::robots::Drive;
use crate::sensors::{OdometrySpec, SensorsSpec};

/// Sensors beside those for light, walls and other robots.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub(crate) struct SensorsKeys {
    /// Whether robots have odometry, and turn and move what they have heard along with their bodies; default `true`
    /// with `robots.drive = "differential"`, else `false`.
    pub(crate) odometry: Option<bool>,
    /// Error of odometry: standard deviation of each tick's displacement and, on its own, of its turn, as a share of
    /// it; at most 1.
    #[schemars(range(max = 1.0))]
    pub(crate) odometry_error: NonNegative,
    /// Whether robots know their heading in the arena; default `false`. The paper's controller does not go by it.
    pub(crate) compass: bool,
    /// Whether robots know their position in the arena; default `false`. The paper's controller does not go by it.
    pub(crate) position: bool,
}

impl SensorsKeys {
    /// The sensors of robots that move like this.
    pub(crate) fn resolve(self, drive: Drive) -> Result<SensorsSpec, Problem> {
        let Self { odometry_error: error, compass, position, .. } = self;
        match self.odometry.unwrap_or(drive == Drive::Differential) {
            true => Ok(SensorsSpec { odometry: Some(OdometrySpec { error }), compass, position }),
            false if error == NO_ERROR => Ok(SensorsSpec { odometry: None, compass, position }),
            false => {
                let path = "sensors.odometry_error";
                Err(problem(&[path], format!("{path} has no meaning without odometry"))
                    .hint("grant it (on the command line: --set sensors.odometry=true)"))
            }
        }
    }
}

impl From<SensorsSpec> for SensorsKeys {
    fn from(SensorsSpec { odometry, compass, position }: SensorsSpec) -> Self {
        Self {
            odometry: Some(odometry.is_some()),
            odometry_error: odometry.map_or(NO_ERROR, |odometry| odometry.error),
            compass,
            position,
        }
    }
}

const NO_ERROR: NonNegative = constant!(NonNegative, 0.0);

impl Default for SensorsKeys {
    fn default() -> Self {
        Self { odometry: None, odometry_error: NO_ERROR, compass: false, position: false }
    }
}
