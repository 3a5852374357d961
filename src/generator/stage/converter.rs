//! Gain control and analogue-to-digital conversion.
//!
//! The converter is uniform with odd levels ±1, ±3, … ±(2^b − 1), so that no level is zero, or with half of
//! them where the format's numbers lie halfway between whole ones; with as many bits as the format has it
//! rounds to the format's own integers. Its step against the standard deviation of what comes in is that of
//! least loss (Max 1960; losses in Hegarty 2011): 1.96 dB with one bit,
//! 0.55 with two. With gain control the deviation is measured over the window before each run of 4096
//! samples; without, it is the thermal noise's as the scene sets it. The scene's first run has nothing before
//! it and is measured itself, whole, whatever part of it is asked for. Limits: the gain of a run is constant.

use crate::stage::{Block, Stage};
use crate::synth::RUN_SAMPLES;
use gnss::facts::{ConverterSpec, StageSpec};

/// Steps in units of the deviation that lose least, by bits.
const BEST_STEP: [(u32, f64); 7] =
    [(1, 1.0), (2, 0.9957), (3, 0.586), (4, 0.335), (8, 0.0308), (12, 0.003), (16, 2.5e-4)];

/// Converter behind a gain control or a fixed gain.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Converter {
    /// Number of bits per component, 1 to 16.
    pub bits: u32,
    /// Quantiser step in units of the standard deviation of a component.
    pub step_sigma: f64,
    /// Number of runs over which gain control measures the deviation; absent means a fixed gain.
    pub window_runs: Option<u32>,
    /// Standard deviation for which a fixed gain is set, in LSB.
    pub nominal_lsb: f32,
    /// True if levels are the format's own numbers; otherwise they are odd multiples of `level_lsb`.
    pub whole: bool,
    /// Level next to zero, LSB: 1, or 1/2 where the format's numbers lie halfway between whole ones.
    pub level_lsb: f32,
}

impl Converter {
    /// Quantiser step of least loss for Gaussian noise, in standard deviations.
    pub fn best_step_sigma(bits: u32) -> f64 {
        let (_, step) = BEST_STEP.iter().rev().find(|(b, _)| *b <= bits).unwrap_or(&BEST_STEP[0]);
        *step
    }

    /// Deviation of a component for each run of the block: over the window before it, or over the first run
    /// itself.
    fn deviations_lsb(&self, block: &Block<'_>) -> Vec<f32> {
        let runs = block.i.chunks(RUN_SAMPLES).zip(block.q.chunks(RUN_SAMPLES));
        let Some(window) = self.window_runs else { return vec![self.nominal_lsb; runs.len()] };
        let power = |plane: &[f32]| plane.iter().fold(0.0_f64, |sum, x| sum + f64::from(*x) * f64::from(*x));
        let powers: Vec<f64> = runs.map(|(i, q)| (power(i) + power(q)) / (2.0 * i.len() as f64)).collect();
        (0..powers.len())
            .map(|run| {
                let before = powers.get(run.saturating_sub(window as usize)..run.max(1)).unwrap_or(&[]);
                (before.iter().fold(0.0, |sum, power| sum + power) / before.len().max(1) as f64).sqrt() as f32
            })
            .collect()
    }
}

impl Stage for Converter {
    fn name(&self) -> &'static str {
        "adc"
    }

    fn describe(&self) -> String {
        let gain = match self.window_runs {
            Some(runs) => format!("gain control over {runs} runs of {RUN_SAMPLES} samples"),
            None => format!("fixed gain for {} LSB", self.nominal_lsb),
        };
        format!("{} bits, step {} sigma, {gain}", self.bits, self.step_sigma)
    }

    fn spec(&self) -> Option<StageSpec> {
        Some(StageSpec::Adc(ConverterSpec {
            bits: self.bits,
            step_sigma: self.step_sigma,
            nominal_lsb: f64::from(self.nominal_lsb),
            gain_control: self.window_runs.is_some(),
            whole: self.whole,
        }))
    }

    fn full_scale_lsb(&self, deviation_lsb: f64) -> Option<f64> {
        let deviation_lsb = if self.window_runs.is_some() { deviation_lsb } else { f64::from(self.nominal_lsb) };
        let half = (1_i64 << (self.bits - 1)) as f64;
        Some(half * self.step_sigma * deviation_lsb)
    }

    fn memory_samples(&self) -> usize {
        // A block begins at a run: the window before its first run is whole.
        self.window_runs.map_or(0, |runs| runs as usize * RUN_SAMPLES)
    }

    fn act(&self, block: &mut Block<'_>) {
        let deviations_lsb = self.deviations_lsb(block);
        let half = (1_i64 << (self.bits - 1)) as f32;
        let mut clipped = 0;
        let end = block.i.len() - block.tail.min(block.i.len());
        let runs = block.i.chunks_mut(RUN_SAMPLES).zip(block.q.chunks_mut(RUN_SAMPLES));
        for (run, ((i, q), deviation_lsb)) in runs.zip(deviations_lsb).enumerate() {
            let step =
                planted!("generator.converter.step", self.step_sigma, 2.0 * self.step_sigma) as f32 * deviation_lsb;
            // Silence has no deviation: it comes out as the level next to zero.
            let scale = if step > 0.0 { 1.0 / step } else { 0.0 };
            let sent = block.lead.saturating_sub(run * RUN_SAMPLES)..end.saturating_sub(run * RUN_SAMPLES);
            for plane in [i, q] {
                for (n, x) in plane.iter_mut().enumerate() {
                    let y = *x * scale;
                    clipped += u64::from(self.bits > 1 && y.abs() > half && sent.contains(&n));
                    *x = if self.whole { y } else { self.level_lsb * (2.0 * level(y, half) + 1.0) };
                }
            }
        }
        block.clipped += clipped;
    }
}

/// The largest integer not above `y`, within −`half` and `half` − 1.
pub(super) fn level(y: f32, half: f32) -> f32 {
    let y = y.clamp(-half, half - 0.5);
    // A cast rounds to zero; levels are few enough for one.
    let whole = y as i32 as f32;
    if whole > y { whole - 1.0 } else { whole }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::synth::noise::add_block;
    use gnss::samples::Format;

    /// Correlation loss of a weak signal, in dB: 10 lg of (E[x Q(x)])² / E[Q(x)²], for Gaussian x.
    fn loss_db(converter: &Converter, sigma: f32) -> f64 {
        let (mut product, mut square, mut power) = (0.0, 0.0, 0.0);
        for number in 0..200 {
            let (mut i, mut q) = (vec![0.0; RUN_SAMPLES], vec![0.0; RUN_SAMPLES]);
            add_block(5, number, sigma, &mut i, &mut q);
            let before = i.clone();
            let mut block = Block::whole(0, &mut i, &mut q);
            converter.act(&mut block);
            for (x, y) in before.iter().zip(&i) {
                let (x, y) = (f64::from(*x), f64::from(*y));
                (product, square, power) = (product + x * y, square + y * y, power + x * x);
            }
        }
        -10.0 * libm::log10(product * product / (square * power))
    }

    #[test]
    fn each_number_of_bits_loses_what_is_published() {
        // Hegarty 2011 and Max 1960. 819 200 samples: the correlation ρ scatters by (1 − ρ²)/√n, one bit 4e-4
        // or 0.004 dB; five sigma.
        for (bits, expected_db) in [(1, 1.961), (2, 0.549), (3, 0.166), (4, 0.050)] {
            for window_runs in [None, Some(1)] {
                let converter = Converter {
                    bits,
                    step_sigma: Converter::best_step_sigma(bits),
                    window_runs,
                    nominal_lsb: 28.0,
                    whole: false,
                    level_lsb: 1.0,
                };
                let found = loss_db(&converter, 28.0);
                assert!((found - expected_db).abs() < 0.02, "{bits} bits: {found} dB");
            }
        }
    }

    #[test]
    fn gain_control_keeps_the_loss_where_a_fixed_gain_is_6_db_off() {
        // Theory for two bits 6 dB too low and too high a gain: 1.22 and 0.86 dB.
        let fixed = |nominal_lsb| Converter {
            bits: 2,
            step_sigma: Converter::best_step_sigma(2),
            window_runs: None,
            nominal_lsb,
            whole: false,
            level_lsb: 1.0,
        };
        assert!((loss_db(&fixed(28.0), 56.0) - 0.86).abs() < 0.03, "{}", loss_db(&fixed(28.0), 56.0));
        assert!((loss_db(&fixed(28.0), 14.0) - 1.22).abs() < 0.03, "{}", loss_db(&fixed(28.0), 14.0));
        let controlled = Converter { window_runs: Some(1), ..fixed(28.0) };
        assert!((loss_db(&controlled, 56.0) - 0.549).abs() < 0.02);
    }

    /// A level between the format's numbers would be rounded to one side: half a step of DC.
    #[test]
    fn levels_of_few_bits_are_numbers_of_the_format() {
        for (format, level_lsb) in [(Format::Ci8, 1.0), (Format::Cu8, 0.5)] {
            let converter = Converter {
                bits: 3,
                step_sigma: Converter::best_step_sigma(3),
                window_runs: None,
                nominal_lsb: 28.0,
                whole: false,
                level_lsb,
            };
            let (mut i, mut q) = (vec![0.0; RUN_SAMPLES], vec![0.0; RUN_SAMPLES]);
            add_block(5, 0, 28.0, &mut i, &mut q);
            converter.act(&mut Block::whole(0, &mut i, &mut q));
            let mut bytes = Vec::new();
            format.pack(&i, &q, &mut bytes);
            let (mut read_i, mut read_q) = (Vec::new(), Vec::new());
            format.unpack(&bytes, &mut read_i, &mut read_q);
            assert!(read_i == i && read_q == q, "{format}");
        }
    }

    #[test]
    fn silence_and_overload_give_levels_and_no_more() {
        let converter = Converter {
            bits: 2,
            step_sigma: 1.0,
            window_runs: Some(1),
            nominal_lsb: 1.0,
            whole: false,
            level_lsb: 1.0,
        };
        for (value, expected) in [(0.0, 1.0), (1e30, 3.0), (-1e30, -3.0)] {
            let (mut i, mut q) = (vec![value; 100], vec![0.0; 100]);
            i[0] = 1.0;
            let fixed = Converter { window_runs: None, ..converter };
            let mut block = Block::whole(0, &mut i, &mut q);
            fixed.act(&mut block);
            assert!(i[1..].iter().all(|x| *x == expected) && q.iter().all(|x| *x == 1.0));
        }
        let (mut i, mut q) = (vec![0.0; 100], vec![0.0; 100]);
        converter.act(&mut Block::whole(0, &mut i, &mut q));
        assert!(i.iter().all(|x| *x == 1.0));
    }
}
