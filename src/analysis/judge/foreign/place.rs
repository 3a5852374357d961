//! Errors of a foreign receiver's positions.
//!
//! Positions are compared with the antenna's at the time on their label. A late label shows as an error along
//! the motion, −δ·v, so that only a moving scene shows it. The sigma of a bias counts errors that remember
//! each other once ([`crate::measure::independent`]).

use nalgebra::Vector3;
use serde::Serialize;

use super::fit::Estimate;
use crate::expect::timeline::Timeline;
use crate::measure::independent::Correlated;
use crate::read::nmea::PlaceFix;
use crate::statistics::{mean, percentile, rms};
use gnss::earth::Geodetic;

/// One fix against the truth: a row of `foreign_fixes.csv`.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct FixError {
    /// The receiver's label, in seconds after the truth began.
    pub label_s: f64,
    /// Satellites that the receiver used.
    pub satellites: u32,
    /// Error to the east, metres.
    pub east_m: f64,
    /// Error to the north, metres.
    pub north_m: f64,
    /// Error upward, metres.
    pub up_m: f64,
    /// Error of the velocity over ground, eastward, m/s.
    pub velocity_east_mps: Option<f64>,
    /// Error of the velocity to the north, m/s.
    pub velocity_north_mps: Option<f64>,
    /// True velocity east, north and up, m/s.
    #[serde(skip)]
    pub true_velocity_enu_mps: Vector3<f64>,
}

impl FixError {
    /// Length of the error in space.
    pub fn length_m(&self) -> f64 {
        Vector3::new(self.east_m, self.north_m, self.up_m).norm()
    }
}

/// Statistics of the positions.
#[derive(Clone, Debug, Default)]
pub struct Places {
    /// Fixes of the file.
    pub fixes: usize,
    /// Every fix that the truth has.
    pub rows: Vec<FixError>,
    /// Mean error east, north, up.
    pub bias_enu_m: Option<[Estimate; 3]>,
    /// Root mean square of the horizontal error, metres.
    pub horizontal_rms_m: Option<f64>,
    /// Horizontal error that 95 % of the fixes stay below, metres.
    pub horizontal_p95_m: Option<f64>,
    /// Root mean square of the vertical error, metres.
    pub up_rms_m: Option<f64>,
    /// Error in space that 95 % of the fixes stay below, metres.
    pub error_3d_p95_m: Option<f64>,
    /// Root mean square of the error of the ground speed, m/s.
    pub ground_speed_rms_mps: Option<f64>,
    /// Delay of the time labels along the motion, seconds.
    pub time_tag_s: Option<Estimate>,
    /// Delay of the time labels in seconds, without the common part of all errors. It needs a motion that
    /// turns or changes its speed.
    pub changing_s: Option<Estimate>,
    /// Fixes with the position of the one before, to the last digit.
    pub repeated: usize,
    /// Fixes less than a row of the truth before its beginning or after its end.
    pub at_edge: usize,
    /// Smallest step of a latitude as written, metres.
    pub resolution_m: f64,
}

/// Truth slower than this does not show a late label.
const SLOWEST_MPS: f64 = 1.0;

/// Joins and measures; `shift_s` is taken from every label first.
pub fn measure(fixes: &[PlaceFix], timeline: &Timeline, shift_s: i64) -> Places {
    let (mut rows, mut at_edge) = (Vec::new(), 0);
    for fix in fixes {
        let label_s = fix.label.since(timeline.origin) - shift_s as f64;
        let Some(place) = timeline.place(label_s) else {
            at_edge += usize::from(timeline.is_at_edge(label_s));
            continue;
        };
        let to_enu = Geodetic::from_ecef(&place.position_m).ecef_to_enu();
        let error_m = to_enu * (fix.position_m - place.position_m);
        let true_enu_mps = to_enu * place.velocity_mps;
        let ground = fix.ground_mps_rad.map(|(speed_mps, course_rad)| {
            let (sin, cos) = libm::sincos(course_rad);
            (speed_mps * sin - true_enu_mps.x, speed_mps * cos - true_enu_mps.y)
        });
        rows.push(FixError {
            label_s,
            satellites: fix.satellites,
            east_m: error_m.x,
            north_m: error_m.y,
            up_m: error_m.z,
            velocity_east_mps: ground.map(|v| v.0),
            velocity_north_mps: ground.map(|v| v.1),
            true_velocity_enu_mps: true_enu_mps,
        });
    }
    let of = |of: &dyn Fn(&FixError) -> f64| rows.iter().map(of).collect::<Vec<f64>>();
    let horizontal = of(&|row| libm::hypot(row.east_m, row.north_m));
    let axes = [of(&|row| row.east_m), of(&|row| row.north_m), of(&|row| row.up_m)];
    let ground: Vec<f64> =
        rows.iter().filter_map(|row| Some(libm::hypot(row.velocity_east_mps?, row.velocity_north_mps?))).collect();
    let [east, north, up] = axes.each_ref().map(|axis| bias(axis));
    Places {
        fixes: fixes.len(),
        bias_enu_m: east.zip(north).zip(up).map(|((east, north), up)| [east, north, up]),
        horizontal_rms_m: rms(&horizontal),
        horizontal_p95_m: percentile(&horizontal, 0.95),
        up_rms_m: rms(&axes[2]),
        error_3d_p95_m: percentile(&of(&FixError::length_m), 0.95),
        ground_speed_rms_mps: rms(&ground),
        time_tag_s: time_tag(&rows, false),
        changing_s: time_tag(&rows, true),
        repeated: fixes.windows(2).filter(|two| two[0].position_m == two[1].position_m).count(),
        at_edge,
        resolution_m: 0.0,
        rows,
    }
}

/// Mean of one axis and its sigma.
fn bias(errors: &[f64]) -> Option<Estimate> {
    let value = mean(errors)?;
    let found = Correlated::about_means(&[errors.to_vec()])?;
    Some(Estimate { value, sigma: (found.variance() / found.independent_of_mean()).sqrt() })
}

/// Delay of the labels: minus the slope of the error over the velocity, axis by axis in one fit, both about
/// their means where `about_means` says so.
fn time_tag(rows: &[FixError], about_means: bool) -> Option<Estimate> {
    let count = rows.len() as f64;
    let error = |row: &FixError| Vector3::new(row.east_m, row.north_m, row.up_m);
    let middle = |of: &dyn Fn(&FixError) -> Vector3<f64>| match about_means {
        true => rows.iter().map(of).sum::<Vector3<f64>>() / count.max(1.0),
        false => Vector3::zeros(),
    };
    let (error_m, velocity_mps) = (middle(&error), middle(&|row| row.true_velocity_enu_mps));
    let points: Vec<(Vector3<f64>, Vector3<f64>)> =
        rows.iter().map(|row| (error(row) - error_m, row.true_velocity_enu_mps - velocity_mps)).collect();
    let squares: f64 = points.iter().map(|(_, velocity)| velocity.norm_squared()).sum();
    if squares <= SLOWEST_MPS * SLOWEST_MPS * count {
        return None;
    }
    let value = -points.iter().map(|(error, velocity)| error.dot(velocity)).sum::<f64>() / squares;
    let rest: Vec<f64> = points.iter().map(|(error, velocity)| (error + value * velocity).dot(velocity)).collect();
    let found = Correlated::about_zero(&[rest])?;
    let sigma = found.variance().sqrt() * count / found.independent_of_mean().sqrt() / squares;
    Some(Estimate { value, sigma })
}
