//! Ionosphere, troposphere and obstruction: laws, and what a receiver makes of them.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::Command;

use generator::scenario::{Overrides, Scenario};
use generator::scene::Scene;
use generator::stream::{Generated, Options, generate_with};
use generator::synth::isa::Level;
use generator::truth;
use gnss::earth::{Geodetic, Look, SPEED_OF_LIGHT_MPS};
use gnss::record::{Event, EventRow, Fix, Observation, SkyRow, TrajectoryRow};
use gnss::rinex;
use gnss::time::Epoch;
use serde::de::DeserializeOwned;

const BASE: &str = "name = \"laws\"\nstart = 2010-07-01T08:05:58\nduration_s = 0.3\n[motion]\nkind = \"static\"\n\
    latitude_deg = 26.5123\nlongitude_deg = 80.2329\nheight_m = 130\n[front_end]\nsample_rate_hz = 2.6e6\nformat \
    = \"ci8\"\n";
const IONEX: &str = "[ionosphere]\nmodel = \"ionex\"\nfile = \"igrg3380.10i.gz\"\nmap_start = 2010-12-04T08:05:58\n";
const WALLS: &str = "[[obstruction]]\nkind = \"sector\"\nfrom_deg = 300\nto_deg = 60\nroof_deg = 50\n\
    [[obstruction]]\nkind = \"building\"\neast_m = [-30, -10]\nnorth_m = [-20, 20]\ntop_m = 15\nloss_db = 10\n";

fn scenes() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("scenarios")
}

fn scene(lines: &str) -> Scene {
    let scenario = Scenario::parse(&format!("{BASE}{lines}"), "laws").unwrap();
    scenario.compose(&scenes(), &Overrides::default()).unwrap().0
}

fn bytes(scene: &Scene, options: &Options) -> (Vec<u8>, Generated) {
    let directory = tempfile::tempdir().unwrap();
    let mut writer = truth::Writer::create(directory.path()).unwrap();
    let mut bytes = Vec::new();
    let done = generate_with(scene, &mut bytes, &mut writer, &mut |_| (), options).unwrap();
    (bytes, done)
}

#[test]
fn what_has_no_strength_leaves_every_bit_as_it_was() {
    let plain = bytes(&scene(""), &Options::default()).0;
    for lines in [
        "[ionosphere]\nmodel = \"constant_tec\"\nvtec_tecu = 0\n",
        "[[obstruction]]\nkind = \"sector\"\nfrom_deg = 0\nto_deg = 180\nroof_deg = 80\nloss_db = 0\n",
        "[[obstruction]]\nkind = \"horizon\"\nazimuth_deg = [0]\nelevation_deg = [70]\nloss_db = 0\n",
        "[[obstruction]]\nkind = \"building\"\neast_m = [5, 9]\nnorth_m = [-50, 50]\ntop_m = 50\nloss_db = 0\n",
    ] {
        assert!(bytes(&scene(lines), &Options::default()).0 == plain, "{lines}");
    }
    // The law can fail: with strength the bits differ.
    assert!(bytes(&scene(WALLS), &Options::default()).0 != plain);
    assert!(bytes(&scene(IONEX), &Options::default()).0 != plain);
}

#[test]
fn bytes_depend_neither_on_threads_nor_on_the_cut() {
    let scene = scene(&format!("{IONEX}[troposphere]\nmodel = \"saastamoinen\"\nmapping = \"cosecant\"\n{WALLS}"));
    let mut first: Option<Vec<u8>> = None;
    for (threads, block_runs, batch_blocks) in [(1, 8, 16), (2, 1, 3), (3, 5, 1)] {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let options = Options { block_runs, batch_blocks, level: Level::detect() };
        let found = pool.install(|| bytes(&scene, &options)).0;
        assert!(*first.get_or_insert_with(|| found.clone()) == found, "{threads} {block_runs}");
    }
}

#[test]
fn slopes_that_step_cost_few_knots() {
    // Twenty minutes of sky at a low rate: what the maps' bilinear cells cost against the bicubic surface and
    // against none.
    let knots = |lines: &str| {
        let text = format!("{BASE}{lines}").replace("duration_s = 0.3", "duration_s = 1200").replace("2.6e6", "1.5e6");
        let scenario = Scenario::parse(&text, "knots").unwrap();
        let scene = scenario.compose(&scenes(), &Overrides::default()).unwrap().0;
        let (mut parts, mut roots) = (0, 0);
        let signal = scene.signals[0];
        let grid = generator::knots::Grid::new(
            scene.clock.rate,
            Vec::new(),
            scene.fidelity.knot_tolerance_cycles,
            signal.centre_hz(),
        );
        let until = scene.samples / grid.root_samples();
        for sv in scene.catalogue.satellites() {
            if !truth::in_view(&scene, sv, scene.clock.start).unwrap() {
                continue;
            }
            for root in 0..until {
                let observe = |n: u64| {
                    truth::seen(&scene, sv, signal, scene.clock.epoch(n)).map(|seen| seen.map(|seen| seen.arrivals))
                };
                parts += grid.root(root, &observe).unwrap().len();
                roots += 1;
            }
        }
        (parts, roots)
    };
    let (none, roots) = knots("");
    let bilinear = knots(IONEX).0;
    let bicubic = knots(&format!("{IONEX}interpolation = \"bicubic\"\n")).0;
    println!("{roots} roots: {none} parts without, {bilinear} bilinear, {bicubic} bicubic");
    // A kink of the slope halves one root down to the length at which it no longer shows, once in some
    // minutes.
    assert!(none <= bicubic && bicubic <= bilinear && bilinear < 2 * none, "{none} {bicubic} {bilinear}");
}

fn rows<T: DeserializeOwned>(path: &Path) -> Vec<T> {
    csv::Reader::from_path(path).unwrap().deserialize().map(Result::unwrap).collect()
}

/// Runs a shipped scene, and gives the directory of its run.
fn run(name: &str) -> (tempfile::TempDir, PathBuf) {
    let out = tempfile::tempdir().unwrap();
    let target = out.path().join("run");
    let scenario = scenes().join(format!("{name}.toml"));
    let run = Command::new(env!("CARGO_BIN_EXE_gnss-twin"))
        .args(["run".as_ref(), scenario.as_os_str(), "--out".as_ref(), target.as_os_str()])
        .output()
        .unwrap();
    let text = String::from_utf8_lossy(&run.stdout).into_owned() + &String::from_utf8_lossy(&run.stderr);
    assert!(run.status.success(), "{text}");
    println!("{text}");
    (out, target)
}

#[test]
fn a_receiver_that_corrects_by_the_broadcast_is_left_with_what_nature_adds_to_it() {
    let (_out, run) = run("ionex");
    let sky: Vec<SkyRow> = rows(&run.join("truth/sky.csv"));
    let trajectory: Vec<TrajectoryRow> = rows(&run.join("truth/trajectory.csv"));
    let received: Vec<Observation> = rows(&run.join("rx/observations.csv"));
    let fixes: Vec<Fix> = rows(&run.join("rx/fixes.csv"));
    let place = Geodetic::from_degrees(26.5123, 80.2329, 130.0);
    let start = Epoch::parse("2010-07-01T08:05:58").unwrap();
    let broadcast = rinex::embedded().unwrap().klobuchar.unwrap();

    // The ionosphere that the samples hold: pseudorange less geometry, clocks and troposphere, by satellite.
    let clock_m: BTreeMap<u64, f64> =
        trajectory.iter().map(|row| (row.sample, SPEED_OF_LIGHT_MPS * row.clock_bias_s)).collect();
    let truth: BTreeMap<_, _> = sky.iter().map(|row| ((row.sample, row.sv), row)).collect();
    let mut held: BTreeMap<_, Vec<(f64, f64, f64)>> = BTreeMap::new();
    for row in received.iter().filter(|row| row.sample as f64 > 30.0 * 2.6e6) {
        let (Some(sight), Some(clock_m)) = (truth.get(&(row.sample, row.sv)), clock_m.get(&row.sample)) else {
            continue;
        };
        let ionosphere_m = row.pseudorange_m - sight.range_m - clock_m + sight.satellite_clock_m - sight.troposphere_m;
        let look =
            Look { azimuth_rad: sight.azimuth_deg.to_radians(), elevation_rad: sight.elevation_deg.to_radians() };
        let at = start.plus_s(row.sample as f64 / 2.6e6);
        let corrected_m = broadcast.delay_s(place, look, at, 1_575.42e6) * SPEED_OF_LIGHT_MPS;
        held.entry(row.sv).or_default().push((ionosphere_m, sight.ionosphere_m, corrected_m));
    }
    assert!(held.len() >= 10, "{} satellites", held.len());
    let mut largest_m = 0.0_f64;
    for (sv, rows) in &held {
        let mean = |of: fn(&(f64, f64, f64)) -> f64| rows.iter().map(of).sum::<f64>() / rows.len() as f64;
        let (held_m, map_m, corrected_m) = (mean(|r| r.0), mean(|r| r.1), mean(|r| r.2));
        println!("{sv}: in the samples {held_m:.2} m, map {map_m:.2} m, broadcast {corrected_m:.2} m");
        // 0.8 m rms of code at the strongest, 1.6 m at 38 dB-Hz; a loop of 0.5 Hz forgets within 1 s, so 30 s
        // are 30 samples: 0.15 to 0.3 m, of which four.
        let bound_m = if map_m > 6.0 { 1.2 } else { 0.6 };
        assert!((held_m - map_m).abs() < bound_m, "{sv}: {held_m} {map_m}");
        largest_m = largest_m.max((map_m - corrected_m).abs());
    }
    // The two differ by metres, and so does the position: a common part goes into the clock, the rest into
    // height.
    assert!(largest_m > 1.0, "{largest_m}");
    let truth_m = place.to_ecef();
    let up = place.ecef_to_enu();
    let errors: Vec<_> = fixes
        .iter()
        .filter(|fix| fix.sample as f64 > 40.0 * 2.6e6)
        .map(|fix| up * (nalgebra::Vector3::new(fix.x_m, fix.y_m, fix.z_m) - truth_m))
        .collect();
    assert!(!errors.is_empty());
    let mean = errors.iter().sum::<nalgebra::Vector3<f64>>() / errors.len() as f64;
    println!("mean error east {:.2}, north {:.2}, up {:.2} m", mean.x, mean.y, mean.z);
    // The static scene, whose broadcast is the truth, is within 0.1 m. A PDOP of at most 3 bounds the other
    // side.
    assert!((0.3..3.0 * largest_m).contains(&mean.norm()), "{mean}");
}

#[test]
fn what_a_house_hides_is_lost_and_found_again() {
    let (_out, run) = run("canyon");
    let truth: Vec<Observation> = rows(&run.join("truth/observations.csv"));
    let events: Vec<EventRow> = rows(&run.join("rx/events.csv"));
    let second = |sample: u64| sample as f64 / 2.6e6;
    let mut strengths: BTreeMap<_, Vec<(f64, f64)>> = BTreeMap::new();
    for row in &truth {
        strengths.entry(row.sv).or_default().push((second(row.sample), row.cn0_dbhz));
    }
    let (mut hidden, mut back) = (0, 0);
    for (sv, rows) in &strengths {
        // Below 20 dB-Hz nothing is tracked; a loss is declared after 0.2 s, truth comes every 0.1 s.
        let dark: Vec<f64> = rows.iter().filter(|(_, cn0)| *cn0 < 20.0).map(|(t, _)| *t).collect();
        let (Some(first), Some(last)) = (dark.first(), dark.last()) else { continue };
        // It fades before it is dark: the loop may let go from here on.
        let strong = rows.iter().rev().find(|(t, cn0)| t < first && *cn0 > 36.0);
        let Some((fades, _)) = strong else { continue };
        if dark.len() < 10 || (last - first) * 10.0 > dark.len() as f64 + 1.0 {
            continue;
        }
        hidden += 1;
        let of = |event: Event, from: f64, to: f64| {
            events.iter().any(|row| row.sv == *sv && row.event == event && (from..to).contains(&second(row.sample)))
        };
        println!("{sv}: dark from {first:.1} to {last:.1} s");
        assert!(of(Event::LossOfLock, *fades, last + 0.5), "{sv}: {events:?}");
        // A search comes every 2 s.
        let strong = rows.iter().filter(|(t, _)| (last + 1.0..last + 6.0).contains(t)).all(|(_, cn0)| *cn0 > 38.0);
        if strong && last + 6.0 < 75.0 {
            back += 1;
            assert!(of(Event::Acquired, *last, last + 6.0), "{sv} did not come back: {events:?}");
        }
    }
    assert!(hidden >= 2 && back >= 1, "{hidden} hidden, {back} back");
}
