//! Laws of the sample kernels: the fast one against the obvious one, the noise, the phases.
#![cfg(feature = "generator")]

use generator::synth::band::Filter;
use generator::synth::chips::CodeTime;
use generator::synth::isa::{Level, accumulate, add_noise};
use generator::synth::lanes::Buffers;
use generator::synth::noise::BLOCK_SAMPLES;
use generator::synth::waveform::{Waveform, plain};
use generator::synth::{CODE_ONE, Edge, Run, reference};
use gnss::gps::l1ca::L1_CA;
use gnss::satellite::Sv;

const CHIP_HZ: f64 = 1.023e6;

struct Case {
    bits: Vec<u64>,
    position: u64,
    step: u64,
}

impl Case {
    fn new(rate_hz: f64, at: CodeTime, samples: usize) -> Self {
        let spreading = plain(&L1_CA, 11).unwrap();
        let step = (CHIP_HZ / rate_hz * CODE_ONE as f64) as u64;
        let mut bits = Vec::new();
        let position = spreading.strip(at, step, samples, |period| period % 2 == 1, &mut bits);
        Self { bits, position, step }
    }

    fn run(&self, amplitude: f64) -> Run<'_> {
        Run {
            bits: &self.bits,
            position: self.position,
            step: self.step,
            turns: 0x1234_5678_9abc_def0,
            turns_step: 0x0765_4321_0fed_cba9,
            amplitude,
            pulse: None,
        }
    }
}

fn edges(filter: &Filter) -> [Edge<'_>; 3] {
    [Edge::Nearest, Edge::Area, Edge::BandLimited(filter)]
}

fn fast(level: Level, edge: Edge<'_>, run: &Run<'_>, samples: usize) -> (Vec<f32>, Vec<f32>) {
    let (mut i, mut q) = (vec![0.0; samples], vec![0.0; samples]);
    accumulate(level, edge, &[&[*run]], &mut i, &mut q, &mut Buffers::default());
    (i, q)
}

#[test]
fn the_fast_kernel_keeps_to_the_reference_at_all_lengths_phases_and_rates() {
    let filter = Filter::default();
    for rate_hz in [1.5e6, 2.046e6, 2.6e6, 25e6, 0.9e6] {
        for edge in edges(&filter) {
            for length in (0..=130).chain([1000, 4096]) {
                // Chip 1020 puts the wrap of the code, with a change of data sign, into the run.
                let phase = 1020 * CODE_ONE + length as u64 * (CODE_ONE / 131);
                let case = Case::new(rate_hz, CodeTime::new(8, phase), length);
                let run = case.run(1.0);
                let (i, q) = fast(Level::Baseline, edge, &run, length);
                let (mut ri, mut rq) = (vec![0.0; length], vec![0.0; length]);
                reference::accumulate(edge, &run, &mut ri, &mut rq);
                for n in 0..length {
                    let error = (i[n] - ri[n]).abs().max((q[n] - rq[n]).abs());
                    // A lane's code phase resolves 2^-27 chip: nearest chips may differ that close to an
                    // edge.
                    let p = run.position + run.step * n as u64;
                    let near_edge = edge_is_nearest(edge) && (p % CODE_ONE).min(CODE_ONE - p % CODE_ONE) < 1 << 22;
                    // Carrier: 2e-7 for each of three sines, 2e-7 for each of seven rotations. An area edge:
                    // two roundings of 2^-27 chip, times 2/0.04. A filter's table: 4e-6 an edge, some edges
                    // at once.
                    let bound = match edge {
                        Edge::Nearest => 2e-6,
                        Edge::Area => 2e-6 + 8e-7,
                        Edge::BandLimited(_) => 2e-5,
                    };
                    assert!(error < bound || near_edge, "{edge:.0?} {rate_hz} {length} {n} {error}");
                }
            }
        }
    }
}

fn edge_is_nearest(edge: Edge<'_>) -> bool {
    matches!(edge, Edge::Nearest)
}

#[test]
fn runs_together_are_the_sum_of_each_by_itself() {
    let filter = Filter::default();
    for rates in [[2.6e6; 5], [25e6; 5], [2.6e6, 0.9e6, 1.5e6, 0.9e6, 25e6]] {
        for length in [1, 31, 32, 33, 1000, 4096] {
            let cases: Vec<Case> = (0..)
                .zip(rates)
                .map(|(k, rate_hz)| Case::new(rate_hz, CodeTime::new(k, 777 * CODE_ONE), length))
                .collect();
            let runs: Vec<Run<'_>> = (1..)
                .zip(&cases)
                .map(|(k, case)| Run { turns_step: k << 55, ..case.run(1.0 / f64::from(k as u32)) })
                .collect();
            for edge in edges(&filter) {
                let (mut i, mut q) = (vec![0.0; length], vec![0.0; length]);
                let rays: Vec<&[Run<'_>]> = runs.chunks(1).collect();
                accumulate(Level::detect(), edge, &rays, &mut i, &mut q, &mut Buffers::default());
                let single: Vec<_> = runs.iter().map(|run| fast(Level::detect(), edge, run, length)).collect();
                for n in 0..length {
                    let (si, sq) =
                        single.iter().fold((0.0, 0.0), |(si, sq), (i, q)| (si + f64::from(i[n]), sq + f64::from(q[n])));
                    let (di, dq) = (f64::from(i[n]) - si, f64::from(q[n]) - sq);
                    // Five additions of numbers below three, rounded to half of 2^-22 each.
                    assert!(di.abs().max(dq.abs()) < 6e-7, "{edge:.0?} {rates:?} {length} {n} {di} {dq}");
                }
            }
        }
    }
}

#[test]
fn the_carrier_of_the_fast_kernel_is_within_a_millionth_of_a_cycle_and_has_no_spur_above_minus_110_dbc() {
    use std::f64::consts::TAU;
    const LENGTH: usize = 4096;
    let bits = [0; 128];
    for turns_step in [0, 1 << 40, 0x0123_4567_89ab_cdef, 0x4000_0000_0000_0001, 0x7654_3210_fedc_ba98, u64::MAX / 3] {
        for edge in [Edge::Nearest, Edge::Area] {
            let run = Run {
                bits: &bits,
                position: 200 * CODE_ONE,
                step: CODE_ONE / 3,
                turns: 0xfedc << 44,
                turns_step,
                amplitude: 1.0,
                pulse: None,
            };
            let (i, q) = fast(Level::detect(), edge, &run, LENGTH);
            // What is left of the samples on the true carrier.
            let left: Vec<(f64, f64)> = (0_u64..)
                .zip(i.iter().zip(&q))
                .map(|(n, (i, q))| {
                    let turns = run.turns.wrapping_add(turns_step.wrapping_mul(n));
                    let (sin, cos) = libm::sincos(turns as f64 / 18_446_744_073_709_551_616.0 * TAU);
                    let (i, q) = (f64::from(*i), f64::from(*q));
                    (i * cos + q * sin - 1.0, q * cos - i * sin)
                })
                .collect();
            let worst = left.iter().fold(0.0_f64, |worst, (_, im)| worst.max(im.abs())) / TAU;
            assert!(worst < 1e-6, "{turns_step:x} {worst}");
            // No line of a spectrum is above the largest value in time.
            let spur = left.iter().fold(0.0_f64, |worst, (re, im)| worst.max((re * re + im * im).sqrt()));
            assert!(20.0 * libm::log10(spur.max(1e-20)) < -110.0, "{turns_step:x} {spur}");
        }
    }
}

#[test]
fn every_instruction_set_gives_the_same_bits() {
    let filter = Filter::default();
    for level in Level::ALL.into_iter().filter(|level| level.is_available()) {
        for rate_hz in [0.7e6, 1.5e6, 2.6e6, 60e6] {
            for length in [1, 31, 32, 33, 500, 4096] {
                let case = Case::new(rate_hz, CodeTime::new(3, 1000 * CODE_ONE + 12345), length);
                for edge in edges(&filter) {
                    let run = case.run(0.3);
                    assert_eq!(fast(level, edge, &run, length), fast(Level::Baseline, edge, &run, length), "{level:?}");
                }
            }
        }
        let draw = |level| {
            let (mut i, mut q) = (vec![0.0; BLOCK_SAMPLES], vec![0.0; BLOCK_SAMPLES]);
            add_noise(level, 7, 123, 3.0, &mut i, &mut q);
            (i, q)
        };
        assert_eq!(draw(level), draw(Level::Baseline), "{level:?}");
    }
}

#[test]
fn every_code_edge_keeps_the_mean_power_of_the_waveform() {
    let filter = Filter::default();
    let waveform = Waveform::new(L1_CA.link(Sv::gps(11)), 0).unwrap().unwrap();
    for rate_hz in [0.6e6, 1.5e6, 2.6e6, 10e6] {
        for edge in edges(&filter) {
            let gain = 1.0 / waveform.power(edge, rate_hz).sqrt();
            let mut sum = 0.0;
            let mut count = 0;
            for k in 0..40 {
                let at = CodeTime::new(0, k * 25 * CODE_ONE + k * (CODE_ONE / 40));
                let case = Case::new(rate_hz, at, 4096);
                let run = case.run(gain);
                let (i, q) = fast(Level::detect(), edge, &run, 4096);
                sum += i.iter().zip(&q).map(|(i, q)| f64::from(i * i + q * q)).sum::<f64>();
                count += 4096;
            }
            // 40 runs over whole periods: the chips' own patterns leave a fraction of a percent.
            let power = sum / f64::from(count);
            assert!((power - 1.0).abs() < 0.01, "{edge:?} {rate_hz} {power}");
        }
    }
}

/// Fourier coefficient of harmonic `k` of one period.
fn harmonic(x: &[f64], k: usize) -> (f64, f64) {
    let length = x.len();
    x.iter().enumerate().fold((0.0, 0.0), |(re, im), (n, x)| {
        let (sin, cos) = libm::sincos(-std::f64::consts::TAU * ((n * k) % length) as f64 / length as f64);
        (re + x * cos, im + x * sin)
    })
}

/// Distance in metres of the best match of the code with one period of samples behind the true position. It
/// is the zero of early minus late, half a chip apart, of the continuous correlation with the code below half
/// the sample rate.
///
/// Computed by Fourier series: the code's harmonics `k` kHz, from its chips and the pulse's sinc, times those
/// of the samples.
fn code_bias_m(edge: Edge<'_>, rate_khz: usize, start_chips: f64) -> f64 {
    use std::f64::consts::{PI, TAU};
    let spreading = plain(&L1_CA, 11).unwrap();
    let chips: Vec<f64> = (L1_CA.components[0].code)(11).unwrap().iter().map(|&chip| f64::from(chip)).collect();
    let step = (1023.0 / rate_khz as f64 * CODE_ONE as f64) as u64;
    let mut bits = Vec::new();
    let at = CodeTime::new(0, (start_chips * CODE_ONE as f64) as u64);
    let position = spreading.strip(at, step, rate_khz, |_| false, &mut bits);
    let run = Run { bits: &bits, position, step, turns: 0, turns_step: 0, amplitude: 1.0, pulse: None };
    let wave: Vec<f64> = fast(Level::detect(), edge, &run, rate_khz).0.into_iter().map(f64::from).collect();
    let cross: Vec<(f64, f64)> = (1..rate_khz.div_ceil(2))
        .map(|k| {
            let ((a, b), (c, d)) = (harmonic(&wave, k), harmonic(&chips, k));
            // The pulse from 0 to 1 chip: sinc, and half a chip of delay; the samples start at `start_chips`.
            let x = PI * k as f64 / 1023.0;
            let pulse = libm::sin(x) / x;
            let (sin, cos) = libm::sincos(TAU * k as f64 * (0.5 - start_chips) / 1023.0);
            let (re, im) = (a * c + b * d, b * c - a * d);
            ((re * cos - im * sin) * pulse, (re * sin + im * cos) * pulse)
        })
        .collect();
    let correlation = |delay_chips: f64| {
        cross.iter().enumerate().fold(0.0, |sum, (k, (re, im))| {
            let (sin, cos) = libm::sincos(TAU * (k + 1) as f64 * delay_chips / 1023.0);
            sum + re * cos - im * sin
        })
    };
    let (mut low, mut high) = (-0.2, 0.2);
    for _ in 0..25 {
        let middle: f64 = 0.5 * (low + high);
        if correlation(middle + 0.25) > correlation(middle - 0.25) { low = middle } else { high = middle }
    }
    0.5 * (low + high) * 299_792_458.0 / CHIP_HZ
}

#[test]
fn band_limited_edges_leave_no_code_bias_and_area_edges_none_once_the_phase_moves() {
    let filter = Filter::default();
    let starts: Vec<f64> = (0..24).map(|k| f64::from(k) * 0.618_034 % 1.0 + f64::from(k * 37)).collect();
    let [nearest, area, band] = edges(&filter).map(|edge| {
        let bias: Vec<f64> = starts.iter().map(|&start| code_bias_m(edge, 2600, start)).collect();
        let mean = bias.iter().sum::<f64>() / bias.len() as f64;
        let rms = (bias.iter().map(|b| b * b).sum::<f64>() / bias.len() as f64).sqrt();
        println!("code bias at 2.6 Msps, {:.4}: mean {mean:.4} rms {rms:.4} m", format!("{edge:?}"));
        (mean, rms)
    });
    // A Doppler of 1 kHz moves the code by 0.65 chip a second past the sampling grid: what a loop of 1 Hz
    // sees is the mean over phases; with no Doppler at all it is one draw of that rms.
    assert!(band.1 < 0.05, "{band:?}");
    assert!(area.0.abs() < 0.1 && area.1 < 0.25 && nearest.1 > 2.0 * area.1, "{area:?} {nearest:?}");
}

fn noise(seed: u64, blocks: u64) -> (Vec<f64>, Vec<f64>) {
    let (mut i, mut q) = (Vec::new(), Vec::new());
    for block in 0..blocks {
        let (mut bi, mut bq) = (vec![0.0; BLOCK_SAMPLES], vec![0.0; BLOCK_SAMPLES]);
        add_noise(Level::detect(), seed, block, 1.0, &mut bi, &mut bq);
        i.extend(bi.into_iter().map(f64::from));
        q.extend(bq.into_iter().map(f64::from));
    }
    (i, q)
}

#[test]
fn the_noise_is_gaussian_to_the_sixth_moment_and_in_its_tails() {
    let (i, q) = noise(1, 2000);
    let count = (2 * i.len()) as f64;
    let all = || i.iter().chain(&q);
    let moment = |k: i32| all().map(|x| x.powi(k)).sum::<f64>() / count;
    // Var(x^k) = (2k−1)!! − E(x^k)²; five standard deviations of the mean.
    for (k, mean, variance) in
        [(1, 0.0, 1.0), (2, 1.0, 2.0), (3, 0.0, 15.0), (4, 3.0, 96.0), (5, 0.0, 945.0), (6, 15.0, 10_170.0)]
    {
        let bar = 5.0 * f64::sqrt(variance / count);
        assert!((moment(k) - mean).abs() < bar, "moment {k}: {} not {mean} within {bar}", moment(k));
    }
    // Two-sided tail probabilities; Poisson counts within five sigma.
    for (sigma, probability) in [(3.0, 2.699_796e-3), (4.0, 6.334_248e-5), (5.0, 5.733_031e-7)] {
        let expected = count * probability;
        let seen = all().filter(|x| x.abs() > sigma).count() as f64;
        assert!((seen - expected).abs() < 5.0 * expected.sqrt() + 1.0, "{sigma}: {seen} of {expected}");
    }
    // 64 bins from −4 to 4 by the error function; 5 sigma of chi-square with 65 degrees is 57.
    let edge = |k: usize| -4.0 + k as f64 / 8.0;
    let mut bins = [0.0_f64; 66];
    all().for_each(|x| bins[(((x + 4.0) * 8.0).floor() + 1.0).clamp(0.0, 65.0) as usize] += 1.0);
    let cdf = |x: f64| 0.5 * libm::erfc(-x / std::f64::consts::SQRT_2);
    let chi: f64 = (0..66)
        .map(|k| {
            let low = if k == 0 { 0.0 } else { cdf(edge(k - 1)) };
            let high = if k == 65 { 1.0 } else { cdf(edge(k)) };
            let expected = (high - low) * count;
            (bins[k] - expected).powi(2) / expected
        })
        .sum();
    assert!((chi - 65.0).abs() < 57.0, "chi-square {chi}");
}

#[test]
fn the_noise_is_white_and_its_components_and_seeds_are_independent() {
    let (i, q) = noise(2, 500);
    let (other, _) = noise(3, 500);
    let n = i.len() as f64;
    // Each mean of products of independent unit normals has standard deviation 1/√n; five of them.
    let bar = 5.0 / n.sqrt();
    let against = |a: &[f64], b: &[f64], lag: usize| a.iter().zip(&b[lag..]).map(|(a, b)| a * b).sum::<f64>() / n;
    for lag in [1, 2, 3, 16, 31, 32, 33, 64, 4095, 4096, 4097] {
        assert!(against(&i, &i, lag).abs() < bar && against(&i, &q, lag).abs() < bar, "{lag}");
    }
    assert!(against(&i, &q, 0).abs() < bar && against(&i, &other, 0).abs() < bar);
    let squares = |a: &[f64]| a.iter().map(|x| x * x - 1.0).collect::<Vec<_>>();
    // Squares too: what radius and angle share would show here.
    assert!(against(&squares(&i), &squares(&q), 0).abs() < 2.0 * bar);
    assert!(against(&squares(&i), &squares(&i), 1).abs() < 2.0 * bar);
}
