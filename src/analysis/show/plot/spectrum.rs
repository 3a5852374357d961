//! The spectrum of the samples against theory, and the search's statistics against their threshold.

use std::collections::BTreeMap;

use crate::error::JudgeError;
use crate::read::Run;
use crate::show::plot::canvas::{Axis, BLUE, Chart, GREEN, GREY, Mark, ORANGE, Series, WIDTH_PX};
use crate::show::plot::judged::Judged;
use crate::show::plot::sketch::Sketch;
use gnss::record::AcquisitionRow;
use gnss::signal::{Link, Signal};

/// Measured density and the theory's; nothing without `psd.csv`.
pub fn psd(judged: &Judged<'_>) -> Result<Option<Sketch>, JudgeError> {
    let rows = &judged.run.psd;
    if rows.is_empty() {
        return Ok(None);
    }
    let measured: Vec<(f64, f64)> = rows.iter().map(|row| (row.frequency_hz / 1e6, row.density_db)).collect();
    let theory: Vec<(f64, f64)> =
        measured.iter().zip(&judged.summary.details.psd_theory_db).map(|(&(mhz, _), &db)| (mhz, db)).collect();
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
    // A chart for each signal, the scene's first; one without bars where nothing was searched.
    let mut signals: Vec<&Signal> = best.keys().map(|link| link.signal).collect();
    let place = |signal: &Signal| judged.run.signals.iter().position(|other| *other == signal).unwrap_or(usize::MAX);
    signals.sort_by_key(|signal| (place(signal), signal.name));
    signals.dedup();
    let mut legend = Vec::new();
    let mut charts = Vec::new();
    for signal in &signals {
        let own: Vec<&AcquisitionRow> = best.values().copied().filter(|row| row.signal == *signal).collect();
        let title = if signals.len() > 1 { format!("Acquisition, {signal}") } else { "Acquisition".to_owned() };
        charts.push(statistics(judged.run, &own, title, &mut legend));
    }
    if charts.is_empty() {
        charts.push(statistics(judged.run, &[], "Acquisition".to_owned(), &mut legend));
    }
    let height_px = 330 * charts.len() as u32;
    Ok(Some(Sketch::charts((WIDTH_PX, height_px), 1, charts, legend)))
}

/// The best of each satellite of a signal, with the threshold; the legend is that of every signal.
fn statistics(run: &Run, best: &[&AcquisitionRow], title: String, legend: &mut Vec<Series>) -> Chart {
    let bars = |acquired: bool| -> Vec<(f64, f64)> {
        let placed = best.iter().enumerate().filter(|(_, row)| row.acquired == acquired);
        placed.map(|(place, row)| (place as f64, row.statistic)).collect()
    };
    let edges = |(place, row): (usize, &&AcquisitionRow)| {
        [(place as f64 - 0.5, row.threshold), (place as f64 + 0.5, row.threshold)]
    };
    let threshold: Vec<(f64, f64)> = best.iter().enumerate().flat_map(edges).collect();
    let top = best.iter().map(|row| row.statistic.max(row.threshold)).fold(1.0, f64::max);
    let truly: Vec<(f64, f64)> = (0..)
        .zip(best)
        .filter(|(_, best)| run.truth.contains(&best.link()))
        .map(|(place, best)| (f64::from(place), best.statistic + 0.03 * top))
        .collect();
    let series = vec![
        Series::new("acquired", BLUE, Mark::Bars(0.7), bars(true)),
        Series::new("not acquired", GREY, Mark::Bars(0.7), bars(false)),
        Series::new("threshold", ORANGE, Mark::Line, threshold),
        Series::new("in the truth", GREEN, Mark::Cross, truly),
    ];
    legend.clone_from(&series);
    let x = Axis::new("satellite", (-0.8, best.len().max(1) as f64 - 0.2));
    let y = Axis::new("largest statistic of the search", (0.0, 1.08 * top));
    // By number alone, to fit side by side.
    let name = |(place, row): (u32, &&AcquisitionRow)| (f64::from(place), row.sv.number.to_string());
    Chart::new(title, x.named((0..).zip(best).map(name).collect()), y, series)
}
