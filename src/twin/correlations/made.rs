//! Replicas that a receiver makes of a scene's signals: their correlation with what is sent, and their noise.
//!
//! What is sent and its replica are sequences of equal steps, so their correlation over a code period is a
//! polygon with corners at whole steps; it is computed from the codes themselves. The components of one
//! satellite's signal correlate with each other's replicas the same way. Limits: components whose codes are
//! not of the replica's length, or whole multiples, are white noise; so is what lies chips away.

use std::sync::OnceLock;

use generator::fidelity::CodeEdge;
use generator::scene::Scene;
use gnss::signal::{Component, Layer, Layers, PeakTable, Shape, Signal, least_common_multiple};
use num_complex::Complex64;
use receiver::acquire::SEARCHED;
use receiver::correlate::Edge;
use receiver::correlate::correlator::Code;
use receiver::lead::lead;
use receiver::settings::Settings;

use super::sequence::Sequence;
use super::taps::{Sets, Taps};

/// Steps a chip of the tables of peaks.
pub(super) const STEPS_PER_CHIP: f64 = 1024.0;
/// Chips on either side for which a correlation is computed.
const LAGS_CHIPS: usize = 3;
/// Imaginary part of a correlation below which it counts as real.
const REAL: f64 = 1e-12;
/// Numbers that a satellite can have.
const NUMBERS: usize = 256;

/// Correlation of a component, as it is sent with unit power, with a replica.
#[derive(Debug)]
pub(super) struct Peak {
    re: PeakTable,
    im: Option<PeakTable>,
}

impl Peak {
    /// Value at an offset in chips; zero beyond the table.
    #[inline]
    pub fn value(&self, chips: f64) -> Complex64 {
        Complex64::new(self.re.value(chips), self.im.as_ref().map_or(0.0, |table| table.value(chips)))
    }

    /// Largest offset of the table, in chips.
    pub fn reach_chips(&self) -> f64 {
        self.re.reach_chips()
    }
}

/// Replica of one satellite's component.
#[derive(Debug)]
struct Replica {
    /// Correlation with itself; `None` as that of a random code.
    own: Option<PeakTable>,
    /// Taps that were asked for.
    taps: Sets,
}

/// One way of making a replica of a component.
#[derive(Debug)]
pub(super) struct Made {
    pub signal: &'static Signal,
    /// Number of the component in its signal.
    pub index: usize,
    pub component: &'static Component,
    made: (Layers, Edge),
    /// Replica of a random code with itself.
    pub own: PeakTable,
    /// Unfiltered correlation of a chip of the replica with itself.
    chip: Shape,
    /// One chip of what is sent with one of the replica.
    pub pulse: PeakTable,
    /// Share of samples in which the code has its turn.
    pub share: f64,
    /// Chips of a period of the replica: of a long code those of a segment.
    pub length: u32,
    sent: Layers,
    /// Widths of the means over samples, of what is sent and of the replica, in chips.
    widths_chips: [f64; 2],
    /// Segments of the longest code of the signal.
    segments: usize,
    /// Tables of the code of a replica, by the satellite's number.
    replicas: Vec<OnceLock<Box<Replica>>>,
    /// Codes of the components by the satellite's number.
    codes: Vec<OnceLock<Option<Vec<i8>>>>,
    /// Peaks by the satellite's number, segment and component.
    peaks: Vec<OnceLock<Option<Box<Peak>>>>,
}

impl Made {
    fn new(scene: &Scene, signal: &'static Signal, index: usize, made: (Layers, Edge)) -> Option<Self> {
        let component = signal.components.get(index)?;
        let own = match made.0 {
            Layers::Strongest => component.shapes_by(made.0, component.strongest()?)[1].clone(),
            Layers::Whole => component.shape(),
        };
        let sample = component.chip_rate_hz / scene.clock.rate.hz();
        let local = if made.1 == Edge::Area { sample } else { 0.0 };
        let incoming = if scene.fidelity.code_edge == CodeEdge::Area { sample } else { 0.0 };
        let number = signal.satellites().next()?.number;
        let length = lead(signal)?.code_chips;
        let longest = signal.components.iter().map(|one| one.code_chips).max()?;
        let segments = (longest / length).max(1) as usize;
        let count = signal.components.len();
        Some(Self {
            signal,
            index,
            component,
            made,
            own: PeakTable::boxed(&own, [local, local], STEPS_PER_CHIP),
            chip: own,
            pulse: PeakTable::boxed(&component.shape(), [incoming, local], STEPS_PER_CHIP),
            share: share(&(component.code)(number)?),
            length,
            sent: scene.fidelity.waveform,
            widths_chips: [incoming, local],
            segments,
            replicas: (0..NUMBERS).map(|_| OnceLock::new()).collect(),
            codes: (0..NUMBERS * count).map(|_| OnceLock::new()).collect(),
            peaks: (0..NUMBERS * count * segments).map(|_| OnceLock::new()).collect(),
        })
    }

    /// Replicas of all components of a scene's signals, as these settings make them and as searches do.
    pub fn all(scene: &Scene, settings: &Settings) -> Vec<Self> {
        let mut ways = vec![(settings.tracking.waveform, settings.tracking.replica)];
        ways.extend(Some(SEARCHED).filter(|way| !ways.contains(way)));
        let components = |signal: &'static Signal| (0..signal.components.len()).map(move |index| (signal, index));
        let all = scene.signals.iter().flat_map(|signal| components(signal));
        all.flat_map(|(signal, index)| {
            ways.iter().filter_map(move |way| Self::new(scene, signal, index, *way)).collect::<Vec<_>>()
        })
        .collect()
    }

    /// True if this is how a code is made.
    pub fn is(&self, code: &Code) -> bool {
        std::ptr::eq(self.component, code.component)
            && self.signal == code.link.signal
            && self.made == (code.waveform, code.edge)
    }

    /// True if this is how replicas are made.
    pub fn is_made(&self, way: (Layers, Edge)) -> bool {
        self.made == way
    }

    /// Calls `with` for what depends on a satellite's code and these taps near the prompt alone.
    #[inline]
    pub fn with_taps<R>(&self, number: u8, chips: &[f64], with: impl FnOnce(&Taps) -> R) -> R {
        let own = self.own(number);
        match self.replica(number) {
            Some(replica) => replica.taps.with(chips, (own, &self.pulse), with),
            None => with(&Taps::new(chips, own, &self.pulse)),
        }
    }

    /// Correlation of a satellite's replica with itself.
    pub fn own(&self, number: u8) -> &PeakTable {
        self.replica(number).and_then(|replica| replica.own.as_ref()).unwrap_or(&self.own)
    }

    fn replica(&self, number: u8) -> Option<&Replica> {
        let make = || Box::new(Replica { own: self.made_own(number), taps: Sets::default() });
        Some(self.replicas.get(usize::from(number))?.get_or_init(make))
    }

    /// Correlation of a satellite's replica with itself: that of a chip at every lag of the code, times the
    /// code's own. C/A has 63 or −65 of 1023 a chip away, which is 3 % of the noise of a code loop. `None` of
    /// long codes, whose segments are near to random.
    fn made_own(&self, number: u8) -> Option<PeakTable> {
        if self.segments > 1 {
            return None;
        }
        let code = self.code(number, self.index)?;
        let product = |lag: usize| {
            let pairs = code.iter().zip(code.iter().cycle().skip(lag));
            pairs.map(|(one, other)| f64::from(one * other)).sum::<f64>()
        };
        let products: Vec<f64> = (0..=LAGS_CHIPS).map(product).collect();
        let corners = (self.chip.chip_s() / self.chip.step_s()).round() as i64;
        let (reach, lags) = (LAGS_CHIPS as i64 * corners, -(LAGS_CHIPS as i64)..=LAGS_CHIPS as i64);
        let at = |step: i64| {
            let of = |lag: i64| {
                let common = products.get(lag.unsigned_abs() as usize)? / products.first()?;
                Some(common * self.chip.correlation((step - lag * corners) as f64 * self.chip.step_s()))
            };
            lags.clone().filter_map(of).sum::<f64>()
        };
        let local = self.widths_chips[1];
        let values: Vec<f64> = (-reach..=reach).map(at).collect();
        Some(PeakTable::of_lags(&values, 1.0 / corners as f64, [local, local], STEPS_PER_CHIP))
    }

    /// Correlation of component `sent` of a satellite's signal with the replica; of a long code with, or of,
    /// its `segment`. `None` where they do not correlate.
    pub fn peak(&self, number: u8, segment: usize, sent: usize) -> Option<&Peak> {
        let component = self.signal.components.get(sent)?;
        let count = self.signal.components.len();
        let place = (usize::from(number) * self.segments + segment % self.segments) * count + sent;
        let make = || self.made_peak(component, (number, segment % self.segments, sent)).map(Box::new);
        self.peaks.get(place)?.get_or_init(make).as_deref()
    }

    /// Code of a component of a satellite's signal.
    pub fn code(&self, number: u8, index: usize) -> Option<&[i8]> {
        let place = usize::from(number) * self.signal.components.len() + index;
        let make = || (self.signal.components.get(index)?.code)(number);
        self.codes.get(place)?.get_or_init(make).as_deref()
    }

    fn made_peak(&self, sent: &Component, (number, segment, index): (u8, usize, usize)) -> Option<Peak> {
        if sent.chip_rate_hz != self.component.chip_rate_hz || !sent.code_chips.is_multiple_of(self.length) {
            return None;
        }
        let length = self.length as usize;
        let begin = |component: &Component| if component.code_chips > self.length { segment * length } else { 0 };
        let strongest = self.component.strongest()?;
        let alone = [Layer { weight: 1.0, phase_cycles: 0.0, ..*strongest }];
        let layers = if self.made.0 == Layers::Whole { self.component.layers } else { &alone };
        let replica = Sequence::new(self.code(number, self.index)?, begin(self.component), layers);
        let code = self.code(number, index)?;
        let incoming = Sequence::new(code, begin(sent), sent.made_with(self.sent));
        let per_chip = least_common_multiple(replica.steps(), incoming.steps());
        let scale = 1.0 / share(code).sqrt();
        let mut sums = incoming.correlate(&replica, length, (LAGS_CHIPS, per_chip));
        sums.iter_mut().for_each(|sum| *sum *= scale);
        let step_chips = 1.0 / per_chip as f64;
        let table = |of: fn(&Complex64) -> f64| {
            let lags: Vec<f64> = sums.iter().map(of).collect();
            let is_there = lags.iter().any(|value| value.abs() > REAL);
            is_there.then(|| PeakTable::of_lags(&lags, step_chips, self.widths_chips, STEPS_PER_CHIP))
        };
        Some(Peak { re: table(|sum| sum.re)?, im: table(|sum| sum.im) })
    }
}

/// Share of a code's chips that are its turn.
fn share(chips: &[i8]) -> f64 {
    chips.iter().filter(|&&chip| chip != 0).count() as f64 / chips.len().max(1) as f64
}

#[cfg(test)]
mod tests {
    use generator::scenario::{Overrides, Scenario};
    use gnss::gps::l1ca::L1_CA;

    use super::*;

    /// Replica with itself at lags of a C/A code, summed chip by chip.
    fn by_chips(number: u8, lag_chips: f64) -> f64 {
        const STEPS: usize = 16;
        let chips = (L1_CA.components[0].code)(number).unwrap();
        let steps: Vec<f64> = chips.iter().flat_map(|chip| [f64::from(*chip); STEPS]).collect();
        let lag = (lag_chips * STEPS as f64) as usize;
        steps.iter().zip(steps.iter().cycle().skip(lag)).map(|(a, b)| a * b).sum::<f64>() / steps.len() as f64
    }

    #[test]
    fn noise_of_taps_has_the_covariance_of_the_satellite_s_code() {
        let text = "name = \"one\"\nstart = 2010-07-01T08:06:00\nduration_s = 1\n\
                    motion = { kind = \"static\", latitude_deg = 48.1, longitude_deg = 11.6, height_m = 520 }\n";
        let scene = Scenario::from_toml(text).unwrap().compose(".".as_ref(), &Overrides::default()).unwrap().0;
        let made = Made::new(&scene, &L1_CA, 0, (Layers::Whole, Edge::Nearest)).unwrap();
        let mut beside = Vec::new();
        for number in 1..=32 {
            for lag_chips in [0.0, 0.25, 0.5, 1.0, 1.5, 2.0] {
                let found = made.own(number).value(lag_chips);
                // A box of 1e-4 chip stands for none.
                assert!((found - by_chips(number, lag_chips)).abs() < 2e-4, "{number} {lag_chips}: {found}");
            }
            beside.push((1023.0 * made.own(number).value(1.0)).round() as i32);
        }
        // Gold codes of degree 10 have three values (R. Gold 1967), and all of them occur a chip away.
        beside.sort_unstable();
        beside.dedup();
        assert_eq!(beside, [-65, -1, 63]);
        // A number without a code has that of a random one.
        assert_eq!(made.own(0).value(1.0), made.own.value(1.0));
    }
}
