//! An effect of one's own: trees that weaken and delay the signals of low satellites. The truth has it as
//! described, and the receiver measures it.
//!
//! `cargo run --release --example own_effect`

use std::collections::BTreeMap;
use std::error::Error;

use gnss_twin::effect::{Ray, Sight};
use gnss_twin::prelude::*;

/// A layer of leaves over the antenna: what a ray loses is in proportion to its way through it.
struct Canopy {
    height_m: f64,
    loss_db_per_m: f64,
}

impl Effect for Canopy {
    fn name(&self) -> &'static str {
        "canopy"
    }

    fn describe(&self) -> String {
        format!("{} m of leaves, {} dB/m", self.height_m, self.loss_db_per_m)
    }

    // A pure function of its arguments, and without height nothing changes: the laws of `Effect`.
    fn act(&self, sight: &Sight, _: &Signal, rays: &mut Vec<Ray>) {
        let way_m = self.height_m / libm::sin(sight.look.elevation_rad);
        let gain = libm::pow(10.0, -0.1 * self.loss_db_per_m * way_m);
        rays.iter_mut().for_each(|ray| ray.cn0_hz *= gain);
    }
}

const SCENARIO: &str = r#"
name = "own_effect"
start = 2010-07-01T08:05:58
duration_s = 3

[motion]
kind = "static"
latitude_deg = 48.1
longitude_deg = 11.6
height_m = 520

[satellites]
mask_deg = 15

[power]
cn0_dbhz = 47

[noise]
"#;

fn main() -> Result<(), Box<dyn Error>> {
    let mut twin = Twin::from_toml(SCENARIO)?;
    for scene in twin.scenes_mut() {
        scene.effects.push(Box::new(Canopy { height_m: 3.0, loss_db_per_m: 0.7 }));
    }
    let run = twin.run()?;
    let mut elevation_deg: BTreeMap<Sv, f64> = BTreeMap::new();
    let mut true_dbhz: BTreeMap<Sv, f64> = BTreeMap::new();
    for record in run.truth {
        match record {
            truth::Record::Sky(row) => _ = elevation_deg.insert(row.sv, row.elevation_deg),
            truth::Record::Observation(row) => _ = true_dbhz.insert(row.sv, row.cn0_dbhz),
            _ => {}
        }
    }
    let mut measured_dbhz: BTreeMap<Sv, f64> = BTreeMap::new();
    for record in run.records {
        if let Record::Tracking(row) = record {
            measured_dbhz.insert(row.sv, row.cn0_dbhz);
        }
    }
    for (sv, elevation_deg) in elevation_deg {
        let (set, measured) = (true_dbhz[&sv], measured_dbhz.get(&sv));
        let measured = measured.map_or("not tracked".to_owned(), |dbhz| format!("measured {dbhz:.1} dB-Hz"));
        println!("{sv} at {elevation_deg:4.1}°: true {set:.1} dB-Hz, {measured}");
    }
    Ok(())
}
