//! What is known of one robot, or of all: a histogram of nanoseconds for each thing that is measured.

use hdrhistogram::Histogram;
use serde::Serialize;

use super::cycle_times::{CycleTimes, Stage};

/// Significant digits: a value is known to 1 in 128, and a histogram of up to 4 ms takes 8 kB.
const DIGITS: u8 = 2;

/// What is measured.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Span {
    /// One stage of the cycle.
    Stage(Stage),
    /// From wake-up until the command was sent.
    Cycle,
    /// What carrying a packet took beyond what is modeled.
    Packet,
    /// How much later or earlier in its period an agent wakes up than the time before.
    Jitter,
}

impl Span {
    /// Everything that is measured, in the order of outputs.
    pub const ALL: [Self; 10] = [
        Self::Stage(Stage::Wake),
        Self::Stage(Stage::Receive),
        Self::Stage(Stage::Neighbors),
        Self::Stage(Stage::Cell),
        Self::Stage(Stage::Truncation),
        Self::Stage(Stage::Centroid),
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
    fn index(self) -> usize {
        match self {
            Self::Stage(stage) => stage as usize,
            Self::Cycle => 7,
            Self::Packet => 8,
            Self::Jitter => 9,
        }
    }
}

/// A histogram for each [`Span`], nanoseconds. Each grows with the largest value seen and no further.
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

    /// One more value, nanoseconds.
    pub(super) fn record(&mut self, span: Span, ns: u64) {
        // An automatic histogram refuses only what does not fit into an address space.
        let _ = self.0[span.index()].record(ns);
    }

    /// All stages of all `rows`, histogram by histogram.
    pub(super) fn fold(&mut self, rows: &[CycleTimes]) {
        for stage in Stage::ALL {
            let span = Span::Stage(stage);
            rows.iter().for_each(|row| self.record(span, row.stage_ns(stage).into()));
        }
        rows.iter().for_each(|row| self.record(Span::Cycle, row.cycle_ns()));
    }

    /// Adds what another one holds.
    pub(super) fn add(&mut self, other: &Self) {
        for (all, one) in self.0.iter_mut().zip(&other.0) {
            // As for `record`.
            let _ = all.add(one);
        }
    }
}

/// Gathers many values of one histogram before it is touched: a place in here is the same range of values as there,
/// and costs less to find.
#[derive(Clone, Debug)]
pub(super) struct Tally {
    counts: Vec<u32>,
    /// The first place in use, and the one after the last.
    used: (usize, usize),
}

/// Values that differ by less than 1 in so many are one; the same for a histogram of [`DIGITS`] digits.
const PARTS: usize = 128;

impl Tally {
    const UNUSED: (usize, usize) = (usize::MAX, 0);

    /// Of no values.
    pub(super) fn new() -> Self {
        Self { counts: vec![0; place(u64::MAX) + 1], used: Self::UNUSED }
    }

    /// One more value.
    #[inline]
    pub(super) fn add(&mut self, value: u64) {
        let place = place(value);
        self.counts[place] += 1;
        self.used = (self.used.0.min(place), self.used.1.max(place + 1));
    }

    /// Moves all values to a histogram.
    pub(super) fn pour(&mut self, into: &mut Histograms, span: Span) {
        let (begin, end) = std::mem::replace(&mut self.used, Self::UNUSED);
        for place in begin..end {
            let count = std::mem::take(&mut self.counts[place]);
            if count > 0 {
                // As for `Histograms::record`.
                let _ = into.0[span.index()].record_n(lowest(place), count);
            }
        }
    }
}

/// Exact below 2 × [`PARTS`]; above that, each power of two has [`PARTS`] places.
#[inline]
fn place(value: u64) -> usize {
    let shift = (u64::BITS - (value | (2 * PARTS as u64 - 1)).leading_zeros()) as usize - 8;
    shift * PARTS + (value >> shift) as usize
}

/// The least value of a place.
fn lowest(place: usize) -> u64 {
    let shift = (place / PARTS).saturating_sub(1);
    ((place - shift * PARTS) as u64) << shift
}

/// A histogram in a few numbers, microseconds.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
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
    fn rows_fold_into_stages_and_their_sum() {
        let row = |scale: u32| CycleTimes {
            robot: 0,
            tick: 0,
            woke_ns: 0,
            stages_ns: std::array::from_fn(|stage| scale * (stage as u32 + 1)),
        };
        let mut histograms = Histograms::default();
        histograms.fold(&[row(10), row(1000)]);
        let wake = histograms.of(Span::Stage(Stage::Wake));
        assert_eq!((wake.len(), wake.min(), wake.equivalent(wake.max(), 1000)), (2, 10, true));
        // Wake-up is before the cycle: 2 + ... + 7 = 27.
        let cycle = histograms.of(Span::Cycle);
        assert!(cycle.equivalent(cycle.min(), 270) && cycle.equivalent(cycle.max(), 27_000));
        assert!(histograms.of(Span::Packet).is_empty());
        assert_eq!(Spread::of(histograms.of(Span::Packet)), None);
    }

    #[test]
    fn a_tally_pours_the_same_histogram() {
        let values: Vec<u64> =
            (0..4000_u64).map(|k| k * k * k % 9_000_001).chain([0, 1, 255, 256, 257]).collect();
        let (mut tally, mut one_by_one, mut poured) =
            (Tally::new(), Histograms::default(), Histograms::default());
        for part in values.chunks(1001) {
            part.iter().for_each(|&value| tally.add(value));
            tally.pour(&mut poured, Span::Packet);
        }
        values.iter().for_each(|&value| one_by_one.record(Span::Packet, value));
        assert_eq!(poured.of(Span::Packet), one_by_one.of(Span::Packet));
        tally.pour(&mut poured, Span::Packet);
        assert_eq!(poured.of(Span::Packet).len(), values.len() as u64, "it is empty by then");
    }

    #[test]
    fn a_place_begins_at_its_lowest_value() {
        for shift in 0..64 {
            for value in [(1_u64 << shift) - 1, 1 << shift, (1 << shift) + (1 << shift) / 3] {
                let begin = lowest(place(value));
                assert_eq!(place(begin), place(value), "{value}");
                assert!(begin <= value && value - begin <= value / 128, "{value} from {begin}");
            }
        }
    }

    #[test]
    fn all_is_the_sum_of_the_parts() {
        let (mut all, mut one) = (Histograms::default(), Histograms::default());
        all.record(Span::Packet, 5);
        one.record(Span::Packet, 7_000_000_000);
        all.add(&one);
        let packet = all.of(Span::Packet);
        assert_eq!((packet.len(), packet.min()), (2, 5));
        assert!(packet.equivalent(packet.max(), 7_000_000_000));
    }
}
