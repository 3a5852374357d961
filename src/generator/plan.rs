//! Plan of a scene: the report of what will be computed, before it is computed.
//!
//! Satellites are placed at a few hundred instants, effects act on them there, and sizes and times follow
//! from counts. What concerns the synthesiser (knots, speed, memory) is given to it, and so are the levels
//! ([`crate::levels`]), for which a few segments of samples are made.

mod machinery;
mod models;
mod rung;

use std::fmt;

pub use machinery::{Machinery, machinery};
use models::models;
pub use rung::{Errors, Rung};

use serde::Serialize;

use crate::catalogue::Silence;
use crate::error::GenerateError;
use crate::fidelity::{self, Choice, Grade};
use crate::levels::{Levels, Span};
use crate::presence::{Presence, presence};
use crate::ray::{Ray, Sight};
use crate::scene::Scene;
use crate::stream::Kept;
use gnss::broadcast::OrbitError;
use gnss::place::counted;
use gnss::record::PassEnd;
use gnss::satellite::Sv;
use gnss::time::Epoch;

/// Instants between start and end at which the sky is looked at.
const INSTANTS: u32 = 240;

/// Satellite that is in view for some of the scene.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct InView {
    /// The satellite.
    pub sv: Sv,
    /// Azimuth in degrees at the first instant above the mask.
    pub azimuth_deg: f64,
    /// Elevation in degrees at the first instant above the mask.
    pub elevation_deg: f64,
    /// C/N0 in dB-Hz of the satellite's first signal; `None` if the scene defines no signal power.
    pub cn0_dbhz: Option<f64>,
    /// Power that the samples have of all its signals and rays over noise density, weakest and strongest of
    /// the instants: C/N0 is at the antenna, and chip edges keep their share of it.
    pub power_dbhz: Option<Span>,
    /// Time in seconds since the start when the satellite comes into view, and the cause. `None` if it is in
    /// view from the beginning.
    pub appears: Option<(f64, PassEnd)>,
    /// Time in seconds since the start when the satellite leaves, and the cause. `None` if it is in view to
    /// the end. The time is exact if an ephemeris begins or ends, and otherwise exact to the step of the
    /// search.
    pub leaves: Option<(f64, PassEnd)>,
}

/// Model that the scene contains, or does not contain.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Model {
    /// Name of the model as a scenario calls it.
    pub name: String,
    /// True if the scene contains the model.
    pub present: bool,
    /// Effect of the model, or the key that would add it.
    pub why: String,
}

/// Report of the computations for a scene.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Plan {
    /// Name of the scene.
    pub name: String,
    /// Name of the front end, where the scenario gives it one.
    pub front_end: Option<String>,
    /// Time of sample 0 by the receiver's clock.
    pub start: String,
    /// Length of the scene, in seconds.
    pub duration_s: f64,
    /// Names of the signals.
    pub signals: Vec<&'static str>,
    /// Elevation mask in degrees.
    pub mask_deg: f64,
    /// True if the scene begins so high that the Earth's limb replaces the elevation mask.
    pub in_space: bool,
    /// Largest speed of the antenna during the scene, in m/s.
    pub speed_mps: f64,
    /// Largest acceleration of the antenna, in m/s².
    pub acceleration_mps2: f64,
    /// Satellites that are in view at any time, highest first.
    pub satellites: Vec<InView>,
    /// Satellites in view at the start that send none of the scene's signals.
    pub silent: Vec<Sv>,
    /// Models that are computed, and models that are not.
    pub models: Vec<Model>,
    /// Levels of the parts of the sum relative to full scale.
    pub levels: Levels,
    /// The level of fidelity.
    pub level: &'static str,
    /// Time in ns per sample for the whole scene on one core of this machine, measured.
    #[serde(skip)]
    pub sample_ns: f64,
    /// Time in ns per sample for each signal of each satellite, on one core of this machine, measured.
    #[serde(skip)]
    pub signal_sample_ns: f64,
    /// Chosen value of each fidelity knob.
    pub knobs: Vec<Choice>,
    /// Cheaper knobs than a budget's, each with what it would break.
    pub cheaper: Vec<String>,
    /// Rate, format and tuning of the samples, in words.
    pub sampling: String,
    /// Samples of the scene.
    pub samples: u64,
    /// Number of bytes of all samples.
    pub bytes: u64,
    /// Memory of a batch and of the motion, in bytes.
    pub memory_bytes: u64,
    /// Processor time in seconds for all samples, knots and rows of the truth, from measured speeds. What the
    /// system takes to write files is not in it.
    #[serde(skip)]
    pub time_s: f64,
    /// Work of the synthesiser.
    pub machinery: Machinery,
}

impl Plan {
    /// Computes the plan of `scene` on this machine, with levels measured on parts of its samples.
    ///
    /// # Errors
    /// Errors of [`machinery()`], [`Levels::new`] and [`Plan::new`].
    pub fn of(scene: &Scene) -> Result<Self, GenerateError> {
        Ok(Self::new(scene, machinery(scene)?, Levels::new(scene)?)?)
    }

    /// Computes the plan of `scene` for a machine.
    ///
    /// # Errors
    /// [`OrbitError`] from the ephemerides.
    pub fn new(scene: &Scene, machinery: Machinery, levels: Levels) -> Result<Self, OrbitError> {
        let duration_s = scene.clock.rate.elapsed_s(scene.samples);
        let extremes = scene.trajectory.extremes(duration_s);
        let satellites = in_view(scene, &levels.kept, duration_s)?;
        // A spoofer sends about as many signals again.
        let sources = (1 + scene.spoofers.len()) as f64;
        let links: usize = satellites.iter().map(|satellite| scene.signals_of(satellite.sv).count()).sum();
        let bytes = scene.samples.saturating_mul(scene.metadata.format.bytes() as u64);
        let knots = scene.trajectory.knots().len() as u64 * std::mem::size_of::<crate::vehicle::Knot>() as u64;
        Ok(Self {
            name: scene.name.clone(),
            front_end: scene.front_end_name.clone(),
            start: scene.clock.start.to_string(),
            duration_s,
            signals: scene.signals.iter().map(|signal| signal.name).collect(),
            mask_deg: scene.mask_rad.to_degrees(),
            in_space: scene.begins_in_space(),
            speed_mps: extremes.speed_mps,
            acceleration_mps2: extremes.acceleration_mps2,
            models: models(scene, &levels.kept),
            level: scene.fidelity.grade.name(),
            sample_ns: 1e9 * levels.sample_s,
            signal_sample_ns: 1e9 * levels.sample_s / (links as f64 * sources).max(1.0),
            knobs: fidelity::choices(scene.fidelity, scene.clock.rate.hz(), scene.noise, &scene.signals),
            cheaper: match scene.fidelity.grade {
                Grade::Budget(budget) => budget.cheaper(&scene.fidelity, scene.clock.rate.hz(), &scene.signals),
                _ => Vec::new(),
            },
            sampling: sampling(scene),
            samples: scene.samples,
            bytes,
            memory_bytes: machinery.block_bytes + knots,
            time_s: scene.samples as f64 * levels.sample_s + machinery.knots_s + machinery.truth_s,
            satellites,
            silent: silent(scene)?,
            levels,
            machinery,
        })
    }
}

impl Plan {
    /// Describes the speed measured on this machine. It is separate from the plan, which is the same on all
    /// machines.
    pub fn speed(&self) -> String {
        let Self { time_s, sample_ns, signal_sample_ns, .. } = self;
        format!(
            "this machine needs about {time_s:.1} s of one core for samples and truth: {sample_ns:.1} ns a sample, \
             {signal_sample_ns:.2} ns a signal of a satellite in it"
        )
    }
}

impl Together<'_> {
    /// Describes the time that this machine needs for all of them.
    pub fn speed(&self) -> String {
        let time_s: f64 = self.0.iter().map(|plan| plan.time_s).sum();
        format!("this machine needs about {time_s:.1} s of one core for samples and truth of all front ends")
    }
}

/// Satellites in view at the start that send none of the scene's signals.
fn silent(scene: &Scene) -> Result<Vec<Sv>, OrbitError> {
    let motion = scene.trajectory.at(0.0);
    let mut found = Vec::new();
    for sv in scene.satellites().filter(|sv| scene.signals_of(*sv).next().is_none()) {
        if matches!(presence(scene, sv, scene.clock.start, &motion)?, Presence::InView(_)) {
            found.push(sv);
        }
    }
    Ok(found)
}

/// Satellites that send and are above the mask at any instant looked at, highest first.
fn in_view(scene: &Scene, kept: &Kept, duration_s: f64) -> Result<Vec<InView>, OrbitError> {
    let mut rows = Vec::new();
    for sv in scene.senders() {
        let (mut row, mut absent): (Option<InView>, Option<PassEnd>) = (None, None);
        for k in 0..=INSTANTS {
            let t_s = duration_s * f64::from(k) / f64::from(INSTANTS);
            let received = scene.clock.start.plus_s(t_s);
            let motion = scene.trajectory.at(t_s);
            let presence = presence(scene, sv, received, &motion)?;
            let end = presence.end();
            let (direct_dbhz, power_dbhz) = match &presence {
                Presence::InView(emission) => strength_dbhz(scene, Some(kept), &emission.sight),
                _ => (None, None),
            };
            match (presence, &mut row) {
                (Presence::InView(emission), None) => {
                    let sight = &emission.sight;
                    row = Some(InView {
                        sv,
                        azimuth_deg: sight.look.azimuth_rad.to_degrees(),
                        elevation_deg: sight.look.elevation_rad.to_degrees(),
                        cn0_dbhz: direct_dbhz,
                        power_dbhz: None,
                        appears: absent.map(|by| (change_s(scene, sv, t_s, by, |silence| silence.until), by)),
                        leaves: None,
                    });
                }
                // It came back (a vehicle that goes round the Earth): in view to the end, as far as this
                // table says.
                (Presence::InView(_), Some(row)) => row.leaves = None,
                (_, Some(row)) if row.leaves.is_none() => {
                    row.leaves = end.map(|by| (change_s(scene, sv, t_s, by, |silence| silence.from), by));
                }
                _ => {}
            }
            if let (Some(row), Some(power_dbhz)) = (&mut row, power_dbhz) {
                Span::widen(&mut row.power_dbhz, power_dbhz);
            }
            absent = end;
        }
        rows.extend(row);
    }
    rows.sort_by(|a, b| b.elevation_deg.total_cmp(&a.elevation_deg).then(a.sv.cmp(&b.sv)));
    Ok(rows)
}

/// Power over noise density in dB-Hz of a satellite's first signal's direct ray at the antenna, and of all
/// signals and rays together, in the samples where it is said what these keep; `None` when nothing in the
/// scene says how strong they are.
pub(crate) fn strength_dbhz(scene: &Scene, kept: Option<&Kept>, sight: &Sight) -> (Option<f64>, Option<f64>) {
    let (mut direct_hz, mut sum_hz) = (None, 0.0);
    for signal in scene.signals_of(sight.sv) {
        let mut rays = vec![Ray { code_delay_s: 0.0, carrier_delay_s: 0.0, phase_cycles: 0.0, cn0_hz: 0.0 }];
        scene.effects.iter().for_each(|effect| effect.act(sight, signal, &mut rays));
        direct_hz = direct_hz.or(rays.first().map(|ray| ray.cn0_hz));
        let share = kept.map_or(1.0, |kept| kept.share(signal));
        sum_hz += share * rays.iter().map(|ray| ray.cn0_hz).sum::<f64>();
    }
    let dbhz = |hz: f64| (hz > 0.0).then(|| 10.0 * libm::log10(hz));
    (direct_hz.and_then(dbhz), dbhz(sum_hz))
}

/// Time in seconds at which a satellite came into view or left it, by the step at `t_s`. If an ephemeris
/// caused it, the time is the instant that `edge` returns for the silence.
fn change_s(scene: &Scene, sv: Sv, t_s: f64, by: PassEnd, edge: impl Fn(&Silence) -> Option<Epoch>) -> f64 {
    let start = scene.clock.start;
    let silences = scene.catalogue.silences(sv, start, start.plus_s(t_s));
    let edges = silences.iter().filter_map(edge).map(|at| at.since(start)).filter(|edge_s| *edge_s <= t_s);
    let exact_s = edges.fold(None, |latest: Option<f64>, edge_s| Some(latest.map_or(edge_s, |l| l.max(edge_s))));
    if by == PassEnd::Ephemeris { exact_s.unwrap_or(t_s) } else { t_s }
}

fn sampling(scene: &Scene) -> String {
    let metadata = &scene.metadata;
    let kind = if metadata.format.is_complex() { "complex" } else { "real" };
    let inverted = if metadata.inverted { ", spectrum inverted" } else { "" };
    format!(
        "{:.6} Msps, {kind} {}, centred on {:.6} MHz{inverted}",
        metadata.rate.hz() / 1e6,
        metadata.format,
        metadata.center_hz / 1e6
    )
}

/// A number of bytes in the unit that suits it.
fn size(bytes: u64) -> String {
    let mut value = bytes as f64;
    for unit in ["B", "KiB", "MiB", "GiB"] {
        if value < 1024.0 {
            return format!("{value:.1} {unit}");
        }
        value /= 1024.0;
    }
    format!("{value:.1} TiB")
}

impl fmt::Display for Plan {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "scene      {} from {} GPST, {:.3} s", self.name, self.start, self.duration_s)?;
        if let Some(name) = &self.front_end {
            writeln!(f, "front end  {name}")?;
        }
        writeln!(f, "signals    {}", self.signals.join(", "))?;
        writeln!(f, "samples    {}: {} samples, {}", self.sampling, self.samples, size(self.bytes))?;
        writeln!(f, "motion     up to {:.2} m/s and {:.2} m/s2", self.speed_mps, self.acceleration_mps2)?;
        let Machinery { knot_spacing_s, longest_knot_spacing_s, knot_reason, .. } = &self.machinery;
        if *longest_knot_spacing_s == 0.0 {
            writeln!(f, "knots      none: {knot_reason}")?;
        } else if knot_spacing_s == longest_knot_spacing_s {
            writeln!(f, "knots      every {knot_spacing_s:.4} s: {knot_reason}")?;
        } else {
            writeln!(f, "knots      every {knot_spacing_s:.4} to {longest_knot_spacing_s:.4} s: {knot_reason}")?;
        }
        writeln!(f, "needs      {} of memory", size(self.memory_bytes))?;
        if self.in_space {
            writeln!(f, "\n{} not behind the Earth", counted(self.satellites.len(), "satellite"))?;
        } else {
            writeln!(f, "\n{} above {:.1} deg", counted(self.satellites.len(), "satellite"), self.mask_deg)?;
        }
        if !self.silent.is_empty() {
            let names: Vec<String> = self.silent.iter().map(Sv::to_string).collect();
            writeln!(f, "  in view, but without a signal of the scene: {}", names.join(" "))?;
        }
        writeln!(f, "  sv   azimuth  elevation  C/N0 dB-Hz  dBFS")?;
        for row in &self.satellites {
            let cn0 = row.cn0_dbhz.map_or_else(|| "-".to_owned(), |x| format!("{x:.1}"));
            write!(f, "  {}  {:7.1}  {:9.1}  {cn0:>10}", row.sv, row.azimuth_deg, row.elevation_deg)?;
            if let Some(Span { least, most }) = row.power_dbhz {
                let [least, most] = [least, most].map(|dbhz| self.levels.satellite_dbfs(dbhz));
                write!(f, "  {least:.1} to {most:.1}")?;
            }
            if let Some((t_s, by)) = row.appears {
                match by {
                    PassEnd::Ephemeris => write!(f, "  first ephemeris from {t_s:.1} s")?,
                    PassEnd::Earth => write!(f, "  comes out from behind the Earth by {t_s:.1} s")?,
                    PassEnd::Mask | PassEnd::Scene => write!(f, "  rises by {t_s:.1} s")?,
                }
            }
            if let Some((t_s, by)) = row.leaves {
                match by {
                    PassEnd::Ephemeris => write!(f, "  last ephemeris ends at {t_s:.1} s, not sent from then on")?,
                    PassEnd::Earth => write!(f, "  goes behind the Earth by {t_s:.1} s")?,
                    PassEnd::Mask | PassEnd::Scene => write!(f, "  sets by {t_s:.1} s")?,
                }
            }
            writeln!(f)?;
        }
        write!(f, "\n{}", self.levels)?;
        writeln!(f, "\nfidelity {}", self.level)?;
        for Choice { knob, value, own, error, cost } in &self.knobs {
            let value = if *own { format!("{value} (own)") } else { value.clone() };
            writeln!(f, "  {knob:21}  {value:12}  {cost:24}  {error}")?;
        }
        for cheaper in &self.cheaper {
            writeln!(f, "  cheaper, not within the budget: {cheaper}")?;
        }
        for (title, present) in [("computed", true), ("not computed", false)] {
            writeln!(f, "\n{title}")?;
            let mut models = self.models.iter().filter(|model| model.present == present).peekable();
            if models.peek().is_none() {
                writeln!(f, "  nothing that a scenario can name")?;
            }
            for model in models {
                writeln!(f, "  {:16} {}", model.name, model.why)?;
            }
        }
        Ok(())
    }
}

/// Plans of several front ends of one scene, shown together.
pub struct Together<'p>(pub &'p [Plan]);

impl fmt::Display for Together<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self(plans) = self;
        let bytes = plans.iter().fold(0, |sum: u64, plan| sum.saturating_add(plan.bytes));
        let memory_bytes: u64 = plans.iter().map(|plan| plan.memory_bytes).sum();
        writeln!(f, "{} front ends that share a clock", plans.len())?;
        for plan in *plans {
            let name = plan.front_end.as_deref().unwrap_or_default();
            writeln!(f, "  {name:14}  {}: {}, {}", plan.sampling, size(plan.bytes), plan.signals.join(", "))?;
        }
        writeln!(f, "together   {} of samples, {} of memory", size(bytes), size(memory_bytes))
    }
}
