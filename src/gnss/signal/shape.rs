//! Correlation function and spectrum of a component, from its pulses.
//!
//! Chips count as random and independent, so that only a chip's own waveform correlates. The waveform is
//! constant over the steps of a chip, so its correlation is a polygon with a corner at each step, and the
//! spectrum is exact too (J. W. Betz, "Binary offset carrier modulations for radionavigation", Navigation
//! 48(4), 2001, eq. 3 and 4). What lines a short code has, filters and samplers are left out: an ideal signal
//! of unlimited bandwidth.

use std::f64::consts::{PI, TAU};

use num_complex::Complex64;

use super::Layer;

/// Correlation and spectrum of a waveform of unit power.
#[derive(Clone, Debug, PartialEq)]
pub struct Shape {
    step_s: f64,
    /// Correlation at whole steps from 0 on; zero at the last, which is one chip.
    lags: Vec<f64>,
}

impl Shape {
    /// Cross correlation of a waveform of `sent` layers with one of `made` layers, where the code is not
    /// zero. It is the in-phase part, averaged over delays of both signs. [`Self::density`] is then that of
    /// the cross spectrum.
    pub fn between(sent: &[Layer], made: &[Layer], chip_rate_hz: f64) -> Self {
        let both = || sent.iter().chain(made);
        let steps = both().fold(1, |all, layer| super::least_common_multiple(all, layer.pulse.len().max(1)));
        let kinds = both().fold(1, |all, layer| super::least_common_multiple(all, layer.chips.len().max(1)));
        let mut lags = vec![0.0; steps + 1];
        for kind in 0..kinds {
            let (sent, made) = (chip(sent, kind, steps), chip(made, kind, steps));
            for (lag, sum) in lags.iter_mut().enumerate() {
                let product = |ahead: &[Complex64], behind: &[Complex64]| {
                    let pairs = ahead.iter().skip(lag).zip(behind);
                    pairs.map(|(ahead, behind)| (ahead * behind.conj()).re).sum::<f64>()
                };
                *sum += 0.5 * (product(&sent, &made) + product(&made, &sent));
            }
        }
        lags.iter_mut().for_each(|sum| *sum /= (kinds * steps) as f64);
        Self { step_s: 1.0 / (chip_rate_hz * steps as f64), lags }
    }

    /// Correlation of the waveform with itself at a delay of `delay_s`; 1 at zero delay.
    pub fn correlation(&self, delay_s: f64) -> f64 {
        let at = delay_s.abs() / self.step_s;
        let lag = at as usize;
        let value = |lag: usize| self.lags.get(lag).copied().unwrap_or(0.0);
        let share = at - lag as f64;
        value(lag) + share * (value(lag + 1) - value(lag))
    }

    /// Power density in 1/Hz at `hz` from the carrier, for unit power.
    pub fn density(&self, hz: f64) -> f64 {
        let (first, rest) = self.lags.split_first().unwrap_or((&0.0, &[]));
        let turn = TAU * hz * self.step_s;
        let correlated = (1..).zip(rest).filter(|(_, value)| **value != 0.0);
        let sum: f64 = correlated.map(|(lag, value)| value * libm::cos(turn * f64::from(lag))).sum();
        self.step_s * sinc_squared(hz * self.step_s) * (first + 2.0 * sum)
    }

    /// Duration in seconds of a step, the distance of the correlation's corners.
    pub fn step_s(&self) -> f64 {
        self.step_s
    }

    /// Duration of a chip, beyond which nothing correlates.
    pub fn chip_s(&self) -> f64 {
        self.step_s * self.lags.len().saturating_sub(1) as f64
    }
}

/// The steps of chip `index` with all layers.
pub(super) fn chip(layers: &[Layer], index: usize, steps: usize) -> Vec<Complex64> {
    let mut wave = vec![Complex64::ZERO; steps];
    for layer in layers.iter().filter(|layer| layer.covers(index)) {
        let amplitude = phasor(TAU * layer.phase_cycles) * layer.weight;
        let each = steps / layer.pulse.len().max(1);
        let signs = layer.pulse.iter().flat_map(|&sign| std::iter::repeat_n(f64::from(sign), each));
        wave.iter_mut().zip(signs).for_each(|(step, sign)| *step += amplitude * sign);
    }
    wave
}

/// Kinds of chips that layers form, each as its waveform in equal steps, turned by the layers' phases. The
/// second list gives the kind of each chip, from the beginning of a code period on and repeated.
pub fn chip_kinds(layers: &[Layer]) -> (Vec<Vec<Complex64>>, Vec<usize>) {
    let common = |of: fn(&Layer) -> usize| {
        layers.iter().fold(1, |all, layer| super::least_common_multiple(all, of(layer).max(1)))
    };
    let (steps, pattern) = (common(|layer| layer.pulse.len()), common(|layer| layer.chips.len()));
    let mut kinds: Vec<Vec<Complex64>> = Vec::new();
    let mut kind = |index: usize| {
        let wave = chip(layers, index, steps);
        kinds.iter().position(|known| *known == wave).unwrap_or_else(|| {
            kinds.push(wave);
            kinds.len() - 1
        })
    };
    let pattern = (0..pattern).map(&mut kind).collect();
    (kinds, pattern)
}

/// e^{jx} of an angle in radians.
pub fn phasor(radians: f64) -> Complex64 {
    let (sin, cos) = libm::sincos(radians);
    Complex64::new(cos, sin)
}

/// sin πx / πx.
pub fn sinc(x: f64) -> f64 {
    let angle = PI * x;
    if angle.abs() < 1e-9 { 1.0 } else { libm::sin(angle) / angle }
}

/// (sin πx / πx)².
pub fn sinc_squared(x: f64) -> f64 {
    let sinc = sinc(x);
    sinc * sinc
}

#[cfg(test)]
mod tests {
    use super::super::{Component, SecondaryCode};
    use super::*;

    const CHIP_S: f64 = 1.0 / 1.023e6;

    fn shape(layers: &'static [Layer]) -> Shape {
        let component = Component {
            power_share: 1.0,
            phase_cycles: 0.0,
            chip_rate_hz: 1.023e6,
            code_chips: 4092,
            code: &|_| None,
            layers,
            secondary_code: SecondaryCode::None,
            message: None,
        };
        component.shape()
    }

    /// √(10/11) and √(1/11) (Galileo OS SIS ICD 2.1, 2.3.3), √(29/33) and √(4/33) of chips (IS-GPS-800J,
    /// 3.3).
    const A: f64 = 0.953_462_589_245_592_4;
    const B: f64 = 0.301_511_344_577_763_6;
    static CBOC_PLUS: [Layer; 2] = [Layer { weight: A, ..Layer::BOC11 }, Layer { weight: B, ..Layer::BOC61 }];
    static CBOC_MINUS: [Layer; 2] = [Layer { weight: A, ..Layer::BOC11 }, Layer { weight: -B, ..Layer::BOC61 }];
    static QUADRATURE: [Layer; 2] =
        [Layer { weight: A, ..Layer::BOC11 }, Layer { weight: B, phase_cycles: 0.25, ..Layer::BOC61 }];
    const SIX: [bool; 33] = {
        let mut chips = [false; 33];
        (chips[0], chips[4], chips[6], chips[29]) = (true, true, true, true);
        chips
    };
    const ONE: [bool; 33] = {
        let mut chips = [true; 33];
        (chips[0], chips[4], chips[6], chips[29]) = (false, false, false, false);
        chips
    };
    static TMBOC: [Layer; 2] = [Layer { chips: &ONE, ..Layer::BOC11 }, Layer { chips: &SIX, ..Layer::BOC61 }];

    /// Sine-phased BOC(m, n) with 2m/n even, as printed (Betz 2001, eq. 12).
    fn boc(hz: f64, m: f64) -> f64 {
        let half_s = CHIP_S / (2.0 * m);
        let wave = libm::tan(PI * hz * half_s) * libm::sin(PI * hz * CHIP_S) / (PI * hz);
        wave * wave / CHIP_S
    }

    #[test]
    fn spectra_are_the_printed_ones() {
        let shapes = [
            shape(&[Layer::BPSK]),
            shape(&[Layer::BOC11]),
            shape(&[Layer::BOC61]),
            shape(&CBOC_PLUS),
            shape(&CBOC_MINUS),
            shape(&TMBOC),
            shape(&QUADRATURE),
        ];
        for k in 1..400 {
            let hz = 17_300.0 * f64::from(k) + 1.0;
            let [bpsk, one, six, plus, minus, time, quadrature] = shapes.each_ref().map(|shape| shape.density(hz));
            let near = |found: f64, printed: f64, what: &str| {
                // Rounding of thirteen cosines, and of a tangent near its poles.
                assert!((found - printed).abs() < 1e-9 * CHIP_S, "{what} at {hz} Hz: {found} for {printed}");
            };
            near(bpsk, CHIP_S * sinc_squared(hz * CHIP_S), "BPSK");
            near(one, boc(hz, 1.0), "BOC(1,1)");
            near(six, boc(hz, 6.0), "BOC(6,1)");
            // MBOC is the mean of both components of E1; TMBOC has 4 of 33 chips, so 29/33 and 4/33; layers
            // at right angles do not interfere.
            near(0.5 * (plus + minus), 10.0 / 11.0 * boc(hz, 1.0) + boc(hz, 6.0) / 11.0, "MBOC");
            near(time, 29.0 / 33.0 * boc(hz, 1.0) + 4.0 / 33.0 * boc(hz, 6.0), "TMBOC");
            near(quadrature, 10.0 / 11.0 * boc(hz, 1.0) + boc(hz, 6.0) / 11.0, "QMBOC");
        }
    }

    #[test]
    fn correlations_are_the_printed_ones_and_the_spectrum_is_their_transform() {
        let one = shape(&[Layer::BOC11]);
        // BOC(1,1): 1 − 3|τ| to half a chip, then −(1 − |τ|).
        for (delay_chips, expected) in [(0.0, 1.0), (0.25, 0.25), (0.5, -0.5), (0.75, -0.25), (1.0, 0.0), (1.5, 0.0)] {
            assert!((one.correlation(delay_chips * CHIP_S) - expected).abs() < 1e-12, "{delay_chips}");
            assert_eq!(one.correlation(-delay_chips * CHIP_S), one.correlation(delay_chips * CHIP_S));
        }
        // The slope at the peak is steeper where BOC(6,1) is subtracted: its cross term is 2ab·(R16 + R61).
        for shape in [shape(&CBOC_PLUS), shape(&CBOC_MINUS), shape(&TMBOC), one] {
            for hz in [0.3e6, 1.1e6, 5.9e6] {
                let steps = 40_000;
                let h = shape.chip_s() / f64::from(steps);
                let sum: f64 = (0..steps)
                    .map(|k| (f64::from(k) + 0.5) * h)
                    .map(|delay_s| 2.0 * h * shape.correlation(delay_s) * libm::cos(TAU * hz * delay_s))
                    .sum();
                // Midpoints of a polygon times a cosine: h²/24 of the second derivative.
                assert!((sum - shape.density(hz)).abs() < 1e-7 * CHIP_S, "{hz}");
            }
        }
    }
}
