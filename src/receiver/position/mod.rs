//! Position, velocity and time from observations and decoded ephemerides.
//!
//! Smoothed pseudoranges go through iterated weighted least squares ([`solve`]); the weighted sum of squared residuals is
//! held against chi-square, and a satellite that the others contradict is left out.

pub mod smooth;
pub mod solve;
pub mod troposphere;

use std::collections::BTreeMap;

use nalgebra::{Matrix4, Vector3};
use serde::{Deserialize, Serialize};
use statrs::distribution::{ChiSquared, ContinuousCDF};

use crate::gnss::broadcast::Ephemeris;
use crate::gnss::earth::{Geodetic, SPEED_OF_LIGHT_MPS, look};
use crate::gnss::klobuchar::Klobuchar;
use crate::gnss::record::{Fix, Observation};
use crate::gnss::satellite::Sv;
use crate::gnss::time::Epoch;
use smooth::Smoother;
use solve::{NoFix, Place, Range};

/// Choices of the position solution, as a settings file writes them.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct PositionSettings {
    /// Satellites below this elevation do not take part.
    pub mask_deg: f64,
    /// Carrier smoothing window; 0 for none.
    pub smoothing_s: f64,
    /// Lock time before which the code is taken as still pulling in.
    pub settling_s: f64,
    /// Probability that the residual test rejects a sound set of satellites.
    pub false_alarm_probability: f64,
    /// Standard deviation at the zenith of what the models leave over, growing with the cosecant of elevation.
    pub model_sigma_m: f64,
    pub ionosphere: IonosphereChoice,
    pub troposphere: TroposphereChoice,
    /// Whether to wait for the ionosphere's parameters.
    pub require_ionosphere: bool,
}

/// How the ionosphere is corrected.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum IonosphereChoice {
    /// By the broadcast coefficients, once they are decoded.
    Broadcast,
    None,
}

/// How the troposphere is corrected.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum TroposphereChoice {
    /// By a standard atmosphere.
    Standard,
    None,
}

impl Default for PositionSettings {
    fn default() -> Self {
        Self {
            mask_deg: 5.0,
            smoothing_s: 30.0,
            settling_s: 3.0,
            false_alarm_probability: 1e-3,
            model_sigma_m: 0.1,
            ionosphere: IonosphereChoice::Broadcast,
            troposphere: TroposphereChoice::Standard,
            require_ionosphere: false,
        }
    }
}

impl PositionSettings {
    /// Values with their key, the range that they must be in, and its name.
    pub fn checks(&self) -> [(&'static str, f64, bool, &'static str); 5] {
        let within = |value: f64, least: f64, most: f64| value >= least && value <= most;
        [
            ("mask_deg", self.mask_deg, within(self.mask_deg, -90.0, 90.0), "-90 to 90"),
            ("smoothing_s", self.smoothing_s, within(self.smoothing_s, 0.0, 3600.0), "0 to 3600"),
            ("settling_s", self.settling_s, within(self.settling_s, 0.0, 60.0), "0 to 60"),
            (
                "false_alarm_probability",
                self.false_alarm_probability,
                within(self.false_alarm_probability, 1e-12, 0.5),
                "1e-12 to 0.5",
            ),
            ("model_sigma_m", self.model_sigma_m, within(self.model_sigma_m, 0.0, 1000.0), "0 to 1000"),
        ]
    }
}

/// What the code and frequency loops contribute to a range's standard deviation.
#[derive(Clone, Copy, Debug)]
pub struct LoopNoise {
    pub spacing_chips: f64,
    pub code_bandwidth_hz: f64,
    pub integration_s: f64,
    pub carrier_bandwidth_hz: f64,
}

/// What a solution needs besides observations.
pub struct Knowledge<'a> {
    pub ephemerides: &'a BTreeMap<Sv, Ephemeris>,
    pub klobuchar: Option<Klobuchar>,
    /// Reading of the receiver's clock at the observations.
    pub reading: Epoch,
    /// Spacing of epochs.
    pub interval_s: f64,
}

/// The solver and what it remembers from epoch to epoch.
pub struct Solver {
    settings: PositionSettings,
    noise: LoopNoise,
    smoother: Smoother,
    last: Option<(Vector3<f64>, f64)>,
}

impl Solver {
    /// A solver that knows nothing yet.
    pub fn new(settings: PositionSettings, noise: LoopNoise) -> Self {
        Self { settings, noise, smoother: Smoother::default(), last: None }
    }

    /// The fix of one epoch, or why there is none.
    pub fn solve(&mut self, observations: &[Observation], knowledge: &Knowledge) -> Result<Fix, NoFix> {
        let candidates: Vec<Candidate> =
            observations.iter().filter_map(|observation| self.candidate(observation, knowledge)).collect();
        if knowledge.klobuchar.is_none() && self.settings.require_ionosphere || candidates.len() < 4 {
            return Err(NoFix::TooFew { have: candidates.len(), need: 4 });
        }
        let (first_m, first_clock_m) = match self.last {
            Some(last) => last,
            None => {
                // Where it is decides the atmosphere: a coarse place first, without one.
                let ranges: Vec<Range> = candidates.iter().map(|candidate| candidate.range).collect();
                let coarse = solve::place(&ranges, Vector3::zeros(), 0.0)?;
                (coarse.position_m, coarse.clock_m)
            }
        };
        let mut ranges = self.corrected(&candidates, knowledge, first_m, first_clock_m);
        let mut found = solve::place(&ranges, first_m, first_clock_m)?;
        // Delays change by micrometres a metre of displacement: once more only after a coarse start.
        if (found.position_m - first_m).norm() > 100.0 {
            ranges = self.corrected(&candidates, knowledge, found.position_m, found.clock_m);
            found = solve::place(&ranges, found.position_m, found.clock_m)?;
        }
        let (ranges, place, excluded) = self.consistent(ranges, found)?;
        let movement = solve::movement(&ranges, &place.position_m)?;
        self.last = Some((place.position_m, place.clock_m));
        Ok(fix(observations, knowledge, &ranges, &place, &movement, &excluded))
    }

    fn candidate(&mut self, observation: &Observation, knowledge: &Knowledge) -> Option<Candidate> {
        let window = self.settings.smoothing_s / knowledge.interval_s;
        let settled = observation.locked_s >= self.settings.settling_s;
        let smoothed = self.smoother.smooth(observation, window, settled);
        let ephemeris = knowledge.ephemerides.get(&observation.sv).filter(|ephemeris| ephemeris.health == 0)?;
        let sent = observation.sent();
        // The clock's offset moves by 1e-14 s in the microseconds between its own reading and GPS time.
        let clock = ephemeris.clock_l1(sent).ok()?;
        let satellite = ephemeris.state(sent.plus_s(-clock.offset_s)).ok()?;
        let (code_m, rate_mps) = self.noise.sigmas(observation, smoothed.epochs, knowledge.interval_s);
        let range = Range {
            sv: observation.sv,
            satellite,
            clock,
            pseudorange_m: smoothed.pseudorange_m,
            range_rate_mps: -observation.doppler_hz * observation.signal.wavelength_m(),
            delay_m: 0.0,
            sigma_m: code_m,
            sigma_mps: rate_mps,
        };
        Some(Candidate { range, carrier_hz: observation.signal.carrier_hz })
    }

    /// Ranges with atmospheric delays and elevation-dependent weights, those below the mask left out.
    fn corrected(
        &self,
        candidates: &[Candidate],
        knowledge: &Knowledge,
        position_m: Vector3<f64>,
        clock_m: f64,
    ) -> Vec<Range> {
        let user = Geodetic::from_ecef(&position_m);
        let time = knowledge.reading.plus_s(-clock_m / SPEED_OF_LIGHT_MPS);
        let day = time.day_of_year();
        let corrected = candidates.iter().filter_map(|candidate| {
            let seen_m = solve::seen_from(&candidate.range.satellite.position_m, &position_m);
            let look = look(user, &position_m, &seen_m);
            if look.elevation_rad < self.settings.mask_deg.to_radians() {
                return None;
            }
            let ionosphere_s = match (self.settings.ionosphere, knowledge.klobuchar) {
                (IonosphereChoice::Broadcast, Some(model)) => model.delay_s(user, look, time, candidate.carrier_hz),
                _ => 0.0,
            };
            let troposphere_m = match self.settings.troposphere {
                TroposphereChoice::Standard => troposphere::delay_m(user, look.elevation_rad, day),
                TroposphereChoice::None => 0.0,
            };
            let delay_m = ionosphere_s * SPEED_OF_LIGHT_MPS + troposphere_m;
            let model_m = self.settings.model_sigma_m / libm::sin(look.elevation_rad).max(0.1);
            let sigma_m = libm::hypot(candidate.range.sigma_m, model_m);
            Some(Range { delay_m, sigma_m, ..candidate.range })
        });
        corrected.collect()
    }

    /// Leaves out satellites, one by one, until the residuals agree: each time the one without which they agree best.
    fn consistent(&self, mut ranges: Vec<Range>, mut place: Place) -> Result<(Vec<Range>, Place, Vec<Sv>), NoFix> {
        let mut excluded = Vec::new();
        loop {
            let limit = self.limit(ranges.len());
            if place.chi_square <= limit {
                return Ok((ranges, place, excluded));
            }
            // With five satellites a fault is seen, but not whose it is.
            if ranges.len() < 6 {
                return Err(NoFix::Inconsistent { chi_square: place.chi_square, limit });
            }
            let mut best: Option<(usize, Place)> = None;
            for left_out in 0..ranges.len() {
                let mut rest = ranges.clone();
                rest.remove(left_out);
                let Ok(found) = solve::place(&rest, place.position_m, place.clock_m) else { continue };
                if best.as_ref().is_none_or(|(_, other)| found.chi_square < other.chi_square) {
                    best = Some((left_out, found));
                }
            }
            let Some((left_out, found)) = best else {
                return Err(NoFix::Inconsistent { chi_square: place.chi_square, limit });
            };
            excluded.push(ranges.remove(left_out).sv);
            place = found;
        }
    }

    /// The largest weighted sum of squares that chance explains; nothing is redundant with four satellites.
    fn limit(&self, satellites: usize) -> f64 {
        match satellites.checked_sub(4) {
            None | Some(0) => f64::INFINITY,
            Some(freedom) => ChiSquared::new(freedom as f64)
                .map_or(f64::INFINITY, |law| law.inverse_cdf(1.0 - self.settings.false_alarm_probability)),
        }
    }
}

struct Candidate {
    range: Range,
    carrier_hz: f64,
}

impl LoopNoise {
    /// Standard deviations of a smoothed range and of a range rate, from C/N0.
    ///
    /// Code: early-late power loop, E. D. Kaplan and C. J. Hegarty, Understanding GPS, eq. 5.23, first branch;
    /// smoothed over n epochs of which 1/(2 B) seconds are one independent. Rate: phase noise over the update.
    fn sigmas(&self, observation: &Observation, epochs: f64, interval_s: f64) -> (f64, f64) {
        let cn0_hz = libm::pow(10.0, observation.cn0_dbhz.clamp(10.0, 80.0) / 10.0);
        let chip_m = observation
            .signal
            .components
            .first()
            .map_or(SPEED_OF_LIGHT_MPS, |component| SPEED_OF_LIGHT_MPS / component.chip_rate_hz);
        let squaring = 1.0 + 2.0 / ((2.0 - self.spacing_chips) * self.integration_s * cn0_hz);
        let variance_chips = self.code_bandwidth_hz * self.spacing_chips / (2.0 * cn0_hz) * squaring;
        let independent = (epochs * interval_s * 2.0 * self.code_bandwidth_hz).max(1.0);
        let code_m = chip_m * (variance_chips / independent).sqrt();
        let phase_rad = (self.carrier_bandwidth_hz / cn0_hz * (1.0 + 0.5 / (self.integration_s * cn0_hz))).sqrt();
        let rate_hz = phase_rad * self.carrier_bandwidth_hz / std::f64::consts::TAU;
        (code_m, observation.signal.wavelength_m() * rate_hz.max(1e-3))
    }
}

fn fix(
    observations: &[Observation],
    knowledge: &Knowledge,
    ranges: &[Range],
    place: &Place,
    movement: &solve::Movement,
    excluded: &[Sv],
) -> Fix {
    let user = Geodetic::from_ecef(&place.position_m);
    let local = |matrix: &Matrix4<f64>| {
        let axes = user.ecef_to_enu();
        axes * matrix.fixed_view::<3, 3>(0, 0) * axes.transpose()
    };
    let covariance = local(&place.covariance_m2);
    let geometry = local(&place.geometry);
    let clock_bias_s = place.clock_m / SPEED_OF_LIGHT_MPS;
    let time = knowledge.reading.plus_s(-clock_bias_s);
    let names: Vec<String> = excluded.iter().map(Sv::to_string).collect();
    Fix {
        sample: observations.first().map_or(0, |observation| observation.sample),
        gps_s: time.seconds(),
        gps_fraction_s: time.fraction(),
        x_m: place.position_m.x,
        y_m: place.position_m.y,
        z_m: place.position_m.z,
        vx_mps: movement.velocity_mps.x,
        vy_mps: movement.velocity_mps.y,
        vz_mps: movement.velocity_mps.z,
        clock_bias_s,
        clock_drift: movement.clock_drift,
        sigma_east_m: covariance[(0, 0)].sqrt(),
        sigma_north_m: covariance[(1, 1)].sqrt(),
        sigma_up_m: covariance[(2, 2)].sqrt(),
        sigma_clock_m: place.covariance_m2[(3, 3)].sqrt(),
        gdop: place.geometry.trace().sqrt(),
        pdop: geometry.trace().sqrt(),
        hdop: (geometry[(0, 0)] + geometry[(1, 1)]).sqrt(),
        vdop: geometry[(2, 2)].sqrt(),
        tdop: place.geometry[(3, 3)].sqrt(),
        satellites: ranges.len() as u32,
        chi_square: place.chi_square,
        excluded: names.join(" "),
        ionosphere: knowledge.klobuchar.is_some(),
    }
}

#[cfg(test)]
mod tests;
