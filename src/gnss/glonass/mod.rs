//! GLONASS with frequency division: one file for its signals, one folder for the message.

pub mod fdma;
pub mod gnav;
