//! Errors of a plain receiver, and their limits under a scene's reflections and spoofers.
//!
//! The methods of a foreign receiver are unknown. Random errors are judged by those of a plain one: early
//! minus late power a chip apart, a code loop of two hertz, a phase loop of 18 Hz, no smoothing. Limits:
//! reflections are bounded and not predicted, since phases and spacing decide about the sign of their error.

use std::collections::BTreeMap;

use crate::error::JudgeError;
use crate::expect::theory::dll::{self, Discriminator};
use crate::expect::theory::edges;
use crate::judge::foreign::measured::ObservationError;
use crate::measure::spoofing::Claims;
use crate::read::Run;
use crate::statistics::{mean, rms, std};
use crate::waveform::leading;
use gnss::earth::SPEED_OF_LIGHT_MPS;
use gnss::facts::FaultKind;
use gnss::signal::{Link, Signal};
use gnss::time::Epoch;

/// Bandwidth of a plain receiver's code loop, hertz.
pub(super) const PLAIN_HZ: f64 = 2.0;
/// Distance of early and late of a plain receiver, chips.
const PLAIN_CHIPS: f64 = 1.0;
/// Least that code edges between samples cost a replica of whole chips, rms: GNSS-SDR's satellites have
/// biases of up to 0.45 m at 2.6 Msps, three times what folds back there from edges that are averaged.
const EDGES_M: f64 = 0.5;
/// Bounds count as so many standard deviations where errors of several satellites or times add up.
const BOUND_SIGMAS: f64 = 3.0;
/// Rule of thumb for a phase loop (Kaplan and Hegarty, 5.6): 15 degrees of jitter.
pub(super) const PHASE_CYCLES: f64 = 15.0 / 360.0;
/// Bandwidth of a plain receiver's phase loop, hertz.
pub(super) const PHASE_HZ: f64 = 18.0;
/// Factor from that bandwidth to the natural frequency at a damping of 0.707: 1.89 B.
const NATURAL: f64 = 1.89;
/// Age of a plain receiver's Doppler: half an integration and the delay of its loop.
const AGE_S: f64 = 0.1;
/// A loop that a spoofer, a jammer or a fault has moved is back within so long.
const RETURN_S: f64 = 5.0;

/// Jitter of a plain receiver's pseudorange.
pub(super) fn code_m(link: &Link, cn0_dbhz: f64) -> Option<f64> {
    let component = leading(link.signal)?;
    let cn0_hz = component.power_share * libm::pow(10.0, 0.1 * cn0_dbhz);
    let sigma = dll::jitter_chips(Discriminator::EarlyMinusLate, PLAIN_CHIPS, PLAIN_HZ, component.period_s(), cn0_hz);
    Some(sigma * SPEED_OF_LIGHT_MPS / component.chip_rate_hz)
}

/// Jitter of a plain receiver's Doppler at the phase jitter up to which its loop holds: σ·ωₙ/2π.
pub(super) fn doppler_hz() -> f64 {
    PHASE_CYCLES * NATURAL * PHASE_HZ
}

/// Doppler error in hertz by its age, for a rate of the Doppler.
pub(super) fn aged_hz(rate_hzps: f64) -> f64 {
    AGE_S * rate_hzps.abs()
}

/// Independent errors of a loop among `count` ones over `span_s`.
pub(super) fn independent(count: usize, span_s: f64, bandwidth_hz: f64) -> f64 {
    (count as f64).min(2.0 * bandwidth_hz * span_s).max(1.0)
}

/// Largest shift of one satellite's signal by reflections.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Reach {
    /// Shift of the code, metres.
    pub code_m: f64,
    /// Shift of the carrier, cycles.
    pub carrier_cycles: f64,
    /// Mean change of the strength, dB.
    pub cn0_db: f64,
    /// Standard deviation of the change, dB.
    pub cn0_sigma_db: f64,
}

impl Reach {
    /// Shift by the rays of the truth. Each moves a code by at most half its amplitude in spacings, and by
    /// its excess relative to the rest of the direct ray. It moves a carrier by the arc sine of all
    /// amplitudes.
    fn of(run: &Run, link: Link) -> Result<Self, JudgeError> {
        let Some(component) = leading(link.signal) else { return Ok(Self::default()) };
        let chip_m = SPEED_OF_LIGHT_MPS / component.chip_rate_hz;
        // Sum of amplitudes, metres moved, and the sum of direct and reflected rays at the prompt.
        let mut epochs: BTreeMap<u64, (f64, f64, (f64, f64))> = BTreeMap::new();
        run.rays.each(link, |ray| {
            let (amplitude, moved_m, sum) = epochs.entry(ray.sample).or_insert((0.0, 0.0, (1.0, 0.0)));
            *amplitude += ray.amplitude_ratio;
            let most_m = 0.5 * PLAIN_CHIPS * chip_m * ray.amplitude_ratio;
            *moved_m += most_m.min(ray.amplitude_ratio * ray.excess_m);
            let prompt = ray.amplitude_ratio * (1.0 - ray.excess_m / chip_m).max(0.0);
            let (sin, cos) = libm::sincos(std::f64::consts::TAU * ray.phase_cycles);
            *sum = (sum.0 + prompt * cos, sum.1 + prompt * sin);
        })?;
        let (mut reach, mut fades_db) = (Self::default(), Vec::new());
        for (amplitude, moved_m, sum) in epochs.into_values() {
            let left = (1.0 - amplitude).max(0.1);
            reach.code_m = reach.code_m.max((moved_m / left).min(0.5 * PLAIN_CHIPS * chip_m));
            let angle = if amplitude < 1.0 { libm::asin(amplitude) } else { std::f64::consts::PI };
            reach.carrier_cycles = reach.carrier_cycles.max(angle / std::f64::consts::TAU);
            fades_db.push(20.0 * libm::log10(libm::hypot(sum.0, sum.1).max(0.1)));
        }
        reach.cn0_db = mean(&fades_db).unwrap_or(0.0);
        reach.cn0_sigma_db = std(&fades_db).unwrap_or(0.0);
        Ok(reach)
    }
}

/// Effects of the scene on the satellites over time.
pub(super) struct Scene<'r> {
    pub run: &'r Run,
    reach: BTreeMap<Link, Reach>,
    edges_m: BTreeMap<&'static str, f64>,
    /// Seconds from sample 0 to where labels count from.
    offset_s: f64,
    /// Largest shifts that spoofers claim.
    pub claims: Claims,
    /// Largest change of a range's rate by a mirror, m/s.
    mirrors_mps: f64,
}

impl<'r> Scene<'r> {
    pub fn of(run: &'r Run) -> Result<Self, JudgeError> {
        let first = run.trajectory.first();
        // Labels count from the second that is nearest to the truth's first row.
        let offset_s = first.map_or(0.0, |row| {
            run.time_s(row.sample) - row.time().since(Epoch::new(row.gps_s, row.gps_fraction_s.round()))
        });
        let mut reach = BTreeMap::new();
        for link in run.rays.keys() {
            reach.insert(link, Reach::of(run, link)?);
        }
        let edges = |signal: &&'static Signal| {
            let averaged_m = edges::averaged_m(signal, run.scene.waveform, run.rate_hz(signal));
            (signal.name, averaged_m.max(EDGES_M))
        };
        let edges_m = run.signals.iter().map(edges).collect();
        let mut mirrors_mps = 0.0_f64;
        if !reach.is_empty() {
            run.trajectory.each(|row| mirrors_mps = mirrors_mps.max(2.0 * row.velocity_mps().norm()))?;
        }
        Ok(Self { run, reach, edges_m, offset_s, claims: Claims::of(run)?, mirrors_mps })
    }

    /// Largest change of a range's rate by a mirror or the motion that a spoofer claims, m/s.
    pub fn rate_mps(&self) -> f64 {
        self.mirrors_mps + self.claims.speed_mps
    }

    /// Seconds from sample 0 by the sampler's clock of a label.
    pub fn time_s(&self, label_s: f64) -> f64 {
        label_s + self.offset_s
    }

    /// Shift of a signal by reflections.
    pub fn reach(&self, link: &Link) -> Reach {
        self.reach.get(link).copied().unwrap_or_default()
    }

    /// Shift of codes by reflections, as a standard deviation over satellites and times, metres.
    pub fn reach_m(&self) -> f64 {
        let all: Vec<f64> = self.reach.values().map(|reach| reach.code_m / BOUND_SIGMAS).collect();
        rms(&all).unwrap_or(0.0)
    }

    /// Change of a range's rate by mirrors, as a standard deviation, m/s.
    pub fn mirrors_mps(&self) -> f64 {
        self.rate_mps() / BOUND_SIGMAS
    }

    /// Code error of a signal by edges between samples, rms in metres. For averaged edges it is that of the
    /// aliases, but not less than for a replica of whole chips.
    pub fn edges_m(&self, signal: &Signal) -> f64 {
        self.edges_m.get(signal.name).copied().unwrap_or(EDGES_M)
    }

    /// Largest code error by edges over all signals, metres.
    pub fn usual_edges_m(&self) -> f64 {
        self.edges_m.values().copied().fold(EDGES_M, f64::max)
    }

    /// True if errors at a label follow from noise and reflections. It is false where a spoofer sends. It is
    /// also false where the scene expects errors and has no reflections that would explain them.
    pub fn is_bounded(&self, label_s: f64) -> bool {
        let time_s = self.time_s(label_s);
        let spoofed = self.claims.while_s.is_some_and(|(from_s, to_s)| (from_s..to_s + RETURN_S).contains(&time_s));
        let expected = self.run.scene.expect.bounded_since(time_s, RETURN_S) || !self.reach.is_empty();
        expected && !spoofed
    }

    /// True if noise and reflections are the measure for all observations. Then they are also the measure for
    /// figures of the whole file.
    pub fn is_always_bounded(&self) -> bool {
        let expected = self.run.scene.expect.always_bounded() || !self.reach.is_empty();
        expected && self.claims.while_s.is_none() && self.run.scene.faults.is_empty()
    }

    /// True if a satellite sends right ranges at a label.
    pub fn is_sound(&self, link: &Link, label_s: f64) -> bool {
        let time_s = self.time_s(label_s);
        let ranges = [FaultKind::ClockStep, FaultKind::ClockRamp, FaultKind::ClockNoise];
        !self.run.scene.faults.iter().any(|fault| {
            let own = fault.satellites.as_ref().is_none_or(|list| list.contains(&link.sv));
            own && ranges.contains(&fault.kind) && time_s >= fault.from_s
        })
    }

    /// True if any satellite has a fault that moves positions at a label.
    pub fn is_faulty(&self, label_s: f64) -> bool {
        self.run.scene.faults.iter().any(|fault| self.time_s(label_s) >= fault.from_s)
    }

    /// True if an observation is judged by noise and reflections.
    pub fn judges(&self, row: &ObservationError) -> bool {
        self.is_bounded(row.label_s) && self.is_sound(&row.link, row.label_s)
    }
}
