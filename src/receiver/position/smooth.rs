//! Carrier-smoothed code: Hatch's filter, one a satellite, with the variance that is left.
//!
//! The weight of a new code measurement falls from one to interval / window. Code errors of a tracking loop
//! are correlated over its own time constant, so the variance is carried along for correlated noise
//! (first-order loop: correlation exp(−4 B t)) and not assumed to fall with the count. A diverging ionosphere
//! biases the result by twice its rate times the window.
//!
//! Where code and carrier part at a known rate ([`parting`](crate::parting)), that rate is taken
//! off. How much of it the filter has taken in is carried beside its value, so that a better rate corrects
//! the past as well. Two carriers are smoothed in the [`combination`](super::combination) that has no
//! ionosphere.

use std::collections::BTreeMap;

use crate::position::combination::Combination;
use gnss::record::Observation;
use gnss::satellite::Sv;
use gnss::signal::Signal;
use gnss::time::Rate;

/// A gap longer than this breaks the carrier.
const LONGEST_GAP_S: f64 = 1.05;
/// A signal's code and carrier that part by this much in one interval are broken; of a combination by as many
/// times more as its noise is.
const LARGEST_JUMP_M: f64 = 30.0;

/// A smoothed pseudorange.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Smoothed {
    /// Code smoothed by the carrier.
    pub pseudorange_m: f64,
    /// Variance over that of one code measurement.
    pub variance_ratio: f64,
}

#[derive(Clone, Copy, Debug)]
struct State {
    sample: u64,
    pseudorange_m: f64,
    carrier_m: f64,
    locked_s: f64,
    age_s: f64,
    /// Divergence in metres accumulated so far, per hertz of carrier offset.
    parted_m_per_hz: f64,
    /// Variance over the code's variance.
    variance: f64,
    /// Covariance with the latest code error, over the code's variance.
    covariance: f64,
}

/// Key of a filter: a signal of a satellite, or two signals in combination.
type Key = (Sv, &'static Signal, Option<&'static Signal>);

/// Code and carrier as a filter takes them.
struct Input {
    key: Key,
    sample: u64,
    pseudorange_m: f64,
    carrier_m: f64,
    locked_s: f64,
    /// Excess of the carrier's Doppler over the code's, in hertz.
    offset_hz: f64,
    /// Rate of the range for each hertz of that excess, in metres per second.
    metres_per_hz: f64,
    /// Factor of the noise over that of one signal.
    gain: f64,
}

/// Filters of all satellites.
#[derive(Clone, Debug)]
pub struct Smoother {
    window_s: f64,
    bandwidth_hz: f64,
    rate: Rate,
    offsets_hz: BTreeMap<&'static Signal, f64>,
    states: BTreeMap<Key, State>,
}

impl Smoother {
    /// Filters of `window_s` (0 for none) over code loops of `bandwidth_hz`.
    pub fn new(window_s: f64, bandwidth_hz: f64, rate: Rate) -> Self {
        Self { window_s, bandwidth_hz, rate, offsets_hz: BTreeMap::new(), states: BTreeMap::new() }
    }

    /// States by how much the carrier's Doppler of a signal exceeds the code's, in hertz of the carrier.
    pub fn set_carrier_offset(&mut self, signal: &'static Signal, hz: f64) {
        self.offsets_hz.insert(signal, hz);
    }

    /// Excess of a signal's carrier Doppler over its code's, in hertz.
    pub fn carrier_offset_hz(&self, signal: &Signal) -> f64 {
        self.offsets_hz.get(signal).copied().unwrap_or(0.0)
    }

    /// Forgets a satellite.
    pub fn reset(&mut self, sv: Sv) {
        self.states.retain(|key, _| key.0 != sv);
    }

    /// Forgets all satellites' filters of these signals.
    pub fn clear(&mut self, signals: &[&'static Signal]) {
        self.states.retain(|key, _| !is_of(key, signals));
    }

    /// The carriers' counts of these signals go on although lock was broken: the next observation of each
    /// satellite may have been locked again.
    pub fn bridge(&mut self, signals: &[&'static Signal]) {
        let own = self.states.iter_mut().filter(|(key, _)| is_of(key, signals));
        own.for_each(|(_, state)| state.locked_s = f64::NEG_INFINITY);
    }

    /// Takes an observation and gives its smoothed pseudorange.
    pub fn smooth(&mut self, observation: &Observation) -> Smoothed {
        let wavelength_m = observation.signal.wavelength_m(observation.sv);
        self.take(&Input {
            key: (observation.sv, observation.signal, None),
            sample: observation.sample,
            pseudorange_m: observation.pseudorange_m,
            carrier_m: observation.carrier_cycles * wavelength_m,
            locked_s: observation.locked_s,
            offset_hz: self.carrier_offset_hz(observation.signal),
            metres_per_hz: wavelength_m,
            gain: 1.0,
        })
    }

    /// Takes two carriers of a satellite in combination and gives their smoothed pseudorange; its variance is
    /// over that of a code measurement of the combination.
    pub fn smooth_combined(&mut self, pair: &Combination<'_>) -> Smoothed {
        let parted_mps = |row: &Observation| self.carrier_offset_hz(row.signal) * row.signal.wavelength_m(row.sv);
        self.take(&Input {
            key: (pair.first.sv, pair.first.signal, Some(pair.second.signal)),
            sample: pair.first.sample,
            pseudorange_m: pair.pseudorange_m(),
            carrier_m: pair.carrier_m(),
            locked_s: pair.locked_s(),
            // Of the combination, a hertz of which is counted as a metre a second.
            offset_hz: pair.sum(parted_mps(pair.first), parted_mps(pair.second)),
            metres_per_hz: 1.0,
            gain: pair.sigma(1.0, 1.0),
        })
    }

    /// The ionosphere on the first of two carriers by the codes, smoothed by the carriers; its variance is
    /// over that of one measurement by the codes.
    pub fn smooth_dispersion(&mut self, pair: &Combination<'_>) -> Smoothed {
        let parted_mps = |row: &Observation| self.carrier_offset_hz(row.signal) * row.signal.wavelength_m(row.sv);
        self.take(&Input {
            key: (pair.first.sv, pair.first.signal, Some(pair.second.signal)),
            sample: pair.first.sample,
            pseudorange_m: pair.dispersion_m(),
            carrier_m: pair.carrier_dispersion_m(),
            locked_s: pair.locked_s(),
            offset_hz: -pair.dispersed(parted_mps(pair.second) - parted_mps(pair.first)),
            metres_per_hz: 1.0,
            gain: pair.dispersed(std::f64::consts::SQRT_2).abs(),
        })
    }

    fn take(&mut self, input: &Input) -> Smoothed {
        let fresh = State {
            sample: input.sample,
            pseudorange_m: input.pseudorange_m,
            carrier_m: input.carrier_m,
            locked_s: input.locked_s,
            age_s: 0.0,
            parted_m_per_hz: 0.0,
            variance: 1.0,
            covariance: 1.0,
        };
        let next = self.states.get(&input.key).and_then(|old| self.step(old, &fresh, input)).unwrap_or(fresh);
        self.states.insert(input.key, next);
        let pseudorange_m = next.pseudorange_m + input.offset_hz * next.parted_m_per_hz;
        Smoothed { pseudorange_m, variance_ratio: next.variance }
    }

    fn step(&self, old: &State, new: &State, input: &Input) -> Option<State> {
        let passed_s = self.rate.elapsed_s(new.sample.checked_sub(old.sample)?);
        let predicted_m = old.pseudorange_m + new.carrier_m - old.carrier_m;
        let predicted_m = planted!("receiver.smooth.carrier_sign", predicted_m, 2.0 * old.pseudorange_m - predicted_m);
        let parted_m_per_hz = old.parted_m_per_hz + input.metres_per_hz * passed_s;
        let whole = passed_s > 0.0
            && passed_s <= LONGEST_GAP_S
            && new.locked_s > old.locked_s
            && (new.pseudorange_m - predicted_m - input.offset_hz * parted_m_per_hz).abs()
                < LARGEST_JUMP_M * planted!("receiver.smooth.gain", input.gain, 0.0).max(1.0);
        if !whole || self.window_s <= 0.0 {
            return None;
        }
        let age_s = old.age_s + passed_s;
        let weight = (passed_s / (age_s + passed_s).min(self.window_s)).min(1.0);
        let rest = 1.0 - weight;
        let correlation = libm::exp(-4.0 * self.bandwidth_hz * passed_s);
        let carried = correlation * old.covariance;
        Some(State {
            pseudorange_m: predicted_m + weight * (new.pseudorange_m - predicted_m),
            age_s,
            parted_m_per_hz: rest * parted_m_per_hz,
            variance: weight * weight
                + rest * rest * old.variance
                + planted!("receiver.smooth.variance", 2.0, 0.0) * weight * rest * carried,
            covariance: weight + rest * carried,
            ..*new
        })
    }
}

fn is_of((_, first, second): &Key, signals: &[&'static Signal]) -> bool {
    signals.contains(first) || second.is_some_and(|second| signals.contains(&second))
}

#[cfg(test)]
mod tests {
    use super::*;
    use gnss::gps::l1ca::L1_CA;
    use gnss::gps::l5::L5;

    fn observation(k: u64, pseudorange_m: f64, carrier_m: f64) -> Observation {
        Observation {
            sample: k * 100,
            sv: Sv::gps(5),
            signal: &L1_CA,
            sent_s: 0,
            sent_fraction_s: 0.0,
            pseudorange_m,
            carrier_cycles: carrier_m / L1_CA.wavelength_m(Sv::gps(1)),
            doppler_hz: 0.0,
            cn0_dbhz: 45.0,
            locked_s: 1.0 + k as f64 * 0.1,
        }
    }

    fn noise(state: &mut u64) -> f64 {
        // Sum of twelve uniforms.
        (0..12)
            .map(|_| {
                *state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
                (*state >> 11) as f64 / (1_u64 << 53) as f64
            })
            .sum::<f64>()
            - 6.0
    }

    /// Code noise of a first-order loop: correlation exp(−4 B t).
    fn correlated(state: &mut u64, last: f64, bandwidth_hz: f64) -> f64 {
        let a = libm::exp(-4.0 * bandwidth_hz * 0.1);
        a * last + (1.0 - a * a).sqrt() * noise(state)
    }

    #[test]
    fn independent_code_noise_falls_to_one_over_twice_the_window_less_one() {
        let rate = Rate::from_hz(1000.0).unwrap();
        // A loop so fast that samples 0.1 s apart are independent: exp(-400).
        let mut smoother = Smoother::new(3.0, 1000.0, rate);
        let mut last = Smoothed { pseudorange_m: 0.0, variance_ratio: 1.0 };
        for k in 0..1000 {
            last = smoother.smooth(&observation(k, 2e7, 0.0));
        }
        // Window of 30 measurements: 1/59 (theory of Hatch's filter).
        assert!((last.variance_ratio - 1.0 / 59.0).abs() < 1e-9, "{}", last.variance_ratio);
    }

    #[test]
    fn the_stated_variance_is_the_variance_of_correlated_noise() {
        let rate = Rate::from_hz(1000.0).unwrap();
        let (mut state, mut total, mut stated) = (7, 0.0, 0.0);
        let runs = 2000;
        for _ in 0..runs {
            let mut smoother = Smoother::new(10.0, 0.5, rate);
            let mut code = noise(&mut state);
            for k in 0..150 {
                let out = smoother.smooth(&observation(k, code, 0.0));
                code = correlated(&mut state, code, 0.5);
                if k == 149 {
                    total += out.pseudorange_m * out.pseudorange_m;
                    stated = out.variance_ratio;
                }
            }
        }
        // A variance from 2000 independent runs has a relative deviation of sqrt(2/2000) = 3.2 %; four of
        // them.
        let measured = total / f64::from(runs);
        assert!((measured / stated - 1.0).abs() < 0.13, "{measured} {stated}");
        // Far from what independence would promise: 1/199.
        assert!(stated > 4.0 / 199.0);
    }

    #[test]
    fn a_diverging_ionosphere_biases_by_the_window_times_the_divergence() {
        let rate = Rate::from_hz(1000.0).unwrap();
        let mut smoother = Smoother::new(10.0, 0.5, rate);
        let mut bias_m = 0.0;
        for k in 0..2000 {
            let t_s = k as f64 * 0.1;
            // Code +I, carrier −I with I growing 1 mm/s.
            let out = smoother.smooth(&observation(k, 2e7 + 1e-3 * t_s, -1e-3 * t_s));
            bias_m = out.pseudorange_m - (2e7 + 1e-3 * t_s);
        }
        // (N − 1) T 2 İ = 9.9 s × 2 mm/s; the filter's age and rounding of 2e7 m (4e-9) are far below.
        assert!((bias_m + 0.0198).abs() < 1e-5, "{bias_m}");
    }

    #[test]
    fn noise_that_a_combination_amplifies_is_no_break_and_a_jump_beyond_is_one() {
        let mut smoother = Smoother::new(10.0, 0.5, Rate::from_hz(1000.0).unwrap());
        // L1 and L5 have the weights 2.26 and −1.26 (IS-GPS-705, 20.3.3.3.3.3), whose noise is 2.59 times
        // that of one: 20 m of L1 are 45 m of the combination, 40 m are 90 m, of 78 m that are allowed.
        let mut take = |k: u64, jump_m: f64| {
            let first = observation(k, 2e7 + jump_m, 0.0);
            let second = Observation { signal: &L5, carrier_cycles: 0.0, ..observation(k, 2e7, 0.0) };
            smoother.smooth_combined(&Combination::of(&first, &second).unwrap()).variance_ratio
        };
        let noisy: Vec<f64> = (0..200).map(|k| take(k, [0.0, 20.0, 0.0, -20.0][k as usize % 4])).collect();
        assert!(noisy[1..].iter().all(|ratio| *ratio < 1.0) && noisy[199] < 0.1, "{}", noisy[199]);
        assert_eq!(take(200, 40.0), 1.0);
    }

    #[test]
    fn a_break_of_lock_starts_anew() {
        let rate = Rate::from_hz(1000.0).unwrap();
        let mut smoother = Smoother::new(10.0, 0.5, rate);
        for k in 0..50 {
            smoother.smooth(&observation(k, 2e7, 0.0));
        }
        let mut broken = observation(50, 2e7 + 5.0, 77.0);
        broken.locked_s = 0.1;
        assert_eq!(smoother.smooth(&broken), Smoothed { pseudorange_m: 2e7 + 5.0, variance_ratio: 1.0 });
    }
}
