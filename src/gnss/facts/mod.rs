//! Facts of a scene that generator and judge share: the content of its samples, its expectations about a
//! receiver, and its satellite faults.
//!
//! They lie in `truth/scene.json` ([`SceneFacts`]), so that a run can be judged wherever it is. No receiver
//! reads them. Both sides use these types: a name that one side does not know is refused, not taken for a
//! default. Times are seconds from the scene's first sample.

mod array;
mod front_end;
mod inertial;
mod interference;
mod osnma;
mod scene;

use serde::{Deserialize, Serialize};

use crate::satellite::Sv;
pub use array::ArrayFacts;
pub use front_end::{
    BalanceSpec, ConverterSpec, Edge, FilterShape, FilterSpec, StageSpec, converter, filters, oscillator_offset_hz,
};
pub use inertial::{InertialFacts, TriadErrors};
pub use interference::Interference;
pub use osnma::{OsnmaFacts, SpoofedBits, SpoofedMessages};
pub use scene::{FrontEndFacts, OscillatorFacts, Renewal, SceneFacts};

/// Offset of a system's time scale from GPS time.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TimeOffset {
    /// Name of the time scale.
    pub time_scale: String,
    /// Offset ahead of GPS time, in seconds, without the whole seconds between both.
    pub ahead_s: f64,
}

/// Expectation about fixes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Fixes {
    /// Fixes must exist, whatever the judge computes from satellites and message.
    Required,
    /// No fix may exist.
    None,
    /// Fixes are not judged.
    Any,
}

impl Fixes {
    /// Values by the words that a scenario uses.
    pub const NAMES: [(&'static str, Self); 3] =
        [("required", Self::Required), ("none", Self::None), ("any", Self::Any)];
}

/// Expectation about satellites: acquisition, lock and use.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Losses {
    /// Losses, slips and absences are not judged.
    Any,
    /// No loss is excused, however weak the signal.
    None,
}

impl Losses {
    /// Values by the words that a scenario uses.
    pub const NAMES: [(&'static str, Self); 2] = [("any", Self::Any), ("none", Self::None)];
}

/// Expectation about the errors of fixes and observations.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Sizes {
    /// Errors must stay within the judge's limits.
    Bounded,
    /// Errors are not judged.
    Any,
}

impl Sizes {
    /// Values by the words that a scenario uses.
    pub const NAMES: [(&'static str, Self); 2] = [("bounded", Self::Bounded), ("any", Self::Any)];
}

/// Expectations for a time. What is absent follows from the scene's physics.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Terms {
    /// Expectation about fixes.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub fix: Option<Fixes>,
    /// Expectation about losses of lock.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub losses: Option<Losses>,
    /// Satellites that `losses` is about; absent means all.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub satellites: Option<Vec<Sv>>,
    /// Expectation about the size of the position errors.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub errors: Option<Sizes>,
    /// Bound of the three-dimensional position error in metres, independent of `errors`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub position_within_m: Option<f64>,
    /// Reason for the expectation, in the scene's words.
    pub reason: String,
}

/// Expectations from one time to another.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Interval {
    /// Start of the interval, in seconds since the start of the samples.
    pub from_s: f64,
    /// End of the interval, in seconds since the start of the samples.
    pub to_s: f64,
    /// Expectations during the interval.
    #[serde(flatten)]
    pub terms: Terms,
}

/// Table `[expect]`: expectations for the whole scene, and for intervals, which replace those for the whole.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Expect {
    /// Expectations for the whole scene.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub whole: Option<Terms>,
    /// Expectations for intervals; the last interval that covers a time applies.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub intervals: Vec<Interval>,
}

impl Expect {
    /// True if the scene declares no expectations.
    pub fn is_empty(&self) -> bool {
        self.whole.is_none() && self.intervals.is_empty()
    }

    /// Terms that apply at a time: the last of the intervals first, the whole scene's last.
    pub fn at(&self, time_s: f64) -> impl Iterator<Item = &Terms> {
        let within = move |interval: &&Interval| (interval.from_s..interval.to_s).contains(&time_s);
        self.intervals.iter().rev().filter(within).map(|interval| &interval.terms).chain(&self.whole)
    }

    /// Returns the expectation about fixes at a time.
    pub fn fix(&self, time_s: f64) -> Option<Fixes> {
        self.at(time_s).find_map(|terms| terms.fix)
    }

    /// Returns the expectation about a satellite's losses of lock at a time.
    pub fn losses(&self, sv: Sv, time_s: f64) -> Option<Losses> {
        let concerns = |terms: &&Terms| terms.satellites.as_ref().is_none_or(|list| list.contains(&sv));
        self.at(time_s).filter(concerns).find_map(|terms| terms.losses)
    }

    /// Terms at a time that bound the position error, with the bound in metres.
    pub fn position_within_m(&self, time_s: f64) -> Option<(&Terms, f64)> {
        self.at(time_s).find_map(|terms| Some((terms, terms.position_within_m?)))
    }

    /// True if errors at a time are judged.
    pub fn bounded(&self, time_s: f64) -> bool {
        self.at(time_s).find_map(|terms| terms.errors) != Some(Sizes::Any)
    }

    /// True if errors are judged at all times.
    pub fn always_bounded(&self) -> bool {
        let all = self.whole.iter().chain(self.intervals.iter().map(|interval| &interval.terms));
        all.filter_map(|terms| terms.errors).all(|sizes| sizes != Sizes::Any)
    }

    /// True if errors at a time are judged for estimates that depend on the last `memory_s` seconds.
    pub fn bounded_since(&self, time_s: f64, memory_s: f64) -> bool {
        let within = |interval: &&Interval| (interval.from_s..interval.to_s + memory_s).contains(&time_s);
        let any = |interval: &Interval| interval.terms.errors == Some(Sizes::Any);
        self.bounded(time_s) && !self.intervals.iter().filter(within).any(any)
    }
}

/// Kind of satellite fault, by the word that a scenario uses.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum FaultKind {
    /// A satellite's clock jumps.
    ClockStep,
    /// A satellite's clock runs away.
    ClockRamp,
    /// A satellite's clock is noisier than its message states.
    ClockNoise,
    /// A satellite is not where its message states.
    Orbit,
    /// Bits of the message are wrong at random.
    BitErrors,
    /// One bit of the message is wrong.
    Bit,
    /// The message states that the satellite is not healthy.
    Health,
    /// A parameter of the message is wrong.
    Parameter,
    /// The message states nothing but that something is wrong.
    Alert,
}

/// Something wrong with satellites or their messages.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Fault {
    /// Kind of the fault.
    pub kind: FaultKind,
    /// Absent means all.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub satellites: Option<Vec<Sv>>,
    /// Start of the fault, in seconds since the start of the samples.
    pub from_s: f64,
    /// End of the fault, in seconds since the start of the samples.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub to_s: Option<f64>,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_interval_of_any_errors_is_remembered_as_long_as_memory_lasts() {
        let terms = Terms { errors: Some(Sizes::Any), ..Terms::default() };
        let expect = Expect { whole: None, intervals: vec![Interval { from_s: 10.0, to_s: 20.0, terms }] };
        let bounded = [9.9, 10.0, 19.9, 20.0, 29.9, 30.0].map(|t_s| expect.bounded_since(t_s, 10.0));
        assert_eq!(bounded, [true, false, false, false, false, true]);
        assert!(expect.bounded(20.0));
    }

    #[test]
    fn an_interval_replaces_what_the_whole_scene_says_and_the_last_one_counts() {
        let terms = |fix, losses, satellites| Terms { fix, losses, satellites, ..Terms::default() };
        let interval = |from_s, to_s, terms| Interval { from_s, to_s, terms };
        let expect = Expect {
            whole: Some(terms(Some(Fixes::Required), None, None)),
            intervals: vec![
                interval(10.0, 20.0, terms(Some(Fixes::None), Some(Losses::Any), None)),
                interval(15.0, 18.0, terms(None, Some(Losses::None), Some(vec![Sv::gps(3)]))),
            ],
        };
        let fixes = [9.9, 10.0, 19.9, 20.0].map(|t_s| expect.fix(t_s));
        assert_eq!(fixes, [Fixes::Required, Fixes::None, Fixes::None, Fixes::Required].map(Some));
        assert_eq!(expect.losses(Sv::gps(3), 16.0), Some(Losses::None));
        assert_eq!(expect.losses(Sv::gps(4), 16.0), Some(Losses::Any));
        assert_eq!(expect.losses(Sv::gps(4), 25.0), None);
        let near = Terms { position_within_m: Some(5.0), ..Terms::default() };
        let bounded = Expect { whole: Some(near), ..expect.clone() };
        assert_eq!(
            (expect.position_within_m(12.0), bounded.position_within_m(12.0).map(|(_, m)| m)),
            (None, Some(5.0))
        );
        assert!(expect.bounded(12.0) && !expect.is_empty() && Expect::default().is_empty());
        let json = serde_json::to_string(&expect).unwrap();
        assert_eq!(serde_json::from_str::<Expect>(&json).unwrap(), expect);
    }
}
