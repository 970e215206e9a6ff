//! The light sensor of every robot, resolved.

use super::number::{DiodeCount, NonNegative, Positive};

/// Highest offset, peak or false reading: sums and gradients of them stay finite.
pub(crate) const COUNTS_MAX: f64 = 1e12;

/// Narrowest Gaussian or lamp, in meters: squared, it is still a normal number.
pub(crate) const WIDTH_MIN_M: f64 = 1e-6;

/// The light sensor of every robot.
#[derive(Clone, Debug, PartialEq)]
pub enum LightSpec {
    /// φ and its direction as they are.
    Ideal,
    /// Photodiodes facing outward: bearing and strength from the sum of their readings.
    Ring(RingSpec),
}

/// A ring of photodiodes under lamps.
#[derive(Clone, Debug, PartialEq)]
pub struct RingSpec {
    /// Photodiodes around the body, the first straight ahead.
    pub diodes: DiodeCount,
    /// Height in meters of the lamps above the diodes.
    pub height_m: Positive,
    /// Standard deviation of a diode's gain, as a share of it, drawn once per diode.
    pub gain_mismatch: NonNegative,
    /// Standard deviation of each reading of a diode, counts.
    pub noise_counts: NonNegative,
    /// Largest reading of the converter, counts, at which it saturates.
    pub adc_max_counts: Positive,
    /// Step of the converter, counts.
    pub adc_step_counts: Positive,
}
