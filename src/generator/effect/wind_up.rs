//! Wind-up: the carrier phase of right-hand circular polarisation when antennas turn about the line of sight.
//!
//! Source: Wu, Wu, Hajj, Bertiger and Lichten 1993 (crossed dipoles at both ends); the satellite yaws
//! nominally, its x axis towards the Sun. The received carrier grows (as with range) when the antenna turns
//! right-handed about the direction in which the wave travels.
//!
//! Turns are counted, not unwrapped. A pair of crossed dipoles whose axis is β off the spin axis receives a
//! satellite that is θ off that axis as `(cos θ/2 cos β/2 e^{jx/2} + sin θ/2 sin β/2 e^{-jx/2})²`, x its
//! azimuth about the axis. For θ + β below 180° the phase is therefore `x + 2 arg(1 + tan θ/2 tan β/2
//! e^{-jx})`, whose second term never leaves ±180°; beyond, the first term's sign turns round. What is left
//! is slow and stays within half a cycle of its value at the start, headings counted. On a body that turns as
//! it is pushed whole turns are counted from tick to tick (`counted`). Limits: a satellite that crosses
//! θ + β = 180°, where the antenna is deaf to it once a turn, changes its whole number of cycles; so does one
//! that crosses the spin axis's rear.

mod counted;

use std::collections::BTreeMap;
use std::f64::consts::TAU;
use std::sync::Arc;

use counted::Counted;

use nalgebra::Vector3;

use crate::catalogue::Catalogue;
use crate::ray::{Effect, Ray, Sight};
use crate::sky::emission;
use crate::vehicle::Trajectory;
use crate::vehicle::attitude::Attitude;
use gnss::broadcast::OrbitError;
use gnss::satellite::Sv;
use gnss::signal::Signal;
use gnss::time::Epoch;

/// Seconds of a day, and 2000-01-01T12:00 UTC in GPS time.
const DAY_S: f64 = 86_400.0;
const J2000_GPS_S: i64 = 630_763_213;

/// Wind-up of every ray.
#[derive(Clone, Debug)]
pub struct WindUp {
    start: Epoch,
    trajectory: Trajectory,
    attitude: Attitude,
    /// The slow part of each satellite at the start.
    origins: BTreeMap<Sv, f64>,
    /// Heading of the nose in turns, whole ones counted, at instants of the trajectory.
    headings: Vec<(f64, f64)>,
    /// Whole turns where the attitude is pushed.
    counted: Arc<Counted>,
}

impl WindUp {
    /// Creates the wind-up on the body of `trajectory`; `None` if it has no attitude.
    ///
    /// # Errors
    /// [`OrbitError`] from the elements.
    pub fn new(start: Epoch, trajectory: Trajectory, catalogue: &Catalogue) -> Result<Option<Self>, OrbitError> {
        let Some(attitude) = trajectory.attitude().copied() else { return Ok(None) };
        let (origins, headings, counted) = (BTreeMap::new(), Vec::new(), Arc::default());
        let mut effect = Self { start, trajectory, attitude, origins, headings, counted };
        for knot in effect.trajectory.knots() {
            let raw = effect.trajectory.heading_cycles(knot.t_s);
            let counted = effect.headings.last().map_or(raw, |(_, last)| raw + (last - raw).round());
            effect.headings.push((knot.t_s, counted));
        }
        let motion = effect.trajectory.composed_for();
        for sv in catalogue.satellites() {
            if let Some(found) = emission(catalogue, sv, start, &motion)? {
                let slow = effect.slow_cycles(&found.sight, 0.0).0 - effect.heading_cycles(0.0);
                effect.origins.insert(sv, slow);
            }
        }
        Ok(Some(effect))
    }

    /// Wind-up along `sight` in cycles, whole turns included.
    pub fn cycles(&self, sight: &Sight) -> f64 {
        let t_s = sight.received.since(self.start);
        if let Some(grown) = self.trajectory.grown().filter(|_| self.trajectory.is_turned()) {
            return self.counted.cycles(grown, sight.sv, t_s, |t_s| self.slow_cycles(sight, t_s).0);
        }
        let heading = self.heading_cycles(t_s);
        let origin = self.origins.get(&sight.sv).copied().unwrap_or(0.0);
        let (slow, fast) = self.slow_cycles(sight, t_s);
        let rest = slow - heading - origin;
        heading + origin + (rest - rest.round()) + fast
    }

    /// Geometric wind-up modulo one cycle, and the wind-up of the antenna's spin with its turns counted, in
    /// cycles.
    fn slow_cycles(&self, sight: &Sight, t_s: f64) -> (f64, f64) {
        let wave = (sight.user_m - sight.satellite.position_m) / sight.range_m;
        let Some(body) = self.trajectory.orientation(t_s) else { return (0.0, 0.0) };
        let (nose, right, down) = (body.still * Vector3::x(), body.still * Vector3::y(), body.still * Vector3::z());
        let satellite = dipole(&wave, nominal_yaw(sight), -1.0);
        let boresight = self.attitude.boresight;
        if self.attitude.spin_hz == 0.0 {
            let (east, north) = dipoles(&boresight);
            let antenna = dipole(&wave, (body.still * east, body.still * north), 1.0);
            return (angle_cycles(&wave, &satellite, &antenna), 0.0);
        }
        // Azimuths about the nose of the unspun boresight and of the satellite, from the right side over
        // down.
        let boresight_rad = libm::atan2(boresight.z, boresight.y);
        let satellite_rad = libm::atan2(-wave.dot(&down), -wave.dot(&right));
        let half_tangent = |along: f64, across: f64| across / (1.0 + along);
        let (tan_theta, tan_beta) = (
            half_tangent(-wave.dot(&nose), wave.cross(&nose).norm()),
            half_tangent(boresight.x, boresight.yz().norm()),
        );
        let ratio = tan_theta * tan_beta;
        let (sense, ratio) = if ratio <= 1.0 { (1.0, ratio) } else { (-1.0, 1.0 / ratio) };
        let whole = body.spin_cycles.floor();
        let (sin, cos) = libm::sincos(boresight_rad - satellite_rad + TAU * (body.spin_cycles - whole));
        let beyond = 2.0 * libm::atan2(-ratio * sin, 1.0 + ratio * cos) / TAU;
        // An antenna that looks along the spin axis, or back along it, its dipoles beside the boresight.
        let (sin_b, cos_b) = libm::sincos(boresight_rad);
        let beside = right * cos_b + down * sin_b;
        let axis = nose * sense;
        let still = dipole(&wave, (beside, axis.cross(&beside)), 1.0);
        (angle_cycles(&wave, &satellite, &still), -sense * (body.spin_cycles + beyond))
    }

    /// Wind-up of the heading in cycles, with its turns counted from knot to knot of the trajectory.
    fn heading_cycles(&self, t_s: f64) -> f64 {
        let raw = self.trajectory.heading_cycles(t_s);
        if let Some(grown) = self.trajectory.grown() {
            return raw + (grown.heading_near_cycles(t_s).unwrap_or(raw) - raw).round();
        }
        let next = self.headings.partition_point(|(knot_s, _)| *knot_s <= t_s);
        let near = match (next.checked_sub(1).and_then(|i| self.headings.get(i)), self.headings.get(next)) {
            (Some((a_s, a)), Some((b_s, b))) => a + (b - a) * (t_s - a_s) / (b_s - a_s),
            (Some((_, one)), None) | (None, Some((_, one))) => *one,
            (None, None) => raw,
        };
        raw + (near - raw).round()
    }
}

impl Effect for WindUp {
    fn name(&self) -> &'static str {
        "wind-up"
    }

    fn describe(&self) -> String {
        format!("crossed dipoles, nominal yaw, spin {} Hz", self.attitude.spin_hz)
    }

    fn act(&self, sight: &Sight, _signal: &Signal, rays: &mut Vec<Ray>) {
        let cycles = self.cycles(sight);
        for ray in rays {
            ray.phase_cycles += cycles;
        }
    }
}

/// East and north of an antenna that looks along `up`: north leans towards the nose.
pub(super) fn dipoles(up: &Vector3<f64>) -> (Vector3<f64>, Vector3<f64>) {
    let nose = Vector3::x() - up * up.x;
    // Along the nose itself, the body's top is north.
    let north = if nose.norm() > 1e-6 { nose.normalize() } else { (-Vector3::z() + up * up.z).normalize() };
    (north.cross(up), north)
}

/// The effective dipole of crossed ones for a wave along `wave` (Wu et al., equations 8 and 9); `sense` is −1
/// for the satellite and 1 for the receiver.
fn dipole(wave: &Vector3<f64>, (x, y): (Vector3<f64>, Vector3<f64>), sense: f64) -> Vector3<f64> {
    x - wave * wave.dot(&x) + wave.cross(&y) * sense
}

/// Angle about `wave` from one dipole to the other, in cycles within half a one (equations 27 and 30).
fn angle_cycles(wave: &Vector3<f64>, from: &Vector3<f64>, to: &Vector3<f64>) -> f64 {
    libm::atan2(wave.dot(&from.cross(to)), from.dot(to)) / TAU
}

/// The satellite's x and y axes: z to the Earth's centre, the Sun in the half plane of x.
fn nominal_yaw(sight: &Sight) -> (Vector3<f64>, Vector3<f64>) {
    let z = -sight.satellite.position_m.normalize();
    let y = z.cross(&sun(sight.received)).normalize();
    (y.cross(&z), y)
}

/// Direction of the Sun in ECEF within 0.01° (Astronomical Almanac, low precision); its parallax is left out.
fn sun(at: Epoch) -> Vector3<f64> {
    let days = ((at.seconds() - J2000_GPS_S) as f64 + at.fraction()) / DAY_S;
    let anomaly = (357.528 + 0.985_600_3 * days).to_radians();
    let longitude =
        (280.460 + 0.985_647_4 * days + 1.915 * libm::sin(anomaly) + 0.020 * libm::sin(2.0 * anomaly)).to_radians();
    let (sin_tilt, cos_tilt) = libm::sincos((23.439 - 4e-7 * days).to_radians());
    let (sin, cos) = libm::sincos(longitude);
    let greenwich = (280.460_618_37 + 360.985_647_366_29 * days).to_radians();
    let (sin_g, cos_g) = libm::sincos(greenwich);
    let (x, y, z) = (cos, cos_tilt * sin, sin_tilt * sin);
    Vector3::new(cos_g * x + sin_g * y, cos_g * y - sin_g * x, z)
}

#[cfg(test)]
mod tests {
    use nalgebra::Unit;

    use super::*;
    use crate::vehicle::attitude::Nose;
    use gnss::earth::Geodetic;
    use gnss::rinex;

    fn body(nose: Nose, spin_hz: f64, boresight: Vector3<f64>) -> Attitude {
        Attitude { nose, spin_hz, lever_arm_m: Vector3::zeros(), boresight: Unit::new_normalize(boresight) }
    }

    fn effect(attitude: Attitude) -> (WindUp, Catalogue) {
        let (catalogue, _) = Catalogue::new(rinex::embedded().unwrap().ephemerides);
        let place = Geodetic::from_degrees(26.5, 80.2, 130.0).to_ecef();
        let trajectory = Trajectory::fixed(place).with_attitude(attitude);
        let start = Epoch::from_week(1590, 374_760.0);
        (WindUp::new(start, trajectory, &catalogue).unwrap().unwrap(), catalogue)
    }

    fn sights(effect: &WindUp, catalogue: &Catalogue, t_s: f64) -> Vec<Sight> {
        let at = effect.start.plus_s(t_s);
        let found = catalogue
            .satellites()
            .filter_map(|sv| emission(catalogue, sv, at, &effect.trajectory.at(t_s)).unwrap().map(|e| e.sight));
        found.filter(|sight| sight.look.elevation_rad > 0.1).collect()
    }

    #[test]
    fn the_sun_stands_where_the_almanac_says() {
        // Equinox of 2010-03-20 17:32 UTC: declination 0. Noon at Greenwich on 2010-07-01: the equation of
        // time is −3.9 min, so the Sun is 0.97° east of the meridian; declination 23.1°.
        let equinox = sun(Epoch::parse("2010-03-20T17:32:15").unwrap());
        assert!(libm::asin(equinox.z).to_degrees().abs() < 0.02);
        let noon = sun(Epoch::parse("2010-07-01T12:00:15").unwrap());
        assert!((libm::asin(noon.z).to_degrees() - 23.1).abs() < 0.1);
        assert!((libm::atan2(noon.y, noon.x).to_degrees() - 0.97).abs() < 0.1);
    }

    #[test]
    fn an_antenna_turned_right_handed_about_the_wave_gains_that_many_cycles() {
        // Looking up, a turn of the nose from north over east is right-handed about a wave that comes down.
        let yawed = |yaw_rad: f64| {
            let nose = Nose::Fixed { yaw_rad, pitch_rad: 0.0, roll_rad: 0.0 };
            let (effect, catalogue) = effect(body(nose, 0.0, -Vector3::z()));
            let sight = sights(&effect, &catalogue, 0.0).remove(0);
            effect.slow_cycles(&sight, 0.0).0
        };
        let gained = yawed(0.5) - yawed(0.0);
        assert!((gained - gained.round() - 0.5 / TAU).abs() < 1e-12, "{gained}");
    }

    #[test]
    fn spun_wind_up_is_that_of_the_dipoles_turned_and_counts_every_turn() {
        for (tilt_deg, spin_hz) in [(0.0_f64, 100.0), (40.0, 100.0), (90.0, 100.0), (90.0, -3.0), (150.0, 10.0)] {
            let (sin, cos) = libm::sincos(tilt_deg.to_radians());
            let nose = Nose::Fixed { yaw_rad: 2.2, pitch_rad: 1.4, roll_rad: 0.0 };
            let (effect, catalogue) = effect(body(nose, spin_hz, Vector3::new(cos, 0.6 * sin, -0.8 * sin)));
            let (east, north) = dipoles(&effect.attitude.boresight);
            let step_s = 1.0 / (200.0 * spin_hz.abs());
            let mut last: BTreeMap<Sv, f64> = BTreeMap::new();
            let mut offset: BTreeMap<Sv, f64> = BTreeMap::new();
            for k in 0..=500 {
                let t_s = 20.0 + f64::from(k) * step_s;
                for sight in sights(&effect, &catalogue, t_s) {
                    // Wu's formula with the dipoles where the spin has brought them.
                    let wave = (sight.user_m - sight.satellite.position_m) / sight.range_m;
                    let axes = effect.trajectory.orientation(t_s).unwrap().axes();
                    let antenna = dipole(&wave, (axes * east, axes * north), 1.0);
                    if antenna.norm() < 0.05 {
                        last.remove(&sight.sv);
                        continue;
                    }
                    let satellite = dipole(&wave, nominal_yaw(&sight), -1.0);
                    let found = effect.cycles(&sight);
                    let apart = found - angle_cycles(&wave, &satellite, &antenna);
                    // The dipoles' own angle about the boresight is a constant of the mount.
                    let constant = *offset.entry(sight.sv).or_insert(apart);
                    let miss = apart - constant - (apart - constant).round();
                    assert!(miss.abs() < 1e-9, "{tilt_deg} {} {miss}", sight.sv);
                    if let Some(before) = last.insert(sight.sv, found) {
                        assert!((found - before).abs() < 0.45, "{tilt_deg} {} {before} {found}", sight.sv);
                    }
                }
            }
            // Ten turns later: the cycles counted, of the sense in which the satellite sees them.
            let [begin, end] = [20.0, 20.0 + 10.0 / spin_hz.abs()].map(|t_s| {
                let all = sights(&effect, &catalogue, t_s);
                all.iter().map(|sight| (sight.sv, effect.cycles(sight))).collect::<BTreeMap<_, _>>()
            });
            for (sv, counted) in end {
                let turns = counted - begin[&sv];
                // Satellites move 1e-4 rad a second.
                assert!((turns.abs() - 10.0).abs() < 1e-3, "{tilt_deg} {sv} {turns}");
            }
        }
    }
}
