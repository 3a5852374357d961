use super::scan::{Found, Profile, Scan};
use super::*;
use crate::correlate::{Edge, Nco, Replica, TURN, chips_to_units};
use crate::source::Block;

/// Standard normal draws: the sum of twelve uniforms.
fn noise(state: &mut u64) -> f64 {
    let uniform = |state: &mut u64| {
        *state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (*state >> 11) as f64 / (1_u64 << 53) as f64
    };
    (0..12).map(|_| uniform(state)).sum::<f64>() - 6.0
}

const DOPPLERS: [f64; 8] = [-2.6, -1.7, -0.8, -0.2, 0.4, 1.1, 1.9, 2.7];

/// Looks of 50 ms of eight channels of 45 and 38 dB-Hz whose codes are ahead of the carriers by a drift, and
/// by `chips` from `since` on.
fn steps_after(looks: usize, since: usize, chips: f64, state: &mut u64) -> Vec<Vec<Step>> {
    let mut trends = vec![Trend::default(); 8];
    (0..looks)
        .map(|look| {
            let at_s = 0.05 * look as f64;
            let mut steps = Vec::new();
            for (number, trend) in trends.iter_mut().enumerate() {
                let sigma_chips = if number % 2 == 0 { 0.010 } else { 0.024 };
                let jump = if look >= since { chips } else { 0.0 };
                let seen = 0.3 * at_s + jump + sigma_chips * noise(state);
                if let Some(expected) = trend.forecast(at_s) {
                    steps.push(Step {
                        chips: seen - expected.chips,
                        sigma_chips: sigma_chips * (1.0 + expected.variance_ratio).sqrt(),
                        doppler_chips: DOPPLERS[number],
                    });
                }
                if look < since {
                    trend.take(at_s, seen, 30.0);
                }
            }
            steps
        })
        .collect()
}

#[test]
fn one_to_four_samples_of_either_sign_are_suspected_at_once_and_counted_right() {
    let mut state = 5;
    for rate_hz in [2.048e6, 2.6e6, 4e6, 10e6] {
        let sample_chips = 1.023e6 / rate_hz;
        for samples in [-4_i32, -3, -2, -1, 1, 2, 3, 4] {
            for _ in 0..20 {
                let looks = steps_after(80, 74, f64::from(samples) * sample_chips, &mut state);
                assert!(looks[..74].iter().all(|steps| common_step(steps, sample_chips).is_none()));
                let chips = common_step(&looks[74], sample_chips).unwrap();
                // Eight channels know a step to 0.005 chip, trends included: a twentieth of a sample at 10
                // Msps.
                assert_eq!((chips / sample_chips).round() as i32, samples, "{rate_hz} {chips}");
            }
        }
    }
}

#[test]
fn noise_is_not_suspected_in_an_hour() {
    let (mut state, mut worst) = (6, 0.0_f64);
    // An hour has 72 000 looks. Six deviations of a common step are 2e-9 a look, 1.4e-4 an hour; at 10 Msps a
    // step has to be 0.3 sample beyond, that is another six deviations.
    for steps in steps_after(72_000, 72_000, 0.0, &mut state) {
        assert_eq!(common_step(&steps, 1.023e6 / 50e6), None);
        assert!(!doppler_step(&steps));
        if let Some(fit) = Fit::of(&steps, Some(0.0)) {
            worst = worst.max((fit.chips / fit.sigma_chips).abs());
        }
    }
    // The largest of 72 000 normal draws is 4.3 deviations, beyond 5.5 once in 370 hours; the other bound
    // holds it to be noise at all.
    assert!((3.3..5.5).contains(&worst), "{worst}");
}

#[test]
fn a_step_of_one_satellite_or_of_half_of_them_is_none_of_all() {
    let of = |chips: &[f64]| -> Vec<Step> {
        chips.iter().map(|&chips| Step { chips, sigma_chips: 0.01, doppler_chips: 0.0 }).collect()
    };
    assert_eq!(common_step(&of(&[0.4, 0.0, 0.01, -0.01, 0.0]), 0.39), None);
    assert_eq!(common_step(&of(&[0.4, 0.39, 0.4, 0.0, 0.01, 0.0]), 0.39), None);
    assert_eq!(common_step(&of(&[0.4, 0.39]), 0.39), None);
    assert!(common_step(&of(&[0.4, 0.39, 0.4, 0.41, 0.01]), 0.39).is_some_and(|chips| (chips - 0.4).abs() < 0.01));
}

#[test]
fn codes_over_dopplers_give_the_time_that_is_missing() {
    let mut state = 7;
    for seconds in [-0.06, 0.0, 0.019, 0.4] {
        let (mut sum, mut square, draws) = (0.0, 0.0, 400);
        let mut stated = 0.0;
        for _ in 0..draws {
            let step = |doppler: &f64| Step {
                chips: 0.1 + seconds * doppler + 0.01 * noise(&mut state),
                sigma_chips: 0.01,
                doppler_chips: *doppler,
            };
            let mut steps: Vec<Step> = DOPPLERS.iter().map(step).collect();
            // One satellite has its own mind.
            steps[3].chips += 0.5;
            let fit = Fit::robust(&steps[..], None).unwrap();
            sum += fit.seconds - seconds;
            square += (fit.seconds - seconds) * (fit.seconds - seconds);
            stated = fit.sigma_s;
        }
        let deviation = (square / f64::from(draws)).sqrt();
        // 0.01 chip over the root of 22 (chips/s)², 2.1 ms; the deviation of 400 draws is known to 3.5 %, a
        // mean to 0.11 ms. A satellite with weight on its side draws the first fit off, hence twice.
        assert!(deviation < 2.0 * 2.1e-3 && (sum / f64::from(draws)).abs() < 5e-4, "{seconds} {deviation} {stated}");
    }
}

#[test]
fn turns_of_signs_tell_the_periods_that_are_missing() {
    let mut state = 8;
    for missing in [0_u64, 1, 2, 7, 19] {
        let channels: Vec<(Edges, u64)> = (0..8_u64)
            .map(|channel| {
                let (mut edges, begin) = (Edges::new(20), (3 * channel + 5) % 20);
                let amplitude = if channel % 2 == 0 { 8.0 } else { 3.6 };
                let (mut sign, mut before) = (1.0, (0.0, 0.0));
                for number in 1000..1300_u64 {
                    // The count is short of the missing ones.
                    if (number + missing) % 20 == begin && noise(&mut state) > 0.0 {
                        sign = -sign;
                    }
                    let prompt = (sign * amplitude + noise(&mut state), noise(&mut state));
                    edges.add(number, prompt.0 * before.0 + prompt.1 * before.1);
                    before = prompt;
                }
                (edges, begin)
            })
            .collect();
        let all: Vec<(&Edges, u64)> = channels.iter().map(|(edges, begin)| (edges, *begin)).collect();
        assert_eq!(turned_by(&all), Some(missing));
    }
    // Nothing turns, nothing is said.
    let mut still = Edges::new(20);
    (0..1000).for_each(|number| still.add(number, 60.0 + 11.0 * noise(&mut state)));
    assert_eq!(turned_by(&[(&still, 3), (&still, 7), (&still, 9)]), None);
}

#[test]
fn a_jump_says_how_many_samples_and_which_way() {
    let of = |samples| Jump { sample: 77, samples, front_end: 0 }.to_string();
    assert_eq!(of(1), "1 sample lost near sample 77");
    assert_eq!(of(-5000), "5000 samples doubled near sample 77");
}

/// Result of a scan of 20 ms of four satellites. Their codes are ahead by `samples`, with Dopplers for
/// `seconds`.
fn scanned(samples: i64, seconds: f64, dbhz: f64, state: &mut u64) -> Option<Found> {
    let rate_hz = 2.6e6;
    let length = 52_000;
    let step = 1.023e6 / rate_hz;
    let amplitude = (2.0 * libm::pow(10.0, dbhz / 10.0) / rate_hz).sqrt();
    let (mut i, mut q) = (vec![0.0_f32; length], vec![0.0_f32; length]);
    let satellites: Vec<(Replica, Nco, f64)> = [(3, -2.1, 0.1), (9, 0.4, 0.21), (17, 1.2, -0.3), (28, 2.5, 0.07)]
        .map(|(prn, gain, turns)| {
            let replica = Replica::new(gnss::gps::l1ca::code(prn).unwrap(), Edge::Area).unwrap();
            let nco = Nco {
                carrier: 0,
                carrier_step: (turns * TURN) as i128 as u64,
                code: chips_to_units(31.7 * f64::from(prn)),
                code_step: chips_to_units(step) as u64,
            };
            (replica, nco, gain)
        })
        .into();
    for (replica, nco, gain) in &satellites {
        let ahead = chips_to_units(samples as f64 * step + gain * seconds);
        for (k, (i, q)) in i.iter_mut().zip(&mut q).enumerate() {
            let value = amplitude * replica.value(nco.code + ahead + k as i64 * nco.code_step as i64, nco.code_step);
            let carrier = nco.carrier_step.wrapping_mul(k as u64) as f64 / TURN * std::f64::consts::TAU;
            *i += (value * libm::cos(carrier)) as f32;
            *q += (value * libm::sin(carrier)) as f32;
        }
    }
    i.iter_mut().chain(&mut q).for_each(|x| *x += noise(state) as f32);
    let scan = Scan::new(1e-3, rate_hz);
    let profiles: Vec<(Profile, f64)> = satellites
        .iter()
        .map(|(replica, nco, gain)| {
            let mut profile = Profile::default();
            scan.add(&Block { first: 0, i: &i, q: &q }, replica, nco, &mut profile);
            (profile, gain / step)
        })
        .collect();
    scan.decide(&profiles.iter().map(|(profile, gain)| (profile, *gain)).collect::<Vec<_>>())
}

#[test]
fn a_scan_finds_the_common_delay_in_a_code_period_and_nothing_where_there_is_none() {
    let mut state = 9;
    for samples in [0, 1, -1, 2, -4, 100, -777, 1299] {
        let found = scanned(samples, 0.0, 42.0, &mut state).unwrap();
        assert_eq!(found.samples, samples);
    }
    // Half a second parts these codes by 2.3 chips; steps of 40 ms leave 0.05 chip of the farthest, no
    // sample.
    let long = scanned(600, 0.5, 45.0, &mut state).unwrap();
    assert!(long.samples == 600 && (long.seconds - 0.5).abs() < 0.2, "{long:?}");
    assert_eq!(scanned(0, 0.0, 0.0, &mut state), None);
}
