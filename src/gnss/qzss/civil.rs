//! CNAV and CNAV-2 as QZSS sends them: the messages of GPS, whose elements count from another semi-major
//! axis.
//!
//! Source: IS-QZSS-PNT-005, 4.3 (CNAV) and 4.2 (CNAV-2). The number in CNAV is that of the satellite, in
//! CNAV-2 that of its codes; bits of health are those of LNAV by signal. Limits: messages are those of
//! GPS in their order (10, 11, 30, 33; pages 1, 3 and 4). Real satellites send 60 and 61 and page 61 for
//! Japan, 32, 37, and others.

use crate::broadcast::{Ephemeris, SetForm};
use crate::gps::{cnav, cnav2};
use crate::message::{Common, Message};
use crate::qzss::lnav::{LNAV_SETS, unhealthy};
use crate::qzss::own::{OwnFields, OwnReader, as_gps, like, named};
use crate::satellite::System;

/// Definition of CNAV for L5 of QZSS.
pub static CNAV: Message = Message {
    name: "CNAV of QZSS",
    sender: |common| Ok(cnav::sender(common, &CNAV)),
    fields: &OwnFields { gps: &cnav::CNAV, message: &CNAV },
    reader: |sv| OwnReader::boxed(&cnav::CNAV, &CNAV, sv),
    form: |set| form(set, &cnav::CNAV, &CNAV),
    sets: &CNAV_SETS,
    ..cnav::CNAV
};

/// CNAV as L2C of QZSS names it. Its ephemerides are those of CNAV on L5.
pub static CNAV_L2C: Message = Message {
    name: "CNAV of QZSS on L2C",
    sender: |common| Ok(cnav::sender(common, &CNAV_L2C)),
    fields: CNAV.fields,
    reader: |sv| OwnReader::boxed(&cnav::CNAV_L2C, &CNAV_L2C, sv),
    form: CNAV.form,
    sets: &CNAV_SETS,
    ..cnav::CNAV_L2C
};

/// Definition of CNAV-2 for L1C of QZSS.
pub static CNAV2: Message = Message {
    name: "CNAV-2 of QZSS",
    // Almanacs have health by carrier, as CNAV has.
    sender: |common| {
        let almanac = common.almanac.iter().map(|set| match set.sv.system {
            System::Qzss => as_gps(&(CNAV.form)(set)),
            _ => set.clone(),
        });
        (cnav2::CNAV2.sender)(&Common { almanac: almanac.collect(), ..common.clone() })
    },
    fields: &OwnFields { gps: &cnav2::CNAV2, message: &CNAV2 },
    reader: |sv| OwnReader::boxed(&cnav2::CNAV2, &CNAV2, sv),
    form: |set| form(set, &cnav2::CNAV2, &CNAV2),
    sets: &CNAV2_SETS,
    ..cnav2::CNAV2
};

/// Meaning of clock and health in ephemerides of CNAV.
pub static CNAV_SETS: SetForm = SetForm {
    name: "CNAV of QZSS",
    group_delay_s: |set, signal| (cnav::CNAV_SETS.group_delay_s)(set, like(signal)),
    serves: |signal| (cnav::CNAV_SETS.serves)(like(signal)),
    healthy: |set, signal| (cnav::CNAV_SETS.healthy)(set, like(signal)),
    ..cnav::CNAV_SETS
};

/// Meaning of clock and health in ephemerides of CNAV-2.
pub static CNAV2_SETS: SetForm = SetForm {
    name: "CNAV-2 of QZSS",
    group_delay_s: |set, signal| (cnav2::CNAV2_SETS.group_delay_s)(set, like(signal)),
    serves: |signal| (cnav2::CNAV2_SETS.serves)(like(signal)),
    healthy: |set, signal| (cnav2::CNAV2_SETS.healthy)(set, like(signal)),
    ..cnav2::CNAV2_SETS
};

/// Converts an ephemeris of LNAV to the form of one of these messages, by way of the GPS message.
fn form(set: &Ephemeris, gps: &Message, message: &Message) -> Ephemeris {
    if set.form == message.sets {
        return set.clone();
    }
    let made = (gps.form)(&as_gps(set));
    let [l1, l2, l5, l1c] = unhealthy(set);
    let bits = if *message.sets == CNAV2_SETS { vec![l1c] } else { vec![l1, l2, l5] };
    let of_lnav = bits.into_iter().rev().fold(0, |all, bad| all << 1 | u16::from(bad));
    let health = if *set.form == LNAV_SETS { of_lnav } else { made.health };
    Ephemeris { health, ..named(made, message) }
}
