//! Fills `reports/levels.md`, `.csv` and `.png`: cost of the levels `samples` and `correlations`, and whether
//! the figures of the verdict have the same distributions at both.
//!
//! `cargo bench --bench levels` runs every scene of [`runs::SITES`] with all its seeds, an hour of two cores.
//! `-- --minutes N` stops after so many minutes, after whole rounds of seeds; `-- --scene NAME` takes scenes
//! whose names hold that; `-- --page` makes the page from the runs that exist. Runs are in
//! `target/levels/runs.csv`; a command that is given again continues there. `-- --fresh` begins again.

mod compare;
#[path = "../shared/machine.rs"]
mod machine;
mod page;
mod runs;

use std::path::Path;
use std::time::{Duration, Instant};

use runs::{SITES, Store};

/// Minutes for which runs are made unless others are asked for.
const MINUTES: u64 = 60;

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let given = |name: &str| arguments.iter().any(|argument| argument == name);
    let after = |name: &str| arguments.iter().skip_while(|argument| *argument != name).nth(1);
    let minutes = after("--minutes").map_or(MINUTES, |text| text.parse().expect("--minutes takes a whole number"));
    let wanted = after("--scene").map_or("", String::as_str);
    let mut store = Store::open(Path::new("target/levels/runs.csv"), given("--fresh"));
    let end = Instant::now() + Duration::from_secs(60 * minutes);
    if !given("--page") {
        let rounds = SITES.iter().map(|site| site.seeds).max().unwrap_or(0);
        for round in 1..=rounds {
            for site in SITES.iter().filter(|site| round <= site.seeds && site.name.contains(wanted)) {
                if Instant::now() < end {
                    runs::round(site, round, &mut store);
                }
            }
        }
    }
    page::write(Path::new("reports"), &store.rows);
}
