//! Carriers of satellites that divide a band, in a receiver's channel.

use std::f64::consts::TAU;

use gnss::glonass::fdma::G1;
use gnss::samples::{Format, IfMetadata};
use gnss::satellite::{Sv, System};
use gnss::time::Rate;
use receiver::acquire::Acquired;
use receiver::source::Block;
use receiver::track::{Channel, Report, TrackingSettings};

const RATE_HZ: f64 = 4.103e6;
/// GLONASS ICD L1, L2 (5.1), 3.3.1.1 and 3.3.2.1: channel −7, and a code of 511 chips.
const CARRIER_HZ: f64 = 1_598.062_5e6;
const CHIP_HZ: f64 = 0.511e6;
const CHIPS: f64 = 511.0;
const IF_HZ: f64 = 213e3;
/// Doppler of an orbiter: the error of a wrong aid grows with it.
const DOPPLER_HZ: f64 = 40e3;

#[test]
fn codes_of_glonass_are_aided_by_the_carriers_of_their_own_channels() {
    let sv = Sv { system: System::Glonass, number: 10 };
    let code = (G1.components[0].code)(sv.number).unwrap();
    let metadata = IfMetadata {
        format: Format::Cf32Le,
        rate: Rate::from_hz(RATE_HZ).unwrap(),
        center_hz: CARRIER_HZ - IF_HZ,
        inverted: false,
        start: None,
    };
    let (cn0_dbhz, first_chips, ratio) = (70.0, 77.25, 1.0 + DOPPLER_HZ / CARRIER_HZ);
    let hit =
        Acquired { sv, signal: &G1, sample: 0, code_phase_chips: first_chips, doppler_hz: DOPPLER_HZ + 4.0, cn0_dbhz };
    let mut channel = Channel::start(&hit, &metadata, &TrackingSettings::default());
    let mut report = Report::default();
    let (amplitude, length) = ((libm::pow(10.0, 0.1 * cn0_dbhz) / RATE_HZ).sqrt(), (RATE_HZ * 0.1) as usize);
    // Uniform noise of the power that the amplitude is told by.
    let mut state = 9_u64;
    let mut noise = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        6.0_f64.sqrt() * ((state >> 40) as f64 / 16_777_216.0 - 0.5)
    };
    for block in 0..60 {
        let (mut i, mut q) = (Vec::with_capacity(length), Vec::with_capacity(length));
        for n in block * length..(block + 1) * length {
            let t_s = n as f64 / RATE_HZ;
            let chips = first_chips + t_s * CHIP_HZ * ratio;
            // The meander of a message of zeros: a sign lasts ten periods.
            let sign = if ((chips / (10.0 * CHIPS)) as u64).is_multiple_of(2) { 1.0 } else { -1.0 };
            let chip = sign * amplitude * f64::from(code[(chips % CHIPS) as usize]);
            let (sin, cos) = libm::sincos(TAU * ((IF_HZ + DOPPLER_HZ) * t_s + 0.2).fract());
            i.push((chip * cos + noise()) as f32);
            q.push((chip * sin + noise()) as f32);
        }
        let first = (block * length) as u64;
        channel.advance(&Block { first, i: &i, q: &q }, &[first + 1000], &mut report);
    }
    let late: Vec<_> = report.measurements.iter().skip(30).collect();
    assert!(!channel.is_lost() && late.len() >= 25 && late.iter().all(|m| m.locked), "{:?}", report.events);
    let errors = late.iter().map(|m| {
        let chips = first_chips + m.sample as f64 / RATE_HZ * CHIP_HZ * ratio;
        libm::remainder(m.code_fraction * CHIPS - chips, CHIPS)
    });
    let mean = errors.sum::<f64>() / late.len() as f64;
    println!("{mean:+.5} chips");
    // The middle of the band, 2.5e-3 of the carrier away, would aid by 0.032 chips a second less than 12.79.
    // A loop of half a hertz lags by that over 4B: 0.016 chips.
    assert!(mean.abs() < 0.005, "{mean} chips");
}
