//! Table `[receiver]`, which is kept as written for the receiver's own settings.

use super::read::Table;

/// The receiver's table as written, through the ordinary parser.
pub(super) fn receiver(root: &Table<'_>, text: &str) -> Result<Option<toml::Table>, toml::de::Error> {
    if !root.has("receiver") {
        return Ok(None);
    }
    let mut whole: toml::Table = toml::from_str(text)?;
    match whole.remove("receiver") {
        Some(toml::Value::Table(table)) => Ok(Some(table)),
        _ => Err(serde::de::Error::custom("receiver: expected a table")),
    }
}
