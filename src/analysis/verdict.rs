//! What passed, what is marginal, what failed, and by how much.
//!
//! Every figure is held against one limit whose origin is stated: a threshold of theory, the receiver's own covariance, or a
//! user's file ([`super::limits`]). A figure within a tenth of its limit is marginal. A figure that a scene cannot have
//! is named with the reason why it is not judged. Limits: the thresholds are rules of thumb, not the points at which a
//! receiver fails; several figures of one run share their causes.

use serde::Serialize;
use serde_json::Value;

use crate::analysis::JudgeError;
use crate::analysis::errors::Errors;
use crate::analysis::load::Run;
use crate::analysis::summary::Summary;
use crate::analysis::theory::pll;
use crate::gnss::record::{Event, Fix};

/// Share of a limit below which what is left of it is marginal.
pub const MARGINAL_SHARE: f64 = 0.1;

/// What a figure is held against.
#[derive(Clone, Debug, PartialEq)]
pub enum Bound {
    Max(f64),
    Min(f64),
    Equals(Value),
}

impl std::fmt::Display for Bound {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Max(limit) => write!(f, "≤ {}", number(*limit)),
            Self::Min(limit) => write!(f, "≥ {}", number(*limit)),
            Self::Equals(value) => write!(f, "= {}", shown(value)),
        }
    }
}

/// How a figure came out.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Status {
    Pass,
    Marginal,
    Fail,
}

impl Status {
    /// In one word.
    pub fn word(self) -> &'static str {
        match self {
            Self::Pass => "pass",
            Self::Marginal => "marginal",
            Self::Fail => "FAIL",
        }
    }
}

/// One figure judged.
#[derive(Clone, Debug, PartialEq)]
pub struct Judgement {
    /// In words, or its path in `summary.json` where a user named it so.
    pub figure: String,
    /// Its path, if it has one.
    pub path: Option<String>,
    /// Null where the run has no such figure.
    pub value: Value,
    pub unit: String,
    pub bound: Bound,
    /// What is left of the limit as a share of it, negative beyond it; `None` where the limit is zero or no number.
    pub margin: Option<f64>,
    pub status: Status,
    /// Where the limit comes from.
    pub source: String,
}

impl Judgement {
    /// Holds a value against a bound; a value that is missing or not finite fails.
    pub fn new(figure: &str, value: Value, unit: &str, bound: Bound, marginal_share: f64, source: &str) -> Self {
        let measured = value.as_f64().filter(|number| number.is_finite());
        let left = |limit: f64, left: f64| (limit != 0.0).then(|| left / limit.abs());
        let (holds, margin) = match (&bound, measured) {
            (Bound::Max(limit), Some(measured)) => (measured <= *limit, left(*limit, limit - measured)),
            (Bound::Min(limit), Some(measured)) => (measured >= *limit, left(*limit, measured - limit)),
            (Bound::Equals(expected), _) => (same(&value, expected), None),
            (_, None) => (false, None),
        };
        let near = margin.is_some_and(|margin| margin < marginal_share);
        let status = match (holds, near) {
            (false, _) => Status::Fail,
            (true, true) => Status::Marginal,
            (true, false) => Status::Pass,
        };
        let (figure, unit, source) = (figure.to_owned(), unit.to_owned(), source.to_owned());
        Self { figure, path: None, value, unit, bound, margin, status, source }
    }

    fn at(mut self, path: &str) -> Self {
        self.path = Some(path.to_owned());
        self
    }

    /// The value in words.
    pub fn value_text(&self) -> String {
        shown(&self.value)
    }

    /// By how much it lies within its limit or beyond, in words.
    pub fn margin_text(&self) -> String {
        match (self.margin, &self.bound, self.value.as_f64()) {
            _ if self.value.is_null() => "no figure".to_owned(),
            (Some(margin), ..) if margin >= 0.0 => format!("{:.0} % left", 100.0 * margin),
            (Some(margin), ..) => format!("{:.0} % beyond", -100.0 * margin),
            (None, Bound::Max(limit) | Bound::Min(limit), Some(value)) if value != *limit => {
                format!("{} beyond", number((value - limit).abs()))
            }
            _ => String::new(),
        }
    }
}

/// Equal, numbers as numbers: 1 and 1.0 are the same.
fn same(value: &Value, expected: &Value) -> bool {
    match (value.as_f64(), expected.as_f64()) {
        (Some(value), Some(expected)) => value == expected,
        _ => value == expected,
    }
}

fn shown(value: &Value) -> String {
    match value {
        Value::Null => "none".to_owned(),
        Value::Number(one) => one.as_f64().map_or_else(|| one.to_string(), number),
        Value::String(text) => text.clone(),
        other => other.to_string(),
    }
}

/// Four significant digits, no trailing zeros.
pub(crate) fn number(value: f64) -> String {
    digits(value, 4)
}

/// That many significant digits, no trailing zeros.
pub(crate) fn digits(value: f64, digits: i32) -> String {
    if value == 0.0 || !value.is_finite() {
        return if value == 0.0 { "0".to_owned() } else { value.to_string() };
    }
    let magnitude = libm::floor(libm::log10(value.abs())) as i32;
    if !(-4..=6).contains(&magnitude) {
        return format!("{value:.*e}", (digits - 1).max(0) as usize);
    }
    if value.fract() == 0.0 {
        return format!("{value:.0}");
    }
    let text = format!("{value:.*}", (digits - 1 - magnitude).max(0) as usize);
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
}

/// Every figure of a run that is judged.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Verdict {
    pub rows: Vec<Judgement>,
    /// How many of the first rows hold a user's limits.
    pub of_user: usize,
    /// Figures that are not judged, each with the reason.
    pub not_judged: Vec<String>,
}

impl Verdict {
    /// How many have a status.
    pub fn count(&self, status: Status) -> usize {
        self.rows.iter().filter(|row| row.status == status).count()
    }

    /// The worst status.
    pub fn status(&self) -> Status {
        self.rows.iter().map(|row| row.status).max().unwrap_or(Status::Pass)
    }

    /// Its counts in words.
    pub fn in_words(&self) -> String {
        let [pass, marginal, fail] = [Status::Pass, Status::Marginal, Status::Fail].map(|status| self.count(status));
        format!("{pass} passed, {marginal} marginal, {fail} failed")
    }

    /// The user's limits that are broken.
    pub fn broken(&self) -> impl Iterator<Item = &Judgement> {
        self.rows.iter().take(self.of_user).filter(|row| row.status == Status::Fail)
    }

    /// A run against the limits that need no user: those of theory and of the receiver's own covariance.
    ///
    /// # Errors
    /// [`JudgeError::Read`] where rows that were put by cannot be read.
    pub fn of(run: &Run, errors: &Errors, summary: &Summary) -> Result<Self, JudgeError> {
        let mut verdict = Self::default();
        verdict.position(run, summary);
        verdict.tracking(run, errors, summary)?;
        verdict.reception(run, summary);
        verdict.interference(summary);
        verdict.spoofing(summary);
        Ok(verdict)
    }

    /// Puts a user's judgements first; they replace what is otherwise judged of the same figures.
    pub fn with_user(mut self, rows: Vec<Judgement>) -> Self {
        self.rows.retain(|row| rows.iter().all(|user| user.path != row.path || row.path.is_none()));
        self.of_user = rows.len();
        self.rows.splice(0..0, rows);
        self
    }

    fn judge(&mut self, figure: &str, path: &str, value: impl Into<Value>, unit: &str, bound: Bound, source: &str) {
        let row = Judgement::new(figure, value.into(), unit, bound, MARGINAL_SHARE, source);
        self.rows.push(if path.is_empty() { row } else { row.at(path) });
    }

    fn position(&mut self, run: &Run, summary: &Summary) {
        let position = &summary.position;
        if run.scene.duration_s < FIRST_FIX_S && position.first_fix_s.is_none() {
            self.not_judged.push(format!(
                "position: {} s are too short for a first fix from a cold start, which may take {FIRST_FIX_S} s",
                run.scene.duration_s
            ));
            return;
        }
        self.judge(
            "time to first fix",
            "position.first_fix_s",
            position.first_fix_s,
            "s",
            Bound::Max(FIRST_FIX_S),
            "IS-GPS-200, 20.3.3: subframes 1 to 3 are whole after 36 s at the latest; 4 s to acquire and lock",
        );
        let expected = |factor: f64, of: fn(&Fix) -> f64| {
            let variance = run.fixes.iter().map(of).sum::<f64>() / run.fixes.len().max(1) as f64;
            (variance > 0.0).then(|| factor * variance.sqrt())
        };
        // A circle that holds 95 % of two equal normals has a radius of √(−2 ln 0.05) σ; an ellipse of the same mean variance
        // needs less, so that the bound is not too tight.
        let flat =
            expected(2.4477, |fix| 0.5 * (fix.sigma_east_m * fix.sigma_east_m + fix.sigma_north_m * fix.sigma_north_m));
        let up = expected(1.96, |fix| fix.sigma_up_m * fix.sigma_up_m);
        let clock = expected(1.96, |fix| fix.sigma_clock_m * fix.sigma_clock_m);
        let details = &summary.details;
        let rows = [
            ("horizontal error, 95 %", "position.horizontal_p95_m", position.horizontal_p95_m, flat, "2.45 σ"),
            ("vertical error, 95 %", "position.vertical_p95_m", position.vertical_p95_m, up, "1.96 σ"),
            ("clock error, 95 %", "", details.clock_m.map(|clock| clock.p95), clock, "1.96 σ"),
        ];
        for (figure, path, value, bound, factor) in rows {
            let Some(bound) = bound else { continue };
            let source = format!("{factor} of the receiver's own covariance");
            self.judge(figure, path, value, "m", Bound::Max(bound), &source);
        }
    }

    fn tracking(&mut self, run: &Run, errors: &Errors, summary: &Summary) -> Result<(), JudgeError> {
        let (tracking, limits) = (&summary.tracking, &summary.details.thresholds);
        let rows = [
            ("DLL jitter, 1σ", "tracking.dll_sigma_chips", tracking.dll_sigma_chips, "chips", limits.dll_chips, "d/6"),
            ("PLL jitter, 1σ", "tracking.pll_sigma_deg", tracking.pll_sigma_deg, "°", limits.pll_deg, "15°"),
            ("FLL jitter, 1σ", "tracking.fll_sigma_hz", tracking.fll_sigma_hz, "Hz", limits.fll_hz, "1/(12T)"),
        ];
        for (figure, path, value, unit, limit, rule) in rows {
            let Some(value) = value else {
                self.not_judged.push(format!("{figure}: no observation past its pull-in"));
                continue;
            };
            let source = format!("rule of thumb {rule} (Kaplan and Hegarty, 5.6)");
            self.judge(figure, path, value, unit, Bound::Max(limit), &source);
        }
        let (unexpected, weak) = losses(run, errors)?;
        let source = match weak {
            0 => "none where thermal jitter stays below 15°".to_owned(),
            _ => format!("none where thermal jitter stays below 15°; {weak} more below that C/N0"),
        };
        self.judge("unexpected losses of lock", "", unexpected, "", Bound::Max(0.0), &source);
        if weak == 0 {
            let source = "none while every signal is strong enough to hold";
            self.judge("cycle slips", "tracking.cycle_slips", tracking.cycle_slips, "", Bound::Max(0.0), source);
        } else {
            self.not_judged.push(format!("cycle slips ({}): signals were too weak to hold", tracking.cycle_slips));
        }
        Ok(())
    }

    fn reception(&mut self, run: &Run, summary: &Summary) {
        let (satellites, navigation) = (&summary.satellites, &summary.navigation);
        self.judge(
            "false acquisitions",
            "satellites.false_acquired",
            satellites.false_acquired,
            "",
            Bound::Max(0.0),
            "the scene has no such satellite",
        );
        if navigation.parameters_checked > 0 {
            self.judge(
                "wrong navigation parameters",
                "navigation.parameters_wrong",
                navigation.parameters_wrong,
                "",
                Bound::Max(0.0),
                "what was sent",
            );
        } else {
            self.not_judged.push("navigation parameters: none decoded".to_owned());
        }
        if let Some(bias) = summary.observables.cn0_bias_db.filter(|_| run.scene.noise) {
            self.judge(
                "C/N0 bias, magnitude",
                "",
                bias.abs(),
                "dB",
                Bound::Max(ONE_BIT_LOSS_DB),
                "loss of a one-bit quantiser, 10 lg(π/2): more is unexplained",
            );
        }
    }

    fn interference(&mut self, summary: &Summary) {
        let Some(lines) = summary.interference else { return };
        self.judge(
            "interference told while there was none",
            "interference.false_told",
            lines.false_told,
            "",
            Bound::Max(0.0),
            "the detector's false alarms come once in a million seconds",
        );
        if lines.wave_seconds == 0 {
            return;
        }
        self.judge(
            "seconds of a continuous wave that were not told",
            "",
            lines.wave_seconds - lines.wave_seconds_told,
            "",
            Bound::Max(0.0),
            "none of those with a wave of J/N0 ≥ 45 dB-Hz all through",
        );
        // Where a wave is never alone, what is told may be another source's line.
        if let (Some(bin_hz), Some(error_hz)) = (lines.resolution_hz, lines.frequency_error_max_hz) {
            let source = "half a bin of the receiver's spectrum";
            self.judge(
                "frequency of the continuous wave, largest error",
                "interference.frequency_error_max_hz",
                error_hz,
                "Hz",
                Bound::Max(0.5 * bin_hz),
                source,
            );
        }
    }

    fn spoofing(&mut self, summary: &Summary) {
        let Some(spoofing) = &summary.spoofing else { return };
        if let Some(share) = spoofing.captured_share {
            let source = "no fix should follow a spoofer";
            self.judge(
                "fixes captured by the spoofer",
                "spoofing.captured_share",
                share,
                "of 1",
                Bound::Max(0.0),
                source,
            );
        }
    }

    /// Rows of `verdict.csv`.
    pub(crate) fn csv_rows(&self) -> impl Iterator<Item = Row<'_>> {
        self.rows.iter().map(|row| Row {
            figure: &row.figure,
            path: row.path.as_deref().unwrap_or(""),
            value: row.value_text(),
            unit: &row.unit,
            limit: row.bound.to_string(),
            margin_share: row.margin,
            status: row.status,
            source: &row.source,
        })
    }
}

/// One row of `verdict.csv`.
#[derive(Serialize)]
pub(crate) struct Row<'a> {
    figure: &'a str,
    path: &'a str,
    value: String,
    unit: &'a str,
    limit: String,
    margin_share: Option<f64>,
    status: Status,
    source: &'a str,
}

/// Longest wait for a fix from a cold start that is not the receiver's fault: a subframe begun just before lock, five more
/// of 6 s until 1 to 3 are whole, and 4 s to acquire, lock and synchronise.
const FIRST_FIX_S: f64 = 40.0;
/// 10 lg(π/2).
const ONE_BIT_LOSS_DB: f64 = 1.961;

/// Losses of lock at which the signal was strong enough to hold, and the others: by the C/N0 that the receiver could have, other
/// codes and interference counted as noise, at the last observation before, against that at which the phase loop's thermal
/// jitter reaches its threshold.
fn losses(run: &Run, errors: &Errors) -> Result<(usize, usize), JudgeError> {
    let setting = |key: &str, default: f64| run.tracking_setting(key).unwrap_or(default);
    let update_s = 1e-3 * setting("integration", 4.0);
    let least_dbhz = pll::cn0_dbhz(pll::THRESHOLD_RAD, setting("pll_bandwidth_hz", 18.0), update_s);
    let window = (LOOK_BACK_S * run.scene.sample_rate_hz) as u64;
    let (mut strong, mut weak) = (0, 0);
    for loss in run.events.iter().filter(|row| row.event == Event::LossOfLock) {
        let link = (loss.sv, loss.signal);
        // What the truth says around the loss; a satellite that it does not have is no signal at all.
        let rows = run.truth.rows(link)?;
        let near = rows.iter().filter(|row| row.sample <= loss.sample && loss.sample - row.sample <= window);
        let own = errors.signals.rows(link)?;
        let jammed = own.iter().rev().find(|row| row.sample <= loss.sample);
        let cost_db = jammed.map_or(0.0, |row| row.cn0_true_dbhz - row.cn0_effective_dbhz);
        let lowest_dbhz = near.map(|row| row.cn0_dbhz - cost_db).min_by(f64::total_cmp);
        let held = lowest_dbhz.is_some_and(|dbhz| dbhz >= least_dbhz);
        (strong, weak) = if held { (strong + 1, weak) } else { (strong, weak + 1) };
    }
    Ok((strong, weak))
}

/// The lock detectors' memory: how long before a declared loss the signal may have failed.
const LOOK_BACK_S: f64 = 2.0;

#[cfg(test)]
mod tests {
    use super::*;

    fn status(value: impl Into<Value>, bound: Bound) -> (Status, Option<f64>) {
        let row = Judgement::new("x", value.into(), "m", bound, MARGINAL_SHARE, "test");
        (row.status, row.margin)
    }

    #[test]
    fn a_figure_passes_is_marginal_within_a_tenth_of_its_limit_and_fails_beyond() {
        assert_eq!(status(1.0, Bound::Max(2.0)), (Status::Pass, Some(0.5)));
        assert_eq!(status(1.9, Bound::Max(2.0)).0, Status::Marginal);
        assert_eq!(status(2.0, Bound::Max(2.0)), (Status::Marginal, Some(0.0)));
        assert_eq!(status(3.0, Bound::Max(2.0)), (Status::Fail, Some(-0.5)));
        assert_eq!(status(12, Bound::Min(8.0)), (Status::Pass, Some(0.5)));
        assert_eq!(status(8.5, Bound::Min(8.0)).0, Status::Marginal);
        assert_eq!(status(7, Bound::Min(8.0)).0, Status::Fail);
        assert_eq!(status(-3.0, Bound::Max(-2.0)), (Status::Pass, Some(0.5)));
    }

    #[test]
    fn a_count_that_must_be_zero_passes_or_fails_and_a_missing_figure_fails() {
        assert_eq!(status(0, Bound::Max(0.0)), (Status::Pass, None));
        assert_eq!(status(1, Bound::Max(0.0)), (Status::Fail, None));
        assert_eq!(status(Value::Null, Bound::Max(5.0)).0, Status::Fail);
        assert_eq!(status(f64::NAN, Bound::Min(0.0)).0, Status::Fail);
        assert_eq!(status("balanced", Bound::Equals("balanced".into())).0, Status::Pass);
        assert_eq!(status(1, Bound::Equals(1.0.into())).0, Status::Pass);
        let missing = Judgement::new("x", Value::Null, "m", Bound::Max(1.0), 0.1, "test");
        assert_eq!(missing.margin_text(), "no figure");
    }

    #[test]
    fn numbers_have_four_digits() {
        let texts = [0.0, 15.0, 2.259_712, 0.083_333_3, 40.0, 1.2e-9, 26.1, 123_456.7].map(number);
        assert_eq!(texts, ["0", "15", "2.26", "0.08333", "40", "1.200e-9", "26.1", "123457"]);
    }
}
