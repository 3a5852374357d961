//! Cases 52 and 66: the same bytes on every instruction set that the processor has, and by one thread.

use generator::stream::Options;
use generator::synth::isa::Level;
use gnss::satellite::Sv;
use gnss::signal::SIGNALS;
use rayon::prelude::*;

use crate::figures::{ALL, case};
use crate::{run, skies};

/// Everything that is compiled for each of them: chips, carriers, noise, a tone, and the packing of samples.
const TABLES: &str = "[noise]\n[[interference]]\nkind = \"cw\"\noffset_hz = 1e5\njs_db = 30\n[receiver_clock]\n\
                      bias_s = 1e-3\ndrift_sps = 1e-6\noscillator = \"tcxo\"\n";

#[test]
fn every_instruction_set_makes_the_same_bytes_of_every_signal() {
    let the = case(66, "two instruction sets", ALL);
    let levels: Vec<Level> = Level::ALL.into_iter().filter(|level| level.is_available()).collect();
    let alone = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    let held: Vec<[usize; 4]> = SIGNALS
        .par_iter()
        .map(|signal| {
            let mut held = [0; 4];
            for (edge, carrier) in [("nearest", "f32"), ("area", "f32"), ("band_limited", "f32"), ("area", "f64")] {
                let front = skies::front_end(signal, 12.5e6, 1e5).replace("cf32", "ci8");
                let fidelity = format!("[fidelity]\ncode_edge = \"{edge}\"\ncarrier = \"{carrier}\"\n");
                let scene = skies::scene(&[signal], 0.01, &format!("{front}{TABLES}{fidelity}"));
                let up: Vec<Sv> = skies::in_view(&scene, signal).into_iter().take(1).collect();
                let scene = run::only(scene, &up);
                // Beginnings and ends of runs among them.
                let made = |level: &Level| {
                    let options = Options { level: *level, ..Options::default() };
                    run::part_with(&scene, 4001..16_388, tempfile::tempdir().unwrap().path(), &options)
                };
                let first = made(&levels[0]);
                assert!(first.iter().any(|byte| *byte != first[0]));
                held[0] += levels[1..].iter().filter(|level| made(level) == first).count();
                held[1] += levels.len() - 1;
                held[2] += usize::from(edge != "area" || alone.install(|| made(&levels[0])) == first);
                held[3] += 1;
            }
            held
        })
        .collect();
    let sum = |which: usize| held.iter().map(|held| held[which]).sum::<usize>();
    let threads = case(52, "determinism", ALL);
    threads.all("1 thread, and all: same bytes of every signal", sum(2), sum(3));
    if levels.len() > 1 {
        let names: Vec<String> = levels.iter().map(|level| format!("{level:?}").to_lowercase()).collect();
        let figure = format!("pieces with the same bytes on {}", names.join(", "));
        the.all(&figure, sum(0), sum(1));
    }
}
