use super::*;
use crate::gps::l1ca::L1_CA;
use crate::gps::lnav::LNAV;
use crate::satellite::Sv;

/// C/A code of GPS by its two registers (IS-GPS-200N, 3.3.2.3), with `starts` of the second one.
fn registers(name: &str, starts: &str) -> String {
    format!(
        "name = \"{name}\"\nrinex = \"1A\"\nlike = \"GPS L1 C/A\"\n[[component]]\npower_share = 1\n\
         chip_rate_hz = 1.023e6\ncode_chips = 1023\nmessage = true\n\
         [[component.register]]\nstages = 10\ntaps = [3, 10]\n\
         [[component.register]]\nstages = 10\ntaps = [2, 3, 6, 8, 9, 10]\n[component.register.starts]\n{starts}\n"
    )
}

/// State of the second register, stage 1 first, that makes the C/A code of a satellite: the bits of stages 10
/// to 1 are the next ten of its output, which is the sum of the code and the first register's.
fn start(number: u8) -> String {
    let first: Vec<bool> = {
        let mut stages = [true; 10];
        let mut next = || {
            let output = stages[9];
            let fed_back = stages[2] ^ stages[9];
            stages.rotate_right(1);
            stages[0] = fed_back;
            output
        };
        (0..10).map(|_| next()).collect()
    };
    let code = L1_CA.code(number).unwrap();
    let second = code.iter().zip(&first).map(|(chip, one)| (*chip < 0) ^ one);
    let digits: Vec<char> = second.map(|one| if one { '1' } else { '0' }).collect();
    digits.into_iter().rev().collect()
}

#[test]
fn registers_and_digits_of_the_c_a_code_describe_the_built_in_code() {
    let starts: Vec<String> = (1..=32).map(|number| format!("G{number:02} = \"{}\"", start(number))).collect();
    let by_registers = registered(&registers("gold", &starts.join("\n"))).unwrap();
    let digits = |number: u8| {
        let code = L1_CA.code(number).unwrap();
        let nibble = |chips: &[i8]| (0..4).fold(0, |sum, bit| sum << 1 | u8::from(chips.get(bit) == Some(&-1)));
        let digits: String = code.chunks(4).map(|chips| format!("{:x}", nibble(chips))).collect();
        let (one, other) = digits.split_at(100);
        format!("G{number:02} = \"\"\"\n{one}\n  {other}\n\"\"\"")
    };
    let codes: Vec<String> = (1..=32).map(digits).collect();
    let text = registers("memory", "");
    let (head, _) = text.split_once("[[component.register]]").unwrap();
    let by_digits = registered(&format!("{head}[component.codes]\n{}", codes.join("\n"))).unwrap();
    for signal in [by_registers, by_digits] {
        assert_eq!(signal.satellites().count(), 32, "{signal}");
        for sv in signal.satellites() {
            assert_eq!(signal.code(sv.number), L1_CA.code(sv.number), "{signal} {sv}");
        }
        assert!(signal.carries(&LNAV) && signal.code(33).is_none(), "{signal}");
        assert_eq!((signal.carrier_hz(Sv::gps(1)), signal.rinex), (1_575.42e6, "1A"));
        super::super::tests::complete(signal);
    }
}

#[test]
fn a_text_describes_one_signal_however_often_it_is_read_and_no_other_of_its_name() {
    let text = registers("twice", "G01 = \"1100100000\"");
    let signal = registered(&text).unwrap();
    assert!(std::ptr::eq(registered(&format!("# a comment\n{text}")).unwrap(), signal));
    let other = registered(&text.replace("\"1A\"", "\"1B\"")).unwrap_err().to_string();
    assert!(other.contains("name: expected a name that no other signal has"), "{other}");
    // A wrong value is said before the name, which another file may have taken.
    let wrong = registered(&text.replace("code_chips = 1023", "code_chips = 0")).unwrap_err().to_string();
    assert!(wrong.contains("component[1].code_chips"), "{wrong}");
    assert_eq!(texts_of([signal, &L1_CA]), [text.as_str()]);
    assert_eq!(texts_of([&L1_CA]), [""; 0]);
}

#[test]
fn what_no_signal_can_be_is_refused_with_its_path() {
    let good = registers("refused", "G01 = \"1100100000\"");
    for (from, to, path, expected) in [
        ("\"refused\"", "\"GPS L1 C/A\"", "name", "no other signal"),
        ("\"refused\"", "\"a,b\"", "name", "1 to 40 letters"),
        ("\"1A\"", "\"1C\"", "rinex", "no built-in signal of the system"),
        ("GPS L1 C/A", "GPS L9", "like", "built-in"),
        ("[[component]]", "carrier_hz = 1e7\n[[component]]", "carrier_hz", "from 100000000 to 30000000000 Hz"),
        ("power_share = 1", "power_share = 0.5", "component", "add up to 1, not to 0.5"),
        ("1.023e6", "inf", "component[1].chip_rate_hz", "Hz"),
        ("code_chips = 1023", "code_chips = 1000", "component[1].code_chips", "divide the message's symbols of 0.02 s"),
        ("message", "secondary_code = \"012\"\nmessage", "component[1].secondary_code", "0 and 1"),
        ("message", "secondary_code = \"010\"\nmessage", "component[1].secondary_code", "the 20 code periods"),
        ("message", "pulse = [1, 0]\nmessage", "component[1].pulse", "-1 or 1"),
        ("taps = [3, 10]", "taps = [3, 11]", "component[1].register[1].taps", "1 to 10"),
        ("1100100000", "110010000", "component[1].register[2].starts.G01", "10 digits"),
        ("G01", "E01", "component[1].register[2].starts", "G01 as keys, not \"E01\""),
        ("G01", "G1", "component[1].register[2].starts", "not \"G1\""),
        ("[component.register.starts]\nG01 = \"1100100000\"", "", "component[1].register", "starts of each satellite"),
        (
            "[[component.register]]\nstages = 10\ntaps = [3, 10]\n",
            "codes = { G01 = \"00\" }\n[[component.register]]\nstages = 10\ntaps = [3, 10]\n",
            "component[1].codes",
            "either",
        ),
        (
            "[[component.register]]\nstages = 10\ntaps = [3, 10]\n",
            "[[component.layer]]\npower_share = 0.5\npulse = [1]\n[[component.layer]]\npower_share = 0.5\n\
             pulse = [1, 1, 1, -1]\n[[component.register]]\nstages = 10\ntaps = [3, 10]\n",
            "component[1].layer",
            "mean power of 1, not of 1.",
        ),
    ] {
        let text = good.replacen(from, to, 1);
        assert_ne!(text, good, "{from}");
        let Err(DescriptionError::Value { path: found, expected: said }) = registered(&text) else {
            panic!("{from} as {to}");
        };
        assert!(found == path && said.contains(expected), "{from} as {to}: {found}: {said}");
    }
    let codes = |digits: &str| {
        let (head, _) = good.split_once("[[component.register]]").unwrap();
        let text =
            head.replace("1023\n", "10\n").replace("1.023e6", "1e6") + &format!("codes = {{ G01 = \"{digits}\" }}\n");
        registered(&text).unwrap_err().to_string()
    };
    assert!(codes("3f").contains("codes.G01: expected 3 hexadecimal digits for 10 chips, not 2 characters"));
    assert!(codes("3fg").contains("3 hexadecimal digits"));
    assert!(codes("3f1").contains("zeros in the last 2 bits"));
    assert!(matches!(registered("name = 1"), Err(DescriptionError::Toml(_))));
    assert!(matches!(registered(&good.replace("like", "lke")), Err(DescriptionError::Toml(_))));
}
