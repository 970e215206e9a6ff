//! `[robots]`: bodies, and where they start.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::number::{Finite, NonNegative, Positive, RobotCount, Xy};
use crate::problem::{Problem, problem};
use crate::robots::{Drive, RobotsSpec};

/// The robots' bodies and where they start.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct RobotsKeys {
    /// How many robots; may be left out where `positions_m` tells, and is filled in then.
    pub(crate) count: Option<RobotCount>,
    /// Radius of a body in meters; 0 makes the robots points.
    #[serde(default = "point")]
    pub(crate) radius_m: NonNegative,
    /// Highest speed in meters per second; without it there is no limit.
    pub(crate) speed_limit_m_per_s: Option<Positive>,
    /// How a robot moves.
    #[serde(default)]
    pub(crate) drive: Drive,
    /// Highest turning speed in radians per second; only a differential drive asks for it.
    #[serde(default = "turn_limit")]
    pub(crate) turn_limit_rad_per_s: Positive,
    /// Start of each robot, [x, y] in meters; without it robots are placed uniformly at random.
    pub(crate) positions_m: Option<Vec<Xy<Finite>>>,
    /// Heading of each robot at the start in radians, counter-clockwise from the x axis; without it random.
    pub(crate) headings_rad: Option<Vec<Finite>>,
}

impl RobotsKeys {
    /// The same with the number of robots that `count` and `positions_m` agree on.
    pub(crate) fn resolve(self) -> Result<RobotsSpec, Problem> {
        let positions = self.positions_m.as_ref().map(Vec::len);
        let count = match (self.count, positions) {
            (None, None) => return Err(problem(&["robots"], "`count` is missing in [robots]")),
            (None, Some(positions)) => RobotCount::try_from(positions as i128).map_err(|refused| {
                problem(&["robots.positions_m"], format!("robots.positions_m: {refused}"))
            })?,
            (Some(count), Some(positions)) if count.get() as usize != positions => {
                let message =
                    format!("robots.count is {}, but robots.positions_m places {positions}", count.get());
                return Err(problem(&["robots.count", "robots.positions_m"], message).hint(
                    "without positions_m (on the command line: --set robots.positions_m=) placement is random",
                ));
            }
            (Some(count), _) => count,
        };
        Ok(RobotsSpec {
            count: count.get(),
            radius_m: self.radius_m,
            speed_limit_m_per_s: self.speed_limit_m_per_s,
            drive: self.drive,
            turn_limit_rad_per_s: self.turn_limit_rad_per_s,
            positions_m: self.positions_m,
            headings_rad: self.headings_rad,
        })
    }
}

impl From<RobotsSpec> for RobotsKeys {
    fn from(robots: RobotsSpec) -> Self {
        Self {
            count: RobotCount::new(robots.count),
            radius_m: robots.radius_m,
            speed_limit_m_per_s: robots.speed_limit_m_per_s,
            drive: robots.drive,
            turn_limit_rad_per_s: robots.turn_limit_rad_per_s,
            positions_m: robots.positions_m,
            headings_rad: robots.headings_rad,
        }
    }
}

fn point() -> NonNegative {
    constant!(NonNegative, 0.0)
}

fn turn_limit() -> Positive {
    constant!(Positive, 3.0)
}
