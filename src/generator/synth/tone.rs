//! The kernel of frequency-modulated carriers: 32 samples side by side.
//!
//! Carrier and position in the repetition are 64-bit integers of each sample; the modulation's phase is a
//! polynomial of the position in `f64`, taken modulo one by adding 1.5·2^52, which rounds alike on every
//! instruction set. Errors: sines 3e-7, the modulation 1e-16 of its cycles (sine FM: 3e-7 of its index).
//! Where the momentary frequency lies outside the samples' band there is silence, as behind a front end's
//! filter. That is right for sweeps that are slow at the band's edge; others are added as a period whose
//! lines lie in the band ([`crate::stage::interference::period`]).

use crate::synth::angle::cos_sin;
use crate::synth::noise::LANES;

/// The frequency over one repetition, as the reach of the phase.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Modulation {
    /// A constant frequency.
    None,
    /// Linear from −s/2 to +s/2, then back at once; `cycles` is s times the period.
    Sawtooth {
        /// The sweep's width times the period.
        cycles: f64,
    },
    /// Linear up and down; `cycles` is s times half the period.
    Triangle {
        /// The sweep's width times half the period.
        cycles: f64,
    },
    /// A cosine of peak deviation d; `cycles` is d over 2π times the period.
    Sine {
        /// The peak deviation over 2π times the period.
        cycles: f64,
    },
}

impl Modulation {
    /// Phase in cycles at `x` of a period, from 0 to 1.
    pub fn cycles_at(self, x: f64) -> f64 {
        match self {
            Self::None => 0.0,
            Self::Sawtooth { cycles } => 0.5 * cycles * x * (x - 1.0),
            Self::Triangle { cycles } => {
                let (y, sign) = if x < 0.5 { (2.0 * x, 1.0) } else { (2.0 * x - 1.0, -1.0) };
                0.5 * sign * cycles * y * (y - 1.0)
            }
            Self::Sine { cycles } => cycles * libm::sin(std::f64::consts::TAU * x),
        }
    }

    /// Width of the sweep, and the largest slope of the frequency over the width and a period: cycles a
    /// period, and one over periods.
    pub fn reach(self) -> (f64, f64) {
        match self {
            Self::None => (0.0, 0.0),
            Self::Sawtooth { cycles } => (cycles.abs(), 1.0),
            Self::Triangle { cycles } => (2.0 * cycles.abs(), 2.0),
            Self::Sine { cycles } => (2.0 * std::f64::consts::TAU * cycles.abs(), std::f64::consts::PI),
        }
    }
}

/// A carrier over up to 4096 samples.
#[derive(Clone, Copy, Debug)]
pub struct Tone {
    /// Phase of sample 0, in 2^-64 turn.
    pub turns: u64,
    /// Advance of the carrier per sample, in 2^-64 turn, with the Doppler included.
    pub turns_step: u64,
    /// Position in the repetition, in 2^-64 period.
    pub place: u64,
    /// Advance of the position in the repetition per sample, in 2^-64 of it.
    pub place_step: u64,
    /// The frequency over one repetition.
    pub modulation: Modulation,
    /// Band of the samples less the carrier's position, in cycles per sample.
    pub band_cps: (f64, f64),
    /// Peak amplitude, in LSB.
    pub amplitude: f32,
}

/// Adds the tone to planar samples of one length.
#[inline(always)]
pub fn add(tone: &Tone, i: &mut [f32], q: &mut [f32]) {
    // Advance of the position a sample: frequency is the phase's slope times this.
    let rate = tone.place_step as f64 / 18_446_744_073_709_551_616.0;
    match tone.modulation {
        Modulation::None => lanes(tone, i, q, |_, _| ([0; LANES], [tone.amplitude; LANES])),
        Modulation::Sawtooth { cycles } => lanes(tone, i, q, |places, gate| {
            each(places, gate, |place| {
                let x = unit(place);
                (cycles * (0.5 * x * (x - 1.0)), cycles * (x - 0.5) * rate)
            })
        }),
        Modulation::Triangle { cycles } => lanes(tone, i, q, |places, gate| {
            each(places, gate, |place| {
                let x = unit(place << 1);
                // The second half runs back.
                let signed = if place >> 63 == 0 { cycles } else { -cycles };
                (signed * (0.5 * x * (x - 1.0)), signed * (x - 0.5) * 2.0 * rate)
            })
        }),
        Modulation::Sine { cycles } => lanes(tone, i, q, |places, gate| {
            let angle: [u32; LANES] = std::array::from_fn(|k| (places[k] >> 32) as u32);
            let (cos, sin) = cos_sin(&angle);
            let (mut phase, mut amplitude) = ([0; LANES], [0.0; LANES]);
            for k in 0..LANES {
                phase[k] = turns(cycles * f64::from(sin[k]));
                amplitude[k] = gate.pass(cycles * std::f64::consts::TAU * f64::from(cos[k]) * rate);
            }
            (phase, amplitude)
        }),
    }
}

/// Passes the amplitude inside a band.
#[derive(Clone, Copy)]
struct Gate {
    band_cps: (f64, f64),
    amplitude: f32,
}

impl Gate {
    #[inline(always)]
    fn pass(self, cps: f64) -> f32 {
        if (cps > self.band_cps.0) & (cps < self.band_cps.1) { self.amplitude } else { 0.0 }
    }
}

/// Phase and amplitude of each lane from its cycles and its frequency.
#[inline(always)]
fn each(places: &[u64; LANES], gate: Gate, of: impl Fn(u64) -> (f64, f64)) -> ([u32; LANES], [f32; LANES]) {
    let (mut phase, mut amplitude) = ([0; LANES], [0.0; LANES]);
    for k in 0..LANES {
        let (cycles, cps) = of(places[k]);
        phase[k] = turns(cycles);
        amplitude[k] = gate.pass(cps);
    }
    (phase, amplitude)
}

/// 2^-64 as a number in [0, 1), to 2^-52.
#[inline(always)]
fn unit(place: u64) -> f64 {
    f64::from_bits(0x3ff0_0000_0000_0000 | place >> 12) - 1.0
}

/// Cycles modulo one, in 2^-32 turn; up to 2^51 of them.
#[inline(always)]
fn turns(cycles: f64) -> u32 {
    const WHOLE: f64 = 6_755_399_441_055_744.0; // 1.5 · 2^52: one is the last place
    const FINE: f64 = 1_572_864.0; // 1.5 · 2^20: 2^-32 is the last place
    let rest = cycles - ((cycles + WHOLE) - WHOLE);
    (rest + FINE).to_bits() as u32
}

#[inline(always)]
fn lanes(
    tone: &Tone,
    i: &mut [f32],
    q: &mut [f32],
    modulate: impl Fn(&[u64; LANES], Gate) -> ([u32; LANES], [f32; LANES]),
) {
    let gate = Gate { band_cps: tone.band_cps, amplitude: tone.amplitude };
    let start = |first: u64, step: u64| -> [u64; LANES] {
        std::array::from_fn(|k| first.wrapping_add(step.wrapping_mul(k as u64)))
    };
    let mut carrier = start(tone.turns, tone.turns_step);
    let mut place = start(tone.place, tone.place_step);
    let (carrier_stride, place_stride) =
        (tone.turns_step.wrapping_mul(LANES as u64), tone.place_step.wrapping_mul(LANES as u64));
    for (bi, bq) in i.chunks_mut(LANES).zip(q.chunks_mut(LANES)) {
        let (phase, amplitude) = modulate(&place, gate);
        let mut angle = [0; LANES];
        for k in 0..LANES {
            angle[k] = ((carrier[k] >> 32) as u32).wrapping_add(phase[k]);
            carrier[k] = carrier[k].wrapping_add(carrier_stride);
            place[k] = place[k].wrapping_add(place_stride);
        }
        let (cos, sin) = cos_sin(&angle);
        if let (Ok(bi), Ok(bq)) = (<&mut [f32; LANES]>::try_from(&mut *bi), <&mut [f32; LANES]>::try_from(&mut *bq)) {
            for k in 0..LANES {
                bi[k] += amplitude[k] * cos[k];
                bq[k] += amplitude[k] * sin[k];
            }
        } else {
            for (k, (i, q)) in bi.iter_mut().zip(bq).enumerate() {
                *i += amplitude[k] * cos[k];
                *q += amplitude[k] * sin[k];
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::synth::isa::{self, Level};

    /// The obvious twin: one sample in `f64` with the library's functions.
    fn sample(tone: &Tone, n: u64) -> (f64, f64) {
        let scale = 2_f64.powi(-64);
        let carrier = tone.turns.wrapping_add(tone.turns_step.wrapping_mul(n)) as f64 * scale;
        let x = tone.place.wrapping_add(tone.place_step.wrapping_mul(n)) as f64 * scale;
        let rate = tone.place_step as f64 * scale;
        let (cycles, slope) = match tone.modulation {
            Modulation::None => (0.0, 0.0),
            Modulation::Sawtooth { cycles } => (cycles * (x * x - x) / 2.0, cycles * (x - 0.5)),
            Modulation::Triangle { cycles } if x < 0.5 => {
                (cycles * (4.0 * x * x - 2.0 * x) / 2.0, cycles * (4.0 * x - 1.0))
            }
            Modulation::Triangle { cycles } => {
                let y = 2.0 * x - 1.0;
                (-cycles * (y * y - y) / 2.0, -cycles * (2.0 * y - 1.0))
            }
            Modulation::Sine { cycles } => {
                let (sin, cos) = libm::sincos(std::f64::consts::TAU * x);
                (cycles * sin, cycles * cos * std::f64::consts::TAU)
            }
        };
        let inside = tone.band_cps.0 < slope * rate && slope * rate < tone.band_cps.1;
        let turns = carrier + cycles;
        let (sin, cos) = libm::sincos(std::f64::consts::TAU * (turns - turns.floor()));
        let amplitude = if inside { f64::from(tone.amplitude) } else { 0.0 };
        (amplitude * cos, amplitude * sin)
    }

    #[test]
    fn lanes_are_the_library_s_functions_on_every_instruction_set() {
        let modulations = [
            Modulation::None,
            Modulation::Sawtooth { cycles: 20_000.3 },
            Modulation::Sawtooth { cycles: -31.7 },
            Modulation::Triangle { cycles: 700.25 },
            Modulation::Sine { cycles: 5.5 },
        ];
        for modulation in modulations {
            let tone = Tone {
                turns: 0x1234_5678_9abc_def0,
                turns_step: 0x0f0f_1111_2222_3333,
                place: 0xfedc_ba98_7654_3210,
                place_step: 0x0001_2345_6789_abcd,
                modulation,
                band_cps: (-0.3, 0.4),
                amplitude: 1e6,
            };
            let mut first: Option<(Vec<f32>, Vec<f32>)> = None;
            for level in Level::ALL.into_iter().filter(|level| level.is_available()) {
                let (mut i, mut q) = (vec![0.0; 4096 - 5], vec![0.0; 4096 - 5]);
                isa::add_tone(level, &tone, &mut i, &mut q);
                let wrong = (0_u64..)
                    .zip(i.iter().zip(&q))
                    .map(|(n, (i, q))| {
                        let (re, im) = sample(&tone, n);
                        (f64::from(*i) - re).abs().max((f64::from(*q) - im).abs())
                    })
                    .fold(0.0, f64::max);
                // Sines 3e-7 and the angle's last place 2^-32 turn = 1.5e-9; sine FM adds 3e-7 · 5.5 cycles ·
                // 2π = 1.04e-5.
                let bar = if matches!(modulation, Modulation::Sine { .. }) { 1.1e-5 } else { 4e-7 };
                assert!(wrong < bar * 1e6, "{modulation:?} {level:?}: {wrong}");
                match &first {
                    None => first = Some((i, q)),
                    Some(bits) => assert_eq!(*bits, (i, q), "{modulation:?} {level:?}"),
                }
            }
        }
    }
}
