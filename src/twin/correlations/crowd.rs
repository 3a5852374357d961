//! Other satellites in the correlations of a short code.
//!
//! A code that repeats each millisecond finds the same share of another satellite's in each period, turned by
//! the difference of the carriers. So it is no white noise: loops and estimates of C/N0 meet a tone. Its
//! amplitude and phase are the correlation of both codes at their delay and difference of Dopplers, summed
//! over the chips of a period, before and after the other code's own period ends (Kaplan and Hegarty,
//! Understanding GPS 2nd ed., 4.3.2). Limits: delays and phases are parabolas within a second, the difference
//! of Dopplers and the strength are constant there; carriers are equal.

use std::sync::Arc;

use generator::synth::angle::cos_sin;
use gnss::signal::{Component, Link, Signal};
use num_complex::Complex64;
use receiver::correlate::correlator::Interval;
use receiver::correlate::units_to_chips;
use receiver::lead::lead;

use super::sent::{Leg, Sent, centred, split, turns};
use super::taps::{LANES, POSITIONS, Taps};

/// Chips of a code from which on cross-correlation with other satellites counts as white noise.
pub(super) const LEAST_LONG_CHIPS: u32 = 4000;
/// Lags beyond the difference of the codes for which sums are made.
const MARGIN: i64 = 3;
/// Satellites whose phases are turned at once.
const TOGETHER: usize = 4;
/// Lanes of the sums over a code.
const SUMS: usize = 8;
/// 2^64 as a float.
const TURN: f64 = 18_446_744_073_709_551_616.0;

/// A parabola over a second, through its beginning, middle and end.
type Parabola = [f64; 3];

fn through([first, half, last]: [f64; 3]) -> Parabola {
    let bend = 2.0 * (first + last) - 4.0 * half;
    [first, last - first - bend, bend]
}

fn at([constant, linear, square]: Parabola, x: f64) -> f64 {
    constant + x * (linear + x * square)
}

/// One ray of a satellite over a second.
pub(super) struct Course {
    /// First sample, and the samples of the second.
    span: (u64, f64),
    component: &'static Component,
    /// Code periods since the beginning of period number `period`.
    periods: Parabola,
    period: i64,
    /// Cycles of the carrier in the samples.
    cycles: Parabola,
    /// Signs of the code periods, from number `signed` on.
    signs: Vec<f32>,
    signed: i64,
    /// Amplitude in a sample.
    amplitude: f64,
}

impl Course {
    /// A satellite's rays over a second of samples, the strongest first; none for long codes, and for one
    /// that is not received.
    pub fn all(sent: &Sent, span: (u64, u64)) -> Vec<Arc<Self>> {
        let Some(leg) = sent.leg(span.0 + (span.1 - span.0) / 2) else { return Vec::new() };
        let cn0_hz = |ray| leg.rays.at(ray, span.0).map_or(0.0, |ray| ray.cn0_hz);
        let sum_hz: f64 = (0..leg.rays.count()).map(cn0_hz).sum();
        // Quick fading is common to all.
        let steady_hz = if sum_hz > 0.0 { leg.rays.cn0_hz(span.0) / sum_hz } else { 0.0 };
        let one = |ray| Self::new(sent, leg, (ray, steady_hz * cn0_hz(ray)), span).map(Arc::new);
        (0..leg.rays.count()).filter_map(one).collect()
    }

    fn new(sent: &Sent, leg: &Leg, (ray, cn0_hz): (usize, f64), (from, to): (u64, u64)) -> Option<Self> {
        let signal = sent.transmitter.signal;
        let component = lead(signal).filter(|lead| lead.code_chips < LEAST_LONG_CHIPS)?;
        let index = index_of(component, signal)?;
        let middle = from + (to - from) / 2;
        let anchor = leg.anchors.get(ray)?;
        let [first, half, last] = [from, middle, to].map(|sample| leg.rays.at(ray, sample));
        let (first, half, last) = (first?, half?, last?);
        let (count, rate_hz, period_s) = ((to - from) as f64, sent.scene.clock.rate.hz(), component.period_s());
        let (period, share) = anchor.code_at(index, period_s, anchor.elapsed_s(from, rate_hz), &first)?;
        let (turns, step) = anchor.turns_at(from, &first);
        let passed = |sample: u64, delay_s: f64| {
            let sent_s = (sample - from) as f64 / rate_hz - (delay_s - first.delay_s);
            share + sent_s / period_s
        };
        let turned = |sample: u64, cycles: f64| {
            turns as f64 / TURN + step as i64 as f64 / TURN * (sample - from) as f64 - (cycles - first.carrier_cycles)
        };
        let cn0_hz = cn0_hz * component.power_share;
        let (signed, signs) = sent.signs(index)?;
        Some(Self {
            span: (from, count),
            component,
            periods: through([share, passed(middle, half.delay_s), passed(to, last.delay_s)]),
            period,
            cycles: through([
                turns as f64 / TURN,
                turned(middle, half.carrier_cycles),
                turned(to, last.carrier_cycles),
            ]),
            signs: signs.iter().map(|sign| *sign as f32).collect(),
            signed,
            amplitude: f64::from(sent.scene.noise_lsb) * (2.0 * cn0_hz / rate_hz).sqrt(),
        })
    }

    /// Sign of a code period.
    #[inline]
    fn sign(&self, period: i64) -> f32 {
        self.signs.get((period - self.signed) as usize).copied().unwrap_or(1.0)
    }

    /// Share of the second that has passed at a sample.
    fn share(&self, sample: u64) -> f64 {
        (sample as f64 - self.span.0 as f64) / self.span.1
    }
}

/// Number of a component in its signal.
fn index_of(component: &Component, signal: &Signal) -> Option<usize> {
    signal.components.iter().position(|one| std::ptr::eq(one, component))
}

/// A ray of another satellite in the correlations of a code.
struct Other {
    course: Arc<Course>,
    /// Number of its code period that runs at the first lag, at the beginning of the second.
    period: i64,
    /// Chips by which its code is ahead of the own one.
    ahead: Parabola,
    first_lag: i64,
    /// Number of lags at which that period runs on.
    same: usize,
    /// Sums over the own code's chips for each lag, in a sample's amplitude, where the period after has the
    /// same sign and where it has the other one.
    means: [Vec<[f32; 2]>; 2],
}

/// The other satellites in the correlations of one satellite's short code, over a second.
pub(super) struct Crowd {
    own: Arc<Course>,
    others: Vec<Other>,
}

impl Crowd {
    /// The satellites beside number `own` of `sent`, with the courses of all and their codes. `None` for long
    /// codes.
    pub fn new<'c>(
        sent: &[Sent],
        own: usize,
        courses: &[Vec<Arc<Course>>],
        code: impl Fn(&Sent, usize) -> Option<&'c [i8]>,
    ) -> Option<Self> {
        let (this, course) = (sent.get(own)?, courses.get(own)?.first()?);
        let of = |sent: &Sent, course: &Course| code(sent, index_of(course.component, sent.transmitter.signal)?);
        let chips = of(this, course)?;
        let link = this.transmitter.link();
        let alike = sent.iter().zip(courses).filter(|(sent, _)| is_alike(link, sent.transmitter.link()));
        let rays = alike.flat_map(|(sent, rays)| rays.iter().map(move |ray| (sent, ray)));
        let one = |(sent, ray)| Some(Other::new((course, chips), (ray, of(sent, ray)?)));
        let others = rays.filter_map(one).collect();
        Some(Self { own: Arc::clone(course), others })
    }

    /// Adds the other satellites' sums over an interval that begins with a code period.
    pub fn add(&self, interval: &Interval, taps: &Taps, sums: &mut [Complex64]) {
        let Interval { nco, from, to, .. } = *interval;
        let length = f64::from(self.own.component.code_chips);
        let x = self.own.share(from);
        let local = centred(units_to_chips(nco.code), length);
        let own = length * at(self.own.periods, x);
        let apart = centred(own - local, length);
        // Whole periods from the other's first one to the replica's first chip.
        let whole = split((own - apart - local) / length + 0.5).0;
        let mut all = [[0.0; LANES]; 2];
        for together in self.others.chunks(TOGETHER) {
            let mut words = [0; TOGETHER];
            let turned = |other: &Other| (turns(at(other.course.cycles, x)).wrapping_sub(nco.carrier) >> 32) as u32;
            words.iter_mut().zip(together).for_each(|(word, other)| *word = turned(other));
            let (cos, sin) = cos_sin(&words);
            for (other, (cos, sin)) in together.iter().zip(cos.into_iter().zip(sin)) {
                let [re, im] = other.at(at(other.ahead, x) + apart, taps, other.period + whole);
                for lane in 0..LANES {
                    all[0][lane] += cos * re[lane] - sin * im[lane];
                    all[1][lane] += cos * im[lane] + sin * re[lane];
                }
            }
        }
        let [re, im] = all.map(|part| part.map(|value| f64::from(value) * (to - from) as f64));
        sums.iter_mut().zip(re.into_iter().zip(im)).for_each(|(sum, (re, im))| *sum += Complex64::new(re, im));
    }
}

impl Other {
    fn new((own, code): (&Course, &[i8]), (course, sent): (&Arc<Course>, &[i8])) -> Self {
        let length = code.len() as i64;
        let ahead: Parabola = std::array::from_fn(|k| length as f64 * (course.periods[k] - own.periods[k]));
        let [begin, end] = [at(ahead, 0.0), at(ahead, 1.0)];
        let first_lag = split(begin.min(end)).0 - MARGIN;
        let last_lag = split(begin.max(end)).0 + 1 + MARGIN;
        // Turn of the carriers' difference in a chip.
        let cycles_hz = (course.cycles[1] + course.cycles[2]) - (own.cycles[1] + own.cycles[2]);
        let periods = own.periods[1] + own.periods[2];
        let turned = turned(code, cycles_hz / (periods * length as f64), course.amplitude / length as f64);
        // Twice, so that any lag is one piece of it.
        let sent: Vec<f32> = sent.iter().chain(sent).map(|chip| f32::from(*chip)).collect();
        let mut means: [Vec<[f32; 2]>; 2] = Default::default();
        for lag in first_lag..=last_lag {
            let ahead = lag.rem_euclid(length) as usize;
            let rest = code.len() - ahead;
            let sum = |from: usize, to: usize| {
                turned.each_ref().map(|own| product(&own[from..to], &sent[from + ahead..to + ahead]))
            };
            let (before, after) = (sum(0, rest), sum(rest, code.len()));
            means[0].push(std::array::from_fn(|part| before[part] + after[part]));
            means[1].push(std::array::from_fn(|part| before[part] - after[part]));
        }
        let wraps = first_lag.div_euclid(length);
        let same = ((wraps + 1) * length - first_lag) as usize;
        Self { course: Arc::clone(course), period: course.period + wraps, ahead, first_lag, same, means }
    }

    /// Sums at taps, real and imaginary parts, where the other code is `lag` chips ahead, and its code period
    /// at the first lag has number `period`.
    #[inline]
    fn at(&self, lag: f64, taps: &Taps, period: i64) -> [[f32; LANES]; 2] {
        let (chip, share) = split(lag);
        let weights = taps.weights((share * POSITIONS as f64 + 0.5) as usize);
        let first = (chip + taps.first - self.first_lag) as usize;
        // Beyond `same` the next period runs.
        let here = self.same.saturating_sub(first).min(weights.len());
        let (weights, later) = weights.split_at(here);
        let mut all = [[0.0; LANES]; 2];
        self.add(first, weights, period, &mut all);
        if !later.is_empty() {
            self.add(first + here, later, period + 1, &mut all);
        }
        all
    }

    /// Adds the sums at lags from number `first` on, where code period `period` runs.
    #[inline]
    fn add(&self, first: usize, weights: &[[f32; LANES]], period: i64, [re, im]: &mut [[f32; LANES]; 2]) {
        let [sign, next] = [self.course.sign(period), self.course.sign(period + 1)];
        let [same, other] = &self.means;
        let means = if sign == next { same } else { other };
        for (mean, weights) in means.get(first..).unwrap_or_default().iter().zip(weights) {
            let [a, b] = mean.map(|part| sign * part);
            for lane in 0..LANES {
                re[lane] += weights[lane] * a;
                im[lane] += weights[lane] * b;
            }
        }
    }
}

/// Chips of a code that turn by so many cycles each, from the middle of the first one on: real and imaginary
/// parts.
fn turned(code: &[i8], cycles: f64, amplitude: f64) -> [Vec<f32>; 2] {
    let step = turns(cycles);
    let mut parts: [Vec<f32>; 2] = Default::default();
    for (chips, number) in code.chunks(SUMS).zip((0..).step_by(SUMS)) {
        let word = |lane: u64| (step.wrapping_mul(number + lane).wrapping_add((step as i64 / 2) as u64) >> 32) as u32;
        let (cos, sin) = cos_sin::<SUMS>(&std::array::from_fn(|lane| word(lane as u64)));
        for (part, value) in parts.iter_mut().zip([cos, sin]) {
            part.extend(chips.iter().zip(value).map(|(chip, value)| f32::from(*chip) * value * amplitude as f32));
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

/// True if another satellite's short code has the carrier and the chips of this one.
pub(super) fn is_alike(this: Link, other: Link) -> bool {
    let of = |link: Link| lead(link.signal).map(|lead| (lead.code_chips, lead.chip_rate_hz, lead.steps_per_chip()));
    of(this).is_some_and(|(chips, _, steps)| chips < LEAST_LONG_CHIPS && steps == 1)
        && of(this) == of(other)
        && !this.is_alike(other)
        && this.carrier_hz() == other.carrier_hz()
}
