//! Loss of C/N0 in a correlator under interference, against spectral separation and the code's own lines.

use std::f64::consts::{PI, TAU};

use generator::scene::Scene;
use generator::truth;
use gnss::gps::l1ca::{self, L1_CA};
use gnss::record::Observation;
use gnss::satellite::Sv;

use super::interference::{alone, generated, scene};
use super::ran;

/// A code period of the ideal correlator.
struct Period {
    first: u64,
    samples: usize,
    chip: f64,
    chip_step: f64,
    turns: f64,
    turns_step: f64,
}

/// The code periods of `sv` in the scene by the truth's own delay and carrier.
fn periods(scene: &Scene, sv: Sv) -> Vec<Period> {
    let rate_hz = scene.clock.rate.hz();
    let at = |n: u64| {
        let seen = truth::seen(scene, sv, &L1_CA, scene.clock.epoch(n)).unwrap().unwrap();
        let sent = scene.clock.epoch(n).plus_s(-seen.arrivals[0].delay_s);
        (sent, seen.arrivals[0].carrier_cycles)
    };
    let mut found = Vec::new();
    let mut n = 0;
    while n + 2 * (rate_hz * 1e-3) as u64 <= scene.samples {
        let (sent, _) = at(n);
        let phase_s = (sent.fraction() * 1000.0).fract() / 1000.0;
        let first = n + ((1e-3 - phase_s) * rate_hz).ceil() as u64;
        let samples = (rate_hz * 1e-3) as usize - 1;
        let ((sent, carrier), (later, after)) = (at(first), at(first + samples as u64));
        found.push(Period {
            first,
            samples,
            chip: (sent.fraction() * 1000.0).fract() * 1023.0,
            chip_step: later.since(sent) * 1.023e6 / samples as f64,
            turns: scene.metadata.if_hz(L1_CA.centre_hz()) * first as f64 / rate_hz - carrier,
            turns_step: scene.metadata.if_hz(L1_CA.centre_hz()) / rate_hz - (after - carrier) / samples as f64,
        });
        n = first + samples as u64 / 2;
    }
    found
}

/// Prompt correlations, normalised to unit gain.
fn correlate(samples: &[(f64, f64)], periods: &[Period], code: &[bool]) -> Vec<(f64, f64)> {
    let one = |period: &Period| {
        let (mut re, mut im) = (0.0, 0.0);
        let (step_sin, step_cos) = libm::sincos(TAU * period.turns_step);
        let (mut sin, mut cos) = libm::sincos(TAU * period.turns.fract());
        for k in 0..period.samples {
            let sign = if code[(period.chip + period.chip_step * k as f64) as usize % 1023] { -1.0 } else { 1.0 };
            let (i, q) = samples[period.first as usize + k];
            re += sign * (i * cos + q * sin);
            im += sign * (q * cos - i * sin);
            (cos, sin) = (cos * step_cos - sin * step_sin, cos * step_sin + sin * step_cos);
        }
        (re / period.samples as f64, im / period.samples as f64)
    };
    periods.iter().map(one).collect()
}

/// Keeps one satellite.
fn only(mut scene: Scene, sv: Sv) -> Scene {
    scene.excluded = scene.catalogue.satellites().filter(|other| *other != sv).collect();
    scene
}

/// C/N0 of correlations whose data signs are those of `data`: mean power over the scatter about it.
fn cn0_dbhz(correlations: &[(f64, f64)], data: &[f64]) -> f64 {
    let n = data.len() as f64;
    let wiped: Vec<(f64, f64)> = correlations.iter().zip(data).map(|((re, im), s)| (re * s, im * s)).collect();
    let (re, im) = wiped.iter().fold((0.0, 0.0), |sum, z| (sum.0 + z.0 / n, sum.1 + z.1 / n));
    let scatter = wiped.iter().map(|z| (z.0 - re).powi(2) + (z.1 - im).powi(2)).sum::<f64>() / (n - 1.0);
    10.0 * libm::log10((re * re + im * im) / scatter / 0.999_8e-3)
}

#[test]
fn effective_cn0_is_that_of_spectral_separation_from_0_to_50_db() {
    let rate_hz = 5e6;
    let sv = Sv::gps(13);
    let quiet = only(scene(rate_hz, "kind = \"cw\"\njs_db = 0\non_s = 100"), sv);
    let periods = periods(&quiet, sv);
    let code = l1ca::code(13).unwrap();
    let clean = correlate(&generated(&quiet), &periods, &code);
    let data: Vec<f64> = clean.iter().map(|(re, _)| 1_f64.copysign(*re)).collect();
    let alone_dbhz = cn0_dbhz(&clean, &data);
    // A square replica finds (1 − d/4)² of what averaged edges of d chips a sample leave, −0.46 dB; 2000
    // periods know it to 0.1 dB.
    let expected_dbhz = 45.0 + 20.0 * libm::log10(1.0 - 1.023e6 / rate_hz / 4.0);
    assert!((alone_dbhz - expected_dbhz).abs() < 0.4, "{alone_dbhz}");
    // Separations for smooth spectra (theory: J. W. Betz), dB of seconds; computed outside this project.
    let kinds = [
        ("matched", "kind = \"matched\"", -61.86),
        ("white, null to null", "kind = \"noise\"\nbandwidth_hz = 2.046e6", -63.55),
        ("white, 4.092 MHz", "kind = \"noise\"\nbandwidth_hz = 4.092e6", -66.34),
        // Lines 2.05 kHz apart, 974 of them: one on every second line of the code.
        ("chirp of 2 MHz", "kind = \"chirp\"\nsweep_hz = 2e6\nsweep_s = 4.873e-4", -63.45),
    ];
    for (name, text, kappa_db) in kinds {
        let jammer = correlate(
            &{
                let scene = scene(rate_hz, &format!("{text}\njs_db = 0"));
                let amplitude = scene.interference[0].tuning.amplitude_lsb(scene.interference[0].jn0_hz);
                let samples = alone(&scene, 0, scene.samples as usize);
                samples.into_iter().map(|(i, q)| (i * amplitude, q * amplitude)).collect::<Vec<_>>()
            },
            &periods,
            &code,
        );
        for js_db in [0.0, 10.0, 20.0, 30.0, 40.0, 50.0] {
            let scale = libm::pow(10.0, js_db / 20.0);
            let both: Vec<(f64, f64)> =
                clean.iter().zip(&jammer).map(|(a, b)| (a.0 + scale * b.0, a.1 + scale * b.1)).collect();
            let found = cn0_dbhz(&both, &data);
            let jammed = 1.0 + libm::pow(10.0, (45.0 + js_db + kappa_db) / 10.0);
            let expected = alone_dbhz - 10.0 * libm::log10(jammed);
            println!("{name:20} J/S {js_db:4} dB: {found:6.2} dB-Hz, by separation {expected:6.2}");
            // The bar; at 50 dB the mean itself is uncertain: 2000 periods at 13 dB-Hz leave 0.9 dB.
            let bar = if js_db < 45.0 { 0.5 } else { 2.5 };
            assert!((found - expected).abs() < bar, "{name} {js_db}: {found} {expected}");
        }
        // Free of the signal's uncertainty, and so for any J/S: the interference's own power behind a
        // correlator of 1 ms.
        let power = jammer.iter().map(|z| z.0 * z.0 + z.1 * z.1).sum::<f64>() / jammer.len() as f64;
        let received = 2.0 * libm::pow(10.0, 4.5) * f64::from(quiet.noise_lsb).powi(2) / rate_hz;
        let kappa = 10.0 * libm::log10(power / received * 1e-3);
        println!("{name:20} separation {kappa:.2} dB s, formula {kappa_db}");
        assert!((kappa - kappa_db).abs() < 0.5, "{name}: {kappa} {kappa_db}");
    }
}

#[test]
fn a_cw_on_a_line_of_the_code_is_a_constant_and_between_lines_it_is_what_the_code_s_spectrum_says() {
    // PRN 6's strongest line: −21.29 dB at −227 kHz; at J/S 20 and 30 dB it is 0.86 and 2.73 of the signal
    // (computed outside this project; confirmed there by simulation as 0.86 and 2.72).
    let rate_hz = 5e6;
    let code = l1ca::code(6).unwrap();
    let spectrum = |f_hz: f64| {
        // One period of rectangular chips.
        let (mut re, mut im) = (0.0, 0.0);
        for (k, chip) in code.iter().enumerate() {
            let (sin, cos) = libm::sincos(-TAU * f_hz * (k as f64 + 0.5) / 1.023e6);
            let sign = if *chip { -1.0 } else { 1.0 };
            (re, im) = (re + sign * cos / 1023.0, im + sign * sin / 1023.0);
        }
        let x = PI * f_hz / 1.023e6;
        (re * re + im * im) * (libm::sin(x) / x).powi(2)
    };
    assert!((10.0 * libm::log10(spectrum(-227e3)) + 21.29).abs() < 0.01);
    // A still satellite: the code at rest against the samples.
    let still: Vec<Period> = (0..200)
        .map(|k| Period {
            first: 5000 * k,
            samples: 5000,
            chip: 0.0,
            chip_step: 1.023e6 / rate_hz,
            turns: 0.0,
            turns_step: 0.0,
        })
        .collect();
    for (offset_hz, lines) in [(-227e3, true), (-227.5e3, false), (311.5e3, false)] {
        let scene = scene(rate_hz, &format!("kind = \"cw\"\noffset_hz = {offset_hz}\njs_db = 30"));
        let tones = correlate(&alone(&scene, 0, 1_000_000), &still, &code);
        let power = tones.iter().map(|z| z.0 * z.0 + z.1 * z.1).sum::<f64>() / tones.len() as f64;
        let expected = spectrum(offset_hz);
        // Chips on samples 0.2 us apart: edges move by up to half of one, 1 % of the power and its aliases.
        assert!((10.0 * libm::log10(power / expected)).abs() < 0.3, "{offset_hz}: {power} {expected}");
        let (re, im) = tones.iter().fold((0.0, 0.0), |s, z| (s.0 + z.0 / 200.0, s.1 + z.1 / 200.0));
        let constant = (re * re + im * im) / power;
        // On a line every period adds the same phasor; half-way neighbours cancel.
        assert!(if lines { constant > 0.999 } else { constant < 1e-3 }, "{offset_hz}: {constant}");
        if lines {
            assert!(
                (libm::sqrt(100.0 * power) - 0.862).abs() < 0.03 && (libm::sqrt(1000.0 * power) - 2.73).abs() < 0.09
            );
        }
    }
}

#[test]
fn the_receiver_measures_the_cn0_that_spectral_separation_leaves() {
    // Noise of 2.046 MHz at J/S 22 dB from 11 to 18 s, a chirp over 2 MHz at 25 dB from 20 to 27 s.
    let text = include_str!("../../scenarios/jammed.toml");
    let (head, _) = text.split_once("[[interference]]").unwrap();
    let head = head.replace("duration_s = 75", "duration_s = 27").replace("= 4e6", "= 2.6e6");
    let jammers = "[[interference]]\nkind = \"noise\"\nbandwidth_hz = 2.046e6\njs_db = 22\non_s = 11\noff_s = 18\n\
        [[interference]]\nkind = \"chirp\"\nsweep_hz = 2e6\nsweep_s = 4.873e-4\njs_db = 25\non_s = 20\n";
    let place = tempfile::tempdir().unwrap();
    let path = place.path().join("scene.toml");
    std::fs::write(&path, format!("{head}{jammers}")).unwrap();
    let directory = ran(&path);
    let rows: Vec<Observation> = csv::Reader::from_path(directory.path().join("reports/jammed/rx/observations.csv"))
        .unwrap()
        .deserialize()
        .map(Result::unwrap)
        .collect();
    let measured_dbhz = |from_s: f64| {
        let inside = |row: &&Observation| (from_s..from_s + 1.5).contains(&(row.sample as f64 / 2.6e6));
        let values: Vec<f64> = rows.iter().filter(inside).map(|row| row.cn0_dbhz).collect();
        assert!(values.len() >= 12 * 10, "{} values from {from_s} s on", values.len());
        values.iter().sum::<f64>() / values.len() as f64
    };
    let linear = |db: f64| libm::pow(10.0, db / 10.0);
    // Means over samples leave 1 − d/3 of C/A; then what noise and the other satellites' codes are, in units
    // of the noise.
    let kept_dbhz = 45.0 + 10.0 * libm::log10(1.0 - 1.023 / 2.6 / 3.0);
    let quiet = linear(kept_dbhz - measured_dbhz(9.4));
    for (from_s, js_db, kappa_db) in [(16.4, 22.0, -63.55), (25.4, 25.0, -63.45)] {
        let expected = kept_dbhz - 10.0 * libm::log10(quiet + linear(45.0 + js_db + kappa_db));
        let found = measured_dbhz(from_s);
        println!("receiver at J/S {js_db} dB: {found:.2} dB-Hz, by separation {expected:.2}");
        assert!((found - expected).abs() < 0.5, "{js_db}: {found} {expected}");
    }
}
