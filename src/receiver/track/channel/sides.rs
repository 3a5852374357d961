//! Change from one sideband of a sub-carrier to both.

use super::Channel;
use crate::correlate::Replica;
use crate::lead::BOTH_SIDES;

impl Channel {
    /// Makes the replica ready for the current period: with the segment of a long code, or with both
    /// sidebands of a sub-carrier once the secondary code is known, in the signs that they have.
    pub(super) fn ready(&mut self, replica: &mut Replica) {
        if let Some(segment) = self.next_segment() {
            *replica = segment;
        }
        let (Some(phase), Some(sides)) = (self.secondary_code_phase, &mut self.sides) else { return };
        if let Some(both) = sides.replica() {
            *replica = both;
        }
        replica.set_second(sides.are_opposed(phase, self.period));
    }

    /// Tracks both sidebands from the next code period on: the noise is that of one, the power twice as
    /// large.
    pub(super) fn join_sides(&mut self) {
        let Some(both) = self.sides.as_ref().map(|sides| sides.both().clone()) else { return };
        self.taps = both.taps;
        self.side_peaks = both.peaks;
        self.loops.reshape(&self.settings, both.shape);
        self.cn0.raise(BOTH_SIDES);
        self.followed_db += 10.0 * libm::log10(BOTH_SIDES);
    }
}
