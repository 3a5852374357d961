//! Model of a component in this receiver's correlators.

use super::TrackingSettings;
use super::loops::CodeShape;
use crate::correlate::correlation;
use crate::lead::{efficiency, shapes};
use gnss::signal::{Component, Layers, Shape, Tone};

/// The correlation of a component with the replica that is made of it.
#[derive(Clone, Copy, Debug)]
pub struct ReplicaModel {
    /// Shape of the correlation at early and late.
    pub shape: CodeShape,
    /// Mean power of the replica's samples: below one for area edges, and where steps are zero.
    pub power: f64,
    /// Power that the replica finds, over that of the component: below one where it has not all layers.
    pub efficiency: f64,
}

impl ReplicaModel {
    /// A model for samples of `rate_hz`. `None` for a component without layers.
    pub fn new(settings: &TrackingSettings, component: &Component, rate_hz: f64) -> Option<Self> {
        Self::of(settings, component, None, rate_hz)
    }

    /// A model of both sidebands of a sub-carrier together, of which `component` is one. `None` for a
    /// component without sub-carrier.
    pub fn of_both_sides(settings: &TrackingSettings, component: &Component, rate_hz: f64) -> Option<Self> {
        Self::of(settings, component, Some(component.tone()?), rate_hz)
    }

    fn of(settings: &TrackingSettings, component: &Component, sides: Option<Tone>, rate_hz: f64) -> Option<Self> {
        let [signal, own] = shapes(component, settings.waveform)?;
        let chips_per_sample = component.chip_rate_hz / rate_hz;
        // The tones are those at the samples' instants, whatever the chips are.
        let at = |shape: &Shape, chips: f64| {
            let (value, slope) = correlation(shape, settings.replica, chips_per_sample, chips);
            sides.map_or((value, slope), |tone| {
                let both = tone.both_sides(chips);
                (value * both, slope * both + value * tone.slope_of_both(chips))
            })
        };
        let (power, _) = at(&own, 0.0);
        let of = |chips: f64| at(&own, chips).0;
        let shape = CodeShape::of(settings.dll_discriminator, settings.spacing_chips, |chips| at(&signal, chips), of);
        Some(Self { shape, power, efficiency: efficiency(&signal, &own) })
    }
}

/// A side peak of a replica's correlation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SidePeak {
    /// Distance from the main peak, in chips.
    pub chips: f64,
    /// Correlation there over that of the main peak, with its sign.
    pub ratio: f64,
}

/// The side peak nearest to the main one of both sidebands of a sub-carrier together; `None` without one.
pub fn side_peak_of_both(component: &Component) -> Option<SidePeak> {
    let tone = component.tone()?;
    // Of (1 − x)·cos(πmx), which has its extreme a little before half a cycle's end.
    let at = |chips: f64| (1.0 - chips) * tone.both_sides(chips);
    let slope = |chips: f64| (1.0 - chips) * tone.slope_of_both(chips) - tone.both_sides(chips);
    let end = 1.0 / f64::from(tone.half_cycles.abs());
    let (mut low, mut high) = (0.5 * end, end);
    for _ in 0..50 {
        let middle = 0.5 * (low + high);
        if slope(middle) < 0.0 { low = middle } else { high = middle }
    }
    Some(SidePeak { chips: low, ratio: at(low) })
}

/// The side peak nearest to the main one of a component's replica; `None` where there is none.
pub fn side_peak(component: &Component, made: Layers) -> Option<SidePeak> {
    let [_, own] = shapes(component, made)?;
    let corners = (own.chip_s() / own.step_s()).round() as u32;
    let at = |corner: u32| own.correlation(f64::from(corner) * own.step_s());
    // Corners at which the modulus rises before and falls behind.
    let is_peak = |corner: &u32| {
        let (before, here, after) = (at(corner - 1), at(*corner), at(corner + 1));
        here * (here - before) > 0.0 && here * (after - here) < 0.0
    };
    let corner = (1..corners).find(is_peak)?;
    Some(SidePeak { chips: f64::from(corner) / f64::from(corners), ratio: at(corner) / at(0) })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lead::followed_db;
    use gnss::galileo::altboc::E5;
    use gnss::gps::l1ca::L1_CA;
    use gnss::signal::Layer;
    use gnss::signal::synthetic::{LONG_BOC, MIXED};

    #[test]
    fn the_nearest_side_peak_is_that_of_the_printed_correlation() {
        const fn of(layers: &'static [Layer]) -> Component {
            Component { layers, ..LONG_BOC.components[0] }
        }
        // Sine-phased BOC: (−1)^k (1 − k/n) at k of n steps. Cosine-phased BOC(1,1): −1/4, 1/2 … at quarters
        // of a chip: R = 1 at 0, −1/4 at 1/4, −1/2 at 1/2, 1/4 at 3/4.
        const COSINE: [Layer; 1] = [Layer { pulse: &[1, -1, -1, 1], ..Layer::BPSK }];
        let near = |layers: &'static [Layer], chips: f64, ratio: f64| {
            let found = side_peak(&of(layers), Layers::Strongest).unwrap();
            assert!((found.chips - chips).abs() < 1e-12 && (found.ratio - ratio).abs() < 1e-12, "{found:?}");
        };
        near(&[Layer::BOC11], 0.5, -0.5);
        near(&[Layer::BOC61], 1.0 / 12.0, -11.0 / 12.0);
        near(&COSINE, 0.5, -0.5);
        assert_eq!(side_peak(&L1_CA.components[0], Layers::Strongest), None);
    }

    #[test]
    fn both_sides_make_the_triangle_times_the_sub_carrier_with_its_peaks_and_slopes() {
        let pilot = &E5.components[1];
        // AltBOC(15,10): one and a half cycles a chip.
        let printed = |chips: f64| (1.0 - chips) * libm::cos(3.0 * std::f64::consts::PI * chips);
        let found = side_peak_of_both(pilot).unwrap();
        let grid = (1667..5000).map(|k| 1e-4 * f64::from(k));
        let lowest = grid.fold(0.0, |lowest, chips| if printed(chips) < printed(lowest) { chips } else { lowest });
        assert!((found.chips - lowest).abs() < 1e-4 && (found.ratio - printed(lowest)).abs() < 1e-6, "{found:?}");
        assert_eq!(side_peak(pilot, Layers::Strongest), None);
        let settings = TrackingSettings::default().fitted(pilot);
        assert_eq!(settings.spacing_chips, 0.125);
        let shape = ReplicaModel::of_both_sides(&settings, pilot, f64::INFINITY).unwrap().shape;
        let slope = (printed(0.0625 - 1e-6) - printed(0.0625 + 1e-6)) / 2e-6;
        // The integral of the slope in 2000 midpoints.
        let worst = (shape.value - printed(0.0625)).abs().max((shape.common - printed(0.125)).abs());
        assert!(worst < 2e-3 && (shape.slope - slope).abs() < 0.02, "{shape:?} {slope}");
        let alone = ReplicaModel::new(&settings, pilot, f64::INFINITY).unwrap().shape;
        assert!((alone.value - 0.9375).abs() < 2e-3 && (alone.slope - 1.0).abs() < 2e-3, "{alone:?}");
    }

    #[test]
    fn the_shape_at_early_and_late_is_that_of_the_waveform() {
        let model = |component: &Component, spacing_chips: f64| {
            let settings = TrackingSettings { spacing_chips, ..Default::default() };
            ReplicaModel::new(&settings, component, f64::INFINITY).unwrap()
        };
        let near = |found: CodeShape, value: f64, slope: f64, common: f64| {
            // The integral of the slope in 2000 midpoints, whose corners lie anywhere.
            let worst = (found.value - value).abs().max((found.slope - slope).abs()).max((found.common - common).abs());
            assert!(worst < 2e-3, "{found:?}");
        };
        near(model(&L1_CA.components[0], 0.5).shape, 0.75, 1.0, 0.5);
        // BOC(1,1): 1 − 3|τ| to half a chip.
        near(model(&LONG_BOC.components[0], 0.2).shape, 0.7, 3.0, 0.4);
        // TMBOC by BOC(1,1) alone: 29 of 33 chips, both in what is found and in the replica.
        let mixed = model(&MIXED.components[0], 0.2);
        near(mixed.shape, 0.7, 3.0, 0.4);
        assert!((mixed.power - 29.0 / 33.0).abs() < 2e-3 && (mixed.efficiency - 29.0 / 33.0).abs() < 1e-12);
        assert!((followed_db(&L1_CA.components[0], Layers::Strongest)).abs() < 1e-12);
        assert!((followed_db(&LONG_BOC.components[1], Layers::Strongest) + 10.0 * libm::log10(2.0)).abs() < 1e-12);
    }
}
