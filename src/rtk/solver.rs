//! Baselines epoch by epoch: float solution, integers, and what is known of the ambiguities afterwards.
//!
//! The unknowns are the rover's position, one for each epoch or one for all, an ambiguity of each satellite's
//! signal, which stays until its phase slips or ends, and the ionosphere of each satellite, rover minus base,
//! as a random walk whose deviation grows with the baseline (Bock et al. 1986; Odijk 2000). Information of
//! the ambiguities adds up; the code's noise is correlated by the receivers' loops, so that epochs closer
//! than a stated time add nothing. Integers are looked for in each epoch again and never put into what is
//! known: a wrong fix does not stay. Limits: the deviation of the ionosphere is a setting; the troposphere is
//! that of one model; GLONASS by carriers of its own stays float.

use std::collections::{BTreeMap, BTreeSet};

use nalgebra::{DMatrix, DVector, Vector3};

use crate::carrier::is_divided;
use crate::integers::{Belief, Floats, Integers};
use crate::normal::{Difference, Normal, OF_POSITION};
use crate::pairs::{Pair, Track};
use crate::rows::{Row, by_codes, difference, groups, rows};
use crate::site::Site;
use crate::slips::{Change, slipped};
use gnss::earth::SPEED_OF_LIGHT_MPS;
use gnss::satellite::Sv;
use gnss::time::Epoch;

/// Settings of a baseline.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// Elevation below which satellites take no part.
    pub mask_rad: f64,
    /// Conditions of a fix.
    pub belief: Belief,
    /// True for a rover at rest: all epochs share its position.
    pub is_static: bool,
    /// Time after which the noise of codes is independent, seconds.
    pub correlation_s: f64,
    /// Deviation of the ionosphere between the receivers at the zenith on L1, relative to the baseline; zero
    /// for receivers under the same ionosphere.
    pub ionosphere: f64,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            mask_rad: 10.0_f64.to_radians(),
            belief: Belief { ratio: 3.0, success_rate: 0.999 },
            is_static: false,
            correlation_s: 1.0,
            ionosphere: 1e-6,
        }
    }
}

/// Something that happened to an ambiguity.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Event {
    /// A receiver said that its count is broken.
    Announced,
    /// The differences show a slip that no receiver announced.
    Slip,
    /// The ambiguity is not whole: half a cycle is missing.
    NotWhole,
}

impl Event {
    /// Name as tables have it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Announced => "announced_slip",
            Self::Slip => "slip",
            Self::NotWhole => "not_whole",
        }
    }
}

/// Kind of a solution.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Status {
    /// Every ambiguity is whole.
    Fixed,
    /// Some ambiguities, or whole combinations of them, are fixed.
    Partial,
    /// None is fixed.
    Float,
}

impl Status {
    /// Name as tables have it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Fixed => "fixed",
            Self::Partial => "partial",
            Self::Float => "float",
        }
    }
}

/// Solution of an epoch.
#[derive(Clone, Debug)]
pub struct Solution {
    /// Kind of the solution.
    pub status: Status,
    /// ECEF position of the rover, metres.
    pub position_m: Vector3<f64>,
    /// Covariance of the position, square metres.
    pub covariance_m2: DMatrix<f64>,
    /// ECEF position of the float solution, metres.
    pub float_m: Vector3<f64>,
    /// Satellites that take part.
    pub satellites: usize,
    /// Satellites with phases on more than one band.
    pub on_two_bands: usize,
    /// Ambiguities of the float solution.
    pub floats: Floats,
    /// Integers that were found, whether believed or not.
    pub integers: Option<Integers>,
    /// Probability that bootstrapping gives all of the true integers; `None` without double differences.
    pub success_rate: Option<f64>,
}

/// Largest formal deviation in three dimensions of a position that a part of the integers makes a fix,
/// metres.
const PRECISE_M: f64 = 0.02;

impl Solution {
    /// True if the integers give the position: all of them, or a part that leaves it two centimetres.
    pub fn is_fix(&self) -> bool {
        match self.status {
            Status::Fixed => true,
            Status::Partial => self.covariance_m2.trace() <= PRECISE_M * PRECISE_M,
            Status::Float => false,
        }
    }
}

/// Result of an epoch.
#[derive(Clone, Debug, Default)]
pub struct Solved {
    /// The solution; `None` of an epoch with too few satellites.
    pub solution: Option<Solution>,
    /// Events of the epoch.
    pub events: Vec<(Track, Event)>,
}

/// Ambiguity of a single difference.
#[derive(Clone, Debug)]
struct Ambiguity {
    track: Track,
    /// Whole number that is taken from it.
    reference: f64,
    /// True if the receivers say that half a cycle may be missing.
    is_half: bool,
}

/// Baselines in the making.
#[derive(Debug)]
pub struct Solver {
    settings: Settings,
    ambiguities: Vec<Ambiguity>,
    /// Satellites whose ionosphere is an unknown, each with its variance, square metres.
    delays: Vec<(Sv, f64)>,
    /// Information of position, ambiguities and ionosphere from epochs before.
    known: Normal,
    /// Time of the newest epoch in it.
    known_at: Option<Epoch>,
    /// Approximate position of the rover.
    rough_m: Option<Vector3<f64>>,
    /// Phases less their model of the epoch before.
    before: BTreeMap<Track, f64>,
    not_whole: BTreeSet<Track>,
    /// Tracks whose phases an epoch without a position did not have, or had broken.
    lost: BTreeSet<Track>,
}

impl Solver {
    /// Solver before any epoch.
    pub fn new(settings: Settings) -> Self {
        Self {
            settings,
            ambiguities: Vec::new(),
            delays: Vec::new(),
            known: Normal::new(OF_POSITION),
            known_at: None,
            rough_m: None,
            before: BTreeMap::new(),
            not_whole: BTreeSet::new(),
            lost: BTreeSet::new(),
        }
    }

    /// Solves an epoch, with the base at an ECEF position in metres.
    pub fn epoch(&mut self, pair: &Pair, base_m: &Vector3<f64>) -> Solved {
        let base = Site::new(*base_m);
        // At rest the first epoch's position serves for all.
        let mask_rad = self.settings.mask_rad;
        if self.rough_m.is_none() || !self.settings.is_static {
            let Some(rough_m) = by_codes(pair, &base, self.rough_m, mask_rad) else {
                self.pass(pair);
                return Solved::default();
            };
            self.rough_m = Some(rough_m);
        }
        let Some(rover) = self.rough_m.map(Site::new) else { return Solved::default() };
        let rows = rows(pair, &base, &rover, Some(mask_rad));
        let events = self.follow(&rows, (rover.position_m - base.position_m).norm());
        let mut whole = self.walked(pair.labels[1]);
        whole.add(&self.equations(&rows));
        let floats = self.floats(&whole, &rows);
        let mut solved = Solved { solution: None, events };
        if let Some((position_m, covariance_m2, floats)) = floats {
            let (integers, success_rate, not_whole) = self.integers(&floats);
            if let Some(track) = not_whole {
                self.not_whole.insert(track);
                solved.events.push((track, Event::NotWhole));
            }
            let float_m = rover.position_m + position_m;
            solved.solution = Some(solution(&rows, (float_m, covariance_m2), floats, (integers, success_rate)));
        }
        self.keep(whole, pair.labels[1]);
        solved
    }

    /// Passes over an epoch without a position, and notes the phases that it does not continue. A receiver
    /// says only once that a count is broken.
    pub fn pass(&mut self, pair: &Pair) {
        let goes_on = |track: Track| {
            let own = pair.shared.iter().find(|shared| shared.track == track);
            let is_kept = own.and_then(|shared| shared.phases).is_some_and(|phases| !phases.is_broken);
            planted!("rtk.solver.outage", is_kept, true)
        };
        self.lost.extend(self.ambiguities.iter().map(|own| own.track).filter(|track| !goes_on(*track)));
    }

    /// Ends ambiguities whose phases are gone, broken or slipped, and begins those of new phases.
    fn follow(&mut self, rows: &[Row], baseline_m: f64) -> Vec<(Track, Event)> {
        let mut events = Vec::new();
        let lost = std::mem::take(&mut self.lost);
        self.before.retain(|track, _| !lost.contains(track));
        let changes: Vec<Change> = rows
            .iter()
            .filter_map(|row| {
                let (phase_m, is_broken, _) = row.phase?;
                let change_m = phase_m - self.before.get(&row.track).filter(|_| !is_broken)?;
                Some(Change { track: row.track, change_m, direction: row.direction, wavelength_m: row.wavelength_m })
            })
            .collect();
        let slips = slipped(&changes, self.settings.is_static);
        let mut kept = Vec::new();
        for (index, own) in self.ambiguities.iter().enumerate() {
            let row = rows.iter().find(|row| row.track == own.track);
            let phase = row.and_then(|row| row.phase).filter(|_| !lost.contains(&own.track));
            let Some((_, is_broken, is_half)) = phase else { continue };
            let event = match (is_broken || is_half != own.is_half, slips.contains(&own.track)) {
                (true, _) => Some(Event::Announced),
                (false, true) => Some(Event::Slip),
                (false, false) => None,
            };
            match event {
                Some(event) => events.push((own.track, event)),
                None => kept.push(index),
            }
        }
        for (index, own) in self.ambiguities.iter().enumerate() {
            if !kept.contains(&index) {
                self.known.eliminate(OF_POSITION + index);
                self.not_whole.remove(&own.track);
            }
        }
        let first_delay = OF_POSITION + self.ambiguities.len();
        let is_seen = |sv: Sv| rows.iter().any(|row| row.track.0 == sv);
        let delays: Vec<usize> = (0..self.delays.len()).filter(|index| is_seen(self.delays[*index].0)).collect();
        let gone = (0..self.delays.len()).filter(|index| !delays.contains(index));
        gone.for_each(|index| self.known.eliminate(first_delay + index));
        let mut from: Vec<Option<usize>> = (0..OF_POSITION).map(Some).collect();
        from.extend(kept.iter().map(|index| Some(OF_POSITION + index)));
        let mut ambiguities: Vec<Ambiguity> = kept.iter().map(|index| self.ambiguities[*index].clone()).collect();
        self.before.clear();
        for row in rows {
            let Some((phase_m, _, is_half)) = row.phase else { continue };
            self.before.insert(row.track, phase_m);
            if ambiguities.iter().all(|own| own.track != row.track) {
                let reference = ((phase_m - row.code_m) / row.wavelength_m).round();
                ambiguities.push(Ambiguity { track: row.track, reference, is_half });
                from.push(None);
            }
        }
        from.extend(delays.iter().map(|index| Some(first_delay + index)));
        self.delays = delays.iter().map(|index| self.delays[*index]).collect();
        self.known = self.known.arranged(&from);
        self.ambiguities = ambiguities;
        self.begin_delays(rows, baseline_m);
        events
    }

    /// Begins the ionosphere of satellites that are new.
    fn begin_delays(&mut self, rows: &[Row], baseline_m: f64) {
        let sigma_m = self.settings.ionosphere * baseline_m;
        if sigma_m <= 0.0 {
            return;
        }
        for row in rows {
            let sv = row.track.0;
            if self.delays.iter().any(|(own, _)| *own == sv) {
                continue;
            }
            let slant_m = sigma_m * obliquity(row.elevation_rad);
            let unknown = self.known.order();
            let from: Vec<Option<usize>> = (0..unknown).map(Some).chain([None]).collect();
            self.known = self.known.arranged(&from);
            self.known.constrain(unknown, slant_m * slant_m);
            self.delays.push((sv, slant_m * slant_m));
        }
    }

    /// Information from the epochs before, as it is at a time: the ionosphere walked since.
    fn walked(&self, at: Epoch) -> Normal {
        let mut known = self.known.clone();
        let elapsed_s = self.known_at.map_or(0.0, |before| at.since(before).max(0.0));
        let first_delay = OF_POSITION + self.ambiguities.len();
        for (index, (_, variance_m2)) in self.delays.iter().enumerate() {
            known.loosen(first_delay + index, variance_m2 * elapsed_s / IONOSPHERE_S);
        }
        known
    }

    /// Unknown of a satellite's ionosphere, with what a metre of it on L1 is on a carrier; none where it is
    /// not estimated.
    fn delay(&self, row: &Row) -> Option<(usize, f64)> {
        let index = self.delays.iter().position(|(sv, _)| *sv == row.track.0)?;
        let ratio = row.wavelength_m / L1_M;
        Some((OF_POSITION + self.ambiguities.len() + index, ratio * ratio))
    }

    /// Normal equations of an epoch's codes and phases.
    fn equations(&self, rows: &[Row]) -> Normal {
        let mut normal = Normal::new(self.known.order());
        for group in groups(rows).values() {
            let of_code = |row: &&Row| {
                let mut code = difference(row, row.code_m, row.code_m2, None);
                code.derivatives.extend(self.delay(row));
                code
            };
            let codes: Vec<Difference> = group.iter().map(of_code).collect();
            normal.add_group(&codes);
            let phases: Vec<Difference> = group
                .iter()
                .filter_map(|row| {
                    let (phase_m, ..) = row.phase?;
                    let index = self.ambiguities.iter().position(|own| own.track == row.track)?;
                    let rest_m = phase_m - row.wavelength_m * self.ambiguities[index].reference;
                    let mut phase = difference(row, rest_m, row.phase_m2, Some(OF_POSITION + index));
                    phase.derivatives.extend(self.delay(row).map(|(unknown, share)| (unknown, -share)));
                    Some(phase)
                })
                .collect();
            normal.add_group(&phases);
        }
        normal
    }

    /// Correction of the position with its covariance, and the ambiguities. The highest satellite of each
    /// system and signal has the ambiguity zero.
    fn floats(&self, whole: &Normal, rows: &[Row]) -> Option<(Vector3<f64>, DMatrix<f64>, Floats)> {
        let elevation = |track: Track| rows.iter().find(|row| row.track == track).map_or(0.0, |row| row.elevation_rad);
        let tracks: Vec<(Track, f64)> = self.ambiguities.iter().map(|own| (own.track, elevation(own.track))).collect();
        let is_pivot = |index: &usize| {
            let ((sv, code), own) = tracks[*index];
            let is_of_group =
                |((other, other_code), _): &&(Track, f64)| (other.system, *other_code) == (sv.system, code);
            // Of the same height the first.
            let higher = |(at, (_, other)): (usize, &(Track, f64))| *other > own || (*other == own && at < *index);
            let mut group = tracks.iter().enumerate().filter(|(_, other)| is_of_group(other));
            !group.any(higher)
        };
        let mut unknowns: Vec<usize> = (0..OF_POSITION).collect();
        let kept: Vec<usize> = (0..tracks.len()).filter(|index| !is_pivot(index)).collect();
        unknowns.extend(kept.iter().map(|index| OF_POSITION + index));
        unknowns.extend(OF_POSITION + tracks.len()..whole.order());
        let (solution, covariance) = whole.solve(&unknowns)?;
        let mut values = DVector::zeros(tracks.len());
        let mut of_values = DMatrix::zeros(tracks.len(), tracks.len());
        let mut with_position = DMatrix::zeros(OF_POSITION, tracks.len());
        for (row, index) in kept.iter().enumerate() {
            values[*index] = solution[OF_POSITION + row];
            for (column, other) in kept.iter().enumerate() {
                of_values[(*index, *other)] = covariance[(OF_POSITION + row, OF_POSITION + column)];
            }
            for axis in 0..OF_POSITION {
                with_position[(axis, *index)] = covariance[(axis, OF_POSITION + row)];
            }
        }
        let references = self.ambiguities.iter().map(|own| own.reference).collect();
        let of_position = covariance.view((0, 0), (OF_POSITION, OF_POSITION)).into_owned();
        let floats = Floats { tracks, references, values, covariance: of_values, with_position };
        Some((solution.fixed_rows::<3>(0).into_owned(), of_position, floats))
    }

    /// The integers, the success rate of all, and a track that turned out not to be whole.
    fn integers(&self, floats: &Floats) -> (Option<Integers>, Option<f64>, Option<Track>) {
        let belief = self.settings.belief;
        let takes = |track: Track| {
            let (sv, code) = track;
            let is_half = self.ambiguities.iter().any(|own| own.track == track && own.is_half);
            !is_half && !is_divided(sv.system, code) && !self.not_whole.contains(&track)
        };
        let (found, success_rate) = floats.fix(&floats.doubles(takes), belief);
        let is_suspect = |found: &Integers| !found.is_believed && found.success_rate >= belief.success_rate;
        if found.as_ref().is_some_and(is_suspect)
            && let Some((track, without)) = floats.without_one(takes, belief)
        {
            return (Some(without), success_rate, Some(track));
        }
        (found, success_rate, None)
    }

    /// Keeps the information of an epoch, if its noise is independent of what is kept already.
    fn keep(&mut self, mut whole: Normal, at: Epoch) {
        // Labels are of tenths of a microsecond.
        let is_due = self.known_at.is_none_or(|before| at.since(before) >= self.settings.correlation_s - 1e-3);
        if !is_due {
            return;
        }
        if !self.settings.is_static {
            (0..OF_POSITION).for_each(|axis| whole.eliminate(axis));
        }
        (self.known, self.known_at) = (whole, Some(at));
    }
}

/// Length of L1's wave, metres.
const L1_M: f64 = SPEED_OF_LIGHT_MPS / 1_575.42e6;
/// Time in which the ionosphere between the receivers walks by its own deviation, seconds: that in which a
/// satellite's line of sight crosses some tens of kilometres of it.
const IONOSPHERE_S: f64 = 600.0;
/// Radius of the Earth relative to that of a shell of electrons 350 km above it.
const SHELL: f64 = 6371.0 / (6371.0 + 350.0);

/// Slant delay of a thin shell of electrons relative to that at the zenith.
fn obliquity(elevation_rad: f64) -> f64 {
    let sine = SHELL * libm::cos(elevation_rad);
    1.0 / (1.0 - sine * sine).sqrt()
}

fn solution(
    rows: &[Row],
    (float_m, covariance_m2): (Vector3<f64>, DMatrix<f64>),
    floats: Floats,
    (integers, success_rate): (Option<Integers>, Option<f64>),
) -> Solution {
    let mut bands: BTreeMap<Sv, BTreeSet<u8>> = BTreeMap::new();
    for row in rows {
        let own = bands.entry(row.track.0).or_default();
        if row.phase.is_some() {
            own.insert(row.track.1.band());
        }
    }
    let (satellites, on_two_bands) = (bands.len(), bands.values().filter(|own| own.len() > 1).count());
    let believed = integers.as_ref().filter(|found| found.is_believed);
    let status = match believed {
        Some(found) if found.is_whole() => Status::Fixed,
        Some(_) => Status::Partial,
        None => Status::Float,
    };
    let (position_m, covariance_m2) = match believed {
        Some(found) => (float_m + found.correction_m.fixed_rows::<3>(0), covariance_m2 - &found.gain_m2),
        None => (float_m, covariance_m2),
    };
    Solution { status, position_m, covariance_m2, float_m, satellites, on_two_bands, floats, integers, success_rate }
}

#[cfg(test)]
#[path = "solver_tests.rs"]
mod tests;
