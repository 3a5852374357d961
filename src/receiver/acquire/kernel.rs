//! The two passes over spectra and lags, compiled for AVX2 too; no operation is fused, so bits do not depend on it.

use num_complex::Complex;

/// out = a·b.
pub(super) fn multiply(out: &mut [Complex<f32>], a: &[Complex<f32>], b: &[Complex<f32>]) {
    #[cfg(target_arch = "x86_64")]
    if is_x86_feature_detected!("avx2") {
        // SAFETY: the processor has AVX2.
        unsafe { multiply_avx2(out, a, b) };
        return;
    }
    multiply_plain(out, a, b);
}

/// powers += |x|².
pub(super) fn add_powers(powers: &mut [f32], x: &[Complex<f32>]) {
    #[cfg(target_arch = "x86_64")]
    if is_x86_feature_detected!("avx2") {
        // SAFETY: the processor has AVX2.
        unsafe { add_powers_avx2(powers, x) };
        return;
    }
    add_powers_plain(powers, x);
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn multiply_avx2(out: &mut [Complex<f32>], a: &[Complex<f32>], b: &[Complex<f32>]) {
    multiply_plain(out, a, b);
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn add_powers_avx2(powers: &mut [f32], x: &[Complex<f32>]) {
    add_powers_plain(powers, x);
}

#[inline(always)]
fn multiply_plain(out: &mut [Complex<f32>], a: &[Complex<f32>], b: &[Complex<f32>]) {
    for ((out, a), b) in out.iter_mut().zip(a).zip(b) {
        *out = Complex::new(a.re * b.re - a.im * b.im, a.re * b.im + a.im * b.re);
    }
}

#[inline(always)]
fn add_powers_plain(powers: &mut [f32], x: &[Complex<f32>]) {
    for (power, x) in powers.iter_mut().zip(x) {
        *power += x.re * x.re + x.im * x.im;
    }
}
