//! The ionosphere before its parameters are decoded, and the error of a model that is not exact.
//!
//! Page 18 of subframe 4 comes once in 12.5 minutes (IS-GPS-200N, 20.3.3.5.1.2). Until then delays are those
//! of a nominal ionosphere, half way between the quiet and the active Sun, and their error is common to all
//! satellites: three numbers of zero mean and unit variance scale a stated deviation along every line of
//! sight, one for the whole sky and one each for what it gains northwards and eastwards. The solution
//! estimates them with the position, so that its covariance contains what the ionosphere may do to height,
//! clock and plan. Limits: what is left after these three counts as independent noise; nothing is known of
//! storms and of the night at solar maximum.

use std::f64::consts::PI;

use nalgebra::Vector3;

use super::least_squares::{IONOSPHERE_TOP_M, Range};
use gnss::bdgim::Bdgim;
use gnss::earth::{Geodetic, Look, SPEED_OF_LIGHT_MPS};
use gnss::klobuchar::Klobuchar;
use gnss::nequick;
use gnss::satellite::Sv;
use gnss::time::Epoch;

/// Error of the nominal ionosphere.
///
/// Over all latitudes to 75°, longitudes and hours, the difference to the seven days' broadcast models has an
/// rms of 0.39, 0.63, 0.60, 0.50, 0.45, 1.35 and 0.92 of this deviation (all together 0.75, above twice the
/// deviation in 3 %), and to the IGS map of 2010-12-04 of 0.63.
pub const NOMINAL_ERROR: DelayError = DelayError { share: 0.6, least_m: 0.5 };

/// The error that those three do not describe, as a share of the common one: the days' odd coefficients
/// change the ratio to the nominal model by 10 to 20 % within the sky of one position.
const INDEPENDENT_SHARE: f64 = 0.25;
/// Angles at the Earth's centre, northwards and eastwards, over which the error changes by its own deviation:
/// the crests of the equatorial anomaly are 10° wide, and an hour of local time is 15°.
const GRADIENT_RAD: [f64; 2] = [10.0 / 180.0 * PI, 20.0 / 180.0 * PI];

/// The delays that a model foresees.
#[derive(Clone, Debug, PartialEq)]
pub enum Delays {
    /// Klobuchar's formula, which gives the delay at any position on a carrier of this frequency.
    Klobuchar(Klobuchar, f64),
    /// Klobuchar's formula in BeiDou's form.
    Beidou(Klobuchar),
    /// Model of BeiDou's third generation.
    Bdgim(Bdgim),
    /// Electron content on the path to each satellite in TECU, computed for a position near the receiver.
    Electrons(Vec<(Sv, f64)>),
}

impl Delays {
    /// Delay of a range that is received at a position from a direction, in seconds.
    pub fn delay_s(&self, range: &Range, user: Geodetic, look: Look, received: Epoch) -> f64 {
        match self {
            Self::Klobuchar(..) | Self::Beidou(_) | Self::Bdgim(_) if user.height_m > IONOSPHERE_TOP_M => 0.0,
            Self::Beidou(model) => model.beidou_delay_s(user, look, received, range.carrier_hz),
            Self::Bdgim(model) => model.delay_s(user, look, received, range.carrier_hz),
            Self::Klobuchar(model, defined_hz) => {
                model.delay_from_s(*defined_hz, user, look, received, range.carrier_hz)
            }
            Self::Electrons(contents) => {
                let own = contents.iter().find(|(sv, _)| *sv == range.sv);
                own.map_or(0.0, |(_, tecu)| nequick::delay_s(*tecu, range.carrier_hz))
            }
        }
    }
}

/// Standard deviation of a modelled vertical delay.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DelayError {
    /// Standard deviation of the delay's error as a share of the delay.
    pub share: f64,
    /// Constant part of the deviation, in metres.
    pub least_m: f64,
}

impl DelayError {
    /// Deviations along the line of sight `look` whose modelled delay is `delay_s` and whose slant factor is
    /// `obliquity`: of the three errors common to all satellites, and of the satellite's own.
    pub fn slant_m(self, delay_s: f64, obliquity: f64, look: Look) -> (Vector3<f64>, f64) {
        let level_m = libm::hypot(self.share * SPEED_OF_LIGHT_MPS * delay_s, self.least_m * obliquity);
        // From the receiver to the ionospheric point (IS-GPS-200N, 20.3.3.5.2.5), in semicircles.
        let apart_rad = (0.0137 / (look.elevation_rad.max(0.0) / PI + 0.11) - 0.022) * PI;
        let (sine, cosine) = libm::sincos(look.azimuth_rad);
        let [north_rad, east_rad] = GRADIENT_RAD;
        let gain = Vector3::new(1.0, apart_rad * cosine / north_rad, apart_rad * sine / east_rad);
        (level_m * gain, INDEPENDENT_SHARE * level_m)
    }
}
