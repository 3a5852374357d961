//! Linear Gauss–Markov processes of (phase, frequency), as parts of a power-law clock noise.
//!
//! White and random-walk frequency noise are such processes exactly; flicker is a sum of first-order ones
//! whose time constants are a factor of four apart, which leaves a ripple of 2 sech(π²/ln 4) = 0.3 % on
//! 1/f. Each is stepped without error over any interval, and a path between two known ends is drawn by
//! correcting a free path by what it misses at its end (Doucet 2010), so that any segment can be made without
//! the ones before it.

use crate::random::Stream;

/// Phase in s and fractional frequency.
pub type State = [f64; 2];

/// Gauss–Markov process whose output is its phase.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Process {
    /// Phase that walks; `level` is its variance per second, h0 / 2.
    WhiteFrequency {
        /// Variance per second.
        level: f64,
    },
    /// Frequency that walks; `level` is its variance per second, 2 π² h−2.
    FrequencyWalk {
        /// Variance per second.
        level: f64,
    },
    /// Frequency that returns to zero; stationary `variance`.
    Frequency {
        /// Stationary variance.
        variance: f64,
        /// Time after which its autocorrelation is 1/e.
        tau_s: f64,
    },
    /// Phase that returns to zero; stationary `variance` in s².
    Phase {
        /// Stationary variance in s².
        variance: f64,
        /// Time after which its autocorrelation is 1/e.
        tau_s: f64,
    },
}

/// Covariance of the increment of a process over an interval.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Covariance {
    xx: f64,
    xy: f64,
    yy: f64,
}

/// A matrix by rows.
type Matrix = [[f64; 2]; 2];

impl Process {
    /// Returns the state at the beginning.
    pub fn begin(self, (a, _): (f64, f64)) -> State {
        match self {
            Self::WhiteFrequency { .. } | Self::FrequencyWalk { .. } => [0.0, 0.0],
            Self::Frequency { variance, .. } => [0.0, variance.sqrt() * a],
            Self::Phase { variance, .. } => [variance.sqrt() * a, 0.0],
        }
    }

    fn transition(self, dt_s: f64) -> Matrix {
        match self {
            Self::WhiteFrequency { .. } | Self::FrequencyWalk { .. } => [[1.0, dt_s], [0.0, 1.0]],
            Self::Frequency { tau_s, .. } => {
                let gone = -libm::expm1(-dt_s / tau_s);
                [[1.0, tau_s * gone], [0.0, 1.0 - gone]]
            }
            Self::Phase { tau_s, .. } => [[libm::exp(-dt_s / tau_s), 0.0], [0.0, 1.0]],
        }
    }

    fn gained(self, dt_s: f64) -> Covariance {
        match self {
            Self::WhiteFrequency { level } => Covariance { xx: level * dt_s, xy: 0.0, yy: 0.0 },
            Self::FrequencyWalk { level } => {
                Covariance { xx: level * dt_s * dt_s * dt_s / 3.0, xy: level * dt_s * dt_s / 2.0, yy: level * dt_s }
            }
            Self::Frequency { variance, tau_s } => {
                let u = dt_s / tau_s;
                let gone = -libm::expm1(-u);
                Covariance {
                    xx: variance * tau_s * tau_s * integrated(u),
                    xy: variance * tau_s * gone * gone,
                    yy: -variance * libm::expm1(-2.0 * u),
                }
            }
            Self::Phase { variance, tau_s } => {
                Covariance { xx: -variance * libm::expm1(-2.0 * dt_s / tau_s), xy: 0.0, yy: 0.0 }
            }
        }
    }

    /// Computes the step of the process over `dt_s`.
    pub fn step(self, dt_s: f64) -> Step {
        let Covariance { xx, xy, yy } = self.gained(dt_s);
        let slope = if yy > 0.0 { xy / yy } else { 0.0 };
        let own = (xx - slope * xy).max(0.0).sqrt();
        Step { transition: self.transition(dt_s), frequency: yy.sqrt(), slope, own }
    }

    /// Gain matrices of a path of `steps` steps of `dt_s`: the response at each step to a change of the
    /// path's end.
    pub fn bridge(self, dt_s: f64, steps: usize) -> Vec<Matrix> {
        let whole = self.gained(dt_s * steps as f64);
        let inverse = inverse(whole);
        (0..=steps)
            .map(|k| {
                let Covariance { xx, xy, yy } = self.gained(dt_s * k as f64);
                let rest = self.transition(dt_s * (steps - k) as f64);
                // P(k) Φ(N − k)ᵀ P(N)⁻¹
                let transposed = [[rest[0][0], rest[1][0]], [rest[0][1], rest[1][1]]];
                product(product([[xx, xy], [xy, yy]], transposed), inverse)
            })
            .collect()
    }
}

/// 2u − 3 + 4 e^−u − e^−2u, without cancellation for small u: relative error below 1e-8.
fn integrated(u: f64) -> f64 {
    if u > 0.1 {
        let a = libm::exp(-u);
        return 2.0 * u - 3.0 + 4.0 * a - a * a;
    }
    // The series' coefficients are (−1)^n (4 − 2^n) / n!.
    let series = [2.0 / 3.0, -0.5, 7.0 / 30.0, -1.0 / 12.0, 124.0 / 5040.0, -252.0 / 40_320.0];
    u * u * u * series.iter().rev().fold(0.0, |sum, c| sum * u + c)
}

/// The inverse, on the states that the process has.
fn inverse(Covariance { xx, xy, yy }: Covariance) -> Matrix {
    if yy == 0.0 {
        return [[1.0 / xx, 0.0], [0.0, 0.0]];
    }
    let determinant = xx * yy - xy * xy;
    [[yy / determinant, -xy / determinant], [-xy / determinant, xx / determinant]]
}

fn product(a: Matrix, b: Matrix) -> Matrix {
    let at = |i: usize, j: usize| a[i][0] * b[0][j] + a[i][1] * b[1][j];
    [[at(0, 0), at(0, 1)], [at(1, 0), at(1, 1)]]
}

/// `matrix · state`.
pub fn apply(matrix: &Matrix, [x, y]: State) -> State {
    [matrix[0][0] * x + matrix[0][1] * y, matrix[1][0] * x + matrix[1][1] * y]
}

/// Step of fixed length.
#[derive(Clone, Copy, Debug)]
pub struct Step {
    transition: Matrix,
    /// Standard deviation of the frequency increment.
    frequency: f64,
    slope: f64,
    own: f64,
}

impl Step {
    /// Returns the state a step later, with two standard normals as input.
    pub fn take(&self, state: State, (a, b): (f64, f64)) -> State {
        let [x, y] = apply(&self.transition, state);
        let gained = self.frequency * a;
        [x + self.slope * gained + self.own * b, y + gained]
    }
}

/// Process in coarse steps, each with a path of fine ones between its ends.
#[derive(Clone, Debug)]
pub struct Track {
    process: Process,
    coarse: Step,
    fine: Step,
    bridge: Vec<Matrix>,
    /// Random numbers of coarse steps and of fine ones.
    ends: Stream,
    paths: Stream,
}

impl Track {
    /// Creates the track of `process` with `steps` fine steps of `dt_s` in a coarse one.
    pub fn new(process: Process, dt_s: f64, steps: usize, stream: Stream) -> Self {
        Self {
            process,
            coarse: process.step(dt_s * steps as f64),
            fine: process.step(dt_s),
            bridge: process.bridge(dt_s, steps),
            ends: stream.part(0),
            paths: stream.part(1),
        }
    }

    /// Returns the state before the first step.
    pub fn begin(&self) -> State {
        self.process.begin(self.ends.normals(0))
    }

    /// Returns the state at the end of coarse step `cell` from that at its beginning.
    pub fn next(&self, state: State, cell: u64) -> State {
        self.coarse.take(state, self.ends.normals(cell + 1))
    }

    /// Adds the phase at each fine node of coarse step `cell`, first and last one included, to `phase_s`.
    pub fn path(&self, cell: u64, from: State, to: State, phase_s: &mut [f64]) {
        let steps = self.bridge.len() as u64 - 1;
        let mut free = Vec::with_capacity(self.bridge.len());
        let mut state = from;
        free.push(state);
        for k in 0..steps {
            state = self.fine.take(state, self.paths.normals(cell * steps + k));
            free.push(state);
        }
        let missed = [to[0] - state[0], to[1] - state[1]];
        for ((sum, free), gain) in phase_s.iter_mut().zip(&free).zip(&self.bridge) {
            *sum += free[0] + apply(gain, missed)[0];
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ALL: [Process; 4] = [
        Process::WhiteFrequency { level: 2.0 },
        Process::FrequencyWalk { level: 3.0 },
        Process::Frequency { variance: 1.5, tau_s: 4.0 },
        Process::Phase { variance: 0.7, tau_s: 2.0 },
    ];

    #[test]
    fn two_steps_gain_what_one_of_their_sum_does() {
        for process in ALL {
            for (a, b) in [(0.3, 0.5), (1e-3, 2.0), (1e-7, 3e-7)] {
                let (first, second, both) = (process.gained(a), process.gained(b), process.gained(a + b));
                let phi = process.transition(b);
                let moved = product(
                    product(phi, [[first.xx, first.xy], [first.xy, first.yy]]),
                    [[phi[0][0], phi[1][0]], [phi[0][1], phi[1][1]]],
                );
                // The series of the integrated process leaves 1e-8.
                let close = |x: f64, y: f64| (x - y).abs() <= 2e-8 * y.abs();
                assert!(close(moved[0][0] + second.xx, both.xx), "{process:?} {a} {b}");
                assert!(close(moved[0][1] + second.xy, both.xy) && close(moved[1][1] + second.yy, both.yy));
            }
        }
    }

    #[test]
    fn a_path_ends_where_it_must_and_spreads_between_as_a_bridge_does() {
        const STEPS: usize = 16;
        const PATHS: u64 = 20_000;
        for process in ALL {
            let track = Track::new(process, 0.25, STEPS, Stream::new(7, "bridge"));
            let (from, to) = ([0.0, 0.0], [0.0, 0.0]);
            let mut squares = [0.0; STEPS + 1];
            for cell in 0..PATHS {
                let mut phase = [0.0; STEPS + 1];
                track.path(cell, from, to, &mut phase);
                squares.iter_mut().zip(phase).for_each(|(sum, x)| *sum += x * x);
            }
            assert!(squares[0] == 0.0 && squares[STEPS] < 1e-20 * PATHS as f64);
            // Conditional variance in the middle: P(k) − P(k) Φᵀ P(N)⁻¹ Φ P(k), here by its scalar closed
            // forms.
            let t = 4.0_f64;
            let expected = match process {
                Process::WhiteFrequency { level } => level * t / 4.0,
                // A bridge of the integrated walk with both ends' frequency held: level t³ / 192.
                Process::FrequencyWalk { level } => level * t * t * t / 192.0,
                Process::Phase { variance, tau_s } => variance * libm::tanh(0.5 * t / tau_s),
                Process::Frequency { .. } => continue,
            };
            let found = squares[STEPS / 2] / PATHS as f64;
            // Five sigma of a variance: 5 √(2 / n).
            assert!((found / expected - 1.0).abs() < 0.05, "{process:?}: {found} {expected}");
        }
    }
}
