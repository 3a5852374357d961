//! Loops and observations over time, satellite by satellite.

use crate::error::JudgeError;
use crate::judge::rules::OBSERVATIONS;
use crate::measure::errors::{Link, SignalError};
use crate::show::plot::canvas::{Axis, Chart, Mark, Series, WIDTH_PX};
use crate::show::plot::chart::{Ends, Shown};
use crate::show::plot::judged::{Detail, Judged};
use crate::show::plot::sketch::Sketch;
use crate::statistics::ranked;
use gnss::record::TrackingRow;

/// Function that takes points one after the other.
pub(super) type See<'a> = &'a mut dyn FnMut(f64, f64);

/// Labels of a chart of one kind of value, and the least span of its axis.
pub(super) struct Frame<'a> {
    pub title: &'a str,
    pub y_label: &'a str,
    pub least: f64,
}

/// Values by which an axis is chosen: enough to resolve a thousandth of them.
const MOST_VALUES: usize = 1 << 16;

/// Points of all satellites, as many as are drawn, in a frame that holds most of them.
pub(super) struct Cloud {
    pub y: Axis,
    pub series: Vec<Series>,
    /// Least abscissa.
    pub first_x: f64,
    pub total: usize,
    /// Points beyond the axis.
    pub outside: usize,
}

impl Cloud {
    /// Asks three times for the points of each satellite, so that none are held but those that are drawn: for
    /// the axis, for how many there are, and to keep some.
    pub fn new(
        judged: &Judged<'_>,
        links: &[Link],
        frame: &Frame<'_>,
        points: impl Fn(Link, See<'_>) -> Result<(), JudgeError>,
    ) -> Result<Self, JudgeError> {
        let (mut values, mut total, mut stride, mut first_x) = (Vec::new(), 0, 1, f64::INFINITY);
        for link in links {
            points(*link, &mut |x, y| {
                first_x = first_x.min(x);
                if !y.is_finite() {
                    return;
                }
                if total % stride == 0 {
                    values.push(y);
                }
                total += 1;
                if values.len() == MOST_VALUES {
                    // Every other one stays, and comes from now on.
                    let mut place = 0;
                    values.retain(|_| {
                        place += 1;
                        place % 2 == 1
                    });
                    stride *= 2;
                }
            })?;
        }
        values.sort_by(f64::total_cmp);
        // Pull-in may be far outside; the axis shows what holds most of the time.
        let [low, high] = [0.002, 0.998].map(|p| ranked(&values, p).unwrap_or(0.0));
        drop(values);
        let y = Axis::around(frame.y_label, [low, high].into_iter(), frame.least.max(1.3 * (high - low)));
        let (mut series, mut inside) = (Vec::new(), 0);
        for (index, link) in links.iter().enumerate() {
            let mut one = Series::numbered(judged.run.name(*link), index, Vec::new());
            // A screen that magnifies may look beyond the axis.
            let all = judged.detail == Detail::Screen;
            let shown = Shown::among(links.len(), judged.thinned_as(one.mark), |see| {
                points(*link, &mut |at, value| {
                    if all || (y.from..=y.to).contains(&value) {
                        see(at, value);
                    }
                })
            })?;
            inside += shown.count;
            one.points = shown.points;
            series.push(one);
        }
        Ok(Self { y, series, first_x, total, outside: total - inside })
    }
}

/// One chart of something over time with a series a satellite.
pub(super) fn over_time(
    judged: &Judged<'_>,
    links: &[Link],
    frame: &Frame<'_>,
    points: impl Fn(Link, See<'_>) -> Result<(), JudgeError>,
) -> Result<Chart, JudgeError> {
    let Cloud { y, series, first_x, total, outside } = Cloud::new(judged, links, frame, points)?;
    let title = frame.title;
    let title = if outside > 0 { format!("{title} ({outside} of {total} points outside)") } else { title.to_owned() };
    Ok(Chart::new(title, judged.time_axis(std::iter::once(first_x)), y, series))
}

/// Satellites by their marks.
pub(super) fn legend(judged: &Judged<'_>, links: &[Link]) -> Vec<Series> {
    let one = |(index, link): (usize, &Link)| Series::numbered(judged.run.name(*link), index, Vec::new());
    links.iter().enumerate().map(one).collect()
}

/// Raw discriminators of the three loops; `None` of a receiver without loops.
pub fn discriminators(judged: &Judged<'_>) -> Result<Option<Sketch>, JudgeError> {
    let run = judged.run;
    if run.scene.fidelity == OBSERVATIONS {
        return Ok(None);
    }
    let links: Vec<Link> = run.tracking.keys().collect();
    let chart = |title, y_label, least, of: fn(&TrackingRow) -> f64| {
        over_time(judged, &links, &Frame { title, y_label, least }, |link, see| {
            run.tracking.each(link, |row| see(run.time_s(row.sample), of(&row)))
        })
    };
    let charts = [
        chart("DLL discriminator", "output (chips)", 0.02, |row| row.dll_discriminator_chips)?,
        chart("PLL discriminator", "output (degrees)", 2.0, |row| row.pll_discriminator_cycles * 360.0)?,
        chart("FLL discriminator", "output (Hz)", 2.0, |row| row.fll_discriminator_hz)?,
    ];
    Ok(Some(Sketch::charts((WIDTH_PX, 540), 1, charts, legend(judged, &links))))
}

/// Satellites that were observed.
pub(super) fn observed(judged: &Judged<'_>) -> Vec<Link> {
    judged.errors.signals.keys().collect()
}

/// One number of a satellite's observations over time.
pub(super) fn of_observations(
    judged: &Judged<'_>,
    link: Link,
    of: impl Fn(&SignalError) -> f64,
    see: See<'_>,
) -> Result<(), JudgeError> {
    judged.errors.signals.each(link, |row| see(row.time_s, of(&row)))
}

/// C/N0 over time as measured and as expected, and the means side by side.
pub fn cn0(judged: &Judged<'_>) -> Result<Option<Sketch>, JudgeError> {
    let links = observed(judged);
    // The C/N0 that a scene sets is at the antenna: front end and interference take their part.
    let stated = &judged.summary.details.stated;
    let reference = |link: Link, row: &SignalError| stated.expected_dbhz(link, row.cn0_effective_dbhz);
    let chart = |title: &str, y_label, least, of: &dyn Fn(Link, &SignalError) -> f64| {
        over_time(judged, &links, &Frame { title, y_label, least }, |link, see| {
            of_observations(judged, link, |row| of(link, row), see)
        })
    };
    let title = "C/N0 as measured (points) and as expected (lines)";
    let mut above = chart(title, "C/N0 (dB-Hz)", 4.0, &|_, row| row.cn0_dbhz)?;
    let mut all = Ends::none();
    for (index, link) in links.iter().enumerate() {
        of_observations(judged, *link, |row| row.cn0_dbhz, &mut |_, dbhz| all.add(dbhz))?;
        let shown = Shown::among(links.len(), Mark::Line, |see| {
            of_observations(judged, *link, |row| reference(*link, row), see)
        })?;
        all = all.with(shown.y);
        let mut line = Series::numbered(judged.run.name(*link), index, shown.points);
        line.mark = Mark::Line;
        above.series.push(line);
    }
    above.y = Axis::around("C/N0 (dB-Hz)", all.values(), 4.0);
    let title = "C/N0 measured minus expected";
    let below = chart(title, "difference (dB)", 1.0, &|link, row| row.cn0_dbhz - reference(link, row))?;
    let mut charts = vec![above, below];
    if judged.detail == Detail::Screen {
        charts.push(elevations(judged, &links)?);
    }
    Ok(Some(judged.sketch((WIDTH_PX, 430), 1, charts, legend(judged, &links))))
}

/// Elevations of the satellites over time.
fn elevations(judged: &Judged<'_>, links: &[Link]) -> Result<Chart, JudgeError> {
    let frame = Frame { title: "Elevation", y_label: "elevation (degrees)", least: 4.0 };
    over_time(judged, links, &frame, |link, see| {
        let places = judged.run.seen(link.sv, |row| (judged.run.time_s(row.sample), row.elevation_deg))?;
        places.into_iter().for_each(|(time_s, elevation_deg)| see(time_s, elevation_deg));
        Ok(())
    })
}

/// Errors of code, carrier and Doppler.
pub fn observables(judged: &Judged<'_>) -> Result<Option<Sketch>, JudgeError> {
    let links = observed(judged);
    let chart = |title, y_label, least, of: fn(&SignalError) -> f64| {
        over_time(judged, &links, &Frame { title, y_label, least }, |link, see| of_observations(judged, link, of, see))
    };
    let charts = [
        chart("Code error", "error (m)", 0.1, |row| row.code_m)?,
        chart("Carrier error, a constant removed from each arc", "error (cycles)", 0.01, |row| row.carrier_cycles)?,
        chart("Doppler error", "error (Hz)", 0.1, |row| row.doppler_hz)?,
    ];
    Ok(Some(judged.sketch((WIDTH_PX, 540), 1, charts, legend(judged, &links))))
}
