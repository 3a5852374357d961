//! Comparison of two samples of a figure, and of a family of such comparisons.
//!
//! Ranks need no law of the figures. Locations are compared by the rank sum of Wilcoxon, Mann and Whitney
//! with the correction for ties; spreads by the same test of the distances from either sample's own median.
//! Families are held to their level by Holm's procedure (S. Holm, Scand. J. Statist. 6, 1979). Limits: normal
//! law of the rank sum, whose tails are heavier than the exact ones.

use analysis::statistics::{mean, median, std};

/// Probability that a family without any difference has one that is found.
pub const LEVEL: f64 = 0.01;

/// A figure of a scene at both levels.
pub struct Pair {
    pub scene: String,
    pub figure: String,
    pub unit: String,
    pub samples: Vec<f64>,
    pub modelled: Vec<f64>,
}

/// Two-sample tests of a figure.
pub struct Tested<'p> {
    pub pair: &'p Pair,
    /// Standard deviates of the rank sums: of values, and of their distances from the medians. Positive where
    /// those of `correlations` are larger.
    pub deviates: [f64; 2],
    /// True where the family's level is exceeded.
    pub differs: [bool; 2],
}

impl Pair {
    /// True if the runs differ at all, by more than rounding.
    pub fn varies(&self) -> bool {
        let all = || self.samples.iter().chain(&self.modelled).copied();
        let (least, most) = all().fold((f64::MAX, f64::MIN), |(a, b), x| (a.min(x), b.max(x)));
        let larger = least.abs().max(most.abs());
        most - least > 1e-9 * larger && larger > 1e-6
    }

    /// Mean of `correlations` less that of `samples`, and its standard error.
    pub fn apart(&self) -> (f64, f64) {
        let of = |all: &[f64]| (mean(all).unwrap_or(f64::NAN), std(all).unwrap_or(0.0).powi(2) / all.len() as f64);
        let ((a, a_square), (b, b_square)) = (of(&self.samples), of(&self.modelled));
        (b - a, (a_square + b_square).sqrt())
    }

    fn tests(&self) -> [Test; 2] {
        let distances = |all: &[f64]| {
            let middle = median(all).unwrap_or(0.0);
            all.iter().map(|value| (value - middle).abs()).collect::<Vec<_>>()
        };
        let (a, b) = (distances(&self.samples), distances(&self.modelled));
        [rank_test(&self.samples, &self.modelled), rank_test(&a, &b)]
    }
}

/// Result of a rank test.
#[derive(Clone, Copy)]
pub struct Test {
    /// Rank sum in standard deviations from its mean; positive where the second sample is the larger one.
    pub deviate: f64,
    /// Probability of a rank sum as far from its mean, of equal distributions.
    pub probability: f64,
}

/// Rank sum of `b` among both, with its exact law.
fn rank_test(a: &[f64], b: &[f64]) -> Test {
    let mut all: Vec<(f64, bool)> = a.iter().map(|x| (*x, false)).chain(b.iter().map(|x| (*x, true))).collect();
    all.sort_by(|x, y| x.0.total_cmp(&y.0));
    let (mut ranks, mut before, mut ties) = (Vec::new(), 0, 0.0);
    for alike in all.chunk_by(|x, y| x.0 == y.0) {
        // Twice the mean rank is a whole number.
        ranks.extend(alike.iter().map(|one| (2 * before + alike.len() + 1, one.1)));
        before += alike.len();
        ties += (alike.len() as f64).powi(3) - alike.len() as f64;
    }
    let (n, m, total) = (a.len() as f64, b.len() as f64, all.len() as f64);
    let variance = n * m / 12.0 * (total + 1.0 - ties / (total * (total - 1.0)));
    let sum: usize = ranks.iter().filter(|one| one.1).map(|one| one.0).sum();
    let off = 0.5 * sum as f64 - 0.5 * m * (total + 1.0);
    if variance <= 0.0 {
        return Test { deviate: 0.0, probability: 1.0 };
    }
    // The smaller sample has fewer ways.
    let is_second = b.len() <= a.len();
    let own: usize = ranks.iter().filter(|one| one.1 == is_second).map(|one| one.0).sum();
    let ways = ways(&ranks.iter().map(|one| one.0).collect::<Vec<_>>(), a.len().min(b.len()));
    let (below, above) = (ways[..=own].iter().sum::<f64>(), ways[own..].iter().sum::<f64>());
    let probability = (2.0 * below.min(above) / ways.iter().sum::<f64>()).min(1.0);
    Test { deviate: off / variance.sqrt(), probability }
}

/// Least probability that a test of this many values can have: that of one sample above the other.
pub fn least_probability(pair: &Pair) -> f64 {
    let (few, all) = (pair.samples.len().min(pair.modelled.len()), pair.samples.len() + pair.modelled.len());
    2.0 * (0..few).map(|k| (few - k) as f64 / (all - k) as f64).product::<f64>()
}

/// Number of ways to choose `count` of the ranks with each sum.
fn ways(ranks: &[usize], count: usize) -> Vec<f64> {
    let most: usize = ranks.iter().rev().take(count).sum();
    let mut all = vec![vec![0.0; most + 1]; count + 1];
    all[0][0] = 1.0;
    for rank in ranks {
        for chosen in (1..=count).rev() {
            let (fewer, more) = all.split_at_mut(chosen);
            let (fewer, more) = (&fewer[chosen - 1], &mut more[0]);
            more.iter_mut().skip(*rank).zip(fewer).for_each(|(more, fewer)| *more += fewer);
        }
    }
    all.pop().unwrap_or_default()
}

/// Probability of a standard deviate as far from zero as this.
pub fn probability(deviate: f64) -> f64 {
    libm::erfc(deviate.abs() * std::f64::consts::FRAC_1_SQRT_2)
}

/// Numbers of the tests that exceed the family's level, by Holm's procedure.
pub fn exceeding(probabilities: &[f64]) -> Vec<usize> {
    let mut order: Vec<usize> = (0..probabilities.len()).collect();
    order.sort_by(|a, b| probabilities[*a].total_cmp(&probabilities[*b]));
    let holds =
        |(place, number): &(usize, usize)| probabilities[*number] <= LEVEL / (probabilities.len() - place) as f64;
    order.into_iter().enumerate().take_while(holds).map(|(_, number)| number).collect()
}

/// Both tests of every figure, as one family.
pub fn tested(pairs: &[Pair]) -> Vec<Tested<'_>> {
    let all: Vec<[Test; 2]> = pairs.iter().map(Pair::tests).collect();
    let probabilities: Vec<f64> = all.iter().flatten().map(|test| test.probability).collect();
    let found = exceeding(&probabilities);
    let one = |(number, (pair, tests)): (usize, (_, [Test; 2]))| Tested {
        pair,
        deviates: tests.map(|test| test.deviate),
        differs: [2 * number, 2 * number + 1].map(|test| found.contains(&test)),
    };
    pairs.iter().zip(all).enumerate().map(one).collect()
}
