//! Presence of a satellite in the scene's sky, and the reason for its absence.
//!
//! A satellite sets, hides behind the Earth, or has nothing to send because no ephemeris of the navigation
//! file fits. The last is a limit of the data and not of nature, so it has its own name in the plan, in the
//! warnings and in `truth/passes.csv`. Limit: while nothing is sent, the sky is that of the nearest
//! ephemeris, for half a day at most.

use std::ops::Range;

use crate::catalogue::{Catalogue, Silence};
use crate::ray::SPACE_M;
use crate::scene::Scene;
use crate::sky::{Emission, emission, emission_of_set};
use crate::vehicle::Motion;
use gnss::broadcast::OrbitError;
use gnss::record::{PassEnd, PassRow};
use gnss::satellite::Sv;
use gnss::time::Epoch;

/// Largest time in seconds from its reference time for which an ephemeris decides on the mask. Half a day
/// on, real ephemerides of two days are some kilometres off: 1e-4 rad of elevation.
const EXTRAPOLATED_S: f64 = 43_200.0;
/// Spacing of the instants at which the sky without an ephemeris is looked at: satellites move 5° in it.
const LOOK_S: f64 = 600.0;

/// Presence of a satellite in the sky.
#[derive(Clone, Debug)]
pub enum Presence {
    /// Satellite in view, with the time and position of emission.
    InView(Box<Emission>),
    /// Satellite below the elevation mask.
    BelowMask,
    /// Satellite behind the Earth, as seen from space.
    BehindEarth,
    /// Satellite without an ephemeris at this time: none in the navigation file is sent, or precise orbits
    /// have none.
    NoEphemeris,
}

impl Presence {
    /// Reason for which a view ends if this state follows, or begins if it comes before; `None` while in
    /// view.
    pub fn end(&self) -> Option<PassEnd> {
        match self {
            Self::InView(_) => None,
            Self::BelowMask => Some(PassEnd::Mask),
            Self::BehindEarth => Some(PassEnd::Earth),
            Self::NoEphemeris => Some(PassEnd::Ephemeris),
        }
    }
}

/// Computes the presence of `sv` for an antenna with `motion` at true time `time`. A satellite that the scene
/// excludes counts as present.
///
/// # Errors
/// Errors of the orbit.
pub fn presence(scene: &Scene, sv: Sv, time: Epoch, motion: &Motion) -> Result<Presence, OrbitError> {
    presence_in(scene, &scene.catalogue, sv, time, motion)
}

/// [`presence`] of a satellite of a catalogue, which may be a spoofer's.
///
/// # Errors
/// Errors of the orbit.
pub fn presence_in(
    scene: &Scene,
    catalogue: &Catalogue,
    sv: Sv,
    time: Epoch,
    motion: &Motion,
) -> Result<Presence, OrbitError> {
    if catalogue.sent_at(sv, time).is_none() {
        return Ok(Presence::NoEphemeris);
    }
    Ok(match emission(catalogue, sv, time, motion)? {
        None => Presence::NoEphemeris,
        Some(emission) if scene.sees(&emission.sight) => Presence::InView(Box::new(emission)),
        Some(emission) if emission.sight.user.height_m < SPACE_M => Presence::BelowMask,
        Some(_) => Presence::BehindEarth,
    })
}

/// Satellite that would be in view while it has nothing to send.
#[derive(Clone, Debug, PartialEq)]
pub struct Missing {
    /// Satellite that has nothing to send.
    pub sv: Sv,
    /// End and new beginning of the ephemerides, as far as the navigation file has any there.
    pub silence: Silence,
}

/// Finds the satellites that the scene, of length `end_s`, lacks because there is no ephemeris.
///
/// # Errors
/// Errors of the orbit.
pub fn missing(scene: &Scene, end_s: f64) -> Result<Vec<Missing>, OrbitError> {
    let (start, end) = (scene.clock.start, scene.clock.start.plus_s(end_s));
    let mut found = Vec::new();
    for sv in scene.senders() {
        for silence in scene.catalogue.silences(sv, start, end) {
            if would_be_seen(scene, sv, &silence, end_s)? {
                found.push(Missing { sv, silence });
            }
        }
    }
    Ok(found)
}

fn would_be_seen(scene: &Scene, sv: Sv, silence: &Silence, end_s: f64) -> Result<bool, OrbitError> {
    let start = scene.clock.start;
    let from_s = silence.from.map_or(0.0, |from| from.since(start).max(0.0));
    let until_s = silence.until.map_or(end_s, |until| until.since(start).min(end_s));
    let looks = ((until_s - from_s) / LOOK_S).ceil().max(1.0) as u64;
    for k in 0..=looks {
        let t_s = from_s + (until_s - from_s) * k as f64 / looks as f64;
        let at = start.plus_s(t_s);
        let Some(set) = scene.catalogue.nearest_set(sv, at) else { continue };
        if !set.is_healthy() || at.since(set.toe).abs() > EXTRAPOLATED_S {
            continue;
        }
        let found = emission_of_set(set, at, &scene.trajectory.at(t_s))?;
        if found.is_some_and(|emission| scene.sees(&emission.sight)) {
            return Ok(true);
        }
    }
    Ok(false)
}

/// Warning text if the navigation file does not cover the scene, which begins at `start`.
pub fn warning(missing: &[Missing], start: Epoch) -> Option<String> {
    let mut groups: Vec<(Silence, Vec<String>)> = Vec::new();
    for Missing { sv, silence } in missing {
        match groups.iter_mut().find(|(known, _)| known == silence) {
            Some((_, names)) => names.push(sv.to_string()),
            None => groups.push((*silence, vec![sv.to_string()])),
        }
    }
    let instant = |at: Epoch| format!("{at} GPST ({:.1} s)", at.since(start));
    let parts: Vec<String> = groups
        .iter()
        .map(|(Silence { from, until }, names)| {
            let names = names.join(", ");
            match (from, until) {
                (Some(from), Some(until)) => format!("{names} from {} to {}", instant(*from), instant(*until)),
                (Some(from), None) => format!("{names} from {} on", instant(*from)),
                (None, Some(until)) => format!("{names} before {}", instant(*until)),
                (None, None) => names,
            }
        })
        .collect();
    (!parts.is_empty()).then(|| {
        format!(
            "the navigation file does not cover the scene: in the sky but without an ephemeris, and so not sent: {}; \
             [navigation] file names files that hold these times, or choose another start or duration_s",
            parts.join("; ")
        )
    })
}

/// Intervals in which one satellite was in view, collected second by second.
#[derive(Clone, Debug, Default)]
pub struct Passes {
    /// First sample of the pass that continues, and the state before it. The other passes are complete.
    open: Option<(u64, PassEnd)>,
    /// Reason for the absence of the satellite at the last check; `None` before the first check.
    absent: Option<PassEnd>,
    whole: Vec<(u64, u64, PassEnd, PassEnd)>,
}

impl Passes {
    /// Records the presence at the next `sample`. Returns true if the satellite is in view.
    pub fn look(&mut self, sample: u64, presence: &Presence) -> bool {
        match (presence.end(), self.open) {
            (None, None) => self.open = Some((sample, self.absent.unwrap_or(PassEnd::Scene))),
            (Some(end), Some((since, begin))) => {
                self.whole.push((since, sample, begin, end));
                self.open = None;
            }
            _ => {}
        }
        self.absent = presence.end().or(self.absent);
        presence.end().is_none()
    }

    /// Rows of `part` of the scene, counted from its first sample.
    pub fn rows(&self, sv: Sv, part: &Range<u64>) -> impl Iterator<Item = PassRow> {
        let open = self.open.map(|(since, begin)| (since, u64::MAX, begin, PassEnd::Scene));
        let all = self.whole.iter().copied().chain(open);
        let (first, last) = (part.start, part.end);
        all.filter(move |(since, until, ..)| *since < last && *until > first).map(move |(since, until, begin, end)| {
            PassRow {
                sv,
                sample: since.max(first) - first,
                until_sample: until.min(last) - first,
                begins_by: if since <= first { PassEnd::Scene } else { begin },
                ends_by: if until >= last { PassEnd::Scene } else { end },
            }
        })
    }
}
