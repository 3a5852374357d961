//! Band of a front end's samples: its centre frequency, and the signals that lie in it.

use super::front_end::{FrontEnd, Tuned, is_place_of_real};
use super::{Overrides, Scenario, ScenarioError};
use crate::scene::{folded_hz, is_link_outside, is_outside, main_lobe_hz};
use gnss::samples::IfMetadata;
use gnss::satellite::Sv;
use gnss::signal::{Carrier, Signal};

/// Samples of one scene at most: 19 days at 60 Msps.
const MAX_SAMPLES: f64 = 1e14;

impl Scenario {
    pub(super) fn metadata(&self, front_end: &FrontEnd, overrides: &Overrides) -> Result<IfMetadata, ScenarioError> {
        let format = overrides.format.unwrap_or(front_end.format);
        let first = front_end.first_signal(&self.signals).map_or(0.0, |signal| signal.centre_hz());
        let center_hz = match front_end.tuned {
            Tuned::Centre { center_hz } => center_hz,
            Tuned::If { if_hz } => first - if front_end.inverted { -if_hz } else { if_hz },
        };
        let metadata = IfMetadata {
            format,
            rate: front_end.rate,
            center_hz,
            inverted: front_end.inverted,
            start: Some(self.start),
        };
        let refuse = |reason: String| self.conflict(front_end.tuning_key(), reason);
        let centred = matches!(front_end.tuned, Tuned::Centre { .. });
        if centred && !format.is_complex() && front_end.signals.is_none() && self.signals.len() > 1 {
            let reason = format!(
                "{}absent: expected the signals that it is for, because format = {format} is real and holds any band \
                 folded",
                front_end.of_it()
            );
            return Err(self.conflict("front_end.signals", reason));
        }
        match front_end.tuned {
            Tuned::If { if_hz } if !format.is_complex() && if_hz <= 0.0 => {
                Err(refuse(format!("{if_hz} Hz with the real format {format}: expected more than 0")))
            }
            Tuned::Centre { .. } if !format.is_complex() && !is_place_of_real(metadata.if_hz(first), metadata.rate) => {
                Err(refuse(format!(
                    "{}{center_hz} Hz puts the carrier of the first signal at {} Hz: expected it above 0 and at no \
                     multiple of half of sample_rate_hz, {} Hz, because format = {format} is real",
                    front_end.of_it(),
                    metadata.if_hz(first),
                    0.5 * metadata.rate.hz()
                )))
            }
            _ => Ok(metadata),
        }
    }

    /// Whole samples of a front end in the scene.
    pub(super) fn samples(&self, front_end: &FrontEnd) -> Result<u64, ScenarioError> {
        let rate_hz = front_end.rate.hz();
        let samples = (self.duration_s * rate_hz).round();
        if samples > MAX_SAMPLES {
            let reason =
                format!("{} s at {rate_hz} Hz are {samples:e} samples: expected at most 1e14", self.duration_s);
            return Err(self.conflict("duration_s", reason));
        }
        Ok(samples as u64)
    }

    /// The signals of a front end whose main lobe reaches into the band of its samples; warns when one does
    /// not fit as a whole.
    pub(super) fn signals_in_band(
        &self,
        front_end: &FrontEnd,
        metadata: &IfMetadata,
        warnings: &mut Vec<String>,
    ) -> Result<Vec<&'static Signal>, ScenarioError> {
        let half = 0.5 * metadata.rate.hz();
        let first_hz = front_end.first_signal(&self.signals).map_or(0.0, |signal| metadata.if_hz(signal.centre_hz()));
        let if_hz = match front_end.tuned {
            Tuned::If { if_hz } => if_hz,
            Tuned::Centre { .. } => first_hz,
        };
        let of_it = front_end.of_it();
        // Of real samples the band is the one, half the rate wide, in which the IF lies.
        let zone = (if_hz / half).floor();
        let (low, high) = if metadata.format.is_complex() { (-half, half) } else { (zone * half, (zone + 1.0) * half) };
        if !metadata.format.is_complex() && zone > 0.0 {
            let folded = folded_hz(if_hz, metadata.rate.hz());
            let mirrored = if folded < 0.0 { ", mirrored" } else { "" };
            warnings.push(format!(
                "{of_it}front_end.if_hz = {if_hz} lies above half of sample_rate_hz: the samples hold the band from \
                 {:.3} to {:.3} MHz, the carrier at {:.6} MHz{mirrored}",
                low / 1e6,
                high / 1e6,
                folded.abs() / 1e6
            ));
        }
        let mut inside = Vec::new();
        for &signal in front_end.signals.as_ref().unwrap_or(&self.signals) {
            let (from, to) = main_lobe_hz(metadata, signal);
            let what = format!(
                "{signal}: its main lobe, {:.3} to {:.3} MHz, does not fit into the samples' band, {:.3} to {:.3} MHz",
                from / 1e6,
                to / 1e6,
                low / 1e6,
                high / 1e6
            );
            if is_outside(metadata, signal) {
                if front_end.signals.is_some() {
                    return Err(self.conflict("front_end.signals", format!("{of_it}{what} at all")));
                }
                // Another front end may be for it.
                if self.front_ends.len() == 1 {
                    warnings.push(format!("{what} at all: it is not computed"));
                }
                continue;
            }
            if from < low || to > high {
                warnings.push(format!(
                    "{of_it}{what}: the rest will fold over with code_edge = \"nearest\", and other edges take it \
                     from C/N0 (`gnss-twin plan` states how much)"
                ));
            }
            let outside = |sv: &Sv| is_link_outside(metadata, signal.link(*sv));
            if matches!(signal.carrier, Carrier::Channels { .. }) {
                let absent: Vec<String> = signal.satellites().filter(outside).map(|sv| sv.to_string()).collect();
                if !absent.is_empty() {
                    let names = absent.join(" ");
                    warnings.push(format!("{of_it}{signal}: outside the samples' band, and not computed: {names}"));
                }
            }
            inside.push(signal);
        }
        if inside.is_empty() {
            let names: Vec<&str> = self.signals.iter().map(|signal| signal.name).collect();
            let place_hz = match front_end.tuned {
                Tuned::If { if_hz } => if_hz,
                Tuned::Centre { center_hz } => center_hz,
            };
            let reason = format!(
                "{of_it}{place_hz} Hz: expected one at which the main lobe of some signal ({}) reaches into the \
                 samples' band, {:.3} to {:.3} MHz",
                names.join(", "),
                low / 1e6,
                high / 1e6
            );
            return Err(self.conflict(front_end.tuning_key(), reason));
        }
        Ok(inside)
    }
}
