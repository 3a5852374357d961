//! Baselines epoch by epoch: float solution, integers, and what is known of the ambiguities afterwards.
//!
//! The unknowns are the rover's position, one for each epoch or one for all, and an ambiguity of each
//! satellite's signal, which stays until its phase slips or ends. Information of the ambiguities adds up; the
//! code's noise is correlated by the receivers' loops, so that epochs closer than a stated time add nothing.
//! Integers are looked for in each epoch again and never put into what is known: a wrong fix does not stay.
//! Limits: atmosphere of both receivers by one model, so that baselines beyond some kilometres lose their
//! integers to the ionosphere; GLONASS by carriers of its own stays float.

use std::collections::{BTreeMap, BTreeSet};

use nalgebra::{DMatrix, DVector, Vector3};

use crate::carrier::{Code, chips_hz, is_divided};
use crate::integers::{Belief, Floats, Integers};
use crate::normal::{Difference, Normal, OF_POSITION};
use crate::pairs::{Pair, Track, modelled};
use crate::site::Site;
use crate::slips::{Change, slipped};
use gnss::satellite::System;
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
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            mask_rad: 10.0_f64.to_radians(),
            belief: Belief { ratio: 3.0, success_rate: 0.999 },
            is_static: false,
            correlation_s: 1.0,
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

/// A track's difference of an epoch, at the approximate position.
#[derive(Clone, Debug)]
struct Row {
    track: Track,
    wavelength_m: f64,
    code_m: f64,
    /// Phase, with what the receivers say of it: broken, half.
    phase: Option<(f64, bool, bool)>,
    direction: Vector3<f64>,
    elevation_rad: f64,
    code_m2: f64,
    phase_m2: f64,
}

/// Baselines in the making.
#[derive(Debug)]
pub struct Solver {
    settings: Settings,
    ambiguities: Vec<Ambiguity>,
    /// Information of position and ambiguities from epochs before.
    known: Normal,
    /// Time of the newest epoch in it.
    known_at: Option<Epoch>,
    /// Approximate position of the rover.
    rough_m: Option<Vector3<f64>>,
    /// Phases less their model of the epoch before.
    before: BTreeMap<Track, f64>,
    not_whole: BTreeSet<Track>,
}

impl Solver {
    /// Solver before any epoch.
    pub fn new(settings: Settings) -> Self {
        Self {
            settings,
            ambiguities: Vec::new(),
            known: Normal::new(OF_POSITION),
            known_at: None,
            rough_m: None,
            before: BTreeMap::new(),
            not_whole: BTreeSet::new(),
        }
    }

    /// Solves an epoch, with the base at an ECEF position in metres.
    pub fn epoch(&mut self, pair: &Pair, base_m: &Vector3<f64>) -> Solved {
        let base = Site::new(*base_m);
        let Some(rover) = self.approximate(pair, &base) else { return Solved::default() };
        let rows = self.rows(pair, &base, &rover);
        let events = self.follow(&rows);
        let own = self.equations(&rows);
        let mut whole = self.known.clone();
        whole.add(&own);
        let floats = self.floats(&whole, &rows);
        let mut solved = Solved { solution: None, events };
        if let Some((position_m, covariance_m2, floats)) = floats {
            let (integers, not_whole) = self.integers(&floats);
            if let Some(track) = not_whole {
                self.not_whole.insert(track);
                solved.events.push((track, Event::NotWhole));
            }
            let float_m = rover.position_m + position_m;
            solved.solution = Some(solution(&rows, float_m, covariance_m2, floats, integers));
        }
        self.keep(whole, pair.labels[1]);
        solved
    }

    /// Site of the rover by codes alone, to metres. At rest that of the first epoch serves for all.
    fn approximate(&mut self, pair: &Pair, base: &Site) -> Option<Site> {
        if let Some(position_m) = self.rough_m.filter(|_| self.settings.is_static) {
            return Some(Site::new(position_m));
        }
        let mut position_m = self.rough_m.unwrap_or(base.position_m);
        for _ in 0..MOST_STEPS {
            let rows = self.rows(pair, base, &Site::new(position_m));
            let mut normal = Normal::new(OF_POSITION);
            let codes = |row: &Row| difference(row, row.code_m, row.code_m2, None);
            groups(&rows)
                .values()
                .for_each(|group| normal.add_group(&group.iter().map(|row| codes(row)).collect::<Vec<_>>()));
            let (step, _) = normal.solve(&[0, 1, 2])?;
            position_m += step.fixed_rows::<3>(0);
            // An error of a metre moves a direction by 5e-8 rad, and a double difference by less than that.
            if step.norm() < 1.0 {
                self.rough_m = Some(position_m);
                return Some(Site::new(position_m));
            }
        }
        None
    }

    /// Single differences above the mask, rover minus base, less their model.
    fn rows(&self, pair: &Pair, base: &Site, rover: &Site) -> Vec<Row> {
        let all = pair.shared.iter().filter_map(|shared| {
            let (of_base_m, ..) = modelled(&shared.emissions[0], base);
            let (of_rover_m, direction, elevation_rad) = modelled(&shared.emissions[1], rover);
            let model_m = of_rover_m - of_base_m;
            let (sv, code) = shared.track;
            let [code_m2, phase_m2] = variances(sv.system, code, elevation_rad, shared.cn0_dbhz);
            let phase =
                shared.phases.map(|own| (own.phase_m[1] - own.phase_m[0] - model_m, own.is_broken, own.is_half));
            // Far from the true position, as at the first step, an elevation says nothing.
            let is_above = elevation_rad >= self.settings.mask_rad || self.rough_m.is_none();
            is_above.then_some(Row {
                track: shared.track,
                wavelength_m: shared.wavelength_m,
                code_m: shared.code_m[1] - shared.code_m[0] - model_m,
                phase,
                direction,
                elevation_rad,
                code_m2,
                phase_m2,
            })
        });
        all.collect()
    }

    /// Ends ambiguities whose phases are gone, broken or slipped, and begins those of new phases.
    fn follow(&mut self, rows: &[Row]) -> Vec<(Track, Event)> {
        let mut events = Vec::new();
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
            let Some((_, is_broken, is_half)) = row.and_then(|row| row.phase) else { continue };
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
        self.known = self.known.arranged(&from);
        self.ambiguities = ambiguities;
        events
    }

    /// Normal equations of an epoch's codes and phases.
    fn equations(&self, rows: &[Row]) -> Normal {
        let mut normal = Normal::new(OF_POSITION + self.ambiguities.len());
        for group in groups(rows).values() {
            let codes: Vec<Difference> =
                group.iter().map(|row| difference(row, row.code_m, row.code_m2, None)).collect();
            normal.add_group(&codes);
            let phases: Vec<Difference> = group
                .iter()
                .filter_map(|row| {
                    let (phase_m, ..) = row.phase?;
                    let index = self.ambiguities.iter().position(|own| own.track == row.track)?;
                    let rest_m = phase_m - row.wavelength_m * self.ambiguities[index].reference;
                    Some(difference(row, rest_m, row.phase_m2, Some(OF_POSITION + index)))
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

    /// The integers, and a track that turned out not to be whole.
    fn integers(&self, floats: &Floats) -> (Option<Integers>, Option<Track>) {
        let belief = self.settings.belief;
        let takes = |track: Track| {
            let (sv, code) = track;
            let is_half = self.ambiguities.iter().any(|own| own.track == track && own.is_half);
            !is_half && !is_divided(sv.system, code) && !self.not_whole.contains(&track)
        };
        let found = floats.fix(&floats.doubles(takes), belief);
        let is_suspect = |found: &Integers| !found.is_believed && found.success_rate >= belief.success_rate;
        if found.as_ref().is_some_and(is_suspect)
            && let Some((track, without)) = floats.without_one(takes, belief)
        {
            return (Some(without), Some(track));
        }
        (found, None)
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

/// Steps to the approximate position, of which the first may be thousands of kilometres.
const MOST_STEPS: usize = 12;

/// Deviation of the code of 1.023 million chips a second at 45 dB-Hz, metres: a loop of 1 Hz with a quarter
/// of a chip between early and late. It grows with the noise's amplitude and with the length of a chip.
const CODE_M: f64 = 0.5;
const CODE_CHIPS_HZ: f64 = 1.023e6;
const CODE_CN0_DBHZ: f64 = 45.0;
/// Deviation of a code that no C/N0 tells, at the zenith, metres.
const CODE_FLOOR_M: f64 = 0.1;
/// Deviation of a phase, and what low elevations add to it, metres.
const PHASE_M: [f64; 2] = [0.001, 0.002];
/// C/N0 at the horizon where a file states none, and what the zenith has more, dB-Hz.
const USUAL_DBHZ: [f64; 2] = [35.0, 12.0];
/// Least sine of an elevation in a weight.
const LEAST_SINE: f64 = 0.05;

/// Variances of a single difference of codes and of phases, square metres.
fn variances(system: System, code: Code, elevation_rad: f64, cn0_dbhz: Option<f64>) -> [f64; 2] {
    let sine = libm::sin(elevation_rad).max(LEAST_SINE);
    let cn0_dbhz = cn0_dbhz.unwrap_or(USUAL_DBHZ[0] + USUAL_DBHZ[1] * sine);
    let noise = libm::pow(10.0, (CODE_CN0_DBHZ - cn0_dbhz) / 20.0);
    let code_m = libm::hypot(CODE_M * noise * CODE_CHIPS_HZ / chips_hz(system, code), CODE_FLOOR_M / sine);
    let phase_m = libm::hypot(PHASE_M[0], PHASE_M[1] / sine);
    // Of two receivers.
    [2.0 * code_m * code_m, 2.0 * phase_m * phase_m]
}

/// Rows of each system and signal, which share a clock.
fn groups(rows: &[Row]) -> BTreeMap<(System, Code), Vec<&Row>> {
    let mut groups: BTreeMap<(System, Code), Vec<&Row>> = BTreeMap::new();
    for row in rows {
        groups.entry((row.track.0.system, row.track.1)).or_default().push(row);
    }
    groups
}

fn difference(row: &Row, misclosure_m: f64, variance_m2: f64, ambiguity: Option<usize>) -> Difference {
    let mut derivatives: Vec<(usize, f64)> = (0..OF_POSITION).map(|axis| (axis, row.direction[axis])).collect();
    derivatives.extend(ambiguity.map(|index| (index, row.wavelength_m)));
    Difference { derivatives, misclosure_m, variance_m2 }
}

fn solution(
    rows: &[Row],
    float_m: Vector3<f64>,
    covariance_m2: DMatrix<f64>,
    floats: Floats,
    integers: Option<Integers>,
) -> Solution {
    let mut bands: BTreeMap<gnss::satellite::Sv, BTreeSet<u8>> = BTreeMap::new();
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
    Solution { status, position_m, covariance_m2, float_m, satellites, on_two_bands, floats, integers }
}

#[cfg(test)]
#[path = "solver_tests.rs"]
mod tests;
