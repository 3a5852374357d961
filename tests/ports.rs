//! Samples to and from other programs: standard output, FIFOs, TCP and rtl_tcp, with readers that leave.

use std::fs::{self, File};
use std::io::{BufRead, BufReader, Read, Write};
use std::net::{SocketAddr, TcpStream};
use std::path::Path;
use std::process::{Child, Command, Output, Stdio};
use std::thread;

const TWIN: &str = env!("CARGO_BIN_EXE_gnss-twin");

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
struct Server {
    child: Child,
    address: SocketAddr,
    stderr: BufReader<std::process::ChildStderr>,
}

impl Server {
    fn start(arguments: &str, directory: &Path) -> Self {
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
    fn end(mut self) -> (i32, String) {
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
    assert!(said.contains("ci16_le") && said.contains("2600000") && said.contains("satellites"), "{said}");
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
    let mut bytes = Vec::new();
    client.read_to_end(&mut bytes).unwrap();
    assert!(bytes == plain, "{} bytes for {}", bytes.len(), plain.len());
    drop(client);
    assert_eq!(server.end().0, 0);

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
