//! Navigation messages as encoders and decoders use them: one [`Message`] for each form.
//!
//! A transmitter asks a [`Sender`] for the symbols of a unit (a subframe, a page) that begins at a time; a
//! receiver gives a [`Reader`] the symbols as they come and takes what they state. Each form is one
//! [`Message`] in the file that encodes and decodes it. All times here are those of the system that sends
//! ([`TimeScale::label`]); who calls brings them to GPS time.
//!
//! [`TimeScale::label`]: crate::time::TimeScale::label

use std::fmt;
use std::sync::Arc;

use crate::augmentation::{Content, Network};
use crate::bdgim::Bdgim;
use crate::bits::{Field, FieldError};
use crate::broadcast::{Ephemeris, SetForm};
use crate::gps::lnav::UtcData;
use crate::ionosphere::{Coefficients, Model};
use crate::klobuchar::Klobuchar;
use crate::record::NavigationRow;
use crate::satellite::Sv;
use crate::time::{Epoch, TimePolynomial, TimeScale, WEEK_S};

/// A form of message.
pub struct Message {
    /// Name as its document has it.
    pub name: &'static str,
    /// Duration of a symbol, in seconds: whole periods of the code that it modulates.
    pub symbol_s: f64,
    /// Signs of the symbols that form one bit of a satellite, in order. It has one sign if symbols belong to
    /// no known code.
    pub bit: fn(Sv) -> &'static [i8],
    /// Duration of a unit, which is encoded as a whole, in seconds.
    pub unit_s: i64,
    /// Number of symbols after a unit by which its last bits are decided: zero, except where a convolutional
    /// code runs on into the next unit.
    pub decided_after: usize,
    /// Interval in seconds, from one multiple of it to the next, in which all units belong to one ephemeris.
    /// Messages whose units each identify their ephemeris have the interval of one unit.
    pub set_s: i64,
    /// Seconds from the beginning of the week to the start of its first unit.
    pub first_s: i64,
    /// Function that creates the encoder for the satellites of a scene.
    pub sender: fn(&Common) -> Result<Box<dyn Sender>, FieldError>,
    /// Function that returns the number by which faults name the unit that begins at a time: a subframe's
    /// number, or a word's type.
    pub number: fn(Epoch) -> u8,
    /// Numbers of the units that state their time; empty if another signal of the satellite has to supply it.
    pub timed: &'static [u8],
    /// Numbers of the units that must all be received before the time is complete; empty if each unit states
    /// it completely.
    pub dated: &'static [u8],
    /// Numbers of the units that make up an ephemeris.
    pub set: &'static [u8],
    /// Numbers of the units each of which carries reduced elements.
    pub reduced: &'static [u8],
    /// Ionosphere model and the units that carry its coefficients.
    pub ionosphere: IonosphereForm,
    /// Fields of the ephemerides.
    pub fields: &'static dyn SetFields,
    /// Function that reads a unit's parameters from its symbols, with true if they belong to an ephemeris.
    /// `None` if the unit fails its checks or has no parameters.
    pub parameters: fn(&[bool]) -> Option<(bool, Parameters)>,
    /// Function that creates a decoder for a satellite.
    pub reader: fn(Sv) -> Box<dyn Reader>,
    /// Function that converts an ephemeris of another message of the same satellite to this form. The orbit
    /// is the same, clocks differ by group delays.
    pub form: fn(&Ephemeris) -> Ephemeris,
    /// Meaning of clock and health in ephemerides of this message.
    pub sets: &'static SetForm,
    /// Function that turns a unit into an alert page; absent if the message has none.
    pub alert: Option<Alert>,
    /// RINEX record names of the message. Absent if RINEX has the message in a form that this crate does not
    /// write.
    pub rinex: Option<Records>,
}

/// Fields of the ephemerides of a message. Without functions of its own a type has none.
pub trait SetFields: Send + Sync {
    /// Names of the parameters that carry the issue of the ephemeris.
    fn parameters(&self) -> Vec<&'static str> {
        Vec::new()
    }

    /// Decodes a satellite's ephemeris from raw parameters near a time. `None` if some are missing or
    /// contradict each other.
    fn elements(&self, _sv: Sv, _raw: Raw<'_>, _near: Epoch) -> Option<Ephemeris> {
        None
    }

    /// Returns the ephemeris as a receiver decodes it after transmission; `transmitted` stays, and so does
    /// what the message does not state.
    ///
    /// # Errors
    /// A value that the message cannot carry.
    fn quantised(&self, ephemeris: &Ephemeris) -> Result<Ephemeris, FieldError> {
        Ok(ephemeris.clone())
    }

    /// Names of the parameters that a fault may change while checks stay right. Parameters that identify
    /// ephemeris or sender are excluded.
    fn adjustable(&self) -> Vec<&'static str> {
        Vec::new()
    }

    /// Adds a value to the named parameter, in its unit. Returns false if there is no such parameter.
    fn adjust(&self, _ephemeris: &mut Ephemeris, _parameter: &str, _by: f64) -> bool {
        false
    }
}

/// Names of a message's records in navigation files of RINEX 4 (RINEX 4.02, tables 24 and 25).
#[derive(Clone, Copy, Debug)]
pub struct Records {
    /// Record name of a satellite's ephemerides.
    pub set: fn(Sv) -> &'static str,
    /// Record name of the parameters that all satellites send alike: ionosphere coefficients and time offsets
    /// between systems.
    pub common: &'static str,
    /// Fields of the message, from which time offsets are read.
    pub fields: fn() -> Vec<(&'static str, Vec<&'static Field>)>,
    /// Record lines after the clock's, for ephemerides that only RINEX 4 has. They are made from the
    /// ephemeris and its raw parameters; a blank field has no value. Absent if the lines are those of version
    /// 3.
    pub lines: Option<fn(&Ephemeris, Raw<'_>) -> Vec<RecordLine>>,
}

/// Four fields of a line of a record.
pub type RecordLine = [Option<f64>; 4];

/// Ionosphere content of a message.
#[derive(Clone, Copy)]
pub struct IonosphereForm {
    /// Model whose coefficients the message carries.
    pub model: Model,
    /// Function that returns true if the unit that begins at this time carries the coefficients.
    pub unit: fn(Epoch) -> bool,
    /// Function that decodes the coefficients from raw parameters; `None` if one is missing.
    pub coefficients: fn(Raw<'_>) -> Option<Coefficients>,
}

/// Raw integers of parameters, by their names in the tables.
pub type Parameters = Vec<(&'static str, i64)>;
/// Function that replaces a unit by one that reports a fault, with right checks. `None` if the symbols fail
/// their own checks.
pub type Alert = fn(&[bool]) -> Option<Vec<bool>>;
/// Function that returns the raw integer of a parameter by its name.
pub type Raw<'a> = &'a dyn Fn(&str) -> Option<i64>;

/// Parameters that all satellites of a system send alike.
#[derive(Clone, Debug, Default)]
pub struct Common {
    /// Klobuchar coefficients of GPS; absent means none are sent.
    pub klobuchar: Option<Klobuchar>,
    /// Klobuchar coefficients of NavIC, for L5; absent means none are sent.
    pub klobuchar_navic: Option<Klobuchar>,
    /// Klobuchar coefficients of BeiDou; absent means none are sent.
    pub klobuchar_beidou: Option<Klobuchar>,
    /// BDGIM coefficients; absent means that nine zeros are sent.
    pub bdgim: Option<Bdgim>,
    /// Effective ionisation coefficients of NeQuick-G, in solar flux units, per degree and per degree
    /// squared.
    pub nequick: Option<[f64; 3]>,
    /// GPS time against UTC.
    pub utc: UtcData,
    /// Offset of Galileo's time from GPS time; absent means that it is not stated.
    pub galileo: Option<TimePolynomial>,
    /// Ephemerides for the almanacs, one for each satellite.
    pub almanac: Vec<Ephemeris>,
    /// Time near which the almanac holds.
    pub reference: Option<Epoch>,
    /// Ground network that supplies the content of augmentation messages; absent means that they contain no
    /// corrections.
    pub network: Option<Arc<dyn Network>>,
    /// Authentication of I/NAV on E1-B; absent means zeros in its bits.
    pub authentication: Option<Arc<dyn Authentication>>,
}

/// Authentication of a constellation's messages.
pub trait Authentication: fmt::Debug + Send + Sync {
    /// Bits of authentication in the page of a satellite that begins at a time, the first sent the most
    /// significant.
    fn bits(&self, sv: Sv, start: Epoch) -> u64;
}

/// Step of an almanac's reference time, and the last one inside a week (IS-GPS-200N, table 20-VI;
/// IS-GPS-800J, 3.5.4.3.2; BDS-SIS-ICD-B1C 1.0, 7.9).
pub(crate) const ALMANAC_STEP_S: i64 = 4096;
const TOA_LAST_S: i64 = 602_112;

/// The reference time of almanacs: the multiple of 4096 s nearest to `reference` inside its week.
pub(crate) fn almanac_time(reference: Epoch) -> Epoch {
    let tow_s = ((reference.tow_whole_s() + ALMANAC_STEP_S / 2) / ALMANAC_STEP_S * ALMANAC_STEP_S).min(TOA_LAST_S);
    Epoch::new(reference.week() * WEEK_S + tow_s, 0.0)
}

/// The page of a `turn` of almanac pages, and the satellites in it: pages of up to `places` reduced almanacs,
/// then one page for each satellite by itself. The flag is set for a page of reduced almanacs. Without
/// satellites every page is such a page.
pub(crate) fn almanac_page<T>(entries: &[T], places: usize, turn: i64) -> (bool, &[T]) {
    let reduced = entries.len().div_ceil(places).max(1);
    let turn = turn.rem_euclid((reduced + entries.len()) as i64) as usize;
    let (first, count) = if turn < reduced { (turn * places, places) } else { (turn - reduced, 1) };
    let (_, rest) = entries.split_at(first.min(entries.len()));
    (turn < reduced, rest.split_at(count.min(rest.len())).0)
}

/// UTC parameters of messages newer than LNAV and D1: a polynomial and a change of leap seconds. Weeks and
/// seconds are those of the system's own time (IS-GPS-705J, 20.3.3.6; BDS-SIS-ICD-B2a 1.0, 7.12).
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct UtcNumbers {
    pub a0_s: f64,
    pub a1_sps: f64,
    pub a2_sps2: f64,
    pub leap_s: f64,
    pub tot_s: f64,
    pub week: f64,
    pub event_week: f64,
    pub event_day: f64,
    pub leap_after_s: f64,
}

impl UtcNumbers {
    /// UTC parameters in a time scale that is whole seconds behind GPS time, for a unit that begins at
    /// `start`. Week numbers count from `first_week`. Sunday has the day number `sunday`.
    pub fn of(common: &Common, start: Epoch, time: &TimeScale, (first_week, sunday): (i64, i64)) -> Self {
        let utc = &common.utc;
        let behind_s = time.behind_gpst_s as f64;
        let reference = utc.polynomial.map(|polynomial| polynomial.reference).or(common.reference);
        // To the step of its field.
        let label = reference.map_or(start, |reference| time.label(reference));
        let tot_s = label.tow_whole_s().div_euclid(16) * 16;
        let at = Epoch::new(label.week() * WEEK_S + tot_s, 0.0);
        let event = utc.event.map_or((start.week(), 7, utc.leap_s), |e| (e.week, i64::from(e.day), e.after_s));
        Self {
            a0_s: utc.polynomial.map_or(0.0, |polynomial| polynomial.at_s(time.instant(at))),
            a1_sps: utc.polynomial.map_or(0.0, |polynomial| polynomial.a1_sps),
            a2_sps2: 0.0,
            leap_s: utc.leap_s as f64 - planted!("gnss.bcnav.leap", behind_s, 0.0),
            tot_s: tot_s as f64,
            week: (label.week() - first_week).rem_euclid(8192) as f64,
            event_week: (event.0 - first_week).rem_euclid(8192) as f64,
            event_day: (event.1 - 1 + sunday) as f64,
            leap_after_s: event.2 as f64 - behind_s,
        }
    }
}

/// Encodes the units of one form of message.
pub trait Sender: Send + Sync {
    /// The symbols of the unit that a satellite sends from `start` on; `true` is a logical 1, sent as −1.
    ///
    /// # Errors
    /// A value that the message cannot carry, or a start at which no unit begins.
    fn unit(&self, ephemeris: &Ephemeris, start: Epoch) -> Result<Vec<bool>, FieldError>;

    /// Symbols of a unit that follows a unit with the ephemeris `before`. It serves codes whose encoder state
    /// continues from unit to unit.
    ///
    /// # Errors
    /// Errors of [`Self::unit`].
    fn unit_after(&self, before: &Ephemeris, ephemeris: &Ephemeris, start: Epoch) -> Result<Vec<bool>, FieldError> {
        let _ = before;
        self.unit(ephemeris, start)
    }

    /// Other units that a receiver can find out of the one that begins at `start`, beside some of their like;
    /// none of a unit without redundancy.
    ///
    /// # Errors
    /// Errors of [`Self::unit`].
    fn restored(&self, ephemeris: &Ephemeris, start: Epoch) -> Result<Vec<Vec<bool>>, FieldError> {
        let _ = (ephemeris, start);
        Ok(Vec::new())
    }
}

/// Result of decoding one symbol.
#[derive(Clone, Debug, PartialEq)]
pub enum Read {
    /// A unit that passed its checks began `symbols` before the end of the newest symbol, at a time of week.
    Unit {
        /// Number of symbols from the unit's first to the newest, both counted.
        symbols: u64,
        /// Seconds of the week at which its first symbol was sent.
        of_week_s: i64,
        /// True if symbols are received inverted.
        inverted: bool,
    },
    /// A unit of a message that does not state its time.
    Undated {
        /// Number of symbols from the unit's first to the newest, both counted.
        symbols: u64,
        /// True if symbols are received inverted.
        inverted: bool,
    },
    /// Start of a unit with its week, which is resolved near the time that the reader was given.
    Time(Epoch),
    /// A whole ephemeris.
    Ephemeris(Box<Ephemeris>),
    /// An ephemeris in short, good to metres, for some minutes from its reference time on; whether group
    /// delays and health were read too, else they are zero.
    Reduced {
        /// Orbit as complete elements; all other parameters are zero.
        set: Box<Ephemeris>,
        /// True if group delays and health are included.
        with_delays: bool,
    },
    /// The ionosphere's parameters.
    Ionosphere(Coefficients),
    /// Offset of the system's time ahead of GPS time, in seconds without the whole seconds between both.
    AheadOfGps(TimePolynomial),
    /// Content of an augmentation message about other satellites, with the start of its block.
    Augmentation(Epoch, Box<Content>),
    /// Satellite that transmits, if it differs from the assumed one. Some satellites share code and carrier,
    /// and only the message identifies them. All later results belong to this satellite.
    Sender(Sv),
    /// A whole page, of a reader that keeps them ([`Reader::keep_pages`]).
    Page(SentPage),
    /// Raw parameters as decoded.
    Parameters(Vec<NavigationRow>),
    /// A unit that passed its checks is not used, or parts that did make no ephemeris: why.
    Refused(String),
}

/// Page whose check is right, all of its bits as they were sent.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SentPage {
    /// Number of symbols from the page's first to the newest, both counted.
    pub symbols: u64,
    /// Second at which the page began, by the satellite's message.
    pub start: Epoch,
    /// Even and odd part, each in the low 120 bits.
    pub parts: [u128; 2],
}

/// Raw integer of a parameter by its name.
pub(crate) fn raw_of(all: &Parameters, name: &str) -> Option<i64> {
    all.iter().find(|(other, _)| *other == name).map(|(_, raw)| *raw)
}

impl Read {
    /// Raw parameters of a satellite as decoded from a message.
    pub(crate) fn parameters(sv: Sv, message: &Message, issue: u32, parameters: Parameters) -> Self {
        Self::Parameters(NavigationRow::each(sv, message.name, issue, parameters).collect())
    }

    /// Failure for a unit that names another satellite than the tracked one.
    pub(crate) fn names_another(unit: &str, said: impl fmt::Display) -> Self {
        Self::Refused(format!("{unit} names satellite {said}, which is another one"))
    }

    /// Failure for parts that were all decoded but do not form an ephemeris.
    pub(crate) fn make_no_set(parts: &str) -> Self {
        Self::Refused(format!("{parts} are of different sets or of another satellite"))
    }
}

/// Reads the message of one satellite.
pub trait Reader: fmt::Debug + Send + Sync {
    /// Takes the next symbol: positive for a logical 0 if it is not inverted, and as large as it is sure.
    /// `near` resolves weeks.
    fn take(&mut self, soft: f32, near: Epoch) -> Vec<Read>;
    /// Takes a time that is known to within a year. Messages whose own date is incomplete are dated by it.
    fn know(&mut self, _near: Epoch) {}
    /// Hands on whole pages from here on, where the message has pages that carry authentication.
    fn keep_pages(&mut self) {}
    /// Symbols are missing before the next one.
    fn skip(&mut self);
    /// The time of a unit contradicts those before: where units begin is searched again.
    fn doubt(&mut self);
    /// Parts of an ephemeris that have not been decoded: subframes, words.
    fn missing(&self) -> Vec<u8>;
}

impl Message {
    /// Refuses a time at which no unit begins.
    pub(crate) fn check_start(&self, start: Epoch, expected: &'static str) -> Result<(), FieldError> {
        let late_s = (start.seconds() - self.first_s).rem_euclid(self.unit_s);
        if late_s == 0 && start.fraction() == 0.0 {
            return Ok(());
        }
        Err(FieldError::Start { message: self.name, start_s: start.tow_s(), expected })
    }

    /// True if the message states its own time.
    pub fn is_dated(&self) -> bool {
        !self.timed.is_empty()
    }

    /// Symbols of a unit.
    pub fn unit_symbols(&self) -> usize {
        (self.unit_s as f64 / self.symbol_s).round() as usize
    }

    /// Number of the unit in which a whole second lies, counted from the beginning of the system's time.
    pub fn unit_at(&self, second: i64) -> i64 {
        (second - self.first_s).div_euclid(self.unit_s)
    }

    /// Number of the unit whose start decides to which ephemeris a unit belongs.
    pub fn unit_of_set(&self, unit: i64) -> i64 {
        let units = (self.set_s / self.unit_s).max(1);
        unit.div_euclid(units) * units
    }

    /// Start time of the unit with this number.
    pub fn unit_start(&self, unit: i64) -> Epoch {
        Epoch::new(unit * self.unit_s + self.first_s, 0.0)
    }

    /// Longest time in seconds until every unit of an ephemeris has been received, from any moment. `None` if
    /// the message carries no ephemeris.
    pub fn set_within_s(&self) -> Option<i64> {
        // Two rounds of LNAV's pages; no message repeats its ephemeris more seldom.
        const UNITS: i64 = 250;
        let longest_s = |wanted: &u8| {
            let starts = (0..UNITS).map(|unit| self.unit_start(unit)).filter(|start| (self.number)(*start) == *wanted);
            let seconds: Vec<i64> = starts.map(Epoch::seconds).collect();
            let between_s = seconds.windows(2).map(|pair| pair[1] - pair[0]).max()?;
            Some(between_s + self.unit_s)
        };
        self.set.iter().filter_map(longest_s).max()
    }
}

impl fmt::Debug for Message {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name)
    }
}

impl PartialEq for Message {
    fn eq(&self, other: &Self) -> bool {
        self.name == other.name
    }
}

#[cfg(test)]
mod tests {
    use crate::signal::Signal;
    use crate::{beidou, galileo, glonass, gps};

    #[test]
    fn sets_come_whole_within_a_repetition_and_a_unit() {
        let within_s = |signal: &Signal| {
            signal.components.iter().find_map(|component| component.message).and_then(super::Message::set_within_s)
        };
        // Frames of 30 s in subframes of 6 s (IS-GPS-200N, 20.3.3), of 18 s in one piece, of which two of
        // three have page 1 (IS-GPS-800J, 3.2.3), of 30 s in strings of 2 s (GLONASS ICD L1, L2 5.1, 4.3);
        // subframes of 30 s in pages of 2 s and of 50 s in pages of 10 s (Galileo OS SIS ICD 2.1, 4.3 and
        // 4.2). A unit of BeiDou's is what D1 and D2 have in common, 30 s.
        assert_eq!(within_s(&gps::l1ca::L1_CA), Some(30 + 6));
        assert_eq!(within_s(&gps::l1c::L1C), Some(2 * 18 + 18));
        assert_eq!(within_s(&galileo::e1::E1), Some(30 + 2));
        assert_eq!(within_s(&galileo::e5::E5A), Some(50 + 10));
        assert_eq!(within_s(&beidou::in_phase::B1I), Some(30 + 30));
        assert_eq!(within_s(&glonass::fdma::G1), Some(30 + 2));
        // Pages of high accuracy carry no ephemeris.
        assert_eq!(within_s(&galileo::e6::E6), None);
    }
}
