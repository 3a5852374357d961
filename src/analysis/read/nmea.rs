//! NMEA 0183 position files: GGA for the position, RMC and ZDA for the date, RMC and VTG for the velocity.
//!
//! Sentences are read by [`gnss::nmea::read`]. Those of one time of day are one epoch, and an epoch has one
//! fix: that of the talker GN, or of the first one. A date holds until the next; where a file has none, the
//! day is the one that brings the fixes nearest to a time that the caller knows. A time of day that falls by
//! more than half a day begins the next day. UTC becomes GPS time by the leap seconds of that date, which is
//! the right way even for a receiver that mistook its week: it used those too. RMC's status V makes an epoch
//! one without a fix. A wrong checksum refuses the file; a last line that was cut off is left out. Limits:
//! VTG has no time, and belongs to the epoch before it unless the file begins with one and does not end with
//! one; GLL and GNS are not read.

use nalgebra::Vector3;

use crate::read::fault::Fault;
use gnss::nmea::read::{Rmc, Sentence, SentenceError, sentences, time_of_day_s};
use gnss::time::Epoch;

/// One position.
#[derive(Clone, Debug, PartialEq)]
pub struct PlaceFix {
    /// Time label of the receiver, in GPS time.
    pub label: Epoch,
    /// Position, Earth-fixed, metres.
    pub position_m: Vector3<f64>,
    /// Satellites used.
    pub satellites: u32,
    /// Speed over ground, m/s, and course from north over east, radians: RMC's of the same time, or VTG's.
    pub ground_mps_rad: Option<(f64, f64)>,
}

/// A file.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Places {
    /// Fixes in the order of the file.
    pub fixes: Vec<PlaceFix>,
    /// Sentences that say that there is no fix, and fixes that RMC's status V takes back.
    pub without_fix: usize,
    /// True if the date came from RMC or ZDA sentences.
    pub dated: bool,
    /// Fixes whose sentence has no geoid separation. Their altitude was taken as one above mean sea level,
    /// and EGM96's separation added.
    pub separations_assumed: usize,
    /// Fixes of further talkers at a time that has one already.
    pub repeated: usize,
    /// Smallest step of a latitude as written.
    pub resolution_m: f64,
}

const KINDS: [&str; 4] = ["GGA", "RMC", "VTG", "ZDA"];
const DAY_S: f64 = 86_400.0;
/// Sentences of one epoch may stand among those of so many later ones.
const OPEN_EPOCHS: usize = 4;

/// The sentences of one time of day.
#[derive(Default)]
struct Instant {
    /// Time of day as written.
    time: String,
    /// Time of day in seconds.
    of_day_s: f64,
    /// Midnights since the file's first time.
    midnights: i64,
    /// Day number of the date, where a sentence names it.
    day: Option<i64>,
    fix: Option<Candidate>,
    talkers: Vec<String>,
    /// True if an RMC sentence says that the fix is valid.
    valid: Option<bool>,
    ground: Option<(f64, f64)>,
}

struct Candidate {
    line: u64,
    position_m: Vector3<f64>,
    satellites: u32,
    separation_assumed: bool,
}

/// Reads a file; `near` is when it was recorded, to half a day, for a file that names no date.
///
/// # Errors
/// The first sentence that is damaged, and a file without a fix.
pub fn read(bytes: &[u8], near: Epoch) -> Result<Places, Fault> {
    let mut file = File::default();
    let mut lines = (1_u64..).zip(bytes.split(|byte| *byte == b'\n')).peekable();
    while let Some((line, bytes)) = lines.next() {
        let is_last = lines.peek().is_none();
        for text in sentences(bytes) {
            match file.take(line, text) {
                Err(Refusal::Sentence(error)) if is_last && cut_off(&error) => {}
                Err(refusal) => return Err(Fault { line, what: refusal.to_string() }),
                Ok(()) => {}
            }
        }
        if !bytes.is_empty() {
            file.last_line = line;
        }
    }
    file.finish(near)
}

#[derive(thiserror::Error, Debug)]
enum Refusal {
    #[error(transparent)]
    Sentence(#[from] SentenceError),
    #[error(transparent)]
    Date(#[from] gnss::time::TimeError),
    #[error("time {0} does not come after the one before")]
    Again(String),
}

/// True if the end of a sentence is missing.
fn cut_off(error: &SentenceError) -> bool {
    match error {
        SentenceError::Short { checked, .. } => !checked,
        SentenceError::Checksum { found, .. } => found.len() < 2,
        _ => false,
    }
}

/// A file as far as it was read.
#[derive(Default)]
struct File {
    last_line: u64,
    instants: Vec<Instant>,
    /// Velocities of VTG, each with the number of epochs before it.
    over_ground: Vec<(usize, (f64, f64))>,
    /// The first kind of sentence, and the last one.
    kinds: Option<[String; 2]>,
    without_fix: usize,
    repeated: usize,
    decimals: Option<u32>,
}

impl File {
    fn take(&mut self, line: u64, text: &[u8]) -> Result<(), Refusal> {
        let Some(sentence) = Sentence::of(&KINDS, text)? else { return Ok(()) };
        match sentence.kind {
            "GGA" => self.gga(line, &sentence)?,
            "RMC" => {
                let Some(found) = sentence.rmc()? else { return Ok(()) };
                let day = found.date.map(day_number).transpose()?;
                let own = self.instant(found.time);
                own.day = own.day.or(day);
                own.valid = Some(found.valid || own.valid == Some(true));
                let Rmc { speed_mps, course_rad, valid, .. } = found;
                own.ground = own.ground.or(speed_mps.zip(course_rad).filter(|_| valid));
            }
            "ZDA" => {
                let Some((time, date)) = sentence.zda()? else { return Ok(()) };
                let day = day_number(date)?;
                self.instant(time).day.get_or_insert(day);
            }
            _ => {
                let before = self.instants.len();
                self.over_ground.extend(sentence.vtg()?.map(|ground| (before, ground)));
            }
        }
        let kind = sentence.kind.to_owned();
        let first = self.kinds.take().map_or_else(|| kind.clone(), |[first, _]| first);
        self.kinds = Some([first, kind]);
        Ok(())
    }

    fn gga(&mut self, line: u64, sentence: &Sentence<'_>) -> Result<(), Refusal> {
        let Some(found) = sentence.gga()? else {
            self.without_fix += 1;
            return Ok(());
        };
        self.decimals = self.decimals.max(Some(found.decimals));
        let combined = sentence.talker == "GN";
        let candidate = Candidate {
            line,
            position_m: found.position_m(),
            satellites: found.satellites,
            separation_assumed: found.separation_m.is_none(),
        };
        let own = self.instant(found.time);
        if own.talkers.iter().any(|talker| talker == sentence.talker) {
            return Err(Refusal::Again(found.time.to_owned()));
        }
        own.talkers.push(sentence.talker.to_owned());
        let again = own.fix.is_some();
        if !again || combined {
            own.fix = Some(candidate);
        }
        self.repeated += usize::from(again);
        Ok(())
    }

    /// The epoch of a time of day, a new one where none of the newest has it.
    fn instant(&mut self, time: &str) -> &mut Instant {
        let of_day_s = time_of_day_s(time).unwrap_or(0.0);
        let oldest = self.instants.len().saturating_sub(OPEN_EPOCHS);
        let same = |instant: &Instant| instant.of_day_s.total_cmp(&of_day_s).is_eq();
        let known = self.instants.iter().skip(oldest).rposition(same).map(|at| oldest + at);
        let at = known.unwrap_or_else(|| {
            let (before, before_s) = self.instants.last().map_or((0, of_day_s), |one| (one.midnights, one.of_day_s));
            // The nearest day; a step back over midnight is a late sentence of an epoch before.
            let midnights = before - ((of_day_s - before_s) / DAY_S).round() as i64;
            self.instants.push(Instant { time: time.to_owned(), of_day_s, midnights, ..Instant::default() });
            self.instants.len() - 1
        });
        &mut self.instants[at]
    }

    /// Gives every fix its date and, where RMC had none, VTG's velocity.
    fn finish(mut self, near: Epoch) -> Result<Places, Fault> {
        let leads = matches!(&self.kinds, Some([first, last]) if first == "VTG" && last != "VTG");
        for (before, ground) in std::mem::take(&mut self.over_ground) {
            let at = if leads { Some(before) } else { before.checked_sub(1) };
            if let Some(own) = at.and_then(|at| self.instants.get_mut(at)) {
                own.ground.get_or_insert(ground);
            }
        }
        let is_fix = |own: &Instant| own.fix.is_some() && own.valid != Some(false);
        let mut found = Places { without_fix: self.without_fix, repeated: self.repeated, ..Places::default() };
        found.without_fix += self.instants.iter().filter(|own| own.fix.is_some() && !is_fix(own)).count();
        found.dated = self.instants.iter().any(|own| own.day.is_some());
        // A minute of latitude is a nautical mile.
        let decimals = self.decimals.unwrap_or(0) as i32;
        found.resolution_m = 1852.0 * libm::pow(10.0, -f64::from(decimals));
        let mut first_day = self.first_day(near);
        let mut date = (i64::MIN, String::new());
        for own in self.instants.iter() {
            if let Some(day) = own.day {
                first_day = day - own.midnights;
            }
            let Some(fix) = own.fix.as_ref().filter(|_| is_fix(own)) else { continue };
            let refuse = |what: String| Fault { line: fix.line, what };
            let day = first_day + own.midnights;
            if date.0 != day {
                date = (day, date_text(day));
            }
            let [hours, minutes, seconds] =
                [own.time.get(..2), own.time.get(2..4), own.time.get(4..)].map(Option::unwrap_or_default);
            let label = Epoch::parse(&format!("{}T{hours}:{minutes}:{seconds}Z", date.1))
                .map_err(|error| refuse(error.to_string()))?;
            if found.fixes.last().is_some_and(|before| label.since(before.label) <= 0.0) {
                return Err(refuse(Refusal::Again(own.time.clone()).to_string()));
            }
            found.separations_assumed += usize::from(fix.separation_assumed);
            found.fixes.push(PlaceFix {
                label,
                position_m: fix.position_m,
                satellites: fix.satellites,
                ground_mps_rad: own.ground,
            });
        }
        if found.fixes.is_empty() {
            let what = format!(
                "no GGA sentence with a fix ({} without one): expected GGA, which alone has the height",
                found.without_fix
            );
            return Err(Fault { line: self.last_line.max(1), what });
        }
        Ok(found)
    }

    /// The day number of the file's first time: by the first date that it names, or by the known time.
    fn first_day(&self, near: Epoch) -> i64 {
        if let Some(day) = self.instants.iter().find_map(|own| Some(own.day? - own.midnights)) {
            return day;
        }
        let since_s = |own: &Instant| own.midnights as f64 * DAY_S + own.of_day_s;
        let mut all = self.instants.iter().filter(|own| own.fix.is_some()).map(since_s);
        let first_s = all.next().unwrap_or(0.0);
        let middle_s = 0.5 * (first_s + all.next_back().unwrap_or(first_s));
        ((utc_s(near) as f64 - middle_s) / DAY_S).round() as i64
    }
}

/// Seconds of UTC since 1980-01-06, inserted ones not counted.
fn utc_s(at: Epoch) -> i64 {
    at.seconds() - at.leap_seconds()
}

/// Days since 1980-01-06 of year, month and day.
fn day_number([year, month, day]: [u32; 3]) -> Result<i64, gnss::time::TimeError> {
    Ok(utc_s(Epoch::parse(&format!("{year:04}-{month:02}-{day:02}T00:00:00Z"))?).div_euclid(86_400))
}

/// `YYYY-MM-DD` of a day number.
fn date_text(day: i64) -> String {
    // Leap seconds move noon by less than half a day.
    let noon = Epoch::new(day.saturating_mul(86_400).saturating_add(43_200), 0.0);
    noon.to_utc_text().get(..10).unwrap_or_default().to_owned()
}

#[cfg(test)]
#[path = "nmea_tests.rs"]
mod tests;
