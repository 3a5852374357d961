//! The GPS legacy navigation message (LNAV): 300-bit subframes of six seconds, encoded and decoded.
//!
//! Source: IS-GPS-200N, 20.3. Limits: the telemetry message and the correction table (page 13 of subframe 4)
//! are empty, reserved bits alternate; a leap second is announced where the navigation file announces one.

mod almanac;
mod fields;
mod parity;
mod reader;

use thiserror::Error;

pub use crate::bits::{Field, FieldError, Kind};
pub use almanac::{ALMANAC_INCLINATION_SEMICIRCLES, Almanac, LeapEvent, Utc, UtcData};
pub use fields::tables;
pub use parity::check_parity;
pub use reader::LnavReader;

use crate::bits::{bits_of, integers, number, read_all, write_all};
use crate::broadcast::{Ephemeris, PLAIN, SetForm};
use crate::ionosphere::{Coefficients, Model};
use crate::klobuchar::Klobuchar;
use crate::message::{Common, IonosphereForm, Message, Records, Sender};
use crate::satellite::{Sv, System};
use crate::set_tables::SetTables;
use crate::time::{Epoch, WEEK_S};
use fields::{ALMANAC_PAGE, IONOSPHERE_PAGE, SUBFRAME_1, SUBFRAME_2, SUBFRAME_3, UTC_PAGE};

/// Seconds of a subframe (IS-GPS-200N, 20.3.2).
pub const SUBFRAME_S: i64 = 6;
/// First eight bits of every subframe (IS-GPS-200N, 20.3.3.1).
pub const PREAMBLE: u32 = 0x8B;
/// Subframes in a week: the HOW's count runs below it (IS-GPS-200N, 20.3.3.2).
const TOW_COUNTS: u32 = (WEEK_S / SUBFRAME_S) as u32;
/// Pages of subframes 4 and 5 (IS-GPS-200N, 20.3.2).
const PAGES: i64 = 25;
/// Bits of a word.
const WORD_BITS: usize = 30;
/// The anti-spoof flag of the HOW, as every operational satellite sets it (IS-GPS-200N, 20.3.3.2).
const ANTI_SPOOF: u32 = 1;

/// Definition of LNAV.
pub static LNAV: Message = Message {
    name: "LNAV",
    symbol_s: 0.02,
    bit: |_| &[1],
    unit_s: SUBFRAME_S,
    decided_after: 0,
    set_s: SUBFRAME_S,
    first_s: 0,
    sender: |common| Ok(Box::new(Broadcast::of(common)?)),
    number: subframe_at,
    timed: &[1, 2, 3, 4, 5],
    dated: &[],
    set: &[1, 2, 3],
    reduced: &[],
    ionosphere: IonosphereForm {
        model: Model::Klobuchar,
        unit: |start| subframe_at(start) == 4 && start.tow_whole_s() / (5 * SUBFRAME_S) % PAGES == IONOSPHERE_PAGE_AT,
        coefficients: |raw| {
            let (mut page, mut found) = ([0_u32; 10], Klobuchar::ZERO);
            for field in IONOSPHERE_PAGE.iter().map(|element| &element.field) {
                field.write(&mut page, raw(field.name)?);
            }
            read_all(&IONOSPHERE_PAGE, &page, &mut found);
            Some(Coefficients::Klobuchar(found))
        },
    },
    fields: &OF_SET,
    parameters: opened,
    reader: |sv| Box::new(LnavReader::new(sv)),
    form: |set| Ephemeris { form: &LNAV_SETS, signal_delays_s: Vec::new(), ..set.clone() },
    sets: &LNAV_SETS,
    alert: None,
    rinex: Some(Records { set: |_| "LNAV", common: "LNAV", fields: tables, lines: None }),
};

/// Ephemerides of LNAV: one group delay, and six bits of health that speak of all signals together
/// (IS-GPS-200N,
/// 20.3.3.3.3.2 and 20.3.3.3.1.4).
pub static LNAV_SETS: SetForm = SetForm { name: "LNAV", serves: |signal| signal.carries(&LNAV), ..PLAIN };

/// The page of subframe 4 that carries the ionosphere, counted from 0 (IS-GPS-200N, 20.3.3.5.1.7).
const IONOSPHERE_PAGE_AT: i64 = 17;

/// The elements that raw integers give, as if their subframes had been sent at `near`, or in the week that
/// they name as near to it as can be.
fn of_integers(sv: Sv, raw: &dyn Fn(&str) -> Option<i64>, near: Epoch) -> Option<Ephemeris> {
    let from_s = near.nearest_week(raw("week")?, 1024) * WEEK_S;
    let sent = Epoch::new(near.seconds().clamp(from_s, from_s + WEEK_S - SUBFRAME_S), 0.0);
    // The count is that of the subframe after; ten minutes more or less change no reference time.
    let tow_count = (sent.tow_whole_s() / SUBFRAME_S + 1) as u32 % TOW_COUNTS;
    let subframe = |id: u8| {
        let mut data = [0; 10];
        let name = format!("subframe {id}");
        let (_, fields) = tables().into_iter().find(|(table, _)| *table == name)?;
        for field in fields {
            field.write(&mut data, raw(field.name)?);
        }
        Some(Subframe { id, tow_count, alert: false, antispoof: false, data })
    };
    ephemeris(sv, &subframe(1)?, &subframe(2)?, &subframe(3)?, near).ok()
}

/// Number of the subframe that begins at a time (IS-GPS-200N, 20.3.2).
fn subframe_at(start: Epoch) -> u8 {
    (start.tow_whole_s() / SUBFRAME_S % 5 + 1) as u8
}

/// Converts a subframe's symbols to ten 30-bit words.
pub fn words(symbols: &[bool]) -> [u32; 10] {
    let mut words = [0; 10];
    for (word, bits) in words.iter_mut().zip(symbols.chunks(WORD_BITS)) {
        *word = number(bits) as u32;
    }
    words
}

/// The parameters of subframes 1 to 3, and of page 18 of subframe 4.
fn opened(symbols: &[bool]) -> Option<(bool, Vec<(&'static str, i64)>)> {
    let subframe = Subframe::decode(&words(symbols), 0).ok()?;
    match subframe.id {
        1..=3 => Some((true, subframe.parameters())),
        _ => subframe.klobuchar().map(|_| (false, subframe.parameters())),
    }
}

/// Parameters that all satellites send alike: the pages of subframes 4 and 5.
#[derive(Clone, Debug)]
pub struct Broadcast {
    /// Pages 1..=25 of subframe 4, then those of subframe 5.
    pages: Vec<[u32; 10]>,
}

impl Broadcast {
    /// Builds all pages; almanac and UTC refer to the multiple of 4096 s nearest to `reference`.
    ///
    /// `almanac` holds one ephemeris a satellite (the first counts). Without `klobuchar` page 18 is a dummy
    /// page.
    pub fn new(
        klobuchar: Option<Klobuchar>,
        leap_seconds: i64,
        almanac: &[Ephemeris],
        reference: Epoch,
    ) -> Result<Self, FieldError> {
        Self::with_utc(klobuchar, &UtcData { leap_s: leap_seconds, ..UtcData::default() }, almanac, reference)
    }

    /// Builds all pages like [`Self::new`], with all known UTC parameters.
    ///
    /// # Errors
    /// A value outside its field, or a reference time off its step.
    pub fn with_utc(
        klobuchar: Option<Klobuchar>,
        utc: &UtcData,
        almanac: &[Ephemeris],
        reference: Epoch,
    ) -> Result<Self, FieldError> {
        Ok(Self { pages: almanac::pages(klobuchar.as_ref(), utc, almanac, reference)? })
    }

    /// Builds the pages from the parameters of a scene.
    ///
    /// # Errors
    /// Errors of [`Self::with_utc`].
    pub fn of(common: &Common) -> Result<Self, FieldError> {
        let reference = common.reference.unwrap_or(Epoch::new(0, 0.0));
        // An almanac is of GPS satellites.
        let own = common.almanac.iter().filter(|set| set.sv.system == System::Gps);
        Self::with_utc(common.klobuchar, &common.utc, &own.cloned().collect::<Vec<_>>(), reference)
    }

    /// Encodes the ten 30-bit words (D30 is bit 0) whose first bit is sent at GPS time `start`, a multiple of
    /// 6 s.
    ///
    /// Subframe 1 carries the week of `start`. A value outside its field is an error.
    pub fn subframe(&self, ephemeris: &Ephemeris, start: Epoch) -> Result<[u32; 10], FieldError> {
        let tow_s = start.tow_whole_s();
        if tow_s % SUBFRAME_S != 0 || start.fraction() != 0.0 {
            return Err(FieldError::NotMultiple { name: "start_s", value: start.tow_s(), step: SUBFRAME_S as f64 });
        }
        let id = subframe_at(start);
        let first_s = planted!("gnss.lnav.page_order", 0, 5 * SUBFRAME_S);
        let page = ((tow_s + first_s) / (5 * SUBFRAME_S) % PAGES) as usize;
        let mut data = [almanac::ALTERNATING; 10];
        match id {
            1..=3 => {
                check_issue(ephemeris)?;
                let on_air = Ephemeris { transmitted: start, ..ephemeris.clone() };
                match id {
                    1 => write_all(&SUBFRAME_1, &on_air, &mut data)?,
                    2 => write_all(&SUBFRAME_2, &on_air, &mut data)?,
                    _ => write_all(&SUBFRAME_3, &on_air, &mut data)?,
                }
            }
            4 => data = self.pages.get(page).copied().unwrap_or(data),
            _ => data = self.pages.get(PAGES as usize + page).copied().unwrap_or(data),
        }
        let ahead = planted!("gnss.lnav.handover_count", 1, 0);
        let next_count = ((tow_s / SUBFRAME_S + ahead) as u32) % TOW_COUNTS;
        data[0] = PREAMBLE << 16;
        data[1] = (next_count << 7) | (ANTI_SPOOF << 5) | (u32::from(id) << 2);
        Ok(with_parity(&data))
    }
}

impl Sender for Broadcast {
    fn unit(&self, ephemeris: &Ephemeris, start: Epoch) -> Result<Vec<bool>, FieldError> {
        let words = self.subframe(ephemeris, start)?;
        Ok(words.iter().flat_map(|&word| bits_of(u128::from(word), WORD_BITS)).collect())
    }
}

fn with_parity(data: &[u32; 10]) -> [u32; 10] {
    let mut previous = 0;
    let mut number = 0;
    data.map(|bits| {
        number += 1;
        let bits = if number == 2 || number == 10 { parity::solve_tail(bits, previous) } else { bits };
        previous = parity::encode(bits, previous);
        previous
    })
}

fn check_issue(ephemeris: &Ephemeris) -> Result<(), FieldError> {
    if ephemeris.iodc & 0xFF == ephemeris.iode {
        Ok(())
    } else {
        Err(FieldError::Issue { iode: ephemeris.iode, iodc: ephemeris.iodc })
    }
}

/// Parameters by which ephemerides are distinguished, and the health, which has a fault of its own, are
/// fixed.
static OF_SET: SetTables<Ephemeris, [u32; 10]> = SetTables {
    fixed: &[&["week", "iodc", "iode", "health"]],
    elements: |_, sv, raw, near| of_integers(sv, raw, near),
    quantised: |own, set| {
        check_issue(set)?;
        own.rounded(set.clone())
    },
    ..SetTables::of(&LNAV_SETS, &[&SUBFRAME_1, &SUBFRAME_2, &SUBFRAME_3], || [0; 10], (|set| set, |set| set))
};

/// Reason for which words are no subframe, or subframes no ephemeris.
#[derive(Clone, Copy, Debug, Error, PartialEq, Eq)]
pub enum SubframeError {
    /// A word with a wrong bit.
    #[error("word {word} fails its parity")]
    Parity {
        /// Number of the word, from 1.
        word: u8,
    },
    /// No subframe begins here.
    #[error("the preamble is {found:#04x}: expected 0x8b")]
    Preamble {
        /// The eight bits there.
        found: u32,
    },
    /// A number that is no subframe's.
    #[error("subframe id {id}: expected {expected}")]
    Id {
        /// The number.
        id: u8,
        /// The numbers that are possible.
        expected: &'static str,
    },
    /// A count beyond the week.
    #[error("the count of the time of week is {count}: expected below 100800")]
    TowCount {
        /// Count of 6 s units since the beginning of the week.
        count: u32,
    },
    /// Words whose last bits the parity should have made zero.
    #[error("words 2 and 10 do not end like the word before the subframe")]
    Tail,
    /// Subframes of different ephemerides.
    #[error("issues of data disagree: iodc {iodc}, iode {iode_2} in subframe 2 and {iode_3} in subframe 3")]
    Issue {
        /// Issue of the clock, subframe 1.
        iodc: u16,
        /// Issue of the ephemeris in subframe 2.
        iode_2: i64,
        /// Issue of the ephemeris in subframe 3.
        iode_3: i64,
    },
    /// A reference time that no week has.
    #[error("{name} = {value_s} s is beyond the week")]
    BeyondWeek {
        /// Name of the field.
        name: &'static str,
        /// Value of the field, in seconds.
        value_s: i64,
    },
}

impl SubframeError {
    /// True if the error concerns ten words that were received correctly: the preamble and each word's parity
    /// were right.
    pub fn is_read(&self) -> bool {
        !matches!(self, Self::Parity { .. } | Self::Preamble { .. })
    }
}

/// Subframe with correct parity.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Subframe {
    /// 1..=5.
    pub id: u8,
    /// Time of week at the next subframe's start, in units of 6 s.
    pub tow_count: u32,
    /// The signal's accuracy may be worse than the URA states (IS-GPS-200N, 20.3.3.2).
    pub alert: bool,
    /// True if P is encrypted to Y (IS-GPS-200N, 20.3.3.2).
    pub antispoof: bool,
    /// Data bits, 24 in each word, with the inversion removed.
    pub data: [u32; 10],
}

impl Subframe {
    /// Checks and opens ten received words. `previous_last_word` counts by its two low bits, which are 00 by
    /// the message's law, or 11 where the stream is inverted (preamble 0x74).
    pub fn decode(words: &[u32; 10], previous_last_word: u32) -> Result<Self, SubframeError> {
        let mut data = [0; 10];
        let mut previous = previous_last_word;
        for (number, (bits, &word)) in (1..).zip(data.iter_mut().zip(words)) {
            *bits = check_parity(word, previous).ok_or(SubframeError::Parity { word: number })?;
            previous = word;
        }
        let [telemetry, handover, ..] = data;
        if telemetry >> 16 != PREAMBLE {
            return Err(SubframeError::Preamble { found: telemetry >> 16 });
        }
        if (words[1] ^ previous_last_word) & 3 != 0 || (words[9] ^ previous_last_word) & 3 != 0 {
            return Err(SubframeError::Tail);
        }
        let id = ((handover >> 2) & 7) as u8;
        if !(1..=5).contains(&id) {
            return Err(SubframeError::Id { id, expected: "1 to 5" });
        }
        let tow_count = handover >> 7;
        if tow_count >= TOW_COUNTS {
            return Err(SubframeError::TowCount { count: tow_count });
        }
        Ok(Self { id, tow_count, alert: handover & 0x40 != 0, antispoof: handover & 0x20 != 0, data })
    }

    /// SV ID of a page of subframe 4 or 5 (IS-GPS-200N, table 20-V); 0 is a dummy page.
    pub fn sv_id(&self) -> Option<u8> {
        (self.id >= 4).then_some(((self.data[2] >> 16) & 0x3F) as u8)
    }

    /// The raw integers of all parameters in the field table; none for pages without any.
    pub fn parameters(&self) -> Vec<(&'static str, i64)> {
        match (self.id, self.sv_id()) {
            (1, _) => integers(&SUBFRAME_1, &self.data),
            (2, _) => integers(&SUBFRAME_2, &self.data),
            (3, _) => integers(&SUBFRAME_3, &self.data),
            (_, Some(1..=32)) => integers(&ALMANAC_PAGE, &self.data),
            (4, Some(56)) => {
                let mut all = integers(&IONOSPHERE_PAGE, &self.data);
                all.extend(integers(&UTC_PAGE, &self.data));
                all
            }
            _ => Vec::new(),
        }
    }

    /// Ionosphere coefficients, if this is page 18 of subframe 4.
    pub fn klobuchar(&self) -> Option<Klobuchar> {
        let mut klobuchar = Klobuchar::ZERO;
        read_all(&IONOSPHERE_PAGE, &self.data, &mut klobuchar);
        self.is_page_18().then_some(klobuchar)
    }

    /// UTC parameters, if this is page 18 of subframe 4.
    pub fn utc(&self) -> Option<Utc> {
        let mut utc = Utc::default();
        read_all(&UTC_PAGE, &self.data, &mut utc);
        self.is_page_18().then_some(utc)
    }

    /// Almanac of a satellite, if this is such a page.
    pub fn almanac(&self) -> Option<Almanac> {
        let mut almanac = Almanac::default();
        read_all(&ALMANAC_PAGE, &self.data, &mut almanac);
        matches!(self.sv_id(), Some(1..=32)).then_some(almanac)
    }

    fn is_page_18(&self) -> bool {
        self.id == 4 && self.sv_id() == Some(56)
    }

    fn parameter(&self, name: &str) -> i64 {
        self.parameters().iter().find(|parameter| parameter.0 == name).map_or(0, |parameter| parameter.1)
    }
}

/// Decodes the ephemeris from subframes 1, 2 and 3 of one satellite.
///
/// The 10-bit week is the one nearest to `near`; `transmitted` is the start of subframe 1, and the
/// reference times are within half a week of it. Errors: other subframes, or different issues of data.
pub fn ephemeris(
    sv: Sv,
    one: &Subframe,
    two: &Subframe,
    three: &Subframe,
    near: Epoch,
) -> Result<Ephemeris, SubframeError> {
    for (subframe, id, expected) in [(one, 1, "1"), (two, 2, "2"), (three, 3, "3")] {
        if subframe.id != id {
            return Err(SubframeError::Id { id: subframe.id, expected });
        }
    }
    let (iodc, iode_2, iode_3) = (one.parameter("iodc"), two.parameter("iode"), three.parameter("iode"));
    if iode_2 != iode_3 || iode_2 != iodc & 0xFF {
        return Err(SubframeError::Issue { iodc: iodc as u16, iode_2, iode_3 });
    }
    for (name, value_s) in [("toc_s", 16 * one.parameter("toc_s")), ("toe_s", 16 * two.parameter("toe_s"))] {
        if value_s >= WEEK_S {
            return Err(SubframeError::BeyondWeek { name, value_s });
        }
    }
    let week = near.nearest_week(one.parameter("week"), 1024);
    let count = i64::from((one.tow_count + TOW_COUNTS - 1) % TOW_COUNTS);
    let sent = Epoch::new(week * WEEK_S + count * SUBFRAME_S, 0.0);
    let mut ephemeris = Ephemeris { form: &LNAV_SETS, ..Ephemeris::blank(sv, sent) };
    read_all(&SUBFRAME_1, &one.data, &mut ephemeris);
    read_all(&SUBFRAME_2, &two.data, &mut ephemeris);
    read_all(&SUBFRAME_3, &three.data, &mut ephemeris);
    Ok(ephemeris)
}
