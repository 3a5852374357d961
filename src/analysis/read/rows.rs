//! Rows of a run's long tables in a [`super::spill_store::SpillStore`].

use crate::read::spill_store::{SpillRow, Words};
use gnss::record::{
    BodyRow, ClockRow, InertialRow, IonosphereRow, Observation, RayRow, SkyRow, TrackingRow, TrajectoryRow,
};
use gnss::satellite::Sv;
use gnss::signal::Link;

impl SpillRow<Link> for Observation {
    const WORDS: usize = 8;

    fn put(&self, words: &mut Vec<u64>) {
        words.extend([self.sample, self.sent_s.cast_unsigned()]);
        let numbers = [self.sent_fraction_s, self.pseudorange_m, self.carrier_cycles, self.doppler_hz, self.cn0_dbhz];
        words.extend(numbers.map(f64::to_bits));
        words.push(self.locked_s.to_bits());
    }

    fn take(Link { sv, signal }: Link, words: &mut Words<'_>) -> Self {
        Self {
            sv,
            signal,
            sample: words.word(),
            sent_s: words.word().cast_signed(),
            sent_fraction_s: words.number(),
            pseudorange_m: words.number(),
            carrier_cycles: words.number(),
            doppler_hz: words.number(),
            cn0_dbhz: words.number(),
            locked_s: words.number(),
        }
    }
}

impl SpillRow<Link> for TrackingRow {
    const WORDS: usize = 9;

    fn put(&self, words: &mut Vec<u64>) {
        words.push(self.sample);
        words.extend([self.prompt_i, self.prompt_q, self.dll_discriminator_chips].map(f64::to_bits));
        words.extend([self.pll_discriminator_cycles, self.fll_discriminator_hz].map(f64::to_bits));
        words.extend([self.cn0_dbhz, self.phase_lock, self.integration_s].map(f64::to_bits));
    }

    fn take(Link { sv, signal }: Link, words: &mut Words<'_>) -> Self {
        Self {
            sv,
            signal,
            sample: words.word(),
            prompt_i: words.number(),
            prompt_q: words.number(),
            dll_discriminator_chips: words.number(),
            pll_discriminator_cycles: words.number(),
            fll_discriminator_hz: words.number(),
            cn0_dbhz: words.number(),
            phase_lock: words.number(),
            integration_s: words.number(),
            // No rule reads them.
            early_i: None,
            early_q: None,
            late_i: None,
            late_q: None,
            tap_spacing_chips: None,
        }
    }
}

impl SpillRow<Link> for SkyRow {
    const WORDS: usize = 7;

    fn put(&self, words: &mut Vec<u64>) {
        words.push(self.sample);
        words.extend([self.azimuth_deg, self.elevation_deg, self.range_m].map(f64::to_bits));
        words.extend([self.satellite_clock_m, self.ionosphere_m, self.troposphere_m].map(f64::to_bits));
    }

    fn take(Link { sv, signal }: Link, words: &mut Words<'_>) -> Self {
        Self {
            sv,
            signal,
            sample: words.word(),
            azimuth_deg: words.number(),
            elevation_deg: words.number(),
            range_m: words.number(),
            satellite_clock_m: words.number(),
            ionosphere_m: words.number(),
            troposphere_m: words.number(),
        }
    }
}

impl SpillRow<()> for TrajectoryRow {
    const WORDS: usize = 11;

    fn put(&self, words: &mut Vec<u64>) {
        words.extend([self.sample, self.gps_s.cast_unsigned(), self.gps_fraction_s.to_bits()]);
        words.extend([self.x_m, self.y_m, self.z_m, self.vx_mps, self.vy_mps, self.vz_mps].map(f64::to_bits));
        words.extend([self.clock_bias_s, self.clock_drift].map(f64::to_bits));
    }

    fn take((): (), words: &mut Words<'_>) -> Self {
        Self {
            sample: words.word(),
            gps_s: words.word().cast_signed(),
            gps_fraction_s: words.number(),
            x_m: words.number(),
            y_m: words.number(),
            z_m: words.number(),
            vx_mps: words.number(),
            vy_mps: words.number(),
            vz_mps: words.number(),
            clock_bias_s: words.number(),
            clock_drift: words.number(),
        }
    }
}

impl SpillRow<()> for InertialRow {
    const WORDS: usize = 8;

    fn put(&self, words: &mut Vec<u64>) {
        words.extend([self.gps_s.cast_unsigned(), self.gps_fraction_s.to_bits()]);
        words.extend([self.rate_x_radps, self.rate_y_radps, self.rate_z_radps].map(f64::to_bits));
        words.extend([self.force_x_mps2, self.force_y_mps2, self.force_z_mps2].map(f64::to_bits));
    }

    fn take((): (), words: &mut Words<'_>) -> Self {
        Self {
            gps_s: words.word().cast_signed(),
            gps_fraction_s: words.number(),
            rate_x_radps: words.number(),
            rate_y_radps: words.number(),
            rate_z_radps: words.number(),
            force_x_mps2: words.number(),
            force_y_mps2: words.number(),
            force_z_mps2: words.number(),
        }
    }
}

impl SpillRow<()> for BodyRow {
    const WORDS: usize = 12;

    fn put(&self, words: &mut Vec<u64>) {
        words.extend([self.gps_s.cast_unsigned(), self.gps_fraction_s.to_bits()]);
        words.extend([self.x_m, self.y_m, self.z_m, self.vx_mps, self.vy_mps, self.vz_mps].map(f64::to_bits));
        words.extend([self.qw, self.qx, self.qy, self.qz].map(f64::to_bits));
    }

    fn take((): (), words: &mut Words<'_>) -> Self {
        Self {
            gps_s: words.word().cast_signed(),
            gps_fraction_s: words.number(),
            x_m: words.number(),
            y_m: words.number(),
            z_m: words.number(),
            vx_mps: words.number(),
            vy_mps: words.number(),
            vz_mps: words.number(),
            qw: words.number(),
            qx: words.number(),
            qy: words.number(),
            qz: words.number(),
        }
    }
}

impl SpillRow<Sv> for IonosphereRow {
    const WORDS: usize = 3;

    fn put(&self, words: &mut Vec<u64>) {
        words.extend([self.sample, self.delay_m.to_bits(), self.sigma_m.to_bits()]);
    }

    fn take(sv: Sv, words: &mut Words<'_>) -> Self {
        Self { sv, sample: words.word(), delay_m: words.number(), sigma_m: words.number() }
    }
}

impl SpillRow<&'static str> for ClockRow {
    const WORDS: usize = 3;

    fn put(&self, words: &mut Vec<u64>) {
        words.extend([self.sample, self.clock_bias_s.to_bits(), self.sigma_clock_m.to_bits()]);
    }

    fn take(scale: &'static str, words: &mut Words<'_>) -> Self {
        let (sample, clock_bias_s) = (words.word(), words.number());
        Self { sample, time_scale: scale.to_owned(), clock_bias_s, sigma_clock_m: words.number() }
    }
}

impl SpillRow<Link> for RayRow {
    const WORDS: usize = 5;

    fn put(&self, words: &mut Vec<u64>) {
        words.extend([self.sample, u64::from(self.ray)]);
        words.extend([self.excess_m, self.amplitude_ratio, self.phase_cycles].map(f64::to_bits));
    }

    fn take(Link { sv, signal }: Link, words: &mut Words<'_>) -> Self {
        Self {
            sv,
            signal,
            sample: words.word(),
            // A number of 32 bits was put.
            ray: words.word() as u32,
            excess_m: words.number(),
            amplitude_ratio: words.number(),
            phase_cycles: words.number(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::read::spill_store::SpillStore;
    use gnss::gps::l1ca::L1_CA;

    #[test]
    fn a_row_of_each_kind_comes_back_as_it_was() {
        let (sv, link) = (Sv::gps(7), L1_CA.link(Sv::gps(7)));
        let place = std::path::Path::new("nowhere");
        let observation = Observation {
            sample: 1 << 60,
            sv,
            signal: &L1_CA,
            sent_s: -5,
            sent_fraction_s: 0.25,
            pseudorange_m: 2e7,
            carrier_cycles: -1e8,
            doppler_hz: 3.5,
            cn0_dbhz: f64::NAN,
            locked_s: 9.0,
        };
        let tracking = TrackingRow {
            sample: 3,
            sv,
            signal: &L1_CA,
            prompt_i: 1.0,
            prompt_q: 2.0,
            dll_discriminator_chips: 3.0,
            pll_discriminator_cycles: 4.0,
            fll_discriminator_hz: 5.0,
            cn0_dbhz: 6.0,
            phase_lock: 7.0,
            integration_s: 8.0,
            early_i: None,
            early_q: None,
            late_i: None,
            late_q: None,
            tap_spacing_chips: None,
        };
        let sky = SkyRow {
            sample: 4,
            sv,
            signal: &L1_CA,
            azimuth_deg: 1.0,
            elevation_deg: 2.0,
            range_m: 3.0,
            satellite_clock_m: 4.0,
            ionosphere_m: 5.0,
            troposphere_m: 6.0,
        };
        let ray = RayRow {
            sample: 5,
            sv,
            signal: &L1_CA,
            ray: u32::MAX,
            excess_m: 1.0,
            amplitude_ratio: 2.0,
            phase_cycles: 3.0,
        };
        fn back<K: Copy + Ord, T: SpillRow<K> + std::fmt::Debug>(key: K, row: &T, place: &std::path::Path) {
            let mut store = SpillStore::new(place);
            store.push(key, row).unwrap();
            let mut words = Vec::new();
            row.put(&mut words);
            assert_eq!(words.len(), T::WORDS);
            assert_eq!(format!("{:?}", store.rows(key).unwrap()), format!("[{row:?}]"));
        }
        back(link, &observation, place);
        back(link, &tracking, place);
        back(sky.link(), &sky, place);
        back(link, &ray, place);
        let place_row = TrajectoryRow {
            sample: 6,
            gps_s: -7,
            gps_fraction_s: 0.5,
            x_m: 1.0,
            y_m: 2.0,
            z_m: 3.0,
            vx_mps: 4.0,
            vy_mps: 5.0,
            vz_mps: 6.0,
            clock_bias_s: 7.0,
            clock_drift: 8.0,
        };
        back((), &place_row, place);
    }

    #[test]
    fn a_tracking_table_without_early_and_late_is_read() {
        let head = "sample,sv,signal,prompt_i,prompt_q,dll_discriminator_chips,pll_discriminator_cycles,\
                    fll_discriminator_hz,cn0_dbhz,phase_lock,integration_s";
        let with = format!("{head},early_i,early_q,late_i,late_q,tap_spacing_chips\n");
        let row = "3,G07,GPS L1 C/A,1,2,3,4,5,6,7,8";
        let read = |text: String| -> TrackingRow {
            csv::Reader::from_reader(text.as_bytes()).deserialize().next().unwrap().unwrap()
        };
        let (old, new) = (read(format!("{head}\n{row}\n")), read(format!("{with}{row},1,2,3,4,0.5\n")));
        assert_eq!((old.integration_s, old.early_i, old.tap_spacing_chips), (8.0, None, None));
        assert_eq!((new.early_i, new.late_q, new.tap_spacing_chips), (Some(1.0), Some(4.0), Some(0.5)));
        assert_eq!(read(format!("{with}{row},,,,,\n")).late_i, None);
    }
}
