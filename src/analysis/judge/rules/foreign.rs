//! A receiver that this project did not write, against what its scene allows: as far as its files show it.
//!
//! Which satellites must be observed and when fixes are due follows from the scene, for a receiver of common
//! settings ([`Receiver`]). How it makes its ranges is not known, so random errors are held against a plain
//! receiver's: early minus late power a chip apart, a code loop of two hertz, no smoothing, least squares
//! with equal weights. Limits: what a scene's effects do to a range (multipath, interference, spoofing) is
//! left to a user's limits, and such a scene's errors are not judged here.

use std::collections::{BTreeMap, BTreeSet, HashMap};

use super::availability::Came;
use super::kind::THEORY;
use super::tracking::ONE_BIT_LOSS_DB;
use crate::error::JudgeError;
use crate::expect::due::receiver::Receiver;
use crate::expect::due::{Due, Expectations, Observed};
use crate::expect::quantile::largest;
use crate::expect::theory::dll::{self, Discriminator};
use crate::judge::foreign::measured::Measured;
use crate::judge::foreign::place::{FixError, Places};
use crate::judge::foreign::{ForeignSummary, Judgement};
use crate::judge::judgement::Bound;
use crate::judge::verdict::Verdict;
use crate::read::Run;
use crate::statistics::{median, percentile};
use crate::waveform::leading;
use gnss::earth::SPEED_OF_LIGHT_MPS;
use gnss::signal::Link;
use gnss::time::Epoch;

/// Share of a file's epochs, observations and positions that may be without a truth, in percent: those before
/// its clock is set.
const UNMATCHED_PERCENT: f64 = 1.0;
/// A plain receiver's code loop: bandwidth, and early to late in chips.
const PLAIN_HZ: f64 = 2.0;
const PLAIN_CHIPS: f64 = 1.0;
/// What two models of troposphere and ionosphere may differ by on a range, one sigma: a metre at 5 degrees.
const MODEL_M: f64 = 1.0;
/// What code edges that fall between samples cost a replica of whole chips, rms.
const EDGES_M: f64 = 1.5;
/// Rule of thumb for a phase loop (Kaplan and Hegarty, 5.6): 15 degrees of jitter.
const PHASE_CYCLES: f64 = 15.0 / 360.0;

/// Truth's epochs that lie as near to a receiver's labels as those lie to each other.
struct Labels {
    /// Sample and time of the truth's rows.
    epochs: Vec<(u64, f64)>,
    reach_s: f64,
    interval_s: f64,
    of_links: BTreeMap<Link, Vec<f64>>,
}

impl Labels {
    fn new(run: &Run, measured: Option<&Measured>, places: Option<&Places>, truth_s: f64) -> Result<Self, JudgeError> {
        let mut of_links: BTreeMap<Link, Vec<f64>> = BTreeMap::new();
        for row in measured.iter().flat_map(|measured| &measured.rows) {
            of_links.entry(row.link).or_default().push(row.label_s);
        }
        let observed = measured.map(|measured| measured.clock.iter().map(|row| row.label_s).collect::<Vec<f64>>());
        let placed = places.map(|places| places.rows.iter().map(|row| row.label_s).collect::<Vec<f64>>());
        let steps = |labels: &Vec<f64>| median(&labels.windows(2).map(|two| two[1] - two[0]).collect::<Vec<f64>>());
        let slowest = [&observed, &placed].into_iter().flatten().filter_map(steps).fold(0.0, f64::max);
        let interval_s = slowest.max(truth_s);
        // Labels count from the second that is nearest to the truth's first row.
        let origin = run.trajectory.first().map(|row| Epoch::new(row.gps_s, row.gps_fraction_s.round()));
        let since_s = |time: Epoch| origin.map_or(0.0, |origin| time.since(origin));
        let epochs = run.trajectory.map(|row| (row.sample, since_s(row.time())))?;
        Ok(Self { epochs, reach_s: 0.5 * interval_s + 1e-3, interval_s, of_links })
    }

    fn near(&self, labels: &[f64]) -> Vec<u64> {
        let is_near = |t_s: f64| {
            let next = labels.partition_point(|label_s| *label_s < t_s - self.reach_s);
            labels.get(next).is_some_and(|label_s| *label_s <= t_s + self.reach_s)
        };
        let near = self.epochs.iter().filter(|(_, t_s)| is_near(*t_s)).map(|(sample, _)| *sample);
        let mut samples: Vec<u64> = near.collect();
        samples.sort_unstable();
        samples
    }

    /// The truth's first epoch from a label on.
    fn sample_at(&self, label_s: f64) -> Option<u64> {
        self.epochs.iter().find(|(_, t_s)| *t_s >= label_s - 1e-3).map(|(sample, _)| *sample)
    }
}

impl Observed for Labels {
    fn samples(&self, link: Link) -> Result<Vec<u64>, JudgeError> {
        Ok(self.of_links.get(&link).map(|labels| self.near(labels)).unwrap_or_default())
    }
}

impl Verdict {
    /// A foreign receiver's files against the scene that it was fed with.
    ///
    /// # Errors
    /// [`JudgeError::Read`] where spilled rows cannot be read.
    pub fn of_foreign(found: &Judgement) -> Result<Self, JudgeError> {
        let (run, judged, summary) = (&found.run, &found.judged, &found.summary);
        let (measured, places) = (judged.observables.as_ref(), judged.places.as_ref());
        let labels = Labels::new(run, measured, places, judged.truth_interval_s)?;
        let mut receiver = Receiver::of(run);
        receiver.interval_s = labels.interval_s;
        let mut expected = Expectations::of(run, receiver, &labels)?;
        let mut verdict = Self::default();
        if let Some(measured) = measured {
            verdict.observations(measured, summary);
            let signals: BTreeSet<&str> = labels.of_links.keys().map(|link| link.signal.name).collect();
            let others: BTreeSet<&str> = expected.satellites.keys().map(|link| link.signal.name).collect();
            for name in others.difference(&signals) {
                verdict.not_judged.push(format!("{name}: the receiver observes none of it"));
            }
            expected.satellites.retain(|link, _| signals.contains(link.signal.name));
            verdict.observed(&expected, |link, _| {
                let seen = labels.of_links.contains_key(link);
                if seen { "lost, or late" } else { "never observed" }.to_owned()
            });
            verdict.observables(run, measured, summary, &expected);
        }
        if let Some(places) = places {
            verdict.positions(run, places, judged.labels_late_s);
            let fixes: Vec<f64> = places.rows.iter().map(|row| row.label_s).collect();
            let first = fixes.iter().copied().reduce(f64::min).and_then(|label_s| labels.sample_at(label_s));
            let came = Came { samples: labels.near(&fixes), first_s: first.map(|sample| run.time_s(sample)) };
            verdict.availability(run.scene.duration_s, &run.scene.expect, &expected, &came);
            verdict.places(run, places, &labels, &expected);
            let timed =
                places.rows.iter().filter_map(|row| Some((run.time_s(labels.sample_at(row.label_s)?), row.length_m())));
            verdict.within(&run.scene.expect, timed);
        }
        Ok(verdict)
    }

    /// Whether the file is of this scene, and its signals the ones that it names.
    fn observations(&mut self, measured: &Measured, summary: &ForeignSummary) {
        let percent = |without: usize, of: usize| 100.0 * without as f64 / of.max(1) as f64;
        let source = "the scene's truth has every epoch of its samples, and every satellite in view";
        let bound = Bound::Max(UNMATCHED_PERCENT);
        let epochs = percent(measured.epochs - measured.joined, measured.epochs);
        self.judge("epochs of observations without a truth", "", epochs, "%", bound.clone(), source);
        let observations = percent(measured.unmatched, measured.observations);
        self.judge("observations without a truth", "", observations, "%", bound, source);
        let source = "the other pseudoranges of their epochs";
        let path = "join.observations_outliers";
        self.judge("pseudoranges of another signal", path, measured.outliers, "", Bound::Max(0.0), source);
        let weeks = summary.join.observations_week_offset.abs() + summary.join.positions_week_offset.abs();
        self.judge("weeks by which dates are off", "", weeks, "", Bound::Max(0.0), "the scene's dates");
    }

    /// Code, carrier, Doppler and C/N0.
    fn observables(&mut self, run: &Run, measured: &Measured, summary: &ForeignSummary, expected: &Expectations) {
        let rinex = "RINEX 3.05, 5.2: carriers grow with range, Doppler is positive for an approaching satellite";
        if let Some(sign) = summary.carrier.sign {
            self.judge("sign of the carrier", "carrier.sign", sign, "", Bound::Equals(1.0.into()), rinex);
        }
        if summary.doppler.scale.is_some() {
            self.judge("sign of Doppler", "", measured.doppler_sign(), "", Bound::Equals(1.0.into()), rinex);
        }
        let undeclared = summary.carrier.slips_undeclared;
        let path = "carrier.slips_undeclared";
        self.judge("undeclared breaks of carriers", path, undeclared, "", Bound::Max(0.0), "the file's own indicator");
        if let Some(reason) = disturbed(run) {
            self.not_judged.push(format!("sizes of errors: the scene has {reason}"));
            return;
        }
        if let Some(bias_db) = summary.cn0.bias_db.filter(|_| run.scene.noise) {
            let source = "loss of a one-bit quantiser, 10 lg(π/2): more is unexplained";
            self.judge("C/N0 bias, magnitude", "", bias_db.abs(), "dB", Bound::Max(ONE_BIT_LOSS_DB), source);
        }
        if let Some(rms) = summary.carrier.rms_cycles {
            let source = "rule of thumb for a phase loop, 15 degrees";
            self.judge("carrier, rms", "carrier.rms_cycles", rms, "cycles", Bound::Max(PHASE_CYCLES), source);
        }
        let known = |name: &str, signal: &str| {
            let is = |link: &&Link| link.signal.name == signal && link.sv.to_string() == name;
            let (link, one) = expected.satellites.iter().find(|(link, _)| is(link))?;
            plain_m(link, one.usual_dbhz)
        };
        let ratios = measured.satellites.iter().filter_map(|row| {
            let (sigma_m, plain_m) = (row.code_sigma_m?, known(&row.sv, row.signal)?);
            // A deviation of few values scatters.
            Some((sigma_m / libm::hypot(plain_m, EDGES_M), &row.sv)).filter(|_| row.epochs >= ENOUGH)
        });
        if let Some((ratio, sv)) = ratios.max_by(|a, b| a.0.total_cmp(&b.0)) {
            let source = "a plain receiver's loop (2 Hz, early and late a chip apart) at the scene's C/N0, and code \
                          edges between samples (1.5 m)";
            self.judge("pseudorange sigma over a plain receiver's, largest", "", ratio, "", Bound::Max(THEORY), source);
            self.explain(vec![sv.clone()]);
        }
    }

    fn positions(&mut self, run: &Run, places: &Places, labels_late_s: Option<i64>) {
        let percent = 100.0 * (places.fixes - places.rows.len()) as f64 / places.fixes.max(1) as f64;
        let source = format!("the scene's truth has every second of its {} s", run.scene.duration_s);
        self.judge("positions without a truth", "", percent, "%", Bound::Max(UNMATCHED_PERCENT), &source);
        if let Some(late_s) = labels_late_s {
            self.explain(vec![format!("labels are {late_s} s late: GPS time in place of UTC")]);
        }
    }

    /// Errors of positions against those of a plain receiver's least squares.
    fn places(&mut self, run: &Run, places: &Places, labels: &Labels, expected: &Expectations) {
        if let Some(reason) = disturbed(run) {
            self.not_judged.push(format!("errors of positions: the scene has {reason}"));
            return;
        }
        let dues: HashMap<u64, &Due> = expected.epochs.iter().map(|due| (due.sample, due)).collect();
        let plain = expected.satellites.iter().filter_map(|(link, one)| plain_m(link, one.usual_dbhz));
        let Some(plain_m) = median(&plain.collect::<Vec<f64>>()) else { return };
        let range_m = libm::hypot(libm::hypot(plain_m, EDGES_M), MODEL_M);
        // Errors along their longest axis; where the scene has no dilution nothing is due.
        let limited = |row: &FixError| {
            let sample = labels.sample_at(row.label_s)?;
            let bounded = run.scene.expect.bounded_since(run.time_s(sample), 0.0);
            let pdop = dues.get(&sample).map(|due| due.pdop()).filter(|pdop| bounded && *pdop <= MOST_PDOP)?;
            Some(THEORY * pdop * range_m)
        };
        let rows = places.rows.iter().filter_map(|row| limited(row).map(|sigma_m| (row, sigma_m)));
        let rows: Vec<(&FixError, f64)> = rows.collect();
        let all: Vec<f64> = rows.iter().map(|(row, _)| row.length_m()).collect();
        let limits: Vec<f64> = rows.iter().map(|(_, sigma_m)| largest(3, 20) * sigma_m).collect();
        let (Some(value), Some(limit)) = (percentile(&all, 0.95), percentile(&limits, 0.95)) else {
            self.not_judged.push("errors of positions: none where satellites are placed well".to_owned());
            return;
        };
        let source = format!(
            "a plain receiver's ranges ({range_m:.1} m: loop noise, code edges, a metre between models) and the \
             dilution of the satellites that must be used"
        );
        self.judge("position error, 95 %", "position.error_3d_p95_m", value, "m", Bound::Max(limit), &source);
        let factor = largest(3, rows.len());
        let over = |row: &FixError, sigma_m: f64| row.length_m() / (factor * sigma_m);
        let worst = rows.iter().max_by(|a, b| over(a.0, a.1).total_cmp(&over(b.0, b.1)));
        if let Some((row, sigma_m)) = worst {
            let source = format!("{source}; at {:.1} s, nearest to its limit or farthest beyond", row.label_s);
            self.judge("position error, largest", "", row.length_m(), "m", Bound::Max(factor * sigma_m), &source);
        }
    }
}

/// Epochs of a satellite from which on its deviation says something.
const ENOUGH: usize = 20;
/// Dilution up to which positions are judged.
const MOST_PDOP: f64 = 10.0;

/// Jitter of a plain receiver's pseudorange.
fn plain_m(link: &Link, cn0_dbhz: f64) -> Option<f64> {
    let component = leading(link.signal)?;
    let cn0_hz = component.power_share * libm::pow(10.0, 0.1 * cn0_dbhz);
    let sigma = dll::jitter_chips(Discriminator::EarlyMinusLate, PLAIN_CHIPS, PLAIN_HZ, component.period_s(), cn0_hz);
    Some(sigma * SPEED_OF_LIGHT_MPS / component.chip_rate_hz)
}

/// What keeps a scene's errors from being those of noise.
fn disturbed(run: &Run) -> Option<&'static str> {
    let facts = &run.scene;
    [
        (!facts.interference.is_empty(), "interference"),
        (!run.claimed.is_empty(), "a spoofer"),
        (run.rays.keys().next().is_some(), "multipath"),
        (!facts.satellite_faults.is_empty(), "faults of satellites"),
    ]
    .into_iter()
    .find_map(|(is, what)| is.then_some(what))
}
