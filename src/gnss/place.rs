//! Line and column of keys and values in a TOML text, and the nearest right word, for error messages.
//!
//! Source: TOML 1.0, through the spans of the `toml` crate. Keys are named from the top, with dots between: a
//! quoted key that has dots of its own is one with the tables that it abbreviates. Arrays are not looked
//! into.

use std::ops::Range;

use toml::de::{DeTable, DeValue};

use crate::renamed::{self, Class};

/// The keys of a text.
pub struct Keys<'t> {
    origin: &'t str,
    text: &'t str,
    entries: Vec<(String, Range<usize>, Range<usize>)>,
}

impl<'t> Keys<'t> {
    /// Indexes the keys of `text`, which errors call `origin`. The index is empty if the text is not TOML.
    pub fn new(origin: &'t str, text: &'t str) -> Self {
        let mut keys = Self { origin, text, entries: Vec::new() };
        if let Ok(document) = DeTable::parse(text) {
            keys.walk("", document.get_ref());
        }
        keys
    }

    fn walk(&mut self, above: &str, table: &DeTable<'_>) {
        for (key, value) in table {
            let path = if above.is_empty() { key.get_ref().to_string() } else { format!("{above}.{}", key.get_ref()) };
            self.entries.push((path.clone(), key.span(), value.span()));
            if let DeValue::Table(below) = value.get_ref() {
                self.walk(&path, below);
            }
        }
    }

    /// `origin:line:column` of a byte of the text.
    pub fn place(&self, byte: usize) -> String {
        let before = self.text.get(..byte).unwrap_or(self.text);
        let line = before.matches('\n').count() + 1;
        let column = before.rsplit('\n').next().unwrap_or("").chars().count() + 1;
        format!("{}:{line}:{column}", self.origin)
    }

    /// Position of a key, or of the nearest enclosing table if the key is absent. Without either it is the
    /// name of the text.
    pub fn place_of(&self, path: &str) -> String {
        self.start_of(path).map_or_else(|| self.origin.to_owned(), |start| self.place(start))
    }

    /// Byte at which a key begins, or the nearest enclosing table if the key is absent. `None` without
    /// either.
    pub fn start_of(&self, path: &str) -> Option<usize> {
        let mut path = path;
        loop {
            if let Some((_, key, _)) = self.entries.iter().find(|(name, ..)| name == path) {
                return Some(key.start);
            }
            (path, _) = path.rsplit_once('.')?;
        }
    }

    /// Returns the innermost key whose value contains a byte.
    pub fn holding(&self, byte: usize) -> Option<&str> {
        let inside =
            self.entries.iter().filter(|(_, _, value)| value.start <= byte && byte < value.end.max(value.start + 1));
        inside.max_by_key(|(name, ..)| name.len()).map(|(name, ..)| name.as_str())
    }
}

/// Candidate most similar to `word`, if any is similar: the name now of a key of earlier versions, else
/// likeness by Jaro and Winkler above 0.75. Case, blanks, slashes, hyphens and underscores do not count.
pub fn nearest(word: &str, candidates: &[&str]) -> Option<String> {
    let now = renamed::find(Class::Key, word).map(|(_, now)| now);
    if let Some(now) = now.filter(|now| candidates.contains(now)) {
        return Some(now.to_owned());
    }
    let bare = bare(word);
    candidates
        .iter()
        .map(|candidate| (strsim::jaro_winkler(&bare, &self::bare(candidate)), *candidate))
        .max_by(|a, b| a.0.total_cmp(&b.0))
        .filter(|(likeness, _)| *likeness > 0.75)
        .map(|(_, candidate)| candidate.to_owned())
}

/// A word in lower case without blanks, slashes, hyphens and underscores.
pub fn bare(word: &str) -> String {
    word.to_lowercase().chars().filter(|c| !c.is_whitespace() && !"/-_".contains(*c)).collect()
}

/// A count and its noun, in the plural unless it is one.
pub fn counted(count: usize, noun: &str) -> String {
    if count == 1 { format!("1 {noun}") } else { format!("{count} {noun}s") }
}

/// End of a message about an unknown key: its name now, or the nearest known key. `key` may have its tables.
pub fn hint(key: &str, nearest: Option<&str>) -> String {
    let now = renamed::find(Class::Key, key.rsplit('.').next().unwrap_or(key)).map(|(_, now)| now);
    match nearest {
        Some(near) if now == Some(near) => format!(": it is called '{near}' now"),
        Some(near) => format!(": did you mean '{near}'?"),
        None => String::new(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keys_are_found_in_tables_of_every_form() {
        let text = "a = 1\n[b]\nc = 2\n  d.e = 3\n\"f.g\" = { h = 4 }\n";
        let keys = Keys::new("x", text);
        let of = |path| keys.place_of(path);
        assert_eq!([of("a"), of("b.c"), of("b.d.e")], ["x:1:1", "x:3:1", "x:4:5"].map(str::to_owned));
        assert_eq!([of("b.f.g.h"), of("b.f.g.other"), of("nothing")], ["x:5:11", "x:5:1", "x"].map(str::to_owned));
        assert_eq!(keys.holding(text.find('4').unwrap()), Some("b.f.g.h"));
        assert_eq!(keys.holding(text.find('3').unwrap()), Some("b.d.e"));
        assert_eq!(Keys::new("x", "= 1").place_of("a"), "x");
    }

    #[test]
    fn a_word_is_near_above_a_likeness_of_three_quarters_whatever_its_case() {
        // Three of five letters are in place: Jaro's likeness is (3/5 + 3/5 + 3/3)/3 = 0.733. Winkler adds a
        // tenth of what is missing to 1 for each letter that both begin with: 0.760 with one of them.
        let of = |word: &str| nearest(word, &["seed", "noise", "motion"]);
        assert_eq!(of("nxixe").as_deref(), Some("noise"));
        assert_eq!(of("NXIXE").as_deref(), Some("noise"));
        assert_eq!(of("xoixe"), None);
        assert_eq!(nearest("noise", &[]), None);
        // Signs between words are none of them.
        assert_eq!(nearest("GPS-L1CA", &["GPS L5", "GPS L1 C/A", "GPS L1C"]).as_deref(), Some("GPS L1 C/A"));
        assert_eq!(nearest("ci16le", &["ci8", "ri16_le", "ci16_le"]).as_deref(), Some("ci16_le"));
        // The most similar one of two.
        assert_eq!(nearest("moise", &["noise", "moises"]).as_deref(), Some("moises"));
    }

    #[test]
    fn a_noun_is_plural_unless_there_is_one() {
        let of = |count| counted(count, "satellite");
        assert_eq!([of(0), of(1), of(12)], ["0 satellites", "1 satellite", "12 satellites"]);
    }

    #[test]
    fn a_key_of_earlier_versions_is_told_with_its_name_now_where_that_is_known() {
        let known = ["overlap", "secondary_code"];
        assert_eq!(nearest("overlay", &known).as_deref(), Some("secondary_code"));
        assert_eq!(hint("component[1].overlay", Some("secondary_code")), ": it is called 'secondary_code' now");
        assert_eq!(nearest("overlay", &["overlap"]).as_deref(), Some("overlap"));
        assert_eq!(hint("overlay", Some("overlap")), ": did you mean 'overlap'?");
        assert_eq!(hint("overlay", None), "");
    }
}
