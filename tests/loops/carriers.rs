//! Two carriers of GPS satellites through two front ends of one clock: one reception, one position, and no
//! ionosphere in it.
//!
//! The second carrier is a synthetic signal at the frequency of L2 with the codes and the message of L1 C/A.
#![cfg(all(feature = "generator", feature = "receiver", feature = "analysis"))]

use std::collections::BTreeMap;
use std::path::Path;

use generator::scenario::{Overrides, Scenario};
use generator::scene::Scene;
use generator::stream::{Fronts, Options};
use generator::truth;
use gnss::earth::Geodetic;
use gnss::gps::l1ca::L1_CA;
use gnss::record::{Event, Fix, IonosphereModel, Observation, TrajectoryRow};
use gnss::samples::IfMetadata;
use gnss::satellite::Sv;
use gnss::signal::{Carrier, Signal, register};
use nalgebra::Vector3;
use receiver::output::Record;
use receiver::position::{CodeNoise, Sets, Solver};
use receiver::settings::Settings;
use receiver::track::CodeDiscriminator;
use receiver::track::loops::CodeShape;
use receiver::{Outcome, Receiver};

/// The codes and the message of L1 C/A on another carrier.
static ON_L2: Signal = Signal { name: "synthetic L2 C/A", rinex: "2C", carrier: Carrier::Common(1_227.60e6), ..L1_CA };

/// Two bands whose rates have no tick of 20 ms in common but whole seconds.
fn scenes(duration_s: u32) -> Vec<Scene> {
    register(&ON_L2).unwrap();
    let text = format!(
        "name = \"carriers\"\nstart = 2010-07-01T08:05:58\nduration_s = {duration_s}\nseed = 7\n\
         signals = [\"GPS L1 C/A\", \"synthetic L2 C/A\"]\n\
         [motion]\nkind = \"static\"\nlatitude_deg = 26.5123\nlongitude_deg = 80.2329\nheight_m = 130\n\
         [power]\ncn0_dbhz = 47\n[noise]\n[ionosphere]\nmodel = \"klobuchar\"\n\
         [receiver_clock]\nbias_s = 1.3e-4\ndrift_sps = 5e-8\n\
         [[front_end]]\nname = \"l1\"\ncenter_hz = 1575.42e6\nsample_rate_hz = 2.6e6\n\
         [[front_end]]\nname = \"l2\"\ncenter_hz = 1227.5e6\nsample_rate_hz = 2_300_030\n"
    );
    let scenario = Scenario::parse(&text, "carriers").unwrap();
    scenario.compose_all(Path::new("."), &Overrides::default()).unwrap().0
}

/// The samples of each front end, and the truth in a directory.
fn samples(scenes: &[Scene], directory: &Path) -> Vec<Vec<u8>> {
    let mut writer = truth::Writer::create(directory).unwrap();
    let mut fronts = Fronts::new(scenes, &mut writer, &Options::default()).unwrap();
    let (mut packed, mut all) = (Vec::new(), vec![Vec::new(); scenes.len()]);
    let mut sink = |number: usize, bytes: &[u8]| {
        all[number].extend_from_slice(bytes);
        Ok(())
    };
    while fronts.next(&mut writer, &mut packed, &mut sink).unwrap() {}
    fronts.finish(&mut writer).unwrap();
    all
}

fn settings(ionosphere: &str) -> Settings {
    let text = format!(
        "[acquisition]\nsignals = [\"GPS L1 C/A\", \"synthetic L2 C/A\"]\n\
         [position]\nionosphere = \"{ionosphere}\"\ntroposphere = \"none\"\n"
    );
    Settings::from_table(text.parse().unwrap(), "carriers").unwrap()
}

/// Receives both, in turn pieces of so many bytes of the first and of the second.
fn received(
    metadata: &[IfMetadata],
    bytes: &[Vec<u8>],
    pieces: [usize; 2],
    settings: &Settings,
) -> (Vec<Record>, Outcome) {
    let mut receiver = Receiver::of_several(metadata, settings).unwrap();
    let mut records = Vec::new();
    let mut left = [&bytes[0][..], &bytes[1][..]];
    while left.iter().any(|left| !left.is_empty()) {
        for (number, left) in left.iter_mut().enumerate() {
            let (head, rest) = left.split_at(pieces[number].min(left.len()));
            records.extend(receiver.push_of(number, head).unwrap());
            *left = rest;
        }
    }
    let (last, outcome) = receiver.finish().unwrap();
    records.extend(last);
    (records, outcome)
}

fn rows<T: serde::de::DeserializeOwned>(directory: &Path, name: &str) -> Vec<T> {
    csv::Reader::from_path(directory.join(name)).unwrap().deserialize().map(Result::unwrap).collect()
}

fn fixes(records: &[Record]) -> Vec<&Fix> {
    records.iter().filter_map(|record| if let Record::Fix(fix) = record { Some(fix) } else { None }).collect()
}

fn metadata(scenes: &[Scene]) -> Vec<IfMetadata> {
    scenes.iter().map(|scene| scene.metadata.clone()).collect()
}

#[test]
fn two_bands_are_received_as_one_and_their_position_has_no_ionosphere() {
    let scenes = scenes(44);
    let metadata = metadata(&scenes);
    let directory = tempfile::tempdir().unwrap();
    let bytes = samples(&scenes, directory.path());
    let path: Vec<TrajectoryRow> = rows(directory.path(), "trajectory.csv");
    let true_rows: Vec<Observation> = rows(directory.path(), "observations.csv");
    let here_m = path[0].position_m();

    let (records, outcome) = received(&metadata, &bytes, [1 << 20, 1 << 20], &settings("combined"));
    println!("{outcome}");
    assert!(outcome.warnings.is_empty(), "{:?}", outcome.warnings);
    for record in &records {
        if let Record::Event(row) = record {
            assert!(!matches!(row.event, Event::CycleSlip | Event::LossOfLock), "{row:?}");
        }
    }

    // Both signals of every satellite, at samples of the first front end, where the truth has them too.
    let mut seen: BTreeMap<(u64, Sv), Vec<&Observation>> = BTreeMap::new();
    for record in &records {
        if let Record::Observation(row) = record {
            seen.entry((row.sample, row.sv)).or_default().push(row);
        }
    }
    let both = seen.values().filter(|rows| rows.len() == 2).count();
    assert!(both > 1000 && 10 * both > 9 * seen.len(), "{both} of {}", seen.len());
    let mut compared = 0;
    for row in seen.values().flatten() {
        let own = |other: &&Observation| other.sample == row.sample && other.link() == row.link();
        let Some(true_row) = true_rows.iter().find(own) else { continue };
        compared += 1;
        // Code noise of 0.5 m at 47 dB-Hz without smoothing; a sample's time is 130 m, of which half would
        // show.
        let miss_m = row.pseudorange_m - true_row.pseudorange_m;
        assert!(miss_m.abs() < 4.0, "{row:?}: {miss_m} m");
        assert!((row.doppler_hz - true_row.doppler_hz).abs() < 5.0, "{row:?}");
    }
    assert!(compared > 100, "{compared}");

    // Each fix against the truth, by its own covariance.
    let to_enu = Geodetic::from_ecef(&here_m).ecef_to_enu();
    let error_m = |fix: &Fix| -> Vector3<f64> { to_enu * (fix.position_m() - here_m) };
    let found = fixes(&records);
    assert!(found.len() > 80, "{} fixes", found.len());
    for fix in &found {
        assert_eq!(fix.ionosphere, IonosphereModel::Combined);
        let sigma_m = Vector3::new(fix.sigma_east_m, fix.sigma_north_m, fix.sigma_up_m);
        // Five deviations of 100 fixes, few of them independent.
        assert!(error_m(fix).component_div(&sigma_m).amax() < 5.0, "{:?} of {sigma_m:?}", error_m(fix));
    }
    let last = found.last().unwrap();

    // One carrier without a model has all of the ionosphere.
    let mut one = settings("none");
    one.acquisition.signals = vec![L1_CA.name.to_owned()];
    // Slant delays fit no position exactly.
    one.position.false_alarm = 1e-12;
    let mut receiver = Receiver::new(&metadata[0], &one).unwrap();
    let mut uncorrected = receiver.push(&bytes[0]).unwrap();
    uncorrected.extend(receiver.finish().unwrap().0);
    let alone = error_m(fixes(&uncorrected).last().unwrap()).norm();
    println!("combined {:.2} m, uncorrected {alone:.2} m", error_m(last).norm());
    assert!(alone > 3.0 && alone > 2.0 * error_m(last).norm(), "{alone} m");
}

#[test]
fn records_depend_neither_on_pieces_nor_on_threads() {
    let scenes = scenes(9);
    let directory = tempfile::tempdir().unwrap();
    let bytes = samples(&scenes, directory.path());
    let text = |pieces: [usize; 2], threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let (records, outcome) = pool.install(|| received(&metadata(&scenes), &bytes, pieces, &settings("combined")));
        assert!(outcome.acquired.len() >= 6 && outcome.losses == 0, "{outcome}");
        format!("{records:?}")
    };
    let one = text([1 << 20, 1 << 20], 1);
    assert!(one == text([77_777, 3_000_001], 2));
    assert!(one == text([usize::MAX, usize::MAX], 2));
}

/// Normal numbers by sums of twelve uniforms from a seeded generator.
fn normal(state: &mut u64) -> f64 {
    let mut uniform = || {
        *state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (*state >> 11) as f64 / (1_u64 << 53) as f64
    };
    (0..12).map(|_| uniform()).sum::<f64>() - 6.0
}

#[test]
fn fixes_from_two_carriers_have_the_covariance_that_they_state() {
    let scenes = scenes(1);
    let directory = tempfile::tempdir().unwrap();
    let _ = samples(&scenes, directory.path());
    let path: Vec<TrajectoryRow> = rows(directory.path(), "trajectory.csv");
    let first: Vec<Observation> = rows::<Observation>(directory.path(), "observations.csv")
        .into_iter()
        .filter(|row| row.sample == path[0].sample)
        .collect();
    let scene = &scenes[0];
    let sets: Sets =
        (first.iter()).filter_map(|row| scene.catalogue.sent_at(row.sv, scene.clock.start).cloned()).collect();
    let noise = CodeNoise {
        chip_m: 293.05,
        share: 1.0,
        shape: CodeShape::triangle(0.5),
        discriminator: CodeDiscriminator::EarlyMinusLate,
        bandwidth_hz: 0.5,
        integration_s: 0.004,
    };
    let mut settings = settings("combined").position;
    settings.smoothing_s = 0.0;
    let (mut state, mut squares, trials) = (5, 0.0, 400);
    let mut bias_m = Vector3::zeros();
    for _ in 0..trials {
        let rows: Vec<Observation> = (first.iter())
            .map(|row| {
                let sigma_m = noise.sigma_m(libm::pow(10.0, row.cn0_dbhz / 10.0));
                Observation { pseudorange_m: row.pseudorange_m + sigma_m * normal(&mut state), ..row.clone() }
            })
            .collect();
        let mut solver = Solver::new(&settings, vec![(&L1_CA, noise), (&ON_L2, noise)], scene.clock.rate);
        let solved = solver.solve(path[0].sample, scene.clock, &rows, &sets, None).unwrap();
        assert_eq!(solved.fix.ionosphere, IonosphereModel::Combined);
        let here_m = path[0].position_m();
        let error_m = Geodetic::from_ecef(&here_m).ecef_to_enu() * (solved.fix.position_m() - here_m);
        let fix = solved.fix;
        let sigma_m = Vector3::new(fix.sigma_east_m, fix.sigma_north_m, fix.sigma_up_m);
        squares += error_m.component_div(&sigma_m).norm_squared() / f64::from(trials);
        bias_m += error_m / f64::from(trials);
    }
    println!("mean of squares {squares:.2}, mean error {bias_m:?} m");
    // Each of three components has mean 1 and variance 2; correlations at most triple the variance of the
    // sum: √(18/400) = 0.21, four of them.
    assert!((squares - 3.0).abs() < 0.85, "{squares}");
}
