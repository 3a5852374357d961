//! Validity and health of Galileo's signals as ephemerides keep them, and the clocks of its two messages.
//!
//! Source: Galileo OS SIS ICD 2.1, 5.1.9.6 and 5.1.9.7 (status), 5.1.5 (broadcast group delays). I/NAV has
//! the clock of the combination of E1 and E5b, F/NAV that of E1 and E5a; an ephemeris keeps BGD(E1,E5b) in
//! `tgd_s` and BGD(E1,E5a) in `tgd2_s`, whichever clock it has. Of E6 neither states anything: it has the
//! clock of I/NAV here, without a delay, as a user takes it who knows no more; real satellites delay E6 by
//! what only the high accuracy service sends. Of both sides of E5 as one signal neither states anything
//! either: here it is delayed by the mean of what delays its sides, which have equal power.

use super::e5;
use crate::broadcast::Ephemeris;
use crate::signal::Signal;

/// Position of a signal's three status bits in [`Ephemeris::health`].
#[derive(Clone, Copy, Debug)]
pub(super) struct Status {
    low: u32,
}

/// Status bits of E1-B.
pub(super) const E1B: Status = Status { low: 0 };
/// Status bits of E5b.
pub(super) const E5B: Status = Status { low: 3 };
/// Status bits of E5a.
pub(super) const E5A: Status = Status { low: 6 };

impl Status {
    /// The bit of data validity.
    pub(super) fn validity(self, set: &Ephemeris) -> f64 {
        f64::from(set.health >> self.low & 1)
    }

    /// The two bits of signal health.
    pub(super) fn health(self, set: &Ephemeris) -> f64 {
        f64::from(set.health >> (self.low + 1) & 0b11)
    }

    /// Puts the bit of data validity there.
    pub(super) fn set_validity(self, set: &mut Ephemeris, value: f64) {
        set.health = set.health & !(1 << self.low) | (value as u16 & 1) << self.low;
    }

    /// Puts the bits of signal health there.
    pub(super) fn set_health(self, set: &mut Ephemeris, value: f64) {
        let low = self.low + 1;
        set.health = set.health & !(0b11 << low) | (value as u16 & 0b11) << low;
    }

    /// True if all three bits are zero.
    pub(super) fn is_good(self, set: &Ephemeris) -> bool {
        set.health >> self.low & 0b111 == 0
    }
}

/// Frequency in Hz above which a carrier is not E5a: below those of E5's centre and of E5b.
const ABOVE_E5A_HZ: f64 = 1_184e6;
const BELOW_E5B_HZ: f64 = 1_199e6;
/// Frequencies in Hz that separate E5b from E6, and E6 from E1.
const ABOVE_E5_HZ: f64 = 1_240e6;
const ABOVE_E6_HZ: f64 = 1_400e6;

/// Part of the spectrum to which a signal belongs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Band {
    /// E1, and all higher frequencies.
    E1,
    /// The lower side of E5.
    E5a,
    /// Upper sideband of E5.
    E5b,
    /// Both sides as one signal.
    E5,
    /// E6.
    E6,
}

/// The band of a signal.
pub(super) fn band(signal: &Signal) -> Band {
    match signal.centre_hz() {
        hz if hz < ABOVE_E5A_HZ => Band::E5a,
        hz if hz < BELOW_E5B_HZ => Band::E5,
        hz if hz < ABOVE_E5_HZ => Band::E5b,
        hz if hz < ABOVE_E6_HZ => Band::E6,
        _ => Band::E1,
    }
}

/// Group delay of a signal against the clock of E1 and E5b: BGD(E1,E5b) on E1, (f₁/f)² times that on E5b,
/// on E5a what makes the combination of E1 and E5a have the clock of F/NAV, the mean of both on E5, and none
/// on E6.
pub(super) fn against_inav_s(set: &Ephemeris, signal: &Signal) -> f64 {
    match band(signal) {
        Band::E5a => set.tgd_s + set.tgd2_s * set.dispersion(signal) - set.tgd2_s,
        Band::E1 | Band::E5b => set.tgd_s * set.dispersion(signal),
        Band::E5 => of_both(set, against_inav_s),
        Band::E6 => planted!("gnss.e6.delay", 0.0, set.tgd_s * set.dispersion(signal)),
    }
}

/// Group delay of a signal in seconds, relative to the clock of E1 and E5a.
pub(super) fn against_fnav_s(set: &Ephemeris, signal: &Signal) -> f64 {
    match band(signal) {
        Band::E5b => set.tgd2_s + set.tgd_s * set.dispersion(signal) - set.tgd_s,
        Band::E1 | Band::E5a => set.tgd2_s * set.dispersion(signal),
        Band::E5 => of_both(set, against_fnav_s),
        Band::E6 => fnav_ahead_s(set),
    }
}

/// Mean delay of both sides of E5.
fn of_both(set: &Ephemeris, of: fn(&Ephemeris, &Signal) -> f64) -> f64 {
    let upper_s = of(set, &e5::E5B);
    0.5 * (of(set, planted!("gnss.altboc.delay", &e5::E5A, &e5::E5B)) + upper_s)
}

/// Clock of F/NAV minus clock of I/NAV, in seconds. On E1 both must give the same clock.
pub(super) fn fnav_ahead_s(set: &Ephemeris) -> f64 {
    planted!("gnss.fnav.clock", set.tgd2_s - set.tgd_s, set.tgd_s - set.tgd2_s)
}

/// True if an ephemeris reports a signal as usable, judged by the bands that its message describes.
pub(super) fn healthy(set: &Ephemeris, signal: &Signal, says: &[Band]) -> Option<bool> {
    let parts: &[(Band, Status)] = match band(signal) {
        Band::E1 => &[(Band::E1, E1B)],
        Band::E5a => &[(Band::E5a, E5A)],
        Band::E5b => &[(Band::E5b, E5B)],
        Band::E5 => &[(Band::E5a, E5A), (Band::E5b, E5B)],
        Band::E6 => &[],
    };
    let mut said = parts.iter().filter(|(band, _)| says.contains(band)).peekable();
    said.peek()?;
    Some(said.all(|(_, status)| status.is_good(set)))
}
