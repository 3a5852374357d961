//! Receives a recording and prints fixes and losses as they are found; nothing is written.
//!
//! `cargo run --release --example receive -- recording.ci8 2.6e6` for 8-bit complex samples around L1 at 2.6
//! Msps.

use std::error::Error;
use std::fs::File;
use std::io::Read;

use gnss_twin::gnss::earth::Geodetic;
use gnss_twin::gnss::record::Event;
use gnss_twin::gnss::samples::{Format, IfMetadata};
use gnss_twin::gnss::time::Rate;
use gnss_twin::receiver::output::Record;
use gnss_twin::receiver::{Receiver, settings::Settings};

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let (Some(path), Some(rate)) = (arguments.next(), arguments.next()) else {
        return Err("expected a recording and its sample rate in hertz: receive recording.ci8 2.6e6".into());
    };
    let rate = rate.parse().ok().and_then(Rate::from_hz).ok_or("the rate is no number of hertz")?;
    let metadata = IfMetadata { format: Format::Ci8, rate, center_hz: 1_575.42e6, inverted: false, start: None };
    let mut receiver = Receiver::new(&metadata, &Settings::default())?;
    let mut file = File::open(path)?;
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
