//! What a sound receiver must reach: errors of fixes and the sigmas that it should state.
//!
//! [`air`] has what a receiver takes the ionosphere for, [`ranges`] bias and noise of every range, [`links`]
//! the loops of every satellite, and [`solution`] what weighted least squares makes of the ranges at each
//! fix, [`dispersion`] what two bands show of the ionosphere, and [`heard`] from when
//! on messages are known. All follow from truth and settings. Nothing
//! that the receiver states of its own quality enters; of its results, only which observations there are.

pub mod air;
pub mod dispersion;
pub mod heard;
pub mod links;
pub mod ranges;
mod settled;
pub mod solution;
