//! The estimating world: one designer's receiver, from IF samples to position.
//!
//! It sees IF metadata, samples and settings; no argument can carry truth. [`acquire`] finds satellites,
//! [`track`] follows them with [`correlate`], [`decode`] reads their messages, [`observe`] makes observables
//! at common epochs and [`position`] solves for position and time. [`interference`] watches the spectrum,
//! [`parting`] how code and carrier part, [`gap`] whether samples are missing. [`authentic`] verifies
//! Galileo's authenticated messages, [`detect`] tests for jamming and spoofing. Of an array's elements
//! [`array`](mod@array) makes one stream before all that.
//!
//! A [`Receiver`] takes samples and returns [`output::Record`]s as values; [`receive`] reads a stream to its
//! end and gives them to any [`output::Sink`], of which the CSV files of [`output::Output`] are one. Several
//! front ends of one clock are one reception ([`Receiver::of_several`], [`receive_several`]). A [`Navigator`]
//! is the part behind the channels alone.
//!
//! ```
//! use gnss::samples::{Format, IfMetadata};
//! use gnss::time::Rate;
//! use receiver::{Receiver, output::Record, settings::Settings};
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let rate = Rate::from_hz(2.6e6).ok_or("no rate")?;
//! let (format, center_hz) = (Format::Ci8, 1_575.42e6);
//! let metadata = IfMetadata { format, rate, center_hz, inverted: false, start: None };
//! let mut receiver = Receiver::new(&metadata, &Settings::default())?;
//! // 50 ms of a triangle: nothing that a satellite sends.
//! let samples: Vec<u8> = (0..2 * 130_000_u32).map(|k| (k % 17) as u8).collect();
//! let mut records = receiver.push(&samples)?;
//! let (rest, outcome) = receiver.finish()?;
//! records.extend(rest);
//! assert!(!records.iter().any(|record| matches!(record, Record::Fix(_))));
//! println!("{}", outcome.diagnosis.ok_or("a fix without a satellite")?);
//! # Ok(())
//! # }
//! ```
//!
//! Rooms from the ground up; each imports only rooms before it:
//! source, format, thresholds · [`correlate`] · [`lead`] · [`gap`], [`interference`], [`parting`] ·
//! [`acquire`], looks · [`track`] · [`decode`] · [`observe`], [`position`] · [`settings`] (of all those) ·
//! [`diagnosis`], [`output`] · [`array`](mod@array), [`authentic`], [`detect`] · outcome · session · run ·
//! navigator.
//!
//! Internal crate: programs use the facade `gnss_twin`. What it does not hand on may change with any version.

#[macro_use(planted)]
extern crate gnss;

pub mod acquire;
pub mod array;
pub mod authentic;
pub mod correlate;
pub mod decode;
mod described;
pub mod detect;
pub mod diagnosis;
pub mod followed;
pub mod format;
pub mod gap;
pub mod interference;
pub mod lead;
pub mod looks;
mod navigator;
pub mod observe;
mod outcome;
pub mod output;
pub mod parting;
pub mod position;
mod run;
mod session;
pub mod settings;
pub mod source;
pub mod threshold;
pub mod track;

pub use navigator::Navigator;
pub use outcome::{Conditioning, Interfered, Outcome, ReceiveError};
pub use run::{Receiver, Reception, receive, receive_several, searched};
pub use session::Given;
