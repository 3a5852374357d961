//! BeiDou: one file for its in-phase signals, one folder for their message.

pub mod d1d2;
pub mod in_phase;
