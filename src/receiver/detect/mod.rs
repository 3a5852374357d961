//! Detectors of jamming and spoofing: numbers with thresholds of a stated false-alarm probability.
//!
//! [`level`] watches the power of the samples, [`shapes`] the correlation and the C/N0 of every signal,
//! [`divergence`] code against carrier, [`jumps`] positions and clock against velocity and drift; the
//! residual test of a fix ([`crate::position::exclusion`]) is the detector `raim`, that of an array's
//! carriers ([`crate::array::compass`]) the detector `directions`. The sums that they need are gathered as
//! the receiver works, and an interval is tested as a whole at its end. Each module derives the law of its
//! statistic under a clean sky, and [`law`] has the thresholds. Levels, C/N0 and shapes are compared with
//! the intervals before, without those that raised an alarm. A signal is not tested in an interval in
//! which its code meets another one ([`meeting`]). Without `[detection]` in the settings nothing is
//! gathered. Limits: what is stated holds for one test. A sky of the first intervals that is spoofed
//! already is taken for clean by the detectors that compare.

pub mod divergence;
pub mod jumps;
pub mod law;
pub mod level;
pub mod meeting;
mod outcome;
#[cfg(test)]
mod random;
pub mod shapes;

use std::collections::{BTreeMap, VecDeque};

use crate::output::{OutputError, Record, Sink};
use crate::position::{CodeNoise, Noises};
use crate::settings::Settings;
use crate::settings::detection::DetectionSettings;
use crate::source::Packed;
use crate::threshold::threshold;
use crate::track::shape::Shape;
use divergence::Divergence;
use gnss::record::{DetectionRow, Detector, Fix, Observation};
use gnss::signal::{Link, Signal};
use gnss::time::Rate;
use jumps::Jumps;
use level::Level;
pub use outcome::{Counted, Detected};
use shapes::Tested;

/// Fewest signals that can share a fall of C/N0.
const LEAST_SIGNALS: usize = 4;
/// Degrees of freedom of a position.
const COORDINATES: u32 = 3;

/// Detectors of a reception.
#[derive(Debug)]
pub struct Detection {
    settings: DetectionSettings,
    noises: Noises,
    rate: Rate,
    /// Number of the running interval.
    number: u64,
    levels: Vec<Level>,
    signals: BTreeMap<Link, shapes::Signal>,
    shapes: BTreeMap<Link, Shape>,
    /// Doppler of each signal at both ends of the interval.
    dopplers_hz: BTreeMap<Link, [f64; 2]>,
    /// Middle falls of C/N0 in the intervals before.
    falls: VecDeque<f64>,
    codes: BTreeMap<Link, Divergence>,
    jumps: Jumps,
    /// Latest residual test: its sum of squares and their degrees of freedom.
    residuals: Option<(f64, usize)>,
    /// Latest comparison of an array's elements: its sum of squares and their degrees of freedom.
    directions: Option<(f64, usize)>,
    counts: BTreeMap<Detector, Counted>,
}

impl Detection {
    /// Detectors of a receiver whose first front end samples at `rate`; `None` where its settings ask for
    /// none.
    pub fn new(settings: &Settings, noises: Noises, rate: Rate, front_ends: usize) -> Option<Self> {
        Some(Self {
            settings: settings.detection.clone()?,
            noises,
            rate,
            number: 1,
            levels: (0..front_ends).map(|_| Level::default()).collect(),
            signals: BTreeMap::new(),
            shapes: BTreeMap::new(),
            dopplers_hz: BTreeMap::new(),
            falls: VecDeque::new(),
            codes: BTreeMap::new(),
            jumps: Jumps::default(),
            residuals: None,
            directions: None,
            counts: BTreeMap::new(),
        })
    }

    fn noise(&self, signal: &Signal) -> Option<&CodeNoise> {
        self.noises.iter().find(|(of, _)| *of == signal).map(|(_, noise)| noise)
    }

    /// Takes a block of the samples of a front end.
    pub fn take_samples(&mut self, front_end: usize, block: &Packed) {
        if let Some(level) = self.levels.get_mut(front_end) {
            level.take(block);
        }
    }

    /// Takes the correlations of a signal's interval, and the Doppler at its end.
    pub fn take_shape(&mut self, link: Link, shape: Shape, doppler_hz: f64) {
        self.shapes.insert(link, shape);
        let ends_hz = self.dopplers_hz.entry(link).or_insert([doppler_hz; 2]);
        *ends_hz = [ends_hz[1], doppler_hz];
    }

    /// Takes the observations of an instant.
    pub fn take_observations(&mut self, rows: &[Observation]) {
        for row in rows {
            let cn0_hz = libm::pow(10.0, row.cn0_dbhz / 10.0);
            let Some(sigma_m) = self.noise(row.signal).map(|noise| noise.sigma_m(cn0_hz)) else { continue };
            self.codes.entry(row.link()).or_default().take(row, sigma_m);
        }
    }

    /// Takes the sum of squares of all ranges' residuals at an instant, and their degrees of freedom.
    pub fn take_residuals(&mut self, residuals: Option<(f64, usize)>) {
        self.residuals = residuals.or(self.residuals);
    }

    /// Takes the sum of squares of the phases' residuals in an array's elements, and their degrees of
    /// freedom.
    pub fn take_directions(&mut self, tested: (f64, usize)) {
        self.directions = Some(tested);
    }

    /// Takes a fix.
    pub fn take_fix(&mut self, fix: &Fix) {
        let rate = self.rate;
        self.jumps.take(fix, |samples| rate.elapsed_s(samples));
    }

    /// Samples are missing: what was gathered of the running interval is not one.
    pub fn interrupt(&mut self) {
        self.levels.iter_mut().for_each(Level::interrupt);
        self.shapes.clear();
        self.dopplers_hz.clear();
        self.codes.clear();
        self.jumps.interrupt();
        self.residuals = None;
        self.directions = None;
    }

    /// True if the running interval ends before a sample.
    pub fn is_due(&self, sample: u64) -> bool {
        self.rate.elapsed_s(sample) >= self.number as f64 * self.settings.interval_s
    }

    /// Ends the interval before a sample, and gives its tests to `sink`.
    ///
    /// # Errors
    /// Records that cannot be written.
    pub fn close(&mut self, sample: u64, sink: &mut dyn Sink) -> Result<(), OutputError> {
        self.number = (self.rate.elapsed_s(sample) / self.settings.interval_s) as u64 + 1;
        let mut rows = Vec::new();
        let is_loud = self.test_levels(&mut rows);
        self.test_shapes(is_loud, &mut rows);
        self.test_codes(&mut rows);
        self.test_fixes(&mut rows);
        for (detector, (sv, signal), statistic, threshold) in rows {
            let alarm = statistic > threshold;
            let counted =
                self.counts.entry(detector).or_insert(Counted { detector, tests: 0, alarms: 0, first_alarm_s: None });
            counted.tests += 1;
            counted.alarms += u64::from(alarm);
            if alarm {
                counted.first_alarm_s.get_or_insert(self.rate.elapsed_s(sample));
            }
            sink.take(Record::Detection(DetectionRow { sample, detector, sv, signal, statistic, threshold, alarm }))?;
        }
        Ok(())
    }

    /// Intervals that a reference has at least, and at most.
    fn reference(&self) -> (usize, usize) {
        let most = self.settings.intervals();
        (most.div_ceil(2), most)
    }

    /// Tests the level of every front end; true if one raises an alarm.
    fn test_levels(&mut self, rows: &mut Vec<Test>) -> bool {
        let (threshold, reference) = (law::two_sided(self.settings.false_alarm), self.reference());
        let (several, mut is_loud) = (self.levels.len() > 1, false);
        for (number, level) in self.levels.iter_mut().enumerate() {
            if let Some(statistic) = level.close(reference, threshold) {
                let name = if several { format!("front end {}", number + 1) } else { String::new() };
                is_loud |= statistic > threshold;
                rows.push((Detector::Level, (String::new(), name), statistic, threshold));
            }
        }
        is_loud
    }

    /// Tests every signal whose code meets no other by itself, and all for a common fall. Nothing becomes a
    /// part of the references where the level raised an alarm.
    fn test_shapes(&mut self, is_loud: bool, rows: &mut Vec<Test>) {
        let (least, most) = self.reference();
        let ended = std::mem::take(&mut self.shapes);
        let interval_s = self.settings.interval_s;
        self.dopplers_hz.retain(|link, _| ended.contains_key(link));
        let met = meeting::meeting(&self.dopplers_hz, interval_s);
        let tested: Vec<(Link, Shape, Tested)> = (ended.into_iter())
            .filter(|(link, shape)| shapes::is_whole(shape, interval_s) && !met.contains(link))
            .map(|(link, shape)| {
                let tested = self.signals.entry(link).or_default().test(&shape, least);
                (link, shape, tested)
            })
            .collect();
        let mut falls: Vec<f64> = tested.iter().filter_map(|(_, _, tested)| tested.fall).collect();
        falls.sort_by(|a, b| b.total_cmp(a));
        let middle = falls.get(falls.len() / 2).copied().filter(|_| falls.len() >= LEAST_SIGNALS);
        let fell = middle.is_some_and(|middle| self.test_fall(middle, is_loud, rows));
        let threshold = law::two_sided(self.settings.false_alarm);
        type Of = fn(&Tested) -> Option<f64>;
        let each: [(Detector, Of); 3] = [
            (Detector::CorrelationRatio, |tested| tested.ratio),
            (Detector::CorrelationPhase, |tested| tested.phase),
            (Detector::CorrelationDelta, |tested| tested.delta),
        ];
        for (detector, of) in each {
            for (link, _, tested) in &tested {
                rows.extend(of(tested).map(|statistic| (detector, named(*link), statistic.abs(), threshold)));
            }
        }
        for (link, shape, tested) in tested {
            let is_bent = each.iter().any(|(_, of)| of(&tested).is_some_and(|statistic| statistic.abs() > threshold));
            if !fell && !is_loud && !is_bent {
                self.signals.entry(link).or_default().keep(shape, most);
            }
        }
    }

    /// Compares the middle fall of C/N0 with those of the intervals before; true if it raises an alarm.
    fn test_fall(&mut self, middle: f64, is_loud: bool, rows: &mut Vec<Test>) -> bool {
        let ((least, most), limit) = (self.reference(), law::quantile(self.settings.false_alarm));
        let tested = if self.falls.len() < least { None } else { law::among(middle, self.falls.make_contiguous()) };
        rows.extend(tested.map(|statistic| (Detector::Cn0Fall, (String::new(), String::new()), statistic, limit)));
        let fell = tested.is_some_and(|statistic| statistic > limit);
        if !fell && !is_loud {
            self.falls.push_back(middle);
            while self.falls.len() > most {
                self.falls.pop_front();
            }
        }
        fell
    }

    fn test_codes(&mut self, rows: &mut Vec<Test>) {
        let (threshold, (_, most)) = (law::two_sided(self.settings.false_alarm), self.reference());
        let (interval_s, rate) = (self.settings.interval_s, self.rate);
        let mut codes = std::mem::take(&mut self.codes);
        for (link, code) in &mut codes {
            let Some(loop_hz) = self.noise(link.signal).map(|noise| noise.bandwidth_hz) else { continue };
            let found = code.close(interval_s, loop_hz, most, |samples| rate.elapsed_s(samples));
            rows.extend(found.map(|statistic| (Detector::CodeCarrier, named(*link), statistic, threshold)));
        }
        self.codes = codes;
    }

    fn test_fixes(&mut self, rows: &mut Vec<Test>) {
        let none = || (String::new(), String::new());
        let probability = self.settings.false_alarm;
        let residuals = [(Detector::Raim, self.residuals.take()), (Detector::Directions, self.directions.take())];
        for (detector, tested) in residuals {
            let of = |(statistic, freedom)| (detector, none(), statistic, threshold(probability, freedom as u32));
            rows.extend(tested.map(of));
        }
        if let Some(jump) = self.jumps.close() {
            rows.push((Detector::PositionJump, none(), jump.position, threshold(probability, COORDINATES)));
            let clock = jump.clock.map(|clock| (Detector::ClockJump, none(), clock, law::two_sided(probability)));
            rows.extend(clock);
        }
    }

    /// Outcome up to now.
    pub fn outcome(&self) -> Detected {
        Detected { false_alarm: self.settings.false_alarm, detectors: self.counts.values().cloned().collect() }
    }
}

/// Detector, satellite and signal, statistic and threshold.
type Test = (Detector, (String, String), f64, f64);

fn named(link: Link) -> (String, String) {
    (link.sv.to_string(), link.signal.name.to_owned())
}

#[cfg(test)]
mod tests;
