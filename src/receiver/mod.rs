//! The estimating world: one designer's receiver, from IF samples to position.
//!
//! It sees IF metadata, samples and settings; no argument can carry truth. [`acquire`] finds
//! satellites, [`track`] follows them with [`correlate`], [`decode`] reads their messages,
//! [`observe`] makes observables at common epochs and [`position`] solves for place and time. [`interference`] watches
//! the spectrum, [`parting`] how code and carrier part, [`gap`] whether samples are missing.
//!
//! A [`Receiver`] takes samples and returns [`output::Record`]s as values; [`receive`] reads a stream to its
//! end and gives them to any [`output::Sink`], of which the CSV files of [`output::Output`] are one.

pub mod acquire;
pub mod correlate;
pub mod decode;
mod described;
pub mod diagnosis;
pub mod format;
pub mod gap;
pub mod interference;
pub mod lead;
pub mod looks;
pub mod observe;
pub mod output;
pub mod parting;
pub mod position;
mod run;
mod session;
pub mod settings;
pub mod source;
pub mod track;

pub use run::{Conditioning, Interfered, Outcome, ReceiveError, Receiver, Reception, receive};
