//! MAC and key section of a sub-frame: tags, their statements and the key.
//!
//! Source: Galileo OSNMA SIS ICD 1.1, 3.2.4, 6.5 to 6.7 and annex C. Satellites of other data go round: each
//! sub-frame and sender takes the next ones. Flexible slots take all three kinds in turn.

use super::{KEY_BYTES, Provider, TAG_BITS};
use crate::bits::Row;
use crate::data::zeros;
use crate::fields::Adkd;
use crate::mac::{Tagged, mac, macseq};
use crate::subframe::MACK_BITS;
use crate::tables::{Slot, slots};
use crate::time::{Gst, SUBFRAME_S};

/// Bits of the statement after a tag.
const INFO_BITS: usize = 16;

/// Tags of a sub-frame: as many as fit beside the key (ICD, 3.2.4).
pub(super) const TAGS: usize = (MACK_BITS - 8 * KEY_BYTES) / (TAG_BITS + INFO_BITS);

/// Data of a satellite as a tag covers them, with the count of sub-frames since they changed (COP).
pub(super) type Covered<'a> = dyn Fn(u8, Adkd) -> Option<(&'a Row, u8)> + 'a;

impl Provider {
    /// Section of a sender's sub-frame; `None` where a chain has no key. `others` are the satellites of whose
    /// data tags are sent.
    pub(super) fn mack(&self, sender: u8, start: Gst, others: &[u8], covered: &Covered<'_>) -> Option<Row> {
        let status = self.header(start).status_bits();
        let slots = slots(self.settings.table, start.half())?;
        let kinds = kinds(slots, sender, start, others);
        let tag = |position: u8, of: u8, adkd: Adkd, cop: u8| {
            let sent = start.later(adkd.key_after());
            let chain = self.chain(sent);
            let key = chain.key(sent)?;
            let tagged = Tagged { of, sender, start, position, status };
            let message = match covered(of, adkd).filter(|_| cop != 0) {
                Some((row, _)) => tagged.message(row),
                None => tagged.message(&zeros(adkd)?),
            };
            mac(chain.chain.mac, &key.bytes, &message, TAG_BITS)
        };
        let cop = |of: u8, adkd: Adkd| covered(of, adkd).map_or(0, |(_, cop)| cop);
        let info =
            |(of, adkd): (u8, Adkd)| u16::from(of) << 8 | u16::from(adkd.number()) << 4 | u16::from(cop(of, adkd));
        let flexible = slots.iter().zip(&kinds).filter(|(slot, _)| **slot == Slot::Flexible);
        let flexible: Vec<u16> = flexible.map(|(_, kind)| info(*kind)).collect();
        let chain = self.chain(start.later(1));
        let sequence = macseq(chain.chain.mac, &chain.key(start.later(1))?.bytes, sender, start, &flexible)?;
        let own = cop(sender, Adkd::Ephemeris);
        let mut row = Row::default();
        row.push(tag(1, sender, Adkd::Ephemeris, own)?.into(), TAG_BITS);
        row.push(u128::from(sequence << 4 | u64::from(own)), INFO_BITS);
        for (position, &(of, adkd)) in (2..).zip(&kinds) {
            row.push(tag(position, of, adkd, cop(of, adkd))?.into(), TAG_BITS);
            row.push(info((of, adkd)).into(), INFO_BITS);
        }
        row.push_bytes(&self.chain(start).key(start)?.bytes);
        row.push_zeros(MACK_BITS.saturating_sub(row.len()));
        Some(row)
    }
}

/// Satellite and kind of each slot after the first.
fn kinds(slots: &[Slot], sender: u8, start: Gst, others: &[u8]) -> Vec<(u8, Adkd)> {
    let number = start.seconds().div_euclid(SUBFRAME_S);
    let others: Vec<u8> = others.iter().copied().filter(|&other| other != sender).collect();
    let mut turn = number * slots.len() as i64 + i64::from(sender);
    let mut other = || {
        turn += 1;
        let index = turn.checked_rem_euclid(others.len() as i64).unwrap_or(0);
        others.get(index as usize).copied().unwrap_or(sender)
    };
    let kind = |(at, slot): (i64, &Slot)| match slot {
        Slot::Fixed(adkd, true) => (sender, *adkd),
        Slot::Fixed(adkd, false) => (other(), *adkd),
        Slot::Flexible => match (number + at).rem_euclid(4) {
            2 => (other(), Adkd::SlowMac),
            3 => (sender, Adkd::Timing),
            _ => (other(), Adkd::Ephemeris),
        },
    };
    (0..).zip(slots).map(kind).collect()
}
