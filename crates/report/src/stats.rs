//! Mean, spread and quantiles of a few numbers.

/// Summary statistics of a sample.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stats {
    /// How many numbers there are.
    pub count: usize,
    /// Their mean.
    pub mean: f64,
    /// Their standard deviation (n − 1); zero for a single number.
    pub sd: f64,
}

impl Stats {
    /// Of the finite ones among `values`; `None` without any.
    pub fn of(values: &[f64]) -> Option<Self> {
        let finite = finite(values);
        let count = finite.len();
        if count == 0 {
            return None;
        }
        let mean = finite.iter().sum::<f64>() / count as f64;
        let squares: f64 = finite.iter().map(|value| (value - mean) * (value - mean)).sum();
        let sd = if count > 1 { (squares / (count - 1) as f64).sqrt() } else { 0.0 };
        Some(Self { count, mean, sd })
    }

    /// Standard error of the mean.
    pub fn se(&self) -> f64 {
        self.sd / (self.count as f64).sqrt()
    }
}

/// The quantile at `share` (0 to 1) of the finite ones among `values`, linear between ranks.
pub fn quantile(values: &[f64], share: f64) -> Option<f64> {
    let mut sorted = finite(values);
    sorted.sort_by(f64::total_cmp);
    let last = sorted.len().checked_sub(1)?;
    let rank = share * last as f64;
    let (below, part) = (rank.floor() as usize, rank.fract());
    let above = (below + 1).min(last);
    Some(sorted[below] + part * (sorted[above] - sorted[below]))
}

fn finite(values: &[f64]) -> Vec<f64> {
    values.iter().copied().filter(|value| value.is_finite()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn mean_and_spread_of_a_known_sample() {
        let stats = Stats::of(&[2.0, 4.0, 4.0, 4.0, 5.0, 5.0, 7.0, 9.0, f64::NAN]).unwrap();
        assert_eq!((stats.count, stats.mean), (8, 5.0));
        assert!((stats.sd - (32.0_f64 / 7.0).sqrt()).abs() < 1e-15);
        assert!((stats.se() - (4.0_f64 / 7.0).sqrt()).abs() < 1e-15);
    }

    #[test]
    fn a_single_number_has_no_spread_and_none_has_no_mean() {
        assert_eq!(Stats::of(&[3.0]).unwrap().sd, 0.0);
        assert!(Stats::of(&[]).is_none() && quantile(&[], 0.5).is_none());
    }

    #[test]
    fn quantiles_lie_linear_between_ranks() {
        let values = [4.0, 1.0, 3.0, 2.0];
        assert_eq!(quantile(&values, 0.0), Some(1.0));
        assert_eq!(quantile(&values, 0.5), Some(2.5));
        assert_eq!(quantile(&values, 1.0), Some(4.0));
    }
}
