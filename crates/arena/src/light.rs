//! Light sensors of the bodies: they read φ as it is, or as a ring of photodiodes sees the lamps.
//!
//! A diode that faces a lamp sideways, at a distance d and under a height h, sees A·d/(d² + h²)^1.5
//! (the inverse square, times the cosine at which light falls on an upright surface). A is chosen
//! so that its strongest reading, at d = h/√2, is the lamp's peak. Turned away by an angle a diode
//! sees the cosine of it, and nothing beyond 90 degrees. The ring's vector sum Σ s (cos α, sin α)
//! tells the bearing, and as cosines add up to N/4 around the ring, 4/N times its length tells what a
//! diode that faced the light would read. That is the natural response f̃ of Section V: φ = Φ + f̃.

use nalgebra::Vector2;
use protocol::{
    frame::BodyVector,
    percept::{Light, Stimulus, Tick},
    units::Radians,
};

use crate::{
    field::{Field, SeenField},
    frame::{ArenaPoint, Pose},
    random::{Draws, Purpose},
};
use scenario::{FieldSpec, LampSpec, LightSpec, RingSpec, Scenario};

/// The light sensors of all bodies.
#[derive(Clone, Debug)]
pub struct LightSensors {
    ring: Option<Ring>,
    /// By robot: whether its ideal sensor measures the gradient.
    measure_gradient: Vec<bool>,
}

#[derive(Clone, Debug)]
struct Ring {
    /// Direction of each diode, body frame.
    facing: Vec<Vector2<f64>>,
    height_m: f64,
    gain_mismatch: f64,
    noise_counts: f64,
    adc_max_counts: f64,
    adc_step_counts: f64,
    seed: u64,
}

impl LightSensors {
    /// The sensors of a scenario.
    pub fn new(scenario: &Scenario) -> Self {
        let ring = match &scenario.light {
            LightSpec::Ideal => None,
            LightSpec::Ring(spec) => Some(Ring::new(spec, scenario.seed.get())),
        };
        let measures_gradient = |robot| scenario.controller_of(robot).senses_gradient();
        Self { ring, measure_gradient: (0..scenario.robot_count()).map(measures_gradient).collect() }
    }

    /// Reads the sensors of robot `robot` at `pose`, where it sees `field` as `seen`.
    pub fn read(&self, field: &Field, seen: &SeenField, robot: u32, pose: &Pose, tick: Tick) -> Light {
        match &self.ring {
            None => Field::light(seen, self.measure_gradient[robot as usize]),
            Some(ring) => ring.read(field.spec(), robot, pose, tick),
        }
    }
}

impl Ring {
    fn new(spec: &RingSpec, seed: u64) -> Self {
        let count = spec.diodes.get();
        let facing = |diode| {
            let (sin, cos) = libm::sincos(std::f64::consts::TAU * f64::from(diode) / f64::from(count));
            Vector2::new(cos, sin)
        };
        Self {
            facing: (0..count).map(facing).collect(),
            height_m: spec.height_m.get(),
            gain_mismatch: spec.gain_mismatch.get(),
            noise_counts: spec.noise_counts.get(),
            adc_max_counts: spec.adc_max_counts.get(),
            adc_step_counts: spec.adc_step_counts.get(),
            seed,
        }
    }

    /// Reads the light of lamps; Φ is what robots add to it.
    fn read(&self, field: &FieldSpec, robot: u32, pose: &Pose, tick: Tick) -> Light {
        let lights: Vec<Vector2<f64>> = field.lamp.iter().map(|lamp| self.arriving(lamp, pose)).collect();
        let sum = self.facing.iter().zip(0..).fold(Vector2::zeros(), |sum, (facing, diode)| {
            let seen: f64 = lights.iter().map(|light| light.dot(facing).max(0.0)).sum();
            sum + facing * self.converted(seen, robot, diode, tick)
        });
        let strength = 4.0 / self.facing.len() as f64 * libm::hypot(sum.x, sum.y);
        let bearing = Radians::new(BodyVector(sum).bearing()).expect("readings are finite");
        let stimulus = if strength > 0.0 { Stimulus::Bearing(bearing) } else { Stimulus::None };
        Light { value: field.offset.get() + strength, stimulus }
    }

    /// The light of one lamp: towards it, in the body frame, as strong as a diode facing it reads.
    fn arriving(&self, lamp: &LampSpec, pose: &Pose) -> Vector2<f64> {
        let away = pose.sees(ArenaPoint::from(lamp.position_m.get())).0;
        let (d_squared, h_squared) = (away.norm_squared(), self.height_m * self.height_m);
        let strongest = lamp.peak.get() * 1.5 * libm::sqrt(3.0) * h_squared;
        away * (strongest / libm::pow(d_squared + h_squared, 1.5))
    }

    /// Converts a diode's current to counts.
    fn converted(&self, seen: f64, robot: u32, diode: u32, tick: Tick) -> f64 {
        let mut counts = seen;
        if self.gain_mismatch > 0.0 {
            let mut draws = Draws::of(self.seed, Purpose::DiodeGain, 0, robot, diode);
            counts *= (1.0 + self.gain_mismatch * draws.normal()).max(0.0);
        }
        if self.noise_counts > 0.0 {
            let mut draws = Draws::of(self.seed, Purpose::DiodeNoise, tick, robot, diode);
            counts += self.noise_counts * draws.normal();
        }
        let top = libm::floor(self.adc_max_counts / self.adc_step_counts);
        libm::round(counts / self.adc_step_counts).clamp(0.0, top) * self.adc_step_counts
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use scenario::Override;

    /// A ring and the field that it is in.
    struct Lit {
        ring: Ring,
        field: FieldSpec,
    }

    impl Lit {
        fn read(&self, pose: &Pose) -> Light {
            self.ring.read(&self.field, 0, pose, 0)
        }
    }

    fn ring_of(scenario: &Scenario) -> Lit {
        Lit { ring: LightSensors::new(scenario).ring.unwrap(), field: scenario.field.clone() }
    }

    fn scenario(sets: &[&str]) -> Scenario {
        let text = "
            duration_s = 1
            step_s = 0.1
            arena.size_m = [4, 4]
            robots.count = 1
            channel.range_m = 1
            field.lamp = [{ position_m = [2, 2], peak = 500, half_distance_m = 0.5 }]
            light = { sensor = \"ring\", adc_step_counts = 1e-9 }
            controller = { gain_per_s = 1, gradient = \"fixed\", gradient_magnitude_per_m = 1000 }
        ";
        let sets: Vec<Override> = sets.iter().map(|set| set.parse().unwrap()).collect();
        Scenario::parse("test", text, &sets).unwrap_or_else(|error| panic!("{error}"))
    }

    fn read(sets: &[&str], at: ArenaPoint, heading: f64) -> Light {
        ring_of(&scenario(sets)).read(&Pose { position: at, heading })
    }

    /// Largest error of the bearing to a lamp, in degrees, over all headings.
    fn worst_bearing_deg(diodes: u32) -> f64 {
        let sets = [format!("light.diodes={diodes}")];
        let sets: Vec<&str> = sets.iter().map(String::as_str).collect();
        let ring = ring_of(&scenario(&sets));
        let at = ArenaPoint::new(1.0, 2.0);
        (0..3600)
            .map(|tenth| {
                let pose = Pose { position: at, heading: (f64::from(tenth) / 10.0).to_radians() };
                let Stimulus::Bearing(bearing) = ring.read(&pose).stimulus else { panic!("it is dark") };
                protocol::units::wrapped(bearing.get() + pose.heading).abs().to_degrees()
            })
            .fold(0.0, f64::max)
    }

    #[test]
    fn rings_of_4_6_and_8_tell_the_bearing_exactly_and_odd_ones_do_not() {
        for diodes in [4, 6, 8] {
            assert!(worst_bearing_deg(diodes) < 1e-5, "{diodes} diodes: {}", worst_bearing_deg(diodes));
        }
        assert!((worst_bearing_deg(5) - 8.3).abs() < 0.1, "{}", worst_bearing_deg(5));
        assert!((worst_bearing_deg(3) - 30.0).abs() < 0.1, "{}", worst_bearing_deg(3));
    }

    /// Largest error of the bearing, in degrees, and the least and the largest strength that a ring tells at so many
    /// meters from a lamp, over all headings; `None` where it sees nothing.
    fn worst(sets: &[&str], distance_m: f64) -> Option<(f64, [f64; 2])> {
        let ring = ring_of(&scenario(&[&["arena.size_m=[40, 4]", "light.adc_step_counts=1"], sets].concat()));
        let at = ArenaPoint::new(2.0 + distance_m, 2.0);
        (0..100_000).try_fold((0.0_f64, [f64::INFINITY, 0.0]), |(worst_deg, [least, most]), part| {
            let heading = std::f64::consts::PI + std::f64::consts::TAU * f64::from(part) / 1e5;
            let light = ring.read(&Pose { position: at, heading });
            let Stimulus::Bearing(bearing) = light.stimulus else { return None };
            let off = protocol::units::wrapped(bearing.get() + heading - std::f64::consts::PI);
            Some((worst_deg.max(off.abs().to_degrees()), [least.min(light.value), most.max(light.value)]))
        })
    }

    #[test]
    fn a_coarse_or_a_saturated_converter_costs_as_much_of_bearing_and_strength_as_the_guide_says() {
        const STRONGEST_M: f64 = 0.3 * std::f64::consts::FRAC_1_SQRT_2;
        let cases = [
            ("500", STRONGEST_M, 0.068, [499.46, 500.56]),
            ("500", 1.0, 0.31, [102.15, 103.28]),
            ("500", 2.0, 1.069, [27.8, 28.7]),
            ("500", 5.0, 3.804, [4.3, 5.0]),
            ("500", 10.0, 19.644, [0.9, 1.2]),
            ("2000", STRONGEST_M, 2.986, [1234.87, 1259.13]),
            ("5000", STRONGEST_M, 10.70, [1234.9, 1336.6]),
            ("500000", STRONGEST_M, 22.383, [1234.9, 1336.6]),
        ];
        for (peak, distance_m, worst_deg, strengths) in cases {
            let seen = worst(&[&format!("field.lamp.0.peak={peak}")], distance_m);
            println!("a lamp with a peak of {peak}, {distance_m} m away: {seen:?}");
            let (deg, seen) = seen.unwrap();
            assert!((deg - worst_deg).abs() < 0.01, "{peak}, {distance_m} m: {deg} degrees");
            assert!(
                (0..2).all(|end| (seen[end] - strengths[end]).abs() < 0.05),
                "{peak}, {distance_m} m: {seen:?}"
            );
        }
        // Half a step is darkness: seen in every heading up to here, from there on in none.
        assert!(worst(&[], 14.6).is_some() && worst(&[], 14.8).is_none());
        let facing = |distance_m: f64| {
            ring_of(&scenario(&["arena.size_m=[40, 4]", "light.adc_step_counts=1"]))
                .read(&Pose { position: ArenaPoint::new(2.0 + distance_m, 2.0), heading: 0.0 })
                .stimulus
        };
        assert!(facing(15.2) != Stimulus::None && facing(15.3) == Stimulus::None);
    }

    #[test]
    fn the_reading_is_strongest_at_the_height_over_root_two_and_then_it_is_the_peak() {
        let strongest = 0.3 / 2_f64.sqrt();
        let value = |d: f64| read(&["light.diodes=6"], ArenaPoint::new(2.0 - d, 2.0), 0.3).value;
        // Six clipped cosines add up to N/4 for every heading only nearly; facing two of them, exactly.
        assert!((value(strongest) / 500.0 - 1.0).abs() < 0.16, "{}", value(strongest));
        assert!(value(strongest) > value(0.8 * strongest) && value(strongest) > value(1.2 * strongest));
        assert!(value(0.0) < 1e-6, "under the lamp a side-facing diode sees nothing");
    }

    #[test]
    fn the_converter_saturates_and_rounds() {
        let bright = ["light.adc_max_counts=100", "light.adc_step_counts=10"];
        let ring = ring_of(&scenario(&bright)).ring;
        assert_eq!(ring.converted(1e6, 0, 0, 0), 100.0);
        assert_eq!(ring.converted(44.0, 0, 0, 0), 40.0);
        assert_eq!(ring.converted(-3.0, 0, 0, 0), 0.0);
        let coarse = ring_of(&scenario(&["light.adc_max_counts=1023", "light.adc_step_counts=4"])).ring;
        assert_eq!(coarse.converted(1e6, 0, 0, 0), 1020.0, "no reading is above the largest");
    }

    #[test]
    fn far_from_every_lamp_the_converter_sees_darkness_and_only_the_offset_is_left() {
        let dark = ["light.adc_step_counts=200", "field.offset=7"];
        let light = read(&dark, ArenaPoint::new(0.0, 0.0), 0.0);
        assert_eq!(light, Light { value: 7.0, stimulus: Stimulus::None });
    }

    #[test]
    fn mismatched_diodes_are_mismatched_the_same_way_every_time() {
        let sets = ["light.gain_mismatch=0.2"];
        let first = read(&sets, ArenaPoint::new(1.0, 1.0), 0.0);
        assert_eq!(first, read(&sets, ArenaPoint::new(1.0, 1.0), 0.0));
        assert_ne!(first, read(&[], ArenaPoint::new(1.0, 1.0), 0.0));
    }
}
