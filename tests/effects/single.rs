//! One satellite through the generator and one tracking channel, started where truth says.

use std::path::Path;

use generator::scenario::{Overrides, Scenario};
use generator::scene::Scene;
use generator::stream::{Options, generate_with};
use generator::truth;
use gnss::record::Observation;
use gnss::satellite::Sv;
use receiver::acquire::Acquired;
use receiver::source::Block;
use receiver::track::{Channel, Measurement, Report, TrackingSettings};

const PLACE: &str = "name = \"single\"\nstart = 2010-07-01T08:05:58\nseed = 3\n[motion]\nkind = \"static\"\n\
                     latitude_deg = 26.5123\n\
    longitude_deg = 80.2329\nheight_m = 130\n";

/// A static scene of `tables` in which `sv` is alone.
pub fn scene(sv: Sv, duration_s: f64, tables: &str) -> Scene {
    let scenario = Scenario::parse(&format!("duration_s = {duration_s}\n{PLACE}{tables}"), "single").unwrap();
    let (mut scene, _) = scenario.compose(Path::new("scenarios"), &Overrides::default()).unwrap();
    scene.excluded = scene.catalogue.satellites().filter(|other| *other != sv).collect();
    scene
}

/// The samples of a scene, and its truth left in `directory`.
pub fn samples(scene: &Scene, directory: &Path) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut writer = truth::Writer::create(directory).unwrap();
    generate_with(scene, &mut bytes, &mut writer, &mut |_| (), &Options::default()).unwrap();
    bytes
}

/// Every row of a table of the truth.
pub fn rows<T: serde::de::DeserializeOwned>(directory: &Path, name: &str) -> Vec<T> {
    csv::Reader::from_path(directory.join(name)).unwrap().deserialize().map(Result::unwrap).collect()
}

/// Truth and measurement at each instant of the truth at which the channel had locked.
pub fn track(scene: &Scene, settings: &TrackingSettings) -> (Vec<(Observation, Measurement)>, tempfile::TempDir) {
    let (truth, report, directory) = follow(scene, settings);
    let seen = report.measurements.iter().filter(|m| m.locked);
    let pairs = seen.filter_map(|m| Some((truth.iter().find(|row| row.sample == m.sample)?.clone(), *m))).collect();
    (pairs, directory)
}

/// The truth, and all that a channel reports.
pub fn follow(scene: &Scene, settings: &TrackingSettings) -> (Vec<Observation>, Report, tempfile::TempDir) {
    let directory = tempfile::tempdir().unwrap();
    let bytes = samples(scene, directory.path());
    let truth: Vec<Observation> = rows(directory.path(), "observations.csv");
    let first = &truth[0];
    settings.validate(1e-3).unwrap();
    let hit = Acquired {
        sv: first.sv,
        signal: first.signal,
        sample: first.sample,
        code_phase_chips: (first.sent_fraction_s * 1e3).fract() * 1023.0,
        doppler_hz: first.doppler_hz,
        cn0_dbhz: first.cn0_dbhz,
    };
    let mut channel = Channel::start(&hit, &scene.metadata, settings);
    let mut report = Report::default();
    let size = scene.metadata.format.bytes();
    let block = (0.05 * scene.clock.rate.hz()) as usize;
    for (number, bytes) in bytes.chunks(block * size).enumerate() {
        let (mut i, mut q) = (Vec::new(), Vec::new());
        scene.metadata.format.unpack(bytes, &mut i, &mut q);
        let from = (number * block) as u64;
        let inside = from..from + i.len() as u64;
        let ticks: Vec<u64> = truth.iter().map(|row| row.sample).filter(|n| inside.contains(n)).collect();
        channel.advance(&Block { first: from, i: &i, q: &q }, &ticks, &mut report);
    }
    assert!(!channel.is_lost());
    (truth, report, directory)
}

/// Measured pseudorange less the true one in metres, within a code period.
pub fn code_error_m(truth: &Observation, measured: &Measurement) -> f64 {
    let periods = truth.sent_fraction_s * 1e3 - measured.code_fraction;
    (periods - periods.round()) * 299_792.458
}
