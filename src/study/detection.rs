//! Detection and false-alarm rates of the receiver's search, counted in samples.
//!
//! A scene of one satellite is generated once for a C/N0 and cut into segments, one trial each. The search
//! gets a centre frequency that puts the satellite's Doppler at the wanted position between two bins. The
//! expected rate of detections comes from [`search`](super::search), and that of false alarms is the designed
//! probability. Dopplers that are left before all sums are made take a part of it. That part is at most as
//! large as if cells were independent ([`leaving`](super::leaving)). Limits: trials of one C/N0 share a
//! satellite and its message.

use std::fmt::Write as _;
use std::io;
use std::path::Path;

use serde::Serialize;
use statrs::distribution::{ChiSquared, ContinuousCDF};
use thiserror::Error;

use super::leaving::Leaving;
use super::search::Model;
use analysis::JudgeError;
use analysis::show::plot::canvas::{Axis, BLUE, Chart, Mark, ORANGE, Series, figure};
use analysis::show::write::{write_rows, write_whole};
use analysis::waveform::leading;
use generator::scenario::{Overrides, Scenario};
use generator::scene::Scene;
use generator::spoof::Constellation;
use generator::stream::{Options, generate_with};
use generator::truth;
use gnss::gps::l1ca::L1_CA;
use gnss::samples::IfMetadata;
use gnss::satellite::Sv;
use gnss::signal::{Component, Link};
use receiver::acquire::{self, AcquireError, AcquisitionSettings, Searcher, samples_needed};
use receiver::source::Block;

/// The satellite that is there.
const PRESENT: u8 = 23;
/// Offsets of the Doppler from the nearest bin, in steps; one each trial in turn.
const OFFSETS: [f64; 4] = [0.0, 0.2, 0.35, 0.5];
/// Signals this weak are as good as absent: 1e-3 of noise in a search's whole time.
const ABSENT_DBHZ: f64 = 0.0;
/// Draws of the expected probability: a standard error below 0.004.
const DRAWS: u32 = 20_000;

/// Error that prevents trials.
#[derive(Debug, Error)]
pub enum DetectionError {
    /// A scene of the study cannot be composed.
    #[error("scene of the trials: {0}")]
    Scene(String),
    /// The receiver's search refuses it.
    #[error("{0}")]
    Search(#[from] AcquireError),
}

/// Counted and expected.
#[derive(Clone, Debug, Serialize)]
pub struct DetectionRow {
    /// `detection`, or `false alarm` where nothing is there to be found.
    pub what: &'static str,
    /// C/N0 of the signal, dB-Hz; absent for noise alone.
    pub cn0_dbhz: Option<f64>,
    /// Searches.
    pub trials: u32,
    /// Searches that found it.
    pub found: u32,
    /// Share that found it.
    pub measured: f64,
    /// Share that theory expects.
    pub expected: f64,
    /// Lower end of the interval with 95 % of the counts if the expectation holds, as a share.
    pub low: f64,
    /// Upper end of the interval.
    pub high: f64,
}

impl DetectionRow {
    fn new(what: &'static str, cn0_dbhz: Option<f64>, (found, trials): (u32, u32), expected: f64) -> Self {
        let (low, high) = interval(expected, trials);
        let measured = f64::from(found) / f64::from(trials.max(1));
        Self { what, cn0_dbhz, trials, found, measured, expected, low, high }
    }

    /// True if the count is within its interval.
    pub fn holds(&self) -> bool {
        (self.low..=self.high).contains(&self.measured)
    }
}

/// The shares between which 95 % of binomial counts lie: 2.5 % at most below, and above.
pub fn interval(probability: f64, trials: u32) -> (f64, f64) {
    let n = f64::from(trials);
    let (mut cumulative, mut low, mut high) = (0.0, 0.0, 1.0);
    for k in 0..=trials {
        let k_f = f64::from(k);
        let log = libm::lgamma(n + 1.0) - libm::lgamma(k_f + 1.0) - libm::lgamma(n - k_f + 1.0)
            + k_f * libm::log(probability.max(f64::MIN_POSITIVE))
            + (n - k_f) * libm::log1p(-probability.min(1.0 - 1e-16));
        let before = cumulative;
        cumulative += libm::exp(log);
        if before <= 0.025 && cumulative > 0.025 {
            low = k_f / n;
        }
        if before < 0.975 && cumulative >= 0.975 {
            high = k_f / n;
            break;
        }
    }
    (low, high)
}

/// All rows whose expectation leaves room on both sides, together.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Joint {
    /// Rows that were compared.
    pub rows: u32,
    /// Sum of squared deviations over their variances, and the probability that it is exceeded by chance.
    pub chi_square: f64,
    /// Probability of a deviation so large by chance.
    pub exceeded: f64,
    /// Sum of all deviations in standard deviations of it: normal if the expectations hold.
    pub bias_sigma: f64,
}

impl Joint {
    /// Joint test of the detections among `rows`, for rows that expect at least five hits and five misses.
    pub fn of(rows: &[DetectionRow]) -> Self {
        let mut joint = Self { rows: 0, chi_square: 0.0, exceeded: 1.0, bias_sigma: 0.0 };
        let (mut sum, mut variances) = (0.0, 0.0);
        for row in rows.iter().filter(|row| row.cn0_dbhz.is_some()) {
            let trials = f64::from(row.trials);
            let expected = trials * row.expected;
            if expected < 5.0 || trials - expected < 5.0 {
                continue;
            }
            // The expectation is itself drawn.
            let variance = expected * (1.0 - row.expected) * (1.0 + trials / f64::from(DRAWS));
            let deviation = f64::from(row.found) - expected;
            joint.rows += 1;
            joint.chi_square += deviation * deviation / variance;
            (sum, variances) = (sum + deviation, variances + variance);
        }
        if joint.rows > 0 {
            joint.exceeded = ChiSquared::new(f64::from(joint.rows)).map_or(0.0, |law| law.sf(joint.chi_square));
            joint.bias_sigma = sum / variances.sqrt();
        }
        joint
    }
}

/// Cuts what is written into segments and hands each to `each` with the number of its first sample.
struct Stretches<F> {
    metadata: IfMetadata,
    stretch: usize,
    bytes: Vec<u8>,
    first: u64,
    each: F,
}

impl<F: FnMut(&Block<'_>)> io::Write for Stretches<F> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.bytes.extend_from_slice(bytes);
        let size = self.stretch * self.metadata.format.bytes();
        while self.bytes.len() >= size {
            let rest = self.bytes.split_off(size);
            let stretch = std::mem::replace(&mut self.bytes, rest);
            let (mut i, mut q) = (Vec::new(), Vec::new());
            self.metadata.format.unpack(&stretch, &mut i, &mut q);
            (self.each)(&Block { first: self.first, i: &i, q: &q });
            self.first += self.stretch as u64;
        }
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

fn scene(cn0_dbhz: f64, seed: u64, duration_s: f64) -> Result<Scene, DetectionError> {
    let text = format!(
        "name = \"search\"\nstart = 2010-07-01T08:05:58\nduration_s = {duration_s}\nseed = {seed}\n\
         [motion]\nkind = \"static\"\nlatitude_deg = 26.5123\nlongitude_deg = 80.2329\nheight_m = 130\n\
         [front_end]\nsample_rate_hz = 2.6e6\nformat = \"ci8\"\n[power]\nkind = \"fixed\"\ncn0_dbhz = {cn0_dbhz}\n\
         [noise]\n"
    );
    let scenario = Scenario::parse(&text, "search").map_err(|error| DetectionError::Scene(error.to_string()))?;
    let (mut scene, _) = (scenario.compose(Path::new("."), &Overrides::default()))
        .map_err(|error| DetectionError::Scene(error.to_string()))?;
    scene.excluded = scene.catalogue.satellites().filter(|sv| *sv != Sv::gps(PRESENT)).collect();
    Ok(scene)
}

/// Runs `each` on every segment of a scene, with the satellite's true Doppler there; the truth goes through
/// `writer`.
fn on_stretches(
    scene: &Scene,
    writer: &mut truth::Writer,
    stretch: usize,
    mut each: impl FnMut(f64, &Block<'_>),
) -> Result<(), DetectionError> {
    let failed = |error: &dyn std::fmt::Display| DetectionError::Scene(error.to_string());
    let doppler_at = |sample: u64| -> Result<f64, DetectionError> {
        let seen = truth::observe(scene, &Constellation::authentic(), Sv::gps(PRESENT), &L1_CA, sample, 0.0);
        let seen = seen.map_err(|error| failed(&error))?;
        let (row, ..) = seen.ok_or_else(|| DetectionError::Scene("the satellite is not in view".to_owned()))?;
        Ok(row.doppler_hz)
    };
    let (from_hz, to_hz) = (doppler_at(0)?, doppler_at(scene.samples - 1)?);
    let mut sink = Stretches {
        metadata: scene.metadata.clone(),
        stretch,
        bytes: Vec::new(),
        first: 0,
        // A line over less than a minute leaves a few tenths of a hertz.
        each: |block: &Block<'_>| {
            each(from_hz + block.first as f64 / scene.samples as f64 * (to_hz - from_hz), block);
        },
    };
    generate_with(scene, &mut sink, writer, &mut |_| (), &Options::default()).map_err(|error| failed(&error))?;
    Ok(())
}

/// A search of the trials: the default one over fewer Dopplers.
pub fn settings(false_alarm_probability: f64) -> AcquisitionSettings {
    AcquisitionSettings { doppler_max_hz: 1000.0, false_alarm_probability, ..AcquisitionSettings::default() }
}

/// Finds the satellite at `cn0_dbhz` in `trials` segments.
///
/// # Errors
/// [`DetectionError`], none on sound settings.
pub fn detections(
    settings: &AcquisitionSettings,
    cn0_dbhz: f64,
    trials: u32,
    seed: u64,
    writer: &mut truth::Writer,
) -> Result<DetectionRow, DetectionError> {
    let metadata = scene(cn0_dbhz, seed, 1.0)?.metadata;
    let rate_hz = metadata.rate.hz();
    // No whole number of symbols or code periods, so that edges and code phases fall everywhere.
    let stretch = samples_needed(&metadata, settings)? as usize + (0.0037 * rate_hz) as usize;
    let scene = scene(cn0_dbhz, seed, f64::from(trials) * stretch as f64 / rate_hz + 0.01)?;
    let step_hz = doppler_step_hz(settings);
    let (mut found, mut made, mut threshold, mut error) = (0, 0_u32, 0.0, None);
    on_stretches(&scene, writer, stretch, |doppler_hz, block| {
        if made == trials || error.is_some() {
            return;
        }
        let offset_hz = step_hz * OFFSETS[made as usize % OFFSETS.len()];
        // What appears at 0 Hz is declared wrong by the Doppler, but for the offset.
        let declared = IfMetadata { center_hz: metadata.center_hz - doppler_hz + offset_hz, ..metadata.clone() };
        let rows =
            Searcher::new(&declared, settings).and_then(|mut s| s.search(block, &[L1_CA.link(Sv::gps(PRESENT))]));
        match rows {
            Ok(rows) => {
                made += 1;
                found += u32::from(rows.iter().any(|(row, _)| row.acquired));
                threshold = rows.first().map_or(0.0, |(row, _)| row.threshold);
            }
            Err(failed) => error = Some(failed),
        }
    })?;
    error.map_or(Ok(()), Err)?;
    let code = leading(&L1_CA).ok_or_else(|| DetectionError::Scene(format!("{L1_CA} has no code")))?;
    let symbol_s = code.message.map_or(f64::INFINITY, |message| message.symbol_s);
    let model = Model {
        signal: &L1_CA,
        sums: settings.noncoherent_sums,
        coherent_s: code.period_s() * f64::from(settings.coherent_periods),
        threshold,
        lag_chips: acquire::cell_chips(&metadata, &L1_CA, settings)?,
        doppler_step_hz: step_hz,
        sample_chips: code.chip_rate_hz / rate_hz,
        code_chips: f64::from(code.code_chips),
        symbol_s,
        code_spread: 1.0,
        cn0_dbhz,
    };
    let leaving = leaving(&metadata, settings, seed)?;
    let expected = model.probability(&OFFSETS.map(|offset| offset * step_hz), &leaving, DRAWS, seed);
    Ok(DetectionRow::new("detection", Some(cn0_dbhz), (found, made), expected))
}

/// Searches for satellites that are not there, at least `trials` times.
///
/// # Errors
/// [`DetectionError`], none on sound settings.
pub fn false_alarms(
    settings: &AcquisitionSettings,
    trials: u32,
    seed: u64,
    writer: &mut truth::Writer,
) -> Result<DetectionRow, DetectionError> {
    let absent: Vec<Link> = (1..=32).filter(|prn| *prn != PRESENT).map(|prn| L1_CA.link(Sv::gps(prn))).collect();
    let stretches = trials.div_ceil(absent.len() as u32);
    let metadata = scene(ABSENT_DBHZ, seed, 1.0)?.metadata;
    let stretch = samples_needed(&metadata, settings)? as usize;
    let scene = scene(ABSENT_DBHZ, seed, f64::from(stretches) * stretch as f64 / metadata.rate.hz() + 0.01)?;
    let mut searcher = Searcher::new(&metadata, settings)?;
    let (mut found, mut made, mut error) = (0, 0_u32, None);
    on_stretches(&scene, writer, stretch, |_, block| match searcher.search(block, &absent) {
        Ok(rows) => {
            made += rows.len() as u32;
            found += rows.iter().filter(|(row, _)| row.statistic > row.threshold).count() as u32;
        }
        Err(failed) => error = Some(failed),
    })?;
    error.map_or(Ok(()), Err)?;
    let probability = settings.false_alarm_probability;
    let share = leaving(&metadata, settings, seed)?.alarms_left(probability / cells(&metadata, settings)?, seed);
    let row = DetectionRow::new("false alarm", None, (found, made), probability);
    Ok(DetectionRow { low: interval(probability * share, made).0, ..row })
}

/// Independent cells of a whole search.
fn cells(metadata: &IfMetadata, settings: &AcquisitionSettings) -> Result<f64, DetectionError> {
    let side = (settings.doppler_max_hz / doppler_step_hz(settings)).ceil();
    Ok((2.0 * side + 1.0) * acquire::independent_cells(metadata, &L1_CA, settings)? as f64)
}

fn leaving(metadata: &IfMetadata, settings: &AcquisitionSettings, seed: u64) -> Result<Leaving, DetectionError> {
    let bars = acquire::bars(metadata, &L1_CA, settings)?;
    Ok(Leaving::new(bars, acquire::independent_cells(metadata, &L1_CA, settings)?, seed))
}

fn doppler_step_hz(settings: &AcquisitionSettings) -> f64 {
    let period_s = leading(&L1_CA).map_or(f64::INFINITY, Component::period_s);
    settings.doppler_step_cycles / (period_s * f64::from(settings.coherent_periods))
}

/// Writes `acquisition.csv`, `acquisition.md` and `acquisition.png` into a directory.
///
/// # Errors
/// [`JudgeError`] with the file that could not be written.
pub fn write(directory: &Path, rows: &[DetectionRow], settings: &AcquisitionSettings) -> Result<(), JudgeError> {
    write_rows(&directory.join("acquisition.csv"), "", rows.iter())?;
    let held = rows.iter().filter(|row| row.holds()).count();
    let joint = Joint::of(rows);
    let mut text = format!(
        "# Acquisition against theory\n\n\
         One satellite in the noise of a scene at 2.6 Msps, 8 bit; each trial is the receiver's search of a segment \
         of its own ({} sums of {} ms, Doppler steps of {} Hz, Doppler up to half a step off, code and symbol edges \
         anywhere). Detections are expected from the joint statistics of the cells about the peak (`study::search`), \
         false alarms at most as designed: Dopplers that are left before all sums are made take some \
         (`study::leaving`). \
         {held} of {} counts are within the 95 % of their binomial law. The {} detections \
         that leave room on both sides have together a chi-square of {:.1} (exceeded by chance with {:.2}) and a \
         bias of {:+.1} σ. `cargo bench --bench acquisition` makes this page.\n\n![Probability of \
         detection](acquisition.png)\n\n\
         | what | C/N0 (dB-Hz) | trials | found | measured | expected | 95 % of counts | within |\n\
         | --- | --- | --- | --- | --- | --- | --- | --- |\n",
        settings.noncoherent_sums,
        settings.coherent_periods,
        doppler_step_hz(settings),
        rows.len(),
        joint.rows,
        joint.chi_square,
        joint.exceeded,
        joint.bias_sigma,
    );
    for row in rows {
        let cn0 = row.cn0_dbhz.map_or_else(String::new, |x| format!("{x}"));
        let within = if row.holds() { "yes" } else { "no" };
        let _ = writeln!(
            text,
            "| {} | {cn0} | {} | {} | {:.4} | {:.4} | {:.4} to {:.4} | {within} |",
            row.what, row.trials, row.found, row.measured, row.expected, row.low, row.high
        );
    }
    write_whole(&directory.join("acquisition.md"), text.as_bytes())?;
    let of = |value: &dyn Fn(&DetectionRow) -> f64| -> Vec<(f64, f64)> {
        rows.iter().filter_map(|row| Some((row.cn0_dbhz?, value(row)))).collect()
    };
    let series = vec![
        Series::new("expected", BLUE, Mark::Line, of(&|row| row.expected)),
        Series::new("95 % of counts", BLUE, Mark::Dash, of(&|row| row.low)),
        Series::new("", BLUE, Mark::Dash, of(&|row| row.high)),
        Series::new("counted", ORANGE, Mark::Balls, of(&|row| row.measured)),
    ];
    let x = Axis::around("C/N0 (dB-Hz)", of(&|_| 0.0).into_iter().map(|(x, _)| x), 1.0);
    let chart =
        Chart::new("Detection by the default search", x, Axis::new("probability", (-0.03, 1.03)), series.clone());
    let legend: Vec<Series> = series.into_iter().filter(|series| !series.name.is_empty()).collect();
    figure(&directory.join("acquisition.png"), (900, 480), 1, &[chart], &legend)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_interval_holds_ninety_five_percent_of_counts() {
        // Binomial tables: n = 20, p = 0.5 has P(X ≤ 5) = 0.0207 and P(X ≤ 14) = 0.9793.
        assert_eq!(interval(0.5, 20), (6.0 / 20.0, 14.0 / 20.0));
        let (low, high) = interval(1.0, 50);
        assert!(low <= 1.0 && high >= 1.0);
    }

    #[test]
    fn a_bias_that_no_row_shows_alone_shows_in_all_together() {
        let row = |found: u32| DetectionRow::new("detection", Some(33.0), (found, 2000), 0.43);
        let sound = Joint::of(&[row(860), row(870), row(850), DetectionRow::new("false alarm", None, (10, 2000), 0.1)]);
        assert!(sound.rows == 3 && sound.bias_sigma.abs() < 0.1 && sound.exceeded > 0.5, "{sound:?}");
        // Each 1.3 σ low.
        let low = Joint::of(&[row(830), row(830), row(830), row(830), row(830)]);
        assert!(low.bias_sigma < -2.5 && low.chi_square < 10.0, "{low:?}");
    }

    #[test]
    fn searches_find_what_their_statistics_say() {
        let directory = tempfile::tempdir().unwrap();
        let writer = |n: u32| {
            let place = directory.path().join(n.to_string());
            std::fs::create_dir(&place).unwrap();
            truth::Writer::create(&place).unwrap()
        };
        for (n, cn0_dbhz) in (0..).zip([32.5, 34.0]) {
            let row = detections(&settings(1e-6), cn0_dbhz, 200, 5, &mut writer(n)).unwrap();
            // Four deviations of the count, and of the expectation's own draws.
            let variance = row.expected * (1.0 - row.expected);
            let scatter = 4.0 * (variance / f64::from(row.trials) + variance / f64::from(DRAWS)).sqrt();
            assert!(row.expected > 0.1 && row.expected < 0.9, "{row:?}");
            assert!((row.measured - row.expected).abs() < scatter, "{row:?}");
        }
        let row = false_alarms(&settings(0.1), 1500, 6, &mut writer(9)).unwrap();
        // At most as designed, and four deviations of the count; at least what is left where cells are
        // independent, of which cells that are alike take a tenth at most.
        let scatter = |share: f64| 4.0 * (share / f64::from(row.trials)).sqrt();
        assert!(row.expected == 0.1 && (0.005..0.03).contains(&row.low), "{row:?}");
        assert!(row.measured < 0.1 + scatter(0.1) && row.measured > 0.9 * row.low - scatter(row.low), "{row:?}");
    }
}
