//! Tables: how wide their columns are, and their rows down the pages under a header that each page repeats.

use super::fonts::{Face, Fonts, words};
use super::layout::{FAINT, INK, RULE, Sheet, WIDTH, ink};
use crate::show::document::{Cell, Side, Table, Tone};

const SIZE: f32 = 8.0;
const LEADING: f32 = 10.4;
const PADDING: f32 = 2.3;
const GAP: f32 = 12.0;
/// Rows of a table that is not broken over pages.
const SHORT: usize = 12;

/// One row with its cells wrapped.
struct TableRow {
    cells: Vec<(Vec<String>, Tone)>,
    height: f32,
}

/// Height of a table's caption, header and first rows, or of all of a short one: what must fit for it to
/// begin on a page.
pub(super) fn least_height(table: &Table, fonts: &Fonts) -> f32 {
    let widths = widths(table, fonts);
    let rows = if table.printed().len() <= SHORT { SHORT } else { 2 };
    let rows = table.printed().iter().take(rows).map(|cells| row(cells, &widths, fonts).height).sum::<f32>();
    26.0 + header(table, &widths, fonts).height + rows
}

/// Lays a table out below what is there.
pub(super) fn lay_out(sheet: &mut Sheet<'_>, table: &Table) {
    let widths = widths(table, sheet.fonts);
    let header = header(table, &widths, sheet.fonts);
    let draw_header = |sheet: &mut Sheet<'_>| {
        sheet.rule(0.0, WIDTH, 0.8, INK);
        draw(sheet, table, &header, &widths);
        sheet.rule(0.0, WIDTH, 0.5, INK);
    };
    draw_header(sheet);
    for (index, cells) in table.printed().iter().enumerate() {
        let row = row(cells, &widths, sheet.fonts);
        if sheet.room() < row.height {
            sheet.rule(0.0, WIDTH, 0.8, INK);
            sheet.new_page();
            draw_header(sheet);
        } else if index > 0 {
            sheet.rule(0.0, WIDTH, 0.25, RULE);
        }
        draw(sheet, table, &row, &widths);
    }
    sheet.rule(0.0, WIDTH, 0.8, INK);
    sheet.skip(10.0);
}

fn header(table: &Table, widths: &[f32], fonts: &Fonts) -> TableRow {
    let titles: Vec<Cell> = table.columns.iter().map(|(title, _)| Cell::toned(title.clone(), Tone::Strong)).collect();
    row(&titles, widths, fonts)
}

fn face(tone: Tone) -> Face {
    match tone {
        Tone::Plain | Tone::Faint => Face::Regular,
        Tone::Strong | Tone::Good | Tone::Caution | Tone::Bad => Face::Bold,
    }
}

fn row(cells: &[Cell], widths: &[f32], fonts: &Fonts) -> TableRow {
    let wrapped: Vec<(Vec<String>, Tone)> = (cells.iter().zip(widths))
        .map(|(cell, width)| (fonts.wrap(face(cell.tone), SIZE, &cell.text, *width + 0.01, 0.0), cell.tone))
        .collect();
    let lines = wrapped.iter().map(|(lines, _)| lines.len()).max().unwrap_or(1);
    TableRow { cells: wrapped, height: lines as f32 * LEADING + 2.0 * PADDING }
}

fn draw(sheet: &mut Sheet<'_>, table: &Table, row: &TableRow, widths: &[f32]) {
    let mut left = 0.0;
    for (((lines, tone), width), (_, side)) in row.cells.iter().zip(widths).zip(&table.columns) {
        let face = face(*tone);
        for (number, line) in lines.iter().enumerate() {
            let x = match side {
                Side::Left => left,
                Side::Right => left + width - sheet.fonts.width(face, SIZE, line),
            };
            let down = PADDING + 0.78 * LEADING + number as f32 * LEADING;
            let colour = if *tone == Tone::Faint { FAINT } else { ink(*tone) };
            sheet.words_at(x, down, face, SIZE, colour, line);
        }
        left += width + GAP;
    }
    sheet.skip(row.height);
}

/// Widths of the columns in points. They are as wide as their longest cells if the page holds that. Otherwise
/// the longest are cut, though no column below its longest word while there is room for all of those.
fn widths(table: &Table, fonts: &Fonts) -> Vec<f32> {
    let columns = table.columns.len();
    let (mut natural, mut least) = (vec![0.0_f32; columns], vec![0.0_f32; columns]);
    let titles = table.columns.iter().map(|(title, _)| Cell::toned(title.clone(), Tone::Strong)).collect::<Vec<_>>();
    for row in std::iter::once(&titles).chain(&table.rows) {
        for ((cell, natural), least) in row.iter().zip(&mut natural).zip(&mut least) {
            let width = |text: &str| fonts.width(face(cell.tone), SIZE, text);
            *natural = cell.text.split('\n').map(width).fold(*natural, f32::max);
            *least = words(&cell.text).map(width).fold(*least, f32::max);
        }
    }
    let room = WIDTH - GAP * columns.saturating_sub(1) as f32;
    let wanted: f32 = natural.iter().sum();
    if wanted <= room {
        // What is left over goes between the columns.
        let more = (room - wanted) / columns.max(1) as f32;
        return natural.iter().map(|width| width + more).collect();
    }
    let needed: f32 = least.iter().sum();
    if needed >= room {
        return least.iter().map(|width| width * room / needed).collect();
    }
    // Long columns give way first: none is wider than a common bound, none narrower than its longest word.
    let bounded = |bound: f32| natural.iter().zip(&least).map(move |(natural, least)| natural.min(bound).max(*least));
    let (mut low, mut high) = (0.0, room);
    for _ in 0..40 {
        let middle = 0.5 * (low + high);
        if bounded(middle).sum::<f32>() <= room { low = middle } else { high = middle }
    }
    bounded(low).collect()
}
