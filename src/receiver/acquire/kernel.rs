//! The two passes over spectra and lags, compiled for AVX2 too; no operation is fused, so bits do not depend
//! on it.

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

#[cfg(test)]
mod tests {
    use super::*;

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
    fn products_and_powers_are_the_obvious_ones_at_every_length_and_offset() {
        let wave = |seed: f32| -> Vec<Complex<f32>> {
            (0..200_u8).map(|n| Complex::new(seed + f32::from(n) * 0.37, 3.0 - f32::from(n) * seed)).collect()
        };
        let (a, b) = (wave(0.7), wave(1.3));
        for length in 0..=130 {
            for offset in 0..32 {
                let (a, b) = (&a[offset..offset + length], &b[31 - offset..31 - offset + length]);
                let mut products = vec![Complex::new(77.0, 77.0); 200];
                let mut powers = vec![2.5; 200];
                multiply(&mut products[offset..offset + length], a, b);
                add_powers(&mut powers[offset..offset + length], a);
                for (n, (product, power)) in products.iter().zip(&powers).enumerate() {
                    let (expected, sum) = match n.checked_sub(offset).filter(|n| *n < length) {
                        Some(k) => (
                            Complex::new(a[k].re * b[k].re - a[k].im * b[k].im, a[k].re * b[k].im + a[k].im * b[k].re),
                            2.5 + (a[k].re * a[k].re + a[k].im * a[k].im),
                        ),
                        None => (Complex::new(77.0, 77.0), 2.5),
                    };
                    assert_eq!((*product, *power), (expected, sum), "{length} {offset} {n}");
                }
            }
        }
    }
}
