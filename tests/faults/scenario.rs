//! TOML texts - scenarios, receiver's settings, limits, studies: each line mistyped and given bad values; and
//! values that contradict each other.

use std::path::{Path, PathBuf};

use analysis::judge::limits::Limits;
use generator::scenario::{Overrides, Scenario};
use receiver::settings::Settings;
use study::sweep::spec::Study;

use crate::legal::{Legal, legal};
use crate::scenes::{LIMITS, SCENES, STUDY};
use crate::tally::{End, Tally, cases};

const FAMILY: &str = "Scenarios";

fn directory() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("scenarios")
}

/// The scenes that come with the program.
fn scenes() -> Vec<(PathBuf, String)> {
    let mut found = Vec::new();
    for directory in [directory(), directory().join("extremes")] {
        for entry in std::fs::read_dir(directory).unwrap() {
            let path = entry.unwrap().path();
            if path.extension().is_some_and(|e| e == "toml") && path.file_stem().is_some_and(|name| name != "limits") {
                found.push((path.clone(), std::fs::read_to_string(&path).unwrap()));
            }
        }
    }
    found.sort();
    found
}

/// Number of the line, table, key and value of each setting that stands on a line of its own.
fn settings(text: &str) -> Vec<(usize, String, String, String)> {
    let mut table = String::new();
    let mut found = Vec::new();
    for (number, line) in text.lines().enumerate() {
        let line = line.split(" #").next().unwrap().trim();
        if line.starts_with('[') {
            table = line.trim_matches(['[', ']']).to_owned();
        } else if let Some((key, value)) = line.split_once('=')
            && !line.starts_with('#')
            && !value.trim().ends_with('[')
        {
            found.push((number, table.clone(), key.trim().to_owned(), value.trim().to_owned()));
        }
    }
    found
}

fn with_line(text: &str, number: usize, line: &str) -> String {
    text.lines().enumerate().map(|(at, old)| if at == number { line } else { old }).collect::<Vec<_>>().join("\n")
}

/// A kind of TOML text: texts with its keys, and what reads them. Whatever it refuses begins with the text's
/// name and place.
struct Kind {
    name: &'static str,
    texts: Vec<(String, String)>,
    read: fn(&str) -> Result<(), String>,
}

fn kinds() -> [Kind; 4] {
    let mut all: Vec<(String, String)> =
        scenes().into_iter().map(|(path, text)| (path.display().to_string(), text)).collect();
    all.extend(SCENES.map(|(name, text)| (name.to_owned(), text.to_owned())));
    let defaults = toml::to_string(&Settings::default()).unwrap();
    let mut studies = vec![("study".to_owned(), STUDY.to_owned())];
    for entry in std::fs::read_dir(directory().join("../studies")).unwrap() {
        let path = entry.unwrap().path();
        if path.is_file() {
            studies.push((path.display().to_string(), std::fs::read_to_string(&path).unwrap()));
        }
    }
    studies.sort();
    [
        Kind {
            name: "scenarios",
            texts: all,
            // As the program does: the receiver's table is read by the receiver.
            read: |text| {
                Scenario::parse_in(text, "file", &directory(), false).map_err(|e| e.to_string())?;
                Settings::of_scenario(text, "file").map(drop).map_err(|e| e.to_string())
            },
        },
        Kind {
            name: "receiver's settings",
            texts: vec![("defaults".to_owned(), defaults)],
            read: |text| Settings::parse(text, "file").map(drop).map_err(|e| e.to_string()),
        },
        Kind {
            name: "limits",
            texts: vec![("limits".to_owned(), LIMITS.to_owned())],
            read: |text| Limits::parse(text, "file").map(drop).map_err(|e| e.to_string()),
        },
        Kind {
            name: "studies",
            texts: studies,
            read: |text| Study::parse(text, "file").map(drop).map_err(|e| e.to_string()),
        },
    ]
}

/// Two likely slips: a letter left out, and the last one doubled.
fn typos(key: &str) -> [String; 2] {
    let middle = key.len() / 2;
    [format!("{}{}", &key[..middle], &key[middle + 1..]), format!("{key}{}", &key[key.len() - 1..])]
}

#[test]
fn a_mistyped_key_of_any_text_is_refused_at_its_line_with_the_right_key() {
    let mut failures = Vec::new();
    for Kind { name, texts, read } in kinds() {
        let mut tally = Tally::new(FAMILY, format!("9. mistyped keys: {name}"));
        let mut count = 0;
        let every = if texts.len() > 1 { cases(5, 1) } else { 1 };
        for (file, text) in texts {
            read(&text).unwrap_or_else(|message| panic!("{file}: {message}"));
            let mut slips: Vec<(usize, String, String, String)> = Vec::new();
            for (number, _, key, value) in settings(&text) {
                if key.len() >= 3 && key != "s4" {
                    slips.extend(typos(&key).map(|typo| (number, format!("{typo} = {value}"), typo, key.clone())));
                }
            }
            // Headers of tables, but for the first part of a name in several parts, which other headers may
            // have too, and for a list whose entries have tables: those would be the entry's before.
            let has_tables = |header: &str| text.lines().any(|line| line.starts_with(&format!("[{header}.")));
            for (number, line) in text.lines().enumerate().filter(|(_, line)| line.starts_with('[')) {
                let header = line.split(" #").next().unwrap().trim().trim_matches(['[', ']']).to_owned();
                if line.starts_with("[[") && has_tables(&header) {
                    continue;
                }
                let (above, key) = header.rsplit_once('.').map_or(("", header.as_str()), |(above, key)| (above, key));
                for typo in typos(key) {
                    let whole = if above.is_empty() { typo.clone() } else { format!("{above}.{typo}") };
                    let line = if line.starts_with("[[") { format!("[[{whole}]]") } else { format!("[{whole}]") };
                    slips.push((number, line, typo, key.to_owned()));
                }
            }
            for (number, line, typo, key) in slips {
                count += 1;
                if count % every != 0 {
                    continue;
                }
                let text = with_line(&text, number, &line);
                tally.case(
                    || format!("{file}:{}: {line}", number + 1),
                    || match read(&text) {
                        // A line of its own says it, beside those of keys that need the one that is gone.
                        Err(message)
                            if message.lines().any(|line| {
                                line.starts_with(&format!("file:{}:", number + 1))
                                    && line.contains(&typo)
                                    && line.replacen(&typo, "", 1).contains(&key)
                            }) =>
                        {
                            Ok(End::Refused)
                        }
                        other => Err(format!("{other:?}")),
                    },
                );
            }
        }
        failures.extend(tally.close().err());
    }
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}

/// Values that no number may have, or that few may: see [`legal`].
const VALUES: [&str; 10] = ["-7", "0", "-0.0", "inf", "-inf", "nan", "1e308", "true", "\"5 m\"", "[1979-05-27]"];

#[test]
fn a_bad_value_of_any_key_of_any_text_is_refused_at_its_line_with_key_and_range() {
    let mut failures = Vec::new();
    for Kind { name, texts, read } in kinds() {
        let mut tally = Tally::new(FAMILY, format!("10. bad values: {name}"));
        let mut count = 0;
        let every = if texts.len() > 1 { cases(7, 1) } else { 1 };
        for (file, text) in texts {
            for (number, table, key, value) in settings(&text) {
                // An axis names a key of the base, which its pictures name too.
                if name == "studies" && ["key", "keep", "values", "scenario", "level"].contains(&key.as_str())
                    || value.starts_with("\"\"\"")
                {
                    continue;
                }
                for bad in VALUES {
                    count += 1;
                    if count % every != 0 {
                        continue;
                    }
                    let text = with_line(&text, number, &format!("{key} = {bad}"));
                    let last = key.rsplit('.').next().unwrap_or(&key).trim_matches('"').to_owned();
                    tally.case(
                        || format!("{file}: {table}.{key} = {bad}, was {value}"),
                        || {
                            let legal =
                                legal(&table, &key, &value, bad).ok_or("the table of meanings lacks this key")?;
                            match (read(&text), legal) {
                                (Ok(()), Legal::Yes | Legal::Perhaps) => Ok(End::Accepted),
                                (Ok(()), Legal::No) => Err("accepted".to_owned()),
                                (Err(message), Legal::Yes) => Err(format!("is legal, and refused: {message}")),
                                // Beside certain other values only: it may be these that are named. Of a file
                                // that cannot be read the system's reason says it.
                                (Err(message), Legal::Perhaps)
                                    if message.starts_with("file:")
                                        && ["expected", "cannot be read"].iter().any(|word| message.contains(word)) =>
                                {
                                    Ok(End::Refused)
                                }
                                (Err(message), _) => {
                                    let placed = message.starts_with(&format!("file:{}:", number + 1));
                                    let said = message.contains(&last) && message.contains("expected");
                                    if placed && said { Ok(End::Refused) } else { Err(message) }
                                }
                            }
                        },
                    );
                }
            }
        }
        failures.extend(tally.close().err());
    }
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}

#[test]
fn values_that_contradict_each_other_are_refused_with_the_number_that_decides() {
    let base = "name = \"x\"\nstart = 2010-07-01T08:05:58\nduration_s = 10\n[motion]\nkind = \"static\"\n\
                latitude_deg = 26.5\nlongitude_deg = 80.2\nheight_m = 130\n[power]\ncn0_dbhz = 45\n[noise]\n";
    let long_scene = base.replace("duration_s = 10", "duration_s = 2.6e6");
    let add = |tables: &str| format!("{base}{tables}\n");
    let moving = base.replace(
        "kind = \"static\"\nlatitude_deg = 26.5\nlongitude_deg = 80.2\nheight_m = 130\n",
        "kind = \"waypoints\"\n[[motion.point]]\nlatitude_deg = 26.5\nlongitude_deg = 80.2\nheight_m = 130\n\
         speed_mps = 5\n\
         [[motion.point]]\nlatitude_deg = 26.50001\nlongitude_deg = 80.2\nheight_m = 130\nspeed_mps = 5\n",
    );
    let power = |line: &str| base.replace("cn0_dbhz = 45", &format!("kind = \"link_budget\"\n{line}"));
    let jam = |line: &str| add(&format!("[[interference]]\non_s = 1\n{line}"));
    let later = base.replace("T08:05:58", "T20:05:58");
    let obstruction = |line: &str| add(&format!("[[obstruction]]\n{line}"));
    // A name, the text, and a part of what is said, in a refusal or in a warning.
    #[rustfmt::skip]
    let table: [(&str, String, &str); 55] = [
        ("an IF beyond the band", add("[front_end]\nsample_rate_hz = 4e6\nif_hz = 3e6"), "2000000"),
        ("a real format at 0 Hz", add("[front_end]\nformat = \"ri8\""), "is real"),
        ("more bits than the format", add("[adc]\nbits = 12"), "at most 8"),
        ("1e14 samples", format!("{long_scene}[front_end]\nsample_rate_hz = 5e7\nformat = \"ci8\"\n"), "at most 1e14"),
        ("no satellite in view", add("[satellites]\nmask_deg = 89"), "a position needs 4"),
        ("a scene before its data", base.replace("2010-07-01", "2010-05-01"), "expected a scene within"),
        ("a scene after its data", base.replace("2010-07-01", "2031-07-01"), "expected a scene within"),
        ("half of Klobuchar", add("[ionosphere]\nmodel = \"klobuchar\"\nalpha = [0, 0, 0, 0]"), "beta"),
        ("a wall without a distance", add("[[multipath]]\nkind = \"wall\"\namplitude = 0.5\nazimuth_deg = \
                                           3"), "distance_m"),
        ("a building inside out", obstruction("kind = \"building\"\neast_m = [9, 2]\nnorth_m = [1, 2]\ntop_m = \
                                               3"), "smaller of its two sides"),
        ("azimuths that fall", obstruction("kind = \"horizon\"\nazimuth_deg = [9, 2]\nelevation_deg = [1, \
                                            2]"), "ascending"),
        ("elevations too few", obstruction("kind = \"horizon\"\nazimuth_deg = [1, 2]\nelevation_deg = [1]"), "as \
                                                                                                              many as azimuth_deg has: 2"),
        ("a city without its file", add("[city]\nfile = \"nowhere.city.json\""), "cannot be read"),
        ("a city of another format", add("[city]\nfile = \"ride.csv\""), "ride.csv:1:1: not CityJSON"),
        ("a city at no position", add("[city]\nfile = \"street.city.json\""), "no metadata.referenceSystem"),
        ("a pulse longer than its period", jam("kind = \"pulse\"\njs_db = 9\nwidth_s = 0.01\nrate_hz = 1100"), "at \
                                                                                                                most 9.09"),
        ("a pulse of half a sample", jam("kind = \"pulse\"\njs_db = 9\nwidth_s = 1e-7\nrate_hz = 1100"), "two \
                                                                                                          samples, 7.69"),
        ("off before on", jam("kind = \"cw\"\njs_db = 9\noff_s = 0.5"), "from 1 s (on_s) upwards"),
        ("two strengths", jam("kind = \"cw\"\njs_db = 9\npower_dbw = -90"), "exactly one of"),
        ("radiated from nowhere", jam("kind = \"cw\"\neirp_dbw = -9"), "a position with it"),
        ("watts against a fixed C/N0", jam("kind = \"cw\"\npower_dbw = -90"), "link_budget"),
        ("a ratio at a distance", jam("kind = \"cw\"\njs_db = 9\ndistance_m = 5"), "only eirp_dbw needs it"),
        ("a line outside the band", jam("kind = \"cw\"\njs_db = 9\noffset_hz = 5e6"), "outside the samples' band"),
        ("a chirp half outside the band", jam("kind = \"chirp\"\njs_db = 9\nsweep_hz = 2e6\nsweep_s = 1e-4\n\
                                               offset_hz = 1.3e6"), "is silent"),
        ("a ramp from nowhere", add("[[spoofer]]\npower_db = 3\nramp_s = 4"), "both or none"),
        ("phase below its amplitude's", add("[scintillation]\ns4 = 0.9\nsigma_phi_rad = 0.01\ndecorrelation_s = \
                                             1"), "comes with s4 = 0.9"),
        ("a roll along the velocity", format!("{moving}[attitude]\nkind = \"velocity\"\nroll_deg = 3\n"), "keeps the \
                                                                                                           right side level"),
        ("a velocity that is none", add("[attitude]\nkind = \"velocity\""), "is at rest"),
        ("holding while moving", moving.replace("speed_mps = 5", "speed_mps = 5\nhold_s = 3"), "speed_mps is not 0"),
        ("two laws of turning", moving.replace("[[motion.point]]\nlatitude_deg = 26.5\n", "turn_radius_m = 5\n\
                                                                                           turn_acceleration_mps2 = 2\n[[motion.point]]\nlatitude_deg = 26.5\n"), "only one of"),
        ("one point", base.replace("kind = \"static\"\nlatitude_deg", "kind = \"waypoints\"\n[[motion.point]]\n\
                                                                       speed_mps = 0\nlatitude_deg"), "two or more"),
        ("a motion that ends first", moving.clone(), "change duration_s"),
        ("an antenna's file alone", power("antenna_file = \"a.csv\""), "unless antenna"),
        ("a table without a file", power("antenna = \"table\""), "because antenna"),
        ("C/N0 in a link budget", power("cn0_dbhz = 45"), "unknown key 'power.cn0_dbhz'"),
        ("weather beside GPT3", add("[troposphere]\nmodel = \"saastamoinen\"\ngpt3_file = \"g\"\npressure_hpa = \
                                     900"), "brings its own"),
        ("VMF1 without coefficients", add("[troposphere]\nmodel = \"saastamoinen\"\nmapping = \"vmf1\""), "vmf_file \
                                                                                                           or gpt3_file"),
        ("coefficients without VMF", add("[troposphere]\nmodel = \"saastamoinen\"\nvmf_file = \"v\""), "mapping \
                                                                                                        = \"vmf1\""),
        ("phase noise without a band", add("[local_oscillator]\nphase_noise_rad = 0.1"), "because phase_noise_rad"),
        ("Q of a real format", add("[front_end]\nformat = \"ri8\"\nif_hz = 6e5\n[iq]\ngain_db = 1"), "has no Q"),
        ("a filter without order", add("[filter]\nkind = \"butterworth\"\nbandwidth_hz = 2e6"), "an integer from 1 \
                                                                                                 to 10"),
        ("an order that is none", add("[filter]\nkind = \"brick_wall\"\norder = 3\nbandwidth_hz = 2e6"), "no order"),
        ("two laws of an oscillator", add("[receiver_clock]\noscillator = \"tcxo\"\npower_law = [0, 0, 1e-20, 0, \
                                           0]"), "nothing beside oscillator"),
        ("negative noise", add("[receiver_clock]\npower_law = [0, 0, -1e-20, 0, 0]"), "none negative"),
        ("an orbit that jumps", add("[[satellite_fault]]\nkind = \"orbit\"\nsatellites = [\"G03\"]\nalong_m = 3\n\
                                     on_s = 2"), "orbits do not jump"),
        ("an echo that overtakes", add("[[multipath]]\nkind = \"given\"\namplitude = 0.5\nexcess_m = 5\nrate_mps = \
                                        -1"), "fall below 0 after 5.000 s"),
        ("a playback of nothing", add("[satellites]\nmask_deg = 89\n[playback]\nbits = 8"), "nothing to set its \
                                                                                             level by"),
        ("a signal twice", format!("signals = [\"GPS L1 C/A\", \"GPS L1 C/A\"]\n{base}"), "different signals"),
        ("orbits of another day", format!("{later}[orbits]\nsp3 = \"igs15904_05h_12h.sp3.gz\"\n"), "the scene needs"),
        ("maps of another day", add("[ionosphere]\nmodel = \"ionex\"\nfile = \"igrg3380.10i.gz\""), "the maps are of"),
        ("health of nobody", add("[[message_fault]]\nkind = \"health\"\nhealth = 3"), "satellites"),
        ("B T above the limit", add("[receiver.tracking]\npll_bandwidth_hz = 25\nintegration = 20"), "at most 20 Hz"),
        ("intervals that do not divide", add("[receiver.operation]\ntracking_interval_ms = 33"), "a divisor of \
                                                                                                  measurement_interval_ms, 100"),
        ("an unlock above the lock", add("[receiver.tracking]\nphase_unlock_threshold = 0.9"), "0 to \
                                                                                                phase_lock_threshold"),
        ("a file that is a directory", add("[navigation]\nfile = \"extremes\""), "not a file"),
    ];
    let mut tally = Tally::new(FAMILY, "11. contradictions");
    for (name, text, part) in &table {
        tally.case(
            || (*name).to_owned(),
            || {
                let composed = Scenario::parse(text, "scene").and_then(|scene| {
                    scene.compose(&directory(), &Overrides::default()).map(|(_, warnings)| warnings.join("; "))
                });
                let settings = Settings::of_scenario(text, "scene").map_err(|error| error.to_string());
                match (composed.map_err(|error| error.to_string()), settings) {
                    (Err(error), _) | (Ok(_), Err(error)) if error.contains(part) && error.starts_with("scene") => {
                        Ok(End::Refused)
                    }
                    (Ok(warnings), Ok(_)) if warnings.contains(part) => Ok(End::Reported),
                    other => Err(format!("{other:?}").chars().take(300).collect()),
                }
            },
        );
    }
    tally.finish();
}
