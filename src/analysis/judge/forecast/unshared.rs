//! Oscillator noise of rates that a receiver's loops do not have in common.
//!
//! All loops of a receiver follow one oscillator, and a fix's drift takes what they have in common. Loops of
//! unlike update times follow it differently, and satellites of one signal are updated at unlike times. The
//! rest is an error of the velocity.
//!
//! White frequency noise h₀ makes steps of the phase, h₀/2 s²/s. Let s(u) be a loop's rate u seconds after a
//! unit step, a the time since its last update, and m(u) the mean of s(u − a) over a. The covariance of
//! signals g and h against a first one is c²·h₀/2·∫(m_g − m_0)(m_h − m_0) du. The variance of a satellite's
//! own part is c²·h₀/2·∫(mean of s² − m²) du. Between updates s is linear, since a discriminator sees the
//! mean phase of an interval. Limits: a is taken as uniform, though it moves slowly in a run. Flicker and
//! random walk are too slow to tell loops apart.

use std::collections::BTreeMap;

use nalgebra::DMatrix;

use crate::expect::loops::{Settings, Theory};
use crate::read::Run;
use gnss::earth::SPEED_OF_LIGHT_MPS;
use gnss::signal::Link;

/// Oscillator noise of rates that a receiver's loops do not have in common.
#[derive(Clone, Debug, Default)]
pub(super) struct Unshared {
    /// Standard deviation of a satellite's own part by signal, m/s.
    own_mps: Vec<f64>,
    /// Covariances of the signals against the first, (m/s)².
    between: DMatrix<f64>,
}

/// Points of the integrals in the shortest update time, and ages of the last update that are averaged.
const POINTS: u32 = 8;

impl Unshared {
    /// Noise of a run's signals, in their order, with the update time of every link in seconds.
    pub fn new(run: &Run, loops: Settings, updates_s: &BTreeMap<Link, f64>) -> Self {
        let theories = run.signals.iter().map(|&signal| {
            let link = run.truth.keys().find(|link| link.signal == signal)?;
            Theory::new(run, loops, &link, *updates_s.get(&link)?)
        });
        let theories: Vec<Option<Theory>> = theories.collect();
        let white = theories.iter().flatten().map(Theory::white_frequency_noise).fold(0.0, f64::max);
        let followers: Vec<Option<Follower>> =
            theories.iter().map(|theory| theory.as_ref().map(Follower::of)).collect();
        Self::of(&followers, white)
    }

    /// Noise of signals in their order, of which those without a loop have none.
    fn of(followers: &[Option<Follower>], white: f64) -> Self {
        let count = followers.len();
        let (mut own, mut between) = (vec![0.0; count], DMatrix::zeros(count, count));
        let held: Vec<(usize, &Follower)> =
            followers.iter().enumerate().filter_map(|(k, of)| Some((k, of.as_ref()?))).collect();
        if !held.is_empty() && white > 0.0 {
            let step_s = held.iter().map(|(_, f)| f.update_s).fold(f64::INFINITY, f64::min) / f64::from(POINTS);
            let end_s = held.iter().map(|(_, f)| f.end_s()).fold(0.0, f64::max);
            let scale = 0.5 * white * SPEED_OF_LIGHT_MPS * SPEED_OF_LIGHT_MPS * step_s;
            for k in 0..(end_s / step_s) as usize {
                let moments: Vec<[f64; 2]> = held.iter().map(|(_, f)| f.moments((k as f64 + 0.5) * step_s)).collect();
                for (&(one, _), &[mean, square]) in held.iter().zip(&moments) {
                    own[one] += scale * (square - mean * mean).max(0.0);
                    for (&(other, _), &[its_mean, _]) in held.iter().zip(&moments) {
                        between[(one, other)] += scale * (mean - moments[0][0]) * (its_mean - moments[0][0]);
                    }
                }
            }
        }
        Self { own_mps: own.into_iter().map(f64::sqrt).collect(), between }
    }

    /// Standard deviation of a satellite's own part, by the index of its signal, m/s.
    pub fn own_mps(&self, signal: usize) -> f64 {
        self.own_mps.get(signal).copied().unwrap_or(0.0)
    }

    pub fn between(&self, one: usize, other: usize) -> f64 {
        self.between.get((one, other)).copied().unwrap_or(0.0)
    }
}

/// Rate of a phase loop after a unit step of its phase.
#[derive(Clone, Debug)]
struct Follower {
    /// Rates from update to update, per second.
    rates_per_s: Vec<f64>,
    update_s: f64,
}

impl Follower {
    fn of(theory: &Theory) -> Self {
        Self { rates_per_s: theory.rates_after_step_per_s(), update_s: theory.update_s }
    }

    /// Time after which nothing is left of a step.
    fn end_s(&self) -> f64 {
        self.rates_per_s.len() as f64 * self.update_s + self.update_s
    }

    /// Mean and mean square of the rate some time after a step, over all ages of the last update.
    fn moments(&self, since_s: f64) -> [f64; 2] {
        let at = |k: usize| self.rates_per_s.get(k).copied().unwrap_or(0.0);
        let (mut mean, mut square) = (0.0, 0.0);
        for age in 0..POINTS {
            let place = since_s / self.update_s - (f64::from(age) + 0.5) / f64::from(POINTS);
            if place > 0.0 {
                let (k, part) = (place as usize, place.fract());
                let rate = at(k) + part * (at(k + 1) - at(k));
                mean += rate / f64::from(POINTS);
                square += rate * rate / f64::from(POINTS);
            }
        }
        [mean, square]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::expect::closed::{exact_loop, rates_after_step, step};

    const TICK_S: f64 = 5e-4;

    /// Rates in cycles a second, tick by tick, of a loop of 18 Hz on a phase given tick by tick, that is
    /// updated `age` ticks after each multiple of its update time.
    fn followed(phases: &[f64], ticks: usize, age: usize) -> Vec<f64> {
        let update_s = ticks as f64 * TICK_S;
        let gains = exact_loop(3, 18.0 * update_s).unwrap().gains;
        let (mut state, mut rates) = ([0.0; 3], vec![0.0; age]);
        for interval in phases[age..].chunks_exact(ticks) {
            rates.extend(std::iter::repeat_n((state[1] + 0.5 * state[2]) / update_s, ticks));
            let mean = interval.iter().sum::<f64>() / ticks as f64;
            state = step(&gains, state, mean - state[0]);
        }
        rates
    }

    /// Number from 0 to 1 by a counter (splitmix64).
    fn uniform(k: u64) -> f64 {
        let z = k.wrapping_mul(0x9e37_79b9_7f4a_7c15);
        let a = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let b = (a ^ (a >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((b ^ (b >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
    }

    fn follower(ticks: usize) -> Option<Follower> {
        let update_s = ticks as f64 * TICK_S;
        let rates = rates_after_step(&exact_loop(3, 18.0 * update_s).unwrap());
        Some(Follower { rates_per_s: rates.into_iter().map(|rate| rate / update_s).collect(), update_s })
    }

    #[test]
    fn loops_of_unlike_updates_part_as_loops_on_one_walk_of_the_phase_do() {
        // 500 s of white frequency noise, h₀/2 = 1e-18 s²/s, in cycles of a carrier of c Hz: 1 cycle/s is 1
        // m/s.
        let (white, count) = (2e-18, 1_000_000);
        let sigma = SPEED_OF_LIGHT_MPS * (0.5 * white * TICK_S).sqrt();
        let mut phase = 0.0;
        let step = |k: u64| {
            // Uniform steps of that variance: sums of hundreds are normal.
            phase += sigma * 12.0_f64.sqrt() * (uniform(k) - 0.5);
            phase
        };
        let walk: Vec<f64> = (0..count).map(step).collect();
        let found = Unshared::of(&[follower(8), follower(20)], white);
        let mean = |ticks: usize| {
            let all: Vec<Vec<f64>> = (0..ticks).map(|age| followed(&walk, ticks, age)).collect();
            let least = all.iter().map(Vec::len).min().unwrap();
            let at = |k: usize| all.iter().map(|rates| rates[k]).sum::<f64>() / ticks as f64;
            let means: Vec<f64> = (0..least).map(at).collect();
            let spread = |rates: &Vec<f64>| (0..least).map(|k| (rates[k] - means[k]).powi(2)).sum::<f64>();
            let own = all.iter().map(spread).sum::<f64>() / (least * ticks) as f64;
            (means, own.sqrt())
        };
        let ((short, short_own), (long, long_own)) = (mean(8), mean(20));
        let apart = short.iter().zip(&long).map(|(one, other)| (one - other).powi(2)).sum::<f64>();
        let apart = (apart / short.len().min(long.len()) as f64).sqrt();
        // 500 s hold 18 000 independent values of loops of 18 Hz: 0.5 % of σ. Sums over ticks in place of
        // integrals: a sixteenth of the square of the tick over the shorter update, 0.1 %; eight ages of all:
        // 1/64 of a variance, 0.8 %.
        let expected = [found.own_mps(0), found.own_mps(1), found.between(1, 1).sqrt()];
        for (found, expected) in [short_own, long_own, apart].into_iter().zip(expected) {
            assert!((found / expected - 1.0).abs() < 0.02, "{found} m/s, theory {expected}");
        }
        assert_eq!(found.between(0, 0), 0.0);
        assert_eq!(found.between(0, 1), 0.0);
    }

    #[test]
    fn a_clock_without_noise_moves_no_loops_apart() {
        let found = Unshared::of(&[follower(8), follower(20)], 0.0);
        assert_eq!([found.own_mps(0), found.own_mps(1), found.between(1, 1)], [0.0; 3]);
    }

    #[test]
    fn a_signal_without_a_loop_has_no_part_and_changes_no_other() {
        let both = Unshared::of(&[follower(8), follower(20)], 2e-18);
        let three = Unshared::of(&[None, follower(8), follower(20)], 2e-18);
        assert_eq!([three.own_mps(0), three.between(0, 2), three.between(2, 0)], [0.0; 3]);
        assert_eq!([three.own_mps(1), three.own_mps(2)], [both.own_mps(0), both.own_mps(1)]);
        assert_eq!(three.between(2, 2), both.between(1, 1));
        assert!(both.between(1, 1) > 0.0);
    }
}
