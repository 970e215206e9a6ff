//! The tables of a scenario file, one struct each; their doc comments are the schema's descriptions.

use std::num::NonZeroU32;
use std::time::Duration;

use protocol::setup::{Law, Plane};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::number::{Finite, NonNegative, Positive, RobotCount, Xy};
use super::schema::{LawName, PlaneName};

/// Every table at the top of a scenario file.
pub(super) const TABLES: [&str; 11] = [
    "arena",
    "robots",
    "field",
    "light",
    "sensors",
    "controller",
    "channel",
    "convergence",
    "processes",
    "output",
    "fuzz",
];

/// The arena: a rectangle with walls, [0, width] x [0, height].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ArenaSpec {
    /// Width and height in meters.
    pub size_m: Xy<Positive>,
    /// Whether robots sense the walls: if so, percepts carry them.
    #[serde(default)]
    pub boundary_sensing: bool,
}

/// The robots' bodies and where they start.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RobotsSpec {
    /// How many robots; may be left out where `positions_m` tells, and is filled in then.
    pub count: Option<RobotCount>,
    /// Radius of a body in meters; 0 makes the robots points.
    #[serde(default = "point")]
    pub radius_m: NonNegative,
    /// Highest speed in meters per second; without it there is no limit.
    pub speed_limit_m_per_s: Option<Positive>,
    /// How a robot moves.
    #[serde(default)]
    pub drive: Drive,
    /// Highest turning speed in radians per second; only a differential drive asks for it.
    #[serde(default = "turn_limit")]
    pub turn_limit_rad_per_s: Positive,
    /// Start of each robot, [x, y] in meters; without it robots are placed uniformly at random.
    pub positions_m: Option<Vec<Xy<Finite>>>,
    /// Heading of each robot at the start in radians, counter-clockwise from the x axis; without it random.
    pub headings_rad: Option<Vec<Finite>>,
}

/// How a robot moves.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Drive {
    /// In any direction at once.
    #[default]
    Holonomic,
    /// Forward while turning, as on two wheels.
    Differential,
}

/// The sensory function φ: a constant plus Gaussians plus lamps.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct FieldSpec {
    /// The constant Φ.
    pub offset: Finite,
    /// Gaussians of eq. 19 and 20.
    pub gaussian: Vec<GaussianSpec>,
    /// Lamps.
    pub lamp: Vec<LampSpec>,
}

/// A Gaussian: γ/(σ·sqrt(2π))·exp(-d²/2σ²) at distance d from its center (eq. 19 and 20).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct GaussianSpec {
    /// Center μ, [x, y] in meters.
    pub center_m: Xy<Finite>,
    /// Width σ in meters.
    pub sigma_m: Positive,
    /// Strength γ.
    #[serde(default = "unit_strength")]
    pub gamma: Finite,
}

/// A lamp: peak/(1 + d²/half_distance²) at distance d.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LampSpec {
    /// Where the lamp is, [x, y] in meters.
    pub position_m: Xy<Finite>,
    /// Sensor counts at the lamp.
    pub peak: Finite,
    /// Distance in meters at which half of the peak is left.
    pub half_distance_m: Positive,
}

/// Sensors beside those for light, walls and other robots.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct SensorsSpec {
    /// Whether robots have odometry, and turn and move what they have heard along with their bodies; default `true`
    /// with `robots.drive = "differential"`, else `false`.
    pub odometry: Option<bool>,
    /// Error of odometry: standard deviation of each tick's displacement and, on its own, of its turn, as a share of
    /// it; at most 1.
    #[schemars(range(max = 1.0))]
    pub odometry_error: NonNegative,
    /// Whether robots know their heading in the arena; default `false`. The paper's controller does not go by it.
    pub compass: bool,
    /// Whether robots know their position in the arena; default `false`. The paper's controller does not go by it.
    pub position: bool,
}

/// What robots can be granted to sense.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Sensor {
    /// The light where they stand.
    Light,
    /// The bump skirt.
    Bump,
    /// Walls: `arena.boundary_sensing`.
    Walls,
    /// Their own motion: `sensors.odometry`.
    Odometry,
    /// Their heading in the arena: `sensors.compass`.
    Compass,
    /// Their position in the arena: `sensors.position`.
    Position,
    /// The true field: with the law `exact`.
    Field,
}

/// The controller every robot runs.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ControllerSpec {
    /// Control law.
    #[serde(default = "linear")]
    #[schemars(with = "LawName")]
    pub law: Law,
    /// Gain k of eq. 8, per second; k times a neighbor cycle is at most 1.5.
    pub gain_per_s: Positive,
    /// Where the gradient of φ comes from.
    #[serde(default)]
    pub gradient: GradientSource,
    /// Magnitude of the gradient, sensor counts per meter; with `gradient = "fixed"` and only there.
    pub gradient_magnitude_per_m: Option<Positive>,
    /// A neighbor not heard for this many neighbor cycles is forgotten; default 4 wherever packets can be lost or
    /// late: with `channel.loss`, `channel.soft_edge_m`, `channel.occlusion`, any `channel.access` but `"instant"`, or
    /// a fault of kind `loss`, `burst`, `delay`, `corrupt`, `partition` or `jam`. Elsewhere 1, as silence means gone.
    pub neighbor_timeout_cycles: Option<NonZeroU32>,
    /// Base in meters of the triangle that closes the cell of a robot with all neighbors on one bearing.
    #[serde(default = "triangle_side")]
    pub triangle_base_m: Positive,
    /// Height of that triangle in meters.
    #[serde(default = "triangle_side")]
    pub triangle_height_m: Positive,
    /// Distance in meters of the line that closes a bearing gap of π or more.
    #[serde(default = "close_distance")]
    pub close_distance_m: Positive,
    /// Distance in meters at which every cell is cut off; without it cells are not capped.
    pub cell_cap_m: Option<Positive>,
}

/// Where a robot's gradient of φ comes from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum GradientSource {
    /// The sensor measures it (Section IV).
    #[default]
    Measured,
    /// Its magnitude is fixed, its direction is towards the stimulus (Section V).
    Fixed,
}

/// When the swarm counts as converged.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct ConvergenceSpec {
    /// The swarm has converged when the mean estimated error, in meters, falls below this.
    pub tolerance_m: Positive,
    /// Whether the run ends there.
    pub stop: bool,
}

/// How long a robot may take to join that the run starts, unless the scenario says otherwise: a thousand take two
/// seconds on two cores.
const JOIN_TIMEOUT: Duration = Duration::from_secs(30);

/// How the robots' processes are supervised.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct ProcessesSpec {
    /// A robot that has not answered a tick for this long, in seconds of wall time, hangs.
    pub hang_timeout_s: Positive,
    /// Treatment of a robot that hangs.
    pub on_hang: OnHang,
    /// How long the arena waits for a robot to join, in seconds of wall time. Without it, 30 seconds for robots that
    /// the run starts, and without limit for those that are driven by hand.
    pub join_timeout_s: Option<Positive>,
    /// Transport of messages; without it blackboards in lock-step, publish-subscribe in real time.
    #[schemars(with = "Option<PlaneName>")]
    pub plane: Option<Plane>,
    /// Each robot's clock runs fast or slow by a share of its own, drawn evenly, of up to this many parts per million;
    /// a restarted robot draws another. In every engine robots send by it with `channel.access = "random"` or
    /// `"fixed-phase"` (other cycles are shared, and stay so); in real time they wake up by it as well.
    pub clock_drift_ppm: NonNegative,
    /// In real time, each wake-up of a robot's timer comes late by a time of its own, drawn evenly, of up to
    /// this many seconds; less than a neighbor cycle.
    pub timer_jitter_s: NonNegative,
}

/// Treatment of a robot that hangs.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum OnHang {
    /// The run fails.
    Fail,
    /// The run goes on without it.
    #[default]
    Exclude,
    /// It is killed and started anew.
    Restart,
}

/// Recorded outputs.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct OutputSpec {
    /// Seconds of virtual time between two rows of `metrics.csv`: a whole number of steps, or rounded to one.
    pub metrics_every_s: Positive,
    /// Seconds of virtual time between two times at which `poses.csv` holds every robot's pose: a whole number of
    /// steps, or rounded to one; without it there is no `poses.csv`.
    pub poses_every_s: Option<Positive>,
    /// Whether the run shows how packets fared by the number of robots that could disturb them, beside the
    /// closed form where one is known.
    pub crowding: bool,
}

impl ProcessesSpec {
    /// `hang_timeout_s` as a duration of wall time.
    pub fn hang_timeout(&self) -> Duration {
        duration(self.hang_timeout_s)
    }

    /// How long a robot may take to join, of wall time; `None` if as long as it likes.
    pub fn join_timeout(&self, by_hand: bool) -> Option<Duration> {
        let unless_said = if by_hand { None } else { Some(JOIN_TIMEOUT) };
        self.join_timeout_s.map(duration).or(unless_said)
    }
}

/// Converts seconds; more than a clock can count is forever.
fn duration(seconds: Positive) -> Duration {
    Duration::try_from_secs_f64(seconds.get()).unwrap_or(Duration::MAX)
}

impl Default for FieldSpec {
    fn default() -> Self {
        Self { offset: constant!(Finite, 0.0), gaussian: Vec::new(), lamp: Vec::new() }
    }
}

impl Default for SensorsSpec {
    fn default() -> Self {
        Self { odometry: None, odometry_error: constant!(NonNegative, 0.0), compass: false, position: false }
    }
}

impl Default for ConvergenceSpec {
    fn default() -> Self {
        Self { tolerance_m: constant!(Positive, 1e-7), stop: false }
    }
}

impl Default for ProcessesSpec {
    fn default() -> Self {
        Self {
            hang_timeout_s: constant!(Positive, 2.0),
            on_hang: OnHang::default(),
            join_timeout_s: None,
            plane: None,
            clock_drift_ppm: constant!(NonNegative, 0.0),
            timer_jitter_s: constant!(NonNegative, 0.0),
        }
    }
}

impl Default for OutputSpec {
    fn default() -> Self {
        Self { metrics_every_s: constant!(Positive, 1.0), poses_every_s: None, crowding: false }
    }
}

fn point() -> NonNegative {
    constant!(NonNegative, 0.0)
}

fn turn_limit() -> Positive {
    constant!(Positive, 3.0)
}

fn unit_strength() -> Finite {
    constant!(Finite, 1.0)
}

fn linear() -> Law {
    Law::Linear
}

fn triangle_side() -> Positive {
    constant!(Positive, 0.6)
}

fn close_distance() -> Positive {
    constant!(Positive, 0.25)
}
