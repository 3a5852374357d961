//! A RINEX observation file and an NMEA file as another receiver would write them, to be damaged value by
//! value.

use std::collections::BTreeMap;
use std::fmt::Write;

/// A value with its loss-of-lock indicator and signal strength.
pub type Value = (Option<f64>, char, char);

/// One epoch: its line up to the count of satellites, seconds of its day, and each satellite's values.
#[derive(Clone)]
pub struct Epoch {
    line: String,
    pub time_s: f64,
    pub rows: Vec<(String, Vec<Value>)>,
}

/// An observation file.
#[derive(Clone)]
pub struct Observations {
    header: String,
    types: BTreeMap<char, Vec<String>>,
    pub epochs: Vec<Epoch>,
}

/// The last line of a header.
const END: &str = "                                                            END OF HEADER";

impl Observations {
    pub fn read(text: &str) -> Self {
        let (header, body) = text.split_once("END OF HEADER\n").unwrap();
        let of_system = header.lines().filter(|line| line.ends_with("SYS / # / OBS TYPES"));
        let types = of_system
            .map(|line| (line.chars().next().unwrap(), line[6..60].split_whitespace().map(str::to_owned).collect()))
            .collect();
        let mut found = Self { header: format!("{header}END OF HEADER\n"), types, epochs: Vec::new() };
        for line in body.lines() {
            if line.starts_with('>') {
                let part = |from: usize, to: usize| line[from..to].trim().parse::<f64>().unwrap();
                let time_s = 3600.0 * part(13, 15) + 60.0 * part(16, 18) + part(18, 29);
                found.epochs.push(Epoch { line: line[..32].to_owned(), time_s, rows: Vec::new() });
                continue;
            }
            let count = found.types[&line.chars().next().unwrap()].len();
            let value = |index: usize| {
                let field = format!("{:16}", line.get(3 + 16 * index..).unwrap_or("").get(..16).unwrap_or(""));
                let number = field[..14].trim().parse().ok();
                (number, field[14..].chars().next().unwrap(), field[15..].chars().next().unwrap())
            };
            // The last field of a line may be short.
            let padded = |index: usize| match line.get(3 + 16 * index..) {
                Some(rest) if rest.len() < 16 => (rest.get(..14).and_then(|text| text.trim().parse().ok()), ' ', ' '),
                _ => value(index),
            };
            let row = (line[..3].to_owned(), (0..count).map(padded).collect());
            found.epochs.last_mut().unwrap().rows.push(row);
        }
        let steps = found.epochs.windows(2).map(|two| two[1].time_s - two[0].time_s);
        let interval_s = steps.fold(f64::INFINITY, f64::min);
        found.state_interval(interval_s);
        found
    }

    /// Says in the header how often epochs come.
    pub fn state_interval(&mut self, interval_s: f64) {
        let kept = self.header.lines().filter(|line| !line.ends_with("INTERVAL") && *line != END);
        let kept: String = kept.map(|line| format!("{line}\n")).collect();
        self.header = format!("{kept}{interval_s:10.3}{:50}INTERVAL\n{END}\n", "");
    }

    pub fn write(&self) -> String {
        let mut text = self.header.clone();
        for epoch in &self.epochs {
            let seconds = epoch.time_s;
            let (hours, minutes) = ((seconds / 3600.0).floor(), (seconds % 3600.0 / 60.0).floor());
            let left_s = seconds - 3600.0 * hours - 60.0 * minutes;
            let (before, after) = (&epoch.line[..13], &epoch.line[29..32]);
            writeln!(text, "{before}{hours:02} {minutes:02}{left_s:11.7}{after}{:3}", epoch.rows.len()).unwrap();
            for (sv, values) in &epoch.rows {
                let field =
                    |(value, lli, ssi): &Value| value.map_or(" ".repeat(16), |value| format!("{value:14.3}{lli}{ssi}"));
                let line = values.iter().map(field).collect::<String>();
                writeln!(text, "{}", format!("{sv}{line}").trim_end()).unwrap();
            }
        }
        text
    }

    /// Seconds from the first epoch to the last.
    pub fn span_s(&self) -> f64 {
        self.epochs.last().unwrap().time_s - self.epochs[0].time_s
    }

    /// A satellite that is there in most epochs, the second by name.
    pub fn one(&self) -> String {
        self.longest()[1].clone()
    }

    /// Satellites, those of most epochs first.
    pub fn longest(&self) -> Vec<String> {
        let mut counts: BTreeMap<&str, usize> = BTreeMap::new();
        self.epochs.iter().flat_map(|epoch| &epoch.rows).for_each(|(sv, _)| *counts.entry(sv).or_default() += 1);
        let mut all: Vec<(&str, usize)> = counts.into_iter().collect();
        all.sort_by_key(|(sv, count)| (usize::MAX - count, sv.to_owned()));
        all.into_iter().map(|(sv, _)| sv.to_owned()).collect()
    }

    /// Replaces the values of a kind (C, L, D, S) of the satellites that are chosen by a function of the
    /// seconds since the first epoch, the code as `1C` and the value.
    pub fn map(&mut self, kind: char, chosen: impl Fn(&str) -> bool, mut of: impl FnMut(f64, &str, f64) -> f64) {
        let first_s = self.epochs[0].time_s;
        for epoch in &mut self.epochs {
            let since_s = epoch.time_s - first_s;
            for (sv, values) in epoch.rows.iter_mut().filter(|(sv, _)| chosen(sv)) {
                let codes = &self.types[&sv.chars().next().unwrap()];
                for (code, value) in codes.iter().zip(values).filter(|(code, _)| code.starts_with(kind)) {
                    value.0 = value.0.map(|value| of(since_s, &code[1..], value));
                }
            }
        }
    }

    /// Gives every value of a carrier an indicator.
    pub fn indicate(&mut self, lli: char) {
        for (sv, values) in self.epochs.iter_mut().flat_map(|epoch| &mut epoch.rows) {
            let codes = &self.types[&sv.chars().next().unwrap()];
            codes.iter().zip(values).filter(|(code, _)| code.starts_with('L')).for_each(|(_, value)| value.1 = lli);
        }
    }

    /// Puts a receiver's clock into codes, carriers, Dopplers and labels: its reading less true time at the
    /// seconds since the first epoch, for codes and labels and for carriers, and its rate.
    pub fn by_clock(&mut self, code_s: impl Fn(f64) -> f64, carrier_s: impl Fn(f64) -> f64, rate: f64) {
        let carrier_hz = |code: &str| match code.as_bytes()[0] {
            b'1' => 1_575.42e6,
            other => panic!("no carrier of band {}", char::from(other)),
        };
        self.map('C', |_| true, |t_s, _, value| value + 299_792_458.0 * code_s(t_s));
        self.map('L', |_| true, |t_s, code, value| value + carrier_hz(code) * carrier_s(t_s));
        self.map('D', |_| true, |_, code, value| value - carrier_hz(code) * rate);
        let first_s = self.epochs[0].time_s;
        self.epochs.iter_mut().for_each(|epoch| epoch.time_s += code_s(epoch.time_s - first_s));
    }
}

/// Sentences by their fields.
pub struct Sentences(pub Vec<Vec<String>>);

impl Sentences {
    pub fn read(text: &str) -> Self {
        let fields = |line: &str| {
            let body = line.trim_start_matches('$').split('*').next().unwrap();
            body.split(',').map(str::to_owned).collect()
        };
        Self(text.lines().map(fields).collect())
    }

    pub fn write(&self) -> String {
        let line = |fields: &Vec<String>| {
            let body = fields.join(",");
            format!("${body}*{:02X}\r\n", body.bytes().fold(0, |sum, byte| sum ^ byte))
        };
        self.0.iter().map(line).collect()
    }

    /// Changes the fields of the sentences of a kind.
    pub fn each(&mut self, kind: &str, change: impl FnMut(&mut Vec<String>)) {
        self.0.iter_mut().filter(|fields| fields[0].ends_with(kind)).for_each(change);
    }

    /// Keeps the sentences of the times, seconds of the day, that are chosen.
    pub fn keep(&mut self, mut chosen: impl FnMut(f64) -> bool) {
        let has_time = |fields: &Vec<String>| fields[0].ends_with("GGA") || fields[0].ends_with("RMC");
        self.0.retain(|fields| !has_time(fields) || chosen(time_s(&fields[1])));
    }

    /// Times of the positions, seconds of the day.
    pub fn times_s(&self) -> Vec<f64> {
        self.0.iter().filter(|fields| fields[0].ends_with("GGA")).map(|fields| time_s(&fields[1])).collect()
    }

    /// Moves every position to the north, by a function of its number.
    pub fn north(&mut self, mut by_m: impl FnMut(usize) -> f64) {
        let mut number = 0;
        self.each("GGA", |fields| {
            let minutes = 60.0 * fields[2][..2].parse::<f64>().unwrap() + fields[2][2..].parse::<f64>().unwrap();
            // A minute of latitude is a nautical mile.
            let minutes = minutes + by_m(number) / 1852.0;
            let degrees = (minutes / 60.0).floor();
            fields[2] = format!("{degrees:02}{:011.8}", minutes - 60.0 * degrees);
            number += 1;
        });
    }

    /// Replaces a number of every sentence of a kind.
    pub fn number(&mut self, kind: &str, field: usize, of: impl Fn(f64) -> f64) {
        self.each(kind, |fields| {
            if let Ok(value) = fields[field].parse::<f64>() {
                fields[field] = format!("{:.4}", of(value));
            }
        });
    }

    /// Moves every label.
    pub fn late(&mut self, by_s: f64) {
        for kind in ["GGA", "RMC"] {
            self.each(kind, |fields| {
                let t_s = time_s(&fields[1]) + by_s;
                let (hours, minutes) = ((t_s / 3600.0).floor(), (t_s % 3600.0 / 60.0).floor());
                let left_s = t_s - 3600.0 * hours - 60.0 * minutes;
                fields[1] = format!("{hours:02}{minutes:02}{left_s:06.3}");
            });
        }
    }

    /// Gives every position the place of so many seconds before.
    pub fn aged(&mut self, by_s: f64) {
        let key = |t_s: f64| (100.0 * t_s).round() as i64;
        let places: BTreeMap<i64, Vec<String>> = (self.0.iter())
            .filter(|fields| fields[0].ends_with("GGA"))
            .map(|fields| (key(time_s(&fields[1])), fields.clone()))
            .collect();
        self.0.retain(|fields| !fields[0].ends_with("GGA") || places.contains_key(&key(time_s(&fields[1]) - by_s)));
        self.each("GGA", |fields| {
            let old = &places[&key(time_s(&fields[1]) - by_s)];
            fields[2..6].clone_from_slice(&old[2..6]);
            fields[9].clone_from(&old[9]);
        });
    }
}

fn time_s(text: &str) -> f64 {
    let part = |from: usize, to: usize| text[from..to].parse::<f64>().unwrap();
    3600.0 * part(0, 2) + 60.0 * part(2, 4) + part(4, text.len())
}
