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
        (FILE.replacen("3.02", "2.11", 1), 1, "version '2.11'"),
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

/// The crate that everyone uses reads the same numbers from the same file.
#[test]
fn the_rinex_crate_reads_the_same_values() {
    use ::rinex::prelude::{Rinex, TimeScale};

    let lines: Vec<&str> = FILE.lines().filter(|line| !line.contains("  4  1") && !line.contains("a remark")).collect();
    let text = (lines.join("\n") + "\n").replace("G 3 ", "G03 ");
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
    // Four values of two satellites, one of the third, two in the second epoch.
    assert_eq!(compared, 11);
}
