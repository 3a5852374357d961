//! Everything that a run wrote, read once.
//!
//! Truth and estimate are CSV files of the rows in [`gnss::record`]; the scene and the receiver's
//! settings are JSON. Tables with a row for every satellite of every epoch go to spill stores, grouped by
//! satellite, those with a row an epoch to spilled tables; shorter ones stay in memory.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::common::Common;
use super::emission::{self, Emission, MeanSignal};
use super::files::{believable, each, each_of_any, json, missing, optional, rows, text};
use crate::error::JudgeError;
use crate::read::derived::Derived;
use crate::read::detection::Test;
use crate::read::fixes::Fixes;
use crate::read::levels::{LevelFinder, Levels};
use crate::read::protection::Level;
use crate::read::spill_store::SpillStore;
use crate::read::table::Table;
use crate::statistics::{mean, median};
use crate::waveform::Sampler;
use gnss::facts::{FrontEndFacts, SceneFacts};
use gnss::record::{
    AcquisitionRow, ClockRow, DetectionRow, EventRow, Fix, IntegrityRow, InterferenceRow, IonosphereRow, LineRow,
    NavigationRow, Observation, RayRow, SkyRow, TrackingRow, TrajectoryRow,
};
use gnss::satellite::Sv;
use gnss::signal::described::registered;
use gnss::signal::{Link, Signal, all, by_name};

/// Speed of the stages: `speed.json`, and the section of the summary.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Speed {
    /// Seconds of signal that the generator made in a second.
    pub generate_x_real_time: Option<f64>,
    /// Seconds of signal that the receiver took in a second.
    pub receive_x_real_time: Option<f64>,
    /// Seconds of signal that both did in a second, side by side.
    pub run_x_real_time: Option<f64>,
    /// Time of all processors, seconds.
    pub cpu_s: Option<f64>,
    /// Largest memory of the process, MiB.
    pub peak_memory_mib: Option<f64>,
}

/// Name of the file with the spectrum of the first front end, or of a later one by its name.
pub fn psd_name(later: Option<&str>) -> String {
    later.map_or_else(|| "psd.csv".to_owned(), |name| format!("psd-{name}.csv"))
}

/// One point of `psd.csv`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct PsdRow {
    /// Frequency in the samples (0 is `center_hz`).
    pub frequency_hz: f64,
    /// Decibels of LSB²/Hz.
    pub density_db: f64,
}

/// Correlation of a signal in the samples with its code at one delay: a row of `peaks.csv`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct PeakRow {
    /// Number of the sample, of the first front end, from which on the samples were looked at.
    pub sample: u64,
    /// The satellite.
    pub sv: Sv,
    /// Signal of the satellite.
    #[serde(with = "by_name")]
    pub signal: &'static Signal,
    /// Delay of the code against the true one, in chips.
    pub delay_chips: f64,
    /// Part in phase with the prompt, against the largest magnitude of all delays.
    pub in_phase: f64,
    /// Part a quarter of a cycle ahead of the prompt, in the same measure.
    pub quadrature: f64,
}

/// A run as read.
pub struct Run {
    /// Facts of the scene.
    pub scene: SceneFacts,
    /// The whole of `truth/scene.json`.
    pub scene_json: Value,
    /// The scene as it was written, where the run kept it.
    pub scenario: Option<String>,
    /// True observations.
    pub truth: SpillStore<Link, Observation>,
    /// Directions of the satellites, and the delays of their signals.
    pub sky: SpillStore<Link, SkyRow>,
    /// The truth's signals.
    pub signals: BTreeSet<&'static Signal>,
    /// Satellites in the truth's first epoch.
    pub in_view_at_start: BTreeSet<Sv>,
    /// Sum of C/N0 at a sample over the satellites that send a signal on the same carrier.
    pub cn0_sums_hz: Levels<Emission>,
    /// C/N0 of a signal's strongest satellite at a sample.
    pub cn0_most_hz: Levels<&'static Signal>,
    /// Common errors of the satellites' carriers and of the front end besides the clock.
    pub common: Common,
    /// Largest delays of the atmosphere.
    pub ionosphere_m: f64,
    /// Largest delay of the troposphere, metres.
    pub troposphere_m: f64,
    /// The mean of each satellite's true signal.
    pub expected: Vec<MeanSignal>,
    /// Reflected rays; none in a scene without multipath.
    pub rays: SpillStore<Link, RayRow>,
    /// The antenna's true positions.
    pub trajectory: Table<TrajectoryRow>,
    /// Usual time between them.
    truth_interval_s: f64,
    /// Parameters as sent.
    pub truth_navigation: Vec<NavigationRow>,
    /// Empty without interference.
    pub interference: Vec<InterferenceRow>,
    /// Trajectory that the first spoofer claims; empty without one.
    pub claimed: Table<TrajectoryRow>,
    /// Signals that a search cannot tell from one of the truth, on the same carrier with the same code, by
    /// whose name they count: until its message says who a satellite is, a receiver takes either name.
    pub alike: BTreeMap<Link, Sv>,
    /// Directory of the truth's tables.
    pub(super) truth_place: PathBuf,
    /// Directory of the receiver's tables; `None` for a truth alone.
    pub rx: Option<PathBuf>,
    /// The receiver's observations.
    pub observations: SpillStore<Link, Observation>,
    /// The receiver's fixes.
    pub fixes: Fixes,
    /// Results of the receiver's search.
    pub acquisition: Vec<AcquisitionRow>,
    /// Updates of the receiver's loops.
    pub tracking: SpillStore<Link, TrackingRow>,
    /// Median time of the loops' updates.
    pub update_s: Option<f64>,
    /// Index of the front end in which each signal is received.
    pub front_ends: BTreeMap<&'static Signal, usize>,
    /// The ionosphere that it measured with two bands; none without.
    pub ionosphere: SpillStore<Sv, IonosphereRow>,
    /// Protection levels of the fixes; empty of a receiver that states none.
    pub levels: Table<Level>,
    /// Tests of the receiver's detectors of jamming and spoofing; empty of a receiver without them.
    pub tests: Table<Test>,
    /// Satellites and signals of those tests; both empty for a test of the whole receiver.
    pub tested: Vec<[String; 2]>,
    /// Clock of the receiver against each time scale, by the scales' names; empty for a receiver of GPS time
    /// alone.
    pub clocks: SpillStore<&'static str, ClockRow>,
    /// Parameters as it decoded them.
    pub navigation: Vec<NavigationRow>,
    /// Events of the receiver's channels.
    pub events: Vec<EventRow>,
    /// Spectral lines that the receiver reported; `None` for one that does not look for them.
    pub lines: Option<Vec<LineRow>>,
    /// `rx/receiver.json`, or null when there is none.
    pub receiver: Value,
    /// Spectrum of the samples, of several front ends of those of the first; empty where it was not
    /// estimated.
    pub psd: Vec<PsdRow>,
    /// Spectra of the second and later front ends by their indices, as far as they were estimated.
    pub other_psds: BTreeMap<usize, Vec<PsdRow>>,
    /// Correlation peaks of the samples; empty where none were computed.
    pub peaks: Vec<PeakRow>,
    /// Speed of the stages.
    pub speed: Speed,
    /// Values that measures share.
    pub derived: Derived,
}

/// [`Run::alike`] of the truth's signals: of those that are not among them.
fn alike(truth: &[Link]) -> BTreeMap<Link, Sv> {
    let mut found = BTreeMap::new();
    for own in truth.iter().filter(|own| own.channel().is_some()) {
        let others = own.signal.satellites().map(|sv| own.signal.link(sv));
        let absent = others.filter(|other| other.is_alike(*own) && !truth.contains(other));
        found.extend(absent.map(|other| (other, own.sv)));
    }
    found
}

fn named(alike: &BTreeMap<Link, Sv>, link: Link) -> Sv {
    alike.get(&link).copied().unwrap_or(link.sv)
}

pub(super) const TRUTH: &str =
    "the generator writes it: make the run again with `gnss-twin run`, or `gnss-twin generate`";
pub(super) const RECEIVER: &str =
    "the receiver writes it: `gnss-twin receive FILE --out RUN/rx`, or make the run again";

impl Run {
    /// Reads a run's directory. `psd.csv`, `peaks.csv`, `speed.json`, `scenario.toml` and `rx/receiver.json`
    /// may be missing. Tables that are too long for memory spill to an unnamed file there.
    pub fn read(run: &Path) -> Result<Self, JudgeError> {
        Self::read_parts(run, &run.join("truth"), &run.join("rx"))
    }

    /// [`Self::read`] where truth and receiver wrote into directories of their own, so that several receivers
    /// share a truth.
    pub fn read_parts(run: &Path, truth: &Path, rx: &Path) -> Result<Self, JudgeError> {
        let mut read = Self::read_truth_by(truth, run)?;
        read.rx = Some(rx.to_owned());
        read.scenario = text(&run.join("scenario.toml"))?;
        read.truth_navigation = rows(&truth.join("navigation.csv"), TRUTH)?;
        read.observations = observations(&rx.join("observations.csv"), RECEIVER, run, |_| Ok(()))?;
        let fixes = rx.join("fixes.csv");
        each(&fixes, RECEIVER, |line, row: Fix| {
            believable(&fixes, line, row.gps_s)?;
            read.fixes.push(row)
        })?;
        read.alike = alike(&read.truth.keys().collect::<Vec<_>>());
        read.acquisition = rows(&rx.join("acquisition.csv"), RECEIVER)?;
        read.acquisition.iter_mut().for_each(|row| row.sv = named(&read.alike, row.link()));
        let mut updates = Counts::default();
        each(&rx.join("tracking.csv"), RECEIVER, |_, row: TrackingRow| {
            updates.add(row.integration_s);
            let row = TrackingRow { sv: named(&read.alike, row.link()), ..row };
            read.tracking.push(row.link(), &row)
        })?;
        read.update_s = updates.median();
        each_of_any(&rx.join("ionosphere.csv"), |_, row: IonosphereRow| read.ionosphere.push(row.sv, &row))?;
        each_of_any(&rx.join("integrity.csv"), |_, row: IntegrityRow| read.levels.push(row.into()))?;
        each_of_any(&rx.join("detection.csv"), |_, row: DetectionRow| read.take_test(row))?;
        let clocks = rx.join("clocks.csv");
        each_of_any(&clocks, |line, row: ClockRow| {
            // A signal that a program adds may bring a time of its own.
            let scale = all().into_iter().map(|signal| signal.time.name).find(|name| *name == row.time_scale);
            let scale = scale.ok_or_else(|| {
                let what = format!("time_scale = {}: expected one such as GPST, GST, BDT or GLONASST", row.time_scale);
                JudgeError::Line { path: clocks.clone(), line, what }
            })?;
            read.clocks.push(scale, &row)
        })?;
        read.navigation = rows(&rx.join("navigation.csv"), RECEIVER)?;
        read.events = rows(&rx.join("events.csv"), RECEIVER)?;
        read.events.iter_mut().for_each(|row| row.sv = named(&read.alike, row.link()));
        read.lines = match rows(&rx.join("interference.csv"), RECEIVER) {
            Err(JudgeError::Missing { .. }) => None,
            other => Some(other?),
        };
        read.receiver = json(&rx.join("receiver.json"))?.unwrap_or(Value::Null);
        if read.tracking_setting("spacing_chips").is_some() {
            let front_ends = read.receiver.pointer("/front_ends").and_then(Value::as_array);
            let received = |signal: &Signal| {
                let has = |one: &Value| {
                    let names = one.get("signals").and_then(Value::as_array);
                    names.is_some_and(|names| names.iter().any(|name| name.as_str() == Some(signal.name)))
                };
                front_ends.and_then(|all| all.iter().position(has)).unwrap_or(0)
            };
            read.common.set_front_end(&read.scene, &read.receiver, &received);
            read.front_ends = read.signals.iter().map(|&signal| (signal, received(signal))).collect();
        }
        read.psd = optional(&run.join(psd_name(None)))?;
        for (place, front_end) in read.scene.front_ends.iter().enumerate().skip(1) {
            let rows = optional(&run.join(psd_name(front_end.name.as_deref())))?;
            read.other_psds.insert(place, rows);
        }
        read.peaks = optional(&run.join("peaks.csv"))?;
        read.speed = json(&run.join("speed.json"))?.unwrap_or_default();
        Ok(read)
    }

    /// Reads a truth alone, for a receiver that writes files of its own. A signal is received in the front
    /// end whose facts name it.
    pub fn read_truth(truth: &Path) -> Result<Self, JudgeError> {
        // A truth may lie where nothing can be written.
        let mut read = Self::read_truth_by(truth, &std::env::temp_dir())?;
        read.truth_navigation = optional(&truth.join("navigation.csv"))?;
        let place = |signal: &Signal| {
            let has = |one: &FrontEndFacts| one.signals.iter().any(|name| name == signal.name);
            read.scene.front_ends.iter().position(has).unwrap_or(0)
        };
        read.front_ends = read.signals.iter().map(|&signal| (signal, place(signal))).collect();
        read.common.set_front_end(&read.scene, &Value::Null, &place);
        Ok(read)
    }

    fn read_truth_by(truth: &Path, directory: &Path) -> Result<Self, JudgeError> {
        let path = truth.join("scene.json");
        let mut scene: SceneFacts = json(&path)?.ok_or_else(|| missing(&path, TRUTH))?;
        for text in &scene.described_signals {
            // Rows name signals, so they are registered before any is read.
            let refuse = |error| JudgeError::Json { path: path.clone(), source: serde::de::Error::custom(error) };
            registered(text).map_err(refuse)?;
        }
        let own_hz = |place: usize| scene.front_ends.get(place).map_or(0.0, FrontEndFacts::doppler_hz);
        if let Some(other) = (1..scene.front_ends.len()).find(|place| own_hz(*place) != own_hz(0)) {
            let expected = "the offset of the first front end: Dopplers are judged against one of all";
            return Err(JudgeError::Scene { key: "front_end.local_oscillator", value: own_hz(other), expected });
        }
        let (mut cn0_sums_hz, mut cn0_most_hz) = (Levels::new(directory), Levels::new(directory));
        let mut common = Common::new(scene.sample_rate_hz);
        let observed = observations(&truth.join("observations.csv"), TRUTH, directory, |row| {
            let cn0_hz = libm::pow(10.0, row.cn0_dbhz / 10.0);
            cn0_sums_hz.change(row.sample, Emission::of(row.link()), |sum_hz| sum_hz + cn0_hz)?;
            cn0_most_hz.change(row.sample, row.signal, |most_hz| most_hz.max(cn0_hz))?;
            common.add(row);
            Ok(())
        })?;
        cn0_sums_hz.close()?;
        cn0_most_hz.close()?;
        Self::fold(&mut scene, &Emission::all(observed.keys()))?;
        common.set_front_end(&scene, &Value::Null, &|_| 0);
        let (mut ionosphere_m, mut troposphere_m) = (0.0_f64, 0.0_f64);
        let (mut first, mut in_view_at_start) = (u64::MAX, BTreeSet::new());
        let mut sky = SpillStore::new(directory);
        each(&truth.join("sky.csv"), TRUTH, |_, row: SkyRow| {
            if row.sample < first {
                (first, in_view_at_start) = (row.sample, BTreeSet::new());
            }
            ionosphere_m = ionosphere_m.max(row.ionosphere_m.abs());
            troposphere_m = troposphere_m.max(row.troposphere_m.abs());
            if row.sample == first {
                in_view_at_start.insert(row.sv);
            }
            sky.push(row.link(), &row)
        })?;
        let path = truth.join("trajectory.csv");
        let (mut trajectory, mut samples) = (Table::new(directory), Vec::new());
        each(&path, TRUTH, |line, row: TrajectoryRow| {
            believable(&path, line, row.gps_s)?;
            samples.push(row.sample);
            trajectory.push(row)
        })?;
        let time_s = |sample: u64| sample as f64 / scene.sample_rate_hz;
        let steps = samples.windows(2).map(|two| time_s(two[1]) - time_s(two[0]));
        let truth_interval_s = median(&steps.collect::<Vec<_>>()).unwrap_or(0.0);
        let (mut rays, mut claimed) = (SpillStore::new(directory), Table::new(directory));
        each_of_any(&truth.join("rays.csv"), |_, row: RayRow| rays.push(row.link(), &row))?;
        each_of_any(&truth.join("claimed.csv"), |_, row: TrajectoryRow| claimed.push(row))?;
        Ok(Self {
            scene,
            scene_json: json(&truth.join("scene.json"))?.unwrap_or(Value::Null),
            scenario: None,
            expected: emission::means(&observed)?,
            signals: observed.keys().map(|link| link.signal).collect(),
            truth: observed,
            sky,
            in_view_at_start,
            cn0_sums_hz,
            cn0_most_hz,
            common,
            ionosphere_m,
            troposphere_m,
            rays,
            trajectory,
            truth_interval_s,
            truth_navigation: Vec::new(),
            interference: optional(&truth.join("interference.csv"))?,
            claimed,
            alike: BTreeMap::new(),
            truth_place: truth.to_owned(),
            rx: None,
            observations: SpillStore::new(directory),
            fixes: Fixes::new(directory),
            acquisition: Vec::new(),
            tracking: SpillStore::new(directory),
            update_s: None,
            front_ends: BTreeMap::new(),
            ionosphere: SpillStore::new(directory),
            levels: Table::new(directory),
            tests: Table::new(directory),
            tested: Vec::new(),
            clocks: SpillStore::new(directory),
            navigation: Vec::new(),
            events: Vec::new(),
            lines: None,
            receiver: Value::Null,
            psd: Vec::new(),
            other_psds: BTreeMap::new(),
            peaks: Vec::new(),
            speed: Speed::default(),
            derived: Derived::default(),
        })
    }

    /// Adds a row of `detection.csv`.
    fn take_test(&mut self, row: DetectionRow) -> Result<(), JudgeError> {
        let DetectionRow { sample, detector, sv, signal, statistic, threshold, alarm } = row;
        let name = [sv, signal];
        let known = self.tested.iter().position(|own| *own == name);
        let link = known.unwrap_or(self.tested.len()) as u32;
        if known.is_none() {
            self.tested.push(name);
        }
        self.tests.push(Test { sample, detector, link, statistic, threshold, alarm })
    }

    /// Checks that all rows which were looked up by their samples could be read.
    ///
    /// # Errors
    ///
    /// Same as [`SpillStore::sound`].
    pub fn sound(&self) -> Result<(), JudgeError> {
        self.truth.sound()?;
        self.sky.sound()?;
        self.rays.sound()?;
        self.observations.sound()?;
        self.tracking.sound()?;
        self.ionosphere.sound()?;
        self.levels.sound()?;
        self.tests.sound()?;
        self.cn0_sums_hz.sound()?;
        self.cn0_most_hz.sound()?;
        self.trajectory.sound()?;
        self.claimed.sound()?;
        self.fixes.sound()
    }

    /// Seconds from sample 0 by the receiver's clock.
    pub fn time_s(&self, sample: u64) -> f64 {
        sample as f64 / self.scene.sample_rate_hz
    }

    /// Index of the front end in which a signal is received.
    pub fn front_end(&self, signal: &Signal) -> usize {
        self.front_ends.get(signal).copied().unwrap_or(0)
    }

    /// Samples a second of what a signal is received from.
    pub fn rate_hz(&self, signal: &Signal) -> f64 {
        self.scene.stages(self.front_end(signal)).1
    }

    /// Sampler of a front end, by its index among several.
    pub fn sampler(&self, front_end: usize) -> Sampler {
        Sampler::of(&self.scene, front_end)
    }

    /// C/N0 of the strongest satellite at a sample.
    pub fn strongest_dbhz(most_hz: &mut LevelFinder<'_, &'static Signal>, sample: u64, signal: &'static Signal) -> f64 {
        10.0 * libm::log10(most_hz.get(sample, signal).unwrap_or(1.0))
    }

    /// A satellite's signal in words: the satellite alone where the truth has one signal.
    pub fn name(&self, link: Link) -> String {
        if self.signals.iter().all(|signal| *signal == link.signal) { link.sv.to_string() } else { link.to_string() }
    }

    /// Mean wavelength of the truth's carriers.
    pub fn mean_wavelength_m(&self) -> Option<f64> {
        mean(&self.truth.keys().map(Link::wavelength_m).collect::<Vec<_>>())
    }

    /// Usual time between the truth's rows.
    pub fn truth_interval_s(&self) -> f64 {
        self.truth_interval_s
    }

    /// Folds an IF above half the rate of real samples to its alias.
    ///
    /// # Errors
    /// Signals that samples hold in different multiples of half the rate.
    fn fold(scene: &mut SceneFacts, emissions: &BTreeSet<Emission>) -> Result<(), JudgeError> {
        let Some(center_hz) = scene.center_hz.filter(|_| scene.format.starts_with('r')) else { return Ok(()) };
        let sign = |inverted: bool| if inverted { -1.0 } else { 1.0 };
        let if_hz = |emission: &Emission| sign(scene.inverted) * (emission.carrier_hz() - center_hz);
        let turns = |if_hz: f64| (if_hz / scene.sample_rate_hz).round();
        let rest_hz = |if_hz: f64| if_hz - scene.sample_rate_hz * turns(if_hz);
        let all: Vec<f64> = emissions.iter().map(if_hz).collect();
        let (Some(first), Some(&first_hz)) = (emissions.first(), all.first()) else { return Ok(()) };
        if all.iter().all(|if_hz| if_hz.abs() <= 0.5 * scene.sample_rate_hz) {
            return Ok(());
        }
        let mirrored = rest_hz(first_hz) < 0.0;
        if all.iter().any(|&hz| turns(hz) != turns(first_hz) || (rest_hz(hz) < 0.0) != mirrored) {
            let expected = "all signals within the same multiple of half the rate of real samples";
            return Err(JudgeError::Scene { key: "center_hz", value: center_hz, expected });
        }
        let center_hz = first.carrier_hz() - sign(scene.inverted ^ mirrored) * rest_hz(first_hz).abs();
        (scene.inverted, scene.center_hz) = (scene.inverted ^ mirrored, Some(center_hz));
        Ok(())
    }

    /// A number among the receiver's tracking settings, if they name it.
    pub fn tracking_setting(&self, key: &str) -> Option<f64> {
        let settings = self.receiver.get("settings").unwrap_or(&self.receiver);
        settings.get("tracking")?.get(key)?.as_f64()
    }
}

/// Observations in a spill store, each shown to `see`.
fn observations(
    path: &Path,
    remedy: &'static str,
    directory: &Path,
    mut see: impl FnMut(&Observation) -> Result<(), JudgeError>,
) -> Result<SpillStore<Link, Observation>, JudgeError> {
    let mut store = SpillStore::new(directory);
    each(path, remedy, |line, row: Observation| {
        believable(path, line, row.sent_s)?;
        see(&row)?;
        store.push(row.link(), &row)
    })?;
    Ok(store)
}

/// Number of occurrences of each of a few different numbers.
#[derive(Default)]
struct Counts(BTreeMap<u64, usize>);

impl Counts {
    fn add(&mut self, value: f64) {
        if value.is_finite() {
            // The order of bits is that of numbers that are not negative; others are turned about.
            let bits = value.to_bits();
            let turned = if value.is_sign_negative() { !bits } else { bits | 1 << 63 };
            *self.0.entry(turned).or_default() += 1;
        }
    }

    /// Median of the numbers, as in [`crate::statistics::median`].
    fn median(&self) -> Option<f64> {
        let last = self.0.values().sum::<usize>().checked_sub(1)?;
        let at = |rank: usize| {
            let mut below = 0;
            let found = self.0.iter().find(|(_, count)| {
                below += **count;
                below > rank
            });
            found.map(|(turned, _)| f64::from_bits(if turned >> 63 == 0 { !turned } else { turned & !(1 << 63) }))
        };
        let (low, high) = (at(last / 2)?, at(last.div_ceil(2))?);
        Some(low + (high - low) * 0.5)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::hand_made::planted;
    use crate::judge;
    use gnss::gps::l1ca::L1_CA;
    use gnss::signal::synthetic::{CHANNELS, LONG_BOC};
    use std::fs;

    #[test]
    fn counts_have_the_median_of_the_list() {
        for list in [&[][..], &[4e-3], &[1.0, -2.0, 3.0, -2.0], &[0.0, -0.5, 1e-3, 4e-3, 4e-3], &[1.0, 2.0]] {
            let mut counts = Counts::default();
            list.iter().for_each(|value| counts.add(*value));
            assert_eq!(counts.median(), median(list), "{list:?}");
        }
    }

    #[test]
    fn real_samples_hold_signals_of_one_zone_at_the_frequency_that_they_fold_to() {
        let scene = |center_hz: f64| -> SceneFacts {
            let json = serde_json::json!({
                "name": "x", "seed": 1, "duration_s": 1.0,
                "sample_rate_hz": 6e6, "center_hz": center_hz, "format": "ri8"
            });
            serde_json::from_value(json).unwrap()
        };
        let of = |signals: &[&'static Signal], center_hz: f64| {
            let mut scene = scene(center_hz);
            let links = signals.iter().map(|signal| signal.link(Sv { system: signal.system, number: 3 }));
            Run::fold(&mut scene, &Emission::all(links)).map(|()| (scene.center_hz.unwrap(), scene.inverted))
        };
        // 20 MHz is 2 MHz beyond three times the rate, 16 MHz 2 MHz below it: mirrored.
        assert_eq!(of(&[&L1_CA], 1_575.42e6 - 2e6).unwrap(), (1_575.42e6 - 2e6, false));
        assert_eq!(of(&[&L1_CA, &LONG_BOC], 1_575.42e6 - 20e6).unwrap(), (1_575.42e6 - 2e6, false));
        assert_eq!(of(&[&L1_CA], 1_575.42e6 - 16e6).unwrap(), (1_575.42e6 + 2e6, true));
        let refused = of(&[&L1_CA, &CHANNELS], 1_575.42e6 - 2e6).unwrap_err().to_string();
        assert!(refused.contains("center_hz") && refused.contains("same multiple"), "{refused}");
        assert!(of(&[], 1e9).is_ok());
    }

    #[test]
    fn what_is_missing_is_named_with_its_remedy() {
        let run = planted();
        fs::remove_file(run.path().join("rx/fixes.csv")).unwrap();
        let error = judge(run.path()).unwrap_err().to_string();
        assert!(error.contains("fixes.csv is missing") && error.contains("gnss-twin receive"), "{error}");
        fs::remove_file(run.path().join("truth/scene.json")).unwrap();
        let error = judge(run.path()).unwrap_err().to_string();
        assert!(error.contains("scene.json is missing") && error.contains("gnss-twin generate"), "{error}");
    }
}
