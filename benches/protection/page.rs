//! The page `reports/protection.md`, its table and its picture.

use std::fmt::Write;
use std::path::Path;

use analysis::measure::protection::{Protected, interval};
use analysis::show::plot::canvas::{Axis, BLUE, Chart, GREY, Mark, ORANGE, Series, figure};

use super::machine;
use super::runs::{CASES, Case, Counts, Found};

/// Promises of the scene: a false alarm, an error beyond its level without a fault or with a missed one.
const PROMISE: f64 = 1e-3;
/// Prior probability of a faulty satellite, by which a promise of ARAIM is divided where one is there.
const PRIOR: f64 = 1e-2;
/// Fixes that say as much as one independent fix at least: the noise of a code loop of 1 Hz, a fifth of a
/// second apart, has a correlation of exp(−4·0.2), so that (1 + ρ)/(1 − ρ) of them are one.
const DEPENDENT: f64 = 2.63;
/// Ends of the picture's axes, in metres.
const END_M: f64 = 30.0;

/// A share of fixes with the ends of its interval.
struct Share {
    count: usize,
    value: f64,
    low: f64,
    high: f64,
}

/// Share over all starts. Fixes of one start are not independent: they count as so many fewer as the scatter
/// between starts is larger than that of independent ones, and the interval is the exact one of these.
fn share(rows: &[&Counts], of: fn(&Counts) -> (usize, usize)) -> Option<Share> {
    let all: usize = rows.iter().map(|row| of(row).1).sum();
    let count: usize = rows.iter().map(|row| of(row).0).sum();
    if all == 0 {
        return None;
    }
    let value = count as f64 / all as f64;
    let squares = rows.iter().map(|row| of(row)).map(|(some, of)| (some as f64 - value * of as f64).powi(2));
    let starts = rows.len() as f64;
    let scatter = squares.sum::<f64>() * starts / (starts - 1.0).max(1.0);
    let alone = value * (1.0 - value) * all as f64;
    let fewer = if alone > 0.0 { (scatter / alone).max(DEPENDENT) } else { DEPENDENT };
    let (some, of) = ((count as f64 / fewer).round() as usize, (all as f64 / fewer).round() as usize);
    let (low, high) = interval(some, of);
    Some(Share { count, value, low: low.min(value), high: high.max(value) })
}

fn words(share: Option<Share>) -> String {
    share.map_or("–".to_owned(), |Share { count, value, low, high }| {
        format!("{count}: {} ({} to {})", short(value), short(low), short(high))
    })
}

fn short(value: f64) -> String {
    if value == 0.0 { "0".to_owned() } else { format!("{value:.1e}") }
}

/// Promised share of errors beyond a level.
fn promised(case: &Case) -> String {
    match (case.method, case.faults) {
        (_, 0) | ("raim", 1) => short(PROMISE),
        ("araim", 1) => {
            format!("{}, its {} over the fault's {}", short(PROMISE / PRIOR), short(PROMISE), short(PRIOR))
        }
        _ => "none".to_owned(),
    }
}

/// Promised share of false alarms: of the residual test, and for ARAIM of its tests in two axes too.
fn alarms(case: &Case) -> String {
    match (case.method, case.faults) {
        (_, 1..) => "–".to_owned(),
        ("araim", _) => format!("{} at most", short(3.0 * PROMISE)),
        _ => short(PROMISE),
    }
}

fn name(case: &Case) -> String {
    let faults = ["no fault", "one fault", "two faults"];
    format!("{}, {}", case.method.to_uppercase(), faults[case.faults])
}

/// Writes the page from all runs.
pub fn write(directory: &Path, found: &[Found]) {
    let starts = found.len() / CASES.len();
    let mut text = format!(
        "# Protection levels\n\n\
         Whether RAIM and ARAIM keep their promises. `cargo bench --bench protection` makes this page, its table and \
         its picture.\n\n\
         {}.\n\n\
         A receiver of GPS L1 C/A is at rest at {starts} drawn times and positions of 2010-07-01, at the level of \
         correlations. It has thermal noise and no other error, and its promises are so weak that they can be \
         refuted: a false alarm of {PROMISE:e}, a missed detection of {PROMISE:e}, and {PROMISE:e} for an error \
         beyond a level. A fault is a step of a satellite's clock by 0.5 to 6 m, from the beginning. Intervals (95 %) \
         are exact ones of as many independent fixes as the scatter between starts leaves.\n\n\
         ![Errors and levels](protection.png)\n\n",
        machine::machine()
    );
    let of = |case: &Case| -> Vec<&Counts> {
        let is_own = |one: &&Found| one.counts.method == case.method && one.counts.faults == case.faults;
        found.iter().filter(is_own).map(|one| &one.counts).collect()
    };
    text.push_str(
        "## Errors beyond their level\n\n\
         | case | fixes | beyond the horizontal level | beyond the vertical level | promised | mean levels (m) | \
         largest error over level |\n\
         | --- | --- | --- | --- | --- | --- | --- |\n",
    );
    for case in &CASES {
        let rows = of(case);
        let sum = |of: fn(&Counts) -> f64| rows.iter().map(|row| of(row)).sum::<f64>();
        let most = |of: fn(&Counts) -> f64| rows.iter().map(|row| of(row)).fold(0.0, f64::max);
        let _ = writeln!(
            text,
            "| {} | {} | {} | {} | {} | {:.1}, {:.1} | {:.2}, {:.2} |",
            name(case),
            rows.iter().map(|row| row.fixes).sum::<usize>(),
            words(share(&rows, |row| (row.horizontal_beyond, row.horizontal_levels))),
            words(share(&rows, |row| (row.vertical_beyond, row.vertical_levels))),
            promised(case),
            sum(|row| row.horizontal_level_sum_m) / sum(|row| row.horizontal_levels as f64),
            sum(|row| row.vertical_level_sum_m) / sum(|row| row.vertical_levels as f64),
            most(|row| row.horizontal_ratio_max),
            most(|row| row.vertical_ratio_max),
        );
    }
    text.push_str(
        "\nRAIM has no promise for two faults.\n\n\
         ## Tests\n\n\
         Share of fixes in which a test shows a fault. Without a fault it is the rate of false alarms: of the residual \
         test, and for ARAIM of its own tests too. Codes of GPS L1 C/A disturb each other where the Dopplers of two \
         satellites differ by whole kilohertz. This moves a range by up to a metre for seconds, which no covariance \
         has. So fixes are counted apart in which no two satellites are nearer than 5 Hz to that.\n\n\
         | case | all fixes | fixes without disturbance | promised |\n\
         | --- | --- | --- | --- |\n",
    );
    for case in &CASES {
        let rows = of(case);
        let _ = writeln!(
            text,
            "| {} | {} | {} of {} | {} |",
            name(case),
            words(share(&rows, |row| (row.detected, row.fixes))),
            words(share(&rows, |row| (row.detected_apart, row.fixes_apart))),
            rows.iter().map(|row| row.fixes_apart).sum::<usize>(),
            alarms(case),
        );
    }
    std::fs::write(directory.join("protection.md"), text).unwrap();
    let mut file = csv::Writer::from_path(directory.join("protection.csv")).unwrap();
    found.iter().for_each(|one| file.serialize(&one.counts).unwrap());
    file.flush().unwrap();
    draw(&directory.join("protection.png"), found);
}

/// Stanford diagrams of the cases with one fault, and of those without.
fn draw(path: &Path, found: &[Found]) {
    let chart = |method: &str| {
        let points = |faults: usize| -> Vec<(f64, f64)> {
            let own = found.iter().filter(|one| one.counts.method == method && one.counts.faults == faults);
            let point = |row: &Protected| row.vpl_m.map(|level_m| (row.vertical_m, level_m));
            let all = own.flat_map(|one| one.shown.iter().filter_map(point));
            all.filter(|(error_m, level_m)| error_m.max(*level_m) < END_M).collect()
        };
        let axis = |name: &str| Axis::new(name, (0.0, END_M));
        let series = vec![
            Series::new("one fault", ORANGE, Mark::Dots, points(1)),
            Series::new("no fault", BLUE, Mark::Dots, points(0)),
            Series::new("error = level", GREY, Mark::Line, vec![(0.0, 0.0), (END_M, END_M)]),
        ];
        let title = format!("{}, vertical", method.to_uppercase());
        Chart::new(title, axis("error (m)"), axis("protection level (m)"), series)
    };
    let legend = [
        Series::new("no fault", BLUE, Mark::Dots, Vec::new()),
        Series::new("one fault", ORANGE, Mark::Dots, Vec::new()),
        Series::new("error = level", GREY, Mark::Line, Vec::new()),
    ];
    figure(path, (1280, 640), 2, &[chart("raim"), chart("araim")], &legend).unwrap();
}
