//! Showing: tables, pictures and reports of what was measured and judged.
//!
//! [`staged`] keeps unfinished files out of sight and `write` puts tables and other files in place whole.
//! `tables` are the CSV files of a run, [`plot`] draws pictures, `run_report` fills a [`document`], of which
//! `pdf` sets paper and `page` makes a file for a browser, [`report`] is the table on the terminal. `foreign`
//! writes what came of a foreign receiver, [`trade`] the comparison of speed and accuracy that a benchmark
//! fills.

mod columns;
pub mod document;
pub mod foreign;
pub mod page;
#[cfg(feature = "pdf")]
pub mod pdf;
pub mod plot;
pub mod report;
pub(crate) mod run_report;
pub mod staged;
pub mod tables;
pub mod trade;
pub mod write;
