//! Runs of scenes at both levels, and the figures that the judge finds in them.

use std::collections::BTreeMap;
use std::fs::{File, OpenOptions};
use std::path::Path;

use analysis::Summary;
use generator::fidelity::Grade;
use generator::scenario::{Overrides, Scenario};
use receiver::output::Output;
use receiver::settings::Settings;
use serde::{Deserialize, Serialize};
use twin::TwinError;

/// A scene, how long it runs here, and its number of seeds at the level of samples.
pub struct Site {
    pub name: &'static str,
    pub seconds: f64,
    pub seeds: u64,
}

/// Seeds at the level of correlations for one at the level of samples.
pub const SEEDS_PER_SEED: u64 = 3;
/// First seed at the level of correlations less one, so that no random numbers are common to both levels.
const OTHER_SEEDS: u64 = 1000;

/// Scenes that both levels take.
pub const SITES: [Site; 18] = [
    Site { name: "static", seconds: 45.0, seeds: 20 },
    Site { name: "moderate", seconds: 45.0, seeds: 20 },
    Site { name: "high_dynamics", seconds: 60.0, seeds: 20 },
    Site { name: "urban", seconds: 45.0, seeds: 20 },
    Site { name: "scintillation", seconds: 45.0, seeds: 20 },
    Site { name: "oscillator", seconds: 45.0, seeds: 20 },
    Site { name: "satellite_faults", seconds: 80.0, seeds: 20 },
    Site { name: "sbas", seconds: 40.0, seeds: 20 },
    Site { name: "qzss", seconds: 45.0, seeds: 20 },
    Site { name: "navic", seconds: 60.0, seeds: 20 },
    Site { name: "glonass", seconds: 30.0, seeds: 20 },
    Site { name: "beidou", seconds: 35.0, seeds: 20 },
    Site { name: "galileo", seconds: 40.0, seeds: 20 },
    Site { name: "two_systems", seconds: 40.0, seeds: 20 },
    Site { name: "beidou_b2a", seconds: 25.0, seeds: 20 },
    Site { name: "gps_l1c", seconds: 30.0, seeds: 20 },
    Site { name: "beidou_b1c", seconds: 30.0, seeds: 20 },
    Site { name: "qzss_bands", seconds: 35.0, seeds: 20 },
];

/// One figure of a run.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Row {
    pub scene: String,
    pub level: String,
    pub seed: u64,
    pub simulated_s: f64,
    /// Processor time of generator and receiver.
    pub processor_s: f64,
    pub figure: String,
    pub unit: String,
    pub value: f64,
}

/// Runs that were made, in a file.
pub struct Store {
    pub rows: Vec<Row>,
    file: csv::Writer<File>,
}

impl Store {
    /// Opens the file; `fresh` empties it.
    pub fn open(path: &Path, fresh: bool) -> Self {
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        if fresh && path.exists() {
            std::fs::remove_file(path).unwrap();
        }
        let rows: Vec<Row> = csv::Reader::from_path(path)
            .map(|mut reader| reader.deserialize().map(Result::unwrap).collect())
            .unwrap_or_default();
        let file = OpenOptions::new().create(true).append(true).open(path).unwrap();
        let file = csv::WriterBuilder::new().has_headers(rows.is_empty()).from_writer(file);
        Self { rows, file }
    }

    fn has(&self, site: &Site, level: &str, seed: u64) -> bool {
        self.rows.iter().any(|row| row.scene == site.name && row.level == level && row.seed == seed)
    }

    fn add(&mut self, rows: Vec<Row>) {
        rows.iter().for_each(|row| self.file.serialize(row).unwrap());
        self.file.flush().unwrap();
        self.rows.extend(rows);
    }
}

/// Runs a scene with seed number `round` at the level of samples, and with its share of the others' seeds.
pub fn round(site: &Site, round: u64, store: &mut Store) {
    let missing = |error: &dyn std::fmt::Display| println!("{}: left out: {error}", site.name);
    let modelled = (round - 1) * SEEDS_PER_SEED + 1..=round * SEEDS_PER_SEED;
    let modelled = modelled.map(|seed| (Some(Grade::Correlations), "correlations", OTHER_SEEDS + seed));
    for (grade, level, seed) in std::iter::once((None, "samples", round)).chain(modelled) {
        if !store.has(site, level, seed) {
            match run(site, (grade, level), seed) {
                Ok(rows) => store.add(rows),
                Err(error) => return missing(&error),
            }
        }
    }
}

/// Processor time of all threads of this program in seconds, to a hundredth.
fn processor_s() -> f64 {
    let text = std::fs::read_to_string("/proc/self/stat").unwrap();
    let fields: Vec<&str> = text.rsplit(')').next().unwrap().split_whitespace().collect();
    let ticks: f64 = [11, 12].map(|at: usize| fields[at].parse::<f64>().unwrap()).iter().sum();
    ticks / 100.0
}

/// Figures of one run; `grade` replaces the scene's own level.
fn run(site: &Site, (grade, level): (Option<Grade>, &str), seed: u64) -> Result<Vec<Row>, TwinError> {
    let text = std::fs::read_to_string(format!("scenarios/{}.toml", site.name)).unwrap();
    let mut scenario = Scenario::parse(&text, site.name).unwrap();
    scenario.duration_s = site.seconds;
    if let Some(grade) = grade {
        scenario.front_ends.iter_mut().for_each(|one| one.fidelity = one.fidelity.at(grade));
    }
    let overrides = Overrides { seed: Some(seed), ..Overrides::default() };
    let (scenes, _) = scenario.compose_all(Path::new("scenarios"), &overrides).unwrap();
    let settings = Settings::of_scenario(&text, site.name).unwrap();
    let place = tempfile::tempdir().unwrap();
    for name in ["truth", "rx"] {
        std::fs::create_dir(place.path().join(name)).unwrap();
    }
    let mut truth = generator::truth::Writer::create(&place.path().join("truth")).unwrap();
    let mut output = Output::create(&place.path().join("rx")).unwrap();
    let begin = processor_s();
    twin::run(&scenes, &settings, &mut truth, &mut output)?;
    let processor_s = processor_s() - begin;
    drop((truth, output));
    let summary = analysis::assess(place.path(), None).unwrap();
    println!("{} {level} {seed}: {:.3} s of processor a second", site.name, processor_s / site.seconds);
    let row = |(figure, (unit, value)): (String, (String, f64))| Row {
        scene: site.name.to_owned(),
        level: level.to_owned(),
        seed,
        simulated_s: site.seconds,
        processor_s,
        figure,
        unit,
        value,
    };
    Ok(figures(&summary).into_iter().map(row).collect())
}

/// Values and units of the verdict's figures, and of means and spreads of the summary, by their names. A name
/// that stands in the verdict more than once has a number.
fn figures(summary: &Summary) -> BTreeMap<String, (String, f64)> {
    let mut all = BTreeMap::new();
    let mut counts: BTreeMap<&str, usize> = BTreeMap::new();
    for row in &summary.details.verdict.rows {
        let count = counts.entry(&row.figure).or_default();
        *count += 1;
        let name = if *count > 1 { format!("{} ({count})", row.figure) } else { row.figure.clone() };
        if let Some(value) = row.value.as_f64() {
            all.insert(name, (row.unit.clone(), value));
        }
    }
    let details = &summary.details;
    let spreads = [
        ("pseudorange", "m", &details.pseudorange_m),
        ("carrier phase", "cycles", &details.carrier_cycles),
        ("Doppler", "Hz", &details.doppler_hz),
        ("C/N0", "dB", &details.cn0_db),
    ];
    for (name, unit, spread) in spreads {
        if let Some(spread) = spread {
            all.insert(format!("{name}, mean error"), (unit.to_owned(), spread.mean));
            all.insert(format!("{name}, sigma"), (unit.to_owned(), spread.sigma));
        }
    }
    let more = [
        ("fixes", "", Some(summary.position.fixes as f64)),
        ("satellites used", "", Some(summary.satellites.used as f64)),
    ];
    all.extend(more.into_iter().filter_map(|(name, unit, value)| Some((name.to_owned(), (unit.to_owned(), value?)))));
    all
}
