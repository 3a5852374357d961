//! Damage where the scene expects errors of any size: no excuse covers it.

use crate::Kind;
use crate::fixes::kind;
use crate::run::Scene;

pub fn kinds() -> Vec<Kind> {
    const DOPPLER: [&str; 1] = ["Doppler error where any is expected, 95 %"];
    vec![
        kind!("signs of all Dopplers, excused", "of 1", Some(1.001), -1.0, &DOPPLER, Bounded, |rx, factor| {
            rx.table("observations").map("doppler_hz", |_, value| factor * value);
        }),
        kind!("one satellite's Doppler, excused", "Hz", Some(20.0), 100.0, &DOPPLER, Bounded, |rx, hz| {
            rx.table("observations").map_where(
                "doppler_hz",
                |t, row| t.text(row, "sv") == "G13",
                |_, value| value + hz,
            );
        }),
        kind!(
            "velocities, excused",
            "m/s",
            Some(5.0),
            100.0,
            &["velocity error where any is expected, 95 %"],
            Bounded,
            |rx, mps| rx.table("fixes").map("vx_mps", |_, value| value + mps)
        ),
        kind!(
            "sigmas of fixes, excused",
            "of 1",
            Some(1.1),
            100.0,
            &["horizontal sigma over the expected one, largest"],
            Bounded,
            |rx, factor| {
                for name in ["sigma_east_m", "sigma_north_m", "sigma_up_m", "sigma_clock_m"] {
                    rx.table("fixes").map(name, |_, value| factor * value);
                }
            }
        ),
        kind!(
            "dilutions, excused",
            "of 1",
            Some(1.001),
            2.0,
            &["dilutions and condition against the true geometry, largest difference"],
            Bounded,
            |rx, factor| {
                for name in ["gdop", "pdop", "hdop", "vdop", "tdop"] {
                    rx.table("fixes").map(name, |_, value| factor * value);
                }
            }
        ),
        kind!(
            "one satellite's code, excused",
            "m",
            Some(50.0),
            300.0,
            &["code error where any is expected, 95 %"],
            Bounded,
            |rx, m| {
                let one = |table: &crate::table::Table, row: usize| table.text(row, "sv") == "G13";
                let table = rx.table("observations");
                table.map_where("pseudorange_m", one, |_, value| value + m);
                table.map_where("sent_fraction_s", one, |_, value| value - m / 299_792_458.0);
            }
        ),
    ]
}
