//! Items onto pages: what is placed where, before any file is written.

use super::fonts::{Face, Fonts};
use super::table;
use crate::show::document::{Item, Report, Tone};
use crate::show::plot::drawing::Drawing;
use crate::show::plot::sketch::Figure;

/// A4 in points, and its margins.
pub(super) const PAGE: (f32, f32) = (595.28, 841.89);
pub(super) const LEFT: f32 = 56.0;
const TOP: f32 = 64.0;
const BOTTOM: f32 = 60.0;
/// Width of the text in points.
pub(super) const WIDTH: f32 = PAGE.0 - 2.0 * LEFT;

pub(super) type Colour = [u8; 3];
pub(super) const INK: Colour = [30, 30, 30];
pub(super) const FAINT: Colour = [105, 105, 105];
pub(super) const RULE: Colour = [200, 200, 200];

/// Colours after Okabe and Ito, darkened where they carry small letters.
pub(super) fn ink(tone: Tone) -> Colour {
    match tone {
        Tone::Plain | Tone::Strong => INK,
        Tone::Faint => FAINT,
        Tone::Good => [0, 120, 88],
        Tone::Caution => [166, 108, 0],
        Tone::Bad => [190, 70, 0],
    }
}

fn ground(tone: Tone) -> Colour {
    match tone {
        Tone::Good => [222, 242, 235],
        Tone::Caution => [252, 240, 214],
        Tone::Bad => [251, 227, 212],
        Tone::Plain | Tone::Faint | Tone::Strong => [238, 238, 238],
    }
}

/// One thing on a page; y grows downward from its upper edge.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Mark<'a> {
    /// `y` is the baseline.
    Words {
        x: f32,
        y: f32,
        face: Face,
        size: f32,
        colour: Colour,
        text: String,
    },
    Block {
        x: f32,
        y: f32,
        width: f32,
        height: f32,
        colour: Colour,
    },
    Picture {
        x: f32,
        y: f32,
        width: f32,
        height: f32,
        number: usize,
        drawing: &'a Drawing,
    },
}

/// Pages, and where chapters begin.
#[derive(Default)]
pub(super) struct Pages<'a> {
    pub pages: Vec<Vec<Mark<'a>>>,
    /// Title, page from 0, height.
    pub chapters: Vec<(String, usize, f32)>,
}

/// A page being filled from above.
pub(super) struct Sheet<'a> {
    pub fonts: &'a Fonts,
    done: Pages<'a>,
    /// The next free height.
    y: f32,
}

const TEXT: f32 = 9.5;
const LEADING: f32 = 13.2;
const SMALL: f32 = 8.0;
const SMALL_LEADING: f32 = 10.8;
const CODE: f32 = 7.6;
const CODE_LEADING: f32 = 9.6;

impl<'a> Sheet<'a> {
    pub fn new_page(&mut self) {
        self.done.pages.push(Vec::new());
        self.y = TOP;
    }

    /// Height that is left.
    pub fn room(&self) -> f32 {
        PAGE.1 - BOTTOM - self.y
    }

    fn is_fresh(&self) -> bool {
        self.y <= TOP
    }

    pub fn skip(&mut self, height: f32) {
        self.y += height;
    }

    fn mark(&mut self, mark: Mark<'a>) {
        if let Some(page) = self.done.pages.last_mut() {
            page.push(mark);
        }
    }

    /// Words whose baseline is `down` below the next free height.
    pub fn words_at(&mut self, x: f32, down: f32, face: Face, size: f32, colour: Colour, text: &str) {
        if !text.is_empty() {
            let y = self.y + down;
            self.mark(Mark::Words { x: LEFT + x, y, face, size, colour, text: text.to_owned() });
        }
    }

    /// A horizontal line at the next free height.
    pub fn rule(&mut self, from: f32, to: f32, thick: f32, colour: Colour) {
        let (x, y) = (LEFT + from, self.y - 0.5 * thick);
        self.mark(Mark::Block { x, y, width: to - from, height: thick, colour });
    }

    fn lines(&mut self, lines: &[String], face: Face, size: f32, leading: f32, colour: Colour) {
        for line in lines {
            if self.room() < leading {
                self.new_page();
            }
            self.words_at(0.0, 0.78 * leading, face, size, colour, line);
            self.skip(leading);
        }
    }

    /// A bold label and the text that goes on behind it.
    fn labelled(&mut self, label: &str, text: &str) {
        let indent = self.fonts.width(Face::Bold, SMALL, label) + 5.0;
        let lines = self.fonts.wrap(Face::Regular, SMALL, text, WIDTH, indent);
        self.words_at(0.0, 0.78 * SMALL_LEADING, Face::Bold, SMALL, INK, label);
        for (number, line) in lines.iter().enumerate() {
            let x = if number == 0 { indent } else { 0.0 };
            self.words_at(x, 0.78 * SMALL_LEADING, Face::Regular, SMALL, INK, line);
            self.skip(SMALL_LEADING);
        }
    }
}

/// Lays a report out.
pub(super) fn lay_out<'a>(report: &'a Report, fonts: &'a Fonts) -> Pages<'a> {
    let mut sheet = Sheet { fonts, done: Pages::default(), y: TOP };
    sheet.new_page();
    title(&mut sheet, report);
    let (mut figures, mut tables) = (0, 0);
    for (index, item) in report.items.iter().enumerate() {
        let next = report.items.get(index + 1).map_or(0.0, |next| least_height(next, fonts));
        match item {
            Item::NewPage if sheet.is_fresh() => {}
            Item::NewPage => sheet.new_page(),
            Item::Heading(text) => {
                heading(&mut sheet, text, 14.0, next);
                let (page, y) = (sheet.done.pages.len() - 1, sheet.y - 26.0);
                sheet.done.chapters.push((text.clone(), page, y));
            }
            Item::Subheading(text) => heading(&mut sheet, text, 10.5, next),
            Item::Text(text) => {
                let lines = fonts.wrap(Face::Regular, TEXT, text, WIDTH, 0.0);
                sheet.lines(&lines, Face::Regular, TEXT, LEADING, INK);
                sheet.skip(6.0);
            }
            Item::Note(text) => note(&mut sheet, text),
            Item::Banner(text, tone) => banner(&mut sheet, text, *tone),
            Item::Facts(pairs) => facts(&mut sheet, pairs),
            Item::Table(one) => {
                if sheet.room() < table::least_height(one, fonts) && !sheet.is_fresh() {
                    sheet.new_page();
                }
                if !one.caption.is_empty() {
                    tables += 1;
                    sheet.labelled(&format!("Table {tables}."), &one.caption);
                    sheet.skip(3.0);
                }
                table::lay_out(&mut sheet, one);
                let left = one.rows.len() - one.printed().len();
                if left > 0 {
                    note(&mut sheet, &format!("{left} more are below."));
                }
            }
            Item::Figure(Figure { drawing, caption, .. }) => {
                figures += 1;
                figure(&mut sheet, drawing, figures, caption);
            }
            Item::Pair(both) => {
                let [left, right] = &**both;
                pair(&mut sheet, [&left.drawing, &right.drawing], figures + 1);
            }
            Item::Listing(text) => listing(&mut sheet, text),
        }
    }
    sheet.done
}

/// Height without which an item does not begin on a page.
fn least_height(item: &Item, fonts: &Fonts) -> f32 {
    match item {
        Item::Figure(one) => picture_height(&one.drawing, &one.caption, fonts).1,
        Item::Table(one) => table::least_height(one, fonts),
        Item::NewPage => 0.0,
        _ => 3.0 * LEADING,
    }
}

fn title(sheet: &mut Sheet<'_>, report: &Report) {
    let lines = sheet.fonts.wrap(Face::Bold, 20.0, &report.title, WIDTH, 0.0);
    sheet.lines(&lines, Face::Bold, 20.0, 25.0, INK);
    if !report.subtitle.is_empty() {
        let lines = sheet.fonts.wrap(Face::Regular, TEXT, &report.subtitle, WIDTH, 0.0);
        sheet.lines(&lines, Face::Regular, TEXT, LEADING, FAINT);
    }
    sheet.skip(8.0);
}

fn note(sheet: &mut Sheet<'_>, text: &str) {
    let lines = sheet.fonts.wrap(Face::Regular, SMALL, text, WIDTH, 0.0);
    sheet.lines(&lines, Face::Regular, SMALL, SMALL_LEADING, FAINT);
    sheet.skip(6.0);
}

fn heading(sheet: &mut Sheet<'_>, text: &str, size: f32, next: f32) {
    let leading = 1.35 * size;
    let lines = sheet.fonts.wrap(Face::Bold, size, text, WIDTH, 0.0);
    let own = lines.len() as f32 * leading + 12.0;
    // A heading stays with what it heads, unless that would not fit below it on any page.
    let with_next = if own + next < PAGE.1 - TOP - BOTTOM { own + next } else { own + 3.0 * LEADING };
    if sheet.room() < with_next && !sheet.is_fresh() {
        sheet.new_page();
    }
    if !sheet.is_fresh() {
        sheet.skip(8.0);
    }
    sheet.lines(&lines, Face::Bold, size, leading, INK);
    sheet.skip(4.0);
}

fn banner(sheet: &mut Sheet<'_>, text: &str, tone: Tone) {
    const SIZE: f32 = 11.0;
    let lines = sheet.fonts.wrap(Face::Bold, SIZE, text, WIDTH - 20.0, 0.0);
    let height = lines.len() as f32 * 15.0 + 12.0;
    if sheet.room() < height {
        sheet.new_page();
    }
    let y = sheet.y;
    sheet.mark(Mark::Block { x: LEFT, y, width: WIDTH, height, colour: ground(tone) });
    sheet.mark(Mark::Block { x: LEFT, y, width: 4.0, height, colour: ink(tone) });
    for (number, line) in lines.iter().enumerate() {
        sheet.words_at(14.0, 6.0 + 11.0 + 15.0 * number as f32, Face::Bold, SIZE, ink(tone), line);
    }
    sheet.skip(height + 10.0);
}

fn facts(sheet: &mut Sheet<'_>, pairs: &[(String, String)]) {
    const NAME: f32 = 84.0;
    let half = 0.5 * (WIDTH - 14.0);
    let rows = pairs.len().div_ceil(2);
    for row in 0..rows {
        let beside = [pairs.get(row), pairs.get(row + rows)];
        let wrapped = beside.map(|pair| {
            pair.map(|(name, value)| (name, sheet.fonts.wrap(Face::Regular, SMALL, value, half - NAME, 0.0)))
        });
        let lines = wrapped.iter().flatten().map(|(_, lines)| lines.len()).max().unwrap_or(1);
        let height = lines as f32 * SMALL_LEADING + 2.0;
        if sheet.room() < height {
            sheet.new_page();
        }
        for (x, pair) in [0.0, half + 14.0].into_iter().zip(wrapped) {
            let Some((name, lines)) = pair else { continue };
            sheet.words_at(x, 0.78 * SMALL_LEADING, Face::Regular, SMALL, FAINT, name);
            for (number, line) in lines.iter().enumerate() {
                let down = (0.78 + number as f32) * SMALL_LEADING;
                sheet.words_at(x + NAME, down, Face::Regular, SMALL, INK, line);
            }
        }
        sheet.skip(height);
    }
    sheet.skip(8.0);
}

/// Width of a picture on the page, and its height with caption and the space below.
fn picture_height(drawing: &Drawing, caption: &str, fonts: &Fonts) -> (f32, f32) {
    let label = fonts.width(Face::Bold, SMALL, "Figure 00.") + 5.0;
    let words = fonts.wrap(Face::Regular, SMALL, caption, WIDTH, label).len() as f32 * SMALL_LEADING + 16.0;
    let shape = drawing.height_px as f32 / drawing.width_px.max(1) as f32;
    let tallest = PAGE.1 - TOP - BOTTOM - words - 30.0;
    let width = WIDTH.min(tallest / shape);
    (width, width * shape + words)
}

fn figure<'a>(sheet: &mut Sheet<'a>, drawing: &'a Drawing, number: usize, caption: &str) {
    let (width, needed) = picture_height(drawing, caption, sheet.fonts);
    if sheet.room() < needed && !sheet.is_fresh() {
        sheet.new_page();
    }
    let height = width * drawing.height_px as f32 / drawing.width_px.max(1) as f32;
    let (x, y) = (LEFT + 0.5 * (WIDTH - width), sheet.y);
    sheet.mark(Mark::Picture { x, y, width, height, number, drawing });
    sheet.skip(height + 2.0);
    sheet.labelled(&format!("Figure {number}."), caption);
    sheet.skip(14.0);
}

/// Two pictures of one height that fill the width together, or as much of it as their height allows.
fn pair<'a>(sheet: &mut Sheet<'a>, drawings: [&'a Drawing; 2], first: usize) {
    const BETWEEN: f32 = 10.0;
    const TALLEST: f32 = 195.0;
    let shapes = drawings.map(|drawing| drawing.width_px as f32 / drawing.height_px.max(1) as f32);
    let height = TALLEST.min((WIDTH - BETWEEN) / (shapes[0] + shapes[1]));
    if sheet.room() < height && !sheet.is_fresh() {
        sheet.new_page();
    }
    let spare = WIDTH - BETWEEN - height * (shapes[0] + shapes[1]);
    let (mut x, y) = (LEFT + 0.5 * spare, sheet.y);
    for (place, (drawing, shape)) in drawings.into_iter().zip(shapes).enumerate() {
        let width = shape * height;
        sheet.mark(Mark::Picture { x, y, width, height, number: first + place, drawing });
        x += width + BETWEEN;
    }
    sheet.skip(height + 12.0);
}

fn listing(sheet: &mut Sheet<'_>, text: &str) {
    let one = sheet.fonts.width(Face::Mono, CODE, "0");
    let columns = (WIDTH / one).floor().max(1.0) as usize;
    for line in text.lines() {
        let characters: Vec<char> = line.chars().collect();
        let pieces: Vec<String> = match characters.chunks(columns) {
            pieces if pieces.len() == 0 => vec![String::new()],
            pieces => pieces.map(|piece| piece.iter().collect()).collect(),
        };
        sheet.lines(&pieces, Face::Mono, CODE, CODE_LEADING, INK);
    }
    sheet.skip(8.0);
}
