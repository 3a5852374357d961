//! Location of the external data, and the tests that missed them.

use std::io::Write as _;
use std::path::{Path, PathBuf};

use gnss::broadcast::Ephemeris;
use gnss::time::Epoch;

/// Orbit and clock of a RINEX 4 record by fixed columns, from its line of satellite and epoch on, and a
/// reader of its numbers by row and column.
pub fn keplerian<'a>(record: &'a [&'a str]) -> (Ephemeris, impl Fn(usize, usize) -> f64 + 'a) {
    let v = |row: usize, i: usize| record[row][4 + 19 * i..23 + 19 * i].trim().parse::<f64>().unwrap();
    let head = record[0];
    let time: Vec<&str> = head[4..23].split_whitespace().collect();
    let calendar = format!("{}-{}-{}T{}:{}:{}", time[0], time[1], time[2], time[3], time[4], time[5]);
    let toe = Epoch::from_week(v(5, 2) as u32, v(3, 0));
    let set = Ephemeris {
        toc: Epoch::parse(&calendar).unwrap(),
        iode: v(1, 0) as u16,
        sqrt_a_sqrtm: v(2, 3),
        eccentricity: v(2, 1),
        m0_rad: v(1, 3),
        delta_n_radps: v(1, 2),
        omega0_rad: v(3, 2),
        omega_dot_radps: v(4, 3),
        omega_rad: v(4, 2),
        i0_rad: v(4, 0),
        idot_radps: v(5, 0),
        cuc_rad: v(2, 0),
        cus_rad: v(2, 2),
        crc_m: v(4, 1),
        crs_m: v(1, 1),
        cic_rad: v(3, 1),
        cis_rad: v(3, 3),
        af0_s: v(0, 1),
        af1_sps: v(0, 2),
        af2_sps2: v(0, 3),
        ..Ephemeris::blank(head[..3].parse().unwrap(), toe)
    };
    (set, v)
}

/// The path of a file under `GNSS_TWIN_DATA`, or `None` where it is not there. `tests/common/skipped.rs`
/// reports at the end of the run what was missed: a line goes past the capture of test output at once, and a
/// note to the build's directory.
pub fn external(name: &str) -> Option<PathBuf> {
    let root = std::env::var_os("GNSS_TWIN_DATA").map_or_else(|| PathBuf::from("../shared/data"), PathBuf::from);
    let path = root.join(name);
    let there = path.exists();
    note(name, there);
    if !there {
        let _ = writeln!(std::io::stderr(), "skipped: {} is absent", path.display());
    }
    there.then_some(path)
}

/// Remembers whether this test found that file, if it is a witness: what runs one under a planted fault
/// leaves the notes alone.
fn note(name: &str, there: bool) {
    let thread = std::thread::current();
    let Some(test) = thread.name().filter(|name| name.starts_with("witness::")) else { return };
    let test = test.replace("::", ".");
    let notes = Path::new(env!("CARGO_TARGET_TMPDIR")).join("witness");
    let note = notes.join(format!("{test} {}", name.replace('/', "%")));
    // A note that cannot be written is missed in the tally; no test depends on it.
    let _ = std::fs::create_dir_all(&notes);
    let _ = std::fs::write(note, if there { "found" } else { "absent" });
}
