//! Sums over the samples of a block: the covariance of the elements, and the stream.
//!
//! A jammer may be 60 dB over the noise, whose part of the covariance must not be lost: products are summed
//! in f64. The stream itself is f32, 140 dB below its largest sample.

use nalgebra::{DMatrix, DVector};
use num_complex::Complex64;

use crate::source::Planes;
use gnss::samples::Format;

/// Samples that are taken at a time, so that planes of all elements stay in the first-level cache.
const PIECE: usize = 128;
/// Sums side by side.
const LANES: usize = 8;

/// Mean over the samples of `x xᴴ`, x the elements' samples.
pub fn covariance(planes: &[Planes]) -> DMatrix<Complex64> {
    let (count, samples) = (planes.len(), planes.first().map_or(0, |planes| planes.i.len()));
    let mut sums = vec![[[0.0_f64; LANES]; 2]; count * count];
    let mut wide = vec![[[0.0_f64; PIECE]; 2]; count];
    for from in (0..samples).step_by(PIECE) {
        for ([wi, wq], own) in wide.iter_mut().zip(planes) {
            for (wide, plane) in [(wi, &own.i), (wq, &own.q)] {
                let piece = plane.get(from..samples.min(from + PIECE)).unwrap_or_default();
                wide.fill(0.0);
                wide.iter_mut().zip(piece).for_each(|(wide, x)| *wide = f64::from(*x));
            }
        }
        for (j, a) in wide.iter().enumerate() {
            for (k, b) in wide.iter().enumerate().take(j + 1) {
                if let Some(sum) = sums.get_mut(j * count + k) {
                    product(a, b, sum);
                }
            }
        }
    }
    let mean = |j: usize, k: usize| {
        let [re, im] = sums.get(j * count + k).map_or([0.0; 2], |sums| sums.map(|lanes| lanes.iter().sum::<f64>()));
        Complex64::new(re, im) / samples.max(1) as f64
    };
    DMatrix::from_fn(count, count, |j, k| if j >= k { mean(j, k) } else { mean(k, j).conj() })
}

/// Adds `a · conj(b)` of a piece to the sums of its real and imaginary parts.
fn product([ai, aq]: &[[f64; PIECE]; 2], [bi, bq]: &[[f64; PIECE]; 2], [re, im]: &mut [[f64; LANES]; 2]) {
    let a = ai.as_chunks::<LANES>().0.iter().zip(aq.as_chunks::<LANES>().0);
    let b = bi.as_chunks::<LANES>().0.iter().zip(bq.as_chunks::<LANES>().0);
    for ((ai, aq), (bi, bq)) in a.zip(b) {
        for k in 0..LANES {
            re[k] += ai[k] * bi[k] + aq[k] * bq[k];
            im[k] += aq[k] * bi[k] - ai[k] * bq[k];
        }
    }
}

/// Stream `wᴴ x` in [`Format::Cf32Le`].
pub fn formed(planes: &[Planes], weights: &DVector<Complex64>) -> Vec<u8> {
    let samples = planes.first().map_or(0, |planes| planes.i.len());
    let (mut i, mut q) = (vec![0.0_f32; samples], vec![0.0_f32; samples]);
    for (own, weight) in planes.iter().zip(weights.iter()) {
        let (re, im) = (weight.re as f32, weight.im as f32);
        for ((yi, yq), (xi, xq)) in i.iter_mut().zip(&mut q).zip(own.i.iter().zip(&own.q)) {
            *yi += re * xi + im * xq;
            *yq += re * xq - im * xi;
        }
    }
    let mut bytes = Vec::new();
    Format::Cf32Le.pack(&i, &q, &mut bytes);
    bytes
}
