//! Commands on tiny scenes, each with the directory that it starts from and the bytes that it is to leave
//! there.

use std::collections::BTreeMap;
use std::fs;
use std::os::unix::process::ExitStatusExt;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

/// The exit code of a reception without a fix.
pub const NO_FIX: i32 = 3;

pub const TWIN: &str = env!("CARGO_BIN_EXE_gnss-twin");

/// A static scene of `duration_s`, as short as 20 ms, so that a command takes a moment.
pub fn scene(duration_s: f64, seed: u64) -> String {
    format!(
        "name = \"tiny\"\nstart = 2010-07-01T08:05:58\nduration_s = {duration_s}\nseed = {seed}\n[motion]\n\
         kind = \"static\"\nlatitude_deg = 26.5\nlongitude_deg = 80.2\nheight_m = 130\n[front_end]\n\
         sample_rate_hz = 2.6e6\nformat = \"ci8\"\n[power]\ncn0_dbhz = 45\n[noise]\n"
    )
}

/// A study of modelled correlations of `signal_s` seconds, in two cells.
pub fn modelled(signal_s: f64) -> String {
    format!(
        "name = \"modelled\"\nlevel = \"correlator\"\nseed = 9\nrepetitions = 2\nkeep = \
         [\"phase_sigma_deg\", \"held\"]\n\
         [measure]\nsettle_s = 0.1\nduration_s = {signal_s}\n[[axis]]\nkey = \"signal.cn0_dbhz\"\nvalues = [36, 45]\n"
    )
}

const SAMPLED: &str = "name = \"sampled\"\nlevel = \"samples\"\nscenario = \"tiny.toml\"\nseed = 9\nrepetitions = 1\n\
                       keep = [\"satellites.in_view\"]\n[[axis]]\nkey = \"power.cn0_dbhz\"\nvalues = [36, 45]\n";

/// Files below a directory by their path.
pub type Files = BTreeMap<String, Vec<u8>>;

/// A command and what it works on.
#[derive(Clone)]
pub struct Task {
    pub name: &'static str,
    pub arguments: Vec<String>,
    /// The directory that it starts from.
    pub before: PathBuf,
    /// Files in the directory before the task and after it.
    pub old: Files,
    pub new: Files,
    /// Output on standard output, if that is the task's result.
    pub printed: Option<Vec<u8>>,
    /// A directory of results that replaces another one as a whole.
    pub whole: Option<&'static str>,
    /// The exit code with which it has done its work: 3 for a reception, as these recordings are too short
    /// for a fix.
    pub done: i32,
}

/// The tasks, in a directory that lives as long as they do.
pub struct Bench {
    pub place: tempfile::TempDir,
    pub tasks: Vec<Task>,
}

pub fn twin(arguments: &[String], directory: &Path) -> Command {
    let mut command = Command::new(TWIN);
    command.args(arguments).current_dir(directory).stdin(Stdio::null()).env_remove("RUST_BACKTRACE");
    command
}

fn words(text: &str) -> Vec<String> {
    text.split(' ').map(str::to_owned).collect()
}

fn good(text: &str, directory: &Path) {
    ends(0, text, directory);
}

fn ends(code: i32, text: &str, directory: &Path) {
    let output = twin(&words(text), directory).output().unwrap();
    assert_eq!(output.status.code(), Some(code), "{text}: {}", String::from_utf8_lossy(&output.stderr));
}

/// Two entries of one scene.
const PACK: &str = "name = \"small\"\ntitle = \"Small\"\nsource = \"this test\"\nlicence = \"MIT\"\n[[entry]]\nname = \
                    \"a\"\ngroup = \"g\"\ndescription = \"d\"\nscene = \"tiny.toml\"\nverdict = \"any\"\nreason = \
                    \"short\"\n[[entry]]\nname = \"b\"\ngroup = \"g\"\ndescription = \"d\"\nscene = \"tiny.toml\"\n\
                    verdict = \"any\"\nreason = \"short\"\nset.seed = 2\n";

impl Bench {
    /// A bench with the named tasks.
    pub fn new(names: &[&'static str]) -> Self {
        let place = tempfile::tempdir().unwrap();
        let mut bench = Self { place, tasks: Vec::new() };
        for name in names {
            let task = bench.task(name);
            bench.tasks.push(task);
        }
        bench
    }

    fn task(&self, name: &'static str) -> Task {
        let home = self.place.path().join(name.replace(' ', "-"));
        let before = home.join("before");
        fs::create_dir_all(&before).unwrap();
        let at = |file: &str| before.join(file);
        let duration_s = match name {
            "run" | "analyze" => 0.05,
            "receive" => 0.01,
            _ => 0.02,
        };
        fs::write(at("tiny.toml"), scene(duration_s, 1)).unwrap();
        let mut whole = None;
        let command = match name {
            "plan" => "plan tiny.toml",
            "plan a ride" | "plan with maps" => {
                let scenarios = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenarios");
                let files: &[&str] = if name == "plan a ride" {
                    &["trajectory_file.toml", "ride.csv"]
                } else {
                    &["ionex.toml", "igrg3380.10i.gz"]
                };
                for file in files {
                    fs::copy(scenarios.join(file), at(file)).unwrap();
                }
                if name == "plan a ride" { "plan trajectory_file.toml" } else { "plan ionex.toml" }
            }
            "generate again" => {
                // Over another seed's samples.
                good("generate tiny.toml --out s.sigmf-data --seed 7", &before);
                whole = Some("s.truth");
                "generate tiny.toml --out s.sigmf-data --threads 2"
            }
            "generate" => "generate tiny.toml --out s.sigmf-data --threads 2",
            "receive" | "receive with a search" => {
                if name != "receive" {
                    fs::write(at("tiny.toml"), scene(0.06, 1)).unwrap();
                }
                // Over the results of another recording.
                fs::write(at("other.toml"), scene(0.03, 2)).unwrap();
                good("generate other.toml --out rec.sigmf-data", &before);
                ends(NO_FIX, "receive rec.sigmf-data --out rx", &before);
                good("generate tiny.toml --out rec.sigmf-data", &before);
                whole = Some("rx");
                "receive rec.sigmf-data --out rx --threads 2"
            }
            "run" => "run tiny.toml --out r --threads 2",
            "analyze" => {
                good("run tiny.toml --out r", &before);
                for entry in fs::read_dir(at("r")).unwrap().flatten() {
                    let name = entry.file_name();
                    if !["truth", "rx", "psd.csv", "peaks.csv", "speed.json", "scenario.toml"]
                        .iter()
                        .any(|kept| name == *kept)
                    {
                        fs::remove_file(entry.path()).unwrap();
                    }
                }
                "analyze r"
            }
            "study plan" | "study run" | "study merge" | "study report" | "study status" => {
                fs::write(at("study.toml"), modelled(0.3)).unwrap();
                if name != "study plan" {
                    good("study plan study.toml -o lab --shards 2", &before);
                }
                if !["study plan", "study run"].contains(&name) {
                    good("study run lab", &before);
                }
                match name {
                    "study plan" => "study plan study.toml -o lab --shards 2",
                    "study run" => "study run lab --jobs 2",
                    "study status" => "study status lab",
                    "study merge" => "study merge lab -o m.csv",
                    _ => "study report lab",
                }
            }
            "study run of samples" => {
                fs::write(at("study.toml"), SAMPLED).unwrap();
                good("study plan study.toml -o lab --shards 2", &before);
                "study run lab --jobs 2"
            }
            "pack run" => {
                fs::create_dir(at("small")).unwrap();
                fs::copy(at("tiny.toml"), at("small/tiny.toml")).unwrap();
                fs::write(at("small/pack.toml"), PACK).unwrap();
                "pack run small --out res --threads 2"
            }
            other => panic!("no task {other}"),
        };
        let after = home.join("after");
        copy(&before, &after);
        let arguments = words(command);
        let output = twin(&arguments, &after).output().unwrap();
        let done = if name.starts_with("receive") { NO_FIX } else { 0 };
        assert_eq!(output.status.code(), Some(done), "{command}: {}", String::from_utf8_lossy(&output.stderr));
        let printed = (name.starts_with("plan") || name == "study status").then_some(output.stdout);
        Task { name, arguments, old: files(&before), new: files(&after), before, printed, whole, done }
    }
}

/// End of a task's run.
pub struct Ended {
    /// Exit code, or 128 and the signal.
    pub code: i32,
    pub stdout: Vec<u8>,
    pub message: String,
}

impl From<Output> for Ended {
    fn from(output: Output) -> Self {
        let code = output.status.code().unwrap_or_else(|| 128 + output.status.signal().unwrap_or(0));
        Self { code, stdout: output.stdout, message: String::from_utf8_lossy(&output.stderr).into_owned() }
    }
}

impl Task {
    /// A fresh copy of where it starts.
    pub fn workplace(&self) -> tempfile::TempDir {
        let place = tempfile::tempdir().unwrap();
        copy(&self.before, place.path());
        place
    }

    pub fn run(&self, place: &Path) -> Ended {
        self.ended(twin(&self.arguments, place).output().unwrap())
    }

    /// End of a run of the task, with 0 as the code of a run that has done its work.
    pub fn ended(&self, output: Output) -> Ended {
        let ended = Ended::from(output);
        Ended { code: if ended.code == self.done { 0 } else { ended.code }, ..ended }
    }

    /// Checks that all files are complete and right.
    pub fn complete(&self, place: &Path, ended: &Ended) -> Result<(), String> {
        let found = files(place);
        if let Some(name) = self.new.keys().find(|name| !found.contains_key(*name)) {
            return Err(format!("{name} is missing"));
        }
        self.sound(&found)?;
        if let Some((name, _)) = self.new.iter().find(|(name, bytes)| found.get(*name) != Some(bytes)) {
            return Err(format!("{name} is not the new one"));
        }
        match &self.printed {
            Some(printed) if *printed != ended.stdout => Err("other words on standard output".to_owned()),
            _ => Ok(()),
        }
    }

    /// Checks that every file with its final name is the old or the new one, and that nothing was mixed.
    pub fn sound(&self, found: &Files) -> Result<(), String> {
        for (name, bytes) in found.iter().filter(|(name, _)| !is_left_over(name)) {
            if self.new.get(name) != Some(bytes) && self.old.get(name) != Some(bytes) {
                return Err(format!("{name}: {} bytes that are neither the old nor the new ones", bytes.len()));
            }
        }
        if let Some(whole) = self.whole {
            let inside = |files: &Files| -> Files {
                files
                    .iter()
                    .filter(|(name, _)| name.starts_with(&format!("{whole}/")))
                    .map(|(name, bytes)| (name.clone(), bytes.clone()))
                    .collect()
            };
            let there = inside(found);
            if !there.is_empty() && there != inside(&self.old) && there != inside(&self.new) {
                return Err(format!("{whole} is neither the old nor the new directory"));
            }
        }
        Ok(())
    }
}

/// True if a path is that of an unfinished output.
pub fn is_left_over(name: &str) -> bool {
    name.split('/').any(|part| part.ends_with(".part") || part.ends_with(".old") || part.starts_with(".tmp"))
}

/// Names in the making.
pub fn left_over(found: &Files) -> Vec<String> {
    found.keys().filter(|name| is_left_over(name)).cloned().collect()
}

/// Files below a directory; empty directories end with a slash. Files about the speed of a run are left out.
pub fn files(directory: &Path) -> Files {
    let mut found = Files::new();
    gather(directory, "", &mut found);
    found
}

fn gather(directory: &Path, prefix: &str, found: &mut Files) {
    let Ok(entries) = fs::read_dir(directory) else { return };
    for entry in entries.flatten() {
        let name = format!("{prefix}{}", entry.file_name().to_string_lossy());
        if entry.file_type().is_ok_and(|kind| kind.is_dir()) {
            let before = found.len();
            gather(&entry.path(), &format!("{name}/"), found);
            if found.len() == before && is_left_over(&name) {
                found.insert(format!("{name}/"), Vec::new());
            }
        } else if let Ok(bytes) = fs::read(entry.path()) {
            found.insert(name.clone(), lasting(&name, bytes));
        }
    }
}

/// The bytes that do not depend on how fast the machine was.
fn lasting(name: &str, bytes: Vec<u8>) -> Vec<u8> {
    if is_left_over(name) || name.starts_with("lab/") {
        return bytes;
    }
    match name.rsplit('/').next() {
        Some("speed.json" | "times.csv") => b"speed".to_vec(),
        // Whole from its first to its last line.
        Some("report.pdf") if bytes.starts_with(b"%PDF-") && bytes.trim_ascii_end().ends_with(b"%%EOF") => {
            b"report".to_vec()
        }
        Some("report.html") if bytes.starts_with(b"<!DOCTYPE html>") && bytes.ends_with(b"</html>\n") => {
            b"report".to_vec()
        }
        Some("summary.json") => match serde_json::from_slice::<serde_json::Value>(&bytes) {
            Ok(mut summary) => {
                summary.as_object_mut().map(|fields| fields.remove("speed"));
                summary.to_string().into_bytes()
            }
            Err(_) => bytes,
        },
        _ => bytes,
    }
}

/// Copies what stands below a directory.
pub fn copy(from: &Path, to: &Path) {
    fs::create_dir_all(to).unwrap();
    for entry in fs::read_dir(from).unwrap().flatten() {
        let target = to.join(entry.file_name());
        if entry.file_type().unwrap().is_dir() {
            copy(&entry.path(), &target)
        } else {
            fs::copy(entry.path(), target).map(|_| ()).unwrap()
        }
    }
}
