//! Code-carrier divergence: code range less carrier range, now and at the reference's beginning.
//!
//! A spoofer that drags the code without the carrier, or loops that sit between two peaks of which one moves,
//! separate both (D. S. De Lorenzo et al.; RTCA DO-253, monitor of code-carrier divergence). The ionosphere
//! separates them by twice its rate, which is bounded by `IONOSPHERE_MPS` and taken off first. The error of
//! a code loop of order 1 and bandwidth B has the correlation exp(−4·B·t), so that its mean over an interval
//! T has 2(x − 1 + e⁻ˣ)/x² of its variance, x = 4·B·T. The difference of two means far apart over its
//! standard deviation is standard normal; with what is taken off, the probability of a false alarm is at most
//! the stated one. Limits: the carrier has to be locked all the time between both; reflections that change
//! move the code; smooth drags of both together are not seen.

use std::collections::VecDeque;

use gnss::record::Observation;

/// Largest rate of an ionosphere's slant delay.
const IONOSPHERE_MPS: f64 = 4e-3;

/// Code less carrier of an interval.
#[derive(Clone, Copy, Debug, Default)]
struct Mean {
    count: f64,
    /// First value, from which sums are counted.
    base_m: f64,
    sum_m: f64,
    /// Variance of the code's error.
    variance_m2: f64,
    end: u64,
    /// Time since the carrier was locked, at the end.
    locked_s: f64,
}

impl Mean {
    fn metres(&self) -> f64 {
        self.base_m + self.sum_m / self.count
    }
}

/// Code and carrier of one signal.
#[derive(Debug, Default)]
pub struct Divergence {
    running: Mean,
    reference: VecDeque<Mean>,
}

impl Divergence {
    /// Takes an observation whose code has an error of `sigma_m`.
    pub fn take(&mut self, row: &Observation, sigma_m: f64) {
        let apart_m = row.pseudorange_m - row.carrier_cycles * row.signal.wavelength_m(row.sv);
        let running = &mut self.running;
        if running.count == 0.0 {
            running.base_m = apart_m;
        }
        running.count += 1.0;
        running.sum_m += apart_m - running.base_m;
        running.variance_m2 = sigma_m * sigma_m;
        (running.end, running.locked_s) = (row.sample, row.locked_s);
    }

    /// Ends an interval of `interval_s` under a code loop of `loop_hz`: the statistic, once there is an
    /// interval `most` intervals ago in the same lock. `elapsed_s` is the time between two samples.
    pub fn close(&mut self, interval_s: f64, loop_hz: f64, most: usize, elapsed_s: impl Fn(u64) -> f64) -> Option<f64> {
        let now = std::mem::take(&mut self.running);
        if now.count == 0.0 {
            self.reference.clear();
            return None;
        }
        // The carrier of an earlier lock is counted from elsewhere.
        self.reference.retain(|old| elapsed_s(now.end - old.end) + interval_s < now.locked_s);
        let found = self.reference.front().filter(|_| self.reference.len() >= most).and_then(|old| {
            let x = 4.0 * loop_hz * interval_s;
            let share = 2.0 * (x - 1.0 + libm::exp(-x)) / (x * x);
            let sigma_m = (share * (now.variance_m2 + old.variance_m2)).sqrt();
            let beyond_m = (now.metres() - old.metres()).abs() - 2.0 * IONOSPHERE_MPS * elapsed_s(now.end - old.end);
            (sigma_m > 0.0).then(|| beyond_m.max(0.0) / sigma_m)
        });
        if self.reference.len() >= most {
            self.reference.pop_front();
        }
        self.reference.push_back(now);
        found
    }
}

#[cfg(test)]
mod tests {
    use super::super::random::Normal;
    use super::*;
    use gnss::gps::l1ca::L1_CA;
    use gnss::satellite::Sv;

    /// Statistics of a code loop of 0.5 Hz with errors of half a metre, measured every 0.1 s; the code moves
    /// by `of` metres of the time.
    fn run(seconds: u64, of: impl Fn(f64) -> f64) -> Vec<f64> {
        let (mut normal, mut divergence, mut error_m) = (Normal::new(2), Divergence::default(), 0.0);
        let keep = libm::exp(-0.2);
        let mut found = Vec::new();
        for k in 0..10 * seconds {
            let time_s = 0.1 * k as f64;
            error_m = keep * error_m + (1.0 - keep * keep).sqrt() * 0.5 * normal.draw();
            let sv = Sv::gps(3);
            let row = Observation {
                sample: k,
                sv,
                signal: &L1_CA,
                sent_s: 0,
                sent_fraction_s: 0.0,
                pseudorange_m: 2.2e7 - 500.0 * time_s + error_m + of(time_s),
                carrier_cycles: (-500.0 * time_s) / L1_CA.wavelength_m(sv),
                doppler_hz: 0.0,
                cn0_dbhz: 45.0,
                locked_s: time_s,
            };
            divergence.take(&row, 0.5);
            if k % 10 == 9 {
                found.extend(divergence.close(1.0, 0.5, 20, |samples| 0.1 * samples as f64));
            }
        }
        found
    }

    #[test]
    fn a_code_with_the_noise_of_its_loop_is_within_the_stated_probability() {
        let found = run(20_000, |_| 0.0);
        let beyond = found.iter().filter(|statistic| **statistic > 2.576).count();
        // 0.16 m of the ionosphere's bound are 0.3 deviations: at most 1 % of 20 000, and not nothing.
        assert!(found.len() > 19_900 && (10..=200).contains(&beyond), "{beyond} of {}", found.len());
    }

    #[test]
    fn a_drag_of_half_a_metre_a_second_is_reported_and_an_ionosphere_is_not() {
        assert!(run(100, |t| 0.5 * t).iter().all(|statistic| *statistic > 3.29));
        assert!(run(100, |t| 2e-3 * t).iter().all(|statistic| *statistic < 4.5));
    }
}
