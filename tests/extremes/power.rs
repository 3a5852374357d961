//! Cases 34 to 43: from nothing to ninety decibels too much.

use generator::scene::Scene;
use gnss::gps::l1ca::{self, L1_CA};
use gnss::record::Event;
use gnss::satellite::Sv;
use gnss::signal::Link;
use receiver::acquire::{AcquisitionSettings, Searcher, search};
use receiver::correlate::{Edge, Nco, Replica, chips_to_units};
use receiver::settings::Settings;
use receiver::source::Block;
use receiver::track::TrackingSettings;

use crate::figures::{self, CA, Worst, case};
use crate::run::{self, Received};

const FRONT: &str = "[front_end]\nsample_rate_hz = 2.6e6\nformat = \"ci8\"\n";

fn all() -> Vec<Link> {
    L1_CA.satellites().map(|sv| L1_CA.link(sv)).collect()
}

#[test]
fn at_five_decibels_nothing_is_locked_and_at_eighty_the_code_stands_to_centimetres() {
    let the = case(34, "C/N0 of 5 and 80 dB-Hz", CA);
    let scene = run::scene(60.0, &format!("{FRONT}[noise]\n[power]\ncn0_dbhz = 5\n"));
    let received = Received::of(&scene, &Settings::default());
    let locked =
        received.events().iter().filter(|row| matches!(row.event, Event::PhaseLocked | Event::BitSynchronised)).count();
    the.none("5 dB-Hz for 60 s: locks", locked);
    the.none("5 dB-Hz for 60 s: fixes", received.fixes().len());
    // One false alarm in 1e6 spectra is designed.
    the.none("60 s of noise: seconds with a line told", received.lines().len());
    // One satellite alone, edges band-limited, 10 Msps: σ = 1.5 cm at B = 1 Hz, d = 0.5.
    let sv = Sv::gps(23);
    let tables = "[front_end]\nsample_rate_hz = 10e6\nformat = \"cf32\"\n[noise]\n[power]\ncn0_dbhz = 80\n[fidelity]\n\
        code_edge = \"band_limited\"\n";
    let scene = run::only(run::scene(4.0, tables), &[sv]);
    let settings = TrackingSettings { dll_bandwidth_hz: 1.0, ..Default::default() };
    let (channel, report) =
        run::track(&scene, &run::samples(&scene), &run::hit(&scene, sv, 0.1, 10.0), &settings, 100_000);
    assert!(!channel.is_lost());
    let errors: Vec<f64> = (report.measurements.iter())
        .filter(|m| m.sample > 20_000_000)
        .map(|m| run::code_error_m(&scene, sv, m.sample, m.code_fraction))
        .collect();
    let mean = errors.iter().sum::<f64>() / errors.len() as f64;
    let sigma = (errors.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / errors.len() as f64).sqrt();
    // 2 s hold four times the loop's memory: the spread is known to a third, three sigma of it above.
    the.at_most("80 dB-Hz: code, standard deviation", (sigma, "G23 from 2 s to 4 s"), 0.03, "m");
    the.at_most("80 dB-Hz: code, mean", (mean.abs(), "G23 from 2 s to 4 s"), 0.05, "m");
}

#[test]
fn ten_satellites_of_fifty_five_leave_each_other_fifty() {
    let the = case(35, "all at 55 dB-Hz", CA);
    let tables = "[front_end]\nsample_rate_hz = 5e6\nformat = \"ci16\"\n[noise]\n[power]\ncn0_dbhz = 55\n";
    let scene = run::scene(5.0, tables);
    let up: Vec<Sv> = run::in_view(&scene).into_iter().take(10).collect();
    assert_eq!(up.len(), 10);
    let scene = run::only(scene, &up);
    let bytes = run::samples(&scene);
    let mut mean_db = 0.0;
    for sv in &up {
        let (_, report) =
            run::track(&scene, &bytes, &run::hit(&scene, *sv, 0.1, 10.0), &TrackingSettings::default(), 500_000);
        mean_db += report.measurements.last().unwrap().cn0_dbhz / 10.0;
    }
    // Nine matched signals at −61.86 dB of seconds: 50.44 dB-Hz; single pairs differ by their own lines.
    the.near("mean C/N0 of ten", (mean_db, "after 5 s"), 50.44, 0.5, "dB-Hz");
}

#[test]
fn what_a_strong_satellite_puts_into_others_is_not_taken_for_them() {
    let the = case(36, "near-far of 25 dB", CA);
    let text = std::fs::read_to_string(run::folder().join("near_far.toml")).unwrap();
    let metadata = run::try_scene(&text).unwrap().metadata;
    let mut searcher = Searcher::new(&metadata, &AcquisitionSettings::default()).unwrap();
    // Hits are believed down to 24 dB below the strongest, after that one is taken out.
    for (apart_db, weak) in [(25, "42"), (20, "47"), (12, "55")] {
        let (mut ghosts, mut wrong, mut found, mut of) = (0, 0_usize, 0_usize, 0);
        let mut scene = run::try_scene(&text.replace("cn0_dbhz = 42", &format!("cn0_dbhz = {weak}"))).unwrap();
        let mut others: Vec<Sv> = run::in_view(&scene).into_iter().filter(|sv| *sv != Sv::gps(23)).collect();
        others.truncate(if figures::long() { usize::MAX } else { 4 });
        for (seed, other) in (1..).zip(others) {
            scene.seed = seed;
            scene.excluded = scene.catalogue.satellites().filter(|sv| ![Sv::gps(23), other].contains(sv)).collect();
            let bytes = run::part(&scene, 0..100_000, tempfile::tempdir().unwrap().path());
            let (i, q) = run::planes(&scene, &bytes);
            of += 1;
            for (row, hit) in searcher.search(&Block { first: 0, i: &i, q: &q }, &all()).unwrap() {
                let Some(hit) = hit else { continue };
                if row.sv == other {
                    let near = run::code_error_m(&scene, other, 0, hit.code_phase_chips / 1023.0).abs() < 150.0;
                    wrong += usize::from(!near);
                    found += usize::from(near);
                } else if row.sv != Sv::gps(23) {
                    ghosts += 1;
                }
            }
        }
        the.none(&format!("{apart_db} dB: absent satellites acquired"), ghosts);
        the.none(&format!("{apart_db} dB: weak one acquired at a cross-correlation"), wrong);
        if apart_db < 24 {
            // Without the strong one 47 dB-Hz and more are found always, and their powers are known to a
            // decibel.
            let share = found as f64 / f64::from(of);
            the.at_least(
                &format!("{apart_db} dB: weak one found at its delay"),
                (share, format!("{of} seeds")),
                0.9,
                "of them",
            );
        }
    }
}

#[test]
fn silence_is_received_without_a_number_that_is_none() {
    let the = case(37, "zero signal, zero noise", CA);
    for (name, format, bytes_of) in [("ci8", "ci8", 2), ("cf32", "cf32", 8), ("ri16", "ri16", 2)] {
        let if_hz = if format == "ri16" { "if_hz = 6e5\n" } else { "" };
        let scene = run::scene(
            2.0,
            &format!("[front_end]\nsample_rate_hz = 2.6e6\nformat = \"{format}\"\n{if_hz}[power]\ncn0_dbhz = 45\n"),
        );
        let bytes = vec![0_u8; 5_200_000 * bytes_of];
        let received = Received::from_bytes(&scene, &bytes, &Settings::default(), tempfile::tempdir().unwrap());
        let told = received.outcome.diagnosis.is_some() && received.outcome.acquired.is_empty();
        the.all(
            &format!("{name}: all tables finite, nothing acquired, cause told"),
            usize::from(received.finite() && told),
            1,
        );
        // And a channel that is set upon it.
        let hit = run::hit(&scene, run::in_view(&scene)[0], 0.0, 0.0);
        let (channel, report) = run::track(&scene, &bytes, &hit, &TrackingSettings::default(), 26_000);
        let finite = report
            .measurements
            .iter()
            .all(|m| m.doppler_hz.is_finite() && m.code_fraction.is_finite() && m.cn0_dbhz.is_finite() && !m.locked);
        the.all(
            &format!("{name}: channel finite, never locked, lost or waiting"),
            usize::from(
                finite
                    && report.events.iter().all(|(_, e)| *e != Event::PhaseLocked)
                    && (channel.is_lost() || !report.measurements.is_empty()),
            ),
            1,
        );
    }
}

#[test]
fn without_noise_the_ratio_has_its_cap() {
    let the = case(38, "noise off", CA);
    let sv = Sv::gps(23);
    let tables = "[front_end]\nsample_rate_hz = 5e6\nformat = \"cf32\"\n[power]\ncn0_dbhz = 60\n[fidelity]\nlevel \
                  = \"reference\"\ncode_edge = \"area\"\n";
    let scene = run::only(run::scene(3.0, tables), &[sv]);
    let (_, report) = run::track(
        &scene,
        &run::samples(&scene),
        &run::hit(&scene, sv, 0.0, 0.0),
        &TrackingSettings::default(),
        50_000,
    );
    let (mut least, mut most) = (Worst::least(), Worst::default());
    for told in report.measurements.iter().filter(|m| m.locked) {
        let at = || format!("G23, {:.2} s", scene.clock.rate.elapsed_s(told.sample));
        least.take(told.cn0_dbhz, at);
        most.take(told.cn0_dbhz, at);
    }
    the.at_most("largest C/N0 told", most, 100.0, "dB-Hz");
    the.at_least("least C/N0 told once locked", least, 60.0, "dB-Hz");
}

/// The static scene for seconds, jammed from the fourth one on.
fn jammed(interference: &str, duration_s: f64, front: &str) -> Scene {
    run::scene(duration_s, &format!("{front}[noise]\n[power]\ncn0_dbhz = 45\n[[interference]]\n{interference}"))
}

#[test]
fn ninety_decibels_end_every_channel_and_wrap_no_sample() {
    let the = case(39, "J/S of 90 dB", CA);
    let scene = jammed("kind = \"noise\"\nbandwidth_hz = 2e6\njs_db = 90\non_s = 4\n", 6.0, FRONT);
    let bytes = run::samples(&scene);
    let received = Received::from_bytes(&scene, &bytes, &Settings::default(), tempfile::tempdir().unwrap());
    let events = received.events();
    let locked: std::collections::BTreeSet<Sv> = events
        .iter()
        .filter(|row| row.event == Event::BitSynchronised && row.sample < 10_400_000)
        .map(|row| row.sv)
        .collect();
    let lost = |sv: &&Sv| {
        events.iter().any(|row| {
            row.sv == **sv && row.event == Event::LossOfLock && (10_400_000..11_700_000).contains(&row.sample)
        })
    };
    assert!(locked.len() >= 10, "{locked:?}");
    the.all("channels lost within 0.5 s", locked.iter().filter(lost).count(), locked.len());
    let late = events.iter().filter(|row| row.event == Event::PhaseLocked && row.sample > 11_700_000).count();
    the.none("locks under the jammer", late);
    the.all("all tables finite", usize::from(received.finite()), 1);
    let jam: Vec<i8> = bytes[2 * 10_660_000..].iter().map(|b| *b as i8).collect();
    let (high, low) =
        (jam.iter().filter(|x| **x == 127).count() as f64, jam.iter().filter(|x| **x <= -127).count() as f64);
    // Saturated on both sides alike; 6e6 samples of a band of 2 MHz are known to a few permille.
    the.at_least("samples at full scale", ((high + low) / jam.len() as f64, "from 4.1 s on"), 0.9, "");
    the.near("share at the upper end of those", (high / (high + low), "from 4.1 s on"), 0.5, 0.01, "");
}

#[test]
fn a_tone_on_a_line_of_the_code_is_a_constant_of_the_predicted_size_and_no_satellite() {
    let the = case(40, "CW on PRN 6's line at −227 kHz, J/S 30 dB", CA);
    // A still code against the tone alone.
    let scene = jammed(
        "kind = \"cw\"\noffset_hz = -227e3\njs_db = 30\n",
        1.0,
        "[front_end]\nsample_rate_hz = 5e6\nformat = \"cf32\"\n",
    );
    let (mut i, mut q) = (vec![0.0_f32; 1_003_520], vec![0.0_f32; 1_003_520]);
    let source = &scene.interference[0];
    let mut block = generator::stage::Block::whole(0, &mut i, &mut q);
    generator::stage::Stage::act(source, &mut block);
    let replica = Replica::new(l1ca::code(6).unwrap(), Edge::Area).unwrap();
    let step = chips_to_units(1.023e6 / 5e6) as u64;
    let amplitude = f64::from(scene.noise_lsb) * (2.0 * libm::pow(10.0, 4.5) / 5e6).sqrt();
    let mut sum = num_complex::Complex64::ZERO;
    for k in 0..200 {
        let nco = Nco { carrier: 0, carrier_step: 0, code: chips_to_units(0.0), code_step: step };
        let [prompt] = replica.slow(&i[k * 5000..(k + 1) * 5000], &q[k * 5000..(k + 1) * 5000], &nco, &[0]);
        sum += prompt / (5000.0 * amplitude * 200.0);
    }
    the.near("constant phasor over the signal's", (sum.norm(), "PRN 6, 0.2 s"), 2.73, 0.09, "");
    // The receiver: the wave stands on the line as the satellite's motion places it when it begins, at 3 s.
    let sv = Sv::gps(6);
    // The wave is 11 dB above the noise of the band: eight deviations are 64 LSB.
    let front = format!("{FRONT}noise_lsb = 8\n");
    let still = run::scene(6.0, &front);
    let authentic = generator::spoof::Constellation::authentic();
    let (row, ..) = generator::truth::observe(&still, &authentic, sv, &L1_CA, 3 * 2_600_000, 0.0).unwrap().unwrap();
    let wave_hz = -227e3 * (1.0 + row.doppler_hz / L1_CA.centre_hz()) + row.doppler_hz;
    let scene = jammed(&format!("kind = \"cw\"\noffset_hz = {wave_hz:.3}\njs_db = 30\non_s = 3\n"), 6.0, &front);
    let up: Vec<Sv> = [sv].into_iter().chain(run::in_view(&scene).into_iter().filter(|up| *up != sv).take(3)).collect();
    let scene = run::only(scene, &up);
    let received = Received::of(&scene, &Settings::default());
    let lines = received.lines();
    let second = |sample: u64| sample / 2_600_000;
    the.all("seconds under it that are told", lines.iter().filter(|row| second(row.sample) >= 3).count(), 3);
    the.none("seconds before it that are told", lines.iter().filter(|row| second(row.sample) < 3).count());
    let worst = |of: &dyn Fn(&gnss::record::LineRow) -> f64| {
        let mut worst = Worst::default();
        lines.iter().for_each(|row| worst.take(of(row), || format!("second {}", second(row.sample))));
        worst
    };
    // Of a bin of 635 Hz; a line 40 dB above its bin is known to a hundredth of it, half a percent of its
    // neighbour's.
    the.at_most("frequency told", worst(&|row| (row.frequency_hz - wave_hz).abs()), 0.05 * 635.0, "Hz");
    // The density of what lies beside it is known to 4 % and 3 % high; C/N0 of four reads 44.8.
    the.at_most("J/S told, off 30 dB", worst(&|row| (row.js_db.unwrap_or(f64::INFINITY) - 30.0).abs()), 1.0, "dB");
    let truth = received.truth();
    let events = received.events();
    let false_locks =
        events.iter().filter(|row| row.event == Event::BitSynchronised && row.sample > 7_800_000).filter(|row| {
            let seen = truth.iter().find(|t| t.sv == row.sv && t.sample >= row.sample);
            seen.is_none()
        });
    the.none("absent satellites that reach bit lock under it", false_locks.count());
    the.all("all tables finite", usize::from(received.finite()), 1);
    // What makes the flag needed: the satellite's channel takes the wave for its signal, 8.7 dB stronger.
    let read = |from: u64, to: u64| {
        let rows = received.tracking();
        let inside = rows.iter().filter(|row| row.sv == sv && (from..to).contains(&row.sample));
        inside.map(|row| row.cn0_dbhz).fold(f64::NEG_INFINITY, f64::max)
    };
    // At most the phasors' sum, 20 lg(1 + 2.73); it is high.
    let high_db = read(7_800_000, u64::MAX) - read(0, 7_800_000);
    the.at_least("C/N0 that the satellite's channel tells, too high by", (high_db, "G06"), 1.0, "dB");
    the.at_most("C/N0 that the satellite's channel tells, too high by", (high_db, "G06"), 11.4, "dB");
    // A satellite's own lines are none: 67 dB-Hz has them 16 dB above the noise of a bin.
    let text = std::fs::read_to_string(run::folder().join("near_far.toml")).unwrap();
    let strong = run::only(run::try_scene(&text.replace("duration_s = 1", "duration_s = 3")).unwrap(), &[Sv::gps(23)]);
    let own = Received::of(&strong, &Settings::default());
    the.none("alone at 67 dB-Hz: seconds in which its own lines are told", own.lines().len());
}

#[test]
fn an_offset_of_one_step_and_a_stuck_bit_are_no_satellites() {
    let the = case(41, "DC at f_IF = 0, 1-bit stuck", CA);
    let quiet = |tables: &str| run::scene(1.0, &format!("{FRONT}{tables}[power]\ncn0_dbhz = 45\n[noise]\n"));
    let mut scene = quiet("noise_lsb = 0.3\n[iq]\ndc_i_lsb = 1\ndc_q_lsb = -1\n");
    scene.excluded = scene.catalogue.satellites().collect();
    let ghosts = |scene: &Scene, bytes: &[u8]| {
        let (i, q) = run::planes(scene, bytes);
        let rows = search(&scene.metadata, &Block { first: 0, i: &i, q: &q }, &all(), &AcquisitionSettings::default())
            .unwrap();
        assert!(rows.iter().all(|(row, _)| row.statistic.is_finite() && row.cn0_dbhz.is_finite()));
        rows.iter().filter(|(_, hit)| hit.is_some()).count()
    };
    the.none("8-bit with a DC of 1 LSB and noise of 0.3: acquired", ghosts(&scene, &run::samples(&scene)));
    // The comparator never leaves its side.
    let mut scene = quiet("[iq]\ndc_i_lsb = 60\ndc_q_lsb = 60\n[adc]\nbits = 1\n");
    scene.excluded = scene.catalogue.satellites().collect();
    scene.noise = false;
    let bytes = run::samples(&scene);
    the.all("1-bit stuck: one value throughout", usize::from(bytes.iter().all(|b| *b == bytes[0])), 1);
    the.none("1-bit stuck: acquired", ghosts(&scene, &bytes));
    let received = Received::from_bytes(&scene, &bytes, &Settings::default(), tempfile::tempdir().unwrap());
    the.all(
        "1-bit stuck: tables finite, cause told",
        usize::from(received.finite() && received.outcome.diagnosis.is_some()),
        1,
    );
}

#[test]
fn the_sign_of_zero_is_plus() {
    let the = case(42, "1-bit at zero input", CA);
    let mut scene = run::scene(0.01, &format!("{FRONT}[adc]\nbits = 1\n[power]\ncn0_dbhz = 45\n"));
    scene.excluded = scene.catalogue.satellites().collect();
    let values: Vec<i8> = run::samples(&scene).iter().map(|b| *b as i8).collect();
    the.all("samples at the upper level", values.iter().filter(|x| **x > 0 && **x == values[0]).count(), 52_000);
}

#[test]
fn pulses_without_length_and_sweeps_within_a_sample_are_refused() {
    let the = case(43, "duty 0 and 1, sweep below a sample", CA);
    let scene = |interference: &str| {
        run::try_scene(&run::text(
            1.0,
            &format!("{}{FRONT}[power]\ncn0_dbhz = 45\n[[interference]]\n{interference}js_db = 20\n", run::PLACE),
        ))
    };
    let bad = [
        ("kind = \"pulse\"\nwidth_s = 0\nrate_hz = 1000\n", "width_s"),
        ("kind = \"pulse\"\nwidth_s = 2e-3\nrate_hz = 1000\n", "width_s"),
        ("kind = \"chirp\"\nsweep_hz = 1e6\nsweep_s = 1e-7\n", "sweep_s"),
        ("kind = \"fmcw\"\nsweep_hz = 1e6\nsweep_s = 1e-7\n", "sweep_s"),
    ];
    let told = bad.iter().filter(|(text, key)| {
        let found = scene(text);
        found.is_err_and(|e| e.contains(key))
    });
    the.all("refused by name", told.count(), bad.len());
    let whole = scene("kind = \"pulse\"\nwidth_s = 1e-3\nrate_hz = 1000\n").unwrap();
    let (mut i, mut q) = (vec![0.0_f32; 8192], vec![0.0_f32; 8192]);
    let mut block = generator::stage::Block::whole(0, &mut i, &mut q);
    generator::stage::Stage::act(&whole.interference[0], &mut block);
    the.all("duty 1: on at every sample", i.iter().zip(&q).filter(|(i, q)| i.hypot(**q) > 0.0).count(), 8192);
}
