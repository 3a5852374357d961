//! Peaks of samples that are written down from the definition of a signal.

use std::f64::consts::TAU;

use super::*;
use gnss::galileo::e1::E1;
use gnss::gps::l1ca::L1_CA;
use gnss::samples::Format;
use gnss::satellite::Sv;
use gnss::signal::SIGNALS;
use gnss::time::{Epoch, Rate};

/// A ray of a signal: delay in chips, amplitude, phase in cycles.
type Ray = (f64, f64, f64);

const DOPPLER_HZ: f64 = 2_345.6;

fn observation(signal: &'static Signal, number: u8) -> Observation {
    let sent = signal.time.instant(Epoch::new(1_300_000_007, 0.012_345_678));
    let sv = Sv { system: signal.system, number };
    Observation {
        sample: 0,
        sv,
        signal,
        sent_s: sent.seconds(),
        sent_fraction_s: sent.fraction(),
        pseudorange_m: 2.2e7,
        carrier_cycles: 0.0,
        doppler_hz: DOPPLER_HZ,
        cn0_dbhz: 45.0,
        locked_s: 1.0,
    }
}

fn metadata(signal: &Signal, truth: &Observation, rate_hz: f64) -> IfMetadata {
    let center_hz = signal.carrier_hz(truth.sv) - 3e5;
    IfMetadata {
        format: Format::Cf32Le,
        rate: Rate::from_hz(rate_hz).unwrap(),
        center_hz,
        inverted: false,
        start: None,
    }
}

/// Instants of a component without noise, its sign changing with every period.
fn samples(truth: &Observation, metadata: &IfMetadata, rays: &[Ray], duration_s: f64) -> Glimpse {
    let component = looked_at(truth.signal).unwrap();
    let code = (component.code)(truth.sv.number).unwrap();
    let (kinds, pattern) = chip_kinds(component.layers);
    let carrier_hz = truth.signal.carrier_hz(truth.sv);
    let label = truth.signal.time.label(truth.sent());
    // Whole periods before the week's second that `label` names do not count.
    let periods_s = component.chip_rate_hz / f64::from(component.code_chips);
    assert!((periods_s * 1e3).round() > 0.0 && (periods_s - periods_s.round()).abs() < 1e-9);
    let value = |t_s: f64, (delay, amplitude, phase): Ray| {
        let chips = (label.fraction() + t_s * (1.0 + DOPPLER_HZ / carrier_hz)) * component.chip_rate_hz - delay;
        let period = (chips / f64::from(component.code_chips)).floor();
        let chip = (chips - period * f64::from(component.code_chips)) as usize % code.len();
        let wave = &kinds[pattern[chip % pattern.len()]];
        let step = wave[((chips - chips.floor()) * wave.len() as f64) as usize % wave.len()];
        let sign = if period as i64 % 3 == 0 { -1.0 } else { 1.0 };
        let angle = TAU * ((3e5 + DOPPLER_HZ) * t_s + 0.3 + phase);
        step * Complex64::from_polar(sign * amplitude * f64::from(code[chip]), angle)
    };
    let instants = (0..(duration_s * metadata.rate.hz()) as usize).map(|n| n as f64 / metadata.rate.hz());
    let all: Vec<Complex64> = instants.map(|t| rays.iter().map(|ray| value(t, *ray)).sum()).collect();
    let part = |of: fn(&Complex64) -> f64| all.iter().map(|sample| of(sample) as f32).collect();
    Glimpse {
        metadata: metadata.clone(),
        doppler_hz: 0.0,
        later_s: 0.0,
        i: part(|sample| sample.re),
        q: part(|sample| sample.im),
    }
}

/// Correlation of a code of one step a chip with itself at a delay, by its chips, as a mean over an interval.
fn expected(code: &[i8], delay: f64, width: f64) -> f64 {
    let at = |lag: i64| {
        let pairs = (0..code.len()).map(|n| code[n] * code[(n as i64 + lag).rem_euclid(code.len() as i64) as usize]);
        f64::from(pairs.map(i32::from).sum::<i32>()) / code.len() as f64
    };
    let lags: Vec<f64> = (-4..=4).map(at).collect();
    let polygon = |x: f64| {
        let left = x.floor();
        let index = (left + 4.0) as usize;
        lags[index] + (x - left) * (lags[index + 1] - lags[index])
    };
    (0..400).map(|k| polygon(delay + width * ((f64::from(k) + 0.5) / 400.0 - 0.5))).sum::<f64>() / 400.0
}

fn curve(rows: &[PeakRow]) -> Vec<(f64, f64, f64)> {
    rows.iter().map(|row| (row.delay_chips, row.in_phase, row.quadrature)).collect()
}

#[test]
fn a_peak_is_the_correlation_of_the_chips_averaged_over_a_sample() {
    let truth = observation(&L1_CA, 5);
    // A period has a part of a sample more than whole ones, so that edges lie elsewhere in each.
    let rate_hz = 4.103_618e6;
    let metadata = metadata(&L1_CA, &truth, rate_hz);
    let rows = samples(&truth, &metadata, &[(0.0, 3.0, 0.0)], 0.02).peaks(std::slice::from_ref(&truth));
    assert_eq!(rows.len(), 121);
    let code = L1_CA.code(5).unwrap();
    let width = 1.023e6 / rate_hz;
    let top = expected(&code, 0.0, width);
    for (delay, in_phase, quadrature) in curve(&rows) {
        // An instant for an interval misplaces an edge evenly within a sample, √(1/12) of 0.25 chip. There
        // are 512 edges in each of 18 periods, changes by two of 1023 chips: σ = 2·0.072·√(512/18)/1023 =
        // 8e-4. Allowed is four times that.
        let right = expected(&code, delay, width) / top;
        assert!((in_phase - right).abs() < 3e-3 && quadrature.abs() < 3e-3, "{delay}: {in_phase} {quadrature} {right}");
    }
}

#[test]
fn a_reflection_appears_at_its_delay_with_its_phase_and_a_mirrored_or_real_recording_is_the_same() {
    let truth = observation(&L1_CA, 9);
    let metadata = metadata(&L1_CA, &truth, 10.3e6);
    // A quarter of a cycle ahead, 0.8 chip later.
    let rays = [(0.0, 1.0, 0.0), (0.8, 0.5, 0.25)];
    let glimpse = samples(&truth, &metadata, &rays, 0.012);
    let straight = glimpse.peaks(std::slice::from_ref(&truth));
    let (code, width) = (L1_CA.code(9).unwrap(), 1.023 / 10.3);
    let of = |delay: f64| Complex64::new(expected(&code, delay, width), 0.5 * expected(&code, delay - 0.8, width));
    // The prompt's phase is that of the sum.
    let turn = of(0.0).conj() / of(0.0).norm();
    let largest = curve(&straight).iter().map(|at| of(at.0).norm()).fold(0.0, f64::max);
    for (delay, in_phase, quadrature) in curve(&straight) {
        let right = of(delay) * turn / largest;
        assert!(
            (Complex64::new(in_phase, quadrature) - right).norm() < 4e-3,
            "{delay}: {in_phase} {quadrature} {right}"
        );
    }

    let mirrored = Glimpse {
        metadata: IfMetadata { inverted: true, ..glimpse.metadata.clone() },
        q: glimpse.q.iter().map(|q| -q).collect(),
        ..glimpse.clone()
    };
    assert_eq!(mirrored.peaks(std::slice::from_ref(&truth)), straight);
    // Of real samples the image is far away in frequency: what it adds is noise of the code.
    let real = Glimpse {
        q: Vec::new(),
        metadata: IfMetadata { center_hz: truth.signal.carrier_hz(truth.sv) - 3e5, ..metadata },
        ..glimpse
    };
    for (a, b) in curve(&real.peaks(std::slice::from_ref(&truth))).iter().zip(curve(&straight)) {
        assert!((a.1 - b.1).abs() < 0.06, "{}: {} {}", b.0, a.1, b.1);
    }
}

#[test]
fn every_signal_has_the_correlation_of_its_waveform() {
    for signal in SIGNALS {
        let Some(component) = looked_at(signal) else { panic!("{signal}: no short component") };
        let number = (1..=200).find(|number| (component.code)(*number).is_some()).unwrap();
        let truth = observation(signal, number);
        let rate_hz = 2.3 * component.chip_rate_hz * component.steps_per_chip() as f64;
        let metadata = metadata(signal, &truth, rate_hz);
        let glimpse = samples(&truth, &metadata, &[(0.0, 1.0, 0.0)], 2.1 * component.period_s());
        let rows = glimpse.peaks(std::slice::from_ref(&truth));
        // As a mean over the length of a sample.
        let (shape, width) = (component.shape(), component.chip_rate_hz / rate_hz);
        let mean = |delay: f64| {
            let at = |k: i32| delay + width * ((f64::from(k) + 0.5) / 100.0 - 0.5);
            (0..100).map(|k| shape.correlation(at(k) / component.chip_rate_hz)).sum::<f64>() / 100.0
        };
        // Codes correlate with themselves at other delays like noise: five times its spread.
        let chips = (component.code)(number).unwrap().iter().filter(|chip| **chip != 0).count() as f64;
        let allowed = 5.0 / chips.sqrt();
        let middle = rows.len() / 2;
        assert!(rows.len() >= 121 && rows[0].delay_chips == -1.5 && rows[middle].delay_chips == 0.0, "{signal}");
        for (delay, in_phase, _) in curve(&rows) {
            let right = mean(delay) / mean(0.0);
            assert!((in_phase - right).abs() < allowed, "{signal} at {delay}: {in_phase}, {right}");
        }
        // Samples round the top over their length.
        let top = rows.iter().max_by(|a, b| a.in_phase.total_cmp(&b.in_phase)).unwrap();
        assert!(top.delay_chips.abs() < 0.5 * width, "{signal}: {top:?}");
        if *signal == E1 {
            // Half a chip away BOC(1,1), 10/11 of the power, has -1/2 and BOC(6,1) has 1/2.
            for side in [rows[middle - 24], rows[middle + 24]] {
                assert!((side.in_phase + 9.0 / 22.0).abs() < allowed, "{side:?}");
            }
        }
    }
}

#[test]
fn a_glimpse_that_begins_later_or_through_another_oscillator_shows_the_same() {
    let truth = observation(&E1, 11);
    let metadata = metadata(&E1, &truth, 26e6);
    let glimpse = samples(&truth, &metadata, &[(0.0, 1.0, 0.0)], 0.013);
    let whole = glimpse.peaks(std::slice::from_ref(&truth));
    // A quarter of a period later; a mixer 700 Hz off, which alone would cancel a period of 4 ms.
    let later = Glimpse {
        metadata: IfMetadata { center_hz: metadata.center_hz + 700.0, ..metadata },
        doppler_hz: 700.0,
        later_s: 26_011.0 / 26e6,
        i: glimpse.i[26_011..].to_vec(),
        q: glimpse.q[26_011..].to_vec(),
    };
    let rows = later.peaks(std::slice::from_ref(&truth));
    assert_eq!(rows.len(), whole.len());
    for (a, b) in rows.iter().zip(&whole) {
        // Two or three periods of the same 49 000 edges, of which 26 MHz misplaces each by 0.04/√12 chip:
        // both have σ = 2·0.0114·√(49000/2)/4092 = 9e-4. Allowed is nearly five times the difference's.
        assert!((a.in_phase - b.in_phase).abs() < 6e-3, "{}: {} {}", a.delay_chips, a.in_phase, b.in_phase);
    }
}

#[test]
fn a_glimpse_without_a_whole_period_or_of_an_unknown_satellite_shows_nothing() {
    let truth = observation(&E1, 11);
    let metadata = metadata(&E1, &truth, 4.1e6);
    let glimpse = samples(&truth, &metadata, &[(0.0, 1.0, 0.0)], 0.009);
    let short = Glimpse { i: glimpse.i[..16_000].to_vec(), q: glimpse.q[..16_000].to_vec(), ..glimpse.clone() };
    assert!(short.peaks(std::slice::from_ref(&truth)).is_empty());
    assert_eq!(glimpse.peaks(std::slice::from_ref(&truth)).len(), 145);
    let unknown = Observation { sv: Sv { number: 63, ..truth.sv }, ..truth };
    assert!(glimpse.peaks(&[unknown]).is_empty());
}
