//! The law of replay: a recorded run gives the same bytes and the same truth, however the work is cut.

use std::fs;
use std::path::Path;

use generator::event::Event;
use generator::generate_part;
use generator::scenario::{Overrides, Scenario};
use generator::scene::Scene;
use generator::stream::{Options, Stream, generate_with};
use generator::truth::Record;
use generator::vehicle::joining::{Kind, Push};
use generator::vehicle::turn::PushedTurn;
use generator::vehicle::{Motion, log};
use live::drive::Driver;
use nalgebra::Vector3;

/// All that keeps a copy of the trajectory: wind-up, a turned antenna, obstacles, a jammer at a place, a
/// spoofer that claims the antenna's own motion; and a clock that makes ticks of odd lengths in true time.
const TABLES: &str = r#"
name = "pushed"
start = 2010-07-01T08:06:00
noise = {}
truth = { interval_s = 0.013 }
[front_end]
sample_rate_hz = 2.6e6
[attitude]
kind = "velocity"
lever_arm_m = [0.5, 0.2, -1.0]
[receiver_clock]
bias_s = 2e-4
drift_sps = 3e-7
oscillator = "tcxo"
[[interference]]
kind = "chirp"
js_db = 3
sweep_hz = 1e6
sweep_s = 1e-4
latitude_deg = 48.101
longitude_deg = 11.601
height_m = 530
[[interference]]
kind = "cw"
offset_hz = 2e5
js_db = -2
[[spoofer]]
on_s = 0.05
power_db = -3
"#;

const DURATION_S: f64 = 0.4;
const PUSHED: &str =
    r#"motion = { kind = "pushed", latitude_deg = 48.1, longitude_deg = 11.6, height_m = 520, tick_s = 0.009 }"#;
const ARM: &str = "[0.5, 0.2, -1.0]";

fn scene(directory: &Path, motion: &str) -> Scene {
    let text = format!("duration_s = {DURATION_S}\n{motion}\n{TABLES}");
    let (scene, _) = Scenario::from_toml(&text).unwrap().compose(directory, &Overrides::default()).unwrap();
    scene
}

fn pushed(directory: &Path) -> Scene {
    scene(directory, PUSHED)
}

/// A spiral that begins at 30 m/s with 8 m/s², so that the first ticks have to join it.
fn spiral(start_m: Vector3<f64>, t_s: f64) -> Motion {
    let (radius_m, turns) = (100.0, 0.3);
    let (sin, cos) = libm::sincos(turns * t_s);
    Motion {
        position_m: start_m + Vector3::new(radius_m * (cos - 1.0), radius_m * sin, 3.0 * t_s),
        velocity_mps: Vector3::new(-radius_m * turns * sin, radius_m * turns * cos, 3.0),
        acceleration_mps2: Vector3::new(-cos, -sin, 0.0) * (radius_m * turns * turns),
    }
}

struct Recorded {
    bytes: Vec<u8>,
    truth: Vec<Record>,
    kinds: Vec<Kind>,
}

/// Drives a scene with late, lost and jumping pushes and with events, and writes its record.
fn record(directory: &Path, seed: u64) -> Recorded {
    let scene = pushed(directory);
    let start_m = scene.trajectory.composed_for().position_m;
    let (mut truth, mut packed, mut bytes, mut kinds) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
    let (mut ticks, mut events) = (Vec::new(), b"sample,event\n".to_vec());
    let mut driver = Driver::new(&scene, &mut truth).unwrap();
    let grown = scene.trajectory.grown().unwrap();
    log::begin(&mut ticks, (&grown.last().unwrap().motion, grown.last_turn().as_ref())).unwrap();
    while !driver.is_done() {
        let tick = driver.next_tick();
        let chance = (tick + 1) * 2_654_435_761 % 4_294_967_296 / 65_536 + seed * 977;
        for (at, event) in [
            (6, "power G13 -6.5"),
            (9, "jammer 1 off"),
            (9, "range_error G23 12.0 250.0"),
            (14, "jammer 1 3.0"),
            (17, "spoofer 1 off"),
            (20, "power G13 off"),
            (22, "jammer 2 off"),
        ] {
            if at + seed % 3 == tick {
                let event: Event = event.parse().unwrap();
                let sample = driver.switch(&event).unwrap();
                events.extend_from_slice(format!("{sample},{event}\n").as_bytes());
            }
        }
        let late_s = 0.03 * (chance % 100) as f64 / 100.0;
        let t_s = tick as f64 * 0.009 + 0.02 - late_s;
        if !chance.is_multiple_of(10) && t_s >= 0.0 {
            let mut motion = spiral(start_m, t_s);
            motion.position_m.z += if (25..28).contains(&tick) { 40.0 } else { 0.0 };
            // Out of order where one is later than the next: refused, and nothing changes.
            let _ = driver.offer(&Push::of(t_s, &motion));
        }
        let made = driver.tick(&mut truth, &mut packed).unwrap().unwrap();
        let tick = made.tick.unwrap();
        log::write(&mut ticks, made.samples.1, &tick).unwrap();
        bytes.extend_from_slice(&packed);
        kinds.push(tick.kind);
    }
    driver.finish(&mut truth).unwrap();
    fs::write(directory.join("ticks.csv"), ticks).unwrap();
    fs::write(directory.join("events.csv"), events).unwrap();
    assert_eq!(bytes.len() as u64, scene.samples * 2);
    Recorded { bytes, truth, kinds }
}

fn replay(directory: &Path) -> Scene {
    scene(directory, r#"motion = { kind = "ticks", file = "ticks.csv", events = "events.csv", tick_s = 0.009 }"#)
}

#[test]
fn a_recorded_run_replays_to_the_bit_for_any_cut_of_the_work() {
    let directory = tempfile::tempdir().unwrap();
    let directory = directory.path();
    for seed in 0..3 {
        let recorded = record(directory, seed);
        for kind in [Kind::Fresh, Kind::Extrapolated, Kind::Snap] {
            assert!(recorded.kinds.contains(&kind), "{kind:?} in {:?}", recorded.kinds);
        }
        let scene = replay(directory);
        for (block_runs, batch_blocks, threads) in [(8, 16, 2), (1, 1, 1), (3, 2, 3)] {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            let options = Options { block_runs, batch_blocks, ..Options::default() };
            let (mut bytes, mut truth) = (Vec::new(), Vec::new());
            pool.install(|| generate_with(&scene, &mut bytes, &mut truth, &mut |_| (), &options)).unwrap();
            let differs = bytes.iter().zip(&recorded.bytes).position(|(a, b)| a != b);
            assert_eq!((differs, bytes.len()), (None, recorded.bytes.len()), "{block_runs} {batch_blocks} {threads}");
            assert_eq!(format!("{truth:?}"), format!("{:?}", recorded.truth));
        }
        let mut part = Vec::new();
        let options = Options::default();
        generate_part(&scene, 300_001..700_003, &mut part, &mut (), &mut |_| (), &options).unwrap();
        assert_eq!(part, recorded.bytes[2 * 300_001..2 * 700_003]);
    }
    // Other pushes are another run.
    assert!(record(directory, 0).bytes != record(directory, 1).bytes);
}

#[test]
fn what_is_switched_is_in_the_truth_from_its_sample_on() {
    let directory = tempfile::tempdir().unwrap();
    let recorded = record(directory.path(), 0);
    let tick = |number: u64| number * 23_400;
    let observed = |name: &str| -> Vec<(u64, f64, f64)> {
        let rows = recorded.truth.iter().filter_map(|record| match record {
            Record::Observation(row) if row.sv.to_string() == name => Some(row),
            _ => None,
        });
        rows.map(|row| (row.sample, row.cn0_dbhz, row.doppler_hz)).collect()
    };
    let weak = observed("G13");
    let (first, last) = (weak.first().unwrap(), weak.last().unwrap());
    assert!(weak.iter().all(|(sample, cn0_dbhz, _)| (cn0_dbhz < &(first.1 - 6.0)) == (*sample >= tick(6))), "{weak:?}");
    // Rows are 33 800 samples apart.
    assert!(last.0 < tick(20) && last.0 + 33_800 >= tick(20), "{last:?}");
    // 250 m/s longer ranges are 1314 Hz less.
    let astray = observed("G23");
    let step = |from: u64, to: u64| {
        let of = |from: u64, to: u64| astray.iter().find(|row| (from..to).contains(&row.0)).unwrap().2;
        of(to, to + tick(2)) - of(from, from + tick(2))
    };
    assert!((step(tick(6), tick(9)) + 1313.8).abs() < 30.0, "{}", step(tick(6), tick(9)));
    let jammed = |source: usize, from: u64, to: u64| {
        recorded.truth.iter().any(|record| {
            matches!(record, Record::Interference(row) if row.source == source && (from..to).contains(&row.sample))
        })
    };
    assert!(jammed(1, 0, tick(9)) && !jammed(1, tick(9), tick(14)) && jammed(1, tick(14), u64::MAX));
    assert!(jammed(2, tick(14), tick(22)) && !jammed(2, tick(22), u64::MAX));
    let spoofed = |from: u64, to: u64| {
        recorded
            .truth
            .iter()
            .any(|record| matches!(record, Record::Claim { place, .. } if (from..to).contains(&place.sample)))
    };
    assert!(spoofed(tick(6), tick(17)) && !spoofed(tick(17), u64::MAX));
}

#[test]
fn the_truth_of_pushed_motion_is_what_was_sent_and_its_doppler_the_carrier_s_slope() {
    let directory = tempfile::tempdir().unwrap();
    let recorded = record(directory.path(), 2);
    let rows = recorded.truth.iter().filter_map(|record| match record {
        Record::Observation(row) if row.sv.to_string() == "G13" => {
            Some((row.sample, row.carrier_cycles, row.doppler_hz))
        }
        _ => None,
    });
    let (mut before, mut compared) = ((0, 0.0, f64::INFINITY), 0);
    for row in rows {
        let elapsed_s = (row.0 - before.0) as f64 / 2.6e6;
        let mean_hz = -(row.1 - before.1) / elapsed_s;
        // A trapezium over 13 ms: the mean of both ends is off by a twelfth of the jerk times time squared,
        // for 2e4 m/s³ 3 m/s or 15 Hz; a snap is left out.
        if (row.2 - before.2).abs() < 100.0 {
            assert!((mean_hz - 0.5 * (row.2 + before.2)).abs() < 15.0, "{row:?} after {before:?}: {mean_hz}");
            compared += 1;
        }
        before = row;
    }
    assert!(compared > 8, "{compared}");
}

#[test]
fn samples_beyond_the_pushed_motion_are_refused() {
    let directory = tempfile::tempdir().unwrap();
    let scene = pushed(directory.path());
    let refused = Stream::new(&scene, &mut (), &Options::default()).unwrap().next(&mut (), &mut Vec::new());
    let message = refused.unwrap_err().to_string();
    assert!(message.contains("known up to sample 0") && message.contains("gnss-twin live"), "{message}");
}

#[test]
fn a_record_that_does_not_fit_its_scene_is_refused_with_what_would_fit() {
    let directory = tempfile::tempdir().unwrap();
    record(directory.path(), 0);
    let refused = |motion: &str, duration_s: f64| {
        let text = format!("duration_s = {duration_s}\nmotion = {motion}\n{TABLES}");
        let composed = Scenario::from_toml(&text).unwrap().compose(directory.path(), &Overrides::default());
        composed.err().map(|error| error.to_string()).unwrap_or_default()
    };
    let ticks = r#"{ kind = "ticks", file = "ticks.csv", tick_s = 0.009 }"#;
    assert!(refused(ticks, 0.5).contains("expected duration_s = 0.405"), "{}", refused(ticks, 0.5));
    assert!(refused(&ticks.replace("0.009", "0.01"), 0.4).contains("expected sample 26000"));
    let short = r#"{ kind = "pushed", latitude_deg = 48.1, longitude_deg = 11.6, height_m = 520, tick_s = 0.001 }"#;
    assert!(refused(short, 0.4).contains("0.001575"), "{}", refused(short, 0.4));
    let events = ticks.replace("file", "events = \"events.csv\", file");
    fs::write(directory.path().join("events.csv"), "sample,event\n5,jammer 1 off\n").unwrap();
    assert!(refused(&events, 0.4).contains("multiple of 23400"), "{}", refused(&events, 0.4));
    fs::write(directory.path().join("events.csv"), "sample,event\n23400,jammer 7 off\n").unwrap();
    assert!(refused(&events, 0.4).contains("no such source"), "{}", refused(&events, 0.4));
}

/// A roll of three turns a second, about a nose that yaws and swings through the vertical.
fn rolling(t_s: f64) -> PushedTurn {
    let pitch_rad = 1.5 + 0.4 * libm::sin(5.0 * t_s);
    let angles_rad = [2.0 * t_s, pitch_rad, 0.2 + 6.0 * std::f64::consts::PI * t_s];
    PushedTurn { angles_rad, rates_radps: Some([2.0, 2.0 * libm::cos(5.0 * t_s), 6.0 * std::f64::consts::PI]) }
}

#[test]
fn a_pushed_attitude_turns_the_antenna_without_a_slip_and_replays_to_the_bit() {
    let directory = tempfile::tempdir().unwrap();
    let directory = directory.path();
    let scene = |motion: &str, arm: &str| {
        let tables = TABLES.replace("kind = \"velocity\"", "kind = \"pushed\"\nroll_deg = 11");
        let tables = tables.replace("[0.5, 0.2, -1.0]", arm);
        let text = format!("duration_s = {DURATION_S}\n{motion}\n{tables}");
        Scenario::from_toml(&text).unwrap().compose(directory, &Overrides::default()).unwrap().0
    };
    let pushed = scene(PUSHED, ARM);
    let drive = |scene: &Scene, turned: bool, log: &mut Vec<u8>| {
        let (mut truth, mut packed, mut bytes, mut turns) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
        let start_m = scene.trajectory.body(0.0).position_m;
        let grown = scene.trajectory.grown().unwrap();
        log::begin(log, (&grown.last().unwrap().motion, grown.last_turn().as_ref())).unwrap();
        let mut driver = Driver::new(scene, &mut truth).unwrap();
        while !driver.is_done() {
            let t_s = driver.next_tick() as f64 * 0.009 + 0.05;
            let turn = turned.then(|| rolling(t_s));
            driver.offer(&Push { turn, ..Push::of(t_s, &spiral(start_m, t_s)) }).unwrap();
            let made = driver.tick(&mut truth, &mut packed).unwrap().unwrap();
            let tick = made.tick.unwrap();
            log::write(log, made.samples.1, &tick).unwrap();
            turns.push((scene.elapsed_s(made.samples.1), tick));
            bytes.extend_from_slice(&packed);
        }
        driver.finish(&mut truth).unwrap();
        (bytes, truth, turns)
    };
    let mut log = Vec::new();
    let (bytes, truth, turns) = drive(&pushed, true, &mut log);
    fs::write(directory.join("ticks.csv"), log).unwrap();
    // Once joined, within 0.1 s, it is turned as was pushed, and so is the lever arm.
    for (t_s, tick) in turns.iter().skip(30) {
        let (turn, due) = (tick.turn.unwrap(), rolling(*t_s).turn());
        assert!(turn.to(&due).norm() < 0.05, "{t_s}: {}", turn.to(&due));
        let arm_m = pushed.trajectory.at(*t_s).position_m - tick.end.position_m;
        let axes = pushed.trajectory.orientation(*t_s).unwrap().axes();
        assert!((arm_m - axes * Vector3::new(0.5, 0.2, -1.0)).norm() < 1e-8, "{t_s}");
    }
    let again = scene(r#"motion = { kind = "ticks", file = "ticks.csv", tick_s = 0.009 }"#, ARM);
    for (block_runs, batch_blocks, threads) in [(8, 16, 2), (1, 1, 1)] {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let options = Options { block_runs, batch_blocks, ..Options::default() };
        let (mut replayed, mut replayed_truth) = (Vec::new(), Vec::new());
        pool.install(|| generate_with(&again, &mut replayed, &mut replayed_truth, &mut |_| (), &options)).unwrap();
        assert!(replayed == bytes, "{block_runs} {threads}");
        assert_eq!(format!("{replayed_truth:?}"), format!("{truth:?}"));
    }
    // Wind-up alone: more than a turn of the antenna, and never a whole cycle at once.
    let [rolled, level] = [true, false].map(|turned| drive(&scene(PUSHED, "[0, 0, 0]"), turned, &mut Vec::new()).1);
    let observed = |truth: &[Record], name: &str| -> Vec<(f64, f64)> {
        let rows = truth.iter().filter_map(|record| match record {
            Record::Observation(row) if row.sv.to_string() == name => Some((row.carrier_cycles, row.cn0_dbhz)),
            _ => None,
        });
        rows.collect()
    };
    let (mut largest, mut weakest) = (0.0_f64, 0.0_f64);
    for name in ["G13", "G23"] {
        let (rolled, level) = (observed(&rolled, name), observed(&level, name));
        let apart: Vec<f64> = rolled.iter().zip(&level).map(|(a, b)| a.0 - b.0).collect();
        for (k, pair) in apart.windows(2).enumerate().skip(9) {
            // Three turns and a third a second are 0.05 cycles in 13 ms; ten times that nearly deaf.
            assert!((pair[1] - pair[0]).abs() < 0.5, "{name} {k}: {pair:?}");
        }
        largest = largest.max(apart.iter().fold(0.0_f64, |most, x| most.max((x - apart[0]).abs())));
        weakest = weakest.max(rolled.iter().zip(&level).fold(0.0_f64, |most, (a, b)| most.max((a.1 - b.1).abs())));
    }
    assert!(largest > 0.9 && weakest > 3.0, "{largest} cycles, {weakest} dB");
}
