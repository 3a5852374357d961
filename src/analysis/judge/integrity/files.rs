//! Files of a run for people and other programs, against the tables that are judged: geographic columns of
//! `fixes.csv`, `observations.rnx`, `fixes.nmea`.
//!
//! The files go through the readers for other receivers' results, one epoch at a time, so that memory stays
//! flat. A difference is judged by its effect on a user: a position by the fix's own sigma, a measurement by
//! its noise. Limits: the formats round less than that. A carrier's constant is free, so that carriers are
//! compared by their change from epoch to epoch. Tracks for maps and `navigation.rnx` are not read.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{BufRead, BufReader, ErrorKind};
use std::path::Path;

use serde::Deserialize;

use super::{Finding, Found};
use crate::error::JudgeError;
use crate::read::nmea::{self, PlaceFix};
use crate::read::rinex_obs::{ObservedEpoch, Reader};
use crate::read::{Fault, Run, each};
use crate::statistics::larger;
use gnss::earth::{Geodetic, SPEED_OF_LIGHT_MPS};
use gnss::nmea::KNOT_MPS;
use gnss::record::{Fix, Observation};
use gnss::satellite::{Sv, System};
use gnss::signal::Link;
use gnss::time::Epoch;

/// A time as written: NMEA rounds to a millisecond.
const TIME_S: f64 = 2e-3;
/// Code noise of a weak satellite; a millisecond of time is 300 km.
const CODE_M: f64 = 1.0;
/// A tenth of the half cycle that a slip is at the least.
const CARRIER_CYCLES: f64 = 0.05;
const DOPPLER_HZ: f64 = 1.0;
/// Half a step of the digit for strength, dB (RINEX 3.05, table 9).
const CN0_DB: f64 = 3.0;
/// A tenth of a knot: from there on a program that shows tenths always shows another speed.
const SPEED_MPS: f64 = 0.1 * KNOT_MPS;
/// Share of a table's rows that a file may lack, or have elsewhere: a row that somebody mended misleads
/// nobody.
const ODD_PERCENT: f64 = 1.0;
/// Values that RINEX cannot hold are blank, and a zero says that there is none.
const RINEX_VALUES: std::ops::RangeInclusive<f64> = 1e-3..=999_999_999.0;

pub(super) fn findings(run: &Run) -> Result<Vec<Finding>, JudgeError> {
    let Some(rx) = &run.rx else { return Ok(Vec::new()) };
    let mut all = geographic(&rx.join("fixes.csv"))?;
    if let Some(file) = opened(&rx.join("observations.rnx"))? {
        all.extend(observations(run, file)?);
    }
    if let Some(file) = opened(&rx.join("fixes.nmea"))? {
        all.extend(sentences(run, file, &rx.join("fixes.nmea"))?);
    }
    Ok(all)
}

fn opened(path: &Path) -> Result<Option<BufReader<File>>, JudgeError> {
    match File::open(path) {
        Ok(file) => Ok(Some(BufReader::with_capacity(1 << 16, file))),
        Err(error) if error.kind() == ErrorKind::NotFound => Ok(None),
        Err(source) => Err(JudgeError::Read { path: path.to_owned(), source }),
    }
}

/// A row of `fixes.csv` with the columns that say its position and time once more.
#[derive(Deserialize)]
struct Placed {
    gps_s: i64,
    gps_fraction_s: f64,
    x_m: f64,
    y_m: f64,
    z_m: f64,
    sigma_east_m: f64,
    sigma_north_m: f64,
    sigma_up_m: f64,
    #[serde(default)]
    latitude_deg: Option<f64>,
    #[serde(default)]
    longitude_deg: Option<f64>,
    #[serde(default)]
    height_m: Option<f64>,
    #[serde(default)]
    utc: Option<String>,
}

impl Placed {
    /// Distance between both positions, in sigmas of the fix.
    fn departure(&self) -> Option<f64> {
        let place = Geodetic::from_degrees(self.latitude_deg?, self.longitude_deg?, self.height_m?);
        let apart_m = (place.to_ecef() - nalgebra::Vector3::new(self.x_m, self.y_m, self.z_m)).norm();
        Some(apart_m / nalgebra::Vector3::new(self.sigma_east_m, self.sigma_north_m, self.sigma_up_m).norm())
    }

    /// Difference of both times, seconds; a text that is no time is endlessly far.
    fn late_s(&self) -> Option<f64> {
        let (own, text) = (Epoch::new(self.gps_s, self.gps_fraction_s), self.utc.as_ref()?);
        if *text == own.to_utc_text() {
            return Some(0.0);
        }
        Some(Epoch::parse(text).map_or(f64::INFINITY, |utc| utc.since(own).abs()))
    }
}

fn geographic(path: &Path) -> Result<Vec<Finding>, JudgeError> {
    let (mut placed, mut elsewhere, mut late_s) = (0_usize, 0_usize, None);
    each(path, "", |_, row: Placed| {
        if let Some(departure) = row.departure() {
            placed += 1;
            elsewhere += usize::from(departure > 1.0);
        }
        late_s = row.late_s().map_or(late_s, |new| larger(late_s, new));
        Ok(())
    })?;
    let mut found = Vec::new();
    if placed > 0 {
        let figure = "fixes whose latitude, longitude and height are another position than x, y and z";
        let source = "the same position twice, within the fix's own sigma";
        found.push(Finding::most(figure, percent(elsewhere, placed), "%", ODD_PERCENT, source));
    }
    if let Some(late_s) = late_s {
        let source = "the same time twice, with the leap seconds of its day";
        found.push(Finding::most("UTC of fixes against GPS time, largest difference", late_s, "s", TIME_S, source));
    }
    Ok(found)
}

fn percent(part: usize, whole: usize) -> f64 {
    100.0 * part as f64 / whole.max(1) as f64
}

/// Differences between a file and a table.
#[derive(Default)]
struct Compared {
    code_m: f64,
    carrier_cycles: f64,
    doppler_hz: f64,
    cn0_db: f64,
    /// Number of the table's rows.
    rows: usize,
    /// Rows that the file lacks.
    lacking: Found,
    /// Losses of lock that are flagged wrongly, channels that are not the truth's, lines that are none.
    flags: Found,
    channels: Found,
    damaged: Found,
}

/// A file beside the table that it was written from.
struct Beside {
    reader: Reader<BufReader<File>>,
    epoch: Option<ObservedEpoch>,
    /// Reading before of each signal, with the carrier in the table and in the file, cycles.
    before: BTreeMap<(Sv, &'static str), (Epoch, f64, Option<f64>)>,
    compared: Compared,
}

impl Beside {
    fn advance(&mut self) {
        self.epoch = self.reader.next_epoch().unwrap_or_else(|fault| {
            self.compared.damaged.add(|| in_words("observations.rnx", &fault));
            None
        });
    }

    /// Compares the rows of an epoch with those of the file that bear its time.
    fn compare(&mut self, rows: &[Observation]) {
        let Some(first) = rows.first() else { return };
        let reading = first.sent().plus_s(first.pseudorange_m / SPEED_OF_LIGHT_MPS);
        while self.epoch.as_ref().is_some_and(|epoch| reading.since(epoch.label) > TIME_S) {
            self.advance();
        }
        let epoch = self.epoch.as_ref().filter(|epoch| epoch.label.since(reading).abs() <= TIME_S);
        let compared = &mut self.compared;
        let mut seen: Vec<(Sv, &str)> = Vec::new();
        for row in rows {
            let key = (row.sv, row.signal.rinex);
            // A band and attribute that two signals share has one column.
            if seen.contains(&key) {
                continue;
            }
            seen.push(key);
            compared.rows += 1;
            let found = epoch.and_then(|epoch| epoch.values.get(&(row.sv, row.signal.rinex.to_owned())));
            let Some(values) = found else {
                compared.lacking.add(|| format!("{} {} at sample {}", row.sv, row.signal.name, row.sample));
                continue;
            };
            let apart = |value: Option<f64>, own: f64| match value {
                Some(value) => (value - own).abs(),
                None if RINEX_VALUES.contains(&own.abs()) => f64::INFINITY,
                None => 0.0,
            };
            compared.code_m = compared.code_m.max(apart(values.pseudorange_m, row.pseudorange_m));
            compared.doppler_hz = compared.doppler_hz.max(apart(values.doppler_hz, row.doppler_hz));
            compared.cn0_db = compared.cn0_db.max(apart(values.cn0_dbhz, row.cn0_dbhz));
            let cycles = (reading, row.carrier_cycles, values.carrier_cycles);
            if let Some((then, old, filed)) = self.before.insert(key, cycles) {
                if let Some((new_filed, filed)) = values.carrier_cycles.zip(filed) {
                    let grown = row.carrier_cycles - old;
                    compared.carrier_cycles = compared.carrier_cycles.max((new_filed - filed - grown).abs());
                }
                let younger_s = reading.since(then) - row.locked_s;
                // Of the same age it may be either.
                if younger_s.abs() > TIME_S && values.lost_lock != (younger_s > 0.0) {
                    compared.flags.add(|| format!("{} {} at sample {}", row.sv, row.signal.name, row.sample));
                }
            }
        }
    }
}

fn in_words(file: &str, fault: &Fault) -> String {
    format!("{file}, line {}: {}", fault.line, fault.what)
}

/// Shows `see` the observations of all signals, epoch by epoch.
fn epochs(run: &Run, mut see: impl FnMut(&[Observation])) -> Result<(), JudgeError> {
    let mut signals: Vec<_> = run.observations.keys().map(|link| run.observations.cursor(link).peekable()).collect();
    let mut rows = Vec::new();
    loop {
        // A row that cannot be read comes first, and ends it.
        let sample = |row: &Result<Observation, JudgeError>| row.as_ref().map_or(0, |row| row.sample);
        let Some(next) = signals.iter_mut().filter_map(|rows| rows.peek().map(sample)).min() else { return Ok(()) };
        for signal in &mut signals {
            while let Some(row) = signal.next_if(|row| sample(row) <= next) {
                rows.push(row?);
            }
        }
        see(&rows);
        rows.clear();
    }
}

fn observations(run: &Run, file: BufReader<File>) -> Result<Vec<Finding>, JudgeError> {
    let mut compared = Compared::default();
    match Reader::new(file) {
        Ok(reader) => {
            let links = run.observations.keys().filter(|link| link.sv.system == System::Glonass);
            let truth: Vec<Link> = run.truth.keys().collect();
            compared.channels = channels(links, &truth, &reader.header.channels);
            let mut beside = Beside { reader, epoch: None, before: BTreeMap::new(), compared };
            if !run.observations.is_empty() {
                beside.advance();
            }
            epochs(run, |rows| beside.compare(rows))?;
            compared = beside.compared;
        }
        Err(fault) => compared.damaged.add(|| in_words("observations.rnx", &fault)),
    }
    let lacking = percent(compared.lacking.count, compared.rows);
    let source = compared.lacking.first.map_or("each row of the table".to_owned(), |first| format!("without: {first}"));
    let same = "the same value, rounded to a thousandth";
    Ok(vec![
        Finding::none("lines of observations.rnx that cannot be read", compared.damaged, "RINEX 3.05"),
        Finding::most("observations that observations.rnx lacks", lacking, "%", ODD_PERCENT, &source),
        Finding::most("pseudoranges of observations.rnx, largest difference", compared.code_m, "m", CODE_M, same),
        Finding::most(
            "carriers of observations.rnx, largest difference of an interval",
            compared.carrier_cycles,
            "cycles",
            CARRIER_CYCLES,
            same,
        ),
        Finding::most("Dopplers of observations.rnx, largest difference", compared.doppler_hz, "Hz", DOPPLER_HZ, same),
        Finding::most("C/N0 of observations.rnx, largest difference", compared.cn0_db, "dB", CN0_DB, same),
        Finding::none(
            "losses of lock flagged wrongly in observations.rnx",
            compared.flags,
            "a lock younger than the interval is a new one",
        ),
        Finding::none("channels of GLONASS wrong in observations.rnx", compared.channels, "those of the truth"),
    ])
}

/// Channels of observed satellites that the header has otherwise than the truth, or not at all.
fn channels(observed: impl Iterator<Item = Link>, truth: &[Link], header: &BTreeMap<Sv, i8>) -> Found {
    let mut found = Found::default();
    for link in observed {
        let known = truth.iter().find(|own| own.sv == link.sv).and_then(|own| own.channel());
        if known.is_some() && header.get(&link.sv) != known.as_ref() {
            found.add(|| format!("{}: {:?} where the truth has {known:?}", link.sv, header.get(&link.sv)));
        }
    }
    found
}

/// Differences between sentences and fixes.
struct Sentences<'r> {
    fixes: Box<dyn Iterator<Item = Result<Fix, JudgeError>> + 'r>,
    fix: Option<Fix>,
    fixes_found: usize,
    elsewhere: usize,
    speed_mps: f64,
    damaged: Found,
}

impl Sentences<'_> {
    fn advance(&mut self) -> Result<(), JudgeError> {
        self.fix = self.fixes.next().transpose()?;
        Ok(())
    }

    /// Takes the lines of an epoch that end before a line of that number.
    fn take(&mut self, text: &[u8], end: u64) -> Result<(), JudgeError> {
        if text.is_empty() {
            return Ok(());
        }
        let begin = end - text.split_inclusive(|byte| *byte == b'\n').count() as u64;
        let near = self.fix.as_ref().map_or(Epoch::new(0, 0.0), Fix::time);
        match nmea::read(text, near) {
            Ok(places) => places.fixes.iter().try_for_each(|place| self.compare(place)),
            Err(fault) => {
                self.damaged.add(|| in_words("fixes.nmea", &Fault { line: begin + fault.line, ..fault }));
                Ok(())
            }
        }
    }

    fn compare(&mut self, place: &PlaceFix) -> Result<(), JudgeError> {
        while self.fix.as_ref().is_some_and(|fix| place.label.since(fix.time()) > TIME_S) {
            self.advance()?;
        }
        let Some(fix) = self.fix.as_ref().filter(|fix| fix.time().since(place.label).abs() <= TIME_S) else {
            return Ok(());
        };
        self.fixes_found += 1;
        let sigma_m = nalgebra::Vector3::new(fix.sigma_east_m, fix.sigma_north_m, fix.sigma_up_m).norm();
        self.elsewhere += usize::from((place.position_m - fix.position_m()).norm() > sigma_m);
        if let Some((ground_mps, course_rad)) = place.ground_mps_rad {
            let enu = Geodetic::from_ecef(&fix.position_m()).ecef_to_enu() * fix.velocity_mps();
            let (east, north) = libm::sincos(course_rad);
            let apart_mps = libm::hypot(ground_mps * east - enu.x, ground_mps * north - enu.y);
            // A hundredth of a degree is what a course is written to.
            self.speed_mps = self.speed_mps.max(apart_mps - ground_mps * 0.01_f64.to_radians());
        }
        self.advance()
    }
}

fn sentences(run: &Run, mut file: BufReader<File>, path: &Path) -> Result<Vec<Finding>, JudgeError> {
    let mut all = Sentences {
        fixes: Box::new(run.fixes.cursor()),
        fix: None,
        fixes_found: 0,
        elsewhere: 0,
        speed_mps: 0.0,
        damaged: Found::default(),
    };
    all.advance()?;
    let (mut own, mut line, mut number) = (Vec::new(), Vec::new(), 0);
    loop {
        line.clear();
        let read = file.read_until(b'\n', &mut line);
        if read.map_err(|source| JudgeError::Read { path: path.to_owned(), source })? == 0 {
            break;
        }
        // The sentences of an epoch begin with its position.
        if line.get(3..6) == Some(b"GGA") {
            all.take(&own, number)?;
            own.clear();
        }
        own.append(&mut line);
        number += 1;
    }
    all.take(&own, number)?;
    let lacking = percent(run.fixes.len().saturating_sub(all.fixes_found), run.fixes.len());
    Ok(vec![
        Finding::none("sentences of fixes.nmea that cannot be read", all.damaged, "NMEA 0183"),
        Finding::most("fixes that fixes.nmea lacks", lacking, "%", ODD_PERCENT, "each fix, at its own time"),
        Finding::most(
            "fixes that have another position in fixes.nmea",
            percent(all.elsewhere, all.fixes_found),
            "%",
            ODD_PERCENT,
            "the same position, within the fix's own sigma",
        ),
        Finding::most(
            "velocity over ground of fixes.nmea, largest difference",
            all.speed_mps,
            "m/s",
            SPEED_MPS,
            "the same velocity",
        ),
    ])
}

#[cfg(test)]
mod tests {
    use super::*;
    use gnss::signal::Signal;

    #[test]
    fn a_channel_that_is_not_the_truth_s_or_not_there_is_found() {
        let signal = Signal::find("GLONASS G1").unwrap();
        let links: Vec<Link> = signal.satellites().take(3).map(|sv| signal.link(sv)).collect();
        // RINEX 3.05, table A2: the header's line with the channels of Kosmos satellites R01 to R03 of 2020.
        let line = |channels: [i8; 3]| {
            let own = format!("  3 R01 {:2} R02 {:2} R03 {:2} ", channels[0], channels[1], channels[2]);
            let mut text = format!("{:60}RINEX VERSION / TYPE\n", "     3.05           OBSERVATION DATA    R");
            text += &format!("{own:60}GLONASS SLOT / FRQ #\n{:60}SYS / # / OBS TYPES\n", "R    1 C1C");
            text += &format!("{:60}END OF HEADER\n", "");
            Reader::new(text.as_bytes()).unwrap().header.channels
        };
        let count = |header: &BTreeMap<Sv, i8>| channels(links.iter().copied(), &links, header).count;
        assert_eq!(count(&line([1, -4, 5])), 0);
        assert_eq!(count(&line([1, 4, 5])), 1);
        assert_eq!(count(&BTreeMap::new()), 3);
    }
}
