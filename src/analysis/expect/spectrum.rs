//! The spectrum that theory expects of the samples, front end and converter in, and the nulls of the code
//! found against it.
//!
//! Absolute, in LSB²/Hz: noise of N0 = 2σ²/fs, satellites of C/N0·N0 under the spectra of their signals,
//! interference, all through the filter and the converter's gain; then quantisation. An integer format rounds
//! with 1/12 a component; a converter of few levels is g·x + d for Gaussian x (Bussgang 1952), with g and the
//! power of d summed over its cells. d counts as white. Nothing is fitted: the median of measured over
//! expected is reported. Limits: a Butterworth's response is the analogue one, a wall's edge an error
//! function between its −80 dB points, both about the first signal's carrier; a local oscillator's offset and
//! phase noise are left out.

use std::collections::BTreeMap;

use serde::Serialize;
use statrs::function::erf::{erf, erfc};

use crate::analysis::expect::jamming;
use crate::analysis::read::{Emission, MeanSignal, Run};
use crate::analysis::statistics::median;
use crate::analysis::waveform::Waveform;
use crate::gnss::facts::{BalanceSpec, ConverterSpec, FilterShape, FilterSpec, converter, filters};
use crate::gnss::signal::Signal;

/// The section `psd` of `summary.json`: frequencies from the carrier.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Spectrum {
    /// Median of measured over expected density.
    pub level_error_db: Option<f64>,
    /// 95th percentile of the same about its median, where the density is less than 20 dB below its peak.
    pub shape_error_p95_db: Option<f64>,
    /// Null below the carrier as measured, Hz from the carrier.
    pub null_low_hz: Option<f64>,
    /// Null above the carrier as measured, Hz from the carrier.
    pub null_high_hz: Option<f64>,
    /// Where the same search finds the lower one in the expected spectrum: Doppler moves it.
    pub null_low_expected_hz: Option<f64>,
    /// Where it finds the upper one.
    pub null_high_expected_hz: Option<f64>,
    /// Why a null is not reported.
    pub null_reason: Option<&'static str>,
}

/// Half width over which a null is looked for, in chip rates, and over which its bottom is fitted.
const SEARCH: f64 = 0.1;
const BOTTOM: f64 = 0.02;
/// Least number of bins to each side of that bottom.
const BOTTOM_BINS: f64 = 4.0;
/// The spectrum must rise by this factor on both sides for a null to be visible.
const RISE: f64 = 2.0;
/// Width of a wall's edge over the filter's, and the argument of erfc there: amplitude 1e-4.
const EDGE: f64 = 0.05;
const EDGE_ERFC: f64 = 2.63;

/// What the section says of a run and of what [`theory_db`] expects there.
pub fn judge(run: &Run, theory_db: &[f64]) -> Spectrum {
    let mut found = Spectrum::default();
    if theory_db.is_empty() {
        found.null_reason = Some("there is no spectrum, or no signal in it");
        return found;
    }
    let peak_db = theory_db.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let pairs = || run.psd.iter().zip(theory_db).filter(|(_, theory)| **theory > peak_db - 20.0);
    let errors: Vec<f64> = pairs().map(|(row, theory)| row.density_db - theory).collect();
    found.level_error_db = median(&errors);
    let about: Vec<f64> = errors.iter().map(|e| (e - found.level_error_db.unwrap_or(0.0)).abs()).collect();
    found.shape_error_p95_db = crate::analysis::statistics::percentile(&about, 0.95);
    match nulls(run, theory_db) {
        Ok([low, high]) => {
            (found.null_low_hz, found.null_low_expected_hz) = (Some(low.0), Some(low.1));
            (found.null_high_hz, found.null_high_expected_hz) = (Some(high.0), Some(high.1));
        }
        Err(reason) => found.null_reason = Some(reason),
    }
    found
}

/// Expected density at the frequencies of `psd.csv`, in the same decibels. Where the truth does not state the
/// level (no `noise_lsb`), it is fitted. Empty without a spectrum or without signals.
pub fn theory_db(run: &Run) -> Vec<f64> {
    let signals: Vec<&MeanSignal> = run.expected.iter().filter(|one| is_in(run, one.signal)).collect();
    let sources = jamming::sources(run);
    let Some(center_hz) = run.scene.center_hz.filter(|_| !signals.is_empty() && !run.psd.is_empty()) else {
        return Vec::new();
    };
    let rate_hz = run.scene.sample_rate_hz;
    let floor = if run.scene.noise { 1.0 } else { 0.0 };
    let sign = if run.scene.inverted { -1.0 } else { 1.0 };
    let bin_hz = run.psd.get(1).zip(run.psd.first()).map_or(1.0, |(b, a)| b.frequency_hz - a.frequency_hz);
    let if_hz = signals.first().map_or(0.0, |signal| sign * (signal.nominal_hz - center_hz));
    // Samples of a whole signal have its whole power, whatever of its spectrum the sampler meets.
    let edge = run.scene.code_edge;
    let with_power = |signal: &Signal| {
        let power = Waveform::of(signal)?.power(edge, rate_hz);
        Some((Waveform::sent(signal, run.scene.waveform)?, power))
    };
    let own = run.signals.iter().filter(|signal| is_in(run, signal));
    let known: BTreeMap<&Signal, (Waveform, f64)> =
        own.filter_map(|&signal| Some((signal, with_power(signal)?))).collect();
    let waveforms: Vec<(&MeanSignal, &(Waveform, f64))> =
        signals.iter().filter_map(|&signal| Some((signal, known.get(signal.signal)?))).collect();
    let mut density: Vec<f64> = run
        .psd
        .iter()
        .map(|row| {
            let of = |(signal, (waveform, power)): &(&MeanSignal, &(Waveform, f64))| {
                let from_carrier_hz = row.frequency_hz - sign * (signal.carrier_hz - center_hz);
                signal.cn0_hz * waveform.sampled(edge, from_carrier_hz, rate_hz) / power
            };
            let jammed: f64 = sources.values().map(|source| jamming::density(source, row.frequency_hz, bin_hz)).sum();
            floor + waveforms.iter().map(of).sum::<f64>() + jammed
        })
        .collect();
    let level = run.scene.noise_lsb.map(|sigma| 2.0 * sigma * sigma / rate_hz);
    density.iter_mut().for_each(|value| *value *= level.unwrap_or(1.0));
    if let Some(filter) = run.scene.filters().next() {
        for (value, row) in density.iter_mut().zip(&run.psd) {
            *value *= filter_power(filter, row.frequency_hz - if_hz);
        }
    }
    if let Some(balance) = run.scene.balance() {
        unbalance(&mut density, balance, run, bin_hz);
    }
    if level.is_some() {
        // Of a one-sided spectrum the integral is the one component's power, of a two-sided one that of both.
        let one_sided = run.psd.first().is_some_and(|row| row.frequency_hz >= 0.0);
        let power = density.iter().sum::<f64>() * bin_hz * if one_sided { 1.0 } else { 0.5 };
        let (gain, added) = quantiser(run.scene.converter(), power.sqrt());
        density.iter_mut().for_each(|value| *value = *value * gain * gain + 2.0 * added / rate_hz);
    }
    let shape: Vec<f64> = density.into_iter().map(|value| 10.0 * libm::log10(value.max(1e-30))).collect();
    if level.is_some() {
        return shape;
    }
    // Near the nulls quantisation, not the codes, sets the level.
    let peak_db = shape.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let near = run.psd.iter().zip(&shape).filter(|(_, shape)| **shape > peak_db - 20.0);
    let level_db = median(&near.map(|(row, shape)| row.density_db - shape).collect::<Vec<_>>()).unwrap_or(0.0);
    shape.into_iter().map(|shape| shape + level_db).collect()
}

/// Whether the samples whose spectrum is judged have a signal: of several front ends they are those of the
/// first.
fn is_in(run: &Run, signal: &Signal) -> bool {
    let first = run.scene.front_ends.first();
    first.is_none_or(|first| first.signals.iter().any(|name| name == signal.name))
}

/// Power gain of a filter at a frequency from its middle.
fn filter_power(filter: &FilterSpec, f_hz: f64) -> f64 {
    let half_hz = 0.5 * filter.bandwidth_hz;
    match filter.shape {
        FilterShape::Butterworth { order } => 1.0 / (1.0 + libm::pow((f_hz / half_hz).abs(), f64::from(2 * order))),
        FilterShape::BrickWall => {
            let amplitude = 0.5 * erfc(EDGE_ERFC * (f_hz.abs() - half_hz) / (EDGE * half_hz));
            amplitude * amplitude
        }
    }
}

/// Adds the image of quadratures out of balance and the line of direct current.
fn unbalance(density: &mut [f64], balance: &BalanceSpec, run: &Run, bin_hz: f64) {
    let image = libm::pow(10.0, balance.image_db.unwrap_or(-300.0) / 10.0);
    let before = density.to_vec();
    for ((value, row), index) in density.iter_mut().zip(&run.psd).zip(0..) {
        // Two-sided frequencies run from −N/2: bin k mirrors to N − k.
        let mirrored = before.get(before.len() - usize::min(index, before.len())).copied().unwrap_or(0.0);
        *value += image * mirrored;
        *value += balance.dc_power_lsb2 * jamming::hann(row.frequency_hz / bin_hz) / bin_hz;
    }
}

/// Gain of the converter, and the power that quantisation adds to a component, for Gaussian samples of
/// `sigma_lsb`.
fn quantiser(adc: Option<&ConverterSpec>, sigma_lsb: f64) -> (f64, f64) {
    let Some(adc) = adc else { return (1.0, 1.0 / 12.0) };
    let made_for_lsb = if adc.gain_control { sigma_lsb } else { adc.nominal_lsb };
    let step_lsb = adc.step_sigma * made_for_lsb;
    if adc.whole {
        return (1.0 / step_lsb, 1.0 / 12.0);
    }
    // Cells of the step's width, levels 2k + 1, outermost cells endless.
    let half = 1_i64 << (adc.bits - 1);
    let cumulated = |x: f64| 0.5 * (1.0 + erf(x / std::f64::consts::SQRT_2));
    let bell = |x: f64| libm::exp(-0.5 * x * x) / std::f64::consts::TAU.sqrt();
    let edge = |k: i64| match k {
        k if k <= -half => f64::NEG_INFINITY,
        k if k >= half => f64::INFINITY,
        k => k as f64 * step_lsb / sigma_lsb,
    };
    let (mut square, mut product) = (0.0, 0.0);
    for k in -half..half {
        let (low, high, out) = (edge(k), edge(k + 1), (2 * k + 1) as f64);
        square += out * out * (cumulated(high) - cumulated(low));
        product += out * (bell(low) - bell(high));
    }
    let gain = product / sigma_lsb;
    (gain, (square - product * product).max(0.0))
}

/// A null as measured and as expected.
type Null = (f64, f64);

/// Decibels of C/N0 that filter and converter of its front end cost each signal's code, noise alone counted:
/// a filter passes less of the code than of noise with the code's spectrum, and rounding adds noise.
pub fn costs_db(run: &Run) -> BTreeMap<&'static Signal, f64> {
    let kept = |signal: &Signal| {
        let place = run.front_end(signal);
        let stages = run.scene.stages(place).0;
        let noise_lsb = run.scene.front_ends.get(place).map_or(run.scene.noise_lsb, |own| Some(own.noise_lsb));
        let converted = noise_lsb.filter(|_| run.scene.noise).map_or(1.0, |sigma_lsb| {
            let (gain, added) = quantiser(converter(stages), sigma_lsb);
            let power = (gain * sigma_lsb) * (gain * sigma_lsb);
            power / (power + added)
        });
        converted * filters(stages).next().map_or(1.0, |filter| passed(filter, run, signal))
    };
    run.signals.iter().map(|&signal| (signal, -10.0 * libm::log10(kept(signal)))).collect()
}

/// What a filter about the carrier of its front end's first signal leaves of a code's power over noise:
/// (∫S|H| df)²/(∫S|H|² df · ∫S df).
fn passed(filter: &FilterSpec, run: &Run, signal: &Signal) -> f64 {
    let Some(code) = Waveform::sent(signal, run.scene.waveform) else { return 1.0 };
    let place = run.front_end(signal);
    let (edge, rate_hz) =
        (run.scene.front_ends.get(place).map_or(run.scene.code_edge, |own| own.code_edge), run.rate_hz(signal));
    let first = run.expected.iter().find(|one| run.front_end(one.signal) == place);
    let off_hz = first.map_or(0.0, |first| signal.centre_hz() - first.nominal_hz);
    let (mut all, mut amplitude, mut power) = (0.0, 0.0, 0.0);
    for k in -1000..1000 {
        let f_hz = (f64::from(k) + 0.5) * rate_hz / 2000.0;
        let density = code.sampled(edge, f_hz, rate_hz);
        let gain = filter_power(filter, f_hz + off_hz);
        (all, amplitude, power) = (all + density, amplitude + density * gain.sqrt(), power + density * gain);
    }
    amplitude * amplitude / (power * all)
}

/// The nulls beside the main lobe of the code, where the samples hold one signal on one carrier.
fn nulls(run: &Run, theory_db: &[f64]) -> Result<[Null; 2], &'static str> {
    let mut emissions = Emission::all(run.truth.keys().filter(|link| is_in(run, link.signal))).into_iter();
    let emission = emissions.next().ok_or("there is no signal")?;
    if emissions.next().is_some() {
        return Err("filled: several signals or carriers share the spectrum");
    }
    let waveform = Waveform::sent(emission.signal, run.scene.waveform).ok_or("the signal has no code")?;
    let (chip_rate_hz, null_hz) = (waveform.chip_rate_hz(), waveform.null_hz().ok_or("the code has none")?);
    let center_hz = run.scene.center_hz.ok_or("the samples' frequency is unknown")?;
    let sign = if run.scene.inverted { -1.0 } else { 1.0 };
    let if_hz = sign * (emission.carrier_hz() - center_hz);
    let linear = |db: f64| libm::pow(10.0, db / 10.0);
    let measured: Vec<(f64, f64)> =
        run.psd.iter().map(|row| (row.frequency_hz - if_hz, linear(row.density_db))).collect();
    let theory: Vec<(f64, f64)> = measured.iter().zip(theory_db).map(|((f_hz, _), db)| (*f_hz, linear(*db))).collect();
    let one = |null_hz: f64| -> Result<Null, &'static str> {
        let search: Vec<(f64, f64)> =
            theory.iter().filter(|(f_hz, _)| (f_hz - null_hz).abs() <= SEARCH * chip_rate_hz).copied().collect();
        let (Some(left), Some(right)) = (search.first(), search.last()) else {
            return Err("outside the samples' band");
        };
        if right.0 - left.0 < 1.8 * SEARCH * chip_rate_hz {
            return Err("outside the samples' band");
        }
        let least = search.iter().map(|p| p.1).fold(f64::INFINITY, f64::min);
        if left.1.min(right.1) < RISE * least {
            return Err(
                "hidden: the spectrum rises by less than 3 dB beside it, because noise or interference fills it",
            );
        }
        let bin_hz = search.get(1).map_or(0.0, |second| second.0 - left.0);
        let reach_hz = (BOTTOM * chip_rate_hz).max(BOTTOM_BINS * bin_hz);
        let bottom = |points: &[(f64, f64)]| {
            let near: Vec<(f64, f64)> =
                points.iter().filter(|(f, _)| (f - null_hz).abs() <= reach_hz).copied().collect();
            parabola(&near, null_hz, chip_rate_hz)
        };
        bottom(&measured).zip(bottom(&theory)).ok_or("the spectrum has no bottom there")
    };
    Ok([one(-null_hz)?, one(null_hz)?])
}

/// Lowest point of the parabola of least squares through points near `middle_hz`.
fn parabola(points: &[(f64, f64)], middle_hz: f64, scale_hz: f64) -> Option<f64> {
    let top = points.iter().map(|p| p.1).fold(0.0, f64::max);
    let (mut normal, mut right) = (nalgebra::Matrix3::zeros(), nalgebra::Vector3::zeros());
    for (f_hz, density) in points {
        let x = (f_hz - middle_hz) / scale_hz;
        let row = nalgebra::Vector3::new(1.0, x, x * x);
        normal += row * row.transpose();
        right += density / top * row;
    }
    let found = nalgebra::Cholesky::new(normal)?.solve(&right);
    let bottom = -0.5 * found.y / found.z;
    (found.z > 0.0 && bottom.abs() < SEARCH).then_some(middle_hz + bottom * scale_hz)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::analysis::hand_made::{Draw, planted};
    use crate::analysis::measure::psd::Psd;
    use crate::analysis::read::PsdRow;
    use crate::analysis::waveform::Edge;
    use crate::gnss::facts::{FrontEndFacts, StageSpec};
    use crate::gnss::gps::l5::L5;

    #[test]
    fn converters_lose_what_the_literature_says() {
        // Correlation loss 10 lg(g²σ²/(g²σ² + d)) (Hegarty 2011): 1.96 dB of one bit, 0.549 of two and 0.166
        // of three at best steps.
        for (bits, step_sigma, loss_db) in [(1, 1.0, 1.961), (2, 0.9957, 0.549), (3, 0.586, 0.166)] {
            let adc = ConverterSpec { bits, step_sigma, nominal_lsb: 28.0, gain_control: false, whole: false };
            let (gain, added) = quantiser(Some(&adc), 28.0);
            let kept = gain * gain * 28.0 * 28.0;
            let found = 10.0 * libm::log10((kept + added) / kept);
            assert!((found - loss_db).abs() < 1e-3, "{bits} bits: {found}");
        }
        assert_eq!(quantiser(None, 28.0), (1.0, 1.0 / 12.0));
    }

    #[test]
    fn filters_halve_the_power_where_they_say() {
        let filter = |shape| FilterSpec { shape, bandwidth_hz: 2e6, group_delay_s: 0.0 };
        let butterworth = filter(FilterShape::Butterworth { order: 4 });
        assert!((filter_power(&butterworth, 1e6) - 0.5).abs() < 1e-12);
        assert!((filter_power(&butterworth, 2e6) - 1.0 / 257.0).abs() < 1e-12);
        let wall = filter(FilterShape::BrickWall);
        assert!((filter_power(&wall, 0.9e6) - 1.0).abs() < 1e-6 && filter_power(&wall, 1.06e6) < 1e-7);
    }

    #[test]
    fn a_parabola_has_its_bottom_where_it_was_put() {
        let points: Vec<(f64, f64)> = (-50..=50)
            .map(|k| 1.023e6 + 1e3 * f64::from(k))
            .map(|f| (f, 3.0 + ((f - 1.0242e6) / 1e5).powi(2)))
            .collect();
        assert!((parabola(&points, 1.023e6, 1.023e6).unwrap() - 1.0242e6).abs() < 1e-3);
        assert_eq!(parabola(&[], 1.0, 1.0), None);
    }

    #[test]
    fn a_filter_costs_the_signals_of_its_own_front_end_alone() {
        let directory = planted();
        let mut run = Run::read(directory.path()).unwrap();
        let l1 = run.expected[0].signal;
        run.expected.push(MeanSignal {
            signal: &L5,
            carrier_hz: 1_176.45e6,
            nominal_hz: 1_176.45e6,
            ..run.expected[0]
        });
        run.signals.insert(&L5);
        let narrow = FilterSpec { shape: FilterShape::BrickWall, bandwidth_hz: 2.2e6, group_delay_s: 0.0 };
        let of = |rate_hz: f64, stages: Vec<StageSpec>| FrontEndFacts {
            sample_rate_hz: rate_hz,
            noise_lsb: 28.0,
            front_end: stages,
            ..FrontEndFacts::default()
        };
        run.scene.front_ends = vec![of(10.23e6, vec![StageSpec::Filter(narrow)]), of(25e6, Vec::new())];
        run.front_ends = [(l1, 0), (&L5, 1)].into_iter().collect();
        let costs_db = costs_db(&run);
        // A filter as wide as the main lobe takes a third of a decibel; rounding at 28 LSB a ten-thousandth.
        assert!((0.05..0.6).contains(&costs_db[l1]), "{costs_db:?}");
        assert!(costs_db[&L5] < 0.001, "{costs_db:?}");
        // The other way round it is wide enough for neither lobe of L5.
        run.front_ends = [(l1, 1), (&L5, 0)].into_iter().collect();
        let turned_db = super::costs_db(&run);
        assert!(turned_db[l1] < 0.001 && turned_db[&L5] > 1.0, "{turned_db:?}");
    }

    #[test]
    fn the_spectrum_of_random_chips_is_the_theory_s_and_has_its_nulls() {
        let directory = planted();
        let mut run = Run::read(directory.path()).unwrap();
        run.expected.iter_mut().for_each(|signal| signal.carrier_hz = signal.nominal_hz);
        (run.scene.noise, run.scene.code_edge, run.scene.sample_rate_hz) = (false, Edge::Nearest, 10.23e6);
        let mut draw = Draw(3);
        let chips = (0..400_000).map(|_| if draw.normal() < 0.0 { -30.0_f32 } else { 30.0 });
        let samples: Vec<f32> = chips.flat_map(|chip| [chip; 10]).collect();
        let silence = vec![0.0; samples.len()];
        let mut estimate = |bins: usize| {
            let mut psd = Psd::new(10.23e6, false, bins);
            psd.add(&samples, &silence);
            let row =
                |(frequency_hz, density): (f64, f64)| PsdRow { frequency_hz, density_db: 10.0 * libm::log10(density) };
            run.psd = psd.density().unwrap().into_iter().map(row).collect();
            let theory_db = theory_db(&run);
            let found = judge(&run, &theory_db);
            (theory_db, run.psd.clone(), found)
        };
        let (theory_db, measured, _) = estimate(512);
        let peak_db = theory_db.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        // 15 600 segments, half overlapped: 1 % or 0.04 dB; the window's width costs 0.06 dB 20 dB down.
        for (row, theory_db) in measured.iter().zip(&theory_db).filter(|(_, theory_db)| **theory_db > peak_db - 20.0) {
            assert!((row.density_db - theory_db).abs() < 0.3, "{} Hz", row.frequency_hz);
        }
        // Bins are 2.5 kHz apart.
        let (_, _, found) = estimate(4096);
        // A parabola over ±2 % of a chip rate lies 0.00024 of it, 250 Hz, outside the null, here as there.
        for (found_hz, expected_hz, null_hz) in [
            (found.null_low_hz, found.null_low_expected_hz, -1.023e6),
            (found.null_high_hz, found.null_high_expected_hz, 1.023e6),
        ] {
            let (found_hz, expected_hz) = (found_hz.unwrap(), expected_hz.unwrap());
            assert!(
                (found_hz - null_hz).abs() < 1e3 && (found_hz - expected_hz).abs() < 500.0,
                "{found_hz} {expected_hz}"
            );
        }
        // What another front end receives is not in these samples, though its carrier has an alias there.
        let alone = super::theory_db(&run);
        let beside = MeanSignal { signal: &L5, carrier_hz: 1_176.45e6, nominal_hz: 1_176.45e6, ..run.expected[0] };
        run.expected.push(beside);
        run.signals.insert(&L5);
        assert_ne!(super::theory_db(&run), alone);
        let of = |signal: &Signal| FrontEndFacts { signals: vec![signal.name.to_owned()], ..FrontEndFacts::default() };
        run.scene.front_ends = vec![of(run.expected[0].signal), of(&L5)];
        assert_eq!(super::theory_db(&run), alone);
        run.scene.noise = true;
        let hidden = judge(&run, &super::theory_db(&run));
        assert!(hidden.null_low_hz.is_none() && hidden.null_reason.unwrap().starts_with("hidden"), "{hidden:?}");
    }
}
