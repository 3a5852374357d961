//! The receiver's loops against theory over a grid: measured jitter of truth minus oscillator over the
//! predicted one.
//!
//! Where T·C/N0 is at least 10 and B·T at most 0.36 the ratio must be one within 5 % (10 % for the frequency
//! loop) or the measurement's own uncertainty; outside, the cause of a deviation is named. Every cell runs
//! until its spread is known to a stated precision. Thermal noise alone; unlimited bandwidth.

use serde::Serialize;

use super::correlation::Correlation;
use super::correlator::{Case, Loss, Outcome, run};
use super::expect::{self, Jitter};
use super::measure::{Moments, relative_error};
use super::motion::Motion;
use gnss::gps::l1ca;
use receiver::track::closed::Mode;
use receiver::track::{CodeDiscriminator, TrackingSettings};

/// Quantity that a cell measures.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Quantity {
    /// Degrees.
    Phase,
    /// Chips.
    Code,
    /// Hertz.
    Frequency,
}

/// One cell of the grid.
#[derive(Clone, Debug)]
pub struct Cell {
    /// Quantity that is compared.
    pub quantity: Quantity,
    /// The channel that is simulated.
    pub case: Case,
}

/// A cell measured; sigmas in the unit of its quantity.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ProofRow {
    /// Quantity that is compared.
    pub quantity: Quantity,
    /// Name of the set of loops that run.
    pub mode: String,
    /// Integrators of the loop.
    pub order: u32,
    /// Discriminator, by name.
    pub discriminator: String,
    /// Distance of early and late, chips.
    pub spacing_chips: f64,
    /// Coherent integration, seconds.
    pub integration_s: f64,
    /// One-sided noise bandwidth, Hz.
    pub bandwidth_hz: f64,
    /// C/N0, dB-Hz.
    pub cn0_dbhz: f64,
    /// T·C/N0.
    pub snr: f64,
    /// Bandwidth times integration.
    pub bandwidth_time: f64,
    /// Standard deviation by theory.
    pub theory: f64,
    /// Standard deviation of the simulation.
    pub measured: f64,
    /// Measured over theory.
    pub ratio: f64,
    /// Relative standard error of `measured`.
    pub uncertainty: f64,
    /// Mean error.
    pub mean: f64,
    /// Time simulated, seconds.
    pub simulated_s: f64,
    /// Slips of the phase.
    pub slips: u64,
    /// True if the signal was lost.
    pub lost: bool,
    /// True if the linear theory is claimed to hold.
    pub in_region: bool,
    /// Largest deviation of the ratio from one that is allowed in the region.
    pub bar: f64,
    /// Reason why the ratio deviates by more than the bar; empty where it does not.
    pub cause: String,
}

/// Least T·C/N0 and largest B·T of the region in which theory must hold.
pub const LEAST_SNR: f64 = 10.0;
/// Bandwidth times integration up to which the linear theory claims to hold.
pub const LARGEST_BANDWIDTH_TIME: f64 = 0.36;
/// Allowed deviations there.
pub const BAR: f64 = 0.05;
/// Largest relative deviation from theory of a frequency's jitter.
pub const FREQUENCY_BAR: f64 = 0.10;
/// Shortest run, seconds: twenty wraps of a pair of prompts at T·C/N0 = 10 and T = 1 ms.
const LEAST_S: f64 = 1000.0;
/// Standard errors of a measurement that are allowed beyond: 0.3 % false alarms a cell where they rule.
const SIGMAS: f64 = 3.0;

fn cell(quantity: Quantity, mode: Mode, settings: TrackingSettings, cn0_dbhz: f64) -> Cell {
    let case = Case {
        signal: &l1ca::L1_CA,
        component: &l1ca::L1_CA.components[0],
        settings,
        mode,
        cn0_dbhz: Some(cn0_dbhz),
        motion: Motion::default(),
        oscillator: None,
        correlation: Correlation::Triangle,
        // What their detectors do is another matter than the loops.
        watched: false,
        start_chips: 0.0,
        settle_s: 0.0,
        duration_s: 0.0,
        seed: 0,
    };
    Cell { quantity, case }
}

/// Periods of 1 ms an integration, with the C/N0 to try there.
const INTEGRATIONS: [(u32, &[f64]); 4] = [
    (1, &[30.0, 35.0, 40.0, 45.0, 50.0]),
    (4, &[30.0, 35.0, 40.0, 45.0, 50.0]),
    (10, &[27.0, 30.0, 35.0, 40.0, 45.0]),
    (20, &[27.0, 30.0, 35.0, 40.0, 45.0]),
];

fn phase_cells() -> Vec<Cell> {
    let mut cells = Vec::new();
    for (integration, levels) in INTEGRATIONS {
        for order in [2, 3] {
            for bandwidth_hz in [5.0, 10.0, 18.0] {
                for &dbhz in levels {
                    let settings = TrackingSettings {
                        integration,
                        pll_order: order,
                        pll_bandwidth_hz: bandwidth_hz,
                        ..TrackingSettings::default()
                    };
                    cells.push(cell(Quantity::Phase, Mode::Phase, settings, dbhz));
                }
            }
        }
    }
    for bandwidth_hz in [5.0, 18.0] {
        for dbhz in [35.0, 40.0, 45.0, 50.0] {
            let settings = TrackingSettings { pll_bandwidth_hz: bandwidth_hz, ..TrackingSettings::default() };
            cells.push(cell(Quantity::Phase, Mode::Assisted, settings, dbhz));
        }
    }
    cells
}

fn code_cells() -> Vec<Cell> {
    let mut cells = Vec::new();
    for (integration, levels) in INTEGRATIONS {
        for (order, bandwidth_hz) in [(1, 0.5), (1, 2.0), (2, 1.0)] {
            for spacing_chips in [0.1, 0.25, 0.5, 1.0] {
                for discriminator in [CodeDiscriminator::EarlyMinusLate, CodeDiscriminator::DotProduct] {
                    for &dbhz in levels.iter().step_by(2) {
                        let settings = TrackingSettings {
                            integration,
                            dll_order: order,
                            dll_bandwidth_hz: bandwidth_hz,
                            dll_discriminator: discriminator,
                            spacing_chips,
                            ..TrackingSettings::default()
                        };
                        cells.push(cell(Quantity::Code, Mode::Phase, settings, dbhz));
                    }
                }
            }
        }
    }
    cells
}

fn frequency_cells() -> Vec<Cell> {
    let mut cells = Vec::new();
    for order in [1, 2] {
        for bandwidth_hz in [2.0, 5.0, 10.0, 40.0] {
            for dbhz in [35.0, 40.0, 45.0, 50.0] {
                let settings = TrackingSettings {
                    fll_order: order,
                    fll_bandwidth_hz: bandwidth_hz,
                    ..TrackingSettings::default()
                };
                cells.push(cell(Quantity::Frequency, Mode::Frequency, settings, dbhz));
            }
        }
    }
    cells
}

/// The grid. Cells draw different noise.
pub fn grid() -> Vec<Cell> {
    let mut cells = [phase_cells(), code_cells(), frequency_cells()].concat();
    cells.iter_mut().enumerate().for_each(|(index, cell)| cell.case.seed = index as u64 + 1);
    cells
}

/// Jitter that theory predicts for a cell, in the unit of its quantity.
fn predict(cell: &Cell) -> Option<Jitter> {
    match cell.quantity {
        Quantity::Phase => expect::phase_cycles(&cell.case),
        Quantity::Code => expect::code_chips(&cell.case),
        Quantity::Frequency => expect::frequency_hz(&cell.case),
    }
}

impl Quantity {
    /// Moments of the quantity in an outcome, and the factor to its unit.
    fn of(self, outcome: &Outcome) -> (Moments, f64) {
        match self {
            Self::Phase => (outcome.phase_cycles, 360.0),
            Self::Code => (outcome.code_chips, 1.0),
            Self::Frequency => (outcome.frequency_hz, 1.0),
        }
    }
}

impl Cell {
    /// T·C/N0 and B·T of the loop that is measured: exact, but nominal for a frequency loop.
    fn place(&self, jitter: &Jitter) -> (f64, f64) {
        let update_s = self.case.update_s();
        let bandwidth_hz = match self.quantity {
            Quantity::Frequency => self.case.settings.fll_bandwidth_hz,
            Quantity::Phase | Quantity::Code => jitter.bandwidth_hz,
        };
        let cn0_hz = self.case.cn0_dbhz.map_or(f64::INFINITY, |dbhz| libm::pow(10.0, dbhz / 10.0));
        (update_s * cn0_hz, update_s * bandwidth_hz)
    }

    /// True if theory must hold for this cell.
    pub fn in_region(&self) -> bool {
        predict(self).is_some_and(|jitter| {
            let (snr, bandwidth_time) = self.place(&jitter);
            // The grid's values lie on the limits but for rounding: 27 dB-Hz in 20 ms is 10.02.
            snr >= LEAST_SNR * (1.0 - 1e-9) && bandwidth_time <= LARGEST_BANDWIDTH_TIME * (1.0 + 1e-9)
        })
    }
}

/// Runs a cell until its spread is known to `uncertainty` (relative standard error). `None` where theory has
/// no value for it or nothing could be measured.
pub fn measure(cell: &Cell, uncertainty: f64) -> Option<ProofRow> {
    let jitter = predict(cell)?;
    let update_s = cell.case.update_s();
    let correlated_s = jitter.updates_per_value * update_s;
    let mut case = cell.case.clone();
    // ν values give 1/√(2ν). Wraps are rare and need a time of their own.
    let least_s = if case.mode == Mode::Phase { 0.0 } else { LEAST_S };
    case.duration_s = f64::max(least_s, 0.5 / (uncertainty * uncertainty) * correlated_s);
    // Ten correlation times leave e⁻¹⁰ of the start; the C/N0 estimate has its own.
    case.settle_s = 10.0 * correlated_s + 5.0 * case.settings.cn0_average_s;
    let outcome = run(&case);
    Some(row(cell, &jitter, &outcome))
}

fn row(cell: &Cell, jitter: &Jitter, outcome: &Outcome) -> ProofRow {
    let (case, settings) = (&cell.case, &cell.case.settings);
    let update_s = case.update_s();
    let (moments, unit) = cell.quantity.of(outcome);
    let (order, discriminator) = match (cell.quantity, settings.dll_discriminator) {
        (Quantity::Phase, _) => (settings.pll_order, "atan"),
        (Quantity::Frequency, _) => (settings.fll_order, "atan of overlapping pairs"),
        (Quantity::Code, CodeDiscriminator::EarlyMinusLate) => (settings.dll_order, "early minus late"),
        (Quantity::Code, CodeDiscriminator::DotProduct) => (settings.dll_order, "dot product"),
        (Quantity::Code, CodeDiscriminator::DoubleDelta) => (settings.dll_order, "double delta"),
    };
    let (snr, bandwidth_time) = cell.place(jitter);
    let (theory, measured) = (jitter.sigma * unit, moments.sigma().unwrap_or(f64::NAN) * unit);
    let uncertainty = relative_error((moments.count as f64 / jitter.updates_per_value).max(1.0));
    let allowed = if cell.quantity == Quantity::Frequency { FREQUENCY_BAR } else { BAR };
    let mut row = ProofRow {
        quantity: cell.quantity,
        mode: format!("{:?}", case.mode).to_lowercase(),
        order,
        discriminator: discriminator.to_owned(),
        spacing_chips: settings.spacing_chips,
        integration_s: update_s,
        bandwidth_hz: bandwidth_time / update_s,
        cn0_dbhz: case.cn0_dbhz.unwrap_or(f64::INFINITY),
        snr,
        bandwidth_time,
        theory,
        measured,
        ratio: measured / theory,
        uncertainty,
        mean: moments.mean().unwrap_or(f64::NAN) * unit,
        simulated_s: moments.count as f64 * update_s,
        slips: outcome.slips,
        lost: outcome.lost.is_some(),
        in_region: cell.in_region(),
        bar: allowed.max(SIGMAS * uncertainty),
        cause: String::new(),
    };
    if !row.holds() {
        row.cause = cause(&row, outcome.lost.map(|(_, loss)| loss)).to_owned();
    }
    row
}

impl ProofRow {
    /// True if the ratio is within its bar, over the whole run.
    pub fn holds(&self) -> bool {
        !self.lost && (self.ratio - 1.0).abs() <= self.bar
    }
}

/// Reason why a cell deviates from linear theory.
fn cause(row: &ProofRow, lost: Option<Loss>) -> &'static str {
    match (lost, row.quantity) {
        (Some(Loss::Declared), _) => "given up by the receiver's detectors",
        (Some(Loss::Code), _) => "code left the peak",
        (Some(Loss::Carrier), _) => "carrier left the discriminator's range",
        (None, _) if row.slips > 0 => "cycle slips",
        (None, Quantity::Phase) if row.mode == "assisted" => "wraps of the frequency discriminator",
        (None, Quantity::Phase) => "arctangent saturates: its gain falls",
        (None, Quantity::Frequency) => "wraps of the frequency discriminator",
        (None, Quantity::Code) if 3.0 * row.measured > 0.5 * row.spacing_chips => {
            "3 sigma beyond d/2: the slope of the discriminator falls"
        }
        (None, Quantity::Code) => "noise in the quotient's denominator",
    }
}
