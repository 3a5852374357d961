//! Inertial measurements of the generator, integrated back by the judge's own strapdown integration.

use std::path::{Path, PathBuf};

use analysis::measure::inertial::Figures;
use generator::inertial::{Imu, Measurements};
use generator::scenario::{Overrides, Scenario};
use generator::scene::Scene;
use gnss::record::{BodyRow, InertialRow};

fn scenarios() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("scenarios")
}

/// A shipped scene with tables added to it.
fn scene(name: &str, added: &str) -> Scene {
    let text = std::fs::read_to_string(scenarios().join(name)).unwrap();
    let scenario = Scenario::parse(&format!("{text}\n{added}"), name).unwrap();
    scenario.compose(&scenarios(), &Overrides::default()).unwrap().0
}

/// All measurements of a scene, and the true motion every `every` of them.
fn measured(scene: &Scene, imu: &Imu, every: u64) -> (Vec<InertialRow>, Vec<BodyRow>) {
    let mut all = Measurements::new(imu, &scene.trajectory, scene.clock.start, 0.0).unwrap();
    let (mut rows, mut body) = (Vec::new(), vec![all.body()]);
    while let Some(row) = all.next(scene.elapsed_s(scene.samples)) {
        rows.push(row);
        if all.count().is_multiple_of(every) {
            body.push(all.body());
        }
    }
    (rows, body)
}

fn judged(imu: &Imu, rows: &[InertialRow], body: &[BodyRow]) -> Figures {
    let (mut own, mut truth) = (rows.iter().map(|row| Ok::<_, ()>(*row)), body.iter().map(|row| Ok(*row)));
    Figures::of_rows(&imu.facts, (0.0, rows.len()), &mut own, &mut truth).unwrap().unwrap()
}

fn integrated(name: &str, added: &str) -> Figures {
    let scene = scene(name, added);
    let imu = scene.imu.clone().unwrap();
    // A row of the truth a second.
    let (rows, body) = measured(&scene, &imu, imu.facts.rate_hz as u64);
    judged(&imu, &rows, &body)
}

const NOSE: &str = "[attitude]\nkind = \"velocity\"\nlever_arm_m = [1, 0, -1]\n";

#[test]
fn measurements_without_errors_come_back_within_a_millimetre_in_a_minute() {
    let imu = |rate_hz: u32| format!("[imu]\nrate_hz = {rate_hz}\nlever_arm_m = [0.5, 0.1, -0.2]\n");
    let mut cases = Vec::new();
    for rate_hz in [50, 100, 200, 500] {
        cases.push((rate_hz, "moderate.toml", NOSE.to_owned()));
        let pad = NOSE.replace("lever", "yaw_deg = 125\npitch_deg = 80\nlever");
        cases.push((rate_hz, "high_dynamics.toml", pad));
    }
    // 21.3 turns a second: 0.33 rad in an interval of 2.5 ms.
    cases.extend([400, 1000].map(|rate_hz| (rate_hz, "spinning.toml", String::new())));
    for (rate_hz, name, attitude) in cases {
        let found = integrated(name, &(attitude + &imu(rate_hz)));
        let (position, attitude) = (found.position_error_m.unwrap(), found.attitude_error_rad.unwrap());
        println!(
            "{name} {rate_hz} Hz: {:e} m, {:e} rad, {:.3} rad a row",
            position.value, attitude.value, found.turn_rad
        );
        // 1 mm is the promise, up to the turn at which a step of the specific force leaves more.
        assert!(found.turn_rad > 0.2 || position.limit == 1e-3, "{name} {rate_hz}: {found:?}");
        assert!(position.limit < 3e-3 && attitude.limit == 1e-7, "{name} {rate_hz}: {found:?}");
        assert!(position.value < position.limit && attitude.value < 1e-7, "{name} {rate_hz}: {found:?}");
    }
}

#[test]
fn a_wrong_measurement_does_not_come_back() {
    let scene = scene("moderate.toml", &format!("{NOSE}[imu]\nrate_hz = 100\n"));
    let imu = scene.imu.clone().unwrap();
    let (rows, body) = measured(&scene, &imu, 100);
    // 3e-6 m/s² along the nose over 60 s: up to 5.4 mm; 1e-8 rad/s about it: 6e-7 rad.
    let pushed: Vec<InertialRow> =
        rows.iter().map(|row| InertialRow { force_x_mps2: row.force_x_mps2 + 3e-6, ..*row }).collect();
    let found = judged(&imu, &pushed, &body).position_error_m.unwrap();
    assert!(found.value > found.limit, "{found:?}");
    let turned: Vec<InertialRow> =
        rows.iter().map(|row| InertialRow { rate_x_radps: row.rate_x_radps + 1e-8, ..*row }).collect();
    let found = judged(&imu, &turned, &body).attitude_error_rad.unwrap();
    assert!(found.value > found.limit, "{found:?}");
}

#[test]
fn noise_at_rest_has_the_allan_deviation_that_was_asked_for_and_drifts_within_its_sigmas() {
    let tables =
        |imu: &str| format!("[attitude]\nkind = \"fixed\"\nyaw_deg = 30\npitch_deg = 10\n[imu]\nrate_hz = 50\n{imu}\n");
    for imu in [
        "grade = \"low\"",
        "grade = \"mid\"",
        "grade = \"tactical\"\naccelerometer_bias_instability_mps2 = 3e-4",
        "rate_random_walk_deg_per_h_per_sqrt_h = 60\nangle_random_walk_deg_per_sqrt_h = 0.01\n\
         acceleration_random_walk_mps2_per_sqrt_h = 1e-3\ngyro_bias_deg_per_h = [5, 6, 7]\n\
         accelerometer_scale_factor_ppm = [900, -800, 700]\naccelerometer_misalignment_mrad = [1, 2, 3]\n\
         g_sensitivity_deg_per_h_per_g = [10, 20, 30]",
    ] {
        let text = std::fs::read_to_string(scenarios().join("static.toml")).unwrap();
        let text = text.replacen("duration_s = 60", "duration_s = 3600", 1);
        let scenario = Scenario::parse(&format!("{text}\n{}", tables(imu)), "static").unwrap();
        let scene = scenario.compose(&scenarios(), &Overrides::default()).unwrap().0;
        let unit = scene.imu.clone().unwrap();
        let (rows, body) = measured(&scene, &unit, 50);
        let found = judged(&unit, &rows, &body);
        // Limits are quantiles of the estimates' own law at one false alarm in 1e5.
        for [most, least] in [found.gyro_allan.unwrap(), found.accelerometer_allan.unwrap_or(found.gyro_allan.unwrap())]
        {
            assert!(most.value <= most.limit && least.value >= least.limit, "{imu}: {found:?}");
            // At 20 ms, 180 000 values an axis: a wrong coefficient of 5 % would show.
            assert!(most.limit < 2.0 && least.limit > -0.8, "{imu}: {found:?}");
        }
        for limited in [found.position_error_m.unwrap(), found.attitude_error_rad.unwrap()] {
            assert!(limited.value <= limited.limit, "{imu}: {found:?}");
            // A bound of 60 minutes is reached within an order: the noise is there.
            assert!(limited.value > 0.05 * limited.limit, "{imu}: {found:?}");
        }
        println!("{imu}: {found:?}");
        // Half as much noise as was asked, and twice as much, are both noticed.
        for factor in [0.5, 2.0] {
            let mut other = unit.clone();
            other.facts.gyro.random_walk *= factor;
            other.facts.gyro.bias_instability *= factor;
            other.facts.gyro.rate_walk *= factor;
            let [most, least] = judged(&other, &rows[..60_000], &body).gyro_allan.unwrap();
            assert!(most.value > most.limit || least.value < least.limit, "{imu} {factor}");
        }
    }
}
