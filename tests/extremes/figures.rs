//! Figures beside their bars: asserted here, and written where the environment asks for it.

use std::collections::BTreeMap;
use std::fmt::Write;
use std::panic::Location;
use std::path::PathBuf;
use std::sync::Mutex;

/// A case of the list, where it belongs and what it ran on.
#[derive(Clone, Copy, Debug)]
pub struct Case {
    pub number: u32,
    pub subject: &'static str,
    pub signals: &'static str,
}

/// Shorthand for a case.
pub const fn case(number: u32, subject: &'static str, signals: &'static str) -> Case {
    Case { number, subject, signals }
}

/// Signals of a case that covers the catalogue.
pub const ALL: &str = "all 25";
/// Signal of a case with GPS L1 C/A alone.
pub const CA: &str = "GPS L1 C/A";
/// Signals of a case about positions, orbits, loops or sums, which know no signal.
pub const NONE: &str = "none";

/// Families by the number of their first case.
const FAMILIES: [(u32, &str); 11] = [
    (1, "Time"),
    (8, "Orbit"),
    (13, "Geometry"),
    (23, "Dynamics"),
    (29, "Sampling"),
    (34, "Power, quantiser, interference"),
    (44, "Arithmetic"),
    (47, "Loops"),
    (53, "Beyond the list"),
    (59, "Time of every system"),
    (62, "Codes and carriers of every signal"),
];

/// An extreme of many figures and the input that makes it. The first of equals stays, and a figure that is no
/// number beats all others, so that its bar is missed.
#[derive(Clone, Debug)]
pub struct Worst {
    value: f64,
    at: String,
    least: bool,
}

impl Default for Worst {
    /// The largest; without a figure it is no number.
    fn default() -> Self {
        Self { value: f64::NAN, at: String::new(), least: false }
    }
}

impl Worst {
    /// The least.
    pub fn least() -> Self {
        Self { least: true, ..Self::default() }
    }

    /// Takes a figure where none is beyond it.
    pub fn take(&mut self, value: f64, at: impl FnOnce() -> String) {
        let beyond = if self.least { value < self.value } else { value > self.value };
        if self.at.is_empty() || (!self.value.is_nan() && (value.is_nan() || beyond)) {
            (self.value, self.at) = (value, at());
            assert!(!self.at.is_empty(), "a figure without its input");
        }
    }

    /// Takes the extreme of another.
    pub fn merge(&mut self, other: Self) {
        if !other.at.is_empty() {
            self.take(other.value, || other.at);
        }
    }

    /// The figure itself.
    pub fn value(&self) -> f64 {
        self.value
    }
}

impl<T: Into<String>> From<(f64, T)> for Worst {
    fn from((value, at): (f64, T)) -> Self {
        Self { value, at: at.into(), least: false }
    }
}

/// Position of a row: its case, the line of the test that adds it, and the number of calls of that line.
type Place = (u32, &'static str, u32, usize);
/// Cells of a row: subject and signals of its case, figure, value, input, bar.
type Row = [String; 6];

static ROWS: Mutex<BTreeMap<Place, Row>> = Mutex::new(BTreeMap::new());
static SECTIONS: Mutex<BTreeMap<&'static str, String>> = Mutex::new(BTreeMap::new());

impl Case {
    /// A figure that may not exceed its bar.
    #[track_caller]
    pub fn at_most(self, figure: &str, found: impl Into<Worst>, bar: f64, unit: &str) {
        let Worst { value, at, .. } = found.into();
        self.row(figure, &format!("{} {unit}", short(value)), &at, &format!("≤ {} {unit}", short(bar)));
        assert!(value <= bar, "case {}, {figure}: {value} {unit} at {at}, at most {bar}", self.number);
    }

    /// A figure that must reach its bar.
    #[track_caller]
    pub fn at_least(self, figure: &str, found: impl Into<Worst>, bar: f64, unit: &str) {
        let Worst { value, at, .. } = found.into();
        self.row(figure, &format!("{} {unit}", short(value)), &at, &format!("≥ {} {unit}", short(bar)));
        assert!(value >= bar, "case {}, {figure}: {value} {unit} at {at}, at least {bar}", self.number);
    }

    /// A figure that must be within `room` of what theory says.
    #[track_caller]
    pub fn near(self, figure: &str, found: impl Into<Worst>, theory: f64, room: f64, unit: &str) {
        let Worst { value, at, .. } = found.into();
        let bar = format!("{} ± {} {unit}", short(theory), short(room));
        self.row(figure, &format!("{} {unit}", short(value)), &at, &bar);
        let apart = (value - theory).abs();
        assert!(apart <= room, "case {}, {figure}: {value} {unit} at {at}, {theory} ± {room}", self.number);
    }

    /// Adds a row that `held` of `of` cases kept the law; all have to.
    #[track_caller]
    pub fn all(self, figure: &str, held: usize, of: usize) {
        self.row(figure, &format!("{held} of {of}"), "", &format!("{of} of {of}"));
        assert!(held == of && of > 0, "case {}, {figure}: {held} of {of}", self.number);
    }

    /// Adds a row for an event that may not happen at all.
    #[track_caller]
    pub fn none(self, figure: &str, count: usize) {
        self.row(figure, &count.to_string(), "", "0");
        assert!(count == 0, "case {}, {figure}: {count}, none expected", self.number);
    }

    /// Rows of a case stand in the order of the lines that tell them: tests in parallel change nothing.
    #[track_caller]
    fn row(self, figure: &str, value: &str, at: &str, bar: &str) {
        let caller = Location::caller();
        let mut rows = ROWS.lock().unwrap_or_else(|broken| broken.into_inner());
        let line = (self.number, caller.file(), caller.line());
        let told = rows.range((line.0, line.1, line.2, 0)..=(line.0, line.1, line.2, usize::MAX)).count();
        let texts = [self.subject, self.signals, figure, value.trim_end(), at, bar.trim_end()].map(str::to_owned);
        rows.insert((line.0, line.1, line.2, told), texts);
        write(&rows);
    }
}

/// Adds a section after the table.
pub fn section(title: &'static str, text: String) {
    SECTIONS.lock().unwrap_or_else(|broken| broken.into_inner()).insert(title, text);
    write(&ROWS.lock().unwrap_or_else(|broken| broken.into_inner()));
}

/// Path of the report, if it is requested.
pub fn report() -> Option<PathBuf> {
    std::env::var_os("GNSS_TWIN_WRITE_STABILITY").map(PathBuf::from)
}

/// True if the run may take minutes.
pub fn long() -> bool {
    std::env::var_os("GNSS_TWIN_LONG").is_some()
}

/// Number of random cases that a run draws.
pub fn cases(short: u32, long_run: u32) -> u32 {
    if long() { long_run } else { short }
}

fn short(value: f64) -> String {
    let size = value.abs();
    if value == 0.0 {
        "0".to_owned()
    } else if !(1e-3..1e5).contains(&size) {
        format!("{value:.1e}")
    } else if size >= 100.0 || value.fract() == 0.0 {
        format!("{value:.0}")
    } else {
        let digits = if size >= 10.0 {
            1
        } else if size >= 1.0 {
            2
        } else {
            4
        };
        format!("{value:.digits$}")
    }
}

fn write(rows: &BTreeMap<Place, Row>) {
    let Some(path) = report() else { return };
    let mut text = String::from(
        "# Stability at the edges\n\nEach case with the signals that it ran on and the figure that its test measured \
         beside its bar; where a figure is the worst of many, \"at\" is the input that makes it. \"none\" are cases of \
         positions, orbits, loops and sums, which know no signal. Filled by\n\n\
         ```\nGNSS_TWIN_WRITE_STABILITY=$PWD/reports/stability.md cargo test --test extremes\n```\n\n\
         in one run; `bash .ci/long` does the same with a thousand random scenes (`GNSS_TWIN_LONG=1`). A figure that \
         misses its bar fails its test.\n",
    );
    let (mut family, mut last) = ("", (0, "", ""));
    for ((number, ..), [subject, signals, figure, value, at, bar]) in rows {
        let now = FAMILIES.iter().rev().find(|(first, _)| first <= number).map_or("", |(_, name)| *name);
        if now != family {
            let _ = write!(
                text,
                "\n## {now}\n\n| case | subject | signals | figure | measured | at | bar |\n\
                 | --- | --- | --- | --- | --- | --- | --- |\n"
            );
            family = now;
        }
        let same = last.0 == *number && last.1 == subject;
        let head = if same { String::new() } else { number.to_string() };
        let subject_text = if same { "" } else { subject };
        let signals_text = if same && last.2 == signals { "" } else { signals };
        let _ = writeln!(text, "| {head} | {subject_text} | {signals_text} | {figure} | {value} | {at} | {bar} |");
        last = (*number, subject, signals);
    }
    for (title, body) in SECTIONS.lock().unwrap_or_else(|broken| broken.into_inner()).iter() {
        let _ = write!(text, "\n## {title}\n\n{body}");
    }
    std::fs::write(path, text).unwrap();
}

#[test]
fn the_worst_keeps_its_input_and_what_is_no_number_is_the_worst() {
    let worst = |values: &[f64], mut of: Worst| {
        values.iter().for_each(|value| of.take(*value, || format!("{value}")));
        (of.at, of.value)
    };
    assert_eq!(worst(&[1.0, 3.0, 3.0, 2.0], Worst::default()), ("3".to_owned(), 3.0));
    assert_eq!(worst(&[-1.0, -3.0, 2.0], Worst::least()), ("-3".to_owned(), -3.0));
    assert!(worst(&[1.0, f64::NAN, 2.0], Worst::default()).1.is_nan());
    assert!(worst(&[f64::NAN, 2.0], Worst::least()).1.is_nan());
    assert!(worst(&[], Worst::default()).1.is_nan());
    assert_eq!(ALL, format!("all {}", gnss::signal::SIGNALS.len()));
}
