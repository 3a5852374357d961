//! Assignment of group delays from other records to the ephemerides of their satellites.

use std::collections::BTreeMap;

use super::columns::Delays;
use crate::broadcast::Ephemeris;
use crate::satellite::Sv;

/// Gives each ephemeris the group delays of its satellite's records: of each code those of the signal's own
/// message before those that another message states of it, and of these the nearest in time.
pub(super) fn give(sets: &mut [Ephemeris], records: &[Delays]) {
    let mut by_satellite: BTreeMap<Sv, Vec<&Delays>> = BTreeMap::new();
    for record in records {
        by_satellite.entry(record.sv).or_default().push(record);
    }
    for set in sets {
        let mut best: BTreeMap<&'static str, ((bool, f64), f64)> = BTreeMap::new();
        for record in by_satellite.get(&set.sv).into_iter().flatten() {
            let apart_s = record.toc.since(set.toc).abs();
            for &(code, delay_s, is_own) in &record.all {
                let rank = (!is_own, apart_s);
                let kept = best.entry(code).or_insert((rank, delay_s));
                if rank < kept.0 {
                    *kept = (rank, delay_s);
                }
            }
        }
        set.signal_delays_s = best.into_iter().map(|(code, (_, delay_s))| (code, delay_s)).collect();
    }
}
