//! `rtcm`: the stream of a truth as a file, by TCP and from a caster.

use std::fs;
use std::io::Read;
use std::net::TcpStream;
use std::path::Path;

use serde_json::Value;

use crate::command::{code, stderr, twin};
use crate::ports::Server;

/// A directory with the truth of a second, `tiny.truth`.
fn workplace() -> tempfile::TempDir {
    let directory = tempfile::tempdir().unwrap();
    let scene = "name = \"tiny\"\nstart = 2010-07-01T08:05:58\nduration_s = 1\nseed = 1\n[motion]\nkind = \"static\"\n\
                 latitude_deg = 26.5\nlongitude_deg = 80.2\nheight_m = 130\n[front_end]\nsample_rate_hz = 2.6e6\n\
                 format = \"ci8\"\n[power]\ncn0_dbhz = 45\n[noise]\n";
    fs::write(directory.path().join("tiny.toml"), scene).unwrap();
    let made = twin(&["generate", "tiny.toml", "--out", "tiny.sigmf-data", "--quiet"], directory.path());
    assert!(made.status.success(), "{}", stderr(&made));
    directory
}

/// Object that a command prints.
fn object(arguments: &[&str], directory: &Path) -> Value {
    let output = twin(&[arguments, &["--json"]].concat(), directory);
    assert!(output.status.success(), "{}", stderr(&output));
    serde_json::from_slice(&output.stdout).unwrap()
}

const SOURCE: [&str; 4] = ["rtcm", "tiny.truth", "--position", "26.5,80.2,130"];

#[test]
fn the_stream_of_a_truth_is_read_whole() {
    let directory = workplace();
    let here = directory.path();
    let told = object(&[&SOURCE[..], &["--out", "base.rtcm3"]].concat(), here);
    let read = object(&["logs", "base.rtcm3", "--near", "2010-07-01T08:00:00Z"], here);
    assert_eq!((&read["skipped_bytes"], &read["undated"]), (&0.into(), &0.into()));
    for message in read["messages"].as_array().unwrap() {
        let number = message["message"].as_str().unwrap().split(' ').next().unwrap();
        assert_eq!((&message["read"], &message["count"]), (&told["messages"][number], &told["messages"][number]));
    }
    assert!(told["messages"]["1077"] == told["epochs"] && told["messages"]["1006"] == 1, "{told}");
    assert_eq!(told["left_out"], serde_json::json!({}));
}

#[test]
fn clients_get_the_bytes_of_the_file() {
    let directory = workplace();
    let here = directory.path();
    object(&[&SOURCE[..], &["--out", "base.rtcm3"]].concat(), here);
    let file = fs::read(here.join("base.rtcm3")).unwrap();
    let source = SOURCE.join(" ");
    let server = Server::start(&format!("{source} --serve tcp:0 --speed 10"), here);
    let mut bytes = Vec::new();
    TcpStream::connect(server.address).unwrap().read_to_end(&mut bytes).unwrap();
    assert!(bytes == file, "{} of {} bytes", bytes.len(), file.len());
    assert_eq!(server.end().0, 0);
    let caster = Server::start(&format!("{source} --caster 0/TWIN --user a:b --speed 10"), here);
    let address = format!("{}/TWIN", caster.address);
    let refused = twin(&["logs", &format!("ntrip://{address}")], here);
    assert!(code(&refused) == 65 && stderr(&refused).contains("401"), "{}", stderr(&refused));
    let near = ["--near", "2010-07-01T08:00:00Z"];
    let read = object(&[&["logs", &format!("ntrip://a:b@{address}")][..], &near].concat(), here);
    assert_eq!(read, object(&[&["logs", "base.rtcm3"][..], &near].concat(), here));
    assert_eq!(caster.end().0, 0);
}

#[test]
fn what_is_no_run_and_what_asks_for_nothing_is_refused_by_name() {
    let directory = workplace();
    let here = directory.path();
    for (arguments, exit, word) in [
        (&["rtcm", "tiny.truth"][..], 2, "--out"),
        (&["rtcm", "none", "--out", "x"], 65, "none"),
        (&["rtcm", ".", "--out", "x"], 65, "observations.csv"),
        (&["rtcm", "tiny.toml", "--out", "x"], 65, "tiny.toml:1"),
        (&["rtcm", "tiny.truth", "--out", "x", "--messages", "1004"], 2, "expected msm4"),
        (&["rtcm", "tiny.truth", "--out", "x", "--position", "1,2,x"], 2, "expected LATITUDE"),
        (&["rtcm", "tiny.truth", "--caster", "0/"], 2, "PORT/MOUNT"),
        (&["rtcm", "tiny.truth", "--caster", "0/M", "--user", "a"], 2, "NAME:PASSWORD"),
    ] {
        let output = twin(arguments, here);
        assert!(code(&output) == exit && stderr(&output).contains(word), "{arguments:?}: {}", stderr(&output));
        assert!(!here.join("x").exists());
    }
}
