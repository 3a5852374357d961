//! Choice of a satellite's Doppler, of its threshold there, and of the columns that need all sums before both
//! are known.
//!
//! A search may leave Dopplers early ([`super::dwells`]). The law of a crowded Doppler is then unknown,
//! because it needs the largest cells of all codes ([`super::multiple_access`]). The first threshold is seven
//! tenths of the value expected from the codes' first dwells, and not below the value that nine codes in ten
//! stay below. A satellite that passes it without being sure has its column filled. All choices are then made
//! again, until no such satellite is left. Columns whose first dwells show noise are excepted. So no
//! satellite is found below the threshold of a search without leaving.

use std::collections::BTreeSet;

#[cfg(test)]
use super::grid::Peaks;
use super::grid::{Grid, Map, Peak, Strip};
use super::multiple_access::{LEAST_CODES, Raised};

/// Ratio of a statistic to its threshold that needs no column. Without a known threshold it is the ratio to
/// the values that other codes reach. Cross-correlations of a family differ by less.
const SURE: f64 = 4.0;
/// Share of the expected threshold that a satellite has to exceed for its column to be filled. Where noise
/// dominates the first dwells, the threshold is 0.8 of the value expected from them.
const DOUBTFUL: f64 = 0.7;

/// Position of the largest value, of equal ones the first.
fn place_of_largest(values: &[f64]) -> usize {
    (0..values.len()).fold(0, |best, n| if values[n] > values[best] { n } else { best })
}

impl Grid {
    /// The best Doppler of every satellite, its number first, and the crowded ones.
    pub fn peaks(&self, map: &Map, satellites: usize) -> (Vec<(usize, Peak)>, Vec<usize>) {
        let strips = &map.strips;
        let heights: Vec<Vec<f64>> = (0..satellites).map(|satellite| self.heights(strips, satellite)).collect();
        let image = |bin: usize| self.dopplers_hz.get(bin).is_some_and(|doppler_hz| self.meets_image(*doppler_hz));
        let mut bar = self.law.bar(&heights, image);
        let mut sure: Vec<f64> = bar.thresholds.iter().map(|threshold| SURE * threshold).collect();
        for (bin, raised) in map.raised.iter().enumerate() {
            let known = strips[bin].iter().all(|strip| strip.sums == self.sums);
            if let (Raised::Yes(others), false) = (*raised, known) {
                sure[bin] = sure[bin].max(SURE * others);
                let expected = DOUBTFUL * self.law.beyond(others);
                bar.thresholds[bin] = bar.thresholds[bin].max(others).max(expected);
            }
        }
        let choice = |(satellite, heights): (usize, &Vec<f64>)| {
            let shares: Vec<f64> = heights.iter().zip(&bar.thresholds).map(|(height, least)| height / least).collect();
            // Of one that is surely there side lobes in Doppler may meet lower thresholds.
            let highest = place_of_largest(heights);
            let bin = if heights[highest] >= sure[highest] { highest } else { place_of_largest(&shares) };
            let (statistic, threshold) = (heights[bin], bar.thresholds[bin]);
            let summit = self.summit(strips, satellite, heights, bin);
            let (doppler_hz, half_lag) = (self.dopplers_hz[summit], strips[summit][satellite].half_lag);
            (bin, Peak { statistic, threshold, is_sure: statistic >= sure[bin], doppler_hz, half_lag })
        };
        (heights.iter().enumerate().map(choice).collect(), bar.crowded)
    }

    /// The Doppler at which the lobe of a peak is highest, at the peak's code phase. The slope of a lobe
    /// passes alone where other satellites raise the threshold of its top.
    fn summit(&self, strips: &[Vec<Strip>], satellite: usize, heights: &[f64], bin: usize) -> usize {
        let (halves, half_lag) = (2 * self.lags, |bin: usize| strips[bin][satellite].half_lag);
        let is_own = |other: &usize| {
            let apart = half_lag(*other).abs_diff(half_lag(bin));
            apart.min(halves - apart.min(halves)) <= 2 * self.near_cells()
        };
        self.lobe(bin).filter(is_own).fold(bin, |best, n| if heights[n] > heights[best] { n } else { best })
    }

    /// Numbers of the Dopplers within the inverse coherent time of one.
    fn lobe(&self, bin: usize) -> impl Iterator<Item = usize> {
        let lobe_hz = self.rate_hz / (f64::from(self.coherent_periods) * self.period_samples);
        let centre_hz = self.dopplers_hz[bin];
        (self.dopplers_hz.iter().enumerate())
            .filter_map(move |(n, doppler_hz)| ((doppler_hz - centre_hz).abs() < lobe_hz).then_some(n))
    }

    /// Dopplers and satellites whose lobe passes beside one that other satellites raise, where it was left.
    pub fn left_lobes(&self, map: &Map, peaks: &[(usize, Peak)]) -> Vec<(usize, usize)> {
        let passing = peaks.iter().enumerate().filter(|(_, (_, peak))| peak.statistic >= peak.threshold);
        let left = |satellite: usize, bin: usize| {
            matches!(map.raised[bin], Raised::Yes(_)) && map.strips[bin][satellite].sums < self.sums
        };
        passing
            .flat_map(|(satellite, (bin, _))| self.lobe(*bin).map(move |other| (other, satellite)))
            .filter(|(bin, satellite)| left(*satellite, *bin))
            .collect()
    }

    /// True if a Doppler may be crowded but lacks sums of some codes.
    pub fn is_unknown(&self, map: &Map, bin: usize) -> bool {
        map.raised[bin] != Raised::No && map.strips[bin].iter().any(|strip| strip.sums < self.sums)
    }

    /// Numbers of the Dopplers at which a satellite seems to be that may be cross-correlation, and that are
    /// open for it: not all sums of all codes are there.
    pub fn doubtful(&self, peaks: &[(usize, Peak)], is_open: impl Fn(usize, usize) -> bool) -> BTreeSet<usize> {
        if self.is_pair || peaks.len() < LEAST_CODES {
            return BTreeSet::new();
        }
        let doubtful = |(satellite, (bin, peak)): (usize, &(usize, Peak))| {
            let unsure = peak.statistic >= peak.threshold && !peak.is_sure;
            (unsure && is_open(*bin, satellite)).then_some(*bin)
        };
        peaks.iter().enumerate().filter_map(doubtful).collect()
    }

    /// The largest cell of a satellite at every Doppler, zero where that was left, over the noise floor of
    /// all its maps. Of each Doppler whose own largest cell lies at the peak's code phase, the neighbourhood
    /// is left out of the floor.
    fn heights(&self, strips: &[Vec<Strip>], satellite: usize) -> Vec<f64> {
        let column = || strips.iter().filter_map(|strip| strip.get(satellite));
        let scaled: Vec<f64> = (column().zip(&self.dopplers_hz))
            .map(|(strip, &doppler_hz)| {
                let whole = if strip.sums == self.sums { f64::from(strip.peak) } else { 0.0 };
                whole * if self.meets_image(doppler_hz) { self.image_scale } else { 1.0 }
            })
            .collect();
        let best = column().nth(place_of_largest(&scaled)).map_or(0, |strip| strip.half_lag);
        let halves = 2 * self.lags;
        let (mut total, mut powers) = (0.0, 0.0);
        for strip in column() {
            let apart = strip.half_lag.abs_diff(best);
            let same = apart.min(halves - apart.min(halves)) <= 2 * self.near_cells();
            let out = same && strip.sums == self.sums;
            total += strip.total - if out { strip.near } else { 0.0 };
            powers += f64::from(strip.sums) * (self.lags - if out { strip.near_cells } else { 0 }) as f64;
        }
        let floor = total / (2.0 * powers.max(1.0));
        scaled.into_iter().map(|height| if floor > 0.0 { height / floor } else { 0.0 }).collect()
    }

    /// Dopplers at which a peak may be cross-correlation and was not judged by all codes' sums.
    #[cfg(test)]
    pub fn unjudged(&self, peaks: &Peaks) -> usize {
        let bin = |peak: &Peak| self.dopplers_hz.iter().position(|doppler_hz| *doppler_hz == peak.doppler_hz);
        let numbered: Vec<(usize, Peak)> = peaks.of.iter().map(|peak| (bin(peak).unwrap(), *peak)).collect();
        self.doubtful(&numbered, |bin, _| self.is_unknown(&peaks.map, bin)).len()
    }

    /// Sums that were made, of all that a search without leaving makes.
    #[cfg(test)]
    pub fn share_made(&self, peaks: &Peaks) -> f64 {
        let made: u32 = peaks.map.strips.iter().flatten().map(|strip| strip.sums).sum();
        f64::from(made) / (f64::from(self.sums) * peaks.map.strips.iter().flatten().count() as f64)
    }
}
