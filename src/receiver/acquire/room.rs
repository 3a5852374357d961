//! Samples that searches look at, and searches that do with the samples there are.

use super::{AcquireError, AcquisitionSettings, can_hold, grid};
use crate::lead::lead;
use gnss::samples::IfMetadata;
use gnss::signal::Signal;

/// Samples that a search for the signals that are asked for looks at, from the first sample of its block.
///
/// # Errors
/// Errors of [`AcquisitionSettings::validate`].
pub fn samples_needed(metadata: &IfMetadata, settings: &AcquisitionSettings) -> Result<u64, AcquireError> {
    settings.validate()?;
    let one = |signal: &'static Signal| {
        let component = lead(signal)?;
        let (period_s, periods) = (component.period_s(), f64::from(settings.periods(component)));
        // The grid of Dopplers may reach a step beyond the largest one asked for.
        let slowest = 1.0 - (settings.doppler_max_hz + 1.0 / period_s) / signal.centre_hz();
        Some(grid::samples_needed(period_s * metadata.rate.hz(), periods, settings.sums(component), slowest))
    };
    let inside = settings.signals().into_iter().filter(|signal| can_hold(metadata, signal));
    Ok(inside.filter_map(one).max().unwrap_or(0))
}

/// The settings of a search that `have` samples have room for: fewer sums, sums of fewer code periods where
/// one is too long, and a longer one where there is room for one and not for two; `None` below two code
/// periods.
///
/// # Errors
/// Errors of [`AcquisitionSettings::validate`].
pub fn shortened(
    metadata: &IfMetadata,
    settings: &AcquisitionSettings,
    have: u64,
) -> Result<Option<AcquisitionSettings>, AcquireError> {
    for coherent_periods in (1..=settings.coherent_periods).rev() {
        let with = |noncoherent_sums| AcquisitionSettings { coherent_periods, noncoherent_sums, ..settings.clone() };
        if samples_needed(metadata, &with(1))? > have {
            continue;
        }
        // Samples grow with the sums.
        let (mut fits, mut too_many) = (1, settings.noncoherent_sums + 1);
        while too_many - fits > 1 {
            let middle = fits + (too_many - fits) / 2;
            if samples_needed(metadata, &with(middle))? > have { too_many = middle } else { fits = middle }
        }
        if fits > 1 || coherent_periods < settings.coherent_periods {
            return Ok(Some(with(fits)));
        }
        // Where a second sum does not fit, one sum takes what is left.
        let mut longest = with(1);
        for coherent_periods in coherent_periods + 1..2 * coherent_periods {
            let longer = AcquisitionSettings { coherent_periods, ..longest.clone() };
            if longer.validate().is_err() || samples_needed(metadata, &longer)? > have {
                break;
            }
            longest = longer;
        }
        return Ok(Some(longest));
    }
    Ok(None)
}

/// Samples below which nothing is searched for: two code periods of the signal with the shortest.
///
/// # Errors
/// Errors of [`AcquisitionSettings::validate`].
pub fn least_samples(metadata: &IfMetadata, settings: &AcquisitionSettings) -> Result<u64, AcquireError> {
    settings.validate()?;
    let inside = settings.signals().into_iter().filter(|signal| can_hold(metadata, signal));
    let mut least = None;
    for signal in inside {
        let signals = vec![signal.name.to_owned()];
        let alone = AcquisitionSettings { signals, coherent_periods: 1, noncoherent_sums: 1, ..settings.clone() };
        let need = samples_needed(metadata, &alone)?;
        least = Some(least.map_or(need, |least: u64| least.min(need)));
    }
    Ok(least.unwrap_or(0))
}
