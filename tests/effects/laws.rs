//! The laws of every effect and stage: zero strength is absence, and bytes depend on nothing but scene and
//! seed.

use std::path::Path;

use generator::scenario::{Overrides, Scenario};
use generator::scene::Scene;
use generator::stream::{Options, generate_with};
use generator::synth::isa::Level;
use generator::truth;

/// A scene for each signal that satellites send, with what its tables call a satellite and precise orbits.
struct Base {
    scenario: &'static str,
    satellite: &'static str,
    orbits: &'static str,
}

const GPS: Base = Base {
    scenario: "name = \"laws\"\nstart = 2010-07-01T08:05:58\nduration_s = 0.12\nseed = 3\n\
        [motion]\nkind = \"static\"\nlatitude_deg = 26.5\nlongitude_deg = 80.2\nheight_m = 130\n\
        [satellites]\nmask_deg = 30\n",
    satellite: "G23",
    orbits: "igs15904.sp3.gz",
};
const GALILEO: Base = Base {
    scenario: "name = \"laws\"\nstart = 2020-11-29T12:50:31\nduration_s = 0.12\nseed = 3\nsignals = [\"Galileo E1\"]\n\
        [motion]\nkind = \"static\"\nlatitude_deg = 37.6\nlongitude_deg = -1\nheight_m = 130\n\
        [satellites]\nmask_deg = 30\n",
    satellite: "E19",
    orbits: "COD21340.sp3.gz",
};

impl Base {
    /// Tables as this base has their satellite and orbits; `None` of those that are about another message or
    /// place.
    fn tables(&self, tables: &str) -> Option<String> {
        let is_its_own = tables.contains("word = 7") || tables.contains("street.city.json");
        let other = self.satellite != GPS.satellite && is_its_own;
        (!other).then(|| tables.replace(GPS.satellite, self.satellite).replace(GPS.orbits, self.orbits))
    }

    /// Every table with the one without strength.
    fn all(&self) -> impl Iterator<Item = (String, Option<String>)> {
        let both = |(tables, zero): &(&str, Option<&str>)| {
            Some((self.tables(tables)?, zero.and_then(|zero| self.tables(zero))))
        };
        TABLES.iter().filter_map(both)
    }
}

/// Tables of a scenario, each with one that has no strength where there is such a thing.
const TABLES: &[(&str, Option<&str>)] = &[
    ("[ionosphere]\nmodel = \"klobuchar\"", None),
    ("[ionosphere]\nmodel = \"nequick_g\"\nai = [120, 0.3, 0.01]", None),
    ("[ionosphere]\nmodel = \"bdgim\"\nbdgim_tecu = [31, 0.25, 11, 10, -12, 0.75, 0, 3, 2]", None),
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
    ("[power]\ncn0_dbhz = 45\n[[interference]]\nkind = \"matched\"\njs_db = 10", None),
    ("[[spoofer]]\npower_db = 3\nclock_bias_s = 1e-6", None),
    (
        "[city]\nfile = \"scenarios/street.city.json\"\nmaterial = \"metal\"\ncross_polar_db = 0\norder = 2\n\
         latitude_deg = 26.5\nlongitude_deg = 80.2\nheight_m = 130\norigin_m = [0, 95, 1.5]",
        None,
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
        "[[satellite_fault]]\nkind = \"clock_ramp\"\nsatellites = [\"G23\"]\ndrift_sps = 1e-8\non_s = 0.01\noff_s = \
         0.1",
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

fn scene(base: &Base, tables: &str, seed: Option<u64>) -> Scene {
    let scenario = Scenario::parse(&format!("{}{tables}\n", base.scenario), "laws.toml").unwrap();
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
    for (base, (tables, _)) in [&GPS, &GALILEO].into_iter().flat_map(|base| base.all().map(move |one| (base, one))) {
        let scene = scene(base, &tables, None);
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
    for base in [&GPS, &GALILEO] {
        let bare = bytes(&scene(base, "", None), &Options::default());
        for (tables, zero) in base.all() {
            let of = |tables: &str| bytes(&scene(base, tables, None), &Options::default());
            assert!(of(&tables) != bare, "{tables} changes nothing of {}", base.satellite);
            if let Some(zero) = zero {
                assert!(of(&zero) == bare, "{zero} changes something of {}", base.satellite);
            }
        }
    }
}

#[test]
fn the_seed_moves_what_is_random_and_nothing_else() {
    for (base, (tables, _)) in [&GPS, &GALILEO].into_iter().flat_map(|base| base.all().map(move |one| (base, one))) {
        let random = ["oscillator = ", "scintillation", "[noise]", "phase_noise", "bit_errors", "matched"]
            .iter()
            .any(|word| tables.contains(word));
        let [a, b] = [1, 2].map(|seed| bytes(&scene(base, &tables, Some(seed)), &Options::default()));
        assert_eq!(a != b, random, "{tables}");
    }
}
