//! Parameters of the controller: the same for every robot that they are given to, and silent about how many there are.

use protocol::units::MetersPerSecond;
use serde::{Deserialize, Serialize};

use crate::law::Law;

pub use crate::{closure::Closure, estimate::GradientMode};

/// Parameters of a robot's controller.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct CoverageSetup {
    /// Control law.
    pub law: Law,
    /// Gain k of eq. 8, per second.
    pub gain_per_s: f64,
    /// Cap on the commanded speed, if any.
    pub speed_cap: Option<MetersPerSecond>,
    /// Source of the gradient.
    pub gradient: GradientMode,
    /// Closing rules.
    pub closure: Closure,
    /// A neighbor counts while it was heard less than this many ticks ago; at least 1.
    pub neighbor_timeout_ticks: u32,
}
