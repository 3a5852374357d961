//! Laws that need no samples: the position solution against the generator's own geometry, covariances against
//! a plain inversion, effects and statistics against their definitions.

use analysis::expect::theory::{dll, pll};
use analysis::response::Response;
use analysis::statistics;
use generator::catalogue::Catalogue;
use generator::clock::ReceiverClock;
use generator::effect::ionosphere::KlobucharIonosphere;
use generator::effect::link::LinkBudget;
use generator::effect::mapping::Mapping;
use generator::effect::troposphere::{Air, Troposphere, Weather};
use generator::ray::{Effect, Ray};
use generator::sky::{Emission, emission};
use generator::vehicle::Motion;
use gnss::earth::{Geodetic, SPEED_OF_LIGHT_MPS};
use gnss::facts::{FilterShape, FilterSpec};
use gnss::gps::l1ca::L1_CA;
use gnss::ionosphere::Coefficients;
use gnss::klobuchar::Klobuchar;
use gnss::record::Observation;
use gnss::rinex;
use gnss::satellite::Sv;
use gnss::signal::{Carrier, Signal};
use gnss::time::{Epoch, Rate, SampleClock, TimePolynomial, TimeScale};
use nalgebra::{DMatrix, Matrix3, Vector3};
use num_complex::Complex64;
use receiver::correlate::sums::{RunningSums, Samples};
use receiver::correlate::{Arithmetic, Edge, Nco, Replica, chips_to_units};
use receiver::position::smooth::Smoother;
use receiver::position::{CodeNoise, NoFix, Noises, PositionSettings, Sets, Solved, Solver, SystemClocks};
use receiver::track::closed::{Loops, Mode};
use receiver::track::loops::CodeShape;
use receiver::track::{CodeDiscriminator, TrackingSettings};

const BIAS_S: f64 = 1.3e-4;
const DRIFT: f64 = 5e-8;
const CN0_DBHZ: f64 = 45.0;
const MPS: [f64; 3] = [12.0, -7.0, 3.0];
const RATE_HZ: f64 = 1e6;
/// The sample of the epoch under test.
pub const SAMPLE: u64 = 3_000_000;

/// Observations of an ideal receiver: geometry, atmosphere and clocks by the generator, no noise.
pub struct Ideal {
    pub catalogue: Catalogue,
    klobuchar: Klobuchar,
    effects: Vec<Box<dyn Effect>>,
    pub clock: SampleClock,
    place: Geodetic,
}

impl Ideal {
    pub fn new() -> Self {
        let navigation = rinex::embedded().unwrap();
        let klobuchar = navigation.klobuchar.unwrap();
        Self {
            catalogue: Catalogue::new(navigation.ephemerides).0,
            klobuchar,
            effects: vec![
                Box::new(KlobucharIonosphere::of_gps(klobuchar)),
                Box::new(Troposphere { air: Air::Weather(Weather::STANDARD), mapping: Mapping::Niell }),
            ],
            clock: SampleClock {
                start: Epoch::parse("2010-07-01T08:05:58").unwrap(),
                rate: Rate::from_hz(RATE_HZ).unwrap(),
            },
            place: Geodetic::from_degrees(26.5123, 80.2329, 130.0),
        }
    }

    /// The antenna at a reading of the receiver's clock: on a straight line, at `place` at [`SAMPLE`].
    fn motion(&self, true_time: Epoch) -> Motion {
        let velocity_mps = Vector3::from(MPS);
        let since_s = true_time.since(self.clock.epoch(SAMPLE)) + BIAS_S;
        Motion {
            position_m: self.place.to_ecef() + velocity_mps * since_s,
            velocity_mps,
            acceleration_mps2: Vector3::zeros(),
        }
    }

    /// Emission that arrives when the receiver's clock reads `local`, and that clock's offset there.
    fn arriving(&self, sv: Sv, local: Epoch) -> Option<(Emission, f64)> {
        let offset_s = BIAS_S + DRIFT * local.since(self.clock.epoch(SAMPLE));
        let received = local.plus_s(-offset_s);
        Some((emission(&self.catalogue, sv, received, &self.motion(received)).unwrap()?, offset_s))
    }

    /// Seconds from sending to the reading of arrival, without the atmosphere.
    fn travel_s(&self, sv: Sv, local: Epoch) -> Option<f64> {
        let (found, offset_s) = self.arriving(sv, local)?;
        Some(found.travel_s + (offset_s - found.satellite_clock_s))
    }

    fn observation(&self, sv: Sv, sample: u64) -> Option<Observation> {
        let local = self.clock.epoch(sample);
        let (found, _) = self.arriving(sv, local)?;
        if found.sight.look.elevation_rad < 5_f64.to_radians() {
            return None;
        }
        let mut rays = vec![Ray { code_delay_s: 0.0, carrier_delay_s: 0.0, phase_cycles: 0.0, cn0_hz: 0.0 }];
        self.effects.iter().for_each(|effect| effect.act(&found.sight, &L1_CA, &mut rays));
        let delay_s = self.travel_s(sv, local)? + rays[0].code_delay_s;
        let sent = local.plus_s(-delay_s);
        // The atmosphere's rate, millimetres a second, is left out of the Doppler, as the solver leaves it
        // out.
        let rate = (self.travel_s(sv, local.plus_s(0.05))? - self.travel_s(sv, local.plus_s(-0.05))?) / 0.1;
        Some(Observation {
            sample,
            sv,
            signal: &L1_CA,
            sent_s: sent.seconds(),
            sent_fraction_s: sent.fraction(),
            pseudorange_m: SPEED_OF_LIGHT_MPS * delay_s,
            carrier_cycles: delay_s * L1_CA.centre_hz(),
            doppler_hz: -L1_CA.centre_hz() * rate,
            cn0_dbhz: CN0_DBHZ,
            locked_s: 10.0,
        })
    }

    pub fn observations(&self, sample: u64) -> Vec<Observation> {
        let local = self.clock.epoch(sample);
        let healthy = self.catalogue.satellites().filter(|sv| self.catalogue.healthy(*sv, local));
        healthy.filter_map(|sv| self.observation(sv, sample)).collect()
    }

    fn ephemerides(&self) -> Sets {
        let at = self.clock.epoch(SAMPLE);
        self.catalogue.satellites().filter_map(|sv| self.catalogue.sent_at(sv, at).cloned()).collect()
    }

    /// Solution of a receiver with such noise, which does not know the ionosphere.
    pub fn solved(&self, noises: Noises, observations: &[Observation]) -> Solved {
        let mut solver = Solver::new(&PositionSettings::default(), noises, self.clock.rate);
        solver.solve(SAMPLE, self.clock, observations, &self.ephemerides(), None).unwrap()
    }

    fn solver(&self, settings: &PositionSettings) -> Solver {
        Solver::new(settings, vec![(&L1_CA, noise())], self.clock.rate)
    }
}

/// Offset of the time of [`OTHER`] in seconds, ahead of GPS time.
const AHEAD_S: f64 = 40e-9;

impl Ideal {
    /// Observations of which every other satellite sends by a clock that is ahead.
    fn of_two_systems(&self) -> Vec<Observation> {
        let mut observations = self.observations(SAMPLE);
        for observation in observations.iter_mut().skip(1).step_by(2) {
            let sent = observation.sent().plus_s(AHEAD_S);
            (observation.sent_s, observation.sent_fraction_s) = (sent.seconds(), sent.fraction());
            (observation.signal, observation.pseudorange_m) =
                (&OTHER, observation.pseudorange_m - SPEED_OF_LIGHT_MPS * AHEAD_S);
        }
        observations
    }
}

/// L1 C/A in a time of its own, behind GPS time by no whole second.
static OTHER: Signal =
    Signal { name: "other", time: &TimeScale { name: "other", behind_gpst_s: 0, has_leap_seconds: false }, ..L1_CA };

#[test]
fn two_systems_whose_times_differ_give_one_position_and_a_clock_of_each() {
    let ideal = Ideal::new();
    let observations = ideal.of_two_systems();
    let noises = vec![(&L1_CA, noise()), (&OTHER, noise())];
    let solved = Solver::new(&PositionSettings::default(), noises, ideal.clock.rate)
        .solve(SAMPLE, ideal.clock, &observations, &ideal.ephemerides(), Some(Coefficients::Klobuchar(ideal.klobuchar)))
        .unwrap();
    let truth = ideal.motion(ideal.clock.epoch(SAMPLE).plus_s(-BIAS_S));
    let off_m = (solved.fix.position_m() - truth.position_m).norm();
    // The atmosphere's millimetre a satellite again; half as many satellites a clock give twice the dilution
    // at most.
    assert!(off_m < 8e-3, "{off_m} m");
    let clocks: Vec<(&str, f64)> =
        solved.clocks.iter().map(|row| (row.time_scale.as_str(), row.clock_bias_s)).collect();
    let [("GPST", own_s), ("other", other_s)] = clocks[..] else { panic!("{clocks:?}") };
    // What is behind a clock that is ahead by so much.
    assert!((own_s - BIAS_S).abs() < 4e-11 && (other_s - (BIAS_S - AHEAD_S)).abs() < 4e-11, "{clocks:?}");
    assert_eq!(solved.fix.freedom() as usize, observations.len() - 5);
}

/// L1 C/A on the carrier of L5.
static BAND: Signal = Signal { name: "other band", carrier: Carrier::Common(1_176.45e6), ..L1_CA };

#[test]
fn two_bands_show_the_ionosphere_without_the_group_delays_of_the_message_and_give_a_position_without_it() {
    let ideal = Ideal::new();
    let local = ideal.clock.epoch(SAMPLE);
    let mut true_m: Vec<(Sv, f64)> = Vec::new();
    let mut apart_m = 0.0_f64;
    let mut both = Vec::new();
    for first in ideal.observations(SAMPLE) {
        let (found, _) = ideal.arriving(first.sv, local).unwrap();
        let mut rays = vec![Ray { code_delay_s: 0.0, carrier_delay_s: 0.0, phase_cycles: 0.0, cn0_hz: 0.0 }];
        ideal.effects[0].act(&found.sight, &L1_CA, &mut rays);
        let ionosphere_m = SPEED_OF_LIGHT_MPS * rays[0].code_delay_s;
        let gamma = (154.0_f64 / 115.0).powi(2);
        let ahead_m = SPEED_OF_LIGHT_MPS * ideal.catalogue.signal_clock_s(first.sv, local, &BAND);
        let pseudorange_m = first.pseudorange_m + (gamma - 1.0) * ionosphere_m - ahead_m;
        let sent = local.plus_s(-pseudorange_m / SPEED_OF_LIGHT_MPS);
        apart_m = apart_m.max(ahead_m.abs());
        true_m.push((first.sv, ionosphere_m));
        let (sent_s, sent_fraction_s) = (sent.seconds(), sent.fraction());
        both.push(Observation { signal: &BAND, sent_s, sent_fraction_s, pseudorange_m, ..first.clone() });
        both.push(first);
    }
    let solved = ideal.solved(vec![(&L1_CA, noise()), (&BAND, noise())], &both);
    // Group delays of metres would show.
    assert!(apart_m > 2.0 && solved.ionosphere.len() == true_m.len(), "{apart_m}");
    for (row, (sv, delay_m)) in solved.ionosphere.iter().zip(&true_m) {
        // Differences of two ranges of 2.5e7 m, each to 4e-9 m.
        assert!(row.sv == *sv && (row.delay_m - delay_m).abs() < 1e-6, "{row:?} {delay_m}");
    }
    let truth = ideal.motion(local.plus_s(-BIAS_S));
    // The atmosphere's millimetre a satellite again; the clock is that of the combination.
    assert!((solved.fix.position_m() - truth.position_m).norm() < 8e-3);
    assert!((solved.fix.clock_bias_s - BIAS_S).abs() < 4e-11, "{}", solved.fix.clock_bias_s);
}

#[test]
fn with_the_broadcast_offset_any_four_satellites_of_two_systems_give_position_and_time() {
    let ideal = Ideal::new();
    let observations = ideal.of_two_systems();
    let settings = PositionSettings { system_clocks: SystemClocks::Broadcast, ..PositionSettings::default() };
    let at = ideal.clock.epoch(SAMPLE);
    // An hour old, with a rate.
    let ahead = TimePolynomial { a0_s: AHEAD_S - 3.6e-9, a1_sps: 1e-12, reference: at.plus_s(-3600.0) };
    let solve = |observations: &[Observation], known: bool| {
        let noises = vec![(&L1_CA, noise()), (&OTHER, noise())];
        let mut solver = Solver::new(&settings, noises, ideal.clock.rate);
        if known {
            solver.take_ahead(OTHER.time, ahead);
        }
        solver.solve(
            SAMPLE,
            ideal.clock,
            observations,
            &ideal.ephemerides(),
            Some(Coefficients::Klobuchar(ideal.klobuchar)),
        )
    };
    let truth = ideal.motion(at.plus_s(-BIAS_S)).position_m;
    let solved = solve(&observations, true).unwrap();
    assert!((solved.fix.position_m() - truth).norm() < 8e-3);
    assert_eq!((solved.clocks.len(), solved.fix.freedom() as usize), (1, observations.len() - 4));
    assert_eq!(solved.clocks[0].time_scale, "GPST");
    assert!((solved.clocks[0].clock_bias_s - BIAS_S).abs() < 4e-11, "{:?}", solved.clocks);
    // Until it is known each system has its clock, and four satellites are too few.
    assert_eq!(solve(&observations, false).unwrap().clocks.len(), 2);
    let mut fewest = 0;
    for first in 0..observations.len() - 4 {
        let four = &observations[first..first + 4];
        assert!(matches!(solve(four, false), Err(NoFix::TooFew { have: 4, need: 5 })));
        // A geometry may be as bad as four neighbours make it.
        let Ok(solved) = solve(four, true) else { continue };
        let off_m = (solved.fix.position_m() - truth).norm();
        assert!(off_m < 4e-3 * solved.fix.pdop, "{off_m} m, dilution {}", solved.fix.pdop);
        fewest += 1;
    }
    assert!(fewest > 3, "{fewest}");
}

/// A code loop of 1 Hz with early and late half a chip apart.
pub fn noise() -> CodeNoise {
    let chip_m = SPEED_OF_LIGHT_MPS / 1.023e6;
    CodeNoise {
        chip_m,
        share: 1.0,
        shape: CodeShape::triangle(0.5),
        discriminator: CodeDiscriminator::EarlyMinusLate,
        bandwidth_hz: 1.0,
        integration_s: 4e-3,
    }
}

#[test]
fn exact_ranges_give_the_exact_position_velocity_and_clock() {
    let ideal = Ideal::new();
    let observations = ideal.observations(SAMPLE);
    assert!(observations.len() >= 10);
    let solved = ideal
        .solver(&PositionSettings::default())
        .solve(SAMPLE, ideal.clock, &observations, &ideal.ephemerides(), Some(Coefficients::Klobuchar(ideal.klobuchar)))
        .unwrap();
    let (fix, truth) = (&solved.fix, ideal.motion(ideal.clock.epoch(SAMPLE).plus_s(-BIAS_S)));
    let off_m = ideal.place.ecef_to_enu() * (fix.position_m() - truth.position_m);
    // Two writings of the same atmosphere agree to a millimetre a satellite; geometry lifts that to four.
    assert!(off_m.norm() < 4e-3, "east, north, up off by {off_m:?} m");
    let off_mps = (fix.velocity_mps() - truth.velocity_mps).norm();
    // Differences of light times over 0.1 s resolve 1e-7 m/s.
    assert!(off_mps < 1e-4, "velocity off by {off_mps} m/s");
    let off_s = fix.clock_bias_s - BIAS_S;
    assert!(off_s.abs() < 2e-11, "clock off by {off_s} s");
    assert!((fix.clock_drift - DRIFT).abs() < 1e-12, "drift {}", fix.clock_drift);
    let time_s = fix.time().since(ideal.clock.epoch(SAMPLE).plus_s(-BIAS_S));
    assert!(time_s.abs() < 2e-11, "time off by {time_s} s");
}

#[test]
fn the_covariance_is_the_inverse_of_the_weighted_geometry() {
    let ideal = Ideal::new();
    let observations = ideal.observations(SAMPLE);
    let settings = PositionSettings::default();
    let fix = ideal
        .solver(&settings)
        .solve(SAMPLE, ideal.clock, &observations, &ideal.ephemerides(), Some(Coefficients::Klobuchar(ideal.klobuchar)))
        .unwrap()
        .fix;
    // Kaplan and Hegarty, eq. 5.23, written out for d = 0.5 chips, B = 1 Hz, T = 4 ms.
    let cn0_hz = libm::pow(10.0, CN0_DBHZ / 10.0);
    let chips = (0.5 / (2.0 * cn0_hz) * (1.0 + 2.0 / (1.5 * 4e-3 * cn0_hz))).sqrt();
    let code_m = chips * SPEED_OF_LIGHT_MPS / 1.023e6;
    let sights: Vec<(f64, f64)> = observations
        .iter()
        .map(|observation| {
            let (found, _) = ideal.arriving(observation.sv, ideal.clock.epoch(SAMPLE)).unwrap();
            (found.sight.look.azimuth_rad, found.sight.look.elevation_rad)
        })
        .collect();
    let row = |(azimuth, elevation): (f64, f64)| {
        let level = libm::cos(elevation);
        [-level * libm::sin(azimuth), -level * libm::cos(azimuth), -libm::sin(elevation), 1.0]
    };
    let design = DMatrix::from_fn(sights.len(), 4, |r, c| row(sights[r])[c]);
    let weights = DMatrix::from_fn(sights.len(), sights.len(), |r, c| {
        let model_m = settings.model_sigma_m / libm::sin(sights[r].1);
        if r == c { 1.0 / (code_m * code_m + model_m * model_m) } else { 0.0 }
    });
    let covariance = (design.transpose() * weights * &design).try_inverse().unwrap();
    let dilution = (design.transpose() * &design).try_inverse().unwrap();
    let near = |name: &str, found: f64, expected: f64| {
        // The satellites' directions are those of light that left, to 1e-6 rad.
        assert!((found - expected).abs() < 1e-4 * expected.abs().max(0.01), "{name}: {found}, expected {expected}");
    };
    near("sigma east", fix.sigma_east_m, covariance[(0, 0)].sqrt());
    near("sigma north", fix.sigma_north_m, covariance[(1, 1)].sqrt());
    near("sigma up", fix.sigma_up_m, covariance[(2, 2)].sqrt());
    near("sigma of the clock", fix.sigma_clock_m, covariance[(3, 3)].sqrt());
    let correlation = |a: usize, b: usize| covariance[(a, b)] / (covariance[(a, a)] * covariance[(b, b)]).sqrt();
    near("correlation east, north", fix.correlation_en, correlation(0, 1));
    near("correlation east, up", fix.correlation_eu, correlation(0, 2));
    near("correlation north, up", fix.correlation_nu, correlation(1, 2));
    near("hdop", fix.hdop, (dilution[(0, 0)] + dilution[(1, 1)]).sqrt());
    near("vdop", fix.vdop, dilution[(2, 2)].sqrt());
    near("tdop", fix.tdop, dilution[(3, 3)].sqrt());
    near("gdop", fix.gdop, dilution.trace().sqrt());
}

/// Normal numbers: sums of twelve uniform ones.
struct Normal(u64);

impl Normal {
    fn next(&mut self) -> f64 {
        let mut uniform = || {
            self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (self.0 >> 11) as f64 / (1_u64 << 53) as f64
        };
        (0..12).map(|_| uniform()).sum::<f64>() - 6.0
    }
}

#[test]
fn errors_of_independent_epochs_are_as_large_as_the_covariance_says() {
    let ideal = Ideal::new();
    let settings = PositionSettings { smoothing_s: 0.0, model_sigma_m: 0.0, ..PositionSettings::default() };
    let (exact, ephemerides) = (ideal.observations(SAMPLE), ideal.ephemerides());
    let sigma_m = noise().sigma_m(libm::pow(10.0, CN0_DBHZ / 10.0));
    let mut normal = Normal(3);
    let trials = 400;
    let mut nees = 0.0;
    for _ in 0..trials {
        let mut noisy = exact.clone();
        noisy.iter_mut().for_each(|observation| observation.pseudorange_m += sigma_m * normal.next());
        let mut solver = ideal.solver(&settings);
        let fix = solver
            .solve(SAMPLE, ideal.clock, &noisy, &ephemerides, Some(Coefficients::Klobuchar(ideal.klobuchar)))
            .unwrap()
            .fix;
        let error_m = ideal.place.ecef_to_enu() * (fix.position_m() - ideal.place.to_ecef());
        let (e, n, u) = (fix.sigma_east_m, fix.sigma_north_m, fix.sigma_up_m);
        let (en, eu, nu) = (fix.correlation_en * e * n, fix.correlation_eu * e * u, fix.correlation_nu * n * u);
        let covariance = Matrix3::new(e * e, en, eu, en, n * n, nu, eu, nu, u * u);
        nees += (error_m.transpose() * covariance.try_inverse().unwrap() * error_m)[0] / f64::from(trials);
    }
    // Chi-square of three degrees has a variance of six: √(6/400) = 0.12; four of them.
    assert!((nees - 3.0).abs() < 0.5, "normalised error squared {nees}");
}

#[test]
fn a_range_that_is_wrong_by_twenty_metres_is_excluded_and_no_other() {
    let ideal = Ideal::new();
    for wrong in 0..10 {
        let mut observations = ideal.observations(SAMPLE);
        observations[wrong].pseudorange_m += 20.0;
        let solved = ideal
            .solver(&PositionSettings::default())
            .solve(
                SAMPLE,
                ideal.clock,
                &observations,
                &ideal.ephemerides(),
                Some(Coefficients::Klobuchar(ideal.klobuchar)),
            )
            .unwrap();
        let names: Vec<Sv> = solved.excluded.iter().map(|(sv, _)| *sv).collect();
        assert_eq!(names, [observations[wrong].sv]);
    }
}

#[test]
fn smoothing_leaves_the_variance_that_it_states() {
    let ideal = Ideal::new();
    let Some(base) = ideal.observations(SAMPLE).first().cloned() else { panic!("no satellite") };
    let (interval_s, epochs, trials) = (0.1, 100_u32, 600);
    let correlation = libm::exp(-4.0 * 1.0 * interval_s);
    let mut normal = Normal(5);
    let (mut square, mut stated) = (0.0, 0.0);
    for _ in 0..trials {
        let mut smoother = Smoother::new(5.0, 1.0, ideal.clock.rate);
        let mut error_m = normal.next();
        let mut last = None;
        for k in 0..epochs {
            // 100 m/s on code and carrier alike.
            let range_m = base.pseudorange_m + 10.0 * f64::from(k);
            last = Some(smoother.smooth(&Observation {
                sample: u64::from(k) * 100_000,
                pseudorange_m: range_m + error_m,
                carrier_cycles: range_m / L1_CA.wavelength_m(Sv::gps(1)),
                locked_s: 1.0 + interval_s * f64::from(k),
                ..base.clone()
            }));
            error_m = correlation * error_m + (1.0 - correlation * correlation).sqrt() * normal.next();
        }
        let last = last.unwrap();
        let left_m = last.pseudorange_m - (base.pseudorange_m + 10.0 * f64::from(epochs - 1));
        square += left_m * left_m / f64::from(trials);
        stated = last.variance_ratio;
    }
    // The square of a normal number varies by √2: √(2/600) = 6 %; four of them.
    assert!((square / stated - 1.0).abs() < 0.24, "variance {square}, stated {stated}");
}

#[test]
fn the_ionosphere_delays_code_by_what_it_advances_the_carrier_and_air_delays_both() {
    let ideal = Ideal::new();
    let sv = ideal.observations(SAMPLE)[0].sv;
    let (found, _) = ideal.arriving(sv, ideal.clock.epoch(SAMPLE)).unwrap();
    let act = |effect: &dyn Effect| {
        let mut rays = vec![Ray { code_delay_s: 0.0, carrier_delay_s: 0.0, phase_cycles: 0.0, cn0_hz: 0.0 }];
        effect.act(&found.sight, &L1_CA, &mut rays);
        (rays[0].code_delay_s, rays[0].carrier_delay_s)
    };
    let [ionosphere, air] = [act(ideal.effects[0].as_ref()), act(ideal.effects[1].as_ref())];
    assert!(ionosphere.0 > 5e-9 && ionosphere.1 == -ionosphere.0, "{ionosphere:?}");
    assert!(air.0 > 7e-9 && air.1 == air.0, "{air:?}");
}

#[test]
fn the_link_budget_loses_power_as_friis_says() {
    let ideal = Ideal::new();
    let sv = ideal.observations(SAMPLE)[0].sv;
    let (found, _) = ideal.arriving(sv, ideal.clock.epoch(SAMPLE)).unwrap();
    let budget = LinkBudget { block: generator::effect::transmit::Block::Typical, ..LinkBudget::default() };
    let near = budget.cn0_dbhz(&found.sight, L1_CA.centre_hz());
    let mut farther = found.sight.clone();
    farther.range_m *= 10.0;
    let lost_db = near - budget.cn0_dbhz(&farther, L1_CA.centre_hz());
    assert!((lost_db - 20.0).abs() < 1e-9, "{lost_db} dB over ten times the range");
}

#[test]
fn a_clock_s_drift_is_the_one_that_it_was_given() {
    let clock = ReceiverClock::steady(BIAS_S, DRIFT);
    let start = Epoch::from_week(1590, 374_758.0);
    // After 1000 s of true time the reading is ahead by bias and drift.
    let offset_s = clock.offset_at_reading_s(start, start.plus_s(1000.0 + BIAS_S + 1000.0 * DRIFT));
    assert!((offset_s - (BIAS_S + 1000.0 * DRIFT)).abs() < 1e-12, "{offset_s}");
}

#[test]
fn statistics_are_those_of_their_definitions() {
    let hundred: Vec<f64> = (0..=100).map(f64::from).collect();
    assert_eq!(statistics::percentile(&hundred, 0.95), Some(95.0));
    assert_eq!(statistics::median(&[3.0, 1.0, 2.0]), Some(2.0));
    // 2, 4, 4, 4, 5, 5, 7, 9: squares about the mean of 5 add up to 32; seven degrees of freedom.
    let sigma = statistics::std(&[2.0, 4.0, 4.0, 4.0, 5.0, 5.0, 7.0, 9.0]).unwrap();
    assert!((sigma - (32.0_f64 / 7.0).sqrt()).abs() < 1e-12, "{sigma}");
}

#[test]
fn jitter_is_kaplan_and_hegarty_s() {
    // Equations 5.6 and 5.23 by hand at C/N0 = 10^4 Hz, T = 1 ms, B = 18 and 1 Hz, d = 0.5 chips:
    // 1/(2·T·C/N0) = 0.05.
    let expected = (18.0 / 1e4 * (1.0 + 0.05_f64)).sqrt();
    let phase_rad = pll::jitter_rad(18.0, 1e-3, 1e4);
    assert!((phase_rad - expected).abs() < 1e-9, "{phase_rad}");
    // B·d/(2·C/N0)·(1 + 2/((2−d)·T·C/N0)) = 2.5e-5·(1 + 2/15).
    let code = dll::jitter_chips(dll::Discriminator::EarlyMinusLate, 0.5, 1.0, 1e-3, 1e4);
    assert!((code - (2.5e-5_f64 * (1.0 + 2.0 / 15.0)).sqrt()).abs() < 1e-9, "{code}");
}

#[test]
fn noise_shows_no_phase_lock_and_a_steady_phase_does() {
    use receiver::track::lock::PhaseLock;
    let mut normal = Normal(7);
    let (mut noise, mut steady) = (PhaseLock::new(100.0), PhaseLock::new(100.0));
    for _ in 0..100 {
        noise.add(Complex64::new(normal.next(), normal.next()), 2.0);
        steady.add(Complex64::new(10.0 + normal.next(), normal.next()), 2.0);
    }
    assert!(noise.value() < 0.85 && steady.value() > 0.85, "{} {}", noise.value(), steady.value());
}

#[test]
fn a_two_bit_converter_has_its_levels_a_step_apart() {
    use generator::stage::converter::Converter;
    use generator::stage::{Block, Stage};
    let converter =
        Converter { bits: 2, step_sigma: 1.0, window_runs: None, nominal_lsb: 10.0, whole: false, level_lsb: 1.0 };
    let mut i = [-25.0, -15.0, -5.0, 5.0, 15.0, 25.0];
    let mut q = [0.1; 6];
    converter.act(&mut Block::whole(0, &mut i, &mut q));
    assert_eq!(i, [-3.0, -3.0, -1.0, 1.0, 3.0, 3.0]);
}

#[test]
fn a_loop_of_two_pairs_reads_a_small_error_as_it_is() {
    let settings = TrackingSettings {
        dll_discriminator: CodeDiscriminator::DoubleDelta,
        spacing_chips: 0.4,
        ..TrackingSettings::default()
    };
    let triangle = |x: f64| (1.0 - x.abs()).max(0.0);
    let slope = |x: f64| (triangle(x), -1_f64.copysign(x));
    let shape = CodeShape::of(settings.dll_discriminator, settings.spacing_chips, slope, triangle);
    let mut loops = Loops::new(&settings, shape, true, 0.0);
    loops.design(&settings, Mode::Phase, false, 4e-3);
    let ahead = 0.01;
    let [early, prompt, late, very_early, very_late] =
        [0.2, 0.0, -0.2, 0.4, -0.4].map(|tap| Complex64::from(triangle(ahead - tap)));
    let update = loops.close(Mode::Phase, [early, prompt, late, very_early - very_late], None, 4, 4e-3, None);
    // The prompt, off its peak by as much, scales by 1/0.99.
    assert!((update.dll_chips - ahead / 0.99).abs() < 1e-12, "{update:?}");
}

#[test]
fn running_sums_give_what_every_sample_by_itself_does() {
    let replica = Replica::new(gnss::gps::l1ca::code(7).unwrap(), Edge::Area).unwrap();
    let at = Nco {
        carrier: 1 << 61,
        carrier_step: 1 << 49,
        code: chips_to_units(0.3),
        code_step: chips_to_units(1.023 / 4.0) as u64,
    };
    let i: Vec<f32> = (0..4000_u32).map(|k| (k * k % 61) as f32 - 30.0).collect();
    let mut room = RunningSums::default();
    let samples = Samples { sums: room.of(&i, &i), ..Samples::from((&i[..], &i[..])) };
    assert!(replica.takes_sums(&at));
    let taps = [0.25, 0.0, -0.25].map(chips_to_units);
    let [fast, slow] =
        [Arithmetic::Sums, Arithmetic::F64].map(|arithmetic| replica.correlate_in(arithmetic, samples, &at, &taps));
    // Noise of the sum is 25 LSB · √4000 = 1600. The carrier, of 3e-5 turns a sample, stands still over up to
    // 12 of them: errors of 1e-3 rad at most make 2 of that; tables and places are finer.
    assert!(fast.iter().zip(&slow).all(|(a, b)| (a - b).norm() < 16.0), "{fast:?} {slow:?}");
}

#[test]
fn a_butterworth_filter_passes_half_of_the_power_at_the_edges_of_its_band() {
    // |H|² = 1/(1 + (f/f_c)^2n) of the analogue one.
    for order in [2, 4, 6] {
        let shape = FilterShape::Butterworth { order };
        let filter = FilterSpec { shape, bandwidth_hz: 2e6, group_delay_s: 0.0, middle_hz: None };
        let response = Response::of(&filter, 1e8);
        for ratio in [0.3_f64, 0.9, 1.0, 1.2, 2.0] {
            let expected = 1.0 / (1.0 + ratio.powi(2 * order as i32));
            let found = response.power(ratio * 1e6);
            assert!((found / expected - 1.0).abs() < 0.01, "{order}, {ratio}: {found}, {expected}");
        }
    }
}
