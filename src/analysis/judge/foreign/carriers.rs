//! Carriers of a foreign receiver: their errors without clock and constants, and the breaks of their count.

use std::collections::{BTreeMap, BTreeSet};

use super::measured::{Measured, Slip};
use super::pairs::{BySignal, Pair, by_epoch};
use crate::measure::errors::{SLIP_CYCLES, first_jump_of};
use crate::statistics::{mean, median, rms};
use gnss::earth::SPEED_OF_LIGHT_MPS;
use gnss::signal::{Link, Signal};

/// Gaps longer than this many intervals break an arc.
const GAP: f64 = 1.5;
/// Satellites of a signal whose steps give its clock: with fewer one slip would move it.
const ENOUGH: usize = 3;
/// A step of the clock between two epochs that is no drift: a tenth of a millisecond, of clocks that are set
/// by whole ones.
const JUMP_M: f64 = 1e-4 * SPEED_OF_LIGHT_MPS;

/// A carrier error.
#[derive(Clone, Copy, Debug)]
pub(super) struct Carrier {
    /// Error in metres, with the receiver's clock.
    pub raw_m: f64,
    /// Error in cycles, without the clock and the arc's constant.
    pub cycles: f64,
}

pub(super) type Carriers = Vec<Option<Carrier>>;
/// Indices into the pairs, an arc each.
pub(super) type Arcs = Vec<Vec<usize>>;

/// Usual distance of epochs.
pub(super) fn usual_step_s(pairs: &[Pair<'_>]) -> f64 {
    let labels: Vec<f64> = by_epoch(pairs).filter_map(|epoch| Some(epoch.first()?.label_s)).collect();
    median(&labels.windows(2).map(|pair| pair[1] - pair[0]).collect::<Vec<_>>()).unwrap_or(1.0)
}

/// Carrier errors without clock and constants, breaks found. A link's arcs follow one another in `Arcs`.
pub(super) fn carriers(measured: &mut Measured, pairs: &[Pair<'_>]) -> (Carriers, Arcs) {
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
    let mut steps: BTreeMap<(usize, &'static Signal), Vec<f64>> = BTreeMap::new();
    for indices in of_link.values() {
        for two in indices.windows(2) {
            let to = &pairs[two[1]];
            if to.label_s - pairs[two[0]].label_s <= GAP * step_s && !to.values.lost_lock {
                steps.entry(to.group()).or_default().push(raw_m(two[1]) - raw_m(two[0]));
            }
        }
    }
    let mut clock_m = BySignal::new();
    let (mut walked_m, mut passed_s) = (0.0, 0.0);
    let signals: BTreeSet<&'static Signal> = of_link.keys().map(|link| link.signal).collect();
    for signal in &signals {
        let shortest_m = of_link.keys().map(|link| link.wavelength_m()).fold(f64::INFINITY, f64::min);
        let (mut level_m, mut before): (f64, Option<f64>) = (0.0, None);
        for epoch in by_epoch(pairs) {
            let Some(first) = epoch.first() else { continue };
            let own = steps.get(&(first.epoch, *signal)).filter(|own| own.len() >= ENOUGH);
            // Few satellites of a signal have the clock of all.
            let all = || -> Vec<f64> {
                signals.iter().filter_map(|other| steps.get(&(first.epoch, *other))).flatten().copied().collect()
            };
            let steps_m = own.cloned().unwrap_or_else(all);
            if let Some(middle) = median(&steps_m) {
                let near = |step: &&f64| (**step - middle).abs() < 0.5 * SLIP_CYCLES * shortest_m;
                let kept: Vec<f64> = steps_m.iter().filter(near).copied().collect();
                let step_m = mean(&kept).unwrap_or(middle);
                level_m += step_m;
                // A clock that jumps drifts no more for it.
                if step_m.abs() < JUMP_M {
                    walked_m += step_m;
                    passed_s += before.map_or(0.0, |label_s| first.label_s - label_s);
                }
            }
            before = Some(first.label_s);
            clock_m.insert((first.epoch, *signal), level_m);
        }
    }
    measured.drift_carrier = (passed_s > 0.0).then(|| walked_m / passed_s / SPEED_OF_LIGHT_MPS);
    let (mut found, mut arcs): (Carriers, Arcs) = (vec![None; pairs.len()], Vec::new());
    for (link, indices) in &of_link {
        let wavelength_m = link.wavelength_m();
        let level =
            |index: usize| (raw_m(index) - clock_m.get(&pairs[index].group()).copied().unwrap_or(0.0)) / wavelength_m;
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
                        link: *link,
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
    let mut steps: BTreeMap<(usize, &'static Signal), Vec<(f64, f64)>> = BTreeMap::new();
    for indices in links {
        for two in indices.windows(2) {
            let [a, b] = [&pairs[two[0]], &pairs[two[1]]];
            let (Some(from), Some(to)) = (a.values.carrier_cycles, b.values.carrier_cycles) else { continue };
            steps.entry(b.group()).or_default().push((to - from, b.truth.carrier_cycles - a.truth.carrier_cycles));
        }
    }
    // What all satellites of an epoch have in common is the clock's; of a single one it is all that there is.
    let product = |with_clock: bool| -> f64 {
        let of = |steps: &Vec<(f64, f64)>| {
            let middle = |of: fn(&(f64, f64)) -> f64| {
                if with_clock { 0.0 } else { median(&steps.iter().map(of).collect::<Vec<_>>()).unwrap_or(0.0) }
            };
            let (found, truth) = (middle(|step| step.0), middle(|step| step.1));
            // The size of the truth's step weighs; that of a slip does not.
            steps.iter().map(|step| (step.0 - found).signum() * (step.1 - truth)).sum::<f64>()
        };
        steps.values().map(of).sum()
    };
    let found = Some(product(false)).filter(|product| *product != 0.0).unwrap_or_else(|| product(true));
    (found != 0.0).then(|| found.signum())
}
