//! Speed of the receiver against its bars, and what its correlators err: `cargo bench --bench receiver`
//! prints the rows of `reports/performance.md` and, with `-- --write`, writes them there.
//!
//! Speeds are medians of runs that take turns, so that a disturbance of the machine meets all of them. Errors
//! are against correlation in `f64` of the same samples, millisecond by millisecond.

#[path = "shared/machine.rs"]
mod machine;
#[path = "shared/page.rs"]
mod page;

use std::fmt::Write as _;
use std::hint::black_box;
use std::time::Instant;

use num_complex::Complex64;

use gnss::galileo::e1::{self, E1};
use gnss::gps::l1ca::{self, L1_CA};
use gnss::samples::{Format, IfMetadata};
use gnss::satellite::Sv;
use gnss::signal::Link;
use gnss::time::Rate;
use receiver::acquire::{AcquisitionSettings, Searcher, samples_needed};
use receiver::correlate::sums::{RunningSums, Samples};
use receiver::correlate::{Arithmetic, CODE_BITS, Edge, Nco, Replica, Wave, chips_to_units};
use receiver::source::Block;

const ROUNDS: usize = 15;
const CHANNELS: usize = 12;
const CHIP_HZ: f64 = 1.023e6;
const CHIP_M: f64 = 299_792_458.0 / CHIP_HZ;
/// Early, prompt and late, in chips.
const TAPS: [f64; 3] = [0.25, 0.0, -0.25];
/// Vector operations of 512 bits for 32 samples and three taps with area edges in 16 bits, counted in the
/// source: 8 to make integers, 6 to turn them, 14 a tap.
const OPERATIONS: f64 = 8.0 + 6.0 + 3.0 * 14.0;
/// Largest number of such operations a cycle, on Zen 4 (two halves each on four ports) as on two ports of
/// Intel's.
const OPERATIONS_A_CYCLE: f64 = 2.0;

struct Row {
    figure: String,
    unit: &'static str,
    /// Smallest, or with a minus sign largest, value wanted.
    bar: Option<f64>,
    run: Box<dyn FnMut() -> f64>,
    values: Vec<f64>,
}

/// Oscillators of channel `n`: all of them differ, and the Dopplers are those of a sky.
fn oscillators(n: usize, rate_hz: f64) -> Nco {
    let doppler_hz = 700.0 * (n as f64 - 5.4);
    Nco {
        carrier: 0,
        carrier_step: (doppler_hz / rate_hz * 18_446_744_073_709_551_616.0) as i64 as u64,
        code: chips_to_units(n as f64 * 0.1),
        code_step: chips_to_units(CHIP_HZ / rate_hz) as u64,
    }
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

/// Samples as channels are shown them.
fn unpacked<'a>(
    bytes: &[u8],
    arithmetic: Arithmetic,
    (i, q): (&'a mut Vec<f32>, &'a mut Vec<f32>),
    room: &'a mut RunningSums,
) -> Samples<'a> {
    Format::Ci8.unpack(bytes, i, q);
    let sums = if arithmetic == Arithmetic::Sums { room.of(i, q) } else { None };
    Samples { i, q, sums, fixed: None }
}

/// Channel·samples a second, in 1e9: blocks of 50 ms (at most 2^17 samples) unpacked and, where it is asked
/// for, summed up once, then every channel period by period.
fn tracking(rate_hz: f64, edge: Edge, arithmetic: Arithmetic) -> Box<dyn FnMut() -> f64> {
    let block = ((rate_hz * 0.05) as usize).min(1 << 17);
    let period = (rate_hz * 1e-3) as usize;
    let bytes = noise(2 * block);
    let replicas: Vec<Replica> = (1..=CHANNELS).filter_map(|prn| Replica::new(l1ca::code(prn as u8)?, edge)).collect();
    let taps = TAPS.map(chips_to_units);
    // The twin is not waited for.
    let channels = if arithmetic == Arithmetic::F64 { 1 } else { CHANNELS };
    let (mut i, mut q, mut room) = (Vec::new(), Vec::new(), RunningSums::default());
    Box::new(move || {
        let begin = Instant::now();
        let samples = unpacked(&bytes, arithmetic, (&mut i, &mut q), &mut room);
        let mut done = 0;
        for (n, replica) in replicas.iter().take(channels).enumerate() {
            let nco = oscillators(n, rate_hz);
            // Periods of a real channel begin anywhere.
            for from in (n..=block - period).step_by(period) {
                black_box(replica.correlate_in(arithmetic, samples.part(from, from + period), &nco, &taps));
                done += period;
            }
        }
        done as f64 / begin.elapsed().as_secs_f64() / 1e9
    })
}

/// Seconds for a search of 32 satellites, of which twelve are there at 44 dB-Hz; plans and code spectra are
/// made before.
fn acquisition(settings: AcquisitionSettings, threads: usize) -> Box<dyn FnMut() -> f64> {
    let rate_hz = 2.6e6;
    let rate = Rate::from_hz(rate_hz).expect("a rate");
    let metadata = IfMetadata { format: Format::Ci8, rate, center_hz: L1_CA.centre_hz(), inverted: false, start: None };
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
    let candidates: Vec<Link> = (1..=32).map(|prn| L1_CA.link(Sv::gps(prn))).collect();
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

/// Seconds for a first search of all GPS and all Galileo satellites at 10 Msps, plans and code spectra made
/// on the way; ten of each are there, from 41 to 50 dB-Hz.
fn cold_search(threads: usize) -> Box<dyn FnMut() -> f64> {
    let rate_hz = 10e6;
    let rate = Rate::from_hz(rate_hz).expect("a rate");
    let metadata = IfMetadata { format: Format::Ci8, rate, center_hz: L1_CA.centre_hz(), inverted: false, start: None };
    let signals = vec![L1_CA.name.to_owned(), E1.name.to_owned()];
    let settings = AcquisitionSettings { signals, ..Default::default() };
    let samples = samples_needed(&metadata, &settings).expect("settings") as usize;
    let (mut i, mut q) = (Vec::new(), Vec::new());
    Format::Ci8.unpack(&noise(2 * samples), &mut i, &mut q);
    let signs = |one: bool| if one { -1.0 } else { 1.0 };
    for n in 0..10_u8 {
        let amplitude = 18.5 * (2.0 * libm::pow(10.0, 4.1 + 0.1 * f64::from(n)) / rate_hz).sqrt();
        let gps = l1ca::code(3 * n + 1).expect("a code");
        let [data, pilot] = [e1::Code::Data, e1::Code::Pilot].map(|which| e1::code(which, 3 * n + 1).expect("a code"));
        for (doppler_hz, is_gps) in [(700.0 * (f64::from(n) - 4.6), true), (650.0 * (4.4 - f64::from(n)), false)] {
            let step = CHIP_HZ / rate_hz * (1.0 + doppler_hz / L1_CA.centre_hz());
            for k in 0..samples {
                let chips = f64::from(n) * 377.7 + k as f64 * step;
                let (chip, period) = (chips as usize, (chips / 4092.0) as usize);
                let value = if is_gps {
                    signs(gps[chip % 1023])
                } else {
                    let square = |rate: f64| signs((chips * 2.0 * rate) as u64 % 2 == 1);
                    let (one, six) = ((10.0_f64 / 22.0).sqrt() * square(1.0), (1.0_f64 / 22.0).sqrt() * square(6.0));
                    let symbol = [3, 4].map(|every| signs(period.is_multiple_of(every)));
                    let [data, pilot] = [&data, &pilot].map(|code| f64::from(code[chip % 4092]));
                    symbol[0] * data * (one + six) - symbol[1] * pilot * (one - six)
                };
                let angle = std::f64::consts::TAU * (doppler_hz * k as f64 / rate_hz).fract();
                i[k] += (amplitude * value * libm::cos(angle)) as f32;
                q[k] += (amplitude * value * libm::sin(angle)) as f32;
            }
        }
    }
    let gps = (1..=32).map(|prn| L1_CA.link(Sv::gps(prn)));
    let galileo = (1..=36).map(|number| E1.link(Sv { system: E1.system, number }));
    let candidates: Vec<Link> = gps.chain(galileo).collect();
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
    Box::new(move || {
        let block = Block { first: 0, i: &i, q: &q };
        let begin = Instant::now();
        let mut searcher = Searcher::new(&metadata, &settings).expect("settings");
        let rows = pool.install(|| searcher.search(&block, &candidates)).expect("a search");
        let elapsed_s = begin.elapsed().as_secs_f64();
        assert_eq!(rows.iter().filter(|row| row.1.is_some()).count(), 20);
        elapsed_s
    })
}

/// Benchmark as in [`tracking`] of the pilot of Galileo E1 with five taps, and of the data beside it with
/// one, at 10 Msps.
fn tracking_pairs(arithmetic: Arithmetic) -> Box<dyn FnMut() -> f64> {
    let (rate_hz, block, period) = (10e6, 1 << 17, 40_000);
    let bytes = noise(2 * block);
    let of = |component: usize| -> Vec<Replica> {
        let wave = |number| Wave::new(&E1.components[component], number);
        (1..=CHANNELS as u8).filter_map(|number| Replica::of(wave(number)?, Edge::Area)).collect()
    };
    let (data, pilot) = (of(0), of(1));
    let taps = [0.15, 0.0, -0.15, 0.5, -0.5].map(chips_to_units);
    let (mut i, mut q, mut room) = (Vec::new(), Vec::new(), RunningSums::default());
    Box::new(move || {
        let begin = Instant::now();
        let all = unpacked(&bytes, arithmetic, (&mut i, &mut q), &mut room);
        let mut done = 0;
        for (n, (data, pilot)) in data.iter().zip(&pilot).enumerate() {
            let nco = oscillators(n, rate_hz);
            for from in (n..=block - period).step_by(period) {
                let samples = all.part(from, from + period);
                black_box(pilot.correlate_in(arithmetic, samples, &nco, &taps));
                black_box(data.correlate_in(arithmetic, samples, &nco, &[0]));
                done += period;
            }
        }
        done as f64 / begin.elapsed().as_secs_f64() / 1e9
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

/// Errors of an arithmetic against `f64`: code in metres and carrier in cycles, largest mean of a satellite
/// and root mean square of a millisecond, and lost C/N0 in decibels.
struct Errors {
    code_mean_m: f64,
    code_rms_m: f64,
    carrier_rms_cycles: f64,
    loss_db: f64,
}

/// Over a second of three satellites at 45 dB-Hz in noise of 18 LSB, rounded to 8 bits.
fn errors(arithmetic: Arithmetic, rate_hz: f64) -> Errors {
    let period = (rate_hz * 1e-3) as usize;
    let mut worst = Errors { code_mean_m: 0.0, code_rms_m: 0.0, carrier_rms_cycles: 0.0, loss_db: 0.0 };
    for (prn, doppler_hz) in [(3_u8, -2100.0), (11, 40.0), (22, 1700.0)] {
        let code = l1ca::code(prn).expect("a code");
        let replica = Replica::new(code.clone(), Edge::Area).expect("a replica");
        let step = chips_to_units(CHIP_HZ * (1.0 + doppler_hz / L1_CA.centre_hz()) / rate_hz);
        let carrier_step = (doppler_hz / rate_hz * 18_446_744_073_709_551_616.0) as i64 as u64;
        let amplitude = 18.5 * (2.0 * libm::pow(10.0, 4.5) / rate_hz).sqrt();
        let taps = TAPS.map(chips_to_units);
        let (mut code_m, mut cycles) = (Vec::new(), Vec::new());
        let (mut tested_power, mut exact_power) = (0.0, 0.0);
        let bytes = noise(2 * period * 1000);
        for ms in 0..1000 {
            let first = (ms * period) as i64;
            let nco = Nco {
                carrier: carrier_step.wrapping_mul(first as u64),
                carrier_step,
                code: (first * step).rem_euclid(replica.period()),
                code_step: step as u64,
            };
            let (mut i, mut q) = (Vec::new(), Vec::new());
            Format::Ci8.unpack(&bytes[2 * first as usize..][..2 * period], &mut i, &mut q);
            for n in 0..period {
                let chip = ((nco.code + n as i64 * step).rem_euclid(replica.period()) >> CODE_BITS) as usize;
                let sign = if code[chip] { -amplitude } else { amplitude };
                let turns = carrier_step.wrapping_mul((first + n as i64) as u64) as f64 / 18_446_744_073_709_551_616.0;
                let (sin, cos) = libm::sincos(std::f64::consts::TAU * turns);
                i[n] = (f64::from(i[n]) + sign * cos).round().clamp(-127.0, 127.0) as f32;
                q[n] = (f64::from(q[n]) + sign * sin).round().clamp(-127.0, 127.0) as f32;
            }
            let mut room = RunningSums::default();
            let samples = Samples { i: &i, q: &q, sums: room.of(&i, &q), fixed: None };
            let tested = replica.correlate_in(arithmetic, samples, &nco, &taps);
            let exact = replica.slow(&i, &q, &nco, &taps);
            // Early less late is twice the error of a triangle, over the prompt that the signal has on
            // average.
            let prompt = amplitude * period as f64;
            let chips = |[early, _, late]: [Complex64; 3]| (early - late).re / (2.0 * prompt);
            code_m.push((chips(tested) - chips(exact)) * CHIP_M);
            cycles.push((tested[1] - exact[1]).im / prompt / std::f64::consts::TAU);
            tested_power += tested[1].re;
            exact_power += exact[1].re;
        }
        let rms = |x: &[f64]| (x.iter().map(|x| x * x).sum::<f64>() / x.len() as f64).sqrt();
        let mean = code_m.iter().sum::<f64>() / code_m.len() as f64;
        worst.code_mean_m = worst.code_mean_m.max(mean.abs());
        worst.code_rms_m = worst.code_rms_m.max(rms(&code_m));
        worst.carrier_rms_cycles = worst.carrier_rms_cycles.max(rms(&cycles));
        worst.loss_db = worst.loss_db.max(-20.0 * libm::log10(tested_power / exact_power));
    }
    worst
}

/// Cycles a second of this core: a rotation and a multiplication that wait for each other take four.
fn clock_ghz() -> f64 {
    const STEPS: u32 = 20_000_000;
    let once = || {
        let begin = Instant::now();
        let mut x = black_box(1_u64);
        for _ in 0..STEPS {
            x = x.rotate_left(7).wrapping_mul(6_364_136_223_846_793_005);
        }
        black_box(x);
        4.0 * f64::from(STEPS) / begin.elapsed().as_secs_f64() / 1e9
    };
    (0..5).map(|_| once()).fold(0.0, f64::max)
}

fn rows() -> Vec<Row> {
    let mut rows = Vec::new();
    let mut add = |figure: String, unit, bar, run| rows.push(Row { figure, unit, bar, run, values: Vec::new() });
    for (arithmetic, name, bar) in
        [(Arithmetic::I16, "i16", Some(1.6)), (Arithmetic::F32, "f32", None), (Arithmetic::F64, "f64", None)]
    {
        for (edge, edges) in [(Edge::Area, "area"), (Edge::Nearest, "nearest")] {
            for msps in [2.6, 10.0] {
                let figure = format!("tracking in {name}, {edges} edges, 3 taps, ci8, {msps} Msps");
                add(figure, "G channel·samples/s/core", bar, tracking(msps * 1e6, edge, arithmetic));
            }
        }
    }
    for msps in [2.6, 10.0, 20.0] {
        let figure = format!("tracking by sums, area edges, 3 taps, ci8, {msps} Msps");
        add(figure, "G channel·samples/s/core", None, tracking(msps * 1e6, Edge::Area, Arithmetic::Sums));
    }
    let noncoherent = AcquisitionSettings { coherent_periods: 1, doppler_step_cycles: 0.5, ..Default::default() };
    for (settings, name) in [(AcquisitionSettings::default(), "10 × 2 ms"), (noncoherent, "10 × 1 ms")] {
        let figure = format!("search, 32 PRNs, ±5 kHz, {name}, 2.6 Msps, two cores");
        add(figure, "s", Some(-0.15), acquisition(settings, 2));
    }
    add(
        "first search, 32 GPS and 36 Galileo E1, ±5 kHz, 10 Msps, two cores".to_owned(),
        "s",
        Some(-1.0),
        cold_search(2),
    );
    let pairs = [(Arithmetic::Sums, "sums", Some(0.8)), (Arithmetic::I16, "i16", None), (Arithmetic::F32, "f32", None)];
    for (arithmetic, name, bar) in pairs {
        let figure = format!("tracking in {name}, Galileo E1, 5 taps of the pilot and 1 of the data, ci8, 10 Msps");
        add(figure, "G channel·samples/s/core", bar, tracking_pairs(arithmetic));
    }
    add("unpacking ci8".to_owned(), "G samples/s/core", None, unpacking());
    rows
}

impl Row {
    fn median(&self) -> f64 {
        let mut values = self.values.clone();
        values.sort_by(f64::total_cmp);
        values.get(values.len() / 2).copied().unwrap_or(f64::NAN)
    }

    fn text(&self) -> String {
        let value = self.median();
        let (bar, met) = match self.bar {
            None => (String::new(), ""),
            Some(bar) if bar < 0.0 => (format!("at most {}", -bar), if value <= -bar { "yes" } else { "no" }),
            Some(bar) => (format!("at least {bar}"), if value >= bar { "yes" } else { "no" }),
        };
        format!("|{}|{value:.3}|{}|{bar}|{met}|", self.figure, self.unit)
    }
}

/// Bounds of the correlator in 16 bits, from the medians at 2.6 and 10 Msps.
fn limits(rows: &[Row]) -> String {
    let ghz = clock_ghz();
    let [slow, fast] = [0, 1].map(|n| rows.get(n).map_or(f64::NAN, Row::median));
    let limit = 32.0 * OPERATIONS_A_CYCLE * ghz / OPERATIONS;
    // Time of a period: a sample's times their number, and something fixed.
    let (short_ns, long_ns) = (2600.0 / slow, 10_000.0 / fast);
    let sample_ns = (long_ns - short_ns) / 7400.0;
    let fixed_ns = short_ns - 2600.0 * sample_ns;
    format!(
        "**Limit of i16.** With AVX-512, 32 samples and three taps with area edges take {OPERATIONS} operations of 512 \
         bits in 16-bit integers, {OPERATIONS_A_CYCLE} a cycle at most: {limit:.1} G channel·samples a second at the \
         {ghz:.2} GHz measured here. Of a period at 2.6 Msps {:.0} % is fixed ({fixed_ns:.0} ns: powers of the \
         carrier's turn, the last sums, both in f64), and its samples take {sample_ns:.3} ns each, {:.0} % of the \
         limit's speed; loads that cross cache lines, and a processor's window that holds about one group's \
         operations, are what else is known of the rest.\n",
        100.0 * fixed_ns / short_ns,
        100.0 / sample_ns / limit,
    )
}

fn main() {
    let mut rows = rows();
    for _ in 0..ROUNDS {
        for row in &mut rows {
            let value = (row.run)();
            row.values.push(value);
        }
    }
    let mut text = format!(
        "{}; medians of {ROUNDS} interleaved runs. The default is sums for 8-bit formats.\n\n\
         |figure|value|unit|bar|met|\n|---|---|---|---|---|\n",
        machine::machine(),
    );
    for row in &rows {
        let _ = writeln!(text, "{}", row.text());
    }
    let _ = write!(
        text,
        "\n{}\nWhat `tracking.arithmetic` errs against f64, area edges, three satellites at 45 dB-Hz for a second; \
         rms of one millisecond, whose noise is 18 m and 0.02 cycles:\n\n\
         |arithmetic|Msps|code, largest mean (m)|code, rms (m)|carrier, rms (cycles)|C/N0 loss (dB)|\n\
         |---|---|---|---|---|---|\n",
        limits(&rows)
    );
    for (arithmetic, name) in [(Arithmetic::Sums, "sums"), (Arithmetic::I16, "i16"), (Arithmetic::F32, "f32")] {
        for msps in [2.6, 10.0] {
            let found = errors(arithmetic, msps * 1e6);
            let _ = writeln!(
                text,
                "|{name}|{msps}|{:.1e}|{:.1e}|{:.1e}|{:.1e}|",
                found.code_mean_m, found.code_rms_m, found.carrier_rms_cycles, found.loss_db
            );
        }
    }
    println!("{text}");
    if std::env::args().any(|argument| argument == "--write") {
        page::put("receiver", &text).expect("the page and its marks");
    }
}
