//! Pages into a PDF file.

use krilla::Document;
use krilla::SerializeSettings;
use krilla::color::rgb;
use krilla::destination::XyzDestination;
use krilla::geom::{PathBuilder, Point, Rect, Size, Transform};
use krilla::metadata::Metadata;
use krilla::outline::{Outline, OutlineNode};
use krilla::page::PageSettings;
use krilla::paint::Fill;
use krilla::surface::Surface;
use krilla::text::{Font, GlyphId, KrillaGlyph};
use krilla_svg::{SurfaceExt, SvgSettings};

use super::PdfError;
use super::fonts::{Face, Fonts};
use super::layout::{Colour, FAINT, LEFT, Mark, PAGE, Pages, RULE, WIDTH};
use crate::show::document::Report;

/// The PDF's fonts beside their widths.
struct Pens<'a> {
    fonts: &'a Fonts,
    pens: [Font; 3],
}

impl Pens<'_> {
    fn of(&self, face: Face) -> Font {
        let [regular, bold, mono] = &self.pens;
        match face {
            Face::Regular => regular.clone(),
            Face::Bold => bold.clone(),
            Face::Mono => mono.clone(),
        }
    }

    /// Draws one line from its left end on the baseline.
    fn write(&self, surface: &mut Surface<'_>, (x, y): (f32, f32), face: Face, size: f32, colour: Colour, text: &str) {
        surface.set_fill(Some(fill(colour)));
        let glyphs = self.fonts.glyphs(face, text);
        let mut at = x;
        for run in glyphs.chunk_by(|a, b| a.face == b.face) {
            let (Some(first), Some(last)) = (run.first(), run.last()) else { continue };
            let words = text.get(first.range.start..last.range.end).unwrap_or("");
            let placed: Vec<KrillaGlyph> = run
                .iter()
                .map(|glyph| {
                    let range = glyph.range.start - first.range.start..glyph.range.end - first.range.start;
                    KrillaGlyph::new(GlyphId::new(u32::from(glyph.id)), glyph.advance, 0.0, 0.0, 0.0, range, None)
                })
                .collect();
            surface.draw_glyphs(Point::from_xy(at, y), &placed, self.of(first.face), words, size, false);
            at += run.iter().map(|glyph| glyph.advance).sum::<f32>() * size;
        }
    }
}

fn fill([red, green, blue]: Colour) -> Fill {
    Fill { paint: rgb::Color::new(red, green, blue).into(), ..Fill::default() }
}

/// Writes the laid-out report with a head and a foot on every page.
pub(super) fn pdf(report: &Report, pages: &Pages<'_>, fonts: &Fonts) -> Result<Vec<u8>, PdfError> {
    let pen = |face: Face| Font::new(face.data().to_vec().into(), 0).ok_or(PdfError::Font(face.name()));
    let [regular, bold, mono] = Face::ALL.map(pen);
    let pens = Pens { fonts, pens: [regular?, bold?, mono?] };
    let mut document = Document::new_with(SerializeSettings { enable_tagging: false, ..SerializeSettings::default() });
    for (number, marks) in pages.pages.iter().enumerate() {
        let settings = PageSettings::from_wh(PAGE.0, PAGE.1).ok_or_else(|| PdfError::Write("no page".to_owned()))?;
        let mut page = document.start_page_with(settings);
        let mut surface = page.surface();
        edges(&mut surface, &pens, report, (number + 1, pages.pages.len()));
        for mark in marks {
            draw(&mut surface, &pens, mark)?;
        }
        surface.finish();
        page.finish();
    }
    let mut outline = Outline::new();
    for (title, page, y) in &pages.chapters {
        let target = XyzDestination::new(*page, Point::from_xy(LEFT, *y));
        outline.push_child(OutlineNode::new(title.clone(), target));
    }
    document.set_outline(outline);
    let program = concat!("gnss-twin ", env!("CARGO_PKG_VERSION")).to_owned();
    // A document's identifier is made of its contents where none is given: no clock, no chance.
    let metadata = Metadata::new().title(report.title.clone()).creator(program.clone()).producer(program);
    document.set_metadata(metadata.language("en".to_owned()));
    document.finish().map_err(|error| PdfError::Write(format!("{error:?}")))
}

/// Title and subject above, the page's number below.
fn edges(surface: &mut Surface<'_>, pens: &Pens<'_>, report: &Report, (number, pages): (usize, usize)) {
    const SIZE: f32 = 7.5;
    let right = |text: &str| LEFT + WIDTH - pens.fonts.width(Face::Regular, SIZE, text);
    pens.write(surface, (LEFT, 38.0), Face::Regular, SIZE, FAINT, &report.title);
    pens.write(surface, (right(&report.head), 38.0), Face::Regular, SIZE, FAINT, &report.head);
    block(surface, (LEFT, 44.0, WIDTH, 0.5), RULE);
    let foot = PAGE.1 - 34.0;
    block(surface, (LEFT, foot - 12.0, WIDTH, 0.5), RULE);
    let program = concat!("gnss-twin ", env!("CARGO_PKG_VERSION"));
    pens.write(surface, (LEFT, foot), Face::Regular, SIZE, FAINT, program);
    let place = format!("{number} / {pages}");
    pens.write(surface, (right(&place), foot), Face::Regular, SIZE, FAINT, &place);
}

fn draw(surface: &mut Surface<'_>, pens: &Pens<'_>, mark: &Mark<'_>) -> Result<(), PdfError> {
    match mark {
        Mark::Words { x, y, face, size, colour, text } => pens.write(surface, (*x, *y), *face, *size, *colour, text),
        Mark::Block { x, y, width, height, colour } => block(surface, (*x, *y, *width, *height), *colour),
        Mark::Picture { x, y, width, height, number, drawing } => {
            let failed = |reason: String| PdfError::Picture { number: *number, reason };
            let tree = drawing.tree().map_err(|error| failed(error.to_string()))?;
            let size = Size::from_wh(*width, *height).ok_or_else(|| failed("it has no size".to_owned()))?;
            surface.push_transform(&Transform::from_translate(*x, *y));
            let drawn = surface.draw_svg(&tree, size, SvgSettings::default());
            surface.pop();
            drawn.ok_or_else(|| failed("it cannot be drawn".to_owned()))?;
        }
    }
    Ok(())
}

fn block(surface: &mut Surface<'_>, (x, y, width, height): (f32, f32, f32, f32), colour: Colour) {
    let mut path = PathBuilder::new();
    if let Some(rect) = Rect::from_xywh(x, y, width, height) {
        path.push_rect(rect);
    }
    surface.set_fill(Some(fill(colour)));
    surface.set_stroke(None);
    if let Some(path) = path.finish() {
        surface.draw_path(&path);
    }
}
