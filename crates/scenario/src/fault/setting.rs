//! The setting of a fault plan: the scenario that it strikes, as far as faults ask.

use crate::controller::Controller;
use crate::light::LightSpec;
use crate::number::Positive;
use crate::steps;

/// All that faults may ask of their scenario. There is no fault in it, so that a scenario can have faults.
pub(crate) struct Setting<'a> {
    /// Number of robots.
    pub(crate) robots: u32,
    /// Fastest that a robot may be, m/s, if there is a limit.
    pub(crate) speed_limit_m_per_s: Option<Positive>,
    /// Length of a tick, seconds.
    pub(crate) step_s: f64,
    /// Length of the run, ticks.
    pub(crate) ticks: u64,
    /// Width and height of the arena, meters.
    pub(crate) size_m: [f64; 2],
    /// How many lamps the field has.
    pub(crate) lamps: usize,
    /// How many Gaussians the field has.
    pub(crate) gaussians: usize,
    /// Largest reading of a light sensor, about.
    pub(crate) counts_max: f64,
    /// The light sensors.
    pub(crate) light: &'a LightSpec,
    /// Longest payload, bytes.
    pub(crate) payload_bytes_max: u8,
    /// Controllers, and their robots.
    pub(crate) controllers: &'a [Controller],
    /// Highest chance of any kind of random fault.
    pub(crate) probability_max: f64,
    /// Largest share of the robots that a random fault strikes.
    pub(crate) share_max: f64,
    /// Longest delay by a random fault, seconds.
    pub(crate) delay_max_s: f64,
}

impl Setting<'_> {
    /// Whether the field has lamps.
    pub(super) fn has_lamps(&self) -> bool {
        self.lamps > 0
    }

    /// Whether laws of the paper think for all robots.
    pub(crate) fn has_laws_alone(&self) -> bool {
        self.controllers.iter().all(|controller| controller.law().is_some())
    }

    /// The tick nearest to a time.
    pub(super) fn tick_at(&self, time_s: f64) -> u64 {
        steps::nearest(time_s, self.step_s)
    }

    /// When a tick is, seconds.
    pub(super) fn time_of(&self, tick: u64) -> f64 {
        steps::time_of(tick, self.step_s)
    }
}
