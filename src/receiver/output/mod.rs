//! Where the receiver writes what it finds: one CSV file a kind of row, and its settings.

use std::fs::{self, File};
use std::io::BufWriter;
use std::path::{Path, PathBuf};

use serde::Serialize;
use thiserror::Error;

use crate::gnss::record::{AcquisitionRow, EventRow, Fix, NavigationRow, Observation, TrackingRow};
use crate::gnss::samples::IfMetadata;
use crate::receiver::settings::Settings;

/// An output that could not be created or written.
#[derive(Debug, Error)]
pub enum OutputError {
    #[error("cannot create {}: {error}", path.display())]
    Create { path: PathBuf, error: std::io::Error },
    #[error("cannot write {}: {error}", path.display())]
    Write { path: PathBuf, error: std::io::Error },
}

/// The files of one run of the receiver.
pub struct Output {
    directory: PathBuf,
    observations: Table<Observation>,
    fixes: Table<Fix>,
    acquisition: Table<AcquisitionRow>,
    tracking: Table<TrackingRow>,
    navigation: Table<NavigationRow>,
    events: Table<EventRow>,
}

impl Output {
    /// Creates the files in `directory`, which is made if it does not exist.
    ///
    /// # Errors
    /// [`OutputError::Create`] with the path.
    pub fn create(directory: &Path) -> Result<Self, OutputError> {
        fs::create_dir_all(directory).map_err(|error| OutputError::Create { path: directory.to_owned(), error })?;
        Ok(Self {
            directory: directory.to_owned(),
            observations: Table::create(
                directory.join("observations.csv"),
                "sample,sv,signal,sent_s,sent_fraction_s,pseudorange_m,carrier_cycles,doppler_hz,cn0_dbhz,locked_s",
            )?,
            fixes: Table::create(
                directory.join("fixes.csv"),
                "sample,gps_s,gps_fraction_s,x_m,y_m,z_m,vx_mps,vy_mps,vz_mps,clock_bias_s,clock_drift,sigma_east_m,\
                 sigma_north_m,sigma_up_m,sigma_clock_m,gdop,pdop,hdop,vdop,tdop,satellites,chi_square,excluded,ionosphere",
            )?,
            acquisition: Table::create(
                directory.join("acquisition.csv"),
                "sample,sv,signal,acquired,statistic,threshold,doppler_hz,code_phase_chips,cn0_dbhz",
            )?,
            tracking: Table::create(
                directory.join("tracking.csv"),
                "sample,sv,signal,prompt_i,prompt_q,dll_discriminator_chips,pll_discriminator_cycles,\
                 fll_discriminator_hz,cn0_dbhz,phase_lock,integration_s",
            )?,
            navigation: Table::create(directory.join("navigation.csv"), "sv,issue,parameter,raw")?,
            events: Table::create(directory.join("events.csv"), "sample,sv,signal,event")?,
        })
    }

    /// Writes `receiver.json`: the settings and what the metadata said.
    pub fn describe(&mut self, metadata: &IfMetadata, settings: &Settings) -> Result<(), OutputError> {
        #[derive(Serialize)]
        struct Description<'a> {
            program: &'static str,
            version: &'static str,
            format: &'static str,
            sample_rate_hz: f64,
            center_hz: f64,
            inverted: bool,
            start: Option<String>,
            settings: &'a Settings,
        }
        let description = Description {
            program: env!("CARGO_PKG_NAME"),
            version: env!("CARGO_PKG_VERSION"),
            format: metadata.format.name(),
            sample_rate_hz: metadata.rate.hz(),
            center_hz: metadata.center_hz,
            inverted: metadata.inverted,
            start: metadata.start.map(|start| start.to_string()),
            settings,
        };
        let path = self.directory.join("receiver.json");
        serde_json::to_string_pretty(&description)
            .map_err(std::io::Error::from)
            .and_then(|text| fs::write(&path, text + "\n"))
            .map_err(|error| OutputError::Write { path, error })
    }

    /// Writes an observation.
    pub fn observation(&mut self, row: &Observation) -> Result<(), OutputError> {
        self.observations.write(row)
    }

    /// Writes a fix.
    pub fn fix(&mut self, row: &Fix) -> Result<(), OutputError> {
        self.fixes.write(row)
    }

    /// Writes the outcome of a search.
    pub fn acquisition(&mut self, row: &AcquisitionRow) -> Result<(), OutputError> {
        self.acquisition.write(row)
    }

    /// Writes the state of a tracking loop.
    pub fn tracking(&mut self, row: &TrackingRow) -> Result<(), OutputError> {
        self.tracking.write(row)
    }

    /// Writes a decoded parameter.
    pub fn navigation(&mut self, row: &NavigationRow) -> Result<(), OutputError> {
        self.navigation.write(row)
    }

    /// Writes an event.
    pub fn event(&mut self, row: &EventRow) -> Result<(), OutputError> {
        self.events.write(row)
    }

    /// Brings everything to the files.
    pub fn finish(&mut self) -> Result<(), OutputError> {
        self.observations.flush()?;
        self.fixes.flush()?;
        self.acquisition.flush()?;
        self.tracking.flush()?;
        self.navigation.flush()?;
        self.events.flush()
    }
}

/// A CSV file of one kind of row; its header is there even when no row is.
struct Table<T> {
    path: PathBuf,
    writer: csv::Writer<BufWriter<File>>,
    row: std::marker::PhantomData<fn(&T)>,
}

impl<T: Serialize> Table<T> {
    fn create(path: PathBuf, header: &str) -> Result<Self, OutputError> {
        let file = File::create(&path).map_err(|error| OutputError::Create { path: path.clone(), error })?;
        let writer = csv::WriterBuilder::new().has_headers(false).from_writer(BufWriter::new(file));
        let mut table = Self { path, writer, row: std::marker::PhantomData };
        let header = table.writer.write_record(header.split(',')).map_err(std::io::Error::from);
        table.check(header)?;
        Ok(table)
    }

    fn write(&mut self, row: &T) -> Result<(), OutputError> {
        let written = self.writer.serialize(row).map_err(std::io::Error::from);
        self.check(written)
    }

    fn flush(&mut self) -> Result<(), OutputError> {
        let flushed = self.writer.flush();
        self.check(flushed)
    }

    fn check(&self, result: std::io::Result<()>) -> Result<(), OutputError> {
        result.map_err(|error| OutputError::Write { path: self.path.clone(), error })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gnss::satellite::Sv;

    #[test]
    fn headers_stand_above_rows_and_alone_where_there_is_none() {
        let directory = tempfile::tempdir().unwrap();
        let mut output = Output::create(&directory.path().join("rx")).unwrap();
        let row = NavigationRow { sv: Sv::gps(5), issue: 7, parameter: "toe_s".into(), raw: -3 };
        output.navigation(&row).unwrap();
        output.finish().unwrap();
        let mut reader = csv::Reader::from_path(directory.path().join("rx/navigation.csv")).unwrap();
        let rows: Vec<NavigationRow> = reader.deserialize().map(Result::unwrap).collect();
        assert_eq!(rows, [row]);
        for (name, columns) in
            [("observations", 10), ("fixes", 24), ("acquisition", 9), ("tracking", 11), ("events", 4)]
        {
            let text = fs::read_to_string(directory.path().join(format!("rx/{name}.csv"))).unwrap();
            assert_eq!(text.lines().count(), 1);
            assert_eq!(text.trim().split(',').count(), columns, "{name}");
        }
    }
}
