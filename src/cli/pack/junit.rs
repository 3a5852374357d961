//! The matrix as JUnit XML, which servers of continuous integration show.
//!
//! A group is a test suite and an entry a test case. An entry that does not end as expected is a failure;
//! what did not run, and what no scene says, is skipped with its reason. Source: the schema of Apache Ant's
//! JUnit task, as servers read it. Limits: no time is written, because it is of the machine.

use std::fmt::Write as _;

use super::groups;
use super::matrix::Matrix;

/// The whole document.
pub fn xml(matrix: &Matrix<'_>) -> String {
    let (tests, skipped) =
        (matrix.rows.len() + matrix.not_said().len(), matrix.not_modelled() + matrix.not_said().len());
    let mut text = format!(
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<testsuites name=\"{}\" tests=\"{tests}\" failures=\"{}\" \
         errors=\"0\" skipped=\"{skipped}\">\n",
        escaped(&matrix.pack.name),
        matrix.unexpected(),
    );
    let of_rows = matrix.rows.iter().map(|row| row.entry.group.as_str());
    for group in groups(of_rows.chain(matrix.not_said().iter().map(|test| test.group.as_str()))) {
        suite(matrix, group, &mut text);
    }
    text += "</testsuites>\n";
    text
}

fn suite(matrix: &Matrix<'_>, group: &str, text: &mut String) {
    let rows = || matrix.rows.iter().filter(|row| row.entry.group == group);
    let not_said = || matrix.not_said().iter().filter(|test| test.group == group);
    let failures = rows().filter(|row| row.is_expected() == Some(false)).count();
    let skipped = rows().filter(|row| row.is_expected().is_none()).count() + not_said().count();
    let name = escaped(group);
    let _ = writeln!(
        text,
        "  <testsuite name=\"{name}\" tests=\"{}\" failures=\"{failures}\" errors=\"0\" skipped=\"{skipped}\">",
        rows().count() + not_said().count()
    );
    let class = escaped(&format!("{}.{group}", matrix.pack.name));
    for row in rows() {
        let _ = write!(text, "    <testcase classname=\"{class}\" name=\"{}\"", escaped(&row.entry.name));
        let why = escaped(&row.why());
        let _ = match row.is_expected() {
            Some(true) => writeln!(text, "/>"),
            Some(false) => writeln!(text, "><failure message=\"{why}\"/></testcase>"),
            None => writeln!(text, "><skipped message=\"{why}\"/></testcase>"),
        };
    }
    for test in not_said() {
        let (name, why) = (escaped(&test.name), escaped(&format!("not said: {}", test.reason)));
        let _ = writeln!(
            text,
            "    <testcase classname=\"{class}\" name=\"{name}\"><skipped message=\"{why}\"/></testcase>"
        );
    }
    *text += "  </testsuite>\n";
}

/// A text within quotes of an attribute. Characters that XML 1.0 (2.2) does not have become U+FFFD.
fn escaped(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => out += "&amp;",
            '<' => out += "&lt;",
            '>' => out += "&gt;",
            '"' => out += "&quot;",
            '\n' | '\t' | '\r' => out.push(' '),
            c if c.is_control() || matches!(c, '\u{fffe}' | '\u{ffff}') => out.push('\u{fffd}'),
            c => out.push(c),
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::escaped;

    #[test]
    fn a_text_in_quotes_ends_with_them_alone() {
        assert_eq!(escaped("a<b> & \"c\"\n\u{7}≤"), "a&lt;b&gt; &amp; &quot;c&quot; \u{fffd}≤");
    }
}
