//! `logs`: content of a receiver's log, and its messages as tables.
//!
//! A log is read once, with the memory of one message. Each kind of message whose fields are known becomes a
//! table with the names of its interface description, whose first column is the number of bytes before the
//! message's frame. Observations and positions of all protocols are in two tables more.

use std::collections::BTreeMap;
use std::fs::{self, File};
use std::io::{self, Read};
use std::path::{Path, PathBuf};

use serde_json::{Value as Json, json};

use crate::cli::args;
use crate::cli::error::CliError;
use crate::cli::ntrip;
use crate::cli::staging::Staging;
use gnss::earth::Geodetic;
use gnss::time::Epoch;
use logs::contents::Contents;
use logs::log::{Log, Message};
use logs::observed::{Event, Fix, ObservedEpoch};
use logs::table::Value;

const OBSERVATIONS: [&str; 13] = [
    "byte",
    "protocol",
    "week",
    "tow_s",
    "sv",
    "signal",
    "pseudorange_m",
    "carrier_cycles",
    "doppler_hz",
    "cn0_dbhz",
    "lock_s",
    "lost_lock",
    "half_cycle_ambiguous",
];
const FIXES: [&str; 17] = [
    "byte",
    "protocol",
    "week",
    "tow_s",
    "latitude_deg",
    "longitude_deg",
    "height_m",
    "velocity_east_mps",
    "velocity_north_mps",
    "velocity_up_mps",
    "solution",
    "satellites",
    "horizontal_sigma_m",
    "vertical_sigma_m",
    "speed_sigma_mps",
    "time_sigma_s",
    "gps_time",
];

/// Reads a log, writes its tables where they are asked for, and prints what it holds.
pub fn execute(arguments: &args::Logs) -> Result<(), CliError> {
    let name = arguments.log.display().to_string();
    let staging = arguments.out.as_deref().map(Staging::directory).transpose()?;
    let mut log = Log::new(open(&arguments.log)?, arguments.near);
    let mut tables = staging.as_ref().map(|staging| Tables::new(staging.path()));
    let mut undated = 0_u64;
    for message in &mut log {
        let message = message.map_err(|error| CliError::read(&name, &error))?;
        undated += u64::from(message.event == Some(Event::Undated));
        if let Some(tables) = &mut tables {
            tables.take(&message)?;
        }
    }
    let contents = log.contents();
    if contents.protocols.is_empty() {
        let bytes = contents.skipped_bytes;
        let what = format!("{name}: no frame of UBX, RTCM 3, SBF or NMEA in {bytes} bytes: expected a receiver's log");
        return Err(CliError::input(what));
    }
    let mut object = object(&contents);
    object["undated"] = json!(undated);
    let mut text = contents.to_string();
    if undated > 0 {
        text += &format!("{:<14}{undated} messages have no week: --near gives it\n", "undated");
    }
    if let (Some(staging), Some(tables), Some(out)) = (staging, tables, &arguments.out) {
        tables.finish()?;
        let path = staging.path().join("log.json");
        fs::write(&path, format!("{object}\n")).map_err(|error| CliError::output(path.display(), &error))?;
        staging.commit()?;
        text += &format!("tables in {}\n", out.display());
        object["results"] = json!(out);
    }
    arguments.printed.results(&text, || object)
}

/// A log's bytes. A pipe or a device other than standard input may have no end and is refused.
fn open(path: &Path) -> Result<Box<dyn Read>, CliError> {
    if path == Path::new("-") {
        return Ok(Box::new(io::stdin().lock()));
    }
    if ntrip::is_stream(path) {
        return ntrip::open(path);
    }
    let failed = |error: io::Error| CliError::read(path.display(), &error);
    if !fs::metadata(path).map_err(failed)?.is_file() {
        return Err(CliError::input(format!("{}: expected an ordinary file, or - for standard input", path.display())));
    }
    Ok(Box::new(File::open(path).map_err(failed)?))
}

/// Counts of a log as an object.
pub fn object(contents: &Contents) -> Json {
    let protocols = contents.protocols.iter().map(
        |(protocol, count)| json!({ "protocol": protocol.name(), "frames": count.frames, "damaged": count.damaged }),
    );
    let messages = contents.messages.iter().map(|(protocol, name, tally)| {
        json!({
            "protocol": protocol.name(),
            "message": name,
            "count": tally.count,
            "read": tally.read,
            "malformed": tally.malformed,
        })
    });
    json!({
        "protocols": protocols.collect::<Vec<_>>(),
        "skipped_bytes": contents.skipped_bytes,
        "messages": messages.collect::<Vec<_>>(),
    })
}

/// Tables in the making, by their names.
struct Tables {
    directory: PathBuf,
    open: BTreeMap<&'static str, csv::Writer<File>>,
}

impl Tables {
    fn new(directory: &Path) -> Self {
        Self { directory: directory.to_owned(), open: BTreeMap::new() }
    }

    /// Writes a message's rows.
    fn take(&mut self, message: &Message) -> Result<(), CliError> {
        if let Some(table) = &message.table {
            let columns = ["byte"].into_iter().chain(table.columns.iter().copied());
            for row in &table.rows {
                let cells = row.iter().map(Value::to_string);
                self.row(table.name, columns.clone(), [message.offset.to_string()].into_iter().chain(cells))?;
            }
        }
        let head = [message.offset.to_string(), message.protocol.name().to_owned()];
        match &message.event {
            Some(Event::Observations(epoch)) => {
                for row in observation_rows(epoch) {
                    self.row("observations", OBSERVATIONS.into_iter(), head.iter().cloned().chain(row))?;
                }
            }
            Some(Event::Fix(fix)) => self.row("fixes", FIXES.into_iter(), head.into_iter().chain(fix_row(fix)))?,
            _ => {}
        }
        Ok(())
    }

    fn row(
        &mut self,
        name: &'static str,
        columns: impl Iterator<Item = &'static str>,
        cells: impl Iterator<Item = String>,
    ) -> Result<(), CliError> {
        let path = self.directory.join(format!("{name}.csv"));
        let failed = |error: csv::Error| match error.into_kind() {
            csv::ErrorKind::Io(error) => CliError::output(path.display(), &error),
            other => CliError::bug(format!("{other:?}")),
        };
        let writer = match self.open.entry(name) {
            std::collections::btree_map::Entry::Occupied(entry) => entry.into_mut(),
            std::collections::btree_map::Entry::Vacant(entry) => {
                let file = File::create(&path).map_err(|error| CliError::create(path.display(), &error))?;
                let mut writer = csv::Writer::from_writer(file);
                writer.write_record(columns).map_err(failed)?;
                entry.insert(writer)
            }
        };
        writer.write_record(cells).map_err(failed)
    }

    fn finish(self) -> Result<(), CliError> {
        for (name, mut writer) in self.open {
            let path = self.directory.join(format!("{name}.csv"));
            writer.flush().map_err(|error| CliError::output(path.display(), &error))?;
        }
        Ok(())
    }
}

fn cell(value: Option<f64>) -> String {
    value.map_or_else(String::new, |value| value.to_string())
}

/// Week and seconds of the week.
fn time_cells(at: Epoch) -> [String; 2] {
    [at.week().to_string(), at.tow_s().to_string()]
}

fn observation_rows(epoch: &ObservedEpoch) -> impl Iterator<Item = Vec<String>> + '_ {
    epoch.values.iter().map(|value| {
        let [week, tow_s] = time_cells(epoch.label);
        vec![
            week,
            tow_s,
            value.sv.to_string(),
            value.code.to_owned(),
            cell(value.pseudorange_m),
            cell(value.carrier_cycles),
            cell(value.doppler_hz),
            cell(value.cn0_dbhz),
            cell(value.lock_s),
            value.lost_lock.to_string(),
            value.half_cycle_ambiguous.to_string(),
        ]
    })
}

fn fix_row(fix: &Fix) -> Vec<String> {
    let [week, tow_s] = time_cells(fix.label);
    let place = Geodetic::from_ecef(&fix.position_m);
    let velocity = |axis: usize| cell(fix.velocity_enu_mps.map(|velocity| velocity[axis]));
    vec![
        week,
        tow_s,
        format!("{:.10}", place.latitude_rad.to_degrees()),
        format!("{:.10}", place.longitude_rad.to_degrees()),
        format!("{:.5}", place.height_m),
        velocity(0),
        velocity(1),
        velocity(2),
        fix.solution.name().to_owned(),
        fix.satellites.to_string(),
        cell(fix.horizontal_sigma_m),
        cell(fix.vertical_sigma_m),
        cell(fix.speed_sigma_mps),
        cell(fix.time_sigma_s),
        fix.label.to_string(),
    ]
}
