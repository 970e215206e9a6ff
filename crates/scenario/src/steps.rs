//! Times in whole steps: bounded, rounded, and what was rounded.
//!
//! In:  times as they were written.
//! Out: whole numbers of steps, and a [`Rounded`] for each time that was none; or a time that is too long to be counted.

use std::fmt;

use super::error::Place;
use super::problem::{Problem, ensure, problem};

/// Most steps in any time of a scenario: three years at 10 Hz, eleven days at 1 kHz. Floating point tells that many
/// apart with six digits to spare, so no step is lost to rounding.
pub const STEPS_MAX: u64 = 1_000_000_000;

/// Largest difference between the quotient of two decimal numbers and the whole number that was meant.
pub(super) const ROUNDING: f64 = 1e-9;
/// The same for large quotients, as a share: a few units in the last place.
const ROUNDING_SHARE: f64 = 4.0 * f64::EPSILON;

/// A time that is no whole number of steps, and the one that is run in its place.
#[derive(Clone, Debug)]
pub struct Rounded {
    place: Place,
    path: String,
    written_s: f64,
    step_s: f64,
    steps: u64,
}

/// Every time of a scenario that was rounded: no part of what the scenario means, so all such lists are equal.
#[derive(Clone, Debug, Default)]
pub struct Roundings(pub Vec<Rounded>);

impl fmt::Display for Rounded {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { place, path, written_s, step_s, steps } = self;
        let plural = if *steps == 1 { "" } else { "s" };
        write!(
            f,
            "{place}: {path} = {written_s} is not a whole number of steps of {step_s} s: {steps} step{plural}, {} s, \
             will be run",
            time_of(*steps, *step_s)
        )
    }
}

impl PartialEq for Roundings {
    fn eq(&self, _: &Self) -> bool {
        true
    }
}

/// The whole number in a quotient of two decimal numbers, rounded down.
pub(super) fn whole_part(quotient: f64) -> u64 {
    (quotient + slack(quotient)) as u64
}

/// The whole number of steps that is nearest to a time.
pub(super) fn nearest(time_s: f64, step_s: f64) -> u64 {
    (time_s / step_s).round() as u64
}

/// When step `steps` is, seconds; in nine decimals if these say it but for rounding.
pub(super) fn time_of(steps: u64, step_s: f64) -> f64 {
    let exact = steps as f64 * step_s;
    let decimal = (exact * 1e9).round() / 1e9;
    if (decimal - exact).abs() <= ROUNDING_SHARE * exact { decimal } else { exact }
}

/// Times on their way to whole numbers of steps.
pub(super) struct Settling<'a> {
    pub(super) step_s: f64,
    /// Knows where a value was written, if it was.
    pub(super) place_of: &'a dyn Fn(&str) -> Option<Place>,
    pub(super) rounded: Vec<Rounded>,
}

impl Settling<'_> {
    /// Makes a time a whole number of steps, at least `steps_min`.
    pub(super) fn settle<T>(
        &mut self,
        path: &str,
        steps_min: u64,
        time: Option<&mut T>,
    ) -> Result<(), Problem>
    where
        T: Copy + Into<f64> + TryFrom<f64, Error: fmt::Debug>,
    {
        let Some(time) = time else { return Ok(()) };
        let (written_s, step_s): (f64, f64) = ((*time).into(), self.step_s);
        self.bound(path, written_s)?;
        let steps = nearest(written_s, step_s).max(steps_min);
        if is_near(written_s / step_s, steps) {
            return Ok(());
        }
        *time = time_of(steps, step_s).try_into().expect("a step is longer than nothing");
        // Nobody wonders at a default.
        if let Some(place) = (self.place_of)(path) {
            self.rounded.push(Rounded { place, path: path.into(), written_s, step_s, steps });
        }
        Ok(())
    }

    /// Refuses a time that is too long to be counted. A default is not refused: it is longer than any run.
    pub(super) fn bound(&self, path: &str, time_s: f64) -> Result<(), Problem> {
        let step_s = self.step_s;
        let longest_s = STEPS_MAX as f64 * step_s;
        ensure(time_s <= longest_s || (self.place_of)(path).is_none(), || {
            let message = format!(
                "{path} = {time_s:?} is more than {STEPS_MAX} steps of {step_s:?} s, the most that are counted; \
                 use {longest_s:?} or less, or a longer step_s"
            );
            problem(&[path, "step_s"], message)
        })
    }
}

fn is_near(quotient: f64, steps: u64) -> bool {
    (quotient - steps as f64).abs() <= slack(quotient)
}

fn slack(quotient: f64) -> f64 {
    ROUNDING.max(ROUNDING_SHARE * quotient)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_time_is_said_in_few_decimals_only_where_these_are_it() {
        assert_eq!((time_of(3, 0.1), time_of(1200, 0.1)), (0.3, 120.0));
        let step_s = 0.27442613609124994;
        assert_eq!((time_of(1, step_s), time_of(7, step_s)), (step_s, 7.0 * step_s), "not 0.274426136");
    }
}
