//! GPS: one file for each signal and one for each message.

pub mod cnav;
pub mod cnav2;
pub mod l1c;
pub mod l1ca;
pub mod l2c;
pub mod l5;
pub mod lnav;
pub mod modernised;
