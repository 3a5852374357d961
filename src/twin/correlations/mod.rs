//! Correlations in place of samples: a model of the sums that a correlator gives.
//!
//! Over an interval, each ray of a satellite contributes its amplitude times the mean of R(τ − δ)·e^{j2πφ}: R
//! the correlation of what is sent with the replica, τ the difference of the codes, δ the tap, φ the
//! difference of the carriers. τ is linear over the interval, φ a parabola; the mean is taken by Gauss and
//! Legendre's nodes, of each piece between the edges of the ray's own symbols. Noise has the variance of the
//! thermal noise, of rounding, and of the other signals by their spectra (source: Kaplan and Hegarty,
//! Understanding GPS 2nd ed., 5.3 and 6.2). Code periods between two updates of a channel's loops are
//! answered together (`train`). Components of one satellite's signal correlate as their codes do. Short
//! codes of other satellites are found as they correlate, long ones are white noise. Limits: front ends
//! without stages ([`refuse`]); samples count as infinitely many.

mod chips;
mod crowd;
mod made;
mod noise;
mod promise;
mod ray;
mod refusal;
mod search;
mod sent;
mod separation;
mod sequence;
mod taps;
#[cfg(test)]
mod tests;
mod train;

use std::collections::BTreeMap;
use std::sync::{Arc, OnceLock};

use generator::random::Stream;
use generator::scene::Scene;
use generator::stream::{Fronts, GenerateError, Options};
use generator::transmit::Transmitter;
use generator::truth;
use gnss::samples::{Format, IfMetadata};
use gnss::signal::{Link, Signal};
use num_complex::Complex64;
use receiver::Reception;
use receiver::correlate::correlator::{Cell, Code, Interval, Model, Sought};
use receiver::correlate::units_to_chips;
use receiver::lead::lead;
use receiver::output;
use receiver::settings::Settings;

pub use crate::refusal::Refused;
use chips::Kept;
use crowd::{Course, Crowd, LEAST_LONG_CHIPS};
use made::Made;
use noise::Noise;
pub use promise::{broken, knobs, promise};
use ray::Question;
pub use refusal::refuse;
use sent::Sent;
use separation::Sampled;
pub use taps::factors;
use taps::{LANES, MOST, is_near};
use train::Train;

use crate::{Done, TwinError, settings_for};

/// Variance of the rounding to whole numbers.
const ROUNDING: f64 = 1.0 / 12.0;
/// Difference of powers beyond which a cross-correlation of short codes, 24 dB down at most for C/A, is no
/// longer noise.
const NEAR_FAR_DB: f64 = 15.0;

/// Receives a scene by its correlations: no sample is made. `progress` gets the number of samples that have
/// been passed.
///
/// # Errors
/// [`Refused`], and the errors of [`crate::run`].
pub fn run(
    scenes: &[Scene],
    settings: &Settings,
    (truth, records): (&mut (dyn truth::Sink + Send), &mut (dyn output::Sink + Send)),
    progress: &mut dyn FnMut(u64),
) -> Result<Done, TwinError> {
    refuse(scenes)?;
    let Some(first) = scenes.first() else { return Err(GenerateError::NoFrontEnd.into()) };
    let settings = settings_for(scenes, settings);
    let metadata: Vec<IfMetadata> = scenes.iter().map(|scene| scene.metadata.clone()).collect();
    let mut reception = Reception::of_several(&metadata, &settings)?;
    let mut fronts = Fronts::new(scenes, truth, &Options::default())?;
    let plans: Vec<Plan> = scenes.iter().map(|scene| Plan::new(scene, &settings)).collect();
    let (mut second, mut to) = (0, 0);
    while to < first.samples {
        to = first.clock.rate.first_sample_at(second + 1, 1).min(first.samples);
        fronts.prepare(&reception.needs(), to, &|_| true)?;
        let (transmitters, due) = fronts.prepared(to);
        let (given, taken) = rayon::join(
            || due.give(truth),
            || {
                let pairs = plans.iter().zip(transmitters);
                let models: Vec<Correlations<'_>> = pairs.map(|(plan, sent)| plan.over(sent, second)).collect();
                models.iter().try_for_each(Correlations::refuse_near_and_far)?;
                Ok::<_, TwinError>(reception.take_models(&models, (to, to == first.samples), records)?)
            },
        );
        given?;
        taken?;
        progress(to);
        second += 1;
    }
    let mut generated = fronts.finish(truth)?;
    generated.iter_mut().for_each(|one| one.samples = 0);
    Ok(Done { generated, outcome: reception.finish(records)? })
}

/// Everything that does not depend on time.
pub struct Plan<'a> {
    scene: &'a Scene,
    made: Vec<Made>,
    /// Spectral separations of each of [`Self::made`] in seconds, by the number of a signal of the scene and
    /// its carrier's distance in hertz.
    separations_s: Vec<BTreeMap<(usize, i64), f64>>,
    /// Shares of the signals' powers that the samples have, which edges of chips reduce.
    kept: Vec<f64>,
    noise: Stream,
    /// Sums of pairs of short codes.
    pairs: Kept,
}

impl<'a> Plan<'a> {
    /// A plan for a scene that [`refuse`] has let pass, and a receiver with these settings.
    pub fn new(scene: &'a Scene, settings: &Settings) -> Self {
        let made = Made::all(scene, settings);
        let rate_hz = scene.clock.rate.hz();
        let sampled: Vec<Sampled> = scene.signals.iter().map(|signal| Sampled::new(signal, scene)).collect();
        // One for most signals, one a channel for others.
        let carriers = |signal: &&'static Signal| {
            let mut all: Vec<f64> = signal.satellites().map(|sv| signal.carrier_hz(sv)).collect();
            all.sort_by(f64::total_cmp);
            all.dedup();
            all
        };
        let carriers: Vec<Vec<f64>> = scene.signals.iter().map(carriers).collect();
        let from_all = |made: &Made| {
            let mut all = BTreeMap::new();
            let own = (&made.own, made.component.chip_rate_hz);
            let place = scene.signals.iter().position(|signal| *signal == made.signal);
            let own_hz = place.and_then(|place| carriers.get(place)).map_or(&[][..], Vec::as_slice);
            for (number, (others_hz, sampled)) in carriers.iter().zip(&sampled).enumerate() {
                for apart_hz in own_hz.iter().flat_map(|own_hz| others_hz.iter().map(move |hz| hz - own_hz)) {
                    let entry = all.entry((number, apart_hz.round() as i64));
                    entry.or_insert_with(|| sampled.separation_s(own, apart_hz, rate_hz));
                }
            }
            all
        };
        let separations_s = made.iter().map(from_all).collect();
        let kept = sampled.iter().map(Sampled::power).collect();
        let noise = Stream::new(scene.noise_seed(), "correlations");
        Self { scene, made, separations_s, kept, noise, pairs: Kept::default() }
    }

    /// Model over the segment for which signals are prepared; powers are those at the beginning of a
    /// `second`.
    pub fn over(&'a self, transmitters: &'a [Transmitter], second: u64) -> Correlations<'a> {
        let sample = self.scene.clock.rate.first_sample_at(second, 1);
        let span = (sample, self.scene.clock.rate.first_sample_at(second + 1, 1).min(self.scene.samples));
        let sent: Vec<Sent> = transmitters.iter().map(|one| Sent::new(self.scene, one, span)).collect();
        let cn0_hz: Vec<f64> =
            sent.iter().map(|one| one.leg(sample).map_or(0.0, |leg| leg.rays.cn0_hz(sample))).collect();
        let floor = self.floor();
        let sampled_hz: f64 = sent.iter().zip(&cn0_hz).map(|(one, hz)| hz * self.kept(one.transmitter.signal)).sum();
        let power = 2.0 * floor + 2.0 * self.thermal() * sampled_hz / self.scene.clock.rate.hz();
        let places = |link: Link| {
            let is = |(place, one): (usize, &Transmitter)| is_of(one, link).then_some(place);
            transmitters.iter().enumerate().filter_map(is).collect()
        };
        let mut model = Correlations {
            plan: self,
            span,
            sums: Sum::all(&sent, &cn0_hz),
            cn0_hz,
            power,
            floor,
            known: Vec::new(),
            alike: transmitters.iter().map(|one| places(one.link())).collect(),
            crowds: transmitters.iter().map(|_| OnceLock::new()).collect(),
            courses: OnceLock::new(),
            sent,
        };
        let known = |(number, made): (usize, &Made), link: Link| {
            (made.signal == link.signal).then(|| model.know(number, made, link))
        };
        let all = |one: &Sent| self.made.iter().enumerate().map(|made| known(made, one.transmitter.link())).collect();
        model.known = model.sent.iter().map(all).collect();
        model
    }

    /// Share of a signal's power that its samples have.
    fn kept(&self, signal: &Signal) -> f64 {
        let number = self.scene.signals.iter().position(|one| std::ptr::eq(*one, signal));
        number.and_then(|number| self.kept.get(number)).copied().unwrap_or(1.0)
    }

    /// Variance of the thermal noise of a sample, per component.
    fn thermal(&self) -> f64 {
        f64::from(self.scene.noise_lsb) * f64::from(self.scene.noise_lsb)
    }

    /// Replica that loops make of a component of a signal.
    pub(crate) fn followed(&self, signal: &Signal, index: usize, settings: &Settings) -> Option<usize> {
        let way = (settings.tracking.waveform, settings.tracking.replica);
        self.made.iter().position(|made| made.signal == signal && made.index == index && made.is_made(way))
    }

    /// Noise density that a replica for a link meets over the thermal one, with the sums of C/N0 of what is
    /// sent by link; those of the link itself left out. None without noise.
    pub(crate) fn density(&self, made: usize, link: Link, sent: &[(Link, f64)]) -> Option<f64> {
        let load: f64 = sent.iter().map(|(other, hz)| hz * self.separation_s(made, link, *other)).sum();
        self.scene.noise.then(|| (self.floor() + self.thermal() * load) / self.thermal())
    }

    /// Variance of thermal noise and rounding in a sample, per component.
    fn floor(&self) -> f64 {
        let rounding = if self.scene.metadata.format == Format::Cf32Le { 0.0 } else { ROUNDING };
        if self.scene.noise { self.thermal() + rounding } else { 0.0 }
    }

    /// Spectral separation of a replica for a link from another link's signal, in seconds.
    fn separation_s(&self, made: usize, own: Link, other: Link) -> f64 {
        let place = self.scene.signals.iter().position(|one| *one == other.signal);
        let apart_hz = (other.carrier_hz() - own.carrier_hz()).round() as i64;
        let found = place.zip(self.separations_s.get(made)).and_then(|(place, all)| all.get(&(place, apart_hz)));
        found.copied().unwrap_or(0.0)
    }
}

/// Noise in the correlations with one replica of a link.
#[derive(Clone, Copy)]
struct Known {
    /// Deviations of the noise a component, in a sum of one sample: with all other satellites as noise, and
    /// without those of [`Correlations::crowds`].
    deviations: [f64; 2],
    stream: Stream,
}

impl Known {
    /// Stream of a replica, which may be a segment of a long code.
    fn stream(&self, code: &Code) -> Stream {
        code.segment.map_or(self.stream, |segment| self.stream.part(segment))
    }
}

/// Signals of one kind on one carrier.
struct Sum {
    /// One of them.
    one: Link,
    /// Indices of the signals, with the C/N0 of each in hertz.
    members: Vec<(usize, f64)>,
    /// Sum of these, in hertz.
    hz: f64,
}

impl Sum {
    /// Sums of what is sent.
    fn all(sent: &[Sent], cn0_hz: &[f64]) -> Vec<Self> {
        let mut all: Vec<Self> = Vec::new();
        for (number, (sent, hz)) in sent.iter().zip(cn0_hz).enumerate() {
            let link = sent.transmitter.link();
            let is_of = |sum: &&mut Self| sum.one.signal == link.signal && sum.one.carrier_hz() == link.carrier_hz();
            match all.iter_mut().find(is_of) {
                Some(sum) => {
                    sum.members.push((number, *hz));
                    sum.hz += hz;
                }
                None => all.push(Self { one: link, members: vec![(number, *hz)], hz: *hz }),
            }
        }
        all
    }
}

/// Model of the correlations over a segment of time.
pub struct Correlations<'a> {
    plan: &'a Plan<'a>,
    sent: Vec<Sent<'a>>,
    /// Sums of C/N0 over [`Self::sent`].
    sums: Vec<Sum>,
    /// First sample of the second, and the one after its last.
    span: (u64, u64),
    /// C/N0 of each of [`Self::sent`].
    cn0_hz: Vec<f64>,
    /// Mean power of the samples.
    power: f64,
    /// Variance of thermal noise and rounding in a sample, per component.
    floor: f64,
    /// Noise of the replicas of each of [`Self::sent`], its own ones alone.
    known: Vec<Vec<Option<Known>>>,
    /// Signals that a receiver cannot tell from each of [`Self::sent`], by their indices.
    alike: Vec<Vec<usize>>,
    /// Other satellites in the correlations of each short code.
    crowds: Vec<OnceLock<Option<Crowd>>>,
    /// Courses of the rays of each satellite with a short code.
    courses: OnceLock<Vec<Vec<Arc<Course>>>>,
}

impl Correlations<'_> {
    /// Way in which a code is made, the noise of its correlations, and the index of its signal.
    fn made(&self, code: &Code) -> Option<(&Made, Known, Option<usize>)> {
        let number = self.plan.made.iter().position(|made| made.is(code))?;
        let made = self.plan.made.get(number)?;
        let place = self.place(code.link);
        let known = place.and_then(|place| *self.known.get(place)?.get(number)?);
        Some((made, known.unwrap_or_else(|| self.know(number, made, code.link)), place))
    }

    /// Noise in the correlations with a replica of a link.
    fn know(&self, number: usize, made: &Made, link: Link) -> Known {
        let energy = made.share * made.own(link.sv.number).value(0.0);
        let deviations = self.variance(number, link).map(|variance| (variance * energy).sqrt());
        let stream = self.plan.noise.satellite(link.sv).named(made.signal.name).part(made.index as u64);
        Known { deviations, stream }
    }

    /// Index of a link among the signals, or of one that a receiver cannot tell from it.
    fn place(&self, link: Link) -> Option<usize> {
        let is_own = |one: &Sent| one.transmitter.sv == link.sv && std::ptr::eq(one.transmitter.signal, link.signal);
        let own = self.sent.iter().position(is_own);
        own.or_else(|| self.sent.iter().position(|one| is_of(one.transmitter, link)))
    }

    /// Variances of the noise of a sample, per component, for a replica of a link: of all but what the link
    /// itself sends, and of these without short codes on its carrier.
    fn variance(&self, made: usize, link: Link) -> [f64; 2] {
        if self.floor <= 0.0 {
            return [0.0; 2];
        }
        let (mut all, mut white) = (0.0, 0.0);
        for Sum { one, members, hz } in &self.sums {
            let hz = if one.signal == link.signal {
                let is_other = |sent: usize| self.sent.get(sent).is_some_and(|sent| !is_of(sent.transmitter, link));
                let others = members.iter().filter(|(sent, _)| is_other(*sent));
                others.map(|(_, hz)| hz).sum()
            } else {
                *hz
            };
            let load = hz * self.plan.separation_s(made, link, *one);
            all += load;
            white += if crowd::is_beside(link, *one) { 0.0 } else { load };
        }
        [all, white].map(|load| self.floor + self.plan.thermal() * load)
    }

    /// Other satellites in the correlations of a signal's short code, by its index.
    fn crowd(&self, place: usize) -> Option<&Crowd> {
        let rays = |one| Course::all(one, self.span);
        let courses = || self.courses.get_or_init(|| self.sent.iter().map(rays).collect());
        let code = |sent: &Sent, component| {
            let made = self.plan.made.iter().find(|made| made.signal == sent.transmitter.signal)?;
            made.code(sent.transmitter.sv.number, component)
        };
        let made = || Crowd::new(&self.sent, place, courses(), (code, &self.plan.pairs));
        self.crowds.get(place)?.get_or_init(made).as_ref()
    }

    /// Refuses satellites whose short codes a receiver finds in each other's correlations.
    fn refuse_near_and_far(&self) -> Result<(), Refused> {
        for signal in self.plan.scene.signals.iter().copied().filter(|one| is_short(one)) {
            let of = self.sent.iter().zip(&self.cn0_hz);
            let of = of.filter(|(one, hz)| one.transmitter.signal == signal && **hz > 0.0);
            let (least, most) = of.fold((f64::MAX, 0.0), |(least, most), (_, hz)| (hz.min(least), hz.max(most)));
            let apart_db = 10.0 * libm::log10(most / least);
            if most > 0.0 && apart_db > NEAR_FAR_DB {
                let effect = format!("{signal} of satellites whose powers are {apart_db:.1} dB apart");
                return Err(Refused { level: "correlations", effect });
            }
        }
        Ok(())
    }

    /// Signals that a receiver cannot tell from one of this index.
    fn alike(&self, place: Option<usize>) -> impl Iterator<Item = &Sent<'_>> {
        let places = place.and_then(|place| self.alike.get(place));
        places.into_iter().flatten().filter_map(|place| self.sent.get(*place))
    }

    /// Adds the expected sums at taps in chips.
    fn expect(&self, question: &Question, taps: &[f64], sums: &mut [Complex64]) {
        for sent in self.alike(question.place) {
            question.add(sent, taps, sums);
        }
    }

    /// Adds sums of consecutive intervals at taps near the prompt, in chips, with noise of this deviation in
    /// a sample: for each interval one for each tap.
    fn add_near(&self, train: &Train, taps: &[f64], (stream, deviation): (Stream, f64), sums: &mut [Complex64]) {
        let Question { code, made, place, .. } = train.whole;
        for sent in self.alike(place) {
            train.add(sent, taps, sums);
        }
        let (number, count) = (code.link.sv.number, taps.len());
        let crowd = place.and_then(|place| self.crowd(place));
        if let Some(crowd) = crowd.filter(|_| count > LANES) {
            // As many taps at once as it looks up.
            for (first, part) in (0..).step_by(LANES).zip(taps.chunks(LANES)) {
                made.with_taps(number, part, |part| crowd.add(train.intervals, part, (first, count), sums));
            }
        }
        made.with_taps(number, taps, |taps| {
            if let Some(crowd) = crowd.filter(|_| count <= LANES) {
                crowd.add(train.intervals, taps, (0, count), sums);
            }
            if deviation <= 0.0 {
                return;
            }
            let noise = |interval: &Interval| of_interval(stream, deviation, interval);
            match train.intervals {
                [part] if part.to < part.end => {
                    let (stream, deviation) = noise(part);
                    Noise { stream, share: share(part) }.add(taps, deviation, sums);
                }
                intervals => noise::add_to_each(intervals.iter().map(noise), taps, sums),
            }
        });
    }

    /// Adds the sums of one interval, with taps that may be far from the prompt.
    fn add_any(
        &self,
        (question, interval): (Question, &Interval),
        (stream, [all, white]): (Stream, [f64; 2]),
        taps: &[f64],
        sums: &mut [Complex64],
    ) {
        let (mut near, mut chips, mut count) = ([Complex64::ZERO; MOST], [0.0; MOST], 0);
        let (own, deviation) = of_interval(stream, all, interval);
        let noise = Noise { stream: own, share: share(interval) };
        for (tap, sum) in taps.iter().zip(sums.iter_mut()) {
            if is_near(*tap) {
                chips[count] = *tap;
                count += 1;
            } else {
                *sum += deviation * noise.far(*tap);
            }
        }
        let Some(train) = Train::new(question, std::slice::from_ref(interval)) else { return };
        self.add_near(&train, &chips[..count], (stream, white), &mut near[..count]);
        let of_near = taps.iter().zip(sums).filter(|(tap, _)| is_near(**tap));
        of_near.zip(near).for_each(|((_, sum), near)| *sum += near);
    }
}

/// Stream of the noise of an interval, of one of a code, and the deviation in its code period for one in a
/// sample.
fn of_interval(stream: Stream, deviation: f64, Interval { from, end, .. }: &Interval) -> (Stream, f64) {
    (stream.part(*from).part(*end), deviation * (end.saturating_sub(*from) as f64).sqrt())
}

/// Share of its code period that an interval has.
fn share(Interval { from, to, end, .. }: &Interval) -> f64 {
    to.saturating_sub(*from) as f64 / end.saturating_sub(*from) as f64
}

/// True of a signal whose short code a receiver finds in other satellites' correlations.
fn is_short(signal: &'static Signal) -> bool {
    lead(signal).is_some_and(|lead| lead.code_chips < LEAST_LONG_CHIPS)
}

/// True if a receiver cannot tell what is sent from a link.
fn is_of(transmitter: &Transmitter, link: Link) -> bool {
    // Only carriers by channels are shared.
    let may_be = transmitter.sv == link.sv || link.channel().is_some();
    may_be && transmitter.signal == link.signal && transmitter.link().is_alike(link)
}

impl Model for Correlations<'_> {
    fn end(&self) -> u64 {
        self.span.1
    }

    fn sums(&self, intervals: &[Interval], code: &Code, taps: &[i64], sums: &mut [Complex64]) {
        let (Some((made, known, place)), Some(first)) = (self.made(code), intervals.first()) else { return };
        let (mut chips, count) = ([0.0; MOST], taps.len().min(MOST));
        chips.iter_mut().zip(taps).for_each(|(chips, units)| *chips = units_to_chips(*units));
        let (chips, stream) = (&chips[..count], known.stream(code));
        let question = Question { interval: *first, code, made, place };
        if let Some(train) = Train::new(question, intervals).filter(|_| chips.iter().all(|tap| is_near(*tap))) {
            return self.add_near(&train, chips, (stream, known.deviations[1]), sums);
        }
        for (interval, sums) in intervals.iter().zip(sums.chunks_mut(taps.len().max(1))) {
            self.add_any((question, interval), (stream, known.deviations), chips, sums);
        }
    }

    fn power(&self, _: u64, _: u64) -> f64 {
        self.power
    }

    fn search(&self, sought: &Sought) -> Cell {
        search::search(self, sought)
    }
}
