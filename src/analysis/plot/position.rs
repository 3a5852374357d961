//! Where the fixes fell: about the truth, over time, and along the way.

use std::path::Path;

use nalgebra::Vector3;

use crate::analysis::JudgeError;
use crate::analysis::errors::PositionError;
use crate::analysis::plot::Judged;
use crate::analysis::plot::canvas::{Axis, BLUE, COLOURS, Chart, GREEN, Mark, ORANGE, Series, figure};
use crate::analysis::spoofing;
use crate::analysis::statistics::percentile;
use crate::gnss::earth::Geodetic;

type Points = Vec<(f64, f64)>;

/// East and north errors with the circles that hold half and 95 % of them.
pub fn scatter(path: &Path, judged: &Judged<'_>) -> Result<(), JudgeError> {
    let errors = &judged.errors.positions;
    let distances: Vec<f64> = errors.iter().map(|error| libm::hypot(error.enu_m.x, error.enu_m.y)).collect();
    let mut series = vec![Series::new(
        "fixes",
        BLUE,
        Mark::Dots,
        errors.iter().map(|error| (error.enu_m.x, error.enu_m.y)).collect(),
    )];
    for (p, colour) in [(0.5, GREEN), (0.95, ORANGE)] {
        if let Some(radius_m) = percentile(&distances, p) {
            let name = format!("{:.0} %: {radius_m:.2} m", 100.0 * p);
            series.push(Series::new(name, colour, Mark::Line, circle(radius_m)));
        }
    }
    if let Some([east_m, north_m, _]) = judged.summary.position.bias_enu_m {
        series.push(Series::new("mean", COLOURS[3], Mark::Cross, vec![(east_m, north_m)]));
    }
    series.push(Series::new("truth", COLOURS[6], Mark::Cross, vec![(0.0, 0.0)]));
    let reach = 1.1 * distances.iter().copied().fold(0.05, f64::max);
    let axis = |label| Axis::new(label, (-reach, reach));
    let legend = series.clone();
    let mut chart = Chart::new("Horizontal error of the fixes", axis("east (m)"), axis("north (m)"), series);
    chart.equal = true;
    figure(path, (860, 720), 1, &[chart], &legend)
}

fn circle(radius: f64) -> Points {
    let point = |step: i32| {
        let (sin, cos) = libm::sincos(f64::from(step).to_radians() * 2.0);
        (radius * cos, radius * sin)
    };
    (0..=180).map(point).collect()
}

/// Errors east, north, up and of the clock.
pub fn time(path: &Path, judged: &Judged<'_>) -> Result<(), JudgeError> {
    let chart = |index: usize, title: &str, of: &dyn Fn(&PositionError) -> f64| {
        let points: Points = judged.errors.positions.iter().map(|error| (error.time_s, of(error))).collect();
        let y = Axis::around("error (m)", points.iter().map(|p| p.1).chain([0.0]), 0.1);
        let x = judged.time_axis(points.iter().map(|p| p.0));
        let zero = Series::new("", COLOURS[6], Mark::Line, vec![(x.from, 0.0), (x.to, 0.0)]);
        let fixes = Series::new("", COLOURS[index % COLOURS.len()], Mark::Dots, points);
        Chart::new(title, x, y, vec![zero, fixes])
    };
    let charts = [
        chart(0, "East", &|error| error.enu_m.x),
        chart(1, "North", &|error| error.enu_m.y),
        chart(2, "Up", &|error| error.enu_m.z),
        chart(3, "Clock (speed of light times the error of time)", &|error| error.clock_m),
    ];
    figure(path, (1100, 720), 2, &charts, &[])
}

/// Where the fixes went between the truth and what a spoofer claims; nothing without one.
pub fn spoofing(path: &Path, judged: &Judged<'_>) -> Result<(), JudgeError> {
    let run = judged.run;
    let (Some(origin), false) = (run.trajectory.first(), run.claimed.is_empty()) else { return Ok(()) };
    let origin_m = origin.position_m();
    let to_enu = Geodetic::from_ecef(&origin_m).ecef_to_enu();
    let plan = |position_m: Vector3<f64>| {
        let enu = to_enu * (position_m - origin_m);
        (enu.x, enu.y)
    };
    let series = vec![
        Series::new("fixes", ORANGE, Mark::Dots, run.fixes.iter().map(|fix| plan(fix.position_m())).collect()),
        Series::new("claimed", GREEN, Mark::Dash, run.claimed.iter().map(|row| plan(row.position_m())).collect()),
        Series::new(
            "truth",
            BLUE,
            Mark::Cross,
            run.trajectory.iter().step_by(50).map(|row| plan(row.position_m())).collect(),
        ),
    ];
    let values =
        |of: fn(&(f64, f64)) -> f64| series.iter().flat_map(move |one| one.points.iter().map(of)).collect::<Vec<_>>();
    let east = Axis::around("east of the start (m)", values(|p| p.0).into_iter(), 2.0);
    let north = Axis::around("north of the start (m)", values(|p| p.1).into_iter(), 2.0);
    let moved = spoofing::moved(run);
    let distance = |name: &str, colour, mark, of: fn(&spoofing::Moved) -> f64| {
        Series::new(name, colour, mark, moved.iter().map(|fix| (fix.time_s, of(fix))).collect())
    };
    let distances = vec![
        distance("fix from truth", ORANGE, Mark::Dots, |fix| fix.from_truth_m),
        distance("claim from truth", GREEN, Mark::Dash, |fix| fix.claim_from_truth_m),
        distance("fix from claim", COLOURS[3], Mark::Line, |fix| fix.from_claim_m),
    ];
    let y = Axis::around("distance (m)", distances.iter().flat_map(|one| one.points.iter().map(|p| p.1)), 1.0);
    let x = judged.time_axis(moved.iter().map(|fix| fix.time_s));
    let legend = [series.clone(), distances.clone()].concat();
    let mut plan = Chart::new("Plan view", east, north, series);
    plan.equal = true;
    figure(path, (1300, 560), 2, &[plan, Chart::new("While the spoofer is on", x, y, distances)], &legend)
}

/// The way in plan and its height over time, as it was and as found.
pub fn trajectory(path: &Path, judged: &Judged<'_>) -> Result<(), JudgeError> {
    let run = judged.run;
    let origin_m = run.trajectory.first().map_or_else(Vector3::zeros, |row| row.position_m());
    let to_enu = Geodetic::from_ecef(&origin_m).ecef_to_enu();
    let plan = |position_m: Vector3<f64>| {
        let enu = to_enu * (position_m - origin_m);
        (enu.x, enu.y)
    };
    let height = |position_m: Vector3<f64>| Geodetic::from_ecef(&position_m).height_m;
    let pair = |truth: Points, fixes: Points| {
        vec![Series::new("fixes", ORANGE, Mark::Dots, fixes), Series::new("truth", BLUE, Mark::Line, truth)]
    };
    let plans = pair(
        run.trajectory.iter().map(|row| plan(row.position_m())).collect(),
        run.fixes.iter().map(|fix| plan(fix.position_m())).collect(),
    );
    let heights = pair(
        run.trajectory.iter().map(|row| (run.time_s(row.sample), height(row.position_m()))).collect(),
        run.fixes.iter().map(|fix| (run.time_s(fix.sample), height(fix.position_m()))).collect(),
    );
    let values = |series: &[Series], of: fn(&(f64, f64)) -> f64| -> Vec<f64> {
        series.iter().flat_map(|series| series.points.iter().map(of)).collect()
    };
    let east = Axis::around("east of the start (m)", values(&plans, |p| p.0).into_iter(), 2.0);
    let north = Axis::around("north of the start (m)", values(&plans, |p| p.1).into_iter(), 2.0);
    let up = Axis::around("height above the ellipsoid (m)", values(&heights, |p| p.1).into_iter(), 2.0);
    let mut legend = plans.clone();
    legend.push(Series::new("start", COLOURS[6], Mark::Cross, vec![(0.0, 0.0)]));
    let mut plan = Chart::new("Plan view", east, north, legend.clone());
    plan.equal = true;
    let time = Axis::new("time (s)", (0.0, run.scene.duration_s));
    figure(path, (1300, 560), 2, &[plan, Chart::new("Height", time, up, heights)], &legend)
}
