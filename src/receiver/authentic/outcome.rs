//! Outcome of a verification: counts, states and times, in words and as an object.

use std::collections::BTreeMap;
use std::fmt;

use serde::ser::{Serialize, Serializer};
use serde_json::{Value, json};

use gnss::satellite::Sv;
use osnma::fields::Adkd;
use osnma::report::Counts;

/// State of the verifier from an instant on.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct StateChange {
    /// Time since the first sample.
    pub seconds: f64,
    /// Name of the state.
    pub state: &'static str,
}

/// Outcome of a reception's verification.
#[derive(Clone, Debug, PartialEq)]
pub struct Authenticity {
    /// Name of the start: cold, warm or hot.
    pub start: &'static str,
    /// Name of the last state.
    pub state: &'static str,
    /// States in the order of time, the first at the start.
    pub states: Vec<StateChange>,
    /// Counts of the verifier.
    pub counts: Counts,
    /// Satellites of which an ephemeris became authentic.
    pub satellites: Vec<Sv>,
    /// True if positions take authentic data alone.
    pub position_required: bool,
    /// Time of the first authentic data since the first sample.
    pub first_data_s: Option<f64>,
    /// Time of the first fix that authentic data alone determine.
    pub first_fix_s: Option<f64>,
    /// Newest root key, for a hot start, as hexadecimal digits.
    pub kroot: Option<String>,
}

/// Number of tags of a kind, or of all, with a result of that name.
fn tags(counts: &Counts, kind: Option<Adkd>, name: &str) -> u64 {
    counts.tags_where(|adkd, outcome| kind.is_none_or(|kind| kind == adkd) && outcome.name() == name)
}

/// Counts of a verifier as an object.
pub fn counted(counts: &Counts) -> Value {
    let of = |kind| {
        let names = ["authentic", "no_data", "refused", "not_verifiable"];
        names.iter().map(|name| ((*name).to_owned(), json!(tags(counts, kind, name)))).collect::<Value>()
    };
    let reasons = |name: &str| {
        let mut reasons = BTreeMap::<&str, u64>::new();
        for ((_, outcome), count) in counts.tags.iter().filter(|((_, outcome), _)| outcome.name() == name) {
            *reasons.entry(outcome.reason()).or_default() += count;
        }
        reasons
    };
    json!({
        "pages": {
            "all": counts.pages,
            "checksum": counts.checksum,
            "not_nominal": counts.not_nominal,
            "out_of_order": counts.out_of_order,
            "clock_disagrees": counts.clock_disagrees,
        },
        "subframes": {
            "authenticated": counts.subframes,
            "not_authenticated": counts.unsigned_subframes,
            "without_root": counts.subframes_without_root,
            "unknown_table": counts.subframes_unreadable,
        },
        "pkr": {
            "verified": counts.pkr_verified,
            "refused": counts.pkr_refused,
            "without_tree": counts.pkr_without_tree,
        },
        "kroot": {
            "verified": counts.kroot_verified,
            "refused": counts.kroot_refused,
            "without_key": counts.kroot_without_key,
        },
        "dsm_unreadable": counts.dsm_unreadable,
        "keys": {
            "verified": counts.keys_verified,
            "refused": counts.keys_refused,
            "not_verifiable": counts.keys_not_verifiable,
        },
        "tags": {
            "all": of(None),
            "adkd_0": of(Some(Adkd::Ephemeris)),
            "adkd_4": of(Some(Adkd::Timing)),
            "adkd_12": of(Some(Adkd::SlowMac)),
            "refused_by": reasons("refused"),
            "not_verifiable_by": reasons("not_verifiable"),
        },
        "authentic_data": counts.authentic_data,
    })
}

impl Serialize for Authenticity {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut object = counted(&self.counts);
        object["start"] = json!(self.start);
        object["state"] = json!(self.state);
        object["states"] = json!(self.states);
        object["satellites"] = self.satellites.iter().map(|sv| json!(sv.to_string())).collect();
        object["position_of_authentic_data"] = json!(self.position_required);
        object["first_authentic_s"] = json!(self.first_data_s);
        object["first_authentic_fix_s"] = json!(self.first_fix_s);
        object["stored_root"] = json!(self.kroot);
        object.serialize(serializer)
    }
}

impl fmt::Display for Authenticity {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let count = |name| tags(&self.counts, None, name);
        let (right, refused, open) = (count("authentic"), count("refused"), count("not_verifiable"));
        write!(f, "OSNMA: {}, {right} tags authentic, {refused} refused, {open} not verifiable", self.state)?;
        self.first_data_s.map_or(Ok(()), |s| write!(f, ", first authentic data after {s:.1} s"))?;
        self.first_fix_s.map_or(Ok(()), |s| write!(f, ", first authentic fix after {s:.1} s"))
    }
}
