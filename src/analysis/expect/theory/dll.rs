//! Thermal jitter of code loops, and what a normalised discriminator does to their gain.
//!
//! `d` is the full spacing from early to late in chips, C/N0 in hertz, T the coherent integration. Sources:
//! Kaplan and Hegarty, Understanding GPS 2nd ed., eq. 5.22 and 5.23; Betz and Kolodziejski 2009. B is the
//! one-sided noise bandwidth of the discrete loop, so the factor (1−½·B·T) of continuous updates is left out.
//! White noise, no multipath.

use std::iter::Sum;
use std::ops::Mul;

use gnss::discriminator::CodeDiscriminator;
use gnss::signal::sinc_squared;

/// A code discriminator, by its noise.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Discriminator {
    /// Non-coherent early minus late power.
    EarlyMinusLate,
    /// (early − late)·prompt.
    DotProduct,
    /// Dot product of two pairs, the outer one twice as far apart and half as heavy.
    DoubleDelta,
    /// Coherent early minus late.
    Coherent,
}

impl From<CodeDiscriminator> for Discriminator {
    fn from(of_receiver: CodeDiscriminator) -> Self {
        match of_receiver {
            CodeDiscriminator::EarlyMinusLate => Self::EarlyMinusLate,
            CodeDiscriminator::DotProduct => Self::DotProduct,
            CodeDiscriminator::DoubleDelta => Self::DoubleDelta,
        }
    }
}

impl Discriminator {
    /// Discriminator by the name that a receiver's settings have for it; `None` of another name.
    pub fn named(name: &str) -> Option<Self> {
        CodeDiscriminator::named(name).map(Self::from)
    }

    /// Weighted sum of what `difference` gives for each pair of taps, which are so many chips from the
    /// prompt; `half` is half the distance of early and late.
    pub fn sum<T: Sum<T> + Mul<f64, Output = T>>(self, half: f64, difference: impl Fn(f64) -> T) -> T {
        let of = match self {
            Self::DoubleDelta => CodeDiscriminator::DoubleDelta,
            Self::EarlyMinusLate | Self::DotProduct | Self::Coherent => CodeDiscriminator::DotProduct,
        };
        of.pairs().iter().map(|(apart, weight)| difference(apart * half) * *weight).sum()
    }
}

/// Squaring loss of a discriminator on a triangle, added to 1.
fn squaring(discriminator: Discriminator, d: f64, snr: f64) -> f64 {
    match discriminator {
        Discriminator::EarlyMinusLate => 2.0 / ((2.0 - d) * snr),
        Discriminator::DotProduct | Discriminator::DoubleDelta => 1.0 / snr,
        Discriminator::Coherent => 0.0,
    }
}

/// Standard deviation of one discriminator value, in chips, unlimited bandwidth (eq. 5.23 first branch,
/// without the loop). Of the double delta, for `d` up to ½: half the slope, and half the variance.
pub fn raw_chips(discriminator: Discriminator, d: f64, t_s: f64, cn0_hz: f64) -> f64 {
    let snr = t_s * cn0_hz;
    let spread = if discriminator == Discriminator::DoubleDelta { 2.0 * d } else { d };
    (spread / (planted!("analysis.theory.dll", 4.0, 2.0) * snr) * (1.0 + squaring(discriminator, d, snr))).sqrt()
}

/// Correlation of a code at early and late, relative to 1 at the prompt.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Taps {
    /// Height of the correlation there.
    pub height: f64,
    /// Slope of early minus late at zero error, per chip.
    pub slope: f64,
    /// Correlation of the noise of early and late.
    pub common: f64,
}

impl Taps {
    /// Taps of a discriminator `d` chips apart. `found` gives height and slope, positive where it falls, of
    /// the signal's correlation at an offset over the height of its peak, and `own` the correlation of noise.
    ///
    /// With weights 1 and w of two pairs slopes add as the weights say, and the variance of the sum is
    /// 1 − ρ(d) + w²·(1 − ρ(2d)) + 2w·(ρ(d/2) − ρ(3d/2)) where that of one pair is 1 − ρ(d).
    pub fn of(discriminator: Discriminator, d: f64, found: impl Fn(f64) -> [f64; 2], own: impl Fn(f64) -> f64) -> Self {
        let (half, rho) = (0.5 * d, own(d));
        let [height, _] = found(half);
        let slope = discriminator.sum(half, |x| found(x)[1]);
        if discriminator != Discriminator::DoubleDelta {
            return Self { height, slope, common: rho };
        }
        let variance = 1.0 - rho + 0.25 * (1.0 - own(2.0 * d)) - (own(half) - own(3.0 * half));
        Self { height, slope, common: 1.0 - variance }
    }
}

/// Standard deviation of one discriminator value, in chips, on a correlation of any shape.
///
/// With a and a′ height and slope and ρ the noise in common, (1−ρ)/(4·snr·a′²) times 1 plus the squaring
/// loss: (1+ρ)/(2·snr·a²) of early minus late power, 1/snr of the dot products. Betz and Kolodziejski 2009,
/// their integrals written as the correlations that they are.
pub fn raw_on_chips(discriminator: Discriminator, taps: Taps, snr: f64) -> f64 {
    let Taps { height, slope, common } = taps;
    let squaring = match discriminator {
        Discriminator::EarlyMinusLate => (1.0 + common) / (2.0 * snr * height * height),
        Discriminator::DotProduct | Discriminator::DoubleDelta => 1.0 / snr,
        Discriminator::Coherent => 0.0,
    };
    ((1.0 - common) / (4.0 * snr * slope * slope) * (1.0 + squaring)).sqrt()
}

/// Closed-loop jitter in chips, unlimited bandwidth (eq. 5.23 first branch).
pub fn jitter_chips(discriminator: Discriminator, d: f64, bandwidth_hz: f64, t_s: f64, cn0_hz: f64) -> f64 {
    raw_chips(discriminator, d, t_s, cn0_hz) * (2.0 * bandwidth_hz * t_s).sqrt()
}

/// Early minus late, front end of `band` chip rates two-sided: all three branches of eq. 5.23.
pub fn jitter_banded_chips(d: f64, band: f64, bandwidth_hz: f64, t_s: f64, cn0_hz: f64) -> f64 {
    let snr = t_s * cn0_hz;
    let pi = std::f64::consts::PI;
    let (spread, squaring) = if d >= pi / band {
        (d, 2.0 / ((2.0 - d) * snr))
    } else if d > 1.0 / band {
        let over = d - 1.0 / band;
        (1.0 / band + band / (pi - 1.0) * over * over, 2.0 / ((2.0 - d) * snr))
    } else {
        (1.0 / band, 1.0 / snr)
    };
    (bandwidth_hz / (2.0 * cn0_hz) * spread * (1.0 + squaring)).sqrt()
}

/// Integrals of a code's spectrum over a rectangular front end, for eq. 5.22. Frequencies in chip rates.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BandIntegrals {
    /// Integral ∫S·sin²(πfd) over ±band/2.
    sin2: f64,
    /// Integral ∫f·S·sin(πfd) over ±band/2.
    slope: f64,
    /// Integral ∫S·cos²(πfd) over ±band/2.
    cos2: f64,
    /// Integral ∫S·cos(πfd) over ±band/2.
    cos: f64,
    /// Integral ∫f²·S over ±band/2.
    gabor: f64,
}

/// Intervals of the integrals in one lobe of spectrum or discriminator; Simpson's rule then errs by less than
/// 1e-9.
const INTERVALS_PER_LOBE: f64 = 64.0;

impl BandIntegrals {
    /// Integrals for rectangular chips, S = sinc²(f), as in [`Self::of`].
    pub fn rectangular(d: f64, band: f64) -> Self {
        Self::of(sinc_squared, d, band)
    }

    /// Integrals for a spectrum of unit area over all frequencies (so C/N0 is that before the filter). Its
    /// lobes are a chip rate wide, and `band` is the two-sided bandwidth in chip rates.
    pub fn of(spectrum: impl Fn(f64) -> f64, d: f64, band: f64) -> Self {
        let pi = std::f64::consts::PI;
        let intervals = 2.0 * (0.5 * INTERVALS_PER_LOBE * (0.5 * band + 1.0) * (1.0 + d)).ceil();
        let step = 0.5 * band / intervals;
        let mut sums = [0.0; 5];
        for k in 0..=intervals as u64 {
            let f = k as f64 * step;
            let weight = if k == 0 || k == intervals as u64 { 1.0 } else { 2.0 + 2.0 * (k % 2) as f64 };
            let (s, (sin, cos)) = (spectrum(f), libm::sincos(pi * f * d));
            let terms = [s * sin * sin, f * s * sin, s * cos * cos, s * cos, f * f * s];
            sums.iter_mut().zip(terms).for_each(|(sum, term)| *sum += weight * term);
        }
        // Both sides of the spectrum; every integrand is even.
        let [sin2, slope, cos2, cos, gabor] = sums.map(|sum| 2.0 * sum * step / 3.0);
        Self { sin2, slope, cos2, cos, gabor }
    }

    /// Closed-loop jitter in chips, eq. 5.22: coherent, or non-coherent early minus late.
    ///
    /// `None` for the dot products, which that equation does not cover.
    pub fn jitter_chips(&self, discriminator: Discriminator, bandwidth_hz: f64, t_s: f64, cn0_hz: f64) -> Option<f64> {
        let squaring = match discriminator {
            Discriminator::Coherent => 0.0,
            Discriminator::EarlyMinusLate => self.cos2 / (t_s * cn0_hz * self.cos * self.cos),
            Discriminator::DotProduct | Discriminator::DoubleDelta => return None,
        };
        let turn = std::f64::consts::TAU * self.slope;
        Some((bandwidth_hz * self.sin2 / (turn * turn * cn0_hz) * (1.0 + squaring)).sqrt())
    }

    /// Least jitter of any discriminator, in chips (Betz and Kolodziejski): the spacing's limit to zero.
    pub fn bound_chips(&self, bandwidth_hz: f64, cn0_hz: f64) -> f64 {
        let turn = std::f64::consts::TAU;
        (bandwidth_hz / (turn * turn * cn0_hz * self.gabor)).sqrt()
    }
}

/// Mean gain of a self-normalised discriminator on a triangle, noise in its denominator.
///
/// (E−L)·P*/|P|²: 1−e^(−snr). (|E|²−|L|²)/(|E|²+|L|²): about 1−d/((1−d/2)²·snr), exactly
/// x·∫[(1−u)/(1−(1−r)u)]²·e^(−xu)du from 0 to 1 with x = snr·(1−d/2), r = d/(2−d), for d up to 1. The loop's
/// gains shrink by it where a receiver does not give it back. The form 1/(1+1/((1−d/2)²·snr)) holds at d = 1
/// only.
pub fn normalised_gain(discriminator: Discriminator, d: f64, t_s: f64, cn0_hz: f64) -> f64 {
    let snr = t_s * cn0_hz;
    match discriminator {
        Discriminator::Coherent => 1.0,
        Discriminator::DotProduct | Discriminator::DoubleDelta => -libm::expm1(-snr),
        Discriminator::EarlyMinusLate => {
            let (x, r) = (snr * (1.0 - 0.5 * d), d / (2.0 - d));
            // Midpoints of equal steps of e^(−xu): the weight is then uniform.
            let share = -libm::expm1(-x) / f64::from(MIDPOINTS);
            let term = |k: u32| {
                let u = -libm::log1p(-(f64::from(k) + 0.5) * share) / x;
                let quotient = (1.0 - u) / (1.0 - u + r * u);
                quotient * quotient * share
            };
            (0..MIDPOINTS).map(term).sum()
        }
    }
}

/// Midpoints of the gain's integral, which then errs by less than 1e-4.
const MIDPOINTS: u32 = 4096;

/// Rule-of-thumb limit of jitter alone: d/6 chips (3σ within ±d/2).
pub fn threshold_chips(d: f64) -> f64 {
    d / 6.0
}

/// True if 3σ and the dynamic error stay within the discriminator's linear range, ±d/2 (Kaplan and Hegarty,
/// eq. 5.24).
pub fn holds(jitter_chips: f64, stress_chips: f64, d: f64) -> bool {
    3.0 * jitter_chips + stress_chips.abs() <= 0.5 * d
}

/// Least C/N0 in dB-Hz at which the early-minus-late jitter is d/6: the positive root of the quadratic in
/// 1/(C/N0).
pub fn least_cn0_dbhz(d: f64, bandwidth_hz: f64, t_s: f64) -> f64 {
    // σ² = a·x·(1 + s·x), x = 1/(C/N0).
    let (a, s) = (0.5 * bandwidth_hz * d, 2.0 / ((2.0 - d) * t_s));
    let variance = threshold_chips(d) * threshold_chips(d);
    let x = ((1.0 + 4.0 * s * variance / a).sqrt() - 1.0) / (2.0 * s);
    -10.0 * libm::log10(x)
}
