//! Cases, what became of them, and the table of the report.

use std::collections::BTreeMap;
use std::fmt::Write;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Mutex;
use std::time::{Duration, Instant};

/// A refusal may keep a thread so long at work; what else the machine has to do does not count.
const PATIENCE: Duration = Duration::from_secs(2);
/// A process that takes so long hangs: many may run beside it.
const PROCESS_PATIENCE: Duration = Duration::from_secs(30);

/// Rows by family and fault.
type Rows = BTreeMap<(String, String), String>;

static ROWS: Mutex<Rows> = Mutex::new(Rows::new());

/// True if all cases are requested.
pub fn long() -> bool {
    std::env::var_os("GNSS_TWIN_LONG").is_some()
}

/// The short or the long number.
pub fn cases(short: usize, long_run: usize) -> usize {
    if long() { long_run } else { short }
}

/// Result of a case that held.
pub enum End {
    Refused,
    /// Accepted with part of it left out and named.
    Reported,
    Accepted,
}

/// The cases of one kind of fault.
pub struct Tally {
    family: &'static str,
    fault: String,
    begun: Instant,
    patience: Duration,
    cases: usize,
    refused: usize,
    reported: usize,
    accepted: usize,
    failures: Vec<String>,
}

impl Tally {
    pub fn new(family: &'static str, fault: impl Into<String>) -> Self {
        let (fault, begun, patience) = (fault.into(), Instant::now(), PATIENCE);
        Self { family, fault, begun, patience, cases: 0, refused: 0, reported: 0, accepted: 0, failures: Vec::new() }
    }

    /// A tally for cases that start a process.
    pub fn of_processes(family: &'static str, fault: impl Into<String>) -> Self {
        Self { patience: PROCESS_PATIENCE, ..Self::new(family, fault) }
    }

    /// Runs a case: a panic, an end that is late, and `Err` are failures.
    pub fn case(&mut self, name: impl Fn() -> String, run: impl FnOnce() -> Result<End, String>) {
        self.cases += 1;
        let (begun, worked) = (Instant::now(), work());
        let ended = catch_unwind(AssertUnwindSafe(run));
        let taken = if self.patience == PATIENCE { work().saturating_sub(worked) } else { begun.elapsed() };
        match ended {
            _ if taken > self.patience => self.failures.push(format!("{}: {taken:?}", name())),
            Err(_) => self.failures.push(format!("{}: panicked", name())),
            Ok(Err(what)) => self.failures.push(format!("{}: {what}", name())),
            Ok(Ok(End::Refused)) => self.refused += 1,
            Ok(Ok(End::Reported)) => self.reported += 1,
            Ok(Ok(End::Accepted)) => self.accepted += 1,
        }
    }

    /// Runs many short cases, numbered from `first`, timed together: each is one of the row's.
    pub fn batch(&mut self, count: usize, name: &str, first: usize, run: impl Fn(usize) -> Result<End, String>) {
        let worked = work();
        for number in first..first + count {
            self.cases += 1;
            match catch_unwind(AssertUnwindSafe(|| run(number))) {
                Err(_) => self.failures.push(format!("{name} {number}: panicked")),
                Ok(Err(what)) => self.failures.push(format!("{name} {number}: {what}")),
                Ok(Ok(End::Refused)) => self.refused += 1,
                Ok(Ok(End::Reported)) => self.reported += 1,
                Ok(Ok(End::Accepted)) => self.accepted += 1,
            }
        }
        let taken = work().saturating_sub(worked);
        if taken > self.patience {
            self.failures.push(format!("{name} {first} and the {count} after it: {taken:?}"));
        }
    }

    /// Adds the row to the report, and fails if a case failed.
    pub fn finish(self) {
        if let Err(message) = self.close() {
            panic!("{message}");
        }
    }

    /// Adds the row to the report; an error if a case failed.
    pub fn close(self) -> Result<(), String> {
        let Self { family, fault, cases, refused, reported, accepted, failures, .. } = self;
        let seconds = self.begun.elapsed().as_secs_f64();
        let failed = failures.len();
        let row = format!("| {fault} | {cases} | {refused} | {reported} | {accepted} | {failed} | {seconds:.1} |");
        let mut rows = ROWS.lock().unwrap_or_else(|broken| broken.into_inner());
        rows.insert((family.to_owned(), fault.clone()), row);
        write(&rows);
        drop(rows);
        let shown = failures.iter().take(12).cloned().collect::<Vec<_>>().join("\n  ");
        if failed == 0 && cases > 0 {
            return Ok(());
        }
        Err(format!("{fault}: {failed} of {cases} cases failed:\n  {shown}"))
    }
}

/// Processor time of this thread.
fn work() -> Duration {
    let text = std::fs::read_to_string("/proc/thread-self/schedstat").unwrap_or_default();
    Duration::from_nanos(text.split(' ').next().and_then(|word| word.parse().ok()).unwrap_or(0))
}

/// Rows of a report as [`write`] leaves it.
fn read(text: &str) -> Rows {
    let (mut family, mut rows) = (String::new(), Rows::new());
    for line in text.lines() {
        if let Some(name) = line.strip_prefix("## ") {
            family = name.to_owned();
        } else if let Some((fault, _)) = line.strip_prefix("| ").and_then(|row| row.split_once(" |"))
            && fault != "fault"
            && fault != "---"
        {
            rows.insert((family.clone(), fault.to_owned()), line.to_owned());
        }
    }
    rows
}

/// Writes the report. Rows of faults that this run does not look at stay as they are, so that it can be made
/// in parts.
fn write(rows: &Rows) {
    let Some(path) = std::env::var_os("GNSS_TWIN_WRITE_ROBUSTNESS") else { return };
    let mut all = read(&std::fs::read_to_string(&path).unwrap_or_default());
    all.extend(rows.clone());
    let mut text = String::from(
        "# Robustness\n\nCases of damaged input and of a failing machine, and what became of them: refused with the \
         position and the reason; accepted with a part left out and named; accepted as it legally stands. A failure is \
         a panic, an end after more than two seconds of work (a process: thirty seconds), a result that is not what \
         the input says, or a wrong exit code. `bash .ci/long` fills this table.\n",
    );
    let mut family = "";
    for ((now, _), row) in &all {
        if now != family {
            let head = "| fault | cases | refused | reported | accepted | failures | time (s) |";
            let _ = write!(text, "\n## {now}\n\n{head}\n| --- | ---: | ---: | ---: | ---: | ---: | ---: |\n");
            family = now;
        }
        let _ = writeln!(text, "{row}");
    }
    std::fs::write(path, text).unwrap();
}
