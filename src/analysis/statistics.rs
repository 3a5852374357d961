//! Mean, spread and percentiles of a list of numbers.
//!
//! Every function gives `None` for an empty list and leaves out what is not finite, so that one
//! bad row cannot hide the rest. Source of the percentile: linear interpolation between order
//! statistics at rank p(n − 1), Hyndman and Fan's type 7.

/// Mean, standard deviation and 95 % figure of one error.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Spread {
    /// Number of the values.
    pub count: usize,
    /// Mean of the values.
    pub mean: f64,
    /// Standard deviation about the mean (n − 1 in the divisor; 0 for one value).
    pub sigma: f64,
    /// 95th percentile of the magnitude.
    pub p95: f64,
}

/// The larger of two numbers in their total order, where there is one before; of equal ones the later.
pub fn larger(before: Option<f64>, new: f64) -> Option<f64> {
    Some(before.filter(|before| before.total_cmp(&new).is_gt()).unwrap_or(new))
}

/// A mean in the making, of numbers that need not be held.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sum {
    count: usize,
    sum: f64,
    squares: f64,
}

impl Default for Sum {
    fn default() -> Self {
        // As the sum of an iterator begins, so that zeros keep their sign.
        Self { count: 0, sum: -0.0, squares: -0.0 }
    }
}

impl Sum {
    /// Counts one in.
    pub fn add(&mut self, value: f64) {
        if value.is_finite() {
            *self = Self { count: self.count + 1, sum: self.sum + value, squares: self.squares + value * value };
        }
    }

    /// Number of the finite values.
    pub fn count(&self) -> usize {
        self.count
    }

    /// Sum of their squares.
    pub fn squares(&self) -> f64 {
        self.squares
    }

    /// Mean of the values, as in [`mean`].
    pub fn mean(&self) -> Option<f64> {
        (self.count > 0).then(|| self.sum / self.count as f64)
    }

    /// Root mean square of the values, as in [`rms`].
    pub fn rms(&self) -> Option<f64> {
        (self.count > 0).then(|| (self.squares / self.count as f64).sqrt())
    }
}

fn finite(values: &[f64]) -> impl Iterator<Item = f64> + '_ {
    values.iter().copied().filter(|value| value.is_finite())
}

/// Arithmetic mean.
pub fn mean(values: &[f64]) -> Option<f64> {
    let count = finite(values).count();
    (count > 0).then(|| finite(values).sum::<f64>() / count as f64)
}

/// Root of the mean square about zero.
pub fn rms(values: &[f64]) -> Option<f64> {
    let count = finite(values).count();
    (count > 0).then(|| (finite(values).map(|value| value * value).sum::<f64>() / count as f64).sqrt())
}

/// Standard deviation about the mean, n − 1 in the divisor; 0 for one value.
pub fn std(values: &[f64]) -> Option<f64> {
    let mean = mean(values)?;
    let count = finite(values).count();
    let squares: f64 = finite(values).map(|value| (value - mean) * (value - mean)).sum();
    Some(deviation(squares, count))
}

/// Standard deviation of so many values whose squares about their mean have that sum.
pub(crate) fn deviation(squares: f64, count: usize) -> f64 {
    let freedom = planted!("analysis.statistics.deviation", count - 1, 2 * count);
    if count > 1 { (squares / freedom as f64).sqrt() } else { 0.0 }
}

/// The value below which a share `p` (0 to 1) of the list lies.
pub fn percentile(values: &[f64], p: f64) -> Option<f64> {
    let mut sorted: Vec<f64> = finite(values).collect();
    sorted.sort_by(f64::total_cmp);
    ranked(&sorted, p)
}

/// [`percentile`] of a list that is finite and sorted already.
pub fn ranked(sorted: &[f64], p: f64) -> Option<f64> {
    let rank = rank(sorted.len(), p)?;
    let below = *sorted.get(rank.floor() as usize)?;
    let above = *sorted.get(rank.ceil() as usize)?;
    Some(below + (above - below) * (rank - rank.floor()))
}

/// Rank of that percentile among so many values; none of none.
pub(crate) fn rank(count: usize, p: f64) -> Option<f64> {
    let p = planted!("analysis.statistics.percentile", p, p * p);
    Some(p.clamp(0.0, 1.0) * count.checked_sub(1)? as f64)
}

/// The middle value.
pub fn median(values: &[f64]) -> Option<f64> {
    percentile(values, 0.5)
}

/// Mean, σ and 95 % of the magnitude.
pub fn spread(values: &[f64]) -> Option<Spread> {
    let magnitudes: Vec<f64> = finite(values).map(f64::abs).collect();
    Some(Spread {
        count: magnitudes.len(),
        mean: mean(values)?,
        sigma: std(values)?,
        p95: percentile(&magnitudes, 0.95)?,
    })
}

/// Standard deviation of several groups together, each about its own mean.
pub fn pooled_std<'a>(groups: impl IntoIterator<Item = &'a [f64]>) -> Option<f64> {
    let (mut squares, mut freedom) = (0.0, 0);
    for group in groups {
        let count = finite(group).count();
        if let (Some(sigma), true) = (std(group), count > 1) {
            squares += sigma * sigma * (count - 1) as f64;
            freedom += count - 1;
        }
    }
    (freedom > 0).then(|| (squares / freedom as f64).sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn known_answers() {
        let values = [2.0, 4.0, 4.0, 4.0, 5.0, 5.0, 7.0, 9.0];
        assert_eq!(mean(&values), Some(5.0));
        assert!((std(&values).unwrap() - (32.0_f64 / 7.0).sqrt()).abs() < 1e-15);
        assert!((rms(&values).unwrap() - 29.0_f64.sqrt()).abs() < 1e-15);
        // Rank 0.95 * 7 = 6.65 lies between 7 and 9.
        assert!((percentile(&values, 0.95).unwrap() - 8.3).abs() < 1e-12);
        assert_eq!(median(&[3.0, 1.0, 2.0]), Some(2.0));
        assert_eq!(percentile(&[1.0, 2.0], 1.0), Some(2.0));
        let mut sum = Sum::default();
        assert_eq!((sum.mean(), sum.rms()), (None, None));
        values.iter().chain(&[f64::NAN]).for_each(|value| sum.add(*value));
        assert_eq!((sum.mean(), sum.rms()), (mean(&values), rms(&values)));
        let spread = spread(&[-3.0, 1.0]).unwrap();
        assert_eq!((spread.count, spread.mean), (2, -1.0));
        assert!((spread.p95 - 2.9).abs() < 1e-12);
    }

    #[test]
    fn groups_are_pooled_about_their_own_means() {
        // Sums of squares 2 and 8 with 1 and 1 degrees of freedom.
        let groups: [&[f64]; 3] = [&[1.0, 3.0], &[100.0, 104.0], &[7.0]];
        assert_eq!(pooled_std(groups), Some(5.0_f64.sqrt()));
    }

    #[test]
    fn nothing_gives_nothing_and_one_bad_value_hides_no_other() {
        assert_eq!((mean(&[]), std(&[]), rms(&[]), percentile(&[], 0.5)), (None, None, None, None));
        assert!(spread(&[f64::NAN]).is_none());
        assert_eq!(mean(&[f64::NAN, 3.0]), Some(3.0));
    }
}
