//! Facts of an array, by which the judge expects what a spatial filter leaves.

use serde::{Deserialize, Serialize};

/// Array of a scene as it is at the start.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ArrayFacts {
    /// Positions of the elements along the body's nose, right side and down, in metres.
    pub lever_arms_m: Vec<[f64; 3]>,
    /// Unit vectors along nose, right side and down, each in east, north and up.
    pub axes: [[f64; 3]; 3],
    /// True if the body neither moves nor turns.
    pub is_still: bool,
    /// Matrix from the waves at the elements to what their channels give, row by row, real and imaginary
    /// parts: coupling, then gain and phase of each channel at the carrier.
    pub mixing: Vec<[f64; 2]>,
    /// Gain of each channel, which its noise has too, as a factor on amplitudes.
    pub gains: Vec<f64>,
    /// Unit vectors towards the sources of interference, in east, north and up, in the order of their
    /// numbers.
    pub towards: Vec<[f64; 3]>,
}
