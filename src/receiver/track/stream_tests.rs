//! A satellite's samples at speed, for tests that need hours of them: from integrals of its waveform, so that
//! each sample is the exact mean over its interval.

use std::f64::consts::TAU;

use num_complex::Complex64;
use statrs::distribution::{ContinuousCDF, Normal as Gauss};

use crate::lead::lead;
use crate::source::Block;
use gnss::samples::{Format, IfMetadata};
use gnss::signal::{Component, Layer, Link};
use gnss::time::Rate;

/// Uniform numbers (SplitMix64).
pub(super) struct Random(pub u64);

impl Random {
    pub fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// Uniform number in (0, 1).
    pub fn uniform(&mut self) -> f64 {
        ((self.bits() >> 11) as f64 + 0.5) / 9_007_199_254_740_992.0
    }

    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.uniform()
    }
}

/// The normal distribution in 65 536 equally probable values of unit variance: a correlation adds thousands
/// of them.
struct Noise {
    values: Vec<f32>,
    random: Random,
}

impl Noise {
    fn new(seed: u64) -> Self {
        let gauss = Gauss::new(0.0, 1.0).unwrap();
        let values: Vec<f64> = (0..65_536).map(|k| gauss.inverse_cdf((f64::from(k) + 0.5) / 65_536.0)).collect();
        let deviation = (values.iter().map(|x| x * x).sum::<f64>() / 65_536.0).sqrt();
        Self { values: values.into_iter().map(|x| (x / deviation) as f32).collect(), random: Random(seed) }
    }

    /// Adds independent values of a variance of one half to both.
    fn add(&mut self, i: &mut [f32], q: &mut [f32]) {
        let half = 0.5_f32.sqrt();
        for (i, q) in i.chunks_mut(2).zip(q.chunks_mut(2)) {
            let mut bits = self.random.bits();
            for value in i.iter_mut().chain(q) {
                *value += half * self.values[(bits & 0xffff) as usize];
                bits >>= 16;
            }
        }
    }
}

/// The integral of a component's waveform over a code period.
struct Integral {
    component: &'static Component,
    secondary_code: Vec<i8>,
    phasor: Complex64,
    steps: f64,
    sums: Vec<f64>,
    /// Code periods of a symbol, where symbols are sent.
    symbol_periods: Option<i64>,
}

/// The random symbol of that number.
pub(super) fn symbol(number: i64) -> f64 {
    if Random(number as u64).bits() & 1 == 1 { -1.0 } else { 1.0 }
}

impl Integral {
    /// Integrals of the layers in phase or antiphase and, where there are any, of the layers in quadrature.
    fn all(component: &'static Component, number: u8) -> impl Iterator<Item = Self> {
        let quarters = |layer: &Layer| 4.0 * layer.phase_cycles;
        assert!(component.layers.iter().all(|layer| quarters(layer).fract() == 0.0));
        let turned = component.layers.iter().any(|layer| quarters(layer) % 2.0 != 0.0);
        let both = [Some(false), turned.then_some(true)];
        both.into_iter().flatten().map(move |turned| Self::new(component, number, turned))
    }

    fn new(component: &'static Component, number: u8, turned: bool) -> Self {
        let (code, steps) = ((component.code)(number).unwrap(), component.steps_per_chip());
        let duty = code.iter().filter(|chip| **chip != 0).count() as f64 / code.len() as f64;
        let turn_cycles = if turned { 0.25 } else { 0.0 };
        let weight = |layer: &Layer| match (4.0 * (layer.phase_cycles - turn_cycles)).rem_euclid(4.0) {
            0.0 => layer.weight,
            2.0 => -layer.weight,
            _ => 0.0,
        };
        let mut sums = vec![0.0];
        for (index, &chip) in code.iter().enumerate() {
            let layers = || component.layers.iter().filter(|layer| layer.covers(index));
            for step in 0..steps {
                let value: f64 = layers()
                    .map(|layer| weight(layer) * f64::from(layer.pulse[step * layer.pulse.len() / steps]))
                    .sum();
                sums.push(sums[sums.len() - 1] + value * f64::from(chip) / steps as f64);
            }
        }
        let (sin, cos) = libm::sincos(TAU * (component.phase_cycles + turn_cycles));
        let phasor = Complex64::new(cos, sin) * (component.power_share / duty).sqrt();
        // What carries a small share of the power and has no secondary code are data: a symbol a period.
        let symbol_periods = (component.power_share < 0.3 && component.secondary_code.periods() == 1).then_some(1);
        let secondary_code = component.secondary_code.of(number).unwrap();
        Self { component, secondary_code, phasor, steps: steps as f64, sums, symbol_periods }
    }

    fn sign(&self, period: i64) -> f64 {
        let chip = f64::from(self.secondary_code[period.rem_euclid(self.secondary_code.len() as i64) as usize]);
        self.symbol_periods.map_or(chip, |periods| chip * symbol(period.div_euclid(periods)))
    }

    /// Adds the means over samples to `sum`, the first of which begins `begin_chips` after an epoch of the
    /// code.
    fn add(&self, begin_chips: f64, step_chips: f64, gain: Complex64, sum: &mut [Complex64]) {
        let length = f64::from(self.component.code_chips);
        let mut period = (begin_chips / length).floor();
        let mut at = (begin_chips - period * length) * self.steps;
        let (end, step) = (length * self.steps, step_chips * self.steps);
        let value = |at: f64| {
            let index = at as usize;
            let share = at - index as f64;
            self.sums[index] + share * (self.sums.get(index + 1).copied().unwrap_or_default() - self.sums[index])
        };
        let whole = self.sums[self.sums.len() - 1];
        let (mut sign, mut before) = (self.sign(period as i64), value(at));
        let scale = self.phasor * gain / step_chips;
        for sample in sum {
            at += step;
            let mut mean = -sign * before;
            if at >= end {
                mean += sign * whole;
                at -= end;
                period += 1.0;
                sign = self.sign(period as i64);
            }
            before = value(at);
            mean += sign * before;
            *sample += scale * mean;
        }
    }
}

/// An echo of everything that is sent.
#[derive(Clone, Copy, Debug)]
pub(super) struct Echo {
    pub delay_s: f64,
    pub amplitude: f64,
    pub phase_cycles: f64,
}

/// One satellite's signal with a constant Doppler that code and carrier share, in white noise of unit power.
pub(super) struct Stream {
    pub link: Link,
    pub rate_hz: f64,
    pub doppler_hz: f64,
    /// Satellite clock at sample 0, in seconds since an epoch at which all codes begin.
    pub sent_s: f64,
    /// C/N0 of the whole signal in dB-Hz, before averaging over samples.
    pub cn0_dbhz: f64,
    pub echo: Option<Echo>,
    components: Vec<Integral>,
    noise: Noise,
    next: u64,
    samples: (Vec<f32>, Vec<f32>),
    sum: Vec<Complex64>,
}

/// Intermediate frequency over the sample rate.
const IF_SHARE: f64 = 0.07;

impl Stream {
    pub fn new(link: Link, rate_hz: f64, seed: u64) -> Self {
        let components = link.signal.components.iter().flat_map(|c| Integral::all(c, link.sv.number)).collect();
        Self {
            link,
            rate_hz,
            doppler_hz: 0.0,
            sent_s: 0.0,
            cn0_dbhz: 45.0,
            echo: None,
            components,
            noise: Noise::new(seed),
            next: 0,
            samples: (Vec::new(), Vec::new()),
            sum: Vec::new(),
        }
    }

    /// Sends random symbols on the components that have a message.
    pub fn send_symbols(&mut self) {
        for integral in &mut self.components {
            let periods = integral.component.periods_per_symbol().map(i64::from);
            integral.symbol_periods = periods.or(integral.symbol_periods);
        }
    }

    /// Sends random bits under a code of a symbol a code period.
    pub fn send_bits(&mut self, signs: &[i8]) {
        for integral in &mut self.components {
            (integral.secondary_code, integral.symbol_periods) = (signs.to_vec(), Some(signs.len() as i64));
        }
    }

    /// Adds the components' means over `sum.len()` samples from number `first` on.
    fn waveform(&self, first: u64, sum: &mut [Complex64]) {
        let dilation = 1.0 + self.doppler_hz / self.link.carrier_hz();
        // Samples are means over the interval around their instant.
        let sent_s = self.sent_s + (first as f64 - 0.5) / self.rate_hz * dilation;
        for integral in &self.components {
            let chip_hz = integral.component.chip_rate_hz;
            let step_chips = chip_hz * dilation / self.rate_hz;
            integral.add(sent_s * chip_hz, step_chips, Complex64::ONE, sum);
            if let Some(echo) = self.echo {
                let (sin, cos) = libm::sincos(TAU * echo.phase_cycles);
                let gain = Complex64::new(cos, sin) * echo.amplitude;
                integral.add((sent_s - echo.delay_s) * chip_hz, step_chips, gain, sum);
            }
        }
    }

    /// Mean power of samples over that of what they are means of, over 50 ms.
    pub fn power(&self) -> f64 {
        let mut sum = vec![Complex64::ZERO; (0.05 * self.rate_hz) as usize];
        self.waveform(0, &mut sum);
        sum.iter().map(Complex64::norm_sqr).sum::<f64>() / sum.len() as f64
    }

    pub fn metadata(&self) -> IfMetadata {
        let rate = Rate::from_hz(self.rate_hz).unwrap();
        let center_hz = self.link.carrier_hz() - IF_SHARE * self.rate_hz;
        IfMetadata { format: Format::Cf32Le, rate, center_hz, inverted: false, start: None }
    }

    /// Number of the sample that comes next.
    pub fn now(&self) -> u64 {
        self.next
    }

    /// The next `length` samples.
    pub fn block(&mut self, length: usize) -> Block<'_> {
        let (first, begin_s) = (self.next, self.next as f64 / self.rate_hz);
        let mut sum = std::mem::take(&mut self.sum);
        sum.clear();
        sum.resize(length, Complex64::ZERO);
        self.waveform(first, &mut sum);
        self.sum = sum;
        let amplitude = (libm::pow(10.0, 0.1 * self.cn0_dbhz) / self.rate_hz).sqrt();
        let phasor = |cycles: f64| {
            let (sin, cos) = libm::sincos(TAU * (cycles - cycles.floor()));
            Complex64::new(cos, sin)
        };
        let if_cycles = (IF_SHARE * first as f64).fract();
        let mut carrier = phasor(if_cycles + self.cycles(begin_s)) * amplitude;
        let turn = phasor(IF_SHARE + self.doppler_hz / self.rate_hz);
        let (i, q) = &mut self.samples;
        i.clear();
        q.clear();
        for sum in &self.sum {
            let sample = sum * carrier;
            i.push(sample.re as f32);
            q.push(sample.im as f32);
            carrier *= turn;
        }
        self.noise.add(i, q);
        self.next += length as u64;
        Block { first, i, q }
    }

    /// Carrier cycles by Doppler at a time, and the phase at zero.
    pub fn cycles(&self, t_s: f64) -> f64 {
        0.2 + self.doppler_hz * t_s
    }

    /// Chips that the code of the leading component has run since its epoch when sample `n` is taken.
    pub fn chips(&self, n: f64) -> f64 {
        let dilation = 1.0 + self.doppler_hz / self.link.carrier_hz();
        (self.sent_s + n / self.rate_hz * dilation) * lead(self.link.signal).unwrap().chip_rate_hz
    }

    /// Code error of a phase at a sample, within half a period.
    pub fn code_error_chips(&self, n: u64, phase_chips: f64) -> f64 {
        let length = f64::from(lead(self.link.signal).unwrap().code_chips);
        (phase_chips - self.chips(n as f64) + 0.5 * length).rem_euclid(length) - 0.5 * length
    }
}

#[test]
fn noise_has_unit_power() {
    use gnss::satellite::Sv;
    use gnss::signal::synthetic::MIXED;
    let mut stream = Stream::new(MIXED.link(Sv { system: MIXED.system, number: 2 }), 5.3e6, 3);
    stream.cn0_dbhz = -200.0;
    let block = stream.block(200_000);
    let power = block.i.iter().chain(block.q).map(|x| f64::from(x * x)).sum::<f64>() / 200_000.0;
    assert!((power - 1.0).abs() < 5.0 / 200_000_f64.sqrt(), "{power}");
}
