//! Tests of propagation between satellites and antenna, as a scenario writes it.

use super::*;
use gnss::gps::lnav;

pub(super) const IONEX: &str = "[ionosphere]\nmodel = \"ionex\"\nfile = \"igrg3380.10i.gz\"\nmap_start = \
                                2010-12-04T10:00:00\n\
    interpolation = \"bicubic\"\nmapping = \"modified_single_layer\"\n";
pub(super) const TEC: &str =
    "[ionosphere]\nmodel = \"constant_tec\"\nvtec_tecu = 20\nshell_km = 400\nmapping = \"single_layer\"\n";
pub(super) const NEQUICK: &str =
    "[ionosphere]\nmodel = \"nequick_g\"\nai = [120, 0.25, 0.0125]\nbroadcast_ai = [100, 0.125, 0]\n";
pub(super) const BDGIM: &str = "[ionosphere]\nmodel = \"bdgim\"\nbdgim_tecu = [30.875, 0.25, 11.625, 10.375, -12.5, \
                                0.75, 0, 3.125, 1.875]\nbroadcast_bdgim_tecu = [20, 0, 8, 4, -8, 0, 0, 1, 0.5]\n";
pub(super) const VIENNA: &str = "[troposphere]\nmodel = \"saastamoinen\"\nmapping = \"vmf1\"\ngpt3_file \
                                 = \"gpt3_5.grd\"\nvmf_file = \"VMF3_20181125.H00\"\n";

#[test]
fn what_the_satellites_send_stands_apart_from_what_nature_does() {
    let directory = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenarios");
    let sent = "broadcast_alpha = [2e-8, 0, 0, 0]\nbroadcast_beta = [1e5, 0, 0, 0]\n";
    let message = |lines: &str| {
        let text = format!("{MINIMAL}{STATIC}{lines}");
        let (scene, _) = parse(&text).unwrap().compose(&directory, &Overrides::default()).unwrap();
        let truth = scene.effects[0].describe();
        let ephemeris = scene.catalogue.sent_at(Sv::gps(13), scene.clock.start).unwrap();
        // Page 18 of subframe 4 comes within 25 frames of 30 s, the fourth subframe 18 s into a frame.
        let found = (0..26).find_map(|k| {
            let at = Epoch::new(scene.clock.start.seconds() / 30 * 30 + 30 * k + 18, 0.0);
            let symbols = scene.messages.of(&lnav::LNAV)?.unit(ephemeris, at).ok()?;
            lnav::Subframe::decode(&lnav::words(&symbols), 0).ok()?.klobuchar()
        });
        (truth, found)
    };
    let (truth, found) = message(&format!("{IONEX}{sent}"));
    assert!(truth.contains("IONEX") && truth.contains("bicubic"), "{truth}");
    // 2e-8 in steps of 2^-30.
    assert!((found.unwrap().alpha[0] - 2e-8).abs() < 5e-10);
    let file = gnss::rinex::embedded().unwrap().klobuchar.unwrap();
    for lines in [IONEX, TEC] {
        assert!((message(lines).1.unwrap().alpha[0] - file.alpha[0]).abs() < 5e-10);
    }
}

#[test]
fn maps_of_another_day_are_refused_unless_the_scene_says_so() {
    let directory = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenarios");
    let compose = |lines: &str| {
        let text = format!("{MINIMAL}{STATIC}{lines}");
        let composed = parse(&text).unwrap().compose(&directory, &Overrides::default());
        composed.map(|_| ()).map_err(|e| e.to_string())
    };
    assert_eq!(compose(IONEX), Ok(()));
    let error = compose(&IONEX.replace("map_start = 2010-12-04T10:00:00\n", "")).unwrap_err();
    assert!(error.contains("2010-12-04T00:00:15") && error.contains("2010-07-01T10:00:00"), "{error}");
    assert!(error.contains("ionosphere.map_start"), "{error}");
    let error = compose(&IONEX.replace("2010-12-04T10", "2010-12-05T10")).unwrap_err();
    assert!(error.contains("ionosphere.file"), "{error}");
    let error = compose(&IONEX.replace("igrg3380.10i.gz", "ride.csv")).unwrap_err();
    assert!(error.contains("ride.csv:1") && error.contains("IONEX VERSION / TYPE"), "{error}");
}

#[test]
fn nequick_wants_coefficients_and_sends_what_the_scene_says() {
    let compose = |lines: &str| {
        let text = format!("{MINIMAL}{STATIC}{lines}");
        parse(&text).unwrap().compose(Path::new("."), &Overrides::default())
    };
    let (scene, _) = compose(NEQUICK).unwrap();
    assert!(scene.effects[0].describe().contains("NeQuick-G"));
    // The file of 2010 has none of Galileo's.
    let error = compose("[ionosphere]\nmodel = \"nequick_g\"\n").err().unwrap().to_string();
    assert!(error.contains("write ai here"), "{error}");
    let error = parse(&format!("{MINIMAL}{STATIC}{NEQUICK}alpha = [0, 0, 0, 0]\n")).unwrap_err().to_string();
    assert!(error.contains("unknown key 'ionosphere.alpha'"), "{error}");
    let parsed = parse(&format!("{MINIMAL}{STATIC}{NEQUICK}")).unwrap();
    assert_eq!(parsed.ionosphere.unwrap().sent_nequick(), Some([100.0, 0.125, 0.0]));
}

#[test]
fn bdgim_wants_coefficients_that_messages_carry_and_sends_what_the_scene_says() {
    let compose = |signal: &str, lines: &str| {
        let text = format!("{MINIMAL}{STATIC}{lines}").replace("GPS L1 C/A", signal);
        parse(&text).and_then(|scenario| scenario.compose(Path::new("."), &Overrides::default()))
    };
    let (scene, _) = compose("GPS L1 C/A", BDGIM).unwrap();
    assert!(scene.effects[0].describe().contains("BDGIM"));
    let parsed = parse(&format!("{MINIMAL}{STATIC}{BDGIM}")).unwrap().ionosphere.unwrap();
    assert_eq!(parsed.sent_bdgim_tecu(), Some([20.0, 0.0, 8.0, 4.0, -8.0, 0.0, 0.0, 1.0, 0.5]));
    let own = BDGIM.split_once("broadcast").unwrap().0;
    let parsed = parse(&format!("{MINIMAL}{STATIC}{own}")).unwrap().ionosphere.unwrap();
    assert_eq!(parsed.sent_bdgim_tecu().unwrap()[4], -12.5);
    // The file of 2010 has none of BeiDou's.
    let error = compose("GPS L1 C/A", "[ionosphere]\nmodel = \"bdgim\"\n").err().unwrap().to_string();
    assert!(error.contains("write bdgim_tecu here"), "{error}");
    let zeros = "[ionosphere]\nmodel = \"bdgim\"\nbdgim_tecu = [0, 0, 0, 0, 0, 0, 0, 0, 0]\n";
    let error = compose("GPS L1 C/A", zeros).err().unwrap().to_string();
    assert!(error.contains("ionosphere.bdgim_tecu") && error.contains("not all zero"), "{error}");
    let error = compose("GPS L1 C/A", &BDGIM.replace("-12.5", "-40")).err().unwrap().to_string();
    assert!(error.contains("ionosphere.bdgim_tecu") && error.contains("127.875"), "{error}");
}

#[test]
fn a_key_of_another_model_is_refused() {
    let error = |lines: &str| parse(&format!("{MINIMAL}{STATIC}{lines}")).unwrap_err().to_string();
    assert!(error(&format!("{TEC}alpha = [0, 0, 0, 0]\n")).contains("unknown key 'ionosphere.alpha'"));
    assert!(error(&format!("{IONEX}broadcast_alpha = [0, 0, 0, 0]\n")).contains("broadcast_beta"));
    assert!(error("[[obstruction]]\nkind = \"sector\"\ntop_m = 3\n").contains("unknown key 'obstruction[1].top_m'"));
    let horizon = |azimuths: &str| {
        format!("[[obstruction]]\nkind = \"horizon\"\nazimuth_deg = {azimuths}\nelevation_deg = [10, 20]\n")
    };
    assert!(error(&horizon("[0, 10, 20]")).contains("as many as azimuth_deg has: 3"));
    assert!(error(&horizon("[10, 0]")).contains("ascending"));
    let building = "[[obstruction]]\nkind = \"building\"\neast_m = [20, 10]\nnorth_m = [0, 1]\ntop_m = 3\n";
    assert!(error(building).contains("smaller"));
    for mapping in ["vmf1", "vmf3"] {
        let alone = error(&format!("[troposphere]\nmodel = \"saastamoinen\"\nmapping = \"{mapping}\"\n"));
        assert!(alone.contains("vmf_file or gpt3_file") && alone.contains(mapping), "{alone}");
    }
    let needless = error(&VIENNA.replace("vmf1", "niell"));
    assert!(needless.contains("vmf_file") && needless.contains("\"vmf1\" or \"vmf3\""), "{needless}");
    assert!(error(&format!("{VIENNA}height_m = 3\n")).contains("brings its own"));
}

#[test]
fn vmf3_takes_coefficients_of_its_own_kind_only() {
    let directory = tempfile::tempdir().unwrap();
    let grid = include_str!("../../../../tests/effects/coarse.vmf3");
    std::fs::write(directory.path().join("three"), grid).unwrap();
    std::fs::write(directory.path().join("one"), grid.replace("VMF3 (", "VMF1 (")).unwrap();
    std::fs::write(directory.path().join("headless"), grid.replace('!', "%")).unwrap();
    let compose = |mapping: &str, file: &str| {
        let table =
            format!("[troposphere]\nmodel = \"saastamoinen\"\nmapping = \"{mapping}\"\nvmf_file = \"{file}\"\n");
        let composed = parse(&format!("{MINIMAL}{STATIC}{table}"))
            .unwrap()
            .compose(directory.path(), &Overrides::default())
            .map(|(scene, _)| scene.effects[0].describe());
        composed.map_err(|e| e.to_string())
    };
    assert!(compose("vmf3", "three").unwrap().ends_with("; VMF3 mapping off a grid"));
    assert!(compose("vmf3", "headless").unwrap().ends_with("; VMF3 mapping off a grid"));
    assert!(compose("vmf1", "one").unwrap().ends_with("; VMF1 mapping off a grid"));
    assert!(compose("vmf1", "three").unwrap().ends_with("; VMF1 mapping off a grid of VMF3"));
    let error = compose("vmf3", "one").unwrap_err();
    assert!(error.contains("troposphere.vmf_file") && error.contains("mapping = \"vmf1\""), "{error}");
}
