//! The page of a live run and of `watch`, by raw sockets: who is let in, what is counted, and what it costs.

use std::fs;
use std::io::{BufRead, BufReader, Read, Write};
use std::net::{TcpListener, TcpStream};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::thread;
use std::time::{Duration, Instant};

use serde_json::Value;

const SCENE: &str = r#"
name = "page"
start = 2010-07-01T08:06:00
duration_s = 6
noise = {}
truth = { interval_s = 0.1 }
motion = { kind = "pushed", latitude_deg = 48.1, longitude_deg = 11.6, height_m = 520 }
[[interference]]
kind = "cw"
js_db = 3
"#;

/// A program that serves a page.
struct Served {
    child: Child,
    host: String,
    token: String,
    errors: thread::JoinHandle<String>,
}

impl Served {
    fn start(directory: &Path, arguments: &[&str]) -> Self {
        let mut child = Command::new(env!("CARGO_BIN_EXE_gnss-twin"))
            .current_dir(directory)
            .args(arguments)
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        let mut errors = BufReader::new(child.stderr.take().unwrap());
        let (mut line, mut said) = (String::new(), String::new());
        let (host, token) = loop {
            line.clear();
            assert_ne!(errors.read_line(&mut line).unwrap(), 0, "no page: {said}");
            if let Some((_, url)) = line.trim().split_once("page: http://") {
                let (host, token) = url.split_once("/?token=").unwrap();
                break (host.to_owned(), token.to_owned());
            }
            said += &line;
        };
        let errors = thread::spawn(move || {
            let mut rest = String::new();
            errors.read_to_string(&mut rest).unwrap();
            rest
        });
        Self { child, host, token, errors }
    }

    fn connect(&self) -> TcpStream {
        let stream = TcpStream::connect(&self.host).unwrap();
        stream.set_read_timeout(Some(Duration::from_secs(20))).unwrap();
        stream
    }

    /// The answer to a request of one line, with its token and more head lines.
    fn ask(&self, method: &str, path: &str, token: &str, lines: &str, body: &str) -> String {
        let host = if lines.contains("Host:") { String::new() } else { format!("Host: {}\r\n", self.host) };
        let length = body.len();
        let head = format!("{method} {path}?token={token} HTTP/1.1\r\n{host}{lines}Content-Length: {length}\r\n\r\n");
        let mut stream = self.connect();
        stream.write_all((head + body).as_bytes()).unwrap();
        let mut answer = String::new();
        stream.read_to_string(&mut answer).unwrap();
        answer
    }

    /// Frames of the stream.
    fn frames(&self) -> impl Iterator<Item = Value> + use<> {
        let mut stream = self.connect();
        write!(stream, "GET /stream?token={} HTTP/1.1\r\nHost: {}\r\n\r\n", self.token, self.host).unwrap();
        let lines = BufReader::new(stream).lines().map_while(Result::ok);
        let frames = lines.filter_map(|line| serde_json::from_str(line.strip_prefix("data: ")?).ok());
        // The end has no data.
        frames.filter(|frame: &Value| frame["page"].is_object())
    }

    /// The last line of status, after the end.
    fn summary(self) -> Value {
        let Self { mut child, errors, .. } = self;
        let code = child.wait().unwrap().code();
        let said = errors.join().unwrap();
        assert_eq!(code, Some(0), "{said}");
        let line = said.lines().find(|line| line.starts_with("{\"summary\"")).unwrap();
        serde_json::from_str::<Value>(line).unwrap()["summary"].clone()
    }
}

fn bench() -> tempfile::TempDir {
    let directory = tempfile::tempdir().unwrap();
    fs::write(directory.path().join("scene.toml"), SCENE).unwrap();
    directory
}

const LIVE: [&str; 9] = ["live", "scene.toml", "--clock", "host", "--latency", "1000", "--web", "0", "--record=flight"];

#[test]
fn a_browser_with_the_token_sees_the_run_and_switches_its_sources() {
    let directory = bench();
    let served = Served::start(directory.path(), &LIVE);
    let page = served.ask("GET", "/", &served.token, "", "");
    assert!(page.starts_with("HTTP/1.1 200 OK\r\n"), "{page}");
    let (head, html) = page.split_once("\r\n\r\n").unwrap();
    assert!(head.contains("Content-Security-Policy: default-src 'none'; script-src 'sha256-"), "{head}");
    assert!(head.contains("connect-src 'self'") && !head.to_ascii_lowercase().contains("access-control"), "{head}");
    assert!(html.contains("<title>page</title>") && html.matches("<script").count() == 3);
    let status = |answer: String| answer.split(' ').nth(1).unwrap_or_default().to_owned();
    let token = served.token.clone();
    assert_eq!(status(served.ask("GET", "/", &"0".repeat(32), "", "")), "403");
    assert_eq!(status(served.ask("POST", "/event", "", "", "jammer 1 off")), "403");
    assert_eq!(status(served.ask("GET", "/", &token, "Host: evil.example\r\n", "")), "421");
    assert_eq!(status(served.ask("POST", "/event", &token, "Origin: http://evil.example\r\n", "jammer 1 off")), "421");
    assert_eq!(status(served.ask("GET", "/", &token, &format!("X: {}\r\n", "x".repeat(9000)), "")), "431");
    assert_eq!(status(served.ask("DELETE", "/", &token, "", "")), "405");
    assert_eq!(status(served.ask("GET", "/etc/passwd", &token, "", "")), "404");
    let nonsense = served.ask("POST", "/event", &token, "", "jammer one off");
    assert!(nonsense.contains(" 422 ") && nonsense.contains("expected power SV"), "{nonsense}");
    assert_eq!(status(served.ask("POST", "/event", &token, "", "jammer 9 off")), "202");
    assert_eq!(status(served.ask("POST", "/event", &token, "", "jammer 1 off")), "202");
    let count = |frame: &Value, key: &str| frame[key].as_object().map_or(0, serde_json::Map::len);
    let logged = |frame: &Value| frame["events"].as_array().is_some_and(|events| events.len() == 2);
    let whole = |frame: &Value| logged(frame) && count(frame, "sky") > 0 && frame["spectrum"].is_array();
    let frame = served.frames().find(whole).expect("a frame with both events");
    assert!(frame["events"][0].as_str().unwrap().contains("no such source"), "{}", frame["events"]);
    assert!(count(&frame, "sky") > 4 && count(&frame, "cn0") > 4, "{frame}");
    assert_eq!(frame["spectrum"][1].as_array().unwrap().len(), 256);
    let refused = &frame["page"]["refused"];
    let counts = ["tokens", "hosts", "long", "malformed", "events"].map(|name| refused[name].as_u64().unwrap());
    assert_eq!(counts, [2, 2, 1, 2, 1], "{refused}");
    let last = served.frames().last().unwrap();
    assert_eq!(last["status"]["ended_by"], "scene", "the last frame has the summary");
    let summary = served.summary();
    assert_eq!((&summary["events"]["applied"], &summary["events"]["refused"]), (&1.into(), &1.into()));
    let events = fs::read_to_string(directory.path().join("flight/events.csv")).unwrap();
    assert!(events.lines().nth(1).is_some_and(|row| row.ends_with(",jammer 1 off")), "{events}");
}

#[test]
fn crowds_half_open_sockets_and_browsers_that_do_not_read_cost_the_stream_nothing() {
    let directory = bench();
    let (started, served) = (Instant::now(), Served::start(directory.path(), &LIVE));
    // Browsers that take nothing more, and sockets on which half a request is sent.
    let ask = format!("GET /stream?token={} HTTP/1.1\r\nHost: {}\r\n\r\n", served.token, served.host);
    let mut slow: Vec<TcpStream> = (0..20).map(|_| served.connect()).collect();
    slow.iter_mut().for_each(|stream| stream.write_all(ask.as_bytes()).unwrap());
    let good = served.frames();
    let half_open: Vec<TcpStream> = (0..200)
        .map(|_| {
            let mut stream = served.connect();
            // The server may have closed it.
            let _ = stream.write_all(b"GET / HTTP/1.1\r\nHo");
            stream
        })
        .collect();
    drop(good);
    // Once those are given up, the page is served again.
    let begun = Instant::now();
    let free = || {
        let mut stream = served.connect();
        let mut answer = Vec::new();
        let text = format!("GET /?token={} HTTP/1.1\r\nHost: {}\r\n\r\n", served.token, served.host);
        let _ = stream.write_all(text.as_bytes()).and_then(|()| stream.read_to_end(&mut answer));
        answer.starts_with(b"HTTP/1.1 200")
    };
    while !free() {
        assert!(begun.elapsed() < Duration::from_secs(5), "the page is not served after a crowd");
        thread::sleep(Duration::from_millis(100));
    }
    drop(slow.split_off(10));
    // The places of browsers that left are free with the next frame.
    let frame = loop {
        match served.frames().last() {
            Some(frame) => break frame,
            None => assert!(begun.elapsed() < Duration::from_secs(5), "no place for a browser"),
        }
        thread::sleep(Duration::from_millis(100));
    };
    let refused = &frame["page"]["refused"];
    // 64 connections are served at one time and 16 browsers of these; every other one is refused.
    assert!(refused["crowded"].as_u64().unwrap() >= 136, "{refused}");
    assert!(refused["unfinished"].as_u64().unwrap() >= 20, "{refused}");
    drop((half_open, slow));
    let summary = served.summary();
    // A busy machine has underruns of its own. A run that waited for one browser alone, which takes nothing
    // for 10 s, would last so much longer: 6 s of samples after 1.25 s.
    assert_eq!(summary["stalls"], 0, "{summary}");
    assert!(started.elapsed() < Duration::from_secs(16), "{:?}: {summary}", started.elapsed());
    assert_eq!(summary["samples"].as_u64().or(summary["made"].as_u64()), Some(6 * 2_600_000));
}

#[test]
fn a_page_that_cannot_be_served_is_refused_before_anything_is_written() {
    let directory = bench();
    let taken = TcpListener::bind("127.0.0.1:0").unwrap();
    let port = taken.local_addr().unwrap().port().to_string();
    let run = |arguments: &[&str]| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_gnss-twin"));
        let done = command.current_dir(directory.path()).args(arguments).output().unwrap();
        (done.status.code(), String::from_utf8_lossy(&done.stderr).into_owned())
    };
    let (code, said) = run(&["live", "scene.toml", "--to", "file:sent", "--record", "flight", "--web", &port]);
    assert!(code == Some(73) && said.contains("another program has it"), "{code:?} {said}");
    assert!(!directory.path().join("flight").exists());
    let (code, said) = run(&["watch", ".", "--web", &port]);
    assert!(code == Some(73) && said.contains("another program has it"), "{code:?} {said}");
    let (code, said) = run(&["watch", "nowhere"]);
    assert!(code == Some(65) && said.contains("nowhere: no such directory"), "{code:?} {said}");
    assert_eq!(run(&["watch", "tcp:"]).0, Some(2));
    assert_eq!(run(&["live", "scene.toml", "--web-receiver", "tcp:1"]).0, Some(2));
    assert_eq!(run(&["live", "scene.toml", "--web", "example.org:80"]).0, Some(2));
}

#[test]
fn watch_shows_a_receivers_lines_and_connects_again() {
    let directory = bench();
    let receiver = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = format!("tcp:{}", receiver.local_addr().unwrap());
    let mut served = Served::start(directory.path(), &["watch", &address]);
    for cn0 in [41.5, 42.5] {
        let (mut lines, _) = receiver.accept().unwrap();
        let channel =
            |sv: &str| format!("{{\"record\":\"channel\",\"sv\":\"{sv}\",\"signal\":\"s\",\"cn0_dbhz\":{cn0}}}\n");
        lines.write_all(("nonsense\n".to_owned() + &channel("<img src=x>") + &channel("G07")).as_bytes()).unwrap();
        let seen = |frame: &Value| frame["channels"]["G07 s"][0] == cn0;
        let frame = served.frames().find(seen).unwrap();
        assert!(frame["channels"]["<img src=x> s"].is_array());
        assert!(frame["receiver"].as_str().unwrap().contains("1 lines not understood"), "{}", frame["receiver"]);
    }
    served.child.kill().unwrap();
    served.child.wait().unwrap();
}

#[test]
fn watch_shows_a_record_with_its_truth_and_its_name_is_text() {
    let directory = bench();
    let scene = SCENE.replace("duration_s = 6", "duration_s = 3");
    fs::write(directory.path().join("scene.toml"), scene).unwrap();
    let mut command = Command::new(env!("CARGO_BIN_EXE_gnss-twin"));
    let name = "<script>alert(1)";
    let arguments = ["live", "scene.toml", "--clock", "free", "--to", "file:sent", "--record", name];
    assert!(command.current_dir(directory.path()).args(arguments).output().unwrap().status.success());
    let mut served = Served::start(directory.path(), &["watch", name]);
    let page = served.ask("GET", "/", &served.token, "", "");
    assert!(!page.contains(name) && page.contains("<title>&lt;script&gt;alert(1)</title>"));
    let whole = |frame: &Value| frame["t_s"].as_f64().is_some_and(|t_s| t_s > 2.7);
    let frame = served.frames().find(whole).unwrap();
    assert!(frame["sky"].as_object().unwrap().len() > 4, "{frame}");
    assert_eq!(frame["status"]["ended_by"], "scene");
    served.child.kill().unwrap();
    served.child.wait().unwrap();
}
