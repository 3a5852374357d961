//! Cases 44 to 46: sums that are long, full or of awkward length.

use gnss_twin::gnss::gps::l1ca;
use gnss_twin::gnss::gps::l1ca::L1_CA;
use gnss_twin::gnss::satellite::Sv;
use gnss_twin::receiver::acquire::search;
use gnss_twin::receiver::correlate::{Arithmetic, Edge, Nco, Replica, chips_to_units};
use gnss_twin::receiver::source::Block;

use crate::figures::case;
use crate::run;

/// Gaussian numbers of unit variance by sums of twelve, from a seeded generator.
pub fn normals(seed: u64, count: usize) -> Vec<f32> {
    let mut state = seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1;
    let mut uniform = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1_u64 << 53) as f64
    };
    (0..count).map(|_| ((0..12).map(|_| uniform()).sum::<f64>() - 6.0) as f32).collect()
}

/// Largest error of a correlation of `count` samples with a constant of `dc` in them, in standard deviations of its noise.
pub fn sum_error(arithmetic: Arithmetic, count: usize, dc: f32) -> f64 {
    let replica = Replica::new(l1ca::code(9).unwrap(), Edge::Area).unwrap();
    let mut worst = 0.0_f64;
    for seed in 1..=3 {
        let i: Vec<f32> = normals(seed, count).iter().map(|x| x + dc).collect();
        let q: Vec<f32> = normals(seed + 50, count).iter().map(|x| x + dc).collect();
        let nco = Nco {
            carrier: 77 << 50,
            carrier_step: 1 << 50,
            code: chips_to_units(12.3),
            code_step: (1.023e6 / 50e6 * 281_474_976_710_656.0) as u64,
        };
        let taps = [chips_to_units(0.25), 0, chips_to_units(-0.25)];
        let exact = replica.slow(&i, &q, &nco, &taps);
        let found = replica.correlate_in(arithmetic, (&i, &q), &nco, &taps);
        // Noise of a component of the sum: the square root of the count.
        worst = exact.iter().zip(&found).fold(worst, |w, (a, b)| w.max((a - b).norm() / (count as f64).sqrt()));
    }
    worst
}

#[test]
fn long_sums_of_single_precision_stay_far_below_the_noise() {
    let the = case(44, "f32 and f64 accumulators");
    for (count, dc) in [(50_000, 0.0), (1_000_000, 0.0), (50_000, 10.0), (1_000_000, 10.0)] {
        // Products are rounded to 6e-8 of themselves, in blocks that are added in f64: a walk of 6e-8 · √(1 + DC²) noises,
        // and a carrier within 1e-6 turn of the exact one in a block, 6.3e-6 rad of what the DC leaves.
        let bar = 1e-5 * (1.0 + f64::from(dc));
        let name = format!("f32, {count} samples, DC of {dc} σ: error over the sum's noise");
        the.at_most(&name, sum_error(Arithmetic::F32, count, dc), bar, "");
    }
}

#[test]
fn full_scale_for_a_second_overflows_nothing() {
    let the = case(45, "integer accumulators at full scale");
    let replica = Replica::new(l1ca::code(9).unwrap(), Edge::Nearest).unwrap();
    // A replica of no carrier and samples in step with its code at full scale: every product has one sign.
    let count = 2_000_000_usize;
    let step = (1.023e6 / 50e6 * 281_474_976_710_656.0) as u64;
    let nco = Nco { carrier: 0, carrier_step: 0, code: 0, code_step: step };
    let code = l1ca::code(9).unwrap();
    let chip = |n: usize| (((n as u64 * step) >> 48) % 1023) as usize;
    let i: Vec<f32> = (0..count).map(|n| if code[chip(n)] { -127.0 } else { 127.0 }).collect();
    let q = vec![0.0_f32; count];
    let expected = 127.0 * count as f64;
    for (name, arithmetic) in [("i16", Arithmetic::I16), ("f32", Arithmetic::F32)] {
        let [sum] = replica.correlate_in(arithmetic, (&i, &q), &nco, &[0]);
        // Nearest chips of the two may fall on the other side of an edge once in a while, 2 in 1e5; a wrapped integer would
        // miss by all.
        the.at_most(
            &format!("{name}: sum of 2e6 full-scale products, relative"),
            (sum.re / expected - 1.0).abs(),
            1e-3,
            "",
        );
    }
}

#[test]
fn epochs_of_prime_and_odd_lengths_give_the_same_peaks() {
    let the = case(46, "FFT lengths");
    let (mut held, mut of) = (0, 0);
    // 5003 and 2069 are primes, 4092 and 5115 are the code's, 4000.9 is no whole number.
    for rate_hz in [5.003e6, 2.069e6, 4.092e6, 5.115e6, 4.0009e6, 25e6] {
        let tables = format!(
            "[front_end]\nsample_rate_hz = {rate_hz:e}\nformat = \"ci8\"\n[noise]\n[power]\ncn0_dbhz = 48\n[fidelity]\n\
             code_edge = \"area\"\n"
        );
        let scene = run::scene(0.03, &tables);
        let up: Vec<Sv> = run::in_view(&scene).into_iter().take(4).collect();
        let scene = run::only(scene, &up);
        let bytes = run::samples(&scene);
        let (i, q) = run::planes(&scene, &bytes);
        let candidates: Vec<_> = up.iter().map(|sv| (&L1_CA, *sv)).collect();
        let block = Block { first: 0, i: &i, q: &q };
        for (row, hit) in search(&scene.metadata, &block, &candidates, &Default::default()).unwrap() {
            of += 1;
            let error_m = hit.map(|hit| run::code_error_m(&scene, row.sv, 0, hit.code_phase_chips / 1023.0));
            // Half a cell of a third of a chip is 49 m; the refined peak is better.
            held += usize::from(error_m.is_some_and(|m| m.abs() < 49.0));
        }
    }
    the.all("peaks within half a cell of the truth", held, of);
}
