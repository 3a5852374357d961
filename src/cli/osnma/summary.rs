//! Summary of `osnma verify`: in words, and as an object.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write;

use serde_json::{Value, json};

use gnss::time::Epoch;
use osnma::fields::Adkd;
use osnma::page::Page;
use osnma::report::{Counts, Outcome, State};
use osnma::time::Gst;
use osnma::verifier::Verifier;
use receiver::authentic::counted;

/// Weeks of GPS before the first of GST (Galileo OS SIS ICD 2.1, 5.1.2).
const GPS_WEEKS: u32 = 1024;
/// Kinds of tags with their names.
const KINDS: [(Adkd, &str); 3] =
    [(Adkd::Ephemeris, "ADKD 0, ephemeris"), (Adkd::Timing, "ADKD 4, time"), (Adkd::SlowMac, "ADKD 12, slow MAC")];

/// Summary of a whole recording.
pub struct Summary<'a> {
    first: Gst,
    last: Gst,
    satellites: usize,
    start: &'static str,
    verifier: &'a Verifier,
}

impl<'a> Summary<'a> {
    /// Summary of the pages, of which there is one at least, after a start by that name.
    pub fn new(pages: &[Page], start: &'static str, verifier: &'a Verifier) -> Self {
        let satellites: BTreeSet<u8> = pages.iter().map(|page| page.sender).collect();
        let time = |page: Option<&Page>| page.map_or(Gst::new(0, 0), |page| page.start);
        let (first, last) = (time(pages.first()), time(pages.last()));
        Self { first, last, satellites: satellites.len(), start, verifier }
    }

    fn counts(&self) -> &Counts {
        self.verifier.counts()
    }

    fn after_s(&self, time: Option<Gst>) -> Option<i64> {
        time.map(|time| time.since_s(self.first))
    }

    /// Number of tags of a kind, or of all, with a result of that name.
    fn tags(&self, kind: Option<Adkd>, name: &str) -> u64 {
        self.counts().tags_where(|adkd, outcome| kind.is_none_or(|kind| kind == adkd) && outcome.name() == name)
    }

    /// Numbers of tags by the reason of their result.
    fn reasons(&self, name: &str) -> BTreeMap<&'static str, u64> {
        let mut reasons = BTreeMap::new();
        for ((_, outcome), count) in self.counts().tags.iter().filter(|((_, outcome), _)| outcome.name() == name) {
            *reasons.entry(outcome.reason()).or_default() += count;
        }
        reasons
    }

    /// Text of the summary, with a line feed at its end.
    pub fn text(&self) -> String {
        let counts = self.counts();
        let mut text = format!(
            "recording     {} pages of {} satellites, {} to {} GST\n",
            counts.pages,
            self.satellites,
            calendar(self.first),
            calendar(self.last)
        );
        let unused = [
            (counts.checksum, "with a wrong checksum"),
            (counts.not_nominal, "not nominal"),
            (counts.out_of_order, "out of order or twice"),
            (counts.clock_disagrees, "against the receiver's own time"),
        ];
        let unused = listed(unused.into_iter());
        if !unused.is_empty() {
            let _ = writeln!(text, "not used      {unused}");
        }
        let _ = writeln!(
            text,
            "sub-frames    {} with authentication, {} without",
            counts.subframes, counts.unsigned_subframes
        );
        let others = listed(
            [
                (counts.subframes_without_root, "sub-frames without a verified root"),
                (counts.subframes_unreadable, "sub-frames of an unknown look-up table"),
                (counts.kroot_without_key, "DSM-KROOT of an unknown or revoked public key"),
                (counts.pkr_without_tree, "DSM-PKR without a Merkle root"),
                (counts.dsm_unreadable, "messages with unknown fields"),
                (counts.keys_not_verifiable, "keys before their root or too long after it"),
            ]
            .into_iter(),
        );
        if !others.is_empty() {
            let _ = writeln!(text, "not verified  {others}");
        }
        let _ = writeln!(
            text,
            "messages      DSM-PKR {} verified, {} refused; DSM-KROOT {} verified, {} refused",
            counts.pkr_verified, counts.pkr_refused, counts.kroot_verified, counts.kroot_refused
        );
        let _ = writeln!(text, "keys          {} verified, {} refused", counts.keys_verified, counts.keys_refused);
        let row = |kind| {
            let count = |name| self.tags(kind, name);
            let (right, empty) = (count("authentic"), count("no_data"));
            let (refused, open) = (count("refused"), count("not_verifiable"));
            format!("{right} authentic, {empty} without data, {refused} refused, {open} not verifiable")
        };
        let _ = writeln!(text, "tags          {}", row(None));
        for (kind, name) in KINDS {
            let _ = writeln!(text, "  {name:<20} {}", row(Some(kind)));
        }
        for name in ["refused", "not_verifiable"] {
            let reasons = listed(self.reasons(name).into_iter().map(|(reason, count)| (count, reason)));
            if !reasons.is_empty() {
                let _ = writeln!(text, "  {:<20} {reasons}", name.replace('_', " "));
            }
        }
        let after = |time| self.after_s(time).map_or("none".to_owned(), |s| format!("after {s} s"));
        let _ = writeln!(
            text,
            "{:<13} root {}, first authentic data {}",
            format!("{} start", self.start),
            if self.start == "hot" { "stored".to_owned() } else { after(self.verifier.first_root()) },
            after(self.verifier.first_authentic())
        );
        let _ = writeln!(text, "state         {}", self.verifier.state());
        text
    }

    /// Object of the summary.
    pub fn object(&self) -> Value {
        let chain = |(id, newest): (u8, Gst)| json!({ "id": id, "newest_key": calendar(newest) });
        let chains: Vec<Value> = self.verifier.last_keys().into_iter().map(chain).collect();
        let mut object = counted(self.counts());
        object["first_page"] = json!(calendar(self.first));
        object["last_page"] = json!(calendar(self.last));
        object["satellites"] = json!(self.satellites);
        object["chains"] = json!(chains);
        object["start"] = json!(self.start);
        object["root_after_s"] = json!(self.after_s(self.verifier.first_root()));
        object["first_authentic_after_s"] = json!(self.after_s(self.verifier.first_authentic()));
        object["state"] = json!(self.verifier.state().name());
        object
    }

    /// Reason for which the recording is not authentic as a whole, if there is one.
    pub fn failure(&self) -> Option<String> {
        let (counts, state) = (self.counts(), self.verifier.state());
        if counts.refused() > 0 {
            let parts = [
                (self.tags(None, Outcome::Refused(osnma::report::Refusal::Tag).name()), "tags"),
                (counts.keys_refused, "keys of the chain"),
                (counts.kroot_refused, "DSM-KROOT (forged, or the public key is another)"),
                (counts.pkr_refused, "DSM-PKR (forged, or the Merkle tree is another)"),
            ];
            return Some(format!("refused: {}", listed(parts.into_iter())));
        }
        if self.tags(None, "authentic") > 0 {
            return None;
        }
        let reason = match state {
            State::ClockDisagrees => {
                "the receiver's own time contradicts the pages: see --clock-offset-s and --time-uncertainty-s"
            }
            State::NoKey => {
                "no public key of the Merkle tree was received: expected a longer recording, or --public-key"
            }
            State::KeyVerified => {
                "no root key of the public key was received: expected a longer recording, or the key in force"
            }
            State::DoNotUse => "the system says that its authentication must not be used",
            _ => "no data came with a tag and its key: expected a longer recording",
        };
        Some(format!("no tag is authentic: {reason}"))
    }
}

/// Counts that are not zero, each with its name.
fn listed<'a>(counts: impl Iterator<Item = (u64, &'a str)>) -> String {
    let parts: Vec<String> =
        counts.filter(|(count, _)| *count > 0).map(|(count, name)| format!("{count} {name}")).collect();
    parts.join(", ")
}

/// Calendar of an instant, in whole seconds of GST, which counts as GPS time does.
fn calendar(time: Gst) -> String {
    let epoch = Epoch::from_week(u32::from(time.week()) + GPS_WEEKS, f64::from(time.tow_s()));
    epoch.to_string().split('.').next().unwrap_or_default().to_owned()
}
