//! The oscillator's noise has the Allan deviation of its power law, wherever and in whatever order it is
//! drawn.

use std::f64::consts::{LN_2, PI};

use generator::clock::nodes::node_samples;
use generator::clock::oscillator::{Oscillator, PowerLaw};
use generator::random::Stream;
use gnss::time::Rate;

fn rate() -> Rate {
    Rate::from_hz(2.6e6).unwrap()
}

fn node_s() -> f64 {
    rate().elapsed_s(node_samples(rate()))
}

fn oscillator(law: PowerLaw) -> Oscillator {
    Oscillator::new(law, rate(), Stream::new(11, "test"))
}

/// Slow and quick part together, at a node.
fn phase_s(oscillator: &Oscillator, node: u64) -> f64 {
    oscillator.slow_s(rate().elapsed_s(node * node_samples(rate()))) + oscillator.quick_s(node)
}

/// Overlapping Allan deviation of phases `tau0_s` apart at `m` of them (NIST SP 1065, equation 14).
fn allan(phase_s: &[f64], tau0_s: f64, m: usize) -> f64 {
    let differences = phase_s.windows(2 * m + 1).map(|w| w[2 * m] - 2.0 * w[m] + w[0]);
    let sum: f64 = differences.map(|d| d * d).sum();
    (sum / (2.0 * (m as f64 * tau0_s).powi(2) * (phase_s.len() - 2 * m) as f64)).sqrt()
}

/// The power laws, one at a time, with the Allan variance of each (SP 1065, table 3) as a factor and a power
/// of the averaging time, for an upper cut-off `f_h`.
fn laws(f_h: f64) -> [(&'static str, PowerLaw, (f64, i32)); 4] {
    let none = PowerLaw::default();
    [
        ("white PM", PowerLaw { h2: 1e-22, ..none }, (3.0 * f_h * 1e-22 / (4.0 * PI * PI), -2)),
        ("white FM", PowerLaw { h0: 1e-21, ..none }, (0.5e-21, -1)),
        ("flicker FM", PowerLaw { hm1: 1e-20, ..none }, (2.0 * LN_2 * 1e-20, 0)),
        ("random walk FM", PowerLaw { hm2: 2e-20, ..none }, (2.0 * PI * PI / 3.0 * 2e-20, 1)),
    ]
}

#[test]
fn the_allan_deviation_is_that_of_the_power_law_from_a_millisecond_to_minutes() {
    const NODES: usize = 300_000;
    const CELLS: usize = 30_000;
    for (name, law, (factor, power)) in laws(0.5 / node_s()) {
        let oscillator = oscillator(law);
        let fine: Vec<f64> = (0..NODES as u64).map(|node| phase_s(&oscillator, node)).collect();
        let cell_s = 1024.0 * node_s();
        // White phase noise is not in the spline.
        let coarse: Vec<f64> = (0..CELLS).map(|k| oscillator.slow_s(k as f64 * cell_s)).collect();
        let series = if law.h2 > 0.0 { vec![(&fine, node_s())] } else { vec![(&fine, node_s()), (&coarse, cell_s)] };
        for (phase, tau0_s) in series {
            for m in [1, 4, 16, 64] {
                let tau_s = m as f64 * tau0_s;
                let ratio = allan(phase, tau0_s, m) / (factor * tau_s.powi(power)).sqrt();
                // Some N / m independent second differences at least, of which the deviation's relative error
                // is 1 / √(2 N / m): five sigma. Flicker: 0.3 % of ripple, and at the shortest interval the
                // poles end at four nodes' worth of frequency, and a path through nodes has no more above
                // (measured: 20 %).
                let scatter = 5.0 * (m as f64 / (2.0 * phase.len() as f64)).sqrt();
                let model = match (name, m) {
                    ("flicker FM", 1) if tau0_s < 0.01 => 0.2,
                    ("flicker FM", 4) if tau0_s < 0.01 => 0.03,
                    _ => 0.005,
                };
                assert!((ratio - 1.0).abs() < scatter + model, "{name}, {tau_s:.4} s: ratio {ratio:.4}");
            }
        }
    }
}

#[test]
fn steps_over_the_border_of_cells_are_like_all_others() {
    let law = PowerLaw { h0: 1e-21, ..PowerLaw::default() };
    let oscillator = oscillator(law);
    let border: Vec<f64> =
        (1..600).map(|cell| phase_s(&oscillator, 1024 * cell) - phase_s(&oscillator, 1024 * cell - 1)).collect();
    let mean_square = border.iter().map(|x| x * x).sum::<f64>() / border.len() as f64;
    // A variance from 599 draws: five sigma is 5 √(2/599) = 29 %.
    assert!((mean_square / (0.5e-21 * node_s()) - 1.0).abs() < 0.29);
}

#[test]
fn a_late_stretch_is_the_same_whether_asked_first_or_reached_in_order() {
    let (_, law) = PowerLaw::PRESETS[1];
    let node = 90_000 * 1024 + 77;
    let (late, ordered) = (oscillator(law), oscillator(law));
    let found = (late.slow_s(72_000.3), late.quick_s(node));
    for k in 0..40 {
        ordered.quick_s(k * 2_304_000);
        ordered.slow_s(k as f64 * 1800.0);
    }
    assert_eq!(found, (ordered.slow_s(72_000.3), ordered.quick_s(node)));
    assert!(found.0 != 0.0 && found.1 != 0.0);
}
