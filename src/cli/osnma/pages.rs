//! Files of `osnma`: recordings of pages, and what to trust.

use std::fs::File;
use std::io::{self, BufRead, BufReader, Cursor, Read};
use std::path::Path;

use crate::cli::error::{CliError, shown};
use crate::cli::osnma::args::Verify;
use crate::cli::scenario;
use gnss::inflate::{InflateError, inflate};
use osnma::bits::unhex;
use osnma::files;
use osnma::keys::{Anchor, MerkleRoot, PublicKey};
use osnma::page::Page;
use osnma::verifier::Verifier;

/// Largest recording, packed or not: three days of 26 satellites.
const LARGEST_BYTES: u64 = 256 << 20;
/// Longest row that is read.
const ROW_BYTES: u64 = 256;
/// First bytes that show how a file is packed.
const HEAD_BYTES: u64 = 16;
const GZIP: [u8; 2] = [0x1f, 0x8b];
/// Form of the rows of a recording, in messages.
const ROWS: &str = "rows TOW,WN,SV,page as 60 hexadecimal digits";

/// Reads the pages of a recording, which are in the order of time.
pub fn read(path: &Path) -> Result<Vec<Page>, CliError> {
    let name = shown(path);
    let mut rows = rows_of(path, &name)?;
    let mut pages: Vec<Page> = Vec::new();
    let mut row = Vec::new();
    let mut bytes = 0;
    for number in 1_u64.. {
        row.clear();
        let count = rows.by_ref().take(ROW_BYTES).read_until(b'\n', &mut row);
        let count = count.map_err(|error| CliError::read(&name, &error))?;
        bytes += count as u64;
        if count == 0 {
            break;
        }
        if bytes > LARGEST_BYTES {
            return Err(CliError::input(format!("{name}: more than {LARGEST_BYTES} bytes: expected at most that")));
        }
        let refuse = |what: String| CliError::input(format!("{name}:{number}: {what}"));
        let text = std::str::from_utf8(&row).map_err(|_| refuse(format!("not a text: expected {ROWS}")))?;
        let text = text.trim_start_matches('\u{feff}').trim();
        if text.is_empty() {
            continue;
        }
        let page = Page::from_row(text).map_err(|error| refuse(error.to_string()))?;
        if let Some(before) = pages.last().filter(|before| before.start > page.start) {
            return Err(refuse(format!(
                "{} after {}: expected rows in the order of time; `sort -t, -k2,2n -k1,1n` puts them so",
                page.start, before.start
            )));
        }
        pages.push(page);
    }
    if pages.is_empty() {
        return Err(CliError::input(format!("{name}: no page in it: expected {ROWS}")));
    }
    Ok(pages)
}

/// Rows of a file, plain or packed by gzip, up to [`LARGEST_BYTES`] of them.
fn rows_of(path: &Path, name: &str) -> Result<Box<dyn BufRead>, CliError> {
    let failed = |error: io::Error| CliError::read(name, &error);
    let mut file = File::open(path).map_err(failed)?;
    let mut head = Vec::new();
    file.by_ref().take(HEAD_BYTES).read_to_end(&mut head).map_err(failed)?;
    let damaged = |error: InflateError| CliError::input(format!("{name}: {error}"));
    if head.starts_with(&GZIP) {
        file.take(LARGEST_BYTES / 4).read_to_end(&mut head).map_err(failed)?;
        return Ok(Box::new(Cursor::new(inflate(&head, LARGEST_BYTES).map_err(damaged)?)));
    }
    // Other packers are named.
    let head = inflate(&head, LARGEST_BYTES).map_err(damaged)?;
    Ok(Box::new(Cursor::new(head).chain(BufReader::new(file))))
}

/// Reads what the arguments name to trust.
pub fn anchor(arguments: &Verify) -> Result<Anchor, CliError> {
    match (&arguments.merkle_root, &arguments.public_key) {
        (Some(root), None) => merkle_root(root).map(Anchor::Tree),
        (None, Some(path)) => {
            let key = public_key(path)?;
            arguments.kroot.as_deref().map_or_else(|| Ok(Anchor::Key(key.clone())), |path| stored(&key, path))
        }
        _ => Err(CliError::usage("osnma verify: expected --merkle-root or --public-key, one of them")),
    }
}

/// Root of a tree by its digits, or by its file.
fn merkle_root(given: &str) -> Result<MerkleRoot, CliError> {
    let path = Path::new(given);
    if given.len() >= 16 && given.bytes().all(|byte| byte.is_ascii_hexdigit()) && !path.exists() {
        let bytes = unhex(given).ok().and_then(|bytes| bytes.try_into().ok());
        return bytes.map(MerkleRoot).ok_or_else(|| {
            CliError::usage(format!("--merkle-root: expected 64 hexadecimal digits, found {}", given.len()))
        });
    }
    let (name, text) = scenario::text(path)?;
    files::merkle_root(&text).map_err(|error| CliError::input(format!("{name}: {error}")))
}

fn public_key(path: &Path) -> Result<PublicKey, CliError> {
    let (name, text) = scenario::text(path)?;
    files::key(&text).map_err(|error| CliError::input(format!("{name}: {error}")))
}

/// Root key of a hot start, whose signature must be that of the key.
fn stored(key: &PublicKey, path: &Path) -> Result<Anchor, CliError> {
    let (name, text) = scenario::text(path)?;
    let refuse = |what: String| CliError::input(format!("{name}:1: {what}"));
    let digit = |at: usize| refuse(format!("expected an even count of hexadecimal digits, not so at {}", at + 1));
    let bytes = unhex(text.trim()).map_err(digit)?;
    let kroot = Verifier::root_of(&bytes).map_err(|error| refuse(format!("no root key: {error}")))?;
    if kroot.key_id != key.id {
        let (own, other) = (kroot.key_id, key.id);
        return Err(refuse(format!("signed by public key {own}: expected {other}, the key of --public-key")));
    }
    key.verify(&kroot).map_err(|error| refuse(format!("{error}: expected a root key that --public-key signed")))?;
    Ok(Anchor::Root(key.clone(), Box::new(kroot)))
}
