//! Code Dopplers from two searches of the same satellites.
//!
//! Each search gives a code phase and a Doppler. Over the seconds between two searches the code's own Doppler
//! follows without any lock. It is plotted against the carrier's Doppler. Slope +1 through the origin is
//! correct, and slope −1 is an inverted spectrum. A common offset is code-carrier divergence
//! ([`parting`](super::parting)).
//!
//! Two code phases of a search err by 0.1 chip each at most: 54 Hz of the carrier after four seconds for a
//! satellite. The whole code periods in between are unknown. Code Dopplers are therefore right modulo
//! carrier/(code rate · time), 394 kHz over 4 s of C/A code, and are taken near the carrier's. Limits: a
//! break in the samples between both searches looks like a rate.

use std::collections::BTreeMap;

use crate::acquire::Acquired;
use crate::lead::lead;
use crate::parting::{Estimate, common};
use gnss::signal::Link;
use gnss::time::Rate;

/// Deviation of a search's code phase.
const SIGMA_CHIPS: f64 = 0.1;
/// Seconds between two searches that are compared.
const LEAST_S: f64 = 0.2;
const MOST_S: f64 = 20.0;
/// Dopplers that differ by less do not show the slope's sign.
const LEAST_SPREAD_HZ: f64 = 300.0;

/// Relation of the code Dopplers to the carrier Dopplers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Pattern {
    /// Code and carrier Dopplers are equal, apart from the common carrier offset given here.
    Sound(Estimate),
    /// The opposite: the spectrum is inverted. What the carrier would be ahead by in the right one.
    Mirrored(Estimate),
}

/// The latest hit of every satellite.
#[derive(Clone, Debug, Default)]
pub struct Looks {
    last: BTreeMap<Link, Acquired>,
}

impl Looks {
    /// Takes the hits of a search, and compares them with those before.
    pub fn take(&mut self, hits: &[Acquired], rate: Rate) -> Option<Pattern> {
        let pairs: Vec<(f64, f64, f64)> = hits
            .iter()
            .filter_map(|hit| {
                let before = self.last.insert(hit.link(), *hit)?;
                let passed_s = rate.elapsed_s(hit.sample.checked_sub(before.sample)?);
                (LEAST_S..=MOST_S).contains(&passed_s).then(|| code_doppler(&before, hit, passed_s))?
            })
            .collect();
        let of = |f: &dyn Fn(f64, f64) -> f64| -> Vec<Estimate> {
            pairs.iter().map(|&(code, carrier, sigma_hz)| Estimate { hz: f(code, carrier), sigma_hz }).collect()
        };
        if let Some(sound) = common(&of(&|code, carrier| carrier - code)) {
            return Some(Pattern::Sound(sound));
        }
        let least = pairs.iter().map(|pair| pair.1).fold(f64::INFINITY, f64::min);
        let most = pairs.iter().map(|pair| pair.1).fold(f64::NEG_INFINITY, f64::max);
        let mirrored = common(&of(&|code, carrier| -carrier - code))?;
        (most - least > LEAST_SPREAD_HZ).then_some(Pattern::Mirrored(mirrored))
    }
}

/// Doppler of the code, scaled to the carrier, that of the carrier, and the first one's deviation.
fn code_doppler(before: &Acquired, hit: &Acquired, passed_s: f64) -> Option<(f64, f64, f64)> {
    let component = lead(hit.signal)?;
    let (length, ratio) = (f64::from(component.code_chips), hit.signal.carrier_hz(hit.sv) / component.chip_rate_hz);
    let advance = hit.code_phase_chips - before.code_phase_chips - component.chip_rate_hz * passed_s;
    let beyond = advance - length * (advance / length).round();
    let scale = ratio / passed_s;
    Some((beyond * scale, 0.5 * (hit.doppler_hz + before.doppler_hz), 2_f64.sqrt() * SIGMA_CHIPS * scale))
}

#[cfg(test)]
mod tests {
    use super::*;
    use gnss::gps::l1ca::L1_CA;
    use gnss::satellite::Sv;

    const DOPPLERS_HZ: [f64; 6] = [-3900.0, -2500.0, -700.0, 300.0, 2100.0, 4400.0];

    /// Hits at a sample of codes whose Dopplers are a function of the carriers'.
    fn hits(sample: u64, code: impl Fn(f64) -> f64) -> Vec<Acquired> {
        let ratio = 1540.0;
        let one = |(k, &doppler_hz): (usize, &f64)| Acquired {
            sv: Sv::gps(k as u8 + 1),
            signal: &L1_CA,
            sample,
            // An error of up to 0.08 chip of either sign, another at each search.
            code_phase_chips: (100.0 * k as f64
                + (1.023e6 + code(doppler_hz) / ratio) * sample as f64 / 2.6e6
                + 0.08 * libm::sin((k as u64 * 7 + sample) as f64))
            .rem_euclid(1023.0),
            doppler_hz,
            cn0_dbhz: 45.0,
        };
        DOPPLERS_HZ.iter().enumerate().map(one).collect()
    }

    fn pattern(code: impl Fn(f64) -> f64) -> Option<Pattern> {
        let (rate, mut looks) = (Rate::from_hz(2.6e6).unwrap(), Looks::default());
        assert_eq!(looks.take(&hits(0, &code), rate), None);
        looks.take(&hits(5_300_000, &code), rate)
    }

    #[test]
    fn slope_and_intercept_of_code_against_carrier_tell_a_mirror_from_a_rate() {
        // Two errors of 0.08 chip over 2.04 s are 121 Hz of one satellite at most, and so is their mean.
        let near = |a: f64, b: f64| (a - b).abs() < 121.0;
        for ahead_hz in [0.0, 5987.0, -20_000.0, 31_000.0] {
            assert!(matches!(pattern(|d| d - ahead_hz), Some(Pattern::Sound(e)) if near(e.hz, ahead_hz)), "{ahead_hz}");
            let mirrored = pattern(|d| -d - ahead_hz);
            assert!(matches!(mirrored, Some(Pattern::Mirrored(e)) if near(e.hz, ahead_hz)), "{ahead_hz}: {mirrored:?}");
        }
        // Codes that follow nothing.
        assert_eq!(pattern(|d| d * d * 1e-3), None);
    }
}
