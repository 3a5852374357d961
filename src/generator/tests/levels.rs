//! Levels as stated, against figures computed by hand and against the samples themselves.

use std::path::Path;

use crate::levels::*;
use crate::scenario::{Overrides, Scenario};
use crate::scene::Scene;
use crate::stream::{Options, Stream};
use crate::truth;

/// Two seconds at 2.6 Msps with nothing above the mask.
const EMPTY: &str = "name = \"levels\"\nstart = 2010-07-01T08:05:58\nduration_s = 2\n[motion]\nkind = \"static\"\n\
    latitude_deg = 26.5\nlongitude_deg = 80.2\nheight_m = 130\n";
const NO_SATELLITE: &str = "[satellites]\nmask_deg = 89\n";

fn scene(tables: &str) -> Scene {
    let scenario = Scenario::parse(&format!("{EMPTY}{tables}"), "levels").unwrap();
    scenario.compose(Path::new("."), &Overrides::default()).unwrap().0
}

fn levels(tables: &str) -> Levels {
    Levels::new(&scene(tables)).unwrap()
}

/// Root mean square of a component of the first quarter of a second of the file, in LSB.
fn file_rms_lsb(scene: &Scene) -> f64 {
    let directory = tempfile::tempdir().unwrap();
    let mut truth = truth::Writer::create(directory.path()).unwrap();
    let mut stream = Stream::of(scene, 0..650_000, &mut truth, &Options::default()).unwrap();
    let (mut packed, mut bytes) = (Vec::new(), Vec::new());
    while stream.next(&mut truth, &mut packed).unwrap() {
        bytes.extend_from_slice(&packed);
    }
    let (mut i, mut q) = (Vec::new(), Vec::new());
    scene.metadata.format.unpack(&bytes, &mut i, &mut q);
    let square = |plane: &[f32]| plane.iter().map(|x| f64::from(*x) * f64::from(*x)).sum::<f64>();
    ((square(&i) + square(&q)) / (2 * i.len()) as f64).sqrt()
}

#[test]
fn noise_has_the_level_of_its_gain_and_so_have_the_samples() {
    let tables = format!(
        "{NO_SATELLITE}[noise]\n[front_end]\nsample_rate_hz = 2.6e6\nformat = \"ci8\"\n\
         noise_lsb = 28\n"
    );
    let found = levels(&tables);
    // 20 lg (28 / 127) = −13.133.
    assert!((found.noise_dbfs.unwrap() + 13.133).abs() < 1e-3, "{found}");
    // 5e5 squares of a Gaussian: 4.34 √(2 / 5e5) dB = 0.0087; five sigma.
    assert!((found.sum_dbfs + 13.133).abs() < 0.044, "{found}");
    // Rounding to integers adds a twelfth: 4.6e-4 dB.
    let file_dbfs = 20.0 * libm::log10(file_rms_lsb(&scene(&tables)) / 127.0);
    assert!((found.sum_dbfs - file_dbfs).abs() < 0.044, "{found} {file_dbfs}");
    assert!(
        found.scale.contains("127 LSB of ci8") && found.strongest.is_none() && found.clipped_share < 1e-4,
        "{found}"
    );
}

#[test]
fn a_satellite_and_a_jammer_have_the_levels_that_their_powers_over_noise_have_in_the_samples() {
    // One satellite, G23, of 70 dB-Hz: variance a component 28² · 10^7 / 2.6e6, 54.91 LSB; over 127 it is
    // −7.283 dB.
    let one = "[power]\ncn0_dbhz = 70\n[satellites]\nmask_deg = 75\n\
        [front_end]\nsample_rate_hz = 2.6e6\nformat = \"ci8\"\nnoise_lsb = 28\n";
    let found = levels(one);
    assert!(found.noise_dbfs.is_none() && found.strongest.is_some_and(|(_, cn0)| (cn0 - 70.0).abs() < 1e-9), "{found}");
    assert!((found.satellite_dbfs(70.0) + 7.283).abs() < 1e-3, "{}", found.satellite_dbfs(70.0));
    let file_dbfs = 20.0 * libm::log10(file_rms_lsb(&scene(one)) / 127.0);
    // Area edges leave 1 − d/3 of random chips, −0.610 dB; a code's own transitions differ by 0.05 dB.
    let kept_db = 10.0 * libm::log10(1.0 - 1.023 / 2.6 / 3.0);
    assert!(
        (file_dbfs + 7.283 - kept_db).abs() < 0.1 && (found.sum_dbfs - file_dbfs).abs() < 0.05,
        "{file_dbfs} {found}"
    );
    // A tone 20 dB over 45 dB-Hz: 28 · √(10^6.5 / 2.6e6) = 30.88 LSB, −12.282 dB.
    let jammed = format!(
        "{NO_SATELLITE}[power]\ncn0_dbhz = 45\n[front_end]\nsample_rate_hz = 2.6e6\nformat = \"ci8\"\nnoise_lsb = 28\n\
         [[interference]]\nkind = \"cw\"\noffset_hz = 314159.27\njs_db = 20\n"
    );
    let found = levels(&jammed);
    let jn0 = found.sources[0].jn0_dbhz.unwrap();
    assert!((jn0.least - 65.0).abs() < 1e-9 && (jn0.most - 65.0).abs() < 1e-9, "{found}");
    assert!((found.dbfs(65.0) + 12.282).abs() < 1e-3, "{}", found.dbfs(65.0));
    let file_dbfs = 20.0 * libm::log10(file_rms_lsb(&scene(&jammed)) / 127.0);
    assert!((found.sum_dbfs + 12.282).abs() < 1e-3, "{found}");
    // Rounding a sine of amplitude A = 43.7 LSB moves its power A²/2 by up to 2A/π·√(1/(π²A)): 1.4e-3, or
    // 0.006 dB.
    assert!((file_dbfs + 12.282).abs() < 7e-3, "{file_dbfs} {found}");
}

#[test]
fn the_clipped_share_is_that_of_a_gaussian_beyond_full_scale() {
    let loud =
        format!("{NO_SATELLITE}[noise]\n[front_end]\nsample_rate_hz = 2.6e6\nformat = \"ci8\"\nnoise_lsb = 50\n");
    // Beyond 127.5 / 50 = 2.55 sigma: erfc(2.55 / √2) = 0.010772. Of 524 288 components: sigma 1.43e-4, five
    // of them.
    let found = levels(&loud);
    assert!((found.clipped_share - 0.010_772).abs() < 7.2e-4, "{found}");
    assert!(found.worst.0 >= found.clipped_share && found.to_string().contains("clipped: 1."), "{found}");
}

#[test]
fn behind_gain_control_full_scale_follows_the_sum() {
    let tables = format!(
        "{NO_SATELLITE}[noise]\n[front_end]\nsample_rate_hz = 2.6e6\nformat = \"ci8\"\nnoise_lsb = 28\n\
         [adc]\nbits = 2\nagc_window_s = 0.01\n"
    );
    let found = levels(&tables);
    // Two steps of 0.9957 sigma: −20 lg 1.9914 = −5.983 dB, whatever the gain.
    assert!((found.sum_dbfs + 5.983).abs() < 1e-3, "{found}");
    assert!((found.noise_dbfs.unwrap() + 5.983).abs() < 0.044 && found.scale.contains("adc"), "{found}");
}
