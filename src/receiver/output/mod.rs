//! Records of a receiver ([`Record`]), the trait that takes them ([`Sink`]), and the sink that writes files.
//! Each kind of record has one CSV file. `receiver.json` holds settings and outcome.
//!
//! Rows are written as they come, so memory stays flat. Headers are written at once: a file without rows says
//! that there were none, a missing file that nothing ran.

mod json;
mod nmea;
mod rinex;
mod tracks;

use std::collections::btree_map::Entry;
use std::collections::{BTreeMap, BTreeSet};
use std::fs::{self, File};
use std::io::BufWriter;
use std::path::{Path, PathBuf};

use serde::Serialize;
use thiserror::Error;

use gnss::exchange::{NavigationSets, bears_issue};
use gnss::record::{
    AcquisitionRow, AttitudeRow, ClockRow, DetectionRow, ElementRow, EventRow, Fix, Geographic, IntegrityRow,
    IonosphereRow, LineRow, NavigationRow, Observation, SightRow, TagRow, TrackingRow,
};
use gnss::time::GPST;
pub use json::JsonLines;
pub use nmea::Nmea;
pub use rinex::Rinex;
pub use tracks::Tracks;

/// A file that could not be made or written.
#[derive(Debug, Error)]
pub enum OutputError {
    /// A file that cannot be made.
    #[error("cannot create {}: {error}", path.display())]
    Create {
        /// The file.
        path: PathBuf,
        /// Error of the operating system.
        error: std::io::Error,
    },
    /// A file that cannot be written.
    #[error("cannot write {}: {error}", path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// Error of the operating system.
        error: std::io::Error,
    },
    /// A sink that takes no records.
    #[error("the receiver's results are not taken: {0}")]
    Refused(Box<dyn std::error::Error + Send + Sync>),
}

/// One thing that a receiver reports.
#[derive(Clone, Debug)]
pub enum Record {
    /// The outcome of a search for a satellite's signal.
    Acquisition(AcquisitionRow),
    /// The state of a channel's loops.
    Tracking(TrackingRow),
    /// Something that happened to a channel.
    Event(EventRow),
    /// Measurement of a channel at a common epoch.
    Observation(Observation),
    /// Parameters as decoded. An ephemeris that is read again is reported again.
    Navigation(Vec<NavigationRow>),
    /// A position, velocity and time.
    Fix(Fix),
    /// The clocks of the fix before: one a time scale.
    Clocks(Vec<ClockRow>),
    /// Directions of the satellites at the fix before, including those that it left out.
    Sights(Vec<SightRow>),
    /// The ionosphere at the fix before, of satellites with two bands.
    Ionosphere(Vec<IonosphereRow>),
    /// Result of a tag of Galileo's message authentication.
    Tag(TagRow),
    /// Protection levels of the fix before, where they are asked for.
    Integrity(Box<IntegrityRow>),
    /// Test of a detector of jamming or spoofing, where detection is asked for.
    Detection(DetectionRow),
    /// Attitude of an array's body and the phases of its channels, where they are asked for.
    Attitude(AttitudeRow, Vec<ElementRow>),
    /// A line in the spectrum of a front end's samples; front ends count from 0.
    Interference {
        /// The front end's index, from 0 on.
        front_end: usize,
        /// The line.
        row: LineRow,
    },
}

/// Takes what a receiver reports, in the order in which it is found.
pub trait Sink {
    /// Takes a record.
    ///
    /// # Errors
    /// A reason for which the sink cannot; the reception ends with it.
    fn take(&mut self, record: Record) -> Result<(), OutputError>;

    /// The reception is over; `summary` is what `receiver.json` says.
    ///
    /// # Errors
    /// Errors of [`Sink::take`].
    fn finish(&mut self, summary: &serde_json::Value) -> Result<(), OutputError> {
        let _ = summary;
        Ok(())
    }
}

/// Keeps every record.
impl Sink for Vec<Record> {
    fn take(&mut self, record: Record) -> Result<(), OutputError> {
        self.push(record);
        Ok(())
    }
}

/// Hands every record to both.
impl<A: Sink + ?Sized, B: Sink + ?Sized> Sink for (&mut A, &mut B) {
    fn take(&mut self, record: Record) -> Result<(), OutputError> {
        self.0.take(record.clone())?;
        self.1.take(record)
    }

    fn finish(&mut self, summary: &serde_json::Value) -> Result<(), OutputError> {
        self.0.finish(summary)?;
        self.1.finish(summary)
    }
}

fn create_error(path: &Path, error: std::io::Error) -> OutputError {
    OutputError::Create { path: path.to_owned(), error }
}

fn write_error(path: &Path, error: std::io::Error) -> OutputError {
    OutputError::Write { path: path.to_owned(), error }
}

/// The I/O error itself, which shows whether another try is worth it.
fn io_error(error: csv::Error) -> std::io::Error {
    match error.into_kind() {
        csv::ErrorKind::Io(error) => error,
        other => std::io::Error::other(format!("{other:?}")),
    }
}

/// One CSV file.
struct Sheet {
    path: PathBuf,
    writer: csv::Writer<BufWriter<File>>,
}

impl Sheet {
    fn create(directory: &Path, name: &str, header: &[&str]) -> Result<Self, OutputError> {
        let path = directory.join(name);
        let file = File::create(&path).map_err(|error| create_error(&path, error))?;
        let mut writer = csv::WriterBuilder::new().has_headers(false).from_writer(BufWriter::new(file));
        writer.write_record(header).map_err(|error| write_error(&path, io_error(error)))?;
        Ok(Self { path, writer })
    }

    fn write<T: Serialize>(&mut self, row: &T) -> Result<(), OutputError> {
        self.writer.serialize(row).map_err(|error| write_error(&self.path, io_error(error)))
    }

    fn flush(&mut self) -> Result<(), OutputError> {
        self.writer.flush().map_err(|error| write_error(&self.path, error))
    }
}

/// A CSV file that exists once it has a row.
struct Later {
    name: &'static str,
    header: &'static [&'static str],
    sheet: Option<Sheet>,
}

impl Later {
    /// Removes the file of another run.
    fn new(directory: &Path, name: &'static str, header: &'static [&'static str]) -> Result<Self, OutputError> {
        let path = directory.join(name);
        if path.exists() {
            fs::remove_file(&path).map_err(|error| write_error(&path, error))?;
        }
        Ok(Self { name, header, sheet: None })
    }

    fn write<T: Serialize>(&mut self, directory: &Path, rows: &[T]) -> Result<(), OutputError> {
        if self.sheet.is_none() && !rows.is_empty() {
            self.sheet = Some(Sheet::create(directory, self.name, self.header)?);
        }
        let Some(sheet) = &mut self.sheet else { return Ok(()) };
        rows.iter().try_for_each(|row| sheet.write(row))
    }
}

/// Root key of a hot start, as hexadecimal digits.
pub const STORED_ROOT: &str = "kroot.hex";

/// Table of the results of tags: `osnma.csv`.
pub struct TagTable(Sheet);

impl TagTable {
    /// Creates the table in an existing directory.
    ///
    /// # Errors
    /// [`OutputError::Create`] with the path that cannot be made.
    pub fn create(directory: &Path) -> Result<Self, OutputError> {
        Sheet::create(directory, "osnma.csv", &TagRow::COLUMNS).map(Self)
    }

    /// Writes a row.
    ///
    /// # Errors
    /// [`OutputError::Write`] with the file.
    pub fn write(&mut self, row: &TagRow) -> Result<(), OutputError> {
        self.0.write(row)
    }

    /// Writes what is buffered.
    ///
    /// # Errors
    /// [`OutputError::Write`] with the file.
    pub fn flush(&mut self) -> Result<(), OutputError> {
        self.0.flush()
    }
}

/// Parameters of messages that were reported so far.
#[derive(Debug, Default)]
pub struct Parameters {
    /// Parameters beside ephemerides, at sample 0.
    common: BTreeSet<NavigationRow>,
    /// Parameters of ephemerides.
    sets: NavigationSets,
}

impl Parameters {
    /// Parameters of a message that are new: of an ephemeris once for each set, others once.
    pub fn fresh(&mut self, mut rows: Vec<NavigationRow>) -> Vec<NavigationRow> {
        // What came with the first parameter of a new set is of that set.
        let begins = rows.iter().any(|row| self.sets.is_issued_again(row));
        rows.retain(|row| match bears_issue(row) {
            true => self.sets.insert(row) || begins,
            false => self.common.insert(NavigationRow { sample: 0, ..row.clone() }),
        });
        rows
    }
}

/// All files of one reception.
pub struct Output {
    directory: PathBuf,
    observations: Sheet,
    fixes: Sheet,
    acquisition: Sheet,
    tracking: Sheet,
    navigation: Sheet,
    events: Sheet,
    interference: Sheet,
    /// Files of the second and later front ends; each exists once it has a line.
    interference_of: BTreeMap<usize, Sheet>,
    /// File of the results of tags, which exists where authentication is verified.
    tags: Option<TagTable>,
    /// Clocks of fixes that have another time scale than GPS time.
    clocks: Later,
    ionosphere: Later,
    integrity: Later,
    detection: Later,
    attitude: Later,
    elements: Later,
    parameters: Parameters,
}

const OBSERVATIONS: [&str; 10] = [
    "sample",
    "sv",
    "signal",
    "sent_s",
    "sent_fraction_s",
    "pseudorange_m",
    "carrier_cycles",
    "doppler_hz",
    "cn0_dbhz",
    "locked_s",
];
const FIXES: [&str; 31] = [
    "sample",
    "gps_s",
    "gps_fraction_s",
    "x_m",
    "y_m",
    "z_m",
    "vx_mps",
    "vy_mps",
    "vz_mps",
    "clock_bias_s",
    "clock_drift",
    "sigma_east_m",
    "sigma_north_m",
    "sigma_up_m",
    "sigma_clock_m",
    "correlation_en",
    "correlation_eu",
    "correlation_nu",
    "gdop",
    "pdop",
    "hdop",
    "vdop",
    "tdop",
    "condition",
    "satellites",
    "chi_square",
    "excluded",
    "ionosphere",
    "ranges",
    "clocks",
    "time_scale",
];
const CLOCKS: [&str; 4] = ["sample", "time_scale", "clock_bias_s", "sigma_clock_m"];
const IONOSPHERE: [&str; 4] = ["sample", "sv", "delay_m", "sigma_m"];
const INTEGRITY: [&str; 13] = [
    "sample",
    "gps_s",
    "gps_fraction_s",
    "method",
    "hpl_m",
    "vpl_m",
    "emt_m",
    "sigma_v_acc_m",
    "satellites",
    "detected",
    "excluded",
    "available",
    "reason",
];
const DETECTION: [&str; 7] = ["sample", "detector", "sv", "signal", "statistic", "threshold", "alarm"];
const ACQUISITION: [&str; 9] =
    ["sample", "sv", "signal", "acquired", "statistic", "threshold", "doppler_hz", "code_phase_chips", "cn0_dbhz"];
const TRACKING: [&str; 16] = [
    "sample",
    "sv",
    "signal",
    "prompt_i",
    "prompt_q",
    "dll_discriminator_chips",
    "pll_discriminator_cycles",
    "fll_discriminator_hz",
    "cn0_dbhz",
    "phase_lock",
    "integration_s",
    "early_i",
    "early_q",
    "late_i",
    "late_q",
    "tap_spacing_chips",
];
const NAVIGATION: [&str; 6] = ["sample", "sv", "issue", "parameter", "raw", "message"];
const EVENTS: [&str; 4] = ["sample", "sv", "signal", "event"];
const INTERFERENCE: [&str; 8] =
    ["sample", "frequency_hz", "jn0_dbhz", "js_db", "statistic", "threshold", "lines", "resolution_hz"];

impl Output {
    /// Requires an existing directory: creating it here would resurrect one that the interrupt handler has
    /// just removed.
    ///
    /// # Errors
    /// [`OutputError::Create`] with the path that cannot be made.
    pub fn create(directory: &Path) -> Result<Self, OutputError> {
        let later = |name, header| Later::new(directory, name, header);
        Ok(Self {
            directory: directory.to_owned(),
            observations: Sheet::create(directory, "observations.csv", &OBSERVATIONS)?,
            fixes: Sheet::create(directory, "fixes.csv", &[&FIXES[..], &Geographic::COLUMNS].concat())?,
            acquisition: Sheet::create(directory, "acquisition.csv", &ACQUISITION)?,
            tracking: Sheet::create(directory, "tracking.csv", &TRACKING)?,
            navigation: Sheet::create(directory, "navigation.csv", &NAVIGATION)?,
            events: Sheet::create(directory, "events.csv", &EVENTS)?,
            interference: Sheet::create(directory, "interference.csv", &INTERFERENCE)?,
            interference_of: BTreeMap::new(),
            tags: None,
            clocks: later("clocks.csv", &CLOCKS)?,
            ionosphere: later("ionosphere.csv", &IONOSPHERE)?,
            integrity: later("integrity.csv", &INTEGRITY)?,
            detection: later("detection.csv", &DETECTION)?,
            attitude: later("attitude.csv", &AttitudeRow::COLUMNS)?,
            elements: later("elements.csv", &ElementRow::COLUMNS)?,
            parameters: Parameters::default(),
        })
    }

    /// Writes what is buffered, so that whole rows can be read.
    ///
    /// # Errors
    /// [`OutputError::Write`] with the file.
    pub fn flush(&mut self) -> Result<(), OutputError> {
        for sheet in [
            &mut self.observations,
            &mut self.fixes,
            &mut self.acquisition,
            &mut self.tracking,
            &mut self.navigation,
            &mut self.events,
            &mut self.interference,
        ] {
            sheet.flush()?;
        }
        let Self { clocks, ionosphere, integrity, detection, attitude, elements, .. } = self;
        let later = [clocks, ionosphere, integrity, detection, attitude, elements];
        later.into_iter().filter_map(|later| later.sheet.as_mut()).try_for_each(Sheet::flush)?;
        self.tags.as_mut().map_or(Ok(()), |tags| tags.0.flush())?;
        self.interference_of.values_mut().try_for_each(Sheet::flush)
    }

    fn tags(&mut self) -> Result<&mut TagTable, OutputError> {
        let tags = match self.tags.take() {
            Some(tags) => tags,
            None => TagTable::create(&self.directory)?,
        };
        Ok(self.tags.insert(tags))
    }

    /// Writes a line of a front end's spectrum.
    fn interference(&mut self, front_end: usize, row: &LineRow) -> Result<(), OutputError> {
        if front_end == 0 {
            return self.interference.write(row);
        }
        let sheet = match self.interference_of.entry(front_end) {
            Entry::Occupied(entry) => entry.into_mut(),
            Entry::Vacant(entry) => {
                let name = format!("interference_{}.csv", front_end + 1);
                entry.insert(Sheet::create(&self.directory, &name, &INTERFERENCE)?)
            }
        };
        sheet.write(row)
    }
}

impl Sink for Output {
    fn take(&mut self, record: Record) -> Result<(), OutputError> {
        let directory = &self.directory;
        match record {
            Record::Acquisition(row) => self.acquisition.write(&row),
            Record::Tracking(row) => self.tracking.write(&row),
            Record::Event(row) => self.events.write(&row),
            Record::Observation(row) => self.observations.write(&row),
            Record::Navigation(rows) => {
                self.parameters.fresh(rows).iter().try_for_each(|row| self.navigation.write(row))
            }
            Record::Fix(row) => {
                let place = Geographic::of(&row.position_m(), row.time());
                self.fixes.write(&(row, place))
            }
            Record::Clocks(rows) if rows.iter().all(|row| row.time_scale == GPST.name) => Ok(()),
            Record::Clocks(rows) => self.clocks.write(directory, &rows),
            Record::Ionosphere(rows) => self.ionosphere.write(directory, &rows),
            Record::Integrity(row) => self.integrity.write(directory, &[row]),
            Record::Detection(row) => self.detection.write(directory, &[row]),
            Record::Attitude(row, elements) => {
                self.attitude.write(directory, &[row])?;
                self.elements.write(directory, &elements)
            }
            // It follows from the fix and the ephemerides.
            Record::Sights(_) => Ok(()),
            Record::Tag(row) => self.tags()?.write(&row),
            Record::Interference { front_end, row } => self.interference(front_end, &row),
        }
    }

    /// Writes what is buffered, `receiver.json`, and what a verification of authentication leaves.
    fn finish(&mut self, summary: &serde_json::Value) -> Result<(), OutputError> {
        if let Some(osnma) = summary.get("osnma") {
            // Without a tag the table says that there were none.
            self.tags()?;
            if let Some(kroot) = osnma["stored_root"].as_str() {
                let path = self.directory.join(STORED_ROOT);
                fs::write(&path, format!("{kroot}\n")).map_err(|error| write_error(&path, error))?;
            }
        }
        self.flush()?;
        let path = self.directory.join("receiver.json");
        let text = serde_json::to_string_pretty(summary).unwrap_or_default() + "\n";
        fs::write(&path, text).map_err(|error| write_error(&path, error))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use gnss::gps::l1ca::L1_CA;
    use gnss::record::Event;
    use gnss::satellite::Sv;

    /// A row written under the header that serde would have written.
    fn header<T: Serialize>(row: &T) -> String {
        let mut writer = csv::Writer::from_writer(Vec::new());
        writer.serialize(row).unwrap();
        let text = String::from_utf8(writer.into_inner().unwrap()).unwrap();
        text.lines().next().unwrap().to_owned()
    }

    #[test]
    fn headers_are_the_names_of_the_records_fields() {
        let sv = Sv::gps(3);
        let zero = |n: usize| vec!["0"; n].join(",");
        let observation: Observation = from_csv(&OBSERVATIONS, &format!("0,G03,{},{}", L1_CA.name, zero(7)));
        assert_eq!(header(&observation), OBSERVATIONS.join(","));
        let fix: Fix = from_csv(&FIXES, &format!("{},,broadcast,4,1,GPST", zero(26)));
        assert_eq!(header(&fix), FIXES.join(","));
        let row: AcquisitionRow = from_csv(&ACQUISITION, &format!("0,G03,{},true,{}", L1_CA.name, zero(5)));
        assert_eq!(header(&row), ACQUISITION.join(","));
        let row: TrackingRow = from_csv(&TRACKING, &format!("0,G03,{},{}", L1_CA.name, zero(13)));
        assert_eq!(header(&row), TRACKING.join(","));
        let row = NavigationRow { sample: 0, sv, issue: 1, parameter: "x".into(), raw: 0, message: "LNAV".into() };
        assert_eq!(header(&row), NAVIGATION.join(","));
        let row = EventRow { sample: 0, sv, signal: &L1_CA, event: Event::Acquired };
        assert_eq!(header(&row), EVENTS.join(","));
        let row: TagRow = from_csv(&TagRow::COLUMNS, "1251,0,E01,E02,0,1,authentic,");
        assert_eq!(header(&row), TagRow::COLUMNS.join(","));
        let row = IonosphereRow { sample: 0, sv, delay_m: 0.0, sigma_m: 0.0 };
        assert_eq!(header(&row), IONOSPHERE.join(","));
        let row: IntegrityRow = from_csv(&INTEGRITY, "0,0,0,raim,,,,,4,false,,true,");
        assert_eq!(header(&row), INTEGRITY.join(","));
        let row: DetectionRow = from_csv(&DETECTION, "0,cn0_fall,,,0.1,3.2,false");
        assert_eq!(header(&row), DETECTION.join(","));
        let row: LineRow = from_csv(&INTERFERENCE, &zero(8));
        assert_eq!(header(&row), INTERFERENCE.join(","));
    }

    fn from_csv<T: serde::de::DeserializeOwned>(names: &[&str], row: &str) -> T {
        let text = format!("{}\n{row}\n", names.join(","));
        csv::Reader::from_reader(text.as_bytes()).deserialize().next().unwrap().unwrap()
    }

    #[test]
    fn fixes_have_their_place_and_utc_behind_them() {
        let directory = tempfile::tempdir().unwrap();
        let mut output = Output::create(directory.path()).unwrap();
        let zeros = vec!["0"; 26].join(",");
        let fix: Fix = from_csv(&FIXES, &format!("{zeros},,broadcast,4,1,GPST"));
        // 2010-07-01T08:05:58 GPS time, 15 s ahead of UTC then; one kilometre above the north pole.
        let fix = Fix { gps_s: 962_006_758, z_m: 6_356_752.314_245 + 1000.0, ..fix };
        output.take(Record::Fix(fix)).unwrap();
        output.flush().unwrap();

        let mut file = csv::Reader::from_path(directory.path().join("fixes.csv")).unwrap();
        let row: BTreeMap<String, String> = file.deserialize().next().unwrap().unwrap();
        let number = |name: &str| row[name].parse::<f64>().unwrap();
        assert!((number("latitude_deg") - 90.0).abs() < 1e-9);
        assert!((number("height_m") - 1000.0).abs() < 1e-5);
        assert_eq!(row["utc"], "2010-07-01T08:05:43.000000Z");
    }

    #[test]
    fn what_cannot_be_made_is_an_error_with_its_path() {
        let place = tempfile::tempdir().unwrap();
        let file = place.path().join("taken");
        fs::write(&file, "x").unwrap();
        let error = Output::create(&file.join("rx")).err().unwrap().to_string();
        assert!(error.contains("taken"), "{error}");
    }
}
