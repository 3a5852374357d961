//! Loops and observations over time, satellite by satellite.

use crate::analysis::errors::{Link, SignalError};
use crate::analysis::plot::Judged;
use crate::analysis::plot::canvas::{Axis, Chart, Drawing, Failure, Mark, Series, WIDTH_PX, compose};
use crate::analysis::statistics::percentile;
use crate::gnss::record::TrackingRow;

pub(super) type Points = Vec<(f64, f64)>;

/// One chart of something over time with a series a satellite.
pub(super) fn over_time(
    judged: &Judged<'_>,
    title: &str,
    y_label: &str,
    least: f64,
    data: &[(String, Points)],
) -> Chart {
    let values: Vec<f64> = data.iter().flat_map(|(_, points)| points.iter().map(|point| point.1)).collect();
    // Pull-in may be far outside; the axis shows what holds most of the time.
    let [low, high] = [0.002, 0.998].map(|p| percentile(&values, p).unwrap_or(0.0));
    let y = Axis::around(y_label, [low, high].into_iter(), least.max(1.3 * (high - low)));
    let x = judged.time_axis(data.iter().flat_map(|(_, points)| points.iter().map(|point| point.0)));
    let inside =
        |points: &Points| points.iter().copied().filter(|point| (y.from..=y.to).contains(&point.1)).collect::<Points>();
    let series: Vec<Series> = (data.iter().enumerate())
        .map(|(index, (name, points))| Series::numbered(name.clone(), index, inside(points)))
        .collect();
    let total = values.iter().filter(|value| value.is_finite()).count();
    let outside = total - series.iter().map(|series| series.points.len()).sum::<usize>();
    let title = if outside > 0 { format!("{title} ({outside} of {total} points outside)") } else { title.to_owned() };
    Chart::new(title, x, y, series)
}

pub(super) fn legend(names: impl Iterator<Item = String>) -> Vec<Series> {
    names.enumerate().map(|(index, name)| Series::numbered(name, index, Vec::new())).collect()
}

/// Raw discriminators of the three loops.
pub fn discriminators(judged: &Judged<'_>) -> Result<Option<Drawing>, Failure> {
    let run = judged.run;
    let mut links: Vec<Link> = run.tracking.iter().map(|row| (row.sv, row.signal)).collect();
    links.sort_unstable();
    links.dedup();
    let data = |of: fn(&TrackingRow) -> f64| -> Vec<(String, Points)> {
        let one = |link: &Link| {
            let rows = run.tracking.iter().filter(|row| (row.sv, row.signal) == *link);
            (link.0.to_string(), rows.map(|row| (run.time_s(row.sample), of(row))).collect())
        };
        links.iter().map(one).collect()
    };
    let charts = [
        over_time(judged, "DLL discriminator", "output (chips)", 0.02, &data(|row| row.dll_discriminator_chips)),
        over_time(
            judged,
            "PLL discriminator",
            "output (degrees)",
            2.0,
            &data(|row| row.pll_discriminator_cycles * 360.0),
        ),
        over_time(judged, "FLL discriminator", "output (Hz)", 2.0, &data(|row| row.fll_discriminator_hz)),
    ];
    let names = legend(links.iter().map(|link| link.0.to_string()));
    compose((WIDTH_PX, 540), 1, &charts, &names).map(Some)
}

pub(super) fn per_satellite(judged: &Judged<'_>, of: impl Fn(&SignalError) -> f64) -> Vec<(String, Points)> {
    let points = |rows: &[SignalError]| rows.iter().map(|row| (row.time_s, of(row))).collect();
    judged.errors.signals.iter().map(|((sv, _), rows)| (sv.to_string(), points(rows))).collect()
}

fn satellites(judged: &Judged<'_>) -> Vec<Series> {
    legend(judged.errors.signals.keys().map(|(sv, _)| sv.to_string()))
}

/// C/N0 over time as measured and as it was, and the means side by side.
pub fn cn0(judged: &Judged<'_>) -> Result<Option<Drawing>, Failure> {
    let measured = per_satellite(judged, |row| row.cn0_dbhz);
    // Under interference what is expected is far from what is set.
    let (word, reference): (&str, fn(&SignalError) -> f64) = if judged.summary.jammed {
        ("expected", |row| row.cn0_effective_dbhz)
    } else {
        ("set", |row| row.cn0_true_dbhz)
    };
    let title = format!("C/N0 as measured (points) and as {word} (lines)");
    let mut chart = over_time(judged, &title, "C/N0 (dB-Hz)", 4.0, &measured);
    let truth = per_satellite(judged, reference);
    let all = measured.iter().chain(&truth).flat_map(|(_, points)| points.iter().map(|point| point.1));
    chart.y = Axis::around("C/N0 (dB-Hz)", all, 4.0);
    for (index, (name, points)) in truth.into_iter().enumerate() {
        let mut line = Series::numbered(name, index, points);
        line.mark = Mark::Line;
        chart.series.push(line);
    }
    let difference = per_satellite(judged, |row| row.cn0_dbhz - reference(row));
    let below = over_time(judged, &format!("C/N0 measured minus {word}"), "difference (dB)", 1.0, &difference);
    compose((WIDTH_PX, 430), 1, &[chart, below], &satellites(judged)).map(Some)
}

/// Errors of code, carrier and Doppler.
pub fn observables(judged: &Judged<'_>) -> Result<Option<Drawing>, Failure> {
    let charts = [
        over_time(judged, "Code error", "error (m)", 0.1, &per_satellite(judged, |row| row.code_m)),
        over_time(
            judged,
            "Carrier error, a constant removed from each arc",
            "error (cycles)",
            0.01,
            &per_satellite(judged, |row| row.carrier_cycles),
        ),
        over_time(judged, "Doppler error", "error (Hz)", 0.1, &per_satellite(judged, |row| row.doppler_hz)),
    ];
    compose((WIDTH_PX, 540), 1, &charts, &satellites(judged)).map(Some)
}
