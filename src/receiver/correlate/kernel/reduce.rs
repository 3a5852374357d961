//! Sums of a block: its power, and sixteen lanes turned and folded into one number.

#[cfg(target_arch = "x86_64")]
use std::arch::x86_64 as x86;

use num_complex::Complex64;

use super::super::carrier::LANES;
use super::super::single::CHUNK;
use super::Level;

/// Σ |x|², in sixteen lanes of 64 terms each in `f32`, the rest in `f64`.
pub(in crate::correlate) fn power(level: Level, i: &[f32], q: &[f32]) -> f64 {
    match level {
        Level::Baseline => power_lanes(i, q),
        // SAFETY: a `Level` beyond the baseline is one that was detected.
        #[cfg(target_arch = "x86_64")]
        Level::Avx2 | Level::Avx512 => unsafe { power_avx2(i, q) },
    }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn power_avx2(i: &[f32], q: &[f32]) -> f64 {
    power_lanes(i, q)
}

#[inline(always)]
fn power_lanes(i: &[f32], q: &[f32]) -> f64 {
    let mut total = 0.0;
    for (i, q) in i.chunks(CHUNK).zip(q.chunks(CHUNK)) {
        let (vectors_i, rest_i) = i.as_chunks::<LANES>();
        let (vectors_q, rest_q) = q.as_chunks::<LANES>();
        let mut lanes = [0.0_f32; LANES];
        for (i, q) in vectors_i.iter().zip(vectors_q) {
            for k in 0..LANES {
                lanes[k] += i[k] * i[k] + q[k] * q[k];
            }
        }
        for (lane, (i, q)) in lanes.iter_mut().zip(rest_i.iter().zip(rest_q)) {
            *lane += i * i + q * q;
        }
        total += lanes.iter().map(|&x| f64::from(x)).sum::<f64>();
    }
    total
}

/// Σ i² + q² of short integers within ±2048.
pub(in crate::correlate) fn fixed_power(level: Level, i: &[i16], q: &[i16]) -> f64 {
    match level {
        Level::Baseline => fixed_power_lanes(i, q),
        // SAFETY: a `Level` beyond the baseline is one that was detected.
        #[cfg(target_arch = "x86_64")]
        Level::Avx2 | Level::Avx512 => unsafe { fixed_power_avx2(i, q) },
    }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn fixed_power_avx2(i: &[i16], q: &[i16]) -> f64 {
    fixed_power_lanes(i, q)
}

#[inline(always)]
fn fixed_power_lanes(i: &[i16], q: &[i16]) -> f64 {
    let mut total = 0_u64;
    for plane in [i, q] {
        // 128 squares up to 2²² stay below 2³².
        for part in plane.chunks(128) {
            let mut sum = 0_u32;
            for &x in part {
                sum = sum.wrapping_add((i32::from(x) * i32::from(x)) as u32);
            }
            total += u64::from(sum);
        }
    }
    total as f64
}

/// Sixteen numbers by their parts.
type Parts<'a> = [&'a [f64; LANES]; 2];

/// The sum of sixteen numbers, each turned back by its turn. A loop over lanes within one over taps would be
/// made into one over taps, with gathered numbers.
#[inline(always)]
pub(in crate::correlate) fn fold(numbers: Parts<'_>, turns: Parts<'_>) -> Complex64 {
    #[cfg(target_arch = "x86_64")]
    if is_x86_feature_detected!("avx2") {
        // SAFETY: the processor has AVX2.
        return unsafe { fold_avx2(numbers, turns) };
    }
    fold_plain(numbers, turns)
}

pub(in crate::correlate) fn fold_plain([re, im]: Parts<'_>, [turn_re, turn_im]: Parts<'_>) -> Complex64 {
    let (mut turned_re, mut turned_im) = ([0.0; LANES], [0.0; LANES]);
    for k in 0..LANES {
        turned_re[k] = re[k] * turn_re[k] + im[k] * turn_im[k];
        turned_im[k] = im[k] * turn_re[k] - re[k] * turn_im[k];
    }
    Complex64::new(sum(turned_re), sum(turned_im))
}

/// Halves added to each other until one is left.
#[inline(always)]
fn sum(mut x: [f64; LANES]) -> f64 {
    let mut half = LANES / 2;
    while half > 0 {
        for k in 0..half {
            x[k] += x[k + half];
        }
        half /= 2;
    }
    x[0]
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
#[inline]
fn fold_avx2([re, im]: Parts<'_>, [turn_re, turn_im]: Parts<'_>) -> Complex64 {
    let mut re_sums = [x86::_mm256_setzero_pd(); 4];
    let mut im_sums = [x86::_mm256_setzero_pd(); 4];
    for k in 0..4 {
        // SAFETY: four numbers are at each, and any alignment will do.
        let [re, im, turn_re, turn_im] =
            [re, im, turn_re, turn_im].map(|of| unsafe { x86::_mm256_loadu_pd(of.as_ptr().add(4 * k)) });
        re_sums[k] = x86::_mm256_add_pd(x86::_mm256_mul_pd(re, turn_re), x86::_mm256_mul_pd(im, turn_im));
        im_sums[k] = x86::_mm256_sub_pd(x86::_mm256_mul_pd(im, turn_re), x86::_mm256_mul_pd(re, turn_im));
    }
    Complex64::new(sum_avx2(re_sums), sum_avx2(im_sums))
}

/// [`sum`] of four by four numbers.
#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
#[inline]
fn sum_avx2(fours: [x86::__m256d; 4]) -> f64 {
    let eight = [x86::_mm256_add_pd(fours[0], fours[2]), x86::_mm256_add_pd(fours[1], fours[3])];
    let four = x86::_mm256_add_pd(eight[0], eight[1]);
    let two = x86::_mm_add_pd(x86::_mm256_castpd256_pd128(four), x86::_mm256_extractf128_pd::<1>(four));
    x86::_mm_cvtsd_f64(x86::_mm_add_sd(two, x86::_mm_unpackhi_pd(two, two)))
}
