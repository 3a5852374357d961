//! A sky for every signal: place, time and orbits of the shipped scenario of its system. And cases 1, 2, 4,
//! 6, 7 and 15 in each of them.

use std::path::Path;
use std::sync::Arc;

use generator::catalogue::Catalogue;
use generator::scene::Scene;
use generator::sky;
use generator::synth::Edge;
use generator::synth::waveform::Waveform;
use generator::transmit::Transmitter;
use generator::truth;
use generator::vehicle::Motion;
use gnss::broadcast::Ephemeris;
use gnss::earth::SPEED_OF_LIGHT_MPS;
use gnss::satellite::{Sv, System};
use gnss::signal::{Layers, SIGNALS, Signal};
use gnss::time::{Epoch, WEEK_S};
use rayon::prelude::*;

use crate::exact::{ONE, signed};
use crate::figures::{ALL, Worst, case};
use crate::run;

/// The scenario whose sky has satellites of a system.
fn scenario(system: System) -> &'static str {
    match system {
        System::Gps => "gps_l1c",
        System::Glonass => "glonass",
        System::Galileo => "galileo",
        System::BeiDou => "beidou",
        System::Qzss => "qzss_bands",
        System::Navic => "navic",
        System::Sbas => "sbas",
    }
}

/// Worst of each figure over all signals, which are computed side by side.
pub fn worst<const N: usize>(of: impl Fn(&'static Signal) -> [Worst; N] + Sync) -> [Worst; N] {
    let all: Vec<[Worst; N]> = SIGNALS.par_iter().map(|signal| of(signal)).collect();
    let mut found = all.into_iter();
    let mut worst = found.next().unwrap();
    found.for_each(|of| worst.iter_mut().zip(of).for_each(|(worst, of)| worst.merge(of)));
    worst
}

/// A scene of some signals of one system, with more tables: the satellites are those of the system's shipped
/// scenario, and there is nothing between them and the antenna.
pub fn scene(signals: &[&'static Signal], duration_s: f64, tables: &str) -> Scene {
    try_scene(signals, duration_s, tables, &toml::Table::new()).unwrap_or_else(|e| panic!("{}: {e}", signals[0]))
}

/// Such a scene with some keys of its own; its error is text.
pub fn try_scene(
    signals: &[&'static Signal],
    duration_s: f64,
    tables: &str,
    own: &toml::Table,
) -> Result<Scene, String> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenarios");
    let path = folder.join(scenario(signals[0].system)).with_extension("toml");
    let shipped: toml::Table = std::fs::read_to_string(path).unwrap().parse().unwrap();
    let mut kept = toml::Table::new();
    for key in ["start", "navigation", "motion"] {
        kept.extend(shipped.get(key).map(|value| (key.to_owned(), value.clone())));
    }
    let names: Vec<String> = signals.iter().map(|signal| signal.name.to_owned()).collect();
    kept.insert("signals".to_owned(), names.into());
    kept.insert("name".to_owned(), "extreme".into());
    kept.insert("duration_s".to_owned(), duration_s.into());
    kept.insert("seed".to_owned(), 3.into());
    kept.extend(own.clone());
    run::try_scene_in(&folder, &format!("{kept}\n{tables}"))
}

/// Front end and power of a scene without noise: one of a signal at a rate, its carrier `if_hz` above zero.
pub fn front_end(signal: &Signal, rate_hz: f64, if_hz: f64) -> String {
    format!(
        "[front_end]\ncenter_hz = {}\nsample_rate_hz = {rate_hz:e}\nformat = \"cf32\"\n[power]\ncn0_dbhz = 60\n",
        signal.centre_hz() - if_hz
    )
}

/// Satellites that send a signal and are in view at the start.
pub fn in_view(scene: &Scene, signal: &'static Signal) -> Vec<Sv> {
    let sent = |sv: &Sv| scene.signals_of(*sv).any(|own| own == signal);
    let up = |sv: &Sv| truth::in_view(scene, *sv, scene.clock.start).unwrap();
    scene.catalogue.satellites().filter(|sv| !scene.excluded.contains(sv)).filter(sent).filter(up).collect()
}

#[test]
fn every_signal_has_a_satellite_in_the_sky_of_its_system() {
    for signal in SIGNALS {
        let scene = scene(&[signal], 0.01, &front_end(signal, 65e6, 0.0));
        assert!(!in_view(&scene, signal).is_empty(), "{signal}");
    }
}

/// Rotation of the Earth by which a system's elements are printed.
fn rotation_radps(system: System) -> f64 {
    match system {
        // BDS-SIS-ICD-B1I 3.0, table 3-1 (CGCS2000).
        System::BeiDou => 7.292_115_0e-5,
        // IS-GPS-200N, table 20-IV; Galileo OS SIS ICD 2.1, table 66; IRNSS SIS ICD for SPS 1.1, appendix A.
        _ => 7.292_115_146_7e-5,
    }
}

/// A set `delta_s` later on the same Earth-fixed path: the node at the begin of its system's week turns with
/// it, a state vector stays.
fn moved(set: &Ephemeris, signal: &Signal, delta_s: i64) -> Ephemeris {
    let later = |at: Epoch| Epoch::new(at.seconds() + delta_s, at.fraction());
    let of_week = |at: Epoch| signal.time.label(at).tow_s();
    let turned = rotation_radps(signal.system) * (of_week(later(set.toe)) - of_week(set.toe));
    let omega0_rad = if set.vector.is_some() { set.omega0_rad } else { set.omega0_rad + turned };
    Ephemeris { omega0_rad: libm::remainder(omega0_rad, std::f64::consts::TAU), ..set.clone().timed(later) }
}

/// A scene in which each satellite has the set of its start alone, and the same `delta_s` later.
fn twins(signal: &'static Signal, delta_s: i64) -> [Scene; 2] {
    [0, delta_s].map(|delta_s| {
        let mut scene = scene(&[signal], 3.0, &front_end(signal, 65e6, 0.0));
        let start = scene.clock.start;
        let sets = in_view(&scene, signal).into_iter().filter_map(|sv| scene.catalogue.sent_at(sv, start).cloned());
        scene.catalogue = Arc::new(Catalogue::new(sets.map(|set| moved(&set, signal, delta_s)).collect()).0);
        scene.clock.start = Epoch::new(start.seconds() + delta_s, 0.0);
        scene
    })
}

/// Largest difference of pseudoranges between the skies of all signals and the same a second around an
/// instant of their time, which `edge` says by what their start reads.
fn worst_apart_m(edge: impl Fn(&Signal, Epoch) -> i64) -> Worst {
    let (mut worst_m, mut ranges) = (Worst::default(), 0);
    for signal in SIGNALS {
        let start = scene(&[signal], 3.0, &front_end(signal, 65e6, 0.0)).clock.start;
        // A second after the start.
        let [here, there] = twins(signal, edge(signal, start) - 1 - start.seconds());
        for sv in in_view(&here, signal) {
            for t_s in (0..=40).map(|k| 0.05 * f64::from(k)) {
                let delay_s = |scene: &Scene| {
                    let seen = truth::seen(scene, sv, signal, scene.clock.start.plus_s(t_s)).unwrap().unwrap();
                    seen.arrivals[0].delay_s
                };
                let apart_m = (delay_s(&here) - delay_s(&there)).abs() * SPEED_OF_LIGHT_MPS;
                worst_m.take(apart_m, || format!("{signal} of {sv}, {:.2} s from it", t_s - 1.0));
                ranges += 1;
            }
        }
    }
    assert!(ranges > 3000, "{ranges}");
    worst_m
}

#[test]
fn weeks_days_and_leap_seconds_of_every_system_are_no_step_in_range() {
    // The next end of the system's own week but one, and with it of its day.
    let week = worst_apart_m(|signal, start| start.seconds() - signal.time.label(start).tow_whole_s() + 2 * WEEK_S);
    // Angles of the moved sets are rounded again: 2π to 4.4e-16 rad at 4.2e7 m is 1.9e-8 m, a few times.
    case(1, "week rollover", ALL).at_most("pseudorange against the same sky in mid-week", week, 1e-6, "m");
    // The second inserted before 2017-01-01T00:00:00 UTC.
    let leap = worst_apart_m(|_, _| Epoch::parse("2016-12-31T23:59:60Z").unwrap().seconds());
    case(4, "leap second", ALL).at_most("pseudorange through it against the same sky of another year", leap, 1e-6, "m");
}

#[test]
fn half_a_week_from_its_reference_time_no_orbit_steps() {
    let the = case(2, "tk at ±302 400 s", ALL);
    let (mut step_m, mut radius_m, mut sets) = (Worst::default(), Worst::default(), 0);
    for signal in SIGNALS {
        let scene = scene(&[signal], 3.0, &front_end(signal, 65e6, 0.0));
        let start = scene.clock.start;
        for sv in scene.catalogue.satellites() {
            // In the Earth's centre.
            let still = Motion::at_rest(nalgebra::Vector3::zeros());
            if let Some(found) = sky::emission(&scene.catalogue, sv, start, &still).unwrap() {
                let (state, _) = scene.catalogue.truth(sv, start.plus_s(-found.travel_s)).unwrap().unwrap();
                radius_m.take((found.sight.range_m - state.position_m.norm()).abs(), || sv.to_string());
            }
            // State vectors are of minutes, not of weeks.
            let Some(set) = scene.catalogue.sent_at(sv, start).filter(|set| set.vector.is_none()) else { continue };
            for half_s in [-302_400.0, 302_400.0] {
                let (a, b) = (
                    set.state(set.toe.plus_s(half_s - 5e-7)).unwrap(),
                    set.state(set.toe.plus_s(half_s + 5e-7)).unwrap(),
                );
                // What the satellite flies in the microsecond between is taken out.
                let apart_m = (b.position_m - a.position_m - a.velocity_mps * 1e-6).norm();
                step_m.take(apart_m, || format!("{signal} of {sv}, {half_s} s"));
                sets += 1;
            }
        }
    }
    assert!(sets > 300, "{sets}");
    // An angle of 302 400 s times the Earth's rate, 22 rad, is rounded to 3.6e-15 rad, 1.5e-7 m at 4.2e7 m, a
    // few times.
    the.at_most("step of every system's orbits at the edge", step_m, 1e-6, "m");
    // Coordinates of 4.2e7 m resolve 7.5e-9 m, and a light time 2.8e-17 s, 8e-9 m.
    case(15, "geocentre", ALL).at_most("range less orbital radius, every system", radius_m, 1e-7, "m");
}

#[test]
fn a_part_of_every_signal_has_the_bits_that_the_whole_has_there() {
    let the = case(6, "start at any sample", ALL);
    // Filter, gain control and a noisy oscillator look back; codes end in the middle of parts.
    let tables = "[noise]\n[filter]\nkind = \"butterworth\"\norder = 4\nbandwidth_hz = 10e6\n[adc]\nbits = \
                  4\nagc_window_s = 0.001\n[receiver_clock]\nbias_s = 1e-3\noscillator = \"tcxo\"\n";
    let held: Vec<[usize; 2]> = SIGNALS
        .par_iter()
        .map(|signal| {
            let front = front_end(signal, 12.5e6, 0.0).replace("cf32", "ci8");
            let scene = scene(&[signal], 0.01, &format!("{front}{tables}"));
            let up: Vec<Sv> = in_view(&scene, signal).into_iter().take(1).collect();
            let scene = run::only(scene, &up);
            let directory = tempfile::tempdir().unwrap();
            let whole = run::samples(&scene);
            let parts = [0..1, 4095..4098, 12_499..25_001, 124_999..125_000];
            let same = parts.iter().filter(|part| {
                let bytes = run::part(&scene, (*part).clone(), directory.path());
                bytes == whole[2 * part.start as usize..2 * part.end as usize]
            });
            [same.count(), parts.len()]
        })
        .collect();
    let sum = |which: usize| held.iter().map(|held| held[which]).sum();
    the.all("parts of every signal equal to the whole, bit for bit", sum(0), sum(1));
}

#[test]
fn a_start_a_nanosecond_later_is_a_nanosecond_later_for_every_signal() {
    let the = case(7, "fractional start", ALL);
    let (mut code_m, mut carrier, mut range_m) = (Worst::default(), Worst::default(), Worst::default());
    for signal in SIGNALS {
        let whole = scene(&[signal], 1.0, &front_end(signal, 65e6, 0.0));
        let mut late = scene(&[signal], 1.0, &front_end(signal, 65e6, 0.0));
        late.clock.start = whole.clock.start.plus_s(1e-9);
        for sv in in_view(&whole, signal) {
            let input = || format!("{signal} of {sv}");
            let phases = |scene: &Scene| {
                let mut transmitter = Transmitter::new(scene, sv, signal, Edge::Nearest).unwrap().unwrap();
                transmitter.prepare(scene, 0, 4096).unwrap();
                transmitter.phases(scene, 0).unwrap()
            };
            let arrival = |scene: &Scene, at: Epoch| truth::seen(scene, sv, signal, at).unwrap().unwrap().arrivals[0];
            let waveform = Waveform::new(signal.link(sv), 0).unwrap().unwrap();
            let voices = waveform.voices(Layers::Whole, Edge::Nearest, 65e6).unwrap();
            let pace = voices[0].spreading.pace();
            let ((turns_a, a), (turns_b, b)) = (phases(&whole), phases(&late));
            let periods = (i128::from(b.period) - i128::from(a.period)) * (i128::from(pace.steps) << 48);
            let gained_s = (periods + b.phase() as i128 - a.phase() as i128) as f64 / ONE / pace.step_rate_hz();
            // What the satellite moved in the nanosecond is taken out.
            let later = arrival(&whole, whole.clock.start.plus_s(1e-9));
            let moved = (later.delay_s - arrival(&whole, whole.clock.start).delay_s, turns_a.wrapping_sub(turns_b));
            code_m.take((gained_s - 1e-9 + moved.0).abs() * SPEED_OF_LIGHT_MPS, input);
            carrier.take((signed(moved.1) - moved.0 * signal.carrier_hz(sv)).abs(), input);
            let same_s = arrival(&late, late.clock.start).delay_s - later.delay_s;
            range_m.take(same_s.abs() * SPEED_OF_LIGHT_MPS, input);
        }
    }
    // Two places of a code, each with a fraction of a second and a delay that resolve 1.1e-16 s, 3.3e-8 m,
    // and knots of 1e-4 cycle or 2.5e-5 m whose errors at two starts a nanosecond apart differ by a part in
    // 1e9.
    the.at_most("code against a nanosecond", code_m, 2e-7, "m");
    // Two sums of a delay, 0.08 s or 2e8 cycles, that resolve 3e-8, and the orbit's 7.5e-9 m of 0.12 m.
    the.at_most("carrier against a nanosecond's motion", carrier, 5e-7, "cycle");
    the.at_most("pseudorange against that of the later instant", range_m, 1e-7, "m");
}
