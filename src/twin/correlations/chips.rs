//! Sums over the chips of two codes, kept from one second to the next.
//!
//! Two codes differ by a few chips more or less a second later, and their Dopplers by less than a hertz. So
//! the difference of the Dopplers is rounded to steps, and of most lags the sums are known. A sum depends on
//! the codes, the step and the lag alone: who asked before changes nothing.

use std::collections::BTreeMap;
use std::sync::{Mutex, PoisonError};

use generator::synth::angle::cos_sin;
use gnss::satellite::Sv;
use gnss::signal::Link;

use super::sent::turns;
use super::taps::LANES;

/// Steps of the difference of carriers in cycles a code period: 4 Hz of a code of a millisecond.
const STEP_CYCLES: f64 = 4e-3;
/// Lanes of the sums over a code.
const SUMS: usize = 8;

/// A satellite and the name of its signal.
type Name = (Sv, &'static str);

fn name(link: Link) -> Name {
    (link.sv, link.signal.name)
}

/// Sums of all pairs of codes.
#[derive(Debug, Default)]
pub(super) struct Kept(Mutex<BTreeMap<Name, Pairs>>);

impl Kept {
    /// Pairs of the last second with the code of a link.
    pub fn of(&self, link: Link) -> Pairs {
        let mut all = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        Pairs { before: all.remove(&name(link)).map(|pairs| pairs.now).unwrap_or_default(), now: BTreeMap::new() }
    }

    /// Keeps the pairs of this second with the code of a link.
    pub fn put(&self, link: Link, pairs: Pairs) {
        let mut all = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        all.insert(name(link), pairs);
    }
}

/// Pairs with one code: those of the last second and those of this one, each with the number of the other
/// satellite's ray.
#[derive(Debug, Default)]
pub(super) struct Pairs {
    before: BTreeMap<(Name, usize), Pair>,
    now: BTreeMap<(Name, usize), Pair>,
}

impl Pairs {
    /// The pair with another satellite's ray, of the chips of both codes.
    pub fn of(&mut self, (other, ray): (Link, usize), (own, sent): (&[i8], &[i8])) -> &mut Pair {
        let key = (name(other), ray);
        let before = self.before.remove(&key);
        self.now.entry(key).or_insert_with(|| before.unwrap_or_else(|| Pair::new(own, sent)))
    }
}

/// Means over the chips of a code for each lag of another, in the other's amplitude.
#[derive(Clone, Debug, Default)]
pub(super) struct Means {
    /// First lag in chips.
    pub first_lag: i64,
    /// Real and imaginary parts, in as many lanes as are taken at once, where the other code's period after
    /// has the same sign and where it has the other one.
    pub means: [Vec<Lanes>; 2],
}

/// Real and imaginary part of a number, each in all lanes.
type Lanes = [[f32; LANES]; 2];

/// Two codes.
#[derive(Debug)]
pub(super) struct Pair {
    own: Vec<i8>,
    /// Chips of the other code twice, so that any lag is one piece of it.
    sent: Vec<f32>,
    /// Step of the difference of carriers.
    step: Option<i64>,
    /// Chips of the own code, turned by that difference.
    turned: [Vec<f32>; 2],
    means: Means,
}

impl Pair {
    fn new(own: &[i8], sent: &[i8]) -> Self {
        let sent = sent.iter().chain(sent).map(|chip| f32::from(*chip)).collect();
        Self { own: own.to_vec(), sent, step: None, turned: Default::default(), means: Means::default() }
    }

    /// Means where the carriers differ by so many cycles a chip, from one lag to another.
    pub fn means(&mut self, cycles: f64, (first_lag, last_lag): (i64, i64)) -> Means {
        let step_cycles = STEP_CYCLES / self.own.len() as f64;
        let step = (cycles / step_cycles).round() as i64;
        if self.step != Some(step) {
            self.step = Some(step);
            self.turned = turned(&self.own, step as f64 * step_cycles);
            self.means = Means::default();
        }
        let mut means = Means { first_lag, ..Means::default() };
        for lag in first_lag..=last_lag {
            let known = usize::try_from(lag - self.means.first_lag).ok();
            let [same, other] = self.means.means.each_ref().map(|all| known.and_then(|place| all.get(place)).copied());
            let of_lag = same.zip(other).map_or_else(|| self.mean(lag), |(same, other)| [same, other]);
            means.means.iter_mut().zip(of_lag).for_each(|(all, one)| all.push(one));
        }
        self.means.clone_from(&means);
        means
    }

    fn mean(&self, lag: i64) -> [Lanes; 2] {
        let length = self.own.len();
        let ahead = lag.rem_euclid(length.max(1) as i64) as usize;
        let rest = length - ahead;
        let sum = |from: usize, to: usize| {
            self.turned.each_ref().map(|own| product(&own[from..to], &self.sent[from + ahead..to + ahead]))
        };
        let (before, after) = (sum(0, rest), sum(rest, length));
        let lanes = |of: fn(f32, f32) -> f32| std::array::from_fn(|part| [of(before[part], after[part]); LANES]);
        [lanes(|before, after| before + after), lanes(|before, after| before - after)]
    }
}

/// Chips of a code that turn by so many cycles each, from the middle of the first one on, over the number
/// of chips: real and imaginary parts.
fn turned(code: &[i8], cycles: f64) -> [Vec<f32>; 2] {
    let (step, share) = (turns(cycles), 1.0 / code.len() as f32);
    let mut parts: [Vec<f32>; 2] = Default::default();
    for (chips, number) in code.chunks(SUMS).zip((0..).step_by(SUMS)) {
        let word = |lane: u64| (step.wrapping_mul(number + lane).wrapping_add((step as i64 / 2) as u64) >> 32) as u32;
        let (cos, sin) = cos_sin::<SUMS>(&std::array::from_fn(|lane| word(lane as u64)));
        for (part, value) in parts.iter_mut().zip([cos, sin]) {
            part.extend(chips.iter().zip(value).map(|(chip, value)| f32::from(*chip) * value * share));
        }
    }
    parts
}

/// Sum of products, the same on every processor.
fn product(a: &[f32], b: &[f32]) -> f32 {
    let mut sums = [0.0; SUMS];
    let (a, b) = (a.chunks_exact(SUMS), b.chunks_exact(SUMS));
    let rest: f32 = a.remainder().iter().zip(b.remainder()).map(|(a, b)| a * b).sum();
    for (a, b) in a.zip(b) {
        for lane in 0..SUMS {
            sums[lane] += a[lane] * b[lane];
        }
    }
    sums.iter().sum::<f32>() + rest
}
