//! Elements of an array: the phases that the generator gives them, and those by which the receiver steers.

use std::collections::BTreeMap;
use std::f64::consts::TAU;
use std::path::Path;

use generator::arrival::{seen, seen_from};
use generator::scenario::{Overrides, Scenario};
use gnss::earth::Geodetic;
use gnss::gps::l1ca::L1_CA;
use gnss::satellite::{Sv, System};
use gnss::signal::Link;
use gnss::time::Rate;
use nalgebra::{DMatrix, DVector, Vector3};
use num_complex::Complex64;
use receiver::array::compass::Compass;
use receiver::array::weights::steering;
use receiver::settings::array::ArraySettings;

const ARMS_M: [[f64; 3]; 3] = [[0.0, 0.0, 0.0], [0.09, 0.02, 0.0], [-0.03, 0.08, -0.05]];
/// Errors of the channels, in degrees.
const ERRORS_DEG: [f64; 3] = [0.0, 70.0, -110.0];

#[test]
fn satellites_reach_the_elements_with_the_phases_by_which_the_receiver_steers() {
    let element =
        |(arm, error): (&[f64; 3], &f64)| format!("[[array.element]]\nlever_arm_m = {arm:?}\nphase_deg = {error}\n");
    let elements: String = ARMS_M.iter().zip(&ERRORS_DEG).map(element).collect();
    let text = format!(
        "name = \"array\"\nstart = 2010-07-01T08:12:30\nduration_s = 1\n[motion]\nkind = \"static\"\n\
         latitude_deg = 48.1\nlongitude_deg = 11.6\nheight_m = 520\n[attitude]\nkind = \"fixed\"\n[array]\n{elements}"
    );
    let scenario = Scenario::parse(&text, "array").unwrap();
    let (scenes, _) = scenario.compose_all(Path::new("."), &Overrides::default()).unwrap();
    let mut checked = 0;
    for sv in scenes[0].satellites() {
        let found = scenes.iter().map(|scene| seen(scene, sv, &L1_CA, scene.clock.epoch(4000)).unwrap());
        let Some(found) = found.collect::<Option<Vec<_>>>() else { continue };
        let look = found[0].emission.sight.look;
        if look.elevation_rad < 0.1 {
            continue;
        }
        // Nose to the north, right side to the east.
        let ((sin_a, cos_a), (sin_e, cos_e)) = (libm::sincos(look.azimuth_rad), libm::sincos(look.elevation_rad));
        let steered = steering(&ARMS_M, &Vector3::new(cos_e * cos_a, cos_e * sin_a, -sin_e), L1_CA.centre_hz());
        for (k, own) in found.iter().enumerate() {
            let ahead = found[0].arrivals[0].carrier_cycles - own.arrivals[0].carrier_cycles;
            let expected = libm::atan2(steered[k].im, steered[k].re) / TAU + ERRORS_DEG[k] / 360.0;
            let off = ahead - expected;
            // The antenna moves with the Earth while the wave travels: 1.5e-6 of a cycle.
            assert!((off - off.round()).abs() < 1e-5, "{sv}, element {k}: {off}");
            checked += 1;
        }
    }
    assert!(checked >= 15, "{checked}");
}

/// All signals of a spoofer are as much ahead in an element as it is nearer to the transmitter, whichever
/// satellites they imitate; the first element receives them as without a transmitter.
#[test]
fn a_spoofer_reaches_the_elements_from_its_own_direction() {
    let element = |arm: &[f64; 3]| format!("[[array.element]]\nlever_arm_m = {arm:?}\n");
    let elements: String = ARMS_M.iter().map(element).collect();
    let text = format!(
        "name = \"array\"\nstart = 2010-07-01T08:12:30\nduration_s = 1\n[motion]\nkind = \"static\"\n\
         latitude_deg = 48.1\nlongitude_deg = 11.6\nheight_m = 520\n[attitude]\nkind = \"fixed\"\n[array]\n{elements}\
         [[spoofer]]\npower_db = 6\n[spoofer.transmitter]\nlatitude_deg = 48.1007\nlongitude_deg = 11.5988\nheight_m = 540\n"
    );
    let scenario = Scenario::parse(&text, "array").unwrap();
    let (scenes, _) = scenario.compose_all(Path::new("."), &Overrides::default()).unwrap();
    let transmitter_m = Geodetic::from_degrees(48.1007, 11.5988, 540.0).to_ecef();
    let here = Geodetic::from_degrees(48.1, 11.6, 520.0);
    // Nose to the north, right side to the east.
    let axes = here.ecef_to_enu().transpose();
    let place_m = |[nose, right, down]: [f64; 3]| here.to_ecef() + axes * Vector3::new(right, nose, -down);
    let mut checked = 0;
    for sv in scenes[0].satellites() {
        let at = |scene: &generator::scene::Scene| {
            seen_from(scene, &scene.spoofers[0], sv, &L1_CA, scene.clock.epoch(4000)).unwrap()
        };
        let Some(found) = scenes.iter().map(at).collect::<Option<Vec<_>>>() else { continue };
        let truth = seen(&scenes[0], sv, &L1_CA, scenes[0].clock.epoch(4000)).unwrap().unwrap();
        assert_eq!(found[0].arrivals[0].carrier_cycles, truth.arrivals[0].carrier_cycles, "{sv}");
        for (arm, own) in ARMS_M.iter().zip(&found) {
            let behind_m = (place_m(*arm) - transmitter_m).norm() - (place_m(ARMS_M[0]) - transmitter_m).norm();
            let cycles = own.arrivals[0].carrier_cycles - found[0].arrivals[0].carrier_cycles;
            let expected = behind_m * L1_CA.centre_hz() / 299_792_458.0;
            assert!((cycles - expected).abs() < 1e-5, "{sv}, {arm:?}: {cycles} for {expected}");
            let delay_m = 299_792_458.0 * (own.arrivals[0].delay_s - found[0].arrivals[0].delay_s);
            assert!((delay_m - behind_m).abs() < 1e-6, "{sv}, {arm:?}: {delay_m} m for {behind_m}");
            checked += 1;
        }
    }
    assert!(checked >= 15, "{checked}");
}

/// Elements turned by 40 degrees to the east, whose sums have the phases of plane waves.
#[test]
fn an_attitude_is_that_of_the_body_whose_elements_were_turned() {
    let settings = ArraySettings { lever_arms_m: ARMS_M.to_vec(), attitude_ms: 100, ..ArraySettings::default() };
    let mut compass = Compass::new(&settings, Rate::MEGAHERTZ, false).unwrap();
    let (sin_y, cos_y) = libm::sincos(40_f64.to_radians());
    let mut sky = BTreeMap::new();
    for number in 1..=8_u8 {
        let (azimuth, elevation) = (0.8 * f64::from(number), 0.2 + 0.15 * f64::from(number));
        let ((sin_a, cos_a), (sin_e, cos_e)) = (libm::sincos(azimuth), libm::sincos(elevation));
        let towards = Vector3::new(sin_a * cos_e, cos_a * cos_e, sin_e);
        let answer = ARMS_M.iter().map(|[nose, right, down]| {
            let (east, north) = (sin_y * nose + cos_y * right, cos_y * nose - sin_y * right);
            let nearer_m = towards.dot(&Vector3::new(east, north, -down));
            Complex64::from_polar(10.0, TAU * nearer_m * L1_CA.centre_hz() / 299_792_458.0)
        });
        let answer = DVector::from_iterator(ARMS_M.len(), answer);
        let sv = Sv { system: System::Gps, number };
        sky.insert(sv, towards);
        let noise = DMatrix::identity(ARMS_M.len(), ARMS_M.len());
        (0..100).for_each(|_| compass.take(Link { sv, signal: &L1_CA }, &answer, &noise));
    }
    let found = compass.close(100_000, &sky).attitude.unwrap();
    let off_deg = [found.yaw_deg - 40.0, found.pitch_deg, found.roll_deg];
    assert!(off_deg.iter().all(|off| off.abs() < 1e-6), "{off_deg:?}");
}
