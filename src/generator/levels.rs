//! Power of each part of a scene relative to full scale, in dBFS.
//!
//! dBFS here are 20 lg of a component's root mean square over full scale: a complex tone whose circle touches
//! full scale has −3.01 dBFS. Full scale is that of the sample format, or of the converter where the scene
//! has one; floating point has none, and 1 counts as such. Parts have the power that the samples have of them
//! before the front end's filter: C/N0 and J/N0 are at the antenna, and chip edges keep their share of it.
//! The sum and what is clipped of it are measured on segments of the scene's own samples. Limits: satellites
//! and sources are looked at at some instants, quick fading is left out, and a sweep counts as if all of it
//! lay in the band.

use std::fmt;
use std::ops::Range;

use serde::Serialize;

use crate::arrival;
use crate::ray::Ray;
use crate::scene::Scene;
use crate::sky::emission;
use crate::spoof::Constellation;
use crate::stream::{self, GenerateError, Kept, Stretch};
use gnss::broadcast::OrbitError;
use gnss::satellite::Sv;

/// Segments of samples that are made, spread evenly over the scene, and the samples of each: with 5e5
/// components a share of 1e-4 that is clipped is known to a seventh.
const STRETCHES: u64 = 16;
const STRETCH_SAMPLES: u64 = 16_384;
/// Instants between start and end at which sources are looked at.
const INSTANTS: u64 = 60;

/// Smallest and largest value of a quantity.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Span {
    /// The smallest.
    pub least: f64,
    /// The largest.
    pub most: f64,
}

impl Span {
    fn of(value: f64) -> Self {
        Self { least: value, most: value }
    }

    /// Widens the span so that it includes a further value.
    pub fn widen(span: &mut Option<Self>, value: f64) {
        let old = span.unwrap_or(Self::of(value));
        *span = Some(Self { least: old.least.min(value), most: old.most.max(value) });
    }
}

/// A source of interference.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Source {
    /// Kind of the source as a scenario writes it.
    pub kind: &'static str,
    /// Power over noise density at the antenna in dB-Hz while the source is on, averaged over pulses. `None`
    /// if the source is never on in the scene.
    pub jn0_dbhz: Option<Span>,
    /// Peak power of a pulse relative to the mean, in dB.
    pub peak_db: f64,
    /// Gain in dB from that power to the one in the samples: chip edges reduce a matched waveform.
    pub kept_db: f64,
}

/// Weakest and strongest signal of a spoofer.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Spoofed {
    /// Number of the spoofer, from 1.
    pub number: usize,
    /// C/N0 of the spoofer's signals in dB-Hz; `None` if none is in view.
    pub cn0_dbhz: Option<Span>,
    /// C/N0 of the spoofer's signals in the samples, which chip edges reduce, in dB-Hz.
    pub sampled_dbhz: Option<Span>,
}

/// Power of the parts of a scene relative to full scale.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Levels {
    /// Full scale in LSB of the scene's gain.
    pub full_scale_lsb: f64,
    /// Component to which full scale refers, in words.
    pub scale: String,
    /// Level of a power over noise density of 1 Hz.
    unit_dbfs: f64,
    /// Attenuation in dB that a playback applies to satellites and spoofers.
    attenuation_db: f64,
    /// Power of the thermal noise in dBFS; `None` without noise.
    pub noise_dbfs: Option<f64>,
    /// Sources of interference, in the scene's order.
    pub sources: Vec<Source>,
    /// Spoofers, in the scene's order.
    pub spoofers: Vec<Spoofed>,
    /// Reference satellite of J/S and its C/N0 in dB-Hz: the strongest at the scene's start.
    pub strongest: Option<(Sv, f64)>,
    /// Power of the sum before rounding, in dBFS.
    pub sum_dbfs: f64,
    /// Share of components that are clipped over all segments.
    pub clipped_share: f64,
    /// Largest share of a segment's components that is clipped, and the start of that segment in seconds.
    pub worst: (f64, f64),
    stretches: u64,
    /// Shares of the signals' powers that chip edges keep.
    #[serde(skip)]
    pub(crate) kept: Kept,
    /// Time of this machine for a sample of all that the scene sends, on one core: the mean of the
    /// segments.
    #[serde(skip)]
    pub sample_s: f64,
}

impl Levels {
    /// Measures the levels of `scene`.
    ///
    /// # Errors
    /// Errors of the stream.
    pub fn new(scene: &Scene) -> Result<Self, GenerateError> {
        let (tuning, kept) = (scene.tuning(), Kept::of(scene));
        let (even, own) = stretches(scene);
        let met = stream::measured(scene, &even)?;
        let extra = stream::measured(scene, &own)?;
        let sum = |of: fn(&Stretch) -> f64| met.iter().map(of).sum::<f64>();
        let components = sum(|stretch| stretch.components as f64).max(1.0);
        let deviation_lsb = (sum(|stretch| stretch.square_lsb2) / components).sqrt();
        let (full_scale_lsb, scale) = full_scale(scene, deviation_lsb);
        let level = |rms_lsb: f64| 20.0 * libm::log10(rms_lsb / full_scale_lsb);
        let share = |stretch: &Stretch| stretch.clipped as f64 / stretch.components.max(1) as f64;
        let all = even.iter().zip(&met).chain(own.iter().zip(&extra));
        let worst = all.map(|(range, stretch)| (share(stretch), scene.clock.rate.elapsed_s(range.start)));
        Ok(Self {
            unit_dbfs: level(tuning.amplitude_lsb(1.0) * std::f64::consts::FRAC_1_SQRT_2),
            attenuation_db: scene.playback.as_ref().map_or(0.0, |playback| playback.attenuation_db),
            noise_dbfs: scene.noise.then(|| level(tuning.noise_lsb)),
            sources: sources(scene),
            spoofers: scene.spoofers.iter().map(|from| spoofed(scene, &kept, from)).collect::<Result<_, _>>()?,
            strongest: strongest(scene)?,
            sum_dbfs: level(deviation_lsb),
            clipped_share: sum(|stretch| stretch.clipped as f64) / components,
            worst: worst.fold((0.0, 0.0), |worst, (share, t_s)| if share > worst.0 { (share, t_s) } else { worst }),
            stretches: (met.len() + extra.len()) as u64,
            sample_s: sum(|stretch| stretch.sample_s) / met.len().max(1) as f64,
            full_scale_lsb,
            scale,
            kept,
        })
    }

    /// Converts a power over noise density in the samples to dBFS.
    pub fn dbfs(&self, over_noise_dbhz: f64) -> f64 {
        over_noise_dbhz + self.unit_dbfs
    }

    /// Level in dBFS of a satellite's or spoofer's signal in the samples, behind the playback that a scene
    /// may have.
    pub fn satellite_dbfs(&self, sampled_dbhz: f64) -> f64 {
        self.dbfs(sampled_dbhz) - self.attenuation_db
    }
}

/// The strongest satellite in view at the scene's start, and the C/N0 in dB-Hz of the direct ray of its
/// strongest signal: the S of a jammer's J/S. `None` where nothing is in view, or nothing states how strong
/// it is.
///
/// # Errors
/// Errors of the orbit.
pub fn strongest(scene: &Scene) -> Result<Option<(Sv, f64)>, OrbitError> {
    let motion = scene.trajectory.at(0.0);
    let mut found: Option<(Sv, f64)> = None;
    for sv in scene.senders() {
        let seen = emission(&scene.catalogue, sv, scene.clock.start, &motion)?.filter(|e| scene.sees(&e.sight));
        let Some(seen) = seen else { continue };
        for signal in scene.signals_of(sv) {
            let mut rays = vec![Ray { code_delay_s: 0.0, carrier_delay_s: 0.0, phase_cycles: 0.0, cn0_hz: 0.0 }];
            scene.effects.iter().for_each(|effect| effect.act(&seen.sight, signal, &mut rays));
            let cn0_hz = rays.first().map_or(0.0, |ray| ray.cn0_hz);
            if cn0_hz > 0.0 && found.is_none_or(|(_, most_dbhz)| 10.0 * libm::log10(cn0_hz) > most_dbhz) {
                found = Some((sv, 10.0 * libm::log10(cn0_hz)));
            }
        }
    }
    Ok(found)
}

/// Full scale in LSB and its description, for components of a given standard deviation at the converter.
fn full_scale(scene: &Scene, deviation_lsb: f64) -> (f64, String) {
    let mut found = None;
    scene.stages(|stage| {
        if let Some(lsb) = stage.full_scale_lsb(deviation_lsb).filter(|lsb| *lsb > 0.0) {
            found = Some((lsb, format!("that of the {}, {lsb:.1} LSB of the gain", stage.name())));
        }
    });
    let format = scene.metadata.format;
    found.unwrap_or_else(|| match format.full_scale_lsb() {
        Some(lsb) => (f64::from(lsb), format!("{lsb} LSB of {format}")),
        None => (1.0, format!("1, because {format} clips nothing")),
    })
}

/// Segments spread evenly, and one in the middle of each time that a source is on.
fn stretches(scene: &Scene) -> (Vec<Range<u64>>, Vec<Range<u64>>) {
    let length = STRETCH_SAMPLES.min(scene.samples);
    let last = scene.samples - length;
    let at = |start: u64| start.min(last)..start.min(last) + length;
    let mut even: Vec<_> =
        (0..STRETCHES).map(|k| at((last as f64 * k as f64 / (STRETCHES - 1) as f64) as u64)).collect();
    even.dedup();
    let on = scene.interference.iter().map(|source| (source.on.start.min(last), source.on.end.min(last)));
    let mut own: Vec<_> = on.filter(|(from, to)| from < to).map(|(from, to)| at(from + (to - from) / 2)).collect();
    own.sort_by_key(|range| range.start);
    own.dedup();
    (even, own)
}

fn sources(scene: &Scene) -> Vec<Source> {
    let found = scene.interference.iter().map(|source| {
        let (from, to) = (source.on.start, source.on.end.min(scene.samples).saturating_sub(1));
        let mut jn0_dbhz = None;
        for k in 0..=INSTANTS {
            let sample = from + (to.saturating_sub(from) as f64 * k as f64 / INSTANTS as f64) as u64;
            let row = source.row(0, sample).filter(|_| sample < scene.samples);
            row.into_iter().for_each(|row| Span::widen(&mut jn0_dbhz, row.jn0_dbhz));
        }
        let kept_db = 10.0 * libm::log10(source.kept(scene.clock.rate.hz()));
        Source { kind: source.kind, jn0_dbhz, peak_db: -10.0 * libm::log10(source.duty()), kept_db }
    });
    found.collect()
}

/// The signals of a spoofer while it is on.
fn spoofed(scene: &Scene, kept: &Kept, from: &Constellation) -> Result<Spoofed, OrbitError> {
    let (on, mut cn0_dbhz, mut sampled_dbhz) = (from.on(scene.clock, &scene.receiver_clock), None, None);
    let last = scene.samples.saturating_sub(1);
    for k in 0..=INSTANTS {
        let sample = (last as f64 * k as f64 / INSTANTS as f64) as u64;
        if !on.contains(&sample) {
            continue;
        }
        let local = scene.clock.epoch(sample);
        for sv in scene.satellites_of(from) {
            if !arrival::in_view_from(scene, from, sv, local)? {
                continue;
            }
            let (mut sum_hz, mut sampled_hz) = (0.0, 0.0);
            for signal in scene.signals_of(sv) {
                let seen = arrival::seen_from(scene, from, sv, signal, local)?;
                let own_hz = seen.map_or(0.0, |seen| seen.rays.iter().map(|ray| ray.cn0_hz).sum::<f64>());
                sum_hz += own_hz;
                sampled_hz += own_hz * kept.share(signal);
            }
            if sum_hz > 0.0 {
                Span::widen(&mut cn0_dbhz, 10.0 * libm::log10(sum_hz));
                Span::widen(&mut sampled_dbhz, 10.0 * libm::log10(sampled_hz));
            }
        }
    }
    Ok(Spoofed { number: from.number, cn0_dbhz, sampled_dbhz })
}

impl fmt::Display for Levels {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let range = |span: Span| {
            let (least, most) = (format!("{:.1}", span.least), format!("{:.1}", span.most));
            if least == most { least } else { format!("{least} to {most}") }
        };
        let shifted = |span: Span, by: f64| range(Span { least: span.least + by, most: span.most + by });
        writeln!(f, "levels, root mean square of a component; full scale is {}", self.scale)?;
        if let Some(dbfs) = self.noise_dbfs {
            writeln!(f, "  noise           {dbfs:.1} dBFS")?;
        }
        for (number, source) in (1..).zip(&self.sources) {
            write!(f, "  {:14}  ", format!("{number} {}", source.kind))?;
            let Some(jn0) = source.jn0_dbhz else {
                writeln!(f, "never on")?;
                continue;
            };
            write!(f, "{} dBFS, J/N0 {} dB-Hz", shifted(jn0, self.unit_dbfs + source.kept_db), range(jn0))?;
            if let Some((sv, cn0_dbhz)) = self.strongest {
                write!(f, ", J/S {} dB over {sv} ({cn0_dbhz:.1} dB-Hz at the start)", shifted(jn0, -cn0_dbhz))?;
            }
            if source.peak_db > 0.0 {
                write!(f, "; {:.1} dB more within a pulse", source.peak_db)?;
            }
            writeln!(f)?;
        }
        for Spoofed { number, sampled_dbhz, .. } in &self.spoofers {
            let level = sampled_dbhz.map_or("never on".to_owned(), |cn0| {
                format!("{} dBFS a satellite", shifted(cn0, self.unit_dbfs - self.attenuation_db))
            });
            writeln!(f, "  {:14}  {level}", format!("spoofer {number}"))?;
        }
        let (share, worst_s) = self.worst;
        let sum = if self.sum_dbfs.is_finite() { format!("{:.1} dBFS", self.sum_dbfs) } else { "silence".to_owned() };
        write!(f, "  sum             {sum}; clipped: {:.1e} of components", self.clipped_share)?;
        if share > 0.0 {
            write!(f, ", at most {share:.1e} (at {worst_s:.1} s)")?;
        }
        writeln!(f, ", in {} segments of samples", self.stretches)
    }
}
