//! A period of signs, as kernels take it: the sum of such patterns is a replica.

use std::f64::consts::PI;
#[cfg(target_arch = "x86_64")]
use std::sync::OnceLock;

use num_complex::Complex64;

use super::{CODE_BITS, Edge, MOST_STEPS, Nco, TURN, Wave, units_to_chips};
#[cfg(target_arch = "x86_64")]
use super::{kernel, short};

/// Half a turn in 2⁻⁶⁴ turns for each unit of code phase.
const HALF_TURN_OF_CHIP: u64 = 1 << (63 - CODE_BITS);

/// Steps as a kernel looks them up, a little longer than the period.
#[cfg(target_arch = "x86_64")]
#[derive(Clone, Debug)]
pub(super) struct Table<T> {
    pub values: Vec<T>,
    /// Differences from each value to the next; in short integers −1, 0 or 1 times the step.
    pub changes: Vec<T>,
}

/// One period of steps of ±1, and its part in a replica.
#[derive(Clone, Debug)]
pub(super) struct Pattern {
    pub gain: Complex64,
    pub steps_per_chip: usize,
    /// Entry j holds the 64 steps from step 32 j on, cyclically, first step in the top bit, 1 for −1.
    pub words: Vec<u64>,
    /// Values of a period's steps.
    pub steps: Vec<i8>,
    pub edge: Edge,
    /// Tables that only kernels with AVX-512 and these numbers want, made when one does.
    #[cfg(target_arch = "x86_64")]
    pub(super) floats: OnceLock<Table<f32>>,
    #[cfg(target_arch = "x86_64")]
    pub(super) shorts: OnceLock<Table<i16>>,
    /// Half cycles of the sub-carrier in a chip, for a component that is one sideband.
    pub half_cycles: i32,
    /// True if taps beside the prompt have the sub-carrier's phase at the tap, false if they have the
    /// prompt's.
    pub turns_at_taps: bool,
    /// True if the pattern's part enters with the opposite sign.
    pub is_inverted: bool,
}

impl Pattern {
    /// The patterns whose sum has those steps, with gains that add up to `gain`.
    pub fn of(wave: &Wave, gain: Complex64, edge: Edge) -> Option<Vec<Self>> {
        if wave.steps_per_chip == 0 || !(64..MOST_STEPS).contains(&wave.values.len()) {
            return None;
        }
        let one = |zero: i8, gain: Complex64| {
            let steps = wave.values.iter().map(|&value| if value == 0 { zero } else { value }).collect();
            Self::of_signs(steps, wave.steps_per_chip, gain, edge)
        };
        if wave.values.contains(&0) {
            return Some(vec![one(1, 0.5 * gain), one(-1, 0.5 * gain)]);
        }
        Some(vec![one(1, gain)])
    }

    fn of_signs(steps: Vec<i8>, steps_per_chip: usize, gain: Complex64, edge: Edge) -> Self {
        let word = |start: usize| {
            steps.iter().cycle().skip(start).take(64).fold(0_u64, |word, &step| word << 1 | u64::from(step < 0))
        };
        let words = (0..=steps.len() / 32).map(|j| word(32 * j)).collect();
        Self {
            gain,
            steps_per_chip,
            words,
            steps,
            edge,
            #[cfg(target_arch = "x86_64")]
            floats: OnceLock::new(),
            #[cfg(target_arch = "x86_64")]
            shorts: OnceLock::new(),
            half_cycles: 0,
            turns_at_taps: false,
            is_inverted: false,
        }
    }

    /// Steps of a period.
    pub fn length(&self) -> usize {
        self.steps.len()
    }

    /// Length of the period in phase units of steps.
    pub fn period(&self) -> i64 {
        (self.length() as i64) << CODE_BITS
    }

    #[cfg(target_arch = "x86_64")]
    fn cyclic(&self, margin: usize) -> impl Iterator<Item = i8> {
        self.steps.iter().copied().cycle().take(self.length() + margin + 1)
    }

    /// Steps in floating point.
    #[cfg(target_arch = "x86_64")]
    pub fn floats(&self) -> &Table<f32> {
        self.floats.get_or_init(|| {
            let values: Vec<f32> = self.cyclic(kernel::TABLE_MARGIN).map(f32::from).collect();
            let changes = values.windows(2).map(|pair| pair[1] - pair[0]).collect();
            Table { values, changes }
        })
    }

    /// Steps in short integers.
    #[cfg(target_arch = "x86_64")]
    pub fn shorts(&self) -> &Table<i16> {
        self.shorts.get_or_init(|| {
            let signs: Vec<i16> = self.cyclic(kernel::SHORT_MARGIN).map(i16::from).collect();
            let values = signs.iter().map(|sign| sign * short::AMPLITUDE).collect();
            let changes = signs.windows(2).map(|pair| (pair[1] - pair[0]) / 2).collect();
            Table { values, changes }
        })
    }

    /// Phases of chips as those of steps.
    pub fn in_steps<const T: usize>(&self, nco: &Nco, taps: &[i64; T]) -> (Nco, [i64; T]) {
        let each = self.steps_per_chip as i64;
        let code = if each == 1 { nco.code } else { nco.code.rem_euclid(self.period() / each) * each };
        let nco = Nco { code, code_step: nco.code_step * each as u64, ..self.beside_carrier(nco) };
        (nco, taps.map(|tap| tap * each))
    }

    /// The carrier with the sub-carrier, which turns with the code: exactly, for whole turns wrap in both.
    pub fn beside_carrier(&self, nco: &Nco) -> Nco {
        let turns = |units: u64| units.wrapping_mul(self.half_cycles as u64).wrapping_mul(HALF_TURN_OF_CHIP);
        Nco {
            carrier: nco.carrier.wrapping_add(turns(nco.code as u64)),
            carrier_step: nco.carrier_step.wrapping_add(turns(nco.code_step)),
            ..*nco
        }
    }

    /// Factor of a sum at a tap: the gain, and the sub-carrier's turn from the prompt to the tap.
    pub fn factor(&self, tap: i64) -> Complex64 {
        let gain = if self.is_inverted { -self.gain } else { self.gain };
        if !self.turns_at_taps {
            return gain;
        }
        let (sin, cos) = libm::sincos(-PI * f64::from(self.half_cycles) * units_to_chips(tap));
        gain * Complex64::new(cos, planted!("receiver.correlate.side", sin, -sin))
    }

    pub fn slow<const T: usize>(&self, (i, q): (&[f32], &[f32]), nco: &Nco, taps: &[i64; T]) -> [Complex64; T] {
        let mut sums = [Complex64::ZERO; T];
        let period = self.period();
        let code = nco.code.rem_euclid(period);
        // A period is taken off first: two phases may not fit into 63 bits together.
        let mut codes = taps.map(|tap| (code - period + tap.rem_euclid(period)) % period);
        let mut carrier = nco.carrier;
        for (&i, &q) in i.iter().zip(q) {
            let (sin, cos) = libm::sincos(carrier as f64 / TURN * std::f64::consts::TAU);
            let wiped = Complex64::new(f64::from(i), f64::from(q)) * Complex64::new(cos, -sin);
            for (sum, code) in sums.iter_mut().zip(&mut codes) {
                *sum += wiped * self.value(*code, nco.code_step);
                *code = (*code + nco.code_step as i64) % period;
            }
            carrier = carrier.wrapping_add(nco.carrier_step);
        }
        sums
    }

    /// A sample when the phase is `code`, in units of steps.
    pub fn value(&self, code: i64, step: u64) -> f64 {
        let at = |units: i64| {
            let index = (units.rem_euclid(self.period()) >> CODE_BITS) as usize;
            self.steps.get(index).map_or(0.0, |&step| f64::from(step))
        };
        match self.edge {
            Edge::Nearest => at(code),
            Edge::Area => {
                let start = code - (step / 2) as i64;
                let end = start + step as i64;
                let fraction = end.rem_euclid(1 << CODE_BITS) as f64 / step as f64;
                let w = fraction.min(1.0);
                at(start) + (at(end) - at(start)) * w
            }
        }
    }
}
