//! The trade between speed and accuracy: measured rows become a table, a CSV file and a picture.
//!
//! A row is one setting of the generator with its cost and its errors against the `reference` level, measured
//! by `benches/trade`. A row is dominated if another of the same scene and rate costs no more and errs no
//! more; what remains is the Pareto front. Limits: nothing is measured here, and fronts look at cost and
//! pseudorange error alone.

use std::fmt::{self, Write};
use std::path::Path;

use serde::Serialize;

use crate::error::JudgeError;
use crate::show::plot::canvas::{Axis, BLUE, Chart, GREY, Mark, ORANGE, Series, figure};
use crate::show::write::{write_rows, write_whole};

/// One setting and what was measured for it; errors are against the `reference` level.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct TradeRow {
    /// Name of the scene.
    pub scene: String,
    /// Samples a second, millions.
    pub sample_rate_msps: f64,
    /// A level's name, or the knob and its value.
    pub setting: String,
    /// Edges of chips, by name.
    pub code_edge: String,
    /// Arithmetic of the carrier, by name.
    pub carrier: String,
    /// Largest error of a carrier between knots, cycles.
    pub knot_tolerance_cycles: f64,
    /// Time for one sample of one satellite on one core, the whole generator included.
    pub ns: f64,
    /// Pseudorange error over 20 ms pieces: largest mean of a satellite, spread about the means, largest.
    pub pseudorange_mean_m: f64,
    /// Standard deviation of the pseudoranges against the reference, metres.
    pub pseudorange_sigma_m: f64,
    /// The largest of them, metres.
    pub pseudorange_max_m: f64,
    /// Largest error of the carrier over 1 ms.
    pub carrier_cycles: f64,
    /// Largest error of its slope over 20 ms.
    pub doppler_hz: f64,
    /// Strongest line of the carrier with the code wiped off, beside the carrier itself.
    pub spur_dbc: f64,
    /// Power lost in a correlation with the reference waveform.
    pub cn0_loss_db: f64,
}

impl TradeRow {
    /// Root mean square of mean and spread.
    pub fn pseudorange_m(&self) -> f64 {
        (self.pseudorange_mean_m.powi(2) + self.pseudorange_sigma_m.powi(2)).sqrt()
    }

    fn rivals(&self, other: &Self) -> bool {
        self.scene == other.scene && self.sample_rate_msps == other.sample_rate_msps
    }
}

impl fmt::Display for TradeRow {
    /// The setting and its figures as cells of a table.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "{} | {} | {} | {:e} | {:.3} | {:.4} / {:.4} / {:.4} | {:.1e} | {:.1e} | {:.0} | {:.3}",
            self.setting,
            self.code_edge,
            self.carrier,
            self.knot_tolerance_cycles,
            self.ns,
            self.pseudorange_mean_m,
            self.pseudorange_sigma_m,
            self.pseudorange_max_m,
            self.carrier_cycles,
            self.doppler_hz,
            self.spur_dbc,
            // No zero that rounding left negative.
            (self.cn0_loss_db * 1e3).round() / 1e3 + 0.0,
        )
    }
}

/// One width of samples and quality of noise, against single-precision samples with noise in double
/// precision.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Width {
    /// Format, what its noise was computed in, converter.
    pub setting: String,
    /// Bytes of a sample in the file.
    pub bytes: usize,
    /// Time for a sample of the whole scene on one core, and the part of noise, converter and the wider file.
    pub ns: f64,
    /// Time of the stages, nanoseconds a sample.
    pub stages_ns: f64,
    /// Root mean square of what differs, beside that of the samples.
    pub sample_error: f64,
    /// Power lost against noise in a correlation.
    pub cn0_loss_db: f64,
    /// Mean of the code's shift in metres, over pieces of 20 ms.
    pub code_mean_m: f64,
    /// Standard deviation of the receiver's code, metres.
    pub code_sigma_m: f64,
}

impl fmt::Display for Width {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "{} | {} | {:.2} | {:.2} | {:.1e} | {:.3} | {:.3} / {:.3}",
            self.setting,
            self.bytes,
            self.ns,
            self.stages_ns,
            self.sample_error,
            // No zero that rounding left negative.
            (self.cn0_loss_db * 1e3).round() / 1e3 + 0.0,
            self.code_mean_m,
            self.code_sigma_m,
        )
    }
}

/// Writes `widths.csv` and `widths.md` into a directory; `machine` is where and when they were measured.
///
/// # Errors
/// [`JudgeError`] with the file that could not be written.
pub fn write_widths(directory: &Path, rows: &[Width], machine: &str) -> Result<(), JudgeError> {
    write_rows(&directory.join("widths.csv"), "", rows.iter())?;
    let mut text = format!(
        "# Width of samples and quality of noise\n\n\
         The static scene at 2.6 Msps, `balanced`. Time is that of the whole generator on one core for a sample of \
         twelve satellites, and of it what noise, converter and format take; processor time, medians of interleaved \
         runs. What is lost is that of one satellite in noise, against single-precision samples with noise in double \
         precision and the same seed, over 3 s: the samples' difference beside their own root mean square, C/N0, and \
         the code over pieces of 20 ms. Converters of 1 and 2 bits lose 1.96 and 0.55 dB of white noise (Max 1960; \
         van Vleck & Middleton 1966).\n\n\
         {machine} `cargo bench --bench trade -- --widths` makes this page.\n\n\
         | samples | bytes | ns | of it stages | difference (rms) | C/N0 loss (dB) | code mean / σ (m) |\n\
         | --- | --- | --- | --- | --- | --- | --- |\n"
    );
    for row in rows {
        let _ = writeln!(text, "| {row} |");
    }
    write_whole(&directory.join("widths.md"), text.as_bytes())
}

/// True if another row of the same scene is at most as costly and as wrong as row `index`, and better in one
/// of both.
pub fn dominated(rows: &[TradeRow], index: usize) -> bool {
    let Some(row) = rows.get(index) else { return false };
    let error = row.pseudorange_m();
    rows.iter().filter(|other| row.rivals(other)).any(|other| {
        let (ns, theirs) = (other.ns, other.pseudorange_m());
        ns <= row.ns && theirs <= error && (ns < row.ns || theirs < error)
    })
}

/// Writes `trade.csv` and `trade.png` into a directory.
///
/// # Errors
/// [`JudgeError`] with the file that could not be written.
pub fn write(directory: &Path, rows: &[TradeRow]) -> Result<(), JudgeError> {
    write_rows(&directory.join("trade.csv"), "", rows.iter())?;
    draw(&directory.join("trade.png"), rows)
}

/// A table in Markdown for each scene and rate.
pub fn tables(rows: &[TradeRow]) -> String {
    let mut text = String::new();
    let mut last = None;
    for (index, row) in rows.iter().enumerate() {
        if last.is_none_or(|last: &TradeRow| !last.rivals(row)) {
            let _ = write!(
                text,
                "\n### Scene {}, {} Msps\n\n\
                 | setting | edge | carrier | knots (cycle) | ns | pseudorange mean / σ / max (m) | carrier (cycle) \
                 | Doppler (Hz) | spur (dBc) | C/N0 loss (dB) | front |\n\
                 | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |\n",
                row.scene, row.sample_rate_msps
            );
        }
        last = Some(row);
        let front = if dominated(rows, index) { "" } else { "yes" };
        let _ = writeln!(text, "| {row} | {front} |");
    }
    text
}

/// Errors below this are drawn on the lower edge.
const FLOOR_M: f64 = 1e-4;

/// One chart for each scene and rate that has more than two settings with different errors.
fn draw(path: &Path, rows: &[TradeRow]) -> Result<(), JudgeError> {
    let mut groups: Vec<Vec<usize>> = Vec::new();
    for (index, row) in rows.iter().enumerate() {
        match groups.last_mut() {
            Some(group) if rows.get(group[0]).is_some_and(|first| first.rivals(row)) => group.push(index),
            _ => groups.push(vec![index]),
        }
    }
    let differ = |group: &&Vec<usize>| {
        let errors = || group.iter().filter_map(|index| rows.get(*index)).map(TradeRow::pseudorange_m);
        errors().fold(0.0, f64::max) > 100.0 * FLOOR_M && group.len() > 2
    };
    let charts: Vec<Chart> = groups.iter().filter(differ).map(|group| chart(rows, group)).collect();
    let legend = [
        Series::new("on the Pareto front", BLUE, Mark::Balls, Vec::new()),
        Series::new("dominated", GREY, Mark::Balls, Vec::new()),
        Series::new("front", BLUE, Mark::Line, Vec::new()),
        Series::new("0.1 m", ORANGE, Mark::Dash, Vec::new()),
    ];
    let columns = charts.len().clamp(1, 2);
    let height = 60 + 420 * charts.len().div_ceil(columns) as u32;
    figure(path, (640 * columns as u32, height), columns, &charts, &legend)
}

fn chart(rows: &[TradeRow], group: &[usize]) -> Chart {
    let place = |row: &TradeRow| (libm::log10(row.ns), libm::log10(row.pseudorange_m().max(FLOOR_M)));
    let mut front = Vec::new();
    let mut beaten = Vec::new();
    let mut labels = Vec::new();
    let mut title = String::new();
    for &index in group {
        let Some(row) = rows.get(index) else { continue };
        title = format!("{}, {} Msps", row.scene, row.sample_rate_msps);
        if dominated(rows, index) {
            beaten.push(place(row));
            labels.push((place(row), row.setting.clone(), -11));
        } else {
            front.push(place(row));
            labels.push((place(row), row.setting.clone(), 11));
        }
    }
    front.sort_by(|a, b| a.0.total_cmp(&b.0));
    let all = || front.iter().chain(&beaten);
    let (low, high) = all().fold((0.0_f64, 0.0_f64), |(low, high), (x, _)| (low.min(*x), high.max(*x)));
    let top = all().fold(0.0_f64, |top, (_, y)| top.max(*y));
    let x = Axis::new("time for a sample of a satellite, one core (ns)", (low - 0.12, high + 0.45)).logarithmic();
    let words = format!("pseudorange error (m, rms); {FLOOR_M} stands for less");
    let y = Axis::new(&words, (libm::log10(FLOOR_M) - 0.3, top + 0.4)).logarithmic();
    let limit = vec![(x.from, -1.0), (x.to, -1.0)];
    let series = vec![
        Series::new("0.1 m", ORANGE, Mark::Dash, limit),
        Series::new("front", BLUE, Mark::Line, front.clone()),
        Series::new("on the Pareto front", BLUE, Mark::Balls, front),
        Series::new("dominated", GREY, Mark::Balls, beaten),
    ];
    Chart { labels, ..Chart::new(title, x, y, series) }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(setting: &str, rate: f64, ns: f64, error_m: f64) -> TradeRow {
        TradeRow {
            scene: "static".to_owned(),
            sample_rate_msps: rate,
            setting: setting.to_owned(),
            code_edge: "area".to_owned(),
            carrier: "f32".to_owned(),
            knot_tolerance_cycles: 1e-4,
            ns,
            pseudorange_mean_m: 0.0,
            pseudorange_sigma_m: error_m,
            pseudorange_max_m: error_m,
            carrier_cycles: 1e-6,
            doppler_hz: 1e-3,
            spur_dbc: -90.0,
            cn0_loss_db: 0.0,
        }
    }

    #[test]
    fn a_row_is_dominated_by_one_that_is_no_dearer_and_no_worse() {
        let rows = [
            row("a", 2.6, 1.0, 1.0),
            row("b", 2.6, 2.0, 1.0),
            row("c", 2.6, 3.0, 0.1),
            row("d", 2.6, 4.0, 0.2),
            row("e", 25.0, 9.0, 9.0),
            row("f", 2.6, 3.0, 0.1),
        ];
        let beaten: Vec<bool> = (0..rows.len()).map(|index| dominated(&rows, index)).collect();
        assert_eq!(beaten, [false, true, false, true, false, false]);
    }

    #[test]
    fn the_table_names_every_setting_and_the_files_appear() {
        let directory = tempfile::tempdir().unwrap();
        let rows = [row("fast", 2.6, 0.3, 1.0), row("balanced", 2.6, 0.4, 0.1), row("reference", 2.6, 8.0, 0.0)];
        write(directory.path(), &rows).unwrap();
        let text = tables(&rows);
        assert!(rows.iter().all(|row| text.contains(&format!("| {} |", row.setting))), "{text}");
        let csv = std::fs::read_to_string(directory.path().join("trade.csv")).unwrap();
        assert_eq!(csv.lines().count(), 4);
        assert!(std::fs::metadata(directory.path().join("trade.png")).unwrap().len() > 1000);
    }
}
