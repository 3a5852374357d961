//! Joins and errors of rows made by hand.

use super::*;
use crate::hand_made::{PLANTED, RATE_HZ, planted, planted_run, write};
use crate::measure::clock::Clock;
use crate::read::Emission;
use crate::read::derived::Derived;
use crate::waveform::{Edge, Sampler, Waveform};
use crate::{Summary, judge};
use gnss::gps::l1ca::L1_CA;
use gnss::satellite::Sv;
use gnss::signal::synthetic::LONG_BOC;

/// Ten observations a second, locked for five seconds at the first.
pub fn arc(carrier: &[f64]) -> Vec<SignalError> {
    let row = |(index, &carrier_cycles): (usize, &f64)| SignalError {
        sample: index as u64 * 100,
        time_s: index as f64 * 0.1,
        code_m: 0.0,
        carrier_cycles,
        raw_cycles: carrier_cycles,
        doppler_hz: 0.0,
        cn0_dbhz: 45.0,
        cn0_true_dbhz: 45.0,
        cn0_effective_dbhz: 45.0,
        locked_s: 5.0 + index as f64 * 0.1,
        sent_fraction_s: 0.0,
    };
    carrier.iter().enumerate().map(row).collect()
}

fn levelled(mut rows: Vec<SignalError>, declared: &[u64]) -> (usize, Vec<f64>) {
    let slips = level_carrier(&mut rows, declared);
    (slips, rows.iter().map(|row| row.carrier_cycles).collect())
}

#[test]
fn a_jump_that_stays_is_a_slip_and_a_spike_is_none() {
    let (slips, rest) = levelled(arc(&[7.5, 7.5, 7.5, 8.0, 8.0, 8.0, 8.0]), &[]);
    assert_eq!((slips, rest), (1, vec![0.0; 7]));
    let (slips, rest) = levelled(arc(&[3.0, 3.0, 3.0, 4.0, 3.0, 3.0]), &[]);
    assert_eq!((slips, rest), (0, vec![0.0, 0.0, 0.0, 1.0, 0.0, 0.0]));
    let (slips, _) = levelled(arc(&[3.0, 3.0, 3.0, 3.25, 3.5, 3.5, 3.5, 3.5]), &[]);
    assert_eq!(slips, 1, "a slip that shows as two half steps");
}

#[test]
fn a_declared_slip_and_a_new_lock_start_an_arc_without_a_jump() {
    let carrier = [7.0, 7.0, 7.0, 9.5, 9.5, 9.5];
    assert_eq!(levelled(arc(&carrier), &[250]), (0, vec![0.0; 6]));
    let mut rows = arc(&carrier);
    rows[3..].iter_mut().for_each(|row| row.locked_s -= 5.3);
    assert_eq!(levelled(rows, &[]), (0, vec![0.0; 6]));
}

#[test]
fn a_constant_phase_error_survives_the_constant() {
    let (_, rest) = levelled(arc(&[1e8 + 0.02; 9]), &[]);
    // An f64 of 1e8 cycles resolves 1.5e-8.
    assert!(rest.iter().all(|cycles| (cycles - 0.02).abs() < 2e-8));
}

#[test]
fn a_truth_of_another_run_is_refused() {
    let run = planted_run(&PLANTED);
    let path = run.path().join("rx/observations.csv");
    let mut rows: Vec<Observation> = csv::Reader::from_path(&path).unwrap().deserialize().map(Result::unwrap).collect();
    rows.iter_mut().for_each(|row| row.sample += 1);
    write(&path, &rows);
    assert!(matches!(judge(run.path()), Err(JudgeError::NothingJoins { what: "observations", count: 2700 })));
}

#[test]
fn the_pull_in_after_a_lock_is_an_error_but_no_jitter() {
    let run = planted_run(&PLANTED);
    let path = run.path().join("rx/observations.csv");
    let mut rows: Vec<Observation> = csv::Reader::from_path(&path).unwrap().deserialize().map(Result::unwrap).collect();
    for row in rows.iter_mut().filter(|row| row.sv == Sv::gps(18) && row.sample >= 500 * RATE_HZ / 10) {
        row.locked_s = (row.sample - 500 * RATE_HZ / 10) as f64 / RATE_HZ as f64;
        row.doppler_hz += if row.locked_s < 2.9 { 20.0 } else { 0.0 };
        row.carrier_cycles += 12_345.0;
    }
    write(&path, &rows);
    let summary = judge(run.path()).unwrap();
    // 29 of 2700 rows are 20 Hz off: 2 Hz RMS.
    assert!(summary.observables.doppler_rms_hz.unwrap() > 2.0);
    // 5 sigma / sqrt(2 n) = 0.028 of 0.4 Hz.
    assert!((summary.tracking.fll_sigma_hz.unwrap() - 0.4).abs() < 0.028);
    assert_eq!(summary.tracking.cycle_slips, 1, "a new lock is no slip");
}

#[test]
fn what_signals_differ_by_is_no_error_and_each_disturbs_the_other() {
    let directory = planted();
    let mut run = Run::read(directory.path()).unwrap();
    let alone = Errors::measure(&run).unwrap();
    // The same satellites again with a second signal, whose codes are all 30 m later.
    for link in run.truth.keys().collect::<Vec<_>>() {
        let other = LONG_BOC.link(link.sv);
        for row in run.truth.rows(link).unwrap() {
            let row = Observation { signal: &LONG_BOC, ..row };
            let own_hz = linear_hz(row.cn0_dbhz);
            run.cn0_sums_hz.change(row.sample, Emission::of(other), |sum_hz| sum_hz + own_hz).unwrap();
            run.truth.push(other, &row).unwrap();
        }
        for row in run.observations.rows(link).unwrap() {
            let sent_fraction_s = row.sent_fraction_s - 30.0 / SPEED_OF_LIGHT_MPS;
            run.observations.push(other, &Observation { signal: &LONG_BOC, sent_fraction_s, ..row }).unwrap();
        }
    }
    run.cn0_sums_hz.close().unwrap();
    run.signals.insert(&LONG_BOC);
    run.derived = Derived::default();
    let both = Errors::measure(&run).unwrap();
    let rms_m = |errors: &Errors| errors.code_without_clock_m(None).unwrap().rms().unwrap().unwrap();
    // A fraction of a second resolves 1e-16 s.
    assert!((rms_m(&both) - rms_m(&alone)).abs() < 1e-6, "{} {}", rms_m(&both), rms_m(&alone));
    let summary = Summary::new(&run, &both, &Clock::measure(&run, &both).unwrap()).unwrap();
    let names: Vec<&str> = summary.signals.keys().copied().collect();
    assert_eq!(names, [L1_CA.name, LONG_BOC.name]);
    let bias_m = |name: &str| summary.signals[name].observables.pseudorange_bias_m.unwrap();
    assert!((bias_m(LONG_BOC.name) - bias_m(L1_CA.name) - 30.0).abs() < 1e-6);
    // Spectral separation of both, each from itself and from the other.
    let [code, boc] = [&L1_CA, &LONG_BOC].map(|signal| Waveform::of(signal).unwrap());
    let sampler = Sampler::new(Edge::Area, run.scene.sample_rate_hz);
    let kappa = |a: &Waveform, b: &Waveform| a.separation_s(b, 0.0, &sampler);
    for (own, other, signal) in [(&code, &boc, &L1_CA), (&boc, &code, &LONG_BOC)] {
        let link = run.truth.keys().find(|link| link.signal == signal).unwrap();
        let row = both.signals.rows(link).unwrap()[0];
        let mut levels = run.cn0_sums_hz.finder();
        let mut sum_hz = |signal: &'static Signal| levels.get(row.sample, Emission::of(signal.link(link.sv))).unwrap();
        let [own_kept, kept] = [own, other].map(|one| one.power(&sampler));
        let of_both = [(&L1_CA, &code), (&LONG_BOC, &boc)];
        let sums_hz: f64 = of_both.map(|(signal, one)| one.power(&sampler) * sum_hz(signal)).iter().sum();
        let sum_hz = sum_hz(signal);
        let own_hz = linear_hz(row.cn0_true_dbhz);
        // Of the powers at the antenna the samples have what edges leave.
        let lost = 1.0 + own_kept * kappa(own, own) * (sum_hz - own_hz) + kept * kappa(own, other) * sum_hz;
        let found = linear_hz(row.cn0_true_dbhz - row.cn0_effective_dbhz);
        assert!((found / lost - 1.0).abs() < 1e-9, "{signal}: {found} {lost}");
        // In units of all power in the samples its spectrum does not matter.
        let white_hz = own_hz / (1.0 + sums_hz / run.scene.sample_rate_hz);
        let found_hz = MultipleAccess::new(&run).white_hz(row.sample, link, own_hz);
        assert!((found_hz / white_hz - 1.0).abs() < 1e-9, "{signal}: {found_hz} {white_hz}");
    }
}

fn linear_hz(dbhz: f64) -> f64 {
    libm::pow(10.0, dbhz / 10.0)
}
