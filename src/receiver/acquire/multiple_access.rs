//! Thresholds of peaks where cross-correlation with other signals raises the cells.
//!
//! C/A codes repeat every millisecond. Another satellite therefore shows in every Doppler bin that differs
//! from its own by a multiple of 1 kHz: in a quarter of the cells at −24 dB, in some up to −21 dB, equal in
//! every sum. Those cells are not chi-square about the map's noise floor, and their tail is much longer. The
//! source can be a satellite that was not found yet, or one beyond the searched Dopplers. It can also be
//! another system with codes of the same family, or the rest of a subtraction.
//!
//! All codes that are searched for meet those signals alike, and few of the codes are present. So the largest
//! cells of all codes in one Doppler bin are a sample of that bin's own distribution. Where their median
//! exceeds that of noise, the bin is *crowded*. Cross-correlation of a code family is bounded. Beyond the
//! values that many codes reach, there is only noise about a cross-correlation. Such noise adds to the
//! amplitude: the root of a cell is nearly normal with unit deviation, whatever its mean.
//!
//! The bar in amplitude is a sum of three terms. The first is the bin's median. The second is the [`REACHED`]
//! quantile of the codes' excess over the medians of their bins, all crowded bins together. The third is the
//! distance of a normal variable from that quantile to the false alarm. Elsewhere the threshold is that of
//! noise. Limits: fewer codes than [`LEAST_CODES`] give no estimate, and a bin that is raised by less than
//! 0.7 dB is not noticed.

use crate::threshold::{of_one_cell, threshold};

/// Fewer codes are no sample.
pub(super) const LEAST_CODES: usize = 12;
/// A bin is crowded when its median is so many standard deviations above that of noise.
const CROWDED: f64 = 5.0;
/// Share of the rise below which a bin counts as quiet after the first half of its sums. The median of a bin
/// that is crowded by all sums is raised by half of [`CROWDED`] then. It shows as little in one case of 40.
const QUIET: f64 = 0.5;
/// Standard deviation of a Gumbel sample's median over scale, times √n: 1 / (2 × density there, ½ ln 2) =
/// 1/ln 2.
const MEDIAN_SPREAD: f64 = std::f64::consts::LOG2_E;
/// Quantile of what the codes reach in crowded bins: few of them are those of satellites that are there.
const REACHED: f64 = 0.9;
/// Amplitudes of which more than a tenth of the codes lie beyond so many times the median, and so many
/// deviations of noise, are those of satellites that are there: NavIC has fourteen codes and three satellites
/// and more at one Doppler.
const OWN_RATIO: f64 = 1.5;
const OWN_DEVIATIONS: f64 = 4.0;
/// Share of a bin's cells that a cross-correlation raises to its largest values, at least.
const RAISED: f64 = 1.0 / 16.0;

/// The law of the largest cell of one Doppler bin.
#[derive(Clone, Copy, Debug)]
pub(super) struct Law {
    /// Threshold of a peak in noise alone.
    pub threshold: f64,
    /// Deviations of a normal variable from the [`REACHED`] quantile of a bin's largest cell to the false
    /// alarm.
    further: f64,
    /// Median and scale of a bin's largest cell in noise: circular, and where a carrier meets its image.
    circular: (f64, f64),
    image: (f64, f64),
    /// Deviation of a cell's root where a carrier meets its image; one elsewhere.
    image_deviation: f64,
}

/// Effect of cross-correlation on the cells of all codes in a bin.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Raised {
    No,
    /// The rise cannot be told from noise, or too few codes were seen.
    Perhaps,
    /// The bin is raised: nine codes in ten stay below this value.
    Yes(f64),
}

/// Thresholds of the peaks, bin by bin.
pub(super) struct Bar {
    pub thresholds: Vec<f64>,
    /// Numbers of the bins that other signals raise.
    pub crowded: Vec<usize>,
}

/// Standardised quantiles of a Gumbel law: −ln(−ln p).
fn gumbel(probability: f64) -> f64 {
    -libm::log(-libm::log(probability))
}

impl Law {
    /// A law for bins of `cells` cells, each with `sums` powers, in a search of `bins` bins with a total of
    /// `false_alarm`. Statistics with one degree of freedom per sum were multiplied by `image_scale`.
    pub fn new(false_alarm: f64, cells: usize, bins: usize, sums: u32, image_scale: f64) -> Self {
        let per_cell = of_one_cell(false_alarm, (cells * bins) as f64);
        // A share p of bins stays below the value that a cell exceeds with 1 − p^(1/cells).
        let below = |p: f64| of_one_cell(1.0 - p, cells as f64);
        let of = |value: &dyn Fn(f64) -> f64| {
            let (median, upper) = (value(below(0.5)), value(below(0.75)));
            (median, (upper - median) / (gumbel(0.75) - gumbel(0.5)))
        };
        let raised = RAISED * cells as f64;
        let normal = |of_a_bin: f64| threshold(2.0 * of_one_cell(of_a_bin, raised), 1).sqrt();
        Self {
            threshold: threshold(per_cell, 2 * sums),
            further: normal(of_one_cell(false_alarm, bins as f64)) - normal(1.0 - REACHED),
            circular: of(&|p| threshold(p, 2 * sums)),
            image: of(&|p| 2.0 * image_scale * threshold(p, sums)),
            image_deviation: (2.0 * image_scale).sqrt(),
        }
    }

    /// The bar of every bin, from the largest cells there: `heights[code][bin]`; `image` says where noise is
    /// not circular.
    pub fn bar(&self, heights: &[Vec<f64>], image: impl Fn(usize) -> bool) -> Bar {
        let bins = heights.first().map_or(0, Vec::len);
        let mut bar = Bar { thresholds: vec![self.threshold; bins], crowded: Vec::new() };
        let (mut crowded, mut beyond) = (Vec::new(), Vec::new());
        for bin in 0..bins {
            let column = heights.iter().filter_map(|code| code.get(bin).copied()).collect();
            if let Some((median_root, excesses)) = self.crowded(column, image(bin)) {
                crowded.push((bin, median_root));
                beyond.extend(excesses);
            }
        }
        if crowded.is_empty() {
            return bar;
        }
        let reached = quantile(&mut beyond, REACHED);
        for (bin, median_root) in crowded {
            bar.crowded.push(bin);
            let deviation = if image(bin) { self.image_deviation } else { 1.0 };
            let root = median_root + reached + deviation * self.further;
            bar.thresholds[bin] = self.threshold.max(root * root);
        }
        bar
    }

    /// Effect of cross-correlation on a bin after a part of the sums, from the largest cells of all codes.
    /// Noise is circular.
    pub fn raised(&self, column: Vec<f64>) -> Raised {
        if column.len() < LEAST_CODES {
            return Raised::Perhaps;
        }
        let (median, mut beyond) = median_and_excesses(column);
        let deviations = self.deviations(median, beyond.len(), false);
        if deviations > CROWDED {
            let root = median.sqrt() + quantile(&mut beyond, REACHED);
            Raised::Yes(root * root)
        } else if deviations > QUIET {
            Raised::Perhaps
        } else {
            Raised::No
        }
    }

    /// Threshold of a peak in a crowded bin where nine codes in ten stay below `reached`.
    pub fn beyond(&self, reached: f64) -> f64 {
        let root = reached.sqrt() + self.further;
        root * root
    }

    /// The root of the median of the largest cells of a crowded bin and by how much each exceeds that, in
    /// amplitude.
    fn crowded(&self, column: Vec<f64>, image: bool) -> Option<(f64, Vec<f64>)> {
        if column.len() < LEAST_CODES {
            return None;
        }
        let (median, beyond) = median_and_excesses(column);
        (self.deviations(median, beyond.len(), image) > CROWDED).then(|| (median.sqrt(), beyond))
    }

    /// Excess of the median of `codes` codes over that of noise, in its standard deviations.
    fn deviations(&self, median: f64, codes: usize, image: bool) -> f64 {
        let (place, scale) = if image { self.image } else { self.circular };
        (median - place) / (MEDIAN_SPREAD * scale / (codes as f64).sqrt())
    }
}

/// The median of a bin's largest cells without those of satellites that are there, as far as these stand
/// out, and by how much each of the others exceeds it, in amplitude.
fn median_and_excesses(mut column: Vec<f64>) -> (f64, Vec<f64>) {
    let mut median = quantile(&mut column, 0.5);
    if stands_out(&column, median) {
        column.retain(|height| !is_beyond_cross_correlation(*height, median));
        median = quantile(&mut column, 0.5);
    }
    (median, column.iter().map(|height| height.sqrt() - median.sqrt()).collect())
}

/// True if more codes than the quantile allows are higher than cross-correlation explains.
fn stands_out(column: &[f64], median: f64) -> bool {
    let beyond = column.iter().filter(|height| is_beyond_cross_correlation(**height, median)).count();
    beyond as f64 > (1.0 - REACHED) * column.len() as f64
}

/// True if a cell is a satellite's own. Cross-correlations of a family differ by a factor of √2 in amplitude.
fn is_beyond_cross_correlation(height: f64, median: f64) -> bool {
    height.sqrt() > OWN_RATIO * median.sqrt() + OWN_DEVIATIONS
}

/// The value below which that share of the values lies; sorts them.
fn quantile(values: &mut [f64], share: f64) -> f64 {
    values.sort_by(f64::total_cmp);
    let place = share * values.len().saturating_sub(1) as f64;
    let at = |index: usize| values.get(index).copied().unwrap_or(0.0);
    let (below, part) = (place as usize, place.fract());
    at(below) + part * (at((below + 1).min(values.len().saturating_sub(1))) - at(below))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::acquire::tests::Noise;

    /// Largest of `cells` chi-square values of 20 degrees, by the inverse of its law.
    fn largest(uniform: f64, cells: f64) -> f64 {
        threshold(of_one_cell(1.0 - uniform, cells), 20)
    }

    fn uniforms(count: usize) -> impl FnMut() -> Vec<f64> {
        let mut state = 3_u64;
        let mut next = move || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            ((state >> 11) as f64 + 0.5) / (1_u64 << 53) as f64
        };
        move || (0..count).map(|_| next()).collect()
    }

    #[test]
    fn in_noise_no_bin_is_crowded_and_the_threshold_is_that_of_chi_square() {
        let law = Law::new(1e-6, 3069, 41, 10, 1.0);
        let mut draw = uniforms(32);
        let mut crowded = 0;
        for _ in 0..40 {
            let heights: Vec<Vec<f64>> =
                (0..41).map(|_| draw().into_iter().map(|u| largest(u, 3069.0)).collect()).collect();
            let heights: Vec<Vec<f64>> = (0..32).map(|code| heights.iter().map(|bin| bin[code]).collect()).collect();
            let bar = law.bar(&heights, |_| false);
            crowded += bar.crowded.len();
            assert!(!bar.crowded.is_empty() || bar.thresholds.iter().all(|x| *x == law.threshold));
        }
        // Five deviations: 3e-7 of 1640 bins, if the median were normal.
        assert!(crowded <= 1, "{crowded}");
        // Table of chi-square with 20 degrees: 1e-6/125829 is exceeded above 95.5.
        assert!((law.threshold - 95.5).abs() < 0.1, "{}", law.threshold);
    }

    #[test]
    fn satellites_that_share_a_doppler_do_not_hide_each_other() {
        // Fourteen codes, of which four are there at one Doppler and raise it for the other ten.
        let law = Law::new(1e-6, 3069, 41, 10, 1.0);
        let mut noise = Noise(23);
        for present in [600.0, 1600.0] {
            let heights: Vec<Vec<f64>> = (0..14)
                .map(|code| {
                    let own = if code < 4 { present } else { largest_of_raised(&mut noise, 3069, 5.0) };
                    (0..41).map(|bin| if bin == 20 { own } else { largest(0.5, 3069.0) }).collect()
                })
                .collect();
            let bar = law.bar(&heights, |_| false);
            assert_eq!(bar.crowded, [20]);
            let others = heights.iter().skip(4).map(|code| code[20]).fold(0.0, f64::max);
            // Over all others, and far below the four.
            assert!((others..0.5 * present).contains(&bar.thresholds[20]), "{} {others}", bar.thresholds[20]);
        }
    }

    /// Largest of `cells` sums of ten powers, a quarter of which has an amplitude of `raised` over all
    /// sums, noise of unit variance a component.
    fn largest_of_raised(noise: &mut Noise, cells: usize, raised: f64) -> f64 {
        let mut cell = |k: usize| {
            let (along, others) = noise.pair();
            let along = along + if k.is_multiple_of(4) { raised } else { 0.0 };
            // The other 19 components, by Wilson and Hilferty: right to a percent where it decides.
            let spread = 2.0 / (9.0 * 19.0_f64);
            let root = 1.0 - spread + others * spread.sqrt();
            along * along + 19.0 * root * root * root
        };
        (0..cells).map(&mut cell).fold(0.0, f64::max)
    }

    #[test]
    fn a_raised_bin_is_passed_as_seldom_as_it_is_set_and_a_little_above_suffices() {
        const CELLS: usize = 1000;
        const BINS: usize = 9;
        let law = Law::new(1e-2, CELLS, BINS, 10, 1.0);
        for raised in [4.0, 6.0, 10.0] {
            let mut noise = Noise(17);
            let (mut false_ones, mut searches, mut mean_root) = (0, 0, 0.0);
            for _ in 0..40 {
                // One bin in three is crowded.
                let heights: Vec<Vec<f64>> = (0..32)
                    .map(|_| {
                        let amplitude = |bin: usize| if bin.is_multiple_of(3) { raised } else { 0.0 };
                        (0..BINS).map(|bin| largest_of_raised(&mut noise, CELLS, amplitude(bin))).collect()
                    })
                    .collect();
                let bar = law.bar(&heights, |_| false);
                assert!((2..=4).contains(&bar.crowded.len()), "{raised}: {:?}", bar.crowded);
                searches += heights.len();
                let passes = |code: &Vec<f64>| code.iter().zip(&bar.thresholds).any(|(height, least)| height > least);
                false_ones += heights.iter().filter(|code| passes(code)).count();
                mean_root += bar.thresholds[0].sqrt() / 40.0;
            }
            println!("{raised}: {false_ones} of {searches}, bar {:.1}", mean_root * mean_root);
            // 1280 searches at 1 %: 12.8 and three deviations of 3.6.
            assert!(false_ones <= 24, "{raised}: {false_ones} of {searches}");
            // Of 750 raised cells 1.3e-5 each are 4.2 deviations along the amplitude; 19 other components are
            // across.
            let exact_root = libm::hypot(raised + 4.2, 19.0_f64.sqrt());
            assert!((mean_root / exact_root - 1.0).abs() < 0.12, "{raised}: {mean_root} for {exact_root}");
        }
    }

    #[test]
    fn few_codes_are_no_sample() {
        let law = Law::new(1e-6, 3069, 41, 10, 1.0);
        let heights = vec![vec![500.0; 41]; LEAST_CODES - 1];
        assert!(law.bar(&heights, |_| false).crowded.is_empty());
    }
}
