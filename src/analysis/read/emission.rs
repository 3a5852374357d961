//! The truth's signals over a run: which there are, on which carriers, and each satellite's mean.

use std::collections::BTreeSet;

use crate::error::JudgeError;
use crate::read::spill_store::SpillStore;
use crate::statistics::Sum;
use gnss::record::Observation;
use gnss::satellite::Sv;
use gnss::signal::{Link, Signal};

/// A signal on a carrier: that of all satellites, or of those that share a channel of it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Emission {
    /// The signal.
    pub signal: &'static Signal,
    /// Frequencies are positive, so that their bits have their order.
    carrier: u64,
}

impl Emission {
    /// Emission of a satellite's signal.
    pub fn of(link: Link) -> Self {
        Self { signal: link.signal, carrier: link.carrier_hz().to_bits() }
    }

    /// Carrier as sent.
    pub fn carrier_hz(self) -> f64 {
        f64::from_bits(self.carrier)
    }

    /// Emissions of some satellites.
    pub fn all(links: impl Iterator<Item = Link>) -> BTreeSet<Self> {
        links.map(Self::of).collect()
    }
}

/// A satellite's signal on average over the run.
#[derive(Clone, Copy, Debug)]
pub struct MeanSignal {
    /// The satellite.
    pub sv: Sv,
    /// The signal.
    pub signal: &'static Signal,
    /// Carrier as received, and as sent.
    pub carrier_hz: f64,
    /// Carrier as sent, Hz.
    pub nominal_hz: f64,
    /// Mean power over noise density, Hz.
    pub cn0_hz: f64,
    /// Mean of the decibels, dB-Hz.
    pub cn0_mean_dbhz: f64,
}

/// The mean of each satellite's true signal over the run.
pub(super) fn means(truth: &SpillStore<Link, Observation>) -> Result<Vec<MeanSignal>, JudgeError> {
    let mut all = Vec::new();
    for Link { sv, signal } in truth.keys() {
        let [mut doppler_hz, mut cn0_hz, mut cn0_dbhz] = [Sum::default(); 3];
        truth.each(Link { sv, signal }, |row| {
            doppler_hz.add(row.doppler_hz);
            cn0_hz.add(libm::pow(10.0, row.cn0_dbhz / 10.0));
            cn0_dbhz.add(row.cn0_dbhz);
        })?;
        let means = (doppler_hz.mean(), cn0_hz.mean(), cn0_dbhz.mean());
        let (Some(doppler_hz), Some(cn0_hz), Some(cn0_mean_dbhz)) = means else { continue };
        all.push(MeanSignal {
            sv,
            signal,
            carrier_hz: signal.carrier_hz(sv) + doppler_hz,
            nominal_hz: signal.carrier_hz(sv),
            cn0_hz,
            cn0_mean_dbhz,
        });
    }
    Ok(all)
}
