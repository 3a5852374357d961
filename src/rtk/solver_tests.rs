//! Laws of baselines on a sky in memory, with integers and noise that the tests know.

use nalgebra::Vector3;

use super::*;
use crate::carrier::Code;
use crate::orbits::Emission;
use crate::pairs::{Phases, Shared, modelled};
use crate::rows::variances;
use gnss::earth::Geodetic;
use gnss::satellite::System;

/// Satellites of GPS and Galileo over an antenna, each with signals on two bands.
struct Sky {
    base_m: Vector3<f64>,
    rover_m: Vector3<f64>,
    satellites: Vec<(Sv, Vector3<f64>)>,
    /// Ionosphere of each satellite between the receivers on L1, metres.
    ionosphere_m: f64,
    /// Deviations of codes and phases, relative to those of the weights.
    noise: [f64; 2],
    state: u64,
}

impl Sky {
    fn new() -> Self {
        let place = Geodetic::from_degrees(37.6, -1.0, 60.0);
        let (base_m, axes) = (place.to_ecef(), place.ecef_to_enu());
        let rover_m = base_m + axes.transpose() * Vector3::new(400.0, 440.0, 12.0);
        let satellite = |number: u8| {
            let (azimuth, elevation) = (2.4 * f64::from(number), 0.25 + 0.09 * f64::from(number % 14));
            let direction = Vector3::new(
                libm::cos(elevation) * libm::sin(azimuth),
                libm::cos(elevation) * libm::cos(azimuth),
                libm::sin(elevation),
            );
            let system = if number.is_multiple_of(2) { System::Gps } else { System::Galileo };
            (Sv { system, number }, base_m + axes.transpose() * direction * 2.3e7)
        };
        Self {
            base_m,
            rover_m,
            satellites: (1..=14).map(satellite).collect(),
            ionosphere_m: 0.0,
            noise: [1.0, 1.0],
            state: 5,
        }
    }

    /// Sum of twelve uniform numbers less six: nearly normal.
    fn normal(&mut self) -> f64 {
        let mut uniform = || {
            self.state = self.state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (self.state >> 11) as f64 / (1_u64 << 53) as f64
        };
        (0..12).map(|_| uniform()).sum::<f64>() - 6.0
    }

    /// Epoch of these codes; clocks of the receivers are microseconds apart and drift.
    fn pair(&mut self, epoch: u32, codes: &[&str]) -> Pair {
        let at = Epoch::new(1_290_689_460 + i64::from(epoch), 0.0);
        let clocks_m = [39_000.0 + 15.0 * f64::from(epoch), -65_000.0 - 7.0 * f64::from(epoch)];
        let places = [Site::new(self.base_m), Site::new(self.rover_m)];
        let mut shared = Vec::new();
        for (sv, position_m) in self.satellites.clone() {
            let emission = Emission { position_m, clock_s: 1e-4, day: at.day_of_year() };
            for text in codes {
                let code = Code::new(text).unwrap();
                let wavelength_m = SPEED_OF_LIGHT_MPS / gnss::signal::band_hz(sv.system, code.band(), None).unwrap();
                // The rover's alone: a pattern over the satellites, on each carrier by its square.
                let ratio = wavelength_m / L1_M;
                let delays_m = [0.0, self.ionosphere_m * libm::sin(2.2 * f64::from(sv.number)) * ratio * ratio];
                let ranges_m = [0, 1].map(|one: usize| modelled(&emission, &places[one]).0 + clocks_m[one]);
                // Of one receiver.
                let weights = variances(sv.system, code, modelled(&emission, &places[0]).2, Some(CN0_DBHZ));
                let [of_code_m, of_phase_m] = [0, 1].map(|kind| self.noise[kind] * (0.5 * weights[kind]).sqrt());
                let code_m = [0, 1].map(|one: usize| ranges_m[one] + delays_m[one] + of_code_m * self.normal());
                let whole = |one: usize| 1000.0 * f64::from(sv.number) + 77_777.0 * one as f64 + f64::from(code.band());
                let phase_m = [0, 1].map(|one: usize| {
                    ranges_m[one] - delays_m[one] + wavelength_m * whole(one) + of_phase_m * self.normal()
                });
                let phases = Some(Phases { phase_m, is_broken: false, is_half: false });
                let emissions = [emission; 2];
                shared.push(Shared {
                    track: (sv, code),
                    wavelength_m,
                    code_m,
                    phases,
                    cn0_dbhz: Some(CN0_DBHZ),
                    emissions,
                });
            }
        }
        Pair { labels: [at, at], shared }
    }

    fn error_m(&self, solved: &Solved) -> f64 {
        (solved.solution.as_ref().unwrap().position_m - self.rover_m).norm()
    }
}

fn status(solved: &Solved) -> Status {
    solved.solution.as_ref().unwrap().status
}

const TWO: [&str; 2] = ["1C", "5Q"];
const CN0_DBHZ: f64 = 45.0;

#[test]
fn two_bands_are_fixed_at_the_first_epoch_to_millimetres() {
    for is_static in [false, true] {
        let mut sky = Sky::new();
        let mut solver = Solver::new(Settings { is_static, ..Settings::default() });
        for epoch in 0..20 {
            let solved = solver.epoch(&sky.pair(epoch, &TWO), &sky.base_m);
            assert_eq!(status(&solved), Status::Fixed, "epoch {epoch}");
            assert!(sky.error_m(&solved) < 0.03, "epoch {epoch}: {}", sky.error_m(&solved));
            assert!(solved.events.is_empty());
            let integers = solved.solution.unwrap().integers.unwrap();
            assert!(integers.ratio > 3.0 && integers.success_rate > 0.999);
        }
    }
}

#[test]
fn without_noise_the_baseline_is_exact_and_the_float_solution_is_weaker() {
    let mut sky = Sky::new();
    sky.noise = [0.0, 0.0];
    let mut solver = Solver::new(Settings::default());
    let solved = solver.epoch(&sky.pair(0, &TWO), &sky.base_m);
    // Ranges of 2.3e7 m in f64, and the second order of an approximate position a metre off.
    assert!(sky.error_m(&solved) < 1e-6, "{}", sky.error_m(&solved));
    let solution = solved.solution.unwrap();
    let fixed = solution.covariance_m2.trace();
    assert!(fixed > 0.0 && fixed < 1e-4, "{fixed}");
}

#[test]
fn a_rover_at_rest_gains_on_one_that_moves_and_information_comes_once_a_second() {
    let sigma = |is_static: bool, step: u32, count: u32| {
        let mut sky = Sky::new();
        let mut solver = Solver::new(Settings { is_static, ..Settings::default() });
        let mut last = 0.0;
        for epoch in 0..count {
            let mut pair = sky.pair(0, &["1C"]);
            let later_s = f64::from(epoch) * f64::from(step) / 10.0;
            pair.labels = pair.labels.map(|label| label.plus_s(later_s));
            let solved = solver.epoch(&pair, &sky.base_m);
            let floats = solved.solution.unwrap().floats;
            last = floats.covariance.trace();
        }
        last
    };
    // Nine epochs within a second tell nothing that the first did not: two are joined, of ten a second apart
    // all.
    let (once, quick, slow) = (sigma(false, 10, 1), sigma(false, 1, 10), sigma(false, 10, 10));
    assert!((once / quick - 2.0).abs() < 0.3 && (once / slow - 10.0).abs() < 1.5, "{once} {quick} {slow}");
    assert!(sigma(true, 10, 10) < slow);
}

#[test]
fn a_slip_that_none_announced_is_found_and_what_is_announced_begins_anew() {
    for (cycles, is_broken, event) in
        [(0.5, false, Event::Slip), (-7.0, false, Event::Slip), (1234.0, true, Event::Announced)]
    {
        let mut sky = Sky::new();
        let mut solver = Solver::new(Settings::default());
        for epoch in 0..12 {
            let mut pair = sky.pair(epoch, &TWO);
            let slipped = pair.shared[9].track;
            if epoch >= 6 {
                let own = &mut pair.shared[9];
                let phases = own.phases.as_mut().unwrap();
                phases.phase_m[1] += cycles * own.wavelength_m;
                phases.is_broken = is_broken && epoch == 6;
            }
            let solved = solver.epoch(&pair, &sky.base_m);
            let is_first = solved.events.contains(&(slipped, event));
            assert_eq!(is_first, epoch == 6, "epoch {epoch}: {:?}", solved.events);
            assert!(sky.error_m(&solved) < 0.03 && status(&solved) != Status::Float, "epoch {epoch}");
        }
    }
}

#[test]
fn a_half_cycle_from_the_start_is_named_and_does_no_harm() {
    for index in [0, 9, 27] {
        let mut sky = Sky::new();
        let mut solver = Solver::new(Settings::default());
        let mut named = Vec::new();
        for epoch in 0..5 {
            let mut pair = sky.pair(epoch, &TWO);
            let own = &mut pair.shared[index];
            own.phases.as_mut().unwrap().phase_m[0] += 0.5 * own.wavelength_m;
            let track = own.track;
            let solved = solver.epoch(&pair, &sky.base_m);
            named.extend(solved.events.iter().copied());
            assert!(sky.error_m(&solved) < 0.03, "epoch {epoch}: {}", sky.error_m(&solved));
            assert!(named.iter().all(|event| *event == (track, Event::NotWhole)));
        }
        assert_eq!(named.len(), 1, "{named:?}");
    }
}

#[test]
fn a_half_cycle_that_a_receiver_announces_is_left_out_of_the_integers() {
    let mut sky = Sky::new();
    let mut solver = Solver::new(Settings::default());
    let mut pair = sky.pair(0, &TWO);
    let own = &mut pair.shared[3];
    let phases = own.phases.as_mut().unwrap();
    phases.phase_m[1] += 0.5 * own.wavelength_m;
    phases.is_half = true;
    let solved = solver.epoch(&pair, &sky.base_m);
    assert!(solved.events.is_empty() && status(&solved) == Status::Fixed);
    assert!(sky.error_m(&solved) < 0.03);
}

#[test]
fn an_ionosphere_that_is_expected_leaves_the_integers_right_and_one_that_is_not_is_refused() {
    for (ionosphere, expected) in [(5e-5, true), (0.0, false)] {
        let mut sky = Sky::new();
        // Three centimetres over 600 m, as in a storm: 5e-5 of the baseline.
        sky.ionosphere_m = 0.03;
        let mut solver = Solver::new(Settings { ionosphere, ..Settings::default() });
        let mut fixed = false;
        for epoch in 0..40 {
            let solved = solver.epoch(&sky.pair(epoch, &TWO), &sky.base_m);
            let is_fix = solved.solution.as_ref().unwrap().is_fix();
            assert!(!expected || !is_fix || sky.error_m(&solved) < 0.04, "{}", sky.error_m(&solved));
            fixed |= if expected { is_fix } else { status(&solved) == Status::Fixed };
        }
        assert_eq!(fixed, expected, "{ionosphere}");
    }
}

#[test]
fn integers_are_wrong_no_more_often_than_their_success_rates_say() {
    let (mut expected, mut wrong, mut trials) = (0.0, 0, 0);
    for trial in 0..240_usize {
        let mut sky = Sky::new();
        sky.state = 1000 + trial as u64;
        sky.satellites.truncate(7 + trial % 8);
        // Whatever is found counts.
        let belief = Belief { ratio: 1.0, success_rate: 0.0 };
        let mut solver = Solver::new(Settings { belief, is_static: true, ..Settings::default() });
        for epoch in 0..6 {
            let solved = solver.epoch(&sky.pair(epoch, &["1C"]), &sky.base_m);
            let Some(solution) = solved.solution else { continue };
            let Some(found) = &solution.integers else { continue };
            // All single differences have the same integer, of which the references were taken.
            let of = |index: usize| -solution.floats.references[index];
            let doubles = found.doubles.pairs.iter().map(|(own, pivot)| of(*own) - of(*pivot));
            let true_ones = &found.rows * DVector::from_iterator(found.doubles.pairs.len(), doubles);
            trials += 1;
            expected += 1.0 - found.success_rate;
            wrong += usize::from(found.fixed != true_ones);
        }
    }
    assert!(trials > 100 && expected > 5.0, "{trials} trials, {expected} expected");
    // Epochs of a trial share its noise: five deviations, each of six epochs.
    let bound = expected + 5.0 * (6.0 * expected).sqrt();
    assert!((wrong as f64) < bound, "{wrong} of {trials}, {expected} expected");
}

#[test]
fn too_few_satellites_give_no_solution() {
    let mut sky = Sky::new();
    sky.satellites.truncate(3);
    let mut solver = Solver::new(Settings::default());
    assert!(solver.epoch(&sky.pair(0, &TWO), &sky.base_m).solution.is_none());
}

#[test]
fn what_is_announced_in_an_epoch_without_a_solution_is_not_forgotten() {
    let mut sky = Sky::new();
    let mut solver = Solver::new(Settings::default());
    for epoch in 0..12 {
        let mut pair = sky.pair(epoch, &TWO);
        for shared in &mut pair.shared {
            let phases = shared.phases.as_mut().unwrap();
            if epoch >= 6 {
                phases.phase_m[1] += 1e4 * f64::from(shared.track.0.number) * shared.wavelength_m;
                phases.is_broken = epoch == 6;
            }
        }
        // Three satellites come back first, each with its only word on the break; others are seen again when
        // there is a position.
        if epoch == 6 {
            pair.shared.truncate(3 * TWO.len());
        }
        let solved = solver.epoch(&pair, &sky.base_m);
        assert_eq!(solved.solution.is_none(), epoch == 6);
        if epoch != 6 {
            assert_eq!(status(&solved), Status::Fixed, "epoch {epoch}");
            assert!(sky.error_m(&solved) < 0.03, "epoch {epoch}: {}", sky.error_m(&solved));
            assert!(solved.events.is_empty(), "epoch {epoch}: {:?}", solved.events);
        }
    }
}

#[test]
fn codes_of_the_base_alone_find_it_from_nowhere_and_a_baseline_from_there_is_as_good() {
    let mut sky = Sky::new();
    let mut solver = Solver::new(Settings::default());
    let mut own_m = None;
    for epoch in 0..20 {
        let pair = sky.pair(epoch, &TWO);
        own_m = crate::rows::of_base(&pair, own_m, Settings::default().mask_rad);
        let base_m = own_m.unwrap();
        // Codes of 0.25 to 0.5 m with a dilution of three at most: four deviations.
        let off_m = base_m - sky.base_m;
        assert!(off_m.norm() < 6.0, "epoch {epoch}: {off_m}");
        let solution = solver.epoch(&pair, &base_m).solution.unwrap();
        assert_eq!(solution.status, Status::Fixed, "epoch {epoch}");
        // 6 m at 2e7 m turn 0.6 km by 0.2 mm.
        let error_m = solution.position_m - base_m - (sky.rover_m - sky.base_m);
        assert!(error_m.norm() < 0.03, "epoch {epoch}: {error_m}");
    }
}
