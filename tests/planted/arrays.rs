//! Elements of an array: the phases that the generator gives them, and those by which the receiver steers.

use std::f64::consts::TAU;
use std::path::Path;

use generator::arrival::seen;
use generator::scenario::{Overrides, Scenario};
use gnss::gps::l1ca::L1_CA;
use nalgebra::Vector3;
use receiver::array::weights::steering;

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
