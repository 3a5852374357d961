//! Judgement of a baseline by the truth: its error, its integers, and how long it took to fix them.
//!
//! A fix is wrong if one of its integers is not that of the truth, however small the error of the position.
//! So many wrong ones are allowed as the stated success rates leave: bootstrapping is a lower bound for least
//! squares, so that the expected number is at most the sum of what they miss.

use nalgebra::Vector3;
use serde::Serialize;

use crate::pairs::{Pair, Track};
use crate::site::Site;
use crate::solver::{Event, Solution, Solved, Status};
use crate::truth::Truth;
use gnss::time::Epoch;

/// Integers of an epoch against those of the truth.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Verified {
    /// Fixed numbers that are those of the truth.
    pub right: usize,
    /// Fixed numbers that are not.
    pub wrong: usize,
    /// Double differences, or combinations of them, that are not fixed.
    pub not_fixed: usize,
}

/// One epoch of a baseline: a row of `baseline.csv`.
#[derive(Clone, Debug, Serialize)]
pub struct Row {
    /// GPS time by the rover's clock.
    pub time: String,
    /// Kind of the solution: fixed, partial, float, or none.
    pub status: &'static str,
    /// Baseline from base to rover in the base's local directions, metres.
    pub east_m: Option<f64>,
    /// North component.
    pub north_m: Option<f64>,
    /// Up component.
    pub up_m: Option<f64>,
    /// Formal standard deviations of the three.
    pub sigma_east_m: Option<f64>,
    /// Deviation of the north component.
    pub sigma_north_m: Option<f64>,
    /// Deviation of the up component.
    pub sigma_up_m: Option<f64>,
    /// Baseline less that of the truth, metres.
    pub error_east_m: Option<f64>,
    /// Error of the north component.
    pub error_north_m: Option<f64>,
    /// Error of the up component.
    pub error_up_m: Option<f64>,
    /// Satellites that take part.
    pub satellites: usize,
    /// Satellites with phases on more than one band.
    pub two_bands: usize,
    /// Squared norm of the second best integers relative to the best.
    pub ratio: Option<f64>,
    /// Success rate of bootstrapping of the numbers that were searched for.
    pub success_rate: Option<f64>,
    /// Success rate of bootstrapping of all numbers.
    pub whole_success_rate: Option<f64>,
    /// Fixed numbers that are those of the truth.
    pub right: Option<usize>,
    /// Fixed numbers that are not.
    pub wrong: Option<usize>,
    /// Numbers that are not fixed.
    pub not_fixed: Option<usize>,
    /// Events of the epoch.
    pub events: String,
}

/// Figures of a baseline.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Figures {
    /// Common epochs.
    pub epochs: usize,
    /// Epochs with a solution.
    pub solved: usize,
    /// Epochs with all ambiguities fixed.
    pub fixed: usize,
    /// Epochs with some of them fixed.
    pub partial: usize,
    /// Epochs with none fixed.
    pub float: usize,
    /// Mean length of the baseline, metres.
    pub length_m: Option<f64>,
    /// Share of the solved epochs from the first fix on that are fixed, without those between an outage and
    /// the next fix. A part of the integers is a fix if it gives a precise position ([`Solution::is_fix`]).
    pub fix_rate: Option<f64>,
    /// Time from the first solution to the first fix, seconds.
    pub first_fix_s: Option<f64>,
    /// Epochs with five satellites on two bands.
    pub on_two_bands: usize,
    /// Time to it from the first epoch with five satellites on two bands, seconds.
    pub first_fix_two_bands_s: Option<f64>,
    /// Epochs in which the success rate of all integers is the one that a fix asks for.
    pub allowed: usize,
    /// Epochs of those that are a fix.
    pub allowed_fixed: usize,
    /// Time from the first epoch with five satellites on two bands to the first of those, seconds.
    pub first_allowed_two_bands_s: Option<f64>,
    /// Largest success rate of all integers.
    pub most_success_rate: Option<f64>,
    /// Outages after the first fix: epochs without a solution, or a second and more without an epoch.
    pub outages: usize,
    /// Outages after which no fix came.
    pub outages_without_fix: usize,
    /// Longest time from the first solution after an outage to the next fix, seconds.
    pub longest_refix_s: Option<f64>,
    /// Root mean square of the fixed epochs' errors, metres.
    pub east_rms_m: Option<f64>,
    /// Root mean square of the north component.
    pub north_rms_m: Option<f64>,
    /// Root mean square of the up component.
    pub up_rms_m: Option<f64>,
    /// Root mean square of the horizontal error of one component: of east and north together.
    pub horizontal_rms_m: Option<f64>,
    /// Root mean square of the float epochs' errors in three dimensions.
    pub float_rms_m: Option<f64>,
    /// Epochs whose integers are judged.
    pub judged: usize,
    /// Fixed epochs with a wrong integer.
    pub wrong_fixes: usize,
    /// Wrong fixes that the stated success rates let expect at most.
    pub expected_wrong: f64,
    /// Fixed numbers that are right, over all epochs.
    pub integers_right: usize,
    /// Fixed numbers that are wrong.
    pub integers_wrong: usize,
    /// Numbers that are not fixed.
    pub integers_not_fixed: usize,
    /// Least ratio of the fixed epochs.
    pub least_ratio: Option<f64>,
    /// Slips that a receiver announced.
    pub announced_slips: usize,
    /// Slips that no receiver announced.
    pub slips: usize,
    /// Ambiguities that are not whole: satellites with signals.
    pub not_whole: Vec<String>,
    /// Distance of the base's stated position from the true one, metres.
    pub base_off_m: Option<f64>,
}

/// Satellites on two bands with which a first epoch is to be fixed at once.
pub const ON_TWO_BANDS: usize = 5;
/// Least time in seconds without an epoch that is an outage; of receivers with longer intervals two of them.
const OUTAGE_S: f64 = 1.0;

/// Collects the epochs of a baseline.
#[derive(Debug, Default)]
pub struct Judge {
    /// Success rate that a fix asks for.
    asked: f64,
    /// Figures so far.
    pub figures: Figures,
    first: Option<Epoch>,
    first_on_two: Option<Epoch>,
    fixed_from_here: [usize; 2],
    outage: Outage,
    fixed_errors: Errors,
    float_errors: Errors,
    lengths_m: f64,
}

/// Outage after which no fix has come yet, and what tells the next one.
#[derive(Debug, Default)]
struct Outage {
    is_open: bool,
    /// First solution after it.
    solved: Option<Epoch>,
    /// Epoch before.
    before: Option<Epoch>,
    /// Shortest time between epochs, seconds.
    interval_s: Option<f64>,
}

impl Outage {
    /// Takes an epoch; true if an outage begins with it.
    fn begins(&mut self, at: Epoch, is_solved: bool, is_after_fix: bool) -> bool {
        let step_s = self.before.replace(at).map(|before| at.since(before));
        let usual_s = self.interval_s.unwrap_or(f64::INFINITY);
        let is_gap = step_s.is_some_and(|step_s| step_s > OUTAGE_S.max(2.0 * usual_s));
        self.interval_s = step_s.map(|step_s| step_s.min(usual_s)).or(self.interval_s);
        if is_solved && !is_gap || !is_after_fix {
            if self.is_open {
                self.solved.get_or_insert(at);
            }
            return false;
        }
        // What is solved in between is lost again.
        self.solved = is_solved.then_some(at);
        !std::mem::replace(&mut self.is_open, true)
    }

    /// Time in seconds from the first solution after the outage to a fix that ends it.
    fn ends(&mut self, at: Epoch) -> Option<f64> {
        let is_open = std::mem::replace(&mut self.is_open, false);
        self.solved.take().filter(|_| is_open).map(|solved| at.since(solved))
    }
}

/// Sums of squared errors.
#[derive(Debug, Default)]
struct Errors {
    sums_m2: Vector3<f64>,
    count: usize,
}

impl Errors {
    fn add(&mut self, error_m: &Vector3<f64>) {
        self.sums_m2 += error_m.component_mul(error_m);
        self.count += 1;
    }

    fn rms_m(&self) -> Option<Vector3<f64>> {
        (self.count > 0).then(|| (self.sums_m2 / self.count as f64).map(f64::sqrt))
    }
}

/// Truths of base and rover, if the runs have them.
pub type Truths<'a> = Option<[&'a Truth; 2]>;

impl Judge {
    /// Judge of a baseline whose fixes ask for that success rate.
    pub fn new(asked: f64) -> Self {
        Self { asked, ..Self::default() }
    }

    /// Takes an epoch, and returns its row.
    pub fn take(&mut self, pair: &Pair, base_m: &Vector3<f64>, solved: &Solved, truths: Truths<'_>) -> Row {
        let figures = &mut self.figures;
        figures.epochs += 1;
        for (track, event) in &solved.events {
            match event {
                Event::Announced => figures.announced_slips += 1,
                Event::Slip => figures.slips += 1,
                Event::NotWhole => figures.not_whole.push(named(*track)),
            }
        }
        let events: Vec<String> =
            solved.events.iter().map(|(track, event)| format!("{} {}", named(*track), event.name())).collect();
        let (is_solved, is_after_fix) = (solved.solution.is_some(), figures.first_fix_s.is_some());
        figures.outages += usize::from(self.outage.begins(pair.labels[1], is_solved, is_after_fix));
        let mut row = Row::empty(pair, events.join("; "));
        let Some(solution) = &solved.solution else { return row };
        self.first.get_or_insert(pair.labels[1]);
        if solution.on_two_bands >= ON_TWO_BANDS {
            figures.on_two_bands += 1;
            self.first_on_two.get_or_insert(pair.labels[1]);
        }
        let base = Site::new(*base_m);
        let baseline_m = solution.position_m - base_m;
        row.fill(solution, &(base.axes * baseline_m), &base);
        let error_m = truths.and_then(|[of_base, of_rover]| {
            let true_m = of_rover.position_m(pair.labels[1])? - of_base.position_m(pair.labels[0])?;
            Some(base.axes * (baseline_m - true_m))
        });
        if let Some(error_m) = &error_m {
            row.set_error(error_m);
        }
        self.count(pair, solution, error_m, baseline_m.norm());
        if let Some(verified) = truths.and_then(|truths| verify(pair, solution, truths)) {
            self.count_integers(solution, verified);
            (row.right, row.wrong) = (Some(verified.right), Some(verified.wrong));
            row.not_fixed = Some(verified.not_fixed);
        }
        row
    }

    fn count(&mut self, pair: &Pair, solution: &Solution, error_m: Option<Vector3<f64>>, length_m: f64) {
        let figures = &mut self.figures;
        figures.solved += 1;
        self.lengths_m += length_m;
        let is_fixed = solution.is_fix();
        match solution.status {
            Status::Fixed => figures.fixed += 1,
            Status::Partial => figures.partial += 1,
            Status::Float => figures.float += 1,
        }
        if let Some(rate) = solution.success_rate {
            figures.most_success_rate = Some(figures.most_success_rate.map_or(rate, |most| most.max(rate)));
            if rate >= self.asked {
                figures.allowed += 1;
                figures.allowed_fixed += usize::from(is_fixed);
                if figures.first_allowed_two_bands_s.is_none() {
                    figures.first_allowed_two_bands_s = self.first_on_two.map(|first| pair.labels[1].since(first));
                }
            }
        }
        if is_fixed && figures.first_fix_s.is_none() {
            figures.first_fix_s = self.first.map(|first| pair.labels[1].since(first));
        }
        if is_fixed && figures.first_fix_two_bands_s.is_none() {
            figures.first_fix_two_bands_s = self.first_on_two.map(|first| pair.labels[1].since(first));
        }
        if is_fixed && let Some(refix_s) = self.outage.ends(pair.labels[1]) {
            figures.longest_refix_s = Some(figures.longest_refix_s.map_or(refix_s, |most_s| most_s.max(refix_s)));
        }
        if figures.first_fix_s.is_some() && !self.outage.is_open {
            self.fixed_from_here[0] += usize::from(is_fixed);
            self.fixed_from_here[1] += 1;
        }
        if let Some(error_m) = &error_m {
            if is_fixed { self.fixed_errors.add(error_m) } else { self.float_errors.add(error_m) }
        }
        let ratio = solution.integers.as_ref().filter(|found| found.is_believed).map(|found| found.ratio);
        figures.least_ratio = match (figures.least_ratio, ratio) {
            (Some(least), Some(ratio)) => Some(least.min(ratio)),
            (least, ratio) => least.or(ratio),
        };
    }

    fn count_integers(&mut self, solution: &Solution, verified: Verified) {
        let figures = &mut self.figures;
        figures.integers_right += verified.right;
        figures.integers_wrong += verified.wrong;
        figures.integers_not_fixed += verified.not_fixed;
        if let Some(found) = solution.integers.as_ref().filter(|found| found.is_believed) {
            figures.judged += 1;
            figures.wrong_fixes += usize::from(verified.wrong > 0);
            figures.expected_wrong += 1.0 - found.success_rate;
        }
    }

    /// Figures of all epochs.
    pub fn finish(mut self) -> Figures {
        let figures = &mut self.figures;
        figures.outages_without_fix = usize::from(self.outage.is_open);
        let [fixed, all] = self.fixed_from_here;
        figures.fix_rate = (all > 0).then(|| fixed as f64 / all as f64);
        figures.length_m = (figures.solved > 0).then(|| self.lengths_m / figures.solved as f64);
        if let Some(rms_m) = self.fixed_errors.rms_m() {
            (figures.east_rms_m, figures.north_rms_m) = (Some(rms_m.x), Some(rms_m.y));
            figures.up_rms_m = Some(rms_m.z);
            figures.horizontal_rms_m = Some(libm::hypot(rms_m.x, rms_m.y));
        }
        figures.float_rms_m = self.float_errors.rms_m().map(|rms_m| rms_m.norm());
        figures.not_whole.sort();
        figures.not_whole.dedup();
        self.figures
    }
}

/// Name of a track, such as `G05 1C`.
fn named((sv, code): Track) -> String {
    format!("{sv} {code}")
}

/// Fixed numbers against those of the truth; `None` if the truth lacks one of the tracks.
fn verify(pair: &Pair, solution: &Solution, [of_base, of_rover]: [&Truth; 2]) -> Option<Verified> {
    let floats = &solution.floats;
    let Some(found) = &solution.integers else {
        let not_fixed = floats.doubles(|_| true).pairs.len();
        return Some(Verified { not_fixed, ..Verified::default() });
    };
    let count = found.doubles.pairs.len();
    if !found.is_believed {
        return Some(Verified { not_fixed: count, ..Verified::default() });
    }
    // Whole number of a single difference, with what all tracks of the signal share.
    let single = |index: usize| {
        let (track, _) = floats.tracks[index];
        let shared = pair.shared.iter().find(|shared| shared.track == track)?;
        let [base_m, rover_m] = shared.phases?.phase_m;
        let of_base_cycles = of_base.carrier_cycles(pair.labels[0], track)?;
        let base_cycles = base_m / shared.wavelength_m - planted!("rtk.judge.base", of_base_cycles, 0.0);
        let rover_cycles = rover_m / shared.wavelength_m - of_rover.carrier_cycles(pair.labels[1], track)?;
        Some(rover_cycles - base_cycles - floats.references[index])
    };
    let doubles: Option<Vec<f64>> =
        found.doubles.pairs.iter().map(|(own, pivot)| Some((single(*own)? - single(*pivot)?).round())).collect();
    let expected = &found.rows * nalgebra::DVector::from_vec(doubles?);
    let right = found.fixed.iter().zip(expected.iter()).filter(|(fixed, expected)| fixed == expected).count();
    let fixed = found.fixed.len();
    Some(Verified { right, wrong: fixed - right, not_fixed: count - fixed })
}

impl Row {
    fn empty(pair: &Pair, events: String) -> Self {
        Self {
            time: pair.labels[1].to_string(),
            status: "none",
            east_m: None,
            north_m: None,
            up_m: None,
            sigma_east_m: None,
            sigma_north_m: None,
            sigma_up_m: None,
            error_east_m: None,
            error_north_m: None,
            error_up_m: None,
            satellites: 0,
            two_bands: 0,
            ratio: None,
            success_rate: None,
            whole_success_rate: None,
            right: None,
            wrong: None,
            not_fixed: None,
            events,
        }
    }

    fn fill(&mut self, solution: &Solution, baseline_m: &Vector3<f64>, base: &Site) {
        self.status = solution.status.name();
        (self.east_m, self.north_m, self.up_m) = (Some(baseline_m.x), Some(baseline_m.y), Some(baseline_m.z));
        let local = base.axes * solution.covariance_m2.fixed_view::<3, 3>(0, 0) * base.axes.transpose();
        let sigma = |axis: usize| Some(local[(axis, axis)].max(0.0).sqrt());
        (self.sigma_east_m, self.sigma_north_m, self.sigma_up_m) = (sigma(0), sigma(1), sigma(2));
        (self.satellites, self.two_bands) = (solution.satellites, solution.on_two_bands);
        self.ratio = solution.integers.as_ref().map(|found| found.ratio).filter(|ratio| ratio.is_finite());
        self.success_rate = solution.integers.as_ref().map(|found| found.success_rate);
        self.whole_success_rate = solution.success_rate;
    }

    fn set_error(&mut self, error_m: &Vector3<f64>) {
        (self.error_east_m, self.error_north_m) = (Some(error_m.x), Some(error_m.y));
        self.error_up_m = Some(error_m.z);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_outage_lasts_from_what_is_not_solved_to_the_next_fix() {
        let at = |tenths: u32| Epoch::new(1_290_689_460, 0.0).plus_s(0.1 * f64::from(tenths));
        let mut outage = Outage::default();
        // Before the first fix nothing is out.
        assert!((0..10).all(|tenths| !outage.begins(at(tenths), tenths % 3 == 0, false)));
        assert!((10..20).all(|tenths| !outage.begins(at(tenths), true, true)) && outage.ends(at(19)).is_none());
        // Ten epochs without, of which one has a solution in between: one outage.
        let begun = (20..30).filter(|tenths| outage.begins(at(*tenths), *tenths == 25, true)).count();
        assert_eq!((begun, outage.is_open), (1, true));
        assert!(!outage.begins(at(30), true, true) && !outage.begins(at(31), true, true));
        let refix_s = outage.ends(at(32)).unwrap();
        assert!((refix_s - 0.2).abs() < 1e-6 && !outage.is_open, "{refix_s}");
        // No epoch for half a second is none, for two seconds is one.
        assert!(!outage.begins(at(37), true, true));
        assert!(outage.begins(at(57), true, true));
        assert_eq!(outage.ends(at(57)), Some(0.0));
        // Epochs of half a minute are no outages.
        let mut slow = Outage::default();
        assert!((0..9).all(|epoch| !slow.begins(at(300 * epoch), true, epoch > 0)));
    }
}
