//! Samples to and from other programs: standard output, FIFOs, TCP and rtl_tcp, with readers that leave.

use std::collections::BTreeMap;
use std::fs::{self, File};
use std::io::{BufRead, BufReader, Read, Write};
use std::net::{SocketAddr, TcpListener, TcpStream};
use std::path::Path;
use std::process::{Child, Command, Output, Stdio};
use std::thread;

use crate::command::TWIN;

/// A directory with a scene of that length.
fn workplace(duration_s: f64) -> tempfile::TempDir {
    let directory = tempfile::tempdir().unwrap();
    let scene = format!(
        "name = \"tiny\"\nstart = 2010-07-01T08:05:58\nduration_s = {duration_s}\nseed = 1\n[motion]\nkind \
         = \"static\"\n\
         latitude_deg = 26.5\nlongitude_deg = 80.2\nheight_m = 130\n[front_end]\nsample_rate_hz = 2.6e6\nformat \
         = \"ci8\"\n\
         [power]\ncn0_dbhz = 45\n[noise]\n"
    );
    fs::write(directory.path().join("tiny.toml"), scene).unwrap();
    directory
}

fn twin(arguments: &str, directory: &Path) -> Command {
    let mut command = Command::new(TWIN);
    command.args(arguments.split(' ')).current_dir(directory).stdin(Stdio::null());
    command
}

fn ended(arguments: &str, directory: &Path) -> Output {
    twin(arguments, directory).output().unwrap()
}

fn message(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

fn names(directory: &Path) -> Vec<String> {
    let mut names: Vec<String> =
        fs::read_dir(directory).unwrap().map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    names
}

/// The samples that `generate` writes into a file, in that format.
fn samples(directory: &Path, format: &str) -> Vec<u8> {
    let output = ended(&format!("generate tiny.toml --out plain.sigmf-data --format {format}"), directory);
    assert!(output.status.success(), "{}", message(&output));
    fs::read(directory.join("plain.sigmf-data")).unwrap()
}

fn fifo(path: &Path) {
    assert!(Command::new("mkfifo").arg(path).status().unwrap().success());
}

/// A program that listens, and the address at which it does.
pub struct Server {
    child: Child,
    pub address: SocketAddr,
    stderr: BufReader<std::process::ChildStderr>,
}

impl Server {
    pub fn start(arguments: &str, directory: &Path) -> Self {
        let mut child = twin(arguments, directory).stdout(Stdio::null()).stderr(Stdio::piped()).spawn().unwrap();
        let mut stderr = BufReader::new(child.stderr.take().unwrap());
        let mut line = String::new();
        let address = loop {
            line.clear();
            assert!(stderr.read_line(&mut line).unwrap() > 0, "ended before it listened");
            if let Some((_, address)) = line.trim().split_once("listening on ") {
                break address.parse().unwrap();
            }
        };
        Self { child, address, stderr }
    }

    /// Waits for its end: the exit code, and what it said since it listened.
    pub fn end(mut self) -> (i32, String) {
        let mut text = String::new();
        self.stderr.read_to_string(&mut text).unwrap();
        (self.child.wait().unwrap().code().unwrap_or(-1), text)
    }
}

#[test]
fn samples_on_standard_output_are_those_of_the_file_and_nothing_else() {
    let place = workplace(0.05);
    let here = place.path();
    let plain = samples(here, "ci16");
    let before = names(here);
    let output = ended("generate tiny.toml --out - --format ci16", here);
    assert!(output.status.success() && output.stdout == plain, "{}", message(&output));
    let said = message(&output);
    assert!(said.contains("ci16") && said.contains("2600000") && said.contains("satellites"), "{said}");
    assert_eq!(names(here), before, "no file was asked for");
    let output = ended("generate tiny.toml --out - --format ci16 --seek 1000 --samples 500 --truth true", here);
    assert_eq!(output.stdout, plain[4000..6000]);
    assert!(here.join("true/observations.csv").is_file() && !here.join("-").exists());
    let output = ended("generate tiny.toml --out x.sigmf-data --truth y", here);
    assert_eq!(output.status.code(), Some(2), "{}", message(&output));
}

#[test]
fn a_fifo_gives_its_reader_every_sample_and_ends_the_program_quietly_where_the_reader_leaves() {
    let place = workplace(0.2);
    let here = place.path();
    let plain = samples(here, "ci8");
    fifo(&here.join("if"));
    let child = twin("generate tiny.toml --out fifo:if", here).stderr(Stdio::null()).spawn().unwrap();
    assert_eq!(fs::read(here.join("if")).unwrap(), plain);
    assert!(child.wait_with_output().unwrap().status.success());

    let child = twin("generate tiny.toml --out fifo:if --truth true", here).stderr(Stdio::piped()).spawn().unwrap();
    let mut some = [0; 999];
    File::open(here.join("if")).unwrap().read_exact(&mut some).unwrap();
    let output = child.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(141));
    assert!(!message(&output).contains("error") && !here.join("true").exists(), "{}", message(&output));

    for (out, part) in [("fifo:absent", "mkfifo absent"), ("fifo:tiny.toml", "no FIFO"), ("tcp:here:1", "PORT")] {
        let output = ended(&format!("generate tiny.toml --out {out}"), here);
        assert!(matches!(output.status.code(), Some(73 | 2)), "{out}: {}", message(&output));
        assert!(message(&output).contains(part), "{out}: {}", message(&output));
    }
}

#[test]
fn a_tcp_client_gets_the_bytes_and_nothing_else() {
    let place = workplace(0.2);
    let here = place.path();
    let plain = samples(here, "ci8");
    let server = Server::start("generate tiny.toml --out tcp:0", here);
    assert!(server.address.ip().is_loopback());
    let taken = ended(&format!("generate tiny.toml --out tcp:{}", server.address.port()), here);
    assert_eq!(taken.status.code(), Some(73));
    assert!(message(&taken).contains("another port"), "{}", message(&taken));

    let mut client = TcpStream::connect(server.address).unwrap();
    // What nobody asked for does not cost the stream its end.
    client.write_all(b"GET / HTTP/1.0\r\n\r\n").unwrap();
    // One stream has one pace: who comes second is sent away and named, and costs the first nothing.
    let mut second = TcpStream::connect(server.address).unwrap();
    assert_eq!(second.read(&mut [0; 10]).unwrap_or(0), 0);
    let mut bytes = Vec::new();
    client.read_to_end(&mut bytes).unwrap();
    assert!(bytes == plain, "{} bytes for {}", bytes.len(), plain.len());
    drop(client);
    let (code, said) = server.end();
    let name = second.local_addr().unwrap();
    assert!(code == 0 && said.contains(&format!("client {name} is sent away")), "{code}: {said}");

    let server = Server::start("generate tiny.toml --out tcp:0 --format cf32", here);
    TcpStream::connect(server.address).unwrap().read_exact(&mut [0; 1000]).unwrap();
    let (code, said) = server.end();
    assert_eq!(code, 74, "{said}");
    assert_eq!(said.matches("error").count(), 1, "{said}");
    assert!(said.contains("left after"), "{said}");
}

#[test]
fn a_client_of_rtl_tcp_gets_header_and_samples_and_cannot_move_the_scene() {
    let place = workplace(0.2);
    let here = place.path();
    let plain = samples(here, "cu8");
    let server = Server::start("generate tiny.toml --out rtl-tcp:0", here);
    let mut client = TcpStream::connect(server.address).unwrap();
    let mut header = [0; 12];
    client.read_exact(&mut header).unwrap();
    assert_eq!(header[..8], *b"RTL0\0\0\0\x05");
    let command = |number: u8, value: u32| [&[number][..], &value.to_be_bytes()].concat();
    let commands =
        [command(2, 2_600_000), command(1, 1_575_420_000), command(4, 300), command(2, 2_048_000), command(1, 100)];
    // Cut where they happen to be.
    let mut writer = client.try_clone().unwrap();
    let all = commands.concat();
    let sent = thread::spawn(move || all.chunks(7).for_each(|some| writer.write_all(some).unwrap()));
    let mut bytes = Vec::new();
    client.read_to_end(&mut bytes).unwrap();
    sent.join().unwrap();
    assert!(bytes.iter().zip(&plain).all(|(got, made)| *got == (*made).min(254)));
    assert_eq!(bytes.len(), plain.len());
    drop(client);
    let (code, said) = server.end();
    assert_eq!(code, 0, "{said}");
    assert_eq!(said.matches("warning").count(), 2, "{said}");
    assert!(said.contains("2048000 Hz") && said.contains("frequency of 100 Hz"), "{said}");

    let output = ended("generate tiny.toml --out rtl-tcp:0 --format ci16", here);
    assert_eq!(output.status.code(), Some(2));
    assert!(message(&output).contains("--format cu8"), "{}", message(&output));
}

/// The exit code of a reception without a fix.
const NO_FIX: Option<i32> = Some(3);

/// The tables of a reception, but for its summary, which knows where the samples came from.
fn tables(directory: &Path) -> BTreeMap<String, Vec<u8>> {
    let one = |name: String| (name.ends_with(".csv")).then(|| (name.clone(), fs::read(directory.join(name)).unwrap()));
    names(directory).into_iter().filter_map(one).collect()
}

/// Sends all bytes in pieces of odd lengths.
fn in_pieces(mut to: impl Write, bytes: &[u8]) {
    let mut rest = bytes;
    for length in [1, 3, 5000, 77_777, 2, 131_073].into_iter().cycle() {
        let (now, later) = rest.split_at(length.min(rest.len()));
        if to.write_all(now).is_err() || later.is_empty() {
            return;
        }
        rest = later;
    }
}

#[test]
fn samples_from_a_fifo_a_server_or_a_dongle_are_received_as_those_of_a_file() {
    let place = workplace(0.1);
    let here = place.path();
    let mut plain = samples(here, "cu8");
    // A sample cut off at the end.
    plain.push(1);
    fs::write(here.join("raw.bin"), &plain).unwrap();
    let flags = "--rate-hz 2.6e6 --format cu8";
    assert_eq!(ended(&format!("receive raw.bin --out file {flags}"), here).status.code(), NO_FIX);
    let expected = tables(&here.join("file"));
    assert!(expected["acquisition.csv"].len() > 1000);

    fifo(&here.join("if"));
    let child = twin(&format!("receive fifo:if --out fifo {flags} --live"), here)
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    in_pieces(File::options().write(true).open(here.join("if")).unwrap(), &plain);
    let output = child.wait_with_output().unwrap();
    assert_eq!(output.status.code(), NO_FIX, "{}", message(&output));
    assert!(String::from_utf8_lossy(&output.stdout).contains("(1 bytes of a cut sample left out)"));
    assert!(tables(&here.join("fifo")) == expected && !here.join("fifo.unfinished").exists());

    let server = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = server.local_addr().unwrap();
    thread::scope(|scope| {
        scope.spawn(|| in_pieces(server.accept().unwrap().0, &plain));
        let output = ended(&format!("receive tcp:{address} --out tcp {flags}"), here);
        assert_eq!(output.status.code(), NO_FIX, "{}", message(&output));
    });
    assert!(tables(&here.join("tcp")) == expected);

    let dongle = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = dongle.local_addr().unwrap();
    thread::scope(|scope| {
        let served = scope.spawn(|| {
            let (mut client, _) = dongle.accept().unwrap();
            client.write_all(b"RTL0\0\0\0\x05\0\0\0\x1d").unwrap();
            let mut commands = [0; 10];
            client.read_exact(&mut commands).unwrap();
            in_pieces(client, &plain);
            commands
        });
        let output = ended(&format!("receive rtl-tcp:{} --out rtl --rate-hz 2.6e6", address.port()), here);
        assert_eq!(output.status.code(), NO_FIX, "{}", message(&output));
        let [rate, frequency] = [2_600_000_u32, 1_575_420_000].map(u32::to_be_bytes);
        assert_eq!(served.join().unwrap()[..], [&[2][..], &rate, &[1], &frequency].concat());
    });
    assert!(tables(&here.join("rtl")) == expected);
}

#[test]
fn a_sender_that_is_absent_of_another_kind_or_breaks_off_is_named_in_one_message() {
    let place = workplace(0.1);
    let here = place.path();
    let plain = samples(here, "cu8");
    let server = TcpListener::bind("127.0.0.1:0").unwrap();
    let port = server.local_addr().unwrap().port();
    let refused = |arguments: &str, code: i32, part: &str| {
        let output = ended(arguments, here);
        let said = message(&output);
        assert_eq!(output.status.code(), Some(code), "{arguments}: {said}");
        assert!(said.contains(part) && said.matches("error: ").count() == 1, "{arguments}: {said}");
    };
    refused("receive fifo:absent --rate-hz 1e6 --format ci8 --out x", 65, "absent");
    refused("receive fifo:tiny.toml --rate-hz 1e6 --format ci8 --out x", 65, "no FIFO");
    refused("receive rtl-tcp:1 --rate-hz 2600000.5 --out x", 2, "whole hertz");
    refused("receive rtl-tcp:1 --rate-hz 2.6e6 --format ci8 --out x", 2, "cu8");
    refused("receive rtl-tcp:1 --out x", 2, "--rate-hz");
    thread::scope(|scope| {
        scope.spawn(|| server.accept().unwrap().0.write_all(&[7; 100]).unwrap());
        refused(&format!("receive rtl-tcp:{port} --rate-hz 2.6e6 --out x"), 65, "RTL0");
    });
    assert!(!here.join("x").exists());
    // Closed over commands that nobody read: the system breaks the connection.
    thread::scope(|scope| {
        scope.spawn(|| {
            let (mut client, _) = server.accept().unwrap();
            client.write_all(b"RTL0\0\0\0\x05\0\0\0\x1d").unwrap();
            client.write_all(&plain[..100_000]).unwrap();
            client.peek(&mut [0]).unwrap();
        });
        refused(&format!("receive rtl-tcp:{port} --rate-hz 2.6e6 --out kept"), 74, "broke off after");
    });
    assert!(here.join("kept/receiver.json").is_file(), "what came before counts");
    drop(server);
    refused(&format!("receive tcp:{port} --rate-hz 1e6 --format ci8 --out x"), 75, "is the sender listening");
    refused("receive tiny.toml --rate-hz 1e6 --format ci8 --out x --nmea - --json -", 2, "one of them");
}

#[test]
fn a_live_reception_is_read_while_it_runs_and_finished_by_an_interrupt() {
    let place = workplace(3000.0);
    let here = place.path();
    let server = Server::start("generate tiny.toml --out rtl-tcp:0", here);
    let arguments = format!(
        "receive rtl-tcp:{} --rate-hz 2.6e6 --start 2010-07-01T08:05:58 --out now --live --json - --nmea now.nmea",
        server.address.port()
    );
    let mut child = twin(&arguments, here).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    let mut lines = BufReader::new(child.stdout.take().unwrap()).lines();
    let mut kinds = BTreeMap::<String, u32>::new();
    while kinds.get("fix").is_none_or(|count| *count < 5) {
        let row: serde_json::Value = serde_json::from_str(&lines.next().unwrap().unwrap()).unwrap();
        *kinds.entry(row["record"].as_str().unwrap().to_owned()).or_default() += 1;
        if row["record"] == "fix" {
            let miss = [("latitude_deg", 26.5, 1e-4), ("longitude_deg", 80.2, 1e-4), ("height_m", 130.0, 30.0)];
            for (key, value, bar) in miss {
                assert!((row[key].as_f64().unwrap() - value).abs() < bar, "{row}");
            }
            assert!(row["utc"].as_str().unwrap().starts_with("2010-07-01T08:0"), "{row}");
        }
    }
    assert!(["channel", "event", "search", "satellites"].iter().all(|kind| kinds.contains_key(*kind)), "{kinds:?}");
    // Four fixes were whole when the fifth was said, tables and sentences alike.
    let fixes = fs::read_to_string(here.join("now.unfinished/fixes.csv")).unwrap();
    assert!(fixes.lines().count() > 4 && fixes.ends_with('\n'), "{fixes}");
    assert!(fs::read_to_string(here.join("now.nmea.unfinished")).unwrap().matches("GGA").count() >= 4);
    assert!(!here.join("now").exists() && !here.join("now.nmea").exists());

    assert!(Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap().success());
    let rest: Vec<String> = lines.map(Result::unwrap).collect();
    let output = child.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(130), "{}", message(&output));
    assert!(rest.last().unwrap().starts_with("{\"record\":\"summary\""), "{:?}", rest.last());
    assert!(message(&output).contains("results in now") && here.join("now/receiver.json").is_file());
    let unfinished: Vec<String> = names(here).into_iter().filter(|name| name.contains("unfinished")).collect();
    assert!(unfinished.is_empty(), "{unfinished:?}");
    let text = fs::read_to_string(here.join("now.nmea")).unwrap();
    for sentence in text.lines() {
        let (body, sum) = sentence.strip_prefix('$').unwrap().split_once('*').unwrap();
        assert_eq!(format!("{:02X}", body.bytes().fold(0, |sum, byte| sum ^ byte)), sum, "{sentence}");
    }
    let rows = fs::read_to_string(here.join("now/fixes.csv")).unwrap().lines().count() - 1;
    for kind in ["GGA", "RMC", "VTG", "ZDA"] {
        assert_eq!(text.lines().filter(|line| line.get(3..6) == Some(kind)).count(), rows, "{kind}");
    }
    assert!(text.contains("$GPGSA,A,3,") && text.contains("$GPGSV,"), "{text}");
    let (code, said) = server.end();
    assert!(code == 74 && said.contains("left after"), "{code}: {said}");
}
