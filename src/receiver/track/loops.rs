//! Tracking loops in the discrete domain: gains with an exact noise bandwidth, the step of a loop, discriminators.
//!
//! Gains put every closed-loop root at one place p (Stephens and Thomas, controlled-root formulation):
//! order 1: K1 = 1−p; 2: K1 = 1−p², K2 = (1−p)²; 3: K1 = 1−p³, K2 = (1−p)²(1+2p), K3 = (1−p)³. The state is corrected
//! in phase and rate at each update, without further delay, and is the mean phase of the coming interval; then
//! the one-sided noise bandwidth is exact and the loop is stable for every p in (0, 1). Steady error of order 3 under
//! constant jerk: jerk·T³/K3.

use num_complex::Complex64;

/// Gains of a loop; those beyond its order are zero.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gains {
    pub phase: f64,
    pub rate: f64,
    pub acceleration: f64,
}

/// One-sided noise bandwidth times update time of a loop of order 1 to 3 with all roots at `root`.
///
/// The error's transfer function is ((z−1)/(z−p))^N, so B·T = (mean of its squared modulus − 1)/2, a sum of the
/// integrals of 1/(1+p²−2p cos)^m.
pub fn bandwidth_time(order: u32, root: f64) -> f64 {
    let (p2, q) = (root * root, (1.0 - root) * (1.0 - root));
    let (a, s) = (1.0 + p2, 1.0 - p2);
    let integrals = [1.0, 1.0 / s, a / (s * s * s), (a * a + 2.0 * p2) / (s * s * s * s * s)];
    let binomials: [f64; 4] = match order {
        1 => [1.0, 1.0, 0.0, 0.0],
        2 => [1.0, 2.0, 1.0, 0.0],
        _ => [1.0, 3.0, 3.0, 1.0],
    };
    let (mut sum, mut power) = (0.0, 1.0);
    for (binomial, integral) in binomials.into_iter().zip(integrals) {
        sum += binomial * power * integral;
        power *= -q;
    }
    let scale: f64 = (0..order.clamp(1, 3)).map(|_| root).product();
    0.5 * (sum / scale - 1.0)
}

impl Gains {
    /// Gains of a loop of order 1 to 3 whose one-sided noise bandwidth times update time is `product`.
    ///
    /// The root is searched in (0, 1); products beyond the largest possible (0.5, 2.5, 9.5 for orders 1 to 3)
    /// give the largest.
    pub fn design(order: u32, product: f64) -> Self {
        let (mut low, mut high) = (0.0_f64, 1.0_f64);
        for _ in 0..80 {
            let middle = 0.5 * (low + high);
            if bandwidth_time(order, middle) > product { low = middle } else { high = middle }
        }
        Self::of_root(order, 0.5 * (low + high))
    }

    /// Gains with all roots at `p`.
    pub fn of_root(order: u32, p: f64) -> Self {
        let d = 1.0 - p;
        match order {
            1 => Self { phase: d, rate: 0.0, acceleration: 0.0 },
            2 => Self { phase: 1.0 - p * p, rate: d * d, acceleration: 0.0 },
            _ => Self { phase: 1.0 - p * p * p, rate: d * d * (1.0 + 2.0 * p), acceleration: d * d * d },
        }
    }
}

/// What a loop knows besides its phase.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Rates {
    /// Rate at the boundary where the running interval began, in units a second.
    pub rate: f64,
    /// Units a second².
    pub acceleration: f64,
}

impl Rates {
    /// Mean rate of an interval of `t_s` that begins at the boundary: what its NCO runs at.
    pub fn mean(&self, t_s: f64) -> f64 {
        self.rate + 0.5 * self.acceleration * t_s
    }
}

/// One update: the error `e` (units) averaged over an interval of `t_s` that has just ended, in which the NCO ran at
/// `rates.mean(t_s)`. Returns the rates for the next interval and the jump of the NCO's phase at the boundary.
pub fn step(gains: &Gains, rates: &Rates, e: f64, t_s: f64) -> (Rates, f64) {
    let acceleration = rates.acceleration + gains.acceleration * e / (t_s * t_s);
    let next = Rates { rate: rates.rate + gains.rate * e / t_s + acceleration * t_s, acceleration };
    // The mean phases of the two intervals differ by K1·e + rate; the two half intervals already bring their share.
    let brought = 0.5 * (rates.mean(t_s) + next.mean(t_s)) * t_s;
    (next, gains.phase * e + next.rate * t_s - brought)
}

/// One update of a frequency loop of order 1 or 2: `f` is the measured frequency error.
pub fn frequency_step(gains: &Gains, rates: &Rates, f: f64, t_s: f64) -> Rates {
    let acceleration = rates.acceleration + gains.rate * f / t_s;
    Rates { rate: rates.rate + gains.phase * f + acceleration * t_s, acceleration }
}

/// Phase error in cycles from a prompt with data: ±¼, blind to the data's sign.
pub fn costas(prompt: Complex64) -> f64 {
    if prompt.re == 0.0 {
        return 0.0;
    }
    libm::atan(prompt.im / prompt.re) / std::f64::consts::TAU
}

/// Phase error in cycles from a prompt without data: ±½.
pub fn phase(prompt: Complex64) -> f64 {
    libm::atan2(prompt.im, prompt.re) / std::f64::consts::TAU
}

/// Frequency error in hertz from two successive prompts `t_s` apart, for a pair that may straddle a bit edge: ±1/(4T).
pub fn frequency_two_quadrant(before: Complex64, after: Complex64, t_s: f64) -> f64 {
    let product = after * before.conj();
    costas(product) / t_s
}

/// Frequency error in hertz from two successive prompts of one symbol: ±1/(2T).
pub fn frequency_four_quadrant(before: Complex64, after: Complex64, t_s: f64) -> f64 {
    phase(after * before.conj()) / t_s
}

/// Shape of the correlation at early and late, relative to that at the prompt.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CodeShape {
    /// R(d/2)/R(0).
    pub value: f64,
    /// −R'(d/2)/R(0), per chip.
    pub slope: f64,
}

impl CodeShape {
    /// The triangle of unlimited bandwidth at a spacing `d` chips.
    pub fn triangle(d: f64) -> Self {
        Self { value: 1.0 - 0.5 * d, slope: 1.0 }
    }
}

/// Code error in chips: (|E|²−|L|²)/(|E|²+|L|²), scaled by its slope at zero, 2·slope/value (4/(2−d) for the triangle).
///
/// Noise adds to the denominator, so the mean gain falls to 1/(1+1/(value²·T·C/N0)); `snr` = T·C/N0 of the prompts gives
/// it back (infinite: no correction). Positive when the received code is ahead of the replica.
pub fn early_minus_late(early: Complex64, late: Complex64, shape: &CodeShape, snr: f64) -> f64 {
    let (e, l) = (early.norm_sqr(), late.norm_sqr());
    if e + l <= 0.0 {
        return 0.0;
    }
    let gain = 1.0 / (1.0 + 1.0 / (shape.value * shape.value * snr));
    (e - l) / (e + l) * shape.value / (2.0 * shape.slope) / gain
}

/// Code error in chips: Re((E−L)·P*)/|P|², scaled by 2·slope; the gain falls to 1/(1+1/(T·C/N0)) and is given back.
pub fn dot_product(early: Complex64, prompt: Complex64, late: Complex64, shape: &CodeShape, snr: f64) -> f64 {
    let power = prompt.norm_sqr();
    if power <= 0.0 {
        return 0.0;
    }
    let gain = 1.0 / (1.0 + 1.0 / snr);
    ((early - late) * prompt.conj()).re / power / (2.0 * shape.slope) / gain
}

#[cfg(test)]
#[path = "loops_tests.rs"]
mod tests;
