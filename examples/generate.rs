//! Generates a scenario batch by batch: samples and their metadata as a SigMF pair, and of the truth what
//! this program wants of it.
//!
//! `cargo run --release --example generate -- [SCENARIO.toml]` writes `gnss-twin-example.sigmf-data` and
//! `.sigmf-meta` to the directory for temporary files: 22 s, 114 MB. The example `receive` takes them.

use std::error::Error;
use std::fs::{self, File};
use std::io::Write;

use gnss_twin::prelude::*;
use gnss_twin::samples::write_sigmf;
use gnss_twin::truth::Record;

const SCENARIO: &str = r#"
name = "generate"
start = 2010-07-01T08:05:58
duration_s = 22

[motion]
kind = "static"
latitude_deg = 48.1
longitude_deg = 11.6
height_m = 520

[noise]
"#;

fn main() -> Result<(), Box<dyn Error>> {
    let scenario = match std::env::args().nth(1) {
        Some(path) => Scenario::open(path)?,
        None => Scenario::from_toml(SCENARIO)?,
    };
    let scene = scenario.scene()?;
    let data = std::env::temp_dir().join("gnss-twin-example.sigmf-data");
    let mut file = File::create(&data)?;
    let mut generator = Generator::new(&scene)?;
    for batch in &mut generator {
        let batch = batch?;
        file.write_all(&batch.samples)?;
        for record in batch.truth {
            match record {
                Record::Trajectory(row) if row.sample % scene.metadata.rate.first_sample_at(5, 1) == 0 => {
                    println!("sample {:>9}: clock {:+.1e} s", row.sample, row.clock_bias_s);
                }
                Record::Pass(row) => println!("{} from sample {} to {}", row.sv, row.sample, row.until_sample),
                _ => {}
            }
        }
    }
    generator.done().iter().for_each(|done| println!("{done}"));
    fs::write(data.with_extension("sigmf-meta"), write_sigmf(&scene.metadata))?;
    println!("samples in {}", data.display());
    Ok(())
}
