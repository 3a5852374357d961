//! Samples of a scene, batch by batch, with their truth.
//!
//! A [`Generator`] iterates a scene. Each [`Batch`] has samples as bytes of the scene's format and, by
//! [`Batch::complex`], as complex values:
//!
//! ```
//! use gnss_twin::prelude::*;
//!
//! let scene = Scenario::builder("tenth")
//!     .start(Epoch::parse("2010-07-01T08:06:00")?)
//!     .duration_s(0.1)
//!     .fixed(Geodetic::from_degrees(48.1, 11.6, 520.0))
//!     .noise()
//!     .build()?
//!     .scene()?;
//! let (mut samples, mut observations) = (Vec::<Complex<f32>>::new(), 0);
//! for batch in Generator::new(&scene)? {
//!     let batch: Batch = batch?;
//!     assert_eq!(batch.samples.len(), batch.format.bytes() * batch.complex().len());
//!     samples.extend(batch.complex());
//!     let is_observation = |record: &&truth::Record| matches!(record, truth::Record::Observation(_));
//!     observations += batch.truth.iter().filter(is_observation).count();
//! }
//! assert_eq!(samples.len(), 260_000);
//! assert!(observations >= 4);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! [`generate`] writes the bytes to any writer and returns what was [`Generated`]:
//!
//! ```
//! use gnss_twin::generator::{GenerateError, Generated, generate};
//! use gnss_twin::prelude::*;
//!
//! let scene = Scenario::builder("tenth")
//!     .start(Epoch::parse("2010-07-01T08:06:00")?)
//!     .duration_s(0.1)
//!     .fixed(Geodetic::from_degrees(48.1, 11.6, 520.0))
//!     .build()?
//!     .scene()?;
//! let mut bytes = Vec::new();
//! let done: Result<Generated, GenerateError> = generate(&scene, &mut bytes, &mut (), &mut |_| ());
//! assert_eq!((done?.samples, bytes.len()), (260_000, 520_000));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! [`Options`] cut the work for threads and memory; no option changes a byte:
//!
//! ```
//! use gnss_twin::generator::Options;
//! use gnss_twin::prelude::*;
//!
//! let scene = Scenario::builder("tenth")
//!     .start(Epoch::parse("2010-07-01T08:06:00")?)
//!     .duration_s(0.1)
//!     .fixed(Geodetic::from_degrees(48.1, 11.6, 520.0))
//!     .noise()
//!     .build()?
//!     .scene()?;
//! let bytes = |options: &Options| -> Result<Vec<u8>, Box<dyn std::error::Error>> {
//!     let mut all = Vec::new();
//!     for batch in Generator::with(&scene, options)? {
//!         all.extend(batch?.samples);
//!     }
//!     Ok(all)
//! };
//! let small = Options { block_runs: 1, batch_blocks: 3, ..Options::default() };
//! assert_eq!(bytes(&small)?, bytes(&Options::default())?);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

#[doc(inline)]
pub use ::generator::stream::{Batch, GenerateError, Generated, Generator, Options, generate};
