//! Attitudes from the sums of elements: against the rotation that made them, with the scatter that is stated.

use std::collections::BTreeMap;
use std::f64::consts::TAU;

use nalgebra::{DMatrix, DVector, Rotation3, Vector3};
use num_complex::Complex64;

use super::compass::{Compared, Compass};
use super::tests::Random;
use crate::settings::array::ArraySettings;
use crate::threshold::threshold;
use gnss::gps::l1ca::L1_CA;
use gnss::satellite::{Sv, System};
use gnss::signal::Link;
use gnss::time::Rate;

const WAVE_M: f64 = 299_792_458.0 / 1_575.42e6;
/// Azimuths and elevations of a sky.
const SKY_DEG: [(f64, f64); 8] = [
    (12.0, 65.0),
    (48.0, 21.0),
    (95.0, 44.0),
    (140.0, 12.0),
    (188.0, 37.0),
    (231.0, 70.0),
    (279.0, 18.0),
    (330.0, 33.0),
];
/// Sums of an interval, and signal to noise of one element's sum: 45 dB-Hz in a millisecond.
const PERIODS: u32 = 200;
const RATIO: f64 = 31.6;

/// A triangle and three more elements, of that size.
fn places(size_m: f64) -> Vec<[f64; 3]> {
    [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.4, 0.9, 0.0], [-0.5, 0.6, 0.1], [-0.7, -0.4, 0.0], [0.3, -0.8, 0.05]]
        .map(|place| place.map(|x| size_m * x))
        .to_vec()
}

fn towards((azimuth_deg, elevation_deg): (f64, f64)) -> Vector3<f64> {
    let (sin_a, cos_a) = libm::sincos(azimuth_deg.to_radians());
    let (sin_e, cos_e) = libm::sincos(elevation_deg.to_radians());
    Vector3::new(cos_e * sin_a, cos_e * cos_a, sin_e)
}

/// A body, the phases of its channels, and where its waves come from.
struct Body<'a> {
    places: &'a [[f64; 3]],
    /// Rotation from the body's axes to east, north and up.
    rotation: Rotation3<f64>,
    channels_rad: &'a [f64],
    /// Direction from which each wave comes in truth.
    from: &'a dyn Fn(usize) -> Vector3<f64>,
    /// Power over noise of a jammer in the east.
    jammer: f64,
    is_inverted: bool,
}

impl Body<'_> {
    fn answer(&self, towards: &Vector3<f64>) -> DVector<Complex64> {
        let each = self.places.iter().zip(self.channels_rad).map(|(place, own_rad)| {
            let ahead_m = towards.dot(&(self.rotation * Vector3::from(*place)));
            Complex64::from_polar(1.0, TAU * ahead_m / WAVE_M + own_rad)
        });
        DVector::from_iterator(self.places.len(), each)
    }

    /// Result of an interval with so many satellites.
    fn compared(&self, compass: &mut Compass, satellites: usize, random: &mut Random) -> Compared {
        let count = self.places.len();
        let jammed = self.answer(&towards((90.0, 5.0)));
        let noise = DMatrix::identity(count, count) + &jammed * jammed.adjoint() * Complex64::from(self.jammer);
        let mut sky = BTreeMap::new();
        for (number, place) in SKY_DEG.iter().enumerate().take(satellites) {
            let sv = Sv { system: System::Gps, number: number as u8 + 1 };
            sky.insert(sv, towards(*place));
            let answer = self.answer(&(self.from)(number)) * Complex64::from(RATIO.sqrt());
            for _ in 0..PERIODS {
                let bit = if random.uniform() < 0.5 { -1.0 } else { 1.0 };
                let loud = random.complex() * self.jammer.sqrt();
                let own = DVector::from_fn(count, |_, _| random.complex());
                let sums = &answer * Complex64::from(bit) + &jammed * loud + own;
                let sums = if self.is_inverted { sums.map(|x| x.conj()) } else { sums };
                let noise = if self.is_inverted { noise.map(|x| x.conj()) } else { noise.clone() };
                compass.take(Link { sv, signal: &L1_CA }, &sums, &noise);
            }
        }
        compass.close(200_000, &sky)
    }
}

fn compass(places: &[[f64; 3]], phase_sigma_deg: f64, is_inverted: bool) -> Compass {
    let settings =
        ArraySettings { lever_arms_m: places.to_vec(), attitude_ms: 200, phase_sigma_deg, ..ArraySettings::default() };
    settings.validate().unwrap();
    Compass::new(&settings, Rate::MEGAHERTZ, is_inverted).unwrap()
}

const CHANNELS_RAD: [f64; 6] = [0.3, 2.0, -1.1, 0.0, 3.0, -2.4];

/// Any attitude is found, by arms of half a wavelength, of six and of ten, with channels of any phase;
/// errors scatter as stated, and the residuals are chi-square.
#[test]
fn any_attitude_is_found_with_the_deviations_that_are_stated() {
    for (size_m, seed) in [(0.5 * WAVE_M, 1), (6.3 * WAVE_M, 2), (10.5 * WAVE_M, 3)] {
        let (places, mut random) = (places(size_m), Random(seed));
        let (mut squares, mut phases, mut chi, mut freedom) = (0.0, 0.0, 0.0, 0);
        let draws = 60;
        for draw in 0..draws {
            let [yaw, pitch, roll] = [TAU, 2.4, TAU].map(|span| span * (random.uniform() - 0.5));
            let rotation = Rotation3::from_euler_angles(roll, pitch, yaw);
            let is_inverted = draw % 2 == 1;
            let from = |number: usize| towards(SKY_DEG[number]);
            let body =
                Body { places: &places, rotation, channels_rad: &CHANNELS_RAD, from: &from, jammer: 0.0, is_inverted };
            let found = body.compared(&mut compass(&places, 0.0, is_inverted), 8, &mut random);
            let row = found.attitude.unwrap();
            let [nose, right, down] = [Vector3::x(), Vector3::y(), Vector3::z()].map(|axis| rotation * axis);
            let yaw_deg = libm::atan2(nose.x, nose.y).to_degrees();
            let error_deg = [
                (row.yaw_deg - yaw_deg + 540.0).rem_euclid(360.0) - 180.0,
                row.pitch_deg - libm::asin(nose.z).to_degrees(),
                (row.roll_deg - libm::atan2(-right.z, -down.z).to_degrees() + 540.0).rem_euclid(360.0) - 180.0,
            ];
            // A level body's yaw turns about the upward axis; others mix the three.
            let sigma_deg =
                (row.sigma_east_deg.powi(2) + row.sigma_north_deg.powi(2) + row.sigma_up_deg.powi(2)).sqrt();
            let size = error_deg.iter().map(|x| x * x).sum::<f64>().sqrt() * libm::cos(row.pitch_deg.to_radians());
            assert!(size < 6.0 * sigma_deg, "{error_deg:?} for {sigma_deg}");
            squares += (error_deg[1] * error_deg[1]) / (sigma_deg * sigma_deg / 3.0);
            for element in &found.elements {
                let own_deg = (CHANNELS_RAD[element.element - 1] - CHANNELS_RAD[0]).to_degrees();
                let off_deg = (element.phase_deg - own_deg + 540.0).rem_euclid(360.0) - 180.0;
                phases += (off_deg / element.sigma_deg).powi(2);
            }
            (chi, freedom) = (chi + row.chi_square, freedom + row.freedom);
        }
        let draws = f64::from(draws);
        // 60 draws know a mean square to 18 %, its share of the three axes to less; 300 phases, five of each
        // draw's alike, to 10 %; 1900 residuals to 3 %.
        assert!((squares / draws - 1.0).abs() < 0.6, "pitch: {}", squares / draws);
        assert!((phases / (5.0 * draws) - 1.0).abs() < 0.35, "phases: {}", phases / (5.0 * draws));
        assert!((chi / freedom as f64 - 1.0).abs() < 0.1, "residuals: {}", chi / freedom as f64);
    }
}

/// Waves of one direction, as a spoofer's are, or of two, fit no rotation. A clean sky alarms as often as
/// stated.
#[test]
fn signals_that_come_from_one_direction_fit_no_attitude() {
    let (places, mut random) = (places(0.5 * WAVE_M), Random(7));
    let rotation = Rotation3::from_euler_angles(0.1, -0.2, 1.0);
    let channels_rad = &CHANNELS_RAD;
    let mut alarms = [0, 0, 0];
    for draw in 0..60 {
        let spoofer = towards((f64::from(draw) * 6.0, 8.0));
        let all = |_: usize| spoofer;
        let half = |number: usize| if number < 4 { spoofer } else { towards(SKY_DEG[number]) };
        let clean = |number: usize| towards(SKY_DEG[number]);
        let sources: [&dyn Fn(usize) -> Vector3<f64>; 3] = [&all, &half, &clean];
        for (from, alarms) in sources.into_iter().zip(&mut alarms) {
            let body = Body { places: &places, rotation, channels_rad, from, jammer: 0.0, is_inverted: false };
            let found = body.compared(&mut compass(&places, 2.0, false), 8, &mut random);
            let (statistic, freedom) = found.tested.unwrap();
            *alarms += i32::from(statistic > threshold(1e-3, freedom as u32));
        }
    }
    assert_eq!(alarms, [60, 60, 0]);
}

/// A jammer 20 dB above the noise is taken off; one of 50 dB leaves nothing to compare, and no false
/// attitude.
#[test]
fn a_jammer_makes_no_attitude_of_its_own() {
    let (places, mut random) = (places(0.5 * WAVE_M), Random(11));
    let rotation = Rotation3::from_euler_angles(0.0, 0.0, 0.7);
    let from = |number: usize| towards(SKY_DEG[number]);
    for (jammer, is_found) in [(10.0, true), (1e5, false)] {
        let body =
            Body { places: &places, rotation, channels_rad: &CHANNELS_RAD, from: &from, jammer, is_inverted: false };
        let found = body.compared(&mut compass(&places, 2.0, false), 8, &mut random);
        assert_eq!(found.attitude.is_some(), is_found, "{jammer}: {found:?}");
        let nose = rotation * Vector3::x();
        if let Some(row) = &found.attitude {
            let off_deg = (row.yaw_deg - libm::atan2(nose.x, nose.y).to_degrees() + 540.0).rem_euclid(360.0) - 180.0;
            assert!(off_deg.abs() < 4.0, "{row:?}");
        }
    }
}

#[test]
fn too_few_satellites_or_elements_in_a_line_give_no_attitude() {
    let (places, mut random) = (places(0.5 * WAVE_M), Random(5));
    let from = |number: usize| towards(SKY_DEG[number]);
    let rotation = Rotation3::identity();
    let body =
        Body { places: &places, rotation, channels_rad: &CHANNELS_RAD, from: &from, jammer: 0.0, is_inverted: false };
    let found = body.compared(&mut compass(&places, 2.0, false), 1, &mut random);
    assert!(found.attitude.is_none() && found.tested.is_none());
    let line = vec![[0.0; 3], [0.1, 0.0, 0.0], [0.3, 0.0, 0.0]];
    let settings = ArraySettings { lever_arms_m: line, attitude_ms: 200, ..ArraySettings::default() };
    let (key, _, expected) = settings.validate().unwrap_err();
    assert!(key == "array.lever_arms_m" && expected.contains("not in a line"), "{expected}");
}
