//! Position and clock against what velocity and drift say, between the fixes at both ends of an interval.
//!
//! A receiver that changes from the sky to a copy of it jumps by what the copy is late or claims (P.
//! Papadimitratos and A. Jovanovic, Protection and Fundamental Vulnerability of GNSS, IWSSC 2008). The
//! velocity summed over all fixes is taken off the change of the position, the drift off that of the clock.
//! The covariance is the sum of those of both fixes, of velocities (`VELOCITY_MPS`, times the dilution) and
//! of accelerations up to `ACCELERATION_MPS2` between fixes. Errors of both fixes that are alike cancel, as
//! those of smoothed ranges do, so the statistics lie below chi-square with three degrees of freedom and the
//! modulus of a normal value: the probability of a false alarm is at most the stated one. Limits: a position
//! that is dragged with its velocity passes.

use nalgebra::{Matrix3, Vector3};

use gnss::earth::{Geodetic, SPEED_OF_LIGHT_MPS};
use gnss::record::Fix;

/// Error of a velocity over that of its ranges' rates: half a hertz of Doppler.
const VELOCITY_MPS: f64 = 0.1;
/// Largest acceleration.
const ACCELERATION_MPS2: f64 = 10.0;

/// Statistics of an interval.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Jump {
    /// Position: chi-square with three degrees of freedom at most.
    pub position: f64,
    /// Clock: standard normal at most; `None` where the time scale is another.
    pub clock: Option<f64>,
}

/// Fixes since the last test.
#[derive(Debug)]
struct Way {
    first: Fix,
    last: Fix,
    seconds: f64,
    /// Sum of the velocities.
    moved_m: Vector3<f64>,
    /// Sum of the drifts.
    drifted_m: f64,
    /// Part of the motion that velocities may miss.
    missed_m: f64,
}

impl Way {
    fn new(fix: &Fix) -> Self {
        let (first, last) = (fix.clone(), fix.clone());
        Self { first, last, seconds: 0.0, moved_m: Vector3::zeros(), drifted_m: 0.0, missed_m: 0.0 }
    }
}

/// Watch over the fixes of a receiver.
#[derive(Debug, Default)]
pub struct Jumps {
    way: Option<Way>,
}

impl Jumps {
    /// Takes a fix `passed_s` after the one before, given the samples between them.
    pub fn take(&mut self, fix: &Fix, passed_s: impl Fn(u64) -> f64) {
        let Some(way) = &mut self.way else {
            self.way = Some(Way::new(fix));
            return;
        };
        let seconds = passed_s(fix.sample - way.last.sample);
        way.moved_m += 0.5 * seconds * (way.last.velocity_mps() + fix.velocity_mps());
        way.drifted_m += 0.5 * seconds * SPEED_OF_LIGHT_MPS * (way.last.clock_drift + fix.clock_drift);
        // Largest error of a trapezium: the acceleration turns in the middle.
        way.missed_m += 0.125 * ACCELERATION_MPS2 * seconds * seconds;
        way.seconds += seconds;
        way.last = fix.clone();
    }

    /// Forgets the fixes.
    pub fn interrupt(&mut self) {
        self.way = None;
    }

    /// Ends the interval at its latest fix, at which the next one begins.
    pub fn close(&mut self) -> Option<Jump> {
        let way = self.way.as_ref().filter(|way| way.seconds > 0.0)?;
        let Way { first, last, seconds, moved_m, drifted_m, missed_m } = way;
        let axes = Geodetic::from_ecef(&last.position_m()).ecef_to_enu();
        let off_m = axes * (last.position_m() - first.position_m() - moved_m);
        let axis_m = VELOCITY_MPS * seconds * first.pdop.max(last.pdop) + missed_m;
        let covariance = covariance(first) + covariance(last) + axis_m * axis_m * Matrix3::identity();
        let position = covariance.try_inverse().map(|weight| off_m.dot(&(weight * off_m)));
        let clock_m = SPEED_OF_LIGHT_MPS * (last.clock_bias_s - first.clock_bias_s) - drifted_m;
        let rate_m = VELOCITY_MPS * seconds * first.tdop.max(last.tdop);
        let variance_m2 = first.sigma_clock_m * first.sigma_clock_m + last.sigma_clock_m * last.sigma_clock_m;
        let clock = clock_m.abs() / (variance_m2 + rate_m * rate_m).sqrt();
        let alike = first.time_scale == last.time_scale;
        let next = Way::new(last);
        self.way = Some(next);
        position.map(|position| Jump { position, clock: alike.then_some(clock) })
    }
}

/// Covariance of a fix's east, north and up.
fn covariance(fix: &Fix) -> Matrix3<f64> {
    let sigmas = Vector3::new(fix.sigma_east_m, fix.sigma_north_m, fix.sigma_up_m);
    let (en, eu, nu) = (fix.correlation_en, fix.correlation_eu, fix.correlation_nu);
    let correlations = Matrix3::new(1.0, en, eu, en, 1.0, nu, eu, nu, 1.0);
    Matrix3::from_diagonal(&sigmas) * correlations * Matrix3::from_diagonal(&sigmas)
}

#[cfg(test)]
mod tests {
    use super::*;
    use gnss::record::IonosphereModel;

    /// A fix on the equator that moves to the east at 10 m/s, with a clock that gains 1e-7, off by so many
    /// metres.
    fn fix(tenth: u64, off_m: f64, clock_off_m: f64) -> Fix {
        let time_s = 0.1 * tenth as f64;
        Fix {
            sample: tenth,
            gps_s: 0,
            gps_fraction_s: 0.0,
            x_m: 6_378_137.0,
            y_m: 10.0 * time_s + off_m,
            z_m: 0.0,
            vx_mps: 0.0,
            vy_mps: 10.0,
            vz_mps: 0.0,
            clock_bias_s: 1e-7 * time_s + clock_off_m / SPEED_OF_LIGHT_MPS,
            clock_drift: 1e-7,
            sigma_east_m: 0.5,
            sigma_north_m: 0.5,
            sigma_up_m: 1.0,
            sigma_clock_m: 0.7,
            correlation_en: 0.1,
            correlation_eu: 0.0,
            correlation_nu: -0.2,
            gdop: 2.0,
            pdop: 1.5,
            hdop: 1.0,
            vdop: 1.1,
            tdop: 0.8,
            condition: 5.0,
            satellites: 8,
            chi_square: 3.0,
            excluded: String::new(),
            ionosphere: IonosphereModel::None,
            ranges: Some(8),
            clocks: Some(1),
            time_scale: "GPST".to_owned(),
        }
    }

    fn run(of: impl Fn(u64) -> (f64, f64)) -> Vec<Jump> {
        let mut jumps = Jumps::default();
        let mut found = Vec::new();
        for tenth in 0..50 {
            let (off_m, clock_off_m) = of(tenth);
            jumps.take(&fix(tenth, off_m, clock_off_m), |samples| 0.1 * samples as f64);
            if tenth % 10 == 0 {
                found.extend(jumps.close());
            }
        }
        found
    }

    #[test]
    fn a_steady_motion_is_no_jump_and_a_step_is_one_in_its_interval_alone() {
        let steady = run(|_| (0.0, 0.0));
        assert!(steady.len() == 4 && steady.iter().all(|jump| jump.position < 1e-9 && jump.clock < Some(1e-6)));
        let found = run(|tenth| if tenth > 24 { (30.0, 60.0) } else { (0.0, 0.0) });
        let alarms: Vec<bool> = found.iter().map(|jump| jump.position > 16.27 && jump.clock > Some(3.29)).collect();
        assert_eq!(alarms, [false, false, true, false]);
    }
}
