//! When the navigation message says what: subframes of 6 s in frames of 30 s, 25 frames in a round of 12.5 minutes.
//!
//! All satellites send in step with GPS time (IS-GPS-200N, 20.3.2), so the scene's start alone says how long
//! a receiver must wait. Times are seconds from the scene's first sample; what is sent at a boundary arrives
//! a light time later.

use crate::gnss::time::Epoch;

/// Length of a subframe and of a frame.
const SUBFRAME_S: f64 = 6.0;
const FRAME_S: f64 = 30.0;
/// Frames in a round, and the one whose subframe 4 carries the ionosphere (20.3.3.5.1.7), counted from 0.
const ROUND: i64 = 25;
const IONOSPHERE_FRAME: i64 = 17;
/// The first two words of a subframe: preamble and time.
const HEADER_S: f64 = 1.2;
/// Times of arrival of satellites around the Earth, at most: a geostationary user across the Earth.
const LIGHT_S: f64 = 0.25;

/// The timetable as seen from a scene's first sample.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Timetable {
    /// Time since the last beginning of a round when the first sample was taken.
    phase_s: f64,
}

impl Timetable {
    /// Of a scene whose first sample was taken then.
    pub fn new(start: Epoch) -> Self {
        let round_s = ROUND as f64 * FRAME_S;
        let tow_s = start.tow_whole_s() as f64 + start.fraction();
        // A week is not a whole number of rounds: pages begin anew with it (20.3.3.5.1).
        Self { phase_s: tow_s - (tow_s / round_s).floor() * round_s }
    }

    /// The first time from `from_s` on at which something that comes every `period_s`, first `first_s` after
    /// a round's beginning, begins.
    fn next(&self, from_s: f64, first_s: f64, period_s: f64) -> f64 {
        let since = from_s + self.phase_s - first_s;
        from_s + (since / period_s).ceil() * period_s - since
    }

    /// When two headers in succession have arrived whole for a channel locked since `locked_s`: the frame is known.
    pub fn frame_by_s(&self, locked_s: f64) -> f64 {
        self.next(locked_s, 0.0, SUBFRAME_S) + SUBFRAME_S + HEADER_S + LIGHT_S
    }

    /// When subframes 1 to 3 have arrived whole.
    pub fn ephemeris_by_s(&self, locked_s: f64) -> f64 {
        let whole = |subframe: u32| self.next(locked_s, f64::from(subframe - 1) * SUBFRAME_S, FRAME_S) + SUBFRAME_S;
        (1..=3).map(whole).fold(0.0, f64::max) + LIGHT_S
    }

    /// When the ionosphere's page has arrived whole: page 18 of subframe 4.
    pub fn ionosphere_by_s(&self, locked_s: f64) -> f64 {
        let first_s = IONOSPHERE_FRAME as f64 * FRAME_S + 3.0 * SUBFRAME_S;
        self.next(locked_s, first_s, ROUND as f64 * FRAME_S) + SUBFRAME_S + LIGHT_S
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(text: &str) -> Timetable {
        Timetable::new(Epoch::parse(text).unwrap())
    }

    #[test]
    fn the_static_scene_begins_two_seconds_before_a_frame_whose_page_is_18() {
        let timetable = at("2010-07-01T08:05:58");
        // Locked at once: subframes 1 to 3 from 2 to 20 s, the page from 20 to 26 s.
        assert!((timetable.ephemeris_by_s(0.0) - 20.0 - LIGHT_S).abs() < 1e-9);
        assert!((timetable.ionosphere_by_s(0.0) - 26.0 - LIGHT_S).abs() < 1e-9);
        assert!((timetable.frame_by_s(0.0) - 9.2 - LIGHT_S).abs() < 1e-9);
        // Locked within subframe 1: it is missed, and comes whole 30 s later.
        assert!((timetable.ephemeris_by_s(4.0) - 38.0 - LIGHT_S).abs() < 1e-9);
        assert!((timetable.ionosphere_by_s(21.0) - 776.0 - LIGHT_S).abs() < 1e-9);
    }

    #[test]
    fn no_start_waits_more_than_36_seconds_for_the_ephemeris_nor_12_minutes_and_36_seconds_for_the_page() {
        for second in 0..900 {
            let timetable = Timetable::new(Epoch::parse("2010-07-01T08:00:00").unwrap().plus_s(f64::from(second)));
            let (orbit_s, page_s) = (timetable.ephemeris_by_s(0.0), timetable.ionosphere_by_s(0.0));
            assert!((18.0..=36.0 + LIGHT_S).contains(&orbit_s), "{second}: {orbit_s}");
            assert!((6.0..=756.0 + LIGHT_S).contains(&page_s), "{second}: {page_s}");
        }
    }
}
