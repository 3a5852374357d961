//! Taps of one question: the noise that they share, and their positions among other satellites' chips.
//!
//! A receiver asks at the same taps for millions of code periods, so what depends on them alone is computed
//! once. Taps far from the prompt correlate with nothing.

use std::sync::OnceLock;

use gnss::signal::PeakTable;

/// Taps of one question, at most.
pub(super) const MOST: usize = 8;
/// Taps that other satellites' chips are looked up for at once.
pub(super) const LANES: usize = 4;
/// Taps that correlate with each other lie within this of the prompt, in chips.
const NEAR_CHIPS: f64 = 4.0;
/// Positions of a tap between two chips.
pub(super) const POSITIONS: usize = 128;
/// Steps a chip at which the width of a chip's correlation is looked for.
const STEPS: u32 = 64;
/// Sets of taps that are kept.
const SETS: usize = 8;

/// Taps near the prompt.
#[derive(Debug)]
pub(super) struct Taps {
    chips: Vec<f64>,
    /// Indices from the prompt outwards.
    pub order: Vec<usize>,
    /// Factors of the noise's covariance, one row for each of [`Self::order`].
    pub factors: [[f64; MOST]; MOST],
    /// First chip about the prompt's that any tap meets, and their number.
    pub first: i64,
    pub count: usize,
    /// Shares of these chips at each position between two: one row of taps for each chip.
    weights: Vec<[f32; LANES]>,
}

impl Taps {
    /// Taps in chips, of a replica whose correlation with itself is `own` and with a chip is `pulse`.
    pub fn new(chips: &[f64], own: &PeakTable, pulse: &PeakTable) -> Self {
        let mut order: Vec<usize> = (0..chips.len()).collect();
        let away = |index: &usize| chips.get(*index).map_or(0.0, |chips| chips.abs());
        order.sort_by(|a, b| away(a).total_cmp(&away(b)));
        let reach = chips.iter().fold(0.0, |most: f64, chips| most.max(chips.abs())) + width_chips(pulse);
        let (first, last) = (-(reach.floor() as i64), reach.floor() as i64 + 1);
        let mut weights = Vec::new();
        for position in 0..=POSITIONS {
            let share = position as f64 / POSITIONS as f64;
            for chip in first..=last {
                let weight = |tap: &f64| pulse.value(share - tap - chip as f64) as f32;
                weights.push(std::array::from_fn(|lane| chips.get(lane).map_or(0.0, weight)));
            }
        }
        let ordered: Vec<f64> = order.iter().filter_map(|index| chips.get(*index).copied()).collect();
        let count = (last - first + 1) as usize;
        let power = own.value(0.0);
        let factors = factors(&ordered, |apart| own.value(apart) / power);
        Self { factors, chips: chips.to_vec(), order, first, count, weights }
    }

    /// Shares of the chips that any tap meets, for a prompt at one of [`POSITIONS`].
    #[inline]
    pub fn weights(&self, position: usize) -> &[[f32; LANES]] {
        self.weights.get(position * self.count..(position + 1) * self.count).unwrap_or_default()
    }
}

/// Offset in chips from which on a chip does not correlate with another.
fn width_chips(pulse: &PeakTable) -> f64 {
    let steps = (0..=2 * STEPS).rev().find(|step| pulse.value(f64::from(*step) / f64::from(STEPS)).abs() > 1e-9);
    f64::from(steps.unwrap_or(0) + 1) / f64::from(STEPS)
}

/// Rows of the lower triangle whose square is the correlation of noise at taps (Cholesky). `common` is that
/// of two taps by their distance in chips. At most `N` taps count; a tap that lies on another has nothing of
/// its own.
pub fn factors<const N: usize>(taps: &[f64], common: impl Fn(f64) -> f64) -> [[f64; N]; N] {
    let mut factors = [[0.0; N]; N];
    for row in 0..taps.len().min(N) {
        let mut left = 1.0;
        for column in 0..row {
            let inner: f64 = (0..column).map(|k| factors[row][k] * factors[column][k]).sum();
            let pivot: f64 = factors[column][column];
            let shared = common(taps[row] - taps[column]);
            factors[row][column] = if pivot > 1e-6 { (shared - inner) / pivot } else { 0.0 };
            left -= factors[row][column] * factors[row][column];
        }
        factors[row][row] = f64::max(left, 0.0).sqrt();
    }
    factors
}

/// True of taps that correlate with others.
pub(super) fn is_near(chips: f64) -> bool {
    chips.abs() <= NEAR_CHIPS
}

/// Sets of taps that were asked for.
#[derive(Debug, Default)]
pub(super) struct Sets([OnceLock<Taps>; SETS]);

impl Sets {
    /// Calls `with` for the set of these taps, which is the same whoever asked for it first.
    #[inline]
    pub fn with<R>(&self, chips: &[f64], (own, pulse): (&PeakTable, &PeakTable), with: impl FnOnce(&Taps) -> R) -> R {
        for set in &self.0 {
            let set = set.get_or_init(|| Taps::new(chips, own, pulse));
            if set.chips == chips {
                return with(set);
            }
        }
        with(&Taps::new(chips, own, pulse))
    }
}
