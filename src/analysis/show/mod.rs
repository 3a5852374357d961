//! Showing: tables, pictures and reports of what was measured and judged.
//!
//! [`staged`] keeps unfinished files out of sight and `write` puts tables and other files in place whole.
//! `tables` are the CSV files of a run, [`plot`] draws pictures, `pdf` sets pages and `run_report` fills
//! them, [`report`] is the table on the terminal. `foreign` writes what came of a foreign receiver, [`trade`]
//! the comparison of speed and accuracy that a benchmark fills.

pub mod foreign;
#[cfg(feature = "pdf")]
pub mod pdf;
pub mod plot;
pub mod report;
#[cfg(feature = "pdf")]
pub(crate) mod run_report;
pub mod staged;
pub mod tables;
pub mod trade;
pub mod write;
