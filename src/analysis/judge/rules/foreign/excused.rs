//! Rules for a foreign receiver that remain where a spoofer sends or the scene expects errors of any size.
//!
//! Codes lie between the true position and the one that a spoofer claims, with half a chip and reflections
//! added. Dopplers lie within a loop's pull-in and the motion of mirrors and spoofer. The 95th percentile of
//! each satellite stays below that, as for our own receiver.

use std::collections::BTreeMap;

use super::plain::Scene;
use super::signals::Found;
use crate::judge::foreign::measured::{Measured, ObservationError};
use crate::judge::foreign::place::Places;
use crate::judge::rules::excused::{LOOP_HZ, LOOP_MPS};
use crate::judge::verdict::Verdict;
use crate::statistics::percentile;
use crate::waveform::leading;
use gnss::earth::SPEED_OF_LIGHT_MPS;
use gnss::signal::Link;

impl Verdict {
    pub(super) fn excused_foreign(&mut self, scene: &Scene<'_>, measured: Option<&Measured>, places: Option<&Places>) {
        let mut links: BTreeMap<Link, Vec<&ObservationError>> = BTreeMap::new();
        let rows = measured.iter().flat_map(|measured| &measured.rows);
        for row in rows.filter(|row| !scene.is_bounded(row.label_s) && scene.is_sound(&row.link, row.label_s)) {
            links.entry(row.link).or_default().push(row);
        }
        let (mut codes, mut dopplers) = (Vec::new(), Vec::new());
        for (link, rows) in &links {
            let high = |of: fn(&ObservationError) -> Option<f64>| {
                percentile(&rows.iter().filter_map(|row| of(row)).map(f64::abs).collect::<Vec<_>>(), 0.95)
            };
            let name = scene.run.name(*link);
            let chip_m = leading(link.signal).map_or(0.0, |own| SPEED_OF_LIGHT_MPS / own.chip_rate_hz);
            let limit = 0.5 * chip_m + scene.reach(link).code_m + scene.claims.place_m + scene.claims.clock_m;
            codes.extend(high(|row| row.code_m).map(|value| Found { name: name.clone(), value, limit }));
            let limit = LOOP_HZ + (scene.rate_mps() + scene.claims.drift_mps) / link.wavelength_m();
            dopplers.extend(high(|row| row.doppler_hz).map(|value| Found { name, value, limit }));
        }
        let source = "half a chip, reflections, the spoofer's position and clock";
        self.nearest("code error where any is expected, 95 %", "", "m", codes, source);
        let source = "a loop's pull-in, mirrors, the spoofer's motion and clock";
        self.nearest("Doppler error where any is expected, 95 %", "", "Hz", dopplers, source);
        let excused = places.iter().flat_map(|places| &places.rows).filter(|row| !scene.is_bounded(row.label_s));
        let speeds: Vec<f64> =
            excused.filter_map(|row| Some(libm::hypot(row.velocity_east_mps?, row.velocity_north_mps?))).collect();
        let limit = LOOP_MPS + scene.rate_mps();
        let found = percentile(&speeds, 0.95).map(|value| Found { name: "velocity".to_owned(), value, limit });
        self.nearest("velocity error where any is expected, 95 %", "", "m/s", found.into_iter().collect(), source);
    }
}
