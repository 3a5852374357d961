//! Losses of the signals in a front end, against integrals.

use std::f64::consts::PI;

use generator::stage::filter::{Filter, Shape};
use generator::stage::{Block, Stage};
use gnss::gps::l1ca;

/// Share of a BPSK(1) signal's power within ±`half_hz`: ∫ sinc²(f / R) / R df, by the midpoint rule.
fn share_within(half_hz: f64) -> f64 {
    const STEPS: u32 = 100_000;
    let step = 2.0 * half_hz / f64::from(STEPS);
    (0..STEPS).fold(0.0, |sum, k| {
        let x = PI * (-half_hz + (f64::from(k) + 0.5) * step) / 1.023e6;
        sum + (libm::sin(x) / x).powi(2) * step / 1.023e6
    })
}

#[test]
fn a_wall_loses_the_power_that_lies_outside() {
    const RATE_HZ: f64 = 40.92e6;
    const PER_CHIP: usize = 40;
    // 0.444 and 0.223 dB are published for 2.046 and 4.092 MHz.
    for (bandwidth_hz, published_db) in [(2.046e6, 0.444), (4.092e6, 0.223), (20.46e6, 0.044)] {
        let expected_db = -10.0 * libm::log10(share_within(0.5 * bandwidth_hz));
        assert!((expected_db - published_db).abs() < 1e-3);
        let filter = Filter::new(Shape::BrickWall, bandwidth_hz, RATE_HZ, 0.0, false).unwrap();
        let delay = (filter.group_delay_s * RATE_HZ).round() as usize;
        let mut mean_db = 0.0;
        for prn in 1..=8 {
            let chips: Vec<f32> = l1ca::code(prn).unwrap().iter().map(|set| if *set { -1.0 } else { 1.0 }).collect();
            let period = 1023 * PER_CHIP;
            let sharp: Vec<f32> = (0..2 * period).map(|n| chips[n / PER_CHIP % 1023]).collect();
            let (mut i, mut q) = (sharp.clone(), vec![0.0; sharp.len()]);
            filter.act(&mut Block::whole(0, &mut i, &mut q));
            // A replica without filter meets the signal's share p, and noise of the same share: p² / p.
            let sum: f64 = i[period..].iter().zip(&sharp[period - delay..]).map(|(x, s)| f64::from(x * s)).sum();
            mean_db -= 10.0 * libm::log10(sum / period as f64) / 8.0;
        }
        // Lines of a C/A code stand up to 4 dB off sinc²; over eight codes, with the edge of a twentieth of
        // the width at the null or in side lobes, 0.02 dB are left. The samples' aliases add 1 / (3 · 40) of
        // the power outside.
        assert!((mean_db - expected_db).abs() < 0.02, "{bandwidth_hz} Hz: {mean_db} dB, expected {expected_db}");
    }
}
