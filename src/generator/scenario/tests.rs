use std::path::Path;

use super::motion::{KEYS as MOTION_KEYS, POINT_KEYS};
use super::*;

const MINIMAL: &str = "name = \"test\"\nstart = 2010-07-01T10:00:00\nduration_s = 10\n";
const STATIC: &str = "[motion]\nkind = \"static\"\nlatitude_deg = 26.5\nlongitude_deg = 80.2\nheight_m = 130\n";
const ROCKET: &str = "[motion]\nkind = \"rocket\"\nlatitude_deg = 26.5\nlongitude_deg = 80.2\nheight_m = 130\nazimuth_deg = 90\n\
    elevation_deg = 80\nignition_s = 1\nthrust_mps2 = 200\nburn_s = 3\njerk_mps3 = 200\ndrag_m2pkg = 1e-5\ngravity = \"j2\"\n";
const WAYPOINTS: &str = "[motion]\nkind = \"waypoints\"\nacceleration_mps2 = 2\njerk_mps3 = 1\nturn_acceleration_mps2 = 3\n\
    [[motion.point]]\nlatitude_deg = 26.5\nlongitude_deg = 80.2\nheight_m = 130\nspeed_mps = 0\nhold_s = 1\n\
    [[motion.point]]\nlatitude_deg = 26.51\nlongitude_deg = 80.2\nheight_m = 130\nspeed_mps = 20\n";
const FILE: &str = "[motion]\nkind = \"file\"\nfile = \"ride.csv\"\nformat = \"csv\"\nmax_gap_s = 3\n";
const RADIUS: &str = "[motion]\nkind = \"waypoints\"\nturn_radius_m = 30\n";
const REST: &str = "[navigation]\nfile = \"brdc.10n\"\n[satellites]\nmask_deg = 10\nexclude = [\"G01\"]\ninclude_unhealthy = true\n\
    [front_end]\nsample_rate_hz = 4e6\nif_hz = 1e6\nspectrum_inverted = true\nformat = \"ri8\"\nnoise_lsb = 3\n\
    [power]\nkind = \"link_budget\"\nantenna = \"patch\"\nnoise_figure_db = 2\nloss_db = 1\n\
    [ionosphere]\nmodel = \"klobuchar\"\nalpha = [1e-8, 0, 0, 0]\nbeta = [1e5, 0, 0, 0]\n\
    [troposphere]\nmodel = \"saastamoinen\"\nheight_m = 100\npressure_hpa = 1000\ntemperature_c = 30\nrelative_humidity = 0.5\n\
    [receiver_clock]\nbias_s = 1e-4\ndrift_sps = 1e-7\n[noise]\n\
    [fidelity]\nlevel = \"balanced\"\ncarrier = \"f64\"\nnoise = \"f32\"\ncode_edge = \"nearest\"\nknot_tolerance_cycles = 1e-3\n[truth]\ninterval_s = 0.5\n\
    [receiver.tracking]\nwhatever = 1\n";

fn parse(text: &str) -> Result<Scenario, ScenarioError> {
    Scenario::parse(text, "scene.toml")
}

fn full() -> String {
    format!("{MINIMAL}seed = 7\nsignals = [\"GPS L1 C/A\"]\n{STATIC}{REST}")
}

#[test]
fn every_value_arrives_where_it_belongs_in_si_units() {
    let scenario = parse(&full()).unwrap();
    assert_eq!((scenario.name.as_str(), scenario.seed, scenario.duration_s), ("test", 7, 10.0));
    assert_eq!(scenario.start, Epoch::parse("2010-07-01T10:00:00").unwrap());
    assert_eq!(scenario.mask_rad, 10_f64.to_radians());
    assert_eq!((scenario.excluded.as_slice(), scenario.include_unhealthy), ([Sv::gps(1)].as_slice(), true));
    assert_eq!((scenario.front_end.format, scenario.front_end.inverted), (Format::Ri8, true));
    assert_eq!(scenario.power, Power::LinkBudget { antenna: Antenna::Patch, noise_figure_db: 2.0, loss_db: 1.0 });
    assert!(matches!(scenario.ionosphere, Some(Ionosphere::Given(k)) if k.alpha[0] == 1e-8));
    assert_eq!(scenario.receiver_clock, ReceiverClock { bias_s: 1e-4, drift: 1e-7 });
    assert!(scenario.noise && scenario.fidelity.code_edge == CodeEdge::Nearest && scenario.truth_interval_s == 0.5);
    assert!(scenario.receiver.unwrap().contains_key("tracking"));
}

#[test]
fn absence_is_the_switch() {
    let scenario = parse(&format!("{MINIMAL}{STATIC}")).unwrap();
    assert!(!scenario.noise && scenario.ionosphere.is_none() && scenario.troposphere.is_none());
    assert_eq!(scenario.receiver_clock, ReceiverClock::PERFECT);
    assert!(scenario.receiver.is_none() && scenario.navigation.is_none());
}

/// A scene in which the line `line` stands in `table`.
fn with(table: &str, line: &str) -> String {
    match table {
        "" => format!("{line}\n{MINIMAL}{STATIC}"),
        "motion" => format!("{MINIMAL}{STATIC}{line}\n"),
        "motion.point" => format!("{MINIMAL}{WAYPOINTS}{line}\n"),
        table => format!("{MINIMAL}{STATIC}[{table}]\n{line}\n"),
    }
}

#[test]
fn every_mistyped_key_is_refused_at_its_place_with_the_right_one() {
    for (table, keys) in KEYS.iter().copied().chain([("motion.point", POINT_KEYS)]) {
        for key in keys {
            let dropped = &key[..key.len() - 1];
            let doubled = format!("{}{}", &key[..2], &key[1..]);
            for typo in [dropped, doubled.as_str()] {
                let text = with(table, &format!("{typo} = 1"));
                let error = parse(&text).unwrap_err();
                let ScenarioError::UnknownKey { place, nearest, .. } = &error else { panic!("{typo}: {error}") };
                assert_eq!(nearest.as_deref(), Some(*key), "{typo}");
                let line = text.lines().nth(place.line - 1).unwrap();
                assert!(line.starts_with(typo) && place.column == 1, "{typo}: {error}");
                assert!(error.to_string().starts_with("scene.toml:"), "{error}");
            }
        }
    }
}

#[test]
fn a_key_of_another_kind_of_motion_is_refused() {
    let error = parse(&format!("{MINIMAL}{STATIC}azimuth_deg = 3\n")).unwrap_err().to_string();
    assert!(error.contains("unknown key 'motion.azimuth_deg'") && error.contains("latitude_deg"), "{error}");
    let both = format!("{MINIMAL}{RADIUS}turn_acceleration_mps2 = 3\n");
    assert!(parse(&both).unwrap_err().to_string().contains("only one of"));
}

/// Replaces the value of `key` in the first line of `text`, after `table` begins, that sets it.
fn replaced(text: &str, header: &str, key: &str, value: &str) -> String {
    let mut inside = header.is_empty();
    let mut done = false;
    let mut lines = Vec::new();
    for line in text.lines() {
        if line.starts_with('[') {
            inside = line.trim_matches(['[', ']']) == header;
        }
        if inside && !done && line.split('=').next().unwrap().trim() == key {
            lines.push(format!("{key} = {value}"));
            done = true;
        } else {
            lines.push(line.to_owned());
        }
    }
    assert!(done, "{header}.{key} is not in the text");
    lines.join("\n")
}

#[test]
fn every_value_of_a_wrong_type_names_its_key_and_what_is_expected() {
    let full = full();
    let fixed = "[power]\nkind = \"fixed\"\ncn0_dbhz = 45\n";
    let mut cases: Vec<(String, &str, &str)> = Vec::new();
    for (table, keys) in KEYS.iter().filter(|(table, _)| *table != "motion") {
        for key in *keys {
            let header = format!("[{key}]");
            let is_table = table.is_empty() && (full.contains(&header) || *key == "receiver");
            match (*table, *key) {
                ("power", "cn0_dbhz") => cases.push((format!("{MINIMAL}{STATIC}{fixed}"), table, key)),
                ("power", "satellites") => cases.push((format!("{MINIMAL}{STATIC}{fixed}satellites = 1"), table, key)),
                _ if is_table => {
                    let text = format!("{key} = 1979-05-27\n{MINIMAL}");
                    cases.push((if *key == "motion" { text } else { text + STATIC }, "", key));
                }
                _ => cases.push((full.clone(), table, key)),
            }
        }
    }
    for key in MOTION_KEYS {
        let texts = [STATIC, WAYPOINTS, FILE, ROCKET, RADIUS];
        match texts.iter().find(|text| text.contains(&format!("\n{key} ="))) {
            Some(text) => cases.push((format!("{MINIMAL}{text}"), "motion", key)),
            None => assert_eq!(*key, "point"),
        }
    }
    for key in POINT_KEYS {
        cases.push((format!("{MINIMAL}{WAYPOINTS}"), "motion.point", key));
    }
    for (text, table, key) in cases {
        // A list is of no key's type but the lists', and they do not take dates.
        let wrong = if key == "start" { "[1979-05-27]" } else { "[1979-05-27, 1]" };
        let text = replaced(&text, table, key, wrong);
        let error = parse(&text).unwrap_err();
        let ScenarioError::Value { key: named, expected, value, .. } = &error else {
            // `[receiver]` goes through the ordinary parser.
            assert!(key == "receiver" && error.to_string().contains("receiver"), "{table}.{key}: {error}");
            continue;
        };
        assert!(named.ends_with(key) && !expected.is_empty() && value.contains("1979"), "{table}.{key}: {error}");
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
        ("power", "noise_figure_db", "dB"),
        ("power", "loss_db", "dB"),
        ("troposphere", "height_m", "m"),
        ("troposphere", "pressure_hpa", "hPa"),
        ("troposphere", "temperature_c", "C"),
        ("troposphere", "relative_humidity", "fraction"),
        ("receiver_clock", "bias_s", "s"),
        ("receiver_clock", "drift_sps", "s/s"),
        ("fidelity", "knot_tolerance_cycles", "cycles"),
        ("truth", "interval_s", "s"),
    ] {
        for value in ["-1e308", "1e308", "nan", "inf", "-inf", "\"5 m\"", "true", "9223372036854775807", "''"] {
            let text = replaced(&full(), table, key, value);
            let error = parse(&text).unwrap_err();
            let message = error.to_string();
            assert!(matches!(error, ScenarioError::Value { .. }), "{message}");
            assert!(message.contains(key) && message.contains(value) && message.contains(unit), "{message}");
        }
    }
    for (key, limits) in
        [("latitude_deg", "from -90 to 90"), ("longitude_deg", "from -180 to 360"), ("height_m", "3e7")]
    {
        let text = replaced(&format!("{MINIMAL}{STATIC}"), "motion", key, "-1e9");
        let message = parse(&text).unwrap_err().to_string();
        assert!(message.contains(&format!("motion.{key} = -1e9")) && message.contains(limits), "{message}");
    }
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
    let error = parse(&with("", "signals = [\"GPS L1 CA\"]")).unwrap_err();
    assert!(error.to_string().contains("GPS L1 C/A"), "{error}");
    let error = parse(&with("fidelity", "code_edge = \"aera\"")).unwrap_err().to_string();
    assert!(error.contains("did you mean area?"), "{error}");
}

#[test]
fn a_level_sets_every_knob_and_a_knob_overrides_its_level() {
    let fidelity = |lines: &str| parse(&with("fidelity", lines)).unwrap().fidelity;
    assert_eq!(parse(&format!("{MINIMAL}{STATIC}")).unwrap().fidelity, Fidelity::of(Grade::Balanced));
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
        let (scene, warnings) = parse(&text).unwrap().compose(Path::new("."), &Overrides::default()).unwrap();
        assert_eq!(scene.metadata.center_hz, center_hz);
        assert_eq!(scene.metadata.if_hz(scene.signals[0]), 1e6);
        // 1 MHz less 1.023 MHz is below zero in a real signal.
        assert!(warnings.iter().any(|w| w.contains("fold")), "{warnings:?}");
        assert_eq!((scene.samples, scene.noise_lsb), (40_000_000, 3.0));
    }
}

/// The scenarios that come with the program.
const SHIPPED: [(&str, &str); 5] = [
    ("static", include_str!("../../../scenarios/static.toml")),
    ("moderate", include_str!("../../../scenarios/moderate.toml")),
    ("high_dynamics", include_str!("../../../scenarios/high_dynamics.toml")),
    ("noise_free", include_str!("../../../scenarios/noise_free.toml")),
    ("trajectory_file", include_str!("../../../scenarios/trajectory_file.toml")),
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
            fastest = fastest.max((bend / crate::gnss::gps::l1ca::L1_CA.wavelength_m()).abs());
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
