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
