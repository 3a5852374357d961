use std::path::PathBuf;

use super::*;

fn shipped(name: &str) -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../data/witness/logs").join(name)
}

fn read_near(name: &str, asked: Option<Protocol>, near: &str) -> Result<(Protocol, Usable, Contents), JudgeError> {
    read(&shipped(name), asked, Epoch::parse(near).unwrap())
}

fn refusal(name: &str, asked: Option<Protocol>) -> String {
    read_near(name, asked, "2022-02-09T00:00:00").err().map_or_else(String::new, |error| error.to_string())
}

#[test]
fn messages_of_one_time_are_one_epoch_of_all_their_systems() {
    let (protocol, usable, _) = read_near("MIXED-RTCM3.rtcm3", None, "2022-02-09T00:00:00").unwrap();
    assert_eq!((protocol, usable.epochs.len()), (Protocol::Rtcm, 1));
    let mut systems: Vec<char> = usable.epochs[0].values.keys().map(|(sv, _)| sv.system.letter()).collect();
    systems.sort_unstable();
    systems.dedup();
    assert_eq!(systems, ['C', 'E', 'G', 'R']);
}

#[test]
fn a_log_of_two_protocols_is_read_by_the_one_that_is_asked_for() {
    // Its only position of UBX is one of time alone.
    let told = refusal("MIXED-RTCM3.rtcm3", Some(Protocol::Ubx));
    assert!(told.contains("UBX with nothing to judge: it has NAV-PVT 1, where 1 say that there is no fix"), "{told}");
    assert_eq!(read_near("MIXED-RTCM3.rtcm3", None, "2022-02-09T00:00:00").unwrap().0, Protocol::Rtcm);
}

#[test]
fn a_position_has_the_further_digits_of_its_time() {
    let (_, usable, _) = read_near("NAV-ZED-X20P.ubx", None, "2025-08-25T00:00:00").unwrap();
    assert!(usable.is_refined && usable.fixes.len() == 2 && usable.clocks.len() == 2);
}

#[test]
fn a_log_with_nothing_to_judge_is_refused_with_what_it_has_and_what_is_needed() {
    let told = refusal("MON.ubx", None);
    assert!(told.contains("MON.ubx: UBX") && told.contains("MON-RF 2") && told.contains("RXM-RAWX"), "{told}");
    let told = refusal("MON.ubx", Some(Protocol::Sbf));
    assert!(told.contains("no frame of SBF, but 12 frames of UBX"), "{told}");
    let told = refusal("../e1_codes.csv", None);
    assert!(told.contains("no frame of UBX, RTCM 3 or SBF, but none of any protocol"), "{told}");
}
