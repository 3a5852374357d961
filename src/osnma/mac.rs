//! Tags and the MACSEQ field: what they cover, and their functions.
//!
//! Source: Galileo OSNMA SIS ICD 1.1, 6.6 and 6.7. A tag is the MAC, cut to its length, over the number of
//! the satellite of the data, that of the sender, the sub-frame's time, the tag's position, the NMA status
//! and the data, filled with zeros to whole bytes. The first tag of a sub-frame leaves the satellite of the
//! data out. MACSEQ covers the statements of the flexible slots.

use aes::Aes128;
use cmac::Cmac;
use hmac::{Hmac, KeyInit, Mac};
use sha2::Sha256;

use crate::bits::{Row, leading};
use crate::chain::MacFunction;
use crate::time::Gst;

/// Bits of the MACSEQ field.
const MACSEQ_BITS: usize = 12;

/// Facts under a tag besides the data.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Tagged {
    /// Number of the satellite that the data are of, PRN_D.
    pub of: u8,
    /// Number of the satellite that sends the tag, PRN_A.
    pub sender: u8,
    /// Beginning of the sub-frame that sends the tag.
    pub start: Gst,
    /// Position of the tag in the sub-frame, from 1 on, CTR.
    pub position: u8,
    /// Two bits of the NMA status.
    pub status: u8,
}

impl Tagged {
    /// Message that the tag covers.
    pub fn message(&self, data: &Row) -> Vec<u8> {
        let mut row = Row::default();
        let names_satellite = planted!("osnma.mac.satellite", self.position > 1, true);
        if names_satellite {
            row.push(self.of.into(), 8);
        }
        row.push(self.sender.into(), 8);
        row.push_bytes(&self.start.bytes());
        row.push(self.position.into(), 8);
        row.push(self.status.into(), 2);
        row.push_row(data);
        row.bytes().to_vec()
    }
}

/// First bits of the MAC of a message, 64 at most, or `None` for a key that the function cannot take.
pub fn mac(function: MacFunction, key: &[u8], message: &[u8], bits: usize) -> Option<u64> {
    match function {
        MacFunction::HmacSha256 => {
            let mut mac = Hmac::<Sha256>::new_from_slice(key).ok()?;
            mac.update(message);
            Some(leading(&mac.finalize().into_bytes(), bits))
        }
        MacFunction::CmacAes => {
            let mut mac = Cmac::<Aes128>::new_from_slice(key).ok()?;
            mac.update(message);
            Some(leading(&mac.finalize().into_bytes(), bits))
        }
    }
}

/// MACSEQ of a sub-frame: sender, time, and the 16 bits that follow each tag of a flexible slot (ICD, 6.6).
pub fn macseq(function: MacFunction, key: &[u8], sender: u8, start: Gst, flexible: &[u16]) -> Option<u64> {
    let mut row = Row::default();
    row.push(sender.into(), 8);
    row.push_bytes(&start.bytes());
    flexible.iter().for_each(|&info| row.push(info.into(), 16));
    mac(function, key, row.bytes(), MACSEQ_BITS)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bits::unhex;

    #[test]
    fn printed_vectors_of_both_functions_hold() {
        // RFC 4231, test case 2.
        let hmac = mac(MacFunction::HmacSha256, b"Jefe", b"what do ya want for nothing?", 40);
        assert_eq!(hmac, Some(0x5b_dcc1_46bf));
        // RFC 4493, example 2.
        let key = unhex("2b7e151628aed2a6abf7158809cf4f3c").unwrap();
        let message = unhex("6bc1bee22e409f96e93d7e117393172a").unwrap();
        assert_eq!(mac(MacFunction::CmacAes, &key, &message, 40), Some(0x07_0a16_b46b));
        assert_eq!(mac(MacFunction::CmacAes, &key[..15], &message, 40), None);
    }

    #[test]
    fn the_first_tag_leaves_the_satellite_of_the_data_out() {
        let mut data = Row::default();
        data.push(0b1111_1101, 8);
        let tagged = Tagged { of: 3, sender: 2, start: Gst::new(0, 30), position: 1, status: 2 };
        assert_eq!(tagged.message(&data), [2, 0, 0, 0, 30, 1, 0b1011_1111, 0b0100_0000]);
        let second = Tagged { position: 2, ..tagged };
        assert_eq!(second.message(&data), [3, 2, 0, 0, 0, 30, 2, 0b1011_1111, 0b0100_0000]);
    }
}
