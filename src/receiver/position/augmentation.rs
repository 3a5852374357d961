//! Corrections and integrity that augmentation systems send: kept as they come, and applied to ranges.
//!
//! Source: RTCA DO-229D, A.4.4.1 (test mode), A.4.4.3 (fast corrections and their rate), A.4.4.4 (integrity),
//! A.4.4.5 and A.4.5.1.1 (ageing), A.4.4.7 (long-term corrections), A.4.4.9 and A.4.4.10 (grid), table A-25
//! (time-outs, those of precision approach). Each satellite of such a system has a store of its own; the one
//! with most corrections in force serves, so that no two networks are mixed. Weights of ranges have the part
//! of fast corrections of the degradation alone; bounds for protection levels have all of it, and types 10,
//! 27 and 28 (`degradation`). Limits: ranges of other systems than GPS and of other signals than L1 C/A
//! have no corrections.

use std::collections::BTreeMap;

use nalgebra::Vector3;

use super::degradation::{self, Age, LongTermAge, UNKNOWN_M};
use super::least_squares::Range;
use gnss::augmentation::accuracy::{DO_NOT_USE, NOT_MONITORED, ageing_of, delay_variance_m2, range_variance_m2};
use gnss::augmentation::grid::{Point, Vertical, pierce, points, vertical};
use gnss::augmentation::{
    ALARM, Content, Covariance, DELAY_SLOTS, Delays, FAST_SLOTS, Factors, Fast, Half, LongTerm, Mask, Service,
};
use gnss::earth::{Geodetic, Look, SPEED_OF_LIGHT_MPS};
use gnss::klobuchar::L1_HZ;
use gnss::satellite::Sv;
use gnss::time::Epoch;

/// Validity of an indicator of accuracy, seconds (table A-25).
const INDICATOR_S: f64 = 12.0;
/// Validity of a long-term correction, seconds (table A-25).
const LONG_TERM_S: f64 = 240.0;
/// Validity of masks, seconds (table A-25).
const MASK_S: f64 = 600.0;
/// Validity of a delay of the grid, seconds (table A-25).
const DELAY_S: f64 = 600.0;
/// Validity of degradation factors, in types 7 and 10, and of covariances, seconds (table A-25).
const FACTORS_S: f64 = 240.0;
/// Validity of service messages, seconds (table A-25).
const SERVICE_S: f64 = 86_400.0;
/// Seconds for which a satellite that has sent type 0 is not used (A.4.4.1).
const TEST_S: f64 = 60.0;
/// Number of long-term corrections of a satellite that are kept: those of the ephemeris before and of the
/// current one.
const SETS: usize = 2;
const DAY_S: f64 = 86_400.0;
/// Indicator of ageing until it is said: the fastest.
const FASTEST: u8 = 15;

/// Status of a satellite in an augmentation system.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Standing {
    /// Satellite that must not be used.
    DoNotUse,
    /// Nothing in force is known of it.
    Without,
    /// Satellite with corrections.
    Corrected(Correction),
}

/// Corrections of a range, of its satellite's position and velocity, and the variance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Correction {
    range_m: f64,
    place_m: Vector3<f64>,
    velocity_mps: Vector3<f64>,
    clock_s: f64,
    drift: f64,
    sigma_m: f64,
}

impl Correction {
    /// The corrected range.
    pub fn of(&self, range: &Range) -> Range {
        let mut corrected = range.clone();
        corrected.pseudorange_m += self.range_m;
        corrected.satellite.position_m += self.place_m;
        corrected.satellite.velocity_mps += self.velocity_mps;
        corrected.clock.offset_s += self.clock_s;
        corrected.clock.drift += self.drift;
        corrected.noise_m = libm::hypot(range.noise_m, self.sigma_m);
        corrected.augmented_m = Some(self.sigma_m);
        corrected
    }
}

/// The latest fast correction of a satellite.
#[derive(Clone, Copy, Debug)]
struct Quick {
    part: u8,
    iodf: u8,
    correction_m: f64,
    at: Epoch,
    /// The one before, and its issue.
    before: Option<(f64, Epoch, u8)>,
    /// The indicator may be newer.
    udrei: u8,
    indicated: Epoch,
}

/// A band of the grid.
#[derive(Clone, Debug, Default)]
struct Band {
    iodi: u8,
    points: Vec<Point>,
    delays: BTreeMap<Point, (Vertical, Epoch)>,
}

/// Messages of one augmentation satellite. Satellites are keyed by their numbers.
#[derive(Clone, Debug, Default)]
pub(super) struct Store {
    mask: Option<(Mask, Epoch)>,
    quick: BTreeMap<u8, Quick>,
    long: BTreeMap<u8, Vec<Slow>>,
    /// Latency, and indicators of ageing by satellite.
    ageing: Option<(u8, BTreeMap<u8, u8>, Epoch)>,
    bands: BTreeMap<u8, Band>,
    closed: Option<Epoch>,
    factors: Option<(Factors, Epoch)>,
    /// Service messages of one issue by their numbers.
    services: BTreeMap<u8, (Service, Epoch)>,
    covariances: BTreeMap<u8, (Covariance, Epoch)>,
}

/// A long-term correction.
#[derive(Clone, Copy, Debug)]
struct Slow {
    long: LongTerm,
    since: Epoch,
    is_moving: bool,
}

/// Messages of all augmentation satellites.
#[derive(Clone, Debug, Default)]
pub(super) struct Augmentation(BTreeMap<Sv, Store>);

impl Augmentation {
    /// Takes what a block that began at `sent` says; of systems in test mode too, if `with_test`.
    pub fn take(&mut self, from: Sv, sent: Epoch, content: &Content, with_test: bool) {
        self.0.entry(from).or_default().take(sent, content, with_test);
    }

    /// The store with most corrections in force, if there is one.
    pub fn serving(&self, at: Epoch) -> Option<&Store> {
        let open = self.0.values().map(|store| (store.in_force(at), store)).filter(|(count, _)| *count > 0);
        // Of equal ones the first.
        let most = open.fold(None, |best: Option<(usize, &Store)>, one| match best {
            Some(best) if best.0 >= one.0 => Some(best),
            _ => Some(one),
        });
        most.map(|(_, store)| store)
    }
}

impl Store {
    fn take(&mut self, sent: Epoch, content: &Content, with_test: bool) {
        match content {
            Content::Fast(Fast { is_test: true, .. }) | Content::Test if !with_test => {
                *self = Self { closed: Some(sent.plus_s(TEST_S)), ..Self::default() };
            }
            Content::Test => {}
            Content::Mask(mask) => {
                if self.mask.as_ref().is_some_and(|(old, _)| old != mask) {
                    // Positions mean other satellites from here on.
                    (self.quick, self.long, self.ageing, self.covariances) = Default::default();
                }
                self.mask = Some((mask.clone(), sent));
            }
            Content::Fast(fast) => self.take_fast(fast, FAST_SLOTS, sent),
            Content::Mixed(mixed) => {
                self.take_fast(&mixed.fast, gnss::augmentation::MIXED_SLOTS, sent);
                self.take_half(&mixed.half, sent);
            }
            Content::LongTerm(halves) => halves.iter().for_each(|half| self.take_half(half, sent)),
            Content::Integrity(integrity) => {
                let Some((mask, _)) = &self.mask else { return };
                for (number, udrei) in mask.numbers.iter().zip(integrity.udrei) {
                    let Some(quick) = self.quick.get_mut(number) else { continue };
                    let iodf = integrity.iodf.get(usize::from(quick.part)).copied();
                    // An alarm holds whatever corrections were received (A.4.4.4).
                    if iodf == Some(ALARM) || iodf == Some(quick.iodf) {
                        (quick.udrei, quick.indicated) = (udrei, sent);
                    }
                }
            }
            Content::Degradation(said) => {
                let Some((mask, _)) = self.mask.as_ref().filter(|(mask, _)| mask.iodp == said.iodp) else { return };
                let each = mask.numbers.iter().copied().zip(said.indicators).collect();
                self.ageing = Some((said.latency_s, each, sent));
            }
            Content::GridMask(mask) => {
                let all = points(mask.band);
                let of = |number: &u8| all.get(usize::from(*number).checked_sub(1)?).copied();
                let points: Vec<Point> = mask.points.iter().filter_map(of).collect();
                let band = self.bands.entry(mask.band).or_default();
                if (band.iodi, &band.points) != (mask.iodi, &points) {
                    *band = Band { iodi: mask.iodi, points, delays: BTreeMap::new() };
                }
            }
            Content::Delays(delays) => self.take_delays(delays, sent),
            Content::Factors(factors) => self.factors = Some((**factors, sent)),
            Content::Service(service) => {
                self.services.retain(|_, (old, _)| old.iods == service.iods);
                self.services.insert(service.message, (**service, sent));
            }
            Content::Covariances(said) => {
                let numbers = self.masked(said.iodp).to_vec();
                for one in &said.both {
                    let place = usize::from(one.place).checked_sub(1);
                    if let Some(number) = place.and_then(|place| numbers.get(place)) {
                        self.covariances.insert(*number, (*one, sent));
                    }
                }
            }
            // Almanacs tell where to search.
            Content::Almanacs(_) => {}
        }
    }

    fn masked(&self, iodp: u8) -> &[u8] {
        self.mask.as_ref().filter(|(mask, _)| mask.iodp == iodp).map_or(&[], |(mask, _)| &mask.numbers)
    }

    fn take_fast(&mut self, fast: &Fast, slots: usize, sent: Epoch) {
        let numbers: Vec<u8> =
            self.masked(fast.iodp).iter().skip(usize::from(fast.part) * FAST_SLOTS).copied().collect();
        let said = fast.correction_m.into_iter().zip(fast.udrei).take(slots);
        for (number, (correction_m, udrei)) in numbers.into_iter().zip(said) {
            let before = self.quick.get(&number).map(|old| (old.correction_m, old.at, old.iodf));
            let (part, iodf) = (fast.part, fast.iodf);
            self.quick.insert(number, Quick { part, iodf, correction_m, at: sent, before, udrei, indicated: sent });
        }
    }

    fn take_half(&mut self, half: &Half, sent: Epoch) {
        let numbers = self.masked(half.iodp()).to_vec();
        for one in half.each() {
            let Some(number) = numbers.get(usize::from(one.place) - 1) else { continue };
            let own = self.long.entry(*number).or_default();
            own.retain(|old| old.long.iode != one.iode);
            own.push(Slow { long: *one, since: sent, is_moving: matches!(half, Half::Moving { .. }) });
            if own.len() > SETS {
                own.remove(0);
            }
        }
    }

    fn take_delays(&mut self, delays: &Delays, sent: Epoch) {
        let Some(band) = self.bands.get_mut(&delays.band).filter(|band| band.iodi == delays.iodi) else { return };
        let own = band.points.iter().skip(usize::from(delays.part) * DELAY_SLOTS);
        for (point, (delay_m, givei)) in own.zip(delays.vertical_m.into_iter().zip(delays.givei)) {
            match delay_variance_m2(givei) {
                Some(variance_m2) => band.delays.insert(*point, ((delay_m, variance_m2), sent)),
                None => band.delays.remove(point),
            };
        }
    }

    /// Satellites of which something is in force.
    fn in_force(&self, at: Epoch) -> usize {
        self.quick.keys().filter(|number| self.indicator(**number, at).is_some()).count()
    }

    /// The running indicator of a satellite's accuracy; `None` where it is none, or too old.
    fn indicator(&self, number: u8, at: Epoch) -> Option<(&Quick, u8)> {
        let is_young = |since: Epoch, limit_s: f64| at.since(since) <= limit_s;
        let mask = self.mask.as_ref().filter(|(_, since)| is_young(*since, MASK_S));
        let is_open = mask.is_some() && self.closed.is_none_or(|until| at.since(until) >= 0.0);
        let quick = self.quick.get(&number).filter(|quick| is_open && is_young(quick.indicated, INDICATOR_S))?;
        Some((quick, quick.udrei))
    }

    /// Status at `at` of a satellite whose elements have the issue `iode`.
    pub fn standing(&self, number: u8, iode: u16, at: Epoch) -> Standing {
        let Some((quick, udrei)) = self.indicator(number, at) else { return Standing::Without };
        if udrei == DO_NOT_USE {
            return Standing::DoNotUse;
        }
        self.correction(number, iode, quick, at).map_or(Standing::Without, Standing::Corrected)
    }

    fn correction(&self, number: u8, iode: u16, quick: &Quick, at: Epoch) -> Option<Correction> {
        let variance_m2 = (quick.udrei < NOT_MONITORED).then(|| range_variance_m2(quick.udrei))??;
        let (latency_s, indicator) = self.ageing_of(number);
        let ageing = ageing_of(indicator);
        let age_s = at.since(quick.at);
        if age_s > ageing.timeout_s {
            return None;
        }
        // Corrections that do not age have no rate (A.4.4.3).
        let rate_mps = match quick.before {
            Some((before_m, before, _))
                if indicator > 0 && (1.0..=ageing.timeout_s).contains(&quick.at.since(before)) =>
            {
                (quick.correction_m - before_m) / quick.at.since(before)
            }
            _ => 0.0,
        };
        let own = self.long.get(&number)?.iter();
        let fits = |slow: &&Slow| u16::from(slow.long.iode) == iode & 0xFF && at.since(slow.since) <= LONG_TERM_S;
        let Slow { long, .. } = own.rev().find(fits)?;
        let since_s = match long.velocity_mps {
            [0.0, 0.0, 0.0] if long.af1_sps == 0.0 => 0.0,
            _ => since_reference_s(long, at),
        };
        let velocity_mps = Vector3::from(long.velocity_mps);
        let aged_s = at.since(quick.indicated) + latency_s;
        Some(Correction {
            range_m: quick.correction_m + rate_mps * age_s,
            place_m: Vector3::from(long.place_m) + velocity_mps * since_s,
            velocity_mps,
            clock_s: long.af0_s + long.af1_sps * since_s,
            drift: long.af1_sps - rate_mps / SPEED_OF_LIGHT_MPS,
            sigma_m: variance_m2.sqrt() + 0.5 * ageing.acceleration_mps2 * aged_s * aged_s,
        })
    }

    /// Latency in seconds, and a satellite's indicator of ageing.
    fn ageing_of(&self, number: u8) -> (f64, u8) {
        match &self.ageing {
            Some((latency_s, each, _)) => (f64::from(*latency_s), each.get(&number).copied().unwrap_or(FASTEST)),
            None => (0.0, FASTEST),
        }
    }

    /// Factors of degradation in force.
    fn factors(&self, at: Epoch) -> Option<&Factors> {
        self.factors.as_ref().filter(|(_, since)| at.since(*since) <= FACTORS_S).map(|(factors, _)| factors)
    }

    /// Standard deviation in metres of orbit and clock of a corrected range that bounds them for integrity;
    /// `None` where the system states none.
    pub fn bound_m(&self, range: &Range, place_m: &Vector3<f64>) -> Option<f64> {
        let (number, at) = (range.sv.prn(), range.emitted);
        let (quick, udrei) = self.indicator(number, at)?;
        let sigma_m = range_variance_m2(udrei)?.sqrt() * self.delta(number, range, place_m);
        let is_known = self.ageing.as_ref().is_some_and(|(_, _, since)| at.since(*since) <= FACTORS_S);
        let Some(factors) = self.factors(at).filter(|_| is_known) else { return Some(sigma_m + UNKNOWN_M) };
        let (latency_s, indicator) = self.ageing_of(number);
        // Of several long-term corrections the one in use came last, or its error was taken when it came.
        let slow = self.long.get(&number)?.last()?;
        let long_term = match slow.is_moving {
            true => LongTermAge::Moving(since_reference_s(&slow.long, at)),
            false => LongTermAge::Steady(at.since(slow.since)),
        };
        let age = Age {
            accuracy_s: at.since(quick.indicated) + latency_s,
            fast_s: at.since(quick.at),
            before: quick.before.map(|(_, before, iodf)| (quick.at.since(before), iodf, quick.iodf)),
            long_term,
        };
        Some(degradation::corrected_m(sigma_m, factors, &ageing_of(indicator), &age))
    }

    /// Factor of a satellite's bound: by its covariance, else by the service's regions, else one.
    fn delta(&self, number: u8, range: &Range, place_m: &Vector3<f64>) -> f64 {
        let at = range.emitted;
        if let Some((covariance, _)) = self.covariances.get(&number).filter(|(_, since)| at.since(*since) <= FACTORS_S)
        {
            let c_covariance = self.factors(at).map_or(0.0, |factors| factors.c_covariance);
            return covariance.delta(&(range.satellite.position_m - place_m).normalize(), c_covariance);
        }
        let place = Geodetic::from_ecef(place_m);
        let young = self.services.values().filter(|(_, since)| at.since(*since) <= SERVICE_S);
        let services: Vec<&Service> = young.map(|(service, _)| service).collect();
        let holding = services.iter().filter(|service| service.holds(place));
        // Of the highest priority the smallest factor (A.4.4.13).
        let inside = holding.map(|service| (std::cmp::Reverse(service.priority), service.factor_inside()));
        let first = inside.min_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)));
        let outside = || services.iter().map(|service| service.factor_outside()).fold(1.0, f64::max);
        first.map_or_else(outside, |(_, factor)| factor)
    }

    /// The grid's delays that are in force; `None` where there are none.
    pub fn grid(&self, at: Epoch) -> Option<Grid> {
        let all = self.bands.values().flat_map(|band| &band.delays);
        let young: Vec<(Point, Vertical, Epoch)> = all
            .filter(|(_, (_, since))| at.since(*since) <= DELAY_S)
            .map(|(point, (vertical, since))| (*point, *vertical, *since))
            .collect();
        let points: BTreeMap<Point, Vertical> = young.iter().map(|(point, vertical, _)| (*point, *vertical)).collect();
        let bounds = self.factors(at).map(|factors| {
            let grown = |(point, (delay_m, variance_m2), since): &(Point, Vertical, Epoch)| {
                let sigma_m = degradation::delay_m(variance_m2.sqrt(), factors, at.since(*since));
                (*point, (*delay_m, sigma_m * sigma_m))
            };
            young.iter().map(grown).collect()
        });
        (!points.is_empty()).then_some(Grid { points, bounds })
    }
}

/// Seconds from the reference time of a long-term correction.
fn since_reference_s(long: &LongTerm, at: Epoch) -> f64 {
    (at.seconds() as f64 + at.fraction() - long.second_of_day + DAY_S / 2.0).rem_euclid(DAY_S) - DAY_S / 2.0
}

/// Delays of the ionosphere at the points of a grid.
#[derive(Clone, Debug, PartialEq)]
pub struct Grid {
    points: BTreeMap<Point, Vertical>,
    /// Points with variances that have grown with age, where the system states how.
    bounds: Option<BTreeMap<Point, Vertical>>,
}

impl Grid {
    /// Slant delay in metres on a carrier, and its standard deviation; `None` where the grid has nothing.
    pub fn slant_m(&self, user: Geodetic, look: Look, carrier_hz: f64) -> Option<(f64, f64)> {
        slant(&self.points, user, look, carrier_hz)
    }

    /// Standard deviation in metres that bounds the error of a slant delay for integrity.
    pub fn slant_bound_m(&self, user: Geodetic, look: Look, carrier_hz: f64) -> Option<f64> {
        slant(self.bounds.as_ref().unwrap_or(&self.points), user, look, carrier_hz).map(|(_, sigma_m)| sigma_m)
    }
}

/// Slant delay by the delays at points, and its standard deviation, in metres.
fn slant(points: &BTreeMap<Point, Vertical>, user: Geodetic, look: Look, carrier_hz: f64) -> Option<(f64, f64)> {
    let at = pierce(user, look);
    let (delay_m, variance_m2) = vertical(at, |point| points.get(&point).copied())?;
    let scale = at.obliquity * (L1_HZ / carrier_hz) * (L1_HZ / carrier_hz);
    Some((scale * delay_m, scale * variance_m2.sqrt()))
}

/// Deviation of a model's slant delay where the grid has nothing: a fifth of the delay, or a vertical one by
/// magnetic latitude (A.4.4.10.4, J.2.3), here by the geographic one.
pub fn model_sigma_m(delay_m: f64, user: Geodetic, look: Look) -> f64 {
    let vertical_m = match user.latitude_rad.to_degrees().abs() {
        low if low <= 20.0 => 9.0,
        middle if middle <= 55.0 => 4.5,
        _ => 6.0,
    };
    (0.2 * delay_m).max(pierce(user, look).obliquity * vertical_m)
}

#[cfg(test)]
mod tests {
    use super::*;
    use gnss::augmentation::{Degradation, GridMask, Integrity, MASKED};
    use gnss::satellite::System;

    const FROM: Sv = Sv { system: System::Sbas, number: 31 };

    fn at(second: f64) -> Epoch {
        Epoch::from_week(2409, 100_000.0).plus_s(second)
    }

    fn mask(iodp: u8) -> Content {
        Content::Mask(Mask { iodp, numbers: vec![3, 4, 9] })
    }

    fn fast(iodf: u8, correction_m: [f64; 3], udrei: [u8; 3]) -> Content {
        let mut fast = Fast { iodf, ..Fast::unmonitored(0) };
        fast.correction_m[..3].copy_from_slice(&correction_m);
        fast.udrei[..3].copy_from_slice(&udrei);
        Content::Fast(fast)
    }

    fn long(iode: u8, x_m: f64) -> Content {
        let of = |place| LongTerm { place, iode, place_m: [x_m, 0.0, 0.0], ..LongTerm::default() };
        let half = |both| Half::Steady { iodp: 0, both };
        Content::LongTerm(Box::new([half([of(1), of(2)]), half([of(3), LongTerm::default()])]))
    }

    fn ageing(indicator: u8) -> Content {
        Content::Degradation(Box::new(Degradation { latency_s: 0, iodp: 0, indicators: [indicator; MASKED] }))
    }

    /// All that a correction takes, ageing slowly.
    fn after(contents: &[(f64, Content)]) -> Augmentation {
        let first =
            [(0.0, mask(0)), (0.0, ageing(0)), (1.0, fast(1, [2.0, -3.0, 0.5], [0, 5, 15])), (2.0, long(40, 1.5))];
        let mut all = Augmentation::default();
        first.iter().chain(contents).for_each(|(second, content)| all.take(FROM, at(*second), content, false));
        all
    }

    fn standing(all: &Augmentation, number: u8, iode: u16, second: f64) -> Standing {
        all.serving(at(second)).map_or(Standing::Without, |store| store.standing(number, iode, at(second)))
    }

    fn corrected(all: &Augmentation, second: f64) -> Option<(f64, f64, f64)> {
        match standing(all, 3, 40, second) {
            Standing::Corrected(found) => Some((found.range_m, found.place_m.x, found.sigma_m)),
            _ => None,
        }
    }

    #[test]
    fn a_correction_is_of_its_satellite_and_of_its_set_and_none_is_of_one_that_must_not_be_used() {
        let all = after(&[]);
        // UDREI 0: 0.0520 m².
        assert_eq!(corrected(&all, 5.0), Some((2.0, 1.5, 0.0520_f64.sqrt())));
        // Of a longer issue the low eight bits count.
        assert!(matches!(standing(&all, 3, 0x100 | 40, 5.0), Standing::Corrected(_)));
        assert_eq!(standing(&all, 3, 41, 5.0), Standing::Without);
        assert_eq!(standing(&all, 9, 40, 5.0), Standing::DoNotUse);
        assert_eq!(standing(&all, 7, 40, 5.0), Standing::Without);
        // The next set is corrected beside the running one.
        let both = after(&[(4.0, long(41, -0.5))]);
        assert_eq!(corrected(&both, 5.0).map(|found| found.1), Some(1.5));
        assert!(matches!(standing(&both, 3, 41, 5.0), Standing::Corrected(found) if found.place_m.x == -0.5));
    }

    #[test]
    fn what_is_said_ends_with_its_time_out() {
        let all = after(&[]);
        assert!(corrected(&all, 13.0).is_some() && corrected(&all, 13.1).is_none());
        // Indicators go on by type 6, the fast correction until its ageing ends it, 120 s.
        let integrity = |iodf| Content::Integrity(Box::new(Integrity { iodf: [iodf; 4], udrei: [1; MASKED] }));
        let each =
            |iodf: u8| -> Vec<(f64, Content)> { (1..40).map(|k| (6.0 * f64::from(k), integrity(iodf))).collect() };
        let kept = after(&each(1));
        assert!(corrected(&kept, 121.0).is_some() && corrected(&kept, 121.1).is_none());
        // Of other fast corrections they say nothing, but for an alarm.
        assert!(corrected(&after(&each(2)), 20.0).is_none());
        let out = Content::Integrity(Box::new(Integrity { iodf: [ALARM; 4], udrei: [DO_NOT_USE; MASKED] }));
        assert_eq!(standing(&after(&[(4.0, out)]), 3, 40, 5.0), Standing::DoNotUse);
        // A long-term correction ends after 240 s.
        let quick: Vec<(f64, Content)> = (1..60).map(|k| (6.0 * f64::from(k), fast(1, [0.0; 3], [0; 3]))).collect();
        let kept = after(&quick);
        assert!(corrected(&kept, 242.0).is_some() && corrected(&kept, 242.1).is_none());
    }

    #[test]
    fn a_correction_that_ages_is_extrapolated_and_its_deviation_grows() {
        let all = after(&[(3.0, ageing(15)), (7.0, fast(2, [5.0, 0.0, 0.0], [0; 3]))]);
        let (range_m, _, sigma_m) = corrected(&all, 9.0).unwrap();
        // 3 m in 6 s for 2 s, and 0.0058 m/s² over 2 s (tables ).
        assert!((range_m - 6.0).abs() < 1e-12);
        assert!((sigma_m - (0.0520_f64.sqrt() + 0.5 * 0.0058 * 4.0)).abs() < 1e-12);
        // Such a correction ends after 12 s.
        assert!(corrected(&all, 19.0).is_some() && corrected(&all, 19.1).is_none());
    }

    #[test]
    fn another_mask_and_the_test_mode_end_everything() {
        assert!(corrected(&after(&[(3.0, mask(1))]), 5.0).is_none());
        assert!(corrected(&after(&[(3.0, mask(0))]), 5.0).is_some());
        let closed = after(&[(3.0, Content::Test)]);
        assert!(closed.serving(at(5.0)).is_none());
        let mut open = after(&[]);
        open.take(FROM, at(3.0), &Content::Test, true);
        assert!(corrected(&open, 5.0).is_some());
    }

    #[test]
    fn rates_of_long_term_corrections_count_from_their_reference_time() {
        let since_s = 37.0;
        let second_of_day = (at(5.0).seconds().rem_euclid(86_400) - 37) as f64;
        let one = LongTerm {
            place: 1,
            iode: 40,
            place_m: [1.0, 2.0, 3.0],
            velocity_mps: [0.01, 0.0, -0.02],
            af0_s: 1e-9,
            af1_sps: 1e-12,
            second_of_day,
        };
        let half = Half::Moving { iodp: 0, one };
        let all = after(&[(3.0, Content::LongTerm(Box::new([half.clone(), half])))]);
        let Standing::Corrected(found) = standing(&all, 3, 40, 5.0) else { panic!("not corrected") };
        let expected_m = Vector3::new(1.0 + 0.01 * since_s, 2.0, 3.0 - 0.02 * since_s);
        assert!((found.place_m - expected_m).norm() < 1e-12);
        assert!((found.clock_s - 1.037e-9).abs() < 1e-20 && found.drift == 1e-12);
    }

    #[test]
    fn the_grid_has_the_delays_of_its_points_and_none_without_its_mask() {
        let places: Vec<u8> = [(30, -110), (35, -110), (30, -105), (35, -105)]
            .map(|point| points(1).iter().position(|other| *other == point).unwrap() as u8 + 1)
            .into();
        let mut said = Delays { band: 1, iodi: 2, ..Delays::default() };
        said.vertical_m[..4].copy_from_slice(&[2.0, 3.0, 4.0, 5.0]);
        said.givei = [3; DELAY_SLOTS];
        let delays = Content::Delays(Box::new(said));
        let mask = |iodi| Content::GridMask(GridMask { bands: 1, band: 1, iodi, points: places.clone() });
        let user = Geodetic::from_degrees(32.5, -107.5, 0.0);
        let up = Look { azimuth_rad: 0.0, elevation_rad: std::f64::consts::FRAC_PI_2 };
        let grid = |contents: &[(f64, Content)], second: f64| {
            after(contents).serving(at(5.0)).and_then(|store| store.grid(at(second)))
        };
        let found = grid(&[(1.0, mask(2)), (2.0, delays.clone())], 10.0).unwrap();
        let (delay_m, sigma_m) = found.slant_m(user, up, L1_HZ).unwrap();
        // The middle of the cell; GIVEI 3: 0.1331 m².
        assert!((delay_m - 3.5).abs() < 1e-9 && (sigma_m - 0.1331_f64.sqrt()).abs() < 1e-9);
        assert!(grid(&[(1.0, mask(2)), (2.0, delays.clone())], 603.0).is_none());
        assert!(grid(&[(1.0, mask(1)), (2.0, delays.clone())], 10.0).is_none());
        assert!(grid(&[(2.0, delays)], 10.0).is_none());
    }
}
