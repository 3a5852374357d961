//! Fields that every sub-frame carries: the NMA header and the header of a DSM block.
//!
//! Source: Galileo OSNMA SIS ICD 1.1, 3.2.1 to 3.2.3.

use std::fmt;

/// NMA header: status, chain in force, and what will change (ICD, 3.2.1).
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct NmaHeader(pub u8);

/// Status of the authentication (ICD, table 2).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NmaStatus {
    /// Value without a meaning.
    Reserved,
    /// Test: data may be authenticated for tests.
    Test,
    /// Operational.
    Operational,
    /// Authentication must not be used.
    DoNotUse,
}

/// Change of keys that the header announces (ICD, table 4).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Notice {
    /// Value without a meaning.
    Reserved,
    /// No change.
    Nominal,
    /// The chain ends; the next one is announced.
    EndOfChain,
    /// The chain is revoked.
    ChainRevoked,
    /// A new public key comes into force.
    NewPublicKey,
    /// The public key is revoked.
    PublicKeyRevoked,
    /// A new Merkle tree comes into force.
    NewMerkleTree,
    /// OSNMA alert message.
    Alert,
}

impl NmaHeader {
    /// Status, of two bits.
    pub fn status(self) -> NmaStatus {
        match self.0 >> 6 {
            0 => NmaStatus::Reserved,
            1 => NmaStatus::Test,
            2 => NmaStatus::Operational,
            _ => NmaStatus::DoNotUse,
        }
    }

    /// Bits of the status, as a tag covers them.
    pub fn status_bits(self) -> u8 {
        self.0 >> 6
    }

    /// Number of the chain whose keys are sent, from 0 to 3.
    pub fn chain(self) -> u8 {
        self.0 >> 4 & 3
    }

    /// Change that is announced.
    pub fn notice(self) -> Notice {
        match self.0 >> 1 & 7 {
            0 => Notice::Reserved,
            1 => Notice::Nominal,
            2 => Notice::EndOfChain,
            3 => Notice::ChainRevoked,
            4 => Notice::NewPublicKey,
            5 => Notice::PublicKeyRevoked,
            6 => Notice::NewMerkleTree,
            _ => Notice::Alert,
        }
    }
}

impl fmt::Debug for NmaHeader {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:?}, chain {}, {:?}", self.status(), self.chain(), self.notice())
    }
}

/// Header of a block of a digital signature message (DSM; ICD, 3.2.2).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct DsmHeader(pub u8);

impl DsmHeader {
    /// Number of the message; 12 to 15 are of public keys.
    pub fn id(self) -> u8 {
        self.0 >> 4
    }

    /// Position of the block in the message.
    pub fn block(self) -> usize {
        usize::from(self.0 & 15)
    }

    /// True for a message with a public key (DSM-PKR).
    pub fn is_key(self) -> bool {
        self.id() >= 12
    }
}

/// Kind of data under a tag (ICD, table 14).
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Adkd {
    /// Ephemeris, clock and status: ADKD 0.
    Ephemeris,
    /// Timing parameters: ADKD 4.
    Timing,
    /// Ephemeris, clock and status with a key 10 sub-frames later: ADKD 12.
    SlowMac,
    /// A value without a meaning.
    Reserved(u8),
}

impl Adkd {
    /// Kind of a number of four bits.
    pub fn of(number: u8) -> Self {
        match number {
            0 => Self::Ephemeris,
            4 => Self::Timing,
            12 => Self::SlowMac,
            other => Self::Reserved(other),
        }
    }

    /// Number of the kind.
    pub fn number(self) -> u8 {
        match self {
            Self::Ephemeris => 0,
            Self::Timing => 4,
            Self::SlowMac => 12,
            Self::Reserved(number) => number,
        }
    }

    /// Sub-frames from the tag to its key (ICD, 6.7).
    pub fn key_after(self) -> i64 {
        if self == Self::SlowMac { 11 } else { 1 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_header_sent_on_2022_03_07_says_test_chain_1_nominal() {
        let header = NmaHeader(0x52);
        assert_eq!((header.status(), header.chain(), header.notice()), (NmaStatus::Test, 1, Notice::Nominal));
    }

    #[test]
    fn the_number_of_a_kind_is_the_one_it_was_read_from() {
        (0..16).for_each(|number| assert_eq!(Adkd::of(number).number(), number));
        assert!(DsmHeader(0xc3).is_key() && !DsmHeader(0xb3).is_key());
        assert_eq!((DsmHeader(0x17).id(), DsmHeader(0x17).block()), (1, 7));
    }
}
