//! The judge on tables of one run: its figures computed again from the rows, and damage that it must see.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use analysis::judge::summary::Summary;
use nalgebra::{Matrix3, Vector3};
use tempfile::TempDir;

use crate::loops::{OPEN_SKY, failures, judged, run};

/// Variable with the directory of an existing faultless run. The judge is then the only part that can be
/// wrong.
pub const RUN: &str = "GNSS_TWIN_PLANTED_RUN";
/// No limits but those of the verdict; a file of limits must set one.
const NONE: &str = "\"position.fixes\" = { min = 1 }";

/// The tables of a run, made once a process.
fn made() -> &'static Path {
    static MADE: OnceLock<(Option<TempDir>, PathBuf)> = OnceLock::new();
    let (_, path) = MADE.get_or_init(|| {
        if let Some(path) = std::env::var_os(RUN) {
            return (None, path.into());
        }
        let directory = tempfile::tempdir().unwrap();
        run(OPEN_SKY, directory.path());
        let path = directory.path().to_owned();
        (Some(directory), path)
    });
    path
}

/// A copy of those tables, each passed through `change` by its name.
fn copy(change: impl Fn(&str, String) -> String) -> TempDir {
    let target = tempfile::tempdir().unwrap();
    for part in ["truth", "rx"] {
        std::fs::create_dir(target.path().join(part)).unwrap();
        for entry in std::fs::read_dir(made().join(part)).unwrap() {
            let entry = entry.unwrap();
            let name = format!("{part}/{}", entry.file_name().into_string().unwrap());
            let text = std::fs::read_to_string(entry.path()).unwrap();
            std::fs::write(target.path().join(&name), change(&name, text)).unwrap();
        }
    }
    target
}

fn summary() -> Summary {
    judged(copy(|_, text| text).path(), NONE)
}

/// Rows of a table: column to text.
fn table(name: &str) -> Vec<BTreeMap<String, String>> {
    let mut reader = csv::Reader::from_path(made().join(name)).unwrap();
    reader.deserialize().map(Result::unwrap).collect()
}

fn number(row: &BTreeMap<String, String>, column: &str) -> f64 {
    row[column].parse().unwrap()
}

fn vector(row: &BTreeMap<String, String>, columns: [&str; 3]) -> Vector3<f64> {
    Vector3::from(columns.map(|column| number(row, column)))
}

/// Hyndman and Fan's type 7.
fn p95(values: impl Iterator<Item = f64>) -> f64 {
    let mut sorted: Vec<f64> = values.map(f64::abs).collect();
    sorted.sort_by(f64::total_cmp);
    let rank = 0.95 * (sorted.len() - 1) as f64;
    let (low, share) = (rank as usize, rank.fract());
    sorted[low] + share * (sorted[(low + 1).min(sorted.len() - 1)] - sorted[low])
}

fn rms(values: impl Iterator<Item = f64>) -> f64 {
    let squares: Vec<f64> = values.map(|value| value * value).collect();
    (squares.iter().sum::<f64>() / squares.len() as f64).sqrt()
}

fn near(name: &str, found: Option<f64>, expected: f64) {
    let found = found.unwrap_or_else(|| panic!("no {name}"));
    assert!((found - expected).abs() <= 1e-3 * expected.abs() + 1e-6, "{name}: {found}, by hand {expected}");
}

/// Rows of east, north and up at an ECEF position; geodetic latitude of the ellipsoid to 1e-9 rad near its
/// surface.
fn axes(position_m: Vector3<f64>) -> Matrix3<f64> {
    let longitude = libm::atan2(position_m.y, position_m.x);
    let level_m = libm::hypot(position_m.x, position_m.y);
    let latitude = libm::atan2(position_m.z, level_m * (1.0 - 6.694_379_990_14e-3));
    let ((sin_lon, cos_lon), (sin_lat, cos_lat)) = (libm::sincos(longitude), libm::sincos(latitude));
    Matrix3::new(
        -sin_lon,
        cos_lon,
        0.0, //
        -sin_lat * cos_lon,
        -sin_lat * sin_lon,
        cos_lat, //
        cos_lat * cos_lon,
        cos_lat * sin_lon,
        sin_lat,
    )
}

#[test]
fn figures_of_the_position_are_those_of_its_rows() {
    let truth: BTreeMap<String, BTreeMap<String, String>> =
        table("truth/trajectory.csv").into_iter().map(|row| (row["sample"].clone(), row)).collect();
    let (mut enu_m, mut speed_mps, mut clock_m, mut nees) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
    for fix in table("rx/fixes.csv") {
        let there = &truth[&fix["sample"]];
        let place = vector(there, ["x_m", "y_m", "z_m"]);
        let error_m = axes(place) * (vector(&fix, ["x_m", "y_m", "z_m"]) - place);
        let velocity = ["vx_mps", "vy_mps", "vz_mps"];
        speed_mps.push((vector(&fix, velocity) - vector(there, velocity)).norm());
        let whole_s = number(&fix, "gps_s") - number(there, "gps_s");
        clock_m.push(299_792_458.0 * (whole_s + number(&fix, "gps_fraction_s") - number(there, "gps_fraction_s")));
        let sigma = vector(&fix, ["sigma_east_m", "sigma_north_m", "sigma_up_m"]);
        let correlation = |a: usize, b: usize| match (a.min(b), a.max(b)) {
            (0, 1) => number(&fix, "correlation_en"),
            (0, 2) => number(&fix, "correlation_eu"),
            (1, 2) => number(&fix, "correlation_nu"),
            _ => 1.0,
        };
        let covariance = Matrix3::from_fn(|a, b| sigma[a] * sigma[b] * correlation(a, b));
        nees.push((error_m.transpose() * covariance.try_inverse().unwrap() * error_m)[0]);
        enu_m.push(error_m);
    }
    let summary = summary();
    let position = &summary.position;
    let mean = |axis: usize| enu_m.iter().map(|error| error[axis]).sum::<f64>() / enu_m.len() as f64;
    for axis in 0..3 {
        let found = position.bias_enu_m.map(|bias| bias[axis]);
        near(["bias east", "bias north", "bias up"][axis], found, mean(axis));
    }
    near("horizontal", position.horizontal_p95_m, p95(enu_m.iter().map(|error| libm::hypot(error.x, error.y))));
    near("vertical", position.vertical_p95_m, p95(enu_m.iter().map(|error| error.z)));
    near("three-dimensional", position.error_3d_p95_m, p95(enu_m.iter().map(|error| error.norm())));
    near("velocity", position.velocity_p95_mps, p95(speed_mps.into_iter()));
    near("clock", summary.details.clock_m.map(|clock| clock.p95), p95(clock_m.into_iter()));
    near("normalised error squared", position.nees_mean, nees.iter().sum::<f64>() / nees.len() as f64);
}

#[test]
fn figures_of_the_observations_are_those_of_their_rows() {
    let key = |row: &BTreeMap<String, String>| (row["sample"].clone(), row["sv"].clone());
    let truth: BTreeMap<_, _> = table("truth/observations.csv").into_iter().map(|row| (key(&row), row)).collect();
    let (mut code_m, mut doppler_hz, mut cn0_dbhz) = (BTreeMap::<String, Vec<f64>>::new(), Vec::new(), Vec::new());
    for row in table("rx/observations.csv") {
        let there = &truth[&key(&row)];
        let late_s = number(there, "sent_s") - number(&row, "sent_s")
            + (number(there, "sent_fraction_s") - number(&row, "sent_fraction_s"));
        code_m.entry(row["sample"].clone()).or_default().push(299_792_458.0 * late_s);
        doppler_hz.push(number(&row, "doppler_hz") - number(there, "doppler_hz"));
        cn0_dbhz.push((number(&row, "cn0_dbhz"), number(there, "cn0_dbhz")));
    }
    let without_clock = code_m.values().filter(|epoch| epoch.len() > 1).flat_map(|epoch| {
        let mean_m = epoch.iter().sum::<f64>() / epoch.len() as f64;
        epoch.iter().map(move |error_m| error_m - mean_m)
    });
    let summary = summary();
    let observables = &summary.observables;
    near("pseudorange", observables.pseudorange_rms_m, rms(without_clock));
    near("Doppler", observables.doppler_rms_hz, rms(doppler_hz.into_iter()));
    // Eight equal satellites of 50 dB-Hz. A filter at 0.40 of 2.048 Msps and a replica by means over samples
    // leave −0.58 dB: (∫ S·X·R)²/∫ S·R², by another program. Each meets seven others as noise of κ·C,
    // κ = 0.76 chip of their power at the antenna, which costs 10 lg(1 + 7·0.76/1.023e6·1e5) = 1.82 dB.
    let count = cn0_dbhz.len() as f64;
    let measured = cn0_dbhz.iter().map(|(measured, _)| measured).sum::<f64>() / count;
    let bias = observables.cn0_bias_db.unwrap();
    let expected = measured - 50.0 + 0.58 + 1.82;
    assert!((bias - expected).abs() < 0.2, "C/N0 {bias} dB off, by hand {expected}");
}

#[test]
fn the_spectrum_of_faultless_samples_keeps_its_limits() {
    let summary = judged(made(), NONE);
    let of_spectrum = |figure: &str| figure.contains("of the samples");
    let rows: Vec<_> = summary.details.verdict.rows.iter().filter(|row| of_spectrum(&row.figure)).collect();
    // Level, thirty-seconds of the band, bins.
    assert_eq!(rows.len(), 3, "{rows:?}");
    let failures = failures(&summary).into_iter().filter(|failure| of_spectrum(failure)).collect::<Vec<_>>();
    assert!(failures.is_empty(), "{}", failures.join("; "));
}

#[test]
fn damaged_tables_fail_by_the_row_that_names_the_damage() {
    let undamaged = failures(&judged(copy(|_, text| text).path(), NONE));
    let damaged = |name: &'static str, change: &dyn Fn(usize, &str) -> String, row: &str| {
        let target = copy(|file, text| {
            if file != name {
                return text;
            }
            text.lines().enumerate().map(|(number, line)| change(number, line) + "\n").collect()
        });
        let failures = failures(&judged(target.path(), NONE));
        assert!(!undamaged.iter().any(|failure| failure.contains(row)), "{row} fails without damage: {undamaged:?}");
        assert!(failures.iter().any(|failure| failure.contains(row)), "{name}: {row} is not among {failures:?}");
    };
    let with = |line: &str, column: usize, change: &dyn Fn(&str) -> String| {
        let mut cells: Vec<String> = line.split(',').map(str::to_owned).collect();
        cells[column] = change(&cells[column]);
        cells.join(",")
    };
    let add = |by: f64| move |cell: &str| (cell.parse::<f64>().unwrap() + by).to_string();
    let shifted = |number: usize, line: &str| if number > 0 { with(line, 5, &add(50.0)) } else { line.to_owned() };
    damaged("rx/fixes.csv", &shifted, "error, 95 %");
    let one_wrong = |number: usize, line: &str| if number == 9 { with(line, 4, &add(1.0)) } else { line.to_owned() };
    damaged("rx/navigation.csv", &one_wrong, "wrong navigation parameters");
    let never_there =
        |_: usize, line: &str| if line.contains(",G25,") { line.replace("false", "true") } else { line.to_owned() };
    damaged("rx/acquisition.csv", &never_there, "false acquisitions");
    let rows = table("rx/observations.csv");
    let middle = rows.len() / 2;
    let slipped = |number: usize, line: &str| {
        if number > middle && line.contains(",G03,") { with(line, 6, &add(1.0)) } else { line.to_owned() }
    };
    damaged("rx/observations.csv", &slipped, "cycle slips");
}

/// A jammer sends from 10.35 to 15.25 s, and a detector raises alarms in the six seconds that have a part of
/// it.
#[test]
fn alarms_in_the_seconds_of_a_jammer_are_detections_and_none_of_them_is_false() {
    let run = copy(|_, text| text);
    let read = |name: &str| -> serde_json::Value {
        serde_json::from_slice(&std::fs::read(run.path().join(name)).unwrap()).unwrap()
    };
    let rate_hz = read("truth/scene.json")["sample_rate_hz"].as_f64().unwrap();
    let sample = |s: f64| (s * rate_hz).round() as u64;
    let mut receiver = read("rx/receiver.json");
    receiver["settings"]["detection"] = serde_json::json!({"false_alarm": 1e-3, "interval_s": 1.0, "reference_s": 5.0});
    std::fs::write(run.path().join("rx/receiver.json"), receiver.to_string()).unwrap();
    let jammed: String = (0..50).map(|k| format!("{},1,60,1e5\n", sample(10.35 + 0.1 * f64::from(k)))).collect();
    let head = "sample,source,jn0_dbhz,frequency_hz\n";
    std::fs::write(run.path().join("truth/interference.csv"), head.to_owned() + &jammed).unwrap();
    let test = |second: u32| {
        let is_alarm = (11..=16).contains(&second);
        let statistic = if is_alarm { 9.0 } else { 0.5 };
        format!("{},level,,,{statistic},3.29,{is_alarm}\n", sample(f64::from(second)))
    };
    let head = "sample,detector,sv,signal,statistic,threshold,alarm\n";
    let tests: String = (1..31).map(test).collect();
    std::fs::write(run.path().join("rx/detection.csv"), head.to_owned() + &tests).unwrap();
    let found = judged(run.path(), NONE).detection.unwrap();
    let level = &found.detectors["level"];
    assert_eq!((found.attacks, level.attacked_tests, level.detection_share), (1, 6, Some(1.0)));
    assert_eq!((level.clean_tests, level.false_alarms), (10, 0));
    assert!((level.time_to_detect_s.unwrap() - 0.65).abs() < 1e-6, "{level:?}");
}

#[test]
fn deviations_of_a_clock_are_those_that_sp_1065_prints() {
    use analysis::measure::allan::Deviation;
    // The 1000 frequencies of SP 1065's test suite: a prime-modulus generator, as phases.
    let mut state = 1_234_567_890_u64;
    let mut phases = vec![0.0];
    for _ in 0..1000 {
        phases.push(phases[phases.len() - 1] + state as f64 / 2_147_483_647.0);
        state = state * 16_807 % 2_147_483_647;
    }
    for (deviation, m, printed) in [
        (Deviation::Oadev, 1, 2.922_319e-1),
        (Deviation::Oadev, 10, 9.159_953e-2),
        (Deviation::Mdev, 10, 6.172_376e-2),
        (Deviation::Tdev, 100, 1.253_382),
        (Deviation::Ohdev, 10, 9.581_083e-2),
    ] {
        let found = deviation.estimate(&phases, 1.0, m).unwrap().deviation;
        assert!((found / printed - 1.0).abs() < 1e-6, "{} {m}: {found}, printed {printed}", deviation.name());
    }
}

#[test]
fn a_correlation_peak_lies_at_the_delay_of_its_ray() {
    use analysis::measure::peaks::Glimpse;
    use gnss::gps::l1ca::L1_CA;
    use gnss::record::Observation;
    use gnss::samples::{Format, IfMetadata};
    use gnss::satellite::Sv;
    use gnss::time::Rate;

    // Four samples a chip, so that half of one is five steps of the delay; the ray is 0.4 chips late.
    let (rate, carrier_hz) = (Rate::from_hz(4.1e6).unwrap(), L1_CA.carrier_hz(Sv { system: L1_CA.system, number: 5 }));
    let truth = Observation {
        sample: 0,
        sv: Sv { system: L1_CA.system, number: 5 },
        signal: &L1_CA,
        sent_s: 1_300_000_000,
        sent_fraction_s: 0.000_3,
        pseudorange_m: 2.1e7,
        carrier_cycles: 0.0,
        doppler_hz: 0.0,
        cn0_dbhz: 45.0,
        locked_s: 1.0,
    };
    let code = L1_CA.code(5).unwrap();
    let chip = |n: i32| {
        let chips = (0.000_3 + f64::from(n) / rate.hz()) * 1.023e6 - 0.4;
        f32::from(code[chips as usize % 1023])
    };
    let metadata = IfMetadata { format: Format::Cf32Le, rate, center_hz: carrier_hz, inverted: false, start: None };
    let i: Vec<f32> = (0..40_000).map(chip).collect();
    let q = vec![0.0; i.len()];
    let rows = Glimpse { metadata, doppler_hz: 0.0, later_s: 0.0, i, q }.peaks(std::slice::from_ref(&truth));
    let top = rows.iter().max_by(|a, b| a.in_phase.total_cmp(&b.in_phase)).unwrap();
    assert!((top.delay_chips - 0.4).abs() < 0.026, "{top:?}");
}
