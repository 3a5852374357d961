//! Multiple access and interference: what other waves take from a satellite's C/N0.
//!
//! Codes of the same band are no more orthogonal than noise: each adds its power times the spectral
//! separation coefficient κ of its spectrum and the signal's to the noise density (J. W. Betz, NAVIGATION
//! 48(4), 2001; [`Waveform::separation_s`]). Rectangular chips of duration T have 2T/3 from their own kind. A
//! sampler that averages over its interval, and a replica that does too, narrow the spectra and raise κ.
//! Every pair of signals counts whose carriers are within the sample rate, each component by its share of
//! power at the antenna, of which the sampler leaves its part. Interference adds its own power times its own
//! separation ([`super::jamming`]). Behind a spatial filter each counts with what the weights
//! leave of it, other satellites with their mean ([`super::array`]). Limits: components
//! of one signal do not disturb each other (what data make of the C/N0 beside a pilot is in
//! [`super::stated`]); what folds back from beyond the band is left out.

use std::cell::RefCell;
use std::collections::{BTreeSet, HashMap};
use std::sync::Arc;

use crate::expect::array::Filtered;
use crate::expect::jamming;
use crate::read::levels::LevelFinder;
use crate::read::{Emission, Run};
use crate::waveform::Waveform;
use gnss::record::Observation;
use gnss::signal::{Link, Signal};

/// C/N0 that a receiver can measure, per true observation.
pub struct MultipleAccess<'r> {
    run: &'r Run,
    tables: Arc<Tables>,
    sums_hz: RefCell<LevelFinder<'r, Emission>>,
}

/// Tables that hold for a whole run.
struct Tables {
    /// κ of the emissions that a signal meets, its own among them.
    kappa_s: HashMap<Emission, Vec<(Emission, f64)>>,
    /// Share of each signal's power at the antenna that samples have.
    kept: HashMap<&'static Signal, f64>,
    jammed: Jammed,
    filtered: Filtered,
}

/// Noise density that interference adds at a sample, in units of the thermal one. It holds the samples with
/// interference in their order, and a number for each of them and each emission.
#[derive(Default)]
struct Jammed {
    samples: Vec<u64>,
    of: HashMap<Emission, Vec<f64>>,
}

impl Jammed {
    fn get(&self, sample: u64, emission: Emission) -> f64 {
        let place = self.samples.binary_search(&sample).ok();
        place.and_then(|place| self.of.get(&emission)?.get(place)).copied().unwrap_or(0.0)
    }
}

impl Tables {
    fn of(run: &Run) -> Self {
        let emissions = Emission::all(run.truth.keys());
        let signals: BTreeSet<&'static Signal> = emissions.iter().map(|one| one.signal).collect();
        let (layers, sampler) = (run.scene.waveform, run.sampler(0));
        let waveform = |signal| Some((signal, Waveform::sent(signal, layers)?));
        let waveforms: HashMap<&'static Signal, Waveform> = signals.into_iter().filter_map(waveform).collect();
        let kept = waveforms.iter().map(|(signal, waveform)| (*signal, waveform.power(&sampler))).collect();
        // Rows that cannot be read again are an error of the measurement, which reads them all.
        let filtered = Filtered::of(run).unwrap_or_default();
        Self {
            kappa_s: separations(run, &emissions, &waveforms, &kept),
            kept,
            jammed: jammed(run, &emissions, &waveforms, &filtered),
            filtered,
        }
    }

    /// Other emissions that a signal meets, its own among them, with their κ in seconds.
    fn met(&self, own: Emission) -> &[(Emission, f64)] {
        self.kappa_s.get(&own).map_or(&[], Vec::as_slice)
    }
}

impl<'r> MultipleAccess<'r> {
    /// Multiple access from the truth of a run.
    pub fn new(run: &'r Run) -> Self {
        let tables = run.derived.get(|| Tables::of(run));
        Self { run, tables, sums_hz: RefCell::new(run.cn0_sums_hz.finder()) }
    }

    /// C/N0 of a true observation with the other satellites and interference counted as noise; infinite
    /// without any.
    pub fn effective_dbhz(&self, row: &Observation) -> f64 {
        let (own_hz, own) = (linear(row.cn0_dbhz), Emission::of(row.link()));
        let sum_hz = |emission: Emission| self.sums_hz.borrow_mut().get(row.sample, emission);
        let others = |(emission, kappa_s): &(Emission, f64)| {
            let others_hz = if *emission == own {
                let sum_hz = sum_hz(own).unwrap_or(own_hz);
                planted!("analysis.multiple_access.others", sum_hz - own_hz, 10.0 * sum_hz)
            } else {
                sum_hz(*emission).unwrap_or(0.0)
            };
            kappa_s * others_hz
        };
        let shared: f64 = self.tables.met(own).iter().map(others).sum();
        let thermal = if self.run.scene.noise { 1.0 } else { 0.0 };
        let jammed = self.tables.jammed.get(row.sample, own);
        let (gain, mean) = (self.tables.filtered.satellite(row.sample, row.sv), self.tables.filtered.mean(row.sample));
        10.0 * libm::log10(gain * own_hz / (thermal + mean * shared + jammed))
    }

    /// C/N0 of a signal whose true one is `own_hz`, where all power in the samples counts as white noise, its
    /// own too: in such units a receiver has its prompts. Hertz.
    pub fn white_hz(&self, sample: u64, link: Link, own_hz: f64) -> f64 {
        let own = Emission::of(link);
        let met = self.tables.met(own).iter().map(|(emission, _)| *emission);
        let in_samples = |emission: Emission| {
            let kept = self.tables.kept.get(emission.signal).copied().unwrap_or(1.0);
            Some(kept * self.sums_hz.borrow_mut().get(sample, emission)?)
        };
        let all_hz: f64 = met.filter_map(in_samples).sum();
        let thermal = if self.run.scene.noise { 1.0 } else { 0.0 };
        let jammed = self.tables.jammed.get(sample, own);
        let (gain, mean) = (self.tables.filtered.satellite(sample, link.sv), self.tables.filtered.mean(sample));
        gain * own_hz / (thermal + mean * all_hz / self.run.rate_hz(link.signal) + jammed)
    }
}

/// κ of every pair of emissions within the sample rate of each other.
fn separations(
    run: &Run,
    emissions: &BTreeSet<Emission>,
    waveforms: &HashMap<&'static Signal, Waveform>,
    kept: &HashMap<&'static Signal, f64>,
) -> HashMap<Emission, Vec<(Emission, f64)>> {
    let (sampler, rate_hz) = (run.sampler(0), run.scene.sample_rate_hz);
    // Spectra are even: κ depends on the size of the distance, and on the pair in either order.
    let mut known: HashMap<(&str, &str, u64), f64> = HashMap::new();
    let mut all: HashMap<Emission, Vec<(Emission, f64)>> = HashMap::new();
    for own in emissions {
        for other in emissions {
            let apart_hz = (other.carrier_hz() - own.carrier_hz()).abs();
            let (Some(one), Some(two)) = (waveforms.get(own.signal), waveforms.get(other.signal)) else { continue };
            if apart_hz >= rate_hz {
                continue;
            }
            let [a, b] = [own.signal.name, other.signal.name];
            let key = (a.min(b), a.max(b), apart_hz.to_bits());
            let kappa_s = *known.entry(key).or_insert_with(|| one.separation_s(two, apart_hz, &sampler));
            let kept = kept.get(other.signal).copied().unwrap_or(1.0);
            all.entry(*own).or_default().push((*other, kept * kappa_s));
        }
    }
    all
}

fn jammed(
    run: &Run,
    emissions: &BTreeSet<Emission>,
    waveforms: &HashMap<&'static Signal, Waveform>,
    filtered: &Filtered,
) -> Jammed {
    if run.interference.is_empty() {
        return Jammed::default();
    }
    let (sources, sampler) = (jamming::sources(run), run.sampler(0));
    let mut samples: Vec<u64> = run.interference.iter().map(|row| row.sample).collect();
    samples.sort_unstable();
    samples.dedup();
    let mut of = HashMap::new();
    for emission in emissions {
        let Some(waveform) = waveforms.get(emission.signal) else { continue };
        let sign = if run.scene.inverted { -1.0 } else { 1.0 };
        let signal_hz = sign * (emission.carrier_hz() - run.scene.center_hz.unwrap_or(emission.carrier_hz()));
        let kappa: HashMap<usize, f64> = sources
            .iter()
            .map(|(number, source)| (*number, jamming::separation_s(source, waveform, signal_hz, &sampler)))
            .collect();
        let mut sums = vec![0.0; samples.len()];
        for row in &run.interference {
            let kappa_s = kappa.get(&row.source).copied().unwrap_or(0.0);
            let place = samples.binary_search(&row.sample).ok();
            if let Some(sum) = place.and_then(|place| sums.get_mut(place)) {
                *sum += kappa_s * linear(row.jn0_dbhz) * filtered.source(row.sample, row.source);
            }
        }
        of.insert(*emission, sums);
    }
    Jammed { samples, of }
}

fn linear(cn0_dbhz: f64) -> f64 {
    libm::pow(10.0, cn0_dbhz / 10.0)
}
