//! Laws of a receiver's channels on one signal: noise of code, carrier and C/N0, and the times that each
//! stage takes.
//!
//! The code loop's noise is that of its discriminator and bandwidth (Kaplan and Hegarty, Understanding GPS
//! 2nd ed., 5.6.3, with the slope and the noise correlation of the waveform); its errors are a first-order
//! process. The carrier's noise is the closed phase loop's answer to independent errors of its discriminator.
//! Limits: linear loops; the third-order loop's errors are a first-order process of its own correlation.

use generator::fidelity::CodeEdge;
use generator::scene::Scene;
use gnss::earth::SPEED_OF_LIGHT_MPS;
use gnss::signal::{Component, Layers, PeakTable, Signal};
use receiver::correlate::Edge;
use receiver::followed::Followed;
use receiver::lead::{beside, followed_db, lead};
use receiver::position::CodeNoise;
use receiver::settings::Settings;
use receiver::track::loops::{CodeShape, Gains, Rates, step};
use receiver::track::{ReplicaModel, TrackingSettings};

use crate::correlations::Plan;

/// Steps a chip of the tables of peaks.
const STEPS_PER_CHIP: f64 = 1024.0;
/// Half the distance in chips over which slopes are taken.
const SLOPE_CHIPS: f64 = 1e-3;
/// Updates of a loop that its answer to one error is followed for.
const UPDATES: usize = 4000;
/// Code periods over which phase lock is averaged before symbols are known.
const LOCK_PERIODS: f64 = 100.0;
/// Symbols that a search for their edges takes at least.
const EDGE_SYMBOLS: f64 = 25.0;
/// Prompts that a search for a secondary code takes at least.
const SECONDARY_PROMPTS: f64 = 20.0;

/// Answer of a phase loop to independent errors of its discriminator, of unit variance.
#[derive(Clone, Debug)]
pub(super) struct Answer {
    /// Variance of the phase at any position in an interval.
    pub phase: f64,
    /// Variance of the rate, per squared second.
    pub rate_per_s2: f64,
    /// Phase errors after an error of one, update by update.
    errors: Vec<f64>,
    update_s: f64,
}

impl Answer {
    fn new(gains: &Gains, update_s: f64) -> Self {
        let (mut rates, mut phase, mut errors, mut of_rates) = (Rates::default(), 0.0, Vec::new(), Vec::new());
        for number in 0..UPDATES {
            let error = if number == 0 { 1.0 } else { 0.0 } - phase;
            let before = rates.mean(update_s);
            let (next, jump) = step(gains, &rates, error, update_s);
            phase += 0.5 * before * update_s + jump + 0.5 * next.mean(update_s) * update_s;
            rates = next;
            errors.push(phase);
            of_rates.push(rates.mean(update_s));
        }
        let square = |values: &[f64]| values.iter().map(|value| value * value).sum::<f64>();
        let rate_per_s2 = square(&of_rates);
        // Within an interval the phase runs on at the rate, half an interval to either side.
        let phase = square(&errors) + rate_per_s2 * update_s * update_s / 12.0;
        Self { phase, rate_per_s2, errors, update_s }
    }

    /// Correlation of phase errors that lie so many seconds apart.
    fn correlation(&self, apart_s: f64) -> f64 {
        let lag = (apart_s / self.update_s).round() as usize;
        let pairs = self.errors.iter().zip(self.errors.iter().skip(lag));
        let square = self.errors.iter().map(|value| value * value).sum::<f64>();
        pairs.map(|(one, other)| one * other).sum::<f64>() / square.max(f64::MIN_POSITIVE)
    }
}

/// Everything about channels on a signal that does not depend on the satellite.
pub(super) struct Law {
    /// Index of the front end.
    pub front: usize,
    /// Index of the component that is followed, and the component.
    pub lead: usize,
    pub component: &'static Component,
    /// Index of the component whose message is read.
    pub data: usize,
    /// Code periods of a symbol.
    pub periods_per_symbol: i64,
    /// True if the carrier's half cycle is known without the message.
    pub is_pilot: bool,
    /// Replica of the component among those of the plan.
    pub made: usize,
    pub code: CodeNoise,
    /// Correlation of what is sent with the replica.
    pub found: PeakTable,
    /// Distance at which the main peak ends.
    pub reach_chips: f64,
    pub spacing_chips: f64,
    /// Ratio of the C/N0 that a channel states to that which its replica meets.
    pub stated: f64,
    /// Energy of a symbol over the noise density, at a C/N0 of the whole signal of one hertz.
    pub symbol_s: f64,
    pub tracking: TrackingSettings,
    pub gains: Gains,
    pub pll: Answer,
    /// Lag of the phase loop over the jerk of the carrier, or over its acceleration for a loop of order two.
    lag: (f64, u32),
    /// Correlation of errors of carrier and code over a tick.
    pub carrier_memory: f64,
    code_root: (f64, f64),
    /// Length of a coherent sum of a search and the number of sums, of all components.
    pub search: (f64, u32),
    /// Code periods of what is summed for an estimate of C/N0.
    pub group: u32,
    /// Loss of a search by its grid, as a share of power.
    pub grid: f64,
}

impl Law {
    /// Law of a signal that a front end receives, for ticks so many seconds apart; `None` where it cannot be
    /// followed.
    pub fn new(
        (scene, plan, front): (&Scene, &Plan<'_>, usize),
        signal: &'static Signal,
        settings: &Settings,
        tick_s: f64,
    ) -> Option<Self> {
        let component = lead(signal)?;
        let place = |one: &Component| signal.components.iter().position(|other| std::ptr::eq(other, one));
        let followed = Followed::of(signal, settings)?;
        let tracking = settings.tracking.fitted(component);
        let is_pilot = component.message.is_none();
        let message = if is_pilot { beside(component, signal)? } else { component };
        let rate_hz = scene.clock.rate.hz();
        let peaks = |one: &Component| peaks(one, scene, &settings.tracking);
        let (found, own) = peaks(component)?;
        let shape = shape(&found, &own, &tracking);
        let assumed = ReplicaModel::new(&tracking, component, rate_hz)?.shape;
        let steepness = |shape: &CodeShape| shape.slope / shape.value;
        let gain = steepness(&shape) / steepness(&assumed);
        let share = |one: &Component, (found, own): &(PeakTable, PeakTable)| {
            one.power_share * found.value(0.0) * found.value(0.0) / own.value(0.0)
        };
        let of_message = share(message, &peaks(message)?);
        let update_s = followed.integration_s;
        let code = CodeNoise {
            chip_m: SPEED_OF_LIGHT_MPS / component.chip_rate_hz,
            share: share(component, &(found.clone(), own)),
            shape,
            discriminator: tracking.dll_discriminator,
            bandwidth_hz: gain * tracking.dll_bandwidth_hz,
            integration_s: update_s,
        };
        let gains = Gains::design(tracking.pll_order, tracking.pll_bandwidth_hz * update_s);
        let pll = Answer::new(&gains, update_s);
        let lag = match tracking.pll_order {
            3 => update_s * update_s * update_s / gains.acceleration,
            _ => update_s * update_s / gains.rate,
        };
        let of_code = Gains::design(1, tracking.dll_bandwidth_hz * update_s);
        let pps = message.periods_per_symbol()?;
        let group = if is_pilot { receiver::track::pilot_group(component.period_s()) } else { pps };
        Some(Self {
            front,
            lead: place(component)?,
            component,
            data: place(message)?,
            periods_per_symbol: i64::from(pps),
            is_pilot,
            made: plan.followed(signal, place(component)?, settings)?,
            stated: code.share / libm::pow(10.0, 0.1 * followed_db(component, settings.tracking.waveform)),
            code,
            reach_chips: reach_chips(&found),
            found,
            spacing_chips: tracking.spacing_chips,
            symbol_s: of_message * f64::from(pps) * message.period_s(),
            carrier_memory: pll.correlation(tick_s),
            gains,
            pll,
            lag: (lag, tracking.pll_order),
            code_root: ((1.0 - gain * of_code.phase).max(0.0), update_s),
            tracking,
            search: (followed.search.coherent_s, followed.search.sums * followed.search.components.len() as u32),
            group,
            grid: 0.8,
        })
    }

    /// Correlation of the code loop's errors that lie so many seconds apart.
    pub fn code_memory(&self, apart_s: f64) -> f64 {
        let (root, update_s) = self.code_root;
        libm::pow(root, apart_s / update_s)
    }

    /// Variance of the phase in squared radians, and of the rate in squared hertz, at a C/N0.
    pub fn carrier_variance(&self, cn0_hz: f64) -> (f64, f64) {
        let snr = self.code.integration_s * self.code.share * cn0_hz;
        let raw_rad2 = (1.0 + 1.0 / (2.0 * snr)) / (2.0 * snr);
        let turn = std::f64::consts::TAU;
        (raw_rad2 * self.pll.phase, raw_rad2 * self.pll.rate_per_s2 / (turn * turn))
    }

    /// Lag of the phase loop in cycles behind a carrier with that acceleration and jerk, in cycles.
    pub fn lag_cycles(&self, acceleration: f64, jerk: f64) -> f64 {
        let (factor, order) = self.lag;
        factor * if order == 3 { jerk } else { acceleration }
    }

    /// Seconds from the end of a search to phase lock.
    pub fn lock_s(&self) -> f64 {
        self.tracking.fll_pull_in_s + LOCK_PERIODS * self.component.period_s()
    }

    /// Seconds from phase lock to known symbols, at a C/N0.
    pub fn symbols_s(&self, cn0_hz: f64) -> f64 {
        let period_s = self.component.period_s();
        // Square of a prompt over the variance of its noise.
        let square = 2.0 * period_s * self.code.share * cn0_hz;
        if self.is_pilot {
            // The next shift has a few tenths of the best one's sum; they have to be six deviations apart.
            let length = f64::from(self.component.secondary_code.periods());
            return period_s * SECONDARY_PROMPTS.max(144.0 / square.max(1e-3)).max(0.3 * length.min(400.0));
        }
        if self.periods_per_symbol == 1 {
            return 0.0;
        }
        // Neighbours lose 2/M of the energy, M periods a symbol; five deviations have to part them.
        let symbols = EDGE_SYMBOLS.max(50.0 / square.max(1e-3));
        symbols * self.periods_per_symbol as f64 * period_s
    }
}

/// Correlation of a component, as it is sent, with the replica that a receiver makes, and of that with
/// itself.
fn peaks(component: &Component, scene: &Scene, tracking: &TrackingSettings) -> Option<(PeakTable, PeakTable)> {
    let sent = scene.fidelity.waveform;
    let [found, own] = match tracking.waveform {
        Layers::Strongest => component.shapes_by(sent, component.strongest()?),
        Layers::Whole => [component.shape_between(sent, Layers::Whole), component.shape()],
    };
    let sample = component.chip_rate_hz / scene.clock.rate.hz();
    let local = if tracking.replica == Edge::Area { sample } else { 0.0 };
    let incoming = if scene.fidelity.code_edge == CodeEdge::Area { sample } else { 0.0 };
    let table = |shape, widths| PeakTable::boxed(shape, widths, STEPS_PER_CHIP);
    Some((table(&found, [incoming, local]), table(&own, [local, local])))
}

/// Distance in chips at which a peak stops falling.
fn reach_chips(found: &PeakTable) -> f64 {
    let at = |step: u32| found.value(f64::from(step) / STEPS_PER_CHIP);
    let falls = (1..2 * STEPS_PER_CHIP as u32).take_while(|step| at(*step) < at(step - 1) - 1e-9);
    f64::from(falls.last().unwrap_or(1)) / STEPS_PER_CHIP
}

/// Shape of a correlation at the taps of the discriminator.
fn shape(found: &PeakTable, own: &PeakTable, tracking: &TrackingSettings) -> CodeShape {
    let slope =
        |chips: f64| (found.value(chips + SLOPE_CHIPS) - found.value(chips - SLOPE_CHIPS)) / (2.0 * SLOPE_CHIPS);
    let at = |chips: f64| (found.value(chips), slope(chips));
    CodeShape::of(tracking.dll_discriminator, tracking.spacing_chips, at, |chips| own.value(chips))
}
