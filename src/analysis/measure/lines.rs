//! Continuous waves that the receiver reported, against the interference that there was.
//!
//! The receiver makes a spectrum a second. A row of it is false where no source was on in that second. A wave
//! has to be reported where it was on for a whole second with a J/N0 of [`LEAST_DBHZ`], which is clear of
//! any bin of such a spectrum. Limits: sweeps and pulses have lines too, so rows of them are neither false
//! nor asked for. A wave within [`OFFSET_HZ`] of 0 Hz in the samples is not asked for either: a constant
//! offset of a converter looks the same, and a receiver leaves it out.

use std::collections::BTreeSet;

use serde::Serialize;

use crate::error::JudgeError;
use crate::read::Run;
use gnss::facts::Interference;
use gnss::record::{InterferenceRow, LineRow};

/// Waves this strong have to be reported: 8 dB above what shows at 2.6 Msps, for wider bins and for waves
/// between two.
pub const LEAST_DBHZ: f64 = 45.0;
/// Frequency in the samples up to which a wave may pass for a constant offset: three of the receiver's widest
/// bins.
pub const OFFSET_HZ: f64 = 3000.0;

/// `interference` in `summary.json`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Lines {
    /// Spectra in which the receiver reported a line.
    pub told: usize,
    /// Number of reported spectra in whose second no interference was on.
    pub false_told: usize,
    /// Seconds all through which a strong continuous wave was on.
    pub wave_seconds: usize,
    /// Further such seconds, whose waves are all too near to 0 Hz to be told from a constant offset.
    pub offset_seconds: usize,
    /// Number of `wave_seconds` in which the receiver reported the wave.
    pub wave_seconds_told: usize,
    /// Largest distance in frequency of a report from the nearest wave where nothing else was on, Hz.
    pub frequency_error_max_hz: Option<f64>,
    /// Width of the spectrum's bins, Hz.
    pub resolution_hz: Option<f64>,
    /// Largest difference of its J/N0 from that wave's.
    pub jn0_error_max_db: Option<f64>,
}

impl Lines {
    /// `None` where the receiver did not look, and where there was nothing to see and nothing reported.
    ///
    /// # Errors
    /// [`JudgeError::Read`] where spilled rows cannot be read.
    pub fn of(run: &Run) -> Result<Option<Self>, JudgeError> {
        let Some(told) = run.lines.as_ref().filter(|told| !told.is_empty() || !run.interference.is_empty()) else {
            return Ok(None);
        };
        let rate_hz = run.scene.sample_rate_hz;
        // The truth is written at intervals: within one of a second is what is true of it.
        let mut ticks = run.trajectory.map(|row| row.sample)?;
        ticks.sort_unstable();
        ticks.dedup();
        let interval = ticks.windows(2).map(|two| two[1] - two[0]).min().unwrap_or(0) as f64;
        let second = |first: u64| {
            let (low, high) = (first as f64 - (interval - rate_hz).max(0.0), first as f64 + rate_hz.max(interval));
            move |sample: u64| (low..high).contains(&(sample as f64))
        };
        let is_wave = |row: &InterferenceRow| {
            run.scene.interference.get(row.source.wrapping_sub(1)).is_some_and(|waveform| *waveform == Interference::Cw)
        };
        let waves = |first: u64| {
            let inside = second(first);
            run.interference.iter().filter(move |row| is_wave(row) && inside(row.sample))
        };
        let apart = |line: &LineRow, wave: &InterferenceRow| {
            // Frequencies in the samples are those of a ring.
            let folded = if run.scene.format.starts_with('r') { wave.frequency_hz.abs() } else { wave.frequency_hz };
            let apart_hz = line.frequency_hz - folded;
            (apart_hz - rate_hz * (apart_hz / rate_hz).round()).abs()
        };
        let nearest = |line: &LineRow| {
            // Beside a sweep or pulses the strongest line may be theirs.
            let inside = second(line.sample);
            if run.interference.iter().any(|row| inside(row.sample) && !is_wave(row)) {
                return None;
            }
            let of = waves(line.sample).min_by(|a, b| apart(line, a).total_cmp(&apart(line, b)))?;
            Some((apart(line, of), (line.jn0_dbhz - of.jn0_dbhz).abs()))
        };
        let whole = (run.scene.duration_s.floor() as u64).min(u64::MAX >> 1);
        let (ticks, second, waves) = (&ticks, &second, &waves);
        let strong = |from_hz: f64| {
            let on = move |number: u64| {
                let first = (number as f64 * rate_hz).ceil() as u64;
                let inside = second(first);
                let counts = |row: &&InterferenceRow| row.jn0_dbhz >= LEAST_DBHZ && row.frequency_hz.abs() >= from_hz;
                let on: BTreeSet<u64> = waves(first).filter(counts).map(|row| row.sample).collect();
                let all = ticks.iter().filter(|tick| inside(**tick)).count();
                (all > 0 && on.len() == all).then_some(first)
            };
            (0..whole).filter_map(on).collect::<Vec<u64>>()
        };
        let seconds = strong(OFFSET_HZ);
        let found = |first: &&u64| told.iter().any(|line| (line.sample.abs_diff(**first) as f64) < 0.5 * rate_hz);
        let errors: Vec<(f64, f64)> = told.iter().filter_map(nearest).collect();
        let largest = |of: fn(&(f64, f64)) -> f64| errors.iter().map(of).max_by(f64::total_cmp);
        Ok(Some(Self {
            told: told.len(),
            false_told: told
                .iter()
                .filter(|line| !run.interference.iter().any(|row| second(line.sample)(row.sample)))
                .count(),
            wave_seconds: seconds.len(),
            offset_seconds: strong(0.0).len() - seconds.len(),
            wave_seconds_told: seconds.iter().filter(found).count(),
            frequency_error_max_hz: largest(|error| error.0),
            resolution_hz: told.iter().map(|line| line.resolution_hz).max_by(f64::total_cmp),
            jn0_error_max_db: largest(|error| error.1),
        }))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::hand_made::{RATE_HZ, planted, reported, write};
    use crate::judge;
    use crate::judge::judgement::Status;
    use std::fs;

    #[test]
    fn reported_waves_are_compared_with_those_that_there_were() {
        let run = planted();
        let scene = run.path().join("truth/scene.json");
        let text =
            fs::read_to_string(&scene).unwrap().replace("\"seed\"", "\"interference\": [{\"kind\": \"cw\"}], \"seed\"");
        fs::write(&scene, text).unwrap();
        // On from 20 s to 30 s; the receiver misses 25 s, is 40 Hz off at 26 s and reports something at 50 s.
        let wave = |tick: u64| InterferenceRow {
            sample: tick * RATE_HZ / 10,
            source: 1,
            jn0_dbhz: 60.0,
            frequency_hz: 311_500.0,
        };
        write(&run.path().join("truth/interference.csv"), &(200..300).map(wave).collect::<Vec<_>>());
        let mut rows: Vec<_> = (20..30).filter(|s| *s != 25).map(|s| reported(s, 311_500.0)).collect();
        rows[5].frequency_hz -= 40.0;
        rows.push(reported(50, -1e5));
        write(&run.path().join("rx/interference.csv"), &rows);
        let summary = judge(run.path()).unwrap();
        let lines = summary.interference.unwrap();
        assert_eq!(lines.offset_seconds, 0);
        assert_eq!((lines.told, lines.false_told, lines.wave_seconds, lines.wave_seconds_told), (10, 1, 10, 9));
        assert!((lines.frequency_error_max_hz.unwrap() - 40.0).abs() < 1e-9, "{lines:?}");
        assert!(
            (lines.jn0_error_max_db.unwrap() - 0.5).abs() < 1e-9 && lines.resolution_hz == Some(635.0),
            "{lines:?}"
        );
        let text = summary.to_string();
        assert!(text.contains("9 of 10 s with a continuous wave reported, 1 reported in error"), "{text}");
        let failed = |figure: &str| {
            let row = summary.details.verdict.rows.iter().find(|row| row.figure.starts_with(figure)).unwrap();
            row.status == Status::Fail
        };
        assert!(
            failed("interference reported while") && failed("seconds of a continuous") && !failed("frequency of the")
        );
        // A wave at 1 kHz in the samples may be a constant offset of the converter.
        let near = |tick: u64| InterferenceRow { frequency_hz: -1e3, ..wave(tick) };
        write(&run.path().join("truth/interference.csv"), &(200..300).map(near).collect::<Vec<_>>());
        let summary = judge(run.path()).unwrap();
        let lines = summary.interference.unwrap();
        assert_eq!((lines.wave_seconds, lines.offset_seconds), (0, 10));
        let told = &summary.details.verdict.not_judged;
        assert!(told.iter().any(|one| one.starts_with("10 s of a continuous wave")), "{told:?}");
    }
}
