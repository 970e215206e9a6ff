//! How fine the pieces of a quadrature must be to integrate φ over a cell: fine at its peaks, coarse far away.
//!
//! In:  the terms of φ and a convex cell, counter-clockwise, meters, one frame.
//! Out: for any triangle within the cell, the longest edge that the rule of [`crate::quadrature`] integrates well.
//!
//! Along any line a lamp is as smooth as its nearest singularity is far, which is sqrt(h² + d²) at a distance d from
//! it. A Gaussian is smooth over its σ, or over σ²/d where a cell holds only its flank; outwards its pieces grow by
//! less than what they hold becomes small (the remainder of the rule goes with the 12th power of the edge). So the
//! number of pieces grows with the logarithm of the cell's size over the width of a peak.

use arrayvec::ArrayVec;
use nalgebra::Vector2;
use protocol::percept::{COMPONENTS_MAX, FieldComponent};

use crate::{
    polygon::{Triangle, distance_squared},
    sensory_field::{magnitude, peak_of},
};

/// The coarseness that keeps masses, first and second moments to 1e-8, relative to those of the magnitudes of φ's
/// terms.
pub const FINE: f64 = 1.0;
/// The coarseness that keeps them to a percent.
pub const ROUGH: f64 = 4.0;
/// The narrowest peak that is integrated so well, as a share of the cell: below it the rounding of coordinates is felt
/// (1e-7 of the cell: 1e-8; 1e-9 of the cell: 2e-6).
pub const WIDTH_SHARE_MIN: f64 = 1e-6;

/// Longest edge at a lamp, in distances from its singularity, where pieces are [`FINE`].
const LAMP_SHARE: f64 = 0.5;
/// Longest edge at the peak of a Gaussian, in σ.
const GAUSSIAN_SHARE: f64 = 1.0;
/// Longest edge on the flank of a Gaussian, in lengths over which it falls by e.
const FLANK_SHARE: f64 = 2.0;
/// A Gaussian has to fall by e so often, until its pieces may be e times as long.
const FALLS_PER_GROWTH: f64 = 30.0;
/// A term that is everywhere below this share of the others is not looked at.
const NEGLIGIBLE: f64 = 1e-18;

/// The peaks of φ that matter in a cell.
#[derive(Clone, Debug)]
pub struct Refinement {
    peaks: ArrayVec<Peak, COMPONENTS_MAX>,
    /// No piece has to be shorter than this.
    shortest_m: f64,
}

#[derive(Clone, Copy, Debug)]
struct Peak {
    at: Vector2<f64>,
    /// Longest edge where it has to be shortest.
    shortest_m: f64,
    growth: Growth,
}

/// How the longest edge grows with the squared distance from the peak.
#[derive(Clone, Copy, Debug)]
enum Growth {
    /// In proportion to sqrt(h² + d²).
    Lamp { share: f64, h_squared: f64 },
    /// Exponentially with d², from a squared distance on.
    Gaussian { per_m2: f64, from_m2: f64 },
}

impl Refinement {
    /// For φ over `cell`, in pieces `coarseness` times as long as where they are [`FINE`].
    pub fn new(field: &[FieldComponent], cell: &[Vector2<f64>], coarseness: f64) -> Self {
        let mut refined = Self { peaks: ArrayVec::new(), shortest_m: f64::INFINITY };
        let across_m = across(cell);
        let is_even =
            |component: &&FieldComponent| least_m(component, cell, across_m) * coarseness >= across_m;
        if field.iter().all(|component| is_even(&component)) {
            return refined;
        }
        // Every magnitude falls with the distance from a peak, so it is least at a vertex.
        let least = |component| cell.iter().map(|&at| magnitude(component, at)).fold(f64::INFINITY, f64::min);
        let floor: f64 = field.iter().map(least).sum();
        let uneven = field.iter().filter(|component| !is_even(component));
        refined.peaks.extend(uneven.filter_map(|component| Peak::new(component, cell, floor, coarseness)));
        refined.shortest_m = refined.peaks.iter().map(|peak| peak.shortest_m).fold(f64::INFINITY, f64::min);
        refined
    }

    /// Whether the longest edge of `triangle` is short enough.
    pub fn suffices(&self, triangle: &Triangle, longest_m: f64) -> bool {
        longest_m <= self.shortest_m || !self.peaks.iter().any(|peak| peak.longest_m(triangle) < longest_m)
    }
}

/// No two points of a polygon are farther apart than this.
fn across(polygon: &[Vector2<f64>]) -> f64 {
    let Some(&first) = polygon.first() else { return 0.0 };
    let (low, high) = polygon.iter().fold((first, first), |(low, high), at| (low.inf(at), high.sup(at)));
    (high - low).norm()
}

/// A lower bound of the longest edge that a term allows in a cell: cheap, and all that most cells need.
fn least_m(component: &FieldComponent, cell: &[Vector2<f64>], across_m: f64) -> f64 {
    match *component {
        FieldComponent::Constant(_) => f64::INFINITY,
        FieldComponent::Lamp { half_distance_m, .. } => LAMP_SHARE * half_distance_m,
        FieldComponent::Gaussian { center, sigma_m, .. } => {
            let farthest_m = cell.first().map_or(0.0, |vertex| (vertex - center.0).norm()) + across_m;
            (GAUSSIAN_SHARE * sigma_m).min(FLANK_SHARE * sigma_m * sigma_m / farthest_m)
        }
    }
}

impl Peak {
    /// `None` where the term has none, or does not matter beside the others, whose sum is nowhere less than `floor`.
    fn new(component: &FieldComponent, cell: &[Vector2<f64>], floor: f64, coarseness: f64) -> Option<Self> {
        let (at, height) = peak_of(component)?;
        let nearest_m2 = distance_squared(cell, at);
        let highest = magnitude(component, at + Vector2::new(libm::sqrt(nearest_m2), 0.0));
        if highest <= NEGLIGIBLE * floor {
            return None;
        }
        match *component {
            FieldComponent::Constant(_) => None,
            FieldComponent::Lamp { half_distance_m, .. } => {
                let (share, h_squared) = (LAMP_SHARE * coarseness, half_distance_m * half_distance_m);
                let shortest_m = share * libm::sqrt(h_squared + nearest_m2);
                Some(Self { at, shortest_m, growth: Growth::Lamp { share, h_squared } })
            }
            FieldComponent::Gaussian { sigma_m, .. } => {
                let flank_m = FLANK_SHARE * sigma_m * sigma_m / libm::sqrt(nearest_m2);
                let shortest_m = coarseness * flank_m.min(GAUSSIAN_SHARE * sigma_m);
                // Where it has fallen to the floor.
                let drowned_m2 = 2.0 * sigma_m * sigma_m * libm::log(height / floor);
                let growth = Growth::Gaussian {
                    per_m2: 0.5 / (FALLS_PER_GROWTH * sigma_m * sigma_m),
                    from_m2: nearest_m2.min(drowned_m2),
                };
                Some(Self { at, shortest_m, growth })
            }
        }
    }

    /// The longest edge that `triangle` may have.
    fn longest_m(&self, triangle: &Triangle) -> f64 {
        let distance_m2 = distance_squared(triangle, self.at);
        match self.growth {
            Growth::Lamp { share, h_squared } => share * libm::sqrt(h_squared + distance_m2),
            Growth::Gaussian { per_m2, from_m2 } => {
                self.shortest_m * libm::exp((distance_m2 - from_m2) * per_m2)
            }
        }
    }
}
