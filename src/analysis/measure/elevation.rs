//! Errors of observations by satellite and by elevation, and the multipath combination of one frequency.
//!
//! Code minus carrier is free of orbits, clocks and the troposphere; it holds code noise, multipath, a
//! constant and twice the ionosphere, which the truth gives and which is taken out here: M = P − λφ − 2I,
//! each arc about its mean, each signal with its own carrier. It is what a user of one frequency can see of
//! multipath, and beside it is what only the truth shows, the code's error. Bands of elevation are ten
//! degrees wide; errors in them are without the epoch's common part of their signal.

use std::collections::{BTreeMap, HashMap};

use serde::Serialize;

use crate::analysis::error::JudgeError;
use crate::analysis::measure::errors::{Errors, Link, SignalError};
use crate::analysis::read::Run;
use crate::analysis::statistics::{Sum, mean, percentile, rms, std};
use crate::gnss::satellite::Sv;

/// Width of a band of elevation.
const BAND_DEG: f64 = 10.0;

/// One observation: a row of `multipath.csv`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Point {
    /// Seconds from sample 0 by the receiver's clock.
    pub time_s: f64,
    /// Elevation of the satellite, degrees.
    pub elevation_deg: f64,
    /// Without the epoch's common part of its signal; none of the only satellite of an epoch.
    pub code_m: Option<f64>,
    /// Error of the carrier without its arc's constant, cycles.
    pub carrier_cycles: f64,
    /// Error of the Doppler, Hz.
    pub doppler_hz: f64,
    /// Measured minus expected.
    pub cn0_db: f64,
    /// Code minus carrier without twice the ionosphere, about its arc's mean.
    pub multipath_m: f64,
}

/// One satellite: a row of `satellites.csv`.
#[derive(Clone, Debug, Serialize)]
pub struct Satellite {
    /// The satellite.
    pub sv: Sv,
    /// Name of the signal.
    pub signal: &'static str,
    /// Number of observations.
    pub observations: usize,
    /// Its mean elevation, degrees.
    pub elevation_mean_deg: Option<f64>,
    /// Mean of its code errors, metres.
    pub code_mean_m: Option<f64>,
    /// Standard deviation of the code errors, metres.
    pub code_sigma_m: Option<f64>,
    /// Standard deviation of the carrier errors, cycles.
    pub carrier_sigma_cycles: Option<f64>,
    /// Mean of its Doppler errors, Hz.
    pub doppler_mean_hz: Option<f64>,
    /// Standard deviation of the Doppler errors, Hz.
    pub doppler_sigma_hz: Option<f64>,
    /// Mean error of C/N0, dB.
    pub cn0_bias_db: Option<f64>,
    /// Standard deviation of the C/N0 errors, dB.
    pub cn0_sigma_db: Option<f64>,
    /// Root mean square of the multipath combination, metres.
    pub multipath_rms_m: Option<f64>,
}

/// A band of elevation: a row of `elevation.csv`.
#[derive(Clone, Debug, Serialize)]
pub struct Band {
    /// Lower edge, degrees.
    pub from_deg: f64,
    /// Upper edge, degrees.
    pub to_deg: f64,
    /// Number of observations.
    pub observations: usize,
    /// Root mean square of the code errors, metres.
    pub code_rms_m: Option<f64>,
    /// Code error that 95 % stay below, metres.
    pub code_p95_m: Option<f64>,
    /// Root mean square of the carrier errors, cycles.
    pub carrier_rms_cycles: Option<f64>,
    /// Root mean square of the Doppler errors, Hz.
    pub doppler_rms_hz: Option<f64>,
    /// Mean error of C/N0, dB.
    pub cn0_bias_db: Option<f64>,
    /// Root mean square of the multipath combination, metres.
    pub multipath_rms_m: Option<f64>,
}

/// What all points come to.
#[derive(Clone, Debug, Default)]
pub struct Elevations {
    /// Every satellite's signal.
    pub satellites: Vec<Satellite>,
    /// Those that have observations, from the horizon up.
    pub bands: Vec<Band>,
}

/// The points of a satellite.
///
/// # Errors
/// [`JudgeError::Read`] where spilled rows cannot be read.
pub fn points(run: &Run, errors: &Errors, link: Link) -> Result<Vec<Point>, JudgeError> {
    let elevations: HashMap<u64, f64> = run.seen(link.sv, |row| (row.sample, row.elevation_deg))?.into_iter().collect();
    let rows = errors.signals.rows(link)?;
    let one = |(row, multipath_m): (&SignalError, f64)| {
        Some(Point {
            time_s: row.time_s,
            elevation_deg: *elevations.get(&row.sample)?,
            code_m: errors
                .common_m(link.signal, row.sample)
                .filter(|(_, count)| *count > 1)
                .map(|it| row.code_m - it.0),
            carrier_cycles: row.carrier_cycles,
            doppler_hz: row.doppler_hz,
            cn0_db: row.cn0_dbhz - row.cn0_effective_dbhz,
            multipath_m,
        })
    };
    Ok(rows.iter().zip(multipath_m(&link, &rows)).filter_map(one).collect())
}

impl Elevations {
    /// Measures them.
    ///
    /// # Errors
    /// As [`points`].
    pub fn measure(run: &Run, errors: &Errors) -> Result<Self, JudgeError> {
        let mut satellites = Vec::new();
        let mut layers: BTreeMap<i64, Layer> = BTreeMap::new();
        for link in errors.signals.keys() {
            let points = points(run, errors, link)?;
            for point in &points {
                layers.entry((point.elevation_deg / BAND_DEG).floor() as i64).or_default().add(point);
            }
            satellites.push(Satellite::of(link, &points));
        }
        Ok(Self { satellites, bands: layers.into_iter().map(|(number, layer)| layer.band(number)).collect() })
    }
}

impl Satellite {
    fn of(Link { sv, signal }: Link, points: &[Point]) -> Self {
        let of = |of: fn(&Point) -> f64| points.iter().map(of).collect::<Vec<f64>>();
        let code: Vec<f64> = points.iter().filter_map(|point| point.code_m).collect();
        let (doppler, cn0) = (of(|p| p.doppler_hz), of(|p| p.cn0_db));
        Self {
            sv,
            signal: signal.name,
            observations: points.len(),
            elevation_mean_deg: mean(&of(|p| p.elevation_deg)),
            code_mean_m: mean(&code),
            code_sigma_m: std(&code),
            carrier_sigma_cycles: std(&of(|p| p.carrier_cycles)),
            doppler_mean_hz: mean(&doppler),
            doppler_sigma_hz: std(&doppler),
            cn0_bias_db: mean(&cn0),
            cn0_sigma_db: std(&cn0),
            multipath_rms_m: rms(&of(|p| p.multipath_m)),
        }
    }
}

/// A band in the making.
#[derive(Default)]
struct Layer {
    observations: usize,
    /// For the one figure that needs all values.
    code_m: Vec<f64>,
    carrier_cycles: Sum,
    doppler_hz: Sum,
    cn0_db: Sum,
    multipath_m: Sum,
}

impl Layer {
    fn add(&mut self, point: &Point) {
        self.observations += 1;
        self.code_m.extend(point.code_m);
        self.carrier_cycles.add(point.carrier_cycles);
        self.doppler_hz.add(point.doppler_hz);
        self.cn0_db.add(point.cn0_db);
        self.multipath_m.add(point.multipath_m);
    }

    fn band(self, number: i64) -> Band {
        let magnitudes: Vec<f64> = self.code_m.iter().map(|code_m| code_m.abs()).collect();
        Band {
            from_deg: number as f64 * BAND_DEG,
            // A table may hold any elevation.
            to_deg: (number as f64 + 1.0) * BAND_DEG,
            observations: self.observations,
            code_rms_m: rms(&self.code_m),
            code_p95_m: percentile(&magnitudes, 0.95),
            carrier_rms_cycles: self.carrier_cycles.rms(),
            doppler_rms_hz: self.doppler_hz.rms(),
            cn0_bias_db: self.cn0_db.mean(),
            multipath_rms_m: self.multipath_m.rms(),
        }
    }
}

/// P − λφ − 2I of each row, about the mean of its arc. Errors are against the truth, whose code minus carrier
/// is 2I and a constant, so that their difference is the combination already.
fn multipath_m(link: &Link, rows: &[SignalError]) -> Vec<f64> {
    let mut found = Vec::with_capacity(rows.len());
    for arc in rows.chunk_by(|a, b| b.locked_s > a.locked_s) {
        let combined: Vec<f64> = arc.iter().map(|row| row.code_m - row.carrier_cycles * link.wavelength_m()).collect();
        let middle = mean(&combined).unwrap_or(0.0);
        found.extend(combined.into_iter().map(|value| value - middle));
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gnss::gps::l1ca::L1_CA;

    #[test]
    fn bands_part_errors_by_elevation_and_the_clock_is_no_error() {
        let row = |sample: u64, code_m: f64, carrier_cycles: f64| SignalError {
            sample,
            time_s: sample as f64,
            code_m,
            carrier_cycles,
            raw_cycles: carrier_cycles,
            doppler_hz: 0.5,
            cn0_dbhz: 44.0,
            cn0_true_dbhz: 45.0,
            cn0_effective_dbhz: 44.5,
            locked_s: sample as f64,
        };
        let link = L1_CA.link(Sv::gps(3));
        let rows = vec![row(1, 101.0, 0.0), row(2, 103.0, 0.0)];
        assert_eq!(multipath_m(&link, &rows), vec![-1.0, 1.0]);
        let point = |elevation_deg: f64, code_m: f64| Point {
            time_s: 0.0,
            elevation_deg,
            code_m: Some(code_m),
            carrier_cycles: 0.0,
            doppler_hz: 0.0,
            cn0_db: -0.5,
            multipath_m: code_m,
        };
        let points = [point(5.0, 3.0), point(8.0, -3.0), point(42.0, 1.0)];
        let (mut low, mut high) = (Layer::default(), Layer::default());
        points[..2].iter().for_each(|point| low.add(point));
        high.add(&points[2]);
        let bands = [low.band(0), high.band(4)];
        assert_eq!((bands[0].from_deg, bands[0].observations, bands[1].to_deg), (0.0, 2, 50.0));
        assert_eq!((bands[0].code_rms_m, bands[1].cn0_bias_db), (Some(3.0), Some(-0.5)));
        assert!((Satellite::of(link, &points).code_mean_m.unwrap() - 1.0 / 3.0).abs() < 1e-12);
    }
}
