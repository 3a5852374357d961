//! GPS: one file a signal, one a message.

pub mod l1ca;
pub mod lnav;
