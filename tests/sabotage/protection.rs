//! Planted protection levels: a share of the right ones, one that an error exceeds, and fixes without any.

use std::fmt::Write;

use gnss::earth::Geodetic;
use nalgebra::Vector3;

use crate::Kind;
use crate::fixes::kind;
use crate::run::{Rx, Scene};

const FLAT: [&str; 1] = ["horizontal errors beyond their protection level, at least"];
const UP: [&str; 1] = ["vertical errors beyond their protection level, at least"];
const NONE: [&str; 1] = ["fixes without protection levels"];

/// Adds levels of the fixes: `of` makes horizontal and vertical ones of their errors; none, no row.
fn plant(rx: &mut Rx, of: impl Fn(usize, [f64; 2]) -> Option<[f64; 2]>) {
    let promise = serde_json::json!({
        "method": "araim", "phmi_vertical": 9.8e-8, "phmi_horizontal": 2e-9, "hal_m": 40.0, "val_m": 35.0
    });
    rx.receiver()["settings"]["integrity"] = promise;
    let truth = rx.truth("trajectory");
    let true_m = Vector3::from(["x_m", "y_m", "z_m"].map(|axis| truth.get(0, axis)));
    let axes = Geodetic::from_ecef(&true_m).ecef_to_enu();
    let mut text = "sample,gps_s,gps_fraction_s,method,hpl_m,vpl_m,emt_m,sigma_v_acc_m,satellites,detected,excluded,\
                    available,reason\n"
        .to_owned();
    let fixes = rx.table("fixes");
    for row in 0..fixes.rows.len() {
        let enu_m = axes * (Vector3::from(["x_m", "y_m", "z_m"].map(|axis| fixes.get(row, axis))) - true_m);
        let errors_m = [libm::hypot(enu_m.x, enu_m.y), enu_m.z.abs()];
        if let Some([hpl_m, vpl_m]) = of(row, errors_m) {
            let sample = fixes.text(row, "sample");
            writeln!(text, "{sample},0,0,araim,{hpl_m},{vpl_m},,,8,false,,true,").unwrap();
        }
    }
    rx.add("integrity.csv", &text);
}

pub fn kinds() -> Vec<Kind> {
    vec![
        kind!("protection levels as a share of the errors", "times", Some(1.5), 0.5, &FLAT, AtRest, |rx, share| {
            plant(rx, |_, errors_m| Some(errors_m.map(|error_m| share * error_m + 1e-3)));
        }),
        kind!("one vertical level as a share of its error", "times", Some(2.0), 0.5, &UP, AtRest, |rx, share| {
            plant(rx, |row, [_, up_m]| Some([10.0, if row == 100 { share * up_m } else { 15.0 }]));
        }),
        kind!("fixes without protection levels", "fixes", Some(0.0), 3.0, &NONE, AtRest, |rx, count| {
            plant(rx, |row, _| (row >= count as usize).then_some([10.0, 15.0]));
        }),
    ]
}
