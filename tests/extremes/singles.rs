//! Cases 11, 14, 19 and 22 in the sky of every signal: sets at the end of their age, both names of one
//! meridian, a satellite overhead and at the antenna, and two rays of one satellite.

use std::f64::consts::FRAC_PI_2;

use generator::catalogue::Catalogue;
use generator::effect::ionosphere::KlobucharIonosphere;
use generator::ray::{Effect, Ray, Sight};
use generator::scene::Scene;
use generator::sky;
use generator::truth;
use generator::vehicle::{Motion, Trajectory};
use gnss::broadcast::{Ephemeris, OrbitError};
use gnss::earth::{Geodetic, SPEED_OF_LIGHT_MPS};
use gnss::rinex;
use gnss::satellite::{Sv, System};
use gnss::signal::{SIGNALS, Signal};
use nalgebra::Vector3;
use rayon::prelude::*;

use crate::codes::senders;
use crate::figures::{ALL, Worst, case};
use crate::{run, skies};

/// Seconds after its reference time at which a set is sent no longer, where no newer one is known.
fn last_s(set: &Ephemeris) -> f64 {
    match set.sv.system {
        // IS-GPS-200N, 20.3.4.4, table 20-XII: four hours around it.
        System::Gps => 7200.0,
        // IS-QZSS-PNT-005, 4.1.2.4: two hours around it.
        System::Qzss => 3600.0,
        // No document states an end.
        System::Galileo | System::BeiDou | System::Navic => 14_400.0,
        // GLONASS ICD L1, L2 5.1, 4.4, P1: in the middle of half an hour.
        System::Glonass => 900.0,
        // RTCA DO-229D, table A-25: twelve minutes around it.
        System::Sbas => 360.0,
    }
}

#[test]
fn sets_of_every_system_are_sent_no_longer_than_they_fit() {
    let the = case(11, "ephemeris age", ALL);
    let (mut held, mut of, mut refused) = (0, 0, 0);
    for signal in SIGNALS {
        let scene = skies::scene(&[signal], 1.0, &skies::front_end(signal, 65e6, 0.0));
        for sv in skies::in_view(&scene, signal) {
            let Some(set) = scene.catalogue.sent_at(sv, scene.clock.start).filter(|set| !set.long_fit) else {
                continue;
            };
            let alone = Catalogue::new(vec![set.clone()]).0;
            let sent = |age_s: f64| alone.sent_at(sv, set.toe.plus_s(age_s)).is_some();
            let last_s = last_s(set);
            let edges = [(last_s - 0.1, true), (last_s, false), (last_s + 86_400.0, false), (-86_400.0, false)];
            held += edges.iter().filter(|(age_s, is_sent)| sent(*age_s) == *is_sent).count();
            of += edges.len();
        }
        // Two days after the file of its orbits.
        let start = scene.clock.start.plus_s(172_800.0);
        let late: toml::Table = format!("start = {start}").parse().unwrap();
        let late = skies::try_scene(&[signal], 1.0, &skies::front_end(signal, 65e6, 0.0), &late);
        refused += usize::from(late.is_err_and(|e| e.contains("navigation")));
    }
    the.all("sets of every system: sent to the end of their fit and no longer", held, of);
    the.all("scene two days after its file: refused with the file's span", refused, SIGNALS.len());
}

/// A sky through a troposphere and an ionosphere.
fn through_air(signal: &'static Signal) -> Scene {
    let front = skies::front_end(signal, 65e6, 0.0);
    let mut scene = skies::scene(&[signal], 1.0, &format!("{front}[troposphere]\nmodel = \"saastamoinen\"\n"));
    let model = rinex::embedded().unwrap().klobuchar.unwrap();
    scene.effects.push(Box::new(KlobucharIonosphere::of_gps(model)));
    scene
}

#[test]
fn on_both_sides_of_the_antimeridian_ranges_of_every_signal_are_the_same() {
    let the = case(14, "antimeridian", ALL);
    let [worst] = skies::worst(|signal| {
        let mut scene = through_air(signal);
        let mut worst = Worst::default();
        for sv in senders(&scene, signal) {
            let mut delay_s = |longitude_deg: f64| {
                scene.trajectory = Trajectory::fixed(Geodetic::from_degrees(-16.5, longitude_deg, 30.0).to_ecef());
                Some(truth::seen(&scene, sv, signal, scene.clock.start).unwrap()?.arrivals.first()?.delay_s)
            };
            let (Some(east_s), Some(west_s)) = (delay_s(180.0), delay_s(-180.0)) else { continue };
            let apart_m = (east_s - west_s).abs() * SPEED_OF_LIGHT_MPS;
            worst.take(apart_m, || format!("{signal} of {sv}"));
        }
        [worst]
    });
    // The sine of π is 1.2e-16 in either direction, a nanometre; a delay resolves 8e-9 m.
    the.at_most("pseudorange with atmosphere, 180° against −180°", worst, 1e-7, "m");
}

#[test]
fn overhead_and_at_the_antenna_the_satellites_of_every_signal_are_finite_or_refused() {
    let the = case(19, "satellite at the zenith, and at the antenna", ALL);
    let found: Vec<([usize; 3], Worst)> = SIGNALS
        .par_iter()
        .map(|signal| {
            let mut scene = through_air(signal);
            let at = scene.clock.start;
            let ([mut finite, mut refused, mut of], mut worst) = ([0; 3], Worst::default());
            for sv in senders(&scene, signal) {
                let Some((state, _)) = scene.catalogue.truth(sv, at).unwrap() else { continue };
                // Below the satellite on the ellipsoid, then the same after its signal's flight.
                let under = |m: &Vector3<f64>| Geodetic { height_m: 0.0, ..Geodetic::from_ecef(m) }.to_ecef();
                let mut place = under(&state.position_m);
                for _ in 0..6 {
                    let seen = sky::emission(&scene.catalogue, sv, at, &Motion::at_rest(place)).unwrap().unwrap();
                    place = under(&seen.sight.satellite.position_m);
                }
                scene.trajectory = Trajectory::fixed(place);
                let seen = truth::seen(&scene, sv, signal, at).unwrap().unwrap();
                let (look, arrival) = (seen.emission.sight.look, seen.arrivals[0]);
                let all = [look.azimuth_rad, arrival.delay_s, arrival.carrier_cycles];
                finite += usize::from(all.iter().all(|x| x.is_finite()) && arrival.cn0_hz > 0.0);
                worst.take((FRAC_PI_2 - look.elevation_rad).abs(), || format!("{signal} of {sv}"));
                // In the satellite, to a millimetre.
                let inside = Motion::at_rest(state.position_m + Vector3::new(1e-3, 0.0, 0.0));
                let near = sky::emission(&scene.catalogue, sv, at, &inside);
                refused += usize::from(matches!(near, Err(OrbitError::Near { .. })));
                of += 1;
            }
            ([finite, refused, of], worst)
        })
        .collect();
    let mut worst = Worst::default();
    let sum = |which: usize| found.iter().map(|(counts, _)| counts[which]).sum();
    let (finite, refused, of) = (sum(0), sum(1), sum(2));
    found.into_iter().for_each(|(_, of)| worst.merge(of));
    the.all("overhead: everything finite", finite, of);
    the.at_most("overhead: zenith distance", worst, 1e-6, "rad");
    the.all("at the antenna: refused", refused, of);
}

const EXCESS_M: f64 = 600.0;
const AMPLITUDE: f64 = 0.4;

/// The echo alone in place of the direct ray: later, weaker, and with the reflection's quarter of a turn.
struct Echo;

impl Effect for Echo {
    fn name(&self) -> &'static str {
        "echo alone"
    }

    fn describe(&self) -> String {
        String::new()
    }

    fn act(&self, _: &Sight, _: &Signal, rays: &mut Vec<Ray>) {
        for ray in rays {
            ray.code_delay_s += EXCESS_M / SPEED_OF_LIGHT_MPS;
            ray.carrier_delay_s += EXCESS_M / SPEED_OF_LIGHT_MPS;
            ray.phase_cycles -= 0.25;
            ray.cn0_hz *= AMPLITUDE * AMPLITUDE;
        }
    }
}

#[test]
fn two_rays_of_one_satellite_are_the_sum_of_each_alone_on_every_signal() {
    let the = case(22, "one PRN twice", ALL);
    let [worst] = skies::worst(|signal| {
        let front = skies::front_end(signal, 12.5e6, 1e6);
        let scene = |tables: &str| {
            let scene = skies::scene(&[signal], 0.01, &format!("{front}{tables}"));
            let up: Vec<Sv> = skies::in_view(&scene, signal).into_iter().take(1).collect();
            run::only(scene, &up)
        };
        let samples =
            |scene: &Scene| run::planes(scene, &run::part(scene, 5000..30_000, tempfile::tempdir().unwrap().path()));
        let echo = format!(
            "[[multipath]]\nkind = \"given\"\nexcess_m = {EXCESS_M}\namplitude = {AMPLITUDE}\nphase_deg = 90\n"
        );
        let (direct, both) = (scene(""), scene(&echo));
        let mut alone = scene("");
        alone.effects.push(Box::new(Echo));
        let [direct, both, alone] = [samples(&direct), samples(&both), samples(&alone)];
        let amplitude = direct.0.iter().zip(&direct.1).map(|(i, q)| i.hypot(*q)).fold(0.0, f32::max);
        let planes = [(&direct.0, &both.0, &alone.0), (&direct.1, &both.1, &alone.1)];
        let mut worst = Worst::default();
        for (direct, both, alone) in planes {
            for (n, ((direct, both), alone)) in direct.iter().zip(both).zip(alone).enumerate() {
                let apart = f64::from(*both) - f64::from(*direct) - f64::from(*alone);
                let at = || format!("{signal}, sample {}", 5000 + n);
                worst.take(apart.abs() / f64::from(amplitude), at);
            }
        }
        [worst]
    });
    // Within a run the carrier of single precision is 1e-6 cycle off, 6.3e-6 rad.
    the.at_most("ray and echo together less each alone, of the amplitude", worst, 1e-5, "");
}
