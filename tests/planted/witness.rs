//! The witnesses: everything in `gnss` held against something that this project did not write.
//!
//! Files that the repository ships are tested everywhere; the rest where `GNSS_TWIN_DATA` points (default
//! `../shared/data`). What was skipped is listed in the last lines of `cargo test`
//! (`tests/common/skipped.rs`). They are tests of this target because most planted faults of `gnss` are
//! theirs to notice, and one target compiles and runs them once.

#[path = "../witness/altboc.rs"]
mod altboc;
#[path = "../witness/atmosphere.rs"]
mod atmosphere;
#[path = "../witness/bcnav1.rs"]
mod bcnav1;
#[path = "../witness/bcnav2.rs"]
mod bcnav2;
#[path = "../witness/bdgim.rs"]
mod bdgim;
#[path = "../witness/beidou.rs"]
mod beidou;
#[path = "../witness/cnav.rs"]
mod cnav;
#[path = "../witness/cnav2.rs"]
mod cnav2;
#[path = "../witness/codes.rs"]
mod codes;
#[path = "../witness/constants.rs"]
mod constants;
#[path = "../witness/data.rs"]
mod data;
#[path = "../witness/detection.rs"]
mod detection;
#[path = "../witness/fnav.rs"]
mod fnav;
#[path = "../witness/galileo_e6.rs"]
mod galileo_e6;
#[path = "../witness/glonass.rs"]
mod glonass;
#[path = "../witness/group_delays.rs"]
mod group_delays;
#[path = "../witness/inav.rs"]
mod inav;
#[path = "../witness/lnav.rs"]
mod lnav;
#[path = "../witness/navic.rs"]
mod navic;
#[path = "../witness/navic_l1.rs"]
mod navic_l1;
#[path = "../witness/orbit.rs"]
mod orbit;
#[path = "../witness/osnma.rs"]
mod osnma;
#[path = "../witness/packed.rs"]
mod packed;
#[path = "../witness/printed.rs"]
mod printed;
#[path = "../witness/protection.rs"]
mod protection;
#[path = "../witness/pseudorange.rs"]
mod pseudorange;
#[path = "../witness/qzss.rs"]
mod qzss;
#[path = "../witness/received.rs"]
mod received;
#[path = "../witness/recording.rs"]
mod recording;
#[path = "../witness/recording_e5.rs"]
mod recording_e5;
#[path = "../witness/reduced.rs"]
mod reduced;
#[path = "../witness/redundancy.rs"]
mod redundancy;
#[path = "../witness/sbas.rs"]
mod sbas;
#[path = "../witness/stability.rs"]
mod stability;
