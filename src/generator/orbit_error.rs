//! Errors of the true orbit relative to the broadcast or precise one: ephemeris errors and manoeuvres.
//!
//! An offset in the satellite's own axes (radially outwards, along the track, across it), from the beginning
//! or grown over a time by a quintic whose speed and acceleration begin and end at zero, so that phases stay
//! smooth. The message does not know of it. Limits: velocity leaves out how the orbit's plane turns, 1e-9
//! rad/s of the offset.

use nalgebra::Vector3;

use gnss::broadcast::State;
use gnss::earth::EARTH_ROTATION_RADPS;
use gnss::satellite::Sv;
use gnss::time::Epoch;

/// Displacement of some satellites from their orbits.
#[derive(Clone, Debug, PartialEq)]
pub struct Displacement {
    /// The satellites concerned.
    pub satellites: Vec<Sv>,
    /// Radial displacement in metres, positive outwards.
    pub radial_m: f64,
    /// Displacement along the inertial motion, in metres.
    pub along_m: f64,
    /// Displacement along the angular momentum, in metres.
    pub cross_m: f64,
    /// Beginning and duration in seconds of the growth. If absent, the displacement exists from the start.
    pub growth: Option<(Epoch, f64)>,
}

/// Quintic of least jerk: a share that goes from 0 to 1 while `u` does, and its derivative with respect to
/// `u`.
pub fn minimum_jerk(u: f64) -> (f64, f64) {
    if u <= 0.0 {
        (0.0, 0.0)
    } else if u >= 1.0 {
        (1.0, 0.0)
    } else {
        (u * u * u * (10.0 + u * (6.0 * u - 15.0)), 30.0 * u * u * (1.0 - u) * (1.0 - u))
    }
}

impl Displacement {
    /// Returns the state at `at` (in the ECEF axes of that instant) with the displacement.
    pub fn apply(&self, state: State, at: Epoch) -> State {
        let (share, rate) = match self.growth {
            None => (1.0, 0.0),
            Some((from, growth_s)) => {
                let (share, slope) = minimum_jerk(at.since(from) / growth_s);
                (share, slope / growth_s)
            }
        };
        // Bits stay as they are before it begins.
        if share == 0.0 && rate == 0.0 {
            return state;
        }
        let earth_radps = Vector3::new(0.0, 0.0, EARTH_ROTATION_RADPS);
        let inertial_mps = state.velocity_mps + earth_radps.cross(&state.position_m);
        let radial = state.position_m.normalize();
        let momentum = state.position_m.cross(&inertial_mps);
        let cross = momentum.normalize();
        let offset_m = radial * self.radial_m + cross.cross(&radial) * self.along_m + cross * self.cross_m;
        let turning_radps = momentum / state.position_m.norm_squared() - earth_radps;
        State {
            position_m: state.position_m + offset_m * share,
            velocity_mps: state.velocity_mps + offset_m * rate + turning_radps.cross(&offset_m) * share,
        }
    }

    /// Describes the error for the plan.
    pub fn describe(&self) -> String {
        let names: Vec<String> = self.satellites.iter().map(Sv::to_string).collect();
        let growth =
            self.growth.map_or("from the beginning".to_owned(), |(from, s)| format!("grown in {s} s from {from}"));
        format!(
            "{} off the broadcast by {} m radially, {} m along, {} m across, {growth}",
            names.join(" "),
            self.radial_m,
            self.along_m,
            self.cross_m
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use gnss::rinex;

    #[test]
    fn an_offset_lies_along_its_axes_and_its_velocity_is_its_derivative() {
        let at = Epoch::parse("2010-07-01T08:06:00").unwrap();
        let sets = rinex::embedded().unwrap().ephemerides;
        let set = sets.iter().find(|set| set.sv == Sv::gps(13) && at.since(set.toe).abs() <= 3600.0).unwrap();
        let growth = Some((at.plus_s(-20.0), 60.0));
        for (radial_m, along_m, cross_m) in [(50.0, 0.0, 0.0), (0.0, 50.0, 0.0), (0.0, 0.0, 50.0)] {
            let departure = Displacement { satellites: vec![Sv::gps(13)], radial_m, along_m, cross_m, growth };
            let moved = |dt_s: f64| {
                let state = set.state(at.plus_s(dt_s)).unwrap();
                (departure.apply(state, at.plus_s(dt_s)), state)
            };
            let (with, without) = moved(0.0);
            let offset_m = with.position_m - without.position_m;
            // 20 s of 60: u = 1/3, 10/27 − 15/81 + 6/243 = 51/243.
            assert!((offset_m.norm() - 50.0 * 51.0 / 243.0).abs() < 1e-6);
            let outwards = offset_m.normalize().dot(&without.position_m.normalize());
            assert!((outwards - if radial_m > 0.0 { 1.0 } else { 0.0 }).abs() < 1e-6, "{outwards}");
            let along = without.velocity_mps + Vector3::new(0.0, 0.0, EARTH_ROTATION_RADPS).cross(&without.position_m);
            let forwards = offset_m.normalize().dot(&along.normalize());
            // The orbit's slope against the horizon is its eccentricity, 0.006, at most.
            assert!(forwards.abs() < 0.02 || along_m > 0.0 && forwards > 0.999, "{forwards}");
            let h = 1.0;
            let numeric = (moved(h).0.position_m - moved(-h).0.position_m) / (2.0 * h);
            let own = (numeric - with.velocity_mps).norm();
            let base = ((moved(h).1.position_m - moved(-h).1.position_m) / (2.0 * h) - without.velocity_mps).norm();
            // Third derivative of the quintic, 60 · 50 m / 60³ s³ at most, times h²/6; rounding 1e-8 m / h.
            assert!((own - base).abs() < 3e-3, "{own} {base}");
        }
        let later = Displacement {
            satellites: vec![Sv::gps(13)],
            radial_m: 9.0,
            along_m: 0.0,
            cross_m: 0.0,
            growth: Some((at, 5.0)),
        };
        let state = set.state(at).unwrap();
        assert_eq!(later.apply(state, at), state);
    }
}
