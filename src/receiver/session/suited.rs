//! What of samples and settings makes the results worse than need be, and which links samples can hold.

use crate::gnss::samples::IfMetadata;
use crate::gnss::signal::{Component, Link, Signal};
use crate::receiver::acquire::{self, AcquisitionSettings};
use crate::receiver::correlate::standing_bias_m;
use crate::receiver::lead::lead;
use crate::receiver::settings::Settings;

/// Errors of the code from which on a rate is warned of.
const STANDING_BIAS_M: f64 = 0.5;

/// What of samples and settings makes the results worse than need be.
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
            metadata.format.name(),
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

/// Of those that a search cannot tell apart the first.
pub(super) fn distinct(candidates: &[Link]) -> Vec<Link> {
    let mut all: Vec<Link> = Vec::with_capacity(candidates.len());
    for link in candidates {
        if !all.iter().any(|other| other.is_alike(*link)) {
            all.push(*link);
        }
    }
    all
}

/// Which signals each of several front ends receives: every signal in the first whose band holds its main
/// lobes, or else its carrier. Samples that hold none are searched all the same, the first front end's for
/// the first signal: that nothing is found has a diagnosis.
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
