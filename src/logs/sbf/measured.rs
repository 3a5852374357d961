//! MeasEpoch: pseudoranges, carriers, Dopplers and C/N0 of one epoch (mosaic-X5 reference guide 4.14, 4.2.1).
//!
//! The first signal of a channel has a whole pseudorange. Further signals of the same satellite are offsets
//! from it; every carrier is an offset from its own pseudorange in cycles.

use crate::observed::Observed;
use crate::table::{Table, Value, little_endian};
use gnss::earth::SPEED_OF_LIGHT_MPS;
use gnss::satellite::{Sv, System};

/// Columns of the table: the epoch's, then those of one signal with its numbers put together.
#[rustfmt::skip]
const COLUMNS: [&str; 17] = [
    "TOW", "WNc", "CommonFlags", "CumClkJumps", "RxChannel", "SVID", "AntennaID", "Signal", "sv", "signal", "PR",
    "L", "Doppler", "CN0", "LockTime", "ObsInfo", "FreqNr",
];
/// Bytes of the block before its sub-blocks, behind the header.
const HEAD: usize = 12;

/// Numbers of the first signal of a channel that those of further signals are offsets from.
#[derive(Clone, Copy)]
struct First {
    pseudorange_m: Option<f64>,
    doppler_hz: Option<f64>,
    carrier_hz: Option<f64>,
}

/// Table and observations of a block behind its header; none where it ends before its sub-blocks do.
pub fn read(body: &[u8]) -> Option<(Table, Vec<Observed>)> {
    let at = |from: usize, count: usize| body.get(from..from + count).map(little_endian);
    let (count, sizes) = (at(6, 1)?, [at(7, 1)? as usize, at(8, 1)? as usize]);
    if count > 0 && (sizes[0] < 20 || sizes[1] < 12) {
        return None;
    }
    let flags = at(9, 1)?;
    // Milliseconds.
    let head = [at(0, 4)?, at(4, 2)?, flags, at(10, 1)?].map(|number| Value::Integer(number as i64));
    let mut rest = body.get(HEAD..)?;
    let mut table = Table { name: "MeasEpoch", columns: COLUMNS.to_vec(), rows: Vec::new() };
    let mut values = Vec::new();
    for _ in 0..count {
        let one = take(&mut rest, sizes[0])?;
        let more = one[19];
        let mut channel = Channel::new(one, flags);
        let first = channel.first(one);
        channel.push(&head, &mut table, &mut values);
        for _ in 0..more {
            let two = take(&mut rest, sizes[1])?;
            channel.further(two, first, flags);
            channel.push(&head, &mut table, &mut values);
        }
    }
    if table.rows.is_empty() {
        let mut row = head.to_vec();
        row.resize(COLUMNS.len(), Value::Absent);
        table.rows.push(row);
    }
    Some((table, values))
}

/// The next bytes of a block.
fn take<'a>(rest: &mut &'a [u8], count: usize) -> Option<&'a [u8]> {
    let (part, after) = rest.split_at_checked(count)?;
    *rest = after;
    Some(part)
}

/// One signal of a channel.
struct Channel {
    number: u8,
    antenna: u8,
    svid: u8,
    sv: Option<Sv>,
    /// Number of the signal, RINEX code and carrier.
    signal: u8,
    code: Option<&'static str>,
    carrier_hz: Option<f64>,
    /// Frequency number of a GLONASS satellite.
    slot: Option<i32>,
    info: u8,
    pseudorange_m: Option<f64>,
    carrier_cycles: Option<f64>,
    doppler_hz: Option<f64>,
    cn0_dbhz: Option<f64>,
    lock_s: Option<f64>,
}

impl Channel {
    fn new(one: &[u8], flags: u64) -> Self {
        let mut own = Self {
            number: one[0],
            antenna: 0,
            svid: one[2],
            sv: satellite(one[2]),
            signal: 0,
            code: None,
            carrier_hz: None,
            slot: None,
            info: 0,
            pseudorange_m: None,
            carrier_cycles: None,
            doppler_hz: None,
            cn0_dbhz: None,
            lock_s: None,
        };
        own.kind(one[1], one[18], flags);
        own
    }

    /// Sets the signal by its type and the observation's flags.
    fn kind(&mut self, kind: u8, info: u8, flags: u64) {
        (self.antenna, self.info) = (kind >> 5, info);
        let low = kind & 0x1f;
        self.signal = if low == 31 { 32 + (info >> 3) } else { low };
        let is_fdma = matches!(self.signal, 8..=11);
        self.slot = (is_fdma && info >> 3 > 0).then(|| i32::from(info >> 3) - 8);
        let known = signal(self.signal, flags & 0x40 != 0);
        self.code = known.map(|(code, _)| code);
        self.carrier_hz = match (known, self.signal, self.slot) {
            (Some(_), 8 | 9, slot) => slot.map(|slot| 1e6 * (1602.0 + 0.5625 * f64::from(slot))),
            (Some(_), 10 | 11, slot) => slot.map(|slot| 1e6 * (1246.0 + 0.4375 * f64::from(slot))),
            (known, ..) => known.map(|(_, megahertz)| 1e6 * megahertz),
        };
    }

    /// Reads the first signal of a channel.
    fn first(&mut self, one: &[u8]) -> First {
        let range = u64::from(one[3] & 0xf) << 32 | little_endian(&one[4..8]);
        self.pseudorange_m = (range != 0).then_some(range as f64 * 1e-3);
        let doppler = little_endian(&one[8..12]) as u32 as i32;
        self.doppler_hz = (doppler != i32::MIN).then_some(f64::from(doppler) * 1e-4);
        self.carrier(one[14], &one[12..14]);
        self.power(one[15]);
        let lock = little_endian(&one[16..18]);
        self.lock_s = (lock != 0xffff).then_some(lock as f64);
        First { pseudorange_m: self.pseudorange_m, doppler_hz: self.doppler_hz, carrier_hz: self.carrier_hz }
    }

    /// Reads a further signal of the same channel.
    fn further(&mut self, two: &[u8], first: First, flags: u64) {
        self.kind(two[0], two[5], flags);
        self.lock_s = (two[1] != 0xff).then_some(f64::from(two[1]));
        let (code_high, doppler_high) = ((two[3] << 5) as i8 >> 5, two[3] as i8 >> 3);
        let (code_low, doppler_low) = (little_endian(&two[6..8]) as i64, little_endian(&two[10..12]) as i64);
        let offset_m = 1e-3 * (i64::from(code_high) * 65_536 + code_low) as f64;
        let has_code = (code_high, code_low) != (-4, 0);
        self.pseudorange_m = first.pseudorange_m.filter(|_| has_code).map(|range_m| range_m + offset_m);
        let offset_hz = 1e-4 * (i64::from(doppler_high) * 65_536 + doppler_low) as f64;
        let scale = self.carrier_hz.zip(first.carrier_hz).map(|(own, first)| own / first);
        let has_doppler = (doppler_high, doppler_low) != (-16, 0);
        self.doppler_hz =
            first.doppler_hz.zip(scale).filter(|_| has_doppler).map(|(first, scale)| first * scale + offset_hz);
        self.carrier(two[4], &two[8..10]);
        self.power(two[2]);
    }

    /// Reads the carrier's offset from the pseudorange.
    fn carrier(&mut self, high: u8, low: &[u8]) {
        let (high, low) = (high as i8, little_endian(low) as i64);
        let cycles = 1e-3 * (i64::from(high) * 65_536 + low) as f64;
        let has_carrier = (high, low) != (-128, 0);
        self.carrier_cycles = self
            .pseudorange_m
            .zip(self.carrier_hz)
            .filter(|_| has_carrier)
            .map(|(range_m, hz)| range_m * (hz / SPEED_OF_LIGHT_MPS) + cycles);
    }

    /// Reads C/N0: 10 dB-Hz are left out of all but the P codes of GPS.
    fn power(&mut self, number: u8) {
        let base_dbhz = if matches!(self.signal, 1 | 2) { 0.0 } else { 10.0 };
        self.cn0_dbhz = (number != 255).then_some(0.25 * f64::from(number) + base_dbhz);
    }

    fn push(&self, head: &[Value], table: &mut Table, values: &mut Vec<Observed>) {
        let real = |value: Option<f64>| value.map_or(Value::Absent, Value::Real);
        let mut row = head.to_vec();
        row.extend([self.number, self.svid, self.antenna, self.signal].map(|number| Value::Integer(i64::from(number))));
        row.push(Value::Text(self.sv.map_or_else(String::new, |sv| sv.to_string())));
        row.push(Value::Text(self.code.unwrap_or("").to_owned()));
        row.extend([self.pseudorange_m, self.carrier_cycles, self.doppler_hz, self.cn0_dbhz, self.lock_s].map(real));
        row.push(Value::Integer(i64::from(self.info & 7)));
        row.push(self.slot.map_or(Value::Absent, |slot| Value::Integer(i64::from(slot))));
        table.rows.push(row);
        // The main antenna is the one that a truth has.
        if let (Some(sv), Some(code), 0) = (self.sv, self.code, self.antenna) {
            values.push(Observed {
                sv,
                code,
                pseudorange_m: self.pseudorange_m,
                carrier_cycles: self.carrier_cycles,
                doppler_hz: self.doppler_hz,
                cn0_dbhz: self.cn0_dbhz,
                // Whole seconds, counted up to 65534 or 254.
                lock_s: self.lock_s,
                lost_lock: false,
                half_cycle_ambiguous: self.carrier_cycles.is_some() && self.info & 4 != 0,
            });
        }
    }
}

/// Satellite of a number (4.1.9).
fn satellite(number: u8) -> Option<Sv> {
    let (system, less) = match number {
        1..=37 => (System::Gps, 0),
        38..=61 => (System::Glonass, 37),
        63..=68 => (System::Glonass, 38),
        71..=106 => (System::Galileo, 70),
        // PRN 120 is S20 (RINEX 4.02, table 2).
        120..=140 => (System::Sbas, 100),
        141..=180 => (System::BeiDou, 140),
        181..=190 => (System::Qzss, 180),
        191..=197 => (System::Navic, 190),
        198..=215 => (System::Sbas, 157),
        216..=222 => (System::Navic, 208),
        223..=245 => (System::BeiDou, 182),
        _ => return None,
    };
    Some(Sv { system, number: number - less })
}

/// RINEX code and carrier in MHz of a signal's number (4.1.10); of GLONASS without its channel.
fn signal(number: u8, is_e6b: bool) -> Option<(&'static str, f64)> {
    Some(match number {
        0 | 6 | 17 | 24 => ("1C", 1575.42),
        1 => ("1W", 1575.42),
        2 => ("2W", 1227.6),
        3 | 7 => ("2L", 1227.6),
        4 | 20 | 26 => ("5Q", 1176.45),
        5 | 32 => ("1L", 1575.42),
        8 => ("1C", 1602.0),
        9 => ("1P", 1602.0),
        10 => ("2P", 1246.0),
        11 => ("2C", 1246.0),
        12 => ("3Q", 1202.025),
        13 => ("1P", 1575.42),
        14 => ("5P", 1176.45),
        15 => ("5A", 1176.45),
        19 if is_e6b => ("6B", 1278.75),
        19 => ("6C", 1278.75),
        21 => ("7Q", 1207.14),
        22 => ("8Q", 1191.795),
        25 => ("5I", 1176.45),
        28 => ("2I", 1561.098),
        29 => ("7I", 1207.14),
        30 => ("6I", 1268.52),
        33 => ("1Z", 1575.42),
        34 => ("7D", 1207.14),
        38 => ("1E", 1575.42),
        39 => ("5P", 1176.45),
        _ => return None,
    })
}
