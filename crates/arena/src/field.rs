//! The sensory function φ in the arena: Gaussians (eq. 19 and 20), lamps, and the offset Φ.

use arrayvec::ArrayVec;
use coverage::sensory_field;
use nalgebra::Vector2;
use protocol::{
    frame::BodyVector,
    percept::{COMPONENTS_MAX, FieldComponent, Light, Stimulus},
    units::Radians,
};

use crate::frame::{ArenaPoint, Pose};
use scenario::{FieldSpec, Scenario, fault};

/// Terms of φ as some body sees them.
pub type SeenField = ArrayVec<FieldComponent, COMPONENTS_MAX>;

/// The sensory function and how robots sense it.
#[derive(Clone, Debug)]
pub struct Field {
    spec: FieldSpec,
}

impl Field {
    /// The field of a scenario, at the start.
    pub fn new(scenario: &Scenario) -> Self {
        Self::of(scenario.field.clone())
    }

    /// The field with these terms.
    pub fn of(spec: FieldSpec) -> Self {
        Self { spec }
    }

    /// Its terms, as they are by now.
    pub fn spec(&self) -> &FieldSpec {
        &self.spec
    }

    /// Changes a term; whether it is another field now. Nothing else remembers the field, so that all see the change.
    pub fn change(&mut self, change: &fault::Field) -> bool {
        self.spec.change(change)
    }

    /// Every term of φ in the body frame of `pose`.
    pub fn seen_from(&self, pose: &Pose) -> SeenField {
        let at = |[x, y]: [f64; 2]| pose.sees(ArenaPoint::new(x, y));
        let offset = FieldComponent::Constant(self.spec.offset.get());
        let gaussians = self.spec.gaussian.iter().map(|peak| {
            let sigma_m = peak.sigma_m.get();
            let amplitude = peak.gamma.get() / (sigma_m * libm::sqrt(2.0 * std::f64::consts::PI));
            FieldComponent::Gaussian { center: at(peak.center_m.get()), amplitude, sigma_m }
        });
        let lamps = self.spec.lamp.iter().map(|lamp| FieldComponent::Lamp {
            position: at(lamp.position_m.get()),
            peak: lamp.peak.get(),
            half_distance_m: lamp.half_distance_m.get(),
        });
        std::iter::once(offset).chain(gaussians).chain(lamps).collect()
    }

    /// Returns the light reading of a body that sees the field as `seen`: value and gradient, or,
    /// on robots that measure none, only the direction in which φ grows.
    pub fn light(seen: &SeenField, measures_gradient: bool) -> Light {
        let here = Vector2::zeros();
        let gradient = BodyVector(sensory_field::gradient(seen, here));
        let stimulus = match measures_gradient {
            true => Stimulus::Gradient(gradient),
            false if gradient.length() == 0.0 => Stimulus::None,
            false => match Radians::new(gradient.bearing()) {
                Some(bearing) => Stimulus::Bearing(bearing),
                None => Stimulus::None,
            },
        };
        Light { value: sensory_field::value(seen, here), stimulus }
    }

    /// The highest value of φ among the nodes of a grid over the arena and the peaks of all terms.
    pub fn highest(&self, size_m: [f64; 2]) -> f64 {
        /// Nodes along a side.
        const NODES: u32 = 65;
        let along = |node: u32, side_m: f64| f64::from(node) / f64::from(NODES - 1) * side_m;
        let nodes = (0..NODES).flat_map(|x| (0..NODES).map(move |y| (x, y)));
        let grid = nodes.map(|(x, y)| ArenaPoint::new(along(x, size_m[0]), along(y, size_m[1])));
        let inside =
            |peak: ArenaPoint| ArenaPoint::new(peak.x.clamp(0.0, size_m[0]), peak.y.clamp(0.0, size_m[1]));
        let peaks = self.peaks().chain(self.lamps()).map(inside);
        let value = |at| sensory_field::value(&self.seen_from(&Pose::unturned(at)), Vector2::zeros());
        grid.chain(peaks).map(value).fold(f64::NEG_INFINITY, f64::max)
    }

    /// Where Gaussians have their peaks.
    pub fn peaks(&self) -> impl Iterator<Item = ArenaPoint> {
        self.spec.gaussian.iter().map(|peak| ArenaPoint::from(peak.center_m.get()))
    }

    /// Where lamps hang.
    pub fn lamps(&self) -> impl Iterator<Item = ArenaPoint> {
        self.spec.lamp.iter().map(|lamp| ArenaPoint::from(lamp.position_m.get()))
    }
}
