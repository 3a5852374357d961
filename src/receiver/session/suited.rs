//! Properties of samples and settings that make the results worse than necessary, and links that samples can
//! hold.

use crate::acquire::{self, AcquisitionSettings};
use crate::correlate::{layers_refusal, standing_bias_m};
use crate::lead::{lead, refusal, undated};
use crate::settings::Settings;
use gnss::gps::l1ca::L1_CA;
use gnss::samples::IfMetadata;
use gnss::signal::{self, Component, Link, Signal};

/// Errors of the code from which on a rate is warned of.
const STANDING_BIAS_M: f64 = 0.5;

/// Warnings about samples and settings that make the results worse than necessary.
pub(super) fn warnings(metadata: &IfMetadata, settings: &Settings) -> Vec<String> {
    let rate_hz = metadata.rate.hz();
    let one = |signal: &Signal, component: &Component| {
        let bias_m = standing_bias_m(settings.tracking.replica, rate_hz, component);
        let samples_per_chip = rate_hz / component.chip_rate_hz;
        // The code's error turns once while the code passes a sample; what is quicker than the loop averages.
        let cycles_per_chip = signal.centre_hz() / component.chip_rate_hz;
        let slow_hz = cycles_per_chip * settings.tracking.dll_bandwidth_hz / samples_per_chip;
        (bias_m > STANDING_BIAS_M).then(|| {
            format!(
                "{:.3} Msps are {samples_per_chip:.3} samples a chip: while a satellite's Doppler stays below \
                 {slow_hz:.0} Hz, its pseudorange errs by {bias_m:.1} m rms (tracking.replica = {:?}); another rate, \
                 like 2.6 Msps, avoids it",
                1e-6 * rate_hz,
                settings.tracking.replica
            )
        })
    };
    let signals = settings.acquisition.signals();
    let mut found: Vec<String> = signals.iter().filter_map(|signal| one(signal, lead(signal)?)).collect();
    found.extend(undated(&signals).map(|(signal, reason)| format!("{signal}: {reason}")));
    found.extend(signals.iter().filter_map(|signal| image(metadata, signal, settings.acquisition.doppler_max_hz)));
    found
}

/// Real samples whose carriers meet their own image: at 0 Hz or half the rate a carrier above and one below
/// look alike.
fn image(metadata: &IfMetadata, signal: &Signal, doppler_max_hz: f64) -> Option<String> {
    let half_hz = 0.5 * metadata.rate.hz();
    let if_hz = metadata.if_hz(signal.centre_hz());
    let image_hz = half_hz * (if_hz / half_hz).round();
    let near = !metadata.format.is_complex() && (if_hz - image_hz).abs() < doppler_max_hz;
    near.then(|| {
        format!(
            "{} real samples with {} at {:.4} MHz, {:.1} kHz from {} of the rate: a carrier and its image are less \
             than two Dopplers of {doppler_max_hz:.0} Hz apart, and Dopplers get the wrong sign; another \
             intermediate frequency or complex samples avoid it",
            metadata.format,
            signal.name,
            1e-6 * if_hz,
            1e-3 * (if_hz - image_hz).abs(),
            if (image_hz / half_hz) as i64 % 2 == 0 { "a multiple" } else { "an odd half" },
        )
    })
}

/// Signals and satellites that are searched for, as far as the samples can hold them: of a signal whose
/// carriers differ by satellite, those whose own carrier lies within the band.
pub(super) fn candidates(metadata: &IfMetadata, settings: &AcquisitionSettings) -> Vec<Link> {
    let signals = settings.signals().into_iter().filter(|signal| acquire::can_hold(metadata, signal));
    signals
        .flat_map(|signal| signal.satellites().map(move |sv| signal.link(sv)))
        .filter(|link| settings.reserved_codes || link.is_of_constellation())
        .filter(|link| acquire::can_hold_carrier(metadata, *link))
        .collect()
}

/// First link of each group that a search cannot tell apart.
pub(super) fn distinct(candidates: &[Link]) -> Vec<Link> {
    let mut all: Vec<Link> = Vec::with_capacity(candidates.len());
    for link in candidates {
        if !all.iter().any(|other| other.is_alike(*link)) {
            all.push(*link);
        }
    }
    all
}

/// Share of the main lobes of a signal's spectrum that has to lie within a band for a default search. At 4
/// Msps E1, L1C and B1C reach it, at 2.6 Msps they do not.
const HELD_SHARE: f64 = 0.9;

/// Recorders of real samples convert no higher frequency than this.
const HIGHEST_IF_HZ: f64 = 100e6;

/// True if [`HELD_SHARE`] of a signal lies within one band of the samples. The band of complex samples is
/// minus to plus half the rate. Real samples have bands of half the rate above 0 Hz, and any of them counts.
/// Recorders sample beyond the first one on purpose, and nothing tells which one is meant.
fn is_within(metadata: &IfMetadata, signal: &Signal) -> bool {
    let half_hz = 0.5 * metadata.rate.hz();
    let (if_hz, lobe_hz) = (metadata.if_hz(signal.centre_hz()), HELD_SHARE * signal.lobe_hz());
    if metadata.format.is_complex() {
        return if_hz.abs() + lobe_hz <= half_hz;
    }
    let [low, high] = [if_hz - lobe_hz, if_hz + lobe_hz].map(|hz| (hz / half_hz).floor());
    low == high && low >= 0.0 && if_hz <= HIGHEST_IF_HZ
}

/// The signals that the bands of these samples hold, as far as this receiver can follow them to a position
/// without others; without those of two sidebands of a sub-carrier, which are signals too. At least
/// one: where the bands hold none, GPS L1 C/A, whose absence has a diagnosis.
pub(crate) fn held(metadata: &[IfMetadata], settings: &Settings) -> Vec<&'static Signal> {
    let is_held = |signal: &'static Signal, metadata: &IfMetadata| {
        let rate_hz = metadata.rate.hz();
        is_within(metadata, signal)
            && lead(signal).is_some_and(|component| rate_hz >= component.chip_rate_hz)
            && layers_refusal(settings.tracking.waveform, signal, rate_hz).is_none()
    };
    let is_followed = |signal: &'static Signal| signal.sides_hz() == 0.0 && refusal(signal).is_none();
    let mut held = signal::all();
    held.retain(|signal| is_followed(signal) && metadata.iter().any(|metadata| is_held(signal, metadata)));
    let all = held.clone();
    while let Some((undated, _)) = undated(&held) {
        held.retain(|signal| *signal != undated);
    }
    // Without others to date them they can still be searched for and followed.
    if held.is_empty() {
        held = all;
    }
    if held.is_empty() { vec![&L1_CA] } else { held }
}

/// Signals that each of several front ends receives. A signal is received in the first one whose band holds
/// its main lobes, or else its carrier. If the samples hold no signal, the first front end is searched for
/// the first signal, so that there is a diagnosis.
pub(super) fn assigned(metadata: &[IfMetadata], signals: &[&'static Signal]) -> Vec<Vec<&'static Signal>> {
    let whole = |metadata: &IfMetadata, signal: &Signal| {
        metadata.if_hz(signal.centre_hz()).abs() + signal.lobe_hz() <= 0.5 * metadata.rate.hz()
    };
    let mut assigned = vec![Vec::new(); metadata.len()];
    for &signal in signals {
        let best = metadata.iter().position(|metadata| whole(metadata, signal));
        let place = best.or_else(|| metadata.iter().position(|metadata| acquire::can_hold(metadata, signal)));
        if let Some(own) = place.and_then(|place| assigned.get_mut(place)) {
            own.push(signal);
        }
    }
    if assigned.iter().all(Vec::is_empty)
        && let Some(own) = assigned.first_mut()
    {
        own.extend(signals.first());
    }
    assigned
}

#[cfg(test)]
mod tests {
    use super::*;
    use gnss::samples::Format;
    use gnss::time::Rate;

    #[test]
    fn what_is_searched_for_unasked_is_what_the_bands_hold() {
        let of = |format: Format, rate_hz: f64, center_hz: f64| {
            let rate = Rate::from_hz(rate_hz).unwrap();
            IfMetadata { format, rate, center_hz, inverted: false, start: None }
        };
        let held = |all: &[IfMetadata]| -> Vec<&'static str> {
            let all = super::held(all, &Settings::default()).into_iter();
            // Other tests add signals of their own.
            all.filter(|signal| signal::SIGNALS.contains(signal)).map(|signal| signal.name).collect()
        };
        let narrow = ["GPS L1 C/A", "QZSS L1 C/A", "SBAS L1"];
        assert_eq!(held(&[of(Format::Ci8, 2.6e6, 1_575.42e6)]), narrow);
        let wide = held(&[of(Format::Ci8, 4e6, 1_575.42e6)]);
        assert!(["Galileo E1", "GPS L1C", "BeiDou B1C"].iter().all(|name| wide.contains(name)), "{wide:?}");
        assert!(narrow.iter().all(|name| wide.contains(name)), "{wide:?}");
        // Both sidebands, not the one signal of them.
        let e5 = held(&[of(Format::Ci8, 65e6, 1_191.795e6)]);
        assert!(e5.contains(&"Galileo E5a") && e5.contains(&"Galileo E5b") && !e5.contains(&"Galileo E5"), "{e5:?}");
        // Real samples at an IF of 4.092 MHz, and beyond half the rate, where B1I may be meant as well.
        let real = |if_hz: f64| held(&[of(Format::Ri8, 16.368e6, 1_575.42e6 - if_hz)]);
        assert!(narrow.iter().all(|name| real(4.092e6).contains(name)), "{:?}", real(4.092e6));
        assert!(!real(4.092e6).contains(&"BeiDou B1I"));
        let folded = real(20.46e6);
        assert!(narrow.iter().all(|name| folded.contains(name)) && folded.contains(&"BeiDou B1I"), "{folded:?}");
        // Samples of E5 at 75 MHz, into which L1 would fold.
        let wide = held(&[of(Format::Ri8, 100e6, 1_191.795e6 - 75e6)]);
        assert!(wide.contains(&"Galileo E5a") && !wide.contains(&"GPS L1 C/A"), "{wide:?}");
        // Two bands, and one that holds nothing.
        let two = held(&[of(Format::Ci8, 4e6, 1_575.42e6), of(Format::Ci8, 21e6, 1_176.45e6)]);
        assert!(["GPS L1 C/A", "GPS L5", "Galileo E5a", "BeiDou B2a"].iter().all(|name| two.contains(name)));
        assert_eq!(held(&[of(Format::Ci8, 4e6, 900e6)]), ["GPS L1 C/A"]);
        // What others would have to date is searched for where there are none.
        assert!(held(&[of(Format::Ci8, 15e6, 1_278.75e6)]).contains(&"Galileo E6"));
    }
}
