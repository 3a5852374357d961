//! Carrier-to-noise density, phase lock and symbol synchronisation from one-period prompts.
//!
//! C/N0 compares power within and between the prompts of one symbol (narrow against wide band, as moments), so that it
//! needs no noise floor and counts interference of other satellites as noise. Phase lock is the mean cosine of
//! twice the phase error (threshold 0.85 is 16° rms). Symbol edges are where symbol sums carry most energy.

use num_complex::Complex64;

/// Mean of what was put in, exponential with a number of terms, but the plain mean until that many have come.
#[derive(Clone, Debug)]
struct Mean {
    terms: f64,
    count: f64,
    values: [f64; 2],
}

impl Mean {
    fn new(terms: f64) -> Self {
        Self { terms: terms.max(1.0), count: 0.0, values: [0.0; 2] }
    }

    fn add(&mut self, values: [f64; 2]) {
        self.count = (self.count + 1.0).min(self.terms);
        for (mean, value) in self.values.iter_mut().zip(values) {
            *mean += (value - *mean) / self.count;
        }
    }
}

/// Estimate of C/N0 over groups of `group` prompts in which amplitude and sign are constant.
#[derive(Clone, Debug)]
pub struct Cn0 {
    group: u32,
    period_s: f64,
    seen: u32,
    sum: Complex64,
    power: f64,
    moments: Mean,
}

/// Largest C/N0 reported: a noise-free signal has no other.
pub const LARGEST_CN0_DBHZ: f64 = 100.0;

impl Cn0 {
    /// Averages over `average_s`.
    pub fn new(group: u32, period_s: f64, average_s: f64) -> Self {
        let group = group.max(2);
        let moments = Mean::new(average_s / (period_s * f64::from(group)));
        Self { group, period_s, seen: 0, sum: Complex64::ZERO, power: 0.0, moments }
    }

    /// Takes the next prompt; the first one opens a group. Says whether a group has closed.
    pub fn add(&mut self, prompt: Complex64) -> bool {
        self.sum += prompt;
        self.power += prompt.norm_sqr();
        self.seen += 1;
        if self.seen < self.group {
            return false;
        }
        // With A² the power of the mean prompt and 2σ² that of its noise: E|Σ|² = M²A²+2Mσ², EΣ|·|² = MA²+2Mσ².
        let m = f64::from(self.group);
        let coherent = self.sum.norm_sqr() / m;
        let noise = (self.power - coherent) / (m - 1.0);
        self.moments.add([(coherent - noise) / m, noise]);
        (self.seen, self.sum, self.power) = (0, Complex64::ZERO, 0.0);
        true
    }

    /// In Hz: A²/(2σ²T). `None` before the first group.
    pub fn hz(&self) -> Option<f64> {
        if self.moments.count == 0.0 {
            return None;
        }
        let [signal, noise] = self.moments.values;
        let largest = libm::pow(10.0, LARGEST_CN0_DBHZ / 10.0);
        if signal <= 0.0 {
            return Some(1.0);
        }
        let signal = planted!("receiver.cn0.scale", signal, 1.12 * signal);
        Some((signal / (noise.max(0.0) * self.period_s)).clamp(1.0, largest))
    }
}

/// Symbols over which phase lock is averaged once they are known.
pub const LOCK_SYMBOLS: f64 = 6.0;
/// One symbol whose mean phase is 60° or more away is taken for a slip.
pub const SLIP_COSINE: f64 = -0.5;

/// Mean cosine of twice the phase error.
#[derive(Clone, Debug)]
pub struct PhaseLock {
    mean: Mean,
}

impl PhaseLock {
    /// Averages over so many prompts.
    pub fn new(prompts: f64) -> Self {
        Self { mean: Mean::new(prompts) }
    }

    /// Takes a prompt whose noise has a power of `noise` (both components), which is not counted as phase error.
    pub fn add(&mut self, prompt: Complex64, noise: f64) {
        let (i2, q2) = (prompt.re * prompt.re, prompt.im * prompt.im);
        self.mean.add([i2 - q2, i2 + q2 - noise]);
    }

    /// Takes a strong prompt with the weight of every other, so that a vanished signal shows at once; its own value.
    pub fn add_equal(&mut self, prompt: Complex64) -> f64 {
        let (i2, q2) = (prompt.re * prompt.re, prompt.im * prompt.im);
        let value = if i2 + q2 > 0.0 { (i2 - q2) / (i2 + q2) } else { 0.0 };
        self.mean.add([value, 1.0]);
        value
    }

    /// From −1 to 1; 0 where nothing stands out of the noise.
    pub fn value(&self) -> f64 {
        let [difference, sum] = self.mean.values;
        if sum <= 0.0 { 0.0 } else { planted!("receiver.lock.always", (difference / sum).clamp(-1.0, 1.0), 1.0) }
    }

    /// Whether the mean has run in.
    pub fn settled(&self) -> bool {
        self.mean.count >= self.mean.terms
    }
}

/// Search for the code period in which symbols begin.
#[derive(Clone, Debug)]
pub struct SymbolSync {
    last: Vec<Complex64>,
    energy: Vec<f64>,
    taken: u64,
}

/// Symbols before a decision is tried, and after which a new search begins.
const LEAST_SYMBOLS: u64 = 25;
const MOST_SYMBOLS: u64 = 200;
/// Standard deviations by which the best edge must lead every other: 1e-9 false decisions.
const LEAD_SIGMAS: f64 = 6.0;

impl SymbolSync {
    /// For symbols of so many periods.
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
        let sum: Complex64 = self.last.iter().sum();
        if let Some(energy) = self.energy.get_mut(begin as usize) {
            *energy += sum.re * sum.re;
        }
        let symbols = self.taken / length;
        if symbols < LEAST_SYMBOLS || !self.taken.is_multiple_of(length) {
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
        // Without noise the deviation stays small, yet real edges must be there: each takes 4/length of a symbol's
        // energy from the neighbours, and one edge in twenty symbols is the least believed.
        let edges = 0.2 * most / self.energy.len() as f64;
        (most - second > enough.max(edges)).then_some(best as u64)
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::Normal;
    use super::*;

    #[test]
    fn cn0_is_unbiased_from_35_to_55_dbhz() {
        for dbhz in [35.0, 40.0, 45.0, 50.0, 55.0] {
            let cn0_hz = libm::pow(10.0, dbhz / 10.0);
            let amplitude = (2.0 * cn0_hz * 1e-3).sqrt();
            let mut normal = Normal::new(5);
            let mut estimate = Cn0::new(20, 1e-3, 60.0);
            for k in 0..60_000 {
                let sign = if (k / 20) % 3 == 0 { 1.0 } else { -1.0 };
                estimate.add(Complex64::new(sign * amplitude + normal.next(), normal.next()));
            }
            // 0.14 dB a second (theory 3.5), so 0.02 dB over 60 s; bar three of them, rounded up.
            let found = 10.0 * libm::log10(estimate.hz().unwrap());
            assert!((found - dbhz).abs() < 0.1, "{dbhz}: {found}");
        }
    }

    #[test]
    fn symbols_are_found_at_38_dbhz_at_every_offset_and_never_in_noise() {
        let amplitude = (2.0 * libm::pow(10.0, 3.8) * 1e-3).sqrt();
        let mut normal = Normal::new(11);
        for offset in 0..20 {
            let mut sync = SymbolSync::new(20);
            let mut found = None;
            let mut sign = 1.0;
            for k in 0..4000_u64 {
                if k % 20 == offset && normal.next() > 0.0 {
                    sign = -sign;
                }
                found = found.or(sync.add(k, Complex64::new(sign * amplitude + normal.next(), normal.next())));
            }
            assert_eq!(found, Some(offset));
        }
        let mut sync = SymbolSync::new(20);
        for k in 0..200_000 {
            assert_eq!(sync.add(k, Complex64::new(normal.next(), normal.next())), None);
        }
        // No data: no edge.
        for k in 0..20_000 {
            assert_eq!(sync.add(k, Complex64::new(amplitude + normal.next(), normal.next())), None);
        }
    }

    #[test]
    fn nothing_gives_finite_numbers() {
        let (mut cn0, mut lock, mut sync) = (Cn0::new(20, 1e-3, 1.0), PhaseLock::new(10.0), SymbolSync::new(20));
        for k in 0..2000 {
            cn0.add(Complex64::ZERO);
            lock.add(Complex64::ZERO, 2.0);
            assert_eq!(sync.add(k, Complex64::ZERO), None);
        }
        assert_eq!((cn0.hz(), lock.value()), (Some(1.0), 0.0));
    }
}
