//! Reports as PDF: text, tables and vector pictures on A4 pages, with nothing but the bundled fonts.
//!
//! The items of a [`Report`] flow down the pages: headings, wrapped text, facts, tables whose header is
//! repeated on every page, pictures with numbered captions, listings. The same report gives the same bytes:
//! no clock, no random identifiers. krilla writes the file, krilla-svg the pictures; text stays text, to be
//! searched and copied. Limits: left to right; no hyphenation; characters that the fonts lack become question
//! marks.

mod fonts;
mod layout;
mod table;
#[cfg(test)]
mod tests;
mod write;

use thiserror::Error;

use super::document::Report;

/// Error in the making of a report. Each is a fault of the program, not of its data.
#[derive(Debug, Error)]
pub enum PdfError {
    /// A font of the program cannot be used.
    #[error("the bundled font {0} is unreadable")]
    Font(&'static str),
    /// A picture, counted from 1, cannot be put on a page.
    #[error("picture {number}: {reason}")]
    Picture {
        /// Number of the picture, counted from 1.
        number: usize,
        /// Reason in words.
        reason: String,
    },
    /// The document cannot be put together.
    #[error("the PDF could not be written: {0}")]
    Write(String),
}

impl Report {
    /// The report as a PDF file.
    ///
    /// # Errors
    /// [`PdfError`] where a font, a picture or the file itself cannot be made.
    pub fn pdf(&self) -> Result<Vec<u8>, PdfError> {
        let fonts = fonts::Fonts::new()?;
        write::pdf(self, &layout::lay_out(self, &fonts), &fonts)
    }
}
