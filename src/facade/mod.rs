//! Facade of the library: the items that a program of one's own uses, by the order in which it meets them.
//!
//! Each module hands items of the rooms on by name and shows them in examples. What a room has beyond these
//! is internal, and may change with any version.

pub mod orbit;
pub mod samples;
pub mod satellite;
pub mod signal;
pub mod time;

pub mod message;
pub mod prelude;
pub mod record;

#[cfg(feature = "generator")]
pub mod effect;
#[cfg(feature = "generator")]
pub mod generator;
#[cfg(feature = "generator")]
pub mod scene;
#[cfg(feature = "generator")]
pub mod truth;

#[cfg(feature = "receiver")]
pub mod receiver;
#[cfg(feature = "receiver")]
pub mod settings;

#[cfg(feature = "analysis")]
pub mod judge;

#[cfg(all(feature = "generator", feature = "receiver"))]
pub mod live;
#[cfg(all(feature = "generator", feature = "receiver"))]
pub mod twin;

#[cfg(feature = "study")]
pub mod study;
