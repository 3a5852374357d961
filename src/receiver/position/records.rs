//! A solution as the records that a fix consists of.

use nalgebra::{DMatrix, Matrix3, Vector3};

use super::least_squares::{COORDINATES, Range, Solution};
use gnss::earth::{Geodetic, SPEED_OF_LIGHT_MPS};
use gnss::record::{ClockRow, Fix, IonosphereModel, SightRow};
use gnss::satellite::Sv;
use gnss::time::{Epoch, GPST, SampleClock, TimeScale};

/// The record of a solution.
#[expect(clippy::too_many_arguments, reason = "a record with as many sources")]
pub(super) fn fix(
    sample: u64,
    clock: SampleClock,
    solution: &Solution,
    velocity_mps: Vector3<f64>,
    drift: f64,
    [satellites, ranges]: [usize; 2],
    excluded: &[(Sv, f64)],
    ionosphere: IonosphereModel,
) -> Fix {
    let bias_s = solution.clock_m() / SPEED_OF_LIGHT_MPS;
    let time: Epoch = clock.epoch(sample).plus_s(planted!("receiver.position.time_sign", -bias_s, bias_s));
    let axes = Geodetic::from_ecef(&solution.position_m).ecef_to_enu();
    let block = |m: &DMatrix<f64>| -> Matrix3<f64> { m.fixed_view::<3, 3>(0, 0).into_owned() };
    let scale = planted!("receiver.position.sigma_x3", 1.0, 9.0) * planted!("receiver.position.sigma_x05", 1.0, 0.25);
    let covariance = scale * axes * block(&solution.covariance) * axes.transpose();
    let correlation = |a, b| covariance[(a, b)] / (covariance[(a, a)] * covariance[(b, b)]).sqrt();
    let dilution = axes * block(&solution.dilution) * axes.transpose();
    let (de, dn, du) = (dilution[(0, 0)], dilution[(1, 1)], dilution[(2, 2)]);
    let dt = solution.dilution[(3, 3)];
    let names: Vec<String> = excluded.iter().map(|(sv, _)| sv.to_string()).collect();
    Fix {
        sample,
        gps_s: time.seconds(),
        gps_fraction_s: time.fraction(),
        x_m: solution.position_m.x,
        y_m: solution.position_m.y,
        z_m: solution.position_m.z,
        vx_mps: velocity_mps.x,
        vy_mps: velocity_mps.y,
        vz_mps: velocity_mps.z,
        clock_bias_s: bias_s,
        clock_drift: drift,
        sigma_east_m: covariance[(0, 0)].sqrt(),
        sigma_north_m: covariance[(1, 1)].sqrt(),
        sigma_up_m: covariance[(2, 2)].sqrt(),
        sigma_clock_m: solution.covariance[(3, 3)].sqrt() * planted!("receiver.position.sigma_clock", 1.0, 3.0),
        correlation_en: planted!("receiver.position.correlation", correlation(0, 1), -correlation(0, 1)),
        correlation_eu: correlation(0, 2),
        correlation_nu: correlation(1, 2),
        gdop: (de + dn + du + dt).sqrt(),
        pdop: (de + dn + du).sqrt(),
        hdop: (de + planted!("receiver.position.hdop", dn, du)).sqrt(),
        vdop: du.sqrt(),
        tdop: dt.sqrt(),
        condition: solution.condition,
        satellites: satellites as u32,
        ranges: Some(ranges as u32),
        clocks: Some(solution.clocks.len() as u32),
        time_scale: solution.clocks.first().map_or(GPST.name, |(scale, _)| scale.name).to_owned(),
        chi_square: solution.chi_square,
        excluded: names.join(" "),
        ionosphere,
    }
}

/// Directions of the satellites of the ranges, each once, from a position with an error of metres at most.
pub(super) fn sights(sample: u64, ranges: &[Range], from: &Solution) -> Vec<SightRow> {
    let axes = Geodetic::from_ecef(&from.position_m).ecef_to_enu();
    let mut rows: Vec<SightRow> = (ranges.iter().zip(&from.sights))
        .map(|(range, sight)| {
            let enu = axes * sight;
            SightRow {
                sample,
                sv: range.sv,
                azimuth_deg: libm::atan2(enu.x, enu.y).to_degrees().rem_euclid(360.0),
                elevation_deg: libm::asin(enu.z.clamp(-1.0, 1.0)).to_degrees(),
                used: false,
            }
        })
        .collect();
    rows.sort_by_key(|row| row.sv);
    rows.dedup_by_key(|row| row.sv);
    rows
}

/// The clock against each time scale of a solution, one row a scale.
pub(super) fn clocks(sample: u64, solution: &Solution) -> Vec<ClockRow> {
    let row = |(index, (scale, clock_m)): (usize, &(&'static TimeScale, f64))| ClockRow {
        sample,
        time_scale: scale.name.to_owned(),
        clock_bias_s: clock_m / SPEED_OF_LIGHT_MPS,
        sigma_clock_m: solution.covariance[(COORDINATES + index, COORDINATES + index)].sqrt(),
    };
    solution.clocks.iter().enumerate().map(row).collect()
}
