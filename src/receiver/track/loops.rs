//! Tracking loops in the discrete domain: gains with an exact noise bandwidth, the step of a loop,
//! discriminators.
//!
//! Gains put every closed-loop root at one position p (Stephens and Thomas, controlled-root formulation):
//! order 1: K1 = 1−p; 2: K1 = 1−p², K2 = (1−p)²; 3: K1 = 1−p³, K2 = (1−p)²(1+2p), K3 = (1−p)³. The state is
//! corrected in phase and rate at each update, without further delay, and is the mean phase of the coming
//! interval; then the one-sided noise bandwidth is exact and the loop is stable for every p in (0, 1). Steady
//! error of order 3 under constant jerk: jerk·T³/K3.

use gnss::discriminator::CodeDiscriminator;
use num_complex::Complex64;

/// Gains of a loop; those beyond its order are zero.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gains {
    /// Gain of the phase.
    pub phase: f64,
    /// Gain of the rate.
    pub rate: f64,
    /// Gain of the acceleration.
    pub acceleration: f64,
}

/// One-sided noise bandwidth times update time of a loop of order 1 to 3 with all roots at `root`.
///
/// The error's transfer function is ((z−1)/(z−p))^N, so B·T = (mean of its squared modulus − 1)/2, a sum of
/// the integrals of 1/(1+p²−2p cos)^m.
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

/// Rates that a loop estimates besides its phase.
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

/// One update: the error `e` (units) averaged over an interval of `t_s` that has just ended, in which the NCO
/// ran at `rates.mean(t_s)`. Returns the rates for the next interval and the jump of the NCO's phase at the
/// boundary.
pub fn step(gains: &Gains, rates: &Rates, e: f64, t_s: f64) -> (Rates, f64) {
    let acceleration = rates.acceleration + gains.acceleration * e / (t_s * t_s);
    let next = Rates { rate: rates.rate + gains.rate * e / t_s + acceleration * t_s, acceleration };
    // The mean phases of the two intervals differ by K1·e + rate; the two half intervals already bring their
    // share.
    let brought = 0.5 * (rates.mean(t_s) + next.mean(t_s)) * t_s;
    (next, gains.phase * e + next.rate * t_s - planted!("receiver.loops.step", brought, 0.99 * brought))
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
    planted!("receiver.loops.costas_gain", 1.0, 1.4) * libm::atan(prompt.im / prompt.re) / std::f64::consts::TAU
}

/// Phase error in cycles from a prompt without data: ±½.
pub fn phase(prompt: Complex64) -> f64 {
    libm::atan2(prompt.im, prompt.re) / std::f64::consts::TAU
}

/// Frequency error in hertz from two successive prompts `t_s` apart, for a pair that may straddle a bit edge:
/// ±1/(4T).
pub fn frequency_two_quadrant(before: Complex64, after: Complex64, t_s: f64) -> f64 {
    let product = planted!("receiver.loops.frequency_sign", after * before.conj(), before * after.conj());
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
    /// R(d)/R(0), which is also the correlation of the noise of early and late.
    pub common: f64,
}

impl CodeShape {
    /// The triangle of unlimited bandwidth at a spacing `d` chips.
    pub fn triangle(d: f64) -> Self {
        Self { value: 1.0 - 0.5 * d, slope: 1.0, common: (1.0 - d).max(0.0) }
    }

    /// Shape for a discriminator with `spacing_chips` from early to late, on a correlation whose value and
    /// slope a chip are `found` and which the noise of two taps has as `own`, both over offsets in chips.
    ///
    /// Several pairs count as one of the slope of their weighted sum, with as much noise in common as leaves
    /// the sum its variance: 2·(1 − common) of a tap's.
    pub fn of(
        discriminator: CodeDiscriminator,
        spacing_chips: f64,
        found: impl Fn(f64) -> (f64, f64),
        own: impl Fn(f64) -> f64,
    ) -> Self {
        let (half, (peak, _), power) = (0.5 * spacing_chips, found(0.0), own(0.0));
        let pairs = discriminator.pairs();
        let slope: f64 = pairs.iter().map(|(apart, weight)| weight * found(apart * half).1).sum();
        let crossed = |(a, v): &(f64, f64), (b, w): &(f64, f64)| v * w * (own((a - b) * half) - own((a + b) * half));
        let outer = pairs.iter().skip(1);
        let more: f64 =
            outer.map(|pair| crossed(pair, pair) + pairs.first().map_or(0.0, |first| 2.0 * crossed(first, pair))).sum();
        Self { value: found(half).0 / peak, slope: -slope / peak, common: own(spacing_chips) / power - more / power }
    }

    /// Mean gain of [`early_minus_late`] at a T·C/N0 of the prompts.
    ///
    /// Sum and difference of early and late are independent, so with 1/x = ∫e^(−xt)dt the mean of the
    /// quotient is x·∫₀¹[(1−u)/(1−(1−r)u)]²·e^(−xu)du, x = 2·snr·value²/(1+common), r =
    /// (1−common)/(1+common): about 1−2r/x.
    pub fn early_minus_late_gain(&self, snr: f64) -> f64 {
        let x = 2.0 * snr * self.value * self.value / (1.0 + self.common);
        let r = (1.0 - self.common) / (1.0 + self.common);
        // Beyond e⁻⁴⁰ nothing is left; Simpson's rule then errs by less than 1e-5.
        let step = f64::min(1.0, 40.0 / x) / f64::from(INTERVALS);
        let sum: f64 = (0..=INTERVALS)
            .map(|k| {
                let u = f64::from(k) * step;
                let quotient = if u < 1.0 { (1.0 - u) / (1.0 - u + r * u) } else { 0.0 };
                let weight = if k == 0 || k == INTERVALS { 1.0 } else { f64::from(2 + 2 * (k % 2)) };
                weight * quotient * quotient * libm::exp(-x * u)
            })
            .sum();
        x * sum * step / 3.0
    }
}

/// Intervals of the gain's integral.
const INTERVALS: u32 = 256;

/// Mean gain of [`dot_product`] at a T·C/N0 of the prompts: 1−e^(−snr), the mean of Re(P)/|P|² of a complex
/// Gaussian.
pub fn dot_product_gain(snr: f64) -> f64 {
    -libm::expm1(-snr)
}

/// The gain of a code discriminator over T·C/N0 from 1 (below, that of 1) to 2²⁰ (beyond, one): a table whose
/// entries are made when they are first needed.
#[derive(Clone, Debug)]
pub struct CodeGain {
    shape: CodeShape,
    gain: fn(&CodeShape, f64) -> f64,
    table: Vec<Option<f64>>,
}

/// Entries of the table per octave: interpolation errs by less than 1e-3.
const ENTRIES: f64 = 4.0;
/// Number of octaves.
const OCTAVES: f64 = 20.0;

impl CodeGain {
    /// A table of that gain for the shape.
    pub fn new(shape: CodeShape, gain: fn(&CodeShape, f64) -> f64) -> Self {
        Self { shape, gain, table: vec![None; (ENTRIES * OCTAVES) as usize + 1] }
    }

    /// The gain at T·C/N0.
    pub fn at(&mut self, snr: f64) -> f64 {
        let x = ENTRIES * libm::log2(snr.max(1.0));
        let (below, part) = (x.min(ENTRIES * OCTAVES) as usize, x - x.floor());
        let (Some(a), Some(b)) = (self.entry(below), self.entry(below + 1)) else { return 1.0 };
        a + (b - a) * part
    }

    /// `None` beyond the table.
    fn entry(&mut self, number: usize) -> Option<f64> {
        let Self { shape, gain, table } = self;
        let of = || gain(shape, libm::exp2(number as f64 / ENTRIES));
        table.get_mut(number).map(|entry| *entry.get_or_insert_with(of))
    }
}

/// Code error in chips: (|E|²−|L|²)/(|E|²+|L|²), scaled by its slope at zero, 2·slope/value (4/(2−d) for the
/// triangle).
///
/// Noise in the denominator lowers the mean gain to `gain` ([`CodeShape::early_minus_late_gain`]), which is
/// given back. Positive when the received code is ahead of the replica.
pub fn early_minus_late(early: Complex64, late: Complex64, shape: &CodeShape, gain: f64) -> f64 {
    let (e, l) = (early.norm_sqr(), late.norm_sqr());
    if e + l <= 0.0 {
        return 0.0;
    }
    planted!("receiver.loops.code_gain", e - l, 1.5 * (e - l)) / (e + l) * shape.value / (2.0 * shape.slope * gain)
}

/// Code error in chips: Re((E−L)·P*)/|P|², scaled by 2·slope; `gain` is that of [`dot_product_gain`].
pub fn dot_product(early: Complex64, prompt: Complex64, late: Complex64, shape: &CodeShape, gain: f64) -> f64 {
    let power = prompt.norm_sqr();
    if power <= 0.0 {
        return 0.0;
    }
    ((early - late) * prompt.conj()).re / power / (2.0 * shape.slope * gain)
}

#[cfg(test)]
#[path = "loops_tests.rs"]
mod tests;
