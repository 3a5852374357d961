//! What a sample of a satellite costs in the kernels, strips included: `cargo bench --bench kernels` prints a
//! row for every signal and rate with the time in ns of every edge and arithmetic; `-- NAME` those of the
//! signals whose names hold that. Least of fifteen runs of six satellites, on one core.

use std::time::Instant;

use gnss_twin::generator::fidelity::{Arithmetic, CodeEdge};
use gnss_twin::generator::synth::band::Filter;
use gnss_twin::generator::synth::bank::Bank;
use gnss_twin::generator::synth::isa::Level;
use gnss_twin::generator::synth::waveform::{Voice, Waveform};
use gnss_twin::generator::synth::{CODE_ONE, Edge, Kernel, RUN_SAMPLES, Run};
use gnss_twin::gnss::signal::{Layers, SIGNALS, Signal};
use gnss_twin::gnss::time::Epoch;

const RATES_MSPS: [f64; 8] = [2.6, 4.092, 4.1, 6.5, 10.23, 12.5, 25.0, 65.0];
const SATELLITES: usize = 6;

/// Cycles modulo one, in 2^-64 turn.
fn turns(cycles: f64) -> u64 {
    ((cycles - cycles.floor()) * 18_446_744_073_709_551_616.0) as u64
}

/// The sequences of some satellites; `None` where the rate does not do.
fn sequences(signal: &'static Signal, edge: Edge<'_>, rate_hz: f64) -> Option<Vec<Vec<(Voice, u64, f64)>>> {
    let mut found = Vec::new();
    for sv in signal.satellites().take(SATELLITES) {
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

/// Time for a sample of a satellite, once.
fn once_ns(satellites: &[Vec<(Voice, u64, f64)>], kernel: Kernel<'_>, rate_hz: f64, bank: &mut Bank) -> f64 {
    const BLOCKS: usize = 2;
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

fn main() {
    let wanted = std::env::args().skip(1).find(|argument| !argument.starts_with('-'));
    let filter = Filter::new(0.45);
    let mut bank = Bank::default();
    println!("signal,rate_msps,sequences,nearest_f32,area_f32,band_f32,nearest_f64,area_f64,band_f64");
    for signal in SIGNALS.into_iter().filter(|signal| wanted.as_ref().is_none_or(|name| signal.name.contains(name))) {
        for rate_msps in RATES_MSPS {
            let rate_hz = 1e6 * rate_msps;
            let mut row = Vec::new();
            let mut count = 0;
            for (_, arithmetic) in Arithmetic::NAMES {
                for (_, code_edge) in CodeEdge::NAMES {
                    let edge = match code_edge {
                        CodeEdge::Nearest => Edge::Nearest,
                        CodeEdge::Area => Edge::Area,
                        CodeEdge::BandLimited => Edge::BandLimited(&filter),
                    };
                    let Some(satellites) = sequences(signal, edge, rate_hz) else { continue };
                    count = satellites.first().map_or(0, Vec::len);
                    let kernel = Kernel { edge, arithmetic, level: Level::detect() };
                    let mut all: Vec<f64> = (0..15).map(|_| once_ns(&satellites, kernel, rate_hz, &mut bank)).collect();
                    all.sort_by(f64::total_cmp);
                    row.push(all[0]);
                }
            }
            if row.len() == 6 {
                let row: Vec<String> = row.iter().map(|ns| format!("{ns:8.3}")).collect();
                println!("{},{rate_msps},{count},{}", signal.name, row.join(","));
            }
        }
    }
}
