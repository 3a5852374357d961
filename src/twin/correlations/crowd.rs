//! Other satellites in the correlations of a short code.
//!
//! A code that repeats each millisecond finds the same share of another satellite's in each period, turned by
//! the difference of the carriers. So it is no white noise: loops and estimates of C/N0 meet a tone. Its
//! amplitude and phase are the correlation of both codes at their delay and difference of Dopplers, summed
//! over the chips of a period, before and after the other code's own period ends (Kaplan and Hegarty,
//! Understanding GPS 2nd ed., 4.3.2). Limits: delays and phases are parabolas within a second, the difference
//! of Dopplers and the strength are constant there; the strongest ray alone; carriers are equal.

use std::f64::consts::TAU;
use std::sync::Arc;

use generator::scene::Scene;
use generator::transmit::Transmitter;
use gnss::signal::{Component, Link};
use num_complex::Complex64;
use receiver::correlate::correlator::Interval;
use receiver::correlate::units_to_chips;
use receiver::lead::lead;

use super::made::Made;

/// Chips of a code from which on cross-correlation with other satellites counts as white noise.
pub(super) const LEAST_LONG_CHIPS: u32 = 4000;
/// Lags beyond the difference of the codes for which sums are made.
const MARGIN: i64 = 3;
/// Code periods before and after the second for which signs are kept: of integrations that began before it.
const MOST_PERIODS: i64 = 50;
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

/// One satellite over a second.
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
    signs: Vec<f64>,
    signed: i64,
    /// Amplitude in a sample.
    amplitude: f64,
}

impl Course {
    /// A transmitter over a second of samples; `None` for long codes, and for one that is not received.
    pub fn new(scene: &Scene, transmitter: &Transmitter, (from, to): (u64, u64)) -> Option<Self> {
        let component = lead(transmitter.signal).filter(|lead| lead.code_chips < LEAST_LONG_CHIPS)?;
        let index = transmitter.signal.components.iter().position(|one| std::ptr::eq(one, component))?;
        let middle = from + (to - from) / 2;
        let rays = transmitter.rays(scene, middle)?;
        let [first, half, last] = [from, middle, to].map(|sample| rays.at(0, sample));
        let (first, half, last) = (first?, half?, last?);
        let code = transmitter.code_at(scene, index, from, first.delay_s)?;
        let (turns, step) = transmitter.turns_at(scene, from, &first);
        let (count, rate_hz) = ((to - from) as f64, scene.clock.rate.hz());
        let passed = |sample: u64, delay_s: f64| {
            let sent_s = (sample - from) as f64 / rate_hz - (delay_s - first.delay_s);
            code.share + sent_s / component.period_s()
        };
        let turned = |sample: u64, cycles: f64| {
            turns as f64 / TURN + step as i64 as f64 / TURN * (sample - from) as f64 - (cycles - first.carrier_cycles)
        };
        let cn0_hz = rays.cn0_hz(from) * component.power_share;
        let signed = code.at.period - MOST_PERIODS;
        let end = code.at.period + (count / rate_hz / component.period_s()) as i64 + MOST_PERIODS;
        Some(Self {
            span: (from, count),
            component,
            periods: through([code.share, passed(middle, half.delay_s), passed(to, last.delay_s)]),
            period: code.at.period,
            cycles: through([
                turns as f64 / TURN,
                turned(middle, half.carrier_cycles),
                turned(to, last.carrier_cycles),
            ]),
            signs: (signed..end).map(|period| transmitter.sign(index, period)).collect(),
            signed,
            amplitude: f64::from(scene.noise_lsb) * (2.0 * cn0_hz / rate_hz).sqrt(),
        })
    }

    /// Sign of a code period.
    fn sign(&self, period: i64) -> f64 {
        self.signs.get((period - self.signed) as usize).copied().unwrap_or(1.0)
    }

    /// Share of the second that has passed at a sample.
    fn share(&self, sample: u64) -> f64 {
        (sample as f64 - self.span.0 as f64) / self.span.1
    }
}

/// Another satellite in the correlations of a code.
struct Other {
    course: Arc<Course>,
    first_lag: i64,
    /// Means over the code's chips for each lag, of those before the other's period ends and of those after.
    means: Vec<[Complex64; 2]>,
}

/// The other satellites in the correlations of one satellite's short code, over a second.
pub(super) struct Crowd {
    own: Arc<Course>,
    others: Vec<Other>,
}

impl Crowd {
    /// The satellites beside number `own` of `transmitters`, with the courses of all. `None` for long codes.
    pub fn new(transmitters: &[Transmitter], own: usize, courses: &[Option<Arc<Course>>]) -> Option<Self> {
        let (this, course) = (transmitters.get(own)?, courses.get(own)?.as_ref()?);
        let code = (course.component.code)(this.sv.number)?;
        let one = |(transmitter, other): (&Transmitter, &Option<Arc<Course>>)| {
            let other = other.as_ref().filter(|_| is_alike(this.link(), transmitter.link()))?;
            Other::new((course, &code), &(other.component.code)(transmitter.sv.number)?, other)
        };
        Some(Self { own: Arc::clone(course), others: transmitters.iter().zip(courses).filter_map(one).collect() })
    }

    /// Adds the other satellites' sums over an interval that begins with a code period, at taps in chips.
    pub fn add(&self, interval: &Interval, made: &Made, taps: &[f64], sums: &mut [Complex64]) {
        let Interval { nco, from, to, .. } = *interval;
        let length = f64::from(self.own.component.code_chips);
        let x = self.own.share(from);
        let local = (units_to_chips(nco.code) + 0.5 * length).rem_euclid(length) - 0.5 * length;
        let own = length * at(self.own.periods, x);
        let apart = (own - local + 0.5 * length).rem_euclid(length) - 0.5 * length;
        // Whole periods from the other's first one to the replica's first chip.
        let whole = ((own - apart - local) / length).round() as i64;
        let chips = self.own.component.code_chips.into();
        for Other { course, first_lag, means } in &self.others {
            let lag = length * at(course.periods, x) - own + apart;
            let cycles = at(course.cycles, x) - nco.carrier as f64 / TURN;
            let (sin, cos) = libm::sincos(TAU * (cycles - cycles as i64 as f64));
            let phasor = Complex64::new(cos, sin) * (course.amplitude * (to - from) as f64);
            // Periods of the lags about this one.
            let wraps = (lag as i64 - 8).div_euclid(chips);
            let sign = |ahead: i64| course.sign(course.period + whole + wraps + ahead);
            let signs = [sign(0), sign(1), sign(2)];
            for (sum, tap) in sums.iter_mut().zip(taps) {
                let place = lag - tap;
                let nearest = (place - *first_lag as f64) as i64 + first_lag;
                for lag in nearest - 1..=nearest + 2 {
                    let Some([before, after]) = means.get((lag - first_lag) as usize) else { continue };
                    let pulse = made.pulse.value(place - lag as f64);
                    let signs = if lag.div_euclid(chips) > wraps { &signs[1..] } else { &signs[..2] };
                    *sum += phasor * (before * signs[0] + after * signs[1]) * pulse;
                }
            }
        }
    }
}

impl Other {
    fn new((own, code): (&Course, &[i8]), sent: &[i8], course: &Arc<Course>) -> Option<Self> {
        let length = code.len() as i64;
        let lag = |x: f64| length as f64 * (at(course.periods, x) - at(own.periods, x));
        let [begin, end] = [lag(0.0), lag(1.0)];
        let first_lag = begin.min(end).floor() as i64 - MARGIN;
        let last_lag = begin.max(end).ceil() as i64 + MARGIN;
        // Turn of the carriers' difference in a chip.
        let cycles_hz = (course.cycles[1] + course.cycles[2]) - (own.cycles[1] + own.cycles[2]);
        let periods = own.periods[1] + own.periods[2];
        let (sin, cos) = libm::sincos(TAU * cycles_hz / (periods * length as f64));
        let turn = Complex64::new(cos, sin);
        // From the middle of the first chip on.
        let mut phasor = turn.sqrt() / length as f64;
        let turned: Vec<Complex64> = (code.iter())
            .map(|chip| {
                let value = phasor * f64::from(*chip);
                phasor *= turn;
                value
            })
            .collect();
        let means = (first_lag..=last_lag)
            .map(|lag| {
                let ahead = lag.rem_euclid(length) as usize;
                let (late, early) = sent.split_at(ahead);
                let mean = |own: &[Complex64], sent: &[i8]| {
                    own.iter().zip(sent).map(|(own, chip)| own * f64::from(*chip)).sum::<Complex64>()
                };
                let (first, rest) = turned.split_at(turned.len() - ahead);
                [mean(first, early), mean(rest, late)]
            })
            .collect();
        Some(Self { course: Arc::clone(course), first_lag, means })
    }
}

/// True if another satellite's short code has the carrier and the chips of this one.
pub(super) fn is_alike(this: Link, other: Link) -> bool {
    let of = |link: Link| lead(link.signal).map(|lead| (lead.code_chips, lead.chip_rate_hz, lead.steps_per_chip()));
    of(this).is_some_and(|(chips, _, steps)| chips < LEAST_LONG_CHIPS && steps == 1)
        && of(this) == of(other)
        && !this.is_alike(other)
        && this.carrier_hz() == other.carrier_hz()
}
