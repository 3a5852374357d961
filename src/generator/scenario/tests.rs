mod city;
mod declared;
mod front_end;
mod navigation;
mod osnma;
mod propagation;
mod satellite;
mod shipped;
mod signal_file;
mod spoofing_and_jamming;
mod station;

use std::path::Path;

use declared::{replaced, with};
use propagation::{BDGIM, IONEX, NEQUICK, TEC, VIENNA};
use satellite::FAULTS;

use super::schema::{Absent, Value, tables_of};
use super::*;
use crate::clock::oscillator::PowerLaw;
use crate::effect::multipath::Detour;
use crate::effect::transmit::Block;
use crate::scene::{CodeEdge, Fidelity, Grade};
use crate::vehicle::attitude::Nose;
use gnss::gps::l1ca::L1_CA;
use gnss::samples::Format;
use gnss::signal::Layers;

const MINIMAL: &str = "name = \"test\"\nstart = 2010-07-01T10:00:00\nduration_s = 10\n";
const STATIC: &str = "[motion]\nkind = \"static\"\nlatitude_deg = 26.5\nlongitude_deg = 80.2\nheight_m = 130\n";
const ROCKET: &str = "[motion]\nkind = \"rocket\"\nlatitude_deg = 26.5\nlongitude_deg = 80.2\nheight_m = 130\n\
                      azimuth_deg = 90\n\
    elevation_deg = 80\nignition_s = 1\nthrust_mps2 = 200\nburn_s = 3\njerk_mps3 = 200\ndrag_m2pkg = 1e-5\ngravity \
    = \"j2\"\n";
const WAYPOINTS: &str = "[motion]\nkind = \"waypoints\"\nacceleration_mps2 = 2\njerk_mps3 = 1\n\
                         turn_acceleration_mps2 = 3\n\
    [[motion.point]]\nlatitude_deg = 26.5\nlongitude_deg = 80.2\nheight_m = 130\nspeed_mps = 0\nhold_s = 1\n\
    [[motion.point]]\nlatitude_deg = 26.51\nlongitude_deg = 80.2\nheight_m = 130\nspeed_mps = 20\n";
const FILE: &str = "[motion]\nkind = \"file\"\nfile = \"ride.csv\"\nformat = \"csv\"\nmax_gap_s = 3\n\
                    tolerance_m = 0.1\n";
const ORBIT: &str = "[motion]\nkind = \"orbit\"\nsemi_major_axis_m = 6.9e6\neccentricity = 0.01\ninclination_deg = 51\n\
    node_longitude_deg = 60\nargument_of_perigee_deg = 10\nmean_anomaly_deg = 20\n";
const PUSHED: &str = "[motion]\nkind = \"pushed\"\nlatitude_deg = 26.5\nlongitude_deg = 80.2\nheight_m = 130\n\
                      tick_s = 0.01\njoin_s = 0.1\nhold_s = 0.5\nmax_jerk_mps3 = 20000\n";
const TICKS: &str = "[motion]\nkind = \"ticks\"\nfile = \"ticks.csv\"\nevents = \"events.csv\"\ntick_s = 0.01\n";
const RADIUS: &str = "[motion]\nkind = \"waypoints\"\nturn_radius_m = 30\n";
const REST: &str = "[navigation]\nfile = \"brdc.10n\"\ngalileo_ahead_ns = 3\n[satellites]\nmask_deg = 10\nexclude = \
                    [\"G01\"]\ninclude_unhealthy = true\n\
    [front_end]\nsample_rate_hz = 4e6\nif_hz = 1e6\nspectrum_inverted = true\nformat = \"ri8\"\nnoise_lsb = 3\n\
    [attitude]\nkind = \"fixed\"\nyaw_deg = 30\npitch_deg = 10\nroll_deg = 5\nspin_hz = 2\nlever_arm_m = [1, 0, 0]\n\
    boresight = [0, 1, -1]\n\
    [power]\nkind = \"link_budget\"\ntransmit = \"IIR\"\ntransmit_dbw = 15\nantenna = \"table\"\nantenna_file \
    = \"gain.csv\"\nnoise_figure_db = 2\nloss_db = 1\n\
    blocks = { G05 = \"IIR-M\" }\n\
    [ionosphere]\nmodel = \"klobuchar\"\nalpha = [1e-8, 0, 0, 0]\nbeta = [1e5, 0, 0, 0]\n\
    broadcast_alpha = [2e-8, 0, 0, 0]\nbroadcast_beta = [2e5, 0, 0, 0]\n\
    [troposphere]\nmodel = \"saastamoinen\"\nheight_m = 100\npressure_hpa = 1000\ntemperature_c = 30\n\
    relative_humidity = 0.5\n\
    mapping = \"niell\"\n\
    [[obstruction]]\nkind = \"horizon\"\nazimuth_deg = [0, 90]\nelevation_deg = [10, 20]\nedge_deg = 1\nloss_db = 20\n\
    [[obstruction]]\nkind = \"sector\"\nfrom_deg = 350\nto_deg = 10\nroof_deg = 40\n\
    [[obstruction]]\nkind = \"building\"\neast_m = [10, 20]\nnorth_m = [-5, 5]\ntop_m = 20\n\
    [scintillation]\ns4 = 0.5\nsigma_phi_rad = 0.8\ndecorrelation_s = 1\nsatellites = [\"G02\"]\n\
    [receiver_clock]\nbias_s = 1e-4\ndrift_sps = 1e-7\nageing_per_day = 1e-9\nsensitivity_per_g = 1e-9\noscillator \
    = \"tcxo\"\n[noise]\n\
    [playback]\nbits = 8\nload_sigma = 3\nattenuation_db = 1\n\
    [local_oscillator]\noffset_hz = 10\nphase_noise_rad = 0.1\nphase_noise_bandwidth_hz = 1000\n\
    [city]\nfile = \"street.city.json\"\nlod = \"2\"\nradius_m = 200\nmaterial = \"glass\"\norder = 2\n\
    diffraction = false\ncross_polar_db = 20\nlatitude_deg = 26\nlongitude_deg = 80\nheight_m = 128\n\
    origin_m = [1, 2, 3]\n\
    [filter]\nkind = \"butterworth\"\norder = 4\nbandwidth_hz = 1.8e6\n[iq]\ndc_i_lsb = 0.5\n\
    [adc]\nbits = 2\nstep_sigma = 1\nagc_window_s = 0.001\n\
    [fidelity]\nlevel = \"balanced\"\ncarrier = \"f64\"\nnoise = \"f32\"\ncode_edge = \"nearest\"\n\
    waveform = \"strongest\"\nknot_tolerance_cycles = 1e-3\n[truth]\ninterval_s = 0.5\n\
    [expect]\nfix = \"none\"\nlosses = \"any\"\nsatellites = [\"G02\"]\nerrors = \"any\"\nreason = \"why\"\n\
    [receiver.tracking]\nwhatever = 1\n";
const ECHOES: &str = "[[multipath]]\nkind = \"given\"\namplitude = 0.5\nphase_deg = 90\nsatellites = [\"G13\"]\n\
                      excess_m = 30\nrate_mps = -0.5\n\
    [[multipath]]\nkind = \"ground\"\namplitude = 0.3\nheight_m = 2\n\
    [[multipath]]\nkind = \"wall\"\namplitude = 0.4\nazimuth_deg = 90\ndistance_m = 12\n";

/// Every key of the tables that may occur several times.
const HOSTILE: &str = "[[interference]]\nkind = \"chirp\"\noffset_hz = 1e5\njs_db = 30\non_s = 1\noff_s = 2\n\
                       sweep_hz = -2e6\n\
    sweep_s = 1e-5\n[[interference]]\nkind = \"sine_fm\"\ncenter_hz = 1.5759e9\n\
    power_dbw = -130\ndeviation_hz = 5e4\nrate_hz = 1e4\n\
    [[interference]]\nkind = \"pulse\"\neirp_dbw = -20\nwidth_s = 1e-5\nrate_hz = 1e4\njitter = 0.5\n\
    latitude_deg = 26.6\nlongitude_deg = 80.2\nheight_m = 100\n[[interference]]\nkind = \"noise\"\njs_db = 1\n\
    bandwidth_hz = 1e6\n\
    [[interference]]\nkind = \"recording\"\njs_db = 1\nfile = \"iq.bin\"\nformat = \"ci8\"\nsample_rate_hz = 4e6\n\
    repeat = true\n\
    [[interference]]\nkind = \"cw\"\neirp_dbw = -20\ndistance_m = 500\n\
    [[spoofer]]\npower_db = 6\npower_start_db = -10\nramp_s = 5\non_s = 1\noff_s = 9\nsatellites = [\"G13\"]\n\
    clock_bias_s = 1e-6\nreplay_s = 40\nosnma = \"own_keys\"\n\
    clock_drift_sps = 1e-9\n[spoofer.drag]\nstart_s = 3\nazimuth_deg = 90\nelevation_deg = 0\nspeed_mps = 5\n\
    acceleration_mps2 = 2\n[osnma]\nchain_hash = \"sha3_256\"\nmac_function = \"cmac_aes\"\nmaclt = 33\n\
    status = \"test\"\nwithout = [\"E05\"]\npublic_key_every_s = 900\npublic_key_for_s = 60\nstep_s = 300\n\
    [[osnma.transition]]\nkind = \"alert\"\ntime_s = 600\n";

fn parse(text: &str) -> Result<Scenario, ScenarioError> {
    Scenario::parse(text, "scene.toml")
}

fn full() -> String {
    format!("{MINIMAL}seed = 7\nsignals = [\"GPS L1 C/A\"]\n{STATIC}{ECHOES}{REST}")
}

#[test]
fn every_value_arrives_where_it_belongs_in_si_units() {
    let scenario = parse(&full()).unwrap();
    assert_eq!((scenario.name.as_str(), scenario.seed, scenario.duration_s), ("test", 7, 10.0));
    assert_eq!(scenario.start, Epoch::parse("2010-07-01T10:00:00").unwrap());
    assert_eq!(scenario.mask_rad, 10_f64.to_radians());
    assert_eq!((scenario.excluded.as_slice(), scenario.include_unhealthy), ([Sv::gps(1)].as_slice(), true));
    assert_eq!((scenario.front_ends[0].format, scenario.front_ends[0].inverted), (Format::Ri8, true));
    let power = Power::LinkBudget {
        transmit: Transmit::Block(Block::Iir),
        transmit_dbw: 15.0,
        blocks: vec![(Sv::gps(5), Block::IirM)],
        antenna: AntennaSpec::Table("gain.csv".into()),
        noise_figure_db: 2.0,
        loss_db: 1.0,
    };
    assert_eq!(scenario.power, power);
    let attitude = scenario.attitude.unwrap();
    let [yaw_rad, pitch_rad, roll_rad] = [30.0_f64, 10.0, 5.0].map(f64::to_radians);
    assert_eq!((attitude.nose, attitude.spin_hz), (Nose::Fixed { yaw_rad, pitch_rad, roll_rad }, 2.0));
    assert_eq!(attitude.lever_arm_m, nalgebra::Vector3::x());
    let [given, ground, wall] = scenario.multipath.as_slice() else { panic!("{:?}", scenario.multipath) };
    assert_eq!(given.detour, Detour::Given { excess_m: 30.0, rate_mps: -0.5 });
    assert_eq!(
        (given.amplitude, given.phase_cycles, given.satellites.as_slice()),
        (0.5, 0.25, [Sv::gps(13)].as_slice())
    );
    assert_eq!((ground.detour, ground.phase_cycles), (Detour::Ground { height_m: 2.0 }, 0.5));
    assert_eq!(wall.detour, Detour::Wall { azimuth_rad: 90_f64.to_radians(), distance_m: 12.0 });
    let ionosphere = scenario.ionosphere.unwrap();
    assert!(matches!(ionosphere.truth, Electrons::Klobuchar(Some(k)) if k.alpha[0] == 1e-8));
    assert_eq!(ionosphere.broadcast.unwrap().beta[0], 2e5);
    assert_eq!(scenario.obstacles.len(), 3);
    let Obstacle::Horizon { points_rad, edge_rad, share } = &scenario.obstacles[0] else { panic!("not a horizon") };
    assert_eq!(
        (points_rad[1], *edge_rad, *share),
        ((90_f64.to_radians(), 20_f64.to_radians()), 1_f64.to_radians(), 0.01)
    );
    let tcxo = PowerLaw { h0: 1e-21, hm1: 1e-20, hm2: 2e-20, ..PowerLaw::default() };
    let clock = ClockSpec { bias_s: 1e-4, drift: 1e-7, ageing_per_s: 1e-9 / 86_400.0, per_g: 1e-9, noise: Some(tcxo) };
    assert_eq!(scenario.receiver_clock, clock);
    assert!(scenario.scintillation.is_some_and(|s| s.s4 == 0.5 && s.satellites == Some(vec![Sv::gps(2)])));
    let city = scenario.city.unwrap();
    assert_eq!((city.material.name(), city.order, city.diffraction, city.radius_m), ("glass", 2, false, 200.0));
    let anchor = city.anchor.unwrap();
    assert_eq!((anchor.origin_m, anchor.position.height_m, city.cross), ([1.0, 2.0, 3.0], 128.0, 0.1));
    let fidelity = scenario.front_ends[0].fidelity;
    assert_eq!((fidelity.code_edge, fidelity.waveform), (Some(CodeEdge::Nearest), Some(Layers::Strongest)));
    assert!(scenario.noise && scenario.truth_interval_s == 0.5);
    assert!(scenario.receiver.unwrap().contains_key("tracking"));
}

#[test]
fn absence_is_the_switch() {
    let scenario = parse(&format!("{MINIMAL}{STATIC}")).unwrap();
    assert!(!scenario.noise && scenario.ionosphere.is_none() && scenario.troposphere.is_none());
    assert!(scenario.obstacles.is_empty());
    assert_eq!(scenario.receiver_clock, ClockSpec::default());
    assert!(scenario.receiver.is_none() && scenario.navigation.is_empty());
}

#[test]
fn everything_that_is_wrong_is_said_at_once_in_the_order_of_the_text() {
    let text = format!(
        "{MINIMAL}seed = -1\n[motion]\nkind = \"static\"\nlatitude_deg = 126\nlongitude_deg = 80.2\nheigth_m = 1\n\
         [front_end]\nsample_rate_hz = 4e6\nif_hz = 3e6\nformt = \"ci8\"\n[satellites]\nexclude = [\"X1\"]\n\
         [[interference]]\nkind = \"pulse\"\njs_db = 1\nwidth_s = 1\nrate_hz = 100\n[[interference]]\nkind = \"cv\"\n"
    );
    let error = parse(&text).unwrap_err().to_string();
    let lines: Vec<&str> = error.lines().collect();
    let expected = [
        "seed = -1",
        "motion.latitude_deg = 126",
        "unknown key 'motion.heigth_m': did you mean 'height_m'?",
        "front_end.if_hz = 3e6",
        "unknown key 'front_end.formt'",
        "satellites.exclude",
        "interference[1].width_s = 1",
        "interference[2].kind = \"cv\"",
    ];
    assert_eq!(lines.len(), expected.len(), "{error}");
    for (line, expected) in lines.iter().zip(expected) {
        assert!(line.contains(expected), "{line}: {expected}");
    }
}

#[test]
fn a_key_of_another_kind_of_motion_is_refused() {
    let error = parse(&format!("{MINIMAL}{STATIC}azimuth_deg = 3\n")).unwrap_err().to_string();
    assert!(error.contains("unknown key 'motion.azimuth_deg'") && error.contains("latitude_deg"), "{error}");
    let both = format!("{MINIMAL}{RADIUS}turn_acceleration_mps2 = 3\n");
    assert!(parse(&both).unwrap_err().to_string().contains("only one of"));
}

#[test]
fn a_link_budget_is_refused_for_a_signal_whose_least_power_is_not_known() {
    let mut scenario = parse(&format!("{MINIMAL}{STATIC}[power]\nkind = \"link_budget\"\n")).unwrap();
    let compose = |scenario: &Scenario| scenario.compose(Path::new("scenarios"), &Overrides::default());
    assert!(compose(&scenario).is_ok());
    scenario.signals.push(&gnss::signal::synthetic::LONG_BOC);
    let Err(error) = compose(&scenario) else { panic!("composed") };
    let error = error.to_string();
    assert!(error.contains("power.kind") && error.contains("synthetic A"), "{error}");
    scenario.power = Power::Fixed { cn0_dbhz: 45.0, satellites: Vec::new() };
    assert_eq!(compose(&scenario).unwrap().0.signals.len(), 2);
}

#[test]
fn what_contradicts_itself_is_refused_with_the_computed_number() {
    let front_end = |lines: &str| parse(&format!("{MINIMAL}{STATIC}[front_end]\n{lines}")).unwrap_err().to_string();
    assert!(front_end("sample_rate_hz = 4e6\nif_hz = 2.5e6").contains("2000000 Hz"));
    assert!(front_end("format = \"ri8\"").contains("is real"));
    let error =
        parse(&format!("{MINIMAL}{STATIC}[ionosphere]\nmodel = \"klobuchar\"\nalpha = [0, 0, 0, 0]")).unwrap_err();
    assert!(error.to_string().contains("beta"), "{error}");
    let error = parse(&format!("{MINIMAL}{STATIC}[power]\nkind = \"link_budget\"\ncn0_dbhz = 45")).unwrap_err();
    assert!(error.to_string().contains("unknown key 'power.cn0_dbhz'"), "{error}");
    let iq = format!("{MINIMAL}{STATIC}[front_end]\nformat = \"ri8\"\nif_hz = 1e6\n[iq]\nphase_deg = 1\n");
    assert!(parse(&iq).unwrap_err().to_string().contains("has no Q"));
    let adc = parse(&with("adc", "bits = 12")).unwrap_err().to_string();
    assert!(adc.contains("at most 8 for front_end.format = ci8"), "{adc}");
    let filter = parse(&with("filter", "kind = \"brick_wall\"\norder = 3")).unwrap_err().to_string();
    assert!(filter.contains("no order"), "{filter}");
    let error = parse(&with("", "signals = [\"GPS L1 CA\"]")).unwrap_err();
    assert!(error.to_string().contains("GPS L1 C/A"), "{error}");
    let error = parse(&with("fidelity", "code_edge = \"aera\"")).unwrap_err().to_string();
    assert!(error.contains("did you mean area?"), "{error}");
}

#[test]
fn a_grade_of_inertial_sensors_sets_three_errors_and_a_key_of_its_own_replaces_one() {
    let turned = "[attitude]\nkind = \"fixed\"\n";
    let imu =
        |keys: &str| parse(&format!("{MINIMAL}{STATIC}{turned}[imu]\nrate_hz = 200\n{keys}")).unwrap().imu.unwrap();
    let plain = imu("");
    assert!(!plain.is_noisy() && plain.rate_hz == 200.0 && plain.lever_arm_m == [0.0; 3]);
    let degph = 1_f64.to_radians() / 3600.0;
    let low = imu("grade = \"low\"\nvelocity_random_walk_mps_per_sqrt_h = 0.6\ngyro_bias_deg_per_h = [0, 2, 0]\n");
    // 0.75 deg/√h is 0.0125 deg/√s; 0.6 m/s/√h is 0.01 m/s/√s. Products of a few roundings.
    assert!((low.gyro.random_walk / 0.0125_f64.to_radians() - 1.0).abs() < 1e-15);
    assert!((low.accelerometer.random_walk - 0.01).abs() < 1e-17);
    assert_eq!((low.gyro.bias_instability, low.gyro.bias), (10.0 * degph, [0.0, 2.0 * degph, 0.0]));
    let refused = |text: &str| parse(text).unwrap_err().to_string();
    let error = refused(&format!("{MINIMAL}{STATIC}[imu]\nrate_hz = 100\n"));
    assert!(error.contains("[attitude] beside [imu]"), "{error}");
    let error = refused(&format!("{MINIMAL}{STATIC}{turned}[imu]\nrate_hz = 20\n"));
    assert!(error.contains("imu.rate_hz = 20") && error.contains("50"), "{error}");
    let error = refused(&format!("{MINIMAL}{STATIC}{turned}[imu]\nrate_hz = 100\ngrade = \"tactica\"\n"));
    assert!(error.contains("did you mean tactical?"), "{error}");
    let error = warnings(&format!("{MINIMAL}{PUSHED}{turned}[imu]\nrate_hz = 100\n")).unwrap_err();
    assert!(error.contains("is pushed beside [imu]"), "{error}");
}

#[test]
fn what_cannot_be_turned_or_reflected_is_refused_with_the_remedy() {
    let parsed = |tables: &str| parse(&format!("{MINIMAL}{STATIC}{tables}")).unwrap_err().to_string();
    assert!(parsed("[attitude]\nkind = \"velocity\"\nroll_deg = 3").contains("level"));
    assert!(parsed("[attitude]\nkind = \"pushed\"\nspin_hz = 3").contains("as it is pushed"));
    assert!(parsed("[attitude]\nkind = \"fixed\"\nboresight = [0, 0, 0]").contains("a direction"));
    assert!(
        parsed("[[multipath]]\nkind = \"ground\"\namplitude = 0.5\nheight_m = 2\nexcess_m = 3").contains("excess_m")
    );
    assert!(parsed("[[multipath]]\nkind = \"wall\"\namplitude = 0.5\nazimuth_deg = 3").contains("distance_m"));
    assert!(
        parsed("[[multipath]]\nkind = \"given\"\namplitude = 0.5\nexcess_m = 3\nsatellites = []").contains("absent")
    );
    assert!(parsed("[power]\nantenna = \"table\"").contains("antenna_file"));
    assert!(parsed("[power]\nantenna_file = \"x.csv\"").contains("unless antenna"));
    let composed = |text: &str| warnings(text).unwrap_err();
    let error = composed(&format!("{MINIMAL}{STATIC}[attitude]\nkind = \"pushed\"\n"));
    assert!(error.contains("kind = \"pushed\" or \"ticks\""), "{error}");
    let error = composed(&format!("{MINIMAL}{STATIC}[attitude]\nkind = \"velocity\"\n"));
    assert!(error.contains("use kind = \"fixed\""), "{error}");
    let wall = "[[multipath]]\nkind = \"wall\"\namplitude = 0.5\nazimuth_deg = 0\ndistance_m = 12\n";
    let error = composed(&format!("{MINIMAL}{WAYPOINTS}{wall}"));
    assert!(error.contains("behind the wall") && error.contains("12 m off"), "{error}");
    let given = "[[multipath]]\nkind = \"given\"\namplitude = 0.5\nexcess_m = 3\nrate_mps = -1\n";
    let error = composed(&format!("{MINIMAL}{STATIC}{given}"));
    assert!(error.contains("below 0 after 3.000 s"), "{error}");
    let later = replaced(&format!("{MINIMAL}{STATIC}"), "", "start", "2010-05-01T00:00:00");
    let error = composed(&format!("{later}\n[power]\ntransmit = \"constellation\"\n"));
    assert!(error.contains("power.transmit") || error.contains("expected a scene within"), "{error}");
}

#[test]
fn a_level_sets_every_knob_and_a_knob_overrides_its_level() {
    let of = |text: &str| parse(text).unwrap().front_ends[0].fidelity.suited(2.6e6, &[&L1_CA]).unwrap();
    let fidelity = |lines: &str| of(&with("fidelity", lines));
    assert_eq!(of(&format!("{MINIMAL}{STATIC}")), Fidelity::of(Grade::Balanced));
    for (name, grade) in Grade::NAMES {
        assert_eq!(fidelity(&format!("level = \"{name}\"")), Fidelity::of(grade));
        let own = fidelity(&format!("level = \"{name}\"\nknot_tolerance_cycles = 3e-5"));
        assert_eq!(own, Fidelity { knot_tolerance_cycles: 3e-5, ..Fidelity::of(grade) });
    }
    let every = fidelity("level = \"fast\"\ncode_edge = \"band_limited\"\ncarrier = \"f64\"\nnoise = \"f64\"");
    let expected = Fidelity { grade: Grade::Fast, knot_tolerance_cycles: 4e-4, ..Fidelity::of(Grade::Reference) };
    assert_eq!(every, expected);
    let alone = Fidelity { waveform: Layers::Strongest, ..Fidelity::of(Grade::Balanced) };
    assert_eq!(fidelity("waveform = \"strongest\""), alone);
    for (key, value, hint) in [
        ("level", "\"refrence\"", "did you mean reference?"),
        ("level", "3", "fast, balanced, reference"),
        ("carrier", "\"f16\"", "f32, f64"),
        ("noise", "\"\"", "f32, f64"),
        ("code_edge", "true", "nearest, area, band_limited"),
    ] {
        let error = parse(&with("fidelity", &format!("{key} = {value}"))).unwrap_err().to_string();
        assert!(error.starts_with("scene.toml:") && error.contains(&format!("fidelity.{key} = ")), "{error}");
        assert!(error.contains(hint), "{error}");
    }
    let budget = fidelity("budget = { code_m = 3.0, carrier_cycles = 1e-5 }");
    assert_eq!((budget.grade.name(), budget.code_edge), ("budget", CodeEdge::Area));
    for (lines, hint) in [
        ("budget = {}", "at least one of code_m, carrier_cycles and cn0_db"),
        ("budget = { code_m = 3.0 }\ncarrier = \"f64\"", "nothing beside fidelity.budget"),
        ("budget = { code_m = 0.0 }", "fidelity.budget.code_m = 0"),
    ] {
        let error = parse(&with("fidelity", lines)).unwrap_err().to_string();
        assert!(error.contains(hint), "{error}");
    }
    let error = parse(&with("fidelity", "sample_width = 8")).unwrap_err().to_string();
    assert!(error.contains("unknown key 'fidelity.sample_width'"), "{error}");
}

#[test]
fn damaged_toml_is_refused_with_line_and_column() {
    let error = parse("name = \"a\"\nname = \"b\"\n").unwrap_err();
    assert!(error.to_string().starts_with("scene.toml:2:1"), "{error}");
    assert!(parse("").unwrap_err().to_string().contains("motion"));
    assert!(parse(&"#".repeat(2 << 20)).unwrap_err().to_string().contains("at most"));
    assert!(parse(&format!("x = {}", "[".repeat(100_000))).is_err());
    let error = parse("na\u{1b}me = 1").unwrap_err().to_string();
    assert!(!error.contains('\u{1b}'), "{error:?}");
}

#[test]
fn files_must_lie_below_the_scenario_s_directory() {
    let room = tempfile::tempdir().unwrap();
    let inside = room.path().join("scenes");
    std::fs::create_dir(&inside).unwrap();
    let p = gnss::earth::Geodetic::from_degrees(26.5, 80.2, 130.0).to_ecef();
    let row = |t: f64| format!("{t},{},{},{}\n", p.x, p.y, p.z);
    let ride = format!("time_s,x_m,y_m,z_m\n{}{}{}", row(0.0), row(2.0), row(4.0));
    std::fs::write(room.path().join("ride.csv"), &ride).unwrap();
    std::fs::write(inside.join("ride.csv"), &ride).unwrap();
    std::os::unix::fs::symlink(room.path().join("ride.csv"), inside.join("link.csv")).unwrap();
    let compose = |file: &str, directory: &Path, overrides: &Overrides| {
        let text = replaced(&format!("{MINIMAL}{FILE}"), "motion", "file", &format!("{file:?}"));
        let text = replaced(&text, "", "duration_s", "4");
        parse(&text).unwrap().compose(directory, overrides).map(|_| ()).map_err(|e| e.to_string())
    };
    let strict = Overrides::default();
    assert_eq!(compose("ride.csv", &inside, &strict), Ok(()));
    for outside in ["../ride.csv", "link.csv", room.path().join("ride.csv").to_str().unwrap()] {
        assert!(compose(outside, &inside, &strict).unwrap_err().contains("outside"), "{outside}");
        assert_eq!(compose(outside, &inside, &Overrides { allow_outside: true, ..strict }), Ok(()));
    }
    assert!(compose("none.csv", &inside, &strict).unwrap_err().contains("none.csv"));
    assert!(compose(".", &inside, &strict).unwrap_err().contains("not a file"));
}

#[test]
fn a_motion_that_ends_before_the_scene_is_refused_with_both_times() {
    let error =
        |text: &str| parse(text).unwrap().compose(Path::new("."), &Overrides::default()).err().unwrap().to_string();
    // 1.1 km of which some at 20 m/s, ending in motion.
    let message = error(&replaced(&format!("{MINIMAL}{WAYPOINTS}"), "", "duration_s", "100"));
    assert!(message.contains("but the scene needs") && message.contains("to 100.0"), "{message}");
    let message = error(&replaced(&format!("{MINIMAL}{ROCKET}"), "", "duration_s", "500"));
    assert!(message.contains("kind = \"rocket\" is known from -inf"), "{message}");
}

fn warnings(text: &str) -> Result<Vec<String>, String> {
    let composed = parse(text).unwrap().compose(Path::new("."), &Overrides::default());
    composed.map(|(_, warnings)| warnings).map_err(|e| e.to_string())
}

#[test]
fn a_scene_outside_its_navigation_file_is_refused_with_the_file_s_span() {
    let base = format!("{MINIMAL}{STATIC}");
    let error = warnings(&replaced(&base, "", "start", "2010-07-05T00:00:00")).unwrap_err();
    assert!(error.contains("expected a scene within 2010-06-30T22:") && error.contains("2010-07-02T0"), "{error}");
    let error = warnings(&replaced(&base, "", "duration_s", "200000")).unwrap_err();
    assert!(error.contains("the end of the scene of 200000 s"), "{error}");
    let error =
        warnings(&replaced(&replaced(&full(), "", "duration_s", "2678400"), "front_end", "sample_rate_hz", "60e6"));
    // 2 678 400 s at 60 Msps.
    assert!(error.unwrap_err().contains("1.60704e14 samples"));
}

#[test]
fn what_looks_wrong_but_can_be_computed_is_warned_of() {
    let base = format!("{MINIMAL}{STATIC}");
    let warned = warnings(&format!("{base}[satellites]\nmask_deg = 80\nexclude = [\"G99\"]\n")).unwrap();
    assert!(warned.iter().any(|w| w.contains("a position needs 4")), "{warned:?}");
    let absent = "satellites.exclude names G99: it has no ephemeris at the scene's start";
    assert!(warned.iter().any(|w| w == absent), "{warned:?}");
    let warned = warnings(&format!("{base}[satellites]\nexclude = [\"E01\"]\n")).unwrap();
    assert!(
        warned.iter().any(|w| w == "satellites.exclude names E01: the scene sends no signal of Galileo"),
        "{warned:?}"
    );
    let warned = warnings(&format!("{base}[satellites]\nonly = [\"G23\"]\n")).unwrap();
    assert!(
        warned.iter().any(|w| w.starts_with("1 satellite that sends one of the scene's signals is above ")),
        "{warned:?}"
    );
    let space = include_str!("../../../scenarios/extremes/geo.toml")
        .replace("[motion]", "[satellites]\nonly = [\"G23\"]\n[motion]");
    let warned = warnings(&space).unwrap();
    assert!(
        warned.iter().any(|w| w.contains(" in view past the Earth at the start: a position needs 4")),
        "{warned:?}"
    );
    let warned = warnings(&format!("{base}[front_end]\nsample_rate_hz = 1.5e6\n")).unwrap();
    assert!(warned.iter().any(|w| w.contains("-1.023 to 1.023 MHz")), "{warned:?}");
    // Those of the file itself: a rogue record, and unhealthy satellites.
    assert!(warnings(&base).unwrap().len() <= 2);
}

#[test]
fn power_by_satellite_reaches_the_rays() {
    let text = format!("{MINIMAL}{STATIC}[power]\ncn0_dbhz = 45\n[power.satellites]\nG13 = 30.0\n");
    let (scene, _) = parse(&text).unwrap().compose(Path::new("."), &Overrides::default()).unwrap();
    let motion = scene.trajectory.at(0.0);
    for (sv, cn0_hz) in [(Sv::gps(13), 1e3), (Sv::gps(23), 31_622.776_601_683_79)] {
        let found = crate::sky::emission(&scene.catalogue, sv, scene.clock.start, &motion).unwrap().unwrap();
        let mut rays =
            vec![crate::ray::Ray { code_delay_s: 0.0, carrier_delay_s: 0.0, phase_cycles: 0.0, cn0_hz: 0.0 }];
        scene.effects.iter().for_each(|e| e.act(&found.sight, scene.signals[0], &mut rays));
        // Ten to the tenth of a decimal number: relative rounding of a few 1e-16.
        assert!((rays[0].cn0_hz / cn0_hz - 1.0).abs() < 1e-12, "{sv} {rays:?}");
        assert_eq!(rays[0].code_delay_s, 0.0);
    }
}

#[test]
fn coefficients_that_the_message_cannot_carry_are_refused() {
    let text =
        format!("{MINIMAL}{STATIC}[ionosphere]\nmodel = \"klobuchar\"\nalpha = [1e-5, 0, 0, 0]\nbeta = [0, 0, 0, 0]");
    let error = warnings(&text).unwrap_err();
    assert!(error.contains("ionosphere") && error.contains("cannot carry"), "{error}");
}

proptest::proptest! {
    #[test]
    fn no_text_makes_the_parser_panic(text in "\\PC{0,200}", at in 0_usize..2_000, cut in 0_usize..40) {
        let _ = parse(&text);
        // The full scene with a piece replaced.
        let whole = full();
        let bytes = whole.as_bytes();
        let (from, to) = (at.min(bytes.len()), (at + cut).min(bytes.len()));
        let damaged = [&bytes[..from], text.as_bytes(), &bytes[to..]].concat();
        let _ = parse(&String::from_utf8_lossy(&damaged));
    }
}
