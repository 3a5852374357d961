//! The steps of a code as a receiver makes them: a layer of a component, and nothing where that is not sent.
//!
//! BPSK and BOC are made as they are. Of CBOC, TMBOC and QMBOC the strongest layer is made, unless settings
//! say otherwise: against the full waveform that costs 0.4 dB where BOC(6,1) has a tenth of the power, and
//! spares steps six times as short, which take six times the samples, and a pass for each layer. For one
//! sideband of a sub-carrier, chips are made without steps, and the sub-carrier is a tone beside the carrier.
//! That tone lacks lines that no front end passes.

use gnss::signal::{Component, Layer, Layers, Signal};

/// Reason why samples at `rate_hz` do not suffice for replicas of these layers, if they do not. Area edges
/// need a sample in each step.
pub fn layers_refusal(made: Layers, signal: &Signal, rate_hz: f64) -> Option<String> {
    let several = signal.components.iter().filter(|one| one.layers.len() > 1 && one.tone().is_none());
    let steps_hz = several.map(|component| component.chip_rate_hz * component.steps_per_chip() as f64);
    let need_hz = steps_hz.fold(0.0, f64::max);
    (made == Layers::Whole && rate_hz < need_hz).then(|| {
        format!(
            "tracking.waveform = \"whole\" takes a sample in each step of its pulses, {} Msps at least, and these \
             are {} Msps: write \"strongest\"",
            1e-6 * need_hz,
            1e-6 * rate_hz
        )
    })
}

/// One period of a replica: equal steps of −1, 0 and +1.
#[derive(Clone, Debug, PartialEq)]
pub struct Wave {
    /// One period: −1, 0 where another code has its turn, +1.
    pub values: Vec<i8>,
    /// Equal steps into which a chip is divided.
    pub steps_per_chip: usize,
    /// Share of the chips that are this code's turn.
    pub share: f64,
}

impl Wave {
    /// The strongest layer of a satellite by its number; of a component that is one sideband of a sub-carrier
    /// the chips that its tone has. `None` where the documents assign it no code.
    pub fn new(component: &Component, number: u8) -> Option<Self> {
        let Some(tone) = component.tone() else {
            return Self::of(component, component.strongest()?, number);
        };
        let mut chips = Self::of(component, &Layer::BPSK, number)?;
        if tone.half_cycles % 2 != 0 {
            chips.values.iter_mut().skip(1).step_by(2).for_each(|chip| *chip = -*chip);
        }
        Some(chips)
    }

    /// One of its layers.
    pub fn of(component: &Component, layer: &Layer, number: u8) -> Option<Self> {
        let chips = (component.code)(number)?;
        let values = chips.iter().enumerate().flat_map(|(index, &chip)| {
            let chip = if layer.covers(index) { chip } else { 0 };
            layer.pulse.iter().map(move |&sign| chip * sign)
        });
        let sent = chips.iter().filter(|&&chip| chip != 0).count();
        let share = sent as f64 / chips.len().max(1) as f64;
        Some(Self { values: values.collect(), steps_per_chip: layer.pulse.len(), share })
    }
}

/// True if a replica can be made of a component's code: its period has fewer than 2¹⁶ steps.
pub fn fits(component: &Component) -> bool {
    let each = steps_of_chip(component);
    (64..super::MOST_STEPS).contains(&(component.code_chips as usize * each))
}

/// Steps of a chip of the replica that is made of a component's strongest layer, or of its tone.
pub fn steps_of_chip(component: &Component) -> usize {
    component.tone().map_or_else(|| component.strongest().map_or(0, |layer| layer.pulse.len()), |_| 1)
}

#[cfg(test)]
mod tests {
    use super::*;
    use gnss::gps::l1ca::{self, L1_CA};
    use gnss::signal::synthetic::{LONG_BOC, MIXED, MULTIPLEXED};

    #[test]
    fn a_period_has_the_strongest_layer_of_every_chip_that_has_it() {
        let wave = Wave::new(&L1_CA.components[0], 7).unwrap();
        let code = l1ca::code(7).unwrap();
        assert_eq!(wave.steps_per_chip, 1);
        assert!(wave.values.iter().zip(&code).all(|(value, one)| (*value < 0) == *one && *value != 0));
        let wave = Wave::new(&LONG_BOC.components[0], 3).unwrap();
        let chips = (LONG_BOC.components[0].code)(3).unwrap();
        assert!(chips.iter().zip(wave.values.chunks(2)).all(|(&chip, steps)| steps == [chip, -chip]));
        // BOC(6,1) on chips 0, 4, 6 and 29 of 33.
        let wave = Wave::new(&MIXED.components[0], 3).unwrap();
        let silent: Vec<usize> = (0..33).filter(|&chip| wave.values[2 * chip] == 0).collect();
        assert_eq!((wave.steps_per_chip, silent, wave.share), (2, vec![0, 4, 6, 29], 1.0));
        let wave = Wave::new(&MULTIPLEXED.components[0], 3).unwrap();
        assert!(wave.share == 0.5 && wave.values.chunks(2).all(|steps| steps[0] != 0 && steps[1] == 0));
        assert!(Wave::new(&L1_CA.components[0], 0).is_none());
    }
}
