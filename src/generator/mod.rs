//! The physical world: real ephemerides, a user's motion and a described environment become IF samples.
//!
//! A [`scenario`] as written becomes a [`scene`] as meant. For each satellite, [`sky`] finds where
//! it was when it sent what arrives now, effects ([`ray`]) act on the rays that reach the antenna,
//! and [`synth`] turns delays and phases into samples. The truth is written beside them.

pub mod catalogue;
pub mod clock;
pub mod departure;
pub mod dynamics;
pub mod effect;
pub mod fidelity;
pub mod geometry;
pub mod knots;
pub mod levels;
pub mod message;
pub mod plan;
pub mod precise;
pub mod presence;
pub mod random;
pub mod ray;
pub mod ripple;
pub mod scenario;
pub mod scene;
pub mod sky;
pub mod spoof;
pub mod stage;
pub mod stream;
pub mod synth;
pub mod truth;
pub mod vehicle;

pub use stream::{GenerateError, Generated, generate, generate_part};
