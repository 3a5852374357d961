//! Errors of a foreign receiver's code, carrier, Doppler and C/N0, and the biases that they show.
//!
//! The truth is taken at each epoch's label. A receiver's own clock moves all pseudoranges of an epoch alike,
//! so their mean error, signal by signal, is its clock and not an error; the same goes for carriers and
//! Dopplers. A label that is late by δ adds δ·λ·f_D to a pseudorange, whose slope over Doppler therefore
//! gives δ; where it is significant the truth is looked up again at the corrected time. Carriers lose one
//! constant an arc. Limits: biases common to all satellites cannot be told from the clock, and a code bias
//! that happens to go with Doppler not from a late label in a short static scene.

use std::collections::{BTreeMap, BTreeSet};

use serde::Serialize;

use super::fit::{Estimate, mean_of_means, slope};
use crate::analysis::expect::timeline::{State, Timeline};
use crate::analysis::measure::errors::{Link, SLIP_CYCLES, first_jump_of};
use crate::analysis::read::rinex_obs::{ObservedEpoch, Values};
use crate::analysis::statistics::{mean, median, pooled_std, rms, std};
use crate::gnss::earth::SPEED_OF_LIGHT_MPS;
use crate::gnss::signal::{self, Signal};

/// Times that the truth is looked up at a better time.
const LOOKS: usize = 6;
/// Errors of one epoch further from their median than this many deviations, or than the metres below, are of
/// a wrong lock.
const OUTLIER_SIGMAS: f64 = 10.0;
const OUTLIER_M: f64 = 30.0;
/// Gaps longer than this many intervals break an arc.
const GAP: f64 = 1.5;

/// One observation against the truth: a row of `foreign_observations.csv`. Errors are measured minus true;
/// what is common to the satellites of its epoch is taken out, of carriers also an arc's constant.
#[derive(Clone, Debug, Serialize)]
pub struct Row {
    pub label_s: f64,
    pub sv: String,
    pub signal: &'static str,
    pub elevation_deg: f64,
    pub code_m: Option<f64>,
    pub carrier_cycles: Option<f64>,
    pub doppler_hz: Option<f64>,
    pub cn0_db: Option<f64>,
    #[serde(skip)]
    pub link: Link,
}

/// What an epoch's satellites have in common: a row of `foreign_clock.csv`.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct ClockRow {
    pub label_s: f64,
    pub satellites: usize,
    /// Mean error of the pseudoranges over the speed of light: reading of the receiver's clock minus GPS time.
    pub bias_s: f64,
    /// The sampler's clock there.
    pub sampler_bias_s: f64,
}

/// A break of a carrier's count: a row of `foreign_slips.csv`.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Slip {
    pub label_s: f64,
    pub sv: String,
    /// To the half cycle; unknown where the count was interrupted.
    pub size_cycles: Option<f64>,
    /// By the file's loss-of-lock indicator.
    pub declared: bool,
}

/// What one satellite's errors come to: a row of `foreign_satellites.csv`.
#[derive(Clone, Debug, Serialize)]
pub struct Satellite {
    pub sv: String,
    pub signal: &'static str,
    pub epochs: usize,
    pub elevation_deg: f64,
    pub code_bias_m: Option<f64>,
    pub code_sigma_m: Option<f64>,
    pub carrier_sigma_cycles: Option<f64>,
    pub doppler_bias_hz: Option<f64>,
    pub doppler_sigma_hz: Option<f64>,
    pub cn0_bias_db: Option<f64>,
    pub cn0_sigma_db: Option<f64>,
    /// Code minus carrier, against that of the truth.
    pub code_carrier_drift_mps: Option<f64>,
    pub slips: usize,
}

/// Everything measured.
#[derive(Clone, Debug, Default)]
pub struct Measured {
    pub epochs: usize,
    pub joined: usize,
    pub observations: usize,
    /// Of satellites or times that the truth does not have.
    pub unmatched: usize,
    pub outliers: usize,
    pub time_tag_s: Option<Estimate>,
    /// Whether it was significant, so that the truth was taken at the corrected times.
    pub time_tag_applied: bool,
    pub rows: Vec<Row>,
    pub clock: Vec<ClockRow>,
    pub slips: Vec<Slip>,
    pub satellites: Vec<Satellite>,
    pub code_rms_m: Option<f64>,
    pub code_sigma_m: Option<f64>,
    pub carrier_sign: Option<f64>,
    pub carrier_rms_cycles: Option<f64>,
    pub doppler_scale: Option<Estimate>,
    pub doppler_rms_hz: Option<f64>,
    pub cn0_db: Option<Estimate>,
    pub drift_code: Option<f64>,
    pub drift_carrier: Option<f64>,
    pub drift_doppler: Option<f64>,
    pub code_carrier_mps: Option<Estimate>,
    pub doppler_carrier_hz: Option<Estimate>,
}

/// One observation and the truth at its time.
#[derive(Clone, Debug)]
struct Pair<'a> {
    epoch: usize,
    label_s: f64,
    link: Link,
    values: &'a Values,
    truth: State,
}

impl Pair<'_> {
    fn code_m(&self) -> Option<f64> {
        Some(self.values.pseudorange_m? - self.truth.range_m)
    }
}

/// Joins and measures; `shift_s` is taken from every label first (a week's rollover).
pub fn measure(epochs: &[ObservedEpoch], timeline: &Timeline, shift_s: i64) -> Measured {
    let label = |epoch: &ObservedEpoch| epoch.label.since(timeline.origin) - shift_s as f64;
    let mut measured = Measured { epochs: epochs.len(), ..Measured::default() };
    let (mut late_s, mut pairs) = (0.0, join(epochs, timeline, label, 0.0));
    for _ in 0..LOOKS {
        let found = time_tag(&pairs);
        let total = found.map(|found| Estimate { value: late_s + found.value, sigma: found.sigma });
        measured.time_tag_s = total;
        let Some(total) = total.filter(|total| total.differs_from(0.0)) else { break };
        let step_s = total.value - late_s;
        late_s = total.value;
        measured.time_tag_applied = true;
        pairs = join(epochs, timeline, label, late_s);
        // A nanosecond is a micrometre of range.
        if step_s.abs() < 1e-9 {
            break;
        }
    }
    measured.observations = epochs.iter().map(|epoch| epoch.values.len()).sum();
    measured.unmatched = measured.observations - pairs.len();
    measured.joined = pairs.iter().map(|pair| pair.epoch).collect::<BTreeSet<_>>().len();
    let common_m = common(&pairs, &mut measured.outliers);
    clock(&mut measured, &pairs, &common_m, timeline, late_s);
    doppler_and_strength(&mut measured, &pairs);
    let (carriers, arcs) = carriers(&mut measured, &pairs);
    consistency(&mut measured, &pairs, &carriers, &arcs);
    rows(&mut measured, &pairs, &common_m, &carriers);
    satellites(&mut measured, &pairs, &carriers, &arcs);
    measured
}

fn join<'a>(
    epochs: &'a [ObservedEpoch],
    timeline: &Timeline,
    label: impl Fn(&ObservedEpoch) -> f64,
    late_s: f64,
) -> Vec<Pair<'a>> {
    let signals = signal::all();
    let mut pairs = Vec::new();
    for (number, epoch) in epochs.iter().enumerate() {
        let label_s = label(epoch);
        for ((sv, code), values) in &epoch.values {
            let signal = signals.iter().find(|signal| signal.system == sv.system && signal.rinex == code);
            let Some(signal) = signal else { continue };
            let link = Link { sv: *sv, signal };
            if let Some(truth) = timeline.state(&link, label_s - late_s) {
                pairs.push(Pair { epoch: number, label_s, link, values, truth });
            }
        }
    }
    pairs
}

/// Splits pairs, which ascend by epoch, into epochs.
fn by_epoch<'p, 'a>(pairs: &'p [Pair<'a>]) -> impl Iterator<Item = &'p [Pair<'a>]> {
    pairs.chunk_by(|a, b| a.epoch == b.epoch)
}

/// Something of each epoch and signal, by epoch number.
type BySignal = BTreeMap<(usize, &'static Signal), f64>;

/// The same epochs with their signals apart: a receiver's delays differ by signal.
fn by_signal<'p, 'a>(pairs: &'p [Pair<'a>]) -> impl Iterator<Item = Vec<&'p Pair<'a>>> {
    by_epoch(pairs).flat_map(|epoch| {
        let mut groups: BTreeMap<&'static Signal, Vec<&'p Pair<'a>>> = BTreeMap::new();
        epoch.iter().for_each(|pair| groups.entry(pair.link.signal).or_default().push(pair));
        groups.into_values()
    })
}

impl Pair<'_> {
    fn group(&self) -> (usize, &'static Signal) {
        (self.epoch, self.link.signal)
    }
}

/// Mean code error of each epoch and signal without outliers.
fn common(pairs: &[Pair<'_>], outliers: &mut usize) -> BySignal {
    let deviations: Vec<f64> = by_signal(pairs)
        .flat_map(|epoch| {
            let errors: Vec<f64> = epoch.iter().filter_map(|pair| pair.code_m()).collect();
            let middle = median(&errors).unwrap_or(0.0);
            errors.into_iter().map(move |error| (error - middle).abs())
        })
        .collect();
    // Median of a normal magnitude is 0.6745σ.
    let limit_m = (OUTLIER_SIGMAS * median(&deviations).unwrap_or(0.0) / 0.6745).max(OUTLIER_M);
    *outliers = 0;
    let mut found = BTreeMap::new();
    for epoch in by_signal(pairs) {
        let errors: Vec<f64> = epoch.iter().filter_map(|pair| pair.code_m()).collect();
        let Some(middle) = median(&errors) else { continue };
        let kept: Vec<f64> = errors.iter().copied().filter(|error| (error - middle).abs() <= limit_m).collect();
        *outliers += errors.len() - kept.len();
        if let (Some(mean), Some(first)) = (mean(&kept), epoch.first()) {
            found.insert(first.group(), mean);
        }
    }
    found
}

/// Delay of the labels from the slope of code errors over Doppler, both about their epoch's mean.
fn time_tag(pairs: &[Pair<'_>]) -> Option<Estimate> {
    let mut outliers = 0;
    let common_m = common(pairs, &mut outliers);
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

fn clock(measured: &mut Measured, pairs: &[Pair<'_>], common_m: &BySignal, timeline: &Timeline, late_s: f64) {
    for epoch in by_epoch(pairs) {
        let Some(first) = epoch.first() else { continue };
        // One clock, whatever the signals differ by: the mean of theirs.
        let signals: BTreeSet<&'static Signal> = epoch.iter().map(|pair| pair.link.signal).collect();
        let of_signals: Vec<f64> =
            signals.iter().filter_map(|signal| common_m.get(&(first.epoch, *signal)).copied()).collect();
        let Some(bias_m) = mean(&of_signals) else { continue };
        let Some(place) = timeline.place(first.label_s - late_s) else { continue };
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
fn centred(points: impl Iterator<Item = (f64, f64)> + Clone) -> Vec<((), f64, f64)> {
    let [xs, ys]: [Vec<f64>; 2] = [points.clone().map(|p| p.0).collect(), points.map(|p| p.1).collect()];
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

impl Measured {
    fn doppler_sign(&self) -> f64 {
        if self.doppler_scale.is_some_and(|scale| scale.value < 0.0) { -1.0 } else { 1.0 }
    }
}

/// A carrier error.
#[derive(Clone, Copy, Debug)]
struct Carrier {
    /// In metres, the receiver's clock still in.
    raw_m: f64,
    /// Without the clock and the arc's constant.
    cycles: f64,
}

type Carriers = Vec<Option<Carrier>>;
/// Indices into the pairs, an arc each.
type Arcs = Vec<Vec<usize>>;

/// Usual distance of epochs.
fn usual_step_s(pairs: &[Pair<'_>]) -> f64 {
    let labels: Vec<f64> = by_epoch(pairs).filter_map(|epoch| Some(epoch.first()?.label_s)).collect();
    median(&labels.windows(2).map(|pair| pair[1] - pair[0]).collect::<Vec<_>>()).unwrap_or(1.0)
}

/// Carrier errors without clock and constants, breaks found. A link's arcs follow one another in `Arcs`.
fn carriers(measured: &mut Measured, pairs: &[Pair<'_>]) -> (Carriers, Arcs) {
    let step_s = usual_step_s(pairs);
    let mut of_link: BTreeMap<Link, Vec<usize>> = BTreeMap::new();
    for (index, pair) in pairs.iter().enumerate().filter(|(_, pair)| pair.values.carrier_cycles.is_some()) {
        of_link.entry(pair.link).or_default().push(index);
    }
    let sign = carrier_sign(pairs, of_link.values());
    measured.carrier_sign = sign;
    let raw_m = |index: usize| -> f64 {
        let pair = &pairs[index];
        let cycles = sign.unwrap_or(1.0) * pair.values.carrier_cycles.unwrap_or(0.0) - pair.truth.carrier_cycles;
        cycles * pair.link.wavelength_m()
    };
    // Steps from epoch to epoch of each satellite's carrier; their mean without slips is the clock's.
    let mut steps: BTreeMap<usize, Vec<f64>> = BTreeMap::new();
    for indices in of_link.values() {
        for two in indices.windows(2) {
            if pairs[two[1]].label_s - pairs[two[0]].label_s <= GAP * step_s && !pairs[two[1]].values.lost_lock {
                steps.entry(pairs[two[1]].epoch).or_default().push(raw_m(two[1]) - raw_m(two[0]));
            }
        }
    }
    let mut clock_m: BTreeMap<usize, f64> = BTreeMap::new();
    let (mut level_m, mut passed_s, mut walked_m) = (0.0, 0.0, 0.0);
    let mut before: Option<f64> = None;
    for epoch in by_epoch(pairs) {
        let Some(first) = epoch.first() else { continue };
        if let Some(found) = steps.get(&first.epoch) {
            let middle = median(found).unwrap_or(0.0);
            let shortest_m = epoch.iter().map(|pair| pair.link.wavelength_m()).fold(f64::INFINITY, f64::min);
            let near = |step: &&f64| (**step - middle).abs() < 0.5 * SLIP_CYCLES * shortest_m;
            let kept: Vec<f64> = found.iter().filter(near).copied().collect();
            let step_m = mean(&kept).unwrap_or(middle);
            level_m += step_m;
            walked_m += step_m;
            passed_s += before.map_or(0.0, |label_s| first.label_s - label_s);
        }
        before = Some(first.label_s);
        clock_m.insert(first.epoch, level_m);
    }
    measured.drift_carrier = (passed_s > 0.0).then(|| walked_m / passed_s / SPEED_OF_LIGHT_MPS);
    let (mut found, mut arcs): (Carriers, Arcs) = (vec![None; pairs.len()], Vec::new());
    for (link, indices) in &of_link {
        let wavelength_m = link.wavelength_m();
        let level =
            |index: usize| (raw_m(index) - clock_m.get(&pairs[index].epoch).copied().unwrap_or(0.0)) / wavelength_m;
        let whole =
            |a: &usize, b: &usize| pairs[*b].label_s - pairs[*a].label_s <= GAP * step_s && !pairs[*b].values.lost_lock;
        let mut last: Option<f64> = None;
        for stretch in indices.chunk_by(whole) {
            let mut rest: Vec<usize> = stretch.to_vec();
            let mut declared = true;
            loop {
                let cycles: Vec<f64> = rest.iter().map(|index| level(*index)).collect();
                let jump = first_jump_of(&cycles);
                let arc: Vec<usize> = rest.drain(..jump.unwrap_or(rest.len())).collect();
                let middle = median(&cycles[..arc.len()]).unwrap_or(0.0);
                if let (Some(last), Some(first)) = (last, arc.first()) {
                    let size = (2.0 * (middle - last)).round() / 2.0;
                    measured.slips.push(Slip {
                        label_s: pairs[*first].label_s,
                        sv: link.sv.to_string(),
                        size_cycles: (!declared).then_some(size),
                        declared,
                    });
                }
                last = Some(middle);
                for index in &arc {
                    let carrier = Carrier { raw_m: raw_m(*index), cycles: level(*index) - middle };
                    found[*index] = Some(carrier);
                }
                arcs.push(arc);
                declared = false;
                if jump.is_none() {
                    break;
                }
            }
        }
    }
    measured.slips.sort_by(|a, b| a.label_s.total_cmp(&b.label_s).then_with(|| a.sv.cmp(&b.sv)));
    let residuals: Vec<f64> = found.iter().flatten().map(|carrier| carrier.cycles).collect();
    measured.carrier_rms_cycles = rms(&residuals);
    (found, arcs)
}

/// +1 where the carrier grows with range, as RINEX has it, −1 where it falls.
fn carrier_sign<'i>(pairs: &[Pair<'_>], links: impl Iterator<Item = &'i Vec<usize>>) -> Option<f64> {
    let mut product = 0.0;
    for indices in links {
        for two in indices.windows(2) {
            let [a, b] = [&pairs[two[0]], &pairs[two[1]]];
            let (Some(from), Some(to)) = (a.values.carrier_cycles, b.values.carrier_cycles) else { continue };
            product += ((to - from) * (b.truth.carrier_cycles - a.truth.carrier_cycles)).signum();
        }
    }
    (product != 0.0).then(|| product.signum())
}

/// Whether code, carrier and Doppler of the receiver tell of one clock and one motion.
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
                Some(mean_hz + turned / (b.label_s - a.label_s))
            })
            .collect();
        turns.extend(mean(&misses));
    }
    // Short arcs say too little.
    let longest = drifts.iter().map(|(_, length)| *length).max().unwrap_or(0);
    let long: Vec<f64> = drifts.iter().filter(|(_, length)| 2 * length >= longest).map(|(drift, _)| *drift).collect();
    measured.code_carrier_mps = mean_of_means(&long);
    measured.doppler_carrier_hz = mean_of_means(&turns);
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
    line_slope(&centred(points.into_iter()))
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
        .map(|(pair, carrier)| Row {
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
        })
        .collect();
    let of = |of: fn(&Row) -> Option<f64>| measured.rows.iter().filter_map(of).collect::<Vec<f64>>();
    measured.code_rms_m = rms(&of(|row| row.code_m));
    measured.doppler_rms_hz = rms(&of(|row| row.doppler_hz));
}

fn satellites(measured: &mut Measured, pairs: &[Pair<'_>], carriers: &Carriers, arcs: &Arcs) {
    let links: BTreeSet<Link> = measured.rows.iter().map(|row| row.link).collect();
    let mut codes = Vec::new();
    for link in links {
        let of = |of: fn(&Row) -> Option<f64>| -> Vec<f64> {
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
