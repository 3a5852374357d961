//! Carrier-to-noise density from prompts of one code period, before symbols are known and after.
//!
//! **Before.** No bit edge may touch the estimate, wherever it lies, and neither may the carrier's residual
//! rotation. The signal is the modulus of the mean product of neighbouring prompts, whose noise is
//! independent; one pair in a symbol spans an edge and half of these turn its sign, so the mean is 1 − 1/M of
//! the power for M periods a symbol. The noise is a reference: the power of a correlator with the same code
//! at a delay where the code's own correlation vanishes. It meets the same filters, interference and
//! satellites as the prompt does, so multiple access counts as noise.
//!
//! Where each prompt has a sign of its own (symbols of one period, an unknown secondary code) the signal is
//! what the power of prompts exceeds the reference by.
//!
//! **After.** Power within and between the M prompts of a symbol (narrow against wide band, as moments): all
//! noise is within. It is taken along the mean prompt alone. Across it the carrier loop's own jitter comes on
//! top, at any C/N0 by 2·T·B of the noise's 1 in a loop of bandwidth B: 0.3 dB of the sum for 4 ms and 18
//! Hz, 0.7 for 10 ms. What prompts differ by from their mean is independent of the mean, so its direction
//! biases nothing. The reference is not needed any more.
//!
//! **Spread.** With s = T·C/N0 and N periods averaged (an exponential mean of N periods counts as 2N, one
//! whose weights grow linearly as 3N/4) the relative variance is that of the signal, (4s + 1)/2s² before and
//! (2s + 1/M)/s² after, and that of the noise, 1 and 2M/(M − 1), over N: [`relative_sigma`]. With 0.3 s
//! before, it is 1.0 dB at 25 dB-Hz, 0.5 at 30 and 0.26 from 45 on; with the default second after, 0.29, 0.20
//! and 0.14.

use num_complex::Complex64;

use super::lock::Mean;

/// Estimate of C/N0.
#[derive(Clone, Debug)]
pub struct Cn0 {
    period_s: f64,
    average_periods: f64,
    /// Code periods a symbol of this signal.
    group: u32,
    /// True if every prompt has its own sign. The signal's power is then the excess over the noise.
    single: bool,
    known: bool,
    previous: Option<Complex64>,
    seen: u32,
    /// Sum of a symbol's prompts so far.
    sum: Complex64,
    /// Sum of their powers.
    power: f64,
    /// Sum of their squares.
    square: Complex64,
    /// Mean product of neighbours while symbols are unknown, then the signal's power itself.
    signal: Mean,
    /// Power of a prompt's noise, both components.
    noise: Mean,
}

/// Largest C/N0 reported: a noise-free signal has no other.
pub const LARGEST_CN0_DBHZ: f64 = 100.0;
/// Largest C/N0 reported, in hertz.
const LARGEST_CN0_HZ: f64 = 1e10;
/// Periods that are averaged before the first value is given while symbols are unknown.
const LEAST_PERIODS: f64 = 50.0;

impl Cn0 {
    /// An estimator for symbols of `group` code periods whose edges are unknown, averaged over `average_s`.
    pub fn new(group: u32, period_s: f64, average_s: f64) -> Self {
        let average_periods = (average_s / period_s).max(1.0);
        Self {
            period_s,
            average_periods,
            group: group.max(1),
            single: false,
            known: false,
            previous: None,
            seen: 0,
            sum: Complex64::ZERO,
            power: 0.0,
            square: Complex64::ZERO,
            signal: Mean::leaning(average_periods),
            noise: Mean::new(average_periods),
        }
    }

    /// An estimator for prompts each of which has its own sign.
    pub fn of_single_periods(period_s: f64, average_s: f64) -> Self {
        Self { single: true, ..Self::new(1, period_s, average_s) }
    }

    /// Prompts have no signs any more: they are summed in groups.
    pub fn wiped(&self, group: u32) -> Self {
        let signal = self.unknown_signal();
        let mut wiped = Self { group: group.max(1), single: false, previous: None, ..self.clone() };
        let share = wiped.share();
        wiped.signal = self.signal.with(self.average_periods, self.signal.count(), [signal * share, 0.0]);
        wiped
    }

    /// Aligns the groups with symbols: the next prompt opens a symbol. The means so far are kept.
    pub fn know_symbols(&mut self) {
        self.open_symbol();
        if self.known || self.group < 2 {
            return;
        }
        self.known = true;
        let (terms, m) = (self.average_periods / f64::from(self.group), f64::from(self.group));
        let signal = self.unknown_signal();
        self.signal = self.signal.with(terms, self.signal.count() / m, [signal, 0.0]);
        self.noise = self.noise.with(terms, self.noise.count() / m, self.noise.values());
    }

    /// Edges of symbols are unknown again.
    pub fn forget_symbols(&mut self) {
        if !self.known {
            return;
        }
        self.known = false;
        let m = f64::from(self.group);
        let [signal, _] = self.signal.values();
        // Rotation may be another now, so what was known fades like what is new.
        self.signal = Mean::leaning(self.average_periods).with(
            self.average_periods,
            (self.signal.count() * m).min(LEAST_PERIODS),
            [signal.max(0.0) * self.share(), 0.0],
        );
        self.noise = self.noise.with(self.average_periods, self.noise.count() * m, self.noise.values());
        self.previous = None;
    }

    /// The signal is `gain` times as strong in power from now on.
    pub fn raise(&mut self, gain: f64) {
        let [re, im] = self.signal.values();
        // Of single periods the noise is in there too.
        let noise = if self.single && !self.known { self.noise.values()[0] } else { 0.0 };
        self.signal.set([noise + gain * (re - noise), gain * im]);
    }

    /// True if [`Self::add`] needs the noise reference.
    pub fn needs_reference(&self) -> bool {
        !self.known
    }

    /// Takes the next prompt and, while edges are unknown, the power that the noise reference shows beside
    /// it.
    pub fn add(&mut self, prompt: Complex64, reference: Option<f64>) {
        if self.known {
            self.add_in_symbol(prompt);
            return;
        }
        if let Some(power) = reference {
            self.noise.add([power, 0.0]);
        }
        if self.single {
            self.signal.add([prompt.norm_sqr(), 0.0]);
        } else if let Some(previous) = self.previous.replace(prompt) {
            let product = prompt * previous.conj();
            self.signal.add([product.re, product.im]);
        }
    }

    fn add_in_symbol(&mut self, prompt: Complex64) {
        self.sum += prompt;
        self.power += prompt.norm_sqr();
        self.square += prompt * prompt;
        self.seen += 1;
        if self.seen < self.group {
            return;
        }
        // With A² the power of the mean prompt and 2σ² that of its noise: E|Σ|² = M²A² + 2Mσ². Of a prompt
        // p the part along Σ has the power (|p|² + Re(p²·Σ*²/|Σ|²))/2, which over all is MA² + Mσ².
        let m = f64::from(self.group);
        let total = self.sum.norm_sqr();
        let along = if total > 0.0 { (self.square * self.sum.conj().powi(2)).re / total } else { 0.0 };
        let coherent = total / m;
        let noise = (self.power + along - 2.0 * coherent) / (m - 1.0);
        self.signal.add([(coherent - noise) / m, 0.0]);
        self.noise.add([noise, 0.0]);
        self.open_symbol();
    }

    fn open_symbol(&mut self) {
        (self.seen, self.sum, self.power, self.square) = (0, Complex64::ZERO, 0.0, Complex64::ZERO);
    }

    /// Share of the mean product of neighbouring prompts that remains with a symbol's edges.
    fn share(&self) -> f64 {
        if self.group < 2 { 1.0 } else { 1.0 - 1.0 / f64::from(self.group) }
    }

    fn unknown_signal(&self) -> f64 {
        let [re, im] = self.signal.values();
        if self.single {
            return re - self.noise.values()[0];
        }
        Complex64::new(re, im).norm() / self.share()
    }

    /// C/N0 in hertz: A²/(2σ²T). `None` before enough has been seen.
    pub fn hz(&self) -> Option<f64> {
        let least = if self.known { 1.0 } else { LEAST_PERIODS };
        if self.signal.count() < least || self.noise.count() < 1.0 {
            return None;
        }
        let signal = if self.known { self.signal.values()[0] } else { self.unknown_signal() };
        if signal <= 0.0 {
            return Some(1.0);
        }
        let signal = planted!("receiver.cn0.scale", signal, 1.12 * signal);
        Some((signal / (self.noise.values()[0].max(0.0) * self.period_s)).clamp(1.0, LARGEST_CN0_HZ))
    }

    /// Power of a prompt's noise, both components; `None` before there is one.
    pub fn noise(&self) -> Option<f64> {
        (self.noise.count() >= 1.0).then(|| self.noise.values()[0])
    }
}

/// Relative standard deviation of the estimate of a steady C/N0 from as many equally weighted periods, those
/// of the signal and those of the noise; a decibel is 0.23. `symbol` is the length of symbols whose edges are
/// known.
pub fn relative_sigma(cn0_hz: f64, period_s: f64, symbol: Option<u32>, [signal, noise]: [f64; 2]) -> f64 {
    let s = cn0_hz * period_s;
    let [of_signal, of_noise] = match symbol {
        None => [(4.0 * s + 1.0) / (2.0 * s * s), 1.0],
        Some(m) => {
            let m = f64::from(m);
            [(2.0 * s + 1.0 / m) / (s * s), 2.0 * m / (m - 1.0)]
        }
    };
    (of_signal / signal + of_noise / noise).sqrt()
}

#[cfg(test)]
mod tests {
    use super::super::tests::Normal;
    use super::*;

    /// Feeds prompts of 1 ms with random symbols whose edges lie at `offset`, that turn by `hz`, in noise of
    /// `noise` times unit variance a component.
    fn feed(estimate: &mut Cn0, normal: &mut Normal, dbhz: f64, hz: f64, offset: u32, noise: f64, periods: u32) {
        let amplitude = (2.0 * noise * libm::pow(10.0, dbhz / 10.0) * 1e-3).sqrt();
        let mut sign = 1.0;
        let mut draw = |scale: f64| Complex64::new(scale * normal.next(), scale * normal.next());
        for k in 0..periods {
            if k % 20 == offset && draw(1.0).re > 0.0 {
                sign = -sign;
            }
            let (sin, cos) = libm::sincos(std::f64::consts::TAU * 1e-3 * hz * f64::from(k));
            let prompt = Complex64::new(cos, sin) * (sign * amplitude) + draw(noise.sqrt());
            let reference = draw(noise.sqrt()).norm_sqr();
            estimate.add(prompt, Some(reference));
        }
    }

    fn dbhz(estimate: &Cn0) -> f64 {
        10.0 * libm::log10(estimate.hz().unwrap())
    }

    /// Mean and deviation in decibels of `runs` estimates after `periods`.
    fn spread(runs: u32, of: impl Fn(u64) -> f64) -> (f64, f64) {
        let values: Vec<f64> = (0..u64::from(runs)).map(of).collect();
        let mean = values.iter().sum::<f64>() / f64::from(runs);
        (mean, (values.iter().map(|x| (x - mean) * (x - mean)).sum::<f64>() / f64::from(runs)).sqrt())
    }

    #[test]
    fn before_symbols_are_known_it_is_right_within_a_decibel_after_three_tenths_of_a_second_wherever_bits_begin() {
        for expected in [25.0, 30.0, 37.0, 45.0, 53.6, 60.0] {
            for (offset, hz, noise) in [(0, 0.0, 1.0), (7, 60.0, 1.0), (19, -90.0, 0.3)] {
                let (mean, sigma) = spread(200, |run| {
                    let mut estimate = Cn0::new(20, 1e-3, 1.0);
                    feed(&mut estimate, &mut Normal::new(100 + run), expected, hz, offset, noise, 300);
                    dbhz(&estimate)
                });
                // 300 periods, the later with the greater weight; a decibel is 23 %. Few bits turn or many:
                // another 0.1 dB. The logarithm of what scatters by a share s is low by s²/2: 0.1 dB at 25
                // dB-Hz.
                let stated =
                    relative_sigma(libm::pow(10.0, expected / 10.0), 1e-3, None, [0.75 * 300.0, 300.0]) / 0.2303;
                println!("{expected} dB-Hz, edge {offset}: {mean:.2} ± {sigma:.2} dB, stated {stated:.2}");
                let bar = 0.15 + 3.0 * stated / 200_f64.sqrt();
                assert!((mean - expected).abs() < bar, "{expected} {offset}: {mean}");
                assert!(
                    (sigma / libm::hypot(stated, 0.1) - 1.0).abs() < 0.25,
                    "{expected} {offset}: {sigma} for {stated}"
                );
            }
        }
    }

    #[test]
    fn once_symbols_are_known_it_is_unbiased_from_25_to_60_dbhz_and_scatters_as_stated() {
        for expected in [25.0, 30.0, 35.0, 45.0, 60.0] {
            let (mean, sigma) = spread(100, |run| {
                let mut estimate = Cn0::new(20, 1e-3, 1.0);
                estimate.know_symbols();
                feed(&mut estimate, &mut Normal::new(300 + run), expected, 0.0, 0, 1.0, 1000);
                dbhz(&estimate)
            });
            let stated = relative_sigma(libm::pow(10.0, expected / 10.0), 1e-3, Some(20), [1000.0; 2]) / 0.2303;
            println!("{expected} dB-Hz: {mean:.3} ± {sigma:.3} dB, stated {stated:.3}");
            assert!((mean - expected).abs() < 0.03 + 0.3 * stated, "{expected}: {mean}");
            // 100 values know their deviation to 7 %.
            assert!((sigma / stated - 1.0).abs() < 0.25, "{expected}: {sigma} for {stated}");
        }
    }

    #[test]
    fn a_carrier_loop_that_trembles_takes_nothing_from_it() {
        for (period_s, group) in [(0.004, 25), (0.01, 10)] {
            let (expected, sigma) = (45.0, 3.4_f64.to_radians());
            let cn0_hz = libm::pow(10.0, 0.1 * expected);
            let amplitude = (2.0 * period_s * cn0_hz).sqrt();
            let (mean, _) = spread(100, |run| {
                let mut normal = Normal::new(500 + run);
                let mut estimate = Cn0::new(group, period_s, 1.0);
                estimate.know_symbols();
                for _ in 0..20 * group {
                    let (sin, cos) = libm::sincos(sigma * normal.next());
                    let noise = Complex64::new(normal.next(), normal.next());
                    estimate.add(amplitude * Complex64::new(cos, sin) + noise, None);
                }
                dbhz(&estimate)
            });
            // The trembling has 0.44 and 1.1 of the power of noise across the carrier: 0.9 and 1.9 dB if
            // that counted. It shortens the mean by half its variance, 0.015 dB of power.
            let stated = relative_sigma(cn0_hz, period_s, Some(group), [20.0 * f64::from(group); 2]) / 0.2303;
            assert!((mean + 0.015 - expected).abs() < 0.01 + 0.3 * stated, "{period_s}: {mean}, {stated}");
        }
    }

    #[test]
    fn what_was_measured_stays_when_symbols_become_known_or_are_lost() {
        for expected in [30.0, 45.0, 55.0] {
            let mut normal = Normal::new(77);
            let mut estimate = Cn0::new(20, 1e-3, 1.0);
            feed(&mut estimate, &mut normal, expected, 10.0, 5, 1.0, 1005);
            let before = dbhz(&estimate);
            estimate.know_symbols();
            assert!((dbhz(&estimate) - before).abs() < 1e-9);
            feed(&mut estimate, &mut normal, expected, 0.0, 0, 1.0, 1000);
            let known = dbhz(&estimate);
            estimate.forget_symbols();
            assert!((dbhz(&estimate) - known).abs() < 1e-9);
            feed(&mut estimate, &mut normal, expected, -40.0, 5, 1.0, 500);
            for value in [before, known, dbhz(&estimate)] {
                // 0.26 dB at 30 dB-Hz in a second known, 0.5 dB in half a second unknown; three of them.
                assert!((value - expected).abs() < if expected < 40.0 { 1.5 } else { 0.6 }, "{expected}: {value}");
            }
        }
    }

    #[test]
    fn a_vanished_signal_reads_below_the_loss_threshold_and_nothing_gives_finite_numbers() {
        let mut estimate = Cn0::new(20, 1e-3, 1.0);
        feed(&mut estimate, &mut Normal::new(5), -30.0, 0.0, 3, 1.0, 1000);
        assert!(dbhz(&estimate) < 20.0, "{}", dbhz(&estimate));
        let mut nothing = Cn0::new(20, 1e-3, 1.0);
        assert_eq!((nothing.hz(), nothing.noise()), (None, None));
        for _ in 0..2000 {
            nothing.add(Complex64::ZERO, Some(0.0));
        }
        assert_eq!(nothing.hz(), Some(1.0));
        nothing.know_symbols();
        for _ in 0..2000 {
            nothing.add(Complex64::ONE, None);
        }
        // Without noise there is no other figure.
        assert_eq!(dbhz(&nothing), LARGEST_CN0_DBHZ);
        assert_eq!(LARGEST_CN0_HZ, libm::pow(10.0, LARGEST_CN0_DBHZ / 10.0));
    }
}
