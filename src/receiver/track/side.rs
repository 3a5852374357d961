//! A code that rests on a side peak of its correlation, as BOC has them: it is seen, and moved to the main
//! one.
//!
//! **Statistic.** Two correlators follow the neighbouring peaks. The noise of taps is correlated as the
//! code is, so where the phase of each period is unknown, how likely the main peak is at a tap depends on
//! that tap's power alone: what the others show follows from it. Hence D, the power of a neighbour less the
//! prompt's, period by period, without any help of phase, secondary code or symbols; it works from the first
//! period on.
//!
//! **Decision.** Let noise have unit variance a component, the main peak the amplitude A = √(2·T·C/N0), a
//! side peak c·A, and s² = 1 − c². On the main peak ln E exp(wD) = −ln(1 − 4s²w²) − w·s²·A²·(1 − 2w)/(1 −
//! 4s²w²). With −ln(1 − x) ≤ x/(1 − x) that is zero or less for w ≤ A²/(2·(2 + A²)), whatever c. So the sum
//! of wD, held above zero, exceeds h in e^h periods on average or later (E. S. Page, Biometrika 41, 1954; G.
//! Lorden, Ann. Math. Stat. 42, 1971), and h follows from the time between false moves. On a side peak D is
//! s²·A² on average and the move comes after about h/(w·s²·A²) periods: a dozen at 32 dB-Hz and 4 ms. Half
//! that w is used: by the same steps it holds while an echo raises a neighbour to three quarters of the
//! prompt's amplitude (c = 1/2). A C/N0 that is taken too low, as it is on a side peak, only costs time.
//!
//! **Move.** Code by the distance of the peaks, the carrier by half a cycle where their signs differ: loops,
//! lock and the search for the secondary code go on. Limits: of pulses with more side peaks the code moves
//! from one to the next.

use super::model::{SidePeak, side_peak, side_peak_of_both};
use crate::correlate::chips_to_units;
use gnss::signal::{Component, Layers};

/// Mean time between false moves of a channel on the main peak, at least: ten years.
const BETWEEN_FALSE_S: f64 = 3.15e8;
/// Share of the largest weight that is used; the rest is margin for echoes.
const WEIGHT_SHARE: f64 = 0.5;

/// The evidence for a main peak beside the prompt.
#[derive(Clone, Debug)]
pub struct SidePeaks {
    /// Distance from a peak to the next, in code phase units.
    step: i64,
    /// Correlation there over that of the main peak.
    ratio: f64,
    /// Evidence beyond which the code is moved.
    enough: f64,
    /// Evidence for a main peak ahead of the prompt, and behind.
    evidence: [f64; 2],
}

impl SidePeaks {
    /// `None` where the correlation has one peak.
    pub fn new(component: &Component, made: Layers) -> Option<Self> {
        Some(Self::at(side_peak(component, made)?, component))
    }

    /// Side peaks of both sidebands of a sub-carrier that are tracked together, of which `component` is one.
    pub fn of_both_sides(component: &Component) -> Option<Self> {
        Some(Self::at(side_peak_of_both(component)?, component))
    }

    fn at(peak: SidePeak, component: &Component) -> Self {
        // Two sums may go wrong.
        let enough = libm::log(2.0 * BETWEEN_FALSE_S / component.period_s());
        Self { step: chips_to_units(peak.chips), ratio: peak.ratio, enough, evidence: [0.0; 2] }
    }

    /// Code phases of the neighbours, ahead of the prompt and behind.
    pub fn taps(&self) -> [i64; 2] {
        [self.step, -self.step]
    }

    /// Correlation on a side peak over that of the main peak.
    pub fn ratio(&self) -> f64 {
        self.ratio
    }

    /// Evidence beyond which the code is moved.
    pub fn enough(&self) -> f64 {
        self.enough
    }

    /// Weight of each difference of powers in the evidence, where the prompt has T·C/N0 of `snr`.
    pub fn weight(snr: f64) -> f64 {
        let square = 2.0 * snr;
        WEIGHT_SHARE * square / (2.0 * (2.0 + square))
    }

    /// Takes the powers of a code period at the prompt and at its neighbours, of noise of unit variance a
    /// component; `snr` is T·C/N0 of the prompt. Gives the way of the code to the main peak, in code phase
    /// units.
    pub fn add(&mut self, prompt: f64, neighbours: [f64; 2], snr: f64) -> Option<i64> {
        let weight = Self::weight(snr);
        for (evidence, power) in self.evidence.iter_mut().zip(neighbours) {
            *evidence = (*evidence + weight * (power - prompt)).max(0.0);
        }
        let [ahead, behind] = self.evidence;
        if ahead.max(behind) <= self.enough {
            return None;
        }
        self.evidence = [0.0; 2];
        Some(if ahead > behind { self.step } else { -self.step })
    }
}

#[cfg(test)]
mod tests {
    use num_complex::Complex64;

    use super::*;
    use crate::correlate::units_to_chips;
    use crate::track::tests::Normal;
    use gnss::gps::l1ca::L1_CA;
    use gnss::signal::synthetic::{LONG_BOC, MIXED};

    /// Prompt, ahead and behind of a code period with amplitudes and noise that is correlated as BOC(1,1).
    fn powers(normal: &mut Normal, amplitudes: [f64; 3]) -> (f64, [f64; 2]) {
        let mut draw = || Complex64::new(normal.next(), normal.next());
        let (prompt, ahead, behind) = (draw(), draw(), draw());
        // Of covariances −1/2 with the prompt and 0 with each other.
        let ahead = 0.75_f64.sqrt() * ahead - 0.5 * prompt;
        let behind = (2.0_f64 / 3.0).sqrt() * behind - 0.5 * prompt - (ahead + 0.5 * prompt) / 3.0;
        let [a, b, c] = amplitudes;
        ((prompt + a).norm_sqr(), [(ahead + b).norm_sqr(), (behind + c).norm_sqr()])
    }

    fn peaks(enough: f64) -> SidePeaks {
        SidePeaks { enough, ..SidePeaks::new(&LONG_BOC.components[1], Layers::Strongest).unwrap() }
    }

    #[test]
    fn signals_of_one_peak_are_not_looked_at() {
        assert!(SidePeaks::new(&L1_CA.components[0], Layers::Strongest).is_none());
        for component in [&LONG_BOC.components[1], &MIXED.components[0]] {
            let peaks = SidePeaks::new(component, Layers::Strongest).unwrap();
            assert_eq!((units_to_chips(peaks.step), peaks.ratio), (0.5, -0.5));
        }
    }

    #[test]
    fn false_moves_are_as_rare_as_the_bound_says_with_an_echo_and_without() {
        // One in a thousand periods at most: so many periods bring 200 at most on average, three deviations
        // more are 242.
        const PERIODS: u32 = 200_000;
        let mut normal = Normal::new(71);
        for snr in [0.2, 1.0, 4.0, 20.0, 100.0] {
            let amplitude = (2.0_f64 * snr).sqrt();
            // An echo that makes prompt and neighbours weaker, but one of these not so much.
            for ratios in [[1.0, -0.5, -0.5], [1.0, -0.75, -0.4]] {
                let mut peaks = peaks(libm::log(2000.0));
                let moves = (0..PERIODS)
                    .filter(|_| {
                        let (prompt, neighbours) = powers(&mut normal, ratios.map(|ratio| ratio * amplitude));
                        peaks.add(prompt, neighbours, snr).is_some()
                    })
                    .count();
                println!("T·C/N0 {snr}, {ratios:?}: {moves} false moves in {PERIODS} periods");
                assert!(moves <= 242, "{snr} {ratios:?}: {moves}");
            }
        }
    }

    #[test]
    fn the_way_to_the_main_peak_is_found_within_a_quarter_second_from_32_dbhz_on() {
        let mut normal = Normal::new(72);
        let component = &LONG_BOC.components[1];
        for dbhz in [32.0, 37.0, 47.0] {
            let snr = component.period_s() * libm::pow(10.0, 0.1 * dbhz);
            let amplitude = (2.0 * snr).sqrt();
            let (mut sum, mut most) = (0, 0);
            for run in 0..200 {
                let mut peaks = SidePeaks::new(component, Layers::Strongest).unwrap();
                let way = if run % 2 == 0 { [-0.5, 1.0, 0.0] } else { [-0.5, 0.0, 1.0] };
                let found = (1..1000).find_map(|periods| {
                    let (prompt, neighbours) = powers(&mut normal, way.map(|ratio| ratio * amplitude));
                    // The C/N0 that a side peak shows.
                    Some((periods, peaks.add(prompt, neighbours, 0.25 * snr)?))
                });
                let (periods, units) = found.unwrap();
                assert_eq!(units_to_chips(units), if run % 2 == 0 { 0.5 } else { -0.5 }, "{dbhz}");
                (sum, most) = (sum + periods, most.max(periods));
            }
            println!("{dbhz} dB-Hz: {:.1} periods on average, {most} at most", f64::from(sum) / 200.0);
            assert!(f64::from(most) * component.period_s() < 0.25, "{dbhz}: {most} periods");
        }
    }
}
