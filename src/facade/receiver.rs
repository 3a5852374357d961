//! Receiver: samples in, records out.
//!
//! A [`Receiver`] sees metadata, samples and settings, never truth. It takes bytes, cut anywhere, and returns
//! what they bring:
//!
//! ```
//! use gnss_twin::prelude::*;
//!
//! let rate = Rate::from_hz(2.6e6).ok_or("no rate")?;
//! let metadata =
//!     IfMetadata { format: Format::Ci8, rate, center_hz: 1_575.42e6, inverted: false, start: None };
//! let mut receiver = Receiver::new(&metadata, &Settings::default())?;
//! // 50 ms of a triangle: nothing that a satellite sends.
//! let bytes: Vec<u8> = (0..2 * 130_000_u32).map(|k| (k % 17) as u8).collect();
//! let mut records: Vec<Record> = receiver.push(&bytes)?;
//! let (rest, outcome) = receiver.finish()?;
//! records.extend(rest);
//! assert!(!records.iter().any(|record| matches!(record, Record::Fix(_))));
//! assert!(outcome.diagnosis.is_some());
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! [`Receiver::push_complex`] takes complex values, in units of the format's least significant bit. With
//! `cf32_le` they are taken as they are:
//!
//! ```
//! use gnss_twin::prelude::*;
//! use gnss_twin::receiver::ReceiveError;
//!
//! let rate = Rate::from_hz(2.6e6).ok_or("no rate")?;
//! let metadata =
//!     IfMetadata { format: Format::Cf32Le, rate, center_hz: 1_575.42e6, inverted: false, start: None };
//! let mut receiver = Receiver::new(&metadata, &Settings::default())?;
//! let samples: Vec<Complex<f32>> = (0..26_000).map(|k| Complex::new((k % 7) as f32, 0.5)).collect();
//! receiver.push_complex(&samples)?;
//! assert_eq!(receiver.finish()?.1.samples, 26_000);
//! let metadata = IfMetadata { format: Format::Ri8, center_hz: 1.575e9, ..metadata };
//! let mut real = Receiver::new(&metadata, &Settings::default())?;
//! assert!(matches!(real.push_complex(&samples), Err(ReceiveError::Real { .. })));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! Without a fix, the [`Outcome`] has a [`Diagnosis`]: how far the receiver came, and what to try:
//!
//! ```
//! use gnss_twin::prelude::*;
//! use gnss_twin::receiver::{Diagnosis, receive};
//!
//! let rate = Rate::from_hz(2.6e6).ok_or("no rate")?;
//! let metadata =
//!     IfMetadata { format: Format::Ci8, rate, center_hz: 1_575.42e6, inverted: false, start: None };
//! let mut records: Vec<Record> = Vec::new();
//! let (samples, settings) = ([0_u8; 1000], Settings::default());
//! let outcome: Outcome = receive(&metadata, samples.as_slice(), &settings, &mut records, &mut |_| ())?;
//! let diagnosis: Diagnosis = outcome.diagnosis.ok_or("a fix")?;
//! assert!(records.is_empty() && !diagnosis.headline().is_empty());
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! A [`Reception`] gives its [`Record`]s to a [`Sink`]. [`Output`] writes the program's tables,
//! [`JsonLines`], [`Nmea`] and [`Rinex`] of a [`RinexVersion`] other formats. A `Vec` keeps everything, and a
//! tuple of two sinks gives both every record:
//!
//! ```
//! use gnss_twin::prelude::*;
//! use gnss_twin::receiver::{JsonLines, Output, OutputError, Reception, Sink};
//!
//! #[derive(Default)]
//! struct Fixes(usize);
//!
//! impl Sink for Fixes {
//!     fn take(&mut self, record: Record) -> Result<(), OutputError> {
//!         self.0 += usize::from(matches!(record, Record::Fix(_)));
//!         Ok(())
//!     }
//! }
//!
//! let rate = Rate::from_hz(2.6e6).ok_or("no rate")?;
//! let metadata =
//!     IfMetadata { format: Format::Ci8, rate, center_hz: 1_575.42e6, inverted: false, start: None };
//! let there = tempfile::tempdir()?;
//! let (mut fixes, mut files) = (Fixes::default(), Output::create(there.path())?);
//! let mut reception = Reception::new(&metadata, &Settings::default())?;
//! let mut both = (&mut fixes, &mut files);
//! reception.take(&[1; 52_000], &mut both)?;
//! let outcome = reception.finish(&mut both)?;
//! assert_eq!((fixes.0, outcome.samples), (0, 26_000));
//! assert!(there.path().join("receiver.json").is_file());
//! let lines = JsonLines::new("records".into(), Vec::<u8>::new());
//! drop(lines);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! Several front ends of one clock are one reception: [`receive_several`], [`Receiver::of_several`].

#[doc(inline)]
pub use ::gnss::exchange::Version as RinexVersion;
#[doc(inline)]
pub use ::receiver::diagnosis::Diagnosis;
#[doc(inline)]
pub use ::receiver::output::{JsonLines, Nmea, Output, OutputError, Record, Rinex, Sink};
#[doc(inline)]
pub use ::receiver::{Outcome, ReceiveError, Receiver, Reception, receive, receive_several};
