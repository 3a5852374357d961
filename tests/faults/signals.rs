//! Signals at random moments: the program ends at once, takes what it was making away, and the next run is
//! right.

use std::fs;
use std::path::Path;
use std::process::{Child, Command, Output, Stdio};
use std::sync::Mutex;
use std::time::{Duration, Instant};

use crate::damage::Random;
use crate::machine::{Bench, Ended, TWIN, Task, files, left_over, twin};
use crate::tally::{End, Tally, cases, long};

const FAMILY: &str = "A machine that fails";

/// Signals and the exit codes they lead to; under `nohup`, which the program heeds, hang-ups lead to none.
fn signals() -> Vec<(&'static str, i32)> {
    let mut signals = vec![("INT", 130), ("TERM", 143)];
    if !detached() {
        signals.push(("HUP", 129));
    }
    signals
}

fn detached() -> bool {
    let status = fs::read_to_string("/proc/self/status").unwrap();
    let mask = status.lines().find_map(|line| line.strip_prefix("SigIgn:")).unwrap();
    u64::from_str_radix(mask.trim(), 16).unwrap() & 1 == 1
}

/// The promise; where many programs share the machine in the short run, it may keep this one from the
/// processor.
const PROMISED: Duration = Duration::from_secs(1);

fn limit() -> Duration {
    if long() { PROMISED } else { 5 * PROMISED }
}

fn send(signal: &str, child: &Child) {
    let sent =
        Command::new("kill").args([&format!("-{signal}"), &child.id().to_string()]).stderr(Stdio::null()).status();
    // A process that has ended since takes none.
    let _ = sent.unwrap();
}

/// Output of a child, and its run time from now on.
fn end(child: Child) -> (Output, Duration) {
    let begun = Instant::now();
    let ended = child.wait_with_output().unwrap();
    (ended, begun.elapsed())
}

fn start(task: &Task, place: &Path) -> Child {
    twin(&task.arguments, place).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap()
}

/// One signal, or the same twice.
fn interrupt(
    task: &Task,
    (signal, code): (&str, i32),
    after: Duration,
    twice: bool,
) -> Result<(End, Duration), String> {
    let place = task.workplace();
    let child = start(task, place.path());
    std::thread::sleep(after);
    send(signal, &child);
    if twice {
        send(signal, &child);
    }
    let (ended, taken) = end(child);
    let ended = task.ended(ended);
    if ended.message.contains("panicked") || ![0, code].contains(&ended.code) {
        return Err(format!("exit {}: {}", ended.code, ended.message));
    }
    if ended.code != 0 && taken > limit() {
        return Err(format!("took {taken:?}"));
    }
    let found = files(place.path());
    task.sound(&found)?;
    let left = left_over(&found);
    // The second one waits for nothing.
    if !left.is_empty() && !twice {
        return Err(format!("exit {} leaves {left:?}", ended.code));
    }
    let stopped = ended.code != 0;
    let again = if stopped { task.run(place.path()) } else { ended };
    if again.code != 0 {
        return Err(format!("run again: exit {}: {}", again.code, again.message));
    }
    task.complete(place.path(), &again)?;
    let left = left_over(&files(place.path()));
    if left.is_empty() {
        Ok((if stopped { End::Refused } else { End::Accepted }, taken))
    } else {
        Err(format!("{left:?} stays"))
    }
}

#[test]
fn a_signal_at_any_moment_ends_the_program_at_once_and_the_next_run_is_right() {
    let names: &[&'static str] = if long() {
        &[
            "plan",
            "generate",
            "receive with a search",
            "study run",
            "study plan",
            "study report",
            "study run of samples",
            "pack run",
            "run",
            "analyze",
        ]
    } else {
        &["plan", "generate", "receive with a search"]
    };
    let (bench, signals) = (Bench::new(names), signals());
    let mut failures = Vec::new();
    for task in &bench.tasks {
        // The quickest of three, so that most signals come before the end.
        let place = task.workplace();
        let timed = || {
            let begun = Instant::now();
            task.run(place.path());
            begun.elapsed()
        };
        let whole = (0..3).map(|_| timed()).min().unwrap_or_default();
        let mut jobs: Vec<(usize, Duration, bool)> = Vec::new();
        let mut random = Random::new(task.name.len() as u64);
        // Those that draw take seconds, and a search half of one.
        let all = if ["run", "analyze", "study run of samples"].contains(&task.name) { 34 } else { 100 };
        let few = if task.name.starts_with("receive") { 3 } else { 6 };
        for number in 0..cases(few, all) {
            let share = random.below(1000) as f64 / 1000.0;
            jobs.push((number, whole.mul_f64(share), number % 10 == 9));
        }
        let (next, ends) = (Mutex::new(jobs.into_iter()), Mutex::new(Vec::new()));
        std::thread::scope(|scope| {
            for _ in 0..2 {
                scope.spawn(|| {
                    loop {
                        let Some((number, after, twice)) = next.lock().unwrap().next() else { break };
                        let signal = signals[number % signals.len()];
                        let ended = interrupt(task, signal, after, twice);
                        ends.lock().unwrap().push((format!("{} after {after:?}", signal.0), ended));
                    }
                });
            }
        });
        let mut tally = Tally::of_processes(FAMILY, format!("18. a signal: {}", task.name));
        let mut worst = Duration::ZERO;
        for (name, ended) in ends.into_inner().unwrap() {
            tally.case(
                || name.clone(),
                || {
                    ended.map(|(end, taken)| {
                        worst = worst.max(taken);
                        end
                    })
                },
            );
        }
        println!("{}: at most {worst:?} from signal to end", task.name);
        failures.extend(tally.close().err());
    }
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}

#[test]
fn a_signal_ends_a_wait_for_samples_that_never_come() {
    let place = tempfile::tempdir().unwrap();
    let fifo = place.path().join("fifo");
    assert!(Command::new("mkfifo").arg(&fifo).status().unwrap().success());
    let mut tally = Tally::of_processes(FAMILY, "18. a signal: waiting for samples");
    for (signal, code) in signals() {
        for source in ["-", "fifo"] {
            tally.case(
                || format!("{signal}, {source}"),
                || {
                    let mut child = Command::new(TWIN)
                        .args(["receive", source, "--out", "rx", "--format", "ci8", "--rate-hz", "4e6"])
                        .current_dir(place.path())
                        .stdin(Stdio::piped())
                        .spawn()
                        .unwrap();
                    let silent = child.stdin.take();
                    // Its staging directory says that it waits, but for a pipe that nobody has opened for
                    // writing.
                    let begun = Instant::now();
                    while begun.elapsed() < Duration::from_secs(20)
                        && (source == "-" && !place.path().join(".rx.part").exists())
                    {
                        std::thread::sleep(Duration::from_millis(10));
                    }
                    if source == "fifo" {
                        std::thread::sleep(Duration::from_millis(300));
                    }
                    send(signal, &child);
                    let (ended, taken) = end(child);
                    let ended = Ended::from(ended);
                    drop(silent);
                    let names: Vec<_> = fs::read_dir(place.path()).unwrap().flatten().collect();
                    if ended.code == code && taken < limit() && names.len() == 1 {
                        Ok(End::Refused)
                    } else {
                        Err(format!("exit {} after {taken:?}, {names:?}", ended.code))
                    }
                },
            );
        }
    }
    tally.finish();
}

#[test]
fn a_hang_up_is_ignored_under_nohup_and_ends_the_program_without() {
    if detached() {
        println!("hang-ups are ignored here: what ends the program without is not tested");
        return;
    }
    let mut tally = Tally::of_processes(FAMILY, "18. a signal: hang-ups under nohup");
    tally.case(
        || "nohup".to_owned(),
        || {
            let place = tempfile::tempdir().unwrap();
            let mut child = Command::new("nohup")
                .args([TWIN, "receive", "-", "--out", "rx", "--format", "ci8", "--rate-hz", "4e6"])
                .current_dir(place.path())
                .stdin(Stdio::piped())
                .stdout(Stdio::piped())
                .stderr(Stdio::piped())
                .spawn()
                .unwrap();
            let silent = child.stdin.take();
            let begun = Instant::now();
            while begun.elapsed() < Duration::from_secs(20) && !place.path().join(".rx.part").exists() {
                std::thread::sleep(Duration::from_millis(10));
            }
            send("HUP", &child);
            std::thread::sleep(Duration::from_millis(200));
            let alive = child.try_wait().unwrap().is_none();
            send("TERM", &child);
            let (ended, _) = end(child);
            let ended = Ended::from(ended);
            drop(silent);
            if alive && ended.code == 143 { Ok(End::Accepted) } else { Err(format!("{alive}, exit {}", ended.code)) }
        },
    );
    tally.finish();
}
