//! Memory codes: the document prints their chips, and a file contains them bit by bit.

/// Numbers that have codes.
pub(super) const COUNT: usize = 50;

/// Component to which a code of a satellite belongs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Code {
    /// Code of the component that carries the message.
    Data,
    /// Code of the component that has a secondary code.
    Pilot,
}

/// Chips of a satellite by its number, 1 to 50, as ±1; `None` beyond. `table` has the codes of the data's
/// numbers, then those of the pilot's, each from a new byte on, first chip in the highest bit.
pub(super) fn chips(table: &[u8], chips: u32, which: Code, number: u8) -> Option<Vec<i8>> {
    let index = usize::from(number).checked_sub(1).filter(|&index| index < COUNT)?;
    let first = match which {
        Code::Data => 0,
        Code::Pilot => COUNT,
    };
    let bytes = table.chunks_exact(chips.div_ceil(8) as usize).nth(first + index)?;
    let bits = bytes.iter().flat_map(|byte| (0..8).rev().map(move |bit| byte >> bit & 1));
    Some(bits.take(chips as usize).map(|one| if one == 1 { -1 } else { 1 }).collect())
}
