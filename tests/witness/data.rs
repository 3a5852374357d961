//! Location of the external data, and the tests that missed them.

use std::io::Write as _;
use std::path::{Path, PathBuf};

use gnss::bits::Field;
use gnss::broadcast::Ephemeris;
use gnss::earth::GPS_PI;
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

/// Field of a table as a document prints it: table, name, first bit, length, true with a sign, power of two,
/// true for semicircles.
pub type Printed = (&'static str, &'static str, u16, u8, bool, i32, bool);

/// Every field of tables has its printed position, sign and scale, bit by bit of parts of a length, and there
/// is no other.
pub fn fields_are_as_printed(tables: &[(&str, Vec<&Field>)], printed: &[Printed], part_bits: usize) {
    let fields: usize = tables.iter().map(|(_, fields)| fields.len()).sum();
    assert_eq!(fields, printed.len());
    for &(table, name, first, length, signed, exponent, semicircles) in printed {
        let (_, fields) = tables.iter().find(|(own, _)| *own == table).unwrap();
        let field = fields.iter().find(|field| field.name == name).unwrap();
        let unit = libm::exp2(f64::from(exponent)) * if semicircles { GPS_PI } else { 1.0 };
        for bit in 0..length {
            let mut part = vec![false; part_bits];
            part[usize::from(first + u16::from(bit))] = true;
            let weight = libm::exp2(f64::from(length - 1 - bit)) * if signed && bit == 0 { -1.0 } else { 1.0 };
            let found = field.value(field.read(&part));
            assert!((found / (weight * unit) - 1.0).abs() < 1e-15, "{table}: {name}, bit {bit}: {found}");
        }
    }
}

/// Orbit of an ephemeris by the record that a converter made of it, where one of Galileo and of BeiDou have
/// one scale; twelve digits are printed after the first.
pub fn orbit_is_recorded(set: &Ephemeris, record: &Ephemeris) {
    let semicircles = |exponent: i32| libm::exp2(f64::from(exponent)) * GPS_PI;
    for (name, of, step) in [
        ("m0", (|set| set.m0_rad) as fn(&Ephemeris) -> f64, semicircles(-31)),
        ("omega0", |set| set.omega0_rad, semicircles(-31)),
        ("omega", |set| set.omega_rad, semicircles(-31)),
        ("i0", |set| set.i0_rad, semicircles(-31)),
        ("omega dot", |set| set.omega_dot_radps, semicircles(-43)),
        ("delta n", |set| set.delta_n_radps, semicircles(-43)),
        ("idot", |set| set.idot_radps, semicircles(-43)),
        ("e", |set| set.eccentricity, libm::exp2(-33.0)),
        ("sqrt a", |set| set.sqrt_a_sqrtm, libm::exp2(-19.0)),
    ] {
        let (one, other) = (of(set), of(record));
        assert!((one - other).abs() <= 0.5 * step + 1e-12 * one.abs(), "{} {name}: {one} {other}", set.sv);
    }
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
