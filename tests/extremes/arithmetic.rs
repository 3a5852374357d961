//! Cases 44 to 46: sums that are long, full or of awkward length.

use gnss::gps::l1ca;
use gnss::gps::l1ca::L1_CA;
use gnss::satellite::Sv;
use receiver::acquire::search;
use receiver::correlate::sums::{RunningSums, Samples};
use receiver::correlate::{Arithmetic, CODE_BITS, Edge, Nco, Replica, chips_to_units};
use receiver::source::Block;

use crate::figures::{CA, Worst, case};
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

/// A sum of two doubles that keeps what rounding takes.
#[derive(Clone, Copy, Default)]
struct Double(f64, f64);

impl Double {
    /// Adds the exact product of two numbers (Dekker 1971, Knuth's two-sum).
    fn add_product(&mut self, a: f64, b: f64) {
        let product = a * b;
        let lost = libm::fma(a, b, -product);
        let sum = self.0 + product;
        let part = sum - self.0;
        let rounded = (self.0 - (sum - part)) + (product - part);
        *self = Self(sum, self.1 + rounded + lost);
    }
}

/// Largest error of the receiver's sums in f64, one sample after the other, in standard deviations of their
/// noise: against phases by multiplication in 128 bits, sines of a quarter turn at most, and sums in pairs of
/// doubles.
pub fn twin_error(count: usize) -> Worst {
    let code = l1ca::code(9).unwrap();
    let replica = Replica::new(code.clone(), Edge::Nearest).unwrap();
    let mut worst = Worst::default();
    for seed in 1..=3 {
        let (i, q) = (normals(seed, count), normals(seed + 50, count));
        let step = chips_to_units(1.023e6 / 50e6) as u64;
        let nco =
            Nco { carrier: 77 << 50, carrier_step: 0x0123_4567_89ab_cdef, code: chips_to_units(12.3), code_step: step };
        let [found] = replica.correlate_in(Arithmetic::F64, (&i[..], &q[..]), &nco, &[0]);
        let (mut re, mut im) = (Double::default(), Double::default());
        for (n, (&i, &q)) in (0_u64..).zip(i.iter().zip(&q)) {
            let turns = nco.carrier.wrapping_add(nco.carrier_step.wrapping_mul(n));
            let place = (nco.code as u128 + u128::from(step) * u128::from(n)) % (1023_u128 << CODE_BITS);
            let rest = (turns & (u64::MAX >> 2)) as f64 / 18_446_744_073_709_551_616.0;
            let (sin, cos) = libm::sincos(rest * std::f64::consts::TAU);
            let (sin, cos) = match turns >> 62 {
                0 => (sin, cos),
                1 => (cos, -sin),
                2 => (-sin, -cos),
                _ => (-cos, sin),
            };
            let chip = if code[(place >> CODE_BITS) as usize] { -1.0 } else { 1.0 };
            let (i, q) = (f64::from(i) * chip, f64::from(q) * chip);
            re.add_product(i, cos);
            re.add_product(q, sin);
            im.add_product(q, cos);
            im.add_product(i, -sin);
        }
        let apart = libm::hypot((re.0 - found.re) + re.1, (im.0 - found.im) + im.1);
        worst.take(apart / (count as f64).sqrt(), || format!("noise of seed {seed}"));
    }
    worst
}

/// Largest error of a correlation of `count` samples with a constant of `dc` in them, in standard deviations
/// of its noise.
pub fn sum_error(arithmetic: Arithmetic, count: usize, dc: f32) -> Worst {
    let replica = Replica::new(l1ca::code(9).unwrap(), Edge::Area).unwrap();
    let mut worst = Worst::default();
    for seed in 1..=3 {
        let i: Vec<f32> = normals(seed, count).iter().map(|x| x + dc).collect();
        let q: Vec<f32> = normals(seed + 50, count).iter().map(|x| x + dc).collect();
        let nco = Nco {
            carrier: 77 << 50,
            carrier_step: 1 << 50,
            code: chips_to_units(12.3),
            code_step: chips_to_units(1.023e6 / 50e6) as u64,
        };
        let taps = [chips_to_units(0.25), 0, chips_to_units(-0.25)];
        let exact = replica.slow(&i, &q, &nco, &taps);
        let found = replica.correlate_in(arithmetic, (&i[..], &q[..]), &nco, &taps);
        // Noise of a component of the sum: the square root of the count.
        for ((exact, found), tap) in exact.iter().zip(&found).zip([0.25, 0.0, -0.25]) {
            let apart = (exact - found).norm() / (count as f64).sqrt();
            worst.take(apart, || format!("noise of seed {seed}, tap at {tap} chip"));
        }
    }
    worst
}

#[test]
fn long_sums_of_single_precision_stay_far_below_the_noise() {
    let the = case(44, "f32 and f64 accumulators", CA);
    for (count, dc) in [(50_000, 0.0), (1_000_000, 0.0), (50_000, 10.0), (1_000_000, 10.0)] {
        // Products are rounded to 6e-8 of themselves, in blocks that are added in f64: a walk of 6e-8 · √(1 +
        // DC²) noises, and a carrier within 1e-6 turn of the exact one in a block, 6.3e-6 rad of what the DC
        // leaves.
        let bar = 1e-5 * (1.0 + f64::from(dc));
        let name = format!("f32, {count} samples, DC of {dc} σ: error over the sum's noise");
        the.at_most(&name, sum_error(Arithmetic::F32, count, dc), bar, "");
    }
}

#[test]
fn full_scale_for_a_second_overflows_nothing() {
    let the = case(45, "integer accumulators at full scale", CA);
    let replica = Replica::new(l1ca::code(9).unwrap(), Edge::Nearest).unwrap();
    // A replica of no carrier and samples in step with its code at full scale: every product has one sign.
    let count = 2_000_000_usize;
    let step = chips_to_units(1.023e6 / 50e6) as u64;
    let nco = Nco { carrier: 0, carrier_step: 0, code: 0, code_step: step };
    let code = l1ca::code(9).unwrap();
    let chip = |n: usize| (((n as u64 * step) >> CODE_BITS) % 1023) as usize;
    let i: Vec<f32> = (0..count).map(|n| if code[chip(n)] { -127.0 } else { 127.0 }).collect();
    let q = vec![0.0_f32; count];
    let expected = 127.0 * count as f64;
    for (name, arithmetic) in [("i16", Arithmetic::I16), ("f32", Arithmetic::F32)] {
        let [sum] = replica.correlate_in(arithmetic, (&i[..], &q[..]), &nco, &[0]);
        // Nearest chips of the two may fall on the other side of an edge once in a while, 2 in 1e5; a wrapped
        // integer would miss by all.
        the.at_most(
            &format!("{name}: sum of 2e6 full-scale products, relative"),
            ((sum.re / expected - 1.0).abs(), "50 Msps"),
            1e-3,
            "",
        );
    }
    // By running sums: area edges take half a sample at each of some 512 changes in 50 000 samples.
    let replica = Replica::new(l1ca::code(9).unwrap(), Edge::Area).unwrap();
    let mut room = RunningSums::default();
    let samples = Samples { i: &i, q: &q, sums: room.of(&i, &q), fixed: None };
    assert!(replica.takes_sums(&nco));
    let [sum] = replica.correlate_in(Arithmetic::Sums, samples, &nco, &[0]);
    let less = 1.0 - 512.0 * 0.5 / 50_000.0;
    let relative = (sum.re / expected / less - 1.0).abs();
    the.at_most("sums: sum of 2e6 full-scale samples, relative", (relative, "50 Msps"), 3e-3, "");
}

#[test]
fn epochs_of_prime_and_odd_lengths_give_the_same_peaks() {
    let the = case(46, "FFT lengths", CA);
    let (mut held, mut same, mut of) = (0, 0, 0);
    // 5003 and 2069 are primes, 4092 is the code's, 5000 and 25 000 are powers of five and a little, 4000.9
    // is no whole number.
    for rate_hz in [5.003e6, 2.069e6, 4.092e6, 5e6, 4.0009e6, 25e6] {
        let tables = format!(
            "[front_end]\nsample_rate_hz = {rate_hz:e}\nformat = \"ci8\"\n[noise]\n[power]\ncn0_dbhz = 52\n[fidelity]\n\
             code_edge = \"area\"\n"
        );
        let scene = run::scene(0.03, &tables);
        let up: Vec<Sv> = run::in_view(&scene).into_iter().take(4).collect();
        let scene = run::only(scene, &up);
        let bytes = run::samples(&scene);
        let (i, q) = run::planes(&scene, &bytes);
        let candidates: Vec<_> = up.iter().map(|sv| L1_CA.link(*sv)).collect();
        let block = Block { first: 0, i: &i, q: &q };
        for (row, hit) in search(&scene.metadata, &block, &candidates, &Default::default()).unwrap() {
            of += 1;
            let error_m = hit.map(|hit| run::code_error_m(&scene, row.sv, 0, hit.code_phase_chips / 1023.0));
            // Half a cell of a third of a chip is 49 m; the refined peak is better.
            held += usize::from(error_m.is_some_and(|m| m.abs() < 49.0));
            // The direct correlation, cell by cell of a third of a chip, over the first two code periods.
            let Some(hit) = hit.filter(|_| up[..2].contains(&row.sv)) else { continue };
            let replica = Replica::new(l1ca::code(row.sv.number).unwrap(), Edge::Area).unwrap();
            let step = 1.023e6 / rate_hz * (1.0 + hit.doppler_hz / L1_CA.centre_hz());
            let turns = hit.doppler_hz / rate_hz;
            let periods = |k: usize| (k as f64 * rate_hz / 1e3).round() as usize;
            let power = |cell: u32| -> f64 {
                let one = |k: usize| {
                    let from = periods(k);
                    let nco = Nco {
                        carrier: ((turns * from as f64).fract() * 18_446_744_073_709_551_616.0) as i64 as u64,
                        carrier_step: (turns * 18_446_744_073_709_551_616.0) as i64 as u64,
                        code: chips_to_units((f64::from(cell) / 3.0 + from as f64 * step) % 1023.0),
                        code_step: chips_to_units(step) as u64,
                    };
                    replica.correlate(&i[from..periods(k + 1)], &q[from..periods(k + 1)], &nco, &[0])[0].norm_sqr()
                };
                (0..2).map(one).sum()
            };
            let (_, best) = (0..3069).map(|cell| (power(cell), cell)).max_by(|a, b| a.0.total_cmp(&b.0)).unwrap();
            let apart = (f64::from(best) / 3.0 - hit.code_phase_chips).rem_euclid(1023.0);
            // The nearest cell, or where the peak lies between two the noise of 0.05 chip may choose the
            // other.
            same += usize::from(apart.min(1023.0 - apart) < 1.0 / 6.0 + 0.1);
        }
    }
    the.all("peaks within half a cell of the truth", held, of);
    the.all("peaks in the cell of the direct correlation", same, 12);
}
