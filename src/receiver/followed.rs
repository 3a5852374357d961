//! Components of each signal that the loops follow, with their loop settings. The theory needs both.

use serde::Serialize;

use crate::acquire::{AcquisitionSettings, companion, pair_sums};
use crate::lead::{lead, other_side};
use crate::settings::Settings;
use crate::track::closed::Mode;
use crate::track::{TrackingSettings, pilot_group};
use gnss::satellite::Sv;
use gnss::signal::{Component, Layer, Layers, Signal};

/// Tracking of a signal, as `receiver.json` reports it.
#[derive(Clone, Debug, Serialize)]
pub struct Followed {
    /// Name of the signal.
    pub signal: &'static str,
    /// Index of the component among the signal's.
    pub component: usize,
    /// Index of the replica's layer among the component's. `None` where the replica has all layers, or the
    /// tone of a sideband.
    pub layer: Option<usize>,
    /// Index of the component on the other sideband of the sub-carrier, where both are followed together.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub other_side: Option<usize>,
    /// Distance of early and late, fitted to the layer's pulse.
    pub spacing_chips: f64,
    /// Time of a loop's update once symbols are known: as long as set, in whole parts of what is sent with
    /// one sign.
    pub integration_s: f64,
    /// Update time in seconds for satellites whose message has shorter bits, where such satellites exist.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub least_integration_s: Option<f64>,
    /// One-sided noise bandwidth of the phase loop, as far as such updates allow.
    pub pll_bandwidth_hz: f64,
    /// One-sided noise bandwidth of the code loop in hertz, as far as such updates allow.
    pub dll_bandwidth_hz: f64,
    /// Search parameters of the signal.
    pub search: Searched,
}

/// The sums in which a signal is searched for.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Searched {
    /// Indices of the components among the signal's whose powers are added.
    pub components: Vec<usize>,
    /// Length of a coherent sum, seconds: no longer than a component keeps its sign.
    pub coherent_s: f64,
    /// Coherent sums of each component.
    pub sums: u32,
}

impl Searched {
    /// Search parameters for the component that leads the search; `components` are indices among the
    /// signal's.
    fn of(leading: &Component, components: Vec<usize>, settings: &AcquisitionSettings) -> Self {
        let coherent_s = leading.period_s() * f64::from(settings.periods(leading));
        let sums = settings.sums(leading);
        let sums = if components.len() > 1 { pair_sums(sums) } else { sums };
        Self { components, coherent_s, sums }
    }
}

impl Followed {
    /// Tracking of a signal by these settings. `None` where no component can be followed.
    pub fn of(signal: &'static Signal, settings: &Settings) -> Option<Self> {
        let leading = lead(signal)?;
        let place = |made: &Layer| leading.layers.iter().position(|layer| std::ptr::eq(layer, made));
        let at = |one: &Component| signal.components.iter().position(|component| std::ptr::eq(component, one));
        let layer = match settings.tracking.waveform {
            _ if leading.tone().is_some() => None,
            Layers::Strongest => Some(place(leading.strongest()?)?),
            Layers::Whole => None,
        };
        let fitted = settings.tracking.fitted(leading);
        let updates = signal.satellites().map(|sv| updated_s(leading, sv, &fitted));
        let [least_s, most_s] = updates.fold([f64::MAX, 0.0_f64], |[least, most], s| [least.min(s), most.max(s)]);
        Some(Self {
            signal: signal.name,
            component: at(leading)?,
            layer,
            other_side: other_side(leading, signal).and_then(at),
            spacing_chips: fitted.spacing_chips,
            integration_s: most_s,
            least_integration_s: (least_s < most_s).then_some(least_s),
            pll_bandwidth_hz: fitted.pll_bandwidth_hz,
            dll_bandwidth_hz: fitted.dll_bandwidth_hz,
            search: Searched::of(
                leading,
                std::iter::once(leading).chain(companion(leading, signal)).filter_map(at).collect(),
                &settings.acquisition,
            ),
        })
    }
}

/// Time of an update of the loops that follow a component of a satellite by settings that are fitted to it.
fn updated_s(leading: &Component, sv: Sv, fitted: &TrackingSettings) -> f64 {
    let periods = match leading.message {
        Some(message) if leading.secondary_code.periods() <= 1 => {
            let symbol = leading.periods_per_symbol().unwrap_or(1);
            if symbol == 1 { (message.bit)(sv).len() as u32 } else { symbol }
        }
        _ => pilot_group(leading.period_s()),
    };
    leading.period_s() * f64::from(Mode::Phase.periods_per_update(fitted, periods))
}

#[cfg(test)]
mod tests {
    use super::*;
    use gnss::signal::SIGNALS;

    #[test]
    fn updates_are_as_long_as_set_where_signs_last_so_long() {
        let settings = Settings::default();
        let of = |name: &str| {
            let signal = SIGNALS.iter().find(|signal| signal.name == name).unwrap();
            let found = Followed::of(signal, &settings).unwrap();
            (1e3 * found.integration_s, found.least_integration_s.map(|s| 1e3 * s))
        };
        assert_eq!(settings.tracking.integration, 4);
        // Bits of 20 ms; D1's of 20 ms and D2's of 2; chips of 10 ms; symbols of 1 ms; pilots of 4 and of 10
        // ms.
        for (name, expected) in [
            ("GPS L1 C/A", (4.0, None)),
            ("BeiDou B1I", (4.0, Some(2.0))),
            ("BeiDou B3I", (4.0, Some(2.0))),
            ("GLONASS G1", (2.0, None)),
            ("BeiDou B2b", (1.0, None)),
            ("Galileo E1", (4.0, None)),
            ("GPS L1C", (10.0, None)),
        ] {
            assert_eq!(of(name), expected, "{name}");
        }
    }

    #[test]
    fn searches_sum_no_longer_than_signs_last_and_by_both_components_of_equal_power() {
        let settings = Settings::default();
        assert_eq!((settings.acquisition.coherent_periods, settings.acquisition.noncoherent_sums), (2, 10));
        let of = |name: &str| {
            let signal = SIGNALS.iter().find(|signal| signal.name == name).unwrap();
            let Searched { components, coherent_s, sums } = Followed::of(signal, &settings).unwrap().search;
            (components.len(), 1e3 * coherent_s, sums)
        };
        // Two periods within bits; one of symbols and of chips of secondary codes, which are as long; eight
        // tenths of the sums where data and pilot are searched together.
        for (name, expected) in [
            ("GPS L1 C/A", (1, 2.0, 10)),
            ("BeiDou B1I", (1, 1.0, 20)),
            ("GLONASS G1", (1, 2.0, 10)),
            ("Galileo E1", (2, 4.0, 8)),
            ("GPS L2C", (1, 20.0, 10)),
            ("GPS L1C", (1, 10.0, 10)),
        ] {
            assert_eq!(of(name), expected, "{name}");
        }
    }
}
