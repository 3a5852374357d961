//! Largest shift of a foreign receiver's positions by the atmosphere.
//!
//! A receiver corrects the troposphere by a model, and the ionosphere by the broadcast one once its page has
//! come. Delays that a scene lacks, or that no page corrects, move its positions. They go through least
//! squares with equal weights. Limits: a receiver with another model than the broadcast one is judged by that
//! one.

use nalgebra::{Matrix4, Vector3, Vector4};

use crate::error::JudgeError;
use crate::expect::due::satellite::LOCK_S;
use crate::expect::due::timetable::Timetable;
use crate::expect::message::Message;
use crate::read::Run;
use gnss::earth::{Geodetic, Look, SPEED_OF_LIGHT_MPS};
use gnss::ionosphere::{Coefficients, Model};
use gnss::klobuchar::Klobuchar;
use gnss::record::SkyRow;
use gnss::time::Epoch;

/// Zenith delay of a standard troposphere.
const ZENITH_M: f64 = 2.4;
/// Coefficients that a receiver takes before it has any: those of 2004-01-01, which RTKLIB has.
const DEFAULT: Klobuchar =
    Klobuchar { alpha: [1.118e-8, -7.451e-9, -5.961e-8, 1.192e-7], beta: [1.167e5, -2.294e5, -1.311e5, 1.049e6] };
/// Time that a receiver may take to use what it has decoded.
const USE_S: f64 = 5.0;
/// Lowest elevation of satellites that count, degrees.
const MASK_DEG: f64 = 5.0;

/// Largest shift of positions, metres.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Moved {
    pub horizontal_m: f64,
    /// Largest shift downwards, metres. A delay that is corrected but does not exist lowers a position.
    down_m: f64,
    /// Largest shift upwards, metres. A delay that is not corrected raises a position, as it is longest near
    /// the horizon.
    up_m: f64,
}

impl Moved {
    /// Allowed vertical shift in the direction of an error, upwards or downwards.
    pub fn vertical_m(&self, error_up_m: f64) -> f64 {
        if error_up_m < 0.0 { self.down_m } else { self.up_m }
    }

    /// Largest shift over these moves, or none: east, north and up.
    fn any(moves: &[Vector3<f64>]) -> Self {
        moves.iter().fold(Self::default(), |most, one| Self {
            horizontal_m: most.horizontal_m.max(one.xy().norm()),
            down_m: most.down_m.max(-one.z),
            up_m: most.up_m.max(one.z),
        })
    }

    fn plus(self, other: Self) -> Self {
        Self {
            horizontal_m: self.horizontal_m + other.horizontal_m,
            down_m: self.down_m + other.down_m,
            up_m: self.up_m + other.up_m,
        }
    }
}

/// A scene's atmosphere and what its message says of it.
pub(super) struct Atmosphere<'r> {
    run: &'r Run,
    sent: Option<Coefficients>,
    /// Arrival of the page, seconds from sample 0.
    page_s: f64,
    /// Sample of the epoch that was asked for last, and the answer.
    last: Option<(u64, Moved)>,
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

    /// Allowed shift of positions at a sample.
    ///
    /// # Errors
    ///
    /// [`JudgeError::Read`] where spilled rows cannot be read.
    pub fn moves_m(&mut self, sample: u64) -> Result<Moved, JudgeError> {
        // The sky moves slowly: one answer for ten seconds.
        let step = (10.0 * self.run.scene.sample_rate_hz) as u64;
        if let Some((_, moved)) = self.last.filter(|(at, _)| sample.abs_diff(*at) < step) {
            return Ok(moved);
        }
        let moved = self.moved(sample)?;
        self.last = Some((sample, moved));
        Ok(moved)
    }

    fn moved(&self, sample: u64) -> Result<Moved, JudgeError> {
        let mut rows = Vec::new();
        for sv in self.run.in_the_sky() {
            let found = self.run.seen_at(sv)?.and_then(|mut sky| sky.get(sample));
            rows.extend(found.filter(|row| row.elevation_deg >= MASK_DEG));
        }
        let place = self.run.trajectory.finder()?.get(sample);
        let Some(place) = place.filter(|_| rows.len() >= 4) else { return Ok(Moved::default()) };
        let user = Geodetic::from_ecef(&place.position_m());
        // What a model leaves of a range's delay.
        let left_m = |row: &SkyRow, model: &Coefficients| {
            let carrier_hz = row.signal.carrier_hz(row.sv);
            let delay_s = model.delay_s((user, look(row)), &Vector3::zeros(), place.time(), carrier_hz);
            row.ionosphere_m - SPEED_OF_LIGHT_MPS * delay_s
        };
        let default = Coefficients::Klobuchar(DEFAULT);
        let solve = |of: &dyn Fn(&SkyRow) -> f64| {
            let (mut normal, mut right) = (Matrix4::<f64>::zeros(), Vector4::<f64>::zeros());
            for row in &rows {
                let (sin_a, cos_a) = libm::sincos(row.azimuth_deg.to_radians());
                let (sin_e, cos_e) = libm::sincos(row.elevation_deg.to_radians());
                let h = Vector4::new(-cos_e * sin_a, -cos_e * cos_a, -sin_e, 1.0);
                normal += h * h.transpose();
                right += h * of(row);
            }
            normal.try_inverse().map_or_else(Vector3::zeros, |inverse| (inverse * right).xyz())
        };
        let by_ionosphere = match self.sent.as_ref().filter(|_| self.run.time_s(sample) >= self.page_s) {
            Some(sent) => Moved::any(&[solve(&|row| left_m(row, sent))]),
            // Nothing, or the receiver's own coefficients.
            None => Moved::any(&[solve(&|row| row.ionosphere_m), solve(&|row| left_m(row, &default))]),
        };
        let too_much_m = |row: &SkyRow| {
            if row.troposphere_m == 0.0 { -ZENITH_M / libm::sin(row.elevation_deg.to_radians()) } else { 0.0 }
        };
        Ok(by_ionosphere.plus(Moved::any(&[solve(&too_much_m)])))
    }
}

fn look(row: &SkyRow) -> Look {
    Look { azimuth_rad: row.azimuth_deg.to_radians(), elevation_rad: row.elevation_deg.to_radians() }
}
