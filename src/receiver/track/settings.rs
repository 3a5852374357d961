//! Choices of the tracking loops, as a settings file writes them.

use serde::{Deserialize, Serialize};
use thiserror::Error;

use crate::correlate::{Arithmetic, Edge};
use crate::described::described;
pub use gnss::discriminator::CodeDiscriminator;
use gnss::signal::{Component, Layers};

described! {
/// Settings of every tracking channel. Bandwidths are one-sided noise bandwidths of the discrete loop, exact.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct TrackingSettings {
    /// Order of the carrier phase loop: 2 or 3. Order 3 follows a constant Doppler rate without error.
    pub pll_order: u32,
    /// Bandwidth of the carrier phase loop.
    pub pll_bandwidth_hz: f64,
    /// Order of the frequency loop during pull-in: 1 or 2.
    pub fll_order: u32,
    /// Bandwidth of the frequency loop during pull-in.
    pub fll_bandwidth_hz: f64,
    /// Bandwidth of the frequency loop that assists the phase loop until phase lock; 0 for none.
    pub fll_assist_bandwidth_hz: f64,
    /// Duration of pull-in by the frequency loop alone.
    pub fll_pull_in_s: f64,
    /// Order of the code loop: 1 or 2. It is always aided by the carrier.
    pub dll_order: u32,
    /// Bandwidth of the code loop.
    pub dll_bandwidth_hz: f64,
    /// Bandwidth of the code loop during the first `dll_pull_in_s`.
    pub dll_pull_in_bandwidth_hz: f64,
    /// Duration of the code loop's pull-in.
    pub dll_pull_in_s: f64,
    /// Discriminator of the code loop.
    pub dll_discriminator: CodeDiscriminator,
    /// Spacing from early to late correlator; for BOC divided by the steps of its pulse. The outer pair of
    /// double_delta is twice as far apart.
    pub spacing_chips: f64,
    /// Code periods of 1 ms per loop update once symbols are known: a divisor of 20. Longer codes use as many
    /// periods as fit.
    pub integration: u32,
    /// Layers of the replica for a composite waveform such as CBOC. strongest: the strongest layer. whole:
    /// all layers; needs at least one sample per step of the shortest pulse.
    pub waveform: Layers,
    /// Treatment of chip edges between samples in the replica.
    pub replica: Edge,
    /// Arithmetic of the correlations. sums: running sums of 8-bit samples where carrier and rate suit them.
    /// i16: 16-bit products. f32. f64: exact reference for the others.
    pub arithmetic: Arithmetic,
    /// Mean cosine of twice the phase error at which phase lock is declared.
    pub phase_lock_threshold: f64,
    /// Mean cosine of twice the phase error below which phase lock is lost, as a cycle slip. 0.4 leaves room
    /// for 30° of dynamic stress.
    pub phase_unlock_threshold: f64,
    /// Time without phase lock, or with C/N0 below `cn0_threshold_dbhz`, after which the signal is lost.
    pub loss_s: f64,
    /// C/N0 below which the signal counts as lost.
    pub cn0_threshold_dbhz: f64,
    /// Time after which a channel without symbol lock gives up.
    pub pull_in_limit_s: f64,
    /// Time constant of the C/N0 estimate.
    pub cn0_average_s: f64,
}
}

impl Default for TrackingSettings {
    fn default() -> Self {
        Self {
            pll_order: 3,
            pll_bandwidth_hz: 18.0,
            fll_order: 2,
            fll_bandwidth_hz: 10.0,
            fll_assist_bandwidth_hz: 2.0,
            fll_pull_in_s: 0.25,
            dll_order: 1,
            dll_bandwidth_hz: 0.5,
            dll_pull_in_bandwidth_hz: 2.5,
            dll_pull_in_s: 1.0,
            dll_discriminator: CodeDiscriminator::EarlyMinusLate,
            spacing_chips: 0.5,
            integration: 4,
            waveform: Layers::Strongest,
            replica: Edge::Area,
            arithmetic: Arithmetic::Sums,
            phase_lock_threshold: 0.85,
            phase_unlock_threshold: 0.4,
            loss_s: 0.2,
            cn0_threshold_dbhz: 25.0,
            pull_in_limit_s: 6.0,
            cn0_average_s: 1.0,
        }
    }
}

/// A tracking setting that cannot work.
#[derive(Debug, Error, PartialEq)]
pub enum TrackingSettingsError {
    /// A setting out of its range.
    #[error("tracking.{key} = {value}: expected {expected}")]
    Range {
        /// Name of the setting.
        key: &'static str,
        /// Value that was given.
        value: f64,
        /// Range of the allowed values.
        expected: &'static str,
    },
    /// A loop that is too wide for its update time.
    #[error(
        "tracking.{key} = {value_hz:?} Hz, expected less: with updates every {update_s} s bandwidth times update \
         time is {product:?}, above the limit {limit} (at most {largest_hz} Hz here)"
    )]
    Bandwidth {
        /// Name of the setting.
        key: &'static str,
        /// The bandwidth.
        value_hz: f64,
        /// Time between updates.
        update_s: f64,
        /// Bandwidth times update time.
        product: f64,
        /// The largest product.
        limit: f64,
        /// The largest bandwidth that fits.
        largest_hz: f64,
    },
}

/// Largest bandwidth times update time that [`TrackingSettings::validate`] accepts. The loops are stable for
/// every value (theory: order 1 below 0.5); beyond this their noise per update is no longer small against the
/// discriminator's range.
pub const LARGEST_BANDWIDTH_TIME: f64 = 0.4;

/// Code periods that an update may have.
const INTEGRATIONS: [u32; 6] = [1, 2, 4, 5, 10, 20];

/// Margin of a loop to the limit of [`TrackingSettings::validate`].
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct LoopMargin {
    /// The bandwidth's key.
    pub key: &'static str,
    /// Bandwidth of the loop.
    pub bandwidth_hz: f64,
    /// Time between updates.
    pub update_s: f64,
    /// Bandwidth times update time, and its largest.
    pub bandwidth_time: f64,
    /// The largest product.
    pub limit: f64,
    /// Remaining margin to the limit, as a share of the limit.
    pub margin_share: f64,
}

impl TrackingSettings {
    /// C/N0 from which on a signal is kept, in Hz.
    pub fn least_cn0_hz(&self) -> f64 {
        libm::exp10(0.1 * self.cn0_threshold_dbhz)
    }

    /// Settings fitted to a component. Numbers of code periods refer to periods of 1 ms, so an update of
    /// longer codes has fewer. The spacing refers to BPSK, so it is smaller for pulses of several steps. A
    /// bandwidth too large for an update of one code period is reduced to the largest possible one.
    pub fn fitted(&self, component: &Component) -> Self {
        let period_s = component.period_s();
        let most = (1e-3 * f64::from(self.integration) / period_s + 1e-9).floor() as u32;
        let integration = INTEGRATIONS.into_iter().rev().find(|periods| *periods <= most).unwrap_or(1);
        let steps = self.narrower(component);
        let fit = |bandwidth_hz: f64, periods: u32| {
            bandwidth_hz.min(LARGEST_BANDWIDTH_TIME / (period_s * f64::from(periods)))
        };
        Self {
            integration,
            spacing_chips: self.spacing_chips / steps,
            pll_bandwidth_hz: fit(self.pll_bandwidth_hz, integration),
            dll_bandwidth_hz: fit(self.dll_bandwidth_hz, integration),
            dll_pull_in_bandwidth_hz: fit(self.dll_pull_in_bandwidth_hz, integration),
            fll_bandwidth_hz: fit(self.fll_bandwidth_hz, 1),
            fll_assist_bandwidth_hz: fit(self.fll_assist_bandwidth_hz, 1),
            ..self.clone()
        }
    }

    /// Factor by which the early-late spacing of a component is smaller than that of BPSK: the number of
    /// steps in its chips. Both sidebands of a sub-carrier count as a square wave of as many half cycles,
    /// with chips about them.
    pub fn narrower(&self, component: &Component) -> f64 {
        if let Some(tone) = component.tone() {
            return 1.0 + f64::from(tone.half_cycles.abs());
        }
        let steps = match self.waveform {
            Layers::Strongest => component.strongest().map_or(1, |layer| layer.pulse.len()),
            Layers::Whole => component.steps_per_chip(),
        };
        steps as f64
    }

    /// Every loop's bandwidth times update time and its margin, for a code whose period is `period_s`.
    pub fn margins(&self, period_s: f64) -> [LoopMargin; 5] {
        let update_s = period_s * f64::from(self.integration);
        let margin = |key, bandwidth_hz: f64, update_s: f64| {
            let (bandwidth_time, limit) = (bandwidth_hz * update_s, LARGEST_BANDWIDTH_TIME);
            LoopMargin {
                key,
                bandwidth_hz,
                update_s,
                bandwidth_time,
                limit,
                margin_share: 1.0 - bandwidth_time / limit,
            }
        };
        [
            margin("pll_bandwidth_hz", self.pll_bandwidth_hz, update_s),
            margin("dll_bandwidth_hz", self.dll_bandwidth_hz, update_s),
            margin("dll_pull_in_bandwidth_hz", self.dll_pull_in_bandwidth_hz, update_s),
            margin("fll_bandwidth_hz", self.fll_bandwidth_hz, period_s),
            margin("fll_assist_bandwidth_hz", self.fll_assist_bandwidth_hz, period_s),
        ]
    }

    /// Every loop's margin where several components are followed, each with the settings fitted to it: that
    /// of the component which leaves least.
    pub fn least_margins<'a>(&self, components: impl Iterator<Item = &'a Component>) -> [LoopMargin; 5] {
        let each = components.map(|component| self.fitted(component).margins(component.period_s()));
        let less = |one: LoopMargin, other: LoopMargin| {
            if other.margin_share < one.margin_share { other } else { one }
        };
        each.reduce(|least, of| std::array::from_fn(|loop_| less(least[loop_], of[loop_])))
            .unwrap_or_else(|| self.margins(1e-3))
    }

    /// Checks every value and its range, for a code whose period is `period_s`.
    ///
    /// # Errors
    /// The first key that is out of range, its value and what was expected.
    pub fn validate(&self, period_s: f64) -> Result<(), TrackingSettingsError> {
        let order = |value: u32, least: u32, most: u32| (least..=most).contains(&value);
        let within = |value: f64, least: f64, most: f64| value >= least && value <= most;
        let positive = |value: f64| value > 0.0 && value.is_finite();
        #[rustfmt::skip]
        let checks = [
            ("pll_order", f64::from(self.pll_order), order(self.pll_order, 2, 3), "2 or 3"),
            ("fll_order", f64::from(self.fll_order), order(self.fll_order, 1, 2), "1 or 2"),
            ("dll_order", f64::from(self.dll_order), order(self.dll_order, 1, 2), "1 or 2"),
            ("pll_bandwidth_hz", self.pll_bandwidth_hz, positive(self.pll_bandwidth_hz), "above 0"),
            ("fll_bandwidth_hz", self.fll_bandwidth_hz, positive(self.fll_bandwidth_hz), "above 0"),
            ("fll_assist_bandwidth_hz", self.fll_assist_bandwidth_hz,
             within(self.fll_assist_bandwidth_hz, 0.0, f64::MAX), "0 or more"),
            ("fll_pull_in_s", self.fll_pull_in_s, within(self.fll_pull_in_s, 0.02, 10.0), "0.02 to 10"),
            ("dll_bandwidth_hz", self.dll_bandwidth_hz, positive(self.dll_bandwidth_hz), "above 0"),
            ("dll_pull_in_bandwidth_hz", self.dll_pull_in_bandwidth_hz,
             positive(self.dll_pull_in_bandwidth_hz), "above 0"),
            ("dll_pull_in_s", self.dll_pull_in_s, within(self.dll_pull_in_s, 0.0, 60.0), "0 to 60"),
            ("spacing_chips", self.spacing_chips, within(self.spacing_chips, 0.02, 1.5), "0.02 to 1.5"),
            ("spacing_chips", self.spacing_chips,
             within(self.spacing_chips * self.dll_discriminator.widest(), 0.0, 2.0),
             "1 at most, with dll_discriminator = \"double_delta\""),
            ("integration", f64::from(self.integration),
             INTEGRATIONS.contains(&self.integration), "1, 2, 4, 5, 10 or 20"),
            ("phase_lock_threshold", self.phase_lock_threshold,
             within(self.phase_lock_threshold, 0.1, 0.99), "0.1 to 0.99"),
            ("phase_unlock_threshold", self.phase_unlock_threshold,
             within(self.phase_unlock_threshold, 0.0, self.phase_lock_threshold), "0 to phase_lock_threshold"),
            ("loss_s", self.loss_s, within(self.loss_s, 0.05, 10.0), "0.05 to 10"),
            ("cn0_threshold_dbhz", self.cn0_threshold_dbhz,
             within(self.cn0_threshold_dbhz, 0.0, 60.0), "0 to 60"),
            ("pull_in_limit_s", self.pull_in_limit_s, within(self.pull_in_limit_s, 1.0, 600.0), "1 to 600"),
            ("cn0_average_s", self.cn0_average_s, within(self.cn0_average_s, 0.1, 60.0), "0.1 to 60"),
        ];
        if let Some(&(key, value, _, expected)) = checks.iter().find(|check| !check.2) {
            return Err(TrackingSettingsError::Range { key, value, expected });
        }
        let beyond = self.margins(period_s).into_iter().find(|margin| margin.bandwidth_time > margin.limit);
        if let Some(LoopMargin { key, bandwidth_hz, update_s, bandwidth_time, limit, .. }) = beyond {
            let (value_hz, product, largest_hz) = (bandwidth_hz, bandwidth_time, limit / update_s);
            return Err(TrackingSettingsError::Bandwidth { key, value_hz, update_s, product, limit, largest_hz });
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lead::lead;
    use gnss::signal::Signal;

    #[test]
    fn defaults_are_valid_and_a_bad_value_names_its_key() {
        assert_eq!(TrackingSettings::default().validate(1e-3), Ok(()));
        let bad = TrackingSettings { integration: 3, ..Default::default() };
        assert!(bad.validate(1e-3).unwrap_err().to_string().contains("tracking.integration = 3"));
        let bad = TrackingSettings { spacing_chips: f64::NAN, ..Default::default() };
        assert!(bad.validate(1e-3).unwrap_err().to_string().contains("spacing_chips"));
    }

    #[test]
    fn a_bandwidth_beyond_the_limit_is_refused_with_the_largest_that_fits() {
        // 25 Hz x 20 ms = 0.5 > 0.4; 20 Hz would do.
        let bad = TrackingSettings { pll_bandwidth_hz: 25.0, integration: 20, ..Default::default() };
        let text = bad.validate(1e-3).unwrap_err().to_string();
        assert!(text.contains("0.5") && text.contains("at most 20 Hz"), "{text}");
    }

    #[test]
    fn margins_are_those_of_the_updates_that_each_code_has() {
        let settings = TrackingSettings::default();
        let of = |names: &[&str]| {
            let signals = names.iter().filter_map(|name| Signal::find(name));
            settings.least_margins(signals.filter_map(lead))[0]
        };
        // 18 Hz: four periods of 1 ms, and one of 10 ms. Neither makes the other's product.
        assert!((of(&["GPS L1 C/A"]).bandwidth_time - 0.072).abs() < 1e-12);
        assert!((of(&["GPS L1C"]).bandwidth_time - 0.18).abs() < 1e-12);
        assert_eq!(of(&["GPS L1 C/A", "GPS L1C"]), of(&["GPS L1C"]));
    }

    #[test]
    fn unknown_keys_are_refused() {
        assert!(serde_json::from_str::<TrackingSettings>(r#"{"pll_bandwith_hz": 15}"#).is_err());
        assert!(serde_json::from_str::<TrackingSettings>(r#"{"arithmetic": "f16"}"#).is_err());
        let some: TrackingSettings = serde_json::from_str(r#"{"replica": "nearest", "pll_order": 2}"#).unwrap();
        assert_eq!((some.replica, some.pll_order, some.dll_order), (Edge::Nearest, 2, 1));
    }
}
