mod hostile;
mod propagation;
mod satellite;

use std::path::Path;

use propagation::{IONEX, TEC, VIENNA};
use satellite::FAULTS;

use super::schema::{Absent, Value, tables_of};
use super::*;
use crate::generator::effect::multipath::Detour;
use crate::generator::effect::transmit::Block;
use crate::generator::ripple::oscillator::PowerLaw;
use crate::generator::vehicle::attitude::Nose;
use crate::gnss::samples::Format;

const MINIMAL: &str = "name = \"test\"\nstart = 2010-07-01T10:00:00\nduration_s = 10\n";
const STATIC: &str = "[motion]\nkind = \"static\"\nlatitude_deg = 26.5\nlongitude_deg = 80.2\nheight_m = 130\n";
const ROCKET: &str = "[motion]\nkind = \"rocket\"\nlatitude_deg = 26.5\nlongitude_deg = 80.2\nheight_m = 130\nazimuth_deg = 90\n\
    elevation_deg = 80\nignition_s = 1\nthrust_mps2 = 200\nburn_s = 3\njerk_mps3 = 200\ndrag_m2pkg = 1e-5\ngravity = \"j2\"\n";
const WAYPOINTS: &str = "[motion]\nkind = \"waypoints\"\nacceleration_mps2 = 2\njerk_mps3 = 1\nturn_acceleration_mps2 = 3\n\
    [[motion.point]]\nlatitude_deg = 26.5\nlongitude_deg = 80.2\nheight_m = 130\nspeed_mps = 0\nhold_s = 1\n\
    [[motion.point]]\nlatitude_deg = 26.51\nlongitude_deg = 80.2\nheight_m = 130\nspeed_mps = 20\n";
const FILE: &str = "[motion]\nkind = \"file\"\nfile = \"ride.csv\"\nformat = \"csv\"\nmax_gap_s = 3\n";
const ORBIT: &str = "[motion]\nkind = \"orbit\"\nsemi_major_axis_m = 6.9e6\neccentricity = 0.01\ninclination_deg = 51\n\
    node_longitude_deg = 60\nargument_of_perigee_deg = 10\nmean_anomaly_deg = 20\n";
const RADIUS: &str = "[motion]\nkind = \"waypoints\"\nturn_radius_m = 30\n";
const REST: &str = "[navigation]\nfile = \"brdc.10n\"\n[satellites]\nmask_deg = 10\nexclude = [\"G01\"]\ninclude_unhealthy = true\n\
    [front_end]\nsample_rate_hz = 4e6\nif_hz = 1e6\nspectrum_inverted = true\nformat = \"ri8\"\nnoise_lsb = 3\n\
    [attitude]\nkind = \"fixed\"\nyaw_deg = 30\npitch_deg = 10\nroll_deg = 5\nspin_hz = 2\nlever_arm_m = [1, 0, 0]\nboresight = [0, 1, -1]\n\
    [power]\nkind = \"link_budget\"\ntransmit = \"IIR\"\ntransmit_dbw = 15\nantenna = \"table\"\nantenna_file = \"gain.csv\"\nnoise_figure_db = 2\nloss_db = 1\n\
    blocks = { G05 = \"IIR-M\" }\n\
    [ionosphere]\nmodel = \"klobuchar\"\nalpha = [1e-8, 0, 0, 0]\nbeta = [1e5, 0, 0, 0]\n\
    broadcast_alpha = [2e-8, 0, 0, 0]\nbroadcast_beta = [2e5, 0, 0, 0]\n\
    [troposphere]\nmodel = \"saastamoinen\"\nheight_m = 100\npressure_hpa = 1000\ntemperature_c = 30\nrelative_humidity = 0.5\n\
    mapping = \"niell\"\n\
    [[obstruction]]\nkind = \"horizon\"\nazimuth_deg = [0, 90]\nelevation_deg = [10, 20]\nedge_deg = 1\nloss_db = 20\n\
    [[obstruction]]\nkind = \"sector\"\nfrom_deg = 350\nto_deg = 10\nroof_deg = 40\n\
    [[obstruction]]\nkind = \"building\"\neast_m = [10, 20]\nnorth_m = [-5, 5]\ntop_m = 20\n\
    [scintillation]\ns4 = 0.5\nsigma_phi_rad = 0.8\ndecorrelation_s = 1\nsatellites = [\"G02\"]\n\
    [receiver_clock]\nbias_s = 1e-4\ndrift_sps = 1e-7\nageing_per_day = 1e-9\nsensitivity_per_g = 1e-9\noscillator = \"tcxo\"\n[noise]\n\
    [playback]\nbits = 8\nload_sigma = 3\nattenuation_db = 1\n\
    [local_oscillator]\noffset_hz = 10\nphase_noise_rad = 0.1\nphase_noise_bandwidth_hz = 1000\n\
    [filter]\nkind = \"butterworth\"\norder = 4\nbandwidth_hz = 1.8e6\n[iq]\ndc_i_lsb = 0.5\n\
    [adc]\nbits = 2\nstep_sigma = 1\nagc_window_s = 0.001\n\
    [fidelity]\nlevel = \"balanced\"\ncarrier = \"f64\"\nnoise = \"f32\"\ncode_edge = \"nearest\"\nknot_tolerance_cycles = 1e-3\n[truth]\ninterval_s = 0.5\n\
    [expect]\nfix = \"none\"\nlosses = \"any\"\nsatellites = [\"G02\"]\nerrors = \"any\"\nreason = \"why\"\n\
    [receiver.tracking]\nwhatever = 1\n";
const ECHOES: &str = "[[multipath]]\nkind = \"given\"\namplitude = 0.5\nphase_deg = 90\nsatellites = [\"G13\"]\nexcess_m = 30\nrate_mps = -0.5\n\
    [[multipath]]\nkind = \"ground\"\namplitude = 0.3\nheight_m = 2\n\
    [[multipath]]\nkind = \"wall\"\namplitude = 0.4\nazimuth_deg = 90\ndistance_m = 12\n";

/// Every key of the tables that may stand several times.
const HOSTILE: &str = "[[interference]]\nkind = \"chirp\"\noffset_hz = 1e5\njs_db = 30\non_s = 1\noff_s = 2\nsweep_hz = -2e6\n\
    sweep_s = 1e-5\n[[interference]]\nkind = \"sine_fm\"\npower_dbw = -130\ndeviation_hz = 5e4\nrate_hz = 1e4\n\
    [[interference]]\nkind = \"pulse\"\neirp_dbw = -20\nwidth_s = 1e-5\nrate_hz = 1e4\njitter = 0.5\n\
    latitude_deg = 26.6\nlongitude_deg = 80.2\nheight_m = 100\n[[interference]]\nkind = \"noise\"\njs_db = 1\nbandwidth_hz = 1e6\n\
    [[interference]]\nkind = \"recording\"\njs_db = 1\nfile = \"iq.bin\"\nformat = \"ci8\"\nsample_rate_hz = 4e6\nrepeat = true\n\
    [[interference]]\nkind = \"cw\"\neirp_dbw = -20\ndistance_m = 500\n\
    [[spoofer]]\npower_db = 6\npower_start_db = -10\nramp_s = 5\non_s = 1\noff_s = 9\nsatellites = [\"G13\"]\nclock_bias_s = 1e-6\n\
    clock_drift_sps = 1e-9\n[spoofer.drag]\nstart_s = 3\nazimuth_deg = 90\nelevation_deg = 0\nspeed_mps = 5\nacceleration_mps2 = 2\n";

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
    assert!(
        scenario.noise
            && scenario.front_ends[0].fidelity.code_edge == CodeEdge::Nearest
            && scenario.truth_interval_s == 0.5
    );
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

/// A scene in which the line `line` stands in `table`.
fn with(table: &str, line: &str) -> String {
    match table {
        "" => format!("{line}\n{MINIMAL}{STATIC}"),
        "motion" => format!("{MINIMAL}{STATIC}{line}\n"),
        "interference" | "spoofer" | "satellite_fault" | "message_fault" => {
            format!("{MINIMAL}{STATIC}[[{table}]]\n{line}\n")
        }
        "spoofer.drag" => format!("{MINIMAL}{STATIC}[[spoofer]]\npower_db = 6\n[spoofer.drag]\n{line}\n"),
        "motion.point" => format!("{MINIMAL}{WAYPOINTS}{line}\n"),
        "expect.interval" => format!("{MINIMAL}{STATIC}[[expect.interval]]\n{line}\n"),
        "obstruction" => format!("{MINIMAL}{STATIC}[[obstruction]]\n{line}\n"),
        "multipath" => format!("{MINIMAL}{STATIC}[[multipath]]\n{line}\n"),
        table => format!("{MINIMAL}{STATIC}[{table}]\n{line}\n"),
    }
}

/// Every table with names of its own, and these names.
fn declared() -> Vec<(String, Vec<&'static str>)> {
    let own = |keys: &[&'static schema::Key]| {
        let mut names: Vec<&'static str> = keys.iter().map(|key| key.name).collect();
        names.dedup();
        names
    };
    let tables = tables_of(keys::SCENARIO, "", "").into_iter();
    tables.map(|table| (table.path, own(&table.keys))).filter(|(_, names)| names != &["G01"]).collect()
}

#[test]
fn every_mistyped_key_is_refused_at_its_place_with_the_right_one() {
    for (table, keys) in declared() {
        for key in keys {
            let dropped = &key[..key.len() - 1];
            let doubled = format!("{}{}", &key[..2], &key[1..]);
            for typo in [dropped, doubled.as_str()] {
                let text = with(&table, &format!("{typo} = 1"));
                let error = parse(&text).unwrap_err();
                let unknown = error.each().iter().filter_map(|error| match error {
                    ScenarioError::UnknownKey { place, nearest, .. } => Some((error, place, nearest)),
                    _ => None,
                });
                let [(error, place, nearest)] = unknown.collect::<Vec<_>>()[..] else { panic!("{typo}: {error}") };
                assert_eq!(nearest.as_deref(), Some(key), "{typo}");
                let line = text.lines().nth(place.line - 1).unwrap();
                assert!(line.starts_with(typo) && place.column == 1, "{typo}: {error}");
                assert!(error.to_string().starts_with("scene.toml:"), "{error}");
            }
        }
    }
}

#[test]
fn every_declared_key_is_read_by_a_reader() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("src/generator/scenario");
    let sources = std::fs::read_dir(&folder).unwrap().map(|entry| entry.unwrap().path());
    let sources: Vec<String> = sources
        .filter(|path| path.extension().is_some_and(|e| e == "rs") && !path.ends_with("tests.rs"))
        .map(|path| std::fs::read_to_string(path).unwrap())
        .chain([std::fs::read_to_string(folder.with_extension("rs")).unwrap()])
        .collect();
    for (table, keys) in declared() {
        for key in keys {
            let word = format!("\"{key}\"");
            assert!(sources.iter().any(|source| source.contains(&word)), "{table}.{key}");
        }
    }
}

#[test]
fn an_empty_table_means_what_an_absent_one_means() {
    let absent = parse(&format!("{MINIMAL}{STATIC}")).unwrap();
    for table in ["navigation", "satellites", "front_end", "power", "receiver_clock", "fidelity", "truth"] {
        let empty = parse(&format!("{MINIMAL}{STATIC}[{table}]\n")).unwrap();
        assert_eq!(empty, absent, "{table}");
    }
    let weather = parse(&format!("{MINIMAL}{STATIC}[troposphere]\nmodel = \"saastamoinen\"\n")).unwrap().troposphere;
    assert_eq!(weather.unwrap().weather, crate::generator::effect::troposphere::Weather::STANDARD);
}

#[test]
fn a_declared_default_is_the_value_that_an_absent_key_gets() {
    // Written out, every default of the tables that a scene may hold leaves the scene as it is.
    let bases = [
        ("satellites", STATIC.to_owned()),
        ("front_end", STATIC.to_owned()),
        ("receiver_clock", STATIC.to_owned()),
        ("truth", STATIC.to_owned()),
        ("local_oscillator", STATIC.to_owned()),
        ("iq", STATIC.to_owned()),
        ("motion", WAYPOINTS.to_owned()),
        ("motion", FILE.to_owned()),
        ("motion", ROCKET.to_owned()),
        ("motion", ORBIT.to_owned()),
    ];
    for (table, motion) in bases {
        let listed = tables_of(keys::SCENARIO, "", "").into_iter().find(|listed| listed.path == table).unwrap();
        let kind = parse(&format!("{MINIMAL}{motion}")).unwrap().motion.kind();
        for key in listed.keys.iter().filter(|key| table != "motion" || key.is_of(kind)) {
            let Absent::Number(default) = key.absent else { continue };
            let header = format!("[{table}]");
            let text = if table == "motion" { motion.clone() } else { format!("{motion}{header}\n") };
            let lines = text.lines().filter(|line| line.split('=').next().unwrap().trim() != key.name);
            let absent = lines.collect::<Vec<_>>().join("\n");
            if key.name == "turn_acceleration_mps2" || matches!(key.value, Value::Integer { .. }) {
                continue;
            }
            let given = absent.replacen(&header, &format!("{header}\n{} = {default:e}", key.name), 1);
            let parsed = |text: &str| parse(&format!("{MINIMAL}{text}\n")).unwrap();
            assert_eq!(parsed(&given), parsed(&absent), "{table}.{}", key.name);
        }
    }
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

/// The first line of `text`, within the table `header`, that sets `key`.
fn line_of(text: &str, header: &str, key: &str) -> Option<usize> {
    let mut inside = header.is_empty();
    text.lines().position(|line| {
        if line.starts_with('[') {
            inside = line.trim_matches(['[', ']']) == header;
        }
        inside && line.split('=').next().unwrap().trim() == key
    })
}

/// Replaces the value of `key` where the table `header` of `text` sets it first.
fn replaced(text: &str, header: &str, key: &str, value: &str) -> String {
    let at = line_of(text, header, key).unwrap_or_else(|| panic!("{header}.{key} is not in the text"));
    let mut lines: Vec<String> = text.lines().map(str::to_owned).collect();
    lines[at] = format!("{key} = {value}");
    lines.join("\n")
}

#[test]
fn every_value_of_a_wrong_type_names_its_key_and_what_is_expected() {
    let full = full() + HOSTILE + FAULTS;
    let fixed = "[power]\nkind = \"fixed\"\ncn0_dbhz = 45\n";
    let mut cases: Vec<(String, &str, &str)> = Vec::new();
    let tables = declared();
    let keys_of = |table: &str| &tables.iter().find(|(path, _)| path == table).unwrap().1;
    let inner = ["motion", "motion.point", "spoofer.drag", "obstruction", "multipath", "expect.interval"];
    for (table, keys) in tables.iter().filter(|(table, _)| !inner.contains(&table.as_str())) {
        for key in keys {
            let header = format!("[{key}]");
            let is_table = table.is_empty() && (full.contains(&header) || *key == "receiver");
            match (table.as_str(), *key) {
                ("power", "cn0_dbhz") => cases.push((format!("{MINIMAL}{STATIC}{fixed}"), table, key)),
                ("iq", "gain_db" | "phase_deg" | "dc_q_lsb") => {
                    let text = format!("{MINIMAL}{STATIC}[iq]\ngain_db = 1\nphase_deg = 2\ndc_q_lsb = 1\n");
                    cases.push((text, table, key));
                }
                ("receiver_clock", "power_law") => {
                    let text = format!("{MINIMAL}{STATIC}[receiver_clock]\npower_law = [0, 0, 1e-21, 1e-20, 2e-20]\n");
                    cases.push((text, table, key));
                }
                ("power", "satellites") => cases.push((format!("{MINIMAL}{STATIC}{fixed}satellites = 1"), table, key)),
                ("expect", "interval") => cases.push((with("expect", "interval = 1"), table, key)),
                ("spoofer", "motion" | "drag") => {
                    cases.push((with("spoofer", &format!("power_db = 6\n{key} = 1")), table, key));
                }
                ("ionosphere" | "troposphere", key) if line_of(&full, table, key).is_none() => {
                    let others = [IONEX, TEC, VIENNA].map(|other| format!("{MINIMAL}{STATIC}{other}"));
                    let with_it = others.iter().find(|text| line_of(text, table, key).is_some()).unwrap();
                    cases.push((with_it.clone(), table, key));
                }
                _ if is_table => {
                    let text = format!("{key} = 1979-05-27\n{MINIMAL}");
                    cases.push((if *key == "motion" { text } else { text + STATIC }, "", key));
                }
                _ => cases.push((full.clone(), table, key)),
            }
        }
    }
    for key in keys_of("motion") {
        let texts = [STATIC, WAYPOINTS, FILE, ROCKET, ORBIT, RADIUS];
        match texts.iter().find(|text| text.contains(&format!("\n{key} ="))) {
            Some(text) => cases.push((format!("{MINIMAL}{text}"), "motion", key)),
            None => assert_eq!(*key, "point"),
        }
    }
    for key in keys_of("spoofer.drag") {
        cases.push((full.clone(), "spoofer.drag", key));
    }
    for key in keys_of("obstruction") {
        cases.push((full.clone(), "obstruction", key));
    }
    let interval = "[[expect.interval]]\nfrom_s = 1\nto_s = 2\nfix = \"any\"\nlosses = \"any\"\nsatellites = [\"G02\"]\n\
                    errors = \"any\"\nreason = \"x\"\n";
    for key in keys_of("expect.interval") {
        cases.push((format!("{MINIMAL}{STATIC}{interval}"), "expect.interval", key));
    }
    for key in keys_of("motion.point") {
        cases.push((format!("{MINIMAL}{WAYPOINTS}"), "motion.point", key));
    }
    for key in keys_of("multipath") {
        let own = ECHOES.split("[[").find(|echo| echo.contains(&format!("\n{key} ="))).unwrap();
        cases.push((format!("{MINIMAL}{STATIC}[[{own}"), "multipath", key));
    }
    for (text, table, key) in cases {
        // A list is of no key's type but the lists', and they do not take dates.
        let wrong = if key == "start" { "[1979-05-27]" } else { "[1979-05-27, 1]" };
        let text = replaced(&text, table, key, wrong);
        let error = parse(&text).unwrap_err();
        let says = |error: &ScenarioError| match error {
            ScenarioError::Value { key: named, expected, value, .. } => {
                named.ends_with(key) && !expected.is_empty() && value.contains("1979")
            }
            // `[receiver]` goes through the ordinary parser.
            _ => key == "receiver" && error.to_string().contains("receiver"),
        };
        assert!(error.each().iter().any(says), "{table}.{key}: {error}");
    }
}

#[test]
fn numbers_outside_their_range_are_refused_with_range_and_unit() {
    for (table, key, unit) in [
        ("", "duration_s", "s"),
        ("satellites", "mask_deg", "deg"),
        ("front_end", "sample_rate_hz", "Hz"),
        ("front_end", "if_hz", "Hz"),
        ("front_end", "noise_lsb", "LSB"),
        ("attitude", "yaw_deg", "deg"),
        ("attitude", "pitch_deg", "deg"),
        ("attitude", "roll_deg", "deg"),
        ("attitude", "spin_hz", "Hz"),
        ("multipath", "amplitude", "direct"),
        ("multipath", "phase_deg", "deg"),
        ("multipath", "excess_m", "m"),
        ("power", "transmit_dbw", "dBW"),
        ("power", "noise_figure_db", "dB"),
        ("power", "loss_db", "dB"),
        ("troposphere", "height_m", "m"),
        ("troposphere", "pressure_hpa", "hPa"),
        ("troposphere", "temperature_c", "C"),
        ("troposphere", "relative_humidity", "fraction"),
        ("obstruction", "from_deg", "deg"),
        ("obstruction", "to_deg", "deg"),
        ("obstruction", "roof_deg", "deg"),
        ("obstruction", "edge_deg", "deg"),
        ("obstruction", "loss_db", "dB"),
        ("obstruction", "top_m", "m"),
        ("receiver_clock", "bias_s", "s"),
        ("receiver_clock", "drift_sps", "s/s"),
        ("receiver_clock", "ageing_per_day", "a day"),
        ("receiver_clock", "sensitivity_per_g", "a g"),
        ("scintillation", "sigma_phi_rad", "rad"),
        ("local_oscillator", "offset_hz", "Hz"),
        ("filter", "bandwidth_hz", "Hz"),
        ("iq", "dc_i_lsb", "LSB"),
        ("adc", "agc_window_s", "s"),
        ("playback", "attenuation_db", "dB"),
        ("scintillation", "decorrelation_s", "s"),
        ("fidelity", "knot_tolerance_cycles", "cycles"),
        ("truth", "interval_s", "s"),
        ("interference", "offset_hz", "Hz"),
        ("interference", "js_db", "dB"),
        ("interference", "power_dbw", "dBW"),
        ("interference", "sweep_s", "s"),
        ("interference", "jitter", "of a period"),
        ("interference", "bandwidth_hz", "Hz"),
        ("spoofer", "power_db", "dB"),
        ("spoofer", "clock_drift_sps", "s/s"),
        ("spoofer.drag", "speed_mps", "m/s"),
        ("orbits", "antenna_offset_m", "m"),
        ("satellite_fault", "step_s", "s"),
        ("satellite_fault", "drift_sps", "s/s"),
        ("satellite_fault", "along_m", "m"),
        ("satellite_fault", "ramp_s", "s"),
        ("message_fault", "rate", "a probability"),
        ("message_fault", "add", "in the parameter's unit"),
    ] {
        for value in ["-1e308", "1e308", "nan", "inf", "-inf", "\"5 m\"", "true", "9223372036854775807", "''"] {
            let text = replaced(&(full() + HOSTILE + FAULTS), table, key, value);
            let error = parse(&text).unwrap_err();
            let says = |error: &ScenarioError| {
                let message = error.to_string();
                let whole = message.contains(key) && message.contains(value) && message.contains(unit);
                matches!(error, ScenarioError::Value { .. }) && whole
            };
            assert!(error.each().iter().any(says), "{error}");
        }
    }
    for (key, limits) in
        [("latitude_deg", "from -90 to 90"), ("longitude_deg", "from -180 to 360"), ("height_m", "4e7")]
    {
        let text = replaced(&format!("{MINIMAL}{STATIC}"), "motion", key, "-1e9");
        let message = parse(&text).unwrap_err().to_string();
        assert!(message.contains(&format!("motion.{key} = -1e9")) && message.contains(limits), "{message}");
    }
}

#[test]
fn a_link_budget_is_refused_for_a_signal_whose_least_power_is_not_known() {
    let mut scenario = parse(&format!("{MINIMAL}{STATIC}[power]\nkind = \"link_budget\"\n")).unwrap();
    let compose = |scenario: &Scenario| scenario.compose(Path::new("scenarios"), &Overrides::default());
    assert!(compose(&scenario).is_ok());
    scenario.signals.push(&crate::gnss::signal::synthetic::LONG_BOC);
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
fn what_cannot_be_turned_or_reflected_is_refused_with_the_remedy() {
    let parsed = |tables: &str| parse(&format!("{MINIMAL}{STATIC}{tables}")).unwrap_err().to_string();
    assert!(parsed("[attitude]\nkind = \"velocity\"\nroll_deg = 3").contains("level"));
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
    let fidelity = |lines: &str| parse(&with("fidelity", lines)).unwrap().front_ends[0].fidelity;
    assert_eq!(parse(&format!("{MINIMAL}{STATIC}")).unwrap().front_ends[0].fidelity, Fidelity::of(Grade::Balanced));
    for (name, grade) in Grade::NAMES {
        assert_eq!(fidelity(&format!("level = \"{name}\"")), Fidelity::of(grade));
        let own = fidelity(&format!("level = \"{name}\"\nknot_tolerance_cycles = 3e-5"));
        assert_eq!(own, Fidelity { knot_tolerance_cycles: 3e-5, ..Fidelity::of(grade) });
    }
    let every = fidelity("level = \"fast\"\ncode_edge = \"band_limited\"\ncarrier = \"f64\"\nnoise = \"f64\"");
    let expected = Fidelity { grade: Grade::Fast, knot_tolerance_cycles: 4e-4, ..Fidelity::of(Grade::Reference) };
    assert_eq!(every, expected);
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
    let p = crate::gnss::earth::Geodetic::from_degrees(26.5, 80.2, 130.0).to_ecef();
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

#[test]
fn a_front_end_puts_l1_where_the_scenario_says() {
    for (inverted, center_hz) in [(false, 1_574.42e6), (true, 1_576.42e6)] {
        let text = replaced(&full(), "front_end", "spectrum_inverted", &inverted.to_string());
        let text = text.replace("[navigation]\nfile = \"brdc.10n\"\n", "");
        let text = text.replace("antenna = \"table\"\nantenna_file = \"gain.csv\"\n", "antenna = \"patch\"\n");
        let (scene, warnings) = parse(&text).unwrap().compose(Path::new("."), &Overrides::default()).unwrap();
        assert_eq!(scene.metadata.center_hz, center_hz);
        assert_eq!(scene.metadata.if_hz(scene.signals[0].centre_hz()), 1e6);
        // 1 MHz less 1.023 MHz is below zero in a real signal.
        assert!(warnings.iter().any(|w| w.contains("fold")), "{warnings:?}");
        assert_eq!((scene.samples, scene.noise_lsb), (40_000_000, 3.0));
    }
}

/// The scenarios that come with the program.
const SHIPPED: [(&str, &str); 16] = [
    ("static", include_str!("../../../scenarios/static.toml")),
    ("moderate", include_str!("../../../scenarios/moderate.toml")),
    ("high_dynamics", include_str!("../../../scenarios/high_dynamics.toml")),
    ("noise_free", include_str!("../../../scenarios/noise_free.toml")),
    ("trajectory_file", include_str!("../../../scenarios/trajectory_file.toml")),
    ("ionex", include_str!("../../../scenarios/ionex.toml")),
    ("canyon", include_str!("../../../scenarios/canyon.toml")),
    ("urban", include_str!("../../../scenarios/urban.toml")),
    ("spinning", include_str!("../../../scenarios/spinning.toml")),
    ("oscillator", include_str!("../../../scenarios/oscillator.toml")),
    ("scintillation", include_str!("../../../scenarios/scintillation.toml")),
    ("front_end", include_str!("../../../scenarios/front_end.toml")),
    ("jammed", include_str!("../../../scenarios/jammed.toml")),
    ("spoofed", include_str!("../../../scenarios/spoofed.toml")),
    ("precise", include_str!("../../../scenarios/precise.toml")),
    ("satellite_faults", include_str!("../../../scenarios/satellite_faults.toml")),
];

fn shipped(name: &str) -> crate::generator::scene::Scene {
    let (_, text) = SHIPPED.iter().find(|(n, _)| *n == name).unwrap();
    let directory = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenarios");
    let (scene, warnings) = Scenario::parse(text, name).unwrap().compose(&directory, &Overrides::default()).unwrap();
    // The one rogue record of that day, and the satellites that say themselves that they are unhealthy.
    assert!(warnings.len() <= 2 && warnings.iter().all(|w| w.contains("left out")), "{name}: {warnings:?}");
    scene
}

#[test]
fn shipped_scenarios_begin_two_seconds_before_a_frame_with_the_ionosphere_s_page() {
    for (name, text) in SHIPPED {
        let scenario = Scenario::parse(text, name).unwrap();
        assert_eq!(scenario.name, name);
        let frame = scenario.start.tow_whole_s() + 2;
        // IS-GPS-200N, 20.3.3.5.1.1 and table 20-V: page 18 of subframe 4, frames counted from the week's start.
        assert_eq!((frame % 30, frame / 30 % 25 + 1), (0, 18), "{name}");
    }
}

#[test]
fn the_shipped_motions_do_what_their_comments_say() {
    let g = 9.806_65;
    let moderate = shipped("moderate").trajectory;
    let extremes = moderate.extremes(90.0);
    assert!(
        (29.0..=30.1).contains(&extremes.speed_mps) && (3.9..4.1).contains(&extremes.acceleration_mps2),
        "{extremes:?}"
    );
    assert!(moderate.at(5.0).velocity_mps.norm() > 8.0);
    let rocket = shipped("high_dynamics").trajectory;
    let extremes = rocket.extremes(110.0);
    assert!(extremes.acceleration_mps2 > 20.0 * g && extremes.speed_mps > 700.0, "{extremes:?}");
    let height_m = |t_s| crate::gnss::earth::Geodetic::from_ecef(&rocket.at(t_s).position_m).height_m;
    assert!(height_m(40.0) < 130.001 && height_m(110.0) > 10_000.0);
    let ride = shipped("trajectory_file").trajectory.extremes(60.0);
    assert!(ride.speed_mps < 4.0 && ride.acceleration_mps2 < 1.0, "{ride:?}");
}

#[test]
fn the_boost_changes_some_satellite_s_doppler_by_about_a_thousand_hertz_a_second() {
    let scene = shipped("high_dynamics");
    let d = 0.01;
    let mut fastest = 0.0_f64;
    for sv in scene.catalogue.satellites() {
        for k in 0..50 {
            let t_s = 40.0 + f64::from(k) * 0.1;
            let range = |t_s: f64| {
                let at = scene.clock.start.plus_s(t_s);
                let found = crate::generator::sky::emission(&scene.catalogue, sv, at, &scene.trajectory.at(t_s));
                found.unwrap().map_or(f64::NAN, |e| e.sight.range_m)
            };
            let bend = (range(t_s + d) - 2.0 * range(t_s) + range(t_s - d)) / (d * d);
            fastest = fastest.max((bend / crate::gnss::gps::l1ca::L1_CA.wavelength_m(Sv::gps(1))).abs());
        }
    }
    assert!((950.0..1150.0).contains(&fastest), "{fastest}");
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
    assert!(error.contains("200000 s from then on"), "{error}");
    let error =
        warnings(&replaced(&replaced(&full(), "", "duration_s", "2678400"), "front_end", "sample_rate_hz", "60e6"));
    // 2 678 400 s at 60 Msps.
    assert!(error.unwrap_err().contains("1.60704e14 samples"));
}

#[test]
fn what_looks_wrong_but_can_be_computed_is_warned_of() {
    let base = format!("{MINIMAL}{STATIC}");
    let told = warnings(&format!("{base}[satellites]\nmask_deg = 80\nexclude = [\"G99\"]\n")).unwrap();
    assert!(told.iter().any(|w| w.contains("a position needs 4")), "{told:?}");
    assert!(told.iter().any(|w| w.contains("exclude names G99")), "{told:?}");
    let told = warnings(&format!("{base}[front_end]\nsample_rate_hz = 1.5e6\n")).unwrap();
    assert!(told.iter().any(|w| w.contains("-1.023 to 1.023 MHz")), "{told:?}");
    // Those of the file itself: a rogue record, and unhealthy satellites.
    assert!(warnings(&base).unwrap().len() <= 2);
}

#[test]
fn a_signal_outside_the_band_is_refused_where_it_is_the_only_one() {
    let place = |if_hz: f64, format: Format| {
        let mut scenario = parse(&format!("{MINIMAL}{STATIC}[front_end]\nsample_rate_hz = 2.6e6\n")).unwrap();
        // No text comes here: the parser keeps the IF of the one signal that there is below half the rate.
        let front_end = &mut scenario.front_ends[0];
        (front_end.tuned, front_end.format) = (Tuned::If { if_hz }, format);
        let (_, warnings) = scenario.compose(Path::new("."), &Overrides::default()).map_err(|e| e.to_string())?;
        Ok::<_, String>(warnings)
    };
    // The band ends at 1.3 MHz and half the main lobe is 1.023 MHz wide.
    for if_hz in [2.33e6, -2.33e6, 9e6] {
        let error = place(if_hz, Format::Ci8).unwrap_err();
        assert!(error.contains("front_end.if_hz") && error.contains("-1.300 to 1.300 MHz"), "{error}");
    }
    for if_hz in [2.31e6, -2.31e6] {
        assert!(place(if_hz, Format::Ci8).unwrap().iter().any(|w| w.contains("fold over")));
    }
    // Real samples of an IF beyond half the rate: bandpass sampling.
    assert!(place(9e6, Format::Ri8).is_ok());
}

#[test]
fn noise_and_strong_signals_decide_how_good_balanced_edges_are() {
    let edge = |tables: &str| parse(&format!("{MINIMAL}{STATIC}{tables}")).unwrap().front_ends[0].fidelity.code_edge;
    assert_eq!(edge("[noise]\n"), CodeEdge::Area);
    assert_eq!(edge("[power]\ncn0_dbhz = 80\n"), CodeEdge::Area);
    assert_eq!(edge("[noise]\n[power]\ncn0_dbhz = 80\n"), CodeEdge::BandLimited);
    assert_eq!(edge("[noise]\n[power]\ncn0_dbhz = 45\n[power.satellites]\nG13 = 80\n"), CodeEdge::BandLimited);
}

#[test]
fn overrides_replace_what_the_scenario_says_and_are_checked_like_it() {
    let scenario = parse(&format!("{MINIMAL}{STATIC}")).unwrap();
    let compose = |overrides: Overrides| scenario.compose(Path::new("."), &overrides);
    let (scene, _) = compose(Overrides { seed: Some(9), format: Some(Format::Cf32Le), allow_outside: false }).unwrap();
    assert_eq!((scene.seed, scene.metadata.format, scene.noise_lsb), (9, Format::Cf32Le, 1.0));
    let error = compose(Overrides { format: Some(Format::Ri8), ..Overrides::default() }).err().unwrap().to_string();
    assert!(error.contains("front_end.if_hz: 0 Hz with the real format ri8"), "{error}");
}

#[test]
fn power_by_satellite_reaches_the_rays() {
    let text = format!("{MINIMAL}{STATIC}[power]\ncn0_dbhz = 45\n[power.satellites]\nG13 = 30.0\n");
    let (scene, _) = parse(&text).unwrap().compose(Path::new("."), &Overrides::default()).unwrap();
    let motion = scene.trajectory.at(0.0);
    for (sv, cn0_hz) in [(Sv::gps(13), 1e3), (Sv::gps(23), 31_622.776_601_683_79)] {
        let found = crate::generator::sky::emission(&scene.catalogue, sv, scene.clock.start, &motion).unwrap().unwrap();
        let mut rays = vec![crate::generator::ray::Ray {
            code_delay_s: 0.0,
            carrier_delay_s: 0.0,
            phase_cycles: 0.0,
            cn0_hz: 0.0,
        }];
        scene.effects.iter().for_each(|e| e.act(&found.sight, scene.signals[0], &mut rays));
        // Ten to the tenth of a decimal number: relative rounding of a few 1e-16.
        assert!((rays[0].cn0_hz / cn0_hz - 1.0).abs() < 1e-12, "{sv} {rays:?}");
        assert_eq!(rays[0].code_delay_s, 0.0);
    }
}

#[test]
fn the_static_scene_sends_its_ionosphere_within_thirty_seconds() {
    use crate::gnss::gps::lnav::Subframe;
    let scene = shipped("static");
    let first_bit = scene.clock.start.plus_s(20.0);
    let ephemeris = scene.catalogue.sent_at(Sv::gps(13), first_bit).unwrap();
    let words = scene.broadcast.subframe(ephemeris, first_bit).unwrap();
    let subframe = Subframe::decode(&words, 0).unwrap();
    let sent = subframe.klobuchar().unwrap();
    let file = crate::gnss::rinex::embedded().unwrap().klobuchar.unwrap();
    for (sent, file) in sent.alpha.iter().zip(file.alpha) {
        // RINEX 2 prints five significant digits; half a step of the finest field is 2^-31 (IS-GPS-200N, table 20-X).
        assert!((sent - file).abs() <= 4.7e-10, "{sent} {file}");
    }
    // GPS time against UTC as the file's header has it, to half a step of its fields (IS-GPS-200N, table 20-IX).
    let utc = subframe.utc().unwrap();
    assert!((utc.a0_s - -0.838190317154e-8).abs() <= libm::exp2(-31.0), "{utc:?}");
    assert!((utc.a1_sps - -0.213162820728e-13).abs() <= libm::exp2(-51.0), "{utc:?}");
    assert_eq!((utc.tot_s, utc.week, utc.leap_s, utc.leap_after_s), (503_808.0, (566 % 256) as u8, 15, 15));
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
