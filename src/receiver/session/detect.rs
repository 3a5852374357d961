//! Detectors of jamming and spoofing at the end of a block.

use super::Session;
use crate::outcome::ReceiveError;
use crate::output::Sink;
use crate::source::Stretch;

impl Session {
    /// Gives the detectors what the blocks brought, and has them test an interval that ended.
    pub(super) fn detect(&mut self, blocks: &[Stretch], sink: &mut dyn Sink) -> Result<(), ReceiveError> {
        let Some(detection) = &mut self.shared.detection else { return Ok(()) };
        let Some(end) = blocks.first().map(Stretch::end) else { return Ok(()) };
        if self.front_ends.iter().any(|front_end| front_end.gap.is_busy()) {
            let tracks = self.front_ends.iter_mut().flat_map(|front_end| &mut front_end.tracks);
            tracks.filter_map(|track| track.report.shape.as_mut()).for_each(|shape| *shape = Default::default());
            detection.interrupt();
            return Ok(());
        }
        for (number, block) in blocks.iter().enumerate() {
            if let Some(block) = block.packed() {
                detection.take_samples(number, block);
            }
        }
        if !detection.is_due(end) {
            return Ok(());
        }
        for track in self.front_ends.iter_mut().flat_map(|front_end| &mut front_end.tracks) {
            let (link, doppler_hz) = (track.channel.link(), track.channel.doppler_hz());
            if let Some(shape) = track.report.shape.as_mut() {
                detection.take_shape(link, std::mem::take(shape), doppler_hz);
            }
        }
        Ok(detection.close(end, sink)?)
    }
}
