//! The page of measured figures.

use std::path::Path;

/// Replaces what is between the marks of that name in `reports/performance.md`.
///
/// # Errors
/// In words, where the page or a mark is not there.
pub fn put(mark: &str, text: &str) -> Result<(), String> {
    let path = Path::new("reports/performance.md");
    let named = |error: std::io::Error| format!("{}: {error}", path.display());
    let page = std::fs::read_to_string(path).map_err(named)?;
    let (begin, end) = (format!("<!-- {mark} -->\n"), format!("<!-- end of {mark} -->\n"));
    let parts = page.split_once(&begin).and_then(|(before, rest)| Some((before, rest.split_once(&end)?.1)));
    let (before, after) = parts.ok_or_else(|| format!("{}: expected {begin:?} and {end:?}", path.display()))?;
    std::fs::write(path, format!("{before}{begin}{text}{end}{after}")).map_err(named)
}
