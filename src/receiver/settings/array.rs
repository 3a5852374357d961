//! Settings of the spatial filter in front of the correlators.
//!
//! The table `[array]` turns it on: the front ends are then elements of an array. Without it several front
//! ends are several bands.

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use crate::described::described;

/// Weights of the elements.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum SpatialFilter {
    /// The first element alone.
    None,
    /// Least power with the first element's weight at 1.
    #[default]
    PowerInversion,
    /// Least power with a gain of 1 in one direction.
    Mvdr,
}

described! {
/// Choices of the spatial filter.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct ArraySettings {
    /// Weights of the elements, whose samples become one stream before correlation. none: the first element
    /// alone. power_inversion: least power with the first weight at 1; it needs no positions and no
    /// direction. mvdr: least power with a gain of 1 towards `azimuth_deg` and `elevation_deg`, one beam for
    /// all satellites.
    pub filter: SpatialFilter,
    /// Time from whose samples the covariance of the elements is taken, and the weights for the same samples.
    pub block_ms: f64,
    /// Power that is added to the covariance's diagonal, over its smallest pivot, which is about the noise's.
    pub loading_db: f64,
    /// Positions of the elements in metres along the body's nose, right side and down, in the order of their
    /// samples. They must be as many as there are streams. With power_inversion they may be absent.
    pub lever_arms_m: Vec<[f64; 3]>,
    /// Azimuth of the beam of mvdr in the body's axes, from the nose to the right.
    pub azimuth_deg: f64,
    /// Elevation of the beam of mvdr over the plane of nose and right side.
    pub elevation_deg: f64,
    /// Time over which the carriers of the elements are compared, satellite by satellite; 0: not at all. They
    /// give the attitude, the phases of the elements' channels and a test of directions, and need the lever
    /// arms of three elements that are not in a line.
    pub attitude_ms: u32,
    /// Deviation of the elements' phases by what depends on the direction, as their patterns do, beside
    /// noise.
    pub phase_sigma_deg: f64,
}
}

/// Distance in metres of an element from the line through two others that makes a plane.
const OFF_LINE_M: f64 = 1e-3;

/// True if elements at these lever arms are not in a line.
pub fn span_a_plane(lever_arms_m: &[[f64; 3]]) -> bool {
    let Some(first) = lever_arms_m.first().copied().map(Vector3::from) else { return false };
    let arms_m: Vec<Vector3<f64>> = lever_arms_m.iter().map(|arm| Vector3::from(*arm) - first).collect();
    let Some(longest) = arms_m.iter().max_by(|a, b| a.norm().total_cmp(&b.norm())) else { return false };
    arms_m.iter().any(|arm| longest.cross(arm).norm() > OFF_LINE_M * longest.norm())
}

impl Default for ArraySettings {
    fn default() -> Self {
        Self {
            filter: SpatialFilter::PowerInversion,
            block_ms: 10.0,
            loading_db: -10.0,
            lever_arms_m: Vec::new(),
            azimuth_deg: 0.0,
            elevation_deg: 90.0,
            attitude_ms: 0,
            phase_sigma_deg: 2.0,
        }
    }
}

impl ArraySettings {
    /// Each number with the smallest and the largest value that it may have.
    pub fn ranges(&self) -> [(&'static str, f64, f64, f64); 6] {
        [
            ("array.block_ms", self.block_ms, 0.05, 50.0),
            ("array.loading_db", self.loading_db, -100.0, 60.0),
            ("array.azimuth_deg", self.azimuth_deg, -360.0, 360.0),
            ("array.elevation_deg", self.elevation_deg, -90.0, 90.0),
            ("array.attitude_ms", f64::from(self.attitude_ms), 0.0, 60_000.0),
            ("array.phase_sigma_deg", self.phase_sigma_deg, 0.0, 30.0),
        ]
    }

    /// Key, value and expectation of lever arms that are refused.
    ///
    /// # Errors
    /// A lever arm that is not finite or longer than a kilometre, or none where filter or attitude need them.
    pub fn validate(&self) -> Result<(), (&'static str, String, String)> {
        let key = "array.lever_arms_m";
        if self.filter == SpatialFilter::Mvdr && self.lever_arms_m.is_empty() {
            let expected = "the lever arm of each element, because filter = \"mvdr\" has a direction";
            return Err((key, "[]".to_owned(), expected.to_owned()));
        }
        if self.attitude_ms > 0 && !span_a_plane(&self.lever_arms_m) {
            let expected = "lever arms of three elements that are not in a line, because attitude_ms is given";
            return Err((key, format!("{:?}", self.lever_arms_m), expected.to_owned()));
        }
        match self.lever_arms_m.iter().flatten().find(|x| !(-1e3..=1e3).contains(*x)) {
            Some(value) => Err((key, value.to_string(), "-1000 to 1000".to_owned())),
            None => Ok(()),
        }
    }
}
