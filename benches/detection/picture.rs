//! The picture `reports/detection.png`.

use std::path::Path;

use analysis::show::plot::canvas::{Axis, Chart, GREY, Mark, Series, figure};
use gnss::record::Detector;

use super::page::{STATED, columns, detections, false_alarms, of, ratios};
use super::roc;
use super::runs::Found;
use super::scenes::{ATTACKS, Case};

/// Least share that is drawn, a common logarithm.
const LEAST: f64 = -4.0;
/// Points of a ROC curve at most.
const POINTS: usize = 400;

/// Draws false alarms, ROC curves over spoofers and over jammers, and the fall of C/N0 under jammers.
pub fn draw(path: &Path, found: &[Found]) {
    let share = Axis::new("share of clean tests with an alarm", (LEAST, 0.0)).logarithmic();
    let names = Detector::ALL.iter().enumerate().map(|(place, detector)| (at(place), detector.name().to_owned()));
    let y = Axis::new("", (0.0, Detector::ALL.len() as f64 + 1.0)).named(names.collect());
    let mut alarms = vec![Series::new(
        "stated",
        GREY,
        Mark::Line,
        vec![(libm::log10(STATED), 0.0), (libm::log10(STATED), Detector::ALL.len() as f64 + 1.0)],
    )];
    for (number, (name, is_own)) in columns().iter().enumerate() {
        let point = |(place, detector): (usize, &Detector)| {
            let own = false_alarms(&of(found, *detector, |case| is_own(case, name)))?;
            Some((libm::log10(own.value).max(LEAST), at(place)))
        };
        let points = Detector::ALL.iter().enumerate().filter_map(point).collect();
        alarms.push(Series::large((*name).to_owned(), number, points));
    }
    let legend_of = |series: &[Series]| -> Vec<Series> {
        series.iter().map(|one| Series { points: Vec::new(), ..one.clone() }).collect()
    };
    let mut legend = legend_of(&alarms);
    let alarms = Chart::new("False alarms without an attack", share.clone(), y, alarms);
    let spoofers = curves(found, |case| case.kind.jammer().is_none());
    legend.extend(legend_of(&spoofers));
    let detected = || Axis::new("share of attacked tests with an alarm", (0.0, 1.0));
    let spoofers = Chart::new("ROC curves, all spoofers", share.clone(), detected(), spoofers);
    let jammers = curves(found, |case| case.kind.jammer().is_some());
    let jammers = Chart::new("ROC curves, all jammers", share, detected(), jammers);
    let mut falls: Vec<(&str, Vec<(f64, f64)>)> = Vec::new();
    for case in &ATTACKS {
        let Some((name, js_db)) = case.kind.jammer() else { continue };
        let own = of(found, Detector::Cn0Fall, |own| own.name == case.name);
        let Some(own) = detections(&own) else { continue };
        match falls.iter_mut().find(|(known, _)| *known == name) {
            Some((_, points)) => points.push((js_db, own.value)),
            None => falls.push((name, vec![(js_db, own.value)])),
        }
    }
    let numbers = Detector::ALL.len()..;
    let lined =
        numbers.zip(falls).map(|(number, (name, points))| Series::lined(format!("cn0_fall, {name}"), number, points));
    let falls: Vec<Series> = lined.collect();
    legend.extend(legend_of(&falls));
    let falls = Chart::new("cn0_fall under jammers", Axis::new("J/S (dB)", (0.0, 30.0)), detected(), falls);
    figure(path, (1280, 1120), 2, &[alarms, spoofers, jammers, falls], &legend).unwrap();
}

/// Height of a detector, the first on top.
fn at(place: usize) -> f64 {
    (Detector::ALL.len() - place) as f64
}

/// ROC curves of all detectors over the attacks of a kind.
fn curves(found: &[Found], is_own: impl Fn(&Case) -> bool) -> Vec<Series> {
    let of = |(number, detector): (usize, &Detector)| {
        let (clean, attacked) = ratios(&of(found, *detector, |case| !case.kind.is_clean() && is_own(case)));
        let (mut points, _) = roc::curve(&clean, &attacked)?;
        // Of the shares without a false alarm the largest.
        let first = points.iter().take_while(|(clean, _)| *clean == 0.0).count();
        points.drain(..first.saturating_sub(1));
        let every = points.len().div_ceil(POINTS).max(1);
        let points = points.into_iter().enumerate().filter(|(place, point)| {
            // The left end has few points, of which none may be missing.
            point.0 < 1e-2 && place % every.div_ceil(8) == 0 || place % every == 0
        });
        let points = points.map(|(_, (clean, attacked))| (libm::log10(clean).max(LEAST), attacked)).collect();
        Some(Series::lined(detector.name().to_owned(), number, points))
    };
    Detector::ALL.iter().enumerate().filter_map(of).collect()
}
