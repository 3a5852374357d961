//! Everything in `gnss` held against something that this project did not write.
//!
//! Files that the repository ships are tested everywhere; the rest where `GNSS_TWIN_DATA` points
//! (default `../shared/data`), with one line printed when it is not there.

mod atmosphere;
mod data;
mod lnav;
mod orbit;
mod pseudorange;
mod recording;
mod stability;
