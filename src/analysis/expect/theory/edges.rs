//! Code error at rest by chip edges that are averaged over a sample's interval.
//!
//! Averaging is a filter sinc(f/fs) before sampling. Aliases above half the rate form a code of their own,
//! with phases that do not follow the code's. An early-minus-late correlator weighs a line of the code at f =
//! m/period by 2 sin(π f d). The aliased lines, of random phase, add up by power. Limits: random codes,
//! spacing of half a chip, no filter of the front end. Near a multiple of the chip rate it is a bound (0.33 m
//! at 2.048 Msps, where 0.20 m were measured).

use std::f64::consts::PI;

use crate::waveform::{Waveform, leading};
use gnss::earth::SPEED_OF_LIGHT_MPS;
use gnss::signal::{Layers, Signal};

/// Lines a chip rate that are summed. A code of other length has others, whose power is in proportion.
const LINES: f64 = 1023.0;
/// Chip rate of the code whose locked error was measured, in hertz: GPS C/A.
const MEASURED_HZ: f64 = 1.023e6;
/// Early-late spacing of the code loop, in chips.
const SPACING_CHIPS: f64 = 0.5;
/// Zones of the rate that fold back; their power falls with the fourth power of their number.
const ZONES: i32 = 4;
/// Largest over root mean square: 0.40 m against 0.14 m, met by an independent correlator on real codes at
/// 2.6 Msps.
pub const CREST: f64 = 0.40 / 0.14;

/// Error of a signal's code at rest, root mean square over codes and phases, in metres; 0 of one without a
/// code.
pub fn averaged_m(signal: &Signal, sent: Layers, rate_hz: f64) -> f64 {
    let code = leading(signal).zip(Waveform::sent(signal, sent));
    code.map_or(0.0, |(component, waveform)| {
        let chips = f64::from(component.code_chips);
        folded_m(&waveform, chips, rate_hz).max(locked_m(component.chip_rate_hz, chips, rate_hz))
    })
}

fn folded_m(waveform: &Waveform, chips: f64, rate_hz: f64) -> f64 {
    let sinc = |x: f64| if x == 0.0 { 1.0 } else { libm::sin(PI * x) / (PI * x) };
    // Frequencies in chip rates.
    let chip_rate_hz = waveform.chip_rate_hz();
    let rate = rate_hz / chip_rate_hz;
    let power = |f: f64| waveform.density(f * chip_rate_hz) * chip_rate_hz / LINES;
    let (mut square, mut slope) = (0.0, 0.0);
    // Below half the rate: the line there has no image of its own.
    for line in 1..(0.5 * rate * LINES).ceil() as u32 {
        let f = f64::from(line) / LINES;
        let weight = 2.0 * libm::sin(PI * f * SPACING_CHIPS);
        let image = |zone: i32| {
            let f = f + f64::from(zone) * rate;
            power(f) * sinc(f / rate) * sinc(f / rate)
        };
        let images: f64 = (1..=ZONES).map(|zone| image(zone) + image(-zone)).sum();
        square += 2.0 * weight * weight * power(f) * images;
        slope += weight * 4.0 * PI * f * sinc(f / rate) * power(f);
    }
    SPEED_OF_LIGHT_MPS / chip_rate_hz * (square * LINES / chips).sqrt() / slope
}

/// Code error in metres where every chip meets the same few positions between samples, so that phases are not
/// random. It is 1.6 m at four samples a chip of C/A, and grows as the square of samples times positions.
/// Longer and shorter chips are in proportion.
fn locked_m(chip_rate_hz: f64, chips: f64, rate_hz: f64) -> f64 {
    let samples = |places: u32| f64::from(places) * rate_hz / chip_rate_hz;
    // Within a code the positions drift apart otherwise.
    let places = (1..=32).find(|places| (samples(*places) - samples(*places).round()).abs() < 1.0 / chips);
    let scale = MEASURED_HZ / chip_rate_hz;
    places.map_or(0.0, |places| 1.6 * scale * (4.0 / samples(places)) * (4.0 / samples(places)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use gnss::gps::l1ca::L1_CA;

    #[test]
    fn averaged_edges_cost_what_folds_back_at_each_rate() {
        // The same sum in another language. Scaling 0.14 m with the square of the rate gave 0.226 m at 2.048
        // Msps.
        for (rate_hz, expected_m) in [(2.048e6, 0.3273), (2.6e6, 0.1515), (5e6, 0.0563), (10e6, 0.0202), (25e6, 0.0038)]
        {
            assert!(
                (averaged_m(&L1_CA, Layers::Whole, rate_hz) - expected_m).abs() < 6e-5,
                "{rate_hz}: {}",
                averaged_m(&L1_CA, Layers::Whole, rate_hz)
            );
        }
        // Four samples a chip, and five chips to 8 · 2.5 samples: 1.6 · (4 / 5)² m with two positions at
        // 2.5575 Msps.
        assert!(
            (averaged_m(&L1_CA, Layers::Whole, 4.092e6) - 1.6).abs() < 1e-9
                && (averaged_m(&L1_CA, Layers::Whole, 2.5575e6) - 1.024).abs() < 1e-9
        );
        assert!((CREST * averaged_m(&L1_CA, Layers::Whole, 2.048e6) - 0.935).abs() < 1e-3);
    }
}
