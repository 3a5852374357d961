//! Expected accuracy of a sound receiver: errors of fixes and the sigmas that it should state.
//!
//! [`air`] has the receiver's model of the ionosphere, and [`ranges`] has bias and noise of every range.
//! [`links`] has the loops of every satellite. [`solution`] applies weighted least squares to the ranges at
//! each fix, and `rates` to their rates; `unshared` is what the oscillator leaves there. [`dispersion`] has
//! the ionosphere measured with two bands, and [`heard`] the times from which messages are known. All follow
//! from truth and settings. The receiver's statements about its own quality do not enter. Of its results,
//! only the list of observations enters.

pub mod air;
pub mod dispersion;
pub mod heard;
pub mod links;
pub mod ranges;
mod rates;
mod settled;
pub mod solution;
mod unshared;
