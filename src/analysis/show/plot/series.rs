//! Series as marks, lines and areas between the axes.

use plotters::prelude::*;

use super::chart::{Mark, Series, Shape, drawn};
use super::clip::Frame;
use super::drawing::{Area, FINE, Failure};

/// A pair of axes that is drawn in.
pub(super) type Context<'a, 'b> = ChartContext<
    'a,
    SVGBackend<'b>,
    Cartesian2d<plotters::coord::types::RangedCoordf64, plotters::coord::types::RangedCoordf64>,
>;

/// Draws what of a series lies inside the axes.
pub(super) fn draw(context: &mut Context<'_, '_>, frame: &Frame, series: &Series) -> Result<(), Failure> {
    let mut points = drawn(series);
    if !series.mark.is_line() && series.mark != Mark::Band {
        points.retain(|point| frame.holds(*point));
    }
    let (colour, line) = (series.colour, series.colour.stroke_width(3 * FINE as u32 / 2));
    match series.mark {
        Mark::Line => {
            for piece in frame.pieces(&points) {
                context.draw_series(LineSeries::new(piece, line))?;
            }
        }
        Mark::Dash => dashes(context, frame.pieces(&points), (7, 5), line)?,
        Mark::Dashes(on_px, off_px) => dashes(context, frame.pieces(&points), (on_px, off_px), line)?,
        Mark::Dots => {
            let dot = |point| Circle::new(point, 3 * FINE / 2, colour.mix(0.75).filled());
            context.draw_series(points.into_iter().map(dot))?;
        }
        Mark::Balls => {
            let ball = |point| Circle::new(point, 4 * FINE, colour.filled());
            context.draw_series(points.into_iter().map(ball))?;
        }
        Mark::Rings => {
            let ring = |point| Circle::new(point, 3 * FINE / 2, colour.stroke_width(FINE as u32 * 3 / 4));
            context.draw_series(points.into_iter().map(ring))?;
        }
        Mark::Small(shape) => shaped(context, &points, (shape, 9 * FINE / 4), colour)?,
        Mark::Large(shape) => shaped(context, &points, (shape, 9 * FINE / 2), colour)?,
        Mark::Cross => {
            let cross = |point| plotters::element::Cross::new(point, 7 * FINE, colour.stroke_width(2 * FINE as u32));
            context.draw_series(points.into_iter().map(cross))?;
        }
        Mark::Bars(width) => {
            let corners =
                |&(x, y): &(f64, f64)| [(x - width / 2.0, 0.0), (x + width / 2.0, y)].map(|p| frame.nearest(p));
            let bar = |point| Rectangle::new(corners(point), colour.filled());
            context.draw_series(series.points.iter().map(bar))?;
        }
        Mark::Band if points.len() < 3 => {}
        Mark::Band => {
            let inside: Vec<(f64, f64)> = points.into_iter().map(|point| frame.nearest(point)).collect();
            context.draw_series(std::iter::once(Polygon::new(inside, colour.mix(0.2).filled())))?;
        }
        Mark::Tile(width, height) => {
            let (w, h) = (width / 2.0, height / 2.0);
            let tile = |&(x, y): &(f64, f64)| Rectangle::new([(x - w, y - h), (x + w, y + h)], colour.filled());
            context.draw_series(series.points.iter().map(tile))?;
        }
    }
    Ok(())
}

/// Dashed lines; their dashes and gaps in pixels.
fn dashes(
    context: &mut Context<'_, '_>,
    pieces: Vec<Vec<(f64, f64)>>,
    (on_px, off_px): (i32, i32),
    line: ShapeStyle,
) -> Result<(), Failure> {
    for piece in pieces {
        context.draw_series(DashedLineSeries::new(piece, on_px * FINE, off_px * FINE, line))?;
    }
    Ok(())
}

/// Marks of a shape at points, their radius in virtual pixels.
fn shaped(
    context: &mut Context<'_, '_>,
    points: &[(f64, f64)],
    (shape, radius): (Shape, i32),
    colour: RGBColor,
) -> Result<(), Failure> {
    let area = context.plotting_area().strip_coord_spec();
    let (left, top) = area.get_base_pixel();
    let places: Vec<(i32, i32)> = points.iter().map(|point| context.plotting_area().map_coordinate(point)).collect();
    places.into_iter().try_for_each(|(x, y)| outline(&area, (x - left, y - top), (shape, radius), colour))
}

/// One mark of a shape, its radius in virtual pixels.
pub(super) fn outline(
    area: &Area<'_>,
    (x, y): (i32, i32),
    (shape, radius): (Shape, i32),
    colour: RGBColor,
) -> Result<(), Failure> {
    let corner = |&(dx, dy): &(i32, i32)| (x + dx * radius / 8, y + dy * radius / 8);
    let thin = colour.stroke_width((radius as u32 / 3).max(FINE as u32 * 3 / 4));
    match shape {
        Shape::Filled(corners) => {
            area.draw(&Polygon::new(corners.iter().map(corner).collect::<Vec<_>>(), colour.filled()))?;
        }
        Shape::Hollow(corners) => {
            let closed = corners.iter().chain(corners.first()).map(corner);
            area.draw(&PathElement::new(closed.collect::<Vec<_>>(), thin))?;
        }
        Shape::Strokes(strokes) => {
            for ends in strokes {
                area.draw(&PathElement::new([corner(&ends[0]), corner(&ends[1])], thin))?;
            }
        }
    }
    Ok(())
}
