//! The phase of a pilot's secondary code, from the signs of its prompts.

use num_complex::Complex64;

/// Search for the secondary code chip of a code period.
#[derive(Clone, Debug)]
pub struct SecondaryCodeSync {
    code: Vec<i8>,
    shifts: Shifts,
}

/// Sums of the evidence for every shift of a code against the count of its periods.
#[derive(Clone, Debug)]
pub(super) struct Shifts {
    sums: Vec<f64>,
    taken: u32,
}

/// The phase of a secondary code.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SecondaryCodePhase {
    /// Added to the number of a code period it gives the secondary code chip's, modulo the secondary code's
    /// length.
    pub shift: u64,
    /// True if prompts have the opposite sign of the code: the carrier is half a cycle off.
    pub inverted: bool,
}

/// Prompts before a decision is tried.
const LEAST_PROMPTS: u32 = 20;
/// Standard deviations by which the best shift leads the next.
const LEAD_SIGMAS: f64 = 6.0;
/// The next has less than this of the best: what differs in few of the prompts is not separated yet.
const NEXT_SHARE: f64 = 0.8;
/// Prompts after which a search begins again, in secondary codes: longer searches do not become surer.
const MOST_CODES: u32 = 20;

impl Shifts {
    /// Nothing said yet, for so many shifts.
    pub fn new(count: usize) -> Self {
        Self { sums: vec![0.0; count], taken: 0 }
    }

    /// Forgets what was taken.
    pub fn clear(&mut self) {
        self.sums.fill(0.0);
        self.taken = 0;
    }

    /// Takes what a code period says for each shift (noise of unit variance), from the first one on; gives
    /// how many periods were taken.
    pub fn add(&mut self, said: impl Iterator<Item = f64>) -> u32 {
        self.sums.iter_mut().zip(said).for_each(|(sum, one)| *sum += one);
        self.taken += 1;
        self.taken
    }

    /// The shift that is beyond doubt.
    pub fn decide(&self) -> Option<SecondaryCodePhase> {
        let (shift, best) = self.sums.iter().copied().enumerate().max_by(|a, b| a.1.abs().total_cmp(&b.1.abs()))?;
        let others = self.sums.iter().enumerate().filter(|(other, _)| *other != shift);
        let next = others.map(|(_, sum)| sum.abs()).fold(0.0, f64::max);
        // Two sums of as many prompts, noise of unit variance in each.
        let deviation = (2.0 * f64::from(self.taken)).sqrt();
        let sure = best.abs() - next > LEAD_SIGMAS * deviation && next < NEXT_SHARE * best.abs();
        sure.then_some(SecondaryCodePhase { shift: shift as u64, inverted: best < 0.0 })
    }
}

impl SecondaryCodeSync {
    /// A search for the secondary code `code`.
    pub fn new(code: Vec<i8>) -> Self {
        Self { shifts: Shifts::new(code.len()), code }
    }

    /// Length of the secondary code in code periods.
    pub fn periods(&self) -> usize {
        self.code.len()
    }

    /// Forgets what was taken.
    pub fn clear(&mut self) {
        self.shifts.clear();
    }

    /// The secondary code chip of code period `number`.
    pub fn chip(&self, phase: SecondaryCodePhase, number: u64) -> f64 {
        let length = self.code.len().max(1) as u64;
        self.code.get(((number + phase.shift) % length) as usize).map_or(1.0, |&chip| f64::from(chip))
    }

    /// Takes the prompt (noise of unit variance a component) of code period `number`, in phase lock; gives
    /// the phase when it is beyond doubt.
    pub fn add(&mut self, number: u64, prompt: Complex64) -> Option<SecondaryCodePhase> {
        let length = self.code.len();
        let at = (number % length.max(1) as u64) as usize;
        let ahead = self.code.iter().cycle().skip(at);
        let taken = self.shifts.add(ahead.map(|&chip| f64::from(chip) * prompt.re));
        if taken < LEAST_PROMPTS {
            return None;
        }
        let found = self.shifts.decide();
        if taken >= MOST_CODES.saturating_mul(length as u32).max(10 * LEAST_PROMPTS) {
            self.clear();
        }
        found
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::Normal;
    use super::*;
    use gnss::signal::synthetic::{LONG_BOC, MIXED, QUADRATURE};

    #[test]
    fn every_phase_and_sign_of_every_secondary_code_is_found_and_never_in_noise() {
        let mut normal = Normal::new(31);
        for (signal, component, least_dbhz) in [(&LONG_BOC, 1, 25.0), (&QUADRATURE, 1, 27.0), (&MIXED, 0, 25.0)] {
            let component: &gnss::signal::Component = &signal.components[component];
            let code = component.secondary_code.of(3).unwrap();
            for dbhz in [least_dbhz, 35.0, 50.0] {
                let amplitude = (2.0 * libm::pow(10.0, dbhz / 10.0) * component.period_s()).sqrt();
                let mut most = 0;
                for run in 0..25_u64 {
                    let (shift, inverted) = ((run * 71) % code.len() as u64, run % 2 == 1);
                    let mut sync = SecondaryCodeSync::new(code.clone());
                    let sign = if inverted { -amplitude } else { amplitude };
                    let found = (100_u64..20_000).find_map(|number| {
                        let chip = f64::from(code[((number + shift) % code.len() as u64) as usize]);
                        let prompt = Complex64::new(sign * chip + normal.next(), normal.next());
                        Some((number, sync.add(number, prompt)?))
                    });
                    let (number, phase) = found.unwrap();
                    assert_eq!(phase, SecondaryCodePhase { shift, inverted }, "{signal} {dbhz} {run}");
                    assert_eq!(sync.chip(phase, 7), f64::from(code[((7 + shift) % code.len() as u64) as usize]));
                    most = most.max(number - 99);
                }
                println!("{signal} {dbhz} dB-Hz: {most} periods at most");
            }
            let mut sync = SecondaryCodeSync::new(code);
            for number in 0..20_000 {
                assert_eq!(sync.add(number, Complex64::new(normal.next(), normal.next())), None);
            }
        }
    }
}
