//! Laws of the printed page, on a report with everything in it.

use super::fonts::{Face, Fonts};
use super::layout::{LEFT, Mark, PAGE, WIDTH, lay_out};
use crate::show::document::{Cell, Item, Report, Side, Table, Tone};
use crate::show::plot::canvas::{Axis, BLUE, Chart, Mark as Look, ORANGE, Series, WIDTH_PX};
use crate::show::plot::sketch::{Figure, Sketch};

fn figure(points: i32) -> Figure {
    let wave = |n: i32| (f64::from(n), libm::sin(f64::from(n) * 0.1));
    let dots = Series::new("dots", BLUE, Look::Dots, (0..points).map(wave).collect());
    let line = Series::new("a line", ORANGE, Look::Line, (0..points).map(wave).collect());
    let chart = Chart::new(
        "Waves",
        Axis::new("time (s)", (0.0, f64::from(points))),
        Axis::new("height (m)", (-1.2, 1.2)),
        vec![],
    );
    let chart = Chart { series: vec![dots.clone(), line.clone()], ..chart };
    let sketch = Sketch::charts((WIDTH_PX, 300), 1, [chart], [dots, line]);
    Figure::new("waves", sketch, "What to look at in a picture of waves. ".repeat(4)).unwrap()
}

const ROWS: usize = 150;

fn everything() -> Report {
    let mut report = Report::new("A study of µ, σ² and <angle & brackets>", "with all there is", "seed 7");
    report.add(Item::Banner(
        "3 passed, 1 marginal, 1 failed\nFailed: something long enough to be written in more than \
                             one line of this banner, which is wide"
            .into(),
        Tone::Bad,
    ));
    report.add(Item::Facts(
        (0..9).map(|n| (format!("fact {n}"), format!("value {}", "of some length ".repeat(n % 4)))).collect(),
    ));
    report
        .heading("Text")
        .text("Words that go on. ".repeat(120))
        .subheading("Smaller")
        .add(Item::Note("Notes. ".repeat(90)));
    let mut table = Table::new(
        "A table longer than a page.",
        [("name", Side::Left), ("value", Side::Right), ("meaning", Side::Left)],
    );
    for row in 0..ROWS {
        let tone = [Tone::Good, Tone::Caution, Tone::Bad][row % 3];
        let long = if row % 10 == 0 {
            "a meaning that takes several lines of its column ".repeat(6)
        } else {
            "short".to_owned()
        };
        table.row([Cell::from(format!("row {row}")), Cell::toned(format!("{}", row * row), tone), Cell::from(long)]);
    }
    report.table(table);
    report.heading("Pictures");
    (0..3).for_each(|n| {
        report.figure(figure(400 + n));
    });
    report.heading("Listing").add(Item::Listing(format!("a = 1\n\n\tb = \"{}\"\n", "long".repeat(60))));
    report
}

#[test]
fn the_same_report_gives_the_same_bytes_with_its_fonts_embedded() {
    let pdf = everything().pdf().unwrap();
    assert!(pdf.starts_with(b"%PDF-") && pdf == everything().pdf().unwrap());
    let count = |what: &[u8]| pdf.windows(what.len()).filter(|window| window == &what).count();
    // Regular, bold and equal widths, each a subset of a TrueType font in the file.
    assert_eq!(count(b"/FontFile2"), 3);
    assert!(count(b"/MediaBox") > 5, "{} pages", count(b"/MediaBox"));
    assert_eq!(count(b"/CreationDate"), 0);
    // Three pictures of 400 dots and a line as vectors.
    assert!(pdf.len() < 300_000 && count(b"/Subtype/Image") + count(b"/Subtype /Image") == 0, "{} bytes", pdf.len());
}

#[test]
fn nothing_overlaps_and_nothing_leaves_the_text_s_frame() {
    let (fonts, report) = (Fonts::new().unwrap(), everything());
    let pages = lay_out(&report, &fonts);
    assert!(pages.pages.len() > 5);
    for (number, marks) in pages.pages.iter().enumerate() {
        let mut boxes: Vec<(f32, f32, f32, f32, &str)> = Vec::new();
        for mark in marks {
            let one = match mark {
                // From the height of capitals to below the baseline.
                Mark::Words { x, y, face, size, text, .. } => {
                    (*x, y - 0.73 * size, fonts.width(*face, *size, text), 0.95 * size, text.as_str())
                }
                Mark::Picture { x, y, width, height, .. } => (*x, *y, *width, *height, "a picture"),
                Mark::Block { .. } => continue,
            };
            let (x, y, width, height, what) = one;
            assert!(x >= LEFT - 0.1 && x + width <= LEFT + WIDTH + 0.1, "{what} leaves page {number} sideways");
            assert!(y >= 50.0 && y + height <= PAGE.1 - 50.0, "{what} leaves page {number} at {y}");
            for &(other_x, other_y, other_width, other_height, other) in &boxes {
                let apart = x + width <= other_x + 0.1
                    || other_x + other_width <= x + 0.1
                    || y + height <= other_y + 0.1
                    || other_y + other_height <= y + 0.1;
                assert!(apart, "{what:?} overlaps {other:?} on page {number}");
            }
            boxes.push(one);
        }
    }
}

#[test]
fn a_table_over_several_pages_repeats_its_header_and_loses_no_row() {
    let (fonts, report) = (Fonts::new().unwrap(), everything());
    let pages = lay_out(&report, &fonts);
    let words = |page: &Vec<Mark<'_>>| -> Vec<String> {
        page.iter()
            .filter_map(|mark| if let Mark::Words { text, .. } = mark { Some(text.clone()) } else { None })
            .collect()
    };
    let mut rows = 0;
    let mut pages_with_rows = 0;
    for page in &pages.pages {
        let words = words(page);
        let own = words.iter().filter(|text| text.starts_with("row ")).count();
        rows += own;
        if own > 0 {
            pages_with_rows += 1;
            assert_eq!(words.iter().filter(|text| *text == "meaning").count(), 1, "a page without the header");
        }
    }
    assert_eq!(rows, ROWS);
    assert!(pages_with_rows > 2);
    let titles: Vec<&str> = pages.chapters.iter().map(|(title, ..)| title.as_str()).collect();
    assert_eq!(titles, ["Text", "Pictures", "Listing"]);
}

#[test]
fn lines_are_no_longer_than_their_width_and_keep_every_word() {
    let fonts = Fonts::new().unwrap();
    let text =
        "The longest word here is incomprehensibilities, but averyveryveryverylongwordwithoutanyblankinit breaks.";
    for (width, indent) in [(60.0, 0.0), (120.0, 50.0), (400.0, 0.0)] {
        let lines = fonts.wrap(Face::Regular, 9.0, text, width, indent);
        for (number, line) in lines.iter().enumerate() {
            let room = if number == 0 { width - indent } else { width };
            assert!(fonts.width(Face::Regular, 9.0, line) <= room + 0.01, "{line}");
        }
        let letters = |text: &str| text.chars().filter(|c| !c.is_whitespace()).collect::<String>();
        assert_eq!(letters(&lines.concat()), letters(text));
    }
    // A glyph that no font has becomes a question mark, one that only the regular font has is taken from
    // there.
    let glyphs = fonts.glyphs(Face::Bold, "a\u{1F6F0}\u{2708}");
    assert_eq!(glyphs[1].id, fonts.glyphs(Face::Bold, "?")[0].id);
    assert_eq!((glyphs[2].face, glyphs.len()), (Face::Regular, 3));
}

#[test]
fn an_empty_report_is_one_page() {
    let report = Report::new("Nothing", "", "");
    assert_eq!(lay_out(&report, &Fonts::new().unwrap()).pages.len(), 1);
    assert!(report.pdf().unwrap().starts_with(b"%PDF-"));
}
