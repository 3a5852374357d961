//! BeiDou B1C: data in BOC(1,1) and a pilot in QMBOC(6,1,4/33) with codes of 10 230 chips at 1.023 Mchip/s on
//! 1575.42 MHz, the pilot under a secondary code of 1800 chips of the satellite's own.
//!
//! Source: BDS-SIS-ICD-B1C 1.0, 4.2 (modulation, equations 4-3 and 4-10: the pilot's BOC(1,1) leads the data
//! by a quarter of a cycle, its BOC(6,1) is in phase with them), 5.2 and 5.3 (codes and secondary codes,
//! tables 5-2 to 5-4). Codes and secondary codes are pieces of Weil codes of lengths 10 243 and 3607;
//! secondary code and message begin together, every 18 s of the week of BDT. Satellites of the third
//! generation in medium and inclined orbits send it: numbers 19 to 46 but 31 since the system was opened, 47
//! to 50 since the day of a file in which they broadcast B-CNAV1. Limits: power is that of medium orbits, 2
//! dB less of inclined ones.

use std::sync::LazyLock;

use crate::beidou::bcnav1::B_CNAV1;
use crate::satellite::System;
use crate::signal::{Carrier, Component, Layer, SecondaryCode, Signal};
use crate::time::{BDT, Epoch};
use crate::weil::Legendre;

/// 4.1.
pub const CARRIER_HZ: f64 = 1_575.42e6;
/// Chips in a code period.
pub const CODE_CHIPS: u32 = 10_230;
/// Chips of a secondary code, one per code period.
pub const SECONDARY_CODE_CHIPS: u32 = 1800;

/// Definition of the signal: the pilot, and data with B-CNAV1.
pub static B1C: Signal = Signal {
    name: "BeiDou B1C",
    rinex: "1P",
    system: System::BeiDou,
    time: &BDT,
    constellation: THIRD_GENERATION,
    carrier: Carrier::Common(CARRIER_HZ),
    sent,
    minimum_power_dbw: Some(-159.0), // 4.5: both components
    components: &[
        Component {
            power_share: 0.75,
            phase_cycles: 0.25,
            chip_rate_hz: 1.023e6,
            code_chips: CODE_CHIPS,
            code: &|number| code(Code::Pilot, number),
            layers: &[
                Layer { weight: 0.937_436_866_561_091_8, ..Layer::BOC11 }, // √(29/33)
                Layer { weight: 0.348_155_311_911_395_6, phase_cycles: -0.25, ..Layer::BOC61 }, // √(4/33)
            ],
            secondary_code: SecondaryCode::PerSatellite { chips: SECONDARY_CODE_CHIPS, of: secondary_code },
            message: None,
        },
        Component {
            power_share: 0.25,
            phase_cycles: 0.0,
            chip_rate_hz: 1.023e6,
            code_chips: CODE_CHIPS,
            code: &|number| code(Code::Data, number),
            layers: &[Layer::BOC11],
            secondary_code: SecondaryCode::None,
            message: Some(&B_CNAV1),
        },
    ],
};

/// First and last number of third-generation satellites in medium and inclined orbits (BDS-SIS-ICD-B1C 1.0,
/// 4.2, and navigation files up to 2026). Satellites of other numbers have codes, but do not send the signal.
pub const THIRD_GENERATION: [u8; 2] = [19, 50];

/// First dates of transmission by satellite number.
const SINCE: [(std::ops::RangeInclusive<u8>, &str); 3] =
    [(19..=30, "2020-07-31T00:00:00"), (32..=46, "2020-07-31T00:00:00"), (47..=50, "2026-03-09T00:00:00")];

/// True if the satellite with this number sends the signal at a time.
pub fn sent(number: u8, at: Epoch) -> bool {
    let begun = |since: &str| Epoch::parse(since).is_ok_and(|since| at.since(since) >= 0.0);
    SINCE.iter().any(|(numbers, since)| numbers.contains(&number) && begun(since))
}

/// Component to which a code of a satellite belongs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Code {
    /// Code of the data component.
    Data,
    /// Code of the pilot.
    Pilot,
}

static LONG: LazyLock<Legendre> = LazyLock::new(|| Legendre::new(10_243));
static SHORT: LazyLock<Legendre> = LazyLock::new(|| Legendre::new(3607));

/// Chips of a satellite by its number, 1 to 63, as ±1; `None` beyond.
pub fn code(which: Code, number: u8) -> Option<Vec<i8>> {
    let (data, pilot, _) = *CODES.get(usize::from(number).checked_sub(1)?)?;
    let own = match which {
        Code::Data => data,
        Code::Pilot => pilot,
    };
    Some(piece(&LONG, own, CODE_CHIPS))
}

/// Secondary code of a satellite by its number, 1 to 63, as ±1; `None` beyond.
pub fn secondary_code(number: u8) -> Option<Vec<i8>> {
    let (.., own) = *CODES.get(usize::from(number).checked_sub(1)?)?;
    Some(piece(&SHORT, own, SECONDARY_CODE_CHIPS))
}

/// Returns `chips` chips of a Weil code from the truncation point `first` on, which counts from 1.
pub(super) fn piece(legendre: &Legendre, [later, first]: [u16; 2], chips: u32) -> Vec<i8> {
    let weil = legendre.weil(later, first - planted!("gnss.b1c.truncation", 1, 0));
    weil.take(chips as usize).map(|one| if one { -1 } else { 1 }).collect()
}

/// Weil index and position of truncation of the data's code, of the pilot's and of its secondary code, for
/// numbers 1 to
/// 63.
#[rustfmt::skip]
const CODES: [([u16; 2], [u16; 2], [u16; 2]); 63] = [
    ([2678, 699], [796, 7575], [269, 1889]), ([4802, 694], [156, 2369], [1448, 1268]),
    ([958, 7318], [4198, 5688], [1028, 1593]), ([859, 2127], [3941, 539], [1324, 1186]),
    ([3843, 715], [1374, 2270], [822, 1239]), ([2232, 6682], [1338, 7306], [5, 1930]),
    ([124, 7850], [1833, 6457], [155, 176]), ([4352, 5495], [2521, 6254], [458, 1696]),
    ([1816, 1162], [3175, 5644], [310, 26]), ([1126, 7682], [168, 7119], [959, 1344]),
    ([1860, 6792], [2715, 1402], [1238, 1271]), ([4800, 9973], [4408, 5557], [1180, 1182]),
    ([2267, 6596], [3160, 5764], [1288, 1381]), ([424, 2092], [2796, 1073], [334, 1604]),
    ([4192, 19], [459, 7001], [885, 1333]), ([4333, 10151], [3594, 5910], [1362, 1185]),
    ([2656, 6297], [4813, 10060], [181, 31]), ([4148, 5766], [586, 2710], [1648, 704]),
    ([243, 2359], [1428, 1546], [838, 1190]), ([1330, 7136], [2371, 6887], [313, 1646]),
    ([1593, 1706], [2285, 1883], [750, 1385]), ([1470, 2128], [3377, 5613], [225, 113]),
    ([882, 6827], [4965, 5062], [1477, 860]), ([3202, 693], [3779, 1038], [309, 1656]),
    ([5095, 9729], [4547, 10170], [108, 1921]), ([2546, 1620], [1646, 6484], [1457, 1173]),
    ([1733, 6805], [1430, 1718], [149, 1928]), ([4795, 534], [607, 2535], [322, 57]),
    ([4577, 712], [2118, 1158], [271, 150]), ([1627, 1929], [4709, 526], [576, 1214]),
    ([3638, 5355], [1149, 7331], [1103, 1148]), ([2553, 6139], [3283, 5844], [450, 1458]),
    ([3646, 6339], [2473, 6423], [399, 1519]), ([1087, 1470], [1006, 6968], [241, 1635]),
    ([1843, 6867], [3670, 1280], [1045, 1257]), ([216, 7851], [1817, 1838], [164, 1687]),
    ([2245, 1162], [771, 1989], [513, 1382]), ([726, 7659], [2173, 6468], [687, 1514]),
    ([1966, 1156], [740, 2091], [422, 1]), ([670, 2672], [1433, 1581], [303, 1583]),
    ([4130, 6043], [2458, 1453], [324, 1806]), ([53, 2862], [3459, 6252], [495, 1664]),
    ([4830, 180], [2155, 7122], [725, 1338]), ([182, 2663], [1205, 7711], [780, 1111]),
    ([2181, 6940], [413, 7216], [367, 1706]), ([2006, 1645], [874, 2113], [882, 1543]),
    ([1080, 1582], [2463, 1095], [631, 1813]), ([2288, 951], [1106, 1628], [37, 228]),
    ([2027, 6878], [1590, 1713], [647, 2871]), ([271, 7701], [3873, 6102], [1043, 2884]),
    ([915, 1823], [4026, 6123], [24, 1823]), ([497, 2391], [4272, 6070], [120, 75]),
    ([139, 2606], [3556, 1115], [134, 11]), ([3693, 822], [128, 8047], [136, 63]),
    ([2054, 6403], [1200, 6795], [158, 1937]), ([4342, 239], [130, 2575], [214, 22]),
    ([3342, 442], [4494, 53], [335, 1768]), ([2592, 6769], [1871, 1729], [340, 1526]),
    ([1007, 2560], [3073, 6388], [661, 1402]), ([310, 2502], [4386, 682], [889, 1445]),
    ([4203, 5072], [4098, 5565], [929, 1680]), ([455, 7268], [1923, 7160], [1002, 1290]),
    ([4318, 341], [1176, 2277], [1149, 1245]),
];
