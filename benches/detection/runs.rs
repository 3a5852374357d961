//! Runs of all cases from a drawn time and position, and what the judge's labels say about their tests.

use std::collections::BTreeMap;

use analysis::measure::detection::{Detection, Label};
use analysis::measure::independent::Correlated;
use gnss::record::Detector;
use gnss::satellite::Sv;
use serde::Serialize;

use super::drawn::{Random, Start};
use super::run::run_of_scene;
use super::scenes::{ATTACKS, CLEAN, Case, scene};

/// One detector in one run: a line of `detection.csv`.
#[derive(Clone, Debug, Serialize)]
pub struct Line {
    pub case: &'static str,
    pub level: &'static str,
    pub start: String,
    pub latitude_deg: f64,
    pub longitude_deg: f64,
    pub seed: u64,
    pub detector: &'static str,
    /// Time in which nobody attacked and this detector tested.
    pub clean_s: f64,
    pub clean_tests: usize,
    pub false_alarms: usize,
    /// Clean tests that are independent by the autocorrelation of their statistic.
    pub independent_tests: f64,
    pub attacked_tests: usize,
    pub attacked_alarms: usize,
    /// Time from the attack's beginning to the first alarm; empty without one.
    pub delay_s: Option<f64>,
}

/// One detector in one run, with its statistics over their thresholds.
pub struct Found {
    pub case: Case,
    pub detector: Detector,
    pub line: Line,
    pub clean: Vec<f32>,
    pub attacked: Vec<f32>,
}

/// Random numbers of a case from a start; those of the start itself have case 0.
fn random(number: u64, case: usize) -> Random {
    Random(number << 32 | (case as u64) << 16)
}

/// Runs of all clean cases from a start.
pub fn clean(number: u64) -> Vec<Found> {
    let mut in_view = Vec::new();
    let mut all = Vec::new();
    for (place, case) in CLEAN.iter().enumerate() {
        let start = case.kind.start(&mut random(number, 0));
        let seed = 100 * number + place as u64;
        let text = scene(case.kind, seed, &start, &mut random(number, 1 + place), &in_view);
        let (found, satellites) = run(*case, "correlations", seed, &start, &text);
        if place == 0 {
            in_view = satellites;
        }
        all.extend(found);
    }
    all
}

/// Runs of all attacks from a start.
pub fn attacked(number: u64) -> Vec<Found> {
    let one = |(place, case): (usize, &Case)| {
        let place = CLEAN.len() + place;
        let start = case.kind.start(&mut random(number, 0));
        let seed = 100 * number + place as u64;
        let text = scene(case.kind, seed, &start, &mut random(number, 1 + place), &[]);
        run(*case, "samples", seed, &start, &text).0
    };
    ATTACKS.iter().enumerate().flat_map(one).collect()
}

/// Runs a scene; its satellites too.
fn run(case: Case, level: &'static str, seed: u64, start: &Start, text: &str) -> (Vec<Found>, Vec<Sv>) {
    let (run, _here) = run_of_scene(text, case.name);
    let detection = Detection::measure(&run).unwrap();
    let line = |detector: Detector| Line {
        case: case.name,
        level,
        start: start.time.clone(),
        latitude_deg: start.place_deg[0],
        longitude_deg: start.place_deg[1],
        seed,
        detector: detector.name(),
        clean_s: 0.0,
        clean_tests: 0,
        false_alarms: 0,
        independent_tests: 0.0,
        attacked_tests: 0,
        attacked_alarms: 0,
        delay_s: None,
    };
    let begin = detection.attacks().iter().map(|attack| attack.from).min();
    let mut all: BTreeMap<Detector, Found> = BTreeMap::new();
    let mut series: BTreeMap<(Detector, u32), Vec<f64>> = BTreeMap::new();
    let mut last: BTreeMap<Detector, u64> = BTreeMap::new();
    run.tests
        .each(|test| {
            let found = all.entry(test.detector).or_insert_with(|| {
                let (clean, attacked) = (Vec::new(), Vec::new());
                Found { case, detector: test.detector, line: line(test.detector), clean, attacked }
            });
            let ratio = (test.statistic / test.threshold) as f32;
            match detection.label(test.sample) {
                Label::Clean => {
                    found.line.clean_tests += 1;
                    found.line.false_alarms += usize::from(test.alarm);
                    // An interval of a second ends at each sample with a test.
                    if last.insert(test.detector, test.sample) != Some(test.sample) {
                        found.line.clean_s += 1.0;
                    }
                    found.clean.push(ratio);
                    series.entry((test.detector, test.link)).or_default().push(test.statistic);
                }
                Label::Jammed | Label::Spoofed => {
                    found.line.attacked_tests += 1;
                    found.line.attacked_alarms += usize::from(test.alarm);
                    found.attacked.push(ratio);
                    if let Some(begin) = begin.filter(|_| test.alarm) {
                        let delay_s = test.sample.saturating_sub(begin) as f64 / run.scene.sample_rate_hz;
                        found.line.delay_s.get_or_insert(delay_s);
                    }
                }
                Label::After => {}
            }
        })
        .unwrap();
    for found in all.values_mut() {
        let own = series.range((found.detector, 0)..=(found.detector, u32::MAX));
        let groups: Vec<Vec<f64>> = own.map(|(_, series)| series.clone()).collect();
        let tests = found.line.clean_tests as f64;
        found.line.independent_tests =
            Correlated::about_means(&groups).map_or(tests, |own| own.independent_of_mean().min(tests));
    }
    let satellites = run.in_view_at_start.iter().copied().collect();
    (all.into_values().collect(), satellites)
}
