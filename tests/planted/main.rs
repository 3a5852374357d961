//! Faults planted in the code, one at a time, and the check that must turn red for each.
//!
//! [`FAULTS`] is the one list. A child process with the fault's name in its environment runs one test of this
//! target; without a fault the same tests pass in this very run. `GNSS_TWIN_WRITE_PLANTED` names the report
//! that the run writes.

mod arrays;
mod bands;
mod baselines;
mod channels;
mod faults;
mod inertial;
mod judge;
mod laws;
#[path = "../common/long.rs"]
mod long;
mod loops;
mod rtcm;
mod runner;
mod sides;
mod witness;
