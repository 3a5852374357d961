//! Stream of a reference station: which messages are sent with an epoch, and in which order.
//!
//! Source: RTCM 10403.3, 3.5.2 (1005, 1006), 3.5.5 (1033), 3.5.14 (1230), 3.5.16 (MSM). What describes the
//! station and its satellites goes before the observations of the same epoch, so that a client knows an
//! ephemeris before it needs it. A [`Plan`] names messages with their intervals, by whole multiples of which
//! the time of the week decides; MSMs without one are sent with every epoch. Of each satellite that is
//! observed the ephemeris is sent that was sent last. What cannot be written is counted by its reason.

use std::collections::BTreeMap;
use std::fmt;
use std::str::FromStr;

use nalgebra::Vector3;

use super::field::{self, Field, Refused, i, reserved, text, u};
use super::msm::Kind;
use super::msm::write::{Arcs, Draft, drafts};
use super::{ephemeris, framed, signals};
use crate::observed::ObservedEpoch;
use crate::table::Value;
use gnss::broadcast::Ephemeris;
use gnss::satellite::{Sv, System};
use gnss::time::Epoch;

/// Fields of the antenna's position in metres, Earth-fixed; the last one is of message 1006 alone.
const PLACE: [Field; 14] = [
    u(12, "DF002"),
    u(12, "DF003"),
    u(6, "DF021"),
    u(1, "DF022"),
    u(1, "DF023"),
    u(1, "DF024"),
    u(1, "DF141"),
    i(38, "DF025").over(1e4),
    u(1, "DF142"),
    reserved(1),
    i(38, "DF026").over(1e4),
    u(2, "DF364"),
    i(38, "DF027").over(1e4),
    u(16, "DF028").over(1e4),
];
/// Fields of message 1033: descriptions of antenna and receiver.
pub const EQUIPMENT: [Field; 8] = [
    u(12, "DF002"),
    u(12, "DF003"),
    text("DF030"),
    u(8, "DF031"),
    text("DF033"),
    text("DF228"),
    text("DF230"),
    text("DF232"),
];
/// Fields of message 1230: code biases of GLONASS in metres, each where the mask names its signal.
pub const BIASES: [Field; 9] = [
    u(12, "DF002"),
    u(12, "DF003"),
    u(1, "DF421"),
    reserved(3),
    u(4, "DF422"),
    i(16, "DF423").over(50.0).when("DF422", 3),
    i(16, "DF424").over(50.0).when("DF422", 2),
    i(16, "DF425").over(50.0).when("DF422", 1),
    i(16, "DF426").over(50.0).when("DF422", 0),
];
/// Intervals in seconds of messages about the station and of ephemerides, where none is asked for.
const STATION_S: f64 = 10.0;
const EPHEMERIS_S: f64 = 30.0;

/// Fields of message 1005, or with the antenna's height those of 1006.
pub fn place(with_height: bool) -> impl Iterator<Item = &'static Field> {
    PLACE.iter().take(if with_height { PLACE.len() } else { PLACE.len() - 1 })
}

/// Reference station.
#[derive(Clone, Debug, Default)]
pub struct Station {
    /// Number, 0 to 4095 (DF003).
    pub number: u16,
    /// Position of the antenna's reference point, Earth-fixed, metres; without it 1005 and 1006 are not sent.
    pub position_m: Option<Vector3<f64>>,
    /// Height in metres of the antenna above a marker (DF028).
    pub height_m: f64,
    /// Description of the antenna (DF030).
    pub antenna: String,
    /// Description of the receiver (DF228).
    pub receiver: String,
    /// Version of the receiver (DF230).
    pub version: String,
}

impl Station {
    /// Bytes of a message about the station; none of one that has nothing to say.
    fn message(&self, number: u64) -> Result<Option<Vec<u8>>, Refused> {
        let place_m = self.position_m.unwrap_or_default();
        let value = |column| match column {
            "DF002" => Value::Integer(number as i64),
            "DF003" => Value::Integer(i64::from(self.number)),
            // Systems that are served, and one oscillator for all of them.
            "DF022" | "DF023" | "DF024" | "DF142" => Value::Integer(1),
            "DF025" => Value::Real(place_m.x),
            "DF026" => Value::Real(place_m.y),
            "DF027" => Value::Real(place_m.z),
            "DF028" => Value::Real(self.height_m),
            "DF030" => Value::Text(self.antenna.clone()),
            "DF228" => Value::Text(self.receiver.clone()),
            "DF230" => Value::Text(self.version.clone()),
            "DF033" | "DF232" => Value::Text(String::new()),
            // Codes and carriers of GLONASS are aligned: all four biases are given, as zero.
            "DF421" => Value::Integer(1),
            "DF422" => Value::Integer(0b1111),
            _ => Value::Integer(0),
        };
        let body = match number {
            1005 | 1006 if self.position_m.is_none() => return Ok(None),
            1005 | 1006 => field::write(place(number == 1006), value),
            1033 => field::write(EQUIPMENT.iter(), value),
            _ => field::write(BIASES.iter(), value),
        };
        body.map(Some)
    }
}

/// Messages with their intervals in seconds; zero is with every epoch.
#[derive(Clone, Debug, PartialEq)]
pub struct Plan {
    messages: BTreeMap<u64, f64>,
}

impl Plan {
    /// True if the plan has a message of this number.
    pub fn has(&self, number: u64) -> bool {
        self.messages.contains_key(&number)
    }

    /// Messages that observations of these systems have, as source tables of casters list them.
    pub fn of_systems(&self, systems: &[System]) -> String {
        let is_of = |number: u64| match Kind::of(number).map(Kind::system).or(ephemeris::system_of(number)) {
            Some(system) => systems.contains(&system),
            None => number != 1230 || systems.contains(&System::Glonass),
        };
        let own = self.messages().filter(|(number, _)| is_of(*number));
        let words: Vec<String> = own
            .map(
                |(number, interval_s)| {
                    if interval_s == 0.0 { number.to_string() } else { format!("{number}({interval_s})") }
                },
            )
            .collect();
        words.join(",")
    }

    /// Numbers of the messages with their intervals.
    pub fn messages(&self) -> impl Iterator<Item = (u64, f64)> + '_ {
        self.messages.iter().map(|(number, interval_s)| (*number, *interval_s))
    }
}

fn msm_numbers(level: u64) -> Vec<u64> {
    signals::SYSTEMS.iter().map(|(tens, ..)| 10 * tens + level).collect()
}

/// Interval in seconds of a message that none is asked for.
fn usual_s(number: u64) -> f64 {
    match number {
        1005 | 1006 | 1033 | 1230 => STATION_S,
        _ if Kind::of(number).is_some() => 0.0,
        _ => EPHEMERIS_S,
    }
}

impl FromStr for Plan {
    type Err = String;

    /// Reads numbers or names of groups separated by commas, each with an interval in brackets if it is not
    /// the usual one: `msm7,1005(10),eph`.
    fn from_str(text: &str) -> Result<Self, String> {
        let mut messages = BTreeMap::new();
        for word in text.split(',').map(str::trim) {
            let (name, interval_s) = match word.strip_suffix(')').and_then(|word| word.split_once('(')) {
                None => (word, None),
                Some((name, seconds)) => {
                    let parsed = seconds.parse::<f64>().ok().filter(|seconds| (0.0..=86_400.0).contains(seconds));
                    (name, Some(parsed.ok_or_else(|| format!("'{word}': expected an interval of 0 to 86400 s"))?))
                }
            };
            let numbers: Vec<u64> = match name {
                "msm4" => msm_numbers(4),
                "msm5" => msm_numbers(5),
                "msm6" => msm_numbers(6),
                "msm7" => msm_numbers(7),
                "eph" => ephemeris::numbers().collect(),
                number => number.parse().ok().filter(|number| is_written(*number)).into_iter().collect(),
            };
            if numbers.is_empty() {
                return Err(format!(
                    "'{word}': expected msm4, msm5, msm6, msm7, eph or one of 1005, 1006, 1033, 1230, the numbers of \
                     ephemerides (1019, 1020, 1041, 1042, 1044, 1045, 1046) or of MSM4 to MSM7, such as 1077, with an \
                     interval in seconds as in 1005(10)"
                ));
            }
            messages.extend(numbers.into_iter().map(|number| (number, interval_s.unwrap_or(usual_s(number)))));
        }
        Ok(Self { messages })
    }
}

fn is_written(number: u64) -> bool {
    let about_station = matches!(number, 1005 | 1006 | 1033 | 1230);
    about_station || ephemeris::numbers().any(|known| known == number) || Kind::of(number).is_some()
}

impl fmt::Display for Plan {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let all: Vec<String> = self.messages().map(|(number, interval_s)| format!("{number}({interval_s})")).collect();
        f.write_str(&all.join(","))
    }
}

/// Stream in the making.
#[derive(Debug)]
pub struct Sender {
    station: Station,
    plan: Plan,
    sets: BTreeMap<Sv, Vec<Ephemeris>>,
    arcs: BTreeMap<u64, Arcs>,
    /// Number of the interval in which a message was sent last.
    sent: BTreeMap<u64, i64>,
    /// Messages so far, by their numbers.
    pub counts: BTreeMap<u64, u64>,
    /// Reasons for which something was left out, and how often.
    pub refused: BTreeMap<String, u64>,
}

impl Sender {
    /// Stream of a station that knows these ephemerides.
    pub fn new(station: Station, plan: Plan, sets: Vec<Ephemeris>) -> Self {
        let mut own = Self {
            station,
            plan,
            sets: BTreeMap::new(),
            arcs: BTreeMap::new(),
            sent: BTreeMap::new(),
            counts: BTreeMap::new(),
            refused: BTreeMap::new(),
        };
        sets.into_iter().for_each(|set| own.sets.entry(set.sv).or_default().push(set));
        own
    }

    /// Counts what was left out.
    pub fn refuse(&mut self, reason: &Refused) {
        *self.refused.entry(reason.to_string()).or_default() += 1;
    }

    /// True if a message is due at a time, which then counts as sent.
    fn is_due(&mut self, number: u64, at: Epoch) -> bool {
        let Some(interval_s) = self.plan.messages.get(&number) else { return false };
        if *interval_s == 0.0 {
            return true;
        }
        // Labels may be nanoseconds before their second.
        let part = ((at.seconds() as f64 + at.fraction() + 1e-3) / interval_s).floor() as i64;
        self.sent.insert(number, part) != Some(part)
    }

    fn add(&mut self, number: u64, body: &[u8], into: &mut Vec<u8>) {
        *self.counts.entry(number).or_default() += 1;
        into.extend(framed(body));
    }

    /// Frames of all messages that are due with an epoch; empty if there are none.
    pub fn epoch(&mut self, epoch: &ObservedEpoch) -> Vec<u8> {
        let mut bytes = Vec::new();
        let has_glonass = epoch.values.iter().any(|value| value.sv.system == System::Glonass);
        for number in [1005, 1006, 1033, 1230] {
            if number == 1230 && !has_glonass || !self.is_due(number, epoch.label) {
                continue;
            }
            match self.station.message(number) {
                Ok(Some(body)) => self.add(number, &body, &mut bytes),
                Ok(None) => {}
                Err(reason) => self.refuse(&reason),
            }
        }
        self.ephemerides(epoch, &mut bytes);
        let all = self.observations(epoch);
        for (place, draft) in all.iter().enumerate() {
            let body = draft.write(self.station.number, place + 1 < all.len());
            self.add(draft.number(), &body, &mut bytes);
        }
        bytes
    }

    fn ephemerides(&mut self, epoch: &ObservedEpoch, bytes: &mut Vec<u8>) {
        let due: Vec<u64> = ephemeris::numbers().filter(|number| self.is_due(*number, epoch.label)).collect();
        let mut seen: Vec<Sv> = epoch.values.iter().map(|value| value.sv).collect();
        seen.sort_unstable();
        seen.dedup();
        for sv in seen {
            let sets = self.sets.get(&sv).map_or(&[][..], Vec::as_slice);
            let written: Vec<_> = match due.is_empty() {
                true => Vec::new(),
                false => newest(sets, epoch.label)
                    .into_iter()
                    .map(|set| (ephemeris::number_of(set), ephemeris::write(set)))
                    .collect(),
            };
            for (number, body) in written {
                match (number, body) {
                    (Ok(number), Ok(body)) if due.contains(&number) => self.add(number, &body, bytes),
                    (Ok(_), Ok(_)) => {}
                    (Err(reason), _) | (_, Err(reason)) => self.refuse(&reason),
                }
            }
        }
    }

    /// Messages with the observations of an epoch.
    fn observations(&mut self, epoch: &ObservedEpoch) -> Vec<Draft> {
        let kinds: Vec<Kind> = self.plan.messages.keys().filter_map(|number| Kind::of(*number)).collect();
        let due: Vec<Kind> = kinds.into_iter().filter(|kind| self.is_due(kind.number(), epoch.label)).collect();
        let (mut all, mut refused) = (Vec::new(), Vec::new());
        for kind in due {
            let arcs = self.arcs.entry(kind.number()).or_default();
            all.extend(drafts(kind, epoch, arcs, &mut refused));
        }
        refused.iter().for_each(|reason| self.refuse(reason));
        all
    }
}

/// Ephemeris of each message of a satellite that was sent last before a time; where none had, the one
/// whose reference time is nearest.
fn newest(sets: &[Ephemeris], at: Epoch) -> Vec<&Ephemeris> {
    let mut chosen: BTreeMap<&str, &Ephemeris> = BTreeMap::new();
    let rank = |set: &Ephemeris| {
        let is_sent = set.transmitted.since(at) <= 0.0;
        (is_sent, if is_sent { set.toe.since(at) } else { -set.toe.since(at).abs() })
    };
    for set in sets {
        let best = chosen.entry(set.form.name).or_insert(set);
        if rank(set) > rank(best) {
            *best = set;
        }
    }
    chosen.into_values().collect()
}

#[cfg(test)]
#[path = "station_tests.rs"]
mod tests;
