//! A GNSS digital twin: a signal generator, a software receiver and a judge.
//!
//! ```text
//!  ephemerides, motion,             samples               records
//!  environment  ──────►  generator  ──────►  receiver  ──────►  analysis ──► verdict, pictures, report
//!                            │                                     ▲
//!                            └─────────────── truth ───────────────┘
//! ```
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
//! Above the three are [`twin`], which closes the loop, [`live`], which takes motion while samples go out,
//! and [`study`]: the receiver's loops on modelled correlations, compared with the judge's theory.
//!
//! Results are values: the generator iterates samples with their truth, the receiver returns records, and
//! files are one sink among others.
//!
//! ```
//! use gnss_twin::generator::{Generator, scenario::Scenario};
//! use gnss_twin::receiver::{Receiver, output::Record, settings::Settings};
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let scenario = r#"
//!     name = "glimpse"
//!     start = 2010-07-01T08:06:00
//!     duration_s = 0.3
//!     motion = { kind = "static", latitude_deg = 48.1, longitude_deg = 11.6, height_m = 520 }
//!     noise = {}
//! "#;
//! let scene = Scenario::from_toml(scenario)?.scene()?;
//! let mut receiver = Receiver::new(&scene.metadata, &Settings::default())?;
//! let mut found = Vec::new();
//! for batch in Generator::new(&scene)? {
//!     for record in receiver.push(&batch?.samples)? {
//!         match record {
//!             Record::Acquisition(row) if row.acquired => found.push(row.sv),
//!             _ => {}
//!         }
//!     }
//! }
//! assert!(found.len() >= 4, "{found:?}");
//! # Ok(())
//! # }
//! ```
//!
//! What the two wrote into a directory, [`analysis::judge`](analysis::judge()) measures, judges and draws:
//!
//! ```
//! use gnss_twin::generator::{scenario::Scenario, truth};
//! use gnss_twin::receiver::{output::Output, settings::Settings};
//! use gnss_twin::{analysis, twin};
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let scenario = r#"
//!     name = "judged"
//!     start = 2010-07-01T08:06:00
//!     duration_s = 4
//!     motion = { kind = "static", latitude_deg = 48.1, longitude_deg = 11.6, height_m = 520 }
//!     noise = {}
//! "#;
//! let scene = Scenario::from_toml(scenario)?.scene()?;
//! let run = tempfile::tempdir()?;
//! let [truth, rx] = ["truth", "rx"].map(|name| run.path().join(name));
//! std::fs::create_dir(&truth)?;
//! std::fs::create_dir(&rx)?;
//! let (mut truth, mut rx) = (truth::Writer::create(&truth)?, Output::create(&rx)?);
//! twin::run(std::slice::from_ref(&scene), &Settings::default(), &mut truth, &mut rx)?;
//! let summary = analysis::assess(run.path(), None)?;
//! assert_eq!(summary.satellites.false_acquired, 0);
//! # Ok(())
//! # }
//! ```
//!
//! Each part is a crate of its own, named as its module here, and this crate hands them on: no crate of the
//! three worlds depends on another. A program that needs generator and receiver takes the package with
//! `default-features = false, features = ["generator", "receiver"]`. Units: SI and radians inside, cycles for
//! carrier phase, GPS time; a name ends with its unit.
//!
//! Versions follow cargo's rules: before 1.0 a new minor version may change what is public, a patch may
//! not. `tests/api.txt` lists all of it, so that no change goes unseen, and the changelog says what each one
//! asks of a program that uses the library.

#![warn(missing_docs)]

pub use ::gnss;

#[cfg(feature = "analysis")]
pub use ::analysis;
#[cfg(feature = "generator")]
pub use ::generator;
#[cfg(all(feature = "generator", feature = "receiver"))]
pub use ::live;
#[cfg(feature = "receiver")]
pub use ::receiver;
#[cfg(feature = "study")]
pub use ::study;
#[cfg(all(feature = "generator", feature = "receiver"))]
pub use ::twin;

#[cfg(feature = "cli")]
pub mod cli;
