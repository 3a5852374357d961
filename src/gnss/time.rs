//! GPS time as whole seconds and a fraction, and the exact time of samples.
//!
//! One `f64` of seconds since 1980 resolves only 0.2 µs (71 m), so an [`Epoch`] keeps the
//! whole seconds as an integer: its resolution is 1e-16 s everywhere. Calendar dates and leap
//! seconds come from the `hifitime` crate and are met only at the edges (files, labels).

use std::fmt;

use serde::{Deserialize, Serialize};
use thiserror::Error;

/// Seconds in a GPS week (IS-GPS-200N, 3.3.4).
pub const WEEK_S: i64 = 604_800;
/// Seconds around a leap second within which tables and labels are looked at twice.
const LEAP_SEARCH_S: i64 = 60;

/// Instant of GPS time: whole seconds since 1980-01-06T00:00:00 and a fraction in [0, 1).
#[derive(Clone, Copy, Debug, PartialEq, PartialOrd, Serialize, Deserialize)]
pub struct Epoch {
    seconds: i64,
    fraction: f64,
}

/// Time scale of a satellite system, which determines the timing of its codes and messages.
///
/// An [`Epoch`] stays GPS time; what a system's clock shows is some whole seconds less by definition, and off
/// by nanoseconds in truth. In an inserted second a scale with leap seconds shows the second after it, twice.
#[derive(Debug, PartialEq, Eq)]
pub struct TimeScale {
    /// Name, such as GPST.
    pub name: &'static str,
    /// Whole seconds by which the scale is behind GPS time; for a scale with leap seconds, behind UTC.
    pub behind_gpst_s: i64,
    /// True if the scale has leap seconds, as UTC does.
    pub has_leap_seconds: bool,
}

impl TimeScale {
    /// Converts an instant to this scale: an [`Epoch`] whose week and seconds are the scale's own.
    pub fn label(&self, at: Epoch) -> Epoch {
        Epoch { seconds: at.seconds - self.behind_s(at), ..at }
    }

    /// Converts from this scale: the instant at which its clock shows `label`.
    pub fn instant(&self, label: Epoch) -> Epoch {
        let utc = label.seconds + self.behind_gpst_s;
        let leap_s = if self.has_leap_seconds { Epoch::leap_seconds_of_label(utc) } else { 0 };
        Epoch { seconds: utc + leap_s, ..label }
    }

    /// Whole seconds by which the scale is behind GPS time at an instant.
    pub fn behind_s(&self, at: Epoch) -> i64 {
        let leap_s = if self.has_leap_seconds { at.leap_seconds() } else { 0 };
        self.behind_gpst_s + planted!("gnss.time.scale_leaps", leap_s, 0)
    }
}

/// GPS time (IS-GPS-200N, 3.3.4).
pub static GPST: TimeScale = TimeScale { name: "GPST", behind_gpst_s: 0, has_leap_seconds: false };

/// Galileo system time; its weeks begin with those of GPS (Galileo OS SIS ICD 2.1, 5.1.2).
pub static GST: TimeScale = TimeScale { name: "GST", behind_gpst_s: 0, has_leap_seconds: false };

/// IRNSS network time; its weeks begin with those of GPS (IRNSS SIS ICD for SPS 1.1, system time).
pub static IRNSST: TimeScale = TimeScale { name: "IRNSST", behind_gpst_s: 0, has_leap_seconds: false };

/// QZSS time; its weeks begin with those of GPS (IS-QZSS-PNT-005, 3.1.4).
pub static QZSST: TimeScale = TimeScale { name: "QZSST", behind_gpst_s: 0, has_leap_seconds: false };

/// BeiDou time: UTC of 2006-01-01, when GPS time was 14 s ahead of it (BDS-SIS-ICD-B1I 3.0, 3.3).
pub static BDT: TimeScale = TimeScale { name: "BDT", behind_gpst_s: 14, has_leap_seconds: false };

/// Number of the GPS week in which BDT began: week 0 of BDT.
pub const BDT_WEEK: i64 = 1356;

/// GLONASS time: three hours ahead of UTC(SU), leap seconds included (GLONASS ICD L1, L2 5.1, 3.3.3).
pub static GLONASST: TimeScale = TimeScale { name: "GLONASST", behind_gpst_s: -10_800, has_leap_seconds: true };

/// UTC, by which RINEX dates GLONASS.
pub static UTC: TimeScale = TimeScale { name: "UTC", behind_gpst_s: 0, has_leap_seconds: true };

/// Offset between two time scales in seconds, without the whole seconds between them: `a0 + a1 (t −
/// reference)`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TimePolynomial {
    /// Seconds ahead at the reference time.
    pub a0_s: f64,
    /// Rate of that, s/s.
    pub a1_sps: f64,
    /// Reference time.
    pub reference: Epoch,
}

impl TimePolynomial {
    /// Seconds ahead at an instant.
    pub fn at_s(&self, at: Epoch) -> f64 {
        self.a0_s + self.a1_sps * at.since(self.reference)
    }
}

/// Error for a text that is not an instant.
#[derive(Debug, Error, PartialEq)]
#[error(
    "'{text}' is not a time: expected GPS time like 2010-07-01T08:12:30, or UTC with a final Z, from 1980-01-06 to 2180"
)]
pub struct TimeError {
    text: String,
}

impl Epoch {
    /// Creates the instant `seconds + fraction` after 1980-01-06T00:00:00 GPST. Any finite fraction is
    /// carried over.
    pub fn new(seconds: i64, fraction: f64) -> Self {
        let carry = fraction.floor();
        let rest = fraction - carry;
        // A tiny negative fraction rounds to exactly 1.0 here.
        if rest >= 1.0 {
            Self { seconds: seconds.saturating_add(carry as i64).saturating_add(1), fraction: 0.0 }
        } else {
            Self { seconds: seconds.saturating_add(carry as i64), fraction: rest }
        }
    }

    /// Creates the instant at `tow_s` seconds of the (continuous, not modulo 1024) GPS week.
    pub fn from_week(week: u32, tow_s: f64) -> Self {
        Self::new((i64::from(week) + planted!("gnss.time.week", 0, 1)) * WEEK_S, 0.0).plus_s(tow_s)
    }

    /// Parses `YYYY-MM-DDThh:mm:ss[.f]` as GPS time, or as UTC when it ends in `Z`.
    pub fn parse(text: &str) -> Result<Self, TimeError> {
        let error = || TimeError { text: text.to_owned() };
        let (body, utc) = text.trim().strip_suffix('Z').map_or((text.trim(), false), |body| (body, true));
        let (date, clock) = body.split_once(['T', ' ']).ok_or_else(error)?;
        let mut date = date.splitn(3, '-');
        let mut clock = clock.splitn(3, ':');
        let mut next = |from_date: bool| if from_date { date.next() } else { clock.next() }.ok_or_else(error);
        let year: i32 = next(true)?.parse().map_err(|_| error())?;
        let month: u8 = next(true)?.parse().map_err(|_| error())?;
        let day: u8 = next(true)?.parse().map_err(|_| error())?;
        let hour: u8 = next(false)?.parse().map_err(|_| error())?;
        let minute: u8 = next(false)?.parse().map_err(|_| error())?;
        let second_text = next(false)?;
        let (whole, fraction) = second_text.split_once('.').unwrap_or((second_text, ""));
        let second: u8 = whole.parse().map_err(|_| error())?;
        if !fraction.bytes().all(|b| b.is_ascii_digit()) {
            return Err(error());
        }
        let fraction: f64 =
            if fraction.is_empty() { 0.0 } else { format!("0.{fraction}").parse().map_err(|_| error())? };
        // The sixtieth second is UTC's alone, and there only where one was inserted: it comes after the
        // fifty-ninth.
        let inserted = second == 60;
        if !(1980..=2180).contains(&year) || hour > 23 || minute > 59 || second > 60 || (inserted && !utc) {
            return Err(error());
        }
        let second = if inserted { 59 } else { second };
        let gps = hifitime::TimeScale::GPST;
        let epoch = hifitime::Epoch::maybe_from_gregorian(year, month, day, hour, minute, second, 0, gps)
            .map_err(|_| error())?;
        let label = i64::try_from(epoch.duration.total_nanoseconds() / 1_000_000_000).map_err(|_| error())?;
        let leap = if utc { Self::leap_seconds_of_label(label) } else { 0 };
        if epoch.duration.total_nanoseconds() < 0 || (inserted && Self::leap_seconds_of_label(label + 1) != leap + 1) {
            return Err(error());
        }
        Ok(Self::new(label + leap + i64::from(inserted), fraction))
    }

    /// GPS time minus UTC where UTC's calendar reads `label` seconds after 1980-01-06.
    fn leap_seconds_of_label(label: i64) -> i64 {
        let later = Self::new(label + LEAP_SEARCH_S, 0.0).leap_seconds();
        let here = Self::new(label + later, 0.0).leap_seconds();
        if here == later { later } else { here }
    }

    /// Whole seconds since 1980-01-06T00:00:00 GPST.
    pub fn seconds(self) -> i64 {
        self.seconds
    }

    /// Seconds after [`Self::seconds`], in [0, 1).
    pub fn fraction(self) -> f64 {
        self.fraction
    }

    /// Continuous GPS week number.
    pub fn week(self) -> i64 {
        self.seconds.div_euclid(WEEK_S)
    }

    /// Time of week in seconds. Its resolution is 6e-11 s at the week's end, which is too coarse for code
    /// phase.
    pub fn tow_s(self) -> f64 {
        self.tow_whole_s() as f64 + self.fraction
    }

    /// Whole seconds of the week, 0..604 800.
    pub fn tow_whole_s(self) -> i64 {
        self.seconds.rem_euclid(WEEK_S)
    }

    /// Instant nearest to this one whose whole second of the week is `tow_s`.
    pub fn nearest_tow(self, tow_s: i64) -> Self {
        let ahead_s = (tow_s - self.tow_whole_s() + WEEK_S / 2).rem_euclid(WEEK_S) - WEEK_S / 2;
        Self::new(self.seconds + ahead_s, 0.0)
    }

    /// Number of the week nearest to this instant that equals `count` modulo `modulus`.
    pub fn nearest_week(self, count: i64, modulus: i64) -> i64 {
        self.week() + (count - self.week() + modulus / 2).rem_euclid(modulus) - modulus / 2
    }

    /// The instant `dt_s` later (or earlier, if negative).
    pub fn plus_s(self, dt_s: f64) -> Self {
        let whole = dt_s.floor();
        Self::new(self.seconds.saturating_add(whole as i64), self.fraction + (dt_s - whole))
    }

    /// Seconds from `earlier` to `self`; exact to 1e-16 s while they are within a second.
    pub fn since(self, earlier: Self) -> f64 {
        self.seconds.saturating_sub(earlier.seconds) as f64 + (self.fraction - earlier.fraction)
    }

    fn hifitime(self, scale: hifitime::TimeScale) -> hifitime::Epoch {
        let nanoseconds = self.seconds as i128 * 1_000_000_000 + (self.fraction * 1e9) as i128;
        hifitime::Epoch::from_duration(
            hifitime::Duration::from_total_nanoseconds(nanoseconds),
            hifitime::TimeScale::GPST,
        )
        .to_time_scale(scale)
    }

    /// Text `YYYY-MM-DDThh:mm:ss.ssssssZ` in UTC; an inserted second has the number 60.
    pub fn to_utc_text(self) -> String {
        let leap = self.leap_seconds();
        let inserted = Self { seconds: self.seconds + 1, ..self }.leap_seconds() - leap;
        let label = Self { seconds: self.seconds - leap - inserted, ..self };
        let (y, m, d, hh, mm, ss, ns) =
            label.hifitime(hifitime::TimeScale::GPST).to_gregorian(hifitime::TimeScale::GPST);
        let ss = i64::from(ss) + inserted;
        format!("{y:04}-{m:02}-{d:02}T{hh:02}:{mm:02}:{ss:02}.{:06}Z", ns / 1000)
    }

    /// Calendar month in GPS time, from 1, and hours of the day.
    pub fn month_and_hour(self) -> (u8, f64) {
        let (_, month, ..) = self.hifitime(hifitime::TimeScale::GPST).to_gregorian(hifitime::TimeScale::GPST);
        (month, (self.seconds.rem_euclid(86_400) as f64 + self.fraction) / 3600.0)
    }

    /// UTC calendar date of this instant and its day of the year counted from 1.0.
    pub fn day_of_year(self) -> f64 {
        self.hifitime(hifitime::TimeScale::UTC).day_of_year()
    }

    /// GPS time minus UTC in whole seconds at this instant. The new number applies from the end of an
    /// inserted second on.
    pub fn leap_seconds(self) -> i64 {
        // The crate holds UTC times against atomic time, and so changes over up to 37 s early.
        let table = |seconds: i64| {
            let at = Self { seconds, ..self }.hifitime(hifitime::TimeScale::UTC);
            // TAI - GPST is 19 s by definition.
            at.leap_seconds(true).map_or(0, |tai_utc| tai_utc as i64 - 19)
        };
        let (before, after) = (table(self.seconds - LEAP_SEARCH_S), table(self.seconds));
        let midnight_comes = (self.seconds - after).rem_euclid(86_400) > 43_200;
        (if before != after && midnight_comes { before } else { after }) + planted!("gnss.time.leap_seconds", 0, 1)
    }
}

impl fmt::Display for Epoch {
    /// `YYYY-MM-DDThh:mm:ss.ssssss`, in GPS time.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (y, m, d, hh, mm, ss, ns) =
            self.hifitime(hifitime::TimeScale::GPST).to_gregorian(hifitime::TimeScale::GPST);
        write!(f, "{y:04}-{m:02}-{d:02}T{hh:02}:{mm:02}:{ss:02}.{:06}", ns / 1000)
    }
}

/// Sample rate as an exact fraction of integers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Rate {
    samples: u64,
    seconds: u64,
}

impl Rate {
    /// 1 MHz.
    pub const MEGAHERTZ: Self = Self { samples: 1_000_000, seconds: 1 };

    /// Creates a rate from hertz, exact to the millihertz; `None` unless it is positive and below 1 THz.
    pub fn from_hz(hz: f64) -> Option<Self> {
        if !(hz.is_finite() && (1e-3..1e12).contains(&hz)) {
            return None;
        }
        let milli = (hz * 1000.0).round() as u64;
        Some(if milli.is_multiple_of(1000) {
            Self { samples: milli / 1000, seconds: 1 }
        } else {
            Self { samples: milli, seconds: 1000 }
        })
    }

    /// The rate in hertz.
    pub fn hz(self) -> f64 {
        self.samples as f64 / self.seconds as f64
    }

    /// The rate as samples in so many seconds.
    pub fn ratio(self) -> (u64, u64) {
        (self.samples, self.seconds)
    }

    /// Time from sample 0 to sample `n`: whole seconds and a fraction in [0, 1), exact.
    pub fn elapsed(self, n: u64) -> (i64, f64) {
        let ticks = u128::from(n) * u128::from(self.seconds);
        let whole = ticks / u128::from(self.samples);
        let rest = ticks % u128::from(self.samples);
        (whole as i64, rest as f64 / self.samples as f64)
    }

    /// Time from sample 0 to sample `n` in seconds, as one number. Its resolution is 1e-16 of its size.
    pub fn elapsed_s(self, n: u64) -> f64 {
        let (whole, fraction) = self.elapsed(n);
        whole as f64 + fraction
    }

    /// Whole turns, and 2^-64 turns, at sample `n` of a repetition with `count` turns in `seconds`. It is
    /// exact up to 1e14 samples, 1e12 turns and 1e13 seconds.
    pub fn turns(self, n: u64, count: u64, seconds: u64) -> (i64, u64) {
        let turns = u128::from(n) * u128::from(self.seconds) * u128::from(count);
        let one = u128::from(self.samples) * u128::from(seconds);
        let (whole, rest) = (turns / one, turns % one);
        // The divisor is below 2^80, so 64 bits come in two pieces.
        let (high, low) = ((rest << 48) / one, (rest << 48) % one);
        (whole as i64, ((high << 16) | ((low << 16) / one)) as u64)
    }

    /// Number of the first sample at or after `numerator / denominator` seconds.
    pub fn first_sample_at(self, numerator: u64, denominator: u64) -> u64 {
        let ticks = u128::from(numerator) * u128::from(self.samples);
        ticks.div_ceil(u128::from(denominator) * u128::from(self.seconds)) as u64
    }
}

/// Phase of a tone of `hz` (to the millihertz) at sample `n`, in 2^-64 turn, modulo one turn. It is exact in
/// `n`.
pub fn tone_turns(hz: f64, rate: Rate, n: u64) -> u64 {
    let milli = (hz * 1000.0).round() as i128;
    // Phase in turns = n * milli / 1000 * seconds / samples; keep the remainder only.
    let modulus = 1000 * i128::from(rate.samples);
    if milli == 0 {
        return 0;
    }
    let step = (milli * i128::from(rate.seconds)).rem_euclid(modulus);
    let phase = (step as u128 * u128::from(n)) % modulus as u128;
    // modulus < 2^60, so the shifted value fits in 128 bits after one split.
    let high = (phase << 64) / modulus as u128;
    high as u64
}

/// Clock of a sampler: sample 0 is taken at its time `start`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SampleClock {
    /// Time of sample 0 by the clock.
    pub start: Epoch,
    /// Samples per second, as the sampler's own clock counts them.
    pub rate: Rate,
}

impl SampleClock {
    /// Returns the time of sample `n` by the sampler's clock.
    pub fn epoch(self, n: u64) -> Epoch {
        let (whole, fraction) = self.rate.elapsed(n);
        Epoch::new(self.start.seconds + whole, self.start.fraction + fraction)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gps_and_utc_labels_agree_with_the_leap_second_table() {
        // IERS Bulletin C 37: 15 leap seconds between GPS time and UTC in July 2010.
        let gps = Epoch::parse("2010-07-01T00:00:15").unwrap();
        assert_eq!(gps, Epoch::parse("2010-07-01T00:00:00Z").unwrap());
        assert_eq!(gps.leap_seconds(), 15);
        assert_eq!((gps.week(), gps.tow_whole_s()), (1590, 4 * 86_400 + 15));
        assert_eq!(gps.to_utc_text(), "2010-07-01T00:00:00.000000Z");
        assert_eq!(Epoch::parse("2010-07-01T08:12:30.25").unwrap().to_string(), "2010-07-01T08:12:30.250000");
    }

    #[test]
    fn a_leap_second_is_inserted_at_the_end_of_its_day_and_not_before() {
        // IERS Bulletin C 52: 2016-12-31T23:59:60Z; GPS minus UTC is 17 s before and 18 s after it.
        let midnight = Epoch::parse("2017-01-01T00:00:00Z").unwrap();
        assert_eq!(midnight, Epoch::parse("2017-01-01T00:00:18").unwrap());
        for (before_s, leap, text) in [
            (60, 17, "2016-12-31T23:59:01.000000Z"),
            (20, 17, "2016-12-31T23:59:41.000000Z"),
            (2, 17, "2016-12-31T23:59:59.000000Z"),
            (1, 17, "2016-12-31T23:59:60.000000Z"),
            (0, 18, "2017-01-01T00:00:00.000000Z"),
            (-30, 18, "2017-01-01T00:00:30.000000Z"),
        ] {
            let at = Epoch::new(midnight.seconds() - before_s, 0.0);
            assert_eq!((at.leap_seconds(), at.to_utc_text().as_str()), (leap, text));
            if before_s != 1 {
                assert_eq!(Epoch::parse(text).unwrap(), at);
            }
        }
    }

    #[test]
    fn a_scale_with_leap_seconds_shows_what_utc_does_three_hours_ahead() {
        // Two days before, at, and two days after the leap second of IERS Bulletin C 52.
        for (text, shown) in [
            ("2016-12-30T12:00:00Z", "2016-12-30T15:00:00"),
            ("2016-12-31T23:59:59Z", "2017-01-01T02:59:59"),
            ("2017-01-01T00:00:00Z", "2017-01-01T03:00:00"),
            ("2017-01-02T12:00:00Z", "2017-01-02T15:00:00"),
        ] {
            let (at, label) = (Epoch::parse(text).unwrap(), Epoch::parse(shown).unwrap());
            assert_eq!((GLONASST.label(at), GLONASST.instant(label)), (label, at), "{text}");
            assert_eq!(UTC.label(at).seconds() + 10_800, label.seconds());
        }
        // The inserted second has the label of the one after it.
        let inserted = Epoch::parse("2016-12-31T23:59:60Z").unwrap();
        assert_eq!(GLONASST.label(inserted), Epoch::parse("2017-01-01T03:00:00").unwrap());
        let at = Epoch::parse("2020-11-29T12:50:00.25").unwrap();
        assert_eq!((BDT.instant(BDT.label(at)), GLONASST.instant(GLONASST.label(at))), (at, at));
    }

    #[test]
    fn what_is_not_a_time_is_refused() {
        for text in [
            "",
            "2010-07-01",
            "2010-13-01T00:00:00",
            "2010-02-30T00:00:00",
            "1979-01-01T00:00:00",
            "2010-07-01T00:00:0x",
        ] {
            assert!(Epoch::parse(text).is_err(), "{text}");
        }
    }

    #[test]
    fn arithmetic_keeps_sixteen_digits_of_a_second() {
        let epoch = Epoch::from_week(2400, 604_799.999_999);
        let later = epoch.plus_s(1e-6 + 1e-12);
        // Half an ulp of the fraction (5.5e-17) plus the rounding of the literal's 604 799.999 999 (6e-11).
        assert!((later.since(epoch) - 1.000_001e-6).abs() < 2.3e-16);
        assert_eq!(Epoch::new(5, -1e-20).fraction(), 0.0);
    }

    #[test]
    fn sample_times_are_exact_after_thirty_days_at_fifty_megahertz() {
        let rate = Rate::from_hz(50e6).unwrap();
        let n = 30 * 86_400 * 50_000_000 + 1;
        assert_eq!(rate.elapsed(n), (30 * 86_400, 1.0 / 50e6));
        assert_eq!(rate.first_sample_at(30 * 864_000, 10), n - 1);
        // 12.5 MHz at 50 Msps is a quarter turn a sample.
        assert_eq!(tone_turns(12.5e6, rate, n), 1 << 62);
        assert_eq!(tone_turns(-12.5e6, rate, n), 3 << 62);
    }
}
