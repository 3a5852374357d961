//! Bits of several symbols with known signs, each symbol a code period: where they begin, from prompts in
//! phase lock.
//!
//! A bit of BeiDou's D1 has twenty code periods with the signs of the Neuman-Hofman code, one of D2 has two
//! of one sign. Until it is known where bits begin, signs of prompts are anyone's guess.

use num_complex::Complex64;

/// Code periods before a decision is tried.
const LEAST_PERIODS: u64 = 300;
/// Code periods after which a search begins again: two frames of D2, whose reserved bits change seldom.
const MOST_PERIODS: u64 = 6000;
/// Standard deviations by which the best position leads every other.
const LEAD_SIGMAS: f64 = 5.0;

/// Lower bound of the energy of bits, as a share of what all prompts have in step, both without their noise.
/// Bits of the right position have all of it. Half a cycle a period beside the carrier, and where each period
/// has a sign of its own, a position of D2 has as many pairs in step as not at most, which is half of it, and
/// one of D1 a twentieth.
const LEAST_SHARE: f64 = 0.75;

/// Search for the code period in which bits begin.
#[derive(Clone, Debug)]
pub(super) struct BitSync {
    signs: &'static [i8],
    last: Vec<f64>,
    energies: Vec<f64>,
    taken: u64,
    /// Power of all prompts that were taken.
    power: f64,
    found: Option<u64>,
}

impl BitSync {
    /// Synchronisation for bits of symbols with these signs.
    pub fn new(signs: &'static [i8]) -> Self {
        Self {
            signs,
            last: vec![0.0; signs.len()],
            energies: vec![0.0; signs.len()],
            taken: 0,
            power: 0.0,
            found: None,
        }
    }

    /// Code periods of a bit.
    pub fn periods(&self) -> u32 {
        self.signs.len() as u32
    }

    /// Forgets what was taken.
    pub fn clear(&mut self) {
        *self = Self::new(self.signs);
    }

    /// The sign that code period `number` has within its bit, where bits begin at periods of the residue
    /// `begin`.
    pub fn sign(&self, number: u64, begin: u64) -> f64 {
        let length = self.signs.len() as u64;
        let place = (number + length - begin) % length;
        self.signs.get(place as usize).map_or(1.0, |&sign| f64::from(sign))
    }

    /// Takes the prompt (noise of unit variance a component) of code period `number`, consecutive ones; gives
    /// the residue modulo the bit's length at which bits begin, where it is beyond doubt and the next one
    /// begins a bit.
    pub fn add(&mut self, number: u64, prompt: Complex64) -> Option<u64> {
        let length = self.signs.len() as u64;
        if self.found.is_none() {
            self.found = self.seek(number, length, prompt);
        }
        self.found.filter(|begin| (number + 1) % length == *begin)
    }

    fn seek(&mut self, number: u64, length: u64, prompt: Complex64) -> Option<u64> {
        if let Some(last) = self.last.get_mut((number % length) as usize) {
            *last = prompt.re;
        }
        self.taken += 1;
        self.power += prompt.re * prompt.re;
        if self.taken < length {
            return None;
        }
        // The last `length` prompts are a bit of the position that comes next.
        let begin = ((number + 1) % length) as usize;
        let (late, early) = self.last.split_at(begin.min(self.last.len()));
        let sum: f64 = early.iter().chain(late).zip(self.signs).map(|(soft, sign)| soft * f64::from(*sign)).sum();
        if let Some(energy) = self.energies.get_mut(begin) {
            *energy += sum * sum;
        }
        // Every position has had as many bits now.
        if !(self.taken + 1).is_multiple_of(length) || self.taken < LEAST_PERIODS {
            return None;
        }
        let bits = (self.taken + 1) / length - 1;
        let found = self.decide(bits as f64);
        if self.taken >= MOST_PERIODS {
            self.clear();
        }
        found
    }

    fn decide(&self, bits: f64) -> Option<u64> {
        let (best, most) = self.energies.iter().copied().enumerate().max_by(|a, b| a.1.total_cmp(&b.1))?;
        let others = self.energies.iter().enumerate().filter(|(place, _)| *place != best);
        let next = others.map(|(_, energy)| *energy).fold(0.0, f64::max);
        // A sum of m prompts has noise of variance m. Of two positions one sum has the amplitude a, the other
        // ra where they share as much noise: the difference of squares has 4a²m(1 − r²) + 4m² at most. So
        // bits that do not change, which tell nothing, leave the noise alone.
        let m = self.signs.len() as f64;
        let deviation = (4.0 * m * (most - next) + 4.0 * bits * m * m).sqrt();
        let is_sure = most - next > LEAD_SIGMAS * deviation;
        let in_step = m * m * bits * (self.power / self.taken as f64 - 1.0);
        (is_sure && most - m * bits > LEAST_SHARE * in_step).then_some(best as u64)
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::Normal;
    use super::*;
    use gnss::beidou::d1d2::D1_D2;
    use gnss::satellite::{Sv, System};

    #[test]
    fn bits_of_both_messages_are_found_at_every_place_and_never_in_noise_or_half_a_cycle_a_period_off() {
        // A bit differs from the one before where a normal number is above the limit: one in two, or one in
        // 25 as in subframes of D2 with reserved words. Among n bits these have 0.04n changes of 4a² each, 5
        // σ after some 400 bits.
        for (satellite, dbhz, limit, most_s) in [
            (20, 32.0, 0.0, 2.0),
            (20, 44.0, 0.0, 0.35),
            (2, 36.0, 0.0, 1.0),
            (2, 44.0, 0.0, 0.35),
            (2, 36.0, 1.75, 6.0),
            (2, 44.0, 1.75, 3.0),
        ] {
            let signs = (D1_D2.bit)(Sv { system: System::BeiDou, number: satellite });
            let length = signs.len() as u64;
            let amplitude = (2.0 * libm::pow(10.0, dbhz / 10.0) * 1e-3).sqrt();
            let mut normal = Normal::new(41);
            for begin in 0..length {
                for astray in [false, true] {
                    let (mut sync, mut bit, mut found) = (BitSync::new(signs), 1.0, None);
                    let mut number = 1000;
                    while found.is_none() && number < 1000 + (1e3 * most_s) as u64 {
                        let place = (number + length - begin) % length;
                        if place == 0 && normal.next() > limit {
                            bit = -bit;
                        }
                        let turned = if astray && number % 2 == 1 { -1.0 } else { 1.0 };
                        let soft = turned * bit * f64::from(signs[place as usize]) * amplitude + normal.next();
                        found = sync.add(number, Complex64::new(soft, normal.next()));
                        number += 1;
                    }
                    if astray {
                        assert_eq!(found, None, "{satellite} {dbhz}");
                    } else {
                        assert_eq!(found, Some(begin), "{satellite} {dbhz}");
                        assert_eq!(sync.sign(begin + 3 * length, begin), f64::from(signs[0]));
                    }
                }
            }
            let mut sync = BitSync::new(signs);
            for number in 0..100_000 {
                assert_eq!(sync.add(number, Complex64::new(normal.next(), normal.next())), None);
            }
        }
    }
}
