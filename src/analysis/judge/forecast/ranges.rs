//! Bias and noise of each range that a fix may use.
//!
//! Bias: the true range, all of the scene's delays in it, less what a receiver computes from the message as
//! sent (orbit, clock, ionosphere) and the true troposphere; and what smoothing makes of code and carrier
//! that part. Noise: theory of the code loop at the true C/N0, other codes and interference counted, through
//! Hatch's filter. Apart from these: chip edges between samples, and reflected rays. Limits: the difference
//! of the receiver's troposphere from the true one is a stated share of it.

use std::collections::BTreeMap;
use std::iter::Peekable;

use nalgebra::Vector3;

use super::air::{Air, Sight};
use super::unshared::Unshared;
use crate::error::JudgeError;
use crate::expect::beats::Beats;
use crate::expect::due::satellite::{FADE_DB, is_stepping};
use crate::expect::loops::{Places, Theory, update_s};
use crate::expect::message::Message;
use crate::expect::multipath::Rays;
use crate::expect::smoothing::Smoothing;
use crate::expect::stated::Stated;
use crate::expect::theory::edges;
use crate::judge::forecast::heard::Heard;
use crate::judge::forecast::links::CN0_DB;
use crate::measure::errors::{Errors, SignalError};
use crate::measure::jitter::{Loop, Settings};
use crate::read::Run;
use crate::read::spill_store::{Cursor, Finder};
use crate::waveform::Edge;
use gnss::broadcast::Ephemeris;
use gnss::earth::{Geodetic, Look, SPEED_OF_LIGHT_MPS, rotate_earth};
use gnss::ionosphere::Model;
use gnss::record::{Fix, IonosphereModel, Observation, SkyRow, TrajectoryRow};
use gnss::satellite::Sv;
use gnss::signal::{Link, Signal};
use gnss::time::GPST;

/// The receiver's choices that its accuracy follows from.
#[derive(Clone, Debug)]
pub struct Choices {
    /// Settings of the loops.
    pub loops: Settings,
    /// Time of a loop's update, by signal.
    pub updates_s: BTreeMap<Link, f64>,
    /// Memory of the smoothing of code by carrier, seconds.
    pub smoothing_s: f64,
    /// Elevation below which no satellite is used, radians.
    pub mask_rad: f64,
    /// Deviation of the receiver's models of the atmosphere at the zenith, metres.
    pub model_sigma_m: f64,
    /// Broadcast model that corrects the ionosphere, if any.
    pub ionosphere: Option<Model>,
    /// True if the receiver combines two carriers of a satellite.
    pub combined: bool,
    /// Error of the ionosphere's model, as a share of its delay.
    pub ionosphere_error_share: f64,
}

impl Choices {
    /// Choices that `receiver.json` states; `None` where one is missing.
    pub fn of(run: &Run) -> Option<Self> {
        let position = run.receiver.get("settings")?.get("position")?;
        let number = |key: &str| position.get(key)?.as_f64();
        let word = |key: &str| position.get(key)?.as_str();
        let ionosphere = match word("ionosphere")? {
            "none" => None,
            "nequick_g" => Some(Model::NequickG),
            "bdgim" => Some(Model::Bdgim),
            "klobuchar" => Some(klobuchar(run)),
            _ if run.fixes.uses(IonosphereModel::NequickG) => Some(Model::NequickG),
            _ if run.fixes.uses(IonosphereModel::Bdgim) => Some(Model::Bdgim),
            _ => Some(klobuchar(run)),
        };
        Some(Self {
            loops: Settings::of(run)?,
            updates_s: updates_s(run)?,
            smoothing_s: number("smoothing_s")?,
            mask_rad: number("mask_deg")?.to_radians(),
            model_sigma_m: number("model_sigma_m")?,
            ionosphere,
            combined: word("ionosphere") == Some("combined"),
            ionosphere_error_share: number("ionosphere_error_share").unwrap_or(0.0),
        })
    }
}

/// The form of Klobuchar's model that the messages brought which the receiver read, the one that it prefers.
fn klobuchar(run: &Run) -> Model {
    let messages = || run.signals.iter().flat_map(|signal| signal.components.iter().filter_map(|c| c.message));
    let brought = |model: &Model| {
        let names: Vec<&str> = messages().filter(|own| own.ionosphere.model == *model).map(|own| own.name).collect();
        run.navigation.iter().any(|row| names.contains(&row.message.as_str()))
    };
    Model::KLOBUCHAR.into_iter().find(brought).unwrap_or(Model::Klobuchar)
}

/// Update time in seconds of every satellite's signal; `None` where one has none.
fn updates_s(run: &Run) -> Option<BTreeMap<Link, f64>> {
    run.truth.keys().map(|link| Some((link, update_s(run, link)?))).collect()
}

/// Space: no horizon, and models that are as good in every direction.
const SPACE_M: f64 = 1e5;
/// Error of a range by elements in short, whose steps are 4.5 m of clock and 22 m across the line of sight,
/// of which a fifth shows at the most; and by a group delay that they lack.
const IN_SHORT_M: f64 = 2.2;
/// Share of the rays' computed effect by which it may be wrong: the front end rounds the correlation, the
/// loop lags.
const MULTIPATH_SHARE: f64 = 0.5;
/// Time that a phase loop takes back to its signal after a fade.
const FADE_S: f64 = 0.5;
/// Rate in dB a second at which the reference strength of a fading signal decays. A signal that is weaker for
/// longer is shaded, not fading.
const FORGOTTEN_DBPS: f64 = 2.0;
/// Satellites this near to the mask may be used or not: true and computed elevation differ.
const MASK_SLACK_RAD: f64 = 2e-3;

/// One range as it should be.
#[derive(Clone, Copy, Debug)]
pub struct Forecast {
    /// The satellite.
    pub sv: Sv,
    /// Index of the signal in the run's list.
    pub signal: usize,
    /// Index in [`Scene::scales`] of the clock that the range is counted against.
    pub clock: usize,
    /// Frequency of the carrier, in hertz.
    pub carrier_hz: f64,
    /// Towards the satellite: east, north, up.
    pub sight: Vector3<f64>,
    /// Expected bias once the ionosphere is corrected, metres.
    pub bias_m: f64,
    /// True if the satellite's clock has jumped so lately that the range error is anywhere up to that bias.
    pub stepping: bool,
    /// Ionosphere as the receiver models it.
    pub air: Air,
    /// True tropospheric delay in metres, of which a model errs by a share.
    pub troposphere_m: f64,
    /// Variance of one code value by thermal noise, m².
    pub code_m2: f64,
    /// Share of it that smoothing leaves.
    pub variance_ratio: f64,
    /// Variance of what elements in short leave, alike on all carriers of the satellite, m².
    pub short_m2: f64,
    /// Variance of what chip edges, reflected rays and beats leave, m².
    pub other_m2: f64,
    /// Correlation time of the range's noise, seconds.
    pub memory_s: f64,
    /// Standard deviation of its Doppler as a rate, m/s.
    pub rate_sigma_mps: f64,
    /// Bias of that rate by what the message does not say of the carrier: atmosphere, scintillation, the
    /// satellite's orbit and clock, m/s.
    pub rate_bias_mps: f64,
    /// C/N0 that the scene allows, Hz.
    pub cn0_hz: f64,
    /// True if the C/N0 observed is near the true one. Averages lag in fades and jamming, which rows of their
    /// own judge.
    pub steady: bool,
    /// True if the signal has faded so lately that its phase turns faster than the truth's rows show.
    pub fading: bool,
    /// Mapping factor of a model's error at the zenith: one over the elevation's sine.
    pub slant: f64,
    /// True if the satellite is so near to the mask that it may be used or not.
    pub near_mask: bool,
    /// True if the fix leaves the range out.
    pub excluded: bool,
}

impl Forecast {
    /// Variance of what differs from fix to fix, m².
    pub fn noise_m2(&self) -> f64 {
        self.code_m2 * self.variance_ratio + self.short_m2
    }
}

/// Data that all satellites of a run share.
pub struct Scene<'r> {
    /// The run.
    pub run: &'r Run,
    /// Choices of the receiver's designer.
    pub choices: Choices,
    /// Messages that the satellites sent.
    pub message: Message,
    /// Names of the time scales of the run's signals, GPS time first.
    pub scales: Vec<&'static str>,
    /// Knowledge of the receiver about the satellites.
    pub(in crate::judge) heard: Heard,
    stated: &'r Stated,
    pub(super) unshared: Unshared,
    beats: Beats,
    /// Error of chip edges with a code at rest, root mean square.
    edges_m: BTreeMap<&'static Signal, f64>,
}

impl<'r> Scene<'r> {
    /// `None` without the receiver's settings.
    ///
    /// # Errors
    /// [`JudgeError::Read`] where spilled rows cannot be read.
    pub fn new(run: &'r Run, stated: &'r Stated) -> Result<Option<Self>, JudgeError> {
        let Some(choices) = Choices::of(run) else { return Ok(None) };
        Ok(Some(Self {
            run,
            message: Message::of(run),
            scales: scales(run),
            heard: Heard::of(run),
            stated,
            unshared: Unshared::new(run, choices.loops, &choices.updates_s),
            choices,
            beats: Beats::new(run)?,
            edges_m: (run.signals.iter())
                .filter(|_| run.scene.code_edge == Edge::Area)
                .map(|&signal| (signal, edges::averaged_m(signal, run.scene.waveform, run.rate_hz(signal))))
                .collect(),
        }))
    }

    /// The ranges of a satellite's signal, fix by fix; none where the settings make no loop that holds it.
    ///
    /// # Errors
    /// [`JudgeError::Read`] where spilled rows cannot be read.
    pub fn ranges<'s>(&'s self, errors: &'s Errors, link: Link) -> Result<Option<Ranges<'s, 'r>>, JudgeError> {
        let update_s = self.choices.updates_s.get(&link);
        let theory = update_s.and_then(|update_s| Theory::new(self.run, self.choices.loops, &link, *update_s));
        let (Some(theory), Some(sky)) = (theory, self.run.seen_at(link.sv)?) else { return Ok(None) };
        let smoothing = || Smoothing::new(self.choices.smoothing_s, self.choices.loops.dll_bandwidth_hz);
        Ok(Some(Ranges {
            scene: self,
            link,
            name: link.sv.to_string(),
            rows: errors.signals.cursor(link).peekable(),
            truth: self.run.truth.finder(link)?,
            sky,
            rays: Rays::of(self.run, link, theory.chip_m)?,
            theory,
            parting: smoothing(),
            reflected: smoothing(),
            unmodelled: Rate::default(),
            fades: Fades::default(),
        }))
    }

    /// A range without smoothing; and, up to a constant, by how much its carrier is longer than what the
    /// message says.
    fn one(
        &self,
        theory: &Theory,
        row: &SignalError,
        (true_row, sky): (&Observation, &SkyRow),
        (model, place): (IonosphereModel, &TrajectoryRow),
    ) -> Option<(Forecast, f64)> {
        let user = Geodetic::from_ecef(&place.position_m());
        let in_space = user.height_m >= SPACE_M;
        let elevation_rad = sky.elevation_deg.to_radians();
        if !in_space && elevation_rad < self.choices.mask_rad - MASK_SLACK_RAD {
            return None;
        }
        let ephemeris = self.message.ephemeris(true_row.link(), (row.sample, place.time()))?;
        let look = Look { azimuth_rad: sky.azimuth_deg.to_radians(), elevation_rad };
        let (satellite_m, computed_m) = computed_m(ephemeris, true_row, place)?;
        let carrier_hz = true_row.link().carrier_hz();
        let sight = Sight { user, look, satellite_m: &satellite_m, at: place.time(), carrier_hz, sky };
        let air = self.choices.ionosphere.map_or_else(Air::default, |chosen| {
            Air::of(model, self.message.ionosphere(chosen), self.choices.ionosphere_error_share, &sight)
        });
        let clock_m = SPEED_OF_LIGHT_MPS * place.clock_bias_s;
        let true_m = true_row.pseudorange_m - clock_m;
        let phase_m = true_row.link().wavelength_m() * true_row.carrier_cycles - clock_m - computed_m;
        // What the system's time is ahead of GPS time goes into its own clock.
        let ahead_m = SPEED_OF_LIGHT_MPS * self.run.scene.ahead_s(true_row.signal.time.name);
        let (cn0_hz, steady) = self.strength(row, true_row.link());
        let noise_m = theory.code_noise_m(cn0_hz);
        let (_, rate_hz) = theory.noise(Loop::Fll, cn0_hz, &Places::default());
        let (sin, cos) = libm::sincos(elevation_rad);
        let (east, north) = libm::sincos(look.azimuth_rad);
        let signal = self.run.signals.iter().position(|own| *own == true_row.signal).unwrap_or(0);
        let rate_mps = rate_hz * true_row.link().wavelength_m();
        let forecast = Forecast {
            sv: true_row.sv,
            signal,
            clock: self.scales.iter().position(|scale| *scale == true_row.signal.time.name).unwrap_or(0),
            carrier_hz,
            sight: Vector3::new(east * cos, north * cos, sin),
            stepping: is_stepping(&self.run.scene.faults, true_row.sv, row.time_s),
            bias_m: true_m + ahead_m - computed_m - air.delay_m - sky.troposphere_m,
            air,
            troposphere_m: sky.troposphere_m,
            code_m2: noise_m * noise_m,
            variance_ratio: 1.0,
            short_m2: self.short_m2(true_row.sv, row.sample),
            other_m2: self.edge_m2(true_row),
            memory_s: 0.0,
            rate_sigma_mps: libm::hypot(rate_mps, self.unshared.own_mps(signal)),
            rate_bias_mps: 0.0,
            cn0_hz,
            steady,
            fading: false,
            slant: if in_space { 1.0 } else { 1.0 / sin.max(0.05) },
            near_mask: !in_space && elevation_rad < self.choices.mask_rad + MASK_SLACK_RAD,
            excluded: false,
        };
        Some((forecast, phase_m))
    }

    /// Variance of what elements in short leave, while nothing better is known; receivers weight by it.
    fn short_m2(&self, sv: Sv, sample: u64) -> f64 {
        if self.heard.is_whole(sv, sample) { 0.0 } else { IN_SHORT_M * IN_SHORT_M }
    }

    /// C/N0 that the scene allows, hertz; and whether the receiver found that.
    pub(super) fn strength(&self, row: &SignalError, link: Link) -> (f64, bool) {
        let cost_db = self.stated.front_end_db(link.signal);
        let lacks_db = self.stated.cost_db(link, row.cn0_effective_dbhz - cost_db);
        let steady = (row.cn0_dbhz - row.cn0_effective_dbhz + cost_db + lacks_db).abs() <= CN0_DB;
        (libm::pow(10.0, (row.cn0_effective_dbhz - cost_db) / 10.0), steady)
    }

    /// Error that chip edges leave of a code at rest, root mean square.
    pub(super) fn edges_m(&self, signal: &'static Signal) -> f64 {
        self.edges_m.get(signal).copied().unwrap_or(0.0)
    }

    /// Variance that chip edges between samples leave: a code that moves by whole samples within the
    /// smoothing averages it.
    fn edge_m2(&self, row: &Observation) -> f64 {
        let rate_hz = self.run.rate_hz(row.signal);
        let patterns = (row.doppler_hz / row.link().carrier_hz() * rate_hz).abs() * self.choices.smoothing_s.max(1.0);
        let left_m = self.edges_m(row.signal) / (1.0 + 2.0 * patterns);
        left_m * left_m
    }
}

/// The ranges of a satellite's signal, fix by fix: what smoothing remembers of it, and its rows.
pub struct Ranges<'s, 'r> {
    scene: &'s Scene<'r>,
    link: Link,
    name: String,
    theory: Theory,
    rows: Peekable<Cursor<'s, Link, SignalError>>,
    truth: Finder<'r, Link, Observation>,
    sky: Finder<'r, Link, SkyRow>,
    rays: Rays<'r>,
    parting: Smoothing,
    reflected: Smoothing,
    unmodelled: Rate,
    fades: Fades,
}

impl Ranges<'_, '_> {
    /// Gives the ranges that a fix may use to `take`; fixes come in the order of their samples, with the true
    /// position of each.
    ///
    /// # Errors
    /// [`JudgeError::Read`] where spilled rows cannot be read.
    pub fn of_fix(
        &mut self,
        fix: &Fix,
        place: Option<&TrajectoryRow>,
        mut take: impl FnMut(Forecast),
    ) -> Result<(), JudgeError> {
        let due = |row: &Result<SignalError, JudgeError>| row.as_ref().map_or(true, |row| row.sample <= fix.sample);
        while let Some(row) = self.rows.next_if(due) {
            let row = row?;
            if let Some(range) = self.range(&row, fix, place)? {
                take(range);
            }
        }
        Ok(())
    }

    /// Smoothing takes every row, a range is of the fix's alone.
    fn range(
        &mut self,
        row: &SignalError,
        fix: &Fix,
        place: Option<&TrajectoryRow>,
    ) -> Result<Option<Forecast>, JudgeError> {
        let (Some(true_row), Some(sky)) = (self.truth.get(row.sample), self.sky.get(row.sample)) else {
            return Ok(None);
        };
        let (scene, theory, link) = (self.scene, &self.theory, self.link);
        let fading = self.fades.take(row.time_s, true_row.cn0_dbhz);
        let parted_m = true_row.pseudorange_m - link.wavelength_m() * true_row.carrier_cycles;
        let ray_m = theory.ray_m(self.rays.at(row.sample)?);
        let smooth = self.parting.take(row.time_s, row.locked_s, parted_m + ray_m);
        let bounced = self.reflected.take(row.time_s, row.locked_s, ray_m.abs());
        let Some(place) = place.filter(|_| row.sample == fix.sample && scene.heard.usable(link, row.sample)) else {
            return Ok(None);
        };
        let Some((one, phase_m)) = scene.one(theory, row, (&true_row, &sky), (fix.ionosphere, place)) else {
            return Ok(None);
        };
        let bounced_m = MULTIPATH_SHARE * bounced.value_m;
        // A mean over twice the mean age.
        let (span_s, averaged_s) = ((row.time_s, row.time_s), 0.5 * smooth.memory_s);
        let beat_m2 = theory.chip_m * theory.chip_m * scene.beats.variance(theory, link, span_s, averaged_s);
        Ok(Some(Forecast {
            // A fix with one clock brought all ranges to its time.
            clock: if fix.clocks == Some(1) { 0 } else { one.clock },
            bias_m: one.bias_m + smooth.value_m - parted_m,
            variance_ratio: smooth.variance_ratio,
            other_m2: one.other_m2 + bounced_m * bounced_m + beat_m2,
            memory_s: smooth.memory_s,
            rate_bias_mps: self.unmodelled.of(row.time_s, phase_m),
            fading,
            excluded: fix.excluded.split_whitespace().any(|name| name == self.name),
            ..one
        }))
    }
}

/// Names of the time scales of a run's signals, GPS time first, then by name.
fn scales(run: &Run) -> Vec<&'static str> {
    let mut names: Vec<&'static str> = run.signals.iter().map(|signal| signal.time.name).collect();
    names.sort_by_key(|name| (*name != GPST.name, *name));
    names.dedup();
    names
}

/// Range that a receiver computes from the message alone: geometry, light time, Earth rotation and satellite
/// clock.
fn computed_m(ephemeris: &Ephemeris, row: &Observation, place: &TrajectoryRow) -> Option<(Vector3<f64>, f64)> {
    let sent = row.sent();
    let rough = ephemeris.clock_of_signal(sent, row.signal).ok()?;
    let clock = ephemeris.clock_of_signal(sent.plus_s(-rough.offset_s), row.signal).ok()?;
    let satellite_m = ephemeris.state(sent.plus_s(-clock.offset_s)).ok()?.position_m;
    let mut seen_m = satellite_m;
    for _ in 0..3 {
        seen_m = rotate_earth(&satellite_m, (seen_m - place.position_m()).norm() / SPEED_OF_LIGHT_MPS);
    }
    Some((seen_m, (seen_m - place.position_m()).norm() - SPEED_OF_LIGHT_MPS * clock.offset_s))
}

/// Rate of a quantity between successive rows.
#[derive(Default)]
struct Rate {
    last: Option<(f64, f64)>,
}

impl Rate {
    fn of(&mut self, time_s: f64, value: f64) -> f64 {
        let before = self.last.replace((time_s, value));
        before.filter(|(t_s, _)| time_s - t_s > 1e-3).map_or(0.0, |(t_s, old)| (value - old) / (time_s - t_s))
    }
}

/// State of a signal's fading, from its true strengths one after the other.
struct Fades {
    time_s: f64,
    strongest_dbhz: f64,
    faded_s: f64,
}

impl Default for Fades {
    fn default() -> Self {
        Self { time_s: 0.0, strongest_dbhz: f64::NEG_INFINITY, faded_s: f64::NEG_INFINITY }
    }
}

impl Fades {
    /// True if the signal fades at the newest strength, or did a moment ago.
    fn take(&mut self, time_s: f64, cn0_dbhz: f64) -> bool {
        let forgotten_db = FORGOTTEN_DBPS * (time_s - self.time_s);
        self.strongest_dbhz = cn0_dbhz.max(self.strongest_dbhz - forgotten_db);
        self.time_s = time_s;
        if cn0_dbhz < self.strongest_dbhz - FADE_DB {
            self.faded_s = time_s;
        }
        time_s < self.faded_s + FADE_S
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_fade_ends_half_a_second_after_the_signal_is_back_and_a_shade_is_none_after_some_seconds() {
        let mut fades = Fades::default();
        let mut at = |tenths: i32, cn0_dbhz: f64| fades.take(f64::from(tenths) * 0.1, cn0_dbhz);
        assert!((0..20).all(|t| !at(t, 45.0)));
        assert!(at(20, 34.0) && at(21, 30.0) && at(22, 44.0) && at(25, 45.0));
        assert!((27..40).all(|t| !at(t, 45.0 - 9.0 * f64::from(t % 2))));
        // 20 dB less from then on: ten of them are forgotten after 5 s.
        assert!((40..88).all(|t| at(t, 25.0)));
        assert!((97..120).all(|t| !at(t, 25.0)));
    }
}
