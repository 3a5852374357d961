//! Satellites whose ephemerides end.

use std::path::Path;

use crate::presence::*;
use crate::scenario::{Overrides, Scenario};
use crate::scene::Scene;
use crate::{stream, truth};
use gnss::record::{PassEnd, PassRow};
use gnss::time::Epoch;
use std::ops::Range;

/// The embedded day's last ephemerides end at midnight, but for those of two uploads.
fn midnight(duration_s: f64) -> (Scene, Vec<String>) {
    let start_s = 86_400.0 - duration_s / 2.0;
    let (hour, rest) = ((start_s / 3600.0).floor(), start_s % 3600.0);
    let text = format!(
        "name = \"x\"\nstart = 2010-07-01T{hour:02}:{:02}:{:04.1}\nduration_s = {duration_s}\n\
         [motion]\nkind = \"static\"\nlatitude_deg = 26.5123\nlongitude_deg = 80.2329\nheight_m = 130\n\
         [front_end]\nsample_rate_hz = 1.1e6\nformat = \"ci8\"\n",
        (rest / 60.0).floor(),
        rest % 60.0
    );
    Scenario::parse(&text, "midnight").unwrap().compose(Path::new("."), &Overrides::default()).unwrap()
}

#[test]
fn a_satellite_whose_ephemeris_ends_is_warned_of_by_name_and_time() {
    let (scene, warnings) = midnight(1200.0);
    let warning = warnings.iter().find(|w| w.contains("does not cover the scene")).unwrap();
    assert!(warning.contains("2010-07-02T00:00:00.000000 GPST (600.0 s) on"), "{warning}");
    let missing = missing(&scene, 1200.0).unwrap();
    // Each is named and not sent after midnight; most were in view until then, others would rise later.
    let mut ended = 0;
    for Missing { sv, silence } in &missing {
        assert!(warning.contains(&sv.to_string()), "{warning}");
        let end = silence.from.unwrap();
        let at = |t: Epoch| presence(&scene, *sv, t, &scene.trajectory.at(0.0)).unwrap().end();
        assert_eq!(at(end), Some(PassEnd::Ephemeris), "{sv}");
        ended += usize::from(at(end.plus_s(-0.001)).is_none());
    }
    assert!(ended >= 6, "{missing:?}");
    // Before midnight the same file says all there is to say.
    assert!(crate::presence::missing(&scene, 599.0).unwrap().is_empty());
}

#[test]
fn the_truth_s_passes_say_that_an_ephemeris_ended_and_not_that_a_satellite_set() {
    let (scene, _) = midnight(4.0);
    let directory = tempfile::tempdir().unwrap();
    let rows = |part: Range<u64>| -> Vec<PassRow> {
        let mut writer = truth::Writer::create(directory.path()).unwrap();
        let (mut sink, options) = (std::io::sink(), stream::Options::default());
        stream::generate_part(&scene, part, &mut sink, &mut writer, &mut |_| (), &options).unwrap();
        let mut file = csv::Reader::from_path(directory.path().join("passes.csv")).unwrap();
        file.deserialize().map(Result::unwrap).collect()
    };
    let whole = rows(0..scene.samples);
    let ended: Vec<&PassRow> = whole.iter().filter(|row| row.ends_by == PassEnd::Ephemeris).collect();
    assert_eq!(ended.len(), missing(&scene, 4.0).unwrap().len());
    for row in &whole {
        assert_eq!((row.sample, row.begins_by), (0, PassEnd::Scene), "{row:?}");
        let until = if row.ends_by == PassEnd::Scene { scene.samples } else { 2_200_000 };
        assert_eq!(row.until_sample, until, "{row:?}");
    }
    // A part that begins later says the same of its own samples, and one that ends before says nothing of the
    // end.
    let part = rows(1_500_000..3_000_000);
    assert_eq!(part.len(), whole.len());
    for (row, of) in part.iter().zip(&whole) {
        let until_sample = of.until_sample.min(3_000_000) - 1_500_000;
        assert_eq!(*row, PassRow { sample: 0, until_sample, ..*of });
    }
    assert!(rows(0..2_000_000).iter().all(|row| row.ends_by == PassEnd::Scene && row.until_sample == 2_000_000));
}
