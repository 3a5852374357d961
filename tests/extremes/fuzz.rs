//! Random scenes keep the laws that all scenes keep.

use std::f64::consts::TAU;

use generator::scene::Scene;
use generator::truth;
use gnss::earth::SPEED_OF_LIGHT_MPS;
use gnss::gps::l1ca::{self, L1_CA};
use gnss::satellite::Sv;
use gnss::time::tone_turns;
use num_complex::Complex64;
use proptest::prelude::*;
use proptest::test_runner::{Config, TestRunner};

use crate::figures::{CA, Worst, case, cases};
use crate::run;

const TURN: f64 = 18_446_744_073_709_551_616.0;

/// A whole code period of a satellite: its first sample at or after `near`, samples, and the truth at its
/// begin, middle, end.
pub struct Period {
    pub first: u64,
    pub samples: u64,
    /// Chips since the period began and carrier pseudorange, in cycles, as quadratics through three instants.
    chips: [f64; 3],
    carrier: [f64; 3],
    pub cn0_hz: f64,
}

impl Period {
    pub fn after(scene: &Scene, sv: Sv, near: u64) -> Option<Self> {
        let rate_hz = scene.clock.rate.hz();
        let seen = |n: u64| {
            let seen = truth::seen(scene, sv, &L1_CA, scene.clock.epoch(n)).unwrap()?;
            Some(seen.arrivals[0].with_fast_phase(scene.fast_phases().at(Some(sv), L1_CA.centre_hz(), n as f64)))
        };
        let sent = |n: u64, delay_s: f64| scene.clock.epoch(n).plus_s(-delay_s);
        let into_s = (sent(near, seen(near)?.delay_s).fraction() * 1e3).fract() * 1e-3;
        let first = near + ((1e-3 - into_s) * rate_hz).ceil() as u64 + 1;
        let half = (0.5e-3 * rate_hz) as u64 - 2;
        let at = [first, first + half, first + 2 * half];
        let arrivals = [seen(at[0])?, seen(at[1])?, seen(at[2])?];
        let origin = sent(at[0], arrivals[0].delay_s);
        let begun = (origin.fraction() * 1e3).fract() * 1023.0;
        let chips = [0, 1, 2].map(|k| begun + sent(at[k], arrivals[k].delay_s).since(origin) * 1.023e6);
        let whole = arrivals[0].carrier_cycles.floor();
        let carrier = arrivals.map(|arrival| arrival.carrier_cycles - whole);
        Some(Self { first, samples: 2 * half, chips, carrier, cn0_hz: arrivals[1].cn0_hz })
    }

    /// A quadratic at the fraction `u` of the period.
    fn at([a, b, c]: [f64; 3], u: f64) -> f64 {
        a + u * (4.0 * b - 3.0 * a - c) + u * u * (2.0 * a - 4.0 * b + 2.0 * c)
    }

    /// Mean of the samples against a replica of nearest chips, by definition.
    pub fn prompt(&self, scene: &Scene, sv: Sv, i: &[f32], q: &[f32]) -> Complex64 {
        let code = l1ca::code(sv.number).unwrap();
        let if_hz = scene.metadata.if_hz(L1_CA.centre_hz());
        let sense = if scene.metadata.inverted { 1.0 } else { -1.0 };
        let mut sum = Complex64::ZERO;
        for k in 0..self.samples {
            let u = k as f64 / self.samples as f64;
            let tone = tone_turns(if_hz, scene.clock.rate, self.first + k) as f64 / TURN;
            let turns = tone + sense * Self::at(self.carrier, u);
            let (sin, cos) = libm::sincos(TAU * turns.fract());
            let chip = if code[Self::at(self.chips, u) as usize % 1023] { -1.0 } else { 1.0 };
            sum +=
                Complex64::new(f64::from(i[k as usize]), f64::from(q[k as usize])) * Complex64::new(cos, -sin) * chip;
        }
        sum / self.samples as f64
    }
}

impl Period {
    /// Amplitude and phase of real samples by least squares against a replica of area edges: a mean alone
    /// would keep the image at twice the IF, which meets the dips that such edges leave, coherently near a
    /// multiple of half the chip rate.
    fn phasor(&self, scene: &Scene, sv: Sv, x: &[f32]) -> Complex64 {
        let code = l1ca::code(sv.number).unwrap();
        let if_hz = scene.metadata.if_hz(L1_CA.centre_hz());
        let sense = if scene.metadata.inverted { 1.0 } else { -1.0 };
        let step = (Self::at(self.chips, 1.0) - Self::at(self.chips, 0.0)) / self.samples as f64;
        let chip = |place: f64| if code[place.rem_euclid(1023.0) as usize % 1023] { -1.0 } else { 1.0 };
        let (mut sum, mut squares, mut image) = (Complex64::ZERO, 0.0, Complex64::ZERO);
        for k in 0..self.samples {
            let u = k as f64 / self.samples as f64;
            let tone = tone_turns(if_hz, scene.clock.rate, self.first + k) as f64 / TURN;
            let turns = tone + sense * Self::at(self.carrier, u);
            let (sin, cos) = libm::sincos(TAU * turns.fract());
            let turn = Complex64::new(cos, -sin);
            let end = Self::at(self.chips, u) + 0.5 * step;
            let (from, to) = (chip(end - step), chip(end));
            let mean = from + (to - from) * (end.rem_euclid(1.0) / step).min(1.0);
            sum += f64::from(x[k as usize]) * mean * turn;
            squares += mean * mean;
            image += mean * mean * turn * turn;
        }
        // Samples are w·Re(a e^jφ): Σ x w e^−jφ = (a Σw² + ā Σw² e^−2jφ)/2.
        2.0 * (sum * squares - image * sum.conj()) / (squares * squares - image.norm_sqr())
    }
}

/// Half cycles that a prompt's phase is off, nearest to none: data leave its sign open.
pub fn phase_cycles(prompt: Complex64) -> f64 {
    let turns = prompt.arg() / TAU;
    turns - (2.0 * turns).round() / 2.0
}

fn motions() -> impl Strategy<Value = String> {
    let place = |height: std::ops::Range<f64>| {
        (-90.0..90.0, -180.0..360.0, height)
            .prop_map(|(a, b, h)| format!("latitude_deg = {a:.6}\nlongitude_deg = {b:.6}\nheight_m = {h:.3}\n"))
    };
    prop_oneof![
        place(-400.0..9e3).prop_map(|p| format!("[motion]\nkind = \"static\"\n{p}")),
        place(0.0..3.99e7).prop_map(|p| format!("[motion]\nkind = \"static\"\n{p}")),
        // From 60 m/s² on for 0.3 s it flies for longer than the scene: 12.6 m/s upwards are 2.6 s.
        (place(0.0..4e3), 60.0..2000.0, 1e2..1e5, 0.0..0.1, 5.0..90.0).prop_map(|(p, thrust, jerk, at, up)| {
            let burn = 2.0 * thrust / jerk + 0.3;
            format!(
                "[motion]\nkind = \"rocket\"\n{p}azimuth_deg = 50\nelevation_deg = {:.3}\nignition_s = {at:.4}\n\
                 thrust_mps2 = {thrust:.3}\nburn_s = {burn:.6}\njerk_mps3 = {jerk:.3}\n",
                60.0 + up / 3.0
            )
        }),
        (6.6e6..4e8, 0.0..0.98, 0.0..180.0, -180.0..180.0, -180.0..180.0).prop_map(
            |(a, e, i, node, m): (f64, f64, f64, f64, f64)| {
                let e = e.min(1.0 - 6.5e6 / a);
                format!(
                    "[motion]\nkind = \"orbit\"\nsemi_major_axis_m = {a:.1}\neccentricity = {e:.6}\ninclination_deg = \
                 {i:.3}\n\
                 node_longitude_deg = {node:.3}\nargument_of_perigee_deg = {:.3}\nmean_anomaly_deg = {m:.3}\n",
                    -node
                )
            }
        ),
    ]
}

/// A scene's text, and the part of its duration at which it is looked at.
fn scenes() -> impl Strategy<Value = (String, f64)> {
    let band = prop_oneof![
        (2.046e6..12e6, -0.2..0.2, any::<bool>()).prop_map(|(rate, place, inverted): (f64, f64, bool)| {
            let if_hz = (place * rate).round();
            format!(
                "sample_rate_hz = {:.0}\nif_hz = {if_hz:.0}\nspectrum_inverted = {inverted}\nformat = \"cf32\"\n",
                rate.round()
            )
        }),
        (5e6..12e6, 0.22..0.28, any::<bool>()).prop_map(|(rate, place, inverted): (f64, f64, bool)| {
            format!(
                "sample_rate_hz = {:.0}\nif_hz = {:.0}\nspectrum_inverted = {inverted}\nformat = \"ri16\"\nnoise_lsb \
                 = 4000\n",
                rate.round(),
                place * rate
            )
        }),
    ];
    let clock = (-0.01..0.01, -1e-5..1e-5, any::<bool>()).prop_map(|(bias, drift, noisy)| {
        let oscillator = if noisy { "oscillator = \"tcxo\"\n" } else { "" };
        format!("[receiver_clock]\nbias_s = {bias:.9}\ndrift_sps = {drift:.3e}\n{oscillator}")
    });
    let air = prop_oneof![
        Just(""),
        Just("[troposphere]\nmodel = \"saastamoinen\"\n"),
        Just("[ionosphere]\nmodel = \"klobuchar\"\n[troposphere]\nmodel = \"saastamoinen\"\n"),
    ];
    (motions(), band, clock, air, 35.0..60.0, any::<u32>(), 0..72_000_u32, 0.1..0.9).prop_map(
        |(motion, band, clock, air, cn0, seed, second, share): (String, String, String, &str, f64, u32, u32, f64)| {
            let (h, m, s) = (second / 3600, second / 60 % 60, second % 60);
            (
                format!(
                    "name = \"random\"\nstart = 2010-07-01T{h:02}:{m:02}:{s:02}\nduration_s = 2\nseed = {seed}\n\
                     {motion}[front_end]\n{band}[noise]\n[power]\ncn0_dbhz = {cn0:.2}\n{clock}{air}[fidelity]\n\
                     code_edge = \"area\"\n"
                ),
                share,
            )
        },
    )
}

/// Departures of one scene: carrier between generator and replica (cycles), C/N0 (dB), second difference of
/// the range beyond what the motion allows (m), code less carrier less what the rays say (m).
fn departures(text: &str, share: f64) -> Result<Option<[f64; 4]>, TestCaseError> {
    let scene = run::try_scene(text).map_err(TestCaseError::fail)?;
    let near = (share * scene.samples as f64) as u64;
    let directory = tempfile::tempdir().unwrap();
    let bytes = run::part(&scene, near..near + 3000, directory.path());
    let (i, q) = run::planes(&scene, &bytes);
    prop_assert!(i.iter().chain(&q).all(|x| x.is_finite()), "a sample is no number");
    let at_second = scene.clock.epoch(near / scene.clock.rate.hz() as u64 * scene.clock.rate.hz() as u64);
    let up: Vec<Sv> = (scene.catalogue.satellites())
        .filter(|sv| !scene.excluded.contains(sv) && truth::in_view(&scene, *sv, at_second).unwrap())
        .collect();
    let Some(sv) = up.get(near as usize % up.len().max(1)).copied() else { return Ok(None) };
    let mut alone = run::only(scene, &[sv]);
    alone.noise = false;
    let Some(period) = Period::after(&alone, sv, near) else { return Ok(None) };
    let bytes = run::part(&alone, period.first..period.first + period.samples, directory.path());
    let (i, q) = run::planes(&alone, &bytes);
    let prompt = period.prompt(&alone, sv, &i, &q);
    let rate_hz = alone.clock.rate.hz();
    let width = 1.023e6 / rate_hz;
    // Mean waveform over a sample against the chip at its middle; a real one keeps half.
    let edges = 1.0 - width / 4.0;
    let real = if alone.metadata.format.is_complex() { 1.0 } else { 0.5_f64.sqrt() };
    let amplitude = real * edges * f64::from(alone.noise_lsb) * (2.0 * period.cn0_hz / rate_hz).sqrt();
    let cn0_db = 20.0 * libm::log10(prompt.norm() / amplitude);
    // Ranges 5 ms apart.
    let limit_mps2 = alone.trajectory.extremes(f64::INFINITY).acceleration_mps2 + 12.0;
    let (mut bend_m, mut parted_m) = (0.0_f64, 0.0_f64);
    let steps = (0.005 * rate_hz) as u64;
    let seen: Vec<_> =
        (0..12).filter_map(|k| truth::seen(&alone, sv, &L1_CA, alone.clock.epoch(near + k * steps)).unwrap()).collect();
    for three in seen.windows(3) {
        let range_m = |k: usize| three[k].arrivals[0].delay_s * SPEED_OF_LIGHT_MPS;
        let bend = (range_m(2) - 2.0 * range_m(1) + range_m(0)).abs();
        bend_m = bend_m.max(bend - limit_mps2 * 0.005 * 0.005);
    }
    for one in &seen {
        let (arrival, ray) = (one.arrivals[0], one.rays[0]);
        let parted = (arrival.delay_s - arrival.carrier_cycles / L1_CA.centre_hz())
            - (ray.code_delay_s - ray.carrier_delay_s)
            + ray.phase_cycles / L1_CA.centre_hz();
        parted_m = parted_m.max((parted * SPEED_OF_LIGHT_MPS).abs());
    }
    let phasor = if alone.metadata.format.is_complex() { prompt } else { period.phasor(&alone, sv, &i) };
    Ok(Some([phase_cycles(phasor).abs(), cn0_db.abs(), bend_m, parted_m]))
}

#[test]
fn random_scenes_keep_the_laws_of_all_scenes() {
    let the = case(56, "random scenes", CA);
    let count = cases(50, 1000);
    let mut runner = TestRunner::new_with_rng(
        Config { cases: count, failure_persistence: None, max_shrink_iters: 200, ..Config::default() },
        proptest::test_runner::TestRng::deterministic_rng(proptest::test_runner::RngAlgorithm::ChaCha),
    );
    let worst = std::sync::Mutex::new((<[Worst; 4]>::default(), 0_usize));
    let found = runner.run(&scenes(), |(text, share)| {
        let Some(found) = departures(&text, share)? else { return Ok(()) };
        let mut worst = worst.lock().unwrap();
        worst.1 += 1;
        for (worst, found) in worst.0.iter_mut().zip(found) {
            // A scene's seed is its own.
            worst.take(found, || text.lines().find(|line| line.starts_with("seed")).unwrap_or_default().to_owned());
        }
        // Knots leave 1e-4 cycle, single precision 1e-6, a kink of a noisy oscillator within the period some
        // 1e-4. A ri16 signal is 150 LSB high at least: without noise its rounding repeats with the carrier,
        // in harmonics worth 1e-5 cycle each.
        prop_assert!(found[0] < 1e-3 && found[1] < 0.3 && found[2] < 1e-6 && found[3] < 1e-6, "{found:?} of\n{text}");
        Ok(())
    });
    if let Err(error) = found {
        panic!("{error}");
    }
    let ([carrier, cn0_db, bend_m, parted_m], judged) = worst.into_inner().unwrap();
    the.all("scenes with finite samples", count as usize, count as usize);
    the.at_least(
        "of those, with a satellite in view and judged",
        (judged as f64, format!("{count} drawn")),
        0.6 * f64::from(count),
        "",
    );
    the.at_most("carrier against an independent replica, noise-free", carrier, 1e-3, "cycle");
    the.at_most("C/N0 in the samples against the truth's", cn0_db, 0.3, "dB");
    the.at_most("range bends more than the motion", bend_m, 1e-6, "m");
    the.at_most("code and carrier parted by other than their rays say", parted_m, 1e-6, "m");
}
