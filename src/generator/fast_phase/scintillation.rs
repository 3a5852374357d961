//! Scintillation: quick fading and phase changes behind small structures of the ionosphere.
//!
//! Model: Humphreys et al. 2009 ("Simulating ionosphere-induced scintillation for testing GPS receiver phase
//! tracking loops"): the signal is multiplied by z̄ + ξ(t), with ξ complex Gaussian noise through a
//! Butterworth filter of second order whose autocorrelation falls to 1/e at the decorrelation time. That
//! makes Rice's amplitudes of index S4 and fades in which the phase turns by half a cycle. A phase spread
//! beyond what comes with S4 is added as Gaussian noise of the same spectrum, which represents larger
//! structures.
//!
//! Carriers: the strength is that on L1, 1575.42 MHz. Behind a phase screen the phase is as 1/f, and S4 of
//! weak scatter as f^−1.5 where the spectrum of the structures falls with the third power (Rino 1979, "A
//! power law phase screen model for ionospheric scintillation", p = 3; ITU-R P.531), up to one, where it
//! saturates. ξ of two carriers have the correlation (f₁/f₂)^(1/2 + S4²), f₁ < f₂. The half is that screen's:
//! of ∫ sin(aq²)·sin(bq²)·q⁻³ dq with a and b as the wavelengths √(a/b) is left. That deep fades come on one
//! band at a time is measured (Jiao, Xu, Morton and Rino 2016, "Equatorial scintillation amplitude fading
//! characteristics across the GPS frequency bands"); S4² for it is a choice. What is added to the phase is
//! the same on all carriers, but for 1/f.
//!
//! Limits: the decorrelation time is the same on all carriers; each has the ξ of the nearest of eleven bands;
//! satellites fade independently; elevation does not matter.

use std::collections::BTreeMap;
use std::f64::consts::{PI, TAU};
use std::sync::{Arc, Mutex, PoisonError};

use crate::clock::nodes::node_samples;
use crate::random::Stream;
use gnss::satellite::Sv;
use gnss::time::Rate;

/// a τ with e^−aτ (cos aτ + sin aτ) = 1/e.
const DECAY: f64 = 1.239_646_4;
/// Nodes of the fading a decorrelation time at least.
const NODES_PER_TIME: f64 = 32.0;
/// Length of the filter's response in its own decay times: e^−12 of it is left out.
const RESPONSE_DECAYS: f64 = 12.0;
/// Nodes of the fading in a block whose phase is followed in one go.
const BLOCK_NODES: u64 = 64;
/// Blocks of a satellite that are kept at hand.
const KEPT: usize = 4;

/// The carrier of which a strength is.
const REFERENCE_HZ: f64 = 1_575.42e6;
/// Carriers that have a ξ of their own, in order: L5, E5, B2, L2, G2, B3, E6, B1I, L1, G1 and S.
const BANDS_HZ: [f64; 11] = [
    1_176.45e6,
    1_191.795e6,
    1_207.14e6,
    1_227.6e6,
    1_246.0e6,
    1_268.52e6,
    1_278.75e6,
    1_561.098e6,
    REFERENCE_HZ,
    1_602.0e6,
    2_492.028e6,
];
/// Position of the reference among them.
const REFERENCE: usize = 8;

/// Strength of a scintillation on L1.
#[derive(Clone, Debug, PartialEq)]
pub struct Strength {
    /// Standard deviation of the intensity over its mean.
    pub s4: f64,
    /// Standard deviation of the phase, in radians; absent means the value that accompanies `s4` on a
    /// carrier.
    pub sigma_phi_rad: Option<f64>,
    /// Time in seconds after which the autocorrelation of ξ is 1/e.
    pub decorrelation_s: f64,
    /// Satellites that scintillate; absent means all.
    pub satellites: Option<Vec<Sv>>,
}

impl Strength {
    /// True if the strength changes any signal.
    pub fn is_felt(&self) -> bool {
        self.s4 > 0.0 || self.sigma_phi_rad.is_some_and(|sigma| sigma > 0.0)
    }

    /// Strength scaled to another carrier.
    fn on(&self, carrier_hz: f64) -> Self {
        let ratio = REFERENCE_HZ / carrier_hz;
        Self {
            s4: (self.s4 * libm::pow(ratio, 1.5)).min(1.0),
            sigma_phi_rad: self.sigma_phi_rad.map(|sigma| sigma * ratio),
            ..self.clone()
        }
    }

    /// Phase noise in radians that is added to the part that accompanies `s4`.
    fn added_rad(&self) -> f64 {
        let intrinsic = self.intrinsic_phase_rad();
        self.sigma_phi_rad.map_or(0.0, |sigma| (sigma * sigma - intrinsic * intrinsic).max(0.0).sqrt())
    }

    /// Correlation of ξ on two carriers.
    fn correlation(&self, one_hz: f64, other_hz: f64) -> f64 {
        libm::pow(one_hz.min(other_hz) / one_hz.max(other_hz), 0.5 + self.s4 * self.s4)
    }

    /// Share of the mean in z̄ + ξ: z̄² of a mean power of one. Rice's K is share / (1 − share).
    fn share(&self) -> f64 {
        (1.0 - self.s4 * self.s4).max(0.0).sqrt()
    }

    /// Standard deviation of the phase that comes with `s4`, within ±π.
    ///
    /// From the density of the phase of a sine wave in noise (Rice 1948, equation 3.10-15).
    pub fn intrinsic_phase_rad(&self) -> f64 {
        let share = self.share();
        if share >= 1.0 {
            return 0.0;
        }
        let k = share / (1.0 - share);
        let density = |phi: f64| {
            let across = libm::cos(phi);
            let root = k.sqrt() * across;
            // e^−K (1 + √π r e^{r²} (1 + erf r)) / 2π, with e^−K drawn in so that nothing overflows.
            (libm::exp(-k) + PI.sqrt() * root * libm::exp(root * root - k) * (1.0 + libm::erf(root))) / TAU
        };
        // The midpoint rule on a period of a smooth periodic function, but for φ² at ±π, where the density is
        // small.
        const STEPS: u32 = 4096;
        let step = TAU / f64::from(STEPS);
        let variance: f64 = (0..STEPS).fold(0.0, |sum, i| {
            let phi = -PI + (f64::from(i) + 0.5) * step;
            sum + phi * phi * density(phi) * step
        });
        variance.sqrt()
    }
}

impl Fade {
    /// Creates the fading of a strength on a carrier.
    fn new(strength: &Strength, carrier_hz: f64) -> Self {
        let own = strength.on(carrier_hz);
        let apart = |band_hz: &f64| libm::log(band_hz / carrier_hz).abs();
        let bands = BANDS_HZ.iter().enumerate().min_by(|a, b| apart(a.1).total_cmp(&apart(b.1)));
        Self {
            share: own.share(),
            added_rad: own.added_rad(),
            band: bands.map_or(REFERENCE, |(band, _)| band),
            starts_rad: Vec::new(),
            blocks: BTreeMap::new(),
        }
    }
}

/// Fading of every satellite in a scene.
#[derive(Debug)]
pub struct Scintillation {
    /// Strength of the scintillation on L1.
    pub strength: Strength,
    /// Nodes of the fast phase in one of the fading.
    step: u64,
    /// The filter's response, of unit energy.
    response: Vec<f64>,
    stream: Stream,
    fades: Mutex<BTreeMap<(Sv, u64), Fade>>,
}

/// State of a satellite's fading on a carrier.
#[derive(Debug)]
struct Fade {
    /// Share of the mean.
    share: f64,
    /// Standard deviation of the added phase noise, in radians.
    added_rad: f64,
    /// Position of the carrier's ξ among the bands'.
    band: usize,
    /// Phase at the beginning of each block, whole turns and all.
    starts_rad: Vec<f64>,
    blocks: BTreeMap<u64, Arc<Vec<(f64, f64)>>>,
}

impl Scintillation {
    /// Creates the fading of `strength` at nodes of the fast phase at `rate`.
    pub fn new(strength: Strength, rate: Rate, stream: Stream) -> Self {
        let node_s = rate.elapsed_s(node_samples(rate));
        let most = (strength.decorrelation_s / NODES_PER_TIME / node_s).max(1.0);
        let step = 1 << (most as u64).ilog2();
        let decay = DECAY * node_s * step as f64 / strength.decorrelation_s;
        let length = (RESPONSE_DECAYS / decay).ceil() as usize;
        let mut response: Vec<f64> =
            (0..length).map(|j| decay * j as f64).map(|x| libm::exp(-x) * libm::sin(x)).collect();
        let energy: f64 = response.iter().fold(0.0, |sum, h| sum + h * h);
        response.iter_mut().for_each(|h| *h /= energy.sqrt());
        Self { strength, step, response, stream, fades: Mutex::new(BTreeMap::new()) }
    }

    /// Amplitude factor and phase in radians of `sv` on a carrier at node number `node`. `None` for a
    /// satellite that does not scintillate.
    pub fn at(&self, sv: Sv, carrier_hz: f64, node: u64) -> Option<(f64, f64)> {
        if self.strength.satellites.as_ref().is_some_and(|satellites| !satellites.contains(&sv)) {
            return None;
        }
        let length = BLOCK_NODES * self.step;
        let (block, index) = (node / length, (node % length) as usize);
        let found = {
            let fades = self.fades.lock().unwrap_or_else(PoisonError::into_inner);
            fades.get(&(sv, carrier_hz.to_bits())).and_then(|fade| fade.blocks.get(&block).cloned())
        };
        found.unwrap_or_else(|| self.block(sv, carrier_hz, block)).get(index).copied()
    }

    /// Fading at the nodes of a block, and of the blocks before it as far as their phase has not been
    /// followed yet.
    fn block(&self, sv: Sv, carrier_hz: f64, block: u64) -> Arc<Vec<(f64, f64)>> {
        let mut fades = self.fades.lock().unwrap_or_else(PoisonError::into_inner);
        let fade = fades.entry((sv, carrier_hz.to_bits())).or_insert_with(|| Fade::new(&self.strength, carrier_hz));
        let mut known = (fade.starts_rad.len() as u64).saturating_sub(1).min(block);
        loop {
            let start_rad = fade.starts_rad.get(known as usize).copied();
            let (nodes, next_rad) = self.follow(sv, fade, known, start_rad);
            if start_rad.is_none() {
                fade.starts_rad.push(nodes.first().map_or(0.0, |first| first.1));
            }
            if fade.starts_rad.len() as u64 == known + 1 {
                fade.starts_rad.push(next_rad);
            }
            if known == block {
                let nodes = Arc::new(nodes);
                fade.blocks.insert(block, Arc::clone(&nodes));
                while fade.blocks.len() > KEPT {
                    fade.blocks.pop_first();
                }
                return nodes;
            }
            known += 1;
        }
    }

    /// The nodes of a block with their phase followed from `start_rad`, and the phase at the next block's
    /// first.
    fn follow(&self, sv: Sv, fade: &Fade, block: u64, start_rad: Option<f64>) -> (Vec<(f64, f64)>, f64) {
        let first = block * BLOCK_NODES;
        // One node before and two behind, for the spline, and one more for the next block's first.
        let stream = self.stream.named(&sv.to_string());
        let fading = self.noise(stream, fade, first, BLOCK_NODES + 4);
        let mut phase_rad = start_rad;
        let mut nodes = Vec::with_capacity((BLOCK_NODES * self.step) as usize + 1);
        for window in fading.windows(4) {
            for k in 0..self.step {
                let u = k as f64 / self.step as f64;
                let [re, im, added] = [0, 1, 2].map(|c| between(window, c, u));
                let share = fade.share;
                let scale = (0.5 * (1.0 - share)).sqrt();
                let (re, im) = (share.sqrt() + scale * re, scale * im);
                let wrapped = libm::atan2(im, re) + fade.added_rad * added;
                // A deep fade turns the phase by less than half a cycle from node to node.
                let followed = phase_rad.map_or(wrapped, |last| wrapped + TAU * libm::round((last - wrapped) / TAU));
                phase_rad = Some(followed);
                nodes.push((libm::hypot(re, im), followed));
            }
        }
        // The last window began the next block.
        let next_rad = nodes.get((BLOCK_NODES * self.step) as usize).map_or(0.0, |node| node.1);
        nodes.truncate((BLOCK_NODES * self.step) as usize);
        (nodes, next_rad)
    }

    /// Three independent unit noises of the model's spectrum at `count` nodes from `first` on.
    ///
    /// From one band to the next ξ keeps the correlation of the two and takes the rest from a noise of its
    /// own: the correlation of any two is then the product of those between them, as a power of the ratio is.
    fn noise(&self, stream: Stream, fade: &Fade, first: u64, count: u64) -> Vec<[f64; 3]> {
        let (pairs, singles) = (stream.part(0), stream.part(1));
        let way: Vec<usize> = match fade.band {
            band if band < REFERENCE => (band..REFERENCE).rev().collect(),
            band => (REFERENCE + 1..=band).collect(),
        };
        let mut before_hz = REFERENCE_HZ;
        let steps: Vec<(Stream, f64)> = way
            .into_iter()
            .filter_map(|band| {
                let hz = *BANDS_HZ.get(band)?;
                let kept = self.strength.correlation(before_hz, hz);
                before_hz = hz;
                Some((stream.part(2 + band as u64), kept))
            })
            .collect();
        // The response reaches back; draws are numbered so that the first one is number 0.
        let draws: Vec<[f64; 3]> = (first..first + count + self.response.len() as u64 - 1)
            .map(|draw| {
                let (re, im) = steps.iter().fold(pairs.normals(draw), |(re, im), (own, kept)| {
                    let (new, rest) = (own.normals(draw), (1.0 - kept * kept).sqrt());
                    (kept * re + rest * new.0, kept * im + rest * new.1)
                });
                [re, im, if fade.added_rad > 0.0 { singles.normals(draw).0 } else { 0.0 }]
            })
            .collect();
        let filtered = |window: &[[f64; 3]]| {
            window
                .iter()
                .zip(self.response.iter().rev())
                .fold([0.0; 3], |sum, (draw, h)| [sum[0] + h * draw[0], sum[1] + h * draw[1], sum[2] + h * draw[2]])
        };
        draws.windows(self.response.len()).map(filtered).collect()
    }
}

/// Catmull and Rom's spline between the second and the third of four points.
fn between(window: &[[f64; 3]], component: usize, u: f64) -> f64 {
    let at = |k: usize| window.get(k).map_or(0.0, |point| point[component]);
    let (a, b, c, d) = (at(0), at(1), at(2), at(3));
    b + 0.5 * u * (c - a + u * (2.0 * a - 5.0 * b + 4.0 * c - d + u * (3.0 * (b - c) + d - a)))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn fading(s4: f64, sigma_phi_rad: Option<f64>, length: u64) -> Vec<(f64, f64)> {
        let strength = Strength { s4, sigma_phi_rad, decorrelation_s: 0.2, satellites: None };
        let fading = Scintillation::new(strength, Rate::from_hz(2.6e6).unwrap(), Stream::new(3, "test"));
        (0..length).map(|node| fading.at(Sv::gps(7), REFERENCE_HZ, node).unwrap()).collect()
    }

    #[test]
    fn index_and_phase_spread_come_back_from_the_fading() {
        // 2400 s are some 6000 independent intensities (Butterworth noise of 0.2 s). Their variance scatters
        // by √(8/6000) at most, that of an exponential law, S4 by half of it: 10 % are more than five sigma.
        for (s4, sigma) in [(0.3, None), (0.5, Some(0.6)), (0.7, None), (0.0, Some(0.4))] {
            let nodes = fading(s4, sigma, 3_000_000);
            let n = nodes.len() as f64;
            let power = |p: i32| nodes.iter().map(|(gain, _)| gain.powi(p)).sum::<f64>() / n;
            let found = (power(4) / power(2).powi(2) - 1.0).max(0.0).sqrt();
            assert!((power(2) - 1.0).abs() < 0.05 && (found - s4).abs() <= 0.1 * s4 + 1e-9, "{s4}: {found}");
            let wrapped: Vec<f64> = nodes.iter().map(|(_, phase)| phase - TAU * (phase / TAU).round()).collect();
            let spread = (wrapped.iter().map(|x| x * x).sum::<f64>() / n).sqrt();
            let strength = Strength { s4, sigma_phi_rad: None, decorrelation_s: 0.2, satellites: None };
            let expected = sigma.unwrap_or_else(|| strength.intrinsic_phase_rad());
            assert!((spread / expected - 1.0).abs() < 0.1, "{s4} {sigma:?}: {spread} {expected}");
        }
    }

    #[test]
    fn the_fading_decorrelates_as_the_model_says() {
        let rate = Rate::from_hz(2.6e6).unwrap();
        let strength = Strength { s4: 0.5, sigma_phi_rad: None, decorrelation_s: 0.2, satellites: None };
        let fading = Scintillation::new(strength, rate, Stream::new(3, "test"));
        let step_s = rate.elapsed_s(node_samples(rate)) * fading.step as f64;
        let noise = fading.noise(fading.stream, &Fade::new(&fading.strength, REFERENCE_HZ), 0, 60_000);
        for lag in [0, 8, 16, 32, 64] {
            let products = noise.iter().zip(&noise[lag..]).map(|(a, b)| a[0] * b[0] + a[1] * b[1]);
            let found = products.sum::<f64>() / (2 * (noise.len() - lag)) as f64;
            let x = DECAY * lag as f64 * step_s / 0.2;
            let expected = libm::exp(-x) * (libm::cos(x) + libm::sin(x));
            // 60 000 nodes of both components hold some 1600 independent values each: 5 sigma is 0.09.
            assert!((found - expected).abs() < 0.09, "{lag}: {found} {expected}");
        }
    }

    #[test]
    fn the_phase_is_followed_through_fades_whichever_block_is_asked_first() {
        let ordered = fading(0.9, None, 40_000);
        assert!(ordered.windows(2).all(|pair| (pair[1].1 - pair[0].1).abs() < PI));
        let strength = Strength { s4: 0.9, sigma_phi_rad: None, decorrelation_s: 0.2, satellites: None };
        let late = Scintillation::new(strength, Rate::from_hz(2.6e6).unwrap(), Stream::new(3, "test"));
        assert_eq!(late.at(Sv::gps(7), REFERENCE_HZ, 39_000), ordered.get(39_000).copied());
        assert_eq!(late.at(Sv::gps(7), REFERENCE_HZ, 10), ordered.get(10).copied());
    }

    #[test]
    fn rice_amplitudes_of_a_weak_index_have_the_phase_spread_of_small_noise() {
        // For small S4 intensity and phase come from ξ along and across: σφ = S4 / 2. The next order is 3/8
        // S4² from K = 2/S4² − 3/2 and as much again from the arc tangent's.
        let strength = Strength { s4: 0.05, sigma_phi_rad: None, decorrelation_s: 1.0, satellites: None };
        assert!((strength.intrinsic_phase_rad() / 0.025 - 1.0).abs() < 0.05 * 0.05);
    }

    #[test]
    fn weaker_carriers_fade_more_turn_more_and_not_at_once() {
        const L2_HZ: f64 = 1_227.6e6;
        const L5_HZ: f64 = 1_176.45e6;
        // 800 s are some 2000 independent intensities. Their variance scatters by √(8/2000) at most, 6 %, S4
        // by half of it; correlations of them by √(5/2000), 5 %: the bars are more than three of these.
        for (s4, sigma, saturated) in [(0.25, Some(0.5), false), (0.8, None, true)] {
            let strength = Strength { s4, sigma_phi_rad: sigma, decorrelation_s: 0.2, satellites: None };
            let fading = Scintillation::new(strength.clone(), Rate::from_hz(2.6e6).unwrap(), Stream::new(11, "test"));
            let of = |hz: f64| -> Vec<(f64, f64)> {
                (0..1_000_000).map(|node| fading.at(Sv::gps(7), hz, node).unwrap()).collect()
            };
            let bands = [REFERENCE_HZ, L2_HZ, L5_HZ].map(|hz| (hz, of(hz)));
            let mean = |values: &dyn Fn(usize) -> f64| (0..1_000_000).map(values).sum::<f64>() / 1e6;
            let intensity = |band: &[(f64, f64)], i: usize| band[i].0 * band[i].0;
            let moments = |band: &[(f64, f64)]| {
                let first = mean(&|i| intensity(band, i));
                (first, (mean(&|i| intensity(band, i).powi(2)) - first * first).sqrt())
            };
            for (hz, band) in &bands {
                let (first, spread) = moments(band);
                let expected = (s4 * libm::pow(1_575.42e6 / hz, 1.5)).min(1.0);
                assert!((spread / first / expected - 1.0).abs() < 0.1, "{hz}: S4 {} of {expected}", spread / first);
                if let Some(sigma) = sigma {
                    let wrapped = |i: usize| band[i].1 - TAU * (band[i].1 / TAU).round();
                    let found = mean(&|i| wrapped(i).powi(2)).sqrt();
                    assert!((found * hz / 1_575.42e6 / sigma - 1.0).abs() < 0.1, "{hz}: {found} rad");
                }
            }
            let correlation = |a: &[(f64, f64)], b: &[(f64, f64)]| {
                let ((first_a, spread_a), (first_b, spread_b)) = (moments(a), moments(b));
                (mean(&|i| intensity(a, i) * intensity(b, i)) - first_a * first_b) / (spread_a * spread_b)
            };
            // Of z + ξ with z² and ξ's power of each band: 2z₁z₂·ρ√(ξ₁ξ₂) + ρ²ξ₁ξ₂ over both spreads, the
            // indices.
            let expected = |one_hz: f64, other_hz: f64| {
                let share = |hz: f64| strength.on(hz).share();
                let [one, other] = [share(one_hz), share(other_hz)];
                let rho = libm::pow(other_hz / one_hz, 0.5 + s4 * s4);
                let scattered = (1.0 - one) * (1.0 - other);
                let spreads = strength.on(one_hz).s4 * strength.on(other_hz).s4;
                (2.0 * (one * other * scattered).sqrt() * rho + rho * rho * scattered) / spreads
            };
            let [l1, l2, l5] = &bands;
            let (across, near) = (correlation(&l1.1, &l2.1), correlation(&l2.1, &l5.1));
            println!("S4 {s4}: L1 with L2 {across:.3}, L2 with L5 {near:.3}");
            for (found, expected) in [(across, expected(l1.0, l2.0)), (near, expected(l2.0, l5.0))] {
                assert!((found - expected).abs() < 0.15, "{s4}: {found} of {expected}");
            }
            // Deep fades come on one band at a time, on near carriers together.
            assert!(near > across + 0.05 && (across < 0.45) == saturated, "{s4}: {across} {near}");
        }
    }
}
