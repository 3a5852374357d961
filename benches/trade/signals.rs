//! Cost of a satellite's sample in the kernels, and its code errors, for every signal, rate, edge and
//! arithmetic. Costs are medians of interleaved runs of six satellites, strips included. Errors are those of
//! `tests/common/lines.rs`, over satellites and positions of the code on the sampling grid.

use std::time::Instant;

use generator::fidelity::{Arithmetic, CodeEdge, LOOP_HZ, code_bias_m, moving_bias_m};
use generator::synth::band::Filter;
use generator::synth::bank::Bank;
use generator::synth::isa::Level;
use generator::synth::waveform::{Voice, Waveform};
use generator::synth::{CODE_ONE, Edge, Kernel, RUN_SAMPLES, Run};
use gnss::satellite::System;
use gnss::signal::{Layers, SIGNALS, Signal};
use gnss::time::Epoch;
use rayon::prelude::*;
use serde::Serialize;
use statrs::distribution::{ChiSquared, ContinuousCDF};

use super::lines::{Code, Found};

const RATES_MSPS: [f64; 8] = [2.6, 4.092, 4.1, 6.5, 10.23, 12.5, 25.0, 65.0];
/// Satellites whose samples are timed together.
const TIMED: usize = 6;
/// Satellites of a component whose errors are looked at, at least and at most. All are taken if there are
/// fewer.
pub const JUDGED: [usize; 2] = [8, 32];
/// Code phases of each, at least and at most.
pub const PHASES: [usize; 2] = [2, 8];
/// Runs of each timing.
pub const ROUNDS: usize = 15;
/// Codes that repeat after more are left out.
const LONGEST_S: f64 = 0.0201;
/// Samples of all satellites and code phases of a component, about.
const SAMPLES: f64 = 1e6;

/// A median with what it may be: ranks of the sorted runs that hold it with 95 %.
#[derive(Clone, Copy, Debug)]
pub struct Interval {
    pub median: f64,
    pub low: f64,
    pub high: f64,
}

impl Interval {
    /// Interval of the median of some runs: ranks `n/2 ± 0.98·√n`, by the binomial distribution of the number
    /// of runs below.
    fn of_median(mut values: Vec<f64>) -> Self {
        values.sort_by(f64::total_cmp);
        let (count, last) = (values.len() as f64, values.len().saturating_sub(1));
        let at = |rank: f64| values.get((rank.max(0.0) as usize).min(last)).copied().unwrap_or(f64::NAN);
        let reach = 0.98 * count.sqrt();
        Self { median: at(0.5 * count), low: at(0.5 * count - reach), high: at((0.5 * count + reach).ceil()) }
    }
}

/// An edge of a signal at a rate, in both arithmetics.
#[derive(Clone, Debug, Serialize)]
pub struct SignalRow {
    pub signal: String,
    pub sample_rate_msps: f64,
    pub code_edge: String,
    /// Time for a sample of a satellite in the kernels, and both ends of its interval.
    pub f32_ns: f64,
    pub f32_low_ns: f64,
    pub f32_high_ns: f64,
    pub f64_ns: f64,
    pub f64_low_ns: f64,
    pub f64_high_ns: f64,
    /// Error of the code at rest of the component that errs most, root mean square over satellites and
    /// code phases.
    pub code_rms_m: f64,
    /// Satellites of that component whose codes differ.
    pub codes: usize,
    /// Satellites and code phases of it.
    pub draws: usize,
    /// Error that the plan states for it, in metres.
    pub stated_m: f64,
    /// The largest error of all, and where it was met.
    pub code_largest_m: f64,
    pub largest_at: String,
    /// Errors of single precision: code in metres (rms), and carrier over a period in cycles (largest).
    pub f32_code_m: f64,
    pub carrier_cycles: f64,
    /// Power of the samples that the exact code within the band does not correlate with.
    pub lost_db: f64,
}

impl SignalRow {
    /// Time for a sample of a satellite.
    pub fn cost(&self, arithmetic: Arithmetic) -> Interval {
        match arithmetic {
            Arithmetic::F32 => Interval { median: self.f32_ns, low: self.f32_low_ns, high: self.f32_high_ns },
            Arithmetic::F64 => Interval { median: self.f64_ns, low: self.f64_low_ns, high: self.f64_high_ns },
        }
    }

    /// Ratio of the stated error to the measured one.
    pub fn ratio(&self) -> f64 {
        self.stated_m / self.code_rms_m
    }

    /// Both ends of the ratio to what infinitely many random codes would measure, with 95 %. The error of one
    /// code is a wave over its phase, of two random amplitudes: a mean square of n codes is χ² of 2n degrees.
    pub fn ratio_of_many(&self) -> [f64; 2] {
        let degrees = 2.0 * self.codes as f64;
        let squares = ChiSquared::new(degrees).unwrap();
        [0.025, 0.975].map(|share| self.ratio() * (squares.inverse_cdf(share) / degrees).sqrt())
    }
}

/// Cycles modulo one, in 2^-64 turn.
fn turns(cycles: f64) -> u64 {
    ((cycles - cycles.floor()) * 18_446_744_073_709_551_616.0) as u64
}

/// The sequences of some satellites; `None` where the rate does not do.
fn sequences(signal: &'static Signal, edge: Edge<'_>, rate_hz: f64) -> Option<Vec<Vec<(Voice, u64, f64)>>> {
    let mut found = Vec::new();
    for sv in signal.satellites().take(TIMED) {
        let mut own = Vec::new();
        for (index, component) in signal.components.iter().enumerate() {
            let waveform = Waveform::new(signal.link(sv), index).ok()??;
            for voice in waveform.voices(Layers::Whole, edge, rate_hz).ok()? {
                let cycles = component.phase_cycles + voice.phase_cycles;
                let amplitude = component.power_share.sqrt() * voice.amplitude;
                own.push((voice, turns(cycles), amplitude));
            }
        }
        let cross = |one: &(Voice, u64, f64)| one.1 << 2;
        own.sort_by_key(cross);
        found.push(own);
    }
    Some(found)
}

/// Time for a sample of a satellite, once: shorter than a slice of the scheduler, whose own count of
/// processor time moves in steps of milliseconds.
fn once_ns(satellites: &[Vec<(Voice, u64, f64)>], kernel: Kernel<'_>, rate_hz: f64, bank: &mut Bank) -> f64 {
    const BLOCKS: usize = 4;
    let (mut i, mut q) = (vec![0.0; RUN_SAMPLES], vec![0.0; RUN_SAMPLES]);
    let begin = Instant::now();
    for block in 0..BLOCKS {
        for (number, own) in satellites.iter().enumerate() {
            let delay_s = 0.07 + 1.1e-4 * number as f64 + 1e-3 * block as f64;
            let doppler = 1.0 + 1e-6 * number as f64;
            for (part, (voice, turns, amplitude)) in own.iter().enumerate() {
                let step = (voice.spreading.pace().step_rate_hz() * doppler / rate_hz * CODE_ONE as f64) as u64;
                let at = voice.spreading.at(Epoch::new(1_300_000_000, 0.0), delay_s);
                bank.push((0, RUN_SAMPLES as u64), part, 0..RUN_SAMPLES, voice.pulse.as_ref(), |bits| Run {
                    bits: &[],
                    position: voice.spreading.strip(at, step, RUN_SAMPLES, |_| false, bits),
                    step,
                    turns: *turns,
                    turns_step: 0x0123_4567_89ab_cdef + ((number as u64) << 50),
                    amplitude: *amplitude,
                    pulse: None,
                });
            }
        }
        bank.render(kernel, &mut i, &mut q);
    }
    std::hint::black_box((&i, &q));
    begin.elapsed().as_secs_f64() * 1e9 / (BLOCKS * RUN_SAMPLES * satellites.len()) as f64
}

/// The edge and arithmetic of each setting.
fn kernels(filter: &Filter) -> Vec<(CodeEdge, Kernel<'_>)> {
    let mut found = Vec::new();
    for (_, code_edge) in CodeEdge::NAMES {
        for (_, arithmetic) in Arithmetic::NAMES {
            let edge = match code_edge {
                CodeEdge::Nearest => Edge::Nearest,
                CodeEdge::Area => Edge::Area,
                CodeEdge::BandLimited => Edge::BandLimited(filter),
            };
            found.push((code_edge, Kernel { edge, arithmetic, level: Level::detect() }));
        }
    }
    found
}

/// Costs of every setting, rounds interleaved; `None` where the rate does not do.
fn costs(signal: &'static Signal, kernels: &[(CodeEdge, Kernel<'_>)], rate_hz: f64) -> Option<Vec<Interval>> {
    let all: Vec<_> = kernels.iter().map(|(_, k)| sequences(signal, k.edge, rate_hz)).collect::<Option<_>>()?;
    let (mut bank, mut times) = (Bank::default(), vec![Vec::new(); kernels.len()]);
    for _ in 0..ROUNDS {
        for ((satellites, (_, kernel)), times) in all.iter().zip(kernels).zip(&mut times) {
            times.push(once_ns(satellites, *kernel, rate_hz, &mut bank));
        }
    }
    Some(times.into_iter().map(Interval::of_median).collect())
}

/// A code that a Doppler moves over the samples, behind a loop.
#[derive(Clone, Debug, Serialize)]
pub struct DopplerRow {
    pub signal: String,
    pub sample_rate_msps: f64,
    pub code_edge: String,
    pub doppler_hz: f64,
    pub code_rms_m: f64,
    pub stated_m: f64,
}

/// Errors over Doppler, of the first component of some signals.
pub fn dopplers() -> Vec<DopplerRow> {
    let mut rows = Vec::new();
    for (name, rate_msps) in [("GPS L1 C/A", 2.6), ("GPS L1 C/A", 4.092), ("Galileo E1", 4.1), ("GPS L5", 12.5)] {
        let Some(signal) = SIGNALS.into_iter().find(|signal| signal.name == name) else { continue };
        let rate_hz = 1e6 * rate_msps;
        for (code_edge, edge) in [(CodeEdge::Nearest, Edge::Nearest), (CodeEdge::Area, Edge::Area)] {
            let kernel = Kernel { edge, arithmetic: Arithmetic::F64, level: Level::detect() };
            for doppler_hz in [0.0, 1.0, 10.0, 100.0, 1000.0, 5000.0] {
                let moved: Vec<f64> = signal
                    .satellites()
                    .step_by(7)
                    .take(4)
                    .collect::<Vec<_>>()
                    .par_iter()
                    .filter_map(|sv| {
                        moving(&Code::new(signal, 0, sv.number)?, kernel, rate_hz, doppler_hz / signal.centre_hz())
                    })
                    .collect();
                let stated_m = moving_bias_m(code_edge, signal, rate_hz, doppler_hz);
                let row = DopplerRow {
                    signal: name.to_owned(),
                    sample_rate_msps: rate_msps,
                    code_edge: code_edge.name().to_owned(),
                    doppler_hz,
                    code_rms_m: rms(moved.into_iter()),
                    stated_m,
                };
                println!("{row:?}");
                rows.push(row);
            }
        }
    }
    rows
}

/// Root mean square of what a loop of 0.5 Hz follows of a code that drifts by so many seconds a second.
fn moving(code: &Code, kernel: Kernel<'_>, rate_hz: f64, drift: f64) -> Option<f64> {
    const SECONDS: f64 = 8.0;
    const SETTLED_S: f64 = 2.0;
    let voices = code.voices(kernel, rate_hz)?;
    // Errors repeat with a sample's step of the delay: at the middles of its parts.
    const PLACES: usize = 256;
    let errors: Vec<f64> = (0..PLACES)
        .map(|place| {
            let delay_s = 0.07 + (place as f64 + 0.5) / PLACES as f64 / rate_hz;
            code.against(&code.samples(&voices, kernel, rate_hz, delay_s), delay_s).code_m
        })
        .collect();
    let (mut followed, mut found) = (0.0, Vec::new());
    for period in 0..(SECONDS / code.period_s) as usize {
        let time_s = period as f64 * code.period_s;
        let place = (0.37 + drift * time_s * rate_hz).rem_euclid(1.0);
        let error_m = errors.get((place * PLACES as f64) as usize).copied()?;
        // Bandwidth B of a first-order loop: a gain of 4 B.
        followed += 4.0 * LOOP_HZ * code.period_s * (error_m - followed);
        if drift == 0.0 {
            followed = error_m;
        }
        if time_s >= SETTLED_S {
            found.push(followed);
        }
    }
    Some(rms(found.into_iter()))
}

/// Errors of one component of a satellite at a position, in both arithmetics.
struct Draw {
    component: usize,
    number: u8,
    delay_s: f64,
    found: [Found; 2],
}

/// Errors at code phases all over the grid, of the setting's edge.
fn draws(codes: &[(usize, u8, Code)], kernels: [Kernel<'_>; 2], rate_hz: f64) -> Vec<Draw> {
    let mut all = Vec::new();
    for of_component in codes.chunk_by(|a, b| a.0 == b.0) {
        let Some((_, _, first)) = of_component.first() else { continue };
        // More codes before more phases.
        let periods = SAMPLES / (first.period_s * rate_hz);
        let wanted = (periods as usize / PHASES[0]).clamp(JUDGED[0], JUDGED[1]).min(of_component.len());
        let places = (periods as usize / wanted).clamp(PHASES[0], PHASES[1]);
        let step = of_component.len() / wanted;
        let some = of_component.iter().step_by(step).take(wanted);
        all.extend(some.flat_map(|one| (0..places).map(move |place| (one, place))));
    }
    let of = |&((component, number, code), place): &(&(usize, u8, Code), usize)| {
        // Golden-section places within a period: of the grid and of the code both.
        let delay_s =
            0.07 + code.period_s * (0.618_033_988_749_895 * (place as f64 + 0.37 * f64::from(*number))).fract();
        let found = kernels.map(|kernel| {
            let voices = code.voices(kernel, rate_hz)?;
            Some(code.against(&code.samples(&voices, kernel, rate_hz, delay_s), delay_s))
        });
        let [Some(a), Some(b)] = found else { return None };
        Some(Draw { component: *component, number: *number, delay_s, found: [a, b] })
    };
    all.par_iter().filter_map(of).collect()
}

fn rms(values: impl Iterator<Item = f64>) -> f64 {
    let (sum, count) = values.fold((0.0, 0.0), |(sum, count), x| (sum + x * x, count + 1.0));
    (sum / f64::max(count, 1.0)).sqrt()
}

/// Rows of every signal whose name holds `wanted`.
pub fn measure(wanted: &str) -> Vec<SignalRow> {
    let filter = Filter::default();
    let kernels = kernels(&filter);
    let signals = || SIGNALS.into_iter().filter(|signal| signal.name.contains(wanted));
    // Costs first: they take a minute of a quiet machine.
    let all_costs: Vec<Vec<Option<Vec<Interval>>>> = signals()
        .map(|signal| RATES_MSPS.iter().map(|rate_msps| costs(signal, &kernels, 1e6 * rate_msps)).collect())
        .collect();
    eprintln!("costs are measured");
    let mut rows = Vec::new();
    for (signal, all_costs) in signals().zip(&all_costs) {
        let numbers: Vec<u8> = signal.satellites().map(|sv| sv.number).collect();
        let step = (numbers.len() / JUDGED[1]).max(1);
        let mut codes = Vec::new();
        for (index, _) in signal.components.iter().enumerate().filter(|(_, c)| c.period_s() < LONGEST_S) {
            let some = numbers.iter().step_by(step).take(JUDGED[1]);
            codes.extend(some.filter_map(|&number| Some((index, number, Code::new(signal, index, number)?))));
        }
        for (rate_msps, costs) in RATES_MSPS.into_iter().zip(all_costs) {
            let rate_hz = 1e6 * rate_msps;
            let Some(costs) = costs else { continue };
            for (pair, costs) in kernels.chunks_exact(2).zip(costs.chunks_exact(2)) {
                let draws = draws(&codes, [pair[0].1, pair[1].1], rate_hz);
                // Of the component that errs most, as the model states it.
                let of = |index: usize| {
                    let own = || draws.iter().filter(move |draw| draw.component == index);
                    let mut numbers: Vec<_> = own().map(|draw| draw.number).collect();
                    numbers.dedup();
                    // All satellites of GLONASS send one code.
                    let codes = if signal.system == System::Glonass { 1 } else { numbers.len() };
                    (rms(own().map(|draw| draw.found[1].code_m)), own().count(), codes)
                };
                let (code_rms_m, count, codes) = (0..signal.components.len())
                    .map(of)
                    .fold((0.0, 0, 0), |worst, one| if one.0 > worst.0 { one } else { worst });
                let Some(worst) =
                    draws.iter().max_by(|a, b| a.found[1].code_m.abs().total_cmp(&b.found[1].code_m.abs()))
                else {
                    continue;
                };
                let row = SignalRow {
                    signal: signal.name.to_owned(),
                    sample_rate_msps: rate_msps,
                    code_edge: pair[0].0.name().to_owned(),
                    f32_ns: costs[0].median,
                    f32_low_ns: costs[0].low,
                    f32_high_ns: costs[0].high,
                    f64_ns: costs[1].median,
                    f64_low_ns: costs[1].low,
                    f64_high_ns: costs[1].high,
                    code_rms_m,
                    codes,
                    draws: count,
                    stated_m: code_bias_m(pair[0].0, signal, rate_hz),
                    code_largest_m: worst.found[1].code_m,
                    largest_at: format!(
                        "component {} of {}, sent {:.9} s before a whole second",
                        worst.component + 1,
                        worst.number,
                        worst.delay_s
                    ),
                    f32_code_m: rms(draws.iter().map(|draw| draw.found[0].code_m - draw.found[1].code_m)),
                    carrier_cycles: draws
                        .iter()
                        .map(|draw| (draw.found[0].carrier_cycles - draw.found[1].carrier_cycles).abs())
                        .fold(0.0, f64::max),
                    lost_db: -10.0
                        * libm::log10(
                            1.0 - draws.iter().map(|draw| draw.found[1].lost).sum::<f64>() / draws.len() as f64,
                        ),
                };
                println!("{row:?}");
                rows.push(row);
            }
        }
    }
    rows
}
