//! Theory of acquisition and tracking, with its sources: the judge's reference.
//!
//! [`linear`] solves a discrete loop with its real closure. [`dll`], [`pll`] and [`fll`] give jitter, stress
//! and thresholds in closed form, and [`edges`] the errors by chip edges. [`oscillator`] adds the receiver's
//! clock, of which [`clock`] has the stability, and [`detection`] has the search. Everything takes a plain
//! description (gains, times, C/N0): no receiver is imported. Noise convention: a correlation over T has unit
//! noise variance per component and the amplitude √(2·T·C/N0).

pub mod clock;
pub mod detection;
pub mod dll;
pub mod edges;
pub mod fll;
pub mod inertial;
pub mod linear;
pub mod oscillator;
pub mod pll;
#[cfg(test)]
mod tests;
