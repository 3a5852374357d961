//! Searches by theory: the power of their sums against the receiver's threshold, and when the next one comes.

use std::f64::consts::PI;

use gnss::record::AcquisitionRow;
use receiver::threshold::threshold;
use receiver::track::cn0::LARGEST_CN0_DBHZ;

use super::channel::{Around, Channel, Followed, LOST_SHARE, State, World};
use super::clock::Instant;
use super::law::Law;
use super::rays::Sight;

/// Time for which a lost satellite is searched for eagerly.
const EAGER_S: f64 = 30.0;
/// Largest number of doublings of the time between searches without result.
const MOST_DOUBLINGS: u32 = 4;
/// Cells of a search of one satellite, for the threshold: as many chips as a code has, in half chips, and
/// Dopplers of ±5 kHz.
const DOPPLERS_HZ: f64 = 10_000.0;

impl Channel {
    /// Searches at `next_s`, and begins to follow what is found.
    pub(super) fn search(
        &mut self,
        world: &World<'_>,
        around: Around,
        (cn0_hz, next_s, misses): (f64, f64, u32),
        (instant, sight): (&Instant, Option<&Sight>),
    ) -> Option<AcquisitionRow> {
        let operation = &world.settings.operation;
        self.attempts += 1;
        let begun_s = next_s - world.first_search_s;
        let found = sight.and_then(|sight| self.look(world, (cn0_hz, sight), instant, instant.sample_at(begun_s)));
        if found.is_some() {
            let law = world.law;
            self.mean_hz = cn0_hz;
            self.inverted = !law.is_pilot && self.stream.part(1).word(self.attempts) & 1 == 1;
            self.slipped_cycles = if self.inverted { 0.5 } else { 0.0 };
            let (code, carrier) = self.stream.part(2).normals(self.attempts);
            let (strength, _) = self.stream.part(3).normals(self.attempts);
            (self.code, self.carrier, self.strength) = (code, carrier, strength);
            self.listening.begin(next_s + law.lock_s());
            self.state = State::Followed(Followed {
                lock_s: next_s + law.lock_s(),
                symbols_s: f64::INFINITY,
                is_synchronised: false,
                locked_since_s: None,
                missing_since_s: None,
                cosine: 1.0,
                base: 0,
                symbol: None,
            });
            self.known = true;
            return found;
        }
        let is_eager = self.lost_s.is_some_and(|lost_s| instant.seconds - lost_s < EAGER_S);
        let wait_s = match (around.has_fix, is_eager) {
            (true, true) => LOST_SHARE * operation.reacquisition_interval_s,
            (false, true) => operation.reacquisition_interval_s,
            _ if around.is_led || (around.has_fix && self.known) => {
                operation.reacquisition_interval_s * f64::from(1_u32 << misses.min(MOST_DOUBLINGS))
            }
            _ => operation.search_interval_s,
        };
        let next_s = next_s.max(instant.seconds - wait_s) + wait_s;
        self.state = State::Sought { next_s, misses: misses + 1 };
        None
    }

    /// Outcome of a search whose samples begin with one of the first front end, where it finds the signal.
    fn look(
        &self,
        world: &World<'_>,
        (cn0_hz, sight): (f64, &Sight),
        instant: &Instant,
        sample: u64,
    ) -> Option<AcquisitionRow> {
        let Law { search: (coherent_s, sums), component, code, grid, .. } = world.law;
        let chips = f64::from(component.code_chips);
        let cells = 2.0 * chips * DOPPLERS_HZ * coherent_s / world.settings.acquisition.doppler_step_cycles;
        let satellites = 32.0;
        let probability = world.settings.acquisition.false_alarm_probability / (cells * satellites);
        let least = threshold(probability.max(1e-300), 2 * sums);
        let amplitude = (2.0 * coherent_s * code.share * grid * cn0_hz).sqrt();
        let stream = self.stream.part(4).part(self.attempts);
        let power = |sum: u32| {
            let (i, q) = stream.normals(u64::from(sum));
            (amplitude + i) * (amplitude + i) + q * q
        };
        let (count, statistic) = (f64::from(*sums), (0..*sums).map(power).sum::<f64>());
        if statistic <= least {
            return None;
        }
        // Refined in frequency and delay with all energy of the search.
        let energy = count * coherent_s * code.share * cn0_hz;
        let (a, b) = if self.density.is_some() { stream.normals(1 << 32) } else { (0.0, 0.0) };
        let doppler_hz = a * (1.5 / energy).sqrt() / (PI * coherent_s) - sight.rate_hz;
        let (own, later_s) = instant.own(world.law.front)?;
        let at = world.transmitter.code_at(world.scene, world.law.lead, own, sight.delay_s + later_s)?;
        let rate = component.chip_rate_hz * (1.0 + doppler_hz / self.link.carrier_hz());
        let passed_s = (instant.sample - sample) as f64 / world.rate_hz;
        let phase = (at.share + 0.5 * b / energy.sqrt() / chips) * chips - rate * passed_s;
        let found_hz = ((statistic / count - 2.0) / (2.0 * coherent_s * code.share * grid)).max(1.0);
        Some(AcquisitionRow {
            sample,
            sv: self.link.sv,
            signal: self.link.signal,
            acquired: true,
            statistic,
            threshold: least,
            doppler_hz,
            code_phase_chips: phase.rem_euclid(chips),
            cn0_dbhz: (10.0 * libm::log10(found_hz)).min(LARGEST_CN0_DBHZ),
        })
    }
}
