//! The spectrum that theory expects of the samples, front end and converter in, and the nulls of the code
//! found against it.
//!
//! [`super::samples`] has the spectrum itself. Nothing is fitted: the median of measured over expected is
//! reported. Limits: nulls are looked for where the samples have one signal on one carrier.

use std::collections::BTreeMap;

use serde::Serialize;

use crate::error::JudgeError;
use crate::expect::converter::Staircase;
use crate::expect::followed::Followed;
use crate::expect::front_end::FrontEnd;
use crate::expect::samples::{Expected, Sent};
use crate::read::{Emission, Run, replica_edge};
use crate::statistics::median;
use crate::waveform::{Sampler, Waveform};
use gnss::facts::{converter, filters};
use gnss::samples::Format;
use gnss::signal::Signal;

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
    /// Lower null that the search finds in the expected spectrum, Hz from the carrier: Doppler moves it.
    pub null_low_expected_hz: Option<f64>,
    /// Upper null that the search finds in the expected spectrum, Hz from the carrier.
    pub null_high_expected_hz: Option<f64>,
    /// Reason why a null is not reported.
    pub null_reason: Option<&'static str>,
}

/// Half width of the search for a null, in chip rates.
const SEARCH: f64 = 0.1;
/// Half width of the fit of its bottom, in chip rates.
const BOTTOM: f64 = 0.02;
/// Least number of bins to each side of that bottom.
const BOTTOM_BINS: f64 = 4.0;
/// The spectrum must rise by this factor on both sides for a null to be visible.
const RISE: f64 = 2.0;

/// Figures of the spectrum section, from a run and from the expected [`theory_db`].
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
    found.shape_error_p95_db = crate::statistics::percentile(&about, 0.95);
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
///
/// # Errors
/// [`JudgeError::Read`] where spilled rows cannot be read.
pub fn theory_db(run: &Run) -> Result<Vec<f64>, JudgeError> {
    let front_end = FrontEnd::of(run, 0);
    let sent = Sent::of(run, &front_end)?;
    if sent.is_empty() {
        return Ok(Vec::new());
    }
    Ok(Expected::of(run, &front_end, &sent, &run.psd).map_or_else(Vec::new, |expected| expected.density_db()))
}

/// A null as measured and as expected.
type Null = (f64, f64);

/// Decibels of C/N0 that filter and converter of its front end cost each signal's replica, noise alone
/// counted: a filter passes less of the code than of noise with the code's spectrum, and rounding adds noise.
/// The cost of edges between samples is apart: [`edge_cost_db`].
pub fn costs_db(run: &Run) -> BTreeMap<&'static Signal, f64> {
    let kept = |signal: &'static Signal| {
        let place = run.front_end(signal);
        let stages = run.scene.stages(place).0;
        let own = run.scene.front_ends.get(place);
        let noise_lsb = own.map_or(run.scene.noise_lsb, |own| Some(own.noise_lsb));
        let format: Option<Format> = own.map_or(&run.scene.format, |own| &own.format).parse().ok();
        let converted = noise_lsb.filter(|_| run.scene.noise).map_or(1.0, |sigma_lsb| {
            let staircase = Staircase::of(converter(stages), format.and_then(Format::full_scale_lsb), sigma_lsb);
            let (gain, added) = staircase.map_or((1.0, 0.0), |staircase| staircase.gain_and_noise(sigma_lsb));
            let power = (gain * sigma_lsb) * (gain * sigma_lsb);
            power / (power + added)
        });
        let passed = match filters(stages).next() {
            Some(_) => {
                found(run, signal, true).zip(found(run, signal, false)).map_or(1.0, |(with, without)| with / without)
            }
            None => 1.0,
        };
        converted * passed
    };
    run.signals.iter().map(|&signal| (signal, -10.0 * libm::log10(kept(signal)))).collect()
}

/// Decibels of C/N0 that edges between samples cost a signal's replica, negative where it gains.
///
/// The truth's C/N0 is at the antenna, and so is each component's share of it; the sampler's response X takes
/// its part, as a filter does. A replica whose samples have the response R finds the amplitude
/// ∫ S_x·X·R·F df of a component of unit power behind a filter F, S_x the cross spectrum of what is sent and
/// the replica, in the noise ∫ S_r·R²·F² df, S_r the replica's own spectrum. A receiver takes the loss of its
/// replica for (∫ S_w df)²/∫ S_r df, of the whole component before any filter. So what it states is
///
/// (∫ S_x·X·R·F)²/∫ S_r·R²·F² · ∫ S_r/(∫ S_w)²
///
/// of the truth's.
pub fn edge_cost_db(run: &Run, signal: &'static Signal) -> f64 {
    -10.0 * libm::log10(found(run, signal, false).unwrap_or(1.0))
}

/// Steps of those integrals over the samples' band.
const STEPS: i32 = 1000;

/// Power that a replica finds of a signal behind sampler and, where wanted, filter, over the receiver's
/// assumption.
fn found(run: &Run, signal: &'static Signal, filtered: bool) -> Option<f64> {
    let place = run.front_end(signal);
    let sampler = run.sampler(place);
    let rate_hz = sampler.rate_hz();
    let followed = Followed::of(run, signal)?;
    let replica = Sampler::new(replica_edge(&run.receiver, sampler.edge()), rate_hz);
    let front_end = FrontEnd::of(run, place);
    let first_hz = run.expected.iter().find(|one| front_end.has(one.signal))?.nominal_hz;
    let filter = Some(&front_end).filter(|_| filtered).and_then(|own| own.filter_at(first_hz));
    let carrier_hz = front_end.place_hz(signal.centre_hz());
    // Of both sidebands of a sub-carrier the chips are what is found, about the sub-carrier's frequency.
    let side_hz = followed.sides.map_or(0.0, |tone| tone.side_hz(followed.own.chip_rate_hz()));
    let step_hz = rate_hz / f64::from(STEPS);
    let (mut amplitude, mut noise) = (0.0, 0.0);
    for k in -STEPS / 2..STEPS / 2 {
        let within_hz = (f64::from(k) + 0.5) * step_hz;
        let passed = filter.as_ref().map_or(1.0, |filter| filter.amplitude(carrier_hz + within_hz));
        for alias in sampler.aliases() {
            let hz = within_hz + f64::from(alias) * rate_hz;
            let by = replica.amplitude(hz - side_hz);
            amplitude += step_hz * followed.found.density(hz - side_hz) * sampler.amplitude(hz) * by * passed;
            noise += step_hz * followed.own.density(hz - side_hz) * by * by * passed * passed;
        }
    }
    let (assumed, own) = (followed.assumed.correlation(0.0), followed.own.correlation(0.0));
    Some(amplitude * amplitude / noise * own / (assumed * assumed))
}

/// The nulls beside the main lobe of the code, where the samples hold one signal on one carrier.
fn nulls(run: &Run, theory_db: &[f64]) -> Result<[Null; 2], &'static str> {
    let front_end = FrontEnd::of(run, 0);
    let mut emissions = Emission::all(run.truth.keys().filter(|link| front_end.has(link.signal))).into_iter();
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
    use crate::hand_made::{Draw, planted};
    use crate::measure::psd::Psd;
    use crate::read::{MeanSignal, PsdRow};
    use crate::waveform::Edge;
    use gnss::facts::{FilterShape, FilterSpec, FrontEndFacts, StageSpec};
    use gnss::galileo::e1::E1;
    use gnss::gps::l1c::L1C;
    use gnss::gps::l5::L5;

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
        let narrow =
            FilterSpec { shape: FilterShape::BrickWall, bandwidth_hz: 2.2e6, group_delay_s: 0.0, middle_hz: None };
        let of = |rate_hz: f64, stages: Vec<StageSpec>, signals: [&Signal; 1]| FrontEndFacts {
            sample_rate_hz: rate_hz,
            center_hz: signals[0].centre_hz(),
            format: "ci8".to_owned(),
            code_edge: Edge::Area,
            signals: signals.map(|signal| signal.name.to_owned()).to_vec(),
            noise_lsb: 28.0,
            front_end: stages,
            ..FrontEndFacts::default()
        };
        run.scene.front_ends = vec![of(10.23e6, vec![StageSpec::Filter(narrow)], [l1]), of(25e6, Vec::new(), [&L5])];
        run.front_ends = [(l1, 0), (&L5, 1)].into_iter().collect();
        let costs_db = costs_db(&run);
        // A filter as wide as the main lobe takes a third of a decibel; rounding at 28 LSB a ten-thousandth.
        assert!((0.05..0.6).contains(&costs_db[l1]), "{costs_db:?}");
        assert!(costs_db[&L5] < 0.001, "{costs_db:?}");
        // The other way round it is wide enough for neither lobe of L5.
        run.front_ends = [(l1, 1), (&L5, 0)].into_iter().collect();
        run.scene.front_ends = vec![of(10.23e6, vec![StageSpec::Filter(narrow)], [&L5]), of(25e6, Vec::new(), [l1])];
        let turned_db = super::costs_db(&run);
        assert!(turned_db[l1] < 0.001 && turned_db[&L5] > 1.0, "{turned_db:?}");
    }

    #[test]
    fn the_spectrum_of_random_chips_is_the_theory_s_and_has_its_nulls() {
        let directory = planted();
        let mut run = Run::read(directory.path()).unwrap();
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
            let theory_db = without_doppler(&run);
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
        run.scene.noise = true;
        let hidden = judge(&run, &without_doppler(&run));
        assert!(hidden.null_low_hz.is_none() && hidden.null_reason.unwrap().starts_with("hidden"), "{hidden:?}");
    }
    /// Expected spectrum of the samples if all carriers were at rest.
    fn without_doppler(run: &Run) -> Vec<f64> {
        let front_end = FrontEnd::of(run, 0);
        let mut sent = Sent::of(run, &front_end).unwrap();
        sent.iter_mut().for_each(|one| one.carrier_hz = one.nominal_hz);
        Expected::of(run, &front_end, &sent, &run.psd).unwrap().density_db()
    }

    /// A run of one signal alone, of which replicas of the pilot's strongest layer are followed.
    fn of_one(directory: &std::path::Path, signal: &'static Signal, (edge, rate_hz): (Edge, f64)) -> Run {
        let pilot = signal.components.iter().position(|component| component.message.is_none());
        let mut run = Run::read(directory).unwrap();
        let first = run.expected[0];
        let carrier_hz = signal.centre_hz();
        run.expected = vec![MeanSignal { signal, carrier_hz, nominal_hz: carrier_hz, ..first }];
        run.signals = [signal].into_iter().collect();
        run.front_ends = [(signal, 0)].into_iter().collect();
        (run.scene.code_edge, run.scene.sample_rate_hz, run.scene.noise) = (edge, rate_hz, false);
        run.scene.center_hz = Some(carrier_hz);
        run.receiver = serde_json::json!({
            "settings": {"tracking": {"replica": "area"}},
            "followed": [{"signal": signal.name, "component": pilot, "layer": 0, "other_side": null,
                "spacing_chips": 0.1, "integration_s": 0.004, "pll_bandwidth_hz": 15.0, "dll_bandwidth_hz": 1.0}],
        });
        run
    }

    /// Gain of a replica of BOC(1,1) by means over samples, over its assumption for the whole signal, by
    /// samples made step by step. The signal is a pilot of CBOC whose samples are means too, or are taken
    /// behind a filter of 0.40 cycles a sample.
    fn made(limited: bool, rate_hz: f64) -> f64 {
        const FINE: usize = 120; // steps a chip
        let fine_hz = FINE as f64 * 1.023e6;
        let mut draw = Draw(5);
        let chips: Vec<f64> = (0..20_000).map(|_| if draw.normal() < 0.0 { -1.0 } else { 1.0 }).collect();
        let square = |n: usize, periods: usize| if (2 * periods * n / FINE).is_multiple_of(2) { 1.0 } else { -1.0 };
        let waves = |n: usize| {
            let chip = chips.get(n / FINE).copied().unwrap_or(0.0);
            (chip * square(n % FINE, 1), chip * square(n % FINE, 6))
        };
        let per_sample = fine_hz / rate_hz;
        // A response about each sample's instant: a mean over its interval, or the filter's taps.
        let kernel = |limited: bool| -> Vec<f64> {
            let reach = if limited { 8.0 * per_sample } else { 0.5 * per_sample };
            let half = reach.floor() as i32;
            let tap = |k: i32| {
                let x = f64::from(k) / per_sample;
                if !limited {
                    return 1.0;
                }
                let turn = std::f64::consts::TAU * 0.40 * x;
                let sinc = if k == 0 { 1.0 } else { libm::sin(turn) / turn };
                let bessel = |y: f64| {
                    (1..40)
                        .fold((1.0, 1.0), |(sum, term), k| {
                            let term: f64 = term * y * y / 4.0 / f64::from(k * k);
                            (sum + term, term)
                        })
                        .0
                };
                sinc * bessel(5.65 * (1.0 - (x / 8.0) * (x / 8.0)).max(0.0).sqrt())
            };
            let taps: Vec<f64> = (-half..=half).map(tap).collect();
            let sum: f64 = taps.iter().sum();
            taps.into_iter().map(|tap| tap / sum).collect()
        };
        let (own, other) = (kernel(limited), kernel(false));
        let at = |kernel: &[f64], middle: usize, of: &dyn Fn(usize) -> f64| -> f64 {
            let from = middle - kernel.len() / 2;
            kernel.iter().enumerate().map(|(k, tap)| tap * of(from + k)).sum()
        };
        // Of the pilot the weak wave is subtracted; the data count for nothing.
        let (strong, weak) = ((10.0_f64 / 11.0).sqrt(), (1.0_f64 / 11.0).sqrt());
        let (mut found, mut noise) = (0.0, 0.0);
        let samples = 12_000;
        for sample in 0..samples {
            let middle = 2000 + (f64::from(sample) * per_sample * 1.000_013).round() as usize;
            let one = |n: usize| waves(n).0;
            let [a, b] = [at(&own, middle, &one), at(&own, middle, &|n| waves(n).1)];
            let replica = at(&other, middle, &one);
            found += (strong * a - weak * b) * replica;
            noise += replica * replica;
        }
        found * found / (f64::from(samples) * noise) / (strong * strong)
    }

    /// Gain of a replica of BOC(1,1), zero where chips are BOC(6,1), by means over samples, over its
    /// assumption, by samples made step by step. The signal is a pilot of that form whose samples are means
    /// too.
    fn made_in_turn(rate_hz: f64) -> f64 {
        const STEPS: usize = 12; // a chip
        let mut draw = Draw(7);
        let is_six = |chip: usize| [0, 4, 6, 29].contains(&(chip % 33));
        // Sums of both waves from the first step on: a mean over an interval is a difference.
        let mut sums = vec![[0.0, 0.0]];
        for chip in 0..40_000 {
            let sign = if draw.normal() < 0.0 { -1.0 } else { 1.0 };
            for step in 0..STEPS {
                let half = if is_six(chip) { step } else { 2 * step / STEPS };
                let value = if half % 2 == 0 { sign } else { -sign };
                let [sent, made] = sums.last().copied().unwrap_or_default();
                sums.push([sent + value, made + if is_six(chip) { 0.0 } else { value }]);
            }
        }
        let at = |place: f64| {
            let (index, part) = (place as usize, place.fract());
            let between = |which: usize| sums[index][which] + part * (sums[index + 1][which] - sums[index][which]);
            [between(0), between(1)]
        };
        let per_sample = STEPS as f64 * 1.023e6 / rate_hz;
        let samples = ((sums.len() - 2) as f64 / per_sample) as u32;
        let [mut found, mut noise] = [0.0; 2];
        for sample in 0..samples {
            let from = f64::from(sample) * per_sample;
            let ([a, b], [c, d]) = (at(from), at(from + per_sample));
            found += (c - a) * (d - b);
            noise += (d - b) * (d - b);
        }
        found * found / (f64::from(samples) * per_sample * per_sample * noise) * 33.0 / 29.0
    }

    #[test]
    fn a_pilot_loses_to_edges_what_they_take_of_its_own_share_of_the_power() {
        let directory = planted();
        for rate_hz in [5e6, 5.2e6, 6.5e6, 10e6] {
            let run = of_one(directory.path(), &L1C, (Edge::Area, rate_hz));
            let expected_db = 10.0 * libm::log10(made_in_turn(rate_hz));
            let found_db = -edge_cost_db(&run, &L1C);
            println!("{rate_hz}: {found_db:.4} {expected_db:.4}");
            // Of 40 000 chips a seventh shares a sample with another one: their products average to 1/200 of
            // a third of the power or less, 0.008 dB; two of them.
            assert!((found_db - expected_db).abs() < 0.025, "{rate_hz}: {found_db} {expected_db}");
        }
    }

    #[test]
    fn a_replica_of_boc_1_1_loses_to_edges_what_they_take_from_boc_1_1() {
        let directory = planted();
        for (edge, rate_hz) in
            [(Edge::BandLimited, 5e6), (Edge::BandLimited, 6.5e6), (Edge::Area, 6.5e6), (Edge::Area, 10e6)]
        {
            let run = of_one(directory.path(), &E1, (edge, rate_hz));
            let gain_db = -edge_cost_db(&run, &E1);
            let expected_db = 10.0 * libm::log10(made(edge == Edge::BandLimited, rate_hz));
            // 12 000 samples at most of 2500 chips: each product of different chips averages to 1/50 of what
            // it is, and the weak wave is three tenths of the strong one behind the filter.
            assert!((gain_db - expected_db).abs() < 0.08, "{edge:?} {rate_hz}: {gain_db} {expected_db}");
            // Nothing is put back of what edges take.
            assert!((-1.7..0.0).contains(&gain_db), "{edge:?} {rate_hz}: {gain_db}");
        }
        // Nothing is lost where samples are instants and the band is wide.
        let run = of_one(directory.path(), &E1, (Edge::Nearest, 200e6));
        assert!(edge_cost_db(&run, &E1).abs() < 0.03, "{}", edge_cost_db(&run, &E1));
    }
}
