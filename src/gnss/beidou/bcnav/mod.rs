//! Parts that the messages of B1C, B2a and B2b share: blocks of fields, and ephemerides that are derived from
//! D1. B2a and B2b also share messages of one length with a type each.
//!
//! Sources: BDS-SIS-ICD-B1C 1.0, BDS-SIS-ICD-B2a 1.0 and BDS-SIS-ICD-B2b 1.0, section 7. An ephemeris of D1
//! is carried to the nearest reference time that the messages can express, and to their steps. Group delays,
//! all against B3I, are those that a file has of the signal's own message; without them those of the three
//! signals follow from D1's as delays that are as 1/f². A signal is sent with the delay of its pilot; the
//! correction of its data is the satellite's, and who follows the data alone meets what real satellites have
//! between the two.
//!
//! Nine coefficients of BDGIM that are all zero are none: they are sent where the scene has none, and are not
//! reported.
//!
//! Limits: nothing of other systems and of the Earth's orientation; almanacs are sent in B-CNAV1 alone, and
//! none is read; nothing of UTC is read.

pub(super) mod blocks;
pub(super) mod typed;

use crate::bdgim::Bdgim;
use crate::beidou::d1d2::{D1_SETS, issue};
use crate::bits::{self, Field, FieldError, Store, integers};
use crate::broadcast::{Ephemeris, SetForm};
use crate::exchange::modern;
use crate::ionosphere::{Coefficients, Model};
use crate::message::{Common, IonosphereForm, Parameters, Raw, RecordLine, UtcNumbers, raw_of};
use crate::set_tables::{Conversions, SetTables};
use crate::signal::Signal;
use crate::time::{BDT, BDT_WEEK, Epoch, WEEK_S};
use blocks::{Content, Of, STEP_S, electrons, kind, signed};

/// Fields of BDGIM's coefficients, their positions counted from the first of them.
static ELECTRONS: [Of; 9] = electrons::<0>();

/// Ionosphere content of the messages. `unit` is true for the units that carry it.
pub(super) const fn ionosphere(unit: fn(Epoch) -> bool) -> IonosphereForm {
    IonosphereForm { model: Model::Bdgim, unit, coefficients }
}

/// The coefficients that raw integers give; `None` where one is missing or all are zero.
pub(super) fn coefficients(raw: Raw<'_>) -> Option<Coefficients> {
    let mut alpha_tecu = [0.0; 9];
    for (place, (alpha, element)) in alpha_tecu.iter_mut().zip(&ELECTRONS).enumerate() {
        *alpha = signed(place, element.field.value(raw(element.field.name)?));
    }
    Bdgim::given(alpha_tecu).map(Coefficients::Bdgim)
}

/// The coefficients of BDGIM among the parameters of a unit, with their raw integers.
pub(super) fn electrons_in(all: &Parameters) -> Option<(Coefficients, Parameters)> {
    let raw = |name: &str| raw_of(all, name);
    let own = all.iter().filter(|(name, _)| ELECTRONS.iter().any(|element| element.field.name == *name));
    Some((coefficients(&raw)?, own.copied().collect()))
}

/// Names of the predicted accuracies, which are of no ephemeris.
const ACCURACIES: [&str; 5] = ["top_5min", "sisai_oe", "sisai_ocb", "sisai_oc1", "sisai_oc2"];

/// The predicted accuracies among the parameters of a unit.
pub(super) fn accuracies_in(all: &Parameters) -> Parameters {
    all.iter().filter(|(name, _)| ACCURACIES.contains(name)).copied().collect()
}

/// Predicted accuracies as they were reported last, and of which issue.
#[derive(Clone, Debug, Default)]
pub(super) struct Accuracies {
    issue: u32,
    said: Parameters,
}

impl Accuracies {
    /// Takes the coefficients of a unit. Returns those of the issue that are new, if any.
    pub fn take(&mut self, issue: u32, found: &Parameters) -> Option<Parameters> {
        if issue != self.issue {
            *self = Self { issue, said: Parameters::new() };
        }
        let new: Parameters = found.iter().filter(|one| !self.said.contains(one)).copied().collect();
        self.said.retain(|(name, _)| !new.iter().any(|(other, _)| other == name));
        self.said.extend(&new);
        (!new.is_empty()).then_some(new)
    }
}

/// Refuses coefficients of BDGIM that the fields cannot carry.
pub(super) fn check(common: &Common) -> Result<(), FieldError> {
    let alpha_tecu = common.bdgim.map_or([0.0; 9], |model| model.alpha_tecu);
    let mut all = ELECTRONS.iter().zip(alpha_tecu).enumerate();
    all.try_for_each(|(place, (element, alpha))| element.field.raw(signed(place, alpha)).map(|_| ()))
}

/// Tables with the parameters of an ephemeris.
pub(super) type Tables = [&'static [Of]];

/// Lists every field by the table that has it.
pub(super) fn fields(all: &[(&'static str, &'static Tables)]) -> Vec<(&'static str, Vec<&'static Field>)> {
    all.iter().map(|(name, tables)| (*name, bits::fields(tables))).collect()
}

/// The lines of a record of RINEX of B-CNAV1 and B-CNAV2 with their delays; predicted accuracies that were
/// not received are blank.
pub(super) fn record_lines(set: &Ephemeris, raw: Raw<'_>, delays: RecordLine) -> Vec<RecordLine> {
    let mut lines = first_lines(set, raw);
    let [accuracy, health, flags] = status(raw);
    lines.push(delays);
    lines.push([accuracy, health, flags, Some(f64::from(set.iodc))]);
    lines.push([Some(modern::transmitted_s(set)), None, None, Some(f64::from(set.iode))]);
    lines
}

/// RINEX record lines of B-CNAV3, which has one delay and no issues.
pub(super) fn record_lines_of_b2b(set: &Ephemeris, raw: Raw<'_>) -> Vec<RecordLine> {
    let mut lines = first_lines(set, raw);
    let [accuracy, health, flags] = status(raw);
    lines.push([accuracy, health, flags, Some(set.tgd_s)]);
    lines.push([Some(modern::transmitted_s(set)), None, None, None]);
    lines
}

/// Orbit and accuracies.
fn first_lines(set: &Ephemeris, raw: Raw<'_>) -> Vec<RecordLine> {
    let mut lines = modern::orbit(set, Some(set.toe.tow_s()));
    let kind = raw("orbit_kind").map(|raw| raw as f64);
    let [top, along, clock @ ..] = ACCURACIES.map(|name| raw(name).map(|raw| raw as f64));
    lines.push([Some(set.idot_radps), Some(set.delta_n_rate_radps2), kind, top.map(|steps| STEP_S as f64 * steps)]);
    let [offset, drift, ageing] = clock;
    lines.push([along, offset, drift, ageing]);
    lines
}

/// Accuracy, health and flags of the signal.
fn status(raw: Raw<'_>) -> [Option<f64>; 3] {
    ["sismai", "health", "integrity_flags"].map(|name| raw(name).map(|raw| raw as f64))
}

/// Creates content in which nothing has been decoded.
pub(super) fn blank(set: Ephemeris) -> Content {
    let kind = kind(set.sv);
    let sent = set.toe;
    Content {
        set,
        sent,
        kind,
        page: 0.0,
        flags: 0.0,
        flags_b1c: 0.0,
        utc: UtcNumbers::default(),
        alpha_tecu: [0.0; 9],
        reserved: 0.0,
        accuracies: [0.0; 5],
        toa: sent,
        entries: Default::default(),
    }
}

/// An ephemeris in one of the messages: carried to the nearest multiple of 300 s of BDT, with the delays of
/// the signals that have the first and the second position in that message; `data` are the codes of the
/// message's own signal, data and pilot, whose difference it has too.
pub(super) fn carried(
    set: &Ephemeris,
    form: &'static SetForm,
    signals: &[&Signal],
    data: Option<[&str; 2]>,
) -> Ephemeris {
    if *set.form == *form {
        return set.clone();
    }
    let mut delays_s = signals.iter().map(|signal| set.group_delay_s(signal));
    let apart_s = data.and_then(|codes| {
        let [data_s, pilot_s] = codes.map(|code| set.delay_of_code_s(code));
        Some(data_s? - pilot_s?)
    });
    let own = Ephemeris {
        form,
        tgd_s: delays_s.next().unwrap_or(0.0),
        tgd2_s: delays_s.next().unwrap_or(0.0),
        isc_s: [apart_s.unwrap_or(0.0), 0.0, 0.0, 0.0, 0.0, 0.0],
        signal_delays_s: Vec::new(),
        ..set.clone()
    };
    if *set.form != D1_SETS {
        return own;
    }
    let label_s = BDT.label(set.toe).seconds() as f64;
    let toe = BDT.instant(Epoch::new((label_s / STEP_S as f64).round() as i64 * STEP_S, 0.0));
    let issue = issue(BDT.label(toe).tow_s());
    Ephemeris { iode: issue, iodc: issue, aodo: 0, ..own.carried_to(toe) }
}

/// Parameters that are of a message and not of the ephemeris.
const PASSING: [&str; 3] = ["week", "how_1h", "page"];

/// The raw integers in bits whose tables those are, but those of the message itself.
pub(super) fn integers_in<S: Store>(tables: &Tables, bits: &S) -> Parameters {
    let mut found: Parameters = tables.iter().flat_map(|table| integers(table, bits)).collect();
    found.retain(|(name, _)| !PASSING.contains(name));
    found
}

/// Upper bound of the bits in a subframe or message.
const LONGEST_BITS: usize = 600;

/// Parameters by which ephemerides are distinguished, or that are no ephemeris's.
const FIXED_PARAMETERS: [&str; 9] = [
    "iodc",
    "iode",
    "toe_5min",
    "toc_5min",
    "orbit_kind",
    "reserved",
    "health",
    "integrity_flags",
    "integrity_flags_b1c",
];

/// Fields of the ephemerides of one of the messages.
pub(super) type OfSet = SetTables<Content, Vec<bool>>;

/// Tables of the ephemerides that `quantised` rounds ([`rounded`]).
pub(super) const fn set_tables(
    sets: &'static SetForm,
    parts: &'static Tables,
    quantised: fn(&OfSet, &Ephemeris) -> Result<Ephemeris, FieldError>,
) -> OfSet {
    let content: Conversions<Content> = (blank, |content| content.set);
    let of = SetTables::of(sets, parts, || vec![false; LONGEST_BITS], content);
    SetTables { passing: &PASSING, fixed: &[&FIXED_PARAMETERS, &PASSING], quantised, ..of }
}

/// The ephemeris, its times GPS time, that a receiver decodes when that one is sent.
pub(super) fn rounded(tables: &OfSet, carried: Ephemeris) -> Result<Ephemeris, FieldError> {
    let decoded = tables.rounded(carried.timed(|at| BDT.label(at)))?;
    Ok(decoded.timed(|label| BDT.instant(label)))
}
/// Transmission time of a message that began at a second of the BDT week. The lower bits of its week and a
/// time near it resolve the week.
pub(super) fn sent_at(week: i64, of_week_s: i64, near: Epoch) -> Epoch {
    Epoch::new(near.nearest_week(week + BDT_WEEK, 8192) * WEEK_S + of_week_s, 0.0)
}

#[cfg(test)]
mod tests;
