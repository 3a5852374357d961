//! Symbol synchronisation: edges are where the sums over a symbol carry most energy.

use num_complex::Complex64;

/// Search for the code period in which symbols begin.
#[derive(Clone, Debug)]
pub struct SymbolSync {
    last: Vec<Complex64>,
    energy: Vec<f64>,
    taken: u64,
}

/// Symbols before a decision is tried.
const LEAST_SYMBOLS: u64 = 25;
/// Symbols after which a new search begins: those of a pull-in's default limit, 6 s.
const MOST_SYMBOLS: u64 = 300;
/// Standard deviations by which the best edge must lead every other. Where no symbol turns, noise alone leads
/// a neighbour by as much with 3e-7, and it has to lead both; where symbols turn, it has to outweigh them
/// first.
const LEAD_SIGMAS: f64 = 5.0;

impl SymbolSync {
    /// Synchronisation for symbols of `periods` code periods.
    pub fn new(periods: u32) -> Self {
        let periods = periods.max(1) as usize;
        Self { last: vec![Complex64::ZERO; periods], energy: vec![0.0; periods], taken: 0 }
    }

    /// Takes the prompt (noise of unit variance a component) of code period `number`, consecutive ones;
    /// gives the residue modulo the symbol's length at which symbols begin, when it is beyond doubt.
    pub fn add(&mut self, number: u64, prompt: Complex64) -> Option<u64> {
        let length = self.last.len() as u64;
        let slot = (number % length) as usize;
        if let Some(last) = self.last.get_mut(slot) {
            *last = prompt;
        }
        self.taken += 1;
        if self.taken < length {
            return None;
        }
        // The last `length` prompts are the symbol of the edge that comes next.
        let begin = (number + planted!("receiver.symbol_sync", 1, 2)) % length;
        // Lanes do not wait for each other's sums.
        let (lanes, rest) = self.last.as_chunks::<4>();
        let lanes = lanes.iter().fold([0.0; 4], |sum: [f64; 4], some| std::array::from_fn(|k| sum[k] + some[k].re));
        let sum = lanes.into_iter().chain(rest.iter().map(|prompt| prompt.re)).sum::<f64>();
        if let Some(energy) = self.energy.get_mut(begin as usize) {
            *energy += sum * sum;
        }
        // Every position has had as many symbols now: one more would win where no symbol turns.
        if !(self.taken + 1).is_multiple_of(length) {
            return None;
        }
        let symbols = (self.taken + 1) / length - 1;
        if symbols < LEAST_SYMBOLS {
            return None;
        }
        let found = self.decide();
        if found.is_some() || symbols >= MOST_SYMBOLS {
            *self = Self::new(length as u32);
        }
        found
    }

    fn decide(&self) -> Option<u64> {
        let (best, most) = self.energy.iter().copied().enumerate().max_by(|a, b| a.1.total_cmp(&b.1))?;
        let second = self.energy.iter().enumerate().filter(|(k, _)| *k != best).map(|(_, &e)| e).fold(0.0, f64::max);
        // Neighbouring sums differ by two prompts (variance 2) and add up to twice the symbol's amplitude:
        // each difference of energies has a deviation of 2·sqrt(2)·amplitude, amplitude² = most/symbols.
        let deviation = (8.0 * most).sqrt();
        let enough = LEAD_SIGMAS * deviation;
        // Without noise the deviation stays small, yet real edges must be there: each takes 4/length of a
        // symbol's energy from the neighbours, and one edge in twenty symbols is the least believed.
        let edges = 0.2 * most / self.energy.len() as f64;
        (most - second > enough.max(edges)).then_some(best as u64)
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::Normal;
    use super::*;

    fn add(sync: &mut SymbolSync, number: u64, sign: f64, amplitude: f64, normal: &mut Normal) -> Option<u64> {
        sync.add(number, Complex64::new(sign * amplitude + normal.next(), normal.next()))
    }

    #[test]
    fn symbols_are_found_from_27_dbhz_on_at_every_offset_and_never_in_noise() {
        let mut normal = Normal::new(11);
        for (dbhz, most_s) in [(27.0, 5), (30.0, 3), (38.0, 2), (55.0, 2)] {
            let amplitude = (2.0 * libm::pow(10.0, dbhz / 10.0) * 1e-3).sqrt();
            for offset in 0..20 {
                let mut sync = SymbolSync::new(20);
                let (mut found, mut sign) = (None, 1.0);
                for k in 0..1000 * most_s {
                    if k % 20 == offset && normal.next() > 0.0 {
                        sign = -sign;
                    }
                    found = found.or(add(&mut sync, k, sign, amplitude, &mut normal));
                }
                assert_eq!(found, Some(offset), "{dbhz}");
            }
        }
        let mut sync = SymbolSync::new(20);
        for k in 0..200_000 {
            assert_eq!(add(&mut sync, k, 1.0, 0.0, &mut normal), None);
        }
    }

    #[test]
    fn no_edge_is_found_where_no_symbol_turns_however_strong_the_signal_and_wherever_the_search_begins() {
        for dbhz in [30.0, 38.0, 45.0, 60.0] {
            let amplitude = (2.0 * libm::pow(10.0, dbhz / 10.0) * 1e-3).sqrt();
            for first in 0..20 {
                let mut normal = Normal::new(12 + first);
                let mut sync = SymbolSync::new(20);
                for k in first..first + 10_000 {
                    assert_eq!(add(&mut sync, k, 1.0, amplitude, &mut normal), None, "{dbhz} from {first}");
                }
            }
        }
    }

    #[test]
    fn nothing_gives_no_edge() {
        let mut sync = SymbolSync::new(20);
        assert!((0..20_000).all(|k| sync.add(k, Complex64::ZERO).is_none()));
    }
}
