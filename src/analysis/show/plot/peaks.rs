//! Correlation of the samples with the codes, about the true delay of each satellite.

use std::collections::BTreeSet;

use crate::error::JudgeError;
use crate::measure::peaks::ideal;
use crate::show::plot::canvas::{Axis, Chart, GREY, Mark, Series, WIDTH_PX};
use crate::show::plot::chart::Ends;
use crate::show::plot::judged::Judged;
use crate::show::plot::sketch::Sketch;
use gnss::satellite::Sv;
use gnss::signal::Signal;

/// A chart a signal with a curve a satellite, and the code's own peak; nothing without `peaks.csv`.
pub fn peaks(judged: &Judged<'_>) -> Result<Option<Sketch>, JudgeError> {
    let rows = &judged.run.peaks;
    let satellites: Vec<Sv> = rows.iter().map(|row| row.sv).collect::<BTreeSet<_>>().into_iter().collect();
    let signals: BTreeSet<&'static Signal> = rows.iter().map(|row| row.signal).collect();
    if rows.is_empty() {
        return Ok(None);
    }
    let line = |(index, sv): (usize, &Sv)| Series::lined(sv.to_string(), index, Vec::new());
    let own = Series::new("unlimited band, no noise", GREY, Mark::Line, Vec::new());
    let chart = |signal: &&'static Signal| {
        let (mut x, mut y) = (Ends::none(), Ends::none());
        let mut series: Vec<Series> = satellites.iter().enumerate().map(line).collect();
        for row in rows.iter().filter(|row| row.signal == *signal) {
            x.add(row.delay_chips);
            y.add(row.in_phase);
            let own = satellites.binary_search(&row.sv).ok().and_then(|place| series.get_mut(place));
            own.into_iter().for_each(|one| one.points.push((row.delay_chips, row.in_phase)));
        }
        let (from, to) = x.values().fold((0.0_f64, 0.0_f64), |(low, high), x| (low.min(x), high.max(x)));
        let curve = ideal(signal).into_iter().flat_map(|(shape, chip_s)| {
            let delays = (0..=600).map(move |k| from + (to - from) * f64::from(k) / 600.0);
            delays.map(move |chips| (chips, shape.correlation(chips * chip_s)))
        });
        series.insert(0, Series { points: curve.collect(), ..own.clone() });
        y.add(1.0);
        let y = Axis::around("correlation (of the largest)", y.values(), 1.0);
        Chart::new(format!("Correlation with {}", signal.name), Axis::new("code delay (chips)", (from, to)), y, series)
    };
    let charts: Vec<Chart> = signals.iter().map(chart).collect();
    let columns = charts.len().min(2);
    let height_px = 90 + 250 * charts.len().div_ceil(columns) as u32;
    let legend: Vec<Series> = satellites.iter().enumerate().map(line).chain([own]).collect();
    Ok(Some(Sketch::charts((WIDTH_PX, height_px), columns, charts, legend)))
}
