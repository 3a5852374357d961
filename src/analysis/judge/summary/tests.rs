//! The summary of a run made by hand: it must find exactly what was planted.

use crate::hand_made::{CHIP_M, PLANTED, Planted, planted_run};
use crate::judge;
use std::fs;

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
    // Measured minus set is -0.3. Means over samples at 2.6 Msps leave 1 − d/3 of a power at the antenna, and
    // the eight others add to the noise 0.8267 chips of what is left of theirs. C/N0s are 0.225 dB above
    // their start in the middle.
    let kept = 1.0 - 1.023 / 2.6 / 3.0;
    let linear = |index: usize| libm::pow(10.0, (40.0 + 1.1 * index as f64 + 0.225) / 10.0);
    let sum: f64 = (0..9).map(linear).sum();
    let loss = |index| 10.0 * libm::log10(1.0 + kept * 0.8267 / 1.023e6 * (sum - linear(index)));
    let loss = (0..9).map(loss).sum::<f64>() / 9.0;
    near("C/N0 bias", observables.cn0_bias_db, loss - 10.0 * libm::log10(kept) - 0.3, 0.01);
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
        "scene seed duration_s sample_rate_hz fidelity satellites position clock observables tracking signals \
         navigation psd not_judged speed"
    );
    for (section, expected) in [
        ("satellites", "in_view acquired used false_acquired"),
        (
            "position",
            "fixes first_fix_s horizontal_mean_m horizontal_p95_m vertical_p95_m error_3d_p95_m bias_enu_m \
             velocity_p95_mps nees_mean nees_band nees_independent nees_verdict",
        ),
        (
            "clock",
            "fixes bias_mean_s bias_sigma_s drift true_drift oadev_1s mdev_1s ohdev_1s tdev_1s_s true_oadev_1s \
             code_noise_oadev_1s h true_h",
        ),
        ("observables", "pseudorange_rms_m pseudorange_bias_m carrier_rms_cycles doppler_rms_hz cn0_bias_db"),
        (
            "tracking",
            "losses_of_lock cycle_slips dll_sigma_chips pll_sigma_deg fll_sigma_hz slips_undeclared slip_causes \
             dll_chips pll_deg fll_hz",
        ),
        (
            "psd",
            "level_error_db shape_error_p95_db null_low_hz null_high_hz null_low_expected_hz null_high_expected_hz \
             null_reason",
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
