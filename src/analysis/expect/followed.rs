//! Tracking of a signal as the receiver states it: its component, the layer of the replica, and the loops.

use serde::Deserialize;
use serde_json::Value;

use crate::read::Run;
use crate::waveform::{Waveform, leading};
use gnss::signal::{Component, Layer, Layers, Link, Signal, Tone};

/// Entry of `receiver.json` about a signal.
#[derive(Clone, Debug, Deserialize)]
pub(crate) struct Entry {
    signal: String,
    component: usize,
    /// Index of the replica's layer; `None` where the replica has all layers.
    layer: Option<usize>,
    /// Index of the other sideband of a sub-carrier.
    other_side: Option<usize>,
    spacing_chips: f64,
    pub integration_s: f64,
    /// Update time in seconds for satellites whose bits are shorter.
    least_integration_s: Option<f64>,
    pub pll_bandwidth_hz: f64,
    dll_bandwidth_hz: f64,
    pub search: Option<Searched>,
}

/// The sums in which a signal is searched for.
#[derive(Clone, Debug, Deserialize)]
pub(crate) struct Searched {
    /// Indices of the components whose powers are added.
    pub components: Vec<usize>,
    pub coherent_s: f64,
    /// Coherent sums of each.
    pub sums: u32,
}

impl Entry {
    /// Entry of `receiver.json` for a signal, if there is one.
    pub fn of(receiver: &Value, signal: &Signal) -> Option<Self> {
        let stated = receiver.get("followed").and_then(Value::as_array);
        let mut entries = stated.into_iter().flatten().filter_map(|entry| Self::deserialize(entry).ok());
        entries.find(|entry| entry.signal == signal.name)
    }

    /// Power that the replica finds, over the signal's.
    pub fn share(&self, signal: &Signal) -> f64 {
        let places = [Some(self.component), self.other_side].into_iter().flatten();
        let followed = places.filter_map(|place| signal.components.get(place));
        let share = |component: &Component| {
            let found = if self.layer.is_some() { efficiency(component) } else { 1.0 };
            component.power_share * found
        };
        followed.map(share).sum()
    }

    /// Time of an update of the loops of one satellite, whose bits may be too short for the usual one.
    pub fn update_s(&self, link: Link) -> f64 {
        let component = link.signal.components.get(self.component);
        let bit_s = component.and_then(|component| {
            let message = component.message.filter(|_| component.periods_per_symbol() == Some(1))?;
            Some((message.bit)(link.sv).len() as f64 * component.period_s())
        });
        let is_short = bit_s.is_some_and(|bit_s| bit_s < self.integration_s - 1e-9);
        self.least_integration_s.filter(|_| is_short).unwrap_or(self.integration_s)
    }
}

/// Power that the replica of a component's strongest layer finds over the component's. For one sideband
/// of a sub-carrier it is that of its chips.
pub(crate) fn efficiency(component: &Component) -> f64 {
    let layer = component.strongest().filter(|_| component.tone().is_none());
    layer.map_or(1.0, |layer| {
        let [found, own] = component.shapes_by(Layers::Whole, layer).map(|shape| shape.correlation(0.0));
        found * found / own
    })
}

/// Tracking of a signal by a receiver.
#[derive(Clone, Debug)]
pub(crate) struct Followed {
    /// The component, and the layer of it that the replica has; none where it has all.
    pub component: &'static Component,
    pub made: Option<&'static Layer>,
    /// Cross-correlation of the sent layers with the replica.
    pub found: Waveform,
    /// Cross-correlation of the whole waveform with the replica, for which the discriminator is made.
    pub assumed: Waveform,
    /// Autocorrelation of the replica.
    pub own: Waveform,
    /// The sub-carrier, of which both sidebands are followed: what is found, assumed and the replica's own
    /// are those of the chips then.
    pub sides: Option<Tone>,
    /// Power of what is followed over the whole signal's.
    pub share: f64,
    /// Distance of early and late, chips; the settings' where the receiver does not say it, as the others.
    pub spacing_chips: Option<f64>,
    /// Noise bandwidths, Hz.
    pub pll_bandwidth_hz: Option<f64>,
    pub dll_bandwidth_hz: Option<f64>,
}

impl Followed {
    /// Tracking of a signal in a run. A receiver that does not state it is taken to track the leading
    /// component by a replica of all its layers.
    pub fn of(run: &Run, signal: &Signal) -> Option<Self> {
        let entry = Entry::of(&run.receiver, signal);
        let component = match &entry {
            Some(entry) => signal.components.get(entry.component)?,
            None => leading(signal)?,
        };
        let made = match &entry {
            Some(Entry { layer: Some(layer), .. }) => Some(component.layers.get(*layer)?),
            _ => None,
        };
        let by = |sent: Layers| match made {
            Some(layer) => component.shapes_by(sent, layer),
            None => [component.shape_between(sent, Layers::Whole), component.shape()],
        };
        let other = entry.as_ref().and_then(|entry| signal.components.get(entry.other_side?));
        let sides = component.tone().filter(|_| other.is_some());
        let ([found, own], [assumed, _]) = match sides {
            Some(tone) => {
                let chips = tone.shapes(component.chip_rate_hz);
                (chips.clone(), chips)
            }
            None => (by(run.scene.waveform), by(Layers::Whole)),
        };
        let of = |shape| Waveform::of_shape(shape, component.chip_rate_hz);
        Some(Self {
            component,
            made,
            found: of(found),
            assumed: of(assumed),
            own: of(own),
            sides,
            share: component.power_share + other.map_or(0.0, |other| other.power_share),
            spacing_chips: entry.as_ref().map(|entry| entry.spacing_chips),
            pll_bandwidth_hz: entry.as_ref().map(|entry| entry.pll_bandwidth_hz),
            dll_bandwidth_hz: entry.as_ref().map(|entry| entry.dll_bandwidth_hz),
        })
    }
}

#[cfg(test)]
mod tests {
    use gnss::galileo::e1::E1;
    use gnss::gps::l1ca::L1_CA;
    use gnss::signal::Layers;

    #[test]
    fn a_pilot_s_boc_finds_half_the_power_less_a_tenth_and_a_bit_for_a_wide_slope() {
        let pilot = &E1.components[1];
        let [found, own] = pilot.shapes_by(Layers::Whole, &pilot.layers[0]);
        let chip_s = 1.0 / pilot.chip_rate_hz;
        // BOC(1,1) with itself is 1 − 3τ, and BOC(6,1) beside it has no part in phase at no delay.
        assert!((own.correlation(0.1 * chip_s) - 0.7).abs() < 1e-12 && (own.correlation(0.0) - 1.0).abs() < 1e-12);
        assert!((found.correlation(0.0) - f64::sqrt(10.0 / 11.0)).abs() < 1e-12);
        // Other layers are orthogonal at whole sixths of a half chip, and leave their edges between.
        let sixth = chip_s / 6.0;
        assert!((found.correlation(sixth) / found.correlation(0.0) - 0.5).abs() < 1e-9);
    }

    #[test]
    fn a_code_of_one_layer_is_what_it_was() {
        let component = &L1_CA.components[0];
        let [found, own] = component.shapes_by(Layers::Whole, &component.layers[0]);
        for k in 0..=20 {
            let delay_s = 0.05 * f64::from(k) / component.chip_rate_hz;
            let triangle = 1.0 - 0.05 * f64::from(k);
            assert!((found.correlation(delay_s) - triangle).abs() < 1e-12);
            assert!((own.correlation(delay_s) - triangle).abs() < 1e-12);
        }
    }
}
