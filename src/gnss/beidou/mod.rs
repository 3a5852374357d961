//! BeiDou: its in-phase signals with their message in one file and one folder, B1C with its own likewise.

pub mod b1c;
pub mod bcnav1;
pub mod d1d2;
pub mod in_phase;
