//! Galileo System Time (GST) as OSNMA counts it: weeks of 12 bits and seconds of the week, and sub-frames of
//! 30 s.
//!
//! Source: Galileo OSNMA SIS ICD 1.1, 3.2 and table 12. Limits: whole seconds; the week is the one that the
//! signal sends, so a time is unique within 4096 weeks.

use std::fmt;

/// Seconds of a week.
pub const WEEK_S: u32 = 604_800;
/// Duration of a sub-frame, in seconds.
pub const SUBFRAME_S: i64 = 30;
/// Weeks that the field of the week counts.
const WEEKS: i64 = 4096;

/// Instant of GST, in whole seconds since its first week began.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Gst(i64);

impl Gst {
    /// Instant of a week and a second of it.
    pub fn new(week: u16, tow_s: u32) -> Self {
        Self(i64::from(week) * i64::from(WEEK_S) + i64::from(tow_s))
    }

    /// Instant that many seconds after week 0 began.
    pub const fn of_seconds(seconds: i64) -> Self {
        Self(seconds)
    }

    /// Seconds since the beginning of week 0.
    pub fn seconds(self) -> i64 {
        self.0
    }

    /// Number of the week, as 12 bits send it.
    pub fn week(self) -> u16 {
        self.0.div_euclid(i64::from(WEEK_S)).rem_euclid(WEEKS) as u16
    }

    /// Second of the week.
    pub fn tow_s(self) -> u32 {
        self.0.rem_euclid(i64::from(WEEK_S)) as u32
    }

    /// Beginning of the sub-frame in which this instant is.
    pub fn subframe(self) -> Self {
        Self(self.0.div_euclid(SUBFRAME_S) * SUBFRAME_S)
    }

    /// Instant that many sub-frames later.
    pub fn later(self, subframes: i64) -> Self {
        Self(self.0 + SUBFRAME_S * subframes)
    }

    /// Seconds from another instant to this one.
    pub fn since_s(self, other: Self) -> i64 {
        self.0 - other.0
    }

    /// Week of 12 bits and second of the week of 20 bits, as hash and tag take them (ICD, 6.4 and 6.7).
    pub fn bytes(self) -> [u8; 4] {
        (u32::from(self.week()) << 20 | self.tow_s()).to_be_bytes()
    }

    /// Half of the GST minute: 0 for a sub-frame that begins with the minute, 1 for the other (ICD, annex C).
    pub fn half(self) -> usize {
        usize::from(self.tow_s() / 30 % 2 == 1)
    }
}

impl fmt::Display for Gst {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "week {} TOW {}", self.week(), self.tow_s())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_subframe_before_the_weeks_end_is_followed_by_the_next_weeks_first() {
        let last = Gst::new(1250, 604_799).subframe();
        assert_eq!((last.week(), last.tow_s()), (1250, 604_770));
        assert_eq!((last.later(1).week(), last.later(1).tow_s()), (1251, 0));
        assert_eq!(last.later(1).half(), 0);
        assert_eq!(last.half(), 1);
    }

    #[test]
    fn week_and_second_fill_four_bytes() {
        assert_eq!(Gst::new(0x4e3, 277_200).bytes(), [0x4e, 0x34, 0x3a, 0xd0]);
    }
}
