//! The bundled fonts: widths of text, and where its lines break.

use std::ops::Range;

use ttf_parser::{Face as Parsed, GlyphId};

use super::PdfError;
use crate::show::plot::drawing::FONT as REGULAR;

static BOLD: &[u8] = include_bytes!("../../assets/DejaVuSans-Bold-subset.ttf");
static MONO: &[u8] = include_bytes!("../../assets/DejaVuSansMono-subset.ttf");

/// Face of the bundled fonts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Face {
    Regular,
    Bold,
    Mono,
}

impl Face {
    pub const ALL: [Self; 3] = [Self::Regular, Self::Bold, Self::Mono];

    pub fn data(self) -> &'static [u8] {
        match self {
            Self::Regular => REGULAR,
            Self::Bold => BOLD,
            Self::Mono => MONO,
        }
    }

    pub fn name(self) -> &'static str {
        match self {
            Self::Regular => "DejaVu Sans",
            Self::Bold => "DejaVu Sans Bold",
            Self::Mono => "DejaVu Sans Mono",
        }
    }
}

/// A glyph of a piece of text.
#[derive(Clone, Debug)]
pub(super) struct Glyph {
    pub face: Face,
    pub id: u16,
    /// Advance width in units of the font size.
    pub advance: f32,
    /// Byte range of the glyph in the text.
    pub range: Range<usize>,
}

/// Words of a text, between which a line may break. Blanks and tabulators separate them, and non-breaking
/// blanks do not.
pub(super) fn words(text: &str) -> impl Iterator<Item = &str> {
    text.split([' ', '\t', '\n']).filter(|word| !word.is_empty())
}

/// The fonts, read.
pub(super) struct Fonts {
    parsed: [Parsed<'static>; 3],
}

impl Fonts {
    pub fn new() -> Result<Self, PdfError> {
        let read = |face: Face| Parsed::parse(face.data(), 0).map_err(|_| PdfError::Font(face.name()));
        Ok(Self { parsed: [read(Face::Regular)?, read(Face::Bold)?, read(Face::Mono)?] })
    }

    fn of(&self, face: Face) -> &Parsed<'static> {
        let [regular, bold, mono] = &self.parsed;
        match face {
            Face::Regular => regular,
            Face::Bold => bold,
            Face::Mono => mono,
        }
    }

    /// The glyphs of one line; a character that a font lacks comes from the regular one, then becomes a
    /// question mark.
    pub fn glyphs(&self, face: Face, text: &str) -> Vec<Glyph> {
        let find = |face: Face, c: char| Some((face, self.of(face).glyph_index(c)?));
        let one = |(at, c): (usize, char)| {
            let shown = if c.is_control() { ' ' } else { c };
            let (face, id) = find(face, shown)
                .or_else(|| find(Face::Regular, shown))
                .or_else(|| find(face, '?'))
                .unwrap_or((face, GlyphId(0)));
            let parsed = self.of(face);
            let advance = f32::from(parsed.glyph_hor_advance(id).unwrap_or(0)) / f32::from(parsed.units_per_em());
            Glyph { face, id: id.0, advance, range: at..at + c.len_utf8() }
        };
        text.char_indices().map(one).collect()
    }

    /// Length of one line.
    pub fn width(&self, face: Face, size: f32, text: &str) -> f32 {
        self.glyphs(face, text).iter().map(|glyph| glyph.advance).sum::<f32>() * size
    }

    /// Lines that are no longer than `width`, the first of them shorter by `indent`. Breaks at blanks, and
    /// within a word only where it is longer than a line.
    pub fn wrap(&self, face: Face, size: f32, text: &str, width: f32, indent: f32) -> Vec<String> {
        let mut lines = vec![String::new()];
        let mut room = width - indent;
        let blank = self.width(face, size, " ");
        for (number, paragraph) in text.split('\n').enumerate() {
            if number > 0 {
                lines.push(String::new());
                room = width;
            }
            for word in words(paragraph) {
                let length = self.width(face, size, word);
                let line = lines.last_mut().filter(|line| line.is_empty() || length + blank <= room);
                if let Some(line) = line.filter(|line| !line.is_empty() || length <= room) {
                    if !line.is_empty() {
                        line.push(' ');
                        room -= blank;
                    }
                    line.push_str(word);
                    room -= length;
                    continue;
                }
                if lines.last().is_some_and(|line| !line.is_empty()) || (indent > 0.0 && lines.len() == 1) {
                    lines.push(String::new());
                    room = width;
                }
                for c in word.chars() {
                    let length = self.width(face, size, c.encode_utf8(&mut [0; 4]));
                    if length > room && lines.last().is_some_and(|line| !line.is_empty()) {
                        lines.push(String::new());
                        room = width;
                    }
                    if let Some(line) = lines.last_mut() {
                        line.push(c);
                    }
                    room -= length;
                }
            }
        }
        lines
    }
}
