//! Timetable of the navigation message, unit by unit: subframes of LNAV, pages of I/NAV.
//!
//! All satellites of a system send in step with its time. The scene's start alone therefore determines how
//! long a receiver must wait. Times are seconds from the scene's first sample. A symbol that is sent at a
//! boundary arrives a light time later.

use std::collections::BTreeSet;

use gnss::message::Message;
use gnss::signal::Signal;
use gnss::time::Epoch;

/// Time in seconds that shows the beginning of a unit while its time is unknown: the two words at the
/// beginning of the next subframe.
const HEADER_S: f64 = 1.2;
/// Times of arrival of satellites around the Earth, at most: a geostationary user across the Earth.
const LIGHT_S: f64 = 0.25;
/// Units that are looked through for one: two rounds of LNAV's pages.
const LARGEST_UNITS: i64 = 250;

/// The timetable as seen from a scene's first sample.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Timetable<'r> {
    message: Option<&'static Message>,
    /// Message of another signal of the satellite, where this one's states neither its time nor its orbit.
    dating: Option<&'static Message>,
    /// The first sample, by the clock of the system that sends.
    start: Epoch,
    /// Times at which the satellite begins to send another ephemeris, seconds, ascending.
    renewals_s: &'r [f64],
}

impl<'r> Timetable<'r> {
    /// Timetable of a signal in a scene whose first sample was taken at `start`.
    pub fn new(signal: &Signal, start: Epoch) -> Self {
        let message = signal.components.iter().find_map(|component| component.message);
        Self { message, dating: None, start: signal.time.label(start), renewals_s: &[] }
    }

    /// Timetable beside other signals, of which one may have to give time and orbit.
    pub fn beside(signal: &'static Signal, signals: &BTreeSet<&'static Signal>, start: Epoch) -> Self {
        let undated = !signal.is_dated();
        let dating =
            signal.dated_by(signals.iter().copied()).find_map(|other| other.components.iter().find_map(|c| c.message));
        Self { dating: dating.filter(|_| undated), ..Self::new(signal, start) }
    }

    /// Timetable for a satellite that begins to send another ephemeris at each of these times, seconds,
    /// ascending.
    pub fn renewed(self, renewals_s: &'r [f64]) -> Self {
        Self { renewals_s, ..self }
    }

    /// Timetable of the message that states its time and the satellite's orbit.
    fn dated(&self) -> Self {
        Self { message: self.dating.or(self.message), dating: None, ..*self }
    }

    /// Time in seconds at which the first wanted unit is complete, among those that begin from `from_s` on.
    /// `wanted` selects units by their start. It is infinite if there is none.
    fn whole_by_s(&self, from_s: f64, wanted: impl Fn(&Message, Epoch) -> bool) -> f64 {
        let Some(message) = self.message else { return f64::INFINITY };
        let from = self.start.plus_s(from_s);
        let first = message.unit_at(from.seconds());
        let begins = |unit: &i64| message.unit_start(*unit).since(from) >= 0.0;
        let mut units = (first..first + LARGEST_UNITS).filter(begins).map(|unit| message.unit_start(unit));
        let found = units.find(|start| wanted(message, *start));
        let decided_s = message.unit_s as f64 + message.decided_after as f64 * message.symbol_s;
        found.map_or(f64::INFINITY, |start| start.since(self.start) + decided_s + LIGHT_S)
    }

    /// Time in seconds at which a channel locked since `locked_s` knows the beginnings of units, and their
    /// time.
    pub fn frame_by_s(&self, locked_s: f64) -> f64 {
        if self.dating.is_some() {
            let unit_s = self.whole_by_s(locked_s, |_, _| true) + HEADER_S;
            return unit_s.max(self.dated().frame_by_s(locked_s));
        }
        let one_s = self.whole_by_s(locked_s, |message, start| message.timed.contains(&(message.number)(start)));
        let dated = self.message.map_or(&[][..], |message| message.dated);
        self.all_by_s(dated, locked_s).max(one_s) + HEADER_S
    }

    /// Time in seconds at which the last of some units is complete, each the first of its number.
    fn all_by_s(&self, numbers: &[u8], locked_s: f64) -> f64 {
        let whole = |number: &u8| self.whole_by_s(locked_s, |message, start| (message.number)(start) == *number);
        numbers.iter().map(whole).fold(0.0, f64::max)
    }

    /// Time in seconds at which every unit of an ephemeris is complete. Units of two ephemerides do not
    /// combine: where a new one comes in between, it has to come from its beginning.
    pub fn ephemeris_by_s(&self, locked_s: f64) -> f64 {
        let dated = self.dated();
        let Some(message) = dated.message else { return f64::INFINITY };
        let from = |begin_s: f64| dated.all_by_s(message.set, begin_s);
        // A set is sent from the first of its units on: the rest of a frame belongs to the set before.
        let begin_s = |renewed_s: &f64| {
            let at = dated.start.plus_s(*renewed_s);
            let first = message.unit_at(at.seconds());
            let begins = |unit: &i64| message.unit_of_set(*unit) == *unit && message.unit_start(*unit).since(at) >= 0.0;
            let unit = (first..first + LARGEST_UNITS).find(begins)?;
            Some(message.unit_start(unit).since(dated.start))
        };
        self.renewals_s.iter().filter_map(begin_s).fold(from(locked_s), |whole_s, begin_s| {
            if locked_s < begin_s && begin_s < whole_s { from(begin_s) } else { whole_s }
        })
    }

    /// Time in seconds at which reduced elements are complete; infinite where the message has none.
    pub fn reduced_by_s(&self, locked_s: f64) -> f64 {
        self.dated().whole_by_s(locked_s, |message, start| message.reduced.contains(&(message.number)(start)))
    }

    /// Time in seconds at which the ionosphere is complete; infinite where the message does not carry it.
    pub fn ionosphere_by_s(&self, locked_s: f64) -> f64 {
        self.dated().whole_by_s(locked_s, |message, start| (message.ionosphere.unit)(start))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use gnss::galileo::e1::E1;
    use gnss::galileo::e6::E6;
    use gnss::gps::l1ca::L1_CA;
    use gnss::gps::l2c::L2C;
    use gnss::navic::sps::L5;
    use gnss::signal::synthetic::LONG_BOC;

    fn at(text: &str) -> Timetable<'static> {
        Timetable::new(&L1_CA, Epoch::parse(text).unwrap())
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
    fn units_of_two_sets_make_none() {
        // Locked within subframe 1, 26 s before new sets: subframes 2 and 3 are whole by 18 s, subframe 1 by
        // 36 s with the next issue, and with it 2 and 3 by 48 s.
        let timetable = at("2026-03-09T07:59:30").renewed(&[30.0]);
        assert!((timetable.ephemeris_by_s(4.0) - 48.0 - LIGHT_S).abs() < 1e-9, "{}", timetable.ephemeris_by_s(4.0));
        assert!((timetable.renewed(&[]).ephemeris_by_s(4.0) - 36.0 - LIGHT_S).abs() < 1e-9);
        assert_eq!(timetable.ephemeris_by_s(31.0), timetable.renewed(&[]).ephemeris_by_s(31.0));
    }

    #[test]
    fn a_set_that_begins_within_a_frame_is_sent_from_the_next_frame_on() {
        // Frames of NavIC, four subframes of 12 s, begin 6 s before the start and at 42 s. Subframe 2 is
        // whole by 18 s, subframe 1 by 54 s with the next issue, subframe 2 with it by 66 s.
        let timetable = Timetable::new(&L5, Epoch::parse("2026-03-09T11:08:54").unwrap());
        assert!((timetable.ephemeris_by_s(4.0) - 54.0 - LIGHT_S).abs() < 1e-9, "{}", timetable.ephemeris_by_s(4.0));
        let renewed = timetable.renewed(&[20.0]);
        assert!((renewed.ephemeris_by_s(4.0) - 66.0 - LIGHT_S).abs() < 1e-9, "{}", renewed.ephemeris_by_s(4.0));
        assert_eq!(timetable.renewed(&[60.0]).ephemeris_by_s(4.0), timetable.ephemeris_by_s(4.0));
    }

    #[test]
    fn no_start_waits_more_than_36_seconds_for_the_ephemeris_nor_12_minutes_and_36_seconds_for_the_page() {
        for second in 0..900 {
            let start = Epoch::parse("2010-07-01T08:00:00").unwrap().plus_s(f64::from(second));
            let timetable = Timetable::new(&L1_CA, start);
            let (orbit_s, page_s) = (timetable.ephemeris_by_s(0.0), timetable.ionosphere_by_s(0.0));
            assert!((18.0..=36.0 + LIGHT_S).contains(&orbit_s), "{second}: {orbit_s}");
            assert!((6.0..=756.0 + LIGHT_S).contains(&page_s), "{second}: {page_s}");
        }
    }

    #[test]
    fn a_code_that_runs_on_decides_a_message_by_the_symbols_after_it() {
        // Messages of L2C begin at 1, 13 and 25 s; the third has type 30. Eighty symbols of 20 ms follow.
        let timetable = Timetable::new(&L2C, Epoch::parse("2025-08-21T06:26:23").unwrap());
        assert!((timetable.ionosphere_by_s(0.0) - 37.0 - 1.6 - LIGHT_S).abs() < 1e-9);
    }

    #[test]
    fn a_signal_that_says_no_time_waits_for_the_one_that_gives_it() {
        let start = Epoch::parse("2020-11-29T12:50:30").unwrap();
        let both: BTreeSet<&'static Signal> = [&E1, &E6].into_iter().collect();
        let (dated, dating) = (Timetable::beside(&E6, &both, start), Timetable::new(&E1, start));
        assert_eq!(dated.frame_by_s(0.0), dating.frame_by_s(0.0));
        assert_eq!(dated.ephemeris_by_s(0.0), dating.ephemeris_by_s(0.0));
        assert_eq!(dated.ionosphere_by_s(3.0), dating.ionosphere_by_s(3.0));
        assert_eq!(Timetable::beside(&E1, &both, start), dating);
        // Nothing gives it: never.
        let alone: BTreeSet<&'static Signal> = [&E6].into_iter().collect();
        assert!(Timetable::beside(&E6, &alone, start).frame_by_s(0.0).is_infinite());
    }

    #[test]
    fn pages_of_a_system_that_is_three_seconds_behind_come_three_seconds_later() {
        // GPS time 08:05:58 is 08:05:55 there: word 5 from :55 on, words 2, 4 from 08:06:01, 1 and 3 from :21
        // and :23.
        let timetable = Timetable::new(&LONG_BOC, Epoch::parse("2010-07-01T08:05:58").unwrap());
        assert!((timetable.frame_by_s(0.0) - 2.0 - HEADER_S - LIGHT_S).abs() < 1e-9);
        assert!((timetable.ephemeris_by_s(0.0) - 30.0 - LIGHT_S).abs() < 1e-9);
        // Word 5 has the ionosphere too.
        assert!((timetable.ionosphere_by_s(0.0) - 2.0 - LIGHT_S).abs() < 1e-9);
        // Word 16 from :59 on, and from 08:06:15 on.
        assert!((timetable.reduced_by_s(0.0) - 6.0 - LIGHT_S).abs() < 1e-9);
        assert!((timetable.reduced_by_s(5.0) - 22.0 - LIGHT_S).abs() < 1e-9);
        assert!(at("2010-07-01T08:05:58").reduced_by_s(0.0).is_infinite());
    }
}
