//! Table `[sbas]` as written, and the network that it becomes.

use std::sync::Arc;

use super::read::Table;
use super::satellite::SatelliteFault;
use super::{Scenario, ScenarioError, satellite_list};
use crate::augmentation::{Departure, Ground, GroundNetwork};
use crate::catalogue::Catalogue;
use crate::message::{FOREVER_S, MessageFault};
use crate::ray::Effect;
use crate::vehicle::Trajectory;
use gnss::augmentation::Network;
use gnss::satellite::{Sv, System};

/// `[sbas]`.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SbasSpec {
    /// True if the system reports test mode.
    pub test: bool,
    /// Satellites that it states must not be used.
    pub do_not_use: Vec<Sv>,
    /// True if it sends how its corrections degrade (type 10).
    pub degradation: bool,
}

pub(super) fn sbas(table: &Table<'_>) -> Result<SbasSpec, ScenarioError> {
    let do_not_use = satellite_list(table, "do_not_use")?.unwrap_or_default();
    if do_not_use.iter().any(|sv| sv.system != System::Gps) {
        return Err(table.bad("do_not_use", "satellites of GPS, which are those that SBAS corrects here"));
    }
    let degradation = table.flag("degradation")?.unwrap_or(false);
    Ok(SbasSpec { test: table.flag("test")?.unwrap_or(false), do_not_use, degradation })
}

impl Scenario {
    /// The network of the scene's augmentation system, if there is one.
    pub(super) fn network(
        &self,
        catalogue: &Arc<Catalogue>,
        effects: &[Arc<dyn Effect>],
        message_faults: &[MessageFault],
        (trajectory, end_s): (&Trajectory, f64),
        warnings: &mut Vec<String>,
    ) -> Result<Option<Arc<dyn Network>>, ScenarioError> {
        let Some(spec) = &self.sbas else { return Ok(None) };
        if !self.signals.iter().any(|signal| signal.system == System::Sbas) {
            let reason = "no signal of SBAS is sent that could say it: add \"SBAS L1\" to signals";
            return Err(self.conflict("sbas", reason.to_owned()));
        }
        let ground = Ground {
            catalogue: Arc::clone(catalogue),
            message_faults: message_faults.to_vec(),
            departures: self.satellite_faults.iter().flat_map(departures).collect(),
            start: self.start,
            is_test: spec.test,
            do_not_use: spec.do_not_use.clone(),
            sends_factors: spec.degradation,
            // The first of the effects, where there is one.
            ionosphere: self.ionosphere.as_ref().and_then(|_| effects.first().cloned()),
        };
        let times = [self.start, self.start.plus_s(end_s)];
        let network = GroundNetwork::around(ground, &trajectory.at(0.0), &times);
        for sv in spec.do_not_use.iter().filter(|sv| !network.numbers().contains(&sv.prn())) {
            warnings.push(format!("sbas.do_not_use names {sv}, which is not among the satellites in view"));
        }
        Ok(Some(Arc::new(network)))
    }
}

/// Clock errors of a fault. Its times are those of arrival, a fifteenth of a second after sending.
fn departures(fault: &SatelliteFault) -> Vec<(Sv, Departure)> {
    let each = |satellites: &[Sv], departure: Departure| satellites.iter().map(|sv| (*sv, departure.clone())).collect();
    match fault {
        SatelliteFault::Step { satellites, step_s, on_s, off_s } => {
            each(satellites, Departure::Step(*step_s, *on_s, off_s.unwrap_or(FOREVER_S)))
        }
        SatelliteFault::Ramp { satellites, drift, on_s, off_s } => {
            each(satellites, Departure::Ramp(*drift, *on_s, off_s.unwrap_or(FOREVER_S)))
        }
        // The catalogue has orbits; noise is not corrected.
        SatelliteFault::Noise { .. } | SatelliteFault::Orbit { .. } => Vec::new(),
    }
}
