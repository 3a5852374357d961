//! The page `reports/detection.md` and its table.

use std::fmt::Write;
use std::path::Path;

use gnss::record::Detector;

use super::runs::Found;
use super::scenes::{ATTACKS, CLEAN, Case, ON_S};
use super::share::{Share, share};
use super::{machine, picture, roc};

/// Probability of a false alarm that the receiver states by default.
pub const STATED: f64 = 1e-3;
/// Share of the times to detect up to which the page states them.
const PERCENTILE: f64 = 0.95;
/// Shares below are none.
const NONE: f64 = 1e-9;
/// Name of the clean time of attacks, in which there are samples.
const BEFORE: &str = "static, samples";

/// Runs of some cases in which a detector tested.
pub fn of(found: &[Found], detector: Detector, is_own: impl Fn(&Case) -> bool) -> Vec<&Found> {
    found.iter().filter(|one| one.detector == detector && is_own(&one.case)).collect()
}

/// False alarms of a detector in these runs.
pub fn false_alarms(rows: &[&Found]) -> Option<Share> {
    let tests: f64 = rows.iter().map(|one| one.line.clean_tests as f64).sum();
    let independent: f64 = rows.iter().map(|one| one.line.independent_tests).sum();
    let counts: Vec<_> = rows.iter().map(|one| (one.line.false_alarms, one.line.clean_tests)).collect();
    share(&counts, (tests / independent).max(1.0))
}

/// Attacked tests with an alarm of a detector in these runs.
pub fn detections(rows: &[&Found]) -> Option<Share> {
    let counts: Vec<_> = rows.iter().map(|one| (one.line.attacked_alarms, one.line.attacked_tests)).collect();
    share(&counts, 1.0)
}

/// Statistics of these runs over their thresholds: clean and attacked ones.
pub fn ratios(rows: &[&Found]) -> (Vec<f32>, Vec<f32>) {
    let clean = rows.iter().flat_map(|one| one.clean.iter().copied()).collect();
    (clean, rows.iter().flat_map(|one| one.attacked.iter().copied()).collect())
}

fn short(value: f64) -> String {
    if value < NONE { "0".to_owned() } else { format!("{value:.1e}") }
}

/// False alarms in words; bold where the interval lies above what is stated.
fn words(share: Option<Share>) -> String {
    share.map_or("–".to_owned(), |Share { count, all, value, low, high }| {
        let seen = format!("{count} of {all}: {} ({} to {})", short(value), short(low), short(high));
        if low > STATED { format!("**{seen}**") } else { seen }
    })
}

/// A row of cells.
fn row(text: &mut String, name: &str, cells: impl Iterator<Item = String>) {
    let cells: Vec<String> = cells.collect();
    let _ = writeln!(text, "| {name} | {} |", cells.join(" | "));
}

fn head<'a>(text: &mut String, first: &str, names: impl Iterator<Item = &'a str> + Clone) {
    row(text, first, names.clone().map(str::to_owned));
    row(text, "---", names.map(|_| "---".to_owned()));
}

/// Writes the page from all runs.
pub fn write(directory: &Path, found: &[Found]) {
    let starts = |case: &Case| {
        let mut seeds: Vec<u64> =
            found.iter().filter(|one| one.case.name == case.name).map(|one| one.line.seed).collect();
        seeds.sort_unstable();
        seeds.dedup();
        seeds.len()
    };
    let (clean, attacked) = (starts(&CLEAN[0]), starts(&ATTACKS[0]));
    let mut text = format!(
        "# Detectors of jamming and spoofing\n\n\
         False alarms of the nine detectors of `[receiver.detection]` against the probability that they state, and \
         what they detect of attacks. `cargo bench --bench detection` makes this page, its table and its picture.\n\n\
         {}.\n\n\
         The receiver has the settings of detection that it has by default: {} a test, one test a second, a reference \
         of 20 s. There is no atmosphere. Times and positions are drawn: of 2010-07-01 for GPS L1 C/A, and for two \
         systems (with Galileo E1) of 2020-11-29 over the Western Mediterranean.\n\n\
         ![False alarms, ROC curves and detections](detection.png)\n\n",
        machine::machine(),
        short(STATED)
    );
    clean_tables(&mut text, found, clean);
    attack_tables(&mut text, found, attacked);
    std::fs::write(directory.join("detection.md"), text).unwrap();
    let mut file = csv::Writer::from_path(directory.join("detection.csv")).unwrap();
    found.iter().for_each(|one| file.serialize(&one.line).unwrap());
    file.flush().unwrap();
    picture::draw(&directory.join("detection.png"), found);
}

/// Name of a column, and whether a run belongs to it.
pub type Column = (&'static str, fn(&Case, &str) -> bool);

/// Columns of scenes without an attack.
pub fn columns() -> Vec<Column> {
    let mut all: Vec<Column> =
        CLEAN.iter().map(|case| (case.name, (|case: &Case, name: &str| case.name == name) as _)).collect();
    all.push((BEFORE, |case, _| !case.kind.is_clean()));
    all
}

fn clean_tables(text: &mut String, found: &[Found], starts: usize) {
    let _ = write!(
        text,
        "## False alarms\n\n\
         Scenes without an attack are run from {starts} starts each, four minutes at the level of correlations, at \
         which there are no samples and no tests of the level. The last column has the {:.0} s before each \
         attack, at the level of samples. Multipath: a pedestrian between two walls (amplitudes 0.4 and 0.3, 8 \
         to 30 m away) over wet ground. Scintillation: four satellites with S4 = 0.7, decorrelated after 0.8 s. \
         Dynamics: a rocket with 22.9 g for 5 s. Oscillator: a TCXO after Winkel's table, half a ppm off.\n\n\
         A cell has alarms of all tests, their share and its interval (95 %): the exact one of as many independent \
         tests as the scatter between starts and the autocorrelation of the statistic leave. It is bold where the \
         whole interval lies above the stated {}.\n\n",
        ON_S,
        short(STATED)
    );
    let columns = columns();
    head(text, "detector", columns.iter().map(|(name, _)| *name));
    for detector in Detector::ALL {
        let cell = |(name, is_own): &(&str, fn(&Case, &str) -> bool)| {
            words(false_alarms(&of(found, detector, |case| is_own(case, name))))
        };
        row(text, &format!("`{}`", detector.name()), columns.iter().map(cell));
    }
    let mut shares: Vec<Share> = Vec::new();
    for (name, is_own) in &columns {
        let share = |detector: &Detector| false_alarms(&of(found, *detector, |case| is_own(case, name)));
        shares.extend(Detector::ALL.iter().filter_map(share));
    }
    let kept = shares.iter().filter(|share| share.low <= STATED).count();
    let _ = writeln!(
        text,
        "\nIn {kept} of {} pairs of a detector and a scene the stated probability is not refuted.",
        shares.len()
    );
    text.push_str(
        "\nAlarms an hour. Tests of single signals are as many a second as there are signals, so that a detector of \
         signals with the stated probability has nine times the 3.6 an hour of one of the receiver under nine \
         satellites.\n\n",
    );
    head(text, "detector", columns.iter().map(|(name, _)| *name));
    for detector in Detector::ALL {
        let cell = |(name, is_own): &(&str, fn(&Case, &str) -> bool)| {
            let rows = of(found, detector, |case| is_own(case, name));
            let clean_s: f64 = rows.iter().map(|one| one.line.clean_s).sum();
            let count: usize = rows.iter().map(|one| one.line.false_alarms).sum();
            if clean_s > 0.0 { format!("{:.1}", count as f64 / (clean_s / 3600.0)) } else { "–".to_owned() }
        };
        row(text, &format!("`{}`", detector.name()), columns.iter().map(cell));
    }
}

/// Value below which so large a share of sorted ones lies, by nearest rank.
fn percentile(sorted: &[f64], share: f64) -> f64 {
    sorted[((share * sorted.len() as f64).ceil() as usize).clamp(1, sorted.len()) - 1]
}

fn attack_tables(text: &mut String, found: &[Found], starts: usize) {
    let _ = write!(
        text,
        "\n## Attacks\n\n\
         Attacks begin after {ON_S:.0} s and last to the end: 20 s of jammers, 45 s of spoofers. Each is run from \
         {starts} starts at the level of samples, because the level of correlations models neither. Satellites have \
         45 dB-Hz, to which J/S is relative; it is a mean over time. CW lies within 400 kHz, a chirp sweeps 2 \
         MHz in 20 to 500 µs, noise is 2 MHz wide, pulses of 10 µs come 1100 times a second.\n\n\
         Spoofers have power and push of scenarios of TEXBAT and are otherwise no copies: *like ds2* and *like ds3* \
         push time by 3 m/s from their beginning, *like ds4* begins on the true signals and after 5 s pushes the \
         position up to 3 m/s, *like ds7* grows within 10 s from −20 dB with the phases of the true signals and then \
         pushes the position up to 1 m/s. A spoofer's carrier follows its range, so nothing here is like the locked \
         frequency of ds3 and ds4. The meaconer sends what an antenna up to 110 m away receives, 100 to 300 m late, \
         with its noise.\n\n\
         ### Share of attacked tests with an alarm, at the stated false alarm\n\n"
    );
    let names = || Detector::ALL.iter().map(|detector| detector.name());
    let table = |text: &mut String, cell: &dyn Fn(&[&Found]) -> String| {
        head(text, "attack", names());
        for case in &ATTACKS {
            let cells = Detector::ALL.iter().map(|detector| cell(&of(found, *detector, |own| own.name == case.name)));
            row(text, case.name, cells);
        }
    };
    table(text, &|rows| {
        detections(rows).map_or("–".to_owned(), |own| format!("{:.2} ({:.2} to {:.2})", own.value, own.low, own.high))
    });
    text.push_str(
        "\nIn brackets: interval (95 %) by the scatter between starts.\n\n\
         ### Area under the ROC curve\n\n\
         0.5 of a detector that knows nothing; of tests of single intervals, against those before the attack.\n\n",
    );
    table(text, &|rows| {
        let (clean, attacked) = ratios(rows);
        roc::curve(&clean, &attacked).map_or("–".to_owned(), |(_, area)| format!("{area:.3}"))
    });
    let _ = write!(
        text,
        "\n### Time to the first alarm\n\n\
         Seconds: median, {:.0} % by nearest rank, and starts with an alarm. A start without an alarm counts as later \
         than all others. A false alarm counts too: one of nine satellites comes within 20 s in a sixth of all \
         starts.\n\n",
        100.0 * PERCENTILE
    );
    table(text, &|rows| {
        let all = rows.iter().filter(|one| one.line.attacked_tests > 0).count();
        let mut delays_s: Vec<f64> = (rows.iter().filter(|one| one.line.attacked_tests > 0))
            .map(|one| one.line.delay_s.unwrap_or(f64::INFINITY))
            .collect();
        if all == 0 {
            return "–".to_owned();
        }
        delays_s.sort_by(f64::total_cmp);
        let told = delays_s.iter().filter(|delay_s| delay_s.is_finite()).count();
        let seconds = |share: f64| {
            let delay_s = percentile(&delays_s, share);
            if delay_s.is_finite() { format!("{delay_s:.1}") } else { "none".to_owned() }
        };
        format!("{}, {}; {told} of {all}", seconds(0.5), seconds(PERCENTILE))
    });
}
