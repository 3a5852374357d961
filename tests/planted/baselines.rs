//! Baselines from true observations of two stations, and integers of published float vectors.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use analysis::read::rinex_obs::{ObservedEpoch, Values};
use generator::scenario::{Overrides, Scenario};
use generator::spoof::Constellation;
use generator::truth;
use gnss::rinex;
use gnss::satellite::Sv;
use nalgebra::{DMatrix, DVector};
use rtk::files::Receiver;
use rtk::judge::Figures;
use rtk::lambda::Decorrelated;
use rtk::orbits::Orbits;
use rtk::pairs::{Choice, pairs};
use rtk::run::{Inputs, solve};
use rtk::solver::Settings;
use rtk::truth::Truth;

/// Two stations 3 km apart that observe GPS on two bands.
const PAIR: &str = r#"
name = "pair"
start = 2025-08-21T07:52:20
duration_s = 2
signals = ["GPS L1 C/A", "GPS L2C"]
[navigation]
file = "gps_2025-08-21_06h_08h.rnx"
[satellites]
mask_deg = 10
[troposphere]
model = "saastamoinen"
[[front_end]]
name = "l1"
center_hz = 1575.42e6
sample_rate_hz = 4e6
[[front_end]]
name = "l2"
center_hz = 1227.60e6
sample_rate_hz = 4e6
[[station]]
name = "base"
motion = { kind = "static", latitude_deg = 35.342, longitude_deg = 139.522, height_m = 50 }
receiver_clock = { bias_s = 1.3e-4, drift_sps = 5e-8 }
[[station]]
name = "rover"
motion = { kind = "static", latitude_deg = 35.362, longitude_deg = 139.544, height_m = 62 }
receiver_clock = { bias_s = -2.7e-4, drift_sps = -3e-7 }
"#;
const EPOCHS: u64 = 12;
/// Samples of a tenth of a second.
const STEP: u64 = 400_000;

/// True observations of a station as a receiver gives them, each carrier with whole cycles of its own; the
/// truth itself is written below `run`.
fn observed(name: &str, whole_cycles: f64, run: &Path) -> Receiver {
    let scenarios = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenarios");
    let scenario = Scenario::parse(PAIR, "pair").unwrap().with_station(name).unwrap();
    let (scenes, _) = scenario.compose_all(&scenarios, &Overrides::default()).unwrap();
    let directory = run.join("truth");
    fs::create_dir_all(&directory).unwrap();
    let mut places = csv::Writer::from_path(directory.join("trajectory.csv")).unwrap();
    let mut rows = csv::Writer::from_path(directory.join("observations.csv")).unwrap();
    let mut epochs = Vec::new();
    for epoch in 0..EPOCHS {
        let sample = (epoch + 1) * STEP;
        let authentic = Constellation::authentic();
        let place = truth::trajectory(&scenes[0], &authentic, sample);
        let label = place.time().plus_s(place.clock_bias_s);
        places.serialize(place).unwrap();
        let mut values = BTreeMap::new();
        for scene in &scenes {
            for (sv, signal) in scene.satellites().flat_map(|sv| scene.signals_of(sv).map(move |own| (sv, own))) {
                if !truth::in_view(scene, sv, scene.clock.epoch(sample)).unwrap() {
                    continue;
                }
                let Some((row, ..)) = truth::observe(scene, &authentic, sv, signal, sample, 1.0).unwrap() else {
                    continue;
                };
                let value = Values {
                    pseudorange_m: Some(row.pseudorange_m),
                    carrier_cycles: Some(row.carrier_cycles + whole_cycles * f64::from(sv.number)),
                    lost_lock: epoch == 0,
                    cn0_dbhz: Some(45.0),
                    ..Values::default()
                };
                values.insert((sv, signal.rinex.to_owned()), value);
                rows.serialize(row).unwrap();
            }
        }
        epochs.push(ObservedEpoch { label, values });
    }
    places.flush().unwrap();
    rows.flush().unwrap();
    Receiver { path: run.to_owned(), epochs, channels: BTreeMap::new() }
}

/// Figures of the pair, whose rover's observations `change` has had.
fn figures(change: impl Fn(usize, &mut BTreeMap<(Sv, String), Values>)) -> Figures {
    let place = tempfile::tempdir().unwrap();
    let runs = ["base", "rover"].map(|name| place.path().join(name));
    let (base, mut rover) = (observed("base", 31.0, &runs[0]), observed("rover", -1700.0, &runs[1]));
    rover.epochs.iter_mut().enumerate().for_each(|(number, epoch)| change(number, &mut epoch.values));
    let scenarios = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenarios");
    let file = fs::read(scenarios.join("gps_2025-08-21_06h_08h.rnx")).unwrap();
    let mut orbits = Orbits::default();
    orbits.add(rinex::read(&file, "navigation").unwrap().ephemerides);
    let shared = pairs(&base, &rover, &orbits, &Choice::default()).unwrap();
    let truths = runs.map(|run| Truth::read(&run).unwrap());
    // There is no ionosphere in the scene.
    let settings = Settings { ionosphere: 0.0, ..Settings::default() };
    solve(&shared, [&truths[0], &truths[1]], &Inputs::default(), (settings, None)).unwrap().figures
}

#[test]
fn true_observations_of_two_stations_give_the_true_baseline_and_the_true_integers() {
    let found = figures(|_, _| ());
    assert_eq!((found.epochs, found.fixed), (EPOCHS as usize, EPOCHS as usize), "{found:?}");
    assert!(found.integers_right >= 10 * EPOCHS as usize && found.integers_wrong == 0, "{found:?}");
    // 0.02 degrees of latitude and 0.022 of longitude at 35 degrees: 2.22 km and 2.00 km.
    assert!(found.length_m.is_some_and(|length_m| (length_m - 2986.0).abs() < 15.0), "{found:?}");
    // No noise: what is left is the difference of two models of the air over 3 km, where 5 % of 2.4 m at the
    // zenith change by 5e-4 for the lowest satellites, and the bent Earth's 12 m of height take a millimetre.
    let rms_m = libm::hypot(found.horizontal_rms_m.unwrap(), found.up_rms_m.unwrap());
    assert!(rms_m < 0.005, "{found:?}");
}

#[test]
fn a_broken_count_of_the_rover_is_heeded_where_there_is_a_position_and_where_there_is_none() {
    const AT: usize = 6;
    let moved = |values: &mut BTreeMap<(Sv, String), Values>, number: usize, of: &dyn Fn(Sv) -> f64| {
        for ((sv, _), value) in values.iter_mut().filter(|((sv, _), _)| of(*sv) != 0.0) {
            value.carrier_cycles = value.carrier_cycles.map(|cycles| cycles + of(*sv));
            value.lost_lock |= number == AT;
        }
    };
    // One satellite, in an epoch with a position.
    let one = figures(|number, values| {
        let first = values.keys().next().unwrap().0;
        if number >= AT {
            moved(values, number, &|sv| if sv == first { 1000.0 } else { 0.0 });
        }
    });
    assert!(one.announced_slips >= 1 && (one.slips, one.integers_wrong) == (0, 0), "{one:?}");
    // All of them, of which three come back an epoch before the others.
    let all = figures(|number, values| {
        if number >= AT {
            moved(values, number, &|sv| 5e4 * f64::from(sv.number));
        }
        if number == AT {
            let mut seen: Vec<Sv> = values.keys().map(|(sv, _)| *sv).collect();
            seen.dedup();
            values.retain(|(sv, _), _| seen[..3].contains(sv));
        }
    });
    assert_eq!((all.epochs, all.solved, all.fixed), (12, 11, 11), "{all:?}");
    assert_eq!((all.slips, all.integers_wrong), (0, 0), "{all:?}");
    assert!(all.up_rms_m.is_some_and(|up_m| up_m < 0.005), "{all:?}");
}

/// Numbers of a line of published cases by its name.
fn line(name: &str) -> Vec<f64> {
    let text = include_str!("../../src/rtk/data/lambda_cases.csv");
    let line = text.lines().find_map(|line| line.strip_prefix(name)?.strip_prefix(','));
    line.unwrap().split(',').map(|number| number.parse().unwrap()).collect()
}

#[test]
fn published_float_vectors_have_the_published_integers_and_norms() {
    for number in 1..=2 {
        let float = DVector::from_vec(line(&format!("a{number}")));
        let covariance = DMatrix::from_row_slice(float.len(), float.len(), &line(&format!("Q{number}")));
        let made = Decorrelated::new(&float, &covariance).unwrap();
        let found = made.search(0).unwrap();
        let (both, norms) = (line(&format!("F{number}")), line(&format!("s{number}")));
        for (index, norm) in norms.into_iter().enumerate() {
            let expected: Vec<f64> = both.iter().skip(index).step_by(2).copied().collect();
            assert_eq!(made.back(&found.vectors[index]).as_slice(), expected, "case {number}, vector {index}");
            // Six decimals are printed, of covariances with six.
            let miss = (found.squared_norms[index] - norm).abs();
            assert!(miss < 1e-4 * norm, "case {number}: {:?}", found.squared_norms);
        }
    }
}

#[test]
fn one_ambiguity_is_rounded_right_as_often_as_a_normal_number_is_within_half_a_cycle() {
    // Tables of the normal distribution: within 2, 2.5 and 4 deviations.
    for (sigma, within) in [(0.25, 0.954_499_7), (0.2, 0.987_580_7), (0.125, 0.999_936_7)] {
        let covariance = DMatrix::from_element(1, 1, sigma * sigma);
        let made = Decorrelated::new(&DVector::from_element(1, 0.1), &covariance).unwrap();
        assert!((made.success_rate(0) - within).abs() < 1e-7, "{sigma}: {}", made.success_rate(0));
    }
}
