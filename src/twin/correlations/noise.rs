//! Noise of correlators: pure functions of seed, code, interval and tap.
//!
//! Taps of one replica over one interval have the covariance of the replica with itself; taps far apart are
//! independent. A part of a code period has its part of the period's noise. Limits: single precision, below
//! 6.77 deviations.

use generator::random::Stream;
use generator::synth::noise::normals;
use num_complex::Complex64;

use super::taps::{LANES, MOST, Taps};

/// Number of the draw that splits a code period.
const SPLIT: u64 = 1 << 40;
/// Number of the first draw for taps near the prompt.
const NEAR: u64 = 1 << 32;

/// Code periods whose noise is drawn at once.
const TOGETHER: usize = 4;

/// Adds the noise of whole code periods to sums at taps near the prompt: of each its stream, and the
/// deviation of a component. `sums` has one sum for each tap, period after period.
pub(super) fn add_to_each(mut periods: impl Iterator<Item = (Stream, f64)>, taps: &Taps, sums: &mut [Complex64]) {
    let count = taps.order.len().max(1);
    if count > LANES {
        for ((stream, scale), sums) in periods.zip(sums.chunks_mut(count)) {
            Noise { stream, share: 1.0 }.add(taps, scale, sums);
        }
        return;
    }
    for sums in sums.chunks_mut(TOGETHER * count) {
        let (mut words, mut scales) = ([0; TOGETHER * LANES], [0.0; TOGETHER]);
        for ((words, scale), (stream, own)) in words.chunks_exact_mut(LANES).zip(&mut scales).zip(periods.by_ref()) {
            (NEAR..).zip(words).for_each(|(number, word)| *word = stream.word(number));
            *scale = own;
        }
        let draws = normals(&words);
        let [re, im] = draws.each_ref().map(|part| part.as_chunks::<LANES>().0);
        for ((sums, scale), (re, im)) in sums.chunks_mut(count).zip(scales).zip(re.iter().zip(im)) {
            add(taps, scale, &[*re, *im], sums);
        }
    }
}

/// Standard normal noise of one code period's correlations.
pub(super) struct Noise {
    /// Stream of the code and the interval.
    pub stream: Stream,
    /// Share of the code period that is taken, from its beginning on. The noise has that variance.
    pub share: f64,
}

impl Noise {
    /// Draws from number `first` on, real and imaginary parts.
    #[inline]
    fn draws<const N: usize>(&self, first: u64) -> [[f32; N]; 2] {
        let mut words = [0; N];
        (first..).zip(&mut words).for_each(|(number, word)| *word = self.stream.word(number));
        let whole = normals(&words);
        if self.share >= 1.0 {
            return whole;
        }
        // A Brownian bridge to the noise of the whole.
        (first ^ SPLIT..).zip(&mut words).for_each(|(number, word)| *word = self.stream.word(number));
        let bridge = normals(&words);
        let (share, spread) = (self.share as f32, (self.share * (1.0 - self.share)).sqrt() as f32);
        std::array::from_fn(|part| std::array::from_fn(|k| share * whole[part][k] + spread * bridge[part][k]))
    }

    /// Adds noise of this deviation a component to sums at taps near the prompt.
    #[inline]
    pub fn add(&self, taps: &Taps, scale: f64, sums: &mut [Complex64]) {
        if taps.order.len() <= LANES {
            add(taps, scale, &self.draws::<LANES>(NEAR), sums);
        } else {
            add(taps, scale, &self.draws::<MOST>(NEAR), sums);
        }
    }

    /// Noise of unit deviation a component at a tap far from the prompt.
    pub fn far(&self, chips: f64) -> Complex64 {
        // Whole chips tell such taps apart.
        let [[re], [im]] = self.draws::<1>(chips.round() as i64 as u64);
        Complex64::new(re.into(), im.into())
    }
}

#[inline]
fn add<const N: usize>(taps: &Taps, scale: f64, [re, im]: &[[f32; N]; 2], sums: &mut [Complex64]) {
    for (row, (index, factors)) in taps.order.iter().zip(&taps.factors).enumerate() {
        let Some(sum) = sums.get_mut(*index) else { continue };
        let draws = factors.iter().zip(re.iter().zip(im)).take(row + 1);
        let noise = draws.fold(Complex64::ZERO, |noise, (factor, (re, im))| {
            noise + Complex64::new(f64::from(*re), f64::from(*im)) * *factor
        });
        *sum += scale * noise;
    }
}
