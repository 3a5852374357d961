//! Clients that come back, and clients for whom there is no file descriptor.

use std::fs;
use std::io::{Read, Write};
use std::net::TcpStream;
use std::path::PathBuf;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use super::program::{Bench, SCENE, listener, summary};

/// A client, and the first bytes that it is sent.
fn take(address: &str, count: usize) -> (TcpStream, Vec<u8>) {
    let mut client = TcpStream::connect(address).unwrap();
    let mut bytes = vec![0; count];
    client.read_exact(&mut bytes).unwrap();
    (client, bytes)
}

#[test]
fn a_receiver_that_reconnects_goes_on_with_the_same_run() {
    let bench = Bench::new();
    fs::write(bench.path("scene.toml"), SCENE.replace("1.2", "3")).unwrap();
    for clock in ["sink", "host"] {
        let mut child = bench.start(&["--clock", clock, "--to", "tcp:0", "--record", clock]);
        let (address, said) = listener(&mut child, "listening on ");
        let (client, first) = take(&address, 520_000);
        drop(client);
        let (mut client, mut rest) = take(&address, 52_000);
        client.read_to_end(&mut rest).unwrap();
        drop(client);
        let said = said.join().unwrap();
        assert!(child.wait().unwrap().success(), "{said}");
        let made = summary(&bench.path(clock));
        assert_eq!((&made["ended_by"], &made["clients_left"]), (&"scene".into(), &1.into()), "{made}");
        // The record has all of it; each client has a part without gaps, the second to the end.
        let all = bench.replayed(clock);
        assert_eq!(all.len(), 2 * 7_800_000);
        assert!(all.starts_with(&first) && all.ends_with(&rest), "{clock}");
        assert!(said.contains("left after"), "{said}");
        let lost = made["lost_blocks"].as_u64().unwrap();
        assert!(if clock == "sink" { lost == 1 } else { lost < 300 }, "{made}");
    }
    // Where nobody is to come back, the run ends with the client.
    let mut child = bench.start(&["--to", "tcp:0", "--reconnect", "0"]);
    let (address, said) = listener(&mut child, "listening on ");
    drop(TcpStream::connect(address).unwrap());
    assert_eq!(child.wait().unwrap().code(), Some(74), "{}", said.join().unwrap());
}

#[test]
fn a_receiver_of_a_further_sink_finds_its_place_again_and_the_first_sink_misses_nothing() {
    let bench = Bench::new();
    fs::write(bench.path("scene.toml"), SCENE.replace("1.2", "3")).unwrap();
    let mut child = bench.start(&["--clock", "host", "--to", "file:first.ci8", "--to", "tcp:0", "--record", "flight"]);
    let (address, said) = listener(&mut child, "listening on ");
    let (client, begun) = take(&address, 520_000);
    drop(client);
    let (mut client, mut rest) = take(&address, 52_000);
    client.read_to_end(&mut rest).unwrap();
    let said = said.join().unwrap();
    assert!(child.wait().unwrap().success(), "{said}");
    assert!(said.contains("left after") && said.contains("samples are lost"), "{said}");
    let all = fs::read(bench.path("first.ci8")).unwrap();
    assert_eq!(all.len(), 2 * 7_800_000);
    assert!(bench.replayed("flight") == all, "the first sink misses samples");
    // A client that the machine keeps from reading loses more, and still gets the rest in its order.
    assert!(all.starts_with(&begun) && is_in_order(&rest, &all[begun.len()..]) && rest.len() < all.len() - begun.len());
}

/// True if bytes are parts of a whole in the order of the whole, each of 64 bytes at least.
fn is_in_order(mut parts: &[u8], mut whole: &[u8]) -> bool {
    while !parts.is_empty() {
        let key = &parts[..parts.len().min(64)];
        let Some(at) = whole.windows(key.len()).position(|window| window == key) else { return false };
        let same = parts.iter().zip(&whole[at..]).take_while(|(own, other)| own == other).count();
        (parts, whole) = (&parts[same..], &whole[at + same..]);
    }
    true
}

/// A live run that may have so many files open.
fn with_files(bench: &Bench, count: u32, arguments: &str) -> Child {
    fs::write(bench.path("scene.toml"), SCENE.replace("1.2", "3600")).unwrap();
    let run = format!(
        "ulimit -n {count}; exec {} live scene.toml --clock host --record run {arguments}",
        env!("CARGO_BIN_EXE_gnss-twin")
    );
    let mut command = Command::new("bash");
    command.current_dir(bench.directory.path()).args(["-c", &run]);
    command.stdout(Stdio::null()).stderr(Stdio::piped()).spawn().unwrap()
}

/// Processor time of a child's thread so far, in hundredths of a second.
fn used(child: &Child, thread: &str) -> u64 {
    let tasks = fs::read_dir(format!("/proc/{}/task", child.id())).unwrap().map(|task| task.unwrap().path());
    let listens = |task: &PathBuf| fs::read_to_string(task.join("comm")).is_ok_and(|name| name.trim() == thread);
    let task = tasks.into_iter().find(listens).unwrap();
    let about = fs::read_to_string(task.join("stat")).unwrap();
    // User and system time are words 14 and 15, and the name is the second; 100 a second.
    let times = about.rsplit(')').next().unwrap().split_whitespace().skip(11).take(2);
    times.map(|time| time.parse::<u64>().unwrap()).sum()
}

/// Waits until all files of a run are open.
fn wait_for_record(bench: &Bench) {
    while !bench.path("run.unfinished/replay.toml").is_file() {
        std::thread::sleep(Duration::from_millis(5));
    }
}

fn interrupt(child: &mut Child) {
    let id = child.id().to_string();
    assert!(Command::new("kill").args(["-s", "INT", &id]).status().unwrap().success());
    child.wait().unwrap();
}

#[test]
fn without_free_descriptors_a_listener_rests_and_then_takes_the_rig() {
    let bench = Bench::new();
    // 16 clients are kept at one time, and the program has some 10 files of its own.
    let mut child = with_files(&bench, 24, "--motion tcp:0");
    let (address, said) = listener(&mut child, "listening on ");
    wait_for_record(&bench);
    let silent: Vec<TcpStream> = (0..20).map(|_| TcpStream::connect(&address).unwrap()).collect();
    std::thread::sleep(Duration::from_secs(1));
    // The thread that listens: a try each 0.1 s, where one without a pause would have used all of a second.
    let used = used(&child, "motion");
    assert!(used < 30, "{used}");
    drop(silent);
    let mut rig = TcpStream::connect(&address).unwrap();
    std::thread::sleep(Duration::from_millis(500));
    rig.write_all(b"jammer 1 off\n").unwrap();
    std::thread::sleep(Duration::from_millis(500));
    interrupt(&mut child);
    let said = said.join().unwrap();
    assert!(said.contains("cannot take a client"), "{said}");
    assert_eq!(summary(&bench.path("run"))["events"]["applied"], 1, "{said}");
}

#[test]
fn without_free_descriptors_the_page_rests_and_is_then_served() {
    let bench = Bench::new();
    let mut child = with_files(&bench, 24, "--web 0");
    let (url, said) = listener(&mut child, "page: http://");
    let (host, token) = url.split_once("/?token=").unwrap();
    wait_for_record(&bench);
    let before = used(&child, "page");
    let half_open: Vec<TcpStream> = (0..40).map(|_| TcpStream::connect(host).unwrap()).collect();
    std::thread::sleep(Duration::from_secs(1));
    let used = used(&child, "page") - before;
    assert!(used < 30, "{used}");
    drop(half_open);
    let begun = Instant::now();
    let is_served = || {
        let mut stream = TcpStream::connect(host).unwrap();
        stream.set_read_timeout(Some(Duration::from_secs(5))).unwrap();
        let mut answer = Vec::new();
        let ask = format!("GET /?token={token} HTTP/1.1\r\nHost: {host}\r\n\r\n");
        let _ = stream.write_all(ask.as_bytes()).and_then(|()| stream.read_to_end(&mut answer));
        answer.starts_with(b"HTTP/1.1 200")
    };
    while !is_served() {
        assert!(begun.elapsed() < Duration::from_secs(10), "the page is not served once descriptors are free");
        std::thread::sleep(Duration::from_millis(100));
    }
    interrupt(&mut child);
    let said = said.join().unwrap();
    assert!(said.contains("page: cannot take a client"), "{said}");
}
