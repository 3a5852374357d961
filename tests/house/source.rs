//! Sources as text: which there are, and what is left of one without comments, strings and tests.

use std::fs;
use std::ops::Range;
use std::path::Path;

/// One file of the library.
pub struct Source {
    /// Path from the package's root, with slashes.
    pub path: String,
    /// Modules of the file from `src`: `["gnss", "time"]`.
    pub module: Vec<String>,
    /// Number of modules to the root of its crate: one where that folder is a crate of its own.
    pub root: usize,
    /// Comments, texts and test modules blanked; lines stay where they are.
    pub code: String,
}

impl Source {
    /// Source of a file `path` below `src`.
    pub fn new(path: &str, text: &str) -> Self {
        let inner = path.trim_start_matches("src/").trim_end_matches(".rs");
        let module: Vec<String> =
            inner.split('/').filter(|part| !matches!(*part, "mod" | "lib")).map(str::to_owned).collect();
        let is_crate = |folder: &String| {
            Path::new(env!("CARGO_MANIFEST_DIR")).join("src").join(folder).join("Cargo.toml").is_file()
        };
        let root = usize::from(module.first().is_some_and(is_crate));
        Self { path: path.to_owned(), module, root, code: without_tests(&blanked(text)) }
    }

    /// All that are no tests: neither named so nor declared under `#[cfg(test)]`.
    pub fn all(folder: &str) -> Vec<Self> {
        let files = files(folder);
        let mut tests = Vec::new();
        for (path, text) in &files {
            let place = path.trim_end_matches("/mod.rs").trim_end_matches("/lib.rs").trim_end_matches(".rs");
            for name in test_files(&blanked(text)) {
                tests.push(format!("{place}/{name}.rs"));
                tests.push(format!("{place}/{name}/"));
                // Declared with `#[path]` beside the file.
                if let Some((parent, _)) = place.rsplit_once('/') {
                    tests.push(format!("{parent}/{name}.rs"));
                }
            }
        }
        let is_test = |path: &str| {
            let named = path.ends_with("/tests.rs") || path.ends_with("_tests.rs") || path.contains("/tests/");
            named || tests.iter().any(|test| path == test || (test.ends_with('/') && path.starts_with(test.as_str())))
        };
        files.iter().filter(|(path, _)| !is_test(path)).map(|(path, text)| Self::new(path, text)).collect()
    }
}

/// Names of the rooms in a folder of `src`, those of tests apart.
pub fn rooms(sources: &[Source], folder: &str) -> Vec<String> {
    let prefix = format!("src/{folder}/");
    let mut found: Vec<String> = sources
        .iter()
        .filter_map(|source| source.path.strip_prefix(&prefix)?.split('/').next().map(str::to_owned))
        .map(|name| name.trim_end_matches(".rs").to_owned())
        .filter(|name| !matches!(name.as_str(), "mod" | "lib" | "main"))
        .collect();
    found.sort();
    found.dedup();
    found
}

/// Rust files below a folder of the package, with their texts; none where there is no such folder.
pub fn files(folder: &str) -> Vec<(String, String)> {
    files_of(folder, "rs")
}

/// Files of a kind, given by their extension, below a folder of the package, with their texts.
pub fn files_of(folder: &str, kind: &str) -> Vec<(String, String)> {
    fn walk(root: &Path, path: &Path, kind: &str, found: &mut Vec<(String, String)>) {
        let Ok(entries) = fs::read_dir(path) else { return };
        for entry in entries {
            let path = entry.unwrap().path();
            if path.is_dir() {
                if !path.ends_with("target") {
                    walk(root, &path, kind, found);
                }
            } else if path.extension().is_some_and(|extension| extension == kind) {
                let name = path.strip_prefix(root).unwrap().to_str().unwrap().replace('\\', "/");
                found.push((name, fs::read_to_string(&path).unwrap()));
            }
        }
    }
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut found = Vec::new();
    walk(root, &root.join(folder), kind, &mut found);
    found.sort();
    found
}

/// A text with the contents of comments, strings and characters turned into blanks.
fn blanked(text: &str) -> String {
    let mut chars: Vec<char> = text.chars().collect();
    for range in spans(&chars) {
        chars[range].iter_mut().for_each(|c| *c = blank(*c));
    }
    chars.into_iter().collect()
}

/// Strings of a source outside its tests, without their quotes, each with the number of its first line.
pub fn strings(text: &str) -> Vec<(usize, String)> {
    let chars: Vec<char> = text.chars().collect();
    let code = blanked(text);
    let index = |byte: usize| code[..byte].chars().count();
    let tests: Vec<Range<usize>> =
        test_items(&code).into_iter().map(|item| index(item.start)..index(item.end)).collect();
    let (mut done, mut line, mut found) = (0, 1, Vec::new());
    for span in spans(&chars) {
        line += chars[done..span.start].iter().filter(|c| **c == '\n').count();
        done = span.start;
        if matches!(chars[done], '"' | 'r') && !tests.iter().any(|test| test.contains(&done)) {
            let string: String = chars[span].iter().collect();
            found.push((line, string.trim_matches(['r', '#', '"']).to_owned()));
        }
    }
    found
}

fn blank(c: char) -> char {
    if c == '\n' { '\n' } else { ' ' }
}

/// Ranges of comments, strings and characters.
fn spans(chars: &[char]) -> Vec<Range<usize>> {
    let at = |i: usize| chars.get(i).copied().unwrap_or('\0');
    let mut found = Vec::new();
    let mut i = 0;
    while i < chars.len() {
        let end = match at(i) {
            '/' if at(i + 1) == '/' => (i..chars.len()).find(|&k| at(k) == '\n').unwrap_or(chars.len()),
            '/' if at(i + 1) == '*' => {
                (i + 2..chars.len()).find(|&k| at(k) == '*' && at(k + 1) == '/').map_or(chars.len(), |k| k + 2)
            }
            '"' => string_end(chars, i),
            'r' if matches!(at(i + 1), '#' | '"') && !(i > 0 && (at(i - 1).is_alphanumeric() || at(i - 1) == '_')) => {
                raw_end(chars, i).unwrap_or(i)
            }
            // A character, and no lifetime.
            '\'' if at(i + 1) == '\\' => (i + 3..chars.len()).find(|&k| at(k) == '\'').map_or(chars.len(), |k| k + 1),
            '\'' if at(i + 2) == '\'' => i + 3,
            _ => i,
        };
        if end > i {
            found.push(i..end);
        }
        i = end.max(i + 1);
    }
    found
}

/// Index behind a string that begins at `i`.
fn string_end(chars: &[char], i: usize) -> usize {
    let mut k = i + 1;
    while k < chars.len() {
        match chars[k] {
            '\\' => k += 2,
            '"' => return k + 1,
            _ => k += 1,
        }
    }
    chars.len()
}

/// Index behind a raw string that begins at `i`; `None` where it is a raw identifier.
fn raw_end(chars: &[char], i: usize) -> Option<usize> {
    let hashes = chars[i + 1..].iter().take_while(|c| **c == '#').count();
    let open = i + 1 + hashes;
    (chars.get(open) == Some(&'"')).then_some(())?;
    let closes = |k: usize| chars[k] == '"' && (1..=hashes).all(|n| chars.get(k + n) == Some(&'#'));
    Some((open + 1..chars.len()).find(|&k| closes(k)).map_or(chars.len(), |k| k + 1 + hashes))
}

const CFG_TEST: &str = "#[cfg(test)]";

/// Names of the files that are declared as modules of tests.
fn test_files(code: &str) -> Vec<String> {
    let mut found = Vec::new();
    for (start, _) in code.match_indices(CFG_TEST) {
        let rest: String = code[start + CFG_TEST.len()..].chars().take_while(|c| *c != ';' && *c != '{').collect();
        if code[start + CFG_TEST.len() + rest.len()..].starts_with(';')
            && let Some((_, name)) = rest.rsplit_once("mod ")
        {
            found.push(name.trim().to_owned());
        }
    }
    found
}

/// Ranges of bytes of the items under `#[cfg(test)]`: each to its semicolon or its closing brace.
fn test_items(code: &str) -> Vec<Range<usize>> {
    let mut found: Vec<Range<usize>> = Vec::new();
    for (start, _) in code.match_indices(CFG_TEST) {
        if found.last().is_some_and(|last| last.contains(&start)) {
            continue;
        }
        let mut depth = 0_usize;
        let ends = |(_, c): &(usize, char)| match c {
            '{' => {
                depth += 1;
                false
            }
            '}' => {
                depth = depth.saturating_sub(1);
                depth == 0
            }
            ';' => depth == 0,
            _ => false,
        };
        let end = code[start..].char_indices().find(ends).map_or(code.len(), |(at, c)| start + at + c.len_utf8());
        found.push(start..end);
    }
    found
}

/// A blanked text whose items under `#[cfg(test)]` are blanks too.
fn without_tests(code: &str) -> String {
    let mut out = String::with_capacity(code.len());
    let mut done = 0;
    for item in test_items(code) {
        out.push_str(&code[done..item.start]);
        out.extend(code[item.clone()].chars().map(blank));
        done = item.end;
    }
    out + &code[done..]
}

/// Lines of a blanked text that have anything on them.
pub fn lines_of_code(code: &str) -> usize {
    code.lines().filter(|line| !line.trim().is_empty()).count()
}

/// Numbers of the lines of comment alone that are wider; an address cannot be broken and may be.
pub fn comments_too_wide(text: &str, most: usize) -> Vec<usize> {
    let wide = |line: &str| line.trim_start().starts_with("//") && line.chars().count() > most;
    let lines = (1..).zip(text.lines());
    lines.filter(|(_, line)| wide(line) && !line.contains("://")).map(|(number, _)| number).collect()
}

/// Numbers of the lines that hold code and are wider.
pub fn code_too_wide(text: &str, most: usize) -> Vec<usize> {
    let wide = |line: &str| !line.trim_start().starts_with("//") && line.chars().count() > most;
    (1..).zip(text.lines()).filter(|(_, line)| wide(line)).map(|(number, _)| number).collect()
}

/// Numbers of the lines of a blanked text on which something is unwrapped.
pub fn unwraps(code: &str) -> Vec<usize> {
    let is_call = |line: &str| {
        line.match_indices(".unwrap").any(|(at, word)| line[at + word.len()..].trim_start().starts_with('('))
    };
    (1..).zip(code.lines()).filter(|(_, line)| is_call(line)).map(|(number, _)| number).collect()
}
