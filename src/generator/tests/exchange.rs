//! The truth as other programs read it.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use crate::scenario::{Overrides, Scenario};
use crate::stream::{Fronts, Options};
use crate::truth::{self, Record, Sink};
use ::rinex::prelude::{Rinex, TimeScale};
use gnss::exchange::Version;
use gnss::record::{Observation, TrajectoryRow};

/// Three systems, five signals on three carriers, ten epochs.
const SCENE: &str = "name = \"x\"\nstart = 2020-11-29T12:50:30\nduration_s = 0.5\nseed = 7\n\
    signals = [\"GPS L1 C/A\", \"Galileo E1\", \"Galileo E5a\", \"BeiDou B1I\"]\n\
    [motion]\nkind = \"static\"\nlatitude_deg = 37.605\nlongitude_deg = -0.986\nheight_m = 60\n\
    [power]\ncn0_dbhz = 45\n[ionosphere]\nmodel = \"nequick_g\"\n[receiver_clock]\nbias_s = 1.3e-4\ndrift_sps = 5e-8\n\
    [[front_end]]\nname = \"l1\"\ncenter_hz = 1575.42e6\nsample_rate_hz = 4.1e6\n\
    [[front_end]]\nname = \"b1\"\ncenter_hz = 1561.098e6\nsample_rate_hz = 4.1e6\n\
    [[front_end]]\nname = \"e5a\"\ncenter_hz = 1176.45e6\nsample_rate_hz = 10.3e6\n[truth]\ninterval_s = 0.05\n";

/// Value after rounding by `F14.3`.
fn printed(value: f64) -> f64 {
    format!("{value:.3}").parse().unwrap()
}

#[test]
fn rinex_of_the_truth_is_its_table_to_the_last_digit_and_flags_its_slips() {
    let scenario = Scenario::parse(SCENE, "exchange").unwrap();
    let scenes = scenario.compose_all(Path::new("."), &Overrides::default()).unwrap().0;
    let mut records: Vec<Record> = Vec::new();
    let (mut packed, mut sink) = (Vec::new(), |_: usize, _: &[u8]| Ok(()));
    let mut fronts = Fronts::new(&scenes, &mut records, &Options::default()).unwrap();
    while fronts.next(&mut records, &mut packed, &mut sink).unwrap() {}
    fronts.finish(&mut records).unwrap();
    // One satellite is gone for two epochs and begins again; another's lock begins again between two.
    let samples: BTreeSet<u64> = records
        .iter()
        .filter_map(|record| if let Record::Trajectory(row) = record { Some(row.sample) } else { None })
        .collect();
    let samples: Vec<u64> = samples.into_iter().collect();
    assert_eq!(samples.len(), 10);
    let mut satellites: Vec<_> = records
        .iter()
        .filter_map(|record| if let Record::Observation(row) = record { Some(row.sv) } else { None })
        .collect();
    satellites.sort();
    let (gone, slipped) = (satellites[0], *satellites.last().unwrap());
    records.retain(
        |record| !matches!(record, Record::Observation(row) if row.sv == gone && samples[4..6].contains(&row.sample)),
    );
    for record in &mut records {
        let Record::Observation(row) = record else { continue };
        let away_s = |from: usize| scenes[0].clock.rate.elapsed_s(row.sample - samples[from]);
        if row.sv == gone && row.sample >= samples[6] {
            row.locked_s = away_s(6);
        } else if row.sv == slipped && row.sample >= samples[3] {
            row.locked_s = away_s(3) + 0.01;
        }
    }

    for version in [Version::Three, Version::Four] {
        let directory = tempfile::tempdir().unwrap();
        let mut table = truth::Writer::create(directory.path()).unwrap();
        let mut files = truth::Rinex::new(directory.path(), version);
        let both = &mut (&mut table, &mut files);
        both.begin(&scenes, &(0..scenes[0].samples)).unwrap();
        records.iter().for_each(|record| both.take(record.clone()).unwrap());
        both.finish().unwrap();
        drop((table, files));
        let rows = |name: &str| csv::Reader::from_path(directory.path().join(name)).unwrap();
        let observed: Vec<Observation> = rows("observations.csv").deserialize().map(Result::unwrap).collect();
        let clock: Vec<TrajectoryRow> = rows("trajectory.csv").deserialize().map(Result::unwrap).collect();

        let text = std::fs::read_to_string(directory.path().join("observations.rnx")).unwrap();
        assert!(text.starts_with(&format!("{version:>9}")), "{text}");
        let file = Rinex::parse(&mut std::io::BufReader::new(text.as_bytes())).unwrap();
        let mut seen: BTreeMap<_, f64> = BTreeMap::new();
        let (mut compared, mut flags) = (0, 0);
        assert_eq!(file.observations_iter().count(), clock.len());
        for ((key, found), place) in file.observations_iter().zip(&clock) {
            let offset_s = place.clock_bias_s;
            let labelled_ns = key.epoch.to_time_scale(TimeScale::GPST).duration.total_nanoseconds();
            let reading_s = (place.gps_s - labelled_ns as i64 / 1_000_000_000) as f64 + place.gps_fraction_s + offset_s
                - (labelled_ns % 1_000_000_000) as f64 * 1e-9;
            // A label is to 0.1 µs, and its clock's offset says how large its error is.
            assert!(reading_s.abs() <= 0.51e-7, "{reading_s}");
            let off_s = found.clock.as_ref().map(|clock| clock.offset_s).unwrap();
            assert!((off_s - (offset_s - reading_s)).abs() < 2e-9, "{off_s} {offset_s} {reading_s}");
            let rows: Vec<&Observation> = observed.iter().filter(|row| row.sample == place.sample).collect();
            assert_eq!(found.signals.len(), 4 * rows.len(), "{text}");
            for row in rows {
                let value = |kind: &str| {
                    let code = format!("{kind}{}", row.signal.rinex);
                    let mut signals = found.signals.iter();
                    let sought = signals
                        .find(|s| (s.sv.to_string(), s.observable.to_string()) == (row.sv.to_string(), code.clone()));
                    sought.unwrap_or_else(|| panic!("{} {code}\n{text}", row.sv))
                };
                let [code, phase, doppler] = ["C", "L", "D"].map(|kind| value(kind).value);
                let own = [row.pseudorange_m, row.carrier_cycles, row.doppler_hz].map(printed);
                assert_eq!([code, phase, doppler], own, "{} {}", row.sv, row.signal.name);
                // Broken where the lock is younger than the epoch before.
                let reading_s = row.sample as f64 / scenes[0].clock.rate.hz();
                let before_s = seen.insert(row.link(), reading_s);
                let broken = before_s.is_some_and(|before_s| row.locked_s < reading_s - before_s - 1e-6);
                let flagged = value("L").lli.is_some_and(|flag| flag.bits() & 1 == 1);
                assert_eq!(flagged, broken, "{} {} {}\n{text}", row.sv, row.signal.name, row.sample);
                compared += 3;
                flags += usize::from(broken);
            }
        }
        let signals = |sv| observed.iter().filter(|row| row.sv == sv && row.sample == samples[9]).count();
        assert_eq!(flags, signals(gone) + signals(slipped), "{text}");
        assert!(compared > 400, "{compared}");
    }
}
