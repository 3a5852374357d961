//! Authentication of Galileo's navigation messages (OSNMA), verified and signed.
//!
//! Source: Galileo OSNMA SIS ICD 1.1 and OSNMA receiver guidelines 1.3. Pages of I/NAV go in
//! ([`page::Page`]); a [`verifier::Verifier`] gives each tag's result with its reason. What it trusts at the
//! start is an [`anchor`](keys::Anchor): the root of the Merkle tree, a public key, or a public key with a
//! stored root key of the chain. Cryptography is that of the RustCrypto crates. Limits: signatures are ECDSA
//! P-256 (P-521 is named and refused); a renewal of the Merkle tree needs its root from outside of the
//! signal.

#[macro_use(planted)]
extern crate gnss;

// Tests of the program sign recordings by the same source.
#[cfg(test)]
extern crate self as osnma;

pub mod bits;
pub mod chain;
pub mod data;
pub mod dsm;
pub mod fields;
pub mod files;
pub mod keys;
pub mod mac;
pub mod page;
pub mod provider;
pub mod report;
mod subframe;
pub mod tables;
#[cfg(test)]
mod tests;
pub mod time;
pub mod verifier;
