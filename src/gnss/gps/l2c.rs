//! GPS L2C: data (CM) and pilot (CL), whose chips alternate on 1227.60 MHz.
//!
//! Source: IS-GPS-200N, 3.2.1.4 and 3.2.1.5 (CM of 10 230 chips in 20 ms with CNAV, CL of 767 250 in 1.5 s),
//! 3.3.2.4 (one register of 27 stages for both), tables 3-IIa and 6-I (its first states). Each code has
//! 511 500 chips per second; here a chip is one of the 1.023 million positions per second, and codes are zero
//! where the other has its turn. Limits: the power is that of Blocks IIR-M and IIF; the phase is that of CM,
//! with no P code beside it.

use crate::gps::cnav::CNAV_L2C;
use crate::gps::modernised;
use crate::satellite::System;
use crate::signal::{Carrier, Component, Layer, SecondaryCode, Signal};
use crate::time::GPST;

/// Number of chips of CM.
pub const MODERATE_CHIPS: u32 = 10_230;
/// Number of chips of CL, 75 times those of CM.
pub const LONG_CHIPS: u32 = 767_250;

/// Definition of the signal: CM with CNAV, and CL.
pub static L2C: Signal = Signal {
    name: "GPS L2C",
    rinex: "2L",
    system: System::Gps,
    time: &GPST,
    constellation: [1, 32],
    carrier: Carrier::Common(1_227.60e6), // 3.3.1.1
    sent: modernised::sends_l2c,
    minimum_power_dbw: Some(-160.0), // table 3-Va: both components
    components: &[
        Component {
            power_share: 0.5,
            phase_cycles: 0.0,
            chip_rate_hz: 1.023e6,
            code_chips: 2 * MODERATE_CHIPS,
            code: &|number| placed(Code::Moderate, gps(number)?),
            layers: &[Layer::BPSK],
            secondary_code: SecondaryCode::None,
            message: Some(&CNAV_L2C),
        },
        Component {
            power_share: 0.5,
            phase_cycles: 0.0,
            chip_rate_hz: 1.023e6,
            code_chips: 2 * LONG_CHIPS,
            code: &|number| placed(Code::Long, gps(number)?),
            layers: &[Layer::BPSK],
            secondary_code: SecondaryCode::None,
            message: None,
        },
    ],
};

/// Numbers of GPS satellites; the others are those of other systems.
fn gps(number: u8) -> Option<u8> {
    (number <= 63).then_some(number)
}

/// Chips of a satellite by its number where they have their turn, those of CM first.
pub(crate) fn placed(which: Code, number: u8) -> Option<Vec<i8>> {
    let first = match which {
        Code::Moderate => 0,
        Code::Long => 1,
    };
    Some(in_turn(&code(which, number)?, first))
}

/// Chips at every other position, from the first or the second on.
fn in_turn(chips: &[i8], first: usize) -> Vec<i8> {
    let mut all = vec![0; 2 * chips.len()];
    let first = planted!("gnss.l2c.turn", first, 1 - first);
    for (place, chip) in all.iter_mut().skip(first).step_by(2).zip(chips) {
        *place = *chip;
    }
    all
}

/// Component to which a code of a satellite belongs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Code {
    /// CM.
    Moderate,
    /// CL.
    Long,
}

/// Bits that are added to the register after a shift if the output is one (figure 3-9; the polynomial is
/// octal 1112225171).
const FEEDBACK: u32 = 0o445_112_474;

/// Chips of a satellite by its number, 1 to 63 or 159 to 210, as ±1; `None` beyond.
pub fn code(which: Code, number: u8) -> Option<Vec<i8>> {
    let place = match number {
        1..=63 => number - 1,
        159..=210 => number - 96,
        _ => return None,
    };
    let [moderate, long] = *FIRST_STATES.get(usize::from(place))?;
    let (mut state, chips) = match which {
        Code::Moderate => (moderate, MODERATE_CHIPS),
        Code::Long => (long, LONG_CHIPS),
    };
    let feedback = planted!("gnss.l2c.register", FEEDBACK, FEEDBACK ^ 4);
    let step = |_| {
        let one = state & 1 == 1;
        state = state >> 1 ^ if one { feedback } else { 0 };
        if one { -1 } else { 1 }
    };
    Some((0..chips).map(step).collect())
}

/// The register's first states, of CM and of CL, for numbers 1 to 63 and 159 to 210.
#[rustfmt::skip]
const FIRST_STATES: [[u32; 2]; 115] = [
    [0o742417664, 0o624145772], [0o756014035, 0o506610362], [0o002747144, 0o220360016], [0o066265724, 0o710406104],
    [0o601403471, 0o001143345], [0o703232733, 0o053023326], [0o124510070, 0o652521276], [0o617316361, 0o206124777],
    [0o047541621, 0o015563374], [0o733031046, 0o561522076], [0o713512145, 0o023163525], [0o024437606, 0o117776450],
    [0o021264003, 0o606516355], [0o230655351, 0o003037343], [0o001314400, 0o046515565], [0o222021506, 0o671511621],
    [0o540264026, 0o605402220], [0o205521705, 0o002576207], [0o064022144, 0o525163451], [0o120161274, 0o266527765],
    [0o044023533, 0o006760703], [0o724744327, 0o501474556], [0o045743577, 0o743747443], [0o741201660, 0o615534726],
    [0o700274134, 0o763621420], [0o010247261, 0o720727474], [0o713433445, 0o700521043], [0o737324162, 0o222567263],
    [0o311627434, 0o132765304], [0o710452007, 0o746332245], [0o722462133, 0o102300466], [0o050172213, 0o255231716],
    [0o500653703, 0o437661701], [0o755077436, 0o717047302], [0o136717361, 0o222614207], [0o756675453, 0o561123307],
    [0o435506112, 0o240713073], [0o771353753, 0o101232630], [0o226107701, 0o132525726], [0o022025110, 0o315216367],
    [0o402466344, 0o377046065], [0o752566114, 0o655351360], [0o702011164, 0o435776513], [0o041216771, 0o744242321],
    [0o047457275, 0o024346717], [0o266333164, 0o562646415], [0o713167356, 0o731455342], [0o060546335, 0o723352536],
    [0o355173035, 0o000013134], [0o617201036, 0o011566642], [0o157465571, 0o475432222], [0o767360553, 0o463506741],
    [0o023127030, 0o617127534], [0o431343777, 0o026050332], [0o747317317, 0o733774235], [0o045706125, 0o751477772],
    [0o002744276, 0o417631550], [0o060036467, 0o052247456], [0o217744147, 0o560404163], [0o603340174, 0o417751005],
    [0o326616775, 0o004302173], [0o063240065, 0o715005045], [0o111460621, 0o001154457], [0o604055104, 0o605253024],
    [0o157065232, 0o063314262], [0o013305707, 0o066073422], [0o603552017, 0o737276117], [0o230461355, 0o737243704],
    [0o603653437, 0o067557532], [0o652346475, 0o227354537], [0o743107103, 0o704765502], [0o401521277, 0o044746712],
    [0o167335110, 0o720535263], [0o014013575, 0o733541364], [0o362051132, 0o270060042], [0o617753265, 0o737176640],
    [0o216363634, 0o133776704], [0o755561123, 0o005645427], [0o365304033, 0o704321074], [0o625025543, 0o137740372],
    [0o054420334, 0o056375464], [0o415473671, 0o704374004], [0o662364360, 0o216320123], [0o373446602, 0o011322115],
    [0o417564100, 0o761050112], [0o000526452, 0o725304036], [0o226631300, 0o721320336], [0o113752074, 0o443462103],
    [0o706134401, 0o510466244], [0o041352546, 0o745522652], [0o664630154, 0o373417061], [0o276524255, 0o225526762],
    [0o714720530, 0o047614504], [0o714051771, 0o034730440], [0o044526647, 0o453073141], [0o207164322, 0o533654510],
    [0o262120161, 0o377016461], [0o204244652, 0o235525312], [0o202133131, 0o507056307], [0o714351204, 0o221720061],
    [0o657127260, 0o520470122], [0o130567507, 0o603764120], [0o670517677, 0o145604016], [0o607275514, 0o051237167],
    [0o045413633, 0o033326347], [0o212645405, 0o534627074], [0o613700455, 0o645230164], [0o706202440, 0o000171400],
    [0o705056276, 0o022715417], [0o020373522, 0o135471311], [0o746013617, 0o137422057], [0o132720621, 0o714426456],
    [0o434015513, 0o640724672], [0o566721727, 0o501254540], [0o140633660, 0o513322453],
];
