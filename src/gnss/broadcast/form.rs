//! Meaning of an ephemeris's clock, delays and health in each message.
//!
//! Sources: those of the messages. An ephemeris of no message in particular has one group delay of two
//! carriers (IS-GPS-200N, 20.3.3.3.3.2), BeiDou's two against B3I.

use std::fmt;

use super::{B1I_HZ, B2I_HZ, Ephemeris};
use crate::satellite::System;
use crate::signal::Signal;

/// Meaning of clock, delays and health in the ephemerides of one message. Messages of one satellite describe
/// the same orbit, but their clocks refer to different signals.
pub struct SetForm {
    /// Name of the message.
    pub name: &'static str,
    /// Group delay in seconds: the ephemeris clock minus the clock offset for a user of one signal alone.
    pub group_delay_s: fn(&Ephemeris, &Signal) -> f64,
    /// True if a decoded ephemeris suffices for ranges of a signal: it then includes the signal's delays.
    pub serves: fn(&Signal) -> bool,
    /// Group delay in seconds on the carrier for which the message gives it.
    pub given_delay_s: fn(&Ephemeris) -> f64,
    /// True if an ephemeris reports the first of its signals as usable.
    pub is_healthy: fn(&Ephemeris) -> bool,
    /// True if an ephemeris reports a signal as usable; `None` if it does not state it.
    pub healthy: fn(&Ephemeris, &Signal) -> Option<bool>,
    /// Data sources field of RINEX records; `None` for messages whose records have no such field.
    pub rinex_sources: Option<f64>,
}

/// Form of an ephemeris that belongs to no particular message: one group delay, which scales with 1/f², and
/// one health for all signals.
pub static PLAIN: SetForm = SetForm {
    name: "",
    group_delay_s: plain_delay_s,
    serves: |_| true,
    given_delay_s: |set| set.tgd_s,
    is_healthy: |set| set.health == 0,
    healthy: |set, _| Some(set.health == 0),
    rinex_sources: None,
};

/// The one delay of an ephemeris on the carrier of a signal; BeiDou's clock is that of B3I.
fn plain_delay_s(set: &Ephemeris, signal: &Signal) -> f64 {
    match (set.sv.system, signal.carrier_hz(set.sv)) {
        (System::BeiDou, B2I_HZ) => planted!("gnss.delay.second", set.tgd2_s, -set.tgd2_s),
        (System::BeiDou, hz) => set.group_delay_on_s(B1I_HZ, hz),
        _ => set.given_delay_s() * set.dispersion(signal),
    }
}

impl Ephemeris {
    /// Group delay in seconds of a RINEX code, if another message of the satellite states it.
    pub fn delay_of_code_s(&self, code: &str) -> Option<f64> {
        self.signal_delays_s.iter().find(|(own, _)| *own == code).map(|(_, delay_s)| *delay_s)
    }

    /// True if the ephemeris suffices for ranges of a signal, with delays of its own or from another message.
    pub fn serves(&self, signal: &Signal) -> bool {
        (self.form.serves)(signal) || self.delay_of_code_s(signal.rinex).is_some()
    }
}

impl fmt::Debug for SetForm {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name)
    }
}

impl PartialEq for SetForm {
    fn eq(&self, other: &Self) -> bool {
        self.name == other.name
    }
}

/// Health flag of a RINEX record for GLONASS's flag l of string 3, 1 if the satellite is unhealthy. Bit 1
/// states if the almanac's health is known, and bit 0 is that health, 1 for healthy (RINEX 3.05, table A10).
pub const STRING_3_UNHEALTHY: u16 = 2;

/// Converts Galileo's data validity and health from the order of RINEX to that of an ephemeris, or back. An
/// ephemeris has E1-B in bits 0 to 2, E5a in 3 to 5, E5b in 6 to 8. RINEX exchanges the last two.
pub fn status_of_record(health: u16) -> u16 {
    health & 0b111 | (health >> 6 & 0b111) << 3 | (health >> 3 & 0b111) << 6
}
