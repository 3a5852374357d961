//! GPS L1C: data in BOC(1,1) and a pilot in TMBOC(6,1,4/33) with codes of 10 230 chips at 1.023 Mchip/s on
//! 1575.42 MHz, the pilot under an overlay of 1800 chips of the satellite's own.
//!
//! Source: IS-GPS-800J, 3.2.2.1 (codes), 3.3 (modulation: both in phase, a quarter and three quarters of
//! the power), tables 3.2-2 and 3.2-3 (Weil indices, insertion points and overlays). A code is a Weil
//! code into which seven chips are put; overlay and message begin together, every 18 s of the week.
//! L1C has the phase of P(Y), which L1 C/A lags by a quarter of a cycle (IS-GPS-200N, 3.3.1.5.1; RINEX 3.05,
//! table A23). Numbers beyond 63 are those of other systems, of which 193 to 202 of QZSS are here (table
//! 6.3-1): their overlays are the sum of two registers.

use std::sync::LazyLock;

use crate::gps::cnav2::CNAV2;
use crate::gps::modernised;
use crate::satellite::System;
use crate::signal::{Carrier, Component, Layer, SecondaryCode, Signal};
use crate::time::GPST;
use crate::weil::Legendre;

/// Chips in a code period.
pub const CODE_CHIPS: u32 = 10_230;
/// Chips of an overlay, one per code period.
pub const SECONDARY_CODE_CHIPS: u32 = 1800;

/// Phase of both components against L1 C/A. An antenna's recording has 0.243 to 0.253 cycles between pilot
/// and C/A, modulo half a cycle, of J02, J03, J07, G04 and G18.
const AHEAD_OF_CA_CYCLES: f64 = 0.25;

/// Definition of the signal: L1C-P, and L1C-D with CNAV-2.
pub static L1C: Signal = Signal {
    name: "GPS L1C",
    rinex: "1L",
    system: System::Gps,
    time: &GPST,
    constellation: [1, 32],
    carrier: Carrier::Common(1_575.42e6), // 3.2.1.1
    sent: modernised::sends_l1c,
    minimum_power_dbw: Some(-157.0), // 3.2.1.9, table 3.2-1: both components
    components: &[
        Component {
            power_share: 0.75,
            phase_cycles: AHEAD_OF_CA_CYCLES,
            chip_rate_hz: 1.023e6,
            code_chips: CODE_CHIPS,
            code: &|number| code(Code::Pilot, gps(number)?),
            layers: &[Layer { chips: &ONE, ..Layer::BOC11 }, Layer { chips: &SIX, ..Layer::BOC61 }],
            secondary_code: SecondaryCode::PerSatellite {
                chips: SECONDARY_CODE_CHIPS,
                of: |number| secondary_code(gps(number)?),
            },
            message: None,
        },
        Component {
            power_share: 0.25,
            phase_cycles: AHEAD_OF_CA_CYCLES,
            chip_rate_hz: 1.023e6,
            code_chips: CODE_CHIPS,
            code: &|number| code(Code::Data, gps(number)?),
            layers: &[Layer::BOC11],
            secondary_code: SecondaryCode::None,
            message: Some(&CNAV2),
        },
    ],
};

/// Numbers of GPS satellites; the others are those of other systems.
fn gps(number: u8) -> Option<u8> {
    (number <= 63).then_some(number)
}

/// Chips of the pilot in BOC(6,1), among 33, and those in BOC(1,1) (3.3.1).
const SIX: [bool; 33] = chips(true);
const ONE: [bool; 33] = chips(false);

const fn chips(six: bool) -> [bool; 33] {
    let mut chips = [!six; 33];
    (chips[0], chips[4], chips[6], chips[29]) = (six, six, six, six);
    chips
}

/// Component to which a code of a satellite belongs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Code {
    /// L1C-D.
    Data,
    /// L1C-P.
    Pilot,
}

static LEGENDRE: LazyLock<Legendre> = LazyLock::new(|| Legendre::new(10_223));
/// The chips that are put into a Weil code (3.2.2.1.1).
const INSERTED: [bool; 7] = [false, true, true, false, true, false, false];

/// Parameters of a satellite's codes: Weil index and insertion point for the data and for the pilot. Then
/// follow polynomial and first state of the overlay's register, with the first state of its second register.
type Origin = ([u16; 2], [u16; 2], [u16; 3]);

/// Parameters of the codes of a number from 1 to 63 or 193 to 202; `None` beyond.
fn origin(number: u8) -> Option<Origin> {
    if let Some(place) = number.checked_sub(193) {
        return QZSS_CODES.get(usize::from(place)).copied();
    }
    let (data, pilot, [polynomial, start]) = *CODES.get(usize::from(number).checked_sub(1)?)?;
    Some((data, pilot, [polynomial, start, 0]))
}

/// Chips of a satellite by its number, 1 to 63 or 193 to 202, as ±1; `None` beyond.
pub fn code(which: Code, number: u8) -> Option<Vec<i8>> {
    let (data, pilot, _) = origin(number)?;
    let [later, inserted_at] = match which {
        Code::Data => data,
        Code::Pilot => pilot,
    };
    // Positions count from 1.
    let before = usize::from(inserted_at) - planted!("gnss.l1c.insertion", 1, 0);
    let rest = CODE_CHIPS as usize - INSERTED.len() - before;
    let weil = || LEGENDRE.weil(later, 0);
    let chips = weil().take(before).chain(INSERTED).chain(weil().skip(before).take(rest));
    Some(chips.map(sign).collect())
}

/// Overlay of a satellite by its number, 1 to 63 or 193 to 202, as ±1; `None` beyond (3.2.2.1.2). A
/// second register that has no start stays at zeros and adds none.
pub fn secondary_code(number: u8) -> Option<Vec<i8>> {
    let (.., [polynomial, start, second]) = origin(number)?;
    let second = register(planted!("gnss.qzss.secondary_code", SECOND_POLYNOMIAL, polynomial), second);
    let chips = register(polynomial, start).zip(second).map(|(one, other)| sign(one ^ other));
    Some(chips.take(SECONDARY_CODE_CHIPS as usize).collect())
}

/// The polynomial of the second register of overlays (3.2.2.1.2).
const SECOND_POLYNOMIAL: u16 = 0o5001;

/// Output of a register of eleven stages, taken from its last stage.
fn register(polynomial: u16, start: u16) -> impl Iterator<Item = bool> {
    // Stage n is the bit of value 2ⁿ⁻¹; the polynomial's lowest coefficient is no stage.
    let feedback = planted!("gnss.l1c.secondary_code", polynomial >> 1, polynomial);
    let mut stages = start;
    std::iter::repeat_with(move || {
        let out = stages >> 10 & 1 == 1;
        let back = (stages & feedback).count_ones() as u16 % 2;
        stages = (stages << 1 | back) & 0x7FF;
        out
    })
}

fn sign(one: bool) -> i8 {
    if one { -1 } else { 1 }
}

/// Weil index and insertion point of the data's code and of the pilot's, and polynomial and first state of
/// the overlay's register, for numbers 1 to 63.
#[rustfmt::skip]
const CODES: [([u16; 2], [u16; 2], [u16; 2]); 63] = [
    ([5097, 181], [5111, 412], [0o5111, 0o3266]), ([5110, 359], [5109, 161], [0o5421, 0o2040]),
    ([5079, 72], [5108, 1], [0o5501, 0o1527]), ([4403, 1110], [5106, 303], [0o5403, 0o3307]),
    ([4121, 1480], [5103, 207], [0o6417, 0o3756]), ([5043, 5034], [5101, 4971], [0o6141, 0o3026]),
    ([5042, 4622], [5100, 4496], [0o6351, 0o0562]), ([5104, 1], [5098, 5], [0o6501, 0o0420]),
    ([4940, 4547], [5095, 4557], [0o6205, 0o3415]), ([5035, 826], [5094, 485], [0o6235, 0o0337]),
    ([4372, 6284], [5093, 253], [0o7751, 0o0265]), ([5064, 4195], [5091, 4676], [0o6623, 0o1230]),
    ([5084, 368], [5090, 1], [0o6733, 0o2204]), ([5048, 1], [5081, 66], [0o7627, 0o1440]),
    ([4950, 4796], [5080, 4485], [0o5667, 0o2412]), ([5019, 523], [5069, 282], [0o5051, 0o3516]),
    ([5076, 151], [5068, 193], [0o7665, 0o2761]), ([3736, 713], [5054, 5211], [0o6325, 0o3750]),
    ([4993, 9850], [5044, 729], [0o4365, 0o2701]), ([5060, 5734], [5027, 4848], [0o4745, 0o1206]),
    ([5061, 34], [5026, 982], [0o7633, 0o1544]), ([5096, 6142], [5014, 5955], [0o6747, 0o1774]),
    ([4983, 190], [5004, 9805], [0o4475, 0o0546]), ([4783, 644], [4980, 670], [0o4225, 0o2213]),
    ([4991, 467], [4915, 464], [0o7063, 0o3707]), ([4815, 5384], [4909, 29], [0o4423, 0o2051]),
    ([4443, 801], [4893, 429], [0o6651, 0o3650]), ([4769, 594], [4885, 394], [0o4161, 0o1777]),
    ([4879, 4450], [4832, 616], [0o7237, 0o3203]), ([4894, 9437], [4824, 9457], [0o4473, 0o1762]),
    ([4985, 4307], [4591, 4429], [0o5477, 0o2100]), ([5056, 5906], [3706, 4771], [0o6163, 0o0571]),
    ([4921, 378], [5092, 365], [0o7223, 0o3710]), ([5036, 9448], [4986, 9705], [0o6323, 0o3535]),
    ([4812, 9432], [4965, 9489], [0o7125, 0o3110]), ([4838, 5849], [4920, 4193], [0o7035, 0o1426]),
    ([4855, 5547], [4917, 9947], [0o4341, 0o0255]), ([4904, 9546], [4858, 824], [0o4353, 0o0321]),
    ([4753, 9132], [4847, 864], [0o4107, 0o3124]), ([4483, 403], [4790, 347], [0o5735, 0o0572]),
    ([4942, 3766], [4770, 677], [0o6741, 0o1736]), ([4813, 3], [4318, 6544], [0o7071, 0o3306]),
    ([4957, 684], [4126, 6312], [0o4563, 0o1307]), ([4618, 9711], [3961, 9804], [0o5755, 0o3763]),
    ([4669, 333], [3790, 278], [0o6127, 0o1604]), ([4969, 6124], [4911, 9461], [0o4671, 0o1021]),
    ([5031, 10216], [4881, 444], [0o4511, 0o2624]), ([5038, 4251], [4827, 4839], [0o4533, 0o0406]),
    ([4740, 9893], [4795, 4144], [0o5357, 0o0114]), ([4073, 9884], [4789, 9875], [0o5607, 0o0077]),
    ([4843, 4627], [4725, 197], [0o6673, 0o3477]), ([4979, 4449], [4675, 1156], [0o6153, 0o1000]),
    ([4867, 9798], [4539, 4674], [0o7565, 0o3460]), ([4964, 985], [4535, 10035], [0o7107, 0o2607]),
    ([5025, 4272], [4458, 4504], [0o6211, 0o2057]), ([4579, 126], [4197, 5], [0o4321, 0o3467]),
    ([4390, 10024], [4096, 9937], [0o7201, 0o0706]), ([4763, 434], [3484, 430], [0o4451, 0o2032]),
    ([4612, 1029], [3481, 5], [0o5411, 0o1464]), ([4784, 561], [3393, 355], [0o5141, 0o0520]),
    ([3716, 289], [3175, 909], [0o7041, 0o1766]), ([4703, 638], [2360, 1622], [0o6637, 0o3270]),
    ([4851, 4353], [1852, 6284], [0o4577, 0o0341]),
];

/// Parameters of the codes of numbers 193 to 202, with the first state of the second register.
#[rustfmt::skip]
const QZSS_CODES: [Origin; 10] = [
    ([4834, 9753], [4311, 9864], [0o5403, 0o0500, 0o3261]), ([4456, 4799], [5024, 9753], [0o5403, 0o0254, 0o1760]),
    ([4056, 10126], [4352, 9859], [0o5403, 0o3445, 0o0430]), ([3804, 241], [4678, 328], [0o5403, 0o2542, 0o3477]),
    ([3672, 1245], [5034, 1], [0o5403, 0o1257, 0o1676]), ([4205, 1274], [5085, 4733], [0o6501, 0o0211, 0o1636]),
    ([3348, 1456], [3646, 164], [0o6501, 0o0534, 0o2411]), ([4152, 9967], [4868, 135], [0o6501, 0o1420, 0o1473]),
    ([3883, 235], [3668, 174], [0o6501, 0o3401, 0o2266]), ([3473, 512], [4211, 132], [0o6501, 0o0714, 0o2104]),
];
