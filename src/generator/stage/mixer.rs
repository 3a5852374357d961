//! Imperfections of a down-converter: oscillator offset and phase noise, imbalance of I and Q, and direct
//! current.
//!
//! Phase noise is that of a synthesiser locked to its reference: flat up to the loop's bandwidth and falling
//! by 20 dB a decade above (a first-order process), known at nodes a twentieth of its time constant apart and
//! linear between them. I and Q: I is taken as reference, Q gets the gain and the phase error (Razavi, RF
//! Microelectronics, 4.2). Limits: noise of the reference itself is the receiver clock's; what is left out of
//! the response is e^−12.

use crate::random::Stream;
use crate::stage::{Block, Stage};
use gnss::facts::{BalanceSpec, StageSpec};
use gnss::time::{Rate, tone_turns};

/// Nodes in a time constant, and time constants of response.
const NODES_PER_TIME: f64 = 20.0;
const RESPONSE_TIMES: f64 = 12.0;
/// Nodes that follow from one another.
const GROUP_NODES: u64 = 1024;

/// Local oscillator with a frequency offset or with noise.
#[derive(Clone, Debug, PartialEq)]
pub struct Oscillator {
    /// Offset in Hz by which the oscillator is tuned too low: carriers lie higher by this offset.
    pub offset_hz: f64,
    /// Phase noise of the oscillator; absent means none.
    pub noise: Option<PhaseNoise>,
    rate: Rate,
}

/// Phase noise of a synthesiser.
#[derive(Clone, Debug, PartialEq)]
pub struct PhaseNoise {
    /// Standard deviation of the phase, in radians.
    pub rms_rad: f64,
    /// Half-power bandwidth of the noise in Hz, that of the synthesiser's loop.
    pub bandwidth_hz: f64,
    spacing: u64,
    response: Vec<f64>,
    /// Factor of the phase that remains from node to node, and size of the added noise.
    keeps: f64,
    gains: f64,
    stream: Stream,
}

impl PhaseNoise {
    /// Creates noise at nodes on a grid of samples.
    pub fn new(rms_rad: f64, bandwidth_hz: f64, rate: Rate, stream: Stream) -> Self {
        let samples_per_time = rate.hz() / (std::f64::consts::TAU * bandwidth_hz);
        let spacing = 1 << ((samples_per_time / NODES_PER_TIME).max(1.0) as u64).ilog2();
        let decay = spacing as f64 / samples_per_time;
        let length = (RESPONSE_TIMES / decay).ceil() as usize;
        // A first-order process from white draws: Σ a^j w with variance 1 / (1 − a²).
        let scale = rms_rad * (-libm::expm1(-2.0 * decay)).sqrt();
        let response = (0..length).map(|j| scale * libm::exp(-decay * j as f64)).collect();
        Self { rms_rad, bandwidth_hz, spacing, response, keeps: libm::exp(-decay), gains: scale, stream }
    }

    /// Phase at nodes `first..first + count`, in rad. Each group of nodes begins with the whole response and
    /// goes on by recursion, so that a node's bits depend on its group alone.
    fn nodes(&self, first: u64, count: usize) -> Vec<f64> {
        let length = self.response.len() as u64;
        let mut nodes = Vec::with_capacity(count + GROUP_NODES as usize);
        let (from, to) = (first / GROUP_NODES, (first + count as u64).div_ceil(GROUP_NODES));
        for group in from..to {
            let start = group * GROUP_NODES;
            // The response reaches back; draws are numbered so that the first one is number 0.
            let mut draws = (start..).map(|draw| self.stream.normals(draw).0);
            let response = self.response.iter().rev();
            let mut phase = draws.by_ref().take(length as usize).zip(response).fold(0.0, |sum, (w, h)| sum + w * h);
            for draw in draws.take(GROUP_NODES as usize) {
                nodes.push(phase);
                phase = self.keeps * phase + self.gains * draw;
            }
        }
        nodes.drain(..(first - from * GROUP_NODES) as usize);
        nodes.truncate(count);
        nodes
    }
}

impl Oscillator {
    /// Creates an oscillator for samples at `rate`, `offset_hz` too low.
    pub fn new(offset_hz: f64, noise: Option<PhaseNoise>, rate: Rate) -> Self {
        Self { offset_hz, noise, rate }
    }
}

impl Stage for Oscillator {
    fn name(&self) -> &'static str {
        "local_oscillator"
    }

    fn spec(&self) -> Option<StageSpec> {
        Some(StageSpec::LocalOscillator { offset_hz: self.offset_hz })
    }

    fn describe(&self) -> String {
        let noise = self.noise.as_ref().map(|n| format!(", noise {} rad within {} Hz", n.rms_rad, n.bandwidth_hz));
        format!("{} Hz off{}", self.offset_hz, noise.unwrap_or_default())
    }

    fn act(&self, block: &mut Block<'_>) {
        let noise = self.noise.as_ref().map(|noise| {
            let first = block.start / noise.spacing;
            (noise.spacing, first, noise.nodes(first, block.i.len() / noise.spacing as usize + 2))
        });
        let step = tone_turns(self.offset_hz, self.rate, 1);
        let mut turns = tone_turns(self.offset_hz, self.rate, block.start);
        for (n, (i, q)) in (block.start..).zip(block.i.iter_mut().zip(block.q.iter_mut())) {
            let mut phase = crate::synth::radians(turns);
            if let Some((spacing, first, nodes)) = &noise {
                let (node, u) = ((n / spacing - first) as usize, (n % spacing) as f64 / *spacing as f64);
                let at = |k: usize| nodes.get(k).copied().unwrap_or(0.0);
                phase += at(node) + (at(node + 1) - at(node)) * u;
            }
            let (sin, cos) = libm::sincosf(phase as f32);
            (*i, *q) = (*i * cos - *q * sin, *i * sin + *q * cos);
            turns = turns.wrapping_add(step);
        }
    }
}

/// Imbalance of I and Q in gain and phase, and their direct current.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Balance {
    /// Amplitude of Q relative to that of I, less one.
    pub gain: f64,
    /// Phase error in radians: 90 degrees minus the angle by which Q lags I.
    pub phase_rad: f64,
    /// Direct current in I, in LSB.
    pub dc_i_lsb: f32,
    /// Direct current in Q, in LSB.
    pub dc_q_lsb: f32,
}

impl Balance {
    /// Power of the image relative to the signal in dB, which a tone leaves at the negative of its frequency.
    pub fn image_db(&self) -> f64 {
        let g = 1.0 + self.gain;
        let cos = libm::cos(self.phase_rad);
        10.0 * libm::log10((1.0 + g * g - 2.0 * g * cos) / (1.0 + g * g + 2.0 * g * cos))
    }
}

impl Stage for Balance {
    fn name(&self) -> &'static str {
        "iq"
    }

    fn describe(&self) -> String {
        let image = if self.gain == 0.0 && self.phase_rad == 0.0 {
            String::new()
        } else {
            format!("image {:.1} dB, ", self.image_db())
        };
        format!("{image}direct current {} and {} LSB", self.dc_i_lsb, self.dc_q_lsb)
    }

    fn spec(&self) -> Option<StageSpec> {
        let (i, q) = (f64::from(self.dc_i_lsb), f64::from(self.dc_q_lsb));
        let unbalanced = self.gain != 0.0 || self.phase_rad != 0.0;
        Some(StageSpec::Iq(BalanceSpec { image_db: unbalanced.then(|| self.image_db()), dc_power_lsb2: i * i + q * q }))
    }

    fn act(&self, block: &mut Block<'_>) {
        let (sin, cos) = libm::sincos(self.phase_rad);
        let (own, other) = (((1.0 + self.gain) * cos) as f32, ((1.0 + self.gain) * sin) as f32);
        for (i, q) in block.i.iter_mut().zip(block.q.iter_mut()) {
            *q = own * *q + other * *i + self.dc_q_lsb;
            *i += self.dc_i_lsb;
        }
    }
}

#[cfg(test)]
mod tests {
    use num_complex::Complex64;

    use super::*;

    fn tone(cycles: f64, length: usize) -> (Vec<f32>, Vec<f32>) {
        (0..length)
            .map(|n| libm::sincos(std::f64::consts::TAU * cycles * n as f64))
            .map(|(sin, cos)| (cos as f32, sin as f32))
            .unzip()
    }

    fn line(i: &[f32], q: &[f32], cycles: f64) -> Complex64 {
        let sum = i.iter().zip(q).enumerate().fold(Complex64::ZERO, |sum, (n, (i, q))| {
            let (sin, cos) = libm::sincos(-std::f64::consts::TAU * cycles * n as f64);
            sum + Complex64::new(f64::from(*i), f64::from(*q)) * Complex64::new(cos, sin)
        });
        sum / i.len() as f64
    }

    #[test]
    fn an_imbalance_leaves_the_image_that_its_formula_says() {
        let balance = Balance { gain: 0.06, phase_rad: 0.05, dc_i_lsb: 0.25, dc_q_lsb: -0.5 };
        let (mut i, mut q) = tone(0.125, 4096);
        balance.act(&mut Block::whole(0, &mut i, &mut q));
        let found = 20.0 * libm::log10(line(&i, &q, -0.125).norm() / line(&i, &q, 0.125).norm());
        // Whole periods in the sum: only rounding, 6e-8 of the tone against an image of 0.04.
        assert!((found - balance.image_db()).abs() < 1e-3, "{found} {}", balance.image_db());
        assert!((line(&i, &q, 0.0) - Complex64::new(0.25, -0.5)).norm() < 1e-6);
    }

    #[test]
    fn phase_noise_has_its_size_and_its_bandwidth() {
        let rate = Rate::from_hz(4e6).unwrap();
        let noise = PhaseNoise::new(0.05, 2000.0, rate, Stream::new(9, "test"));
        let nodes = noise.nodes(0, 400_000);
        let mean_square =
            |lag: usize| nodes.iter().zip(&nodes[lag..]).map(|(a, b)| a * b).sum::<f64>() / (nodes.len() - lag) as f64;
        let time = rate.hz() / (std::f64::consts::TAU * 2000.0 * noise.spacing as f64);
        // 400 000 nodes are 12 000 time constants or more: five sigma of a variance √(2/6000) are 9 %.
        assert!((mean_square(0).sqrt() / 0.05 - 1.0).abs() < 0.05);
        let ratio = mean_square(time.round() as usize) / mean_square(0);
        assert!((ratio - libm::exp(-time.round() / time)).abs() < 0.07, "{ratio}");
    }

    #[test]
    fn an_offset_turns_every_sample_however_the_stream_is_cut() {
        let rate = Rate::from_hz(2.6e6).unwrap();
        let noise = PhaseNoise::new(0.1, 5000.0, rate, Stream::new(1, "lo"));
        let oscillator = Oscillator::new(1234.5, Some(noise), rate);
        let (mut i, mut q) = (vec![1.0; 8192], vec![0.0; 8192]);
        let (mut late_i, mut late_q) = (vec![1.0; 4096], vec![0.0; 4096]);
        oscillator.act(&mut Block::whole(0, &mut i, &mut q));
        oscillator.act(&mut Block::whole(4096, &mut late_i, &mut late_q));
        assert_eq!((&i[4096..], &q[4096..]), (late_i.as_slice(), late_q.as_slice()));
        let clean = Oscillator::new(1234.5, None, rate);
        let (mut i, mut q) = (vec![1.0; 4096], vec![0.0; 4096]);
        clean.act(&mut Block::whole(0, &mut i, &mut q));
        let expected = libm::sincos(std::f64::consts::TAU * 1234.5 * 4000.0 / 2.6e6);
        // A phase below π in single precision: 2e-7.
        assert!((f64::from(i[4000]) - expected.1).abs() < 5e-7 && (f64::from(q[4000]) - expected.0).abs() < 5e-7);
    }
}
