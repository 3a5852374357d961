//! The command: what it sends, records and counts, and how it ends.

use std::fs;
use std::io::{Read, Write};
use std::net::UdpSocket;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::time::Duration;

use serde_json::Value;

pub(super) const SCENE: &str = r#"
name = "live"
start = 2010-07-01T08:06:00
duration_s = 1.2
noise = {}
truth = { interval_s = 0.2 }
motion = { kind = "pushed", latitude_deg = 48.1, longitude_deg = 11.6, height_m = 520 }
[[interference]]
kind = "cw"
js_db = 3
"#;

/// A place 520 m above 48.1° north, 11.6° east, ECEF.
const PLACE_M: [f64; 3] = [4_180_876.0, 858_201.0, 4_724_554.0];

pub(super) struct Bench {
    pub directory: tempfile::TempDir,
}

impl Bench {
    pub fn new() -> Self {
        let directory = tempfile::tempdir().unwrap();
        fs::write(directory.path().join("scene.toml"), SCENE).unwrap();
        Self { directory }
    }

    pub fn path(&self, name: &str) -> PathBuf {
        self.directory.path().join(name)
    }

    pub fn start(&self, arguments: &[&str]) -> Child {
        Command::new(env!("CARGO_BIN_EXE_gnss-twin"))
            .current_dir(self.directory.path())
            .args(["live", "scene.toml"])
            .args(arguments)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap()
    }

    /// The bytes that a record's replay makes.
    pub fn replayed(&self, record: &str) -> Vec<u8> {
        let scene = format!("{record}/replay.toml");
        let done = Command::new(env!("CARGO_BIN_EXE_gnss-twin"))
            .current_dir(self.directory.path())
            .args(["generate", &scene, "--out", "-", "--threads", "1"])
            .output()
            .unwrap();
        assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
        done.stdout
    }
}

pub(super) fn summary(path: &Path) -> Value {
    serde_json::from_str(&fs::read_to_string(path.join("live.json")).unwrap()).unwrap()
}

pub(super) fn errors(done: &Output) -> String {
    String::from_utf8_lossy(&done.stderr).into_owned()
}

/// A state of the circle that the vehicle flies, as a line.
fn state(t_s: f64) -> String {
    let (sin, cos) = libm::sincos(0.2 * t_s);
    let [x, y, z] = PLACE_M;
    let place = [x + 50.0 * (cos - 1.0), y + 50.0 * sin, z];
    let (velocity, pull) = ([-10.0 * sin, 10.0 * cos, 0.0], [-2.0 * cos, -2.0 * sin, 0.0]);
    let all = place.into_iter().chain(velocity).chain(pull);
    all.fold(format!("{t_s}"), |line, value| line + &format!(" {value}"))
}

#[test]
fn lines_on_standard_input_steer_and_switch_and_their_record_replays_to_the_byte() {
    let bench = Bench::new();
    let mut child = bench.start(&["--clock", "host", "--motion", "-", "--record", "flight"]);
    let mut input = child.stdin.take().unwrap();
    // All at once: they wait for their time. Nonsense is counted and changes nothing.
    let mut text: String = (0..130).map(|k| state(f64::from(k) * 0.01) + "\n").collect();
    text += "jammer 1 off\npower G13 -3\njammer 9 off\n1 2 3\n0.1 NaN 2 3\n0.5 4180876 858201 4724554\n";
    input.write_all(text.as_bytes()).unwrap();
    drop(input);
    let done = child.wait_with_output().unwrap();
    assert_eq!(done.status.code(), Some(0), "{}", errors(&done));
    assert_eq!(done.stdout.len(), 2 * 3_120_000);
    let made = summary(&bench.path("flight"));
    assert_eq!(made["ended_by"], "scene");
    assert_eq!(made["samples"], 3_120_000);
    // Samples on a stream have no date: a receiver of them takes it from here.
    assert_eq!(made["start"], "2010-07-01T08:06:00.000000");
    assert_eq!((&made["events"]["applied"], &made["events"]["refused"]), (&2.into(), &1.into()));
    let motion = &made["motion"];
    assert_eq!((&motion["malformed"], &motion["not_finite"]), (&1.into(), &1.into()), "{made}");
    assert!(motion["taken"].as_u64().unwrap() >= 100, "{made}");
    assert!(bench.path("flight/truth/scene.json").exists() && bench.path("flight/inputs.csv").exists());
    assert!(bench.replayed("flight") == done.stdout, "the replay differs");
    assert!(errors(&done).contains("no such source"), "{}", errors(&done));
}

#[test]
fn a_rig_with_a_zero_of_its_own_turns_the_body_and_the_record_replays() {
    let bench = Bench::new();
    let turned = format!("{SCENE}\n[attitude]\nkind = \"pushed\"\nlever_arm_m = [1, 0, -2]\n");
    let offset = |arguments: &[&str], scene: &str| {
        fs::write(bench.path("scene.toml"), scene).unwrap();
        let mut child = bench.start(&[&["--clock", "host", "--motion", "-", "--record", "rig"], arguments].concat());
        let line = |k: u32| {
            let state = state(f64::from(k) * 0.01);
            let (_, rest) = state.split_once(' ').unwrap();
            format!("{} {rest} ypr {} 0.1 -0.2\n", 5000.0 + f64::from(k) * 0.01, 0.02 * f64::from(k))
        };
        let text: String = (0..130).map(line).collect();
        child.stdin.take().unwrap().write_all(text.as_bytes()).unwrap();
        let done = child.wait_with_output().unwrap();
        assert_eq!(done.status.code(), Some(0), "{}", errors(&done));
        assert!(bench.replayed("rig") == done.stdout, "the replay differs");
        let made = summary(&bench.path("rig"));
        fs::remove_dir_all(bench.path("rig")).unwrap();
        (made["motion"].clone(), made["ticks"]["fresh"].as_u64().unwrap(), errors(&done))
    };
    let (motion, fresh, _) = offset(&["--motion-time", "first"], &turned);
    assert!((motion["offset_s"].as_f64().unwrap() + 5000.0).abs() < 1.2, "{motion}");
    assert!(fresh > 50 && motion["attitudes"].as_u64().unwrap() >= 100, "{motion}");
    // By the scene's time all of them lie far ahead, and by another table nothing turns.
    let (motion, fresh, said) = offset(&[], SCENE);
    assert!(motion["offset_s"].is_null() && fresh == 0, "{motion}");
    assert!(motion["attitudes_not_used"].as_u64().unwrap() >= 100 && said.contains("[attitude] kind"), "{said}");
}

/// A listener of a child: its address, and what it says after that.
pub(super) fn listener(child: &mut Child, what: &str) -> (String, std::thread::JoinHandle<String>) {
    let mut stderr = std::io::BufReader::new(child.stderr.take().unwrap());
    let mut line = String::new();
    let address = loop {
        line.clear();
        assert!(std::io::BufRead::read_line(&mut stderr, &mut line).unwrap() > 0, "ended before it listened");
        if let Some((_, address)) = line.trim().split_once(what) {
            break address.to_owned();
        }
    };
    (address, std::thread::spawn(move || std::io::read_to_string(&mut stderr).unwrap()))
}

#[test]
fn datagrams_are_followed_in_real_time_strangers_are_not_and_ages_are_measured() {
    let bench = Bench::new();
    let mut child = bench.start(&["--clock", "host", "--motion", "udp:0", "--record", "flight", "--latency", "20"]);
    let (port, reader) = listener(&mut child, "udp:");
    let mut stdout = child.stdout.take().unwrap();
    let samples = std::thread::spawn(move || {
        let mut bytes = Vec::new();
        std::io::Read::read_to_end(&mut stdout, &mut bytes).unwrap();
        bytes
    });
    let (own, other) = (UdpSocket::bind("127.0.0.1:0").unwrap(), UdpSocket::bind("127.0.0.1:0").unwrap());
    // While there is anyone to send to; a second sender and half a datagram now and then.
    for k in 0_u32.. {
        if child.try_wait().unwrap().is_some() {
            break;
        }
        let mut datagram = vec![7, 1];
        datagram.extend((10.0 * f64::from(k)).to_le_bytes());
        let line = state(0.01 * f64::from(k));
        let numbers = line.split(' ').skip(1).map(|word| word.parse::<f64>().unwrap());
        numbers.for_each(|value| datagram.extend(value.to_le_bytes()));
        datagram.extend(3_u32.to_le_bytes());
        datagram.extend(b"car");
        let _ = own.send_to(&datagram, &port);
        let _ = own.send_to(&datagram[..20], &port);
        let _ = other.send_to(&datagram, &port);
        std::thread::sleep(Duration::from_millis(10));
    }
    assert!(child.wait().unwrap().success(), "{}", reader.join().unwrap());
    let bytes = samples.join().unwrap();
    let made = summary(&bench.path("flight"));
    let count = |table: &str, key: &str| made[table][key].as_u64().unwrap();
    assert!(count("motion", "taken") > 20 && count("motion", "strangers") > 20, "{made}");
    assert!(count("motion", "malformed") > 20 && count("ticks", "fresh") > 10, "{made}");
    // The measure is there; how short it is no test may say.
    assert!(count("age_ms", "count") > 10 && made["age_ms"]["p99"].as_f64().unwrap() >= 20.0, "{made}");
    assert!(bench.replayed("flight") == bytes, "the replay differs");
}

#[test]
fn a_signal_in_the_middle_ends_with_whole_ticks_a_record_and_its_own_code() {
    let bench = Bench::new();
    fs::write(bench.path("scene.toml"), SCENE.replace("1.2", "3600")).unwrap();
    for (name, code) in [("TERM", 143), ("INT", 130)] {
        let child = bench.start(&["--clock", "host", "--to", "file:if.ci8", "--record", "cut"]);
        // Its samples come while the file has no name yet.
        let making = bench.path(".if.ci8.part");
        while fs::metadata(&making).map_or(0, |about| about.len()) < 200_000 {
            std::thread::sleep(Duration::from_millis(5));
        }
        let id = child.id().to_string();
        assert!(Command::new("kill").args(["-s", name, &id]).status().unwrap().success());
        let done = child.wait_with_output().unwrap();
        assert_eq!(done.status.code(), Some(code), "{}", errors(&done));
        assert_eq!(summary(&bench.path("cut"))["ended_by"], "signal");
        let sent = fs::read(bench.path("if.ci8")).unwrap();
        assert!(sent.len().is_multiple_of(52_000), "{}", sent.len());
        assert!(bench.replayed("cut") == sent, "the replay differs");
    }
}

/// Samples of two bytes for 10 ms at 2.6 Msps.
const LEAST_BYTES: usize = 52_000;

#[test]
fn a_killed_run_leaves_a_record_that_replays_and_the_next_run_keeps_it() {
    let bench = Bench::new();
    fs::write(bench.path("scene.toml"), SCENE.replace("1.2", "3600")).unwrap();
    let unfinished = bench.path("cut.unfinished");
    for kept in ["cut.unfinished-1", "cut.unfinished-2"] {
        let mut child = bench.start(&["--clock", "host", "--motion", "-", "--record", "cut"]);
        child.stdin.as_mut().unwrap().write_all(b"power G13 -3\n").unwrap();
        let mut sent = child.stdout.take().unwrap();
        // On a busy machine the record may be there before its samples have left.
        let mut first = vec![0; LEAST_BYTES];
        sent.read_exact(&mut first).unwrap();
        let reading = std::thread::spawn(move || {
            // A killed sender ends the stream.
            let _ = sent.read_to_end(&mut first);
            first
        });
        while !unfinished.join("replay.toml").is_file() {
            std::thread::sleep(Duration::from_millis(5));
        }
        child.kill().unwrap();
        child.wait().unwrap();
        let sent = reading.join().unwrap();
        let replayed = bench.replayed("cut.unfinished");
        // Every second it is brought up to date, before the samples of the last ticks leave.
        let both = replayed.len().min(sent.len());
        assert!(both >= LEAST_BYTES && replayed[..both] == sent[..both], "{} and {}", replayed.len(), sent.len());

        let mut next = bench.start(&["--clock", "free", "--record", "cut"]);
        let id = next.id().to_string();
        // It is at work, and ends in order, once samples leave.
        next.stdout.as_mut().unwrap().read_exact(&mut [0]).unwrap();
        assert!(Command::new("kill").args(["-s", "INT", &id]).status().unwrap().success());
        let done = next.wait_with_output().unwrap();
        assert!(errors(&done).contains(kept), "{}", errors(&done));
        assert!(bench.replayed(kept) == replayed && !unfinished.exists(), "{kept}");
    }
}

#[test]
fn a_state_far_ahead_is_refused_by_its_value_and_costs_no_other() {
    let bench = Bench::new();
    let mut child = bench.start(&["--clock", "host", "--motion", "-", "--record", "flight"]);
    let [x, y, z] = PLACE_M;
    let mut text = format!("1e9 {x} {y} {z}\n1000 {x} {y} {z}\n");
    (0..130).for_each(|k| text += &(state(f64::from(k) * 0.01) + "\n"));
    child.stdin.take().unwrap().write_all(text.as_bytes()).unwrap();
    let done = child.wait_with_output().unwrap();
    let made = summary(&bench.path("flight"));
    assert_eq!(made["motion"]["ahead"], 1, "{made}");
    assert!(
        made["motion"]["taken"].as_u64().unwrap() >= 100 && made["ticks"]["fresh"].as_u64().unwrap() > 50,
        "{made}"
    );
    assert!(errors(&done).contains("1e9 s while the scene is at"), "{}", errors(&done));
}

#[test]
fn limits_that_are_passed_end_with_three_and_a_sink_that_leaves_ends_quietly() {
    let bench = Bench::new();
    let mut child = bench.start(&["--clock", "host", "--motion", "-", "--to", "file:if.ci8", "--max-late", "3"]);
    let mut input = child.stdin.take().unwrap();
    // All of the scene's first millisecond, and most of them long after it was sent.
    for k in 0_u32.. {
        if child.try_wait().unwrap().is_some()
            || input.write_all(format!("{}\n", state(f64::from(k) * 1e-8)).as_bytes()).is_err()
        {
            break;
        }
        std::thread::sleep(Duration::from_millis(1));
    }
    drop(input);
    let done = child.wait_with_output().unwrap();
    assert_eq!(done.status.code(), Some(3), "{}", errors(&done));
    assert!(errors(&done).contains("--max-late 3"), "{}", errors(&done));

    let mut child = bench.start(&["--clock", "free", "--record", "gone"]);
    drop(child.stdout.take());
    let done = child.wait_with_output().unwrap();
    assert_eq!(done.status.code(), Some(141), "{}", errors(&done));
    assert_eq!(summary(&bench.path("gone"))["ended_by"], "sink");
}

#[test]
fn what_does_not_fit_is_refused_before_anything_is_sent() {
    let bench = Bench::new();
    fs::write(bench.path("still.toml"), SCENE.replace("pushed", "static")).unwrap();
    let refused = |arguments: &[&str], code: i32, message: &str| {
        let done = Command::new(env!("CARGO_BIN_EXE_gnss-twin"))
            .current_dir(bench.directory.path())
            .arg("live")
            .args(arguments)
            .output()
            .unwrap();
        assert_eq!(done.status.code(), Some(code), "{arguments:?}: {}", errors(&done));
        assert!(errors(&done).contains(message), "{arguments:?}: {}", errors(&done));
        assert!(done.stdout.is_empty());
    };
    refused(&["still.toml", "--motion", "-"], 2, "kind = \"pushed\"");
    refused(&["scene.toml", "--motion", "udp:somewhere"], 2, "expected PORT");
    refused(&["scene.toml", "--motion", "serial:1"], 2, "expected udp:ADDR");
    refused(&["scene.toml", "--latency", "0"], 2, "0.5 to 10000");
    refused(&["scene.toml", "--start-at", "2010-07-01T08:06:00Z"], 2, "is over");
    refused(&["scene.toml", "--start-at", "soon"], 2, "expected a whole UTC second");
    let taken = UdpSocket::bind("127.0.0.1:0").unwrap();
    let address = format!("udp:{}", taken.local_addr().unwrap());
    refused(&["scene.toml", "--motion", &address], 73, "cannot listen on udp:127.0.0.1:");
    // Without what is pushed, the scene is for `live` alone.
    let done = Command::new(env!("CARGO_BIN_EXE_gnss-twin"))
        .current_dir(bench.directory.path())
        .args(["generate", "scene.toml", "--out", "if.sigmf-data"])
        .output()
        .unwrap();
    assert_eq!(done.status.code(), Some(65), "{}", errors(&done));
    assert!(errors(&done).contains("gnss-twin live"), "{}", errors(&done));
}

/// A stream is samples: without them there is nothing to send, and no sink or record is begun.
#[test]
fn a_level_without_samples_is_refused_by_name() {
    let bench = Bench::new();
    for level in ["correlations", "observations"] {
        let scene = SCENE.replacen("noise = {}", &format!("noise = {{}}\nfidelity = {{ level = \"{level}\" }}"), 1);
        let known = scene.replacen("\"pushed\"", "\"static\"", 1);
        for scene in [scene, known] {
            fs::write(bench.path("scene.toml"), scene).unwrap();
            let arguments = ["--clock", "free", "--to", "file:sent.bin", "--record", "flight"];
            let done = bench.start(&arguments).wait_with_output().unwrap();
            assert_eq!(done.status.code(), Some(65), "{}", errors(&done));
            let expected = format!("fidelity.level = \"{level}\": no samples exist at this level: take \"balanced\"");
            assert!(errors(&done).contains(&expected), "{}", errors(&done));
            let left: Vec<_> =
                fs::read_dir(bench.directory.path()).unwrap().map(|one| one.unwrap().file_name()).collect();
            assert_eq!(left, ["scene.toml"], "{}", errors(&done));
        }
    }
}
