//! GPS L5: data (I5) and pilot (Q5) in quadrature with codes of 10 230 chips at 10.23 Mchip/s, BPSK(10) on
//! 1176.45 MHz.
//!
//! Source: IS-GPS-705J, 3.2.1 (codes), 3.3.1 (modulation: Q5 lags), tables 3-Ia and 6-I (advances). XA starts
//! again after 8190 chips, XB after its natural 8191, both with the code. Limits: the power is that of Block
//! IIF.

use std::sync::LazyLock;

use crate::gps::cnav::CNAV;
use crate::gps::modernised;
use crate::satellite::System;
use crate::signal::{Carrier, Component, Layer, SecondaryCode, Signal};
use crate::time::GPST;

/// Chips in a code period.
pub const CODE_CHIPS: u32 = 10_230;

/// Definition of the signal: I5 with CNAV, and Q5.
pub static L5: Signal = Signal {
    name: "GPS L5",
    rinex: "5Q",
    system: System::Gps,
    time: &GPST,
    constellation: [1, 32],
    carrier: Carrier::Common(1_176.45e6), // 3.3.1.1
    sent: modernised::sends_l5,
    minimum_power_dbw: Some(-154.9), // table 3-III: -157.9 dBW a component
    components: &[
        Component {
            power_share: 0.5,
            phase_cycles: 0.0,
            chip_rate_hz: 10.23e6,
            code_chips: CODE_CHIPS,
            code: &|number| gps(number).and_then(|number| code(Code::Data, number)),
            layers: &[Layer::BPSK],
            secondary_code: SecondaryCode::Shared(&NH10),
            message: Some(&CNAV),
        },
        Component {
            power_share: 0.5,
            phase_cycles: -0.25,
            chip_rate_hz: 10.23e6,
            code_chips: CODE_CHIPS,
            code: &|number| gps(number).and_then(|number| code(Code::Pilot, number)),
            layers: &[Layer::BPSK],
            secondary_code: SecondaryCode::Shared(&NH20),
            message: None,
        },
    ],
};

/// Numbers of GPS satellites; the others are those of other systems.
fn gps(number: u8) -> Option<u8> {
    (number <= 63).then_some(number)
}

/// The Neuman-Hofman codes, 0000110101 and 00000100110101001110 (3.3.3.1.2), a logical 1 as −1.
const NH10: [i8; 10] = [1, 1, 1, 1, -1, -1, 1, -1, 1, -1];
const NH20: [i8; 20] = [1, 1, 1, 1, 1, -1, 1, 1, -1, -1, 1, -1, 1, -1, 1, 1, -1, -1, -1, 1];

/// Component to which a code of a satellite belongs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Code {
    /// I5.
    Data,
    /// Q5.
    Pilot,
}

/// Chips of XA until it starts again, and of XB.
const XA_CHIPS: usize = 8190;
const XB_CHIPS: usize = 8191;

/// Stages that a register of 13 feeds back (3.2.1.1, figure 3-1).
const XA_TAPS: [u32; 4] = [9, 10, 12, 13];
const XB_TAPS: [u32; 8] = [1, 3, 4, 6, 7, 8, 12, 13];

/// Output of a register of 13 stages that starts with ones, taken from its last stage.
fn register(taps: &[u32], chips: usize) -> Vec<bool> {
    // Stage n is the bit of value 2ⁿ⁻¹.
    let feedback = taps.iter().fold(0_u32, |all, stage| all | 1 << (stage - 1));
    let mut stages = (1_u32 << 13) - 1;
    let step = |_| {
        let out = stages >> 12 & 1 == 1;
        let back = (stages & feedback).count_ones() % 2;
        stages = (stages << 1 | back) & ((1 << 13) - 1);
        out
    };
    (0..chips).map(step).collect()
}

static XA: LazyLock<Vec<bool>> = LazyLock::new(|| register(&XA_TAPS, XA_CHIPS));
static XB: LazyLock<Vec<bool>> = LazyLock::new(|| register(&XB_TAPS, XB_CHIPS));

/// Chips of a satellite by its number, 1 to 210, as ±1; `None` beyond.
pub fn code(which: Code, number: u8) -> Option<Vec<i8>> {
    let [data, pilot] = *ADVANCES.get(usize::from(number).checked_sub(1)?)?;
    let advance = match which {
        Code::Data => data,
        Code::Pilot => pilot,
    };
    let advance = planted!("gnss.l5.advance", advance, advance + 1);
    let second = XB.iter().cycle().skip(usize::from(advance));
    let chips = XA.iter().cycle().zip(second).map(|(a, b)| if a == b { 1 } else { -1 });
    Some(chips.take(CODE_CHIPS as usize).collect())
}

/// Advance of XB in chips for I5 and for Q5, for numbers 1 to 210.
#[rustfmt::skip]
const ADVANCES: [[u16; 2]; 210] = [
    [266, 1701], [365, 323], [804, 5292], [1138, 2020], [1509, 5429], [1559, 7136], [1756, 1041], [2084, 5947],
    [2170, 4315], [2303, 148], [2527, 535], [2687, 1939], [2930, 5206], [3471, 5910], [3940, 3595], [4132, 5135],
    [4332, 6082], [4924, 6990], [5343, 3546], [5443, 1523], [5641, 4548], [5816, 4484], [5898, 1893], [5918, 3961],
    [5955, 7106], [6243, 5299], [6345, 4660], [6477, 276], [6518, 4389], [6875, 3783], [7168, 1591], [7187, 1601],
    [7329, 749], [7577, 1387], [7720, 1661], [7777, 3210], [8057, 708], [5358, 4226], [3550, 5604], [3412, 6375],
    [819, 3056], [4608, 1772], [3698, 3662], [962, 4401], [3001, 5218], [4441, 2838], [4937, 6913], [3717, 1685],
    [4730, 1194], [7291, 6963], [2279, 5001], [7613, 6694], [5723, 991], [7030, 7489], [1475, 2441], [2593, 639],
    [2904, 2097], [2056, 2498], [2757, 6470], [3756, 2399], [6205, 242], [5053, 3768], [6437, 1186], [7789, 5246],
    [2311, 4259], [7432, 5907], [5155, 3870], [1593, 3262], [5841, 7387], [5014, 3069], [1545, 2999], [3016, 7993],
    [4875, 7849], [2119, 4157], [229, 5031], [7634, 5986], [1406, 4833], [4506, 5739], [1819, 7846], [7580, 898],
    [5446, 2022], [6053, 7446], [7958, 6404], [5267, 155], [2956, 7862], [3544, 7795], [1277, 6121], [2996, 4840],
    [1758, 6585], [3360, 429], [2718, 6020], [3754, 200], [7440, 1664], [2781, 1499], [6756, 7298], [7314, 1305],
    [208, 7323], [5252, 7544], [696, 4438], [527, 2485], [1399, 3387], [5879, 7319], [6868, 1853], [217, 5781],
    [7681, 1874], [3788, 7555], [1337, 2132], [2424, 6441], [4243, 6722], [5686, 1192], [1955, 2588], [4791, 2188],
    [492, 297], [1518, 1540], [6566, 4138], [5349, 5231], [506, 4789], [113, 659], [1953, 871], [2797, 6837],
    [934, 1393], [3023, 7383], [3632, 611], [1330, 4920], [4909, 5416], [4867, 1611], [1183, 2474], [3990, 118],
    [6217, 1382], [1224, 1092], [1733, 7950], [2319, 7223], [3928, 1769], [2380, 4721], [841, 1252], [5049, 5147],
    [7027, 2165], [1197, 7897], [7208, 4054], [8000, 3498], [152, 6571], [6762, 2858], [3745, 8126], [4723, 7017],
    [5502, 1901], [4796, 181], [123, 1114], [8142, 5195], [5091, 7479], [7875, 4186], [330, 3904], [5272, 7128],
    [4912, 1396], [374, 4513], [2045, 5967], [6616, 2580], [6321, 2575], [7605, 7961], [2570, 2598], [2419, 4508],
    [1234, 2090], [1922, 3685], [4317, 7748], [5110, 684], [825, 913], [958, 5558], [1089, 2894], [7813, 5858],
    [6058, 6432], [7703, 3813], [6702, 3573], [1714, 7523], [6371, 5280], [2281, 3376], [1986, 7424], [6282, 2918],
    [3201, 5793], [3760, 1747], [1056, 7079], [6233, 2921], [1150, 2490], [2823, 4119], [6250, 3373], [645, 977],
    [2401, 681], [1639, 4273], [2946, 5419], [7091, 5626], [923, 1266], [7045, 5804], [6493, 2414], [1706, 6444],
    [5836, 4757], [926, 427], [6086, 5452], [950, 5182], [5905, 6606], [3240, 6531], [6675, 4268], [3197, 3115],
    [1555, 6835], [3589, 862], [4555, 4856], [5671, 2765], [6948, 37], [4664, 1943], [2086, 7977], [5950, 2512],
    [5521, 4451], [1515, 4071],
];
