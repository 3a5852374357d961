//! How far the atmosphere may move a foreign receiver's positions.
//!
//! A receiver corrects the troposphere by a model, the ionosphere by the broadcast one once its page has come. So
//! what a scene lacks, or what no page corrects, moves its positions: delays go through least squares with equal
//! weights. Limits: a receiver with another model than the broadcast one is held against that one.

use nalgebra::{Matrix4, Vector3, Vector4};

use crate::error::JudgeError;
use crate::expect::due::satellite::LOCK_S;
use crate::expect::due::timetable::Timetable;
use crate::expect::message::Message;
use crate::read::Run;
use gnss::earth::{Geodetic, Look, SPEED_OF_LIGHT_MPS};
use gnss::ionosphere::{Coefficients, Model};
use gnss::record::SkyRow;
use gnss::time::Epoch;

/// Zenith delay of a standard troposphere.
const ZENITH_M: f64 = 2.4;
/// Zenith delay of the ionosphere by a receiver's default coefficients, at noon.
const NOON_M: f64 = 10.0;
/// Time that a receiver may take to use what it has decoded.
const USE_S: f64 = 5.0;
/// Lowest elevation of satellites that count, degrees.
const MASK_DEG: f64 = 5.0;

/// A scene's atmosphere and what its message says of it.
pub(super) struct Atmosphere<'r> {
    run: &'r Run,
    sent: Option<Coefficients>,
    /// When the page has come, seconds from sample 0.
    page_s: f64,
    /// Sample of the epoch that was asked for last, and the answer.
    last: Option<(u64, (f64, f64))>,
}

impl<'r> Atmosphere<'r> {
    pub fn of(run: &'r Run) -> Result<Self, JudgeError> {
        let message = Message::of(run);
        let sent = Model::KLOBUCHAR.iter().find_map(|model| message.ionosphere(*model)).copied();
        let start = run.trajectory.first().map(|row| row.time().plus_s(-run.time_s(row.sample)));
        let page = |start: Epoch| {
            let of = |signal| Timetable::beside(signal, &run.signals, start).ionosphere_by_s(LOCK_S) + USE_S;
            run.signals.iter().map(|signal| of(signal)).fold(f64::INFINITY, f64::min)
        };
        Ok(Self { run, sent, page_s: start.map_or(f64::INFINITY, page), last: None })
    }

    /// Metres, horizontally and vertically, by which positions at a sample may be moved.
    ///
    /// # Errors
    /// [`JudgeError::Read`] where spilled rows cannot be read.
    pub fn moves_m(&mut self, sample: u64) -> Result<(f64, f64), JudgeError> {
        // The sky moves slowly: one answer for ten seconds.
        let step = (10.0 * self.run.scene.sample_rate_hz) as u64;
        if let Some((at, moved)) = self.last.filter(|(at, _)| sample.abs_diff(*at) < step) {
            let _ = at;
            return Ok(moved);
        }
        let moved = self.moved(sample)?;
        self.last = Some((sample, moved));
        Ok(moved)
    }

    fn moved(&self, sample: u64) -> Result<(f64, f64), JudgeError> {
        let mut rows = Vec::new();
        for sv in self.run.in_the_sky() {
            let found = self.run.seen_at(sv)?.and_then(|mut sky| sky.get(sample));
            rows.extend(found.filter(|row| row.elevation_deg >= MASK_DEG));
        }
        let place = self.run.trajectory.finder()?.get(sample);
        let Some(place) = place.filter(|_| rows.len() >= 4) else { return Ok((0.0, 0.0)) };
        let user = Geodetic::from_ecef(&place.position_m());
        let come = self.run.time_s(sample) >= self.page_s;
        let left_m = |row: &SkyRow| {
            let (sin, look) = (libm::sin(row.elevation_deg.to_radians()), look(row));
            let sent_m = self.sent.as_ref().map(|model| {
                let carrier_hz = row.signal.carrier_hz(row.sv);
                SPEED_OF_LIGHT_MPS * model.delay_s((user, look), &Vector3::zeros(), place.time(), carrier_hz)
            });
            let ionosphere_m = match sent_m {
                Some(sent_m) if come => sent_m - row.ionosphere_m,
                // Nothing, the truth, or a model of the receiver's own.
                _ => row.ionosphere_m.max(NOON_M * obliquity(row.elevation_deg)),
            };
            let troposphere_m = if row.troposphere_m == 0.0 { ZENITH_M / sin } else { 0.0 };
            (ionosphere_m, troposphere_m)
        };
        let solve = |of: &dyn Fn(&SkyRow) -> f64| {
            let (mut normal, mut right) = (Matrix4::<f64>::zeros(), Vector4::<f64>::zeros());
            for row in &rows {
                let (sin_a, cos_a) = libm::sincos(row.azimuth_deg.to_radians());
                let (sin_e, cos_e) = libm::sincos(row.elevation_deg.to_radians());
                let h = Vector4::new(-cos_e * sin_a, -cos_e * cos_a, -sin_e, 1.0);
                normal += h * h.transpose();
                right += h * of(row);
            }
            normal.try_inverse().map_or((0.0, 0.0), |inverse| {
                let moved = inverse * right;
                (moved.xy().norm(), moved.z.abs())
            })
        };
        let (by_ionosphere, by_troposphere) = (solve(&|row| left_m(row).0), solve(&|row| left_m(row).1));
        Ok((by_ionosphere.0 + by_troposphere.0, by_ionosphere.1 + by_troposphere.1))
    }
}

fn look(row: &SkyRow) -> Look {
    Look { azimuth_rad: row.azimuth_deg.to_radians(), elevation_rad: row.elevation_deg.to_radians() }
}

/// Slant over zenith delay of the ionosphere (IS-GPS-200N, 20.3.3.5.2.5), elevation in semicircles.
fn obliquity(elevation_deg: f64) -> f64 {
    1.0 + 16.0 * libm::pow(0.53 - elevation_deg / 180.0, 3.0)
}
