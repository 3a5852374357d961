//! Cases 1 to 4, 6 and 7: weeks that end, years that leap, starts between samples.

use std::sync::Arc;

use generator::catalogue::Catalogue;
use generator::message::Senders;
use generator::scene::Scene;
use generator::synth::Edge;
use generator::transmit::Transmitter;
use generator::truth;
use gnss::broadcast::Ephemeris;
use gnss::earth::{EARTH_ROTATION_RADPS, SPEED_OF_LIGHT_MPS};
use gnss::gps::l1ca::L1_CA;
use gnss::gps::lnav::{self, Broadcast, Subframe, UtcData};
use gnss::message::Common;
use gnss::rinex;
use gnss::time::{Epoch, WEEK_S};

use crate::figures::{self, CA, Worst, case};
use crate::run::{self, Received};

/// A set `delta_s` later on the same Earth-fixed path: the node at the week's begin turns with it.
fn moved(set: &Ephemeris, delta_s: i64) -> Ephemeris {
    let later = |at: Epoch| Epoch::new(at.seconds() + delta_s, at.fraction());
    let toe = later(set.toe);
    let turned = EARTH_ROTATION_RADPS * (toe.tow_s() - set.toe.tow_s());
    Ephemeris {
        toe,
        toc: later(set.toc),
        transmitted: later(set.transmitted),
        omega0_rad: libm::remainder(set.omega0_rad + turned, std::f64::consts::TAU),
        ..set.clone()
    }
}

/// A scene `delta_s` later, a multiple of two hours.
fn shifted(mut scene: Scene, delta_s: i64) -> Scene {
    assert_eq!(delta_s % 7200, 0);
    let start = scene.clock.start;
    let sets = rinex::embedded().unwrap().ephemerides.iter().map(|set| moved(set, delta_s)).collect();
    scene.clock.start = Epoch::new(start.seconds() + delta_s, start.fraction());
    scene.metadata.start = Some(scene.clock.start);
    scene.catalogue = Arc::new(Catalogue::new(sets).0);
    let almanac: Vec<_> = (scene.catalogue.satellites())
        .filter_map(|sv| scene.catalogue.sent_at(sv, scene.clock.start).cloned())
        .collect();
    let utc = UtcData { leap_s: 15, ..UtcData::default() };
    let common = Common { utc, almanac, reference: Some(scene.clock.start), ..Common::default() };
    scene.messages = Arc::new(Senders::new(&common, &scene.signals).unwrap());
    scene
}

/// Largest difference of pseudoranges `at_s` ± 1 s after the start between a scene and its shifted twin.
fn worst_difference_m(here: &Scene, there: &Scene, at_s: f64) -> (Worst, usize) {
    let (mut worst, mut checked) = (Worst::default(), 0);
    for sv in run::in_view(here) {
        for k in -50..=50 {
            let t_s = at_s + 0.02 * f64::from(k);
            let delay_s = |scene: &Scene| {
                let seen = truth::seen(scene, sv, &L1_CA, scene.clock.start.plus_s(t_s)).unwrap().unwrap();
                seen.arrivals[0].delay_s
            };
            let apart_m = (delay_s(here) - delay_s(there)).abs() * SPEED_OF_LIGHT_MPS;
            worst.take(apart_m, || format!("{sv}, {t_s:.2} s"));
            checked += 1;
        }
    }
    (worst, checked)
}

/// 32 days less 8 h of it: 2010-07-01T08:00:00 becomes a Sunday's midnight.
const TO_THE_WEEK_S: i64 = 230_400;

#[test]
fn the_week_ends_without_a_step_in_range_and_without_a_lost_fix() {
    let the = case(1, "week rollover", CA);
    let front = "[front_end]\nsample_rate_hz = 2.6e6\nformat = \"ci8\"\n[noise]\n[power]\ncn0_dbhz = 45\n";
    let text = run::text(44.0, &format!("{}{front}{}", run::PLACE, run::BARE)).replace("08:05:58", "07:59:28");
    let here = run::try_scene(&text).unwrap();
    let there = shifted(run::try_scene(&text).unwrap(), TO_THE_WEEK_S);
    assert_eq!(there.clock.epoch(32 * 2_600_000), Epoch::from_week(1591, 0.0));
    let (worst_m, checked) = worst_difference_m(&here, &there, 32.0);
    assert!(checked > 800, "{checked}");
    // Angles of the moved sets are rounded again: 2π to 4.4e-16 rad at 2.66e7 m is 1.2e-8 m, a few times.
    the.at_most("pseudorange against the same sky in mid-week", worst_m, 1e-6, "m");
    let received = Received::of(&there, &run::settings(&text));
    let (worst_m, after) = received.worst_m(&there, 32.0);
    // 45 dB-Hz, code loop of 0.5 Hz: 0.6 m on a range; PDOP 2, smoothed, three sigma.
    the.at_most("fixes after the rollover, 3-D", worst_m, 3.6, "m");
    the.at_least("fixes in the 12 s after it", (after as f64, "of 120 due"), 115.0, "");
    // What a user sees of the conditioning: a column of the fixes, and the receiver's own words.
    let told = received.outcome.conditioning.clone();
    let mut condition = Worst::default();
    for fix in received.fixes() {
        condition.take(fix.condition, || format!("{:.1} s", there.clock.rate.elapsed_s(fix.sample)));
    }
    let worst = condition.value();
    let of = case(58, "conditioning told", CA);
    of.at_most("condition of the geometry of an open sky, from the table of fixes", condition, 20.0, "");
    let words = told.to_string();
    let whole = told.geometry_worst == Some(worst)
        && words.contains(&format!("up to {worst:.1}, refused from 1e4"))
        && words.contains("0.072 (pll_bandwidth_hz), refused above 0.4: 82 % left");
    of.all("the receiver's words on geometry and loops", usize::from(whole), 1);
}

#[test]
fn reference_times_half_a_week_away_and_in_the_next_week_give_no_step() {
    let the = case(2, "tk at ±302 400 s", CA);
    let (mut worst_m, mut wrong) = (Worst::default(), 0);
    let sets = rinex::embedded().unwrap().ephemerides;
    for set in sets.iter().step_by(20) {
        for half_s in [-302_400_i64, 302_400] {
            let edge = Epoch::new(set.toe.seconds() + half_s, 0.0);
            let (a, b) = (set.state(edge.plus_s(-5e-7)).unwrap(), set.state(edge.plus_s(5e-7)).unwrap());
            // What the satellite flies in the microsecond between is taken out.
            let step_m = (b.position_m - a.position_m - a.velocity_mps * 1e-6).norm();
            worst_m.take(step_m, || format!("{}, toe {} s of the week, {half_s} s", set.sv, set.toe.tow_s()));
        }
        // Reference times around the week's end, as sent in the frame before it and after it.
        for toe_s in [WEEK_S - 7200, WEEK_S - 16, WEEK_S, WEEK_S + 7200] {
            for sent_s in [WEEK_S - 30, WEEK_S] {
                let base = 1590 * WEEK_S;
                let delta_s = base + toe_s - set.toe.seconds();
                let own = lnav::LNAV.fields.quantised(&moved(set, delta_s)).unwrap();
                wrong += usize::from(decoded(&own, base + sent_s, base + sent_s).is_none_or(|found| {
                    let at = Epoch::new(base + sent_s, 0.25);
                    let apart = found.state(at).unwrap().position_m - own.state(at).unwrap().position_m;
                    found.toe != own.toe || found.toc != own.toc || apart.norm() > 1e-6
                }));
            }
        }
    }
    the.at_most("step of the orbit at the edge", worst_m, 1e-6, "m");
    the.none("sets sent over the week's end and decoded otherwise", wrong);
}

/// A set as decoded from the frame that begins at `sent_s`, the week resolved near `near_s`.
fn decoded(set: &Ephemeris, sent_s: i64, near_s: i64) -> Option<Ephemeris> {
    let broadcast = Broadcast::new(None, 15, &[], Epoch::new(sent_s, 0.0)).unwrap();
    let part = |k: i64| {
        let words = broadcast.subframe(set, Epoch::new(sent_s + 6 * k, 0.0)).unwrap();
        Subframe::decode(&words, 0).unwrap()
    };
    lnav::ephemeris(set.sv, &part(0), &part(1), &part(2), Epoch::new(near_s, 0.0)).ok()
}

#[test]
fn the_ten_bits_of_the_week_are_resolved_for_ten_years_around() {
    let the = case(3, "10-bit week rollover", CA);
    let set = &rinex::embedded().unwrap().ephemerides[0];
    let (mut held, mut of) = (0, 0);
    for week in [0_i64, 1, 1022, 1023, 1024, 1025, 1590, 2047, 2048, 3071, 3072] {
        for away in [-511_i64, -1, 0, 1, 511] {
            // GPS time begins with week 0.
            if week + away < 0 || week == 0 {
                continue;
            }
            let sent_s = week * WEEK_S + 302_400;
            let own = lnav::LNAV.fields.quantised(&moved(set, sent_s + 7200 - set.toe.seconds())).unwrap();
            let found = decoded(&own, sent_s, (week + away) * WEEK_S).unwrap();
            of += 1;
            held += usize::from(found.toe == own.toe && found.transmitted == Epoch::new(sent_s, 0.0));
        }
    }
    the.all("weeks decoded as sent, reference up to 511 weeks off", held, of);
}

#[test]
fn a_leap_second_moves_the_label_and_nothing_else() {
    let the = case(4, "leap second", CA);
    // IERS Bulletin C 52: 2016-12-31T23:59:60Z was inserted; GPS time was 17 s ahead before and 18 s after.
    let after = Epoch::parse("2017-01-01T00:00:00Z").unwrap();
    assert_eq!(after, Epoch::parse("2017-01-01T00:00:18").unwrap());
    let leap = Epoch::new(after.seconds() - 1, 0.0);
    assert_eq!((leap.plus_s(-1.0).leap_seconds(), after.leap_seconds()), (17, 18));
    let labels = [(-2, "23:59:59"), (-1, "23:59:60"), (0, "00:00:00"), (1, "00:00:01")];
    let right = labels.iter().filter(|(s, text)| after.plus_s(f64::from(*s)).to_utc_text().contains(text));
    the.all("UTC labels around it", right.count(), 4);
    let tables = "[front_end]\nsample_rate_hz = 2.6e6\nformat = \"ci8\"\n[power]\ncn0_dbhz = 45\n";
    let eight = Epoch::parse("2010-07-01T08:00:00").unwrap();
    let delta_s = (leap.seconds() - eight.seconds()).div_euclid(7200) * 7200;
    let at_s = (leap.seconds() - delta_s - eight.seconds()) as f64;
    let text = run::text(8000.0, &format!("{}{tables}", run::PLACE)).replace("08:05:58", "08:00:00");
    let here = run::try_scene(&text).unwrap();
    let there = shifted(run::try_scene(&text).unwrap(), delta_s);
    assert_eq!(there.clock.start.plus_s(at_s), leap);
    let (worst_m, checked) = worst_difference_m(&here, &there, at_s);
    assert!(checked > 800, "{checked}");
    the.at_most("pseudorange through it against the same sky in 2010", worst_m, 1e-6, "m");
}

#[test]
fn a_part_of_a_scene_has_the_bits_that_the_whole_has_there() {
    let the = case(6, "start at any sample", CA);
    // Everything that looks back or drifts: filter, gain control, noisy oscillator, fading, jammer, spoofer.
    let tables = "[front_end]\nsample_rate_hz = 2.6e6\nformat = \"ci8\"\n[noise]\n[power]\ncn0_dbhz = 45\n[filter]\n\
        kind = \"butterworth\"\norder = 4\nbandwidth_hz = 2e6\n[adc]\nbits = 4\nagc_window_s = 0.01\n[receiver_clock]\n\
        bias_s = 1e-3\noscillator = \"tcxo\"\n[scintillation]\ns4 = 0.6\nsigma_phi_rad = 0.4\ndecorrelation_s = 0.5\n\
        [[interference]]\nkind = \"chirp\"\nsweep_hz = 1e6\nsweep_s = 1e-4\njs_db = 20\n[[interference]]\nkind \
        = \"pulse\"\n\
        width_s = 1e-4\nrate_hz = 300\njitter = 0.5\njs_db = 20\n[[spoofer]]\non_s = 0.2\npower_db = 3\n[truth]\n\
        interval_s = 0.02\n";
    let scene = run::scene(1.0, tables);
    let whole_truth = tempfile::tempdir().unwrap();
    let whole = run::part(&scene, 0..scene.samples, whole_truth.path());
    let all: Vec<csv::StringRecord> = run_records(whole_truth.path(), "observations.csv");
    // Gain control measures the scene's first run whole, also where a part ends within it.
    let parts = [
        0..1,
        100..200,
        0..4096,
        1..4097,
        4095..4098,
        777_777..1_000_003,
        4096 * 150..4096 * 200,
        2_599_999..2_600_000,
    ];
    let mut held = 0;
    for part in parts.clone() {
        let directory = tempfile::tempdir().unwrap();
        let bytes = run::part(&scene, part.clone(), directory.path());
        let same = bytes == whole[2 * part.start as usize..2 * part.end as usize];
        // The truth's rows of that part, counted from its beginning.
        let expected: Vec<Vec<String>> = (all.iter())
            .filter(|row| part.contains(&row[0].parse::<u64>().unwrap()))
            .map(|row| {
                let first = (row[0].parse::<u64>().unwrap() - part.start).to_string();
                std::iter::once(first).chain(row.iter().skip(1).map(str::to_owned)).collect()
            })
            .collect();
        let found: Vec<Vec<String>> = run_records(directory.path(), "observations.csv")
            .iter()
            .map(|row| row.iter().map(str::to_owned).collect())
            .collect();
        assert_eq!(found, expected, "{part:?}");
        held += usize::from(same);
    }
    the.all("parts equal to the whole, bit for bit, and their truth", held, parts.len());
    // Six hours in: a part, and one that begins 20 000 samples before it. A fading's phase is followed from
    // the scene's start, 50 s of arithmetic: the long run has it.
    let mut tables = tables.replace("2.6e6", "50e6").replace("2e6", "20e6");
    if !figures::long() {
        tables = tables.replace("[scintillation]\ns4 = 0.6\nsigma_phi_rad = 0.4\ndecorrelation_s = 0.5\n", "");
    }
    let late = run::scene(25_200.0, &tables);
    let first = 1_u64 << 40;
    let near = run::part(&late, first - 20_001..first + 10_000, whole_truth.path());
    let sought = run::part(&late, first..first + 10_000, whole_truth.path());
    the.all(
        "samples at 2^40 (6 h at 50 Msps), from there and from before",
        equal(&near[2 * 20_001..], &sought),
        20_000,
    );
}

fn equal(a: &[u8], b: &[u8]) -> usize {
    a.iter().zip(b).filter(|(a, b)| a == b).count()
}

fn run_records(directory: &std::path::Path, name: &str) -> Vec<csv::StringRecord> {
    csv::Reader::from_path(directory.join(name)).unwrap().records().map(Result::unwrap).collect()
}

#[test]
fn a_start_a_nanosecond_later_is_a_nanosecond_later() {
    let the = case(7, "fractional start", CA);
    let tables = "[front_end]\nsample_rate_hz = 2.6e6\nformat = \"cf32\"\n[power]\ncn0_dbhz = 45\n";
    let text = run::text(1.0, &format!("{}{tables}", run::PLACE));
    let whole = run::try_scene(&text).unwrap();
    let late = run::try_scene(&text.replace("08:05:58", "08:05:58.000000001")).unwrap();
    let (mut worst_chip, mut worst_m) = (Worst::default(), Worst::default());
    for sv in run::in_view(&whole) {
        let phases = |scene: &Scene| {
            let mut transmitter = Transmitter::new(scene, sv, &L1_CA, Edge::Nearest).unwrap().unwrap();
            transmitter.prepare(scene, 0, 4096).unwrap();
            transmitter.phases(scene, 0).unwrap().1
        };
        let delay_s =
            |scene: &Scene, at: Epoch| truth::seen(scene, sv, &L1_CA, at).unwrap().unwrap().arrivals[0].delay_s;
        let (a, b) = (phases(&whole), phases(&late));
        let gained = b.phase() as i64 - a.phase() as i64 + ((b.period - a.period) * 1023 * (1 << 48));
        // A nanosecond is 1.023e-3 chip, and the range moves by 1e-6 m, 3e-9 chip.
        worst_chip.take((gained as f64 / 281_474_976_710_656.0 - 1.023e-3).abs(), || sv.to_string());
        let same = delay_s(&late, late.clock.start) - delay_s(&whole, whole.clock.start.plus_s(1e-9));
        worst_m.take(same.abs() * SPEED_OF_LIGHT_MPS, || sv.to_string());
    }
    // The code's place resolves 1e-10 chip, the range's change is left in.
    the.at_most("code phase against 1.023e-3 chip", worst_chip, 5e-9, "chip");
    the.at_most("pseudorange against that of the later instant", worst_m, 1e-7, "m");
}
