//! QZSS messages that reuse a GPS message: ephemerides and readers under QZSS's own message names.

use crate::bits::FieldError;
use crate::broadcast::{Ephemeris, SetForm};
use crate::gps;
use crate::message::{Message, Raw, Read, Reader, SetFields};
use crate::qzss::{civil, l1c, l1ca, l2c, l5, lnav};
use crate::record::NavigationRow;
use crate::satellite::Sv;
use crate::signal::Signal;
use crate::time::Epoch;

/// Signals of QZSS with those of GPS that they are like.
static SIGNALS: [(&Signal, &Signal); 4] = [
    (&l1ca::L1_CA, &gps::l1ca::L1_CA),
    (&l1c::L1C, &gps::l1c::L1C),
    (&l2c::L2C, &gps::l2c::L2C),
    (&l5::L5, &gps::l5::L5),
];

/// Forms of ephemerides likewise.
static FORMS: [(&SetForm, &SetForm); 3] = [
    (&lnav::LNAV_SETS, &gps::lnav::LNAV_SETS),
    (&civil::CNAV_SETS, &gps::cnav::CNAV_SETS),
    (&civil::CNAV2_SETS, &gps::cnav2::CNAV2_SETS),
];

/// The signal of GPS that one of QZSS is like; of another system that itself.
pub(super) fn like(signal: &Signal) -> &Signal {
    SIGNALS.iter().find(|(own, _)| *own == signal).map_or(signal, |(_, gps)| gps)
}

/// An ephemeris as GPS names its form.
pub(super) fn as_gps(set: &Ephemeris) -> Ephemeris {
    let form = FORMS.iter().find(|(own, _)| *own == set.form).map_or(set.form, |(_, gps)| gps);
    Ephemeris { form, ..set.clone() }
}

/// An ephemeris as a message of QZSS names its form.
pub(super) fn named(set: Ephemeris, message: &Message) -> Ephemeris {
    Ephemeris { form: message.sets, ..set }
}

/// Fields of the ephemerides of a message of GPS, which are of one of QZSS.
pub(super) struct OwnFields {
    pub gps: &'static Message,
    pub message: &'static Message,
}

impl OwnFields {
    fn as_gps(&self, set: &Ephemeris) -> Ephemeris {
        as_gps(&(self.message.form)(set))
    }
}

impl SetFields for OwnFields {
    fn parameters(&self) -> Vec<&'static str> {
        self.gps.fields.parameters()
    }

    fn elements(&self, sv: Sv, raw: Raw<'_>, near: Epoch) -> Option<Ephemeris> {
        self.gps.fields.elements(sv, raw, near).map(|set| named(set, self.message))
    }

    fn quantised(&self, set: &Ephemeris) -> Result<Ephemeris, FieldError> {
        self.gps.fields.quantised(&self.as_gps(set)).map(|set| named(set, self.message))
    }

    fn adjustable(&self) -> Vec<&'static str> {
        self.gps.fields.adjustable()
    }

    fn adjust(&self, set: &mut Ephemeris, parameter: &str, by: f64) -> bool {
        let mut own = self.as_gps(set);
        let found = self.gps.fields.adjust(&mut own, parameter, by);
        *set = named(own, self.message);
        found
    }
}

/// The reader of a message of GPS, whose ephemerides are of one of QZSS.
#[derive(Debug)]
pub(super) struct OwnReader {
    reader: Box<dyn Reader>,
    message: &'static Message,
}

impl OwnReader {
    pub fn boxed(gps: &Message, message: &'static Message, sv: Sv) -> Box<dyn Reader> {
        Box::new(Self { reader: (gps.reader)(sv), message })
    }
}

impl Reader for OwnReader {
    fn take(&mut self, soft: f32, near: Epoch) -> Vec<Read> {
        let renamed = |row| NavigationRow { message: self.message.name.to_owned(), ..row };
        let own = |read| match read {
            Read::Ephemeris(set) => Read::Ephemeris(Box::new(named(*set, self.message))),
            Read::Parameters(rows) => Read::Parameters(rows.into_iter().map(renamed).collect()),
            other => other,
        };
        self.reader.take(soft, near).into_iter().map(own).collect()
    }

    fn skip(&mut self) {
        self.reader.skip();
    }

    fn doubt(&mut self) {
        self.reader.doubt();
    }

    fn missing(&self) -> Vec<u8> {
        self.reader.missing()
    }
}
