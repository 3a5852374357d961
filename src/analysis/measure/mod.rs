//! Measuring: the receiver's results against the truth, as numbers without a verdict.
//!
//! [`errors`] joins estimates with the truth on (sample number, satellite, signal); everything else works on
//! these errors. [`slips`] finds breaks of the carrier and their causes, [`elevation`] sorts errors by
//! satellite and elevation, [`jitter`] compares each loop with its theory, [`consistency`] the fixes with
//! their own covariance, [`clock`] the receiver's clock with the deviations of [`allan`]. [`psd`] estimates
//! the spectrum of the samples, [`peaks`] their correlation with the codes, [`lines`] compares the continuous
//! waves that the receiver reported with those that there were, [`spoofing`] measures how far a spoofer moved
//! the fixes, [`osnma`] which tags it took for authentic, [`ionosphere`] what two bands showed of it.
//! [`protection`] compares errors with the protection levels that the receiver states, [`detection`] the
//! alarms of its detectors with the jammers and spoofers that there were, and [`labelled`] says the truth
//! beside the correlations. [`independent`] says how many independent values a correlated series is worth.

pub mod allan;
pub mod attitude;
pub mod clock;
pub mod consistency;
pub mod detection;
pub mod elevation;
pub mod errors;
pub mod independent;
pub mod inertial;
pub mod ionosphere;
pub mod jitter;
pub mod labelled;
pub mod lines;
pub mod osnma;
pub mod peaks;
pub mod protection;
pub mod psd;
pub mod slips;
pub mod spectrum;
pub mod spoofing;
