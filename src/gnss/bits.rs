//! Fields of navigation messages: the position of each parameter among the bits, and the meaning of its
//! integer.
//!
//! A field is read and written through the same entry of a table, so that encoder and decoder cannot differ.
//! What holds the bits is a [`Store`]: ten words with parity of GPS LNAV, a word of 128 bits of Galileo
//! I/NAV, bit by bit a longer message.

use thiserror::Error;

use crate::earth::GPS_PI;

/// Bits that hold fields.
pub trait Store {
    /// The bits of a piece of a field: its first bit as the document counts, and its length, 32 at most.
    fn piece(&self, piece: (u16, u8)) -> u32;
    /// Puts the low bits of `value` there.
    fn set_piece(&mut self, piece: (u16, u8), value: u32);
}

/// 128 bits; the first one sent is the most significant, counted from 0.
impl Store for u128 {
    fn piece(&self, (first, length): (u16, u8)) -> u32 {
        let shift = 128 - u32::from(first) - u32::from(length);
        ((self >> shift) & ((1 << length) - 1)) as u32
    }

    fn set_piece(&mut self, (first, length): (u16, u8), value: u32) {
        let shift = 128 - u32::from(first) - u32::from(length);
        let mask: Self = (1 << length) - 1;
        *self = (*self & !(mask << shift)) | ((Self::from(value) & mask) << shift);
    }
}

/// Fixed-length sequence of bits. The bit that is sent first has index 0.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Bits<const N: usize>(pub [bool; N]);

impl<const N: usize> Default for Bits<N> {
    fn default() -> Self {
        Self([false; N])
    }
}

impl<const N: usize> Bits<N> {
    /// Copies as many bits as the result holds, from index `first` on. Bits beyond the end are zero.
    pub fn part<const M: usize>(&self, first: usize) -> Bits<M> {
        Bits::joined(std::iter::once(self.0.get(first..).unwrap_or_default()))
    }

    /// Joins rows of bits one after the other; bits after the last row are zero.
    pub fn joined<'a, B: AsRef<[bool]> + 'a + ?Sized>(rows: impl Iterator<Item = &'a B>) -> Self {
        let mut all = Self::default();
        let bits = rows.flat_map(|row| row.as_ref().iter().copied());
        all.0.iter_mut().zip(bits).for_each(|(place, bit)| *place = bit);
        all
    }
}

impl<const N: usize> Store for Bits<N> {
    fn piece(&self, (first, length): (u16, u8)) -> u32 {
        let bits = self.0.iter().skip(usize::from(first)).take(usize::from(length));
        bits.fold(0, |all, &bit| all << 1 | u32::from(bit))
    }

    fn set_piece(&mut self, (first, length): (u16, u8), value: u32) {
        let places = self.0.iter_mut().skip(usize::from(first)).take(usize::from(length));
        for (shift, place) in (0..u32::from(length)).rev().zip(places) {
            *place = value >> shift & 1 == 1;
        }
    }
}

/// A bit each, counted from 0.
impl Store for Vec<bool> {
    fn piece(&self, (first, length): (u16, u8)) -> u32 {
        let own = self.iter().skip(usize::from(first)).take(usize::from(length));
        own.fold(0, |all, &bit| all << 1 | u32::from(bit))
    }

    fn set_piece(&mut self, (first, length): (u16, u8), value: u32) {
        let own = self.iter_mut().skip(usize::from(first)).take(usize::from(length));
        own.zip(bits_of(u128::from(value), usize::from(length))).for_each(|(slot, bit)| *slot = bit);
    }
}

/// Reason for which a parameter cannot be encoded in a message.
#[derive(Clone, Copy, Debug, Error, PartialEq)]
pub enum FieldError {
    /// A value beyond its field.
    #[error("{name} = {value} does not fit the navigation message: expected {minimum} to {maximum}")]
    OutOfRange {
        /// Name of the field.
        name: &'static str,
        /// Value of the field, in the unit that its name states.
        value: f64,
        /// Least value that the field holds.
        minimum: f64,
        /// Largest value.
        maximum: f64,
    },
    /// A count or time between two steps of its field.
    #[error("{name} = {value} cannot be sent exactly: expected a multiple of {step}")]
    NotMultiple {
        /// Name of the field.
        name: &'static str,
        /// Value of the field, in the unit that its name states.
        value: f64,
        /// Scale factor: the value of one step, in the field's unit.
        step: f64,
    },
    /// Issues that do not go together (IS-GPS-200N, 20.3.4.4).
    #[error("iode = {iode} contradicts iodc = {iodc}: expected the low eight bits of it")]
    Issue {
        /// Issue of the ephemeris.
        iode: u16,
        /// Issue of the clock.
        iodc: u16,
    },
    /// Reference times that a message cannot show to belong together.
    #[error(
        "toe = {toe_s} s and toc = {toc_s} s of the week: expected the same, as the message has no other mark of a set"
    )]
    References {
        /// Reference time of the orbit (`toe`), in seconds.
        toe_s: f64,
        /// Reference time of the clock (`toc`), in seconds.
        toc_s: f64,
    },
    /// A stream that cannot begin at that time.
    #[error("the message of {message} cannot begin {start_s} s after the week's start: expected {expected}")]
    Start {
        /// Name of the message.
        message: &'static str,
        /// Seconds after the beginning of the week.
        start_s: f64,
        /// Values that the field can hold.
        expected: &'static str,
    },
}

/// Interpretation of a field's integer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Unsigned integer, rounded to the nearest step.
    Unsigned,
    /// A count or a time: not negative, and refused when not a whole number of steps.
    Whole,
    /// Two's complement.
    Signed,
    /// A sign and a magnitude; a negative zero is read as zero.
    Magnitude,
    /// Two's complement of semicircles (or semicircles per second); the value is in radians.
    Semicircles,
    /// Two's complement of semicircles for an angle modulo one turn. A value outside ±π radians is reduced
    /// first.
    Turn,
}

/// Converts bits to a number; the bit that is sent first is the most significant.
pub fn number(bits: &[bool]) -> u128 {
    bits.iter().fold(0, |all, &bit| all << 1 | u128::from(bit))
}

/// Returns the lowest `count` bits of a number, the most significant first.
pub fn bits_of(number: u128, count: usize) -> impl Iterator<Item = bool> {
    (0..count).rev().map(move |place| number >> place & 1 == 1)
}

/// Soft symbols of bits, ±1; a logical 1 is negative.
pub fn soft(bits: &[bool]) -> Vec<f32> {
    bits.iter().map(|&one| if one { -1.0 } else { 1.0 }).collect()
}

/// Soft symbols as they would be if they had not been inverted.
pub(crate) fn upright(symbols: &[f32], inverted: bool) -> Vec<f32> {
    symbols.iter().map(|soft| if inverted { -soft } else { *soft }).collect()
}

/// One parameter's position and scale.
#[derive(Clone, Copy, Debug)]
pub struct Field {
    /// Unit last, as everywhere.
    pub name: &'static str,
    /// First bit and length of each piece, most significant first. Bits count as in the document.
    pub pieces: &'static [(u16, u8)],
    /// Interpretation of the integer.
    pub kind: Kind,
    /// One step is two to this power.
    pub exponent: i32,
    /// Clause of the interface document that defines the field.
    pub clause: &'static str,
}

impl Field {
    /// A field of a table.
    pub const fn new(
        name: &'static str,
        pieces: &'static [(u16, u8)],
        kind: Kind,
        exponent: i32,
        clause: &'static str,
    ) -> Self {
        Self { name, pieces, kind, exponent, clause }
    }

    /// Length in bits.
    pub fn bits(&self) -> u32 {
        self.pieces.iter().map(|piece| u32::from(piece.1)).sum()
    }

    fn is_signed(&self) -> bool {
        let kind =
            planted!("gnss.lnav.sign_tgd", self.kind, if self.name == "tgd_s" { Kind::Unsigned } else { self.kind });
        matches!(kind, Kind::Signed | Kind::Semicircles | Kind::Turn)
    }

    /// Smallest and largest integer that it holds.
    pub fn range(&self) -> (i64, i64) {
        let span = 1_i64 << self.bits();
        match self.kind {
            Kind::Magnitude => (1 - span / 2, span / 2 - 1),
            _ if self.is_signed() => (-span / 2, span / 2 - 1),
            _ => (0, span - 1),
        }
    }

    /// The scale's power of two.
    fn exponent(&self) -> i32 {
        let wrong = planted!("gnss.lnav.scale_crs", false, self.name == "crs_m")
            || planted!("gnss.lnav.scale_af1", false, self.name == "af1_sps" && self.bits() == 16)
            || planted!("gnss.lnav.scale_alpha", false, self.name == "alpha_2")
            || planted!("gnss.inav.scale_af0", false, self.name == "af0_s" && self.bits() == 31);
        self.exponent + i32::from(wrong)
    }

    fn step(&self) -> f64 {
        let power = libm::ldexp(1.0, self.exponent());
        if matches!(self.kind, Kind::Semicircles | Kind::Turn) { power * GPS_PI } else { power }
    }

    /// The integer that is there.
    pub fn read<S: Store>(&self, data: &S) -> i64 {
        let raw = self.pieces.iter().fold(0_i64, |raw, piece| (raw << piece.1) | i64::from(data.piece(*piece)));
        let span = 1_i64 << self.bits();
        match self.kind {
            Kind::Magnitude if raw >= span / 2 => planted!("gnss.bits.magnitude", span / 2 - raw, raw - span),
            _ if self.is_signed() && raw >= span / 2 => raw - span,
            _ => raw,
        }
    }

    /// Writes the low bits of `raw` into the field, or its sign and magnitude.
    pub fn write<S: Store>(&self, data: &mut S, raw: i64) {
        let mut left = self.bits();
        let sign = 1_i64 << (left - 1);
        let raw = if self.kind == Kind::Magnitude && raw < 0 { sign | -raw } else { raw };
        for piece in self.pieces {
            left -= u32::from(piece.1);
            data.set_piece(*piece, (raw >> left) as u32);
        }
    }

    /// Returns the value of a raw integer, in the unit that the field's name states.
    pub fn value(&self, raw: i64) -> f64 {
        let scaled = libm::ldexp(raw as f64, self.exponent());
        let angle = matches!(self.kind, Kind::Semicircles | Kind::Turn);
        let angle = planted!("gnss.lnav.idot_in_radians", angle, angle && self.name != "idot_radps");
        if angle { scaled * GPS_PI } else { scaled }
    }

    /// Integer that encodes `value` with the smallest error.
    pub fn raw(&self, value: f64) -> Result<i64, FieldError> {
        let angle = matches!(self.kind, Kind::Semicircles | Kind::Turn);
        let scaled = libm::ldexp(if angle { value / GPS_PI } else { value }, -self.exponent());
        let mut rounded = scaled.round();
        if self.kind == Kind::Whole && rounded != scaled {
            return Err(FieldError::NotMultiple { name: self.name, value, step: self.step() });
        }
        let (minimum, maximum) = self.range();
        if self.kind == Kind::Turn {
            let span = libm::ldexp(1.0, self.bits() as i32);
            rounded -= span * ((rounded + span / 2.0) / span).floor();
        }
        if (minimum as f64..=maximum as f64).contains(&rounded) {
            Ok(rounded as i64)
        } else {
            let (minimum, maximum) = (self.value(minimum), self.value(maximum));
            Err(FieldError::OutOfRange { name: self.name, value, minimum, maximum })
        }
    }
}

/// Field with access to the member of `T` that it encodes.
pub struct Element<T> {
    /// Position and scale.
    pub field: Field,
    get: fn(&T) -> f64,
    set: fn(&mut T, f64),
}

impl<T> Element<T> {
    /// Copies the parameter to other bit positions, each a first bit and a length in bits.
    pub const fn at(&self, pieces: &'static [(u16, u8)]) -> Self {
        Self { field: Field { pieces, ..self.field }, get: self.get, set: self.set }
    }

    /// The integer that is sent.
    ///
    /// # Errors
    /// A value outside the field, or between two of its steps.
    pub(crate) fn raw_of(&self, from: &T) -> Result<i64, FieldError> {
        self.field.raw((self.get)(from))
    }
}

/// Creates an element from a field and the functions that read and write the member.
pub const fn element<T>(field: Field, get: fn(&T) -> f64, set: fn(&mut T, f64)) -> Element<T> {
    Element { field, get, set }
}

/// [`element`] of a part of the parameters that is kept as the number that the field has: `plain!(name,
/// positions, kind, power of two, clause, path of the part)`.
macro_rules! plain {
    ($name:literal, $places:expr, $kind:expr, $power:expr, $clause:expr, $($part:tt)+) => {
        $crate::bits::element(
            $crate::bits::Field::new($name, &$places, $kind, $power, $clause),
            |of| of.$($part)+,
            |of, value| of.$($part)+ = value,
        )
    };
}
pub(crate) use plain;

/// Writes every field of `table` into `data`.
pub fn write_all<T, S: Store>(table: &[Element<T>], from: &T, data: &mut S) -> Result<(), FieldError> {
    table.iter().try_for_each(|element| {
        element.field.write(data, element.raw_of(from)?);
        Ok(())
    })
}

/// Reads every field of `table` out of `data`.
pub fn read_all<T, S: Store>(table: &[Element<T>], data: &S, into: &mut T) {
    for element in table {
        (element.set)(into, element.field.value(element.field.read(data)));
    }
}

/// Replaces every parameter of `table` by its value after encoding and decoding.
pub fn quantise_all<T>(table: &[Element<T>], into: &mut T) -> Result<(), FieldError> {
    table.iter().try_for_each(|element| {
        let raw = element.field.raw((element.get)(into))?;
        (element.set)(into, element.field.value(raw));
        Ok(())
    })
}

/// Adds `by` to the field of `table` with this name. Returns false if there is none.
pub fn add_to<T>(table: &[Element<T>], name: &str, into: &mut T, by: f64) -> bool {
    let Some(element) = table.iter().find(|element| element.field.name == name) else { return false };
    (element.set)(into, (element.get)(into) + by);
    true
}

/// Fields of tables, in their order.
pub(crate) fn fields<T>(tables: &[&'static [Element<T>]]) -> Vec<&'static Field> {
    tables.iter().copied().flatten().map(|element| &element.field).collect()
}

/// Reads the integers of all fields of `table` from `data`.
pub fn integers<T, S: Store>(table: &[Element<T>], data: &S) -> Vec<(&'static str, i64)> {
    table.iter().map(|element| (element.field.name, element.field.read(data))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bits_and_numbers_are_each_other() {
        let bits = [true, false, true, true, false];
        assert_eq!(number(&bits), 0b10110);
        assert_eq!(bits_of(0b10110, 5).collect::<Vec<_>>(), bits);
        assert_eq!(bits_of(0b10110, 3).collect::<Vec<_>>(), bits[2..]);
    }

    #[test]
    fn what_is_put_among_128_bits_stands_there_alone() {
        for (first, length) in [(0, 1), (6, 10), (16, 32), (95, 32), (96, 32), (127, 1)] {
            for ground in [0, u128::MAX] {
                let mut bits = ground;
                let value = 0xA5C3_96F1_u32 >> (32 - length);
                bits.set_piece((first, length), value);
                assert_eq!(bits.piece((first, length)), value, "{first} {length}");
                // Put back what was there: nothing else had changed.
                bits.set_piece((first, length), ground as u32);
                assert_eq!(bits, ground, "{first} {length}");
                let mut each = vec![ground != 0; 128];
                each.set_piece((first, length), value);
                assert_eq!(each.piece((first, length)), value, "{first} {length}");
                each.set_piece((first, length), ground as u32);
                assert!(each.iter().all(|bit| *bit == (ground != 0)), "{first} {length}");
            }
        }
    }
}
