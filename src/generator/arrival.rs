//! Arrival of a satellite's signal at one time of the receiver's clock.
//!
//! One definition serves samples and truth: with T the clock's time, t the true time and τ the light time,
//! the delay of the code is (T − t) + τ + (delays of the ray) − (satellite clock); that of the carrier takes
//! the ray's carrier delay instead, and is counted in cycles at RF.

use crate::geometry::{Arriving, Geometry, Places};
use crate::knots::Arrival;
use crate::presence::{Presence, presence_in};
use crate::ray::Ray;
use crate::scene::Scene;
use crate::sky::{Arc, Emission, LIGHT_TIME_S, Place, emission_near};
use crate::spoof::Constellation;
use crate::vehicle::Motion;
use gnss::broadcast::OrbitError;
use gnss::satellite::Sv;
use gnss::signal::Signal;
use gnss::time::Epoch;

/// A satellite's signal as it arrives at one time of the receiver's clock.
#[derive(Clone, Debug)]
pub struct Seen {
    /// Time and position of emission, and the line of sight.
    pub emission: Emission,
    /// Satellite clock minus GPS time at emission, for this signal, in seconds.
    pub satellite_clock_s: f64,
    /// Rays after all effects, the direct one first.
    pub rays: Vec<Ray>,
    /// Delay, carrier phase and power of each ray at the antenna.
    pub arrivals: Vec<Arrival>,
}

/// True time, and the motion for which a constellation's signals are made, at the receiver's clock time
/// `local`.
pub(super) fn received(scene: &Scene, from: &Constellation, local: Epoch) -> (Epoch, f64, Motion) {
    let start = scene.clock.start;
    let elapsed_s = scene.receiver_clock.true_elapsed_s(start, local);
    let time = from.replayed(scene.receiver_clock.true_time(start, local));
    (time, elapsed_s, from.motion(&scene.trajectory, elapsed_s))
}

/// Computes the arrival from the true satellite `sv` at the time `local` of the receiver's clock; `None`
/// without an ephemeris.
///
/// # Errors
/// Errors of the orbit.
pub fn seen(scene: &Scene, sv: Sv, signal: &Signal, local: Epoch) -> Result<Option<Seen>, OrbitError> {
    seen_from(scene, &Constellation::authentic(), sv, signal, local)
}

/// Computes the arrival of the signal that a constellation sends as `sv`, at the time `local` of the
/// receiver's clock.
///
/// # Errors
/// Errors of the orbit.
pub fn seen_from(
    scene: &Scene,
    from: &Constellation,
    sv: Sv,
    signal: &Signal,
    local: Epoch,
) -> Result<Option<Seen>, OrbitError> {
    seen_by(scene, from, (sv, signal), local, None)
}

/// Like [`seen_from`], with the geometry that all signals of the satellite share, if it is stored.
///
/// # Errors
/// Errors of the orbit.
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
pub(super) fn seen_near(
    scene: &Scene,
    from: &Constellation,
    (sv, signal): (Sv, &Signal),
    local: Epoch,
    (guess_s, known): (f64, Option<&Geometry>),
) -> Result<Option<Seen>, OrbitError> {
    let find = || {
        let (time, elapsed_s, motion) = received(scene, from, local);
        let emission = emission_near(scene.catalogue_of(from), sv, time, &motion, guess_s)?;
        let bias_s = from.ahead(local).since(time) - from.clock_s(elapsed_s);
        let (path_s, gain) = (from.path_s(&scene.trajectory, elapsed_s), from.gain(elapsed_s));
        Ok(emission.map(|emission| Arriving { emission, bias_s, path_s, gain }))
    };
    let found = match known {
        Some(known) => known.at(local, guess_s, find)?,
        None => find()?,
    };
    Ok(found.map(|found| arriving(scene, from, signal, found)))
}

/// Like [`seen_from`], for a satellite on a short arc of its orbit, with the antenna's position if it is
/// stored.
///
/// # Errors
/// None by itself; the type is that of [`seen_from`].
pub fn seen_on(
    scene: &Scene,
    from: &Constellation,
    arc: &Arc,
    signal: &Signal,
    local: Epoch,
    places: Option<&Places>,
) -> Result<Option<Seen>, OrbitError> {
    let find = || {
        let (time, elapsed_s, motion) = received(scene, from, local);
        Place::new(time, elapsed_s, motion)
    };
    // Stored places are those of the true time.
    let places = places.filter(|_| from.replay_s == 0.0 && from.ahead_s == 0);
    let place = places.map_or_else(find, |places| places.at(local, find));
    let bias_s = from.ahead(local).since(place.time) - from.clock_s(place.elapsed_s);
    let found = arc.emission(&place)?;
    let (path_s, gain) = (from.path_s(&scene.trajectory, place.elapsed_s), from.gain(place.elapsed_s));
    Ok(found.map(|emission| arriving(scene, from, signal, Arriving { emission, bias_s, path_s, gain })))
}

/// Computes the rays of a signal from the arrival of its satellite. Cycles of a replay's delay are not
/// counted: its carrier begins at any phase.
fn arriving(
    scene: &Scene,
    from: &Constellation,
    signal: &Signal,
    Arriving { emission, bias_s, path_s, gain }: Arriving,
) -> Seen {
    let mut rays = vec![Ray { code_delay_s: 0.0, carrier_delay_s: 0.0, phase_cycles: 0.0, cn0_hz: 0.0 }];
    let now = from.in_scene(&emission.sight);
    let sight = now.as_ref().unwrap_or(&emission.sight);
    for effect in &scene.effects {
        effect.act(sight, signal, &mut rays);
    }
    // Small numbers only: no clock time enters a sum of seconds.
    let sent = emission.sight.received.plus_s(-emission.travel_s);
    let ahead_s = scene.catalogue_of(from).signal_clock_s(emission.sight.sv, sent, signal);
    let satellite_clock_s = emission.satellite_clock_s + ahead_s;
    let common_s = bias_s + emission.travel_s - satellite_clock_s + planted!("generator.spoof.path", path_s, 0.0);
    let counted_s = common_s - from.replay_s;
    rays.iter_mut().for_each(|ray| ray.cn0_hz *= gain);
    let arrivals = rays
        .iter()
        .map(|ray| Arrival {
            delay_s: common_s + ray.code_delay_s,
            carrier_cycles: signal.carrier_hz(emission.sight.sv)
                * (planted!("generator.truth.clock_in_carrier", counted_s, common_s - bias_s) + ray.carrier_delay_s)
                + ray.phase_cycles,
            cn0_hz: ray.cn0_hz,
        })
        .collect();
    Seen { emission, satellite_clock_s, rays, arrivals }
}

/// True if `sv` is in the scene's sky at the time `local` of the receiver's clock. It must have a message to
/// send, and be above the mask, or from space not behind the Earth. Health does not matter here; the scene
/// applies it through its exclusions.
///
/// # Errors
/// Errors of the orbit.
pub fn in_view(scene: &Scene, sv: Sv, local: Epoch) -> Result<bool, OrbitError> {
    in_view_from(scene, &Constellation::authentic(), sv, local)
}

/// True if `sv` is in the sky of the position for which a constellation's signals are made.
///
/// # Errors
/// Errors of the orbit.
pub fn in_view_from(scene: &Scene, from: &Constellation, sv: Sv, local: Epoch) -> Result<bool, OrbitError> {
    Ok(presence_from(scene, from, sv, local)?.end().is_none())
}

/// Presence of `sv` in the sky of the position for which a constellation's signals are made.
///
/// # Errors
/// Errors of the orbit.
pub fn presence_from(scene: &Scene, from: &Constellation, sv: Sv, local: Epoch) -> Result<Presence, OrbitError> {
    let (time, _, motion) = received(scene, from, local);
    presence_in(scene, scene.catalogue_of(from), sv, time, &motion)
}
