//! Errors of a foreign receiver's code, carrier, Doppler and C/N0, and the biases that they show.
//!
//! A label is what the receiver's own clock reads. That clock moves all pseudoranges of an epoch alike, so
//! their mean error, signal by signal, is its bias and not an error; the same goes for carriers and Dopplers.
//! The truth is taken at the time of reception, the label less that bias. A label that is late by δ beyond it
//! adds δ·λ·f_D to a pseudorange, whose slope over Doppler therefore gives δ; where it is significant the
//! truth is looked up again at the corrected time. Carriers lose one constant an arc. Limits: biases common
//! to all satellites cannot be separated from the clock, and a code bias that happens to go with Doppler not
//! from a late label in a short static scene.

use std::collections::{BTreeMap, BTreeSet};

use super::carriers::{Arcs, Carriers, carriers};
use super::fit::{Estimate, mean_of_means, slope};
use super::measured::{Arc, ClockRow, Measured, ObservationError, Satellite};
use super::pairs::{BySignal, Pair, by_epoch, by_signal, join};
use crate::expect::timeline::Timeline;
use crate::read::rinex_obs::ObservedEpoch;
use crate::statistics::{mean, median, pooled_std, rms, std};
use gnss::earth::SPEED_OF_LIGHT_MPS;
use gnss::signal::{Link, Signal};

/// Times that the truth is looked up at a better time.
const LOOKS: usize = 6;
/// Deviation from the median of an epoch, in standard deviations, beyond which errors are those of a wrong
/// lock.
const OUTLIER_SIGMAS: f64 = 10.0;
/// Deviation from the median in metres beyond which errors are those of a wrong lock.
const OUTLIER_M: f64 = 30.0;

const MILLISECOND_M: f64 = 1e-3 * SPEED_OF_LIGHT_MPS;

/// Joins and measures; `shift_s` is taken from every label first (a week's rollover). `costs_db` is what the
/// front end takes of each signal's C/N0 before any receiver has its samples.
pub fn measure(
    epochs: &[ObservedEpoch],
    timeline: &Timeline,
    shift_s: i64,
    costs_db: &BTreeMap<&'static Signal, f64>,
) -> Measured {
    let label = |epoch: &ObservedEpoch| epoch.label.since(timeline.origin) - shift_s as f64;
    let mut measured = Measured { epochs: epochs.len(), ..Measured::default() };
    let (mut late_s, mut clock_s) = (0.0, vec![0.0; epochs.len()]);
    let mut pairs = join(epochs, timeline, label, |_| 0.0);
    for _ in 0..LOOKS {
        let before_s = (late_s, clock_s);
        clock_s = readings_s(&pairs, epochs.len());
        pairs = join(epochs, timeline, label, |number| late_s + clock_s[number]);
        let found = time_tag(&pairs);
        let total = found.map(|found| Estimate { value: late_s + found.value, sigma: found.sigma });
        measured.time_tag_s = total;
        if let Some(total) = total.filter(|total| total.differs_from(0.0)) {
            late_s = total.value;
            measured.time_tag_applied = true;
            pairs = join(epochs, timeline, label, |number| late_s + clock_s[number]);
        }
        let moved = clock_s.iter().zip(&before_s.1).map(|(new, old)| (new - old).abs());
        // A nanosecond is a micrometre of range.
        if moved.fold((late_s - before_s.0).abs(), f64::max) < 1e-9 {
            break;
        }
    }
    for pair in &mut pairs {
        let cost_db = costs_db.get(pair.link.signal).copied().unwrap_or(0.0);
        measured.front_end_costs_db.insert(pair.link.signal, cost_db);
        pair.truth.effective_dbhz -= cost_db;
    }
    measured.observations = epochs.iter().map(|epoch| epoch.values.len()).sum();
    measured.unmatched = measured.observations - pairs.len();
    measured.joined = pairs.iter().map(|pair| pair.epoch).collect::<BTreeSet<_>>().len();
    let at_edge = |epoch: &&ObservedEpoch| timeline.is_at_edge(label(epoch));
    let edges: Vec<&ObservedEpoch> = epochs.iter().filter(at_edge).collect();
    measured.at_edge = (edges.len(), edges.iter().map(|epoch| epoch.values.len()).sum());
    let common_m = common(&pairs, &mut measured);
    clock(&mut measured, &pairs, &common_m, timeline);
    doppler_and_strength(&mut measured, &pairs);
    let (carriers, arcs) = carriers(&mut measured, &pairs);
    consistency(&mut measured, &pairs, &carriers, &arcs);
    rows(&mut measured, &pairs, &common_m, &carriers);
    satellites(&mut measured, &pairs, &carriers, &arcs);
    measured
}

/// Clock offset of the receiver at each epoch in seconds: the median of its code errors, as one signal may be
/// wrong. Epochs without a pseudorange take the offset of the epoch before, the first ones that of the next.
fn readings_s(pairs: &[Pair<'_>], epochs: usize) -> Vec<f64> {
    let mut found = vec![None; epochs];
    for epoch in by_epoch(pairs) {
        let errors: Vec<f64> = epoch.iter().filter_map(Pair::code_m).collect();
        if let (Some(first), Some(middle_m)) = (epoch.first(), median(&errors)) {
            found[first.epoch] = Some(middle_m / SPEED_OF_LIGHT_MPS);
        }
    }
    let mut last = found.iter().copied().flatten().next().unwrap_or(0.0);
    found
        .into_iter()
        .map(|reading| {
            last = reading.unwrap_or(last);
            last
        })
        .collect()
}

/// Mean code error of each epoch and signal without outliers.
fn common(pairs: &[Pair<'_>], measured: &mut Measured) -> BySignal {
    let deviations: Vec<f64> = by_signal(pairs)
        .flat_map(|epoch| {
            let errors: Vec<f64> = epoch.iter().filter_map(|pair| pair.code_m()).collect();
            let middle = median(&errors).unwrap_or(0.0);
            errors.into_iter().map(move |error| (error - middle).abs())
        })
        .collect();
    // Median of a normal magnitude is 0.6745σ.
    let limit_m = (OUTLIER_SIGMAS * median(&deviations).unwrap_or(0.0) / 0.6745).max(OUTLIER_M);
    (measured.outliers, measured.outlier_limit_m) = (0, limit_m);
    let mut found = BTreeMap::new();
    for epoch in by_signal(pairs) {
        let errors: Vec<f64> = epoch.iter().filter_map(|pair| pair.code_m()).collect();
        let Some(middle) = median(&errors) else { continue };
        let kept: Vec<f64> = errors.iter().copied().filter(|error| (error - middle).abs() <= limit_m).collect();
        measured.outliers += errors.len() - kept.len();
        if let (Some(mean), Some(first)) = (mean(&kept), epoch.first()) {
            found.insert(first.group(), mean);
        }
    }
    found
}

/// Delay of the labels from the slope of code errors over Doppler, both about their epoch's mean.
fn time_tag(pairs: &[Pair<'_>]) -> Option<Estimate> {
    let common_m = common(pairs, &mut Measured::default());
    let mut points = Vec::new();
    for epoch in by_signal(pairs) {
        let Some(common_m) = epoch.first().and_then(|first| common_m.get(&first.group())) else { continue };
        let near = |pair: &&&Pair<'_>| pair.code_m().is_some_and(|error| (error - common_m).abs() < 1e6);
        let with_code: Vec<&Pair<'_>> = epoch.iter().filter(near).copied().collect();
        let speed = |pair: &Pair<'_>| pair.link.wavelength_m() * pair.truth.doppler_hz;
        let Some(speed_mean) = mean(&with_code.iter().map(|pair| speed(pair)).collect::<Vec<_>>()) else { continue };
        points.extend(
            with_code
                .iter()
                .filter_map(|pair| Some((pair.link.sv, speed(pair) - speed_mean, pair.code_m()? - common_m))),
        );
    }
    slope(&points)
}

fn clock(measured: &mut Measured, pairs: &[Pair<'_>], common_m: &BySignal, timeline: &Timeline) {
    for epoch in by_epoch(pairs) {
        let Some(first) = epoch.first() else { continue };
        // One clock, whatever the signals differ by: the mean of theirs.
        let signals: BTreeSet<&'static Signal> = epoch.iter().map(|pair| pair.link.signal).collect();
        let of_signals: Vec<f64> =
            signals.iter().filter_map(|signal| common_m.get(&(first.epoch, *signal)).copied()).collect();
        let Some(bias_m) = mean(&of_signals) else { continue };
        let Some(place) = timeline.place(first.at_s) else { continue };
        measured.clock.push(ClockRow {
            label_s: first.label_s,
            satellites: epoch.len(),
            bias_s: bias_m / SPEED_OF_LIGHT_MPS,
            sampler_bias_s: place.clock_bias_s,
        });
    }
    let points: Vec<((), f64, f64)> = centred(measured.clock.iter().map(|row| (row.label_s, row.bias_s)));
    measured.drift_code = line_slope(&points);
}

/// Points about their middle.
fn centred(points: impl Iterator<Item = (f64, f64)>) -> Vec<((), f64, f64)> {
    let (xs, ys): (Vec<f64>, Vec<f64>) = points.unzip();
    let (x0, y0) = (mean(&xs).unwrap_or(0.0), mean(&ys).unwrap_or(0.0));
    xs.iter().zip(&ys).map(|(x, y)| ((), x - x0, y - y0)).collect()
}

fn line_slope(points: &[((), f64, f64)]) -> Option<f64> {
    let square: f64 = points.iter().map(|(_, x, _)| x * x).sum();
    (square > 0.0).then(|| points.iter().map(|(_, x, y)| x * y).sum::<f64>() / square)
}

fn doppler_and_strength(measured: &mut Measured, pairs: &[Pair<'_>]) {
    let mut points = Vec::new();
    for epoch in by_signal(pairs) {
        let both: Vec<(&Pair<'_>, f64)> =
            epoch.iter().filter_map(|pair| Some((*pair, pair.values.doppler_hz?))).collect();
        let found = mean(&both.iter().map(|(_, value)| *value).collect::<Vec<_>>());
        let truth = mean(&both.iter().map(|(pair, _)| pair.truth.doppler_hz).collect::<Vec<_>>());
        let Some((found, truth)) = found.zip(truth) else { continue };
        points.extend(both.iter().map(|(pair, value)| (pair.link.sv, pair.truth.doppler_hz - truth, value - found)));
    }
    measured.doppler_scale = slope(&points);
    let sign = measured.doppler_sign();
    let offsets: Vec<f64> = pairs
        .iter()
        .filter_map(|pair| Some((sign * pair.values.doppler_hz? - pair.truth.doppler_hz) / pair.link.carrier_hz()))
        .collect();
    measured.drift_doppler = mean(&offsets).map(|offset| -offset);
    let mut strengths: BTreeMap<Link, Vec<f64>> = BTreeMap::new();
    for pair in pairs {
        if let Some(cn0_dbhz) = pair.values.cn0_dbhz {
            strengths.entry(pair.link).or_default().push(cn0_dbhz - pair.truth.effective_dbhz);
        }
    }
    measured.cn0_db = mean_of_means(&strengths.values().filter_map(|errors| mean(errors)).collect::<Vec<_>>());
}

/// Tests code, carrier and Doppler of the receiver for one clock and one motion.
fn consistency(measured: &mut Measured, pairs: &[Pair<'_>], carriers: &Carriers, arcs: &Arcs) {
    let mut drifts = Vec::new();
    let mut turns = Vec::new();
    let (carrier_sign, doppler_sign) = (measured.carrier_sign.unwrap_or(1.0), measured.doppler_sign());
    for arc in arcs {
        drifts.extend(divergence(pairs, carriers, arc).map(|drift| (drift, arc.len())));
        let misses: Vec<f64> = arc
            .windows(2)
            .filter_map(|two| {
                let [a, b] = [&pairs[two[0]], &pairs[two[1]]];
                let turned = carrier_sign * (b.values.carrier_cycles? - a.values.carrier_cycles?);
                let mean_hz = 0.5 * doppler_sign * (a.values.doppler_hz? + b.values.doppler_hz?);
                Some(mean_hz + turned / (b.at_s - a.at_s))
            })
            .collect();
        // A clock that jumps by a millisecond moves one of them by a million cycles.
        turns.extend(median(&misses));
        measured.arcs.extend(line_of(pairs, carriers, arc));
    }
    // Short arcs say too little.
    let longest = drifts.iter().map(|(_, length)| *length).max().unwrap_or(0);
    let long: Vec<f64> = drifts.iter().filter(|(_, length)| 2 * length >= longest).map(|(drift, _)| *drift).collect();
    measured.code_carrier_mps = mean_of_means(&long);
    measured.doppler_carrier_hz = mean_of_means(&turns);
}

/// Line through an arc's carriers; `None` for fewer than three.
fn line_of(pairs: &[Pair<'_>], carriers: &Carriers, arc: &[usize]) -> Option<Arc> {
    let (first, last) = (pairs.get(*arc.first()?)?, pairs.get(*arc.last()?)?);
    let points =
        arc.iter().filter_map(|index| Some((pairs.get(*index)?.label_s, carriers.get(*index)?.as_ref()?.cycles)));
    let points = centred(points);
    let drift_hz = line_slope(&points).filter(|_| points.len() > 2)?;
    let rest: Vec<f64> = points.iter().map(|(_, x, y)| y - drift_hz * x).collect();
    Some(Arc {
        link: first.link,
        span_s: (first.label_s, last.label_s),
        count: points.len(),
        drift_hz,
        sigma_cycles: rms(&rest)?,
        code_carrier_mps: divergence(pairs, carriers, arc),
    })
}

/// Slope over time of code minus carrier error along an arc.
fn divergence(pairs: &[Pair<'_>], carriers: &Carriers, arc: &[usize]) -> Option<f64> {
    let points: Vec<(f64, f64)> = arc
        .iter()
        .filter_map(|index| {
            let pair = pairs.get(*index)?;
            Some((pair.label_s, pair.code_m()? - carriers.get(*index)?.as_ref()?.raw_m))
        })
        .collect();
    if points.len() < 10 {
        return None;
    }
    // A receiver may set the clock of its codes by whole milliseconds and leave that of its carriers.
    let mut set_m = 0.0;
    let mut last_m = points.first().map_or(0.0, |point| point.1);
    let whole = points.into_iter().map(|(label_s, value_m)| {
        set_m += MILLISECOND_M * ((value_m - last_m) / MILLISECOND_M).round();
        last_m = value_m;
        (label_s, value_m - set_m)
    });
    line_slope(&centred(whole))
}

fn rows(measured: &mut Measured, pairs: &[Pair<'_>], common_m: &BySignal, carriers: &Carriers) {
    let sign = measured.doppler_sign();
    let mut doppler_common = BySignal::new();
    let doppler_error = |pair: &Pair<'_>| Some(sign * pair.values.doppler_hz? - pair.truth.doppler_hz);
    for epoch in by_signal(pairs) {
        let errors: Vec<f64> = epoch.iter().filter_map(|pair| doppler_error(pair)).collect();
        if let (Some(first), Some(middle)) = (epoch.first(), mean(&errors)) {
            doppler_common.insert(first.group(), middle);
        }
    }
    measured.rows = pairs
        .iter()
        .zip(carriers)
        .map(|(pair, carrier)| ObservationError {
            label_s: pair.label_s,
            sv: pair.link.sv.to_string(),
            signal: pair.link.signal.name,
            elevation_deg: pair.truth.elevation_deg,
            code_m: pair.code_m().zip(common_m.get(&pair.group())).map(|(error, common)| error - common),
            carrier_cycles: carrier.map(|carrier| carrier.cycles),
            doppler_hz: doppler_error(pair)
                .zip(doppler_common.get(&pair.group()))
                .map(|(error, common)| error - common),
            cn0_db: pair.values.cn0_dbhz.map(|value| value - pair.truth.effective_dbhz),
            link: pair.link,
            at_s: pair.at_s,
            values: pair.values.clone(),
            truth: pair.truth,
        })
        .collect();
    let of = |of: fn(&ObservationError) -> Option<f64>| measured.rows.iter().filter_map(of).collect::<Vec<f64>>();
    measured.code_rms_m = rms(&of(|row| row.code_m));
    measured.doppler_rms_hz = rms(&of(|row| row.doppler_hz));
}

fn satellites(measured: &mut Measured, pairs: &[Pair<'_>], carriers: &Carriers, arcs: &Arcs) {
    let links: BTreeSet<Link> = measured.rows.iter().map(|row| row.link).collect();
    let mut codes = Vec::new();
    for link in links {
        let of = |of: fn(&ObservationError) -> Option<f64>| -> Vec<f64> {
            measured.rows.iter().filter(|row| row.link == link).filter_map(of).collect()
        };
        let (code, doppler, cn0) = (of(|row| row.code_m), of(|row| row.doppler_hz), of(|row| row.cn0_db));
        let own: Vec<&Vec<usize>> =
            arcs.iter().filter(|arc| arc.first().is_some_and(|index| pairs[*index].link == link)).collect();
        let longest = own.iter().max_by_key(|arc| arc.len());
        let name = link.sv.to_string();
        measured.satellites.push(Satellite {
            signal: link.signal.name,
            epochs: measured.rows.iter().filter(|row| row.link == link).count(),
            elevation_deg: mean(&of(|row| Some(row.elevation_deg))).unwrap_or(f64::NAN),
            code_bias_m: mean(&code),
            code_sigma_m: std(&code),
            carrier_sigma_cycles: rms(&of(|row| row.carrier_cycles)),
            doppler_bias_hz: mean(&doppler),
            doppler_sigma_hz: std(&doppler),
            cn0_bias_db: mean(&cn0),
            cn0_sigma_db: std(&cn0),
            code_carrier_drift_mps: longest.and_then(|arc| divergence(pairs, carriers, arc)),
            slips: measured.slips.iter().filter(|slip| slip.sv == name).count(),
            sv: name,
        });
        codes.push(code);
    }
    measured.code_sigma_m = pooled_std(codes.iter().map(Vec::as_slice));
}
