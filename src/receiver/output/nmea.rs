//! The receiver's fixes as NMEA 0183, epoch by epoch.

use std::collections::BTreeMap;
use std::io::Write;
use std::path::PathBuf;

use super::{OutputError, Record, Sink, write_error};
use gnss::nmea::{Place, Seen, epoch};
use gnss::record::{Fix, Observation, SightRow};
use gnss::satellite::Sv;
use gnss::signal::Signal;

/// Writes the sentences of every fix, in one piece each.
pub struct Nmea<W> {
    name: PathBuf,
    writer: W,
    /// Sample of the newest observations.
    sample: u64,
    /// C/N0 in dB-Hz of the signals that were observed then.
    observed: BTreeMap<(Sv, &'static Signal), f64>,
    fix: Option<Fix>,
}

impl<W: Write> Nmea<W> {
    /// A sink to a writer that messages call `name`.
    pub fn new(name: PathBuf, writer: W) -> Self {
        Self { name, writer, sample: 0, observed: BTreeMap::new(), fix: None }
    }

    fn observe(&mut self, row: &Observation) {
        if row.sample != self.sample {
            self.observed.clear();
            self.sample = row.sample;
        }
        self.observed.insert((row.sv, row.signal), row.cn0_dbhz);
    }

    fn write(&mut self, sights: &[SightRow]) -> Result<(), OutputError> {
        let Some(fix) = self.fix.take() else { return Ok(()) };
        let place = Place {
            time: fix.time(),
            position_m: fix.position_m(),
            velocity_mps: fix.velocity_mps(),
            satellites: fix.satellites,
            pdop: fix.pdop,
            hdop: fix.hdop,
            vdop: fix.vdop,
        };
        let seen: Vec<Seen> = sights.iter().map(|row| self.seen(row)).collect();
        let written = self.writer.write_all(epoch(&place, &seen).as_bytes()).and_then(|()| self.writer.flush());
        written.map_err(|error| write_error(&self.name, error))
    }

    fn seen(&self, row: &SightRow) -> Seen {
        let own = self.observed.iter().filter(|((sv, _), _)| *sv == row.sv).map(|((_, signal), cn0)| (*signal, *cn0));
        Seen {
            sv: row.sv,
            signal: own.max_by(|a, b| a.1.total_cmp(&b.1)),
            azimuth_deg: row.azimuth_deg,
            elevation_deg: row.elevation_deg,
            used: row.used,
        }
    }
}

impl<W: Write> Sink for Nmea<W> {
    fn take(&mut self, record: Record) -> Result<(), OutputError> {
        match record {
            Record::Observation(row) => self.observe(&row),
            Record::Fix(fix) => self.fix = Some(fix),
            Record::Sights(rows) => self.write(&rows)?,
            _ => {}
        }
        Ok(())
    }
}
