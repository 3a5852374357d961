//! The end of a run's report: every figure of `summary.json` with its meaning, and how figures and limits
//! come about.

use serde_json::Value;

use crate::judge::judgement::number;
use crate::judge::schema;
use crate::measure::errors::{PULL_IN_S, SLIP_CYCLES};
use crate::show::document::{Report, Side, Table};
use crate::show::plot::Judged;

/// Adds both.
pub(super) fn add(report: &mut Report, judged: &Judged<'_>) {
    report.heading("How the figures were made");
    for paragraph in paragraphs() {
        report.text(paragraph);
    }
    report.heading("Every figure of summary.json");
    let columns = [("path", Side::Left), ("value", Side::Right), ("unit", Side::Left), ("meaning", Side::Left)];
    let mut table =
        Table::new("The same names serve as keys of a file of limits (gnss-twin analyze --check).", columns);
    let summary = serde_json::to_value(judged.summary).unwrap_or(Value::Null);
    for leaf in schema::leaves() {
        let value = match schema::find(&summary, &leaf.path) {
            None => continue,
            Some(Value::Null) => "–".to_owned(),
            Some(Value::String(text)) => text.clone(),
            Some(value) => value.as_f64().map_or_else(|| value.to_string(), number),
        };
        table.row([leaf.path.clone(), value, leaf.unit.clone(), leaf.meaning.clone()]);
    }
    report.table(table);
}

fn paragraphs() -> [String; 6] {
    [
        "Truth and estimate. The generator writes what it put into the samples; the receiver, which sees samples \
         alone, writes what it found. Both are joined on the number of the sample, the satellite and the signal. \
         Every error is estimate minus truth. Code errors are positive when the code is measured late."
            .to_owned(),
        format!(
            "Carrier. A receiver knows its carrier up to a constant, so the multiple of half a cycle nearest to the \
             median is removed from each uninterrupted arc. A jump of {SLIP_CYCLES} cycles or more that stays is a \
             cycle slip whether the receiver declared it or not."
        ),
        format!(
            "Loops. Jitter is the standard deviation of the error of the closed loop (not of the raw discriminator), \
             each satellite about its own mean, without the first {PULL_IN_S} s of every lock. Thresholds are the \
             rules of thumb of Kaplan and Hegarty, Understanding GPS, 2nd ed., 5.6: σ of a phase loop up to 15° (3σ \
             up to 45°), of a code loop up to d/6 chips at an early-late spacing d, of a frequency loop up to \
             1/(12T) at an integration time T. They are conservative; where a loop really lets go depends on its \
             settings."
        ),
        "C/N0. What is expected of a satellite is what the scene sets, less the power of the other satellites' codes \
         and of interference, weighted with their spectral separation from the signal (Betz, NAVIGATION 48(4), \
         2001). The quantiser's loss is not subtracted."
            .to_owned(),
        "Position. Limits of the verdict follow from truth and settings alone: the C/N0 that the scene gives each \
         satellite, the geometry, the loops and the smoothing, with known biases taken out. Nothing that the \
         receiver says of its own quality enters; its stated sigmas are held against the same theory, on both sides. \
         Ellipses in the picture are those of the errors found."
            .to_owned(),
        "Spectrum and clock. The spectrum is Welch's estimate with a Hann window and half overlap. Deviations of the \
         clock follow NIST Special Publication 1065 (Riley 2008), with intervals of 95 % from equivalent degrees of \
         freedom. Code noise alone would give √3·TDOP·σ/(c·τ) if it were white."
            .to_owned(),
    ]
}
