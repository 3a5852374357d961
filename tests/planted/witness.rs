//! The witnesses that hold what both sides share; `tests/witness` has them all.

#[path = "../witness/atmosphere.rs"]
mod atmosphere;
#[path = "../witness/codes.rs"]
mod codes;
#[path = "../witness/data.rs"]
mod data;
#[path = "../witness/inav.rs"]
mod inav;
#[path = "../witness/lnav.rs"]
mod lnav;
#[path = "../witness/orbit.rs"]
mod orbit;
#[path = "../witness/printed.rs"]
mod printed;
#[path = "../witness/pseudorange.rs"]
mod pseudorange;
#[path = "../witness/reduced.rs"]
mod reduced;
#[path = "../witness/redundancy.rs"]
mod redundancy;
