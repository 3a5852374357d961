use super::*;

/// Written by GNSS-SDR 0.0.17, with one satellite of another system and an event record put in.
const FILE: &str = "     3.02           OBSERVATION DATA    M                   RINEX VERSION / TYPE
GNSS-SDR            Software Receiver   0.0.17              REC # / TYPE / VERS 
G    4 C1C L1C D1C S1C                                      SYS / # / OBS TYPES 
E    2 C1B L1B                                              SYS / # / OBS TYPES 
DBHZ                                                        SIGNAL STRENGTH UNIT
  2010    07    01    08    06   42.1400000     GPS         TIME OF FIRST OBS   
                                                            END OF HEADER       
> 2010 07 01 08 06 42.2000000  0  3                                             
G13  20396313.236 8 107183350.465 8      1322.051 8        48.131               
G 3  23953725.914 6 125877680.02736     -3329.684 6        41.665
E11  24953725.914         0.000 
> 2010 07 01 08 06 42.2500000  4  1                                             
a remark                                                    COMMENT             
> 2010 07 01 08 06 42.3000000  0  1                                             
G13                 107183218.263 8                        48.127
";

#[test]
fn values_indicators_blanks_and_events_are_read_as_the_table_says() {
    let found = read(FILE.as_bytes()).unwrap();
    assert_eq!((found.epochs.len(), found.events, found.receiver.as_str()), (2, 1, "Software Receiver 0.0.17"));
    let first = &found.epochs[0];
    assert_eq!(first.label, Epoch::parse("2010-07-01T08:06:42.2").unwrap());
    let g3 = &first.values[&(Sv::gps(3), "1C".to_owned())];
    assert_eq!((g3.carrier_cycles, g3.lost_lock, g3.half_cycle_ambiguous), (Some(125_877_680.027), true, true));
    assert_eq!((g3.doppler_hz, g3.cn0_dbhz), (Some(-3329.684), Some(41.665)));
    let e11 = &first.values[&("E11".parse().unwrap(), "1B".to_owned())];
    assert_eq!((e11.pseudorange_m, e11.carrier_cycles), (Some(24_953_725.914), None));
    let later = &found.epochs[1].values[&(Sv::gps(13), "1C".to_owned())];
    assert_eq!((later.pseudorange_m, later.doppler_hz, later.cn0_dbhz), (None, None, Some(48.127)));
    let crlf = FILE.replace('\n', "\r\n");
    assert_eq!(read(crlf.as_bytes()).unwrap(), found);
    let latin = FILE.replacen("Software", "S\u{f6}ftware", 1).into_bytes();
    assert_eq!(read(&latin).unwrap().epochs, found.epochs);
}

#[test]
fn each_damage_is_refused_at_its_line_with_its_reason() {
    let cases = [
        (String::new(), 1, "RINEX VERSION / TYPE"),
        (FILE.replacen("3.02", "2.12", 1), 1, "version '2.12': expected 2.00 to 2.11 or 3.00 to 4.02"),
        (FILE.replacen("3.02", "2.11", 1), 7, "expected # / TYPES OF OBSERV"),
        (FILE.replacen("OBSERVATION DATA", "NAVIGATION DATA ", 1), 1, "file type 'NAVIGATION DATA'"),
        (FILE.replacen("G    4 C1C", "G    5 C1C", 1), 4, "1 observation types of system G"),
        (FILE.replacen("G    4", "G    x", 1), 3, "number of observation types 'x'"),
        (FILE.replacen("  GPS         TIME", "  GLO         TIME", 1), 6, "time system 'GLO'"),
        (FILE.replacen("END OF HEADER", "END OF HEADEX", 1), 15, "does not end"),
        (FILE.replacen("07 01 08 06 42.2000000  0  3", "13 01 08 06 42.2000000  0  3", 1), 8, "time '2010 13"),
        (FILE.replacen("42.2000000  0  3", "42.2000000  0  x", 1), 8, "number of satellites 'x'"),
        (FILE.replacen("42.2000000  0  3", "42.2000000  9  3", 1), 8, "epoch flag '9'"),
        (FILE.replacen("42.2000000  0  3", "42.2000000  0  2", 1), 11, "which begins with '>'"),
        (FILE.replacen("20396313.236", "20396x13.236", 1), 9, "G13 C1C = '20396x13.236'"),
        (FILE.replacen("20396313.236", "         NaN", 1), 9, "G13 C1C = 'NaN'"),
        (FILE.replacen("G 3  ", "G13  ", 1), 10, "appears twice"),
        (FILE.replacen("E11", "R11", 1), 11, "names no observations"),
        (FILE.replacen("E11", "X11", 1), 11, "'X11' is not a satellite"),
        (FILE.replacen("42.3000000", "42.1000000", 1), 14, "does not come after"),
        (FILE.replacen("42.3000000  0  1", "42.3000000  0  5", 1), 15, "ends after 1 of 5 lines"),
        (FILE.lines().take(7).collect::<Vec<_>>().join("\n"), 7, "no epoch"),
    ];
    for (text, line, words) in cases {
        let fault = read(text.as_bytes()).unwrap_err();
        assert!(fault.what.contains(words), "{words}: line {}: {}", fault.line, fault.what);
        assert_eq!(fault.line, line, "{words}: {}", fault.what);
    }
}

#[test]
fn a_file_cut_anywhere_or_with_any_byte_changed_is_read_or_refused() {
    let bytes = FILE.as_bytes();
    for length in 0..bytes.len() {
        let _ = read(&bytes[..length]);
    }
    for at in 0..bytes.len() {
        for byte in [b' ', b'-', b'9', b'>', b'\n', 0, 0xff] {
            let mut damaged = bytes.to_vec();
            damaged[at] = byte;
            let _ = read(&damaged);
        }
    }
}

/// Compares a file with what the crate that everyone uses reads from it; gives how many values were the same.
/// A code of RINEX 2 has two characters and stands for the one that `third` gives.
fn compared_with_the_rinex_crate(text: &str, third: fn(&str) -> &str) -> usize {
    use ::rinex::prelude::{Rinex, TimeScale};

    let ours = read(text.as_bytes()).unwrap();
    let theirs = Rinex::parse(&mut std::io::BufReader::new(text.as_bytes())).unwrap();
    let mut compared = 0;
    for (key, observed) in theirs.observations_iter() {
        let at_ns = key.epoch.to_time_scale(TimeScale::GPST).duration.total_nanoseconds();
        let same = |epoch: &&ObservedEpoch| {
            (epoch.label.since(Epoch::new((at_ns / 1_000_000_000) as i64, (at_ns % 1_000_000_000) as f64 * 1e-9))).abs()
                < 1e-9
        };
        let epoch = ours.epochs.iter().find(same).expect("an epoch that the crate has");
        for signal in observed.signals.iter().filter(|signal| signal.value != 0.0) {
            let (sv, code) = (signal.sv.to_string(), signal.observable.to_string());
            let code = third(&code);
            let values = &epoch.values[&(sv.parse().unwrap(), code[1..].to_owned())];
            let found = match &code[..1] {
                "C" => values.pseudorange_m,
                "L" => values.carrier_cycles,
                "D" => values.doppler_hz,
                _ => values.cn0_dbhz,
            };
            assert_eq!(found, Some(signal.value), "{sv} {code}");
            compared += 1;
        }
    }
    compared
}

#[test]
fn the_rinex_crate_reads_the_same_values() {
    let lines: Vec<&str> = FILE.lines().filter(|line| !line.contains("  4  1") && !line.contains("a remark")).collect();
    let text = (lines.join("\n") + "\n").replace("G 3 ", "G03 ");
    // Four values of two satellites, one of the third, two in the second epoch.
    assert_eq!(compared_with_the_rinex_crate(&text, |code| code), 11);
}

/// Observations of a Japanese station, RINEX 2.10, and the same through `RNX2CRX` 4.1.0 of Hatanaka's own.
const STATION: [&[u8]; 2] =
    [include_bytes!("../../../data/witness/07590920.05o.gz"), include_bytes!("../../../data/witness/07590920.05d.gz")];

#[test]
fn a_real_file_of_rinex_2_is_read_plain_packed_and_compressed() {
    let [plain, compressed] = STATION.map(|bytes| read(bytes).unwrap());
    assert_eq!(plain, compressed);
    assert_eq!((plain.epochs.len(), plain.receiver.as_str()), (120, "TRIMBLE 5700 1.24"));
    let first = &plain.epochs[0];
    assert_eq!((first.label, first.values.len()), (Epoch::parse("2005-04-02T00:00:00").unwrap(), 16));
    let g3 = |code: &str| &first.values[&(Sv::gps(3), code.to_owned())];
    assert_eq!((g3("1C").carrier_cycles, g3("1C").pseudorange_m), (Some(55_923_622.160), Some(24_767_686.375)));
    assert_eq!((g3("2W").carrier_cycles, g3("2W").pseudorange_m), (Some(43_647_388.242), Some(24_767_684.822)));
    let text = gnss::inflate::inflate(STATION[0], LARGEST_BYTES).unwrap();
    let third = |code: &str| match code {
        "L1" => "L1C",
        "C1" => "C1C",
        "L2" => "L2W",
        _ => "C2W",
    };
    assert_eq!(compared_with_the_rinex_crate(std::str::from_utf8(&text).unwrap(), third), values_of(&plain));
}

fn values_of(found: &Observations) -> usize {
    let each =
        |own: &Values| [own.pseudorange_m, own.carrier_cycles, own.doppler_hz, own.cn0_dbhz].iter().flatten().count();
    found.epochs.iter().flat_map(|epoch| epoch.values.values()).map(each).sum()
}

/// The example of RINEX 2.11, table A7: satellites of three systems under one list of types, events with and
/// without a time, indicators.
const SECOND: &str = include_str!("rinex_obs/example_2_11.txt");

#[test]
fn the_example_of_rinex_2_11_is_read_with_its_events() {
    let found = read(SECOND.as_bytes()).unwrap();
    assert_eq!((found.epochs.len(), found.events), (6, 9));
    let labels: Vec<f64> = found.epochs.iter().map(|epoch| epoch.label.since(found.epochs[0].label)).collect();
    assert_eq!(labels, [0.0, 18.0, 72.0, 90.0, 216.0, 252.0]);
    let at = |epoch: usize, sv: &str, code: &str| {
        found.epochs[epoch].values.get(&(sv.parse().unwrap(), code.to_owned())).cloned().unwrap_or_default()
    };
    let g12 = at(0, "G12", "1W");
    assert_eq!((g12.pseudorange_m, g12.carrier_cycles), (Some(23_629_347.915), Some(0.3)));
    assert_eq!(at(0, "G12", "2W").pseudorange_m, Some(23_629_364.158));
    // Of Galileo it is not said which component is tracked.
    assert_eq!((at(0, "E11", "1X").carrier_cycles, at(0, "E11", "5X").carrier_cycles), (Some(0.324), Some(0.178)));
    assert_eq!(
        (at(1, "R21", "1P").pseudorange_m, at(1, "R21", "1P").carrier_cycles),
        (Some(21_345_678.576), Some(12_345.567))
    );
    // LLI 1 and 2 of the fifth epoch's and the last one's carriers.
    let l2 = at(5, "G12", "2W");
    assert_eq!((l2.lost_lock, l2.half_cycle_ambiguous, l2.carrier_cycles), (false, true, Some(-248_152.728)));
    assert_eq!((at(5, "G06", "1W").lost_lock, at(5, "G09", "1W").lost_lock), (true, false));
    // A blank is the file's own system, or GPS in a mixed file.
    let bare = SECOND.replace("G12G09G06E11", " 12 09  6E11");
    assert_eq!(read(bare.as_bytes()).unwrap(), found);
    // Power failed: no carrier goes on.
    let power = read(SECOND.replacen("14 48.0000000  0  4", "14 48.0000000  1  4", 1).as_bytes()).unwrap();
    assert!(power.epochs[5].values.values().all(|own| own.lost_lock && own.carrier_cycles.is_some()));
    let power = read(FILE.replacen("42.2000000  0", "42.2000000  1", 1).as_bytes()).unwrap();
    assert!(power.epochs[0].values[&(Sv::gps(13), "1C".to_owned())].lost_lock);
}

#[test]
fn lines_of_rinex_2_that_go_on_are_one_record() {
    // Seven observations, so two lines each; fourteen satellites, so two lines of names. Values tell where
    // they stand: satellite, and position in the list of types.
    let mut text = format!("{:60}RINEX VERSION / TYPE\n", "     2.11           OBSERVATION DATA    G (GPS)");
    let types = ["C1", "L1", "D1", "S1", "P2", "L2", "C2", "D2", "S2", "C5", "L5"];
    let named = |some: &[&str]| some.iter().map(|code| format!("    {code}")).collect::<String>();
    text += &format!("{:60}# / TYPES OF OBSERV\n", format!("    11{}", named(&types[..9])));
    text += &format!("{:60}# / TYPES OF OBSERV\n{:60}END OF HEADER\n", format!("      {}", named(&types[9..])), "");
    let value = |number: usize, index: usize| (100 * number + index + 1) as f64;
    let epoch = |text: &mut String, clock: &str, letter: char| {
        let names: Vec<String> = (1..=14).map(|number| format!("{letter}{number:2}")).collect();
        *text += &format!(
            " 99 12 31 23 59 {clock}  0 14{}  .000000001\n{:32}{}\n",
            names[..12].concat(),
            "",
            names[12..].concat()
        );
        for number in 1..=14 {
            for line in 0..3 {
                let fields = (5 * line..(5 * line + 5).min(11)).map(|index| format!("{:14.3} 7", value(number, index)));
                *text += &(fields.collect::<String>() + "\n");
            }
        }
    };
    epoch(&mut text, " 1.0000000", 'G');
    epoch(&mut text, " 2.0000000", ' ');
    let found = read(text.as_bytes()).unwrap();
    assert_eq!((found.epochs.len(), found.epochs[0].label), (2, Epoch::parse("1999-12-31T23:59:01").unwrap()));
    for epoch in &found.epochs {
        assert_eq!(epoch.values.len(), 14 * 4);
        for number in 1..=14 {
            let of = |code: &str| &epoch.values[&(Sv::gps(number), code.to_owned())];
            let have = [
                of("1C").pseudorange_m,
                of("1C").carrier_cycles,
                of("1C").doppler_hz,
                of("1C").cn0_dbhz,
                of("2W").pseudorange_m,
                of("2W").carrier_cycles,
                of("2X").pseudorange_m,
                of("2W").doppler_hz,
                of("2W").cn0_dbhz,
                of("5X").pseudorange_m,
                of("5X").carrier_cycles,
            ];
            let expected: Vec<Option<f64>> = (0..11).map(|index| Some(value(usize::from(number), index))).collect();
            assert_eq!(have.to_vec(), expected);
        }
    }
    for (from, to, line, words) in [
        (" 1401.000", " 14x1.000", 46, "G14 C1C = '14x1.000': expected a number in columns 1 to 14"),
        ("  206.000", "  2x6.000", 11, "G02 L2W = '2x6.000': expected a number in columns 1 to 14"),
        ("G14\n", "\n", 6, "14 satellites announced, 13 named"),
        ("G14\n", "G 1\n", 46, "satellite G01 appears twice"),
        ("  0 14G", "  9 14G", 5, "epoch flag '9'"),
        ("99 12 31", "99 13 31", 5, "time '99 13 31 23 59  1.0000000': expected yy mm dd hh mm ss.s"),
        ("    C5    L5", "    C5      ", 4, "1 observation types are missing"),
        ("    11 ", "     2 ", 2, "expected 0 more codes"),
    ] {
        let fault = read(text.replacen(from, to, 1).as_bytes()).unwrap_err();
        assert!(fault.what.contains(words), "{words}: line {}: {}", fault.line, fault.what);
        assert_eq!(fault.line, line, "{words}: {}", fault.what);
    }
}

#[test]
fn phases_of_rinex_2_belong_to_the_code_that_the_file_has() {
    let codes = |named: &str, sv: &str| {
        let types: Vec<&str> = named.split(' ').collect();
        let list = types.iter().map(|code| format!("    {code}")).collect::<String>();
        let mut text = format!("{:60}RINEX VERSION / TYPE\n", "     2.11           OBSERVATION DATA    M (MIXED)");
        text += &format!("{:60}# / TYPES OF OBSERV\n{:60}END OF HEADER\n", format!("{:6}{list}", types.len()), "");
        let values = types.iter().map(|_| format!("{:14.3}  ", 1.0)).collect::<String>();
        text += &format!(" 05  4  2  0  0  0.0000000  0  1{sv}\n{}\n", values.trim_end());
        let found = read(text.as_bytes()).unwrap();
        found.epochs[0]
            .values
            .iter()
            .filter(|(_, own)| own.carrier_cycles.is_some())
            .map(|((_, code), _)| code.clone())
            .collect::<Vec<_>>()
    };
    assert_eq!(codes("C1 L1 P2 L2", "G01"), ["1C", "2W"]);
    assert_eq!(codes("P1 L1 P2 L2", "G01"), ["1W", "2W"]);
    assert_eq!(codes("P1 C1 L1 L2", "G01"), ["1C", "2X"]);
    assert_eq!(codes("C1 L1 C2 L2", "R01"), ["1C", "2C"]);
    assert_eq!(codes("P1 L1 P2 L2", "R01"), ["1P", "2P"]);
    assert_eq!(codes("C1 L1 L5 L7 L8", "E01"), ["1X", "5X", "7X", "8X"]);
    assert_eq!(codes("L1 L2 L6 L7", "C01"), ["2I", "6I", "7I"]);
    assert_eq!(codes("C1 L1 L5", "S20"), ["1C", "5I"]);
    assert_eq!(codes("L1 L5 T1", "I02"), ["5A"]);
}

/// RINEX 3 through `RNX2CRX` 4.1.0: a receiver's clock, blanks, an event, a satellite that goes and one that
/// stays.
const COMPRESSED: &str = include_str!("rinex_obs/compressed.txt");
const THIRD: &str = include_str!("rinex_obs/plain.txt");

#[test]
fn compressed_files_hold_what_the_plain_ones_do() {
    let [plain, found] = [THIRD, COMPRESSED].map(|text| read(text.as_bytes()).unwrap());
    assert_eq!(found, plain);
    assert_eq!((found.epochs.len(), found.events), (3, 1));
    assert_eq!(found.epochs[2].values[&(Sv::gps(13), "1C".to_owned())].carrier_cycles, Some(107_183_100.0));
    let cases = [
        (COMPRESSED.replacen("3.0    ", "4.0    ", 1), 1, "CRINEX version '4.0'"),
        (COMPRESSED.replacen("CRINEX PROG", "CRINEX PROX", 1), 2, "CRINEX PROG / DATE"),
        (
            COMPRESSED.replacen("-118263", "-1x8263", 1),
            23,
            "satellite G13, value 2: '-1x8263': expected a whole number",
        ),
        (COMPRESSED.replacen("3&20396300000", "20396300000", 1), 23, "value 1: '20396300000': expected m&value"),
        (COMPRESSED.replacen("3&48131", "9&48131", 1), 12, "order '9': expected 0 to 5"),
        (COMPRESSED.replacen("3&20396313236", "3&999999999999999", 1), 12, "expected at most 14"),
        (COMPRESSED.replacen("0  3      G13G03E11", "0  3      G13G03", 1), 10, "3 satellites announced, 2 named"),
        (
            COMPRESSED.replacen("> 2010 07 01 08 06 42.2000000", "x 2010 07 01 08 06 42.2000000", 1),
            10,
            "which begins with '>'",
        ),
        (
            COMPRESSED.replacen("                      4        1", "x                     4        1", 1),
            20,
            "which begins with '>'",
        ),
    ];
    for (text, line, words) in cases {
        let fault = read(text.as_bytes()).unwrap_err();
        assert!(fault.what.contains(words), "{words}: line {}: {}", fault.line, fault.what);
        assert_eq!(fault.line, line, "{words}: {}", fault.what);
    }
    let unix = read(&[0x1f, 0x9d, 0x90]).unwrap_err().what;
    assert!(unix.contains("expected plain text or gzip"), "{unix}");
}

#[test]
fn no_damage_of_a_second_or_compressed_file_makes_the_reader_panic() {
    for text in [SECOND, COMPRESSED] {
        for at in 0..text.len() {
            let _ = read(&text.as_bytes()[..at]);
            for byte in [b' ', b'&', b'9', b'\n', 0xff] {
                let mut damaged = text.as_bytes().to_vec();
                damaged[at] = byte;
                let _ = read(&damaged);
            }
        }
    }
}
