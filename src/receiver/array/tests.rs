//! Filtered samples against closed forms: signal to noise and jammers, loss of a finite covariance, errors of
//! channels.

use nalgebra::{DMatrix, DVector, Vector3};
use num_complex::Complex64;

use super::*;
use gnss::time::Rate;

const L1_HZ: f64 = 1_575.42e6;
const WAVE_M: f64 = 299_792_458.0 / L1_HZ;

/// A circle of elements half a wavelength from the one before, or with one in the middle from five on.
fn places(count: usize) -> Vec<[f64; 3]> {
    let ring = if count < 5 { count } else { count - 1 };
    let radius_m = 0.25 * WAVE_M / libm::sin(std::f64::consts::PI / ring as f64);
    let of = |k: usize| {
        let (sin, cos) = libm::sincos(std::f64::consts::TAU * k as f64 / ring as f64);
        [radius_m * cos, radius_m * sin, 0.0]
    };
    let middle = (ring < count).then_some([0.0; 3]);
    middle.into_iter().chain((0..ring).map(of)).collect()
}

fn towards(azimuth_deg: f64, elevation_deg: f64) -> Vector3<f64> {
    let (sin_a, cos_a) = libm::sincos(azimuth_deg.to_radians());
    let (sin_e, cos_e) = libm::sincos(elevation_deg.to_radians());
    Vector3::new(cos_e * cos_a, cos_e * sin_a, -sin_e)
}

/// Numbers of a normal distribution by splitmix64 and Box and Muller: no generator of the project.
pub(super) struct Random(pub u64);

impl Random {
    pub fn uniform(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / 9_007_199_254_740_992.0
    }

    /// Complex number of unit power.
    pub fn complex(&mut self) -> Complex64 {
        let size = (-libm::log(1.0 - self.uniform())).sqrt();
        Complex64::from_polar(size, std::f64::consts::TAU * self.uniform())
    }
}

/// Directions of jammers, low over the horizon, and that of the satellite.
const JAMMERS: [(f64, f64); 6] = [(20.0, 5.0), (140.0, 10.0), (255.0, 3.0), (80.0, 15.0), (310.0, 8.0), (200.0, 12.0)];
const SATELLITE: (f64, f64) = (65.0, 55.0);

/// Answers of the elements to the jammers.
fn answers(places: &[[f64; 3]], count: usize) -> Vec<DVector<Complex64>> {
    JAMMERS.iter().take(count).map(|(a, e)| steering(places, &towards(*a, *e), L1_HZ)).collect()
}

/// Covariance of noise of unit power and of jammers of power `power` each.
fn exact(answers: &[DVector<Complex64>], elements: usize, power: f64) -> DMatrix<Complex64> {
    let noise = DMatrix::<Complex64>::identity(elements, elements);
    answers.iter().fold(noise, |sum, a| sum + a * a.adjoint() * Complex64::from(power))
}

/// Largest ratio of signal to noise and jammers, `aᴴR⁻¹a`. By factors: nalgebra inverts four rows by
/// cofactors, which lose half of the digits.
fn best(covariance: &DMatrix<Complex64>, a: &DVector<Complex64>) -> f64 {
    a.dotc(&covariance.clone().lu().solve(a).unwrap()).re
}

fn sinr(weights: &DVector<Complex64>, a: &DVector<Complex64>, covariance: &DMatrix<Complex64>) -> f64 {
    weights.dotc(a).norm_sqr() / weights.dotc(&(covariance * weights)).re
}

/// Samples of noise and jammers, as a format packs them with `lsb` a noise deviation.
fn packed(
    random: &mut Random,
    (answers, elements, power): (&[DVector<Complex64>], usize, f64),
    samples: usize,
    (format, lsb): (Format, f64),
) -> Vec<Vec<u8>> {
    let mut planes = vec![(Vec::new(), Vec::new()); elements];
    for _ in 0..samples {
        let jammers: Vec<Complex64> = answers.iter().map(|_| random.complex() * power.sqrt()).collect();
        for (k, (i, q)) in planes.iter_mut().enumerate() {
            let wave: Complex64 = answers.iter().zip(&jammers).map(|(a, jammer)| a[k] * jammer).sum();
            let x = (wave + random.complex()) * lsb;
            i.push(x.re as f32);
            q.push(x.im as f32);
        }
    }
    let pack = |(i, q): &(Vec<f32>, Vec<f32>)| {
        let mut bytes = Vec::new();
        format.pack(i, q, &mut bytes);
        bytes
    };
    planes.iter().map(pack).collect()
}

fn metadata(format: Format) -> IfMetadata {
    IfMetadata { format, rate: Rate::from_hz(4e6).unwrap(), center_hz: L1_HZ, inverted: false, start: None }
}

/// Settings of a beam towards the satellite.
fn beam(places: &[[f64; 3]], block_ms: f64, loading_db: f64) -> ArraySettings {
    ArraySettings {
        filter: SpatialFilter::Mvdr,
        block_ms,
        loading_db,
        lever_arms_m: places.to_vec(),
        azimuth_deg: SATELLITE.0,
        elevation_deg: SATELLITE.1,
        ..ArraySettings::default()
    }
}

#[test]
fn the_beam_s_signal_over_noise_and_jammers_is_that_of_the_exact_covariance() {
    let mut random = Random(1);
    for elements in [4, 7] {
        let places = places(elements);
        let a = steering(&places, &towards(SATELLITE.0, SATELLITE.1), L1_HZ);
        for jammers in 1..elements {
            let answers = answers(&places, jammers);
            // In 4 MHz a satellite of 45 dB-Hz lies 21 dB below the noise: jammers 40 to 70 dB above it.
            for js_db in [40.0, 55.0, 70.0] {
                let power = libm::pow(10.0, (js_db - 21.0) / 10.0);
                let covariance = exact(&answers, elements, power);
                let best = best(&covariance, &a);
                let bytes = packed(&mut random, (&answers, elements, power), 4000, (Format::Cf32Le, 1.0));
                let inputs: Vec<Packed<'_>> = bytes.iter().map(|b| Packed::new(0, Format::Cf32Le, b)).collect();
                for loading_db in [-100.0, -10.0] {
                    let formats = vec![metadata(Format::Cf32Le); elements];
                    let mut former = Former::new(&formats, &beam(&places, 1.0, loading_db)).unwrap();
                    let mut stream = Vec::new();
                    former.form(&inputs, &mut stream).unwrap();
                    let off_db = 10.0 * libm::log10(sinr(former.last.as_ref().unwrap(), &a, &covariance) / best);
                    assert!(off_db.abs() < 0.5, "{elements} elements, {jammers} jammers, {js_db} dB: {off_db} dB");
                    // The stream's power is the noise and jammers that the weights leave.
                    let samples = Format::Cf32Le.unpack_complex(&stream);
                    let power = samples.iter().map(|x| f64::from(x.norm_sqr())).sum::<f64>() / 4000.0;
                    // Five deviations of the mean of 4000 samples, 1.6 % each, and what loading leaves.
                    assert!((power * best - 1.0).abs() < 0.09, "{elements} {jammers} {js_db}: {}", power * best);
                }
            }
        }
    }
}

/// Expected share of the best SINR from `samples` samples: Reed, Mallett and Brennan 1974, equation (33).
fn reed_mallett_brennan(elements: f64, samples: f64) -> f64 {
    (samples + 2.0 - elements) / (samples + 1.0)
}

#[test]
fn the_loss_of_a_finite_covariance_is_that_of_reed_mallett_and_brennan() {
    const TRIALS: usize = 400;
    let mut random = Random(2);
    for elements in [4, 7] {
        let places = places(elements);
        let a = steering(&places, &towards(SATELLITE.0, SATELLITE.1), L1_HZ);
        let answers = answers(&places, 2);
        let covariance = exact(&answers, elements, 1e4);
        let best = best(&covariance, &a);
        for samples in [2 * elements, 4 * elements, 200] {
            let formats = vec![metadata(Format::Cf32Le); elements];
            let mut former = Former::new(&formats, &beam(&places, samples as f64 / 4e3, -100.0)).unwrap();
            assert_eq!(former.block_samples(), samples as u64);
            let mut sum = 0.0;
            for _ in 0..TRIALS {
                let bytes = packed(&mut random, (&answers, elements, 1e4), samples, (Format::Cf32Le, 1.0));
                let inputs: Vec<Packed<'_>> = bytes.iter().map(|b| Packed::new(0, Format::Cf32Le, b)).collect();
                former.form(&inputs, &mut Vec::new()).unwrap();
                sum += sinr(former.last.as_ref().unwrap(), &a, &covariance) / best;
            }
            // A beta distribution of K + 2 − N and N − 1: its variance, and five standard errors.
            let (n, k) = (elements as f64, samples as f64);
            let expected = reed_mallett_brennan(n, k);
            let deviation = (expected * (1.0 - expected) / (k + 2.0) / TRIALS as f64).sqrt();
            let found = sum / TRIALS as f64;
            assert!((found - expected).abs() < 5.0 * deviation, "{elements} {samples}: {found} {expected}");
        }
    }
}

#[test]
fn errors_of_channels_leave_the_null_and_take_from_the_beam_by_their_variance() {
    const TRIALS: usize = 300;
    let mut random = Random(3);
    let (elements, sigma_rad, power) = (7, 0.2, 1e5);
    let places = places(elements);
    let a = steering(&places, &towards(SATELLITE.0, SATELLITE.1), L1_HZ);
    let answers = answers(&places, 1);
    let (mut gain, mut deepest, mut fixed) = (0.0, f64::INFINITY, 0.0);
    let ideal = weights(&exact(&answers, elements, power), &a, 0.0).unwrap();
    for _ in 0..TRIALS {
        // Real parts of complex numbers of unit power have the variance 1/2.
        let errors = DVector::from_fn(elements, |_, _| {
            Complex64::from_polar(1.0, sigma_rad * std::f64::consts::SQRT_2 * random.complex().re)
        });
        let jammer = answers[0].component_mul(&errors);
        let own = weights(&exact(std::slice::from_ref(&jammer), elements, power), &a, 0.0).unwrap();
        // Weights from the samples do not know the errors, and null what comes.
        deepest = f64::min(deepest, -10.0 * libm::log10(own.dotc(&jammer).norm_sqr()));
        fixed += ideal.dotc(&jammer).norm_sqr() / TRIALS as f64;
        let quiet = weights(&DMatrix::identity(elements, elements), &a, 0.0).unwrap();
        gain += quiet.dotc(&a.component_mul(&errors)).norm_sqr() / TRIALS as f64;
    }
    // Noise of unit power against 50 dB: the null's depth is about twice that.
    assert!(deepest > 80.0, "{deepest} dB");
    // Weights for other channels have a null as deep as the errors' variance (van Trees 2002, section 2.6.3),
    // and a beam with exp(−σ²) of its power and a share of the rest.
    let spread = 1.0 - libm::exp(-sigma_rad * sigma_rad);
    let depth = spread * ideal.norm_squared();
    assert!((10.0 * libm::log10(fixed / depth)).abs() < 1.0, "{fixed} {depth}");
    let expected = 1.0 - spread * (1.0 - 1.0 / elements as f64);
    assert!((gain - expected).abs() < 0.01, "{gain} {expected}");
}

#[test]
fn power_inversion_keeps_the_first_element_and_removes_the_jammer() {
    let mut random = Random(4);
    let places = places(4);
    let answers = answers(&places, 1);
    // Sixteen bits with a noise of 40 LSB: rounding adds 2e-4 of the noise.
    let bytes = packed(&mut random, (&answers, 4, 1e4), 12_000, (Format::Ci16Le, 40.0));
    let inputs: Vec<Packed<'_>> = bytes.iter().map(|b| Packed::new(0, Format::Ci16Le, b)).collect();
    let formats = vec![metadata(Format::Ci16Le); 4];
    let settings = ArraySettings { block_ms: 1.0, ..ArraySettings::default() };
    let mut former = Former::new(&formats, &settings).unwrap();
    assert_eq!(former.metadata().format, Format::Cf32Le);
    let mut stream = Vec::new();
    former.form(&inputs, &mut stream).unwrap();
    let weights = former.last.clone().unwrap();
    assert!((weights[0] - Complex64::ONE).norm() < 1e-9);
    let formed = former.formed();
    // Least power with the first weight at 1: 1/(R⁻¹)₁₁ of 10001 before, with one loading.
    let first = DVector::from_fn(4, |k, _| if k == 0 { Complex64::ONE } else { Complex64::ZERO });
    let expected_db = 10.0 * libm::log10(10_001.0 * best(&exact(&answers, 4, 1e4), &first));
    assert!((formed.rejected_db.unwrap() - expected_db).abs() < 0.1, "{formed} {expected_db}");
    assert_eq!((formed.blocks, formed.elements), (3, 4));
    assert_eq!(stream.len(), 12_000 * 8);
    // The rest of a block has the weights of the last one.
    let rest: Vec<Packed<'_>> = bytes.iter().map(|b| Packed::new(12_000, Format::Ci16Le, &b[..400])).collect();
    former.form(&rest, &mut stream).unwrap();
    let own = Format::Cf32Le.unpack_complex(&stream);
    let input = |k: usize| Format::Ci16Le.unpack_complex(&bytes[k][..400]);
    let inputs: Vec<_> = (0..4).map(input).collect();
    for (n, y) in own.iter().enumerate() {
        let sum: Complex64 =
            (0..4).map(|k| weights[k].conj() * Complex64::new(inputs[k][n].re.into(), inputs[k][n].im.into())).sum();
        assert!((Complex64::new(y.re.into(), y.im.into()) - sum).norm() < 0.01, "{n}");
    }
    assert_eq!((own.len(), former.last), (100, Some(weights)));
}

#[test]
fn samples_that_are_not_those_of_one_array_are_refused_by_name() {
    let refused =
        |metadata: &[IfMetadata], settings: &ArraySettings| Former::new(metadata, settings).unwrap_err().to_string();
    let (usual, one) = (ArraySettings::default(), metadata(Format::Ci8));
    assert!(
        refused(std::slice::from_ref(&one), &usual)
            .contains("1 streams of samples: expected those of 2 to 16 elements")
    );
    assert!(refused(&vec![one.clone(); 17], &usual).contains("17 streams"));
    let four = beam(&places(4), 1.0, 0.0);
    let text = refused(&vec![one.clone(); 5], &four);
    assert!(text.contains("array.lever_arms_m: positions of 4 elements for 5 streams"), "{text}");
    let other = IfMetadata { rate: Rate::from_hz(5e6).unwrap(), ..one.clone() };
    assert!(refused(&[one.clone(), other], &usual).contains("element 2 has other samples than element 1"));
    let real = IfMetadata { format: Format::Ri8, ..one.clone() };
    assert!(refused(&[one.clone(), real], &usual).contains("element 2 has samples in ri8, which are real"));
    let short = ArraySettings { block_ms: 0.05, ..ArraySettings::default() };
    let slow = IfMetadata { rate: Rate::from_hz(1e5).unwrap(), ..one };
    assert!(refused(&vec![slow; 4], &short).contains("5 samples for 4 elements"));
}

#[test]
fn a_covariance_without_an_inverse_is_said_with_its_block() {
    let mut random = Random(5);
    let bytes = packed(&mut random, (&[], 1, 0.0), 8000, (Format::Ci8, 20.0));
    let same: Vec<Packed<'_>> = (0..2).map(|_| Packed::new(4000, Format::Ci8, &bytes[0])).collect();
    let settings = ArraySettings { block_ms: 1.0, ..ArraySettings::default() };
    let mut former = Former::new(&vec![metadata(Format::Ci8); 2], &settings).unwrap();
    let error = former.form(&same, &mut Vec::new()).unwrap_err();
    assert_eq!(error, ArrayError::Singular { sample: 4000, have: 2 });
    assert!(error.to_string().contains("singular in the block from sample 4000 on"), "{error}");
    // Silence of all is none.
    let zeros = vec![0_u8; 16_000];
    let silent: Vec<Packed<'_>> = (0..2).map(|_| Packed::new(0, Format::Ci8, &zeros)).collect();
    let mut stream = Vec::new();
    former.form(&silent, &mut stream).unwrap();
    assert!(stream.len() == 64_000 && stream.iter().all(|byte| *byte == 0));
}

#[test]
fn one_element_passes_as_it_came() {
    let bytes: Vec<u8> = (0..=255).collect();
    let other: Vec<u8> = bytes.iter().rev().copied().collect();
    let settings = ArraySettings { filter: SpatialFilter::None, ..ArraySettings::default() };
    let mut former = Former::new(&vec![metadata(Format::Ci8); 2], &settings).unwrap();
    let inputs = [Packed::new(0, Format::Ci8, &bytes), Packed::new(0, Format::Ci8, &other)];
    let mut stream = Vec::new();
    former.form(&inputs, &mut stream).unwrap();
    assert_eq!((stream, former.metadata().format), (bytes.clone(), Format::Ci8));
}
