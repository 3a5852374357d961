//! SBAS's message on L1: 250 bits per second, encoded and decoded.
//!
//! Source: RTCA DO-229D, A.4.3 (blocks, three beginnings in turn, check) and A.4.4. A block is coded
//! without a break from one to the next (`fec::running`). Types 12 (time) and 9 (where the satellite is) are
//! sent in rounds of six seconds; real satellites send them every minute or five. An ephemeris is a position
//! with its velocity and acceleration at a multiple of 16 s, good for six minutes to either side (A.4.5.1.3,
//! table A-25). Only type 12 states which second of the week it is. Where a network knows something of other
//! satellites, the rest of a round has its corrections (`schedule`), else type 63 (nothing).
//!
//! Limits: types 17, 27 and 28 are read and can be written, but no network of the generator sends them.
//! Health is the accuracy, of which 15 states that the satellite is not to be ranged to. Of UTC nothing is
//! said.

mod bounds;
mod content;
mod corrections;
mod fields;
mod reader;
mod schedule;

use std::sync::Arc;

use crate::augmentation::{Content, Network};
use crate::bits::{FieldError, bits_of, integers, number, soft, write_all};
use crate::broadcast::{Ephemeris, SetForm};
use crate::crc::{CHECK_BITS, is_checked, with_check};
use crate::fec::convolutional::Convolutional;
use crate::fec::running::MARGIN;
use crate::ionosphere::Model;
use crate::message::{IonosphereForm, Message, Parameters, Records, Sender};
use crate::set_tables::SetTables;
use crate::time::Epoch;
pub(crate) use fields::step_of_day;
pub use fields::tables;
use fields::{GEO, TIME};
pub use reader::SbasReader;

/// Definition of the SBAS message.
pub static SBAS: Message = Message {
    name: "SBAS",
    symbol_s: 0.002,
    bit: |_| &[1],
    unit_s: 1,
    decided_after: MARGIN,
    first_s: 0,
    set_s: 1,
    sender: |common| Ok(Box::new(Blocks { network: common.network.clone() })),
    number: type_at,
    timed: &[OF_TIME],
    dated: &[],
    set: &[OF_TIME, OF_PLACE],
    reduced: &[],
    // Its grid is left out.
    ionosphere: IonosphereForm { model: Model::Klobuchar, unit: |_| false, coefficients: |_| None },
    fields: &OF_SET,
    parameters: opened,
    reader: |sv| Box::new(SbasReader::new(sv)),
    form: Ephemeris::clone,
    sets: &SBAS_SETS,
    alert: None,
    rinex: Some(Records { set: |_| "SBAS", common: "SBAS", fields: tables, lines: None }),
};

/// Meaning of clock and health in SBAS ephemerides: the clock is that of L1.
pub static SBAS_SETS: SetForm = SetForm {
    name: "SBAS",
    group_delay_s: |_, _| 0.0,
    serves: |_| true,
    given_delay_s: |_| 0.0,
    is_healthy,
    healthy: |set, _| Some(is_healthy(set)),
    rinex_sources: None,
};

/// Types of blocks.
const OF_PLACE: u8 = 9;
const OF_TIME: u8 = 12;
const EMPTY: u8 = 63;
/// Types in the order in which they are sent.
const ORDER: [u8; 6] = [OF_TIME, OF_PLACE, EMPTY, EMPTY, EMPTY, EMPTY];
/// Preambles of successive blocks, in turn from a multiple of six seconds on (A.4.3.2).
const PREAMBLES: [u128; 3] = [0x53, 0x9A, 0xC6];
/// Bits of a block without and with its check; symbols of a second.
const DATA_BITS: usize = 226;
const BITS: usize = DATA_BITS + CHECK_BITS;
const RATE_HZ: f64 = 500.0;
/// Bits of the block before that the code remembers.
const MEMORY_BITS: usize = 6;
/// Accuracy index for "no accuracy" (A.4.4.11).
const NOT_TO_BE_USED: u8 = 15;
/// UTC standard identifier for "no UTC" (A.4.4.15).
const NO_UTC: f64 = 7.0;

const CODE: Convolutional = Convolutional { second_inverted: false };

/// Content of message type 12.
#[derive(Clone, Copy, Debug, Default)]
struct NetworkTime {
    utc_standard: f64,
    tow_s: f64,
    week: f64,
}

fn is_healthy(set: &Ephemeris) -> bool {
    set.ura_index < planted!("gnss.sbas.accuracy", NOT_TO_BE_USED, 0)
}

/// Type of the block that begins at a time where nothing is stated of other satellites; blocks with
/// corrections replace type 63.
pub fn type_at(start: Epoch) -> u8 {
    let turn = start.tow_whole_s().rem_euclid(ORDER.len() as i64) as usize;
    ORDER.get(turn).copied().unwrap_or(EMPTY)
}

/// Makes the blocks of satellites.
struct Blocks {
    network: Option<Arc<dyn Network>>,
}

impl Sender for Blocks {
    fn unit(&self, ephemeris: &Ephemeris, start: Epoch) -> Result<Vec<bool>, FieldError> {
        self.unit_after(ephemeris, ephemeris, start)
    }

    fn unit_after(&self, before: &Ephemeris, set: &Ephemeris, start: Epoch) -> Result<Vec<bool>, FieldError> {
        SBAS.check_start(start, "a whole second")?;
        let past = self.block(before, start.plus_s(-1.0))?;
        let memory = past.get(BITS - MEMORY_BITS..).unwrap_or_default();
        let all: Vec<bool> = memory.iter().chain(&self.block(set, start)?).copied().collect();
        Ok(CODE.encode(&all).split_off(2 * memory.len()))
    }
}

impl Blocks {
    /// The bits of the block that begins at `start`.
    fn block(&self, set: &Ephemeris, start: Epoch) -> Result<Vec<bool>, FieldError> {
        let kind = type_at(start);
        let said = self.network.as_deref().filter(|_| kind == EMPTY).and_then(|network| schedule::said(network, start));
        let kind = said.as_ref().map_or(kind, Content::kind);
        let preamble = PREAMBLES.get(start.tow_whole_s().rem_euclid(3) as usize).copied().unwrap_or_default();
        let mut bits: Vec<bool> = bits_of(preamble, 8).chain(bits_of(u128::from(kind), 6)).collect();
        bits.resize(DATA_BITS, false);
        match (said, kind) {
            (Some(content), _) => content.write(&mut bits)?,
            (None, OF_PLACE) => write_all(&GEO, set, &mut bits)?,
            (None, OF_TIME) => {
                let week = start.week().rem_euclid(1024) as f64;
                let tow_s = start.tow_whole_s() as f64;
                write_all(&TIME, &NetworkTime { utc_standard: NO_UTC, tow_s, week }, &mut bits)?;
            }
            (None, _) => {}
        }
        Ok(with_check(bits))
    }
}

/// True if bits form a block: one of the three preambles, and a correct check.
fn is_block(bits: &[bool]) -> bool {
    let begins = bits.get(..8).is_some_and(|begin| PREAMBLES.contains(&number(begin)));
    begins && bits.len() == BITS && is_checked(bits)
}

/// Type of a block, as it states it.
fn type_of(bits: &[bool]) -> u8 {
    bits.get(8..14).map_or(0, |bits| number(bits) as u8)
}

/// The parameters of a unit's symbols.
fn opened(symbols: &[bool]) -> Option<(bool, Parameters)> {
    let bits = CODE.decode_open(&soft(symbols));
    let kind = is_block(&bits).then(|| type_of(&bits))?;
    if kind == OF_PLACE {
        return Some((true, integers(&GEO, &bits)));
    }
    let parameters = Content::raw(kind, &bits);
    (!parameters.is_empty()).then_some((false, parameters))
}

/// Parameters by which ephemerides are distinguished, and the accuracy, which is the health, are fixed.
static OF_SET: SetTables<Ephemeris, Vec<bool>> = SetTables {
    fixed: &[&["iodn", "t0_16s", "ura_index"]],
    // Blocks begin with seconds.
    elements: |own, sv, raw, near| own.of_integers(sv, raw, Epoch::new(near.seconds(), 0.0)),
    ..SetTables::of(&SBAS_SETS, &[&GEO], || vec![false; DATA_BITS], (|set| set, |set| set))
};
