//! The form of GPS LNAV records, before their values are read: each has its number of lines, and in each field of 19 columns
//! stands a number or nothing.
//!
//! Source: RINEX 2.11, table A4; RINEX 3.05, table A6; RINEX 4.02, table A9. Where a line is missing, doubled or cut, the rest of a
//! record would be read into the wrong elements, or another record lost; so such a record is taken out and named with its
//! line and column. Records of other systems and messages pass as they are.

/// Lines of a record: satellite, epoch and clock, then seven lines of the orbit.
const LINES: usize = 8;
const FIELD: usize = 19;

/// A file's text without what is not in form.
pub(super) struct Sifted {
    pub text: Vec<u8>,
    /// The number, in the file, of each line of `text`.
    pub lines: Vec<usize>,
    /// Why records were taken out.
    pub reasons: Vec<String>,
}

/// Takes out GPS LNAV records that are not in form, and blank lines, from an ASCII text.
pub(super) fn sift(text: &[u8]) -> Sifted {
    let whole = String::from_utf8_lossy(text);
    let ended = text.ends_with(b"\n");
    let all: Vec<(usize, &str)> = (1..).zip(whole.lines()).collect();
    let head = all.iter().position(|(_, line)| line.contains("END OF HEADER")).map_or(all.len(), |at| at + 1);
    let (header, body) = all.split_at(head);
    let version = header.first().and_then(|(_, line)| line.get(..9)?.trim().parse::<f64>().ok()).unwrap_or(0.0);
    let form = Form { version: version as u8, cut: (!ended).then_some(all.len()) };
    let mut sifted = Sifted { text: Vec::new(), lines: Vec::new(), reasons: Vec::new() };
    let mut keep = |lines: &[(usize, &str)]| {
        for (number, line) in lines {
            sifted.text.extend_from_slice(line.as_bytes());
            sifted.text.push(b'\n');
            sifted.lines.push(*number);
        }
    };
    keep(header);
    let body: Vec<(usize, &str)> = body.iter().filter(|(_, line)| !line.trim().is_empty()).copied().collect();
    for group in body.chunk_by(|_, next| !form.begins(next.1)) {
        match form.fault(group) {
            None => keep(group),
            Some(reason) => sifted.reasons.push(reason),
        }
    }
    sifted
}

struct Form {
    version: u8,
    /// The number of a last line that has no end, and may be cut inside a number.
    cut: Option<usize>,
}

impl Form {
    /// Columns before the first field of a line of the orbit.
    fn margin(&self) -> usize {
        if self.version < 3 { 3 } else { 4 }
    }

    /// Whether a record begins with this line.
    fn begins(&self, line: &str) -> bool {
        match self.version {
            4.. => line.starts_with('>'),
            _ => line.get(..self.margin()).is_none_or(|margin| !margin.trim().is_empty()),
        }
    }

    fn fault(&self, group: &[(usize, &str)]) -> Option<String> {
        let (first, title) = group.first()?;
        let (record, letter) = match self.version {
            4.. if title.starts_with("> EPH G") && title.contains("LNAV") => (group.get(1..)?, true),
            4.. => return None,
            3 if title.starts_with('G') => (group, true),
            3 => return None,
            _ => (group, false),
        };
        let label: String = record.first().map_or(*title, |(_, line)| line).chars().take(23).collect();
        let refuse = |line: usize, what: String| Some(format!("line {line} ({}): {what}", label.trim_end()));
        if letter && record.first().is_some_and(|(_, line)| !line.starts_with('G')) {
            return refuse(*first, "expected the satellite and its epoch in the line after this one".to_owned());
        }
        if record.len() != LINES {
            return refuse(*first, format!("a record of {} lines: expected {LINES}", record.len()));
        }
        for (row, (number, line)) in record.iter().enumerate() {
            // Satellite and epoch are as wide as one field.
            let (start, fields) = if row == 0 { (self.margin() + FIELD, 3) } else { (self.margin(), 4) };
            if row > 0 && line.get(..start).is_some_and(|margin| !margin.trim().is_empty()) {
                return refuse(*number, format!("column 1: expected {start} blanks"));
            }
            if self.cut == Some(*number) && (line.trim_end().len().saturating_sub(start)) % FIELD != 0 {
                return refuse(*number, "the file ends within a number".to_owned());
            }
            for field in 0..fields {
                let from = start + FIELD * field;
                let text = line.get(from..line.len().min(from + FIELD)).unwrap_or("");
                if !text.trim().is_empty() && !is_number(text.trim()) {
                    let column = from + 1;
                    return refuse(*number, format!("column {column}: '{}': expected a number or blanks", text.trim()));
                }
            }
        }
        None
    }
}

/// A number as FORTRAN's D19.12 writes it, or E, or without an exponent: finite as a double.
fn is_number(text: &str) -> bool {
    let plain = |c: char| c.is_ascii_digit() || "+-.eEdD".contains(c);
    text.chars().all(plain) && text.replace(['d', 'D'], "e").parse::<f64>().is_ok_and(f64::is_finite)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_those_of_fortran() {
        for good in ["0.1D-05", "-.5e+3", "1.E2", "12", "+7", "0.483528291807D-02"] {
            assert!(is_number(good), "{good}");
        }
        for bad in ["nan", "inf", "0.1D+999", "0x10", "1,5", "0.1D", "--1", "1 2", "?"] {
            assert!(!is_number(bad), "{bad}");
        }
    }
}
