//! Scenes, their samples, and whole receptions in memory.

use std::ops::Range;
use std::path::{Path, PathBuf};

use generator::scenario::{Overrides, Scenario};
use generator::scene::Scene;
use generator::stream::{Options, generate_part};
use generator::truth;
use gnss::record::{EventRow, Fix, LineRow, Observation, TrackingRow};
use gnss::satellite::Sv;
use gnss::time::Epoch;
use receiver::acquire::Acquired;
use receiver::output::Output;
use receiver::settings::Settings;
use receiver::source::Block;
use receiver::track::{Channel, Report, TrackingSettings};
use receiver::{Outcome, receive};

use crate::figures::Worst;

pub const START: &str = "2010-07-01T08:05:58";
pub const PLACE: &str =
    "[motion]\nkind = \"static\"\nlatitude_deg = 26.5123\nlongitude_deg = 80.2329\nheight_m = 130\n";
/// No atmosphere to correct.
pub const BARE: &str = "[receiver.position]\nionosphere = \"none\"\ntroposphere = \"none\"\n";

/// The directory of the extreme scenes.
pub fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("scenarios/extremes")
}

/// Reads a scene; its error is text.
pub fn try_scene(text: &str) -> Result<Scene, String> {
    try_scene_in(&folder(), text)
}

/// Reads a scene whose files are in a directory.
pub fn try_scene_in(directory: &Path, text: &str) -> Result<Scene, String> {
    let scenario = Scenario::parse(text, "extreme").map_err(|e| e.to_string())?;
    scenario.compose(directory, &Overrides::default()).map(|(scene, _)| scene).map_err(|e| e.to_string())
}

/// A scene of `tables` at the usual time.
pub fn text(duration_s: f64, tables: &str) -> String {
    format!("name = \"extreme\"\nstart = {START}\nduration_s = {duration_s}\nseed = 3\n{tables}")
}

/// A scene of `tables` at the usual time and place.
pub fn scene(duration_s: f64, tables: &str) -> Scene {
    try_scene(&text(duration_s, &format!("{PLACE}{tables}"))).unwrap()
}

/// The receiver's settings that a text carries.
pub fn settings(text: &str) -> Settings {
    let table: toml::Table = text.parse().unwrap();
    match table.get("receiver") {
        Some(toml::Value::Table(table)) => Settings::from_table(table.clone(), "extreme").unwrap(),
        _ => Settings::default(),
    }
}

/// The one satellite that stays, and no other.
pub fn only(mut scene: Scene, keep: &[Sv]) -> Scene {
    scene.excluded = scene.catalogue.satellites().filter(|sv| !keep.contains(sv)).collect();
    scene
}

/// Satellites in view at the start.
pub fn in_view(scene: &Scene) -> Vec<Sv> {
    let up = |sv: &Sv| truth::in_view(scene, *sv, scene.clock.start).unwrap();
    scene.catalogue.satellites().filter(|sv| !scene.excluded.contains(sv)).filter(up).collect()
}

/// A part of a scene's samples, its truth left in `directory`.
pub fn part(scene: &Scene, part: Range<u64>, directory: &Path) -> Vec<u8> {
    part_with(scene, part, directory, &Options::default())
}

/// A part of a scene's samples, made with the given division of the work and instruction set.
pub fn part_with(scene: &Scene, part: Range<u64>, directory: &Path, options: &Options) -> Vec<u8> {
    let mut bytes = Vec::new();
    std::fs::create_dir_all(directory).unwrap();
    let mut writer = truth::Writer::create(directory).unwrap();
    generate_part(scene, part, &mut bytes, &mut writer, &mut |_| (), options).unwrap();
    bytes
}

/// All samples of a scene.
pub fn samples(scene: &Scene) -> Vec<u8> {
    part(scene, 0..scene.samples, tempfile::tempdir().unwrap().path())
}

/// Unpacked samples.
pub fn planes(scene: &Scene, bytes: &[u8]) -> (Vec<f32>, Vec<f32>) {
    let (mut i, mut q) = (Vec::new(), Vec::new());
    scene.metadata.format.unpack(bytes, &mut i, &mut q);
    (i, q)
}

/// A reception with its truth.
pub struct Received {
    directory: tempfile::TempDir,
    pub outcome: Outcome,
}

/// Every row of a table.
pub fn rows<T: serde::de::DeserializeOwned>(directory: &Path, name: &str) -> Vec<T> {
    csv::Reader::from_path(directory.join(name)).unwrap().deserialize().map(Result::unwrap).collect()
}

impl Received {
    /// Generates and receives.
    pub fn of(scene: &Scene, settings: &Settings) -> Self {
        let directory = tempfile::tempdir().unwrap();
        let bytes = part(scene, 0..scene.samples, &directory.path().join("truth"));
        Self::from_bytes(scene, &bytes, settings, directory)
    }

    /// Receives given bytes as samples of the scene.
    pub fn from_bytes(scene: &Scene, bytes: &[u8], settings: &Settings, directory: tempfile::TempDir) -> Self {
        let rx = directory.path().join("rx");
        std::fs::create_dir_all(&rx).unwrap();
        let mut output = Output::create(&rx).unwrap();
        let outcome = receive(&scene.metadata, bytes, settings, &mut output, &mut |_| ()).unwrap();
        Self { directory, outcome }
    }

    pub fn fixes(&self) -> Vec<Fix> {
        rows(&self.directory.path().join("rx"), "fixes.csv")
    }

    pub fn events(&self) -> Vec<EventRow> {
        rows(&self.directory.path().join("rx"), "events.csv")
    }

    pub fn tracking(&self) -> Vec<TrackingRow> {
        rows(&self.directory.path().join("rx"), "tracking.csv")
    }

    /// Lines in the spectrum that the receiver told of.
    pub fn lines(&self) -> Vec<LineRow> {
        rows(&self.directory.path().join("rx"), "interference.csv")
    }

    pub fn truth(&self) -> Vec<Observation> {
        rows(&self.directory.path().join("truth"), "observations.csv")
    }

    /// True if every number in every table that the receiver wrote is finite.
    pub fn finite(&self) -> bool {
        ["observations", "fixes", "acquisition", "tracking"].iter().all(|name| {
            let path = self.directory.path().join("rx").join(format!("{name}.csv"));
            let mut table = csv::Reader::from_path(path).unwrap();
            table
                .records()
                .all(|row| row.unwrap().iter().all(|field| field.parse::<f64>().map_or(true, f64::is_finite)))
        })
    }

    /// Largest distance of a fix from where the antenna was, and the number of fixes.
    pub fn worst_m(&self, scene: &Scene, from_s: f64) -> (Worst, usize) {
        let (mut worst, mut count) = (Worst::default(), 0);
        for fix in self.fixes() {
            let t_s = scene.clock.rate.elapsed_s(fix.sample);
            if t_s < from_s {
                continue;
            }
            let local = scene.clock.epoch(fix.sample);
            let elapsed_s = scene.receiver_clock.true_elapsed_s(scene.clock.start, local);
            let error_m = (fix.position_m() - scene.trajectory.at(elapsed_s).position_m).norm();
            worst.take(error_m, || format!("{t_s:.1} s"));
            count += 1;
        }
        (worst, count)
    }
}

/// One channel started at a hit, with what it reported; ticks every `tick` samples.
pub fn track(scene: &Scene, bytes: &[u8], hit: &Acquired, settings: &TrackingSettings, tick: u64) -> (Channel, Report) {
    settings.validate(1e-3).unwrap();
    let mut channel = Channel::start(hit, &scene.metadata, settings);
    let mut report = Report::default();
    let block = (0.05 * scene.clock.rate.hz()) as usize;
    for (number, bytes) in bytes.chunks(block * scene.metadata.format.bytes()).enumerate() {
        let (i, q) = planes(scene, bytes);
        let from = (number * block) as u64;
        let ticks: Vec<u64> = (from..from + i.len() as u64).filter(|n| n.is_multiple_of(tick)).collect();
        channel.advance(&Block { first: from, i: &i, q: &q }, &ticks, &mut report);
    }
    (channel, report)
}

/// Hit of a perfect search for `sv` at sample 0, with errors added.
pub fn hit(scene: &Scene, sv: Sv, chips: f64, doppler_hz: f64) -> Acquired {
    let signal = scene.signals[0];
    let (row, ..) =
        truth::observe(scene, &generator::spoof::Constellation::authentic(), sv, signal, 0, 0.0).unwrap().unwrap();
    Acquired {
        sv,
        signal,
        sample: 0,
        code_phase_chips: ((row.sent_fraction_s * 1e3).fract() * 1023.0 + chips).rem_euclid(1023.0),
        doppler_hz: row.doppler_hz + doppler_hz,
        cn0_dbhz: row.cn0_dbhz,
    }
}

/// True pseudorange minus that of a measured code phase, within a code period, in metres.
pub fn code_error_m(scene: &Scene, sv: Sv, sample: u64, code_fraction: f64) -> f64 {
    let seen = truth::seen(scene, sv, scene.signals[0], scene.clock.epoch(sample)).unwrap().unwrap();
    let sent: Epoch = scene.clock.epoch(sample).plus_s(-seen.arrivals[0].delay_s);
    let periods = sent.fraction() * 1e3 - code_fraction;
    (periods - periods.round()) * 299_792.458
}
