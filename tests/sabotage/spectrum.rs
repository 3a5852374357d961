//! Damage to the spectrum of the samples: 2.6 Msps of noise and GPS L1 C/A.

use crate::Kind;
use crate::fixes::kind;
use crate::run::{Rx, Scene};

const LEVEL: [&str; 1] = ["level of the samples over the expected one"];
const BROAD: [&str; 1] = ["spectrum of the samples, a thirty-second of the band, largest error"];
const NARROW: [&str; 1] = ["spectrum of the samples, one bin, largest error"];

/// Multiplies the density by a function of the frequency in megahertz.
fn times(rx: &mut Rx, factor: impl Fn(f64) -> f64) {
    let psd = rx.psd();
    for row in 0..psd.rows.len() {
        let (mhz, density_db) = (psd.get(row, "frequency_hz") / 1e6, psd.get(row, "density_db"));
        psd.put(row, "density_db", density_db + 10.0 * libm::log10(factor(mhz)));
    }
}

fn from_db(db: f64) -> f64 {
    libm::pow(10.0, db / 10.0)
}

/// sinc² of a lobe.
fn lobe(x: f64) -> f64 {
    let turn = std::f64::consts::PI * x;
    if turn.abs() < 1e-9 { 1.0 } else { (libm::sin(turn) / turn).powi(2) }
}

pub fn kinds() -> Vec<Kind> {
    vec![
        kind!("level of the samples high", "dB", Some(0.005), 0.5, &LEVEL, AtRest, |rx, db| times(rx, |_| from_db(db))),
        kind!("level of the samples low", "dB", Some(0.005), 0.05, &LEVEL, AtRest, |rx, db| times(rx, |_| from_db(
            -db
        ))),
        kind!("spectrum tilted", "dB over the band", Some(0.05), 0.7, &BROAD, AtRest, |rx, db| times(rx, |mhz| {
            from_db(db * mhz / 2.6)
        })),
        kind!(
            "band's edges filtered where no filter is",
            "dB at the edges",
            Some(0.05),
            0.66,
            &BROAD,
            AtRest,
            |rx, db| {
                times(rx, |mhz| 1.0 / (1.0 + (from_db(db) - 1.0) * libm::pow(mhz / 1.3, 8.0)));
            }
        ),
        kind!("notch of 80 kHz", "dB", Some(0.02), 0.5, &BROAD, AtRest, |rx, db| times(rx, |mhz| {
            if (mhz - 0.53).abs() < 0.04 { from_db(-db) } else { 1.0 }
        })),
        kind!("lobe of a strange signal aliased in", "of the noise", Some(0.003), 0.08, &BROAD, AtRest, |rx, share| {
            times(rx, |mhz| 1.0 + share * lobe((mhz - 0.8) / 0.511));
        }),
        kind!("satellites' lobe missing", "of the noise", Some(0.003), 0.08, &LEVEL, AtRest, |rx, share| {
            times(rx, |mhz| 1.0 - share * lobe(mhz / 1.023));
        }),
        kind!("line in one bin", "dB", Some(0.2), 2.5, &NARROW, AtRest, |rx, db| {
            let psd = rx.psd();
            let density_db = psd.get(1400, "density_db");
            psd.put(1400, "density_db", density_db + db);
        }),
    ]
}
