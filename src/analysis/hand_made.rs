//! A run made by hand for tests: truth, an estimate with known errors planted, and the files of both.
//!
//! Nine satellites are in view for a minute; the receiver reports from the thirtieth second on. Every
//! error has a known size ([`PLANTED`]), so that a test can say what the judge must find.

use std::fs;
use std::path::Path;

use nalgebra::Vector3;
use serde::Serialize;

use gnss::earth::{Geodetic, SPEED_OF_LIGHT_MPS};
use gnss::facts::{ArrayFacts, InertialFacts, TriadErrors};
use gnss::gps::l1ca::L1_CA;
use gnss::record::{
    AcquisitionRow, AttitudeRow, BodyRow, DetectionRow, Detector, ElementRow, Event, EventRow, Fix, InertialRow,
    IntegrityRow, IonosphereModel, IonosphereRow, LineRow, NavigationRow, Observation, SkyRow, TrackingRow,
    TrajectoryRow,
};
use gnss::satellite::Sv;
use gnss::time::Epoch;

pub(crate) const RATE_HZ: u64 = 2_600_000;
pub(crate) const TICKS: u64 = 600;
pub(crate) const FIRST_TICK: u64 = 300;
pub(crate) const PRNS: [u8; 9] = [2, 5, 7, 12, 15, 18, 21, 26, 29];
pub(crate) const CHIP_M: f64 = SPEED_OF_LIGHT_MPS / 1.023e6;

/// Generator of nearly normal numbers with unit variance: the sum of twelve uniforms minus six, from Knuth's
/// congruential generator.
pub(crate) struct Draw(pub u64);

impl Draw {
    pub fn normal(&mut self) -> f64 {
        let mut uniform = || {
            self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (self.0 >> 11) as f64 / (1_u64 << 53) as f64
        };
        (0..12).map(|_| uniform()).sum::<f64>() - 6.0
    }
}

/// Errors that a run made by hand contains.
pub(crate) struct Planted {
    pub code_bias_m: f64,
    pub code_sigma_m: f64,
    pub carrier_sigma_cycles: f64,
    pub doppler_sigma_hz: f64,
    pub cn0_bias_db: f64,
    pub enu_bias_m: Vector3<f64>,
    pub enu_sigma_m: f64,
    pub fixes: bool,
}

pub(crate) const PLANTED: Planted = Planted {
    code_bias_m: 0.25,
    code_sigma_m: 0.7,
    carrier_sigma_cycles: 0.008,
    doppler_sigma_hz: 0.4,
    cn0_bias_db: -0.3,
    enu_bias_m: Vector3::new(0.2, -0.1, 0.5),
    enu_sigma_m: 0.4,
    fixes: true,
};

pub(crate) fn write<T: Serialize>(path: &Path, rows: &[T]) {
    let mut writer = csv::Writer::from_path(path).unwrap();
    rows.iter().for_each(|row| writer.serialize(row).unwrap());
    writer.flush().unwrap();
}

pub(crate) fn start() -> Epoch {
    Epoch::parse("2010-07-01T08:12:30").unwrap()
}

/// The true observation of a satellite at a tick of 0.1 s.
pub(crate) fn true_observation(index: usize, tick: u64) -> Observation {
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

pub(crate) fn parameter(prn: u8, name: &str, raw: i64) -> NavigationRow {
    NavigationRow {
        sample: 0,
        sv: Sv::gps(prn),
        issue: 17,
        parameter: name.to_owned(),
        raw,
        message: "LNAV".to_owned(),
    }
}

/// Writes the truth's half of a run.
pub(crate) fn write_truth(run: &Path) {
    let truth = run.join("truth");
    fs::create_dir_all(&truth).unwrap();
    let all = || (0..TICKS).flat_map(|tick| (0..PRNS.len()).map(move |index| (tick, index)));
    write(&truth.join("observations.csv"), &all().map(|(tick, i)| true_observation(i, tick)).collect::<Vec<_>>());
    let sky = |(tick, index): (u64, usize)| SkyRow {
        sample: tick * RATE_HZ / 10,
        sv: Sv::gps(PRNS[index]),
        signal: &L1_CA,
        azimuth_deg: 40.0 * index as f64 + 0.02 * tick as f64,
        // The first is below the mask of 5 degrees.
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
pub(crate) fn write_estimate(run: &Path, planted: &Planted) {
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
pub(crate) fn write_channels(rx: &Path, draw: &mut Draw) {
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
            early_i: None,
            early_q: None,
            late_i: None,
            late_q: None,
            tap_spacing_chips: None,
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
pub(crate) fn planted() -> tempfile::TempDir {
    planted_run(&PLANTED)
}

pub(crate) fn planted_run(planted: &Planted) -> tempfile::TempDir {
    let run = tempfile::tempdir().unwrap();
    write_truth(run.path());
    write_estimate(run.path(), planted);
    run
}

/// Row of a receiver that reports a continuous wave in a second.
pub(crate) fn reported(second: u64, frequency_hz: f64) -> LineRow {
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

/// Writes 41 delays that two bands showed of the second satellite, each with an error of its own.
pub(crate) fn two_bands(run: &Path, error_m: impl Fn(u64) -> f64) {
    let row = |row: u64| IonosphereRow {
        sample: (FIRST_TICK + row) * RATE_HZ / 10,
        sv: Sv::gps(PRNS[1]),
        delay_m: 3.0 + error_m(row),
        sigma_m: 0.05,
    };
    write(&run.join("rx/ionosphere.csv"), &(0..41).map(row).collect::<Vec<_>>());
}

/// Adds protection levels of 20 and 30 m by ARAIM to every fix of a run.
pub(crate) fn protected(run: &Path) {
    let fixes: Vec<Fix> =
        csv::Reader::from_path(run.join("rx/fixes.csv")).unwrap().into_deserialize().map(Result::unwrap).collect();
    let row = |fix: &Fix| IntegrityRow {
        sample: fix.sample,
        gps_s: fix.gps_s,
        gps_fraction_s: fix.gps_fraction_s,
        method: "araim".to_owned(),
        hpl_m: Some(20.0),
        vpl_m: Some(30.0),
        emt_m: Some(8.0),
        sigma_v_acc_m: Some(1.2),
        satellites: fix.satellites,
        detected: false,
        excluded: String::new(),
        available: true,
        reason: String::new(),
    };
    write(&run.join("rx/integrity.csv"), &fixes.iter().map(row).collect::<Vec<_>>());
}

/// Adds two seconds of an inertial unit at rest to a run, whose sensors have white noise alone.
pub(crate) fn measured_at_rest(run: &Path) {
    const IMU_HZ: u64 = 50;
    let path = run.join("truth/scene.json");
    let mut scene: serde_json::Value = serde_json::from_slice(&fs::read(&path).unwrap()).unwrap();
    let noisy = TriadErrors { random_walk: 1e-3, ..TriadErrors::default() };
    let facts = InertialFacts {
        rate_hz: IMU_HZ as f64,
        is_still: true,
        gyro: noisy,
        accelerometer: noisy,
        ..InertialFacts::default()
    };
    scene["imu"] = serde_json::to_value(&facts).unwrap();
    fs::write(&path, scene.to_string()).unwrap();
    let mut draw = Draw(5);
    let mut noise = || 1e-3 * facts.rate_hz.sqrt() * draw.normal();
    let row = |number: u64| InertialRow {
        gps_s: (number / IMU_HZ) as i64,
        gps_fraction_s: (number % IMU_HZ) as f64 / IMU_HZ as f64,
        rate_x_radps: noise(),
        rate_y_radps: noise(),
        rate_z_radps: noise(),
        force_x_mps2: noise(),
        force_y_mps2: noise(),
        force_z_mps2: noise(),
    };
    write(&run.join("truth/imu.csv"), &(1..=2 * IMU_HZ).map(row).collect::<Vec<_>>());
    let place = |gps_s: i64| BodyRow {
        gps_s,
        gps_fraction_s: 0.0,
        x_m: 6.378e6,
        y_m: 0.0,
        z_m: 0.0,
        vx_mps: 0.0,
        vy_mps: 0.0,
        vz_mps: 0.0,
        qw: 1.0,
        qx: 0.0,
        qy: 0.0,
        qz: 0.0,
    };
    write(&run.join("truth/body.csv"), &[place(0), place(2)]);
}

/// Adds attitudes of an array of three elements to a run, one a second, each a tenth of a degree off.
pub(crate) fn oriented(run: &Path) {
    let path = run.join("truth/scene.json");
    let mut scene: serde_json::Value = serde_json::from_slice(&fs::read(&path).unwrap()).unwrap();
    let facts = ArrayFacts {
        lever_arms_m: vec![[0.0; 3], [0.1, 0.0, 0.0], [0.0, 0.1, 0.0]],
        axes: [[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0]],
        is_still: true,
        mixing: (0..9).map(|k| [f64::from(u8::from(k % 4 == 0)), 0.0]).collect(),
        gains: vec![1.0; 3],
        towards: Vec::new(),
    };
    scene["array"] = serde_json::to_value(&facts).unwrap();
    fs::write(&path, scene.to_string()).unwrap();
    let path = run.join("rx/receiver.json");
    let mut receiver: serde_json::Value = serde_json::from_slice(&fs::read(&path).unwrap()).unwrap();
    let filter = serde_json::json!({"filter": "none", "attitude_ms": 1000, "phase_sigma_deg": 2.0});
    receiver["settings"]["array"] = filter;
    fs::write(&path, receiver.to_string()).unwrap();
    let sample = |second: u64| second * RATE_HZ + RATE_HZ / 2;
    let attitude = |second: u64| AttitudeRow {
        sample: sample(second),
        yaw_deg: if second.is_multiple_of(2) { 0.1 } else { 359.9 },
        pitch_deg: 0.1,
        roll_deg: -0.1,
        sigma_east_deg: 0.1,
        sigma_north_deg: 0.1,
        sigma_up_deg: 0.1,
        signals: PRNS.len(),
        chi_square: 3.0,
        freedom: 3,
    };
    let element = |second: u64| ElementRow {
        sample: sample(second),
        signal: L1_CA.name.to_owned(),
        element: 2,
        phase_deg: 1.0,
        sigma_deg: 1.0,
    };
    write(&run.join("rx/attitude.csv"), &(30..60).map(attitude).collect::<Vec<_>>());
    write(&run.join("rx/elements.csv"), &(30..60).map(element).collect::<Vec<_>>());
}

/// Adds tests of two detectors to a run, one a second; every tenth of the second one raises an alarm.
pub(crate) fn detected(run: &Path) {
    let path = run.join("rx/receiver.json");
    let mut receiver: serde_json::Value = serde_json::from_slice(&fs::read(&path).unwrap()).unwrap();
    receiver["settings"]["detection"] = serde_json::json!({"false_alarm": 0.1, "interval_s": 1.0, "reference_s": 20.0});
    fs::write(&path, receiver.to_string()).unwrap();
    let row = |second: u64, detector: Detector| {
        let statistic = if detector == Detector::CorrelationRatio && second % 10 == 5 { 2.5 } else { 1.0 };
        let sv = if detector == Detector::Level { String::new() } else { Sv::gps(PRNS[0]).to_string() };
        DetectionRow {
            sample: second * RATE_HZ,
            detector,
            signal: if sv.is_empty() { String::new() } else { L1_CA.name.to_owned() },
            sv,
            statistic,
            threshold: 1.645,
            alarm: statistic > 1.645,
        }
    };
    let both = [Detector::Level, Detector::CorrelationRatio];
    let rows: Vec<DetectionRow> = (1..60).flat_map(|second| both.map(|detector| row(second, detector))).collect();
    write(&run.join("rx/detection.csv"), &rows);
}

/// Makes the receiver of a run one that verifies Galileo's authentication, from TOW 375 150 of week 566 of
/// GST on, by a clock so far ahead; E12 has a fault of its message if asked for.
pub(crate) fn verified(run: &Path, offset_s: f64, faulty: bool) {
    let path = run.join("truth/scene.json");
    let mut scene: serde_json::Value = serde_json::from_slice(&fs::read(&path).unwrap()).unwrap();
    scene["osnma"] = serde_json::json!({"public_key_every_s": 600.0, "public_key_for_s": 180.0});
    if faulty {
        scene["faults"] = serde_json::json!([{"kind": "parameter", "satellites": ["E12"], "from_s": 0.0}]);
    }
    fs::write(&path, scene.to_string()).unwrap();
    let path = run.join("rx/receiver.json");
    let mut receiver: serde_json::Value = serde_json::from_slice(&fs::read(&path).unwrap()).unwrap();
    receiver["settings"]["osnma"] = serde_json::json!({"public_key": "1:03", "kroot": "52", "time_uncertainty_s": 15.0,
        "clock_offset_s": offset_s, "position": "all"});
    receiver["osnma"] = serde_json::json!({"start": "hot", "state": "authentic",
        "tags": {"all": {"authentic": 2, "refused": 1}}});
    fs::write(&path, receiver.to_string()).unwrap();
    let table = "gst_week,tow_s,sender,satellite,adkd,position,result,reason\n\
                 566,375240,E05,E12,0,2,authentic,\n566,375240,E05,E12,12,3,authentic,\n\
                 566,375240,E05,E11,0,4,refused,tag is not the MAC of the data\n";
    fs::write(run.join("rx/osnma.csv"), table).unwrap();
}
