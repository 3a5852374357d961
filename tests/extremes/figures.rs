//! Figures beside their bars: asserted here, and written where the environment asks for it.

use std::collections::BTreeMap;
use std::fmt::Write;
use std::path::PathBuf;
use std::sync::Mutex;

/// A case of the list and where it belongs.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Case {
    pub number: u32,
    pub subject: &'static str,
}

/// Shorthand for a case.
pub const fn case(number: u32, subject: &'static str) -> Case {
    Case { number, subject }
}

/// Families by the number of their first case.
const FAMILIES: [(u32, &str); 9] = [
    (1, "Time"),
    (8, "Orbit"),
    (13, "Geometry"),
    (23, "Dynamics"),
    (29, "Sampling"),
    (34, "Power, quantiser, interference"),
    (44, "Arithmetic"),
    (47, "Loops"),
    (53, "Beyond the list"),
];

/// Figure, value and bar of each row, by number of case and order within it.
type Rows = BTreeMap<(u32, usize), (Case, [String; 3])>;

static ROWS: Mutex<Rows> = Mutex::new(BTreeMap::new());
static SECTIONS: Mutex<BTreeMap<&'static str, String>> = Mutex::new(BTreeMap::new());

impl Case {
    /// A figure that may not exceed its bar.
    #[track_caller]
    pub fn at_most(self, figure: &str, value: f64, bar: f64, unit: &str) {
        self.row(figure, format!("{} {unit}", short(value)), format!("≤ {} {unit}", short(bar)));
        assert!(value <= bar, "case {}, {figure}: {value} {unit}, at most {bar}", self.number);
    }

    /// A figure that must reach its bar.
    #[track_caller]
    pub fn at_least(self, figure: &str, value: f64, bar: f64, unit: &str) {
        self.row(figure, format!("{} {unit}", short(value)), format!("≥ {} {unit}", short(bar)));
        assert!(value >= bar, "case {}, {figure}: {value} {unit}, at least {bar}", self.number);
    }

    /// A figure that must be within `room` of what theory says.
    #[track_caller]
    pub fn near(self, figure: &str, value: f64, theory: f64, room: f64, unit: &str) {
        self.row(figure, format!("{} {unit}", short(value)), format!("{} ± {} {unit}", short(theory), short(room)));
        assert!((value - theory).abs() <= room, "case {}, {figure}: {value} {unit}, {theory} ± {room}", self.number);
    }

    /// So many of so many kept to the law.
    #[track_caller]
    pub fn all(self, figure: &str, held: usize, of: usize) {
        self.row(figure, format!("{held} of {of}"), format!("{of} of {of}"));
        assert!(held == of && of > 0, "case {}, {figure}: {held} of {of}", self.number);
    }

    fn row(self, figure: &str, value: String, bar: String) {
        let mut rows = ROWS.lock().unwrap_or_else(|broken| broken.into_inner());
        let order = rows.keys().filter(|(number, _)| *number == self.number).count();
        let texts = [figure.to_owned(), value.trim_end().to_owned(), bar.trim_end().to_owned()];
        rows.insert((self.number, order), (self, texts));
        write(&rows);
    }
}

/// Adds a section after the table.
pub fn section(title: &'static str, text: String) {
    SECTIONS.lock().unwrap_or_else(|broken| broken.into_inner()).insert(title, text);
    write(&ROWS.lock().unwrap_or_else(|broken| broken.into_inner()));
}

/// Where the report goes, if it is asked for.
pub fn report() -> Option<PathBuf> {
    std::env::var_os("GNSS_TWIN_WRITE_STABILITY").map(PathBuf::from)
}

/// Whether the run may take minutes.
pub fn long() -> bool {
    std::env::var_os("GNSS_TWIN_LONG").is_some()
}

/// How many random cases a run draws.
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

fn write(rows: &BTreeMap<(u32, usize), (Case, [String; 3])>) {
    let Some(path) = report() else { return };
    let mut text = String::from(
        "# Stability at the edges\n\nEach case with the figure that its test measured beside its bar. Filled by\n\n\
         ```\nGNSS_TWIN_WRITE_STABILITY=$PWD/reports/stability.md cargo test --test extremes\n```\n\n\
         in one run; `bash .ci/long` does the same with a thousand random scenes (`GNSS_TWIN_LONG=1`). A figure that \
         misses its bar fails its test.\n",
    );
    let mut family = "";
    let mut last = 0;
    for ((number, _), (case, [figure, value, bar])) in rows {
        let now = FAMILIES.iter().rev().find(|(first, _)| first <= number).map_or("", |(_, name)| *name);
        if now != family {
            let _ = write!(
                text,
                "\n## {now}\n\n| case | subject | figure | measured | bar |\n| --- | --- | --- | --- | --- |\n"
            );
            family = now;
        }
        let (number_text, subject) =
            if *number == last { (String::new(), "") } else { (number.to_string(), case.subject) };
        last = *number;
        let _ = writeln!(text, "| {number_text} | {subject} | {figure} | {value} | {bar} |");
    }
    for (title, body) in SECTIONS.lock().unwrap_or_else(|broken| broken.into_inner()).iter() {
        let _ = write!(text, "\n## {title}\n\n{body}");
    }
    std::fs::write(path, text).unwrap();
}
