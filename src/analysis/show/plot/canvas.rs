//! Charts drawn by plotters with the bundled font: what every picture is made of.
//!
//! Sizes are chosen for print: a picture [`WIDTH_PX`] wide fills the text width of an A4 page and its
//! smallest words are then above 6 points. Every size that plotters would choose is set here, for [`FINE`]
//! virtual pixels in one. No system font, no C library: a fresh machine draws the same picture.

use std::path::Path;

use plotters::chart::LabelAreaPosition;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use crate::error::JudgeError;
use crate::show::plot::chart::LIGHT;
pub use crate::show::plot::chart::{
    Axis, BLUE, COLOURS, Chart, GREEN, GREY, Mark, ORANGE, Scale, Series, Shape, WIDTH_PX,
};
use crate::show::plot::clip::Frame;
pub use crate::show::plot::drawing::{Area, Drawing, FINE, Failure};
use crate::show::plot::names::{self, Name};
use crate::show::plot::series;
use crate::show::plot::ticks::{Tick, Ticks};

/// Draws charts, `columns` a row, with one legend below all of them, into a picture of that size: a PNG, or
/// an SVG where the file is named so.
///
/// # Errors
/// [`JudgeError::Plot`] or [`JudgeError::File`] with the path.
pub fn figure(
    path: &Path,
    size: (u32, u32),
    columns: usize,
    charts: &[Chart],
    legend: &[Series],
) -> Result<(), JudgeError> {
    let failed = |error: Failure| JudgeError::Plot { path: path.to_owned(), reason: error.to_string() };
    let drawing = compose(size, columns, charts, legend).map_err(failed)?;
    if path.extension().is_some_and(|extension| extension == "svg") {
        return crate::show::write::write_whole(path, drawing.svg.as_bytes());
    }
    drawing.write_png(path, 1.0)
}

/// Draws charts, `columns` a row, with one legend below all of them.
///
/// # Errors
/// Errors of the drawing library.
pub fn compose(
    (width, height): (u32, u32),
    columns: usize,
    charts: &[Chart],
    legend: &[Series],
) -> Result<Drawing, Failure> {
    Drawing::new((width, height), |area| {
        let entries = placed(area, legend, width as i32)?;
        let legend_px = entries.last().map_or(0, |(_, row, _)| (row + 1) * LEGEND_ROW_PX + 8);
        let (plots, below) = area.split_vertically((height as i32 - legend_px) * FINE);
        let rows = charts.len().div_ceil(columns).max(1);
        for (chart, cell) in charts.iter().zip(plots.split_evenly((rows, columns))) {
            draw(&cell, chart)?;
        }
        entries.iter().try_for_each(|&(x, row, series)| draw_entry(&below, x, row * LEGEND_ROW_PX, series))
    })
}

/// A font of that many pixels.
pub fn font(pixels: i32) -> TextStyle<'static> {
    ("sans-serif", pixels * FINE).into_font().color(&RGBColor(30, 30, 30))
}

/// Font of that many pixels, anchored to its point as given.
pub fn anchored(pixels: i32, horizontal: HPos, vertical: VPos) -> TextStyle<'static> {
    font(pixels).pos(Pos::new(horizontal, vertical))
}

/// Free space around a chart: plotters hangs an axis label on the very edge of its area.
const EDGE_PX: i32 = 6;
const LEFT_PX: i32 = 74;
const RIGHT_PX: i32 = 24;
const TOP_PX: i32 = 26;
const BOTTOM_PX: i32 = 38;
/// Distance in pixels from a name beside an axis to the outer edge, which holds the axis' words.
const WORDS_PX: i32 = 30;
/// Size of a tick's label, and the smallest of a name.
const LABEL_PX: i32 = 12;
const LEAST_LABEL_PX: i32 = 6;
/// Number of names up to which all are written, however small; of more, every second or third has a label.
const MANY_NAMES: usize = 24;
/// Size of a point's name.
const NAME_PX: i32 = 11;
/// Least distance in pixels from one label to the next.
const APART_PX: i32 = 8;
const TICK_PX: i32 = 5;

/// Draws one chart into an area.
pub fn draw(area: &Area<'_>, chart: &Chart) -> Result<(), Failure> {
    let (width, height) = area.dim_in_pixel();
    let (width_px, height_px) = (width as i32 / FINE, height as i32 / FINE);
    title(area, &chart.title, width)?;
    let (mut x, mut y) = (chart.x.clone(), chart.y.clone());
    let left_px = left_of(area, &y)?.min(width_px / 2);
    let across_px = (width_px - left_px - RIGHT_PX - EDGE_PX).max(1);
    let up_px = (height_px - TOP_PX - BOTTOM_PX - EDGE_PX).max(1);
    if chart.equal {
        let per_pixel = (x.span() / f64::from(across_px)).max(y.span() / f64::from(up_px));
        widen(&mut x, per_pixel * f64::from(across_px));
        widen(&mut y, per_pixel * f64::from(up_px));
    }
    let is_empty = chart.series.iter().all(|series| series.points.is_empty());
    let (across, across_label_px) = ticks_across(area, &x, (left_px + EDGE_PX, across_px, width_px))?;
    let (up, up_label_px) = ticks_up(&y, up_px);
    let mut context = ChartBuilder::on(area)
        .margin_top(TOP_PX * FINE)
        .margin_right(RIGHT_PX * FINE)
        .margin_left(EDGE_PX * FINE)
        .margin_bottom(EDGE_PX * FINE)
        .set_label_area_size(LabelAreaPosition::Left, left_px * FINE)
        .set_label_area_size(LabelAreaPosition::Bottom, BOTTOM_PX * FINE)
        .build_cartesian_2d(x.from..x.to, y.from..y.to)?;
    context
        .configure_mesh()
        .disable_mesh()
        .axis_style(GREY.stroke_width(FINE as u32))
        .x_labels(0)
        .y_labels(0)
        .set_all_tick_mark_size(0)
        .x_desc(words(&x, &across))
        .y_desc(words(&y, &up))
        .axis_desc_style(font(13))
        .draw()?;
    let (from_left, from_top) = area.get_base_pixel();
    let at = |point: (f64, f64)| {
        let (pixel_x, pixel_y) = context.plotting_area().map_coordinate(&point);
        (pixel_x - from_left, pixel_y - from_top)
    };
    // Of nothing there is no size, so that its axes have no numbers.
    let ticks = |ticks: &Ticks| if is_empty { Vec::new() } else { ticks.ticks.clone() };
    for Tick { at: place, label } in ticks(&across) {
        let (foot, head) = (at((place, y.from)), at((place, y.to)));
        tick(area, [foot, head], (0, tick_px(&x)))?;
        let style = anchored(across_label_px, HPos::Center, VPos::Top);
        area.draw(&Text::new(label, (foot.0, foot.1 + 8 * FINE), style))?;
    }
    for Tick { at: place, label } in ticks(&up) {
        let (foot, head) = (at((x.from, place)), at((x.to, place)));
        tick(area, [foot, head], (-tick_px(&y), 0))?;
        let style = anchored(up_label_px, HPos::Right, VPos::Center);
        area.draw(&Text::new(label, (foot.0 - 8 * FINE, foot.1), style))?;
    }
    let corners = [(x.from, y.to), (x.from, y.from), (x.to, y.from)].map(at);
    area.draw(&PathElement::new(corners, GREY.stroke_width(FINE as u32)))?;
    let inside = [corners[0], corners[2]];
    let mut names = Vec::new();
    for (point, name, above_px) in &chart.labels {
        let (width, height) = area.estimate_text_size(name, &anchored(NAME_PX, HPos::Left, VPos::Center))?;
        names.push(Name { at: at(*point), above: above_px * FINE, size: (width as i32, height as i32) });
    }
    let positions = names::apart(&names, inside);
    let middle = at((0.5 * (x.from + x.to), y.from + 0.62 * y.span()));
    let frame = Frame::new(x.ends(), y.ends());
    for series in &chart.series {
        series::draw(&mut context, &frame, series)?;
    }
    for ((_, name, _), position) in chart.labels.iter().zip(positions) {
        area.draw(&Text::new(name.clone(), position, anchored(NAME_PX, HPos::Left, VPos::Center)))?;
    }
    if is_empty {
        let style = anchored(13, HPos::Center, VPos::Center).color(&GREY);
        area.draw(&Text::new("no data", middle, style))?;
    }
    Ok(())
}

/// Words beside an axis, with what its labels count from.
fn words(axis: &Axis, ticks: &Ticks) -> String {
    match &ticks.offset {
        Some(offset) => format!("{}, counted from {offset}", axis.label),
        None => axis.label.clone(),
    }
}

/// Length of an axis' ticks; names have none.
fn tick_px(axis: &Axis) -> i32 {
    if matches!(axis.scale, Scale::Named(_)) { 0 } else { TICK_PX }
}

/// A line of the grid from its foot on, and a tick outward from there, in pixels.
fn tick(area: &Area<'_>, [foot, head]: [(i32, i32); 2], (x_px, y_px): (i32, i32)) -> Result<(), Failure> {
    area.draw(&PathElement::new([foot, head], LIGHT.stroke_width(FINE as u32)))?;
    let end = (foot.0 + x_px * FINE, foot.1 + y_px * FINE);
    area.draw(&PathElement::new([foot, end], GREY.stroke_width(FINE as u32)))?;
    Ok(())
}

/// Words above a chart, as large as fits.
fn title(area: &Area<'_>, words: &str, width: u32) -> Result<(), Failure> {
    let room = width.saturating_sub(2 * (EDGE_PX * FINE) as u32);
    let (wide, _) = area.estimate_text_size(words, &font(14))?;
    let pixels = if wide > room { (14 * room / wide.max(1)).max(LEAST_LABEL_PX as u32 + 2) as i32 } else { 14 };
    let style = anchored(pixels, HPos::Center, VPos::Center);
    area.draw(&Text::new(words.to_owned(), (width as i32 / 2, TOP_PX * FINE / 2), style))?;
    Ok(())
}

fn width_px(area: &Area<'_>, text: &str, size_px: i32) -> Result<f64, Failure> {
    let (fine_px, _) = area.estimate_text_size(text, &font(size_px))?;
    Ok(f64::from(fine_px) / f64::from(FINE))
}

/// Width of the labels beside an axis with the axis' words; names have what they need.
fn left_of(area: &Area<'_>, y: &Axis) -> Result<i32, Failure> {
    let Scale::Named(names) = &y.scale else { return Ok(LEFT_PX) };
    let mut widest = 0.0_f64;
    for (_, name) in names {
        widest = widest.max(width_px(area, name, 11)?);
    }
    Ok((libm::ceil(widest) as i32 + WORDS_PX).max(LEFT_PX))
}

/// Ticks along an axis of that left end and length, as many as fit beside each other, and the size of their
/// labels; names become smaller where they would overlap.
fn ticks_across(
    area: &Area<'_>,
    x: &Axis,
    (left_px, across_px, width_px): (i32, i32, i32),
) -> Result<(Ticks, i32), Failure> {
    let per_unit = f64::from(across_px) / x.span();
    let place = |tick: &Tick| f64::from(left_px) + (tick.at - x.from) * per_unit;
    // Whether no label touches the next one or the edge.
    let fits = |ticks: &[Tick], size_px: i32, apart_px: f64| {
        let mut free_from = 0.0;
        for tick in ticks {
            let half = 0.5 * self::width_px(area, &tick.label, size_px)?;
            if place(tick) - half < free_from || place(tick) + half > f64::from(width_px) {
                return Ok(false);
            }
            free_from = place(tick) + half + apart_px;
        }
        Ok::<_, Failure>(true)
    };
    if matches!(x.scale, Scale::Named(_)) {
        let names = x.ticks(0);
        let least_px = if names.ticks.len() > MANY_NAMES { LEAST_LABEL_PX + 3 } else { LEAST_LABEL_PX };
        for size_px in (least_px..=LABEL_PX - 1).rev() {
            if fits(&names.ticks, size_px, 0.3 * f64::from(size_px))? {
                return Ok((names, size_px));
            }
        }
        // Many names, as numbers of satellites, are fewer sooner than unreadable.
        let fewer = if names.ticks.len() > MANY_NAMES { 2..names.ticks.len() } else { 0..0 };
        for every in fewer {
            let ticks: Vec<Tick> = names.ticks.iter().step_by(every).cloned().collect();
            if fits(&ticks, LEAST_LABEL_PX + 3, 0.3 * f64::from(LEAST_LABEL_PX))? {
                return Ok((Ticks { ticks, offset: None }, LEAST_LABEL_PX + 3));
            }
        }
        return Ok((names, LEAST_LABEL_PX));
    }
    for most in (2..=10).rev() {
        let mut ticks = x.ticks(most);
        for outside in [ticks.ticks.len().wrapping_sub(1), 0] {
            // A label at an end gives way where others stay.
            if ticks.ticks.len() > 2
                && let Some(end) = ticks.ticks.get(outside)
                && !fits(std::slice::from_ref(end), LABEL_PX, 0.0)?
            {
                ticks.ticks.remove(outside);
            }
        }
        if ticks.ticks.len() >= 2 && fits(&ticks.ticks, LABEL_PX, f64::from(APART_PX))? {
            return Ok((ticks, LABEL_PX));
        }
    }
    // Of a few ticks that are too near each other every second one, or every third, and so on.
    let few = x.ticks(2);
    let count = few.ticks.len();
    for size_px in [LABEL_PX, LEAST_LABEL_PX + 2] {
        for (stride, start) in (1..count.max(2)).flat_map(|stride| (0..stride).map(move |start| (stride, start))) {
            let ticks: Vec<Tick> = few.ticks.iter().skip(start).step_by(stride).cloned().collect();
            if ticks.len() >= 2 && fits(&ticks, size_px, 0.3 * f64::from(size_px))? {
                return Ok((Ticks { ticks, offset: few.offset.clone() }, size_px));
            }
        }
    }
    Ok((few, LEAST_LABEL_PX))
}

/// Ticks up an axis of that length, as many as fit above each other, and the size of their labels.
fn ticks_up(y: &Axis, up_px: i32) -> (Ticks, i32) {
    let per_unit = f64::from(up_px) / y.span();
    let apart_px = |ticks: &[Tick]| {
        let steps = ticks.windows(2).map(|pair| match pair {
            [low, high] => (high.at - low.at).abs() * per_unit,
            _ => f64::INFINITY,
        });
        steps.fold(f64::INFINITY, f64::min)
    };
    if matches!(y.scale, Scale::Named(_)) {
        let names = y.ticks(0);
        let size_px = (apart_px(&names.ticks) / 1.2).clamp(f64::from(LEAST_LABEL_PX), 11.0) as i32;
        return (names, size_px);
    }
    let mut all = (2..=(up_px / 18).clamp(2, 12) as usize).rev().map(|most| y.ticks(most));
    let fitting = all.find(|ticks| apart_px(&ticks.ticks) >= f64::from(LABEL_PX));
    let ends = || {
        let mut few = y.ticks(2);
        let last = few.ticks.len().saturating_sub(1);
        if last > 1 {
            few.ticks.drain(1..last);
        }
        few
    };
    (fitting.unwrap_or_else(ends), LABEL_PX)
}

const LEGEND_ROW_PX: i32 = 20;
/// Distance from a mark's left end to its name, pixels.
const MARK_PX: i32 = 24;
/// Distance from a name's end to the next mark, pixels.
const GAP_PX: i32 = 18;

/// Positions of the named series of a legend: its left end, its row, itself. Rows are as long as the picture
/// is wide.
fn placed<'a>(area: &Area<'_>, legend: &'a [Series], width_px: i32) -> Result<Vec<(i32, i32, &'a Series)>, Failure> {
    let (mut x, mut row) = (LEFT_PX + EDGE_PX, 0);
    let mut entries = Vec::new();
    for series in legend.iter().filter(|series| !series.name.is_empty()) {
        let (fine_px, _) = area.estimate_text_size(&series.name, &font(12))?;
        let length_px = MARK_PX + fine_px as i32 / FINE;
        if x + length_px > width_px - RIGHT_PX && x > LEFT_PX + EDGE_PX {
            (x, row) = (LEFT_PX + EDGE_PX, row + 1);
        }
        entries.push((x, row, series));
        x += length_px + GAP_PX;
    }
    Ok(entries)
}

/// A series' mark and name.
fn draw_entry(area: &Area<'_>, x_px: i32, y_px: i32, series: &Series) -> Result<(), Failure> {
    let y = (y_px + LEGEND_ROW_PX / 2) * FINE;
    let (x, end) = (x_px * FINE, (x_px + 18) * FINE);
    let thick = series.colour.stroke_width(2 * FINE as u32);
    let middle = ((x + end) / 2, y);
    match series.mark {
        Mark::Line => area.draw(&PathElement::new([(x, y), (end, y)], thick))?,
        Mark::Dash => {
            area.draw(&PathElement::new([(x, y), (x + 7 * FINE, y)], thick))?;
            area.draw(&PathElement::new([(end - 7 * FINE, y), (end, y)], thick))?;
        }
        Mark::Dashes(on_px, off_px) => {
            let starts = (x..end).step_by(((on_px + off_px) * FINE).max(1) as usize);
            for start in starts {
                area.draw(&PathElement::new([(start, y), ((start + on_px * FINE).min(end), y)], thick))?;
            }
        }
        Mark::Small(shape) | Mark::Large(shape) => series::outline(area, middle, (shape, 9 * FINE / 2), series.colour)?,
        Mark::Dots | Mark::Balls => area.draw(&Circle::new(middle, 4 * FINE, series.colour.filled()))?,
        Mark::Rings => area.draw(&Circle::new(middle, 4 * FINE, thick))?,
        Mark::Cross => area.draw(&plotters::element::Cross::new(middle, 5 * FINE, thick))?,
        Mark::Band => {
            let pale = series.colour.mix(0.2).filled();
            area.draw(&Rectangle::new([(x, y - 5 * FINE), (end, y + 5 * FINE)], pale))?;
        }
        Mark::Bars(_) | Mark::Tile(..) => {
            area.draw(&Rectangle::new([(x, y - 5 * FINE), (end, y + 5 * FINE)], series.colour.filled()))?;
        }
    }
    let style = anchored(12, HPos::Left, VPos::Center);
    area.draw(&Text::new(series.name.clone(), (x + MARK_PX * FINE, y), style))?;
    Ok(())
}

fn widen(axis: &mut Axis, span: f64) {
    let middle = (axis.from + axis.to) / 2.0;
    (axis.from, axis.to) = (middle - span / 2.0, middle + span / 2.0);
}

#[cfg(test)]
mod tests;
