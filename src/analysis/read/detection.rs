//! Tests of the receiver's detectors of jamming and spoofing, spilled.

use crate::read::spill_store::{SpillRow, Words};
use gnss::record::Detector;

/// One test of a detector.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Test {
    /// Sample at the end of the tested interval.
    pub sample: u64,
    /// The detector.
    pub detector: Detector,
    /// Index of satellite and signal in the list of those that the run tested.
    pub link: u32,
    /// Statistic of the test.
    pub statistic: f64,
    /// Threshold of the statistic.
    pub threshold: f64,
    /// True if the receiver states an alarm.
    pub alarm: bool,
}

impl SpillRow<()> for Test {
    const WORDS: usize = 4;

    fn put(&self, words: &mut Vec<u64>) {
        let place = Detector::ALL.iter().position(|one| *one == self.detector).unwrap_or(0);
        let kind = place as u64 | u64::from(self.alarm) << 8 | u64::from(self.link) << 16;
        words.extend([self.sample, kind, self.statistic.to_bits(), self.threshold.to_bits()]);
    }

    fn take((): (), words: &mut Words<'_>) -> Self {
        let (sample, kind, statistic, threshold) = (words.word(), words.word(), words.number(), words.number());
        let detector = Detector::ALL.get(kind as usize & 0xff).copied().unwrap_or(Detector::Level);
        Self { sample, detector, link: (kind >> 16) as u32, statistic, threshold, alarm: kind >> 8 & 1 == 1 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_test_comes_back_from_its_words() {
        let run = tempfile::tempdir().unwrap();
        let mut table = crate::read::Table::new(run.path());
        let rows = Detector::ALL.map(|detector| Test {
            sample: 7 + detector as u64,
            detector,
            link: 70_000,
            statistic: -0.25,
            threshold: 3.29,
            alarm: detector == Detector::Raim,
        });
        rows.iter().for_each(|row| table.push(*row).unwrap());
        assert_eq!(table.map(|row| row).unwrap(), rows);
    }
}
