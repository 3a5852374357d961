//! Inputs of absurd size, and paths that lead astray.

use std::fs;
use std::io::{Read, Write};
use std::os::unix::fs::symlink;
use std::path::Path;

use flate2::Compression;
use flate2::write::GzEncoder;
use generator::scenario::{Overrides, Scenario};
use generator::vehicle::file::{Options, read_csv, read_nmea};
use gnss::time::Epoch;
use gnss::{ionex, rinex, sp3};

use crate::navigation::{bases, packed};
use crate::tally::{End, Tally, long};

/// Refusals may take this much memory beyond what the process had: the cap on what a packed file may hold,
/// and half of it again while the vector that receives it grows.
const CAP_KIB: u64 = (256 + 128 + 64) << 10;
/// And where nothing is unpacked: 64 MiB.
const PLAIN_KIB: u64 = 64 << 10;

/// A line of `/proc/self/status`, in KiB.
pub fn memory_kib(key: &str) -> u64 {
    let text = fs::read_to_string("/proc/self/status").unwrap();
    let line = text.lines().find(|line| line.starts_with(key)).unwrap();
    line.split_whitespace().nth(1).unwrap().parse().unwrap()
}

/// Asks for a refusal with the name, within the memory. The peak can be reset for the process alone.
fn refused(result: Result<(), String>, name: &str, before_kib: u64, room_kib: u64) -> Result<End, String> {
    let taken_kib = memory_kib("VmHWM").saturating_sub(before_kib);
    match result {
        Err(message) if !message.starts_with(name) => Err(message),
        Err(message) if message.len() > 2000 => Err(format!("a message of {} bytes", message.len())),
        Err(_) if taken_kib > room_kib => Err(format!("{taken_kib} KiB, expected at most {room_kib}")),
        Err(_) => Ok(End::Refused),
        Ok(()) => Err("accepted".to_owned()),
    }
}

/// Sets the process's peak to what it has now.
pub fn reset_peak() -> u64 {
    let _ = fs::write("/proc/self/clear_refs", "5");
    memory_kib("VmHWM")
}

/// A repetition of some bytes as gzip.
fn bomb(head: &[u8], piece: &[u8], times: usize) -> Vec<u8> {
    let mut writer = GzEncoder::new(Vec::new(), Compression::best());
    writer.write_all(head).unwrap();
    (0..times).for_each(|_| writer.write_all(piece).unwrap());
    writer.finish().unwrap()
}

#[test]
fn inputs_of_absurd_size_are_refused_in_little_time_and_memory() {
    let directory = tempfile::tempdir().unwrap();
    let text = bases()[1].1.clone();
    let (head, body) = text.split_at(text.find("END OF HEADER").unwrap() + 21);
    let options = Options { start: Epoch::parse("2010-07-01T08:05:58").unwrap(), max_gap_s: 2.0, tolerance_m: None };
    let ten_mb = vec![b'7'; 10 << 20];
    let nav = |bytes: &[u8]| rinex::read(bytes, "file").map(drop).map_err(|e| e.to_string());
    let bombs = long()
        .then(|| (bomb(b"", &vec![0; 1 << 20], 300), bomb(head.as_bytes(), body.as_bytes(), (300 << 20) / body.len())));
    type Run<'a> = Box<dyn Fn() -> Result<(), String> + 'a>;
    let mut rows: Vec<(&str, u64, Run)> = vec![
        ("navigation: a line of 10 MB alone", PLAIN_KIB, Box::new(|| nav(&ten_mb))),
        (
            "navigation: a line of 10 MB in the header",
            PLAIN_KIB,
            Box::new(|| nav(&[&head.as_bytes()[..81], &ten_mb].concat())),
        ),
        (
            "navigation: a line of 10 MB for a record",
            PLAIN_KIB,
            Box::new(|| nav(&[head.as_bytes(), b"G01", &ten_mb].concat())),
        ),
        (
            "precise orbits: a line of 10 MB",
            PLAIN_KIB,
            Box::new(|| {
                sp3::read(&[b"#dP2020", ten_mb.as_slice()].concat(), "file").map(drop).map_err(|e| e.to_string())
            }),
        ),
        (
            "maps: a line of 10 MB",
            PLAIN_KIB,
            Box::new(|| ionex::Maps::read(&ten_mb, "file").map(drop).map_err(|e| e.to_string())),
        ),
        (
            "trajectory: a line of 10 MB",
            PLAIN_KIB,
            Box::new(|| read_csv(ten_mb.as_slice(), "file", &options).map(drop).map_err(|e| e.to_string())),
        ),
        (
            "trajectory: a row of 10 MB",
            PLAIN_KIB,
            Box::new(|| {
                let text = [b"time_s,latitude_deg,longitude_deg,height_m\n", ten_mb.as_slice()].concat();
                read_csv(text.as_slice(), "file", &options).map(drop).map_err(|e| e.to_string())
            }),
        ),
        (
            "trajectory: a quoted field without end",
            PLAIN_KIB,
            Box::new(|| {
                let endless = b"time_s,latitude_deg,longitude_deg,height_m\n\"".chain(std::io::repeat(b'x'));
                read_csv(endless, "file", &options).map(drop).map_err(|e| e.to_string())
            }),
        ),
        (
            "trajectory: quotes that nothing closes",
            PLAIN_KIB,
            Box::new(|| {
                let endless = format!("time_s,latitude_deg,longitude_deg,height_m\n\"{}", "0,1,2,3\n".repeat(1 << 17));
                read_csv(endless.as_bytes(), "file", &options).map(drop).map_err(|e| e.to_string())
            }),
        ),
        (
            "trajectory (NMEA): a line of 10 MB",
            PLAIN_KIB,
            Box::new(|| read_nmea(ten_mb.as_slice(), "file", &options).map(drop).map_err(|e| e.to_string())),
        ),
        ("gzip in gzip", PLAIN_KIB, Box::new(|| nav(&packed(&packed(text.as_bytes()))))),
        (
            "gzip with something after it",
            PLAIN_KIB,
            Box::new(|| nav(&[packed(text.as_bytes()), b"more".to_vec()].concat())),
        ),
        (
            "gzip cut in half",
            PLAIN_KIB,
            Box::new(|| {
                let all = packed(text.as_bytes());
                nav(&all[..all.len() / 2])
            }),
        ),
    ];
    for (file, key) in [
        ("nav.rnx", "[navigation]\nfile = \"nav.rnx\""),
        ("maps.10i", "[ionosphere]\nmodel = \"ionex\"\nfile = \"maps.10i\""),
    ] {
        fs::File::create(directory.path().join(file)).unwrap().set_len(2 << 30).unwrap();
        let scene = format!("{SCENE}{key}\n");
        let here = directory.path();
        rows.push((
            file,
            PLAIN_KIB,
            Box::new(move || {
                let scene = Scenario::parse(&scene, "file").unwrap();
                scene.compose(here, &Overrides::default()).map(drop).map_err(|e| e.to_string())
            }),
        ));
    }
    fs::File::create(directory.path().join("ride.csv")).unwrap().set_len(2 << 30).unwrap();
    rows.push((
        "2 GiB of nothing for a trajectory",
        PLAIN_KIB,
        Box::new(|| {
            let file = fs::File::open(directory.path().join("ride.csv")).unwrap();
            read_csv(file, "file", &options).map(drop).map_err(|e| e.to_string())
        }),
    ));
    if let Some((zeros, lines)) = &bombs {
        rows.push(("300 MiB of zeros", CAP_KIB, Box::new(|| nav(zeros))));
        rows.push(("300 MiB of good records", CAP_KIB, Box::new(|| nav(lines))));
    }
    let mut tally = Tally::new("Navigation files", "7. sizes: lines, sparse files, bombs");
    for (name, room_kib, run) in &rows {
        tally.case(
            || (*name).to_owned(),
            || {
                let before_kib = reset_peak();
                refused(run(), "file", before_kib, *room_kib)
            },
        );
    }
    tally.finish();
}

const SCENE: &str = "name = \"x\"\nstart = 2010-07-01T08:05:58\nduration_s = 1\n[motion]\nkind = \"static\"\n\
                     latitude_deg = 26.5\nlongitude_deg = 80.2\nheight_m = 130\n[power]\ncn0_dbhz = 45\n[noise]\n";

#[test]
fn paths_that_lead_out_of_the_scene_s_directory_are_refused() {
    let outside = tempfile::tempdir().unwrap();
    let here = outside.path().join("scenes");
    fs::create_dir_all(here.join("sub")).unwrap();
    let ride = "time_s,latitude_deg,longitude_deg,height_m\n0,26.5,80.2,130\n1,26.5,80.2,130\n2,26.5,80.2,130\n";
    fs::write(outside.path().join("ride.csv"), ride).unwrap();
    fs::write(here.join("inside.csv"), ride).unwrap();
    symlink(outside.path().join("ride.csv"), here.join("link.csv")).unwrap();
    symlink(outside.path(), here.join("way")).unwrap();
    symlink("loop.csv", here.join("loop.csv")).unwrap();
    symlink("two.csv", here.join("one.csv")).unwrap();
    symlink("one.csv", here.join("two.csv")).unwrap();
    symlink("/dev/zero", here.join("zero.csv")).unwrap();
    symlink("inside.csv", here.join("near.csv")).unwrap();
    let absolute = outside.path().join("ride.csv").display().to_string();
    let out = "outside the scenario's directory";
    let rows: [(&str, Option<&str>); 24] = [
        ("../ride.csv", Some(out)),
        ("./../ride.csv", Some(out)),
        ("sub/../../ride.csv", Some(out)),
        ("sub/../../scenes/../ride.csv", Some(out)),
        ("../../../../../../../../etc/passwd", Some(out)),
        ("/etc/passwd", Some(out)),
        ("/proc/self/environ", Some(out)),
        (&absolute, Some(out)),
        ("link.csv", Some(out)),
        ("way/ride.csv", Some(out)),
        ("zero.csv", Some(out)),
        ("..", Some(out)),
        (".", Some("not a file")),
        ("sub", Some("not a file")),
        ("loop.csv", Some("symbolic links")),
        ("one.csv", Some("symbolic links")),
        ("inside.csv/", Some("irectory")),
        ("inside.csv/../inside.csv", Some("irectory")),
        ("INSIDE.CSV", Some("No such file")),
        ("~/ride.csv", Some("No such file")),
        ("$HOME/ride.csv", Some("No such file")),
        ("..\\\\ride.csv", Some("No such file")),
        ("inside.csv\\u0000.toml", Some("NUL byte")),
        ("sub/../near.csv", None),
    ];
    let mut tally = Tally::new("Scenarios", "Security. paths");
    for (path, part) in rows {
        let motion = format!("kind = \"file\"\nfile = \"{path}\"\n[power]");
        let text = SCENE
            .replace("kind = \"static\"\nlatitude_deg = 26.5\nlongitude_deg = 80.2\nheight_m = 130\n[power]", &motion);
        tally.case(
            || path.to_owned(),
            || {
                let scene = Scenario::parse(&text, "scene").map_err(|e| e.to_string())?;
                match (scene.compose(&here, &Overrides::default()).map(drop).map_err(|e| e.to_string()), part) {
                    (Ok(()), None) => Ok(End::Accepted),
                    (Err(message), Some(part))
                        if message.starts_with("scene: motion.file = ")
                            && message.contains(part)
                            && !message.contains(char::is_control) =>
                    {
                        Ok(End::Refused)
                    }
                    other => Err(format!("{other:?}")),
                }
            },
        );
    }
    let allowed = Overrides { allow_outside: true, ..Overrides::default() };
    let text = SCENE.replace(
        "kind = \"static\"\nlatitude_deg = 26.5\nlongitude_deg = 80.2\nheight_m = 130\n",
        "kind = \"file\"\nfile = \"link.csv\"\n",
    );
    tally.case(
        || "what is outside, allowed".to_owned(),
        || {
            let scene = Scenario::parse(&text, "scene").map_err(|e| e.to_string())?;
            scene.compose(Path::new(&here), &allowed).map(|_| End::Accepted).map_err(|e| e.to_string())
        },
    );
    tally.finish();
}
