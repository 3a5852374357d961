//! The declarations of keys hold for every reader, and every refusal names its key and position.

use super::*;

/// A scene with the line `line` in `table`.
pub(super) fn with(table: &str, line: &str) -> String {
    match table {
        "" => format!("{line}\n{MINIMAL}{STATIC}"),
        "motion" => format!("{MINIMAL}{STATIC}{line}\n"),
        "interference" | "spoofer" | "satellite_fault" | "message_fault" => {
            format!("{MINIMAL}{STATIC}[[{table}]]\n{line}\n")
        }
        "spoofer.drag" | "spoofer.transmitter" => {
            format!("{MINIMAL}{STATIC}[[spoofer]]\npower_db = 6\n[{table}]\n{line}\n")
        }
        "motion.point" => format!("{MINIMAL}{WAYPOINTS}{line}\n"),
        "expect.interval" => format!("{MINIMAL}{STATIC}[[expect.interval]]\n{line}\n"),
        "osnma.transition" => format!("{MINIMAL}{STATIC}[[osnma.transition]]\n{line}\n"),
        "obstruction" => format!("{MINIMAL}{STATIC}[[obstruction]]\n{line}\n"),
        "multipath" => format!("{MINIMAL}{STATIC}[[multipath]]\n{line}\n"),
        "array.element" => format!("{MINIMAL}{STATIC}[[array.element]]\n{line}\n"),
        "station" => format!("{MINIMAL}{STATIC}[[station]]\n{line}\n"),
        "station.power" => format!("{MINIMAL}{STATIC}[[station]]\nname = \"a\"\n[station.power]\n{line}\n"),
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
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenario");
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
    assert_eq!(weather.unwrap().weather, crate::effect::troposphere::Weather::STANDARD);
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
pub(super) fn replaced(text: &str, header: &str, key: &str, value: &str) -> String {
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
                ("front_end", "name" | "center_hz" | "signals" | "local_oscillator" | "filter" | "iq" | "adc") => {
                    cases.push((with("front_end", &format!("{key} = 1")), table, key))
                }
                ("", "signal_file") => cases.push((with("", "signal_file = 1"), table, key)),
                ("satellites", "only") => cases.push((with("satellites", "only = 1"), table, key)),
                ("fidelity", "budget") => cases.push((with("fidelity", "budget = 1"), table, key)),
                ("fidelity.budget", _) => {
                    let errors = "[fidelity.budget]\ncode_m = 1\ncarrier_cycles = 1e-3\ncn0_db = 1\n";
                    cases.push((format!("{MINIMAL}{STATIC}{errors}"), table, key));
                }
                ("navigation", "moved_to") => cases.push((with("navigation", &format!("{key} = 1")), table, key)),
                ("expect", "interval" | "position_within_m") => {
                    cases.push((with("expect", &format!("{key} = 1")), table, key));
                }
                ("message_fault", "spoofer") => {
                    let fault = "kind = \"bit_errors\"\nrate = 0.1\nspoofer = 1";
                    cases.push((with("message_fault", fault), table, key));
                }
                ("city", "permittivity" | "conductivity_spm") => {
                    let own = "file = \"a.json\"\npermittivity = 4\nconductivity_spm = 0.1";
                    cases.push((with("city", own), table, key));
                }
                ("", "array" | "imu" | "station") => cases.push((with("", &format!("{key} = 1")), table, key)),
                ("array" | "array.element", _) => cases.push((with(table, &format!("{key} = 1")), table, key)),
                ("imu", key) => {
                    let rate = if key == "rate_hz" { "" } else { "rate_hz = 100\n" };
                    let turned = "[attitude]\nkind = \"fixed\"";
                    let text = format!("{MINIMAL}{STATIC}{turned}\n[imu]\n{rate}{key} = 1\n");
                    cases.push((text, table, key));
                }
                ("station", "name") => cases.push((with("station", "name = 1"), table, key)),
                ("station", _) => cases.push((with("station", &format!("name = \"a\"\n{key} = 1")), table, key)),
                ("station.power", _) => cases.push((with("station.power", &format!("{key} = 1")), table, key)),
                ("spoofer.transmitter", _) => {
                    let place = "latitude_deg = 48\nlongitude_deg = 11\nheight_m = 500";
                    cases.push((with("spoofer.transmitter", place), table, key));
                }
                ("osnma", "transition") => cases.push((with("osnma", "transition = 1"), table, key)),
                (
                    "spoofer",
                    "motion"
                    | "drag"
                    | "transmitter"
                    | "time_offset_s"
                    | "navigation"
                    | "navigation_moved_to"
                    | "leap_seconds",
                ) => {
                    cases.push((with("spoofer", &format!("power_db = 6\n{key} = 1")), table, key));
                }
                ("ionosphere" | "troposphere", key) if line_of(&full, table, key).is_none() => {
                    let others = [IONEX, TEC, NEQUICK, BDGIM, VIENNA].map(|other| format!("{MINIMAL}{STATIC}{other}"));
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
        let texts = [STATIC, WAYPOINTS, FILE, ROCKET, ORBIT, RADIUS, PUSHED, TICKS];
        match texts.iter().find(|text| line_of(text, "motion", key).is_some()) {
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
    let interval = "[[expect.interval]]\nfrom_s = 1\nto_s = 2\nfix = \"any\"\nlosses = \"any\"\nsatellites = \
                    [\"G02\"]\n\
                    errors = \"any\"\nposition_within_m = 9\nreason = \"x\"\n";
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
        ("spoofer", "replay_s", "s"),
        ("osnma", "step_s", "s"),
        ("osnma.transition", "time_s", "s"),
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
