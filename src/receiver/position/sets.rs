//! The decoded elements: of each satellite those of each of its messages, the latest.
//!
//! An ephemeris serves the signals whose delays its message has ([`SetForm::serves`]). For several signals
//! together one ephemeris is taken that serves them all, so that they have one clock. All messages of BeiDou
//! have that of B3I, so that each of their ephemerides takes the group delays that it has not from the
//! others.
//!
//! [`SetForm::serves`]: gnss::broadcast::SetForm::serves

use std::collections::BTreeMap;

use gnss::broadcast::Ephemeris;
use gnss::satellite::{Sv, System};
use gnss::signal::{self, Signal};

/// Ephemerides by satellite.
#[derive(Clone, Debug, Default)]
pub struct Sets(BTreeMap<Sv, Vec<Ephemeris>>);

impl Sets {
    /// Takes an ephemeris in place of the one of the same satellite and message, which it returns.
    pub fn insert(&mut self, set: Ephemeris) -> Option<Ephemeris> {
        let own = self.0.entry(set.sv).or_default();
        let place = own.iter().position(|old| old.form == set.form);
        let old = place.map(|place| own.remove(place));
        own.insert(place.unwrap_or(own.len()), set);
        share_delays(own);
        old
    }

    /// Removes the ephemerides of a satellite.
    pub fn remove(&mut self, sv: Sv) {
        self.0.remove(&sv);
    }

    /// Satellites with an ephemeris.
    pub fn satellites(&self) -> impl Iterator<Item = Sv> {
        self.0.keys().copied()
    }

    /// All ephemerides of a satellite.
    pub fn of(&self, sv: Sv) -> &[Ephemeris] {
        self.0.get(&sv).map_or(&[], Vec::as_slice)
    }

    /// Ephemeris for ranges of some signals of a satellite: of those that serve all of them one of a message
    /// that the last of them carries, if there is one.
    pub fn serving(&self, sv: Sv, signals: &[&'static Signal]) -> Option<&Ephemeris> {
        let serves = |set: &&Ephemeris| signals.iter().all(|signal| set.serves(signal));
        let own = |signal: &Signal, set: &Ephemeris| {
            let mut messages = signal.components.iter().filter_map(|component| component.message);
            messages.any(|message| message.sets == set.form)
        };
        let carried = |set: &&Ephemeris| signals.last().is_some_and(|last| own(last, set));
        let all = || self.of(sv).iter().filter(serves);
        all().find(carried).or_else(|| all().next())
    }

    /// True if no ephemeris of a satellite marks the signal as unhealthy.
    pub fn is_healthy_on(&self, sv: Sv, signal: &Signal) -> bool {
        self.of(sv).iter().all(|set| set.is_healthy_on(signal) != Some(false))
    }
}

/// Gives each ephemeris of a satellite of BeiDou the delays that the others have in their own form.
fn share_delays(sets: &mut [Ephemeris]) {
    if sets.first().is_none_or(|set| set.sv.system != System::BeiDou) {
        return;
    }
    let signals = signal::all().into_iter().filter(|signal| signal.system == System::BeiDou);
    let delays: Vec<(&Signal, &'static str, f64)> = signals
        .filter_map(|signal| {
            let set = sets.iter().find(|set| (set.form.serves)(signal))?;
            Some((signal, signal.rinex, (set.form.group_delay_s)(set, signal)))
        })
        .collect();
    for set in sets {
        let others = delays.iter().filter(|(signal, ..)| !(set.form.serves)(signal));
        set.signal_delays_s = others.map(|&(_, code, delay_s)| (code, delay_s)).collect();
    }
}

impl FromIterator<Ephemeris> for Sets {
    fn from_iter<T: IntoIterator<Item = Ephemeris>>(sets: T) -> Self {
        let mut all = Self::default();
        sets.into_iter().for_each(|set| {
            all.insert(set);
        });
        all
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use gnss::beidou::b1c::B1C;
    use gnss::beidou::b2a::B2A;
    use gnss::beidou::b2b::B2B;
    use gnss::beidou::bcnav2::B_CNAV2_SETS;
    use gnss::beidou::bcnav3::B_CNAV3_SETS;
    use gnss::beidou::d1d2::D1_SETS;
    use gnss::beidou::in_phase::{B1I, B2I};
    use gnss::galileo::e1::E1;
    use gnss::galileo::e5::{E5A, E5B};
    use gnss::galileo::fnav::FNAV_SETS;
    use gnss::galileo::inav::INAV_SETS;
    use gnss::gps::cnav::CNAV_SETS;
    use gnss::gps::l1ca::L1_CA;
    use gnss::gps::l5::L5;
    use gnss::gps::lnav::LNAV_SETS;
    use gnss::time::Epoch;

    #[test]
    fn each_signal_has_the_set_of_its_own_message_and_a_pair_one_that_has_the_clock_of_both() {
        let sv = Sv { system: System::Galileo, number: 11 };
        let blank = Ephemeris::blank(sv, Epoch::from_week(2134, 0.0));
        let of = |form| Ephemeris { form, ..blank.clone() };
        let mut sets: Sets = [of(&INAV_SETS)].into_iter().collect();
        let name = |sets: &Sets, signals: &[&'static Signal]| sets.serving(sv, signals).map(|set| set.form.name);
        assert_eq!((name(&sets, &[&E1]), name(&sets, &[&E5A])), (Some("I/NAV"), None));
        assert!(sets.insert(of(&FNAV_SETS)).is_none() && sets.insert(of(&FNAV_SETS)).is_some());
        let found = [&[&E1][..], &[&E5A], &[&E5B], &[&E1, &E5A], &[&E1, &E5B], &[&E5A, &E5B]];
        let expected = [Some("I/NAV"), Some("F/NAV"), Some("I/NAV"), Some("F/NAV"), Some("I/NAV"), None];
        assert_eq!(found.map(|signals| name(&sets, signals)), expected);
        // Data of E5a not valid: E1 may be used all the same.
        sets.insert(Ephemeris { health: 1 << 6, ..of(&FNAV_SETS) });
        assert!(!sets.is_healthy_on(sv, &E5A) && sets.is_healthy_on(sv, &E1));
        assert_eq!(sets.satellites().collect::<Vec<_>>(), [sv]);
        sets.remove(sv);
        assert!(sets.of(sv).is_empty());
    }

    #[test]
    fn cnav_serves_both_carriers_and_lnav_its_own() {
        let sv = Sv::gps(24);
        let blank = Ephemeris::blank(sv, Epoch::from_week(2380, 0.0));
        let of = |form| Ephemeris { form, ..blank.clone() };
        let mut sets: Sets = [of(&LNAV_SETS)].into_iter().collect();
        let name = |sets: &Sets, signals: &[&'static Signal]| sets.serving(sv, signals).map(|set| set.form.name);
        let of_all = |sets: &Sets| [&[&L1_CA][..], &[&L5], &[&L1_CA, &L5]].map(|signals| name(sets, signals));
        assert_eq!(of_all(&sets), [Some("LNAV"), None, None]);
        sets.insert(of(&CNAV_SETS));
        assert_eq!(of_all(&sets), [Some("LNAV"), Some("CNAV"), Some("CNAV")]);
        // L5 is unhealthy: L1 may be used all the same.
        sets.insert(Ephemeris { health: 4, ..of(&CNAV_SETS) });
        assert!(sets.is_healthy_on(sv, &L1_CA) && !sets.is_healthy_on(sv, &L5));
    }

    #[test]
    fn sets_of_beidou_serve_the_signals_of_the_others_with_their_delays_and_none_that_no_message_has() {
        let sv = Sv { system: System::BeiDou, number: 24 };
        let blank = Ephemeris::blank(sv, Epoch::from_week(2409, 0.0));
        let d1 = Ephemeris { form: &D1_SETS, tgd_s: 8e-9, tgd2_s: 3e-9, ..blank.clone() };
        let mut sets: Sets = [d1].into_iter().collect();
        let delay_s = |sets: &Sets, signals: &[&'static Signal], of: &Signal| {
            sets.serving(sv, signals).map(|set| set.group_delay_s(of))
        };
        assert_eq!((delay_s(&sets, &[&B1I], &B1I), delay_s(&sets, &[&B2A], &B2A)), (Some(8e-9), None));
        sets.insert(Ephemeris { form: &B_CNAV2_SETS, tgd_s: 1e-9, tgd2_s: -2e-9, ..blank.clone() });
        sets.insert(Ephemeris { form: &B_CNAV3_SETS, tgd_s: 4e-9, ..blank });
        for signals in [&[&B1I, &B2A][..], &[&B2A, &B1I], &[&B1C, &B2B], &[&B2B, &B2I], &[&B1I, &B1C]] {
            let found = [(&B1I, 8e-9), (&B2I, 3e-9), (&B1C, 1e-9), (&B2A, -2e-9), (&B2B, 4e-9)];
            let own = found.into_iter().filter(|(signal, _)| signals.contains(signal));
            own.for_each(|(signal, expected_s)| assert_eq!(delay_s(&sets, signals, signal), Some(expected_s)));
        }
    }
}
