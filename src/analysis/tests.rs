//! A run made by hand, with errors planted, and the summary that must find exactly those.

use std::fs;
use std::path::Path;

use nalgebra::Vector3;
use serde::Serialize;

mod clock;

use super::*;
use crate::analysis::errors::Errors;
use crate::analysis::load::{Emission, Run};
use crate::analysis::waveform::{Edge, Waveform};
use crate::gnss::earth::{Geodetic, SPEED_OF_LIGHT_MPS};
use crate::gnss::gps::l1ca::L1_CA;
use crate::gnss::record::{
    AcquisitionRow, Event, EventRow, Fix, InterferenceRow, IonosphereModel, LineRow, NavigationRow, Observation,
    SkyRow, TrackingRow, TrajectoryRow,
};
use crate::gnss::satellite::Sv;
use crate::gnss::signal::synthetic::LONG_BOC;
use crate::gnss::time::Epoch;

const RATE_HZ: u64 = 2_600_000;
const TICKS: u64 = 600;
const FIRST_TICK: u64 = 300;
const PRNS: [u8; 9] = [2, 5, 7, 12, 15, 18, 21, 26, 29];
const CHIP_M: f64 = SPEED_OF_LIGHT_MPS / 1.023e6;

/// Near normal with unit variance: the sum of twelve uniforms minus six, from Knuth's congruential generator.
struct Draw(u64);

impl Draw {
    fn normal(&mut self) -> f64 {
        let mut uniform = || {
            self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (self.0 >> 11) as f64 / (1_u64 << 53) as f64
        };
        (0..12).map(|_| uniform()).sum::<f64>() - 6.0
    }
}

/// What is planted.
struct Planted {
    code_bias_m: f64,
    code_sigma_m: f64,
    carrier_sigma_cycles: f64,
    doppler_sigma_hz: f64,
    cn0_bias_db: f64,
    enu_bias_m: Vector3<f64>,
    enu_sigma_m: f64,
    fixes: bool,
}

const PLANTED: Planted = Planted {
    code_bias_m: 0.25,
    code_sigma_m: 0.7,
    carrier_sigma_cycles: 0.008,
    doppler_sigma_hz: 0.4,
    cn0_bias_db: -0.3,
    enu_bias_m: Vector3::new(0.2, -0.1, 0.5),
    enu_sigma_m: 0.4,
    fixes: true,
};

fn write<T: Serialize>(path: &Path, rows: &[T]) {
    let mut writer = csv::Writer::from_path(path).unwrap();
    rows.iter().for_each(|row| writer.serialize(row).unwrap());
    writer.flush().unwrap();
}

fn start() -> Epoch {
    Epoch::parse("2010-07-01T08:12:30").unwrap()
}

/// The true observation of a satellite at a tick of 0.1 s.
fn true_observation(index: usize, tick: u64) -> Observation {
    let t_s = tick as f64 * 0.1;
    let doppler_hz = 3500.0 - 800.0 * index as f64 - 0.6 * t_s;
    let range_m = 21.0e6 + 4.0e5 * index as f64 - doppler_hz * L1_CA.wavelength_m(Sv::gps(1)) * t_s;
    let received = start().plus_s(t_s);
    let sent = received.plus_s(-range_m / SPEED_OF_LIGHT_MPS);
    Observation {
        sample: tick * RATE_HZ / 10,
        sv: Sv::gps(PRNS[index]),
        signal: &L1_CA,
        sent_s: sent.seconds(),
        sent_fraction_s: sent.fraction(),
        pseudorange_m: range_m,
        carrier_cycles: range_m / L1_CA.wavelength_m(Sv::gps(1)),
        doppler_hz,
        cn0_dbhz: 40.0 + 1.1 * index as f64 + 0.005 * t_s,
        locked_s: t_s,
    }
}

fn parameter(prn: u8, name: &str, raw: i64) -> NavigationRow {
    NavigationRow { sv: Sv::gps(prn), issue: 17, parameter: name.to_owned(), raw }
}

/// Writes the truth's half of a run.
fn write_truth(run: &Path) {
    let truth = run.join("truth");
    fs::create_dir_all(&truth).unwrap();
    let all = || (0..TICKS).flat_map(|tick| (0..PRNS.len()).map(move |index| (tick, index)));
    write(&truth.join("observations.csv"), &all().map(|(tick, i)| true_observation(i, tick)).collect::<Vec<_>>());
    let sky = |(tick, index): (u64, usize)| SkyRow {
        sample: tick * RATE_HZ / 10,
        sv: Sv::gps(PRNS[index]),
        azimuth_deg: 40.0 * index as f64 + 0.02 * tick as f64,
        // The first stands below the mask of 5 degrees.
        elevation_deg: 4.0 + 9.5 * index as f64 + 0.004 * tick as f64,
        range_m: 2.1e7,
        satellite_clock_m: 0.0,
        ionosphere_m: 3.0,
        troposphere_m: 4.0,
    };
    write(&truth.join("sky.csv"), &all().map(sky).collect::<Vec<_>>());
    let place = |tick: u64| {
        let origin = Geodetic::from_degrees(26.5, 80.2, 130.0);
        let turn = libm::sincos(tick as f64 * 0.01);
        let enu = Vector3::new(150.0 * turn.0, 90.0 * (1.0 - turn.1), 0.02 * tick as f64);
        origin.to_ecef() + origin.ecef_to_enu().transpose() * enu
    };
    let trajectory = |tick: u64| {
        let (at, time) = (place(tick), start().plus_s(tick as f64 * 0.1));
        TrajectoryRow {
            sample: tick * RATE_HZ / 10,
            gps_s: time.seconds(),
            gps_fraction_s: time.fraction(),
            x_m: at.x,
            y_m: at.y,
            z_m: at.z,
            vx_mps: 1.0,
            vy_mps: -2.0,
            vz_mps: 0.5,
            clock_bias_s: 1e-4,
            clock_drift: 1e-8,
        }
    };
    write(&truth.join("trajectory.csv"), &(0..TICKS).map(trajectory).collect::<Vec<_>>());
    let navigation: Vec<_> =
        PRNS.iter().flat_map(|&prn| [parameter(prn, "sqrt_a", 2_702_000_000), parameter(prn, "m_0", -77)]).collect();
    write(&truth.join("navigation.csv"), &navigation);
    let scene = r#"{"name": "planted", "seed": 7, "duration_s": 60.0, "sample_rate_hz": 2600000.0,
        "center_hz": 1575420000.0, "format": "ci8", "code_edge": "area", "knot_tolerance_cycles": 1e-4,
        "mask_deg": 5.0, "signals": ["GPS L1 C/A"], "noise": true, "start": "2010-07-01T08:12:30",
        "fidelity": "area edges"}"#;
    fs::write(truth.join("scene.json"), scene).unwrap();
}

/// Writes the receiver's half: the truth with what is planted.
fn write_estimate(run: &Path, planted: &Planted) {
    let rx = run.join("rx");
    fs::create_dir_all(&rx).unwrap();
    let mut draw = Draw(1);
    let mut observations = Vec::new();
    for (tick, index) in (FIRST_TICK..TICKS).flat_map(|tick| (0..PRNS.len()).map(move |index| (tick, index))) {
        let mut row = true_observation(index, tick);
        let late_m = planted.code_bias_m + planted.code_sigma_m * draw.normal();
        let sent = row.sent().plus_s(-late_m / SPEED_OF_LIGHT_MPS);
        (row.sent_s, row.sent_fraction_s) = (sent.seconds(), sent.fraction());
        // Every satellite has its own whole number; the fourth slips half a cycle at tick 450.
        let slip = if index == 3 && tick >= 450 { 0.5 } else { 0.0 };
        row.carrier_cycles += 1000.5 * index as f64 - 3e7 + slip + planted.carrier_sigma_cycles * draw.normal();
        row.doppler_hz += planted.doppler_sigma_hz * draw.normal();
        row.cn0_dbhz += planted.cn0_bias_db;
        row.locked_s -= 1.0;
        observations.push(row);
    }
    write(&rx.join("observations.csv"), &observations);

    let truth: Vec<TrajectoryRow> =
        csv::Reader::from_path(run.join("truth/trajectory.csv")).unwrap().deserialize().map(Result::unwrap).collect();
    let fix = |row: &TrajectoryRow| {
        let to_ecef = Geodetic::from_ecef(&row.position_m()).ecef_to_enu().transpose();
        let noise = Vector3::new(draw.normal(), draw.normal(), draw.normal()) * planted.enu_sigma_m;
        let at = row.position_m() + to_ecef * (planted.enu_bias_m + noise);
        let time = row.time().plus_s(3.0 / SPEED_OF_LIGHT_MPS);
        Fix {
            sample: row.sample,
            gps_s: time.seconds(),
            gps_fraction_s: time.fraction(),
            x_m: at.x,
            y_m: at.y,
            z_m: at.z,
            vx_mps: row.vx_mps + 0.03,
            vy_mps: row.vy_mps,
            vz_mps: row.vz_mps + 0.04,
            clock_bias_s: 1e-4,
            clock_drift: 1e-8,
            sigma_east_m: 0.4,
            sigma_north_m: 0.4,
            sigma_up_m: 0.4,
            sigma_clock_m: 0.4,
            correlation_en: 0.0,
            correlation_eu: 0.0,
            correlation_nu: 0.0,
            gdop: 2.0,
            pdop: 1.8,
            hdop: 1.0,
            vdop: 1.5,
            tdop: 1.0,
            condition: 4.0,
            satellites: 8,
            chi_square: 4.0,
            excluded: String::new(),
            ionosphere: IonosphereModel::Broadcast,
            ranges: None,
            clocks: None,
            time_scale: "GPST".to_owned(),
        }
    };
    let fixes: Vec<Fix> =
        if planted.fixes { truth.iter().skip(FIRST_TICK as usize).map(fix).collect() } else { Vec::new() };
    write(&rx.join("fixes.csv"), &fixes);
    write_channels(&rx, &mut Draw(5));
}

/// Acquisition with one false hit, tracking, navigation with one wrong parameter and one never sent, events.
fn write_channels(rx: &Path, draw: &mut Draw) {
    let search = |prn: u8| {
        let real = PRNS.contains(&prn);
        AcquisitionRow {
            sample: 0,
            sv: Sv::gps(prn),
            signal: &L1_CA,
            acquired: real || prn == 31,
            statistic: if real { 90.0 + 4.0 * f64::from(prn) } else { 40.0 } + if prn == 31 { 30.0 } else { 0.0 },
            threshold: 65.421,
            doppler_hz: 0.0,
            code_phase_chips: 0.0,
            cn0_dbhz: 45.0,
        }
    };
    write(&rx.join("acquisition.csv"), &(1..=37).map(search).collect::<Vec<_>>());
    let mut tracking = Vec::new();
    for (tick, prn) in (5..TICKS).flat_map(|tick| PRNS.map(|prn| (tick, prn))) {
        tracking.push(TrackingRow {
            sample: tick * RATE_HZ / 10,
            sv: Sv::gps(prn),
            signal: &L1_CA,
            prompt_i: 20.0,
            prompt_q: draw.normal(),
            dll_discriminator_chips: 0.03 * draw.normal(),
            pll_discriminator_cycles: 0.02 * draw.normal(),
            fll_discriminator_hz: 5.0 * draw.normal(),
            cn0_dbhz: 45.0,
            phase_lock: 0.98,
            integration_s: 0.02,
        });
    }
    write(&rx.join("tracking.csv"), &tracking);
    let mut navigation: Vec<_> = PRNS.iter().map(|&prn| parameter(prn, "sqrt_a", 2_702_000_000)).collect();
    navigation.push(parameter(5, "m_0", -78));
    navigation.push(parameter(7, "omega_dot", 3));
    write(&rx.join("navigation.csv"), &navigation);
    let event = |prn: u8, event: Event| EventRow { sample: 700_000, sv: Sv::gps(prn), signal: &L1_CA, event };
    write(
        &rx.join("events.csv"),
        &[event(2, Event::Acquired), event(31, Event::Acquired), event(31, Event::LossOfLock)],
    );
    fs::write(rx.join("receiver.json"), r#"{"settings": {"tracking": {"spacing_chips": 0.3}}}"#).unwrap();
}

/// The run as it is planted.
pub(super) fn planted() -> tempfile::TempDir {
    planted_run(&PLANTED)
}

fn planted_run(planted: &Planted) -> tempfile::TempDir {
    let run = tempfile::tempdir().unwrap();
    write_truth(run.path());
    write_estimate(run.path(), planted);
    run
}

#[test]
fn the_summary_finds_exactly_what_was_planted() {
    let run = planted_run(&PLANTED);
    let summary = judge(run.path()).unwrap();
    let count = 2700.0_f64;
    let near = |name: &str, value: Option<f64>, expected: f64, tolerance: f64| {
        let value = value.unwrap();
        assert!((value - expected).abs() < tolerance, "{name}: {value}, expected {expected} ± {tolerance}");
    };
    let satellites = &summary.satellites;
    assert_eq!((satellites.in_view, satellites.acquired, satellites.used, satellites.false_acquired), (9, 10, 8, 1));
    assert_eq!((summary.navigation.parameters_checked, summary.navigation.parameters_wrong), (11, 2));
    assert_eq!((summary.tracking.losses_of_lock, summary.tracking.cycle_slips), (1, 1));
    assert_eq!((summary.position.fixes, summary.position.first_fix_s), (300, Some(30.0)));

    // A mean of n values is known to σ/√n and a σ to σ/√(2n): five times that.
    let mean_tolerance = |sigma: f64, n: f64| 5.0 * sigma / n.sqrt();
    let sigma_tolerance = |sigma: f64, n: f64| 5.0 * sigma / (2.0 * n).sqrt();
    let observables = &summary.observables;
    near("code bias", observables.pseudorange_bias_m, 0.25, mean_tolerance(0.7, count));
    // The epoch's mean takes a ninth of the variance.
    let expected = 0.7 * (8.0_f64 / 9.0).sqrt();
    near("code rms", observables.pseudorange_rms_m, expected, sigma_tolerance(0.7, count));
    near("carrier rms", observables.carrier_rms_cycles, 0.008, sigma_tolerance(0.008, count));
    near("Doppler rms", observables.doppler_rms_hz, 0.4, sigma_tolerance(0.4, count));
    // Measured minus set is -0.3; expected is less than set by what the eight others add to the noise: 0.8267 chips
    // (area edges at 2.6 Msps) of their powers. C/N0s are 0.225 dB above their start in the middle.
    let linear = |index: usize| libm::pow(10.0, (40.0 + 1.1 * index as f64 + 0.225) / 10.0);
    let sum: f64 = (0..9).map(linear).sum();
    let loss = |index| 10.0 * libm::log10(1.0 + 0.8267 / 1.023e6 * (sum - linear(index)));
    let loss = (0..9).map(loss).sum::<f64>() / 9.0;
    near("C/N0 bias", observables.cn0_bias_db, loss - 0.3, 0.01);
    near("DLL", summary.tracking.dll_sigma_chips, 0.7 / CHIP_M, sigma_tolerance(0.7 / CHIP_M, count));
    near("PLL", summary.tracking.pll_sigma_deg, 0.008 * 360.0, sigma_tolerance(2.88, count));
    near("FLL", summary.tracking.fll_sigma_hz, 0.4, sigma_tolerance(0.4, count));
    let bias = summary.position.bias_enu_m.unwrap();
    for (bias, expected) in bias.into_iter().zip([0.2, -0.1, 0.5]) {
        near("position bias", Some(bias), expected, mean_tolerance(0.4, 300.0));
    }
    near("velocity", summary.position.velocity_p95_mps, 0.05, 1e-9);
    // Two epochs of a 1e-16 s resolution: 6e-8 m.
    near("clock", summary.details.clock_m.map(|clock| clock.mean), 3.0, 1e-6);
    let thresholds = summary.details.thresholds;
    assert!((thresholds.dll_chips - 0.05).abs() < 1e-12 && (thresholds.fll_hz - 1.0 / 0.24).abs() < 1e-12);
    let text = summary.to_string();
    for part in ["9 in view, 10 acquired, 8 used, false: G31", "11 parameters checked, 2 wrong", "G05 issue 17: m_0"] {
        assert!(text.contains(part), "{part} not in\n{text}");
    }
}

#[test]
fn the_keys_of_the_summary_are_a_contract() {
    let run = planted_run(&PLANTED);
    fs::write(run.path().join("speed.json"), r#"{"run_x_real_time": 7.5}"#).unwrap();
    judge(run.path()).unwrap();
    assert!(!run.path().join("summary.json.part").exists());
    let value: serde_json::Value = serde_json::from_slice(&fs::read(run.path().join("summary.json")).unwrap()).unwrap();
    let keys = |value: &serde_json::Value| value.as_object().unwrap().keys().cloned().collect::<Vec<_>>().join(" ");
    assert_eq!(
        keys(&value),
        "scene seed duration_s sample_rate_hz fidelity satellites position clock observables tracking signals navigation psd \
         speed"
    );
    for (section, expected) in [
        ("satellites", "in_view acquired used false_acquired"),
        (
            "position",
            "fixes first_fix_s horizontal_mean_m horizontal_p95_m vertical_p95_m error_3d_p95_m bias_enu_m velocity_p95_mps \
             nees_mean nees_band nees_independent nees_verdict",
        ),
        (
            "clock",
            "fixes bias_mean_s bias_sigma_s drift true_drift oadev_1s mdev_1s ohdev_1s tdev_1s_s true_oadev_1s \
             code_noise_oadev_1s h true_h",
        ),
        ("observables", "pseudorange_rms_m pseudorange_bias_m carrier_rms_cycles doppler_rms_hz cn0_bias_db"),
        (
            "tracking",
            "losses_of_lock cycle_slips dll_sigma_chips pll_sigma_deg fll_sigma_hz slips_undeclared slip_causes dll_chips \
             pll_deg fll_hz",
        ),
        (
            "psd",
            "level_error_db shape_error_p95_db null_low_hz null_high_hz null_low_expected_hz null_high_expected_hz null_reason",
        ),
        ("navigation", "parameters_checked parameters_wrong"),
        ("speed", "generate_x_real_time receive_x_real_time run_x_real_time cpu_s peak_memory_mib"),
    ] {
        assert_eq!(keys(&value[section]), expected);
    }
    assert_eq!(value["speed"]["run_x_real_time"], 7.5);
    assert!(value["speed"]["cpu_s"].is_null());
}

#[test]
fn a_run_without_a_fix_or_an_observation_has_nulls() {
    let run = planted_run(&Planted { fixes: false, ..PLANTED });
    for name in ["observations", "tracking", "navigation", "events", "acquisition"] {
        fs::write(run.path().join(format!("rx/{name}.csv")), "").unwrap();
    }
    judge(run.path()).unwrap();
    let value: serde_json::Value = serde_json::from_slice(&fs::read(run.path().join("summary.json")).unwrap()).unwrap();
    assert_eq!((&value["position"]["fixes"], &value["satellites"]["used"]), (&0.into(), &0.into()));
    for key in ["first_fix_s", "horizontal_p95_m", "bias_enu_m", "velocity_p95_mps"] {
        assert!(value["position"][key].is_null(), "{key}");
    }
    assert_eq!(value["clock"]["fixes"], 0);
    assert!(value["clock"].as_object().unwrap().values().skip(1).all(serde_json::Value::is_null));
    assert!(value["tracking"]["dll_sigma_chips"].is_null() && value["observables"]["cn0_bias_db"].is_null());
}

#[test]
fn what_is_missing_is_named_with_its_remedy() {
    let run = planted_run(&PLANTED);
    fs::remove_file(run.path().join("rx/fixes.csv")).unwrap();
    let error = judge(run.path()).unwrap_err().to_string();
    assert!(error.contains("fixes.csv is missing") && error.contains("gnss-twin receive"), "{error}");
    fs::remove_file(run.path().join("truth/scene.json")).unwrap();
    let error = judge(run.path()).unwrap_err().to_string();
    assert!(error.contains("scene.json is missing") && error.contains("gnss-twin generate"), "{error}");
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
fn every_picture_is_a_png_that_is_not_blank_and_its_numbers_are_in_a_table() {
    let run = planted_run(&PLANTED);
    let mut psd = psd::Psd::new(RATE_HZ as f64, false, 256);
    let mut draw = Draw(9);
    let mut block = || (0..20_000).map(|_| draw.normal() as f32).collect::<Vec<f32>>();
    psd.add(&block(), &block());
    psd.write(&run.path().join("psd.csv")).unwrap();
    judge(run.path()).unwrap();
    let only_elsewhere = ["multipath", "spoofing"];
    for picture in plot::PICTURES.iter().filter(|picture| !only_elsewhere.contains(&picture.name)) {
        let name = picture.name;
        for numbers in picture.numbers {
            let rows = csv::Reader::from_path(run.path().join(numbers)).unwrap().into_records().count();
            assert!(rows > 5, "{name}: {rows} rows in {numbers}");
        }
        let path = run.path().join(format!("{name}.png"));
        let picture = resvg::tiny_skia::Pixmap::load_png(&path).unwrap();
        let inked = picture.pixels().iter().filter(|p| (p.red(), p.green(), p.blue()) != (255, 255, 255)).count();
        // Axes and title alone ink more than 1 %.
        assert!(inked * 100 > picture.pixels().len(), "{name}: {inked} pixels");
        let coloured = picture.pixels().iter().filter(|p| p.red().abs_diff(p.blue()) > 60).count();
        assert!(coloured > 200, "{name}: {coloured} coloured pixels");
    }
    if let Ok(kept) = std::env::var("GNSS_TWIN_KEEP_PICTURES") {
        for entry in fs::read_dir(run.path()).unwrap() {
            let path = entry.unwrap().path();
            if path.is_file() {
                fs::copy(&path, Path::new(&kept).join(path.file_name().unwrap())).unwrap();
            }
        }
    }
}

#[test]
fn every_key_of_the_summary_is_in_the_schema_with_unit_and_meaning_and_no_other() {
    fn paths(path: &str, value: &serde_json::Value, found: &mut Vec<String>) {
        let below = |key: &str| if path.is_empty() { key.to_owned() } else { format!("{path}.{key}") };
        match value {
            serde_json::Value::Object(map) => map.iter().for_each(|(key, value)| paths(&below(key), value, found)),
            serde_json::Value::Array(list) => {
                list.iter().enumerate().for_each(|(index, value)| paths(&below(&index.to_string()), value, found));
            }
            _ => found.push(path.to_owned()),
        }
    }
    let run = planted_run(&PLANTED);
    fs::copy(run.path().join("truth/trajectory.csv"), run.path().join("truth/claimed.csv")).unwrap();
    write(&run.path().join("rx/interference.csv"), &[told(3, 1e5)]);
    let summary = judge(run.path()).unwrap();
    let mut written = Vec::new();
    paths("", &serde_json::to_value(&summary).unwrap(), &mut written);
    let documented: Vec<&str> = schema::leaves().iter().map(|leaf| leaf.path.as_str()).collect();
    // A list that this run does not have is one null.
    let covered = |path: &str| schema::leaf(path).is_some() || schema::is_branch(path);
    let undocumented: Vec<_> = written.iter().filter(|path| !covered(path)).collect();
    assert!(undocumented.is_empty(), "not in assets/summary.schema.json: {undocumented:?}");
    let there =
        |path: &str| written.iter().any(|own| schema::covers(path, own) || path.starts_with(&format!("{own}.")));
    let absent: Vec<_> = documented.iter().filter(|path| !there(path)).collect();
    assert!(absent.is_empty(), "in assets/summary.schema.json, but not written: {absent:?}");
    for leaf in schema::leaves() {
        assert!(!leaf.unit.is_empty() && leaf.meaning.len() > 3, "{} has no unit or no meaning", leaf.path);
        // Where a key ends with a unit, the schema says the same one.
        let endings = [("_m", "m"), ("_s", "s"), ("_hz", "Hz"), ("_deg", "degrees"), ("_db", "dB"), ("_mps", "m/s")];
        let key = leaf.path.rsplit('.').next().unwrap_or_default();
        for (ending, unit) in endings.into_iter().filter(|(ending, _)| key.ends_with(ending) && !key.ends_with("1s")) {
            assert_eq!(leaf.unit, unit, "{} ends with {ending}", leaf.path);
        }
    }
}

/// What a receiver tells of a wave in a second.
fn told(second: u64, frequency_hz: f64) -> LineRow {
    LineRow {
        sample: second * RATE_HZ,
        frequency_hz,
        jn0_dbhz: 60.5,
        js_db: None,
        statistic: 40.0,
        threshold: 4.7,
        lines: 1,
        resolution_hz: 635.0,
    }
}

#[test]
fn what_is_told_of_waves_is_held_against_those_that_there_were() {
    let run = planted_run(&PLANTED);
    let scene = run.path().join("truth/scene.json");
    let text =
        fs::read_to_string(&scene).unwrap().replace("\"seed\"", "\"interference\": [{\"kind\": \"cw\"}], \"seed\"");
    fs::write(&scene, text).unwrap();
    // On from 20 s to 30 s; the receiver misses 25 s, is 40 Hz off at 26 s and tells of something at 50 s.
    let wave =
        |tick: u64| InterferenceRow { sample: tick * RATE_HZ / 10, source: 1, jn0_dbhz: 60.0, frequency_hz: 311_500.0 };
    write(&run.path().join("truth/interference.csv"), &(200..300).map(wave).collect::<Vec<_>>());
    let mut rows: Vec<_> = (20..30).filter(|s| *s != 25).map(|s| told(s, 311_500.0)).collect();
    rows[5].frequency_hz -= 40.0;
    rows.push(told(50, -1e5));
    write(&run.path().join("rx/interference.csv"), &rows);
    let summary = judge(run.path()).unwrap();
    let lines = summary.interference.unwrap();
    assert_eq!((lines.told, lines.false_told, lines.wave_seconds, lines.wave_seconds_told), (10, 1, 10, 9));
    assert!((lines.frequency_error_max_hz.unwrap() - 40.0).abs() < 1e-9, "{lines:?}");
    assert!((lines.jn0_error_max_db.unwrap() - 0.5).abs() < 1e-9 && lines.resolution_hz == Some(635.0), "{lines:?}");
    let text = summary.to_string();
    assert!(text.contains("9 of 10 s with a continuous wave told, 1 told in error"), "{text}");
    let failed = |figure: &str| {
        let row = summary.details.verdict.rows.iter().find(|row| row.figure.starts_with(figure)).unwrap();
        row.status == super::verdict::Status::Fail
    };
    assert!(failed("interference told while") && failed("seconds of a continuous") && !failed("frequency of the"));
}

#[test]
fn the_verdict_names_what_was_planted_and_a_user_s_limits_come_first() {
    use super::verdict::Status;
    let run = planted_run(&PLANTED);
    let limits = "\"position.horizontal_p95_m\" = { max = 5 }\n\"tracking.cycle_slips\" = { max = 0 }\n\
                  \"spoofing.captured_share\" = { max = 0 }\n";
    let limits = limits::Limits::parse(limits, "lab.toml").unwrap();
    let verdict = judge_against(run.path(), Some(&limits)).unwrap().details.verdict;
    let status = |figure: &str| verdict.rows.iter().find(|row| row.figure == figure).map(|row| row.status);
    assert_eq!(verdict.of_user, 3);
    assert_eq!(status("position.horizontal_p95_m"), Some(Status::Pass));
    assert_eq!(status("horizontal error, 95 %"), None, "the user's limit stands in its place");
    let mut broken: Vec<&str> = verdict.broken().map(|row| row.figure.as_str()).collect();
    broken.sort_unstable();
    assert_eq!(broken, ["spoofing.captured_share", "tracking.cycle_slips"], "the first is a figure that is missing");
    // Formal sigmas are 0.4 m like the planted ones, the bias of 0.5 m up comes on top.
    assert_eq!(status("vertical error, 95 %"), Some(Status::Fail));
    assert_eq!(status("false acquisitions"), Some(Status::Fail));
    assert_eq!(status("wrong navigation parameters"), Some(Status::Fail));
    assert_eq!(status("PLL jitter, 1σ"), Some(Status::Pass));
    // 31 was lost, but the truth never had it: a signal too weak to hold.
    assert_eq!(status("unexpected losses of lock"), Some(Status::Pass));
    assert_eq!(verdict.status(), Status::Fail);
    let table = fs::read_to_string(run.path().join("verdict.csv")).unwrap();
    assert_eq!(table.lines().count(), 1 + verdict.rows.len());
}

#[cfg(feature = "pdf")]
#[test]
fn the_report_of_a_run_is_the_same_twice_and_has_its_fonts_and_pages() {
    let run = planted_run(&PLANTED);
    fs::write(run.path().join("scenario.toml"), "name = \"planted\"\n").unwrap();
    let report = || {
        judge(run.path()).unwrap();
        fs::read(run.path().join("report.pdf")).unwrap()
    };
    let pdf = report();
    assert!(pdf.starts_with(b"%PDF-") && pdf == report());
    let count = |what: &[u8]| pdf.windows(what.len()).filter(|window| window == &what).count();
    assert!(count(b"/MediaBox") > 5 && count(b"/FontFile2") == 3);
    assert!(pdf.len() < 5_000_000, "{} bytes", pdf.len());
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
fn the_spectrum_of_random_chips_is_the_theory_s_and_has_its_nulls() {
    let directory = planted_run(&PLANTED);
    let mut run = load::Run::read(directory.path()).unwrap();
    run.expected.iter_mut().for_each(|signal| signal.carrier_hz = signal.nominal_hz);
    (run.scene.noise, run.scene.code_edge, run.scene.sample_rate_hz) = (false, Edge::Nearest, 10.23e6);
    let mut draw = Draw(3);
    let chips = (0..400_000).map(|_| if draw.normal() < 0.0 { -30.0_f32 } else { 30.0 });
    let samples: Vec<f32> = chips.flat_map(|chip| [chip; 10]).collect();
    let silence = vec![0.0; samples.len()];
    let mut estimate = |bins: usize| {
        let mut psd = psd::Psd::new(10.23e6, false, bins);
        psd.add(&samples, &silence);
        let row = |(frequency_hz, density): (f64, f64)| load::PsdRow {
            frequency_hz,
            density_db: 10.0 * libm::log10(density),
        };
        run.psd = psd.density().unwrap().into_iter().map(row).collect();
        (spectrum::theory_db(&run), run.psd.clone(), spectrum::judge(&run))
    };
    let (theory_db, measured, _) = estimate(512);
    let peak_db = theory_db.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    // 15 600 segments, half overlapped: 1 % or 0.04 dB; the window's width costs 0.06 dB 20 dB down.
    for (row, theory_db) in measured.iter().zip(&theory_db).filter(|(_, theory_db)| **theory_db > peak_db - 20.0) {
        assert!((row.density_db - theory_db).abs() < 0.3, "{} Hz", row.frequency_hz);
    }
    // Bins are 2.5 kHz apart.
    let (_, _, found) = estimate(4096);
    // A parabola over ±2 % of a chip rate lies 0.00024 of it, 250 Hz, outside the null, here as there.
    for (found_hz, expected_hz, null_hz) in [
        (found.null_low_hz, found.null_low_expected_hz, -1.023e6),
        (found.null_high_hz, found.null_high_expected_hz, 1.023e6),
    ] {
        let (found_hz, expected_hz) = (found_hz.unwrap(), expected_hz.unwrap());
        assert!((found_hz - null_hz).abs() < 1e3 && (found_hz - expected_hz).abs() < 500.0, "{found_hz} {expected_hz}");
    }
    run.scene.noise = true;
    let hidden = spectrum::judge(&run);
    assert!(hidden.null_low_hz.is_none() && hidden.null_reason.unwrap().starts_with("hidden"), "{hidden:?}");
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
            *run.cn0_sums_hz.entry((row.sample, Emission::of(other))).or_insert(0.0) += linear_hz(row.cn0_dbhz);
            run.truth.push(other, &row).unwrap();
        }
        for row in run.observations.rows(link).unwrap() {
            let sent_fraction_s = row.sent_fraction_s - 30.0 / SPEED_OF_LIGHT_MPS;
            run.observations.push(other, &Observation { signal: &LONG_BOC, sent_fraction_s, ..row }).unwrap();
        }
    }
    run.signals.insert(&LONG_BOC);
    let both = Errors::measure(&run).unwrap();
    let rms_m = |errors: &Errors| statistics::rms(&errors.code_without_clock_m(None).unwrap()).unwrap();
    // A fraction of a second resolves 1e-16 s.
    assert!((rms_m(&both) - rms_m(&alone)).abs() < 1e-6, "{} {}", rms_m(&both), rms_m(&alone));
    let summary = Summary::new(&run, &both, &crate::analysis::clock::Clock::measure(&run, &both).unwrap()).unwrap();
    let names: Vec<&str> = summary.signals.keys().copied().collect();
    assert_eq!(names, [L1_CA.name, LONG_BOC.name]);
    let bias_m = |name: &str| summary.signals[name].observables.pseudorange_bias_m.unwrap();
    assert!((bias_m(LONG_BOC.name) - bias_m(L1_CA.name) - 30.0).abs() < 1e-6);
    // Spectral separation of both, each from itself and from the other.
    let [code, boc] = [&L1_CA, &LONG_BOC].map(|signal| Waveform::of(signal).unwrap());
    let kappa = |a: &Waveform, b: &Waveform| a.separation_s(b, 0.0, Edge::Area, run.scene.sample_rate_hz);
    for (own, other, signal) in [(&code, &boc, &L1_CA), (&boc, &code, &LONG_BOC)] {
        let link = run.truth.keys().find(|link| link.signal == signal).unwrap();
        let row = both.signals.rows(link).unwrap()[0];
        let sum_hz = run.cn0_sums_hz[&(row.sample, Emission::of(link))];
        let own_hz = linear_hz(row.cn0_true_dbhz);
        let lost = 1.0 + kappa(own, own) * (sum_hz - own_hz) + kappa(own, other) * sum_hz;
        let found = linear_hz(row.cn0_true_dbhz - row.cn0_effective_dbhz);
        assert!((found / lost - 1.0).abs() < 1e-9, "{signal}: {found} {lost}");
    }
}

fn linear_hz(dbhz: f64) -> f64 {
    libm::pow(10.0, dbhz / 10.0)
}
