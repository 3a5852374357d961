//! Galileo: its messages.

pub mod inav;
