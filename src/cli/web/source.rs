//! Rows of a page from outside: JSON lines of a receiver, and the tables of a directory while they grow.
//!
//! Lines are bounded in length, and one that is not understood is passed over and counted.

use std::fs::File;
use std::io::{self, BufRead, BufReader, Read};
use std::path::{Path, PathBuf};
use std::thread;
use std::time::{Duration, Instant};

use serde_json::{Map, Value, json};

use super::{FRAME, State, Table, Web};
use crate::cli::address::connect;

/// Bytes of a line at most.
const MOST_BYTES: u64 = 1 << 18;
/// Time between attempts to connect.
const AGAIN: Duration = Duration::from_secs(1);
/// Time of a run in one frame while old rows are read, seconds.
const STEP_S: f64 = 1.0;

/// Follows the JSON lines of a receiver to the end of the process; connects again where the connection ends.
/// `clock` takes the time of the page from this machine's clock.
pub fn follow_lines(web: &Web, peer: &str, clock: bool) -> ! {
    let begun = Instant::now();
    loop {
        web.state().receiver = format!("waiting for tcp:{peer}");
        if let Ok(stream) = connect(peer) {
            web.state().receiver = format!("connected to tcp:{peer}");
            let mut input = BufReader::new(stream);
            let mut skipped = 0_u64;
            while let Ok(Some(line)) = bounded_line(&mut input) {
                let mut state = web.state();
                if !take_line(&mut state, &line) {
                    skipped += 1;
                    state.receiver = format!("connected to tcp:{peer}; {skipped} lines not understood");
                }
                if clock {
                    state.t_s = begun.elapsed().as_secs_f64();
                }
            }
            web.state().receiver = format!("tcp:{peer} ended");
        }
        thread::sleep(AGAIN);
    }
}

/// The next line without what lies beyond its bound; `None` at the end of the input.
fn bounded_line(input: &mut impl BufRead) -> io::Result<Option<Vec<u8>>> {
    let mut line = Vec::new();
    if input.by_ref().take(MOST_BYTES).read_until(b'\n', &mut line)? == 0 {
        return Ok(None);
    }
    let mut rest = Vec::new();
    while !line.ends_with(b"\n") && !rest.ends_with(b"\n") {
        rest.clear();
        if input.by_ref().take(MOST_BYTES).read_until(b'\n', &mut rest)? == 0 {
            break;
        }
        line.clear();
    }
    Ok(Some(line))
}

/// Takes a line of JSON; false if it is none of a receiver.
fn take_line(state: &mut State, line: &[u8]) -> bool {
    let Ok(value) = serde_json::from_slice::<Value>(line) else { return line.trim_ascii().is_empty() };
    match value.get("record").and_then(Value::as_str) {
        Some("fix") => state.take(Table::Fixes, &value),
        Some("channel") => state.take(Table::Channels, &value),
        Some("satellites") => {
            state.clear_sights();
            let rows = value.get("rows").and_then(Value::as_array).into_iter().flatten();
            rows.for_each(|row| state.take(Table::Sights, row));
        }
        // Known records that the page does not show.
        Some("ionosphere" | "event" | "search" | "interference" | "summary") => {}
        _ => return false,
    }
    true
}

/// Tables of a run or a record, and their kinds.
const TABLES: [(&str, Table); 7] = [
    ("truth/trajectory.csv", Table::Trajectory),
    ("truth/sky.csv", Table::Sky),
    ("truth/observations.csv", Table::Observations),
    ("rx/fixes.csv", Table::Fixes),
    ("rx/tracking.csv", Table::Channels),
    ("fixes.csv", Table::Fixes),
    ("tracking.csv", Table::Channels),
];

/// A table that may grow.
struct Growing {
    name: &'static str,
    table: Table,
    file: Option<BufReader<File>>,
    header: Vec<String>,
    /// Part of a line that is not whole yet.
    begun: Vec<u8>,
    /// Next row and its sample.
    next: Option<(f64, Value)>,
}

impl Growing {
    /// Makes the next row ready, if there is one.
    fn look(&mut self, directories: &[PathBuf]) {
        if self.next.is_some() {
            return;
        }
        if self.file.is_none() {
            self.file =
                directories.iter().find_map(|directory| File::open(directory.join(self.name)).ok()).map(BufReader::new);
        }
        let Some(file) = &mut self.file else { return };
        while self.next.is_none() {
            let left = MOST_BYTES.saturating_sub(self.begun.len() as u64).max(1);
            if file.by_ref().take(left).read_until(b'\n', &mut self.begun).is_err() || !self.begun.ends_with(b"\n") {
                return;
            }
            let fields = fields(&std::mem::take(&mut self.begun));
            if self.header.is_empty() {
                self.header = fields;
                continue;
            }
            let value = |text: String| text.parse::<f64>().map_or_else(|_| json!(text), |value| json!(value));
            let row: Map<String, Value> = self.header.iter().cloned().zip(fields.into_iter().map(value)).collect();
            let sample = row.get("sample").and_then(Value::as_f64);
            self.next = sample.map(|sample| (sample, Value::Object(row)));
        }
    }
}

/// Fields of a line of CSV.
fn fields(line: &[u8]) -> Vec<String> {
    let mut reader = csv::ReaderBuilder::new().has_headers(false).from_reader(line);
    let record = reader.records().next().and_then(Result::ok);
    record.map(|record| record.iter().map(str::to_owned).collect()).unwrap_or_default()
}

/// Directories that a run or a record of this name has, finished or not.
pub fn directories(target: &Path) -> Vec<PathBuf> {
    let beside = |before: &str, after: &str| {
        let name = target.file_name().map(|name| name.to_string_lossy().into_owned());
        name.map(|name| target.with_file_name(format!("{before}{name}{after}")))
    };
    let unfinished = [beside("", ".unfinished"), beside(".", ".part")];
    [Some(target.to_owned())].into_iter().chain(unfinished).flatten().filter(|path| path.is_dir()).collect()
}

/// Follows the tables of a run to the end of the process.
pub fn follow_directory(web: &Web, target: &Path) -> ! {
    let empty = |(name, table)| Growing { name, table, file: None, header: Vec::new(), begun: Vec::new(), next: None };
    let mut tables = TABLES.map(empty);
    let mut shown_s = f64::NEG_INFINITY;
    loop {
        let places = directories(target);
        tables.iter_mut().for_each(|table| table.look(&places));
        // At one sample the trajectory is first, as in the truth itself.
        let first = tables.iter_mut().filter(|table| table.next.is_some()).min_by(|a, b| {
            let sample = |table: &Growing| table.next.as_ref().map_or(f64::INFINITY, |(sample, _)| *sample);
            sample(a).total_cmp(&sample(b))
        });
        let mut state = web.state();
        let due = match first {
            Some(growing) => {
                if let Some((_, row)) = growing.next.take() {
                    state.take(growing.table, &row);
                }
                state.t_s = state.newest_s();
                state.t_s >= shown_s + STEP_S
            }
            None => true,
        };
        if !due {
            continue;
        }
        let waits = tables.iter().all(|table| table.next.is_none());
        shown_s = state.t_s;
        state.receiver = "the tables of the directory".to_owned();
        if let Some(status) = places.iter().find_map(|place| std::fs::read(place.join("live.json")).ok()) {
            state.status = serde_json::from_slice(&status).unwrap_or_default();
        }
        drop(state);
        web.publish();
        if waits {
            thread::sleep(FRAME);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_of_any_length_is_bounded_and_the_next_one_counts() {
        let long = "x".repeat(3 * MOST_BYTES as usize);
        let text = format!("{long}\n{{\"record\": \"summary\"}}\nlast");
        let mut input = text.as_bytes();
        assert_eq!(bounded_line(&mut input).unwrap(), Some(Vec::new()));
        let known = bounded_line(&mut input).unwrap().unwrap();
        assert!(take_line(&mut State::default(), &known));
        assert_eq!(bounded_line(&mut input).unwrap(), Some(b"last".to_vec()));
        assert!(!take_line(&mut State::default(), b"last") && !take_line(&mut State::default(), b"{\"record\": 3}"));
        assert_eq!(bounded_line(&mut input).unwrap(), None);
    }

    #[test]
    fn a_table_is_read_as_it_grows_and_under_each_of_its_names() {
        use std::io::Write;
        let directory = tempfile::tempdir().unwrap();
        let target = directory.path().join("flight");
        let part = directory.path().join(".flight.part");
        std::fs::create_dir_all(part.join("truth")).unwrap();
        assert_eq!(directories(&target), std::slice::from_ref(&part));
        let mut file = File::create(part.join("truth/sky.csv")).unwrap();
        let mut growing =
            Growing { name: "truth/sky.csv", table: Table::Sky, file: None, header: vec![], begun: vec![], next: None };
        let places = directories(&target);
        growing.look(&places);
        file.write_all(b"sample,sv,azimuth_deg\n7,G0").unwrap();
        growing.look(&places);
        assert!(growing.next.is_none());
        file.write_all(b"1,12.5\n").unwrap();
        growing.look(&places);
        assert_eq!(growing.next, Some((7.0, json!({ "sample": 7.0, "sv": "G01", "azimuth_deg": 12.5 }))));
    }
}
