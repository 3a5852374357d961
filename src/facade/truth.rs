//! Truth of a scene: records, and who takes them.
//!
//! A [`Record`] is one thing that is true at a tick. A `Vec` keeps all of them, `()` none:
//!
//! ```
//! use gnss_twin::generator::generate;
//! use gnss_twin::prelude::*;
//! use gnss_twin::record::{PassRow, TrajectoryRow};
//! use gnss_twin::truth::Record;
//!
//! let scene = Scenario::builder("tenth")
//!     .start(Epoch::parse("2010-07-01T08:06:00")?)
//!     .duration_s(0.1)
//!     .fixed(Geodetic::from_degrees(48.1, 11.6, 520.0))
//!     .build()?
//!     .scene()?;
//! let mut records: Vec<Record> = Vec::new();
//! generate(&scene, &mut std::io::sink(), &mut records, &mut |_| ())?;
//! let Some(Record::Trajectory(TrajectoryRow { x_m, .. })) = records.first() else {
//!     panic!("no trajectory");
//! };
//! assert_eq!(*x_m, scene.trajectory.at(0.0).position_m.x);
//! assert!(matches!(records.last(), Some(Record::Pass(PassRow { .. }))));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! A [`Sink`] of one's own has one method. A tuple of two sinks gives both every record:
//!
//! ```
//! use gnss_twin::generator::generate;
//! use gnss_twin::prelude::*;
//! use gnss_twin::truth::{Record, Sink, TruthError};
//!
//! struct Highest(f64);
//!
//! impl Sink for Highest {
//!     fn take(&mut self, record: Record) -> Result<(), TruthError> {
//!         if let Record::Sky(row) = record {
//!             self.0 = self.0.max(row.elevation_deg);
//!         }
//!         Ok(())
//!     }
//! }
//!
//! let scene = Scenario::builder("tenth")
//!     .start(Epoch::parse("2010-07-01T08:06:00")?)
//!     .duration_s(0.1)
//!     .fixed(Geodetic::from_degrees(48.1, 11.6, 520.0))
//!     .build()?
//!     .scene()?;
//! let (mut highest, mut all) = (Highest(0.0), Vec::new());
//! generate(&scene, &mut std::io::sink(), &mut (&mut highest, &mut all), &mut |_| ())?;
//! assert!((40.0..=90.0).contains(&highest.0) && !all.is_empty());
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! [`Writer`] writes the files that the judge reads. [`Several`] hands every record to many sinks:
//!
//! ```
//! use gnss_twin::generator::generate;
//! use gnss_twin::prelude::*;
//! use gnss_twin::truth::{Record, Several, Writer};
//!
//! let scene = Scenario::builder("tenth")
//!     .start(Epoch::parse("2010-07-01T08:06:00")?)
//!     .duration_s(0.1)
//!     .fixed(Geodetic::from_degrees(48.1, 11.6, 520.0))
//!     .build()?
//!     .scene()?;
//! let there = tempfile::tempdir()?;
//! let mut sinks = Several(vec![
//!     Box::new(Writer::create(there.path())?),
//!     Box::new(Vec::<Record>::new()),
//! ]);
//! generate(&scene, &mut std::io::sink(), &mut sinks, &mut |_| ())?;
//! assert!(["observations.csv", "scene.json"].iter().all(|name| there.path().join(name).is_file()));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

#[doc(inline)]
pub use ::generator::truth::{Record, Several, Sink, TruthError, Writer};
