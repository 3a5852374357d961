//! Names of earlier versions, each with its name now.
//!
//! Readers refuse such a name and tell the new one. A file of results under such a name is reported where its
//! directory is judged again.

/// Class of a name.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Class {
    /// Key of a scenario, of a signal's description or of settings, without its tables.
    Key,
    /// First part of a figure's path.
    Figure,
    /// Word that a figure has as its value.
    Word,
    /// Event of a live run.
    Event,
    /// File of results.
    File,
}

/// All names that changed: class, earlier name, name now.
pub const NAMES: &[(Class, &str, &str)] = &[
    // Secondary codes of all signals but L1C had the name of L1C's.
    (Class::Key, "overlay", "secondary_code"),
    // NEES and its verdict had the name of their table.
    (Class::Figure, "honesty", "position"),
    (Class::Word, "honest", "consistent"),
    (Class::Event, "astray", "range_error"),
    (Class::File, "honesty.csv", "consistency.csv"),
    (Class::File, "position_honesty.png", "position_consistency.png"),
];

/// The earlier name and the name now, if `name` is an earlier one of its class.
pub fn find(class: Class, name: &str) -> Option<(&'static str, &'static str)> {
    NAMES.iter().find(|(of, earlier, _)| *of == class && *earlier == name).map(|(_, earlier, now)| (*earlier, *now))
}

/// Path of a figure whose first part has its name now; `None` if that has no earlier name.
pub fn figure(path: &str) -> Option<String> {
    let (first, rest) = path.split_once('.').map_or((path, None), |(first, rest)| (first, Some(rest)));
    let (_, now) = find(Class::Figure, first)?;
    Some(rest.map_or_else(|| now.to_owned(), |rest| format!("{now}.{rest}")))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_earlier_name_is_known_once_in_its_class_and_is_no_name_now() {
        for (class, earlier, now) in NAMES {
            assert_eq!(find(*class, earlier), Some((*earlier, *now)));
            assert_eq!(find(*class, now), None, "{now}");
            let named = NAMES.iter().filter(|(of, name, _)| (of, name) == (class, earlier));
            assert_eq!(named.count(), 1, "{earlier}");
        }
        assert_eq!(figure("honesty.nees_mean").as_deref(), Some("position.nees_mean"));
        assert_eq!(figure("honesty").as_deref(), Some("position"));
        assert_eq!((figure("position.honesty"), figure("")), (None, None));
    }
}
