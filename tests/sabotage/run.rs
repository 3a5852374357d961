//! The runs that are damaged, made once, and a copy of one whose receiver's tables can be edited.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::OnceLock;

use tempfile::TempDir;

use crate::table::Table;

/// Scene of a run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Scene {
    AtRest,
    InMotion,
    /// Receiver at rest; the scene says that errors may have any size up to a bound.
    Bounded,
    /// Receiver at rest, GPS and Galileo.
    TwoSystems,
    /// Receiver at rest, NavIC on L5 and L1.
    TwoBands,
    /// Receiver at rest that verifies Galileo's authentication.
    Verified,
    /// Receiver at rest elsewhere, before the ionosphere's parameters come.
    Early,
}

struct Made {
    _directory: Option<TempDir>,
    run: PathBuf,
}

/// Runs a scenario, or takes the run of that name in the directory `GNSS_TWIN_SABOTAGE_RUNS`, to look at
/// other receivers' runs.
fn make(slot: &'static OnceLock<Made>, name: &str, scenario: &str) -> &'static Path {
    let made = slot.get_or_init(|| {
        if let Some(runs) = std::env::var_os("GNSS_TWIN_SABOTAGE_RUNS") {
            return Made { _directory: None, run: Path::new(&runs).join(name) };
        }
        let directory = tempfile::tempdir().unwrap();
        let file = directory.path().join("scene.toml");
        fs::write(&file, scenario).unwrap();
        let run = directory.path().join("run");
        let output = Command::new(env!("CARGO_BIN_EXE_gnss-twin"))
            .args(["run".as_ref(), file.as_os_str(), "--out".as_ref(), run.as_os_str(), "--allow-outside".as_ref()])
            .output()
            .unwrap();
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        Made { _directory: Some(directory), run }
    });
    &made.run
}

const STATIC: &str = include_str!("../../scenarios/static.toml");

/// The shipped static scene.
pub fn at_rest() -> &'static Path {
    static RUN: OnceLock<Made> = OnceLock::new();
    make(&RUN, "rest", STATIC)
}

/// The first minute of the shipped car ride, so that places and velocities of other epochs differ.
pub fn in_motion() -> &'static Path {
    static RUN: OnceLock<Made> = OnceLock::new();
    let scene = include_str!("../../scenarios/moderate.toml");
    make(&RUN, "motion", &scene.replace("duration_s = 90", "duration_s = 60"))
}

/// The first fifty seconds of the shipped scene of two systems.
pub fn two_systems() -> &'static Path {
    static RUN: OnceLock<Made> = OnceLock::new();
    let scene = include_str!("../../scenarios/two_systems.toml");
    make(&RUN, "two_systems", &scene.replace("duration_s = 60", "duration_s = 50"))
}

/// The first fifty seconds of the shipped scene of NavIC's two bands.
fn two_bands() -> &'static Path {
    static RUN: OnceLock<Made> = OnceLock::new();
    let scene = include_str!("../../scenarios/navic_two_bands.toml");
    let beside = concat!("file = \"", env!("CARGO_MANIFEST_DIR"), "/scenarios/navic_");
    make(&RUN, "two_bands", &scene.replace("duration_s = 70", "duration_s = 50").replace("file = \"navic_", beside))
}

/// The shipped scene of Galileo.
pub fn galileo() -> &'static Path {
    static RUN: OnceLock<Made> = OnceLock::new();
    make(&RUN, "galileo", include_str!("../../scenarios/galileo.toml"))
}

/// Satellite with a fault of its message in the scene with authentication.
pub const FORGED: &str = "E07";

/// Scene of Galileo with authenticated messages and a receiver that verifies them from a hot start. One
/// satellite states another accuracy than was signed.
fn verified() -> &'static Path {
    static RUN: OnceLock<Made> = OnceLock::new();
    let more = format!(
        "\n[osnma]\n[receiver.osnma]\n[fidelity]\nlevel = \"correlations\"\n[[message_fault]]\n\
         kind = \"parameter\"\nsatellites = [\"{FORGED}\"]\nparameter = \"sisa_index\"\nadd = 1\n"
    );
    let scene = include_str!("../../scenarios/galileo.toml").replace("duration_s = 60", "duration_s = 150");
    make(&RUN, "verified", &(scene + &more))
}

/// The shipped street between two walls.
pub fn urban() -> &'static Path {
    static RUN: OnceLock<Made> = OnceLock::new();
    make(&RUN, "urban", include_str!("../../scenarios/urban.toml"))
}

/// Run at another place, seed and start, without page 18 in time.
pub fn elsewhere() -> &'static Path {
    static RUN: OnceLock<Made> = OnceLock::new();
    let scene = STATIC
        .replace("seed = 1", "seed = 77")
        .replace("08:05:58", "11:38:17")
        .replace("latitude_deg = 26.5123", "latitude_deg = -33.9")
        .replace("longitude_deg = 80.2329", "longitude_deg = 18.4")
        .replace("require_ionosphere = true", "require_ionosphere = false");
    make(&RUN, "elsewhere", &scene)
}

/// A copy of a run, the receiver's tables in memory as they are asked for.
pub struct Rx {
    from: PathBuf,
    to: PathBuf,
    tables: BTreeMap<&'static str, Table>,
    receiver: Option<serde_json::Value>,
    psd: Option<Table>,
    texts: BTreeMap<&'static str, String>,
    /// True if files that repeat the tables' values are left out. The tolerances of a table do not fit them.
    alone: bool,
}

impl Rx {
    /// Everything but `rx/` is linked.
    pub fn copy(scene: Scene, to: &Path) -> Self {
        let from = match scene {
            Scene::AtRest | Scene::Bounded => at_rest(),
            Scene::InMotion => in_motion(),
            Scene::TwoSystems => two_systems(),
            Scene::TwoBands => two_bands(),
            Scene::Early => elsewhere(),
            Scene::Verified => verified(),
        };
        for name in ["truth", "rx"] {
            fs::create_dir(to.join(name)).unwrap();
        }
        for entry in fs::read_dir(from.join("truth")).unwrap() {
            let entry = entry.unwrap();
            link(&entry.path(), &to.join("truth").join(entry.file_name()));
        }
        if scene == Scene::Bounded {
            declare(&from.join("truth/scene.json"), &to.join("truth/scene.json"));
        }
        for name in ["psd.csv", "speed.json", "scenario.toml"] {
            link(&from.join(name), &to.join(name));
        }
        Self {
            alone: scene == Scene::Bounded,
            from: from.to_owned(),
            to: to.to_owned(),
            tables: BTreeMap::new(),
            receiver: None,
            psd: None,
            texts: BTreeMap::new(),
        }
    }

    /// A table to edit.
    pub fn table(&mut self, name: &'static str) -> &mut Table {
        let path = self.from.join(format!("rx/{name}.csv"));
        self.tables.entry(name).or_insert_with(|| Table::read(&path))
    }

    /// A text file to edit.
    pub fn text(&mut self, name: &'static str) -> &mut String {
        let path = self.from.join("rx").join(name);
        self.texts.entry(name).or_insert_with(|| fs::read_to_string(path).unwrap())
    }

    /// `receiver.json` to edit.
    pub fn receiver(&mut self) -> &mut serde_json::Value {
        let path = self.from.join("rx/receiver.json");
        self.receiver.get_or_insert_with(|| serde_json::from_str(&fs::read_to_string(path).unwrap()).unwrap())
    }

    /// A table of the truth to read.
    pub fn truth(&self, name: &str) -> Table {
        Table::read(&self.from.join(format!("truth/{name}.csv")))
    }

    /// Adds a file that the receiver did not write.
    pub fn add(&self, name: &str, text: &str) {
        fs::write(self.to.join("rx").join(name), text).unwrap();
    }

    /// The spectrum of the samples to edit.
    pub fn psd(&mut self) -> &mut Table {
        let path = self.from.join("psd.csv");
        self.psd.get_or_insert_with(|| Table::read(&path))
    }

    /// Samples a second.
    pub fn rate_hz(&self) -> f64 {
        2.6e6
    }

    /// Writes what was edited and links the rest.
    pub fn write(&self) {
        if let Some(psd) = &self.psd {
            // Written again: what is there is a link to the run's own.
            fs::remove_file(self.to.join("psd.csv")).unwrap();
            psd.write(&self.to.join("psd.csv"));
        }
        for entry in fs::read_dir(self.from.join("rx")).unwrap() {
            let entry = entry.unwrap();
            let target = self.to.join("rx").join(entry.file_name());
            let name = entry.file_name().into_string().unwrap();
            if self.alone && ["observations.rnx", "fixes.nmea"].contains(&name.as_str()) {
                continue;
            }
            match (name.strip_suffix(".csv").and_then(|stem| self.tables.get(stem)), &self.receiver) {
                (Some(table), _) => table.write(&target),
                (None, Some(receiver)) if name == "receiver.json" => fs::write(&target, receiver.to_string()).unwrap(),
                _ => match self.texts.get(name.as_str()) {
                    Some(text) => fs::write(&target, text).unwrap(),
                    None => link(&entry.path(), &target),
                },
            }
        }
    }
}

/// Metres that a bounded scene allows fixes to be off.
pub const BOUND_M: f64 = 20.0;

/// Copies the facts of a scene and declares in the copy what errors it allows.
fn declare(from: &Path, to: &Path) {
    let mut facts: serde_json::Value = serde_json::from_slice(&fs::read(from).unwrap()).unwrap();
    facts["expect"] = serde_json::json!({"whole": {"errors": "any", "position_within_m": BOUND_M, "reason": "walls"}, "intervals": []});
    fs::remove_file(to).unwrap();
    fs::write(to, facts.to_string()).unwrap();
}

fn link(from: &Path, to: &Path) {
    if from.exists() {
        fs::hard_link(from, to).or_else(|_| fs::copy(from, to).map(drop)).unwrap();
    }
}
