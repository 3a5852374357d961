//! The loops held against tabled gains and thermal noise theory, at correlator level.

use num_complex::Complex64;

use super::super::tests::Normal;
use super::*;

/// order, B·T, p, K1, K2, K3 from an independent Lyapunov solution.
const TABLE: [(u32, f64, f64, f64, f64, f64); 12] = [
    (1, 0.018, 0.930_501_93, 0.069_498_069, 0.0, 0.0),
    (1, 0.36, 0.162_790_7, 0.837_209_3, 0.0, 0.0),
    (2, 0.001, 0.998_402_3, 0.003_192_846_9, 2.552_644_5e-6, 0.0),
    (2, 0.018, 0.971_925_18, 0.055_361_44, 0.000_788_195_38, 0.0),
    (2, 0.1, 0.859_825_21, 0.260_700_62, 0.019_648_973, 0.0),
    (2, 0.36, 0.613_678_53, 0.623_398_66, 0.149_244_28, 0.0),
    (2, 1.0, 0.300_680_89, 0.909_591, 0.489_047_22, 0.0),
    (3, 0.001, 0.999_031_54, 0.002_902_565_2, 2.811_923_9e-6, 9.083_311_2e-10),
    (3, 0.018, 0.982_936_34, 0.050_322_434, 0.000_863_568_36, 4.968_397_4e-6),
    (3, 0.1, 0.913_800_39, 0.236_948_21, 0.021_010_128, 0.000_640_495_26),
    (3, 0.36, 0.755_785_86, 0.568_285_85, 0.149_791_51, 0.014_565_065),
    (3, 1.0, 0.539_973_3, 0.842_559_36, 0.440_167_79, 0.097_352_951),
];

#[test]
fn gains_are_the_tabled_ones() {
    for (order, product, p, k1, k2, k3) in TABLE {
        assert!((bandwidth_time(order, p) / product - 1.0).abs() < 1e-5, "{order} {product}");
        let gains = Gains::design(order, product);
        // The table has eight digits; K3 at B·T 0.001 is (1−p)³, that is 3e-5 from the digits of p.
        for (found, tabled) in [(gains.phase, k1), (gains.rate, k2), (gains.acceleration, k3)] {
            assert!((found - tabled).abs() <= 3e-5 * tabled, "{order} {product}: {found} {tabled}");
        }
    }
}

#[test]
fn the_noise_bandwidth_is_that_of_the_impulse_response_of_the_step_itself() {
    for order in 1..=3 {
        for product in [0.002, 0.018, 0.1, 0.3] {
            let (gains, t_s) = (Gains::design(order, product), 4e-3);
            let (mut rates, mut start, mut sum) = (Rates::default(), 0.0, 0.0);
            for k in 0..200_000 {
                let mean = start + 0.5 * rates.mean(t_s) * t_s;
                sum += mean * mean;
                let e = if k == 0 { 1.0 } else { 0.0 } - mean;
                start += rates.mean(t_s) * t_s;
                let (next, jump) = step(&gains, &rates, e, t_s);
                rates = next;
                start += jump;
            }
            assert!((0.5 * sum / product - 1.0).abs() < 1e-6, "{order} {product}: {}", 0.5 * sum);
        }
    }
}

/// Follows a phase of constant jerk from rest and returns the error left, in cycles.
fn stress(order: u32, product: f64, t_s: f64, coefficients: [f64; 3]) -> f64 {
    let gains = Gains::design(order, product);
    let phase = |t: f64| coefficients[0] * t + coefficients[1] * t * t / 2.0 + coefficients[2] * t * t * t / 6.0;
    let (mut rates, mut start, mut e) = (Rates { rate: coefficients[0], acceleration: 0.0 }, 0.0, 0.0);
    for k in 0..(30.0 / product) as u64 {
        let t = k as f64 * t_s;
        // Simpson's rule is exact for the mean of a cubic.
        let truth = (phase(t) + 4.0 * phase(t + 0.5 * t_s) + phase(t + t_s)) / 6.0;
        e = truth - (start + 0.5 * rates.mean(t_s) * t_s);
        start += rates.mean(t_s) * t_s;
        let (next, jump) = step(&gains, &rates, e, t_s);
        rates = next;
        start += jump;
    }
    e
}

#[test]
fn dynamic_stress_is_jerk_over_the_last_gain() {
    for (hz, t_s) in [(18.0, 1e-3), (25.0, 1e-3), (18.0, 4e-3), (30.0, 2e-3)] {
        let product = hz * t_s;
        let gains = Gains::design(3, product);
        let expected = 1000.0 * t_s * t_s * t_s / gains.acceleration;
        let found = stress(3, product, t_s, [100.0, 50.0, 1000.0]);
        // Discrete theory is exact; the bar is 5 % only because the integral of a cubic is not a parabola.
        assert!((found / expected - 1.0).abs() < 0.05, "{hz} {t_s}: {found} {expected}");
        let gains = Gains::design(2, product);
        let expected = 50.0 * t_s * t_s / gains.rate;
        let found = stress(2, product, t_s, [100.0, 50.0, 0.0]);
        assert!((found / expected - 1.0).abs() < 0.05, "{hz} {t_s}: {found} {expected}");
    }
}

/// Ratio of the phase jitter of a Costas loop to √(B/(C/N0)·(1+1/(2T·C/N0))), B exact.
fn pll_ratio(order: u32, hz: f64, t_s: f64, dbhz: f64, updates: u32) -> f64 {
    let cn0 = libm::pow(10.0, dbhz / 10.0);
    let (gains, amplitude) = (Gains::design(order, hz * t_s), (2.0 * cn0 * t_s).sqrt());
    let mut normal = Normal::new(u64::from(order) * 1000 + (t_s * 1e3) as u64);
    let (mut rates, mut start, mut sum) = (Rates::default(), 0.0, 0.0);
    let skip = (20.0 / (hz * t_s)) as u32;
    for k in 0..updates + skip {
        let error = -(start + 0.5 * rates.mean(t_s) * t_s);
        if k >= skip {
            sum += error * error;
        }
        let (sin, cos) = libm::sincos(std::f64::consts::TAU * error);
        let sign = if normal.next() > 0.0 { amplitude } else { -amplitude };
        let prompt = Complex64::new(cos * sign + normal.next(), sin * sign + normal.next());
        start += rates.mean(t_s) * t_s;
        let (next, jump) = step(&gains, &rates, costas(prompt), t_s);
        rates = next;
        start += jump;
    }
    let theory = (hz / cn0 * (1.0 + 0.5 / (t_s * cn0))).sqrt() / std::f64::consts::TAU;
    (sum / f64::from(updates)).sqrt() / theory
}

#[test]
fn phase_jitter_is_the_theory_with_the_exact_bandwidth() {
    for order in [2, 3] {
        for (hz, t_s) in [(18.0, 1e-3), (18.0, 4e-3), (10.0, 10e-3), (15.0, 20e-3)] {
            for dbhz in [40.0, 45.0] {
                let updates = 60_000;
                let ratio = pll_ratio(order, hz, t_s, dbhz, updates);
                let bar = f64::max(0.05, 3.0 / (4.0 * hz * t_s * f64::from(updates)).sqrt());
                println!("PLL order {order} B {hz} Hz T {t_s} s {dbhz} dB-Hz: ratio {ratio:.4}");
                assert!((ratio - 1.0).abs() < bar, "{order} {hz} {t_s} {dbhz}: {ratio}");
            }
        }
    }
}

/// Ratio of the code jitter to √(B·d/(2C/N0)·[1+2/((2−d)T·C/N0)]), or [1+1/(T·C/N0)] for the dot product.
fn dll_ratio(order: u32, hz: f64, t_s: f64, d: f64, dbhz: f64, dot: bool, updates: u32) -> f64 {
    let cn0 = libm::pow(10.0, dbhz / 10.0);
    let (gains, amplitude) = (Gains::design(order, hz * t_s), (2.0 * cn0 * t_s).sqrt());
    let (shape, snr) = (CodeShape::triangle(d), t_s * cn0);
    let gain = if dot { dot_product_gain(snr) } else { shape.early_minus_late_gain(snr) };
    let mut normal = Normal::new((d * 100.0) as u64 + u64::from(order));
    let (mut rates, mut start, mut sum) = (Rates::default(), 0.0, 0.0);
    let triangle = |x: f64| (1.0 - x.abs()).max(0.0);

    let skip = (10.0 / (hz * t_s)) as u32;
    for k in 0..updates + skip {
        let error = -(start + 0.5 * rates.mean(t_s) * t_s);
        if k >= skip {
            sum += error * error;
        }
        let turn = normal.next() * 3.0;
        let (sin, cos) = libm::sincos(turn);
        let carrier = Complex64::new(cos, sin) * amplitude;
        // Shifted boxes of unit length: early covers [0,1], prompt [d/2, 1+d/2], late [d, 1+d].
        let mut part = |length: f64| Complex64::new(normal.next(), normal.next()) * length.max(0.0).sqrt();
        let (first, second, common, third, fourth) =
            (part(0.5 * d), part(0.5 * d), part(1.0 - d), part(0.5 * d), part(0.5 * d));
        let early = carrier * triangle(error - 0.5 * d) + first + second + common;
        let prompt = carrier * triangle(error) + second + common + third;
        let late = carrier * triangle(error + 0.5 * d) + common + third + fourth;
        let e = if dot {
            dot_product(early, prompt, late, &shape, gain)
        } else {
            early_minus_late(early, late, &shape, gain)
        };
        start += rates.mean(t_s) * t_s;
        let (next, jump) = step(&gains, &rates, e, t_s);
        rates = next;
        start += jump;
    }
    let squaring = if dot { 1.0 / snr } else { 2.0 / ((2.0 - d) * snr) };
    let theory = (hz * d / (2.0 * cn0) * (1.0 + squaring)).sqrt();
    (sum / f64::from(updates)).sqrt() / theory
}

#[test]
fn code_jitter_is_the_theory_with_the_exact_bandwidth() {
    for order in [1, 2] {
        for (hz, t_s, d) in [(2.0, 1e-3, 0.5), (2.0, 4e-3, 0.5), (1.0, 20e-3, 0.25), (2.0, 4e-3, 1.0)] {
            for dot in [false, true] {
                let updates = if t_s < 2e-3 { 400_000 } else { 120_000 };
                let ratio = dll_ratio(order, hz, t_s, d, 45.0, dot, updates);
                let bar = f64::max(0.05, 3.0 / (4.0 * hz * t_s * f64::from(updates)).sqrt());
                println!("DLL order {order} B {hz} Hz T {t_s} s d {d} dot {dot}: ratio {ratio:.4}");
                assert!((ratio - 1.0).abs() < bar, "{order} {hz} {t_s} {d} {dot}: {ratio}");
            }
        }
    }
}

/// Mean slope of both code discriminators at zero error, as drawn; the same noise on both sides.
fn slopes(d: f64, snr: f64, draws: u32) -> [f64; 2] {
    let (shape, amplitude, offset) = (CodeShape::triangle(d), (2.0 * snr).sqrt(), 0.002 * d);
    let mut normal = Normal::new(17);
    let mut sums = [0.0; 2];
    for _ in 0..draws {
        let mut part = |length: f64| Complex64::new(normal.next(), normal.next()) * length.sqrt();
        let [a, b, c, e, f] = [0.5 * d, 0.5 * d, 1.0 - d, 0.5 * d, 0.5 * d].map(&mut part);
        for (sign, error) in [(1.0, offset), (-1.0, -offset)] {
            let early = Complex64::from(amplitude * (1.0 - (error - 0.5 * d).abs())) + a + b + c;
            let prompt = Complex64::from(amplitude * (1.0 - error.abs())) + b + c + e;
            let late = Complex64::from(amplitude * (1.0 - (error + 0.5 * d).abs())) + c + e + f;
            sums[0] += sign * early_minus_late(early, late, &shape, 1.0);
            sums[1] += sign * dot_product(early, prompt, late, &shape, 1.0);
        }
    }
    sums.map(|sum| sum / (2.0 * offset * f64::from(draws)))
}

#[test]
fn the_gain_given_back_is_the_mean_slope_of_the_discriminator() {
    for d in [0.1, 0.5, 1.0] {
        for snr in [1.0, 3.0, 10.0, 100.0] {
            let [early_minus_late, dot] = slopes(d, snr, 400_000);
            let shape = CodeShape::triangle(d);
            let expected = [shape.early_minus_late_gain(snr), dot_product_gain(snr)];
            println!("d {d} T·C/N0 {snr}: {early_minus_late:.4} {dot:.4}, expected {expected:.4?}");
            // One slope spreads by about 3 times its mean (the dot product at T·C/N0 = 1, as found): 0.5 %
            // for 400 000; three of that. The prompt off its peak adds 0.2 % of d.
            assert!((early_minus_late / expected[0] - 1.0).abs() < 0.017, "{d} {snr}");
            assert!((dot / expected[1] - 1.0).abs() < 0.017, "{d} {snr}");
        }
    }
}

#[test]
fn two_pairs_count_as_one_of_half_the_slope_and_half_the_noise() {
    let triangle = |x: f64| (1.0 - x.abs()).max(0.0);
    let found = |x: f64| (triangle(x), -1_f64.copysign(x));
    for d in [0.1, 0.3, 0.5] {
        for discriminator in [CodeDiscriminator::EarlyMinusLate, CodeDiscriminator::DotProduct] {
            assert_eq!(CodeShape::of(discriminator, d, found, triangle), CodeShape::triangle(d));
        }
        let both = CodeShape::of(CodeDiscriminator::DoubleDelta, d, found, triangle);
        // Chips of white noise under the weights: ±1 over d at either end for the inner pair, ∓½ over 2d for
        // the outer one about the same middle. Half is left everywhere, over 2d at each end: a variance of d,
        // which is 2·(1 − common).
        let near = |a: f64, b: f64| assert!((a - b).abs() < 1e-12, "{both:?}");
        near(both.slope, 0.5);
        near(both.common, 1.0 - 0.5 * d);
    }
}

#[test]
fn the_tabled_gain_is_the_gain() {
    let shape = CodeShape::triangle(0.5);
    let mut table = CodeGain::new(shape, |shape, snr| shape.early_minus_late_gain(snr));
    for snr in [1.0, 1.1, 2.3, 7.0, 31.0, 400.0, 9e5] {
        assert!((table.at(snr) - shape.early_minus_late_gain(snr)).abs() < 1e-3, "{snr}");
    }
    assert_eq!((table.at(0.3), table.at(f64::INFINITY)), (table.at(1.0), 1.0));
}

#[test]
fn discriminators_of_nothing_are_zero_and_small_errors_come_back() {
    let (zero, shape) = (Complex64::ZERO, CodeShape::triangle(0.5));
    assert_eq!((costas(zero), phase(zero)), (0.0, 0.0));
    assert_eq!((early_minus_late(zero, zero, &shape, 1.0), dot_product(zero, zero, zero, &shape, 1.0)), (0.0, 0.0));
    assert_eq!(frequency_two_quadrant(zero, zero, 1e-3), 0.0);
    let e = 0.01;
    let (early, late) = (Complex64::from(0.75 + e), Complex64::from(0.75 - e));
    // Exact for the dot product; the quotient of squares departs by (e/0.75)² = 2e-4.
    assert!((early_minus_late(early, late, &shape, 1.0) - e).abs() < 3e-4 * e);
    let prompt = Complex64::from(1.0);
    assert!((dot_product(early, prompt, late, &shape, 1.0) - e).abs() < 1e-12);
    let turned = Complex64::new(0.0, 1.0);
    assert!((frequency_four_quadrant(prompt, turned, 1e-3) - 250.0).abs() < 1e-9);
}
