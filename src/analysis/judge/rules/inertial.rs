//! Rules for inertial measurements: integrated back they give the motion, and their noise is what was asked.

use crate::judge::judgement::Bound;
use crate::judge::summary::Summary;
use crate::judge::verdict::Verdict;
use crate::measure::inertial::window::LARGEST_TURN_RAD;
use crate::measure::inertial::{Limited, SPAN_S};
use crate::read::Run;

impl Verdict {
    pub(super) fn inertial(&mut self, run: &Run, summary: &Summary) {
        let (Some(figures), Some(facts)) = (&summary.inertial, &run.scene.imu) else { return };
        if figures.turn_rad > LARGEST_TURN_RAD {
            let rate_hz = (facts.rate_hz * figures.turn_rad / LARGEST_TURN_RAD).ceil();
            self.not_judged.push(format!(
                "inertial measurements integrated back: the body turns {:.2} rad between two, and the integration \
                 needs {LARGEST_TURN_RAD} or less: expected imu.rate_hz of {rate_hz} and more",
                figures.turn_rad
            ));
        } else {
            let source = if facts.is_noisy() {
                format!("noise of the sensors over at most {SPAN_S} s, and what is allowed without")
            } else {
                format!("integration of at most {SPAN_S} s without noise")
            };
            let rows = [
                (
                    "position by inertial measurements, error",
                    "inertial.position_error_m",
                    "m",
                    figures.position_error_m,
                ),
                (
                    "attitude by inertial measurements, error",
                    "inertial.attitude_error_rad",
                    "rad",
                    figures.attitude_error_rad,
                ),
            ];
            for (figure, path, unit, limited) in rows {
                if let Some(Limited { value, limit }) = limited {
                    self.judge(figure, path, value, unit, Bound::Max(limit), &source);
                }
            }
        }
        let sensors = [
            ("gyroscopes", "gyro_allan", figures.gyro_allan),
            ("accelerometers", "accelerometer_allan", figures.accelerometer_allan),
        ];
        for (name, key, both) in sensors {
            let Some([most, least]) = both else { continue };
            let figure = |end: &str| format!("Allan deviation of the {name} beyond the one asked for, {end}");
            let source = "degrees of freedom of the estimate at its averaging time";
            self.judge(
                &figure("largest"),
                &format!("inertial.{key}.0"),
                most.value,
                "of 1",
                Bound::Max(most.limit),
                source,
            );
            self.judge(
                &figure("smallest"),
                &format!("inertial.{key}.1"),
                least.value,
                "of 1",
                Bound::Min(least.limit),
                source,
            );
        }
        if facts.is_noisy() && !facts.is_still {
            self.not_judged.push("Allan deviation of the inertial sensors: the body moves".to_owned());
        }
    }
}
