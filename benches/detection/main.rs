//! Fills `reports/detection.md`, `.csv` and `.png`: false alarms of the detectors of jamming and spoofing in
//! scenes without an attack, and what they detect of attacks.
//!
//! `cargo bench --bench detection` takes [`STARTS`] times and positions for each scene without an attack and
//! [`ATTACKED`] for each attack: ten minutes of two cores. `-- --starts N` takes N, and a share of them for
//! attacks.

#[path = "../shared/drawn.rs"]
mod drawn;
#[path = "../shared/machine.rs"]
mod machine;
mod page;
mod picture;
mod roc;
#[path = "../shared/run.rs"]
mod run;
mod runs;
mod scenes;
#[path = "../shared/share.rs"]
mod share;

use std::path::Path;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Instant;

use rayon::prelude::*;

/// Times and positions of a receiver in scenes without an attack.
const STARTS: u64 = 24;
/// Times and positions in each attack.
const ATTACKED: u64 = 10;

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let given = arguments.iter().skip_while(|argument| *argument != "--starts").nth(1);
    let starts = given.map_or(STARTS, |text| text.parse().expect("--starts takes a whole number"));
    let attacked = (starts * ATTACKED).div_ceil(STARTS);
    let (done, begun) = (AtomicU64::new(0), Instant::now());
    // Attacks first: they take longer.
    let kinds = (1..=attacked).map(|number| (number, true)).chain((1..=starts).map(|number| (number, false)));
    let found: Vec<runs::Found> = (kinds.collect::<Vec<_>>())
        .into_par_iter()
        .with_max_len(1)
        .flat_map_iter(|(number, is_attack)| {
            let all = if is_attack { runs::attacked(number) } else { runs::clean(number) };
            let done = 1 + done.fetch_add(1, Ordering::Relaxed);
            println!("{done} of {} after {:.0} s", starts + attacked, begun.elapsed().as_secs_f64());
            all
        })
        .collect();
    page::write(Path::new("reports"), &found);
}
