//! Code-carrier divergence that all channels share.
//!
//! One oscillator behind sampling and mixing moves code and carrier alike. An error of the mixer, or samples
//! at another rate than stated, separates them: the carrier exceeds the code's Doppler by the same frequency
//! on every satellite. A [`Line`] measures this offset on one channel, from the phases that the replica's
//! code and carrier have counted. [`common`] joins the channels, and an [`Offset`] decides when the estimate
//! is accepted.
//!
//! **Noise.** Code noise of a loop of bandwidth B is correlated as exp(−4Bt). A line through T seconds of it
//! has the slope's variance 12σ²τ/T³ with τ = 1/(2B), when T ≫ τ (less before). σ² grows with B, so that σ²τ,
//! and with it the slope, does not depend on B. At 45 dB-Hz (σ = 0.58 m at 0.5 Hz, 3.1 carrier cycles) that
//! is 11 Hz/T^1.5 for one satellite and 3.7 Hz/T^1.5 for eight: 4 Hz after a second, 0.12 Hz after ten, 0.02
//! Hz after thirty.
//!
//! Limits: an ionosphere that changes for all satellites alike, or a turning antenna, looks the same. The
//! first is below [`LEAST_HZ`], the second is removed like an oscillator's offset. Multipath counts by its
//! scatter between satellites.

use std::fmt;

use serde::Serialize;

use crate::correlate::TURN;
use crate::lead::lead;
use gnss::signal::Link;
use gnss::time::Rate;

/// Seconds of a line's memory, beyond which the past fades.
const MEMORY_S: f64 = 30.0;
/// Seconds between points of a line at least.
const STEP_S: f64 = 0.045;
/// Points before a line has a slope.
const LEAST_POINTS: u32 = 6;
/// Satellites that have to agree.
const LEAST_LINES: usize = 3;
/// The share of all lines that has to agree.
const AGREEING_SHARE: f64 = 0.66;
/// Standard deviations within which lines agree.
const AGREEING_SIGMAS: f64 = 5.0;
/// Difference in hertz within which lines agree, for errors other than noise (multipath).
const AGREEING_HZ: f64 = 3.0;
/// Standard deviations beyond which an offset is accepted: 1e-9 a look, with a look each 50 ms of which few
/// are independent.
const BELIEVED_SIGMAS: f64 = 6.0;
/// Least offset in hertz that is accepted. An ionosphere whose delay changes by 5 mm/s everywhere makes a
/// code-carrier divergence of 0.05 Hz.
pub const LEAST_HZ: f64 = 0.1;
/// A change of the offset by more moves the code loops by more than their noise (0.5 m).
const RESTART_HZ: f64 = 5.0;

/// Phases that a replica has counted at the beginning of a code period.
#[derive(Clone, Copy, Debug)]
pub struct Phases {
    /// Sample at which the period begins.
    pub sample: u64,
    /// Code periods, and chips of the running one.
    pub periods: u64,
    /// Chips of the running period.
    pub chips: f64,
    /// Carrier without the nominal IF in the sense of Doppler, in 2⁻⁶⁴ turns.
    pub carrier: i128,
}

impl Phases {
    /// Cycles by which the carrier has outrun the code since `earlier`.
    pub fn parted_cycles(&self, earlier: &Self, link: Link, rate: Rate) -> f64 {
        let Some(component) = lead(link.signal) else { return 0.0 };
        let passed_s = rate.elapsed_s(self.sample.saturating_sub(earlier.sample));
        let periods = (i128::from(self.periods) - i128::from(earlier.periods)) as f64;
        let chips = periods * f64::from(component.code_chips) + self.chips - earlier.chips;
        // Code Doppler first, in chips: both products are near 1e5 a second and differ by a few.
        let doppler_chips = chips - component.chip_rate_hz * passed_s;
        let carrier = (self.carrier - earlier.carrier) as f64 / TURN;
        carrier - doppler_chips * link.carrier_hz() / component.chip_rate_hz
    }
}

/// A frequency and its standard deviation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimate {
    /// The frequency.
    pub hz: f64,
    /// Standard deviation of the frequency, in hertz.
    pub sigma_hz: f64,
}

/// A least-squares line through what code and carrier of one channel have parted by, with a memory that
/// fades.
///
/// The gains of a growing memory, (4n−2)/(n(n+1)) and 6/(n(n+1)), make the recursion the exact line through n
/// points.
#[derive(Clone, Debug, Default)]
pub struct Line {
    last: Option<Phases>,
    points: u32,
    /// Last point of the line less the value measured there, in carrier cycles.
    ahead_cycles: f64,
    hz: f64,
    span_s: f64,
}

impl Line {
    /// Forgets everything.
    pub fn clear(&mut self) {
        *self = Self::default();
    }

    /// Takes a replica's state, if enough time has passed since the last.
    pub fn take(&mut self, phases: Phases, link: Link, rate: Rate) {
        let Some(last) = self.last else {
            (self.last, self.points) = (Some(phases), 1);
            return;
        };
        let passed_s = rate.elapsed_s(phases.sample.saturating_sub(last.sample));
        if passed_s < STEP_S {
            return;
        }
        let moved = phases.parted_cycles(&last, link, rate);
        self.span_s = (self.span_s + passed_s).min(MEMORY_S);
        if self.span_s < MEMORY_S {
            self.points += 1;
        }
        let n = f64::from(self.points);
        let (alpha, beta) = ((4.0 * n - 2.0) / (n * (n + 1.0)), 6.0 / (n * (n + 1.0)));
        let miss = moved - (self.ahead_cycles + self.hz * passed_s);
        self.ahead_cycles = -(1.0 - alpha) * miss;
        self.hz += beta * miss / passed_s;
        self.last = Some(phases);
    }

    /// The slope, for code noise of `sigma_cycles` behind a loop of `bandwidth_hz`.
    pub fn estimate(&self, sigma_cycles: f64, bandwidth_hz: f64) -> Option<Estimate> {
        let variance =
            12.0 * sigma_cycles * sigma_cycles / (2.0 * bandwidth_hz) / (self.span_s * self.span_s * self.span_s);
        (self.points >= LEAST_POINTS).then(|| Estimate { hz: self.hz, sigma_hz: variance.sqrt() })
    }

    /// Code phase less the line's forecast at `phases`, in carrier cycles.
    pub fn code_ahead_cycles(&self, phases: &Phases, link: Link, rate: Rate) -> Option<f64> {
        let last = self.last.as_ref()?;
        let passed_s = rate.elapsed_s(phases.sample.checked_sub(last.sample)?);
        Some(self.ahead_cycles + self.hz * passed_s - phases.parted_cycles(last, link, rate))
    }
}

/// Estimate that most of the channels agree on: the weighted mean of those near the weighted median.
pub fn common(lines: &[Estimate]) -> Option<Estimate> {
    let mut sorted = lines.to_vec();
    sorted.sort_by(|a, b| a.hz.total_cmp(&b.hz));
    let weight = |line: &Estimate| 1.0 / (line.sigma_hz * line.sigma_hz);
    let half = 0.5 * sorted.iter().map(weight).sum::<f64>();
    let mut sum = 0.0;
    let median = sorted.iter().find(|line| {
        sum += weight(line);
        sum >= half
    })?;
    let near = |line: &&Estimate| (line.hz - median.hz).abs() <= AGREEING_SIGMAS * line.sigma_hz + AGREEING_HZ;
    let agreeing: Vec<&Estimate> = sorted.iter().filter(near).collect();
    if agreeing.len() < LEAST_LINES || (agreeing.len() as f64) < AGREEING_SHARE * lines.len() as f64 {
        return None;
    }
    let weights: f64 = agreeing.iter().map(|line| weight(line)).sum();
    let hz = agreeing.iter().map(|line| weight(line) * line.hz).sum::<f64>() / weights;
    let scatter: f64 = agreeing.iter().map(|line| weight(line) * (line.hz - hz) * (line.hz - hz)).sum();
    let excess = (scatter / (agreeing.len() - 1) as f64).max(1.0);
    Some(Estimate { hz, sigma_hz: (excess / weights).sqrt() })
}

/// Effect of a new estimate on the offset in use.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Change {
    /// The offset stays as it was.
    None,
    /// The offset is known better.
    Refined,
    /// The offset is a new one: loops that ran with the old one have to be moved.
    Moved,
}

/// The offset in use: none until one is believed.
#[derive(Clone, Copy, Debug, Default)]
pub struct Offset {
    believed: Option<Estimate>,
}

impl Offset {
    /// The offset, once it is believed.
    pub fn believed(&self) -> Option<Estimate> {
        self.believed
    }

    /// The offset, 0 while none is believed.
    pub fn hz(&self) -> f64 {
        self.believed.map_or(0.0, |offset| offset.hz)
    }

    /// Takes the channels' common estimate.
    pub fn take(&mut self, new: Estimate) -> Change {
        let old = self.believed;
        let believed = match old {
            None => new.hz.abs() > BELIEVED_SIGMAS * new.sigma_hz + LEAST_HZ,
            Some(old) => {
                let apart =
                    (new.hz - old.hz).abs() > BELIEVED_SIGMAS * libm::hypot(new.sigma_hz, old.sigma_hz) + LEAST_HZ;
                apart || new.sigma_hz <= 1.1 * old.sigma_hz
            }
        };
        if !believed {
            return Change::None;
        }
        self.believed = Some(new);
        if (new.hz - old.map_or(0.0, |old| old.hz)).abs() > RESTART_HZ { Change::Moved } else { Change::Refined }
    }
}

/// Code-carrier divergence that a reception found.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Parted {
    /// The carrier's Doppler over the code's, in hertz of the carrier.
    pub offset_hz: f64,
    /// Standard deviation of the offset, in hertz.
    pub sigma_hz: f64,
    /// Offset as an error of the sample rate, in parts per million: the true rate over the stated one, less
    /// one.
    pub rate_error_ppm: f64,
    /// Intermediate frequency without the offset, if the mixer causes it, in hertz.
    pub if_hz: f64,
    /// Sample rate without the offset, if the sampler causes it, in hertz.
    pub rate_hz: f64,
    /// Gain of the clock behind the samples, by the latest fix.
    pub code_drift: Option<f64>,
}

/// One of two explanations is taken for the likely one when the clock's gain by the other is so many times as
/// large.
const LIKELIER: f64 = 3.0;
/// Relative clock error that is more than the usual part in a million of an oscillator.
const UNUSUAL: f64 = 1e-6;

impl fmt::Display for Parted {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { offset_hz, sigma_hz, rate_error_ppm, if_hz, rate_hz, .. } = self;
        write!(f, "the carrier runs {offset_hz:+.2} Hz (sigma {sigma_hz:.2}) ahead of the code")?;
        let mixer = format!("the local oscillator is off (--if-hz {if_hz:.1} removes it)");
        let rate = format!("the sample rate is {:+.3} ppm off (--rate-hz {rate_hz:.3} removes it)", rate_error_ppm);
        // With the one, samples have the better clock; with the other, the mixer.
        let carrier_drift = self.code_drift.map(|code| code - 1e-6 * rate_error_ppm);
        match (self.code_drift.map(f64::abs), carrier_drift.map(f64::abs)) {
            (Some(code), Some(carrier)) if carrier > LIKELIER * code && carrier > UNUSUAL => write!(f, ": {mixer}"),
            (Some(code), Some(carrier)) if code > LIKELIER * carrier && code > UNUSUAL => write!(f, ": {rate}"),
            _ => write!(f, ": {mixer}, or {rate}"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use gnss::gps::l1ca::L1_CA;
    use gnss::satellite::Sv;

    const RATE_HZ: f64 = 2.6e6;

    /// Standard normal draws: the sum of twelve uniforms.
    fn noise(state: &mut u64) -> f64 {
        let uniform = |state: &mut u64| {
            *state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (*state >> 11) as f64 / (1_u64 << 53) as f64
        };
        (0..12).map(|_| uniform(state)).sum::<f64>() - 6.0
    }

    /// A line through `seconds` of a channel whose carrier is `ahead_hz` ahead, with code noise of a loop of
    /// `bandwidth_hz`.
    fn line(seconds: f64, ahead_hz: f64, sigma_cycles: f64, bandwidth_hz: f64, state: &mut u64) -> Line {
        let (mut line, mut error, step) = (Line::default(), sigma_cycles * noise(state), 130_000);
        let keep = libm::exp(-4.0 * bandwidth_hz * step as f64 / RATE_HZ);
        for k in 0..=(seconds * RATE_HZ / step as f64) as u64 {
            let t_s = (k * step) as f64 / RATE_HZ;
            let doppler_hz = 1234.5;
            let chips = (1.023e6 + doppler_hz / 1540.0) * t_s + error / 1540.0;
            let periods = (chips / 1023.0).floor();
            let turns = (doppler_hz + ahead_hz) * t_s;
            let phases = Phases {
                sample: k * step,
                periods: (10.0 + periods) as u64,
                chips: chips - 1023.0 * periods,
                carrier: (turns * TURN) as i128,
            };
            line.take(phases, L1_CA.link(Sv::gps(1)), Rate::from_hz(RATE_HZ).unwrap());
            error = keep * error + (1.0 - keep * keep).sqrt() * sigma_cycles * noise(state);
        }
        line
    }

    #[test]
    fn a_line_without_noise_has_the_carriers_lead_as_its_slope() {
        for ahead_hz in [0.0, -0.3, 5000.0] {
            let found = line(5.0, ahead_hz, 0.0, 0.5, &mut 1).estimate(3.0, 0.5).unwrap();
            // Chips of five seconds resolve 1e-9, 1e-6 cycles, over 50 ms steps.
            assert!((found.hz - ahead_hz).abs() < 1e-4, "{found:?}");
        }
    }

    #[test]
    fn a_lines_slope_has_the_stated_deviation_after_ten_and_twenty_seconds() {
        let mut state = 3;
        for seconds in [10.0, 20.0] {
            let lines: Vec<Estimate> =
                (0..400).map(|_| line(seconds, 7.0, 3.1, 0.5, &mut state).estimate(3.1, 0.5).unwrap()).collect();
            let variance = lines.iter().map(|l| (l.hz - 7.0) * (l.hz - 7.0)).sum::<f64>() / 400.0;
            let ratio = variance.sqrt() / lines[0].sigma_hz;
            // 400 draws know a deviation to 3.5 %, four of these are 14 %; the law leaves out terms of τ/T,
            // 10 % at 10 s.
            assert!((0.72..1.15).contains(&ratio), "{seconds} s: {ratio}");
        }
    }

    #[test]
    fn channels_that_part_alike_are_joined_and_a_wrong_one_is_left_out() {
        let of = |hz: f64| Estimate { hz, sigma_hz: 1.0 };
        let found = common(&[of(99.0), of(100.0), of(101.0), of(700.0)]).unwrap();
        assert!((found.hz - 100.0).abs() < 1e-12 && (found.sigma_hz - 1.0 / 3_f64.sqrt()).abs() < 1e-12, "{found:?}");
        assert_eq!(common(&[of(0.0), of(0.0)]), None);
        assert_eq!(common(&[of(-900.0), of(-300.0), of(200.0), of(800.0), of(801.0), of(802.0)]), None);
    }

    #[test]
    fn an_offset_within_its_noise_is_never_used_and_one_beyond_moves_the_loops() {
        let mut offset = Offset::default();
        assert_eq!(offset.take(Estimate { hz: 1.0, sigma_hz: 0.2 }), Change::None);
        assert_eq!(offset.hz(), 0.0);
        assert_eq!(offset.take(Estimate { hz: 100.0, sigma_hz: 10.0 }), Change::Moved);
        // A worse estimate that agrees changes nothing; a better one refines.
        assert_eq!(offset.take(Estimate { hz: 80.0, sigma_hz: 20.0 }), Change::None);
        assert_eq!(offset.take(Estimate { hz: 98.0, sigma_hz: 1.0 }), Change::Refined);
        assert_eq!(offset.take(Estimate { hz: 200.0, sigma_hz: 5.0 }), Change::Moved);
    }
}
