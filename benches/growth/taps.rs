//! Cost of a code period against the number of taps.

use std::hint::black_box;
use std::time::Instant;

use analysis::statistics::median;
use gnss::gps::l1ca;
use receiver::correlate::fixed::FixedSamples;
use receiver::correlate::sums::{RunningSums, Samples};
use receiver::correlate::{Arithmetic, Edge, Nco, Replica, chips_to_units};

use crate::ladder::{Ladder, Step};

const CHIP_HZ: f64 = 1.023e6;
/// Code periods in a block, as long as those that channels are shown.
const PERIODS: usize = 20;
const ROUNDS: usize = 15;

pub fn ladders(is_wanted: &dyn Fn(&str) -> bool) -> Vec<Ladder> {
    [2.6, 20.0]
        .into_iter()
        .map(|msps| (msps, format!("correlator, taps, {msps} Msps")))
        .filter(|(_, title)| is_wanted(title))
        .map(|(msps, title)| Ladder {
            title,
            x: "taps",
            unit: "µs a code period of C/A",
            expected: "the carrier's removal once for all taps, a line from there; three share what they read",
            steps: steps(msps * 1e6),
            line_from: Some(1.0),
            is_log: false,
        })
        .collect()
}

fn steps(rate_hz: f64) -> Vec<Step> {
    let mut times: [Vec<f64>; 5] = Default::default();
    let bench = Bench::new(rate_hz);
    for _ in 0..ROUNDS {
        let found = [bench.us::<1>(), bench.us::<2>(), bench.us::<3>(), bench.us::<6>(), bench.us::<9>()];
        times.iter_mut().zip(found).for_each(|(times, us)| times.push(us));
    }
    let taps = [1.0, 2.0, 3.0, 6.0, 9.0];
    let step = |(x, times): (f64, &Vec<f64>)| Some(Step { x, cost: median(times)?, peak_mib: None });
    taps.into_iter().zip(&times).filter_map(step).collect()
}

/// Noise of eight bits, and one replica.
struct Bench {
    rate_hz: f64,
    i: Vec<f32>,
    q: Vec<f32>,
    replica: Replica,
}

impl Bench {
    fn new(rate_hz: f64) -> Self {
        let samples = PERIODS * (rate_hz * 1e-3) as usize;
        let mut state = 1_u64;
        let mut plane = || -> Vec<f32> {
            let mut next = || {
                state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
                (state >> 32) as u32
            };
            (0..samples).map(|_| ((0..4).map(|_| next() % 32).sum::<u32>() as i32 - 62) as f32).collect()
        };
        let (i, q) = (plane(), plane());
        let mut replica = l1ca::code(7).and_then(|code| Replica::new(code, Edge::Area)).expect("a code of L1 C/A");
        replica.prepare(chips_to_units(CHIP_HZ / rate_hz) as u64);
        Self { rate_hz, i, q, replica }
    }

    /// µs of a code period with so many taps, an eighth of a chip apart.
    fn us<const T: usize>(&self) -> f64 {
        let (mut sums, mut fixed) = (RunningSums::default(), FixedSamples::default());
        let fixed = fixed.of(&self.i, &self.q);
        let samples = Samples { i: &self.i, q: &self.q, sums: sums.of_fixed(fixed), fixed: Some(fixed) };
        let taps: [i64; T] = std::array::from_fn(|tap| chips_to_units(0.125 * (tap as f64 - 0.5 * (T - 1) as f64)));
        let turns = 1234.5 / self.rate_hz;
        let nco = Nco {
            carrier: 0,
            carrier_step: (turns * 18_446_744_073_709_551_616.0) as i64 as u64,
            code: chips_to_units(0.3),
            code_step: chips_to_units(CHIP_HZ / self.rate_hz) as u64,
        };
        let period = (self.rate_hz * 1e-3) as usize;
        let begin = Instant::now();
        for n in 0..PERIODS {
            let part = samples.part(n * period, (n + 1) * period);
            black_box(self.replica.correlate_in(Arithmetic::Sums, part, &nco, &taps));
        }
        begin.elapsed().as_secs_f64() * 1e6 / PERIODS as f64
    }
}
