//! The edges: time, orbits, places, dynamics, sampling, power, arithmetic and loops where they are hardest.
//!
//! Each test asks for a number and holds it against its bar;
//! `GNSS_TWIN_WRITE_STABILITY=$PWD/reports/stability.md` makes a run of this target write all of them, bar
//! beside figure. `GNSS_TWIN_LONG=1` draws a thousand random scenes, not fifty.
#![cfg(all(feature = "generator", feature = "receiver", feature = "analysis"))]

mod arithmetic;
mod codes;
mod dynamics;
mod exact;
mod figures;
mod fuzz;
mod geometry;
mod ladder;
mod loops;
mod many;
mod motions;
mod orbit;
mod phase;
mod power;
mod run;
mod sampling;
mod scales;
mod sets;
mod singles;
mod skies;
mod space;
mod time;
