//! The jitter of each satellite's loops three ways: what discriminators put out, how far oscillators were
//! from the truth, and what theory says of a loop with these settings at the C/N0 that was measured.
//!
//! Raw and closed-loop figures are never mixed: a discriminator's value is noise of one integration,
//! √(1/(2B·T)) times what the loop lets through. The theory takes the loops as the settings file describes
//! them, controlled roots of exact bandwidth, with phase and rate fed back
//! ([`crate::expect::theory::linear`]), at the C/N0 of which the measured one is stated
//! ([`Stated::effective_dbhz`]) and at the positions in the loops' intervals where observations fall, and
//! adds the scene's oscillator and the stress that the true motion puts on that same linear loop. In the
//! tracking stage the frequency is that of the phase loop; its row judges the rate. Limits: discriminators as
//! of early minus late power and two-quadrant arctangent; a front-end filter's rounding of the correlation is
//! left out.

use serde::Serialize;

use crate::error::JudgeError;
pub use crate::expect::loops::{Loop, Settings, motion_error_deg};
use crate::expect::loops::{Places, Stresses, Theory};
use crate::expect::stated::Stated;
use crate::expect::timeline::Timeline;
use crate::measure::errors::{Errors, Link, PULL_IN_S, SignalError};
use crate::measure::independent::Correlated;
use crate::read::{Numbers, Run};
use crate::statistics::{mean, median};
use gnss::record::TrackingRow;

/// One loop of one satellite: a row of `jitter.csv`. Sigmas and limits are in `unit`: chips, degrees or
/// hertz.
#[derive(Clone, Debug, Serialize)]
pub struct LinkJitter {
    /// The satellite.
    pub sv: String,
    /// Name of the signal.
    pub signal: &'static str,
    /// Loop of the row.
    #[serde(rename = "loop")]
    pub which: Loop,
    /// Unit of sigmas and limits: chips, degrees or hertz.
    pub unit: &'static str,
    /// C/N0 that the receiver measured in dB-Hz, mean over the updates that are counted.
    pub cn0_dbhz: f64,
    /// Time of an update, seconds.
    pub integration_s: f64,
    /// Standard deviation of the discriminator's values, and what theory says of it: noise of one integration
    /// and what the loop carries over from those before.
    pub raw_sigma: Option<f64>,
    /// Theory of the same.
    pub raw_theory_sigma: Option<f64>,
    /// Oscillator minus truth.
    pub values: usize,
    /// Number of independent values that they are worth.
    pub independent: f64,
    /// Mean of the values.
    pub mean: f64,
    /// Standard deviation of the values.
    pub sigma: f64,
    /// Half width of the 95 % interval of `sigma`, relative.
    pub sigma_interval: f64,
    /// Standard deviation by theory, of thermal noise alone.
    pub thermal_theory_sigma: f64,
    /// Standard deviation by theory, of the oscillators alone.
    pub oscillator_theory_sigma: f64,
    /// Error that the true motion leaves in the loop without noise: root mean square, and largest.
    pub stress_rms: f64,
    /// The largest of it.
    pub stress_max: f64,
    /// Square root of the sum of the squares of thermal, oscillator and motion.
    pub theory_sigma: f64,
    /// Measured over theory; 1 is right.
    pub sigma_over_theory: f64,
    /// Rule of thumb for jitter alone, and what is left to it.
    pub threshold: f64,
    /// Threshold minus sigma.
    pub margin: f64,
    /// 3σ and the largest stress, against the end of the discriminator's range.
    pub rule: f64,
    /// The end of the range.
    pub rule_limit: f64,
    /// True if the rule is kept.
    pub holds: bool,
    /// Probability of a distribution so far from normal, if it were normal.
    pub normality_p: Option<f64>,
    /// Closed loop in metres; of code loops only.
    pub sigma_m: Option<f64>,
}

/// Rows of all satellites.
#[derive(Clone, Debug, Default)]
pub struct Jitter {
    /// A row for each loop of each satellite's signal.
    pub rows: Vec<LinkJitter>,
}

/// Root mean squares of one loop over all satellites' rows; of several thresholds the least.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Pooled {
    /// Standard deviation of the discriminator's values.
    pub raw_sigma: Option<f64>,
    /// Theory of the same.
    pub raw_theory_sigma: Option<f64>,
    /// Standard deviation of the closed loop.
    pub sigma: f64,
    /// Theory of the same.
    pub theory_sigma: f64,
    /// The least of the satellites'.
    pub threshold: f64,
    /// The least of the satellites'.
    pub margin_min: f64,
    /// Rows whose rule is broken.
    pub rules_broken: usize,
}

impl Jitter {
    /// Measures every satellite that was past its pull-in for ten observations.
    ///
    /// # Errors
    /// [`JudgeError::Read`] where spilled rows cannot be read.
    pub fn measure(run: &Run, errors: &Errors, stated: &Stated) -> Result<Self, JudgeError> {
        let Some(settings) = Settings::of(run) else { return Ok(Self::default()) };
        let mut rows = Vec::new();
        for link in &errors.signals.keys().collect::<Vec<_>>() {
            let (past, span) = settled(errors, *link, |row| run.scene.expect.bounded(row.time_s))?;
            if past.len() < 10 {
                continue;
            }
            let steps: Vec<f64> = past.windows(2).map(|two| two[1].time_s - two[0].time_s).collect();
            let usual_s = median(&steps).unwrap_or(0.0);
            drop(steps);
            let whole = |a: &Past, b: &Past| b.locked_s > a.locked_s && b.time_s - a.time_s < 1.5 * usual_s;
            let stretches: Vec<&[Past]> = past.chunk_by(whole).collect();
            let spans: Vec<(u64, u64)> =
                stretches.iter().filter_map(|rows| Some((rows.first()?.sample, rows.last()?.sample))).collect();
            let of_updates = |of: &dyn Fn(&TrackingRow) -> Option<f64>| of_updates(run, *link, &spans, of);
            let Some(update_s) = of_updates(&|row| Some(row.integration_s))?.percentile(0.5)? else { continue };
            let Some(theory) = Theory::new(run, settings, link, update_s) else { continue };
            // Times of samples by the sampler's clock are near enough to GPS time here.
            let Some(timeline) = Timeline::of(run, *link)? else { continue };
            let stresses = Stresses::new(&theory, &timeline, link, span);
            drop(timeline);
            for which in [Loop::Dll, Loop::Pll, Loop::Fll] {
                let put_out = of_updates(&|row| {
                    let whole = (row.integration_s - theory.update_s).abs() < 1e-9;
                    whole.then(|| put_out(which, row))
                })?;
                let raw_sigma = put_out.std()?.map(|(sigma, _)| sigma);
                rows.extend(row((link, stated), which, &stretches, raw_sigma, &theory, &stresses));
            }
        }
        Ok(Self { rows })
    }

    /// One loop over all satellites, root mean squares.
    pub fn pooled(&self, which: Loop) -> Option<Pooled> {
        let rows: Vec<&LinkJitter> = self.rows.iter().filter(|row| row.which == which).collect();
        let square = |of: fn(&LinkJitter) -> Option<f64>| {
            mean(&rows.iter().filter_map(|row| of(row)).map(|value| value * value).collect::<Vec<_>>()).map(f64::sqrt)
        };
        Some(Pooled {
            raw_sigma: square(|row| row.raw_sigma),
            raw_theory_sigma: square(|row| row.raw_theory_sigma),
            sigma: square(|row| Some(row.sigma))?,
            theory_sigma: square(|row| Some(row.theory_sigma))?,
            threshold: rows.iter().map(|row| row.threshold).fold(f64::INFINITY, f64::min),
            margin_min: rows.iter().map(|row| row.margin).fold(f64::INFINITY, f64::min),
            rules_broken: rows.iter().filter(|row| !row.holds).count(),
        })
    }
}

/// Data of an observation past its pull-in.
#[derive(Clone, Copy)]
struct Past {
    sample: u64,
    time_s: f64,
    locked_s: f64,
    cn0_dbhz: f64,
    code_m: f64,
    carrier_cycles: f64,
    doppler_hz: f64,
    sent_fraction_s: f64,
}

/// Observations past their pull-in where the scene does not expect any errors, and the times of the first and
/// the last of all.
fn settled(
    errors: &Errors,
    link: Link,
    bounded: impl Fn(&SignalError) -> bool,
) -> Result<(Vec<Past>, (f64, f64)), JudgeError> {
    // A scene that expects them throughout is measured all the same.
    let (mut any, mut span) = (false, None);
    errors.signals.each(link, |row| {
        any |= bounded(&row);
        span = Some((span.map_or(row.time_s, |(first_s, _)| first_s), row.time_s));
    })?;
    let mut past = Vec::new();
    errors.signals.each(link, |row| {
        if row.locked_s >= PULL_IN_S && (bounded(&row) || !any) {
            past.push(Past {
                sample: row.sample,
                time_s: row.time_s,
                locked_s: row.locked_s,
                cn0_dbhz: row.cn0_dbhz,
                code_m: row.code_m,
                carrier_cycles: row.carrier_cycles,
                doppler_hz: row.doppler_hz,
                sent_fraction_s: row.sent_fraction_s,
            });
        }
    })?;
    Ok((past, span.unwrap_or_default()))
}

/// Output of a loop in an update, in the loop's unit.
fn put_out(which: Loop, row: &TrackingRow) -> f64 {
    match which {
        Loop::Dll => row.dll_discriminator_chips,
        Loop::Pll => 360.0 * row.pll_discriminator_cycles,
        Loop::Fll => row.fll_discriminator_hz,
    }
}

/// Values of `of` for the loop updates within those spans.
fn of_updates(
    run: &Run,
    link: Link,
    spans: &[(u64, u64)],
    of: &dyn Fn(&TrackingRow) -> Option<f64>,
) -> Result<Numbers, JudgeError> {
    let mut found = Numbers::new(run.tracking.directory());
    for row in run.tracking.cursor(link) {
        let row = row?;
        if let Some(value) = of(&row).filter(|_| spans.iter().any(|(from, to)| (*from..=*to).contains(&row.sample))) {
            found.push(value)?;
        }
    }
    Ok(found)
}

fn row(
    (link, stated): (&Link, &Stated),
    which: Loop,
    stretches: &[&[Past]],
    raw_sigma: Option<f64>,
    theory: &Theory,
    stresses: &Stresses,
) -> Option<LinkJitter> {
    let error = |row: &Past| match which {
        Loop::Dll => row.code_m / theory.chip_m,
        Loop::Pll => 360.0 * row.carrier_cycles,
        Loop::Fll => row.doppler_hz,
    };
    let all: Vec<f64> = stretches.iter().copied().flatten().map(error).collect();
    let (middle, values) = (mean(&all)?, all.len());
    drop(all);
    let centred: Vec<Vec<f64>> =
        stretches.iter().map(|rows| rows.iter().map(|row| error(row) - middle).collect()).collect();
    let found = Correlated::about_zero(&centred)?;
    let sigma = found.variance().sqrt();
    let cn0_dbhz = mean(&stretches.iter().copied().flatten().map(|row| row.cn0_dbhz).collect::<Vec<_>>())?;
    // What a receiver states has gains and losses that are in the theory's share of the power.
    let cn0_hz = libm::pow(10.0, 0.1 * stated.effective_dbhz(*link, cn0_dbhz));
    let mut places = Places::default();
    stretches.iter().copied().flatten().for_each(|row| places.add(row.sent_fraction_s, theory.update_s));
    let (raw_theory, thermal) = theory.noise(which, cn0_hz, &places);
    let oscillator_theory = theory.oscillator(which);
    let (stress_rms, stress_max) = (stresses.of(which).rms(), stresses.of(which).max);
    let theory_sigma = (thermal * thermal + oscillator_theory * oscillator_theory + stress_rms * stress_rms).sqrt();
    let (threshold, rule_limit) = theory.limits(which);
    let rule = 3.0 * sigma + stress_max;
    Some(LinkJitter {
        sv: link.sv.to_string(),
        signal: link.signal.name,
        which,
        unit: match which {
            Loop::Dll => "chips",
            Loop::Pll => "deg",
            Loop::Fll => "hz",
        },
        cn0_dbhz,
        integration_s: theory.update_s,
        raw_sigma,
        raw_theory_sigma: raw_sigma.map(|_| raw_theory),
        values,
        independent: found.independent(),
        mean: middle,
        sigma,
        sigma_interval: found.relative_interval(),
        thermal_theory_sigma: thermal,
        oscillator_theory_sigma: oscillator_theory,
        stress_rms,
        stress_max,
        theory_sigma,
        sigma_over_theory: sigma / theory_sigma,
        threshold,
        margin: threshold - sigma,
        rule,
        rule_limit,
        holds: rule <= rule_limit,
        normality_p: found.normality(centred.iter().flatten().copied()),
        sigma_m: (which == Loop::Dll).then_some(sigma * theory.chip_m),
    })
}
