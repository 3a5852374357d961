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
pub use crate::show::plot::chart::{Axis, BLUE, COLOURS, Chart, GREEN, GREY, Mark, ORANGE, Series, WIDTH_PX};
use crate::show::plot::chart::{LIGHT, drawn};
pub use crate::show::plot::drawing::{Area, Drawing, FINE, Failure};

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
/// Whatever the drawing library reports.
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
const RIGHT_PX: i32 = 16;
const TOP_PX: i32 = 26;
const BOTTOM_PX: i32 = 38;

/// Draws one chart into an area.
pub fn draw(area: &Area<'_>, chart: &Chart) -> Result<(), Failure> {
    let (width, height) = area.dim_in_pixel();
    let title = anchored(14, HPos::Center, VPos::Center);
    area.draw(&Text::new(chart.title.clone(), (width as i32 / 2, TOP_PX * FINE / 2), title))?;
    let (mut x, mut y) = (chart.x.clone(), chart.y.clone());
    if chart.equal {
        let across = f64::from(width as i32 - (LEFT_PX + RIGHT_PX + EDGE_PX) * FINE).max(1.0);
        let up = f64::from(height as i32 - (TOP_PX + BOTTOM_PX + EDGE_PX) * FINE).max(1.0);
        let per_pixel = (x.span() / across).max(y.span() / up);
        widen(&mut x, per_pixel * across);
        widen(&mut y, per_pixel * up);
    }
    let mut context = ChartBuilder::on(area)
        .margin_top(TOP_PX * FINE)
        .margin_right(RIGHT_PX * FINE)
        .margin_left(EDGE_PX * FINE)
        .margin_bottom(EDGE_PX * FINE)
        .set_label_area_size(LabelAreaPosition::Left, LEFT_PX * FINE)
        .set_label_area_size(LabelAreaPosition::Bottom, BOTTOM_PX * FINE)
        .build_cartesian_2d(x.from..x.to, y.from..y.to)?;
    // As many as fit side by side, a digit being 7 pixels wide at most.
    let finest = decimals(x.span(), 10);
    let digits = [x.from, x.to].map(|end| tick(end, finest).len()).into_iter().max().unwrap_or(1);
    let across_px = width as i32 / FINE - LEFT_PX - RIGHT_PX - EDGE_PX;
    let x_labels = (across_px / (7 * digits as i32 + 12)).clamp(3, 10) as usize;
    let y_labels = ((height as i32 / FINE - TOP_PX - BOTTOM_PX - EDGE_PX) / 18).clamp(4, 12) as usize;
    let (x_decimals, y_decimals) = (decimals(x.span(), x_labels), decimals(y.span(), y_labels));
    let (ticked, y_ticked) = (chart.x_ticks.is_some(), chart.y_ticks.is_some());
    let mut mesh = context.configure_mesh();
    if y_ticked {
        mesh.disable_mesh();
    }
    mesh.light_line_style(TRANSPARENT)
        .bold_line_style(LIGHT.stroke_width(FINE as u32))
        .axis_style(GREY.stroke_width(FINE as u32))
        .set_all_tick_mark_size(if y_ticked { 0 } else { 5 * FINE })
        .x_desc(x.label.clone())
        .y_desc(y.label.clone())
        .axis_desc_style(font(13))
        .label_style(font(12))
        .x_labels(x_labels)
        .y_labels(y_labels)
        .x_label_formatter(&|value| if ticked { String::new() } else { tick(*value, x_decimals) })
        .y_label_formatter(&|value| if y_ticked { String::new() } else { tick(*value, y_decimals) })
        .draw()?;
    if let (Some(columns), Some(rows)) = (&chart.x_ticks, &chart.y_ticks) {
        let across = rows.iter().map(|(at, _)| vec![(x.from, *at), (x.to, *at)]);
        let up = columns.iter().map(|(at, _)| vec![(*at, y.from), (*at, y.to)]);
        for line in across.chain(up) {
            context.draw_series(LineSeries::new(line, LIGHT.stroke_width(FINE as u32)))?;
        }
    }
    for series in &chart.series {
        draw_series(&mut context, series)?;
    }
    let bottom = height as i32 - (BOTTOM_PX + EDGE_PX - 7) * FINE;
    let (left, top) = area.get_base_pixel();
    // As large as fits side by side: a digit is about 0.56 of its size wide, a gap half of that.
    let longest = chart.x_ticks.iter().flatten().map(|(_, label)| label.len()).max().unwrap_or(1);
    let each_px = f64::from(across_px) / chart.x_ticks.as_ref().map_or(1, Vec::len).max(1) as f64;
    let tick_px = (each_px / (0.56 * (longest as f64 + 0.5))).clamp(6.0, 11.0) as i32;
    for (at, label) in chart.x_ticks.iter().flatten() {
        let (pixel, _) = context.plotting_area().map_coordinate(&(*at, y.from));
        let style = anchored(tick_px, HPos::Center, VPos::Top);
        area.draw(&Text::new(label.clone(), (pixel - left, bottom), style))?;
    }
    for (at, label) in chart.y_ticks.iter().flatten() {
        let (pixel_x, pixel_y) = context.plotting_area().map_coordinate(&(x.from, *at));
        let style = anchored(11, HPos::Right, VPos::Center);
        area.draw(&Text::new(label.clone(), (pixel_x - left - 8 * FINE, pixel_y - top), style))?;
    }
    for (at, label, above_px) in &chart.labels {
        let (pixel_x, pixel_y) = context.plotting_area().map_coordinate(at);
        let style = anchored(11, HPos::Left, VPos::Center);
        area.draw(&Text::new(label.clone(), (pixel_x - left - 2 * FINE, pixel_y - top - above_px * FINE), style))?;
    }
    Ok(())
}

type Context<'a, 'b> = ChartContext<
    'a,
    SVGBackend<'b>,
    Cartesian2d<plotters::coord::types::RangedCoordf64, plotters::coord::types::RangedCoordf64>,
>;

fn draw_series(context: &mut Context<'_, '_>, series: &Series) -> Result<(), Failure> {
    let points = drawn(series);
    let line = series.colour.stroke_width(3 * FINE as u32 / 2);
    match series.mark {
        Mark::Line => {
            context.draw_series(LineSeries::new(points, line))?;
        }
        Mark::Dash => {
            context.draw_series(DashedLineSeries::new(points, 7 * FINE, 5 * FINE, line))?;
        }
        Mark::Dots => {
            let dot = |point| Circle::new(point, 3 * FINE / 2, series.colour.mix(0.75).filled());
            context.draw_series(points.into_iter().map(dot))?;
        }
        Mark::Balls => {
            let ball = |point| Circle::new(point, 4 * FINE, series.colour.filled());
            context.draw_series(points.into_iter().map(ball))?;
        }
        Mark::Rings => {
            let ring = |point| Circle::new(point, 3 * FINE / 2, series.colour.stroke_width(FINE as u32 * 3 / 4));
            context.draw_series(points.into_iter().map(ring))?;
        }
        Mark::Cross => {
            let cross =
                |point| plotters::element::Cross::new(point, 7 * FINE, series.colour.stroke_width(2 * FINE as u32));
            context.draw_series(points.into_iter().map(cross))?;
        }
        Mark::Bars(width) => {
            let bar = |&(x, y): &(f64, f64)| {
                Rectangle::new([(x - width / 2.0, 0.0), (x + width / 2.0, y)], series.colour.filled())
            };
            context.draw_series(series.points.iter().map(bar))?;
        }
        Mark::Band if points.len() < 3 => {}
        Mark::Band => {
            let inside = Polygon::new(points, series.colour.mix(0.2).filled());
            context.draw_series(std::iter::once(inside))?;
        }
        Mark::Tile(width, height) => {
            let (w, h) = (width / 2.0, height / 2.0);
            let tile = |&(x, y): &(f64, f64)| Rectangle::new([(x - w, y - h), (x + w, y + h)], series.colour.filled());
            context.draw_series(series.points.iter().map(tile))?;
        }
    }
    Ok(())
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

/// Decimals that distinguish neighbouring ticks of an axis.
fn decimals(span: f64, labels: usize) -> usize {
    // Labels are 1, 2 or 5 times a power of ten apart, so that there are no more than wanted.
    let least = span / labels as f64;
    let power = libm::pow(10.0, libm::floor(libm::log10(least)));
    let apart = [1.0, 2.0, 5.0, 10.0].map(|times| times * power).into_iter().find(|apart| *apart > 0.999 * least);
    libm::ceil(-libm::log10(apart.unwrap_or(power)) - 1e-6).clamp(0.0, 12.0) as usize
}

fn tick(value: f64, decimals: usize) -> String {
    let text = format!("{value:.decimals$}");
    // A zero that rounding left negative.
    if text.trim_start_matches('-').bytes().all(|b| matches!(b, b'0' | b'.')) { text.replace('-', "") } else { text }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_have_as_many_decimals_as_tell_them_apart() {
        assert_eq!((decimals(60.0, 10), decimals(4.0, 10), decimals(0.03, 5)), (0, 1, 2));
        // Four and a half units in twelve labels are half a unit apart, in five a whole one.
        assert_eq!((decimals(4.5, 12), decimals(4.5, 5)), (1, 0));
        assert_eq!((tick(-0.0, 1), tick(-0.04, 1), tick(-1.0, 0)), ("0.0".into(), "0.0".into(), "-1".into()));
    }
}
