//! Other satellites in the correlations of a short code.
//!
//! A code that repeats each millisecond finds the same share of another satellite's in each period, turned by
//! the difference of the carriers. So it is no white noise: loops and estimates of C/N0 meet a tone. Its
//! amplitude and phase are the correlation of both codes at their delay and difference of Dopplers, summed
//! over the chips of a period, before and after the other code's own period ends (Kaplan and Hegarty,
//! Understanding GPS 2nd ed., 4.3.2). Limits: delays and phases are parabolas within a second, the strength
//! is constant there; carriers are equal. Within a code period the difference of Dopplers counts to 2 Hz, so
//! that sums serve for seconds (`chips`): 0.002 cycle from one end to the other, 0.4 % of the sum.

use std::sync::Arc;

use generator::synth::angle::cos_sin;
use gnss::signal::{Component, Link, Signal};
use num_complex::Complex64;
use receiver::correlate::correlator::Interval;
use receiver::correlate::units_to_chips;
use receiver::lead::lead;

use super::chips::{Kept, Means, Pair};
use super::sent::{Leg, Sent, centred, split, turns};
use super::taps::{LANES, POSITIONS, Taps};

/// Chips of a code from which on cross-correlation with other satellites counts as white noise.
pub(super) const LEAST_LONG_CHIPS: u32 = 4000;
/// Lags beyond the difference of the codes for which sums are made.
const MARGIN: i64 = 3;
/// Code periods for which sums are made at once.
const TOGETHER: usize = 4;
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

fn slope([_, linear, square]: Parabola, x: f64) -> f64 {
    linear + 2.0 * x * square
}

/// Cycles a sample in 2^-64 turn.
fn step(cycles: f64) -> u64 {
    (cycles * TURN) as i64 as u64
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

    /// True if the code periods from a number on, as many as any lag meets in so many of them, have one sign.
    #[inline]
    fn is_same(&self, period: i64, count: usize) -> bool {
        let first = (period - self.signed) as usize;
        let signs = self.signs.get(first..first.saturating_add(count + 2));
        signs.is_some_and(|signs| signs.windows(2).all(|pair| pair[0] == pair[1]))
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
    /// Means over the own code's chips.
    means: Means,
    /// Number of lags at which that period runs on.
    same: usize,
    /// Amplitude in a sample.
    amplitude: f32,
}

/// The other satellites in the correlations of one satellite's short code, over a second.
pub(super) struct Crowd {
    own: Arc<Course>,
    others: Vec<Other>,
}

impl Crowd {
    /// The satellites beside number `own` of `sent`, with the courses of all and their codes; `kept` has what
    /// earlier seconds have summed. `None` for long codes.
    pub fn new<'c>(
        sent: &[Sent],
        own: usize,
        courses: &[Vec<Arc<Course>>],
        (code, kept): (impl Fn(&Sent, usize) -> Option<&'c [i8]>, &Kept),
    ) -> Option<Self> {
        let (this, course) = (sent.get(own)?, courses.get(own)?.first()?);
        let of = |sent: &Sent, course: &Course| code(sent, index_of(course.component, sent.transmitter.signal)?);
        let chips = of(this, course)?;
        let link = this.transmitter.link();
        let alike = sent.iter().zip(courses).filter(|(sent, _)| is_alike(link, sent.transmitter.link()));
        let rays = alike.flat_map(|(sent, rays)| rays.iter().map(move |ray| (sent, ray)));
        let mut pairs = kept.of(link);
        let one = |(number, (sent, ray)): (usize, (&Sent, &Arc<Course>))| {
            let pair = pairs.of((sent.transmitter.link(), number), (chips, of(sent, ray)?));
            Some(Other::new(course, ray, chips.len(), pair))
        };
        let others = rays.enumerate().filter_map(one).collect();
        kept.put(link, pairs);
        Some(Self { own: Arc::clone(course), others })
    }

    /// Adds the other satellites' sums over intervals that begin with code periods and follow one another
    /// with the same steps: for each interval one for each of `count` taps, of which `taps` are those from
    /// the `first` on.
    pub fn add(&self, intervals: &[Interval], taps: &Taps, (first, count): (usize, usize), sums: &mut [Complex64]) {
        for (intervals, sums) in intervals.chunks(TOGETHER).zip(sums.chunks_mut(TOGETHER * count.max(1))) {
            let parts = sums.chunks_mut(count.max(1)).map(|sums| sums.get_mut(first..).unwrap_or_default());
            self.add_few(intervals, taps, parts);
        }
    }

    /// Adds the sums over a few intervals. Both codes keep their difference for so long: it moves by three
    /// chips a second at most, less than two positions of a tap, and the sums by less than 1e-3 of the other
    /// satellite's amplitude.
    fn add_few<'s>(&self, intervals: &[Interval], taps: &Taps, sums: impl Iterator<Item = &'s mut [Complex64]>) {
        let (Some(Interval { nco, from, .. }), Some(last)) = (intervals.first(), intervals.last()) else { return };
        let length = f64::from(self.own.component.code_chips);
        let x = self.own.share(*from);
        let halfway = x + 0.5 * (last.from - from) as f64 / self.own.span.1;
        let local = centred(units_to_chips(nco.code), length);
        let own = length * at(self.own.periods, x);
        let apart = centred(own - local, length);
        // Whole periods from the other's first one to the replica's first chip.
        let whole = split((own - apart - local) / length + 0.5).0;
        let mut passed = [0; TOGETHER];
        passed.iter_mut().zip(intervals).for_each(|(passed, interval)| *passed = interval.from - from);
        let mut all = [[[0.0; LANES]; 2]; TOGETHER];
        for other in &self.others {
            let Course { cycles, span, .. } = &*other.course;
            let begin = turns(at(*cycles, x)).wrapping_sub(nco.carrier);
            let step = step(slope(*cycles, x) / span.1).wrapping_sub(nco.carrier_step);
            let word = |passed: u64| (begin.wrapping_add(step.wrapping_mul(passed)) >> 32) as u32;
            let (cos, sin) = cos_sin(&passed.map(word));
            let (lag, period) = (at(other.ahead, halfway) + apart, other.period + whole);
            let is_same = other.course.is_same(period, intervals.len());
            let mut value = other.at(lag, taps, period);
            for (number, (all, _)) in (0..).zip(all.iter_mut().zip(intervals)) {
                if number > 0 && !is_same {
                    value = other.at(lag, taps, period + number);
                }
                let [cos, sin] = [cos, sin].map(|part| part[number as usize] * other.amplitude);
                let [re, im] = &value;
                for lane in 0..LANES {
                    all[0][lane] += cos * re[lane] - sin * im[lane];
                    all[1][lane] += cos * im[lane] + sin * re[lane];
                }
            }
        }
        for ((sums, all), Interval { from, to, .. }) in sums.zip(all).zip(intervals) {
            let [re, im] = all.map(|part| part.map(|value| f64::from(value) * (to - from) as f64));
            sums.iter_mut().zip(re.into_iter().zip(im)).for_each(|(sum, (re, im))| *sum += Complex64::new(re, im));
        }
    }
}

impl Other {
    fn new(own: &Course, course: &Arc<Course>, length: usize, pair: &mut Pair) -> Self {
        let length = length as i64;
        let ahead: Parabola = std::array::from_fn(|k| length as f64 * (course.periods[k] - own.periods[k]));
        let [begin, end] = [at(ahead, 0.0), at(ahead, 1.0)];
        let first_lag = split(begin.min(end)).0 - MARGIN;
        let last_lag = split(begin.max(end)).0 + 1 + MARGIN;
        // Turn of the carriers' difference in a chip.
        let cycles_hz = (course.cycles[1] + course.cycles[2]) - (own.cycles[1] + own.cycles[2]);
        let periods = own.periods[1] + own.periods[2];
        let means = pair.means(cycles_hz / (periods * length as f64), (first_lag, last_lag));
        let wraps = first_lag.div_euclid(length);
        let same = ((wraps + 1) * length - first_lag) as usize;
        let (course, period, amplitude) = (Arc::clone(course), course.period + wraps, course.amplitude as f32);
        Self { course, period, ahead, means, same, amplitude }
    }

    /// Sums at taps, real and imaginary parts, where the other code is `lag` chips ahead, and its code period
    /// at the first lag has number `period`.
    #[inline]
    fn at(&self, lag: f64, taps: &Taps, period: i64) -> [[f32; LANES]; 2] {
        let (chip, share) = split(lag);
        let weights = taps.weights((share * POSITIONS as f64 + 0.5) as usize);
        let first = (chip + taps.first - self.means.first_lag) as usize;
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
    fn add(&self, first: usize, weights: &[[f32; LANES]], period: i64, all: &mut [[f32; LANES]; 2]) {
        let [sign, next] = [self.course.sign(period), self.course.sign(period + 1)];
        let [same, other] = &self.means.means;
        let means = if sign == next { same } else { other };
        let [mut re, mut im] = [[0.0; LANES]; 2];
        for ([a, b], weights) in means.get(first..).unwrap_or_default().iter().zip(weights) {
            for lane in 0..LANES {
                re[lane] += weights[lane] * a[lane];
                im[lane] += weights[lane] * b[lane];
            }
        }
        for lane in 0..LANES {
            all[0][lane] += sign * re[lane];
            all[1][lane] += sign * im[lane];
        }
    }
}

/// True if another satellite's short code has the carrier and the chips of this one.
pub(super) fn is_alike(this: Link, other: Link) -> bool {
    is_beside(this, other) && !this.is_alike(other)
}

/// True if codes of another signal are short, and have the carrier and the chips of this one.
pub(super) fn is_beside(this: Link, other: Link) -> bool {
    let of = |link: Link| lead(link.signal).map(|lead| (lead.code_chips, lead.chip_rate_hz, lead.steps_per_chip()));
    of(this).is_some_and(|(chips, _, steps)| chips < LEAST_LONG_CHIPS && steps == 1)
        && of(this) == of(other)
        && this.carrier_hz() == other.carrier_hz()
}
