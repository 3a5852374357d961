//! Running mean and spread, and how well a spread is known.

/// Mean and mean square of what was put in.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Moments {
    /// Values so far.
    pub count: u64,
    sum: f64,
    squares: f64,
}

impl Moments {
    /// Takes one value.
    #[inline]
    pub fn add(&mut self, value: f64) {
        self.count += 1;
        self.sum += value;
        self.squares += value * value;
    }

    /// Mean; `None` of nothing.
    pub fn mean(&self) -> Option<f64> {
        (self.count > 0).then(|| self.sum / self.count as f64)
    }

    /// Root of the mean square about zero.
    pub fn rms(&self) -> Option<f64> {
        (self.count > 0).then(|| (self.squares / self.count as f64).sqrt())
    }

    /// Standard deviation about the mean of all values.
    pub fn sigma(&self) -> Option<f64> {
        let mean = self.mean()?;
        Some((self.squares / self.count as f64 - mean * mean).max(0.0).sqrt())
    }
}

/// Relative standard error of a standard deviation from `freedom` independent values: 1/√(2ν), the normal
/// limit of χ².
///
/// A loop's error has about 4·B·t independent values in a time t; `analysis::expect::theory::linear` counts
/// them exactly.
pub fn relative_error(freedom: f64) -> f64 {
    1.0 / (2.0 * freedom).sqrt()
}
