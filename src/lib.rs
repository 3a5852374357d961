//! A GNSS digital twin: a signal generator, a software receiver and a judge.
//!
//! ```text
//!  ephemerides, motion,             samples               records
//!  environment  ──────►  generator  ──────►  receiver  ──────►  judge ──► verdict, pictures, report
//!                            │                                    ▲
//!                            └─────────────── truth ──────────────┘
//! ```
//!
//! A [`Twin`] runs a scene; records and truth are values. [`Twin::run_judged`] adds the verdict,
//! [`Twin::run_in`] writes tables instead:
//!
//! ```
//! use gnss_twin::prelude::*;
//!
//! # let scenario = r#"
//! #     name = "glimpse"
//! #     start = 2010-07-01T08:06:00
//! #     duration_s = 0.3
//! #     motion = { kind = "static", latitude_deg = 48.1, longitude_deg = 11.6, height_m = 520 }
//! #     noise = {}
//! # "#;
//! let run = Twin::from_toml(scenario)?.run()?;
//! println!("{}", run.outcome);
//! run.fixes().for_each(|fix| println!("{} {:?}", fix.time(), fix.position_m()));
//! # assert!(run.outcome.acquired.len() >= 4);
//! # Ok::<(), gnss_twin::Error>(())
//! ```
//!
//! Modules, in the order in which a program meets them:
//!
//! | module | items |
//! | --- | --- |
//! | [`prelude`] | names that most programs use |
//! | [`twin`] | the loop in one call: [`Twin`], [`Run`], [`Error`] |
//! | [`scene`] | scenarios from a text, a file or code; scenes; plans |
//! | [`generator`], [`truth`] | samples of a scene in batches, and what is true of them |
//! | [`receiver`], [`settings`], [`record`] | samples to records, the receiver's settings, the rows |
//! | [`judge`] | errors against theory, limits, verdict, report |
//! | [`samples`], [`time`], [`satellite`], [`orbit`] | formats and metadata, instants, satellites, orbits |
//! | [`effect`], [`signal`], [`message`] | effects, stages, signals and messages of one's own |
//! | [`live`], [`study`] | a scene that moves while it is sent; sweeps of parameters |
//!
//! The same loop in single steps: a [`Generator`](generator::Generator) iterates batches of samples, and a
//! [`Receiver`](receiver::Receiver) takes them as bytes or as complex values. It sees metadata and samples,
//! never truth.
//!
//! ```
//! use gnss_twin::prelude::*;
//!
//! let scene = Scenario::builder("steps")
//!     .start(Epoch::parse("2010-07-01T08:06:00")?)
//!     .duration_s(0.3)
//!     .fixed(Geodetic::from_degrees(48.1, 11.6, 520.0))
//!     .noise()
//!     .build()?
//!     .scene()?;
//! let mut receiver = Receiver::new(&scene.metadata, &Settings::default())?;
//! let mut found = Vec::new();
//! for batch in Generator::new(&scene)? {
//!     for record in receiver.push_complex(&batch?.complex())? {
//!         match record {
//!             Record::Acquisition(row) if row.acquired => found.push(row.sv),
//!             _ => {}
//!         }
//!     }
//! }
//! assert!(found.len() >= 4, "{found:?}");
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! This crate is a facade: its items come from the crates of the rooms in `src`, none of which depends on
//! another of generator, receiver and judge. What a room exports beyond this facade is internal and may
//! change with any version. A program that needs generator and receiver takes the package with
//! `default-features = false, features = ["generator", "receiver"]`. Units: SI and radians inside, cycles for
//! carrier phase, GPS time; a name ends with its unit.
//!
//! Versions follow cargo's rules: before 1.0 a new minor version may change what is public, a patch may
//! not. `tests/api.txt` lists all of it, so that no change goes unseen, and the changelog says what each one
//! asks of a program that uses the library.

#![warn(missing_docs)]

mod facade;

pub use facade::{message, orbit, prelude, record, samples, satellite, signal, time};

#[cfg(feature = "generator")]
pub use facade::{effect, generator, scene, truth};
#[cfg(feature = "receiver")]
pub use facade::{receiver, settings};

#[cfg(feature = "analysis")]
pub use facade::judge;
#[cfg(feature = "study")]
pub use facade::study;
#[cfg(all(feature = "generator", feature = "receiver"))]
pub use facade::{live, twin};
#[cfg(all(feature = "generator", feature = "receiver"))]
#[doc(no_inline)]
pub use twin::{Error, Run, Twin};

/// Command line, for the program alone.
#[cfg(feature = "cli")]
#[doc(hidden)]
pub mod cli;
