//! Broadcast ephemeris of each satellite at each time, and the smooth orbit that the generator takes as true.
//!
//! An ephemeris of GPS is first sent two hours before its reference time (IS-GPS-200N, 20.3.4.4), or when
//! it was first received if its reference time is off the two-hour grid, which marks a fresh upload; it stays
//! until the next one or the end of its curve fit interval. Neighbouring ephemerides disagree by
//! a metre or two, so the truth passes from one to the next over [`BLEND_S`]: the received phase
//! stays smooth and the decoded ephemeris stays right to that metre.
//!
//! Records that their neighbours contradict are left out ([`Catalogue::new`]). Precise orbits may step in
//! for the true ones ([`Catalogue::follow`]), and faults add to either ([`Catalogue::depart`]); what is sent
//! stays as it is.

use std::collections::BTreeMap;

use crate::orbit_error::{Displacement, minimum_jerk};
use crate::precise::Orbits;
use gnss::broadcast::{ClockState, Ephemeris, OrbitError, State};
use gnss::satellite::{Sv, System};
use gnss::signal::Signal;
use gnss::time::Epoch;

/// Duration of a hand-over, centred on the instant when the broadcast ephemeris changes. A step of Δ metres
/// becomes a rate of at most 1.875 Δ / 720 s: 2.6 mm/s a metre.
pub const BLEND_S: f64 = 720.0;
/// Ephemerides further apart than this are not compared.
const COMPARABLE_S: f64 = 6.0 * 3600.0;
/// Good ephemerides of one satellite agree to some ten metres half way between their reference times, where
/// they are at most six hours apart.
const CONTRADICTION_M: f64 = 2000.0;
/// The longest time from the reference time of an ephemeris that is sent after it to its first sending:
/// Galileo's records of 2020 have 11 min at least; of 283 records of NavIC of a day in 2026 all but one have
/// 12 s to 252 s.
const DELAY_S: f64 = 600.0;
/// Largest plausible difference in seconds between the clocks of two ephemerides, 300 m: beyond it they
/// contradict each other.
const CONTRADICTION_S: f64 = 1e-6;
/// Half of the variation in metres of distances to satellites in round orbits, for eccentricities below 0.01
/// as in GLONASS.
const ROUND_M: f64 = 3e5;

/// Interval in which one ephemeris is sent.
#[derive(Clone, Copy, Debug)]
struct Span {
    from: Epoch,
    set: Option<usize>,
}

#[derive(Clone, Debug)]
struct Timeline {
    sets: Vec<Ephemeris>,
    spans: Vec<Span>,
}

/// A time in which a satellite has nothing to send: from the end of one ephemeris's fit interval to the first
/// sending of the next one. Open where no ephemeris comes before or after.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Silence {
    /// Beginning; `None` if it has always lasted.
    pub from: Option<Epoch>,
    /// End; `None` if it never ends.
    pub until: Option<Epoch>,
}

/// Broadcast ephemerides of every satellite, ordered by transmission time, and the true orbits and clocks.
#[derive(Clone, Debug)]
pub struct Catalogue {
    satellites: BTreeMap<Sv, Timeline>,
    precise: Option<Orbits>,
    departures: Vec<Displacement>,
    /// Offset of a system's time ahead of GPS time, in seconds, without the whole seconds between both; zero
    /// for systems without an entry.
    time_offsets_s: BTreeMap<System, f64>,
}

impl Catalogue {
    /// Arranges `sets`, in any order, and reports in words which ones were left out.
    ///
    /// Repeated ephemerides count once. Two ephemerides of a satellite contradict each other when, half way
    /// between their reference times, their positions differ by more than 2 km or their clocks by more than
    /// 1 µs; ephemerides more than six hours apart are not compared. While some ephemeris is contradicted by
    /// more others than agree with it, the worst are left out; of equally bad ones only those that do not
    /// look like a GPS orbit, and all of them if that does not distinguish them.
    pub fn new(sets: Vec<Ephemeris>) -> (Self, Vec<String>) {
        let mut warnings = Vec::new();
        let mut grouped: BTreeMap<Sv, Vec<Ephemeris>> = BTreeMap::new();
        for set in sets {
            match set.state(set.toe) {
                Ok(_) => grouped.entry(set.sv).or_default().push(set),
                Err(error) => warnings.push(format!("left out: {error}")),
            }
        }
        warnings.sort();
        let mut satellites = BTreeMap::new();
        for (sv, mut sets) in grouped {
            sets.sort_by(compare);
            sets.dedup_by(|later, earlier| same_elements(later, earlier));
            leave_out_rogues(&mut sets, &mut warnings);
            if !sets.is_empty() {
                let spans = spans(&sets);
                satellites.insert(sv, Timeline { sets, spans });
            }
        }
        (Self { satellites, precise: None, departures: Vec::new(), time_offsets_s: BTreeMap::new() }, warnings)
    }

    /// Takes `orbits` for true from here on, instead of the broadcast ephemerides.
    pub fn follow(&mut self, orbits: Orbits) {
        self.precise = Some(orbits);
    }

    /// Adds errors of the true orbits.
    pub fn depart(&mut self, departures: Vec<Displacement>) {
        self.departures = departures;
    }

    /// Sets the offset ahead of GPS time of a system's time, which its satellites' clocks follow, in seconds.
    /// Whole seconds between both are excluded.
    pub fn set_time_offset(&mut self, system: System, offset_s: f64) {
        self.time_offsets_s.insert(system, offset_s);
    }

    /// Offset of a system's time ahead of GPS time, in seconds, without the whole seconds between both.
    pub fn time_offset_s(&self, system: System) -> f64 {
        self.time_offsets_s.get(&system).copied().unwrap_or(0.0)
    }

    /// Describes the differences between the truth and the broadcast ephemerides: precise orbits, and orbit
    /// errors.
    pub fn describe(&self) -> (Option<String>, Vec<String>) {
        let precise = self.precise.as_ref().map(Orbits::describe);
        (precise, self.departures.iter().map(Displacement::describe).collect())
    }

    /// Satellites of which there is at least one ephemeris.
    pub fn satellites(&self) -> impl Iterator<Item = Sv> {
        self.satellites.keys().copied()
    }

    /// The ephemeris that `sv` sends at `at`; `None` when none is within its fit interval.
    pub fn sent_at(&self, sv: Sv, at: Epoch) -> Option<&Ephemeris> {
        self.sent_since(sv, at).map(|(_, set)| set)
    }

    /// Ephemeris that is sent at a time, with the time from which it is.
    pub fn sent_since(&self, sv: Sv, at: Epoch) -> Option<(Epoch, &Ephemeris)> {
        let timeline = self.satellites.get(&sv)?;
        let count = timeline.spans.partition_point(|span| span.from <= at);
        let span = timeline.spans.get(count.checked_sub(1)?)?;
        Some((span.from, timeline.sets.get(span.set?)?))
    }

    /// Times after `from`, up to `to`, from which satellites send another ephemeris than before, in order of
    /// time.
    pub fn renewals(&self, from: Epoch, to: Epoch) -> Vec<(Sv, Epoch)> {
        let of = |(sv, timeline): (&Sv, &Timeline)| {
            let within = |span: &&Span| span.set.is_some() && from < span.from && span.from <= to;
            timeline.spans.iter().filter(within).map(|span| (*sv, span.from)).collect::<Vec<_>>()
        };
        let mut found: Vec<_> = self.satellites.iter().flat_map(of).collect();
        found.sort_by(|(_, a), (_, b)| a.since(*b).total_cmp(&0.0));
        found
    }

    /// Intervals in which `sv` has nothing to send, as far as they concern `from..=to`, in order of time.
    pub fn silences(&self, sv: Sv, from: Epoch, to: Epoch) -> Vec<Silence> {
        let Some(timeline) = self.satellites.get(&sv) else { return vec![Silence { from: None, until: None }] };
        let before = Silence { from: None, until: timeline.spans.first().map(|span| span.from) };
        let gaps = timeline.spans.iter().enumerate().filter(|(_, span)| span.set.is_none());
        let gaps = gaps.map(|(index, span)| Silence {
            from: Some(span.from),
            until: timeline.spans.get(index + 1).map(|next| next.from),
        });
        let concerns = |silence: &Silence| {
            silence.from.is_none_or(|begin| begin <= to) && silence.until.is_none_or(|end| end > from)
        };
        std::iter::once(before).chain(gaps).filter(concerns).collect()
    }

    /// Intervals in which at least one satellite of a system sends an ephemeris, in order of time. No two of
    /// them touch.
    pub fn sending(&self, system: System) -> Vec<(Epoch, Epoch)> {
        let own = self.satellites.iter().filter(|(sv, _)| sv.system == system).map(|(_, timeline)| timeline);
        let on_air = own.flat_map(|timeline| {
            let pairs = timeline.spans.windows(2).filter_map(|pair| match pair {
                [span, next] if span.set.is_some() => Some((span.from, next.from)),
                _ => None,
            });
            pairs.collect::<Vec<_>>()
        });
        let mut all: Vec<(Epoch, Epoch)> = on_air.collect();
        all.sort_by(|a, b| a.0.since(b.0).total_cmp(&0.0));
        all.dedup_by(|later, earlier| {
            let touch = later.0 <= earlier.1;
            if touch && later.1 > earlier.1 {
                earlier.1 = later.1;
            }
            touch
        });
        all
    }

    /// True if all signals that arrive from `from` to `to` have an orbit and were sent without interruption.
    /// The result may be `false` too early within a second of either end.
    pub fn sent_throughout(&self, sv: Sv, from: Epoch, to: Epoch) -> bool {
        // Signals are on their way for less than a second.
        let from = from.plus_s(-1.0);
        self.silences(sv, from, to).is_empty() && self.precise.as_ref().is_none_or(|orbits| orbits.covers(sv, from, to))
    }

    /// The ephemeris of `sv` whose reference time is nearest to `at`.
    pub fn nearest_set(&self, sv: Sv, at: Epoch) -> Option<&Ephemeris> {
        let sets = &self.satellites.get(&sv)?.sets;
        sets.iter().min_by(|a, b| a.toe.since(at).abs().total_cmp(&b.toe.since(at).abs()))
    }

    /// True if `sv` sends an ephemeris at `at` that reports no signal of its system among `signals` as
    /// healthy.
    pub fn is_sick(&self, sv: Sv, at: Epoch, signals: &[&'static Signal]) -> bool {
        let own = || signals.iter().filter(|signal| signal.system == sv.system);
        let good = |set: &Ephemeris, signal: &Signal| set.is_healthy_on(signal).unwrap_or(set.is_healthy());
        self.sent_at(sv, at).is_some_and(|set| !own().any(|signal| good(set, signal)))
    }

    /// True if `sv` sends an ephemeris at `at` that reports it healthy.
    pub fn healthy(&self, sv: Sv, at: Epoch) -> bool {
        self.sent_at(sv, at).is_some_and(|set| set.is_healthy())
    }

    /// True orbit (in the ECEF axes of `at`) and true L1 C/A clock, T_GD included, at GPS time `at`. `None`
    /// where [`Self::sent_at`] is, or where precise orbits are used and have none.
    ///
    /// # Errors
    /// [`OrbitError`] from the elements.
    pub fn truth(&self, sv: Sv, at: Epoch) -> Result<Option<(State, ClockState)>, OrbitError> {
        let found = match &self.precise {
            Some(orbits) => orbits.truth(sv, at),
            None => self.broadcast_truth(sv, at)?,
        };
        let departed = |state: State| {
            let own = self.departures.iter().filter(|departure| departure.satellites.contains(&sv));
            own.fold(state, |state, departure| departure.apply(state, at))
        };
        let ahead_s = self.time_offset_s(sv.system);
        Ok(found.map(|(state, clock)| (departed(state), ClockState { offset_s: clock.offset_s + ahead_s, ..clock })))
    }

    /// Clock offset in seconds of a satellite for `signal`, minus that of [`Self::truth`], which is for L1
    /// C/A.
    ///
    /// From the group delays of the broadcast ephemerides, through hand-overs as smoothly as the clock.
    pub fn signal_clock_s(&self, sv: Sv, at: Epoch, signal: &Signal) -> f64 {
        let sets = self.satellites.get(&sv).into_iter().flat_map(|timeline| weights(timeline, at));
        sets.fold(0.0, |sum, (set, weight, _)| sum + (set.given_delay_s() - set.group_delay_s(signal)) * weight)
    }

    /// The broadcast ephemerides' orbit and clock; twice continuously differentiable across hand-overs.
    fn broadcast_truth(&self, sv: Sv, at: Epoch) -> Result<Option<(State, ClockState)>, OrbitError> {
        let Some(timeline) = self.satellites.get(&sv) else { return Ok(None) };
        let mut sum: Option<(State, ClockState)> = None;
        for (set, weight, rate) in weights(timeline, at) {
            let (state, clock) = set.state_and_clock_l1(at)?;
            let (total, total_clock) = sum.get_or_insert((
                State { position_m: nalgebra::Vector3::zeros(), velocity_mps: nalgebra::Vector3::zeros() },
                ClockState { offset_s: 0.0, drift: 0.0 },
            ));
            total.position_m += state.position_m * weight;
            total.velocity_mps += state.velocity_mps * weight + state.position_m * rate;
            total_clock.offset_s += clock.offset_s * weight;
            total_clock.drift += clock.drift * weight + clock.offset_s * rate;
        }
        Ok(sum)
    }
}

/// The ephemerides that weigh in at `at`, each with its weight and the rate of that.
fn weights(timeline: &Timeline, at: Epoch) -> impl Iterator<Item = (&Ephemeris, f64, f64)> {
    // Those whose spans begin before the blend's end and end after its begin.
    let first = timeline.spans.partition_point(|s| s.from <= at.plus_s(-BLEND_S / 2.0)).saturating_sub(1);
    let last = timeline.spans.partition_point(|s| s.from <= at.plus_s(BLEND_S / 2.0));
    (first..last).filter_map(move |index| {
        let set = timeline.spans.get(index).and_then(|s| s.set).and_then(|i| timeline.sets.get(i))?;
        let (begun, begun_rate) = step(timeline, index, at);
        let (ended, ended_rate) = step(timeline, index + 1, at);
        let (weight, rate) = (begun - ended, begun_rate - ended_rate);
        (weight != 0.0 || rate != 0.0).then_some((set, weight, rate))
    })
}

/// Progress at `at` of the change to span `index`, 0 to 1, and its rate per second. The change is a quintic
/// between two ephemerides, and a jump if one side has none.
fn step(timeline: &Timeline, index: usize, at: Epoch) -> (f64, f64) {
    let Some(span) = timeline.spans.get(index) else { return (0.0, 0.0) };
    let since_s = at.since(span.from);
    let before = index.checked_sub(1).and_then(|i| timeline.spans.get(i)).and_then(|s| s.set);
    if before.is_none() || span.set.is_none() {
        return (if since_s >= 0.0 { 1.0 } else { 0.0 }, 0.0);
    }
    let (done, rate) = minimum_jerk(since_s / BLEND_S + 0.5);
    (done, rate / BLEND_S)
}

/// A total order that depends on the contents alone.
fn compare(a: &Ephemeris, b: &Ephemeris) -> std::cmp::Ordering {
    let key = |e: &Ephemeris| (e.toe.seconds(), e.iodc, e.iode, e.health, e.ura_index);
    let place_m = |e: &Ephemeris| e.vector.map_or(0.0, |vector| vector.position_m.x);
    let number = |e: &Ephemeris| {
        [e.transmitted.since(e.toe), e.m0_rad, e.sqrt_a_sqrtm, e.omega0_rad, e.af0_s, e.crs_m, place_m(e)]
    };
    key(a).cmp(&key(b)).then_with(|| {
        number(a)
            .iter()
            .zip(number(b))
            .map(|(x, y)| x.total_cmp(&y))
            .find(|o| o.is_ne())
            .unwrap_or(std::cmp::Ordering::Equal)
    })
}

/// True if two records differ only in the time of reception.
fn same_elements(a: &Ephemeris, b: &Ephemeris) -> bool {
    Ephemeris { transmitted: b.transmitted, ..a.clone() } == *b
}

/// Largest difference in seconds between the reference times of compared ephemerides. Its middle is within
/// the fit interval of both.
fn comparable_s(set: &Ephemeris) -> f64 {
    COMPARABLE_S.min(2.0 * set.fit_interval_s())
}

fn contradict(a: &Ephemeris, b: &Ephemeris) -> bool {
    let middle = a.toe.plus_s(b.toe.since(a.toe) / 2.0);
    let positions = a.state(middle).and_then(|x| Ok((x.position_m - b.state(middle)?.position_m).norm()));
    let clocks = a.clock(middle).and_then(|x| Ok((x.offset_s - b.clock(middle)?.offset_s).abs()));
    match (positions, clocks) {
        (Ok(apart_m), Ok(apart_s)) => !(apart_m <= CONTRADICTION_M && apart_s <= CONTRADICTION_S),
        _ => true,
    }
}

/// True if elements belong to the nominal constellation (the fields are wider). GPS has 12 h sidereal orbits
/// of 55° and small eccentricity, Galileo 14 h and 56°. NavIC has one day and 0° to 33°, QZSS one day and 0°
/// to 50°. BeiDou has 0° to 60°, one day or 13 h. A state vector must have the distance of the system's
/// orbits.
fn plausible(set: &Ephemeris) -> bool {
    if let Some(vector) = set.vector {
        return (vector.position_m.norm() - set.sv.orbit_m()).abs() < ROUND_M;
    }
    let (sqrt_a_sqrtm, inclinations_deg) = match set.sv.system {
        System::Galileo => (5440.6, 52.0..60.0),
        System::Navic => (6493.4, 0.0..33.0),
        System::Qzss => (6493.4, 0.0..50.0),
        System::BeiDou if set.sv.orbit_m() > 40e6 => (6493.4, 0.0..60.0),
        System::BeiDou => (5282.6, 51.0..59.0),
        _ => (5153.6, 51.0..59.0),
    };
    (set.sqrt_a_sqrtm - sqrt_a_sqrtm).abs() < 5.0
        && set.eccentricity < if set.sv.system == System::Qzss { 0.1 } else { 0.03 }
        && inclinations_deg.contains(&set.i0_rad.to_degrees())
}

fn leave_out_rogues(sets: &mut Vec<Ephemeris>, warnings: &mut Vec<String>) {
    let against: Vec<Vec<Option<bool>>> = sets
        .iter()
        .enumerate()
        .map(|(i, a)| {
            let others = sets.iter().enumerate();
            others
                .map(|(j, b)| (i != j && a.toe.since(b.toe).abs() <= comparable_s(a)).then(|| contradict(a, b)))
                .collect()
        })
        .collect();
    let mut kept = vec![true; sets.len()];
    loop {
        // Contradictions less agreements, among those still kept.
        let score = |votes: &Vec<Option<bool>>| -> i64 {
            votes.iter().zip(&kept).filter(|(_, k)| **k).filter_map(|(v, _)| *v).map(|c| if c { 1 } else { -1 }).sum()
        };
        let scores: Vec<Option<i64>> = against.iter().zip(&kept).map(|(votes, k)| k.then(|| score(votes))).collect();
        let Some(worst) = scores.iter().flatten().copied().max().filter(|score| *score > 0) else { break };
        let blamed: Vec<bool> = scores.iter().map(|score| *score == Some(worst)).collect();
        let odd = |(set, blamed): (&Ephemeris, &bool)| *blamed && !plausible(set);
        let any_odd = sets.iter().zip(&blamed).any(odd);
        for ((set, kept), blamed) in sets.iter().zip(&mut kept).zip(&blamed) {
            if *blamed && !(any_odd && plausible(set)) {
                *kept = false;
                warnings.push(format!(
                    "{}: left out the ephemeris of {} (IODE {}): those before and after it give another orbit or clock",
                    set.sv, set.toe, set.iode
                ));
            }
        }
    }
    let mut kept = kept.into_iter();
    sets.retain(|_| kept.next().unwrap_or(true));
}

/// Time of first transmission of an ephemeris. Galileo and NavIC, which renew it every ten minutes at best,
/// send it after its reference time. A file states when a receiver had decoded it completely, some minutes
/// later.
///
/// BeiDou's ephemerides are those of an hour, and are first sent with it, those of QZSS with the hour before
/// theirs.
fn first_sent(set: &Ephemeris) -> Epoch {
    if let Some(from) = set.sent_from() {
        return from;
    }
    if set.sv.system == System::BeiDou {
        return set.toe;
    }
    if set.is_sent_after_reference() {
        return set.toe.plus_s(set.transmitted.since(set.toe).clamp(0.0, DELAY_S));
    }
    if set.sv.system == System::Qzss {
        return set.toe.plus_s(-3600.0);
    }
    let nominal = set.toe.plus_s(-7200.0);
    let on_grid = set.toe.seconds() % 7200 == 0;
    let late_s = set.transmitted.since(nominal);
    if on_grid || !(0.0..7200.0).contains(&late_s) { nominal } else { set.transmitted }
}

fn spans(sets: &[Ephemeris]) -> Vec<Span> {
    let fits = |set: &Ephemeris| {
        let half = set.fit_interval_s() / 2.0;
        // A long fit begins with the transmission and is not centred on it, so never begin before.
        (first_sent(set), set.toe.plus_s(half))
    };
    let mut instants: Vec<Epoch> = sets.iter().flat_map(|set| [fits(set).0, fits(set).1]).collect();
    instants.sort_by(|a, b| a.partial_cmp(b).unwrap_or(std::cmp::Ordering::Equal));
    instants.dedup();
    let mut spans: Vec<Span> = Vec::new();
    for from in instants {
        let on_air = sets.iter().enumerate().filter(|(_, set)| fits(set).0 <= from && from < fits(set).1);
        // The one that began last; `sets` is in order of reference time, and the later wins a tie.
        let set = on_air
            .max_by(|(_, a), (_, b)| first_sent(a).partial_cmp(&first_sent(b)).unwrap_or(std::cmp::Ordering::Equal))
            .map(|(index, _)| index);
        if spans.last().is_none_or(|span| span.set != set) {
            spans.push(Span { from, set });
        }
    }
    spans
}

#[cfg(test)]
mod tests;
