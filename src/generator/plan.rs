//! What a scene will compute, told before it is computed.
//!
//! Satellites are placed at a few hundred instants, effects act on them there, and sizes and times follow
//! from counts. What concerns the synthesiser (knots, speed, memory) is given to it, and so are the levels
//! ([`crate::generator::levels`]), for which a few stretches of samples are made.

mod models;

use std::fmt;

use models::models;

use crate::generator::catalogue::Silence;
use crate::generator::fidelity::{self, Choice};
use crate::generator::levels::{Levels, Span};
use crate::generator::presence::{Presence, presence};
use crate::generator::ray::{Ray, Sight};
use crate::generator::scene::{SPACE_M, Scene};
use crate::gnss::broadcast::OrbitError;
use crate::gnss::earth::Geodetic;
use crate::gnss::record::PassEnd;
use crate::gnss::satellite::Sv;
use crate::gnss::time::Epoch;

/// Instants between start and end at which the sky is looked at.
const INSTANTS: u32 = 240;

/// What the plan cannot know of itself.
#[derive(Clone, Debug, PartialEq)]
pub struct Machinery {
    /// Shortest and longest time between knots of the signal's delay, and why it is that.
    pub knot_spacing_s: f64,
    pub longest_knot_spacing_s: f64,
    pub knot_reason: String,
    /// Memory of the generator's blocks, which does not grow with the scene.
    pub block_bytes: u64,
    /// Samples times satellites that this machine makes a second.
    pub satellite_samples_per_s: f64,
}

/// A satellite that is in view for some of the scene.
#[derive(Clone, Debug, PartialEq)]
pub struct InView {
    pub sv: Sv,
    /// At the first instant at which it is above the mask.
    pub azimuth_deg: f64,
    pub elevation_deg: f64,
    /// Of its first signal; `None` when nothing in the scene says how strong it is.
    pub cn0_dbhz: Option<f64>,
    /// Power of all its signals and rays over noise density, weakest and strongest of the instants.
    pub power_dbhz: Option<Span>,
    /// Time since the start when it comes into view, if not in view from the beginning, and by what …
    pub appears: Option<(f64, PassEnd)>,
    /// … and when it leaves, if not in view to the end. To the step of the search, but exact where an
    /// ephemeris begins or ends.
    pub leaves: Option<(f64, PassEnd)>,
}

/// A thing that the scene has, or has not.
#[derive(Clone, Debug, PartialEq)]
pub struct Model {
    pub name: String,
    pub present: bool,
    pub why: String,
}

/// What a scene will compute.
#[derive(Clone, Debug, PartialEq)]
pub struct Plan {
    pub name: String,
    /// Name of the front end, where the scenario gives it one.
    pub front_end: Option<String>,
    pub start: String,
    pub duration_s: f64,
    pub signals: Vec<&'static str>,
    pub mask_deg: f64,
    /// Whether the scene begins so high that the Earth takes the mask's place.
    pub in_space: bool,
    /// Largest speed and acceleration of the antenna during the scene.
    pub speed_mps: f64,
    pub acceleration_mps2: f64,
    pub satellites: Vec<InView>,
    pub models: Vec<Model>,
    /// The parts of the sum against full scale.
    pub levels: Levels,
    /// The level of fidelity, its time for a sample of a satellite (ns on one core), and each knob.
    pub level: &'static str,
    pub satellite_sample_ns: f64,
    pub knobs: Vec<Choice>,
    pub sampling: String,
    pub samples: u64,
    pub bytes: u64,
    pub memory_bytes: u64,
    pub time_s: f64,
    pub machinery: Machinery,
}

impl Plan {
    /// Plans `scene` for a machine.
    ///
    /// # Errors
    /// [`OrbitError`] from the ephemerides.
    pub fn new(scene: &Scene, machinery: Machinery, levels: Levels) -> Result<Self, OrbitError> {
        let duration_s = scene.clock.rate.elapsed_s(scene.samples);
        let extremes = scene.trajectory.extremes(duration_s);
        let satellites = in_view(scene, duration_s)?;
        // A spoofer sends about as many signals again.
        let sources = (1 + scene.spoofers.len()) as f64;
        let links: usize = satellites.iter().map(|satellite| scene.signals_of(satellite.sv).count()).sum();
        let up = links as f64 * sources + scene.interference.len() as f64;
        let bytes = scene.samples.saturating_mul(scene.metadata.format.bytes() as u64);
        let knots =
            scene.trajectory.knots().len() as u64 * std::mem::size_of::<crate::generator::vehicle::Knot>() as u64;
        Ok(Self {
            name: scene.name.clone(),
            front_end: scene.front_end_name.clone(),
            start: scene.clock.start.to_string(),
            duration_s,
            signals: scene.signals.iter().map(|signal| signal.name).collect(),
            mask_deg: scene.mask_rad.to_degrees(),
            in_space: Geodetic::from_ecef(&scene.trajectory.at(0.0).position_m).height_m >= SPACE_M,
            speed_mps: extremes.speed_mps,
            acceleration_mps2: extremes.acceleration_mps2,
            models: models(scene),
            levels,
            level: scene.fidelity.grade.name(),
            satellite_sample_ns: scene.fidelity.satellite_sample_ns(scene.clock.rate.hz()),
            knobs: fidelity::choices(scene),
            sampling: sampling(scene),
            samples: scene.samples,
            bytes,
            memory_bytes: machinery.block_bytes + knots,
            time_s: scene.samples as f64 * up.max(1.0) / machinery.satellite_samples_per_s,
            satellites,
            machinery,
        })
    }
}

/// The satellites above the mask at any instant looked at, highest first.
fn in_view(scene: &Scene, duration_s: f64) -> Result<Vec<InView>, OrbitError> {
    let mut rows = Vec::new();
    for sv in scene.catalogue.satellites().filter(|sv| !scene.excluded.contains(sv)) {
        let (mut row, mut absent): (Option<InView>, Option<PassEnd>) = (None, None);
        for k in 0..=INSTANTS {
            let t_s = duration_s * f64::from(k) / f64::from(INSTANTS);
            let received = scene.clock.start.plus_s(t_s);
            let motion = scene.trajectory.at(t_s);
            let presence = presence(scene, sv, received, &motion)?;
            let end = presence.end();
            let (direct_dbhz, power_dbhz) = match &presence {
                Presence::InView(emission) => strength_dbhz(scene, &emission.sight),
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
                // table tells.
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

/// Power over noise density in dB-Hz of a satellite's first signal's direct ray, and of all signals and rays
/// together; `None` when nothing in the scene says how strong they are.
pub(crate) fn strength_dbhz(scene: &Scene, sight: &Sight) -> (Option<f64>, Option<f64>) {
    let (mut direct_hz, mut sum_hz) = (None, 0.0);
    for signal in scene.signals_of(sight.sv) {
        let mut rays = vec![Ray { code_delay_s: 0.0, carrier_delay_s: 0.0, phase_cycles: 0.0, cn0_hz: 0.0 }];
        scene.effects.iter().for_each(|effect| effect.act(sight, signal, &mut rays));
        direct_hz = direct_hz.or(rays.first().map(|ray| ray.cn0_hz));
        sum_hz += rays.iter().map(|ray| ray.cn0_hz).sum::<f64>();
    }
    let dbhz = |hz: f64| (hz > 0.0).then(|| 10.0 * libm::log10(hz));
    (direct_hz.and_then(dbhz), dbhz(sum_hz))
}

/// When a satellite came or went by the step at `t_s`; where an ephemeris did it, the instant that `edge`
/// takes of its absence.
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
        if knot_spacing_s == longest_knot_spacing_s {
            writeln!(f, "knots      every {knot_spacing_s:.4} s: {knot_reason}")?;
        } else {
            writeln!(f, "knots      every {knot_spacing_s:.4} to {longest_knot_spacing_s:.4} s: {knot_reason}")?;
        }
        writeln!(f, "needs      {} of memory, about {:.1} s", size(self.memory_bytes), self.time_s)?;
        if self.in_space {
            writeln!(f, "\n{} satellites not behind the Earth", self.satellites.len())?;
        } else {
            writeln!(f, "\n{} satellites above {:.1} deg", self.satellites.len(), self.mask_deg)?;
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
        let ns = self.satellite_sample_ns;
        writeln!(f, "\nfidelity {}: {ns:.2} ns for a sample of a satellite on one core", self.level)?;
        for Choice { knob, value, own, error, cost } in &self.knobs {
            let value = if *own { format!("{value} (own)") } else { value.clone() };
            writeln!(f, "  {knob:21}  {value:12}  {cost:24}  {error}")?;
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

/// Several front ends of a scene at one time, before the plan of each.
pub struct Together<'p>(pub &'p [Plan]);

impl fmt::Display for Together<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self(plans) = self;
        let bytes = plans.iter().fold(0, |sum: u64, plan| sum.saturating_add(plan.bytes));
        let memory_bytes: u64 = plans.iter().map(|plan| plan.memory_bytes).sum();
        let time_s: f64 = plans.iter().map(|plan| plan.time_s).sum();
        writeln!(f, "{} front ends that share a clock", plans.len())?;
        for plan in *plans {
            let name = plan.front_end.as_deref().unwrap_or_default();
            writeln!(f, "  {name:14}  {}: {}, {}", plan.sampling, size(plan.bytes), plan.signals.join(", "))?;
        }
        writeln!(f, "together   {} of samples, {} of memory, about {time_s:.1} s", size(bytes), size(memory_bytes))
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::generator::scenario::{Overrides, Scenario};

    fn plan(text: &str) -> Plan {
        let scenario = Scenario::parse(text, "plan").unwrap();
        let directory = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenarios");
        let (scene, _) = scenario.compose(&directory, &Overrides::default()).unwrap();
        let machinery = Machinery {
            knot_spacing_s: 0.5,
            longest_knot_spacing_s: 0.5,
            knot_reason: "a test".to_owned(),
            block_bytes: 1 << 20,
            satellite_samples_per_s: 1e8,
        };
        Plan::new(&scene, machinery, Levels::new(&scene).unwrap()).unwrap()
    }

    #[test]
    fn the_static_scene_has_the_satellites_that_its_comment_promises() {
        let plan = plan(include_str!("../../scenarios/static.toml"));
        let names: Vec<String> = plan.satellites.iter().map(|s| s.sv.to_string()).collect();
        // Found independently from the same file by a short script.
        let expected = ["G23", "G13", "G03", "G19", "G06", "G07", "G20", "G16", "G32", "G10", "G08", "G28"];
        assert_eq!(names.len(), expected.len(), "{plan}");
        assert!(expected.iter().all(|sv| names.iter().any(|n| n == sv)), "{plan}");
        let (highest, lowest) = (&plan.satellites[0], &plan.satellites[11]);
        assert!((highest.elevation_deg - 82.0).abs() < 0.6 && highest.sv == Sv::gps(23), "{plan}");
        assert!((6.5..7.5).contains(&lowest.elevation_deg), "{plan}");
        assert!(plan.satellites.iter().all(|s| s.appears.is_none() && s.leaves.is_none()), "{plan}");
        assert_eq!((plan.samples, plan.bytes), (156_000_000, 312_000_000));
        // 156e6 samples of 12 satellites at 1e8 a second.
        assert!((plan.time_s - 18.72).abs() < 1e-9 && plan.speed_mps == 0.0);
        // The link budget's reach from 5 degrees to the zenith.
        assert!(plan.satellites.iter().all(|s| s.cn0_dbhz.is_some_and(|x| (37.0..52.0).contains(&x))), "{plan}");
    }

    #[test]
    fn what_is_absent_is_named_with_the_table_that_would_bring_it() {
        let text = plan(include_str!("../../scenarios/noise_free.toml")).to_string();
        let (_, absent) = text.split_once("not computed").unwrap();
        for word in ["no [ionosphere]", "no [troposphere]", "no [noise]", "quantiser"] {
            assert!(absent.contains(word), "{text}");
        }
    }

    #[test]
    fn every_knob_is_named_with_its_choice_its_error_and_its_cost() {
        let bare = include_str!("../../scenarios/static.toml");
        let balanced = plan(bare).to_string();
        assert!(balanced.contains("fidelity balanced"), "{balanced}");
        for knob in ["code_edge", "carrier", "knot_tolerance_cycles", "noise"] {
            let line = balanced.lines().find(|line| line.trim_start().starts_with(knob)).expect(knob);
            assert!(!line.contains("(own)"), "{line}");
        }
        let reference = plan(&format!("{bare}[fidelity]\nlevel = \"reference\"\ncode_edge = \"area\"\n"));
        let text = reference.to_string();
        assert!(text.contains("area (own)") && text.contains("fidelity reference"), "{text}");
        assert!(reference.satellite_sample_ns > plan(bare).satellite_sample_ns);
        // Without noise there is nothing for its knob to do.
        let free = plan(include_str!("../../scenarios/noise_free.toml"));
        assert!(free.knobs.iter().all(|choice| choice.knob != "noise"));
    }

    #[test]
    fn satellites_that_rise_and_set_are_told_apart() {
        let day = include_str!("../../scenarios/noise_free.toml").replace("duration_s = 60", "duration_s = 14400");
        let plan = plan(&day);
        assert!(
            plan.satellites.iter().any(|s| matches!(s.appears, Some((_, PassEnd::Mask))))
                && plan.satellites.iter().any(|s| matches!(s.leaves, Some((_, PassEnd::Mask))))
        );
        // 11 satellites on average in view, each for some five hours: more than 12 and fewer than all in four
        // hours.
        assert!((13..=28).contains(&plan.satellites.len()), "{plan}");
    }
}
