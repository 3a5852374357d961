//! Effects and stages: each against its closed form or its published figures, through the samples.
#![cfg(all(feature = "generator", feature = "receiver", feature = "analysis"))]

mod array;
mod detection;
mod front_end;
mod interference;
mod laws;
mod link;
mod multipath;
mod oscillator;
mod propagation;
mod reaction;
mod satellite;
mod separation;
mod single;
mod spoofing;
