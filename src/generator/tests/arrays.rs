//! Elements of an array: carriers by the geometry, emitters coherent, noise of each its own.

use std::collections::BTreeMap;
use std::f64::consts::TAU;
use std::path::Path;

use nalgebra::{Matrix3, Rotation3, Vector3};
use num_complex::Complex64;

use super::stations::satellite_m;
use crate::scenario::{Overrides, Scenario};
use crate::scene::Scene;
use crate::stage::{Block, Stage};
use crate::stream::{Fronts, Options, transmitters};
use crate::synth::Edge;
use gnss::earth::Geodetic;
use gnss::satellite::Sv;

const C_MPS: f64 = 299_792_458.0;
/// Rate of the Earth, in rad/s: IS-GPS-200N, table 20-IV.
const EARTH_RADPS: f64 = 7.292_115_146_7e-5;
const L1_HZ: f64 = 1_575.42e6;
const RATE_HZ: f64 = 4e6;
const PLACE: [f64; 3] = [26.5, 80.2, 130.0];
const EMITTER: [f64; 3] = [26.51, 80.21, 180.0];
const CLOCK: (f64, f64) = (1.3e-4, 5e-8);
/// Yaw, pitch and roll in degrees.
const ANGLES: [f64; 3] = [35.0, 12.0, -7.0];
const ARMS_M: [[f64; 3]; 4] = [[0.02, 0.01, -0.1], [0.1, 0.0, -0.1], [-0.05, 0.08, -0.12], [0.0, -0.095, -0.1]];

fn ecef_m([latitude_deg, longitude_deg, height_m]: [f64; 3]) -> Vector3<f64> {
    Geodetic::from_degrees(latitude_deg, longitude_deg, height_m).to_ecef()
}

/// Scene of elements, each with keys of its own, and with more keys of `[array]` and of the scene.
fn text(spin_hz: f64, own: [&str; 4], more: &str, waveform: &str) -> String {
    let [latitude, longitude, height] = PLACE;
    let [yaw, pitch, roll] = ANGLES;
    let elements: String =
        ARMS_M.iter().zip(own).map(|(arm, own)| format!("[[array.element]]\nlever_arm_m = {arm:?}\n{own}\n")).collect();
    let source = if waveform.is_empty() {
        String::new()
    } else {
        let [latitude, longitude, height] = EMITTER;
        format!(
            "[[interference]]\neirp_dbw = -20\nlatitude_deg = {latitude}\nlongitude_deg = {longitude}\n\
             height_m = {height}\n{waveform}\n"
        )
    };
    format!(
        "name = \"array\"\nstart = 2010-07-01T08:12:30\nduration_s = 0.2\nseed = 11\n[noise]\n[front_end]\n\
         sample_rate_hz = {RATE_HZ:e}\nformat = \"ci16\"\n[power]\nkind = \"link_budget\"\n[motion]\n\
         kind = \"static\"\nlatitude_deg = {latitude}\nlongitude_deg = {longitude}\nheight_m = {height}\n\
         [receiver_clock]\nbias_s = {:e}\ndrift_sps = {:e}\n[attitude]\nkind = \"fixed\"\nyaw_deg = {yaw}\n\
         pitch_deg = {pitch}\nroll_deg = {roll}\nspin_hz = {spin_hz}\nlever_arm_m = [0.3, -0.2, 0.1]\n[array]\n\
         {more}\n{elements}{source}",
        CLOCK.0, CLOCK.1
    )
}

const IDEAL: [&str; 4] = [""; 4];

fn scenes(text: &str) -> Vec<Scene> {
    Scenario::parse(text, "array").unwrap().compose_all(Path::new("."), &Overrides::default()).unwrap().0
}

/// Position of an element at a true time, by rotations of this test: north, east, down turned by yaw, pitch
/// and roll one after the other.
fn element_m(arm: [f64; 3], spin_hz: f64, t_s: f64) -> Vector3<f64> {
    let [latitude, longitude, _] = PLACE.map(f64::to_radians);
    let ((sin_b, cos_b), (sin_l, cos_l)) = (libm::sincos(latitude), libm::sincos(longitude));
    let north = Vector3::new(-sin_b * cos_l, -sin_b * sin_l, cos_b);
    let east = Vector3::new(-sin_l, cos_l, 0.0);
    let local = Matrix3::from_columns(&[north, east, north.cross(&east)]);
    let [yaw, pitch, roll] = ANGLES.map(f64::to_radians);
    let turn = |axis, angle| Rotation3::from_axis_angle(&axis, angle);
    let body = turn(Vector3::z_axis(), yaw)
        * turn(Vector3::y_axis(), pitch)
        * turn(Vector3::x_axis(), roll + TAU * spin_hz * t_s);
    ecef_m(PLACE) + local * (body * (Vector3::from(arm) + Vector3::new(0.3, -0.2, 0.1)))
}

fn true_s(sample: u64) -> f64 {
    (sample as f64 / RATE_HZ - CLOCK.0) / (1.0 + CLOCK.1)
}

/// Cycles from a satellite or an emitter to an element, without whole ones of a common number.
fn away_cycles(from_m: impl Fn(f64) -> Vector3<f64>, to_m: &Vector3<f64>, carrier_hz: f64) -> f64 {
    let range_m = (0..8).fold(2e7, |range_m, _| (from_m(range_m / C_MPS) - to_m).norm());
    range_m * carrier_hz / C_MPS
}

#[test]
fn carriers_of_satellites_differ_between_elements_by_the_geometry() {
    for spin_hz in [0.0, 3.0] {
        let scenes = scenes(&text(spin_hz, IDEAL, "", ""));
        assert_eq!(scenes.len(), 4);
        let mut found: Vec<BTreeMap<(u64, Sv), f64>> = Vec::new();
        let samples: Vec<u64> = (0..9).map(|k| 5000 + 77_777 * k).collect();
        for scene in &scenes {
            let mut own = BTreeMap::new();
            for mut one in transmitters(scene, Edge::Nearest).unwrap() {
                one.prepare_alone(scene, 0, scene.samples).unwrap();
                for n in &samples {
                    if let Some((turns, _)) = one.phases(scene, *n) {
                        own.insert((*n, one.sv), turns as f64 / 18_446_744_073_709_551_616.0);
                    }
                }
            }
            found.push(own);
        }
        let start = scenes[0].clock.start;
        let mut checked = 0;
        for ((sample, sv), first) in &found[0] {
            let t_s = true_s(*sample);
            let set = scenes[0].catalogue.sent_at(*sv, start).unwrap();
            let sent_m = |travel_s: f64| {
                let later = Rotation3::from_axis_angle(&Vector3::z_axis(), -EARTH_RADPS * travel_s);
                later * satellite_m(set, start.since(set.toe) + t_s - travel_s)
            };
            let away = |k: usize| away_cycles(sent_m, &element_m(ARMS_M[k], spin_hz, t_s), L1_HZ);
            for (k, element) in found.iter().enumerate().skip(1) {
                let off = element[&(*sample, *sv)] - first + (away(k) - away(0));
                assert!((off - off.round()).abs() < 1e-4, "{spin_hz} Hz, {sample} {sv} {k}: {off}");
                checked += 1;
            }
        }
        assert!(checked >= 7 * 9 * 3, "{checked}");
    }
}

/// Emitter's wave in the samples of an element.
fn received(scene: &Scene, start: u64, samples: usize) -> Vec<Complex64> {
    let (mut i, mut q) = (vec![0.0; samples], vec![0.0; samples]);
    scene.interference[0].act(&mut Block::whole(start, &mut i, &mut q));
    i.iter().zip(&q).map(|(i, q)| Complex64::new(f64::from(*i), f64::from(*q))).collect()
}

#[test]
fn a_carrier_of_an_emitter_has_the_phase_of_its_path_at_every_element() {
    for spin_hz in [0.0, 3.0] {
        let text = text(spin_hz, IDEAL, "", "kind = \"cw\"\noffset_hz = 123456");
        let carrier_hz = L1_HZ + 123_456.0;
        for (scene, arm) in scenes(&text).iter().zip(ARMS_M) {
            for start in [8192_u64, 100 * 4096] {
                for (k, wave) in received(scene, start, 4096).iter().enumerate().step_by(371) {
                    let sample = start + k as u64;
                    let to_m = element_m(arm, spin_hz, true_s(sample));
                    // The Earth turns under the wave.
                    let sent_m = |travel_s: f64| {
                        Rotation3::from_axis_angle(&Vector3::z_axis(), -EARTH_RADPS * travel_s) * ecef_m(EMITTER)
                    };
                    let sent_s = true_s(sample) - away_cycles(sent_m, &to_m, 1.0);
                    let cycles = carrier_hz * sent_s - L1_HZ * sample as f64 / RATE_HZ;
                    let off = wave.arg() / TAU - cycles;
                    assert!((off - off.round()).abs() < 1e-4, "{spin_hz} Hz, {sample} {arm:?}: {off}");
                }
            }
        }
    }
}

#[test]
fn a_shared_wave_is_the_one_that_each_element_would_make_itself() {
    for spin_hz in [0.0, 3.0] {
        let text = text(spin_hz, IDEAL, "", "kind = \"noise\"\nbandwidth_hz = 2e6");
        for (number, mut scene) in scenes(&text).into_iter().enumerate() {
            let shared = received(&scene, 8192, 8192);
            assert!(scene.interference[0].shared.take().is_some());
            let own = received(&scene, 8192, 8192);
            let size: f64 = own.iter().map(Complex64::norm_sqr).sum();
            let off: f64 = own.iter().zip(&shared).map(|(a, b)| (a - b).norm_sqr()).sum();
            // The interpolator's own table is good for 94 dB, and f32 for 130.
            let off_db = 10.0 * libm::log10(off / size);
            assert!(off_db < -85.0 && size > 0.0, "{spin_hz} Hz, element {number}: {off_db} dB");
        }
    }
}

/// Coupling of four elements, in dB and degrees.
const COUPLING: [(f64, f64); 4] = [(-0.5, 10.0), (-14.0, 50.0), (-20.0, -120.0), (-25.0, 170.0)];

#[test]
fn coupled_elements_receive_sums_of_each_other_s_waves_and_channels_turn_and_delay_them() {
    let row = |k: usize| (0..4).map(move |j| COUPLING[(j + 4 - k) % 4]);
    let list = |of: fn((f64, f64)) -> f64| (0..4).flat_map(row).map(of).map(|x| format!("{x}")).collect::<Vec<_>>();
    let more = format!("coupling_db = [{}]\ncoupling_deg = [{}]", list(|x| x.0).join(","), list(|x| x.1).join(","));
    let waveform = "kind = \"cw\"\noffset_hz = 123456";
    let own = ["", "phase_deg = 40\ngain_db = -3", "delay_ns = 2.5", "gain_db = 1"];
    let plain: Vec<Vec<Complex64>> =
        scenes(&text(0.0, IDEAL, "", waveform)).iter().map(|scene| received(scene, 8192, 4096)).collect();
    let coupled = scenes(&text(0.0, own, &more, waveform));
    let delayed = -360.0 * (L1_HZ + 123_456.0) * 2.5e-9;
    let channel = [(0.0, 0.0), (-3.0, 40.0), (0.0, delayed), (1.0, 0.0)];
    let factor = |(db, deg): (f64, f64)| Complex64::from_polar(libm::pow(10.0, db / 20.0), deg.to_radians());
    for (k, scene) in coupled.iter().enumerate() {
        for (n, found) in received(scene, 8192, 4096).iter().enumerate().step_by(97) {
            let sum: Complex64 = row(k).zip(&plain).map(|(own, wave)| factor(own) * wave[n]).sum();
            let expected = factor(channel[k]) * sum;
            // Coupling is of plane waves: of an emitter 1.5 km away an arm of 0.1 m bends 3e-6 m, 1e-4 rad.
            assert!((found - expected).norm() < 3e-4 * expected.norm(), "element {k}, {n}: {found} {expected}");
        }
    }
    // What satellites get is what a far emitter gets: strength and phase against the uncoupled scene.
    let of = |scenes: &[Scene]| -> Vec<BTreeMap<Sv, (f64, f64)>> {
        let each = scenes.iter().map(|scene| {
            let seen = scene.satellites().filter_map(|sv| {
                let signal = scene.signals_of(sv).next()?;
                let seen = crate::arrival::seen(scene, sv, signal, scene.clock.epoch(9000)).unwrap()?;
                let arrival = seen.arrivals.first()?;
                (seen.emission.sight.look.elevation_rad > 0.1).then_some((sv, (arrival.carrier_cycles, arrival.cn0_hz)))
            });
            seen.collect()
        });
        each.collect()
    };
    let (plain, coupled) = (of(&scenes(&text(0.0, IDEAL, "", waveform))), of(&coupled));
    for k in 0..4 {
        for (sv, (cycles, cn0_hz)) in &coupled[k] {
            // Waves at the elements, against that at the first one.
            let wave = |j: usize| Complex64::from_polar(1.0, -TAU * (plain[j][sv].0 - plain[0][sv].0));
            let sum: Complex64 = row(k).enumerate().map(|(j, own)| factor(own) * wave(j)).sum();
            let turn = if k == 2 { -delayed / 360.0 * L1_HZ / (L1_HZ + 123_456.0) } else { 0.0 };
            let phase = if k == 1 { 40.0 / 360.0 } else { 0.0 };
            let off = cycles - plain[0][sv].0 + sum.arg() / TAU - turn + phase;
            assert!((off - off.round()).abs() < 1e-4, "{k} {sv}: {off}");
            // The antenna moves while the wave travels: 1e-6 of a cycle an element.
            assert!((cn0_hz / plain[k][sv].1 / sum.norm_sqr() - 1.0).abs() < 1e-4, "{k} {sv}");
        }
    }
}

#[test]
fn noise_is_each_element_s_own_and_its_size_follows_the_gain() {
    let text = text(0.0, ["", "gain_db = -6", "", ""], "", "").replacen("[satellites]", "", 1);
    let planes: Vec<Vec<f64>> = scenes(&text)
        .iter()
        .map(|scene| {
            let (mut i, mut q) = (vec![0.0; 65_536], vec![0.0; 65_536]);
            scene.stages(|stage| stage.act(&mut Block::whole(0, &mut i, &mut q)));
            i.iter().map(|x| f64::from(*x)).collect()
        })
        .collect();
    let product = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>() / a.len() as f64;
    let sizes: Vec<f64> = planes.iter().map(|plane| product(plane, plane).sqrt()).collect();
    // 512 LSB, of 65536 samples within 5 of 0.28 %.
    for (size, gain) in sizes.iter().zip([1.0, libm::pow(10.0, -0.3), 1.0, 1.0]) {
        assert!((size / (512.0 * gain) - 1.0).abs() < 0.014, "{size}");
    }
    for (a, b) in [(0, 1), (0, 2), (2, 3)] {
        let correlation = product(&planes[a], &planes[b]) / sizes[a] / sizes[b];
        assert!(correlation.abs() < 5.0 / 256.0, "{correlation}");
    }
}

#[test]
fn an_element_alone_has_the_bytes_that_it_has_among_others() {
    let text = text(0.0, ["", "phase_deg = 5", "", ""], "", "kind = \"noise\"\nbandwidth_hz = 1e6");
    let all = scenes(&text);
    let (mut together, mut packed) = (vec![Vec::new(); 4], Vec::new());
    let mut fronts = Fronts::new(&all, &mut (), &Options::default()).unwrap();
    let mut sink = |number: usize, bytes: &[u8]| {
        together[number].extend_from_slice(bytes);
        Ok(())
    };
    while fronts.next(&mut (), &mut packed, &mut sink).unwrap() {}
    fronts.finish(&mut ()).unwrap();
    let scenario = Scenario::parse(&text, "array").unwrap();
    for (name, together) in ["e1", "e2", "e3", "e4"].iter().zip(&together) {
        let scene = scenario.with_front_end(name).unwrap().compose(Path::new("."), &Overrides::default()).unwrap().0;
        let mut alone = Vec::new();
        crate::stream::generate_with(&scene, &mut alone, &mut (), &mut |_| (), &Options::default()).unwrap();
        assert!(alone == *together && !alone.is_empty(), "{name}");
    }
    assert_ne!(together[0], together[1]);
}

#[test]
fn what_an_array_cannot_have_is_refused_by_name() {
    let whole = text(0.0, IDEAL, "", "kind = \"cw\"\noffset_hz = 1000");
    let refused = |text: &str| {
        let scenario = Scenario::parse(text, "array");
        let composed = scenario.and_then(|one| one.compose_all(Path::new("."), &Overrides::default()).map(|_| ()));
        composed.unwrap_err().to_string()
    };
    let many: String = (0..13).map(|k| format!("[[array.element]]\nlever_arm_m = [{k}, 0, 0]\n")).collect();
    let placed =
        format!("latitude_deg = {}\nlongitude_deg = {}\nheight_m = {:?}\n", EMITTER[0], EMITTER[1], EMITTER[2]);
    let placed = placed.replace("180.0", "180");
    let spoofer = format!("[[spoofer]]\npower_db = 3\n[spoofer.transmitter]\n{placed}");
    let rows = |own: &str, other: &str| {
        let entry = |k| if k % 5 == 0 { own } else { other };
        (0..16).map(entry).collect::<Vec<_>>().join(", ")
    };
    let coupling = format!("coupling_db = [{}]\ncoupling_deg = [{}]\n", rows("0", "-20"), rows("0", "0"));
    for (text, expected) in [
        (format!("{whole}{many}"), "1 to 16 elements, not 17"),
        (whole.replacen("[attitude]", "[x]", 1), "unknown key 'x'"),
        (whole.replacen("[array]\n", "[array]\ncoupling_db = [0]\n", 1), "array.coupling_deg"),
        (
            whole.replacen("[array]\n", "[array]\ncoupling_db = [0]\ncoupling_deg = [0]\n", 1),
            "16 numbers, a row of 4 for each of 4 elements",
        ),
        (
            whole.replacen("[array]\n", &format!("[array]\ncoupling_db = {0:?}\ncoupling_deg = {0:?}\n", [0.0; 16]), 1),
            "row 1 with less beside its diagonal",
        ),
        (whole.replacen("[front_end]\n", "[front_end]\nname = \"x\"\n", 1), "no name beside [array]"),
        (whole.replacen("[[array.element]]\n", "[[array.element]]\nname = \"E2\"\n", 1), "that no other element has"),
        (whole.replacen(&placed, "", 1).replacen("eirp_dbw = -20", "power_dbw = -120", 1), "write its position"),
        (format!("{whole}[[spoofer]]\npower_db = 3\n"), "write its position ([spoofer.transmitter]"),
        (
            whole.replacen("[array]\n", &format!("[array]\n{coupling}"), 1) + &spoofer,
            "expected elements without coupling_db",
        ),
        (whole.split("[array]").next().unwrap().to_owned() + &spoofer, "nothing without [array]"),
        (format!("{whole}[fidelity]\nlevel = \"correlations\"\n"), "correlations beside [array]"),
    ] {
        let error = refused(&text);
        assert!(error.contains(expected), "{expected}: {error}");
    }
}
