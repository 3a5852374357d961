//! Fills `reports/loops.md`, `.csv` and `.png`: the receiver's loops on modelled correlations, held against
//! theory.
//!
//! About 500 cells, each run until its spread is known to 0.8 %; a few minutes of processor time. `cargo
//! bench --bench loops`.

use std::path::Path;
use std::time::Instant;

use analysis::expect::theory::oscillator;
use rayon::prelude::*;
use receiver::track::TrackingSettings;
use receiver::track::closed::Mode;
use study::correlator::{Case, run};
use study::{limits, proof, report};

/// Relative standard error of a cell: three of them are half the bar.
const UNCERTAINTY: f64 = 0.008;
/// Time simulated at each level of the default loops.
const LEVEL_S: f64 = 1800.0;

fn main() {
    let settings = TrackingSettings::default();
    let speeds = [Mode::Phase, Mode::Assisted, Mode::Frequency].map(|mode| {
        let case = Case { settle_s: 0.0, duration_s: 1000.0, ..limits::channel(&settings, mode, Some(45.0)) };
        let start = Instant::now();
        let outcome = run(&case);
        assert!(outcome.lost.is_none());
        format!("{:?} {:.0}", mode, case.duration_s / start.elapsed().as_secs_f64())
    });
    let rows: Vec<proof::ProofRow> =
        proof::grid().par_iter().filter_map(|cell| proof::measure(cell, UNCERTAINTY)).collect();
    let dbhz: Vec<u32> = (18..=50).collect();
    let levels: Vec<limits::Level> =
        dbhz.par_iter().map(|&dbhz| limits::level(&settings, &oscillator::TCXO, f64::from(dbhz), LEVEL_S)).collect();
    let preface = format!(
        "Written by `cargo bench --bench loops`. {:.0} hours of one channel were simulated for the grid. Speed on one \
         core, updates as in each stage (default settings), times real time: {}.",
        rows.iter().map(|row| row.simulated_s).sum::<f64>() / 3600.0,
        speeds.join(", ")
    );
    report::write(Path::new("reports"), &rows, &levels, &settings, &preface).expect("the reports can be written");
}
