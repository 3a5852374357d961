//! Receives a recording and prints fixes and losses of lock as they are found; nothing is written.
//!
//! `cargo run --release --example receive -- [FILE.sigmf-data]`; without a file the one that the example
//! `generate` wrote. The metadata lie beside it as `FILE.sigmf-meta`.

use std::error::Error;
use std::fs::{self, File};
use std::io::Read;
use std::path::PathBuf;

use gnss_twin::prelude::*;
use gnss_twin::record::Event;
use gnss_twin::samples::read_sigmf;

fn main() -> Result<(), Box<dyn Error>> {
    let usual = || std::env::temp_dir().join("gnss-twin-example.sigmf-data");
    let data = std::env::args().nth(1).map_or_else(usual, PathBuf::from);
    let meta = data.with_extension("sigmf-meta");
    let text = fs::read_to_string(&meta).map_err(|error| format!("{}: {error}", meta.display()))?;
    let metadata = read_sigmf(&text, &meta.display().to_string())?;
    let mut receiver = Receiver::new(&metadata, &Settings::default())?;
    let mut file = File::open(&data)?;
    let mut bytes = vec![0; 1 << 18];
    loop {
        let count = file.read(&mut bytes)?;
        if count == 0 {
            break;
        }
        receiver.push(&bytes[..count])?.iter().for_each(print);
    }
    let (rest, outcome) = receiver.finish()?;
    rest.iter().for_each(print);
    println!("{outcome}");
    Ok(())
}

fn print(record: &Record) {
    match record {
        Record::Fix(fix) => {
            let place = Geodetic::from_ecef(&fix.position_m());
            let (latitude_deg, longitude_deg) = (place.latitude_rad.to_degrees(), place.longitude_rad.to_degrees());
            println!("{} {latitude_deg:.6} {longitude_deg:.6} {:.1} m", fix.time(), place.height_m);
        }
        Record::Event(row) if row.event == Event::LossOfLock => println!("sample {}: {} is lost", row.sample, row.sv),
        _ => {}
    }
}
