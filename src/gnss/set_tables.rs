//! Parameters of a message's ephemeris, by the tables of the parts that carry them.

use crate::bits::{Element, FieldError, Store, add_to, quantise_all, read_all};
use crate::broadcast::{Ephemeris, SetForm};
use crate::message::Raw;
use crate::satellite::Sv;
use crate::time::Epoch;

/// Tables with the parameters of a message's ephemeris. `C` is the content that the tables describe, `S` the
/// bits of a part: a subframe, a word.
pub(crate) struct SetTables<C: 'static, S> {
    /// One table for each part.
    pub parts: &'static [&'static [Element<C>]],
    /// Parameters that are of a part and not of the ephemeris.
    pub passing: &'static [&'static str],
    /// Lists of the parameters that a fault must not change: they identify ephemeris or sender, all
    /// satellites send them alike, or they have a fault of their own.
    pub fixed: &'static [&'static [&'static str]],
    /// Meaning of clock and health.
    pub sets: &'static SetForm,
    /// Function that returns a part without content.
    pub blank: fn() -> S,
    /// Function that returns the content of an ephemeris; everything else is blank.
    pub content: fn(Ephemeris) -> C,
    /// Function that returns the ephemeris of a content.
    pub ephemeris: fn(C) -> Ephemeris,
}

impl<C, S: Store> SetTables<C, S> {
    fn names(&self) -> impl Iterator<Item = &'static str> {
        self.parts.iter().copied().flatten().map(|element| element.field.name)
    }

    /// Value of a parameter by its raw integer; `None` if there is none of this name.
    pub fn value(&self, name: &str, raw: Raw<'_>) -> Option<f64> {
        let mut fields = self.parts.iter().copied().flatten().map(|element| &element.field);
        let field = fields.find(|field| field.name == name)?;
        raw(name).map(|raw| field.value(raw))
    }

    /// Names of the parameters of the ephemeris.
    pub fn parameters(&self) -> Vec<&'static str> {
        self.names().filter(|name| !self.passing.contains(name)).collect()
    }

    /// Names of the parameters that a fault may change.
    pub fn adjustable(&self) -> Vec<&'static str> {
        self.names().filter(|name| !self.fixed.iter().any(|names| names.contains(name))).collect()
    }

    /// Adds `by` to a parameter in the unit of the tables. Returns false if there is none.
    pub fn adjust(&self, ephemeris: &mut Ephemeris, parameter: &str, by: f64) -> bool {
        let mut content = (self.content)(ephemeris.clone());
        let found = self.parts.iter().any(|table| add_to(table, parameter, &mut content, by));
        *ephemeris = (self.ephemeris)(content);
        found
    }

    /// Returns the ephemeris as a receiver decodes it after transmission; `transmitted` stays, and so does
    /// what the message does not state.
    ///
    /// # Errors
    /// A value that the message cannot carry.
    pub fn quantised(&self, ephemeris: Ephemeris) -> Result<Ephemeris, FieldError> {
        let mut content = (self.content)(ephemeris);
        self.parts.iter().try_for_each(|table| quantise_all(table, &mut content))?;
        Ok((self.ephemeris)(content))
    }

    /// Decodes the ephemeris of parts, in the order of the tables, that were sent at `sent`.
    pub fn decoded<'s>(&self, sv: Sv, parts: impl IntoIterator<Item = &'s S>, sent: Epoch) -> Ephemeris
    where
        S: 's,
    {
        let mut content = (self.content)(Ephemeris { form: self.sets, ..Ephemeris::blank(sv, sent) });
        for (table, part) in self.parts.iter().zip(parts) {
            read_all(table, part, &mut content);
        }
        (self.ephemeris)(content)
    }

    /// Decodes the ephemeris of raw integers, as if its parts had been sent at `near`. `None` if one is
    /// missing.
    pub fn elements(&self, sv: Sv, raw: Raw<'_>, near: Epoch) -> Option<Ephemeris> {
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
