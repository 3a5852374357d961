//! The twin while it runs: motion and events come in, samples go out at once.
//!
//! [`drive`] makes ticks of a scene with `[motion] kind = "pushed"` and knows no clock; [`lockstep`] adds a
//! receiver and keeps step with a simulation in virtual time. Each tick's samples depend on the scene and on
//! the ticks before it alone.
//!
//! Internal crate: programs use the facade `gnss_twin`. What it does not hand on may change with any version.

#![cfg(all(feature = "generator", feature = "receiver"))]

pub mod drive;
pub mod lockstep;
pub mod wire;
