//! Reading: everything that a run wrote, and the files of other receivers, as values.
//!
//! [`Run`] is a run's directory read once. Tables with a row an epoch, or for every satellite of one, go to a
//! [`spill_store`], so that a long run takes little more memory than a short one. [`rinex_obs`] and [`nmea`]
//! are the formats in which a receiver that this project did not write hands over its results. This room
//! decides nothing: it refuses what is not a table, a number or a time, and knows no theory.

pub mod attacks;
mod common;
mod delay;
pub mod derived;
pub mod detection;
mod emission;
mod fault;
mod files;
pub mod fixes;
mod inertial;
pub mod levels;
pub mod nmea;
pub mod numbers;
mod protection;
pub mod rinex_obs;
mod rows;
mod run;
mod sky;
pub mod spill_store;
pub mod table;
mod word_file;

pub use common::Common;
pub(crate) use common::replica_edge;
pub use emission::{Emission, MeanSignal};
pub use fault::Fault;
pub(crate) use files::{each, each_of_any};
pub use fixes::Fixes;
pub use numbers::Numbers;
pub use protection::Level;
pub use run::{PeakRow, PsdRow, Run, Speed, psd_name};
pub use table::Table;
