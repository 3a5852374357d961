//! Result for a foreign receiver: `foreign.json`, and the biases by name.
//!
//! A bias is named when it differs from zero (a scale: from one) by more than three of its standard
//! deviations. Otherwise the report states that it is absent, with the bound that the file allows. The clock
//! is not an error. It is named for users of the file.

use std::collections::BTreeMap;
use std::fmt;
use std::sync::OnceLock;

use serde::Serialize;
use serde_json::Value;

use super::fit::Estimate;
use super::judged::Judged;
use super::measured::Measured;
use crate::judge::schema::{Figures, Leaf};
use crate::statistics::mean;
use gnss::earth::SPEED_OF_LIGHT_MPS;
use gnss::signal::Signal;

/// Paths of `foreign.json` that a user's limits may name.
pub static FIGURES: Figures = Figures { file: "foreign.json", listed: "any foreign.json", leaves };

/// The figures of a summary without any, in its order.
fn leaves() -> &'static [Leaf] {
    static LEAVES: OnceLock<Vec<Leaf>> = OnceLock::new();
    LEAVES.get_or_init(|| {
        let mut leaves = Vec::new();
        // Numbers and texts always have a form in JSON; if not there would be no paths.
        if let Ok(Value::Object(tables)) = serde_json::to_value(ForeignSummary::default()) {
            for (table, figures) in tables.iter().filter_map(|(name, value)| Some((name, value.as_object()?))) {
                for (name, value) in figures {
                    let is_number = !value.is_boolean() && !name.ends_with("_sv");
                    let endings = [("_mps", "m/s"), ("_cycles", "cycles"), ("_hz", "Hz"), ("_db", "dB")];
                    let endings = endings.iter().chain(&[("_m", "m"), ("_s", "s")]);
                    let mut units = endings.filter(|(ending, _)| name.ends_with(ending)).map(|(_, unit)| *unit);
                    let unit = units.next().unwrap_or("1").to_owned();
                    leaves.push(Leaf { path: format!("{table}.{name}"), unit, meaning: String::new(), is_number });
                }
            }
        }
        leaves
    })
}

/// `foreign.json`. A number that the files do not show is null.
#[derive(Clone, Debug, Default, Serialize)]
pub struct ForeignSummary {
    /// The scene's name.
    pub scene: String,
    /// Receiver that the RINEX header names.
    pub receiver: Option<String>,
    /// Join of the files with the truth.
    pub join: Join,
    /// The receiver's clock.
    pub clock: Clock,
    /// Pseudoranges.
    pub code: Code,
    /// Carriers.
    pub carrier: Carrier,
    /// Dopplers.
    pub doppler: Doppler,
    /// Signal strengths.
    pub cn0: Cn0,
    /// Positions.
    pub position: Position,
    /// Each bias in one sentence.
    pub findings: Vec<String>,
}

/// Join of files and truth.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Join {
    /// Epochs of the file of observations.
    pub epochs: usize,
    /// Epochs that the truth has.
    pub epochs_joined: usize,
    /// Observations that the truth has.
    pub observations: usize,
    /// Number of observations whose satellite or time is not in the truth.
    pub observations_unmatched: usize,
    /// Pseudoranges so far from the others that another signal must have been followed.
    pub observations_outliers: usize,
    /// Time between the truth's rows, seconds.
    pub truth_interval_s: f64,
    /// Largest errors of the truth between its rows.
    pub interpolation_code_m: f64,
    /// Largest error of a carrier between the truth's rows, cycles.
    pub interpolation_carrier_cycles: f64,
    /// Largest error of a Doppler between the truth's rows, Hz.
    pub interpolation_doppler_hz: f64,
    /// Weeks by which the observations' labels were moved.
    pub observations_week_offset: i64,
    /// Weeks by which the positions' labels were moved.
    pub positions_week_offset: i64,
    /// Delay of the observations' labels in seconds, from the slope of pseudorange errors over Doppler.
    pub time_tag_offset_s: Option<f64>,
    /// Standard deviation of the time tag, seconds.
    pub time_tag_sigma_s: Option<f64>,
    /// True if the delay was significant, and the truth taken at the corrected times.
    pub time_tag_applied: bool,
}

/// The part of pseudoranges, carriers and Dopplers that satellites have in common.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Clock {
    /// Mean over the epochs of the pseudoranges' common error: label minus GPS time, as the file has it.
    pub pseudorange_common_m: Option<f64>,
    /// Mean common error of the pseudoranges in metres, less the sampler's clock. It is a bias of all
    /// pseudoranges for a receiver that labels its epochs by counting samples.
    pub pseudorange_common_less_sampler_m: Option<f64>,
    /// Mean reading minus GPS time, seconds.
    pub bias_mean_s: Option<f64>,
    /// Drift by the code, seconds a second.
    pub drift_code: Option<f64>,
    /// Drift by the carrier, seconds a second.
    pub drift_carrier: Option<f64>,
    /// Drift by the Doppler, seconds a second.
    pub drift_doppler: Option<f64>,
    /// Drift of the clock that sampled the signal, in truth.
    pub sampler_drift: f64,
    /// Mean reading of the sampler's clock minus true time, seconds.
    pub sampler_bias_mean_s: Option<f64>,
}

/// Pseudoranges without the clock.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Code {
    /// Root mean square of the errors, metres.
    pub rms_m: Option<f64>,
    /// Each satellite about its own mean.
    pub sigma_m: Option<f64>,
    /// The largest bias of one satellite against the others, and whose.
    pub largest_bias_m: Option<f64>,
    /// The satellite with the largest bias.
    pub largest_bias_sv: Option<String>,
    /// Slope over time of code minus carrier.
    pub minus_carrier_drift_mps: Option<f64>,
    /// Standard deviation of the slope, m/s.
    pub minus_carrier_drift_sigma_mps: Option<f64>,
}

/// Carriers without the clock and a constant an arc.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Carrier {
    /// +1 where it grows with range, as RINEX has it.
    pub sign: Option<f64>,
    /// Root mean square of the errors, cycles.
    pub rms_cycles: Option<f64>,
    /// Breaks of a count.
    pub slips: usize,
    /// Slips that the file does not declare.
    pub slips_undeclared: usize,
}

/// Dopplers.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Doppler {
    /// Slope of what is reported over the truth: 1, or −1 with the opposite sign.
    pub scale: Option<f64>,
    /// Standard deviation of the scale.
    pub scale_sigma: Option<f64>,
    /// Root mean square without the clock's drift, Hz.
    pub rms_hz: Option<f64>,
    /// Doppler plus the carrier's own rate.
    pub minus_carrier_rate_hz: Option<f64>,
    /// Standard deviation of the difference, Hz.
    pub minus_carrier_rate_sigma_hz: Option<f64>,
}

/// C/N0 against that in the samples: the antenna's, less what band edge, filter and converter take; other
/// satellites and interference count as noise.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Cn0 {
    /// Mean error, dB.
    pub bias_db: Option<f64>,
    /// Standard deviation of the mean error, dB.
    pub bias_sigma_db: Option<f64>,
}

/// Positions.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Position {
    /// Number of fixes.
    pub fixes: usize,
    /// Fixes that the truth has.
    pub fixes_joined: usize,
    /// Mean error to the east, metres.
    pub bias_east_m: Option<f64>,
    /// Mean error to the north, metres.
    pub bias_north_m: Option<f64>,
    /// Mean error upward, metres.
    pub bias_up_m: Option<f64>,
    /// Standard deviation of the mean to the east, metres.
    pub bias_east_sigma_m: Option<f64>,
    /// Standard deviation of the mean to the north, metres.
    pub bias_north_sigma_m: Option<f64>,
    /// Standard deviation of the mean upward, metres.
    pub bias_up_sigma_m: Option<f64>,
    /// Root mean square of the horizontal error, metres.
    pub horizontal_rms_m: Option<f64>,
    /// Horizontal error that 95 % of the fixes stay below, metres.
    pub horizontal_p95_m: Option<f64>,
    /// Root mean square of the vertical error, metres.
    pub up_rms_m: Option<f64>,
    /// Error in space that 95 % of the fixes stay below, metres.
    pub error_3d_p95_m: Option<f64>,
    /// Root mean square of the error of the ground speed, m/s.
    pub ground_speed_rms_mps: Option<f64>,
    /// Null in a scene at rest.
    pub time_tag_offset_s: Option<f64>,
    /// Standard deviation of the time tag, seconds.
    pub time_tag_sigma_s: Option<f64>,
}

const WEEK_S: i64 = gnss::time::WEEK_S;

impl ForeignSummary {
    /// Condenses what was measured.
    pub fn new(judged: &Judged) -> Self {
        let none = Measured::default();
        let measured = judged.observables.as_ref().unwrap_or(&none);
        let biases: Vec<f64> = measured.clock.iter().map(|row| row.bias_s).collect();
        let samplers: Vec<f64> = measured.clock.iter().map(|row| row.sampler_bias_s).collect();
        let bias_mean_s = mean(&biases);
        let largest = measured
            .satellites
            .iter()
            .filter_map(|row| Some((row.code_bias_m?, &row.sv)))
            .max_by(|a, b| a.0.abs().total_cmp(&b.0.abs()));
        let value = |estimate: Option<Estimate>| estimate.map(|estimate| estimate.value);
        let sigma = |estimate: Option<Estimate>| estimate.map(|estimate| estimate.sigma);
        let mut summary = Self {
            scene: judged.scene.clone(),
            receiver: judged.receiver.clone(),
            join: Join {
                epochs: measured.epochs,
                epochs_joined: measured.joined,
                observations: measured.observations,
                observations_unmatched: measured.unmatched,
                observations_outliers: measured.outliers,
                truth_interval_s: judged.truth_interval_s,
                interpolation_code_m: judged.interpolation.range_m,
                interpolation_carrier_cycles: judged.interpolation.carrier_cycles,
                interpolation_doppler_hz: judged.interpolation.doppler_hz,
                observations_week_offset: judged.rollover_s[0] / WEEK_S,
                positions_week_offset: judged.rollover_s[1] / WEEK_S,
                time_tag_offset_s: value(measured.time_tag_s),
                time_tag_sigma_s: sigma(measured.time_tag_s),
                time_tag_applied: measured.time_tag_applied,
            },
            clock: Clock {
                pseudorange_common_m: bias_mean_s.map(|bias| bias * SPEED_OF_LIGHT_MPS),
                pseudorange_common_less_sampler_m: bias_mean_s
                    .zip(mean(&samplers))
                    .map(|(bias, sampler)| (bias - sampler) * SPEED_OF_LIGHT_MPS),
                bias_mean_s,
                drift_code: measured.drift_code,
                drift_carrier: measured.drift_carrier,
                drift_doppler: measured.drift_doppler,
                sampler_drift: judged.sampler_drift,
                sampler_bias_mean_s: mean(&samplers),
            },
            code: Code {
                rms_m: measured.code_rms_m,
                sigma_m: measured.code_sigma_m,
                largest_bias_m: largest.map(|(bias, _)| bias),
                largest_bias_sv: largest.map(|(_, sv)| sv.clone()),
                minus_carrier_drift_mps: value(measured.code_carrier_mps),
                minus_carrier_drift_sigma_mps: sigma(measured.code_carrier_mps),
            },
            carrier: Carrier {
                sign: measured.carrier_sign,
                rms_cycles: measured.carrier_rms_cycles,
                slips: measured.slips.len(),
                slips_undeclared: measured.slips.iter().filter(|slip| !slip.declared).count(),
            },
            doppler: Doppler {
                scale: value(measured.doppler_scale),
                scale_sigma: sigma(measured.doppler_scale),
                rms_hz: measured.doppler_rms_hz,
                minus_carrier_rate_hz: value(measured.doppler_carrier_hz),
                minus_carrier_rate_sigma_hz: sigma(measured.doppler_carrier_hz),
            },
            cn0: Cn0 { bias_db: value(measured.cn0_db), bias_sigma_db: sigma(measured.cn0_db) },
            position: position(judged),
            findings: Vec::new(),
        };
        summary.findings = summary.findings(judged, measured);
        summary
    }

    fn findings(&self, judged: &Judged, measured: &Measured) -> Vec<String> {
        let mut found = Vec::new();
        for (what, weeks) in
            [("observations", self.join.observations_week_offset), ("positions", self.join.positions_week_offset)]
        {
            if weeks != 0 {
                found.push(format!(
                    "dates of {what} are {weeks:+} weeks off: the week number's rollover was resolved wrongly"
                ));
            }
        }
        if judged.observables.is_some() {
            self.clock_findings(&mut found);
            named(&mut found, "time tags", measured.time_tag_s.map(scaled(1e3)), 0.0, "ms late");
            self.code_findings(measured, &mut found);
            if self.carrier.sign == Some(-1.0) {
                found.push("carrier phase falls while the range grows: the opposite of RINEX's sign".to_owned());
            }
            if self.doppler.scale.is_some_and(|scale| scale < 0.0) {
                found.push("Doppler is positive for a receding satellite: the opposite of RINEX's sign".to_owned());
            }
            let magnitude = measured.doppler_scale.map(|s| Estimate { value: s.value.abs(), ..s });
            named(
                &mut found,
                "scale of Doppler",
                magnitude.map(|s| Estimate { value: (s.value - 1.0) * 1e6, sigma: s.sigma * 1e6 }),
                0.0,
                "ppm",
            );
            named(&mut found, "Doppler plus the carrier's rate", measured.doppler_carrier_hz, 0.0, "Hz");
            let unit = format!("dB against that in the samples{}", front_end(&measured.front_end_costs_db));
            named(&mut found, "C/N0", measured.cn0_db, 0.0, &unit);
            if self.carrier.slips > 0 {
                found.push(format!(
                    "{} breaks of the carrier, {} of them undeclared",
                    self.carrier.slips, self.carrier.slips_undeclared
                ));
            }
            if self.join.observations_outliers > 0 {
                found.push(format!(
                    "{} pseudoranges are of another signal than the file says",
                    self.join.observations_outliers
                ));
            }
        }
        if let (Some(late_s), Some(places)) = (judged.labels_late_s, &judged.places) {
            found.push(format!(
                "{} of {} positions join; more would if their labels were {late_s} s earlier, the leap seconds: GPS \
                 time in place of NMEA's UTC",
                places.rows.len(),
                places.fixes
            ));
        }
        if judged.separations_assumed > 0 {
            found.push(format!(
                "{} positions have no geoid separation: altitudes taken as above mean sea level, EGM96's separation \
                 added (0.5 m, up to 14 m in mountains)",
                judged.separations_assumed
            ));
        }
        if let Some([east, north, up]) = judged.places.as_ref().and_then(|places| places.bias_enu_m) {
            for (axis, estimate) in [("east", east), ("north", north), ("up", up)] {
                named(&mut found, &format!("position {axis}"), Some(estimate), 0.0, "m");
            }
            named(
                &mut found,
                "time tags of positions",
                judged.places.as_ref().and_then(|p| p.time_tag_s).map(scaled(1e3)),
                0.0,
                "ms late",
            );
        }
        found
    }

    fn clock_findings(&self, found: &mut Vec<String>) {
        let clock = &self.clock;
        if let Some(common_m) = clock.pseudorange_common_m {
            found.push(format!(
                "pseudoranges have {common_m:+.3} m in common ({:+.3} us of clock)",
                common_m / SPEED_OF_LIGHT_MPS * 1e6
            ));
        }
        // A tenth of a hertz at L1 separates two clocks.
        let same = |drift: f64| (drift - clock.sampler_drift).abs() < 6e-11;
        for (what, drift) in
            [("pseudoranges", clock.drift_code), ("carriers", clock.drift_carrier), ("Dopplers", clock.drift_doppler)]
        {
            let Some(drift) = drift else { continue };
            let whose = if what != "pseudoranges" && same(drift) {
                ", that of the sampler: not steered".to_owned()
            } else {
                format!(" (the sampler's is {:+.3e})", clock.sampler_drift)
            };
            found.push(format!("clock in {what} drifts by {drift:+.3e}{whose}"));
        }
    }

    fn code_findings(&self, measured: &Measured, found: &mut Vec<String>) {
        let biases: Vec<f64> = measured.satellites.iter().filter_map(|row| row.code_bias_m).collect();
        if let (Some(largest_m), Some(sv), true) =
            (self.code.largest_bias_m, &self.code.largest_bias_sv, biases.len() > 1)
        {
            found.push(format!("largest pseudorange bias of one satellite against the others: {sv} {largest_m:+.3} m"));
        }
        let drift = measured.code_carrier_mps;
        named(found, "code minus carrier", drift.map(scaled(1e3)), 0.0, "mm/s");
    }
}

fn scaled(by: f64) -> impl Fn(Estimate) -> Estimate {
    move |estimate| Estimate { value: by * estimate.value, sigma: by * estimate.sigma }
}

/// A bias in words, or its absence with three sigmas as a bound.
fn named(found: &mut Vec<String>, what: &str, estimate: Option<Estimate>, neutral: f64, unit: &str) {
    let Some(estimate) = estimate else { return };
    let (value, sigma) = (estimate.value, estimate.sigma);
    found.push(if estimate.differs_from(neutral) {
        format!("{what}: {value:+.3} {unit} (sigma {sigma:.3})")
    } else {
        format!("{what}: no bias beyond {:.3} {unit} (found {value:+.3}, sigma {sigma:.3})", 3.0 * sigma)
    });
}

/// Loss of each signal's C/N0 between antenna and samples, in words; empty where there is none.
fn front_end(costs_db: &BTreeMap<&'static Signal, f64>) -> String {
    let costs = costs_db.iter().filter(|(_, cost_db)| cost_db.abs() >= 0.005);
    let costs: Vec<String> = costs.map(|(signal, cost_db)| format!("{cost_db:.2} dB of {}", signal.name)).collect();
    if costs.is_empty() {
        String::new()
    } else {
        format!(" (band's edge, filter and converter take {})", costs.join(", "))
    }
}

fn position(judged: &Judged) -> Position {
    let Some(places) = &judged.places else { return Position::default() };
    let axis = |index: usize| places.bias_enu_m.and_then(|bias| bias.get(index).copied());
    let value = |index| axis(index).map(|estimate| estimate.value);
    let sigma = |index| axis(index).map(|estimate| estimate.sigma);
    Position {
        fixes: places.fixes,
        fixes_joined: places.rows.len(),
        bias_east_m: value(0),
        bias_north_m: value(1),
        bias_up_m: value(2),
        bias_east_sigma_m: sigma(0),
        bias_north_sigma_m: sigma(1),
        bias_up_sigma_m: sigma(2),
        horizontal_rms_m: places.horizontal_rms_m,
        horizontal_p95_m: places.horizontal_p95_m,
        up_rms_m: places.up_rms_m,
        error_3d_p95_m: places.error_3d_p95_m,
        ground_speed_rms_mps: places.ground_speed_rms_mps,
        time_tag_offset_s: places.time_tag_s.map(|estimate| estimate.value),
        time_tag_sigma_s: places.time_tag_s.map(|estimate| estimate.sigma),
    }
}

impl fmt::Display for ForeignSummary {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "{} against the truth of {}", self.receiver.as_deref().unwrap_or("a receiver"), self.scene)?;
        let join = &self.join;
        if join.epochs > 0 {
            writeln!(
                f,
                "observations  {} epochs, {} joined; {} observations, {} without truth, {} outliers",
                join.epochs,
                join.epochs_joined,
                join.observations,
                join.observations_unmatched,
                join.observations_outliers
            )?;
            writeln!(
                f,
                "truth between its rows is right to {:.1e} m, {:.1e} cycles, {:.1e} Hz",
                join.interpolation_code_m, join.interpolation_carrier_cycles, join.interpolation_doppler_hz
            )?;
        }
        if self.position.fixes > 0 {
            writeln!(f, "positions     {} fixes, {} joined", self.position.fixes, self.position.fixes_joined)?;
        }
        writeln!(f)?;
        let rows = [
            ("pseudorange* rms (m)", self.code.rms_m),
            ("pseudorange sigma (m)", self.code.sigma_m),
            ("carrier* rms (cycles)", self.carrier.rms_cycles),
            ("Doppler* rms (Hz)", self.doppler.rms_hz),
            ("C/N0 bias (dB)", self.cn0.bias_db),
            ("horizontal rms (m)", self.position.horizontal_rms_m),
            ("up rms (m)", self.position.up_rms_m),
        ];
        for (name, value) in rows {
            if let Some(value) = value {
                writeln!(f, "{name:<26}{value:>12.4}")?;
            }
        }
        writeln!(f, "* the part common to all satellites of an epoch removed, of carriers a constant an arc\n")?;
        self.findings.iter().try_for_each(|finding| writeln!(f, "- {finding}"))
    }
}
