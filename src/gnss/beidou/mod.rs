//! BeiDou: its in-phase signals with their message in one file and one folder; B1C, B2a and B2b with theirs
//! likewise, which have blocks of fields in common.

pub mod b1c;
pub mod b2a;
pub mod b2b;
pub mod bcnav;
pub mod bcnav1;
pub mod bcnav2;
pub mod bcnav3;
pub mod d1d2;
pub mod in_phase;
