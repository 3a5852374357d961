//! Recordings of antennas through the program as a user has them: a file and what its makers say of it in,
//! the satellites of its own search out, by default thresholds and over the default band of Dopplers.
//!
//! The lists are those that another program found, with FFT searches of its own, and satellites beyond them
//! that were proved otherwise; where it says how, the test that has them. Limits: the lists of the strongest
//! end where that program's did, so that absence from one proves nothing.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::process::Command;

use gnss::record::AcquisitionRow;

use super::data::external;
use super::packed::HANOI;

/// Satellites that were found, by signal and name; a channel of GLONASS stands for those that share it.
type Found = BTreeMap<&'static str, BTreeMap<String, AcquisitionRow>>;

/// Searches `file` for signals of these names, or for what its band holds where there are none; `more` are
/// other settings of the search.
fn received(file: &Path, flags: &[&str], signals: &[&str], more: &str) -> Found {
    let place = tempfile::tempdir().unwrap();
    let [settings, out] = ["settings.toml", "out"].map(|name| place.path().join(name));
    let named = if signals.is_empty() { String::new() } else { format!("signals = {signals:?}\n") };
    std::fs::write(&settings, format!("[acquisition]\n{named}{more}\n")).unwrap();
    let program = Command::new(env!("CARGO_BIN_EXE_gnss-twin"))
        .args(["receive".as_ref(), file.as_os_str(), "--quiet".as_ref(), "--out".as_ref(), out.as_os_str()])
        .args(["--receiver".as_ref(), settings.as_os_str()])
        .args(flags)
        .output()
        .unwrap();
    // None of these recordings is long enough for a position.
    assert_eq!(program.status.code(), Some(3), "{}", String::from_utf8_lossy(&program.stderr));
    let rows = csv::Reader::from_path(out.join("acquisition.csv")).unwrap().into_deserialize();
    let mut found = Found::new();
    for row in rows.map(|row| -> AcquisitionRow { row.unwrap() }).filter(|row| row.acquired) {
        println!(
            "{} {}: {:.2} of its threshold, {:.0} Hz, {:.1} chips",
            row.sv,
            row.signal,
            row.statistic / row.threshold,
            row.doppler_hz,
            row.code_phase_chips
        );
        let name = row.signal.link(row.sv).channel().map_or_else(|| row.sv.to_string(), |channel| channel.to_string());
        found.entry(row.signal.name).or_default().insert(name, row);
    }
    found
}

/// Exactly these satellites, by signal: those that others found, and those beyond their list.
fn assert_found(found: &Found, expected: &[(&str, &str, &str)]) {
    let names = |text: &str| text.split_whitespace().map(str::to_owned).collect::<BTreeSet<String>>();
    let expected: BTreeMap<&str, BTreeSet<String>> = (expected.iter())
        .map(|(signal, listed, beyond)| (*signal, names(listed).union(&names(beyond)).cloned().collect()))
        .collect();
    let found: BTreeMap<&str, BTreeSet<String>> =
        found.iter().map(|(signal, rows)| (*signal, rows.keys().cloned().collect())).collect();
    assert_eq!(found, expected);
}

/// The recording of three bands beside its metadata, as the standard wants them.
fn hanoi(place: &Path) -> Option<PathBuf> {
    let file = external("if-signals/jrc_hanoi_2015-04-08_l1_l2_l5_1bit.bin")?;
    let name = file.file_name()?.to_str()?.to_owned();
    std::fs::copy(&file, place.join(&name)).unwrap();
    let whole = format!("<file id=\"w\"><url>{name}</url><lane id=\"m\"/></file></metadata>");
    let metadata = place.join("hanoi.xml");
    std::fs::write(&metadata, HANOI.replace("</metadata>", &whole)).unwrap();
    Some(metadata)
}

/// Checks the list and six more satellites of GPS. Each is found in both halves of the recording, which share
/// no sample, at one Doppler to 6 Hz. The chance of that is one in 800, in steps of 250 Hz over ±5 kHz. Three
/// of them are also found on another carrier.
#[test]
fn one_bit_samples_of_l1_hold_gps_and_galileo_as_listed_and_none_else() {
    let place = tempfile::tempdir().unwrap();
    let Some(file) = hanoi(place.path()) else { return };
    let found = received(&file, &["--channel", "L1"], &["GPS L1 C/A", "Galileo E1"], "");
    assert_found(
        &found,
        &[("GPS L1 C/A", "G01 G03 G04 G07 G11 G28 G30", "G06 G09 G13 G17 G19 G32"), ("Galileo E1", "E11 E12", "")],
    );
}

/// Codes of 20 ms take long to find: `GNSS_TWIN_LONG=1`. Beyond the list G06, G09 and G17, as on L1.
#[test]
fn one_bit_samples_of_l2_hold_l2c_as_listed_and_none_else() {
    let place = tempfile::tempdir().unwrap();
    let Some(file) = hanoi(place.path()).filter(|_| crate::long::is_asked_for()) else { return };
    let found = received(&file, &["--channel", "L2"], &["GPS L2C"], "");
    assert_found(&found, &[("GPS L2C", "G01 G03 G07 G30", "G06 G09 G17")]);
}

/// A satellite of NavIC is there with 60 dB-Hz, whose lines at whole kilohertz passed for three of BeiDou,
/// which sent no B2a in 2015. Beyond the list G09, as on L1 and L2.
#[test]
fn one_bit_samples_of_l5_hold_three_systems_as_listed_and_nothing_of_a_fourth() {
    let place = tempfile::tempdir().unwrap();
    let Some(file) = hanoi(place.path()) else { return };
    let signals = ["GPS L5", "Galileo E5a", "NavIC L5", "BeiDou B2a"];
    let found = received(&file, &["--channel", "L5"], &signals, "");
    assert_found(
        &found,
        &[("GPS L5", "G01 G03 G30", "G09"), ("Galileo E5a", "E11 E12", ""), ("NavIC L5", "I01 I02 I03", "")],
    );
}

/// Two bits, real, four samples a byte.
const MUNICH: [&str; 6] = ["--bits", "2", "--encoding", "twos-complement", "--lowest-first", "--real"];

/// Checks the listed satellites without G24. By sums of 1, 2, 4 and 8 ms over the whole recording no cell of
/// G24 exceeds those of noise. The recording also has G12 and G14, in both halves at one Doppler to 5 Hz, and
/// E20, which `recording.rs` knows.
#[test]
fn two_bit_samples_of_l1_hold_gps_and_galileo_as_listed_and_none_else() {
    let Some(file) = external("if-signals/ifen_e1_2016-01-19_20msps_r2bit.bin") else { return };
    let flags = [&MUNICH[..], &["--rate-hz", "20e6", "--if-hz", "5000446"]].concat();
    let found = received(&file, &flags, &["GPS L1 C/A", "Galileo E1"], "");
    let listed = "G01 G03 G06 G09 G11 G17 G19 G22 G23 G31 G32";
    assert_found(&found, &[("GPS L1 C/A", listed, "G12 G14"), ("Galileo E1", "E11 E12 E19 E30", "E20")]);
}

/// Four carriers in 50 MHz, by a hundred million samples a second: `GNSS_TWIN_LONG=1`. Beyond the list is
/// C02, which stands still over the equator as C05 does, and has its Doppler to 2 Hz.
#[test]
fn fifty_megahertz_hold_four_signals_of_three_systems_as_listed_and_none_else() {
    let Some(file) = external(super::recording_e5::FILE).filter(|_| crate::long::is_asked_for()) else { return };
    // What GPS L1 would have: 1575.42 MHz less 1191.795 MHz beyond the IF of E5's middle.
    let flags = [&MUNICH[..], &["--rate-hz", "100e6", "--if-hz", "458624467.6"]].concat();
    let signals = ["GPS L5", "Galileo E5a", "Galileo E5b", "BeiDou B2I"];
    let found = received(&file, &flags, &signals, "");
    assert_found(
        &found,
        &[
            ("GPS L5", "G01 G03 G06 G09", ""),
            ("Galileo E5a", "E11 E12 E19 E30", ""),
            ("Galileo E5b", "E11 E12 E19 E30", ""),
            ("BeiDou B2I", "C05 C07 C09 C10 C14", "C02"),
        ],
    );
}

/// Two front ends of one moment, of which nothing says what they hold but where they lie. The band of the
/// first ends below channel 6. Its list has channels 1 and 5 as weak: 4 ms are too short for them, and 5 is
/// 63 Hz beyond the default band of Dopplers, as G2 shows it.
#[test]
fn both_bands_of_glonass_hold_the_channels_listed_and_none_else() {
    let flags = |if_hz: &'static str| ["--format", "ci8", "--rate-hz", "6.625e6", "--if-hz", if_hz];
    if let Some(file) = external("if-signals/nt1065_glonass_g1_2016-08-31_6625ksps_ci8.bin") {
        let found = received(&file, &flags("-26.58e6"), &[], "");
        assert_found(&found, &[("GLONASS G1", "-4 -3 -1 0 4", "")]);
    }
    if let Some(file) = external("if-signals/nt1065_glonass_g2_2016-08-31_6625ksps_ci8.bin") {
        let found = received(&file, &flags("329.42e6"), &[], "");
        assert_found(&found, &[("GLONASS G2", "-4 -3 -1 0 4 5", "1")]);
    }
}

/// A local oscillator 9 kHz off, and 4 ms: one sum of 3 ms finds G02, of 40 dB-Hz, and a search around the
/// Dopplers that a wider one found finds G31, at 11.8 kHz.
#[test]
fn four_milliseconds_of_a_distant_oscillator_hold_gps_as_listed_and_none_else() {
    let Some(file) = external("if/cttc_l1_2012-07-26_4msps_cf32.bin") else { return };
    let found = received(&file, &["--format", "cf32", "--rate-hz", "4e6"], &["GPS L1 C/A", "QZSS L1 C/A"], "");
    assert_found(&found, &[("GPS L1 C/A", "G02 G12 G25 G29 G31", "")]);
}

const POCKET: &str = "if/pocket_l1_2021-12-02_4msps_ci8.bin";
const POCKET_FLAGS: [&str; 5] = ["--format", "ci8", "--rate-hz", "4e6", "--inverted"];

/// Checks the list by 60 ms of the half second, as G04 is below the threshold of 20 ms (`GNSS_TWIN_LONG=1`).
#[test]
fn half_a_second_holds_gps_and_galileo_as_listed_and_none_else() {
    let Some(file) = external(POCKET).filter(|_| crate::long::is_asked_for()) else { return };
    let found = received(&file, &POCKET_FLAGS, &["GPS L1 C/A", "Galileo E1"], "noncoherent_sums = 30");
    let galileo = "E07 E15 E20 E21 E27 E30";
    assert_found(&found, &[("GPS L1 C/A", "G04 G16 G18 G25 G26 G29 G31 G32", ""), ("Galileo E1", galileo, "E19")]);
}

/// Both searches of a short recording, of which the second takes 62 ms: what GPS and the unknown signals of
/// BeiDou make in ten codes passed for J04 to J10, with and without GPS among the candidates. Beyond the list
/// of GPS is G03: the Doppler of its L2C, −1116.2 Hz, makes −1432.5 Hz on L1, where it is at −1432.2 Hz.
#[test]
fn half_a_second_holds_no_satellite_of_qzss_but_those_whose_l1c_is_there() {
    let Some(file) = external(POCKET) else { return };
    for (signals, gps) in
        [(&["QZSS L1 C/A"][..], ""), (&["QZSS L1 C/A", "GPS L1 C/A"][..], "G03 G04 G16 G18 G25 G26 G29 G31 G32")]
    {
        let mut found = received(&file, &POCKET_FLAGS, signals, "");
        let listed = found.remove("GPS L1 C/A").unwrap_or_default().into_keys().collect::<Vec<String>>().join(" ");
        assert_eq!(listed, gps);
        assert_found(&found, &[("QZSS L1 C/A", "J01 J02 J03 J07", "")]);
    }
}

/// Codes of 20 ms take long to find: `GNSS_TWIN_LONG=1`. Beyond the list is G27, whose Doppler on L1 is by
/// sums over 200 ms the one that both carriers' ratio makes of it, to a hertz.
#[test]
fn half_a_second_of_the_second_carrier_holds_l2c_as_listed_and_none_else() {
    let Some(file) = external("if/pocket_l2_2021-12-02_4msps_ci8.bin").filter(|_| crate::long::is_asked_for()) else {
        return;
    };
    // What L1 would have: 347.82 MHz above L2, and the spectrum is inverted.
    let flags = [&POCKET_FLAGS[..], &["--if-hz=-347.82e6"]].concat();
    let found = received(&file, &flags, &["GPS L2C"], "");
    assert_found(&found, &[("GPS L2C", "G03 G04 G18 G25 G26 G29 G31 G32", "G27")]);
}

/// Codes of 10 ms take long to find: `GNSS_TWIN_LONG=1`.
#[test]
fn half_a_second_holds_the_pilots_of_b1c_and_l1c_as_listed_and_none_else() {
    let Some(file) = external(POCKET).filter(|_| crate::long::is_asked_for()) else { return };
    let found = received(&file, &POCKET_FLAGS, &["BeiDou B1C", "GPS L1C", "QZSS L1C"], "");
    assert_found(
        &found,
        &[
            ("BeiDou B1C", "C21 C22 C27 C29 C30 C36 C39 C40 C45 C46", ""),
            ("GPS L1C", "G04 G18", ""),
            ("QZSS L1C", "J01 J02 J03 J04 J07", ""),
        ],
    );
}
