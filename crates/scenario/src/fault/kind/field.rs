//! `field`: the sensory function φ changes, from one tick to the next and for good.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::fault::drawer::Drawer;
use crate::fault::entry::Entry;
use crate::fault::nature::{Nature, Strikes, Timing, Window};
use crate::fault::parameters::Parameters;
use crate::light::{COUNTS_MAX, LightSpec, WIDTH_MIN_M};
use crate::number::{Finite, Positive, Xy};
use crate::problem::{Problem, ensure, problem};

/// Terms of φ of which a change names one.
const TERMS: [&str; 3] = ["lamp", "gaussian", "offset"];

/// The sensory function φ changes: a lamp, a Gaussian, or the constant Φ.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Field {
    /// The lamp that changes: its number among [[field.lamp]], from 0.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub lamp: Option<u32>,
    /// Where the lamp is from then on, [x, y] in meters.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub position_m: Option<Xy<Finite>>,
    /// Sensor counts at the lamp from then on.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub peak: Option<Finite>,
    /// Distance in meters at which half of the lamp's peak is left from then on.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub half_distance_m: Option<Positive>,
    /// The Gaussian that changes: its number among [[field.gaussian]], from 0.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub gaussian: Option<u32>,
    /// Center μ of the Gaussian from then on, [x, y] in meters.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub center_m: Option<Xy<Finite>>,
    /// Width σ of the Gaussian from then on, in meters.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sigma_m: Option<Positive>,
    /// Strength γ of the Gaussian from then on.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub gamma: Option<Finite>,
    /// The constant Φ from then on.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub offset: Option<Finite>,
}

/// A lamp or a Gaussian that a change names, and its keys.
struct Peak {
    /// Key that has its number.
    key: &'static str,
    number: u32,
    /// How many of its sort the field has.
    count: usize,
    /// Key of the list that has them.
    list: &'static str,
    keys: [&'static str; 3],
}

impl Parameters for Field {
    const NATURE: Nature = Nature { timing: Timing::ForGood, ..Nature::of(Strikes::Surroundings) };

    fn check(&self, entry: &Entry<'_>) -> Result<(), Problem> {
        let given = [self.lamp.is_some(), self.gaussian.is_some(), self.offset.is_some()];
        let mut terms = TERMS.iter().zip(given).filter_map(|(term, given)| given.then_some(*term));
        let (term, other) = (terms.next(), terms.next());
        entry.one_of(&TERMS, term.is_some())?;
        if let (Some(term), Some(other)) = (term, other) {
            let message =
                format!("a fault of kind \"field\" changes one term: give either `{term}` or `{other}`");
            return Err(entry.problem(&[other], message).hint("two faults may strike at the same `at_s`"));
        }
        self.check_keys(entry)?;
        self.check_numbers(entry)?;
        let is_ring = matches!(entry.setting.light, LightSpec::Ring(_));
        let peak = self.peak.map_or(0.0, Finite::get);
        ensure(!is_ring || peak >= 0.0, || {
            let message = format!("peak = {peak}: a diode sees no darkness; peaks are zero or more");
            entry.problem(&["peak"], message)
        })
    }

    fn drawn(draw: &mut Drawer<'_>, _: &Window) -> Self {
        let (lamps, gaussians) = (draw.setting.lamps as u64, draw.setting.gaussians as u64);
        let counts = draw.counts_max().min(COUNTS_MAX);
        let (term, given) = (draw.below(lamps + gaussians + 1), 1 + draw.below(7));
        let mut change = Self::default();
        if term < lamps {
            let is_ring = matches!(draw.setting.light, LightSpec::Ring(_));
            let seen = |peak: Finite| if is_ring { Finite::new(peak.get().abs()) } else { Some(peak) };
            change.lamp = Some(term as u32);
            change.position_m = (given & 1 > 0).then(|| draw.place());
            change.peak = (given & 2 > 0).then(|| draw.finite(counts).and_then(seen)).flatten();
            change.half_distance_m = (given & 4 > 0).then(|| draw.width()).flatten();
        } else if term < lamps + gaussians {
            change.gaussian = Some((term - lamps) as u32);
            change.center_m = (given & 1 > 0).then(|| draw.place());
            change.gamma = (given & 2 > 0).then(|| draw.finite(counts)).flatten();
            change.sigma_m = (given & 4 > 0).then(|| draw.width()).flatten();
        } else {
            change.offset = draw.finite(counts);
        }
        change
    }
}

impl Field {
    /// Checks that the term is there, and that what is given belongs to it and changes something.
    fn check_keys(&self, entry: &Entry<'_>) -> Result<(), Problem> {
        let peak = self.peak_of(entry);
        let own: &[&str] = peak.as_ref().map_or(&[], |peak| &peak.keys);
        let given = self.given();
        if let Some(stray) = given.iter().find(|key| !own.contains(key)) {
            let (term, hint) = match &peak {
                Some(peak) => (peak.key, format!("a {} has `{}`", peak.key, peak.keys.join("`, `"))),
                None => ("offset", "the offset is a number, and nothing else of it can change".into()),
            };
            return Err(entry
                .problem(&[stray], format!("`{stray}` has no meaning beside `{term}`"))
                .hint(hint));
        }
        let Some(Peak { key, number, count, list, keys }) = peak else { return Ok(()) };
        ensure((number as usize) < count, || {
            let there = match count {
                0 => "the field has none".into(),
                count => format!("the field has {count}, numbered from 0"),
            };
            problem(&[&entry.path(key), list], format!("there is no {key} {number}: {there}"))
        })?;
        ensure(!given.is_empty(), || {
            let message =
                format!("{key} {number} is given nothing to change: it needs one of `{}`", keys.join("`, `"));
            entry.problem(&[key], message)
        })
    }

    /// Checks that numbers are within the bounds of those of the field itself. Places have none: a lamp may hang outside.
    fn check_numbers(&self, entry: &Entry<'_>) -> Result<(), Problem> {
        let bounded = [
            ("peak", -COUNTS_MAX, self.peak.map(Finite::get)),
            ("half_distance_m", WIDTH_MIN_M, self.half_distance_m.map(Positive::get)),
            ("gamma", -COUNTS_MAX, self.gamma.map(Finite::get)),
            ("sigma_m", WIDTH_MIN_M, self.sigma_m.map(Positive::get)),
            ("offset", -COUNTS_MAX, self.offset.map(Finite::get)),
        ];
        bounded.into_iter().try_for_each(|(key, least, value)| entry.between(key, value, least, COUNTS_MAX))
    }

    fn peak_of(&self, entry: &Entry<'_>) -> Option<Peak> {
        let lamp = self.lamp.map(|number| Peak {
            key: "lamp",
            number,
            count: entry.setting.lamps,
            list: "field.lamp",
            keys: ["position_m", "peak", "half_distance_m"],
        });
        let gaussian = self.gaussian.map(|number| Peak {
            key: "gaussian",
            number,
            count: entry.setting.gaussians,
            list: "field.gaussian",
            keys: ["center_m", "sigma_m", "gamma"],
        });
        lamp.or(gaussian)
    }

    /// The keys of lamps and Gaussians that are given, but for their numbers.
    fn given(&self) -> Vec<&'static str> {
        let keys = [
            ("position_m", self.position_m.is_some()),
            ("peak", self.peak.is_some()),
            ("half_distance_m", self.half_distance_m.is_some()),
            ("center_m", self.center_m.is_some()),
            ("sigma_m", self.sigma_m.is_some()),
            ("gamma", self.gamma.is_some()),
        ];
        keys.into_iter().filter_map(|(key, given)| given.then_some(key)).collect()
    }
}
