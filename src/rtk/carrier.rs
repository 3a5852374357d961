//! Chips of signals by their RINEX codes, of foreign receivers too.
//!
//! Source: RINEX 4.02, tables 10 to 16 (bands and codes), and the interface documents of the systems for the
//! rates of the chips. A receiver of another make may track what this program does not generate, P(Y) for
//! one; whoever differences its observations needs no more than this.

use std::fmt;

use gnss::satellite::System;

/// Band and attribute of a signal as RINEX has them, such as `1C`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Code([u8; 2]);

impl Code {
    /// A code of two ASCII characters; `None` for another text.
    pub fn new(text: &str) -> Option<Self> {
        text.as_bytes().try_into().ok().filter(|bytes: &[u8; 2]| bytes.is_ascii()).map(Self)
    }

    /// Character of the band.
    pub fn band(self) -> u8 {
        self.0[0]
    }
}

impl fmt::Display for Code {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(&String::from_utf8_lossy(&self.0))
    }
}

/// True if the satellites of a system send a signal on carriers of their own, whose double differences have
/// no whole ambiguities.
pub fn is_divided(system: System, code: Code) -> bool {
    system == System::Glonass && matches!(code.band(), b'1' | b'2')
}

/// Rate of the signal's chips, on which the noise of its code depends.
pub fn chips_hz(system: System, code: Code) -> f64 {
    let megahertz = match (system, code.band(), code.0[1]) {
        (System::BeiDou, b'2', _) | (System::BeiDou, b'7', b'I' | b'Q' | b'X') => 2.046,
        (System::BeiDou, b'6', _) | (System::Gps, b'1' | b'2', b'P' | b'W' | b'Y') => 10.23,
        (System::Glonass, b'1' | b'2', b'P') => 5.11,
        (System::Glonass, b'1' | b'2', _) => 0.511,
        (System::Navic, b'5' | b'9', _) => 1.023,
        (System::Galileo | System::Qzss, b'6', _) => 5.115,
        (_, b'3' | b'5' | b'7' | b'8', _) => 10.23,
        _ => 1.023,
    };
    1e6 * megahertz
}

#[cfg(test)]
mod tests {
    use super::*;
    use gnss::signal::{all, band_hz};

    #[test]
    fn carriers_and_chips_are_those_of_the_registered_signals() {
        let mut compared = 0;
        for signal in all() {
            let Some(code) = Code::new(signal.rinex) else { continue };
            for sv in signal.satellites().filter(|sv| sv.system != System::Sbas).take(3) {
                let found = band_hz(sv.system, code.band(), signal.link(sv).channel());
                assert_eq!(found, Some(signal.carrier_hz(sv)), "{signal} {sv}");
                compared += 1;
            }
            let pilot = signal.components.iter().map(|component| component.chip_rate_hz);
            let chips = chips_hz(signal.system, code);
            assert!(pilot.clone().any(|hz| (hz / chips - 1.0).abs() < 2e-3), "{signal}: {chips}");
        }
        assert!(compared > 40, "{compared}");
    }

    #[test]
    fn a_band_that_a_system_does_not_have_has_no_carrier() {
        let code = |text| Code::new(text).unwrap();
        assert_eq!(band_hz(System::Gps, code("7Q").band(), None), None);
        assert_eq!(band_hz(System::Glonass, code("1C").band(), None), None);
        assert_eq!(["1", "é", "1CA"].map(Code::new), [None; 3]);
    }
}
