//! A signal of one's own: described as data, sent by the scene's satellites, and found by the receiver's
//! search.
//!
//! `cargo run --release --example own_signal`

use std::error::Error;

use gnss_twin::generator::scenario::Scenario;
use gnss_twin::gnss::gps::l1ca::L1_CA;
use gnss_twin::gnss::signal::{Component, Layer, Signal, register};
use gnss_twin::receiver::output::Record;
use gnss_twin::receiver::settings::Settings;
use gnss_twin::twin;

/// The codes, message and carrier of L1 C/A with a square wave under each chip: BOC(1,1).
static SPLIT: Signal = Signal {
    name: "split L1",
    rinex: "1X",
    components: &[Component { layers: &[Layer::BOC11], ..L1_CA.components[0] }],
    ..L1_CA
};

const SCENARIO: &str = r#"
name = "own_signal"
start = 2010-07-01T08:05:58
duration_s = 3
signals = ["split L1"]

[motion]
kind = "static"
latitude_deg = 48.1
longitude_deg = 11.6
height_m = 520

[front_end]
sample_rate_hz = 5e6

[power]
cn0_dbhz = 47

[noise]
"#;

fn main() -> Result<(), Box<dyn Error>> {
    register(&SPLIT)?;
    let scene = Scenario::from_toml(SCENARIO)?.scene()?;
    let mut settings = Settings::default();
    settings.acquisition.signals = vec![SPLIT.name.to_owned()];
    let mut found: Vec<Record> = Vec::new();
    let done = twin::run(std::slice::from_ref(&scene), &settings, &mut (), &mut found)?;
    println!("{}\n{}", done.generated[0], done.outcome);
    for record in found {
        if let Record::Acquisition(row) = record
            && row.acquired
        {
            println!("{} {}: {:.1} dB-Hz, {:+.0} Hz", row.sv, row.signal, row.cn0_dbhz, row.doppler_hz);
        }
    }
    Ok(())
}
