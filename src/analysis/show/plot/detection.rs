//! Statistics of the detectors of jamming and spoofing over time, and their ROC curves.

use crate::error::JudgeError;
use crate::show::plot::canvas::{Axis, Chart, GREY, Mark, Series, WIDTH_PX};
use crate::show::plot::chart::Shown;
use crate::show::plot::judged::Judged;
use crate::show::plot::sketch::Sketch;
use gnss::record::Detector;

/// Ends of the statistic's axis, as multiples of the threshold: common logarithms.
const ENDS: (f64, f64) = (-1.5, 2.0);
/// Least share of false alarms that is drawn, a common logarithm.
const LEAST: f64 = -4.0;

/// Statistics over their thresholds, and below them ROC curves where the scene has an attack; `None` of a
/// receiver without detectors.
pub fn detection(judged: &Judged<'_>) -> Result<Option<Sketch>, JudgeError> {
    let Some(figures) = &judged.detection.figures else { return Ok(None) };
    let run = judged.run;
    let shown: Vec<Detector> =
        Detector::ALL.into_iter().filter(|detector| figures.detectors.contains_key(detector.name())).collect();
    let end_s = run.scene.duration_s;
    let (mut series, mut legend) = (Vec::new(), Vec::new());
    for (index, detector) in shown.iter().enumerate() {
        let points = Shown::among(shown.len(), Mark::Dots, |see| {
            run.tests.each(|test| {
                if test.detector == *detector {
                    let ratio = libm::log10(test.statistic.max(0.0) / test.threshold);
                    see(run.time_s(test.sample), ratio.clamp(ENDS.0, ENDS.1));
                }
            })
        })?;
        series.push(Series::numbered(detector.name().to_owned(), index, points.points));
        legend.push(Series::numbered(detector.name().to_owned(), index, Vec::new()));
    }
    series.push(Series::new("threshold", GREY, Mark::Line, vec![(0.0, 0.0), (end_s, 0.0)]));
    for attack in judged.detection.attacks() {
        for sample in [attack.from, attack.to] {
            let at_s = run.time_s(sample);
            series.push(Series::new("", GREY, Mark::Dash, vec![(at_s, ENDS.0), (at_s, ENDS.1)]));
        }
    }
    legend.push(Series::new("threshold", GREY, Mark::Line, Vec::new()));
    legend.push(Series::new("beginning and end of an attack", GREY, Mark::Dash, Vec::new()));
    let x = Axis::new("time (s)", (0.0, end_s));
    let y = Axis::new("statistic over threshold", ENDS).logarithmic();
    let mut charts = vec![Chart::new("Tests", x, y, series)];
    if !judged.detection.roc.is_empty() {
        charts.push(curves(judged, &shown));
    }
    Ok(Some(Sketch::charts((WIDTH_PX, 360 * charts.len() as u32), 1, charts, legend)))
}

fn curves(judged: &Judged<'_>, shown: &[Detector]) -> Chart {
    let of = |(index, detector): (usize, &Detector)| {
        let own = judged.detection.roc.iter().filter(|point| point.detector == *detector);
        let points = own.map(|point| (libm::log10(point.false_alarm_share).max(LEAST), point.detection_share));
        let mut series = Series::numbered(detector.name().to_owned(), index, points.collect());
        series.mark = Mark::Line;
        series
    };
    let x = Axis::new("share of clean tests with an alarm", (LEAST, 0.0)).logarithmic();
    let y = Axis::new("share of attacked tests", (0.0, 1.0));
    Chart::new("ROC curves", x, y, shown.iter().enumerate().map(of).collect())
}
