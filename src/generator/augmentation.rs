//! The ground network of an augmentation system: its corrections for GPS satellites and the ionosphere.
//!
//! It knows the truth of the scene and what satellites send, faults of either among them, and sends the
//! difference: of the orbit by long-term corrections, of the clock by fast ones, of the ionosphere at the
//! points of its grid. What is left is the rounding of the fields, and what moves until the next block; the
//! indicators of accuracy bound both. A satellite is out of use where it reports so itself, where an operator
//! does, or where a difference exceeds what the fields hold. Limits: the network is without noise and delay;
//! noise that a fault adds to a clock is not corrected; one list of satellites and points, those near where
//! the motion begins, serves the whole scene.

use std::fmt;
use std::sync::Arc;

use nalgebra::Vector3;

use crate::catalogue::Catalogue;
use crate::message::{MessageFault, spoiled};
use crate::ray::{Effect, Ray, Sight};
use crate::sky::emission;
use gnss::augmentation::accuracy::{DO_NOT_USE, NOT_MONITORED, udrei_of};
use gnss::augmentation::grid::{BANDS, EDGE_DEG, Point, points};
use gnss::augmentation::{Factors, Known, LongTerm, Network};
use gnss::broadcast::{Ephemeris, State};
use gnss::earth::{Geodetic, Look, SPEED_OF_LIGHT_MPS};
use gnss::gps::l1ca::L1_CA;
use gnss::gps::lnav::LNAV;
use gnss::satellite::{Sv, System};
use gnss::time::Epoch;

/// Steps of fast corrections and of positions (A.4.4.3, A.4.4.7).
const STEP_M: f64 = 0.125;
/// Limits of the fields, in metres: a fast correction, a position without and with rates, a rate.
const LARGEST_FAST_M: f64 = 255.875;
const LARGEST_STEADY_M: f64 = 31.875;
const LARGEST_MOVING_M: f64 = 127.875;
const LARGEST_RATE_MPS: f64 = 0.062;
/// Seconds until the next fast correction and the next long-term one, at the longest.
const FAST_S: f64 = 6.0;
const LONG_S: f64 = 120.0;
/// A clock that is faster against its correction takes the ageing that has receivers extrapolate.
const QUICK_MPS: f64 = 0.01;
const EXTRAPOLATED: u8 = 15;
/// Great circle from where the motion begins to the points of the grid, in degrees: 14° to where a line of
/// sight at 5° meets the shell, and a cell.
const GRID_DEG: f64 = 20.0;
/// Share of a delay by which shells at other heights than the grid's differ along a line of sight at 5°: at
/// 450 km 10 %.
const SHELL_SHARE: f64 = 0.1;
/// A satellite above a point of the grid.
const ABOVE_M: f64 = 2.02e7;
/// Degradation of the corrections: what is left of each, until the next one comes, is in its indicator, and
/// each step more of their steps of 12.5 cm and of the intervals of table A-25 costs as much again.
const FACTORS: Factors = Factors {
    b_rrc_m: STEP_M,
    c_ltc_lsb_m: STEP_M,
    c_ltc_v1_mps: 0.001,
    i_ltc_v1_s: LONG_S,
    c_ltc_v0_m: STEP_M,
    i_ltc_v0_s: LONG_S,
    c_geo_lsb_m: 0.0,
    c_geo_v_mps: 0.0,
    i_geo_s: LONG_S,
    c_er_m: 0.5,
    c_iono_step_m: STEP_M,
    i_iono_s: 300.0,
    c_iono_ramp_mps: 0.0,
    is_squared: false,
    is_delay_squared: false,
    c_covariance: 0.0,
};
/// Seconds over which differences of orbits and of clocks are taken.
const ORBIT_STEP_S: f64 = 60.0;
const CLOCK_STEP_S: f64 = 1.0;
/// Steps of the reference time of long-term corrections.
const REFERENCE_S: i64 = 16;

/// Clock error over true time since the scene's start.
#[derive(Clone, Debug, PartialEq)]
pub enum Departure {
    /// Clock offset in seconds from the first to the second time.
    Step(f64, f64, f64),
    /// Gains so much a second from the first to the second time, and keeps it.
    Ramp(f64, f64, f64),
}

impl Departure {
    fn at_s(&self, elapsed_s: f64) -> f64 {
        match *self {
            Self::Step(step_s, on_s, off_s) if (on_s..off_s).contains(&elapsed_s) => step_s,
            Self::Step(..) => 0.0,
            Self::Ramp(drift, on_s, off_s) => drift * (elapsed_s.min(off_s) - on_s).max(0.0),
        }
    }
}

/// Inputs of the ground network.
#[derive(Clone)]
pub struct Ground {
    /// True orbits and clocks, and the broadcast ephemerides.
    pub catalogue: Arc<Catalogue>,
    /// Faults of messages.
    pub message_faults: Vec<MessageFault>,
    /// Clock errors beyond the message faults.
    pub departures: Vec<(Sv, Departure)>,
    /// The scene's start.
    pub start: Epoch,
    /// True if the network reports test mode.
    pub is_test: bool,
    /// Satellites that an operator has declared unusable.
    pub do_not_use: Vec<Sv>,
    /// True if the network sends how its corrections degrade.
    pub sends_factors: bool,
    /// Ionosphere; absent means that there is none, and no grid either.
    pub ionosphere: Option<Arc<dyn Effect>>,
}

/// Ground network over a region.
pub struct GroundNetwork {
    ground: Ground,
    numbers: Vec<u8>,
    bands: Vec<(u8, Vec<u8>)>,
}

impl fmt::Debug for GroundNetwork {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "network of satellites {:?}, bands {:?}", self.numbers, self.bands)
    }
}

impl GroundNetwork {
    /// The network around a position; it corrects the satellites that are above its horizon at one of the
    /// times.
    pub fn around(ground: Ground, motion: &crate::vehicle::Motion, times: &[Epoch]) -> Self {
        let is_up = |sv: Sv, at: Epoch| {
            let found = emission(&ground.catalogue, sv, at, motion).ok().flatten();
            found.is_some_and(|found| found.sight.look.elevation_rad > 0.0)
        };
        let gps = ground.catalogue.satellites().filter(|sv| sv.system == System::Gps);
        let numbers = gps.filter(|sv| times.iter().any(|at| is_up(*sv, *at))).map(Sv::prn).collect();
        let here = Geodetic::from_ecef(&motion.position_m);
        let bands = if ground.ionosphere.is_some() { bands_around(here) } else { Vec::new() };
        Self { ground, numbers, bands }
    }

    /// Truth minus broadcast of an ephemeris that is sent: position in metres, and clock in metres of range.
    fn difference(&self, sent: &Ephemeris, at: Epoch) -> Option<(Vector3<f64>, f64)> {
        let (state, clock) = self.ground.catalogue.truth(sent.sv, at).ok()??;
        let (said, said_clock) = sent.state_and_clock_l1(at).ok()?;
        let elapsed_s = at.since(self.ground.start);
        let own = self.ground.departures.iter().filter(|(sv, _)| *sv == sent.sv);
        let departed_s: f64 = own.map(|(_, departure)| departure.at_s(elapsed_s)).sum();
        let ahead_s = clock.offset_s + departed_s - said_clock.offset_s;
        Some((state.position_m - said.position_m, SPEED_OF_LIGHT_MPS * ahead_s))
    }

    /// The ephemeris that a satellite sends, as it is received.
    fn sent(&self, sv: Sv, at: Epoch) -> Option<Ephemeris> {
        let set = self.ground.catalogue.sent_at(sv, at)?;
        let sent = spoiled(&self.ground.message_faults, &LNAV, sv, set, at).unwrap_or_else(|| (LNAV.form)(set));
        Some(LNAV.fields.quantised(&sent).unwrap_or(sent))
    }
}

/// Points of every band that are near a position, by their numbers.
fn bands_around(here: Geodetic) -> Vec<(u8, Vec<u8>)> {
    let direction = |(latitude_deg, longitude_deg): Point| {
        let (sin_latitude, cos_latitude) = libm::sincos(f64::from(latitude_deg).to_radians());
        let (sin_longitude, cos_longitude) = libm::sincos(f64::from(longitude_deg).to_radians());
        Vector3::new(cos_latitude * cos_longitude, cos_latitude * sin_longitude, sin_latitude)
    };
    let axes = here.ecef_to_enu();
    let up = Vector3::new(axes[(2, 0)], axes[(2, 1)], axes[(2, 2)]);
    let near = |point: Point| point.0.abs() <= EDGE_DEG && direction(point).dot(&up) > libm::cos(GRID_DEG.to_radians());
    let of = |band: u8| {
        let own = (1..).zip(points(band)).filter(|(_, point)| near(*point));
        (band, own.map(|(number, _)| number).collect::<Vec<u8>>())
    };
    (0..BANDS).map(of).filter(|(_, own)| !own.is_empty()).collect()
}

/// Rounds to the nearest step of positions and fast corrections.
fn to_step(value_m: f64) -> f64 {
    (value_m / STEP_M).round() * STEP_M
}

impl Network for GroundNetwork {
    fn is_test(&self) -> bool {
        self.ground.is_test
    }

    fn numbers(&self) -> &[u8] {
        &self.numbers
    }

    fn satellite(&self, number: u8, at: Epoch) -> Known {
        let sv = Sv::gps(number);
        if self.ground.do_not_use.contains(&sv) {
            return Known::nothing(DO_NOT_USE);
        }
        let Some(sent) = self.sent(sv, at) else { return Known::nothing(NOT_MONITORED) };
        if !sent.is_healthy() {
            return Known::nothing(DO_NOT_USE);
        }
        let later = |step_s: f64| self.difference(&sent, at.plus_s(step_s));
        let (Some((place_m, clock_m)), Some((moved_m, _)), Some((_, ticked_m))) =
            (later(0.0), later(ORBIT_STEP_S), later(CLOCK_STEP_S))
        else {
            return Known::nothing(NOT_MONITORED);
        };
        let velocity_mps = (moved_m - place_m) / ORBIT_STEP_S;
        let rate_mps = (ticked_m - clock_m) / CLOCK_STEP_S;
        let is_moving = place_m.amax() > LARGEST_STEADY_M || velocity_mps.amax() * LONG_S > 0.5 * STEP_M;
        let correction_m = to_step(clock_m);
        let second = at.seconds() + (-at.seconds()).rem_euclid(REFERENCE_S);
        let ahead_s = Epoch::new(second, 0.0).since(at);
        let (velocity_mps, sent_m) = match is_moving {
            true => (velocity_mps, place_m + velocity_mps * ahead_s),
            false => (Vector3::zeros(), place_m),
        };
        let limit_m = if is_moving { LARGEST_MOVING_M } else { LARGEST_STEADY_M };
        if sent_m.amax() > limit_m || velocity_mps.amax() > LARGEST_RATE_MPS || correction_m.abs() > LARGEST_FAST_M {
            return Known::nothing(DO_NOT_USE);
        }
        let rounded_m = sent_m.map(to_step);
        // Half a step of its rate over the time until the next one.
        let moved_m = if is_moving { LONG_S * libm::ldexp(1.0, -12) } else { 0.5 * STEP_M };
        let left_m = (rounded_m - sent_m).norm() + moved_m;
        let error_m = left_m + (correction_m - clock_m).abs() + rate_mps.abs() * FAST_S;
        let long_term = LongTerm {
            place: 0,
            iode: (sent.iode & 0xFF) as u8,
            place_m: rounded_m.into(),
            velocity_mps: velocity_mps.into(),
            af0_s: 0.0,
            af1_sps: 0.0,
            second_of_day: if is_moving { second.rem_euclid(86_400) as f64 } else { 0.0 },
        };
        let degradation = if rate_mps.abs() > QUICK_MPS { EXTRAPOLATED } else { 0 };
        Known { correction_m, udrei: udrei_of(error_m), degradation, long_term, is_moving }
    }

    fn bands(&self) -> &[(u8, Vec<u8>)] {
        &self.bands
    }

    fn factors(&self) -> Option<Factors> {
        self.ground.sends_factors.then_some(FACTORS)
    }

    fn vertical_m(&self, band: u8, point: u8, at: Epoch) -> Option<(f64, f64)> {
        let ionosphere = self.ground.ionosphere.as_ref()?;
        let (latitude_deg, longitude_deg) = points(band).get(usize::from(point).checked_sub(1)?).copied()?;
        let place = |height_m| Geodetic::from_degrees(f64::from(latitude_deg), f64::from(longitude_deg), height_m);
        let (user_m, satellite_m) = (place(0.0).to_ecef(), place(ABOVE_M).to_ecef());
        let sight = Sight {
            sv: Sv::gps(1),
            received: at,
            user: place(0.0),
            user_m,
            user_mps: Vector3::zeros(),
            satellite: State { position_m: satellite_m, velocity_mps: Vector3::zeros() },
            range_m: ABOVE_M,
            look: Look { azimuth_rad: 0.0, elevation_rad: std::f64::consts::FRAC_PI_2 },
            off_nadir_rad: 0.0,
        };
        let mut rays = vec![Ray { code_delay_s: 0.0, carrier_delay_s: 0.0, phase_cycles: 0.0, cn0_hz: 0.0 }];
        ionosphere.act(&sight, &L1_CA, &mut rays);
        let delay_m = rays.first().map(|ray| SPEED_OF_LIGHT_MPS * ray.code_delay_s)?;
        Some((delay_m, 0.5 * STEP_M + SHELL_SHARE * delay_m))
    }
}
