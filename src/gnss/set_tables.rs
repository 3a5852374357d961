//! Parameters of a message's ephemeris, by the tables of the parts that carry them.

use crate::bits::{Element, FieldError, Store, add_to, quantise_all, read_all};
use crate::broadcast::{Ephemeris, SetForm};
use crate::message::{Raw, SetFields};
use crate::satellite::Sv;
use crate::time::Epoch;

/// Functions that return the content of an ephemeris, everything else blank, and the ephemeris of a content.
pub(crate) type Conversions<C> = (fn(Ephemeris) -> C, fn(C) -> Ephemeris);

/// Tables with the parameters of a message's ephemeris. `C` is the content that the tables describe, `S` the
/// bits of a part: a subframe, a word.
pub(crate) struct SetTables<C: 'static, S: 'static> {
    /// Meaning of clock and health.
    pub sets: &'static SetForm,
    /// One table for each part.
    pub parts: &'static [&'static [Element<C>]],
    /// Number of the first parts that carry the issue of the ephemeris.
    pub issued: usize,
    /// Parameters that are of a part and not of the ephemeris.
    pub passing: &'static [&'static str],
    /// Lists of the parameters that a fault must not change: they identify ephemeris or sender, all
    /// satellites send them alike, or they have a fault of their own.
    pub fixed: &'static [&'static [&'static str]],
    /// Function that returns a part without content.
    pub blank: fn() -> S,
    /// Conversions between ephemeris and content.
    pub content: Conversions<C>,
    /// Function that decodes an ephemeris from raw integers ([`Self::of_integers`]) and judges it.
    pub elements: fn(&Self, Sv, Raw<'_>, Epoch) -> Option<Ephemeris>,
    /// Function that brings an ephemeris to the form of the message and rounds it ([`Self::rounded`]).
    pub quantised: fn(&Self, &Ephemeris) -> Result<Ephemeris, FieldError>,
}

impl<C, S: Store> SetTables<C, S> {
    /// Tables all of whose parameters are of the ephemeris and may be changed.
    pub const fn of(
        sets: &'static SetForm,
        parts: &'static [&'static [Element<C>]],
        blank: fn() -> S,
        content: Conversions<C>,
    ) -> Self {
        Self {
            sets,
            parts,
            issued: parts.len(),
            passing: &[],
            fixed: &[],
            blank,
            content,
            elements: Self::of_integers,
            quantised: |own, ephemeris| own.rounded(ephemeris.clone()),
        }
    }

    /// Names of the parameters of the first parts, each once.
    fn names(&self, parts: usize) -> Vec<&'static str> {
        let mut names = Vec::new();
        for name in self.parts.iter().take(parts).copied().flatten().map(|element| element.field.name) {
            if !names.contains(&name) {
                names.push(name);
            }
        }
        names
    }

    /// Value of a parameter by its raw integer; `None` if there is none of this name.
    pub fn value(&self, name: &str, raw: Raw<'_>) -> Option<f64> {
        let mut fields = self.parts.iter().copied().flatten().map(|element| &element.field);
        let field = fields.find(|field| field.name == name)?;
        raw(name).map(|raw| field.value(raw))
    }

    /// Returns the ephemeris after encoding and decoding.
    ///
    /// # Errors
    /// A value that the message cannot carry.
    pub fn rounded(&self, ephemeris: Ephemeris) -> Result<Ephemeris, FieldError> {
        let mut content = (self.content.0)(ephemeris);
        self.parts.iter().try_for_each(|table| quantise_all(table, &mut content))?;
        Ok((self.content.1)(content))
    }

    /// Decodes the ephemeris of parts, in the order of the tables, that were sent at `sent`.
    pub fn decoded<'s>(&self, sv: Sv, parts: impl IntoIterator<Item = &'s S>, sent: Epoch) -> Ephemeris
    where
        S: 's,
    {
        let mut content = (self.content.0)(Ephemeris { form: self.sets, ..Ephemeris::blank(sv, sent) });
        for (table, part) in self.parts.iter().zip(parts) {
            read_all(table, part, &mut content);
        }
        (self.content.1)(content)
    }

    /// Decodes the ephemeris of raw integers, as if its parts had been sent at `near`. `None` if one is
    /// missing.
    pub fn of_integers(&self, sv: Sv, raw: Raw<'_>, near: Epoch) -> Option<Ephemeris> {
        let mut parts = Vec::new();
        for table in self.parts {
            let mut part = (self.blank)();
            // The ephemeris has the time of its transmission already.
            for field in table.iter().map(|element| &element.field).filter(|own| !self.passing.contains(&own.name)) {
                field.write(&mut part, raw(field.name)?);
            }
            parts.push(part);
        }
        Some(self.decoded(sv, &parts, near))
    }
}

impl<C, S: Store> SetFields for SetTables<C, S> {
    fn parameters(&self) -> Vec<&'static str> {
        let mut names = self.names(self.issued);
        names.retain(|name| !self.passing.contains(name));
        names
    }

    fn elements(&self, sv: Sv, raw: Raw<'_>, near: Epoch) -> Option<Ephemeris> {
        (self.elements)(self, sv, raw, near)
    }

    fn quantised(&self, ephemeris: &Ephemeris) -> Result<Ephemeris, FieldError> {
        (self.quantised)(self, ephemeris)
    }

    fn adjustable(&self) -> Vec<&'static str> {
        let mut names = self.names(self.parts.len());
        names.retain(|name| !self.fixed.iter().any(|names| names.contains(name)));
        names
    }

    fn adjust(&self, ephemeris: &mut Ephemeris, parameter: &str, by: f64) -> bool {
        let mut content = (self.content.0)(ephemeris.clone());
        let found = self.parts.iter().any(|table| add_to(table, parameter, &mut content, by));
        *ephemeris = (self.content.1)(content);
        found
    }
}
