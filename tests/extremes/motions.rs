//! Cases 17, 24 to 27, 54 and 55 in the sky of every signal: guns, boosts, orbits, a hundredth of light's
//! speed and the zero of Doppler.
//!
//! Carrier and code are compared with the truth's arrivals in 128-bit integers, and the truth's Doppler with
//! the equation of two moving clocks in inertial axes.

use generator::scene::{CodeEdge, Scene};
use generator::spoof::Constellation;
use generator::synth::Edge;
use generator::synth::waveform::Waveform;
use generator::transmit::Transmitter;
use generator::truth;
use gnss::earth::{Geodetic, SPEED_OF_LIGHT_MPS};
use gnss::satellite::Sv;
use gnss::signal::{Layers, SIGNALS, Signal};
use nalgebra::Vector3;

use crate::dynamics::{G, after, along_from, gun, worst_of};
use crate::exact::{Exact, ONE, signed};
use crate::figures::{ALL, Case, Worst, case};
use crate::space::{doppler_hz, text};
use crate::{run, skies};

const RATE_HZ: f64 = 12.5e6;
/// Tolerance of the knots.
const KNOTS_CYCLES: f64 = 1e-4;
/// The knots' tolerance at the longest wave, and three of the 3.3e-8 m that seconds resolve.
const KNOTS_M: f64 = KNOTS_CYCLES * 0.255 + 1e-7;

/// A signal's sky, its first satellite in view, where the antenna is and where the satellite is from there.
struct Link {
    scene: Scene,
    signal: &'static Signal,
    sv: Sv,
    place: Vector3<f64>,
    way: Vector3<f64>,
}

impl Link {
    fn of(signal: &'static Signal, duration_s: f64, if_hz: f64) -> Self {
        let scene = skies::scene(&[signal], duration_s, &skies::front_end(signal, RATE_HZ, if_hz));
        let sv = skies::in_view(&scene, signal)[0];
        let seen = truth::seen(&scene, sv, signal, scene.clock.start).unwrap().unwrap();
        let sight = &seen.emission.sight;
        let (place, way) = (sight.user_m, (sight.satellite.position_m - sight.user_m).normalize());
        Self { scene, signal, sv, place, way }
    }

    /// Largest departure of carrier and code from the truth's arrivals over a time, at `count` places.
    fn departures(&self, [from_s, to_s]: [f64; 2], count: u64) -> (Worst, Worst) {
        let sample = |seconds: f64| (seconds * self.scene.clock.rate.hz()) as u64;
        worst_of(&self.scene, (self.sv, self.signal), (sample(from_s), sample(to_s)), count)
    }

    /// The truth's Doppler, and that of the equation.
    fn dopplers_hz(&self, sample: u64) -> Option<[f64; 2]> {
        dopplers_hz(&self.scene, self.sv, self.signal, sample)
    }

    fn at(&self, seconds: f64) -> String {
        format!("{} of {}, {seconds} s", self.signal, self.sv)
    }
}

fn dopplers_hz(scene: &Scene, sv: Sv, signal: &'static Signal, sample: u64) -> Option<[f64; 2]> {
    let (row, ..) = truth::observe(scene, &Constellation::authentic(), sv, signal, sample, 0.0).unwrap()?;
    Some([row.doppler_hz, doppler_hz(scene, (sv, signal), sample, true)])
}

#[track_caller]
fn knots_hold(the: Case, when: &str, carrier: Worst, code_m: Worst) {
    the.at_most(&format!("carrier between knots{when}"), carrier, KNOTS_CYCLES, "cycle");
    the.at_most(&format!("code between knots{when}"), code_m, KNOTS_M, "m");
}

#[test]
fn a_gun_is_followed_on_every_signal() {
    let the = case(24, "1000 g/s jerk, gun", ALL);
    let [carrier, code_m] = skies::worst(|signal| {
        let mut link = Link::of(signal, 4.0, 1e6);
        link.scene.trajectory = gun(link.place, link.way, 1.234_567_8, [0.01, 0.5]);
        link.departures([1.0, 2.0], 2000).into()
    });
    knots_hold(the, ", 10 ms of it", carrier, code_m);
}

#[test]
fn a_minute_of_twenty_g_keeps_code_carrier_and_doppler_of_every_signal() {
    let the = case(25, "20 g for 60 s", ALL);
    let [carrier, code_m, apart_hz, slowest_mps] = skies::worst(|signal| {
        let mut link = Link::of(signal, 60.5, 1e6);
        let begun = [0.0, 0.0, 0.0, 20.0 * G];
        link.scene.trajectory = along_from(link.place, link.way, &[begun, after(&begun, 61.0, 0.0)], Vec::new());
        let (carrier, code_m) = link.departures([59.0, 60.0], 1000);
        let (mut apart_hz, mut slowest_mps) = (Worst::default(), Worst::least());
        for second in 1..60 {
            let [here_hz, due_hz] = link.dopplers_hz(second * RATE_HZ as u64).unwrap();
            apart_hz.take((here_hz - due_hz).abs(), || link.at(second as f64));
        }
        let [last_hz, _] = link.dopplers_hz((59.9 * RATE_HZ) as u64).unwrap();
        slowest_mps.take(last_hz * signal.wavelength_m(link.sv), || link.at(59.9));
        [carrier, code_m, apart_hz, slowest_mps]
    });
    // 11.7 km/s, less what satellites recede by.
    the.at_least("speed along the ray after it", slowest_mps, 10.5e3, "m/s");
    the.at_most("truth's Doppler against the inertial equation", apart_hz, 1e-3, "Hz");
    knots_hold(the, "", carrier, code_m);
}

#[test]
fn a_hundredth_of_light_s_speed_is_flown_on_every_signal_and_a_tenth_refused() {
    let the = case(26, "speed above 0.1 c", ALL);
    let refused = SIGNALS.iter().filter(|signal| {
        let own: toml::Table =
            "[motion]\nkind = \"rocket\"\nlatitude_deg = 26.5\nlongitude_deg = 80.2\nheight_m = 130\n\
                                azimuth_deg = 0\nelevation_deg = 90\nignition_s = 0\nthrust_mps2 = 1e5\nburn_s = 600\n\
                                jerk_mps3 = 1e6\n"
                .parse()
                .unwrap();
        skies::try_scene(&[*signal], 700.0, &skies::front_end(signal, RATE_HZ, 0.0), &own)
            .is_err_and(|e| e.contains("motion") && e.contains("a tenth of light's"))
    });
    the.all("refused with the speed it reaches", refused.count(), SIGNALS.len());
    let [carrier, code_m, apart, moved_mps] = skies::worst(|signal| {
        let mut link = Link::of(signal, 1.0, 1e6);
        let begun = [0.0, 0.0, 0.01 * SPEED_OF_LIGHT_MPS, 0.0];
        link.scene.trajectory = along_from(link.place, link.way, &[begun, after(&begun, 2.0, 0.0)], Vec::new());
        let (carrier, code_m) = link.departures([0.2, 0.8], 1000);
        let (mut apart, mut moved_mps) = (Worst::default(), Worst::least());
        for tenth in 1..10 {
            let [here_hz, due_hz] = link.dopplers_hz(tenth * RATE_HZ as u64 / 10).unwrap();
            apart.take((here_hz / due_hz - 1.0).abs(), || link.at(0.1 * tenth as f64));
            moved_mps.take(here_hz * signal.wavelength_m(link.sv), || link.at(0.1 * tenth as f64));
        }
        [carrier, code_m, apart, moved_mps]
    });
    the.at_least("0.01 c: speed along the ray", moved_mps, 2.9e6, "m/s");
    the.at_most("0.01 c: truth's Doppler against the inertial equation, relative", apart, 1e-11, "");
    knots_hold(the, " at 0.01 c", carrier, code_m);
}

#[test]
fn at_the_zero_of_doppler_code_and_carrier_of_every_signal_stay_together() {
    let the = case(27, "Doppler zero crossing", ALL);
    let [zero_hz, parted_m, power] = skies::worst(|signal| {
        let mut link = Link::of(signal, 4.0, 0.0);
        // As fast as the satellite recedes in the middle, and 0.5 m/s² more.
        let still_mps = link.dopplers_hz((2.0 * RATE_HZ) as u64).unwrap()[1] * signal.wavelength_m(link.sv);
        let begun = [0.0, 0.0, -still_mps - 1.0, 0.5];
        link.scene.trajectory = along_from(link.place, link.way, &[begun, after(&begun, 5.0, 0.0)], Vec::new());
        let hz = |sample: u64| link.dopplers_hz(sample).unwrap()[0];
        let (mut low, mut high) = ((0.6 * RATE_HZ) as u64, (3.4 * RATE_HZ) as u64);
        assert!(hz(low) * hz(high) < 0.0, "{}", link.at(0.0));
        let begins = hz(low).signum();
        while high - low > 1 {
            let middle = (low + high) / 2;
            if hz(middle) * begins > 0.0 { low = middle } else { high = middle }
        }
        let input = || format!("{signal} of {}, sample {low}", link.sv);
        let mut transmitter = Transmitter::new(&link.scene, link.sv, signal, Edge::Nearest).unwrap().unwrap();
        let around = 1 << 22;
        transmitter.prepare_alone(&link.scene, low - around, low + around).unwrap();
        let waveform = Waveform::new(signal.link(link.sv), 0).unwrap().unwrap();
        let voices = waveform.voices(Layers::Whole, Edge::Nearest, RATE_HZ).unwrap();
        let pace = voices[0].spreading.pace();
        let exact = Exact::new(&link.scene, link.sv, signal);
        // Delays of code and carrier since the crossing: whole steps and a carrier at rest are exact.
        let of = |n: u64| {
            let (turns, place) = transmitter.phases(&link.scene, n).unwrap();
            let steps = i128::from(place.period) * (i128::from(pace.steps) << 48) + place.phase() as i128;
            let late = exact.steps(n, 0, (pace.step_rate_hz() * 1e3).round() as i128) - steps;
            (late, exact.carrier(n, 0).wrapping_sub(turns))
        };
        let (mut zero_hz, mut parted_m, mut power) = (Worst::default(), Worst::default(), Worst::least());
        zero_hz.take(hz(low).abs(), input);
        let (code, carrier) = of(low);
        for k in -40..40_i64 {
            let n = low.wrapping_add_signed(k * 100_003);
            let (own_code, own_carrier) = of(n);
            let code_m = (own_code - code) as f64 / ONE / pace.step_rate_hz() * SPEED_OF_LIGHT_MPS;
            let wave_m = signal.wavelength_m(link.sv);
            let carrier_m = signed(own_carrier.wrapping_sub(carrier)) * wave_m;
            let apart = (code_m - carrier_m) / wave_m;
            parted_m.take((apart - apart.round()).abs() * wave_m, || format!("{signal} of {}, sample {n}", link.sv));
        }
        let mut alone = run::only(link.scene, &[link.sv]);
        // All power is kept.
        alone.fidelity.code_edge = CodeEdge::Nearest;
        let bytes = run::part(&alone, low..low + 12_500, tempfile::tempdir().unwrap().path());
        let (i, q) = run::planes(&alone, &bytes);
        let sum: f64 = i.iter().zip(&q).map(|(i, q)| f64::from(*i).powi(2) + f64::from(*q).powi(2)).sum();
        let due = 12_500.0 * f64::from(alone.noise_lsb).powi(2) * 2.0 * 1e6 / RATE_HZ;
        power.take(sum / due, || format!("{signal} of {}, 1 ms from sample {low}", link.sv));
        [zero_hz, parted_m, power]
    });
    the.at_most("Doppler at the crossing", zero_hz, 1e-3, "Hz");
    // Two places of a code and two of a carrier, each with a delay and a fraction of a second that resolve
    // 3.3e-8 m.
    the.at_most("code and carrier around the crossing, parted by", parted_m, 2e-7, "m");
    // Layers that add have most of it where their signs are equal, which 1 ms holds to a few hundredths.
    the.at_least("power of the samples there, of the signal's", power, 0.9, "");
}

/// The sky of a signal seen from a shipped orbit whose node stands over the sky's own place.
fn in_orbit(signal: &'static Signal, name: &str) -> Scene {
    let shipped: toml::Table = text(name).parse().unwrap();
    let front = skies::front_end(signal, RATE_HZ, 1e6);
    let ground = skies::scene(&[signal], 1.0, &front);
    let place = Geodetic::from_ecef(&ground.trajectory.at(0.0).position_m);
    let mut motion = shipped["motion"].as_table().unwrap().clone();
    motion.insert("node_longitude_deg".to_owned(), place.longitude_rad.to_degrees().into());
    let own = toml::Table::from_iter([("motion".to_owned(), motion.into())]);
    skies::try_scene(&[signal], 600.0, &front, &own).unwrap_or_else(|e| panic!("{signal}: {e}"))
}

#[test]
fn orbits_have_the_dopplers_of_the_equation_on_every_signal() {
    for (the, name, least_mps) in [
        (case(17, "LEO, 7.6 km/s", ALL), "leo", 6e3),
        (case(54, "Molniya", ALL), "molniya", 8e3),
        (case(55, "lunar transfer", ALL), "lunar_transfer", 2e3),
    ] {
        let [carrier, code_m, apart_hz, most_mps] = skies::worst(|signal| {
            let scene = in_orbit(signal, name);
            let own = |sv: &Sv| scene.signals_of(*sv).any(|own| own == signal);
            let (mut apart_hz, mut most_mps) = (Worst::default(), Worst::default());
            let mut first = None;
            for sv in scene.catalogue.satellites().filter(own) {
                for second in (0..600).step_by(60) {
                    let sample = second * RATE_HZ as u64;
                    if !truth::in_view(&scene, sv, scene.clock.epoch(sample)).unwrap() {
                        continue;
                    }
                    let Some([here_hz, due_hz]) = dopplers_hz(&scene, sv, signal, sample) else { continue };
                    let at = || format!("{signal} of {sv}, {second} s");
                    apart_hz.take((here_hz - due_hz).abs(), at);
                    most_mps.take(here_hz.abs() * signal.wavelength_m(sv), at);
                    first.get_or_insert((sv, second));
                }
            }
            let (sv, second) = first.unwrap_or_else(|| panic!("{name}: nothing of {signal} in view"));
            let from = second * RATE_HZ as u64;
            let (carrier, code_m) = worst_of(&scene, (sv, signal), (from, from + RATE_HZ as u64), 500);
            [carrier, code_m, apart_hz, most_mps]
        });
        the.at_most("truth's Doppler against the inertial equation", apart_hz, 1e-3, "Hz");
        the.at_least("largest speed along a ray", most_mps, least_mps, "m/s");
        knots_hold(the, "", carrier, code_m);
    }
}
