//! Observations and ephemerides become ranges: of one carrier, or of two in combination.

use std::collections::BTreeMap;

use nalgebra::Vector3;

use super::augmentation::{Grid, Standing};
use super::combination::{Combination, Used, paired};
use super::least_squares::{self, Corrections, Ionosphere, Range, freedom};
use super::reduced::InShort;
use super::smooth::Smoothed;
use super::{IonosphereChoice, Sets, Solver, SystemClocks, roots};
use gnss::broadcast::Ephemeris;
use gnss::earth::SPEED_OF_LIGHT_MPS;
use gnss::gps::l1ca::L1_CA;
use gnss::record::Observation;
use gnss::satellite::System;
use gnss::signal::Link;
use gnss::time::GPST;

/// Half of the shorter curve fit interval, seconds (IS-GPS-200N, 20.3.3.4.3.1).
const HALF_FIT_S: f64 = 7200.0;
/// Half of the longer curve fit interval, seconds.
const HALF_LONG_FIT_S: f64 = 10_800.0;
/// An ephemeris is used a little beyond its interval, until the next one is decoded.
const FIT_GRACE_S: f64 = 600.0;

/// Corrected ranges serve while the directions of their satellites dilute a position by no more than this
/// times what those of all do: corrections take away most of a range's error, and nothing of a Doppler's.
const LARGEST_LOSS: f64 = 1.5;

/// Ranges that a position may be made of.
pub(super) struct Offered {
    /// Ranges without corrections of an augmentation system.
    pub plain: Vec<Range>,
    /// Ranges that an augmentation system corrects, and its ionospheric grid. Ranges of systems without
    /// corrections are included.
    pub corrected: Option<(Vec<Range>, Option<Grid>)>,
}

impl Solver {
    /// The ranges of observations whose satellites' ephemerides are known: of a satellite with two carriers
    /// their combination, if the settings say so. Beside them those that an augmentation system corrects.
    pub(super) fn ranges(&mut self, observations: &[Observation], ephemerides: &Sets) -> Offered {
        let is_known = |row: &Observation| {
            let short = |short: &InShort| short.serves(&[row.signal], row.sent());
            ephemerides.serving(row.sv, &[row.signal]).is_some() || self.reduced.get(&row.sv).is_some_and(short)
        };
        let known: Vec<Observation> = (observations.iter())
            .filter(|row| is_known(row) || self.settings.ionosphere != IonosphereChoice::Combined)
            .cloned()
            .collect();
        // The filters of single signals go on: one of two carriers may be lost.
        let smoothed: BTreeMap<Link, Smoothed> =
            observations.iter().map(|row| (row.link(), self.smoother.smooth(row))).collect();
        // Those of two carriers too, though no message may serve both yet.
        let mut combined: BTreeMap<(Link, Link), Smoothed> = BTreeMap::new();
        if self.settings.ionosphere == IonosphereChoice::Combined {
            for used in paired(observations) {
                let Used::Combined(pair) = used else { continue };
                combined.insert((pair.first.link(), pair.second.link()), self.smoother.smooth_combined(&pair));
            }
        }
        let used = match self.settings.ionosphere {
            IonosphereChoice::Combined => paired(&known),
            _ => known.iter().map(Used::Single).collect(),
        };
        let mut one = |used: &Used<'_>| {
            let row = match used {
                Used::Single(row) => row,
                Used::Combined(pair) => pair.first,
            };
            let signals = match used {
                Used::Single(row) => vec![row.signal],
                Used::Combined(pair) => vec![pair.first.signal, pair.second.signal],
            };
            if !signals.iter().all(|signal| ephemerides.is_healthy_on(row.sv, signal)) {
                return None;
            }
            let whole = ephemerides.serving(row.sv, &signals);
            let in_short = self.reduced.get(&row.sv).filter(|short| short.serves(&signals, row.sent())).cloned();
            let set = whole.or(in_short.as_ref().map(|short| &short.set))?;
            let range = match used {
                Used::Single(row) => self.single(row, smoothed.get(&row.link())?, set),
                Used::Combined(pair) => {
                    let known = combined.get(&(pair.first.link(), pair.second.link())).copied();
                    let smoothed = known.unwrap_or_else(|| self.smoother.smooth_combined(pair));
                    self.combined(pair, &smoothed, set)
                }
            }?;
            let range = self.on_one_time(range);
            let stated_m = (range.sv.system == System::Sbas).then(|| accuracy_m(set.ura_index));
            let range = Range { augmented_m: stated_m, ..range };
            let iode = set.iode;
            let range = match in_short.filter(|_| whole.is_none()) {
                Some(short) => Range { noise_m: libm::hypot(range.noise_m, short.sigma_m), ..range },
                None => range,
            };
            Some((range, iode))
        };
        let ranges: Vec<(Range, u16)> = used.iter().filter_map(&mut one).collect();
        self.augmented(ranges)
    }

    /// Ranges as they are, but for those that must not be used, and those with the corrections of an
    /// augmentation system.
    fn augmented(&self, ranges: Vec<(Range, u16)>) -> Offered {
        let now = ranges.first().map(|(range, _)| range.emitted);
        let Some((store, now)) = now.and_then(|now| Some((self.augmentation.serving(now)?, now))) else {
            return Offered { plain: ranges.into_iter().map(|(range, _)| range).collect(), corrected: None };
        };
        let (mut plain, mut corrected, mut count) = (Vec::new(), Vec::new(), 0);
        for (range, iode) in ranges {
            if range.sv.system != System::Gps {
                corrected.push(range.clone());
                plain.push(range);
                continue;
            }
            match store.standing(range.sv.prn(), iode, range.emitted) {
                Standing::DoNotUse => {}
                Standing::Corrected(correction) if range.signal == &L1_CA && !range.is_combined => {
                    corrected.push(correction.of(&range));
                    plain.push(range);
                    count += 1;
                }
                Standing::Corrected(_) | Standing::Without => plain.push(range),
            }
        }
        let grid = store.grid(now).filter(|_| self.settings.ionosphere != IonosphereChoice::None);
        Offered { plain, corrected: (count > 0).then_some((corrected, grid)) }
    }

    /// Ranges for a position. Corrected ranges are used where enough of them are available, and never mixed
    /// with uncorrected ones, because their errors differ.
    pub(super) fn chosen(&self, offered: Offered) -> (Vec<Range>, Option<Grid>) {
        let Offered { plain, corrected: Some((corrected, grid)) } = offered else { return (offered.plain, None) };
        let bare = Corrections {
            ionosphere: Ionosphere::Absent,
            troposphere: false,
            model_sigma_m: self.settings.model_sigma_m,
        };
        let first_m = || Some(roots::first(&plain, Vector3::zeros(), &bare).ok()?.position_m);
        let place_m = self.last_m.or_else(first_m);
        let mask_rad = self.settings.mask_deg.to_radians();
        let dilution = |ranges: &[Range]| least_squares::dilution(ranges, &place_m?, mask_rad);
        let suffices = match (dilution(&corrected), dilution(&plain)) {
            (Some(of_corrected), Some(of_all)) => of_corrected <= LARGEST_LOSS * of_all,
            (of_corrected, _) => of_corrected.is_some(),
        };
        if suffices && freedom(&corrected) >= 1 { (corrected, grid) } else { (plain, None) }
    }

    /// The range with its clock against GPS time, where the settings take the system's offset from it out of
    /// the message and it is known.
    fn on_one_time(&self, range: Range) -> Range {
        let known = self.ahead.iter().find(|(scale, _)| **scale == *range.time);
        let Some((_, ahead)) = known.filter(|_| self.settings.system_clocks == SystemClocks::Broadcast) else {
            return range;
        };
        // A clock reads less against a time that is ahead.
        let ahead_m = SPEED_OF_LIGHT_MPS * ahead.at_s(range.emitted);
        let ahead_m = planted!("receiver.position.system_offset", ahead_m, -ahead_m);
        Range { time: &GPST, pseudorange_m: range.pseudorange_m + ahead_m, ..range }
    }

    /// Thermal noise of a code measurement, and the carrier's power over noise density.
    pub(super) fn noise(&self, row: &Observation) -> Option<(f64, f64)> {
        let cn0_hz = libm::pow(10.0, row.cn0_dbhz / 10.0);
        let (_, noise) = self.noises.iter().find(|(signal, _)| *signal == row.signal)?;
        Some((noise.sigma_m(cn0_hz), cn0_hz))
    }

    fn single(&self, row: &Observation, smoothed: &Smoothed, ephemeris: &Ephemeris) -> Option<Range> {
        let (sigma_m, cn0_hz) = self.noise(row)?;
        let noise_m = sigma_m * smoothed.variance_ratio.sqrt();
        let range = range(row, ephemeris, smoothed.pseudorange_m, noise_m, cn0_hz)?;
        Some(Range { doppler_hz: range.doppler_hz - self.smoother.carrier_offset_hz(row.signal), ..range })
    }

    /// Velocity comes from the first of the two carriers.
    fn combined(&self, pair: &Combination<'_>, smoothed: &Smoothed, ephemeris: &Ephemeris) -> Option<Range> {
        let ((first_m, cn0_hz), (second_m, _)) = (self.noise(pair.first)?, self.noise(pair.second)?);
        let noise_m = pair.sigma(first_m, second_m) * smoothed.variance_ratio.sqrt();
        let range = range(pair.first, ephemeris, smoothed.pseudorange_m, noise_m, cn0_hz)?;
        let second = ephemeris.clock_of_signal(range.emitted, pair.second.signal).ok()?;
        Some(Range {
            doppler_hz: range.doppler_hz - self.smoother.carrier_offset_hz(pair.first.signal),
            clock: pair.clock(range.clock, second),
            is_combined: true,
            ..range
        })
    }
}

/// Nominal accuracy of an index as satellites send it, in metres (IS-GPS-200N, 20.3.3.3.1.3).
fn accuracy_m(index: u8) -> f64 {
    let power = if index <= 6 { 1.0 + 0.5 * f64::from(index) } else { f64::from(index) - 2.0 };
    libm::exp2(power)
}

/// Range with the satellite's position at transmission; `None` when its ephemeris is stale or no orbit.
fn range(
    observation: &Observation,
    ephemeris: &Ephemeris,
    pseudorange_m: f64,
    noise_m: f64,
    cn0_hz: f64,
) -> Option<Range> {
    let sent = observation.sent();
    let half_s = match ephemeris.long_fit {
        _ if ephemeris.is_sent_after_reference() || ephemeris.sent_from().is_some() => 0.5 * ephemeris.fit_interval_s(),
        true => HALF_LONG_FIT_S,
        false => HALF_FIT_S.min(0.5 * ephemeris.fit_interval_s()),
    } + FIT_GRACE_S;
    if sent.since(ephemeris.toe).abs() > half_s {
        return None;
    }
    // The clock's argument is GPS time; one correction leaves drift × offset², far below a picosecond.
    let rough = ephemeris.clock_of_signal(sent, observation.signal).ok()?;
    let emitted = sent.plus_s(-rough.offset_s);
    let clock = ephemeris.clock_of_signal(emitted, observation.signal).ok()?;
    let clock = planted!("receiver.position.group_delay", clock, ephemeris.clock(emitted).ok()?);
    let emitted = sent.plus_s(-clock.offset_s);
    Some(Range {
        sv: observation.sv,
        signal: observation.signal,
        time: observation.signal.time,
        satellite: ephemeris.state(emitted).ok()?,
        clock,
        emitted,
        pseudorange_m,
        doppler_hz: observation.doppler_hz,
        carrier_hz: observation.signal.carrier_hz(observation.sv),
        noise_m,
        cn0_hz,
        is_combined: false,
        augmented_m: None,
    })
}
