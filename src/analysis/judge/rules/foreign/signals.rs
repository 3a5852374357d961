//! Code, carrier, Doppler and C/N0 of each satellite against the others of its signal.
//!
//! An error is counted from the median of its epoch and signal, so that one wrong satellite is wrong alone.
//! Each row is of the satellite that is nearest to its limit or farthest beyond it, and names it. Limits: an
//! error that most satellites of a signal share is the receiver's clock here; [`super::clocks`] compares
//! clocks.

use std::collections::BTreeMap;

use super::plain::{self, PHASE_CYCLES, PHASE_HZ, Scene};
use crate::expect::due::Expectations;
use crate::expect::quantile::largest;
use crate::judge::foreign::measured::{Measured, ObservationError};
use crate::judge::judgement::Bound;
use crate::judge::rules::kind::THEORY;
use crate::judge::rules::tracking::ONE_BIT_LOSS_DB;
use crate::judge::verdict::Verdict;
use crate::statistics::{mean, median, std};
use gnss::signal::{Link, Signal};

/// Epochs of a satellite from which on its deviation says something.
const ENOUGH: usize = 20;
/// Length of the segments whose means are judged beside the whole.
const STRETCH_S: f64 = 5.0;
/// Largest difference between the C/N0 errors of two satellites, dB. A replica that is half a sample off, at
/// two samples a chip, costs one of them 20 lg(4/3) = 2.5 dB; a C/N0 in whole decibels adds half a decibel.
const CN0_DB: f64 = 3.0;
/// Least time over which a carrier's drift says something.
const DRIFT_S: f64 = 5.0;
/// Error of a carrier's rate in hertz by the truth's own rounding and by steps of a common clock.
const RATE_HZ: f64 = 0.01;

/// A value of one satellite against its limit.
pub(super) struct Found {
    pub name: String,
    pub value: f64,
    pub limit: f64,
}

/// Errors of one satellite, counted from those of its epoch and signal.
pub(super) struct One<'m> {
    pub link: Link,
    pub name: String,
    pub rows: Vec<&'m ObservationError>,
    /// Label, seconds, and error.
    code_m: Vec<(f64, f64)>,
    doppler_hz: Vec<(f64, f64)>,
    /// Largest rate of its true Doppler, without sign.
    pub rate_hzps: f64,
    /// Mean rate of the true Doppler, with sign.
    pub mean_rate_hzps: f64,
    /// A plain receiver's jitter.
    pub plain_m: f64,
}

impl One<'_> {
    /// Variance of the mean of its codes by a plain receiver's noise, m².
    pub(super) fn mean_m2(&self) -> f64 {
        let span_s = self.code_m.first().zip(self.code_m.last()).map_or(0.0, |(first, last)| last.0 - first.0);
        self.plain_m * self.plain_m / plain::independent(self.code_m.len(), span_s, plain::PLAIN_HZ)
    }
}

/// Median of each epoch and signal.
fn middles(
    rows: &[&ObservationError],
    of: impl Fn(&ObservationError) -> Option<f64>,
) -> BTreeMap<(u64, &'static Signal), f64> {
    let mut all: BTreeMap<(u64, &'static Signal), Vec<f64>> = BTreeMap::new();
    for row in rows {
        if let Some(value) = of(row) {
            all.entry((row.label_s.to_bits(), row.link.signal)).or_default().push(value);
        }
    }
    all.into_iter().filter_map(|(key, values)| Some((key, median(&values)?))).collect()
}

/// The satellites of the rows that are judged, each by itself.
pub(super) fn ones<'m>(measured: &'m Measured, scene: &Scene<'_>, expected: &Expectations) -> Vec<One<'m>> {
    let rows: Vec<&ObservationError> = measured.rows.iter().filter(|row| scene.judges(row)).collect();
    let (codes, dopplers) = (middles(&rows, |row| row.code_m), middles(&rows, |row| row.doppler_hz));
    let mut links: BTreeMap<Link, Vec<&ObservationError>> = BTreeMap::new();
    rows.into_iter().for_each(|row| links.entry(row.link).or_default().push(row));
    let one = |(link, rows): (Link, Vec<&'m ObservationError>)| {
        let strengths: Vec<f64> = rows.iter().map(|row| row.truth.effective_dbhz).collect();
        let cn0_dbhz = median(&strengths).filter(|value| value.is_finite());
        let cn0_dbhz = cn0_dbhz.or_else(|| expected.satellites.get(&link).map(|one| one.usual_dbhz));
        let key = |row: &ObservationError| (row.label_s.to_bits(), link.signal);
        let beside = |value: Option<f64>, middles: &BTreeMap<_, f64>, row: &ObservationError| {
            Some((row.label_s, value? - middles.get(&key(row))?))
        };
        let steps = rows.windows(2).filter(|two| two[1].at_s > two[0].at_s);
        let rates = steps.map(|two| (two[1].truth.doppler_hz - two[0].truth.doppler_hz) / (two[1].at_s - two[0].at_s));
        One {
            link,
            name: scene.run.name(link),
            code_m: rows.iter().filter_map(|row| beside(row.code_m, &codes, row)).collect(),
            doppler_hz: rows.iter().filter_map(|row| beside(row.doppler_hz, &dopplers, row)).collect(),
            rate_hzps: rates.map(f64::abs).fold(0.0, f64::max),
            mean_rate_hzps: mean_rate_hzps(&rows),
            plain_m: cn0_dbhz.and_then(|dbhz| plain::code_m(&link, dbhz)).unwrap_or(0.0),
            rows,
        }
    };
    links.into_iter().map(one).collect()
}

/// Rate of a satellite's true Doppler from its first epoch to its last.
fn mean_rate_hzps(rows: &[&ObservationError]) -> f64 {
    let ends = rows.first().zip(rows.last()).filter(|(first, last)| last.at_s > first.at_s);
    ends.map_or(0.0, |(first, last)| (last.truth.doppler_hz - first.truth.doppler_hz) / (last.at_s - first.at_s))
}

/// Segments of at most [`STRETCH_S`] and the whole: span and mean of each.
fn means(values: &[(f64, f64)]) -> Vec<(usize, f64, f64)> {
    let mut parts: Vec<&[(f64, f64)]> = vec![values];
    let mut rest = values;
    while let Some((first_s, _)) = rest.first() {
        let count = rest.partition_point(|(label_s, _)| *label_s < first_s + STRETCH_S).max(1);
        let (part, after) = rest.split_at(count);
        parts.push(part);
        rest = after;
    }
    let of = |part: &[(f64, f64)]| {
        let span_s = part.last()?.0 - part.first()?.0;
        Some((part.len(), span_s, mean(&part.iter().map(|(_, value)| *value).collect::<Vec<_>>())?))
    };
    parts.into_iter().filter_map(of).collect()
}

impl Verdict {
    /// The value that is nearest to its limit or farthest beyond, and all that are beyond by name.
    pub(super) fn nearest(&mut self, figure: &str, path: &str, unit: &str, found: Vec<Found>, source: &str) {
        let beyond: Vec<&Found> = found.iter().filter(|one| one.value > one.limit).collect();
        let mut names: Vec<String> =
            beyond.iter().map(|one| format!("{}: {:.3} of {:.3} {unit}", one.name, one.value, one.limit)).collect();
        names.dedup();
        let worst = found.iter().max_by(|a, b| (a.value / a.limit).total_cmp(&(b.value / b.limit)));
        let Some(worst) = worst else { return };
        if names.is_empty() {
            names.push(worst.name.clone());
        }
        self.judge(figure, path, worst.value, unit, Bound::Max(worst.limit), source);
        self.explain(names);
    }

    /// Pseudoranges of each satellite: their means, and their deviation.
    pub(super) fn codes(&mut self, ones: &[One<'_>], scene: &Scene<'_>) {
        let cuts: usize = ones.iter().map(|one| means(&one.code_m).len()).sum();
        let factor = largest(1, cuts);
        let found = ones.iter().flat_map(|one| {
            means(&one.code_m).into_iter().map(move |(count, span_s, value)| {
                let noise_m = one.plain_m / plain::independent(count, span_s, plain::PLAIN_HZ).sqrt();
                let limit = factor * THEORY * noise_m
                    + largest(1, 1) * scene.edges_m(one.link.signal)
                    + scene.reach(&one.link).code_m;
                Found { name: one.name.clone(), value: value.abs(), limit }
            })
        });
        let source = "the other satellites of the signal, a plain receiver's loop (2 Hz, early and late a chip apart) \
                      at the scene's C/N0, code edges between samples, and reflections; means over 5 s and of all";
        self.nearest("pseudorange error of a satellite, mean", "", "m", found.collect(), source);
        let ratios = ones.iter().filter(|one| one.code_m.len() >= ENOUGH).filter_map(|one| {
            let values: Vec<f64> = one.code_m.iter().map(|(_, value)| *value).collect();
            let usual_m =
                libm::hypot(libm::hypot(one.plain_m, scene.edges_m(one.link.signal)), scene.reach(&one.link).code_m);
            Some(Found { name: one.name.clone(), value: std(&values)? / usual_m, limit: THEORY })
        });
        let source = "a plain receiver's loop (2 Hz, early and late a chip apart) at the scene's C/N0, code edges \
                      between samples (1.5 m), and reflections";
        let figure = "pseudorange sigma over a plain receiver's, largest";
        self.nearest(figure, "", "", ratios.collect(), source);
    }

    /// Dopplers of each satellite: their means, and their scale.
    pub(super) fn dopplers(&mut self, ones: &[One<'_>], scene: &Scene<'_>, measured: &Measured) {
        let cuts: usize = ones.iter().map(|one| means(&one.doppler_hz).len()).sum();
        let factor = largest(1, cuts);
        let usual_hzps = median(&ones.iter().map(|one| one.mean_rate_hzps).collect::<Vec<_>>()).unwrap_or(0.0);
        let found = ones.iter().flat_map(|one| {
            means(&one.doppler_hz).into_iter().enumerate().map(move |(part, (count, span_s, value))| {
                let noise_hz = plain::doppler_hz() / plain::independent(count, span_s, PHASE_HZ).sqrt();
                let mirrors_hz = scene.mirrors_mps() / one.link.wavelength_m();
                // Over all, an age shifts the mean by the mean rate alone.
                let rate_hzps = if part == 0 { one.mean_rate_hzps - usual_hzps } else { one.rate_hzps };
                let limit = factor * THEORY * noise_hz + plain::aged_hz(rate_hzps) + mirrors_hz;
                Found { name: one.name.clone(), value: value.abs(), limit }
            })
        });
        let source = "the other satellites of the signal, a phase loop of 18 Hz with 15 degrees of jitter, an age of \
                      0.1 s, and mirrors that move; means over 5 s and of all";
        self.nearest("Doppler error of a satellite, mean", "", "Hz", found.collect(), source);
        if let Some(scale) = measured.doppler_scale.filter(|_| scene.is_always_bounded()) {
            let limit = SCALE + largest(1, 1) * scale.sigma;
            let source = "one, a thousandth, and the scatter between satellites";
            let value = (scale.value.abs() - 1.0).abs();
            self.judge("scale of Doppler, difference from one", "", value, "", Bound::Max(limit), source);
        }
    }

    /// C/N0 of each satellite, and of each signal.
    pub(super) fn strengths(&mut self, ones: &[One<'_>], scene: &Scene<'_>) {
        let mut signals: BTreeMap<&'static Signal, Vec<(&One<'_>, f64)>> = BTreeMap::new();
        for one in ones {
            let errors: Vec<f64> = one.rows.iter().filter_map(|row| row.cn0_db).collect();
            if let Some(value) = mean(&errors) {
                let of_signal = signals.entry(one.link.signal).or_default();
                of_signal.push((one, value - scene.reach(&one.link).cn0_db));
            }
        }
        let (mut biases, mut satellites) = (Vec::new(), Vec::new());
        for (signal, all) in &signals {
            let Some(middle_db) = median(&all.iter().map(|(_, value)| *value).collect::<Vec<_>>()) else { continue };
            let scatter = |one: &One<'_>| scene.reach(&one.link).cn0_sigma_db;
            let scatter_db = mean(&all.iter().map(|(one, _)| scatter(one)).collect::<Vec<_>>()).unwrap_or(0.0);
            // Who follows one component alone measures its part.
            let shares = signal.components.iter().map(|component| component.power_share);
            let part_db = -10.0 * libm::log10(shares.fold(1.0, f64::min));
            let limit = ONE_BIT_LOSS_DB + scatter_db + if middle_db < 0.0 { part_db } else { 0.0 };
            biases.push(Found { name: signal.name.to_owned(), value: middle_db.abs(), limit });
            satellites.extend(all.iter().map(|(one, value)| {
                let limit = CN0_DB + scatter(one);
                Found { name: one.name.clone(), value: (value - middle_db).abs(), limit }
            }));
        }
        let source = "C/N0 in the samples: the antenna's less what band edge, filter and converter take; loss of a \
                      one-bit quantiser, 10 lg(π/2), one component's part, fades: more is unexplained";
        self.nearest("C/N0 bias, magnitude", "", "dB", biases, source);
        let source =
            "the scene's C/N0 and the other satellites of the signal: half a sample at two samples a chip, and fades";
        self.nearest("C/N0 error of a satellite against the others", "", "dB", satellites, source);
    }

    /// Carriers of each satellite, arc by arc: drift, jitter, and the code beside them.
    pub(super) fn arcs(&mut self, measured: &Measured, ones: &[One<'_>], scene: &Scene<'_>) {
        let judged = |label_s: f64, link: &Link| scene.is_bounded(label_s) && scene.is_sound(link, label_s);
        let arcs: Vec<_> = (measured.arcs.iter())
            .filter(|arc| arc.span_s.1 - arc.span_s.0 >= DRIFT_S && arc.count >= 5)
            .filter(|arc| judged(arc.span_s.0, &arc.link) && judged(arc.span_s.1, &arc.link))
            .collect();
        let factor = largest(1, arcs.len());
        let slope = |span_s: f64, independent: f64| 12.0_f64.sqrt() / (span_s * independent.sqrt());
        let drifts = arcs.iter().map(|arc| {
            let span_s = arc.span_s.1 - arc.span_s.0;
            let cycles = PHASE_CYCLES * slope(span_s, plain::independent(arc.count, span_s, PHASE_HZ));
            let mirrors = 4.0 * scene.reach(&arc.link).carrier_cycles / span_s;
            let limit = RATE_HZ + factor * cycles + mirrors;
            Found { name: scene.run.name(arc.link), value: arc.drift_hz.abs(), limit }
        });
        let source =
            "the other satellites of the signal, 15 degrees of jitter, and reflections over an unbroken carrier";
        self.nearest("drift of a carrier against the others", "", "Hz", drifts.collect(), source);
        let jitters = arcs.iter().filter(|arc| arc.count >= ENOUGH).map(|arc| {
            let limit = PHASE_CYCLES + scene.reach(&arc.link).carrier_cycles;
            Found { name: scene.run.name(arc.link), value: arc.sigma_cycles, limit }
        });
        let source = "rule of thumb for a phase loop, 15 degrees, and reflections";
        self.nearest("jitter of a carrier", "", "cycles", jitters.collect(), source);
        let divergences = arcs.iter().filter_map(|arc| {
            let span_s = arc.span_s.1 - arc.span_s.0;
            let one = ones.iter().find(|one| one.link == arc.link)?;
            let noise_m = one.plain_m * slope(span_s, plain::independent(arc.count, span_s, plain::PLAIN_HZ));
            let slow_m =
                (2.0 * largest(1, 1) * scene.edges_m(arc.link.signal) + 2.0 * scene.reach(&arc.link).code_m) / span_s;
            let limit = factor * THEORY * noise_m + slow_m;
            Some(Found { name: scene.run.name(arc.link), value: arc.code_carrier_mps?.abs(), limit })
        });
        let source = "code and carrier have one range and one clock: a plain receiver's code noise, edges between \
                      samples, and reflections over an unbroken carrier";
        self.nearest("code against carrier of a satellite, drift", "", "m/s", divergences.collect(), source);
    }
}

/// Difference of a Doppler's scale that is not reported: 1 Hz in 1000.
const SCALE: f64 = 1e-3;
