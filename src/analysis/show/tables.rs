//! The numbers behind the pictures that neither generator nor receiver wrote: one CSV file a kind.
//!
//! `errors.csv` holds every error of every observation, `position.csv` of every fix beside the receiver's own
//! σ, `histograms.csv` the histograms of the loops, `psd_theory.csv` the expected spectrum, `verdict.csv`
//! what was judged.

use std::path::Path;

use serde::Serialize;

use crate::error::JudgeError;
use crate::judge::verdict::Verdict;
use crate::measure::elevation::Elevations;
use crate::measure::errors::PositionError;
use crate::measure::jitter::Jitter;
use crate::measure::labelled;
use crate::measure::psd::Psd;
use crate::measure::slips::{COLUMNS, Slips};
use crate::read::PeakRow;
use crate::show::columns;
use crate::show::plot::Judged;
use crate::show::plot::jitter::{Histogram, loops};
use crate::show::write::{Table, write_read_rows, write_rows};
use gnss::record::Fix;
use gnss::satellite::Sv;
use gnss::signal::Link;

/// A row of `errors.csv`; estimate minus truth.
#[derive(Serialize)]
struct ErrorRow {
    sample: u64,
    time_s: f64,
    sv: Sv,
    signal: &'static str,
    code_m: f64,
    /// A constant removed from each arc.
    carrier_cycles: f64,
    doppler_hz: f64,
    cn0_dbhz: f64,
    cn0_true_dbhz: f64,
    /// The true one with other satellites and interference counted as noise.
    cn0_effective_dbhz: f64,
    locked_s: f64,
}

/// A row of `position.csv`; estimate minus truth.
#[derive(Serialize)]
struct PositionRow {
    sample: u64,
    time_s: f64,
    east_m: f64,
    north_m: f64,
    up_m: f64,
    clock_m: f64,
    velocity_east_mps: f64,
    velocity_north_mps: f64,
    velocity_up_mps: f64,
    sigma_east_m: Option<f64>,
    sigma_north_m: Option<f64>,
    sigma_up_m: Option<f64>,
    sigma_clock_m: Option<f64>,
    hdop: Option<f64>,
    vdop: Option<f64>,
    satellites: Option<u32>,
}

/// A row of `histograms.csv`: one bin of one loop's histogram.
#[derive(Serialize)]
struct HistogramRow {
    r#loop: &'static str,
    unit: &'static str,
    middle: f64,
    width: f64,
    observations: usize,
    share_percent: f64,
    normal_percent: f64,
    sigma: f64,
    threshold: f64,
}

/// A row of `psd_theory.csv`.
#[derive(Serialize)]
struct TheoryRow {
    frequency_hz: f64,
    density_db: f64,
}

/// Writes `psd.csv` under that name; nothing of a spectrum without a whole segment.
///
/// # Errors
/// The file that cannot be written.
pub fn write_psd(path: &Path, psd: &Psd) -> Result<(), JudgeError> {
    let Some(rows) = psd.rows() else { return Ok(()) };
    write_rows(path, "", rows.into_iter())
}

/// Writes `peaks.csv` under that name, which a run without peaks has not.
///
/// # Errors
/// The file that cannot be written.
pub fn write_peaks(path: &Path, peaks: &[PeakRow]) -> Result<(), JudgeError> {
    if peaks.is_empty() { Ok(()) } else { write_rows(path, "", peaks.iter()) }
}

/// Writes the tables of a run's measurements, all but those of [`write()`].
pub(crate) fn write_measured(
    directory: &Path,
    judged: &Judged<'_>,
    elevations: &Elevations,
    slips: &Slips,
    jitter: &Jitter,
) -> Result<(), JudgeError> {
    write_read_rows(&directory.join("clock.csv"), columns::CLOCK, judged.clock.rows.cursor())?;
    write_rows(&directory.join("allan.csv"), columns::ALLAN, judged.clock.stability())?;
    write_read_rows(&directory.join("consistency.csv"), columns::CONSISTENCY, judged.consistency.rows.cursor())?;
    if judged.protection.figures.is_some() {
        write_read_rows(&directory.join("protection.csv"), columns::PROTECTION, judged.protection.rows.cursor())?;
    }
    if judged.detection.figures.is_some() {
        let (path, run) = (directory.join("detection.csv"), judged.run);
        let tests = run.tests.cursor().map(|test| test.map(|test| judged.detection.labelled(run, &test)));
        write_read_rows(&path, columns::DETECTION, tests)?;
        let mut signals = Table::create(&directory.join("detection_labelled.csv"), columns::LABELLED)?;
        labelled::each(run, judged.detection, |row| signals.row(&row))?;
        signals.finish()?;
    }
    if !judged.detection.roc.is_empty() {
        write_rows(&directory.join("roc.csv"), columns::ROC, judged.detection.roc.iter())?;
    }
    write_rows(&directory.join("satellites.csv"), columns::SATELLITES, elevations.satellites.iter())?;
    write_rows(&directory.join("elevation.csv"), columns::ELEVATION, elevations.bands.iter())?;
    write_slips(directory, slips)?;
    write_rows(&directory.join("jitter.csv"), columns::JITTER, jitter.rows.iter())
}

/// Writes `slips.csv`.
pub(crate) fn write_slips(directory: &Path, slips: &Slips) -> Result<(), JudgeError> {
    write_rows(&directory.join("slips.csv"), COLUMNS.trim_end(), slips.rows.iter())
}

/// Writes `errors.csv`, `position.csv`, `histograms.csv`, `psd_theory.csv` and `verdict.csv` into a run's
/// directory.
pub(crate) fn write(directory: &Path, judged: &Judged<'_>) -> Result<(), JudgeError> {
    let mut errors = Table::create(&directory.join("errors.csv"), columns::ERRORS)?;
    for link in judged.errors.signals.keys() {
        let Link { sv, signal } = link;
        for row in judged.errors.signals.cursor(link) {
            let row = row?;
            errors.row(&ErrorRow {
                sample: row.sample,
                time_s: row.time_s,
                sv,
                signal: signal.name,
                code_m: row.code_m,
                carrier_cycles: row.carrier_cycles,
                doppler_hz: row.doppler_hz,
                cn0_dbhz: row.cn0_dbhz,
                cn0_true_dbhz: row.cn0_true_dbhz,
                cn0_effective_dbhz: row.cn0_effective_dbhz,
                locked_s: row.locked_s,
            })?;
        }
    }
    errors.finish()?;
    let mut fixes = judged.run.fixes.finder()?;
    let rows = judged.errors.positions.cursor();
    let rows = rows.map(|error| error.map(|error| position(&error, fixes.get(error.sample).as_ref())));
    write_read_rows(&directory.join("position.csv"), columns::POSITION, rows)?;
    let mut histograms = Table::create(&directory.join("histograms.csv"), "")?;
    for one in loops(judged) {
        let one = one?;
        let histogram = Histogram::new(&one)?;
        for (bin, observations) in histogram.counts.iter().enumerate() {
            histograms.row(&HistogramRow {
                r#loop: one.name,
                unit: one.unit,
                middle: histogram.middle(bin),
                width: histogram.width,
                observations: *observations,
                share_percent: histogram.share(bin),
                normal_percent: histogram.normal(histogram.middle(bin)),
                sigma: histogram.sigma,
                threshold: one.threshold,
            })?;
        }
    }
    histograms.finish()?;
    let theory = &judged.summary.details.psd_theory_db;
    if !theory.is_empty() {
        let rows = judged.run.psd.iter().zip(theory);
        let rows = rows.map(|(row, &density_db)| TheoryRow { frequency_hz: row.frequency_hz, density_db });
        write_rows(&directory.join("psd_theory.csv"), "", rows)?;
    }
    write_verdict(directory, &judged.summary.details.verdict)
}

/// Writes `verdict.csv` into a run's directory.
///
/// # Errors
/// The file that cannot be written.
pub fn write_verdict(directory: &Path, verdict: &Verdict) -> Result<(), JudgeError> {
    write_rows(&directory.join("verdict.csv"), "", verdict.csv_rows())
}

fn position(error: &PositionError, fix: Option<&Fix>) -> PositionRow {
    let of = |what: fn(&Fix) -> f64| fix.map(what);
    PositionRow {
        sample: error.sample,
        time_s: error.time_s,
        east_m: error.enu_m.x,
        north_m: error.enu_m.y,
        up_m: error.enu_m.z,
        clock_m: error.clock_m,
        velocity_east_mps: error.velocity_enu_mps.x,
        velocity_north_mps: error.velocity_enu_mps.y,
        velocity_up_mps: error.velocity_enu_mps.z,
        sigma_east_m: of(|fix| fix.sigma_east_m),
        sigma_north_m: of(|fix| fix.sigma_north_m),
        sigma_up_m: of(|fix| fix.sigma_up_m),
        sigma_clock_m: of(|fix| fix.sigma_clock_m),
        hdop: of(|fix| fix.hdop),
        vdop: of(|fix| fix.vdop),
        satellites: fix.map(|fix| fix.satellites),
    }
}
