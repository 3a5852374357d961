//! Correlation of a signal with a replica about its peak, and the noise of a code discriminator there.

use crate::expect::followed::Followed;
use crate::expect::theory::dll::{self, Discriminator, Taps};
use crate::waveform::Waveform;
use gnss::signal::Tone;

/// Correlation of a signal with a replica, either or both of them averaged over the sampler's interval, for a
/// code discriminator.
///
/// A polygon is a sum of |x|/2 about its corners, each times the bend there; an average over w adds an
/// integral and a difference of 1/w.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Peak {
    /// Positions in chips, and by how much the slope grows there.
    corners: Vec<(f64, f64)>,
    width_chips: f64,
    averages: u32,
    /// Sub-carrier whose sidebands are tracked together; the corners are then those of its chips. Averages do
    /// not change the sub-carrier.
    sides: Option<Tone>,
}

impl Peak {
    /// Peak of a signal's waveform, averaged so many times over `width_chips`.
    pub fn new(waveform: &Waveform, width_chips: f64, averages: u32) -> Self {
        let chip_s = 1.0 / waveform.chip_rate_hz();
        let corners = waveform.corners().into_iter().map(|(at_s, bend)| (at_s / chip_s, bend * chip_s)).collect();
        Self { corners, width_chips, averages, sides: None }
    }

    /// Peak of chips that a sub-carrier turns, where its sidebands are tracked together.
    pub fn between(self, sides: Option<Tone>) -> Self {
        Self { sides, ..self }
    }

    /// Peak with `gain` times the height.
    pub fn times(mut self, gain: f64) -> Self {
        self.corners.iter_mut().for_each(|(_, bend)| *bend *= gain);
        self
    }

    /// Value at a delay in chips.
    pub fn value(&self, x: f64) -> f64 {
        let w = self.width_chips;
        let sum = |of: &dyn Fn(f64) -> f64| self.corners.iter().map(|(at, bend)| bend * of(x - at)).sum::<f64>();
        let both = self.sides.map_or(1.0, |tone| tone.both_sides(x));
        both * match self.averages {
            0 => sum(&|y| 0.5 * y.abs()),
            // Integrals of |x|/2: x|x|/4 and |x|³/12.
            1 => sum(&|y| (y + 0.5 * w) * (y + 0.5 * w).abs() / 4.0 - (y - 0.5 * w) * (y - 0.5 * w).abs() / 4.0) / w,
            _ => {
                let cube = |y: f64| y.abs() * y * y / 12.0;
                sum(&|y| cube(y + w) - 2.0 * cube(y) + cube(y - w)) / (w * w)
            }
        }
    }

    /// Slope of a discriminator per chip, but for a factor, at a distance of `spacing_chips` from early to
    /// late.
    ///
    /// Early minus late power is divided by the power of early and late, the others by the prompt's.
    pub fn steepness(&self, discriminator: Discriminator, spacing_chips: f64) -> f64 {
        let half = 0.5 * spacing_chips;
        let height = match discriminator {
            Discriminator::EarlyMinusLate => self.value(half),
            Discriminator::DotProduct | Discriminator::DoubleDelta | Discriminator::Coherent => self.value(0.0),
        };
        discriminator.sum(half, |x| self.slope(x)) / height
    }

    /// Minus its slope at a delay, by a difference that errs by 1e-9.
    fn slope(&self, x: f64) -> f64 {
        let h = 1e-4;
        (self.value(x - h) - self.value(x + h)) / (2.0 * h)
    }
}

/// A code's correlation in chips, as sent.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Code {
    peak: Peak,
    /// Delay in chips up to which the correlation falls without rising again.
    pub reach_chips: f64,
}

impl Code {
    /// Code of a signal's waveform.
    pub fn of(waveform: &Waveform) -> Self {
        Self { peak: Peak::new(waveform, 0.0, 0), reach_chips: waveform.reach_s() * waveform.chip_rate_hz() }
    }

    /// Code of the tracked part of a signal.
    pub(super) fn found(followed: &Followed) -> Self {
        let code = Self::of(&followed.found);
        let Some(tone) = followed.sides else { return code };
        // The triangle of the chips bends the first minimum, half a cycle away, by a fiftieth of a chip
        // inwards.
        let half_chips = 1.0 / f64::from(tone.half_cycles.abs().max(1));
        let peak = code.peak.between(Some(tone));
        let fine = |k: u32| half_chips * f64::from(k) / 1000.0;
        let rises = |k: &u32| peak.value(fine(k + 1)) > peak.value(fine(*k));
        let reach_chips = (0..1000).find(rises).map_or(half_chips, fine);
        Self { peak, reach_chips }
    }

    /// Correlation at a delay.
    pub fn value(&self, chips: f64) -> f64 {
        self.peak.value(chips)
    }

    /// Mean square of the error of a discriminator at a distance of `d` chips that another code of N chips
    /// makes, of equal power and phases at random, times N ([`super::beats`]).
    pub(super) fn stray_chips2(&self, discriminator: Discriminator, d: f64) -> f64 {
        let (half, step) = (0.5 * d, 1.0 / 256.0);
        // A chip's correlation ends a chip from its middle; no tap is further than `d`.
        let count = ((1.0 + d) / step).ceil() as i32;
        let apart = |k: i32| {
            let at = step * f64::from(k);
            discriminator.sum(half, |side| self.value(at + side) - self.value(at - side))
        };
        let square: f64 = (-count..=count).map(|k| apart(k) * apart(k) * step).sum();
        let slope = discriminator.sum(half, |side| self.peak.slope(side));
        square / (8.0 * slope * slope)
    }
}

/// Standard deviation of one discriminator value, in chips, for the shapes of signal and noise.
pub(super) fn raw_chips(discriminator: Discriminator, (signal, noise): &(Peak, Peak), d: f64, snr: f64) -> f64 {
    let (peak, power) = (signal.value(0.0), noise.value(0.0));
    let found = |x: f64| [signal.value(x) / peak, signal.slope(x) / peak];
    dll::raw_on_chips(discriminator, Taps::of(discriminator, d, found, |x| noise.value(x) / power), snr)
}

#[cfg(test)]
mod tests {
    use super::*;
    use gnss::gps::l1ca::L1_CA;
    use gnss::signal::Signal;
    use gnss::signal::synthetic::{LONG_BOC, MIXED, QUADRATURE};

    #[test]
    fn peaks_are_the_triangle_without_averages_and_rounded_with_them() {
        let chips = Waveform::of(&L1_CA).unwrap();
        let plain = (Peak::new(&chips, 0.4, 0), Peak::new(&chips, 0.4, 0));
        for discriminator in [Discriminator::EarlyMinusLate, Discriminator::DotProduct, Discriminator::DoubleDelta] {
            for cn0_hz in [1e3, 1e4, 1e5] {
                let known = dll::raw_chips(discriminator, 0.5, 4e-3, cn0_hz);
                let found = raw_chips(discriminator, &plain, 0.5, 4e-3 * cn0_hz);
                assert!((found / known - 1.0).abs() < 1e-9, "{discriminator:?}: {found}, {known}");
            }
        }
        // The mean of a triangle over ±w/2 is 1 − w/4, over a triangle of ±w it is 1 − w/3; far from corners
        // nothing changes.
        for (averages, peak) in [(1, 1.0 - 0.1), (2, 1.0 - 0.4 / 3.0)] {
            let round = Peak::new(&chips, 0.4, averages);
            assert!((round.value(0.0) - peak).abs() < 1e-12, "{}", round.value(0.0));
            assert!((round.value(0.5) - 0.5).abs() < 1e-12 && (round.slope(0.5) - 1.0).abs() < 1e-9);
        }
    }

    #[test]
    fn another_code_moves_early_minus_late_as_two_real_codes_do() {
        // Correlations of C/A codes of PRN 1 with those of 2 to 33 at 1023 lags, chip by chip.
        let own = L1_CA.code(1).unwrap();
        let (mut differences, mut count) = (0.0, 0.0);
        for number in 2..=32 {
            let other = L1_CA.code(number).unwrap();
            let at = |lag: usize| {
                let products = own.iter().enumerate().map(|(k, chip)| i32::from(*chip * other[(k + lag) % 1023]));
                f64::from(products.sum::<i32>()) / 1023.0
            };
            let all: Vec<f64> = (0..1023).map(at).collect();
            for k in 0..1023 {
                // Halves of a chip about each quarter: between whole chips they are joined by lines.
                for quarter in 0..4 {
                    let joined = |x: f64| {
                        let (place, part) = ((k as f64 + x).floor() as usize, (k as f64 + x).fract());
                        (1.0 - part) * all[place % 1023] + part * all[(place + 1) % 1023]
                    };
                    let x = 0.125 + 0.25 * f64::from(quarter);
                    let moved = joined(x + 0.5) - joined(x);
                    (differences, count) = (differences + moved * moved, count + 1.0);
                }
            }
        }
        // A triangle's slopes are one: half of the square is in phase, early less late moves by two a chip.
        let found = 1023.0 * 0.5 * (differences / count) / 4.0;
        let code = Code::of(&Waveform::of(&L1_CA).unwrap());
        // Neighbouring values of these codes differ by a fortieth less than those of a random walk.
        assert!(
            (code.stray_chips2(Discriminator::EarlyMinusLate, 0.5) / found - 1.0).abs() < 0.06,
            "{} {found}",
            code.stray_chips2(Discriminator::EarlyMinusLate, 0.5)
        );
        // At small distances d²/4 and in the rms d/2.
        assert!(
            (code.stray_chips2(Discriminator::EarlyMinusLate, 0.02) / (0.25 * 4e-4) - 1.0).abs() < 0.02,
            "{}",
            code.stray_chips2(Discriminator::EarlyMinusLate, 0.02)
        );
    }

    #[test]
    fn a_steeper_peak_has_less_jitter() {
        let raw = |signal: &Signal, d: f64| {
            let peak = Peak::new(&Waveform::of(signal).unwrap(), 0.0, 0);
            raw_chips(Discriminator::EarlyMinusLate, &(peak.clone(), peak), d, 1e6)
        };
        // With slope s and 1 − ρ = s·d the variance is d/(4·s·snr): s is 1 of BPSK and 3 of BOC(1,1). Of MBOC
        // it is 10/11 · 3 + 1/11 · 23, BOC(6,1) falling by 2·12 − 1 a chip.
        for (signal, slope) in [(&QUADRATURE, 1.0), (&LONG_BOC, 3.0), (&MIXED, 53.0 / 11.0)] {
            let ratio = raw(signal, 0.05) / raw(&L1_CA, 0.05);
            // Squaring at 60 dB, 1e-6; slopes by differences, 1e-9.
            assert!((ratio * ratio * slope - 1.0).abs() < 1e-5, "{signal}: {ratio}");
        }
        // At wide spacings the side peaks cost height: a = 1/4, a' = 3, ρ = −1/2 at half a chip.
        let found = raw(&LONG_BOC, 0.5);
        let expected = 1.5_f64 / (4.0 * 9.0 * 1e6) * (1.0 + 0.5 / (2.0 * 1e6 / 16.0));
        assert!((found / expected.sqrt() - 1.0).abs() < 1e-9, "{found}");
    }
}
