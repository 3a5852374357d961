//! A signal that a text describes sends what the same signal in Rust sends.

use super::signals::scene;
use crate::stream::generate;
use crate::truth;
use gnss::gps::l1ca::L1_CA;
use gnss::signal::described::registered;
use gnss::signal::{Component, Layer, SecondaryCode, Signal};

/// Data in BOC(1,1) and a pilot with layers of both BOC(1,1) and BOC(6,1) and a secondary code, on a carrier
/// of its own.
static WRITTEN: Signal = Signal {
    name: "written in Rust",
    rinex: "1A",
    carrier: gnss::signal::Carrier::Common(1_500e6),
    minimum_power_dbw: Some(-160.0),
    components: &[
        Component { power_share: 0.25, code: &code, layers: &[Layer::BOC11], ..L1_CA.components[0] },
        Component {
            power_share: 0.75,
            phase_cycles: 0.25,
            code: &code,
            layers: &[
                Layer { weight: 0.953_939_201_416_945_7, ..Layer::BOC11 },
                Layer { weight: 0.3, phase_cycles: 0.5, ..Layer::BOC61 },
            ],
            secondary_code: SecondaryCode::Shared(&[1, 1, 1, -1]),
            message: None,
            ..L1_CA.components[0]
        },
    ],
    ..L1_CA
};

fn code(number: u8) -> Option<Vec<i8>> {
    (number <= 32).then(|| L1_CA.code(number)).flatten()
}

/// Signal of a text with the values of [`WRITTEN`].
fn described() -> &'static Signal {
    let digits = |number: u8| {
        let nibble = |chips: &[i8]| (0..4).fold(0, |sum, bit| sum << 1 | u8::from(chips.get(bit) == Some(&-1)));
        let digits: String = code(number).unwrap().chunks(4).map(|chips| format!("{:X}", nibble(chips))).collect();
        format!("G{number:02} = \"{digits}\"\n")
    };
    let codes: String = (1..=32).map(digits).collect();
    let shared = "chip_rate_hz = 1.023e6\ncode_chips = 1023\n";
    let boc61 = [[1, -1]; 6].concat();
    let text = format!(
        "name = \"read from a text\"\nrinex = \"1A\"\nlike = \"GPS L1 C/A\"\ncarrier_hz = 1500e6\n\
         minimum_power_dbw = -160\n[[component]]\npower_share = 0.25\n{shared}pulse = [1, -1]\nmessage = true\n\
         [component.codes]\n{codes}[[component]]\npower_share = 0.75\nphase_cycles = 0.25\n{shared}\
         secondary_code = \"0001\"\n[component.codes]\n{codes}[[component.layer]]\npower_share = 0.91\n\
         pulse = [1, -1]\n[[component.layer]]\npower_share = 0.09\nphase_cycles = 0.5\npulse = {boc61:?}\n"
    );
    registered(&text).unwrap()
}

#[test]
fn a_described_signal_has_the_samples_of_the_one_in_rust() {
    let samples = |signal: &'static Signal| {
        let directory = tempfile::tempdir().unwrap();
        let mut samples = Vec::new();
        let mut writer = truth::Writer::create(directory.path()).unwrap();
        generate(&scene(signal, "area", 6.5e6), &mut samples, &mut writer, &mut |_| ()).unwrap();
        let facts = std::fs::read_to_string(directory.path().join("scene.json")).unwrap();
        (samples, facts.contains("described_signals"))
    };
    let [(written, rust), (read, text)] = [&WRITTEN, described()].map(samples);
    assert!(written == read && written.iter().any(|byte| *byte != 0));
    // The judge needs the text of the one and not of the other.
    assert_eq!((rust, text), (false, true));
}
