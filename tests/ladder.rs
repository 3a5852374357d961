//! The ladder of fidelity: for every signal and rate `fast` costs no more than `balanced`, and that no more
//! than `reference`; errors go the other way.
//!
//! Cost is work, not time: instructions of one satellite's synthesis without noise, strips of its code
//! included, as callgrind counts them. The same machine code gives the same count on a busy machine.
//! This program runs itself under valgrind, once a signal. Limits: an instruction of a wide vector counts as
//! one of a narrow one; valgrind knows AVX2 but no AVX-512, whose times `benches/trade` measures.
#![cfg(feature = "generator")]

use std::io::Write as _;
use std::path::Path;
use std::process::Command;

use generator::fidelity::{CodeEdge, Fidelity, Grade, allowed_m, code_bias_m};
use generator::synth::band::Filter;
use generator::synth::bank::Bank;
use generator::synth::isa::Level;
use generator::synth::waveform::{Voice, Waveform};
use generator::synth::{CODE_ONE, Edge, Kernel, RUN_SAMPLES, Run};
use gnss::signal::{Layers, SIGNALS, Signal};
use gnss::time::Epoch;
use rayon::prelude::*;

#[path = "common/long.rs"]
mod long;

const RATES_MSPS: [f64; 8] = [2.6, 4.092, 4.1, 6.5, 10.23, 12.5, 25.0, 65.0];
const GRADES: [Grade; 3] = [Grade::Fast, Grade::Balanced, Grade::Reference];
/// Widest instruction set that valgrind knows.
const LEVEL: Level = Level::Avx2;
/// Ladders that are upside down: signal and rate in Msps. Area edges of more than 7.75 steps a sample are
/// read a sample at a time, for a window of 62 steps holds no eight of them; band-limited edges of
/// `reference` are sums over vectors at any rate. With AVX-512 the times are in order (58 and 79 ns).
const KNOWN: [(&str, f64); 1] = [("Galileo E5", 12.5)];
/// Name of the variable that makes this program the one that is counted; its value is a signal's name.
const COUNTED: &str = "GNSS_TWIN_COUNTED";
/// Name of the test that counts.
const NAME: &str = "no_level_costs_more_than_a_more_accurate_one";

/// A sequence of a satellite with its phase in 2^-64 turn and its amplitude.
type Sequence = (Voice, u64, f64);

fn edge(code_edge: CodeEdge, filter: &Filter) -> Edge<'_> {
    match code_edge {
        CodeEdge::Nearest => Edge::Nearest,
        CodeEdge::Area => Edge::Area,
        CodeEdge::BandLimited => Edge::BandLimited(filter),
    }
}

/// The sequences of a signal's first satellite in the order of the generator's; `None` where the rate does
/// not fit.
fn sequences(signal: &'static Signal, edge: Edge<'_>, rate_hz: f64) -> Option<Vec<Sequence>> {
    let link = signal.link(signal.satellites().next()?);
    let mut found = Vec::new();
    for (index, component) in signal.components.iter().enumerate() {
        let Some(waveform) = Waveform::new(link, index).unwrap() else { continue };
        for voice in waveform.voices(Layers::Whole, edge, rate_hz).ok()? {
            let cycles = (component.phase_cycles + voice.phase_cycles).rem_euclid(1.0);
            let amplitude = component.power_share.sqrt() * voice.amplitude;
            found.push((voice, (cycles * 18_446_744_073_709_551_616.0) as u64, amplitude));
        }
    }
    // Those that share a carrier are one ray.
    found.sort_by_key(|(_, turns, _)| turns << 2);
    Some(found)
}

/// Rates of the list at which a signal's samples can be made.
fn rates_hz(signal: &'static Signal) -> Vec<f64> {
    let all = RATES_MSPS.into_iter().map(|rate_msps| 1e6 * rate_msps);
    all.filter(|rate_hz| sequences(signal, Edge::Nearest, *rate_hz).is_some()).collect()
}

/// Two runs of samples.
fn synthesise(satellite: &[Sequence], kernel: Kernel<'_>, rate_hz: f64, bank: &mut Bank, planes: &mut [Vec<f32>; 2]) {
    for block in 0..2 {
        let delay_s = 0.07 + 1e-3 * f64::from(block);
        for (part, (voice, turns, amplitude)) in satellite.iter().enumerate() {
            let step = (voice.spreading.pace().step_rate_hz() / rate_hz * CODE_ONE as f64) as u64;
            let at = voice.spreading.at(Epoch::new(1_300_000_000, 0.0), delay_s);
            bank.push((0, RUN_SAMPLES as u64), part, 0..RUN_SAMPLES, voice.pulse.as_ref(), |bits| Run {
                bits: &[],
                position: voice.spreading.strip(at, step, RUN_SAMPLES, |_| false, bits),
                step,
                turns: *turns,
                turns_step: 0x0123_4567_89ab_cdef,
                amplitude: *amplitude,
                pulse: None,
            });
        }
        let [i, q] = planes;
        bank.render(kernel, i, q);
    }
}

/// Piece that is counted. callgrind finds it by its name, which no function within it shares.
#[inline(never)]
fn counted_piece(
    satellite: &[Sequence],
    kernel: Kernel<'_>,
    rate_hz: f64,
    bank: &mut Bank,
    planes: &mut [Vec<f32>; 2],
) {
    synthesise(satellite, kernel, rate_hz, bank, planes);
    std::hint::black_box(planes);
}

/// The level's knobs for a signal at a rate, without noise that would hide errors.
fn knobs(grade: Grade, signal: &Signal, rate_hz: f64) -> Fidelity {
    Fidelity::suited(grade, rate_hz, allowed_m(None), &[signal]).unwrap()
}

/// Pieces of a signal in the order in which they are made.
fn pieces(signal: &'static Signal) -> Vec<(f64, Grade)> {
    rates_hz(signal).into_iter().flat_map(|rate_hz| GRADES.map(|grade| (rate_hz, grade))).collect()
}

/// Makes every piece of a signal twice. callgrind counts the second time.
fn make(signal: &'static Signal) {
    let filter = Filter::default();
    let mut bank = Bank::default();
    let mut planes = [(); 2].map(|()| vec![0.0; RUN_SAMPLES]);
    assert!(LEVEL.is_available(), "{LEVEL:?}");
    for (rate_hz, grade) in pieces(signal) {
        let knobs = knobs(grade, signal, rate_hz);
        let edge = edge(knobs.code_edge, &filter);
        let satellite = sequences(signal, edge, rate_hz).unwrap();
        let kernel = Kernel { edge, arithmetic: knobs.carrier, level: LEVEL };
        // Scratch grows before it is counted.
        synthesise(&satellite, kernel, rate_hz, &mut bank, &mut planes);
        counted_piece(&satellite, kernel, rate_hz, &mut bank, &mut planes);
    }
}

/// Instructions of each piece of a signal.
fn counts(signal: &'static Signal) -> Vec<u64> {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    let output = Command::new("valgrind")
        .args(["--tool=callgrind", "--toggle-collect=ladder::counted_piece", "--dump-after=ladder::counted_piece"])
        .arg(format!("--callgrind-out-file={}", out.display()))
        .arg(std::env::current_exe().unwrap())
        .args(["--exact", NAME, "--test-threads", "1"])
        .env(COUNTED, signal.name)
        .output()
        .unwrap();
    assert!(output.status.success(), "{signal}: {}", String::from_utf8_lossy(&output.stderr));
    (1..=pieces(signal).len()).map(|number| instructions(&out.with_extension(number.to_string()))).collect()
}

/// Sum of a file of callgrind's.
fn instructions(path: &Path) -> u64 {
    let text = std::fs::read_to_string(path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    let total = text.lines().find_map(|line| line.strip_prefix("totals: ")?.trim().parse().ok());
    let total = total.unwrap_or(0);
    assert!(total > RUN_SAMPLES as u64, "{}: {total} instructions; symbols must not be stripped", path.display());
    total
}

/// True if valgrind is there. Where it is not, the part that needs it counts as left out.
fn has_valgrind() -> bool {
    let found = Command::new("valgrind").arg("--version").output().is_ok_and(|output| output.status.success());
    if !found {
        let _ = writeln!(std::io::stderr(), "skipped: valgrind is absent, nothing counts instructions");
        let note = format!("long/{} {NAME}", env!("CARGO_CRATE_NAME"));
        let _ = std::fs::write(Path::new(env!("CARGO_TARGET_TMPDIR")).join(note), "skipped");
    }
    found
}

#[test]
fn no_level_costs_more_than_a_more_accurate_one() {
    if let Ok(name) = std::env::var(COUNTED) {
        return make(SIGNALS.into_iter().find(|signal| signal.name == name).unwrap());
    }
    if !long::is_asked_for() || !has_valgrind() {
        return;
    }
    let two = rayon::ThreadPoolBuilder::new().num_threads(2).build().unwrap();
    let all: Vec<Vec<u64>> = two.install(|| SIGNALS.par_iter().map(|signal| counts(signal)).collect());
    let (mut ladders, mut upside_down) = (0, Vec::new());
    for (signal, counts) in SIGNALS.into_iter().zip(all) {
        let pieces = pieces(signal);
        for (counts, pieces) in counts.chunks_exact(3).zip(pieces.chunks_exact(3)) {
            let (rate_hz, _) = pieces[0];
            let edges = GRADES.map(|grade| knobs(grade, signal, rate_hz).code_edge.name());
            let line = format!("{signal} at {:.3} Msps: {counts:?} of {edges:?}", 1e-6 * rate_hz);
            println!("{line}");
            ladders += 1;
            if !counts.is_sorted() {
                let known = KNOWN.iter().any(|known| known.0 == signal.name && 1e6 * known.1 == rate_hz);
                println!("ladder: upside down{}: {line}", if known { ", as known" } else { "" });
                upside_down.push((known, line));
            }
        }
    }
    println!("ladder: {} of {ladders} in order", ladders - upside_down.len());
    upside_down.retain(|(known, _)| !known);
    assert!(upside_down.is_empty(), "{upside_down:#?}");
}

#[test]
fn no_level_errs_less_than_a_more_accurate_one() {
    let looked: Vec<usize> = SIGNALS
        .par_iter()
        .map(|signal| {
            let rates_hz = rates_hz(signal);
            for rate_hz in &rates_hz {
                let of = GRADES.map(|grade| knobs(grade, signal, *rate_hz));
                let [fast, balanced, reference] = of.map(|knobs| {
                    let code_m = code_bias_m(knobs.code_edge, signal, *rate_hz);
                    [code_m, knobs.carrier.error_cycles(), knobs.noise.error_cycles(), knobs.knot_tolerance_cycles]
                });
                for (what, k) in ["code", "carrier", "noise", "knots"].into_iter().zip(0..) {
                    let [a, b, c] = [fast[k], balanced[k], reference[k]];
                    assert!(a >= b && b >= c, "{signal} at {rate_hz} Hz, {what}: {a:e}, {b:e}, {c:e}");
                }
            }
            rates_hz.len()
        })
        .collect();
    // AltBOC has 122.76 million steps a second, and a sample holds 15 at most: four rates are too low for it.
    assert_eq!(looked.iter().sum::<usize>(), SIGNALS.len() * RATES_MSPS.len() - 4);
}
