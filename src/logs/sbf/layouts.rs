//! Layouts of SBF blocks from behind their headers: mosaic-X5 reference guide 4.14, 4.2.
//!
//! Names are the guide's, values in its units (radians, metres, milliseconds, parts per million), scales
//! applied.

use crate::table::{Field, Layout, i, r, u, x};

/// Every block with one layout.
#[rustfmt::skip]
pub const LAYOUTS: &[Layout] = &[
    Layout { name: "PVTGeodetic", key: (0, 4007), head: PVT_GEODETIC, repeated: None },
    Layout { name: "PVTCartesian", key: (0, 4006), head: PVT_CARTESIAN, repeated: None },
    Layout { name: "ReceiverTime", key: (0, 5914), head: RECEIVER_TIME, repeated: None },
];

/// Bit fields of Mode.
const MODE: &[(&str, u32)] = &[("Type", 4), ("", 2), ("AutoSet", 1), ("2D", 1)];
/// Bit fields of AlertFlag.
#[rustfmt::skip]
const ALERT: &[(&str, u32)] = &[
    ("RAIMIntegrity", 2), ("GalHPCAFail", 1), ("GalIonStorm", 1), ("", 1), ("SigAuth", 1), ("NavMsgAuth", 1),
];
/// Bit fields of WACorrInfo.
#[rustfmt::skip]
const CORRECTIONS: &[(&str, u32)] = &[
    ("Corr_OrbClkUsed", 1), ("Corr_RngUsed", 1), ("Corr_IonoUsed", 1), ("Corr_OrbAccUsed", 1),
    ("Corr_DO229Active", 1), ("Corr_RTKType", 2),
];

#[rustfmt::skip]
const PVT_GEODETIC: &[Field] = &[
    u(4, "TOW"), u(2, "WNc"), x(1, MODE), u(1, "Error"), r(8, "Latitude"), r(8, "Longitude"), r(8, "Height"),
    r(4, "Undulation"), r(4, "Vn"), r(4, "Ve"), r(4, "Vu"), r(4, "COG"), r(8, "RxClkBias"), r(4, "RxClkDrift"),
    u(1, "TimeSystem"), u(1, "Datum"), u(1, "NrSV"), x(1, CORRECTIONS), u(2, "ReferenceID"),
    u(2, "MeanCorrAge").over(100.0), u(4, "SignalInfo"), x(1, ALERT), u(1, "NrBases"),
    x(2, &[("PPPSeedAge", 12), ("", 1), ("PPPSeedType", 3)]), u(2, "Latency").over(10000.0),
    u(2, "HAccuracy").over(100.0), u(2, "VAccuracy").over(100.0),
    x(1, &[("BaseARP", 1), ("PhaseCtrOffset", 1), ("", 4), ("ARPOffset", 2)]),
];

#[rustfmt::skip]
const PVT_CARTESIAN: &[Field] = &[
    u(4, "TOW"), u(2, "WNc"), x(1, MODE), u(1, "Error"), r(8, "X"), r(8, "Y"), r(8, "Z"), r(4, "Undulation"),
    r(4, "Vx"), r(4, "Vy"), r(4, "Vz"), r(4, "COG"), r(8, "RxClkBias"), r(4, "RxClkDrift"), u(1, "TimeSystem"),
    u(1, "Datum"), u(1, "NrSV"), x(1, CORRECTIONS), u(2, "ReferenceID"), u(2, "MeanCorrAge").over(100.0),
    u(4, "SignalInfo"), x(1, ALERT), u(1, "NrBases"),
    x(2, &[("PPPSeedAge", 12), ("", 1), ("PPPSeedType", 3)]), u(2, "Latency").over(10000.0),
    u(2, "HAccuracy").over(100.0), u(2, "VAccuracy").over(100.0),
    x(1, &[("BaseARP", 1), ("PhaseCtrOffset", 1), ("", 4), ("ARPOffset", 2)]),
];

#[rustfmt::skip]
const RECEIVER_TIME: &[Field] = &[
    u(4, "TOW"), u(2, "WNc"), i(1, "UTCYear"), i(1, "UTCMonth"), i(1, "UTCDay"), i(1, "UTCHour"), i(1, "UTCMin"),
    i(1, "UTCSec"), i(1, "DeltaLS"), u(1, "SyncLevel"),
];

/// Numbers and names of further blocks, which are counted by their names.
pub const NAMES: &str = "\
    4000 MeasExtra 4001 DOP 4013 ChannelStatus 4014 ReceiverStatus 4017 GPSRawCA 4018 GPSRawL2C 4019 GPSRawL5
    4020 GEORawL1 4021 GEORawL5 4022 GALRawFNAV 4023 GALRawINAV 4024 GALRawCNAV 4026 GLORawCA 4047 BDSRaw
    4066 QZSRawL1CA 4067 QZSRawL2C 4068 QZSRawL5 4069 QZSRawL6 4093 NAVICRaw 4218 BDSRawB1C 4219 BDSRawB2a
    4221 GPSRawL1C 4242 BDSRawB2b 4245 GALAuthStatus 4092 RFStatus 4012 SatVisibility 4015 Commands
    5891 GPSNav 5892 GPSAlm 5893 GPSIon 5894 GPSUtc 4002 GALNav 4003 GALAlm 4030 GALIon 4031 GALUtc 4004 GLONav
    4081 BDSNav 4095 QZSNav 5896 GEONav 5902 ReceiverSetup 5905 PosCovCartesian 5906 PosCovGeodetic
    5907 VelCovCartesian 5908 VelCovGeodetic 5911 PVTSupport 5921 EndOfPVT 5922 EndOfMeas 5943 EndOfAtt
    5936 Comment
";
