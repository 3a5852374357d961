//! Each satellite's loops against theory at the C/N0 that the scene gives them: bias, spread, largest error
//! and C/N0.
//!
//! Every figure of a satellite is put over its own limit, so that the worst satellite speaks for all. Theory
//! is that of [`crate::measure::jitter`] at the true C/N0 less what front end and converter cost,
//! with the oscillator's noise and the motion's stress. Limits: epochs that interference costs more than
//! `JAMMED_DB`, or whose C/N0 moved by more than `STEADY_DB` within the receiver's averages, are left out.

use std::collections::BTreeMap;

use crate::error::JudgeError;
use crate::expect::beats::Beats;
use crate::expect::loops::{Stresses, Theory, update_s};
use crate::expect::multipath::Rays;
use crate::expect::multiple_access::MultipleAccess;
use crate::expect::quantile::{largest, mean_square};
use crate::expect::stated::Stated;
use crate::expect::theory::edges;
use crate::expect::timeline::Timeline;
use crate::judge::forecast::settled::Settled;
use crate::measure::errors::Errors;
use crate::measure::jitter::{Loop, Settings};
use crate::read::{Numbers, Run};
use crate::waveform::Edge;
use gnss::record::TrackingRow;
use gnss::signal::Link;

/// Factors by which theory's σ may be too small or too large. They hold 1 dB of C/N0 (1.12), and 7 % between
/// linear and real loops. The code's theory leaves out the rounding of both replicas, which lowers jitter by
/// as much again.
const THEORY: f64 = 1.2;
const THEORY_LOW: f64 = 1.35;
/// Power of the codes of other satellites for the worst pair, over the average. Two codes whose Dopplers
/// differ by whole kilohertz are 24 dB below their peak, instead of noise of 38 dB below it in 4 ms. Most
/// pairs are near the average.
const WORST_PAIR: f64 = 10.0;
/// A sound estimate of C/N0 is right within this.
pub const CN0_DB: f64 = 1.0;
/// Error of a carrier from rounding, light time and interpolation, cycles.
const REST_CYCLES: f64 = 0.01;
/// Error of a Doppler from rounding, light time and interpolation, Hz.
const REST_HZ: f64 = 0.01;
/// Least number of settled observations that are judged.
const LEAST: usize = 30;

/// A figure of the satellite that is nearest to its limit, or farthest beyond.
#[derive(Clone, Debug, PartialEq)]
pub struct Worst {
    /// The satellite, or satellite and signal.
    pub name: String,
    /// Value of the figure.
    pub value: f64,
    /// Limit of the figure.
    pub limit: f64,
}

/// Figure that is judged satellite by satellite.
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
    /// Satellites that are not judged, by reason.
    pub left_out: BTreeMap<LeftOut, Vec<String>>,
}

/// Reason why figures of a satellite's loops are not judged.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum LeftOut {
    /// No loop of the receiver's settings can hold the signal.
    Unheld,
    /// Too few observations past pull-in, with a steady C/N0 and without jamming.
    Unsettled,
    /// Too few updates of the length that the receiver states.
    Updates,
}

impl Links {
    /// Measures every satellite; nothing where the receiver names no settings.
    ///
    /// # Errors
    /// [`JudgeError::Read`] where spilled rows cannot be read.
    pub fn measure(run: &Run, errors: &Errors, stated: &Stated) -> Result<Self, JudgeError> {
        let mut links = Self::default();
        let Some(settings) = Settings::of(run) else { return Ok(links) };
        // Without noise other codes alone disturb a loop, and they are no noise.
        if !run.scene.noise {
            return Ok(links);
        }
        let (access, beats) = (MultipleAccess::new(run), Beats::new(run)?);
        for link in errors.signals.keys() {
            let Some(update_s) = update_s(run, link) else { continue };
            let Some(theory) = Theory::new(run, settings, &link, update_s) else {
                links.leave_out(LeftOut::Unheld, run.name(link));
                continue;
            };
            let rows = Settled::of((run, &access), errors, link, &theory, stated)?;
            if rows.count < LEAST {
                links.leave_out(LeftOut::Unsettled, run.name(link));
                continue;
            }
            let Some(one) = One::new((run, &beats), link, &theory, settings, rows)? else { continue };
            one.observations(&mut links)?;
            let spans = &one.rows.spans;
            let mut updates = Updates::none();
            run.tracking.each(link, |row| {
                let inside = spans.iter().any(|(from, to)| (*from..=*to).contains(&row.sample));
                let whole = (row.integration_s - theory.update_s).abs() < 1e-9;
                if inside && whole {
                    updates.add(&row);
                }
            })?;
            if updates.count < LEAST {
                links.leave_out(LeftOut::Updates, run.name(link));
                continue;
            }
            one.updates(&mut links, &updates);
        }
        Ok(links)
    }

    fn leave_out(&mut self, reason: LeftOut, name: String) {
        self.left_out.entry(reason).or_default().push(name);
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

/// Sums over a satellite's loop updates.
struct Updates {
    count: usize,
    /// Sums of each loop's output in its unit, and of the output's square.
    put_out: [(Loop, f64, f64); 3],
    cn0_dbhz: f64,
    power: f64,
    quadrature: f64,
}

impl Updates {
    fn none() -> Self {
        // As sums of iterators begin.
        let put_out = [Loop::Dll, Loop::Pll, Loop::Fll].map(|which| (which, -0.0, -0.0));
        Self { count: 0, put_out, cn0_dbhz: -0.0, power: -0.0, quadrature: -0.0 }
    }

    fn add(&mut self, row: &TrackingRow) {
        self.count += 1;
        for (which, sum, squares) in &mut self.put_out {
            let value = match which {
                Loop::Dll => row.dll_discriminator_chips,
                Loop::Pll => 360.0 * row.pll_discriminator_cycles,
                Loop::Fll => row.fll_discriminator_hz,
            };
            (*sum, *squares) = (*sum + value, *squares + value * value);
        }
        self.cn0_dbhz += row.cn0_dbhz;
        self.power += row.prompt_i * row.prompt_i + row.prompt_q * row.prompt_q;
        self.quadrature += row.prompt_q * row.prompt_q;
    }
}

/// One satellite.
struct One<'a> {
    name: String,
    theory: &'a Theory,
    rows: Settled,
    /// Error of a carrier that rays may cause, cycles.
    ray_cycles: f64,
    /// Error of C/N0 that rays may cause, dB.
    ray_db: f64,
    /// Largest error of the code that chip edges leave.
    edge_m: f64,
    /// Error of the code that beats may make, root mean square, and that of its mean, metres.
    beat_m: [f64; 2],
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
    /// Factor of σ that the worst pair of codes makes.
    pair: f64,
    /// True if the samples have no filter. Noise behind a filter is not white, and prompts count in units of
    /// white noise.
    white: bool,
}

impl<'a> One<'a> {
    fn new(
        (run, beats): (&Run, &Beats),
        link: Link,
        theory: &'a Theory,
        settings: Settings,
        rows: Settled,
    ) -> Result<Option<Self>, JudgeError> {
        let Some(timeline) = Timeline::of(run, link)? else { return Ok(None) };
        let stresses = Stresses::new(theory, &timeline, &link, rows.ends_s);
        drop(timeline);
        let count = rows.count as f64;
        // Variances go with one over C/N0.
        let cn0_hz = count / rows.inverse_hz;
        let (power_hz, middle_dbhz, others) = (rows.white_hz / count, rows.dbhz / count, rows.others / count);
        // Without noise there is nothing but others.
        let pair = ((1.0 + WORST_PAIR * others) / (1.0 + others)).max(1.0).sqrt();
        let (mut sigma, mut raw) = (BTreeMap::new(), BTreeMap::new());
        for which in [Loop::Dll, Loop::Pll, Loop::Fll] {
            let (put_out, thermal) = theory.noise(which, cn0_hz, &rows.places);
            let (oscillator, stress) = (theory.oscillator(which), stresses.of(which));
            let noise = libm::hypot(thermal, oscillator);
            sigma.insert(which, [libm::hypot(noise, stress.rms()), noise, stress.max]);
            raw.insert(which, put_out);
        }
        let strongest = Rays::strongest(run, link)?.min(0.99);
        let edge_m = match run.scene.code_edge {
            Edge::Area => edges::CREST * edges::averaged_m(link.signal, run.scene.waveform, run.rate_hz(link.signal)),
            _ => 0.0,
        };
        let span_s = 0.1_f64.max(rows.ends_s.1 - rows.ends_s.0);
        let beat_m = [0.0, 0.5 * span_s]
            .map(|averaged_s| theory.chip_m * beats.variance(theory, link, rows.ends_s, averaged_s).sqrt());
        Ok(Some(Self {
            name: run.name(link),
            theory,
            // A vector's angle under another of share α beside it, and its length.
            ray_cycles: libm::asin(strongest) / std::f64::consts::TAU,
            ray_db: -20.0 * libm::log10(1.0 - strongest),
            edge_m,
            beat_m,
            sigma,
            raw,
            span_s,
            settings,
            cn0_hz,
            power_hz,
            middle_dbhz,
            pair,
            white: run.scene.front_end.is_empty(),
            rows,
        }))
    }

    /// Independent values of a loop: of a mean 2BT, of a mean square 4BT, no more than there are.
    fn independent(&self, which: Loop, per_bandwidth: f64) -> f64 {
        let bandwidth_hz = match which {
            Loop::Dll => self.settings.dll_bandwidth_hz,
            Loop::Pll | Loop::Fll => self.settings.pll_bandwidth_hz,
        };
        (self.rows.count as f64).min(per_bandwidth * bandwidth_hz * self.span_s).max(1.0)
    }

    fn observations(&self, links: &mut Links) -> Result<(), JudgeError> {
        let Settled { code, carrier, doppler, ray_m, .. } = &self.rows;
        let (code_edge_m, carrier_rest) = (self.edge_m + 0.5 * ray_m, REST_CYCLES + self.ray_cycles);
        let (metres, level_cycles) = (self.theory.chip_m, self.rows.level_cycles()?);
        let of_code = [Figure::CodeBias, Figure::CodeLargest];
        // The lag of two codes is one draw for the whole run, and a beat that turns goes to √2 of its rms.
        let [beat_m, middle_m] = self.beat_m.map(|beat_m| largest(1, 1) * beat_m);
        let peaks_m = [middle_m, beat_m].map(|beat_m| code_edge_m + std::f64::consts::SQRT_2 * beat_m);
        let rest_m = [peaks_m[0], peaks_m[1], libm::hypot(code_edge_m, beat_m)];
        self.one(links, of_code, Loop::Dll, (code, 0.0), metres, rest_m)?;
        let (of_carrier, cycles) = ([Figure::CarrierBias, Figure::CarrierLargest], 1.0 / 360.0);
        self.one(links, of_carrier, Loop::Pll, (carrier, level_cycles), cycles, [carrier_rest; 3])?;
        let of_doppler = [Figure::DopplerBias, Figure::DopplerLargest];
        self.one(links, of_doppler, Loop::Fll, (doppler, 0.0), 1.0, [REST_HZ; 3])?;
        self.cn0(links, [Figure::Cn0Bias, Figure::Cn0Largest]);
        Ok(())
    }

    /// Bias, largest error and spread of one loop's errors above a level, which are in `scale` of the loop's
    /// unit; `rest` is what may come on top of each.
    fn one(
        &self,
        links: &mut Links,
        figures: [Figure; 2],
        which: Loop,
        (errors, level): (&Numbers, f64),
        scale: f64,
        [rest_of_bias, rest_of_largest, rest]: [f64; 3],
    ) -> Result<(), JudgeError> {
        let Some([sigma, noise, stress]) = self.sigma.get(&which).map(|all| all.map(|x| x * scale)) else {
            return Ok(());
        };
        let count = errors.len() as f64;
        let (mut sum, mut most, mut squares) = (-0.0, 0.0_f64, -0.0);
        errors.each(|value| (sum, most) = (sum + (value - level), most.max((value - level).abs())))?;
        let middle = sum / count;
        errors.each(|value| squares += (value - level - middle) * (value - level - middle))?;
        let factor = largest(1, 1) * THEORY * self.pair / self.independent(which, 2.0).sqrt();
        links.put(figures[0], &self.name, middle.abs(), factor * sigma + stress + rest_of_bias);
        let limit = largest(1, errors.len()) * THEORY * self.pair * sigma + stress + rest_of_largest;
        links.put(figures[1], &self.name, most, limit);
        let spread = squares / count;
        let (low, high) = mean_square(self.independent(which, 4.0));
        // What is not noise may come and go.
        let top = (high * (THEORY * self.pair * sigma) * (THEORY * self.pair * sigma) + stress * stress + rest * rest)
            .sqrt()
            / sigma;
        links.put(Figure::Above(which), &self.name, spread.sqrt() / sigma, top);
        // A receiver may take a stress away that a loop alone would suffer; noise stays.
        links.put(Figure::Below(which), &self.name, spread.sqrt() / noise, low.sqrt() / THEORY_LOW);
        Ok(())
    }

    fn cn0(&self, links: &mut Links, [bias, most]: [Figure; 2]) {
        let middle = self.rows.off_db / self.rows.count as f64;
        links.put(bias, &self.name, middle.abs(), CN0_DB + self.ray_db);
        // A noise power of n values is known to 4.34·√(2/n) dB; the averages hold a second of updates.
        let updates = (1.0 / self.theory.update_s).max(2.0);
        let weak = 1.0 + 1.0 / self.theory.snr(self.cn0_hz);
        let sigma_db = 4.343 * (2.0 / updates).sqrt() * weak;
        let limit_db = CN0_DB + self.ray_db + largest(1, self.rows.count) * sigma_db;
        links.put(most, &self.name, self.rows.most_off_db, limit_db);
    }

    /// Outputs of the loops, update by update.
    fn updates(&self, links: &mut Links, sums: &Updates) {
        let count = sums.count as f64;
        for (which, sum, squares) in sums.put_out {
            let (Some(raw), Some([_, _, stress])) = (self.raw.get(&which), self.sigma.get(&which)) else { continue };
            let (middle, square) = (sum / count, squares / count);
            // Rows are taken every few updates: a loop's memory between them is short.
            let (low, high) = mean_square(0.5 * count);
            let sigma = (square - middle * middle).max(0.0).sqrt();
            let top = (high * (THEORY * self.pair * raw) * (THEORY * self.pair * raw) + stress * stress).sqrt() / raw;
            links.put(Figure::RawAbove(which), &self.name, sigma / raw, top);
            links.put(Figure::RawBelow(which), &self.name, sigma / raw, low.sqrt() / THEORY_LOW);
            let limit = largest(1, 1) * THEORY * self.pair * raw * (2.0 / count).sqrt() + stress;
            links.put(Figure::RawBias(which), &self.name, middle.abs(), limit);
        }
        let cn0_off_db = sums.cn0_dbhz / count - self.middle_dbhz;
        links.put(Figure::LoopCn0Bias, &self.name, cn0_off_db.abs(), CN0_DB + self.ray_db);
        // In units of noise per component a prompt has the mean power 2 + 2·T·C/N0.
        let power = sums.power / count;
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
        let noise = THEORY * self.pair * THEORY * self.pair;
        let limit = high * noise * (1.0 + 2.0 * snr * phase2) / (2.0 + 2.0 * snr);
        let quadrature = sums.quadrature / count / power;
        links.put(Figure::PromptQuadrature, &self.name, quadrature, limit.min(1.0));
    }
}
