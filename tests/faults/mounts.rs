//! Real file systems that are full or read-only, directories of others, and limits on memory.

use std::fs;
use std::os::unix::fs::{PermissionsExt, symlink};
use std::path::Path;
use std::process::{Command, Stdio};

use crate::machine::{Bench, Ended, TWIN, Task, copy, files, left_over, modelled, scene, twin};
use crate::tally::{End, Tally, long};

const FAMILY: &str = "A machine that fails";

/// A file system in memory; unmounted when dropped.
struct Mount(tempfile::TempDir);

impl Mount {
    /// `None` where mounting is not permitted.
    fn new(size: &str) -> Option<Self> {
        let place = tempfile::tempdir().unwrap();
        let mount = Self(place);
        mount.mount(&format!("size={size}"), &["-t", "tmpfs", "tmpfs"]).then_some(mount)
    }

    fn mount(&self, options: &str, rest: &[&str]) -> bool {
        let tried =
            Command::new("mount").args(["-o", options]).args(rest).arg(self.0.path()).stderr(Stdio::null()).status();
        tried.is_ok_and(|status| status.success())
    }

    fn again(&self, options: &str) {
        assert!(self.mount(&format!("remount,{options}"), &[]));
    }
}

impl Drop for Mount {
    fn drop(&mut self) {
        let _ = Command::new("umount").arg(self.0.path()).stderr(Stdio::null()).status();
    }
}

fn refused(ended: &Ended, codes: &[i32]) -> Result<(), String> {
    if codes.contains(&ended.code) && !ended.message.contains("panicked") && !ended.message.trim().is_empty() {
        Ok(())
    } else {
        Err(format!("exit {}, expected {codes:?}: {}", ended.code, ended.message))
    }
}

/// Nothing under a final name is half of itself, and nothing in the making stays.
fn clean(task: &Task, place: &Path) -> Result<(), String> {
    let found = files(place);
    task.sound(&found)?;
    let left = left_over(&found);
    if left.is_empty() { Ok(()) } else { Err(format!("leaves {left:?}")) }
}

#[test]
fn a_full_or_read_only_disk_refuses_and_with_room_the_same_command_completes() {
    let Some(mount) = Mount::new("64m") else {
        println!("mounting is not permitted: full and read-only file systems are not tested");
        return;
    };
    let names: &[&'static str] = if long() {
        &[
            "generate",
            "receive",
            "run",
            "analyze",
            "study plan",
            "study run",
            "study merge",
            "study report",
            "study run of samples",
            "pack run",
        ]
    } else {
        &["generate"]
    };
    let bench = Bench::new(names);
    let mut tally = Tally::of_processes(FAMILY, "19. a full or read-only file system");
    for task in &bench.tasks {
        let place = mount.0.path().join("work");
        let fresh = || {
            let _ = fs::remove_dir_all(&place);
            copy(&task.before, &place);
        };
        for room_kib in if long() { vec![0, 4, 20, 60] } else { vec![0, 8] } {
            fresh();
            tally.case(
                || format!("{}, {room_kib} KiB left", task.name),
                || {
                    // What is used, in pages, and as much more.
                    let output = Command::new("df").args(["--output=used", "-k"]).arg(mount.0.path()).output().unwrap();
                    let text = String::from_utf8_lossy(&output.stdout).into_owned();
                    let used: u64 = text.lines().nth(1).unwrap().trim().parse().unwrap();
                    mount.again(&format!("size={}k", used + room_kib));
                    let full = task.run(&place);
                    let held = if full.code == 0 {
                        task.complete(&place, &full)
                    } else {
                        refused(&full, &[75]).and_then(|()| clean(task, &place))
                    };
                    mount.again("size=64m");
                    held?;
                    let roomy = task.run(&place);
                    task.complete(&place, &roomy)
                        .map_err(|what| format!("with room again, {what}: {}", roomy.message))?;
                    Ok(if full.code == 0 { End::Accepted } else { End::Refused })
                },
            );
        }
        fresh();
        tally.case(
            || format!("{}, read-only", task.name),
            || {
                mount.again("ro");
                let ended = task.run(&place);
                mount.again("rw");
                refused(&ended, &[73, 74])?;
                clean(task, &place)?;
                let again = task.run(&place);
                task.complete(&place, &again)?;
                Ok(End::Refused)
            },
        );
    }
    tally.finish();
}

#[test]
fn directories_of_others_are_refused_and_links_are_not_followed() {
    let bench = Bench::new(&["generate"]);
    let task = &bench.tasks[0];
    let mut tally = Tally::of_processes(FAMILY, "19, Security. outputs of others, links, modes");
    let place = task.workplace();
    let at = |name: &str| place.path().join(name);
    let generate = |out: &str| -> Ended {
        let words = ["generate", "tiny.toml", "--out", out].map(str::to_owned);
        twin(&words, place.path()).output().unwrap().into()
    };
    fs::write(at("mine"), "mine").unwrap();
    let samples = &task.new["s.sigmf-data"];
    let right = |name: &str| fs::read(at(name)).is_ok_and(|bytes| bytes == *samples);
    let links: [(&str, &str, i32); 5] = [
        // Replaced themselves; what they lead to stays.
        ("a link to a file", "mine", 0),
        ("a link to nothing", "nothing", 0),
        ("a link to a directory", ".", 73),
        ("a link to a device", "/dev/null", 73),
        ("a link to itself", "link.sigmf-data", 73),
    ];
    for (name, target, code) in links {
        let _ = fs::remove_file(at("link.sigmf-data"));
        symlink(target, at("link.sigmf-data")).unwrap();
        tally.case(
            || name.to_owned(),
            || {
                let ended = generate("link.sigmf-data");
                let mine = fs::read_to_string(at("mine")).unwrap();
                let replaced =
                    right("link.sigmf-data") && !fs::symlink_metadata(at("link.sigmf-data")).unwrap().is_symlink();
                if ended.code == code && mine == "mine" && !at("nothing").exists() && replaced == (code == 0) {
                    Ok(if code == 0 { End::Accepted } else { End::Refused })
                } else {
                    Err(format!("exit {}: {}", ended.code, ended.message))
                }
            },
        );
    }
    symlink("mine", at(".p.sigmf-data.part")).unwrap();
    tally.case(
        || "a link under the temporary name".to_owned(),
        || {
            let ended = generate("p.sigmf-data");
            match (ended.code, fs::read_to_string(at("mine"))) {
                (0, Ok(mine)) if mine == "mine" && right("p.sigmf-data") => Ok(End::Accepted),
                other => Err(format!("{other:?}: {}", ended.message)),
            }
        },
    );
    tally.case(
        || "mode 0644 and the umask".to_owned(),
        || {
            let script = format!("umask 027; '{TWIN}' generate tiny.toml --out m.sigmf-data");
            let ended: Ended =
                Command::new("bash").args(["-c", &script]).current_dir(place.path()).output().unwrap().into();
            let mode = fs::metadata(at("m.sigmf-data")).map(|about| about.permissions().mode() & 0o777);
            match mode {
                Ok(0o640) if ended.code == 0 => Ok(End::Accepted),
                other => Err(format!("{other:?}: {}", ended.message)),
            }
        },
    );
    fs::set_permissions(place.path(), fs::Permissions::from_mode(0o755)).unwrap();
    let as_nobody = |words: &str| -> Ended {
        let mut command = Command::new("setpriv");
        command.args(["--reuid=65534", "--regid=65534", "--clear-groups", TWIN]).args(words.split(' '));
        command.current_dir(place.path()).stdin(Stdio::null()).output().unwrap().into()
    };
    let can =
        Command::new("setpriv").args(["--reuid=65534", "--regid=65534", "--clear-groups", TWIN, "--version"]).output();
    if can.is_ok_and(|output| output.status.success()) {
        fs::write(at("study.toml"), modelled(0.3)).unwrap();
        fs::write(at("secret.toml"), scene(0.02, 1)).unwrap();
        fs::set_permissions(at("secret.toml"), fs::Permissions::from_mode(0o600)).unwrap();
        for (words, code) in [
            ("generate tiny.toml --out n.sigmf-data", 73),
            ("run tiny.toml --out n", 73),
            ("plan secret.toml", 74),
            ("study plan study.toml -o n", 73),
        ] {
            tally.case(|| format!("as nobody: {words}"), || refused(&as_nobody(words), &[code]).map(|()| End::Refused));
        }
    } else {
        println!("no other user can be become: modes are not tested");
    }
    tally.finish();
}

/// Runs the program with the memory that it may write to limited.
fn limited(kind: &str, kib: u64, words: &str, place: &Path) -> Ended {
    let script = format!("ulimit -{kind} {kib}; exec '{TWIN}' {words}");
    Command::new("bash").args(["-c", &script]).current_dir(place).stdin(Stdio::null()).output().unwrap().into()
}

#[test]
fn refusals_take_little_memory_and_commands_keep_to_a_limit() {
    let place = tempfile::tempdir().unwrap();
    let at = |name: &str| place.path().join(name);
    fs::write(at("tiny.toml"), scene(0.02, 1)).unwrap();
    // What a plan of the tiny scene needs is the baseline: doubled from 1 MiB until it passes.
    let baseline_kib =
        (10..21).map(|power| 1_u64 << power).find(|kib| limited("d", *kib, "plan tiny.toml", place.path()).code == 0);
    let mut tally = Tally::of_processes(FAMILY, "21. refusals within 64 MiB over a plan's memory");
    let Some(baseline_kib) = baseline_kib else { panic!("no plan within 1 GiB") };
    let with = |from: &str, to: &str| scene(0.02, 1).replace(from, to);
    let large = "x".repeat(4_000_000);
    for (name, text) in [
        ("1e14 samples", with("duration_s = 0.02", "duration_s = 2.6e6").replace("2.6e6\nformat", "5e7\nformat")),
        ("duration 1e308", with("duration_s = 0.02", "duration_s = 1e308")),
        ("rate 1e18", with("sample_rate_hz = 2.6e6", "sample_rate_hz = 1e18")),
        ("a line of 4 MB", format!("name = \"{large}\"\n")),
        ("10 MB", "# comment\n".repeat(1_000_000)),
        ("arrays 10000 deep", format!("a = {}", "[".repeat(10_000))),
        ("a device without end", String::new()),
    ] {
        fs::write(at("odd.toml"), &text).unwrap();
        let odd = if text.is_empty() { "/dev/zero" } else { "odd.toml" };
        for words in [format!("plan {odd}"), format!("run {odd} --out x"), format!("generate {odd} --out y.sigmf-data")]
        {
            tally.case(
                || format!("{name}: {words}"),
                || {
                    let begun = std::time::Instant::now();
                    let ended = limited("d", baseline_kib + 65_536, &words, place.path());
                    // Two seconds of an idle machine.
                    if begun.elapsed().as_secs() > if long() { 2 } else { 10 } {
                        return Err(format!("{:?}", begun.elapsed()));
                    }
                    refused(&ended, &[65]).map(|()| End::Refused)
                },
            );
        }
    }
    println!("baseline: {baseline_kib} KiB");
    tally.finish();
    let names: &[&'static str] =
        if long() { &["plan", "generate", "receive", "run", "analyze", "study run"] } else { &["generate"] };
    let bench = Bench::new(names);
    let mut tally = Tally::of_processes(FAMILY, "22. commands within ulimit -v of 1 GiB");
    for task in &bench.tasks {
        tally.case(
            || task.name.to_owned(),
            || {
                let work = task.workplace();
                let ended = limited("v", 1 << 20, &task.arguments.join(" "), work.path());
                task.complete(work.path(), &ended).map_err(|what| format!("{what}: {}", ended.message))?;
                Ok(End::Accepted)
            },
        );
    }
    tally.finish();
}
