//! Code-carrier divergence of all channels, and its effect on loops, smoothing and velocity.

use super::FrontEnd;
use super::plan::SKY_HZ;
use super::shared::Shared;
use crate::acquire::Acquired;
use crate::looks::Pattern;
use crate::parting::{Change, Estimate, Parted, common};
use gnss::record::AcquisitionRow;

/// Lines begin again so long after the code loops were moved: two time constants 1/(4B) of the narrow loop at
/// least.
const MOVING_S: f64 = 1.0;
/// A rate beyond so many deviations is named beside an inverted spectrum.
const RATE_SIGMAS: f64 = 6.0;
/// Number of lines from which on two searches have nothing to add.
const LINES: usize = 3;

impl FrontEnd {
    /// Measures the common rate at the end of a block, and lets channels and solver know it when it is
    /// believed.
    pub(super) fn part(&mut self, now: u64, shared: &mut Shared) {
        if now < self.offset_moved {
            return;
        }
        let mut lines: Vec<Estimate> = Vec::with_capacity(self.tracks.len());
        for track in &mut self.tracks {
            if !track.channel.is_settled() {
                track.line.clear();
                continue;
            }
            let link = track.channel.link();
            track.line.take(track.channel.phases(), link, self.metadata.rate);
            let Some(noise) = shared.noise(link.signal) else { continue };
            let sigma_m = noise.sigma_m(libm::pow(10.0, track.cn0_dbhz / 10.0));
            lines.extend(track.line.estimate(sigma_m / link.wavelength_m(), noise.bandwidth_hz));
        }
        self.lines = lines.len();
        if let Some(estimate) = common(&lines) {
            self.adopt(estimate, now, shared);
        }
    }

    /// Compares the codes of a search with those of the search before; that counts while no channel is
    /// followed.
    pub(super) fn look(&mut self, results: &[(AcquisitionRow, Option<Acquired>)], now: u64, shared: &mut Shared) {
        let hits: Vec<Acquired> = results.iter().filter_map(|(_, hit)| *hit).collect();
        let mut dopplers_hz: Vec<f64> = hits.iter().map(|hit| hit.doppler_hz).collect();
        dopplers_hz.sort_by(f64::total_cmp);
        if let Some(&median) = dopplers_hz.get(hits.len() / 2)
            && hits.len() > self.found.0
        {
            self.found = (hits.len(), median);
        }
        match self.looks.take(&hits, self.metadata.rate) {
            Some(Pattern::Sound(estimate)) if self.lines < LINES => self.adopt(estimate, now, shared),
            Some(Pattern::Mirrored(estimate)) if shared.fixes == 0 => self.mirrored = Some(estimate),
            _ => {}
        }
    }

    fn adopt(&mut self, estimate: Estimate, now: u64, shared: &mut Shared) {
        let change = self.offset.take(estimate);
        if change == Change::None {
            return;
        }
        let hz = self.offset.hz();
        self.tracks.iter_mut().for_each(|track| track.channel.set_carrier_offset(hz));
        shared.solver.set_carrier_offset(&self.signals, hz);
        if change == Change::Moved {
            for track in &mut self.tracks {
                track.line.clear();
                track.watched.forget();
            }
            self.offset_moved = now + self.samples(MOVING_S);
        }
    }

    /// Flags that fit these samples better, in words.
    pub(super) fn findings(&self, shared: &Shared) -> Vec<String> {
        let Some(signal) = self.signal() else { return Vec::new() };
        let mut findings = Vec::new();
        if let Some(estimate) = self.mirrored.filter(|_| shared.fixes == 0) {
            let cure = if self.metadata.inverted { "leave --inverted out" } else { "--inverted" };
            let mut text = format!(
                "the spectrum is mirrored: on every satellite the code drifts against the carrier's Doppler; {cure} \
                 cures it"
            );
            if estimate.hz.abs() > RATE_SIGMAS * estimate.sigma_hz {
                let share = estimate.hz / signal.centre_hz();
                text += &format!(
                    ", and --rate-hz {:.0}, {:+.1} ppm, fits the codes",
                    self.metadata.rate.hz() * (1.0 + share),
                    1e6 * share
                );
            }
            findings.push(text);
        }
        let (_, median_hz) = self.found;
        if median_hz.abs() > SKY_HZ.max(self.settings.acquisition.doppler_max_hz) && shared.clock_drift.is_none() {
            let sense = if self.metadata.inverted { -1.0 } else { 1.0 };
            let if_hz = self.metadata.if_hz(signal.centre_hz()) + sense * median_hz;
            findings.push(format!(
                "the carriers lie {:+.1} kHz from where they were looked for: --if-hz {if_hz:.0} centres the search",
                1e-3 * median_hz
            ));
        }
        findings
    }

    /// Code-carrier divergence for the outcome.
    pub(super) fn parted(&self, shared: &Shared) -> Option<Parted> {
        let offset = self.offset.believed()?;
        let carrier_hz = self.signal()?.centre_hz();
        let sense = if self.metadata.inverted { -1.0 } else { 1.0 };
        Some(Parted {
            offset_hz: offset.hz,
            sigma_hz: offset.sigma_hz,
            rate_error_ppm: 1e6 * offset.hz / carrier_hz,
            if_hz: self.signal().map_or(0.0, |signal| self.metadata.if_hz(signal.centre_hz())) + sense * offset.hz,
            rate_hz: self.metadata.rate.hz() * (1.0 + offset.hz / carrier_hz),
            code_drift: shared.clock_drift,
        })
    }
}
