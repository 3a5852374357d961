//! Samples through pipes and from files that change meanwhile, readers that are slow or gone, and no network.

use std::fs;
use std::io::{ErrorKind, Read, Write};
use std::path::Path;
use std::process::{Command, Stdio};

use gnss::sigmf;
use receiver::output::Output;
use receiver::receive;
use receiver::settings::Settings;

use crate::damage::Random;
use crate::machine::{Bench, Ended, Files, NO_FIX, TWIN, files, scene, twin};
use crate::tally::{End, Tally, cases, long};

const FAMILY: &str = "A machine that fails";

/// A recording of `duration_s` beside its metadata: `rec.sigmf-data`.
fn recording(duration_s: f64) -> tempfile::TempDir {
    let place = tempfile::tempdir().unwrap();
    fs::write(place.path().join("tiny.toml"), scene(duration_s, 1)).unwrap();
    let words = ["generate", "tiny.toml", "--out", "rec.sigmf-data"].map(str::to_owned);
    let output = twin(&words, place.path()).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    place
}

/// Gives its bytes in pieces of random length and is interrupted now and then.
struct Halting<'a> {
    bytes: &'a [u8],
    random: Random,
    longest: usize,
}

impl Read for Halting<'_> {
    fn read(&mut self, buffer: &mut [u8]) -> std::io::Result<usize> {
        if self.random.below(5) == 0 {
            return Err(ErrorKind::Interrupted.into());
        }
        let count = (1 + self.random.below(self.longest)).min(buffer.len()).min(self.bytes.len());
        let (now, later) = self.bytes.split_at(count);
        buffer[..count].copy_from_slice(now);
        self.bytes = later;
        Ok(count)
    }
}

fn received(reader: impl Read, place: &Path) -> Files {
    let meta = fs::read_to_string(place.join("rec.sigmf-meta")).unwrap();
    let metadata = sigmf::parse(&meta, "rec.sigmf-meta").unwrap();
    let mut settings = Settings::default();
    settings.acquisition.or_signals(&sigmf::describe(&meta, "rec.sigmf-meta").unwrap().signals);
    let out = tempfile::tempdir().unwrap();
    let mut output = Output::create(out.path()).unwrap();
    receive(&metadata, reader, &settings, &mut output, &mut |_| ()).unwrap();
    files(out.path())
}

#[test]
fn samples_give_the_same_results_however_they_arrive() {
    // Long enough for a search, and short.
    let (searched, short) = (recording(0.06), recording(0.02));
    let mut tally = Tally::of_processes(FAMILY, "15. short reads and interruptions");
    for (place, number) in [(&searched, cases(1, 40)), (&short, cases(9, 160))] {
        let bytes = fs::read(place.path().join("rec.sigmf-data")).unwrap();
        let whole = received(bytes.as_slice(), place.path());
        for seed in 0..number {
            let longest = [3, 1000, 4097, 300_000][seed % 4];
            tally.case(
                || format!("seed {seed}, pieces of up to {longest} bytes"),
                || {
                    let reader = Halting { bytes: &bytes, random: Random::new(seed as u64), longest };
                    if received(reader, place.path()) == whole {
                        Ok(End::Accepted)
                    } else {
                        Err("other results".into())
                    }
                },
            );
        }
    }
    tally.finish();

    let place = short.path();
    let bytes = fs::read(place.join("rec.sigmf-data")).unwrap();
    let flags = ["--format", "ci8", "--rate-hz", "2.6e6"];
    let whole =
        Command::new(TWIN).args(["receive", "rec.sigmf-data", "--out", "file"]).current_dir(place).output().unwrap();
    assert_eq!(whole.status.code(), Some(NO_FIX));
    let results = |name: &str| {
        let mut found = files(&place.join(name));
        // It tells the start that only the metadata know.
        found.remove("receiver.json");
        found
    };
    let expected = results("file");
    let mut tally = Tally::of_processes(FAMILY, "15. receive - from a pipe");
    for seed in 0..cases(3, 30) as u64 {
        tally.case(
            || format!("seed {seed}"),
            || {
                let mut child = Command::new(TWIN)
                    .args(["receive", "-", "--out", "pipe"])
                    .args(flags)
                    .current_dir(place)
                    .stdin(Stdio::piped())
                    .stderr(Stdio::piped())
                    .stdout(Stdio::null())
                    .spawn()
                    .unwrap();
                let (mut pipe, mut random, mut rest) =
                    (child.stdin.take().unwrap(), Random::new(seed), bytes.as_slice());
                while !rest.is_empty() {
                    let (now, later) = rest.split_at((1 + random.below(9000)).min(rest.len()));
                    pipe.write_all(now).unwrap();
                    rest = later;
                }
                drop(pipe);
                let ended: Ended = child.wait_with_output().unwrap().into();
                if ended.code == NO_FIX && results("pipe") == expected {
                    Ok(End::Accepted)
                } else {
                    Err(format!("exit {}: {}", ended.code, ended.message))
                }
            },
        );
    }
    tally.finish();
}

#[test]
fn a_file_that_grows_or_shrinks_meanwhile_is_received_as_far_as_it_was_read() {
    let place = recording(0.3);
    let place = place.path();
    let bytes = fs::read(place.join("rec.sigmf-data")).unwrap();
    // A file that is empty when a slow machine opens it is refused, rightly: one sample stays.
    const SAMPLE_BYTES: usize = 2;
    let mut tally = Tally::of_processes(FAMILY, "15. a file that grows or shrinks");
    for number in 0..cases(2, 20) {
        let grows = number % 2 == 0;
        tally.case(
            || format!("{} {number}", if grows { "grows" } else { "shrinks" }),
            || {
                fs::write(place.join("raw.bin"), &bytes[..if grows { bytes.len() / 3 } else { bytes.len() }]).unwrap();
                let mut file = fs::OpenOptions::new().append(true).open(place.join("raw.bin")).unwrap();
                let words =
                    ["receive", "raw.bin", "--out", "now", "--format", "ci8", "--rate-hz", "2.6e6"].map(str::to_owned);
                let mut child = twin(&words, place).stdout(Stdio::null()).stderr(Stdio::piped()).spawn().unwrap();
                let mut at = bytes.len() / 3;
                while child.try_wait().unwrap().is_none() {
                    if grows && at < bytes.len() {
                        let end = (at + 4000).min(bytes.len());
                        file.write_all(&bytes[at..end]).unwrap();
                        at = end;
                    } else if !grows && at > SAMPLE_BYTES {
                        at = at.saturating_sub(40_000).max(SAMPLE_BYTES);
                        file.set_len(at as u64).unwrap();
                    }
                    std::thread::sleep(std::time::Duration::from_millis(1 + number as u64));
                }
                let ended: Ended = child.wait_with_output().unwrap().into();
                if ended.code != NO_FIX {
                    return Err(format!("exit {}: {}", ended.code, ended.message));
                }
                let json: serde_json::Value =
                    serde_json::from_slice(&fs::read(place.join("now/receiver.json")).unwrap()).unwrap();
                let read = json["samples"].as_u64().unwrap() as usize * SAMPLE_BYTES;
                fs::write(place.join("raw.bin"), &bytes[..read]).unwrap();
                let mut words = words.clone();
                words[3] = "then".to_owned();
                let ended: Ended = twin(&words, place).output().unwrap().into();
                if ended.code == NO_FIX && files(&place.join("now")) == files(&place.join("then")) {
                    Ok(End::Accepted)
                } else {
                    Err(format!("{read} bytes read, received again with other results: {}", ended.message))
                }
            },
        );
    }
    tally.finish();
}

#[test]
fn a_reader_that_goes_away_ends_the_program_quietly_and_a_slow_one_gets_everything() {
    let names: &[&'static str] = if long() { &["plan", "generate", "study run"] } else { &["plan"] };
    let bench = Bench::new(names);
    let mut tally = Tally::of_processes(FAMILY, "20. a reader that goes away or is slow");
    for task in &bench.tasks {
        for number in 0..cases(3, 20) {
            let bytes = number * number * 9;
            tally.case(
                || format!("{} | head -c {bytes}", task.name),
                || {
                    let work = task.workplace();
                    let words = task.arguments.join(" ");
                    let script = format!(
                        "{{ '{TWIN}' {words}; echo $? >../$$.status; }} | head -c {bytes} \
                                          >/dev/null; cat ../$$.status; rm ../$$.status"
                    );
                    let output = Command::new("bash").args(["-c", &script]).current_dir(work.path()).output().unwrap();
                    let (status, message) =
                        (String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
                    if !["0", "141"].contains(&status.trim())
                        || message.contains("panicked")
                        || message.contains("error")
                    {
                        return Err(format!("{status}: {message}"));
                    }
                    // What it makes is made before it is told.
                    let printed = task.printed.clone().unwrap_or_default();
                    task.complete(work.path(), &Ended { code: 0, stdout: printed, message: String::new() })?;
                    Ok(End::Accepted)
                },
            );
        }
        tally.case(
            || format!("{}, a slow reader", task.name),
            || {
                let work = task.workplace();
                let mut child =
                    twin(&task.arguments, work.path()).stdout(Stdio::piped()).stderr(Stdio::null()).spawn().unwrap();
                let (mut pipe, mut text, mut some) = (child.stdout.take().unwrap(), Vec::new(), [0; 60]);
                loop {
                    match pipe.read(&mut some).unwrap() {
                        0 => break,
                        count => text.extend_from_slice(&some[..count]),
                    }
                    std::thread::sleep(std::time::Duration::from_millis(2));
                }
                let code = child.wait().unwrap().code().unwrap_or(-1);
                task.complete(work.path(), &Ended { code, stdout: text, message: String::new() })?;
                Ok(End::Accepted)
            },
        );
    }
    tally.finish();
}

#[test]
fn no_command_opens_a_socket_to_a_network() {
    let tried = Command::new("strace").args(["-o", "/dev/null", "true"]).output();
    if !tried.is_ok_and(|output| output.status.success()) {
        println!("no strace, or tracing is not permitted: sockets are not tested");
        return;
    }
    let names: &[&'static str] = if long() {
        &["plan", "generate", "receive", "run", "analyze", "study plan", "study run", "study merge", "study report"]
    } else {
        &["plan", "generate"]
    };
    let bench = Bench::new(names);
    let mut tally = Tally::of_processes(FAMILY, "Security. no network");
    for task in &bench.tasks {
        tally.case(
            || task.name.to_owned(),
            || {
                let work = task.workplace();
                let log = tempfile::NamedTempFile::new().unwrap();
                let mut command = Command::new("strace");
                command.args(["-f", "-e", "trace=%network", "-o"]).arg(log.path()).arg(TWIN).args(&task.arguments);
                let ended = task.ended(command.current_dir(work.path()).output().unwrap());
                let trace = fs::read_to_string(log.path()).unwrap();
                if ended.code != 0 || !trace.contains("AF_UNIX") {
                    return Err(format!("exit {}: {}{trace}", ended.code, ended.message));
                }
                match trace.lines().find(|line| line.contains("AF_INET") || line.contains("connect(")) {
                    Some(line) => Err(line.to_owned()),
                    None => Ok(End::Accepted),
                }
            },
        );
    }
    tally.finish();
}
