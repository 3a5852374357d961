//! Galileo: one file a signal, one a message.

pub mod e1;
pub mod inav;
