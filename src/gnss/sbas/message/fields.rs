//! The field tables of SBAS's messages: positions count from 0, the first bit of a message (RTCA DO-229D,
//! A.4.4.11 and A.4.4.15). Steps of positions, velocities and accelerations are no powers of two: fields
//! count them.

use super::NetworkTime;
use crate::bits::Kind::{Signed, Whole};
use crate::bits::{Element, Field, element, fields, plain};
use crate::broadcast::{Ephemeris, StateVector};
use crate::time::Epoch;

const GEO_CLAUSE: &str = "A.4.4.11, table A-18";
const TIME_CLAUSE: &str = "A.4.4.15, table A-20";

/// Steps in the plane of the equator and across it.
const PLACE_M: [f64; 2] = [0.08, 0.4];
const SPEED_MPS: [f64; 2] = [0.000_625, 0.004];
const PULL_MPS2: [f64; 2] = [0.000_012_5, 0.000_062_5];
/// Seconds of the steps in which the reference time counts.
const STEP_S: i64 = 16;
const DAY_S: i64 = 86_400;

type Of = Element<Ephemeris>;

/// Number of the step of the day at which a reference time is.
pub(crate) fn step_of_day(at: Epoch) -> i64 {
    at.seconds().rem_euclid(DAY_S) / STEP_S
}

/// The time of that step of a day nearest to `near`.
fn at_step(near: Epoch, step: i64) -> Epoch {
    let ahead_s = (step * STEP_S - near.seconds() + DAY_S / 2).rem_euclid(DAY_S) - DAY_S / 2;
    Epoch::new(near.seconds() + ahead_s, 0.0)
}

fn vector(set: &Ephemeris) -> StateVector {
    set.vector.unwrap_or_default()
}

fn change(set: &mut Ephemeris, change: impl FnOnce(&mut StateVector)) {
    change(set.vector.get_or_insert_default());
}

macro_rules! axis {
    ($name:literal, $place:literal, $bits:literal, $of:ident, $axis:ident, $step:expr) => {
        element(
            Field::new($name, &[($place, $bits)], Signed, 0, GEO_CLAUSE),
            |set| vector(set).$of.$axis / $step,
            |set, steps| change(set, |vector| vector.$of.$axis = steps * $step),
        )
    };
}

/// Type 9: the satellite's position. An ephemeris is numbered by its reference time.
#[rustfmt::skip]
pub(super) static GEO: [Of; 14] = [
    element(Field::new("iodn", &[(14, 8)], Whole, 0, GEO_CLAUSE),
        |set| f64::from(set.aodo), |set, value| set.aodo = value as u8),
    element(Field::new("t0_16s", &[(22, 13)], Whole, 0, GEO_CLAUSE),
        |set| step_of_day(set.toe) as f64,
        |set, step| {
            set.toe = at_step(set.toe, step as i64);
            set.toc = set.toe;
            (set.iode, set.iodc) = (step as u16, step as u16);
        }),
    element(Field::new("ura_index", &[(35, 4)], Whole, 0, GEO_CLAUSE),
        |set| f64::from(set.ura_index), |set, value| set.ura_index = value as u8),
    axis!("x_8cm", 39, 30, position_m, x, planted!("gnss.sbas.place", PLACE_M[0], PLACE_M[1])),
    axis!("y_8cm", 69, 30, position_m, y, PLACE_M[0]),
    axis!("z_40cm", 99, 25, position_m, z, PLACE_M[1]),
    axis!("vx_0625umps", 124, 17, velocity_mps, x, SPEED_MPS[0]),
    axis!("vy_0625umps", 141, 17, velocity_mps, y, SPEED_MPS[0]),
    axis!("vz_4mmps", 158, 18, velocity_mps, z, SPEED_MPS[1]),
    axis!("ax_12500nmps2", 176, 10, acceleration_mps2, x, PULL_MPS2[0]),
    axis!("ay_12500nmps2", 186, 10, acceleration_mps2, y, PULL_MPS2[0]),
    axis!("az_62500nmps2", 196, 10, acceleration_mps2, z, PULL_MPS2[1]),
    plain!("af0_s", [(206, 12)], Signed, -31, GEO_CLAUSE, af0_s),
    plain!("af1_sps", [(218, 8)], Signed, -40, GEO_CLAUSE, af1_sps),
];

/// Type 12: the network's time. That UTC is not given is said by its own number.
#[rustfmt::skip]
pub(super) static TIME: [Element<NetworkTime>; 3] = [
    plain!("utc_standard", [(118, 3)], Whole, 0, TIME_CLAUSE, utc_standard),
    plain!("tow_s", [(121, 20)], Whole, 0, TIME_CLAUSE, tow_s),
    plain!("week", [(141, 10)], Whole, 0, TIME_CLAUSE, week),
];

/// Lists every field by the message that carries it.
pub fn tables() -> Vec<(&'static str, Vec<&'static Field>)> {
    let own = vec![("type 9", fields(&[&GEO])), ("type 12", fields(&[&TIME]))];
    own.into_iter().chain(super::corrections::tables()).chain(super::bounds::tables()).collect()
}
