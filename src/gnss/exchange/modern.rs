//! Lines of the records of messages whose ephemerides have rates of the axis and of the mean motion.
//!
//! Source: RINEX 4.02, sections 5.4.2 (CNAV), 5.4.3 (CNAV-2) and 5.4.8 to 5.4.10 (B-CNAV1 to 3). The
//! reference time of the clock, with which a record begins, is that of the orbit too where the record has no
//! other.

use crate::broadcast::Ephemeris;
use crate::message::{Raw, RecordLine};
use crate::time::WEEK_S;

/// The four lines of the orbit; the third begins with a time of its own.
pub fn orbit(set: &Ephemeris, time_s: Option<f64>) -> Vec<RecordLine> {
    let line = |values: [f64; 4]| values.map(Some);
    vec![
        line([set.axis_rate_mps, set.crs_m, set.delta_n_radps, set.m0_rad]),
        line([set.cuc_rad, set.eccentricity, set.cus_rad, set.sqrt_a_sqrtm]),
        [time_s, Some(set.cic_rad), Some(set.omega0_rad), Some(set.cis_rad)],
        line([set.i0_rad, set.crc_m, set.omega_rad, set.omega_dot_radps]),
    ]
}

/// A delay of which its field's least value states that it is not available (IS-GPS-705J, 20.3.3.3.1.1).
const NOT_AVAILABLE_S: f64 = -4096.0 / (1_u64 << 35) as f64;

/// Seconds of the week of the reference time at which an ephemeris was sent, before it too.
pub fn transmitted_s(set: &Ephemeris) -> f64 {
    set.transmitted.since(set.toe) + set.toe.tow_s()
}

/// Record lines of CNAV and CNAV-2: time and week of the prediction, accuracies of clock and orbit, the group
/// delay, and the corrections of `delays`. Corrections have one line for every four. `health` is that of the
/// record.
pub fn of_gps(set: &Ephemeris, raw: Raw<'_>, health: u16, delays: &[usize]) -> Vec<RecordLine> {
    let value = |name: &str| raw(name).map(|raw| raw as f64);
    // Five bits, of which the highest is the sign.
    let sign = planted!("gnss.exchange.accuracy", 16, 32);
    let accuracy = raw("ura_ed_index").map(|raw| if raw >= sign { raw - 32 } else { raw } as f64);
    // Weeks by their lowest eight bits, that nearest to the ephemeris.
    let week = raw("op_week").map(|low| {
        let near = set.toe.week();
        (near + (low - near + 128).rem_euclid(256) - 128) as f64
    });
    let top_s = value("top_5min").map(|steps| (300.0 * steps).rem_euclid(WEEK_S as f64));
    let mut lines = orbit(set, top_s);
    lines.push([Some(set.idot_radps), Some(set.delta_n_rate_radps2), value("ura_ned0_index"), value("ura_ned1_index")]);
    lines.push([accuracy, Some(f64::from(health)), Some(set.tgd_s), value("ura_ned2_index")]);
    for four in delays.chunks(4) {
        let mut line = [None; 4];
        for (field, delay) in line.iter_mut().zip(four) {
            *field = set.isc_s.get(*delay).copied().filter(|delay_s| *delay_s > NOT_AVAILABLE_S);
        }
        lines.push(line);
    }
    let flags = value("integrity_flags").or(value("integrity_flag"));
    lines.push([Some(transmitted_s(set)), week, flags, None]);
    lines
}
