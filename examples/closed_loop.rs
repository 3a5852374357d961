//! Generator and receiver in one loop, twice: in one call with the results in memory, and batch by batch with
//! a receiver that is fed by hand. Fixes are compared with the true position.
//!
//! `cargo run --release --example closed_loop`

use std::error::Error;

use gnss_twin::prelude::*;
use gnss_twin::settings::{IonosphereChoice, TroposphereChoice};

const SCENARIO: &str = r#"
name = "closed_loop"
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
    let scenario = Scenario::from_toml(SCENARIO)?;
    let mut settings = Settings::default();
    // The scene has no atmosphere.
    settings.position.ionosphere = IonosphereChoice::None;
    settings.position.troposphere = TroposphereChoice::None;

    let run = Twin::new(&scenario)?.with_settings(settings.clone()).run()?;
    println!("{}\n{}", run.generated[0], run.outcome);

    let scene = scenario.scene()?;
    let mut receiver = Receiver::new(&scene.metadata, &settings)?;
    for batch in Generator::new(&scene)? {
        for record in receiver.push(&batch?.samples)? {
            if let Record::Fix(fix) = record {
                print(&scene, &fix);
            }
        }
    }
    let (_, outcome) = receiver.finish()?;
    assert_eq!(outcome.fixes, run.outcome.fixes, "both ways give the same");
    Ok(())
}

/// Prints by how much a fix is off.
fn print(scene: &Scene, fix: &Fix) {
    let place = scene.trajectory.at(0.0).position_m;
    let error_m = Geodetic::from_ecef(&place).ecef_to_enu() * (fix.position_m() - place);
    println!("{}  {:+.3} m east {:+.3} m north {:+.3} m up", fix.time(), error_m.x, error_m.y, error_m.z);
}
