//! Shards: files of whole cases, bound to their manifest, that are there wholly or not at all.
//!
//! The first line binds manifest and range, the last one counts rows and hashes what is before it. A
//! shard is written under a temporary name, synchronised, linked to its own, and the directory synchronised.
//! What is there already must have the same bytes: a shard that is computed twice is a check of
//! reproducibility. Limits: a network file system may refuse links; then a rename is used, and of two writers
//! at once the last one's (equal) bytes stay.

use std::fmt::Write as _;
use std::fs::{self, File};
use std::io::{self, Write as _};
use std::path::{Path, PathBuf};

use super::plan::Plan;
use super::{StudyError, axis, sha256_hex, temporary};
use analysis::show::staged::{Staged, present};

/// Figures of one case.
pub type CaseFigures = Vec<Option<f64>>;

/// State of a shard's file.
#[derive(Clone, Debug, PartialEq)]
pub enum Found {
    /// Missing file.
    Nothing,
    /// Complete shard, with its lines of data.
    Whole(Vec<String>),
    /// Unusable file, with the reason.
    Bad(String),
}

/// The file of a shard.
pub fn path(plan: &Plan, shard: u32) -> PathBuf {
    let (hash, shards) = (plan.hash.get(..12).unwrap_or_default(), plan.shards());
    plan.shard_directory().join(format!("{hash}-{shard:06}-of-{shards:06}.csv"))
}

fn header(plan: &Plan, shard: u32) -> String {
    let cases = plan.cases(shard);
    format!(
        "# gnss-twin study shard 1 manifest {} shard {shard} of {} cases {} to {}",
        plan.hash,
        plan.shards(),
        cases.start,
        cases.end
    )
}

/// The names of the columns.
pub fn columns(plan: &Plan) -> String {
    let names: Vec<String> = plan.manifest.columns.iter().map(|column| quoted(&column.name)).collect();
    names.join(",")
}

/// A field of CSV (RFC 4180). Line breaks, which would cut a row in two, are written as blanks.
fn quoted(text: &str) -> String {
    let text = text.replace(['\n', '\r'], " ");
    if text.contains([',', '"']) { format!("\"{}\"", text.replace('"', "\"\"")) } else { text }
}

/// A line of data.
fn line(plan: &Plan, number: u64, row: &CaseFigures) -> String {
    let case = plan.study.grid.case(number);
    let scene = plan.base(&case).map_or("", |base| base.name.as_str());
    let mut line = format!("{number},{},{}", plan.study.seed_of(&case, scene), case.repetition);
    for (_, value) in plan.study.values(&case) {
        let _ = write!(line, ",{}", quoted(&axis::text_of(value)));
    }
    for value in row {
        line.push(',');
        if let Some(value) = value {
            let _ = write!(line, "{value}");
        }
    }
    line
}

/// The bytes of a shard: a function of plan, number and figures.
pub fn render(plan: &Plan, shard: u32, rows: &[CaseFigures]) -> Vec<u8> {
    let mut text = format!("{}\n{}\n", header(plan, shard), columns(plan));
    for (number, row) in plan.cases(shard).zip(rows) {
        text += &line(plan, number, row);
        text.push('\n');
    }
    let hash = sha256_hex(text.as_bytes());
    let _ = writeln!(text, "# rows {} sha256 {hash}", rows.len());
    text.into_bytes()
}

/// Looks at what is under a shard's name, and checks all of it.
///
/// # Errors
/// A file that is there and cannot be read.
pub fn find(plan: &Plan, shard: u32) -> Result<Found, StudyError> {
    let path = path(plan, shard);
    match fs::read(&path) {
        Ok(bytes) => Ok(match verify(plan, shard, bytes) {
            Ok(lines) => Found::Whole(lines),
            Err(reason) => Found::Bad(reason),
        }),
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(Found::Nothing),
        Err(source) => Err(StudyError::Read { path, source }),
    }
}

/// The lines of data of a shard's bytes, or why they are not this shard's.
fn verify(plan: &Plan, shard: u32, bytes: Vec<u8>) -> Result<Vec<String>, String> {
    let text = String::from_utf8(bytes).map_err(|_| "not UTF-8".to_owned())?;
    let whole = text.strip_suffix('\n').ok_or("its end is missing")?;
    let (body, trailer) = whole.rsplit_once('\n').ok_or("its end is missing")?;
    let body = format!("{body}\n");
    let mut lines = body.lines();
    if lines.next() != Some(header(plan, shard).as_str()) {
        return Err("its first line is not that of this plan's shard".to_owned());
    }
    if lines.next() != Some(columns(plan).as_str()) {
        return Err("its columns are not those of this plan".to_owned());
    }
    let rows: Vec<String> = lines.map(str::to_owned).collect();
    if trailer != format!("# rows {} sha256 {}", rows.len(), sha256_hex(body.as_bytes())) {
        return Err("its last line does not count and hash what is before it".to_owned());
    }
    let cases = plan.cases(shard);
    let numbered = |(row, case): (&String, u64)| row.split(',').next() == Some(case.to_string().as_str());
    if rows.len() as u64 != cases.end - cases.start || !rows.iter().zip(cases).all(numbered) {
        return Err("its cases are not those of this shard".to_owned());
    }
    Ok(rows)
}

/// Moves what is under a shard's name out of the way, for someone to look at.
///
/// # Errors
/// A directory that cannot be written.
pub fn discard(plan: &Plan, shard: u32) -> Result<(), StudyError> {
    let path = path(plan, shard);
    let bad = path.with_extension("csv.bad");
    match fs::rename(&path, &bad) {
        Err(source) if source.kind() != io::ErrorKind::NotFound => Err(StudyError::Write { path, source }),
        _ => Ok(()),
    }
}

/// Gives a shard its name, durably.
///
/// # Errors
/// [`StudyError::NotReproducible`] if other bytes are there; files that cannot be written.
pub fn commit(plan: &Plan, shard: u32, bytes: &[u8]) -> Result<(), StudyError> {
    let (directory, target) = (plan.shard_directory(), path(plan, shard));
    // A second try, should another run have swept the temporary away as a dead one's.
    match attempt(&directory, &target, bytes) {
        Err(StudyError::Write { source, .. }) if source.kind() == io::ErrorKind::NotFound => {
            attempt(&directory, &target, bytes)
        }
        other => other,
    }
}

fn attempt(directory: &Path, target: &Path, bytes: &[u8]) -> Result<(), StudyError> {
    let done = publish(directory.join(temporary::name()), target, bytes);
    let failed = |source| StudyError::Write { path: target.to_owned(), source };
    match done {
        Ok(()) => {}
        Err(error) if error.kind() == io::ErrorKind::AlreadyExists => {
            let there = fs::read(target).map_err(|source| StudyError::Read { path: target.to_owned(), source })?;
            if there != bytes {
                return Err(StudyError::NotReproducible { path: target.to_owned() });
            }
        }
        Err(source) => return Err(failed(source)),
    }
    File::open(directory).and_then(|directory| directory.sync_all()).map_err(failed)
}

/// Writes the temporary and links it to its final name, which must not be there.
fn publish(part: PathBuf, target: &Path, bytes: &[u8]) -> io::Result<()> {
    let (making, mut file) = Staged::file(part)?;
    file.write_all(bytes)?;
    file.sync_all()?;
    match fs::hard_link(making.path(), target) {
        Err(error) if matches!(error.kind(), io::ErrorKind::Unsupported | io::ErrorKind::PermissionDenied) => {
            if present(target)? {
                return Err(io::ErrorKind::AlreadyExists.into());
            }
            making.finish(target)
        }
        other => other,
    }
}

/// Numbers as ranges: "0,3,7-8".
pub fn ranges(numbers: &[u32]) -> String {
    let runs = numbers.chunk_by(|a, b| a + 1 == *b);
    let words: Vec<String> = runs
        .filter_map(|run| match (run.first(), run.last()) {
            (Some(first), Some(last)) if first == last => Some(first.to_string()),
            (Some(first), Some(last)) => Some(format!("{first}-{last}")),
            _ => None,
        })
        .collect();
    words.join(",")
}
