//! A receiver's files made by hand, with biases planted, and the judgement that must name exactly those.

use std::fmt::Write as _;
use std::fs;
use std::path::Path;

use nalgebra::Vector3;

use super::*;
use crate::judge::judgement::Status;
use crate::judge::limits::Limits;
use crate::judge::verdict::Verdict;
use crate::measure::independent::tests::Draw;
use crate::show::document::Forms;
use gnss::earth::{Geodetic, SPEED_OF_LIGHT_MPS};
use gnss::gps::l1ca::L1_CA;
use gnss::record::{Observation, SkyRow, TrajectoryRow};
use gnss::satellite::Sv;

const SECONDS: f64 = 60.0;
const RATE_HZ: u64 = 2_600_000;
const PRNS: [u8; 9] = [2, 5, 7, 12, 15, 18, 21, 26, 29];
const SAMPLER: (f64, f64) = (1.3e-4, 5e-8);

/// Biases of a foreign receiver's files.
struct Planted {
    late_s: f64,
    clock: (f64, f64),
    doppler_sign: f64,
    carrier_sign: f64,
    cn0_db: f64,
    weeks: i64,
}

const PLANTED: Planted =
    Planted { late_s: 3e-3, clock: (2e-5, 3e-9), doppler_sign: 1.0, carrier_sign: 1.0, cn0_db: -1.5, weeks: 0 };
const CODE_SIGMA_M: f64 = 0.3;
const CARRIER_SIGMA: f64 = 0.01;
const DOPPLER_SIGMA_HZ: f64 = 0.2;
/// The biased satellite is where Doppler is near the mean, so that it does not pull at the time tag.
const BIASED: (usize, f64) = (4, 2.0);

fn start() -> Epoch {
    Epoch::parse("2010-07-01T08:12:30").unwrap()
}

/// Range and its rate by a perfect clock.
fn range(index: usize, t_s: f64) -> (f64, f64) {
    let (v, a, w) = (150.0 * (index as f64 - 4.0), 0.05 + 0.02 * index as f64, 0.5);
    let (sin, cos) = libm::sincos(w * t_s);
    (2.1e7 + 4e5 * index as f64 + v * t_s + 0.5 * a * t_s * t_s + 3.0 * sin, v + a * t_s + 3.0 * w * cos)
}

fn cn0_dbhz(index: usize) -> f64 {
    38.0 + index as f64
}

fn east(t_s: f64) -> (f64, f64) {
    (20.0 * t_s, 20.0)
}

fn origin() -> Geodetic {
    Geodetic::from_degrees(26.5, 80.2, 130.0)
}

fn rows<T: serde::Serialize>(path: &Path, rows: &[T]) {
    let mut writer = csv::Writer::from_path(path).unwrap();
    rows.iter().for_each(|row| writer.serialize(row).unwrap());
    writer.flush().unwrap();
}

fn write_truth(truth: &Path) {
    fs::create_dir_all(truth).unwrap();
    let (mut observations, mut sky, mut trajectory) = (Vec::new(), Vec::new(), Vec::new());
    for tick in 0..(SECONDS * 10.0) as u64 {
        // Sampler's reading since it began, and GPS time then.
        let reading_s = tick as f64 * 0.1;
        let bias_s = SAMPLER.0 + SAMPLER.1 * reading_s;
        let t_s = reading_s - bias_s;
        let sample = tick * RATE_HZ / 10;
        let at = origin().to_ecef() + origin().ecef_to_enu().transpose() * Vector3::new(east(t_s).0, 0.0, 0.0);
        let velocity = origin().ecef_to_enu().transpose() * Vector3::new(east(t_s).1, 0.0, 0.0);
        let time = start().plus_s(t_s);
        trajectory.push(TrajectoryRow {
            sample,
            gps_s: time.seconds(),
            gps_fraction_s: time.fraction(),
            x_m: at.x,
            y_m: at.y,
            z_m: at.z,
            vx_mps: velocity.x,
            vy_mps: velocity.y,
            vz_mps: velocity.z,
            clock_bias_s: bias_s,
            clock_drift: SAMPLER.1,
        });
        for (index, prn) in PRNS.into_iter().enumerate() {
            let (range_m, rate_mps) = range(index, t_s);
            let pseudorange_m = range_m + SPEED_OF_LIGHT_MPS * bias_s;
            let sent = start().plus_s(reading_s).plus_s(-pseudorange_m / SPEED_OF_LIGHT_MPS);
            observations.push(Observation {
                sample,
                sv: Sv::gps(prn),
                signal: &L1_CA,
                sent_s: sent.seconds(),
                sent_fraction_s: sent.fraction(),
                pseudorange_m,
                carrier_cycles: pseudorange_m / L1_CA.wavelength_m(Sv::gps(1)),
                doppler_hz: -rate_mps / L1_CA.wavelength_m(Sv::gps(1)) * (1.0 - SAMPLER.1)
                    - L1_CA.centre_hz() * SAMPLER.1,
                cn0_dbhz: cn0_dbhz(index),
                locked_s: reading_s,
            });
            sky.push(SkyRow {
                sample,
                sv: Sv::gps(prn),
                signal: &L1_CA,
                azimuth_deg: 40.0 * index as f64,
                elevation_deg: 10.0 + 8.0 * index as f64,
                range_m,
                satellite_clock_m: 0.0,
                ionosphere_m: 0.0,
                troposphere_m: 0.0,
            });
        }
    }
    rows(&truth.join("observations.csv"), &observations);
    rows(&truth.join("sky.csv"), &sky);
    rows(&truth.join("trajectory.csv"), &trajectory);
    let scene = r#"{"name": "planted", "seed": 7, "duration_s": 60.0, "sample_rate_hz": 2600000.0,
        "center_hz": 1575420000.0, "code_edge": "area", "noise": true}"#;
    fs::write(truth.join("scene.json"), scene).unwrap();
}

/// The receiver's RINEX file: epochs every quarter of a second, on no tick of the truth.
fn rinex(planted: &Planted) -> String {
    let mut text = String::new();
    let line = |text: &mut String, body: &str, label: &str| writeln!(text, "{body:<60}{label:<20}").unwrap();
    line(&mut text, "     3.04           OBSERVATION DATA    G", "RINEX VERSION / TYPE");
    line(&mut text, "1                   Planted             1.0", "REC # / TYPE / VERS");
    line(&mut text, "G    4 C1C L1C D1C S1C", "SYS / # / OBS TYPES");
    line(&mut text, "  2010    07    01    08    12   30.0000000     GPS", "TIME OF FIRST OBS");
    line(&mut text, "", "END OF HEADER");
    let mut draw = Draw(4);
    for k in 0..200 {
        let label = start().plus_s(4.0 + 0.25 * f64::from(k));
        let right_s = label.since(start()) - planted.late_s;
        // The label is what the receiver's clock reads.
        let t_s = right_s - planted.clock.0 - planted.clock.1 * right_s;
        let printed = label.plus_s((planted.weeks * WEEK_S) as f64).to_string();
        let printed = printed.replace(['-', 'T', ':'], " ");
        writeln!(text, "> {printed}0  0{:3}", PRNS.len()).unwrap();
        let clock_s = planted.clock.0 + planted.clock.1 * t_s;
        for (index, prn) in PRNS.into_iter().enumerate() {
            let (range_m, rate_mps) = range(index, t_s);
            let bias_m = if index == BIASED.0 { BIASED.1 } else { 0.0 };
            let code_m = range_m + SPEED_OF_LIGHT_MPS * clock_s + bias_m + CODE_SIGMA_M * draw.normal();
            // An undeclared half cycle on one satellite, a declared break on another.
            let slip = if index == 3 && k >= 60 { 0.5 } else { 0.0 } + if index == 5 && k >= 90 { 77.25 } else { 0.0 };
            let carrier = (range_m + SPEED_OF_LIGHT_MPS * clock_s) / L1_CA.wavelength_m(Sv::gps(1)) + slip;
            let carrier = planted.carrier_sign * (carrier + CARRIER_SIGMA * draw.normal()) - 1e8;
            let doppler = -rate_mps / L1_CA.wavelength_m(Sv::gps(1)) - L1_CA.centre_hz() * planted.clock.1;
            let doppler = planted.doppler_sign * (doppler + DOPPLER_SIGMA_HZ * draw.normal());
            let lli = if index == 5 && k == 90 { '1' } else { ' ' };
            let cn0 = cn0_dbhz(index) + planted.cn0_db;
            writeln!(text, "G{prn:02}{code_m:14.3}  {carrier:14.3}{lli} {doppler:14.3}  {cn0:14.3}").unwrap();
        }
    }
    text
}

/// The receiver's positions: 1.5 m north, 2 m down, and as late as its observations.
fn nmea(late_s: f64) -> String {
    nmea_from(4.0, late_s)
}

/// Positions a second apart, the first one's label so long after the start.
fn nmea_from(first_s: f64, late_s: f64) -> String {
    let mut text = String::new();
    let mut draw = Draw(9);
    for k in 0..50 {
        let label = start().plus_s(first_s + f64::from(k));
        let t_s = label.since(start()) - late_s;
        let enu =
            Vector3::new(east(t_s).0 + 0.4 * draw.normal(), 1.5 + 0.4 * draw.normal(), -2.0 + 0.4 * draw.normal());
        let place = Geodetic::from_ecef(&(origin().to_ecef() + origin().ecef_to_enu().transpose() * enu));
        let (latitude, longitude) = (place.latitude_rad.to_degrees(), place.longitude_rad.to_degrees());
        let utc = label.to_utc_text();
        let clock: String = utc.chars().skip(11).take(11).filter(|c| *c != ':').collect();
        let minutes = |x: f64| (x.floor(), 60.0 * (x - x.floor()));
        let (lat, lon) = (minutes(latitude), minutes(longitude));
        let body = format!(
            "GPGGA,{clock},{:02}{:011.8},N,{:03}{:011.8},E,1,09,1.0,{:.4},M,0.0,M,,",
            lat.0, lat.1, lon.0, lon.1, place.height_m
        );
        writeln!(text, "${body}*{:02X}", body.bytes().fold(0, |x, b| x ^ b)).unwrap();
    }
    text
}

fn judged(planted: &Planted) -> (tempfile::TempDir, Judgement) {
    let place = tempfile::tempdir().unwrap();
    write_truth(&place.path().join("truth"));
    let (obs, pos) = (place.path().join("rx.26O"), place.path().join("rx.nmea"));
    fs::write(&obs, rinex(planted)).unwrap();
    fs::write(&pos, nmea(planted.late_s)).unwrap();
    let files = Files { rinex_obs: Some(obs), nmea: Some(pos) };
    let judgement = judge(&place.path().join("truth"), &files).unwrap();
    (place, judgement)
}

fn near(name: &str, found: Option<f64>, expected: f64, tolerance: f64) {
    let found = found.unwrap_or(f64::NAN);
    assert!((found - expected).abs() <= tolerance, "{name}: {found}, expected {expected} ± {tolerance}");
}

#[test]
fn every_planted_bias_is_named_with_its_size() {
    let (place, judgement) = judged(&PLANTED);
    let found = &judgement.summary;
    let count = 200.0 * 9.0_f64;
    let join = &found.join;
    assert_eq!(
        (join.epochs, join.epochs_joined, join.observations_unmatched, join.observations_outliers),
        (200, 200, 0, 0)
    );
    // The motion's sinusoid: 3 m · 0.5⁴/384 · 0.1⁴ = 5e-8 m, and rounding of 2e7 m to 4e-9 m a step.
    assert!(join.interpolation_code_m < 1e-7 && join.interpolation_carrier_cycles < 1e-6, "{join:?}");
    // Speeds spread by 150 m/s · √(60/9) = 387 m/s: noise alone leaves 0.3/(387·√1800) = 18 µs; the biased
    // satellite, some 2 m/s from the mean, 2·2/(9·387²) = 3 µs. Five times that. The sigma counts the 2/9 m
    // that the bias takes from all others: 0.19 ms.
    near("time tag", join.time_tag_offset_s, 3e-3, 1e-4);
    assert!(join.time_tag_applied && join.time_tag_sigma_s.unwrap() < 2.5e-4, "{join:?}");
    // The biased satellite is a ninth of the common part.
    near("clock", found.clock.bias_mean_s, 2e-5 + 3e-9 * 28.872 + 2.0 / 9.0 / SPEED_OF_LIGHT_MPS, 2e-10);
    near("drift of codes", found.clock.drift_code, 3e-9, 2e-10);
    // Rounding of 1 mm and noise of 2 mm over 50 s.
    near("drift of carriers", found.clock.drift_carrier, 3e-9, 1e-12);
    near("drift of Dopplers", found.clock.drift_doppler, 3e-9, 5.0 * DOPPLER_SIGMA_HZ / count.sqrt() / 1.575e9);
    let biased = judgement.judged.observables.as_ref().unwrap().satellites.iter().find(|row| row.sv == "G15").unwrap();
    near("satellite's bias", biased.code_bias_m, 2.0 * 8.0 / 9.0, 5.0 * CODE_SIGMA_M / 200.0_f64.sqrt());
    assert_eq!(found.code.largest_bias_sv.as_deref(), Some("G15"));
    near(
        "code sigma",
        found.code.sigma_m,
        CODE_SIGMA_M * (8.0 / 9.0_f64).sqrt(),
        5.0 * CODE_SIGMA_M / (2.0 * count).sqrt(),
    );
    near(
        "carrier",
        found.carrier.rms_cycles,
        CARRIER_SIGMA * (8.0 / 9.0_f64).sqrt(),
        5.0 * CARRIER_SIGMA / (2.0 * count).sqrt(),
    );
    assert_eq!((found.carrier.sign, found.carrier.slips, found.carrier.slips_undeclared), (Some(1.0), 2, 1));
    let slips = &judgement.judged.observables.as_ref().unwrap().slips;
    let undeclared = slips.iter().find(|slip| !slip.declared).unwrap();
    assert_eq!((undeclared.sv.as_str(), undeclared.size_cycles), ("G12", Some(0.5)));
    near("slip's time", Some(undeclared.label_s), 4.0 + 15.0, 1e-6);
    near("Doppler's scale", found.doppler.scale, 1.0, 5.0 * DOPPLER_SIGMA_HZ / (387.0 / 0.19 * count.sqrt()));
    // Expected is less than set by the eight others' codes, of which means over samples leave 1 − d/3.
    let kept = 1.0 - 1.023 / 2.6 / 3.0;
    let linear = |index: usize| libm::pow(10.0, cn0_dbhz(index) / 10.0);
    let sum: f64 = (0..9).map(linear).sum();
    let loss: f64 =
        (0..9).map(|i| 10.0 * libm::log10(1.0 + kept * 0.8267 / 1.023e6 * (sum - linear(i)))).sum::<f64>() / 9.0;
    // The same means leave as much of the satellite's own code, which is no fault of the receiver.
    let edge_db = -10.0 * libm::log10(kept);
    near("C/N0", found.cn0.bias_db, loss - 1.5 + edge_db, 0.01);
    let named = format!("(band's edge, filter and converter take {edge_db:.2} dB of GPS L1 C/A)");
    assert!(found.findings.iter().any(|one| one.starts_with("C/N0") && one.contains(&named)), "{:?}", found.findings);
    near(
        "code minus carrier",
        found.code.minus_carrier_drift_mps,
        0.0,
        3.0 * found.code.minus_carrier_drift_sigma_mps.unwrap(),
    );
    let position = &found.position;
    // Late labels: 20 m/s · 3 ms = 6 cm; means of fifty of 0.4 m.
    near("east", position.bias_east_m, -0.06, 5.0 * 0.4 / 50.0_f64.sqrt());
    near("north", position.bias_north_m, 1.5, 5.0 * 0.4 / 50.0_f64.sqrt());
    near("up", position.bias_up_m, -2.0, 5.0 * 0.4 / 50.0_f64.sqrt());
    near("time tag of positions", position.time_tag_offset_s, 3e-3, 5.0 * 0.4 / 20.0 / 50.0_f64.sqrt());
    let verdict = Verdict::of_foreign(&judgement).unwrap();
    crate::show::foreign::write(&judgement, &verdict, place.path(), Forms::BOTH).unwrap();
    for name in [
        "foreign.json",
        "foreign_observations.csv",
        "foreign_satellites.csv",
        "foreign_clock.csv",
        "foreign_slips.csv",
        "foreign_fixes.csv",
        "foreign_verdict.csv",
        "foreign_observables.png",
        "foreign_position.png",
    ] {
        assert!(fs::metadata(place.path().join(name)).unwrap().len() > 50, "{name}");
    }
    if cfg!(feature = "pdf") {
        assert!(fs::read(place.path().join("foreign_report.pdf")).unwrap().starts_with(b"%PDF-"));
    }
}

#[test]
fn a_clock_milliseconds_off_and_drifting_moves_the_time_of_reception_and_no_carrier() {
    // By the label alone, 5 ms to 5.1 ms late, satellites whose accelerations differ by 0.16 m/s² would drift
    // apart by 0.04 m, a fifth of a cycle.
    let planted = Planted { clock: (5e-3, 2e-6), late_s: 0.0, ..PLANTED };
    let (_place, judgement) = judged(&planted);
    let found = &judgement.summary;
    near("drift of carriers", found.clock.drift_carrier, 2e-6, 1e-11);
    near("clock", found.clock.bias_mean_s, 5e-3 + 2e-6 * 28.87 + 2.0 / 9.0 / SPEED_OF_LIGHT_MPS, 1e-9);
    near("carrier", found.carrier.rms_cycles, CARRIER_SIGMA * (8.0 / 9.0_f64).sqrt(), 1e-3);
    assert_eq!((found.carrier.slips, found.join.time_tag_applied), (2, false), "{:?}", found.join);
    let verdict = Verdict::of_foreign(&judgement).unwrap();
    assert_eq!(failed(&verdict), ["undeclared breaks of carriers"]);
}

#[test]
fn opposite_signs_and_a_wrong_rollover_are_named() {
    let planted = Planted { doppler_sign: -1.0, carrier_sign: -1.0, late_s: 0.0, weeks: 1024, ..PLANTED };
    let (_place, judgement) = judged(&planted);
    let found = &judgement.summary;
    assert_eq!((found.carrier.sign, found.join.observations_week_offset), (Some(-1.0), 1024));
    near("Doppler's scale", found.doppler.scale, -1.0, 1e-4);
    near("Doppler", found.doppler.rms_hz, DOPPLER_SIGMA_HZ * (8.0 / 9.0_f64).sqrt(), 0.02);
    near("carrier", found.carrier.rms_cycles, CARRIER_SIGMA, 0.002);
    assert!(!found.join.time_tag_applied, "{:?}", found.join);
    let text = found.to_string();
    for words in ["+1024 weeks", "carrier phase falls", "receding satellite", "time tags: no bias beyond"] {
        assert!(text.contains(words), "{words} not in\n{text}");
    }
}

#[test]
fn positions_in_gps_time_are_named_by_their_leap_seconds() {
    let place = tempfile::tempdir().unwrap();
    let (truth, path) = (place.path().join("truth"), place.path().join("rx.nmea"));
    write_truth(&truth);
    let leap_s = start().leap_seconds() as f64;
    let findings = |text: String| {
        fs::write(&path, text).unwrap();
        let files = Files { rinex_obs: None, nmea: Some(path.clone()) };
        judge(&truth, &files).unwrap().summary.findings.join("\n")
    };
    let found = findings(nmea_from(4.0 + leap_s, leap_s));
    assert!(found.contains("GPS time in place of NMEA's UTC") && found.contains("15 s earlier"), "{found}");
    assert!(!findings(nmea(0.0)).contains("UTC"), "labels that are right");
    // From 16 s to 60 s: the last is 0.1 s past the truth's end, and all would join 15 s earlier.
    let to_the_end: Vec<String> = nmea_from(16.0, 0.0).split_inclusive('\n').take(45).map(str::to_owned).collect();
    assert!(!findings(to_the_end.concat()).contains("UTC"), "one label past the end");
}

/// The rows of a verdict that fail.
fn failed(verdict: &Verdict) -> Vec<&str> {
    verdict.rows.iter().filter(|row| row.status == Status::Fail).map(|row| row.figure.as_str()).collect()
}

/// The verdict on files of the scene, damaged as asked for.
fn verdict(planted: &Planted, damaged: impl Fn(String) -> String, positions: String) -> Verdict {
    let place = tempfile::tempdir().unwrap();
    write_truth(&place.path().join("truth"));
    let (obs, pos) = (place.path().join("rx.26O"), place.path().join("rx.nmea"));
    fs::write(&obs, damaged(rinex(planted))).unwrap();
    fs::write(&pos, positions).unwrap();
    let files = Files { rinex_obs: Some(obs), nmea: Some(pos) };
    Verdict::of_foreign(&judge(&place.path().join("truth"), &files).unwrap()).unwrap()
}

#[test]
fn a_receiver_is_judged_by_what_its_files_show_and_fails_by_the_right_row() {
    let whole = |text: String| text;
    let sound = verdict(&PLANTED, whole, nmea(3e-3));
    // Its files end six seconds before the scene does, a subframe. Nothing declares a half cycle, and labels
    // that are 3 ms late move ranges by a metre: no more is wrong.
    let mut found = failed(&sound);
    found.sort_unstable();
    assert_eq!(found, ["time tags of observations, late", "undeclared breaks of carriers"]);
    let signs = Planted { doppler_sign: -1.0, carrier_sign: -1.0, weeks: 1024, ..PLANTED };
    let broken = ["weeks by which dates are off", "sign of the carrier", "sign of Doppler"];
    let found = verdict(&signs, whole, nmea(3e-3));
    assert!(broken.iter().all(|row| failed(&found).contains(row)), "{:?}", failed(&found));
    let deaf = Planted { cn0_db: -4.0, ..PLANTED };
    assert!(failed(&verdict(&deaf, whole, nmea(3e-3))).contains(&"C/N0 bias, magnitude"));
    // A pseudorange of another signal, half a code period off, and labels in GPS time.
    let wrong = |text: String| text.replacen("G12  222", "G12  223", 1).replacen("G12  221", "G12  222", 1);
    let found = verdict(&PLANTED, wrong, nmea_from(19.0, 15.0));
    assert!(failed(&found).contains(&"pseudoranges of another signal"), "{:?}", failed(&found));
    let late = found.rows.iter().find(|row| row.figure == "positions without a truth").unwrap();
    assert!(late.status == Status::Fail && late.why[0].contains("15 s late"), "{late:?}");
}

#[test]
fn a_judged_error_of_positions_is_the_measured_one_or_says_what_it_is_without() {
    let (_place, judgement) = judged(&PLANTED);
    let measured = &judgement.summary.position;
    let verdict = Verdict::of_foreign(&judgement).unwrap();
    let row = verdict.rows.iter().find(|row| row.path.as_deref() == Some("position.error_3d_p95_m")).unwrap();
    let (all_m, judged_m) = (measured.error_3d_p95_m.unwrap(), row.value.as_f64().unwrap());
    let is_equal = (all_m - judged_m).abs() < 1e-12;
    assert_eq!(row.without.is_empty(), is_equal, "{judged_m} m judged, {all_m} m measured: {}", row.without);
}

#[test]
fn limits_of_a_user_are_paths_of_the_foreign_summary_and_replace_the_verdict_s_own() {
    let (_place, judgement) = judged(&PLANTED);
    let verdict = Verdict::of_foreign(&judgement).unwrap();
    let text =
        "\"code.sigma_m\" = { max = 0.5 }\n[position]\nfixes = { min = 60 }\n[carrier]\nslips_undeclared.max = 1\n";
    let limits = Limits::parse_for(&FIGURES, text, "mine.toml").unwrap();
    let rows = limits.judge(&serde_json::to_value(&judgement.summary).unwrap());
    let verdict = verdict.with_user(rows);
    assert_eq!((verdict.of_user, failed(&verdict)[0]), (3, "position.fixes"));
    assert!(!failed(&verdict).contains(&"undeclared breaks of carriers"), "the user's limit replaces it");
    let sigma = verdict.rows.iter().find(|row| row.figure == "code.sigma_m").unwrap();
    assert_eq!((sigma.unit.as_str(), sigma.status), ("m", Status::Pass));
    let refused = Limits::parse_for(&FIGURES, "\"code.sigma\" = { max = 1 }\n", "mine.toml").unwrap_err().to_string();
    assert!(refused.contains("not in foreign.json; the nearest path is code.sigma_m"), "{refused}");
    assert!(Limits::parse_for(&FIGURES, "\"code.largest_bias_sv\" = { max = 1 }\n", "x").is_err());
}

#[test]
fn files_of_another_day_or_damaged_are_refused_with_place_and_reason() {
    let place = tempfile::tempdir().unwrap();
    let truth = place.path().join("truth");
    write_truth(&truth);
    let path = place.path().join("rx.26O");
    let refused = |text: &str| {
        fs::write(&path, text).unwrap();
        judge(&truth, &Files { rinex_obs: Some(path.clone()), nmea: None }).err().unwrap().to_string()
    };
    let good = rinex(&PLANTED);
    let text = refused(&good.replace("2010 07 01", "2011 07 01"));
    assert!(text.contains("have no truth") && text.contains("2011-07-01"), "{text}");
    let text = refused(&good.replacen("G12", "G1x", 1));
    assert!(text.contains("line 10") && text.contains("'G1x'"), "{text}");
    let missing = Files { rinex_obs: None, nmea: Some(place.path().join("none.nmea")) };
    assert!(judge(&truth, &missing).err().unwrap().to_string().contains("none.nmea"));
}
