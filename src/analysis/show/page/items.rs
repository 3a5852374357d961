//! Items of a report as HTML.

use super::data::Data;
use super::encode::escaped;
use super::{HELP, OVER_TIME};
use crate::show::document::{Cell, Item, Side, Table, Tone};
use crate::show::plot::sketch::Figure;

/// Rows of a table that gets a filter.
const LONG: usize = 15;

/// HTML of the page's body while it grows.
pub(super) struct Writer<'d> {
    html: String,
    data: &'d mut Data,
    tables: usize,
    figures: usize,
}

impl<'d> Writer<'d> {
    /// An empty body.
    pub fn new(data: &'d mut Data) -> Self {
        Self { html: String::new(), data, tables: 0, figures: 0 }
    }

    /// The HTML.
    pub fn finish(self) -> String {
        self.html
    }

    /// Adds HTML of the program's own.
    pub fn push(&mut self, html: &str) {
        self.html.push_str(html);
        self.html.push('\n');
    }

    /// Adds a chapter.
    pub fn section(&mut self, title: &str, items: &[&Item]) {
        let is_overview = self.html.is_empty();
        self.push(&format!("<section id=\"{}\">", anchor(title)));
        self.push(&format!("<h2{}>{}</h2>", if is_overview { " class=\"unseen\"" } else { "" }, escaped(title)));
        if title == OVER_TIME {
            self.push(&format!(
                "<details class=\"note\"><summary>How to use the plots</summary><p>{HELP}</p></details>"
            ));
        }
        items.iter().for_each(|item| self.item(item));
        self.push("</section>");
    }

    fn item(&mut self, item: &Item) {
        match item {
            Item::Heading(text) => self.push(&format!("<h2>{}</h2>", escaped(text))),
            Item::Subheading(text) => self.push(&format!("<h3>{}</h3>", escaped(text))),
            Item::Text(text) => self.push(&format!("<p>{}</p>", escaped(text))),
            Item::Note(text) => self.push(&format!("<p class=\"note\">{}</p>", escaped(text))),
            Item::Banner(text, tone) => {
                self.push(&format!("<p class=\"banner {}\">{}</p>", class(*tone), escaped(text).replace('\n', "<br>")));
            }
            Item::Facts(pairs) => {
                let one = |(name, value): &(String, String)| {
                    format!("<div><dt>{}</dt><dd>{}</dd></div>\n", escaped(name), escaped(value))
                };
                let pairs: String = pairs.iter().map(one).collect();
                self.push(&format!("<dl>\n{pairs}</dl>"));
            }
            Item::Table(table) => self.table(table),
            Item::Figure(figure) => self.figure(figure),
            Item::Pair(both) => {
                self.push("<div class=\"pair\">");
                both.iter().for_each(|figure| self.figure(figure));
                self.push("</div>");
            }
            Item::Listing(text) => self.push(&format!("<pre tabindex=\"0\">{}</pre>", escaped(text))),
            Item::NewPage => {}
        }
    }

    fn figure(&mut self, figure: &Figure) {
        let index = self.data.add(figure);
        let name = anchor(&figure.name);
        self.push(&format!("<figure id=\"figure-{name}\" data-figure=\"{index}\">\n<div class=\"plots\"></div>"));
        if !figure.caption.is_empty() {
            self.figures += 1;
            let caption = escaped(&figure.caption);
            self.push(&format!("<figcaption><b>Figure {}.</b> {caption}</figcaption>", self.figures));
        }
        self.push("</figure>");
    }

    fn table(&mut self, table: &Table) {
        let filtered = table.rows.len() > LONG || !table.groups.is_empty();
        self.push(&format!("<div class=\"scrolled\"><table{}>", if filtered { " data-filter" } else { "" }));
        if !table.caption.is_empty() {
            self.tables += 1;
            self.push(&format!("<caption><b>Table {}.</b> {}</caption>", self.tables, escaped(&table.caption)));
        }
        let head = |(title, side): &(String, Side)| {
            format!("<th scope=\"col\"{}>{}</th>", classes(*side, Tone::Plain), escaped(title))
        };
        let heads: String = table.columns.iter().map(head).collect();
        self.push(&format!("<thead><tr>{heads}</tr></thead>\n<tbody>"));
        for (place, cells) in table.rows.iter().enumerate() {
            let group = table.groups.get(place).map(|group| format!(" data-group=\"{}\"", escaped(group)));
            let cell = |(cell, (_, side)): (&Cell, &(String, Side))| {
                format!("<td{}>{}</td>", classes(*side, cell.tone), escaped(&cell.text).replace('\n', "<br>"))
            };
            let cells: String = cells.iter().zip(&table.columns).map(cell).collect();
            self.push(&format!("<tr{}>{cells}</tr>", group.unwrap_or_default()));
        }
        self.push("</tbody></table></div>");
    }
}

/// Identifier of a heading or a figure: its letters and digits.
pub(super) fn anchor(title: &str) -> String {
    let letter = |letter: char| if letter.is_ascii_alphanumeric() { letter.to_ascii_lowercase() } else { '-' };
    title.chars().map(letter).collect()
}

fn class(tone: Tone) -> &'static str {
    match tone {
        Tone::Plain => "plain",
        Tone::Faint => "faint",
        Tone::Strong => "strong",
        Tone::Good => "good",
        Tone::Caution => "caution",
        Tone::Bad => "bad",
    }
}

fn classes(side: Side, tone: Tone) -> String {
    match (side, tone) {
        (Side::Left, Tone::Plain) => String::new(),
        (Side::Right, Tone::Plain) => " class=\"right\"".to_owned(),
        (Side::Left, tone) => format!(" class=\"{}\"", class(tone)),
        (Side::Right, tone) => format!(" class=\"right {}\"", class(tone)),
    }
}
