//! Fills `reports/acquisition.md`, `.csv` and `.png`: how often the receiver's search finds what is there and
//! what is not.
//!
//! `cargo bench --bench acquisition`, under a minute.

use std::path::Path;

use generator::truth::Writer;
use study::detection::{detections, false_alarms, settings, write};

const TRIALS: u32 = 2000;

fn main() {
    let directory = tempfile::tempdir().unwrap();
    let mut number = 0;
    let mut writer = || {
        number += 1;
        let place = directory.path().join(number.to_string());
        std::fs::create_dir(&place).unwrap();
        Writer::create(&place).unwrap()
    };
    let search = settings(1e-6);
    let mut rows = Vec::new();
    // A noise of its own for each, or all would miss to the same side.
    for (seed, cn0_dbhz) in (11..).zip([31.0, 32.0, 33.0, 34.0, 35.0, 36.0, 37.0, 38.0]) {
        rows.push(detections(&search, cn0_dbhz, TRIALS, seed, &mut writer()).unwrap());
    }
    for probability in [0.1, 0.01] {
        rows.push(false_alarms(&settings(probability), 5 * TRIALS, 5, &mut writer()).unwrap());
    }
    rows.iter().for_each(|row| println!("{row:?}"));
    write(Path::new("reports"), &rows, &search).unwrap();
}
