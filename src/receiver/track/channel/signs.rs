//! The signs of a channel's prompts: symbols, the code under bits, the secondary code.

use crate::track::bits::BitSync;
use crate::track::secondary_code::{SecondaryCodePhase, SecondaryCodeSync};
use crate::track::sync::SymbolSync;
use gnss::satellite::Sv;
use gnss::signal::Component;

use super::pilot_group;

/// Knowledge of the signs of prompts, and the searches for what is unknown.
#[derive(Clone, Debug)]
pub(super) struct Signs {
    /// Code periods per symbol, or periods that are summed where there are no symbols. It is 1 while a
    /// secondary code is unknown.
    pub group: u32,
    pub has_symbols: bool,
    /// Symbol synchronisation.
    pub sync: SymbolSync,
    /// Code period modulo a symbol's in which symbols begin, to be taken over there.
    pub pending: Option<u64>,
    /// True if edges of symbols are beyond doubt.
    pub confirmed: bool,
    /// True if the message showed the symbols to be inverted.
    pub polarity: Option<bool>,
    /// Bit synchronisation for symbols of one period that build a bit by known signs.
    pub bits: Option<BitSync>,
    /// Code period at which bits begin, once it is known. `group` is then the number of periods per bit.
    pub bit_begin: Option<u64>,
    pub secondary_code: Option<SecondaryCodeSync>,
    /// Phase of the secondary code, or of a long code among its segments, once it is known.
    pub phase: Option<SecondaryCodePhase>,
}

impl Signs {
    /// Nothing is known of the signs of a satellite's component, whose code periods last `period_s`.
    pub fn new(component: Option<&'static Component>, sv: Sv, period_s: f64) -> Self {
        let message = component.and_then(|c| c.message);
        let codes = component.filter(|c| c.secondary_code.periods() > 1).and_then(|c| c.secondary_code.of(sv.number));
        let secondary_code = codes.map(SecondaryCodeSync::new);
        // Signs of prompts are anyone's guess until the secondary code's are known.
        let group = match message {
            _ if secondary_code.is_some() => 1,
            Some(_) => component.and_then(Component::periods_per_symbol).unwrap_or(1),
            None => pilot_group(period_s),
        };
        let has_symbols = message.is_some() || secondary_code.is_some();
        Self {
            group,
            has_symbols,
            sync: SymbolSync::new(group),
            pending: None,
            confirmed: false,
            polarity: None,
            bits: message
                .map(|message| (message.bit)(sv))
                .filter(|signs| signs.len() > 1 && has_symbols && group == 1)
                .map(BitSync::new),
            bit_begin: None,
            secondary_code,
            phase: None,
        }
    }

    /// The sign of the secondary code in code period `number`, or of the code under a bit; one while it is
    /// unknown.
    pub fn chip(&self, number: u64) -> f64 {
        match (&self.secondary_code, self.phase, &self.bits, self.bit_begin) {
            (Some(secondary_code), Some(phase), ..) => secondary_code.chip(phase, number),
            (_, _, Some(bits), Some(begin)) => bits.sign(number, begin),
            _ => 1.0,
        }
    }

    /// True if each code period has its own sign, as far as is known.
    pub fn are_single(&self) -> bool {
        self.group == 1 && self.has_symbols
    }

    /// True if a symbol ends with code period `number` where symbols begin at periods of the residue `begin`.
    pub fn ends_symbol(&self, number: u64, begin: u64) -> bool {
        (number + 1) % u64::from(self.group) == begin
    }

    /// The residue that is to be taken over after code period `number`.
    pub fn due(&self, number: u64) -> Option<u64> {
        self.pending.filter(|begin| self.ends_symbol(number, *begin))
    }

    /// Begins the search for symbols again.
    pub fn search_again(&mut self) {
        (self.sync, self.pending) = (SymbolSync::new(self.group), None);
    }

    /// Forgets where bits begin. Gives whether it was known: every code period is then a symbol by itself.
    pub fn forget_bits(&mut self) -> bool {
        let Some(bits) = &mut self.bits else { return false };
        bits.clear();
        let was_known = self.bit_begin.take().is_some();
        if was_known {
            self.group = 1;
        }
        was_known
    }
}
