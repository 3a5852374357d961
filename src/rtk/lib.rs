//! Baselines between two receivers by double differences of their observations, with whole ambiguities, and
//! their judgement by the truth.
//!
//! [`files`] reads observations and ephemerides of two runs or two foreign receivers, [`pairs`] what they
//! observe in common. [`solver`] finds the rover's position epoch by epoch: [`normal`] equations give the
//! float solution, [`lambda`] integers of its ambiguities, [`integers`] says whether they are believed, and
//! [`slips`] finds what breaks them. [`truth`] knows the true baseline and the true integers, [`judge`] holds
//! the solution against them.
//!
//! Internal crate: programs use the facade `gnss_twin`. What it does not hand on may change with any version.

#[macro_use(planted)]
extern crate gnss;

pub mod carrier;
pub mod error;
pub mod files;
pub mod integers;
pub mod judge;
pub mod lambda;
pub mod normal;
pub mod orbits;
pub mod pairs;
pub mod rows;
pub mod run;
pub mod site;
pub mod slips;
pub mod solver;
pub mod truth;
