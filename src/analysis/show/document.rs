//! Reports as items in a row, before they are paper or a page.
//!
//! A [`Report`] is a list of items: headings, text, facts, tables, pictures, listings. It knows nothing of
//! runs or studies. `pdf` prints it and `page` makes one file for a browser of it, so both say the same.

use crate::show::plot::sketch::Figure;

/// Forms in which a report is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Forms {
    /// Pages for paper; never without the feature `pdf`.
    pub pdf: bool,
    /// One page for a browser.
    pub html: bool,
}

impl Forms {
    /// Both forms.
    pub const BOTH: Self = Self { pdf: true, html: true };
}

/// Meaning of a cell or a banner. Its colours are distinct for colour-blind people, and the words say it too.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Tone {
    /// Same weight as the surrounding text.
    #[default]
    Plain,
    /// Less weight than the surrounding text.
    Faint,
    /// Bold text.
    Strong,
    /// Green: passed.
    Good,
    /// Orange: marginal.
    Caution,
    /// Red: failed.
    Bad,
}

/// One cell of a table.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Cell {
    /// Text of the cell.
    pub text: String,
    /// Meaning of the cell, which sets its colour.
    pub tone: Tone,
}

impl Cell {
    /// A cell with a tone.
    pub fn toned(text: impl Into<String>, tone: Tone) -> Self {
        Self { text: text.into(), tone }
    }
}

impl<T: Into<String>> From<T> for Cell {
    fn from(text: T) -> Self {
        Self { text: text.into(), tone: Tone::Plain }
    }
}

/// Side on which a column's text is aligned; numbers are aligned right.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Side {
    /// Words, flush left.
    Left,
    /// Numbers, flush right.
    Right,
}

/// A table; rows shorter than the header end in empty cells.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Table {
    /// Heading and side of each.
    pub columns: Vec<(String, Side)>,
    /// Cells of each row, as many as there are columns.
    pub rows: Vec<Vec<Cell>>,
    /// Above it, with its number; empty for a table without either.
    pub caption: String,
    /// Group of each row; empty where rows have none. A page sorts by it.
    pub groups: Vec<String>,
    /// Number of rows that are printed; a page has room for all.
    pub printed: Option<usize>,
}

impl Table {
    /// A table without rows.
    pub fn new<'a>(caption: impl Into<String>, columns: impl IntoIterator<Item = (&'a str, Side)>) -> Self {
        let columns = columns.into_iter().map(|(title, side)| (title.to_owned(), side)).collect();
        Self { columns, caption: caption.into(), ..Self::default() }
    }

    /// Rows that are printed.
    pub fn printed(&self) -> &[Vec<Cell>] {
        let most = self.printed.unwrap_or(usize::MAX).min(self.rows.len());
        self.rows.get(..most).unwrap_or(&[])
    }

    /// Adds a row.
    pub fn row<C: Into<Cell>>(&mut self, cells: impl IntoIterator<Item = C>) {
        self.rows.push(cells.into_iter().map(Into::into).collect());
    }
}

/// Element in the flow of the pages.
#[derive(Clone, Debug)]
pub enum Item {
    /// Heading of a chapter, listed in the outline.
    Heading(String),
    /// Heading within a chapter.
    Subheading(String),
    /// A paragraph.
    Text(String),
    /// Paragraph in small letters.
    Note(String),
    /// A bar across the page.
    Banner(String, Tone),
    /// Names and values, two pairs a row.
    Facts(Vec<(String, String)>),
    /// A table, over several pages where it is long.
    Table(Table),
    /// A picture as wide as the text, and its caption below.
    Figure(Figure),
    /// Two pictures side by side, without captions.
    Pair(Box<[Figure; 2]>),
    /// Lines as they are, in a font of equal widths.
    Listing(String),
    /// Page break.
    NewPage,
}

/// A report to be printed or shown.
#[derive(Clone, Debug, Default)]
pub struct Report {
    /// Title on the first page and at the head of the others.
    pub title: String,
    /// Text below the title.
    pub subtitle: String,
    /// Text at the right of every page's head; the title is at its left.
    pub head: String,
    /// Elements in the order of the pages.
    pub items: Vec<Item>,
}

impl Report {
    /// An empty report.
    pub fn new(title: impl Into<String>, subtitle: impl Into<String>, head: impl Into<String>) -> Self {
        Self { title: title.into(), subtitle: subtitle.into(), head: head.into(), items: Vec::new() }
    }

    /// Adds an item.
    pub fn add(&mut self, item: Item) -> &mut Self {
        self.items.push(item);
        self
    }

    /// Starts a chapter.
    pub fn heading(&mut self, text: impl Into<String>) -> &mut Self {
        self.add(Item::Heading(text.into()))
    }

    /// Starts a part of a chapter.
    pub fn subheading(&mut self, text: impl Into<String>) -> &mut Self {
        self.add(Item::Subheading(text.into()))
    }

    /// Adds a paragraph.
    pub fn text(&mut self, text: impl Into<String>) -> &mut Self {
        self.add(Item::Text(text.into()))
    }

    /// Adds a table.
    pub fn table(&mut self, table: Table) -> &mut Self {
        self.add(Item::Table(table))
    }

    /// Adds a picture.
    pub fn figure(&mut self, figure: Figure) -> &mut Self {
        self.add(Item::Figure(figure))
    }
}
