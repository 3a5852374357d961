//! What acts on whole blocks of samples after the satellites are added: so far, thermal noise.
//!
//! Stages are functions of the absolute sample number, so that the stream is the same however it is cut.

pub mod noise;
