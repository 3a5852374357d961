//! Discrete tracking loops as exact linear systems: noise, stability, response, from a plain description of
//! the loop.
//!
//! A loop is stepped with unit vectors into x' = A·x + b·n, y = c·x, where n is white noise of the
//! discriminator and y the error of what the loop tracks. The variance of y is c·P·cᵀ with P = A·P·Aᵀ + b·bᵀ,
//! summed by doubling (Smith 1968). One-sided noise bandwidth: B·T = variance/2 for a phase loop. Limits:
//! small errors, so no discriminator's range and no cycle slip; noise is white from update to update.

use nalgebra::{DMatrix, DVector};
use num_complex::Complex64;

/// Integration of a rate-only loop filter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Integrator {
    /// The state before the update.
    Forward,
    /// The state after it.
    Boxcar,
    /// Mean of the states before and after.
    Bilinear,
}

/// Feedback of a loop's corrections.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Feedback {
    /// The oscillator's phase and rate are both set at each update: gains correct the mean phase of the
    /// coming interval. Stephens and Thomas 1995.
    PhaseAndRate,
    /// Correction of the rate only: the filters of Kaplan and Hegarty, table 8.23. The discriminator sees the
    /// mean phase of an interval (a correlator does) if `interval_mean` is true, otherwise that at its start.
    /// `delay` is one more epoch.
    Rate {
        /// Integration of the filter.
        integrator: Integrator,
        /// True if the phase compared is the interval's mean.
        interval_mean: bool,
        /// True if the output acts one update later.
        delay: bool,
    },
}

/// A phase or code loop of order 1 to 3, with gains per update: dimensionless, times 1, T, T² those a second.
///
/// For [`Feedback::Rate`] they are b·ω0·T, a·(ω0·T)², (ω0·T)³ of the analogue prototype; see
/// [`analogue_gains`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PhaseLoop {
    /// Gains of phase, rate and acceleration per update.
    pub gains: [f64; 3],
    /// Corrections that reach the oscillator.
    pub feedback: Feedback,
}

/// A frequency loop of order 1 or 2 that sets the rate of an oscillator; noise is that of the phase of a
/// prompt.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FrequencyLoop {
    /// Gains of rate and acceleration per update.
    pub gains: [f64; 2],
    /// Pairs of prompts for the discriminator.
    pub pairs: Pairs,
}

/// Pairs of prompts for a frequency discriminator.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Pairs {
    /// Each prompt with the one before, updates every T: successive errors share a prompt.
    Overlapping,
    /// Two prompts an update, updates every 2T.
    Separate,
}

/// A phase loop with phase-and-rate feedback whose rate is also corrected by `assist` times the difference of
/// successive phase errors, as a frequency loop of order 1 on overlapping pairs does.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AssistedLoop {
    /// Gains of phase, rate and acceleration per update.
    pub gains: [f64; 3],
    /// Gain of the frequency discriminator on the rate.
    pub assist: f64,
}

/// Gains per update of the usual analogue prototypes for a nominal bandwidth times update time.
///
/// Kaplan and Hegarty, Understanding GPS 2nd ed., table 5.6: ω0 = 4B; B/0.53 with a2 = 1.414; B/0.7845 with
/// a3 = 1.1, b3 = 2.4.
pub fn analogue_gains(order: u32, bandwidth_time: f64) -> [f64; 3] {
    match order {
        1 => [4.0 * bandwidth_time, 0.0, 0.0],
        2 => {
            let w = bandwidth_time / 0.53;
            [1.414 * w, w * w, 0.0]
        }
        _ => {
            let w = bandwidth_time / 0.7845;
            [2.4 * w, 1.1 * w * w, w * w * w]
        }
    }
}

/// Gains per update of a loop whose roots all lie at `root` (controlled-root formulation, Stephens and Thomas
/// 1995).
pub fn controlled_root_gains(order: u32, root: f64) -> [f64; 3] {
    let d = 1.0 - root;
    match order {
        1 => [d, 0.0, 0.0],
        2 => [1.0 - root * root, d * d, 0.0],
        _ => [1.0 - root * root * root, d * d * (1.0 + 2.0 * root), d * d * d],
    }
}

/// The root of such gains.
pub fn controlled_root(order: u32, [phase, rate, acceleration]: [f64; 3]) -> f64 {
    match order {
        1 => 1.0 - phase,
        2 => 1.0 - rate.sqrt(),
        _ => 1.0 - libm::cbrt(acceleration),
    }
}

/// x' = A·x + b·n, y = c·x.
#[derive(Clone, Debug)]
pub struct Linear {
    a: DMatrix<f64>,
    b: DVector<f64>,
    c: DVector<f64>,
}

/// Share of its state that a loop may still remember where its autocorrelation is cut off.
const FORGOTTEN: f64 = 1e-6;
/// Doublings of the sum: 2⁶⁴ updates, more than any loop takes to forget.
const DOUBLINGS: usize = 64;

impl Linear {
    /// Matrices of a loop's step: (state, noise) to (next state, error).
    fn of<const N: usize>(step: impl Fn([f64; N], f64) -> ([f64; N], f64)) -> Self {
        let mut a = DMatrix::zeros(N, N);
        let mut c = DVector::zeros(N);
        for column in 0..N {
            let mut unit = [0.0; N];
            unit[column] = 1.0;
            let (next, error) = step(unit, 0.0);
            a.column_mut(column).copy_from_slice(&next);
            c[column] = error;
        }
        let (next, _) = step([0.0; N], 1.0);
        Self { a, b: DVector::from_column_slice(&next), c }
    }

    /// Covariance of the state for white noise of unit variance; `None` if the loop is unstable.
    fn covariance(&self) -> Option<DMatrix<f64>> {
        let mut power = self.a.clone();
        let mut sum = &self.b * self.b.transpose();
        for _ in 0..DOUBLINGS {
            let more = &power * &sum * power.transpose();
            let (size, growth) = (sum.norm(), more.norm());
            if !size.is_finite() || !growth.is_finite() {
                return None;
            }
            sum += more;
            if growth <= f64::EPSILON * size {
                return Some(sum);
            }
            power = &power * &power;
        }
        None
    }

    /// Variance of the error for white noise of unit variance; `None` if the loop is unstable.
    pub fn noise_gain(&self) -> Option<f64> {
        Some(self.c.dot(&(self.covariance()? * &self.c)))
    }

    /// Updates that count as one independent value where a variance is estimated: Σρ² over all lags of the
    /// error's autocorrelation ρ (Bartlett 1946). `None` if the loop is unstable.
    ///
    /// A first-order loop has 1/(4B·T), hence the 4·B·t independent values of a time t.
    pub fn updates_per_value(&self) -> Option<f64> {
        let mut state = self.covariance()? * &self.c;
        let (variance, size) = (self.c.dot(&state), state.norm());
        let mut sum = 1.0;
        while state.norm() > FORGOTTEN * size {
            state = &self.a * &state;
            let rho = self.c.dot(&state) / variance;
            sum += 2.0 * rho * rho;
        }
        Some(sum)
    }

    /// Error at z for a unit of discriminator noise: H(z) of a phase loop, whose error for a moving phase is
    /// 1−H(z). `None` at a pole.
    pub fn response(&self, z: Complex64) -> Option<Complex64> {
        let size = self.a.nrows();
        let matrix = DMatrix::from_fn(size, size, |row, column| {
            (if row == column { z } else { Complex64::ZERO }) - self.a[(row, column)]
        });
        let state = matrix.lu().solve(&self.b.map(Complex64::from))?;
        Some(state.iter().zip(self.c.iter()).map(|(x, c)| x * c).sum())
    }

    /// True if every mode decays.
    pub fn is_stable(&self) -> bool {
        self.noise_gain().is_some()
    }
}

impl PhaseLoop {
    /// The loop as a linear system; its error is oscillator minus truth, of the mean phase or of that at the
    /// start as the discriminator sees it.
    pub fn linear(&self) -> Linear {
        let [k1, k2, k3] = self.gains;
        match self.feedback {
            Feedback::PhaseAndRate => Linear::of(|[phase, rate, acceleration]: [f64; 3], noise| {
                let e = noise - phase;
                let acceleration = acceleration + k3 * e;
                let rate = rate + k2 * e + acceleration;
                ([phase + k1 * e + rate, rate, acceleration], phase)
            }),
            Feedback::Rate { integrator, interval_mean, delay } => {
                Linear::of(|[phase, now, next, rate, acceleration]: [f64; 5], noise| {
                    let error = if interval_mean { phase + 0.5 * now } else { phase };
                    let e = noise - error;
                    let mixed = |before: f64, after: f64| match integrator {
                        Integrator::Forward => before,
                        Integrator::Boxcar => after,
                        Integrator::Bilinear => 0.5 * (before + after),
                    };
                    let faster = acceleration + k3 * e;
                    let gained = rate + mixed(acceleration, faster) + k2 * e;
                    let out = mixed(rate, gained) + k1 * e;
                    ([phase + now, if delay { next } else { out }, out, gained, faster], error)
                })
            }
        }
    }

    /// One-sided noise bandwidth times update time; `None` if unstable.
    pub fn bandwidth_time(&self) -> Option<f64> {
        self.linear().noise_gain().map(|gain| 0.5 * gain)
    }

    /// Loop with a discriminator whose gain is `gain` instead of 1.
    pub fn with_gain(&self, gain: f64) -> Self {
        Self { gains: self.gains.map(|k| k * gain), ..*self }
    }
}

impl FrequencyLoop {
    /// The loop as a linear system: noise is the phase of each prompt in cycles, the error that of the rate
    /// in cycles an interval T. For [`Pairs::Separate`] one step is 2T and noise is the *difference* of the
    /// two phases.
    pub fn linear(&self) -> Linear {
        self.driven(|noise, before| noise - before)
    }

    /// Loop as a linear system, driven by noise that the discriminator's values have beyond the difference of
    /// phases, in cycles.
    pub fn linear_of_discriminator(&self) -> Linear {
        self.driven(|noise, _| noise)
    }

    fn driven(&self, measured: impl Fn(f64, f64) -> f64) -> Linear {
        let [k1, k2] = self.gains;
        // The oscillator runs at the mean rate of the interval: rate and half of what the acceleration adds.
        match self.pairs {
            Pairs::Overlapping => Linear::of(|[rate, acceleration, before, phase]: [f64; 4], noise| {
                let mean = rate + 0.5 * acceleration;
                let f = measured(noise, phase) - 0.5 * (mean + before);
                let acceleration = acceleration + k2 * f;
                ([rate + k1 * f + acceleration, acceleration, mean, noise], mean)
            }),
            Pairs::Separate => Linear::of(|[rate, acceleration]: [f64; 2], noise| {
                let mean = rate + 0.5 * acceleration;
                let f = noise - mean;
                let acceleration = acceleration + k2 * f;
                ([rate + k1 * f + acceleration, acceleration], mean)
            }),
        }
    }
}

impl AssistedLoop {
    /// The loop as a linear system; error and noise are mean phases as for [`PhaseLoop`].
    pub fn linear(&self) -> Linear {
        self.stepped(|phase, _| phase, |noise| [noise, 0.0])
    }

    /// Loop as a linear system, driven by noise that the frequency discriminator has beyond the difference of
    /// phases, in cycles.
    pub fn linear_of_discriminator(&self) -> Linear {
        self.stepped(|phase, _| phase, |noise| [0.0, noise])
    }

    /// Loop as a linear system whose error is that of the rate, in cycles an update.
    pub fn linear_rate(&self) -> Linear {
        self.stepped(|_, rate| rate, |noise| [noise, 0.0])
    }

    /// Loop as a linear system whose error is that of the phase at a `place` from 0, the start of an
    /// interval, to 1, its end.
    pub fn linear_at(&self, place: f64) -> Linear {
        self.stepped(|phase, rate| phase + (place - 0.5) * rate, |noise| [noise, 0.0])
    }

    fn stepped(&self, error: impl Fn(f64, f64) -> f64, drives: impl Fn(f64) -> [f64; 2]) -> Linear {
        let [k1, k2, k3] = self.gains;
        Linear::of(|[start, rate, acceleration, before]: [f64; 4], noise| {
            let ran = rate + 0.5 * acceleration;
            let phase = start + 0.5 * ran;
            let [noise, wrapped] = drives(noise);
            let e = noise - phase;
            let assisted = rate + self.assist * (e - before + wrapped);
            let faster = acceleration + k3 * e;
            let next = assisted + k2 * e + faster;
            // The jump takes the assisted rate for the one that ran.
            let brought = 0.5 * (assisted + 0.5 * acceleration + next + 0.5 * faster);
            ([start + ran + k1 * e + next - brought, next, faster, e], error(phase, ran))
        })
    }
}
