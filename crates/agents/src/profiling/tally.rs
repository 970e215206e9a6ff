//! How often each value has come, while a run lasts; as histograms once it has ended.
//!
//! A tick of a thousand robots brings some 40,000 values. [`hdrhistogram`] takes some 16 ns for each, more than half
//! of what all of recording may cost. A place in here is the same range of values as there, and costs less to find.

use profile::{CycleTimes, Histograms, Span, Stage};

/// Values that differ by less than 1 in so many are one, as in [`Histograms`].
const PARTS: usize = 128;

/// A tally for each [`Span`], nanoseconds. Each grows with the largest value seen and no further.
#[derive(Clone, Debug, Default)]
pub(super) struct Tallies([Tally; Span::ALL.len()]);

impl Tallies {
    /// Returns the tally of one quantity.
    pub(super) fn of(&mut self, span: Span) -> &mut Tally {
        &mut self.0[span.index()]
    }

    /// All stages of all `rows`, tally by tally.
    pub(super) fn fold(&mut self, rows: &[CycleTimes]) {
        for stage in Stage::ALL {
            let tally = self.of(Span::Stage(stage));
            rows.iter().for_each(|row| tally.add(row.stage_ns(stage).into()));
        }
        let tally = self.of(Span::Cycle);
        rows.iter().for_each(|row| tally.add(row.cycle_ns()));
    }

    /// The same values as histograms.
    pub(super) fn histograms(&self) -> Histograms {
        let mut histograms = Histograms::default();
        for (span, tally) in Span::ALL.into_iter().zip(&self.0) {
            let counted = tally.counts.iter().enumerate().filter(|&(_, &count)| count > 0);
            counted.for_each(|(place, &count)| histograms.record(span, lowest(place), count));
        }
        histograms
    }
}

/// How often each value has come.
#[derive(Clone, Debug, Default)]
pub(super) struct Tally {
    counts: Vec<u32>,
}

impl Tally {
    /// One more value.
    #[inline]
    pub(super) fn add(&mut self, value: u64) {
        let place = place(value);
        if place >= self.counts.len() {
            self.grow(place);
        }
        self.counts[place] = self.counts[place].saturating_add(1);
    }

    /// Makes room for the power of two that `place` is in.
    #[cold]
    fn grow(&mut self, place: usize) {
        self.counts.resize((place + 1).next_multiple_of(PARTS), 0);
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_fold_into_stages_and_their_sum() {
        let row = |scale: u32| CycleTimes {
            robot: 0,
            tick: 0,
            woke_ns: 0,
            stages_ns: std::array::from_fn(|stage| scale * (stage as u32 + 1)),
            packet: None,
        };
        let mut tallies = Tallies::default();
        tallies.fold(&[row(10), row(1000)]);
        let histograms = tallies.histograms();
        let wake = histograms.of(Span::Stage(Stage::Wake));
        assert_eq!((wake.len(), wake.min(), wake.equivalent(wake.max(), 1000)), (2, 10, true));
        // Wake-up is before the cycle: 2 + ... + 8 = 35.
        let cycle = histograms.of(Span::Cycle);
        assert!(cycle.equivalent(cycle.min(), 350) && cycle.equivalent(cycle.max(), 35_000));
        assert!(histograms.of(Span::Packet).is_empty());
    }

    #[test]
    fn a_tally_is_the_same_histogram() {
        let values: Vec<u64> =
            (0..4000_u64).map(|k| k * k * k % 9_000_001).chain([0, 1, 255, 256, 257]).collect();
        let (mut tallies, mut one_by_one) = (Tallies::default(), Histograms::default());
        for &value in &values {
            tallies.of(Span::Packet).add(value);
            one_by_one.record(Span::Packet, value, 1);
        }
        assert_eq!(tallies.histograms().of(Span::Packet), one_by_one.of(Span::Packet));
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
    fn the_longest_time_there_is_has_a_place() {
        let mut tallies = Tallies::default();
        tallies.of(Span::Jitter).add(u64::MAX);
        assert_eq!(tallies.histograms().of(Span::Jitter).len(), 1);
    }
}
