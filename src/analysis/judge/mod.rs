//! Judging: figures against limits.
//!
//! [`summary`] condenses a run into the numbers of `summary.json`, whose keys [`schema`] describes. `rules`
//! compare them with what a sound receiver reaches ([`forecast`]) and check that its tables agree with one
//! another ([`integrity`]); a user's own limits are in [`limits`]. A [`judgement`] is one figure against one
//! bound, a [`verdict`] the list of all. [`foreign`] judges receivers that this project did not write.

pub mod forecast;
pub mod foreign;
pub mod integrity;
pub mod judgement;
pub mod limits;
pub(crate) mod rules;
pub mod schema;
pub mod summary;
pub mod verdict;
