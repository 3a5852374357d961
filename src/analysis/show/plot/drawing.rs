//! A finished picture as SVG, and as PNG through resvg with the bundled font.
//!
//! plotters rounds everything to whole pixels, so a picture is drawn at [`FINE`] times its size and scaled
//! down. It writes one element a dot; dots of a kind that follow each other become one path here, which is an
//! order of magnitude smaller and what keeps reports with tens of thousands of points printable.

use std::error::Error;
use std::fmt::Write as _;
use std::io::Write as _;
use std::path::Path;
use std::sync::{Arc, OnceLock};

use plotters::coord::Shift;
use plotters::prelude::*;
use plotters::style::{FontStyle, register_font};
use resvg::usvg::fontdb;
use resvg::{tiny_skia, usvg};

use crate::error::JudgeError;

/// Virtual pixels in one pixel of the picture.
pub const FINE: i32 = 4;
/// Pixels of a run's PNG in one pixel of the picture.
pub(crate) const PNG_SCALE: f32 = 2.0;
/// A picture is rasterised so many rows at a time: one of many signals is 8000 high, which would take more
/// memory than all that it was drawn from.
const BAND_ROWS: u32 = 2048;

/// The drawing surface, in virtual pixels.
pub type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;
/// Error of a drawing; only its text reaches the user.
pub type Failure = Box<dyn Error>;

/// DejaVu Sans (assets/README.md).
pub(crate) static FONT: &[u8] = include_bytes!("../../assets/DejaVuSans.ttf");

/// A vector picture.
#[derive(Clone, Debug, PartialEq)]
pub struct Drawing {
    /// Vector graphics in virtual pixels, [`FINE`] times the size.
    pub svg: String,
    /// Width, pixels of the picture.
    pub width_px: u32,
    /// Height, pixels of the picture.
    pub height_px: u32,
}

impl Drawing {
    /// Draws a picture of that many pixels.
    ///
    /// # Errors
    /// Errors of the drawing library or of `draw`.
    pub fn new(
        (width_px, height_px): (u32, u32),
        draw: impl FnOnce(&Area<'_>) -> Result<(), Failure>,
    ) -> Result<Self, Failure> {
        static REGISTERED: OnceLock<bool> = OnceLock::new();
        if !*REGISTERED.get_or_init(|| register_font("sans-serif", FontStyle::Normal, FONT).is_ok()) {
            return Err("the bundled font is unreadable".into());
        }
        let mut svg = String::new();
        {
            let size = (width_px * FINE as u32, height_px * FINE as u32);
            let area = SVGBackend::with_string(&mut svg, size).into_drawing_area();
            area.fill(&WHITE)?;
            draw(&area)?;
            area.present()?;
        }
        Ok(Self { svg: with_shapes_joined(&with_dots_joined(&svg)), width_px, height_px })
    }

    /// The picture as usvg reads it, its text in the bundled font.
    pub(crate) fn tree(&self) -> Result<usvg::Tree, Failure> {
        let options = usvg::Options { fontdb: fonts(), ..usvg::Options::default() };
        Ok(usvg::Tree::from_str(&self.svg, &options)?)
    }

    /// A PNG, `scale` times as large.
    ///
    /// # Errors
    /// Errors of the rasteriser.
    pub fn png(&self, scale: f32) -> Result<Vec<u8>, Failure> {
        let size = |pixels: u32| (pixels as f32 * scale).round() as u32;
        let (width, height) = (size(self.width_px), size(self.height_px));
        let (tree, shrink) = (self.tree()?, scale / FINE as f32);
        let mut bytes = Vec::new();
        let mut encoder = png::Encoder::new(&mut bytes, width, height);
        // Pictures are opaque, as their background is filled. Lines and flat areas pack best as they are,
        // without differences of neighbours; half as fast, level 6 saves 7 % more.
        encoder.set_color(png::ColorType::Rgb);
        encoder.set_filter(png::Filter::NoFilter);
        encoder.set_deflate_compression(png::DeflateCompression::Level(3));
        let mut writer = encoder.write_header()?;
        let mut rows = writer.stream_writer()?;
        let mut band = tiny_skia::Pixmap::new(width, height.min(BAND_ROWS)).ok_or("a picture needs a size")?;
        let mut colours = Vec::new();
        for first in (0..height).step_by(BAND_ROWS as usize) {
            band.fill(tiny_skia::Color::TRANSPARENT);
            let place = tiny_skia::Transform::from_scale(shrink, shrink).post_translate(0.0, -(first as f32));
            resvg::render(&tree, place, &mut band.as_mut());
            for row in band.data().chunks_exact(4 * width as usize).take((height - first) as usize) {
                colours.clear();
                colours.extend(row.chunks_exact(4).flat_map(|pixel| [pixel[0], pixel[1], pixel[2]]));
                rows.write_all(&colours)?;
            }
        }
        rows.finish()?;
        writer.finish()?;
        Ok(bytes)
    }

    /// Writes that PNG.
    pub(crate) fn write_png(&self, path: &Path, scale: f32) -> Result<(), JudgeError> {
        let failed = |error: Failure| JudgeError::Plot { path: path.to_owned(), reason: error.to_string() };
        crate::show::write::write_whole(path, &self.png(scale).map_err(failed)?)
    }
}

/// The bundled font alone, whatever the machine has.
fn fonts() -> Arc<fontdb::Database> {
    static FONTS: OnceLock<Arc<fontdb::Database>> = OnceLock::new();
    let load = || {
        let mut fonts = fontdb::Database::new();
        fonts.load_font_data(FONT.to_vec());
        fonts.set_sans_serif_family("DejaVu Sans");
        Arc::new(fonts)
    };
    Arc::clone(FONTS.get_or_init(load))
}

/// Joins circles of the same look that follow each other into one path: filled ones as strokes without length
/// under round caps, hollow ones as arcs. Circles at one and the same position stay: a stroke without any
/// extent is not drawn.
fn with_dots_joined(svg: &str) -> String {
    let mut joined = String::with_capacity(svg.len());
    let mut run: Vec<(Circle<'_>, &str)> = Vec::new();
    for line in svg.lines() {
        let circle = Circle::read(line);
        if circle.as_ref().map(|circle| circle.look) != run.first().map(|(first, _)| first.look) {
            join(&run, &mut joined);
            run.clear();
        }
        match circle {
            Some(circle) => run.push((circle, line)),
            None => {
                joined.push_str(line);
                joined.push('\n');
            }
        }
    }
    join(&run, &mut joined);
    joined
}

/// Joins opaque polygons, and lines, of the same look that follow each other into one path.
fn with_shapes_joined(svg: &str) -> String {
    let mut joined = String::with_capacity(svg.len());
    let mut run: Vec<(&str, &str, &str)> = Vec::new();
    let flush = |run: &mut Vec<(&str, &str, &str)>, joined: &mut String| {
        match run.as_slice() {
            [] => {}
            [(_, _, line)] => joined.extend([line, "\n"]),
            [(look, ..), ..] => {
                let (tag, attributes) = look.split_once(' ').unwrap_or((look, ""));
                let close = if tag == "<polygon" { "Z" } else { "" };
                joined.extend(["<path ", attributes, " d=\""]);
                run.iter().for_each(|(_, points, _)| joined.extend(["M", points, close]));
                joined.push_str("\"/>\n");
            }
        }
        run.clear();
    };
    for line in svg.lines() {
        let shape = shape(line);
        if shape.map(|(look, _)| look) != run.first().map(|(look, ..)| *look) {
            flush(&mut run, &mut joined);
        }
        match shape {
            Some((look, points)) => run.push((look, points, line)),
            None => joined.extend([line, "\n"]),
        }
    }
    flush(&mut run, &mut joined);
    joined
}

/// Look and points of an opaque polygon or line as plotters writes it.
fn shape(line: &str) -> Option<(&str, &str)> {
    let (look, rest) = line.split_once(" points=\"")?;
    let is_shape = look.starts_with("<polygon ") || look.starts_with("<polyline ");
    let points = rest.split_once("\"/>")?.0.trim_end();
    (is_shape && look.contains("opacity=\"1\"")).then_some((look, points))
}

/// Writes circles of one look as one path, or as they are.
fn join(run: &[(Circle<'_>, &str)], svg: &mut String) {
    let Some((first, _)) = run.first() else { return };
    if run.iter().all(|(circle, _)| (circle.x, circle.y) == (first.x, first.y)) {
        run.iter().for_each(|(_, line)| svg.extend([line, "\n"]));
        return;
    }
    first.look.open(svg);
    run.iter().for_each(|(circle, _)| circle.place(svg));
    svg.push_str("\"/>\n");
}

/// Style that circles must share to be one path.
#[derive(Clone, Copy, PartialEq)]
struct Look<'a> {
    radius: u32,
    opacity: &'a str,
    fill: &'a str,
    stroke: &'a str,
    stroke_width: &'a str,
}

impl Look<'_> {
    fn open(&self, svg: &mut String) {
        let Self { radius, opacity, fill, stroke, stroke_width } = self;
        // Writing into a string cannot fail.
        let _ = if *stroke == "none" {
            let width = 2 * radius;
            write!(
                svg,
                "<path fill=\"none\" stroke=\"{fill}\" stroke-width=\"{width}\" stroke-linecap=\"round\" \
                 opacity=\"{opacity}\" d=\""
            )
        } else {
            write!(
                svg,
                "<path fill=\"none\" stroke=\"{stroke}\" stroke-width=\"{stroke_width}\" opacity=\"{opacity}\" d=\""
            )
        };
    }
}

struct Circle<'a> {
    x: i32,
    y: i32,
    look: Look<'a>,
}

impl<'a> Circle<'a> {
    /// A circle as plotters writes it; anything else is `None`.
    fn read(line: &'a str) -> Option<Self> {
        let attributes = line.trim_start().strip_prefix("<circle ")?;
        let of = |key: &str| {
            let (_, rest) = attributes.split_once(&format!("{key}=\""))?;
            Some(rest.split_once('"')?.0)
        };
        let look = Look {
            radius: of(" r")?.parse().ok()?,
            opacity: of("opacity")?,
            fill: of("fill")?,
            stroke: of("stroke")?,
            stroke_width: of("stroke-width")?,
        };
        // A disc with an edge is neither.
        (look.fill == "none" || look.stroke == "none").then_some(())?;
        Some(Self { x: of("cx")?.parse().ok()?, y: of("cy")?.parse().ok()?, look })
    }

    fn place(&self, svg: &mut String) {
        let Self { x, y, look } = self;
        let _ = if look.stroke == "none" {
            write!(svg, "M{x} {y}h0")
        } else {
            let (r, across) = (look.radius, 2 * look.radius);
            write!(svg, "M{} {y}a{r} {r} 0 1 0 {across} 0a{r} {r} 0 1 0 -{across} 0", i64::from(*x) - i64::from(r))
        };
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Dots, rings and one lone disc, far enough apart that none touches another.
    fn picture() -> String {
        let mut svg = String::new();
        let area = SVGBackend::with_string(&mut svg, (400, 400)).into_drawing_area();
        area.fill(&WHITE).unwrap();
        for n in 0..9 {
            area.draw(&plotters::element::Circle::new((20 + 40 * n, 60), 6, BLUE.filled())).unwrap();
        }
        area.draw(&plotters::element::Circle::new((200, 200), 30, RED.filled())).unwrap();
        for n in 0..9 {
            area.draw(&plotters::element::Circle::new((20 + 40 * n, 330), 8, BLACK.stroke_width(3))).unwrap();
        }
        area.present().unwrap();
        drop(area);
        svg
    }

    #[test]
    fn joined_dots_are_one_path_and_look_the_same() {
        let apart = picture();
        let joined = with_dots_joined(&apart);
        assert_eq!((apart.matches("<circle").count(), joined.matches("<circle").count()), (19, 1));
        assert_eq!(joined.matches("<path").count(), 2);
        let render = |svg: &str| Drawing { svg: svg.to_owned(), width_px: 100, height_px: 100 }.png(4.0).unwrap();
        let pixels = |svg: &str| tiny_skia::Pixmap::decode_png(&render(svg)).unwrap();
        let (one, other) = (pixels(&apart), pixels(&joined));
        let differ = |(a, b): (&u8, &u8)| a.abs_diff(*b) > 64;
        let differing = one.data().iter().zip(other.data()).filter(|pair| differ(*pair)).count();
        // Two ways of flattening the same circle differ on edges, by less than a quarter of a shade.
        assert_eq!(differing, 0);
        assert!(one.data().iter().filter(|value| **value < 128).count() > 1000, "nothing was drawn");
    }

    #[test]
    fn joined_shapes_are_one_path_and_look_the_same() {
        let mut apart = String::new();
        let area = SVGBackend::with_string(&mut apart, (400, 400)).into_drawing_area();
        area.fill(&WHITE).unwrap();
        for n in 0..9 {
            let (x, y) = (20 + 40 * n, 60);
            area.draw(&Polygon::new(vec![(x, y - 9), (x + 8, y + 6), (x - 8, y + 6)], BLUE.filled())).unwrap();
        }
        for n in 0..9 {
            let (x, y) = (20 + 40 * n, 200);
            area.draw(&PathElement::new([(x - 8, y - 8), (x + 8, y + 8)], RED.stroke_width(3))).unwrap();
        }
        area.present().unwrap();
        drop(area);
        let joined = with_shapes_joined(&apart);
        assert_eq!((apart.matches("points=").count(), joined.matches("<path").count()), (18, 2));
        assert!(!joined.contains("points="));
        let render = |svg: &str| Drawing { svg: svg.to_owned(), width_px: 100, height_px: 100 }.png(4.0).unwrap();
        let pixels = |svg: &str| tiny_skia::Pixmap::decode_png(&render(svg)).unwrap();
        let (one, other) = (pixels(&apart), pixels(&joined));
        assert_eq!(one.data(), other.data());
        assert!(one.data().iter().filter(|value| **value < 128).count() > 1000, "nothing was drawn");
    }

    #[test]
    fn a_tall_picture_in_bands_is_the_one_that_is_drawn_at_once() {
        let height_px = BAND_ROWS + 700;
        let mut svg = String::new();
        let area = SVGBackend::with_string(&mut svg, (4 * 50, 4 * height_px)).into_drawing_area();
        area.fill(&WHITE).unwrap();
        // Slanted lines and discs, some across the edge of a band.
        for n in 0..80_i32 {
            let y = 137 * n;
            area.draw(&PathElement::new([(3, y), (190, y + 90)], BLUE.stroke_width(5))).unwrap();
            area.draw(&plotters::element::Circle::new((100, y + 60), 18, RED.filled())).unwrap();
        }
        area.present().unwrap();
        drop(area);
        let drawing = Drawing { svg, width_px: 50, height_px };
        let banded = tiny_skia::Pixmap::decode_png(&drawing.png(1.0).unwrap()).unwrap();
        let mut whole = tiny_skia::Pixmap::new(50, height_px).unwrap();
        let place = tiny_skia::Transform::from_scale(0.25, 0.25);
        resvg::render(&drawing.tree().unwrap(), place, &mut whole.as_mut());
        assert_eq!((banded.width(), banded.height()), (50, height_px));
        // Coordinates of a band lie elsewhere: an edge rounds to another of the rasteriser's four lines a
        // pixel at most.
        let differing = banded.data().iter().zip(whole.data()).filter(|(a, b)| a.abs_diff(**b) > 64).count();
        assert_eq!(differing, 0);
        assert!(banded.data().iter().filter(|value| **value < 128).count() > 10_000, "nothing was drawn");
    }
}
