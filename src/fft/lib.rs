//! Fourier transforms of both precisions: the planner of `rustfft` behind functions that are not generic.
//!
//! A generic planner is compiled again in each crate and test that calls it: rustfft's algorithms for every
//! instruction set were two fifths of the code of the receiver and a third of the judge's. Here they are
//! compiled once. Transforms are those of `rustfft`: unnormalised, in place, of any length.
//!
//! ```
//! use fft::{Complex, Planner};
//!
//! let mut samples = vec![Complex::new(1.0_f32, 0.0); 12];
//! Planner::<f32>::new().plan_fft_forward(12).process(&mut samples);
//! assert!((samples[0].re - 12.0).abs() < 1e-6 && samples[1].norm() < 1e-6);
//! ```
//!
//! Internal crate: programs use the facade `gnss_twin`. What it does not hand on may change with any version.

use std::sync::Arc;

pub use rustfft::Fft;
use rustfft::FftPlanner;
pub use rustfft::num_complex::Complex;

/// Plans transforms of `f32` or `f64`, which share tables where their lengths have factors in common.
pub struct Planner<T: rustfft::FftNum>(FftPlanner<T>);

macro_rules! planner {
    ($number:ty) => {
        impl Planner<$number> {
            /// A planner that knows no length yet.
            #[allow(clippy::new_without_default, reason = "a planner is made where it is used")]
            pub fn new() -> Self {
                Self(FftPlanner::new())
            }

            /// The transform of `length` values with exp(−2πi jk / length).
            pub fn plan_fft_forward(&mut self, length: usize) -> Arc<dyn Fft<$number>> {
                self.0.plan_fft_forward(length)
            }

            /// The transform of `length` values with exp(+2πi jk / length), which is not divided by `length`.
            pub fn plan_fft_inverse(&mut self, length: usize) -> Arc<dyn Fft<$number>> {
                self.0.plan_fft_inverse(length)
            }
        }
    };
}

planner!(f32);
planner!(f64);
