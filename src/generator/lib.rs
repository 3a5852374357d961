//! Generator of IF samples from real ephemerides, a user's motion and a described environment.
//!
//! A [`scenario`] as written becomes a [`scene`] as meant. For each satellite, [`sky`] finds where it was
//! when it sent what arrives now; effects ([`ray`], [`effect`]) act on the rays that reach the antenna, and
//! [`arrival`] puts delays and phases together. [`transmit`] turns them into runs that [`synth`] renders,
//! [`mod@stage`] adds what the front end does, and [`mod@stream`] gives samples with their [`truth`]: as
//! values from a [`Generator`], or to writers and sinks.
//!
//! ```
//! use generator::Generator;
//! use generator::scenario::Scenario;
//! use generator::truth::Record;
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let scenario = r#"
//!     name = "tenth"
//!     start = 2010-07-01T08:06:00
//!     duration_s = 0.1
//!     motion = { kind = "static", latitude_deg = 48.1, longitude_deg = 11.6, height_m = 520 }
//! "#;
//! let scene = Scenario::from_toml(scenario)?.scene()?;
//! for batch in Generator::new(&scene)? {
//!     let batch = batch?;
//!     assert_eq!(batch.samples.len(), 260_000 * scene.metadata.format.bytes());
//!     assert!(batch.truth.iter().any(|record| matches!(record, Record::Observation(_))));
//! }
//! # Ok(())
//! # }
//! ```
//!
//! Rooms from the ground up; each imports only rooms before it, tests apart:
//!
//! 1. [`random`], [`fidelity`]; the world: [`vehicle`], [`inertial`], [`clock`], [`orbit_error`],
//!    [`precise`], [`catalogue`], [`message`];
//! 2. the channel: [`ray`], [`sky`], [`effect`], [`array`](mod@array), [`fast_phase`], [`spoof`];
//! 3. the kernels and the front end: [`synth`], [`knots`], [`switches`], [`mod@stage`];
//! 4. [`scene`], which holds all of these, and what follows from it: [`event`], [`presence`], [`geometry`],
//!    [`arrival`], [`truth`], [`error`], [`transmit`], [`mod@stream`];
//! 5. the reports before a run: [`levels`], [`plan`], [`dynamics`]; and [`scenario`], the scene as written.
//!
//! Internal crate: programs use the facade `gnss_twin`. What it does not hand on may change with any version.

#[macro_use(planted)]
extern crate gnss;

pub mod array;
pub mod arrival;
pub mod augmentation;
pub mod authentication;
pub mod catalogue;
pub mod clock;
pub mod dynamics;
pub mod effect;
pub mod error;
pub mod event;
pub mod fast_phase;
pub mod fidelity;
pub mod geometry;
pub mod inertial;
pub mod knots;
pub mod levels;
mod low_pass;
pub mod message;
pub mod orbit_error;
pub mod plan;
pub mod precise;
pub mod presence;
pub mod random;
pub mod ray;
pub mod scenario;
pub mod scene;
pub mod sky;
pub mod spoof;
pub mod stage;
pub mod stopwatch;
pub mod stream;
pub mod switches;
pub mod synth;
#[cfg(test)]
mod tests;
pub mod transmit;
pub mod truth;
pub mod vehicle;

pub use stream::{Batch, GenerateError, Generated, Generator, generate, generate_part};
