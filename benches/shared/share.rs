//! Shares of tests that are not independent of each other, with exact intervals.

use analysis::measure::protection::interval_of;

/// A share with the ends of its interval (95 %).
#[derive(Clone, Copy, Debug)]
pub struct Share {
    pub count: usize,
    pub all: usize,
    pub value: f64,
    pub low: f64,
    pub high: f64,
}

/// Share over all starts, of counts and tests of each. Tests of one start are not independent: they count as
/// so many fewer as the scatter between starts is larger than that of independent ones, and at least `least`
/// times fewer. The interval is the exact one of these.
pub fn share(rows: &[(usize, usize)], least: f64) -> Option<Share> {
    let count: usize = rows.iter().map(|row| row.0).sum();
    let all: usize = rows.iter().map(|row| row.1).sum();
    if all == 0 {
        return None;
    }
    let value = count as f64 / all as f64;
    let squares = rows.iter().map(|(some, of)| (*some as f64 - value * *of as f64).powi(2));
    let starts = rows.len() as f64;
    let scatter = squares.sum::<f64>() * starts / (starts - 1.0).max(1.0);
    let alone = value * (1.0 - value) * all as f64;
    let fewer = if alone > 0.0 { (scatter / alone).max(least) } else { least };
    let (low, high) = interval_of(count as f64 / fewer, all as f64 / fewer);
    Some(Share { count, all, value, low: low.min(value), high: high.max(value) })
}
