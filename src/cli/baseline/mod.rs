//! `baseline`: position of one receiver relative to another by double differences, judged by their truths.

pub mod args;

use std::fmt::Write;
use std::fs;
use std::path::Path;

use serde_json::{Value, json};

use crate::cli::baseline::args::Baseline as Arguments;
use crate::cli::error::CliError;
use crate::cli::staging::Staging;
use analysis::judge::judgement::{Bound, Judgement, MARGINAL_SHARE, Status};
use rtk::error::RtkError;
use rtk::integers::Belief;
use rtk::judge::{Figures, ON_TWO_BANDS};
use rtk::pairs::Choice;
use rtk::run::{BasePosition, Baseline, Inputs, baseline};
use rtk::solver::Settings;

/// Largest error of the horizontal baseline, and of its height, that carriers leave at short distances.
const LARGEST_M: [f64; 2] = [0.003, 0.006];
/// Error that a kilometre of distance adds to both: atmosphere that the two receivers do not share.
const LARGEST_PER_KM_M: f64 = 0.001;
/// Longest time to the first fix.
const LONGEST_S: f64 = 60.0;
/// Least share of fixed epochs after the first fix.
const LEAST_FIXED: f64 = 0.9;
/// Largest error of the base's position where the truth is known.
const LARGEST_BASE_M: f64 = 0.01;
/// Largest distance of the base's position from the mean of its own fixes, which the ionosphere moves.
const LARGEST_FROM_FIXES_M: f64 = 30.0;
/// Ionosphere between the receivers that leaves integers of L1 open: a quarter of its wavelength.
const OPEN_IONOSPHERE_M: f64 = 0.05;

/// Finds the baseline, writes its tables if a directory is named, and prints figures and verdict.
pub fn execute(arguments: &Arguments) -> Result<(), CliError> {
    let staging = arguments.out.as_deref().map(Staging::directory).transpose()?;
    let inputs = Inputs {
        base: arguments.base.clone(),
        rover: arguments.rover.clone(),
        navigation: arguments.navigation.clone(),
        choice: Choice { signals: arguments.signals.iter().copied().collect() },
        position: match arguments.base_position {
            Some(given) => BasePosition::Given(given.to_ecef()),
            None if arguments.moving_base => BasePosition::Codes,
            None => BasePosition::Truth,
        },
    };
    let settings = Settings {
        mask_rad: arguments.mask_deg.to_radians(),
        belief: Belief { ratio: arguments.ratio, success_rate: arguments.success_rate },
        is_static: arguments.is_static,
        ionosphere: 1e-6 * arguments.ionosphere_ppm,
        ..Settings::default()
    };
    let found = baseline(&inputs, settings).map_err(rtk_error)?;
    let excuse = excuse(&found.figures, settings.ionosphere);
    let verdict = judgements(&found, inputs.position, excuse.is_none());
    let mut text = words(&found) + &verdict_lines(&verdict);
    if let Some(why) = &excuse {
        let _ = writeln!(text, "not judged    {why}");
    }
    let mut object = object(&found, &verdict, excuse.as_deref());
    if let (Some(staging), Some(out)) = (staging, &arguments.out) {
        write(staging.path(), &found, &verdict, &object)?;
        staging.commit()?;
        let _ = writeln!(text, "results in {}", out.display());
        object["results"] = json!(out);
    }
    arguments.printed.results(&text, || object)?;
    let failed = verdict.iter().filter(|row| row.status == Status::Fail).count();
    if arguments.check && failed > 0 {
        return Err(CliError::check(format!("{failed} of {} limits of the baseline are broken", verdict.len())));
    }
    Ok(())
}

fn rtk_error(error: RtkError) -> CliError {
    match &error {
        RtkError::Read { path, source } => CliError::read(path.display(), source),
        RtkError::NoPosition { .. } => CliError::usage(error),
        _ => CliError::input(error),
    }
}

/// Figures against their limits, those of fixes only where fixes are due. Without a truth, what a receiver
/// can know itself is judged alone.
fn judgements(found: &Baseline, position: BasePosition, is_due: bool) -> Vec<Judgement> {
    let figures = &found.figures;
    let mut rows = Vec::new();
    let mut judge = |figure: &str, value: Value, unit: &str, bound: Bound, source: &str| {
        rows.push(Judgement::new(figure, value, unit, bound, MARGINAL_SHARE, source));
    };
    let count = |count: usize| json!(count);
    if found.is_judged && is_due {
        let far_m = LARGEST_PER_KM_M * figures.length_m.unwrap_or(0.0) / 1000.0;
        let source = "carriers at short distances: 3 mm and 6 mm, and 1 mm a kilometre";
        judge("horizontal error, rms", json!(figures.horizontal_rms_m), "m", Bound::Max(LARGEST_M[0] + far_m), source);
        judge("vertical error, rms", json!(figures.up_rms_m), "m", Bound::Max(LARGEST_M[1] + far_m), source);
    }
    if found.is_judged {
        let allowed = allowed_wrong(figures.expected_wrong);
        let source = "success rates of bootstrapping, a lower bound for least squares";
        judge("fixes with a wrong integer", count(figures.wrong_fixes), "", Bound::Max(allowed), source);
    }
    if is_due {
        judge("time to the first fix", json!(figures.first_fix_s), "s", Bound::Max(LONGEST_S), "one band");
    }
    if is_due && figures.on_two_bands > 0 {
        let source = format!("{ON_TWO_BANDS} satellites on two bands fix once their success rate allows it");
        let due = Bound::Max(figures.first_allowed_two_bands_s.unwrap_or(0.0));
        judge("time to it on two bands", json!(figures.first_fix_two_bands_s), "s", due, &source);
    }
    if figures.allowed > 0 {
        let share = figures.allowed_fixed as f64 / figures.allowed as f64;
        let source = "integers whose success rate is the one asked for are those of a fix";
        judge("epochs fixed of those that may be", json!(share), "", Bound::Min(LEAST_FIXED), source);
    }
    if figures.outages > 0 {
        let source = "as the first fix, on one band";
        judge("time to the fix after an outage", json!(figures.longest_refix_s), "s", Bound::Max(LONGEST_S), source);
        let source = "what was lost comes back";
        judge("outages without a fix after them", count(figures.outages_without_fix), "", Bound::Max(0.0), source);
    }
    if is_due {
        judge("epochs fixed from there on", json!(figures.fix_rate), "", Bound::Min(LEAST_FIXED), "continuity");
    }
    judge("slips that were not announced", count(figures.slips), "", Bound::Max(0.0), "receivers say what they lose");
    let source = "receivers resolve half cycles or say that they may be missing";
    judge("ambiguities that are not whole", count(figures.not_whole.len()), "", Bound::Max(0.0), source);
    if let Some(off_m) = figures.base_off_m {
        let (most_m, source) = match position {
            BasePosition::Codes => (LARGEST_FROM_FIXES_M, "single positions, with the ionosphere's error"),
            BasePosition::Truth | BasePosition::Given(_) => (LARGEST_BASE_M, "survey of the base"),
        };
        judge("base off its true position", json!(off_m), "m", Bound::Max(most_m), source);
    }
    if let Some(off_m) = found.base_from_fixes_m {
        let source = "single positions, with the ionosphere's error";
        judge("base off its own fixes", json!(off_m), "m", Bound::Max(LARGEST_FROM_FIXES_M), source);
    }
    rows
}

/// The reason for which no fix is due: none came, the ionosphere that the settings expect is larger than what
/// integers can do with, and in no epoch did their success rate reach the one asked for.
fn excuse(figures: &Figures, ionosphere: f64) -> Option<String> {
    let (most, length_m) = figures.most_success_rate.zip(figures.length_m)?;
    let expected_m = ionosphere * length_m;
    let is_open = figures.first_fix_s.is_none() && figures.allowed == 0 && expected_m >= OPEN_IONOSPHERE_M;
    is_open.then(|| {
        format!(
            "fixes, their error and their time: with {expected_m:.2} m of ionosphere expected between the receivers, \
             the success rate of all integers is {most:.4} at most"
        )
    })
}

/// Wrong fixes that are no surprise: the expected number and three deviations of it, whole.
fn allowed_wrong(expected: f64) -> f64 {
    (expected + 3.0 * expected.sqrt()).floor()
}

fn words(found: &Baseline) -> String {
    let Figures { epochs, solved, fixed, partial, float, .. } = found.figures;
    let figures = &found.figures;
    let millimetres =
        |value_m: Option<f64>| value_m.map_or_else(|| "none".to_owned(), |m| format!("{:.1}", 1000.0 * m));
    let seconds = |value_s: Option<f64>| value_s.map_or_else(|| "never".to_owned(), |s| format!("after {s:.1} s"));
    let mut text = String::new();
    let none = epochs - solved;
    let _ = writeln!(text, "epochs        {epochs}: {fixed} fixed, {partial} in part, {float} float, {none} without");
    if let Some(length_m) = figures.length_m {
        let _ = writeln!(text, "baseline      {length_m:.3} m");
    }
    let _ = writeln!(text, "first fix     {}", seconds(figures.first_fix_s));
    if found.is_judged {
        let [east, north, up] = [figures.east_rms_m, figures.north_rms_m, figures.up_rms_m].map(millimetres);
        let _ = writeln!(text, "error         east {east}, north {north}, up {up} mm rms while fixed");
        let Figures { integers_right, integers_wrong, integers_not_fixed, expected_wrong, wrong_fixes, .. } =
            found.figures;
        let _ = writeln!(
            text,
            "integers      {integers_right} right, {integers_wrong} wrong, {integers_not_fixed} not fixed; \
             {wrong_fixes} wrong fixes of {}, {expected_wrong:.2e} expected at most",
            figures.judged
        );
    }
    if figures.outages > 0 {
        let again = match figures.longest_refix_s {
            Some(most_s) => format!("fixed again {most_s:.1} s after the first solution at most"),
            None => "never fixed again".to_owned(),
        };
        let _ = writeln!(text, "outages       {}: {again}", figures.outages);
    }
    if let Some(ratio) = figures.least_ratio {
        let _ = writeln!(text, "ratio         {ratio:.1} at least");
    }
    let _ = writeln!(text, "slips         {} announced, {} found", figures.announced_slips, figures.slips);
    if !figures.not_whole.is_empty() {
        let _ = writeln!(text, "not whole     {}: half a cycle is missing", figures.not_whole.join(", "));
    }
    text
}

fn verdict_lines(verdict: &[Judgement]) -> String {
    let line = |row: &Judgement| {
        format!(
            "verdict       {:<8} {}: {} {}, {}\n",
            row.status.word(),
            row.figure,
            row.value_text(),
            row.unit,
            row.bound
        )
    };
    verdict.iter().map(|row| line(row).replace(" ,", ",")).collect()
}

fn object(found: &Baseline, verdict: &[Judgement], excuse: Option<&str>) -> Value {
    let rows = verdict.iter().map(|row| {
        json!({
            "figure": row.figure,
            "value": row.value,
            "unit": row.unit,
            "limit": row.bound.to_string(),
            "status": row.status,
        })
    });
    json!({
        "figures": found.figures,
        "base_from_fixes_m": found.base_from_fixes_m,
        "verdict": rows.collect::<Vec<_>>(),
        "not_judged": excuse,
    })
}

/// Writes the table of the epochs, that of the verdict, and the figures.
fn write(directory: &Path, found: &Baseline, verdict: &[Judgement], object: &Value) -> Result<(), CliError> {
    let table = directory.join("baseline.csv");
    let bug = |error: csv::Error| CliError::bug(error);
    let mut rows = csv::Writer::from_writer(Vec::new());
    found.rows.iter().try_for_each(|row| rows.serialize(row)).map_err(bug)?;
    let mut judged = csv::Writer::from_writer(Vec::new());
    judged.write_record(["figure", "value", "unit", "limit", "status", "source"]).map_err(bug)?;
    for row in verdict {
        let cells =
            [&row.figure, &row.value.to_string(), &row.unit, &row.bound.to_string(), row.status.word(), &row.source];
        judged.write_record(cells).map_err(bug)?;
    }
    let whole = |rows: csv::Writer<Vec<u8>>| rows.into_inner().map_err(CliError::bug);
    let put =
        |path: &Path, bytes: Vec<u8>| fs::write(path, bytes).map_err(|error| CliError::output(path.display(), &error));
    put(&table, whole(rows)?)?;
    put(&directory.join("verdict.csv"), whole(judged)?)?;
    put(&directory.join("baseline.json"), format!("{object:#}\n").into_bytes())
}
