//! True values at one time of the receiver's clock, as records and as the files that the judge reads.
//!
//! Delays and phases are those of [`arrival`](crate::arrival), which samples have too. Doppler is
//! minus the derivative of that same carrier by the receiver's clock, of pushed motion within its tick.
//! Limits: tropospheric and ionospheric shares in `sky.csv` are half the sum and half the difference of code
//! and carrier delays.

mod array;
mod inertial;
mod place;
mod record;
mod rinex;
mod skyline;
mod writer;

pub use crate::arrival::{Seen, in_view, in_view_from, presence_from, seen, seen_by, seen_from, seen_on};
use crate::arrival::{received, seen_near};
use crate::geometry::Geometry;
use crate::knots::Arrival;
use crate::scene::Scene;
use crate::spoof::Constellation;
use gnss::broadcast::OrbitError;
use gnss::earth::SPEED_OF_LIGHT_MPS;
use gnss::record::{Observation, RayRow, SkyRow, TrajectoryRow};
use gnss::satellite::Sv;
use gnss::signal::Signal;
pub use inertial::{SensorRow, Sensors, Take};
pub use place::{Nmea, Tracks};
pub use record::{Record, Several, Sink, TruthError};
pub use rinex::Rinex;
pub use writer::Writer;

/// Step of the difference quotient behind the Doppler, and its share of a turn where the antenna spins. What
/// five points leave of a sinusoid of ω is (ω step)⁴/30 of its slope: 3e-6.
const DOPPLER_STEP_S: f64 = 0.01;
const DOPPLER_STEP_TURNS: f64 = 1.0 / 64.0;
/// Step of the difference quotient as a share of a tick of pushed motion: five points lie in half a tick.
const DOPPLER_STEP_TICKS: f64 = 1.0 / 8.0;

/// Doppler: minus the derivative of the carrier, by a stencil of five points 10 ms apart that does not
/// straddle a break. `here` is what is seen at the sample, which is one of the five.
fn doppler_hz(
    scene: &Scene,
    from: &Constellation,
    (sv, signal): (Sv, &Signal),
    sample: u64,
    (here, known): (&Seen, Option<&Geometry>),
) -> Result<Option<f64>, OrbitError> {
    let local = scene.clock.epoch(sample);
    let elapsed_s = scene.receiver_clock.true_elapsed_s(scene.clock.start, local);
    let spin_hz = scene.trajectory.attitude().map_or(0.0, |attitude| attitude.spin_hz.abs());
    let tick_s = scene.trajectory.tick_samples().map(|samples| samples as f64 / scene.clock.rate.hz());
    let widest_s = tick_s.map_or(DOPPLER_STEP_S, |tick_s| DOPPLER_STEP_S.min(DOPPLER_STEP_TICKS * tick_s));
    let step_s = if spin_hz > 0.0 { widest_s.min(DOPPLER_STEP_TURNS / spin_hz) } else { widest_s };
    let reach_s = 2.0 * step_s;
    let mut breaks = from.motion_breaks_s(&scene.trajectory);
    if let Some(clock) = from.fading(sv).and_then(|sv| scene.satellite_clocks.of(sv)) {
        breaks.extend(clock.breaks_s(&scene.fast_phases()));
        breaks.sort_by(f64::total_cmp);
    }
    let switched = scene.switched(from.number, sv, sample);
    let moved = |seen: &Seen, away_s: f64| {
        let place = sample as f64 + away_s * scene.clock.rate.hz();
        let fast = scene.fast_phases().at(from.fading(sv), signal.carrier_hz(sv), place);
        let act = |arrival: &Arrival| switched.act(*arrival, signal.carrier_hz(sv), place, scene.clock.rate);
        seen.arrivals.first().map(|arrival| act(arrival).with_fast_phase(fast).carrier_cycles)
    };
    let near = |b: &&f64| (**b - elapsed_s).abs() < reach_s;
    // Lagrange's derivative weights; the middle of the stencil moves away from the break.
    let into_tick = scene.trajectory.tick_samples().map(|samples| (sample % samples) as f64 / samples as f64);
    let (offset, weights) = match breaks.iter().find(near) {
        None if into_tick.is_some_and(|share| share < 0.25) => (0, [-25.0, 48.0, -36.0, 16.0, -3.0]),
        None if into_tick.is_some_and(|share| share > 0.75) => (-4, [3.0, -16.0, 36.0, -48.0, 25.0]),
        None => (-2, [1.0, -8.0, 0.0, 8.0, -1.0]),
        Some(b) if *b <= elapsed_s => (0, [-25.0, 48.0, -36.0, 16.0, -3.0]),
        Some(_) => (-4, [3.0, -16.0, 36.0, -48.0, 25.0]),
    };
    let Some(base) = moved(here, 0.0) else { return Ok(None) };
    let mut sum = 0.0;
    for (steps, weight) in (offset..).zip(weights) {
        // Weights add up to zero, so the value here can be left out of all: its own term is none.
        if steps == 0 || weight == 0.0 {
            continue;
        }
        let away_s = f64::from(steps) * step_s;
        let guess_s = here.emission.travel_s;
        let there = seen_near(scene, from, (sv, signal), local.plus_s(away_s), (guess_s, known))?;
        let Some(seen) = there else { return Ok(None) };
        let Some(carrier_cycles) = moved(&seen, away_s) else { return Ok(None) };
        sum += weight * (carrier_cycles - base);
    }
    Ok(Some(planted!("generator.truth.doppler", -sum, sum) / (12.0 * step_s)))
}

/// True values of a satellite at a sample: the observation of its first ray, its position in the sky, and the
/// other rays relative to the first.
pub type Truth = (Observation, SkyRow, Vec<RayRow>);

/// Computes the true values of `sv` at a sample.
///
/// # Errors
/// Errors of the orbit.
pub fn observe(
    scene: &Scene,
    from: &Constellation,
    sv: Sv,
    signal: &'static Signal,
    sample: u64,
    locked_s: f64,
) -> Result<Option<Truth>, OrbitError> {
    observe_by(scene, from, (sv, signal), (sample, locked_s), None)
}

/// Like [`observe`], with the geometry that all signals of the satellite share, if it is stored.
///
/// # Errors
/// Errors of the orbit.
pub fn observe_by(
    scene: &Scene,
    from: &Constellation,
    (sv, signal): (Sv, &'static Signal),
    (sample, locked_s): (u64, f64),
    known: Option<&Geometry>,
) -> Result<Option<Truth>, OrbitError> {
    let local = scene.clock.epoch(sample);
    let Some(seen) = seen_by(scene, from, (sv, signal), local, known)? else { return Ok(None) };
    let (Some(&arrival), Some(ray)) = (seen.arrivals.first(), seen.rays.first()) else { return Ok(None) };
    let switched = scene.switched(from.number, sv, sample);
    let arrival = switched.act(arrival, signal.carrier_hz(sv), sample as f64, scene.clock.rate);
    // What is blocked or switched off altogether is not there to be observed.
    if arrival.cn0_hz <= 0.0 {
        return Ok(None);
    }
    let arrival =
        arrival.with_fast_phase(scene.fast_phases().at(from.fading(sv), signal.carrier_hz(sv), sample as f64));
    let doppler_hz = doppler_hz(scene, from, (sv, signal), sample, (&seen, known))?;
    let Some(doppler_hz) = doppler_hz else { return Ok(None) };
    let sent = from.ahead(local).plus_s(-arrival.delay_s);
    let observation = Observation {
        sample,
        sv,
        signal,
        sent_s: sent.seconds(),
        sent_fraction_s: sent.fraction(),
        pseudorange_m: SPEED_OF_LIGHT_MPS * (arrival.delay_s - from.ahead_s as f64),
        carrier_cycles: arrival.carrier_cycles,
        doppler_hz,
        cn0_dbhz: 10.0 * libm::log10(arrival.cn0_hz),
        locked_s,
    };
    let sight = &seen.emission.sight;
    let clock = from.fading(sv).and_then(|sv| scene.satellite_clocks.of(sv));
    let departed_s = clock.map_or(0.0, |clock| clock.at_s(&scene.fast_phases(), sample as f64));
    let sky = SkyRow {
        sample,
        sv,
        signal,
        azimuth_deg: sight.look.azimuth_rad.to_degrees(),
        elevation_deg: sight.look.elevation_rad.to_degrees(),
        range_m: sight.range_m,
        satellite_clock_m: SPEED_OF_LIGHT_MPS * (seen.satellite_clock_s + departed_s)
            - switched.range_error_m(sample as f64, scene.clock.rate),
        ionosphere_m: 0.5 * SPEED_OF_LIGHT_MPS * (ray.code_delay_s - ray.carrier_delay_s),
        troposphere_m: 0.5 * SPEED_OF_LIGHT_MPS * (ray.code_delay_s + ray.carrier_delay_s),
    };
    let rays = (1..).zip(seen.rays.iter().skip(1)).map(|(number, other)| RayRow {
        sample,
        sv,
        signal,
        ray: number,
        excess_m: SPEED_OF_LIGHT_MPS * (other.code_delay_s - ray.code_delay_s),
        amplitude_ratio: (other.cn0_hz / ray.cn0_hz).sqrt(),
        phase_cycles: {
            let delay_s = ray.carrier_delay_s - other.carrier_delay_s;
            let cycles = signal.carrier_hz(sv) * delay_s + ray.phase_cycles - other.phase_cycles;
            cycles - cycles.floor()
        },
    });
    // A city's list of rays is as long as the scene: those that are silent now would be most rows. One row
    // says that the satellite has others.
    let is_listed = !scene.effects.iter().any(|effect| effect.name() == "city");
    let rays = rays.filter(|row: &RayRow| is_listed || row.ray == 1 || row.amplitude_ratio > 0.0).collect();
    Ok(Some((observation, sky, rays)))
}

/// Antenna and clock at a sample, as they are or as a spoofer claims them: the receiver's clock against its
/// clock.
pub fn trajectory(scene: &Scene, from: &Constellation, sample: u64) -> TrajectoryRow {
    let local = scene.clock.epoch(sample);
    let (time, elapsed_s, motion) = received(scene, from, local);
    let clock = &scene.receiver_clock;
    let place = scene.nodes.place(scene.clock.rate, sample as f64);
    let quick_s = clock.oscillator.as_ref().map_or(0.0, |oscillator| oscillator.quick_at_s(place));
    let time = time.plus_s(from.clock_s(elapsed_s) - quick_s);
    TrajectoryRow {
        sample,
        gps_s: time.seconds(),
        gps_fraction_s: time.fraction(),
        x_m: motion.position_m.x,
        y_m: motion.position_m.y,
        z_m: motion.position_m.z,
        vx_mps: motion.velocity_mps.x,
        vy_mps: motion.velocity_mps.y,
        vz_mps: motion.velocity_mps.z,
        clock_bias_s: clock.offset_at_reading_s(scene.clock.start, local) + quick_s
            - from.clock_s(elapsed_s)
            - from.ahead_s as f64,
        clock_drift: clock.drift_at_reading(scene.clock.start, local) - from.clock_drift,
    }
}
