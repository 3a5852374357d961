//! A sky for every signal: place, time and orbits of the shipped scenario of its system.

use std::collections::BTreeMap;
use std::path::Path;

use gnss_twin::generator::scene::Scene;
use gnss_twin::generator::truth;
use gnss_twin::gnss::satellite::{Sv, System};
use gnss_twin::gnss::signal::{SIGNALS, Signal};

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

/// A scene of some signals of one system, with more tables: the satellites are those of the system's shipped
/// scenario, and there is nothing between them and the antenna.
pub fn scene(signals: &[&'static Signal], duration_s: f64, tables: &str) -> Scene {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenarios");
    let path = folder.join(scenario(signals[0].system)).with_extension("toml");
    let shipped: toml::Table = std::fs::read_to_string(path).unwrap().parse().unwrap();
    let mut kept = toml::Table::new();
    for key in ["start", "navigation", "motion"] {
        kept.extend(shipped.get(key).map(|value| (key.to_owned(), value.clone())));
    }
    let names: Vec<String> = signals.iter().map(|signal| signal.name.to_owned()).collect();
    kept.insert("signals".to_owned(), names.clone().into());
    kept.insert("name".to_owned(), "extreme".into());
    kept.insert("duration_s".to_owned(), duration_s.into());
    kept.insert("seed".to_owned(), 3.into());
    run::try_scene_in(&folder, &format!("{kept}\n{tables}")).unwrap_or_else(|e| panic!("{names:?}: {e}"))
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

/// Signals by their systems, in the order of the catalogue.
pub fn systems() -> BTreeMap<System, Vec<&'static Signal>> {
    let mut systems: BTreeMap<System, Vec<&'static Signal>> = BTreeMap::new();
    for signal in SIGNALS {
        systems.entry(signal.system).or_default().push(signal);
    }
    systems
}

#[test]
fn every_signal_has_a_satellite_in_the_sky_of_its_system() {
    for signal in SIGNALS {
        let scene = scene(&[signal], 0.01, &front_end(signal, 65e6, 0.0));
        assert!(!in_view(&scene, signal).is_empty(), "{signal}");
    }
}
