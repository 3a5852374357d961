//! Losses of the C/N0 that a receiver states, besides noise and other satellites.
//!
//! Filter and converter cause one loss ([`costs_db`]), and edges between samples another ([`edge_cost_db`]).
//! A third is due to data in phase with the pilot. Codes of the pair correlate at no delay by a number ρ of
//! the satellite's own, 0.03 for E1 of E11 and 0.001 for that of E27, with the sign of the data's symbol.
//! Prompts of a period T scatter by ρ²·2T·C/N0 of the data in units of their noise, along the carrier alone.
//! A receiver that measures its noise along the mean prompt, as phase jitter lies across it, counts that as
//! noise. Its loops are not affected, because the part across is zero, and early and late have equal parts.
//! Limits: ρ is that of the codes as sent, without the effect of edges. Symbols are a period long, so that
//! they are noise from prompt to prompt.

use std::collections::BTreeMap;

use crate::expect::followed::Followed;
use crate::expect::spectrum::{costs_db, edge_cost_db};
use crate::read::Run;
use gnss::signal::{Component, Layer, Link, Signal};

/// Losses of the stated C/N0.
#[derive(Clone, Debug, Default)]
pub struct Stated {
    front_ends_db: BTreeMap<&'static Signal, f64>,
    edges_db: BTreeMap<&'static Signal, f64>,
    /// Noise density of the own data of each satellite's signal over its C/N0, seconds.
    data_s: BTreeMap<Link, f64>,
}

impl Stated {
    /// Losses of a run.
    pub fn of(run: &Run) -> Self {
        let edges_db = run.signals.iter().map(|&signal| (signal, edge_cost_db(run, signal))).collect();
        let data_s = |link: Link| {
            let followed = Followed::of(run, link.signal).filter(|followed| followed.sides.is_none())?;
            Some((link, data_s(link, followed.component, followed.made)))
        };
        Self { front_ends_db: costs_db(run), edges_db, data_s: run.truth.keys().filter_map(data_s).collect() }
    }

    /// Decibels that filter and converter cost a signal.
    pub fn front_end_db(&self, signal: &'static Signal) -> f64 {
        self.front_ends_db.get(signal).copied().unwrap_or(0.0)
    }

    /// Decibels that a satellite's C/N0 lacks beside that, which is `effective_dbhz` with all other noise;
    /// negative where it gains.
    pub fn cost_db(&self, link: Link, effective_dbhz: f64) -> f64 {
        let edges_db = self.edges_db.get(link.signal).copied().unwrap_or(0.0);
        let data_s = self.data_s.get(&link).copied().unwrap_or(0.0);
        edges_db + 10.0 * libm::log10(1.0 + data_s * libm::pow(10.0, 0.1 * effective_dbhz))
    }

    /// C/N0 that a receiver should state, dB-Hz, for the one at the antenna with all other noise.
    pub fn expected_dbhz(&self, link: Link, effective_dbhz: f64) -> f64 {
        let passed_dbhz = effective_dbhz - self.front_end_db(link.signal);
        passed_dbhz - self.cost_db(link, passed_dbhz)
    }

    /// The C/N0 with all other noise of which a satellite's is stated: what its loops have.
    pub fn effective_dbhz(&self, link: Link, stated_dbhz: f64) -> f64 {
        // Costs grow by less than a tenth of what C/N0 does.
        (0..4).fold(stated_dbhz, |effective_dbhz, _| stated_dbhz + self.cost_db(link, effective_dbhz))
    }
}

/// 2T·ρ² of all data in phase with a pilot, by their shares of the power.
fn data_s(link: Link, pilot: &Component, made: Option<&Layer>) -> f64 {
    let is_beside = |other: &&Component| {
        let in_step = other.chip_rate_hz == pilot.chip_rate_hz && other.code_chips == pilot.code_chips;
        !std::ptr::eq(*other, pilot) && in_step && other.periods_per_symbol() == Some(1) && pilot.message.is_none()
    };
    let of = |data: &Component| {
        let rho = at_no_delay(link, pilot, made, data).unwrap_or(0.0);
        2.0 * pilot.period_s() * data.power_share * rho * rho
    };
    link.signal.components.iter().filter(is_beside).map(of).sum()
}

/// Correlation of data of unit power with a replica of unit power of the pilot beside them, along the
/// replica's carrier.
fn at_no_delay(link: Link, pilot: &Component, made: Option<&Layer>, data: &Component) -> Option<f64> {
    let (own, other) = ((pilot.code)(link.sv.number)?, (data.code)(link.sv.number)?);
    let replica = made.map_or(pilot.layers, std::slice::from_ref);
    let from_cycles = pilot.phase_cycles + replica.first()?.phase_cycles;
    let (of_pilot, of_data) = (pilot.steps_per_chip(), data.steps_per_chip());
    let steps = (1..=of_data).map(|times| times * of_pilot).find(|steps| steps.is_multiple_of(of_data))?;
    let wave = |one: &Component, layers: &[Layer], (chip, step): (usize, usize)| -> f64 {
        let value = |layer: &Layer| {
            let pulse = layer.pulse.get(step * layer.pulse.len() / steps).copied().unwrap_or(0);
            let cycles = one.phase_cycles + layer.phase_cycles - from_cycles;
            layer.weight * libm::cos(std::f64::consts::TAU * cycles) * f64::from(pulse)
        };
        layers.iter().filter(|layer| layer.covers(chip)).map(value).sum()
    };
    let (mut product, mut power) = (0.0, 0.0);
    for (chip, (own, other)) in own.iter().zip(&other).enumerate() {
        for step in 0..steps {
            let made = f64::from(*own) * wave(pilot, replica, (chip, step));
            product += made * f64::from(*other) * wave(data, data.layers, (chip, step));
            power += made * made;
        }
    }
    let count = (own.len() * steps) as f64;
    (power > 0.0).then(|| product / (count * power).sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;
    use gnss::galileo::e1::E1;
    use gnss::galileo::e5::E5A;
    use gnss::gps::l1ca::L1_CA;
    use gnss::satellite::{Sv, System};

    fn rho(signal: &'static Signal, number: u8) -> f64 {
        let [data, pilot] = [&signal.components[0], &signal.components[1]];
        let link = signal.link(Sv { system: System::Galileo, number });
        at_no_delay(link, pilot, pilot.layers.first(), data).unwrap()
    }

    #[test]
    fn data_of_e1_correlate_with_the_pilot_as_their_codes_do_and_those_of_e5a_lie_across() {
        // Sums of products of the printed codes, by another program; the pilot is sent with the other sign.
        // A replica of BOC(1,1) finds √(10/11) of the data.
        for (number, share) in [(7, 0.0264), (11, 0.0274), (12, -0.0186), (27, 0.0010), (33, -0.0293)] {
            let found = rho(&E1, number) / (10.0_f64 / 11.0).sqrt();
            assert!((found + share).abs() < 1e-4, "{number}: {found}");
        }
        for number in [7, 11, 33] {
            assert!(rho(&E5A, number).abs() < 1e-12, "{number}");
        }
    }

    #[test]
    fn a_pilot_s_c_n0_lacks_what_its_data_scatter_along_the_carrier() {
        let link = E1.link(Sv { system: System::Galileo, number: 11 });
        let all = Stated {
            data_s: [(link, data_s(link, &E1.components[1], E1.components[1].layers.first()))].into(),
            ..Stated::default()
        };
        // E11 alone at 39.85 dB-Hz: 2·4 ms·4830·0.0274²·10/11. Its C/N0 was 0.15 ± 0.04 dB lower over 120 s.
        let expected_db = 10.0 * libm::log10(1.0 + 2.0 * 0.004 * 4830.0 * 0.0274 * 0.0274 / 1.1);
        assert!((all.cost_db(link, 39.85) - expected_db).abs() < 2e-3, "{}", all.cost_db(link, 39.85));
        let stated_dbhz = 39.85 - all.cost_db(link, 39.85);
        assert!((all.effective_dbhz(link, stated_dbhz) - 39.85).abs() < 1e-5);
        // C/A has no data beside it.
        assert_eq!(data_s(L1_CA.link(Sv::gps(5)), &L1_CA.components[0], None), 0.0);
    }
}
