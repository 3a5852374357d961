//! Errors for elements that do not describe an orbit.

use thiserror::Error;

use crate::satellite::Sv;

/// Reason for which elements give no satellite state.
#[derive(Clone, Copy, Debug, Error, PartialEq)]
pub enum OrbitError {
    /// An element that no orbit has.
    #[error("{sv}: {element} = {value} is not that of an orbit: expected {expected}")]
    Element {
        /// The satellite.
        sv: Sv,
        /// Name of the element.
        element: &'static str,
        /// Value of the element, in its SI unit.
        value: f64,
        /// Values that describe an orbit.
        expected: &'static str,
    },
    /// A state vector integrated further than it means anything.
    #[error("{sv}: {since_s} s from the state vector's reference time: expected at most 86400 s")]
    Far {
        /// The satellite.
        sv: Sv,
        /// Seconds from the reference time.
        since_s: f64,
    },
    /// Kepler's equation without a solution.
    #[error("{sv}: Kepler's equation did not converge for eccentricity {eccentricity}")]
    Kepler {
        /// The satellite.
        sv: Sv,
        /// Eccentricity of the orbit.
        eccentricity: f64,
    },
    /// A satellite at the antenna.
    #[error("{sv}: the antenna is {range_m:.3} m away from the satellite: expected at least 1 m")]
    Near {
        /// The satellite.
        sv: Sv,
        /// Distance of satellite and user, in metres.
        range_m: f64,
    },
}
