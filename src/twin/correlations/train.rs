//! Consecutive code periods in a correlator, with one pass over what moves slowly.
//!
//! Between two updates of a channel's loops its oscillators keep their steps. The difference of the codes is
//! then linear over all periods of an integration, that of the carriers a parabola. Both are computed once;
//! the correlation follows a line through both ends, and the mean of the carrier over a piece of the parabola
//! is its value in the middle times sin(x)/x, x the half of what it turns. With the limits below the line
//! misses a corner of the correlation by 1.3e-4 at most, and the mean of the carrier errs by 3e-6 and 6e-6
//! cycle: the square of the parabola's deviation, and its product with the square of the turn. Periods beyond
//! them, and rays that fade quickly or meet a knot, are computed one by one.

use std::f64::consts::PI;

use num_complex::Complex64;
use receiver::correlate::correlator::Interval;
use receiver::correlate::phasor;

use super::ray::{Course, Question};
use super::sent::{Leg, Sent, turns};
use super::taps::MOST;

/// Largest gain of the code over all periods, in chips.
const GAINED_CHIPS: f64 = 2.5e-4;
/// Largest turn of the carrier in a period, in cycles.
const TURNED_CYCLES: f64 = 0.1;
/// Largest quadratic part of the carrier at the end of a period, in cycles.
const BENT_CYCLES: f64 = 5e-3;

/// The sums that a receiver asks for over consecutive intervals.
pub(super) struct Train<'a> {
    /// Question about all of them as one, which ends as the first one's code period does.
    pub whole: Question<'a>,
    pub intervals: &'a [Interval],
}

impl<'a> Train<'a> {
    /// Question about intervals that follow one another; `None` without any.
    pub fn new(question: Question<'a>, intervals: &'a [Interval]) -> Option<Self> {
        let (first, last) = (intervals.first()?, intervals.last()?);
        let whole = Question { interval: Interval { to: last.to, ..*first }, ..question };
        Some(Self { whole, intervals })
    }

    /// Adds the sums of a satellite's rays: for each interval one for each tap.
    pub fn add(&self, sent: &Sent, taps: &[f64], sums: &mut [Complex64]) {
        let Interval { from, to, .. } = self.whole.interval;
        let together = || sent.leg(from + (to - from) / 2).filter(|leg| leg.holds(from, to));
        let Some(leg) = together().filter(|_| from < to && !sent.is_quick()) else {
            return self.each(taps, sums, |question, sums| question.add(sent, taps, sums));
        };
        let components = &self.whole.made.signal.components;
        for ray in 0..leg.anchors.len() {
            let Some((anchor, ends)) = self.whole.ends(leg, ray) else { continue };
            let cycles = self.whole.cycles(anchor, &ends);
            for (index, component) in components.iter().enumerate() {
                let is_long = component.code_chips > self.whole.made.length;
                let course = self.whole.course((sent.scene, anchor), (&ends, cycles), index);
                match course {
                    Some(course) if !is_long && self.is_smooth(&course) => self.follow(sent, &course, taps, sums),
                    _ => self.add_each(sent, leg, (ray, index), taps, sums),
                }
            }
        }
    }

    fn add_each(&self, sent: &Sent, leg: &Leg, of: (usize, usize), taps: &[f64], sums: &mut [Complex64]) {
        self.each(taps, sums, |question, sums| question.add_component(sent, leg, of, taps, sums));
    }

    /// Asks about one interval after the other.
    fn each(&self, taps: &[f64], sums: &mut [Complex64], mut ask: impl FnMut(Question, &mut [Complex64])) {
        for (interval, sums) in self.intervals.iter().zip(sums.chunks_mut(taps.len().max(1))) {
            ask(Question { interval: *interval, ..self.whole }, sums);
        }
    }

    fn is_smooth(&self, course: &Course) -> bool {
        let [_, rate, bend] = course.cycles;
        let count = self.intervals.len() as f64;
        let turned = (rate.abs() + 2.0 * bend.abs()) / count;
        course.chips[1].abs() < GAINED_CHIPS && turned < TURNED_CYCLES && bend.abs() < BENT_CYCLES * count * count
    }

    /// Adds the means of a course over the intervals.
    fn follow(&self, sent: &Sent, course: &Course, taps: &[f64], sums: &mut [Complex64]) {
        let reach = course.peak.reach_chips() + course.chips[1].abs();
        if taps.iter().all(|tap| (course.chips[0] - tap).abs() > reach) {
            return;
        }
        let [begin, gained] = course.chips;
        let [constant, rate, bend] = course.cycles;
        let (mut values, mut gains) = ([Complex64::ZERO; MOST], [Complex64::ZERO; MOST]);
        for ((value, gain), tap) in values.iter_mut().zip(&mut gains).zip(taps) {
            *value = course.peak.value(begin - tap);
            *gain = course.peak.value(begin + gained - tap) - *value;
        }
        let (first, per_sample) =
            (self.whole.interval.from, 1.0 / (self.whole.interval.to - self.whole.interval.from) as f64);
        // The sum of samples is the integral from half a sample before the first one.
        let share = |sample: u64| ((sample - first) as f64 - 0.5) * per_sample;
        for (interval, sums) in self.intervals.iter().zip(sums.chunks_mut(taps.len().max(1))) {
            let ends = (share(interval.from), share(interval.to));
            course.pieces(sent, ends, course.period_at(ends.0), |(from, to), sign| {
                let (middle, width) = (0.5 * (from + to), to - from);
                let half = PI * (rate + 2.0 * bend * middle) * width;
                let square = half * half;
                let sinc = 1.0 - square * (1.0 / 6.0 - square * (1.0 / 120.0));
                // The parabola's own mean is a twelfth of the square of the width above the middle.
                let cycles = constant + middle * (rate + middle * bend) + bend * width * width / 12.0;
                let phasor = phasor(turns(cycles)) * (sign * width * course.amplitude * sinc);
                for (sum, (value, gain)) in sums.iter_mut().zip(values.iter().zip(&gains)) {
                    *sum += phasor * (value + gain * middle);
                }
            });
        }
    }
}
