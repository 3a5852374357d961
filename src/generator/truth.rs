//! What is true at one reading of the receiver's clock, and the files that tell it to the judge.
//!
//! One definition serves samples and records: with T the clock's reading, t the true time and τ the
//! light time, the delay of the code is (T − t) + τ + (delays of the ray) − (satellite clock); that of the
//! carrier takes the ray's carrier delay instead, and is counted in cycles at RF. Doppler is
//! minus the derivative of that same carrier by the receiver's clock. Limits: tropospheric and
//! ionospheric shares in `sky.csv` are half the sum and half the difference of code and carrier delays.

mod writer;

use crate::generator::geometry::{Arriving, Geometry};
use crate::generator::knots::Arrival;
use crate::generator::presence::{Presence, presence};
use crate::generator::ray::Ray;
use crate::generator::ripple;
use crate::generator::scene::Scene;
use crate::generator::sky::{Arc, Emission, LIGHT_TIME_S, emission_near};
use crate::generator::spoof::Constellation;
use crate::generator::vehicle::Motion;
use crate::gnss::broadcast::OrbitError;
use crate::gnss::earth::SPEED_OF_LIGHT_MPS;
use crate::gnss::record::{Observation, RayRow, SkyRow, TrajectoryRow};
use crate::gnss::satellite::Sv;
use crate::gnss::signal::Signal;
use crate::gnss::time::Epoch;
pub use writer::{TruthError, Writer};

/// Step of the difference quotient behind the Doppler, and its share of a turn where the antenna spins. What
/// five points leave of a sinusoid of ω is (ω step)⁴/30 of its slope: 3e-6.
const DOPPLER_STEP_S: f64 = 0.01;
const DOPPLER_STEP_TURNS: f64 = 1.0 / 64.0;

/// A satellite's signal as it arrives at one reading of the receiver's clock.
#[derive(Clone, Debug)]
pub struct Seen {
    pub emission: Emission,
    /// The satellite's clock minus GPS time at emission, for this signal.
    pub satellite_clock_s: f64,
    pub rays: Vec<Ray>,
    pub arrivals: Vec<Arrival>,
}

/// True time, and the motion that a constellation's signals are made for, when the receiver's clock reads `local`.
fn received(scene: &Scene, from: &Constellation, local: Epoch) -> (Epoch, f64, Motion) {
    let start = scene.clock.start;
    let elapsed_s = scene.receiver_clock.true_elapsed_s(start, local);
    (scene.receiver_clock.true_time(start, local), elapsed_s, from.motion(scene, elapsed_s))
}

/// What arrives from the true satellite `sv` when the receiver's clock reads `local`; `None` without an ephemeris.
///
/// # Errors
/// Those of the orbit.
pub fn seen(scene: &Scene, sv: Sv, signal: &Signal, local: Epoch) -> Result<Option<Seen>, OrbitError> {
    seen_from(scene, &Constellation::authentic(), sv, signal, local)
}

/// What a constellation sends as `sv` that arrives when the receiver's clock reads `local`.
///
/// # Errors
/// Those of the orbit.
pub fn seen_from(
    scene: &Scene,
    from: &Constellation,
    sv: Sv,
    signal: &Signal,
    local: Epoch,
) -> Result<Option<Seen>, OrbitError> {
    seen_by(scene, from, (sv, signal), local, None)
}

/// [`seen_from`] where what all signals of the satellite have in common may be known.
///
/// # Errors
/// Those of the orbit.
pub fn seen_by(
    scene: &Scene,
    from: &Constellation,
    link: (Sv, &Signal),
    local: Epoch,
    known: Option<&Geometry>,
) -> Result<Option<Seen>, OrbitError> {
    seen_near(scene, from, link, local, (LIGHT_TIME_S, known))
}

/// [`seen_by`] with a guess of the light time.
fn seen_near(
    scene: &Scene,
    from: &Constellation,
    (sv, signal): (Sv, &Signal),
    local: Epoch,
    (guess_s, known): (f64, Option<&Geometry>),
) -> Result<Option<Seen>, OrbitError> {
    let find = || {
        let (time, elapsed_s, motion) = received(scene, from, local);
        let emission = emission_near(&scene.catalogue, sv, time, &motion, guess_s)?;
        let bias_s = local.since(time) - from.clock_s(elapsed_s);
        Ok(emission.map(|emission| Arriving { emission, bias_s, gain: from.gain(elapsed_s) }))
    };
    let found = match known {
        Some(known) => known.at(local, guess_s, find)?,
        None => find()?,
    };
    Ok(found.map(|found| arriving(scene, signal, found)))
}

/// [`seen_from`] of a satellite on a short arc of its orbit.
///
/// # Errors
/// None by itself; the type is that of [`seen_from`].
pub fn seen_on(
    scene: &Scene,
    from: &Constellation,
    arc: &Arc,
    signal: &Signal,
    local: Epoch,
) -> Result<Option<Seen>, OrbitError> {
    let (time, elapsed_s, motion) = received(scene, from, local);
    let bias_s = local.since(time) - from.clock_s(elapsed_s);
    let found = arc.emission(time, &motion)?;
    let gain = from.gain(elapsed_s);
    Ok(found.map(|emission| arriving(scene, signal, Arriving { emission, bias_s, gain })))
}

/// The rays of a signal of what arrives.
fn arriving(scene: &Scene, signal: &Signal, Arriving { emission, bias_s, gain }: Arriving) -> Seen {
    let mut rays = vec![Ray { code_delay_s: 0.0, carrier_delay_s: 0.0, phase_cycles: 0.0, cn0_hz: 0.0 }];
    for effect in &scene.effects {
        effect.act(&emission.sight, signal, &mut rays);
    }
    // Small numbers only: no reading of a clock enters a sum of seconds.
    let sent = emission.sight.received.plus_s(-emission.travel_s);
    let ahead_s = scene.catalogue.signal_clock_s(emission.sight.sv, sent, signal);
    let satellite_clock_s = emission.satellite_clock_s + ahead_s;
    let common_s = bias_s + emission.travel_s - satellite_clock_s;
    rays.iter_mut().for_each(|ray| ray.cn0_hz *= gain);
    let arrivals = rays
        .iter()
        .map(|ray| Arrival {
            delay_s: common_s + ray.code_delay_s,
            carrier_cycles: signal.carrier_hz(emission.sight.sv)
                * (planted!("generator.truth.clock_in_carrier", common_s, common_s - bias_s) + ray.carrier_delay_s)
                + ray.phase_cycles,
            cn0_hz: ray.cn0_hz,
        })
        .collect();
    Seen { emission, satellite_clock_s, rays, arrivals }
}

/// Whether `sv` is in the scene's sky when the receiver's clock reads `local`: it has a message to send and
/// stands above the mask, or from space not behind the Earth. Health is the scene's to judge, through its
/// exclusions.
///
/// # Errors
/// Those of the orbit.
pub fn in_view(scene: &Scene, sv: Sv, local: Epoch) -> Result<bool, OrbitError> {
    in_view_from(scene, &Constellation::authentic(), sv, local)
}

/// Whether `sv` is in the sky of the place that a constellation's signals are made for.
///
/// # Errors
/// Those of the orbit.
pub fn in_view_from(scene: &Scene, from: &Constellation, sv: Sv, local: Epoch) -> Result<bool, OrbitError> {
    Ok(presence_from(scene, from, sv, local)?.end().is_none())
}

/// Where `sv` is in the sky of the place that a constellation's signals are made for.
///
/// # Errors
/// Those of the orbit.
pub fn presence_from(scene: &Scene, from: &Constellation, sv: Sv, local: Epoch) -> Result<Presence, OrbitError> {
    let (time, _, motion) = received(scene, from, local);
    presence(scene, sv, time, &motion)
}

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
    let step_s = if spin_hz > 0.0 { DOPPLER_STEP_S.min(DOPPLER_STEP_TURNS / spin_hz) } else { DOPPLER_STEP_S };
    let reach_s = 2.0 * step_s;
    let mut breaks = from.motion_breaks_s(scene);
    if let Some(clock) = from.fading(sv).and_then(|sv| scene.satellite_clocks.of(sv)) {
        breaks.extend(clock.breaks_s(scene));
        breaks.sort_by(f64::total_cmp);
    }
    let rippled = |seen: &Seen, away_s: f64| {
        let place = sample as f64 + away_s * scene.clock.rate.hz();
        let ripple = ripple::at(scene, from.fading(sv), signal.carrier_hz(sv), place);
        seen.arrivals.first().map(|arrival| arrival.rippled(ripple).carrier_cycles)
    };
    let near = |b: &&f64| (**b - elapsed_s).abs() < reach_s;
    // Lagrange's derivative weights; the middle of the stencil moves away from the break.
    let (offset, weights) = match breaks.iter().find(near) {
        None => (-2, [1.0, -8.0, 0.0, 8.0, -1.0]),
        Some(b) if *b <= elapsed_s => (0, [-25.0, 48.0, -36.0, 16.0, -3.0]),
        Some(_) => (-4, [3.0, -16.0, 36.0, -48.0, 25.0]),
    };
    let Some(base) = rippled(here, 0.0) else { return Ok(None) };
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
        let Some(carrier_cycles) = rippled(&seen, away_s) else { return Ok(None) };
        sum += weight * (carrier_cycles - base);
    }
    Ok(Some(planted!("generator.truth.doppler", -sum, sum) / (12.0 * step_s)))
}

/// What is true of a satellite at a sample: the observation of its first ray, where it stands in the sky, and the other
/// rays as they come beside the first.
pub type Truth = (Observation, SkyRow, Vec<RayRow>);

/// What is true of `sv` at a sample.
///
/// # Errors
/// Those of the orbit.
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

/// [`observe`] where what all signals of the satellite have in common may be known.
///
/// # Errors
/// Those of the orbit.
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
    // What is blocked altogether is not there to be observed.
    if ray.cn0_hz <= 0.0 {
        return Ok(None);
    }
    let arrival = arrival.rippled(ripple::at(scene, from.fading(sv), signal.carrier_hz(sv), sample as f64));
    let doppler_hz = doppler_hz(scene, from, (sv, signal), sample, (&seen, known))?;
    let Some(doppler_hz) = doppler_hz else { return Ok(None) };
    let sent = local.plus_s(-arrival.delay_s);
    let observation = Observation {
        sample,
        sv,
        signal,
        sent_s: sent.seconds(),
        sent_fraction_s: sent.fraction(),
        pseudorange_m: SPEED_OF_LIGHT_MPS * arrival.delay_s,
        carrier_cycles: arrival.carrier_cycles,
        doppler_hz,
        cn0_dbhz: 10.0 * libm::log10(arrival.cn0_hz),
        locked_s,
    };
    let sight = &seen.emission.sight;
    let clock = from.fading(sv).and_then(|sv| scene.satellite_clocks.of(sv));
    let departed_s = clock.map_or(0.0, |clock| clock.at_s(scene, sample as f64));
    let sky = SkyRow {
        sample,
        sv,
        azimuth_deg: sight.look.azimuth_rad.to_degrees(),
        elevation_deg: sight.look.elevation_rad.to_degrees(),
        range_m: sight.range_m,
        satellite_clock_m: SPEED_OF_LIGHT_MPS * (seen.satellite_clock_s + departed_s),
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
    let rays = rays.collect();
    Ok(Some((observation, sky, rays)))
}

/// Antenna and clock at a sample, as they are or as a spoofer claims them: the receiver's clock against its clock.
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
        clock_bias_s: clock.offset_at_reading_s(scene.clock.start, local) + quick_s - from.clock_s(elapsed_s),
        clock_drift: clock.drift_at_reading(scene.clock.start, local) - from.clock_drift,
    }
}
