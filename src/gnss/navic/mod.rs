//! NavIC (IRNSS): one file for its signals, one folder for a message.

pub mod l1;
pub mod l1nav;
pub mod nav;
pub mod sps;
