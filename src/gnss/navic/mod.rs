//! NavIC (IRNSS): one file for its signals, one folder for the message.

pub mod nav;
pub mod sps;
