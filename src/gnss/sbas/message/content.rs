//! Content of the correction blocks, encoded and decoded by the tables of [`super::corrections`] and
//! [`super::bounds`].
//!
//! Source: RTCA DO-229D, A.4.4.1 to A.4.4.16.

use super::DATA_BITS;
use super::bounds::{ALMANACS, COVARIANCES, FACTORS, SERVICE};
use super::corrections::{
    AGEING, DELAYS, FAST, GRID_MASK, HALF_MOVING, HALF_STEADY, INTEGRITY, MASK, MIXED, VELOCITY_CODE,
};
use crate::augmentation::{
    Almanacs, Content, Covariances, Degradation, Delays, Factors, Fast, GridMask, Half, Integrity, LongTerm, MASKED,
    Mask, Mixed, Service,
};
use crate::bits::{Element, FieldError, integers, read_all, write_all};
use crate::message::Parameters;

/// Bits before a block's content, and those of half of it.
const HEAD_BITS: usize = 14;
const HALF_BITS: usize = 106;
/// Type of a block in test mode, and of the first of the fast corrections.
const TEST: u8 = 0;
const FIRST_FAST: u8 = 2;

/// Puts bits of a mask in: those of thirty numbers from `first` on, the most significant first.
pub(super) fn take_word(numbers: &mut Vec<u8>, first: u8, bits: f64) {
    let word = bits as u32;
    let first = planted!("gnss.sbas.mask", first, first - 1);
    let set = (0..30).filter(|place| word >> (29 - place) & 1 == 1).map(|place| first + place);
    numbers.retain(|number| !(first..first + 30).contains(number));
    numbers.extend(set);
    numbers.sort_unstable();
}

/// Bits of a mask as a number: those of thirty satellites or points from `first` on, the most significant
/// first.
pub(super) fn word(numbers: &[u8], first: u8) -> f64 {
    let own = numbers.iter().filter_map(|number| number.checked_sub(first)).filter(|place| *place < 30);
    f64::from(own.fold(0_u32, |word, place| word | 1 << (29 - place)))
}

type Tables<T> = [&'static [Element<T>]];

fn read<T>(tables: &Tables<T>, bits: &Vec<bool>, mut into: T) -> T {
    tables.iter().for_each(|table| read_all(table, bits, &mut into));
    into
}

fn write<T>(tables: &Tables<T>, from: &T, bits: &mut Vec<bool>) -> Result<(), FieldError> {
    tables.iter().try_for_each(|table| write_all(table, from, bits))
}

fn raw<T>(tables: &Tables<T>, bits: &Vec<bool>) -> Parameters {
    tables.iter().flat_map(|table| integers(table, bits)).collect()
}

/// The bits of a half of a block's content.
fn half_of(bits: &[bool], half: usize) -> Vec<bool> {
    let first = HEAD_BITS + half * HALF_BITS;
    bits.get(first..first + HALF_BITS).unwrap_or_default().to_vec()
}

impl Half {
    fn read(bits: &Vec<bool>) -> Self {
        if VELOCITY_CODE.read(bits) == 1 {
            let (iodp, one) = read(&HALF_MOVING, bits, (0, LongTerm::default()));
            return Self::Moving { iodp, one };
        }
        let (iodp, both) = read(&HALF_STEADY, bits, (0, [LongTerm::default(); 2]));
        Self::Steady { iodp, both }
    }

    fn write(&self, block: &mut [bool], half: usize) -> Result<(), FieldError> {
        let mut bits = vec![false; HALF_BITS];
        match self {
            Self::Steady { iodp, both } => write(&HALF_STEADY, &(*iodp, *both), &mut bits)?,
            Self::Moving { iodp, one } => write(&HALF_MOVING, &(*iodp, *one), &mut bits)?,
        }
        VELOCITY_CODE.write(&mut bits, i64::from(matches!(self, Self::Moving { .. })));
        let first = HEAD_BITS + half * HALF_BITS;
        block.iter_mut().skip(first).zip(bits).for_each(|(place, bit)| *place = bit);
        Ok(())
    }

    fn raw(bits: &Vec<bool>) -> Parameters {
        let code = VELOCITY_CODE.read(bits);
        let rest = if code == 1 { raw(&HALF_MOVING, bits) } else { raw(&HALF_STEADY, bits) };
        std::iter::once((VELOCITY_CODE.name, code)).chain(rest).collect()
    }
}

impl Content {
    /// The type of block that states it.
    pub fn kind(&self) -> u8 {
        match self {
            Self::Test => TEST,
            Self::Mask(_) => 1,
            Self::Fast(fast) if fast.is_test => TEST,
            Self::Fast(fast) => FIRST_FAST + fast.part,
            Self::Integrity(_) => 6,
            Self::Degradation(_) => 7,
            Self::GridMask(_) => 18,
            Self::Mixed(_) => 24,
            Self::LongTerm(_) => 25,
            Self::Delays(_) => 26,
            Self::Factors(_) => 10,
            Self::Almanacs(_) => 17,
            Self::Service(_) => 27,
            Self::Covariances(_) => 28,
        }
    }

    /// Writes the content into a block of its type.
    ///
    /// # Errors
    /// A value that its field cannot carry.
    pub fn write(&self, bits: &mut Vec<bool>) -> Result<(), FieldError> {
        match self {
            Self::Test => Ok(()),
            Self::Mask(mask) => write(&MASK, mask, bits),
            Self::Fast(fast) => write(&FAST, fast, bits),
            Self::Integrity(integrity) => write(&INTEGRITY, integrity, bits),
            Self::Degradation(degradation) => write(&AGEING, degradation, bits),
            Self::GridMask(mask) => write(&GRID_MASK, mask, bits),
            Self::Delays(delays) => write(&DELAYS, delays, bits),
            Self::Factors(factors) => write(&FACTORS, factors, bits),
            Self::Almanacs(almanacs) => write(&ALMANACS, almanacs, bits),
            Self::Service(service) => write(&SERVICE, service, bits),
            Self::Covariances(both) => write(&COVARIANCES, both, bits),
            Self::Mixed(mixed) => {
                write(&MIXED, &mixed.fast, bits)?;
                mixed.half.write(bits, 1)
            }
            Self::LongTerm(halves) => (0..).zip(halves.iter()).try_for_each(|(place, half)| half.write(bits, place)),
        }
    }

    /// Decodes a block of this type; `None` if the type carries no corrections.
    pub fn read(kind: u8, bits: &Vec<bool>) -> Option<Self> {
        let fast = |part, is_test| Self::Fast(read(&FAST, bits, Fast { part, is_test, ..Fast::default() }));
        Some(match kind {
            // Either nothing but zeros and the like, or all that type 2 has (A.4.4.1).
            TEST if bits.get(HEAD_BITS..DATA_BITS)?.iter().any(|bit| *bit) => fast(0, true),
            TEST => Self::Test,
            1 => Self::Mask(read(&MASK, bits, Mask::default())),
            2..=5 => fast(kind - FIRST_FAST, false),
            6 => {
                let blank = Integrity { iodf: [0; 4], udrei: [0; MASKED] };
                Self::Integrity(Box::new(read(&INTEGRITY, bits, blank)))
            }
            7 => {
                let blank = Degradation { latency_s: 0, iodp: 0, indicators: [0; MASKED] };
                Self::Degradation(Box::new(read(&AGEING, bits, blank)))
            }
            18 => Self::GridMask(read(&GRID_MASK, bits, GridMask::default())),
            24 => {
                let fast = read(&MIXED, bits, Fast::unmonitored(0));
                Self::Mixed(Box::new(Mixed { fast, half: Half::read(&half_of(bits, 1)) }))
            }
            25 => Self::LongTerm(Box::new([0, 1].map(|half| Half::read(&half_of(bits, half))))),
            26 => Self::Delays(Box::new(read(&DELAYS, bits, Delays::default()))),
            10 => Self::Factors(Box::new(read(&FACTORS, bits, Factors::default()))),
            17 => Self::Almanacs(Box::new(read(&ALMANACS, bits, Almanacs::default()))),
            27 => Self::Service(Box::new(read(&SERVICE, bits, Service::default()))),
            28 => Self::Covariances(Box::new(read(&COVARIANCES, bits, Covariances::default()))),
            _ => return None,
        })
    }

    /// Reads the integers of the fields in a block of this type.
    pub fn raw(kind: u8, bits: &Vec<bool>) -> Parameters {
        match kind {
            TEST if bits.get(HEAD_BITS..DATA_BITS).is_some_and(|own| own.iter().any(|bit| *bit)) => raw(&FAST, bits),
            1 => raw(&MASK, bits),
            2..=5 => raw(&FAST, bits),
            6 => raw(&INTEGRITY, bits),
            7 => raw(&AGEING, bits),
            18 => raw(&GRID_MASK, bits),
            24 => raw(&MIXED, bits).into_iter().chain(Half::raw(&half_of(bits, 1))).collect(),
            25 => [0, 1].into_iter().flat_map(|half| Half::raw(&half_of(bits, half))).collect(),
            26 => raw(&DELAYS, bits),
            10 => raw(&FACTORS, bits),
            17 => raw(&ALMANACS, bits),
            27 => raw(&SERVICE, bits),
            28 => raw(&COVARIANCES, bits),
            _ => Parameters::new(),
        }
    }
}
