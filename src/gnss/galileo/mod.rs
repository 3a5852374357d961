//! Galileo: one file a signal, one a message.

pub mod e1;
pub mod e5;
pub mod fnav;
pub mod inav;
mod status;
