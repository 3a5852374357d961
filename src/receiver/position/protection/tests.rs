//! Laws of the levels of a fix, by geometry that the other tests of positions have.

use super::*;
use crate::position::least_squares::{self, Corrections};
use crate::position::tests::{SKY, noise, place, ranges};

const BARE: Corrections = Corrections { ionosphere: Ionosphere::Absent, troposphere: false, model_sigma_m: 0.1 };

/// A fix without an exclusion.
fn fix() -> Fix {
    let names = "sample,gps_s,gps_fraction_s,x_m,y_m,z_m,vx_mps,vy_mps,vz_mps,clock_bias_s,clock_drift,sigma_east_m,\
                 sigma_north_m,sigma_up_m,sigma_clock_m,correlation_en,correlation_eu,correlation_nu,gdop,pdop,hdop,\
                 vdop,tdop,condition,satellites,chi_square,excluded,ionosphere,ranges,clocks,time_scale";
    let text = format!("{names}\n{},8,0,,none,8,1,GPST\n", ["0"; 24].join(","));
    csv::Reader::from_reader(text.as_bytes()).deserialize().next().unwrap().unwrap()
}

fn row(all: &[Range], settings: &IntegritySettings) -> (IntegrityRow, Solution) {
    let solution = least_squares::position(all, place().to_ecef(), &BARE).unwrap();
    let (ionosphere, store) = (&BARE.ionosphere, None);
    let fixed = Fixed { ranges: all, solution: &solution, fix: &fix(), ionosphere, store, false_alarm: 1e-3 };
    (fixed.protect(settings), solution)
}

#[test]
fn the_estimator_of_a_fix_has_the_covariance_of_its_solution() {
    let all = ranges(&SKY, 1e-4);
    let solution = least_squares::position(&all, place().to_ecef(), &BARE).unwrap();
    let (ionosphere, store) = (&BARE.ionosphere, None);
    let fixed = Fixed { ranges: &all, solution: &solution, fix: &fix(), ionosphere, store, false_alarm: 1e-3 };
    let geometry = fixed.geometry();
    let sigmas_m = geometry.of_all().unwrap().sigmas_m(&geometry.weighting);
    let axes = place().ecef_to_enu();
    let block = solution.covariance.fixed_view::<3, 3>(0, 0).into_owned();
    let expected = axes * block * axes.transpose();
    for axis in 0..3 {
        assert!((sigmas_m[axis] - expected[(axis, axis)].sqrt()).abs() < 1e-6, "{axis}");
    }
}

#[test]
fn levels_are_above_many_deviations_and_a_receiver_of_one_constellation_needs_a_promise_for_it() {
    let all = ranges(&SKY, 1e-4);
    let one = IntegritySettings { p_const: 1e-8, ..IntegritySettings::default() };
    for method in [Method::Araim, Method::Raim] {
        let (found, solution) = row(&all, &IntegritySettings { method, ..one.clone() });
        let axes = place().ecef_to_enu();
        let block = solution.covariance.fixed_view::<3, 3>(0, 0).into_owned();
        let up_m = (axes * block * axes.transpose())[(2, 2)].sqrt();
        assert!(found.vpl_m.unwrap() > 5.3 * up_m, "{found:?}");
        assert!(found.hpl_m.is_some() && found.sigma_v_acc_m.is_some() && !found.detected);
        assert_eq!(found.emt_m.is_some(), method == Method::Araim);
    }
    let (refused, _) = row(&all, &IntegritySettings::default());
    assert!(!refused.available && refused.hpl_m.is_none() && refused.reason.contains("unmonitored"), "{refused:?}");
}

#[test]
fn limits_of_an_operation_take_a_fix_away_and_name_the_first_that_is_broken() {
    let all = ranges(&SKY, 1e-4);
    let wide = IntegritySettings {
        p_const: 1e-8,
        hal_m: 1e3,
        val_m: 1e3,
        emt_limit_m: 1e3,
        sigma_v_acc_limit_m: 1e3,
        ..IntegritySettings::default()
    };
    assert!(row(&all, &wide).0.available);
    for (settings, reason) in [
        (IntegritySettings { hal_m: 1.0, val_m: 1.0, ..wide.clone() }, "HPL above its limit"),
        (IntegritySettings { val_m: 1.0, ..wide.clone() }, "VPL above its limit"),
        (IntegritySettings { emt_limit_m: 0.1, ..wide.clone() }, "EMT above its limit"),
        (IntegritySettings { sigma_v_acc_limit_m: 0.1, ..wide.clone() }, "vertical accuracy above its limit"),
        (IntegritySettings { method: Method::Sbas, ..wide.clone() }, "no SBAS corrections of G01"),
    ] {
        let (found, _) = row(&all, &settings);
        assert!(!found.available && found.reason == reason, "{found:?}");
    }
}

/// Errors of 2000 fixes with one range wrong by what is just detected or not, against the levels of each.
#[test]
fn errors_of_fixes_whose_fault_no_test_shows_stay_within_the_levels() {
    let settings = IntegritySettings { p_const: 1e-8, b_nom_m: 0.0, sigma_ura_m: 0.0, ..IntegritySettings::default() };
    let (mut state, mut unseen, mut beyond) = (7, 0, 0);
    for trial in 0..600_usize {
        let mut all = ranges(&SKY, 1e-4);
        for range in &mut all {
            range.pseudorange_m += noise(&mut state);
        }
        let faulty = trial % all.len();
        all[faulty].pseudorange_m += 0.05 * trial as f64;
        let (found, solution) = row(&all, &settings);
        if found.detected {
            continue;
        }
        unseen += 1;
        let enu = place().ecef_to_enu() * (solution.position_m - place().to_ecef());
        let within = libm::hypot(enu.x, enu.y) <= found.hpl_m.unwrap() && enu.z.abs() <= found.vpl_m.unwrap();
        beyond += usize::from(!within);
    }
    assert!(unseen > 50 && beyond == 0, "{unseen} {beyond}");
}
