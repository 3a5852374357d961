//! Change from the code that the search found to the long code of a pilot beside it.

use super::pilot::Data;
use super::{Channel, Stage};
use crate::correlate::sums::Samples;
use crate::correlate::{Nco, Replica};
use crate::lead::lead;
use crate::track::long::LongCode;
use crate::track::secondary_code::{SecondaryCodePhase, SecondaryCodeSync};

impl Channel {
    /// The long code's replica for the running period, once its segment is known and where it is another than
    /// that of the period before.
    pub(super) fn next_segment(&mut self) -> Option<Replica> {
        let phase = self.secondary_code_phase?;
        let long = self.long.as_mut()?;
        let segment = long.segment(phase, self.period);
        if self.segment == Some(segment) {
            return None;
        }
        self.segment = Some(segment);
        long.replica(segment)
    }

    /// Correlates the running period with all segments of the long code, where the carrier is locked to
    /// symbols; gives the long code's phase once it is beyond doubt.
    pub(super) fn seek_segment(&mut self, samples: Samples, nco: &Nco, scale: f64) -> Option<SecondaryCodePhase> {
        let ready = self.whole && self.confirmed && !self.held && !self.moved && self.secondary_code_phase.is_none();
        if !ready || !matches!(self.stage, Stage::Tracking(_)) || !self.lock.is_locked() {
            return None;
        }
        let arithmetic = self.arithmetic;
        let prompt = |replica: &Replica| {
            let [sum] = replica.correlate_in(arithmetic, samples, nco, &[0]);
            scale * sum.re
        };
        self.long.as_mut()?.add(self.period, prompt)
    }

    /// Tracks the long code from the next code period on; the code before is then that of the data beside it.
    /// The carrier gets the right half cycle.
    pub(super) fn follow_long(&mut self, phase: SecondaryCodePhase) {
        let Some(pilot) = self.long.as_ref().map(LongCode::component) else { return };
        let rates = (self.rate.hz(), self.sense);
        self.data = lead(self.signal).and_then(|data| Data::new(data, pilot, self.sv.number, &self.settings, rates));
        // The segment takes the place of a secondary code: no signs are left.
        self.secondary_code = Some(SecondaryCodeSync::new(vec![1]));
        self.polarity = None;
        self.wipe(phase);
        self.enter(Stage::Tracking(0));
        self.confirmed = true;
    }
}
