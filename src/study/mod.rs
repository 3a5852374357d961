//! Studies: the receiver's loops on modelled correlations, thousands of times faster than on samples.
//!
//! [`correlator`] drives the loops of a receiver's channel with early, prompt and late correlations drawn
//! from their statistics; [`motion`] is the truth that it follows, [`correlation`] the shape of the peak.
//! [`expect`] says what theory predicts for the same loops, [`proof`] compares both over a grid, [`limits`]
//! compares them with rules of thumb and [`report`] writes both down; [`demand`] asks whether a loop follows
//! a motion. [`search`] draws what an acquisition would find, [`detection`] counts what the receiver's does
//! find in samples. [`sweep`] runs studies that a file describes, on either. This is the only module that
//! sees receiver, generator and judge at once; none of them sees it.

#![warn(missing_docs)]

pub mod correlation;
pub mod correlator;
pub mod demand;
pub mod detection;
pub mod expect;
pub mod limits;
pub mod measure;
pub mod motion;
mod normal;
pub mod proof;
pub mod report;
pub mod search;
pub mod sweep;
#[cfg(test)]
mod tests;
mod watch;
