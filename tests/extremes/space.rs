//! Cases 16 and 17, and users in orbit: what they see, how it moves, and whether a receiver finds it.

use generator::fidelity::Grade;
use generator::ray::SPACE_M;
use generator::scene::{Fidelity, Scene};
use generator::spoof::Constellation;
use generator::stream::{Options, generate_part};
use generator::truth;
use gnss::earth::{EARTH_ROTATION_RADPS, Geodetic, SPEED_OF_LIGHT_MPS};
use gnss::gps::l1ca::L1_CA;
use gnss::satellite::Sv;
use gnss::signal::Signal;
use nalgebra::Vector3;
use receiver::acquire::search;
use receiver::source::Block;

use crate::figures::{CA, Case, Worst, case};
use crate::run::{self, Received};

pub fn text(name: &str) -> String {
    std::fs::read_to_string(run::folder().join(format!("{name}.toml"))).unwrap()
}

fn shipped(name: &str) -> Scene {
    run::try_scene(&text(name)).unwrap()
}

/// Doppler in inertial axes: the ratio of the two clocks' rates by the relativity-free equation of a moving
/// pair, all orders.
pub fn doppler_hz(scene: &Scene, (sv, signal): (Sv, &'static Signal), sample: u64, second_order: bool) -> f64 {
    let local = scene.clock.epoch(sample);
    let seen = truth::seen(scene, sv, signal, local).unwrap().unwrap();
    let sight = &seen.emission.sight;
    let w = Vector3::new(0.0, 0.0, EARTH_ROTATION_RADPS);
    let c = SPEED_OF_LIGHT_MPS;
    let from = sight.satellite.velocity_mps + w.cross(&sight.satellite.position_m);
    let user = sight.user_mps + w.cross(&sight.user_m);
    let ahead = (sight.satellite.position_m - sight.user_m).normalize();
    let (v_user, v_from) = (ahead.dot(&user) / c, ahead.dot(&from) / c);
    let clocks = (1.0 + seen.emission.satellite_clock_drift) / (1.0 + scene.receiver_clock.drift);
    let motion = if second_order { (1.0 + v_user) / (1.0 + v_from) } else { 1.0 + v_user - v_from };
    signal.carrier_hz(sv) * (clocks * motion - 1.0)
}

/// Largest deviation of the truth's Doppler from the equation, largest Doppler, largest second-order term,
/// Doppler rate.
fn dopplers(scene: &Scene, step_s: f64) -> [Worst; 4] {
    let mut most = <[Worst; 4]>::default();
    let rate_hz = scene.clock.rate.hz();
    let end_s = scene.clock.rate.elapsed_s(scene.samples);
    let mut t_s = 0.0;
    while t_s < end_s {
        let sample = (t_s * rate_hz) as u64;
        for sv in scene.catalogue.satellites() {
            if !truth::in_view(scene, sv, scene.clock.epoch(sample)).unwrap() {
                continue;
            }
            let authentic = Constellation::authentic();
            let truth_hz = |sample: u64| {
                let row = truth::observe(scene, &authentic, sv, &L1_CA, sample, 0.0).unwrap();
                row.map(|(row, ..)| row.doppler_hz)
            };
            let (Some(here_hz), Some(next_hz)) = (truth_hz(sample), truth_hz(sample + rate_hz as u64)) else {
                continue;
            };
            let exact_hz = doppler_hz(scene, (sv, &L1_CA), sample, true);
            let found = [
                here_hz - exact_hz,
                exact_hz,
                exact_hz - doppler_hz(scene, (sv, &L1_CA), sample, false),
                next_hz - here_hz,
            ];
            for (most, found) in most.iter_mut().zip(found) {
                most.take(found.abs(), || format!("{sv}, {t_s} s"));
            }
        }
        t_s += step_s;
    }
    most
}

/// Number of satellites that a search finds at their true position, number of those in view with at least
/// `least_dbhz`, and number of false hits. The satellites are those at the start.
fn found(name: &str, scene: &Scene, least_dbhz: f64) -> (usize, usize, usize) {
    let settings = run::settings(&text(name));
    let bytes = run::part(scene, 0..200_000, tempfile::tempdir().unwrap().path());
    let (i, q) = run::planes(scene, &bytes);
    let all: Vec<_> = L1_CA.satellites().map(|sv| L1_CA.link(sv)).collect();
    let rows = search(&scene.metadata, &Block { first: 0, i: &i, q: &q }, &all, &settings.acquisition).unwrap();
    let up = run::in_view(scene);
    let (mut held, mut of) = (0, 0);
    for sv in &up {
        let truth = run::hit(scene, *sv, 0.0, 0.0);
        if truth.cn0_dbhz < least_dbhz {
            continue;
        }
        of += 1;
        let near = |hit: &receiver::acquire::Acquired| {
            // Half a sample, and a bin of the refined search.
            run::code_error_m(scene, *sv, 0, hit.code_phase_chips / 1023.0).abs() < 60.0
                && (hit.doppler_hz - truth.doppler_hz).abs() < 125.0
        };
        held += usize::from(rows.iter().any(|(row, hit)| row.sv == *sv && hit.as_ref().is_some_and(near)));
    }
    let ghosts = rows.iter().filter(|(row, hit)| hit.is_some() && !up.contains(&row.sv)).count();
    (held, of, ghosts)
}

/// A second of samples in the middle keeps to the knots' tolerance.
fn knots_hold(the: Case, scene: &Scene) {
    let directory = tempfile::tempdir().unwrap();
    let mut writer = truth::Writer::create(directory.path()).unwrap();
    let first = scene.samples / 2;
    let part = first..first + 1_000_000;
    let options = Options::default();
    let done = generate_part(scene, part, &mut std::io::sink(), &mut writer, &mut |_| (), &options).unwrap();
    the.at_most(
        "carrier between knots",
        (done.worst_knot_cycles, "a second in the middle"),
        Fidelity::of(Grade::Balanced).knot_tolerance_cycles,
        "cycle",
    );
}

#[test]
fn above_the_satellites_the_earth_hides_what_it_covers_and_side_lobes_carry_the_rest() {
    let the = case(16, "h = −6.3e6 … 4e7 m", CA);
    let scene = shipped("geo");
    let (mut agree, mut of, mut seen, mut beyond) = (0, 0, 0, 0);
    let (mut off_deg, mut air_m) = (Worst::least(), Worst::default());
    let (mut brightest, mut faintest) = (Worst::default(), Worst::least());
    for longitude in (-180..180).step_by(15) {
        let mut scene = run::try_scene(&text("geo")).unwrap();
        let place = Geodetic::from_degrees(0.0, f64::from(longitude), 35_786_000.0).to_ecef();
        scene.trajectory = generator::vehicle::Trajectory::fixed(place);
        for sv in scene.catalogue.satellites() {
            let Some(truth) = truth::seen(&scene, sv, &L1_CA, scene.clock.start).unwrap() else { continue };
            let sight = &truth.emission.sight;
            // Least height of the straight line, by its points 20 km apart.
            let line = sight.satellite.position_m - sight.user_m;
            let steps = (line.norm() / 2e4) as u32;
            let height =
                |k: u32| Geodetic::from_ecef(&(sight.user_m + line * (f64::from(k) / f64::from(steps)))).height_m;
            let lowest_m = (0..=steps).map(height).fold(f64::INFINITY, f64::min);
            // Within a kilometre of the limb the two may differ by their steps and the height's meaning.
            if (lowest_m - 50e3).abs() > 1e3 {
                of += 1;
                agree += usize::from(scene.sees(sight) == (lowest_m > 50e3));
            }
            if scene.sees(sight) && sight.off_nadir_rad < 1.5 {
                seen += 1;
                let at = || format!("{sv} from {longitude}°");
                off_deg.take(sight.off_nadir_rad.to_degrees(), at);
                let delays_s = truth.rays[0].code_delay_s.abs() + truth.rays[0].carrier_delay_s.abs();
                air_m.take(delays_s * SPEED_OF_LIGHT_MPS, at);
                let cn0_dbhz = 10.0 * libm::log10(truth.arrivals[0].cn0_hz);
                brightest.take(cn0_dbhz, at);
                faintest.take(cn0_dbhz, at);
                beyond += usize::from(
                    sight.off_nadir_rad.to_degrees() > 16.0 && cn0_dbhz < 41.0
                        || sight.off_nadir_rad.to_degrees() <= 16.0,
                );
            }
        }
    }
    the.all("GEO: behind the Earth or not, against the line's own heights", agree, of);
    the.at_least("GEO: least angle off the satellite's nadir that is seen", off_deg, 13.7, "°");
    the.all("GEO: beyond 16° below 41 dB-Hz with 9 dBi", beyond, seen);
    // From the beam's edge at 13.9° (13.2 dBi) to its null at 22° (−10 dBi).
    let (most_db, span_db) = (brightest.value(), brightest.value() - faintest.value());
    the.at_least("GEO: brightest less faintest", (span_db, format!("brightest {most_db:.1} dB-Hz")), 20.0, "dB");
    let (held, of, ghosts) = found("geo", &scene, 38.0);
    the.all("GEO: acquired of those with 38 dB-Hz and more", held, of);
    the.none("GEO: acquired though absent", ghosts);
    let with_air = text("geo") + "[troposphere]\nmodel = \"saastamoinen\"\n[ionosphere]\nmodel = \"klobuchar\"\n";
    let scene = run::try_scene(&with_air.replace("[noise]", "")).unwrap();
    for sv in run::in_view(&scene) {
        let ray = truth::seen(&scene, sv, &L1_CA, scene.clock.start).unwrap().unwrap().rays[0];
        let delays_s = ray.code_delay_s.abs() + ray.carrier_delay_s.abs();
        air_m.take(delays_s * SPEED_OF_LIGHT_MPS, || format!("{sv} with air"));
    }
    the.at_most("GEO: delay of troposphere and ionosphere", air_m, 0.0, "m");
    let deep = text("geo").replace("35786000", "-6.3e6");
    the.all(
        "h = −6300 km: refused with its range",
        usize::from(run::try_scene(&deep).is_err_and(|e| e.contains("height_m") && e.contains("-12000"))),
        1,
    );
}

#[test]
fn a_low_orbit_has_the_dopplers_of_the_equation_and_a_receiver_finds_its_way() {
    let the = case(17, "LEO, 7.6 km/s", CA);
    let whole = run::try_scene(&text("leo").replace("duration_s = 40", "duration_s = 5677")).unwrap();
    let [apart_hz, most_hz, second_hz, rate_hzps] = dopplers(&whole, 53.0);
    the.at_most("truth's Doppler against the inertial equation", apart_hz, 1e-3, "Hz");
    the.at_least("largest Doppler of an orbit", most_hz.clone(), 35e3, "Hz");
    the.at_most("largest Doppler of an orbit", most_hz, 45e3, "Hz");
    // Fifty times what the comparison resolves, so that its absence would show.
    the.at_least("second-order term met", second_hz, 0.05, "Hz");
    the.at_most("Doppler rate", rate_hzps, 100.0, "Hz/s");
    let scene = shipped("leo");
    knots_hold(the, &scene);
    let (held, of, ghosts) = found("leo", &scene, 38.0);
    the.all("acquired of those with 38 dB-Hz and more", held, of);
    the.none("acquired though absent", ghosts);
    let received = Received::of(&scene, &run::settings(&text("leo")));
    let (worst_m, fixes) = received.worst_m(&scene, 0.0);
    the.at_least("fixes in 40 s from a cold start", (fixes as f64, "of 400 due"), 60.0, "");
    // As on the ground: 0.8 m on a range at 42 dB-Hz on average, PDOP 2, three sigma.
    the.at_most("fixes, 3-D", worst_m, 5.0, "m");
    let speed = |fix: &gnss::record::Fix| {
        let local = scene.clock.epoch(fix.sample);
        let t_s = scene.receiver_clock.true_elapsed_s(scene.clock.start, local);
        (fix.velocity_mps() - scene.trajectory.at(t_s).velocity_mps).norm()
    };
    // Lag of a third-order loop of 18 Hz at 0.02 Hz/s² is nothing; noise of 0.09 Hz is 0.02 m/s, times PDOP,
    // four sigma.
    let mut worst_mps = Worst::default();
    for fix in received.fixes() {
        worst_mps.take(speed(&fix), || format!("{:.1} s", scene.clock.rate.elapsed_s(fix.sample)));
    }
    the.at_most("velocity, 3-D", worst_mps, 0.5, "m/s");
}

#[test]
fn a_perigee_at_ten_kilometres_a_second_is_followed_and_found() {
    let the = case(54, "Molniya", CA);
    let whole = run::try_scene(&text("molniya").replace("duration_s = 60", "duration_s = 3000")).unwrap();
    let [apart_hz, most_hz, second_hz, _] = dopplers(&whole, 31.0);
    the.at_most("truth's Doppler against the inertial equation", apart_hz, 1e-3, "Hz");
    the.at_least("largest Doppler around the perigee", most_hz.clone(), 50e3, "Hz");
    the.at_most("largest Doppler around the perigee", most_hz, 62e3, "Hz");
    the.at_most("second-order term", second_hz, 3.0, "Hz");
    let scene = shipped("molniya");
    knots_hold(the, &scene);
    let (held, of, ghosts) = found("molniya", &scene, 40.0);
    the.all("acquired at the perigee", held, of);
    the.none("acquired though absent", ghosts);
}

#[test]
fn on_the_way_to_the_moon_signals_are_a_second_old_and_right() {
    let the = case(55, "lunar transfer", CA);
    let scene = shipped("lunar_transfer");
    let height_m = Geodetic::from_ecef(&scene.trajectory.at(0.0).position_m).height_m;
    the.at_least("height", (height_m, "the start"), 2e8, "m");
    let [apart_hz, ..] = dopplers(&scene, 13.0);
    the.at_most("truth's Doppler against the inertial equation", apart_hz, 1e-3, "Hz");
    let (mut worst_m, mut longest_s) = (Worst::default(), Worst::default());
    for sv in run::in_view(&scene) {
        let at = scene.clock.start;
        let seen = truth::seen(&scene, sv, &L1_CA, at).unwrap().unwrap();
        let (state, _) = scene.catalogue.truth(sv, at.plus_s(-seen.emission.travel_s)).unwrap().unwrap();
        let there = gnss::earth::rotate_earth(&state.position_m, seen.emission.travel_s);
        let range_m = (there - scene.trajectory.at(0.0).position_m).norm();
        worst_m.take((range_m - SPEED_OF_LIGHT_MPS * seen.emission.travel_s).abs(), || sv.to_string());
        longest_s.take(seen.emission.travel_s, || sv.to_string());
    }
    the.at_least("longest light time", longest_s, 0.7, "s");
    // Coordinates beyond 1.3e8 m are rounded to 1.5e-8 m.
    the.at_most("light-time equation", worst_m, 2e-7, "m");
    knots_hold(the, &scene);
    let (held, of, ghosts) = found("lunar_transfer", &scene, 40.0);
    the.all("acquired at 45 dB-Hz", held, of);
    the.none("acquired though absent", ghosts);
    assert!(SPACE_M < height_m);
}
