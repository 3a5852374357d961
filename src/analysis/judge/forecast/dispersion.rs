//! The ionosphere that two bands of a satellite show: noise and the sigma that should be stated.
//!
//! The difference of both codes is I₁·(f₁²/f₂² − 1), so that the delay on a carrier f₀ is that difference
//! times f₁²f₂²/((f₁² − f₂²)·f₀²), and its noise that of both code loops times the same. The difference of
//! both carriers smooths it ([`Smoothing`]) and has no ionosphere of another sign, so that only noise is
//! left. Limits: the signals whose carriers are farthest apart are taken, of equal ones the first of the
//! table.

use std::collections::BTreeMap;
use std::iter::Peekable;

use super::ranges::Scene;
use crate::error::JudgeError;
use crate::expect::loops::Theory;
use crate::expect::smoothing::Smoothing;
use crate::measure::errors::{Errors, SignalError};
use crate::read::spill_store::Cursor;
use gnss::earth::SPEED_OF_LIGHT_MPS;
use gnss::gps::l1ca::L1_CA;
use gnss::satellite::Sv;
use gnss::signal::Link;

/// Window of the smoothing, as the manual has it.
const WINDOW_S: f64 = 600.0;
/// Carriers nearer to each other than this share are no two bands.
const SAME_BAND: f64 = 0.05;

/// Expected measurement of the ionosphere.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Dispersion {
    /// The satellite.
    pub sv: Sv,
    /// Number of the sample.
    pub sample: u64,
    /// Seconds from sample 0 by the receiver's clock.
    pub time_s: f64,
    /// Pair of the signals, the one of the higher carrier first.
    pub links: [Link; 2],
    /// Standard deviation of its noise on 1575.42 MHz, metres.
    pub sigma_m: f64,
    /// Error of both codes in metres that the front end's filters and chip edges cause.
    pub allowed_m: f64,
    /// True if each C/N0 was measured at its true value, on which the stated deviation depends.
    pub steady: bool,
}

/// One of a satellite's signals.
struct Signal<'s> {
    link: Link,
    theory: Theory,
    rows: Peekable<Cursor<'s, Link, SignalError>>,
}

/// Shows `see` what is expected of a satellite's measurements, one after the other.
///
/// # Errors
/// [`JudgeError::Read`] where spilled rows cannot be read, and those of `see`.
pub fn expected(
    scene: &Scene<'_>,
    errors: &Errors,
    sv: Sv,
    mut see: impl FnMut(Dispersion) -> Result<(), JudgeError>,
) -> Result<(), JudgeError> {
    let mut signals: Vec<Signal<'_>> = Vec::new();
    for link in errors.signals.keys().filter(|link| link.sv == sv) {
        let update_s = scene.choices.updates_s.get(&link);
        let theory = update_s.and_then(|update_s| Theory::new(scene.run, scene.choices.loops, &link, *update_s));
        let rows = errors.signals.cursor(link).peekable();
        signals.extend(theory.map(|theory| Signal { link, theory, rows }));
    }
    let mut filters: BTreeMap<[Link; 2], Smoothing> = BTreeMap::new();
    loop {
        let samples = signals.iter_mut().filter_map(|one| Some(one.rows.peek()?.as_ref().map_or(0, |row| row.sample)));
        let Some(sample) = samples.min() else { return Ok(()) };
        let mut seen: Vec<(usize, SignalError)> = Vec::new();
        for (place, one) in signals.iter_mut().enumerate() {
            let next = one.rows.next_if(|row| row.as_ref().map_or(true, |row| row.sample <= sample));
            seen.extend(next.transpose()?.map(|row| (place, row)));
        }
        let carrier_hz = |place: usize| signals.get(place).map_or(0.0, |one| one.link.carrier_hz());
        let pairs = seen.iter().flat_map(|a| seen.iter().map(move |b| (a, b)));
        let apart = pairs.filter(|(a, b)| carrier_hz(a.0) > (1.0 + SAME_BAND) * carrier_hz(b.0));
        // Of equal ones the first.
        let widest = apart.reduce(|best, next| {
            let hz =
                |pair: &(&(usize, SignalError), &(usize, SignalError))| carrier_hz(pair.0.0) - carrier_hz(pair.1.0);
            if hz(&next) > hz(&best) { next } else { best }
        });
        let Some(((first, a), (second, b))) = widest else { continue };
        let (Some(first), Some(second)) = (signals.get(*first), signals.get(*second)) else { continue };
        let links = [first.link, second.link];
        let bandwidth_hz = scene.choices.loops.dll_bandwidth_hz;
        let filter = filters.entry(links).or_insert_with(|| Smoothing::new(WINDOW_S, bandwidth_hz));
        let smooth = filter.take(a.time_s, a.locked_s.min(b.locked_s), 0.0);
        let squares = [first, second].map(|one| one.link.carrier_hz() * one.link.carrier_hz());
        let on_hz = L1_CA.carrier_hz(sv);
        let gain = squares[0] * squares[1] / (squares[0] - squares[1]) / (on_hz * on_hz);
        let [(a_hz, a_steady), (b_hz, b_steady)] = [scene.strength(a, first.link), scene.strength(b, second.link)];
        let noise_m = libm::hypot(first.theory.code_noise_m(a_hz), second.theory.code_noise_m(b_hz));
        let delay_s = |link: Link| scene.run.common.code_delay_s(link.signal);
        let edges_m = links.map(|link| scene.edges_m(link.signal));
        see(Dispersion {
            sv,
            sample,
            time_s: a.time_s,
            links,
            sigma_m: gain * noise_m * smooth.variance_ratio.sqrt(),
            allowed_m: gain
                * (SPEED_OF_LIGHT_MPS * (delay_s(links[1]) - delay_s(links[0])).abs()
                    + libm::hypot(edges_m[0], edges_m[1])),
            steady: a_steady && b_steady,
        })?;
    }
}
