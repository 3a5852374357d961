//! A channel's replica over code periods that have ended, for other samples of the same clock.

use num_complex::Complex64;

use super::Channel;
use crate::correlate::Nco;
use crate::correlate::{Arithmetic, Replica};

/// A code period that has ended, with the oscillators at its first sample.
#[derive(Clone, Copy, Debug)]
pub struct Past {
    /// Number of the first sample.
    pub from: u64,
    /// Number of the sample after the last one.
    pub to: u64,
    /// Energy of the replica over the samples.
    pub energy: f64,
    nco: Nco,
}

impl Past {
    /// Sum of a replica over the period's samples, which are planes.
    pub fn prompt(&self, replica: &Replica, (i, q): (&[f32], &[f32])) -> Complex64 {
        let [sum] = replica.correlate_in(Arithmetic::F32, (i, q), &self.nco, &[0]);
        sum
    }
}

impl Channel {
    /// The replica, and the code periods before the running one that begin at sample `from` or later, the
    /// latest first, by the steps that the oscillators have now. None while the phase is not locked, and of a
    /// long code, whose segments change.
    pub fn past(&self, from: u64) -> (Option<&Replica>, Vec<Past>) {
        let replica = self.accumulator.coded.as_ref().filter(|coded| coded.code.segment.is_none());
        let Some(coded) = replica.filter(|_| self.detectors.lock.is_locked() && !self.held) else {
            return (None, Vec::new());
        };
        let (nco, step) = (self.nco.nco(), i128::from(self.nco.code_step));
        let (mut periods, mut to) = (Vec::new(), self.nco.first);
        for number in 1.. {
            let ahead = number * i128::from(self.nco.length) + i128::from(self.nco.code);
            // The first sample of a period is the one at which its code has begun.
            let samples = ahead.div_euclid(step.max(1)) as u64;
            let Some(begin) = self.nco.first.checked_sub(samples).filter(|begin| *begin >= from) else { break };
            periods.push(Past {
                from: begin,
                to,
                energy: self.accumulator.replica_power * (to - begin) as f64,
                nco: Nco {
                    carrier: nco.carrier.wrapping_sub(nco.carrier_step.wrapping_mul(samples)),
                    code: (ahead - step * i128::from(samples)) as i64,
                    ..nco
                },
            });
            to = begin;
        }
        (Some(&coded.replica), periods)
    }
}
