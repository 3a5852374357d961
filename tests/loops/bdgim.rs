//! BeiDou's own model of the ionosphere, true and broadcast: positions by one carrier are right to the noise
//! with it and metres off without it.
//!
//! Codes are measured as the truth has them, with noise added; messages are sent as symbols and read again.
#![cfg(all(feature = "generator", feature = "receiver", feature = "analysis"))]

use std::path::Path;

use generator::scenario::{Overrides, Scenario};
use generator::scene::Scene;
use generator::stream::{Fronts, Options};
use generator::truth::Record;
use gnss::beidou::b1c::B1C;
use gnss::beidou::b2a::B2A;
use gnss::beidou::b2b::B2B;
use gnss::earth::{Geodetic, SPEED_OF_LIGHT_MPS};
use gnss::ionosphere::{Coefficients, Model};
use gnss::message::Read;
use gnss::record::{IonosphereModel, Observation, TrajectoryRow};
use gnss::signal::Signal;
use gnss::time::{BDT, Epoch};
use nalgebra::Vector3;
use receiver::position::{CodeNoise, IonosphereChoice, PositionSettings, Sets, Solver, TroposphereChoice};
use receiver::track::CodeDiscriminator;
use receiver::track::loops::CodeShape;

/// The coefficients of 2026-03-09, of an active Sun: some 60 TECU at noon over Cartagena.
const COEFFICIENTS: &str = "[30.875, 0.25, 11.625, 10.375, -12.5, 0.75, 0, 3.125, 1.875]";

/// A scene of one signal, a quarter of an hour before the model's forecast changes, at its first reading.
fn scene(signal: &Signal, ionosphere: &str) -> Scene {
    let text = format!(
        "name = \"bdgim\"\nstart = 2020-11-29T11:45:10\nduration_s = 0.1\nseed = 1\nsignals = [\"{}\"]\n\
         [motion]\nkind = \"static\"\nlatitude_deg = 37.605\nlongitude_deg = -0.986\nheight_m = 60\n\
         [satellites]\nmask_deg = 8\n[power]\ncn0_dbhz = 45\n{ionosphere}\n\
         [receiver_clock]\nbias_s = 1.3e-4\ndrift_sps = 5e-8\n\
         [front_end]\ncenter_hz = {}\nsample_rate_hz = 21.3e6\n[truth]\ninterval_s = 0.05\n",
        signal.name,
        signal.centre_hz()
    );
    let scenario = Scenario::parse(&text, "bdgim").unwrap();
    scenario.compose(Path::new("."), &Overrides::default()).unwrap().0
}

/// The first reading of the truth: where the receiver is, and what it would observe.
fn truth(scene: &Scene) -> (TrajectoryRow, Vec<Observation>) {
    let mut records: Vec<Record> = Vec::new();
    let (mut packed, mut sink) = (Vec::new(), |_: usize, _: &[u8]| Ok(()));
    let mut fronts = Fronts::new(std::slice::from_ref(scene), &mut records, &Options::default()).unwrap();
    while fronts.next(&mut records, &mut packed, &mut sink).unwrap() {}
    fronts.finish(&mut records).unwrap();
    let place = records.iter().find_map(|one| if let Record::Trajectory(row) = one { Some(row.clone()) } else { None });
    let place = place.unwrap();
    let rows = records.into_iter().filter_map(|one| if let Record::Observation(row) = one { Some(row) } else { None });
    let rows = rows.filter(|row| row.sample == place.sample).collect();
    (place, rows)
}

/// Ephemerides and ionospheric coefficients that a receiver reads from the messages of the observed
/// satellites.
fn heard(scene: &Scene, signal: &'static Signal, rows: &[Observation]) -> (Sets, Option<Coefficients>) {
    let message = signal.components.iter().find_map(|component| component.message).unwrap();
    let sender = scene.messages.of(message).unwrap();
    let (mut sets, mut ionosphere) = (Sets::default(), None);
    for row in rows {
        let set = scene.catalogue.sent_at(row.sv, scene.clock.start).unwrap();
        let carried = (message.form)(set).timed(|at| BDT.label(at));
        let begin = BDT.label(scene.clock.start).seconds().div_euclid(36) * 36;
        let mut reader = (message.reader)(row.sv);
        // Every other frame of B-CNAV1 has the ionosphere.
        for second in (0..2 * message.set_s).step_by(message.unit_s as usize) {
            let start = Epoch::new(begin + second, 0.0);
            for one in sender.unit(&carried, start).unwrap() {
                for read in reader.take(if one { -1.0 } else { 1.0 }, start) {
                    match read {
                        Read::Ephemeris(set) => {
                            sets.insert(set.timed(|label| BDT.instant(label)));
                        }
                        Read::Ionosphere(found) => ionosphere = Some(found),
                        _ => {}
                    }
                }
            }
        }
    }
    assert_eq!(sets.satellites().count(), rows.len());
    (sets, ionosphere)
}

/// Normal numbers by sums of twelve uniforms from a seeded generator.
fn normal(state: &mut u64) -> f64 {
    let mut uniform = || {
        *state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (*state >> 11) as f64 / (1_u64 << 53) as f64
    };
    (0..12).map(|_| uniform()).sum::<f64>() - 6.0
}

/// Mean error of 200 fixes in metres east, north and up, the mean square of their errors in the deviations
/// that they state, and by which model they were corrected.
fn fixes(
    scene: &Scene,
    signal: &'static Signal,
    choice: IonosphereChoice,
    (place, rows): &(TrajectoryRow, Vec<Observation>),
    (sets, sent): &(Sets, Option<Coefficients>),
) -> (Vector3<f64>, f64, IonosphereModel) {
    let chip_m = SPEED_OF_LIGHT_MPS / signal.components[0].chip_rate_hz;
    let noise = CodeNoise {
        chip_m,
        share: 1.0,
        shape: CodeShape::triangle(0.5),
        discriminator: CodeDiscriminator::EarlyMinusLate,
        bandwidth_hz: 0.5,
        integration_s: 0.004,
    };
    let settings = PositionSettings {
        smoothing_s: 0.0,
        // Without a correction slant delays fit no position: their misfit counts as the model's then.
        model_sigma_m: if choice == IonosphereChoice::None { 5.0 } else { 0.1 },
        ionosphere: choice,
        troposphere: TroposphereChoice::None,
        ..PositionSettings::default()
    };
    let (mut state, trials) = (11, 200);
    let (mut mean_m, mut squares, mut model) = (Vector3::zeros(), 0.0, IonosphereModel::None);
    for _ in 0..trials {
        let noisy = rows.iter().map(|row| {
            let sigma_m = noise.sigma_m(libm::pow(10.0, row.cn0_dbhz / 10.0));
            Observation { pseudorange_m: row.pseudorange_m + sigma_m * normal(&mut state), ..row.clone() }
        });
        let noisy: Vec<Observation> = noisy.collect();
        let mut solver = Solver::new(&settings, vec![(signal, noise)], scene.clock.rate);
        let fix = solver.solve(place.sample, scene.clock, &noisy, sets, *sent).unwrap().fix;
        let here_m = place.position_m();
        let error_m = Geodetic::from_ecef(&here_m).ecef_to_enu() * (fix.position_m() - here_m);
        let sigma_m = Vector3::new(fix.sigma_east_m, fix.sigma_north_m, fix.sigma_up_m);
        mean_m += error_m / f64::from(trials);
        squares += error_m.component_div(&sigma_m).norm_squared() / f64::from(trials);
        model = fix.ionosphere;
    }
    (mean_m, squares, model)
}

#[test]
fn positions_by_one_carrier_are_right_to_the_noise_with_the_model_and_metres_off_without() {
    let given = format!("[ionosphere]\nmodel = \"bdgim\"\nbdgim_tecu = {COEFFICIENTS}");
    for signal in [&B1C, &B2A, &B2B] {
        assert_eq!(IonosphereChoice::Combined.model(&[signal]), Some(Model::Bdgim));
        let scene = scene(signal, &given);
        let truth = truth(&scene);
        let heard = heard(&scene, signal, &truth.1);
        assert!(matches!(heard.1, Some(Coefficients::Bdgim(_))), "{:?}", heard.1);
        let (with_m, squares, model) = fixes(&scene, signal, IonosphereChoice::Combined, &truth, &heard);
        let (without_m, ..) = fixes(&scene, signal, IonosphereChoice::None, &truth, &heard);
        println!("{}: {with_m:.3?} m with it ({squares:.2}), {without_m:.3?} m without", signal.name);
        assert_eq!(model, IonosphereModel::Bdgim);
        // Codes of B1C scatter by 0.6 m and heights by three times as much, the mean of 200 by 0.13 m: three
        // of them.
        assert!(with_m.norm() < 0.4, "{}: {with_m:?}", signal.name);
        // Three components of mean square 1 at most, for deviations contain an error of the models of 0.1 m
        // that is not there. Correlations triple the variance: √(18/200), four of them.
        assert!(squares < 3.0 + 1.2, "{}: {squares}", signal.name);
        assert!(without_m.norm() > 10.0, "{}: {without_m:?}", signal.name);
    }
}

#[test]
fn satellites_that_send_nine_zeros_leave_the_receiver_to_a_nominal_ionosphere() {
    let sent = "broadcast_bdgim_tecu = [0, 0, 0, 0, 0, 0, 0, 0, 0]";
    let lines = format!("[ionosphere]\nmodel = \"bdgim\"\nbdgim_tecu = {COEFFICIENTS}\n{sent}");
    let scene = scene(&B1C, &lines);
    let truth = truth(&scene);
    let heard = heard(&scene, &B1C, &truth.1);
    assert_eq!(heard.1, None);
    let (_, _, model) = fixes(&scene, &B1C, IonosphereChoice::Combined, &truth, &heard);
    assert_eq!(model, IonosphereModel::Nominal);
}
