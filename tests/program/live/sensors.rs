//! Rows of inertial sensors as datagrams.

use std::fs;
use std::net::UdpSocket;
use std::process::Command;
use std::time::Duration;

use super::program::{Bench, errors};

const SENSORS: &str = r#"
name = "sensors"
start = 2010-07-01T08:06:00
duration_s = 0.6
noise = {}
truth = { interval_s = 0.2 }
motion = { kind = "static", latitude_deg = 48.1, longitude_deg = 11.6, height_m = 520 }
attitude = { kind = "fixed", yaw_deg = 20 }
imu = { rate_hz = 100, grade = "mid" }
"#;

#[test]
fn datagrams_have_the_rows_of_the_table() {
    let bench = Bench::new();
    fs::write(bench.path("scene.toml"), SENSORS).unwrap();
    let socket = UdpSocket::bind("127.0.0.1:0").unwrap();
    socket.set_read_timeout(Some(Duration::from_secs(20))).unwrap();
    let to = format!("udp:{}", socket.local_addr().unwrap());
    let child = bench.start(&["--clock", "free", "--imu", &to]);
    let done = child.wait_with_output().unwrap();
    assert!(done.status.success(), "{}", errors(&done));
    assert!(errors(&done).contains(r#""imu":{"rows":60,"lost":0}"#), "{}", errors(&done));
    let made = Command::new(env!("CARGO_BIN_EXE_gnss-twin"))
        .current_dir(bench.directory.path())
        .args(["generate", "scene.toml", "--out", "made"])
        .output()
        .unwrap();
    assert!(made.status.success(), "{}", errors(&made));
    let table = fs::read_to_string(bench.path("made.truth/imu.csv")).unwrap();
    assert_eq!(table.lines().count(), 61);
    let mut datagram = [0; 512];
    for line in table.lines().skip(1) {
        let length = socket.recv(&mut datagram).unwrap();
        assert_eq!(std::str::from_utf8(&datagram[..length]).unwrap(), format!("{line}\n"));
    }
}

#[test]
fn a_scene_without_sensors_and_an_address_that_is_none_are_refused() {
    let bench = Bench::new();
    for (to, expected) in [("udp:4000", "expected a scene with [imu]"), ("4000", "expected udp:PORT")] {
        let done = bench.start(&["--clock", "free", "--imu", to]).wait_with_output().unwrap();
        assert_eq!(done.status.code(), Some(2), "{}", errors(&done));
        assert!(errors(&done).contains(expected), "{}", errors(&done));
    }
}
