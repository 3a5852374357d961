//! Dopplers that a search leaves before all sums are made: what that takes from detections and false alarms.
//!
//! A Doppler stays while its largest cell exceeds a bar, whichever cell that is: the satellite's, or one of
//! noise. So whole Dopplers of noise are drawn with every sum. Limits: the cells of a Doppler are as many
//! independent ones as have the same law (`receiver::acquire::independent_cells`).

use super::normal::{Normals, Purpose, uniform};
use analysis::expect::theory::detection::threshold;

/// Dopplers of noise: a share of a quarter, what the first bar lets stay, is then known to 0.03.
const COLUMNS: usize = 256;
/// Sums of a false alarm that are drawn.
const ALARMS: u32 = 5000;

/// Bars of a search, and what noise makes of them.
#[derive(Clone, Debug)]
pub struct Leaving {
    /// Value that the largest cell has to exceed after each sum; zero where no Doppler is left.
    bars: Vec<f64>,
    /// Columns of noise: for each Doppler, true for each sum after which its largest cell exceeds the bar.
    noise: Vec<Vec<bool>>,
}

impl Leaving {
    /// Draws noise for a search with these bars and `lags` independent cells at a Doppler.
    pub fn new(bars: Vec<f64>, lags: usize, seed: u64) -> Self {
        let columns = if bars.iter().any(|bar| *bar > 0.0) { COLUMNS } else { 1 };
        let mut normals = Normals::new(seed, Purpose::Columns);
        let mut column = || -> Vec<bool> {
            let mut largest = vec![0.0_f64; bars.len()];
            for _ in 0..lags {
                let mut power = 0.0;
                for largest in &mut largest {
                    power += normals.next().norm_sqr();
                    *largest = largest.max(power);
                }
            }
            largest.iter().zip(&bars).map(|(largest, bar)| largest > bar).collect()
        };
        let noise = (0..columns).map(|_| column()).collect();
        Self { bars, noise }
    }

    /// True if a Doppler stays to the end whose cell has these powers after each sum, in the noise of that
    /// number.
    pub fn stays(&self, powers: impl IntoIterator<Item = f64>, number: usize) -> bool {
        let noise = &self.noise[number % self.noise.len()];
        self.bars.iter().zip(noise).zip(powers).all(|((bar, noise), power)| *noise || power > *bar)
    }

    /// Share of false alarms that are left of those which a cell's probability `per_cell` after all sums is
    /// designed for.
    pub fn alarms_left(&self, per_cell: f64, seed: u64) -> f64 {
        let sums = self.bars.len();
        let mut normals = Normals::new(seed, Purpose::Columns);
        let stays = |draw: u32| {
            // Of equal sums each has its part of the total, whatever that is: powers are exponential.
            let parts: Vec<f64> = (0..sums).map(|_| normals.next().norm_sqr()).collect();
            let all: f64 = parts.iter().sum();
            let exceeded = per_cell * (1.0 - uniform(seed, Purpose::Columns, u64::from(draw)));
            let total = threshold(exceeded, sums as u32);
            let powers = parts.iter().scan(0.0, |sum, part| {
                *sum += part / all * total;
                Some(*sum)
            });
            self.stays(powers, draw as usize)
        };
        (0..ALARMS).map(stays).filter(|stays| *stays).count() as f64 / f64::from(ALARMS)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn noise_stays_as_often_as_its_bar_says() {
        let (lags, probability) = (500, 0.25);
        let bar = threshold(-libm::expm1(libm::log1p(-probability) / lags as f64), 2);
        let leaving = Leaving::new(vec![0.0, bar, 0.0], lags, 3);
        let stayed = (0..COLUMNS).filter(|number| leaving.stays([0.0, 0.0, 0.0], *number)).count();
        // Three deviations of a count of 256.
        let share = stayed as f64 / COLUMNS as f64;
        assert!((share - probability).abs() < 0.081, "{share}");
        assert!((0..COLUMNS).all(|number| leaving.stays([0.0, bar + 1.0, 0.0], number)));
    }

    #[test]
    fn of_alarms_of_two_sums_those_are_left_whose_first_has_its_part() {
        // One cell: noise of its own keeps nothing. Of a total T the first sum's part is uniform, and T is
        // threshold and an exponential on top but for a little.
        let (bar, per_cell) = (20.0, 1e-7);
        let leaving = Leaving::new(vec![bar, 0.0], 1, 5);
        assert!(leaving.noise.iter().all(|noise| !noise[0]));
        let total = threshold(per_cell, 2) + 2.0;
        let share = leaving.alarms_left(per_cell, 6);
        // Three deviations of 5000 draws.
        assert!((share - (1.0 - bar / total)).abs() < 0.021, "{share} {total}");
        let none = Leaving::new(vec![0.0; 4], 100, 5);
        assert_eq!(none.alarms_left(1e-6, 1), 1.0);
    }
}
