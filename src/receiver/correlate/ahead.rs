//! Answers about code periods before they run.
//!
//! The oscillators of a channel keep their steps between two updates of its loops, so the code periods of an
//! integration are known when it begins. A correlator that answers all of them for less than one after the
//! other is asked once, and the answers are kept. An answer counts for the very interval that it was given
//! for: where a channel has moved its oscillators in between, it asks again. Phases of the carrier are
//! predicted by its step, which is rounded to 2⁻⁶⁴ turn; they may differ by 2⁻⁴⁰ turn from those of the
//! channel.

use num_complex::Complex64;

use super::correlator::{Coded, Correlator, Interval};
use super::{Arithmetic, Nco};

/// Code periods that are asked about together, at most.
const MOST: usize = 8;
/// Difference of phases below which they are the same, in 2⁻⁶⁴ turn.
const SAME: u64 = 1 << 24;

/// Answers that wait for their code periods.
#[derive(Clone, Debug, Default)]
pub struct Ahead {
    taps: Vec<i64>,
    intervals: Vec<Interval>,
    /// Sums of each interval, one for each tap.
    sums: Vec<Complex64>,
    /// Number of the next interval.
    next: usize,
}

impl Ahead {
    /// Sums of a code period at taps, for which `length` code phase units are a period and the oscillators
    /// are expected to keep their steps for `periods` periods from this one on.
    pub fn sums<C: Correlator, const T: usize>(
        &mut self,
        correlator: &C,
        (interval, length, periods): (&Interval, i64, u32),
        (coded, arithmetic): (&Coded, Arithmetic),
        taps: &[i64; T],
    ) -> [Complex64; T] {
        if let Some(sums) = self.known(interval, taps) {
            return sums;
        }
        self.next = usize::MAX;
        if periods < 2 || correlator.together() <= interval.to {
            return correlator.sums(interval, coded, arithmetic, taps);
        }
        self.intervals.clear();
        self.intervals.push(*interval);
        let mut last = *interval;
        while self.intervals.len() < MOST.min(periods as usize) {
            last = following(&last, length);
            if last.to > correlator.together() || last.to <= last.from {
                break;
            }
            self.intervals.push(last);
        }
        let mut sums = [[Complex64::ZERO; T]; MOST];
        let sums = &mut sums[..self.intervals.len()];
        correlator.sums_of(&self.intervals, coded, arithmetic, taps, sums);
        self.taps.clear();
        self.taps.extend_from_slice(taps);
        self.sums.clear();
        self.sums.extend_from_slice(sums.as_flattened());
        self.next = 1;
        sums[0]
    }

    /// The next answer, if it is about this interval and these taps.
    #[inline]
    fn known<const T: usize>(&mut self, interval: &Interval, taps: &[i64; T]) -> Option<[Complex64; T]> {
        self.intervals.get(self.next).filter(|next| is_same(next, interval) && self.taps == taps)?;
        let sums = self.sums.get(self.next * T..).and_then(|sums| sums.first_chunk()).copied();
        self.next += 1;
        sums
    }
}

/// True if two intervals are the same, with the same oscillators.
fn is_same(a: &Interval, b: &Interval) -> bool {
    let apart = a.nco.carrier.wrapping_sub(b.nco.carrier).wrapping_add(SAME / 2);
    (a.from, a.to, a.end) == (b.from, b.to, b.end)
        && (a.nco.code, a.nco.code_step, a.nco.carrier_step) == (b.nco.code, b.nco.code_step, b.nco.carrier_step)
        && apart < SAME
}

/// The code period after another, of `length` code phase units.
fn following(interval: &Interval, length: i64) -> Interval {
    let Interval { nco, from, end, .. } = *interval;
    let samples = end.saturating_sub(from);
    let code = nco.code.wrapping_add(nco.code_step.wrapping_mul(samples) as i64).wrapping_sub(length);
    let carrier = nco.carrier.wrapping_add(nco.carrier_step.wrapping_mul(samples));
    let to = end + (length.wrapping_sub(code).max(1) as u64).div_ceil(nco.code_step.max(1));
    Interval { nco: Nco { code, carrier, ..nco }, from: end, to, end: to }
}

#[cfg(test)]
mod tests {
    use std::cell::RefCell;

    use gnss::gps::l1ca::L1_CA;
    use gnss::satellite::{Sv, System};
    use gnss::signal::{Layers, Link};

    use super::*;
    use crate::correlate::correlator::Code;
    use crate::correlate::{Edge, Replica};

    /// Answers with the number of the first sample, and keeps the numbers of intervals that it was asked
    /// about.
    struct Numbers(RefCell<Vec<usize>>);

    impl Correlator for Numbers {
        fn first(&self) -> u64 {
            0
        }

        fn end(&self) -> u64 {
            u64::MAX
        }

        fn fresh(&self) -> u64 {
            0
        }

        fn together(&self) -> u64 {
            12_500
        }

        fn sums_of<const T: usize>(
            &self,
            intervals: &[Interval],
            _: &Coded,
            _: Arithmetic,
            _: &[i64; T],
            sums: &mut [[Complex64; T]],
        ) {
            self.0.borrow_mut().push(intervals.len());
            for (sums, interval) in sums.iter_mut().zip(intervals) {
                *sums = [Complex64::new(interval.from as f64, interval.nco.code as f64); T];
            }
        }

        fn power(&self, _: u64, _: u64) -> f64 {
            1.0
        }
    }

    fn coded() -> Coded {
        let link = Link { sv: Sv { system: System::Gps, number: 1 }, signal: &L1_CA };
        let (component, made) = (&L1_CA.components[0], (Layers::Whole, Edge::Nearest));
        let replica = Replica::made(component, 1, made.0, made.1).unwrap();
        Coded { replica, code: Code::new(link, component, made) }
    }

    /// Twelve code periods whose oscillators `moved` changes before each of them; the answers, and of how
    /// many periods each question was.
    fn followed(moved: impl Fn(u32, &mut Nco)) -> (Vec<Interval>, Vec<Complex64>, Vec<usize>) {
        const LENGTH: i64 = 1_000_000;
        let (numbers, coded, mut ahead) = (Numbers(RefCell::default()), coded(), Ahead::default());
        let mut nco = Nco { carrier: 5, carrier_step: u64::MAX / 3, code: 77, code_step: 999 };
        let (mut from, mut intervals, mut answers) = (0, Vec::new(), Vec::new());
        for period in 0..12 {
            moved(period, &mut nco);
            let to = from + ((LENGTH - nco.code) as u64).div_ceil(nco.code_step);
            let interval = Interval { nco, from, to, end: to };
            let asked = (&interval, LENGTH, 4 - period % 4);
            let [sum, _] = ahead.sums(&numbers, asked, (&coded, Arithmetic::F64), &[1, 0]);
            answers.push(sum);
            intervals.push(interval);
            nco.code += (nco.code_step * (to - from)) as i64 - LENGTH;
            nco.carrier = nco.carrier.wrapping_add(nco.carrier_step.wrapping_mul(to - from));
            from = to;
        }
        (intervals, answers, numbers.0.into_inner())
    }

    #[test]
    fn periods_between_two_updates_are_asked_about_once_and_each_gets_its_own_answer() {
        let (intervals, answers, asked) = followed(|_, nco| nco.carrier = nco.carrier.wrapping_add(1));
        for (interval, answer) in intervals.iter().zip(answers) {
            assert_eq!(answer, Complex64::new(interval.from as f64, interval.nco.code as f64));
        }
        // A period has 1001 samples: the correlator can be asked about all twelve.
        assert_eq!(asked, [4, 4, 4]);
    }

    #[test]
    fn whoever_moves_its_oscillators_is_answered_anew() {
        for moved in [
            (|nco| nco.code += 1) as fn(&mut Nco),
            |nco| nco.code_step += 1,
            |nco| nco.carrier_step += 1,
            |nco| nco.carrier = nco.carrier.wrapping_add(SAME),
        ] {
            let (intervals, answers, asked) = followed(|period, nco| {
                if period == 6 {
                    moved(nco);
                }
            });
            for (interval, answer) in intervals.iter().zip(answers) {
                assert_eq!(answer, Complex64::new(interval.from as f64, interval.nco.code as f64));
            }
            assert_eq!(asked, [4, 4, 2, 4]);
        }
    }
}
