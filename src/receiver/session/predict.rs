//! Searches for satellites that are known to be there: after a loss, risen, or followed on another signal.
//!
//! Position, velocity and clock of the last fix and a satellite's ephemeris give its elevation and Doppler; a
//! signal of it that any front end follows gives the Doppler of its others, in the ratio of carriers. Such
//! a search looks at a few Doppler bins of a few satellites, a tenth of the work for each, and so comes four
//! times as often as one for all. What it may miss is left to those: the position errs by a fraction of a
//! hertz for each hundred metres, but velocity and clock change, by [`GROWTH_HZ`] a second (2 m/s²) while
//! there is no fix. Limits: the strong satellites are not subtracted first, so a hit that their
//! cross-correlation may have made is left to a search for all.

use std::collections::BTreeMap;

use nalgebra::Vector3;

use super::FrontEnd;
use super::shared::Shared;
use crate::acquire::{Acquired, WEAK_SHARE};
use crate::lead::lead;
use gnss::broadcast::Ephemeris;
use gnss::earth::{Geodetic, SPEED_OF_LIGHT_MPS, look, rotate_earth};
use gnss::record::{AcquisitionRow, Fix};
use gnss::satellite::Sv;
use gnss::signal::{Link, Signal};
use gnss::time::Epoch;

/// Largest difference of a Doppler from the predicted one, in hertz.
const HALF_HZ: f64 = 500.0;
/// Growth of that difference for each second without a fix, in hertz per second.
const GROWTH_HZ: f64 = 10.0;
/// Predictions older than this are none.
const OLDEST_S: f64 = 60.0;
/// Time between such searches over that between searches for all while a satellite is lost.
const SHARE: f64 = 0.25;

/// Largest number of doublings of the waiting time after such searches without a hit.
const MOST_DOUBLINGS: u32 = 4;

/// Satellites that should be there, with their Dopplers, and how far these may be off.
pub(super) type Near = (Vec<(Link, f64)>, f64);

/// A link that was searched for where it should be, and not found.
#[derive(Clone, Copy)]
pub(super) struct Missed {
    times: u32,
    /// The sample from which on it is searched for again.
    until: u64,
    /// True if another signal of the satellite was tracked.
    led: bool,
}

/// Doppler of a satellite at an antenna's position and velocity, without the receiver's clock, in parts of
/// the carrier, and its elevation.
fn seen((here_m, velocity_mps): (Vector3<f64>, Vector3<f64>), at: Epoch, ephemeris: &Ephemeris) -> Option<(f64, f64)> {
    let travel_s = (ephemeris.state(at).ok()?.position_m - here_m).norm() / SPEED_OF_LIGHT_MPS;
    let sent = ephemeris.state(at.plus_s(-travel_s)).ok()?;
    let there_m = rotate_earth(&sent.position_m, travel_s);
    let sight_m = there_m - here_m;
    let rate_mps = (rotate_earth(&sent.velocity_mps, travel_s) - velocity_mps).dot(&sight_m) / sight_m.norm();
    Some((-rate_mps / SPEED_OF_LIGHT_MPS, look(Geodetic::from_ecef(&here_m), &here_m, &there_m).elevation_rad))
}

impl FrontEnd {
    /// Lets all front ends know which Dopplers it follows.
    pub(super) fn announce(&self, shared: &mut Shared) {
        shared.dopplers.retain(|link, _| !self.signals.contains(&link.signal));
        let settled = self.tracks.iter().filter(|track| !self.gap.is_busy() && track.channel.is_settled());
        shared.dopplers.extend(settled.map(|track| {
            let link = track.channel.link();
            (link, (track.channel.doppler_hz() - self.offset.hz()) / link.carrier_hz())
        }));
    }

    /// Links that are not followed and should be there.
    pub(super) fn foreseen(&self, now: u64, shared: &Shared) -> Near {
        let (by_fix, later_s) = self.foreseen_by_fix(now, shared);
        let one = |link: &Link| {
            let followed = self.tracks.iter().any(|track| track.channel.link() == *link);
            let healthy = shared.ephemerides.is_healthy_on(link.sv, link.signal);
            let beside = shared.dopplers.iter().find(|(other, _)| other.sv == link.sv);
            // Once another signal of it is followed it is there.
            let waits = |missed: &Missed| now < missed.until && (missed.led || beside.is_none());
            if followed || self.missed.get(link).is_some_and(waits) || self.refused.contains_key(link) || !healthy {
                return None;
            }
            let doppler = beside.map(|(_, doppler)| *doppler).or_else(|| by_fix.get(&link.sv).copied())?;
            Some((*link, doppler * link.carrier_hz() + self.offset.hz()))
        };
        let half_hz = HALF_HZ + GROWTH_HZ * later_s;
        (self.candidates.iter().filter_map(one).collect(), half_hz.min(self.settings.acquisition.doppler_max_hz))
    }

    /// The Dopplers, in parts of the carrier, of satellites that a fix and their ephemerides put above the
    /// mask, and its age.
    fn foreseen_by_fix(&self, now: u64, shared: &Shared) -> (BTreeMap<Sv, f64>, f64) {
        let age = |fix: &Fix| self.metadata.rate.elapsed_s(now.saturating_sub(self.step.own(fix.sample)));
        let young = shared.latest.as_ref().map(|fix| (fix, age(fix))).filter(|(_, later_s)| *later_s <= OLDEST_S);
        let Some((fix, later_s)) = young else { return (BTreeMap::new(), 0.0) };
        let velocity_mps = Vector3::new(fix.vx_mps, fix.vy_mps, fix.vz_mps);
        let here_m = Vector3::new(fix.x_m, fix.y_m, fix.z_m) + velocity_mps * later_s;
        let at = Epoch::new(fix.gps_s, fix.gps_fraction_s).plus_s(later_s);
        let mask_rad = self.settings.position.mask_deg.to_radians();
        let one = |sv: Sv| {
            let (doppler, elevation_rad) = seen((here_m, velocity_mps), at, shared.ephemerides.of(sv).first()?)?;
            (elevation_rad > mask_rad).then_some((sv, doppler - fix.clock_drift))
        };
        (shared.ephemerides.satellites().filter_map(one).collect(), later_s)
    }

    /// True if searches for all leave a link out. Its satellite then also sends another signal, by its block,
    /// that is received and costs less to search for. That signal predicts this one.
    pub(super) fn is_led(link: Link, shared: &Shared) -> bool {
        let at = shared.near();
        // Dopplers as many as the period is long, of lags as many as there are chips.
        let cost = |signal: &'static Signal| lead(signal).map_or(0.0, |one| one.period_s() * f64::from(one.code_chips));
        let received = || shared.noises.iter().map(|(signal, _)| *signal);
        let place = |signal: &'static Signal| received().position(|other| other == signal);
        let rank = |signal: &'static Signal| (cost(signal), place(signal));
        received().any(|other| {
            other.system == link.sv.system
                && rank(other) < rank(link.signal)
                && (other.sent)(link.sv.number, at)
                && other.satellites().any(|sv| sv == link.sv)
        })
    }

    /// Takes note of what such a search did not find: most of it is not sent at all.
    pub(super) fn note_missed(&mut self, results: &[(AcquisitionRow, Option<Acquired>)], now: u64, shared: &Shared) {
        let wait = self.foreseen_wait();
        for (row, hit) in results {
            let link = row.link();
            if hit.is_some() || self.lost.contains_key(&link) {
                self.missed.remove(&link);
                continue;
            }
            let times = self.missed.get(&link).map_or(0, |missed| missed.times + 1).min(MOST_DOUBLINGS);
            let led = shared.dopplers.keys().any(|other| other.sv == link.sv);
            self.missed.insert(link, Missed { times, until: now + (wait << times), led });
        }
    }

    /// Samples from one such search to the next: less while a satellite has been lost.
    pub(super) fn foreseen_wait(&self) -> u64 {
        let wait_s = self.settings.operation.reacquisition_interval_s;
        self.samples(if self.lost.is_empty() { wait_s } else { SHARE * wait_s }).max(1)
    }

    /// Results that cannot be cross-correlation with a tracked satellite, and true if there were others.
    pub(super) fn believed(
        &self,
        results: Vec<(AcquisitionRow, Option<Acquired>)>,
    ) -> (Vec<(AcquisitionRow, Option<Acquired>)>, bool) {
        let strongest_dbhz = self.tracks.iter().map(|track| track.cn0_dbhz).fold(f64::NEG_INFINITY, f64::max);
        let before = results.len();
        let own = |(_, hit): &(AcquisitionRow, Option<Acquired>)| {
            hit.is_none_or(|hit| libm::pow(10.0, (hit.cn0_dbhz - strongest_dbhz) / 10.0) > WEAK_SHARE)
        };
        let believed: Vec<_> = results.into_iter().filter(own).collect();
        let doubted = believed.len() < before;
        (believed, doubted)
    }
}

#[cfg(test)]
mod tests {
    use super::super::Session;
    use super::*;
    use crate::settings::Settings;
    use gnss::beidou::b1c::B1C;
    use gnss::beidou::in_phase::B2I;
    use gnss::gps::l1c::L1C;
    use gnss::gps::l1ca::L1_CA;
    use gnss::gps::l5::L5;
    use gnss::rinex;
    use gnss::samples::{Format, IfMetadata};
    use gnss::satellite::System;
    use gnss::time::Rate;

    #[test]
    fn a_satellite_that_one_front_end_follows_is_foreseen_by_the_other_before_there_is_a_fix() {
        let of = |center_hz: f64, rate_hz: f64| {
            let rate = Rate::from_hz(rate_hz).unwrap();
            IfMetadata { format: Format::Ci8, rate, center_hz, inverted: false, start: None }
        };
        let mut settings = Settings::default();
        settings.acquisition.or_signals(&[&L1_CA, &L5]);
        let mut session = Session::new(&[of(1_575.42e6, 2.6e6), of(1_176.45e6, 21e6)], &settings).unwrap();
        let [first, second] = session.front_ends.as_slice() else { panic!("two front ends") };
        assert!(second.foreseen(0, &session.shared).0.is_empty());
        session.shared.dopplers.insert(L1_CA.link(Sv::gps(10)), -1.5e-6);
        let (near, half_hz) = second.foreseen(0, &session.shared);
        assert_eq!((near.len(), half_hz), (1, HALF_HZ));
        assert_eq!(near[0].0, L5.link(Sv::gps(10)));
        assert!((near[0].1 + 1.5e-6 * 1_176.45e6).abs() < 1e-6, "{}", near[0].1);
        // Nothing is followed any more: nothing is foreseen.
        first.announce(&mut session.shared);
        assert!(second.foreseen(0, &session.shared).0.is_empty());
    }

    #[test]
    fn later_searches_leave_out_what_another_signal_of_the_satellite_leads_to() {
        let rate = Rate::from_hz(21e6).unwrap();
        let start = Some(Epoch::parse("2026-03-09T10:00:00").unwrap());
        let of = |center_hz: f64| IfMetadata { format: Format::Ci8, rate, center_hz, inverted: false, start };
        let shared = |signals: &[&'static Signal]| {
            let mut settings = Settings::default();
            settings.acquisition.or_signals(signals);
            Session::new(&[of(1_575.42e6), of(1_207.14e6)], &settings).unwrap().shared
        };
        let both = shared(&[&L1_CA, &L1C]);
        assert!(FrontEnd::is_led(L1C.link(Sv::gps(4)), &both) && !FrontEnd::is_led(L1_CA.link(Sv::gps(4)), &both));
        assert!(!FrontEnd::is_led(L1C.link(Sv::gps(4)), &shared(&[&L1C])), "nothing leads to it");
        // B2I is cheaper than B1C, but satellites of the third generation do not send it.
        let both = shared(&[&B1C, &B2I]);
        let beidou = |number| Sv { system: System::BeiDou, number };
        assert!(!FrontEnd::is_led(B1C.link(beidou(25)), &both) && FrontEnd::is_led(B1C.link(beidou(10)), &both));
    }

    #[test]
    fn what_is_not_found_waits_twice_as_long_each_time_until_another_signal_is_followed() {
        let rate = Rate::from_hz(2.6e6).unwrap();
        let metadata = IfMetadata { format: Format::Ci8, rate, center_hz: 1_575.42e6, inverted: false, start: None };
        let mut session = Session::new(&[metadata], &Settings::default()).unwrap();
        let (shared, front_end) = (&mut session.shared, &mut session.front_ends[0]);
        let link = L1_CA.link(Sv::gps(7));
        let row = AcquisitionRow {
            sample: 0,
            sv: link.sv,
            signal: link.signal,
            acquired: false,
            statistic: 1.0,
            threshold: 2.0,
            doppler_hz: 0.0,
            code_phase_chips: 0.0,
            cn0_dbhz: 30.0,
        };
        let wait = front_end.foreseen_wait();
        for doublings in [0, 1, 2, 3, 4, 4] {
            front_end.note_missed(&[(row.clone(), None)], 1000, shared);
            assert_eq!(front_end.missed[&link].until, 1000 + (wait << doublings));
        }
        // Led by another signal it is due at once, and when it is missed then it waits again.
        shared.dopplers.insert(L5.link(link.sv), 0.0);
        let is_due = |front_end: &FrontEnd, shared: &Shared| front_end.foreseen(1001, shared).0 == [(link, 0.0)];
        assert!(is_due(front_end, shared));
        front_end.note_missed(&[(row, None)], 1000, shared);
        assert!(!is_due(front_end, shared));
    }

    #[test]
    fn a_predicted_doppler_is_the_rate_at_which_the_range_shrinks() {
        let sets = rinex::embedded().unwrap().ephemerides;
        let at = Epoch::parse("2010-07-01T08:05:58").unwrap();
        let here_m = Geodetic::from_degrees(26.5, 80.2, 130.0).to_ecef();
        let velocity_mps = Vector3::new(200.0, -90.0, 40.0);
        let near: Vec<&Ephemeris> = sets.iter().filter(|set| at.since(set.toe).abs() < 3600.0).collect();
        let mut above = 0;
        for set in near {
            let range_m = |later_s: f64| {
                let place_m = here_m + velocity_mps * later_s;
                let there_m = set.state(at.plus_s(later_s - 0.075)).unwrap().position_m;
                (rotate_earth(&there_m, 0.075) - place_m).norm()
            };
            let (doppler, elevation_rad) = seen((here_m, velocity_mps), at, set).unwrap();
            let expected = -(range_m(0.5) - range_m(-0.5)) / SPEED_OF_LIGHT_MPS;
            // Light times from 67 to 90 ms under accelerations of half a metre a second²; 1e-10 is 0.16 Hz.
            assert!((doppler - expected).abs() < 1e-10, "{} {doppler} {expected}", set.sv);
            above += u32::from(elevation_rad > 5_f64.to_radians());
        }
        // The twelve of the static scene, and G01 and G25, which say that they are sick; of G01 a set of 6 h
        // is beside that of 8 h.
        assert!((12..=15).contains(&above), "{above}");
    }
}
