//! Times at which one satellite must be found, observed and used, from the truth's rows alone.
//!
//! A satellite must be acquired once its searches have missed it with a probability below one in a million.
//! The searches are counted at the worst phase of their interval. It must be observed after time for lock and
//! two headers of the message. It must be used after time for its ephemeris. An excused end of a lock starts
//! all of that again: the satellite is not there, too weak, faded, or the scene expects it.

use super::receiver::Receiver;
use super::timetable::Timetable;
use gnss::facts::{Expect, Fault, FaultKind, Losses};
use gnss::satellite::Sv;

/// Chance of never being found, in that many nepers, below which absence is no bad luck.
const BAD_LUCK_NP: f64 = 13.815_510_557_964_274;
/// Time to acquire, lock and synchronise to symbols.
pub const LOCK_S: f64 = 4.0;
/// C/A codes are 21.1 dB apart; a satellite that much weaker than another hides below its cross-correlation.
pub const ISOLATION_DB: f64 = 20.0;
/// A fall of the signal below its usual strength by this much is a fade in which phase turns quicker than the
/// truth's rows show.
pub const FADE_DB: f64 = 10.0;
/// Time that a receiver may take to use what it observes.
const USE_S: f64 = 1.0;
/// An ephemeris is good for so long.
const EPHEMERIS_S: f64 = 7200.0;
/// A change of health reaches the user with the next subframe 1.
const HEALTH_S: f64 = 36.0;

/// Loops, their symbols and smoothed ranges move to a clock that has jumped within so long.
const STEP_S: f64 = 5.0;

/// Faults of a satellite that are of these kinds.
fn concerning<'f>(faults: &'f [Fault], sv: Sv, kinds: &'f [FaultKind]) -> impl Iterator<Item = &'f Fault> {
    let concerns = move |fault: &&Fault| fault.satellites.as_ref().is_none_or(|list| list.contains(&sv));
    faults.iter().filter(concerns).filter(move |fault| kinds.contains(&fault.kind))
}

/// True if a satellite's clock has jumped so lately, or is about to, that a receiver is between both times.
pub fn is_stepping(faults: &[Fault], sv: Sv, time_s: f64) -> bool {
    concerning(faults, sv, &[FaultKind::ClockStep])
        .flat_map(|fault| [Some(fault.from_s), fault.to_s])
        .flatten()
        .any(|at_s| (at_s - 0.5..at_s + STEP_S).contains(&time_s))
}

/// Longest time from a step of a satellite's clock to the half cycle that the message shows, seconds: a unit
/// of 12 s (CNAV, the subframes of NavIC) that has just begun, and the two words of LNAV, 1.2 s, that confirm
/// the next.
const HALF_CYCLE_S: f64 = 13.2;

/// One row of the truth as expectation needs it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SatelliteEpoch {
    /// Seconds from sample 0 by the receiver's clock.
    pub time_s: f64,
    /// True C/N0, dB-Hz.
    pub cn0_dbhz: f64,
    /// C/N0 with other satellites, interference and the front end's loss counted, dB-Hz.
    pub effective_dbhz: f64,
    /// The strongest satellite's.
    pub strongest_dbhz: f64,
    /// True Doppler, Hz.
    pub doppler_hz: f64,
    /// True if the receiver's mask admits the satellite to fixes.
    pub above_mask: bool,
}

/// Reason why a satellite is not expected at a time.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Excuse {
    /// The truth does not have it then.
    NotThere,
    /// Signal weaker than the receiver can hold.
    Weak,
    /// Signal that was for a moment weaker than the receiver can hold.
    Faded,
    /// The receiver's loop does not follow the scene's oscillator.
    Oscillator,
    /// Signal below another's cross-correlation.
    Hidden,
    /// Something is wrong with the satellite or its message.
    Fault,
    /// The scene says so.
    Scene,
}

impl Excuse {
    /// Reason in words.
    pub fn word(self) -> &'static str {
        match self {
            Self::NotThere => "set or obstructed",
            Self::Weak => "too weak to hold",
            Self::Faded => "faded",
            Self::Oscillator => "oscillator too noisy for the loop",
            Self::Hidden => "hidden by a stronger satellite",
            Self::Fault => "faulty",
            Self::Scene => "expected by the scene",
        }
    }
}

/// Requirements on a satellite at one row.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Required {
    /// The signal can be held here, so that fixes that have begun can go on.
    pub held: bool,
    /// True if the satellite must be found by now.
    pub acquired: bool,
    /// True if the satellite must be observed.
    pub observed: bool,
    /// True if a fix must use the satellite.
    pub used: bool,
}

/// Everything about the scene that is not in the rows.
#[derive(Clone, Copy)]
pub struct Scene<'s> {
    /// Expectations from the receiver's settings.
    pub receiver: &'s Receiver,
    /// Timetable of the message.
    pub timetable: Timetable<'s>,
    /// Expectations that the scene states.
    pub expect: &'s Expect,
    /// Faults of the satellites.
    pub faults: &'s [Fault],
    /// Interval of the truth's rows.
    pub interval_s: f64,
}

impl Scene<'_> {
    fn of<'k>(&'k self, sv: Sv, kinds: &'k [FaultKind]) -> impl Iterator<Item = &'k Fault> {
        concerning(self.faults, sv, kinds)
    }

    /// True if the message cannot be read without errors.
    fn garbled(&self, sv: Sv, time_s: f64) -> bool {
        self.of(sv, &[FaultKind::BitErrors, FaultKind::Bit, FaultKind::Alert])
            .any(|fault| during(fault, time_s, HEALTH_S))
    }

    /// True if the message has been garbled by `time_s`, so that a channel may have given it up.
    pub fn was_garbled(&self, sv: Sv, time_s: f64) -> bool {
        self.of(sv, &[FaultKind::BitErrors, FaultKind::Bit, FaultKind::Alert]).any(|fault| time_s >= fault.from_s)
    }

    /// True if the message may show at `time_s` that a loop has settled on the other half cycle after a step
    /// of the satellite's clock.
    pub fn shows_half_cycle(&self, sv: Sv, time_s: f64) -> bool {
        self.of(sv, &[FaultKind::ClockStep])
            .flat_map(|fault| [Some(fault.from_s), fault.to_s])
            .flatten()
            .any(|at_s| (at_s..at_s + HALF_CYCLE_S).contains(&time_s))
    }

    /// True if the satellite must not, or need not, be used.
    fn unfit(&self, sv: Sv, time_s: f64) -> bool {
        let wrong =
            [FaultKind::ClockStep, FaultKind::ClockRamp, FaultKind::ClockNoise, FaultKind::Orbit, FaultKind::Parameter];
        // What is wrong leaves smoothed ranges and decoded ephemerides wrong for a while after.
        let wrong = self.of(sv, &wrong).any(|fault| time_s >= fault.from_s);
        wrong || self.of(sv, &[FaultKind::Health]).any(|fault| during(fault, time_s, HEALTH_S))
    }

    /// Time in seconds at which its elements are known, or its reduced elements where they suffice.
    fn elements_by_s(&self, locked_s: f64) -> f64 {
        let whole_s = self.timetable.ephemeris_by_s(locked_s);
        if self.receiver.reduced_elements { whole_s.min(self.timetable.reduced_by_s(locked_s)) } else { whole_s }
    }

    /// Reason why a lock may end at a row, if it may.
    pub fn excuse(&self, sv: Sv, row: &SatelliteEpoch, usual_dbhz: f64) -> Option<Excuse> {
        match self.expect.losses(sv, row.time_s) {
            Some(Losses::Any) => return Some(Excuse::Scene),
            Some(Losses::None) => return None,
            None => {}
        }
        if self.receiver.hold_dbhz.is_infinite() {
            Some(Excuse::Oscillator)
        } else if row.effective_dbhz < self.receiver.hold_dbhz {
            Some(Excuse::Weak)
        } else if row.cn0_dbhz < usual_dbhz - FADE_DB {
            Some(Excuse::Faded)
        } else if row.cn0_dbhz < row.strongest_dbhz - ISOLATION_DB {
            Some(Excuse::Hidden)
        } else if is_stepping(self.faults, sv, row.time_s) {
            Some(Excuse::Fault)
        } else {
            None
        }
    }

    /// Requirements at each row; `healthy` is the message's statement without faults.
    pub fn required(&self, sv: Sv, rows: &[SatelliteEpoch], usual_dbhz: f64, healthy: bool) -> Vec<Required> {
        let mut state = State::default();
        let mut last_s = f64::NEG_INFINITY;
        let mut found = Vec::with_capacity(rows.len());
        for row in rows {
            if row.time_s - last_s > 1.5 * self.interval_s || self.excuse(sv, row, usual_dbhz).is_some() {
                state = State { ephemeris_s: state.ephemeris_s, ..State::default() };
            }
            last_s = row.time_s;
            if self.excuse(sv, row, usual_dbhz).is_some() {
                found.push(Required::default());
                continue;
            }
            state.search(self.receiver, row);
            let (garbled, fit) = (self.garbled(sv, row.time_s), healthy && !self.unfit(sv, row.time_s));
            if let Some(acquired_s) = state.acquired_s.filter(|_| !garbled) {
                let locked_s = acquired_s + LOCK_S;
                state.observed_s.get_or_insert(self.timetable.frame_by_s(locked_s));
                let known = state.ephemeris_s.is_some_and(|at_s| row.time_s < at_s + EPHEMERIS_S);
                let ready_s = if known { locked_s } else { self.elements_by_s(locked_s) };
                state.used_s.get_or_insert(ready_s.max(state.observed_s.unwrap_or(ready_s)) + USE_S);
            }
            let reached = |at_s: Option<f64>| at_s.is_some_and(|at_s| row.time_s >= at_s);
            let used = reached(state.used_s) && fit && row.above_mask;
            if reached(state.used_s) && fit {
                state.ephemeris_s = Some(row.time_s);
            }
            found.push(Required {
                held: fit && row.above_mask,
                acquired: state.acquired_s.is_some(),
                observed: reached(state.observed_s),
                used,
            });
        }
        found
    }
}

/// True if a fault is active, or was until `after_s` before.
fn during(fault: &Fault, time_s: f64, after_s: f64) -> bool {
    time_s >= fault.from_s && fault.to_s.is_none_or(|to_s| time_s < to_s + after_s)
}

/// Progress of a lock.
#[derive(Clone, Copy, Debug, Default)]
struct State {
    /// Time since which it could be found, seconds.
    since_s: Option<f64>,
    searches: u32,
    luck_np: f64,
    acquired_s: Option<f64>,
    observed_s: Option<f64>,
    used_s: Option<f64>,
    /// Time at which its ephemeris was last good, seconds.
    ephemeris_s: Option<f64>,
}

impl State {
    /// Counts the searches that must have been made.
    fn search(&mut self, receiver: &Receiver, row: &SatelliteEpoch) {
        if self.acquired_s.is_some() {
            return;
        }
        let since_s = *self.since_s.get_or_insert(row.time_s);
        // At the scene's start the first search comes at once; later ones come when they come.
        let at_start = since_s <= 0.0;
        let due = f64::from(self.searches) + if at_start { 0.0 } else { 1.0 };
        if row.time_s - since_s >= due * receiver.search_interval_s {
            let miss = receiver.miss(row.effective_dbhz, at_start && self.searches == 0);
            self.luck_np -= libm::log(miss.max(f64::MIN_POSITIVE));
            self.searches += 1;
        }
        if self.luck_np >= BAD_LUCK_NP {
            self.acquired_s = Some(row.time_s);
        }
    }
}

#[cfg(test)]
mod tests {
    use serde_json::Value;

    use super::*;
    use gnss::facts::{Interval, Terms};
    use gnss::gps::l1ca::L1_CA;
    use gnss::time::Epoch;

    /// A second a row, all strong but where `weak` says.
    fn rows(seconds: u32, dbhz: impl Fn(f64) -> Option<f64>) -> Vec<SatelliteEpoch> {
        let row = |second: u32| {
            let time_s = f64::from(second);
            let cn0_dbhz = dbhz(time_s)?;
            let (effective_dbhz, strongest_dbhz) = (cn0_dbhz, cn0_dbhz.max(45.0));
            Some(SatelliteEpoch { time_s, cn0_dbhz, effective_dbhz, strongest_dbhz, doppler_hz: 0.0, above_mask: true })
        };
        (0..seconds).filter_map(row).collect()
    }

    /// First seconds of acquired, observed, used, with times after `from_s` alone.
    fn first(scene: &Scene<'_>, rows: &[SatelliteEpoch], from_s: f64) -> [Option<f64>; 3] {
        let required = scene.required(Sv::gps(5), rows, 45.0, true);
        let of = |of: fn(&Required) -> bool| {
            let later = rows.iter().zip(&required).filter(|(row, _)| row.time_s >= from_s);
            later.filter(|(_, required)| of(required)).map(|(row, _)| row.time_s).next()
        };
        [of(|r| r.acquired), of(|r| r.observed), of(|r| r.used)]
    }

    fn with<T>(expect: Expect, faults: &[Fault], judge: impl FnOnce(&Scene<'_>) -> T) -> T {
        let receiver = Receiver::for_tests(&Value::Null);
        let timetable = Timetable::new(&L1_CA, Epoch::parse("2010-07-01T08:05:58").unwrap());
        judge(&Scene { receiver: &receiver, timetable, expect: &expect, faults, interval_s: 1.0 })
    }

    #[test]
    fn a_strong_satellite_must_be_found_at_once_observed_after_two_headers_and_used_with_its_ephemeris() {
        with(Expect::default(), &[], |scene| {
            let found = first(scene, &rows(90, |_| Some(45.0)), 0.0);
            // Locked by 4 s, between subframes at 2 and 8 s; headers at 8 and 14 s; subframe 1 is whole at 38
            // s.
            assert_eq!(found, [Some(0.0), Some(16.0), Some(40.0)]);
        });
    }

    #[test]
    fn one_that_rises_waits_for_the_next_search_and_one_too_weak_for_the_search_is_not_expected() {
        with(Expect::default(), &[], |scene| {
            let rising = rows(120, |t_s| (t_s >= 20.0).then_some(45.0));
            assert_eq!(first(scene, &rising, 0.0)[0], Some(35.0), "a search every 15 s, at the worst phase");
            assert_eq!(first(scene, &rows(900, |_| Some(29.0)), 0.0)[1], None, "held perhaps, but hardly found");
            assert_eq!(first(scene, &rows(90, |_| Some(24.0)), 0.0), [None; 3], "too weak to hold");
            let strong = rows(90, |_| Some(45.0)).into_iter().map(|row| SatelliteEpoch { strongest_dbhz: 66.0, ..row });
            assert_eq!(first(scene, &strong.collect::<Vec<_>>(), 0.0), [None; 3], "hidden");
        });
    }

    #[test]
    fn what_ends_a_lock_for_a_good_reason_starts_the_wait_anew() {
        with(Expect::default(), &[], |scene| {
            let gap = rows(120, |t_s| (!(50.0..55.0).contains(&t_s)).then_some(45.0));
            let after = first(scene, &gap, 50.0);
            assert_eq!(after[0], Some(70.0));
            // Locked by 74 s: headers at 74 and 80 s; the ephemeris is known from before.
            assert_eq!((after[1], after[2]), (Some(82.0), Some(83.0)));
            let fade = rows(120, |t_s| Some(if t_s == 60.0 { 34.0 } else { 45.0 }));
            let required = scene.required(Sv::gps(5), &fade, 45.0, true);
            assert!(required[59].used && !required[60].observed && !required[61].observed && required[119].observed);
        });
    }

    #[test]
    fn a_scene_excuses_by_satellite_and_interval_and_faults_excuse_their_satellite() {
        let terms = Terms {
            losses: Some(Losses::Any),
            satellites: Some(vec![Sv::gps(5)]),
            reason: "jammer".to_owned(),
            ..Terms::default()
        };
        let expect = Expect { whole: None, intervals: vec![Interval { from_s: 60.0, to_s: 70.0, terms }] };
        with(expect, &[], |scene| {
            let all = rows(120, |_| Some(45.0));
            let own = scene.required(Sv::gps(5), &all, 45.0, true);
            let other = scene.required(Sv::gps(6), &all, 45.0, true);
            assert!(own[59].used && !own[65].observed && other[65].used);
        });
        let fault = |kind: FaultKind, from_s, to_s| Fault { kind, satellites: Some(vec![Sv::gps(5)]), from_s, to_s };
        with(
            Expect::default(),
            &[fault(FaultKind::Health, 60.0, Some(62.0)), fault(FaultKind::BitErrors, 100.0, None)],
            |scene| {
                let all = rows(120, |_| Some(45.0));
                let own = scene.required(Sv::gps(5), &all, 45.0, true);
                assert!(own[59].used && own[65].observed && !own[65].used && own[98].used);
                assert!(scene.required(Sv::gps(5), &all, 45.0, false).iter().all(|r| !r.used), "unhealthy all along");
            },
        );
        with(Expect::default(), &[fault(FaultKind::ClockStep, 30.0, Some(60.0))], |scene| {
            let shows = |time_s| scene.shows_half_cycle(Sv::gps(5), time_s);
            assert_eq!([29.9, 30.0, 43.0, 43.3, 60.0, 73.3].map(shows), [false, true, true, false, true, false]);
            assert!(!scene.shows_half_cycle(Sv::gps(6), 30.0) && !scene.was_garbled(Sv::gps(5), 30.0));
        });
        with(Expect::default(), &[fault(FaultKind::BitErrors, 0.0, None)], |scene| {
            assert!(scene.was_garbled(Sv::gps(5), 80.0) && !scene.shows_half_cycle(Sv::gps(5), 1.0));
            assert_eq!(first(scene, &rows(90, |_| Some(45.0)), 0.0), [Some(0.0), None, None]);
        });
    }
}
