//! Studies: the receiver's loops on modelled correlations, thousands of times faster than on samples.
//!
//! [`correlator`] drives the loops of a receiver's channel with early, prompt and late correlations drawn
//! from their statistics; [`motion`] is the truth that it follows, [`correlation`] the shape of the peak.
//! [`expect`] says what theory predicts for the same loops, [`proof`] compares both over a grid, [`limits`]
//! compares them with rules of thumb and [`report`] writes both down; [`demand`] asks whether a loop follows
//! a motion. [`search`] draws what an acquisition would find, [`detection`] counts what the receiver's does
//! find in samples. [`sweep`] runs studies that a file describes, on either. This is the only module that
//! sees receiver, generator and judge at once; none of them sees it.
//!
//! ```
//! use study::sweep::spec::Study;
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let text = r#"
//!     name = "jitter"
//!     level = "correlator"
//!     repetitions = 8
//!     keep = ["phase_sigma_deg"]
//!
//!     [[axis]]
//!     key = "receiver.tracking.pll_bandwidth_hz"
//!     values = [5, 10, 18]
//! "#;
//! let study = Study::parse(text, "jitter.toml")?;
//! assert_eq!(study.axes.len(), 1);
//! assert!(Study::parse(&text.replace("repetitions", "repetition"), "jitter.toml").is_err());
//! # Ok(())
//! # }
//! ```
//!
//! Internal crate: programs use the facade `gnss_twin`. What it does not hand on may change with any version.

pub mod correlation;
pub mod correlator;
pub mod demand;
pub mod detection;
pub mod expect;
pub mod leaving;
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
