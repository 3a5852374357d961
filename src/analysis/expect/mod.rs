//! What a sound receiver must reach: errors of fixes and the sigmas that it should state, from truth and
//! settings alone.
//!
//! [`message`] is what was sent, [`smoothing`] what a carrier makes of the code, `multipath` what rays leave
//! in it, [`ranges`] bias and noise of every range, [`links`] the loops of every satellite, [`solution`] what
//! weighted least squares makes of them at each fix, [`quantile`] how far random errors may go. Nothing that
//! the receiver says of its own quality enters; of its results, only which observations there are.

pub mod links;
pub mod message;
mod multipath;
pub mod quantile;
pub mod ranges;
pub mod smoothing;
pub mod solution;
