//! Common errors of a foreign receiver's satellites: signs, labels, clocks by signal, and code, carrier and
//! Doppler of one clock.
//!
//! The clock itself is not an error. Its offsets by the signals agree, and so do its rates by code, carrier
//! and Doppler: observations are those of one instant (RINEX 3.05, 4.1.1). A clock that is set by whole
//! milliseconds has steps, which are not drift.

use std::collections::{BTreeMap, BTreeSet};

use super::plain::{self, Scene};
use super::signals::{Found, One};
use crate::expect::quantile::largest;
use crate::judge::foreign::measured::{Measured, ObservationError};
use crate::judge::foreign::{Estimate, slope};
use crate::judge::judgement::Bound;
use crate::judge::rules::kind::THEORY;
use crate::judge::verdict::Verdict;
use crate::statistics::{mean, median, rms};
use gnss::earth::SPEED_OF_LIGHT_MPS;
use gnss::satellite::Sv;
use gnss::signal::{Link, Signal};

const RINEX: &str =
    "RINEX 3.05, 5.2: carriers grow with range, Doppler is positive for an approaching satellite; each satellite";
/// Difference between a Doppler and its carrier's rate, Hz: a Doppler that is cut to whole hertz, in place of
/// rounded, is half a hertz off on average.
const RATE_HZ: f64 = 0.5;
/// Longest interval over which a mean of two Dopplers is the carrier's rate.
const INTERVAL_S: f64 = 2.0;
/// Doppler from which on its sign can be told.
const SIGN_HZ: f64 = 100.0;
/// Epochs that must have the same value before it is called frozen.
const FROZEN: usize = 20;
/// Time over which they must have it.
const FROZEN_S: f64 = 5.0;
/// Farther from the others a pseudorange is of another signal, and says nothing of time.
const FAR_M: f64 = 1e5;

/// Drift of the receiver's clock by its code: the median over epochs, as it may be set.
fn drift_of(measured: &Measured) -> f64 {
    let steps =
        measured.clock.windows(2).map(|two| (two[1].bias_s - two[0].bias_s) / (two[1].label_s - two[0].label_s));
    median(&steps.collect::<Vec<_>>()).unwrap_or(0.0)
}

/// A satellite's signal, the speed along its line of sight in m/s, and its code error in metres.
type Point = (Link, f64, f64);

/// Delay of the labels by the judged rows: the shift that the truth already had, and the remaining slope of
/// pseudoranges over Doppler.
fn judged_late(measured: &Measured, scene: &Scene<'_>) -> Option<Estimate> {
    let mut epochs: BTreeMap<(u64, &'static Signal), Vec<Point>> = BTreeMap::new();
    for row in measured.rows.iter().filter(|row| scene.judges(row)) {
        if let Some(code_m) = row.code_m.filter(|code_m| code_m.abs() < FAR_M) {
            let point = (row.link, row.link.wavelength_m() * row.truth.doppler_hz, code_m);
            epochs.entry((row.label_s.to_bits(), row.link.signal)).or_default().push(point);
        }
    }
    let points: Vec<(Sv, f64, f64)> = epochs
        .into_values()
        .flat_map(|points| {
            let of = |of: fn(&Point) -> f64| mean(&points.iter().map(of).collect::<Vec<_>>()).unwrap_or(0.0);
            let (speed, error) = (of(|point| point.1), of(|point| point.2));
            points.into_iter().map(move |point| (point.0.sv, point.1 - speed, point.2 - error))
        })
        .collect();
    let applied_s = measured.time_tag_s.filter(|_| measured.time_tag_applied).map_or(0.0, |late| late.value);
    slope(&points).map(|found| Estimate { value: applied_s + found.value, sigma: found.sigma })
}

impl Verdict {
    /// Signs of carriers and Dopplers, satellite by satellite.
    pub(super) fn signs(&mut self, measured: &Measured, scene: &Scene<'_>) {
        let mut links: BTreeMap<Link, Vec<&ObservationError>> = BTreeMap::new();
        measured.rows.iter().for_each(|row| links.entry(row.link).or_default().push(row));
        let drift = drift_of(measured);
        let (mut carriers, mut dopplers) = (Vec::new(), Vec::new());
        for (link, rows) in &links {
            let with_clock_hz = |row: &ObservationError| row.truth.doppler_hz - link.carrier_hz() * drift;
            let values: Vec<f64> = rows.iter().map(|row| with_clock_hz(row)).collect();
            if rms(&values).is_none_or(|usual_hz| usual_hz < SIGN_HZ) {
                continue;
            }
            let products = rows.iter().filter_map(|row| Some(row.values.doppler_hz? * with_clock_hz(row)));
            dopplers.extend(mean(&products.collect::<Vec<_>>()).map(|product| (*link, product > 0.0)));
            let mut sum = 0.0;
            for two in rows.windows(2) {
                let carriers = two[0].values.carrier_cycles.zip(two[1].values.carrier_cycles);
                let Some((from, to)) = carriers.filter(|_| !two[1].values.lost_lock) else { continue };
                let turned = -0.5 * (with_clock_hz(two[0]) + with_clock_hz(two[1])) * (two[1].at_s - two[0].at_s);
                // A clock that is set by a millisecond turns a carrier by a million cycles, and tells no
                // sign.
                sum += turned * (to - from).clamp(-2.0 * turned.abs(), 2.0 * turned.abs());
            }
            if sum != 0.0 {
                carriers.push((*link, sum > 0.0));
            }
        }
        for (figure, path, links) in
            [("sign of the carrier", "carrier.sign", carriers), ("sign of Doppler", "", dopplers)]
        {
            if links.is_empty() {
                continue;
            }
            let wrong: Vec<String> =
                links.iter().filter(|(_, right)| !right).map(|(link, _)| scene.run.name(*link)).collect();
            let sign = if wrong.is_empty() { 1.0 } else { -1.0 };
            self.judge(figure, path, sign, "", Bound::Equals(1.0.into()), RINEX);
            self.explain(if wrong.is_empty() { Vec::new() } else { vec![format!("opposite: {}", wrong.join(", "))] });
        }
    }

    /// Labels against what the pseudoranges say of the time.
    pub(super) fn time_tags(&mut self, measured: &Measured, ones: &[One<'_>], scene: &Scene<'_>) {
        let Some(late) = judged_late(measured, scene) else { return };
        // Speeds along the lines of sight about their mean, and what biases of each satellite make of the
        // slope.
        let speeds: Vec<f64> = ones
            .iter()
            .filter_map(|one| {
                mean(&one.rows.iter().map(|row| one.link.wavelength_m() * row.truth.doppler_hz).collect::<Vec<_>>())
            })
            .collect();
        let squares: f64 = mean(&speeds).map_or(0.0, |usual| speeds.iter().map(|v| (v - usual).powi(2)).sum());
        let bias_m = THEORY * libm::hypot(scene.usual_edges_m(), scene.reach_m());
        let theory_s = if squares > 0.0 { bias_m / squares.sqrt() } else { f64::INFINITY };
        // The scatter between satellites is itself uncertain where there are few.
        let sigma_s = theory_s.min(2.0 * late.sigma);
        let limit = 1e3 * largest(1, 1) * sigma_s;
        let source = "labels less the receiver's own clock are the time of reception: the slope of pseudoranges over \
                      Doppler, by biases of satellites and the scatter between them";
        let path = "join.time_tag_offset_s";
        self.judge("time tags of observations, late", path, 1e3 * late.value.abs(), "ms", Bound::Max(limit), source);
    }

    /// The clock by one signal against that by another.
    pub(super) fn offsets(&mut self, measured: &Measured, ones: &[One<'_>], scene: &Scene<'_>) {
        let mut errors: BTreeMap<(u64, &'static Signal), Vec<f64>> = BTreeMap::new();
        for row in measured.rows.iter().filter(|row| scene.judges(row)) {
            if let Some(code_m) = row.values.pseudorange_m {
                errors.entry((row.label_s.to_bits(), row.link.signal)).or_default().push(code_m - row.truth.range_m);
            }
        }
        let mut counts: BTreeMap<&'static Signal, usize> = BTreeMap::new();
        errors.iter().for_each(|((_, signal), values)| *counts.entry(*signal).or_default() += values.len());
        let Some((usual, _)) = counts.iter().max_by_key(|(_, count)| **count).map(|(s, c)| (*s, *c)) else { return };
        let mut offsets: BTreeMap<&'static Signal, (Vec<f64>, usize)> = BTreeMap::new();
        for ((label, signal), values) in &errors {
            let both = median(values).zip(errors.get(&(*label, usual)).and_then(|values| median(values)));
            if let Some((own, other)) = both.filter(|_| *signal != usual) {
                let (all, satellites) = offsets.entry(*signal).or_default();
                all.push(own - other);
                *satellites = (*satellites).max(values.len());
            }
        }
        // A sample stands for the beginning of its interval or for the middle, in all front ends alike.
        let half_m = |signal| 0.5 * SPEED_OF_LIGHT_MPS / scene.run.rate_hz(signal);
        let delay_m = |signal: &Signal| SPEED_OF_LIGHT_MPS * scene.run.common.code_delay_s(signal);
        let noise_m = |signal: &Signal| {
            let own = ones.iter().filter(|one| one.link.signal == signal);
            let (variances, satellites) = own.map(One::mean_m2).fold((0.0, 0.0), |(sum, n), m2| (sum + m2, n + 1.0));
            variances.sqrt() / f64::max(satellites, 1.0)
        };
        let found = offsets.into_iter().filter_map(|(signal, (all, satellites))| {
            let biases_m = libm::hypot(scene.usual_edges_m(), scene.reach_m()) / (satellites as f64).sqrt();
            let sigma_m = libm::hypot(biases_m, libm::hypot(noise_m(signal), noise_m(usual)));
            let value = median(&all)? - (delay_m(signal) - delay_m(usual));
            let limit = (half_m(signal) - half_m(usual)).abs() + largest(1, 1) * THEORY * sigma_m;
            Some(Found { name: format!("{} against {}", signal.name, usual.name), value: value.abs(), limit })
        });
        let source = "one clock: half a sample where rates differ, the filters' delays, biases of satellites, and a \
                      plain receiver's noise";
        self.nearest("offset of pseudoranges between signals", "", "m", found.collect(), source);
    }

    /// Code, carrier and Doppler of one clock.
    pub(super) fn rates(&mut self, measured: &Measured, ones: &[One<'_>], scene: &Scene<'_>) {
        let labels: BTreeSet<u64> = ones.iter().flat_map(|one| &one.rows).map(|row| row.label_s.to_bits()).collect();
        let labels: Vec<f64> = labels.into_iter().map(f64::from_bits).collect();
        let steps: Vec<f64> = labels.windows(2).map(|two| two[1] - two[0]).collect();
        let interval_s = median(&steps).unwrap_or(0.0);
        if let Some(rate) = measured.doppler_carrier_hz {
            let rates = ones.iter().map(|one| one.mean_rate_hzps.abs()).fold(0.0, f64::max);
            if interval_s <= INTERVAL_S {
                // Seconds by a clock that drifts are other seconds for the Doppler of the drift itself.
                let drift = drift_of(measured);
                let carrier_hz = ones.iter().map(|one| one.link.carrier_hz()).fold(0.0, f64::max);
                let seconds_hz = carrier_hz * drift * drift;
                let limit = RATE_HZ + largest(1, 1) * rate.sigma + plain::aged_hz(rates) + seconds_hz;
                let source = "a Doppler is minus its carrier's rate: half a hertz, the scatter between satellites, and \
                              an age of 0.1 s";
                let path = "doppler.minus_carrier_rate_hz";
                self.judge("Doppler plus the carrier's rate", path, rate.value.abs(), "Hz", Bound::Max(limit), source);
            } else {
                self.not_judged.push(format!(
                    "Doppler plus the carrier's rate: {interval_s:.0} s between epochs are too long for the mean of \
                     two Dopplers"
                ));
            }
        }
        let span_s = measured.arcs.iter().map(|arc| 0.5 * (arc.span_s.1 - arc.span_s.0)).fold(0.0, f64::max);
        if let Some(drift) = measured.code_carrier_mps.filter(|_| span_s > INTERVAL_S && scene.is_always_bounded()) {
            let satellites = (ones.len() as f64).max(1.0);
            let plain_m = ones.iter().map(|one| one.plain_m).fold(0.0, f64::max);
            // Arcs half as long as the longest count at the least.
            let count = plain::independent(1 + (span_s / interval_s.max(1e-3)) as usize, span_s, plain::PLAIN_HZ);
            let noise = plain_m * 12.0_f64.sqrt() / (span_s * (count * satellites).sqrt());
            let slow = (2.0 * scene.usual_edges_m() / satellites.sqrt() + 2.0 * scene.reach_m()) / span_s;
            let limit = largest(1, 1) * (THEORY * noise + slow.min(drift.sigma));
            let source = "one clock moves both: noise of codes, and the scatter between satellites";
            let path = "code.minus_carrier_drift_mps";
            self.judge("code against carrier, drift", path, drift.value.abs(), "m/s", Bound::Max(limit), source);
        }
    }

    /// Values that do not change though what they measure does.
    pub(super) fn frozen(&mut self, measured: &Measured, scene: &Scene<'_>) {
        let mut links: BTreeMap<Link, Vec<&ObservationError>> = BTreeMap::new();
        measured.rows.iter().for_each(|row| links.entry(row.link).or_default().push(row));
        // A receiver that rounds its C/N0 may repeat it.
        let fine = measured.rows.iter().filter_map(|row| row.values.cn0_dbhz).any(|value| (2.0 * value).fract() != 0.0);
        let mut found = Vec::new();
        for (link, rows) in &links {
            let mut run = |what: &str,
                           moved: &dyn Fn(&[&ObservationError]) -> bool,
                           value: &dyn Fn(&ObservationError) -> Option<f64>| {
                let same = |a: &&ObservationError, b: &&ObservationError| value(a).is_some() && value(a) == value(b);
                for part in rows.chunk_by(same) {
                    let span_s = part.last().zip(part.first()).map_or(0.0, |(last, first)| last.at_s - first.at_s);
                    if part.len() > 1 && span_s > 0.0 && moved(part) {
                        let first_s = part.first().map_or(0.0, |row| row.label_s);
                        found.push(format!(
                            "{what} of {} for {span_s:.1} s from {first_s:.1} s on",
                            scene.run.name(*link)
                        ));
                        return;
                    }
                }
            };
            let ends = |part: &[&ObservationError], of: fn(&ObservationError) -> f64| {
                part.last().zip(part.first()).map_or(0.0, |(last, first)| (of(last) - of(first)).abs())
            };
            let long = |part: &[&ObservationError]| part.len() >= FROZEN && ends(part, |row| row.at_s) >= FROZEN_S;
            run("pseudorange", &|part| ends(part, |row| row.truth.range_m) > 10.0, &|row| row.values.pseudorange_m);
            run("carrier", &|part| ends(part, |row| row.truth.carrier_cycles) > 5.0, &|row| row.values.carrier_cycles);
            run("Doppler", &|part| long(part) && ends(part, |row| row.truth.doppler_hz) > 1.0, &|row| {
                row.values.doppler_hz
            });
            if fine && scene.run.scene.noise {
                run("C/N0", &|part| long(part), &|row| row.values.cn0_dbhz);
            }
        }
        let source =
            "ranges that change by ten metres, 20 epochs and 5 s of Dopplers that change and of C/N0 under noise";
        self.judge("values that stay as they were", "", found.len(), "", Bound::Max(0.0), source);
        self.explain(found);
    }
}
