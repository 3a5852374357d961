//! The laws of every effect and stage: zero strength is absence, and bytes depend on nothing but scene and
//! seed.

use std::path::Path;

use gnss_twin::generator::scenario::{Overrides, Scenario};
use gnss_twin::generator::scene::Scene;
use gnss_twin::generator::stream::{Options, generate_with};
use gnss_twin::generator::synth::isa::Level;
use gnss_twin::generator::truth;

const BASE: &str = "name = \"laws\"\nstart = 2010-07-01T08:05:58\nduration_s = 0.12\nseed = 3\n\
    [motion]\nkind = \"static\"\nlatitude_deg = 26.5\nlongitude_deg = 80.2\nheight_m = 130\n\
    [satellites]\nmask_deg = 30\n";

/// Tables of a scenario, each with one that has no strength where there is such a thing.
const TABLES: &[(&str, Option<&str>)] = &[
    ("[ionosphere]\nmodel = \"klobuchar\"", None),
    ("[troposphere]\nmodel = \"saastamoinen\"", None),
    ("[troposphere]\nmodel = \"saastamoinen\"\nmapping = \"vmf3\"\nvmf_file = \"tests/effects/coarse.vmf3\"", None),
    ("[receiver_clock]\nbias_s = 1e-4\ndrift_sps = 1e-7", Some("[receiver_clock]\nbias_s = 0\ndrift_sps = 0")),
    (
        "[receiver_clock]\nageing_per_day = 1e-7\noscillator = \"tcxo\"",
        Some("[receiver_clock]\nageing_per_day = 0\nsensitivity_per_g = 0"),
    ),
    ("[scintillation]\ns4 = 0.6\ndecorrelation_s = 0.5", Some("[scintillation]\ns4 = 0\ndecorrelation_s = 0.5")),
    (
        "[[multipath]]\nkind = \"ground\"\namplitude = 0.4\nheight_m = 2",
        Some("[[multipath]]\nkind = \"ground\"\namplitude = 0\nheight_m = 2"),
    ),
    ("[attitude]\nkind = \"fixed\"\nspin_hz = 5\nlever_arm_m = [0.1, 0.2, 0]\n[power]\nantenna = \"turnstile\"", None),
    (
        "[[obstruction]]\nkind = \"sector\"\nfrom_deg = 300\nto_deg = 100\nroof_deg = 60\nloss_db = 10",
        Some("[[obstruction]]\nkind = \"sector\"\nfrom_deg = 300\nto_deg = 100\nroof_deg = 60\nloss_db = 0"),
    ),
    (
        "[ionosphere]\nmodel = \"constant_tec\"\nvtec_tecu = 20",
        Some("[ionosphere]\nmodel = \"constant_tec\"\nvtec_tecu = 0"),
    ),
    ("[noise]", None),
    ("[playback]\nbits = 4", None),
    (
        "[local_oscillator]\noffset_hz = 333\nphase_noise_rad = 0.2\nphase_noise_bandwidth_hz = 3000",
        Some("[local_oscillator]\noffset_hz = 0"),
    ),
    ("[filter]\nkind = \"brick_wall\"\nbandwidth_hz = 2e6", None),
    ("[filter]\nkind = \"butterworth\"\norder = 3\nbandwidth_hz = 2e6", None),
    (
        "[iq]\ngain_db = 1\nphase_deg = 3\ndc_i_lsb = 2",
        Some("[iq]\ngain_db = 0\nphase_deg = 0\ndc_i_lsb = 0\ndc_q_lsb = 0"),
    ),
    ("[orbits]\nsp3 = \"data/witness/igs15904.sp3.gz\"", None),
    (
        "[[satellite_fault]]\nkind = \"clock_step\"\nsatellites = [\"G23\"]\nstep_s = 1e-7\non_s = 0.05",
        Some("[[satellite_fault]]\nkind = \"clock_step\"\nsatellites = [\"G23\"]\nstep_s = 0"),
    ),
    (
        "[[satellite_fault]]\nkind = \"clock_ramp\"\nsatellites = [\"G23\"]\ndrift_sps = 1e-8\non_s = 0.01\noff_s = 0.1",
        Some("[[satellite_fault]]\nkind = \"clock_ramp\"\nsatellites = [\"G23\"]\ndrift_sps = 0"),
    ),
    ("[[satellite_fault]]\nkind = \"clock_noise\"\noscillator = \"cesium1\"", None),
    (
        "[[satellite_fault]]\nkind = \"orbit\"\nsatellites = [\"G23\"]\nradial_m = 30",
        Some("[[satellite_fault]]\nkind = \"orbit\"\nsatellites = [\"G23\"]\nradial_m = 0"),
    ),
    (
        "[[message_fault]]\nkind = \"bit_errors\"\nrate = 0.3",
        Some("[[message_fault]]\nkind = \"bit_errors\"\nrate = 0"),
    ),
    // The fault begins at 58.00 s of the minute, and what is sent to 58.05 s is bits 21 to 23 of word 7 of
    // subframe 5.
    ("[[message_fault]]\nkind = \"bit\"\nsubframe = 5\nword = 7\nbit = 22", None),
    ("[noise]\n[adc]\nbits = 2\nagc_window_s = 0.004", None),
];

fn scene(tables: &str, seed: Option<u64>) -> Scene {
    let scenario = Scenario::parse(&format!("{BASE}{tables}\n"), "laws.toml").unwrap();
    scenario.compose(Path::new("."), &Overrides { seed, ..Overrides::default() }).unwrap().0
}

fn bytes(scene: &Scene, options: &Options) -> Vec<u8> {
    let directory = tempfile::tempdir().unwrap();
    let mut bytes = Vec::new();
    let mut writer = truth::Writer::create(directory.path()).unwrap();
    generate_with(scene, &mut bytes, &mut writer, &mut |_| (), options).unwrap();
    bytes
}

#[test]
fn bytes_depend_neither_on_threads_nor_on_the_cut_nor_on_the_instruction_set() {
    for (tables, _) in TABLES {
        let scene = scene(tables, None);
        let expected = bytes(&scene, &Options::default());
        for (threads, block_runs, batch_blocks, level) in [(1, 1, 3, Level::detect()), (3, 5, 1, Level::Baseline)] {
            let options = Options { block_runs, batch_blocks, level };
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            assert!(pool.install(|| bytes(&scene, &options)) == expected, "{tables}: {threads} threads, {options:?}");
        }
    }
}

#[test]
fn everything_present_changes_the_samples_and_nothing_of_zero_strength_does() {
    let bare = bytes(&scene("", None), &Options::default());
    for (tables, zero) in TABLES {
        assert!(bytes(&scene(tables, None), &Options::default()) != bare, "{tables} changes nothing");
        if let Some(zero) = zero {
            assert!(bytes(&scene(zero, None), &Options::default()) == bare, "{zero} changes something");
        }
    }
}

#[test]
fn the_seed_moves_what_is_random_and_nothing_else() {
    for (tables, _) in TABLES {
        let random = ["oscillator = ", "scintillation", "[noise]", "phase_noise", "bit_errors"]
            .iter()
            .any(|word| tables.contains(word));
        let [a, b] = [1, 2].map(|seed| bytes(&scene(tables, Some(seed)), &Options::default()));
        assert_eq!(a != b, random, "{tables}");
    }
}
