//! Layouts of UBX messages: u-blox F9 HPG 1.32 and F10 SPG 6.00 interface descriptions, 3.10 to 3.17.
//!
//! Names are the interface descriptions', values in their units (milliseconds, millimetres, degrees), scales
//! applied. Reserved bits have no name and no column.

use crate::table::{Field, Layout, i, r, reserved, u, x};

/// Every message whose fields are read.
#[rustfmt::skip]
pub const LAYOUTS: &[Layout] = &[
    Layout { name: "NAV-PVT", key: (0x01, 0x07), head: NAV_PVT, repeated: None },
    Layout { name: "NAV-SAT", key: (0x01, 0x35), head: NAV_SAT, repeated: Some(("numSvs", NAV_SAT_EACH)) },
    Layout { name: "NAV-SIG", key: (0x01, 0x43), head: NAV_SIG, repeated: Some(("numSigs", NAV_SIG_EACH)) },
    Layout { name: "NAV-CLOCK", key: (0x01, 0x22), head: NAV_CLOCK, repeated: None },
    Layout { name: "NAV-STATUS", key: (0x01, 0x03), head: NAV_STATUS, repeated: None },
    Layout { name: "NAV-HPPOSECEF", key: (0x01, 0x13), head: NAV_HPPOSECEF, repeated: None },
    Layout { name: "NAV-HPPOSLLH", key: (0x01, 0x14), head: NAV_HPPOSLLH, repeated: None },
    Layout { name: "NAV-COV", key: (0x01, 0x36), head: NAV_COV, repeated: None },
    Layout { name: "NAV-TIMEGPS", key: (0x01, 0x20), head: NAV_TIMEGPS, repeated: None },
    Layout { name: "NAV-TIMEUTC", key: (0x01, 0x21), head: NAV_TIMEUTC, repeated: None },
    Layout { name: "NAV-PL", key: (0x01, 0x62), head: NAV_PL, repeated: None },
    Layout { name: "NAV-EOE", key: (0x01, 0x61), head: NAV_EOE, repeated: None },
    Layout { name: "RXM-RAWX", key: (0x02, 0x15), head: RXM_RAWX, repeated: Some(("numMeas", RXM_RAWX_EACH)) },
    Layout { name: "RXM-SFRBX", key: (0x02, 0x13), head: RXM_SFRBX, repeated: Some(("numWords", RXM_SFRBX_EACH)) },
    Layout { name: "RXM-MEASX", key: (0x02, 0x14), head: RXM_MEASX, repeated: Some(("numSv", RXM_MEASX_EACH)) },
    Layout { name: "SEC-SIG", key: (0x27, 0x09), head: SEC_SIG_V1, repeated: None },
    Layout {
        name: "SEC-SIG-2", key: (0x27, 0x09), head: SEC_SIG_2, repeated: Some(("jamNumCentFreqs", SEC_SIG_2_EACH))
    },
    Layout { name: "SEC-SIGLOG", key: (0x27, 0x10), head: SEC_SIGLOG, repeated: Some(("numEvents", SEC_SIGLOG_EACH)) },
    Layout { name: "MON-RF", key: (0x0a, 0x38), head: MON_RF, repeated: Some(("nBlocks", MON_RF_EACH)) },
    Layout { name: "TIM-TP", key: (0x0d, 0x01), head: TIM_TP, repeated: None },
    Layout { name: "TIM-TM2", key: (0x0d, 0x03), head: TIM_TM2, repeated: None },
];

#[rustfmt::skip]
const NAV_PVT: &[Field] = &[
    u(4, "iTOW"), u(2, "year"), u(1, "month"), u(1, "day"), u(1, "hour"), u(1, "min"), u(1, "sec"),
    x(1, &[("validDate", 1), ("validTime", 1), ("fullyResolved", 1), ("validMag", 1)]), u(4, "tAcc"),
    i(4, "nano"), u(1, "fixType"),
    x(1, &[("gnssFixOk", 1), ("diffSoln", 1), ("psmState", 3), ("headVehValid", 1), ("carrSoln", 2)]),
    x(1, &[("", 5), ("confirmedAvai", 1), ("confirmedDate", 1), ("confirmedTime", 1)]), u(1, "numSV"),
    i(4, "lon").over(1e7), i(4, "lat").over(1e7), i(4, "height"), i(4, "hMSL"), u(4, "hAcc"),
    u(4, "vAcc"), i(4, "velN"), i(4, "velE"), i(4, "velD"), i(4, "gSpeed"), i(4, "headMot").over(1e5),
    u(4, "sAcc"), u(4, "headAcc").over(1e5), u(2, "pDOP").over(100.0),
    x(2, &[("invalidLlh", 1), ("lastCorrectionAge", 4), ("", 8), ("authTime", 1), ("nmaFixStatus", 1)]),
    reserved(4), i(4, "headVeh").over(1e5), i(2, "magDec").over(100.0), u(2, "magAcc").over(100.0),
];

#[rustfmt::skip]
const NAV_SAT: &[Field] = &[
    u(4, "iTOW"), u(1, "version"), u(1, "numSvs"), reserved(2),
];

#[rustfmt::skip]
const NAV_SAT_EACH: &[Field] = &[
    u(1, "gnssId"), u(1, "svId"), u(1, "cno"), i(1, "elev"), i(2, "azim"), i(2, "prRes").over(10.0),
    x(4, &[("qualityInd", 3), ("svUsed", 1), ("health", 2), ("diffCorr", 1), ("smoothed", 1),
        ("orbitSource", 3), ("ephAvail", 1), ("almAvail", 1), ("anoAvail", 1), ("aopAvail", 1), ("", 1),
        ("sbasCorrUsed", 1), ("rtcmCorrUsed", 1), ("slasCorrUsed", 1), ("spartnCorrUsed", 1), ("prCorrUsed", 1),
        ("crCorrUsed", 1), ("doCorrUsed", 1), ("clasCorrUsed", 1), ("lppCorrUsed", 1), ("hasCorrUsed", 1)]),

];

#[rustfmt::skip]
const NAV_SIG: &[Field] = &[
    u(4, "iTOW"), u(1, "version"), u(1, "numSigs"), reserved(2),
];

#[rustfmt::skip]
const NAV_SIG_EACH: &[Field] = &[
    u(1, "gnssId"), u(1, "svId"), u(1, "sigId"), u(1, "freqId"), i(2, "prRes").over(10.0), u(1, "cno"),
    u(1, "qualityInd"), u(1, "corrSource"), u(1, "ionoModel"),
    x(2, &[("health", 2), ("prSmoothed", 1), ("prUsed", 1), ("crUsed", 1), ("doUsed", 1), ("prCorrUsed", 1),
        ("crCorrUsed", 1), ("doCorrUsed", 1), ("authStatus", 1)]),
    reserved(4),
];

#[rustfmt::skip]
const NAV_CLOCK: &[Field] = &[
    u(4, "iTOW"), i(4, "clkB"), i(4, "clkD"), u(4, "tAcc"), u(4, "fAcc"),
];

#[rustfmt::skip]
const NAV_STATUS: &[Field] = &[
    u(4, "iTOW"), u(1, "gpsFix"), x(1, &[("gpsFixOk", 1), ("diffSoln", 1), ("wknSet", 1), ("towSet", 1)]),
    x(1, &[("diffCorr", 1), ("carrSolnValid", 1), ("", 4), ("mapMatching", 2)]),
    x(1, &[("psmState", 2), ("", 1), ("spoofDetState", 2), ("", 1), ("carrSoln", 2)]), u(4, "ttff"),
    u(4, "msss"),
];

#[rustfmt::skip]
const NAV_HPPOSECEF: &[Field] = &[
    u(1, "version"), reserved(3), u(4, "iTOW"), i(4, "ecefX"), i(4, "ecefY"), i(4, "ecefZ"),
    i(1, "ecefXHp").over(100.0), i(1, "ecefYHp").over(100.0), i(1, "ecefZHp").over(100.0),
    x(1, &[("invalidEcef", 1)]), u(4, "pAcc").over(10.0),
];

#[rustfmt::skip]
const NAV_HPPOSLLH: &[Field] = &[
    u(1, "version"), reserved(2), x(1, &[("invalidLlh", 1)]), u(4, "iTOW"), i(4, "lon").over(1e7),
    i(4, "lat").over(1e7), i(4, "height"), i(4, "hMSL"), i(1, "lonHp").over(1e9),
    i(1, "latHp").over(1e9), i(1, "heightHp").over(10.0), i(1, "hMSLHp").over(10.0),
    u(4, "hAcc").over(10.0), u(4, "vAcc").over(10.0),
];

#[rustfmt::skip]
const NAV_COV: &[Field] = &[
    u(4, "iTOW"), u(1, "version"), u(1, "posCovValid"), u(1, "velCovValid"), reserved(9), r(4, "posCovNN"),
    r(4, "posCovNE"), r(4, "posCovND"), r(4, "posCovEE"), r(4, "posCovED"), r(4, "posCovDD"), r(4, "velCovNN"),
    r(4, "velCovNE"), r(4, "velCovND"), r(4, "velCovEE"), r(4, "velCovED"), r(4, "velCovDD"),
];

#[rustfmt::skip]
const NAV_TIMEGPS: &[Field] = &[
    u(4, "iTOW"), i(4, "fTOW"), i(2, "week"), i(1, "leapS"),
    x(1, &[("towValid", 1), ("weekValid", 1), ("leapSValid", 1)]), u(4, "tAcc"),
];

#[rustfmt::skip]
const NAV_TIMEUTC: &[Field] = &[
    u(4, "iTOW"), u(4, "tAcc"), i(4, "nano"), u(2, "year"), u(1, "month"), u(1, "day"), u(1, "hour"),
    u(1, "min"), u(1, "sec"),
    x(1, &[("validTOW", 1), ("validWKN", 1), ("validUTC", 1), ("authStatus", 1), ("utcStandard", 4)]),
];

#[rustfmt::skip]
const NAV_PL: &[Field] = &[
    u(1, "version"), u(1, "tmirCoeff"), i(1, "tmirExp"), u(1, "plPosValid"), u(1, "plPosFrame"),
    u(1, "plVelValid"), u(1, "plVelFrame"), u(1, "plTimeValid"), reserved(4), u(4, "iTOW"), u(4, "plPos1"),
    u(4, "plPos2"), u(4, "plPos3"), u(4, "plVel1"), u(4, "plVel2"), u(4, "plVel3"), u(2, "plPosHorizOrient"),
    u(2, "plVelHorizOrient"), u(4, "plTime"), reserved(4),
];

#[rustfmt::skip]
const NAV_EOE: &[Field] = &[
    u(4, "iTOW"),
];

#[rustfmt::skip]
const RXM_RAWX: &[Field] = &[
    r(8, "rcvTow"), u(2, "week"), i(1, "leapS"), u(1, "numMeas"),
    x(1, &[("leapSec", 1), ("clkReset", 1), ("", 4), ("msgSource", 2)]), reserved(3),
];

#[rustfmt::skip]
const RXM_RAWX_EACH: &[Field] = &[
    r(8, "prMes"), r(8, "cpMes"), r(4, "doMes"), u(1, "gnssId"), u(1, "svId"), u(1, "sigId"), u(1, "freqId"),
    u(2, "locktime"), u(1, "cno"), x(1, &[("prStd", 4)]), x(1, &[("cpStd", 4)]), x(1, &[("doStd", 4)]),
    x(1, &[("prValid", 1), ("cpValid", 1), ("halfCyc", 1), ("subHalfCyc", 1)]), reserved(1),
];

#[rustfmt::skip]
const RXM_SFRBX: &[Field] = &[
    u(1, "gnssId"), u(1, "svId"), u(1, "sigId"), u(1, "freqId"), u(1, "numWords"), u(1, "chn"), u(1, "version"),
    reserved(1),
];

#[rustfmt::skip]
const RXM_SFRBX_EACH: &[Field] = &[
    u(4, "dwrd"),
];

#[rustfmt::skip]
const RXM_MEASX: &[Field] = &[
    u(1, "version"), reserved(3), u(4, "gpsTOW"), u(4, "gloTOW"), u(4, "bdsTOW"), reserved(4), u(4, "qzssTOW"),
    u(2, "gpsTOWacc").over(16.0), u(2, "gloTOWacc").over(16.0), u(2, "bdsTOWacc").over(16.0), reserved(2),
    u(2, "qzssTOWacc").over(16.0), u(1, "numSv"), x(1, &[("towSet", 2)]), reserved(8),
];

#[rustfmt::skip]
const RXM_MEASX_EACH: &[Field] = &[
    u(1, "gnssId"), u(1, "svId"), u(1, "cNo"), u(1, "mpathIndic"), i(4, "dopplerMS").over(25.0),
    i(4, "dopplerHz").over(5.0), u(2, "wholeChips"), u(2, "fracChips"), u(4, "codePhase").over(2097152.0),
    u(1, "intCodePhase"), u(1, "pseuRangeRMSErr"), reserved(2),
];

#[rustfmt::skip]
const SEC_SIG_V1: &[Field] = &[
    u(1, "version"), reserved(3), x(1, &[("jamDetEnabled", 1), ("jammingState", 2)]), reserved(3),
    x(1, &[("spfDetEnabled", 1), ("spoofingState", 3)]), reserved(3),
];

#[rustfmt::skip]
const SEC_SIG_2: &[Field] = &[
    u(1, "version"),
    x(1, &[("jamDetEnabled", 1), ("jammingState", 2), ("spfDetEnabled", 1), ("spoofingState", 3)]), reserved(1),
    u(1, "jamNumCentFreqs"),
];

#[rustfmt::skip]
const SEC_SIG_2_EACH: &[Field] = &[
    x(4, &[("centFreq", 24), ("jammed", 1)]),
];

#[rustfmt::skip]
const SEC_SIGLOG: &[Field] = &[
    u(1, "version"), u(1, "numEvents"), reserved(6),
];

#[rustfmt::skip]
const SEC_SIGLOG_EACH: &[Field] = &[
    u(4, "timeElapsed"), u(1, "detectionType"), u(1, "eventType"), reserved(2),
];

#[rustfmt::skip]
const MON_RF: &[Field] = &[
    u(1, "version"), u(1, "nBlocks"), x(1, &[("msgSource", 2)]), reserved(1),
];

#[rustfmt::skip]
const MON_RF_EACH: &[Field] = &[
    u(1, "blockId"), x(1, &[("jammingState", 2)]), u(1, "antStatus"), u(1, "antPower"), u(4, "postStatus"),
    reserved(4), u(2, "noisePerMS"), u(2, "agcCnt"), u(1, "jamInd"), i(1, "ofsI"), u(1, "magI"), i(1, "ofsQ"),
    u(1, "magQ"), reserved(3),
];

#[rustfmt::skip]
const TIM_TP: &[Field] = &[
    u(4, "towMS"), u(4, "towSubMS").over(4294967296.0), i(4, "qErr"), u(2, "week"),
    x(1, &[("timeBase", 1), ("utc", 1), ("raim", 2), ("qErrInvalid", 1), ("TpNotLocked", 1)]),
    x(1, &[("timeRefGnss", 4), ("utcStandard", 4)]),
];

#[rustfmt::skip]
const TIM_TM2: &[Field] = &[
    u(1, "ch"),
    x(1, &[("mode", 1), ("run", 1), ("newFallingEdge", 1), ("timeBase", 2), ("utc", 1), ("time", 1),
        ("newRisingEdge", 1)]),
    u(2, "count"), u(2, "wnR"), u(2, "wnF"), u(4, "towMsR"), u(4, "towSubMsR"), u(4, "towMsF"),
    u(4, "towSubMsF"), u(4, "accEst"),
];

/// Numbers and names of further messages, which are counted by their names.
pub const NAMES: &str = "\
    0101 NAV-POSECEF 0102 NAV-POSLLH 0104 NAV-DOP 0105 NAV-ATT 0106 NAV-SOL 0109 NAV-ODO 0110 NAV-RESETODO
    0111 NAV-VELECEF 0112 NAV-VELNED 0117 NAV-PVAT 0123 NAV-TIMEGLO 0124 NAV-TIMEBDS 0125 NAV-TIMEGAL
    0126 NAV-TIMELS 0127 NAV-TIMEQZSS 0128 NAV-NMI 0130 NAV-SVINFO 0131 NAV-DGPS 0132 NAV-SBAS 0134 NAV-ORB
    0139 NAV-GEOFENCE 013b NAV-SVIN 013c NAV-RELPOSNED 013d NAV-EELL 0140 NAV-EKFSTATUS 0142 NAV-SLAS
    0145 NAV-DAHEADING 0160 NAV-AOPSTATUS 0163 NAV-TIMENAVIC 0164 NAV-TIMETRUSTED 0210 RXM-RAW 0211 RXM-SFRB
    0220 RXM-SVSI 0230 RXM-ALM 0231 RXM-EPH 0232 RXM-RTCM 0233 RXM-SPARTN 0234 RXM-COR 0236 RXM-SPARTN-KEY
    0240 RXM-POSREQ 0241 RXM-PMREQ 0259 RXM-RLM 0261 RXM-IMES 0272 RXM-PMP 0273 RXM-QZSSL6 0274 RXM-TM
    0280 RXM-MEASD12 0282 RXM-MEASC12 0284 RXM-MEAS20 0286 RXM-MEAS50 0400 INF-ERROR 0401 INF-WARNING
    0402 INF-NOTICE 0403 INF-TEST 0404 INF-DEBUG 0500 ACK-NAK 0501 ACK-ACK 0a02 MON-IO 0a04 MON-VER
    0a06 MON-MSGPP 0a07 MON-RXBUF 0a08 MON-TXBUF 0a09 MON-HW 0a0b MON-HW2 0a21 MON-RXR 0a27 MON-PATCH
    0a28 MON-GNSS 0a2b MON-PT2 0a2e MON-SMGR 0a2f MON-SPT 0a31 MON-SPAN 0a35 MON-PMP 0a36 MON-COMMS 0a37 MON-HW3
    0a39 MON-SYS 0d04 TIM-SVIN 0d06 TIM-VRFY 0d11 TIM-DOSC 0d12 TIM-TOS 0d13 TIM-SMEAS 0d15 TIM-VCOCAL
    0d16 TIM-FCHG 0d17 TIM-HOC 1002 ESF-MEAS 1003 ESF-RAW 1004 ESF-CAL 1010 ESF-STATUS 1013 ESF-RESETALG
    1014 ESF-ALG 1015 ESF-INS 1310 MGA-SF 1380 MGA-DBD 2103 LOG-ERASE 2104 LOG-STRING 2107 LOG-CREATE
    2108 LOG-INFO 2109 LOG-RETRIEVE 210b LOG-RETRIEVEPOS 210d LOG-RETRIEVESTRING 210e LOG-FINDTIME
    210f LOG-RETRIEVEPOSEXTRA 2110 LOG-RETRIEVEBATCH 2111 LOG-BATCH 2701 SEC-SIGN 2703 SEC-UNIQID 270a SEC-OSNMA
";
