//! The passes over samples, spectra and lags, compiled for AVX2 too; no operation is fused, so bits do not
//! depend on it.

#[cfg(target_arch = "x86_64")]
use std::arch::x86_64 as x86;

use num_complex::{Complex, Complex64};

/// Phasors that are turned side by side.
const LANES: usize = 8;

/// `first`·`step`ⁿ for n = 0, 1, …, eight at a time: each turns by `step`⁸, so that no product waits for the
/// one before.
struct Phasors {
    re: [f64; LANES],
    im: [f64; LANES],
    turn: Complex64,
}

impl Phasors {
    #[inline(always)]
    fn new(first: Complex64, step: Complex64) -> Self {
        let (mut re, mut im) = ([0.0; LANES], [0.0; LANES]);
        let mut phasor = first;
        for (re, im) in re.iter_mut().zip(&mut im) {
            (*re, *im) = (phasor.re, phasor.im);
            phasor *= step;
        }
        let fourth = step * step * (step * step);
        Self { re, im, turn: fourth * fourth }
    }

    /// Advances the phasors by eight steps.
    #[inline(always)]
    fn turn(&mut self) {
        for (re, im) in self.re.iter_mut().zip(&mut self.im) {
            (*re, *im) = (*re * self.turn.re - *im * self.turn.im, *re * self.turn.im + *im * self.turn.re);
        }
    }
}

/// out = (i + jq)·`first`·`step`ⁿ as far as all have samples. What is left of `out` is zero.
pub(super) fn mix(out: &mut [Complex<f32>], (i, q): (&[f32], &[f32]), first: Complex64, step: Complex64) {
    #[cfg(target_arch = "x86_64")]
    if is_x86_feature_detected!("avx2") {
        // SAFETY: the processor has AVX2.
        unsafe { mix_avx2(out, (i, q), first, step) };
        return;
    }
    mix_plain(out, (i, q), first, step);
}

/// sums += bins·`first`·`step`ⁿ, the phasors in `f32`.
pub(super) fn add_turned(sums: &mut [Complex<f32>], bins: &[Complex<f32>], first: Complex64, step: Complex64) {
    #[cfg(target_arch = "x86_64")]
    if is_x86_feature_detected!("avx2") {
        // SAFETY: the processor has AVX2.
        unsafe { add_turned_avx2(sums, bins, first, step) };
        return;
    }
    add_turned_plain(sums, bins, first, step);
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn mix_avx2(out: &mut [Complex<f32>], samples: (&[f32], &[f32]), first: Complex64, step: Complex64) {
    mix_plain(out, samples, first, step);
}

#[inline(always)]
fn mix_plain(out: &mut [Complex<f32>], (i, q): (&[f32], &[f32]), first: Complex64, step: Complex64) {
    let length = out.len().min(i.len()).min(q.len());
    let (mixed, rest) = out.split_at_mut(length);
    rest.fill(Complex::default());
    let mut phasors = Phasors::new(first, step);
    for ((out, i), q) in mixed.chunks_mut(LANES).zip(i.chunks(LANES)).zip(q.chunks(LANES)) {
        for (k, ((out, i), q)) in out.iter_mut().zip(i).zip(q).enumerate() {
            let (i, q, re, im) = (f64::from(*i), f64::from(*q), phasors.re[k], phasors.im[k]);
            *out = Complex::new((i * re - q * im) as f32, (i * im + q * re) as f32);
        }
        phasors.turn();
    }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn add_turned_avx2(sums: &mut [Complex<f32>], bins: &[Complex<f32>], first: Complex64, step: Complex64) {
    add_turned_plain(sums, bins, first, step);
}

/// Phasors whose products with those of every so many are all.
const RAMP: usize = 64;

#[inline(always)]
fn add_turned_plain(sums: &mut [Complex<f32>], bins: &[Complex<f32>], first: Complex64, step: Complex64) {
    let [mut fine_re, mut fine_im] = [[0.0_f32; RAMP]; 2];
    let mut phasors = Phasors::new(Complex64::ONE, step);
    for (re, im) in fine_re.as_chunks_mut::<LANES>().0.iter_mut().zip(fine_im.as_chunks_mut::<LANES>().0) {
        for k in 0..LANES {
            (re[k], im[k]) = (phasors.re[k] as f32, phasors.im[k] as f32);
        }
        phasors.turn();
    }
    // As far as eight turns by eight have come.
    let whole = Complex64::new(phasors.re[0], phasors.im[0]);
    let mut coarse = first;
    for (sums, bins) in sums.chunks_mut(RAMP).zip(bins.chunks(RAMP)) {
        let (re, im) = (coarse.re as f32, coarse.im as f32);
        for (((sum, bin), fine_re), fine_im) in sums.iter_mut().zip(bins).zip(&fine_re).zip(&fine_im) {
            *sum += bin * Complex::new(re * fine_re - im * fine_im, re * fine_im + im * fine_re);
        }
        coarse *= whole;
    }
}

/// out = x·`first`·`step`ⁿ, as far as both have numbers.
pub(super) fn turn(out: &mut [Complex<f32>], x: &[f32], first: Complex64, step: Complex64) {
    #[cfg(target_arch = "x86_64")]
    if is_x86_feature_detected!("avx2") {
        // SAFETY: the processor has AVX2.
        unsafe { turn_avx2(out, x, first, step) };
        return;
    }
    turn_plain(out, x, first, step);
}

/// Σ (i + jq)·conj(w) and Σ |w|², in `f64`.
pub(super) fn project(samples: (&[f32], &[f32]), w: &[Complex<f32>]) -> (Complex64, f64) {
    #[cfg(target_arch = "x86_64")]
    if is_x86_feature_detected!("avx2") {
        // SAFETY: the processor has AVX2.
        return unsafe { project_avx2(samples, w) };
    }
    project_plain(samples, w)
}

/// i + jq −= w·`by`, as far as each of both planes has samples.
pub(super) fn subtract(planes: (&mut [f32], &mut [f32]), w: &[Complex<f32>], by: Complex64) {
    #[cfg(target_arch = "x86_64")]
    if is_x86_feature_detected!("avx2") {
        // SAFETY: the processor has AVX2.
        unsafe { subtract_avx2(planes, w, by) };
        return;
    }
    subtract_plain(planes, w, by);
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn turn_avx2(out: &mut [Complex<f32>], x: &[f32], first: Complex64, step: Complex64) {
    turn_plain(out, x, first, step);
}

#[inline(always)]
fn turn_plain(out: &mut [Complex<f32>], x: &[f32], first: Complex64, step: Complex64) {
    let mut phasors = Phasors::new(first, step);
    for (out, x) in out.chunks_mut(LANES).zip(x.chunks(LANES)) {
        for (k, (out, x)) in out.iter_mut().zip(x).enumerate() {
            *out = Complex::new(phasors.re[k] as f32 * x, phasors.im[k] as f32 * x);
        }
        phasors.turn();
    }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn project_avx2(samples: (&[f32], &[f32]), w: &[Complex<f32>]) -> (Complex64, f64) {
    project_plain(samples, w)
}

#[inline(always)]
fn project_plain((i, q): (&[f32], &[f32]), w: &[Complex<f32>]) -> (Complex64, f64) {
    let [mut re, mut im, mut energy] = [[0.0; LANES]; 3];
    for ((i, q), w) in i.chunks(LANES).zip(q.chunks(LANES)).zip(w.chunks(LANES)) {
        for (k, ((i, q), w)) in i.iter().zip(q).zip(w).enumerate() {
            let (i, q, w_re, w_im) = (f64::from(*i), f64::from(*q), f64::from(w.re), f64::from(w.im));
            re[k] += i * w_re + q * w_im;
            im[k] += q * w_re - i * w_im;
            energy[k] += w_re * w_re + w_im * w_im;
        }
    }
    (Complex64::new(re.iter().sum(), im.iter().sum()), energy.iter().sum())
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn subtract_avx2(planes: (&mut [f32], &mut [f32]), w: &[Complex<f32>], by: Complex64) {
    subtract_plain(planes, w, by);
}

#[inline(always)]
fn subtract_plain((i, q): (&mut [f32], &mut [f32]), w: &[Complex<f32>], by: Complex64) {
    let (re, im) = (by.re as f32, by.im as f32);
    i.iter_mut().zip(w).for_each(|(i, w)| *i -= w.re * re - w.im * im);
    q.iter_mut().zip(w).for_each(|(q, w)| *q -= w.re * im + w.im * re);
}

/// Parts of numbers that are multiplied side by side.
const PARTS: usize = 8;

/// A code's spectrum in 16 bits: to half a step of 2⁻¹⁵ of its largest part, which is 90 dB below that of a
/// random code's bins, where its cross-correlations are 20 dB below.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Spectrum {
    /// Real and imaginary parts in turn, in `step`s.
    parts: Vec<i16>,
    step: f32,
}

impl Spectrum {
    pub fn of(bins: &[Complex<f32>]) -> Self {
        let largest = parts(bins).iter().fold(0.0_f32, |largest, part| largest.max(part.abs()));
        let step = if largest > 0.0 { largest / f32::from(i16::MAX) } else { 1.0 };
        Self { parts: parts(bins).iter().map(|part| (part / step).round() as i16).collect(), step }
    }

    pub fn bytes(&self) -> usize {
        std::mem::size_of_val(self.parts.as_slice())
    }

    #[cfg(test)]
    pub fn bins(&self) -> Vec<Complex<f32>> {
        let part = |part: i16| f32::from(part) * self.step;
        self.parts.chunks_exact(2).map(|bin| Complex::new(part(bin[0]), part(bin[1]))).collect()
    }
}

/// out = a·b, as far as all have numbers.
pub(super) fn multiply(out: &mut [Complex<f32>], a: &Spectrum, b: &[Complex<f32>]) {
    #[cfg(target_arch = "x86_64")]
    if is_x86_feature_detected!("avx2") {
        // SAFETY: the processor has AVX2.
        unsafe { multiply_avx2(out, a, b) };
        return;
    }
    multiply_plain(out, a, b);
}

/// cells += |x|², and between += |x + x'|², x' the number after x, of the last one the first; all have as
/// many.
pub(super) fn add_powers(cells: &mut [f32], between: &mut [f32], x: &[Complex<f32>]) {
    let length = cells.len().min(between.len()).min(x.len());
    let (cells, between, x) = (&mut cells[..length], &mut between[..length], &x[..length]);
    let (Some(first), Some(last)) = (x.first(), x.last()) else { return };
    cells[length - 1] += last.norm_sqr();
    between[length - 1] += (last + first).norm_sqr();
    #[cfg(target_arch = "x86_64")]
    if is_x86_feature_detected!("avx2") {
        // SAFETY: the processor has AVX2.
        unsafe { add_powers_avx2(cells, between, x) };
        return;
    }
    add_powers_plain(cells, between, x);
}

/// The largest of these powers and their sum.
pub(super) fn peak_and_total(powers: &[f32]) -> (f32, f64) {
    #[cfg(target_arch = "x86_64")]
    if is_x86_feature_detected!("avx2") {
        // SAFETY: the processor has AVX2.
        return unsafe { peak_and_total_avx2(powers) };
    }
    peak_and_total_plain(powers)
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn peak_and_total_avx2(powers: &[f32]) -> (f32, f64) {
    peak_and_total_plain(powers)
}

/// Sums of sixteen lanes in `f32` over at most 1024 powers, then in `f64`: within 4e-6, 64 roundings of 2⁻²⁴.
#[inline(always)]
fn peak_and_total_plain(powers: &[f32]) -> (f32, f64) {
    let (mut peak, mut total) = (0.0_f32, 0.0);
    for part in powers.chunks(1024) {
        let (mut peaks, mut sums) = ([0.0_f32; 16], [0.0_f32; 16]);
        let lanes = part.chunks_exact(16);
        let rest = lanes.remainder();
        for chunk in lanes {
            for lane in 0..16 {
                peaks[lane] = if chunk[lane] > peaks[lane] { chunk[lane] } else { peaks[lane] };
                sums[lane] += chunk[lane];
            }
        }
        peak = peaks.iter().chain(rest).copied().fold(peak, f32::max);
        total += sums.iter().chain(rest).map(|&sum| f64::from(sum)).sum::<f64>();
    }
    (peak, total)
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn multiply_avx2(out: &mut [Complex<f32>], a: &Spectrum, b: &[Complex<f32>]) {
    let length = out.len().min(b.len()).min(a.parts.len() / 2);
    let (whole_out, rest_out) = parts_mut(&mut out[..length]).as_chunks_mut::<PARTS>();
    let (whole_b, rest_b) = parts(&b[..length]).as_chunks::<PARTS>();
    let (whole_a, rest_a) = a.parts[..2 * length].as_chunks::<PARTS>();
    let step = x86::_mm256_set1_ps(a.step);
    for ((out, a), b) in whole_out.iter_mut().zip(whole_a).zip(whole_b) {
        // SAFETY: eight parts are at each, and any alignment will do.
        unsafe {
            let a = x86::_mm256_cvtepi16_epi32(x86::_mm_loadu_si128(a.as_ptr().cast()));
            let a = x86::_mm256_mul_ps(x86::_mm256_cvtepi32_ps(a), step);
            let b = x86::_mm256_loadu_ps(b.as_ptr());
            let own = x86::_mm256_mul_ps(a, x86::_mm256_moveldup_ps(b));
            let other = x86::_mm256_mul_ps(x86::_mm256_permute_ps::<0b10_11_00_01>(a), x86::_mm256_movehdup_ps(b));
            x86::_mm256_storeu_ps(out.as_mut_ptr(), x86::_mm256_addsub_ps(own, other));
        }
    }
    multiply_parts(rest_out, (rest_a, a.step), rest_b);
}

fn multiply_plain(out: &mut [Complex<f32>], a: &Spectrum, b: &[Complex<f32>]) {
    let length = out.len().min(b.len()).min(a.parts.len() / 2);
    multiply_parts(parts_mut(&mut out[..length]), (&a.parts[..2 * length], a.step), parts(&b[..length]));
}

/// The products of real and imaginary parts in turn, all of as many numbers.
fn multiply_parts(out: &mut [f32], (a, step): (&[i16], f32), b: &[f32]) {
    for ((out, a), b) in out.as_chunks_mut::<2>().0.iter_mut().zip(a.as_chunks::<2>().0).zip(b.as_chunks::<2>().0) {
        let [re, im] = a.map(|part| f32::from(part) * step);
        *out = [re * b[0] - im * b[1], im * b[0] + re * b[1]];
    }
}

/// Numbers whose powers are added side by side.
#[cfg(target_arch = "x86_64")]
const CELLS: usize = 8;

/// All but the last of as many numbers, so that each has one after it.
#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn add_powers_avx2(cells: &mut [f32], between: &mut [f32], x: &[Complex<f32>]) {
    let whole = x.len().saturating_sub(1) / CELLS * CELLS;
    let x_parts = parts(x);
    let planes = cells[..whole].as_chunks_mut::<CELLS>().0.iter_mut().zip(between.as_chunks_mut::<CELLS>().0);
    for (n, (cells, between)) in planes.enumerate() {
        let from = x_parts[2 * CELLS * n..].as_ptr();
        // SAFETY: there are eight numbers from there on and one more, and any alignment will do.
        unsafe {
            let [low, high] = [0, 8].map(|part| x86::_mm256_loadu_ps(from.add(part)));
            let [low_after, high_after] = [2, 10].map(|part| x86::_mm256_loadu_ps(from.add(part)));
            let own = powers_avx2(low, high);
            let sums = powers_avx2(x86::_mm256_add_ps(low, low_after), x86::_mm256_add_ps(high, high_after));
            let add = |place: &mut [f32; CELLS], powers| {
                let sum = x86::_mm256_add_ps(x86::_mm256_loadu_ps(place.as_ptr()), powers);
                x86::_mm256_storeu_ps(place.as_mut_ptr(), sum);
            };
            add(cells, own);
            add(between, sums);
        }
    }
    add_powers_plain(&mut cells[whole..], &mut between[whole..], &x[whole..]);
}

/// Squares of eight numbers whose parts are in turn.
#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn powers_avx2(low: x86::__m256, high: x86::__m256) -> x86::__m256 {
    let re = x86::_mm256_shuffle_ps::<0b10_00_10_00>(low, high);
    let im = x86::_mm256_shuffle_ps::<0b11_01_11_01>(low, high);
    let squares = x86::_mm256_add_ps(x86::_mm256_mul_ps(re, re), x86::_mm256_mul_ps(im, im));
    x86::_mm256_castpd_ps(x86::_mm256_permute4x64_pd::<0b11_01_10_00>(x86::_mm256_castps_pd(squares)))
}

/// Real and imaginary parts in turn.
#[inline(always)]
fn parts(numbers: &[Complex<f32>]) -> &[f32] {
    // SAFETY: a `Complex` is laid out as two of its parts.
    unsafe { std::slice::from_raw_parts(numbers.as_ptr().cast(), 2 * numbers.len()) }
}

/// Real and imaginary parts in turn, as a mutable slice.
#[inline(always)]
fn parts_mut(numbers: &mut [Complex<f32>]) -> &mut [f32] {
    // SAFETY: as above.
    unsafe { std::slice::from_raw_parts_mut(numbers.as_mut_ptr().cast(), 2 * numbers.len()) }
}

fn add_powers_plain(cells: &mut [f32], between: &mut [f32], x: &[Complex<f32>]) {
    for ((cell, between), pair) in cells.iter_mut().zip(between).zip(x.windows(2)) {
        *cell += pair[0].norm_sqr();
        *between += (pair[0] + pair[1]).norm_sqr();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn phasors_side_by_side_are_those_one_after_the_other_at_every_length() {
        let (first, step) = (Complex64::from_polar(0.7, 1.0), Complex64::from_polar(1.0, 0.3));
        let wave = |n: usize| libm::sinf(0.37 * n as f32);
        for length in (0..20).chain([5199, 5200, 5201]) {
            let (i, q): (Vec<f32>, Vec<f32>) = (0..length).map(|n| (wave(n), wave(n + 3))).unzip();
            let mut mixed = vec![Complex::new(9.0, 9.0); length + 3];
            mix(&mut mixed, (&i, &q), first, step);
            let bins: Vec<Complex<f32>> = i.iter().zip(&q).map(|(i, q)| Complex::new(*i, *q)).collect();
            let mut sums = vec![Complex::new(1.0, 0.0); length];
            add_turned(&mut sums, &bins, first, step);
            for n in 0..length {
                let turned = Complex64::new(f64::from(i[n]), f64::from(q[n])) * first * step.powu(n as u32);
                // Sizes of one: a few roundings of 2⁻²⁴.
                for (found, expected) in [(mixed[n], turned), (sums[n], turned + 1.0)] {
                    let found = Complex64::new(f64::from(found.re), f64::from(found.im));
                    assert!((found - expected).norm() < 4e-7, "{length} {n}: {found} for {expected}");
                }
            }
            assert!(mixed[length..].iter().all(|&x| x == Complex::default()));
            let mut plain = vec![Complex::default(); length + 3];
            mix_plain(&mut plain, (&i, &q), first, step);
            assert_eq!(plain, mixed);
        }
    }

    #[test]
    fn a_waveform_is_turned_found_and_taken_out_at_every_length() {
        let wave = |n: usize| libm::sinf(0.37 * n as f32);
        let (first, step) = (Complex64::from_polar(0.7, 1.0), Complex64::from_polar(1.0, 0.3));
        for length in (0..20).chain([2599, 2600]) {
            let means: Vec<f32> = (0..length).map(|n| wave(7 * n)).collect();
            let (mut i, mut q): (Vec<f32>, Vec<f32>) = (0..length).map(|n| (wave(n), wave(n + 3))).unzip();
            let mut turned = vec![Complex::default(); length];
            turn(&mut turned, &means, first, step);
            let exact: Vec<Complex64> =
                (0..length).map(|n| first * step.powu(n as u32) * f64::from(means[n])).collect();
            let wide = |x: &Complex<f32>| Complex64::new(f64::from(x.re), f64::from(x.im));
            // Sizes of one: a few roundings of 2⁻²⁴.
            assert!(turned.iter().zip(&exact).all(|(found, exact)| (wide(found) - exact).norm() < 2e-7));
            let mut plain = turned.clone();
            turn_plain(&mut plain, &means, first, step);
            assert_eq!(plain, turned);
            let (sum, energy) = project((&i, &q), &turned);
            assert_eq!(project_plain((&i, &q), &turned), (sum, energy));
            let samples = || i.iter().zip(&q).map(|(i, q)| Complex64::new(f64::from(*i), f64::from(*q)));
            let (expected, squares) = samples().zip(&turned).fold((Complex64::ZERO, 0.0), |(sum, squares), (x, w)| {
                (sum + x * wide(w).conj(), squares + wide(w).norm_sqr())
            });
            // The order of the sum.
            assert!((sum - expected).norm() < 1e-12 * (1.0 + squares) && (energy - squares).abs() <= 1e-12 * squares);
            let by = Complex64::new(0.3, -1.1);
            let left: Vec<Complex64> = samples().zip(&turned).map(|(x, w)| x - wide(w) * by).collect();
            let (mut alone, mut plain_i, mut plain_q) = (i.clone(), i.clone(), q.clone());
            subtract((&mut i, &mut q), &turned, by);
            subtract_plain((&mut plain_i, &mut plain_q), &turned, by);
            subtract((&mut alone, &mut []), &turned, by);
            assert!((&plain_i, &plain_q, &alone) == (&i, &q, &i));
            for n in 0..length {
                assert!((Complex64::new(f64::from(i[n]), f64::from(q[n])) - left[n]).norm() < 4e-7, "{length} {n}");
            }
        }
    }

    #[test]
    fn peak_and_total_are_the_obvious_ones_at_every_length() {
        let powers: Vec<f32> = (0..5000_u32).map(|n| (n.wrapping_mul(2_654_435_761) >> 8) as f32 * 1e-3).collect();
        for length in (0..200).chain([1023, 1024, 1025, 2048, 4999]) {
            for offset in [0, 1, 7] {
                let part = &powers[offset..offset + length.min(5000 - offset)];
                let total: f64 = part.iter().map(|&x| f64::from(x)).sum();
                let (peak, sum) = peak_and_total(part);
                assert_eq!(peak, part.iter().copied().fold(0.0, f32::max), "{length} {offset}");
                assert!((sum - total).abs() <= 4e-6 * total, "{length} {offset}: {sum} for {total}");
                assert_eq!((peak, sum), peak_and_total_plain(part));
            }
        }
    }

    #[test]
    fn a_spectrum_in_16_bits_is_within_half_a_step_of_its_largest_part() {
        let bins: Vec<Complex<f32>> =
            (0..300_u16).map(|n| Complex::new(libm::sinf(f32::from(n)), -3e-5 * f32::from(n))).collect();
        let spectrum = Spectrum::of(&bins);
        // sin 33 is 0.99991.
        let step = 0.99992 / 32_767.0;
        for (bin, kept) in bins.iter().zip(spectrum.bins()) {
            let off = (kept - bin).re.abs().max((kept - bin).im.abs());
            assert!(off <= 0.501 * step, "{bin}: {kept}");
        }
        assert_eq!((spectrum.bins().len(), spectrum.bytes()), (300, 1200));
        assert_eq!(Spectrum::of(&[Complex::default(); 3]).bins(), [Complex::default(); 3]);
    }

    #[test]
    fn products_and_powers_are_the_obvious_ones_at_every_length_and_offset() {
        let wave = |seed: f32| -> Vec<Complex<f32>> {
            (0..200_u8).map(|n| Complex::new(seed + f32::from(n) * 0.37, 3.0 - f32::from(n) * seed)).collect()
        };
        let (a, b) = (wave(0.7), wave(1.3));
        for length in 0..=130 {
            for offset in 0..32 {
                let (spectrum, b) = (Spectrum::of(&a[offset..offset + length]), &b[31 - offset..31 - offset + length]);
                let a = spectrum.bins();
                let mut products = vec![Complex::new(77.0, 77.0); 200];
                let [mut cells, mut between] = [(); 2].map(|()| vec![2.5; 200]);
                let mut plain = products.clone();
                multiply(&mut products[offset..offset + length], &spectrum, b);
                multiply_plain(&mut plain[offset..offset + length], &spectrum, b);
                assert_eq!(plain, products);
                let place = offset..offset + length;
                add_powers(&mut cells[place.clone()], &mut between[place], &a);
                let power = |x: Complex<f32>| 2.5 + (x.re * x.re + x.im * x.im);
                for (n, product) in products.iter().enumerate() {
                    let expected = match n.checked_sub(offset).filter(|n| *n < length) {
                        Some(k) => (
                            Complex::new(a[k].re * b[k].re - a[k].im * b[k].im, a[k].re * b[k].im + a[k].im * b[k].re),
                            [power(a[k]), power(a[k] + a[(k + 1) % length])],
                        ),
                        None => (Complex::new(77.0, 77.0), [2.5; 2]),
                    };
                    assert_eq!((*product, [cells[n], between[n]]), expected, "{length} {offset} {n}");
                }
            }
        }
    }
}
