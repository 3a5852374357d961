//! The program on a machine that fails: exit codes, and names that only whole files bear.

use std::fs;
use std::os::unix::fs::{PermissionsExt, symlink};
use std::path::Path;
use std::process::{Command, Output, Stdio};

use gnss::samples::Format;
use receiver::format::Check;

use crate::damage::Random;
use crate::machine::NO_FIX;
use crate::tally::{End, Tally};

const FAMILY: &str = "The program";
const TWIN: &str = env!("CARGO_BIN_EXE_gnss-twin");

/// A scene of a twentieth of a second.
const TINY: &str = "name = \"tiny\"\nstart = 2010-07-01T08:05:58\nduration_s = 0.05\nseed = 1\n[motion]\nkind \
                    = \"static\"\n\
                        latitude_deg = 26.5\nlongitude_deg = 80.2\nheight_m = 130\n[front_end]\nsample_rate_hz = \
                        2.6e6\n\
                        format = \"ci8\"\n[power]\ncn0_dbhz = 45\n[noise]\n";

fn workplace() -> tempfile::TempDir {
    let directory = tempfile::tempdir().unwrap();
    fs::write(directory.path().join("tiny.toml"), TINY).unwrap();
    directory
}

fn twin(arguments: &[&str], directory: &Path) -> Output {
    Command::new(TWIN).args(arguments).current_dir(directory).stdin(Stdio::null()).output().unwrap()
}

fn names(directory: &Path) -> Vec<String> {
    let mut names: Vec<String> = fs::read_dir(directory)
        .unwrap()
        .map(|entry| entry.unwrap().file_name().to_string_lossy().into_owned())
        .collect();
    names.sort();
    names
}

/// Asks for an exit code and a part of the message, one line of text and no panic.
fn ends(output: &Output, code: i32, part: &str) -> Result<End, String> {
    let message = String::from_utf8_lossy(&output.stderr);
    if output.status.code() == Some(code) && message.contains(part) && !message.contains("panicked") {
        Ok(if code == 0 { End::Accepted } else { End::Refused })
    } else {
        Err(format!("{:?}, expected {code} and '{part}': {message}", output.status))
    }
}

#[test]
fn texts_of_any_shape_are_refused_as_bad_data() {
    let here = workplace();
    let shapes: [(&str, Vec<u8>); 12] = [
        ("empty", Vec::new()),
        ("not UTF-8", vec![0xff, 0xfe, 0]),
        ("zeros", vec![0; 100]),
        ("a key twice", format!("seed = 2\n{TINY}").into_bytes()),
        ("a table twice", format!("{TINY}[noise]\n").into_bytes()),
        ("arrays 10000 deep", format!("seed = {}{}", "[".repeat(10_000), "]".repeat(10_000)).into_bytes()),
        ("tables 10000 deep", format!("seed = {}1{}", "{a=".repeat(10_000), "}".repeat(10_000)).into_bytes()),
        ("a key of 10000 parts", format!("{}a = 1", "a.".repeat(10_000)).into_bytes()),
        ("a header of 10000 parts", format!("[{}a]", "a.".repeat(10_000)).into_bytes()),
        ("10 MB of comment", "# a comment\n".repeat(900_000).into_bytes()),
        ("a text without end", format!("name = \"\"\"{TINY}").into_bytes()),
        ("a line of 900 kB", format!("name = \"{}\"", "x".repeat(900_000)).into_bytes()),
    ];
    let mut tally = Tally::of_processes(FAMILY, "12. shapes of texts");
    for (name, bytes) in shapes {
        for (role, arguments) in [
            ("scenario", &["plan", "odd.toml"][..]),
            ("limits", &["run", "tiny.toml", "--out", "x", "--check", "odd.toml"]),
            (
                "settings",
                &["receive", "raw.bin", "--out", "x", "--format", "ci8", "--rate-hz", "4e6", "--receiver", "odd.toml"],
            ),
            ("metadata", &["receive", "odd.sigmf-data", "--out", "x"]),
        ] {
            // Comments alone are legal settings, all at their defaults.
            if role == "settings" && ["empty", "10 MB of comment"].contains(&name) {
                continue;
            }
            fs::write(here.path().join("odd.toml"), &bytes).unwrap();
            fs::write(here.path().join("odd.sigmf-meta"), &bytes).unwrap();
            tally.case(|| format!("{role}: {name}"), || ends(&twin(arguments, here.path()), 65, "odd."));
        }
    }
    tally.case(
        || "nothing may be written".to_owned(),
        || if here.path().join("x").exists() { Err("x exists".to_owned()) } else { Ok(End::Refused) },
    );
    tally.finish();
}

#[test]
fn outputs_that_cannot_be_made_and_inputs_that_are_no_files_have_their_exit_codes() {
    let here = workplace();
    let at = |name: &str| here.path().join(name);
    fs::create_dir(at("full")).unwrap();
    fs::write(at("full/mine.txt"), "mine").unwrap();
    fs::write(at("file"), "mine").unwrap();
    symlink("/dev/zero", at("zero")).unwrap();
    assert!(Command::new("mkfifo").arg(at("pipe")).status().unwrap().success());
    let mut tally = Tally::of_processes(FAMILY, "19, 21. outputs, devices, sizes");
    let long = TINY.replace("duration_s = 0.05", "duration_s = 2.6e6").replace("2.6e6\nformat", "5e7\nformat");
    fs::write(at("huge.toml"), long).unwrap();
    let rows: [(&[&str], i32, &str); 18] = [
        (&["generate", "tiny.toml", "--out", "full"], 73, "is a directory"),
        (&["generate", "tiny.toml", "--out", "pipe"], 73, "not an ordinary file"),
        (&["generate", "tiny.toml", "--out", "/dev/full"], 73, "not an ordinary file"),
        (&["generate", "tiny.toml", "--out", "file/x.sigmf-data"], 73, "file"),
        (&["generate", "tiny.toml", "--out", "/proc/x.sigmf-data"], 73, "/proc"),
        (&["run", "tiny.toml", "--out", "full"], 73, "not the result of a run"),
        (&["run", "tiny.toml", "--out", "file"], 73, "file"),
        (&["run", "tiny.toml", "--out", "/proc/x"], 73, "/proc"),
        (&["run", "tiny.toml", "--out", ".."], 73, ""),
        (&["plan", "full"], 65, "full"),
        (&["plan", "zero"], 65, "at most"),
        (&["plan", "absent\u{1b}[31m.toml"], 65, "absent\\u{1b}[31m.toml"),
        (&["plan", "absent\nerror.toml"], 65, "absent\\nerror.toml"),
        (&["run", "tiny.toml", "--out", "x", "--check", "zero"], 65, "at most"),
        (&["receive", "full", "--out", "x", "--format", "ci8", "--rate-hz", "4e6"], 65, "directory"),
        (&["plan", "huge.toml"], 65, "1e14"),
        (&["generate", "tiny.toml", "--out", "y.sigmf-data", "--samples", "1000000000000"], 2, "0 to 129999"),
        (
            &["generate", "tiny.toml", "--out", "y.sigmf-data", "--seek", "18446744073709551615", "--samples", "2"],
            2,
            "0 to",
        ),
    ];
    for (arguments, code, part) in rows {
        tally.case(|| format!("{arguments:?}"), || ends(&twin(arguments, here.path()), code, part));
    }
    tally.case(
        || "what was there is still there".to_owned(),
        || match (fs::read_to_string(at("full/mine.txt")), fs::read_to_string(at("file")), names(here.path())) {
            (Ok(one), Ok(two), names)
                if one == "mine" && two == "mine" && !names.iter().any(|n| n.ends_with(".part") || n == "x") =>
            {
                Ok(End::Accepted)
            }
            other => Err(format!("{other:?}")),
        },
    );
    tally.case(
        || "a full standard output".to_owned(),
        || {
            let full = fs::OpenOptions::new().write(true).open("/dev/full").unwrap();
            let output = Command::new(TWIN).args(["plan", "tiny.toml"]).current_dir(here.path()).stdout(full).output();
            ends(&output.unwrap(), 75, "standard output")
        },
    );
    for bytes in [0, 1, 100, 4000] {
        let script = format!("{{ '{TWIN}' plan tiny.toml; echo $? >status; }} | head -c {bytes} >/dev/null");
        tally.case(
            || format!("head -c {bytes}"),
            || {
                let output = Command::new("bash").args(["-c", &script]).current_dir(here.path()).output().unwrap();
                let message = String::from_utf8_lossy(&output.stderr);
                let status = fs::read_to_string(at("status")).unwrap_or_default();
                if ["0", "141"].contains(&status.trim()) && !message.contains("panicked") && !message.contains("error")
                {
                    Ok(End::Accepted)
                } else {
                    Err(format!("{status}: {message}"))
                }
            },
        );
    }
    // As another user, whom modes bind; where there is no such user or no right to become it, modes cannot be
    // tested.
    fs::set_permissions(here.path(), fs::Permissions::from_mode(0o755)).unwrap();
    let nobody = Command::new("setpriv")
        .args(["--reuid=65534", "--clear-groups", TWIN, "generate", "tiny.toml", "--out", "z.sigmf-data"])
        .current_dir(here.path())
        .output();
    match nobody {
        Ok(output)
            if output.status.code() != Some(127) && !String::from_utf8_lossy(&output.stderr).contains("setpriv") =>
        {
            tally.case(|| "a directory that may not be written".to_owned(), || ends(&output, 73, "z"));
        }
        _ => println!("no setpriv: modes are not tested"),
    }
    tally.finish();
}

#[test]
fn what_a_terminal_would_obey_is_escaped_in_every_message() {
    let here = workplace();
    let forged = "\u{1b}[31m\nforged: all is well\r";
    let toml = forged.escape_debug().to_string().replace("\\u{1b}", "\\u001b");
    let write = |name: &str, text: &str| fs::write(here.path().join(name), text).unwrap();
    let moving = |file: &str| {
        TINY.replace(
            "kind = \"static\"\nlatitude_deg = 26.5\nlongitude_deg = 80.2\nheight_m = 130\n",
            &format!("kind = \"file\"\nfile = \"{file}\"\n"),
        )
    };
    write("key.toml", &format!("\"{toml}\" = 1\n{TINY}"));
    write("value.toml", &TINY.replace("\"tiny\"", &format!("\"{toml}\"")));
    write("path.toml", &moving(&toml));
    write("settings.toml", &format!("[tracking]\n\"{toml}\" = 1\n"));
    write("limits.toml", &format!("[position.\"{toml}\"]\nmax = 1\n"));
    write("word.toml", &format!("[position.fixes]\n\"{toml}\" = 1\n"));
    write("column.csv", &format!("time_s,\"{forged}\",longitude_deg,height_m\n0,1,2,3\n1,1,2,3\n"));
    write("column.toml", &moving("column.csv"));
    write("field.csv", &format!("time_s,latitude_deg,longitude_deg,height_m\n0,\"{forged}\",2,3\n"));
    write("field.toml", &moving("field.csv"));
    write("more.csv", &format!("time_s,latitude_deg,longitude_deg,height_m,\"{forged}\"\n0,1,2,3,4\n1,1,2,3,4\n"));
    write("more.toml", &moving("more.csv"));
    write("ride.nmea", &format!("$GPGGA,{},*00\n", forged.replace('\n', "")));
    write("nmea.toml", &moving("ride.nmea"));
    write("nav.rnx", &format!("{forged}{:>80}\n", "RINEX VERSION / TYPE"));
    write("nav.toml", &format!("{TINY}[navigation]\nfile = \"nav.rnx\"\n"));
    let meta = serde_json::json!({"global": {"core:datatype": forged, "core:sample_rate": 4e6}, "captures": [{}]});
    write("meta.sigmf-meta", &meta.to_string());
    write("meta.sigmf-data", "0000");
    let receive =
        ["receive", "raw.bin", "--out", "x", "--format", "ci8", "--rate-hz", "4e6", "--receiver", "settings.toml"];
    let rows: [(&[&str], i32); 12] = [
        (&["plan", "key.toml"], 65),
        (&["plan", "value.toml"], 65),
        (&["plan", "path.toml"], 65),
        (&receive, 65),
        (&["run", "tiny.toml", "--out", "x", "--check", "limits.toml"], 65),
        (&["run", "tiny.toml", "--out", "x", "--check", "word.toml"], 65),
        (&["plan", "column.toml"], 65),
        (&["plan", "field.toml"], 65),
        (&["plan", "more.toml"], 0),
        (&["plan", "nmea.toml"], 65),
        (&["plan", "nav.toml"], 65),
        (&["receive", "meta.sigmf-data", "--out", "x"], 65),
    ];
    let mut tally = Tally::of_processes(FAMILY, "Security. terminal escapes and line feeds in names and fields");
    for (arguments, code) in rows {
        tally.case(
            || format!("{arguments:?}"),
            || {
                let output = twin(arguments, here.path());
                let text = [output.stdout.as_slice(), &output.stderr].concat();
                let obeyed = text.iter().any(|byte| *byte < b' ' && *byte != b'\n' || *byte == 0x7f);
                let lines = String::from_utf8_lossy(&text).lines().any(|line| line.trim_start().starts_with("forged"));
                if obeyed || lines {
                    return Err(format!("{:?}", String::from_utf8_lossy(&text)));
                }
                ends(&output, code, "")
            },
        );
    }
    tally.finish();
}

#[test]
fn samples_that_end_within_a_sample_or_are_none_are_told_or_refused() {
    let here = workplace();
    let mut tally = Tally::of_processes(FAMILY, "14. samples and their metadata");
    let bytes: Vec<u8> = (0..40_001_u32).map(|n| (n.wrapping_mul(2_654_435_761) >> 24) as u8).collect();
    for (format, size) in [("ci8", 2), ("cu8", 2), ("ci16", 4), ("cf32", 8), ("ri8", 1), ("ri16", 2)] {
        for length in [0, 1, 3, 7, 40_000, 40_001] {
            fs::write(here.path().join("raw.bin"), &bytes[..length]).unwrap();
            let if_hz = if format.starts_with('r') { "1e6" } else { "0" };
            let arguments =
                ["receive", "raw.bin", "--out", "x", "--format", format, "--rate-hz", "4e6", "--if-hz", if_hz];
            tally.case(
                || format!("{format}, {length} bytes"),
                || {
                    let output = twin(&arguments, here.path());
                    let text = String::from_utf8_lossy(&output.stdout).into_owned();
                    match output.status.code() {
                        // Too short for a fix, not for results; what has no whole sample is refused.
                        Some(NO_FIX) if length >= size && length % size == 0 => Ok(End::Accepted),
                        Some(NO_FIX) if text.contains("cut") || text.contains("byte") => Ok(End::Reported),
                        Some(65) if !String::from_utf8_lossy(&output.stderr).contains("panicked") => Ok(End::Refused),
                        _ => Err(format!("{:?}: {text}{}", output.status, String::from_utf8_lossy(&output.stderr))),
                    }
                },
            );
            let _ = fs::remove_dir_all(here.path().join("x"));
        }
    }
    // Noise in one format beside metadata that say another.
    for (real, declared, look) in [
        ("ci8", "ci16_le", Some("ci8 or ri8")),
        ("ci8", "cu8", Some("ci8 or ri8")),
        ("ci8", "cf32_le", Some("ci8 or ri8")),
        ("ci16_le", "ci8", Some("ci16 or ri16")),
        ("cu8", "ci8", Some("cu8")),
        ("cf32_le", "ci16_le", Some("cf32")),
        ("ci16_be", "ci16_le", Some("high byte first")),
        ("ci8", "ri8", None),
        ("ci16_le", "ci16_le", None),
    ] {
        let meta = format!(
            "{{\"global\": {{\"core:datatype\": \"{declared}\", \"core:sample_rate\": 4000000}}, \"captures\": \
             [{{\"core:frequency\": {}}}]}}",
            if declared.starts_with('r') { 1_574_420_000 } else { 1_575_420_000 }
        );
        fs::write(here.path().join("odd.sigmf-meta"), meta).unwrap();
        fs::write(here.path().join("odd.sigmf-data"), noise(real, 20_000, 1.0)).unwrap();
        tally.case(
            || format!("{real} declared as {declared}"),
            || {
                let output = twin(&["receive", "odd.sigmf-data", "--out", "x"], here.path());
                let message = String::from_utf8_lossy(&output.stderr).into_owned();
                match look {
                    Some(look) if message.contains(look) && message.contains("warning") => {
                        ends(&output, NO_FIX, "").map(|_| End::Reported)
                    }
                    None if !message.contains("look like") => ends(&output, NO_FIX, "").map(|_| End::Accepted),
                    _ => Err(message),
                }
            },
        );
        let _ = fs::remove_dir_all(here.path().join("x"));
    }
    tally.finish();
}

/// Noise of the usual gain of a format, times `gain`, written without the program's help.
fn noise(format: &str, count: usize, gain: f64) -> Vec<u8> {
    let mut random = Random::new(14);
    let mut normal = move || (0..12).map(|_| random.below(1 << 20) as f64 / f64::from(1 << 20)).sum::<f64>() - 6.0;
    let mut bytes = Vec::new();
    for _ in 0..count {
        let x = normal() * gain;
        match format {
            "ci8" | "ri8" => bytes.push((28.0 * x).round().clamp(-127.0, 127.0) as i8 as u8),
            "cu8" => bytes.push((127.5 + 28.0 * x).round().clamp(0.0, 255.0) as u8),
            "ci16_le" | "ri16_le" => bytes.extend(((512.0 * x).round() as i16).to_le_bytes()),
            "ci16_be" => bytes.extend(((512.0 * x).round() as i16).to_be_bytes()),
            "cf32_le" => bytes.extend((x as f32).to_le_bytes()),
            "cf32_be" => bytes.extend((x as f32).to_be_bytes()),
            other => panic!("{other}"),
        }
    }
    bytes
}

#[test]
fn samples_that_look_like_another_format_are_named_and_those_that_cannot_be_told_are_not() {
    // Formats on disk, and as which of them each is recognised.
    let real = [
        ("ci8", "ci8 or ri8"),
        ("ri8", "ci8 or ri8"),
        ("cu8", "cu8"),
        ("ci16_le", "ci16 or ri16"),
        ("ri16_le", "ci16 or ri16"),
        ("cf32_le", "cf32"),
        ("ci16_be", "16-bit integers with the high byte first"),
        ("cf32_be", "floats with the high byte first"),
    ];
    let mut tally = Tally::new(FAMILY, "14. declared formats against the samples' histograms");
    for (format, look) in real {
        // A twentieth: 1.4 LSB of eight bits, 26 of sixteen.
        for gain in [0.05, 0.2, 1.0] {
            let bytes = noise(format, 40_000, gain);
            for (declared, _) in Format::NAMES {
                let name = &declared.to_string();
                tally.case(
                    || format!("{format} at {gain} declared as {name}"),
                    || {
                        let mut check = Check::new(declared);
                        bytes.chunks(997).for_each(|piece| check.take(piece));
                        match check.warning() {
                            // Real and complex samples of one width have the same histogram.
                            None if look.contains(name) => Ok(End::Accepted),
                            Some(text) if !look.contains(name) && text.contains(look) && text.contains(name) => {
                                Ok(End::Reported)
                            }
                            other => Err(format!("{other:?}")),
                        }
                    },
                );
            }
        }
    }
    tally.finish();
}
