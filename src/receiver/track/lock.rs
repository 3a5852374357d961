//! Phase lock from prompts: a mean cosine of twice the phase error (threshold 0.85 is 16° rms).
//!
//! Before symbols are known it comes from prompts of one code period, whose noise is subtracted. Then it
//! comes from whole symbols, each with the same weight, so that a vanished signal shows at once; what the
//! noise of a symbol takes from the mean cosine is given back. A slip is what a few symbols together show, as
//! many as the noise demands.

use std::collections::VecDeque;

use num_complex::Complex64;

use super::{TrackingSettings, loops};

/// Mean of what was put in, exponential with a number of terms, but the plain mean until that many have come.
#[derive(Clone, Debug)]
pub(super) struct Mean {
    terms: f64,
    count: f64,
    /// Gain of the first terms over that of the plain mean, below two.
    lean: f64,
    values: [f64; 2],
}

impl Mean {
    pub(super) fn new(terms: f64) -> Self {
        Self { terms: terms.max(1.0), count: 0.0, lean: 1.0, values: [0.0; 2] }
    }

    /// One whose first terms weigh the more the later they come, in proportion: what was measured before the
    /// loops had settled fades fast.
    pub(super) fn leaning(terms: f64) -> Self {
        Self { lean: 2.0, ..Self::new(terms) }
    }

    /// A mean with other terms, as if `count` of them had given `values`.
    pub(super) fn with(&self, terms: f64, count: f64, values: [f64; 2]) -> Self {
        let terms = terms.max(1.0);
        Self { terms, count: count.min(terms), lean: self.lean, values }
    }

    pub(super) fn add(&mut self, values: [f64; 2]) {
        self.count += 1.0;
        // Weights 1, 2, 3, … of n terms: the last has 2/(n + 1) of all.
        let weight = ((self.count + self.lean - 1.0) / self.lean).min(self.terms);
        self.count = self.count.min(self.terms * self.lean);
        for (mean, value) in self.values.iter_mut().zip(values) {
            *mean += (value - *mean) / weight;
        }
    }

    pub(super) fn count(&self) -> f64 {
        self.count
    }

    pub(super) fn values(&self) -> [f64; 2] {
        self.values
    }

    /// Replaces the values by others, of as many terms.
    pub(super) fn set(&mut self, values: [f64; 2]) {
        self.values = values;
    }
}

/// Symbols over which phase lock is averaged once they are known.
const LOCK_SYMBOLS: f64 = 6.0;
/// Least time of that average, seconds: six symbols of a millisecond at 36 dB-Hz scatter by a quarter of
/// their mean.
const LOCK_S: f64 = 0.12;
/// Symbols whose mean phase is 60° or more away are taken for a slip.
const SLIP_COSINE: f64 = -0.5;
/// Energy over noise density of the symbols that decide on a slip: 6.5° of thermal noise. One symbol has it
/// from 33 dB-Hz on.
const SLIP_ENERGY: f64 = 40.0;
/// Symbols that decide on a slip, at most.
const SLIP_SYMBOLS: usize = 8;
/// Noise takes this much of a symbol's mean cosine at most: below 22 dB-Hz no phase loop works.
const LEAST_COHERENCE: f64 = 0.7;

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

    /// Takes a prompt whose noise has a power of `noise` (both components), which is not counted as phase
    /// error.
    pub fn add(&mut self, prompt: Complex64, noise: f64) {
        let (i2, q2) = (prompt.re * prompt.re, prompt.im * prompt.im);
        self.mean.add([i2 - q2, i2 + q2 - noise]);
    }

    /// Value of the phase lock, from −1 to 1; 0 where nothing exceeds the noise.
    pub fn value(&self) -> f64 {
        let [difference, sum] = self.mean.values();
        if sum <= 0.0 { 0.0 } else { planted!("receiver.lock.always", (difference / sum).clamp(-1.0, 1.0), 1.0) }
    }

    /// True if the mean has settled.
    pub fn settled(&self) -> bool {
        self.mean.count >= self.mean.terms
    }
}

/// Phase lock by whole symbols.
#[derive(Clone, Debug)]
pub struct SymbolLock {
    mean: Mean,
    /// Squares of both components of the last symbols, as difference and sum, the latest first.
    last: VecDeque<[f64; 2]>,
    /// True while lock that other means showed stays, as too few symbols have come to contradict it.
    is_shown: bool,
}

impl SymbolLock {
    /// Nothing is known of symbols of that duration.
    pub fn new(symbol_s: f64) -> Self {
        Self { mean: Mean::new(LOCK_SYMBOLS.max(LOCK_S / symbol_s)), last: VecDeque::new(), is_shown: false }
    }

    /// The lock that was just shown by other means is the first of the mean. It stays until as many symbols
    /// have come as decide on a slip: one of 2 ms at 36 dB-Hz has 14° of noise.
    pub fn locked(symbol_s: f64) -> Self {
        let mut lock = Self { is_shown: true, ..Self::new(symbol_s) };
        lock.mean.add([1.0, 1.0]);
        lock
    }

    /// Takes the sum of a symbol; `energy` is its energy over the noise density, C/N0 times its duration.
    /// Says whether the phase has slipped.
    pub fn add(&mut self, symbol: Complex64, energy: Option<f64>) -> bool {
        let (i2, q2) = (symbol.re * symbol.re, symbol.im * symbol.im);
        let [difference, sum] = [i2 - q2, i2 + q2];
        // A phasor in Gaussian noise: the mean of cos 2θ is 1 − (1 − e⁻ˣ)/x, x its energy over the noise
        // density.
        let coherence = energy.map_or(1.0, |x| 1.0 + libm::expm1(-x) / x).max(LEAST_COHERENCE);
        self.mean.add([if sum > 0.0 { difference / sum } else { 0.0 }, coherence]);
        self.last.push_front([difference, sum]);
        self.last.truncate(SLIP_SYMBOLS);
        let several = energy.map_or(1.0, |x| (SLIP_ENERGY / x).ceil());
        let several = several.clamp(1.0, SLIP_SYMBOLS as f64) as usize;
        self.is_shown &= self.last.len() < several;
        let latest = self.last.iter().take(several);
        let [difference, sum] = latest.fold([0.0; 2], |[d, s], of| [d + of[0], s + of[1]]);
        self.last.len() >= several && sum > 0.0 && difference < SLIP_COSINE * sum
    }

    /// Value of the phase lock, from −1 to 1; 0 where nothing exceeds the noise.
    pub fn value(&self) -> f64 {
        let [cosine, coherence] = self.mean.values();
        if self.is_shown {
            return 1.0;
        }
        if coherence <= 0.0 { 0.0 } else { (cosine / coherence).clamp(-1.0, 1.0) }
    }

    /// True if the mean has settled.
    pub fn settled(&self) -> bool {
        self.mean.count >= self.mean.terms
    }
}

/// True if C/N0 is below the least one for which a channel is kept ([`TrackingSettings::least_cn0_hz`]). It
/// is false for a signal without an estimate.
pub fn is_weak(cn0_hz: Option<f64>, least_cn0_hz: f64) -> bool {
    cn0_hz.is_some_and(|hz| hz < least_cn0_hz)
}

/// Change of a [`LockState`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LockChange {
    /// The carrier has locked.
    Locked,
    /// The cycle count is broken.
    Broken,
}

/// Lock state of a carrier, as the detectors decide it. The signal is lost when lock or strength has been
/// missing for too long. Instants are counts of the caller's clock, samples or code periods.
#[derive(Clone, Copy, Debug, Default)]
pub struct LockState {
    locked_since: Option<u64>,
    missing_since: Option<u64>,
}

impl LockState {
    /// A carrier that is locked from `now` on.
    pub fn locked(now: u64) -> Self {
        Self { locked_since: Some(now), missing_since: None }
    }

    /// Instant since which the carrier is locked; `None` where it is not.
    pub fn locked_since(&self) -> Option<u64> {
        self.locked_since
    }

    /// True if the carrier is locked.
    pub fn is_locked(&self) -> bool {
        self.locked_since.is_some()
    }

    /// True if a lock has neither been found nor lost so far.
    pub fn is_new(&self) -> bool {
        self.locked_since.is_none() && self.missing_since.is_none()
    }

    /// The carrier is not locked any more, for a reason that does not count against the signal. Gives whether
    /// it was locked.
    pub fn interrupt(&mut self) -> bool {
        self.locked_since.take().is_some()
    }

    /// The phase has slipped. Gives whether the carrier was locked; only then is it a loss of lock.
    pub fn slip(&mut self, now: u64) -> bool {
        let was_locked = self.interrupt();
        if was_locked {
            self.missing_since = Some(now);
        }
        was_locked
    }

    /// Follows the value of phase lock, which counts for a new lock once its mean is `settled`.
    pub fn follow(
        &mut self,
        now: u64,
        (value, settled): (f64, bool),
        weak: bool,
        settings: &TrackingSettings,
    ) -> Option<LockChange> {
        let change = if self.is_locked() {
            (value < settings.phase_unlock_threshold && self.slip(now)).then_some(LockChange::Broken)
        } else if settled && value >= settings.phase_lock_threshold {
            self.locked_since = Some(now);
            Some(LockChange::Locked)
        } else {
            None
        };
        if weak {
            self.missing_since = self.missing_since.or(Some(now));
        } else if self.is_locked() {
            self.missing_since = None;
        }
        change
    }

    /// True if the signal is lost: lock or strength has been missing for `loss_s`. `passed_s` gives the
    /// seconds since an instant.
    pub fn is_lost(&self, passed_s: impl Fn(u64) -> f64, settings: &TrackingSettings) -> bool {
        self.missing_since.is_some_and(|since| passed_s(since) >= settings.loss_s)
    }
}

/// Rotation of the carrier within symbols, between quarters of one. It shows where a Costas loop has settled
/// on a wrong frequency.
#[derive(Clone, Debug, Default)]
pub struct Rotation {
    sum: Complex64,
    before: Option<Complex64>,
    product: Complex64,
    symbols: u32,
}

impl Rotation {
    /// Takes the prompt of code period `position` of a symbol, from one to `group`.
    pub fn add(&mut self, prompt: Complex64, position: u32, group: u32) {
        let quarter = Self::quarter(group);
        if position == 1 {
            (self.sum, self.before) = (Complex64::ZERO, None);
        }
        self.sum += prompt;
        if position.is_multiple_of(quarter) {
            if let Some(before) = self.before.replace(self.sum) {
                self.product += self.sum * before.conj();
            }
            self.sum = Complex64::ZERO;
        }
        self.symbols += u32::from(position == group);
    }

    /// Code periods between what is compared.
    fn quarter(group: u32) -> u32 {
        (group / 4).max(1)
    }

    /// Whole symbols so far.
    pub fn symbols(&self) -> u32 {
        self.symbols
    }

    /// Mean frequency, cycles a code period: within ±1/2 a quarter.
    pub fn cycles(&self, group: u32) -> f64 {
        loops::phase(self.product) / f64::from(Self::quarter(group))
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::Normal;
    use super::*;

    /// A prompt whose noise has unit variance a component.
    fn prompt(normal: &mut Normal, amplitude: f64) -> Complex64 {
        Complex64::new(amplitude + normal.next(), normal.next())
    }

    #[test]
    fn noise_takes_nothing_from_the_mean_cosine_of_symbols_and_looks_like_no_slip_from_25_dbhz_on() {
        for dbhz in [25.0, 27.0, 30.0, 35.0, 45.0] {
            let energy = 0.02 * libm::pow(10.0, dbhz / 10.0);
            let mut normal = Normal::new(3);
            let (mut lock, mut sum, mut slips) = (SymbolLock::new(0.02), 0.0, 0);
            const SYMBOLS: u32 = 20_000;
            for _ in 0..SYMBOLS {
                let symbol = prompt(&mut normal, (2.0 * energy).sqrt());
                slips += u32::from(lock.add(symbol, Some(energy)));
                sum += lock.value();
            }
            let mean = sum / f64::from(SYMBOLS);
            // A cosine's deviation is 0.3 at most here: 0.0021 over these symbols, three of them and as much
            // for the clamp at one.
            assert!((mean - 1.0).abs() < 0.035 && mean <= 1.0 + 1e-12, "{dbhz}: {mean}");
            // Together the symbols that decide have 13° of noise over root two: 60° are more than six
            // deviations.
            assert_eq!(slips, 0, "{dbhz}");
        }
    }

    #[test]
    fn the_first_symbols_after_a_lock_do_not_break_it() {
        let unlock = TrackingSettings::default().phase_unlock_threshold;
        // Symbols of 2 ms as of D2, whose phase has 14° and 18° of noise.
        for dbhz in [36.0, 34.0] {
            let energy = 0.002 * libm::pow(10.0, dbhz / 10.0);
            let mut normal = Normal::new(9);
            let breaks = (0..20_000).filter(|_| {
                let mut lock = SymbolLock::locked(0.002);
                (0..60).any(|_| {
                    let slipped = lock.add(prompt(&mut normal, (2.0 * energy).sqrt()), Some(energy));
                    slipped || lock.value() < unlock
                })
            });
            // The mean of five cosines is four of its deviations above the limit: 6e-5 of them are below.
            let breaks = breaks.count();
            assert!(breaks <= 5, "{dbhz}: {breaks} of 20 000");
        }
    }

    #[test]
    fn a_turn_by_a_right_angle_shows_as_a_slip_within_eight_symbols_at_every_strength() {
        for dbhz in [25.0, 30.0, 33.0, 45.0] {
            let energy = 0.02 * libm::pow(10.0, dbhz / 10.0);
            let mut normal = Normal::new(4);
            let mut lock = SymbolLock::locked(0.02);
            for _ in 0..50 {
                lock.add(prompt(&mut normal, (2.0 * energy).sqrt()), Some(energy));
            }
            let turned = (1..=20).find(|_| {
                let symbol = prompt(&mut normal, (2.0 * energy).sqrt()) * Complex64::I;
                lock.add(symbol, Some(energy))
            });
            assert!(turned.is_some_and(|symbols| symbols <= if dbhz > 33.0 { 1 } else { 8 }), "{dbhz}: {turned:?}");
        }
    }

    #[test]
    fn rotation_within_symbols_is_measured_up_to_half_a_cycle_a_quarter() {
        for hz in [-80.0, -25.0, 0.0, 25.0, 50.0] {
            let mut normal = Normal::new(6);
            let mut rotation = Rotation::default();
            // 30 dB-Hz: a prompt's power is that of its noise.
            for k in 0..500 {
                let (sin, cos) = libm::sincos(std::f64::consts::TAU * hz * f64::from(k) * 1e-3);
                let sign = if (k / 20) % 3 == 0 { -1.0 } else { 1.0 };
                let noise = Complex64::new(normal.next(), normal.next());
                rotation.add(2.0_f64.sqrt() * sign * Complex64::new(cos, sin) + noise, k % 20 + 1, 20);
            }
            assert_eq!(rotation.symbols(), 25);
            // 75 products of two sums of 5: √(2/75)/(5·A²) rad of noise by noise, √(4/75/(5·A²)) of noise by
            // signal, in 5 ms: 2.5 Hz.
            let found_hz = 1e3 * rotation.cycles(20);
            assert!((found_hz - hz).abs() < 7.5, "{hz}: {found_hz}");
        }
    }

    #[test]
    fn the_cross_correlation_of_other_satellites_is_no_rotation() {
        // Eleven satellites 10 dB above, each 21 to 24 dB down in this one's correlator, at differences of
        // Doppler that a prompt's 1 ms does not separate. Products of neighbouring prompts would turn by
        // 0.04 rad for each: up to 7 Hz.
        let mut normal = Normal::new(8);
        let mut worst: f64 = 0.0;
        for trial in 0..200 {
            let others: Vec<(f64, f64)> =
                (0..11).map(|_| (500.0 * normal.next(), 0.15 * normal.next().abs().min(2.0))).collect();
            let mut rotation = Rotation::default();
            for k in 0..500_u32 {
                let mut prompt = Complex64::new(3.4 + normal.next(), normal.next());
                for (number, (hz, share)) in others.iter().enumerate() {
                    let turns = (hz * f64::from(k) * 1e-3 + 0.37 * number as f64).fract();
                    let (sin, cos) = libm::sincos(std::f64::consts::TAU * turns);
                    let bit = if (k / 20 + trial + number as u32).is_multiple_of(2) { 1.0 } else { -1.0 };
                    prompt += Complex64::new(cos, sin) * (3.4 * share * bit);
                }
                rotation.add(prompt, k % 20 + 1, 20);
            }
            worst = worst.max((1e3 * rotation.cycles(20)).abs());
        }
        // A false lock is declared at 10 Hz.
        println!("worst {worst:.2} Hz");
        assert!(worst < 5.0, "{worst} Hz");
    }

    #[test]
    fn a_lock_breaks_at_one_threshold_comes_back_at_the_other_and_is_lost_after_its_time() {
        let settings = TrackingSettings::default();
        let (low, high) = (settings.phase_unlock_threshold, settings.phase_lock_threshold);
        assert!(low < high);
        let passed_s = |now: u64| move |since: u64| (now - since) as f64 * 1e-3;
        let mut state = LockState::default();
        assert_eq!(state.follow(1, (1.0, false), false, &settings), None);
        assert_eq!(state.follow(2, (0.5 * (low + high), true), false, &settings), None);
        assert!(state.is_new() && !state.slip(3));
        assert_eq!(state.follow(4, (high, true), false, &settings), Some(LockChange::Locked));
        assert_eq!(state.locked_since(), Some(4));
        // Between the thresholds nothing changes; below the lower one the lock breaks and its time runs.
        assert_eq!(state.follow(5, (low, true), false, &settings), None);
        assert_eq!(state.follow(6, (low - 0.01, true), false, &settings), Some(LockChange::Broken));
        let limit = (settings.loss_s * 1e3) as u64;
        assert!(!state.is_lost(passed_s(5 + limit), &settings) && state.is_lost(passed_s(6 + limit), &settings));
        // A new lock ends that time, but not for a signal that is too weak, whose time runs on.
        let mut weak = state;
        assert_eq!(state.follow(7, (high, true), false, &settings), Some(LockChange::Locked));
        assert_eq!(weak.follow(7, (high, true), true, &settings), Some(LockChange::Locked));
        assert!(!state.is_lost(passed_s(7 + limit), &settings) && weak.is_lost(passed_s(6 + limit), &settings));
        // An interruption that is no slip starts no time.
        assert!(state.interrupt() && state.is_new());
    }

    #[test]
    fn nothing_gives_finite_numbers() {
        let (mut lock, mut symbols) = (PhaseLock::new(10.0), SymbolLock::new(0.02));
        for _ in 0..200 {
            lock.add(Complex64::ZERO, 2.0);
            assert!(!symbols.add(Complex64::ZERO, Some(0.0)));
        }
        assert_eq!((lock.value(), symbols.value(), Rotation::default().cycles(20)), (0.0, 0.0, 0.0));
    }
}
