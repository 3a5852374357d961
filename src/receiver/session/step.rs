//! Front ends in step: whose samples count, and what a sample of one is to another.
//!
//! All front ends sample by one clock, each at its own rate. Records count the samples of the first front
//! end. A front end that lost samples is behind by as many from then on, and [`Step`] knows it.

use crate::lead::lead;
use crate::output::{OutputError, Record, Sink};
use gnss::record::{AcquisitionRow, EventRow, LineRow, TrackingRow};
use gnss::time::Rate;

/// The clock of one front end against that of the first.
#[derive(Clone, Copy, Debug)]
pub(super) struct Step {
    /// Index of the front end.
    pub number: usize,
    rate: Rate,
    main: Rate,
    /// Number of samples missing so far in this front end.
    behind: i64,
    /// Number of samples missing so far in the first front end.
    main_behind: i64,
}

impl Step {
    /// A front end of that rate beside a first one of the rate `main`, both from the same instant on.
    pub fn new(number: usize, rate: Rate, main: Rate) -> Self {
        Self { number, rate, main, behind: 0, main_behind: 0 }
    }

    /// Takes a number of missing samples of this front end; negative where they came twice.
    pub fn lose(&mut self, samples: i64) {
        self.behind += samples;
        if self.number == 0 {
            self.main_behind = self.behind;
        }
    }

    /// Takes the number of samples that the first front end has lost so far.
    pub fn follow(&mut self, main_behind: i64) {
        self.main_behind = main_behind;
    }

    /// Samples that are missing so far.
    pub fn behind(&self) -> i64 {
        self.behind
    }

    /// The first sample of this front end that is not earlier than a sample of the first one.
    pub fn own(&self, main: u64) -> u64 {
        if self.number == 0 {
            return main;
        }
        let place = i128::from(main) + i128::from(self.main_behind);
        let (over, under) = ratio(self.rate, self.main);
        sample((place * over + under - 1).div_euclid(under) - i128::from(self.behind))
    }

    /// The last sample of the first front end that is not later than a sample of this one.
    pub fn main(&self, own: u64) -> u64 {
        if self.number == 0 {
            return own;
        }
        let place = i128::from(own) + i128::from(self.behind);
        let (over, under) = ratio(self.main, self.rate);
        sample((place * over).div_euclid(under) - i128::from(self.main_behind))
    }

    /// Seconds by which a sample of the first front end is later than one of this one.
    pub fn later_s(&self, main: u64, own: u64) -> f64 {
        if self.number == 0 {
            return 0.0;
        }
        let at = |rate: Rate, sample: u64, behind: i64| {
            rate.elapsed((i128::from(sample) + i128::from(behind)).max(0) as u64)
        };
        let (seconds, fraction) = at(self.main, main, self.main_behind);
        let (own_seconds, own_fraction) = at(self.rate, own, self.behind);
        (seconds - own_seconds) as f64 + (fraction - own_fraction)
    }
}

/// Samples at one rate for those at another, as a fraction.
fn ratio(to: Rate, from: Rate) -> (i128, i128) {
    let ((samples, seconds), (from_samples, from_seconds)) = (to.ratio(), from.ratio());
    (i128::from(samples) * i128::from(from_seconds), i128::from(from_samples) * i128::from(seconds))
}

fn sample(place: i128) -> u64 {
    place.clamp(0, i128::from(u64::MAX)) as u64
}

/// A sample at which channels report: by the count of the first front end, and by this one's.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Tick {
    pub main: u64,
    pub own: u64,
}

/// A sink of records that count the samples of one front end, which hands them on counting those of the
/// first.
pub(super) struct Counted<'a> {
    pub sink: &'a mut dyn Sink,
    pub step: Step,
    /// The ticks of the running block.
    pub ticks: &'a [Tick],
}

impl Counted<'_> {
    fn counted(&self, record: Record) -> Record {
        let step = &self.step;
        match record {
            Record::Tracking(row) => {
                let tick = self.ticks.iter().find(|tick| tick.own == row.sample);
                let sample = tick.map_or_else(|| step.main(row.sample), |tick| tick.main);
                Record::Tracking(TrackingRow { sample, ..row })
            }
            Record::Event(row) => Record::Event(EventRow { sample: step.main(row.sample), ..row }),
            Record::Acquisition(row) => {
                let sample = step.main(row.sample);
                let code = lead(row.signal).map_or((0.0, 1.0), |c| (c.chip_rate_hz, f64::from(c.code_chips)));
                let rate = code.0 * (1.0 + row.doppler_hz / row.signal.carrier_hz(row.sv));
                let phase = row.code_phase_chips + rate * step.later_s(sample, row.sample);
                Record::Acquisition(AcquisitionRow { sample, code_phase_chips: phase.rem_euclid(code.1), ..row })
            }
            Record::Interference { row, .. } => {
                let row = LineRow { sample: step.main(row.sample), ..row };
                Record::Interference { front_end: step.number, row }
            }
            other => other,
        }
    }
}

impl Sink for Counted<'_> {
    fn take(&mut self, record: Record) -> Result<(), OutputError> {
        let record = if self.step.number == 0 { record } else { self.counted(record) };
        self.sink.take(record)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn step(hz: f64, main_hz: f64) -> Step {
        Step::new(1, Rate::from_hz(hz).unwrap(), Rate::from_hz(main_hz).unwrap())
    }

    #[test]
    fn samples_at_one_instant_are_found_at_any_ratio_of_rates() {
        let (slow, same) = (step(2.6e6, 10e6), step(10e6, 10e6));
        assert_eq!((slow.own(200_000), slow.main(52_000), slow.later_s(200_000, 52_000)), (52_000, 200_000, 0.0));
        // Sample 1 of the first is 0.26 of a sample: the next is sample 1, at 3.85 samples of the first.
        assert_eq!((slow.own(1), slow.main(1)), (1, 3));
        assert!((slow.later_s(1, 1) - (1e-7 - 1.0 / 2.6e6)).abs() < 1e-20);
        for sample in [0, 1, 77, 1 << 50] {
            assert_eq!((same.own(sample), same.main(sample)), (sample, sample));
        }
    }

    #[test]
    fn lost_samples_move_a_front_end_ahead_of_its_count() {
        let mut slow = step(2.5e6, 10e6);
        slow.lose(100);
        assert_eq!((slow.own(4000), slow.main(900), slow.later_s(4000, 900)), (900, 4000, 0.0));
        // What the first loses as well, 400 of its samples for 100, puts both in step again.
        slow.follow(400);
        assert_eq!((slow.own(4000), slow.main(1000)), (1000, 4000));
        // Before its beginning there is no sample.
        slow.lose(5000);
        assert_eq!(slow.own(0), 0);
    }
}
