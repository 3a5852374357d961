//! Rules that remain where a scene expects errors of any size.
//!
//! Reflections shift a code by their excess and half a chip at the most, and a carrier by the user's motion
//! towards their mirrors. A spoofer moves both to the position and the time that it claims. Nothing turns a
//! Doppler's sign. The 95th percentile of each satellite's errors stays below that. Limits: satellites with a
//! fault of their own are left out, as their ranges may have any error.

use crate::error::JudgeError;
use crate::judge::judgement::Bound;
use crate::judge::verdict::Verdict;
use crate::measure::errors::Errors;
use crate::measure::spoofing::Claims;
use crate::read::{Numbers, Run};
use gnss::earth::SPEED_OF_LIGHT_MPS;
use gnss::signal::Link;

/// Doppler error in hertz by noise, fades and the pull-in of a loop.
pub(super) const LOOP_HZ: f64 = 50.0;
/// Velocity error in metres per second by the same causes: a fifth of a metre a second for each hertz.
pub(super) const LOOP_MPS: f64 = 10.0;

/// Largest change of a range's rate by a mirror, m/s.
fn mirrors_mps(run: &Run) -> Result<f64, JudgeError> {
    let mut speed_mps = 0.0_f64;
    run.trajectory.each(|row| speed_mps = speed_mps.max(row.velocity_mps().norm()))?;
    Ok(2.0 * speed_mps)
}

/// A satellite's value beside its limit.
struct Worst {
    name: String,
    value: f64,
    limit: f64,
}

impl Worst {
    fn nearer(old: Option<Self>, new: Self) -> Option<Self> {
        match old {
            Some(old) if old.value / old.limit >= new.value / new.limit => Some(old),
            _ => Some(new),
        }
    }
}

impl Verdict {
    /// Rows of observations in the times of which the scene expects errors of any size.
    pub(super) fn excused(&mut self, run: &Run, errors: &Errors) -> Result<(), JudgeError> {
        if run.scene.expect.always_bounded() {
            return Ok(());
        }
        let (claims, mirrors_mps) = (Claims::of(run)?, mirrors_mps(run)?);
        let at_fault = |link: &Link| {
            let own = |satellites: &Option<Vec<_>>| satellites.as_ref().is_none_or(|list| list.contains(&link.sv));
            run.scene.faults.iter().any(|fault| own(&fault.satellites))
        };
        let (mut code, mut doppler): (Option<Worst>, Option<Worst>) = (None, None);
        for link in errors.signals.keys().filter(|link| !at_fault(link)) {
            let (mut codes, mut dopplers) =
                (Numbers::new(errors.positions.directory()), Numbers::new(errors.positions.directory()));
            for row in errors.signals.cursor(link) {
                let row = row?;
                if !run.scene.expect.bounded(row.time_s) {
                    codes.push(row.code_m.abs())?;
                    dopplers.push(row.doppler_hz.abs())?;
                }
            }
            let Some((code_m, doppler_hz)) = codes.percentile(0.95)?.zip(dopplers.percentile(0.95)?) else { continue };
            let mut excess_m = 0.0_f64;
            run.rays.each(link, |ray| excess_m = excess_m.max(ray.excess_m))?;
            let rates_hz = link.signal.components.iter().map(|component| component.chip_rate_hz);
            let chip_m = SPEED_OF_LIGHT_MPS / rates_hz.fold(f64::INFINITY, f64::min);
            let limit = 0.5 * chip_m + excess_m + claims.place_m + claims.clock_m;
            code = Worst::nearer(code, Worst { name: run.name(link), value: code_m, limit });
            let rate_mps = mirrors_mps + claims.speed_mps + claims.drift_mps;
            let limit = LOOP_HZ + rate_mps / link.wavelength_m();
            doppler = Worst::nearer(doppler, Worst { name: run.name(link), value: doppler_hz, limit });
        }
        self.excused_velocity(run, errors, mirrors_mps + claims.speed_mps)?;
        for (figure, unit, worst, source) in [
            (
                "code error where any is expected, 95 %",
                "m",
                code,
                "half a chip, reflections, the spoofer's position and clock",
            ),
            (
                "Doppler error where any is expected, 95 %",
                "Hz",
                doppler,
                "a loop's pull-in, mirrors, the spoofer's motion and clock",
            ),
        ] {
            let Some(worst) = worst else { continue };
            let source = format!("{source}; {} is nearest to its limit or beyond", worst.name);
            self.judge(figure, "", worst.value, unit, Bound::Max(worst.limit), &source);
        }
        Ok(())
    }

    fn excused_velocity(&mut self, run: &Run, errors: &Errors, rate_mps: f64) -> Result<(), JudgeError> {
        let mut velocities = Numbers::new(errors.positions.directory());
        for row in errors.positions.cursor() {
            let row = row?;
            if !run.scene.expect.bounded(row.time_s) {
                velocities.push(row.velocity_enu_mps.norm())?;
            }
        }
        if let Some(velocity_mps) = velocities.percentile(0.95)? {
            let bound = Bound::Max(LOOP_MPS + rate_mps);
            let source = "a loop's pull-in, mirrors and the spoofer's motion";
            self.judge("velocity error where any is expected, 95 %", "", velocity_mps, "m/s", bound, source);
        }
        Ok(())
    }
}
