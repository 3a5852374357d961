//! The code error that the truth's reflected rays leave in a code loop.
//!
//! E, P and L are the sums over the rays of amplitude, phase and correlation, at the loop's estimate and half
//! a spacing to either side. A loop of early minus late power rests where |E|² = |L|², one of the dot product
//! where Re((E−L)·P*) = 0, one of the double delta where that of both pairs is. Limits: the front end's
//! rounding of the correlation is left out, and rays are taken as steady over the loop's time constant, so
//! that what moves fast is overrated.

use std::collections::HashMap;
use std::iter::Peekable;

use crate::error::JudgeError;
use crate::expect::loops::{Settings, Theory};
use crate::expect::peak::Code;
use crate::expect::theory::dll::Discriminator;
use crate::read::Run;
use crate::read::spill_store::Cursor;
use gnss::record::RayRow;
use gnss::signal::Link;
use num_complex::Complex64;

impl Theory {
    /// Code error of the loop for rays of (excess in chips, amplitude, phase in cycles), metres late.
    pub fn ray_m(&self, rays: &[Ray]) -> f64 {
        let Settings { dll_discriminator, spacing_chips, .. } = self.settings;
        self.chip_m * error_chips(&self.code, rays, dll_discriminator, spacing_chips)
    }
}

/// Code error of the loop in chips late of the direct ray, for rays of (excess in chips, amplitude, phase in
/// cycles).
fn error_chips(code: &Code, rays: &[Ray], discriminator: Discriminator, spacing_chips: f64) -> f64 {
    if rays.iter().all(|ray| ray.1 == 0.0) {
        return 0.0;
    }
    let sum = |at: f64| {
        let direct = Complex64::from(code.value(at));
        rays.iter().fold(direct, |sum, (excess, amplitude, phase)| {
            let (sin, cos) = libm::sincos(std::f64::consts::TAU * phase);
            sum + amplitude * code.value(at - excess) * Complex64::new(cos, sin)
        })
    };
    // Falls through zero where the loop rests, between half a spacing before the direct ray and one behind
    // it, before early leaves the main peak.
    let discriminator = |at: f64| {
        let half = 0.5 * spacing_chips;
        match discriminator {
            Discriminator::EarlyMinusLate => sum(at + half).norm_sqr() - sum(at - half).norm_sqr(),
            // The carrier's loop turns the prompt onto the real axis, which is all that the coherent one
            // assumes.
            Discriminator::DotProduct | Discriminator::DoubleDelta | Discriminator::Coherent => {
                (discriminator.sum(half, |side| sum(at + side) - sum(at - side)) * sum(at).conj()).re
            }
        }
    };
    let (mut low, mut high) = (-0.5 * spacing_chips, spacing_chips.min(code.reach_chips - 0.5 * spacing_chips));
    for _ in 0..40 {
        let middle = 0.5 * (low + high);
        if discriminator(middle) < 0.0 { high = middle } else { low = middle }
    }
    0.5 * (low + high)
}

/// The three numbers of a ray.
type Ray = (f64, f64, f64);

/// The reflected rays of a satellite, sample by sample: those of one are held, or all where samples fall.
pub(crate) struct Rays<'r> {
    cursor: Peekable<Cursor<'r, Link, RayRow>>,
    all: Option<HashMap<u64, Vec<Ray>>>,
    chip_m: f64,
    now: Vec<Ray>,
    sample: Option<u64>,
}

impl<'r> Rays<'r> {
    /// Rays of a run's satellite whose chips have that length.
    ///
    /// # Errors
    ///
    /// [`JudgeError::Read`] where spilled rows cannot be read.
    pub fn of(run: &'r Run, link: Link, chip_m: f64) -> Result<Self, JudgeError> {
        let cursor = run.rays.cursor(link).peekable();
        let mut rays = Self { cursor, all: None, chip_m, now: Vec::new(), sample: None };
        if !run.rays.is_ordered(&link) {
            let mut all: HashMap<u64, Vec<Ray>> = HashMap::new();
            run.rays.each(link, |row| all.entry(row.sample).or_default().push(rays.ray(&row)))?;
            rays.all = Some(all);
        }
        Ok(rays)
    }

    fn ray(&self, row: &RayRow) -> Ray {
        (row.excess_m / self.chip_m, row.amplitude_ratio, row.phase_cycles)
    }

    /// Rays at a sample; samples are requested in their order.
    ///
    /// # Errors
    ///
    /// Same as [`Self::of`].
    pub fn at(&mut self, sample: u64) -> Result<&[Ray], JudgeError> {
        if let Some(all) = &self.all {
            return Ok(all.get(&sample).map_or(&[], Vec::as_slice));
        }
        if self.sample.replace(sample) != Some(sample) {
            self.now.clear();
        }
        let due = |row: &Result<RayRow, JudgeError>| row.as_ref().map_or(true, |row| row.sample <= sample);
        while let Some(row) = self.cursor.next_if(due) {
            let row = row?;
            if row.sample == sample {
                self.now.push(self.ray(&row));
            }
        }
        Ok(&self.now)
    }

    /// The largest sum of amplitudes at a sample.
    ///
    /// # Errors
    /// Errors of [`Self::of`].
    pub fn strongest(run: &'r Run, link: Link) -> Result<f64, JudgeError> {
        let mut strongest = 0.0_f64;
        if !run.rays.is_ordered(&link) {
            let rays = Self::of(run, link, 1.0)?.all.unwrap_or_default();
            let sums = rays.values().map(|rays| rays.iter().map(|ray| ray.1).sum::<f64>());
            return Ok(sums.fold(strongest, f64::max));
        }
        let mut sum = (0, -0.0);
        run.rays.each(link, |row| {
            if row.sample != sum.0 {
                strongest = strongest.max(sum.1);
                sum = (row.sample, -0.0);
            }
            sum.1 += row.amplitude_ratio;
        })?;
        Ok(strongest.max(sum.1))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::expect::theory::dll::Discriminator::{DotProduct, DoubleDelta, EarlyMinusLate};
    use crate::waveform::Waveform;
    use gnss::gps::l1ca::L1_CA;
    use gnss::signal::synthetic::LONG_BOC;

    #[test]
    fn a_single_ray_errs_as_the_envelope_says() {
        // In phase the error of an early-minus-late envelope is α·d/2 where the ray is late by d/2(1 + α) or
        // more; out of phase the same early.
        let code = Code::of(&Waveform::of(&L1_CA).unwrap());
        let error = |phase| error_chips(&code, &[(0.3, 0.25, phase)], EarlyMinusLate, 0.2);
        assert!((error(0.0) - 0.25 * 0.1).abs() < 3e-3, "{}", error(0.0));
        assert!((error(0.5) + 0.25 * 0.1).abs() < 3e-3, "{}", error(0.5));
        assert_eq!(error_chips(&code, &[(0.3, 0.0, 0.0)], EarlyMinusLate, 0.2), 0.0);
        let far = error_chips(&code, &[(2.0, 0.5, 0.0)], EarlyMinusLate, 0.5);
        assert!(far.abs() < 1e-6, "beyond the correlation");
    }

    /// A ray of amplitude α comes δ late, δ below d/2, at a quarter of a turn. On the triangle E and L are
    /// (1−d/2∓e) + iα(1−d/2∓(e−δ)), so that |E|² = |L|² at e = α²δ/(1+α²). P is (1−e) + iα(1−δ+e), so that
    /// Re((E−L)·P*) = 0 where e(1−e) + α²(e−δ)(1−δ+e) is: (1−α²)e² − (1+α²(1−2δ))e + α²δ(1−δ) = 0.
    #[test]
    fn a_discriminator_rests_where_its_own_formula_is_zero() {
        let code = Code::of(&Waveform::of(&L1_CA).unwrap());
        let (delay, amplitude, d) = (0.1, 0.5, 0.4);
        let error = |which, phase| error_chips(&code, &[(delay, amplitude, phase)], which, d);
        for phase in [0.0, 0.5] {
            let [one, other] = [EarlyMinusLate, DotProduct].map(|which| error(which, phase));
            assert!((one - other).abs() < 1e-9, "in phase both are zero where early equals late: {one}, {other}");
        }
        let square = amplitude * amplitude;
        let (found, expected) = (error(EarlyMinusLate, 0.25), square * delay / (1.0 + square));
        assert!((found - expected).abs() < 1e-9, "{found}, {expected}");
        let (a, b, c) = (1.0 - square, 1.0 + square * (1.0 - 2.0 * delay), square * delay * (1.0 - delay));
        let (found, expected) = (error(DotProduct, 0.25), (b - (b * b - 4.0 * a * c).sqrt()) / (2.0 * a));
        assert!((found - expected).abs() < 1e-9, "{found}, {expected}");
    }

    #[test]
    fn the_double_delta_does_not_see_a_ray_on_whose_flank_all_its_taps_lie() {
        let code = Code::of(&Waveform::of(&L1_CA).unwrap());
        let error = |which, excess: f64, phase: f64| error_chips(&code, &[(excess, 0.25, phase)], which, 0.2);
        for phase in [0.0, 0.5] {
            assert!(error(DoubleDelta, 0.5, phase).abs() < 1e-9 && error(DotProduct, 0.5, phase).abs() > 0.02);
            // Nearer than half a spacing both loops rest on the peak of the sum.
            let [one, other] = [DoubleDelta, DotProduct].map(|which| error(which, 0.05, phase));
            assert!((one - other).abs() < 1e-9 && one.abs() > 0.009, "{one}, {other}");
        }
        // At the end of its flank one tap of two leaves it: a·(δ − 1 + d)/(2 + a).
        let end = error(DoubleDelta, 0.88, 0.0);
        assert!((end - 0.25 * 0.08 / 2.25).abs() < 1e-9, "{end}");
    }

    #[test]
    fn a_ray_beyond_the_main_peak_of_boc_errs_the_other_way() {
        // R falls by 3 a chip and rises by 1 beyond half a chip: late minus early of the direct ray is −6e,
        // of the other one 3αd on the steep flank and −αd on the gentle one.
        let code = Code::of(&Waveform::of(&LONG_BOC).unwrap());
        let error = |excess: f64, phase: f64| error_chips(&code, &[(excess, 0.25, phase)], EarlyMinusLate, 0.1);
        assert!((error(0.2, 0.0) - 0.25 * 0.05).abs() < 1e-4, "{}", error(0.2, 0.0));
        assert!((error(0.2, 0.5) + 0.25 * 0.05).abs() < 1e-4, "{}", error(0.2, 0.5));
        let far = error(0.8, 0.0);
        assert!((far + 0.25 * 0.05 / 3.0).abs() < 5e-4, "{far}");
    }
}
