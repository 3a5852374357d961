//! Numbered streams of Gaussian and of random symbols: pure functions of seed, purpose and index.
//!
//! The generator's noise kernel fills a block at a time (within 6.77 σ, libm's values within 3e-7).

use num_complex::Complex64;

use generator::synth::noise::{BLOCK_SAMPLES, add_block};

/// Purpose of a stream, so that one seed gives independent streams.
#[derive(Clone, Copy, Debug)]
pub(super) enum Purpose {
    Thermal = 1,
    Oscillator = 2,
    Symbols = 3,
    Places = 4,
    Columns = 5,
}

/// SplitMix64's finaliser (Steele, Lea, Flood 2014).
fn mix(x: u64) -> u64 {
    let x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    x ^ (x >> 31)
}

fn stream(seed: u64, purpose: Purpose) -> u64 {
    mix(seed ^ mix((purpose as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15)))
}

/// Gaussian numbers of unit variance a component, in order.
pub(super) struct Normals {
    seed: u64,
    block: u64,
    used: usize,
    i: Vec<f32>,
    q: Vec<f32>,
}

impl Normals {
    pub(super) fn new(seed: u64, purpose: Purpose) -> Self {
        let empty = vec![0.0; BLOCK_SAMPLES];
        Self { seed: stream(seed, purpose), block: 0, used: BLOCK_SAMPLES, i: empty.clone(), q: empty }
    }

    #[inline]
    pub(super) fn next(&mut self) -> Complex64 {
        if self.used >= BLOCK_SAMPLES {
            self.fill();
        }
        let number = Complex64::new(f64::from(self.i[self.used]), f64::from(self.q[self.used]));
        self.used += 1;
        number
    }

    #[cold]
    fn fill(&mut self) {
        self.i.fill(0.0);
        self.q.fill(0.0);
        add_block(self.seed, self.block, 1.0, &mut self.i, &mut self.q);
        self.block += 1;
        self.used = 0;
    }
}

/// Sign of message symbol `number`.
pub(super) fn symbol(seed: u64, number: u64) -> f64 {
    if mix(stream(seed, Purpose::Symbols) ^ number.wrapping_mul(0x9e37_79b9_7f4a_7c15)) & 1 == 1 { -1.0 } else { 1.0 }
}

/// Number `index` of a uniform stream on [0, 1).
pub(super) fn uniform(seed: u64, purpose: Purpose, index: u64) -> f64 {
    let word = mix(stream(seed, purpose) ^ index.wrapping_mul(0x9e37_79b9_7f4a_7c15));
    // The upper 53 bits are a double's.
    (word >> 11) as f64 * (0.5_f64).powi(53)
}
