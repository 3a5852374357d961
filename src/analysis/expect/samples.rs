//! The spectrum that the samples of a front end should have, as the estimate of [`super::welch`] shows it.
//!
//! Absolute, in LSB²/Hz: noise of N0 = 2σ²/rate, satellites of C/N0·N0 under the spectra of their signals
//! behind the sampler's response, with the ripple of their echoes, interference, all through the filter and
//! the mixers; then the converter or the format's rounding, as [`super::converter`] has them, and the window.
//! Real samples have each spectrum and its mirror image. Nothing is fitted, but the level where the truth
//! does not state it.
//!
//! C/N0, Doppler and echoes are those of the looks' time. A code counts as random: its lines, or what data
//! make of them, are independent every 1/period, each with a standard deviation of its mean, which
//! [`Expected::codes_hz`] carries on. Limits: a local oscillator's offset and phase noise and the
//! quantisation of what a simulator plays back are left out; codes' lines are not those of the codes.

use std::collections::BTreeMap;

use fft::Planner;
use num_complex::Complex;

use crate::error::JudgeError;
use crate::expect::converter::Staircase;
use crate::expect::front_end::FrontEnd;
use crate::expect::jamming::{self, Source};
use crate::expect::sweep;
use crate::expect::welch;
use crate::read::{PsdRow, Run};
use crate::waveform::Waveform;
use gnss::earth::SPEED_OF_LIGHT_MPS;
use gnss::facts::{Interference, converter};
use gnss::record::RayRow;
use gnss::samples::Format;
use gnss::signal::{Link, Signal};

/// Bins about a line that it fills: its frequency within a run, not its level, decides what they hold.
const LINE_BINS: f64 = 8.0;
/// Share of a noise's bandwidth within which its density falls, on either side of each edge, and bins of the
/// window beside. The generator states that it falls within 0.08 of 1.5 bandwidths beyond an edge.
const EDGE: f64 = 0.12;

/// A satellite's signal while its spectrum is looked at.
#[derive(Clone, Debug)]
pub struct Sent {
    /// The signal.
    pub signal: &'static Signal,
    /// Carrier as sent, Hz.
    pub nominal_hz: f64,
    /// Carrier as received, Hz.
    pub carrier_hz: f64,
    /// Power over noise density, Hz.
    pub cn0_hz: f64,
    /// Echoes at each row of the truth in that time.
    pub echoes: Vec<Vec<RayRow>>,
}

impl Sent {
    /// Signals in the samples of a front end.
    ///
    /// # Errors
    ///
    /// [`JudgeError::Read`] where spilled rows cannot be read.
    pub fn of(run: &Run, front_end: &FrontEnd<'_>) -> Result<Vec<Self>, JudgeError> {
        let looks = front_end.looks(run);
        // The truth counts the samples of the first front end.
        let (rate_hz, ticks) = (run.scene.sample_rate_hz, run.trajectory.len().max(1) as f64);
        let until = match looks.pieces {
            1 => (looks.length as f64 / front_end.rate_hz * rate_hz) as u64,
            _ => u64::MAX,
        };
        let mut all = Vec::new();
        for link in run.truth.keys().filter(|link| front_end.has(link.signal)) {
            let (mut rows, mut doppler_hz, mut power_hz) = (0.0, 0.0, 0.0);
            for row in run.truth.cursor(link) {
                let row = row?;
                if row.sample >= until {
                    break;
                }
                rows += 1.0;
                doppler_hz += row.doppler_hz;
                power_hz += libm::pow(10.0, row.cn0_dbhz / 10.0);
            }
            if rows == 0.0 {
                continue;
            }
            let looked = if until == u64::MAX { ticks } else { rows };
            let nominal_hz = link.carrier_hz();
            all.push(Self {
                signal: link.signal,
                nominal_hz,
                carrier_hz: nominal_hz + doppler_hz / rows,
                cn0_hz: power_hz / looked,
                echoes: if until == u64::MAX { Vec::new() } else { echoes(run, link, until)? },
            });
        }
        Ok(all)
    }

    /// Factor of the power that echoes cause at a frequency from the carrier: the mean of |1 + Σ a·e^(2πi(φ −
    /// fτ))|².
    fn ripple(&self, from_carrier_hz: f64) -> f64 {
        if self.echoes.is_empty() {
            return 1.0;
        }
        let power = |rays: &Vec<RayRow>| {
            let sum = rays.iter().fold(Complex::new(1.0, 0.0), |sum: Complex<f64>, ray| {
                let cycles = ray.phase_cycles - from_carrier_hz * ray.excess_m / SPEED_OF_LIGHT_MPS;
                let (sin, cos) = libm::sincos(std::f64::consts::TAU * cycles);
                sum + Complex::new(cos, sin) * ray.amplitude_ratio
            });
            sum.norm_sqr()
        };
        self.echoes.iter().map(power).sum::<f64>() / self.echoes.len() as f64
    }
}

/// The rays of each row of the truth before a sample.
fn echoes(run: &Run, link: Link, until: u64) -> Result<Vec<Vec<RayRow>>, JudgeError> {
    let mut found: BTreeMap<u64, Vec<RayRow>> = BTreeMap::new();
    if run.rays.contains(&link) {
        for row in run.rays.cursor(link) {
            let row = row?;
            if row.sample >= until {
                break;
            }
            found.entry(row.sample).or_default().push(row);
        }
    }
    Ok(found.into_values().collect())
}

/// Expected spectrum at the frequencies of its estimate.
#[derive(Clone, Debug)]
pub struct Expected {
    /// LSB²/Hz.
    pub density: Vec<f64>,
    /// Relative variance of the power within a band, times the band, that codes' own lines make, hertz.
    pub codes_hz: Vec<f64>,
    /// Mean square over squared mean of the density over the looks, 1 where it is steady.
    pub unsteady: Vec<f64>,
    /// Relative variance that the number of pulses in the looks and the phases of sweeps make.
    pub pulses: Vec<f64>,
    /// True if a line or the edge of a noise's band fills the bin.
    pub line: Vec<bool>,
    /// True if the level is that of the truth, false if it is fitted.
    pub absolute: bool,
    /// True if the spectrum holds only steady noise and satellites.
    pub steady: bool,
}

/// Interference while it is looked at.
struct Jammer<'a> {
    source: &'a Source,
    shape: &'a Interference,
    /// J/N0 in each look.
    levels_hz: Vec<f64>,
    /// Density of unit power at the frequencies of the estimate.
    unit: Vec<f64>,
    /// Relative variance there that the sweep's phase makes.
    wander: Vec<f64>,
}

impl Expected {
    /// Expected spectrum for the frequencies of an estimate; `None` without one, or without anything in the
    /// samples.
    pub fn of(run: &Run, front_end: &FrontEnd<'_>, sent: &[Sent], rows: &[PsdRow]) -> Option<Self> {
        front_end.center_hz?;
        if rows.len() < 8 || (sent.is_empty() && !run.scene.noise) {
            return None;
        }
        let one_sided = rows.first().is_some_and(|row| row.frequency_hz >= 0.0);
        let bins = if one_sided { 2 * (rows.len() - 1) } else { rows.len() };
        let bin_hz = front_end.rate_hz / bins as f64;
        let absolute = front_end.noise_lsb.is_some();
        let sigma_lsb = front_end.noise_lsb.unwrap_or(1.0);
        let n0 = planted!("analysis.samples.floor", 2.0, 2.06) * sigma_lsb * sigma_lsb / front_end.rate_hz;
        let (smooth, codes_hz) = smooth(run, front_end, sent, 2 * bins, n0)?;
        let sources = jamming::sources(run);
        let jammers = jammers(run, front_end, &sources, rows, bin_hz);
        let shown = shown(front_end, smooth, absolute);
        let at = |values: &[f64], row: usize| {
            // Rows are at every second frequency of the finer grid, from its start or, one-sided, its middle.
            let index = if one_sided { bins + 2 * row } else { 2 * row };
            values.get(index % (2 * bins)).copied().unwrap_or(0.0)
        };
        let fold = |row: usize| if one_sided && row > 0 && row < rows.len() - 1 { 2.0 } else { 1.0 };
        let steady: Vec<f64> = (0..rows.len()).map(|row| shown.at(row, one_sided) * fold(row)).collect();
        let filter = front_end.filter_at(sent.first().map_or(0.0, |first| first.nominal_hz));
        let mut found = Self {
            codes_hz: (0..rows.len()).map(|row| at(&codes_hz, row)).collect(),
            unsteady: vec![1.0; rows.len()],
            pulses: vec![0.0; rows.len()],
            line: vec![false; rows.len()],
            density: steady,
            absolute,
            steady: jammers.is_empty(),
        };
        for (index, row) in rows.iter().enumerate() {
            let passed = filter.as_ref().map_or(1.0, |filter| filter.power(row.frequency_hz)) * shown.gain * shown.gain;
            found.jam(index, row.frequency_hz, &jammers, (n0 * passed, bin_hz));
            if let Some(balance) = front_end.balance().filter(|balance| balance.dc_power_lsb2 > 0.0) {
                let line = balance.dc_power_lsb2 * jamming::hann(row.frequency_hz / bin_hz) / bin_hz;
                found.density[index] += line * shown.gain * shown.gain;
                found.line[index] |= row.frequency_hz.abs() < LINE_BINS * bin_hz;
            }
        }
        if !absolute {
            found.fit(rows);
        }
        Some(found)
    }

    /// Adds interference to a row.
    fn jam(&mut self, index: usize, f_hz: f64, jammers: &[Jammer<'_>], (n0, bin_hz): (f64, f64)) {
        let looks = jammers.first().map_or(0, |one| one.levels_hz.len());
        if looks == 0 {
            return;
        }
        let steady = self.density[index];
        let of = |one: &Jammer<'_>, look: usize| {
            n0 * one.unit.get(index).copied().unwrap_or(0.0) * one.levels_hz.get(look).copied().unwrap_or(0.0)
        };
        let in_look = |look: usize| steady + jammers.iter().map(|one| of(one, look)).sum::<f64>();
        let mean = (0..looks).map(in_look).sum::<f64>() / looks as f64;
        let square = (0..looks).map(|look| in_look(look) * in_look(look)).sum::<f64>() / looks as f64;
        for one in jammers {
            let own = (0..looks).map(|look| of(one, look)).sum::<f64>() / looks as f64 / mean;
            self.pulses[index] += own * own * (one.scatter() + one.wander.get(index).copied().unwrap_or(0.0));
            let from_hz = f_hz - one.source.frequency_hz;
            self.line[index] |= match *one.shape {
                Interference::Cw => from_hz.abs() < LINE_BINS * bin_hz,
                // As wide as the samples' band it is white.
                Interference::Noise { width_hz } if width_hz < bin_hz * self.line.len() as f64 => {
                    (from_hz.abs() - 0.5 * width_hz).abs() < EDGE * width_hz + LINE_BINS * bin_hz
                }
                _ => false,
            };
        }
        (self.density[index], self.unsteady[index]) = (mean, square / (mean * mean));
    }

    /// Scales the density to the median of what is measured, where the density is within 20 dB of its peak.
    fn fit(&mut self, rows: &[PsdRow]) {
        let peak = self.density.iter().copied().fold(0.0, f64::max);
        let near = rows.iter().zip(&self.density).filter(|(_, density)| **density > 0.01 * peak);
        let off_db: Vec<f64> = near.map(|(row, density)| row.density_db - 10.0 * libm::log10(*density)).collect();
        let scale = libm::pow(10.0, crate::statistics::median(&off_db).unwrap_or(0.0) / 10.0);
        self.density.iter_mut().for_each(|value| *value *= scale);
    }

    /// Density in decibels of LSB²/Hz.
    pub fn density_db(&self) -> Vec<f64> {
        self.density.iter().map(|value| 10.0 * libm::log10(value.max(1e-30))).collect()
    }
}

impl Jammer<'_> {
    /// Relative variance of its power over all looks: of pulses at random times, one over their number.
    fn scatter(&self) -> f64 {
        let Interference::Pulse { repetition_hz, .. } = *self.shape else { return 0.0 };
        let on = self.levels_hz.iter().filter(|level| **level > 0.0).count() as f64;
        let seen_s = welch::LOOKED_S * on / self.levels_hz.len().max(1) as f64;
        1.0 / (repetition_hz * seen_s).max(1.0)
    }
}

/// Density behind filter and mixers at `points` frequencies over the whole band, from −rate/2 on, and what
/// codes scatter there. A real spectrum has half of its power on either side.
fn smooth(run: &Run, front_end: &FrontEnd<'_>, sent: &[Sent], points: usize, n0: f64) -> Option<(Vec<f64>, Vec<f64>)> {
    let (rate_hz, real) = (front_end.rate_hz, front_end.is_real());
    let mut known: BTreeMap<&Signal, (Vec<f64>, f64)> = BTreeMap::new();
    for one in sent {
        if known.contains_key(one.signal) {
            continue;
        }
        let lines_hz: f64 = (one.signal.components.iter())
            .map(|component| component.power_share * component.power_share / component.period_s())
            .sum();
        let waveform = Waveform::sent(one.signal, run.scene.waveform)?;
        // Over half a period of the samples' spectrum, which is even.
        let step_hz = rate_hz / points as f64;
        let at = |index: usize| waveform.sampled(&front_end.sampler, index as f64 * step_hz);
        known.insert(one.signal, ((0..=points / 2).map(at).collect(), lines_hz));
    }
    let filter = front_end.filter_at(sent.first().map_or(0.0, |first| first.nominal_hz));
    let at = |index: usize| (index as f64 / points as f64 - 0.5) * rate_hz;
    let floor = if run.scene.noise { 1.0 } else { 0.0 };
    let (mut density, mut codes_hz) = (vec![floor; points], vec![0.0; points]);
    for one in sent {
        let Some((table, lines_hz)) = known.get(one.signal) else { continue };
        let carrier_hz = front_end.place_hz(one.carrier_hz);
        let sign = if front_end.inverted { -1.0 } else { 1.0 };
        for (index, (density, codes_hz)) in density.iter_mut().zip(&mut codes_hz).enumerate() {
            let of = |f_hz: f64| {
                let from_hz = f_hz - carrier_hz;
                let cn0_hz = planted!("analysis.samples.codes", 1.0, 0.5) * one.cn0_hz;
                cn0_hz * between(table, from_hz / rate_hz) * one.ripple(sign * from_hz)
            };
            let own = of(at(index)) + if real { of(-at(index)) } else { 0.0 };
            *density += own;
            *codes_hz += own * own * lines_hz;
        }
    }
    let side = if real { 0.5 } else { 1.0 };
    for (index, (density, codes_hz)) in density.iter_mut().zip(&mut codes_hz).enumerate() {
        *codes_hz /= (*density * *density).max(1e-300);
        *density *= side * n0 * filter.as_ref().map_or(1.0, |filter| filter.power(at(index)));
    }
    if let Some(image_db) = front_end.balance().and_then(|balance| balance.image_db) {
        let image = libm::pow(10.0, image_db / 10.0);
        let before = density.clone();
        for (index, value) in density.iter_mut().enumerate() {
            // Index k mirrors to N − k.
            *value += image * before.get((points - index) % points).copied().unwrap_or(0.0);
        }
    }
    Some((density, codes_hz))
}

/// Value of a table over half a period of an even function, linear between its points: a step is a thousandth
/// of a chip rate, or some, whose square is what it errs.
fn between(table: &[f64], periods: f64) -> f64 {
    let place = 2.0 * (periods - periods.round()).abs() * (table.len() - 1) as f64;
    let index = place as usize;
    match (table.get(index), table.get(index + 1)) {
        (Some(a), Some(b)) => a + (b - a) * (place - index as f64),
        _ => table.last().copied().unwrap_or(0.0),
    }
}

/// A density as the estimate shows it, and the converter's gain.
struct Shown {
    density: Vec<f64>,
    gain: f64,
}

impl Shown {
    /// Density at a row of the estimate.
    fn at(&self, row: usize, one_sided: bool) -> f64 {
        let bins = self.density.len();
        let index = if one_sided { row } else { (row + bins / 2) % bins };
        self.density.get(index).copied().unwrap_or(0.0)
    }
}

/// Puts a density through the converter and under the window, by way of its autocorrelation.
fn shown(front_end: &FrontEnd<'_>, mut smooth: Vec<f64>, absolute: bool) -> Shown {
    let points = smooth.len();
    smooth.rotate_left(points / 2);
    let step_hz = front_end.rate_hz / points as f64;
    let mut lags: Vec<Complex<f64>> = smooth.into_iter().map(|value| Complex::new(value * step_hz, 0.0)).collect();
    let mut planner = Planner::<f64>::new();
    planner.plan_fft_inverse(points).process(&mut lags);
    let components = if front_end.is_real() { 1.0 } else { 2.0 };
    let dc_lsb2 = front_end.balance().map_or(0.0, |balance| balance.dc_power_lsb2);
    let power = lags.first().map_or(0.0, |first| first.re) + dc_lsb2;
    let sigma_lsb = (power / components).max(1e-300).sqrt();
    let full_scale_lsb = front_end.format.and_then(Format::full_scale_lsb);
    let gain = match Staircase::of(converter(front_end.stages), full_scale_lsb, sigma_lsb) {
        Some(staircase) if absolute => staircase.pass(&mut lags, components, dc_lsb2),
        _ => 1.0,
    };
    let window = welch::autocorrelation(points / 2);
    for (index, value) in lags.iter_mut().enumerate() {
        *value *= window.get(index.min(points - index)).copied().unwrap_or(0.0);
    }
    planner.plan_fft_forward(points).process(&mut lags);
    Shown { density: lags.iter().step_by(2).map(|value| value.re.max(0.0) / front_end.rate_hz).collect(), gain }
}

/// True if the window does not tell the lines of a sweep apart: its main lobe is four bins wide.
pub fn merges(repetition_hz: f64, bin_hz: f64) -> bool {
    repetition_hz < 4.0 * bin_hz
}

/// Interference in each look, of a scene's only front end.
fn jammers<'a>(
    run: &'a Run,
    front_end: &FrontEnd<'_>,
    sources: &'a BTreeMap<usize, Source>,
    rows: &[PsdRow],
    bin_hz: f64,
) -> Vec<Jammer<'a>> {
    let looks = front_end.looks(run);
    let tick = (run.truth_interval_s() * run.scene.sample_rate_hz).round().max(1.0) as u64;
    let ticks: Vec<u64> = looks.pieces(front_end.samples).map(|piece| piece.start / tick * tick).collect();
    let of = |(number, source): (&usize, &'a Source)| {
        let own: BTreeMap<u64, f64> = (run.interference.iter().filter(|row| row.source == *number))
            .map(|row| (row.sample, libm::pow(10.0, row.jn0_dbhz / 10.0)))
            .collect();
        let shape = run.scene.interference.get(number - 1)?;
        let one = Source { jn0_hz: 1.0, ..source.clone() };
        let mirrored = front_end.is_real();
        let unit = |row: &PsdRow| {
            let at = |f_hz: f64| jamming::density(&one, f_hz, bin_hz, &front_end.sampler);
            at(row.frequency_hz) + if mirrored { at(-row.frequency_hz) } else { 0.0 }
        };
        let levels_hz: Vec<f64> = ticks.iter().map(|tick| own.get(tick).copied().unwrap_or(0.0)).collect();
        let wander = shape.sweeps_hz().filter(|hz| merges(*hz, bin_hz)).zip(jamming::harmonics(shape)).map_or_else(
            Vec::new,
            |(repetition_hz, lines)| {
                let on = looks.pieces(front_end.samples).zip(&levels_hz).filter(|(_, level)| **level > 0.0);
                let bins = (front_end.rate_hz / bin_hz).round() as u64;
                let starts = on.flat_map(|(piece, _)| {
                    let last = (piece.end + 1).saturating_sub(bins);
                    (piece.start..last).step_by((bins / 2).max(1) as usize)
                });
                let phases: Vec<f64> =
                    starts.map(|start| (start as f64 / front_end.rate_hz * repetition_hz).fract()).collect();
                let offsets_hz = rows.iter().map(|row| row.frequency_hz - source.frequency_hz);
                sweep::wander(&lines, repetition_hz, (offsets_hz, bin_hz), &phases)
            },
        );
        Some(Jammer { source, shape, levels_hz, unit: rows.iter().map(unit).collect(), wander })
    };
    sources.iter().filter_map(of).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::hand_made::{Draw, planted};
    use crate::measure::psd::Psd;
    use crate::waveform::Edge;
    use gnss::facts::{ConverterSpec, FilterShape, FilterSpec, StageSpec};
    use gnss::galileo::e1::E1;

    fn grid(rate_hz: f64, bins: usize) -> Vec<PsdRow> {
        let at = |k: usize| (k as f64 / bins as f64 - 0.5) * rate_hz;
        (0..bins).map(|k| PsdRow { frequency_hz: at(k), density_db: 0.0 }).collect()
    }

    fn sent(cn0_hz: f64) -> Sent {
        let nominal_hz = E1.centre_hz();
        Sent { signal: &E1, nominal_hz, carrier_hz: nominal_hz, cn0_hz, echoes: Vec::new() }
    }

    /// MBOC as printed: 10/11 BOC(1,1) + 1/11 BOC(6,1), sine-phased (Betz 2001, eq. 12).
    fn mboc(hz: f64) -> f64 {
        let chip_s = 1.0 / 1.023e6;
        let boc = |m: f64| {
            let whole_rad = std::f64::consts::PI * hz * chip_s;
            let wave = libm::tan(0.5 * whole_rad / m) * libm::sin(whole_rad) / (std::f64::consts::PI * hz);
            wave * wave / chip_s
        };
        10.0 / 11.0 * boc(1.0) + boc(6.0) / 11.0
    }

    #[test]
    fn e1_by_means_over_samples_has_the_printed_spectrum_under_their_sinc_with_its_aliases() {
        let directory = planted();
        let mut run = Run::read(directory.path()).unwrap();
        let rate_hz = 6.5e6;
        (run.scene.code_edge, run.scene.sample_rate_hz) = (Edge::Area, rate_hz);
        (run.scene.center_hz, run.scene.noise_lsb) = (Some(E1.centre_hz()), Some(28.0));
        run.scene.format = "cf32_le".to_owned();
        let front_end = FrontEnd::of(&run, 0);
        let rows = grid(rate_hz, 1024);
        let found = Expected::of(&run, &front_end, &[sent(1e6)], &rows).unwrap();
        let met = |hz: f64| {
            let turn = std::f64::consts::PI * hz / rate_hz;
            mboc(hz) * (libm::sin(turn) / turn).powi(2)
        };
        let n0 = 2.0 * 28.0 * 28.0 / rate_hz;
        for (row, density) in rows.iter().zip(&found.density).step_by(37) {
            let aliases: f64 = (-12..=12).map(|k| met(row.frequency_hz + 0.5 + f64::from(k) * rate_hz)).sum();
            let expected = n0 * (1.0 + 1e6 * aliases);
            assert!((density / expected - 1.0).abs() < 2e-3, "{}: {density} {expected}", row.frequency_hz);
        }
    }

    #[test]
    fn noise_behind_a_filter_and_two_bits_has_the_spectrum_that_it_is_measured_to_have() {
        let directory = planted();
        let mut run = Run::read(directory.path()).unwrap();
        let (rate_hz, bandwidth_hz) = (4e6, 0.8e6);
        run.scene.sample_rate_hz = rate_hz;
        (run.scene.center_hz, run.scene.noise_lsb) = (Some(E1.centre_hz()), Some(28.0));
        run.scene.format = "ci8".to_owned();
        let shape = FilterShape::Butterworth { order: 1 };
        let filter = FilterSpec { shape, bandwidth_hz, group_delay_s: 0.0, middle_hz: Some(0.0) };
        let adc = ConverterSpec { bits: 2, step_sigma: 0.9957, nominal_lsb: 28.0, gain_control: true, whole: false };
        run.scene.front_end = vec![StageSpec::Filter(filter), StageSpec::Adc(adc)];
        // Taps of the first order's response 1/(1 + jf/f₀) within the samples' band. With 0.564 of a sample
        // of delay its ends meet, and lags beyond a hundred have 1e-4 of the sum.
        let tap = |lag: i32| -> f64 {
            let line = |n: u32| {
                let cycles = (f64::from(n) + 0.5) / 4000.0 - 0.5;
                let (gain_re, gain_im) = (1.0, -cycles * rate_hz / (0.5 * bandwidth_hz));
                let (sin, cos) = libm::sincos(std::f64::consts::TAU * cycles * (f64::from(lag) - 0.564));
                (gain_re * cos - gain_im * sin) / (gain_im * gain_im + 1.0)
            };
            (0..4000).map(line).sum::<f64>() / 4000.0
        };
        let taps: Vec<f64> = (-100..=100).map(tap).collect();
        let sigma = 28.0 * taps.iter().map(|tap| tap * tap).sum::<f64>().sqrt();
        let mut draw = Draw(11);
        let level = |value: f64| 2.0 * (value / (0.9957 * sigma)).floor().clamp(-2.0, 1.0) + 1.0;
        let mut component = || {
            let noise: Vec<f64> = (0..(1 << 20) + taps.len()).map(|_| 28.0 * draw.normal()).collect();
            let behind = |window: &[f64]| taps.iter().zip(window).map(|(tap, x)| tap * x).sum::<f64>();
            noise.windows(taps.len()).map(|window| level(behind(window)) as f32).collect::<Vec<f32>>()
        };
        let (i, q) = (component(), component());
        let mut psd = Psd::new(rate_hz, false, 128);
        psd.add(&i, &q);
        let rows = psd.rows().unwrap();
        let front_end = FrontEnd::of(&run, 0);
        let found = Expected::of(&run, &front_end, &[], &rows).unwrap();
        for (row, expected_db) in rows.iter().zip(found.density_db()) {
            // 16 000 segments: 1 % or 0.035 dB, and five of it; the sum of twelve uniforms has a kurtosis of
            // −0.1.
            assert!((row.density_db - expected_db).abs() < 0.2, "{} {expected_db}", row.frequency_hz);
        }
    }

    #[test]
    fn real_samples_have_each_spectrum_and_its_image_and_an_echo_its_ripple() {
        let directory = planted();
        let mut run = Run::read(directory.path()).unwrap();
        let rate_hz = 20e6;
        (run.scene.code_edge, run.scene.sample_rate_hz, run.scene.noise) = (Edge::Nearest, rate_hz, false);
        (run.scene.center_hz, run.scene.noise_lsb) = (Some(E1.centre_hz() - 5e6), Some(28.0));
        run.scene.format = "ri16_le".to_owned();
        let rows: Vec<PsdRow> =
            (0..=512).map(|k| PsdRow { frequency_hz: f64::from(k) * rate_hz / 1024.0, density_db: 0.0 }).collect();
        let front_end = FrontEnd::of(&run, 0);
        let level = |sent: Sent| Expected::of(&run, &front_end, &[sent], &rows).unwrap().density;
        let plain = level(sent(1e8));
        let n0 = 2.0 * 28.0 * 28.0 / rate_hz;
        for f_hz in [4.2e6, 5.9e6] {
            let index = (f_hz / rate_hz * 1024.0).round() as usize;
            let from_hz = rows[index].frequency_hz - 5e6;
            // Its own spectrum; images and aliases lie ten megahertz and more from the carrier, 30 dB down.
            let expected = n0 * 1e8 * mboc(from_hz);
            assert!((plain[index] / expected - 1.0).abs() < 0.03, "{f_hz}: {} {expected}", plain[index]);
        }
        let ray = RayRow {
            sample: 0,
            sv: gnss::satellite::Sv::gps(11),
            signal: &E1,
            ray: 1,
            excess_m: 100.0,
            amplitude_ratio: 0.5,
            phase_cycles: 0.25,
        };
        let echoed = level(Sent { echoes: vec![vec![ray]], ..sent(1e8) });
        let index = (5.9e6 / rate_hz * 1024.0_f64).round() as usize;
        let cycles = 0.25 - (rows[index].frequency_hz - 5e6) * 100.0 / SPEED_OF_LIGHT_MPS;
        let expected = 1.0 + 0.25 + libm::cos(std::f64::consts::TAU * cycles);
        assert!((echoed[index] / plain[index] / expected - 1.0).abs() < 0.02, "{}", echoed[index] / plain[index]);
    }
}
