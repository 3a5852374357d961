//! Speed of the receiver: `cargo bench --bench receiver` prints one row a figure, "figure, value, unit, bar".
//!
//! Values are medians of runs that take turns, so that a disturbance of the machine meets all of them.

use std::hint::black_box;
use std::time::Instant;

use gnss_twin::gnss::gps::l1ca::{self, L1_CA};
use gnss_twin::gnss::samples::{Format, IfMetadata};
use gnss_twin::gnss::satellite::Sv;
use gnss_twin::gnss::signal::Signal;
use gnss_twin::gnss::time::Rate;
use gnss_twin::receiver::acquire::{AcquisitionSettings, Searcher, samples_needed};
use gnss_twin::receiver::correlate::{Edge, Nco, Replica, chips_to_units};
use gnss_twin::receiver::source::Block;

const ROUNDS: usize = 15;
const CHANNELS: usize = 12;
const CHIP_HZ: f64 = 1.023e6;

struct Row {
    figure: String,
    unit: &'static str,
    bar: &'static str,
    run: Box<dyn FnMut() -> f64>,
    values: Vec<f64>,
}

/// Noise of 8 bits, by a 64-bit congruential generator.
fn noise(bytes: usize) -> Vec<u8> {
    let mut state = 1_u64;
    let mut next = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 32) as u32
    };
    // Four uniform variables: standard deviation 18 LSB.
    (0..bytes).map(|_| ((0..4).map(|_| next() % 32).sum::<u32>() as i32 - 62) as i8 as u8).collect()
}

/// Channel·samples a second, in 1e9: blocks of 50 ms (at most 2^17 samples) unpacked once, then every channel period by period.
fn tracking(rate_hz: f64, edge: Edge) -> Box<dyn FnMut() -> f64> {
    let block = ((rate_hz * 0.05) as usize).min(1 << 17);
    let period = (rate_hz * 1e-3) as usize;
    let bytes = noise(2 * block);
    let replicas: Vec<Replica> = (1..=CHANNELS).filter_map(|prn| Replica::new(l1ca::code(prn as u8)?, edge)).collect();
    let taps = [0.25, 0.0, -0.25].map(chips_to_units);
    let (mut i, mut q) = (Vec::new(), Vec::new());
    Box::new(move || {
        let begin = Instant::now();
        Format::Ci8.unpack(&bytes, &mut i, &mut q);
        let mut done = 0;
        for (n, replica) in replicas.iter().enumerate() {
            let nco = Nco {
                carrier: 0,
                carrier_step: (n as u64 + 1) << 52,
                code: chips_to_units(n as f64 * 0.1),
                code_step: chips_to_units(CHIP_HZ / rate_hz) as u64,
            };
            // Periods of a real channel begin anywhere.
            let (i, q) = (&i[n..], &q[n..]);
            for (i, q) in i.chunks_exact(period).zip(q.chunks_exact(period)) {
                black_box(replica.correlate(i, q, &nco, &taps));
                done += period;
            }
        }
        done as f64 / begin.elapsed().as_secs_f64() / 1e9
    })
}

/// Seconds for a search of 32 satellites, of which twelve are there at 44 dB-Hz; plans and code spectra are made before.
fn acquisition(settings: AcquisitionSettings, threads: usize) -> Box<dyn FnMut() -> f64> {
    let rate_hz = 2.6e6;
    let rate = Rate::from_hz(rate_hz).expect("a rate");
    let metadata = IfMetadata { format: Format::Ci8, rate, center_hz: L1_CA.carrier_hz, inverted: false, start: None };
    let samples = samples_needed(&metadata, &settings).expect("settings") as usize;
    let (mut i, mut q) = (Vec::new(), Vec::new());
    Format::Ci8.unpack(&noise(2 * samples), &mut i, &mut q);
    let amplitude = 18.5 * (2.0 * libm::pow(10.0, 4.4) / rate_hz).sqrt();
    for n in 0..12_u8 {
        let code = l1ca::code(2 * n + 1).expect("a code");
        let doppler_hz = 700.0 * (f64::from(n) - 5.5);
        for k in 0..samples {
            let chip = (f64::from(n) * 77.7 + k as f64 * CHIP_HZ / rate_hz) as usize % 1023;
            let sign = if code[chip] { -amplitude } else { amplitude };
            let angle = std::f64::consts::TAU * doppler_hz * k as f64 / rate_hz;
            i[k] += (sign * libm::cos(angle)) as f32;
            q[k] += (sign * libm::sin(angle)) as f32;
        }
    }
    let candidates: Vec<(&'static Signal, Sv)> = (1..=32).map(|prn| (&L1_CA, Sv::gps(prn))).collect();
    let mut searcher = Searcher::new(&metadata, &settings).expect("settings");
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
    Box::new(move || {
        let block = Block { first: 0, i: &i, q: &q };
        let begin = Instant::now();
        let rows = pool.install(|| searcher.search(&block, &candidates)).expect("a search");
        let elapsed_s = begin.elapsed().as_secs_f64();
        assert_eq!(rows.iter().filter(|row| row.1.is_some()).count(), 12);
        elapsed_s
    })
}

fn unpacking() -> Box<dyn FnMut() -> f64> {
    let bytes = noise(2 * 130_000);
    let (mut i, mut q) = (Vec::new(), Vec::new());
    Box::new(move || {
        let begin = Instant::now();
        Format::Ci8.unpack(black_box(&bytes), &mut i, &mut q);
        black_box(&i);
        130_000.0 / begin.elapsed().as_secs_f64() / 1e9
    })
}

fn main() {
    let row = |figure: String, unit, bar, run| Row { figure, unit, bar, run, values: Vec::new() };
    let mut rows = Vec::new();
    for (edge, name) in [(Edge::Area, "area"), (Edge::Nearest, "nearest")] {
        for msps in [2.6, 10.0] {
            let figure = format!("tracking {name} edges 3 taps ci8 {msps} Msps 1 core");
            rows.push(row(figure, "G channel samples/s", ">= 1.6", tracking(msps * 1e6, edge)));
        }
    }
    let noncoherent = AcquisitionSettings { coherent_periods: 1, doppler_step_cycles: 0.5, ..Default::default() };
    for (settings, name) in [(AcquisitionSettings::default(), "10 x 2 ms"), (noncoherent, "10 x 1 ms")] {
        let figure = format!("acquisition 32 PRN 5 kHz {name} 2.6 Msps 2 cores");
        rows.push(row(figure, "s", "<= 0.15", acquisition(settings, 2)));
    }
    rows.push(row("unpack ci8 1 core".to_owned(), "G samples/s", "-", unpacking()));
    for _ in 0..ROUNDS {
        for row in &mut rows {
            let value = (row.run)();
            row.values.push(value);
        }
    }
    println!("figure, value, unit, bar");
    for row in &mut rows {
        row.values.sort_by(f64::total_cmp);
        println!("{}, {:.3}, {}, {}", row.figure, row.values[ROUNDS / 2], row.unit, row.bar);
    }
}
