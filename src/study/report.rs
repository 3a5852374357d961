//! Writes the comparison with theory down: `loops.csv`, `loops.md` and `loops.png`.

use std::fmt::Write;
use std::path::Path;

use super::limits::{Level, jerk_stress_deg};
use super::proof::{BAR, FREQUENCY_BAR, LARGEST_BANDWIDTH_TIME, LEAST_SNR, ProofRow, Quantity};
use analysis::JudgeError;
use analysis::expect::theory::{dll, fll, oscillator, pll};
use analysis::show::plot::canvas::{Axis, BLUE, Chart, GREEN, GREY, Mark, ORANGE, Series, figure};
use analysis::show::write::write_whole;
use receiver::track::TrackingSettings;

/// Writes all three files into a directory; `preface` says when and how fast it was run.
///
/// # Errors
/// [`JudgeError`] with the file that could not be written.
pub fn write(
    directory: &Path,
    rows: &[ProofRow],
    levels: &[Level],
    settings: &TrackingSettings,
    preface: &str,
) -> Result<(), JudgeError> {
    let path = directory.join("loops.csv");
    let mut table = csv::Writer::from_writer(Vec::new());
    for row in rows {
        table.serialize(row).map_err(|source| JudgeError::Row { path: path.clone(), source })?;
    }
    let csv =
        table.into_inner().map_err(|error| JudgeError::File { path: path.clone(), source: error.into_error() })?;
    write_whole(&path, &csv)?;
    let text = format!(
        "# Tracking loops against theory\n\n{preface}\n\n![Ratio of measured and predicted jitter](loops.png)\n\
         {}{}{}{}",
        inside(rows),
        outside(rows),
        against_rules(levels, settings),
        stress(settings),
    );
    write_whole(&directory.join("loops.md"), text.as_bytes())?;
    draw(&directory.join("loops.png"), rows, levels, settings)
}

/// The loop of a row in words.
fn name(row: &ProofRow) -> String {
    let what = match row.quantity {
        Quantity::Phase if row.mode == "assisted" => "assisted phase",
        Quantity::Phase => "phase",
        Quantity::Code => "code",
        Quantity::Frequency => "frequency",
    };
    format!("{what}, {}, order {}", row.discriminator, row.order)
}

fn families(rows: &[ProofRow]) -> Vec<(String, Vec<&ProofRow>)> {
    let mut families: Vec<(String, Vec<&ProofRow>)> = Vec::new();
    for row in rows {
        let name = name(row);
        match families.iter_mut().find(|(known, _)| *known == name) {
            Some((_, members)) => members.push(row),
            None => families.push((name, vec![row])),
        }
    }
    families
}

/// The region in which theory must hold.
fn inside(rows: &[ProofRow]) -> String {
    let region: Vec<ProofRow> = rows.iter().filter(|row| row.in_region).cloned().collect();
    let good = region.iter().filter(|row| row.holds()).count();
    let mut text = format!(
        "\n## Where T·C/N0 ≥ {LEAST_SNR} and B·T ≤ {LARGEST_BANDWIDTH_TIME}\n\n\
         Ratio of the measured spread of (truth − oscillator) to theory with the exact bandwidth of the discrete \
         loop. {good} of {} cells are within {:.0} % (frequency {:.0} %) or three standard errors of the \
         measurement.\n\n\
         | loop | cells | within | ratio: mean | least | largest | standard error, at most |\n\
         | --- | --- | --- | --- | --- | --- | --- |\n",
        region.len(),
        100.0 * BAR,
        100.0 * FREQUENCY_BAR,
    );
    for (name, members) in families(&region) {
        let ratios = || members.iter().map(|row| row.ratio);
        let _ = writeln!(
            text,
            "| {name} | {} | {} | {:.4} | {:.4} | {:.4} | {:.2} % |",
            members.len(),
            members.iter().filter(|row| row.holds()).count(),
            ratios().sum::<f64>() / members.len() as f64,
            ratios().fold(f64::INFINITY, f64::min),
            ratios().fold(0.0, f64::max),
            100.0 * members.iter().map(|row| row.uncertainty).fold(0.0, f64::max),
        );
    }
    text + &listed("Cells of the region beyond their bar", region.iter().filter(|row| !row.holds()))
}

fn outside(rows: &[ProofRow]) -> String {
    let rest = rows.iter().filter(|row| !row.in_region);
    let departing = rest.clone().filter(|row| !row.holds()).count();
    let mut text = format!(
        "\n## Outside\n\n{departing} of {} cells differ from linear theory. Causes: the arctangent of a noisy prompt \
         loses gain and spreads more than its squaring loss says; pairs of prompts wrap by half a cycle; the \
         quotient of noisy correlations has long tails (those of the dot product are unbounded); errors leave the \
         linear range ±d/2.\n",
        rest.clone().count()
    );
    text += &listed("Cells that differ", rest.filter(|row| !row.holds()));
    text
}

fn listed<'a>(title: &str, rows: impl Iterator<Item = &'a ProofRow>) -> String {
    let mut text = String::new();
    for row in rows {
        if text.is_empty() {
            let _ = write!(
                text,
                "\n{title}:\n\n| loop | T (ms) | B (Hz) | d (chip) | C/N0 (dB-Hz) | T·C/N0 | theory | measured | \
                 ratio | slips | cause |\n\
                 | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |\n"
            );
        }
        let _ = writeln!(
            text,
            "| {} | {:.0} | {:.1} | {} | {:.0} | {:.1} | {:.4} | {:.4} | {:.3} | {} | {} |",
            name(row),
            1e3 * row.integration_s,
            row.bandwidth_hz,
            row.spacing_chips,
            row.cn0_dbhz,
            row.snr,
            row.theory,
            row.measured,
            row.ratio,
            row.slips,
            row.cause
        );
    }
    text
}

/// The loops against the rules of thumb, over C/N0.
fn against_rules(levels: &[Level], settings: &TrackingSettings) -> String {
    let d = settings.spacing_chips;
    let update_s = 1e-3 * f64::from(settings.integration);
    let noise = oscillator::TCXO;
    let cell = |value: Option<f64>, digits: usize| value.map_or_else(|| "–".to_owned(), |v| format!("{v:.digits$}"));
    let mut text = format!(
        "\n## The receiver's default loops against the rules\n\n\
         Phase loop order {}, {} Hz, T = {:.0} ms; code loop order {}, {} Hz, d = {d}; frequency loop order {}, {} \
         Hz, T = 1 ms. Rules: 15°, d/6 = {:.4} chip, 1/(12T) = {:.1} Hz. Thermal jitter alone reaches 15° at {:.1} \
         dB-Hz and d/6 at {:.1} dB-Hz. Oscillator: TCXO with h₀ {:e}, h₋₁ {:e}, h₋₂ {:e}. Theory / simulation; the \
         run with the oscillator is watched by the receiver's lock detectors, which may give up.\n\n\
         | C/N0 (dB-Hz) | phase (°) | with TCXO (°) | 3σ ≤ 45° | code (chip) | σ ≤ d/6 | frequency (Hz) | σ ≤ \
         1/(12T) | slips (1/h) | lost after (s) |\n\
         | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |\n",
        settings.pll_order,
        settings.pll_bandwidth_hz,
        1e3 * update_s,
        settings.dll_order,
        settings.dll_bandwidth_hz,
        settings.fll_order,
        settings.fll_bandwidth_hz,
        dll::threshold_chips(d),
        fll::threshold_hz(1e-3),
        pll::cn0_dbhz(pll::THRESHOLD_RAD, settings.pll_bandwidth_hz, update_s),
        dll::least_cn0_dbhz(d, settings.dll_bandwidth_hz, update_s),
        noise.h[2],
        noise.h[3],
        noise.h[4],
    );
    let mark = |holds: bool| if holds { "yes" } else { "no" };
    for level in levels {
        let worst = |(theory, found): (f64, Option<f64>)| found.map_or(f64::INFINITY, |found| found.max(theory));
        let _ = writeln!(
            text,
            "| {:.0} | {:.2} / {} | {:.2} / {} | {} | {:.4} / {} | {} | {:.2} / {} | {} | {:.0} | {} |",
            level.cn0_dbhz,
            level.phase_deg.0,
            cell(level.phase_deg.1, 2),
            level.phase_with_oscillator_deg.0,
            cell(level.phase_with_oscillator_deg.1, 2),
            mark(worst(level.phase_with_oscillator_deg) <= pll::THRESHOLD_RAD.to_degrees()),
            level.code_chips.0,
            cell(level.code_chips.1, 4),
            mark(worst(level.code_chips) <= dll::threshold_chips(d)),
            level.frequency_hz.0,
            cell(level.frequency_hz.1, 2),
            mark(worst(level.frequency_hz) <= fll::threshold_hz(1e-3)),
            level.slips_per_hour,
            level.lost.map_or_else(|| "–".to_owned(), |(at_s, loss)| format!("{at_s:.1} ({loss:?})")),
        );
    }
    text
}

const GRAVITY_MPS2: f64 = 9.80665;

fn stress(settings: &TrackingSettings) -> String {
    let mut text =
        "\n## Under jerk\n\nSteady phase error of the default loop, theory J·T³/K3 and simulation without noise:\n\n\
                    | jerk (g/s) | theory (°) | simulation (°) |\n| --- | --- | --- |\n"
            .to_owned();
    for jerk in [1.0, 5.0, 10.0, 20.0, 30.0, 40.0, 60.0] {
        let (theory, found) = jerk_stress_deg(settings, jerk * GRAVITY_MPS2);
        let found = found.map_or_else(|| "unlocked".to_owned(), |degrees| format!("{degrees:.2}"));
        let _ = writeln!(text, "| {jerk} | {theory:.2} | {found} |");
    }
    text
}

fn draw(path: &Path, rows: &[ProofRow], levels: &[Level], settings: &TrackingSettings) -> Result<(), JudgeError> {
    let points = |quantity: Quantity| -> Vec<(f64, f64)> {
        let shown = rows.iter().filter(|row| row.quantity == quantity && !row.lost);
        shown.map(|row| (10.0 * libm::log10(row.snr), row.ratio)).collect()
    };
    let x = Axis::new("T·C/N0 (dB)", (-2.0, 32.0));
    let line = |y: f64| vec![(x.from, y), (x.to, y)];
    let edge = 10.0 * libm::log10(LEAST_SNR);
    let ratios = Chart::new(
        "Measured jitter over theory",
        x.clone(),
        Axis::new("ratio", (0.8, 1.4)),
        vec![
            Series::new("phase", BLUE, Mark::Dots, points(Quantity::Phase)),
            Series::new("code", ORANGE, Mark::Rings, points(Quantity::Code)),
            Series::new("frequency", GREEN, Mark::Dots, points(Quantity::Frequency)),
            Series::new("bar of the region", GREY, Mark::Dash, line(1.0 + BAR)),
            Series::new("bar of the region", GREY, Mark::Dash, line(1.0 - BAR)),
            Series::new("bar of the region", GREY, Mark::Dash, vec![(edge, 0.8), (edge, 1.4)]),
        ],
    );
    // Each jitter as a share of its rule.
    let d6 = dll::threshold_chips(settings.spacing_chips);
    type Pair = fn(&Level) -> (f64, Option<f64>);
    let kinds: [(Pair, f64, _); 3] = [
        (|level| level.phase_deg, pll::THRESHOLD_RAD.to_degrees(), BLUE),
        (|level| level.code_chips, d6, ORANGE),
        (|level| level.frequency_hz, fll::threshold_hz(1e-3), GREEN),
    ];
    let x = Axis::around("C/N0 (dB-Hz)", levels.iter().map(|level| level.cn0_dbhz), 10.0);
    let mut shares = vec![Series::new("rule of thumb", GREY, Mark::Dash, vec![(x.from, 1.0), (x.to, 1.0)])];
    for (pair, rule, colour) in kinds {
        let theory = levels.iter().map(|level| (level.cn0_dbhz, pair(level).0 / rule)).collect();
        let found = levels.iter().filter(|level| level.lost.is_none());
        let found = found.filter_map(|level| Some((level.cn0_dbhz, pair(level).1? / rule))).collect();
        shares.push(Series::new("theory", colour, Mark::Line, theory));
        shares.push(Series::new("simulation", colour, Mark::Balls, found));
    }
    let default = Chart::new("Default loops: jitter over its rule of thumb", x, Axis::new("share", (0.0, 1.6)), shares);
    let legend = [
        Series::new("phase", BLUE, Mark::Balls, Vec::new()),
        Series::new("code", ORANGE, Mark::Balls, Vec::new()),
        Series::new("frequency", GREEN, Mark::Balls, Vec::new()),
        Series::new("theory (right)", BLUE, Mark::Line, Vec::new()),
        Series::new("±5 %, T·C/N0 = 10; rule of thumb", GREY, Mark::Dash, Vec::new()),
    ];
    figure(path, (1280, 480), 2, &[ratios, default], &legend)
}
