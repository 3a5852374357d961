//! Whole scenes: processor time of generator and receiver for a simulated second, and what the judge finds of
//! the observations and positions, at each level and with one knob changed at a time.

use std::path::Path;

use analysis::statistics::Spread;
use generator::scenario::{Overrides, Scenario};
use generator::scene::Scene;
use generator::stream::GenerateError;
use generator::truth;
use receiver::output::Output;
use receiver::settings::Settings;
use serde::Serialize;
use toml::{Table, Value};

/// A scene, how long it runs here, and how often it is timed.
struct Site {
    name: &'static str,
    seconds: f64,
    runs: usize,
}

const SITES: [Site; 6] = [
    Site { name: "static", seconds: 50.0, runs: 3 },
    Site { name: "two_systems", seconds: 45.0, runs: 1 },
    Site { name: "dual_band", seconds: 45.0, runs: 1 },
    Site { name: "full_sky", seconds: 4.0, runs: 1 },
    Site { name: "urban", seconds: 60.0, runs: 1 },
    Site { name: "high_dynamics", seconds: 60.0, runs: 1 },
];

/// Knobs of both sides that are changed one at a time, as keys of a scenario and their values.
const KNOBS: [&str; 25] = [
    "fidelity.code_edge = \"nearest\"",
    "fidelity.code_edge = \"band_limited\"",
    "fidelity.carrier = \"f64\"",
    "fidelity.noise = \"f64\"",
    "fidelity.knot_tolerance_cycles = 1e-2",
    "fidelity.knot_tolerance_cycles = 1e-6",
    "front_end.format = \"ci16\"",
    "adc.bits = 4",
    "adc.bits = 2",
    "adc.bits = 1",
    "filter = { kind = \"brick_wall\", bandwidth_hz = 2.2e6 }",
    "filter = { kind = \"butterworth\", order = 4, bandwidth_hz = 2.2e6 }",
    "receiver.tracking.arithmetic = \"i16\"",
    "receiver.tracking.arithmetic = \"f32\"",
    "receiver.tracking.arithmetic = \"f64\"",
    "receiver.tracking.replica = \"nearest\"",
    "receiver.tracking.integration = 1",
    "receiver.tracking.integration = 20",
    "receiver.tracking.spacing_chips = 0.25",
    "receiver.acquisition.noncoherent_sums = 1",
    "receiver.acquisition.noncoherent_sums = 20",
    "receiver.acquisition.cells_per_chip = 4.0",
    "receiver.position.smoothing_s = 0.0",
    "receiver.position.smoothing_s = 5.0",
    "receiver.tracking.dll_bandwidth_hz = 2.0",
];
/// Knobs of signals with layers, in the scene of two systems.
const LAYERS: [&str; 2] = ["fidelity.waveform = \"strongest\"", "receiver.tracking.waveform = \"strongest\""];

/// Cost and errors of a setting of a scene.
#[derive(Clone, Debug, Serialize)]
pub struct SceneRow {
    pub scene: String,
    pub simulated_s: f64,
    pub setting: String,
    pub runs: usize,
    /// Processor time for a simulated second, median and both ends of the runs.
    pub generator_s: f64,
    pub generator_low_s: f64,
    pub generator_high_s: f64,
    pub receiver_s: f64,
    pub receiver_low_s: f64,
    pub receiver_high_s: f64,
    pub fixes: usize,
    pub position_rms_m: Option<f64>,
    pub position_p95_m: Option<f64>,
    pub pseudorange_rms_m: Option<f64>,
    pub carrier_rms_cycles: Option<f64>,
    /// Expected less measured.
    pub cn0_loss_db: Option<f64>,
    /// Largest difference of the mean code errors of two signals, and what it is in an ionosphere-free sum of
    /// two bands.
    pub between_signals_m: Option<f64>,
    pub ionosphere_free_m: Option<f64>,
}

impl SceneRow {
    pub fn total_s(&self) -> f64 {
        self.generator_s + self.receiver_s
    }
}

/// Processor time of all threads of this program in seconds, to a hundredth.
fn processor_s() -> f64 {
    let text = std::fs::read_to_string("/proc/self/stat").unwrap();
    let fields: Vec<&str> = text.rsplit(')').next().unwrap().split_whitespace().collect();
    let ticks: f64 = [11, 12].map(|at: usize| fields[at].parse::<f64>().unwrap()).iter().sum();
    ticks / 100.0
}

/// Puts what `from` holds into `into`, table by table.
fn merge(into: &mut Table, from: Table) {
    for (key, value) in from {
        match (into.get_mut(&key), value) {
            (Some(Value::Table(old)), Value::Table(new)) if key != "filter" => merge(old, new),
            (_, value) => drop(into.insert(key, value)),
        }
    }
}

/// The scene's text with other values of some keys.
fn changed(site: &Site, changes: &[&str]) -> String {
    let text = std::fs::read_to_string(format!("scenarios/{}.toml", site.name)).unwrap();
    let mut table: Table = text.parse().unwrap();
    table.insert("duration_s".to_owned(), Value::Float(site.seconds));
    for change in changes {
        merge(&mut table, change.parse().unwrap());
    }
    toml::to_string(&table).unwrap()
}

fn scenes(text: &str, name: &str) -> Vec<Scene> {
    let scenario = Scenario::parse(text, name).unwrap();
    scenario.compose_all(Path::new("scenarios"), &Overrides::default()).unwrap().0
}

/// Sorted, so that the ends and the middle can be taken.
fn ends(mut values: Vec<f64>) -> [f64; 3] {
    values.sort_by(f64::total_cmp);
    [values[values.len() / 2], values[0], values[values.len() - 1]]
}

fn row(site: &Site, setting: &str, changes: &[&str]) -> SceneRow {
    let text = changed(site, changes);
    let scenes = scenes(&text, site.name);
    let settings = Settings::of_scenario(&text, site.name).unwrap();
    let (mut generator, mut receiver) = (Vec::new(), Vec::new());
    let mut summary = None;
    for _ in 0..site.runs {
        let alone = tempfile::tempdir().unwrap();
        let begin = processor_s();
        let mut writer = truth::Writer::create(alone.path()).unwrap();
        twin::feed::<GenerateError>(&scenes, &mut writer, &mut |_, _| Ok(())).unwrap();
        drop(writer);
        let generated = processor_s();
        let run = tempfile::tempdir().unwrap();
        for name in ["truth", "rx"] {
            std::fs::create_dir(run.path().join(name)).unwrap();
        }
        let mut writer = truth::Writer::create(&run.path().join("truth")).unwrap();
        let mut output = Output::create(&run.path().join("rx")).unwrap();
        twin::run(&scenes, &settings, &mut writer, &mut output).unwrap();
        drop((writer, output));
        let received = processor_s();
        generator.push((generated - begin) / site.seconds);
        receiver.push((received - generated - (generated - begin)) / site.seconds);
        summary = analysis::assess(run.path(), None).map_err(|error| println!("{setting}: {error}")).ok();
    }
    let found = summary.as_ref();
    let square = |spread: &Option<Spread>| spread.as_ref().map(|s| s.mean * s.mean + s.sigma * s.sigma);
    let position = found.and_then(|s| {
        let details = &s.details;
        Some((square(&details.east_m)? + square(&details.north_m)? + square(&details.up_m)?).sqrt())
    });
    let biases: Vec<f64> =
        found.iter().flat_map(|s| s.signals.values()).filter_map(|own| own.observables.pseudorange_bias_m).collect();
    let least = biases.iter().copied().fold(f64::INFINITY, f64::min);
    let most = biases.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let between = (biases.len() > 1).then_some(most - least);
    let ([generator_s, generator_low_s, generator_high_s], [receiver_s, receiver_low_s, receiver_high_s]) =
        (ends(generator), ends(receiver));
    let row = SceneRow {
        scene: site.name.to_owned(),
        simulated_s: site.seconds,
        setting: setting.to_owned(),
        runs: site.runs,
        generator_s,
        generator_low_s,
        generator_high_s,
        receiver_s,
        receiver_low_s,
        receiver_high_s,
        fixes: found.map_or(0, |s| s.position.fixes),
        position_rms_m: position,
        position_p95_m: found.and_then(|s| s.position.error_3d_p95_m),
        pseudorange_rms_m: found.and_then(|s| s.observables.pseudorange_rms_m),
        carrier_rms_cycles: found.and_then(|s| s.observables.carrier_rms_cycles),
        cn0_loss_db: found.and_then(|s| Some(s.details.cn0_effective_dbhz? - s.details.cn0_measured_dbhz?)),
        between_signals_m: between,
        ionosphere_free_m: between.filter(|_| scenes.len() > 1).map(|m| 2.6 * m),
    };
    println!("{row:?}");
    row
}

/// Rows of the scenes whose names hold `wanted`: each level, and the knobs of the static one and of that of
/// two systems.
pub fn measure(wanted: &str) -> Vec<SceneRow> {
    let mut rows = Vec::new();
    for site in SITES.iter().filter(|site| site.name.contains(wanted)) {
        for level in ["fast", "balanced", "reference"] {
            rows.push(row(site, level, &[&format!("fidelity.level = \"{level}\"")]));
        }
        let knobs: &[&str] = match site.name {
            "static" => &KNOBS,
            "two_systems" => &LAYERS,
            _ => &[],
        };
        rows.extend(knobs.iter().map(|knob| row(site, knob, &[knob])));
    }
    rows
}
