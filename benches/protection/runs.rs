//! Runs of every case from a drawn time and position, and what the judge counts in them.

use std::collections::HashMap;

use analysis::measure::errors::Errors;
use analysis::measure::protection::{Protected, Protection};
use analysis::read::Run;
use generator::random::mix;
use gnss::satellite::Sv;
use serde::Serialize;

use super::run::run_of_scene;

const SCENE: &str = include_str!("scene.toml");
/// Sizes of a fault: between these distances of light, of either sign.
const FAULTS_M: [f64; 2] = [0.5, 6.0];
const LIGHT_MPS: f64 = 299_792_458.0;
/// Difference of two Dopplers, but for whole kilohertz, from which on two codes hardly disturb each other.
const APART_HZ: f64 = 5.0;
/// Fixes for each that is a point of the picture.
const SHOWN: usize = 50;

/// A method and a number of faulty satellites.
pub struct Case {
    pub method: &'static str,
    pub faults: usize,
}

/// Cases that every start runs.
pub const CASES: [Case; 5] = [
    Case { method: "raim", faults: 0 },
    Case { method: "raim", faults: 1 },
    Case { method: "raim", faults: 2 },
    Case { method: "araim", faults: 0 },
    Case { method: "araim", faults: 1 },
];

/// Counts of one case from one start: a line of `protection.csv`.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Counts {
    pub method: &'static str,
    pub faults: usize,
    pub start: String,
    pub latitude_deg: f64,
    pub longitude_deg: f64,
    /// Faulty satellites with their steps, in metres.
    pub steps_m: String,
    pub fixes: usize,
    /// Fixes in which a test showed a fault.
    pub detected: usize,
    /// Fixes whose satellites have all their Dopplers apart, and how many of them a test showed a fault in.
    pub fixes_apart: usize,
    pub detected_apart: usize,
    /// Fixes with a horizontal or a vertical level, and those with an error beyond it.
    pub horizontal_levels: usize,
    pub horizontal_beyond: usize,
    pub vertical_levels: usize,
    pub vertical_beyond: usize,
    pub horizontal_level_sum_m: f64,
    pub vertical_level_sum_m: f64,
    /// Largest error over its level.
    pub horizontal_ratio_max: f64,
    pub vertical_ratio_max: f64,
}

/// Counts of a case from one start, and some of its fixes.
pub struct Found {
    pub counts: Counts,
    pub shown: Vec<Protected>,
}

/// Random numbers of a start (Steele, Lea and Flood, Fast splittable pseudorandom number generators, 2014).
struct Random(u64);

impl Random {
    fn unit(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        (mix(self.0) >> 11) as f64 / (1u64 << 53) as f64
    }

    fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }
}

/// All cases from one start: an hour of 2010-07-01 and a position up to 75 degrees from the equator, evenly
/// over the surface.
pub fn start(number: u64) -> Vec<Found> {
    let mut random = Random(number << 32);
    let second = random.between(2.0 * 3600.0, 21.0 * 3600.0) as u64;
    let start = format!("2010-07-01T{:02}:{:02}:{:02}", second / 3600, second / 60 % 60, second % 60);
    let sine = random.between(-0.966, 0.966);
    let position =
        [libm::asin(sine).to_degrees(), random.between(-180.0, 180.0)].map(|deg| (100.0 * deg).round() / 100.0);
    let draws: [f64; 6] = std::array::from_fn(|_| random.unit());
    let mut satellites: Vec<Sv> = Vec::new();
    let mut all = Vec::new();
    for (seed, case) in (1 + 10 * number..).zip(&CASES) {
        let steps = drawn(&satellites, &draws, case.faults);
        let (found, in_view) = run(case, seed, &start, position, &steps);
        satellites = in_view;
        all.push(found);
    }
    all
}

/// Faulty satellites and the steps of their clocks, in metres.
fn drawn(satellites: &[Sv], draws: &[f64; 6], count: usize) -> Vec<(Sv, f64)> {
    let mut left = satellites.to_vec();
    let mut found = Vec::new();
    for draw in draws.chunks_exact(3).take(count).filter(|_| !satellites.is_empty()) {
        let sv = left.remove((draw[0] * left.len() as f64) as usize);
        let size_m = FAULTS_M[0] + (FAULTS_M[1] - FAULTS_M[0]) * draw[1];
        found.push((sv, if draw[2] < 0.5 { -size_m } else { size_m }));
    }
    found
}

fn run(case: &Case, seed: u64, start: &str, position: [f64; 2], steps: &[(Sv, f64)]) -> (Found, Vec<Sv>) {
    let [latitude_deg, longitude_deg] = position;
    let mut text = SCENE
        .replace("%start%", start)
        .replace("%seed%", &seed.to_string())
        .replace("%latitude_deg%", &latitude_deg.to_string())
        .replace("%longitude_deg%", &longitude_deg.to_string())
        .replace("%method%", case.method);
    for (sv, step_m) in steps {
        let step_s = step_m / LIGHT_MPS;
        text +=
            &format!("\n[[satellite_fault]]\nkind = \"clock_step\"\nsatellites = [\"{sv}\"]\nstep_s = {step_s:e}\n");
    }
    let (run, _here) = run_of_scene(&text, "protection");
    let errors = Errors::measure(&run).unwrap();
    let protection = Protection::measure(&run, &errors).unwrap();
    let in_view = run.in_view_at_start.iter().copied().collect();
    let steps_m: Vec<String> = steps.iter().map(|(sv, step_m)| format!("{sv} {step_m:.2}")).collect();
    let counts = Counts {
        method: case.method,
        faults: case.faults,
        start: start.to_owned(),
        latitude_deg,
        longitude_deg,
        steps_m: steps_m.join(", "),
        ..Counts::default()
    };
    (counted(counts, &protection, &near(&run)), in_view)
}

/// Tenths of a second in which two satellites have one Doppler but for whole kilohertz, which the lines of
/// C/A are apart.
fn near(run: &Run) -> HashMap<u64, bool> {
    let mut dopplers: HashMap<u64, Vec<f64>> = HashMap::new();
    for link in run.truth.keys() {
        run.truth.each(link, |row| dopplers.entry(tenth(row.sample)).or_default().push(row.doppler_hz)).unwrap();
    }
    let is_near = |all: &Vec<f64>| {
        let pairs = all.iter().enumerate().flat_map(|(at, one)| all[..at].iter().map(move |other| one - other));
        pairs.into_iter().any(|hz| (hz - 1000.0 * (hz / 1000.0).round()).abs() < APART_HZ)
    };
    dopplers.iter().map(|(at, all)| (*at, is_near(all))).collect()
}

/// Tenth of a second of a sample.
fn tenth(sample: u64) -> u64 {
    (sample + 130_000) / 260_000
}

fn counted(mut counts: Counts, protection: &Protection, near: &HashMap<u64, bool>) -> Found {
    let mut shown = Vec::new();
    protection
        .rows
        .each(|row| {
            let is_apart = near.get(&tenth(row.sample)) == Some(&false);
            if counts.fixes.is_multiple_of(SHOWN) {
                shown.push(row);
            }
            counts.fixes += 1;
            counts.detected += usize::from(row.detected);
            counts.fixes_apart += usize::from(is_apart);
            counts.detected_apart += usize::from(is_apart && row.detected);
            if let Some(level_m) = row.hpl_m {
                counts.horizontal_levels += 1;
                counts.horizontal_beyond += usize::from(row.horizontal_m > level_m);
                counts.horizontal_level_sum_m += level_m;
                counts.horizontal_ratio_max = counts.horizontal_ratio_max.max(row.horizontal_m / level_m);
            }
            if let Some(level_m) = row.vpl_m {
                counts.vertical_levels += 1;
                counts.vertical_beyond += usize::from(row.vertical_m > level_m);
                counts.vertical_level_sum_m += level_m;
                counts.vertical_ratio_max = counts.vertical_ratio_max.max(row.vertical_m / level_m);
            }
        })
        .unwrap();
    Found { counts, shown }
}
