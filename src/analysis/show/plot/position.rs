//! Errors of the fixes: about the truth, over time, and along the way.

use nalgebra::{Matrix2, Vector2, Vector3};

use crate::error::JudgeError;
use crate::judge::judgement::digits;
use crate::measure::errors::PositionError;
use crate::measure::spoofing;
use crate::show::plot::canvas::{Axis, BLUE, COLOURS, Chart, GREEN, GREY, Mark, ORANGE, Series, WIDTH_PX};
use crate::show::plot::chart::{Ends, SHOWN_BOUNDS, Shown};
use crate::show::plot::judged::Judged;
use crate::show::plot::sketch::Sketch;
use crate::statistics::percentile;
use gnss::earth::Geodetic;
use gnss::record::Fix;

type Points = Vec<(f64, f64)>;

/// East and north errors with the ellipses of 50 % and 95 %.
pub(super) struct Plan {
    pub chart: Chart,
    pub legend: Vec<Series>,
    /// The errors themselves.
    flat: Vec<Vector2<f64>>,
}

fn plan(judged: &Judged<'_>) -> Result<Plan, JudgeError> {
    about_truth(judged.errors.positions.map(|error| error.enu_m.xy())?)
}

/// Horizontal errors as they are drawn.
fn about_truth(flat: Vec<Vector2<f64>>) -> Result<Plan, JudgeError> {
    let fixes = Shown::of(Mark::Dots, |see| {
        flat.iter().for_each(|at| see(at.x, at.y));
        Ok::<_, JudgeError>(())
    })?;
    let mut series = vec![Series::new("fixes", BLUE, Mark::Dots, fixes.points)];
    if let Some(spread) = Spread::of(&flat) {
        for (p, colour) in [(0.5, GREEN), (0.95, ORANGE)] {
            series.push(Series::new(format!("{:.0} % ellipse", 100.0 * p), colour, Mark::Line, spread.ellipse(p)));
        }
        series.push(Series::new("mean", COLOURS[3], Mark::Cross, vec![(spread.mean.x, spread.mean.y)]));
    }
    // Without fixes there is no size, and nothing about the truth.
    let truth = if flat.is_empty() { Vec::new() } else { vec![(0.0, 0.0)] };
    series.push(Series::new("truth", COLOURS[6], Mark::Cross, truth));
    let ends = || series.iter().flat_map(|one| one.points.iter()).flat_map(|&(x, y)| [x.abs(), y.abs()]);
    let far = fixes.x.values().chain(fixes.y.values()).map(f64::abs);
    let least = if flat.is_empty() { 1.0 } else { 0.0 };
    let reach = 1.1 * ends().chain(far).fold(least, f64::max);
    let axis = |label| Axis::new(label, (-reach, reach));
    let legend = series.clone();
    let title = if flat.is_empty() { "Horizontal error: no fixes" } else { "Horizontal error" };
    let chart = Chart { equal: true, ..Chart::new(title, axis("east (m)"), axis("north (m)"), series) };
    Ok(Plan { chart, legend, flat })
}

/// The horizontal errors alone, half as wide as a page's text.
pub fn narrow(judged: &Judged<'_>) -> Result<Sketch, JudgeError> {
    Ok(plan(judged)?.narrow())
}

/// Horizontal errors of a receiver under test, half as wide as a page's text.
pub(super) fn narrow_of(east_north_m: impl Iterator<Item = (f64, f64)>) -> Result<Sketch, JudgeError> {
    Ok(chart_of(east_north_m)?.narrow())
}

/// Chart of such errors with its legend.
pub(super) fn chart_of(east_north_m: impl Iterator<Item = (f64, f64)>) -> Result<Plan, JudgeError> {
    about_truth(east_north_m.map(|(east_m, north_m)| Vector2::new(east_m, north_m)).collect())
}

impl Plan {
    fn narrow(self) -> Sketch {
        Sketch::charts((WIDTH_PX / 2, WIDTH_PX / 2), 1, [self.chart], self.legend)
    }
}

/// Horizontal errors about the truth, and the distribution of horizontal and vertical errors.
pub fn scatter(judged: &Judged<'_>) -> Result<Option<Sketch>, JudgeError> {
    let errors = &judged.errors.positions;
    let Plan { chart: cloud, mut legend, flat } = plan(judged)?;
    let least = if flat.is_empty() { 1.0 } else { 0.0 };

    let mut horizontal: Vec<f64> = flat.iter().map(|at| at.norm()).collect();
    drop(flat);
    let title = match [0.5, 0.95].map(|p| percentile(&horizontal, p)) {
        [Some(half), Some(most)] => {
            format!("Horizontal: 50 % {} m, 95 % {} m", digits(half, 3), digits(most, 3))
        }
        _ => "No fixes".to_owned(),
    };
    let across = distribution(&mut horizontal, Mark::Line);
    let mut longest = horizontal.into_iter().fold(least, f64::max);
    let mut vertical = errors.map(|error| error.enu_m.z.abs())?;
    let up = distribution(&mut vertical, Mark::Dash);
    longest = vertical.into_iter().fold(longest, f64::max);
    let distributions =
        vec![Series::new("horizontal", BLUE, Mark::Line, across), Series::new("vertical", COLOURS[3], Mark::Dash, up)];
    legend.extend(distributions.iter().cloned());
    let x = Axis::new("error (m)", (0.0, 1.02 * longest));
    let marks = [50.0, 95.0].map(|p| Series::new("", GREY, Mark::Dash, vec![(0.0, p), (1.02 * longest, p)]));
    let curves = marks.into_iter().chain(distributions).collect();
    let share = Chart::new(title, x, Axis::new("fixes below (%)", (0.0, 100.0)), curves);
    Ok(Some(Sketch::charts((WIDTH_PX, 340), 2, [cloud, share], legend)))
}

/// Mean and covariance of a cloud.
struct Spread {
    mean: Vector2<f64>,
    covariance: Matrix2<f64>,
}

impl Spread {
    /// `None` of fewer than two points.
    fn of(points: &[Vector2<f64>]) -> Option<Self> {
        let count = points.len();
        let mean = points.iter().sum::<Vector2<f64>>() / count.max(1) as f64;
        let square = |point: &Vector2<f64>| (point - mean) * (point - mean).transpose();
        let covariance = points.iter().map(square).sum::<Matrix2<f64>>() / count.checked_sub(1)? as f64;
        (count > 1).then_some(Self { mean, covariance })
    }

    /// The ellipse that holds a share `p` of a normal distribution: (x − mean)ᵀ C⁻¹ (x − mean) = −2 ln(1 −
    /// p), the quantile of χ² with two degrees of freedom.
    fn ellipse(&self, p: f64) -> Points {
        let radius = (-2.0 * libm::log1p(-p)).sqrt();
        // C = R·diag(λ)·Rᵀ in closed form.
        let (a, b, c) = (self.covariance.m11, self.covariance.m12, self.covariance.m22);
        let middle = 0.5 * (a + c);
        let reach = libm::hypot(0.5 * (a - c), b);
        let axes = [middle + reach, middle - reach].map(|lambda| radius * lambda.max(0.0).sqrt());
        let (sin, cos) = libm::sincos(0.5 * libm::atan2(2.0 * b, a - c));
        let point = |step: i32| {
            let (up, along) = libm::sincos(f64::from(2 * step).to_radians());
            let (u, v) = (axes[0] * along, axes[1] * up);
            (self.mean.x + u * cos - v * sin, self.mean.y + u * sin + v * cos)
        };
        (0..=180).map(point).collect()
    }
}

/// Percentage of the values at or below each of them, as it is drawn; they are sorted.
fn distribution(values: &mut [f64], mark: Mark) -> Points {
    values.sort_by(f64::total_cmp);
    let count = values.len().max(1) as f64;
    let shown = Shown::of(mark, |see| {
        if !values.is_empty() {
            see(0.0, 0.0);
        }
        (1..).zip(values.iter()).for_each(|(rank, value)| see(*value, 100.0 * f64::from(rank) / count));
        Ok::<_, std::convert::Infallible>(())
    });
    shown.map_or_else(|never| match never {}, |shown| shown.points)
}

/// Errors east, north, up and of the clock, between the bounds of the receiver's own covariance.
pub fn time(judged: &Judged<'_>) -> Result<Option<Sketch>, JudgeError> {
    type Of<T> = fn(&T) -> f64;
    let chart = |title: &str, of: Of<PositionError>, sigma: Of<Fix>| {
        let errors = &judged.errors.positions;
        let mark = judged.thinned_as(Mark::Dots);
        let points = Shown::of(mark, |see| errors.each(|error| see(error.time_s, of(&error))))?;
        let bounds = |see: &mut dyn FnMut(f64, f64)| {
            let mut formal = judged.run.fixes.finder()?;
            errors.each(|error| {
                if let Some(fix) = formal.get(error.sample) {
                    see(error.time_s, NORMAL_95 * sigma(&fix));
                }
            })
        };
        // Bounds of a few fixes far outside, as of the first ones, would hide the errors.
        let mut all = Vec::new();
        bounds(&mut |_, bound| all.push(bound))?;
        let most = percentile(&all, SHOWN_BOUNDS).unwrap_or(0.0);
        drop(all);
        let mut ends = points.y;
        [0.0, -most, most].into_iter().for_each(|value| ends.add(value));
        // Without fixes there is no size.
        let y = Axis::around("error (m)", ends.values(), if points.count > 0 { 0.1 } else { 2.0 });
        let x = judged.time_axis(points.x.values());
        let mut series = vec![Series::new("", GREY, Mark::Line, vec![(x.from, 0.0), (x.to, 0.0)])];
        series.push(Series::new("", BLUE, Mark::Dots, points.points));
        for sign in [-1.0, 1.0] {
            let bound = Shown::of(Mark::Line, |see| bounds(&mut |time_s, bound| see(time_s, sign * bound)))?;
            series.push(Series::new("", ORANGE, Mark::Line, bound.points));
        }
        Ok::<_, JudgeError>(Chart::new(title, x, y, series))
    };
    let charts = [
        chart("East", |error| error.enu_m.x, |fix| fix.sigma_east_m)?,
        chart("North", |error| error.enu_m.y, |fix| fix.sigma_north_m)?,
        chart("Up", |error| error.enu_m.z, |fix| fix.sigma_up_m)?,
        chart("Clock, as a distance", |error| error.clock_m, |fix| fix.sigma_clock_m)?,
    ];
    let legend = [
        Series::new("fixes", BLUE, Mark::Dots, Vec::new()),
        Series::new("±1.96 σ of the receiver's covariance", ORANGE, Mark::Line, Vec::new()),
    ];
    Ok(Some(judged.sketch((WIDTH_PX, 430), 2, charts, legend)))
}

/// Quantile of the normal distribution that leaves 2.5 % above.
const NORMAL_95: f64 = 1.959_964;

fn pass(see: &mut dyn FnMut(f64, f64), (x, y): (f64, f64)) {
    see(x, y);
}

/// Distances of the fixes from the truth and from a spoofer's claim; `None` without a spoofer.
pub fn spoofing(judged: &Judged<'_>) -> Result<Option<Sketch>, JudgeError> {
    let run = judged.run;
    let (Some(origin), false) = (run.trajectory.first(), run.claimed.is_empty()) else { return Ok(None) };
    let origin_m = origin.position_m();
    let to_enu = Geodetic::from_ecef(&origin_m).ecef_to_enu();
    let plan = |position_m: Vector3<f64>| {
        let enu = to_enu * (position_m - origin_m);
        (enu.x, enu.y)
    };
    let fixes = Shown::of(Mark::Dots, |see| run.fixes.each(|fix| pass(see, plan(fix.position_m()))))?;
    let claimed = Shown::of(Mark::Dash, |see| run.claimed.each(|row| pass(see, plan(row.position_m()))))?;
    let truth = Shown::of(Mark::Cross, |see| {
        let mut number = 0_usize;
        run.trajectory.each(|row| {
            if number.is_multiple_of(50) {
                pass(see, plan(row.position_m()));
            }
            number += 1;
        })
    })?;
    let ends = |of: fn(&Shown) -> Ends| of(&fixes).with(of(&claimed)).with(of(&truth)).values();
    let east = Axis::around("east of the start (m)", ends(|shown| shown.x), 2.0);
    let north = Axis::around("north of the start (m)", ends(|shown| shown.y), 2.0);
    let series = vec![
        Series::new("fixes", ORANGE, Mark::Dots, fixes.points),
        Series::new("claimed", GREEN, Mark::Dash, claimed.points),
        Series::new("truth", BLUE, Mark::Cross, truth.points),
    ];
    let (mut times, mut all) = (Ends::none(), Ends::none());
    let mut distance = |name: &str, colour, mark, of: fn(&spoofing::Moved) -> f64| {
        let shown = Shown::of(mark, |see| spoofing::moved(run, |fix| see(fix.time_s, of(&fix))))?;
        (times, all) = (times.with(shown.x), all.with(shown.y));
        Ok::<_, JudgeError>(Series::new(name, colour, mark, shown.points))
    };
    let distances = vec![
        distance("fix from truth", COLOURS[4], Mark::Dots, |fix| fix.from_truth_m)?,
        distance("claim from truth", COLOURS[6], Mark::Dash, |fix| fix.claim_from_truth_m)?,
        distance("fix from claim", COLOURS[3], Mark::Line, |fix| fix.from_claim_m)?,
    ];
    let y = Axis::around("distance (m)", all.values(), 1.0);
    let x = judged.time_axis(times.values());
    let legend = [series.clone(), distances.clone()].concat();
    let mut plan = Chart::new("Plan view", east, north, series);
    plan.equal = true;
    Ok(Some(Sketch::charts((WIDTH_PX, 340), 2, [plan, Chart::new("While the spoofer is on", x, y, distances)], legend)))
}

/// Horizontal path and height over time, true and found.
pub fn trajectory(judged: &Judged<'_>) -> Result<Option<Sketch>, JudgeError> {
    let run = judged.run;
    let origin_m = run.trajectory.first().map_or_else(Vector3::zeros, |row| row.position_m());
    let to_enu = Geodetic::from_ecef(&origin_m).ecef_to_enu();
    let plan = |position_m: Vector3<f64>| {
        let enu = to_enu * (position_m - origin_m);
        (enu.x, enu.y)
    };
    let height = |position_m: Vector3<f64>| Geodetic::from_ecef(&position_m).height_m;
    let pair = |truth: Shown, fixes: Shown| {
        let (x, y) = (truth.x.with(fixes.x), truth.y.with(fixes.y));
        let fixes = Series::new("fixes", ORANGE, Mark::Dots, fixes.points);
        (vec![fixes, Series::new("truth", BLUE, Mark::Line, truth.points)], x, y)
    };
    let (plans, across, along) = pair(
        Shown::of(Mark::Line, |see| run.trajectory.each(|row| pass(see, plan(row.position_m()))))?,
        Shown::of(Mark::Dots, |see| run.fixes.each(|fix| pass(see, plan(fix.position_m()))))?,
    );
    let (heights, _, up) = pair(
        Shown::of(Mark::Line, |see| run.trajectory.each(|row| see(run.time_s(row.sample), height(row.position_m()))))?,
        Shown::of(Mark::Dots, |see| run.fixes.each(|fix| see(run.time_s(fix.sample), height(fix.position_m()))))?,
    );
    let east = Axis::around("east of the start (m)", across.values(), 2.0);
    let north = Axis::around("north of the start (m)", along.values(), 2.0);
    let up = Axis::around("height above the ellipsoid (m)", up.values(), 2.0);
    let mut legend = plans.clone();
    legend.push(Series::new("start", COLOURS[6], Mark::Cross, vec![(0.0, 0.0)]));
    let mut plan = Chart::new("Plan view", east, north, legend.clone());
    plan.equal = true;
    let time = Axis::new("time (s)", (0.0, run.scene.duration_s));
    Ok(Some(Sketch::charts((WIDTH_PX, 340), 2, [plan, Chart::new("Height", time, up, heights)], legend)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_ellipse_of_95_percent_holds_95_percent_of_a_normal_cloud() {
        // A skewed normal cloud from a low-discrepancy square by Box and Muller.
        let point = |n: u32| {
            let (u, v) = ((f64::from(n) + 0.5) / 20_000.0, (f64::from(n) * 0.618_033_988_749_894_9).fract());
            let (sin, cos) = libm::sincos(std::f64::consts::TAU * v);
            let r = (-2.0 * libm::log(u)).sqrt();
            Vector2::new(3.0 + 2.0 * r * cos + 0.5 * r * sin, -1.0 + 0.7 * r * sin - 0.4 * r * cos)
        };
        let cloud: Vec<Vector2<f64>> = (0..20_000).map(point).collect();
        let spread = Spread::of(&cloud).unwrap();
        for p in [0.5, 0.95] {
            let edge = spread.ellipse(p);
            let inside = |at: &&Vector2<f64>| {
                // A convex polygon that runs anticlockwise: left of every side.
                edge.windows(2).all(|w| (w[1].0 - w[0].0) * (at.y - w[0].1) >= (w[1].1 - w[0].1) * (at.x - w[0].0))
            };
            let share = cloud.iter().filter(inside).count() as f64 / 20_000.0;
            // The points are spread more evenly than by chance, whose 3 sigma would be 0.011.
            assert!((share - p).abs() < 0.005, "{share} instead of {p}");
        }
        assert!(Spread::of(&cloud[..1]).is_none());
    }
}
