//! What of each signal the loops follow, and by which settings: theory needs to know it.

use serde::Serialize;

use crate::lead::{lead, other_side};
use crate::settings::Settings;
use gnss::signal::{Component, Layer, Layers, Signal};

/// How a signal is followed, as `receiver.json` says it.
#[derive(Clone, Debug, Serialize)]
pub struct Followed {
    /// Its name.
    pub signal: &'static str,
    /// Place of the component among the signal's …
    pub component: usize,
    /// … and of the layer that the replica has among that component's; `None` where it has them all, or the
    /// tone of a side.
    pub layer: Option<usize>,
    /// Place of the component on the other side of the sub-carrier, where both are followed together.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub other_side: Option<usize>,
    /// Distance of early and late, fitted to the layer's pulse.
    pub spacing_chips: f64,
    /// Time of a loop's update.
    pub integration_s: f64,
    /// One-sided noise bandwidth of the phase loop, as far as such updates allow.
    pub pll_bandwidth_hz: f64,
    /// The same of the code loop.
    pub dll_bandwidth_hz: f64,
}

impl Followed {
    /// Of a signal by these settings; `None` where nothing of it can be followed.
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
        Some(Self {
            signal: signal.name,
            component: at(leading)?,
            layer,
            other_side: other_side(leading, signal).and_then(at),
            spacing_chips: fitted.spacing_chips,
            integration_s: leading.period_s() * f64::from(fitted.integration),
            pll_bandwidth_hz: fitted.pll_bandwidth_hz,
            dll_bandwidth_hz: fitted.dll_bandwidth_hz,
        })
    }
}
