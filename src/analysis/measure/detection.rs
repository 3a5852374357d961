//! Tests of the receiver's detectors of jamming and spoofing against the scene's truth.
//!
//! Truth has the times at which jammers and spoofers send. A test is clean if no such time lies in its
//! interval or shortly before it, and attacked if one lies in it. Alarms of clean tests are false; their
//! share is compared with the stated probability by its exact binomial interval (Clopper and Pearson 1934).
//! Tests are not independent: they share references, and codes that meet disturb several signals for seconds.
//! They count as so many fewer as alarms scatter more between segments of the reference's length than those
//! of independent tests. Residuals of smoothed ranges are correlated: their tests count at most as the
//! independent ones that would fix a mean as well. The ROC curve has the share of attacked and of clean tests
//! above every multiple of their thresholds. Limits: tests after an attack count as neither while the
//! receiver's references and filters remember it; a detector that an attack does not concern, such as the
//! level under a weak spoofer, has a low share of detection.

use std::collections::BTreeMap;

use serde::Serialize;
use serde_json::Value;

use crate::error::JudgeError;
use crate::measure::independent::Correlated;
use crate::measure::protection::interval_of;
use crate::read::Run;
use crate::read::attacks::Attack;
use crate::read::detection::Test;
use gnss::record::Detector;

/// Time for which filters of a receiver remember an attack, if its references do not for longer.
const REMEMBERED_S: f64 = 30.0;
/// Bins of the ROC curve per decade of the statistic over its threshold.
const BINS_PER_DECADE: f64 = 50.0;
/// Decades below one that the curve has, and all of its bins, two more decades.
const DECADES_BELOW: f64 = 3.0;
const BINS: usize = 251;

/// Truth about a test.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Label {
    /// Nobody interferes.
    Clean,
    /// A jammer sends.
    Jammed,
    /// A spoofer sends.
    Spoofed,
    /// Shortly after an attack.
    After,
}

/// A row of `detection.csv` of the judge.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Labelled<'a> {
    sample: u64,
    time_s: f64,
    detector: Detector,
    sv: &'a str,
    signal: &'a str,
    statistic: f64,
    threshold: f64,
    alarm: bool,
    label: Label,
}

/// A point of a detector's ROC curve: a row of `roc.csv`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct RocPoint {
    /// The detector.
    pub detector: Detector,
    /// Statistic over its threshold from which on a test counts as an alarm.
    pub threshold_ratio: f64,
    /// Share of the clean tests that are alarms.
    pub false_alarm_share: f64,
    /// Share of the attacked tests that are alarms.
    pub detection_share: f64,
}

/// Figures of one detector.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct OfDetector {
    /// Tests while nobody interferes.
    pub clean_tests: usize,
    /// Alarms among them.
    pub false_alarms: usize,
    /// Share of them, and the ends of its interval; null without a test.
    pub false_alarm_share: Option<f64>,
    /// Lower end.
    pub false_alarm_low: Option<f64>,
    /// Upper end.
    pub false_alarm_high: Option<f64>,
    /// Independent tests as which the clean ones count in the interval.
    #[serde(skip)]
    pub independent_tests: f64,
    /// False alarms in an hour; null without a test.
    pub false_alarms_per_hour: Option<f64>,
    /// Tests under attack.
    pub attacked_tests: usize,
    /// Share of them with an alarm; null without one.
    pub detection_share: Option<f64>,
    /// Attacks during which it raised an alarm.
    pub attacks_detected: usize,
    /// Mean time from their beginnings to the first alarm; null without one.
    pub time_to_detect_s: Option<f64>,
    /// Area under the ROC curve: 0.5 for a detector that knows nothing; null without both kinds of tests.
    pub roc_area: Option<f64>,
}

/// `detection` in `summary.json`.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Figures {
    /// Probability that one test raises a false alarm, by the receiver's settings.
    pub stated_false_alarm: Option<f64>,
    /// Time of one test.
    pub interval_s: Option<f64>,
    /// Time in which nobody interferes and detectors tested.
    pub clean_s: f64,
    /// Times that a jammer or a spoofer begins.
    pub attacks: usize,
    /// Attacks during which any detector raised an alarm.
    pub attacks_detected: usize,
    /// Each detector that tested anything, by its name.
    pub detectors: BTreeMap<&'static str, OfDetector>,
    /// Part of the scene that the laws of the statistics leave out; `None` where there is none.
    #[serde(skip)]
    pub disturbance: Option<&'static str>,
}

/// Detection of a run.
#[derive(Debug)]
pub struct Detection {
    labels: Labels,
    /// The figures; `None` of a receiver without detectors.
    pub figures: Option<Figures>,
    /// ROC curves, detector by detector.
    pub roc: Vec<RocPoint>,
}

/// Truth by samples.
#[derive(Debug, Default)]
struct Labels {
    attacks: Vec<Attack>,
    /// Samples of a test, of a reference, and for which an attack is remembered.
    interval: u64,
    reference: u64,
    memory: u64,
}

impl Labels {
    /// Label of the test that ends at a sample.
    fn of(&self, sample: u64) -> Label {
        let sample = planted!("analysis.detection.label", sample, sample.saturating_sub(self.interval));
        let begin = sample.saturating_sub(self.interval);
        let within = |attack: &&Attack| attack.from <= sample && begin <= attack.to;
        let mut running = self.attacks.iter().filter(within).peekable();
        if running.peek().is_some() {
            return if running.any(|attack| attack.is_spoofing) { Label::Spoofed } else { Label::Jammed };
        }
        let is_recent = |attack: &Attack| attack.to < begin && begin - attack.to <= self.memory;
        if self.attacks.iter().any(is_recent) { Label::After } else { Label::Clean }
    }
}

/// Statistics of clean and attacked tests over their thresholds, as counts.
#[derive(Debug)]
struct Curve {
    counts: [[usize; BINS]; 2],
}

impl Curve {
    fn add(&mut self, test: &Test, is_attacked: bool) {
        let ratio = (test.statistic / test.threshold).max(0.0);
        let place = (libm::log10(ratio) + DECADES_BELOW) * BINS_PER_DECADE;
        // A bin's lower end belongs to it, so that the point at one is the threshold itself.
        let bin = if place.is_finite() { (place + 1e-9).clamp(0.0, (BINS - 1) as f64) as usize } else { 0 };
        self.counts[usize::from(is_attacked)][bin] += 1;
    }

    /// Points from the highest threshold down, and the area below them.
    fn points(&self, detector: Detector) -> Option<(Vec<RocPoint>, f64)> {
        let [clean, attacked] = self.counts.each_ref().map(|counts| counts.iter().sum::<usize>());
        if clean == 0 || attacked == 0 {
            return None;
        }
        let (mut points, mut area, mut above) = (Vec::new(), 0.0, [0_usize; 2]);
        let mut last = (0.0, 0.0);
        for bin in (0..BINS).rev() {
            let [own, other] = [self.counts[0][bin], self.counts[1][bin]];
            if own + other == 0 {
                continue;
            }
            above = [above[0] + own, above[1] + other];
            let shares = (above[0] as f64 / clean as f64, above[1] as f64 / attacked as f64);
            area += (shares.0 - last.0) * 0.5 * (shares.1 + last.1);
            last = shares;
            let threshold_ratio = libm::exp10(bin as f64 / BINS_PER_DECADE - DECADES_BELOW);
            points.push(RocPoint {
                detector,
                threshold_ratio: if bin == 0 { 0.0 } else { threshold_ratio },
                false_alarm_share: shares.0,
                detection_share: shares.1,
            });
        }
        Some((points, area))
    }
}

/// Counts of one detector.
#[derive(Debug)]
struct Counts {
    found: OfDetector,
    alarms: usize,
    curve: Curve,
    /// Time from each attack to the first alarm.
    delays_s: Vec<Option<f64>>,
    /// Statistics of clean tests that follow each other, where they are correlated.
    groups: Vec<Vec<f64>>,
    /// Samples of a segment.
    segment: u64,
    /// Number of the running segment, and alarms and tests of each that has clean ones.
    running: u64,
    segments: Vec<[f64; 2]>,
}

/// Number of tests that say as much as one independent test: the scatter of the alarms between segments over
/// that of independent tests, at least one.
fn dependence(segments: &[[f64; 2]]) -> f64 {
    let (count, all) = segments.iter().fold((0.0, 0.0), |(count, all), [alarms, tests]| (count + alarms, all + tests));
    let (share, number) = (count / all, segments.len() as f64);
    let alone = share * (1.0 - share) * all;
    if number < 2.0 || alone <= 0.0 {
        return 1.0;
    }
    let squares = segments.iter().map(|[alarms, tests]| (alarms - share * tests) * (alarms - share * tests));
    (squares.sum::<f64>() * number / (number - 1.0) / alone).max(1.0)
}

impl Detection {
    /// Measures it.
    ///
    /// # Errors
    /// [`JudgeError`] where rows cannot be read.
    pub fn measure(run: &Run) -> Result<Self, JudgeError> {
        if run.tests.is_empty() {
            return Ok(Self { labels: Labels::default(), figures: None, roc: Vec::new() });
        }
        let settings = run.receiver.get("settings").unwrap_or(&run.receiver);
        let number = |key: &str| settings.pointer(&format!("/detection/{key}")).and_then(Value::as_f64);
        let interval_s = number("interval_s");
        let rate_hz = run.scene.sample_rate_hz;
        let labels = Labels {
            attacks: run.attacks()?,
            interval: (interval_s.unwrap_or(0.0) * rate_hz) as u64,
            reference: (number("reference_s").unwrap_or(0.0) * rate_hz) as u64,
            memory: (number("reference_s").unwrap_or(0.0).max(REMEMBERED_S) * rate_hz) as u64,
        };
        let mut counts: BTreeMap<Detector, Counts> = BTreeMap::new();
        let (mut clean, mut last, mut was_clean) = (0_usize, None, false);
        run.tests.each(|test| {
            let label = labels.of(test.sample);
            if last.replace(test.sample) != Some(test.sample) {
                clean += usize::from(label == Label::Clean);
                was_clean = label == Label::Clean;
            }
            let own =
                counts.entry(test.detector).or_insert_with(|| Counts::new(labels.attacks.len(), labels.reference));
            own.add(&test, label, &labels.attacks, rate_hz);
            if !was_clean && own.groups.last().is_some_and(|group| !group.is_empty()) {
                own.groups.push(Vec::new());
            }
        })?;
        let clean_s = clean as f64 * interval_s.unwrap_or(0.0);
        let mut roc = Vec::new();
        let mut detectors = BTreeMap::new();
        let mut told = vec![false; labels.attacks.len()];
        for (detector, mut own) in counts {
            told.iter_mut().zip(&own.delays_s).for_each(|(told, delay_s)| *told |= delay_s.is_some());
            if let Some((points, area)) = own.curve.points(detector) {
                own.found.roc_area = Some(area);
                roc.extend(points);
            }
            detectors.insert(detector.name(), own.finish(clean_s));
        }
        let figures = Figures {
            stated_false_alarm: number("false_alarm"),
            interval_s,
            clean_s,
            attacks: labels.attacks.len(),
            attacks_detected: told.into_iter().filter(|told| *told).count(),
            detectors,
            disturbance: disturbance(run, &labels.attacks),
        };
        Ok(Self { labels, figures: Some(figures), roc })
    }

    /// Attacks of the scene.
    pub fn attacks(&self) -> &[Attack] {
        &self.labels.attacks
    }

    /// Truth about the tests that end at a sample.
    pub fn label(&self, sample: u64) -> Label {
        self.labels.of(sample)
    }

    /// Number of the first attack in the interval that ends at a sample, from 1.
    pub fn attack_of(&self, sample: u64) -> Option<usize> {
        let begin = sample.saturating_sub(self.labels.interval);
        let is_running = |attack: &Attack| attack.from <= sample && begin <= attack.to;
        self.labels.attacks.iter().position(is_running).map(|place| place + 1)
    }

    /// Samples of a test.
    pub fn interval(&self) -> u64 {
        self.labels.interval
    }

    /// A test with its truth.
    pub fn labelled<'a>(&self, run: &'a Run, test: &Test) -> Labelled<'a> {
        let names = run.tested.get(test.link as usize);
        Labelled {
            sample: test.sample,
            time_s: run.time_s(test.sample),
            detector: test.detector,
            sv: names.map_or("", |names| names[0].as_str()),
            signal: names.map_or("", |names| names[1].as_str()),
            statistic: test.statistic,
            threshold: test.threshold,
            alarm: test.alarm,
            label: self.label(test.sample),
        }
    }
}

impl Counts {
    fn new(attacks: usize, segment: u64) -> Self {
        Self {
            found: OfDetector::default(),
            alarms: 0,
            curve: Curve { counts: [[0; BINS]; 2] },
            delays_s: vec![None; attacks],
            groups: vec![Vec::new()],
            segment: segment.max(1),
            running: u64::MAX,
            segments: Vec::new(),
        }
    }

    fn add(&mut self, test: &Test, label: Label, attacks: &[Attack], rate_hz: f64) {
        let found = &mut self.found;
        match label {
            Label::After => {}
            Label::Clean => {
                found.clean_tests += 1;
                found.false_alarms += usize::from(test.alarm);
                self.curve.add(test, false);
                let number = test.sample / self.segment;
                if std::mem::replace(&mut self.running, number) != number {
                    self.segments.push([0.0; 2]);
                }
                if let Some([alarms, tests]) = self.segments.last_mut() {
                    *alarms += f64::from(u8::from(test.alarm));
                    *tests += 1.0;
                }
                if test.detector == Detector::Raim
                    && let Some(group) = self.groups.last_mut()
                {
                    group.push(test.statistic);
                }
            }
            Label::Jammed | Label::Spoofed => {
                found.attacked_tests += 1;
                self.alarms += usize::from(test.alarm);
                self.curve.add(test, true);
                for (attack, delay_s) in attacks.iter().zip(&mut self.delays_s) {
                    if test.alarm && (attack.from..=attack.to).contains(&test.sample) {
                        delay_s.get_or_insert((test.sample - attack.from) as f64 / rate_hz);
                    }
                }
            }
        }
    }

    fn finish(self, clean_s: f64) -> OfDetector {
        let Self { mut found, alarms, delays_s, groups, segments, .. } = self;
        let share = |count: usize, all: usize| (all > 0).then(|| count as f64 / all as f64);
        found.false_alarm_share = share(found.false_alarms, found.clean_tests);
        if found.clean_tests > 0 {
            let all = found.clean_tests as f64;
            let effective = Correlated::about_means(&groups).map_or(all, |own| own.independent_of_mean().min(all));
            let effective = effective.min(all / dependence(&segments));
            found.independent_tests = effective;
            let ends = interval_of(found.false_alarms as f64 * effective / all, effective);
            (found.false_alarm_low, found.false_alarm_high) = (Some(ends.0), Some(ends.1));
            found.false_alarms_per_hour = (clean_s > 0.0).then(|| found.false_alarms as f64 / (clean_s / 3600.0));
        }
        found.detection_share = share(alarms, found.attacked_tests);
        let delays_s: Vec<f64> = delays_s.into_iter().flatten().collect();
        found.attacks_detected = delays_s.len();
        found.time_to_detect_s = crate::statistics::mean(&delays_s);
        found
    }
}

/// Part of the scene for which no detector states a probability: its laws are those of an undisturbed sky.
fn disturbance(run: &Run, attacks: &[Attack]) -> Option<&'static str> {
    let expect = &run.scene.expect;
    let attacked = |from_s: f64, to_s: f64| {
        let rate_hz = run.scene.sample_rate_hz;
        attacks.iter().any(|attack| attack.from as f64 <= to_s * rate_hz && from_s * rate_hz <= attack.to as f64)
    };
    if run.rays.keys().next().is_some() {
        Some("reflections distort correlations as a spoofer does")
    } else if !run.scene.faults.is_empty() {
        Some("faults of satellites are in the residuals")
    } else if expect.whole.is_some()
        || expect.intervals.iter().any(|interval| !attacked(interval.from_s, interval.to_s))
    {
        Some("the scene declares a disturbance other than an attack")
    } else {
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn labels() -> Labels {
        let of = |from, to, is_spoofing| Attack { from, to, is_spoofing };
        Labels {
            attacks: vec![of(1000, 2000, false), of(5000, 6000, true)],
            interval: 100,
            reference: 200,
            memory: 500,
        }
    }

    fn test(sample: u64, statistic: f64) -> Test {
        Test { sample, detector: Detector::Level, link: 0, statistic, threshold: 2.0, alarm: statistic > 2.0 }
    }

    #[test]
    fn a_test_has_the_label_of_its_whole_interval() {
        let labels = labels();
        for (sample, label) in [
            (999, Label::Clean),
            (1000, Label::Jammed),
            (2100, Label::Jammed),
            (2101, Label::After),
            (2600, Label::After),
            (2601, Label::Clean),
            (5050, Label::Spoofed),
        ] {
            assert_eq!(labels.of(sample), label, "{sample}");
        }
    }

    #[test]
    fn counts_are_those_of_the_labels_and_the_delay_is_that_of_the_first_alarm() {
        let labels = labels();
        let mut counts = Counts::new(2, 200);
        for k in 1..=100_u64 {
            let sample = 100 * k;
            // One false alarm, and alarms from sample 1500 and from 5000 on.
            let loud = [300].contains(&sample) || (1500..=2000).contains(&sample) || (5000..=6000).contains(&sample);
            counts.add(&test(sample, if loud { 8.0 } else { 1.0 }), labels.of(sample), &labels.attacks, 100.0);
        }
        let (points, area) = counts.curve.points(Detector::Level).unwrap();
        let found = counts.finish(3600.0);
        // 1000 to 2100 and 5000 to 6100 are attacked, five tests after each are neither.
        assert_eq!((found.attacked_tests, found.clean_tests, found.false_alarms), (24, 66, 1));
        assert_eq!((found.attacks_detected, found.time_to_detect_s), (2, Some(2.5)));
        assert!((found.detection_share.unwrap() - 17.0 / 24.0).abs() < 1e-12);
        assert_eq!(found.false_alarms_per_hour, Some(1.0));
        let (low, high) = (found.false_alarm_low.unwrap(), found.false_alarm_high.unwrap());
        assert!(low > 0.0 && low < 1.0 / 66.0 && high > 1.0 / 66.0);
        // Two values: the curve has two points, and the area of the trapezia below them.
        assert_eq!(points.len(), 2);
        let (f, d) = (1.0 / 66.0, 17.0 / 24.0);
        assert!((area - (0.5 * f * d + (1.0 - f) * 0.5 * (1.0 + d))).abs() < 1e-12, "{area}");
        assert!(points[0].threshold_ratio <= 4.0 && points[0].threshold_ratio > 3.8);
    }

    #[test]
    fn correlated_tests_have_a_wider_interval_than_as_many_independent_ones() {
        let mut draw = crate::measure::independent::tests::Draw(5);
        let values = draw.remembering(0.97, 2000);
        let of = |detector| {
            let mut counts = Counts::new(0, 20);
            for (k, value) in values.iter().enumerate() {
                let row = Test { detector, alarm: *value > 2.0, ..test(k as u64, *value) };
                counts.add(&row, Label::Clean, &[], 1.0);
            }
            counts.finish(2000.0)
        };
        let (raim, level) = (of(Detector::Raim), of(Detector::Level));
        assert_eq!(raim.false_alarms, level.false_alarms);
        assert!(raim.false_alarm_high > level.false_alarm_high && raim.false_alarm_low < level.false_alarm_low);
    }

    #[test]
    fn alarms_in_pairs_count_once_and_scattered_ones_each() {
        let of = |is_alarm: fn(u64) -> bool| {
            let mut counts = Counts::new(0, 20);
            for k in 0..6000 {
                counts.add(&test(k, if is_alarm(k) { 3.0 } else { 1.0 }), Label::Clean, &[], 1.0);
            }
            counts.finish(6000.0)
        };
        let single = of(|k| k % 150 == 7);
        let pairs = of(|k| k % 300 < 2);
        assert_eq!((single.false_alarms, pairs.false_alarms), (40, 40));
        // 300 segments. One alarm or none in each scatters less than by chance, two or none by nearly twice
        // as much.
        assert_eq!(single.independent_tests, 6000.0);
        assert!((6000.0 / pairs.independent_tests - 2.0).abs() < 0.2, "{}", pairs.independent_tests);
        assert!(pairs.false_alarm_low < single.false_alarm_low && pairs.false_alarm_high > single.false_alarm_high);
    }

    #[test]
    fn a_run_with_a_jammer_has_labels_figures_curves_and_verdicts() {
        use crate::hand_made::{RATE_HZ, detected, planted, write};
        use gnss::record::InterferenceRow;

        let run = planted();
        detected(run.path());
        let row =
            |tenth: u64| InterferenceRow { sample: tenth * RATE_HZ / 10, source: 1, jn0_dbhz: 60.0, frequency_hz: 1e5 };
        write(&run.path().join("truth/interference.csv"), &(352..=452).map(row).collect::<Vec<_>>());
        let summary = crate::judge(run.path()).unwrap();
        let found = summary.detection.unwrap();
        assert_eq!((found.attacks, found.attacks_detected, found.interval_s), (1, 1, Some(1.0)));
        let ratio = &found.detectors["correlation_ratio"];
        // Tests of seconds 36 to 46 are attacked, those to 59 remember it. Alarms are at 5, 15, 25, 35, 45
        // and 55 s.
        assert_eq!((ratio.clean_tests, ratio.false_alarms, ratio.attacked_tests), (35, 4, 11));
        assert!((ratio.time_to_detect_s.unwrap() - 9.8).abs() < 1e-9);
        assert_eq!(found.detectors["level"].attacks_detected, 0);
        let table = std::fs::read_to_string(run.path().join("detection.csv")).unwrap();
        let labels = |label: &str| table.lines().filter(|line| line.ends_with(label)).count();
        assert_eq!([",clean", ",jammed", ",after", ",label"].map(labels), [70, 22, 26, 1]);
        assert!(std::fs::read_to_string(run.path().join("roc.csv")).unwrap().lines().count() > 3);
        let verdict = std::fs::read_to_string(run.path().join("verdict.csv")).unwrap();
        assert!(verdict.contains("\"false alarms of correlation_ratio, at least\""), "{verdict}");
    }
}
