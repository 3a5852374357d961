//! Carriers of bands by the characters of RINEX, of bands too in which this program generates nothing.
//!
//! Source: RINEX 4.02, tables 10 to 16.

use crate::satellite::System;

/// Carrier of a band of a system in Hz, by the first character of its RINEX codes; of GLONASS by the
/// satellite's channel. `None` for a band that the system does not have.
pub fn band_hz(system: System, band: u8, channel: Option<i8>) -> Option<f64> {
    let on_channel = |middle_hz: f64, step_hz: f64| channel.map(|channel| middle_hz + step_hz * f64::from(channel));
    let hz = match (system, band) {
        (System::Glonass, b'1') => return on_channel(1_602.0e6, 0.5625e6),
        (System::Glonass, b'2') => return on_channel(1_246.0e6, 0.4375e6),
        (System::Glonass, b'3') => 1_202.025e6,
        (System::Glonass, b'4') => 1_600.995e6,
        (System::Glonass, b'6') => 1_248.06e6,
        (System::BeiDou, b'2') => 1_561.098e6,
        (System::BeiDou, b'6') => 1_268.52e6,
        (System::Gps | System::Qzss, b'2') => 1_227.6e6,
        (System::Galileo | System::Qzss, b'6') => 1_278.75e6,
        (System::Galileo | System::BeiDou, b'7') => 1_207.14e6,
        (System::Galileo | System::BeiDou, b'8') => 1_191.795e6,
        (System::Navic, b'9') => 2_492.028e6,
        (System::Glonass, _) => return None,
        (_, b'5') => 1_176.45e6,
        (_, b'1') => 1_575.42e6,
        _ => return None,
    };
    Some(hz)
}
