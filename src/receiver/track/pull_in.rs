//! Pull-in of weak signals: carrier frequency, carrier phase and symbol edges from one batch of prompts.
//!
//! While the carrier's oscillator runs free, prompts of one code period are collected. For every position of
//! the symbols' edges and every frequency on a grid the energies of whole symbols are added (maximum
//! likelihood where symbols are random and phases unknown); the largest sum gives both. Then the phases of
//! the squared symbols, which know no data, give frequency and phase exactly enough for a phase loop to begin
//! in lock. Noise alone is recognised by its chi-square distribution. Limits: the frequency is within 400 Hz
//! for a period of 1 ms (of symbols of one period within a quarter of a cycle a period) and changes by less
//! than some hertz in the batch (1 m/s² is 5 Hz/s); edges are found to a few periods, which [`super::sync`]
//! has to confirm.

use std::f64::consts::TAU;

use num_complex::Complex64;

use crate::threshold;

/// Half the range of frequencies, cycles a code period: there a prompt has lost 2.4 dB.
const REACH_CYCLES: f64 = 0.4;
/// Frequencies a symbol's bandwidth, 1/duration: 0.22 dB are lost at worst.
const FINENESS: f64 = 4.0;
/// Probability that noise alone passes.
const FALSE_ALARM: f64 = 1e-4;
/// Steps of the search for the squares' frequency, to half a cycle a symbol on either side.
const SQUARE_STEPS: i32 = 256;

/// Prompts of consecutive code periods.
#[derive(Clone, Debug)]
pub struct Batch {
    group: usize,
    prompts: Vec<Complex64>,
    /// Prompts that it waits for, before which nothing is searched.
    wanted: usize,
    /// True if the batch has been extended once.
    extended: bool,
}

/// Beginning of the symbols, and the carrier's error against the oscillator.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Found {
    /// Prompts before the first whole symbol, below the symbol's length.
    pub offset: usize,
    /// Cycles a code period by which the carrier is faster than the oscillator.
    pub cycles: f64,
    /// Cycles by which it is ahead at the end of the last prompt, up to a half.
    pub phase_cycles: f64,
    /// True if symbols change sign in the batch. Without a change their edges cannot be found.
    pub changes: bool,
}

/// Least difference between the best and the worst position of the edges, as a share of a symbol's energy,
/// where symbols change sign. One change takes a whole symbol.
const LEAST_CHANGE: f64 = 0.75;

impl Batch {
    /// A batch for symbols of `group` code periods, with at least `wanted` prompts.
    pub fn new(group: u32, wanted: usize) -> Self {
        Self { group: group.max(1) as usize, prompts: Vec::new(), wanted, extended: false }
    }

    /// True if the batch has all the prompts that it waits for.
    pub fn is_full(&self) -> bool {
        self.prompts.len() >= self.wanted
    }

    /// Waits for as many prompts again, once: `false` if it has done so before.
    pub fn extend(&mut self) -> bool {
        if self.extended {
            return false;
        }
        self.extended = true;
        self.wanted *= 2;
        true
    }

    /// Takes the prompt of the next code period.
    pub fn add(&mut self, prompt: Complex64) {
        self.prompts.push(prompt);
    }

    /// Number of prompts in the batch.
    pub fn periods(&self) -> usize {
        self.prompts.len()
    }

    /// Searches edges and frequency; `noise` is the power of a prompt's noise, both components. `None` where
    /// noise alone might have given as much.
    pub fn search(&self, noise: f64) -> Option<Found> {
        let symbols = (self.prompts.len() + 1).checked_div(self.group)?.saturating_sub(1);
        if symbols < 2 || noise <= 0.0 {
            return None;
        }
        // The energy of a single prompt does not depend on frequency: the squares alone show it.
        let reach_cycles = if self.group > 1 { REACH_CYCLES } else { 0.0 };
        let steps = (reach_cycles * FINENESS * self.group as f64).floor() as i32;
        let step = 1.0 / (FINENESS * self.group as f64);
        let mut best = (0.0, 0, 0);
        let mut energies = Vec::new();
        for number in -steps..=steps {
            self.energies(f64::from(number) * step, symbols, &mut energies);
            for (offset, &energy) in energies.iter().enumerate() {
                if energy > best.0 {
                    best = (energy, offset, number);
                }
            }
        }
        let (most, offset, number) = best;
        let cells = f64::from(2 * steps + 1) * self.group as f64;
        // Twice the power over that of the noise: chi-square, two degrees a symbol. Neighbouring cells count
        // as others.
        let least = threshold::threshold(threshold::of_one_cell(FALSE_ALARM, cells), 2 * symbols as u32);
        if 2.0 * most / (noise * self.group as f64) < least {
            return None;
        }
        let mut around = [-1, 0, 1].map(|near| {
            self.energies(f64::from(number + near) * step, symbols, &mut energies);
            energies.get(offset).copied().unwrap_or_default()
        });
        around.iter_mut().for_each(|energy| *energy /= most);
        self.energies(f64::from(number) * step, symbols, &mut energies);
        let worst = energies.iter().copied().fold(most, f64::min);
        let changes = most - worst > LEAST_CHANGE * most / symbols as f64;
        let curvature = around[0] - 2.0 * around[1] + around[2];
        let vertex = if steps > 0 && curvature < 0.0 { 0.5 * (around[0] - around[2]) / curvature } else { 0.0 };
        Some(Found { changes, ..self.refine(offset, (f64::from(number) + vertex) * step) })
    }

    /// Energy of the symbols for every position of the first edge, with the oscillator faster by `cycles` a
    /// period.
    fn energies(&self, cycles: f64, symbols: usize, energies: &mut Vec<f64>) {
        let mut sums = Vec::with_capacity(self.prompts.len() + 1);
        let mut sum = Complex64::ZERO;
        sums.push(sum);
        let turn = phasor(-cycles);
        let mut rotation = Complex64::ONE;
        for prompt in &self.prompts {
            sum += prompt * rotation;
            rotation *= turn;
            sums.push(sum);
        }
        energies.clear();
        energies.extend((0..self.group).map(|offset| {
            let edges = sums.get(offset..).unwrap_or_default().iter().step_by(self.group).take(symbols + 1);
            edges.clone().zip(edges.skip(1)).map(|(from, to)| (to - from).norm_sqr()).sum::<f64>()
        }));
    }

    /// Frequency and phase from the squares of symbols at known edges, near the frequency `cycles`.
    fn refine(&self, offset: usize, cycles: f64) -> Found {
        let rest = self.prompts.get(offset..).unwrap_or_default();
        let squares: Vec<Complex64> = rest
            .chunks_exact(self.group)
            .enumerate()
            .map(|(number, symbol)| {
                let begin = (number * self.group) as f64;
                let periods = symbol.iter().enumerate();
                let sum: Complex64 = periods.map(|(k, prompt)| prompt * phasor(-cycles * (begin + k as f64))).sum();
                sum * sum
            })
            .collect();
        let spectrum = |square_cycles: f64| -> Complex64 {
            let turned = squares.iter().enumerate().map(|(s, square)| square * phasor(-square_cycles * s as f64));
            turned.sum()
        };
        let mut best = (0.0, 0.0);
        for number in -SQUARE_STEPS..=SQUARE_STEPS {
            let square_cycles = 0.5 * f64::from(number) / f64::from(SQUARE_STEPS);
            let power = spectrum(square_cycles).norm_sqr();
            if power > best.0 {
                best = (power, square_cycles);
            }
        }
        let group = self.group as f64;
        let residual = 0.5 * best.1 / group;
        let total = cycles + residual;
        // Prompt k shows the phase of its middle, at k + 1/2 periods, less what it was turned back by,
        // `cycles`·k.
        let shown = 0.5 * spectrum(best.1).arg() / TAU;
        let begin = shown - 0.5 * total - residual * 0.5 * (group - 1.0);
        let ahead = begin + total * rest.len() as f64;
        Found { offset, cycles: total, phase_cycles: ahead - (2.0 * ahead).round() / 2.0, changes: true }
    }
}

/// A phasor of `cycles` turns.
fn phasor(cycles: f64) -> Complex64 {
    let (sin, cos) = libm::sincos(TAU * (cycles - cycles.floor()));
    Complex64::new(cos, sin)
}

#[cfg(test)]
mod tests {
    use super::super::tests::Normal;
    use super::*;

    const GROUP: usize = 20;

    /// Prompts of 1 ms with random symbols, the first whole one after `offset` prompts.
    fn batch(normal: &mut Normal, dbhz: f64, hz: f64, phase_cycles: f64, offset: usize, periods: usize) -> Batch {
        let amplitude = (2.0 * libm::pow(10.0, dbhz / 10.0) * 1e-3).sqrt();
        let mut batch = Batch::new(GROUP as u32, 0);
        let mut sign = 1.0;
        for k in 0..periods {
            if k % GROUP == offset && normal.next() > 0.0 {
                sign = -sign;
            }
            let carrier = phasor(phase_cycles + 1e-3 * hz * (k as f64 + 0.5)) * (sign * amplitude);
            batch.add(carrier + Complex64::new(normal.next(), normal.next()));
        }
        batch
    }

    #[test]
    fn where_every_prompt_has_a_sign_of_its_own_the_frequency_nearest_to_the_oscillator_s_is_found() {
        let mut normal = Normal::new(22);
        let amplitude = (2.0 * libm::pow(10.0, 3.2) * 4e-3_f64).sqrt();
        for cycles in [-0.2, -0.1, 0.0, 0.004, 0.13, 0.2] {
            for _ in 0..20 {
                let mut batch = Batch::new(1, 62);
                for k in 0..62 {
                    let sign = if normal.next() > 0.0 { 1.0 } else { -1.0 };
                    let carrier = phasor(cycles * (f64::from(k) + 0.5)) * (sign * amplitude);
                    batch.add(carrier + Complex64::new(normal.next(), normal.next()));
                }
                let found = batch.search(2.0).unwrap();
                // Of the phase of 62 prompts at 11 dB: 0.06 cycles a prompt, √12/62^1.5 of that a period,
                // five times.
                assert!((found.cycles - cycles).abs() < 2e-3, "{cycles}: {}", found.cycles);
            }
        }
    }

    #[test]
    fn frequency_phase_and_edges_of_a_quarter_second_are_found_from_25_dbhz_on() {
        for (dbhz, far) in [(25.0, 5), (30.0, 3), (40.0, 1)] {
            let mut normal = Normal::new(21);
            let (mut errors_hz, mut errors_cycles, mut runs) = (0.0, 0.0, 0.0);
            for run in 0..60 {
                let (hz, offset) = (13.7 * f64::from(run % 50) - 340.0, (run as usize * 7) % GROUP);
                let found = batch(&mut normal, dbhz, hz, 0.1, offset, 250).search(2.0).unwrap();
                let off = found.offset.abs_diff(offset);
                assert!(off.min(GROUP - off) <= far, "{dbhz}: edge {} for {offset}", found.offset);
                let error_hz = 1e3 * found.cycles - hz;
                let ahead = found.phase_cycles - (0.1 + 0.25 * hz);
                let error_cycles = ahead - (2.0 * ahead).round() / 2.0;
                errors_hz += error_hz * error_hz;
                errors_cycles += error_cycles * error_cycles;
                runs += 1.0;
            }
            let (rms_hz, rms_cycles) = ((errors_hz / runs).sqrt(), (errors_cycles / runs).sqrt());
            println!("{dbhz} dB-Hz: {rms_hz:.3} Hz, {rms_cycles:.4} cycle");
            // A line through the phases of 11 symbols, each with σ = √(1/(2·x)) rad, x = C/N0·20 ms, more
            // where edges are wrong and the square of noise by noise counts (x = 6 at 25 dB-Hz):
            // σ√12/(2π·0.22 s·√11) = 0.75 σ Hz, and 2σ/√11 at the end.
            let sigma = (0.5 / (0.02 * libm::pow(10.0, dbhz / 10.0))).sqrt();
            assert!(rms_hz < 2.0 * 0.75 * sigma + 0.03, "{dbhz}: {rms_hz} Hz");
            assert!(rms_cycles < 2.0 * 2.0 * sigma / 11_f64.sqrt() / TAU + 0.01, "{dbhz}: {rms_cycles} cycle");
        }
    }

    #[test]
    fn a_batch_without_a_change_of_sign_says_so() {
        for dbhz in [40.0, 45.0] {
            let mut normal = Normal::new(23);
            let (mut still, mut changing) = (0, 0);
            for run in 0..40 {
                // The first edge comes after the batch: no sign changes in it.
                let one = batch(&mut normal, dbhz, 20.0, 0.1, 0, GROUP).prompts[0].re.signum();
                let mut quiet = Batch::new(GROUP as u32, 0);
                let amplitude = (2.0 * libm::pow(10.0, dbhz / 10.0) * 1e-3).sqrt();
                for _ in 0..250 {
                    quiet.add(Complex64::new(one * amplitude + normal.next(), normal.next()));
                }
                still += u32::from(quiet.search(2.0).unwrap().changes);
                changing +=
                    u32::from(batch(&mut normal, dbhz, 20.0, 0.1, run % GROUP, 250).search(2.0).unwrap().changes);
            }
            println!("{dbhz} dB-Hz: changes in {still} of 40 without, in {changing} of 40 with");
            // Without changes the worst of twenty positions is 0.4 ± 0.2 symbols below at 40 dB-Hz; eleven
            // edges change half of the time.
            assert!(still <= 8 && changing >= 39, "{dbhz}: {still} {changing}");
        }
    }

    #[test]
    fn noise_alone_passes_as_seldom_as_it_is_set() {
        let mut normal = Normal::new(22);
        let passed = (0..500)
            .filter(|_| {
                let mut batch = Batch::new(GROUP as u32, 0);
                (0..250).for_each(|_| batch.add(Complex64::new(normal.next(), normal.next())));
                batch.search(2.0).is_some()
            })
            .count();
        // 500 tries of 1e-4: more than two would be a chance of 2e-5.
        assert!(passed <= 2, "{passed}");
        assert_eq!(Batch::new(20, 0).search(2.0), None);
    }
}
