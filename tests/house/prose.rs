//! Doc comments as a reader of docs.rs meets them: how each begins, and the words that it uses. Documents and
//! the strings of the program use the same words.
//!
//! A doc comment stands alone. It begins with its noun or, for a function, with a verb in the third person or
//! the noun of the result. A word that points to another comment, a preposition and a question word are no
//! noun. Limits: the first word of the comment and of each section is read, not its grammar; code spans are
//! left out.

use crate::source::strings;

/// A rule that doc comments keep.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Rule {
    /// No opening of [`OPENINGS`].
    Noun,
    /// No opening of [`FRAGMENTS`].
    Sentence,
    /// No word of [`WORDS`].
    Word,
}

/// Openings that stand for a noun of another comment, or for a question.
const OPENINGS: &[&str] = &[
    "…", "As", "By", "How", "It", "Its", "Of", "So many", "That", "The same", "Their", "These", "They", "Those",
    "What", "Whatever", "When", "Where", "Whether", "Which", "Who", "Whose", "Why",
];

/// Openings of a phrase that goes on from the item's name or from the comment before.
const FRAGMENTS: &[&str] = &[
    "After", "Against", "Along", "At", "Before", "Behind", "Below", "Between", "Beyond", "For", "From", "In", "Off",
    "On", "Since", "Taken", "To", "Until", "With", "Within", "Without",
];

/// Words that are not ours, each with the field's term. An asterisk stands for any ending.
const WORDS: &[(&str, &str)] = &[
    ("anew", "again"),
    ("astray", "range error"),
    ("depart*", "differ, error"),
    ("honest*", "consistency, NEES"),
    ("in plan", "horizontal"),
    ("meant to hurt", "degrades the receiver"),
    ("nature took", "outages that the scene causes"),
    ("on the air", "sent, radio frequency"),
    ("overlay*", "secondary code"),
    ("parting", "code-carrier divergence"),
    ("place", "position, field, node"),
    ("places", "positions, fields, nodes"),
    ("reading of the clock", "clock offset, time of the clock"),
    ("reading of the receiver's clock", "clock offset, time of the receiver's clock"),
    ("readings of the receiver's clock", "times of the receiver's clock"),
    ("set of elements", "ephemeris"),
    ("sets of elements", "ephemerides"),
    ("stray*", "range error"),
    ("stretch", "segment"),
    ("stretches", "segments"),
    ("to and fro", "back and forth"),
    ("upside down", "inverted"),
    ("way up", "normal or inverted"),
    ("whither", "direction"),
];

/// Phrases in which such a word is the usual one.
const USUAL: &[&str] = &["decimal places", "in one place", "in place", "in places", "last place"];
/// A word that a standard uses, and the end of the paths of its signal: L1C's secondary code is an overlay.
const STANDARD: (&str, &str) = ("overlay*", "/l1c.rs");

/// A doc comment of one item or module.
#[derive(Debug)]
pub struct Doc {
    /// Number of its first line.
    pub line: usize,
    /// Its lines without their marks.
    pub text: String,
}

/// Doc comments of a source.
pub fn docs(text: &str) -> Vec<Doc> {
    let mut found: Vec<Doc> = Vec::new();
    let mut open = "";
    for (number, line) in (1..).zip(text.lines()) {
        let line = line.trim_start();
        let mark = ["///", "//!"].into_iter().find(|mark| line.starts_with(mark) && !line.starts_with("////"));
        let Some(mark) = mark else {
            open = "";
            continue;
        };
        let rest = line[mark.len()..].trim_start();
        match found.last_mut().filter(|_| open == mark) {
            Some(doc) => doc.text.extend(["\n", rest]),
            None => found.push(Doc { line: number, text: rest.to_owned() }),
        }
        open = mark;
    }
    found
}

/// First lines of the docstrings of a Python source.
pub fn docstrings(text: &str) -> Vec<Doc> {
    let first = |(line, text): (usize, &str)| {
        let text = text.trim_start().strip_prefix("\"\"\"")?.trim_end_matches('"').to_owned();
        Some(Doc { line, text })
    };
    (1..).zip(text.lines()).filter_map(first).collect()
}

/// Faults of a doc comment in the file `path` against a rule, in words.
pub fn faults(path: &str, doc: &Doc, rule: Rule) -> Vec<String> {
    let opens = |text: &str, list: &[&str]| -> Vec<String> {
        list.iter().filter(|word| begins(text, word)).map(|word| format!("'{word}'")).collect()
    };
    match rule {
        Rule::Noun => beginnings(&doc.text).flat_map(|text| opens(text, OPENINGS)).collect(),
        Rule::Sentence => opens(&doc.text, FRAGMENTS),
        Rule::Word => words(path, &doc.text),
    }
}

/// Paragraphs of a document.
pub fn paragraphs(text: &str) -> Vec<Doc> {
    let prose = unfenced(text);
    let mut found = vec![Doc { line: 1, text: String::new() }];
    for (number, line) in (1..).zip(prose.lines()) {
        if line.trim().is_empty() {
            found.push(Doc { line: number + 1, text: String::new() });
        } else if let Some(doc) = found.last_mut() {
            doc.text.extend([line, "\n"]);
        }
    }
    found
}

/// A document whose fenced code is blank; lines stay where they are.
fn unfenced(text: &str) -> String {
    let mut inside = false;
    let line = |line: &str| {
        let is_fence = line.trim_start().starts_with("```");
        inside ^= is_fence;
        if inside || is_fence { String::new() } else { line.to_owned() }
    };
    text.lines().map(line).collect::<Vec<_>>().join("\n")
}

/// Strings of a source that are prose: those with a blank between words. What a format puts in is left out.
pub fn messages(text: &str) -> Vec<Doc> {
    let without_arguments = |text: &str| {
        let parts = text.split('{').map(|part| part.split_once('}').map_or(part, |(_, rest)| rest));
        parts.collect::<Vec<_>>().join("…")
    };
    let docs = strings(text).into_iter().map(|(line, text)| Doc { line, text: without_arguments(&text) });
    docs.filter(|doc| doc.text.contains(' ')).map(|doc| Doc { text: doc.text.replace("\\\n", " "), ..doc }).collect()
}

/// Beginnings of a doc comment and of its sections, whose headings are left out.
fn beginnings(text: &str) -> impl Iterator<Item = &str> {
    let sections = text.split("\n# ").skip(1).filter_map(|section| section.split_once('\n'));
    std::iter::once(text).chain(sections.map(|(_, section)| section.trim_start()))
}

/// True if a text begins with a word and not with a longer one.
fn begins(text: &str, word: &str) -> bool {
    text.strip_prefix(word)
        .is_some_and(|rest| !rest.starts_with(|c: char| c.is_alphanumeric() || c == '-') || word == "…")
}

/// Words of [`WORDS`] in a text, each with the field's term.
fn words(path: &str, text: &str) -> Vec<String> {
    let plain = USUAL.iter().fold(without_code(text).to_lowercase(), |plain, usual| plain.replace(usual, " "));
    let is = |(word, _): &&(&str, &str)| {
        let stem = word.trim_end_matches('*');
        plain.match_indices(stem).any(|(at, _)| {
            let starts = !plain[..at].ends_with(|c: char| c.is_alphanumeric());
            starts && (stem != *word || !plain[at + stem.len()..].starts_with(|c: char| c.is_alphanumeric()))
        })
    };
    let ours = |(word, _): &&(&str, &str)| *word != STANDARD.0 || !path.ends_with(STANDARD.1);
    WORDS.iter().filter(ours).filter(is).map(|(word, term)| format!("'{word}': {term}")).collect()
}

/// A text in one line, without code spans, fenced code and the targets of links.
fn without_code(text: &str) -> String {
    let prose = text.split("```").step_by(2).collect::<Vec<_>>().join(" ");
    let spans = prose.split('`').step_by(2).collect::<Vec<_>>().join(" ");
    let spans = spans.split("](").enumerate().map(|(at, part)| match part.split_once(')') {
        Some((_, rest)) if at > 0 => rest,
        _ => part,
    });
    let spans = spans.collect::<Vec<_>>().join(" ");
    spans.split_whitespace().collect::<Vec<_>>().join(" ")
}
