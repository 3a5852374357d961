//! Samples that are missing in a recording, or are in it twice, recognised from all channels at once.
//!
//! n missing samples put the codes of all satellites ahead of where they are expected by n/rate seconds: by
//! the same number of chips, a whole number of samples. No satellite, antenna or oscillator does that. Four
//! steps find n:
//! 1. A [`Trend`] predicts each code from the last seconds. A common step beyond it, or power that vanishes
//!    on most channels at once, is a suspicion ([`common_step`]).
//! 2. A [`scan`] correlates at all delays for all channels together and finds n modulo a code period.
//! 3. [`turned_by`] finds by how many code periods, modulo a symbol, the turns of the prompts' signs are
//!    displaced.
//! 4. A satellite's code moves by its own Doppler in the time that is missing: a [`Fit`] of the codes over
//!    the Dopplers finds that time to milliseconds, so that whole symbols are known too, and n to the sample.
//!
//! **Noise.** At 45 dB-Hz 50 ms of discriminators have 0.010 chip: a sample at 2.6 Msps is 0.39 chip, at 10
//! Msps 0.10. A suspicion needs six deviations of at least three satellites' common step, 2e-9 a look: with
//! 20 looks a second once in ten months by noise. It means nothing by itself: where the scan finds no
//! displaced code, the fit has to give a whole number of samples other than zero. Exact multiples of a
//! symbol's length (20 ms) move codes by their Doppler alone, 0.03 chip: the mean of eight looks shows them.

use std::collections::VecDeque;
use std::fmt;

use serde::Serialize;

pub mod scan;

/// Looks that a trend remembers: five seconds.
const LOOKS: usize = 100;
/// Looks before it predicts.
const LEAST_LOOKS: usize = 6;
/// Least number of satellites that have to agree.
const LEAST_CHANNELS: usize = 3;
/// Least share of the satellites that has to agree.
const AGREEING_SHARE: f64 = 0.66;
/// Standard deviations within which channels agree.
const AGREEING_SIGMAS: f64 = 5.0;
/// Difference in chips within which channels agree, for errors other than noise (multipath).
const AGREEING_CHIPS: f64 = 0.03;
/// Standard deviations beyond which a common step is suspicious.
const SUSPICIOUS_SIGMAS: f64 = 6.0;
/// Share of a sample beyond which a common step is suspicious.
const SUSPICIOUS_SAMPLES: f64 = 0.3;
/// Seconds of Doppler are suspicious beyond as many deviations and this.
const SUSPICIOUS_S: f64 = 5e-3;
/// Standard deviations by which the mean product of neighbouring prompts has to fall where signs turn.
const TURN_SIGMAS: f64 = 6.0;
/// Share of the expected fall that it has to reach too. The expectation is a turn at every other symbol.
const TURN_SHARE: f64 = 0.25;

/// The way of one channel's code against its carrier: a straight line through the last looks.
#[derive(Clone, Debug, Default)]
pub struct Trend {
    /// Looks: seconds and chips.
    looks: VecDeque<(f64, f64)>,
    power: f64,
}

/// Code phase that a trend forecasts, and its variance over that of a look.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Expected {
    /// Code, in chips.
    pub chips: f64,
    /// Variance of the forecast over that of a look.
    pub variance_ratio: f64,
}

impl Trend {
    /// Forgets everything.
    pub fn clear(&mut self) {
        *self = Self::default();
    }

    /// Takes a look at `t_s` that saw the code at `chips` with prompts of `power`.
    pub fn take(&mut self, t_s: f64, chips: f64, power: f64) {
        self.looks.push_back((t_s, chips));
        if self.looks.len() > LOOKS {
            self.looks.pop_front();
        }
        self.power += (power - self.power) / self.looks.len() as f64;
    }

    /// Mean power of the prompts.
    pub fn power(&self) -> f64 {
        self.power
    }

    /// Forecast of the code phase at `t_s`, in seconds.
    pub fn forecast(&self, t_s: f64) -> Option<Expected> {
        let (n, &(last_s, _)) = (self.looks.len(), self.looks.back()?);
        if n < LEAST_LOOKS {
            return None;
        }
        let count = n as f64;
        let mean_s = self.looks.iter().map(|look| look.0 - last_s).sum::<f64>() / count;
        let mean_chips = self.looks.iter().map(|look| look.1).sum::<f64>() / count;
        let (mut square, mut product) = (0.0, 0.0);
        for (look_s, chips) in &self.looks {
            let from_s = look_s - last_s - mean_s;
            square += from_s * from_s;
            product += from_s * (chips - mean_chips);
        }
        if square <= 0.0 {
            return None;
        }
        let ahead_s = t_s - last_s - mean_s;
        Some(Expected {
            chips: mean_chips + product / square * ahead_s,
            variance_ratio: 1.0 / count + ahead_s * ahead_s / square,
        })
    }
}

/// One channel's code beyond what was expected, and its Doppler.
#[derive(Clone, Copy, Debug)]
pub struct Step {
    /// Code, in chips.
    pub chips: f64,
    /// Standard deviation of the code phase, in chips.
    pub sigma_chips: f64,
    /// Chips a second that the code gains by Doppler.
    pub doppler_chips: f64,
}

/// Steps that lie near the weighted median, if there are enough of them.
fn agreeing(steps: &[Step]) -> Option<Vec<Step>> {
    let mut sorted = steps.to_vec();
    sorted.sort_by(|a, b| a.chips.total_cmp(&b.chips));
    let weight = |step: &Step| 1.0 / (step.sigma_chips * step.sigma_chips);
    let half = 0.5 * sorted.iter().map(weight).sum::<f64>();
    let mut sum = 0.0;
    let median = *sorted.iter().find(|step| {
        sum += weight(step);
        sum >= half
    })?;
    let near = |step: &Step| {
        (step.chips - median.chips).abs()
            <= AGREEING_SIGMAS * libm::hypot(step.sigma_chips, median.sigma_chips) + AGREEING_CHIPS
    };
    sorted.retain(near);
    let enough = sorted.len() >= LEAST_CHANNELS && sorted.len() as f64 >= AGREEING_SHARE * steps.len() as f64;
    enough.then_some(sorted)
}

/// The step that most channels share, in chips, if it is suspicious where a sample is `sample_chips`.
pub fn common_step(steps: &[Step], sample_chips: f64) -> Option<f64> {
    let steps = agreeing(steps)?;
    let fit = Fit::of(&steps, Some(0.0))?;
    let beyond = fit.chips.abs() > SUSPICIOUS_SIGMAS * fit.sigma_chips + SUSPICIOUS_SAMPLES * sample_chips;
    beyond.then_some(fit.chips)
}

/// True if codes moved in proportion to their Dopplers, as they do when whole code periods are missing.
pub fn doppler_step(steps: &[Step]) -> bool {
    let fit = Fit::robust(steps, None).filter(|_| steps.len() > LEAST_CHANNELS + 1);
    fit.is_some_and(|fit| fit.seconds.abs() > SUSPICIOUS_SIGMAS * fit.sigma_s + SUSPICIOUS_S)
}

/// Common step of all channels, with the seconds of Doppler in it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fit {
    /// Code, in chips.
    pub chips: f64,
    /// Standard deviation of the code step, in chips.
    pub sigma_chips: f64,
    /// Seconds of Doppler.
    pub seconds: f64,
    /// Standard deviation of the seconds of Doppler, in seconds.
    pub sigma_s: f64,
}

impl Fit {
    /// Weighted least squares; with `seconds` given the common step alone is sought.
    pub fn of(steps: &[Step], seconds: Option<f64>) -> Option<Self> {
        if steps.len() < LEAST_CHANNELS {
            return None;
        }
        let weight = |step: &Step| 1.0 / (step.sigma_chips * step.sigma_chips);
        let sum = |of: &dyn Fn(&Step) -> f64| steps.iter().map(|step| weight(step) * of(step)).sum::<f64>();
        let weights = sum(&|_| 1.0);
        let mean_doppler = sum(&|step| step.doppler_chips) / weights;
        let mean_chips = sum(&|step| step.chips) / weights;
        let square = sum(&|step| (step.doppler_chips - mean_doppler) * (step.doppler_chips - mean_doppler));
        let product = sum(&|step| (step.doppler_chips - mean_doppler) * (step.chips - mean_chips));
        let free = seconds.is_none();
        let seconds = match seconds {
            Some(seconds) => seconds,
            None if square > 0.0 => product / square,
            None => return None,
        };
        let chips = mean_chips - seconds * mean_doppler;
        let scatter = sum(&|step| {
            let rest = step.chips - chips - seconds * step.doppler_chips;
            rest * rest
        });
        let unknowns = if free { 2 } else { 1 };
        let excess = (scatter / (steps.len() - unknowns) as f64).max(1.0);
        let of_seconds = if free { excess / square } else { 0.0 };
        let variance = excess / weights + of_seconds * mean_doppler * mean_doppler;
        Some(Self { chips, sigma_chips: variance.sqrt(), seconds, sigma_s: of_seconds.sqrt() })
    }

    /// Fit of the steps that agree once `seconds` of Doppler are subtracted.
    pub fn robust(steps: &[Step], seconds: Option<f64>) -> Option<Self> {
        let first = Self::of(steps, seconds)?;
        let off = first.seconds;
        let rests: Vec<Step> =
            steps.iter().map(|step| Step { chips: step.chips - off * step.doppler_chips, ..*step }).collect();
        let kept: Vec<Step> = agreeing(&rests)?
            .into_iter()
            .map(|step| Step { chips: step.chips + off * step.doppler_chips, ..step })
            .collect();
        Self::of(&kept, seconds)
    }
}

/// Sums of the products of neighbouring prompts, by the code period's number modulo a symbol's or a
/// secondary code's.
#[derive(Clone, Debug)]
pub struct Edges {
    products: Vec<f64>,
    count: u64,
    /// Signs of a secondary code's products, which have been removed from the sums.
    signs: Option<Vec<f64>>,
}

impl Edges {
    /// Edges for symbols of `periods` code periods.
    pub fn new(periods: u32) -> Self {
        Self { products: vec![0.0; periods.max(1) as usize], count: 0, signs: None }
    }

    /// Edges for a secondary code with these chips, one a code period by its number. They have been removed
    /// from the prompts.
    pub fn of_secondary_code(chips: &[f64]) -> Self {
        let before = chips.iter().skip(chips.len().saturating_sub(1)).chain(chips);
        let signs = before.zip(chips).map(|(before, chip)| before * chip).collect();
        Self { signs: Some(signs), ..Self::new(chips.len() as u32) }
    }

    /// Edges of this form before any prompt.
    pub fn emptied(&self) -> Self {
        Self { signs: self.signs.clone(), ..Self::new(self.products.len() as u32) }
    }

    /// Code periods in a symbol, or in a secondary code.
    pub fn periods(&self) -> u64 {
        self.products.len() as u64
    }

    /// Products that were taken.
    pub fn count(&self) -> u64 {
        self.count
    }

    /// Sum of these products and those of a later time, of the same symbols or secondary code.
    pub fn and(mut self, later: &Self) -> Self {
        self.products.iter_mut().zip(&later.products).for_each(|(sum, product)| *sum += product);
        self.count += later.count;
        self
    }

    /// Takes the product of the prompt of code period `number` and the one before, noise of unit variance a
    /// component.
    pub fn add(&mut self, number: u64, product: f64) {
        let length = self.products.len() as u64;
        if let Some(sum) = self.products.get_mut((number % length) as usize) {
            *sum += product;
        }
        self.count += 1;
    }
}

/// Number of code periods by which the counts of all channels are short, modulo a symbol's. Each channel
/// gives its products since the jump, and the period in which its symbols began before. `None` while it is in
/// doubt.
pub fn turned_by(channels: &[(&Edges, u64)]) -> Option<u64> {
    let length = channels.first()?.0.products.len();
    if channels.first()?.0.signs.is_some() {
        return secondary_code_turned_by(channels, length);
    }
    let mut sums = vec![0.0; length];
    let (mut expected, mut noise) = (0.0, 0.0);
    for (edges, begin) in channels.iter().filter(|(edges, _)| edges.products.len() == length) {
        let visits = edges.count as f64 / length as f64;
        // All positions but one have the signal's power.
        let power = edges.products.iter().sum::<f64>() / edges.count.max(1) as f64 * length as f64
            / (length as f64 - 1.0).max(1.0);
        if power <= 0.0 {
            continue;
        }
        // Variance of a product: noise by signal, noise by noise, and the turns themselves.
        let variance = 2.0 * power + 2.0;
        let weight = power / (power * power + variance);
        for (shift, sum) in sums.iter_mut().enumerate() {
            let place = (begin + (length - shift) as u64) % length as u64;
            *sum += weight * edges.products.get(place as usize).copied().unwrap_or(0.0);
        }
        expected += visits * weight * power;
        noise += visits * weight * weight * variance;
    }
    let (best, least) = sums.iter().copied().enumerate().min_by(|a, b| a.1.total_cmp(&b.1))?;
    let second = sums.iter().enumerate().filter(|(k, _)| *k != best).map(|(_, &sum)| sum).fold(f64::INFINITY, f64::min);
    let lead = second - least;
    (lead > TURN_SIGMAS * (2.0 * noise).sqrt() && lead > TURN_SHARE * expected).then_some(best as u64)
}

/// [`turned_by`] of channels whose secondary code is known: with the chips of `shift` periods later taken off
/// in place of its own, every product is positive.
fn secondary_code_turned_by(channels: &[(&Edges, u64)], length: usize) -> Option<u64> {
    let mut sums = vec![0.0; length];
    let mut noise = 0.0;
    for (edges, _) in channels.iter().filter(|(edges, _)| edges.products.len() == length) {
        let Some(signs) = &edges.signs else { continue };
        let sent: Vec<(usize, f64)> = (edges.products.iter().zip(signs).enumerate())
            .filter(|(_, (product, _))| **product != 0.0)
            .map(|(place, (product, sign))| (place, product * sign))
            .collect();
        let own: Vec<f64> = (0..length)
            .map(|shift| sent.iter().map(|(place, product)| product * signs[(place + shift) % length]).sum())
            .collect();
        let power = own.iter().copied().fold(0.0, f64::max) / edges.count.max(1) as f64;
        let variance = 2.0 * power + 2.0;
        let weight = power / (power * power + variance);
        sums.iter_mut().zip(&own).for_each(|(sum, own)| *sum += weight * own);
        noise += edges.count as f64 * weight * weight * variance;
    }
    let (best, most) = sums.iter().copied().enumerate().max_by(|a, b| a.1.total_cmp(&b.1))?;
    let second =
        sums.iter().enumerate().filter(|(k, _)| *k != best).map(|(_, &sum)| sum).fold(f64::NEG_INFINITY, f64::max);
    let lead = most - second;
    (most > 0.0 && lead > TURN_SIGMAS * (2.0 * noise).sqrt() && lead > TURN_SHARE * most).then_some(best as u64)
}

/// A position at which samples are missing or came twice.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct Jump {
    /// Sample of the recording near the jump, 0.1 s at most after it. With several front ends it is the first
    /// one's.
    pub sample: u64,
    /// Number of missing samples; negative where samples came twice.
    pub samples: i64,
    /// The index of the front end that lost its own samples, from 0 on.
    #[serde(skip_serializing_if = "is_first")]
    pub front_end: usize,
}

fn is_first(front_end: &usize) -> bool {
    *front_end == 0
}

impl fmt::Display for Jump {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (count, what) = (self.samples.unsigned_abs(), if self.samples > 0 { "lost" } else { "doubled" });
        let noun = if count == 1 { "sample" } else { "samples" };
        write!(f, "{count} {noun} {what} near sample {}", self.sample)?;
        if self.front_end > 0 { write!(f, " in front end {}", self.front_end + 1) } else { Ok(()) }
    }
}

#[cfg(test)]
mod tests;
