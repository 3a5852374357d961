//! Arguments of `osnma` as written.

use std::path::PathBuf;

use clap::{ArgGroup, Args, Subcommand};

use crate::cli::printed::Printed;

#[derive(Args, Debug)]
pub struct Osnma {
    #[command(subcommand)]
    pub action: OsnmaAction,
}

#[derive(Debug, Subcommand)]
pub enum OsnmaAction {
    /// Verify a recording of I/NAV pages: keys, signatures and tags
    Verify(Verify),
    /// Print the I/NAV pages that a scene's satellites send on E1-B, for `osnma verify` and other verifiers
    Pages(Pages),
}

#[derive(Args, Debug)]
#[command(after_help = "Examples:\n  gnss-twin osnma pages scenarios/osnma.toml >pages.csv\n  gnss-twin osnma pages \
                        spoofed.toml --spoofer 1 >spoofed.csv\n\nRows: TOW,WN,SV,page as 60 hexadecimal digits, of all \
                        satellites of the scene whether they are in view or not, with the scene's message faults")]
pub struct Pages {
    /// Scene with a table [osnma]
    #[arg(value_name = "SCENARIO.toml")]
    pub scenario: PathBuf,
    /// Pages of a spoofer by its number, from 1 [default: those of the satellites]
    #[arg(long, value_name = "N")]
    pub spoofer: Option<usize>,
    /// Seed, overrides the scene's
    #[arg(long, value_name = "N")]
    pub seed: Option<u64>,
}

#[derive(Args, Debug)]
#[command(
    group(ArgGroup::new("anchor").required(true).args(["merkle_root", "public_key"])),
    after_help = "Examples:\n  gnss-twin osnma verify pages.csv --merkle-root OSNMA_MerkleTree.xml\n  gnss-twin osnma \
                  verify pages.csv.gz --public-key OSNMA_PublicKey.xml --out reports/osnma\n  gnss-twin osnma verify \
                  pages.csv --public-key OSNMA_PublicKey.xml --kroot reports/osnma/kroot.hex\n\nRows of PAGES: \
                  TOW,WN,SV,page as 60 hexadecimal digits, in the order of time. Exit code: 3 if a tag, key or \
                  signature is refused, or if no tag can be verified"
)]
pub struct Verify {
    /// Recording of I/NAV pages of E1-B (.csv or .csv.gz)
    #[arg(value_name = "PAGES.csv")]
    pub pages: PathBuf,
    /// Cold start: root of the Merkle tree, as a file of the GSC (.xml) or as 64 hexadecimal digits
    #[arg(long, value_name = "FILE.xml|HEX")]
    pub merkle_root: Option<String>,
    /// Warm start: public key, as a file of the GSC (.xml)
    #[arg(long, value_name = "FILE.xml")]
    pub public_key: Option<PathBuf>,
    /// Hot start: root key that an earlier run stored as kroot.hex, verified with the public key
    #[arg(long, value_name = "FILE.hex", requires = "public_key", conflicts_with = "merkle_root")]
    pub kroot: Option<PathBuf>,
    /// Bound of the error of the receiver's own time, in seconds. Tags of ADKD 0 and 4 need less than 30 s,
    /// those of ADKD 12 less than 330 s
    #[arg(long, value_name = "S", default_value_t = 15.0, value_parser = uncertainty)]
    pub time_uncertainty_s: f64,
    /// Own time of the receiver minus the time of each row, in seconds: positive for pages that come late
    #[arg(long, value_name = "S", default_value_t = 0.0, allow_negative_numbers = true, value_parser = offset)]
    pub clock_offset_s: f64,
    /// Bits of right tags after which data are authentic
    #[arg(long, value_name = "BITS", default_value_t = 40, value_parser = clap::value_parser!(u32).range(20..=480))]
    pub tag_bits: u32,
    /// Directory for osnma.csv (a row for each tag), osnma.json and kroot.hex [default: nothing is written]
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    #[command(flatten)]
    pub printed: Printed,
}

fn uncertainty(text: &str) -> Result<f64, String> {
    text.parse().ok().filter(|s| (0.0..=1e9).contains(s)).ok_or_else(|| "expected seconds from 0 to 1e9".to_owned())
}

fn offset(text: &str) -> Result<f64, String> {
    let value = text.parse().ok().filter(|s| (-1e9..=1e9).contains(s));
    value.ok_or_else(|| "expected seconds from -1e9 to 1e9".to_owned())
}
