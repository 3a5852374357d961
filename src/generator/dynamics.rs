//! Dynamics that the motion imposes on a carrier loop: acceleration and jerk along the line of sight to each
//! satellite.
//!
//! With u from the antenna to the satellite the range's second derivative is u·(a_s − a) + |Δv across u|²/ρ,
//! all in the Earth's axes; the satellite's share and u are taken at 240 instants, the body's at ten
//! positions between its knots. A spin carries the antenna round a circle, which counts for itself
//! ([`Trajectory::circle`](crate::vehicle::Trajectory::circle)). Limits: of jerk only the body's
//! share counts, −u·da/dt: the turning of u adds below 0.02 m/s³ for a rocket at 20 g; what an oscillator
//! makes of acceleration is left out.

use nalgebra::Vector3;

use serde::Serialize;

use crate::plan::strength_dbhz;
use crate::presence::{Presence, presence};
use crate::ray::Sight;
use crate::scene::Scene;
use gnss::broadcast::OrbitError;
use gnss::earth::{EARTH_ROTATION_RADPS, GPS_MU_M3PS2};
use gnss::satellite::Sv;

/// Instants between start and end at which satellites are placed.
const INSTANTS: u32 = 240;
/// Positions between two knots at which the body's acceleration is taken.
const PLACES: u32 = 10;

/// Largest rates of change of a satellite's range while it is in view.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct LineOfSight {
    /// The satellite.
    pub sv: Sv,
    /// Largest magnitude of the range's second derivative, in m/s².
    pub acceleration_mps2: f64,
    /// Largest jerk along the line of sight, in m/s³.
    pub jerk_mps3: f64,
    /// Difference of the largest and the least second derivative, in m/s²: an upper bound for any step of it.
    pub swing_mps2: f64,
    /// Time of the largest jerk, in true seconds after the scene's start.
    pub jerk_s: f64,
    /// C/N0 in dB-Hz of the first signal's direct ray at that time. Without jerk it is taken when the
    /// satellite comes into view.
    pub cn0_dbhz: Option<f64>,
}

/// View of a satellite at an instant: unit vector towards it, and its contribution to the range's second
/// derivative.
#[derive(Clone, Copy)]
struct Look {
    towards: Vector3<f64>,
    own_mps2: f64,
    cn0_dbhz: Option<f64>,
}

/// Acceleration and its rate, of the body.
#[derive(Clone, Copy)]
struct Pull {
    t_s: f64,
    acceleration_mps2: Vector3<f64>,
    jerk_mps3: Vector3<f64>,
}

/// Computes the lines of sight of the satellites that are in view for some of the scene, in their order.
///
/// # Errors
/// Errors of the orbit.
pub fn lines_of_sight(scene: &Scene) -> Result<Vec<LineOfSight>, OrbitError> {
    let duration_s = scene.clock.rate.elapsed_s(scene.samples);
    let pulls = pulls(scene, duration_s);
    let mut found = Vec::new();
    for sv in scene.senders() {
        let looks = looks(scene, sv, duration_s)?;
        let mut line: Option<LineOfSight> = None;
        let (mut least, mut most) = (f64::INFINITY, f64::NEG_INFINITY);
        for pull in &pulls {
            let index = (pull.t_s / duration_s.max(1e-9) * f64::from(INSTANTS)).round() as usize;
            let Some(Some(look)) = looks.get(index) else { continue };
            let line = line.get_or_insert(LineOfSight {
                sv,
                acceleration_mps2: 0.0,
                jerk_mps3: 0.0,
                swing_mps2: 0.0,
                jerk_s: pull.t_s,
                cn0_dbhz: look.cn0_dbhz,
            });
            let range_mps2 = look.own_mps2 - look.towards.dot(&pull.acceleration_mps2);
            let jerk_mps3 = look.towards.dot(&pull.jerk_mps3).abs();
            (least, most) = (least.min(range_mps2), most.max(range_mps2));
            line.acceleration_mps2 = line.acceleration_mps2.max(range_mps2.abs());
            line.swing_mps2 = most - least;
            if jerk_mps3 > line.jerk_mps3 {
                (line.jerk_mps3, line.jerk_s, line.cn0_dbhz) = (jerk_mps3, pull.t_s, look.cn0_dbhz);
            }
        }
        found.extend(line);
    }
    Ok(found)
}

/// Acceleration and jerk towards a satellite at each instant.
fn looks(scene: &Scene, sv: Sv, duration_s: f64) -> Result<Vec<Option<Look>>, OrbitError> {
    let at = |k: u32| {
        let t_s = duration_s * f64::from(k) / f64::from(INSTANTS);
        let motion = scene.trajectory.at(t_s);
        Ok(match presence(scene, sv, scene.clock.start.plus_s(t_s), &motion)? {
            Presence::InView(emission) => Some(look(scene, &emission.sight)),
            _ => None,
        })
    };
    (0..=INSTANTS).map(at).collect()
}

fn look(scene: &Scene, sight: &Sight) -> Look {
    let state = &sight.satellite;
    let to_m = state.position_m - sight.user_m;
    let towards = to_m / sight.range_m;
    let spin = Vector3::new(0.0, 0.0, EARTH_ROTATION_RADPS);
    let radius_m = state.position_m.norm();
    // Gravity of a point, and what turning axes make of it: good to 1e-3 m/s², the Earth's flatness.
    let satellite_mps2 = state.position_m * (-GPS_MU_M3PS2 / (radius_m * radius_m * radius_m))
        - spin.cross(&state.velocity_mps) * 2.0
        - spin.cross(&spin.cross(&state.position_m));
    let across = (state.velocity_mps - sight.user_mps).cross(&towards).norm_squared() / sight.range_m;
    Look { towards, own_mps2: towards.dot(&satellite_mps2) + across, cn0_dbhz: strength_dbhz(scene, None, sight).0 }
}

/// The body's acceleration at each instant, and with its jerk between knots.
fn pulls(scene: &Scene, duration_s: f64) -> Vec<Pull> {
    let acceleration_mps2 = |t_s: f64| scene.trajectory.body(t_s).acceleration_mps2;
    let still = |k: u32| {
        let t_s = duration_s * f64::from(k) / f64::from(INSTANTS);
        Pull { t_s, acceleration_mps2: acceleration_mps2(t_s), jerk_mps3: Vector3::zeros() }
    };
    let mut found: Vec<Pull> = (0..=INSTANTS).map(still).collect();
    for pair in scene.trajectory.knots().windows(2) {
        let [a, b] = pair else { continue };
        let (from_s, to_s) = (a.t_s.max(0.0), b.t_s.min(duration_s));
        let step_s = (to_s - from_s) / f64::from(PLACES);
        if step_s <= 0.0 {
            continue;
        }
        let mut before = acceleration_mps2(from_s);
        for k in 1..=PLACES {
            let t_s = from_s + step_s * f64::from(k);
            let here = acceleration_mps2(t_s);
            found.push(Pull { t_s, acceleration_mps2: here, jerk_mps3: (here - before) / step_s });
            before = here;
        }
    }
    found
}
