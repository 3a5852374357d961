//! Position, velocity and time from observations and decoded ephemerides.
//!
//! A [`Solver`] smooths code with carrier ([`smooth`]), finds where satellites were, corrects the atmosphere
//! by the decoded ionosphere (until then by a nominal one, [`ionosphere`]) and its own [`gnss::troposphere`],
//! solves ([`least_squares`]), with a clock for each time scale, and tests the residuals, leaving out the
//! fewest satellites that contradict the others ([`exclusion`]). Two carriers of a satellite are used in the
//! [`combination`] without ionosphere. What augmentation systems say of satellites and the ionosphere is
//! applied where it is received ([`augmentation`]). Limits: delays of one band's front end against another's
//! are not estimated.

use std::collections::BTreeMap;

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};
use thiserror::Error;

use crate::described::described;
use crate::track::CodeDiscriminator;
use crate::track::loops::CodeShape;
use gnss::augmentation::Content;
use gnss::earth::Geodetic;
use gnss::ionosphere::{Coefficients, Model, NAVIC_HZ};
use gnss::klobuchar::{L1_HZ, NOMINAL};
use gnss::record::{ClockRow, Fix, IntegrityRow, IonosphereModel, IonosphereRow, Observation, SightRow};
use gnss::satellite::Sv;
use gnss::signal::Signal;
use gnss::time::{Epoch, Rate, SampleClock, TimePolynomial, TimeScale};

mod air;
pub mod augmentation;
pub mod combination;
mod degradation;
mod dispersion;
mod electrons;
pub mod exclusion;
pub mod ionosphere;
pub mod least_squares;
pub mod protection;
mod ranges;
mod records;
mod reduced;
mod roots;
mod sets;
pub mod smooth;
#[cfg(test)]
mod tests;

use air::Air;
use augmentation::Augmentation;
use electrons::Electrons;
pub use exclusion::{Consistent, chi_square_threshold, consistent, without_faults};
use ionosphere::{DelayError, Delays, NOMINAL_ERROR};
use least_squares::{COORDINATES, Corrections, Ionosphere, LARGEST_CONDITION, Range, SPACE_M, freedom, scales};
use protection::IntegritySettings;
use records::{clocks, fix, sights};
use reduced::InShort;
pub use sets::Sets;
use smooth::Smoother;

/// Correction of the ionosphere.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum IonosphereChoice {
    /// Ionosphere-free combination where a satellite is observed on two carriers; otherwise `Broadcast`.
    Combined,
    /// Model that satellites send: Klobuchar's where received signals carry it, else NeQuick-G, else BDGIM. A
    /// nominal ionosphere with its error is used until the coefficients are decoded.
    Broadcast,
    /// Klobuchar's model only.
    Klobuchar,
    /// NeQuick-G only.
    NequickG,
    /// BDGIM only.
    Bdgim,
    /// No correction: for recordings made without an ionosphere.
    None,
}

impl IonosphereChoice {
    /// The model whose coefficients correct, where signals are received that bring them.
    pub fn model(self, signals: &[&'static Signal]) -> Option<Model> {
        let brought = |model: Model| {
            let messages = signals.iter().flat_map(|signal| signal.components.iter().filter_map(|c| c.message));
            messages.into_iter().any(|message| message.ionosphere.model == model).then_some(model)
        };
        let klobuchar = Model::KLOBUCHAR.into_iter().find_map(brought);
        match self {
            Self::None => None,
            Self::Klobuchar => Some(klobuchar.unwrap_or(Model::Klobuchar)),
            Self::NequickG => Some(Model::NequickG),
            Self::Bdgim => Some(Model::Bdgim),
            Self::Combined | Self::Broadcast => {
                klobuchar.or_else(|| brought(Model::NequickG)).or_else(|| brought(Model::Bdgim))
            }
        }
    }
}

/// Correction of the troposphere.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum TroposphereChoice {
    /// A standard atmosphere, half saturated.
    Standard,
    /// No troposphere: recordings made without one.
    None,
}

/// Use of the messages of augmentation systems about other satellites and the ionosphere.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum SbasChoice {
    /// Corrections and integrity of systems that are fit for safety.
    Corrections,
    /// Corrections and integrity, also of systems in test mode.
    Test,
    /// Nothing: their satellites range and that is all.
    None,
}

/// Difference of two systems' times.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum SystemClocks {
    /// Nothing: each time scale has a clock of its own among the unknowns.
    Estimated,
    /// Offset that the systems broadcast. Each time scale has its own clock until the offset is decoded.
    Broadcast,
}

described! {
/// Choices of the position solution.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct PositionSettings {
    /// Elevation mask, applied once a position below 100 km height is known.
    pub mask_deg: f64,
    /// Time constant of carrier smoothing; 0 for none.
    pub smoothing_s: f64,
    /// Probability that the residual test raises a false alarm.
    pub false_alarm: f64,
    /// Standard deviation of the models' errors at the zenith, for weights; it grows with 1 / sin(elevation).
    pub model_sigma_m: f64,
    /// Correction of the ionosphere. combined: two carriers of a satellite where available, else the model.
    /// broadcast: the model alone, Klobuchar's if received, else NeQuick-G, else BDGIM. klobuchar, nequick_g,
    /// bdgim: that model. none: no correction.
    pub ionosphere: IonosphereChoice,
    /// Standard deviation of the broadcast ionosphere's error as a share of its delay, common to all
    /// satellites. About 0.5 suits a real sky, where the model removes half of the delay. 0 suits scenes
    /// whose satellites broadcast the true ionosphere.
    pub ionosphere_error_share: f64,
    /// Correction of the troposphere.
    pub troposphere: TroposphereChoice,
    /// Wait for the ionosphere's parameters before the first fix.
    pub require_ionosphere: bool,
    /// Time for which the first fix waits for the ionosphere's parameters, counted from the fourth ephemeris;
    /// 0 for a fix at once.
    pub ionosphere_wait_s: f64,
    /// Use the reduced elements of Galileo (word 16) until the whole ephemeris is decoded. A first fix then
    /// comes within 20 s, with errors of metres, at first without the satellites' health.
    pub reduced_elements: bool,
    /// Use of SBAS messages for GPS L1 C/A and the ionosphere. corrections: corrections, integrity and grid,
    /// unless the system is in test mode. test: also in test mode. none: not used.
    pub sbas: SbasChoice,
    /// Treatment of the systems' time offsets. estimated: one clock per system; a second system needs one
    /// satellite more. broadcast: one clock and the offset that Galileo broadcasts, taken as exact; any four
    /// satellites give a fix once it is decoded.
    pub system_clocks: SystemClocks,
}
}

impl Default for PositionSettings {
    fn default() -> Self {
        Self {
            mask_deg: 5.0,
            smoothing_s: 30.0,
            false_alarm: 1e-3,
            model_sigma_m: 0.1,
            ionosphere: IonosphereChoice::Combined,
            ionosphere_error_share: 0.0,
            troposphere: TroposphereChoice::Standard,
            require_ionosphere: false,
            ionosphere_wait_s: 0.0,
            // Metres in place of decimetres, and of satellites that may be unhealthy: only who asks for it.
            reduced_elements: false,
            sbas: SbasChoice::Corrections,
            // Real offsets are off by nanoseconds, metres of range, as estimated ones are not.
            system_clocks: SystemClocks::Estimated,
        }
    }
}

/// Thermal noise of a code loop, from its settings.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CodeNoise {
    /// Length of a chip.
    pub chip_m: f64,
    /// Share of the signal's power that the loop follows: a pilot's, less what its replica does not have.
    pub share: f64,
    /// The correlation that early and late meet: averaging replicas round it and correlate its noise.
    pub shape: CodeShape,
    /// Discriminator of the code loop.
    pub discriminator: CodeDiscriminator,
    /// Bandwidth of the code loop.
    pub bandwidth_hz: f64,
    /// Time of an integration.
    pub integration_s: f64,
}

/// Noise of the code loops by signal.
pub type Noises = Vec<(&'static Signal, CodeNoise)>;

impl CodeNoise {
    /// Standard deviation of a code loop, metres, of a signal of `cn0_hz`.
    ///
    /// With C the power that the loop follows: B·(1−ρ)/(2·C/N0·a′²)·(1 + s) with slope a′ and noise
    /// correlation ρ of early and late. The squaring loss s is (1+ρ)/(2·T·C/N0·a²) of early minus late power,
    /// with height a; on a triangle that is Kaplan and Hegarty's equation 5.23 (2nd ed.), first branch. It is
    /// 1/(T·C/N0) of the dot products, whose prompt has the whole height.
    pub fn sigma_m(&self, cn0_hz: f64) -> f64 {
        let CodeShape { value, slope, common } = self.shape;
        let cn0_hz = planted!("receiver.position.share", self.share, 1.0) * cn0_hz;
        let snr = self.integration_s * cn0_hz;
        let squaring = match self.discriminator {
            CodeDiscriminator::EarlyMinusLate => (1.0 + common) / (2.0 * snr * value * value),
            CodeDiscriminator::DotProduct | CodeDiscriminator::DoubleDelta => 1.0 / snr,
        };
        let spread = (1.0 - common) / (slope * slope);
        self.chip_m * (self.bandwidth_hz * spread / (2.0 * cn0_hz) * (1.0 + squaring)).sqrt()
    }
}

/// Reason why there is no position.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum NoFix {
    /// Fewer ranges than unknowns.
    #[error("{have} satellites with ephemeris: at least {need} are needed")]
    TooFew {
        /// Ranges that there are.
        have: usize,
        /// Ranges that a position takes.
        need: usize,
    },
    #[error(
        "the satellites' directions give no position: condition {condition:.3e}, {} times the largest that is \
         solved, {:e}",
        (condition / LARGEST_CONDITION).ceil(),
        LARGEST_CONDITION
    )]
    /// Directions that give no position.
    Singular {
        /// Ratio of the geometry's singular values.
        condition: f64,
    },
    /// Iterations that do not end.
    #[error("the solution does not converge: the step is {step_m:.0} m after {iterations} iterations")]
    Diverged {
        /// Iterations made.
        iterations: u32,
        /// Length of the last step.
        step_m: f64,
    },
    /// Exactly as many ranges as unknowns, and two positions that explain them.
    #[error(
        "the ranges agree on two positions, {separation_m:.0} m apart, and one more satellite is needed to tell which"
    )]
    TwoPlaces {
        /// Distance of both.
        separation_m: f64,
    },
    /// Exactly as many ranges as unknowns, and no position that explains them.
    #[error(
        "the ranges agree on no position that sees its satellites past the Earth and moves at less than 12 km/s: at \
         least one of them is wrong"
    )]
    Nowhere,
    /// A fault without a satellite that explains it.
    #[error(
        "the ranges contradict each other and no satellite is singled out: chi-square {chi_square:.1} above \
         {threshold:.1}"
    )]
    Inconsistent {
        /// Weighted sum of squared residuals.
        chi_square: f64,
        /// Threshold that the sum has to stay below.
        threshold: f64,
    },
    /// A fault that several satellites explain.
    #[error(
        "the ranges contradict each other, and without {} they agree as well as without {}, on positions \
         {separation_m:.1} m apart",
        names(one),
        names(other)
    )]
    Ambiguous {
        /// Satellites without which the others agree.
        one: Vec<Sv>,
        /// Others without which the rest agrees as well.
        other: Vec<Sv>,
        /// Distance of both positions.
        separation_m: f64,
    },
    /// Parameters that the settings wait for.
    #[error(
        "the ionosphere's parameters are awaited: {waited_s:.1} s so far, of {}",
        limit_s.map_or("any time, as position.require_ionosphere is set".to_owned(), |s| format!("{s:.1} s at most"))
    )]
    AwaitingIonosphere {
        /// Time since the first fix was possible.
        waited_s: f64,
        /// The longest wait, if there is one.
        limit_s: Option<f64>,
    },
}

fn names(svs: &[Sv]) -> String {
    svs.iter().map(Sv::to_string).collect::<Vec<_>>().join(" ")
}

/// A fix and what the records do not hold.
#[derive(Clone, Debug)]
pub struct Solved {
    /// The record.
    pub fix: Fix,
    /// The clock against each time scale.
    pub clocks: Vec<ClockRow>,
    /// Directions of the satellites that have an ephemeris.
    pub sights: Vec<SightRow>,
    /// The ionosphere of satellites with two bands.
    pub ionosphere: Vec<IonosphereRow>,
    /// Protection levels, where they are asked for.
    pub integrity: Option<IntegrityRow>,
    /// Satellites in it.
    pub used: Vec<Sv>,
    /// Satellites that the residual test left out, with their distance from the others' solution.
    pub excluded: Vec<(Sv, f64)>,
}

/// Solves epoch after epoch.
#[derive(Clone, Debug)]
pub struct Solver {
    settings: PositionSettings,
    noises: Noises,
    smoother: Smoother,
    air: Air,
    /// Smoothing of the differences of two carriers.
    dispersion: Smoother,
    electrons: Electrons,
    rate: Rate,
    last_m: Option<Vector3<f64>>,
    ready_since: Option<u64>,
    /// Elements in short.
    reduced: BTreeMap<Sv, InShort>,
    /// Offsets of other system times from GPS time.
    ahead: Vec<(&'static TimeScale, TimePolynomial)>,
    /// Messages of augmentation systems.
    augmentation: Augmentation,
    /// Choices of protection levels, where they are asked for.
    integrity: Option<IntegritySettings>,
    /// Latest residual test of all ranges: weighted sum of squares and degrees of freedom.
    tested: Option<(f64, usize)>,
}

impl Solver {
    /// A solver for loops with such noise.
    pub fn new(settings: &PositionSettings, noises: Noises, rate: Rate) -> Self {
        let bandwidth_hz = noises.first().map_or(1.0, |(_, noise)| noise.bandwidth_hz);
        let smoother = Smoother::new(settings.smoothing_s, bandwidth_hz, rate);
        let window_s = if settings.smoothing_s > 0.0 { dispersion::WINDOW_S } else { 0.0 };
        let dispersion = Smoother::new(window_s, bandwidth_hz, rate);
        Self {
            settings: settings.clone(),
            noises,
            smoother,
            air: Air::default(),
            dispersion,
            electrons: Electrons::default(),
            rate,
            last_m: None,
            ready_since: None,
            reduced: BTreeMap::new(),
            ahead: Vec::new(),
            augmentation: Augmentation::default(),
            integrity: None,
            tested: None,
        }
    }

    /// States by how much the carrier's Doppler exceeds the code's, in hertz of the carrier: smoothing and
    /// velocity leave it out, so that the clock's drift is that of the code, whose bias the position has.
    /// `signals` are those of one front end.
    pub fn set_carrier_offset(&mut self, signals: &[&'static Signal], hz: f64) {
        for smoother in [&mut self.smoother, &mut self.dispersion] {
            signals.iter().for_each(|signal| smoother.set_carrier_offset(signal, hz));
        }
    }

    /// Takes what a system says that its time is ahead of GPS time.
    pub fn take_ahead(&mut self, scale: &'static TimeScale, ahead: TimePolynomial) {
        self.ahead.retain(|(known, _)| **known != *scale);
        self.ahead.push((scale, ahead));
    }

    /// Takes what a satellite of an augmentation system says of others in a block that began at `sent`.
    pub fn take_augmentation(&mut self, from: Sv, sent: Epoch, content: &Content) {
        if self.settings.sbas != SbasChoice::None {
            self.augmentation.take(from, sent, content, self.settings.sbas == SbasChoice::Test);
        }
    }

    /// Samples of the front end with these signals were lost or doubled: carriers are whole to a quarter of a
    /// cycle, or were lost.
    pub fn jump(&mut self, signals: &[&'static Signal], carriers_whole: bool) {
        for smoother in [&mut self.smoother, &mut self.dispersion] {
            if carriers_whole { smoother.bridge(signals) } else { smoother.clear(signals) }
        }
    }

    /// Solves from the observations of one sample.
    ///
    /// # Errors
    /// Reason for which there is no position.
    pub fn solve(
        &mut self,
        sample: u64,
        clock: SampleClock,
        observations: &[Observation],
        ephemerides: &Sets,
        sent: Option<Coefficients>,
    ) -> Result<Solved, NoFix> {
        let offered = self.ranges(observations, ephemerides);
        let (ranges, grid) = self.chosen(offered);
        let measured = self.measured_ionosphere(observations, ephemerides);
        if freedom(&ranges) < 0 || ranges.is_empty() {
            let need = COORDINATES + scales(&ranges).len().max(1);
            return Err(NoFix::TooFew { have: ranges.len(), need });
        }
        if ranges.iter().any(|range| !range.is_combined) {
            self.await_ionosphere(sample, sent.is_some() || grid.is_some())?;
        }
        let mut corrections = Corrections {
            ionosphere: Ionosphere::Absent,
            troposphere: self.settings.troposphere == TroposphereChoice::Standard,
            model_sigma_m: self.settings.model_sigma_m,
        };
        // An integral along the line of sight wants to know where that is.
        let start_m = match (self.last_m, sent) {
            (None, Some(Coefficients::NequickG(_))) => {
                roots::first(&ranges, Vector3::zeros(), &corrections)?.position_m
            }
            (last_m, _) => last_m.unwrap_or_else(Vector3::zeros),
        };
        let (ionosphere, model) = self.ionosphere(sent, &ranges, &start_m);
        let (ionosphere, model) = match grid {
            Some(grid) => (Ionosphere::Grid(grid, Box::new(ionosphere)), IonosphereModel::Grid),
            None => (ionosphere, model),
        };
        corrections.ionosphere = ionosphere;
        let first = match self.last_m.map(|last_m| least_squares::position(&ranges, last_m, &corrections)) {
            None => roots::first(&ranges, start_m, &corrections)?,
            Some(Ok(near)) if roots::is_possible(&ranges, &near) => near,
            // A stale estimate may be too far away, also for its atmosphere.
            Some(Ok(_) | Err(NoFix::Diverged { .. })) => roots::first(&ranges, Vector3::zeros(), &corrections)?,
            Some(Err(error)) => return Err(error),
        };
        let in_space = Geodetic::from_ecef(&first.position_m).height_m >= SPACE_M;
        let mask_rad = if in_space { f64::NEG_INFINITY } else { self.settings.mask_deg.to_radians() };
        let mut sights = sights(sample, &ranges, &first);
        let count = ranges.len();
        let visible: Vec<Range> = ranges
            .into_iter()
            .zip(&first.elevations_rad)
            .filter(|(_, elevation_rad)| **elevation_rad >= mask_rad)
            .map(|(range, _)| range)
            .collect();
        // Where none is below the mask, the first solution is that of all.
        let all = if visible.len() == count {
            first
        } else {
            least_squares::position(&visible, first.position_m, &corrections)?
        };
        self.air.compare(&visible, &all, &corrections, all.position_m);
        self.tested = exclusion::tested(&visible, &all);
        let (kept, solution, excluded) = without_faults(visible, all, &corrections, self.settings.false_alarm)?;
        let (velocity_mps, drift) = least_squares::velocity(&kept, &solution)?;
        self.last_m = Some(solution.position_m);
        let mut used: Vec<Sv> = kept.iter().map(|range| range.sv).collect();
        used.sort();
        used.dedup();
        let counts = [used.len(), kept.len()];
        let combined = kept.iter().all(|range| range.is_combined);
        let model = if combined { IonosphereModel::Combined } else { model };
        let fix = fix(sample, clock, &solution, velocity_mps, drift, counts, &excluded, model);
        let clocks = clocks(sample, &solution);
        sights.iter_mut().for_each(|sight| sight.used = used.contains(&sight.sv));
        let integrity = self.protected(&kept, &solution, &fix, &corrections.ionosphere);
        Ok(Solved { fix, clocks, sights, ionosphere: measured, integrity, used, excluded })
    }

    /// Ionospheric correction near a position, and its name in a fix.
    fn ionosphere(
        &mut self,
        sent: Option<Coefficients>,
        ranges: &[Range],
        place_m: &Vector3<f64>,
    ) -> (Ionosphere, IonosphereModel) {
        if self.settings.ionosphere == IonosphereChoice::None {
            return (Ionosphere::Absent, IonosphereModel::None);
        }
        let (delays, model) = match sent {
            None => {
                let nominal = Ionosphere::Uncertain(Delays::Klobuchar(NOMINAL, L1_HZ), NOMINAL_ERROR);
                return (nominal, IonosphereModel::Nominal);
            }
            Some(Coefficients::Klobuchar(model)) => (Delays::Klobuchar(model, L1_HZ), IonosphereModel::Broadcast),
            Some(Coefficients::KlobucharNavic(model)) => {
                (Delays::Klobuchar(model, NAVIC_HZ), IonosphereModel::Broadcast)
            }
            Some(Coefficients::KlobucharBeidou(model)) => (Delays::Beidou(model), IonosphereModel::Broadcast),
            Some(Coefficients::Bdgim(model)) => (Delays::Bdgim(model), IonosphereModel::Bdgim),
            Some(Coefficients::NequickG(model)) => {
                (Delays::Electrons(self.electrons.of(model, ranges, place_m)), IonosphereModel::NequickG)
            }
        };
        let share = self.settings.ionosphere_error_share;
        if share > 0.0 {
            return (Ionosphere::Uncertain(delays, DelayError { share, least_m: 0.0 }), model);
        }
        (Ionosphere::Known(delays), model)
    }

    /// Advice where the ranges show that the choice of troposphere is wrong.
    pub fn other_troposphere(&self) -> Option<&'static str> {
        self.air.is_otherwise().then_some(match self.settings.troposphere {
            TroposphereChoice::Standard => {
                "the ranges are those of samples without a troposphere: what differs between satellites follows the \
                 mapping of the one that is corrected; position.troposphere = \"none\" leaves that correction out"
            }
            TroposphereChoice::None => {
                "the ranges have a troposphere in them: what differs between satellites follows its mapping; \
                 position.troposphere = \"standard\" corrects it"
            }
        })
    }

    fn await_ionosphere(&mut self, sample: u64, is_known: bool) -> Result<(), NoFix> {
        if is_known || self.settings.ionosphere == IonosphereChoice::None {
            return Ok(());
        }
        let since = *self.ready_since.get_or_insert(sample);
        let waited_s = self.rate.elapsed_s(sample.saturating_sub(since));
        if self.settings.require_ionosphere || waited_s < self.settings.ionosphere_wait_s {
            let limit_s = (!self.settings.require_ionosphere).then_some(self.settings.ionosphere_wait_s);
            Err(NoFix::AwaitingIonosphere { waited_s, limit_s })
        } else {
            Ok(())
        }
    }
}
