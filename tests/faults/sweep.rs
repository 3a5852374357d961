//! Every system call of every command fails once, and every command is killed at every call: `strace` injects
//! it.
//!
//! Faults begin where the program's own code does: what the loader and the runtime call before cannot be
//! answered by it.

use std::collections::BTreeMap;
use std::path::Path;
use std::process::{Command, Stdio};
use std::sync::Mutex;
use std::time::{Duration, Instant};

use crate::damage::Random;
use crate::machine::{Bench, Ended, TWIN, Task, files, left_over};
use crate::tally::{End, Tally, long};

const FAMILY: &str = "A machine that fails";
/// The first call of the program's own.
const BEGIN: &str = "socketpair(";
/// A process that takes so long hangs.
const PATIENCE: Duration = Duration::from_secs(30);

/// Errors that each call may return.
const ERRORS: [(&str, &[&str]); 23] = [
    ("openat", &["EACCES", "EMFILE", "EIO", "ENOMEM", "EPERM", "EINTR", "ENOSPC"]),
    ("read", &["EIO", "EINTR", "EAGAIN", "ENOMEM"]),
    ("write", &["ENOSPC", "EIO", "EDQUOT", "EFBIG", "EINTR", "EAGAIN", "EPERM"]),
    ("close", &["EIO", "EINTR", "ENOSPC", "EDQUOT"]),
    ("fsync", &["EIO", "ENOSPC", "EDQUOT", "EINTR"]),
    ("rename", &["EACCES", "ENOSPC", "EIO", "EPERM", "EDQUOT", "EMLINK"]),
    ("linkat", &["EPERM", "EMLINK", "EIO", "ENOSPC", "EACCES"]),
    ("mkdir", &["EACCES", "ENOSPC", "EMLINK", "EIO", "EDQUOT", "EPERM"]),
    ("unlink", &["EIO", "EACCES", "EPERM"]),
    ("unlinkat", &["EIO", "EACCES", "EPERM"]),
    ("rmdir", &["EIO", "EACCES", "EPERM"]),
    ("statx", &["EIO", "EACCES", "ENOMEM"]),
    ("newfstatat", &["EIO", "EACCES", "ENOMEM"]),
    ("getdents64", &["EIO", "ENOMEM"]),
    ("readlink", &["EIO", "EACCES"]),
    ("lseek", &["EIO"]),
    ("clone3", &["EAGAIN", "ENOMEM"]),
    ("socketpair", &["EMFILE", "ENOMEM"]),
    ("fcntl", &["EMFILE"]),
    ("rt_sigaction", &[]),
    ("recvfrom", &["EINTR", "EIO"]),
    ("mmap", &["ENOMEM", "EAGAIN"]),
    ("mprotect", &["ENOMEM"]),
];

/// Calls that install the handlers of signals: a fault at each of them is tried in the short run too.
const INSTALLING: [&str; 2] = ["fcntl", "rt_sigaction"];

/// Calls that remove what is in the making: where one of these fails, some of it may stay for the next run.
const SWEEPING: [&str; 9] =
    ["unlink", "unlinkat", "rmdir", "statx", "newfstatat", "getdents64", "openat", "fcntl", "close"];

const NO_MEMORY: &str = "without memory the standard library aborts";
const NOT_CLOSED: &str = "where a directory cannot be closed the standard library panics";

/// Something that happens at a call.
#[derive(Clone, Debug)]
struct Fault {
    call: &'static str,
    what: String,
    when: u32,
}

/// Result of a fault.
enum Became {
    Held(End),
    NotReached,
    /// The standard library allows no answer: without memory it aborts, and it panics where a directory
    /// cannot be closed.
    Library(&'static str),
    Failed(String),
}

fn strace(options: &[&str], log: &Path, task: &Task, place: &Path) -> Ended {
    let output = Command::new("timeout")
        .args(["-s", "KILL", "60", "strace", "-f", "-o"])
        .arg(log)
        .args(options)
        .arg(TWIN)
        .args(&task.arguments)
        .current_dir(place)
        .stdin(Stdio::null())
        .env_remove("RUST_BACKTRACE")
        .output()
        .unwrap();
    task.ended(output)
}

/// Number of each call. The first number is that of the first thread before its own code begins, and the
/// second that of the thread with most calls.
fn counts(task: &Task) -> Option<BTreeMap<&'static str, (u32, u32)>> {
    let (place, log) = (task.workplace(), tempfile::NamedTempFile::new().unwrap());
    let ended = strace(&[], log.path(), task, place.path());
    let text = String::from_utf8_lossy(&std::fs::read(log.path()).unwrap()).into_owned();
    if ended.code != 0 || !text.contains(BEGIN) {
        return None;
    }
    let mut found = BTreeMap::new();
    for (call, _) in ERRORS {
        let (mut before, mut begun) = (0, false);
        let mut threads: BTreeMap<&str, u32> = BTreeMap::new();
        for line in text.lines() {
            let Some((thread, rest)) = line.split_once(' ') else { continue };
            begun |= rest.contains(BEGIN);
            if rest.trim_start().strip_prefix(call).is_some_and(|rest| rest.starts_with('(')) {
                *threads.entry(thread).or_default() += 1;
                before += u32::from(!begun);
            }
        }
        found.insert(call, (before, threads.into_values().max().unwrap_or(0)));
    }
    Some(found)
}

/// All faults of a task, or where it takes seconds one in `stride` of them.
fn faults(number: usize, task: &Task, stride: usize) -> Vec<Fault> {
    let Some(counts) = counts(task) else { return Vec::new() };
    let mut all = Vec::new();
    for (call, errors) in ERRORS {
        let (before, most) = counts[call];
        // A file of a hundred megabytes is read in as many pieces: they are all alike.
        let step = if most - before > 60 { 6 } else { 1 };
        for when in (before + 1..=most).step_by(step) {
            let memory = ["mmap", "mprotect"].contains(&call);
            let signals: &[&str] = if memory { &[] } else { &["KILL", "TERM"] };
            let errors = errors.iter().map(|error| format!("error={error}"));
            let signals = signals.iter().map(|signal| format!("signal={signal}"));
            all.extend(errors.chain(signals).map(|what| Fault { call, what, when }));
        }
    }
    let first = Random::new(number as u64).below(stride);
    let count = all.len();
    let numbered = all.into_iter().enumerate();
    let is_chosen = |(number, fault): &(usize, Fault)| number % stride == first || INSTALLING.contains(&fault.call);
    let chosen: Vec<Fault> = numbered.filter(is_chosen).map(|(_, fault)| fault).collect();
    println!("{}: {} of {count} faults", task.name, chosen.len());
    chosen
}

fn inject(task: &Task, fault: &Fault) -> Became {
    let Fault { call, what, when, .. } = fault;
    let (place, log) = (task.workplace(), tempfile::NamedTempFile::new().unwrap());
    let place = place.path();
    let injection = format!("inject={call}:{what}:when={when}");
    let begun = Instant::now();
    let ended = strace(&["-e", &format!("trace={call}"), "-e", &injection], log.path(), task, place);
    if begun.elapsed() > PATIENCE {
        return Became::Failed(format!("{:?}", begun.elapsed()));
    }
    let trace = String::from_utf8_lossy(&std::fs::read(log.path()).unwrap()).into_owned();
    let killed = what == "signal=KILL";
    let happened = trace.contains("INJECTED")
        || (what.starts_with("signal") && trace.contains("--- SIG") || killed && trace.contains("killed by SIGKILL"));
    if !happened {
        return Became::NotReached;
    }
    let library = match ended.code {
        134 if ["mmap", "mprotect"].contains(call) && !ended.message.contains("panicked") => Some(NO_MEMORY),
        70 if ended.message.contains("unexpected error during closedir") => Some(NOT_CLOSED),
        _ => None,
    };
    // Counted a thread, a signal may come to two of them, and the second ends the program at once.
    let at_once = killed || library.is_some() || trace.matches("--- SIGTERM").count() > 1;
    match (judge(task, place, &ended, fault, library.is_some(), at_once), library) {
        (Ok(_), Some(why)) => Became::Library(why),
        (Ok(end), None) => Became::Held(end),
        (Err(what), _) => Became::Failed(format!("{what}: {}", ended.message.trim())),
    }
}

/// `at_once`: it had no time to take away what was in the making, which the next run must sweep.
fn judge(task: &Task, place: &Path, ended: &Ended, fault: &Fault, library: bool, at_once: bool) -> Result<End, String> {
    let allowed: &[i32] = match fault.what.as_str() {
        _ if library => &[70, 134],
        "signal=KILL" => &[137],
        // So early a signal has all the work before it: it must not get lost.
        "signal=TERM" if fault.call == "rt_sigaction" => &[143],
        "signal=TERM" => &[0, 143],
        _ => &[0, 73, 74, 75],
    };
    if ended.message.contains("panicked") && !library {
        return Err("a panic".to_owned());
    }
    if !allowed.contains(&ended.code) {
        return Err(format!("exit {}", ended.code));
    }
    let (found, code) = (files(place), ended.code);
    task.sound(&found).map_err(|what| format!("exit {code}: {what}"))?;
    if code == 0 {
        task.complete(place, ended).map_err(|what| format!("exit 0 while wrong: {what}"))?;
    } else if fault.what.starts_with("error") && ended.message.trim().is_empty() && fault.call != "write" {
        return Err(format!("exit {code} without a word"));
    }
    let left = left_over(&found);
    if !left.is_empty() && !at_once && !SWEEPING.contains(&fault.call) {
        return Err(format!("exit {code} leaves {left:?}"));
    }
    if let Some(whole) = task.whole.filter(|_| !at_once)
        && !found.keys().any(|name| name.starts_with(&format!("{whole}/")))
    {
        return Err(format!("exit {code}: neither the old nor the new {whole} is left"));
    }
    if code != 0 || !left.is_empty() {
        let again = task.run(place);
        if again.code != 0 {
            return Err(format!("exit {code}, then {}: {}", again.code, again.message));
        }
        task.complete(place, &again).map_err(|what| format!("after exit {code}, run again: {what}"))?;
        let left = left_over(&files(place));
        if !left.is_empty() {
            return Err(format!("after exit {code}, run again: {left:?} stays"));
        }
    }
    Ok(if code == 0 { End::Accepted } else { End::Refused })
}

/// Results of all faults, on as many threads as keep two cores busy.
fn injected<'a>(task: &Task, faults: &'a [Fault]) -> Vec<(&'a Fault, Became)> {
    let (next, ends) = (Mutex::new(faults.iter()), Mutex::new(Vec::new()));
    std::thread::scope(|scope| {
        for _ in 0..if long() { 3 } else { 2 } {
            scope.spawn(|| {
                loop {
                    let Some(fault) = next.lock().unwrap().next() else { break };
                    let became = inject(task, fault);
                    if let (Became::Failed(what), true) = (&became, long()) {
                        println!("{} {} {}:{}: {what}", task.name, fault.call, fault.what, fault.when);
                    }
                    ends.lock().unwrap().push((fault, became));
                }
            });
        }
    });
    ends.into_inner().unwrap()
}

/// True if calls can be traced on this machine.
fn can_trace() -> bool {
    let tried = Command::new("strace").args(["-o", "/dev/null", "-e", "inject=fsync:error=EIO", "true"]).output();
    tried.is_ok_and(|output| output.status.success())
}

#[test]
fn at_whatever_call_the_machine_fails_or_the_program_is_killed_results_are_right_or_absent() {
    if !can_trace() {
        println!("no strace, or tracing is not permitted: failing calls are not tested");
        return;
    }
    // Those that draw or search take a second or more: one fault in so many.
    let plan: &[(&'static str, usize)] = if long() {
        &[
            ("plan", 1),
            ("plan a ride", 1),
            ("plan with maps", 1),
            ("generate", 1),
            ("generate again", 1),
            ("receive", 1),
            ("study merge", 1),
            ("study report", 1),
            ("study status", 1),
            ("study plan", 1),
            ("study run", 1),
            ("study run of samples", 10),
            ("run", 14),
            ("analyze", 14),
        ]
    } else {
        &[("plan", 8), ("generate", 35)]
    };
    let bench = Bench::new(&plan.iter().map(|(name, _)| *name).collect::<Vec<_>>());
    let mut failures = Vec::new();
    let (mut count, mut not_reached, mut library) = (0, 0, BTreeMap::<&str, u32>::new());
    for (number, task) in bench.tasks.iter().enumerate() {
        let chosen = faults(number, task, plan[number].1);
        let mut ends = injected(task, &chosen);
        ends.sort_by_key(|(fault, _)| (fault.call, fault.what.clone(), fault.when));
        count += ends.len();
        for (kind, title) in [("error", "16. a call fails"), ("signal", "17. killed at a call")] {
            let mut tally = Tally::of_processes(FAMILY, format!("{title}: {}", task.name));
            for (fault, became) in ends.iter().filter(|(fault, _)| fault.what.starts_with(kind)) {
                let ended = match became {
                    Became::Held(End::Accepted) => Ok(End::Accepted),
                    Became::Held(_) => Ok(End::Refused),
                    Became::Failed(what) => Err(what.clone()),
                    Became::NotReached => {
                        not_reached += 1;
                        continue;
                    }
                    Became::Library(why) => {
                        *library.entry(why).or_default() += 1;
                        continue;
                    }
                };
                tally.case(|| format!("{} {}:{}", fault.call, fault.what, fault.when), || ended);
            }
            failures.extend(tally.close().err());
        }
    }
    // Honest rows of their own: no program can answer these, but the next run recovers.
    for (why, count) in &library {
        let mut tally = Tally::of_processes(FAMILY, format!("16. {why}, and a second run recovers"));
        (0..*count).for_each(|_| tally.case(String::new, || Ok(End::Reported)));
        failures.extend(tally.close().err());
    }
    println!("{count} faults: {not_reached} not reached, {library:?}");
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}
