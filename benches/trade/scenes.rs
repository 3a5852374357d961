//! Whole scenes: processor time of generator and receiver for a simulated second, and what the judge finds of
//! the observations and positions, at each level and with one knob changed at a time.

use std::path::Path;

use analysis::judge::summary::Summary;
use analysis::statistics::{self, Spread};
use generator::plan::Plan;
use generator::scenario::{Overrides, Scenario};
use generator::scene::Scene;
use generator::stream::GenerateError;
use generator::truth;
use receiver::output::Output;
use receiver::settings::Settings;
use serde::Serialize;
use toml::{Table, Value};

/// A scene, how long it runs here, and how often, each time with another seed.
struct Site {
    name: &'static str,
    seconds: f64,
    runs: usize,
}

const SITES: [Site; 6] = [
    Site { name: "static", seconds: 50.0, runs: 3 },
    Site { name: "two_systems", seconds: 45.0, runs: 3 },
    Site { name: "dual_band", seconds: 45.0, runs: 2 },
    Site { name: "full_sky", seconds: 4.0, runs: 2 },
    Site { name: "urban", seconds: 60.0, runs: 3 },
    Site { name: "high_dynamics", seconds: 60.0, runs: 3 },
];

/// Seed of the first run of every setting; the next runs have the next seeds.
const SEED: i64 = 1;
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
    /// Processor time of the generator for a simulated second as `plan` states it.
    pub planned_s: f64,
    /// Mean number of fixes of a run.
    pub fixes: f64,
    /// Errors over all runs, and both ends of the position's by runs.
    pub position_rms_m: Option<f64>,
    pub position_low_m: Option<f64>,
    pub position_high_m: Option<f64>,
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

/// The scene's text for a run, with other values of some keys.
fn changed(site: &Site, run: usize, changes: &[&str]) -> String {
    let text = std::fs::read_to_string(format!("scenarios/{}.toml", site.name)).unwrap();
    let mut table: Table = text.parse().unwrap();
    table.insert("duration_s".to_owned(), Value::Float(site.seconds));
    table.insert("seed".to_owned(), Value::Integer(SEED + run as i64));
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

/// Processor time of one run in seconds, of the generator and of the receiver, and what the judge found.
struct Run {
    generator_s: f64,
    receiver_s: f64,
    summary: Option<Summary>,
}

fn run(site: &Site, number: usize, setting: &str, changes: &[&str]) -> Run {
    let text = changed(site, number, changes);
    let scenes = scenes(&text, site.name);
    let settings = Settings::of_scenario(&text, site.name).unwrap();
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
    Run {
        generator_s: generated - begin,
        receiver_s: processor_s() - generated - (generated - begin),
        summary: analysis::assess(run.path(), None).map_err(|error| println!("{setting}: {error}")).ok(),
    }
}

/// Root of the mean square of the errors of all fixes of a run.
fn position_m(summary: &Summary) -> Option<f64> {
    let details = &summary.details;
    let square = |spread: &Option<Spread>| spread.as_ref().map(|s| s.mean * s.mean + s.sigma * s.sigma);
    Some((square(&details.east_m)? + square(&details.north_m)? + square(&details.up_m)?).sqrt())
}

/// Largest difference of the mean code errors of two signals.
fn between_m(summary: &Summary) -> Option<f64> {
    let biases = || summary.signals.values().filter_map(|own| own.observables.pseudorange_bias_m);
    let most = biases().fold(f64::NEG_INFINITY, f64::max);
    (biases().count() > 1).then(|| most - biases().fold(f64::INFINITY, f64::min))
}

fn row(site: &Site, setting: &str, changes: &[&str]) -> SceneRow {
    let runs: Vec<Run> = (0..site.runs).map(|number| run(site, number, setting, changes)).collect();
    let cost = |of: fn(&Run) -> f64| ends(runs.iter().map(|run| of(run) / site.seconds).collect());
    let [generator_s, generator_low_s, generator_high_s] = cost(|run| run.generator_s);
    let [receiver_s, receiver_low_s, receiver_high_s] = cost(|run| run.receiver_s);
    let found = |of: &dyn Fn(&Summary) -> Option<f64>| -> Vec<f64> {
        runs.iter().filter_map(|run| of(run.summary.as_ref()?)).collect()
    };
    let mean = |of: &dyn Fn(&Summary) -> Option<f64>| statistics::mean(&found(of));
    let rms = |of: &dyn Fn(&Summary) -> Option<f64>| {
        statistics::mean(&found(of).into_iter().map(|x| x * x).collect::<Vec<_>>()).map(f64::sqrt)
    };
    let positions = found(&position_m);
    let between = mean(&between_m);
    let front_ends = scenes(&changed(site, 0, changes), site.name);
    // After the runs, when the stores of a process are full as they are in a long scene.
    let planned_s = front_ends.iter().map(|scene| Plan::of(scene).unwrap().time_s).sum::<f64>() / site.seconds;
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
        planned_s,
        fixes: mean(&|s| Some(s.position.fixes as f64)).unwrap_or(0.0),
        position_rms_m: rms(&position_m),
        position_low_m: positions.iter().copied().reduce(f64::min),
        position_high_m: positions.iter().copied().reduce(f64::max),
        position_p95_m: mean(&|s| s.position.error_3d_p95_m),
        pseudorange_rms_m: rms(&|s| s.observables.pseudorange_rms_m),
        carrier_rms_cycles: rms(&|s| s.observables.carrier_rms_cycles),
        cn0_loss_db: mean(&|s| Some(s.details.cn0_effective_dbhz? - s.details.cn0_measured_dbhz?)),
        between_signals_m: between,
        ionosphere_free_m: between.filter(|_| front_ends.len() > 1).map(|m| 2.6 * m),
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
