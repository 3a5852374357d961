//! Numbers in columns, as FORTRAN writes them.

/// Fields of `width` columns from `start` on, after which nothing may follow; a blank one is `None`.
pub(super) fn fields(line: &str, start: usize, width: usize, count: usize) -> Result<Vec<Option<f64>>, String> {
    let end = start + width * count;
    if let Some(at) = line.bytes().skip(end).position(|byte| byte != b' ') {
        return Err(format!("column {}: expected nothing after {count} fields", end + at + 1));
    }
    let field = |number: usize| {
        let from = (start + width * number).min(line.len());
        let text = line.get(from..line.len().min(from + width)).unwrap_or("").trim();
        match (text.is_empty(), number_of(text)) {
            (true, _) => Ok(None),
            (false, Some(value)) => Ok(Some(value)),
            (false, None) => Err(format!("column {}: '{text}': expected a number or blanks", from + 1)),
        }
    };
    (0..count).map(field).collect()
}

/// Parses `N` numbers of a header line, none of them blank.
pub(super) fn numbers<const N: usize>(line: &str, start: usize, width: usize) -> Result<[f64; N], String> {
    // A time mark and a satellite may follow in version 3.
    let found = fields(line.get(..start + width * N).unwrap_or(line), start, width, N)?;
    let found: Option<Vec<f64>> = found.into_iter().collect();
    found
        .and_then(|found| found.try_into().ok())
        .ok_or_else(|| format!("expected {N} numbers from column {} on", start + 1))
}

/// A whole number of digits alone.
pub(super) fn digits<T: std::str::FromStr>(text: &str) -> Option<T> {
    if text.bytes().all(|byte| byte.is_ascii_digit()) { text.parse().ok() } else { None }
}

/// A number as FORTRAN's D19.12 writes it, or E, or without an exponent: finite as a double.
pub(super) fn number_of(text: &str) -> Option<f64> {
    let plain = |c: char| c.is_ascii_digit() || "+-.eEdD".contains(c);
    if !text.chars().all(plain) {
        return None;
    }
    text.replace(['d', 'D'], "e").parse().ok().filter(|value: &f64| value.is_finite())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_those_of_fortran() {
        for good in ["0.1D-05", "-.5e+3", "1.E2", "12", "+7", "0.483528291807D-02"] {
            assert!(number_of(good).is_some(), "{good}");
        }
        for bad in ["nan", "inf", "0.1D+999", "0x10", "1,5", "0.1D", "--1", "1 2", "?"] {
            assert!(number_of(bad).is_none(), "{bad}");
        }
    }
}
