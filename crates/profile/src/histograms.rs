//! Histograms of one robot, or of all: one of nanoseconds for each thing that is measured.

use hdrhistogram::Histogram;
use serde::{Deserialize, Serialize};

use super::cycle_times::Stage;

/// Significant digits: a value is known to 1 in 128, and a histogram of up to 4 ms takes 8 kB.
const DIGITS: u8 = 2;

/// A quantity that is measured.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Span {
    /// One stage of the cycle.
    Stage(Stage),
    /// From wake-up until the command was sent.
    Cycle,
    /// Transport time of a packet, beyond what is modeled.
    Packet,
    /// How much later or earlier in its period an agent wakes up than the time before.
    Jitter,
}

impl Span {
    /// Everything that is measured, in the order of outputs.
    pub const ALL: [Self; 11] = [
        Self::Stage(Stage::Wake),
        Self::Stage(Stage::Receive),
        Self::Stage(Stage::Neighbors),
        Self::Stage(Stage::Cell),
        Self::Stage(Stage::Truncation),
        Self::Stage(Stage::Centroid),
        Self::Stage(Stage::Step),
        Self::Stage(Stage::Publish),
        Self::Cycle,
        Self::Packet,
        Self::Jitter,
    ];

    /// As outputs spell it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Stage(stage) => stage.name(),
            Self::Cycle => "cycle",
            Self::Packet => "packet",
            Self::Jitter => "jitter",
        }
    }

    /// Place in [`Span::ALL`].
    pub fn index(self) -> usize {
        match self {
            Self::Stage(stage) => stage as usize,
            Self::Cycle => 8,
            Self::Packet => 9,
            Self::Jitter => 10,
        }
    }
}

/// A histogram for each [`Span`], nanoseconds. Each is as large as its largest value needs.
#[derive(Clone, Debug)]
pub struct Histograms([Histogram<u32>; Span::ALL.len()]);

impl Default for Histograms {
    fn default() -> Self {
        let empty = || Histogram::new(DIGITS).expect("the digits are valid");
        Self(std::array::from_fn(|_| empty()))
    }
}

impl Histograms {
    /// Of one thing that is measured.
    pub fn of(&self, span: Span) -> &Histogram<u32> {
        &self.0[span.index()]
    }

    /// Adds `count` times a value, nanoseconds.
    pub fn record(&mut self, span: Span, ns: u64, count: u32) {
        // An automatic histogram refuses only what does not fit into an address space.
        let _ = self.0[span.index()].record_n(ns, count);
    }

    /// Adds what another one holds.
    pub fn add(&mut self, other: &Self) {
        for (all, one) in self.0.iter_mut().zip(&other.0) {
            // As for `record`.
            let _ = all.add(one);
        }
    }
}

/// A histogram in a few numbers, microseconds.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Spread {
    /// Median.
    pub p50: f64,
    /// 99th percentile.
    pub p99: f64,
    /// Longest.
    pub max: f64,
}

impl Spread {
    /// Of a histogram of nanoseconds; `None` if it is empty.
    pub fn of(ns: &Histogram<u32>) -> Option<Self> {
        let us = |ns: u64| ns as f64 / 1e3;
        let at = |quantile| us(ns.value_at_quantile(quantile));
        (!ns.is_empty()).then(|| Self { p50: at(0.5), p99: at(0.99), max: us(ns.max()) })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_span_has_a_place_and_a_name_of_its_own() {
        for (index, span) in Span::ALL.into_iter().enumerate() {
            assert_eq!(span.index(), index);
            assert_eq!(Span::ALL.iter().filter(|other| other.name() == span.name()).count(), 1);
        }
    }

    #[test]
    fn all_is_the_sum_of_the_parts() {
        let (mut all, mut one) = (Histograms::default(), Histograms::default());
        all.record(Span::Packet, 5, 1);
        one.record(Span::Packet, 7_000_000_000, 1);
        all.add(&one);
        let packet = all.of(Span::Packet);
        assert_eq!((packet.len(), packet.min()), (2, 5));
        assert!(packet.equivalent(packet.max(), 7_000_000_000));
    }
}
