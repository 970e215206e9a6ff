//! A few measurements of one thing: their median, and how far apart they lie.

use std::fmt;

/// Median, least and greatest of some measurements.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Spread {
    median: f64,
    least: f64,
    greatest: f64,
}

impl Spread {
    /// Of at least one value.
    pub(crate) fn of(values: impl IntoIterator<Item = f64>) -> Self {
        let mut values: Vec<f64> = values.into_iter().collect();
        values.sort_by(f64::total_cmp);
        let (&least, &greatest) = values.first().zip(values.last()).expect("there is something to sum up");
        let middle = values.len() / 2;
        let median = match values.len() % 2 {
            1 => values[middle],
            _ => values[middle - 1].midpoint(values[middle]),
        };
        Self { median, least, greatest }
    }

    /// The median alone.
    pub(crate) fn median(&self) -> f64 {
        self.median
    }

    /// The least alone.
    pub(crate) fn least(&self) -> f64 {
        self.least
    }

    /// The greatest alone.
    pub(crate) fn greatest(&self) -> f64 {
        self.greatest
    }
}

/// `12.5 (11–14)`, with three figures of the median and two of the others.
impl fmt::Display for Spread {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { median, least, greatest } = *self;
        write!(f, "{} ({}–{})", figures(median, 3), figures(least, 2), figures(greatest, 2))
    }
}

/// `value` with `count` significant figures; digits before the point are never cut.
pub(crate) fn figures(value: f64, count: i32) -> String {
    let before_point = match value {
        0.0 => 1,
        value => value.abs().log10().floor() as i32 + 1,
    };
    format!("{value:.*}", (count - before_point).max(0) as usize)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_median_of_an_even_number_lies_between_the_two_in_the_middle() {
        assert_eq!(Spread::of([4.0, 1.0, 2.0]).median(), 2.0);
        assert_eq!(Spread::of([4.0, 1.0, 2.0, 3.0]).median(), 2.5);
    }

    #[test]
    fn a_spread_shows_no_more_figures_than_it_knows() {
        assert_eq!(Spread::of([11.26, 12.345, 14.0]).to_string(), "12.3 (11–14)");
        assert_eq!(Spread::of([0.512, 1.0, 8123.4]).to_string(), "1.00 (0.51–8123)");
    }
}
