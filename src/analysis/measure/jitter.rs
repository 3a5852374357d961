//! The jitter of each satellite's loops three ways: what discriminators put out, how far oscillators were
//! from the truth, and what theory says of a loop with these settings at the C/N0 that was measured.
//!
//! Raw and closed-loop figures are never mixed: a discriminator's value is noise of one integration,
//! √(1/(2B·T)) times what the loop lets through. The theory takes the loops as the settings file describes
//! them, controlled roots of exact bandwidth, with phase and rate fed back
//! ([`crate::analysis::expect::theory::linear`]), and adds the scene's oscillator and the stress that the
//! true motion puts on that same linear loop. In the tracking stage the frequency is that of the phase loop;
//! its row judges the rate. Limits: discriminators as of early minus late power and two-quadrant arctangent;
//! a front-end filter's rounding of the correlation is left out.

use serde::Serialize;

use crate::analysis::error::JudgeError;
pub use crate::analysis::expect::loops::{Loop, Settings, motion_error_deg};
use crate::analysis::expect::loops::{Stresses, Theory};
use crate::analysis::expect::multiple_access::MultipleAccess;
use crate::analysis::expect::timeline::Timeline;
use crate::analysis::measure::errors::{Errors, Link, PULL_IN_S, SignalError};
use crate::analysis::measure::independent::Correlated;
use crate::analysis::read::Run;
use crate::analysis::statistics::{mean, median};

/// One loop of one satellite: a row of `jitter.csv`. Sigmas and limits are in `unit`: chips, degrees or
/// hertz.
#[derive(Clone, Debug, Serialize)]
pub struct LinkJitter {
    /// The satellite.
    pub sv: String,
    /// Name of the signal.
    pub signal: &'static str,
    /// Which loop.
    #[serde(rename = "loop")]
    pub which: Loop,
    /// Unit of sigmas and limits: chips, degrees or hertz.
    pub unit: &'static str,
    /// As the receiver measured it, mean over what is counted here.
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
    /// How many independent values they are worth.
    pub independent: f64,
    /// Their mean.
    pub mean: f64,
    /// Their standard deviation.
    pub sigma: f64,
    /// Half width of the 95 % interval of `sigma`, relative.
    pub sigma_interval: f64,
    /// Standard deviation by theory, of thermal noise alone.
    pub thermal_theory_sigma: f64,
    /// The same, of the oscillators alone.
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
    /// Whether the rule is kept.
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

/// What all satellites' rows of one loop come to; of several thresholds the least.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Pooled {
    /// Of the discriminator's values.
    pub raw_sigma: Option<f64>,
    /// Theory of the same.
    pub raw_theory_sigma: Option<f64>,
    /// Of the closed loop.
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
    pub fn measure(run: &Run, errors: &Errors) -> Result<Self, JudgeError> {
        let Some(settings) = Settings::of(run) else { return Ok(Self::default()) };
        let access = MultipleAccess::new(run);
        let mut rows = Vec::new();
        for link in &errors.signals.keys().collect::<Vec<_>>() {
            let all = errors.signals.rows(*link)?;
            let stretches = settled(&all, |row| run.scene.expect.bounded(row.time_s));
            if stretches.iter().map(Vec::len).sum::<usize>() < 10 {
                continue;
            }
            let updates = updates(run, *link, &stretches)?;
            let times: Vec<f64> = updates.iter().map(|row| row.integration_s).collect();
            let Some(update_s) = median(&times) else { continue };
            let Some(theory) = Theory::new(run, settings, link, update_s) else { continue };
            // Times of samples by the sampler's clock are near enough to GPS time here.
            let span = (all.first(), all.last());
            let (Some(first), Some(last)) = span else { continue };
            let Some(timeline) = Timeline::of(run, &access, *link)? else { continue };
            let stresses = Stresses::new(&theory, &timeline, link, (first.time_s, last.time_s));
            for which in [Loop::Dll, Loop::Pll, Loop::Fll] {
                rows.extend(row(link, which, &stretches, &updates, &theory, &stresses));
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

/// Stretches of observations past their pull-in, without interruption, where the scene does not expect any
/// errors.
fn settled(all: &[SignalError], bounded: impl Fn(&SignalError) -> bool) -> Vec<Vec<SignalError>> {
    // A scene that expects them throughout is measured all the same.
    let any = all.iter().any(&bounded);
    let past: Vec<SignalError> =
        all.iter().filter(|row| row.locked_s >= PULL_IN_S && (bounded(row) || !any)).copied().collect();
    let steps: Vec<f64> = past.windows(2).map(|two| two[1].time_s - two[0].time_s).collect();
    let usual_s = median(&steps).unwrap_or(0.0);
    past.chunk_by(|a, b| b.locked_s > a.locked_s && b.time_s - a.time_s < 1.5 * usual_s).map(<[_]>::to_vec).collect()
}

/// What a loop update put out.
struct Update {
    integration_s: f64,
    dll_chips: f64,
    pll_cycles: f64,
    fll_hz: f64,
}

/// Loop updates within those stretches, pull-in left out.
fn updates(run: &Run, link: Link, stretches: &[Vec<SignalError>]) -> Result<Vec<Update>, JudgeError> {
    let spans: Vec<(u64, u64)> =
        stretches.iter().filter_map(|rows| Some((rows.first()?.sample, rows.last()?.sample))).collect();
    let mut found = Vec::new();
    run.tracking.each(link, |row| {
        let update = Update {
            integration_s: row.integration_s,
            dll_chips: row.dll_discriminator_chips,
            pll_cycles: row.pll_discriminator_cycles,
            fll_hz: row.fll_discriminator_hz,
        };
        found.extend(spans.iter().any(|(from, to)| (*from..=*to).contains(&row.sample)).then_some(update));
    })?;
    Ok(found)
}

fn row(
    link: &Link,
    which: Loop,
    stretches: &[Vec<SignalError>],
    updates: &[Update],
    theory: &Theory,
    stresses: &Stresses,
) -> Option<LinkJitter> {
    let error = |row: &SignalError| match which {
        Loop::Dll => row.code_m / theory.chip_m,
        Loop::Pll => 360.0 * row.carrier_cycles,
        Loop::Fll => row.doppler_hz,
    };
    let groups: Vec<Vec<f64>> = stretches.iter().map(|rows| rows.iter().map(error).collect()).collect();
    let all: Vec<f64> = groups.iter().flatten().copied().collect();
    let middle = mean(&all)?;
    let centred: Vec<Vec<f64>> =
        groups.iter().map(|group| group.iter().map(|value| value - middle).collect()).collect();
    let found = Correlated::about_zero(&centred)?;
    let sigma = found.variance().sqrt();
    let put_out: Vec<f64> = updates
        .iter()
        .filter(|row| (row.integration_s - theory.update_s).abs() < 1e-9)
        .map(|row| match which {
            Loop::Dll => row.dll_chips,
            Loop::Pll => 360.0 * row.pll_cycles,
            Loop::Fll => row.fll_hz,
        })
        .collect();
    let cn0_dbhz = mean(&stretches.iter().flatten().map(|row| row.cn0_dbhz).collect::<Vec<_>>())?;
    let (raw_theory, thermal) = theory.noise(which, libm::pow(10.0, cn0_dbhz / 10.0));
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
        raw_sigma: crate::analysis::statistics::std(&put_out),
        raw_theory_sigma: (!put_out.is_empty()).then_some(raw_theory),
        values: all.len(),
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
