//! The truth's files: tables that grow with the scene, and `scene.json`.

use std::fs::{self, File};
use std::io::{self, BufWriter};
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use serde::Serialize;

use super::inertial::{SensorRow, Sensors};
use super::record::{Record, Sink, TruthError};
use super::skyline::skyline_deg;
use crate::scene::{CodeEdge, Scene, sources};
use crate::switches::{Stray, Switches};
use gnss::facts::{Fault, FaultKind, FrontEndFacts, OscillatorFacts, Renewal, SceneFacts, TimeOffset};
use gnss::record::{Geographic, TrajectoryRow};
use gnss::signal::described::texts_of;
use gnss::time::Rate;

pub(super) struct Table {
    path: PathBuf,
    rows: csv::Writer<BufWriter<File>>,
    is_empty: bool,
}

impl Table {
    /// The header is that of the first row.
    pub(super) fn create(directory: &Path, name: &str) -> Result<Self, TruthError> {
        Self::open(directory, name, true)
    }

    /// Creates a table of positions, whose rows have geographic columns after their own.
    fn of_places(directory: &Path, name: &str) -> Result<Self, TruthError> {
        Self::open(directory, name, false)
    }

    fn open(directory: &Path, name: &str, has_headers: bool) -> Result<Self, TruthError> {
        let path = directory.join(name);
        let file = File::create(&path).map_err(|source| TruthError::File { path: path.clone(), source })?;
        let rows = csv::WriterBuilder::new().has_headers(has_headers).from_writer(BufWriter::new(file));
        Ok(Self { path, rows, is_empty: true })
    }

    fn write_place(&mut self, row: TrajectoryRow) -> Result<(), TruthError> {
        let place = Geographic::of(&row.position_m(), row.time());
        if std::mem::replace(&mut self.is_empty, false) {
            let header = header_of(&row).and_then(|mut header| {
                header.extend(&Geographic::COLUMNS[..]);
                self.rows.write_record(&header)
            });
            header.map_err(|source| TruthError::Row { path: self.path.clone(), source })?;
        }
        self.write((row, place))
    }

    pub(super) fn write(&mut self, row: impl Serialize) -> Result<(), TruthError> {
        self.rows.serialize(row).map_err(|source| TruthError::Row { path: self.path.clone(), source })
    }

    pub(super) fn flush(&mut self) -> Result<(), TruthError> {
        self.rows.flush().map_err(|source| TruthError::File { path: self.path.clone(), source })
    }
}

/// The names of a row's columns: `csv` writes none for rows of two parts.
fn header_of(row: &impl Serialize) -> Result<csv::StringRecord, csv::Error> {
    let mut alone = csv::Writer::from_writer(Vec::new());
    alone.serialize(row)?;
    let text = alone.into_inner().map_err(|error| csv::Error::from(error.into_error()))?;
    csv::Reader::from_reader(text.as_slice()).headers().cloned()
}

/// Tables of a spoofer's claims: observables like `observations.csv`, positions like `trajectory.csv`.
struct Claims {
    observations: Table,
    trajectory: Table,
}

/// Writes `observations.csv`, `sky.csv`, `trajectory.csv`, `navigation.csv`, `passes.csv` and `scene.json`;
/// `rays.csv` where a satellite has more than one ray, with interference `interference.csv`, with spoofers
/// `spoofed.csv` and `claimed.csv` (`spoofed_2.csv`, … from the second one on), with inertial sensors
/// `imu.csv` and `body.csv`, and with authenticated messages `osnma_test_merkle_tree.xml`,
/// `osnma_test_public_key.xml` and `osnma_test_kroot.hex`.
pub struct Writer {
    directory: PathBuf,
    observations: Table,
    sky: Table,
    rays: Option<Table>,
    trajectory: Table,
    interference: Option<Table>,
    claims: Vec<Claims>,
    inertial: Option<Inertial>,
    navigation: Option<Table>,
    passes: Option<Table>,
    /// Switches, rate and facts of a scene whose satellites may drift while it is sent. The facts are
    /// complete at the end.
    driven: Option<(Arc<Switches>, Rate, SceneFacts)>,
}

/// Steps of a range below this are none: the range error of a satellite is computed again.
const STEP_M: f64 = 1e-6;

/// Satellites with range errors, as faults and in words.
fn strays(switches: &Switches, rate: Rate, first: u64) -> (Vec<Fault>, Vec<String>) {
    let (mut faults, mut words) = (Vec::new(), Vec::new());
    for Stray { sv, first: from, m, mps, step_m } in switches.strays(rate) {
        let from_s = rate.elapsed_s(from.saturating_sub(first));
        let fault = |kind| Fault { kind, satellites: Some(vec![sv]), from_s, to_s: None };
        faults.extend((step_m.abs() > STEP_M).then(|| fault(FaultKind::ClockStep)));
        faults.extend((mps != 0.0).then(|| fault(FaultKind::ClockRamp)));
        words.push(format!("{sv}: ranges {m} m too long and {mps} m/s more from {from_s} s on"));
    }
    (faults, words)
}

/// The time scales of the scene's signals that are ahead of GPS time or behind it, whole seconds apart, each
/// once.
fn time_offsets(scene: &Scene) -> Vec<TimeOffset> {
    let mut found: Vec<TimeOffset> = Vec::new();
    for signal in &scene.signals {
        let ahead_s = scene.catalogue.time_offset_s(signal.system);
        if ahead_s != 0.0 && found.iter().all(|offset| offset.time_scale != signal.time.name) {
            found.push(TimeOffset { time_scale: signal.time.name.to_owned(), ahead_s });
        }
    }
    found
}

/// One of several front ends.
/// Longest time between the choice of an ephemeris and the end of the units that carry it, seconds.
const LONGEST_SET_S: f64 = 600.0;

/// Renewals of ephemerides while the part of the scene is received, and just before: units that were begun
/// with the ephemeris before end first.
fn renewals(scene: &Scene, part: &Range<u64>) -> Vec<Renewal> {
    let [from, to] = [part.start, part.end].map(|sample| scene.clock.epoch(sample));
    let all = scene.catalogue.renewals(from.plus_s(-LONGEST_SET_S), to).into_iter();
    all.map(|(sv, at)| Renewal { sv, at_s: at.since(from) }).collect()
}

fn front_end(scene: &Scene) -> FrontEndFacts {
    FrontEndFacts {
        name: scene.front_end_name.clone(),
        samples: scene.samples,
        sample_rate_hz: scene.clock.rate.hz(),
        center_hz: scene.metadata.center_hz,
        inverted: scene.metadata.inverted,
        format: scene.metadata.format.name().to_owned(),
        code_edge: scene.fidelity.code_edge.fact(),
        edge_cutoff_cps: edge_cutoff_cps(scene),
        signals: signals(std::slice::from_ref(scene)),
        noise_lsb: decimal(scene.noise_lsb),
        front_end: scene.front_end.iter().filter_map(|stage| stage.spec()).collect(),
    }
}

/// Cut-off of band-limited edges in cycles per sample, if the scene has them.
fn edge_cutoff_cps(scene: &Scene) -> Option<f64> {
    (scene.fidelity.code_edge == CodeEdge::BandLimited).then(|| scene.cutoff_cps())
}

/// Number in `f64` with the same shortest decimal text, as a reader of this text gets it.
fn decimal(value: f32) -> f64 {
    value.to_string().parse().unwrap_or(f64::from(value))
}

/// The names of all signals of the scenes, each once.
fn signals(scenes: &[Scene]) -> Vec<String> {
    let mut names: Vec<String> = Vec::new();
    for signal in scenes.iter().flat_map(|scene| &scene.signals) {
        if names.iter().all(|name| name != signal.name) {
            names.push(signal.name.to_owned());
        }
    }
    names
}

impl Writer {
    /// Creates the files in an existing directory. Creating it here would resurrect one that an interrupt
    /// handler has just removed.
    ///
    /// # Errors
    /// [`TruthError`] with the path that failed.
    pub fn create(directory: &Path) -> Result<Self, TruthError> {
        let rays = directory.join("rays.csv");
        if rays.exists() {
            fs::remove_file(&rays).map_err(|source| TruthError::File { path: rays, source })?;
        }
        Ok(Self {
            directory: directory.to_owned(),
            observations: Table::create(directory, "observations.csv")?,
            sky: Table::create(directory, "sky.csv")?,
            rays: None,
            trajectory: Table::of_places(directory, "trajectory.csv")?,
            interference: None,
            claims: Vec::new(),
            inertial: None,
            navigation: None,
            passes: None,
            driven: None,
        })
    }

    /// Writes `scene.json`, and creates the files that only this scene has.
    fn facts(&mut self, scene: &Scene, scenes: &[Scene], part: &Range<u64>) -> Result<(), TruthError> {
        let received = sources(scenes.iter());
        if !received.is_empty() {
            self.interference = Some(Table::create(&self.directory, "interference.csv")?);
        }
        for spoofer in &scene.spoofers {
            let suffix = if spoofer.number > 1 { format!("_{}", spoofer.number) } else { String::new() };
            self.claims.push(Claims {
                observations: Table::create(&self.directory, &format!("spoofed{suffix}.csv"))?,
                trajectory: Table::of_places(&self.directory, &format!("claimed{suffix}.csv"))?,
            });
        }
        if let Some(sensors) = Sensors::of(scene, part) {
            let tables = [Table::create(&self.directory, "imu.csv")?, Table::create(&self.directory, "body.csv")?];
            self.inertial = Some(Inertial { sensors, tables });
        }
        self.write_keys(scene, part)?;
        let (orbits, departures) = scene.catalogue.describe();
        let file = SceneFacts {
            name: scene.name.clone(),
            front_end_name: scene.front_end_name.clone(),
            seed: scene.seed,
            start: scene.clock.epoch(part.start).to_string(),
            first_sample: (part.start > 0).then_some(part.start),
            duration_s: scene.clock.rate.elapsed_s(part.end - part.start),
            samples: part.end - part.start,
            sample_rate_hz: scene.clock.rate.hz(),
            center_hz: Some(scene.metadata.center_hz),
            inverted: scene.metadata.inverted,
            format: scene.metadata.format.name().to_owned(),
            fidelity: scene.fidelity.grade.name().to_owned(),
            code_edge: scene.fidelity.code_edge.fact(),
            edge_cutoff_cps: edge_cutoff_cps(scene),
            waveform: scene.fidelity.waveform,
            carrier: scene.fidelity.carrier.name().to_owned(),
            knot_tolerance_cycles: scene.fidelity.knot_tolerance_cycles,
            mask_deg: Some(scene.mask_rad.to_degrees()),
            truth_interval_s: scene.truth_interval_s,
            signals: signals(scenes),
            described_signals: texts_of(scenes.iter().flat_map(|scene| scene.signals.iter().copied())),
            noise: scene.noise,
            noise_arithmetic: scene.fidelity.noise.name().to_owned(),
            noise_lsb: Some(decimal(scene.noise_lsb)),
            front_end: scene.front_end.iter().filter_map(|stage| stage.spec()).collect(),
            skyline_deg: skyline_deg(scene).unwrap_or_default(),
            oscillator: (scene.receiver_clock.oscillator.as_ref())
                .map(|oscillator| OscillatorFacts { h: oscillator.law.levels() }),
            front_ends: if scenes.len() > 1 { scenes.iter().map(front_end).collect() } else { Vec::new() },
            array: super::array::facts(scenes, &received),
            imu: scene.imu.as_ref().map(|imu| imu.facts.clone()),
            interference: received.iter().map(|(_, source)| source.fact()).collect(),
            spoofers: scene.spoofers.iter().map(|spoofer| spoofer.describe()).collect(),
            orbits,
            satellite_faults: [departures, scene.satellite_clocks.descriptions.clone()].concat(),
            message_faults: scene.message_faults.iter().map(|fault| fault.describe(scene.clock.start)).collect(),
            faults: scene.faults.clone(),
            expect: scene.expect.clone(),
            time_offsets: time_offsets(scene),
            renewals: renewals(scene, part),
            osnma: scene.osnma.as_ref().map(|osnma| osnma.facts.clone()),
        };
        self.write_facts(&file)?;
        self.driven = scene.switches.as_ref().map(|switches| (Arc::clone(switches), scene.clock.rate, file));
        Ok(())
    }

    /// Writes the test keys by which authenticated messages of the scene are verified.
    fn write_keys(&self, scene: &Scene, part: &Range<u64>) -> Result<(), TruthError> {
        let start = scene.clock.epoch(part.start);
        let Some(keys) = scene.osnma.as_ref().and_then(|osnma| osnma.anchor(start)) else { return Ok(()) };
        for (name, text) in [
            ("osnma_test_merkle_tree.xml", keys.tree_file()),
            ("osnma_test_public_key.xml", keys.key_file()),
            ("osnma_test_kroot.hex", keys.kroot_file()),
        ] {
            let path = self.directory.join(name);
            fs::write(&path, text).map_err(|source| TruthError::File { path, source })?;
        }
        Ok(())
    }

    fn write_facts(&self, facts: &SceneFacts) -> Result<(), TruthError> {
        let path = self.directory.join("scene.json");
        serde_json::to_string_pretty(facts)
            .map_err(io::Error::from)
            .and_then(|text| fs::write(&path, text + "\n"))
            .map_err(|source| TruthError::File { path, source })
    }

    /// The claims of a spoofer, which [`Writer::facts`] has counted.
    fn claims(&mut self, spoofer: usize) -> Option<&mut Claims> {
        spoofer.checked_sub(1).and_then(|index| self.claims.get_mut(index))
    }
}

/// Sensors and their tables, `imu.csv` and `body.csv`.
struct Inertial {
    sensors: Sensors,
    tables: [Table; 2],
}

fn written([imu, body]: &mut [Table; 2], row: SensorRow) -> Result<(), TruthError> {
    match row {
        SensorRow::Measured(row) => imu.write(row),
        SensorRow::Body(row) => body.write(row),
    }
}

impl Sink for Writer {
    fn begin(&mut self, scenes: &[Scene], part: &Range<u64>) -> Result<(), TruthError> {
        scenes.first().map_or(Ok(()), |first| self.facts(first, scenes, part))
    }

    fn take(&mut self, record: Record) -> Result<(), TruthError> {
        match record {
            Record::Trajectory(row) => {
                if let Some(Inertial { sensors, tables }) = &mut self.inertial {
                    sensors.until(row.time(), &mut |row| written(tables, row))?;
                }
                self.trajectory.write_place(row)
            }
            Record::Observation(row) => self.observations.write(row),
            Record::Sky(row) => self.sky.write(row),
            Record::Ray(row) => opened(&mut self.rays, &self.directory, "rays.csv")?.write(row),
            Record::Interference(row) => self.interference.as_mut().map_or(Ok(()), |table| table.write(row)),
            Record::Claim { spoofer, place } => {
                self.claims(spoofer).map_or(Ok(()), |claims| claims.trajectory.write_place(place))
            }
            Record::Spoofed { spoofer, observation } => {
                self.claims(spoofer).map_or(Ok(()), |claims| claims.observations.write(observation))
            }
            Record::Navigation(row) => opened(&mut self.navigation, &self.directory, "navigation.csv")?.write(row),
            Record::Pass(row) => opened(&mut self.passes, &self.directory, "passes.csv")?.write(row),
        }
    }

    /// Writes everything that is still buffered. `navigation.csv` and `passes.csv` exist from here on, even
    /// without a row.
    fn finish(&mut self) -> Result<(), TruthError> {
        if let Some((switches, rate, mut facts)) = self.driven.take() {
            let (faults, words) = strays(&switches, rate, facts.first_sample.unwrap_or(0));
            facts.faults.extend(faults);
            facts.satellite_faults.extend(words);
            self.write_facts(&facts)?;
        }
        opened(&mut self.navigation, &self.directory, "navigation.csv")?.flush()?;
        opened(&mut self.passes, &self.directory, "passes.csv")?.flush()?;
        if let Some(Inertial { sensors, tables }) = &mut self.inertial {
            sensors.finish(&mut |row| written(tables, row))?;
            tables.iter_mut().try_for_each(Table::flush)?;
        }
        self.observations.flush()?;
        self.sky.flush()?;
        self.rays.iter_mut().chain(&mut self.interference).try_for_each(Table::flush)?;
        for claims in &mut self.claims {
            claims.observations.flush()?;
            claims.trajectory.flush()?;
        }
        self.trajectory.flush()
    }
}

/// The table, created with its first row.
fn opened<'t>(table: &'t mut Option<Table>, directory: &Path, name: &str) -> Result<&'t mut Table, TruthError> {
    match table {
        Some(table) => Ok(table),
        none => Ok(none.insert(Table::create(directory, name)?)),
    }
}

#[cfg(test)]
mod tests {
    use std::collections::HashMap;

    use super::*;

    #[test]
    fn places_are_read_again_by_the_names_of_their_columns() {
        let directory = tempfile::tempdir().unwrap();
        let mut table = Table::of_places(directory.path(), "places.csv").unwrap();
        // 2010-07-01T08:05:58 GPS time, 15 s ahead of UTC then; on the equator at 90 degrees east.
        let row = |sample| TrajectoryRow {
            sample,
            gps_s: 962_006_758,
            gps_fraction_s: 0.5,
            x_m: 0.0,
            y_m: 6_378_137.0,
            z_m: 0.0,
            vx_mps: 1.0,
            vy_mps: 2.0,
            vz_mps: 3.0,
            clock_bias_s: 1e-4,
            clock_drift: 5e-8,
        };
        table.write_place(row(0)).unwrap();
        table.write_place(row(7)).unwrap();
        table.flush().unwrap();

        let mut file = csv::Reader::from_path(directory.path().join("places.csv")).unwrap();
        let rows: Vec<HashMap<String, String>> = file.deserialize().map(Result::unwrap).collect();
        let number = |row: &HashMap<String, String>, name: &str| row[name].parse::<f64>().unwrap();
        assert_eq!(rows.len(), 2);
        assert_eq!(rows[1].len(), 15);
        assert_eq!(rows[1]["sample"], "7");
        assert_eq!((number(&rows[0], "y_m"), number(&rows[0], "clock_drift")), (6_378_137.0, 5e-8));
        assert!((number(&rows[0], "longitude_deg") - 90.0).abs() < 1e-12);
        assert!(number(&rows[0], "latitude_deg").abs() < 1e-12 && number(&rows[0], "height_m").abs() < 1e-6);
        assert_eq!(rows[0]["utc"], "2010-07-01T08:05:43.500000Z");
    }
}
