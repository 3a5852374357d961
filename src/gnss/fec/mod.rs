//! Forward error correction of navigation messages.

pub mod convolutional;
pub mod frames;
pub mod interleaver;
pub mod ldpc;
pub mod ldpc64;
pub(crate) mod pages;
pub mod reed_solomon;
pub mod register;
#[cfg(test)]
pub(crate) mod reliability;
pub mod running;
pub mod subframes;
