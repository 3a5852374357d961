//! The spectrum of the samples against theory, and the search's statistics against their threshold.

use std::collections::BTreeMap;

use crate::analysis::error::JudgeError;
use crate::analysis::expect::spectrum;
use crate::analysis::read::Run;
use crate::analysis::show::plot::canvas::{Axis, BLUE, Chart, GREEN, GREY, Mark, ORANGE, Series, WIDTH_PX};
use crate::analysis::show::plot::judged::Judged;
use crate::analysis::show::plot::sketch::Sketch;
use crate::gnss::record::AcquisitionRow;
use crate::gnss::signal::Link;

/// Measured density and the theory's; nothing without `psd.csv`.
pub fn psd(judged: &Judged<'_>) -> Result<Option<Sketch>, JudgeError> {
    let rows = &judged.run.psd;
    if rows.is_empty() {
        return Ok(None);
    }
    let measured: Vec<(f64, f64)> = rows.iter().map(|row| (row.frequency_hz / 1e6, row.density_db)).collect();
    let theory: Vec<(f64, f64)> =
        measured.iter().zip(spectrum::theory_db(judged.run)).map(|((mhz, _), theory_db)| (*mhz, theory_db)).collect();
    let x = Axis::new(
        "frequency in the samples (MHz)",
        (measured.first().map_or(0.0, |p| p.0), measured.last().map_or(1.0, |p| p.0)),
    );
    let y = Axis::around("density (dB LSB²/Hz)", measured.iter().chain(&theory).map(|p| p.1), 2.0);
    let mut series = vec![Series::new("measured", BLUE, Mark::Line, measured)];
    if !theory.is_empty() {
        series.push(Series::new("theory", ORANGE, Mark::Line, theory));
    }
    let legend = series.clone();
    let noise = if judged.run.scene.noise { "with noise" } else { "without noise" };
    let chart = Chart::new(format!("Power spectral density of the samples, {noise}"), x, y, series);
    Ok(Some(Sketch::charts((WIDTH_PX, 340), 1, [chart], legend)))
}

/// The largest statistic of each satellite's signal that was searched, with the threshold.
pub fn acquisition(judged: &Judged<'_>) -> Result<Option<Sketch>, JudgeError> {
    let mut best: BTreeMap<Link, &AcquisitionRow> = BTreeMap::new();
    for row in &judged.run.acquisition {
        let kept = best.entry(row.link()).or_insert(row);
        // What was acquired counts before what was only stronger against another threshold.
        if (row.acquired, row.statistic) > (kept.acquired, kept.statistic) {
            *kept = row;
        }
    }
    let bars = |acquired: bool| -> Vec<(f64, f64)> {
        let placed = best.values().enumerate().filter(|(_, row)| row.acquired == acquired);
        placed.map(|(place, row)| (place as f64, row.statistic)).collect()
    };
    let edges = |(place, row): (usize, &&AcquisitionRow)| {
        [(place as f64 - 0.5, row.threshold), (place as f64 + 0.5, row.threshold)]
    };
    let threshold: Vec<(f64, f64)> = best.values().enumerate().flat_map(edges).collect();
    let top = best.values().map(|row| row.statistic.max(row.threshold)).fold(1.0, f64::max);
    let series = vec![
        Series::new("acquired", BLUE, Mark::Bars(0.7), bars(true)),
        Series::new("not acquired", GREY, Mark::Bars(0.7), bars(false)),
        Series::new("threshold", ORANGE, Mark::Line, threshold),
    ];
    let mut legend = series.clone();
    let x = Axis::new("satellite", (-0.8, best.len().max(1) as f64 - 0.2));
    let y = Axis::new("largest statistic of the search", (0.0, 1.08 * top));
    let mut chart = Chart::new("Acquisition", x, y, series);
    chart.x_ticks =
        Some((0..).zip(best.keys()).map(|(place, link)| (f64::from(place), tick(judged.run, *link))).collect());
    let truly: Vec<(f64, f64)> = (0..)
        .zip(best.values())
        .filter(|(_, best)| judged.run.truth.contains(&best.link()))
        .map(|(place, best)| (f64::from(place), best.statistic + 0.03 * top))
        .collect();
    let in_truth = Series::new("in the truth", GREEN, Mark::Cross, truly);
    legend.push(in_truth.clone());
    chart.series.push(in_truth);
    Ok(Some(Sketch::charts((WIDTH_PX, 330), 1, [chart], legend)))
}

/// Satellites of the only system by number alone, to fit side by side.
fn tick(run: &Run, link: Link) -> String {
    let name = run.name(link);
    let alone = run.signals.iter().all(|signal| signal.system == link.sv.system) && name == link.sv.to_string();
    if alone { link.sv.number.to_string() } else { name }
}
