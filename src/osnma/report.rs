//! Results of a verifier: each tag's, and counts of everything that was taken, refused or could not be used.

use std::collections::BTreeMap;
use std::fmt;

use crate::data::DataGap;
use crate::fields::Adkd;
use crate::page::satellite;
use crate::time::Gst;
use gnss::record::TagRow;

/// State of a verifier.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum State {
    /// No public key is verified yet.
    NoKey,
    /// A public key is verified, and no root of a chain.
    KeyVerified,
    /// The root of a chain is verified, and no key after it.
    RootVerified,
    /// Keys follow the root, and no data are authenticated now.
    TrackingChain,
    /// Data were authenticated within the last ten sub-frames.
    Authentic,
    /// The system says that authentication must not be used.
    DoNotUse,
    /// The receiver's own time contradicts the pages.
    ClockDisagrees,
}

/// Result of a tag.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Outcome {
    /// The data are those that the system sent.
    Authentic,
    /// The tag is right and says that its sender had no data (COP 0).
    NoData,
    /// The tag contradicts what was received.
    Refused(Refusal),
    /// There is nothing to hold the tag to.
    NotVerifiable(Gap),
}

/// Reason for which a tag is refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Refusal {
    /// The tag is not the MAC of the data.
    Tag,
    /// The field MACSEQ is not the MAC of the flexible slots.
    Macseq,
    /// The kind of the tag, or its satellite, is not that of the look-up table.
    Slot,
}

/// Reason for which a tag cannot be verified.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Gap {
    /// A word of the data was not received.
    NoWords,
    /// A word of the data is older than the tag's COP allows.
    OldWords,
    /// Words of two issues.
    MixedWords,
    /// No later key was received.
    NoKey,
    /// Pages with the field MACSEQ or flexible slots were not received.
    NoMacseq,
    /// The chain was revoked or replaced before its key came.
    ChainGone,
    /// The receiver's time is too uncertain to know that the tag came before its key.
    Time,
    /// The satellite or the kind of the data has a reserved value.
    ReservedField,
    /// The NMA status says that authentication must not be used.
    DoNotUse,
}

impl From<DataGap> for Gap {
    fn from(gap: DataGap) -> Self {
        match gap {
            DataGap::Missing => Self::NoWords,
            DataGap::Old => Self::OldWords,
            DataGap::Mixed => Self::MixedWords,
        }
    }
}

impl State {
    /// Name of the state.
    pub fn name(self) -> &'static str {
        match self {
            Self::NoKey => "no key",
            Self::KeyVerified => "key verified",
            Self::RootVerified => "root verified",
            Self::TrackingChain => "tracking chain",
            Self::Authentic => "authentic",
            Self::DoNotUse => "do not use",
            Self::ClockDisagrees => "clock disagrees",
        }
    }
}

impl Outcome {
    /// Name of the result.
    pub fn name(self) -> &'static str {
        match self {
            Self::Authentic => "authentic",
            Self::NoData => "no_data",
            Self::Refused(_) => "refused",
            Self::NotVerifiable(_) => "not_verifiable",
        }
    }

    /// Reason in words; empty for a tag that is right.
    pub fn reason(self) -> &'static str {
        match self {
            Self::Authentic => "",
            Self::NoData => "tag without data (COP 0)",
            Self::Refused(Refusal::Tag) => "tag is not the MAC of the data",
            Self::Refused(Refusal::Macseq) => "MACSEQ is wrong",
            Self::Refused(Refusal::Slot) => "kind or satellite contradicts the look-up table",
            Self::NotVerifiable(gap) => match gap {
                Gap::NoWords => "words of the data not received",
                Gap::OldWords => "words of the data older than COP allows",
                Gap::MixedWords => "words of two issues",
                Gap::NoKey => "no later key received",
                Gap::NoMacseq => "pages of MACSEQ not received",
                Gap::ChainGone => "chain revoked or replaced",
                Gap::Time => "receiver's time too uncertain",
                Gap::ReservedField => "satellite or kind of data reserved",
                Gap::DoNotUse => "system says do not use",
            },
        }
    }
}

impl fmt::Display for State {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

/// Result of one tag with its circumstances.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TagReport {
    /// Beginning of the sub-frame that sent the tag.
    pub sent: Gst,
    /// Satellite that sent it.
    pub sender: u8,
    /// Satellite that the data are of, as the tag states it.
    pub of: u8,
    /// Kind of the data.
    pub adkd: Adkd,
    /// Position of the tag in its sub-frame, from 1 on.
    pub position: u8,
    /// Result.
    pub outcome: Outcome,
}

impl TagReport {
    /// Row of `osnma.csv`.
    pub fn row(&self) -> TagRow {
        TagRow {
            gst_week: self.sent.week(),
            tow_s: self.sent.tow_s(),
            sender: satellite(self.sender).to_string(),
            satellite: satellite(self.of).to_string(),
            adkd: self.adkd.number(),
            position: self.position,
            result: self.outcome.name().to_owned(),
            reason: self.outcome.reason().to_owned(),
        }
    }
}

/// Counts of a verifier.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Counts {
    /// Pages that were taken.
    pub pages: u64,
    /// Pages with a wrong checksum.
    pub checksum: u64,
    /// Pages that are no nominal ones.
    pub not_nominal: u64,
    /// Pages of a sub-frame that had ended, and pages that came twice.
    pub out_of_order: u64,
    /// Pages that the receiver's own time contradicts.
    pub clock_disagrees: u64,
    /// Sub-frames of satellites that authenticate.
    pub subframes: u64,
    /// Sub-frames of satellites that send no authentication.
    pub unsigned_subframes: u64,
    /// Sub-frames whose NMA header or whose chain's root did not come in time.
    pub subframes_without_root: u64,
    /// Sub-frames of a chain whose look-up table does not exist.
    pub subframes_unreadable: u64,
    /// DSM-KROOT messages that a public key verified, each content once.
    pub kroot_verified: u64,
    /// DSM-KROOT messages with a wrong signature.
    pub kroot_refused: u64,
    /// DSM-KROOT messages of a public key that is not known or is revoked.
    pub kroot_without_key: u64,
    /// DSM-PKR messages that the Merkle tree verified, each content once.
    pub pkr_verified: u64,
    /// DSM-PKR messages that do not lead to the root of the tree.
    pub pkr_refused: u64,
    /// DSM-PKR messages while no root of a tree is known.
    pub pkr_without_tree: u64,
    /// Messages with a reserved field, a function that is not supported, or blocks of two messages.
    pub dsm_unreadable: u64,
    /// Sub-frames of which a key was proved.
    pub keys_verified: u64,
    /// Keys that do not belong to the chain.
    pub keys_refused: u64,
    /// Keys before the root of their chain, or more than ten weeks after it.
    pub keys_not_verifiable: u64,
    /// Tags by kind and result.
    pub tags: BTreeMap<(Adkd, Outcome), u64>,
    /// Sets of data that became authentic.
    pub authentic_data: u64,
}

impl Counts {
    /// Number of tags with a result that fits.
    pub fn tags_where(&self, fits: impl Fn(Adkd, Outcome) -> bool) -> u64 {
        self.tags.iter().filter(|((adkd, outcome), _)| fits(*adkd, *outcome)).map(|(_, count)| count).sum()
    }

    /// Number of forgeries: tags, keys and signatures that are refused.
    pub fn refused(&self) -> u64 {
        let tags = self.tags_where(|_, outcome| matches!(outcome, Outcome::Refused(_)));
        tags + self.keys_refused + self.kroot_refused + self.pkr_refused
    }
}
