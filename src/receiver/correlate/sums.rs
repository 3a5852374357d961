//! Samples with their running sums, by which the correlator by pieces needs no sample twice, and in 16 bits.
//!
//! Sums are integers, in halves of a sample's last bit and modulo 2³², so that differences are exact wherever
//! the sums began.

use super::fixed::Fixed;
use super::kernel::Level;
use super::pieces::kernel;
use super::power;

/// Consecutive samples, and their running sums where they were made. Planes may be left out where there are
/// samples in 16 bits.
#[derive(Clone, Copy, Debug)]
pub struct Samples<'a> {
    /// In-phase samples; none where they were left out.
    pub i: &'a [f32],
    /// Quadrature samples; none where they were left out.
    pub q: &'a [f32],
    /// Running sums of the samples before each one, where they were made.
    pub sums: Option<Sums<'a>>,
    /// Samples in 16 bits, where they were made.
    pub fixed: Option<Fixed<'a>>,
}

impl<'a> From<(&'a [f32], &'a [f32])> for Samples<'a> {
    fn from((i, q): (&'a [f32], &'a [f32])) -> Self {
        Self { i, q, sums: None, fixed: None }
    }
}

impl<'a> Samples<'a> {
    /// Number of the samples.
    pub fn count(&self) -> usize {
        self.fixed.map_or(self.i.len().min(self.q.len()), |fixed| fixed.count())
    }

    /// Σ |x|².
    pub fn power(&self) -> f64 {
        self.fixed.map_or_else(|| power(self.i, self.q), |fixed| fixed.power())
    }

    /// Result of `of` on the planes. Planes that were left out are made first.
    pub(super) fn by_planes<R>(&self, of: impl FnOnce(&[f32], &[f32]) -> R) -> R {
        match self.fixed.filter(|_| self.i.is_empty()) {
            Some(fixed) => {
                let [i, q] = fixed.planes();
                of(&i, &q)
            }
            None => of(self.i, self.q),
        }
    }

    /// The samples from `from` to `to`; none where some of them are not there.
    pub fn part(&self, from: usize, to: usize) -> Self {
        let sums = self.sums.and_then(|sums| sums.part(from, to));
        let of = |plane: &'a [f32]| plane.get(from..to).unwrap_or_default();
        let fixed = self.fixed.and_then(|fixed| fixed.part(from, to));
        Self { i: of(self.i), q: of(self.q), sums, fixed }
    }
}

/// Running sums of samples, in halves: entry n is that of all samples before sample n, with one entry more at
/// the end.
#[derive(Clone, Copy, Debug)]
pub struct Sums<'a>(&'a [[i32; 2]]);

impl<'a> Sums<'a> {
    /// Entries beyond the number of samples.
    const MORE: usize = 2;

    /// Sums as [`RunningSums`] made them.
    fn new(entries: &'a [[i32; 2]]) -> Option<Self> {
        (entries.len() > Self::MORE).then_some(Self(entries))
    }

    /// Number of the samples.
    pub(super) fn samples(&self) -> usize {
        self.0.len() - Self::MORE
    }

    /// The entries; at least three.
    pub(super) fn entries(&self) -> &'a [[i32; 2]] {
        self.0
    }

    /// The samples from `from` to `to`.
    pub(super) fn part(&self, from: usize, to: usize) -> Option<Self> {
        self.0.get(from..to + Self::MORE).and_then(Self::new)
    }
}

/// Room for running sums, which only grows.
#[derive(Clone, Debug, Default)]
pub struct RunningSums(Vec<[i32; 2]>);

impl RunningSums {
    /// The running sums of samples of 8 bits: within ±127.5, in steps of a half or more.
    pub fn of(&mut self, i: &[f32], q: &[f32]) -> Option<Sums<'_>> {
        let samples = i.len().min(q.len());
        self.made(samples, |entries| kernel::running_sums(Level::best(), &i[..samples], &q[..samples], entries))
    }

    /// Running sums of samples in 16 bits.
    pub fn of_fixed(&mut self, fixed: Fixed) -> Option<Sums<'_>> {
        self.made(fixed.count(), |entries| kernel::running_sums_of_fixed(Level::best(), fixed.i, fixed.q, entries))
    }

    fn made(&mut self, samples: usize, fill: impl FnOnce(&mut [[i32; 2]])) -> Option<Sums<'_>> {
        let whole = samples + Sums::MORE;
        if self.0.len() < whole {
            self.0.resize(whole, [0; 2]);
        }
        let entries = &mut self.0[..whole];
        fill(&mut entries[..=samples]);
        entries[samples + 1] = entries[samples];
        Sums::new(entries)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn entry_n_is_the_sum_of_the_samples_before_n_at_every_level() {
        let value = |k: usize, by: usize| ((k * by % 511) as f32 - 255.0) / 2.0;
        for count in [0, 1, 2, 3, 4, 5, 7, 8, 9, 63, 1000, 70_001] {
            let i: Vec<f32> = (0..count).map(|k| value(k, 37)).collect();
            // All of one sign.
            let q: Vec<f32> = (0..count).map(|k| 127.5 - value(k, 91).abs() / 8.0).collect();
            let q: Vec<f32> = q.iter().map(|x| (2.0 * x).round() / 2.0).collect();
            let mut expected = vec![[0_i32; 2]; count + 1];
            let mut sum = [0.0_f64; 2];
            for k in 0..count {
                sum = [sum[0] + f64::from(i[k]), sum[1] + f64::from(q[k])];
                expected[k + 1] = sum.map(|x| (2.0 * x) as i32);
            }
            for level in Level::all() {
                let mut made = vec![[7_i32; 2]; count + 1];
                kernel::running_sums(level, &i, &q, &mut made);
                assert_eq!(made, expected, "{level:?} {count}");
                let [short_i, short_q] =
                    [&i, &q].map(|plane| plane.iter().map(|x| (16.0 * x) as i16).collect::<Vec<_>>());
                made.fill([7; 2]);
                kernel::running_sums_of_fixed(level, &short_i, &short_q, &mut made);
                assert_eq!(made, expected, "{level:?} {count} in 16 bits");
            }
        }
    }
}
