//! Speed of lock step: `cargo bench --bench lockstep [-- SECONDS]` prints how many times faster than real
//! time generator and receiver go step by step, and what a second takes of the processor with and without
//! the receiver.
//!
//! A vehicle on a circle over the position of `scenarios/static.toml`, twelve satellites in noise, 2.6 Msps,
//! a state for each of a hundred steps a second. The receiver starts cold: its search counts.

use std::error::Error;
use std::time::Instant;

use generator::scenario::Scenario;
use generator::vehicle::Motion;
use generator::vehicle::joining::Push;
use live::lockstep::Lockstep;
use nalgebra::Vector3;
use receiver::output::Record;
use receiver::settings::Settings;

const SCENE: &str = r#"
name = "lockstep"
start = 2010-07-01T08:05:58
noise = {}
motion = { kind = "pushed", latitude_deg = 26.5123, longitude_deg = 80.2329, height_m = 130 }
satellites = { mask_deg = 5 }
front_end = { sample_rate_hz = 2.6e6, format = "ci8" }
"#;

const RADIUS_M: f64 = 100.0;
const RATE_RADPS: f64 = 0.2;

fn main() -> Result<(), Box<dyn Error>> {
    // Cargo adds flags of its own.
    let seconds: u32 = std::env::args().skip(1).find_map(|word| word.parse().ok()).unwrap_or(60);
    for receiver in [true, false] {
        let (begun, before_s) = (Instant::now(), processor_s()?);
        let (fixes, satellites) = drive(seconds, receiver)?;
        let (wall_s, spent_s) = (begun.elapsed().as_secs_f64(), processor_s()? - before_s);
        let of = f64::from(seconds);
        let name = if receiver { "generator and receiver" } else { "generator alone" };
        println!(
            "{name}: {:.1} x real time, {:.4} s of processor a second; {satellites} satellites, {fixes} fixes",
            of / wall_s,
            spent_s / of
        );
    }
    Ok(())
}

/// Fixes, and satellites that were sent.
fn drive(seconds: u32, receiver: bool) -> Result<(u64, usize), Box<dyn Error>> {
    let scene = Scenario::from_toml(&format!("duration_s = {seconds}\n{SCENE}"))?.scene()?;
    let settings = Settings::default();
    let mut twin = Lockstep::new(&scene, receiver.then_some(&settings))?;
    let start_m = scene.trajectory.composed_for().position_m;
    let mut fixes = 0;
    while !twin.is_done() {
        let t_s = twin.next_s();
        let step = twin.step(Some(&Push::of(t_s, &circle(start_m, t_s))))?;
        fixes += step.received.iter().filter(|record| matches!(record, Record::Fix(_))).count() as u64;
    }
    Ok((fixes, twin.finish(&mut ())?.generated.satellites.len()))
}

fn circle(start_m: Vector3<f64>, t_s: f64) -> Motion {
    let (sin, cos) = libm::sincos(RATE_RADPS * t_s);
    Motion {
        position_m: start_m + Vector3::new(cos - 1.0, sin, 0.0) * RADIUS_M,
        velocity_mps: Vector3::new(-sin, cos, 0.0) * (RADIUS_M * RATE_RADPS),
        acceleration_mps2: Vector3::new(-cos, -sin, 0.0) * (RADIUS_M * RATE_RADPS * RATE_RADPS),
    }
}

/// Processor time of this process, all threads: fields 14 and 15 of its line in /proc, in hundredths.
fn processor_s() -> Result<f64, Box<dyn Error>> {
    let line = std::fs::read_to_string("/proc/self/stat")?;
    let (_, rest) = line.rsplit_once(')').ok_or("no name in /proc/self/stat")?;
    let ticks: u64 = rest.split_whitespace().skip(11).take(2).map(|word| word.parse().unwrap_or(0)).sum();
    Ok(ticks as f64 / 100.0)
}
