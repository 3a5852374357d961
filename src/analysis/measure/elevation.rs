//! Errors of observations by satellite and by elevation, and the multipath combination of one frequency.
//!
//! Code minus carrier is free of orbits, clocks and the troposphere; it holds code noise, multipath, a
//! constant and twice the ionosphere, which the truth gives and which is taken out here: M = P − λφ − 2I,
//! each arc about its mean, each signal with its own carrier. It is what a user of one frequency can see of
//! multipath, and beside it is what only the truth shows, the code's error. Bands of elevation are ten
//! degrees wide; errors in them are without the epoch's common part of their signal.

use std::collections::BTreeMap;
use std::path::Path;

use serde::Serialize;

use crate::error::JudgeError;
use crate::expect::stated::Stated;
use crate::measure::errors::{Errors, Link, SignalError};
use crate::read::{Numbers, Run};
use crate::statistics::Sum;
use gnss::satellite::Sv;

/// Width of a band of elevation.
const BAND_DEG: f64 = 10.0;

/// One observation: a row of `multipath.csv`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Point {
    /// Seconds from sample 0 by the receiver's clock.
    pub time_s: f64,
    /// Elevation of the satellite, degrees.
    pub elevation_deg: f64,
    /// Code error in metres without the epoch's common part of its signal; `None` for the only satellite of
    /// an epoch.
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
    /// Mean elevation of the satellite, degrees.
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

/// Statistics of all points.
#[derive(Clone, Debug, Default)]
pub struct Elevations {
    /// Every satellite's signal.
    pub satellites: Vec<Satellite>,
    /// Bands that have observations, from the horizon up.
    pub bands: Vec<Band>,
}

/// Shows `see` the points of a satellite.
///
/// # Errors
/// [`JudgeError::Read`] where spilled rows cannot be read, and those of `see`.
pub fn points(
    run: &Run,
    (errors, stated): (&Errors, &Stated),
    link: Link,
    mut see: impl FnMut(Point) -> Result<(), JudgeError>,
) -> Result<(), JudgeError> {
    let Some(mut sky) = run.seen_at(link.sv)? else { return Ok(()) };
    let mut common = errors.common(link.signal)?;
    let mut arcs = Arcs::default();
    errors.signals.each(link, |row| arcs.add(&link, &row))?;
    let mut arcs = arcs.means();
    for row in errors.signals.cursor(link) {
        let row = row?;
        let multipath_m = arcs.departure_m(&link, &row);
        let Some(sky) = sky.get(row.sample) else { continue };
        see(Point {
            time_s: row.time_s,
            elevation_deg: sky.elevation_deg,
            code_m: common.of_several(row.sample).map(|common_m| row.code_m - common_m),
            carrier_cycles: row.carrier_cycles,
            doppler_hz: row.doppler_hz,
            cn0_db: row.cn0_dbhz - stated.expected_dbhz(link, row.cn0_effective_dbhz),
            multipath_m,
        })?;
    }
    Ok(())
}

impl Elevations {
    /// Measures them.
    ///
    /// # Errors
    /// Errors of [`points`].
    pub fn measure(run: &Run, errors: &Errors, stated: &Stated) -> Result<Self, JudgeError> {
        let directory = errors.signals.directory();
        let mut satellites = Vec::new();
        let mut layers: BTreeMap<i64, Layer> = BTreeMap::new();
        for link in errors.signals.keys() {
            let mut values = Values::new(directory);
            points(run, (errors, stated), link, |point| {
                let number = (point.elevation_deg / BAND_DEG).floor() as i64;
                layers.entry(number).or_insert_with(|| Layer::new(directory)).add(&point)?;
                values.add(&point)
            })?;
            satellites.push(values.satellite(link)?);
        }
        let bands = layers.into_iter().map(|(number, layer)| layer.band(number)).collect::<Result<_, _>>()?;
        Ok(Self { satellites, bands })
    }
}

/// A satellite in the making.
struct Values {
    elevation_deg: Sum,
    code_m: Numbers,
    carrier_cycles: Numbers,
    doppler_hz: Numbers,
    cn0_db: Numbers,
    multipath_m: Sum,
}

impl Values {
    fn new(directory: &Path) -> Self {
        let [code_m, carrier_cycles, doppler_hz, cn0_db] = std::array::from_fn(|_| Numbers::new(directory));
        let [elevation_deg, multipath_m] = [Sum::default(); 2];
        Self { elevation_deg, code_m, carrier_cycles, doppler_hz, cn0_db, multipath_m }
    }

    fn add(&mut self, point: &Point) -> Result<(), JudgeError> {
        self.elevation_deg.add(point.elevation_deg);
        point.code_m.map_or(Ok(()), |code_m| self.code_m.push(code_m))?;
        self.carrier_cycles.push(point.carrier_cycles)?;
        self.doppler_hz.push(point.doppler_hz)?;
        self.cn0_db.push(point.cn0_db)?;
        self.multipath_m.add(point.multipath_m);
        Ok(())
    }

    fn satellite(&self, Link { sv, signal }: Link) -> Result<Satellite, JudgeError> {
        let std = |numbers: &Numbers| Ok::<_, JudgeError>(numbers.std()?.map(|(sigma, _)| sigma));
        Ok(Satellite {
            sv,
            signal: signal.name,
            observations: self.carrier_cycles.len(),
            elevation_mean_deg: self.elevation_deg.mean(),
            code_mean_m: self.code_m.mean()?,
            code_sigma_m: std(&self.code_m)?,
            carrier_sigma_cycles: std(&self.carrier_cycles)?,
            doppler_mean_hz: self.doppler_hz.mean()?,
            doppler_sigma_hz: std(&self.doppler_hz)?,
            cn0_bias_db: self.cn0_db.mean()?,
            cn0_sigma_db: std(&self.cn0_db)?,
            multipath_rms_m: self.multipath_m.rms(),
        })
    }
}

/// A band in the making.
struct Layer {
    observations: usize,
    code_m: Numbers,
    carrier_cycles: Sum,
    doppler_hz: Sum,
    cn0_db: Sum,
    multipath_m: Sum,
}

impl Layer {
    fn new(directory: &Path) -> Self {
        let [carrier_cycles, doppler_hz, cn0_db, multipath_m] = [Sum::default(); 4];
        let code_m = Numbers::new(directory);
        Self { observations: 0, code_m, carrier_cycles, doppler_hz, cn0_db, multipath_m }
    }

    fn add(&mut self, point: &Point) -> Result<(), JudgeError> {
        self.observations += 1;
        self.carrier_cycles.add(point.carrier_cycles);
        self.doppler_hz.add(point.doppler_hz);
        self.cn0_db.add(point.cn0_db);
        self.multipath_m.add(point.multipath_m);
        point.code_m.map_or(Ok(()), |code_m| self.code_m.push(code_m))
    }

    fn band(&self, number: i64) -> Result<Band, JudgeError> {
        Ok(Band {
            from_deg: number as f64 * BAND_DEG,
            // A table may hold any elevation.
            to_deg: (number as f64 + 1.0) * BAND_DEG,
            observations: self.observations,
            code_rms_m: self.code_m.rms()?,
            code_p95_m: self.code_m.size_percentile(0.95)?,
            carrier_rms_cycles: self.carrier_cycles.rms(),
            doppler_rms_hz: self.doppler_hz.rms(),
            cn0_bias_db: self.cn0_db.mean(),
            multipath_rms_m: self.multipath_m.rms(),
        })
    }
}

/// P − λφ − 2I of each row. Errors are against the truth, whose code minus carrier is 2I and a constant, so
/// that their difference is the combination already.
fn combined_m(link: &Link, row: &SignalError) -> f64 {
    row.code_m - row.carrier_cycles * link.wavelength_m()
}

/// Means of the combination over the arcs of a satellite, one after the other.
#[derive(Default)]
struct Arcs {
    locked_s: Option<f64>,
    sums: Vec<Sum>,
}

impl Arcs {
    fn add(&mut self, link: &Link, row: &SignalError) {
        if self.locked_s.replace(row.locked_s).is_none_or(|before_s| !goes_on(before_s, row)) {
            self.sums.push(Sum::default());
        }
        if let Some(sum) = self.sums.last_mut() {
            sum.add(combined_m(link, row));
        }
    }

    fn means(self) -> ArcMeans {
        ArcMeans { locked_s: None, means_m: self.sums.into_iter(), mean_m: 0.0 }
    }
}

/// True if an arc continues with a row, by the lock time of the one before.
fn goes_on(before_s: f64, row: &SignalError) -> bool {
    row.locked_s > before_s
}

/// Means of the arcs, used in a second pass through the rows.
struct ArcMeans {
    locked_s: Option<f64>,
    means_m: std::vec::IntoIter<Sum>,
    mean_m: f64,
}

impl ArcMeans {
    /// The combination of the next row, about the mean of its arc.
    fn departure_m(&mut self, link: &Link, row: &SignalError) -> f64 {
        if self.locked_s.replace(row.locked_s).is_none_or(|before_s| !goes_on(before_s, row)) {
            self.mean_m = self.means_m.next().and_then(|sum| sum.mean()).unwrap_or(0.0);
        }
        combined_m(link, row) - self.mean_m
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use gnss::gps::l1ca::L1_CA;

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
            sent_fraction_s: 0.0,
        };
        let link = L1_CA.link(Sv::gps(3));
        let rows = [row(1, 101.0, 0.0), row(2, 103.0, 0.0)];
        let mut arcs = Arcs::default();
        rows.iter().for_each(|row| arcs.add(&link, row));
        let mut arcs = arcs.means();
        assert_eq!(rows.iter().map(|row| arcs.departure_m(&link, row)).collect::<Vec<_>>(), vec![-1.0, 1.0]);
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
        let place = tempfile::tempdir().unwrap();
        let (mut low, mut high) = (Layer::new(place.path()), Layer::new(place.path()));
        points[..2].iter().for_each(|point| low.add(point).unwrap());
        high.add(&points[2]).unwrap();
        let bands = [low.band(0).unwrap(), high.band(4).unwrap()];
        assert_eq!((bands[0].from_deg, bands[0].observations, bands[1].to_deg), (0.0, 2, 50.0));
        assert_eq!((bands[0].code_rms_m, bands[1].cn0_bias_db), (Some(3.0), Some(-0.5)));
        let mut values = Values::new(place.path());
        points.iter().for_each(|point| values.add(point).unwrap());
        assert!((values.satellite(link).unwrap().code_mean_m.unwrap() - 1.0 / 3.0).abs() < 1e-12);
    }
}
