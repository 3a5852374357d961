//! Labelled data set of signals: what the receiver saw of each in each interval of its detectors, and the
//! truth about it.
//!
//! A row has means and scatters of the prompt, of early and of late over the updates of an interval, the
//! statistics of the detectors over their thresholds, and the label of [`detection`](super::detection). Data
//! symbols are taken off by the sign of the prompt. Limits: a wrong sign at a weak signal turns all numbers
//! of an update alike; files of receivers without early and late have none here.

use std::collections::BTreeMap;

use serde::Serialize;

use crate::error::JudgeError;
use crate::measure::detection::{Detection, Label};
use crate::read::Run;
use gnss::record::{Detector, TrackingRow};
use gnss::satellite::Sv;
use gnss::signal::Link;

/// Numbers of an update whose mean and scatter are taken.
const NUMBERS: usize = 10;

/// A signal in an interval: a row of `detection_labelled.csv`.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct LabelledSignal {
    sample: u64,
    time_s: f64,
    sv: Sv,
    signal: &'static str,
    /// Updates of the loops in the interval.
    updates: usize,
    cn0_dbhz: f64,
    phase_lock: f64,
    /// Prompt without its symbols, in units of its noise's standard deviation.
    prompt: f64,
    prompt_sigma: f64,
    /// Prompt a quarter of a cycle ahead, as a part of the mean prompt; so are early and late.
    prompt_q: f64,
    early: Option<f64>,
    late: Option<f64>,
    early_q: Option<f64>,
    late_q: Option<f64>,
    early_sigma: Option<f64>,
    late_sigma: Option<f64>,
    tap_spacing_chips: Option<f64>,
    dll_discriminator_chips: f64,
    dll_sigma_chips: f64,
    pll_sigma_cycles: f64,
    /// Statistics of this signal and of the receiver over their thresholds.
    level: Option<f64>,
    cn0_fall: Option<f64>,
    correlation_ratio: Option<f64>,
    correlation_phase: Option<f64>,
    correlation_delta: Option<f64>,
    code_carrier: Option<f64>,
    raim: Option<f64>,
    position_jump: Option<f64>,
    clock_jump: Option<f64>,
    directions: Option<f64>,
    label: Label,
    /// Number of the attack, from 1.
    attack: Option<usize>,
}

/// Statistics over their thresholds, in the order of [`Detector::ALL`].
type Ratios = [Option<f64>; Detector::ALL.len()];

/// Sums over the updates of an interval.
#[derive(Clone, Debug, Default, PartialEq)]
struct Sums {
    count: usize,
    /// Updates with early and late.
    sided: usize,
    sums: [f64; NUMBERS],
    squares: [f64; NUMBERS],
    spacing_chips: Option<f64>,
}

impl Sums {
    fn add(&mut self, row: &TrackingRow) {
        let sign = if row.prompt_i < 0.0 { -1.0 } else { 1.0 };
        let sides = [row.early_i, row.late_i, row.early_q, row.late_q];
        let [early_i, late_i, early_q, late_q] = sides.map(|side| sign * side.unwrap_or(0.0));
        let numbers = [
            sign * row.prompt_i,
            sign * row.prompt_q,
            early_i,
            late_i,
            early_q,
            late_q,
            row.cn0_dbhz,
            row.phase_lock,
            row.dll_discriminator_chips,
            row.pll_discriminator_cycles,
        ];
        self.count += 1;
        self.sided += usize::from(sides.iter().all(Option::is_some));
        self.spacing_chips = row.tap_spacing_chips.or(self.spacing_chips);
        for (place, number) in numbers.into_iter().enumerate() {
            self.sums[place] += number;
            self.squares[place] += number * number;
        }
    }

    fn mean(&self, place: usize) -> f64 {
        self.sums[place] / self.count as f64
    }

    fn sigma(&self, place: usize) -> f64 {
        let (count, mean) = (self.count as f64, self.mean(place));
        ((self.squares[place] - count * mean * mean) / (count - 1.0).max(1.0)).max(0.0).sqrt()
    }

    fn row(
        &self,
        link: Link,
        (sample, time_s): (u64, f64),
        ratios: Ratios,
        truth: (Label, Option<usize>),
    ) -> LabelledSignal {
        let prompt = self.mean(0);
        let side = |value: f64| (self.sided == self.count).then_some(value / prompt);
        let ratio = |detector: Detector| ratios[detector as usize];
        LabelledSignal {
            sample,
            time_s,
            sv: link.sv,
            signal: link.signal.name,
            updates: self.count,
            cn0_dbhz: self.mean(6),
            phase_lock: self.mean(7),
            prompt,
            prompt_sigma: self.sigma(0),
            prompt_q: self.mean(1) / prompt,
            early: side(self.mean(2)),
            late: side(self.mean(3)),
            early_q: side(self.mean(4)),
            late_q: side(self.mean(5)),
            early_sigma: side(self.sigma(2)),
            late_sigma: side(self.sigma(3)),
            tap_spacing_chips: self.spacing_chips,
            dll_discriminator_chips: self.mean(8),
            dll_sigma_chips: self.sigma(8),
            pll_sigma_cycles: self.sigma(9),
            level: ratio(Detector::Level),
            cn0_fall: ratio(Detector::Cn0Fall),
            correlation_ratio: ratio(Detector::CorrelationRatio),
            correlation_phase: ratio(Detector::CorrelationPhase),
            correlation_delta: ratio(Detector::CorrelationDelta),
            code_carrier: ratio(Detector::CodeCarrier),
            raim: ratio(Detector::Raim),
            position_jump: ratio(Detector::PositionJump),
            clock_jump: ratio(Detector::ClockJump),
            directions: ratio(Detector::Directions),
            label: truth.0,
            attack: truth.1,
        }
    }
}

/// Largest ratio of each detector, by the end of the interval.
type Ends = BTreeMap<u64, Ratios>;

/// Ratios of the whole receiver, which have the end of every interval with tests, and those of each link.
fn ratios(run: &Run) -> Result<(Ends, BTreeMap<u32, Ends>), JudgeError> {
    let (mut shared, mut own) = (Ends::new(), BTreeMap::<u32, Ends>::new());
    run.tests.each(|test| {
        let of_receiver = shared.entry(test.sample).or_default();
        let ratios = match run.tested.get(test.link as usize) {
            Some([sv, _]) if sv.is_empty() => of_receiver,
            _ => own.entry(test.link).or_default().entry(test.sample).or_default(),
        };
        let (known, ratio) = (&mut ratios[test.detector as usize], test.statistic / test.threshold);
        *known = Some(known.map_or(ratio, |known| known.max(ratio)));
    })?;
    Ok((shared, own))
}

/// Gives every signal of every interval, signal by signal.
///
/// # Errors
/// Tables that cannot be read, and errors of `see`.
pub fn each(
    run: &Run,
    detection: &Detection,
    mut see: impl FnMut(LabelledSignal) -> Result<(), JudgeError>,
) -> Result<(), JudgeError> {
    let (shared, mut of_links) = ratios(run)?;
    for link in run.tracking.keys() {
        let name = [link.sv.to_string(), link.signal.name.to_owned()];
        let number = run.tested.iter().position(|own| *own == name);
        let own = number.and_then(|number| of_links.remove(&(number as u32))).unwrap_or_default();
        let mut row = |end: u64, sums: &Sums| -> Result<(), JudgeError> {
            if sums.count == 0 {
                return Ok(());
            }
            let both = |place: usize| own.get(&end).and_then(|own| own[place]).or(shared.get(&end)?[place]);
            let truth = (detection.label(end), detection.attack_of(end));
            see(sums.row(link, (end, run.time_s(end)), std::array::from_fn(both), truth))
        };
        let mut ends = shared.keys().copied().peekable();
        let mut sums = Sums::default();
        for update in run.tracking.cursor(link) {
            let update = update?;
            while let Some(end) = ends.next_if(|end| *end < update.sample) {
                row(end, &std::mem::take(&mut sums))?;
            }
            if ends.peek().is_some_and(|end| *end < update.sample + detection.interval()) {
                sums.add(&update);
            }
        }
        if let Some(end) = ends.next() {
            row(end, &sums)?;
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::hand_made::{RATE_HZ, detected, planted, write};
    use gnss::gps::l1ca::L1_CA;
    use gnss::record::InterferenceRow;

    fn update(sign: f64, by: f64) -> TrackingRow {
        TrackingRow {
            sample: 0,
            sv: Sv::gps(3),
            signal: &L1_CA,
            prompt_i: sign * (20.0 + by),
            prompt_q: sign * 1.0,
            dll_discriminator_chips: 0.01,
            pll_discriminator_cycles: by,
            fll_discriminator_hz: 0.0,
            cn0_dbhz: 45.0,
            phase_lock: 0.98,
            integration_s: 0.02,
            early_i: Some(sign * (16.0 - by)),
            early_q: Some(sign * 0.5),
            late_i: Some(sign * 14.0),
            late_q: Some(0.0),
            tap_spacing_chips: Some(0.5),
        }
    }

    #[test]
    fn early_and_late_are_parts_of_the_prompt_whatever_the_symbols_are() {
        let row = |signs: [f64; 2]| {
            let mut sums = Sums::default();
            signs.into_iter().zip([1.0, -1.0]).for_each(|(sign, by)| sums.add(&update(sign, by)));
            sums.row(L1_CA.link(Sv::gps(3)), (7, 0.5), Ratios::default(), (Label::Clean, None))
        };
        let found = row([1.0, -1.0]);
        assert_eq!(found, row([1.0, 1.0]));
        assert_eq!((found.updates, found.prompt, found.early, found.late), (2, 20.0, Some(0.8), Some(0.7)));
        assert_eq!((found.early_q, found.late_q, found.prompt_q), (Some(0.025), Some(0.0), 0.05));
        assert!((found.early_sigma.unwrap() - std::f64::consts::SQRT_2 / 20.0).abs() < 1e-12);
    }

    #[test]
    fn every_signal_has_a_row_for_each_interval_with_the_statistics_and_the_truth() {
        let run = planted();
        detected(run.path());
        let row =
            |tenth: u64| InterferenceRow { sample: tenth * RATE_HZ / 10, source: 1, jn0_dbhz: 60.0, frequency_hz: 1e5 };
        write(&run.path().join("truth/interference.csv"), &(352..=452).map(row).collect::<Vec<_>>());
        crate::judge(run.path()).unwrap();
        let mut table = csv::Reader::from_path(run.path().join("detection_labelled.csv")).unwrap();
        let rows: Vec<BTreeMap<String, String>> = table.deserialize().map(Result::unwrap).collect();
        let of = |row: &BTreeMap<String, String>, name: &str| row[name].parse::<f64>().unwrap_or(f64::NAN);
        let signals: std::collections::BTreeSet<&str> = rows.iter().map(|row| row["sv"].as_str()).collect();
        // Updates are ten a second from 0.5 s on, tests one a second from 1 to 59 s.
        assert_eq!(rows.len(), 59 * signals.len());
        for row in &rows {
            let (time_s, ratio) = (of(row, "time_s").round(), of(row, "correlation_ratio"));
            assert!(
                (of(row, "prompt") - 20.0).abs() < 1e-9 && of(row, "updates") == if time_s < 1.5 { 6.0 } else { 10.0 }
            );
            assert!((of(row, "level") - 1.0 / 1.645).abs() < 1e-9);
            let expected = if time_s % 10.0 == 5.0 { 2.5 } else { 1.0 } / 1.645;
            let is_tested = row["sv"] == Sv::gps(crate::hand_made::PRNS[0]).to_string();
            assert!(if is_tested { (ratio - expected).abs() < 1e-9 } else { ratio.is_nan() });
            let label = if time_s < 36.0 {
                "clean"
            } else if time_s < 47.0 {
                "jammed"
            } else {
                "after"
            };
            assert_eq!(
                (row["label"].as_str(), row["attack"].as_str()),
                (label, if label == "jammed" { "1" } else { "" })
            );
        }
    }
}
