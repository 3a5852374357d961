//! Each satellite's loops against theory at the C/N0 that the scene gives them: bias, spread, largest error
//! and C/N0.
//!
//! Every figure of a satellite is put over its own limit, so that the worst satellite speaks for all. Theory
//! is that of [`crate::analysis::measure::jitter`] at the true C/N0 less what front end and converter cost,
//! with the oscillator's noise and the motion's stress. Limits: epochs that interference costs more than
//! `JAMMED_DB`, or whose C/N0 moved by more than `STEADY_DB` within the receiver's averages, are left out.

use std::collections::{BTreeMap, HashMap};

use crate::analysis::error::JudgeError;
use crate::analysis::expect::due::satellite::is_stepping;
use crate::analysis::expect::loops::{Stresses, Theory, update_s};
use crate::analysis::expect::multipath;
use crate::analysis::expect::multiple_access::MultipleAccess;
use crate::analysis::expect::quantile::{largest, mean_square};
use crate::analysis::expect::theory::edges;
use crate::analysis::expect::timeline::Timeline;
use crate::analysis::measure::errors::{Errors, PULL_IN_S, SignalError};
use crate::analysis::measure::jitter::{Loop, Settings};
use crate::analysis::read::Run;
use crate::analysis::statistics::median;
use crate::analysis::waveform::Edge;
use crate::gnss::record::{RayRow, TrackingRow};
use crate::gnss::signal::Link;

/// What interference may cost before thermal theory no longer describes the loops.
const JAMMED_DB: f64 = 1.0;
/// What the true C/N0 may move within [`STEADY_S`] before averages lag.
const STEADY_DB: f64 = 1.0;
const STEADY_S: f64 = 3.0;
/// By how much theory's σ may be too small or too large: 1 dB of C/N0 (1.12), and 7 % between linear loops
/// and real ones; the code's theory leaves out the rounding of both replicas, which lowers jitter by as much
/// again.
const THEORY: f64 = 1.2;
const THEORY_LOW: f64 = 1.35;
/// By how much the codes of other satellites may disturb one satellite more than on average: two codes whose
/// Dopplers differ by whole kilohertz are 24 dB below their peak instead of noise of 38 dB below it in 4 ms;
/// most pairs are near the average.
const WORST_PAIR: f64 = 10.0;
/// A sound estimate of C/N0 is right within this.
pub const CN0_DB: f64 = 1.0;
/// What rounding, light time and knots leave in a carrier: a hundredth of a cycle, and of a hertz.
const REST_CYCLES: f64 = 0.01;
const REST_HZ: f64 = 0.01;
/// Least number of settled observations that are judged.
const LEAST: usize = 30;

/// A figure of the satellite that is nearest to its limit, or farthest beyond.
#[derive(Clone, Debug, PartialEq)]
pub struct Worst {
    /// The satellite, or satellite and signal.
    pub name: String,
    /// Its figure.
    pub value: f64,
    /// Its limit.
    pub limit: f64,
}

/// What is judged satellite by satellite.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Figure {
    /// Mean of the code errors, metres.
    CodeBias,
    /// Largest code error, metres.
    CodeLargest,
    /// Mean of the carrier errors, cycles.
    CarrierBias,
    /// Largest carrier error, cycles.
    CarrierLargest,
    /// Mean of the Doppler errors, Hz.
    DopplerBias,
    /// Largest Doppler error, Hz.
    DopplerLargest,
    /// Jitter of a loop over its theory, against the largest ratio.
    Above(Loop),
    /// Jitter of a loop over its theory, against the smallest ratio.
    Below(Loop),
    /// Spread of a raw discriminator over its theory, against the largest ratio.
    RawAbove(Loop),
    /// Spread of a raw discriminator over its theory, against the smallest ratio.
    RawBelow(Loop),
    /// Mean of a raw discriminator.
    RawBias(Loop),
    /// Mean error of C/N0 among the observations, dB.
    Cn0Bias,
    /// Largest error of C/N0 among the observations, dB.
    Cn0Largest,
    /// Mean error of C/N0 among the loops' updates, dB.
    LoopCn0Bias,
    /// Power of the prompts against their C/N0, dB.
    PromptPower,
    /// Share of the prompts' power in quadrature.
    PromptQuadrature,
}

/// The worst of each figure.
#[derive(Clone, Debug, Default)]
pub struct Links {
    /// The worst satellite of each figure.
    pub worst: BTreeMap<Figure, Worst>,
    /// Satellites whose signal no loop of the receiver's settings can hold.
    pub unheld: Vec<String>,
}

impl Links {
    /// Measures every satellite; nothing where the receiver names no settings.
    ///
    /// # Errors
    /// [`JudgeError::Read`] where spilled rows cannot be read.
    pub fn measure(run: &Run, errors: &Errors) -> Result<Self, JudgeError> {
        let mut links = Self::default();
        let Some(settings) = Settings::of(run) else { return Ok(links) };
        // Without noise other codes alone disturb a loop, and they are no noise.
        if !run.scene.noise {
            return Ok(links);
        }
        let access = MultipleAccess::new(run);
        let costs_db = crate::analysis::expect::spectrum::costs_db(run);
        for link in errors.signals.keys() {
            let Some(update_s) = update_s(run, link.signal) else { continue };
            let Some(theory) = Theory::new(run, settings, &link, update_s) else {
                links.unheld.push(run.name(link));
                continue;
            };
            let cost_db = costs_db.get(link.signal).copied().unwrap_or(0.0);
            let mut rows = settled(&errors.signals.rows(link)?);
            let all = rows.len();
            rows.retain(|row| {
                run.scene.expect.bounded(row.time_s) && !is_stepping(&run.scene.faults, link.sv, row.time_s)
            });
            if rows.len() < all {
                level(&mut rows);
            }
            if rows.len() < LEAST {
                continue;
            }
            let Some(one) = One::new((run, &access), link, &theory, settings, rows, cost_db)? else { continue };
            one.observations(&mut links);
            let spans = one.spans();
            let mut updates = Vec::new();
            run.tracking.each(link, |row| {
                let inside = spans.iter().any(|(from, to)| (*from..=*to).contains(&row.sample));
                updates.extend(inside.then_some(row));
            })?;
            one.updates(&mut links, &updates);
        }
        Ok(links)
    }

    /// Keeps a value if it is the worst so far; a lower limit is kept as such.
    fn put(&mut self, figure: Figure, name: &str, value: f64, limit: f64) {
        let lower = matches!(figure, Figure::Below(_) | Figure::RawBelow(_));
        let over = |value: f64, limit: f64| if lower { limit / value.max(1e-300) } else { value / limit };
        let new = Worst { name: name.to_owned(), value, limit };
        match self.worst.get(&figure) {
            Some(old) if over(old.value, old.limit) >= over(value, limit) => {}
            _ => {
                self.worst.insert(figure, new);
            }
        }
    }
}

/// Observations past their pull-in, without interference and with a steady C/N0.
fn settled(all: &[SignalError]) -> Vec<SignalError> {
    let jammed = |row: &SignalError| row.cn0_true_dbhz - row.cn0_effective_dbhz;
    let least = all.iter().map(jammed).fold(f64::INFINITY, f64::min);
    let (mut begin, mut kept) = (0, Vec::new());
    for (index, row) in all.iter().enumerate() {
        while all.get(begin).is_some_and(|old| row.time_s - old.time_s > STEADY_S) {
            begin += 1;
        }
        let window = all.get(begin..=index).unwrap_or(&[]);
        let (low, high) = window.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), old| {
            (low.min(old.cn0_effective_dbhz), high.max(old.cn0_effective_dbhz))
        });
        if row.locked_s >= PULL_IN_S && high - low <= STEADY_DB && jammed(row) - least <= JAMMED_DB {
            kept.push(*row);
        }
    }
    kept
}

/// Takes the whole and half cycles out of a carrier whose level was found with rows that are no longer there.
fn level(rows: &mut [SignalError]) {
    let middle = median(&rows.iter().map(|row| row.carrier_cycles).collect::<Vec<_>>()).unwrap_or(0.0);
    let halves = 0.5 * (2.0 * middle).round();
    rows.iter_mut().for_each(|row| row.carrier_cycles -= halves);
}

/// What a loop puts out in an update, in its unit.
type Output = fn(&TrackingRow) -> f64;

/// One satellite.
struct One<'a> {
    name: String,
    theory: &'a Theory,
    rows: Vec<SignalError>,
    /// Of rays: code error of each row, and what a carrier may be off by.
    code_m: Vec<f64>,
    ray_cycles: f64,
    ray_db: f64,
    /// Largest error of the code that chip edges leave.
    edge_m: f64,
    /// σ of the loops in their units: with oscillator and motion, without motion; and largest stress.
    sigma: BTreeMap<Loop, [f64; 3]>,
    raw: BTreeMap<Loop, f64>,
    span_s: f64,
    settings: Settings,
    /// C/N0 by which variances go, by which a prompt's power does, in units of the samples' own, and the mean
    /// of its decibels: over an hour in which a satellite rises they are apart by more than a decibel.
    cn0_hz: f64,
    power_hz: f64,
    middle_dbhz: f64,
    cost_db: f64,
    /// Factor of σ that the worst pair of codes makes.
    pair: f64,
    /// Whether samples come as they are received: a filter's noise is not white, and prompts count in units
    /// of white noise.
    white: bool,
}

impl<'a> One<'a> {
    fn new(
        (run, access): (&Run, &MultipleAccess<'_>),
        link: Link,
        theory: &'a Theory,
        settings: Settings,
        rows: Vec<SignalError>,
        cost_db: f64,
    ) -> Result<Option<Self>, JudgeError> {
        let Some(timeline) = Timeline::of(run, access, link)? else { return Ok(None) };
        let (Some(first), Some(last)) = (rows.first(), rows.last()) else { return Ok(None) };
        let stresses = Stresses::new(theory, &timeline, &link, (first.time_s, last.time_s));
        let hz = |row: &SignalError| libm::pow(10.0, (row.cn0_effective_dbhz - cost_db) / 10.0);
        // Variances go with one over C/N0.
        let cn0_hz = rows.len() as f64 / rows.iter().map(|row| 1.0 / hz(row)).sum::<f64>();
        let white_hz = |row: &SignalError| {
            let linear = |db: f64| libm::pow(10.0, db / 10.0);
            access.white_hz(row.sample, link, linear(row.cn0_true_dbhz)) / linear(cost_db)
        };
        let power_hz = rows.iter().map(white_hz).sum::<f64>() / rows.len() as f64;
        let middle_dbhz = rows.iter().map(|row| row.cn0_effective_dbhz - cost_db).sum::<f64>() / rows.len() as f64;
        let share = |row: &SignalError| libm::pow(10.0, (row.cn0_true_dbhz - row.cn0_effective_dbhz) / 10.0) - 1.0;
        let others = rows.iter().map(share).sum::<f64>() / rows.len() as f64;
        // Without noise there is nothing but others.
        let pair = ((1.0 + WORST_PAIR * others) / (1.0 + others)).max(1.0).sqrt();
        let (mut sigma, mut raw) = (BTreeMap::new(), BTreeMap::new());
        for which in [Loop::Dll, Loop::Pll, Loop::Fll] {
            let (put_out, thermal) = theory.noise(which, cn0_hz);
            let (oscillator, stress) = (theory.oscillator(which), stresses.of(which));
            let noise = libm::hypot(thermal, oscillator);
            sigma.insert(which, [libm::hypot(noise, stress.rms()), noise, stress.max]);
            raw.insert(which, put_out);
        }
        let mut rays: HashMap<u64, Vec<(f64, f64, f64)>> = HashMap::new();
        run.rays.each(link, |row: RayRow| {
            rays.entry(row.sample).or_default().push(multipath::ray(&row, theory.chip_m));
        })?;
        let code_m = rows
            .iter()
            .map(|row| {
                rays.get(&row.sample).map_or(0.0, |r| multipath::error_chips(&theory.code, r, theory.spacing_chips()))
            })
            .map(|chips| chips * theory.chip_m)
            .collect();
        let strongest = rays.values().map(|r| r.iter().map(|ray| ray.1).sum::<f64>()).fold(0.0, f64::max).min(0.99);
        let edge_m = match run.scene.code_edge {
            Edge::Area => edges::CREST * edges::averaged_m(link.signal, run.scene.waveform, run.rate_hz(link.signal)),
            _ => 0.0,
        };
        let span_s = 0.1_f64.max(last.time_s - first.time_s);
        Ok(Some(Self {
            name: run.name(link),
            theory,
            code_m,
            // A vector's angle under another of share α beside it, and its length.
            ray_cycles: libm::asin(strongest) / std::f64::consts::TAU,
            ray_db: -20.0 * libm::log10(1.0 - strongest),
            edge_m,
            sigma,
            raw,
            span_s,
            settings,
            cn0_hz,
            power_hz,
            middle_dbhz,
            cost_db,
            pair,
            white: run.scene.front_end.is_empty(),
            rows,
        }))
    }

    /// First and last samples of what is uninterrupted.
    fn spans(&self) -> Vec<(u64, u64)> {
        let broken = |a: &SignalError, b: &SignalError| b.locked_s > a.locked_s && b.time_s - a.time_s < 1.0;
        let spans = self.rows.chunk_by(broken);
        spans.filter_map(|rows| Some((rows.first()?.sample, rows.last()?.sample))).collect()
    }

    /// Independent values of a loop: of a mean 2BT, of a mean square 4BT, no more than there are.
    fn independent(&self, which: Loop, per_bandwidth: f64) -> f64 {
        let bandwidth_hz = match which {
            Loop::Dll => self.settings.dll_bandwidth_hz,
            Loop::Pll | Loop::Fll => self.settings.pll_bandwidth_hz,
        };
        (self.rows.len() as f64).min(per_bandwidth * bandwidth_hz * self.span_s).max(1.0)
    }

    fn observations(&self, links: &mut Links) {
        let code: Vec<f64> = self.rows.iter().zip(&self.code_m).map(|(row, ray_m)| row.code_m - ray_m).collect();
        let ray_m = 0.5 * self.code_m.iter().map(|x| x.abs()).fold(0.0, f64::max);
        let carrier: Vec<f64> = self.rows.iter().map(|row| row.carrier_cycles).collect();
        let doppler: Vec<f64> = self.rows.iter().map(|row| row.doppler_hz).collect();
        let (code_edge_m, carrier_rest) = (self.edge_m + ray_m, REST_CYCLES + self.ray_cycles);
        let metres = self.theory.chip_m;
        self.one(links, [Figure::CodeBias, Figure::CodeLargest], Loop::Dll, &code, metres, code_edge_m);
        let cycles = 1.0 / 360.0;
        self.one(links, [Figure::CarrierBias, Figure::CarrierLargest], Loop::Pll, &carrier, cycles, carrier_rest);
        self.one(links, [Figure::DopplerBias, Figure::DopplerLargest], Loop::Fll, &doppler, 1.0, REST_HZ);
        self.cn0(links, [Figure::Cn0Bias, Figure::Cn0Largest]);
    }

    /// Bias, largest error and spread of one loop's errors, which are in `scale` of the loop's unit; `rest`
    /// is what may come on top.
    fn one(&self, links: &mut Links, figures: [Figure; 2], which: Loop, errors: &[f64], scale: f64, rest: f64) {
        let Some([sigma, noise, stress]) = self.sigma.get(&which).map(|all| all.map(|x| x * scale)) else { return };
        let count = errors.len() as f64;
        let middle = errors.iter().sum::<f64>() / count;
        let factor = largest(1, 1) * THEORY * self.pair / self.independent(which, 2.0).sqrt();
        links.put(figures[0], &self.name, middle.abs(), factor * sigma + stress + rest);
        let most = errors.iter().map(|e| e.abs()).fold(0.0, f64::max);
        links.put(figures[1], &self.name, most, largest(1, errors.len()) * THEORY * self.pair * sigma + stress + rest);
        let spread = errors.iter().map(|e| (e - middle) * (e - middle)).sum::<f64>() / count;
        let (low, high) = mean_square(self.independent(which, 4.0));
        // What is not noise may come and go.
        let top = (high * (THEORY * self.pair * sigma) * (THEORY * self.pair * sigma) + stress * stress + rest * rest)
            .sqrt()
            / sigma;
        links.put(Figure::Above(which), &self.name, spread.sqrt() / sigma, top);
        // A receiver may take a stress away that a loop alone would suffer; noise stays.
        links.put(Figure::Below(which), &self.name, spread.sqrt() / noise, low.sqrt() / THEORY_LOW);
    }

    fn cn0(&self, links: &mut Links, [bias, most]: [Figure; 2]) {
        let off = |row: &SignalError| row.cn0_dbhz - row.cn0_effective_dbhz + self.cost_db;
        let middle = self.rows.iter().map(off).sum::<f64>() / self.rows.len() as f64;
        links.put(bias, &self.name, middle.abs(), CN0_DB + self.ray_db);
        // A noise power of n values is known to 4.34·√(2/n) dB; the averages hold a second of updates.
        let updates = (1.0 / self.theory.update_s).max(2.0);
        let weak = 1.0 + 1.0 / self.theory.snr(self.cn0_hz);
        let sigma_db = 4.343 * (2.0 / updates).sqrt() * weak;
        let largest_db = self.rows.iter().map(|row| off(row).abs()).fold(0.0, f64::max);
        links.put(most, &self.name, largest_db, CN0_DB + self.ray_db + largest(1, self.rows.len()) * sigma_db);
    }

    /// What the loops put out, update by update.
    fn updates(&self, links: &mut Links, rows: &[TrackingRow]) {
        let rows: Vec<&TrackingRow> =
            rows.iter().filter(|row| (row.integration_s - self.theory.update_s).abs() < 1e-9).collect();
        if rows.len() < LEAST {
            return;
        }
        let count = rows.len() as f64;
        let mean = |of: &dyn Fn(&TrackingRow) -> f64| rows.iter().map(|row| of(row)).sum::<f64>() / count;
        let loops: [(Loop, Output); 3] = [
            (Loop::Dll, |row| row.dll_discriminator_chips),
            (Loop::Pll, |row| 360.0 * row.pll_discriminator_cycles),
            (Loop::Fll, |row| row.fll_discriminator_hz),
        ];
        for (which, of) in loops {
            let (Some(raw), Some([_, _, stress])) = (self.raw.get(&which), self.sigma.get(&which)) else { continue };
            let (middle, square) = (mean(&of), mean(&|row| of(row) * of(row)));
            // Rows are taken every few updates: a loop's memory between them is short.
            let (low, high) = mean_square(0.5 * count);
            let sigma = (square - middle * middle).max(0.0).sqrt();
            let top = (high * (THEORY * self.pair * raw) * (THEORY * self.pair * raw) + stress * stress).sqrt() / raw;
            links.put(Figure::RawAbove(which), &self.name, sigma / raw, top);
            links.put(Figure::RawBelow(which), &self.name, sigma / raw, low.sqrt() / THEORY_LOW);
            let limit = largest(1, 1) * THEORY * self.pair * raw * (2.0 / count).sqrt() + stress;
            links.put(Figure::RawBias(which), &self.name, middle.abs(), limit);
        }
        let cn0_off_db = mean(&|row| row.cn0_dbhz) - self.middle_dbhz;
        links.put(Figure::LoopCn0Bias, &self.name, cn0_off_db.abs(), CN0_DB + self.ray_db);
        // In units of noise per component a prompt has the mean power 2 + 2·T·C/N0.
        let power = mean(&|row| row.prompt_i * row.prompt_i + row.prompt_q * row.prompt_q);
        let snr = self.theory.snr(self.cn0_hz);
        let off_db = 10.0 * libm::log10((0.5 * power - 1.0).max(1e-3) / self.theory.snr(self.power_hz));
        let random_db = 4.343 * largest(1, 1) * (2.0 / (snr * count)).sqrt();
        if self.white {
            links.put(Figure::PromptPower, &self.name, off_db.abs(), CN0_DB + self.ray_db + random_db);
        }
        // Beside noise of one component, quadrature holds what the phase loop leaves.
        let (sigma_rad, stress_rad) = self
            .sigma
            .get(&Loop::Pll)
            .map_or((0.0, 0.0), |[sigma, _, stress]| (sigma.to_radians(), stress.to_radians()));
        let ray_rad = self.ray_cycles * std::f64::consts::TAU;
        let phase2 = THEORY * THEORY * sigma_rad * sigma_rad + stress_rad * stress_rad + ray_rad * ray_rad;
        let (_, high) = mean_square(0.5 * count);
        let limit = high * (1.0 + 2.0 * snr * phase2) / (2.0 + 2.0 * snr) * THEORY * THEORY;
        let quadrature = mean(&|row| row.prompt_q * row.prompt_q) / power;
        links.put(Figure::PromptQuadrature, &self.name, quadrature, limit.min(1.0));
    }
}
