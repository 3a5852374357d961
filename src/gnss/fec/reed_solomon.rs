//! A systematic Reed-Solomon code over octets, and the recovery of octets that are known to be missing.
//!
//! Source: Galileo OS SIS ICD 2.1, 5.1.13.2: GF(256) of x⁸ + x⁴ + x³ + x² + 1, 60 parity octets whose
//! generator has the roots α¹ to α⁶⁰ (255, 195), shortened to the information that there is. Information
//! octet j is the coefficient of x^(60 + j), parity octet i that of xⁱ. Limits: wrong octets are not found,
//! as what is decoded here has passed a check of its own; octets more than are needed must agree.

use std::sync::OnceLock;

/// Parity octets.
pub const PARITY: usize = 60;
/// The field's polynomial.
const POLYNOMIAL: usize = 0x11D;

/// Powers of α, twice over, and the exponents of all octets but 0.
struct Field {
    power: [u8; 510],
    exponent: [u8; 256],
}

fn field() -> &'static Field {
    static FIELD: OnceLock<Field> = OnceLock::new();
    FIELD.get_or_init(|| {
        let mut field = Field { power: [0; 510], exponent: [0; 256] };
        let mut value = 1_usize;
        for exponent in 0..255 {
            field.power[exponent] = value as u8;
            field.power[exponent + 255] = value as u8;
            field.exponent[value] = exponent as u8;
            value <<= 1;
            if value > 255 {
                value ^= planted!("gnss.fec.field", POLYNOMIAL, 0x12D);
            }
        }
        field
    })
}

fn product(a: u8, b: u8) -> u8 {
    let field = field();
    let exponent = |octet: u8| usize::from(field.exponent[usize::from(octet)]);
    if a == 0 || b == 0 { 0 } else { field.power[exponent(a) + exponent(b)] }
}

fn inverse(octet: u8) -> u8 {
    let field = field();
    field.power[255 - usize::from(field.exponent[usize::from(octet)])]
}

/// Coefficients of the generator below x⁶⁰, which has 1.
fn generator() -> &'static [u8; PARITY] {
    static GENERATOR: OnceLock<[u8; PARITY]> = OnceLock::new();
    GENERATOR.get_or_init(|| {
        let mut all = vec![1_u8];
        for root in 1..=PARITY {
            // Times x + αʳ.
            let mut next = vec![0; all.len() + 1];
            for (place, &coefficient) in all.iter().enumerate() {
                next[place + 1] ^= coefficient;
                next[place] ^= product(coefficient, field().power[root]);
            }
            all = next;
        }
        std::array::from_fn(|place| all[place])
    })
}

/// Computes the parity octets of information octets.
pub fn parity(information: &[u8]) -> [u8; PARITY] {
    let mut rest = [0; PARITY];
    for &octet in information.iter().rev() {
        let lead = octet ^ rest[PARITY - 1];
        rest.rotate_right(1);
        rest[0] = 0;
        rest.iter_mut().zip(generator()).for_each(|(slot, &factor)| *slot ^= product(lead, factor));
    }
    rest
}

/// Recovers missing octets of the information from parity octets. `None` if those are too few, or do not
/// agree.
pub fn recovered(information: &[Option<u8>], parity_octets: &[Option<u8>; PARITY]) -> Option<Vec<u8>> {
    let missing: Vec<usize> = (0..information.len()).filter(|&place| information[place].is_none()).collect();
    let mut whole: Vec<u8> = information.iter().map(|octet| octet.unwrap_or(0)).collect();
    // What each missing octet adds to the parity if it is 1.
    let alone = |place: usize| {
        let mut one = vec![0; information.len()];
        one[place] = 1;
        parity(&one)
    };
    let added: Vec<[u8; PARITY]> = missing.iter().map(|&place| alone(place)).collect();
    let known = parity(&whole);
    // A row for each parity octet that is there: factors of the missing ones, and the sum that they make.
    let mut rows: Vec<Vec<u8>> = (0..PARITY)
        .filter_map(|place| {
            let sum = parity_octets[place]? ^ known[place];
            Some(added.iter().map(|column| column[place]).chain([sum]).collect())
        })
        .collect();
    for column in 0..missing.len() {
        let pivot = (column..rows.len()).find(|&row| rows[row][column] != 0)?;
        rows.swap(column, pivot);
        let scale = inverse(rows[column][column]);
        rows[column].iter_mut().for_each(|octet| *octet = product(*octet, scale));
        let lead = rows[column].clone();
        for (number, row) in rows.iter_mut().enumerate() {
            let factor = row[column];
            if number != column && factor != 0 {
                row.iter_mut().zip(&lead).for_each(|(octet, &of_lead)| *octet ^= product(factor, of_lead));
            }
        }
    }
    let agrees = rows.iter().skip(missing.len()).all(|row| row.iter().all(|&octet| octet == 0));
    missing.iter().zip(&rows).for_each(|(&place, row)| whole[place] = row[missing.len()]);
    agrees.then_some(whole)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn example() -> Vec<u8> {
        (0..58_u32).map(|number| (number * number * 37 + number * 11 + 5) as u8).collect()
    }

    #[test]
    fn a_code_word_has_the_roots_of_the_generator() {
        let information = example();
        let word: Vec<u8> = parity(&information).into_iter().chain(information).collect();
        for root in 0..=61 {
            // Horner's rule at α to that power.
            let value = word.iter().rev().fold(0, |sum, &octet| product(sum, field().power[root]) ^ octet);
            assert_eq!(value == 0, (1..=PARITY).contains(&root), "{root}");
        }
    }

    #[test]
    fn as_many_octets_are_found_as_parity_octets_are_there_and_contradictions_are_seen() {
        let information = example();
        let sent = parity(&information);
        for count in [1, 14, 28, 42, 58] {
            let holed: Vec<Option<u8>> =
                (0..58).map(|place| (place * 7 % 58 >= count).then(|| information[place])).collect();
            let mut parts = [None; PARITY];
            // The last ones that are needed, and one more.
            let first = PARITY - count - 1;
            parts.iter_mut().zip(sent).skip(first).for_each(|(slot, octet)| *slot = Some(octet));
            assert_eq!(recovered(&holed, &parts).as_ref(), Some(&information), "{count}");
            let mut wrong = parts;
            wrong[PARITY - 1] = Some(sent[PARITY - 1] ^ 4);
            assert_eq!(recovered(&holed, &wrong), None, "{count}");
            parts.iter_mut().take(first + 2).for_each(|slot| *slot = None);
            assert_eq!(recovered(&holed, &parts), None, "{count}");
        }
    }
}
