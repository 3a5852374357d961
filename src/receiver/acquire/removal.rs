//! Taking a found satellite out of the samples.
//!
//! One code period at a time goes, with the amplitude and phase that it shows there. Of a satellite that is
//! stronger than the noise the shape of the chips goes with it: what the samples have of the code at their
//! instants, of its means over them, and of those beside, by least squares. At 2.6 Msps means alone would
//! leave 6 % of the power of C/A in samples that have no filter before them, as simulators make them: edges
//! are in every fifth sample, and a third of its power is missed there. What is left has cross-correlations
//! as the code has.

use nalgebra::DMatrix;
use num_complex::Complex;

use super::grid::Grid;
use super::kernel;
use super::refine::Refined;
use super::replica::Replica;

/// Means to either side of a sample's own that are in the shape of a strong code, a third of a chip or a
/// sample apart.
const BESIDE: usize = 3;
const APART_CHIPS: f64 = 0.35;
/// Parts of that shape: the mean over the sample, the code at its instant, and the means beside it.
const PARTS: usize = 2 + 2 * BESIDE;
/// Share of each part's energy that is added to it. Parts are alike where edges fall between the samples of a
/// rate that is a multiple of the chip rate. This share also bounds the amplitude that is left.
const RIDGE: f64 = 1e-6;

/// Takes a satellite out of the samples. A real recording holds the carrier's cosine only. Returns the mean
/// power of a code period's sum.
pub(super) fn subtract(
    grid: &Grid,
    code_chips: f64,
    replica: &Replica,
    hit: &Refined,
    complex: bool,
    (i, q): (&mut [f32], &mut [f32]),
) -> f64 {
    let step = grid.received_chips_per_sample(hit.doppler_hz);
    let frequency_hz = grid.frequency_hz(hit.doppler_hz);
    let turn = grid.phasor(frequency_hz, 1);
    let mut shape = vec![Vec::new(); if hit.cn0_hz > grid.rate_hz { PARTS } else { 1 }];
    let mut waveform: Vec<Complex<f32>> = Vec::new();
    let (mut from, length) = (0, i.len());
    let (mut power, mut periods) = (0.0, 0_u32);
    for period in 1_u64.. {
        let boundary = ((period as f64 * code_chips - hit.code_phase_chips) / step).ceil().max(0.0) as usize;
        let to = boundary.min(length);
        let start = hit.code_phase_chips + from as f64 * step - (period - 1) as f64 * code_chips;
        let (Some(i), Some(q)) = (i.get_mut(from..to), q.get_mut(from..to)) else { break };
        waveform.resize(i.len(), Complex::default());
        let first = grid.phasor(frequency_hz, from as u64);
        let mut projected = Vec::with_capacity(shape.len());
        for (number, part) in shape.iter_mut().enumerate() {
            part.resize(i.len(), 0.0);
            make(number, replica, (start, step), part);
            kernel::turn(&mut waveform, part, first, turn);
            projected.push(kernel::project((i, q), &waveform));
        }
        power += projected[0].0.norm_sqr();
        periods += 1;
        for (number, amplitude) in amplitudes(&shape, &projected).into_iter().enumerate() {
            // The last part made is the one part of a weak code.
            if shape.len() > 1 {
                kernel::turn(&mut waveform, &shape[number], first, turn);
            }
            if complex {
                kernel::subtract((i, q), &waveform, amplitude);
            } else {
                kernel::subtract((i, &mut []), &waveform, 2.0 * amplitude);
            }
        }
        if boundary >= length {
            break;
        }
        from = to;
    }
    power / f64::from(periods.max(1))
}

/// A part of a code's shape in consecutive samples `step` chips apart, the first at `start` chips.
fn make(number: usize, replica: &Replica, (start, step): (f64, f64), part: &mut [f32]) {
    let apart = step * (APART_CHIPS / step).round().max(1.0);
    let place = (number / 2) as f64 * if number.is_multiple_of(2) { apart } else { -apart };
    match number {
        1 => replica.instants(start, step, part),
        _ => replica.means(start + place - 0.5 * step, step, part),
    }
}

/// Amplitudes of the parts in samples, from the products with the samples and the energy of each part.
fn amplitudes(parts: &[Vec<f32>], projected: &[(Complex<f64>, f64)]) -> Vec<Complex<f64>> {
    let alone = |(sum, energy): &(Complex<f64>, f64)| if *energy > 0.0 { sum / energy } else { Complex::default() };
    if let [one] = projected {
        return vec![alone(one)];
    }
    let product = |a: &[f32], b: &[f32]| a.iter().zip(b).map(|(a, b)| f64::from(*a) * f64::from(*b)).sum::<f64>();
    let count = parts.len();
    let mut products = DMatrix::zeros(count, count);
    for a in 0..count {
        for b in a..count {
            products[(a, b)] = product(&parts[a], &parts[b]);
            products[(b, a)] = products[(a, b)];
        }
        products[(a, a)] *= 1.0 + RIDGE;
    }
    let sums = DMatrix::from_fn(count, 2, |part, side| {
        let (sum, _) = projected[part];
        if side == 0 { sum.re } else { sum.im }
    });
    match products.cholesky() {
        Some(products) => products.solve(&sums).row_iter().map(|row| Complex::new(row[0], row[1])).collect(),
        // Parts without any energy; the first alone takes the most.
        None => projected.iter().take(1).map(alone).collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_in_the_samples_is_found_where_parts_are_alike_as_where_they_are_not() {
        let first: Vec<f32> = (0..60).map(|n| if n * n % 7 < 3 { 1.0 } else { -1.0 }).collect();
        let second: Vec<f32> = (0..60).map(|n| if n % 5 < 2 { 1.0 } else { -0.5 }).collect();
        let found = |parts: &[Vec<f32>], samples: &[f64]| {
            let product = |part: &Vec<f32>| part.iter().zip(samples).map(|(part, x)| f64::from(*part) * x).sum::<f64>();
            let energy = |part: &Vec<f32>| part.iter().map(|x| f64::from(*x) * f64::from(*x)).sum::<f64>();
            let turned = Complex::new(0.6, 0.8);
            let projected: Vec<_> = parts.iter().map(|part| (turned * product(part), energy(part))).collect();
            let amplitudes = amplitudes(parts, &projected);
            let left = (0..samples.len()).map(|n| {
                let taken =
                    parts.iter().zip(&amplitudes).map(|(part, by)| by * f64::from(part[n])).sum::<Complex<f64>>();
                (turned * samples[n] - taken).norm_sqr()
            });
            left.sum::<f64>() / samples.iter().map(|x| x * x).sum::<f64>()
        };
        let samples: Vec<f64> = first.iter().zip(&second).map(|(a, b)| 3.0 * f64::from(*a) + f64::from(*b)).collect();
        let (alone, same) = (vec![first.clone()], vec![first.clone(), first.clone()]);
        let (both, nothing) = (vec![first.clone(), second], vec![first.clone(), vec![0.0; 60]]);
        let of_first: Vec<f64> = first.iter().map(|x| 3.0 * f64::from(*x)).collect();
        for parts in [&alone, &same, &nothing] {
            assert!(found(parts, &of_first) < 1e-11, "{}", found(parts, &of_first));
        }
        assert!(found(&both, &samples) < 1e-11 && found(&alone, &samples) > 0.01);
    }
}
