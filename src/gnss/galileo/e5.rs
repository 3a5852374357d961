//! Galileo E5a and E5b, each received alone: data and pilot in quadrature with codes of 10 230 chips at
//! 10.23 Mchip/s, BPSK(10) on 1176.45 and 1207.14 MHz.
//!
//! Source: Galileo OS SIS ICD 2.1, 2.3.1 (modulation; a receiver of one side sees quadrature phase shift
//! keying), 3.4.1, tables 15 and 16 (codes by two registers), 3.5, tables 17 to 19 (secondary codes). Limits:
//! the products by which both sides together have a constant envelope are left out, as is their power.

use std::sync::LazyLock;

use crate::galileo::fnav::FNAV;
use crate::galileo::inav::INAV_E5B;
use crate::message::Message;
use crate::satellite::System;
use crate::signal::{Carrier, Codes, Component, Layer, SecondaryCode, Signal, always};
use crate::time::GST;

/// Chips in a code period.
pub const CODE_CHIPS: u32 = 10_230;

/// E5a with F/NAV.
pub static E5A: Signal = Signal {
    name: "Galileo E5a",
    rinex: "5Q",
    system: System::Galileo,
    time: &GST,
    constellation: [1, 36],
    carrier: Carrier::Common(1_176.45e6), // 2.1, table 2
    sent: always,
    minimum_power_dbw: Some(-155.25), // 2.7.1, table 12: both components
    components: &[
        data(&|number| code(Code::E5aData, number), SecondaryCode::Shared(&CS20), &FNAV),
        pilot(&|number| code(Code::E5aPilot, number), secondary_code),
    ],
};

/// E5b with I/NAV.
pub static E5B: Signal = Signal {
    name: "Galileo E5b",
    rinex: "7Q",
    carrier: Carrier::Common(1_207.14e6), // 2.1, table 2
    components: &[
        data(&|number| code(Code::E5bData, number), SecondaryCode::Shared(&CS4), &INAV_E5B),
        // Table 19: numbers 51 to 100 are those of E5b.
        pilot(&|number| code(Code::E5bPilot, number), |number| secondary_code(number.checked_add(SATELLITES)?)),
    ],
    ..E5A
};

const SATELLITES: u8 = 50;

/// The component in phase.
const fn data(code: &'static Codes, secondary_code: SecondaryCode, message: &'static Message) -> Component {
    Component {
        power_share: 0.5,
        phase_cycles: 0.0,
        chip_rate_hz: 10.23e6,
        code_chips: CODE_CHIPS,
        code,
        layers: &[Layer::BPSK],
        secondary_code,
        message: Some(message),
    }
}

/// The component in quadrature, a quarter of a cycle ahead.
const fn pilot(code: &'static Codes, of: fn(u8) -> Option<Vec<i8>>) -> Component {
    Component {
        power_share: 0.5,
        phase_cycles: 0.25,
        chip_rate_hz: 10.23e6,
        code_chips: CODE_CHIPS,
        code,
        layers: &[Layer::BPSK],
        secondary_code: SecondaryCode::PerSatellite { chips: 100, of },
        message: None,
    }
}

/// Table 17: 842E9 and E in hexadecimal, a logical 1 as −1.
const CS20: [i8; 20] = [-1, 1, 1, 1, 1, -1, 1, 1, 1, 1, -1, 1, -1, -1, -1, 1, -1, 1, 1, -1];
const CS4: [i8; 4] = [-1, -1, -1, 1];

/// One of the four codes of a satellite.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Code {
    /// E5a-I.
    E5aData,
    /// E5a-Q.
    E5aPilot,
    /// E5b-I.
    E5bData,
    /// E5b-Q.
    E5bPilot,
}

/// Stages of a register.
const STAGES: u32 = 14;

impl Code {
    /// Feedback of the two registers in octal, stage n as the bit of value 2ⁿ (table 15).
    fn feedback(self) -> [u32; 2] {
        match self {
            Self::E5aData | Self::E5aPilot => [0o40503, 0o50661],
            Self::E5bData => [0o64021, 0o51445],
            Self::E5bPilot => [0o64021, 0o43143],
        }
    }

    /// Column of the code in [`STARTS`].
    fn column(self) -> usize {
        match self {
            Self::E5aData => 0,
            Self::E5aPilot => 1,
            Self::E5bData => 2,
            Self::E5bPilot => 3,
        }
    }
}

/// Output of a register: the last stage first, then the bits that its feedback inserts.
fn register(feedback: u32, start: u32) -> impl Iterator<Item = bool> {
    let mut stages = start;
    std::iter::repeat_with(move || {
        let out = stages >> (STAGES - 1) & 1 == 1;
        // Stage n is the bit of value 2ⁿ⁻¹ here.
        let back = (stages & feedback >> 1).count_ones() % 2;
        stages = (stages << 1 | back) & ((1 << STAGES) - 1);
        out
    })
}

/// Chips of a satellite by its number, 1 to 50, as ±1; `None` beyond. The first register starts with
/// ones, and neither starts again before the code's end.
pub fn code(which: Code, number: u8) -> Option<Vec<i8>> {
    let start = STARTS.get(usize::from(number).checked_sub(1)?)?.get(which.column())?;
    let [first, second] = which.feedback();
    let chips = register(first, (1 << STAGES) - 1).zip(register(second, *start));
    let chips = chips.map(|(a, b)| if a != planted!("gnss.e5.registers", b, !b) { -1 } else { 1 });
    Some(chips.take(CODE_CHIPS as usize).collect())
}

/// Secondary code CS100 of that number, 1 to 100, as ±1; `None` beyond.
pub fn secondary_code(number: u8) -> Option<Vec<i8>> {
    CS100.get(usize::from(number).checked_sub(1)?).cloned()
}

/// The secondary codes of 100 chips, from four bits a digit.
static CS100: LazyLock<Vec<Vec<i8>>> = LazyLock::new(|| {
    let digits = |line: &str| -> Vec<i8> {
        let digits = line.chars().filter_map(|digit| digit.to_digit(16));
        digits.flat_map(|digit| (0..4).rev().map(move |bit| if digit >> bit & 1 == 1 { -1 } else { 1 })).collect()
    };
    include_str!("e5_secondary_codes.txt").lines().map(digits).collect()
});

/// Initial states of the second registers of E5a-I, E5a-Q, E5b-I and E5b-Q, for numbers 1 to 50 (table 16).
#[rustfmt::skip]
const STARTS: [[u32; 4]; 50] = [
    [0o30305, 0o25652, 0o07220, 0o03331], [0o14234, 0o05142, 0o26047, 0o06143],
    [0o27213, 0o24723, 0o00252, 0o25322], [0o20577, 0o31751, 0o17166, 0o23371],
    [0o23312, 0o27366, 0o14161, 0o00413], [0o33463, 0o24660, 0o02540, 0o36235],
    [0o15614, 0o33655, 0o01537, 0o17750], [0o12537, 0o27450, 0o26023, 0o04745],
    [0o01527, 0o07626, 0o01725, 0o13005], [0o30236, 0o01705, 0o20637, 0o37140],
    [0o27344, 0o12717, 0o02364, 0o30155], [0o07272, 0o32122, 0o27731, 0o20237],
    [0o36377, 0o16075, 0o30640, 0o03461], [0o17046, 0o16644, 0o34174, 0o31662],
    [0o06434, 0o37556, 0o06464, 0o27146], [0o15405, 0o02477, 0o07676, 0o05547],
    [0o24252, 0o02265, 0o32231, 0o02456], [0o11631, 0o06430, 0o10353, 0o30013],
    [0o24776, 0o25046, 0o00755, 0o00322], [0o00630, 0o12735, 0o26077, 0o10761],
    [0o11560, 0o04262, 0o11644, 0o26767], [0o17272, 0o11230, 0o11537, 0o36004],
    [0o27445, 0o00037, 0o35115, 0o30713], [0o31702, 0o06137, 0o20452, 0o07662],
    [0o13012, 0o04312, 0o34645, 0o21610], [0o14401, 0o20606, 0o25664, 0o20134],
    [0o34727, 0o11162, 0o21403, 0o11262], [0o22627, 0o22252, 0o32253, 0o10706],
    [0o30623, 0o30533, 0o02337, 0o34143], [0o27256, 0o24614, 0o30777, 0o11051],
    [0o01520, 0o07767, 0o27122, 0o25460], [0o14211, 0o32705, 0o22377, 0o17665],
    [0o31465, 0o05052, 0o36175, 0o32354], [0o22164, 0o27553, 0o33075, 0o21230],
    [0o33516, 0o03711, 0o33151, 0o20146], [0o02737, 0o02041, 0o13134, 0o11362],
    [0o21316, 0o34775, 0o07433, 0o37246], [0o35425, 0o05274, 0o10216, 0o16344],
    [0o35633, 0o37356, 0o35466, 0o15034], [0o24655, 0o16205, 0o02533, 0o25471],
    [0o14054, 0o36270, 0o05351, 0o25646], [0o27027, 0o06600, 0o30121, 0o22157],
    [0o06604, 0o26773, 0o14010, 0o04336], [0o31455, 0o17375, 0o32576, 0o16356],
    [0o34465, 0o35267, 0o30326, 0o04075], [0o25273, 0o36255, 0o37433, 0o02626],
    [0o20763, 0o12044, 0o26022, 0o11706], [0o31721, 0o26442, 0o35770, 0o37011],
    [0o17312, 0o21621, 0o06670, 0o27041], [0o13277, 0o25411, 0o12017, 0o31024],
];
