//! Velocities and accuracies that a receiver reports, against the truth.
//!
//! A reported accuracy is held against the share of errors within it. Receivers do not say at which
//! confidence theirs are, so that shares are told and not judged. For normal errors one sigma of a single
//! axis has 68 %, of a horizontal error 39 % of its axes' common sigma and 63 % of their root sum of squares.

use std::fmt;
use std::path::Path;

use serde::Serialize;

use crate::error::JudgeError;
use crate::expect::timeline::Timeline;
use crate::show::write::write_rows;
use crate::statistics::{median, rms};
use gnss::earth::Geodetic;
use logs::observed::{ClockReading, Fix};
use nalgebra::Vector3;

/// One fix: a row of `foreign_reported.csv`.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Row {
    /// The receiver's label, in seconds after the truth began.
    pub label_s: f64,
    /// Kind of the solution.
    pub solution: &'static str,
    /// Horizontal error, metres.
    pub horizontal_m: f64,
    /// Reported accuracy of the horizontal position, metres.
    pub horizontal_sigma_m: Option<f64>,
    /// Error upward, metres.
    pub up_m: f64,
    /// Reported accuracy of the height, metres.
    pub vertical_sigma_m: Option<f64>,
    /// Error of the velocity to the east, m/s.
    pub velocity_east_mps: Option<f64>,
    /// Error of the velocity to the north, m/s.
    pub velocity_north_mps: Option<f64>,
    /// Error of the velocity upward, m/s.
    pub velocity_up_mps: Option<f64>,
    /// Reported accuracy of the speed, m/s.
    pub speed_sigma_mps: Option<f64>,
    /// Reported accuracy of the time, seconds.
    pub time_sigma_s: Option<f64>,
    /// Reported clock bias with the sign of its protocol, seconds.
    pub clock_bias_s: Option<f64>,
    /// Reported rate of that bias, seconds a second.
    pub clock_drift: Option<f64>,
    /// Rate of the sampler's clock in the truth, seconds a second.
    pub true_clock_drift: f64,
}

/// Share of errors within their reported accuracy.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Within {
    /// Errors with a reported accuracy.
    pub count: usize,
    /// Errors within it.
    pub within: usize,
    /// Median of the reported accuracies.
    pub median_sigma: Option<f64>,
}

/// Everything that a log reports beside positions.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Reported {
    /// Every fix that the truth has.
    #[serde(skip)]
    pub rows: Vec<Row>,
    /// Root mean square of the error of the velocity in space, m/s.
    pub velocity_rms_mps: Option<f64>,
    /// Root mean square of the error of the vertical velocity, m/s.
    pub velocity_up_rms_mps: Option<f64>,
    /// Horizontal errors against their accuracy in metres.
    pub horizontal: Within,
    /// Vertical errors against their accuracy in metres.
    pub vertical: Within,
    /// Errors of the velocity in space against their accuracy in m/s.
    pub speed: Within,
    /// Median of the reported rate of the clock, seconds a second.
    pub clock_drift: Option<f64>,
}

/// Clock offsets and further digits belong to the fix of the same time, to the millisecond of their label.
pub(super) const SAME_S: f64 = 1.5e-3;

impl Reported {
    /// Joins fixes with the truth; `shift_s` is taken from every label first.
    pub fn new(fixes: &[Fix], clocks: &[ClockReading], timeline: &Timeline, shift_s: i64) -> Self {
        let mut clocks = clocks.iter().peekable();
        let mut rows = Vec::new();
        for fix in fixes {
            while clocks.next_if(|clock| clock.label.since(fix.label) < -SAME_S).is_some() {}
            let clock = clocks.peek().filter(|clock| clock.label.since(fix.label) < SAME_S);
            let label_s = fix.label.since(timeline.origin) - shift_s as f64;
            let Some(place) = timeline.place(label_s) else { continue };
            let to_enu = Geodetic::from_ecef(&place.position_m).ecef_to_enu();
            let error_m = to_enu * (fix.position_m - place.position_m);
            let velocity = fix.velocity_enu_mps.map(|own| Vector3::from(own) - to_enu * place.velocity_mps);
            rows.push(Row {
                label_s,
                solution: fix.solution.name(),
                horizontal_m: libm::hypot(error_m.x, error_m.y),
                horizontal_sigma_m: fix.horizontal_sigma_m,
                up_m: error_m.z,
                vertical_sigma_m: fix.vertical_sigma_m,
                velocity_east_mps: velocity.map(|error| error.x),
                velocity_north_mps: velocity.map(|error| error.y),
                velocity_up_mps: velocity.map(|error| error.z),
                speed_sigma_mps: fix.speed_sigma_mps,
                time_sigma_s: fix.time_sigma_s,
                clock_bias_s: clock.map(|clock| clock.bias_s),
                clock_drift: clock.map(|clock| clock.drift),
                true_clock_drift: place.clock_drift,
            });
        }
        let length = |row: &Row| {
            Some(Vector3::new(row.velocity_east_mps?, row.velocity_north_mps?, row.velocity_up_mps?).norm())
        };
        let lengths: Vec<f64> = rows.iter().filter_map(length).collect();
        let ups: Vec<f64> = rows.iter().filter_map(|row| row.velocity_up_mps).collect();
        let drifts: Vec<f64> = rows.iter().filter_map(|row| row.clock_drift).collect();
        Self {
            velocity_rms_mps: rms(&lengths),
            velocity_up_rms_mps: rms(&ups),
            horizontal: within(rows.iter().map(|row| (Some(row.horizontal_m), row.horizontal_sigma_m))),
            vertical: within(rows.iter().map(|row| (Some(row.up_m.abs()), row.vertical_sigma_m))),
            speed: within(rows.iter().map(|row| (length(row), row.speed_sigma_mps))),
            clock_drift: median(&drifts),
            rows,
        }
    }

    /// Writes `foreign_reported.csv` into an existing directory.
    ///
    /// # Errors
    /// The file that cannot be written.
    pub fn write(&self, out: &Path) -> Result<(), JudgeError> {
        write_rows(&out.join("foreign_reported.csv"), "", self.rows.iter())
    }
}

fn within(pairs: impl Iterator<Item = (Option<f64>, Option<f64>)>) -> Within {
    let pairs: Vec<(f64, f64)> = pairs.filter_map(|(error, sigma)| error.zip(sigma)).collect();
    let sigmas: Vec<f64> = pairs.iter().map(|(_, sigma)| *sigma).collect();
    Within {
        count: pairs.len(),
        within: pairs.iter().filter(|(error, sigma)| error <= sigma).count(),
        median_sigma: median(&sigmas),
    }
}

impl fmt::Display for Reported {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (name, value) in
            [("velocity rms (m/s)", self.velocity_rms_mps), ("up velocity rms (m/s)", self.velocity_up_rms_mps)]
        {
            if let Some(value) = value {
                writeln!(f, "{name:<26}{value:>12.4}")?;
            }
        }
        for (name, own, unit) in
            [("horizontal", self.horizontal, "m"), ("vertical", self.vertical, "m"), ("velocity", self.speed, "m/s")]
        {
            if let Some(sigma) = own.median_sigma {
                let share = 100.0 * own.within as f64 / own.count.max(1) as f64;
                let accuracy = format!("median accuracy {sigma:.3} {unit}");
                writeln!(
                    f,
                    "- {name} errors within the reported accuracy: {share:.0} % of {} ({accuracy})",
                    own.count
                )?;
            }
        }
        Ok(())
    }
}
