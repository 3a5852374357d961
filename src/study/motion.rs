//! The truth that modelled loops follow: motion along the line of sight and the receiver's oscillator, in
//! carrier cycles.
//!
//! Motion is a polynomial of third order between steps and exact. The oscillator's white and random-walk
//! frequency are exact at the ends of a period (two-state model, Zucca and Tavella 2005) and their mean over
//! it is that of the ends; flicker is a bank of first-order processes with poles a factor of 4 apart, within
//! 1 % of 1/f inside their span.

use super::normal::{Normals, Purpose};
use analysis::expect::theory::clock::PowerLaw;

/// A change of the motion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Step {
    /// Applied at the first code period that begins at or after it.
    pub at_s: f64,
    /// Added to the Doppler rate.
    pub rate_step_hz_s: f64,
    /// Rate of the Doppler rate from here on.
    pub jerk_hz_s2: f64,
}

/// Motion along the line of sight, as Doppler.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Motion {
    /// Doppler at the start, Hz.
    pub doppler_hz: f64,
    /// Rate of the Doppler at the start, Hz/s.
    pub rate_hz_s: f64,
    /// Steps in the order of time.
    pub steps: Vec<Step>,
}

/// Motion of the carrier in one code period.
#[derive(Clone, Copy, Debug)]
pub(super) struct Advance {
    /// Phase at the end of the period, from that at the start, cycles.
    pub(super) cycles: f64,
    /// Mean phase over the period, from that at the start, cycles.
    pub(super) mean_cycles: f64,
}

/// Number of poles of the flicker bank, the highest at half the rate of periods.
const FLICKER_POLES: usize = 14;
/// Ratio of one pole to the one before.
const FLICKER_RATIO: f64 = 4.0;

/// An oscillator's fractional frequency, times the carrier.
struct Oscillator {
    normals: Normals,
    /// Random-walk part of the frequency, Hz, and the deviations that correlate phase and frequency.
    walk_hz: f64,
    phase_cycles: f64,
    from_walk: f64,
    walk: f64,
    /// State, decay a period and drive of each flicker process, Hz.
    flicker: [(f64, f64, f64); FLICKER_POLES],
}

impl Oscillator {
    fn new(noise: &PowerLaw, carrier_hz: f64, period_s: f64, seed: u64) -> Self {
        let mut normals = Normals::new(seed, Purpose::Oscillator);
        // Spectral intensities of the frequency's white part and of the walk's drive, h₀/2 and 2π²h₋₂ (Zucca
        // and Tavella).
        let (white, drive) = (0.5 * noise.h[2], 2.0 * std::f64::consts::PI.powi(2) * noise.h[4]);
        let walk = (drive * period_s).sqrt();
        let from_walk = 0.5 * period_s * walk;
        let phase = (white * period_s + drive * period_s.powi(3) / 3.0 - from_walk * from_walk).max(0.0).sqrt();
        // Poles p a factor r apart, each of variance h₋₁·ln r, add up to h₋₁/f: ∫ (2/π)/(p(1+(f/p)²)) d ln p
        // = 1/f.
        let sigma_hz = carrier_hz * (noise.h[3] * libm::log(FLICKER_RATIO)).sqrt();
        let mut pole_hz = 0.5 / period_s;
        let flicker = std::array::from_fn(|_| {
            let decay = libm::exp(-std::f64::consts::TAU * pole_hz * period_s);
            pole_hz /= FLICKER_RATIO;
            (sigma_hz * normals.next().re, decay, sigma_hz * (1.0 - decay * decay).sqrt())
        });
        Self {
            normals,
            walk_hz: 0.0,
            phase_cycles: carrier_hz * phase,
            from_walk: carrier_hz * from_walk,
            walk: carrier_hz * walk,
            flicker,
        }
    }

    /// Phase gained in a period, in cycles.
    fn advance(&mut self, period_s: f64) -> f64 {
        let draw = self.normals.next();
        let mut cycles = self.walk_hz * period_s + self.from_walk * draw.im + self.phase_cycles * draw.re;
        self.walk_hz += self.walk * draw.im;
        for pair in self.flicker.chunks_mut(2) {
            let draw = self.normals.next();
            for ((state, decay, drive), normal) in pair.iter_mut().zip([draw.re, draw.im]) {
                cycles += *state * period_s;
                *state = *state * *decay + *drive * normal;
            }
        }
        cycles
    }
}

/// Motion and oscillator, period after period.
pub(super) struct Truth<'a> {
    period_s: f64,
    period: u64,
    doppler_hz: f64,
    rate_hz_s: f64,
    jerk_hz_s2: f64,
    steps: &'a [Step],
    oscillator: Option<Oscillator>,
}

impl<'a> Truth<'a> {
    pub(super) fn new(
        motion: &'a Motion,
        oscillator: Option<&PowerLaw>,
        carrier_hz: f64,
        period_s: f64,
        seed: u64,
    ) -> Self {
        Self {
            period_s,
            period: 0,
            doppler_hz: motion.doppler_hz,
            rate_hz_s: motion.rate_hz_s,
            jerk_hz_s2: 0.0,
            steps: &motion.steps,
            oscillator: oscillator.map(|noise| Oscillator::new(noise, carrier_hz, period_s, seed)),
        }
    }

    /// Moves on by one code period.
    pub(super) fn advance(&mut self) -> Advance {
        let t = self.period_s;
        while let Some((step, rest)) = self.steps.split_first()
            && self.period as f64 * t >= step.at_s
        {
            self.rate_hz_s += step.rate_step_hz_s;
            self.jerk_hz_s2 = step.jerk_hz_s2;
            self.steps = rest;
        }
        let (f, a, j) = (self.doppler_hz, self.rate_hz_s, self.jerk_hz_s2);
        let mut advance = Advance {
            cycles: t * (f + t * (a / 2.0 + t * j / 6.0)),
            mean_cycles: t * (f / 2.0 + t * (a / 6.0 + t * j / 24.0)),
        };
        if let Some(oscillator) = &mut self.oscillator {
            let cycles = oscillator.advance(t);
            advance.cycles += cycles;
            advance.mean_cycles += 0.5 * cycles;
        }
        self.doppler_hz += t * (a + 0.5 * t * j);
        self.rate_hz_s += t * j;
        self.period += 1;
        advance
    }
}
