//! Galileo: one file for each signal and one for each message.

pub mod altboc;
pub mod cnav;
pub mod e1;
pub mod e5;
pub mod e6;
pub mod fnav;
pub mod inav;
mod memory;
mod status;
