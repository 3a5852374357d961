//! Fills `reports/protection.md`, `.csv` and `.png`: false alarms, missed faults and errors beyond protection
//! levels of RAIM and ARAIM, over 10^5 fixes a case.
//!
//! `cargo bench --bench protection` runs every case from [`STARTS`] times and positions at the level of
//! correlations, a quarter of an hour of two cores. `-- --starts N` takes the first N of them.

#[path = "../shared/machine.rs"]
mod machine;
mod page;
#[path = "../shared/run.rs"]
mod run;
mod runs;

use std::path::Path;
use std::sync::atomic::{AtomicU64, Ordering};

use rayon::prelude::*;

/// Times and positions of a receiver.
const STARTS: u64 = 100;

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let given = arguments.iter().skip_while(|argument| *argument != "--starts").nth(1);
    let starts = given.map_or(STARTS, |text| text.parse().expect("--starts takes a whole number"));
    let done = AtomicU64::new(0);
    let found: Vec<runs::Found> = (1..=starts)
        .into_par_iter()
        .flat_map_iter(|number| {
            let all = runs::start(number);
            println!("{} of {starts} starts", 1 + done.fetch_add(1, Ordering::Relaxed));
            all
        })
        .collect();
    page::write(Path::new("reports"), &found);
}
