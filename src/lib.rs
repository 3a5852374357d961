//! A GNSS digital twin: a signal generator, a software receiver and a judge.
//!
//! Three worlds meet only in [`gnss`], which holds what is *printed* in interface documents
//! and standards: time, coordinates, codes, messages, broadcast orbits, file formats.
//!
//! - [`generator`] is nature and hardware: it turns ephemerides, a user's motion and a
//!   described environment into IF samples, and writes the truth beside them.
//! - [`receiver`] is one designer's choice of how to undo that: acquisition, tracking,
//!   decoding, position. It sees IF metadata and samples, never truth.
//! - [`analysis`] is the judge: it joins what the receiver found with the truth on
//!   (sample number, satellite, signal) and measures every error.
//!
//! Above the three stands [`study`]: the receiver's loops on modelled correlations, held against the judge's theory.
//!
//! Each world is a cargo feature and compiles without the others. Units: SI and radians
//! inside, cycles for carrier phase, GPS time; a name ends with its unit.

#[macro_use]
pub mod plant;

pub mod gnss;

#[cfg(feature = "analysis")]
pub mod analysis;
#[cfg(feature = "cli")]
pub mod cli;
#[cfg(feature = "generator")]
pub mod generator;
#[cfg(feature = "receiver")]
pub mod receiver;
#[cfg(feature = "study")]
pub mod study;
