//! Expectation behind a spatial filter: what the weights do to satellites, interference and noise.
//!
//! With the exact covariance R of noise and interference the weights are `R⁻¹a / (aᴴR⁻¹a)` (van Trees 2002,
//! section 6.2; with a = (1, 0, …) Compton's power inversion), R from the truth's powers and directions, and
//! everything that passes them is counted against the noise that they pass. Limits: a body that neither moves
//! nor turns; weights of a finite covariance lose `(N − 1)/K` more (Reed, Mallett and Brennan 1974), which a
//! block of thousands of samples does not show; interference is flat over the samples' band.

use std::collections::{BTreeMap, HashMap};
use std::f64::consts::TAU;

use nalgebra::{DMatrix, DVector, Vector3};
use num_complex::Complex64;

use crate::error::JudgeError;
use crate::read::Run;
use gnss::earth::SPEED_OF_LIGHT_MPS;
use gnss::facts::ArrayFacts;
use gnss::satellite::Sv;

/// Sources of interference by number, and their powers over the noise density, in hertz.
type Powers = Vec<(usize, f64)>;

/// Expected work of a spatial filter at each instant of the truth.
#[derive(Debug, Default)]
pub struct Filtered {
    ticks: BTreeMap<u64, Tick>,
}

/// Ratios of powers to noise behind the filter over those at the first element.
#[derive(Debug, Default)]
struct Tick {
    satellites: HashMap<Sv, f64>,
    /// Mean over the satellites.
    mean: f64,
    /// Power of a source over noise, for one of 1 in each element, by its number.
    sources: HashMap<usize, f64>,
}

/// Array and the filter behind it.
struct Array<'a> {
    facts: &'a ArrayFacts,
    /// Answer that keeps its gain.
    kept: DVector<Complex64>,
    loading: f64,
    wave_per_m: f64,
    rate_hz: f64,
}

impl Filtered {
    /// Expectation of a run; without a filter one that changes nothing.
    ///
    /// # Errors
    /// Rows of the truth that cannot be read again.
    pub fn of(run: &Run) -> Result<Self, JudgeError> {
        let Some(array) = Array::of(run) else { return Ok(Self::default()) };
        let mut heard: BTreeMap<u64, Powers> = BTreeMap::new();
        for row in &run.interference {
            heard.entry(row.sample).or_default().push((row.source, libm::pow(10.0, row.jn0_dbhz / 10.0)));
        }
        let mut looks: BTreeMap<u64, HashMap<Sv, Vector3<f64>>> = BTreeMap::new();
        for link in run.sky.keys() {
            run.sky.each(link, |row| {
                let ((sin_a, cos_a), (sin_e, cos_e)) =
                    (libm::sincos(row.azimuth_deg.to_radians()), libm::sincos(row.elevation_deg.to_radians()));
                let towards = Vector3::new(cos_e * sin_a, cos_e * cos_a, sin_e);
                looks.entry(row.sample).or_default().insert(row.sv, towards);
            })?;
        }
        // Powers change with the sources that are on, and with their distances.
        let mut known: Option<(Powers, DVector<Complex64>)> = None;
        let mut ticks = BTreeMap::new();
        for (sample, looks) in looks {
            let sources = heard.remove(&sample).unwrap_or_default();
            let weights = match &known {
                Some((same, weights)) if *same == sources => weights.clone(),
                _ => {
                    let Some(weights) = array.weights(&sources) else { continue };
                    known = Some((sources.clone(), weights.clone()));
                    weights
                }
            };
            ticks.insert(sample, array.tick(&weights, &looks, &sources));
        }
        Ok(Self { ticks })
    }

    /// Factor on a satellite's power over noise at a sample.
    pub fn satellite(&self, sample: u64, sv: Sv) -> f64 {
        self.at(sample).and_then(|tick| tick.satellites.get(&sv)).copied().unwrap_or(1.0)
    }

    /// Mean of that factor over the satellites.
    pub fn mean(&self, sample: u64) -> f64 {
        self.at(sample).map_or(1.0, |tick| tick.mean)
    }

    /// Factor on the power of a source of interference over noise at a sample.
    pub fn source(&self, sample: u64, number: usize) -> f64 {
        self.at(sample).and_then(|tick| tick.sources.get(&number)).copied().unwrap_or(1.0)
    }

    /// Last instant of the truth up to a sample.
    fn at(&self, sample: u64) -> Option<&Tick> {
        self.ticks.range(..=sample).next_back().map(|(_, tick)| tick)
    }
}

/// Gain of a spatial filter over azimuth while the same sources are on.
#[derive(Clone, Debug, PartialEq)]
pub struct Pattern {
    /// Numbers of the sources, from 1.
    pub sources: Vec<usize>,
    /// Azimuths in degrees from north over east, each with the power over noise of a wave from there over
    /// that at the first element, in dB.
    pub points: Vec<(f64, f64)>,
    /// Azimuths of those sources, in degrees.
    pub from_deg: Vec<f64>,
}

/// Patterns of a run's filter at an elevation, one for each set of sources in the order in which they come;
/// none without a filter whose weights can be expected.
pub fn patterns(run: &Run, elevation_deg: f64) -> Vec<Pattern> {
    let Some(array) = Array::of(run) else { return Vec::new() };
    let mut sets: BTreeMap<u64, Powers> = BTreeMap::new();
    for row in &run.interference {
        sets.entry(row.sample).or_default().push((row.source, libm::pow(10.0, row.jn0_dbhz / 10.0)));
    }
    let mut found: Vec<Pattern> = Vec::new();
    for set in sets.into_values() {
        let sources: Vec<usize> = set.iter().map(|(number, _)| *number).collect();
        if found.iter().all(|known| known.sources != sources) {
            found.extend(array.pattern(&set, elevation_deg));
        }
    }
    found
}

impl<'a> Array<'a> {
    fn of(run: &'a Run) -> Option<Self> {
        let facts = run.scene.array.as_ref().filter(|facts| facts.is_still)?;
        let settings = run.receiver.pointer("/settings/array")?;
        let number = |key: &str| settings.get(key).and_then(serde_json::Value::as_f64);
        let count = facts.lever_arms_m.len();
        let wave_per_m = run.scene.center_hz? / SPEED_OF_LIGHT_MPS;
        let kept = match settings.get("filter")?.as_str()? {
            "power_inversion" => DVector::from_fn(count, |k, _| Complex64::from(if k == 0 { 1.0 } else { 0.0 })),
            "mvdr" => {
                let arms: Vec<[f64; 3]> = serde_json::from_value(settings.get("lever_arms_m")?.clone()).ok()?;
                let (azimuth, elevation) = (number("azimuth_deg")?.to_radians(), number("elevation_deg")?.to_radians());
                let ((sin_a, cos_a), (sin_e, cos_e)) = (libm::sincos(azimuth), libm::sincos(elevation));
                waves(&arms, &Vector3::new(cos_e * cos_a, cos_e * sin_a, -sin_e), wave_per_m)
            }
            _ => return None,
        };
        let loading = libm::pow(10.0, number("loading_db")? / 10.0);
        let is_whole = kept.len() == count && facts.mixing.len() == count * count && facts.gains.len() == count;
        is_whole.then_some(Self { facts, kept, loading, wave_per_m, rate_hz: run.scene.sample_rate_hz })
    }

    /// Answer of the elements to a unit wave from a direction in east, north and up.
    fn answer(&self, towards: &Vector3<f64>) -> DVector<Complex64> {
        let along = self.facts.axes.map(|axis| Vector3::from(axis).dot(towards));
        let waves = waves(&self.facts.lever_arms_m, &Vector3::from(along), self.wave_per_m);
        let count = waves.len();
        let mixing = self.facts.mixing.iter().map(|[re, im]| Complex64::new(*re, *im));
        DMatrix::from_row_iterator(count, count, mixing) * waves
    }

    /// Answers to the sources by their numbers, and the power of each over noise in the samples.
    fn jammers<'s>(
        &'s self,
        sources: &'s [(usize, f64)],
    ) -> impl Iterator<Item = (usize, f64, DVector<Complex64>)> + 's {
        sources.iter().filter_map(|(number, jn0_hz)| {
            let towards = self.facts.towards.get(number.checked_sub(1)?)?;
            Some((*number, jn0_hz / self.rate_hz, self.answer(&Vector3::from(*towards))))
        })
    }

    fn noise(&self) -> DMatrix<Complex64> {
        DMatrix::from_diagonal(&DVector::from_iterator(
            self.facts.gains.len(),
            self.facts.gains.iter().map(|gain| Complex64::from(gain * gain)),
        ))
    }

    /// Weights while these sources are heard.
    fn weights(&self, sources: &[(usize, f64)]) -> Option<DVector<Complex64>> {
        let noise = self.noise();
        let covariance = self
            .jammers(sources)
            .fold(noise, |sum, (_, power, answer)| sum + &answer * answer.adjoint() * Complex64::from(power));
        let least = eliminated(covariance.clone(), self.kept.clone())?.1;
        let count = self.kept.len();
        let loaded = covariance + DMatrix::from_diagonal_element(count, count, Complex64::from(self.loading * least));
        let (solved, _) = eliminated(loaded, self.kept.clone())?;
        let gain = self.kept.dotc(&solved);
        Some(solved / gain)
    }

    /// Power over noise that weights leave of an answer, for one of 1 over a noise of 1.
    fn passed(&self, weights: &DVector<Complex64>, answer: &DVector<Complex64>) -> f64 {
        weights.dotc(answer).norm_sqr() / weights.dotc(&(self.noise() * weights)).re
    }

    /// Power over noise of a wave from a direction over that at the first element.
    fn gain(&self, weights: &DVector<Complex64>, towards: &Vector3<f64>) -> f64 {
        let answer = self.answer(towards);
        let first = self.facts.gains.first().copied().unwrap_or(1.0);
        let alone = answer.get(0).map_or(1.0, |x| x.norm_sqr()) / (first * first);
        self.passed(weights, &answer) / alone
    }

    /// Pattern over azimuth while these sources are heard.
    fn pattern(&self, sources: &[(usize, f64)], elevation_deg: f64) -> Option<Pattern> {
        let weights = self.weights(sources)?;
        let from_deg = sources.iter().filter_map(|(number, _)| {
            let [east, north, _] = *self.facts.towards.get(number.checked_sub(1)?)?;
            Some(libm::atan2(east, north).to_degrees().rem_euclid(360.0))
        });
        let (sin_e, cos_e) = libm::sincos(elevation_deg.to_radians());
        let point = |azimuth_deg: f64| {
            let (sin_a, cos_a) = libm::sincos(azimuth_deg.to_radians());
            let towards = Vector3::new(cos_e * sin_a, cos_e * cos_a, sin_e);
            (azimuth_deg, 10.0 * libm::log10(self.gain(&weights, &towards)))
        };
        Some(Pattern {
            sources: sources.iter().map(|(number, _)| *number).collect(),
            points: (0..=720).map(|k| point(0.5 * f64::from(k))).collect(),
            from_deg: from_deg.collect(),
        })
    }

    fn tick(&self, weights: &DVector<Complex64>, looks: &HashMap<Sv, Vector3<f64>>, sources: &[(usize, f64)]) -> Tick {
        let satellites: HashMap<Sv, f64> =
            looks.iter().map(|(sv, towards)| (*sv, self.gain(weights, towards))).collect();
        let mean = satellites.values().sum::<f64>() / satellites.len().max(1) as f64;
        let sources =
            self.jammers(sources).map(|(number, _, answer)| (number, self.passed(weights, &answer))).collect();
        Tick { satellites, mean, sources }
    }
}

/// Solution of a positive system by elimination without exchange, and its smallest pivot; `None` where one is
/// not positive.
fn eliminated(mut left: DMatrix<Complex64>, mut right: DVector<Complex64>) -> Option<(DVector<Complex64>, f64)> {
    let (count, mut least) = (right.len(), f64::INFINITY);
    for j in 0..count {
        let pivot = left[(j, j)].re;
        if !(pivot.is_finite() && pivot > 0.0) {
            return None;
        }
        least = least.min(pivot);
        for i in j + 1..count {
            let share = left[(i, j)] / pivot;
            for k in j..count {
                let above = share * left[(j, k)];
                left[(i, k)] -= above;
            }
            let above = share * right[j];
            right[i] -= above;
        }
    }
    for i in (0..count).rev() {
        for k in i + 1..count {
            let below = left[(i, k)] * right[k];
            right[i] -= below;
        }
        right[i] /= left[(i, i)].re;
    }
    Some((right, least))
}

/// Unit wave at positions in a body's axes, from a direction in them.
fn waves(places_m: &[[f64; 3]], towards: &Vector3<f64>, wave_per_m: f64) -> DVector<Complex64> {
    let each = places_m.iter().map(|place| {
        let (sin, cos) = libm::sincos(TAU * wave_per_m * towards.dot(&Vector3::from(*place)));
        Complex64::new(cos, sin)
    });
    DVector::from_iterator(places_m.len(), each)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two elements half a wave apart along the nose, which points north.
    fn pair() -> ArrayFacts {
        ArrayFacts {
            lever_arms_m: vec![[0.0; 3], [0.5, 0.0, 0.0]],
            axes: [[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0]],
            is_still: true,
            mixing: vec![[1.0, 0.0], [0.0, 0.0], [0.0, 0.0], [1.0, 0.0]],
            gains: vec![1.0, 1.0],
            towards: vec![[1.0, 0.0, 0.0]],
        }
    }

    fn array(facts: &ArrayFacts) -> Array<'_> {
        let kept = DVector::from_vec(vec![Complex64::ONE, Complex64::ZERO]);
        Array { facts, kept, loading: 0.0, wave_per_m: 1.0, rate_hz: 1e6 }
    }

    #[test]
    fn two_elements_null_one_jammer_and_have_the_pattern_of_their_difference() {
        let facts = pair();
        let array = array(&facts);
        // A jammer abeam is in phase in both; without one the first element is alone.
        let quiet = array.weights(&[]).unwrap();
        assert!((quiet[0] - Complex64::ONE).norm() < 1e-12 && quiet[1].norm() < 1e-12);
        let sources = [(1, 1e10)];
        let weights = array.weights(&sources).unwrap();
        // w₂ = −P/(1 + P), P = 10⁴: what is left of the jammer is P/(1 + P)² of its power in each.
        assert!((weights[1].re + 1e4 / 10_001.0).abs() < 1e-9 && weights[1].im.abs() < 1e-9, "{weights}");
        let looks = [(Sv::gps(1), Vector3::new(0.0, 1.0, 0.0)), (Sv::gps(2), Vector3::new(0.6, 0.0, 0.8))];
        let tick = array.tick(&weights, &looks.into_iter().collect(), &sources);
        // Ahead, half a wave: the difference doubles the amplitude, and the noise is that of two.
        assert!((tick.satellites[&Sv::gps(1)] - 2.0).abs() < 1e-3);
        // Abeam the satellite is in the null with the jammer.
        assert!(tick.satellites[&Sv::gps(2)] < 1e-7 && tick.sources[&1] < 1e-7);
        assert!((tick.mean - 1.0).abs() < 1e-3);
    }

    #[test]
    fn a_gain_of_a_channel_changes_nothing_and_a_turn_of_it_neither() {
        let mut facts = pair();
        facts.towards = vec![[0.8, 0.6, 0.0]];
        let (looks, sources) = ([(Sv::gps(1), Vector3::new(0.0, 0.9, 0.43))], [(1, 1e11)]);
        let gain = |facts: &ArrayFacts| {
            let array = array(facts);
            let weights = array.weights(&sources).unwrap();
            array.tick(&weights, &looks.into_iter().collect(), &sources).satellites[&Sv::gps(1)]
        };
        let plain = gain(&facts);
        (facts.mixing[3], facts.gains[1]) = ([0.3, -0.4], 0.5);
        assert!((gain(&facts) / plain - 1.0).abs() < 1e-9 && plain > 0.1, "{plain}");
    }
}
