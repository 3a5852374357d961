//! Ionospheric model of a receiver in a fix, and the weight that the receiver gives it.
//!
//! A fix says which model corrected it. Decoded parameters are taken as exact, or with the share of error
//! that the settings state. Before they are decoded, delays are those of a nominal ionosphere with a stated
//! deviation. Such a deviation is common to all satellites: a level, and its gradients northwards and
//! eastwards. A fix estimates them with its position. Limits: a grid's delays are not computed here. Fixes
//! that use a grid may therefore have the whole ionosphere as their error.

use std::f64::consts::PI;

use nalgebra::Vector3;

use gnss::earth::{Geodetic, Look, SPEED_OF_LIGHT_MPS};
use gnss::ionosphere::Coefficients;
use gnss::klobuchar::NOMINAL;
use gnss::record::{IonosphereModel, SkyRow};
use gnss::time::Epoch;

/// The ionosphere ends here for models that give the whole of it.
const TOP_M: f64 = 1e6;
/// Standard deviation of the nominal ionosphere at the zenith, as a share of its delay. Against the models of
/// seven days from 2005 to 2024 its error has an rms of 0.75 of this deviation.
const NOMINAL_SHARE: f64 = 0.6;
/// Constant part of that deviation, metres.
const NOMINAL_LEAST_M: f64 = 0.5;
/// Part of a deviation that is a satellite's own.
const OWN_SHARE: f64 = 0.25;
/// Angles at the Earth's centre over which the error changes by its deviation, northwards and eastwards.
const GRADIENT_DEG: [f64; 2] = [10.0, 20.0];
/// A zenith's ionosphere where nothing is known of it, one sigma: the order of a day's mean at solar maximum.
const UNKNOWN_M: f64 = 5.0;
/// A thin shell's slant is at most 3.2.
const SHELL: f64 = 0.948;

/// One line of sight.
#[derive(Clone, Copy, Debug)]
pub struct Sight<'a> {
    /// The true position.
    pub user: Geodetic,
    /// Direction to the satellite.
    pub look: Look,
    /// Earth-fixed position of the satellite, in metres.
    pub satellite_m: &'a Vector3<f64>,
    /// Time of the signal's arrival, GPS time.
    pub at: Epoch,
    /// Frequency of the carrier, in hertz.
    pub carrier_hz: f64,
    /// The scene's own delays.
    pub sky: &'a SkyRow,
}

/// A range's ionosphere as the receiver has it.
#[derive(Clone, Copy, Debug, Default)]
pub struct Air {
    /// Delay that it takes off, metres.
    pub delay_m: f64,
    /// Deviations common to all satellites, metres: level, gain northwards, gain eastwards.
    pub common_m: Vector3<f64>,
    /// Variance of the satellite's own, m².
    pub own_m2: f64,
}

impl Air {
    /// Ionosphere that the model of a fix corrects. It has the coefficients that were sent of the model in
    /// the settings, and `share`, the relative error that the settings state.
    pub fn of(model: IonosphereModel, sent: Option<&Coefficients>, share: f64, sight: &Sight<'_>) -> Self {
        let Sight { user, look, at, carrier_hz, .. } = *sight;
        if user.height_m > TOP_M && (share > 0.0 || model == IonosphereModel::Nominal) {
            return Self::default();
        }
        if model == IonosphereModel::Nominal {
            let obliquity = NOMINAL.bulge(user, look, at).obliquity;
            let delay_m = SPEED_OF_LIGHT_MPS * NOMINAL.delay_s(user, look, at, carrier_hz);
            let level_m = libm::hypot(NOMINAL_SHARE * delay_m, NOMINAL_LEAST_M * obliquity);
            return Self { delay_m, ..Self::uncertain(level_m, look) };
        }
        // A correction of what the scene does not have is an error, not an expectation.
        let sent = sent.filter(|_| sight.sky.ionosphere_m != 0.0);
        let inside = |own: &&Coefficients| matches!(own, Coefficients::NequickG(_)) || user.height_m <= TOP_M;
        let delay_s = |own: &Coefficients| own.delay_s((user, look), sight.satellite_m, at, carrier_hz);
        let delay_m = SPEED_OF_LIGHT_MPS * sent.filter(inside).map_or(0.0, delay_s);
        let trust = match model {
            IonosphereModel::Grid => {
                let cosine = SHELL * libm::cos(look.elevation_rad);
                Self { own_m2: UNKNOWN_M * UNKNOWN_M / (1.0 - cosine * cosine), ..Self::default() }
            }
            IonosphereModel::Combined => Self::default(),
            _ if share > 0.0 => Self::uncertain(share * delay_m, look),
            _ => Self::default(),
        };
        Self { delay_m, ..trust }
    }

    /// Deviations of a model whose level is as given.
    fn uncertain(level_m: f64, look: Look) -> Self {
        // From the receiver to the ionospheric point (IS-GPS-200N, 20.3.3.5.2.5).
        let apart_deg = (0.0137 / (look.elevation_rad.max(0.0) / PI + 0.11) - 0.022) * 180.0;
        let (east, north) = libm::sincos(look.azimuth_rad);
        let [north_deg, east_deg] = GRADIENT_DEG;
        let gain = Vector3::new(1.0, apart_deg * north / north_deg, apart_deg * east / east_deg);
        let own_m = OWN_SHARE * level_m;
        Self { common_m: level_m * gain, own_m2: own_m * own_m, ..Self::default() }
    }
}
