//! The data of a satellite: which code periods its message inverts.
//!
//! Limits: GPS LNAV.

use std::collections::{BTreeMap, BTreeSet};

use crate::generator::message::{self, Sent as SentWords};
use crate::generator::scene::Scene;
use crate::generator::spoof::Constellation;
use crate::generator::stream::GenerateError;
use crate::gnss::gps::lnav::Subframe;
use crate::gnss::record::NavigationRow;
use crate::gnss::satellite::Sv;
use crate::gnss::signal::Message;
use crate::gnss::time::Epoch;

/// Duration of an LNAV subframe and its symbols (IS-GPS-200N, 20.3.2).
const SUBFRAME_S: i64 = 6;
const SUBFRAME_SYMBOLS: i64 = 300;

/// What a satellite sends in a stretch of time.
#[derive(Default)]
pub struct Symbols {
    /// By their number since 1980-01-06T00:00:00 of the system's time.
    subframes: BTreeMap<i64, [u32; 10]>,
    /// What has been sent so far.
    pub navigation: BTreeSet<NavigationRow>,
}

impl Symbols {
    /// Gathers what `sv` sends from `first` to `last` in a time `behind_s` behind GPS time, and forgets what
    /// lies before. A subframe for which no set was uploaded carries the one of `heard`.
    ///
    /// # Errors
    /// Those of messages.
    pub fn prepare(
        &mut self,
        scene: &Scene,
        from: &Constellation,
        (sv, behind_s): (Sv, i64),
        [first, last]: [Epoch; 2],
        heard: Epoch,
    ) -> Result<(), GenerateError> {
        let number = |at: Epoch| (at.seconds() - behind_s).div_euclid(SUBFRAME_S);
        let (first, last) = (number(first), number(last));
        self.subframes = self.subframes.split_off(&first);
        for index in first..=last {
            if self.subframes.contains_key(&index) {
                continue;
            }
            let start = Epoch::new(index * SUBFRAME_S + behind_s, 0.0);
            let fallback = || scene.catalogue.sent_at(sv, heard);
            let Some(ephemeris) = scene.catalogue.sent_at(sv, start).or_else(fallback) else { continue };
            let faults = if from.number == 0 { scene.message_faults.as_slice() } else { &[] };
            let SentWords { encoded, words } = message::subframe(faults, &scene.broadcast, sv, ephemeris, start)?;
            // What was meant and, where wrong bits pass for right ones, what was sent.
            for subframe in [encoded, words].iter().filter_map(|words| Subframe::decode(words, 0).ok()) {
                let issue = match subframe.id {
                    1..=3 => Some(u32::from(ephemeris.iode)),
                    _ => subframe.klobuchar().map(|_| 0),
                };
                if let Some(issue) = issue {
                    self.navigation.extend(subframe.parameters().into_iter().map(|(parameter, raw)| NavigationRow {
                        sv,
                        issue,
                        parameter: parameter.to_owned(),
                        raw,
                    }));
                }
            }
            self.subframes.insert(index, words);
        }
        Ok(())
    }

    /// Whether a code period of a component is sent inverted.
    pub fn negative(&self, message: Option<Message>, period: i64) -> bool {
        let Some(message) = message else { return false };
        let period = planted!("generator.synth.message_time", period, period + 1);
        let symbol = period.div_euclid(i64::from(message.periods_per_symbol()));
        let Some(words) = self.subframes.get(&symbol.div_euclid(SUBFRAME_SYMBOLS)) else { return false };
        let bit = symbol.rem_euclid(SUBFRAME_SYMBOLS) as usize;
        let place = planted!("generator.synth.bit_order", 29 - bit % 30, bit % 30);
        words.get(bit / 30).is_some_and(|word| word >> place & 1 == 1)
    }
}
