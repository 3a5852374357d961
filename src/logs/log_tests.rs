use std::fs;
use std::io::Cursor;
use std::path::PathBuf;

use super::*;

/// Real logs that the repository ships, by their names.
fn real() -> Vec<(String, Vec<u8>)> {
    let directory = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../data/witness/logs");
    let mut paths: Vec<PathBuf> = fs::read_dir(directory).unwrap().map(|entry| entry.unwrap().path()).collect();
    paths.sort();
    let name = |path: &PathBuf| path.file_name().unwrap().to_string_lossy().into_owned();
    paths.iter().map(|path| (name(path), fs::read(path).unwrap())).collect()
}

fn log(name: &str) -> Log<Cursor<Vec<u8>>> {
    let bytes = real().into_iter().find(|(own, _)| own == name).unwrap().1;
    Log::new(Cursor::new(bytes), None)
}

#[test]
fn every_message_of_the_real_logs_fits_its_layout() {
    for (name, bytes) in real() {
        let mut log = Log::new(Cursor::new(bytes), None);
        let messages = log.by_ref().map(Result::unwrap).count();
        assert!(messages > 0, "{name}");
        assert!(log.tallies.values().all(|tally| tally.malformed == 0), "{name}: {:?}", log.tallies);
        let damaged: u64 = log.frames().counts.iter().map(|count| count.damaged).sum();
        assert_eq!((damaged, log.frames().skipped_bytes), (0, 0), "{name}");
    }
}

#[test]
fn observations_of_a_real_receiver_are_a_second_apart_with_ranges_of_medium_orbits() {
    let epochs: Vec<_> = log("RXMRAWX.ubx")
        .filter_map(|message| match message.unwrap().event {
            Some(Event::Observations(epoch)) => Some(epoch),
            _ => None,
        })
        .collect();
    assert_eq!(epochs.len(), 14);
    assert!(epochs.windows(2).all(|two| (two[1].label.since(two[0].label) - 1.0).abs() < 1e-3));
    let ranges = epochs.iter().flat_map(|epoch| &epoch.values).filter_map(|value| value.pseudorange_m);
    let far = |range_m: f64| (1.8e7..4.5e7).contains(&range_m);
    assert!(ranges.clone().count() > 100 && ranges.into_iter().all(far));
}

/// Sequence of numbers that depends on its seed alone (SplitMix64).
struct Numbers(u64);

impl Numbers {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ self.0 >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ z >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ z >> 31
    }

    fn below(&mut self, count: usize) -> usize {
        (self.next() % count.max(1) as u64) as usize
    }
}

/// Bytes of a log with damage of one of six kinds, some with checks that hold again.
fn damaged(numbers: &mut Numbers, logs: &[(String, Vec<u8>)]) -> Vec<u8> {
    let source = &logs[numbers.below(logs.len())].1;
    let from = numbers.below(source.len());
    let mut bytes = source[from..(from + 1 + numbers.below(1500)).min(source.len())].to_vec();
    for _ in 0..1 + numbers.below(4) {
        let (at, more) = (numbers.below(bytes.len()), 1 + numbers.below(20));
        match numbers.below(6) {
            0 => bytes[at] ^= 1 << numbers.below(8),
            1 => bytes[at] = numbers.next() as u8,
            2 => bytes.truncate(at + 1),
            3 => drop(bytes.drain(at..(at + more).min(bytes.len() - 1).max(at))),
            4 => drop(bytes.splice(at..at, (0..more).map(|_| numbers.next() as u8)).count()),
            _ => {
                bytes =
                    (0..200).map(|_| [0xb5, 0x62, 0xd3, b'$', b'@', numbers.next() as u8][numbers.below(6)]).collect()
            }
        }
    }
    repair(&mut bytes, numbers);
    bytes
}

/// Writes the right check behind one beginning of a frame, so that damage reaches what is behind the checks.
fn repair(bytes: &mut [u8], numbers: &mut Numbers) {
    let starts: Vec<usize> =
        bytes.windows(2).enumerate().filter(|(_, two)| *two == [0xb5, 0x62]).map(|(at, _)| at).collect();
    let Some(&at) = starts.get(numbers.below(starts.len())) else { return };
    let Some(length) = bytes.get(at + 4..at + 6).map(|two| usize::from(two[0]) | usize::from(two[1]) << 8) else {
        return;
    };
    if let Some(frame) = bytes.get_mut(at..at + length + 8) {
        let check = crate::frames::fletcher(&frame[2..length + 6]);
        frame[length + 6..].copy_from_slice(&check);
    }
}

/// Numbers of messages of RTCM 3 whose fields are known.
const KNOWN: [u16; 16] =
    [1005, 1006, 1019, 1020, 1033, 1041, 1042, 1044, 1045, 1046, 1074, 1077, 1085, 1096, 1127, 1230];

#[test]
fn damaged_logs_neither_stop_the_reader_nor_lose_a_byte_nor_grow() {
    let logs = real();
    let mut numbers = Numbers(54);
    let cases = if std::env::var_os("GNSS_TWIN_LONG").is_some() { 1_000_000 } else { 10_000 };
    let mut read = 0;
    for case in 0..cases {
        let bytes = damaged(&mut numbers, &logs);
        let total = bytes.len() as u64;
        let mut frames = Frames::new(Cursor::new(&bytes));
        let framed: u64 = frames.by_ref().map(|frame| frame.unwrap().bytes.len() as u64).sum();
        assert_eq!(framed + frames.skipped_bytes, total, "case {case}");
        // Behind the checks: any bytes as a message of a known number.
        let number = KNOWN[numbers.below(KNOWN.len())] << 4;
        let body = bytes.iter().copied().take(1000);
        let rtcm = [0xd3, 0, 0, (number >> 8) as u8, number as u8].into_iter().chain(body.clone()).collect::<Vec<u8>>();
        let mut near = Calendar::new(Some(Epoch::from_week(2200, 0.0)));
        read += usize::from(crate::rtcm::read(&rtcm, &mut near, &mut Locks::default()).table.is_some());
        let block = [4027_u16, 4007, 4006, 5914][numbers.below(4)].to_le_bytes();
        let sbf = [b'$', b'@', 0, 0, block[0], block[1], 0, 0].into_iter().chain(body).collect::<Vec<u8>>();
        read += usize::from(crate::sbf::read(&sbf, &mut near.clone(), &mut Locks::default()).table.is_some());
        for message in Log::new(Cursor::new(&bytes), None) {
            let Some(table) = message.unwrap().table else { continue };
            read += 1;
            // A repetition has at least one byte; its row has the cells of the head, too.
            let cells: usize = table.rows.iter().map(Vec::len).sum();
            assert!(cells <= 64 * (bytes.len() + 1), "case {case}: {} has {cells} cells", table.name);
        }
    }
    assert!(read > cases / 4, "{read} messages of {cases} cases");
}
