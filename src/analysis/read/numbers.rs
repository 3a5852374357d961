//! A list of numbers that may be longer than memory: mean, spread and percentiles, exactly as
//! [`crate::statistics`] has them of a list that is held.
//!
//! Up to 16 384 numbers are held, the rest lie in a file without a name and are read again for each sum. An
//! order statistic is found by its bits, sixteen at a time: a count of how many numbers begin with each
//! sixteen leaves those that begin like it.

use std::path::Path;

use crate::error::JudgeError;
use crate::read::word_file::WordFile;
use crate::statistics::{Spread, Sum, deviation, rank};

/// Numbers that are held.
const HELD: usize = 1 << 14;

/// The list.
#[derive(Debug)]
pub struct Numbers {
    file: WordFile,
    /// Numbers after those of the file.
    held: Vec<f64>,
}

impl Numbers {
    /// An empty list, whose file is made in that directory.
    pub fn new(directory: &Path) -> Self {
        Self { file: WordFile::new(directory), held: Vec::new() }
    }

    /// Adds a number.
    ///
    /// # Errors
    /// [`JudgeError::File`] where the file cannot be made or written.
    pub fn push(&mut self, value: f64) -> Result<(), JudgeError> {
        self.held.push(value);
        if self.held.len() < HELD {
            return Ok(());
        }
        let words: Vec<u64> = self.held.iter().map(|value| value.to_bits()).collect();
        self.file.append(&words)?;
        self.held.clear();
        Ok(())
    }

    /// Number of values.
    pub fn len(&self) -> usize {
        self.file.len() as usize + self.held.len()
    }

    /// True if there is none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Shows each number to `see`.
    ///
    /// # Errors
    /// [`JudgeError::Read`] where the file cannot be read.
    pub fn each(&self, mut see: impl FnMut(f64)) -> Result<(), JudgeError> {
        let mut words = Vec::new();
        for start in (0..self.file.len()).step_by(HELD) {
            self.file.read(start, HELD, &mut words).map_err(|source| self.file.unreadable(source))?;
            words.iter().for_each(|word| see(f64::from_bits(*word)));
        }
        self.held.iter().for_each(|value| see(*value));
        Ok(())
    }

    /// Shows each number to `see`, until `see` fails.
    ///
    /// # Errors
    ///
    /// Same as [`Self::each`], and those of `see`.
    pub fn try_each(&self, mut see: impl FnMut(f64) -> Result<(), JudgeError>) -> Result<(), JudgeError> {
        let mut seen = Ok(());
        self.each(|value| {
            if seen.is_ok() {
                seen = see(value);
            }
        })?;
        seen
    }

    /// Sums of what `of` makes of those that are finite.
    fn sums(&self, of: impl Fn(f64) -> f64) -> Result<Sum, JudgeError> {
        let mut sums = Sum::default();
        self.each(|value| {
            if value.is_finite() {
                sums.add(of(value));
            }
        })?;
        Ok(sums)
    }

    /// Arithmetic mean.
    ///
    /// # Errors
    /// Errors of [`Self::each`].
    pub fn mean(&self) -> Result<Option<f64>, JudgeError> {
        Ok(self.sums(|value| value)?.mean())
    }

    /// Root of the mean square about zero.
    ///
    /// # Errors
    /// Errors of [`Self::each`].
    pub fn rms(&self) -> Result<Option<f64>, JudgeError> {
        Ok(self.sums(|value| value)?.rms())
    }

    /// Standard deviation about the mean, n − 1 in the divisor, and how many numbers it is of; 0 for one.
    ///
    /// # Errors
    /// Errors of [`Self::each`].
    pub fn std(&self) -> Result<Option<(f64, usize)>, JudgeError> {
        let Some(mean) = self.mean()? else { return Ok(None) };
        let about = self.sums(|value| value - mean)?;
        Ok(Some((deviation(about.squares(), about.count()), about.count())))
    }

    /// The value below which a share `p` (0 to 1) of the numbers' sizes lies.
    ///
    /// # Errors
    /// Errors of [`Self::each`].
    pub fn size_percentile(&self, p: f64) -> Result<Option<f64>, JudgeError> {
        self.ranked(p, f64::abs)
    }

    /// The value below which a share `p` (0 to 1) of the numbers lies.
    ///
    /// # Errors
    /// Errors of [`Self::each`].
    pub fn percentile(&self, p: f64) -> Result<Option<f64>, JudgeError> {
        self.ranked(p, |value| value)
    }

    fn ranked(&self, p: f64, of: impl Fn(f64) -> f64) -> Result<Option<f64>, JudgeError> {
        let count = self.sums(|value| value)?.count();
        let Some(rank) = rank(count, p) else { return Ok(None) };
        let below = self.order(rank.floor() as usize, &of)?;
        let above = if rank.ceil() > rank.floor() { self.order(rank.ceil() as usize, &of)? } else { below };
        Ok(Some(below + (above - below) * (rank - rank.floor())))
    }

    /// The number that so many are before in order, of those that are finite.
    fn order(&self, rank: usize, of: &impl Fn(f64) -> f64) -> Result<f64, JudgeError> {
        let (mut known, mut rank) = (0_u64, rank);
        for shift in [48, 32, 16, 0] {
            let mut counts = vec![0_usize; 1 << 16];
            self.each(|value| {
                let key = ordered(of(value));
                // What is known so far is what stands left of the sixteen bits that come.
                if value.is_finite()
                    && (shift == 48 || key >> (shift + 16) == known)
                    && let Some(count) = counts.get_mut((key >> shift & 0xffff) as usize)
                {
                    *count += 1;
                }
            })?;
            let mut next = 0;
            for (bits, count) in (0_u64..).zip(&counts) {
                next = bits;
                if rank < *count {
                    break;
                }
                rank -= count;
            }
            known = known << 16 | next;
        }
        Ok(f64::from_bits(if known >> 63 == 1 { known & !(1 << 63) } else { !known }))
    }

    /// Mean, σ and 95 % of the magnitude.
    ///
    /// # Errors
    /// Errors of [`Self::each`].
    pub fn spread(&self) -> Result<Option<Spread>, JudgeError> {
        let (Some(mean), Some((sigma, count)), Some(p95)) = (self.mean()?, self.std()?, self.size_percentile(0.95)?)
        else {
            return Ok(None);
        };
        Ok(Some(Spread { count, mean, sigma, p95 }))
    }
}

/// Bits whose order as whole numbers is that of the numbers (`f64::total_cmp`).
fn ordered(value: f64) -> u64 {
    let bits = value.to_bits();
    if value.is_sign_negative() { !bits } else { bits | 1 << 63 }
}

/// Standard deviation of several groups together, each about its own mean.
#[derive(Clone, Copy, Debug, Default)]
pub struct Pooled {
    squares: f64,
    freedom: usize,
}

impl Pooled {
    /// Counts a group in.
    ///
    /// # Errors
    /// Errors of [`Numbers::each`].
    pub fn add(&mut self, group: &Numbers) -> Result<(), JudgeError> {
        if let Some((sigma, count)) = group.std()?.filter(|(_, count)| *count > 1) {
            self.squares += sigma * sigma * (count - 1) as f64;
            self.freedom += count - 1;
        }
        Ok(())
    }

    /// Standard deviation of the pooled groups, as in [`crate::statistics::pooled_std`].
    pub fn std(&self) -> Option<f64> {
        (self.freedom > 0).then(|| (self.squares / self.freedom as f64).sqrt())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::hand_made::Draw;
    use crate::statistics::{mean, percentile, pooled_std, rms, spread, std};

    #[test]
    fn every_figure_is_that_of_a_list_that_is_held_to_the_last_bit() {
        let place = tempfile::tempdir().unwrap();
        let mut draw = Draw(3);
        for count in [0, 1, 2, 999, HELD, 3 * HELD + 17] {
            let mut list: Vec<f64> = (0..count).map(|_| draw.normal() * draw.normal() + 0.1).collect();
            if count > 100 {
                (list[7], list[8], list[9]) = (f64::NAN, f64::NEG_INFINITY, -0.0);
                list.extend_from_within(20..60);
            }
            let mut numbers = Numbers::new(place.path());
            list.iter().for_each(|value| numbers.push(*value).unwrap());
            assert_eq!((numbers.len(), numbers.is_empty()), (list.len(), list.is_empty()));
            assert!(numbers.held.len() < HELD);
            assert_eq!(numbers.mean().unwrap(), mean(&list));
            assert_eq!(numbers.rms().unwrap(), rms(&list));
            assert_eq!(numbers.std().unwrap().map(|(sigma, _)| sigma), std(&list));
            assert_eq!(numbers.spread().unwrap(), spread(&list));
            for p in [0.0, 0.002, 0.5, 0.95, 1.0] {
                assert_eq!(numbers.percentile(p).unwrap(), percentile(&list, p), "{p} of {count}");
            }
            let mut pooled = Pooled::default();
            pooled.add(&numbers).unwrap();
            pooled.add(&numbers).unwrap();
            assert_eq!(pooled.std(), pooled_std([list.as_slice(), list.as_slice()]));
        }
    }
}
