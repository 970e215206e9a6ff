//! Quantiles of the last few seconds, and count and sum of all there has been.

use std::time::{Duration, Instant};

use hdrhistogram::Histogram;
use serde::{Deserialize, Serialize};

/// Significant digits: a value is known to 1 in 128.
const DIGITS: u8 = 2;
/// A window holds what has come in the last one to two of these.
const TURN: Duration = Duration::from_secs(5);

/// Times of the last 5 to 10 s.
#[derive(Clone, Debug)]
pub struct Window {
    now: Histogram<u32>,
    before: Histogram<u32>,
    turned: Instant,
    count: u64,
    sum_ns: u64,
}

/// Quantiles, count and sum of a [`Window`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Quantiles {
    /// Median of the last 5 to 10 s, microseconds.
    pub p50_us: f64,
    /// 90th percentile.
    pub p90_us: f64,
    /// 99th percentile.
    pub p99_us: f64,
    /// Longest.
    pub max_us: f64,
    /// How many there have been since it was first watched.
    pub count: u64,
    /// Their sum, seconds.
    pub sum_s: f64,
}

impl Window {
    /// Opens `now`.
    pub fn new(now: Instant) -> Self {
        let empty = || Histogram::new(DIGITS).expect("the digits are valid");
        Self { now: empty(), before: empty(), turned: now, count: 0, sum_ns: 0 }
    }

    /// One more value, nanoseconds.
    pub fn record(&mut self, ns: u64) {
        // An automatic histogram refuses only what does not fit into an address space.
        let _ = self.now.record(ns);
        self.count += 1;
        self.sum_ns = self.sum_ns.saturating_add(ns);
    }

    /// It is `now`: what is too old is forgotten. `None` if there is nothing in the window.
    pub fn quantiles(&mut self, now: Instant) -> Option<Quantiles> {
        let age = now.saturating_duration_since(self.turned);
        if age >= TURN {
            std::mem::swap(&mut self.now, &mut self.before);
            self.now.reset();
            if age >= 2 * TURN {
                self.before.reset();
            }
            self.turned = now;
        }
        let mut all = self.before.clone();
        // As for `record`.
        let _ = all.add(&self.now);
        let us = |ns: u64| ns as f64 / 1e3;
        let at = |quantile| us(all.value_at_quantile(quantile));
        (!all.is_empty()).then(|| Quantiles {
            p50_us: at(0.5),
            p90_us: at(0.9),
            p99_us: at(0.99),
            max_us: us(all.max()),
            count: self.count,
            sum_s: self.sum_ns as f64 / 1e9,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_old_is_forgotten_but_counted() {
        let start = Instant::now();
        let mut window = Window::new(start);
        assert_eq!(window.quantiles(start), None);
        (0..99).for_each(|_| window.record(1_000));
        window.record(1_000_000);
        let all = window.quantiles(start + TURN).unwrap();
        assert!(
            (all.p50_us - 1.0).abs() < 0.01 && all.count == 100 && (all.max_us - 1000.0).abs() < 8.0,
            "{all:?}"
        );
        assert!((all.sum_s - 0.001_099).abs() < 1e-12, "{all:?}");
        (0..10).for_each(|_| window.record(2_000_000));
        let later = window.quantiles(start + 2 * TURN).unwrap();
        assert!((later.p50_us - 2000.0).abs() < 16.0 && later.count == 110, "{later:?}");
        assert_eq!(window.quantiles(start + 4 * TURN), None);
    }
}
