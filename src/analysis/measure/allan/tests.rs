//! Printed values, another program's values, and noises of known strength.

use super::fit::power_law;
use super::freedom::{Estimator, degrees_of_freedom, interval};
use super::*;
use crate::expect::theory::clock::{EXPONENTS, white_phase};

/// The 1000 frequencies of SP 1065's test suite, from its generator, as 1001 phases.
fn thousand_points() -> Vec<f64> {
    let mut n = 1_234_567_890_u64;
    let mut phase = 0.0;
    let mut x = vec![phase];
    for _ in 0..1000 {
        phase += n as f64 / 2_147_483_647.0;
        x.push(phase);
        n = 16_807 * n % 2_147_483_647;
    }
    x
}

/// True if a value rounds to the printed one.
fn prints_as(value: f64, printed: &str) -> bool {
    let mantissa = printed.split('e').next().unwrap_or(printed);
    let digits = mantissa.bytes().filter(u8::is_ascii_digit).count();
    let expected: f64 = printed.parse().unwrap();
    format!("{value:.*e}", digits - 1) == format!("{expected:.*e}", digits - 1)
}

#[test]
fn the_thousand_point_set_of_sp_1065_comes_out_to_every_printed_digit() {
    let x = thousand_points();
    // SP 1065, table 31; the total deviation by double reflection.
    let table = [
        (Deviation::Adev, ["2.922319e-01", "9.965736e-02", "3.897804e-02"]),
        (Deviation::Oadev, ["2.922319e-01", "9.159953e-02", "3.241343e-02"]),
        (Deviation::Mdev, ["2.922319e-01", "6.172376e-02", "2.170921e-02"]),
        (Deviation::Tdev, ["1.687202e-01", "3.563623e-01", "1.253382e+00"]),
        (Deviation::Hdev, ["2.943883e-01", "1.052754e-01", "3.910860e-02"]),
        (Deviation::Ohdev, ["2.943883e-01", "9.581083e-02", "3.237638e-02"]),
        (Deviation::Totdev, ["2.922319e-01", "9.134743e-02", "3.406530e-02"]),
    ];
    let mut others = Vec::new();
    for (deviation, printed) in table {
        for (m, printed) in [1, 10, 100].into_iter().zip(printed) {
            let value = deviation.estimate(&x, 1.0, m).unwrap().deviation;
            if !prints_as(value, printed) {
                others.push((deviation, m, format!("{value:.9e}")));
            }
        }
    }
    // 3.9108606e-2 was printed as 3.910860e-02: cut, not rounded.
    assert_eq!(others, [(Deviation::Hdev, 100, "3.910860560e-2".to_owned())]);
}

#[test]
fn the_nine_frequencies_of_nbs_monograph_140_come_out_to_every_printed_digit() {
    let mut x = vec![0.0];
    x.extend([892.0, 809.0, 823.0, 798.0, 671.0, 644.0, 883.0, 903.0, 677.0].iter().scan(0.0, |phase, y| {
        *phase += y;
        Some(*phase)
    }));
    // SP 1065's test suite.
    let table = [
        (Deviation::Adev, 1, "91.22945"),
        (Deviation::Adev, 2, "115.8082"),
        (Deviation::Oadev, 2, "85.95287"),
        (Deviation::Mdev, 2, "74.78849"),
        (Deviation::Tdev, 1, "52.67135"),
        (Deviation::Tdev, 2, "86.35831"),
        (Deviation::Hdev, 1, "70.80607"),
        (Deviation::Ohdev, 2, "85.61487"),
    ];
    for (deviation, m, printed) in table {
        let value = deviation.estimate(&x, 1.0, m).unwrap().deviation;
        assert!(prints_as(value, printed), "{deviation:?} {m}: {value} against {printed}");
    }
}

#[test]
fn intervals_are_those_of_stable32_on_the_thousand_point_set() {
    let x = thousand_points();
    // Stable32 1.60, white frequency noise, confidence 0.683, octaves: lower and upper end, and count of
    // differences.
    let table = [
        (
            Deviation::Adev,
            [
                (999, "2.8515e-01", "2.9987e-01"),
                (499, "1.9787e-01", "2.1319e-01"),
                (249, "1.4201e-01", "1.5815e-01"),
                (124, "1.0254e-01", "1.1971e-01"),
                (61, "5.6510e-02", "7.0567e-02"),
                (30, "4.9153e-02", "6.7635e-02"),
                (14, "2.7109e-02", "4.3537e-02"),
                (6, "2.6481e-02", "5.5744e-02"),
            ],
        ),
        (
            Deviation::Oadev,
            [
                (999, "2.8515e-01", "2.9987e-01"),
                (997, "1.9520e-01", "2.0738e-01"),
                (993, "1.3931e-01", "1.5098e-01"),
                (985, "1.0038e-01", "1.1198e-01"),
                (969, "5.7696e-02", "6.7217e-02"),
                (937, "4.3654e-02", "5.4202e-02"),
                (873, "3.1755e-02", "4.3377e-02"),
                (745, "2.3045e-02", "3.7027e-02"),
            ],
        ),
        (
            Deviation::Mdev,
            [
                (999, "2.8515e-01", "2.9987e-01"),
                (996, "1.5336e-01", "1.6355e-01"),
                (990, "1.0322e-01", "1.1304e-01"),
                (978, "6.9840e-02", "7.9481e-02"),
                (954, "3.8022e-02", "4.5809e-02"),
                (906, "3.0466e-02", "3.9933e-02"),
                (810, "2.3687e-02", "3.5511e-02"),
                (618, "1.4874e-02", "2.8584e-02"),
            ],
        ),
        (
            Deviation::Hdev,
            [
                (998, "2.8635e-01", "3.0315e-01"),
                (498, "1.9887e-01", "2.1659e-01"),
                (248, "1.4054e-01", "1.5896e-01"),
                (123, "1.0744e-01", "1.2829e-01"),
                (60, "5.3296e-02", "6.8811e-02"),
                (29, "4.6987e-02", "6.8092e-02"),
                (13, "2.4870e-02", "4.3652e-02"),
                (5, "2.8841e-02", "7.3807e-02"),
            ],
        ),
        (
            Deviation::Ohdev,
            [
                (998, "2.8635e-01", "3.0315e-01"),
                (995, "1.9491e-01", "2.0825e-01"),
                (989, "1.3777e-01", "1.5043e-01"),
                (977, "1.0388e-01", "1.1704e-01"),
                (953, "5.6173e-02", "6.6369e-02"),
                (905, "4.0664e-02", "5.1382e-02"),
                (809, "2.9271e-02", "4.1477e-02"),
                (617, "2.3761e-02", "4.1367e-02"),
            ],
        ),
    ];
    for (deviation, rows) in table {
        for (m, (terms, low, high)) in octaves(128).zip(rows) {
            let estimate = deviation.estimate(&x, 1.0, m).unwrap();
            assert_eq!(estimate.terms, terms, "{deviation:?} {m}");
            let freedom = degrees_of_freedom(deviation.estimator(), 0, m, x.len()).unwrap();
            // The probability within one standard deviation of a normal error.
            let ends = interval(freedom, 0.682_689_492_137).unwrap();
            // That program too takes readings at instants where it has more than 100 lags, m above 33 or 25.
            // Below, it takes means over τ₀, which changes the edf by up to 17 % (at m = 1: 782 for 666) and
            // an end by half of that times its distance of 1/√(2 edf): 2.4e-3, in third differences 2.9e-3.
            let tolerance = if m >= 64 { 2e-4 } else { 3e-3 };
            for (factor, printed) in [(ends.0, low), (ends.1, high)] {
                let printed: f64 = printed.parse().unwrap();
                let off = factor * estimate.deviation / printed - 1.0;
                assert!(off.abs() < tolerance, "{deviation:?} {m}: {off:.1e}");
            }
        }
    }
}

#[test]
fn intervals_of_the_total_deviation_are_those_of_stable32() {
    let x = thousand_points();
    // Stable32 1.60, as above.
    let table = [
        (16, 5.7732e-2, 6.6839e-2),
        (32, 4.4255e-2, 5.4484e-2),
        (64, 3.1639e-2, 4.2546e-2),
        (128, 2.6406e-2, 4.0383e-2),
        (256, 1.0734e-2, 1.9924e-2),
    ];
    for (m, low, high) in table {
        let estimate = Deviation::Totdev.estimate(&x, 1.0, m).unwrap();
        let (freedom, bias) = freedom::total(0, 1000.0 / m as f64).unwrap();
        let ends = interval(freedom, 0.682_689_492_137).unwrap();
        assert_eq!(bias, 1.0);
        // Five digits are printed, and the estimate before them; that program's quantiles agree to 2e-4
        // elsewhere.
        for (factor, printed) in [(ends.0, low), (ends.1, high)] {
            assert!((factor * estimate.deviation / printed - 1.0).abs() < 3e-4, "{m}: {freedom} {ends:?}");
        }
    }
}

/// Covariance at each lag of the differences of white noise summed `sums` times: the autocorrelation of their
/// weights.
fn covariance(estimator: Estimator, m: usize, sums: usize) -> Vec<f64> {
    let times = |a: &[f64], b: &[f64]| {
        let mut product = vec![0.0; a.len() + b.len() - 1];
        a.iter().enumerate().for_each(|(i, a)| b.iter().enumerate().for_each(|(k, b)| product[i + k] += a * b));
        product
    };
    let mut apart = vec![0.0; m + 1];
    (apart[0], apart[m]) = (1.0, -1.0);
    let mut weights = vec![1.0];
    (0..estimator.order).for_each(|_| weights = times(&weights, &apart));
    if estimator.modified {
        weights = times(&weights, &vec![1.0; m]);
    }
    for _ in 0..sums {
        weights.iter_mut().fold(0.0, |sum, weight| {
            *weight += sum;
            *weight
        });
    }
    (0..weights.len()).map(|lag| weights.iter().zip(&weights[lag..]).map(|(a, b)| a * b).sum()).collect()
}

#[test]
fn degrees_of_freedom_in_sampled_white_noises_are_those_of_the_weights() {
    let count = 300;
    for deviation in [Deviation::Adev, Deviation::Oadev, Deviation::Mdev, Deviation::Hdev, Deviation::Ohdev] {
        let estimator = deviation.estimator();
        for (m, (alpha, sums)) in [1, 2, 5, 16, 40].into_iter().flat_map(|m| [(2, 0), (0, 1)].map(|noise| (m, noise))) {
            let covariance = covariance(estimator, m, sums);
            let terms = deviation.estimate(&vec![0.0; count], 1.0, m).unwrap().terms;
            let stride = if estimator.overlapped { 1 } else { m };
            // 2 mean² / variance of a mean of squares of normal numbers.
            let square = |lag: usize| covariance.get(lag * stride).map_or(0.0, |c| c * c) * (terms - lag) as f64;
            let sum = square(0) + 2.0 * (1..terms).map(square).sum::<f64>();
            let expected = (terms as f64 * covariance[0]).powi(2) / sum;
            let freedom = degrees_of_freedom(estimator, alpha, m, count).unwrap();
            // Rounding, which the averages' second differences magnify by m²: 1600 · 1e-16 · some ten terms.
            assert!((freedom / expected - 1.0).abs() < 1e-11, "{deviation:?} {m} α {alpha}: {freedom}, {expected}");
        }
    }
}

#[test]
fn degrees_of_freedom_agree_with_the_handbook_s_empirical_formulas() {
    let count = 1025_usize;
    let n = count as f64;
    let estimator = Deviation::Oadev.estimator();
    for factor in octaves(128) {
        let m = factor as f64;
        let flicker_frequency = if factor == 1 {
            2.0 * (n - 2.0).powi(2) / (2.3 * n - 4.9)
        } else {
            5.0 * n * n / (4.0 * m * (n + 3.0 * m))
        };
        let walk = (n - 2.0) / m * ((n - 1.0).powi(2) - 3.0 * m * (n - 1.0) + 4.0 * m * m) / (n - 3.0).powi(2);
        // SP 1065, section 5.4, for the overlapping Allan variance, with the worst that its fits are off by
        // here. That of flicker phase noise is off by 29 %; the next test has it.
        let table = [
            (2, (n + 1.0) * (n - 2.0 * m) / (2.0 * (n - m)), 0.03),
            (0, (1.5 * (n - 1.0) / m - 2.0 * (n - 2.0) / n) * 4.0 * m * m / (4.0 * m * m + 5.0), 0.02),
            (-1, flicker_frequency, 0.09),
            (-2, walk, 0.12),
        ];
        for (alpha, expected, tolerance) in table {
            let freedom = degrees_of_freedom(estimator, alpha, factor, count).unwrap();
            assert!((freedom / expected - 1.0).abs() < tolerance, "α {alpha}, {factor}: {freedom} against {expected}");
        }
    }
}

/// Degrees of freedom from the spectrum of sampled phase, 1/f^(2 − α) up to half the rate, and the
/// differences' response.
fn freedom_by_spectrum(alpha: i32, order: i32, m: usize, terms: usize) -> f64 {
    let length = 1_usize << 20;
    let density = |k: usize| {
        let f = k.min(length - k) as f64 / length as f64;
        let response = (2.0 * libm::sin(std::f64::consts::PI * f * m as f64)).powi(2 * order);
        num_complex::Complex::new(if k == 0 { 0.0 } else { response * f.powi(alpha - 2) }, 0.0)
    };
    let mut covariance: Vec<_> = (0..length).map(density).collect();
    fft::Planner::<f64>::new().plan_fft_forward(length).process(&mut covariance);
    let square = |lag: usize| covariance[lag].re.powi(2) * (terms - lag) as f64;
    let sum = square(0) + 2.0 * (1..terms).map(square).sum::<f64>();
    (terms as f64 * covariance[0].re).powi(2) / sum
}

#[test]
fn degrees_of_freedom_in_flicker_and_walks_are_those_of_their_spectra() {
    let count = 1025;
    for (deviation, order) in [(Deviation::Oadev, 2), (Deviation::Ohdev, 3)] {
        for (m, alpha) in [4, 16, 64].into_iter().flat_map(|m| [1, -1, -2].map(|alpha| (m, alpha))) {
            let terms = count - order as usize * m;
            let expected = freedom_by_spectrum(alpha, order, m, terms);
            let freedom = degrees_of_freedom(deviation.estimator(), alpha, m, count).unwrap();
            // Flicker phase noise up to a sharp cutoff against a mean over τ₀; what the walk and flicker of
            // frequency fold from above half the rate; the transform's own resolution of 1e-6.
            let tolerance = match alpha {
                1 => 0.09,
                -1 => 0.25 / m as f64,
                _ => 0.01 / m as f64,
            };
            let off = freedom / expected - 1.0;
            assert!(off.abs() < tolerance, "{deviation:?} {m} α {alpha}: {freedom} against {expected}");
        }
    }
}

/// Standard normal numbers from xoshiro256++ (Blackman and Vigna 2019) by the polar method.
struct Normal {
    state: [u64; 4],
    spare: Option<f64>,
}

impl Normal {
    fn new(seed: u64) -> Self {
        // Seeded by splitmix64, as its authors advise.
        let mut z = seed;
        let state = [(); 4].map(|()| {
            z = z.wrapping_add(0x9e37_79b9_7f4a_7c15);
            let a = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
            let b = (a ^ (a >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
            b ^ (b >> 31)
        });
        Self { state, spare: None }
    }

    /// Evenly in −1 to 1.
    fn even(&mut self) -> f64 {
        let [a, b, c, d] = &mut self.state;
        let result = a.wrapping_add(*d).rotate_left(23).wrapping_add(*a);
        let t = *b << 17;
        *c ^= *a;
        *d ^= *b;
        *b ^= *c;
        *a ^= *d;
        *c ^= t;
        *d = d.rotate_left(45);
        (result >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    }

    fn draw(&mut self) -> f64 {
        if let Some(spare) = self.spare.take() {
            return spare;
        }
        loop {
            let (u, v) = (self.even(), self.even());
            let square = u * u + v * v;
            if square > 0.0 && square < 1.0 {
                let scale = (-2.0 * libm::log(square) / square).sqrt();
                self.spare = Some(v * scale);
                return u * scale;
            }
        }
    }

    /// Independent phases of unit variance.
    fn white_phase(&mut self, count: usize) -> Vec<f64> {
        (0..count).map(|_| self.draw()).collect()
    }

    /// Phases whose steps are independent and of unit variance.
    fn white_frequency(&mut self, count: usize) -> Vec<f64> {
        let mut phase = 0.0;
        let mut step = || {
            phase += self.draw();
            phase
        };
        (0..count).map(|_| step()).collect()
    }

    /// Samples of the integral of a Wiener process that has unit variance after one step: the two of a step
    /// have the covariance 1, 1/2; 1/2, 1/3.
    fn walk_of_frequency(&mut self, count: usize) -> Vec<f64> {
        let (mut phase, mut frequency) = (0.0, 0.0);
        let mut step = || {
            let (along, aside) = (self.draw(), self.draw());
            phase += frequency + along / 2.0 + aside / 12.0_f64.sqrt();
            frequency += along;
            phase
        };
        (0..count).map(|_| step()).collect()
    }
}

#[test]
fn ninety_five_percent_intervals_hold_the_truth_ninety_five_times_in_a_hundred() {
    const SERIES: usize = 400;
    let mut normal = Normal::new(2003);
    let series: Vec<Vec<f64>> = (0..SERIES).map(|_| normal.white_frequency(512)).collect();
    for deviation in [Deviation::Oadev, Deviation::Mdev, Deviation::Ohdev, Deviation::Totdev] {
        for m in [1, 4, 16] {
            // Unit variance of frequency over τ₀: 1/m over τ; of the modified variance half of that and 1/m²
            // more.
            let narrowed = if deviation == Deviation::Mdev { 0.5 + 0.5 / (m * m) as f64 } else { 1.0 };
            let truth = (narrowed / m as f64).sqrt();
            let held = series.iter().filter(|x| {
                let points = curve(deviation, x, 1.0, [m], 0.95);
                let (low, high) = points[0].interval.unwrap();
                (low..high).contains(&truth)
            });
            // Three standard deviations of a binomial share: 3 √(0.95 · 0.05/400) = 3.27 %.
            let share = held.count() as f64 / SERIES as f64;
            assert!((share - 0.95).abs() < 0.0327, "{deviation:?} at {m}: {share}");
        }
    }
}

#[test]
fn the_noise_that_was_made_is_the_noise_that_is_found() {
    let mut normal = Normal::new(1065);
    // White phase of unit variance: h₂ = 8π² τ₀; white frequency: h₀ = 2/τ₀; phase that walks τ₀ y with y of
    // unit variance a step: 2π² h₋₂ τ₀ = 1/τ₀².
    let (tau0_s, pi, count) = (0.5_f64, std::f64::consts::PI, 20_000);
    let made = [
        (0, normal.white_phase(count), 8.0 * pi * pi * tau0_s),
        (2, normal.white_frequency(count), 2.0 / tau0_s),
        (4, normal.walk_of_frequency(count), 1.0 / (2.0 * pi * pi * tau0_s.powi(3))),
    ];
    for (noise, x, strength) in made {
        let points = curve(Deviation::Oadev, &x, tau0_s, octaves(x.len()), 0.95);
        // A quarter of the record is 4999: octaves to 4096.
        assert_eq!(points.len(), 13);
        let alphas: Vec<_> = points.iter().filter(|point| point.m <= 64).map(|point| point.alpha).collect();
        assert!(alphas.iter().all(|alpha| *alpha == Some(EXPONENTS[noise])), "{noise}: {alphas:?}");
        let law = power_law(&points, 0.5 / tau0_s).unwrap();
        assert_eq!(law.h.iter().filter(|h| **h > 0.0).count(), 1, "{:?}", law.h);
        // The best known point alone has some 10⁴ degrees of freedom: σ² to 1.4 %; four times that.
        assert!((law.h[noise] / strength - 1.0).abs() < 0.056, "{:?} against {strength}", law.h);
    }
}

#[test]
fn white_phase_noise_has_the_deviations_that_theory_draws() {
    let x = Normal::new(7).white_phase(40_000);
    for deviation in Deviation::ALL {
        for m in [1, 8, 64] {
            let estimate = deviation.estimate(&x, 0.1, m).unwrap();
            let expected = white_phase(deviation, 1.0, 0.1 * m as f64, 0.1);
            // White phase: means of τ are independent, so at least the count of them less two is free in
            // effect; a deviation's error is 1/√(2 edf). Four times that, with a factor 2 for third
            // differences.
            let tolerance = 4.0 / ((x.len() / m) as f64).sqrt();
            let off = estimate.deviation / expected - 1.0;
            assert!(off.abs() < tolerance, "{deviation:?} {m}: {off}");
        }
    }
}

#[test]
fn what_cannot_be_said_is_left_out() {
    let x = Normal::new(11).white_frequency(41);
    let points = curve(Deviation::Oadev, &x, 1.0, decades(41), 0.95);
    // A quarter of the record is 10. From m = 2 there are fewer than 30 phases: the noise found at m = 1 is
    // kept.
    assert_eq!(points.iter().map(|point| point.m).collect::<Vec<_>>(), [1, 2, 4, 10]);
    assert!(points.iter().all(|point| point.alpha == Some(0) && point.interval.is_some()));
    let few = curve(Deviation::Oadev, &x[..20], 1.0, octaves(20), 0.95);
    assert!(!few.is_empty() && few.iter().all(|point| point.alpha.is_none() && point.interval.is_none()));
    assert!(curve(Deviation::Ohdev, &x[..5], 1.0, octaves(5), 0.95).is_empty());
    // A clock without noise, far from zero: rounding alone.
    let steady: Vec<f64> = (0..500).map(|k| 1.3e-4 + 5e-9 * f64::from(k)).collect();
    for deviation in Deviation::ALL {
        assert!(curve(deviation, &steady, 0.1, octaves(500), 0.95).is_empty(), "{deviation:?}");
        assert!(curve(deviation, &[0.0; 100], 0.1, octaves(100), 0.95).is_empty(), "{deviation:?}");
        assert!(deviation.estimate(&x, 1.0, 41).is_none() && deviation.estimate(&[], 1.0, 1).is_none());
    }
}
