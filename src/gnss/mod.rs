//! The printed world: what interface documents and standards define, and nothing else.
//!
//! No truth and no opinions live here. Both generator and receiver use these modules, so an
//! error in them would cancel in a closed loop: everything here is tested against something
//! that this project did not write (`tests/witness.rs`).

pub mod bits;
pub mod broadcast;
pub mod crc;
pub mod earth;
#[cfg(any(feature = "generator", feature = "analysis"))]
pub mod facts;
pub mod fec;
pub mod galileo;
pub mod gps;
#[cfg(feature = "generator")]
pub mod inflate;
#[cfg(feature = "generator")]
pub mod ionex;
pub mod klobuchar;
pub mod message;
#[cfg(any(feature = "receiver", feature = "analysis"))]
pub mod place;
pub mod record;
#[cfg(feature = "generator")]
pub mod rinex;
pub mod samples;
pub mod satellite;
pub mod sigmf;
pub mod signal;
#[cfg(feature = "generator")]
pub mod sp3;
pub mod time;
#[cfg(feature = "generator")]
pub mod vienna;
#[cfg(feature = "generator")]
pub mod vmf3;
