//! Finding of a search about one satellite, whether it is believed beside stronger ones, and its row.

use super::Acquired;
use super::refine::Refined;
use gnss::record::AcquisitionRow;
use gnss::signal::Link;

/// A hit this much weaker than the strongest (40 dB) is not believed even without those that are stronger:
/// subtraction leaves something over, and without noise to cover it that something has the
/// cross-correlation's peaks.
const LEAST_SHARE: f64 = 1e-4;
/// A hit this much weaker (30 dB) has to pass its threshold by a fifth: what a subtraction leaves is at the
/// edges of chips, and its cross-correlations reach further than those of whole codes. Where a filter follows
/// the sampling, which the shape that is subtracted does not know, three of 30 skies with a satellite 30 dB
/// above ten others passed the threshold of one that is not there, by 1 to 5 %, and by less than a fifth one
/// in a hundred of those that are.
const DISTANT_SHARE: f64 = 1e-3;
const DISTANT_EXCESS: f64 = 1.2;

/// Result of a search for one satellite.
pub(super) struct Finding {
    /// Statistic of the largest cell.
    pub statistic: f64,
    /// Statistic that a hit exceeds.
    pub threshold: f64,
    /// Position of the largest cell.
    pub coarse: Refined,
    /// Refined position, if it is a hit.
    pub hit: Option<Refined>,
}

impl Finding {
    /// The finding without its hit, if that may be what the subtraction of a code with `strongest` power
    /// left.
    pub fn beside(self, strongest: f64) -> Self {
        let is_clear = self.statistic >= DISTANT_EXCESS * self.threshold;
        let least_share = if is_clear { LEAST_SHARE } else { DISTANT_SHARE };
        Self { hit: self.hit.filter(|hit| hit.power >= least_share * strongest), ..self }
    }

    /// Row of a satellite, and what tracking begins with.
    pub fn report(
        &self,
        (Link { sv, signal }, followed_db): (Link, f64),
        sample: u64,
        code_chips: f64,
    ) -> (AcquisitionRow, Option<Acquired>) {
        let best = self.hit.unwrap_or(self.coarse);
        let row = AcquisitionRow {
            sample,
            sv,
            signal,
            acquired: self.hit.is_some(),
            statistic: self.statistic,
            threshold: self.threshold,
            doppler_hz: best.doppler_hz,
            code_phase_chips: best.code_phase_chips.rem_euclid(code_chips),
            cn0_dbhz: 10.0 * libm::log10(best.cn0_hz) - followed_db,
        };
        let acquired = self.hit.map(|_| Acquired {
            sv,
            signal,
            sample,
            code_phase_chips: planted!("receiver.acquire.code_phase", row.code_phase_chips, row.code_phase_chips + 2.0),
            doppler_hz: row.doppler_hz,
            cn0_dbhz: row.cn0_dbhz,
        });
        (row, acquired)
    }
}
