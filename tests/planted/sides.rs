//! Tests of both sidebands of a sub-carrier in a channel. Samples follow the definition of the signal, and
//! loops are on the peak of both sidebands together.

use std::f64::consts::TAU;

use gnss::samples::{Format, IfMetadata};
use gnss::satellite::Sv;
use gnss::signal::synthetic::SIDES;
use gnss::signal::{Component, Layer};
use gnss::time::Rate;
use num_complex::Complex64;
use receiver::acquire::Acquired;
use receiver::source::Block;
use receiver::track::{Channel, Report, TrackingSettings};

const RATE_HZ: f64 = 6.53e6;
const CHIP_HZ: f64 = 1.023e6;
const CHIPS: usize = 2046;
/// Steps of the pulses in a chip.
const STEPS: usize = 12;
/// Intermediate frequency of the carrier in the samples, in hertz.
const IF_HZ: f64 = 213e3;
const DOPPLER_HZ: f64 = 731.0;
const CN0_DBHZ: f64 = 55.0;

/// A code period of a component, step by step, and its secondary code.
fn period(component: &Component, number: u8) -> (Vec<Complex64>, Vec<i8>) {
    let wave = |step: usize| -> Complex64 {
        let layer = |layer: &Layer| {
            let cycles = component.phase_cycles + layer.phase_cycles;
            Complex64::from_polar(layer.weight, TAU * cycles) * f64::from(layer.pulse[step])
        };
        component.layers.iter().map(layer).sum::<Complex64>() * component.power_share.sqrt()
    };
    let chips = (component.code)(number).unwrap();
    let steps = chips.iter().flat_map(|chip| (0..STEPS).map(move |step| wave(step) * f64::from(*chip)));
    (steps.collect(), component.secondary_code.of(number).unwrap())
}

/// Uniform numbers, twelve of which make a normal one.
struct Noise(u64);

impl Noise {
    fn next(&mut self) -> f64 {
        let mut sum = -6.0;
        for _ in 0..12 {
            self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            sum += (self.0 >> 40) as f64 / 16_777_216.0;
        }
        sum
    }
}

#[test]
fn both_sides_of_a_sub_carrier_are_followed_on_the_peak_that_they_make_together() {
    let sv = Sv { system: SIDES.system, number: 4 };
    // Data are left out: the pilots have half the power.
    let pilots: Vec<_> = [1, 3].map(|index| period(&SIDES.components[index], sv.number)).into();
    let ratio = 1.0 + DOPPLER_HZ / SIDES.centre_hz();
    let length = (RATE_HZ * 0.05) as usize;
    let first_chips = 777.25;
    for inverted in [false, true] {
        let metadata = IfMetadata {
            format: Format::Cf32Le,
            rate: Rate::from_hz(RATE_HZ).unwrap(),
            center_hz: SIDES.centre_hz() - IF_HZ,
            inverted,
            start: None,
        };
        // A side alone is a twentieth of a chip off at first.
        let code_phase_chips = first_chips + 0.05;
        let hit = Acquired {
            sv,
            signal: &SIDES,
            sample: 0,
            code_phase_chips,
            doppler_hz: DOPPLER_HZ + 4.0,
            cn0_dbhz: CN0_DBHZ,
        };
        let mut channel = Channel::start(&hit, &metadata, &TrackingSettings::default());
        let (mut report, mut noise) = (Report::default(), Noise(9));
        let amplitude = (libm::pow(10.0, 0.1 * CN0_DBHZ) / RATE_HZ).sqrt();
        for block in 0..40 {
            let (mut i, mut q) = (Vec::with_capacity(length), Vec::with_capacity(length));
            for n in block * length..(block + 1) * length {
                let t_s = n as f64 / RATE_HZ;
                let steps = ((first_chips + t_s * CHIP_HZ * ratio) * STEPS as f64) as usize;
                let (number, step) = (steps / (CHIPS * STEPS), steps % (CHIPS * STEPS));
                let wave: Complex64 = (pilots.iter())
                    .map(|(steps, secondary_code)| {
                        steps[step] * f64::from(secondary_code[(number + 3) % secondary_code.len()])
                    })
                    .sum();
                let sample = wave * Complex64::from_polar(amplitude, TAU * ((IF_HZ + DOPPLER_HZ) * t_s + 0.2).fract());
                i.push((sample.re + 0.5_f64.sqrt() * noise.next()) as f32);
                let sign = if inverted { -1.0 } else { 1.0 };
                q.push((sign * (sample.im + 0.5_f64.sqrt() * noise.next())) as f32);
            }
            let first = (block * length) as u64;
            channel.advance(&Block { first, i: &i, q: &q }, &[first + 1000], &mut report);
        }
        let late: Vec<_> = report.measurements.iter().skip(25).collect();
        assert!(!channel.is_lost() && late.iter().all(|m| m.locked && m.half_cycle_known), "{:?}", report.events);
        let errors: Vec<f64> = (late.iter())
            .map(|m| {
                let chips = first_chips + m.sample as f64 / RATE_HZ * CHIP_HZ * ratio;
                libm::remainder(m.code_fraction * CHIPS as f64 - chips, CHIPS as f64)
            })
            .collect();
        let worst = errors.iter().fold(0.0_f64, |worst, error| worst.max(error.abs()));
        let cn0_dbhz = late.iter().map(|m| m.cn0_dbhz).sum::<f64>() / late.len() as f64;
        println!("inverted {inverted}: {worst:.4} chips at most, {cn0_dbhz:.2} dB-Hz");
        // Samples are those of their instants: an edge is right to a sixth of a chip over its many places.
        // The loop's noise is B·(1 − R(d))/(2·s²·C/N0) in square, 6e-4 chips with half a hertz and a slope of
        // 5.7.
        assert!(worst < 0.006, "inverted {inverted}: {worst} chips");
        // Half the power is followed, the sub-carrier's line of it: (sin(π/8)/(π/8))², 0.2 dB.
        assert!((cn0_dbhz - CN0_DBHZ).abs() < 0.5, "inverted {inverted}: {cn0_dbhz} dB-Hz");
    }
}
