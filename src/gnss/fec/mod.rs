//! Forward error correction of navigation messages.

pub mod convolutional;
pub mod interleaver;
pub mod reed_solomon;
