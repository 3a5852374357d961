//! Receivers under one sky: emitters reach each by its own path, and what is random about the sky is common.

use std::collections::{BTreeMap, BTreeSet};
use std::f64::consts::TAU;
use std::path::Path;

use nalgebra::{Rotation3, Vector3};

use crate::scenario::{Overrides, Scenario, text_of_station};
use crate::scene::Scene;
use crate::stage::{Block, Stage};
use crate::stream::Options;
use crate::truth;
use gnss::broadcast::Ephemeris;
use gnss::earth::Geodetic;
use gnss::record::Observation;
use gnss::satellite::Sv;

const C_MPS: f64 = 299_792_458.0;
/// Rate of the Earth, in rad/s: IS-GPS-200N, table 20-IV.
const EARTH_RADPS: f64 = 7.292_115_146_7e-5;
const L1_HZ: f64 = 1_575.42e6;
const RATE_HZ: f64 = 4e6;
const EMITTER: [f64; 3] = [26.52, 80.21, 180.0];
const PLACES: [(&str, [f64; 3]); 2] = [("base", [26.5, 80.2, 130.0]), ("rover", [26.504, 80.204, 133.0])];

fn ecef_m([latitude_deg, longitude_deg, height_m]: [f64; 3]) -> Vector3<f64> {
    Geodetic::from_degrees(latitude_deg, longitude_deg, height_m).to_ecef()
}

/// Travel time in seconds from the emitter, by positions in axes that do not turn.
fn travel_s(place: [f64; 3]) -> f64 {
    let (from_m, to_m) = (ecef_m(EMITTER), ecef_m(place));
    (0..5).fold(0.0, |travel_s, _| {
        let later = Rotation3::from_axis_angle(&Vector3::z_axis(), EARTH_RADPS * travel_s);
        (later * to_m - from_m).norm() / C_MPS
    })
}

fn text(waveform: &str, clocks: [(f64, f64); 2]) -> String {
    let station = |((name, [latitude, longitude, height]), (bias_s, drift)): (&(&str, [f64; 3]), &(f64, f64))| {
        format!(
            "[[station]]\nname = \"{name}\"\n[station.motion]\nkind = \"static\"\nlatitude_deg = {latitude}\n\
             longitude_deg = {longitude}\nheight_m = {height}\n[station.receiver_clock]\nbias_s = {bias_s:e}\n\
             drift_sps = {drift:e}\n"
        )
    };
    let stations: String = PLACES.iter().zip(&clocks).map(station).collect();
    let [latitude, longitude, height] = EMITTER;
    let source = if waveform.is_empty() {
        String::new()
    } else {
        format!(
            "[[interference]]\neirp_dbw = -20\nlatitude_deg = {latitude}\nlongitude_deg = {longitude}\n\
             height_m = {height}\n{waveform}\n"
        )
    };
    format!(
        "name = \"pair\"\nstart = 2010-07-01T08:12:30\nduration_s = 0.2\nseed = 11\n[noise]\n[front_end]\n\
         sample_rate_hz = {RATE_HZ:e}\n[power]\nkind = \"link_budget\"\n{source}{stations}"
    )
}

fn scene(text: &str, station: &str) -> Scene {
    let scenario = Scenario::parse(text, "pair").unwrap().with_station(station).unwrap();
    scenario.compose(Path::new("."), &Overrides::default()).unwrap().0
}

/// Emitter's wave in the samples of a station.
fn received(scene: &Scene, start: u64, samples: usize) -> Vec<(f64, f64)> {
    let (mut i, mut q) = (vec![0.0; samples], vec![0.0; samples]);
    scene.interference[0].act(&mut Block::whole(start, &mut i, &mut q));
    i.iter().zip(&q).map(|(i, q)| (f64::from(*i), f64::from(*q))).collect()
}

#[test]
fn a_carrier_arrives_with_the_phase_of_its_path_at_both_stations() {
    let clocks = [(1.3e-4, 5e-8), (-2.7e-4, -3e-7)];
    let carrier_hz = L1_HZ + 123_456.0;
    let text = text("kind = \"cw\"\noffset_hz = 123456", clocks);
    for ((name, place), (bias_s, drift)) in PLACES.iter().zip(clocks) {
        let scene = scene(&text, name);
        // The base's first samples are before the scene's start, with which the wave begins.
        for start in [4096_u64, 8192, 100 * 4096] {
            for (k, (i, q)) in received(&scene, start, 4096).iter().enumerate().step_by(371) {
                // The clock reads the time since the start plus its bias, and gains.
                let reading_s = (start + k as u64) as f64 / RATE_HZ;
                let sent_s = (reading_s - bias_s) / (1.0 + drift) - travel_s(*place);
                // Cycles of the wave when it was sent, less those of a mixer that the clock counts.
                let cycles = carrier_hz * sent_s - L1_HZ * reading_s;
                let off = libm::atan2(*q, *i) / TAU - cycles;
                assert!((off - off.round()).abs() < 1e-4, "{name}, sample {start} + {k}: {off}");
            }
        }
    }
}

/// Kinds that lie within 4 Msps about L1, with their random parts.
const WAVEFORMS: [&str; 7] = [
    "kind = \"chirp\"\nsweep_hz = 2e6\nsweep_s = 37e-6",
    "kind = \"fmcw\"\nsweep_hz = 2e6\nsweep_s = 41e-6",
    "kind = \"sine_fm\"\ndeviation_hz = 8e5\nrate_hz = 12345",
    "kind = \"pulse\"\nwidth_s = 2e-5\nrate_hz = 9000\njitter = 0.4",
    "kind = \"matched\"",
    "kind = \"noise\"\nbandwidth_hz = 2e6\noffset_hz = 1e5",
    // Wider than the samples' band, of which a chirp has lines and noise a part.
    "kind = \"noise\"\nbandwidth_hz = 12e6",
];

#[test]
fn every_waveform_is_the_same_at_both_stations_at_the_time_that_it_was_sent() {
    // The rover's clock differs by as much as its path is longer, and by three samples: sample n + 3 there
    // was sent when sample n here was. A millimetre would be 2e-5 of a wave of 1 MHz, and half a percent of a
    // cycle.
    let late_s = travel_s(PLACES[1].1) - travel_s(PLACES[0].1);
    assert!(late_s.abs() * RATE_HZ > 3.0, "{late_s}");
    let clocks = [(1e-5, 0.0), (1e-5 - late_s + 3.0 / RATE_HZ, 0.0)];
    for waveform in WAVEFORMS {
        let text = text(waveform, clocks);
        let [base, rover] = PLACES.map(|(name, _)| received(&scene(&text, name), 4 * 4096, 8192));
        // Power falls with the square of the distance, and the mixer turns with the clock's three samples.
        let ratio = travel_s(PLACES[0].1) / travel_s(PLACES[1].1);
        let size = base.iter().map(|(i, q)| i * i + q * q).sum::<f64>() / base.len() as f64;
        let turn = TAU * (L1_HZ * 3.0 / RATE_HZ).fract();
        let (sin, cos) = libm::sincos(turn);
        let off = base.iter().zip(&rover[3..]).map(|((bi, bq), (ri, rq))| {
            let (ri, rq) = ((ri * cos - rq * sin) / ratio, (ri * sin + rq * cos) / ratio);
            (ri - bi).powi(2) + (rq - bq).powi(2)
        });
        let worst = off.fold(0.0, f64::max) / size;
        assert!(size > 0.0 && worst.sqrt() < 1e-4, "{waveform}: {:e} of {size}", worst.sqrt());
    }
}

#[test]
fn noise_without_stations_stays_on_the_samples_own_grid() {
    let scene = |station: &str| {
        let motion = "[motion]\nkind = \"static\"\nlatitude_deg = 26.5\nlongitude_deg = 80.2\nheight_m = 130\n";
        let whole = text("kind = \"noise\"\nbandwidth_hz = 2e6", [(1e-5, 0.0); 2]);
        let above = whole.split("[[station]]").next().unwrap();
        let text = format!("{above}{motion}[receiver_clock]\nbias_s = 1e-5\n{station}");
        Scenario::parse(&text, "one").unwrap().compose(Path::new("."), &Overrides::default()).unwrap().0
    };
    let (bare, at_station) = (scene(""), scene("[[station]]\nname = \"base\"\n"));
    assert!(bare.interference[0].sent_s.is_none() && at_station.interference[0].sent_s == Some(0.0));
    assert_ne!(received(&bare, 0, 64), received(&at_station, 0, 64));
    // Noise of the receiver is a station's own, and the emitter's is that of the scene.
    assert!(bare.noise_seed() == bare.seed && at_station.noise_seed() != at_station.seed);
    assert_eq!((at_station.name.as_str(), bare.name.as_str()), ("pair-base", "pair"));
}

/// Rows of a station's true observations.
fn observed(text: &str, station: &str) -> (Vec<u8>, Vec<Observation>) {
    let place = tempfile::tempdir().unwrap();
    let mut truth = truth::Writer::create(place.path()).unwrap();
    let mut bytes = Vec::new();
    crate::stream::generate_with(&scene(text, station), &mut bytes, &mut truth, &mut |_| (), &Options::default())
        .unwrap();
    drop(truth);
    let mut file = csv::Reader::from_path(place.path().join("observations.csv")).unwrap();
    (bytes, file.deserialize().map(Result::unwrap).collect())
}

#[test]
fn a_station_alone_has_the_bytes_that_it_has_among_others() {
    let several = text("kind = \"noise\"\nbandwidth_hz = 1e6", [(1e-5, 0.0), (-3e-5, 1e-7)]);
    let alone = text_of_station(&several, "rover").unwrap();
    let ((bytes, rows), (own_bytes, own_rows)) = (observed(&several, "rover"), observed(&alone, "rover"));
    assert!(bytes == own_bytes && format!("{rows:?}") == format!("{own_rows:?}"));
    // The order of stations changes nothing either.
    let (above, base) = several.split_once("[[station]]").unwrap();
    let (base, rover) = base.split_once("[[station]]").unwrap();
    let turned = format!("{above}[[station]]{rover}[[station]]{base}");
    assert_eq!(observed(&several, "rover").0, observed(&turned, "rover").0);
    assert_ne!(observed(&several, "base").0, observed(&several, "rover").0);
}

#[test]
fn clock_noise_of_satellites_cancels_between_stations_with_equal_and_with_other_clocks() {
    let fault = "[[satellite_fault]]\nkind = \"clock_noise\"\npower_law = [0, 0, 1e-18, 0, 0]\n";
    let noisy = |text: &str| text.replacen("[noise]\n", fault, 1);
    let still = |text: &str| text.replacen("[noise]\n", "", 1);
    // Noise of the clock of each satellite in a station's carriers, in metres, by satellite and row.
    let noise_m = |text: &str, name: &str| -> Vec<f64> {
        let ((_, noisy), (_, still)) = (observed(&noisy(text), name), observed(&still(text), name));
        let pairs = noisy.iter().zip(&still);
        pairs.map(|(a, b)| (a.carrier_cycles - b.carrier_cycles) * C_MPS / L1_HZ).collect()
    };
    let text = text("", [(0.0, 0.0), (1e-6, 0.0)]);
    let (base, rover) = (noise_m(&text, "base"), noise_m(&text, "rover"));
    let rms = |values: &[f64]| (values.iter().map(|x| x * x).sum::<f64>() / values.len() as f64).sqrt();
    let differences: Vec<f64> = base.iter().zip(&rover).map(|(a, b)| a - b).collect();
    // White frequency noise walks by √(h0 t / 2): 0.3 ns or 7 cm in 0.1 s, and 0.2 mm in the microsecond by
    // which both clocks and both ways differ; rows are printed to 1e-4 cycles.
    assert!(rms(&base) > 0.02 && rms(&differences) < 5e-4, "{} {}", rms(&base), rms(&differences));
}

/// ECEF position of a GPS satellite at a GPS time in seconds after its ephemeris' reference time, in metres:
/// IS-GPS-200N, table 20-IV, with formulas of this test.
pub(super) fn satellite_m(set: &Ephemeris, tk_s: f64) -> Vector3<f64> {
    let a_m = set.sqrt_a_sqrtm.powi(2);
    let mean_rad = set.m0_rad + (libm::sqrt(3.986_005e14 / a_m.powi(3)) + set.delta_n_radps) * tk_s;
    let eccentric_rad = (0..30).fold(mean_rad, |e, _| mean_rad + set.eccentricity * libm::sin(e));
    let (sin, cos) = libm::sincos(eccentric_rad);
    let anomaly_rad = libm::atan2((1.0 - set.eccentricity.powi(2)).sqrt() * sin, cos - set.eccentricity);
    let phi_rad = anomaly_rad + set.omega_rad;
    let (s2, c2) = libm::sincos(2.0 * phi_rad);
    let u_rad = phi_rad + set.cus_rad * s2 + set.cuc_rad * c2;
    let r_m = a_m * (1.0 - set.eccentricity * cos) + set.crs_m * s2 + set.crc_m * c2;
    let i_rad = set.i0_rad + set.idot_radps * tk_s + set.cis_rad * s2 + set.cic_rad * c2;
    let toe_s = (set.toe.seconds() % 604_800) as f64 + set.toe.fraction();
    let node_rad = set.omega0_rad + (set.omega_dot_radps - EARTH_RADPS) * tk_s - EARTH_RADPS * toe_s;
    let turn = Rotation3::from_axis_angle(&Vector3::z_axis(), node_rad)
        * Rotation3::from_axis_angle(&Vector3::x_axis(), i_rad);
    let (sin, cos) = libm::sincos(u_rad);
    turn * Vector3::new(r_m * cos, r_m * sin, 0.0)
}

#[test]
fn double_differences_of_true_carriers_are_whole_numbers_beyond_the_geometry() {
    let clocks = [(1.3e-4, 5e-8), (-2.7e-4, -3e-7)];
    let text = text("", clocks);
    let start = scene(&text, "base").clock.start;
    // Cycles that geometry does not explain, by sample and satellite.
    let beyond = PLACES.iter().zip(clocks).map(|((name, place), (bias_s, drift))| {
        let scene = scene(&text, name);
        let (_, rows) = observed(&text, name);
        let row = |row: &Observation| {
            let elapsed_s = (row.sample as f64 / RATE_HZ - bias_s) / (1.0 + drift);
            let set = scene.catalogue.sent_at(row.sv, start).unwrap();
            let since_toe_s = start.since(set.toe);
            let range_m = (0..6).fold(2e7, |range_m, _| {
                let travel_s = range_m / C_MPS;
                let sent_m = satellite_m(set, since_toe_s + elapsed_s - travel_s);
                let later = Rotation3::from_axis_angle(&Vector3::z_axis(), -EARTH_RADPS * travel_s);
                (later * sent_m - ecef_m(*place)).norm()
            });
            ((row.sample, row.sv), row.carrier_cycles - range_m * L1_HZ / C_MPS)
        };
        rows.iter().map(row).collect::<BTreeMap<_, _>>()
    });
    let [base, rover] = beyond.collect::<Vec<_>>().try_into().unwrap();
    let single: BTreeMap<(u64, Sv), f64> =
        base.iter().filter_map(|(key, cycles)| Some((*key, rover.get(key)? - cycles))).collect();
    let samples: BTreeSet<u64> = single.keys().map(|(sample, _)| *sample).collect();
    assert!(samples.len() >= 2 && single.len() >= 7 * samples.len(), "{}", single.len());
    for sample in samples {
        let of: Vec<f64> = single.iter().filter(|(key, _)| key.0 == sample).map(|(_, cycles)| *cycles).collect();
        for cycles in of.iter().map(|cycles| cycles - of[0]) {
            // Half a millimetre: rows have 1e-4 cycles, and ranges of 2e7 m 4e-9 m.
            assert!((cycles - cycles.round()).abs() < 2.5e-3, "{sample}: {cycles}");
        }
    }
}
