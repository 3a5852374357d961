//! Whole twins, as short as they may be: a scene in, tables out, the verdict and tighter limits over them.

use std::collections::BTreeMap;
use std::fs::{self, File};
use std::io::{Read as _, Write as _};
use std::path::Path;

use analysis::assess;
use analysis::expect::welch::{BINS, Looks};
use analysis::judge::judgement::{Judgement, Status};
use analysis::judge::limits::Limits;
use analysis::judge::summary::Summary;
use analysis::measure::psd::Psd;
use analysis::show::tables;
use generator::scenario::{Overrides, Scenario};
use generator::stream::{Options, Stream};
use generator::truth;
use gnss::record::Observation;
use gnss::samples::IfMetadata;
use gnss::satellite::Sv;
use receiver::Reception;
use receiver::output::Output;
use receiver::settings::Settings;

use crate::judge;

/// The samples of a run that others receive again.
const SAMPLES: &str = "samples.ci8";

/// Makes `truth/` and `rx/` of a scene below `directory`.
pub fn run(scene: &str, directory: &Path) {
    make(scene, directory, |_| ());
}

/// Makes `truth/` and `rx/` of a scene, and keeps the samples beside them.
pub fn run_and_keep(scene: &str, directory: &Path) {
    let mut file = File::create(directory.join(SAMPLES)).unwrap();
    make(scene, directory, |bytes| file.write_all(bytes).unwrap());
}

/// Receives the kept samples of a run; its truth is linked. A fault in the receiver shows as if the samples
/// were made again.
fn receive_again(scene: &str, kept: &Path, directory: &Path) {
    let truth = directory.join("truth");
    fs::create_dir(&truth).unwrap();
    for entry in fs::read_dir(kept.join("truth")).unwrap() {
        let entry = entry.unwrap();
        fs::copy(entry.path(), truth.join(entry.file_name())).unwrap();
    }
    fs::create_dir(directory.join("rx")).unwrap();
    let settings = Settings::of_scenario(scene, "scene").unwrap();
    let (scene, _) = Scenario::parse(scene, "scene").unwrap().compose(directory, &Overrides::default()).unwrap();
    let mut output = Output::create(&directory.join("rx")).unwrap();
    let mut reception = Reception::new(&scene.metadata, &settings).unwrap();
    let mut file = File::open(kept.join(SAMPLES)).unwrap();
    let mut bytes = vec![0; 1 << 18];
    loop {
        let count = file.read(&mut bytes).unwrap();
        if count == 0 {
            break;
        }
        reception.take(&bytes[..count], &mut output).unwrap();
    }
    reception.finish(&mut output).unwrap();
}

fn make(scene: &str, directory: &Path, mut keep: impl FnMut(&[u8])) {
    let scenario = Scenario::parse(scene, "scene").unwrap();
    let settings = Settings::of_scenario(scene, "scene").unwrap();
    let (scene, _) = scenario.compose(directory, &Overrides::default()).unwrap();
    let below = |name: &str| {
        let path = directory.join(name);
        std::fs::create_dir(&path).unwrap();
        path
    };
    let mut truth = truth::Writer::create(&below("truth")).unwrap();
    let mut output = Output::create(&below("rx")).unwrap();
    let mut stream = Stream::new(&scene, &mut truth, &Options::default()).unwrap();
    let mut reception = Reception::new(&scene.metadata, &settings).unwrap();
    let mut spectrum = Spectrum::new(&scene.metadata);
    let mut bytes = Vec::new();
    while stream.next(&mut truth, &mut bytes).unwrap() {
        keep(&bytes);
        spectrum.add(&bytes);
        reception.take(&bytes, &mut output).unwrap();
    }
    keep(&bytes);
    reception.take(&bytes, &mut output).unwrap();
    stream.finish(&mut truth).unwrap();
    reception.finish(&mut output).unwrap();
    tables::write_psd(&directory.join("psd.csv"), &spectrum.psd).unwrap();
}

/// The spectrum of the samples of 8 bits at the start, as long as `run` looks at it.
struct Spectrum {
    psd: Psd,
    left: usize,
}

impl Spectrum {
    fn new(metadata: &IfMetadata) -> Self {
        let rate_hz = metadata.rate.hz();
        let looks = Looks::at(u64::MAX, rate_hz, false);
        Self { psd: Psd::new(rate_hz, false, BINS), left: looks.length as usize }
    }

    fn add(&mut self, bytes: &[u8]) {
        let part = |at: usize| bytes.iter().skip(at).step_by(2).take(self.left).map(|byte| f32::from(*byte as i8));
        let (i, q): (Vec<f32>, Vec<f32>) = (part(0).collect(), part(1).collect());
        self.psd.add(&i, &q);
        self.left -= i.len();
    }
}

/// A run judged by the verdict and by limits of one's own.
pub fn judged(directory: &Path, limits: &str) -> Summary {
    assess(directory, Some(&Limits::parse(limits, "limits").unwrap())).unwrap()
}

/// The figures that failed, with their values.
pub fn failures(summary: &Summary) -> Vec<String> {
    let failed = |row: &&Judgement| row.status == Status::Fail;
    let text = |row: &Judgement| format!("{} {} {}, {}", row.figure, row.value_text(), row.unit, row.bound);
    summary.details.verdict.rows.iter().filter(failed).map(text).collect()
}

/// Satellites whose carrier is no whole number of cycles off at their last observation: the message shows the
/// half cycle, which the verdict forgives.
fn half_cycles(directory: &Path) -> Vec<String> {
    type Rows = BTreeMap<(u64, Sv), Observation>;
    let read = |side: &str| -> Rows {
        let mut table = csv::Reader::from_path(directory.join(side).join("observations.csv")).unwrap();
        let rows = table.deserialize::<Observation>().map(Result::unwrap);
        rows.map(|row| ((row.sample, row.sv), row)).collect()
    };
    let (truth, found) = (read("truth"), read("rx"));
    let last: BTreeMap<Sv, &Observation> = found.values().map(|row| (row.sv, row)).collect();
    let off = |(sv, row): (Sv, &Observation)| {
        let cycles = row.carrier_cycles - truth[&(row.sample, sv)].carrier_cycles;
        let rest = cycles - cycles.round();
        // The phase loop's error is 0.003 cycles.
        (rest.abs() > 0.1).then(|| format!("{sv}: carrier {rest:.2} cycles off a whole number"))
    };
    last.into_iter().filter_map(off).collect()
}

/// Satellites whose true carrier does not grow with their true code.
fn carriers_beside_codes(directory: &Path) -> Vec<String> {
    let mut table = csv::Reader::from_path(directory.join("truth/observations.csv")).unwrap();
    let mut before: BTreeMap<Sv, Observation> = BTreeMap::new();
    let mut failures = BTreeMap::new();
    for row in table.deserialize::<Observation>().map(Result::unwrap) {
        if let Some(last) = before.insert(row.sv, row.clone()) {
            let code_m = row.pseudorange_m - last.pseudorange_m;
            let carrier_m = (row.carrier_cycles - last.carrier_cycles) * row.signal.wavelength_m(row.sv);
            // Twice what a slant ionosphere changes by in 0.1 s: at 0.05 m/s, ten times a steep one.
            if (code_m - carrier_m).abs() > 0.01 {
                let apart_m = code_m - carrier_m;
                failures.insert(row.sv, format!("{}: true carrier {apart_m:.3} m off the code's step", row.sv));
            }
        }
    }
    failures.into_values().collect()
}

fn holds(scene: &str, limits: &str) {
    let directory = tempfile::tempdir().unwrap();
    let in_receiver = std::env::var(gnss::plant::VARIABLE).is_ok_and(|fault| fault.starts_with("receiver."));
    match std::env::var_os(judge::RUN).filter(|_| in_receiver) {
        Some(kept) => receive_again(scene, Path::new(&kept), directory.path()),
        None => run(scene, directory.path()),
    }
    let summary = judged(directory.path(), limits);
    println!("{summary}");
    // What the verdict says of so short a scene is its own affair.
    let broken = |row: &Judgement| format!("{} {} {}, {}", row.figure, row.value_text(), row.unit, row.bound);
    let mut failures: Vec<String> = summary.details.verdict.broken().map(broken).collect();
    failures.extend(half_cycles(directory.path()));
    failures.extend(carriers_beside_codes(directory.path()));
    assert!(failures.is_empty(), "{}", failures.join("; "));
}

/// Eight satellites, strong enough that noise hides little, over a car that turns.
pub const OPEN_SKY: &str = include_str!("open_sky.toml");
pub const OPEN_SKY_LIMITS: &str = include_str!("open_sky_limits.toml");

#[test]
fn a_short_ride_under_an_open_sky_keeps_every_limit() {
    holds(OPEN_SKY, OPEN_SKY_LIMITS);
}
