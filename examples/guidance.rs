//! Guidance in the loop: a vehicle with three degrees of freedom is steered to its target by the fixes of the
//! twin's own receiver, in lock step and virtual time, in open sky and against a jammer at the target.
//!
//! The vehicle glides at some 100 m/s from 5 km away, pushed about by turbulence that it does not feel. It
//! knows its own commands, and from the first fix on where it is. It steers against the miss that it foresees
//! (zero-effort miss, as in proportional navigation). The miss is the least distance to the target.
//!
//! `cargo run --release --example guidance -- [SEEDS]`: 1 by default. It ends with an error if open sky
//! misses by more than 5 m in more than one of twenty, or if the first flight is not the same bits again.

use std::collections::VecDeque;
use std::error::Error;
use std::time::Instant;

use gnss_twin::live::{Lockstep, Push};
use gnss_twin::prelude::*;
use gnss_twin::scene::Motion;
use gnss_twin::settings::{IonosphereChoice, TroposphereChoice};
use nalgebra::Matrix3;

const SCENARIO: &str = r#"
name = "guidance"
start = 2010-07-01T08:05:58
duration_s = 75
noise = {}

[motion]
kind = "pushed"
latitude_deg = 48.055
longitude_deg = 11.6
height_m = 2000
join_s = 0.01
"#;

/// Jammer beside the target; 15 dB over a satellite at the start, 60 dB at 30 m.
const JAMMER: &str = r#"
[[interference]]
kind = "noise"
bandwidth_hz = 2e6
js_db = 15
latitude_deg = 48.1
longitude_deg = 11.6
height_m = 520
"#;

/// Limits of the vehicle, and the disturbance by the air.
const MOST_MPS2: f64 = 30.0;
const GUST_MPS2: f64 = 0.3;
const GUST_S: f64 = 2.0;
/// Standard deviation of its first velocity about the aim.
const AIM_MPS: f64 = 3.0;
/// Largest miss of a good flight in metres, and least share of good flights.
const BAR_M: f64 = 5.0;
const BAR_SHARE: f64 = 0.95;

fn main() -> Result<(), Box<dyn Error>> {
    let seeds: u64 = std::env::args().nth(1).map_or(Ok(1), |word| word.parse())?;
    let again = fly(1, "")?;
    let (mut good, begun, mut flown_s) = (0, Instant::now(), 0.0);
    for seed in 1..=seeds {
        let open = fly(seed, "")?;
        let jammed = fly(seed, JAMMER)?;
        flown_s += open.flown_s + jammed.flown_s;
        good += u64::from(open.miss_m <= BAR_M);
        println!(
            "seed {seed}: misses by {:.2} m after {} fixes; jammed by {:.2} m after {} fixes, the last {:.1} s before",
            open.miss_m, open.fixes, jammed.miss_m, jammed.fixes, jammed.blind_s
        );
        if seed == 1 && open != again {
            return Err("the first flight is not the same again".into());
        }
    }
    let speed = flown_s / begun.elapsed().as_secs_f64();
    println!("{good} of {seeds} within {BAR_M} m in open sky; {speed:.1} x real time");
    if (good as f64) < BAR_SHARE * seeds as f64 { Err("too few reached the target".into()) } else { Ok(()) }
}

/// A flight, to the bit.
#[derive(Clone, Debug, PartialEq)]
struct Flight {
    miss_m: f64,
    fixes: u64,
    /// Age of the last fix at the end.
    blind_s: f64,
    flown_s: f64,
    /// Sum of all samples, weighted by their order: that it is the same again is no accident.
    check: u64,
}

fn fly(seed: u64, more: &str) -> Result<Flight, Box<dyn Error>> {
    let scene = Scenario::from_toml(&format!("seed = {seed}\n{SCENARIO}{more}"))?.scene()?;
    let mut settings = Settings::default();
    // The scene has no atmosphere.
    settings.position.ionosphere = IonosphereChoice::None;
    settings.position.troposphere = TroposphereChoice::None;
    let mut twin = Lockstep::new(&scene, Some(&settings))?;

    // The world: east, north, up from the target.
    let target = Geodetic::from_degrees(48.1, 11.6, 520.0);
    let (origin_m, axes): (Vector3<f64>, Matrix3<f64>) = (target.to_ecef(), target.ecef_to_enu().transpose());
    let mut chance = Chance(seed);
    let mut place_m = axes.transpose() * (scene.trajectory.composed_for().position_m - origin_m);
    let mut velocity_mps = place_m * (-100.0 / place_m.norm()) + chance.normal() * AIM_MPS;
    let mut gust_mps2 = Vector3::zeros();

    let mut guide = Guide::new(place_m, velocity_mps);
    let mut flight = Flight { miss_m: f64::INFINITY, fixes: 0, blind_s: 0.0, flown_s: 0.0, check: 0 };
    let (mut t_s, mut fixed_s) = (0.0, 0.0);
    while !twin.is_done() {
        let step_s = twin.next_s() - t_s;
        let command_mps2 = guide.command_mps2();
        let fade = libm::exp(-step_s / GUST_S);
        gust_mps2 = gust_mps2 * fade + chance.normal() * (GUST_MPS2 * (1.0 - fade * fade).sqrt());
        let acceleration_mps2 = command_mps2 + gust_mps2;
        let before_m = place_m;
        place_m += (velocity_mps + acceleration_mps2 * (0.5 * step_s)) * step_s;
        velocity_mps += acceleration_mps2 * step_s;
        t_s += step_s;
        flight.miss_m = flight.miss_m.min(nearest_m(before_m, place_m));
        if place_m.dot(&velocity_mps) > 0.0 && place_m.norm() < 500.0 {
            break;
        }
        guide.coast(t_s, step_s, command_mps2);

        let motion = Motion {
            position_m: origin_m + axes * place_m,
            velocity_mps: axes * velocity_mps,
            acceleration_mps2: axes * acceleration_mps2,
        };
        let step = twin.step(Some(&Push::of(t_s, &motion)))?;
        for record in step.received {
            let Record::Fix(fix) = record else { continue };
            let at_s = scene.elapsed_s(fix.sample);
            let found_mps = axes.transpose() * Vector3::new(fix.vx_mps, fix.vy_mps, fix.vz_mps);
            guide.correct(at_s, axes.transpose() * (fix.position_m() - origin_m), found_mps);
            flight.fixes += 1;
            fixed_s = at_s;
        }
        flight.check = twin.samples().chunks(8).fold(flight.check, |sum, bytes| {
            let word = bytes.iter().fold(0_u64, |word, byte| word << 8 | u64::from(*byte));
            sum.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(word | 1)
        });
    }
    (flight.flown_s, flight.blind_s) = (t_s, t_s - fixed_s);
    Ok(flight)
}

/// The least distance to the origin on the way from one position to another.
fn nearest_m(from_m: Vector3<f64>, to_m: Vector3<f64>) -> f64 {
    let way = to_m - from_m;
    let share = (-from_m.dot(&way) / way.norm_squared().max(1e-12)).clamp(0.0, 1.0);
    (from_m + way * share).norm()
}

/// State that the vehicle believes: the last fix, carried on by its own commands.
struct Guide {
    place_m: Vector3<f64>,
    velocity_mps: Vector3<f64>,
    /// Commands of the last seconds: when each step ended, its length and the command.
    commands: VecDeque<(f64, f64, Vector3<f64>)>,
}

impl Guide {
    fn new(place_m: Vector3<f64>, velocity_mps: Vector3<f64>) -> Self {
        Self { place_m, velocity_mps, commands: VecDeque::new() }
    }

    /// Acceleration against the miss that no further command would leave, across the line of sight.
    fn command_mps2(&self) -> Vector3<f64> {
        let range_m = self.place_m.norm();
        let closing_mps = -self.place_m.dot(&self.velocity_mps) / range_m;
        if closing_mps < 1.0 || range_m < 1.0 {
            return Vector3::zeros();
        }
        let left_s = (range_m / closing_mps).max(0.2);
        let miss_m = self.place_m + self.velocity_mps * left_s;
        let wanted = miss_m * (-3.0 / (left_s * left_s));
        wanted * (MOST_MPS2 / wanted.norm()).min(1.0)
    }

    fn coast(&mut self, t_s: f64, step_s: f64, command_mps2: Vector3<f64>) {
        carry(&mut self.place_m, &mut self.velocity_mps, step_s, command_mps2);
        self.commands.push_back((t_s, step_s, command_mps2));
        if self.commands.len() > 1000 {
            self.commands.pop_front();
        }
    }

    /// Takes a fix of an earlier time, and carries it on to now.
    fn correct(&mut self, at_s: f64, place_m: Vector3<f64>, velocity_mps: Vector3<f64>) {
        (self.place_m, self.velocity_mps) = (place_m, velocity_mps);
        for (end_s, step_s, command_mps2) in &self.commands {
            let rest_s = (end_s - at_s).clamp(0.0, *step_s);
            carry(&mut self.place_m, &mut self.velocity_mps, rest_s, *command_mps2);
        }
    }
}

fn carry(place_m: &mut Vector3<f64>, velocity_mps: &mut Vector3<f64>, dt_s: f64, command_mps2: Vector3<f64>) {
    *place_m += (*velocity_mps + command_mps2 * (0.5 * dt_s)) * dt_s;
    *velocity_mps += command_mps2 * dt_s;
}

/// Random numbers that belong to a seed (SplitMix64).
struct Chance(u64);

impl Chance {
    fn uniform(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / 9_007_199_254_740_992.0
    }

    /// Three standard normal numbers, each the sum of twelve uniform ones.
    fn normal(&mut self) -> Vector3<f64> {
        Vector3::from_fn(|_, _| (0..12).map(|_| self.uniform()).sum::<f64>() - 6.0)
    }
}
