//! Everything in `gnss` held against something that this project did not write.
//!
//! Files that the repository ships are tested everywhere; the rest where `GNSS_TWIN_DATA` points (default
//! `../shared/data`). What was skipped is listed in the last lines of `cargo test`
//! (`tests/witness_skips.rs`).

mod atmosphere;
mod codes;
mod data;
mod inav;
mod lnav;
mod orbit;
mod printed;
mod pseudorange;
mod recording;
mod reduced;
mod redundancy;
mod stability;
