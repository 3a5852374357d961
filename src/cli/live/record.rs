//! The record of a live run: what came in, what each tick became, what was switched, the truth, and the
//! scenario that sends it all again.
//!
//! A record grows in `DIR.unfinished`. Its scenario is brought up to what is written every second, so that a
//! killed run leaves a record that replays; the next run gives it another name.

use std::fs::{self, File};
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use sha2::{Digest, Sha256};

use crate::cli::error::CliError;
use crate::cli::run::truth_error;
use crate::cli::scenario::{self, Named};
use crate::cli::staging::InSight;
use generator::event::{self, Event};
use generator::scenario::Overrides;
use generator::scene::Scene;
use generator::truth;
use generator::vehicle::grown::Grown;
use generator::vehicle::joining::Push;
use generator::vehicle::log;
use live::drive::Made;

/// Error of a record that cannot be written.
fn failed(error: &std::io::Error) -> CliError {
    CliError::output("the record", error)
}

/// Time between two states of a record that replay.
const KEPT: Duration = Duration::from_secs(1);
/// Bytes of rows that wait to be written: more than come within that time at 1000 ticks a second.
const ROWS_BYTES: usize = 1 << 20;
/// Scenario that replays a record.
const REPLAY: &str = "replay.toml";

/// Scene of a run, with the changes of the command line.
#[derive(Clone, Copy)]
pub struct Run<'a> {
    pub named: &'a Named,
    pub scene: &'a Scene,
    pub overrides: &'a Overrides,
    /// True if the scene starts at another time than it says.
    pub restarted: bool,
}

/// A record in the making.
pub struct Recorder {
    making: InSight,
    target: PathBuf,
    ticks: BufWriter<File>,
    inputs: BufWriter<File>,
    events: BufWriter<File>,
    pub truth: truth::Writer,
    sent: Sha256,
    samples: u64,
    /// Time of the last state that replays.
    kept: Instant,
    /// True if a failure of that was reported.
    is_warned: bool,
}

impl Recorder {
    /// Starts a record of `scene` that will be `target`.
    pub fn create(target: &Path, scene: &Scene) -> Result<Self, CliError> {
        let (making, kept) = InSight::beside(target, REPLAY)?;
        if let Some(kept) = kept {
            scenario::note(&format!("record of an earlier run that was cut off: {}", kept.display()));
        }
        let create = |name: &str| {
            let path = making.path().join(name);
            File::create(&path)
                .map(|file| BufWriter::with_capacity(ROWS_BYTES, file))
                .map_err(|error| CliError::create(path.display(), &error))
        };
        let (mut ticks, mut inputs, mut events) = (create("ticks.csv")?, create("inputs.csv")?, create("events.csv")?);
        let below = making.path().join("truth");
        fs::create_dir(&below).map_err(|error| CliError::create(below.display(), &error))?;
        let truth = truth::Writer::create(&below).map_err(truth_error)?;
        if let Some(first) = scene.trajectory.grown().and_then(|grown| grown.last()) {
            log::begin(&mut ticks, (&first.motion, scene.trajectory.grown().and_then(Grown::last_turn).as_ref()))
                .map_err(|error| failed(&error))?;
        }
        writeln!(
            inputs,
            "sample,taken,t_s,x_m,y_m,z_m,vx_mps,vy_mps,vz_mps,ax_mps2,ay_mps2,az_mps2,jx_mps3,jy_mps3,jz_mps3,\
             yaw_rad,pitch_rad,roll_rad,yaw_radps,pitch_radps,roll_radps"
        )
        .and_then(|()| writeln!(events, "{}", event::HEADER))
        .map_err(|error| failed(&error))?;
        let target = target.to_owned();
        let kept = Instant::now();
        Ok(Self {
            making,
            target,
            ticks,
            inputs,
            events,
            truth,
            sent: Sha256::new(),
            samples: 0,
            kept,
            is_warned: false,
        })
    }

    /// Removes a record of a run that did not begin.
    pub fn discard(&self) {
        // What cannot be removed is replaced by the next record of that name.
        let _ = fs::remove_dir_all(self.making.path());
    }

    /// Writes out what came so far, and the scenario that replays it, if the last time was long enough ago.
    pub fn keep(&mut self, run: &Run<'_>) -> Result<(), CliError> {
        if self.samples == 0 || self.kept.elapsed() < KEPT {
            return Ok(());
        }
        self.kept = Instant::now();
        self.flush()?;
        let text = replay(run, self.samples)?;
        let kept = self.write("scenario.toml", &run.named.text).and_then(|()| self.write(REPLAY, &text));
        // The run goes on, and the next second tries again; at the end it is an error.
        if let Err(error) = kept
            && !std::mem::replace(&mut self.is_warned, true)
        {
            scenario::warn("the record would not replay if the run were killed now");
            error.print();
        }
        Ok(())
    }

    fn flush(&mut self) -> Result<(), CliError> {
        let mut outputs = [&mut self.ticks, &mut self.inputs, &mut self.events].into_iter();
        outputs.try_for_each(Write::flush).map_err(|error| failed(&error))
    }

    /// Writes a file in one step, so that it is whole at any moment.
    fn write(&self, name: &str, text: &str) -> Result<(), CliError> {
        let path = self.making.path().join(name);
        let part = path.with_extension("part");
        let written = fs::write(&part, text).and_then(|()| fs::rename(&part, &path));
        written.map_err(|error| CliError::output(path.display(), &error))
    }

    /// A push that came before the tick that begins at `sample`, and whether it was taken.
    pub fn push(&mut self, sample: u64, taken: bool, push: &Push) -> Result<(), CliError> {
        let rates = [push.velocity_mps, push.acceleration_mps2, push.jerk_mps3];
        let mut row = format!("{sample},{},{:?}", u8::from(taken), push.t_s);
        push.position_m.iter().for_each(|value| row += &format!(",{value:?}"));
        for rate in rates {
            match rate {
                Some(rate) => rate.iter().for_each(|value| row += &format!(",{value:?}")),
                None => row += ",,,",
            }
        }
        let turn = push.turn;
        for angles in [turn.map(|turn| turn.angles_rad), turn.and_then(|turn| turn.rates_radps)] {
            match angles {
                Some(angles) => angles.iter().for_each(|value| row += &format!(",{value:?}")),
                None => row += ",,,",
            }
        }
        writeln!(self.inputs, "{row}").map_err(|error| failed(&error))
    }

    /// An event that was applied at `sample`.
    pub fn event(&mut self, sample: u64, event: &Event) -> Result<(), CliError> {
        writeln!(self.events, "{sample},{event}").and_then(|()| self.events.flush()).map_err(|error| failed(&error))
    }

    /// A tick and the bytes of its samples.
    pub fn tick(&mut self, made: &Made, bytes: &[u8], sample_bytes: usize) -> Result<(), CliError> {
        self.sent.update(bytes);
        self.samples += (bytes.len() / sample_bytes.max(1)) as u64;
        match &made.tick {
            Some(tick) => log::write(&mut self.ticks, made.samples.1, tick).map_err(|error| failed(&error)),
            None => Ok(()),
        }
    }

    /// Ends the record with a summary, the scenario as it was run and the one that replays it.
    pub fn finish(mut self, run: &Run<'_>, summary: serde_json::Value) -> Result<(), CliError> {
        let digest = std::mem::take(&mut self.sent).finalize();
        let sha256: String = digest.iter().map(|byte| format!("{byte:02x}")).collect();
        self.flush()?;
        let mut summary = summary;
        if let Some(object) = summary.as_object_mut() {
            object.insert("start".to_owned(), run.scene.clock.start.to_string().into());
            object.insert("samples".to_owned(), self.samples.into());
            object.insert("sha256".to_owned(), sha256.into());
        }
        let mut text = serde_json::to_string_pretty(&summary).map_err(CliError::bug)?;
        text.push('\n');
        // Not summary.json, which the judge of a record with rx/ writes.
        self.write("live.json", &text)?;
        self.write("scenario.toml", &run.named.text)?;
        self.write(REPLAY, &replay(run, self.samples)?)?;
        drop(self.truth);
        let target = self.target;
        self.making.commit()?;
        scenario::note(&format!("record in {}", target.display()));
        Ok(())
    }
}

/// The scenario with what was sent in place of what was pushed. Files that it names are named from the root.
fn replay(run: &Run<'_>, samples: u64) -> Result<String, CliError> {
    let Run { named, scene, overrides, restarted } = *run;
    let mut root: toml::Table = toml::from_str(&named.text).map_err(CliError::bug)?;
    let directory = named.directory.canonicalize().unwrap_or_else(|_| named.directory.clone());
    root.iter_mut().for_each(|(_, value)| rooted(value, &directory));
    let rate = scene.clock.rate;
    root.insert("duration_s".to_owned(), rate.elapsed_s(samples).into());
    if restarted {
        root.insert("start".to_owned(), scene.clock.start.to_string().into());
    }
    if let Some(seed) = overrides.seed {
        root.insert("seed".to_owned(), toml::Value::Integer(seed as i64));
    }
    if let Some(tick_samples) = scene.trajectory.tick_samples() {
        let motion = [
            ("kind", "ticks".into()),
            ("file", "ticks.csv".into()),
            ("events", "events.csv".into()),
            ("tick_s", toml::Value::Float(rate.elapsed_s(tick_samples))),
        ];
        let motion = motion.into_iter().map(|(key, value)| (key.to_owned(), value)).collect();
        root.insert("motion".to_owned(), toml::Value::Table(motion));
    }
    let own = match root.remove("front_end") {
        Some(toml::Value::Array(many)) => {
            let name = |one: &toml::Value| one.get("name").and_then(toml::Value::as_str).map(str::to_owned);
            many.into_iter().find(|one| name(one) == scene.front_end_name)
        }
        one => one,
    };
    let mut front_end = own.and_then(|own| own.as_table().cloned()).unwrap_or_default();
    if let Some(format) = overrides.format {
        front_end.insert("format".to_owned(), format.to_string().into());
    }
    if !front_end.is_empty() {
        root.insert("front_end".to_owned(), toml::Value::Table(front_end));
    }
    toml::to_string(&root).map_err(CliError::bug)
}

/// Makes every text that is a path from `directory` one from the root.
fn rooted(value: &mut toml::Value, directory: &Path) {
    match value {
        toml::Value::String(text) if text.contains(['.', '/']) => {
            let path = directory.join(&*text);
            if path.is_file() {
                *text = path.display().to_string();
            }
        }
        toml::Value::Array(many) => many.iter_mut().for_each(|value| rooted(value, directory)),
        toml::Value::Table(table) => table.iter_mut().for_each(|(_, value)| rooted(value, directory)),
        _ => {}
    }
}
