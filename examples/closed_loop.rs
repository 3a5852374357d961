//! A scene from a text, its samples in memory, and a receiver whose fixes are compared with the place in the
//! scene.
//!
//! `cargo run --release --example closed_loop`

use std::error::Error;
use std::path::Path;

use gnss_twin::generator::scenario::{Overrides, Scenario};
use gnss_twin::generator::stream::{Options, Stream};
use gnss_twin::generator::truth;
use gnss_twin::gnss::earth::Geodetic;
use gnss_twin::receiver::output::Record;
use gnss_twin::receiver::{Receiver, settings::Settings};

const SCENE: &str = r#"
name = "closed_loop"
start = 2010-07-01T08:05:58
duration_s = 40

[motion]
kind = "static"
latitude_deg = 48.1
longitude_deg = 11.6
height_m = 520

[noise]
"#;

fn main() -> Result<(), Box<dyn Error>> {
    let (scene, warnings) = Scenario::parse(SCENE, "closed_loop")?.compose(Path::new("."), &Overrides::default())?;
    warnings.iter().for_each(|warning| eprintln!("{warning}"));
    // The truth goes to files, here to those of a directory that ends with the program.
    let directory = tempfile::tempdir()?;
    let mut truth = truth::Writer::create(directory.path())?;
    let mut settings = Settings::default();
    // The scene has no atmosphere.
    settings.position.ionosphere = gnss_twin::receiver::position::IonosphereChoice::None;
    settings.position.troposphere = gnss_twin::receiver::position::TroposphereChoice::None;

    let mut stream = Stream::new(&scene, &mut truth, &Options::default())?;
    let mut receiver = Receiver::new(&scene.metadata, &settings)?;
    let place = scene.trajectory.at(0.0).position_m;
    let axes = Geodetic::from_ecef(&place).ecef_to_enu();
    let (mut samples, mut more) = (Vec::new(), true);
    while more {
        more = stream.next(&mut truth, &mut samples)?;
        for record in receiver.push(&samples)? {
            if let Record::Fix(fix) = record {
                let error_m = axes * (fix.position_m() - place);
                println!("{}  {:+.3} m east {:+.3} m north {:+.3} m up", fix.time(), error_m.x, error_m.y, error_m.z);
            }
        }
    }
    let (_, outcome) = receiver.finish()?;
    println!("{outcome}");
    Ok(())
}
